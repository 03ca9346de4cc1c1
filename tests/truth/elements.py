"""Cases with moved elements: DESIGN and SPLICE, and the search for elements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

import texrs
from texrs import DeformationOptions, ElementOptions, elements
from texrs.elements import ElementAnalysis
from texrs.exemplar import segment
from truth.exemplars import clear, colour, deep, floats, sample
from truth.table import Parts, case, parts_of

DESIGNED = ("elements", "segmentation", "rotate", "pixel_counts", "holes", "operations")


@case
def design() -> Parts:
    result = texrs.design(colour("pebbles", 96, 104), (144, 160), seed=3)
    return parts_of(result, report=DESIGNED, stages=("segmentation", "before_blending"))


@case
def design_of_16_bits_that_does_not_repeat() -> Parts:
    exemplar = deep("dots", 112, 96)
    result = texrs.design(
        exemplar,
        (128, 144),
        wrap=False,
        screening=None,
        elements=ElementOptions(segmentation="grid"),
        copies=3,
        deformation=DeformationOptions(rotate=30, translate=0.3),
        patch_size=14,
    )
    return parts_of(result, report=DESIGNED)


@case
def design_on_a_lattice() -> Parts:
    results = texrs.design_variants(colour("net", 96, 96), 2, (112, 128), wrap=(True, False), copies=2, seed=9)
    first, second = (parts_of(each, report=DESIGNED) for each in results)
    return first | {f"second {name}": part for name, part in second.items()}


@case
def design_of_marked_elements() -> Parts:
    beans = sample("beans", 96, 96)
    result = texrs.design(
        beans.image,
        (112, 112),
        elements=ElementOptions(labels=beans.labels),
        deformation=DeformationOptions(operations=3, scale=(0.7, 1.4), allow_mirror=False, start=0.3, growth_rate=1.9),
        screening=0.01,
    )
    return parts_of(result, report=DESIGNED)


@case
def design_mixed_by_a_map_of_weights() -> Parts:
    several = [np.asarray(clear(name, 80, size), np.float32) / 255 for name, size in (("pebbles", 96), ("grit", 80))]
    size = (112, 128)
    ramp = np.linspace(0, 1, size[1]) * np.ones((size[0], 1))
    weights = np.stack([1 - ramp, ramp], axis=-1)
    result = texrs.design(several, size, weights=weights, wrap=(False, True), copies=2, seed=5)
    return parts_of(result, report=DESIGNED, stages=("before_blending",))


@case
def design_with_things_scattered() -> Parts:
    result = texrs.design([clear("grit", 80, 80), clear("pebbles", 80, 96)], (112, 128), density=0.2, copies=1, seed=3)
    return parts_of(result, report=(*DESIGNED, "density"))


@case
def design_as_printed() -> Parts:
    result = texrs.design(colour("pebbles", 96, 96, seed=1), (128, 144), method="paper", seed=2)
    return parts_of(result, report=DESIGNED, stages=("before_blending",))


# --- SPLICE ----------------------------------------------------------------------------------------------------------

SPLICED = ("layout", "holes", "triangles", "flipped", "flipped_rigid", "matches")


def entry(name: str, *size: int, seed: int = 0) -> ElementAnalysis:
    """Return the known elements of a sample."""
    return ElementAnalysis.of_sample(sample(name, *size, seed=seed))


def moved_parts_of(result: texrs.Synthesis, stages: Sequence[str] = ()) -> dict[str, Any]:
    """Return the parts of a splice, with the final position of each element."""
    matches = [{"target": m["found"], "element": m["element"], "point": m["point"]} for m in result.report["matches"]]
    return parts_of(replace(result, report={**result.report, "matches": matches}), report=SPLICED, stages=stages)


@case
def splice_separate_elements() -> Parts:
    result = texrs.splice(entry("dots", 128, 128), entry("pebbles", 128, 128), seed=1)
    drawn = {f"stage {number}": picture for number, picture in enumerate(result.stages.values(), start=1)}
    return moved_parts_of(result) | drawn


@case
def splice_a_connected_figure() -> Parts:
    result = texrs.splice(
        entry("net", 128, 128), entry("pebbles", 128, 128, seed=1), (112, 128), use_cells=False, seed=1
    )
    return moved_parts_of(result, stages=("filled",))


@case
def splice_jointed_elements() -> Parts:
    result = texrs.splice(
        entry("bricks", 128, 112), entry("dots", 128, 128, seed=1), snap_rows=True, use_cells=False, seed=1
    )
    return moved_parts_of(result, stages=("filled",))


@case
def splice_of_cells() -> Parts:
    target = entry("pebbles", 128, 128, seed=1)
    parts: dict[str, object] = {}
    for name, size in (("net", (112, 128)), ("bricks", (128, 128))):
        found = parts_of(texrs.splice(entry(name, 128, 128), target, size, seed=1), report=("cells",))
        parts |= {f"{name} {part}": value for part, value in found.items()}
    return parts


@case
def splice_as_printed() -> Parts:
    parts: dict[str, object] = {}
    for name in ("dots", "net", "bricks"):
        result = texrs.splice(entry(name, 112, 112, seed=2), entry("pebbles", 112, 112), seed=4, method="paper")
        parts |= {f"{name} {part}": value for part, value in moved_parts_of(result).items()}
    return parts


@case
def splice_in_preview() -> Parts:
    result = texrs.splice(entry("dots", 128, 112, seed=1), entry("bricks", 128, 128), method="preview", align=False)
    return moved_parts_of(result)


@case
def splice_a_picture_of_16_bits() -> Parts:
    result = texrs.splice(deep("dots", 80, 80, seed=3), entry("dots", 80, 96, seed=4), (96, 96), refine=False)
    return moved_parts_of(result)


@case
def splice_across_borders() -> Parts:
    """Splice two periodic textures."""
    entries = [
        elements.analyse(known.image, mask=known.mask, layout="disjoint", wrap=True)
        for known in (sample(name, 112, 112, seed=2, wrap=True) for name in ("dots", "pebbles"))
    ]
    return moved_parts_of(texrs.splice(*entries, seed=3))


@case
def self_splice_by_steps() -> Parts:
    steps = [
        {"op": "scale", "factor": [1.1, 1.0]},
        {"op": "randomise", "amount": 0.1},
        {"op": "rows", "by": 4},
        {"op": "shift", "by": [3, -2]},
        {"op": "remove", "element": 5},
    ]
    result = texrs.self_splice(entry("dots", 128, 128, seed=5), steps, seed=7)
    return moved_parts_of(result)


@case
def self_splice_of_single_elements() -> Parts:
    steps = [{"op": "move", "element": 4, "by": [6, -9]}, {"op": "move", "element": 1, "to": [60, 50]}]
    return moved_parts_of(texrs.self_splice(entry("dots", 112, 128, seed=4), steps))


@case
def self_splice_made_regular() -> Parts:
    stones = entry("pebbles", 112, 112, seed=3)
    exemplar = replace(stones, image=floats("pebbles", 112, 112, seed=3))
    result = texrs.self_splice(exemplar, {"op": "regularise", "amount": 0.6})
    return moved_parts_of(result)


@case
def self_splice_in_another_size() -> Parts:
    made = [
        texrs.self_splice(entry("dots", 96, 96, seed=4), {"op": "randomise", "amount": 0.1}, (128, 144), seed=3),
        texrs.self_splice(entry("pebbles", 112, 128, seed=2), size=(96, 176), seed=3),
    ]
    return {f"{number} {name}": part for number, one in enumerate(made) for name, part in moved_parts_of(one).items()}


# --- what they know of an exemplar -----------------------------------------------------------------------------------


@case
def segments() -> Parts:
    parts: dict[str, object] = {}
    pictures = {name: colour(name, 96, 96) for name in SEGMENTED}
    # An image of few colours has many equal differences.
    pictures["few colours"] = colour("pebbles", 64, 64) & 0xE0
    for name, picture in pictures.items():
        found = segment(picture, SEGMENTED.get(name, ElementOptions()))
        parts |= {
            f"{name} layers": found.layers,
            f"{name} elements": found.elements,
            f"{name} kind": found.kind,
            f"{name} lattice": found.lattice and (found.lattice.a, found.lattice.b),
        }
    return parts


SEGMENTED = {
    "pebbles": ElementOptions(),
    "net": ElementOptions(),
    "scales": ElementOptions(),
    "beans": ElementOptions(layers=3),
    "leaves_and_flowers": ElementOptions(segmentation="components"),
    "bark": ElementOptions(segmentation="none", layers=4),
    "grit": ElementOptions(),
}


def found_in(entry: ElementAnalysis) -> Parts:
    """Return the result of an analysis. Similarities come from Fourier transforms."""
    return {
        "points": entry.points,
        "mask": entry.mask,
        "box": entry.box,
        "layout": entry.layout,
        "scores": entry.scores,
        "directions": entry.directions,
        "angles": entry.angles,
        "scales": entry.scales,
    }


@case
def elements_found_by_itself() -> Parts:
    return found_in(elements.analyse(colour("net", 80, 80)))


@case
def elements_found_with_help() -> Parts:
    pebbles = sample("pebbles", 96, 96, seed=6)
    box, between = boxed(pebbles)
    ways: dict[str, dict[str, object]] = {
        "turned": {
            "box": box,
            "background": between,
            "search": elements.ElementSearch(rotations=4, scales=(0.8, 1.0, 1.25)),
        },
        "as printed": {"box": box, "background": between, "method": "paper"},
        "listed": {"points": pebbles.centres},
    }
    parts: dict[str, object] = {}
    for way, options in ways.items():
        found = found_in(elements.analyse(pebbles.image, layout="disjoint", **options))
        parts |= {f"{way} {name}": part for name, part in found.items()}
    return parts


def boxed(known: texrs.samples.Sample) -> tuple[Sequence[float], np.ndarray]:
    """Return the box around the element nearest to the middle, and some places between elements."""
    number = np.hypot(*(known.centres - np.array(known.mask.shape) / 2).T).argmin()
    rows, columns = np.nonzero(known.labels == number + 1)
    box = [
        (rows.min() + rows.max()) / 2,
        (columns.min() + columns.max()) / 2,
        np.ptp(rows) + 1,
        np.ptp(columns) + 1,
    ]
    between = np.argwhere(known.labels == 0)
    return [float(v) for v in box], between[:: len(between) // 12]

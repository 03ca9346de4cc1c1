"""The docstrings of the verbs list all stages and report keys, compared with real results."""

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

import texrs
from texrs import layouts, samples

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "docs"))

import results

Calls = Iterator[texrs.Synthesis]
HOLE = np.zeros((96, 96), bool)
HOLE[40:56, 40:60] = True


def design() -> Calls:
    stones, dots = samples.pebbles((64, 64)).image, samples.dots((64, 64)).image
    yield texrs.design(stones, 96, seed=1)
    yield texrs.design(stones, 80, method="paper", seed=1)
    yield texrs.design([stones, dots], 96, density=0.2, seed=1)


def design_variants() -> Calls:
    yield from texrs.design_variants(samples.pebbles((64, 64)).image, 1, 96, seed=1)
    yield from texrs.design_variants(samples.pebbles((64, 64)).image, 1, 96, seed=1, method="paper")


def tile() -> Calls:
    stones = samples.pebbles((96, 96)).image
    yield texrs.tile(stones)
    yield texrs.tile(stones, size=128)


def inpaint() -> Calls:
    wall = samples.bricks((96, 96)).image
    yield texrs.inpaint(wall, HOLE)
    yield texrs.inpaint(wall, HOLE, method="optimise")
    block = samples.stripes((32, 32, 32)).image
    inside = np.zeros((32, 32, 32), bool)
    inside[8:16, 8:16, 8:16] = True
    yield texrs.inpaint(block, inside)


def splice() -> Calls:
    dots, net, wall = (samples.load(name, size=(128, 128)) for name in ("dots", "net", "bricks"))
    buttons, knots = texrs.ElementAnalysis.of_sample(dots), texrs.ElementAnalysis.of_sample(net)
    yield texrs.splice(buttons, knots, seed=1)
    yield texrs.splice(buttons, knots, method="paper", seed=1)
    yield texrs.splice(knots, buttons, use_nets=True, seed=1)
    yield texrs.splice(wall.image, layouts.lattice((128, 128), (32, 0), (0, 48)), seed=1)


def self_splice() -> Calls:
    dots = texrs.ElementAnalysis.of_sample(samples.dots((128, 128)))
    yield texrs.self_splice(dots, "randomise", seed=1)
    yield texrs.self_splice(dots, "randomise", size=(160, 160), seed=1)
    yield texrs.self_splice(dots, size=(160, 160), seed=1)
    yield texrs.self_splice(dots, "randomise", method="paper", seed=1)


def synthesize() -> Calls:
    weave = samples.weave((64, 64)).image
    yield texrs.synthesize(weave, 64, seed=1)
    yield texrs.synthesize(weave, 64, quality="fast", seed=1)
    yield texrs.synthesize(weave, 64, method="paper", seed=1)
    yield texrs.synthesize(weave, 64, patches="auto", seed=1)


def solid() -> Calls:
    stone = samples.particles((32, 32, 32)).image
    yield texrs.solid(stone, 32, seed=1, spacing=(2, 1, 1))
    yield texrs.solid(stone, 32, quality="fast", seed=1)
    yield texrs.solid(stone, 32, method="paper", seed=1)


def perspective() -> Calls:
    bricks = samples.bricks((96, 96)).image
    yield texrs.perspective(bricks, "front", 96, target="plane:slant=30,tilt=90,fov=50", seed=1)
    floor = samples.tilted_discs((96, 96))
    yield texrs.perspective(floor.image, np.asarray(floor.scale_map, np.float32), method="paper", seed=1)


def rectify() -> Calls:
    yield texrs.rectify(samples.tilted_discs((160, 160)).image, view=texrs.PlaneView(slant=50, tilt=90), seed=1)


def remove() -> Calls:
    yield texrs.remove(samples.tilted_discs((96, 96)).image, HOLE, view=texrs.PlaneView(slant=50, tilt=90), seed=1)


def extend() -> Calls:
    yield texrs.extend(samples.tilted_discs((96, 96)).image, left=16, view=texrs.PlaneView(slant=50, tilt=90), seed=1)


def plane_texture() -> Calls:
    yield texrs.PlaneTexture(samples.weave((48, 48)).image, seed=1).window((0, 0), (32, 32))


def corner_tiles() -> Calls:
    yield texrs.CornerTiles(samples.pebbles((64, 64)).image, seed=1).window((0, 0), (32, 32))


CALLS: dict[str, Callable[[], Calls]] = {
    name: {"PlaneTexture.window": plane_texture, "CornerTiles.window": corner_tiles}.get(name) or globals()[name]
    for name in results.VERBS
}


@pytest.mark.parametrize("verb", results.VERBS)
def test_docstrings_name_all_stages_and_report_keys(verb: str) -> None:
    stages, report = results.read_returns(verb)
    made = list(CALLS[verb]())
    shown = {name for each in made for name in each.stages}
    shown = {"level N" if name.startswith("level ") else name for name in shown}
    said = {name for each in made for name in each.report} - set(results.COMMON)
    assert shown == set(stages), f"missing {shown - set(stages)}, not real {set(stages) - shown}"
    assert said == set(report), f"missing {said - set(report)}, not real {set(report) - said}"
    assert all(stages.values())
    assert all(report.values())


def test_materials_add_their_maps_and_guide() -> None:
    stones = samples.pebbles((64, 64)).image
    made = texrs.tile(texrs.Material({"albedo": stones, "height": stones[..., 1].astype("float32")}))
    assert "maps" in made.report
    assert set(made.stages) - set(results.read_returns("tile")[0]) == set(results.MATERIAL_STAGES)

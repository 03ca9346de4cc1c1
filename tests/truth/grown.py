"""Cases grown by corrected coordinates: images and volumes under fields, windows, and their quality measures."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

import texrs
from texrs import Constraints, Exemplar, Guide, PlaneTexture, SolidTexture, fields, volume
from texrs.exemplar._exemplar import _FACTS
from truth.exemplars import box, channels, classes, clear, colour, deep, floats
from truth.table import Parts, case, parts_of

CUBE = (32, 32, 32)
GROWN = ("periodic_axes", "interpolation", "constrained_points", "levels")

# --- pictures --------------------------------------------------------------------------------------------------------


@case
def synthesize() -> Parts:
    return parts_of(texrs.synthesize(colour("weave", 80, 96), (144, 160), wrap=(True, False), seed=2), report=GROWN)


@case
def synthesize_under_a_zigzag() -> Parts:
    field = fields.zigzag(period=48, angle=25, axes=2)
    result = texrs.synthesize(floats("bark", 64, 80), (128, 144), field=field, interpolation="linear", seed=1)
    return parts_of(result, report=GROWN)


@case
def synthesize_under_an_array() -> Parts:
    turns = [[fields.rotation(angle, axes=2).constant * size for angle, size in row] for row in FRAMES]
    field = fields.from_array(np.array(turns), extent=(96, 128))
    result = texrs.synthesize(Exemplar(channels("dots", 80, 80), repeat=False), (96, 128), field=field, quality="fast")
    return parts_of(result, report=GROWN)


FRAMES = [[(-30, 1.0), (0, 1.3), (30, 1.0)], [(60, 0.8), (20, 1.0), (-20, 1.2)]]


@case
def synthesize_around_what_is_held() -> Parts:
    exemplar = deep("net", 96, 96)
    held = box((112, 112), (20, 60), (30, 90))
    coordinates = np.zeros((112, 112, 2), np.float32)
    coordinates[held] = np.argwhere(held) - np.array([10, -5])
    trend = Guide(
        exemplar=np.linspace(0, 1, 96)[:, np.newaxis], output=np.linspace(1, 0, 112)[:, np.newaxis], weight=0.5
    )
    constraints = Constraints(mask=held, coordinates=coordinates)
    result = texrs.synthesize(exemplar, 112, constraints=constraints, guide=trend)
    return parts_of(result, report=GROWN)


@case
def synthesize_by_optimising() -> Parts:
    """Use an exemplar with separate elements, and one without."""
    parts: dict[str, object] = {}
    for name, exemplar in {"accepted": clear("scales", 64, 64, wrap=True), "refused": deep("bricks", 64, 64)}.items():
        result = texrs.synthesize(exemplar, (96, 80), quality="optimise", wrap=True)
        parts |= {f"{name} {part}": value for part, value in parts_of(result, report=[*GROWN, "stitched"]).items()}
    return parts


@case
def synthesize_as_printed() -> Parts:
    field = fields.scale_ramp(1, 2, axes=2)
    result = texrs.synthesize(colour("scales", 64, 64), (112, 128), field=field, method="paper", seed=6)
    return parts_of(result, report=GROWN)


# --- volumes ---------------------------------------------------------------------------------------------------------


@case
def solid_round_an_axis() -> Parts:
    field = fields.circular(axis="x")
    return parts_of(texrs.solid(colour("stripes", *CUBE), (20, 24, 28), field=field, seed=1), report=GROWN)


@case
def solid_that_repeats() -> Parts:
    exemplar = deep("weave_solid", *CUBE, seed=3, wrap=True)
    return parts_of(texrs.solid(exemplar, 40, quality="fast", wrap=(True, False, True), seed=2), report=GROWN)


@case
def solid_by_optimising() -> Parts:
    result = texrs.solid(floats("wood_solid", *CUBE), 16, quality="optimise")
    return parts_of(result, report=[*GROWN, "stitched"])


@case
def solid_of_labels() -> Parts:
    exemplar = classes("weave_solid", *CUBE, seed=3)
    field = fields.zigzag(period=20, angle=20)
    return parts_of(
        texrs.solid(Exemplar(exemplar, axes=3, labels=True), (22, 26, 24), field=field, seed=4), report=GROWN
    )


@case
def solid_around_what_is_held() -> Parts:
    exemplar = colour("stripes", *CUBE, seed=1)
    held = box((24, 24, 26), (6, 16), (8, 18), (4, 14))
    values = np.zeros((24, 24, 26, 3), np.uint8)
    values[held] = exemplar[box(CUBE, (9, 19), (9, 19), (9, 19))]
    return parts_of(
        texrs.solid(exemplar, held.shape, constraints=Constraints(mask=held, values=values), seed=3), report=GROWN
    )


@case
def solid_along_a_trend() -> Parts:
    trend = Guide(exemplar=np.linspace(0, 1, 32)[:, np.newaxis, np.newaxis], output=np.linspace(1, 0, 24))
    exemplar = clear("wood_solid", *CUBE, seed=3)
    return parts_of(texrs.solid(exemplar, (28, 28, 24), quality="fast", guide=trend, seed=6), report=GROWN)


@case
def solid_as_printed() -> Parts:
    field = fields.rotation_3d(15, 25)
    result = texrs.solid(colour("particles", *CUBE, seed=2), 28, field=field, method="paper", seed=5)
    return parts_of(result, report=GROWN)


@case
def frames_of_all_fields() -> Parts:
    corners = [(0, 0, 0), (10, 0, 12), (4, 9, 3)]
    kinds = [fields.rotation(40), fields.constant(1.3 * np.eye(3)), fields.shear(0.4)]
    several = {
        "spiral": fields.spiral(angle=20, axis="y"),
        "zigzag": fields.zigzag(period=7, plane="yz"),
        "ramp": fields.scale_ramp(0.7, 1.8, axis="z"),
        "slants": fields.rotation_3d(20, -35),
        "points": fields.interpolate(corners, [kind.frames((0, 0, 0)) for kind in kinds]),
        "function": fields.from_function(lambda points: (1 + points[:, :1, np.newaxis] / 20) * np.eye(3)),
        "words": fields.parse("circular:axis=z,radial=y,centre=3x4x5"),
        "inverse": fields.spiral(angle=20).inverse(),
    }
    shape = (9, 10, 11)
    return {name: field.over(shape).lattice(shape) for name, field in several.items()}


# --- windows ---------------------------------------------------------------------------------------------------------


@case
def windows_of_a_plane() -> Parts:
    field = fields.spiral(angle=30, centre=(0, 0), axes=2)
    plane = PlaneTexture(colour("weave", 64, 64, seed=3), field=field, seed=2, quality="fast")
    parts = parts_of(plane.window((-40, 100), (64, 80)), report=("origin", "periodic_axes"))
    return parts | {"row": plane[-30, 90:140], "part": plane[10:20, 100:120]}


@case
def windows_of_a_solid() -> Parts:
    texture = SolidTexture(Exemplar(deep("stripes", *CUBE, seed=2), axes=3, repeat=False), seed=1, quality="fast")
    parts = parts_of(texture.window((-4, 98, 2), (4, 8, 8)), report=("origin", "periodic_axes"))
    return parts | {"slice": texture.slice((-2, 102, 6), normal=(1, 1, 0), size=4)}


@case
def patches_of_a_plane() -> Parts:
    field = fields.spiral(angle=30, centre=(0, 0), axes=2)
    plane = PlaneTexture(colour("weave", 48, 48, seed=3), field=field, seed=2)
    parts = parts_of(plane.window((-40, 100), (40, 50)), report=("origin", "periodic_axes", "quality"))
    return parts | {"row": plane[-30, 90:140]}


@case
def patches_of_a_solid() -> Parts:
    texture = SolidTexture(Exemplar(deep("stripes", *CUBE, seed=2), axes=3, repeat=False), seed=1)
    parts = parts_of(texture.window((-4, 98, 2), (4, 8, 8)), report=("origin", "periodic_axes", "quality"))
    return parts | {"slice": texture.slice((-2, 102, 6), normal=(1, 1, 0), size=4)}


@case
def pictures_of_volumes() -> Parts:
    image, labels = colour("particles", *CUBE, seed=2), classes("weave_solid", *CUBE, seed=3)
    vertices, faces = volume.extract_surface(labels == 2)
    return {
        "slices": volume.slices(image, (3, 20, 30)),
        "oblique": volume.oblique_slice(image, normal=(1, 2, 0.5)),
        "cube": volume.render_block(image, 80),
        "paint": volume.label_to_color(labels.astype(np.int32)),
        "vertices": vertices,
        "faces": faces,
    }


# --- analysis and figures --------------------------------------------------------------------------------------------


@case
def analyses() -> Parts:
    """Clear the cache of analyses first, so that each number of threads computes them."""
    exemplars = {
        "colours": (colour("weave", 48, 64), 2),
        "channels": (channels("grit", 48, 48), 2),
        "labels": (classes("weave_solid", *CUBE, seed=4), 3),
        "volume": (deep("particles", *CUBE, seed=5), 3),
    }
    _FACTS.clear()
    parts: dict[str, object] = {}
    for name, (exemplar, axes) in exemplars.items():
        found = Exemplar(exemplar, axes=axes).analyse()
        parts |= {f"{name} wrap": found.wrap}
        parts |= {f"{name} level {i}": level.arrays()["features"] for i, level in enumerate(found.levels)}
    return parts


@case
def comparisons() -> Parts:
    exemplar = colour("stripes", *CUBE)
    field = fields.circular(axis="x")
    result = texrs.solid(exemplar, (24, 28, 28), field=field, quality="fast", seed=8)
    found = volume.compare(exemplar, result.image, result.source_map, field)
    flat = volume.compare(colour("pebbles", 64, 64), colour("pebbles", 64, 80, seed=1))
    labels = [classes("weave_solid", *CUBE, seed=seed) for seed in (3, 4)]
    classed = volume.compare(*labels, classes=None, chosen=(2, 3))
    parts: dict[str, object] = {}
    for name, each in {"solid": found, "picture": flat, "labels": classed}.items():
        parts |= {f"{name} {part}": figures for part, figures in asdict(each).items()}
    return parts

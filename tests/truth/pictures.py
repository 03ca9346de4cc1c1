"""Cases with whole images: PERSPECTIVE, scale maps, tiling, inpainting, colours and source maps."""

from __future__ import annotations

import numpy as np

import texrs
from texrs import scale_maps
from texrs.blending import blend
from texrs.kernels import warp
from truth.exemplars import box, channels, clear, colour, deep, floats, grey, normals, sample
from truth.table import Parts, case, parts_of

# --- Samples ---------------------------------------------------------------------------------------------------------


@case
def samples_of_each_kind() -> Parts:
    solid = ("particles", "stripes", "weave_solid", "wood_solid")
    made = {
        name: sample(name, *((32, 36, 40) if name in solid else (56, 72)), seed=7) for name in texrs.samples.names()
    }
    answers = ("image", "centres", "labels", "mask", "scale_map", "jacobians")
    return {f"{name} {part}": getattr(each, part) for name, each in made.items() for part in answers}


# --- PERSPECTIVE -----------------------------------------------------------------------------------------------------

SCALED = ("sheet", "outside", "scale_error", "stitched")


@case
def perspective() -> Parts:
    floor = sample("tilted_discs", 96, 96)
    return parts_of(texrs.perspective(floor.image, floor.scale_map, (112, 144), seed=1), report=SCALED)


@case
def perspective_with_a_target() -> Parts:
    wall = sample("tilted_bricks", 96, 112)
    target = scale_maps.from_angles((96, 112), 55, 90)
    result = texrs.perspective(
        deep("tilted_bricks", 96, 112),
        wall.scale_map,
        (96, 112),
        target=target,
        wrap=(False, True),
        scale_weight=2,
        interpolation="linear",
        seed=4,
    )
    return parts_of(result, report=SCALED, stages=("target",))


@case
def perspective_from_copies_of_given_sizes() -> Parts:
    floor = sample("tilted_discs", 64, 80)
    exemplar = channels("tilted_discs", 64, 80)
    result = texrs.perspective(exemplar, floor.scale_map, (80, 80), augment_scales=(0.75, 1, 1.3))
    return parts_of(result, report=SCALED)


@case
def perspective_on_a_column() -> Parts:
    x = np.linspace(-0.95, 0.95, 96)[np.newaxis].repeat(80, axis=0)
    column = np.stack([x, 0 * x, np.sqrt(1 - x * x)], axis=-1)
    waves = 30 * np.sin(np.pi * np.arange(96) / 48)[np.newaxis]
    result = texrs.perspective(colour("weave", 96, 96), "front", target=column, direction=waves, seed=3)
    return parts_of(result, report=SCALED, stages=("target",))


@case
def perspective_on_another_plane() -> Parts:
    exemplar = colour("tilted_discs", 96, 96)
    plane = texrs.Plane((96, 96), 50, 85, 37)
    result = texrs.perspective(
        exemplar, plane, (80, 96), target="plane:slant=45,tilt=30,fov=50", direction=20.0, seed=2
    )
    return parts_of(result, report=SCALED, stages=("target",))


@case
def perspective_as_printed() -> Parts:
    floor = sample("tilted_discs", 56, 56)
    result = texrs.perspective(floor.image, floor.scale_map, (48, 48), method="paper", seed=2)
    return parts_of(result, report=("energies",), stages=("before_blending",))


@case
def scale_maps_measured() -> Parts:
    floor = sample("tilted_discs", 128, 144)
    mask = scale_maps.auto_mask(floor.image)
    known = ~box(mask.shape, (40, 80), (50, 100))
    measured = {
        "boundary": scale_maps.from_mask(mask, trend="plane", foreshortened=True),
        "skeleton": scale_maps.from_mask(mask, measure="skeleton", trend="quadratic"),
        "count": scale_maps.from_mask(floor.mask, measure="count", trend="linear"),
        "known": scale_maps.from_mask(floor.mask, window=40, known=known),
        "area": scale_maps.from_mask(mask, measure="area"),
    }
    return {"mask": mask, "picture": scale_maps.picture(floor.scale_map), **measured}


@case
def scale_maps_edited() -> Parts:
    plane = scale_maps.from_angles((96, 112), 50, 70)
    edited = scale_maps.edit(
        plane,
        [
            {"op": "magnify", "region": [48, 40, 20], "factor": 1.8},
            {"op": "minify", "region": [[5, 60], [40, 60], [30, 100]], "factor": 1.5},
            {"op": "set", "region": [70, 60, 90, 100], "value": 0.7, "feather": 3},
            {"op": "vary", "gain": 0.8},
            {"op": "brush", "points": [[10, 10], [60, 30]], "radius": 6, "factor": 1.4},
            {"op": "duplicate", "region": [48, 40, 16], "to": [30, 80], "mode": "ratio"},
            {"op": "ramp", "region": [0, 0, 30, 30], "start": [0, 0], "end": [30, 30], "values": [0.8, 1.6]},
            {"op": "smooth", "sigma": 2},
        ],
    )
    maps = {
        "angles": plane,
        "camera": scale_maps.from_angles((96, 112), 50, 200, fov=50),
        "edited": edited,
        "stretched": scale_maps.resample(edited, (70, 150)),
        "continued": scale_maps.resample(edited, (130, 120), "extend"),
        "filled": scale_maps.extend(edited, ~box((96, 112), (20, 60), (30, 90))),
    }
    seen = {"grey": scale_maps.encode(edited), "picture": scale_maps.picture(edited, 4)}
    return maps | seen


# --- tile and inpaint -----------------------------------------------------------------------------------------------


@case
def rectified_by_angles() -> Parts:
    wall = deep("tilted_bricks", 112, 128)
    return parts_of(texrs.rectify(wall, view=texrs.PlaneView(slant=40, tilt=200, fov=60), wrap=(False, True), size=96))


@case
def rectified_as_found() -> Parts:
    floor = sample("tilted_discs", 112, 128)
    return parts_of(texrs.rectify(floor.image, view=texrs.planes.find(floor.image)), report=("plane",))


@case
def extended() -> Parts:
    floor = sample("tilted_discs", 96, 112)
    return parts_of(texrs.extend(floor.image, left=24, right=32, view=texrs.PlaneView(slant=34, fov=60), seed=1))


@case
def removed() -> Parts:
    floor = sample("tilted_discs", 112, 128).image.copy()
    floor[:20] = floor[:1, :1]
    return parts_of(
        texrs.remove(floor, box((112, 128), (50, 80), (40, 70)), view=texrs.PlaneView(slant=34, fov=60), seed=1)
    )


@case
def tile() -> Parts:
    result = texrs.tile(colour("pebbles", 144, 160))
    return parts_of(result, report=("overlap", "joints"), stages=("shifted", "source_regions"))


@case
def tile_along_columns() -> Parts:
    return parts_of(texrs.tile(channels("grit", 96, 128), wrap=(False, True), overlap=24), report=("overlap", "joints"))


COMPLETED = ("filled", "replaced_outside", "patch_size", "patches")


@case
def inpaint_with_patches() -> Parts:
    hole = box((128, 144), (40, 90), (50, 100)) | box((128, 144), (0, 30), (120, 144))
    result = texrs.inpaint(colour("pebbles", 128, 144, seed=4), hole, boundary_width=5, screening=0.003, seed=3)
    return parts_of(result, report=COMPLETED, stages=("known", "patches", "before_blending"))


@case
def inpaint_what_is_transparent() -> Parts:
    image = clear("weave", 96, 96).copy()
    image[box(image.shape[:2], (70, 96), (20, 60)), 3] = 0
    return parts_of(
        texrs.inpaint(image, texrs.Mask("alpha", threshold=1), wrap=True, allow_mirror=False, patch_size=12),
        report=COMPLETED,
    )


@case
def inpaint_by_optimising() -> Parts:
    hole = box((112, 112), (30, 80), (30, 80))
    result = texrs.inpaint(deep("bark", 112, 112), hole, method="optimise", seed=5, wrap=(True, False))
    return parts_of(result, report=("filled", "levels"))


@case
def inpaint_with_a_scale_map() -> Parts:
    floor = sample("tilted_discs", 128, 128, seed=1)
    hole = box((128, 128), (50, 100), (40, 90))
    scale = np.where(hole, np.nan, floor.scale_map)
    parts: dict[str, object] = {}
    for method, given in (("patch", scale), ("optimise", "auto")):
        found = parts_of(texrs.inpaint(floor.image, hole, scale_map=given, method=method), report=("filled",))
        parts |= {f"{method} {name}": part for name, part in found.items()}
    return parts


@case
def inpaint_with_a_source() -> Parts:
    hole = box((96, 112), (20, 70), (30, 80))
    other = floats("pebbles", 80, 96, seed=5)
    result = texrs.inpaint(floats("grit", 96, 112), hole, exemplar=other, screening=0.001, boundary_width=2, seed=1)
    return parts_of(result, report=COMPLETED, stages=("patches", "before_blending"))


# --- colours and source maps -----------------------------------------------------------------------------------------


def designed(name: str, seed: int) -> texrs.Synthesis:
    """Return a texture with rotated and mirrored elements, including seams."""
    return texrs.design(colour(name, 96, 96, seed=seed), (112, 128), seed=seed, screening=None, copies=2)


@case
def blends() -> Parts:
    source = designed("pebbles", 7).source_map
    within = box((112, 128), (16, 100), (10, 120))
    known = ~box((96, 96), (0, 8), (0, 96))
    args = ("pebbles", 96, 96)
    heights, slopes = floats(*args, seed=7), normals(*args, seed=7)
    return {
        "floats": blend(source, heights, wrap=True),
        "paper": blend(source, heights, wrap=False, screening=0, outlines=False),
        "near seams": blend(source, grey(*args, seed=7), wrap=(True, False), band=6),
        "within": blend(source, heights, wrap=False, screening=0.01, within=within, known=known),
        "normals": blend(source, slopes, wrap=True, map_type="normal", green="down", interpolation="linear"),
    }


@case
def source_maps() -> Parts:
    source = designed("leaves_and_flowers", 8).source_map
    args = ("leaves_and_flowers", 96, 96)
    tiled = texrs.tile(source.render(colour(*args, seed=8))).source_map.compose(source)
    reuse = source.reuse()
    return {
        "nearest": source.render(deep(*args, seed=8), interpolation="nearest"),
        "linear": source.render(channels(*args, seed=8), interpolation="linear"),
        "cubic": source.render(clear(*args, seed=8)),
        "normals": source.render(normals(*args, seed=8), map_type="normal"),
        "continues": source.is_coherent(1, wrap=True),
        "jacobians": source.jacobians(),
        "composed coordinates": tiled.coordinates,
        "composed label": tiled.label,
        "composed jacobian": tiled.jacobian_array(),
        "reuse": [reuse.verbatim, reuse.largest, reuse.regions],
    }


@case
def warped_by_points() -> Parts:
    source = np.array([[r, c] for r in (0, 30, 63) for c in (0, 40, 79)])
    target = source + np.random.default_rng(2).integers(-9, 10, source.shape) * (source % 9 > 0)
    found = warp.from_points(source, target, (64, 80))
    return {"coordinates": found.coordinates, "triangle": found.triangle, "jacobians": found.frames}

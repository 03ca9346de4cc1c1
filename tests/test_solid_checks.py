"""SOLID and its acceptance checks, on generated volumes, and each check on failures.

`solid_checks` has the measures. `benches/solid_table.py` makes the table of more textures and seeds.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import solid_checks as checks
import texrs
from texrs import fields, samples
from texrs._engine.pyramid import ONE, Region, to_fixed, upsample
from texrs.growth import Settings, Windows
from texrs.source_map import SourceMap

FIELDS = {
    "identity": fields.identity(),
    "zigzag": fields.zigzag(period=64, angle=30, plane="xz"),
    "circular": fields.circular(axis="x", radial="z"),
}
SIDE = {"stripes": 60, "particles": 60, "weave_solid": 60}


@cache
def exemplar(name):
    return samples.load(name)


@cache
def made(name, kind, seed=0):
    return texrs.solid(exemplar(name).image, SIDE[name], seed=seed, field=FIELDS[kind])


# Rare elements and layers are few in a small volume, so the limit applies to the mean of several.
SEEDS = dict.fromkeys(("s2", "s3", "s3b"), (0, 1))


def measure(check, name, kind):
    return checks.mean([measured(check, name, kind, seed) for seed in SEEDS.get(check, (0,))])


def measured(check, name, kind, seed):
    sample, result = exemplar(name), made(name, kind, seed)
    match check:
        case "s1":
            return checks.s1(sample.image, result.image, FIELDS[kind])
        case "s2":
            return checks.s2(sample.image, result, None if kind == "identity" else made(name, "identity", seed))
        case "s3":
            return checks.s3(sample.image, result.image, 0.2 if kind == "identity" else 0.3)
        case "s3b":
            return checks.s3b(sample.mask, result, turned=kind != "identity")
        case "s5":
            return checks.s5(result, {"identity": 0.65, "zigzag": 0.55, "circular": 0.4}[kind])
    return checks.s6(sample.image, result.image)


CASES = [
    *(("s1", "stripes", k) for k in ("zigzag", "circular")),
    *(("s2", "stripes", k) for k in FIELDS),
    *((c, "particles", k) for k in ("identity", "circular") for c in ("s3", "s3b")),
    *(("s3", n, "identity") for n in ("weave_solid",)),
    *(("s5", "stripes", k) for k in FIELDS),
    *(("s5", n, "identity") for n in ("particles", "weave_solid")),
    ("s6", "particles", "identity"),
]


@pytest.mark.parametrize(("check", "name", "kind"), [pytest.param(*c, id="-".join(c)) for c in CASES])
def test_results_pass(check, name, kind):
    found = measure(check, name, kind)
    assert found.passed, (found.failed, found.figures)


def test_s2_a_frame_of_two_makes_features_twice_as_large():
    stripes = exemplar("stripes").image
    larger = texrs.solid(stripes, 64, field=fields.constant(np.eye(3) * 2), seed=1)
    found = checks.s2(stripes, larger, scale=2)
    assert found.passed, found.figures


def test_s6_borders_of_blocks_do_not_gather_on_planes():
    wood = exemplar("wood_solid").image
    found = checks.s6(wood, texrs.solid(wood, 80, seed=2).image)
    assert found.passed, found.figures


def test_s9_right_angles_give_the_turned_exemplar():
    found = checks.s9(exemplar("weave_solid").image, 64)
    assert found.passed, (found.failed, found.figures)


def test_turned_exemplars_are_what_the_frame_says():
    field = fields.rotation(90, "xz")
    volume = np.random.default_rng(0).random((4, 5, 6))
    turned = checks.turned_exemplar(volume, field.constant)
    # A step in the exemplar becomes, in the rotated exemplar, the product of the frame and the step.
    p = np.array([1, 2, 2])
    first = np.argwhere(turned == volume[tuple(p)])[0]
    for axis in range(3):
        step = np.eye(3, dtype=int)[axis]
        there = np.argwhere(turned == volume[tuple(p + step)])[0]
        np.testing.assert_array_equal(there - first, np.rint(field.constant @ step).astype(int))


# --- what must fail --------------------------------------------------------------------------------------------------


def grown(image, size, *, contrast=1.0, acceptance=2.0, votes=(0, 0, 0), blocks=True, field=None):
    """Grow a volume by blocks and their correction, kernel by kernel, optionally without a part of it."""
    analysis = texrs.Exemplar(image, axes=3).analyse()
    regions = [Region.whole((size,) * 3)]
    while len(regions) < len(analysis.levels):
        regions.insert(0, regions[0].parents())
    places = None
    for level, (here, region) in enumerate(zip(analysis.levels, regions, strict=True)):
        frames = to_fixed(field, region, 1 << (len(regions) - 1 - level))
        if places is not None:
            places = upsample(places, regions[level - 1], region, frames)
        elif blocks:
            places = here.blocks(region, frames, rounds=9, contrast=contrast)
        else:
            anywhere = np.random.default_rng(0).integers(0, here.shape[0], (region.points, 3))
            places = (anywhere * ONE).astype(np.int32).reshape(-1)
        done = here.correct(
            places,
            region,
            frames,
            passes=(8, 6, 6)[level],
            reach=(2, 2, 1)[level],
            acceptance=acceptance,
            coherence=0.2,
            vote=votes[level],
            settled=0.005,
            seed=0x9E3779B97F4A7C15 * (level + 1) % 2**64,
        )
        places = done.places
    shape = (size,) * 3
    source = SourceMap(
        (places.reshape(*shape, 3) / np.float32(ONE)).astype(np.float32),
        np.zeros(shape, np.uint16),
        np.zeros(shape, np.uint32),
        None,
        (image.shape[:3],),
    )
    picture = source.render(image, interpolation="nearest")
    return texrs.Synthesis(picture, source)


def test_the_kernels_alone_grow_what_windows_do():
    particles = exemplar("particles").image
    made_by_kernels = grown(particles, 32)
    levels = texrs.Exemplar(particles, axes=3).analyse().levels
    places = Windows(levels, Settings(), 0).grow(Region.whole((32, 32, 32))).places
    np.testing.assert_array_equal(made_by_kernels.source_map.coordinates.reshape(-1), places / np.float32(ONE))


ABLATIONS = {
    "each voxel starts anywhere": {"blocks": False},
    "bland blocks are not handicapped": {"contrast": 0.0},
    "all windows vote, and small gains count": {"votes": (2, 2, 2), "acceptance": 0.1},
}


@pytest.mark.parametrize("name", ABLATIONS)
def test_s8_without_its_parts_particles_are_lost(name):
    particles = exemplar("particles")
    result = grown(particles.image, 64, **ABLATIONS[name])
    shares, pieces = checks.s3(particles.image, result.image), checks.s3b(particles.mask, result)
    assert not (shares.passed and pieces.passed), (shares.figures, pieces.figures)


def shown(places, image):
    """Return the exemplar at given coordinates, and their map."""
    shape = places.shape[:3]
    empty = np.zeros(shape, np.uint16), np.zeros(shape, np.uint32)
    source = SourceMap(places.astype(np.float32), *empty, None, (image.shape[:3],))
    return texrs.Synthesis(source.render(image, interpolation="nearest"), source)


def test_cheats_fail():
    """Results that are not textures must fail the checks."""
    stripes = exemplar("stripes").image
    grid = np.stack(np.meshgrid(*[np.arange(64)] * 3, indexing="ij"), axis=-1)
    copy = shown(grid, stripes)
    assert "largest" in checks.s5(copy).failed
    noise = shown(np.random.default_rng(0).integers(0, 64, grid.shape), stripes)
    assert "coherent" in checks.s5(noise).failed
    assert not checks.s2(stripes, noise).passed
    # The unchanged exemplar does not follow a zigzag field.
    assert "median" in checks.s1(stripes, stripes, FIELDS["zigzag"]).failed
    # A field that leaves the layers unchanged gives no evidence.
    assert "turned" in checks.s1(stripes, stripes, fields.rotation(30, "xy")).failed
    # Blocks that are put side by side have visible planes between them.
    cells = (
        np.random.default_rng(1).integers(0, 40, (3, 3, 3, 3)).repeat(24, 0).repeat(24, 1).repeat(24, 2)[:64, :64, :64]
    )
    assert "planes" in checks.s6(stripes, shown(cells + grid % 24, stripes).image).failed
    # A texture with visible planes of its own passes, because the exemplar has the same planes.
    woven = np.random.default_rng(2).integers(0, 256, (16, 16, 16, 3), dtype=np.uint8)
    woven[-1] = 255 - woven[0]
    assert "planes" not in checks.s6(np.tile(woven, (4, 4, 4, 1)), np.tile(woven, (5, 5, 5, 1))).failed
    assert "planes" in checks.s6(exemplar("particles").image, np.tile(woven, (5, 5, 5, 1))).failed
    faded = (stripes * 0.8 + 20).astype(np.uint8)
    assert not checks.s3(stripes, faded).passed

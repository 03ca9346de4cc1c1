"""Stitched patches: facts about an exemplar, fields that are followed, and intact elements."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import texrs
from texrs import SourceMap, fields, samples, volume
from texrs.errors import InvalidInput
from texrs.exemplar import _exemplar
from texrs.exemplar.adjacency import classify, measure_adjacency
from texrs.exemplar.separate_elements import label_components
from texrs.metrics import evaluate

PARTICLES = samples.particles((64, 64, 64))
FIELDS = {"none": None, "circular": fields.circular(), "zigzag": fields.zigzag(period=48)}


@cache
def make_volume(kind, seed):
    """Return a volume of particles, which several tests measure."""
    return texrs.solid(texrs.Exemplar(PARTICLES.image, axes=3), 64, seed=seed, field=FIELDS[kind])


# --- elements --------------------------------------------------------------------------------------------------------


def test_elements_in_a_plain_background_are_found():
    found = texrs.Exemplar(PARTICLES.image, axes=3).instances
    assert found is not None
    there = (found.depth > 0) & PARTICLES.mask
    assert there.sum() > 0.75 * PARTICLES.mask.sum()
    assert abs(found.count - len(PARTICLES.centres)) <= 0.15 * len(PARTICLES.centres)
    # All samples of a particle have the same number except for one or two, also across the ends.
    for k in range(1, 11):
        inside = found.labels[(PARTICLES.labels == k) & (found.labels > 0)]
        assert inside.size == 0 or np.bincount(inside).max() > 0.95 * inside.size


@pytest.mark.parametrize("name", ["stripes", "wood_solid", "weave_solid"])
def test_layers_and_yarns_are_no_elements(name):
    assert texrs.Exemplar(getattr(samples, name)((48, 48, 48)).image, axes=3).instances is None


@pytest.mark.parametrize(("name", "separate"), [("dots", True), ("bricks", False), ("net", False), ("bark", False)])
def test_elements_of_pictures(name, separate):
    assert (texrs.Exemplar(getattr(samples, name)((128, 128)).image).instances is not None) == separate


def test_labels_are_their_own_elements():
    classes = np.where(PARTICLES.labels > 0, PARTICLES.labels % 3 + 1, 0).astype(np.uint8)
    found = texrs.Exemplar(classes, axes=3, repeat=True).instances
    assert found is not None
    np.testing.assert_array_equal(found.labels > 0, classes > 0)


def test_components_go_around_the_axes_that_repeat():
    mask = np.zeros((4, 6), bool)
    mask[1, [0, 1, 5]] = True
    assert label_components(mask, (False, False)).max() == 2
    assert label_components(mask, (False, True)).max() == 1


# --- adjacency -------------------------------------------------------------------------------------------------------


def test_what_is_never_side_by_side_is_surprising():
    levels = np.repeat(np.arange(4), 6) / 3.0
    picture = np.tile(levels, (24, 1))[..., np.newaxis].astype(np.float32)
    found = measure_adjacency(picture, (True, False))
    first, second, third = (found.classes[0, k] for k in (0, 6, 12))
    assert found.costs[first, first] == 0
    assert found.costs[first, third] > 2 * found.costs[first, second]
    np.testing.assert_array_equal(found.costs, found.costs.T)


@pytest.mark.parametrize("count", [2, 6, 48])
def test_classes_are_always_the_same_and_few_colours_are_kept(count):
    picture = samples.pebbles((64, 64)).image / np.float32(255)
    classes = classify(picture, count)
    np.testing.assert_array_equal(classes, classify(picture, count))
    assert classes.max() < count
    few = (np.indices((20, 20)).sum(axis=0) % 3)[..., np.newaxis] / np.float32(2)
    assert len(np.unique(np.stack([classify(few, 3), few[..., 0]], -1).reshape(-1, 2), axis=0)) == 3
    assert classify(np.zeros((5, 5, 1), np.float32), count).max() == 0


# --- fields ----------------------------------------------------------------------------------------------------------


def test_separate_elements_are_turned_and_courses_are_bent():
    field = fields.circular(axes=2)
    bent = {
        name: texrs.synthesize(getattr(samples, name)((128, 128)).image, 96, field=field).report["stitched"]["bent"]
        for name in ("dots", "pebbles", "bricks", "net")
    }
    assert bent == {"dots": False, "pebbles": False, "bricks": True, "net": True}


@pytest.mark.parametrize("bend", [True, False])
def test_bend_overrules_what_the_exemplar_says(bend):
    bricks = samples.bricks((96, 96)).image
    made = texrs.synthesize(bricks, 128, field=fields.circular(axes=2), bend_patches=bend)
    assert made.report["stitched"]["bent"] == bend
    with pytest.raises(InvalidInput, match="bend_patches: must be True, False or None, got 'no'"):
        texrs.synthesize(bricks, 128, bend_patches="no")


def test_the_frames_of_rigid_patches_are_their_own():
    """Inside a patch coordinates follow its frame, so normals are rotated consistently."""
    made = texrs.synthesize(samples.dots((96, 96)).image, 128, field=fields.circular(axes=2), seed=2)
    frames, coordinates, labels = made.source_map.jacobians(), made.source_map.coordinates, made.source_map.label
    for axis in range(2):
        step = np.diff(coordinates, axis=axis)
        same = np.diff(labels, axis=axis) == 0
        expected = np.take(frames, range(127), axis)[..., axis]
        near = np.abs(step - expected).max(axis=-1) < 0.01
        # The share is below 1, because coordinates wrap in a periodic exemplar.
        assert near[same].mean() > 0.95


def test_bent_patches_follow_the_field():
    bricks = samples.bricks((128, 128)).image
    field = fields.circular(axes=2)
    errors = {}
    for bend in (True, False):
        source = texrs.synthesize(bricks, 160, field=field, bend_patches=bend, seed=1).source_map
        expected = field.over((160, 160)).lattice((160, 160))
        step, same = np.diff(source.coordinates, axis=1), np.diff(source.label, axis=1) == 0
        errors[bend] = np.linalg.norm(step - expected[:, :-1, :, 1], axis=-1)[same].mean()
    assert errors[True] < 0.85 * errors[False]


# --- whole elements --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", FIELDS)
def test_elements_stay_whole(kind):
    fast = texrs.solid(PARTICLES.image, 64, quality="fast", seed=1, field=FIELDS[kind])
    stitched, corrected = (volume.integrity(PARTICLES.image, made.source_map) for made in (make_volume(kind, 1), fast))
    assert stitched.contacts[1] < 0.5
    assert stitched.torn < 0.12
    assert stitched.torn < 0.5 * corrected.torn
    assert stitched.mixed[1] <= 0.05


@pytest.mark.parametrize("kind", FIELDS)
def test_elements_keep_their_share_and_number(kind):
    """Cuts around elements are shorter than cuts between them, so elements would get fewer."""
    exemplar = texrs.Exemplar(PARTICLES.image, axes=3)
    depth = exemplar.instances.depth
    shares, numbers = [], []
    for seed in (1, 2, 3):
        source = make_volume(kind, seed).source_map
        at = np.rint(source.coordinates).astype(int) % 64
        shares.append((depth[tuple(np.moveaxis(at, -1, 0))] > 0).mean() / (depth > 0).mean())
        before, after = volume.integrity(exemplar, source).density
        numbers.append(after / before)
    assert abs(np.mean(shares) - 1) < 0.05
    assert abs(np.mean(numbers) - 1) < 0.12  # The number of twenty elements varies by a tenth.


def test_elements_are_counted_without_bias():
    """A part of a periodic texture has the same density of elements as the whole, though its ends cut many."""
    exemplar = texrs.Exemplar(PARTICLES.image, axes=3, repeat=True)
    places = np.stack(np.meshgrid(*(np.arange(48),) * 3, indexing="ij"), axis=-1)
    counts = []
    for shift in ((0, 0, 0), (32, 0, 16), (0, 32, 48), (48, 16, 32)):
        part = SourceMap.from_coordinates(((places + shift) % 64).astype(np.float32), (64, 64, 64))
        counts.append(volume.integrity(exemplar, part).density)
    assert len({before for before, _ in counts}) == 1
    assert abs(np.mean([after for _, after in counts]) / counts[0][0] - 1) < 0.1


def test_integrity_of_a_copy_and_of_a_cheat():
    exemplar = texrs.Exemplar(PARTICLES.image, axes=3)
    copied = volume.integrity(exemplar, SourceMap.identity(PARTICLES.labels.shape))
    assert copied.torn == copied.crumbs == 0
    assert copied.contacts[0] == copied.contacts[1]
    rng = np.random.default_rng(0)
    cells = rng.integers(0, 56, (8, 8, 8, 3)).repeat(8, 0).repeat(8, 1).repeat(8, 2)
    grid = np.stack(np.meshgrid(*[np.arange(64) % 8] * 3, indexing="ij"), axis=-1)
    shuffled = volume.integrity(exemplar, SourceMap.from_coordinates((cells + grid).astype(np.float32), (64, 64, 64)))
    assert shuffled.torn > 0.8
    assert shuffled.contacts[1] > copied.contacts[1] + 1
    assert shuffled.mixed[1] > 0.05
    assert volume.integrity(samples.stripes((32, 32, 32)).image, SourceMap.identity((32, 32, 32))) is None


def test_the_comparison_tells_of_torn_elements():
    made = texrs.solid(PARTICLES.image, 48, seed=3)
    text = volume.compare(PARTICLES.image, made.image, made.source_map).text
    assert "torn elements / all" in text
    assert "torn elements" not in volume.compare(PARTICLES.image, made.image).text


def test_rare_things_keep_their_share():
    found = volume.classes(PARTICLES.image)
    count = len(found.centres)

    def shares(image):
        return np.bincount(found.of(image).ravel(), minlength=count) / (image.size / 3)

    images = [make_volume("none", s).source_map.render(PARTICLES.image, interpolation="nearest") for s in (1, 2)]
    mean = np.mean([shares(image) for image in images], axis=0)
    np.testing.assert_allclose(mean / shares(PARTICLES.image), 1, atol=0.2)


def test_cuts_keep_out_of_what_may_be_elements(monkeypatch):
    """Elements in a heap, without a background between them, are not found reliably."""
    picture = texrs.samples.beans((160, 160)).image
    exemplar = texrs.Exemplar(picture, repeat=False)
    assert exemplar.instances is None
    assert exemplar.stitcher.guessed
    assert not exemplar.stitcher.separate
    torn = [evaluate(exemplar, texrs.synthesize(exemplar, 160, seed=seed).source_map).torn for seed in range(3)]
    monkeypatch.setattr(_exemplar, "find_instances", lambda colours, wrap: None)
    # Use other options, so that it is another exemplar without cached facts.
    unaware = texrs.Exemplar(picture, repeat=False, labels=False)
    assert not unaware.stitcher.guessed
    before = [evaluate(exemplar, texrs.synthesize(unaware, 160, seed=seed).source_map).torn for seed in range(3)]
    assert sum(torn) < 0.6 * sum(before), (torn, before)

"""texrs.growth and its atlas: positions of copies, copyable parts, and the levels."""

from dataclasses import replace

import numpy as np
import pytest

import texrs
from reference import growth as reference
from texrs import samples
from texrs._arrays import guidance
from texrs._engine.appearance import Appearance, Corrected, Demand
from texrs._engine.pyramid import ONE, Region, to_fixed
from texrs.errors import InvalidInput
from texrs.exemplar.analysis import count_levels
from texrs.exemplar.atlas import RADIUS, Atlas, resampling_matrix
from texrs.growth import FROM_ATLAS, Surroundings, from_draft, grow, grow_from_atlas, stitch_image
from texrs.growth.constraints import Asked


@pytest.fixture(scope="module")
def floor():
    return samples.tilted_discs((96, 80))


@pytest.fixture(scope="module")
def atlas(floor):
    return atlas_of(floor.image, np.asarray(floor.scale_map, np.float32), (1.0, 0.64, 1.25))


def atlas_of(image, scale=None, sizes=(1.0,), *, coarsest=32, **options):
    """Return the atlas of an image, with the levels for its size."""
    return Atlas.of(guidance(image), scale, sizes, levels=count_levels(image.shape[:2], coarsest), **options)


@pytest.mark.parametrize(("n", "m"), [(40, 40), (40, 26), (40, 50), (7, 19), (33, 5)])
def test_resizing_is_that_of_the_twin(n, m):
    line = np.random.default_rng(n).random(n)
    np.testing.assert_allclose(resampling_matrix(n, m) @ line, reference.resized(line, m), atol=1e-6)


def test_copies_do_not_overlap_and_are_found_again(atlas):
    assert len(atlas.copies) == 3
    taken = np.zeros(atlas.levels[-1].appearance.shape, int)
    for number, copy in enumerate(atlas.copies):
        (top, left), (rows, columns) = copy.origin, copy.shape
        taken[top : top + rows, left : left + columns] += 1
        corners = np.array([[0, 0], [rows - 1, columns - 1]]) + copy.origin
        which, at = atlas.locate((corners * ONE).astype(np.int32).ravel())
        assert (which == number).all()
        # The outer edges of a copy are the edges of the exemplar.
        np.testing.assert_allclose(at[0], 0.5 / np.array(copy.factor) - 0.5, atol=1e-4)
        np.testing.assert_allclose(at[1], [95.5, 79.5] - 0.5 / np.array(copy.factor), atol=1e-4)
    assert taken.max() == 1


def test_what_is_barred_is_that_of_the_twin(floor):
    known = np.ones((96, 80), bool)
    known[30:41, 20:33] = False
    atlas = atlas_of(floor.image, known=known)
    assert len(atlas.levels) > 1
    for number, level in enumerate(atlas.levels):
        spacing = 1 << (len(atlas.levels) - 1 - number)
        shape = level.appearance.shape
        twin = reference.free(known, shape, spacing, RADIUS)
        barred = level.values.reshape(*shape, 4)[..., 3] > 0
        np.testing.assert_array_equal(~barred, twin)
        np.testing.assert_array_equal(np.sort(level.order), np.nonzero(twin.ravel())[0])


def test_nothing_barred_is_shown(floor):
    known = np.ones((96, 80), bool)
    known[20:60, 20:60] = False
    atlas = atlas_of(floor.image, known=known)
    grown = grow_from_atlas(atlas, Region.whole((64, 64)), None, seed=1)
    at = np.rint(atlas.locate(grown.places)[1]).astype(int)
    assert known[at[:, 0], at[:, 1]].all()


def test_what_is_held_stays(atlas):
    held = np.zeros((32, 48), bool)
    held[:, :20] = True
    given = np.stack(np.mgrid[:32, :48], axis=-1).astype(np.int32) + 16
    ones = np.ones((32, 48), np.float32)
    grown = grow_from_atlas(atlas, Region.whole((32, 48)), ones, held=Surroundings(held, given), seed=1)
    np.testing.assert_array_equal(grown.places.reshape(32, 48, 2)[held], given[held] * ONE)


def test_a_flat_exemplar_has_an_atlas():
    flat = np.full((40, 40, 1), 9, np.uint8)
    settings = replace(FROM_ATLAS, passes=(2, 2, 2))
    grown = grow_from_atlas(atlas_of(flat), Region.whole((20, 20)), None, settings=settings)
    assert len(grown.places) == 800


@pytest.mark.parametrize("order", [[3, 2], [2000]], ids=["not by value", "no sample"])
def test_an_order_that_is_none_is_refused(order):
    exemplar = Appearance(np.random.default_rng(0).random((32, 32)), axes=2)
    region = Region.whole((16, 16))
    values = np.zeros((1024, 4), np.int16)
    values[:, 0] = np.arange(1024)
    guide = Demand(values.ravel(), np.zeros(1024, np.int16), np.ones(256, np.uint16), np.array(order, np.uint32))
    with pytest.raises(InvalidInput, match="order of the guide"):
        exemplar.blocks(region, to_fixed(None, region), demand=guide)


def test_held_blocks_need_a_place_each():
    exemplar = Appearance(np.random.default_rng(0).random((32, 32)), axes=2)
    region = Region.whole((16, 16))
    with pytest.raises(InvalidInput, match="held"):
        exemplar.blocks(region, to_fixed(None, region), held=np.ones(256, bool), given=np.zeros(4, np.int32))


# --- the levels ------------------------------------------------------------------------------------------------------


def test_any_start_and_any_corrector_can_be_handed_in():
    """A draft without a corrector is returned upsampled. Each level gets its constraints."""
    calls = []

    def leave(places, level, region, frames, asked, progress):
        calls.append((level, region.shape, asked.held is None))
        return Corrected(places, level, 0.25)

    def ask(level, region, spacing):
        held = np.zeros(region.points, bool)
        held[0] = True
        return Asked(held=held, given=np.zeros(2 * region.points, np.int32)) if spacing == 1 else Asked()

    region, copy = Region.whole((14, 20)), np.indices((14, 20)).transpose(1, 2, 0).astype(np.int32) + 40
    draft = ((copy[::2, ::2] * ONE) >> 1).reshape(-1)
    start = from_draft(1, lambda here: draft.copy())
    made = grow(
        region,
        3,
        start,
        leave,
        lambda here, step: to_fixed(None, here),
        ask=ask,
        show=lambda places, here, spacing: places.reshape(*here.shape, 2),
    )
    copy[0, 0] = 0
    np.testing.assert_array_equal(made.places.reshape(14, 20, 2), copy * ONE)
    assert calls == [(1, (7, 10), True), (2, (14, 20), False)]
    assert list(made.stages) == ["level 2"]
    assert [done.report() for done in made.levels] == [
        {"shape": [7, 10], "passes": 1, "changed": 0.25},
        {"shape": [14, 20], "passes": 2, "changed": 0.25},
    ]


@pytest.mark.parametrize("wrap", [True, False])
@pytest.mark.parametrize("frequencies", [((1 / 26, 0), (0, 1 / 26)), ((0.02, 0.03),)], ids=["studs", "stripes"])
def test_stitched_patches_are_in_step_with_a_lattice_or_stripes(frequencies, wrap):
    rows, columns = np.indices((130, 140))
    noise = np.random.default_rng(0).normal(0, 0.1, rows.shape)
    light = 0.5 + 0.1 * (sum(np.cos(2 * np.pi * (a * rows + b * columns)) for a, b in frequencies) + noise)
    exemplar = texrs.Exemplar(np.repeat(light[..., None], 3, axis=2).astype(np.float32))
    assert exemplar.segment().repeats
    coordinates, patches, frame = stitch_image(exemplar, (180, 190), (wrap, wrap), 0)
    assert len(np.unique(patches)) > 2
    assert wrap or (frame == np.eye(2)).all()
    moved = coordinates - np.moveaxis(np.indices((180, 190)), 0, -1) @ frame.T
    for each in frequencies:
        away = moved @ np.array(each)
        assert np.abs(away - np.rint(away)).max() < 0.15

"""texrs.supply: copies of an exemplar, where they lie and what may be copied of them."""

import numpy as np
import pytest

from reference import supply as reference
from texrs import samples
from texrs.errors import InvalidInput
from texrs.kernels.appearance import Appearance, Guide
from texrs.kernels.pyramid import ONE, Region, to_fixed
from texrs.supply import RADIUS, Settings, Supply
from texrs.supply._sheet import weights_of


@pytest.fixture(scope="module")
def floor():
    return samples.tilted_discs((96, 80))


@pytest.fixture(scope="module")
def supply(floor):
    return Supply.of(floor.image, np.asarray(floor.scale_map, np.float32), (1.0, 0.64, 1.25))


@pytest.mark.parametrize(("n", "m"), [(40, 40), (40, 26), (40, 50), (7, 19), (33, 5)])
def test_resizing_is_that_of_the_twin(n, m):
    line = np.random.default_rng(n).random(n)
    np.testing.assert_allclose(weights_of(n, m) @ line, reference.resized(line, m), atol=1e-6)


def test_copies_do_not_overlap_and_are_found_again(supply):
    taken = np.zeros(supply.levels[-1].appearance.shape, int)
    for number, copy in enumerate(supply.copies):
        (top, left), (rows, columns) = copy.origin, copy.shape
        taken[top : top + rows, left : left + columns] += 1
        corners = np.array([[0, 0], [rows - 1, columns - 1]]) + copy.origin
        which, at = supply.locate((corners * ONE).astype(np.int32).ravel())
        assert (which == number).all()
        # The outer edges of a copy are those of the exemplar.
        np.testing.assert_allclose(at[0], 0.5 / np.array(copy.factor) - 0.5, atol=1e-4)
        np.testing.assert_allclose(at[1], [95.5, 79.5] - 0.5 / np.array(copy.factor), atol=1e-4)
    assert taken.max() == 1


def test_what_is_barred_is_that_of_the_twin(floor):
    known = np.ones((96, 80), bool)
    known[30:41, 20:33] = False
    supply = Supply.of(floor.image, None, known=known)
    for number, level in enumerate(supply.levels):
        spacing = 1 << (len(supply.levels) - 1 - number)
        shape = level.appearance.shape
        twin = reference.free(known, shape, spacing, RADIUS)
        barred = level.values.reshape(*shape, 4)[..., 3] > 0
        np.testing.assert_array_equal(~barred, twin)
        np.testing.assert_array_equal(np.sort(level.order), np.nonzero(twin.ravel())[0])


def test_nothing_barred_is_shown(floor):
    known = np.ones((96, 80), bool)
    known[20:60, 20:60] = False
    supply = Supply.of(floor.image, None, known=known)
    grown = supply.grow(Region.whole((64, 64)), None, seed=1)
    at = np.rint(supply.locate(grown.places)[1]).astype(int)
    assert known[at[:, 0], at[:, 1]].all()


def test_what_is_held_stays(floor, supply):
    held = np.zeros((32, 48), bool)
    held[:, :20] = True
    given = np.stack(np.mgrid[:32, :48], axis=-1).astype(np.int32) + 16
    grown = supply.grow(Region.whole((32, 48)), np.ones((32, 48), np.float32), held=(held, given), seed=1)
    np.testing.assert_array_equal(grown.places.reshape(32, 48, 2)[held], given[held] * ONE)


def test_a_flat_exemplar_has_a_supply():
    flat = np.full((40, 40, 1), 9, np.uint8)
    grown = Supply.of(flat, None, settings=Settings(passes=(2, 2, 2))).grow(Region.whole((20, 20)), None)
    assert len(grown.places) == 800


@pytest.mark.parametrize("order", [[3, 2], [2000]], ids=["not by value", "no sample"])
def test_an_order_that_is_none_is_refused(order):
    exemplar = Appearance(np.random.default_rng(0).random((32, 32)), axes=2)
    region = Region.whole((16, 16))
    values = np.zeros((1024, 4), np.int16)
    values[:, 0] = np.arange(1024)
    guide = Guide(values.ravel(), np.zeros(1024, np.int16), np.ones(256, np.uint16), np.array(order, np.uint32))
    with pytest.raises(InvalidInput, match="order of the guide"):
        exemplar.blocks(region, to_fixed(None, region), guide=guide)


def test_held_blocks_need_a_place_each():
    exemplar = Appearance(np.random.default_rng(0).random((32, 32)), axes=2)
    region = Region.whole((16, 16))
    with pytest.raises(InvalidInput, match="held"):
        exemplar.blocks(region, to_fixed(None, region), held=np.ones(256, bool), given=np.zeros(4, np.int32))

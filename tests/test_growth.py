"""texrs.growth: copies of an exemplar, where they lie and what may be copied of them."""

import numpy as np
import pytest

from reference import supply as reference
from texrs import samples
from texrs._engine.appearance import Appearance, Guide
from texrs._engine.pyramid import ONE, Region, to_fixed
from texrs.errors import InvalidInput
from texrs.exemplar.atlas import weights_of
from texrs.growth import RADIUS, Settings, Supply
from texrs.growth.balance import Balance, tones_of


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


def scales_of(values, order=None):
    """Return a guide of scales alone."""
    mine = np.zeros((len(values[0]), 4), np.int16)
    mine[:, 0] = values[0]
    asked = np.asarray(values[1], np.int16)
    order = np.arange(len(mine)) if order is None else order
    return Guide(mine.ravel(), asked, np.array([1264], np.uint16), order.astype(np.uint32))


def test_shares_are_those_of_samples_of_the_scales_that_are_asked_for():
    # Three quarters of the output ask for scales whose samples are dark, a quarter for those of bright ones.
    guide = scales_of((np.repeat([0, 500], [90, 10]), np.repeat([0, 500], [30, 10])))
    tones = tones_of(np.repeat(np.float32([0.1, 0.9]), [90, 10])[:, np.newaxis], guide.order)
    shares = Balance.of(tones, guide).shares
    np.testing.assert_allclose(shares[0, [0, -1]], [0.75, 0.25])
    assert shares.sum() == pytest.approx(1)
    # Nothing of the scale: all counts.
    none = Balance.of(tones, scales_of((np.repeat([0, 500], [90, 10]), np.full(5, 2000)))).shares
    np.testing.assert_allclose(none[0, [0, -1]], [0.9, 0.1])
    # A barred sample counts for nothing.
    barred = Balance.of(tones, scales_of((np.zeros(100), np.zeros(5)), np.arange(95))).shares
    np.testing.assert_allclose(barred[0, [0, -1]], [90 / 95, 5 / 95])


def test_what_is_in_excess_becomes_dearer_and_what_is_missing_cheaper():
    guide = scales_of((np.zeros(100), np.zeros(50)))
    tones = tones_of(np.repeat(np.float32([0, 1]), 50)[:, np.newaxis], guide.order)
    balance = Balance.of(tones, guide)
    balance.note(np.zeros(100, np.int32), (1, 100), 0.2)  # All points show the first sample.
    np.testing.assert_allclose(balance.costs[0, [0, -1]], [0.2, -0.2])
    values = balance.onto(guide).exemplar.reshape(-1, 4)
    # 0.4 of what unrelated windows cost, as a square under the weight.
    assert (values[:50, 2] == round((0.4 * 2 * 512**2 * 256 / 1264) ** 0.5)).all()
    assert not values[50:].any()
    assert not values[:, [0, 1, 3]].any()


def test_balanced_colours_are_nearer_to_the_exemplars(floor):
    scale, far = np.asarray(floor.scale_map, np.float32), []
    mine = np.sort(floor.image.reshape(-1, 3), axis=0)
    for balance in (0.0, 0.2):
        supply = Supply.of(floor.image, scale, settings=Settings(coarsest=16, balance=balance))
        grown = supply.grow(Region.whole((96, 80)), scale, seed=3)
        shown = supply.source(grown.places, (96, 80)).render(floor.image, interpolation="nearest")
        far.append(np.abs(np.sort(shown.reshape(-1, 3), axis=0).astype(float) - mine).mean())
    assert far[1] < 0.7 * far[0]

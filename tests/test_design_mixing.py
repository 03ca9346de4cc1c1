"""Several exemplars in one texture: shares and maps are kept, and borders follow outlines."""

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

import texrs
from texrs import SourceMap, samples
from texrs.papers.design.mixing import Layer, cut_borders, draw_territories, measure_error, mix

SIZE = (192, 224)


@pytest.fixture(scope="module")
def three():
    return [getattr(samples, name)((112, 112)).image for name in ("pebbles", "leaves_and_flowers", "grit")]


def share_of(result, count):
    return np.bincount(result.source_map.exemplar.ravel(), minlength=count) / result.source_map.exemplar.size


@pytest.mark.parametrize(("weights", "seed"), [(None, 0), ([2, 1, 1], 1), ([0.7, 0.2, 0.1], 0), ([3, 0, 1], 1)])
def test_shares_are_kept(three, weights, seed):
    asked = np.ones(3) if weights is None else np.array(weights, float)
    result = texrs.design(three, SIZE, weights=weights, copies=1, seed=seed)
    assert share_of(result, 3) == pytest.approx(asked / asked.sum(), rel=0.03)


@pytest.mark.parametrize("count", [2, 3])
def test_a_map_is_obeyed_to_within_an_element(three, count):
    rows, columns = np.indices(SIZE)
    where = (np.hypot(rows - 90, columns - 100) < 60).astype(int)
    if count == 3:
        where[:80, :90] = 2
    result = texrs.design(three[:count], SIZE, weights=where, copies=1, wrap=False)
    shown = result.source_map.exemplar
    away = np.stack([distance_transform_edt(where != which) for which in range(count)])
    away = np.take_along_axis(away, shown[np.newaxis].astype(int), axis=0)[0]
    # Borders may move by half of a pebble, which is about 20 pixels large.
    assert (away <= 10).mean() >= 0.95
    assert away.max() <= 28
    assert 0.001 < (away > 0).mean() < 0.12
    asked = np.bincount(where.ravel(), minlength=count) / where.size
    assert share_of(result, count) == pytest.approx(asked, rel=0.03)


def test_a_map_of_weights_is_kept_place_by_place(three):
    ramp = np.linspace(0, 1, SIZE[1]) * np.ones((SIZE[0], 1))
    weights = np.stack([1 - ramp, ramp], axis=-1)
    shown = np.stack(
        [texrs.design(three[:2], SIZE, weights=weights, copies=1, seed=s).source_map.exemplar for s in (1, 2)]
    )
    assert shown.mean(axis=(1, 2)) == pytest.approx([0.5, 0.5], rel=0.03)
    assert shown[..., : SIZE[1] // 3].mean() < 0.3 < 0.7 < shown[..., -(SIZE[1] // 3) :].mean()


def test_territories_are_cyclic_and_even():
    shares = np.array([0.5, 0.3, 0.2])
    wanted = draw_territories(shares, (128, 160), 40.0, 7)
    assert np.bincount(wanted.ravel()) / wanted.size == pytest.approx(shares, rel=0.01)
    inside = (wanted[:, 1:] != wanted[:, :-1]).mean()
    assert (wanted[:, 0] != wanted[:, -1]).mean() < 4 * inside
    assert (wanted != draw_territories(shares, (128, 160), 40.0, 8)).mean() > 0.3


def layer(which, things):
    """Return a layer of one colour with an element in it."""
    size = things.shape
    plain = SourceMap.identity(size)
    source = SourceMap(plain.coordinates, np.full(size, which, np.uint16), plain.label, None, (size, size))
    depth = np.clip(distance_transform_edt(things) - 1, 0, 6).astype(np.float32) / 6
    return Layer(source, np.where(things, 1.0, 0.2).astype(np.float32)[..., np.newaxis], depth, things)


def test_borders_go_round_things_whole():
    rows, columns = np.indices((80, 80))
    discs = [np.hypot(rows - 20, columns - 38) < 8, np.hypot(rows - 60, columns - 42) < 8]
    layers = [layer(which, disc) for which, disc in enumerate(discs)]
    wanted = np.asarray(columns >= 40, np.uint16)
    chosen = cut_borders(layers, wanted, 16.0, (False, False))
    # The straight border halves both discs. Each is now whole, in the exemplar with the larger weight there.
    assert (chosen[discs[0]] == 0).all()
    assert (chosen[discs[1]] == 1).all()
    assert measure_error(np.bincount(chosen.ravel()) / chosen.size, np.array([0.5, 0.5])) <= 0.01
    made = mix(layers, np.eye(2)[wanted], extent=16.0, territory=40.0, wrap=(False, False), seed=0)
    assert (made.exemplar == chosen).all()
    assert (made.coordinates == SourceMap.identity((80, 80)).coordinates).all()


def test_one_exemplar_does_not_stain_another():
    flat = [np.full((64, 64, 3), value, np.uint8) for value in (40, 220)]
    result = texrs.design(flat, 96, copies=1)
    assert set(np.unique(result.image)) == {40, 220}
    across = texrs.blend(result.source_map, flat, wrap=True)
    assert len(np.unique(across)) > 2
    assert (texrs.blend(result.source_map, flat, wrap=True, across=False) == result.image).all()

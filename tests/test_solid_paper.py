"""SOLID to the letter (``method="paper"``), and what the departures of the default are for."""

import numpy as np
import pytest

import texrs
from texrs import fields, samples, threads, volume
from texrs.errors import Cancelled, InvalidInput
from texrs.kernels.pyramid import ONE, Region
from texrs.papers._solid_literal import _inside

SIZE = 64


def grow(exemplar, field=None, method="paper", size=SIZE, **options):
    made = texrs.solid(exemplar, size, field=field, method=method, seed=1, **options)
    assert np.isfinite(made.source.coordinates).all()
    return made


@pytest.fixture(scope="module")
def stripes():
    return samples.stripes((48, 48, 48)).image


@pytest.fixture(scope="module")
def of_stripes(stripes):
    return {method: grow(stripes, method=method) for method in (None, "paper")}


# --- it runs ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("field", [None, fields.zigzag(period=32, axes=2), fields.circular(axes=2)])
@pytest.mark.parametrize("wrap", [False, True])
def test_pictures(field, wrap):
    weave = samples.weave((64, 64)).image
    made = texrs.synthesize(weave, (70, 51), field=field, wrap=wrap, method="paper")
    assert made.image.shape == (70, 51, 3)
    assert made.report["method"] == "paper"
    assert made.report["quality"] is None
    assert [level["passes"] for level in made.report["levels"]] == [0] * 5 + [2] * 3
    colours = {tuple(c) for c in weave.reshape(-1, 3)}
    assert {tuple(c) for c in made.image.reshape(-1, 3)} <= colours


def test_every_size_down_to_one():
    weave = samples.weave((64, 64)).image
    for size in ((1, 1), (1, 9), (3, 200), (8, 8)):
        assert texrs.synthesize(weave, size, method="paper").image.shape == (*size, 3)


def test_threads_change_nothing(stripes):
    field = fields.zigzag(period=32, axes=3)
    made = []
    for count in (1, 2, 7):
        with threads(count):
            made.append(grow(stripes, field, size=(40, 33, 36)).source.coordinates)
    assert made[0].tobytes() == made[1].tobytes() == made[2].tobytes()
    other = texrs.solid(stripes, (40, 33, 36), field=field, method="paper", seed=2).source.coordinates
    assert (other != made[0]).any(axis=-1).mean() > 0.9


def test_labels_thin_volumes_and_other_channels():
    rng = np.random.default_rng(0)
    facies = rng.integers(0, 3, (16, 20, 40)).astype(np.uint8)
    assert set(np.unique(grow(facies, size=24).image)) <= {0, 1, 2}
    assert grow(rng.random((17, 18, 19, 2)), size=20).image.shape == (20, 20, 20, 2)


def test_what_it_does_not_do():
    weave = samples.weave((64, 64)).image
    with pytest.raises(InvalidInput, match="held: the paper's method holds no points"):
        texrs.synthesize(weave, 32, method="paper", held=np.ones((32, 32), bool), values=weave[:32, :32])
    with pytest.raises(InvalidInput, match="method: None or 'paper'"):
        texrs.synthesize(weave, 32, method="su")
    with pytest.raises(ValueError, match="stop"):
        texrs.synthesize(weave, 32, method="paper", progress=stop)


def stop(_stage, _share):
    raise ValueError("stop")


def test_coordinates_that_leave_come_back_on_the_other_side():
    from texrs.kernels.appearance import Appearance

    exemplar = Appearance(np.random.default_rng(0).random((20, 24)), axes=2, wrap=(False, True))
    places = np.array([17, 23, 18, 24, 1, -1, 2, 0], np.int32) * ONE
    assert (_inside(places, exemplar, 0).reshape(4, 2) // ONE).tolist() == [[17, 23], [2, 0], [17, -1 % 24], [2, 0]]
    assert Region.whole((1, 1)).parents().shape == (1, 1)


# --- what it fails, and the default does not -------------------------------------------------------------------------


def test_neighbours_hardly_ever_go_on_together(of_stripes):
    coherent = {m: volume.cell_reuse(made.source).coherent for m, made in of_stripes.items()}
    assert coherent["paper"] < 0.1
    assert coherent[None] > 0.65


def test_speckle(of_stripes, stripes):
    grey = volume.lightness(stripes)
    own = volume.isolated(grey)
    found = {m: volume.isolated(volume.lightness(made.image)) for m, made in of_stripes.items()}
    assert found[None] <= 1.5 * own + 1e-3
    assert found["paper"] > 3 * found[None] + 1e-3

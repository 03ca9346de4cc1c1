"""k-coherence compared with its slow twin, exactly; bad arguments; the cache of similarity sets."""

import numpy as np
import pytest

import texrs
from reference import coherence as twin
from texrs import fields, samples
from texrs._engine.appearance import Appearance
from texrs._engine.coherence import correct, find_similar, jitter
from texrs._engine.pyramid import ONE, Region, to_fixed
from texrs._threads import threads
from texrs.errors import InvalidInput


def exemplar(axes, wrap=False):
    image = samples.pebbles((64, 64)).image[:26, :24] if axes == 2 else samples.stripes().image[:13, :12, 20:33]
    return Appearance(image / np.float32(255), axes=axes, wrap=wrap)


def start(appearance, region, seed=1):
    axes = len(appearance.shape)
    return jitter(np.full(region.points * axes, 10 * ONE, np.int32), region, 12, seed=seed)


@pytest.mark.parametrize("numbers", [8, 24])
@pytest.mark.parametrize("wrap", [False, True])
@pytest.mark.parametrize(("axes", "n"), [(2, 7), (3, 5)])
def test_similarity_sets(axes, n, wrap, numbers):
    appearance = exemplar(axes, wrap)
    found = find_similar(appearance, k=3, n=n, numbers=numbers).sets
    np.testing.assert_array_equal(found, twin.similar(appearance, 3, n, numbers))


@pytest.mark.parametrize("level", [0, 5])
def test_jitter(level):
    for region in (Region((9, 8), (-4, 1 << 20), (False, False)), Region.whole((5, 4, 3), True)):
        zero = np.zeros(region.points * len(region.shape), np.int32)
        found = jitter(zero, region, 0.7, seed=(1 << 40) + 3, level=level)
        np.testing.assert_array_equal(found, twin.jitter(zero, region, 0.7, (1 << 40) + 3, level))


def test_jitter_leaves_what_is_held():
    region = Region.whole((40, 50))
    held = np.random.default_rng(3).random((40, 50)) < 0.5
    zero = np.zeros(region.points * 2, np.int32)
    free, some = (jitter(zero, region, 2, seed=4, held=h).reshape(40, 50, 2) for h in (None, held))
    np.testing.assert_array_equal(some, np.where(held[..., None], 0, free))
    with pytest.raises(InvalidInput, match="held"):
        jitter(zero, region, 2, held=held[1:])


@pytest.mark.parametrize("compensated", [False, True])
@pytest.mark.parametrize("wrap", [False, True])
@pytest.mark.parametrize(("axes", "shape"), [(2, (11, 14)), (3, (5, 4, 3))])
def test_correction(axes, shape, wrap, compensated):
    appearance = exemplar(axes, wrap)
    found = find_similar(appearance, k=3, n=5)
    region = Region(shape, (-3,) * axes, (wrap,) * axes)
    for field in (None, fields.circular(axes=axes, **({} if axes == 2 else {"axis": "z"})).over(shape)):
        frames = to_fixed(field, region)
        places = start(appearance, region)
        options = {"passes": 2, "compensated": compensated}
        mine = correct(appearance, found, places, region, frames, **options)
        np.testing.assert_array_equal(
            mine, twin.correct(appearance, found.sets, places, region, frames, **options), err_msg=str(field)
        )


def test_threads_and_held_points():
    appearance = exemplar(2)
    region = Region.whole((70, 90))
    places, found, frames = start(appearance, region), find_similar(appearance), to_fixed(None, region)
    results = []
    for count in (1, 2, 7):
        with threads(count):
            results.append(correct(appearance, found, places, region, frames))
    assert all((r == results[0]).all() for r in results)
    held = np.zeros(region.points, bool)
    held[::3] = True
    kept = correct(appearance, found, results[0], region, frames, held=held, passes=1)
    assert (kept.reshape(-1, 2)[held] == results[0].reshape(-1, 2)[held]).all()


def test_flat_exemplars_take_no_time():
    flat = Appearance(np.zeros((40, 40, 40), np.float32), axes=3)
    assert find_similar(flat).sets[40 * 40 * 20 + 40 * 20 + 20].tolist() == [32820, 3282, 3286]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"k": 0}, "k: must be an integer between 1 and 16"),
        ({"k": 17}, "k: must be an integer between 1 and 16"),
        ({"n": 6}, "n: must be an odd number"),
        ({"n": 51}, "n: must be smaller, because .* does not have 3 samples that are more than 25 apart"),
        ({"k": 16, "n": 11}, "n: must be smaller, because .* does not have 16 samples that are more than 5 apart"),
        ({"numbers": 9}, "numbers: must be 8 or 24"),
    ],
)
def test_what_leaves_no_candidates(options, words):
    with pytest.raises(InvalidInput, match=words):
        find_similar(exemplar(2), **options)


def test_arrays_that_do_not_belong_together():
    appearance, region = exemplar(2), Region.whole((9, 9))
    frames, places = to_fixed(None, region), np.zeros(162, np.int32)
    other = find_similar(exemplar(2, True))
    with pytest.raises(InvalidInput, match="similarity"):
        correct(appearance, other, places, region, frames)
    with pytest.raises(InvalidInput, match="places"):
        correct(appearance, find_similar(appearance), places[:-1], region, frames)
    with pytest.raises(InvalidInput, match="region"):
        correct(appearance, find_similar(appearance), np.zeros(24, np.int32), Region.whole((2, 2, 2)), frames)
    with pytest.raises(InvalidInput, match="held"):
        correct(appearance, find_similar(appearance), places, region, frames, held=np.zeros(80, bool))
    with pytest.raises(InvalidInput, match="reach"):
        jitter(places, region, -1)


def test_sets_are_kept_with_the_analysis():
    found = texrs.Exemplar(samples.weave((64, 64)).image)
    assert found.similarity(0) is found.similarity(0)
    assert found.similarity(0) is not found.similarity(0, n=5)
    with pytest.raises(InvalidInput, match="level"):
        found.similarity(9)

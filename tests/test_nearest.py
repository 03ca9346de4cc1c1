"""The nearest of many vectors against its slow twin and a k-d tree; bad arguments; threads."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from reference import nearest as twin
from texrs import threads
from texrs import samples
from texrs.errors import Cancelled, InvalidInput
from texrs.kernels.nearest import Nearest


def windows(keep=30):
    """Return windows of a picture in the axes of their principal components."""
    image = samples.pebbles((60, 60)).image / 255.0
    every = np.lib.stride_tricks.sliding_window_view(image, (8, 8), axis=(0, 1))
    flat = every.reshape(-1, 192) - every.reshape(-1, 192).mean(axis=0)
    return flat @ np.linalg.eigh(flat.T @ flat)[1][:, ::-1][:, :keep]


@pytest.mark.parametrize("shift", [0.0, 1e5])
@pytest.mark.parametrize(("count", "numbers"), [(1, 1), (2, 3), (41, 8), (500, 30), (700, 5)])
def test_what_is_found_is_what_the_twin_finds(count, numbers, shift):
    rng = np.random.default_rng(count)
    # Whole numbers, many of them equal, are compared exactly.
    vectors = rng.integers(0, 7, (count, numbers)) + shift
    queries = rng.integers(-1, 8, (90, numbers)) + shift
    found = Nearest(vectors).query(queries)
    wanted, apart = twin.nearest(vectors, queries)
    np.testing.assert_array_equal(found.which, wanted)
    np.testing.assert_array_equal(found.distance, apart)
    if count > 1:
        found = Nearest(vectors).others()
        wanted, apart = twin.nearest(vectors, vectors, own=True)
        np.testing.assert_array_equal(found.which, wanted)
        np.testing.assert_array_equal(found.distance, apart)


def test_windows_are_found_as_a_tree_finds_them():
    vectors = windows()
    queries = vectors[::3] + np.random.default_rng(0).normal(0, 0.05, vectors[::3].shape)
    found = Nearest(vectors).query(queries)
    distance, index = cKDTree(vectors).query(queries)
    np.testing.assert_array_equal(found.which, index)
    np.testing.assert_array_equal(found.distance, distance)


def test_threads_do_not_change_a_bit():
    nearest, results = Nearest(windows(12)), []
    for count in (1, 2, 7):
        with threads(count):
            results.append(nearest.others())
    for other in results[1:]:
        np.testing.assert_array_equal(results[0].which, other.which)
        np.testing.assert_array_equal(results[0].distance, other.distance)


def test_what_is_far_away_is_found():
    found = Nearest([[0.0, 1e-30], [0.0, 3e-30]]).query([[1e150, 0.0], [0.0, 2.9e-30], [0.0, 0.0]])
    assert found.which.tolist() == [0, 1, 0]


@pytest.mark.parametrize(
    ("work", "message"),
    [
        (lambda: Nearest(np.zeros(3)), "vectors: needs real numbers of shape"),
        (lambda: Nearest(np.zeros((0, 3))), "vectors: needs shape"),
        (lambda: Nearest(np.zeros((3, 0))), "vectors: needs shape"),
        (lambda: Nearest([[np.nan]]), "vectors: needs finite numbers"),
        (lambda: Nearest([["a"]]), "vectors: needs real numbers"),
        (lambda: Nearest([[1.0]]).query([[1e200]]), "queries: needs finite numbers"),
        (lambda: Nearest([[1.0]]).query([[1.0, 2.0]]), "queries: needs 1 numbers each"),
        (lambda: Nearest([[1.0]]).others(), "vectors: one alone has no other"),
    ],
)
def test_bad_arguments(work, message):
    with pytest.raises(InvalidInput, match=message):
        work()


def test_no_queries_have_no_answers():
    found = Nearest([[1.0]]).query(np.zeros((0, 1)))
    assert len(found.which) == len(found.distance) == 0


def test_a_search_can_be_stopped():
    def stop(share):
        raise KeyboardInterrupt

    vectors = np.random.default_rng(0).random((60000, 40))
    with pytest.raises((KeyboardInterrupt, Cancelled)):
        Nearest(vectors).others(progress=stop)

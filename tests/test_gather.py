"""Lookup: exact at samples, within range between them, the same for every dtype."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.ndimage import map_coordinates

import texrs
from combinations import pairwise
from reference.look_up import look_up
from texrs.errors import InvalidInput
from texrs.kernels.gather import gather

DTYPES = [
    np.bool_,
    np.uint8,
    np.int8,
    np.uint16,
    np.int16,
    np.uint32,
    np.int32,
    np.float16,
    np.float32,
    np.float64,
]


@pytest.mark.parametrize(
    ("dtype", "channels", "interpolation"),
    pairwise(DTYPES, [None, 1, 2, 3, 4, 7], ["nearest", "linear", "cubic"]),
)
def test_whole_coordinates_copy_every_dtype(dtype, channels, interpolation):
    rng = np.random.default_rng(1)
    shape = (9, 7) if channels is None else (9, 7, channels)
    image = (rng.random(shape) * 100).astype(dtype)
    at = np.stack(np.meshgrid(np.arange(9), np.arange(7), indexing="ij"), axis=-1)[::-1, ::2]
    out = gather(image, at, interpolation=interpolation)
    assert out.dtype == image.dtype
    np.testing.assert_array_equal(out, image[::-1, ::2])


@settings(max_examples=40, deadline=None)
@given(
    hnp.arrays(np.float64, (6, 8), elements=st.floats(-1e3, 1e3)),
    hnp.arrays(np.float32, (20, 2), elements=st.floats(-3, 10, width=32)),
    st.sampled_from(["nearest", "grid-wrap"]),
)
def test_linear_agrees_with_scipy(image, points, mode):
    expected = map_coordinates(image, points.T.astype(np.float64), order=1, mode=mode)
    got = gather(image, points, wrap=mode == "grid-wrap")
    np.testing.assert_allclose(got, expected, atol=1e-9)


@settings(max_examples=40, deadline=None)
@given(
    hnp.arrays(np.float32, (5, 6), elements=st.floats(0, 4, width=32)),
    hnp.arrays(np.float32, (20, 2), elements=st.floats(-2, 8, width=32)),
)
def test_cubic_stays_in_the_range_of_the_data(image, points):
    out = gather(image, points, interpolation="cubic")
    assert out.min() >= image.min()
    assert out.max() <= image.max()


@given(
    dtype=st.sampled_from(DTYPES),
    channels=st.sampled_from([(), (1,), (3,)]),
    axes=st.sampled_from([2, 3]),
    interpolation=st.sampled_from(["nearest", "linear", "cubic"]),
    wrap=st.booleans(),
    step=st.sampled_from([0.0, 0.5, 1 / 4096]),
    seed=st.integers(0, 2**32),
)
def test_everything_is_that_of_the_slow_twin(dtype, channels, axes, interpolation, wrap, step, seed):
    rng = np.random.default_rng(seed)
    images = [(rng.random((*shape[:axes], *channels)) * 99).astype(dtype) for shape in ((5, 6, 4), (3, 7, 5))]
    at = rng.uniform(-3, 9, (40, axes)).astype(np.float32)
    # Include integer coordinates, halves, and fixed-point values, some along one axis only.
    rounded = rng.random((40, axes)) < 0.5
    at[rounded] = np.rint(at / step)[rounded] * step if step else np.rint(at)[rounded]
    which = rng.integers(0, 2, 40)
    found = gather(images, at, which, interpolation=interpolation, wrap=wrap)
    exact = look_up([i.astype(np.float64) for i in images], at, which, interpolation=interpolation, wrap=wrap)
    assert found.dtype == dtype
    if found.dtype.kind == "f":
        np.testing.assert_allclose(found, exact.astype(dtype), rtol=4 * np.finfo(dtype).eps, atol=1e-12)
    else:
        # If a sum ends in a half, its last bit decides which integer is the nearest.
        np.testing.assert_allclose(found.astype(np.float64), exact, rtol=0, atol=0.5 + 1e-9)


def test_volumes_and_several_exemplars():
    a = np.arange(24, dtype=np.uint16).reshape(2, 3, 4)
    b = a[:, ::-1] + np.uint16(100)
    at = np.array([[1, 2, 3], [0, 0, 0]])
    np.testing.assert_array_equal(gather([a, b], at, np.array([0, 1])), [a[1, 2, 3], b[0, 0, 0]])


@pytest.mark.parametrize("threads", [1, 2, 7])
def test_threads_do_not_matter(threads):
    rng = np.random.default_rng(2)
    image, at = rng.random((64, 64, 3)).astype(np.float32), rng.random((90, 70, 2)) * 63
    expected = gather(image, at, interpolation="cubic")
    with texrs.threads(threads):
        assert gather(image, at, interpolation="cubic").tobytes() == expected.tobytes()


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        (([np.zeros((4, 4))], np.array([[np.nan, 0.0]])), "coordinates"),
        (([np.zeros((4, 4)), np.zeros((4, 4, 3))], np.zeros((3, 2))), "exemplars"),
        (([np.zeros((4, 4)), np.zeros((4, 4), np.uint8)], np.zeros((3, 2))), "exemplars"),
        (([np.zeros((4, 4))], np.zeros((3, 2)), np.array([0, 1, 0])), "which"),
    ],
)
def test_bad_input_names_the_argument(arguments, names):
    with pytest.raises(InvalidInput, match=f"^{names}"):
        gather(*arguments)


@pytest.mark.parametrize("interpolation", ["nearest", "linear", "cubic"])
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64])
def test_what_is_not_finite_is_refused_where_it_is_looked_up(interpolation, bad, dtype):
    image = np.ones((9, 9, 2), dtype)
    image[4, 4, 1] = bad
    assert (gather(image, [[[0.5, 8.0], [1.0, 1.25]]], interpolation=interpolation) == 1).all()
    for at in ([4, 4], [3.6, 4.3], [4.4, 3.75]):
        with pytest.raises(InvalidInput, match=r"^exemplars: must be finite, but 1 of 162 values are NaN or infinite"):
            gather(image, [[[0, 0], at]], interpolation=interpolation)


def test_sums_beyond_the_largest_float_are_kept_as_they_come():
    largest = np.finfo(np.float32).max
    image = np.full((4, 4), largest)
    assert (gather(image, [[1.5, 1.5], [2, 2]]) == largest).all()


def test_what_is_nowhere_finite_is_refused():
    for interpolation in ("nearest", "linear", "cubic"):
        with pytest.raises(InvalidInput, match=r"^exemplars: must be finite, but 36 of 36 values"):
            gather(np.full((6, 6), np.nan), [[2.5, 2.25]], interpolation=interpolation)

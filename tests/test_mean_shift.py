import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reference import mean_shift as reference
from texrs._rust import set_threads
from texrs.errors import InvalidInput
from texrs.kernels.mean_shift import mean_shift


@settings(max_examples=30, deadline=None)
@given(
    shape=st.tuples(st.integers(1, 12), st.integers(1, 14), st.integers(1, 6)),
    radius=st.integers(0, 6),
    limit=st.floats(0, 200).map(lambda x: x + 0.123),
    iterations=st.integers(0, 5),
    wrap=st.tuples(st.booleans(), st.booleans()),
    seed=st.integers(0, 2**32),
)
def test_agrees_with_the_naive_twin(shape, radius, limit, iterations, wrap, seed):
    image = np.random.default_rng(seed).integers(0, 256, shape).astype(float)
    options = {"max_iterations": iterations, "tolerance": 1.01, "wrap": wrap}
    result = mean_shift(image, radius, limit, **options)
    expected = reference.mean_shift(image, radius, limit, **options)
    # A colour at the limit of the range may count or not, depending on rounding.
    assert np.mean(np.abs(result - expected) < 1e-2) > 0.98


@pytest.mark.parametrize("dtype", [bool, np.uint8, np.uint16, np.int16, np.float32, np.float64])
@pytest.mark.parametrize("channels", [None, 1, 2, 3, 4, 7])
def test_dtype_and_shape_come_back(dtype, channels):
    shape = (9, 11) if channels is None else (9, 11, channels)
    image = np.random.default_rng(1).integers(0, 90, shape).astype(dtype)
    result = mean_shift(image, 3, 20)
    assert (result.dtype, result.shape) == (image.dtype, shape)
    assert (mean_shift(image, 0, 20) == image).all()


def test_the_same_for_any_number_of_threads():
    image = np.random.default_rng(2).random((60, 70, 3))
    results = []
    for threads in (1, 2, 7):
        before = set_threads(threads)
        results.append(mean_shift(image, 5, 0.3).tobytes())
        set_threads(before)
    assert results[0] == results[1] == results[2]


def test_moving_a_cyclic_image_moves_the_result():
    image = np.random.default_rng(3).integers(0, 256, (20, 24, 3)).astype(np.uint8)
    result = mean_shift(image, 4, 60, wrap=True)
    moved = mean_shift(np.roll(image, (7, 11), (0, 1)), 4, 60, wrap=True)
    assert np.mean(moved == np.roll(result, (7, 11), (0, 1))) > 0.999


def test_progress_is_reported_and_can_stop():
    image = np.random.default_rng(4).random((300, 300, 3))

    class Stop(Exception):
        pass

    def stop(stage, share):
        assert stage == "mean shift"
        raise Stop

    with pytest.raises(Stop):
        mean_shift(image, 30, 0.5, max_iterations=50, progress=stop)


def test_refuses_with_a_reason():
    with pytest.raises(InvalidInput, match="image: must have values of at most"):
        mean_shift(np.full((4, 4), 1e30), radius=2, range=1.0)

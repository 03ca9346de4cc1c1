"""Gaussian smoothing with the bytes of SciPy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter

from texrs import _rust
from texrs._engine.smoothing import smooth


@given(
    st.lists(st.integers(1, 40), min_size=1, max_size=3),
    st.sampled_from([np.float32, np.float64]),
    st.sampled_from(["reflect", "nearest", "wrap", "constant"]),
    st.floats(0.1, 20),
    st.sampled_from([3.0, 4.0]),
)
def test_bytes_are_those_of_scipy(shape, dtype, mode, sigma, truncate) -> None:
    values = np.random.default_rng(len(shape)).normal(size=shape).astype(dtype)
    found = smooth(values, sigma, mode=mode, truncate=truncate)
    wanted = gaussian_filter(values, sigma, mode=mode, truncate=truncate)
    assert found.dtype == wanted.dtype
    assert (found == wanted).all()


def test_axes_differ() -> None:
    values = np.random.default_rng(0).random((30, 40))
    found = smooth(values, (0, 2.5), mode=("wrap", "nearest"))
    assert (found == gaussian_filter(values, (0, 2.5), mode=("wrap", "nearest"))).all()
    assert smooth(values[:0], 1.0).shape == (0, 40)
    # The caller's array must not change.
    before = values.copy()
    smooth(values, 2.0)[...] = 0
    assert (values == before).all()


def test_what_is_no_edge_is_refused() -> None:
    with pytest.raises(ValueError, match="edge"):
        _rust.smooth(np.zeros(4), (4,), [((1.0,), "round")])

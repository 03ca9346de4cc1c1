import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reference import reconstruction as reference
from texrs.errors import InvalidInput
from texrs.kernels.reconstruction import reconstruct


@settings(max_examples=60, deadline=None)
@given(
    shape=st.tuples(st.integers(1, 14), st.integers(1, 14)),
    levels=st.integers(1, 40),
    wrap=st.tuples(st.booleans(), st.booleans()),
    seed=st.integers(0, 2**32),
)
def test_agrees_with_the_naive_twin(shape, levels, wrap, seed):
    random = np.random.default_rng(seed)
    start, mask = random.integers(-levels, levels, (2, *shape))
    assert (reconstruct(start, mask, wrap=wrap) == reference.reconstruct(start, mask, wrap=wrap)).all()


@pytest.mark.parametrize("shape", [(90, 70), (1, 50), (50, 1), (64, 200)])
def test_it_is_that_of_scikit_image(shape):
    from scipy.ndimage import gaussian_filter
    from skimage.morphology import reconstruction

    noise = np.random.default_rng(1).normal(size=shape)
    mask = np.float32(noise + 30 * gaussian_filter(noise, 4))
    for dome in (0.1, 1.0, 5.0):
        start = mask - np.float32(dome)
        assert (reconstruct(start, mask) == reconstruction(start, mask)).all()


def test_refuses_with_a_reason():
    with pytest.raises(InvalidInput, match="mask"):
        reconstruct(np.zeros((2, 2)), [["a", "b"]])

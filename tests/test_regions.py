import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reference import regions as reference
from texrs import samples
from texrs._rust import set_threads
from texrs.errors import InvalidInput
from texrs.kernels.mean_shift import mean_shift
from texrs.kernels.regions import felzenszwalb


@settings(max_examples=40, deadline=None)
@given(
    shape=st.tuples(st.integers(1, 12), st.integers(1, 14), st.integers(1, 4)),
    levels=st.sampled_from([1, 5, 200]),
    scale=st.floats(0, 400),
    blur=st.floats(0, 2),
    least=st.integers(0, 20),
    wrap=st.tuples(st.booleans(), st.booleans()),
    seed=st.integers(0, 2**32),
)
def test_agrees_with_the_naive_twin(shape, levels, scale, blur, least, wrap, seed):
    random = np.random.default_rng(seed)
    image = random.integers(0, levels + 1, shape) + 10.0 * (np.arange(shape[1]) // 5)[:, None]
    # Without a blur all values are exact, and ties have the same order. With a blur, rounding breaks ties.
    blur = blur if levels == 200 else 0.0
    options = {"blur": blur, "least": least, "wrap": wrap}
    assert (felzenszwalb(image, scale, **options) == reference.merge(image, scale, **options)).mean() > (
        0.9 if blur else 0.999
    )


PICTURES = {
    "pebbles": lambda: samples.pebbles((128, 128)).image,
    "weave": lambda: samples.weave((128, 128)).image,
    "bricks": lambda: samples.bricks((128, 128)).image,
    "noise": lambda: np.random.default_rng(5).random((150, 90, 3)),
    "grey": lambda: np.random.default_rng(6).random((90, 110)),
}


@pytest.mark.parametrize("name", PICTURES)
@pytest.mark.parametrize("smooth", [False, True])
def test_regions_are_those_of_scikit_image(name, smooth):
    from skimage.segmentation import felzenszwalb as reference_felzenszwalb

    image = PICTURES[name]()
    unit = image / np.float32(255) if image.dtype.kind == "u" else image.astype(np.float32)
    # Add noise so that no two colours are equal, because scikit-image orders equal steps arbitrarily.
    unit = np.float32(unit + np.random.default_rng(1).normal(0, 0.01, unit.shape))
    if smooth:
        unit = mean_shift(unit, 6, 0.05)
    for scale, blur, least in [(60, 0.4, 24), (300, 0.8, 5), (1, 0.0, 0)]:
        theirs = reference_felzenszwalb(unit.astype(np.float64), scale, blur, least)
        assert (felzenszwalb(unit, scale / 255, blur=blur, least=least) == theirs).all()


def test_the_same_for_any_number_of_threads():
    image = np.random.default_rng(2).random((150, 70, 3))
    results = []
    for threads in (1, 2, 7):
        before = set_threads(threads)
        results.append(felzenszwalb(image, 0.5).tobytes())
        set_threads(before)
    assert results[0] == results[1] == results[2]


def test_moving_a_cyclic_image_moves_the_regions():
    image = np.random.default_rng(3).random((20, 24, 3))
    found = felzenszwalb(image, 0.3, blur=0, wrap=True)
    moved = felzenszwalb(np.roll(image, (7, 11), (0, 1)), 0.3, blur=0, wrap=True)
    pairs = np.stack([np.roll(found, (7, 11), (0, 1)), moved], -1).reshape(-1, 2)
    assert found.max() > 2
    assert len(np.unique(pairs, axis=0)) == found.max() + 1 == moved.max() + 1


@pytest.mark.parametrize("dtype", [bool, np.uint8, np.uint16, np.int16, np.float32, np.float64])
@pytest.mark.parametrize("channels", [None, 1, 2, 3, 4, 7])
def test_any_dtype_and_channels(dtype, channels):
    shape = (9, 11) if channels is None else (9, 11, channels)
    image = np.random.default_rng(1).integers(0, 90, shape).astype(dtype)
    found = felzenszwalb(image, 20, least=3)
    assert (found.dtype, found.shape) == (np.int32, (9, 11))
    assert (found == felzenszwalb(image.astype(float), 20, least=3)).all()


def test_regions_are_as_large_as_asked_for():
    image = np.random.default_rng(4).random((40, 40))
    assert np.bincount(felzenszwalb(image, 0.1, least=30).ravel()).min() >= 30
    assert len(np.unique(felzenszwalb(image, 0, blur=0, least=0))) == image.size
    assert felzenszwalb(image, 1e15).max() == 0


def test_progress_can_stop():
    image = np.random.default_rng(4).random((1500, 1500, 3))

    class Stop(Exception):
        pass

    def stop(stage, share):
        assert stage == "regions"
        raise Stop

    with pytest.raises(Stop):
        felzenszwalb(image, 0.5, progress=stop)


def test_refuses_with_a_reason():
    with pytest.raises(InvalidInput, match="image: must have values of at most"):
        felzenszwalb(np.full((4, 4), 1e30), scale=1.0)

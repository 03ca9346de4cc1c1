"""Normalised cross-correlation compared with its slow twin; flat parts; bad arguments; threads."""

import numpy as np
import pytest

from reference import ncc as twin
from texrs import threads
from texrs.errors import InvalidInput
from texrs.kernels.ncc import Correlation

NOISE = np.random.default_rng(3).random((31, 23, 3)).astype(np.float32)


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (5, 3), (31, 23)])
@pytest.mark.parametrize("offset", [0.0, 1000.0])
def test_maps_are_those_of_the_definition(shape, offset):
    template = NOISE[2 : 2 + shape[0], 1 : 1 + shape[1]] if shape != (31, 23) else NOISE[::-1]
    found = Correlation(NOISE + np.float32(offset)).maps(template * 2 + 5)
    wanted = twin.maps(NOISE + np.float32(offset), template * 2 + 5)
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, wanted, atol=2e-6 if offset == 0 else 1e-3)


def test_brightness_and_contrast_do_not_count():
    found = Correlation(NOISE[..., 0]).maps(7 - 3 * NOISE[4:9, 6:15, 0])[..., 0]
    assert found[4, 6] == found.min() == -1


def test_what_is_flat_is_like_nothing():
    image = NOISE[..., 0].copy()
    image[:12] = 0.3
    assert (Correlation(image).maps(image[15:20, :5])[:8] == 0).all()
    assert (Correlation(image).maps(np.full((3, 3), 0.7)) == 0).all()
    assert (Correlation(np.full((9, 9), 0.1)).maps(NOISE[:3, :3, 0]) == 0).all()


def test_same_bytes_for_any_number_of_threads():
    found = []
    for count in (1, 2, 7):
        with threads(count):
            found.append(Correlation(NOISE).maps(NOISE[3:8, 2:9]).tobytes())
    assert len(set(found)) == 1


@pytest.mark.parametrize(
    ("template", "message"),
    [
        (NOISE[:5, :5, :2], "template: must have 3 channels like the image, got 2"),
        (np.ones((32, 3, 3)), "template: .*\\[32, 3\\]"),
    ],
)
def test_what_does_not_fit_is_refused(template, message):
    with pytest.raises(InvalidInput, match=message):
        Correlation(NOISE).maps(template)

"""Constraints of a grown texture: given points, and maps that are followed."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import texrs
from reference.look_up import view
from texrs import samples
from texrs.errors import InvalidInput

STRIPES = samples.stripes((32, 32, 32)).image
WEAVE = samples.weave((48, 48)).image


# --- hard data -------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def boxed():
    """Return the mask of a box, and its contents: a piece of the exemplar from elsewhere."""
    held = np.zeros((32, 36, 40), bool)
    held[10:24, 12:26, 8:22] = True
    values = np.zeros((32, 36, 40, 3), np.uint8)
    values[10:24, 12:26, 8:22] = STRIPES[9:23, 9:23, 9:23]
    return held, values


def edge(image, held):
    """Return the mean change across the border of the fixed part."""
    seen, total, count = image.astype(float), 0.0, 0
    for axis in range(3):
        border = np.diff(held.astype(int), axis=axis) != 0
        total += np.abs(np.diff(seen, axis=axis))[border].sum()
        count += border.sum()
    return total / count


@cache
def free(quality="preserve"):
    """Return several results without constraints, because the layers of one may match the fixed part by chance."""
    return [texrs.solid(STRIPES, (32, 36, 40), seed=seed, quality=quality).image for seed in (1, 2, 3)]


def pasted_edge(held, values, quality="preserve"):
    """Return the mean change across the border if the fixed part is only pasted in."""
    return np.mean([edge(np.where(held[..., None], values, image), held) for image in free(quality)])


@pytest.mark.parametrize("quality", ["preserve", "fast"])
def test_held_values_stay_and_their_surroundings_agree(boxed, quality):
    held, values = boxed
    given = texrs.Constraints(mask=held, values=values)
    made = texrs.solid(STRIPES, held.shape, seed=3, constraints=given, quality=quality)
    assert made.report["constrained_points"] == held.sum()
    np.testing.assert_array_equal(made.image[held], values[held])
    np.testing.assert_array_equal(made.image[~held], made.stages["before_blending"][~held])
    np.testing.assert_array_equal(
        view(made.source_map, STRIPES, made.report["interpolation"]), made.stages["before_blending"]
    )
    assert edge(made.image, held) < 0.7 * pasted_edge(held, values, quality)
    # Even before the values are fixed, the texture is similar to them inside the box.
    off = np.abs(made.stages["before_blending"][held].astype(int) - values[held]).mean()
    assert off < 0.5 * np.mean([np.abs(image[held].astype(int) - values[held]).mean() for image in free(quality)])


def test_held_coordinates_stay_and_their_surroundings_agree(boxed):
    held, values = boxed
    places = np.full((*held.shape, 3), np.nan, np.float32)
    places[held] = np.argwhere(held) - (10, 12, 8) + 9
    given = texrs.Constraints(mask=held, coordinates=places)
    made = texrs.solid(STRIPES, held.shape, seed=3, constraints=given)
    np.testing.assert_array_equal(made.source_map.coordinates[held], places[held])
    np.testing.assert_array_equal(made.image, made.stages["before_blending"])
    np.testing.assert_array_equal(made.image[held], values[held])
    assert edge(made.image, held) < 0.7 * pasted_edge(held, values)


def test_held_pixels_of_pictures_and_of_labels():
    held = np.zeros((40, 44), bool)
    held[5:25, 30:] = True
    grey = WEAVE[..., 0]
    values = np.pad(grey[:40, :44], ((0, 0), (0, 0)))
    given = texrs.Constraints(mask=held.astype(np.uint8), values=values[..., None])
    made = texrs.synthesize(grey, held.shape, constraints=given)
    np.testing.assert_array_equal(made.image[held], values[held])
    classes = (grey // 52).astype(np.uint8)
    given = texrs.Constraints(mask=held, values=classes[:40, :44])
    made = texrs.synthesize(texrs.Exemplar(classes, labels=True), held.shape, constraints=given)
    np.testing.assert_array_equal(made.image[held], classes[:40, :44][held])


# --- maps to follow -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("axes", [2, 3])
def test_a_map_is_followed(axes):
    """An exemplar that grows brighter downwards, grown with the opposite trend."""
    side, size = (64, 96) if axes == 2 else (32, 40)
    column = (-1, *[1] * (axes - 1))
    ramp, wanted = np.linspace(0, 1, side).reshape(column), np.linspace(1, 0, size).reshape(column)
    image = (np.random.default_rng(0).random((side,) * axes) * 0.3 + ramp).astype(np.float32)
    verb = texrs.synthesize if axes == 2 else texrs.solid
    made = verb(image, size, seed=1, guide=texrs.Guide(exemplar=ramp, output=wanted))
    assert made.report["guided"]
    assert np.corrcoef(made.image.reshape(size, -1).mean(axis=1), wanted.reshape(-1))[0, 1] > 0.95
    free = verb(image, size, seed=1)
    assert not free.report["guided"]
    assert np.corrcoef(free.image.reshape(size, -1).mean(axis=1), wanted.reshape(-1))[0, 1] < 0.8


MAP = np.zeros((64, 64))
VALUES = texrs.Constraints(mask=np.ones((40, 40), bool), values=np.zeros((40, 40)))


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (
            {"guide": texrs.Guide(exemplar=np.zeros((7, 1)), output=0)},
            "guide: the map of the exemplar must contain numbers and broadcast",
        ),
        (
            {"guide": texrs.Guide(exemplar=0, output=MAP)},
            "guide: the map of the output must contain numbers and broadcast",
        ),
        (
            {"guide": texrs.Guide(exemplar=0, output=0), "constraints": VALUES},
            "guide: cannot be combined with constraints that have values",
        ),
        ({"guide": texrs.Guide(exemplar=0.0, output=0.0), "method": "paper"}, "guide: cannot be combined with method"),
    ],
)
def test_wrong_maps_get_a_sentence(more, says):
    with pytest.raises(InvalidInput, match=says):
        texrs.synthesize(np.random.default_rng(0).random((64, 64)), 40, **more)

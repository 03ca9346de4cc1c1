"""Examples that show an oblique plane are flattened before a texture is designed from them."""

import numpy as np
import pytest

import texrs
from texrs import samples
from texrs.papers.design import oblique


@pytest.fixture(scope="module")
def floor():
    return samples.tilted_discs((192, 256))


@pytest.fixture(scope="module")
def made(floor):
    return texrs.design(floor.image, (160, 176), seed=1, copies=1)


def test_a_clear_floor_is_flattened_and_maps_refer_to_the_photograph(floor, made):
    assert made.report["flattened"]["slant"] == pytest.approx(45, abs=12)
    assert "flattened" in made.report["assumed"][0]
    assert made.image.shape == (160, 176, 3)
    assert made.source_map.shapes == ((192, 256),)
    np.testing.assert_array_equal(made.source_map.render(floor.image), made.stages["before_blending"])


def test_elements_of_a_flattened_floor_have_one_size(floor, made):
    plain = texrs.design(floor.image, (160, 176), seed=1, copies=1, way="still")
    assert plain.report["flattened"] is None
    # The scale of the floor at each pixel, and how much a pixel of the result shows of it.
    spread = []
    for result in (made, plain):
        frames = result.source_map.jacobians()
        grown = np.sqrt(np.abs(np.linalg.det(frames)))
        row, column = np.moveaxis(np.rint(result.source_map.coordinates).astype(int), -1, 0)
        row, column = np.clip(row, 0, 191), np.clip(column, 0, 255)
        spread.append(float(np.std(np.log(np.asarray(floor.scale_map)[row, column] / grown))))
    assert spread[0] < 0.5 * spread[1]


@pytest.mark.parametrize("name", ["pebbles", "bricks", "weave", "bark"])
def test_frontal_examples_are_used_as_they_are(name):
    image = samples.load(name, size=(128, 128)).image
    assert oblique.find_view(texrs.Exemplar(image)) is None


@pytest.mark.parametrize("image", [np.ones((96, 96), np.uint8), np.ones((40, 300), np.uint8)], ids=["plain", "strip"])
def test_images_without_a_plane_are_used_as_they_are(image):
    assert oblique.find_view(texrs.Exemplar(image)) is None

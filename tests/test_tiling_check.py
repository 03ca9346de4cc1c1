"""Tileable images stay unchanged, and all others change as little as possible."""

from __future__ import annotations

import numpy as np
import pytest

import texrs
from texrs import samples, tiling
from texrs.errors import InvalidInput
from texrs.tiling import Tiling


def picture(name: str, side: int = 128) -> np.ndarray:
    return samples.load(name, size=(side, side)).image


def pixel_art() -> np.ndarray:
    """Return bricks of 16 x 16 pixels in four colours that tile."""
    palette = np.array([[90, 30, 25], [150, 60, 45], [170, 75, 55], [190, 185, 170]], np.uint8)
    index = np.random.default_rng(4).integers(0, 3, (16, 16))
    index[3::4] = 3
    index[0:3, 7] = index[8:11, 7] = index[4:7, 15] = index[12:15, 15] = 3
    return palette[index]


def multiply(image: np.ndarray, low: float, high: float) -> np.ndarray:
    """Return an image with uneven light across its width."""
    ramp = np.linspace(low, high, image.shape[1])[:, np.newaxis]
    return np.clip(np.rint(image * ramp), 0, 255).astype(np.uint8)


# --- the check ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["pebbles", "grit", "beans", "bricks", "leaves_and_flowers"])
def test_crops_do_not_tile_and_textures_that_wrap_do(name):
    image = picture(name)
    assert texrs.check_tiling(image).tiles == (False, False)
    wrapped = texrs.tile(image).image
    assert texrs.check_tiling(wrapped).tiles == (True, True)
    # The result does not depend on the position of the border in a tileable image.
    assert sum(sum(texrs.check_tiling(np.roll(wrapped, (k, 3 * k), (0, 1))).tiles) for k in (7, 23, 41)) >= 5


def test_each_axis_is_checked():
    wrapped = texrs.tile(picture("pebbles"), wrap=(True, False)).image
    found = texrs.check_tiling(wrapped)
    assert found.tiles == (True, False)
    assert found.seam[0] <= 1.25 < found.seam[1]
    assert texrs.check_tiling(wrapped.swapaxes(0, 1)).tiles == (False, True)


def test_a_single_broken_place_counts():
    image = np.tile(texrs.tile(picture("beans", 160)).image, (1, 2, 1))
    assert texrs.check_tiling(image).tiles[0]
    broken = image.copy()
    broken[:8, 100:124] = image[60:68, 30:54]
    found = texrs.check_tiling(broken)
    assert not found.tiles[0]
    first, after = found.place[0]
    assert first < 124
    assert after > 100


def test_light_that_differs_at_the_ends_does_not_tile():
    image = texrs.tile(picture("grit")).image
    assert texrs.check_tiling(multiply(image, 0.7, 1.3)).tiles == (True, False)


def test_a_lattice_out_of_step_does_not_tile():
    # Any two lines of noise differ equally, so only lines one period apart show whether the lattice continues.
    image = np.tile(np.random.default_rng(3).integers(0, 256, (20, 28, 3), dtype=np.uint8), (7, 6, 1))
    assert texrs.check_tiling(image).tiles == (True, True)
    assert texrs.check_tiling(image[:131, :150]).tiles == (False, False)


@pytest.mark.parametrize("dtype", [np.uint16, np.float32, np.float64])
def test_any_dtype_and_channels(dtype):
    image = picture("pebbles")
    scale = 257 if dtype == np.uint16 else 1 / 255
    found = texrs.check_tiling((image * np.asarray(scale, dtype)).astype(dtype))
    assert found.seam == pytest.approx(texrs.check_tiling(image).seam, rel=0.02)
    assert texrs.check_tiling(image[..., 0]).tiles == (False, False)


def test_few_lines_say_nothing():
    found = texrs.check_tiling(np.zeros((7, 40), np.uint8))
    assert found.seam[0] is None
    assert found.place[0] is None
    assert found.tiles == (False, True)


def test_each_map_of_a_material_is_checked():
    wrapped = texrs.tile(picture("pebbles")).image
    height = np.arange(wrapped[..., 0].size, dtype=np.uint16).reshape(wrapped.shape[:2])
    found = texrs.check_tiling(texrs.Material({"albedo": wrapped, "height": height}))
    assert found.maps["albedo"].tiles == (True, True)
    assert found.tiles[0] == found.maps["height"].tiles[0] == False  # noqa: E712
    assert set(found.report()["maps"]) == {"albedo", "height"}


def test_only_pictures_are_checked():
    assert Tiling((None, 1.0), (None, (0, 8))).tiles == (False, True)


# --- seams inside the image ----------------------------------------------------------------------------------------------


def split(image: np.ndarray, factor: float) -> tuple[np.ndarray, texrs.SourceMap]:
    """Return an image whose right half has other rows and other light, and its source map."""
    rows, columns = image.shape[:2]
    at = np.stack(np.indices((rows, columns)), axis=-1).astype(np.float32)
    at[:, columns // 2 :, 0] = (at[:, columns // 2 :, 0] + rows // 2) % rows
    label = (np.indices((rows, columns))[1] >= columns // 2).astype(np.uint32)
    source = texrs.SourceMap.from_coordinates(at, (rows, columns), label=label)
    made = source.render(image)
    made[:, columns // 2 :] = np.rint(made[:, columns // 2 :] * factor)
    return made, source


def test_a_step_across_a_seam_inside_the_image_is_measured():
    made, source = split(picture("grit"), 0.6)
    found = texrs.check_tiling(made, source)
    assert found.visible
    assert found.step[1] > 1.5
    assert found.seam == texrs.check_tiling(made).seam
    assert texrs.check_tiling(made).step == (None, None)
    assert not texrs.check_tiling(made).visible
    assert found.report()["columns"]["step"] == found.step[1]
    # The same seam in even light is invisible.
    assert texrs.check_tiling(*split(picture("grit"), 1.0)).step[1] < 1
    material = texrs.Material({"albedo": made, "height": np.full(made.shape[:2], 9, np.uint16)})
    assert texrs.check_tiling(material, source).step == found.step


def test_a_source_map_has_the_size_of_the_image():
    with pytest.raises(
        InvalidInput, match=r"source_map: must have the size of the image, \(128, 128\), got \(64, 64\)"
    ):
        texrs.check_tiling(picture("grit"), texrs.SourceMap.identity((64, 64)))


def test_another_joint_is_taken_if_a_seam_is_visible(monkeypatch):
    image = samples.pebbles((192, 192), seed=0).image
    first = texrs.tile(image)
    # Call the boldest seam of this result visible.
    seen = 0.99 * tiling.find_boldest(first)
    monkeypatch.setattr(tiling, "SEEN", seen)
    made = texrs.tile(image)
    assert tiling.find_boldest(made) < seen
    assert made.image.shape == first.image.shape
    assert not made.report["warnings"]


def test_seams_that_stay_visible_are_listed():
    made = texrs.tile(multiply(picture("grit"), 0.4, 1.6), flatten_lighting=False)
    assert made.report["tiling"]["columns"]["step"] > 1.25
    assert any(
        each.startswith("columns: a seam inside the image is visible, ")
        and each.endswith("as the boldest lines elsewhere")
        for each in made.report["warnings"]
    )


# --- what tiles already ------------------------------------------------------------------------------------------------


def test_pixel_art_that_tiles_comes_back():
    image = pixel_art()
    made = texrs.tile(image)
    np.testing.assert_array_equal(made.image, image)
    assert made.report["already"] == ["rows", "columns"]
    assert made.report["in_place"] == 1
    assert "image: is already tileable along the rows and columns, which are not changed" in made.report["assumed"]


@pytest.mark.parametrize("name", ["pebbles", "beans", "bricks", "grit", "scales"])
@pytest.mark.parametrize("seed", [0, 1])
def test_a_design_that_wraps_comes_back(name, seed):
    image = texrs.design(picture(name, 96), 128, wrap=True, seed=seed).image
    made = texrs.tile(image, screening=0.1)
    np.testing.assert_array_equal(made.image, image)
    assert made.report["joints"] == {}


def test_only_the_axis_that_does_not_tile_is_joined():
    image = texrs.tile(picture("pebbles"), wrap=(False, True)).image
    made = texrs.tile(image)
    assert made.report["already"] == ["columns"]
    assert list(made.report["joints"]) == ["rows"]
    assert made.image.shape[1] == image.shape[1]
    assert texrs.check_tiling(made.image).tiles == (True, True)


def test_what_is_asked_for_is_done_to_pictures_that_tile():
    image = texrs.tile(picture("pebbles")).image
    assert texrs.tile(image, overlap=10).image.shape[0] == image.shape[0] - 10
    assert texrs.tile(image, size=(64, 80)).image.shape == (64, 80, 3)


def test_a_material_that_tiles_comes_back():
    image = texrs.tile(picture("pebbles")).image
    given = texrs.Material({"albedo": image, "height": image[..., 0].astype(np.uint16) * 257})
    made = texrs.tile(given)
    assert all((made.material[name].pixels == each.pixels).all() for name, each in given.items())
    assert made.report["already"] == ["rows", "columns"]


def test_a_material_is_joined_if_one_map_does_not_tile():
    image = texrs.tile(picture("pebbles")).image
    rows, columns = image.shape[:2]
    height = np.tile(np.linspace(0, 60000, columns).astype(np.uint16), (rows, 1))
    made = texrs.tile(texrs.Material({"albedo": image, "height": height}))
    assert made.report["already"] == ["rows"]
    assert list(made.report["joints"]) == ["columns"]


# --- size and place ----------------------------------------------------------------------------------------------------


def test_the_size_of_a_wall_that_is_not_regular_is_kept():
    wall = samples.load("brick").image[:256, :256]
    assert texrs.tile(wall).image.shape == wall.shape


@pytest.mark.parametrize("name", ["pebbles", "grit", "bricks"])
def test_pixels_far_from_the_border_stay_where_they_are(name):
    image = picture(name, 192)
    made = texrs.tile(image)
    rows, columns = made.image.shape[:2]
    middle = tuple(
        slice(overlap, None) if overlap else slice(n // 4, n * 3 // 4)
        for overlap, n in zip(made.report["overlap"], (rows, columns), strict=True)
    )
    np.testing.assert_array_equal(made.image[middle], image[:rows, :columns][middle])
    assert made.report["in_place"] >= 0.4


# --- light -------------------------------------------------------------------------------------------------------------


def test_uneven_light_is_evened_and_reported():
    gravel = samples.load("gravel").image[:256, :256]
    lit = multiply(gravel[..., np.newaxis], 0.55, 1.45)
    made, kept = texrs.tile(lit), texrs.tile(lit, flatten_lighting=False)
    assert made.report["flatten_lighting"] is True
    # Pixels stay in place, but their values do not.
    assert made.report["unchanged"] < 0.1 < 0.4 < made.report["in_place"]
    assert kept.report["unchanged"] == pytest.approx(kept.report["in_place"], abs=0.01)
    assert kept.report["flatten_lighting"] is False
    [said] = [each for each in made.report["assumed"] if "unevenly" in each]
    assert said.startswith("image: is lit unevenly, because one part is 2.")
    ends = [np.ptp([part.mean() for part in np.array_split(each.image, 8, axis=1)]) for each in (made, kept)]
    assert ends[0] < 0.4 * ends[1]


@pytest.mark.parametrize("name", ["pebbles", "beans", "grit", "bricks", "leaves_and_flowers"])
@pytest.mark.parametrize("side", [128, 192])
def test_even_light_stays(name, side):
    made = texrs.tile(picture(name, side))
    assert made.report["flatten_lighting"] is False
    assert not any("lit" in each for each in made.report.get("assumed", []))


def test_heights_normals_and_what_tiles_are_not_lit():
    ramp = np.tile(np.linspace(10000, 40000, 160), (160, 1))
    noise = np.random.default_rng(1).normal(0, 900, ramp.shape)
    for heights in ((ramp + noise).astype(np.uint16), (ramp + noise).astype(np.float32) / 65535):
        assert texrs.tile(heights).report["flatten_lighting"] is False
    slope = np.stack([0.7 * np.linspace(-1, 1, 160) * np.ones((160, 1)), 0 * ramp, 0 * ramp], axis=-1)
    slope[..., 2] = np.sqrt(1 - slope[..., 0] ** 2)
    assert texrs.tile(np.rint((slope / 2 + 0.5) * 255).astype(np.uint8)).report["flatten_lighting"] is False


def test_pictures_of_few_colours_keep_them():
    image = np.kron(np.tile(pixel_art(), (3, 3, 1))[:40, :44], np.ones((4, 4, 1), np.uint8))
    image[:, 88:] //= 4
    made = texrs.tile(image)
    assert made.report["flatten_lighting"] is False
    assert {*map(tuple, made.image.reshape(-1, 3))} <= {*map(tuple, image.reshape(-1, 3))}


def test_only_colours_of_a_material_are_evened():
    image = multiply(picture("grit"), 0.55, 1.45)
    material = texrs.Material({"albedo": image, "height": image[..., 0].astype(np.uint16) * 257})
    made = texrs.tile(material)
    assert made.report["flatten_lighting"] is True
    at = made.source_map.coordinates.astype(int)
    np.testing.assert_array_equal(made.material["height"].pixels, material["height"].pixels[at[..., 0], at[..., 1]])
    even = material.flatten_lighting()["albedo"].pixels
    np.testing.assert_array_equal(made.material["albedo"].pixels, even[at[..., 0], at[..., 1]])

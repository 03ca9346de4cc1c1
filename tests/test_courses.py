"""Walls of courses: found for any heights, and composed so that all joints are continuous."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, rotate

import texrs
from texrs.exemplar import Exemplar
from texrs.exemplar.courses import find_courses
from texrs.exemplar.regularity import find_lattice

JOINT = np.array([0.75, 0.73, 0.68])


def lay_wall(
    shape: tuple[int, int] = (192, 224), heights: tuple[int, int] = (24, 24), *, turn: float = 0.0, seed: int = 0
) -> NDArray[np.uint8]:
    """Draw a wall of level courses of given heights, with stones of all lengths, rotated by some degrees."""
    rng = np.random.default_rng(seed)
    rows, columns = (round(1.4 * n) for n in shape)
    picture = np.full((rows, columns, 3), JOINT)
    y = 0
    while y < rows:
        height, x = int(rng.integers(heights[0], heights[1] + 1)), -int(rng.integers(0, 60))
        while x < columns:
            length = int(rng.integers(24, 70))
            stone = np.array([0.5, 0.36, 0.28]) * rng.uniform(0.7, 1.25) + rng.normal(0, 0.03, 3)
            picture[y : y + height - 3, max(x, 0) : max(x + length - 3, 0)] = stone
            x += length
        y += height
    picture = (
        gaussian_filter(picture, (1, 1, 0))
        + 0.08 * gaussian_filter(rng.normal(0, 1, picture.shape[:2]), 1.2)[..., None]
    )
    if turn:
        picture = rotate(picture, turn, reshape=False, order=1, mode="reflect")
    top, left = ((b - n) // 2 for b, n in zip((rows, columns), shape, strict=True))
    middle = picture[top : top + shape[0], left : left + shape[1]]
    return np.rint(255 * np.clip(middle, 0, 1)).astype(np.uint8)


def measure_joints(image: NDArray[Any]) -> tuple[float, int]:
    """Return the continuity of the joints of a level wall, and their number.

    The continuity of a row is the share of joint pixels in it. Stones on half of it give 0.5.
    """
    bright = gaussian_filter(image.astype(float), (0.5, 0.5, 0)).mean(axis=-1) > 150
    share = bright.mean(axis=1)
    joints = share > 0.5
    count = int(np.count_nonzero(joints & ~np.roll(joints, 1)))
    return float(
        np.mean(
            [share[k] for k in np.flatnonzero(joints & (share >= np.roll(share, 1)) & (share >= np.roll(share, -1)))]
        )
    ), count


def test_courses_are_part_of_the_elements() -> None:
    found = texrs.Exemplar(lay_wall()).elements
    assert found.courses is not None
    assert found.lattice is None
    assert 0.7 < found.courses.confidence < 1
    assert f"{found.courses}, {found.courses.confidence:.0%} sure" in repr(found)


def find(image: NDArray[np.uint8]) -> Any:
    guide = Exemplar(image).guidance
    return find_courses(guide, find_lattice(guide))


@pytest.mark.parametrize("heights", [(24, 24), (16, 36)])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_courses_are_found_whatever_their_heights(heights: tuple[int, int], seed: int) -> None:
    wall = lay_wall(heights=heights, seed=seed)
    found = find(wall)
    assert found is not None
    assert (found.axis, found.slope) == (0, 0.0)
    bright = wall.mean(axis=(1, 2))
    # A joint has three rows that are brighter than stones.
    assert all(bright[round(j)] > np.median(bright) + 20 for j in found.joints)
    assert heights[0] - 1.5 <= found.heights.min()
    assert found.heights.max() <= heights[1] + 1.5
    across = find(np.ascontiguousarray(wall.swapaxes(0, 1)))
    assert across is not None
    assert across.axis == 1
    np.testing.assert_allclose(across.joints, found.joints)


@pytest.mark.parametrize("turn", [-6.0, -2.0, 3.0, 7.0])
def test_what_climbs_is_made_level(turn: float) -> None:
    wall = lay_wall((224, 224), turn=turn, seed=4)
    found = find(wall)
    assert found is not None
    assert found.axis == 0
    assert np.degrees(np.arctan(found.slope)) == pytest.approx(-turn, abs=0.4)
    np.testing.assert_allclose(found.heights, 24, atol=1.5)
    level = found.level(wall.shape[:2]).render(wall)
    unbroken, count = measure_joints(level)
    assert unbroken > 0.85
    assert count >= len(found.joints) - 1


def test_what_repeats_along_its_courses_lies_on_a_lattice() -> None:
    for name in ("bricks", "weave", "scales", "net"):
        assert find(texrs.samples.load(name).image) is None


@pytest.mark.parametrize("name", ["pebbles", "dots", "beans", "bark", "grit", "leaves_and_flowers"])
def test_what_has_no_courses_has_none(name: str) -> None:
    assert find(texrs.samples.load(name).image) is None


def test_photographs_without_courses_have_none() -> None:
    import skimage.data

    for name in ("brick", "grass", "gravel", "camera", "coffee", "text", "page"):
        assert find(getattr(skimage.data, name)()) is None, name


@pytest.mark.parametrize("heights", [(24, 24), (16, 36)])
@pytest.mark.parametrize("wrap", [True, False])
def test_joints_go_through_the_whole_texture(heights: tuple[int, int], wrap: bool) -> None:
    wall = lay_wall(heights=heights, seed=5)
    made = texrs.design(wall, (300, 400), seed=1, wrap=wrap)
    assert made.report["arrangement"] == ["courses"]
    own, _ = measure_joints(wall)
    unbroken, count = measure_joints(made.image)
    assert unbroken > own - 0.03
    assert count >= 0.8 * 300 / heights[1]
    if wrap:
        # Courses are also whole where the image wraps.
        rolled, there = measure_joints(np.roll(made.image, 150, axis=0))
        assert there == count
        assert rolled == pytest.approx(unbroken, abs=0.01)


def test_upright_courses_are_laid_like_level_ones() -> None:
    wall = np.ascontiguousarray(lay_wall((224, 192), seed=6).swapaxes(0, 1))
    made = texrs.design(wall, 288, seed=2)
    assert made.report["courses"][0]["axis"] == 1
    unbroken, _ = measure_joints(made.image.swapaxes(0, 1))
    assert unbroken > measure_joints(wall.swapaxes(0, 1))[0] - 0.03


def test_the_map_of_a_turned_wall_leads_back_to_it() -> None:
    wall = lay_wall((224, 224), (16, 36), turn=5.0, seed=7)
    made = texrs.design(wall, 256, seed=3, screening=None)
    np.testing.assert_array_equal(made.source_map.render(wall), made.image)
    frames = made.source_map.jacobians()
    # Level lines of the result are slanted in the photograph.
    climbs = np.degrees(np.arctan2(frames[..., 0, 1], frames[..., 1, 1] * np.sign(frames[..., 1, 1])))
    assert np.abs(np.abs(climbs) - 5).max() < 1.5


def test_sheets_of_a_texture_differ() -> None:
    wall = lay_wall(seed=8)
    one, two = (texrs.design(wall, 256, seed=seed).image for seed in (1, 2))
    assert (one != two).mean() > 0.5
    # Stones of other courses follow below each other.
    assert texrs.design(wall, 256, seed=1, copies=1).image.shape == one.shape


def test_elements_of_a_wall_move_when_that_is_asked() -> None:
    moved = texrs.design(lay_wall(seed=9), 224, way="move")
    assert moved.report["courses"] == [None]


def test_walls_are_mixed_with_other_textures() -> None:
    pebbles = texrs.samples.pebbles((192, 192)).image
    made = texrs.design([lay_wall(seed=1), pebbles], 256, seed=1)
    assert made.report["courses"][0] is not None
    assert made.report["courses"][1] is None
    assert abs(made.report["pixel_counts"][0] / 256**2 - 0.5) < 0.03

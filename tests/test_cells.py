"""Cells of connected textures: found in textures with known cells, and not in textures without cells."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from texrs import samples
from texrs.errors import InvalidInput
from texrs.exemplar.cells import Cells, fill_gaps, find_cells
from texrs.exemplar.contours import POINTS, measure_moments, measure_profiles, resample, trace
from texrs.exemplar.merging import join_least_parted, join_parts, measure_usual_area

Picture = NDArray[np.uint8]


def draw_voronoi(shape: tuple[int, int], apart: float, *, light: bool, seed: int = 0) -> tuple[Picture, NDArray[Any]]:
    """Return stones between joints, each with its own shade and grain, and the cell of each pixel."""
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(*(np.arange(-apart, n + apart, apart) for n in shape), indexing="ij"), -1).reshape(
        -1, 2
    )
    points = grid + rng.uniform(-0.3, 0.3, grid.shape) * apart
    pixels = np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), -1)
    far, owner = cKDTree(points).query(pixels, k=2)
    joint = far[..., 1] - far[..., 0] < 0.16 * apart
    shade = rng.uniform(90, 160, len(points))[owner[..., 0]] + rng.normal(0, 6, shape)
    return np.where(joint, 235 if light else 15, shade).clip(0, 255).astype(np.uint8), owner[..., 0]


def match(cells: Cells, truth: NDArray[Any]) -> tuple[float, float]:
    """Return the share of true cells that one found cell covers by 80 % both ways, and the same for found cells."""
    border = np.unique(np.concatenate([truth[0], truth[-1], truth[:, 0], truth[:, -1]]))
    names, dense = np.unique(truth, return_inverse=True)
    both = np.zeros((len(names), cells.count + 1))
    np.add.at(both, (dense.ravel(), cells.labels.ravel()), 1)
    overlap = both / (both.sum(axis=1, keepdims=True) + both.sum(axis=0) - both)
    whole = ~np.isin(names, border)
    return float((overlap[whole].max(axis=1) > 0.7).mean()), float(
        (overlap[:, 1:][:, cells.whole].max(axis=0) > 0.7).mean()
    )


@pytest.mark.parametrize("light", [True, False])
@pytest.mark.parametrize("apart", [18.0, 40.0])
def test_cells_are_found_at_any_size_and_polarity(light: bool, apart: float) -> None:
    image, truth = draw_voronoi((200, 240), apart, light=light)
    cells = find_cells(image)
    recall, precision = match(cells, truth)
    assert recall >= 0.9
    assert precision >= 0.9
    assert cells.confidence > 0.8
    assert cells.polarity == (1 if light else -1)
    assert abs(cells.size / apart - 1) < 0.12


def test_what_is_told_of_size_and_joints_helps() -> None:
    wall = samples.bricks((192, 192))
    assert wall.labels is not None
    assert wall.mask is not None
    cells = find_cells(wall.image, size=30, joints=~wall.mask)
    assert cells.confidence > 0.8
    centres = np.asarray(wall.centres)
    inside = ((centres > 24) & (centres < 168)).all(axis=1)
    assert (cKDTree(cells.centre).query(centres[inside])[0] < 6).mean() >= 0.9


@pytest.mark.parametrize("name", ["dots", "leaves_and_flowers"])
def test_separate_elements_are_no_cells(name: str) -> None:
    assert find_cells(samples.load(name, size=(192, 192)).image, size=30).confidence < 0.5


@pytest.mark.parametrize("name", ["clouds", "noise", "plain"])
def test_what_has_no_cells_is_told(name: str) -> None:
    noise = np.random.default_rng(0).random((96, 96)).astype(np.float32)
    image = {"clouds": np.cumsum(noise - 0.5, axis=0), "noise": noise, "plain": noise * 0}[name]
    assert find_cells(image).confidence < 0.5


def test_measures_belong_to_the_cells() -> None:
    image, _ = draw_voronoi((160, 160), 30.0, light=True)
    cells = find_cells(image)
    count = cells.count
    assert cells.labels.dtype == np.int32
    assert set(np.unique(cells.labels)) == set(range(1, count + 1))
    assert cells.outlines.shape == (count, POINTS, 2)
    assert cells.centre.shape == (count, 2)
    assert all(len(x) == count for x in (cells.area, cells.angle, cells.whole, cells.certain))
    pixels = np.bincount(cells.labels.ravel())[1:]
    assert np.abs(cells.area[cells.whole] / pixels[cells.whole] - 1).max() < 0.1
    assert not cells.whole[np.unique(cells.labels[0]) - 1].any()
    assert 3 < cells.joint_width < 10


def test_masks_of_joints_may_be_nearly_empty_or_full() -> None:
    image, _ = draw_voronoi((96, 96), 30.0, light=True)
    one = np.zeros(image.shape, bool)
    one[4, 4] = True
    for joints in (one, ~one):
        assert find_cells(image, size=28, joints=joints).confidence > 0.5


def test_work_can_be_watched() -> None:
    shares: list[float] = []
    find_cells(np.zeros((40, 40)), size=12, progress=lambda stage, share: shares.append(share))
    assert shares == sorted(shares)
    assert len(shares) == 6


def test_any_dtype_gives_the_same_cells() -> None:
    image, _ = draw_voronoi((120, 120), 30.0, light=False)
    plain = find_cells(image, size=28)
    for other in (image.astype(np.uint16) * 257, (image / 255).astype(np.float32), np.repeat(image[..., None], 3, 2)):
        assert (find_cells(other, size=28).labels == plain.labels).all()


def test_wrong_arguments_are_told() -> None:
    image = np.zeros((40, 40), np.uint8)
    for wrong in ({"size": 1}, {"size": "big"}, {"joints": image}, {"joints": np.zeros((3, 3), bool)}):
        with pytest.raises(InvalidInput):
            find_cells(image, **wrong)  # type: ignore[arg-type]
    with pytest.raises(InvalidInput):
        find_cells(np.zeros((8, 40)))


# --- outlines --------------------------------------------------------------------------------------------------------


def test_outlines_of_an_ellipse() -> None:
    y, x = np.mgrid[:80, :100]
    turn = np.radians(30)
    along, across = (x - 50) * np.cos(turn) + (y - 40) * np.sin(turn), (y - 40) * np.cos(turn) - (x - 50) * np.sin(turn)
    inside = ((along / 30) ** 2 + (across / 15) ** 2 <= 1).astype(np.int32)
    outline = trace(inside, np.array([1]))
    moments = measure_moments(outline)
    assert abs(moments.area[0] / (np.pi * 30 * 15) - 1) < 0.02
    assert np.abs(moments.centre[0] - (40, 50)).max() < 0.2
    assert abs(moments.angle[0] - 30) < 1
    assert abs(moments.aspect[0] - 2) < 0.06
    profile = measure_profiles(outline, moments.centre, 72)[0]
    assert abs(profile[6] - 30) < 1  # 30 degrees
    assert abs(profile[24] - 15) < 1  # 120 degrees


def test_resampled_outlines_are_even() -> None:
    square = np.array([[0.0, 0], [0, 8], [8, 8], [8, 0]])
    found = resample(square, 32)
    assert np.allclose(np.hypot(*np.diff(found, axis=0).T), 1)


def test_a_label_of_one_pixel_has_an_outline() -> None:
    labels = np.zeros((5, 5), np.int32)
    labels[2, 2] = 1
    assert np.abs(trace(labels, np.array([1]))[0] - 2).max() < 2


# --- parts joined ----------------------------------------------------------------------------------------------------


def test_parts_without_a_joint_are_one() -> None:
    parts = np.repeat(np.repeat(np.arange(1, 5, dtype=np.int32).reshape(2, 2), 20, 0), 20, 1)
    relief = np.zeros((40, 40), np.float32)
    relief[19:21] = 1
    joined = join_parts(parts, relief)
    assert joined.max() == 2
    assert joined[0, 0] == joined[0, -1] != joined[-1, 0]


def test_fragments_go_to_the_neighbour_with_the_least_joint() -> None:
    parts = np.ones((30, 40), np.int32)
    parts[:, 20:] = 2
    parts[10:14, 20:24] = 3
    relief = np.zeros((30, 40), np.float32)
    relief[:, 19:21] = 1
    relief[9:15, 20:25] = 0.8
    assert join_parts(parts, relief, least=40)[12, 22] == join_parts(parts, relief, least=40)[0, -1]


def test_background_is_joined_with_none() -> None:
    parts = np.zeros((10, 30), np.int32)
    parts[:, 5:12], parts[:, 12:20], parts[:, 20:] = 3, 1, 4
    parts[:, 18:20] = 0
    joined: list[tuple[int, int, int]] = []
    into = join_least_parted(
        parts,
        np.zeros(parts.shape, np.float32),
        lambda one, other, total, length: total / length,
        lambda one, other, length: joined.append((one, other, length)),
        below=0.5,
    )
    assert into.tolist() == [0, 1, 2, 1, 4]
    assert joined == [(1, 3, 10)]


def test_crumbs_hardly_count_in_the_usual_area() -> None:
    assert measure_usual_area(np.array([100.0, 110, 120, *[1] * 50])) == 110


def test_missed_cells_are_filled_in() -> None:
    labels = np.arange(1, 26, dtype=np.int32).reshape(5, 5).repeat(20, axis=0).repeat(20, axis=1)
    rows, columns = np.indices(labels.shape) % 20
    labels[(np.minimum(rows, columns) < 2) | (np.maximum(rows, columns) > 17)] = 0
    assert (fill_gaps(labels) == labels).all()
    missed = np.where(labels == 13, 0, np.where(labels > 13, labels - 1, labels)).astype(np.int32)
    filled = fill_gaps(missed)
    assert filled.max() == 25
    assert (filled[missed > 0] == missed[missed > 0]).all()
    both = ((filled == 25) & (labels == 13)).sum() / ((filled == 25) | (labels == 13)).sum()
    assert both > 0.9

"""Bounds of large splices, and of connected figures on very different layouts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial import Delaunay, KDTree

import texrs
from reference.look_up import view
from texrs import point_sets, samples
from texrs.elements import ElementAnalysis, Layout
from texrs.papers.splice import energy
from texrs.papers.splice.adjustment import STRAIN, limit_strain
from texrs.papers.splice.matching import Match, match_layouts
from texrs.point_sets import _matching


def lattice(rows: int, columns: int, *, shifted: bool, noise: float = 0.0) -> np.ndarray[Any, np.dtype[np.float64]]:
    points = np.argwhere(np.ones((rows, columns), bool)) * 20.0
    points[:, 1] += 10.0 * (points[:, 0] / 20 % 2) * shifted
    return np.asarray(points + np.random.default_rng(0).normal(0, noise, points.shape) + 15.0)


@pytest.mark.parametrize("seed", range(3))
def test_many_elements_are_matched_as_few_are(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(seed)
    source, target = random.random((500, 2)) * 400, random.random((400, 2)) * 400
    dense = point_sets.match_points(source, target)
    monkeypatch.setattr(_matching, "DENSE", 0)
    near = point_sets.match_points(source, target)
    assert (near[0] == dense[0]).all()
    assert near[1] == pytest.approx(dense[1])


def test_crowded_targets_find_sources_farther_away(monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(0)
    source, target = random.random((600, 2)) * 400, random.random((400, 2)) * 40
    dense = point_sets.match_points(source, target)
    monkeypatch.setattr(_matching, "DENSE", 0)
    assert point_sets.match_points(source, target)[1] == pytest.approx(dense[1])


@pytest.mark.parametrize("upright", [True, False])
def test_large_walls_are_solved_for_at_fewer_pixels(upright: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    wall = ElementAnalysis.of_sample(samples.load("bricks", size=(192, 192)))
    pins = np.rint(wall.points).astype(np.intp)
    shift = np.random.default_rng(1).uniform(-3, 3, pins.shape)
    full = energy.minimise_energy(~wall.mask, pins, shift, upright=upright)
    monkeypatch.setattr(energy, "MOST", 192 * 192 // 2)
    assert energy.choose_coarseness((192, 192)) == 2
    assert energy.choose_coarseness((192, 191)) == 2
    assert energy.choose_coarseness((96, 96)) == 1
    half = energy.minimise_energy(~wall.mask, pins, shift, upright=upright)
    assert half.shape == full.shape
    assert np.abs(half - full).mean() < 0.5
    assert np.abs(half[pins[:, 0], pins[:, 1]] - shift).max() < 1.0


def test_neighbours_in_walls_go_about_as_far() -> None:
    wall = ElementAnalysis.of_sample(samples.load("bricks", size=(192, 192)))
    stones = ElementAnalysis.of_sample(samples.load("pebbles", size=(192, 192)))
    torn = match_layouts(wall, stones, (192, 192), align=True)
    found = limit_strain(wall, torn)
    start = found.starts
    corners = Delaunay(start).simplices

    def strain(match: Match) -> float:
        apart = np.abs(match.shift[corners] - match.shift[np.roll(corners, 1, axis=1)])
        away = np.abs(start[corners] - start[np.roll(corners, 1, axis=1)])
        return float((apart / np.maximum(away, np.array(wall.box))).max())

    assert strain(torn) > 0.5
    assert strain(found) < STRAIN[Layout.JOINTED] + 0.1
    still = limit_strain(wall, match_layouts(wall, wall, (192, 192), align=True))
    assert np.ptp(still.shift, axis=0).max() < 2.0


@pytest.mark.parametrize("shifted", [False, True])
def test_layouts_go_on_as_they_are(shifted: bool) -> None:
    """Beyond the border each point has the same neighbours as points inside."""
    points = lattice(7, 7, shifted=shifted, noise=0.5)
    shape = (160, 160)
    found = point_sets.PointLayout.of(points, shape, (False, False), beyond=True)
    far = found.within(np.full(2, -60.0), np.full(2, 220.0))[0]
    inner = far[((far > -20) & (far < 180)).all(axis=1)]
    nearest = point_sets.nearest_distances(inner, 6, far)[:, 1:5]
    assert np.median(np.abs(nearest - np.median(nearest, axis=0))) < 2.0
    assert np.percentile(nearest[:, 0], 5) > 14.0


def test_outermost_points_do_not_make_a_layout_wider() -> None:
    assert point_sets.spacing(lattice(3, 3, shifted=False), count=4) == pytest.approx(20.0)
    assert point_sets.spacing(lattice(9, 9, shifted=False), count=4) == pytest.approx(20.0)


def test_pictures_of_any_size_take_their_time_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """Splices of large images use coarser systems and approximate matches throughout."""
    monkeypatch.setattr(energy, "MOST", 1 << 13)
    monkeypatch.setattr(_matching, "DENSE", 0)
    wall = ElementAnalysis.of_sample(samples.load("bricks", size=(128, 128)))
    stones = ElementAnalysis.of_sample(samples.load("pebbles", size=(128, 128)))
    result = texrs.splice(wall, stones, use_cells=False, seed=1)
    assert max(result.report["system"]) < 128
    np.testing.assert_array_equal(view(result.source_map, wall.image), result.image)


@pytest.mark.parametrize("name", ["pebbles", "dots"])
def test_separate_elements_go_on_unmirrored_on_their_own_layout(name: str) -> None:
    mine = ElementAnalysis.of_sample(samples.load(name, size=(160, 160)))
    made = texrs.self_splice(mine, size=480, seed=1)
    found = np.array([match["found"] for match in made.report["matches"]])
    which = np.array([match["element"] for match in made.report["matches"]])
    inside = ((found >= 0) & (found < 480)).all(axis=1)
    found, which = found[inside], which[inside]
    assert len(found) == pytest.approx(9 * len(mine.points), rel=0.25)
    # An element is hardly ever its own mirror image at a side of the image.
    for axis in range(2):
        seen = found.copy()
        seen[:, axis] = 2 * 319.5 - seen[:, axis]
        away, near = KDTree(found).query(seen)
        close = away < 3
        assert (which[near[close]] == which[close]).sum() < 0.2 * len(found)
    # An element is hardly ever its own neighbour either.
    near = KDTree(found).query(found, k=4)[1][:, 1:]
    assert (which[near] == which[:, np.newaxis]).mean() < 0.1

"""Nets spliced by their graph: positions of knots, their contents, and user errors."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial import Delaunay

import texrs
from texrs import samples
from texrs.elements import ElementAnalysis, Layout
from texrs.errors import InvalidInput
from texrs.papers.splice.nets.graph import describe_places, join_knots
from texrs.papers.splice.nets.targets import Targets, interpolate_layouts, take_points
from texrs.point_sets import spacing

SIZE = (144, 144)
UNIT = 30.0


def draw_net(seed: int = 0, *, shifted: bool = False, jitter: float = 2.0) -> ElementAnalysis:
    """Draw rings, each joined to its neighbours by slack lines, over a background of noise."""
    rng = np.random.default_rng(seed)
    lattice = np.argwhere(np.ones((5, 5))) * UNIT + 12.0
    if shifted:
        lattice[:, 1] += np.where(np.round((lattice[:, 0] - 12) / UNIT) % 2 == 1, UNIT / 2, 0)
    points = lattice + rng.normal(0, jitter, lattice.shape)
    points = points[((points >= 0) & (points <= np.array(SIZE) - 1)).all(axis=1)]
    pixels = np.stack(np.indices(SIZE), axis=-1).astype(float)
    ring = np.abs(np.hypot(*(pixels[None] - points[:, None, None]).transpose(3, 0, 1, 2)) - 6) < 2
    mask = ring.any(axis=0)
    for first, second in join_knots(points):
        share = np.linspace(0, 1, 120)[:, None]
        at = np.rint(points[first] * (1 - share) + points[second] * share).astype(int)
        at = at[np.hypot(*(at - points[first]).T) > 6]
        at = at[np.hypot(*(at - points[second]).T) > 6]
        at = at[(at < np.array(SIZE)).all(axis=1)]
        mask[at[:, 0], at[:, 1]] = mask[np.maximum(at[:, 0] - 1, 0), at[:, 1]] = True
    shade = np.where(mask, 210, 50) + rng.normal(0, 6, SIZE)
    image = np.repeat(np.clip(shade, 0, 255).astype(np.uint8)[..., None], 3, axis=2)
    return ElementAnalysis(image, points, mask, (17, 17), Layout.CONNECTED, np.ones(len(points)))


NET, LAYOUT = draw_net(), draw_net(3, shifted=True, jitter=3.0)
DOTS = ElementAnalysis.of_sample(samples.dots((144, 144)))


@pytest.fixture(scope="module")
def spliced() -> texrs.Synthesis:
    return texrs.splice(NET, LAYOUT, SIZE, seed=1, use_nets=True)


def test_knots_are_where_they_are_wanted(spliced: texrs.Synthesis) -> None:
    report = spliced.report
    assert report["method"] == "nets"
    inside = [m for m in report["matches"] if all(0 <= v <= 143 for v in m["target"])]
    assert len(inside) >= 15
    found = [m for m in inside if m["found"] is not None]
    assert len(found) >= 0.9 * len(inside)
    away = [np.hypot(*np.subtract(m["found"], m["target"])) for m in found]
    assert max(away) <= 0.1 * UNIT
    assert report["displacement_reached"] >= 0.8
    json.dumps(report)


def test_a_ring_is_seen_around_every_found_knot(spliced: texrs.Synthesis) -> None:
    light = spliced.image.mean(axis=-1)
    angles = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    around = 6 * np.stack([np.sin(angles), np.cos(angles)], axis=-1)
    seen = []
    for match in spliced.report["matches"]:
        if match["found"] is not None and all(9 <= v <= 134 for v in match["found"]):
            rows, columns = np.rint(np.array(match["found"]) + around).astype(int).T
            seen.append((light[rows, columns] > 130).mean())
    assert len(seen) >= 9
    assert np.mean(seen) > 0.9


def test_bending_misses_where_nets_do_not(spliced: texrs.Synthesis) -> None:
    bent = texrs.splice(NET, LAYOUT, SIZE, seed=1, use_nets=False, use_cells=False)
    assert bent.report["method"] == "default"
    assert spliced.report["displacement_reached"] > bent.report["displacement_reached"]


def test_the_map_is_the_picture_and_nothing_is_mirrored(spliced: texrs.Synthesis) -> None:
    at = spliced.source_map.coordinates.astype(int)
    assert (NET.image[at[..., 0], at[..., 1]] == spliced.image).all()
    steps = np.diff(at, axis=1)
    # A mirrored region would run backwards.
    assert (steps == [0, 1]).all(axis=-1).mean() > 0.8
    assert (steps == [0, -1]).all(axis=-1).mean() < 0.01
    assert int(spliced.source_map.label.max()) == spliced.report["targets"]


def test_labels_are_targets(spliced: texrs.Synthesis) -> None:
    matches = spliced.report["matches"]
    assert sum(match["found"] is not None for match in matches) > len(matches) / 2
    for number, match in enumerate(matches, 1):
        if match["found"] is not None:
            row, column = np.rint(match["found"]).astype(int)
            assert spliced.source_map.label[row, column] == number


def test_the_same_seed_makes_the_same_picture(spliced: texrs.Synthesis) -> None:
    assert (texrs.splice(NET, LAYOUT, SIZE, seed=1, use_nets=True).image == spliced.image).all()
    assert (texrs.splice(NET, LAYOUT, SIZE, seed=2, use_nets=True).image != spliced.image).any()


def test_stages_are_drawn(spliced: texrs.Synthesis) -> None:
    assert list(spliced.stages) == ["source net", "target layout", "target net", "cuts", "before_blending"]
    for picture in spliced.stages.values():
        assert picture.ndim == 3
        assert picture.dtype == np.uint8


def test_nets_are_chosen_where_no_cells_are_found() -> None:
    doubted = replace(NET, report={"confidence": {"layout": 0.4}})
    sure = replace(NET, report={"confidence": {"layout": 0.9}})
    noise = np.random.default_rng(0).integers(0, 255, SIZE).astype(np.uint8)
    methods = [texrs.splice(replace(e, image=noise), DOTS, 64).report["method"] for e in (sure, doubted)]
    assert methods == ["nets", "default"]
    few = replace(NET, image=noise, points=NET.points[:5], scores=NET.scores[:5])
    assert texrs.splice(few, DOTS, 64).report["method"] == "default"
    assert texrs.splice(DOTS, NET, 64).report["method"] == "default"


@pytest.mark.parametrize("shape", [(48, 200), (16, 16)])
def test_any_size_is_filled(shape: tuple[int, int]) -> None:
    made = texrs.splice(NET, DOTS, shape, use_nets=True)
    assert made.image.shape == (*shape, 3)


def test_half_of_the_way_lies_between() -> None:
    report = texrs.splice(NET, LAYOUT, SIZE, use_nets=True, strength=0.0).report
    own = np.array([m["target"] for m in report["matches"] if all(0 <= v <= 143 for v in m["target"])])
    apart = np.hypot(*(own[:, None] - NET.points[None]).transpose(2, 0, 1)).min(axis=1)
    assert np.median(apart) < 1e-3
    mine = Targets(np.array([[0.0, 0], [0, 30], [30, 0]]), 1.0, "")
    theirs = Targets(np.array([[2.0, 0], [0, 34], [30, 8], [90, 90]]), 2.0, "lattice")
    for strength, count in ((0.25, 3), (0.5, 4)):
        found = interpolate_layouts(mine, theirs, strength)
        assert len(found.points) == count
        np.testing.assert_allclose(found.points[:3], (1 - strength) * mine.points + strength * theirs.points[:3])
    assert interpolate_layouts(mine, theirs, 0.0) is mine


def test_regular_layouts_go_on_on_their_lattice() -> None:
    regular = draw_net(jitter=0.3)
    found = take_points(NET, regular, None, (300, 300), UNIT, seed=0)
    assert found.continued == "lattice"
    assert spacing(found.points) == pytest.approx(UNIT, rel=0.15)
    assert len(found.points) >= 100


def test_the_graph_joins_neighbours_whose_circle_is_empty() -> None:
    square = np.argwhere(np.ones((3, 3))) * 10.0
    lengths = np.hypot(*(square[join_knots(square)[:, 0]] - square[join_knots(square)[:, 1]]).T)
    assert {tuple(p) for p in join_knots(square).tolist()} >= {(0, 1), (0, 3), (4, 5)}
    assert lengths.min() == 10
    scattered = np.random.default_rng(1).random((60, 2)) * 100
    corners = Delaunay(scattered).simplices
    delaunay = {tuple(sorted(p)) for c in corners.tolist() for p in ((c[0], c[1]), (c[1], c[2]), (c[2], c[0]))}
    pairs = [tuple(p) for p in join_knots(scattered).tolist()]
    assert set(pairs) <= delaunay
    for first, second in delaunay:
        middle = (scattered[first] + scattered[second]) / 2
        radius = np.hypot(*(scattered[first] - middle))
        others = np.delete(scattered, [first, second], axis=0)
        empty = np.hypot(*(others - middle).T).min() >= radius
        assert ((first, second) in pairs) == empty
    line = np.array([[5.0, 0], [5, 10], [5, 20]])
    assert join_knots(line).tolist() == [[0, 1], [1, 2]]


def test_places_say_how_far_knots_and_lines_are() -> None:
    points = np.array([[10.0, 10], [10, 30], [30, 10]])
    said = describe_places(points, (40, 40), 20.0)
    np.testing.assert_allclose(said[10, 10, :2], 0)
    np.testing.assert_allclose(said[10, 20], [1, 0, 0.5, 0], atol=1e-6)
    np.testing.assert_allclose(said[20, 10], [1, 0, -0.5, 0], atol=1e-6)


@pytest.mark.parametrize(
    ("entry", "options", "words"),
    [
        (NET, {"use_nets": True, "use_cells": True}, "cannot be combined with use_cells"),
        (NET, {"use_nets": True, "method": "paper"}, "use_nets: .*deforms"),
        (NET, {"use_nets": True, "method": "preview"}, "use_nets: .*deforms"),
        (DOTS, {"use_nets": True}, "separate elements"),
        (replace(NET, points=NET.points[:4]), {"use_nets": True}, "six knots"),
        (replace(NET, points=NET.points[:6] / 20), {"use_nets": True}, "8 pixels"),
    ],
)
def test_wrong_options_are_told(entry: ElementAnalysis, options: Any, words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        texrs.splice(entry, LAYOUT, 64, **options)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_any_picture_keeps_its_type(dtype: Any) -> None:
    grey = NET.image[..., 0].astype(dtype)
    made = texrs.splice(replace(NET, image=grey if dtype != np.float32 else grey / 255), LAYOUT, 64, use_nets=True)
    assert made.image.dtype == dtype


def test_work_can_be_stopped() -> None:
    def stop(name: str, share: float) -> None:
        if name == "nets" and share > 0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        texrs.splice(NET, LAYOUT, 64, use_nets=True, progress=stop)

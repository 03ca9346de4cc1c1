"""Drawn layouts: their contents, and elements in them."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import minimum_filter
from scipy.spatial import cKDTree

import texrs
from texrs import io, layouts, samples
from texrs.cli import main
from texrs.elements import ElementAnalysis, Layout, correct, load
from texrs.errors import FileError, InvalidInput
from texrs.exemplar.shapes import mark_outlines
from texrs.point_sets import PointLayout
from texrs.sowing import continue_points

DOTS = ElementAnalysis.of_sample(samples.dots((128, 128)))
WALL = ElementAnalysis.of_sample(samples.bricks((160, 160)))
OBLIQUE = ((0.0, 24.0), (18.0, 8.0))
RING = 64 + 45 * np.stack([np.sin(np.arange(8) * np.pi / 4), np.cos(np.arange(8) * np.pi / 4)], axis=1)


def list_matches(result: texrs.Synthesis, name: str) -> Any:
    return np.array([m[name] for m in result.report["matches"]], np.float64)


def test_points_are_in_the_pixels_of_the_result() -> None:
    made = texrs.splice(DOTS, layouts.points(RING, 128), 128, layout_scale=1, seed=1)
    assert len(made.report["matches"]) == len(RING)
    assert cKDTree(list_matches(made, "found")).query(RING)[0].max() < 1
    twice = texrs.splice(DOTS, layouts.points(RING, 128), 256, layout_scale=2, seed=1)
    assert cKDTree(list_matches(twice, "target")).query((RING - 63.5) * 2 + 127.5)[0].max() < 1


def test_scale_makes_any_layout_sparser() -> None:
    counts = [
        len(texrs.splice(DOTS, layouts.lattice(128, *OBLIQUE), 192, layout_scale=s).report["matches"]) for s in (1, 2)
    ]
    assert counts[0] > 3 * counts[1]


@pytest.mark.parametrize("entry", [DOTS, WALL], ids=["separate", "cells"])
def test_an_oblique_lattice_goes_on_as_one(entry: ElementAnalysis) -> None:
    made = texrs.splice(entry, layouts.lattice(96, *OBLIQUE), 256, layout_scale=1.4, align=False, seed=1)
    targets = list_matches(made, "target")
    inside = targets[((targets > 20) & (targets < 235)).all(axis=1)]
    index = (inside - inside[0]) @ np.linalg.inv(np.array(OBLIQUE) * 1.4)
    # Allow deviations and missing points: cells end at the image border, and separate elements keep a distance.
    assert np.median(np.abs(index - np.rint(index))) < 0.05
    assert len(inside) >= 0.8 * 215**2 / (1.4**2 * 24 * 18)


def test_a_layout_on_a_lattice_has_its_points_in_itself() -> None:
    found = layouts.lattice(100, (0, 20), (17, 10), origin=(3, 5))
    assert [3.0, 5.0] in found.points.tolist()
    assert found.layout == Layout.DISJOINT
    assert (found.points >= 0).all()
    assert (found.points <= 99).all()
    assert len(found.points) == pytest.approx(100 * 100 / 340, rel=0.2)


def test_points_go_on_as_they_lie_and_are_not_mirrored() -> None:
    noise = np.random.default_rng(4)
    grid = 20.0 * (np.argwhere(np.ones((6, 6))) + 0.4)
    places = grid + noise.uniform(-7, 7, grid.shape)
    layout = PointLayout.of(places, (128, 128), (False, False), beyond=True)
    low, high = np.full(2, -200.0), np.full(2, 327.0)
    found, how = continue_points(layout, (128, 128), low, high)
    assert how == "quilted"
    # The layout's own points stay. The other points have the same density, without mirrored points.
    assert cKDTree(found).query(places)[0].max() == 0
    assert len(found) == pytest.approx(len(places) * (527 / 128) ** 2, rel=0.2)
    apart = cKDTree(found).query(found, k=2)[0][:, 1]
    assert apart.min() > 0.7 * cKDTree(places).query(places, k=2)[0][:, 1].min()
    mirrored, _, _ = layout.within(low, high)
    outside = mirrored[((mirrored < 0) | (mirrored > 127)).any(axis=1)]
    assert (cKDTree(found).query(outside)[0] < 1).mean() < 0.2
    _, how = continue_points(layout, (128, 128), np.full(2, -10.0), np.full(2, 137.0))
    assert how == "reflected"
    again = continue_points(layout, (128, 128), low, high, around=(low - 50, high + 50))[0]
    assert ((again >= low) & (again <= high)).all()


def test_courses_have_the_heights_that_were_asked_for() -> None:
    wall = layouts.courses(160, [20, 40], 50, shift=0.25, vary=0.4, seed=3)
    sides = np.bincount(wall.labels.ravel())[1:]
    assert (sides > 0).all()
    tops = np.flatnonzero(np.diff(np.concatenate([[0], wall.mask.any(axis=1).astype(int)])) == 1)
    assert np.diff(tops).tolist() == [20, 40, 20, 40, 20]
    again = layouts.courses(160, [20, 40], 50, shift=0.25, vary=0.4, seed=3)
    assert (again.labels == wall.labels).all()
    assert (layouts.courses(160, [20, 40], 50, vary=0.4, seed=4).labels != wall.labels).any()
    stack = layouts.courses(160, 20, 40, shift=0)
    assert (stack.labels[10] > 0).tolist() == (stack.labels[30] > 0).tolist()
    bond = layouts.courses(160, 20, 40, shift=0.5)
    assert (bond.labels[10] > 0).tolist() != (bond.labels[30] > 0).tolist()


def test_bricks_lie_in_the_courses_that_were_drawn() -> None:
    drawn = layouts.courses(160, [32, 48], 64, shift=0.3, vary=0.3, seed=1)
    made = texrs.splice(WALL, drawn, 160, layout_scale=1, seed=1)
    assert made.report["method"] == "cells"
    assert made.report["present"] >= 0.95
    whole = [i for i in drawn.instances if i.mask.size and min(i.origin) > 0]
    inside = [i.centre for i in whole if all(o + n < 160 for o, n in zip(i.origin, i.mask.shape, strict=True))]
    assert inside
    assert cKDTree(list_matches(made, "target")).query(inside)[0].max() < 2


def test_cells_are_taken_as_they_are() -> None:
    panes = np.add.outer(10 * (np.arange(96) // 24), np.arange(96) // 32) + 1
    layout = layouts.cells(panes)
    assert len(layout.points) == 12
    assert (np.bincount(layout.labels.ravel()) == 24 * 32)[1:].all()
    made = texrs.splice(WALL, layout, 96, layout_scale=1, refine=False)
    shown = made.source_map.label
    assert len(np.unique(shown[4:20, 4:28])) == 1
    assert shown[12, 12] != shown[12, 48]


def test_cells_that_the_border_cuts_take_the_joints_beside_them() -> None:
    at = np.arange(100) - 30
    inside = np.logical_and.outer(at % 40 >= 4, at % 40 >= 4)
    labels = np.where(inside, 1 + np.add.outer(3 * ((at + 40) // 40), (at + 40) // 40), 0)
    image = np.where(inside, 200, 20).astype(np.uint8)
    entry = ElementAnalysis.of_labels(image, labels, layout="jointed")
    made = texrs.splice(entry, layouts.courses(200, 40, 40, joint=4), 200, layout_scale=1, seed=2)
    assert {m["element"] for m in made.report["matches"]} > {4}
    dark = minimum_filter(made.image, 7) < 100
    # Allow a few outlines without a dark joint, because two sides without joints may meet.
    assert dark[mark_outlines(made.source_map.label.astype(np.int32))].mean() > 0.92


def test_known_elements_are_elements_of_all() -> None:
    stones = samples.pebbles((128, 128))
    assert stones.labels is not None
    entry = ElementAnalysis.of_labels(stones.image, stones.labels)
    assert (entry.labels > 0).tolist() == (stones.labels > 0).tolist()
    assert len(entry.instances) == len(np.unique(stones.labels)) - 1
    moved = texrs.self_splice(entry, {"op": "remove", "element": 5})
    assert moved.report["edit"] == [{"op": "remove", "element": 5}]
    assert texrs.design(entry, (160, 160), seed=1).image.shape == (160, 160, 3)


def test_pieces_of_a_mask_are_elements() -> None:
    mask = np.zeros((64, 64), bool)
    for row, column in ((0, 30), (20, 10), (40, 50)):
        mask[row : row + 8, column : column + 8] = True
    mask[-4:, 30:38] = True
    image = np.where(mask, 200, 50).astype(np.uint8)
    assert len(ElementAnalysis.of_labels(image, mask).points) == 4
    around = ElementAnalysis.of_labels(image, mask, wrap=(True, False))
    assert len(around.points) == 3
    assert [1.5, 33.5] in around.points.tolist()


def test_known_elements_are_saved(tmp_path: Path) -> None:
    entry = layouts.courses(96, 24, 32)
    entry.save(tmp_path / "courses.npz")
    again = load(tmp_path / "courses.npz")
    assert again.known is not None
    assert (again.labels == entry.labels).all()
    with np.load(tmp_path / "courses.npz") as file:
        parts = dict(file)
    parts["known"] = 2 * parts["known"]
    np.savez(tmp_path / "bad.npz", **parts)
    with pytest.raises(FileError, match="is damaged"):
        load(tmp_path / "bad.npz")


def test_corrections_change_known_elements() -> None:
    entry = layouts.lattice(96, (0, 24), (24, 0))
    known = ElementAnalysis.of_labels(entry.image, entry.labels)
    fewer = correct(known, [{"op": "drop", "elements": [0]}])
    assert fewer.known is not None
    assert fewer.known.max() == len(known.points) - 1
    assert len(fewer.instances) == len(known.points) - 1


def test_a_drawn_layout_serves_a_database_and_a_net(tmp_path: Path) -> None:
    net = texrs.splice(WALL, layouts.lattice(96, *OBLIQUE), 96, use_nets=True)
    assert net.report["method"] == "nets"
    assert net.report["continued"] == "lattice"
    assert texrs.splice(DOTS, layouts.courses(96, 24, 32), 96, method="preview").image.shape == (96, 96, 3)


def test_json_makes_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    said = {"layout": "courses", "size": [96, 96], "height": [16, 24], "length": 40}
    assert (layouts.from_dict(said).labels == layouts.courses((96, 96), [16, 24], 40).labels).all()
    io.write("panes.png", (np.add.outer(3 * (np.arange(96) // 32), np.arange(96) // 32) + 1).astype(np.uint8))
    (tmp_path / "panes.json").write_text(json.dumps({"layout": "cells", "labels": "panes.png"}))
    WALL.save("bricks.npz")
    for b in (json.dumps(said), "panes.json"):
        assert (
            main(["splice", "bricks.npz", b, "-o", "out.png", "--size", "96", "--layout-scale", "1", "-q", "--force"])
            == 0
        )
        assert io.read("out.png").shape == (96, 96, 3)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: layouts.points([[1, 2], [3, 4]], 64), "places: must be between 3"),
        (lambda: layouts.points([[1, 2], [3, 4], [5, 99]], 64), "places: must be inside a layout of size"),
        (lambda: layouts.points([[1, 2], [3, 4], [1, 2]], 64), "places: must be different"),
        (lambda: layouts.lattice(64, (0, 8), (0, 9)), "second: must not be parallel to first"),
        (lambda: layouts.lattice(64, (0, 0.1), (0.1, 0)), "first, second: must give at most"),
        (lambda: layouts.lattice(64, (0, 800), (800, 0)), "must be large enough for at least 3 points"),
        (lambda: layouts.cells(np.ones((64, 64), int)), "labels: must contain at least three elements"),
        (lambda: layouts.cells(np.full((64, 64), -1)), "labels: must be 0 or more"),
        (lambda: layouts.courses(64, 20, 20, joint=15), "joint: must be a number"),
        (lambda: layouts.from_dict({"layout": "courses", "size": 64, "height": 20}), "courses requires 'length'"),
        (
            lambda: layouts.from_dict({"layout": "courses", "size": 64, "tall": 20}),
            "arguments of courses must be among .* got 'tall'",
        ),
        (lambda: ElementAnalysis.of_labels(DOTS.image, np.ones((4, 4), int)), "labels: must be integers"),
        (
            lambda: ElementAnalysis.of_labels(DOTS.image, 1 + np.arange(128 * 128).reshape(128, 128)),
            "background .0. around separate elements",
        ),
        (
            lambda: texrs.splice(DOTS, replace(WALL, known=np.ones((160, 160), np.int32))),
            "layout.known: must be an array of labels of shape",
        ),
        (
            lambda: texrs.splice(DOTS, replace(WALL, known=np.full((160, 160), 2**31 - 1, np.int32))),
            "layout.known: must be an array of labels of shape",
        ),
        (
            lambda: texrs.splice(DOTS, WALL, layout_scale=1, method="paper"),
            "layout_scale: cannot be combined with method",
        ),
    ],
)
def test_what_is_no_layout_gets_a_sentence(make: Callable[[], object], words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        make()


def test_few_points_are_compared_one_by_one() -> None:
    from scipy.spatial import cKDTree

    from texrs.point_sets import nearest_distances

    random = np.random.default_rng(4)
    for few, many in ((1, 8), (12, 60), (40, 300)):
        points, among = random.random((few, 2)) * 50, random.random((many, 2)) * 50
        among[:few] = points
        found = nearest_distances(points, 7, among)
        assert (found == cKDTree(among).query(points, k=[*range(1, 8)])[0]).all()
    # If there are fewer points than requested, the missing distances are infinite.
    assert np.isinf(nearest_distances(points, 7, among[:3])[:, 3:]).all()

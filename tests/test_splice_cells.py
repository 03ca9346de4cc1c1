"""Connected textures spliced by cells: positions of cells, their contents, and user errors."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import maximum_filter
from scipy.spatial import cKDTree

import texrs
from test_cells import draw_voronoi
from texrs import samples
from texrs.elements import ElementAnalysis, Layout
from texrs.errors import InvalidInput
from texrs.exemplar.cells import find_cells
from texrs.exemplar.contours import resample
from texrs.exemplar.shapes import mark_outlines
from texrs.mosaic.outlines import interpolate, match_outlines, rematch_outlines
from texrs.mosaic.tessellation import take_cells
from texrs.papers.splice.cells import find_entry_cells

SIZE = (160, 160)


def stones(seed: int = 0, *, apart: float = 30.0, light: bool = True) -> ElementAnalysis:
    image, truth = draw_voronoi(SIZE, apart, light=light, seed=seed)
    mask = image < 200 if light else image > 40
    pixels = np.argwhere(np.ones(SIZE))
    points = np.stack([pixels[truth.ravel() == k].mean(axis=0) for k in np.unique(truth)])
    width = int(apart) | 1
    return ElementAnalysis(image, points, mask, (width, width), Layout.JOINTED, np.ones(len(points)))


STONES = stones()
WALL = ElementAnalysis.of_sample(samples.bricks((192, 192)))
NET = ElementAnalysis.of_sample(samples.net((192, 192)))
DOTS = ElementAnalysis.of_sample(samples.dots((160, 160)))


@pytest.fixture(scope="module")
def spliced() -> Any:
    made: dict[tuple[str, str], texrs.Synthesis] = {}
    entries = {"stones": STONES, "wall": WALL, "net": NET, "dots": DOTS}

    def get(a: str, b: str) -> texrs.Synthesis:
        if (a, b) not in made:
            made[a, b] = texrs.splice(entries[a], entries[b], (176, 176), seed=1)
        return made[a, b]

    return get


PAIRS = [("stones", "wall"), ("stones", "dots"), ("wall", "stones"), ("net", "stones")]


@pytest.mark.parametrize(("a", "b"), PAIRS)
def test_cells_are_where_they_are_wanted(a: str, b: str, spliced: Any) -> None:
    report = spliced(a, b).report
    assert report["method"] == "cells"
    assert report["present"] >= 0.95
    assert report["displacement_reached"] >= 0.85
    away = [np.hypot(*np.subtract(m["found"], m["target"])) for m in report["matches"] if m["found"]]
    assert np.median(away) <= 0.15 * report["cells"]["size"]


@pytest.mark.parametrize("side", [128, 320])
def test_what_is_known_of_a_sample_is_put_together_from_its_cells(side: int) -> None:
    wall = samples.bricks((side, side))
    entry = ElementAnalysis.of_sample(wall)
    assert len(entry.points) < entry.labels.max() == wall.labels.max()
    report = texrs.self_splice(entry, size=(side + 64, side + 80), seed=1).report
    assert (report["method"], report["present"]) == ("cells", 1)


def test_few_whole_cells_keep_their_size() -> None:
    entry = ElementAnalysis.of_sample(samples.bricks((128, 128)))
    wide = texrs.self_splice(entry, size=(192, 208), seed=1)
    there = wide.source_map.render(entry.mask, interpolation="nearest")
    assert there.mean() == pytest.approx(entry.mask.mean(), abs=0.05)
    # The number of elements fits the area, including those that the border cuts.
    share = len(np.unique(wide.source_map.label)) / entry.labels.max() / (192 * 208 / 128**2)
    assert share == pytest.approx(0.85, abs=0.2)


@pytest.mark.parametrize(("a", "b"), [("stones", "wall"), ("stones", "dots")])
def test_cells_are_found_again_in_the_picture(a: str, b: str, spliced: Any) -> None:
    result = spliced(a, b)
    unit = result.report["cells"]["size"]
    goals = np.array([m["target"] for m in result.report["matches"]])
    inside = ((goals > unit / 2) & (goals < 176 - unit / 2)).all(axis=1)
    found = find_cells(result.image, size=0.8 * unit)
    assert (cKDTree(found.centre).query(goals[inside])[0] <= 0.2 * unit).mean() >= 0.85


@pytest.mark.parametrize(("a", "b"), PAIRS)
def test_joints_are_unbroken_and_as_wide(a: str, b: str, spliced: Any) -> None:
    entry = {"stones": STONES, "wall": WALL, "net": NET}[a]
    cells, result = find_entry_cells(entry), spliced(a, b)
    assert cells is not None
    shown = result.source_map.render(cells.joints, interpolation="linear")
    seams = mark_outlines(result.source_map.label.astype(np.int32))
    assert (maximum_filter(shown, 5)[seams] < 0.5).mean() <= 0.06
    share = [
        (j > 0.5).sum() / mark_outlines(x).sum()
        for j, x in ((cells.joints, cells.labels), (shown, result.source_map.label))
    ]
    # Cuts are more jagged than outlines, and therefore longer.
    assert 0.7 <= share[1] / share[0] <= 1.33


def test_the_result_is_a_source_map(spliced: Any) -> None:
    result = spliced("stones", "wall")
    assert (result.source_map.render(STONES.image) == result.image).all()
    deep = STONES.image.astype(np.uint16) * 257
    assert texrs.splice(replace(STONES, image=deep), WALL, (176, 176), seed=1).image.dtype == np.uint16
    height = np.linspace(0, 1, STONES.image.size, dtype=np.float32).reshape(SIZE)
    assert result.source_map.render(height).shape == (176, 176)
    frames = result.source_map.jacobians()
    # The map is continuous inside its cells, and its frames are its slopes.
    slope = np.diff(result.source_map.coordinates, axis=1)
    same = np.diff(result.source_map.label.astype(int), axis=1) == 0
    off = np.abs(slope - frames[:, :-1, :, 1]).max(axis=-1)[same]
    assert np.median(off) < 0.2
    assert (np.linalg.det(frames) > 0).mean() > 0.98, "nothing is mirrored"


def test_labels_are_targets(spliced: Any) -> None:
    result = spliced("stones", "dots")
    assert result.source_map.label.min() >= 1
    assert result.source_map.label.max() <= len(result.report["matches"])
    m = result.report["matches"][int(result.source_map.label[88, 88]) - 1]
    assert np.hypot(*np.subtract(m["target"], 88)) < 40


def test_stages_and_report(spliced: Any) -> None:
    result = spliced("stones", "wall")
    names = ["source cells", "target layout", "target cells", "assignment", "cuts", "before_blending"]
    assert list(result.stages) == names
    assert all(stage.ndim >= 2 for stage in result.stages.values())
    json.dumps(dict(result.report))


def test_same_bytes_for_any_pool_and_seed_decides() -> None:
    found = []
    for count in (1, 2, 7):
        with texrs.threads(count):
            found.append(texrs.splice(STONES, DOTS, 96, seed=3).image.tobytes())
    assert found[0] == found[1] == found[2]
    assert texrs.splice(STONES, DOTS, 96, seed=4).image.tobytes() != found[0]


def test_turns_only_where_allowed() -> None:
    turned = texrs.splice(STONES, DOTS, 128, allow_rotation=True).report
    assert any(m["turn"] for m in turned["matches"])
    upright = texrs.splice(STONES, DOTS, 128, allow_rotation=False).report
    assert not any(m["turn"] for m in upright["matches"])


def test_figures_are_bent_when_asked_for_and_where_no_cells_are() -> None:
    assert texrs.splice(STONES, DOTS, 96, use_cells=False).report["method"] == "default"
    noise = np.random.default_rng(0).integers(0, 255, SIZE).astype(np.uint8)
    assert texrs.splice(replace(STONES, image=noise), DOTS, 96, use_nets=False).report["method"] == "default"
    assert texrs.splice(STONES, DOTS, 96, method="paper").report["method"] == "paper"
    with pytest.raises(InvalidInput, match="cells"):
        texrs.splice(replace(STONES, image=noise), DOTS, 96, use_cells=True)
    with pytest.raises(InvalidInput, match="separate"):
        texrs.splice(DOTS, STONES, 96, use_cells=True)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"use_cells": 1}, "use_cells: must be True or False"),
        ({"allow_rotation": "no"}, "allow_rotation: must be True or False"),
        ({"strength": 1.5}, "strength"),
        ({"strength": "half"}, "strength"),
        ({"use_cells": True, "method": "paper"}, "deforms"),
        ({"use_cells": True, "method": "preview"}, "deforms"),
    ],
)
def test_wrong_options_are_told(options: Any, words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        texrs.splice(STONES, DOTS, 96, **options)
    assert texrs.splice(STONES, DOTS, 96, use_cells=np.False_).report["method"] == "default"


def test_boxes_of_any_size_are_taken() -> None:
    for box in ((1, 1), (9999, 9999)):
        assert texrs.splice(replace(STONES, box=box), DOTS, 96).report["method"] in ("cells", "default")


def test_layouts_are_told_apart_by_all_that_they_are_made_from() -> None:
    stripes = np.zeros(SIZE, bool)
    stripes[::7] = True
    unknown = replace(STONES, mask=stripes, points=STONES.points[::2])
    given = replace(unknown, box=(3, 3)), unknown
    assert [find_entry_cells(entry) is None for entry in given] == [True, False]
    there = [texrs.splice(WALL, entry, 128).report["matches"] for entry in given]
    assert there[0] != there[1]


@pytest.mark.parametrize("points", [[[80.0, 20], [80, 60], [80, 100], [80, 150]], [[80.0, 20], [80.1, 20], [80, 20.2]]])
def test_layouts_without_area_are_taken(points: list[list[float]]) -> None:
    result = texrs.splice(STONES, replace(DOTS, points=np.array(points)), 96)
    assert result.report["method"] == "cells"
    assert result.report["targets"] >= 1


def test_strength_leads_from_one_layout_to_the_other() -> None:
    cells = find_entry_cells(STONES)
    assert cells is not None
    own = cKDTree(cells.centre[cells.whole])
    results = {s: texrs.splice(STONES, WALL, SIZE, strength=s, seed=1) for s in (0.0, 0.5, 1.0)}
    away = []
    for strength, result in results.items():
        assert result.report["strength"] == strength
        assert result.report["present"] >= 0.95
        found = np.array([m["found"] for m in result.report["matches"] if m["found"]])
        inside = ((found > 20) & (found < 140)).all(axis=1)
        away.append(float(np.median(own.query(found[inside])[0])))
    assert away[0] < 1.0 < away[1] < away[2]
    assert (results[1.0].image == texrs.splice(STONES, WALL, SIZE, seed=1).image).all()
    near = [m for m in results[0.0].report["matches"] if all(20 < x < 140 for x in m["target"])]
    assert np.mean([np.hypot(*np.subtract(m["target"], m["point"])) < 1 for m in near]) > 0.8, "cells show themselves"


@pytest.mark.parametrize("size", [(96, 128), (128, 224), (240, 240)])
def test_own_layouts_have_any_size(size: tuple[int, int]) -> None:
    for wrap in ((False, False), (True, False)):
        report = texrs.splice(replace(STONES, wrap=wrap), DOTS, size, strength=0.3).report
        assert report["present"] >= 0.9


def test_the_report_says_how_much_of_each_way_was_gone(spliced: Any) -> None:
    for result in (spliced("stones", "dots"), texrs.splice(STONES, DOTS, use_cells=False), texrs.splice(DOTS, STONES)):
        parts = [m["displacement_reached"] for m in result.report["matches"]]
        assert all(part is None or 0 <= part <= 1 for part in parts)
        assert sum(part is not None for part in parts) > len(parts) / 2
        assert 0 <= result.report["displacement_reached"] <= 1
    assert (
        spliced("stones", "dots").report["displacement_reached"]
        > texrs.splice(STONES, DOTS, use_cells=False).report["displacement_reached"]
    )


def test_layouts_go_on_without_mirrors() -> None:
    few = find_entry_cells(STONES)
    assert few is not None
    far = take_cells(few, (False, False), (400, 400), 30.0, seed=0)
    assert far.continued == "quilted"
    assert 120 <= len(far.area) <= 420
    assert abs(np.sqrt(np.median(far.area)) / 30 - 1) < 0.25
    assert take_cells(few, (False, False), (30, 30), 30.0, seed=0).continued == ""
    assert take_cells(few, (True, True), (400, 400), 30.0, seed=0).continued == "wrap"


def test_work_can_be_watched_and_stopped() -> None:
    seen: list[tuple[str, float]] = []
    texrs.splice(STONES, DOTS, 96, progress=lambda stage, share: seen.append((stage, share)))
    assert ("cells", 1.0) in seen

    def stop(stage: str, share: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        texrs.splice(STONES, DOTS, 96, progress=stop)


# --- outlines --------------------------------------------------------------------------------------------------------


def ring(radius: Any, count: int = 48) -> Any:
    turn = 2 * np.pi * np.arange(count) / count
    return np.stack([radius * np.sin(turn), radius * np.cos(turn)], axis=-1)


def test_an_outline_is_matched_with_itself() -> None:
    turn = 2 * np.pi * np.arange(48) / 48
    star = ring(10 + 3 * np.cos(3 * turn))[None]
    found = match_outlines(star, star, 20.0)
    assert np.abs(found.locate(star) - star).max() < 1e-4
    assert found.cost[0] < 1e-6


def test_where_an_outline_begins_does_not_matter() -> None:
    turn = 2 * np.pi * np.arange(48) / 48
    star = ring(10 + 3 * np.cos(3 * turn))[None]
    other = np.roll(star, 17, axis=1)
    for found in (
        match_outlines(star, other, 20.0),
        rematch_outlines(star, other, 20.0, match_outlines(star, other, 20.0)),
    ):
        assert np.abs(found.locate(other) - star).max() < 1e-4


def test_outlines_are_nowhere_pulled_into_a_point() -> None:
    box = resample(np.array([[-30.0, -10], [-30, 10], [30, 10], [30, -10]]))[None]
    wedge = resample(np.array([[-34.0, 0], [26, 22], [26, -22]]))[None]
    places = match_outlines(box, wedge, 40.0).places[0]
    strides = np.diff(places, append=places[:1]) % (2 * len(places))
    assert strides.sum() == 2 * len(places)
    assert strides.min() > 0


def test_mean_values_carry_linear_maps() -> None:
    outline = ring(10.0)[None]
    inside = np.random.default_rng(0).uniform(-6, 6, (1, 50, 2))
    matrix = np.array([[1.2, 0.3], [-0.1, 0.8]])
    assert np.abs(interpolate(inside, outline, outline @ matrix) - inside @ matrix).max() < 1e-3


def test_heaps_are_composed_of_cells_unless_they_are_called_separate() -> None:
    image = samples.load("beans", size=(160, 160)).image
    heap = texrs.elements.analyse(image)
    assert heap.report["found"] == "heap"
    assert heap.layout == Layout.DISJOINT
    assert texrs.splice(heap, DOTS, 128).report["method"] == "cells"
    # The elements stay whole if they only move.
    assert texrs.self_splice(heap, "randomise").report["method"] == "default"
    assert find_entry_cells(texrs.elements.analyse(image, layout="disjoint")) is None


def test_cells_without_a_joint_on_one_side_are_not_trusted() -> None:
    wall = texrs.elements.analyse(samples.bricks((192, 192)).image)
    assert wall.known is not None
    known = wall.known.copy()
    # Divide a brick where it has no joint.
    brick = np.argwhere(known == 1)
    middle = int(brick[:, 1].mean())
    known[tuple(brick[brick[:, 1] > middle].T)] = known.max() + 1
    cells = find_entry_cells(replace(wall, known=known))
    assert cells is not None
    assert cells.certain[0] < 0.5 < np.median(cells.certain)

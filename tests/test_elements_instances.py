"""Single elements: their labels and masks, and their use by DESIGN and SPLICE."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import texrs
from texrs import elements, layouts, samples
from texrs.elements import ElementAnalysis, Layout
from texrs.errors import InvalidInput
from texrs.exemplar import ElementOptions
from texrs.papers.splice.foreground import split_foreground
from texrs.point_sets import find_courses, find_lattice, spacing

RADIUS, SIDE = 8, 96
CENTRES = np.array([[20.0, 20], [20, 34], [20, 70], [60, 20], [60, 50]])
ALONE = np.array([60.0, 78])
"""Centre of a disc without a point."""


def draw_discs(centres: np.ndarray, radii: np.ndarray, *, wrap: bool = False) -> np.ndarray:
    away = np.abs(np.indices((SIDE, SIDE)).transpose(1, 2, 0)[:, :, None] - centres)
    away = np.minimum(away, SIDE - away) if wrap else away
    return (np.linalg.norm(away, axis=-1) <= radii).any(axis=-1)


def make_entry(points: np.ndarray, mask: np.ndarray, **given: object) -> ElementAnalysis:
    image = np.where(mask, 200, 60).astype(np.uint8)
    return ElementAnalysis(image, points, mask, (17, 17), Layout.DISJOINT, np.linspace(1, 0.5, len(points)), **given)


MASK = draw_discs(np.concatenate([CENTRES, [ALONE]]), np.array([RADIUS] * 6))
ENTRY = make_entry(CENTRES, MASK)


# --- labels and masks ------------------------------------------------------------------------------------------------


def test_points_own_the_pieces_they_lie_in() -> None:
    assert ENTRY.labels.dtype == np.int32
    assert ((ENTRY.labels > 0) == MASK).all()
    at = CENTRES.astype(int)
    assert ENTRY.labels[at[:, 0], at[:, 1]].tolist() == [1, 2, 3, 4, 5]
    # The first two discs touch, and are separated halfway.
    assert ENTRY.labels[20, 26] == 1
    assert ENTRY.labels[20, 28] == 2
    assert ENTRY.labels[60, 78] == 6
    np.testing.assert_allclose(ENTRY.instances[5].centre, ALONE, atol=0.5)


def test_masks_put_together_are_the_labels() -> None:
    again = np.zeros_like(ENTRY.labels)
    for number, one in enumerate(ENTRY.instances, start=1):
        assert one.mask.any(axis=0).all()
        assert one.mask.any(axis=1).all()
        rows, columns = np.nonzero(one.mask)
        again[rows + one.origin[0], columns + one.origin[1]] = number
    np.testing.assert_array_equal(again, ENTRY.labels)


def test_labels_are_made_once_and_stay() -> None:
    entry = make_entry(CENTRES, MASK)
    assert entry.labels is entry.labels
    assert entry.instances is entry.instances
    np.testing.assert_array_equal(entry.labels, ENTRY.labels)
    with pytest.raises(ValueError, match="read-only"):
        entry.labels[0, 0] = 1
    assert (replace(entry, mask=np.zeros_like(MASK)).labels == 0).all()


def test_a_point_on_the_ground_has_nothing() -> None:
    entry = make_entry(np.concatenate([CENTRES, [[90.0, 90]]]), MASK)
    empty = entry.instances[5]
    assert empty.mask.size == 0
    assert empty.confidence == 0
    assert entry.labels[60, 78] == 7


def test_confidence_is_likeness_and_of_what_has_no_point_its_area() -> None:
    sure = [one.confidence for one in ENTRY.instances[:5]]
    assert sure[0] == 1
    assert sure == sorted(sure, reverse=True)
    # Confidences equal the shares of correct elements that were measured at similarities from 1 to 0.5.
    np.testing.assert_allclose(sure, [1, 0.97, 0.8, 0.31, 0.05], atol=0.02)
    assert ENTRY.instances[5].confidence > 0.95
    radii = np.array([RADIUS] * 5 + [RADIUS * 0.7])
    small = make_entry(CENTRES, draw_discs(np.concatenate([CENTRES, [ALONE]]), radii)).instances[5]
    assert 0.4 < small.confidence < 0.6


def test_sizes_are_measured_unless_they_were_looked_for() -> None:
    mask = draw_discs(CENTRES, np.array([8, 8, 8, 4, 8]))
    measured = make_entry(CENTRES, mask).instances
    np.testing.assert_allclose([measured[2].scale, measured[3].scale], [1, 0.5], atol=0.05)
    found = {"scales": np.array([1, 1, 1, 0.7, 1]), "angles": np.array([0, 0, 90.0, 0, 0])}
    searched = make_entry(CENTRES, mask, **found).instances
    assert [one.scale for one in searched] == [1, 1, 1, 0.7, 1]
    assert [one.angle for one in searched] == [0, 0, 90, 0, 0]


def test_around_cyclic_borders_elements_are_whole() -> None:
    centres = np.array([[2.0, 40], [94, 50], [50, 1], [50, 50]])
    mask = draw_discs(centres, np.array([RADIUS] * 4), wrap=True)
    entry = make_entry(centres, mask, wrap=(True, True))
    # The first two discs touch across the border, and are separated there.
    assert len(entry.instances) == 4
    assert entry.labels[92, 38] == 1
    assert entry.labels[4, 52] == 2
    first, second, side, middle = entry.instances
    assert first.mask.shape[0] <= 2 * RADIUS + 1
    assert side.mask.shape == middle.mask.shape
    assert side.origin == (42, 89)
    np.testing.assert_array_equal(side.mask, middle.mask)
    assert abs(int(first.mask.sum()) - int(second.mask.sum())) < 0.15 * first.mask.sum()


def test_bricks_are_cells() -> None:
    sample = samples.bricks((128, 128))
    entry = ElementAnalysis.of_sample(sample)
    truth, shares = sample.labels, []
    for number in range(1, len(entry.points) + 1):
        mine = entry.labels == number
        theirs = truth == np.bincount(truth[mine]).argmax()
        shares.append((mine & theirs).sum() / (mine | theirs).sum())
    assert min(shares) > 0.85
    assert np.mean(shares) > 0.94
    assert not entry.labels[~sample.mask].any()


def test_cells_that_the_mask_missed_are_there() -> None:
    sample = samples.bricks((128, 128))
    whole = ElementAnalysis.of_sample(sample)
    mask = sample.mask.copy()
    one = whole.labels == 1
    mask[one] = False
    found = replace(whole, mask=mask).labels == 1
    assert (found & one).sum() / (found | one).sum() > 0.8


def test_a_saved_entry_has_the_same_labels(tmp_path: Path) -> None:
    ENTRY.save(tmp_path / "entry.npz")
    np.testing.assert_array_equal(elements.load(tmp_path / "entry.npz").labels, ENTRY.labels)


def test_a_mask_of_another_shape_gets_a_sentence() -> None:
    with pytest.raises(InvalidInput, match=r"mask: must be bool of shape \(96, 96\), got bool \(5, 5\)"):
        _ = replace(ENTRY, mask=np.ones((5, 5), bool)).labels


# --- one analysis for both -------------------------------------------------------------------------------------------


def test_splice_divides_elements_alike() -> None:
    split = split_foreground(ENTRY)
    both = split.core > 0
    assert both.sum() > 0.9 * MASK.sum()
    np.testing.assert_array_equal(split.core[both], ENTRY.labels[both])


def test_design_takes_an_entry_for_exemplar_or_elements() -> None:
    marked = texrs.design(ENTRY.image, 64, copies=1, elements=ElementOptions(labels=ENTRY.labels))
    for made in (texrs.design(ENTRY, 64, copies=1), texrs.design(ENTRY.image, 64, copies=1, elements=ENTRY)):
        np.testing.assert_array_equal(made.image, marked.image)
        assert made.report["segmentation"] == "labels"
        assert made.report["elements"] == 6


def test_what_is_said_of_elements_stands_above_the_entry() -> None:
    assert (
        texrs.design(ENTRY, 64, copies=1, elements=ElementOptions(segmentation="grid")).report["segmentation"] == "grid"
    )


def test_entries_and_pictures_are_mixed() -> None:
    plain = 255 - ENTRY.image
    labels = [ENTRY.labels, np.zeros_like(ENTRY.labels)]
    options = {"copies": 1, "way": "still"}
    made = texrs.design([ENTRY, replace(ENTRY, image=plain, mask=np.zeros_like(MASK))], 64, **options)
    marked = texrs.design([ENTRY.image, plain], 64, elements=ElementOptions(labels=labels), **options)
    np.testing.assert_array_equal(made.image, marked.image)
    assert texrs.design([ENTRY, plain], 64, **options).image.shape == (64, 64)


def test_design_parts_what_lies_across_a_border() -> None:
    centres = np.array([[2.0, 40], [50, 1], [50, 50]])
    entry = make_entry(centres, draw_discs(centres, np.array([RADIUS] * 3), wrap=True), wrap=(True, True))
    assert texrs.design(entry, 64, copies=1, way="move").report["elements"] == 5


@pytest.mark.parametrize("exemplar", [ENTRY.image[:64], [ENTRY.image, ENTRY.image]], ids=["shape", "several"])
def test_elements_of_another_texture_get_a_sentence(exemplar: object) -> None:
    with pytest.raises(InvalidInput, match=r"elements: an ElementAnalysis of shape \(96, 96\) requires one exemplar"):
        texrs.design(exemplar, 64, elements=ENTRY)


@pytest.mark.parametrize(("name", "side"), [("pebbles", 128), ("pebbles", 192), ("dots", 128)])
def test_things_on_a_ground_are_no_cells(name: str, side: int) -> None:
    found = elements.analyse(samples.load(name, size=(side, side)).image)
    assert found.layout == Layout.DISJOINT


def test_cells_are_the_elements_where_joints_part_all() -> None:
    image = samples.load("brick").image[:256, :256]
    plain = elements.analyse(image)
    again = elements.analyse(image, box=plain.report["box"], layout="jointed")
    for found in (plain, again):
        assert found.report["mask"] == "finder"
        assert found.layout == Layout.JOINTED
        assert found.labels.max() == len(found.instances) >= len(found.points)
        assert np.median([one.confidence for one in found.instances]) > 0.9
    assert min(plain.report["confidence"].values()) >= 0.8
    assert "box" not in again.report["proposed"]
    assert abs(len(plain.points) - len(again.points)) <= 2
    # Explicit arguments prevent an analysis as cells.
    for said in ({"layout": "disjoint"}, {"points": plain.points[:9], "layout": "jointed"}, {"box": (80, 80, 15, 15)}):
        assert elements.analyse(image, **said).report["mask"] != "finder" or "layout" in said


@pytest.mark.parametrize(
    ("name", "regular", "rows"), [("net", True, True), ("bricks", True, True), ("dots", False, False)]
)
def test_the_arrangement_is_known(name: str, regular: bool, rows: bool) -> None:
    entry = ElementAnalysis.of_sample(samples.load(name, size=(192, 192)))
    found = entry.arrangement
    assert (found.lattice is not None, found.courses is not None) == (regular, rows)
    if found.courses is not None:
        # Each element is in a course, except where the border cuts them.
        apart = np.abs(entry.points[:, :1] - np.array(found.courses)).min(axis=1)
        assert np.median(apart) < 0.1 * found.spacing
    light = entry.image.mean(axis=-1)
    assert found.darker == bool(np.median(light[~entry.mask]) < np.median(light[entry.mask]))
    words = found.describe(entry.layout)
    assert ("lattice" in words) == regular
    assert words in elements.to_html(entry)


def test_courses_of_unequal_stones_are_found_and_a_heap_has_none() -> None:
    wall = layouts.courses(160, [20, 40], 50, shift=0.25, vary=0.4, seed=3)
    assert wall.arrangement.lattice is None
    assert wall.arrangement.courses is not None
    assert np.diff(wall.arrangement.courses)[:-1] == pytest.approx(30, abs=1.5)
    heap = np.random.default_rng(2).uniform(0, 200, (60, 2))
    assert find_courses(heap, spacing(heap)) is None
    assert find_lattice(heap, spacing(heap)) is None

"""New arrangements of cells and of whole elements: the ways "cells" and "sow" of `texrs.design`."""

import numpy as np
import pytest

import texrs
from texrs import samples
from texrs.errors import InvalidInput
from texrs.mosaic import complete_cells
from texrs.mosaic.dissection import dissect
from texrs.mosaic.tessellation import take_periodic_cells
from texrs.sowing import sow_periodic


def lay_wall(side, seed):
    """Return an image of an ashlar wall with grey stones between black joints, and the labels of its stones."""
    rng = np.random.default_rng(seed)
    sides = np.array([[20, 34], [20, 20], [31, 42], [14, 26], [26, 16]], float)
    boxes, _ = dissect(sides, (side, side), seed=seed)
    labels = np.zeros((side, side), np.int32)
    for number, box in enumerate(np.rint(boxes + 0.5).astype(int), start=1):
        rows, columns = np.arange(box[0], box[2] - 2) % side, np.arange(box[1], box[3] - 2) % side
        labels[np.ix_(rows, columns)] = number
    tones = np.concatenate([[20], rng.integers(90, 230, labels.max())])
    return (tones[labels] + rng.integers(-8, 9, labels.shape)).astype(np.uint8), labels


def measure_overlap(boxes, size):
    """Return the number of rectangles that cover each pixel of a periodic output."""
    covered = np.zeros(size, int)
    for box in np.rint(boxes + 0.5).astype(int):
        np.add.at(covered, np.ix_(np.arange(box[0], box[2]) % size[0], np.arange(box[1], box[3]) % size[1]), 1)
    return covered


@pytest.mark.parametrize("seed", range(4))
def test_a_dissection_covers_the_output_once(seed):
    sides = np.random.default_rng(seed).integers(12, 60, (9, 2)).astype(float)
    boxes, of = dissect(sides, (240, 300), seed=seed)
    # Borders of rectangles are rounded to pixels, so a few pixels are covered by two or by none.
    covered = measure_overlap(boxes, (240, 300))
    assert (covered == 1).mean() > 0.95
    found = np.stack([boxes[:, 2] - boxes[:, 0], boxes[:, 3] - boxes[:, 1]], axis=1)
    assert found.prod(axis=1).sum() == pytest.approx(240 * 300)
    # Most rectangles keep their sides.
    assert np.median(np.abs(np.log(found / sides[of]))) < 0.1
    assert np.abs(np.log(found / sides[of])).max() < np.log(3)


def test_rectangles_remain_rectangles():
    wall, labels = lay_wall(160, 3)
    made = texrs.design(wall, 200, seed=1, way="cells", elements=texrs.ElementOptions(labels=labels), screening=None)
    assert made.report["way"] == ["cells"]
    cells = complete_cells(labels, wall)
    wanted = take_periodic_cells(cells, (200, 200), (True, True), seed=1)
    assert wanted.continued == "dissected"
    sides = np.ptp(wanted.outlines[wanted.shown], axis=1)
    assert (wanted.area[wanted.shown] > 0.9 * sides.prod(axis=1)).all()
    # Joints have the width that they have in the wall.
    dark = [(image < 50).mean() for image in (wall, made.image)]
    assert 0.7 < dark[1] / dark[0] < 1.4


@pytest.mark.parametrize("name", ["pebbles", "scales"])
def test_cells_close_on_the_torus(name):
    sample = samples.load(name, size=(128, 128))
    options = texrs.ElementOptions(labels=sample.labels)
    made = texrs.design(sample.image, (144, 160), seed=2, way="cells", elements=options)
    assert made.image.shape == (144, 160, 3)
    assert all(each["tiles"] for each in made.report["tiling"].values())
    # Every pixel has a source in the exemplar.
    assert (made.source_map.coordinates >= 0).all()
    assert (made.source_map.coordinates <= 127).all()
    assert len(np.unique(made.source_map.label)) > 4


def test_each_cell_of_a_periodic_output_is_chosen_once():
    sample = samples.pebbles((128, 128))
    wanted = take_periodic_cells(complete_cells(sample.labels, sample.image), (150, 170), (True, True), seed=0)
    shown = wanted.shown
    assert len(shown) > 4
    assert wanted.area[shown].sum() == pytest.approx(150 * 170, rel=0.05)
    away = np.abs(wanted.centre[shown][:, np.newaxis] - wanted.centre[shown])
    away = np.minimum(away, np.array([150, 170]) - away)
    near = np.hypot(*np.moveaxis(away, -1, 0))[~np.eye(len(shown), dtype=bool)]
    assert near.min() > 0.15 * np.sqrt(np.median(wanted.area[shown]))


def test_sown_elements_are_whole_and_apart():
    sample = samples.dots((160, 160))
    options = texrs.ElementOptions(labels=sample.labels)
    made = texrs.design(sample.image, (176, 190), seed=4, way="sow", elements=options, screening=None, patch_size=10)
    shown = sample.labels[tuple(np.moveaxis(np.rint(made.source_map.coordinates).astype(int), -1, 0))]
    number = made.source_map.label
    counted = 0
    for patch in np.unique(number[shown > 0]):
        mine = (number == patch) & (shown > 0)
        [element] = np.unique(shown[mine])
        assert mine.sum() == (sample.labels == element).sum()
        counted += 1
    assert counted > 8
    # Elements are copied without a change.
    np.testing.assert_array_equal(made.image, made.source_map.render(sample.image))
    density = [(labels > 0).mean() for labels in (sample.labels, shown)]
    assert 0.6 < density[1] / density[0] < 1.4


def test_sown_points_keep_their_distance_over_the_border():
    rng = np.random.default_rng(1)
    points = np.argwhere(np.ones((6, 6))) * 20.0 + 15 + rng.uniform(-4, 4, (36, 2))
    found = sow_periodic(points, np.full(36, 6.0), 20.0, (130, 130), (160, 170), seed=2)
    away = np.abs(found.points[:, np.newaxis] - found.points)
    away = np.minimum(away, np.array([160, 170]) - away)
    apart = np.hypot(*np.moveaxis(away, -1, 0))[~np.eye(len(found.points), dtype=bool)]
    assert apart.min() > 8
    assert 0.6 < len(found.points) / (36 * 160 * 170 / 130**2) < 1.4


@pytest.mark.parametrize(
    ("way", "reason"),
    [("cells", "neither"), ("sow", "no separate"), ("lattice", "no lattice"), ("courses", "no courses")],
)
def test_a_way_that_an_exemplar_does_not_allow_is_refused(way, reason):
    noise = np.random.default_rng(0).integers(0, 255, (64, 64), np.uint8)
    with pytest.raises(InvalidInput, match=f'^way: must be another way than "{way}", because {reason}'):
        texrs.design(noise, 64, way=way)


def test_a_size_that_a_lattice_does_not_fit_is_refused_with_one_that_it_fits():
    tile = np.random.default_rng(3).integers(0, 255, (40, 44, 3), np.uint8)
    ornament = np.tile(tile, (4, 4, 1))
    with pytest.raises(InvalidInput, match="but they fit 80 rows and 176 columns"):
        texrs.design(ornament, (60, 176), way="lattice")
    for way in ("still", "auto"):
        made = texrs.design(ornament, (60, 176), way=way, copies=1)
        assert made.report["way"] != ["lattice"]
        [refused] = made.report["refused"]
        assert "but they fit 80 rows and 176 columns" in refused["lattice"]
    made = texrs.design(ornament, (80, 176), copies=1)
    assert made.report["way"] == ["lattice"]
    assert "lattice" not in made.report["refused"][0]


def test_cells_need_room():
    sample = samples.pebbles((128, 128))
    with pytest.raises(InvalidInput, match="^size: must be at least 1.4 times as large as the largest cell"):
        texrs.design(sample.image, 32, way="cells", elements=texrs.ElementOptions(labels=sample.labels))

"""Elements measured and moved by compiled code, compared with NumPy."""

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt, find_objects

from texrs import samples
from texrs._engine.placing import measure_outlines, move_shape
from texrs.errors import InvalidInput
from texrs.kernels.gather import gather
from texrs.papers.design.elements import measure_elements, place
from texrs.papers.design.operations import Operation, compose

PAD = 9


def blobs(seed, shape=(70, 90)):
    """Draw discs that overlap and leave the image."""
    rng = np.random.default_rng(seed)
    labels = np.zeros(shape, np.int32)
    rows, columns = np.indices(shape)
    for label in range(1, 9):
        row, column, radius = rng.uniform(0, shape[0]), rng.uniform(0, shape[1]), rng.uniform(3, 14)
        labels[np.hypot(rows - row, 1.7 * (columns - column)) < radius] = label
    return labels


def measure_slowly(labels, label):
    """Return the measures of an element: distances, centre, spread along and across its axis."""
    rows, columns = find_objects(labels)[label - 1]
    extended = np.pad(labels, PAD, mode="edge")
    near = extended[rows.start : rows.stop + 2 * PAD, columns.start : columns.stop + 2 * PAD] == label
    distance = distance_transform_edt(near) - distance_transform_edt(~near)
    mine = np.argwhere(labels == label)
    spread, turned = np.linalg.eigh(np.cov(mine.T, bias=True) + np.eye(2) / 12)
    angle = np.degrees(np.arctan2(turned[1, 1], turned[0, 1]))
    return distance.astype(np.float32), mine.mean(axis=0), np.sqrt(spread[::-1]), angle


@pytest.mark.parametrize("seed", range(4))
def test_elements_are_measured_as_numpy_does(seed):
    labels = blobs(seed)
    found = measure_elements(labels)
    assert {e.label for e in found} == set(np.unique(labels)) - {0}
    for element in found:
        distance, centre, spread, angle = measure_slowly(labels, element.label)
        np.testing.assert_array_equal(element.distance, distance)
        np.testing.assert_allclose(element.centre, centre, rtol=1e-12)
        np.testing.assert_allclose(element.axes[:2], spread, rtol=1e-9)
        if spread[0] > 1.1 * spread[1]:
            assert abs((element.axes[2] - angle + 90) % 180 - 90) < 1e-6


def test_what_covers_all_has_no_outline():
    [element] = measure_elements(np.ones((20, 30), np.int32))
    assert element.distance.shape == (38, 48)
    assert element.distance.min() > 0
    assert measure_outlines(np.ones((4, 5), np.int32), [(1, (-1, -1), (6, 7)), (2, (0, 0), (2, 2))]) == [None, None]


def move_slowly(element, operations, shape):
    """Return the source of the pixels in a window, and their depth in the element."""
    matrix, shift = np.eye(2), np.zeros(2)
    for operation in operations:
        matrix, shift = operation.matrix() @ matrix, shift + operation.shift()
    corners = element.origin + (np.array(element.distance.shape) - 1) * np.array([[0, 0], [0, 1], [1, 0], [1, 1]])
    moved = element.centre + shift + (corners - element.centre) @ matrix.T
    low = np.maximum(np.floor(moved.min(axis=0)), 0).astype(int)
    high = np.minimum(np.ceil(moved.max(axis=0)) + 1, shape).astype(int)
    if (high <= low).any():
        return None
    window = tuple(slice(*ends) for ends in zip(low.tolist(), high.tolist(), strict=True))
    points = np.moveaxis(np.mgrid[window], 0, -1)
    back = (points - element.centre - shift) @ np.linalg.inv(matrix).T + element.centre
    if all(o.kind in "TM" for o in operations):
        back = np.round(back)
    at = back.astype(np.float32)
    distance = gather(element.distance, at - element.origin.astype(np.float32), interpolation="linear")
    return window, at, distance, np.all((at >= 0) & (at <= np.array(shape) - 1), axis=-1)


MOVES = (
    [],
    [Operation("T", 7.0, 0), Operation("T", -11.0, 1)],
    [Operation("M", 0.0, 0)],
    [Operation("M", 0.0, 1), Operation("T", 5.0, 1)],
    [Operation("R", 31.0, 0)],
    [Operation("S", 1.2, 0), Operation("R", -47.0, 0), Operation("T", 4.0, 0)],
    [Operation("R", 20.0, 0), Operation("M", 0.0, 0), Operation("R", 33.0, 0), Operation("S", 0.8, 0)],
    [Operation("T", 1000.0, 0)],
)


@pytest.mark.parametrize("operations", MOVES)
def test_elements_are_moved_as_numpy_does(operations):
    labels = samples.pebbles((96, 96)).labels.astype(np.int32)
    for element in measure_elements(labels):
        placed, slow = place(element, operations, labels.shape), move_slowly(element, operations, labels.shape)
        assert (placed is None) == (slow is None)
        if placed is None or slow is None:
            continue
        window, at, distance, inside = slow
        assert placed.window == window
        np.testing.assert_allclose(placed.coordinates, at, atol=1e-4)
        np.testing.assert_allclose(placed.distance, distance, atol=1e-3)
        surely = np.abs(distance - element.depth) > 1e-3
        np.testing.assert_array_equal(placed.hard[surely], (inside & (distance > element.depth))[surely])
        matrix = np.array(compose(operations)[0])
        share = ((distance > 0) & inside).sum() / (element.area * abs(np.linalg.det(matrix)))
        assert placed.kept == pytest.approx(share, abs=2 / element.area)
        np.testing.assert_allclose(placed.frame, np.linalg.inv(matrix), atol=1e-12)


def test_large_shapes_are_moved_as_small_ones():
    """Shapes of more than 4096 pixels use the thread pool."""
    distance = np.float32(30) - np.hypot(*(np.indices((90, 80)) - 40.0)).astype(np.float32)
    [whole, part] = (
        move_shape(distance, (0, 0), (40, 40), ((0.8, -0.6), (0.6, 0.8)), (60.25, 3), canvas, 3)
        for canvas in ((300, 300), (70, 70))
    )
    assert whole is not None
    assert part is not None
    assert whole.distance.size > 4096 > part.distance.size
    rows, columns = part.distance.shape
    np.testing.assert_array_equal(whole.distance[:rows, :columns], part.distance)


@pytest.mark.parametrize("matrix", [((0, 0), (0, 0)), ((1, 2), (2, 4)), ((np.nan, 0), (0, 1)), ((1e-320, 0), (0, 1))])
def test_maps_without_a_way_back_are_refused(matrix):
    with pytest.raises(InvalidInput, match="matrix"):
        move_shape(np.ones((3, 3), np.float32), (0, 0), (1, 1), matrix, (0, 0), (9, 9), 1)


def test_windows_that_nothing_fits_are_refused():
    with pytest.raises(InvalidInput, match="windows"):
        measure_outlines(np.ones((4, 5), np.int32), [(1, (0, 0), (0, 3))])

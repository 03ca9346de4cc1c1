"""Found elements: compared with the truth, with nonsense, and on lattices."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from texrs import samples
from texrs._rust import set_threads
from texrs.errors import InvalidInput
from texrs.exemplar import ElementOptions, segment
from texrs.exemplar.regularity import Lattice, correlate, find_lattice, measure_direction, measure_polarity
from texrs.exemplar.shapes import Shapes, measure_solidity


def unit(image):
    return np.asarray(image, np.float32) / 255


@cache
def drawn(name):
    return samples.load(name, size=(256, 256))


def matched(found, truth, share=0.7):
    """Count the true elements that a single element covers, with an intersection over union of at least ``share``."""
    pairs = np.zeros((found.max() + 1, truth.max() + 1))
    np.add.at(pairs, (found.ravel(), truth.ravel()), 1)
    union = pairs.sum(axis=0, keepdims=True) + pairs.sum(axis=1, keepdims=True) - pairs
    return int((pairs[1:, 1:] / union[1:, 1:] >= share).any(axis=0).sum())


# --- against truth ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "share"), [("dots", 0.85), ("pebbles", 0.75), ("leaves_and_flowers", 0.9), ("beans", 0.5)]
)
def test_elements_are_the_elements_that_were_drawn(name, share):
    sample = drawn(name)
    found = segment(sample.image)
    assert (found.kind, found.reason) == ("components", "")
    # Small parts at the border do not count.
    area = np.bincount(sample.labels.ravel())[1:]
    assert matched(found.elements, sample.labels) >= share * (area > np.median(area) / 6).sum()
    # Nothing is found twice.
    assert found.count <= 1.15 * sample.labels.max()


def test_touching_discs_are_parted_where_the_crease_is():
    rows, columns = np.mgrid[:120, :200]
    light, truth = np.full((120, 200), 0.05), np.zeros((120, 200), int)
    centres = [(60, 30), (60, 65), (60, 100), (60, 135), (60, 170), (25, 100), (95, 100)]
    for label, (row, column) in enumerate(centres, start=1):
        height = 1 - ((rows - row) ** 2 + (columns - column) ** 2) / 19.0**2
        shade = 0.35 + 0.5 * np.sqrt(np.maximum(height, 0))
        over = (height > 0) & (shade > light)
        light[over], truth[over] = shade[over], label
    found = segment(light.astype(np.float32), ElementOptions(segmentation="components"))
    assert matched(found.elements, truth, 0.8) == len(centres)


def test_marks_are_part_of_their_elements():
    rows, columns = np.mgrid[:160, :160]
    image, truth = np.full((160, 160), 0.1, np.float32), np.zeros((160, 160), int)
    for label, (row, column) in enumerate(((r, c) for r in (30, 80, 130) for c in (30, 80, 130)), start=1):
        far = np.hypot(rows - row, columns - column)
        image[far < 18], truth[far < 18] = 0.8, label
        image[far < 6] = 0.1
    found = segment(image, ElementOptions(segmentation="components"))
    assert matched(found.elements, truth, 0.9) == 9


def test_hulls_come_out_at_most_two_per_cent_too_large():
    rows, columns = np.mgrid[:90, :200]
    labels = np.zeros((90, 200), np.int32)
    labels[10:50, 5:35] = 1
    labels[np.hypot(rows - 45, columns - 80) < 30] = 2
    labels[np.abs(rows - 45) + np.abs(columns - 150) < 35] = 3
    assert 0.96 < measure_solidity(np.where(labels == 1, 1, 0)) <= 1
    assert (Shapes.of(labels).measure_solidity()[1:] > 0.93).all()
    corner = np.zeros((90, 200), np.int32)
    corner[10:50, 10:20] = corner[40:50, 10:60] = 1
    assert measure_solidity(corner) == pytest.approx(800 / 1400, abs=0.03)


# --- against nonsense ------------------------------------------------------------------------------------------------


def blotched_cloth():
    """Return threads of 3 pixels and grain under slow changes of colour, as in denim."""
    noise = np.random.default_rng(0)
    rows, columns = np.mgrid[:160, :160]
    threads = np.where((rows // 3 + columns // 3) % 2, -0.05, 0.05)
    blotches = 0.1 * np.kron(noise.standard_normal((8, 8)), np.ones((20, 20)))
    grain = 0.2 * noise.standard_normal((160, 160))
    return (np.clip(0.5 + threads + blotches + grain, 0, 1) * 255).astype(np.uint8)


@pytest.mark.parametrize(
    "image",
    [np.random.default_rng(0).random((160, 160, 3)), samples.bark().image, blotched_cloth()],
    ids=["noise", "bark", "cloth"],
)
def test_nonsense_takes_the_grid_and_says_why(image):
    found = segment(image)
    assert found.kind == "grid"
    assert found.reason
    # The requested method is used, even for a grid.
    assert segment(image, ElementOptions(segmentation="components")).kind == "components"


def test_a_constant_image_has_no_elements_and_takes_the_grid():
    found = segment(np.full((64, 64, 3), 128, np.uint8))
    assert (found.kind, found.lattice) == ("grid", None)
    assert "are not elements of a texture" in found.reason
    assert segment(np.full((64, 64), 7.0), ElementOptions(segmentation="components")).count == 0


def test_one_element_is_found():
    rows, columns = np.mgrid[:64, :64]
    image = np.where(np.hypot(rows - 30, columns - 34) < 14, 230, 20).astype(np.uint8)
    found = segment(image)
    assert (found.kind, found.count) == ("components", 1)
    assert abs(int((found.elements > 0).sum()) - int((image > 100).sum())) < 90


def test_fewer_layers_are_made_where_there_are_fewer_colours():
    image = np.zeros((48, 48, 3), np.uint8)
    image[12:24, 12:24] = 255
    assert segment(image, ElementOptions(layers=16)).layers.max() == 1
    assert segment(image, ElementOptions(layers=1)).layers.max() == 0


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (9, 1), (2, 40), (23, 24), (40, 40, 2), (40, 40, 4), (40, 40, 7)])
@pytest.mark.parametrize("kind", ["auto", "components", "grid", "none"])
def test_any_shape(shape, kind):
    image = np.random.default_rng(0).integers(0, 256, shape).astype(np.uint8)
    found = segment(image, ElementOptions(segmentation=kind))
    assert found.elements.shape == found.layers.shape == shape[:2]
    assert found.elements.dtype == found.layers.dtype == np.int32


def test_labels_by_hand_are_kept():
    labels = np.zeros((40, 40), np.int64)
    labels[5:10, 5:10], labels[20:30, 20:30] = 70, 4
    found = segment(samples.weave((40, 40)).image, ElementOptions(labels=labels))
    assert (found.kind, found.count, found.lattice) == ("labels", 2, None)
    assert (np.unique(found.elements[labels > 0]) == [1, 2]).all()
    assert segment(np.zeros((40, 40)), ElementOptions(labels=labels > 0)).count == 1


PICTURE = np.zeros((32, 32, 3), np.uint8)


@pytest.mark.parametrize(
    ("image", "options", "names"),
    [
        (PICTURE, {"layers": 2, "segmentation": "grid"}, "layers"),
        (PICTURE, {"labels": np.zeros((31, 32), int)}, "labels"),
        (PICTURE, {"labels": np.zeros((32, 32, 1), int)}, "labels"),
        (PICTURE, {"labels": np.full((32, 32), -1)}, "labels"),
    ],
)
def test_bad_input_names_the_argument(image, options, names):
    with pytest.raises(InvalidInput, match=f"^{names}"):
        segment(image, ElementOptions(**options))


def test_the_same_bytes_for_any_number_of_threads():
    image = samples.beans((96, 96)).image
    results = []
    for threads in (1, 2, 7):
        before = set_threads(threads)
        results.append(segment(image).elements.tobytes())
        set_threads(before)
    assert results[0] == results[1] == results[2]


# --- regularity ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("whole", [True, False])
def test_shifts_beyond_an_image_do_not_correlate(whole: bool):
    picture = np.random.default_rng(0).standard_normal((20, 40)).astype(np.float32)
    found = correlate(picture, (30, 50), whole=whole)
    assert found.shape == (61, 101)
    assert not found[:11].any()
    assert not found[:, -11:].any()
    assert found[30, 50] == pytest.approx(1)
    assert np.array_equal(found, found[::-1, ::-1])


def is_in(vector, found):
    times = np.linalg.solve(np.array([found.a, found.b], float).T, vector)
    return np.abs(times - np.round(times)).max() < 0.12


@pytest.mark.parametrize("name", ["weave", "net", "bricks", "scales"])
def test_regular_things_lie_on_a_lattice(name):
    found = segment(drawn(name).image)
    assert found.lattice is not None
    assert "lattice" in found.reason
    assert measure_direction(unit(drawn("bricks").image)) > 0.3


@pytest.mark.parametrize("name", ["dots", "pebbles", "beans", "grit", "leaves_and_flowers", "bark"])
def test_scattered_things_do_not(name):
    assert find_lattice(unit(drawn(name).image)) is None


def test_the_periods_of_a_tiling_are_found():
    tile = np.random.default_rng(3).random((20, 28, 1)).astype(np.float32)
    found = find_lattice(np.tile(tile, (9, 7, 1)))
    assert found is not None
    assert {tuple(map(abs, found.a)), tuple(map(abs, found.b))} == {(20, 0), (0, 28)}
    assert is_in((40, 56), found)
    shifts = found.shifts(45)
    assert shifts[0] in ((20, 0), (-20, 0))
    assert {(40, 0), (0, 28), (-20, 28)} <= set(shifts)
    assert all(is_in(s, found) and np.hypot(*s) <= 45 for s in shifts)


def test_periods_are_known_to_parts_of_a_pixel():
    rows, columns = np.mgrid[:160, :170].astype(np.float32)
    waves = np.cos(2 * np.pi * rows / 17.3) + np.cos(2 * np.pi * columns / 23.6)
    found = find_lattice(np.maximum(waves, 0)[..., None])
    assert found is not None
    assert np.abs(found.vectors).max(axis=1) == pytest.approx([17.3, 23.6], abs=0.1)


@pytest.mark.parametrize("wrap", [(True, True), (True, False), (False, False)])
def test_a_lattice_closes_on_a_torus(wrap):
    lattice = Lattice((26, 40), (27, -40), 0.9, ((26.7, 39.5), (26.7, -39.6)))
    closing = lattice.close((512, 400), wrap)
    assert closing is not None
    assert np.abs(closing - np.eye(2)).max() <= 0.15
    for axis, side in enumerate((512, 400)):
        times = np.linalg.solve(closing @ lattice.vectors, side * np.eye(2)[axis])
        assert wrap[axis] == (np.abs(times - np.rint(times)).max() < 1e-4)
    assert any(wrap) or (closing == np.eye(2)).all()


def test_a_lattice_that_would_be_bent_too_far_does_not_close():
    lattice = Lattice((40, 0), (0, 40), 0.9)
    assert lattice.close((60, 400), (True, True)) is None
    assert lattice.close((20, 400), (True, True)) is None
    assert lattice.close((60, 400), (False, True)) is not None
    assert lattice.find_size((60, 400), (True, True)) == (80, 400)
    assert lattice.find_size((60, 400), (False, True)) == (60, 400)
    assert "80 rows and 400 columns" in lattice.explain((60, 400), (True, True))


def turn(degrees):
    return np.array([[np.cos(a := np.radians(degrees)), -np.sin(a)], [np.sin(a), np.cos(a)]])


def measure_shear(change):
    return abs(change[:, 0] @ change[:, 1]) / np.prod(np.linalg.norm(change, axis=0))


def test_a_lattice_closes_with_little_shear():
    """An odd number of courses of a running bond fits best, but it would shear the wall by 12 %."""
    wall = Lattice((20, 30), (20, -30), 0.9)
    closing = wall.close((260, 240), (True, True))
    np.testing.assert_allclose(closing, [[260 / 280, 0], [0, 1]], atol=1e-5)
    rng = np.random.default_rng(0)
    accepted = 0
    for _ in range(200):
        vectors = turn(rng.uniform(0, 60)) @ [[1, 0], [rng.uniform(-0.1, 0.1), 1]] @ np.diag(rng.uniform(20, 60, 2))
        exact = tuple(map(tuple, np.rint(vectors.T * 256) / 256))
        lattice = Lattice((1, 0), (0, 1), 0.9, exact)
        size = tuple(rng.integers(180, 500, 2).tolist())
        closing = lattice.close(size, (True, True))
        other = lattice.find_size(size, (True, True))
        assert other is not None
        assert lattice.close(other, (True, True)) is not None
        if closing is None:
            assert other != size
            continue
        accepted += 1
        times = np.linalg.solve(closing @ lattice.vectors, np.diag(size))
        assert np.abs(times - np.rint(times)).max() < 1e-3
        stretch = np.linalg.svd(closing, compute_uv=False)
        assert 1 / 1.1501 < stretch.min() <= stretch.max() < 1.1501
        assert measure_shear(closing) < 0.0401
    assert accepted > 150


def test_a_lattice_that_closes_along_one_axis_is_not_sheared():
    """A wall that was photographed obliquely becomes level."""
    vectors = turn(3) @ [[20.0, 0.0], [30.0, 60.0]]
    lattice = Lattice((20, 30), (0, 60), 0.9, tuple(map(tuple, vectors.T)))
    closing = lattice.close((123, 240), (False, True))
    np.testing.assert_allclose(closing, turn(-3), atol=1e-5)
    closing = lattice.close((200, 123), (True, False))
    np.testing.assert_allclose(closing, turn(-3), atol=1e-5)


def test_parallel_vectors_are_not_a_lattice():
    with pytest.raises(InvalidInput, match="^lattice: must have two vectors that are not parallel"):
        Lattice((0, 8), (0, 16), 1.0).close((32, 32), (True, True))


def test_direction_sees_one_direction_and_two_at_right_angles():
    rows, columns = np.mgrid[:128, :128]
    stripes = np.sin(0.5 * (rows + 0.3 * columns))
    squares = (np.sin(0.4 * rows) > 0) ^ (np.sin(0.4 * columns) > 0)
    noise = np.random.default_rng(0).random((128, 128))
    assert measure_direction(stripes[..., None].astype(np.float32)) > 0.95
    assert measure_direction(squares[..., None].astype(np.float32)) > 0.5
    assert measure_direction(noise[..., None].astype(np.float32)) < 0.15
    assert measure_direction(np.zeros((128, 128, 1), np.float32)) == 0


@pytest.mark.parametrize(("name", "axes"), [("beans", (0, 1)), ("grit", (0, 1)), ("scales", (0, 1)), ("bark", (1,))])
def test_what_is_lit_from_one_side_differs_from_its_mirror_image(name, axes):
    picture = unit(drawn(name).image)
    found = measure_polarity(picture)
    assert all(found[axis] > 10 for axis in axes)
    # An image that is lit from the other side has the same difference.
    assert np.allclose(measure_polarity(picture[::-1]), found, rtol=0.05)
    assert np.allclose(measure_polarity(np.swapaxes(picture, 0, 1)), (found[1], found[0], found[2]), rtol=0.05)


@pytest.mark.parametrize("angle", [0, 20, 45])
def test_a_lattice_that_leans_differs_from_its_mirror_image(angle):
    """Two orthogonal directions lean to one side, except if they equal their mirror image."""
    rows, columns = np.indices((192, 192))
    turn = np.radians(angle)
    along, across = columns * np.cos(turn) + rows * np.sin(turn), rows * np.cos(turn) - columns * np.sin(turn)
    rng = np.random.default_rng(0)
    lines = np.cos(along / 2.5) + np.cos(across / 2.5) + rng.normal(0, 0.2, along.shape)
    oblique = measure_polarity(lines[..., np.newaxis].astype(np.float32))[2]
    assert (oblique > 5) == (angle == 20)


def test_what_is_oblique_is_like_itself_turned_round():
    rows, columns = np.mgrid[:256, :256]
    noise = np.random.default_rng(2).normal(size=(256, 256))
    found = measure_polarity((np.sin(0.5 * rows + 0.3 * columns) + 0.5 * noise)[..., None].astype(np.float32))
    assert max(found[:2]) < 5 < found[2]


def test_what_has_no_side_does_not():
    noise = np.random.default_rng(1).random((256, 256, 3)).astype(np.float32)
    assert max(measure_polarity(noise)) < 5
    assert measure_polarity(np.full((128, 128, 1), 0.5, np.float32)) == (0, 0, 0)
    assert measure_polarity(noise[:16, :16]) == (0, 0, 0)


def test_a_number_of_layers_makes_them_the_elements() -> None:
    image = samples.pebbles((96, 96)).image
    found, same = (
        segment(image, ElementOptions(layers=3)),
        segment(image, ElementOptions(layers=3, segmentation="none")),
    )
    assert (found.kind, found.elements.max()) == ("none", 2)
    assert (found.elements == same.elements).all()


def test_progress_rises_and_stops_the_work():
    # Use an image that no other test has, because results are cached.
    image, shares = samples.beans((96, 96), seed=77).image, []

    def progress(stage, share):
        assert stage == "segment"
        shares.append(share)
        if len(shares) == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        segment(image, progress=progress)
    assert len(shares) == 4
    assert all(0 < a < b < 1 for a, b in pairwise(shares))


@pytest.mark.parametrize("shape", [(1, 1), (1, 6), (6, 1), (2, 3), (20, 31)])
def test_what_is_widened_and_what_lies_at_borders_is_as_others_have_it(shape):
    from scipy import ndimage

    from texrs.exemplar.shapes import list_borders, narrow, widen

    random, square = np.random.default_rng(1), np.ones((3, 3), bool)
    for share in (0.1, 0.5, 0.9):
        values, mask = random.random(shape).astype(np.float32), random.random(shape) < share
        for reach in (1, 2, 3):
            assert (widen(values, reach) == ndimage.maximum_filter(values, 2 * reach + 1)).all()
            assert (widen(mask, reach) == ndimage.maximum_filter(mask, 2 * reach + 1)).all()
        for beyond in (False, True):
            assert (narrow(mask, beyond=beyond) == ndimage.binary_erosion(mask, square, border_value=beyond)).all()
        labels = random.integers(0, 3, shape).astype(np.int32)
        place = np.arange(labels.size).reshape(shape)
        first = np.concatenate([place[:-1].ravel(), place[:, :-1].ravel()])
        second = np.concatenate([place[1:].ravel(), place[:, 1:].ravel()])
        differ = labels.ravel()[first] != labels.ravel()[second]
        for found, expected in zip(list_borders(labels), (first, second), strict=True):
            assert (found == expected[differ]).all()

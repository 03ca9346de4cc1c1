"""Inpainting of any image: known pixels do not change, unknown ones are not copied, and maps stay in register."""

from __future__ import annotations

import re

import numpy as np
import pytest

import texrs
from reference.look_up import view
from texrs import samples
from texrs.errors import Cancelled, InvalidInput
from texrs.exemplar.patches import mark_corners
from texrs.exemplar.symmetry import NONE
from texrs.inpainting._judge import Filled, judge_seams
from texrs.inpainting._patches import MARGIN, PLACES, choose_mirrors, choose_part
from texrs.inpainting._scene import Scene
from texrs.kernels.inpaint import inpaint as kernel
from texrs.kernels.patch_search import PatchIndex

PEBBLES = samples.pebbles((96, 112)).image


def disc(shape: tuple[int, int], at: tuple[float, float] = (0.5, 0.5), radius: float = 0.17) -> np.ndarray:
    r, c = np.indices(shape)
    return np.hypot(r - at[0] * shape[0], c - at[1] * shape[1]) < radius * min(shape)


HOLE = disc((96, 112))


def places(result: texrs.Synthesis) -> tuple[np.ndarray, np.ndarray]:
    at = result.source_map.coordinates
    assert (at == np.rint(at)).all()
    return at[..., 0].astype(int), at[..., 1].astype(int)


# --- what is filled, and with what -----------------------------------------------------------------------------------


def test_periodic_pattern_is_restored_exactly():
    unit = np.random.default_rng(1).integers(0, 256, (9, 11, 3), dtype=np.uint8)
    whole = np.tile(unit, (10, 9, 1))
    for hole in (disc(whole.shape[:2]), disc(whole.shape[:2], (0, 0.3), 0.2), disc(whole.shape[:2], (1, 1), 0.3)):
        for mirror in (True, False):
            image = whole.copy()
            image[hole] = 128
            np.testing.assert_array_equal(texrs.inpaint(image, hole, allow_mirror=mirror).image, whole)


def test_holes_at_the_border_are_filled_across_it():
    unit = np.random.default_rng(2).integers(0, 256, (8, 12), dtype=np.uint8)
    whole = np.tile(unit, (8, 6))
    hole = np.zeros(whole.shape, bool)
    hole[:3], hole[:, -4:] = True, True
    result = texrs.inpaint(np.where(hole, 0, whole).astype(np.uint8), hole, wrap=True)
    np.testing.assert_array_equal(result.image, whole)


@pytest.mark.parametrize("boundary", [0, 3])
@pytest.mark.parametrize(
    "hole", [HOLE, disc((96, 112), (0, 0), 0.5), np.random.default_rng(0).random((96, 112)) < 0.01]
)
def test_known_pixels_stay_and_unknown_ones_are_not_copied(hole, boundary):
    result = texrs.inpaint(PEBBLES, hole, boundary_width=boundary, seed=3)
    row, column = places(result)
    assert not hole[row, column].any()
    own = (row == np.indices(row.shape)[0]) & (column == np.indices(row.shape)[1])
    assert not own[hole].any()
    far = texrs.inpaint(PEBBLES, hole, boundary_width=0).source_map.label == 0
    assert (far == ~hole).all()
    kept = result.source_map.label == 0
    assert own[kept].all()
    assert (result.report["replaced_outside"] > 0) == (boundary > 0)
    np.testing.assert_array_equal(result.image, PEBBLES[row, column])


def test_the_boundary_is_not_exceeded():
    from scipy.ndimage import binary_dilation

    result = texrs.inpaint(PEBBLES, HOLE, boundary_width=4)
    assert (result.source_map.label[~binary_dilation(HOLE, np.ones((3, 3)), 4)] == 0).all()


def test_what_is_in_the_hole_does_not_matter():
    base = PEBBLES.astype(np.float32)
    made = []
    for content in (0.0, 1e6, -7.0, np.nan, np.inf):
        image = base.copy()
        image[HOLE] = content
        made.append(texrs.inpaint(image, HOLE).image)
    assert np.isfinite(made[0]).all()
    for other in made[1:]:
        np.testing.assert_array_equal(other, made[0])


def test_filling_continues_the_texture():
    result = texrs.inpaint(PEBBLES, HOLE)
    grey = result.image.astype(float).mean(axis=-1)
    for axis in (0, 1):
        step = np.abs(np.diff(grey, axis=axis))
        inside = HOLE.take(range(step.shape[axis]), axis)
        assert step[inside].mean() < 1.5 * step[~inside].mean()
    assert abs(grey[HOLE].mean() - grey[~HOLE].mean()) < 20


def test_large_elements_are_not_torn_at_the_far_border():
    # Stripes are wider than a patch. If the hole were filled row by row, the last patches would not fit the lower
    # border.
    rows, columns = np.indices((160, 160))
    image = np.where((columns + rows // 3) % 56 < 28, 200, 40).astype(np.uint8)
    hole = np.zeros(image.shape, bool)
    hole[50:110, 50:110] = True
    result = texrs.inpaint(np.where(hole, 128, image).astype(np.uint8), hole, allow_mirror=False)
    assert (result.image != image)[hole].mean() < 0.01


def test_patches_do_not_mirror_or_repeat_what_is_beside_them():
    image = samples.pebbles((160, 160), seed=2).image
    hole = disc((160, 160), radius=0.22)
    result = texrs.inpaint(image, hole)
    row, column = places(result)
    turned = (result.source_map.jacobians() != np.eye(2)).any(axis=(2, 3))
    r, c = np.indices(row.shape)
    near = np.hypot(row - r, column - c) < 10
    assert (near & turned & hole).sum() < 0.02 * hole.sum()
    # Few positions are copied more than twice.
    used = np.bincount((row * 160 + column)[hole])
    assert (used > 2).sum() < 0.1 * hole.sum()


def test_empty_hole_is_refused():
    none = np.zeros((96, 112), bool)
    for more in ({"exemplar": PEBBLES[:20]}, {"method": "optimise"}):
        with pytest.raises(InvalidInput, match="mask: marks nothing, so there is nothing to fill"):
            texrs.inpaint(PEBBLES, none, **more)


# --- another picture -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_source_is_the_second_exemplar(dtype):
    other = np.ascontiguousarray(samples.beans((64, 80)).image.astype(dtype))
    image = PEBBLES.astype(dtype)
    result = texrs.inpaint(image, HOLE, exemplar=other)
    assert result.source_map.shapes == ((96, 112), (64, 80))
    np.testing.assert_array_equal(result.source_map.exemplar, HOLE.astype(np.uint16))
    row, column = places(result)
    np.testing.assert_array_equal(result.image[HOLE], other[row[HOLE], column[HOLE]])
    np.testing.assert_array_equal(result.image[~HOLE], image[~HOLE])


def test_whole_image_from_a_source():
    everywhere = np.ones((40, 50), bool)
    result = texrs.inpaint(np.full((40, 50, 3), np.nan, np.float32), everywhere, exemplar=PEBBLES.astype(np.float32))
    assert (result.source_map.exemplar == 1).all()
    assert result.image.shape == (40, 50, 3)
    seeds = [texrs.inpaint(PEBBLES, np.ones((96, 112)) > 0, exemplar=PEBBLES, seed=s).image for s in (1, 1, 2)]
    assert (seeds[0] == seeds[1]).all()
    assert (seeds[0] != seeds[2]).any()


def test_sources_of_floats_are_compared_in_one_range():
    ramp = np.tile(np.linspace(0, 10, 48, dtype=np.float32), (48, 1))
    hole = disc((48, 48))
    result = texrs.inpaint(ramp, hole, exemplar=ramp * 2)
    # Both images share one scale: scaled by its own range, the doubled ramp would look like the ramp itself.
    assert np.abs(result.image - ramp)[hole].mean() < 1


# --- any array -------------------------------------------------------------------------------------------------------


def test_every_map_in_register():
    stack = [PEBBLES, PEBBLES.astype(np.uint16) * 257, PEBBLES.astype(np.float32) * (4 / 255), PEBBLES[..., 0] > 90]
    made = [texrs.inpaint(each, HOLE) for each in stack]
    for each, result in zip(stack, made, strict=True):
        assert result.image.dtype == each.dtype
        np.testing.assert_array_equal(view(result.source_map, each), result.image)
    np.testing.assert_array_equal(made[0].source_map.coordinates, made[1].source_map.coordinates)
    np.testing.assert_array_equal(made[1].image, made[0].image.astype(np.uint16) * 257)


def test_mirrored_patches_turn_normals():
    result = texrs.inpaint(PEBBLES, HOLE)
    turned = (result.source_map.jacobians() != np.eye(2)).any(axis=(2, 3))
    assert turned.any()
    plain = texrs.inpaint(PEBBLES, HOLE, allow_mirror=False).source_map
    assert (plain.jacobians() == np.eye(2)).all()
    # Inside a patch, the step between coordinates follows the patch's frame.
    joined = result.source_map.is_coherent(1)[:, :-1]
    same = result.source_map.label[:, 1:] == result.source_map.label[:, :-1]
    assert joined[same].all()


@pytest.mark.parametrize("channels", [None, 1, 2, 4, 7])
def test_any_number_of_channels(channels):
    grey = PEBBLES[..., 0]
    image = grey if channels is None else np.stack([np.roll(grey, c, axis=0) for c in range(channels)], axis=-1)
    result = texrs.inpaint(image, HOLE.astype(np.uint8) * 255)
    assert result.image.shape == image.shape
    row, column = places(result)
    np.testing.assert_array_equal(result.image, image[row, column])


# --- which patches ---------------------------------------------------------------------------------------------------


def test_the_patches_are_kept_whose_seams_show_least():
    report = texrs.inpaint(PEBBLES, HOLE).report
    tried = dict(report["candidates"])
    assert len(tried) >= 3
    assert list(tried) == sorted(tried, reverse=True)
    assert 0.97 * tried[report["patch_size"]] <= min(tried.values())
    again = texrs.inpaint(PEBBLES, HOLE, patch_size=report["patch_size"])
    np.testing.assert_array_equal(texrs.inpaint(PEBBLES, HOLE).image, again.image)
    assert again.report["candidates"] == []


@pytest.mark.parametrize("side", [64, 40])
def test_large_things_are_made_whole(side):
    # Boxes of two colours alternate. Patches of the usual side, 32, are smaller than a box.
    row, column = np.mgrid[:320, :320]
    wall = ((row // side + column // side) % 2 * 150 + (row % side < 3) * 60).astype(np.uint8)
    hole = np.hypot(row - 170, column - 150) < 48
    made = texrs.inpaint(np.where(hole, 0, wall).astype(np.uint8), hole)
    assert (made.image == wall).mean() > 0.995


def test_sizes_for_large_holes_are_tried_in_a_small_copy(monkeypatch):
    seen = []
    real = Scene.fill
    monkeypatch.setattr(
        Scene, "fill", lambda self, side, *more: seen.append((self.known.shape, side)) or real(self, side, *more)
    )
    picture = texrs.samples.pebbles((640, 640)).image
    hole = np.zeros((640, 640), bool)
    hole[200:430, 210:440] = True
    report = texrs.inpaint(np.where(hole[..., np.newaxis], 0, picture).astype(np.uint8), hole).report
    assert [shape for shape, _ in seen] == [(320, 320)] * (len(seen) - 1) + [(640, 640)]
    assert seen[-1][1] == report["patch_size"]
    assert sorted((2 * side for _, side in seen[:-1]), reverse=True) == [side for side, _ in report["candidates"]]


def test_seams_are_judged_by_what_patches_show_beyond_them():
    stripes = np.tile(np.float32([0, 0, 1, 1]), (16, 8))[..., np.newaxis]
    label = np.zeros((16, 32), np.int32)
    label[4:12, 8:20] = 1
    place = np.moveaxis(np.indices((16, 32)), 0, -1).astype(np.float32)
    frames = np.stack([np.eye(2, dtype=np.float32)] * 2)
    free = np.ones((16, 32), bool)
    costs = []
    for shift in (0, 4, 1, 2):
        moved = np.clip(place + np.float32([0, shift]), 0, 31)
        row, column = np.moveaxis(moved.astype(int), -1, 0)
        colours = np.where(label[..., np.newaxis] > 0, stripes[row, column], stripes)
        costs.append(judge_seams(Filled(colours, label, moved, frames), stripes, free, (False, False)))
    assert costs[0] == costs[1] == 0
    # The patch has 40 pairs of pixels at its border: 12 above, 12 below and 8 on each side. Half of the pairs differ
    # after a shift by one step, and all differ after two.
    assert costs[2] == pytest.approx(20)
    assert costs[3] == pytest.approx(40)


@pytest.mark.parametrize(
    ("box", "wrap", "part", "cyclic"),
    [
        ((1000, 1100, 1200, 1300), (False, False), (744, 1356, 944, 1556), (False, False)),
        ((0, 60, 1200, 1300), (False, False), (0, 316, 944, 1556), (False, False)),
        ((0, 60, 1200, 1300), (True, True), (0, 2000, 944, 1556), (True, False)),
        ((100, 1900, 100, 1900), (False, False), (0, 2000, 0, 2000), (False, False)),
    ],
)
def test_what_is_around_the_holes_is_looked_at(box, wrap, part, cyclic):
    hole = np.zeros((2000, 2000), bool)
    hole[box[0] : box[1], box[2] : box[3]] = True
    rows, columns = choose_part(hole, ~hole, wrap, ~hole)[0]
    assert (rows.start, rows.stop, columns.start, columns.stop) == part
    assert choose_part(hole, ~hole, wrap, ~hole)[1] == cyclic


def test_holes_far_from_the_corner_are_filled_from_what_is_around_them():
    picture = np.tile(PEBBLES, (8, 8, 1))
    hole = np.zeros(picture.shape[:2], bool)
    hole[500:540, 700:760] = True
    result = texrs.inpaint(np.where(hole[..., np.newaxis], 0, picture).astype(np.uint8), hole)
    np.testing.assert_array_equal(result.image, picture)  # The image is periodic, so the filling is exact.
    row, column = places(result)
    np.testing.assert_array_equal(result.image, picture[row, column])
    assert not hole[row, column].any()
    assert np.abs(row - 520).max(where=hole, initial=0) <= MARGIN + 20


def test_flat_ground_is_filled_at_once():
    white = np.full((256, 256, 3), 255, np.uint8)
    hole = np.zeros((256, 256), bool)
    hole[80:160, 90:170] = True
    result = texrs.inpaint(white, hole)
    np.testing.assert_array_equal(result.image, white)
    assert len(result.report["candidates"]) == 1


def test_smaller_patches_where_few_places_are_free():
    grid = np.zeros((96, 112), bool)
    grid[::9], grid[:, ::9] = True, True
    result = texrs.inpaint(PEBBLES, grid)
    assert result.report["patch_size"] == 8
    assert mark_corners(~grid, 8).sum() >= PLACES > mark_corners(~grid, 9).sum()
    dense = np.zeros((96, 112), bool)
    dense[::5], dense[:, ::5] = True, True
    assert texrs.inpaint(PEBBLES, dense).report["patch_size"] == 4
    assert 12 <= texrs.inpaint(PEBBLES, HOLE).report["patch_size"] <= 64


def test_corners():
    free = np.random.default_rng(0).random((14, 11)) < 0.8
    for side in (1, 2, 3, 5, 11):
        expected = np.zeros(free.shape, bool)
        for r in range(14 - side + 1):
            for c in range(11 - side + 1):
                expected[r, c] = free[r : r + side, c : c + side].all()
        np.testing.assert_array_equal(mark_corners(free, side), expected)


# --- errors and running ----------------------------------------------------------------------------------------------

EVERY_THIRD = np.zeros((96, 112), bool)
EVERY_THIRD[::3] = True
NAN = np.where(np.arange(96 * 112).reshape(96, 112) == 5, np.nan, 1.0)


@pytest.mark.parametrize(
    ("image", "hole", "options", "words"),
    [
        (PEBBLES, EVERY_THIRD, {}, "mask: must leave a square of 4 x 4 known pixels to copy from; or give an exemplar"),
        (PEBBLES, HOLE, {"patch_size": 3}, "patch_size: must be an integer between 4 and 96, got 3"),
        (PEBBLES, HOLE, {"patch_size": 97}, "patch_size: must be an integer between 4 and 96, got 97"),
        (
            PEBBLES,
            HOLE,
            {"patch_size": 60},
            "patch_size: a patch of side 60 does not fit into the image outside the holes; the largest size that fits is 42",
        ),
        (PEBBLES, EVERY_THIRD, {"patch_size": 12}, "no other size fits; give an exemplar"),
        (
            PEBBLES,
            HOLE,
            {"patch_size": 40, "exemplar": PEBBLES[:30]},
            "patch_size: must be an integer between 4 and 30, got 40",
        ),
        (
            PEBBLES,
            HOLE,
            {"exemplar": PEBBLES[..., 0]},
            "exemplar: must have the dtype and channels of the image, uint8 and 3",
        ),
        (PEBBLES[:3], HOLE[40:43], {}, "image: each side must be at least 4"),
        (NAN, HOLE, {}, "image: must be finite, but 1 of 10752 values are NaN"),
        (np.array([["a", "b"]]), HOLE, {}, "image: must contain integers, floats or bool"),
    ],
)
def test_arguments_are_checked(image, hole, options, words):
    with pytest.raises(InvalidInput, match=re.escape(words)):
        texrs.inpaint(image, hole, **options)


def test_the_image_is_not_changed():
    image, hole = PEBBLES.copy(), HOLE.copy()
    texrs.inpaint(image, hole)
    np.testing.assert_array_equal(image, PEBBLES)
    np.testing.assert_array_equal(hole, HOLE)
    everywhere, before = np.ones((96, 112), bool), image.copy()
    texrs.inpaint(image, everywhere, exemplar=PEBBLES)
    np.testing.assert_array_equal(image, before)


def test_exemplars_stand_for_their_arrays():
    other = samples.pebbles((64, 80), seed=5).image
    made = texrs.inpaint(texrs.Exemplar(PEBBLES), HOLE, exemplar=texrs.Exemplar(other))
    np.testing.assert_array_equal(made.image, texrs.inpaint(PEBBLES, HOLE, exemplar=other).image)
    with pytest.raises(InvalidInput, match="^exemplar: must be an Exemplar with axes=2"):
        texrs.inpaint(PEBBLES, HOLE, exemplar=texrs.Exemplar(np.zeros((8, 8, 8), np.uint8), axes=3))


def test_progress_and_cancel():
    seen = []
    texrs.inpaint(PEBBLES, HOLE, progress=lambda stage, share: seen.append((stage, share)))
    assert seen[0] == ("inpaint", 0.0)
    assert seen[-1] == ("done", 1.0)

    def stop(stage: str, share: float) -> None:
        raise Cancelled("enough")

    with pytest.raises(Cancelled):
        texrs.inpaint(PEBBLES, HOLE, progress=stop)


def test_same_bytes_for_any_number_of_threads():
    made = []
    for count in (1, 2, 7):
        with texrs.threads(count):
            made.append(texrs.inpaint(PEBBLES, HOLE, boundary_width=2, seed=9))
    for other in made[1:]:
        assert other.image.tobytes() == made[0].image.tobytes()
        assert other.source_map.coordinates.tobytes() == made[0].source_map.coordinates.tobytes()


@pytest.mark.parametrize("wrap", [False, True])
def test_patches_are_in_step_with_a_lattice(wrap):
    rng, (rows, columns) = np.random.default_rng(5), np.indices((156, 182))
    # Each stud has its own brightness, so patches that fit best need not be in step.
    light = rng.uniform(0.3, 1.0, (7, 8))[(rows + 13) // 26 % 6, (columns + 13) // 26 % 7]
    light *= np.hypot((rows + 13) % 26 - 13, (columns + 13) % 26 - 13) < 8
    studs = (light + rng.normal(0, 0.02, light.shape)).astype(np.float32)
    hole = disc(studs.shape, radius=0.25)
    result = texrs.inpaint(studs, hole, wrap=wrap)
    assert result.report["in_step"]
    moved = (result.source_map.coordinates - np.moveaxis(np.indices(studs.shape), 0, -1))[hole] / 26
    assert np.abs(moved).max() > 0.5
    assert np.abs(moved - np.rint(moved)).max() < 0.15
    # This lattice does not continue beyond the borders.
    assert not texrs.inpaint(studs[:143], hole[:143], wrap=True).report["in_step"]
    assert not texrs.inpaint(PEBBLES, HOLE).report["in_step"]


@pytest.mark.parametrize(
    ("lattice", "shown", "reason"),
    [([[1, 2], [2, 4]], 0, "span"), ([[8, 0], [0, 8]], None, "shown"), ([[1, np.nan], [0, 1]], 0, "finite")],
)
def test_bad_lattices_are_refused(lattice, shown, reason):
    image = np.ones((24, 24, 1), np.float32)
    known = np.ones((24, 24), bool)
    known[8:12, 8:12] = False
    with pytest.raises(InvalidInput, match=f"lattice.*{reason}"):
        kernel(image, known, PatchIndex([image]), patch_size=8, lattice=lattice, shown=shown)


def test_what_is_lit_from_one_side_is_not_mirrored_whatever_the_hole_holds():
    noise = np.random.default_rng(3).random((96, 96, 3)).astype(np.float32)
    hole = np.zeros((96, 96), bool)
    hole[30:60, 8:40] = True
    noise[hole] = np.linspace(0, 1, 30 * 32)[:, np.newaxis]
    lit = samples.beans((96, 96)).image
    assert len(choose_mirrors([noise], hole, None)) == 4
    assert choose_mirrors([lit], hole, None) == (NONE,)
    assert choose_mirrors([noise, lit], hole, None) == (NONE,)
    assert [len(choose_mirrors([lit], hole, said)) for said in (True, False)] == [4, 1]
    for picture, mirrored in ((noise, True), (lit, False)):
        result = texrs.inpaint(picture, hole)
        assert result.report["allow_mirror"] is mirrored
        frames = result.source_map.jacobians()
        assert mirrored or (np.diagonal(frames, axis1=-2, axis2=-1) == 1).all()
    assert len(choose_mirrors([noise], np.ones((96, 96), bool), None)) == 4


def test_patches_that_cover_the_hole_are_tried():
    hole = np.zeros((128, 128), bool)
    hole[40:70, 50:80] = True
    sides = [side for side, _ in texrs.inpaint(samples.scales((128, 128)).image, hole).report["candidates"]]
    assert max(sides) > 30
    assert max(sides) <= 1.3 * 30

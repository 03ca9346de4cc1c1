"""Tileable images: no jump across the wrap, a cut that closes on itself, every map in register."""

from __future__ import annotations

import re
from functools import cache

import numpy as np
import pytest

import texrs
from texrs import samples
from texrs._arrays import as_image, guidance
from texrs.errors import Cancelled, InvalidInput
from texrs.kernels import seam
from texrs.tiling import REFUSED, _closed
from texrs.tiling._joints import Choice, find_joint, make_levels
from texrs.tiling._maps import lay_out
from texrs.tiling._whole_elements import find_whole_elements

GENERATED = ("bark", "beans", "bricks", "dots", "leaves_and_flowers", "net", "pebbles", "scales", "weave", "grit")
PHOTOGRAPHS = ("brick", "grass", "gravel", "coffee")


@cache
def picture(name: str, side: int = 256) -> np.ndarray:
    generated = name in GENERATED
    return samples.load(name, size=(side, side)).image if generated else samples.load(name).image[:side, :side]


def jumps(image: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the differences of inner neighbours along an axis, and the differences across the wrap."""
    grey = guidance(as_image(image)).astype(np.float64)
    inner = np.abs(np.diff(grey, axis=axis)).mean(axis=-1)
    return inner, np.abs(np.take(grey, 0, axis) - np.take(grey, -1, axis)).mean(axis=-1)


def worst_run(across: np.ndarray, length: int = 9) -> float:
    """Return the maximum mean of a run along the wrap, which is periodic itself."""
    return float(np.convolve(np.r_[across, across[: length - 1]], np.ones(length) / length, "valid").max())


# --- what cyclic means -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [*GENERATED, *PHOTOGRAPHS])
def test_no_jump_across_the_wrap(name):
    image = picture(name)
    made = texrs.tile(image)
    assert any(jumps(image, a)[1].mean() / jumps(image, a)[0].mean() > 1.8 for a in (0, 1)), "the picture is cyclic"
    for axis in (0, 1):
        inner, across = jumps(made.image, axis)
        assert worst_run(across) <= 2 * np.percentile(inner, 99)
        # In copies side by side, the line at the wrap is not an outlier.
        lines = inner.mean(axis=1 - axis)
        assert across.mean() <= lines.mean() + 3 * lines.std()
    assert max(texrs.check_tiling(made.image).seam) <= 1.5
    # The cut is not visible as a line either.
    for axis in (0, 1):
        lines = jumps(made.image, axis)[0].mean(axis=1 - axis)
        before = jumps(image, axis)[0].mean(axis=1 - axis)
        assert lines.max() <= before.max() * 1.5


@pytest.mark.parametrize("name", ["bricks", "weave", "net", "scales", "pebbles", "beans", "brick"])
def test_searched_joints_cost_less_than_the_usual_one(name):
    image = picture(name)
    cost = []
    for overlap in (None, 50):
        joints = texrs.tile(image, overlap=overlap).report["joints"].values()
        cost.append(sum(j["mean_seam_cost"] for j in joints))
    assert cost[0] < cost[1]


@pytest.mark.parametrize("name", ["weave", "pebbles", "beans", "grass"])
def test_a_joint_followed_from_a_small_picture_is_about_as_cheap_as_the_cheapest(name):
    image = picture(name, 160)
    most = image.shape[1] // 2
    found = find_joint(
        make_levels(guidance(as_image(image)), find_whole_elements(guidance(as_image(image))).depth),
        1,
        Choice(25, most),
        closed=False,
        progress=lambda share: None,
    )
    cost = {
        overlap: texrs.tile(image, wrap=(False, True), overlap=overlap).report["joints"]["columns"]["cost"]
        for overlap in {*range(25, most + 1, 9), found.joint.width}
    }
    assert cost[found.joint.width] == pytest.approx(found.cuts[0].value, rel=1e-3)
    # A cheaper joint may exist, but it loses more of the image, or its parts do not fit.
    assert found.cuts[0].value <= 1.3 * min(cost.values())


def test_few_cuts_are_made_at_the_full_size(monkeypatch):
    full = []
    real = _closed.cut_strips
    monkeypatch.setattr(
        _closed,
        "cut_strips",
        lambda strips, **more: full.extend(s for s in strips if np.shape(s.a)[1] >= 512) or real(strips, **more),
    )
    texrs.tile(np.tile(picture("grit"), (2, 2, 1)))
    # Each attempt cuts at most twice along each axis.
    assert 1 <= len(full) <= 4 * (1 + len(REFUSED))


@pytest.mark.parametrize("name", ["beans", "pebbles"])
def test_cuts_spare_the_inside_of_things(name):
    guide = guidance(as_image(picture(name)))
    # The elements are lighter than the background.
    depth = np.clip((guide.mean(axis=-1) - 0.35) / 0.1, 0, 1).astype(np.float32)
    deep = []
    for given in (0 * depth, depth):
        levels = make_levels(guide, given)
        found = find_joint(levels, 0, Choice(80, 80), closed=False, progress=lambda share: None)
        line, piece = lay_out(256, found)
        shown = depth[line, np.indices(line.shape)[1]]
        deep.append(sum(float(shown[piece != np.roll(piece, 1, axis)].sum()) for axis in range(2)))
    assert deep[1] < 0.9 * deep[0]


def test_regular_patterns_close_exactly():
    unit = np.random.default_rng(3).integers(0, 256, (20, 28, 3), dtype=np.uint8)
    image = np.tile(unit, (7, 6, 1))[:131, :150]
    made = texrs.tile(image)
    rows, columns = made.image.shape[:2]
    assert (rows % 20, columns % 28) == (0, 0)
    np.testing.assert_array_equal(made.image, np.roll(made.image, (20, 28), (0, 1)))


def test_regular_patterns_close_exactly_at_any_size():
    unit = np.random.default_rng(3).integers(0, 256, (37, 53, 3), dtype=np.uint8)
    image = np.tile(unit, (14, 11, 1))[:500, :571]
    made = texrs.tile(image)
    rows, columns = made.image.shape[:2]
    assert (rows % 37, columns % 53) == (0, 0)
    np.testing.assert_array_equal(made.image, np.roll(made.image, (37, 53), (0, 1)))


@pytest.mark.parametrize(("name", "axis", "period"), [("scales", 1, 100.8), ("bricks", 0, 68.0)])
def test_a_lattice_is_cut_at_whole_periods_and_the_report_contains_the_reason(name, axis, period):
    made = texrs.tile(picture(name))
    key = ("rows", "columns")[axis]
    assert made.report["joints"][key]["cover"] == 0
    length = made.image.shape[axis]
    assert (
        made.report["resized"][key]
        == f"256 -> {length} pixels: {round(length / period)} whole periods of about {period}"
    )
    # The result loses less than 1.5 periods, because the overlap is shorter than half a period.
    assert length > 256 - 1.5 * period


@pytest.mark.parametrize("way", ["still", "lattice", "stitch", "cells"])
def test_a_larger_result_is_laid_in_the_given_way(way):
    image = samples.bricks((128, 128)).image
    made = texrs.tile(image, size=216, way=way)
    assert (made.report["way"], made.report["candidates"], made.image.shape) == (way, None, (216, 216, 3))
    assert made.report["tiling"]["columns"]["tiles"]


def test_ways_that_do_not_suit_the_image_or_the_size_are_errors():
    image = samples.pebbles((96, 96)).image
    with pytest.raises(InvalidInput, match="lattice. is not possible: no lattice or single period was found"):
        texrs.tile(image, size=200, way="lattice")
    for size in (None, 64):
        with pytest.raises(InvalidInput, match='way: must be "auto" for a result that is not larger'):
            texrs.tile(image, size=size, way="still")


def test_a_lattice_closes_at_sizes_larger_than_the_picture():
    from scipy.ndimage import gaussian_filter

    unit = gaussian_filter(np.random.default_rng(3).random((40, 56)), 3, mode="wrap")
    image = np.tile((unit - unit.min()) / np.ptp(unit), (5, 4))[:160, :170].astype(np.float32)
    made = texrs.tile(image, size=(205, 285))
    assert made.report["method"] == "quilt"
    assert (made.report["way"], made.report["refused"]) == ("lattice", {})
    # Five periods fit the result along each axis, so they are 41 and 57 pixels long.
    off = np.abs(made.image - np.roll(made.image, (41, 57), (0, 1))).mean()
    assert off < 0.2 * made.image.std(), off / made.image.std()


def test_a_lattice_that_would_change_too_much_is_not_closed():
    tile = np.random.default_rng(3).integers(0, 255, (60, 60, 3), np.uint8)
    made = texrs.tile(np.tile(tile, (4, 4, 1)), size=(250, 90))
    assert made.report["way"] in ("still", "stitch")
    assert "but they fit " in made.report["refused"]["lattice"]


def test_a_seam_that_closes_costs_no_more_than_the_least_one_but_for_little():
    guide = guidance(as_image(picture("pebbles")))
    strip = seam.Strip(guide[-60:], guide[:60], 0, np.full((60, 256), 0.5, np.float32))
    [found] = _closed.cut_overlaps([strip], closed=True)
    [least] = seam.cut_strips([strip], cyclic=True)
    assert least.value * (1 - 1e-3) <= found.value <= 1.05 * least.value
    assert found.mask.shape == (60, 256)
    assert not found.mask[0].any()
    assert found.mask[-1].all()
    again = _closed.measure_cut(strip, least.mask)
    assert (again.value, again.edges) == (pytest.approx(least.value, rel=1e-3), least.edges)


def sheared() -> np.ndarray:
    """Return a smooth image, periodic along its columns, whose ends agree along a slope, and less along a ring."""
    r, c = np.mgrid[:128, :64].astype(np.float32)
    image = 0.3 + 0.05 * np.sin(2 * np.pi * c / 64) + 0.05 * np.sin(2 * np.pi * r / 40)
    row, column = r[:16], c[:16]
    along = np.clip(column, 4, 59)
    away = np.hypot(row - (2 + 8 * (along - 4) / 55), column - along)
    image[:16] = image[-16:] + np.where(row >= 13, 0.08, 0.4 * np.clip((away - 1) / 3, 0, 1)).astype(np.float32)
    return image[..., np.newaxis]


def join_rows(guide: np.ndarray, closed: bool) -> texrs.SourceMap:
    """Return the map of an image whose rows are joined with an overlap of 16."""
    levels = make_levels(guide, np.zeros(guide.shape[:2], np.float32))
    found = find_joint(levels, 0, Choice(16, 16), closed=closed, progress=lambda share: None)
    line, piece = lay_out(guide.shape[1], found)
    coordinates = np.stack([line, np.indices(line.shape)[1]], axis=-1).astype(np.float32)
    return texrs.SourceMap.from_coordinates(coordinates, guide.shape[:2], label=piece)


def test_an_open_second_cut_reopens_the_first_wrap():
    guide, run, torn = sheared(), {}, {}
    for closed in (False, True):
        source = join_rows(guide, closed)
        # Count the rows where the two sides of the wrap come from different ends of the image.
        torn[closed] = int((source.label[:, 0] != source.label[:, -1]).sum())
        inner, across = jumps(source.render(guide), 1)
        run[closed] = worst_run(across) / np.percentile(inner, 99)
    assert torn[True] <= 1
    assert run[True] <= 2
    assert torn[False] >= 6
    assert run[False] > 2


# --- the size --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["grit", "pebbles", "leaves_and_flowers"])
def test_the_size_is_kept_where_a_cover_shows_no_more(name):
    image = picture(name)
    made = texrs.tile(image)
    assert made.image.shape == image.shape
    assert all(j["cover"] > 0 and j["overlap"] == 0 for j in made.report["joints"].values())
    # The cover of the ends is from elsewhere in the image, and covers only the ends.
    assert 0.6 < (made.source_map.reuse().verbatim) <= 1


@pytest.mark.parametrize(
    "size", [(256, 256), (250, 255), (129, 200), (100, 90), (60, 256), (300, 256), (400, 330), 192]
)
def test_any_size_is_exact(size):
    image = picture("beans")
    made = texrs.tile(image, size=size)
    rows, columns = (size, size) if isinstance(size, int) else size
    assert made.image.shape == (rows, columns, 3)
    at = made.source_map.coordinates.astype(int)
    np.testing.assert_array_equal(made.image, image[at[..., 0], at[..., 1]])
    assert max(texrs.check_tiling(made.image).seam) <= 1.5
    assert made.report["method"] == ("quilt" if max(rows, columns) > 256 else "tile")


@pytest.mark.parametrize(
    ("size", "wrap"), [((100, 70), (True, False)), ((60, 96), (False, True)), (50, (False, False))]
)
def test_an_axis_that_does_not_wrap_keeps_its_middle(size, wrap):
    image = picture("pebbles", 96)
    made = texrs.tile(image, size=size, wrap=wrap)
    sides = (size, size) if isinstance(size, int) else size
    assert made.image.shape == (*sides, 3)
    if sides[0] > 96:
        return
    for axis in (0, 1):
        if not wrap[axis]:
            first = (96 - sides[axis]) // 2
            assert (made.source_map.coordinates[..., axis] == np.indices(sides)[axis] + first).all()


@pytest.mark.parametrize("shape", [(2, 2), (2, 9), (3, 3), (5, 64), (8, 8)])
def test_smallest_pictures_of_any_size(shape):
    image = np.random.default_rng(0).integers(0, 256, shape, dtype=np.uint8)
    for size in (shape, (2, 2), tuple(max(2, n - 1) for n in shape)):
        assert texrs.tile(image, size=size).image.shape == size
    if min(shape) >= 8:
        assert texrs.tile(image, size=33).image.shape == (33, 33)


@pytest.mark.parametrize("wrap", [(True, False), (False, True), (False, False)])
def test_axes_that_do_not_wrap_keep_their_size(wrap):
    image = picture("pebbles", 96)
    made = texrs.tile(image, wrap=wrap, overlap=20)
    assert made.image.shape == (96 - 20 * wrap[0], 96 - 20 * wrap[1], 3)
    for axis in (0, 1):
        if not wrap[axis]:
            assert made.report["overlap"][axis] == 0
            assert (made.source_map.coordinates[..., axis] == np.indices(made.source_map.shape)[axis]).all()
    if wrap == (False, False):
        np.testing.assert_array_equal(made.image, image)


def test_every_pixel_of_the_result_keeps_its_neighbours_but_at_the_cut():
    made = texrs.tile(picture("pebbles", 128), overlap=(30, 24))
    pieces = made.stages["source_regions"]
    for axis in (0, 1):
        torn = ~made.source_map.is_coherent(axis)
        change = pieces != np.roll(pieces, -1, axis)
        np.testing.assert_array_equal(torn.swapaxes(0, axis)[:-1], change.swapaxes(0, axis)[:-1])


# --- any array -------------------------------------------------------------------------------------------------------


def test_every_map_in_register():
    image = picture("pebbles", 96)
    stack = [image, image.astype(np.uint16) * 257, image.astype(np.float32) * (4 / 255), image[..., 0] > 90]
    made = [texrs.tile(each, overlap=24) for each in stack]
    for each, result in zip(stack, made, strict=True):
        assert result.image.dtype == each.dtype
        at = result.source_map.coordinates.astype(int)
        np.testing.assert_array_equal(result.image, each[at[..., 0], at[..., 1]])
    np.testing.assert_array_equal(made[0].source_map.coordinates, made[1].source_map.coordinates)
    np.testing.assert_array_equal(made[1].image, made[0].image.astype(np.uint16) * 257)


@pytest.mark.parametrize("channels", [None, 1, 2, 4, 7])
def test_any_number_of_channels(channels):
    grey = picture("pebbles", 64)[..., 0]
    image = grey if channels is None else np.stack([np.roll(grey, c, axis=0) for c in range(channels)], axis=-1)
    made = texrs.tile(image, overlap=10)
    assert made.image.shape == ((54, 54) if channels is None else (54, 54, channels))


def test_constant_stays_constant():
    made = texrs.tile(np.full((40, 50, 3), 7, np.uint8))
    assert (made.image == 7).all()
    assert made.image.shape == (40, 50, 3)  # All cuts cost the same, so nothing is lost.


@pytest.mark.parametrize("shape", [(2, 2), (2, 9), (3, 3), (5, 64), (64, 5)])
def test_smallest_pictures(shape):
    image = np.random.default_rng(0).integers(0, 256, shape, dtype=np.uint8)
    made = texrs.tile(image)
    assert made.image.shape == tuple(n - m for n, m in zip(shape, made.report["overlap"], strict=True))
    half = texrs.tile(image, overlap=[n // 2 for n in shape])
    assert half.image.shape == tuple(n - n // 2 for n in shape)
    assert texrs.tile(image, overlap=1).image.shape == tuple(n - 1 for n in shape)


# --- errors and running ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"overlap": 0}, "overlap: must be an integer between 1 and 20, got 0"),
        ({"overlap": 21}, "between 1 and 20, got 21 (at most half of the 40 rows)"),
        ({"overlap": (4, 26)}, "between 1 and 25, got 26 (at most half of the 50 columns)"),
        ({"overlap": 2.5}, "overlap: must be an integer"),
        ({"overlap": "8"}, "overlap: must be an integer"),
        ({"overlap": True}, "overlap: must be an integer"),
        ({"size": 30, "overlap": 4}, "overlap: cannot be combined with size"),
        ({"size": (1, 30)}, "size: must have at least 2 rows to wrap them, got 1"),
    ],
)
def test_arguments_are_checked(options, words):
    with pytest.raises(InvalidInput, match=re.escape(words)):
        texrs.tile(np.zeros((40, 50), np.uint8), **options)


@pytest.mark.parametrize(
    ("image", "words"),
    [
        (np.zeros((8, 8, 80), np.uint8), "a volume is not an image"),
        (np.zeros((1, 8), np.uint8), "at least 2 rows"),
        ([["a"]], "image: must contain integers, floats or bool"),
    ],
)
def test_images_are_checked(image, words):
    with pytest.raises(InvalidInput, match=words):
        texrs.tile(image)


def test_a_few_pixels_are_not_extended():
    with pytest.raises(InvalidInput, match="if the image has a side below 8 pixels, got 40"):
        texrs.tile(np.zeros((7, 60), np.uint8), size=40)


def test_an_axis_that_does_not_wrap_has_no_limit():
    assert texrs.tile(np.zeros((1, 40), np.uint8), wrap=(False, True), overlap=20).image.shape == (1, 20)


def test_progress_and_cancel():
    seen = []
    image = picture("pebbles", 40)
    texrs.tile(image, progress=lambda stage, share: seen.append((stage, share)))
    stages = list(dict.fromkeys(stage for stage, _ in seen))
    assert stages == ["segment", "join columns", "join rows", "done"]
    assert all(0 <= share <= 1 for _, share in seen)

    def stop(stage: str, share: float) -> None:
        if stage == "join rows":
            raise Cancelled("enough")

    with pytest.raises(Cancelled):
        texrs.tile(image, progress=stop)


def test_same_bytes_for_any_number_of_threads():
    image = picture("pebbles", 120)
    made = []
    for count in (1, 2, 7):
        with texrs.threads(count):
            made.append(texrs.tile(image))
    for other in made[1:]:
        assert other.image.tobytes() == made[0].image.tobytes()
        assert other.source_map.coordinates.tobytes() == made[0].source_map.coordinates.tobytes()


def test_an_exemplar_is_tiled_as_its_array():
    image = picture("pebbles", 96)
    np.testing.assert_array_equal(texrs.tile(texrs.Exemplar(image)).image, texrs.tile(image).image)


def test_seams_can_be_blended():
    pebbles = samples.pebbles((96, 96)).image
    plain, blended = texrs.tile(pebbles, overlap=12), texrs.tile(pebbles, overlap=12, screening=0.05)
    assert (blended.stages["before_blending"] == plain.image).all()
    assert (blended.image != plain.image).any()
    assert blended.report["screening"] == 0.05
    with pytest.raises(InvalidInput, match="screening"):
        texrs.tile(pebbles, screening=-1)

"""Cyclic pictures: no jump across the wrap, a cut that closes on itself, every map in register."""

from __future__ import annotations

import re
from functools import cache

import numpy as np
import pytest

import texrs
from texrs import samples
from texrs import tiling as cyclic
from texrs._arrays import as_image, guidance
from texrs.errors import Cancelled, InvalidInput

GENERATED = ("bark", "beans", "bricks", "dots", "leaves_and_flowers", "net", "pebbles", "scales", "weave", "grit")
PHOTOGRAPHS = ("brick", "grass", "gravel", "coffee")


@cache
def picture(name: str, side: int = 256) -> np.ndarray:
    return samples.load(name, size=(side, side)).image if name in GENERATED else samples.load(name).image[:256, :256]


def jumps(image: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the differences of neighbours along an axis inside, and those across the wrap."""
    grey = guidance(as_image(image)).astype(np.float64)
    inner = np.abs(np.diff(grey, axis=axis)).mean(axis=-1)
    return inner, np.abs(np.take(grey, 0, axis) - np.take(grey, -1, axis)).mean(axis=-1)


def worst_run(across: np.ndarray, length: int = 9) -> float:
    """Return the largest mean of a run of the wrap, which is itself cyclic."""
    return float(np.convolve(np.r_[across, across[: length - 1]], np.ones(length) / length, "valid").max())


# --- what cyclic means -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [*GENERATED, *PHOTOGRAPHS])
def test_no_jump_across_the_wrap(name):
    image = picture(name)
    made = texrs.tile(image)
    assert any(jumps(image, a)[1].mean() / jumps(image, a)[0].mean() > 1.8 for a in (0, 1)), "the picture is cyclic"
    for axis in (0, 1):
        inner, across = jumps(made.image, axis)
        assert across.mean() / inner.mean() <= 1.5
        assert worst_run(across) <= 2 * np.percentile(inner, 99)
        # Copies side by side: the line at the wrap is no outlier among all lines.
        lines = inner.mean(axis=1 - axis)
        assert across.mean() <= lines.mean() + 3 * lines.std()
    # Neither does the cut show as a line of its own.
    for axis in (0, 1):
        lines = jumps(made.image, axis)[0].mean(axis=1 - axis)
        before = jumps(image, axis)[0].mean(axis=1 - axis)
        assert lines.max() <= before.max() * 1.5


@pytest.mark.parametrize("name", ["bricks", "weave", "net", "scales", "pebbles", "beans", "brick"])
def test_searched_overlap_costs_less_than_the_usual_one(name):
    image = picture(name)
    cost = [
        sum(j["cost"] for j in texrs.tile(image, overlap=overlap).report["joints"].values())
        for overlap in (None, cyclic.OVERLAP)
    ]
    assert cost[0] < cost[1]


def test_regular_patterns_close_exactly():
    unit = np.random.default_rng(3).integers(0, 256, (20, 28, 3), dtype=np.uint8)
    image = np.tile(unit, (7, 6, 1))[:131, :150]
    made = texrs.tile(image)
    rows, columns = made.image.shape[:2]
    assert (rows % 20, columns % 28) == (0, 0)
    np.testing.assert_array_equal(made.image, np.roll(made.image, (20, 28), (0, 1)))


def sheared() -> np.ndarray:
    """Return a smooth picture, cyclic along its columns, whose ends agree along a slope, and less along a ring."""
    r, c = np.mgrid[:128, :64].astype(np.float32)
    image = 0.3 + 0.05 * np.sin(2 * np.pi * c / 64) + 0.05 * np.sin(2 * np.pi * r / 40)
    row, column = r[:16], c[:16]
    along = np.clip(column, 4, 59)
    away = np.hypot(row - (2 + 8 * (along - 4) / 55), column - along)
    image[:16] = image[-16:] + np.where(row >= 13, 0.08, 0.4 * np.clip((away - 1) / 3, 0, 1)).astype(np.float32)
    return image[..., np.newaxis]


def test_an_open_second_cut_reopens_the_first_wrap():
    guide, run, torn = sheared(), {}, {}
    for closed in (False, True):
        source = cyclic.join(guide, 0, range(16, 17), closed=closed).source
        # Rows in which the two sides of the wrap come from different ends of the picture.
        torn[closed] = int((source.label[:, 0] != source.label[:, -1]).sum())
        inner, across = jumps(source.render(guide), 1)
        run[closed] = worst_run(across) / np.percentile(inner, 99)
    assert torn[True] <= 1
    assert run[True] <= 2
    assert torn[False] >= 6
    assert run[False] > 2


@pytest.mark.parametrize("wrap", [(True, False), (False, True), (False, False)])
def test_axes_that_do_not_wrap_keep_their_size(wrap):
    image = picture("pebbles", 96)
    made = texrs.tile(image, wrap=wrap, overlap=20)
    assert made.image.shape == (96 - 20 * wrap[0], 96 - 20 * wrap[1], 3)
    for axis in (0, 1):
        if not wrap[axis]:
            assert made.report["overlap"][axis] == 0
            assert (made.source.coordinates[..., axis] == np.indices(made.source.shape)[axis]).all()
    if wrap == (False, False):
        np.testing.assert_array_equal(made.image, image)


def test_every_pixel_of_the_result_keeps_its_neighbours_but_at_the_cut():
    made = texrs.tile(picture("pebbles", 128), overlap=(30, 24))
    pieces = made.stages["pieces"]
    for axis in (0, 1):
        torn = ~made.source.continues(axis)
        change = pieces != np.roll(pieces, -1, axis)
        np.testing.assert_array_equal(torn.swapaxes(0, axis)[:-1], change.swapaxes(0, axis)[:-1])


# --- any array -------------------------------------------------------------------------------------------------------


def test_every_map_in_register():
    image = picture("pebbles", 96)
    stack = [image, image.astype(np.uint16) * 257, image.astype(np.float32) * (4 / 255), image[..., 0] > 90]
    made = [texrs.tile(each, overlap=24) for each in stack]
    for each, result in zip(stack, made, strict=True):
        assert result.image.dtype == each.dtype
        at = result.source.coordinates.astype(int)
        np.testing.assert_array_equal(result.image, each[at[..., 0], at[..., 1]])
    np.testing.assert_array_equal(made[0].source.coordinates, made[1].source.coordinates)
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
    assert made.report["overlap"] == [5, 6]  # All cuts cost the same, so the least is lost.


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
        ({"overlap": 0}, "overlap: needs an integer from 1 to 20, got 0"),
        ({"overlap": 21}, "from 1 to 20, got 21: at most half of the 40 rows"),
        ({"overlap": (4, 26)}, "from 1 to 25, got 26: at most half of the 50 columns"),
        ({"overlap": 2.5}, "overlap: needs an integer"),
        ({"overlap": (3, 4, 5)}, "overlap: needs one number or"),
        ({"overlap": "8"}, "overlap: needs an integer"),
        ({"overlap": True}, "overlap: needs an integer"),
        ({"wrap": "xy"}, "wrap: needs"),
        ({"wrap": (True,)}, "wrap: needs"),
    ],
)
def test_arguments_are_checked(options, words):
    with pytest.raises(InvalidInput, match=re.escape(words)):
        texrs.tile(np.zeros((40, 50), np.uint8), **options)


@pytest.mark.parametrize(
    ("image", "words"),
    [
        (np.zeros((8, 8, 8, 3), np.uint8), "a volume is not an image"),
        (np.zeros((8, 8, 80), np.uint8), "a volume is not an image"),
        (np.zeros((1, 8), np.uint8), "at least 2 rows"),
        (np.zeros((0, 8), np.uint8), "image: each side"),
        (np.full((8, 8), np.nan), "NaN"),
        ([["a"]], "image: needs numbers"),
    ],
)
def test_images_are_checked(image, words):
    with pytest.raises(InvalidInput, match=words):
        texrs.tile(image)


def test_an_axis_that_does_not_wrap_has_no_limit():
    assert texrs.tile(np.zeros((1, 40), np.uint8), wrap=(False, True), overlap=20).image.shape == (1, 20)


def test_progress_and_cancel():
    seen = []
    texrs.tile(np.zeros((40, 40), np.uint8), progress=lambda stage, share: seen.append((stage, share)))
    stages = list(dict.fromkeys(stage for stage, _ in seen))
    assert stages == ["join columns", "join rows", "done"]
    assert all(0 <= share <= 1 for _, share in seen)

    def stop(stage: str, share: float) -> None:
        if stage == "join rows":
            raise Cancelled("enough")

    with pytest.raises(Cancelled):
        texrs.tile(np.zeros((40, 40), np.uint8), progress=stop)


def test_same_bytes_for_any_number_of_threads():
    image = picture("pebbles", 120)
    made = []
    for count in (1, 2, 7):
        with texrs.threads(count):
            made.append(texrs.tile(image))
    for other in made[1:]:
        assert other.image.tobytes() == made[0].image.tobytes()
        assert other.source.coordinates.tobytes() == made[0].source.coordinates.tobytes()


def test_an_exemplar_is_tiled_as_its_array():
    image = picture("pebbles", 96)
    np.testing.assert_array_equal(texrs.tile(texrs.Exemplar(image)).image, texrs.tile(image).image)

"""Edits of a texture's own layout in another size: facts about the sample must hold for the larger image."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import texrs
from texrs import samples
from texrs.elements import ElementAnalysis
from texrs.errors import InvalidInput, LimitExceeded
from texrs.point_sets import nearest_distances, spacing


@cache
def entry(name: str, size: tuple[int, int] = (128, 128)) -> ElementAnalysis:
    return ElementAnalysis.of_sample(samples.load(name, size=size))


NAMES = ("dots", "pebbles", "net", "bricks")
LARGE = (192, 208)


@pytest.mark.parametrize("name", NAMES)
def test_the_layout_goes_on(name: str) -> None:
    mine = entry(name)
    result = texrs.self_splice(mine, size=LARGE, seed=1)
    assert result.image.shape == (*LARGE, 3)
    assert (result.report["edit"], result.stages["resized"] is result.image) == ([], True)
    points = np.array(result.report["elements"])
    assert spacing(points) == pytest.approx(spacing(mine.points), rel=0.2)
    # The number of elements fits the area, and no margin is empty: an element is within a spacing of each side. The
    # centres of cut cells are in the image. For other elements, only the centres of whole ones are.
    count = len(mine.points) if mine.known is None else int(mine.known.max())
    share = len(points) / count / (LARGE[0] * LARGE[1] / 128**2)
    assert share == pytest.approx(1.0, abs=0.25)
    edge = 1.6 * spacing(mine.points)
    assert (points.min(axis=0) < edge).all()
    assert (points.max(axis=0) > np.array(LARGE) - edge).all()


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("edit", [None, {"op": "randomise", "amount": 0.1}])
def test_the_map_looks_into_the_texture(name: str, edit: Any) -> None:
    mine = entry(name)
    result = texrs.self_splice(mine, edit, LARGE, seed=1, screening=None)
    assert result.source_map.shapes == ((128, 128),)
    np.testing.assert_array_equal(result.source_map.render(mine.image), result.image)
    # The map shows an element at each element's place, according to the mask, which is independent of the image.
    shown = result.source_map.render(mine.mask, interpolation="nearest")
    assert shown.mean() == pytest.approx(mine.mask.mean(), abs=0.12)


def test_every_separate_element_is_shown_whole() -> None:
    sample = samples.load("dots", size=(128, 128))
    mine = ElementAnalysis.of_sample(sample)
    assert sample.labels is not None
    result = texrs.self_splice(mine, size=LARGE, seed=1)
    whole = np.bincount(sample.labels.ravel())
    shown = 0
    for match in result.report["matches"]:
        row, column = match["found"]
        if not (16 <= row < LARGE[0] - 16 and 16 <= column < LARGE[1] - 16):
            continue
        window = (slice(round(row) - 16, round(row) + 17), slice(round(column) - 16, round(column) + 17))
        places = result.source_map.coordinates[window].astype(np.intp)
        owner = sample.labels[places[..., 0], places[..., 1]]
        number = sample.labels[tuple(np.rint(match["point"]).astype(int))]
        seen = np.unique(places[owner == number], axis=0)
        assert len(seen) >= 0.97 * whole[number]
        shown += 1
    assert shown >= 15


def test_steps_are_done_in_the_larger_texture() -> None:
    mine = entry("dots")
    plain = texrs.self_splice(mine, size=LARGE, seed=1)
    points = np.array(plain.report["elements"])
    inner = int(np.hypot(*(points - np.array(LARGE) / 2).T).argmin())
    free = {"op": "remove", "element": inner}
    result = texrs.self_splice(mine, free, LARGE, seed=1)
    assert result.report["elements"] == plain.report["elements"]
    left = np.array([match["found"] for match in result.report["matches"]])
    assert nearest_distances(points[[inner]], 1, left)[0, 0] > 0.7 * spacing(points)
    row, column = points[inner].astype(int)
    assert plain.source_map.render(mine.mask, interpolation="nearest")[row, column]
    assert not result.source_map.render(mine.mask, interpolation="nearest")[row, column]
    # Pixels far from the removed element do not change.
    np.testing.assert_array_equal(result.image[:20, :20], plain.image[:20, :20])
    again = texrs.self_splice(mine, result.report["edit"], LARGE, seed=1)
    np.testing.assert_array_equal(again.image, result.image)


@pytest.mark.parametrize("name", NAMES)
def test_a_smaller_one_is_the_middle(name: str) -> None:
    mine = entry(name)
    result = texrs.self_splice(mine, size=(96, 100))
    np.testing.assert_array_equal(result.image, mine.image[16:112, 14:114])
    same = texrs.self_splice(mine, size=128)
    np.testing.assert_array_equal(same.image, mine.image)
    assert "elements" not in same.report
    moved = texrs.self_splice(mine, "randomise", (96, 100), seed=1)
    assert moved.image.shape == (96, 100, 3)
    assert (moved.image != result.image).any()


@pytest.mark.parametrize(
    ("size", "error", "words"),
    [
        (8, InvalidInput, "size: each side"),
        ("big", InvalidInput, "size: must be"),
        ((64,), InvalidInput, "size: must be"),
        ((64.5, 64), InvalidInput, "size: must be"),
        ((-3, 64), InvalidInput, "size: each side"),
        ((10**6, 10**6), LimitExceeded, "size:"),
    ],
)
def test_bad_sizes_are_refused(size: Any, error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        texrs.self_splice(entry("dots"), size=size)


def test_a_size_without_elements_has_no_layout_to_edit() -> None:
    assert texrs.self_splice(entry("dots"), size=16).image.shape == (16, 16, 3)
    with pytest.raises(
        InvalidInput, match=r"size: must be large enough for the \d elements .* got \(16, 16\), .* is 0"
    ):
        texrs.self_splice(entry("dots"), "randomise", 16)


@pytest.mark.parametrize("method", ["paper", "preview"])
def test_methods_take_sizes(method: Any) -> None:
    assert texrs.self_splice(entry("net"), "regularise", (160, 144), method=method).image.shape == (160, 144, 3)

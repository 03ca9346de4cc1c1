"""Edits of separate elements: unmoved ones stay, gaps are filled with background, new ones are whole; and light."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import binary_dilation, gaussian_filter

import texrs
from texrs import samples
from texrs.elements import ElementAnalysis, Layout
from texrs.papers.splice.foreground import split_foreground
from texrs.papers.splice.ground import survey

BUTTONS = ElementAnalysis.of_sample(samples.load("dots", size=(192, 192)))
SIDE, RADIUS = 160, 9


def make_discs(*, light: float = 0.0, noise: float = 0.02, share: float = 1.0) -> ElementAnalysis:
    """Return discs on a rough background, in a light that grows from left to right and partly affects the discs."""
    rng = np.random.default_rng(4)
    rows, columns = np.indices((SIDE, SIDE))
    centres = np.array(
        [[20 + 40 * i + rng.integers(-4, 5), 20 + 40 * j + rng.integers(-4, 5)] for i in range(4) for j in range(4)]
    )
    mask = np.zeros((SIDE, SIDE), bool)
    for row, column in centres:
        mask |= (rows - row) ** 2 + (columns - column) ** 2 <= RADIUS**2
    lit = light * (columns / SIDE - 0.5)
    image = np.where(mask, 0.7 + share * lit, 0.4 + rng.normal(0, noise, mask.shape) + lit)
    pixels = np.rint(255 * np.stack([image] * 3, axis=-1).clip(0, 1)).astype(np.uint8)
    box = (2 * RADIUS + 1, 2 * RADIUS + 1)
    return ElementAnalysis(pixels, centres.astype(float), mask, box, Layout.DISJOINT, np.ones(len(centres)))


def find_middle(a: ElementAnalysis) -> int:
    return int(np.hypot(*(a.points - np.array(a.mask.shape) / 2).T).argmin())


def count_elements(result: texrs.Synthesis, a: ElementAnalysis) -> np.ndarray[Any, np.dtype[np.intp]]:
    """Return how many pixels of each target's element the result shows."""
    core = split_foreground(a).core > 0
    rows, columns = np.moveaxis(result.source_map.coordinates.astype(int), -1, 0)
    return np.bincount(result.source_map.label.astype(int)[core[rows, columns]], minlength=1)[1:]


@pytest.mark.parametrize("op", ["move", "remove"])
def test_all_but_one_element_keeps_its_bytes(op: str) -> None:
    one = find_middle(BUTTONS)
    step = {"op": op, "element": one} | ({"by": [0, 25]} if op == "move" else {})
    result = texrs.self_splice(BUTTONS, step, seed=1)
    near = binary_dilation(split_foreground(BUTTONS).region == one + 1, iterations=16)
    near |= np.roll(near, 25, axis=1)
    np.testing.assert_array_equal(result.image[~near], BUTTONS.image[~near])
    assert 0 < result.report["changed"] < 0.05


def test_moved_elements_keep_their_colours_above_others() -> None:
    one = find_middle(BUTTONS)
    other = int(np.argsort(np.hypot(*(BUTTONS.points - BUTTONS.points[one]).T))[1])
    step = {"op": "move", "element": one, "to": (BUTTONS.points[other] + [5, 3]).tolist()}
    result = texrs.self_splice(BUTTONS, step, seed=1)
    rows, columns = np.moveaxis(result.source_map.coordinates.astype(int), -1, 0)
    core = split_foreground(BUTTONS).core[rows, columns] == one + 1
    assert core.sum() > 100
    np.testing.assert_array_equal(result.image[core], BUTTONS.image[rows, columns][core])


@pytest.mark.parametrize("edit", [{"op": "rows", "by": 12}, {"op": "shift", "by": 14}, {"op": "scale", "factor": 0.85}])
def test_margins_of_dense_textures_are_full(edit: dict[str, Any]) -> None:
    """Pebbles leave hardly any background visible. The layout continues, and is not mirrored at pixels."""
    stones = ElementAnalysis.of_sample(samples.load("pebbles", size=(192, 192)))
    result = texrs.self_splice(stones, edit, seed=1)
    shown = result.source_map.label > 0
    sides = (shown[:16], shown[-16:], shown[:, :16], shown[:, -16:])
    assert min(side.mean() for side in sides) > 0.6 * shown[32:-32, 32:-32].mean()


def test_what_was_removed_leaves_ground_alone() -> None:
    mine = make_discs(light=0.5)
    one = find_middle(mine)
    result = texrs.self_splice(mine, {"op": "remove", "element": one}, seed=1)
    gone = split_foreground(mine).core == one + 1
    rows, columns = result.source_map.coordinates.astype(int)[gone].T
    assert not mine.mask[rows, columns].any()
    # The place of a removed disc is as bright as the background around it.
    around = binary_dilation(gone, iterations=8) & ~binary_dilation(gone, iterations=3)
    here, there = (float(result.image[where].mean()) for where in (gone, around))
    assert abs(here - there) < 3


@pytest.mark.parametrize("edit", ["randomise", "regularise", {"op": "rows", "by": 10}, {"op": "scale", "factor": 0.9}])
def test_nothing_is_cut_but_by_the_border(edit: Any) -> None:
    mine = make_discs()
    result = texrs.self_splice(mine, edit, seed=2)
    found = np.array([m["found"] for m in result.report["matches"]])
    inside = ((found > RADIUS + 2) & (found < SIDE - RADIUS - 3)).all(axis=1)
    shown = np.pad(count_elements(result, mine), (0, len(found)))[: len(found)]
    whole = np.bincount(split_foreground(mine).core.ravel())[1:].min()
    assert inside.sum() >= 9
    assert (shown[inside] >= 0.97 * whole).all()


@pytest.mark.parametrize("edit", [{"op": "shift", "by": [10, 15]}, {"op": "rows", "by": 10}])
def test_elements_that_come_in_are_whole(edit: dict[str, Any]) -> None:
    """Cut elements keep their straight edge at the border. No such edge is inside the image."""
    result = texrs.self_splice(BUTTONS, edit, seed=1)
    parts, label = split_foreground(BUTTONS), result.source_map.label.astype(int)
    element = np.array([m["element"] for m in result.report["matches"]])
    border = np.unique(np.concatenate([label[0], label[-1], label[:, 0], label[:, -1]]))
    inner = np.setdiff1d(np.unique(label), np.append(border, 0)) - 1
    assert len(inner) > 20
    assert parts.whole[element[inner]].all()
    # Remains of cut elements are only at the border.
    rows, columns = np.moveaxis(result.source_map.coordinates.astype(int), -1, 0)
    assert not (BUTTONS.mask[rows, columns] & (label == 0))[12:-12, 12:-12].any()


def test_a_margin_that_opens_is_as_full_as_the_rest() -> None:
    result = texrs.self_splice(BUTTONS, {"op": "shift", "by": [24, 24]}, seed=1)
    shown = result.source_map.label > 0
    assert shown[:24].mean() > 0.5 * BUTTONS.mask.mean()
    assert shown[:, :24].mean() > 0.5 * BUTTONS.mask.mean()


def test_moved_elements_lie_above_the_others() -> None:
    mine = make_discs()
    one = find_middle(mine)
    other = int(np.argsort(np.hypot(*(mine.points - mine.points[one]).T))[1])
    to = (mine.points[other] + [6, 0]).tolist()
    result = texrs.self_splice(mine, {"op": "move", "element": one, "to": to}, seed=1)
    number = [m["element"] for m in result.report["matches"]].index(one)
    whole = int((split_foreground(mine).core == one + 1).sum())
    assert count_elements(result, mine)[number] == whole


def test_light_is_left_where_it_is() -> None:
    mine = make_discs(light=0.5)
    assert survey(mine).light is not None
    result = texrs.self_splice(mine, {"op": "randomise", "amount": 0.6}, seed=3)
    ground = ~binary_dilation(result.source_map.label > 0, iterations=5)
    lit = 255 * (0.4 + 0.5 * (np.arange(SIDE) / SIDE - 0.5))
    away = gaussian_filter(np.where(ground, result.image[..., 0] - lit, 0.0), 3)
    assert np.abs(away[ground]).max() < 12
    rows, columns = np.moveaxis(result.source_map.coordinates.astype(int), -1, 0)
    discs = mine.mask[rows, columns]
    bright = result.image[..., 0] - 255 * 0.7 - (lit - 255 * 0.4)
    assert np.abs(np.median(bright[discs])) < 5
    assert np.percentile(np.abs(bright[discs]), 80) < 15


def test_how_much_light_falls_on_elements_is_measured() -> None:
    for share in (0.0, 0.5, 1.0):
        light = survey(make_discs(light=0.5, share=share)).light
        assert light is not None
        assert abs(light.share - share) < 0.2


def test_texture_is_no_light() -> None:
    assert survey(make_discs(light=0.02)).light is None
    assert survey(BUTTONS).light is None
    signed = make_discs(light=0.5)
    assert survey(replace(signed, image=signed.image.astype(np.int16))).light is None


@pytest.mark.parametrize("kind", ["grey", "alpha", "uint16", "float", "signed range"])
def test_any_picture_in_uneven_light(kind: str) -> None:
    mine = make_discs(light=0.5)
    image: Any = mine.image
    if kind == "grey":
        image = image[..., 0]
    elif kind == "alpha":
        image = np.dstack([image, np.where(mine.mask, 255, 200).astype(np.uint8)])
    elif kind == "uint16":
        image = image.astype(np.uint16) * 257
    elif kind == "float":
        image = image.astype(np.float32) / 255
    else:
        image = image.astype(np.float64) * 8 - 700
    mine = replace(mine, image=image)
    edited = texrs.self_splice(mine, {"op": "rows", "by": 8}, seed=1)
    spliced = texrs.splice(mine, BUTTONS, (140, 200), seed=1)
    for result in (edited, spliced):
        assert result.image.dtype == image.dtype
        assert result.image.shape[2:] == image.shape[2:]
        assert result.image.min() >= image.min()
        assert result.image.max() <= image.max()
    if kind == "alpha":
        alpha = edited.source_map.render(image[..., 3], interpolation="nearest")
        np.testing.assert_array_equal(edited.image[..., 3], alpha)
    still = texrs.self_splice(mine, {"op": "shift", "by": 0})
    np.testing.assert_array_equal(still.image, image)


def test_without_correction_it_is_the_texture_looked_up() -> None:
    mine = make_discs(light=0.5)
    result = texrs.self_splice(mine, "randomise", seed=1, screening=None)
    np.testing.assert_array_equal(result.image, result.source_map.render(mine.image, interpolation="nearest"))
    assert result.report["screening"] == 0


def test_no_strength_keeps_what_the_border_cuts() -> None:
    result = texrs.splice(
        BUTTONS, ElementAnalysis.of_sample(samples.load("pebbles", size=(192, 192))), strength=0, seed=1
    )
    np.testing.assert_array_equal(result.image, BUTTONS.image)
    assert len(result.report["matches"]) == len(split_foreground(BUTTONS).points)


def test_a_texture_that_wraps_goes_on_around() -> None:
    sample = samples.load("dots", size=(160, 160), wrap=True)
    mine = replace(ElementAnalysis.of_sample(sample), wrap=(True, True))
    moved = texrs.self_splice(mine, {"op": "shift", "by": [30, 50]}, seed=1).image
    np.testing.assert_array_equal(moved, np.roll(mine.image, (30, 50), axis=(0, 1)))


def test_the_same_seed_gives_the_same_bytes() -> None:
    made = []
    for count in (1, 2):
        with texrs.threads(count):
            made.append(texrs.self_splice(BUTTONS, ["randomise", {"op": "scale", "factor": 0.9}], seed=3))
    np.testing.assert_array_equal(made[0].image, made[1].image)
    np.testing.assert_array_equal(made[0].source_map.label, made[1].source_map.label)


def test_of_a_texture_without_elements_the_ground_is_left() -> None:
    mine = make_discs()
    result = texrs.self_splice(mine, [{"op": "remove", "element": i} for i in range(len(mine.points))], seed=1)
    rows, columns = np.moveaxis(result.source_map.coordinates.astype(int), -1, 0)
    assert not mine.mask[rows, columns].any()
    assert result.report["matches"] == []


@pytest.mark.parametrize("step", ["move", "remove"])
def test_edits_as_printed(step: str) -> None:
    one = find_middle(BUTTONS)
    edit = {"op": step, "element": one} | ({"by": [0, 12]} if step == "move" else {})
    result = texrs.self_splice(BUTTONS, edit, seed=1, method="paper")
    assert result.report["method"] == "paper"
    found = {m["element"]: m["found"] for m in result.report["matches"]}
    if step == "move":
        np.testing.assert_allclose(found[one], BUTTONS.points[one] + [0, 12], atol=0.51)
    else:
        assert one not in found


def test_ground_is_as_rough_as_it_was() -> None:
    """The smoothest patches fit best. Without a weight of roughness, a background loses 20 % of its roughness."""
    mine = make_discs(noise=0.08)
    image = mine.image.copy()
    smooth = (np.indices(mine.mask.shape)[1] // 40) % 2 == 1
    image[smooth & ~mine.mask] = 102
    mine = replace(mine, image=image)

    def measure(image: Any, ground: Any) -> float:
        steep = np.hypot(*np.gradient(image[..., 0].astype(float)))
        return float(steep[~binary_dilation(~ground, iterations=4)].mean())

    result = texrs.splice(mine, BUTTONS, (160, 160), seed=1)
    assert measure(result.image, result.source_map.label == 0) > 0.93 * measure(mine.image, ~mine.mask)

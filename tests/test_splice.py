"""Splicing: the checks of the specification on samples with known elements, and user errors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import binary_dilation, find_objects, label

import splice_checks as checks
import texrs
from reference.look_up import view
from texrs import samples
from texrs.elements import ElementAnalysis, Layout
from texrs.errors import InvalidInput
from texrs.papers.splice.energy import minimise_energy
from texrs.papers.splice.factors import _FACTORS

SIZE = (192, 192)


@cache
def entry(name: str, seed: int = 0, size: tuple[int, int] = SIZE) -> ElementAnalysis:
    return ElementAnalysis.of_sample(samples.load(name, size=size, seed=seed))


PAIRS = [("dots", "pebbles"), ("dots", "bricks"), ("pebbles", "dots"), ("leaves_and_flowers", "pebbles")]


@pytest.fixture(scope="module")
def spliced() -> Callable[[str, str], texrs.Synthesis]:
    made: dict[tuple[str, str], texrs.Synthesis] = {}

    def get(a: str, b: str) -> texrs.Synthesis:
        if (a, b) not in made:
            made[a, b] = texrs.splice(entry(a), entry(b), use_cells=False, seed=1, screening=None)
        return made[a, b]

    return get


@pytest.mark.parametrize(("a", "b"), PAIRS)
def test_every_element_is_there_whole_and_in_its_place(a: str, b: str, spliced: Any) -> None:
    mine, result = entry(a), spliced(a, b)
    found, away = checks.presence(mine, result)
    irregular = a == "pebbles"
    assert found >= (0.8 if irregular else 0.95), "S2"
    assert away <= 0.5, "S3"
    low, middle = checks.shapes(mine, result)
    assert low >= 0.9, "S4"
    assert middle >= 0.97, "S4"
    assert checks.doubled(mine, result) <= 1.6, "S12"
    assert 0.75 <= checks.share(mine, result) <= 1.25, "S13"


@pytest.mark.parametrize(("a", "b"), [*PAIRS, ("net", "pebbles"), ("bricks", "dots")])
def test_all_colours_are_the_texture_s(a: str, b: str, spliced: Any) -> None:
    mine, result = entry(a), spliced(a, b)
    colours, matched = checks.copied(mine, result)
    assert colours == 1.0, "S5"
    # Connected figures are bent, so none of their pixels belongs to an element that moved as a whole.
    assert (matched is None) == (mine.layout != Layout.DISJOINT), "S5"
    assert matched is None or matched >= 0.99, "S5"
    np.testing.assert_array_equal(view(result.source_map, mine.image), result.image, "S5")
    if mine.layout == Layout.DISJOINT:
        assert result.report["flipped_rigid"] <= 0.002, "S6"
        assert result.report["flipped"] <= 0.12, "S6"
    assert result.report["holes"] <= 0.15, "S7"


@pytest.mark.parametrize(("a", "b"), PAIRS)
def test_the_ground_is_like_the_texture_s(a: str, b: str, spliced: Any) -> None:
    found = checks.coherence(entry(a), spliced(a, b))
    # Only pebbles in the layout of dots do not leave enough background to measure.
    assert found is not None or (a, b) == ("pebbles", "dots")
    assert found is None or found[0] <= 1.3 or found[1] <= 0.08, "S8"


@pytest.mark.parametrize(("a", "b"), PAIRS)
def test_the_arrangement_is_the_other_one_s(a: str, b: str, spliced: Any) -> None:
    found = checks.layout(spliced(a, b), entry(a), entry(b))
    assert found["spacing"] <= 0.05, "S10"
    assert found["nearest"] <= 0.05, "S10"
    assert found["away"] <= 0.5, "S3"
    assert found["own"] > 0.3, "S10"
    assert found["colour"] > 0.3, "S10"


@pytest.mark.parametrize("name", ["dots", "pebbles", "net", "bricks"])
def test_nothing_moved_nothing_changed(name: str) -> None:
    mine = entry(name)
    for edit in ({"op": "move", "element": 1, "by": 0}, {"op": "shift", "by": 0}, {"op": "scale", "factor": 1}):
        assert (texrs.self_splice(mine, edit).image == mine.image).all(), "S9"


@pytest.mark.parametrize("name", ["dots", "pebbles", "net", "bricks"])
def test_moving_all_moves_the_picture(name: str) -> None:
    mine = entry(name)
    image = texrs.self_splice(mine, {"op": "shift", "by": [5, -3]}).image
    same = (image[5:, :-3] == mine.image[:-5, 3:]).all(axis=-1)
    if name in ("net", "bricks"):
        assert same.all(), "S9"
        return
    # Separate elements with straight edges at the top or right are replaced by whole ones, and scraps by background.
    number, _ = label(mine.mask)
    coming = np.isin(number, np.union1d(number[0], number[:, -1])[1:])
    far = ~binary_dilation(coming, iterations=12)[:-5, 3:]
    far[:16], far[:, -16:] = False, False
    assert far.mean() > 0.5
    assert same[far].all(), "S9"


# --- brick walls: S11 ------------------------------------------------------------------------------------------------


def joints(sample: samples.Sample) -> list[np.ndarray[Any, np.dtype[np.intp]]]:
    """Return the whole vertical joints: their centre pixels, (rows, 2)."""
    labels = sample.labels
    assert labels is not None
    found = []
    boxes = find_objects(labels)
    for i, one in enumerate(boxes):
        for j, other in enumerate(boxes):
            if one is None or other is None or i == j:
                continue
            top, bottom = max(one[0].start, other[0].start), min(one[0].stop, other[0].stop)
            gap = other[1].start - one[1].stop
            height = one[0].stop - one[0].start
            if bottom - top > 0.8 * height and 0 <= gap < 16 and top > 8 and bottom < labels.shape[0] - 8:
                column = (one[1].stop + other[1].start) // 2
                found.append(np.array([[y, column] for y in range(top + 3, bottom - 3)]))
    return found


def bend(displacement: np.ndarray[Any, np.dtype[np.float64]]) -> float:
    """Return the deviation of a joint's centre line from a straight line: the standard deviation, in pixels."""
    rows = np.arange(len(displacement))
    return float((displacement - np.polyval(np.polyfit(rows, displacement, 1), rows)).std())


@pytest.mark.parametrize("edit", ["jitter", "rows", "stretch"])
def test_joints_stay_upright(edit: str) -> None:
    sample = samples.bricks()
    wall = entry("bricks", size=sample.image.shape[:2])
    rigid = ~wall.mask
    pins = np.rint(wall.points).astype(int)
    shift = np.zeros((len(pins), 2))
    if edit == "jitter":
        shift = np.random.default_rng(0).uniform(-4, 4, shift.shape)
    elif edit == "rows":
        shift[:, 1] = np.where(np.argsort(np.argsort(np.rint(pins[:, 0] / 18))) % 2, 6, -6)
        row = np.cumsum(np.concatenate([[0], np.diff(np.sort(pins[:, 0])) > 9]))
        shift[np.argsort(pins[:, 0], kind="stable"), 1] = np.where(row % 2, 6, -6)
    else:
        shift[:, 1] = 0.3 * (pins[:, 1] - pins[:, 1].mean())
    found = joints(sample)
    assert len(found) >= 15
    leans, bends = {}, {}
    for upright in (True, False):
        delta = minimise_energy(rigid, pins, shift, upright=upright)[..., 1]
        leans[upright] = np.array([abs(delta[tuple(j[0])] - delta[tuple(j[-1])]) for j in found])
        bends[upright] = np.array([bend(delta[tuple(j.T)]) for j in found])
        if upright:
            width = [abs(delta[y, x + 2] - delta[y, x - 2]) for j in found for y, x in j[len(j) // 2 :][:1]]
            assert np.mean(width) <= 0.5
    assert leans[True].mean() <= 0.3
    assert leans[True].max() <= 1.0
    assert leans[True].mean() < leans[False].mean()
    assert bends[True].mean() <= 0.1


# --- elements whose centre lies beside them ----------------------------------------------------------------------------

AWAY = np.hypot(*(np.indices((24, 24)) - 11.5))
OPENED = (AWAY < 9) & (AWAY > 5) & ~((np.indices((24, 24))[0] > 12) & (np.abs(np.indices((24, 24))[1] - 11.5) < 3))
HOLLOW = {"opened": OPENED, "ring": (AWAY < 9) & (AWAY > 5), "target": ((AWAY < 9) & (AWAY > 6)) | (AWAY < 3)}


@pytest.mark.parametrize("layout", Layout)
@pytest.mark.parametrize("middle", ["of the box", "of mass"])
@pytest.mark.parametrize("shape", HOLLOW)
def test_an_element_moves_whole_where_its_centre_lies_beside_it(shape: str, middle: str, layout: Layout) -> None:
    one = HOLLOW[shape]
    mask = np.tile(one, (4, 4))
    image = np.random.default_rng(0).integers(0, 60, (*mask.shape, 3)).astype(np.uint8)
    image[~mask] += 160
    centre = np.argwhere(one).mean(axis=0) if middle == "of mass" else np.array([11.5, 11.5])
    points = centre + 24.0 * np.array([[i, j] for i in range(4) for j in range(4)])
    mine = ElementAnalysis(image, points, mask, (25, 25), layout, np.ones(16))
    result = texrs.self_splice(mine, {"op": "move", "element": 5, "by": [4, -3]})
    assert (result.image != image).any()
    if layout == Layout.DISJOINT:
        pixels = np.argwhere(one) + 24
        goal = pixels + np.array([4, -3])
        assert (result.image[tuple(goal.T)] == image[tuple(pixels.T)]).all()
        assert {m["element"] for m in result.report["matches"]} == set(range(16))


# --- two warps, and what serves them ---------------------------------------------------------------------------------


def test_a_listed_edit_stirs_its_neighbourhood_alone() -> None:
    """Triangles between them carry moved points, and the mesh carries the rest: each reaches its own pixels."""
    mine = entry("dots")
    listed = texrs.self_splice(mine, {"op": "move", "element": 12, "by": [6, 4]})
    changed = np.argwhere((listed.image != mine.image).any(axis=-1))
    assert len(changed)
    assert np.abs(changed - mine.points[12]).max() < 70
    points = mine.points.copy()
    points[12] += (6, 4)
    again = texrs.self_splice(mine, {"op": "points", "points": points.tolist()})
    assert (again.image == listed.image).all()
    meshed = texrs.self_splice(mine, [{"op": "move", "element": 12, "by": [6, 4]}, {"op": "shift", "by": 0}])
    for result in (listed, meshed):
        moved = [m["found"] for m in result.report["matches"] if m["element"] == 12]
        assert np.allclose(moved[0], points[12], atol=1e-3)
        rigid = np.argwhere(result.source_map.label == 1 + [m["element"] for m in result.report["matches"]].index(12))
        assert len(rigid) > 100


def test_previews_are_drawn_at_once() -> None:
    result = texrs.splice(entry("dots"), entry("pebbles"), method="preview")
    assert result.image.shape == (*SIZE, 3)
    plain = texrs.self_splice(entry("dots"), {"op": "shift", "by": 0}, method="preview")
    assert (plain.image[20:-20, 20:-20] == entry("dots").image[20:-20, 20:-20]).all()


@pytest.mark.parametrize("name", ["dots", "net", "bricks"])
def test_the_literal_method(name: str) -> None:
    result = texrs.splice(entry(name), entry("pebbles"), method="paper", seed=2)
    assert checks.copied(entry(name), result)[0] == 1.0


# --- promises of the house -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("a", "b"), [("dots", "pebbles"), ("net", "dots"), ("bricks", "net")])
def test_threads_do_not_matter(a: str, b: str) -> None:
    found = []
    for count in (1, 2, 7):
        _FACTORS.clear()
        with texrs.threads(count):
            found.append(texrs.splice(entry(a), entry(b), (96, 112), seed=3).image.tobytes())
    assert found[0] == found[1] == found[2]


def test_any_dtype_and_channels() -> None:
    mine = entry("dots")
    usual = texrs.splice(mine, entry("pebbles"), 96, screening=None).image
    wide = replace(mine, image=mine.image.astype(np.uint16) * 257)
    assert (texrs.splice(wide, entry("pebbles"), 96, screening=None).image == usual.astype(np.uint16) * 257).all()
    grey = replace(mine, image=mine.image[..., 0])
    assert texrs.splice(grey, entry("pebbles"), (64, 96)).image.shape == (64, 96)
    floats = replace(mine, image=mine.image.astype(np.float32) * 4 - 2)
    assert texrs.splice(floats, entry("pebbles"), 64).image.dtype == np.float32


def test_pictures_are_analysed() -> None:
    image = samples.load("dots", size=(96, 96)).image
    assert texrs.splice(image, entry("pebbles"), 64).image.shape == (64, 64, 3)
    assert texrs.splice(image[..., 1], entry("pebbles"), 64).image.shape == (64, 64)
    with pytest.raises(InvalidInput, match="^elements: "):
        texrs.splice(np.zeros((40, 40)), entry("pebbles"))


def test_maps_in_register_come_out_in_register() -> None:
    mine = entry("bricks")
    result = texrs.splice(mine, entry("pebbles"), 128, use_cells=False, seed=1)
    height = np.linspace(0, 1, mine.mask.size, dtype=np.float32).reshape(mine.mask.shape)
    rows, columns = np.moveaxis(result.source_map.coordinates.astype(int), -1, 0)
    assert (result.source_map.render(height) == height[rows, columns]).all()
    # If the wall continues as its mirror image, so do the directions on it.
    frames = result.source_map.jacobians()
    assert set(np.unique(frames)) <= {-1.0, 0.0, 1.0}
    across = np.full((*mine.mask.shape, 3), (0.6, 0.0, 0.8), np.float32)
    across[0, 0] = (-0.6, 0, 0.8)
    turned = result.source_map.render(across, map_type="normal")
    mirrored = frames[..., 1, 1] < 0
    usual = ~((rows == 0) & (columns == 0))
    assert (turned[mirrored & usual][:, 0] < 0).all()
    assert (turned[~mirrored & usual][:, 0] > 0).all()


def test_progress_and_stopping() -> None:
    seen: list[str] = []
    texrs.splice(entry("dots"), entry("pebbles"), 96, progress=lambda name, share: seen.append(name))
    assert list(dict.fromkeys(seen))[:3] == ["match", "deform", "warp"]
    assert seen[-1] == "done"

    def stop(name: str, share: float) -> None:
        if name == "deform":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        texrs.splice(entry("dots"), entry("pebbles"), 96, progress=stop)


def test_stages_are_pictures(tmp_path: Any) -> None:
    result = texrs.splice(entry("dots"), entry("pebbles"), 96)
    assert {
        "source points",
        "target points",
        "mask",
        "matching",
        "warped mesh",
        "before refinement",
        "before_blending",
    } <= set(result.stages)
    assert len(result.save_stages(tmp_path)) == len(result.stages) + 1


def test_edits_replay() -> None:
    first = texrs.self_splice(entry("dots"), [{"op": "regularise", "amount": 0.5}, "randomise"], seed=7)
    again = texrs.self_splice(entry("dots"), first.report["edit"], seed=7)
    assert (first.image == again.image).all()


def test_regular_layouts() -> None:
    from texrs.papers.splice.edit import apply_steps
    from texrs.point_sets import fit_lattice

    skew = np.array([[20.0, 4.0], [3.0, 25.0]])
    index = np.argwhere(np.ones((6, 6)))
    noise = np.random.default_rng(0).normal(0, 0.5, (36, 2))
    _, basis = fit_lattice(index @ skew + noise)
    assert abs(abs(np.linalg.det(basis)) / np.linalg.det(skew) - 1) < 0.02
    found = apply_steps(index @ skew + noise, 36, [{"op": "regularise"}]).points
    away = (found - found[0]) @ np.linalg.inv(basis)
    assert np.abs(away - np.rint(away)).max() < 1e-6
    assert len(np.unique(np.rint(away), axis=0)) == 36


# --- bad input -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"points": np.zeros((0, 2))}, "at least three"),
        ({"points": np.array([[5.0, 5], [9, 9]])}, "at least three elements for a layout, got 2"),
        ({"points": np.array([[5.0, 5], [5, 5], [9, 9], [7, 20]])}, "occurs twice"),
        ({"points": np.array([[5.0, 5], [np.nan, 5], [9, 9]])}, "must be finite"),
        ({"points": np.array([[5.0, 5], [500, 5], [9, 9]])}, "is outside the image"),
        ({"mask": np.zeros((5, 5), bool)}, "mask: must be bool of shape"),
        ({"mask": np.ones(SIZE, bool)}, "only foreground"),
        ({"mask": np.zeros(SIZE, bool)}, "no foreground"),
        ({"image": np.zeros((8, 8))}, "at least 16"),
    ],
)
def test_bad_entries(change: dict[str, Any], words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        texrs.splice(replace(entry("dots"), **change), entry("pebbles"))


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        ("melt", "must have an 'op'"),
        ({"op": "move", "element": 900, "by": 1}, "element of move"),
        ({"op": "move", "element": 1}, "either 'by' or 'to'"),
        ({"op": "scale", "factor": 0}, "factor of scale"),
        ({"op": "scale", "factor": "big"}, "factor of scale must be a number"),
        ({"op": "shift", "by": [1e9, 0]}, "further than|four times"),
        ({"op": "shift", "up": 3}, "has no option up"),
        ({"op": "points", "points": [[1, 2], [1, 2]]}, "twice"),
        ({"op": "points", "points": [[float("nan"), 2]]}, "finite"),
        ({"op": "randomise", "amount": -1}, "amount of randomise"),
    ],
)
def test_bad_edits(edit: Any, words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        texrs.self_splice(entry("dots"), edit)


def test_bad_options() -> None:
    a, b = entry("dots"), entry("pebbles")
    with pytest.raises(InvalidInput, match="wrap"):
        texrs.splice(replace(a, wrap=(1, 2, 3)), b)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["dots", "bricks"])
def test_no_strength_leaves_the_layout_as_it_is(name: str) -> None:
    mine = entry(name)
    result = texrs.splice(mine, entry("pebbles"), use_cells=False, strength=0.0, seed=1)
    matches = result.report["matches"]
    assert {m["displacement_reached"] for m in matches} == {None}
    assert result.report["displacement_reached"] == 1
    inside = tuple(slice(2 * n // 5, 3 * n // 5) for n in mine.mask.shape)
    assert (result.image[inside] == mine.image[inside]).mean() > 0.98


def test_part_of_the_way_is_part_of_the_way() -> None:
    half, full = (texrs.splice(entry("dots"), entry("pebbles"), strength=s, refine=False, seed=1) for s in (0.5, 1.0))
    assert len(half.report["matches"]) > len(full.report["matches"]), "elements stay that would be erased"
    for one, all_ in zip(half.report["matches"], full.report["matches"], strict=False):
        assert one["element"] == all_["element"]


@pytest.mark.parametrize("name", ["dots", "pebbles"])
@pytest.mark.parametrize("factor", [0.9, 0.8])
def test_layouts_that_shrink_leave_no_bare_margin(name: str, factor: float) -> None:
    mine = entry(name)
    result = texrs.self_splice(mine, {"op": "scale", "factor": factor}, seed=1)
    rows, columns = np.moveaxis(result.source_map.coordinates.astype(int), -1, 0)
    shown, wide = mine.mask[rows, columns], max(mine.box) // 2
    sides = (shown[:wide], shown[-wide:], shown[:, :wide], shown[:, -wide:])
    assert min(side.mean() for side in sides) > 0.4 * mine.mask.mean()


@pytest.mark.parametrize("name", ["net", "bricks"])
def test_what_is_connected_cannot_be_removed(name: str) -> None:
    with pytest.raises(InvalidInput, match="the step remove needs separate elements"):
        texrs.self_splice(entry(name), [{"op": "shift", "by": 2}, {"op": "remove", "element": 3}])


@pytest.mark.parametrize("off", [(11, 11), (0, 12)])
def test_elements_are_moved_whose_centre_is_not_their_own(off: tuple[int, int]) -> None:
    mine = entry("dots")
    points = mine.points.copy()
    points[5] = np.clip(points[5] + off, 0, min(mine.mask.shape) - 1)
    result = texrs.self_splice(replace(mine, points=points), {"op": "move", "element": 5, "by": [6, -9]})
    assert result.image.shape == mine.image.shape

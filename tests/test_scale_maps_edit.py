"""Edits of scale maps: the effect of each, replayed lists, and errors."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from texrs import scale_maps
from texrs.errors import InvalidInput

FLAT = np.ones((60, 80), np.float32)
FLOOR = scale_maps.from_angles((60, 80), 50, 70)
RECTANGLE, DISC, POLYGON = [10, 20, 40, 60], [30, 40, 12], [[5, 5], [5, 70], [50, 40]]
ALL = [
    {"op": "magnify", "region": DISC, "factor": 2, "feather": 6},
    {"op": "minify", "region": RECTANGLE},
    {"op": "set", "value": 0.5, "region": POLYGON, "feather": 0},
    {"op": "vary", "gain": 1.5},
    {"op": "ramp", "start": [0, 0], "end": [0, 79], "values": [0.5, 2], "region": [0, 0, 9, 80]},
    {"op": "duplicate", "region": DISC, "to": [20, 20], "mode": "ratio"},
    {"op": "brush", "points": [[5, 5], [30, 60]], "radius": 5, "factor": 1.4},
    {"op": "smooth", "sigma": 2.5, "region": RECTANGLE},
]


def one(op: str, scale: np.ndarray = FLAT, **options: object) -> np.ndarray:
    return scale_maps.edit(scale, [{"op": op, **options}])


def test_magnify_and_minify_are_inverse() -> None:
    larger = one("magnify", FLOOR, region=DISC, factor=1.5)
    assert larger[30, 40] == pytest.approx(1.5 * FLOOR[30, 40], rel=1e-6)
    assert np.allclose(one("minify", larger, region=DISC, factor=1.5), FLOOR, rtol=1e-5)


@pytest.mark.parametrize("region", [RECTANGLE, DISC, POLYGON])
def test_edges_are_feathered_on_logarithms(region: list) -> None:
    share = np.log2(one("magnify", region=region, factor=2, feather=8))
    assert share.max() == pytest.approx(1, abs=1e-6)
    assert share.min() == 0
    # The edge is at half of the change, and as wide as requested.
    sharp = np.log2(one("magnify", region=region, factor=2, feather=0))
    assert set(np.unique(sharp).tolist()) == {0, 1}
    assert share[sharp == 1].min() >= 0.35
    assert share[sharp == 0].max() <= 0.65
    assert np.abs(np.diff(share, axis=1)).max() < 0.3


def test_a_rectangle_covers_its_pixels() -> None:
    changed = one("set", region=RECTANGLE, value=2, feather=0) == 2
    assert changed.sum() == 30 * 40
    assert changed[10:40, 20:60].all()


def test_a_polygon_follows_the_even_odd_rule() -> None:
    square = [[9.5, 19.5], [9.5, 59.5], [39.5, 59.5], [39.5, 19.5]]
    changed = one("set", region=square, value=2, feather=0)
    assert (changed == one("set", region=RECTANGLE, value=2, feather=0)).all()
    assert (one("set", region=square[::-1], value=2, feather=0) == changed).all()


def test_regions_may_be_outside_or_everywhere() -> None:
    assert (one("magnify", region=[100, 100, 5], factor=2) == 1).all()
    assert (one("magnify", region=[[100, 100], [100, 120], [120, 100]], factor=2) == 1).all()
    assert (one("magnify", region=[-50, -50, 200, 200], factor=2, feather=1) == 2).all()
    assert (one("magnify", factor=2) == 2).all()


def test_vary_spreads_about_the_mean() -> None:
    logs = np.log(FLOOR)
    assert np.allclose(np.log(one("vary", FLOOR, gain=0.5)), logs.mean() + 0.5 * (logs - logs.mean()), atol=1e-5)
    assert np.ptp(one("vary", FLOOR, gain=0)) < 1e-5
    assert np.allclose(one("vary", FLOOR, gain=1), FLOOR, rtol=1e-6)


def test_ramp_grows_from_point_to_point() -> None:
    made = one("ramp", FLOOR, start=[30, 10], end=[30, 70], values=[0.5, 2])
    assert np.allclose(made[:, 40], 1, rtol=1e-5)
    assert np.allclose(made[:, :11], 0.5)
    assert np.allclose(made[:, 70:], 2)


def test_duplicate_copies_values_or_variations() -> None:
    bump = one("magnify", FLOOR, region=[40, 60, 6], factor=2, feather=2)
    copied = one("duplicate", bump, region=[40, 60, 12], to=[15, 15])
    assert copied[15, 15] == pytest.approx(bump[40, 60], rel=1e-5)
    assert copied[40, 60] == bump[40, 60]
    varied = one("duplicate", bump, region=[40, 60, 12], to=[15, 15], mode="ratio")
    # The bump is added to the existing scales.
    assert bump[15, 15] < varied[15, 15] < copied[15, 15] * FLOOR[15, 15] / FLOOR[40, 60] * 1.2
    assert varied[5, 60] == bump[5, 60]


def test_what_is_duplicated_may_leave_the_map() -> None:
    assert one("duplicate", FLOOR, region=[0, 0, 30, 30], to=[59, 79]).shape == FLOOR.shape


def test_brush_falls_off_to_its_radius() -> None:
    drawn = one("brush", points=[[30, 10], [30, 70]], radius=6, factor=2)
    assert np.allclose(drawn[30, 10:71], 2)
    assert (drawn[:24] == 1).all()
    assert (np.diff(drawn[24:31, 40]) > 0).all()
    dot = one("brush", points=[[30, 40]], radius=6, factor=0.5)
    assert dot[30, 40] == 0.5
    assert one("brush", points=[[30, 40], [30, 40]], radius=6, factor=0.5)[30, 40] == 0.5


def test_smooth_takes_out_what_is_fine() -> None:
    rough = FLOOR * np.exp(np.random.default_rng(1).normal(0, 0.3, FLOOR.shape))
    off = np.log(one("smooth", rough, sigma=5) / FLOOR)
    assert off.std() < 0.06
    kept = one("smooth", rough, sigma=5, region=RECTANGLE, feather=0)
    assert np.allclose(kept[:10], rough[:10], rtol=1e-5)


def test_no_edit_goes_beyond_an_eighth_or_eight() -> None:
    many = [{"op": "magnify", "factor": 8}] * 5
    assert np.allclose(scale_maps.edit(FLAT, many), 8)
    assert np.allclose(scale_maps.edit(FLAT, [{"op": "minify", "factor": 8}] * 5), 1 / 8)
    # Existing values beyond the limits stay.
    steep = scale_maps.from_angles((40, 40), 85, 90)
    assert np.allclose(one("minify", steep, region=[0, 0, 0.5], feather=0), steep, rtol=1e-5)


def test_a_list_is_saved_and_replayed_and_undone_by_replay() -> None:
    before = FLOOR.copy()
    done = scale_maps.edit(FLOOR, ALL)
    assert (before == FLOOR).all()
    assert (scale_maps.edit(FLOOR, json.dumps(ALL)) == done).all()
    step_by_step = FLOOR
    for count in range(len(ALL)):
        assert np.allclose(scale_maps.edit(FLOOR, ALL[:count]), step_by_step, rtol=1e-5)
        step_by_step = scale_maps.edit(step_by_step, ALL[count : count + 1])
    assert np.allclose(done, step_by_step, rtol=1e-5)
    assert (scale_maps.edit(FLOOR, ["magnify"]) == one("magnify", FLOOR)).all()
    assert (scale_maps.edit(FLOOR, []) == FLOOR).all()
    assert (one("magnify", FLOOR, region=[0, 0, 20, 20], feather=0)[20:] == FLOOR[20:]).all()


@settings(deadline=None, max_examples=60)
@given(st.permutations(ALL), st.integers(1, 40), st.integers(1, 40))
def test_any_list_gives_a_map_of_any_size(edits: list, rows: int, columns: int) -> None:
    made = scale_maps.edit(np.ones((rows, columns)), [e for e in edits if e["op"] != "duplicate"])
    assert made.shape == (rows, columns)
    assert made.min() >= 1 / 8 - 1e-6
    assert made.max() <= 8 + 1e-5


@pytest.mark.parametrize(
    ("edits", "message"),
    [
        ("[{", r"^steps: must be JSON \("),
        (["set"], r"^steps: step 1, set, requires value$"),
        ([3], r"^steps: step 1 must have an 'op', one of magnify, .*; got 3$"),
        ([{}], r"^steps: step 1 must have an 'op', one of magnify, minify, set, .*; got {}$"),
        ([{"op": "erase"}], r"^steps: step 1 must have an 'op', one of .*'erase'}$"),
        ([{"op": ["set"]}], r"^steps: step 1 must have an 'op', one of .*\['set'\]}$"),
        ([ALL[0], {"op": "set"}], r"^steps: step 2, set, requires value$"),
        ([{"op": "set", "value": 1, "fog": 2}], r"^steps: step 1, set, has no option fog; its options are value, region"),
        ([{"op": "set", "value": 0}], r"^steps: step 1, set: value must be a number between 0.125 and 8, got 0$"),
        ([{"op": "magnify", "factor": 0.5}], r"factor must be a number between 1 and 8, got 0.5$"),
        ('[{"op": "magnify", "factor": NaN}]', r"factor must be a number between 1 and 8, got nan$"),
        ([{"op": "magnify", "factor": True}], r"factor must be a number between 1 and 8, got True$"),
        ([{"op": "magnify", "region": [1, 2]}], r"region must be \[top, left, bottom, right\], \[row, column, radius\]"),
        ([{"op": "magnify", "region": "all"}], r"region must be \[top, left"),
        ([{"op": "magnify", "region": [9, 9, 3, 20]}], r"region must be .* with top < bottom and left < right"),
        ([{"op": "magnify", "region": [9, 9, 0]}], r"region must be .* with a radius above 0"),
        ([{"op": "magnify", "region": [9, 9, 1e9]}], r"region must be a number between -1e\+06 and 1e\+06"),
        ([{"op": "magnify", "region": [[1, 2], [3, "a"], [4, 5]]}], r"region must be 3 to 1024 points"),
        ([{"op": "magnify", "region": [[1, 2]] * 2000}], r"region must be 3 to 1024 points \[row, column\], got \[\[1, 2\]"),
        ([{"op": "magnify", "region": DISC, "feather": -1}], r"feather must be a number between 0"),
        ([{"op": "brush", "points": [], "radius": 3, "factor": 2}], r"points must be 1 to 1024 points"),
        ([{"op": "brush", "points": [[0, 0]], "radius": 0, "factor": 2}], r"radius must be a number between 0.5"),
        ([{"op": "ramp", "start": [1, 1], "end": [1, 1], "values": [1, 2]}], r"end must differ from start$"),
        ([{"op": "ramp", "start": [1, 1], "end": [1, 9], "values": 2}], r"values must be two scales"),
        ([{"op": "duplicate", "region": DISC, "to": [900, 3]}], r"to must place a part of the region inside the map of"),
        ([{"op": "duplicate", "region": [200, 200, 5], "to": [3, 3]}], r"region must overlap the map"),
        ([{"op": "duplicate", "region": None, "to": [3, 3]}], r"region must be given"),
        ([{"op": "duplicate", "region": DISC, "to": [3, 3], "mode": "move"}], r"mode must be 'copy' or 'ratio'"),
        ([{"op": "smooth", "sigma": "x"}], r"sigma must be a number between 0.1 and 1000, got 'x'$"),
    ],
)  # fmt: skip
def test_edits_refuse(edits: object, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        scale_maps.edit(FLAT, edits)

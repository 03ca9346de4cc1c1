"""Scale maps by angles, resized, continued into holes, encoded and drawn."""

from __future__ import annotations

from math import cos, radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import scale_checks as checks
from texrs import limits, scale_maps
from texrs.errors import InvalidInput, LimitExceeded

FLOOR = scale_maps.from_angles((60, 80), 50, 70)


# --- by angles ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("tilt", [0, 45, 90, 200, 271.5, -30])
@pytest.mark.parametrize("slant", [0, 30, 85])
def test_the_extreme_corners_have_the_extreme_scales(slant: float, tilt: float) -> None:
    scale = scale_maps.from_angles((50, 70), slant, tilt)
    corners = scale[[0, 0, -1, -1], [0, -1, 0, -1]]
    assert scale.min() == corners.min() == pytest.approx(cos(radians(slant)), rel=1e-5)
    assert scale.max() == corners.max() == pytest.approx(1 / cos(radians(slant)), rel=1e-5)


@pytest.mark.parametrize(
    ("tilt", "far"), [(0, "right"), (90, "top"), (180, "left"), (270, "bottom"), (360, "right"), (-90, "bottom")]
)
def test_elements_are_small_where_depth_grows(tilt: float, far: str) -> None:
    scale = scale_maps.from_angles((41, 61), 40, tilt)
    sides = {"right": scale[:, -1], "left": scale[:, 0], "top": scale[0], "bottom": scale[-1]}
    assert min(sides, key=lambda side: float(sides[side].mean())) == far
    # Quarter turns do not change anything along the other axis.
    assert float(np.ptp(sides[far])) == 0


def test_it_is_equation_4_with_its_misprints_repaired() -> None:
    height, width, slant, tilt = 40, 60, radians(46), radians(18)
    # The paper's tau is measured from +y towards +x, and its y is up.
    y, x = height - 1 - np.arange(height)[:, None], np.arange(width)
    y_max = (width - 1) / 2 * np.sin(tilt) + (height - 1) / 2 * np.cos(tilt)
    y_proj = (x - (width - 1) / 2) * np.sin(tilt) + (y - (height - 1) / 2) * np.cos(tilt)
    expected = 1 / np.cos(slant) - (y_proj + y_max) * (1 / np.cos(slant) - np.cos(slant)) / (2 * y_max)
    assert np.allclose(scale_maps.from_angles((height, width), 46, 90 - 18), expected, atol=1e-6)


@pytest.mark.parametrize("case", checks.generated(96), ids=lambda case: case.name)
def test_angles_give_the_scales_of_a_pinhole(case: checks.Case) -> None:
    plain, exact = checks.by_angles(case)
    assert plain.correlation >= 0.999
    assert exact.correlation >= 0.999
    assert exact.slope == pytest.approx(1, abs=0.02)


def test_slant_for_ratio_is_the_inverse() -> None:
    for ratio in (1, 2, 4, 100):
        scale = scale_maps.from_angles((30, 30), scale_maps.slant_for_ratio(ratio), 90)
        assert scale.max() / scale.min() == pytest.approx(ratio, rel=1e-4)


def test_one_pixel_has_a_scale() -> None:
    assert scale_maps.from_angles(1, 60, 33).tolist() == [[1.25]]
    assert scale_maps.from_angles(1, 60, 33, fov=60).tolist() == [[1]]


def test_angles_refuse() -> None:
    with pytest.raises(InvalidInput, match="^slant: at 80 degrees the horizon is inside an image with a fov of 90"):
        scale_maps.from_angles((20, 30), 80, 90, fov=90)


# --- other sizes -------------------------------------------------------------------------------------------------------


def test_stretch_keeps_the_map_and_its_ends() -> None:
    scale = np.exp(np.linspace(-1, 1, 40, dtype=np.float32))[:, None] * np.ones((1, 30), np.float32)
    assert (scale_maps.resample(scale, (40, 30)) == scale).all()
    larger = scale_maps.resample(scale, (120, 45))
    assert larger.shape == (120, 45)
    # The map is linear in log S between pixel centres, which keep their values.
    assert np.allclose(np.log(larger[1::3, 0]), np.log(scale[:, 0]), atol=1e-6)
    assert np.allclose(np.diff(np.log(larger[1:-1, 0])), 2 / 39 / 3, atol=1e-5)
    back = scale_maps.resample(larger, (40, 30))
    assert np.allclose(back, scale, rtol=1e-5)


def test_extend_goes_on_as_the_plane_does() -> None:
    whole = scale_maps.from_angles((90, 120), 45, 30)
    middle = whole[20:70, 30:90]
    wider = scale_maps.resample(middle, (90, 120), "extend")
    assert (wider[20:70, 30:90] == middle).all()
    assert np.abs(np.log(wider / whole)).max() < 1e-4
    assert (scale_maps.resample(whole, (50, 60), "extend") == middle).all()
    mixed = scale_maps.resample(whole, (50, 200), "extend")
    assert mixed.shape == (50, 200)
    assert (mixed[:, 40:160] == whole[20:70]).all()


def test_extend_stops_before_the_horizon() -> None:
    steep = scale_maps.from_angles((40, 20), 80, 90)
    far = scale_maps.resample(steep, (400, 20), "extend")
    assert far.min() > 0
    assert far.min() >= steep.min() / 4.01


def test_user_and_angles_do_not_need_a_map() -> None:
    pattern = np.array([[1.0, 2.0], [0.5, 1.0]])
    drawn = scale_maps.resample(None, (20, 20), "user", pattern=pattern)
    assert drawn.shape == (20, 20)
    assert np.allclose(drawn[[0, 0, -1, -1], [0, -1, 0, -1]], pattern.ravel())
    by_angles = scale_maps.resample(None, (20, 30), "angles", slant=30, tilt=10, fov=40)
    assert (by_angles == scale_maps.from_angles((20, 30), 30, 10, fov=40)).all()


@pytest.mark.parametrize(
    ("arguments", "options", "message"),
    [
        ((FLOOR, (5, 5), "user"), {}, r"^pattern: the mode 'user' requires an array of scales$"),
        ((FLOOR, (5, 5), "angles"), {"slant": 4}, r"^tilt: the mode 'angles' requires a slant and a tilt$"),
        ((FLOOR - 5, (5, 5)), {}, r"^scale: \d+ of 4800 scales are outside 0.001 to 1000"),
        ((np.zeros((4, 4)), (5, 5)), {}, r"^scale: 16 of 16 scales are outside"),
        ((np.full((4, 4), 128, np.uint8), (5, 5)), {}, r"^scale: must be floats, got uint8; convert"),
        ((FLOOR, (5, 5), "user"), {"pattern": np.ones(4)}, r"^pattern: must have shape \(rows, columns\)"),
    ],
)
def test_resample_refuses(arguments: tuple, options: dict, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        scale_maps.resample(*arguments, **options)


# --- holes -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("trend", ["plane", "linear", "quadratic", "none"])
def test_a_hole_is_filled_without_a_jump(trend: str) -> None:
    known = np.ones(FLOOR.shape, np.bool_)
    known[15:40, 20:55] = False
    known[:10, 70:] = False
    filled = scale_maps.extend(np.where(known, FLOOR, np.nan), known, trend=trend)
    assert (filled[known] == FLOOR[known]).all()
    off = np.abs(np.log(filled / FLOOR))
    assert off.max() < {"plane": 1e-4, "linear": 0.05, "quadratic": 0.05, "none": 0.3}[trend]


def test_the_residual_is_carried_into_the_hole() -> None:
    bumpy = FLOOR * np.exp(0.2 * np.sin(np.arange(80) / 12)).astype(np.float32)
    known = np.ones(bumpy.shape, np.bool_)
    known[20:35, 30:45] = False
    off = np.abs(np.log(scale_maps.extend(bumpy, known) / bumpy))
    assert off.max() < 0.06
    # The plane alone has an error of the whole bump.
    assert np.abs(np.log(FLOOR / bumpy))[~known].max() > 0.1


def test_a_trend_is_robust() -> None:
    scale = FLOOR.copy()
    scale[30:45, 5:25] *= 3
    known = np.ones(scale.shape, np.bool_)
    known[5:25, 50:75] = False
    off = np.abs(np.log(scale_maps.extend(scale, known) / FLOOR))[~known]
    assert off.max() < 0.02


def test_all_known_is_all_kept() -> None:
    assert (scale_maps.extend(FLOOR, np.ones(FLOOR.shape, bool)) == FLOOR).all()


def test_one_known_pixel_is_enough() -> None:
    known = np.zeros((9, 11), np.bool_)
    known[3, 4] = True
    assert np.allclose(scale_maps.extend(np.full((9, 11), 2.0), known), 2)


@pytest.mark.parametrize(
    ("scale", "known", "message"),
    [
        (-FLOOR, np.eye(60, 80, dtype=bool), r"^scale: 60 of 4800 scales are outside"),
        (FLOOR * np.nan, np.eye(60, 80, dtype=bool), r"^scale: must be finite, but 60 of 4800 values are NaN"),
    ],
)
def test_extend_refuses(scale: np.ndarray, known: np.ndarray, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        scale_maps.extend(scale, known)


# --- pictures ----------------------------------------------------------------------------------------------------------


@settings(deadline=None)
@given(st.floats(0.26, 3.9), st.sampled_from(["log2", "paper"]))
def test_what_is_encoded_is_decoded(scale: float, encoding: str) -> None:
    if encoding == "paper" and scale > 1.99:
        scale = 1.99
    given_map = np.full((2, 3), scale)
    back = scale_maps.decode(scale_maps.encode(given_map, encoding), encoding)
    if encoding == "log2":
        assert np.abs(np.log2(back / scale)).max() <= 0.5 / 64 + 1e-6
    else:
        assert np.abs(back - scale).max() <= 0.5 / 128 + 1e-6


def test_every_grey_level_comes_back() -> None:
    levels = np.arange(256, dtype=np.uint8).reshape(16, 16)
    assert (scale_maps.encode(scale_maps.decode(levels)) == levels).all()
    paper = scale_maps.encode(scale_maps.decode(levels, "paper"), "paper")
    assert (paper.ravel()[1:] == levels.ravel()[1:]).all()
    assert (scale_maps.decode(levels.astype(np.uint16) * 257) == scale_maps.decode(levels)).all()
    assert (scale_maps.decode(np.repeat(levels[..., None], 3, axis=-1)) == scale_maps.decode(levels)).all()


def test_128_is_the_normal_size_and_the_ends_hold() -> None:
    scale = np.array([[1.0, 100.0, 0.01]])
    assert scale_maps.encode(scale).tolist() == [[128, 255, 0]]
    assert scale_maps.encode(scale, "paper").tolist() == [[128, 255, 1]]


def test_decode_checks_memory_before_it_begins() -> None:
    image = np.zeros((1024, 1024), np.uint8)
    with limits.context(memory=4 << 20), pytest.raises(LimitExceeded, match="image: needs 8.4 MB of memory"):
        scale_maps.decode(image)
    with limits.context(memory=16 << 20):
        assert scale_maps.decode(image).shape == (1024, 1024)


@pytest.mark.parametrize("shape", [(1, 1), (7, 300), (64, 64), (700, 40)])
def test_pictures_of_any_size(shape: tuple[int, int]) -> None:
    shown = scale_maps.picture(scale_maps.from_angles(shape, 60, 90))
    assert shown.dtype == np.uint8
    assert shown.shape[0] == max(32, shape[0])
    assert shown.shape[1] > shape[1]


def test_red_is_large_and_blue_is_small() -> None:
    near, far = scale_maps.picture(np.full((8, 8), 3.0), largest=4), scale_maps.picture(np.full((8, 8), 0.3), largest=4)
    assert near[0, 0, 0] > near[0, 0, 2] + 50
    assert far[0, 0, 2] > far[0, 0, 0] + 50
    assert scale_maps.picture(np.ones((8, 8)))[0, 0].min() > 230

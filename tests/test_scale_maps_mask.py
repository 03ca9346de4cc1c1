"""Scale maps measured in masks: compared with known scales and slow twins, and refused masks."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

import scale_checks as checks
from texrs import samples, scale_maps
from texrs._threads import threads
from texrs.errors import InvalidInput
from texrs.scale_maps._mask import _count_outlines, _mark_middles
from texrs.scale_maps._windows import Lattice

SIDE = 256
TILES, BRICKS = checks.generated(SIDE)[0], checks.generated(SIDE)[-1]


# --- against the truth -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", checks.generated(SIDE)[:4], ids=lambda case: case.name)
def test_tiles_are_measured_in_the_picture(case: checks.Case) -> None:
    """The result does not depend on the direction, or on whether elements or gaps are marked."""
    mask = scale_maps.auto_mask(case.image)
    plain, inverted = checks.by_mask(case, mask), checks.by_mask(case, ~mask)
    assert plain.correlation >= 0.9
    assert inverted == plain
    assert checks.by_mask(case, mask, trend="plane").correlation >= 0.97


@pytest.mark.parametrize(("measure", "least"), [("boundary", 0.97), ("count", 0.93), ("skeleton", 0.6)])
def test_measures_of_a_clean_mask(measure: str, least: float) -> None:
    assert checks.by_mask(TILES, TILES.mask, measure=measure).correlation >= least


def test_the_root_of_the_area_and_the_width_are_measured_in_a_clean_mask() -> None:
    area = checks.by_mask(TILES, TILES.mask, trend="plane")
    width = checks.by_mask(TILES, TILES.mask, trend="plane", foreshortened=True)
    assert min(area.correlation, width.correlation) >= 0.99
    assert area.slope == pytest.approx(1.5, abs=0.15)
    assert width.slope == pytest.approx(1, abs=0.1)
    # With the conversion to widths, the measured map equals the map from the angles.
    by_angles = scale_maps.from_angles((SIDE, SIDE), TILES.slant, TILES.tilt, fov=TILES.fov)
    measured = scale_maps.from_mask(TILES.mask, trend="plane", foreshortened=True)
    off = np.log(measured / by_angles)
    assert np.abs(off - off.mean()).max() < 0.2


def test_bricks_are_measured_in_their_mask() -> None:
    assert checks.by_mask(BRICKS, BRICKS.mask).correlation >= 0.9
    assert checks.by_mask(BRICKS, BRICKS.mask, trend="plane").correlation >= 0.95


def test_sizes_that_change_without_perspective_are_measured_as_they_are() -> None:
    rows, columns = np.indices((300, 300)) / 300
    # Draw a lattice of discs, twice as dense at the right as at the left: S = 2^(-x), so log S is linear.
    u, v = (2**columns - 1) / np.log(2) * 30, rows * 30
    size = 2.0**-columns
    mask = (np.sin(2 * np.pi * u) > 0) & (np.abs(v - np.rint(v)) < 5)
    found = scale_maps.from_mask(mask)
    agreement = checks.Agreement.of(found, size)
    assert agreement.correlation >= 0.98
    assert agreement.slope == pytest.approx(1, abs=0.1)


def test_the_paper_s_count_of_areas_measures_nothing() -> None:
    """Equation 1 counts pixels of the mask. The share of areas does not depend on their size."""
    for mask in (TILES.mask, ~TILES.mask):
        assert abs(checks.by_mask(TILES, mask, measure="area").correlation) < 0.5
    # For curves, the measured scales are reciprocal: large elements become small.
    rows = np.cumsum(np.linspace(6, 24, 40)).astype(int)
    curves = np.zeros((rows[-1] + 12, 200), bool)
    curves[rows] = True
    size = np.linspace(1, 4, len(curves))[:, None] * np.ones(200)
    literal = checks.Agreement.of(scale_maps.from_mask(curves, measure="area"), size)
    repaired = checks.Agreement.of(scale_maps.from_mask(curves), size)
    assert literal.correlation < -0.7
    assert repaired.correlation > 0.95


def test_the_literal_map_is_equations_1_and_2_as_printed() -> None:
    mask = TILES.mask[:70, :60]
    padded = np.pad(mask.astype(int), 16)
    count = np.array([[padded[r : r + 32, c : c + 32].sum() for c in range(60)] for r in range(70)])
    scale = count / ((count.min() + count.max()) / 2)
    border = np.pad(scale, 4, mode="edge")
    around = np.lib.stride_tricks.sliding_window_view(border, (9, 9)).reshape(70, 60, 81)
    expected = 0.8 * around.mean(-1) + 0.2 * np.median(around, axis=-1)
    found = scale_maps.from_mask(mask, measure="area")
    inner = (expected > 0.3) & (expected < 3)
    ratio = (found / expected)[inner]
    assert np.ptp(ratio) / ratio.mean() < 1e-3


# --- holes -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", checks.generated(SIDE)[:2], ids=lambda case: case.name)
def test_a_hole_is_neither_features_nor_area(case: checks.Case) -> None:
    hole, whole = checks.in_hole(case)
    assert hole.correlation >= 0.95 * whole.correlation
    assert 0.7 <= hole.slope / whole.slope <= 1.4


def test_what_stands_in_the_hole_does_not_matter() -> None:
    known = np.ones((SIDE, SIDE), bool)
    known[90:150, 60:180] = False
    known[:40, 200:] = False
    maps = []
    for filled in (False, True):
        mask = np.where(known, TILES.mask, filled)
        image = np.where(known[..., None], TILES.image, np.uint8(255 * filled))
        found = scale_maps.auto_mask(image, known=known)
        assert not found[~known].any()
        maps.append(
            [scale_maps.from_mask(m, known=known, measure=k) for m in (mask, found) for k in ("boundary", "count")]
        )
        maps[-1].append(scale_maps.from_mask(mask, known=known, measure="skeleton", trend="quadratic"))
    assert all((a == b).all() for a, b in zip(*maps, strict=True))


def test_all_known_is_as_if_nothing_was_said() -> None:
    known = np.ones((SIDE, SIDE), bool)
    assert (scale_maps.from_mask(TILES.mask, known=known) == scale_maps.from_mask(TILES.mask)).all()
    assert (scale_maps.auto_mask(TILES.image, known=known) == scale_maps.auto_mask(TILES.image)).all()


# --- windows -----------------------------------------------------------------------------------------------------------


@settings(deadline=None, max_examples=30)
@given(
    arrays.arrays(np.bool_, st.tuples(st.integers(3, 40), st.integers(3, 40))),
    st.integers(1, 60),
    st.randoms(use_true_random=False),
)
def test_windows_count_what_a_slow_twin_counts(mask: np.ndarray, window: int, random) -> None:
    known = np.array([[random.random() < 0.8 for _ in range(mask.shape[1])] for _ in range(mask.shape[0])])
    lattice = Lattice.of(mask.shape, window)
    features = (mask & known).view(np.uint8)
    density, enough, rows, columns = lattice.densities(features, known)
    reach, cell = lattice.across // 2, lattice.cell
    for i, j in np.ndindex(density.shape):
        box = tuple(slice(max(0, (k - reach) * cell), (k + reach + 1) * cell) for k in (i, j))
        area = known[box].sum()
        assert density[i, j] == pytest.approx(features[box].sum() / max(1, area))
        if enough[i, j]:
            at = np.argwhere(known[box]) // cell * cell + [box[0].start, box[1].start]
            assert (rows[i, j], columns[i, j]) == pytest.approx(
                (i * cell - at[:, 0].mean(), j * cell - at[:, 1].mean())
            )


def test_outlines_are_counted_once_and_for_both_sides() -> None:
    mask = np.zeros((12, 12), bool)
    mask[3:7, 2:10] = True
    assert _count_outlines(mask, None).sum() == 2 * (4 + 8)
    assert (_count_outlines(mask, None) == _count_outlines(~mask, None)).all()
    known = np.ones_like(mask)
    known[:, 9:] = False
    # Count the left side, and the known parts of the two long sides.
    assert _count_outlines(mask, known).sum() == 4 + 2 * 7


def test_features_are_counted_at_their_middles_and_cut_ones_by_half() -> None:
    mask = np.zeros((40, 40), bool)
    mask[10:13, 20:25] = mask[30, 5] = True
    mask[0:5, 30:33] = True
    count = _mark_middles(mask, None)
    assert {tuple(at): int(count[tuple(at)]) for at in np.argwhere(count)} == {(11, 22): 2, (30, 5): 2, (2, 31): 1}
    known = np.ones_like(mask)
    known[10:13, 25:] = False
    assert _mark_middles(mask, known)[11, 22] == 1
    # A ring and the disc in its middle are two features with the same centre.
    rows, columns = np.indices((41, 41)) - 20
    ring = (np.hypot(rows, columns) > 8) & (np.hypot(rows, columns) < 11) | (np.hypot(rows, columns) < 3)
    assert _mark_middles(ring, None)[20, 20] == 4


def test_borders_see_one_side_alone_and_are_corrected() -> None:
    case = checks.generated(SIDE)[0]
    found = scale_maps.from_mask(case.mask, window=80)
    area = case.width**1.5
    off = np.log(found / area).mean(axis=1)
    assert np.abs(off[[0, -1]] - off[SIDE // 4 : -SIDE // 4].mean()).max() < 0.15


@pytest.mark.parametrize("window", [16, 40, 256])
def test_any_window_gives_a_map(window: int) -> None:
    found = scale_maps.from_mask(TILES.mask, window=window)
    assert found.shape == (SIDE, SIDE)
    assert found.dtype == np.float32
    assert np.log(found).mean() == pytest.approx(0, abs=1e-4)
    assert np.abs(np.log2(found)).max() < 4


def test_an_enlarged_picture_has_the_same_map() -> None:
    larger = np.repeat(np.repeat(TILES.mask, 2, axis=0), 2, axis=1)
    off = np.log(scale_maps.from_mask(larger)[::2, ::2] / scale_maps.from_mask(TILES.mask))
    assert np.abs(off).max() < 0.1


def test_thousands_of_pixels_a_side_and_of_either() -> None:
    rng = np.random.default_rng(0)
    for shape in ((16, 3000), (3000, 17), (16, 16)):
        mask = rng.random(shape) < 0.5
        found = scale_maps.from_mask(mask)
        assert found.shape == shape
        assert np.isfinite(found).all()


def test_same_bytes_for_any_number_of_threads() -> None:
    known = np.ones((SIDE, SIDE), bool)
    known[90:150, 60:180] = False
    made = []
    for count in (1, 2, 7):
        with threads(count):
            mask = scale_maps.auto_mask(TILES.image, known=known)
            made.append((mask, scale_maps.from_mask(mask, known=known)))
    assert all((a == b).all() for other in made[1:] for a, b in zip(made[0], other, strict=True))


# --- masks that are found ----------------------------------------------------------------------------------------------


def test_colours_of_one_lightness_are_told_apart() -> None:
    image = np.where(TILES.mask[..., None], np.array([200, 100, 60], np.uint8), np.array([60, 100, 200], np.uint8))
    mask = scale_maps.auto_mask(image)
    assert max((mask == TILES.mask).mean(), (mask != TILES.mask).mean()) > 0.95


def test_large_pictures_are_looked_at_in_cells() -> None:
    larger = np.repeat(np.repeat(TILES.image, 4, axis=0), 4, axis=1)[:-2, :-1]
    known = np.ones(larger.shape[:2], bool)
    known[400:600, 300:700] = False
    mask = scale_maps.auto_mask(larger, min_feature_size=4)
    assert (mask[1::4, 1::4] == scale_maps.auto_mask(TILES.image)).mean() > 0.97
    assert (scale_maps.auto_mask(larger, min_feature_size=4, known=known)[known] == mask[known]).mean() > 0.97


def test_every_dtype_gives_the_same_mask() -> None:
    grey = TILES.image[..., 1]
    mask = scale_maps.auto_mask(grey)
    for other in (
        grey.astype(np.uint16) * 257,
        grey / np.float64(255),
        grey[..., None],
        np.repeat(grey[..., None], 3, -1),
    ):
        assert (scale_maps.auto_mask(other) == mask).mean() > 0.999


# --- what cannot be measured -------------------------------------------------------------------------------------------

BLANK = np.zeros((64, 64), bool)


@pytest.mark.parametrize(
    ("mask", "options", "message"),
    [
        (~BLANK, {}, r"^mask: must mark features, but it marks every pixel"),
        (np.arange(64) < np.full((64, 1), 30), {}, r"^mask: must mark more features per window of \d+ pixels"),
        (np.arange(64) < np.full((64, 1), 30), {"measure": "count"}, r"^mask: must mark more features"),
        (np.ones((64, 64, 3), bool), {}, r"^mask: must have shape \(64, 64\), got \(64, 64, 3\)$"),
        (np.eye(12, dtype=bool), {}, r"^mask: each side must be at least 16, got \(12, 12\)$"),
        (TILES.mask, {"known": np.zeros((256, 256), bool)}, r"^known: must mark at least one pixel, got none$"),
        (TILES.mask, {"known": TILES.mask}, r"^mask: must mark features, but it marks every pixel"),
        (TILES.mask, {"window": 8}, r"^window: must be an integer between 16 and 256, got 8$"),
    ],
)  # fmt: skip
def test_masks_without_features_are_refused(mask: np.ndarray, options: dict, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        scale_maps.from_mask(mask, **options)


@pytest.mark.parametrize(
    ("image", "options", "message"),
    [
        (np.zeros((8, 64)), {}, r"^image: each side must be at least 16, got \(8, 64\)$"),
        (TILES.image, {"known": np.zeros((256, 256), bool)}, r"^known: must mark at least one pixel"),
        (TILES.image, {"min_feature_size": 0}, r"^min_feature_size: must be a number between 0.5 and 64.0, got 0$"),
    ],
)
def test_pictures_without_features_are_refused(image: np.ndarray, options: dict, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        scale_maps.auto_mask(image, **options)


def test_a_picture_with_one_edge_has_too_few_features() -> None:
    image = np.zeros((64, 64), np.uint8)
    image[:, 30:] = 200
    with pytest.raises(InvalidInput, match=r"^image: must contain more features"):
        scale_maps.auto_mask(image)


@pytest.mark.parametrize("name", samples.names()[:12])
def test_every_sample_has_a_map(name: str) -> None:
    image = samples.load(name, size=(128, 128)).image
    found = scale_maps.from_mask(scale_maps.auto_mask(image))
    assert np.isfinite(found).all()

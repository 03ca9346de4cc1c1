"""Lit materials: the bright side of a bump, the effect of each map, and the size of the image."""

from typing import Any

import numpy as np
import pytest

from texrs import Material, _colours
from texrs._typing import Array
from texrs.errors import InvalidInput
from texrs.materials import _preview

ROWS, COLUMNS = 48, 64
COLOURS = np.random.default_rng(3).integers(20, 200, (ROWS, COLUMNS, 3), dtype=np.uint8)
GREY = np.full((ROWS, COLUMNS, 3), 128, np.uint8)


def make_bump() -> tuple[Array, Array]:
    """Return the heights of a bump, and its normals as 16-bit values with y up."""
    down, right = np.indices((ROWS, COLUMNS)) - np.array([ROWS / 2, COLUMNS / 2])[:, None, None] + 0.5
    height = 12 * np.exp(-(down**2 + right**2) / 128)
    normal = np.stack([height * right / 64, -height * down / 64, np.ones_like(height)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return height.astype(np.float32), np.rint((normal + 1) / 2 * 65535).astype(np.uint16)


HEIGHT, NORMAL = make_bump()


def shine(maps: dict[str, Array], **options: Any) -> Array:
    return Material(maps).preview(**{"tiles": (1, 1), **options}).astype(int)


def test_a_flat_dull_surface_shows_its_own_colours() -> None:
    shown = shine({"albedo": COLOURS, "roughness": np.full((ROWS, COLUMNS), 255, np.uint8)})
    assert np.abs(shown - COLOURS)[COLOURS > 40].max() <= 12
    assert np.abs(shown - COLOURS).mean() < 5
    # Brighter greys are never rendered darker.
    ramp = np.repeat(np.arange(256, dtype=np.uint8)[np.newaxis], 4, axis=0)
    assert (np.diff(shine({"albedo": ramp})[0, :, 0]) >= 0).all()


@pytest.mark.parametrize("maps", [{"normal": NORMAL}, {"height": HEIGHT}, {"height": (HEIGHT * 20).astype(np.uint8)}])
@pytest.mark.parametrize(
    ("azimuth", "bright", "dark"),
    [
        (0, (24, 40), (24, 24)),
        (180, (24, 24), (24, 40)),
        (90, (16, 32), (32, 32)),
        (-90, (32, 32), (16, 32)),
    ],
)
def test_bumps_are_bright_where_the_light_comes_from(
    maps: dict[str, Array], azimuth: float, bright: tuple[int, int], dark: tuple[int, int]
) -> None:
    shown = shine({"albedo": GREY, **maps}, light=(azimuth, 40)).mean(axis=-1)
    assert shown[bright] > shown[dark] + 40


def test_both_kinds_of_green_mean_the_same_surface() -> None:
    turned = NORMAL.copy()
    turned[..., 1] = 65535 - turned[..., 1]
    up = shine({"albedo": COLOURS, "normal": NORMAL})
    assert (up == shine({"albedo": COLOURS, "normal_dx": turned})).all()
    assert np.abs(up - shine({"albedo": COLOURS, "normal": turned})).max() > 40
    # Normals as floats give the same image in the range 0 to 1 and in the range -1 to 1.
    unit = NORMAL / np.float32(65535)
    for floats in (unit, unit * 2 - 1):
        assert np.abs(up - shine({"albedo": COLOURS, "normal": floats.astype(np.float32)})).max() <= 1


def test_linear_colours_look_like_the_srgb_ones_they_are() -> None:
    linear = _colours.decode_srgb(COLOURS / np.float32(255))
    deep = (COLOURS.astype(np.uint16)) * 257
    shown = shine({"albedo": COLOURS})
    for same in (linear, deep):
        assert np.abs(shown - shine({"albedo": same})).max() <= 1


def test_srgb_is_that_of_the_standard() -> None:
    values = np.array([0, 0.02, 0.04045, 0.2, 0.5, 1], np.float32)
    expected = [0, 0.02 / 12.92, 0.0031308, 0.0331048, 0.2140411, 1]
    np.testing.assert_allclose(_colours.decode_srgb(values), expected, atol=2e-7)
    np.testing.assert_allclose(_colours.encode_srgb(_colours.decode_srgb(values)), values, atol=1e-6)


def test_every_map_counts() -> None:
    full, none = np.full((ROWS, COLUMNS), 255, np.uint8), np.zeros((ROWS, COLUMNS), np.uint8)
    plain = {"albedo": GREY, "normal": NORMAL}
    shown = shine(plain)
    assert (shine({**plain, "ao": none}) < shown).mean() > 0.95
    assert (shine({**plain, "ao": full}) == shown).all()
    # Smooth materials have a small, bright highlight where they are inclined by half the light's angle.
    smooth, rough = (shine({**plain, "roughness": np.full_like(none, r)}) for r in (50, 255))
    assert smooth.max() > rough.max() + 15
    assert np.median(np.abs(smooth - rough)) < 15
    # Metal mirrors its surroundings, so it is darker where they are dark.
    assert (
        shine({**plain, "metallic": full, "roughness": np.full_like(none, 60)})[0, 0].mean() < shown[0, 0].mean() - 20
    )
    glow = np.zeros((ROWS, COLUMNS, 3), np.uint8)
    glow[:8, :, 0] = 200
    lit = shine({**plain, "emission": glow})
    assert (lit[:8, :, 0] > shown[:8, :, 0] + 20).all()
    assert (lit[8:] == shown[8:]).all()


def test_packed_maps_are_the_same_three() -> None:
    packed = np.random.default_rng(1).integers(0, 256, (ROWS, COLUMNS, 3), dtype=np.uint8)
    maps = {"ao": packed[..., 0], "roughness": packed[..., 1], "metallic": packed[..., 2]}
    plain = {"albedo": GREY, "normal": NORMAL}
    assert (shine({**plain, "arm": packed}) == shine({**plain, **maps})).all()


def test_what_is_transparent_shows_squares() -> None:
    hole = np.full((ROWS, COLUMNS), 255, np.uint8)
    hole[10:30, 10:50] = 0
    shown = shine({"albedo": GREY, "opacity": hole})
    assert (shown == shine({"albedo": np.dstack([GREY, hole])})).all()
    assert len(np.unique(shown[12:28, 12:48])) == 2
    assert (shown[hole > 0] == shine({"albedo": GREY})[hole > 0]).all()


def test_tiles_and_sizes() -> None:
    maps = {"albedo": COLOURS, "height": HEIGHT}
    one, four = shine(maps, tiles=(2, 2))[:ROWS, :COLUMNS], shine(maps, tiles=(2, 2))
    assert four.shape == (2 * ROWS, 2 * COLUMNS, 3)
    assert (four == np.tile(one, (2, 2, 1))).all()
    assert shine(maps, tiles=(1, 3), side=96).shape == (24, 96, 3)
    # Reduced pixels are averages of linear light, so half of the light of level 188 is level 137.
    half = shine({"albedo": np.indices((32, 32)).sum(axis=0).astype(np.uint8) % 2 * 188}, side=16)
    even = shine({"albedo": np.full((4, 4), 137, np.uint8)})
    assert np.abs(half - even[0, 0]).max() <= 2
    assert shine({"albedo": COLOURS}, side=50).shape == (37, 50, 3)
    assert shine({"height": np.zeros((1, 5), np.float32)}).shape == (1, 5, 3)


def test_strips_are_not_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    maps = {"albedo": np.dstack([COLOURS, COLOURS[..., :1]]), "normal": (NORMAL / np.float32(32767.5) - 1)}
    whole = [shine(maps), shine({"height": HEIGHT}, tiles=(2, 1)), shine(maps, side=40)]
    monkeypatch.setattr(_preview, "STRIP", 5 * COLUMNS)
    for shown, again in zip(
        whole, [shine(maps), shine({"height": HEIGHT}, tiles=(2, 1)), shine(maps, side=40)], strict=True
    ):
        assert (shown == again).all()


def test_shrunk_values_are_means_of_areas() -> None:
    values = np.random.default_rng(0).random((13, 10, 2)).astype(np.float32)
    fine = np.repeat(np.repeat(values.astype(np.float64), 5, axis=0), 4, axis=1)
    expected = fine.reshape(5, 13, 4, 10, 2).mean(axis=(1, 3))
    np.testing.assert_allclose(_colours.shrink(values, (5, 4)), expected, atol=1e-6)
    assert _colours.shrink(values, (13, 10)) is values


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"tiles": (0, 2)}, "tiles: must be an integer between 1"),
        ({"light": (0, 0)}, r"light\[1\]: must be a number between 1 and 90"),
        ({"side": 2, "tiles": (1, 3)}, "side: must be at least the number of tiles, got 2 pixels for 3 tiles"),
    ],
)
def test_bad_options_are_refused(options: dict[str, Any], words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        shine({"albedo": GREY}, **options)


def test_volumes_are_refused() -> None:
    with pytest.raises(InvalidInput, match="must not be a volume"):
        Material({"albedo": np.zeros((4, 4, 4), np.uint8)}, axes=3).preview()

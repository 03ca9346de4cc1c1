"""Even light: large variations are removed, small ones stay, and matching borders still match."""

import dataclasses
from typing import Any

import numpy as np
import pytest

import texrs
from texrs import Material, _lighting_correction
from texrs._colours import decode_srgb, encode_srgb
from texrs._typing import Array
from texrs.errors import InvalidInput
from texrs.materials import flatten_lighting

ROWS, COLUMNS = 120, 160
GRAIN = 100 + 25 * np.random.default_rng(4).random((ROWS, COLUMNS, 3))
ROW, COLUMN = np.indices((ROWS, COLUMNS))
RAMP = (0.7 + 0.6 * COLUMN / COLUMNS)[..., np.newaxis]
BAND = (1 + 0.25 * np.sin(2 * np.pi * ROW / ROWS))[..., np.newaxis]


def vary(image: Array, wrap: bool = False) -> float:
    """Return the variation of parts of 1/6 of the sides, relative to the mean."""
    blocks = image.astype(float).mean(axis=-1).reshape(6, ROWS // 6, 8, COLUMNS // 8).mean(axis=(1, 3))
    return float(blocks.std() / blocks.mean())


@pytest.mark.parametrize(("light", "wrap"), [(RAMP, False), (BAND, False), (BAND, True), (RAMP * BAND, False)])
@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32", "float64"])
def test_light_is_evened_and_the_rest_stays(light: Array, wrap: bool, dtype: str) -> None:
    kind = np.dtype(dtype)
    most = np.iinfo(kind).max / 255 if kind.kind == "u" else 1 / 255
    lit = (GRAIN * light * most).astype(kind)
    even = flatten_lighting(lit, wrap=wrap, space="srgb")
    assert (even.dtype, even.shape) == (lit.dtype, lit.shape)
    assert vary(lit) > 0.1
    assert vary(even) < vary(lit) / 6
    # Grain has the same strength as in even light.
    assert 0.85 < even.std() / (GRAIN * most).std() < 1.2
    half = vary(flatten_lighting(lit, 0.5, wrap=wrap, space="srgb"))
    assert vary(even) + 0.02 < half < vary(lit) - 0.02
    assert np.abs(flatten_lighting(lit, 0, wrap=wrap, space="srgb").astype(float) - lit).max() <= 0.01 * most


def test_more_flowers_are_no_more_light() -> None:
    """White spots are denser on one side. All keep their brightness, and so does the background."""
    picture = np.full((ROWS, COLUMNS, 3), (40, 70, 30), np.uint8)
    for row in range(5, ROWS, 12):
        for column in range(4, COLUMNS, 8 if row < ROWS // 2 else 32):
            picture[row : row + 5, column : column + 4] = (230, 225, 220)
    spots = picture[..., 0] > 100
    even = flatten_lighting(picture).astype(float)
    assert np.abs(even - picture).max() < 12
    # In uneven light, the brightness of the spots becomes more equal.
    lit = (picture * (0.6 + 0.35 * COLUMN / COLUMNS)[..., np.newaxis]).astype(np.uint8)
    better = flatten_lighting(lit).astype(float)
    assert better[spots].std() / better[spots].mean() < 0.35 * lit[spots].std() / lit[spots].mean()


@pytest.mark.parametrize("seed", range(3))
def test_what_differs_by_chance_alone_stays(seed: int) -> None:
    """Scattered flowers are denser in some places by chance, which is not evidence of light."""
    meadow = texrs.samples.leaves_and_flowers((256, 256), seed=seed).image
    assert (flatten_lighting(meadow) == meadow).all()
    # Most of the added light is removed.
    light = np.exp(0.8 * (np.arange(256) / 256 - 1))[:, np.newaxis]
    lit = np.maximum(meadow * light / 255, 1e-3)
    left = np.log(flatten_lighting(lit, space="srgb") / lit) + np.log(light)
    assert left.mean(axis=(0, 2)).std() < 0.3 * np.log(light).std()


def test_a_tile_is_in_even_light() -> None:
    """Copies of an image with one lighter end show bands. Copies of an evenly lit tile do not."""
    lit = (GRAIN * RAMP).astype(np.uint8)
    as_it_is, even = texrs.tile(lit, size=(ROWS, COLUMNS)), texrs.tile(lit, size=(ROWS, COLUMNS), flatten_lighting=True)
    assert vary(as_it_is.image) > 4 * vary(even.image)
    assert even.report["flatten_lighting"] is True
    source = even.source_map
    assert source.finish is not None
    assert (texrs.apply(source, lit) == even.image).all()
    assert (
        texrs.apply(source, lit, finish=dataclasses.replace(source.finish, flatten_lighting=False))
        == source.render(lit)
    ).all()
    stones = texrs.tile(Material({"albedo": lit, "height": lit[..., 0]}), flatten_lighting=True)
    assert stones.material is not None
    assert (stones.material["albedo"].pixels == texrs.apply(stones.source_map, lit)).all()
    assert (stones.material["height"].pixels == stones.source_map.render(lit[..., 0])).all()


def test_borders_that_meet_still_do() -> None:
    lit = (GRAIN * (1 + 0.3 * np.sin(2 * np.pi * (ROW / ROWS + COLUMN / COLUMNS)))[..., np.newaxis]).astype(np.uint8)
    even = flatten_lighting(lit, wrap=True)
    for moved in ((30, 0), (0, 50), (60, 80)):
        again = flatten_lighting(np.roll(lit, moved, (0, 1)), wrap=True)
        assert np.abs(np.roll(even, moved, (0, 1)).astype(int) - again).max() <= 1
    gain = even.mean(axis=-1) / lit.mean(axis=-1)
    assert np.abs(gain[0] - gain[-1]).max() < 0.05


def test_hues_and_transparency_stay() -> None:
    lit = (np.array([1, 0.6, 0.3]) * GRAIN * RAMP).astype(np.uint8)
    alpha = np.where(COLUMN > 80, 255, 20).astype(np.uint8)
    even = flatten_lighting(np.dstack([lit, alpha]))
    assert (even[..., 3] == alpha).all()
    ratio = even[..., 0].astype(float) / even[..., 2] - lit[..., 0].astype(float) / lit[..., 2]
    assert np.abs(ratio).max() < 0.25
    assert flatten_lighting(np.full((9, 7), 80, np.uint8)).tolist() == np.full((9, 7), 80).tolist()
    assert flatten_lighting(np.zeros((1, 1, 3), np.float32)).tolist() == [[[0, 0, 0]]]


def test_linear_light_is_the_same_picture() -> None:
    lit = np.clip(GRAIN * RAMP / 255, 0, 1).astype(np.float32)
    encoded = flatten_lighting(lit, space="srgb")
    np.testing.assert_allclose(encode_srgb(flatten_lighting(decode_srgb(lit))), encoded, atol=1e-4)


@pytest.mark.parametrize("dtype", ["float16", "float32", "float64"])
@pytest.mark.parametrize("space", ["srgb", "linear"])
@pytest.mark.parametrize("highest", [1.0, 65504.0, 1e15])
def test_no_light_is_endless(dtype: str, space: Any, highest: float) -> None:
    """Lamps with the maximum of the dtype do not become brighter."""
    kind = np.dtype(dtype)
    lit = (GRAIN / 200 * RAMP**2).astype(kind)
    lit[::9, ::11] = min(highest, float(np.finfo(kind).max))
    assert np.isfinite(flatten_lighting(lit, space=space)).all()
    if kind.itemsize > 2:
        lit[3, 4] = -1.1e15
        with pytest.raises(InvalidInput, match=r"image: .*at most 1e\+15.*got 1\.1e\+15"):
            flatten_lighting(lit, space=space)


def test_strips_are_not_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    lit = (GRAIN * RAMP).astype(np.uint8)
    whole = flatten_lighting(lit)
    monkeypatch.setattr(_lighting_correction, "STRIP", 7 * COLUMNS)
    assert (flatten_lighting(lit) == whole).all()


def test_materials_are_flattened_by_their_roles() -> None:
    lit = (GRAIN * RAMP).astype(np.uint8)
    stones = Material({"albedo": lit, "height": lit[..., 0], "emission": lit})
    even = stones.flatten_lighting()
    assert (even["albedo"].pixels == flatten_lighting(lit)).all()
    assert even["height"].pixels is stones["height"].pixels or (even["height"].pixels == lit[..., 0]).all()
    assert (even["emission"].pixels == lit).all()
    assert texrs.materials.flatten_lighting is flatten_lighting


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"amount": 2}, "amount: must be a number between 0 and 1"),
        ({"size": 1}, "size: must be a number between 4"),
        ({"space": "lab"}, "must be one of srgb, linear"),
        ({"wrap": 3}, "wrap"),
    ],
)
def test_bad_options_are_refused(options: dict[str, Any], words: str) -> None:
    with pytest.raises(InvalidInput, match="must contain integers or floats, got bool"):
        flatten_lighting(np.ones((8, 8), np.bool_))

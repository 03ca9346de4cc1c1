"""Materials in folders: packed and unpacked, and with mipmaps that keep the meaning of their maps."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import texrs
from texrs import Material, io
from texrs._colours import decode_srgb
from texrs._typing import Array
from texrs.errors import FileError
from texrs.materials import Map, Role
from texrs.materials._mipmaps import halve

STONES = texrs.samples.pebbles((40, 52)).image
GREYS = STONES[..., 0]


def test_three_maps_are_packed_and_come_back(tmp_path: Path) -> None:
    stones = Material(
        {"albedo": STONES, "ao": GREYS, "height": GREYS, "rough": STONES[..., 1], "metal": STONES[..., 2]}
    )
    paths = stones.save(tmp_path / "packed", pack="orm")
    assert [p.name for p in paths] == ["albedo.png", "orm.png", "height.png"]
    back = Material.read(tmp_path / "packed")
    assert back["orm"].role is Role.ORM
    assert (back["orm"].pixels == STONES).all()
    # The result has the packing of the input, unless another one is requested.
    assert {p.name for p in back.save(tmp_path / "same")} == {"albedo.png", "orm.png", "height.png"}
    assert {p.name for p in back.save(tmp_path / "orm", pack="orm")} == {"albedo.png", "orm.png", "height.png"}
    paths = back.save(tmp_path / "three", pack="none")
    assert {p.name for p in paths} == {"albedo.png", "ao.png", "roughness.png", "metallic.png", "height.png"}
    for name, channel in (("ao", 0), ("roughness", 1), ("metallic", 2)):
        assert (Material.read(tmp_path / "three")[name].pixels == STONES[..., channel]).all()
    assert {p.name for p in stones.save(tmp_path / "kept")} == {f"{name}.png" for name in stones}


def test_what_is_missing_is_usual_and_the_deepest_counts(tmp_path: Path) -> None:
    deep = GREYS.astype(np.uint16) * 257
    cases: list[tuple[dict[str, Array], str, float]] = [
        ({"roughness": GREYS}, "uint8", 255),
        ({"roughness": GREYS, "metallic": GREYS > 100}, "uint8", 255),
        ({"ao": GREYS, "roughness": deep}, "uint16", 65535),
        ({"ao": deep, "roughness": (GREYS / 255).astype(np.float16)}, "float32", 1),
        ({"roughness": (GREYS / 255).astype(np.float16)}, "float16", 1),
        ({"ao": np.dstack([GREYS] * 3), "roughness": GREYS[..., np.newaxis]}, "uint8", 255),
    ]
    for maps, dtype, most in cases:
        path = Material(maps).save(tmp_path, pack="orm")[0]
        packed = io.read(path)
        assert packed.dtype == dtype
        expected = np.stack(
            [
                GREYS / 255 if "ao" in maps else np.ones(GREYS.shape),
                GREYS / 255,
                maps["metallic"] if "metallic" in maps else np.zeros(GREYS.shape),
            ],
            axis=-1,
        )
        np.testing.assert_allclose(packed / most, expected, atol=1e-3)
    # There is nothing to pack or to unpack, so nothing changes.
    assert [p.name for p in Material({"albedo": STONES}).save(tmp_path, pack="orm")] == ["albedo.png"]
    assert [p.name for p in Material({"albedo": STONES}).save(tmp_path, pack="none")] == ["albedo.png"]
    # A separate map takes precedence over the packed one.
    both = Material({"arm": STONES, "rough": GREYS})
    assert {p.name for p in both.save(tmp_path / "b", pack="none")} == {"ao.png", "rough.png", "metallic.png"}
    assert (io.read(tmp_path / "b" / "rough.png") == GREYS).all()


def levels(pixels: Array, role: str, **options: Any) -> list[Array]:
    material = Material({"map": pixels}, roles={"map": role}, **options)
    made = list(halve(material["map"], material.axes))
    for each in made:
        assert (each.pixels.dtype, each.role) == (pixels.dtype, material["map"].role)
        assert each.pixels.shape[material.axes :] == pixels.shape[material.axes :]
    return [each.pixels for each in made]


def test_sizes_are_halved_down_to_one() -> None:
    assert [m.shape for m in levels(GREYS, "height")] == [(20, 26), (10, 13), (5, 6), (2, 3), (1, 1)]
    assert [m.shape for m in levels(GREYS[:1], "height")] == [(1, 26), (1, 13), (1, 6), (1, 3), (1, 1)]
    assert levels(GREYS[:1, :1], "height") == []
    volume = levels(np.zeros((6, 5, 4, 3), np.uint8), "other", axes=3)
    assert [m.shape for m in volume] == [(3, 2, 2, 3), (1, 1, 1, 3)]


def test_colours_are_averaged_as_light() -> None:
    black_white = (np.indices((8, 8)).sum(axis=0) % 2 * 255).astype(np.uint8)
    assert (levels(black_white, "colour")[0] == 188).all()
    assert (levels(black_white, "roughness")[0] == 128).all()
    assert (levels(black_white.astype(np.uint16) * 257, "colour")[0] // 256 == 188).all()
    floats = (black_white / 255).astype(np.float32)
    np.testing.assert_allclose(levels(floats, "colour")[0], 0.5, atol=1e-6)
    np.testing.assert_allclose(levels(floats, "colour", spaces={"map": "srgb"})[0], 188 / 255, atol=2e-3)
    # Compare with slow means of areas, also for odd sides.
    first, second = levels(STONES[:40, :48], "colour")[:2]
    light = decode_srgb(STONES[:40, :48] / np.float32(255)).astype(float)
    for made, side in ((first, 2), (second, 4)):
        expected = light.reshape(40 // side, side, 48 // side, side, 3).mean(axis=(1, 3))
        np.testing.assert_allclose(decode_srgb(made / np.float32(255)), expected, atol=5e-3)
    # Bright floats and doubles keep their values.
    assert levels(np.full((4, 4, 3), 7.5, np.float32), "emission")[1].tolist() == [[[7.5] * 3]]
    assert levels(np.full((4, 4), 1e200), "other")[1].tolist() == [[1e200]]


def test_what_is_transparent_lends_no_colour() -> None:
    pixels = np.zeros((4, 4, 4), np.uint8)
    pixels[::2, :, :3] = (200, 100, 50)
    pixels[::2, :, 3] = 255
    pixels[1::2, :, :3] = (0, 255, 0)
    small = levels(pixels, "colour")[0]
    assert np.abs(small.astype(int) - (200, 100, 50, 128)).max() <= 1


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "int16", "float32", "float16"])
@pytest.mark.parametrize("role", ["normal", "normal-dx"])
def test_normals_keep_their_length(dtype: str, role: str) -> None:
    normal = np.random.default_rng(0).normal((0, 0, 1), 0.4, (16, 24, 3))
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    if np.dtype(dtype).kind == "f":
        pixels, most = normal.astype(dtype), 0.0
    else:
        most = float(np.iinfo(dtype).max)
        pixels = np.rint((normal + 1) / 2 * most if dtype[0] == "u" else normal * most).astype(dtype)
    small = levels(pixels, role)
    values = small[0].astype(float)
    if most:
        values = values / most * 2 - 1 if dtype[0] == "u" else values / most
    np.testing.assert_allclose(np.linalg.norm(values, axis=-1), 1, atol=1e-2)
    mean = normal.reshape(8, 2, 12, 2, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(values, mean / np.linalg.norm(mean, axis=-1, keepdims=True), atol=2e-2)
    # Floats that encode components as 0 to 1 keep this encoding.
    unit = ((normal + 1) / 2).astype(np.float32)
    np.testing.assert_allclose(
        levels(unit, role)[0] * 2 - 1, mean / np.linalg.norm(mean, axis=-1)[..., None], atol=1e-5
    )


@pytest.mark.parametrize("role", ["labels", "mask"])
def test_labels_are_never_mixed(role: str) -> None:
    labels = np.random.default_rng(0).integers(-5, 9, (21, 30)).astype(np.int32) * 1000
    for made in levels(labels, role):
        assert set(made.ravel()) <= set(labels.ravel())
    assert (levels(labels, role)[0][:, 3] == labels[[1, 3, 5, 7, 9, 11, 13, 15, 17, 19], 7]).mean() > 0.4
    assert levels(labels > 0, role)[0].dtype == np.bool_


def test_a_folder_with_mipmaps_is_still_a_material(tmp_path: Path) -> None:
    stones = Material(
        {"albedo": STONES, "height": (GREYS / 255).astype(np.float32), "labels": GREYS.astype(np.int32)},
    )
    paths = stones.save(tmp_path, mipmaps=True)
    names = [str(p.relative_to(tmp_path)) for p in paths]
    assert names[:5] == ["albedo.png", "height.exr", "labels.tif", "mipmaps/albedo.1.png", "mipmaps/albedo.2.png"]
    assert sorted(p for p in tmp_path.rglob("*") if p.is_file()) == sorted(paths)
    assert len(paths) == 3 * 6
    assert io.read(tmp_path / "mipmaps" / "albedo.1.png").shape == (20, 26, 3)
    assert io.read(tmp_path / "mipmaps" / "height.5.exr").shape == (1, 1)
    assert Material.read(tmp_path).shape == (40, 52)
    assert list(Material.read(tmp_path)) == ["albedo", "height", "labels"]
    packed = Material({"arm": STONES}).save(tmp_path / "b", depth=16, mipmaps=True, pack="none")
    assert {io.read(p).dtype for p in packed} == {np.dtype(np.uint16)}
    assert [p.name for p in packed if p.parent.name == "b"] == ["ao.png", "roughness.png", "metallic.png"]


def test_bad_ways_to_save_are_refused(tmp_path: Path) -> None:
    stones = Material({"albedo": STONES})
    (tmp_path / "mipmaps").write_text("mine")
    with pytest.raises(FileError, match="must be a folder"):
        stones.save(tmp_path, mipmaps=True)
    assert (tmp_path / "mipmaps").read_text() == "mine"
    assert list(tmp_path.iterdir()) == [tmp_path / "mipmaps"]
    assert isinstance(stones["albedo"], Map)

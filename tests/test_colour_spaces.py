"""Values keep their meaning in every depth and format: written, read again, compared as light, shares and directions."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import texrs
from texrs import Material, io
from texrs._notices import collect
from texrs.cli import main
from texrs.errors import InputWarning, InvalidInput

RNG = np.random.default_rng(4)
TRUTH = RNG.uniform(0.02, 0.98, (12, 10, 4))
VECTORS = RNG.normal(0, 0.4, (12, 10, 3)) + np.array([0, 0, 1])
VECTORS /= np.linalg.norm(VECTORS, axis=-1, keepdims=True)
VECTORS[..., 2] = np.abs(VECTORS[..., 2])
DTYPES = ("uint8", "uint16", "float16", "float32", "float64")
TARGETS = [
    (".png", 8),
    (".png", 16),
    (".tif", 8),
    (".tif", 16),
    (".tif", 32),
    (".exr", 32),
    (".npy", 8),
    (".npy", 16),
    (".npy", 32),
    (None, None),
    (None, 8),
    (None, 16),
    (None, 32),
]
CHANNELS = {
    "colour": (3, 4),
    "emission": (3,),
    "normal": (3,),
    "normal-dx": (3,),
    "vector": (3,),
    "orm": (3,),
    "other": (1, 3),
}
"""Channels by role. Other roles have one."""
ROLES = (*CHANNELS, "height", "roughness", "metallic", "occlusion", "opacity", "mask")
FINE = {"uint8": 1 / 255, "uint16": 1 / 65535, "float16": 1e-3, "float32": 1e-6, "float64": 1e-6}
"""Largest step between stored values."""
COLOURED, DIRECTED = ("colour", "emission"), ("normal", "normal-dx", "vector")


def to_srgb(light: NDArray[Any]) -> NDArray[Any]:
    return np.where(light <= 0.0031308, light * 12.92, 1.055 * light ** (1 / 2.4) - 0.055)


def to_linear(shown: NDArray[Any]) -> NDArray[Any]:
    return np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)


def encode(role: str, channels: int, dtype: str, *, signed: bool = False) -> NDArray[Any]:
    """Return the file contents of a dtype that represent the truth."""
    values = (VECTORS + 1) / 2 if role in DIRECTED else TRUTH[..., :channels].copy()
    if dtype.startswith("f"):
        return (VECTORS if signed else values[..., 0] if channels == 1 else values).astype(dtype)
    if role in COLOURED:
        values[..., :3] = to_srgb(values[..., :3])
    whole = np.rint(values * np.iinfo(dtype).max).astype(dtype)
    return whole[..., 0] if channels == 1 else whole


def decode(role: str, pixels: NDArray[Any]) -> NDArray[Any]:
    """Return the meaning of a file's values."""
    if pixels.dtype.kind == "f":
        values = pixels.astype(float)
        return (values + 1) / 2 if role in DIRECTED and values.min() < 0 else values
    values = pixels / np.iinfo(pixels.dtype).max
    if role in COLOURED:
        values[..., :3] = to_linear(values[..., :3])
    return values


CASES = [(role, channels, dtype) for role in ROLES for channels in CHANNELS.get(role, (1,)) for dtype in DTYPES]


@pytest.mark.parametrize(("role", "channels", "dtype"), CASES)
def test_every_role_keeps_its_meaning(role: str, channels: int, dtype: str, tmp_path: Path) -> None:
    given = encode(role, channels, dtype)
    material = Material({"map": given}, roles={"map": role})
    truth = (VECTORS + 1) / 2 if role in DIRECTED else TRUTH[..., :channels]
    truth = truth[..., 0] if channels == 1 else truth
    for suffix, depth in TARGETS:
        place = tmp_path / f"{suffix}{depth}"
        material.save(place, suffix=suffix, depth=depth)  # type: ignore[arg-type]
        back = Material.read(place, roles={"map": role})["map"]
        stored = str(back.pixels.dtype)
        if depth is not None:
            assert back.depth == depth
        # A step of sRGB is a step of light up to 2.3 times as large.
        step = 2.3 * max(FINE[dtype], FINE[stored])
        assert np.abs(decode(role, back.pixels) - truth).max() < step, (suffix, depth, stored)
        if stored == dtype:
            # In EXR files, float colours are multiplied by alpha when written and divided when read, so they are
            # rounded.
            bound = (
                suffix in (None, ".exr") and role in COLOURED and channels in (2, 4) and dtype in ("float16", "float32")
            )
            np.testing.assert_allclose(back.pixels, given, rtol=2 * float(np.finfo(dtype).eps) if bound else 0)


@pytest.mark.parametrize("role", DIRECTED)
@pytest.mark.parametrize("dtype", ["float16", "float32", "float64", "int8", "int16"])
def test_signed_directions_keep_theirs(role: str, dtype: str, tmp_path: Path) -> None:
    if dtype.startswith("f"):
        given = encode(role, 3, dtype, signed=True)
    else:
        given = np.rint(VECTORS * np.iinfo(dtype).max).astype(dtype)
    material = Material({"map": given}, roles={"map": role})
    for depth in (8, 16, 32):
        material.save(tmp_path / str(depth), depth=depth)  # type: ignore[arg-type]
        back = Material.read(tmp_path / str(depth), roles={"map": role})["map"].pixels
        assert np.abs(decode(role, back) - (VECTORS + 1) / 2).max() < 1 / 127


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize(("suffix", "depth"), [(".hdr", 32), (".webp", 8), (".bmp", 8), (".jpg", 8), (".npz", 32)])
def test_other_formats_of_colours(dtype: str, suffix: str, depth: Any, tmp_path: Path) -> None:
    flat = np.ascontiguousarray(np.broadcast_to(encode("colour", 3, dtype)[:1, :1], (16, 16, 3)))
    Material({"albedo": flat}).save(tmp_path, suffix=suffix, depth=depth)
    back = decode("colour", Material.read(tmp_path)["albedo"].pixels)
    # Allow a large error, because .hdr and .jpg files have less than 8 bits for dark channels.
    assert np.abs(back - TRUTH[0, 0, :3]).max() < 0.02


def test_materialx_states_the_space_of_its_files(tmp_path: Path) -> None:
    light = np.rint(TRUTH[..., :3] * 65535).astype(np.uint16)
    for depth, space in ((None, "srgb_texture"), (8, "srgb_texture"), (32, "lin_rec709")):
        material = Material({"albedo": light}, spaces={"albedo": "linear"})
        paths = material.save_materialx(tmp_path / f"{depth}.mtlx", depth=depth)  # type: ignore[arg-type]
        assert f'value="{paths[1].name}" colorspace="{space}" />' in paths[0].read_text()
        assert np.abs(decode("colour", io.read(paths[1])) - TRUTH[..., :3]).max() < 2.3 / 255


def test_the_numbers_that_people_meet(tmp_path: Path) -> None:
    grey = Material({"albedo": np.full((8, 8, 3), 128, np.uint8)})
    grey.save(tmp_path / "float", suffix=".exr", depth=32)
    assert io.read(tmp_path / "float" / "albedo.exr").mean() == pytest.approx(0.2158605, abs=1e-5)
    light = np.linspace(0.0, 0.4, 64, dtype=np.float32).reshape(8, 8)
    Material({"albedo": light}).save(tmp_path / "whole", depth=8)
    assert io.read(tmp_path / "whole" / "albedo.png").mean() == pytest.approx((to_srgb(light) * 255).mean(), abs=0.1)


@pytest.mark.parametrize("dtype", DTYPES)
def test_spaces_that_were_stated_hold_on_the_way_out(dtype: str, tmp_path: Path) -> None:
    """Linear integers and sRGB floats are written as readers without this information expect them."""
    whole = dtype.startswith("u")
    values = TRUTH[..., :3] if whole else to_srgb(TRUTH[..., :3])
    given = np.rint(values * np.iinfo(dtype).max).astype(dtype) if whole else values.astype(dtype)
    material = Material({"albedo": given}, spaces={"albedo": "linear" if whole else "srgb"})
    for depth in (None, 8, 16, 32):
        material.save(tmp_path / str(depth), depth=depth)  # type: ignore[arg-type]
        back = Material.read(tmp_path / str(depth))["albedo"].pixels
        # Compare light, because half a linear step near black is many steps of sRGB.
        assert np.abs(decode("colour", back) - TRUTH[..., :3]).max() < 2.3 * max(FINE[dtype], FINE[str(back.dtype)])


def test_labels_keep_their_numbers(tmp_path: Path) -> None:
    ids = RNG.integers(0, 200, (8, 8)).astype(np.uint16)
    for depth in (8, 16, 32):
        Material({"labels": ids}).save(tmp_path, depth=depth)  # type: ignore[arg-type]
        suffix = ".exr" if depth == 32 else ".png"
        assert (io.read(tmp_path / f"labels{suffix}") == ids).all()
    with pytest.raises(InvalidInput, match="labels must be from 0 to 255"):
        Material({"labels": ids + np.uint16(200)}).save(tmp_path, depth=8)


def test_values_that_integers_cannot_hold_are_reported(tmp_path: Path) -> None:
    bright = Material({"albedo": np.full((4, 4, 3), 2, np.float32)})
    with pytest.warns(InputWarning, match="albedo: values below 0 and above 1 are not kept"):
        bright.save(tmp_path, depth=8)
    assert (io.read(tmp_path / "albedo.png") == 255).all()
    bright.save(tmp_path, depth=32)
    assert (io.read(tmp_path / "albedo.exr") == 2).all()
    # Heights in float64 are not scaled to the range 0 to 1.
    Material({"height": np.array([[-2.0, 3.0]])}).save(tmp_path, depth=32)
    assert io.read(tmp_path / "height.exr").tolist() == [[-2, 3]]


@pytest.mark.parametrize("width", [2, 4, 5])
@pytest.mark.parametrize("channels", [(), (3,), (4,)])
def test_volumes_are_converted_too(width: int, channels: tuple[int, ...], tmp_path: Path) -> None:
    """The last columns of a one-channel volume are not its transparency."""
    light = RNG.uniform(0, 1, (6, 3, width, *channels)).astype(np.float32)
    Material({"albedo": light}, axes=3).save(tmp_path, depth=8)
    back = io.read_volume(tmp_path / "albedo.tif") / 255
    colours = light[..., :3] if channels else light
    assert np.abs((back[..., :3] if channels else back) - to_srgb(colours)).max() < 1 / 255
    if channels == (4,):
        assert np.abs(back[..., 3] - light[..., 3]).max() < 1 / 255


def test_mipmaps_and_packed_maps_follow(tmp_path: Path) -> None:
    light = TRUTH[..., :3].astype(np.float32)
    material = Material({"albedo": light, "roughness": light[..., 0], "ao": light[..., 1]})
    material.save(tmp_path, depth=8, pack="orm", mipmaps=True)
    assert np.abs(io.read(tmp_path / "orm.png")[..., :2] / 255 - light[..., [1, 0]]).max() < 1 / 255
    smaller = to_linear(io.read(tmp_path / "mipmaps" / "albedo.1.png") / 255)
    assert np.abs(smaller - light.reshape(6, 2, 5, 2, 3).mean(axis=(1, 3))).max() < 3 / 255


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("depth", [None, 16, 32])
def test_layers_of_an_exr_file_are_light(dtype: str, depth: Any, tmp_path: Path) -> None:
    pixels = encode("colour", 3, dtype)
    made = {"albedo": pixels.astype(np.float32) if dtype == "float64" else pixels}
    back = Material.read(Material(made).save_exr(tmp_path / "a.exr", depth=depth))["albedo"].pixels
    assert np.abs(decode("colour", back) - TRUTH[..., :3]).max() < 2.3 * max(FINE[dtype], FINE[str(back.dtype)])


def test_a_linear_png_is_read_as_it_says(tmp_path: Path) -> None:
    """A gamma of 1 states that the integers are light."""
    whole = np.rint(TRUTH[..., :3] * 65535).astype(np.uint16)
    io.write(tmp_path / "albedo.png", whole, notes=io.Metadata(gamma=1.0))
    material = Material.read(tmp_path)
    assert material["albedo"].space == "linear"
    material.save(tmp_path / "new", depth=32)
    assert np.abs(io.read(tmp_path / "new" / "albedo.exr") - TRUTH[..., :3]).max() < 1e-4


def test_commands_write_light(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("rock").mkdir()
    io.write("rock/albedo.png", np.full((32, 32, 3), 128, np.uint8))
    io.write("rock/roughness.png", np.full((32, 32), 128, np.uint8))
    words = ["design", "rock", "--size", "32x32", "-q"]
    assert main([*words, "-o", "out", "--format", "exr", "--depth", "32"]) == 0
    assert io.read("out/albedo.exr").mean() == pytest.approx(0.2158605, abs=1e-5)
    assert io.read("out/roughness.exr").mean() == pytest.approx(128 / 255, abs=1e-6)
    assert main(["design", "out", "--size", "32x32", "-q", "-o", "back", "--format", "png", "--depth", "8"]) == 0
    assert (io.read("back/albedo.png") == 128).all()
    assert (io.read("back/roughness.png") == 128).all()


@pytest.mark.parametrize("out", ["a.exr", "a.hdr"])
def test_a_single_picture_is_not_converted_silently(
    out: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    io.write(tmp_path / "albedo.png", texrs.samples.pebbles((48, 48)).image)
    assert main(["tile", str(tmp_path / "albedo.png"), "-o", str(tmp_path / out)]) == 2
    assert "cannot store uint8" in capsys.readouterr().err


def test_colours_are_divided_by_alpha_on_the_way_out_of_exr(tmp_path: Path) -> None:
    alpha = np.linspace(-0.2, 1, 20 * 18).clip(0, 1).reshape(20, 18, 1)
    light = TRUTH.repeat(2, axis=0)[:20].repeat(2, axis=1)[:, :18, :3]
    for folder, colours in (("multiplied", light * alpha), ("data", light)):
        (tmp_path / folder).mkdir()
        io.write(tmp_path / folder / "leaf_color.exr", np.dstack([colours, alpha]).astype(np.float32))
        with collect(show=lambda _: None) as notices:
            Material.read(tmp_path / folder).save(tmp_path / "out", suffix=".png", depth=8)
        said = "leaf_color.exr: colours are divided by alpha, because EXR files store them multiplied by alpha"
        assert (said in notices.assumed) is (folder == "multiplied")
        shown = io.read(next((tmp_path / "out").glob("*.png"))) / 255
        linear = np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)[..., :3]
        seen = alpha[..., 0] > 0.02
        assert np.abs(linear - light)[seen].max() < 0.005
        assert np.abs(shown[..., 3] - alpha[..., 0]).max() < 0.003

"""Rectified floors: flat, level, with the photograph's own pixels; user errors; the command."""

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import texrs
from plane_checks import SIDE, look, look_twice
from texrs import Plane, PlaneView, io, scale_maps
from texrs.cli import main
from texrs.errors import InvalidInput

PLANE = Plane((240, 288), 45, 90, fov=55)


@cache
def look_at_floor() -> np.ndarray:
    return look("dots", PLANE)


def test_a_flat_texture_is_as_it_was() -> None:
    """A pattern of lines, seen obliquely, is level and evenly spaced again."""
    rows, columns = np.indices((SIDE, SIDE))
    lines = np.where((rows % 32 < 4) | (columns % 48 < 4), 40, 200).astype(np.uint8)[..., np.newaxis]
    plane = Plane((240, 288), 45, 60, fov=55)
    flat = texrs.rectify(look("", plane, flat=lines), view=plane, resolution=1.0).image[..., 0].astype(float)
    for axis, period in ((1, 32), (0, 48)):
        profile = flat.mean(axis=axis) - flat.mean()
        power = np.abs(np.fft.rfft(profile * np.hanning(len(profile)), 4096))
        assert abs(4096 / power[20:].argmax() - period) < 100
        found = 4096 / (20 + power[20:].argmax())
        assert abs(found - period) < 0.04 * period or abs(found - period / 2) < 0.02 * period


def test_scales_are_even() -> None:
    result = texrs.rectify(look_at_floor(), view=PlaneView(slant=45, fov=55))
    before, after = (
        np.log(scale_maps.from_mask(scale_maps.auto_mask(picture), trend="plane")).std()
        for picture in (look_at_floor(), result.image)
    )
    assert after < 0.4 * before
    assert result.report["plane"]["slant"] == 45
    assert not result.report["found"]
    assert result.stages["sharp"].any()


def test_pixels_are_the_photograph_s() -> None:
    result = texrs.rectify(look_at_floor(), view=PLANE)
    np.testing.assert_array_equal(result.source_map.render(look_at_floor(), antialias=True), result.image)
    np.testing.assert_array_equal(result.stages["before_blending"], result.image)
    # A map in register with the photograph is looked up too. This one contains the pixel coordinates.
    places = np.moveaxis(np.indices(PLANE.shape), 0, -1).astype(np.float32)
    np.testing.assert_allclose(
        result.source_map.render(places, interpolation="linear"), result.source_map.coordinates, atol=1e-3
    )
    # Frames follow the plane: a step down in the texture is this step in the photograph.
    down = np.diff(result.source_map.coordinates, axis=0)
    np.testing.assert_allclose(down, result.source_map.jacobians()[:-1, :, :, 0], atol=0.05)


def test_normals_turn_with_the_plane() -> None:
    """A normal to the right in the photograph points up in a texture that is rotated by 90 degrees, counter-clockwise."""
    right = np.empty((*PLANE.shape, 3), np.uint8)
    right[...] = np.rint((np.array([0.6, 0.0, 0.8]) + 1) * 127.5)
    for turn, leans in ((0, (0.6, 0.0)), (90, (0.0, 0.6)), (180, (-0.6, 0.0))):
        source = texrs.rectify(look_at_floor(), view=Plane(PLANE.shape, 0, 90, rotation=turn)).source_map
        found = texrs.apply(source, right, map_type="normal") / 127.5 - 1
        np.testing.assert_allclose(found.reshape(-1, 3).mean(axis=0), (*leans, 0.8), atol=0.02)
        # Heights are plain numbers, so they only move.
        np.testing.assert_array_equal(texrs.apply(source, right[..., 0]), right[0, 0, 0])


@pytest.mark.parametrize("size", [None, 96, (80, 128)])
def test_materials_become_flat_and_cyclic(size: int | tuple[int, int] | None) -> None:
    normals = np.empty((*PLANE.shape, 3), np.uint8)
    normals[...] = (128, 128, 255)
    maps = {"albedo": look_at_floor(), "height": look_at_floor()[..., :1].astype(np.uint16) * 257, "normal": normals}
    made = texrs.rectify(texrs.Material(maps), view=PLANE, wrap=True, size=size)
    assert made.material is not None
    shapes = {name: each.pixels.shape[:2] for name, each in made.material.items()}
    assert len(set(shapes.values())) == 1
    if size is not None:
        assert set(shapes.values()) == {(96, 96) if size == 96 else size}
    assert made.material["height"].pixels.dtype == np.uint16
    edge = made.image.astype(float)
    for axis in (0, 1):
        inside = np.abs(np.diff(edge, axis=axis)).mean()
        assert np.abs(np.take(edge, 0, axis) - np.take(edge, -1, axis)).mean() < 2 * inside


@pytest.mark.parametrize("dtype", [np.uint16, np.float32])
def test_dtypes_and_channels_stay(dtype: type) -> None:
    grey = look_at_floor()[..., 0].astype(dtype)
    result = texrs.rectify(grey, view=PLANE)
    assert result.image.dtype == dtype
    assert result.image.ndim == 2
    assert result.stages["before_blending"].shape == result.image.shape


def test_any_size_and_cyclic() -> None:
    whole = texrs.rectify(look_at_floor(), view=PLANE)
    rows, columns = whole.image.shape[:2]
    middle = texrs.rectify(look_at_floor(), view=PLANE, size=(rows - 10, columns - 20))
    np.testing.assert_array_equal(middle.source_map.coordinates, whole.source_map.coordinates[5:-5, 10:-10])
    larger = texrs.rectify(look_at_floor(), view=PLANE, size=(rows + 64, columns), seed=3)
    assert larger.image.shape[:2] == (rows + 64, columns)
    assert larger.report["grown"] == "design"
    cyclic = texrs.rectify(look_at_floor(), view=PLANE, wrap=True, size=128)
    assert cyclic.image.shape == (128, 128, 3)
    image = cyclic.image.astype(float)
    inside = np.abs(np.diff(image, axis=0)).mean()
    assert np.abs(image[0] - image[-1]).mean() < 2 * inside


def test_it_is_found_and_levelled() -> None:
    plane = Plane((192, 224), 40, 80, fov=60)
    picture = look("weave", plane)
    result = texrs.rectify(picture)
    assert result.report["found"]
    assert abs(result.report["plane"]["slant"] - 40) <= 8
    again = texrs.rectify(picture)
    np.testing.assert_array_equal(result.image, again.image)


def test_doubtful_planes_are_told() -> None:
    with pytest.warns(UserWarning, match="confidence of 0"):
        texrs.rectify(look_twice())


def test_only_the_ground_is_used() -> None:
    ground = np.zeros(PLANE.shape, bool)
    ground[100:, 40:] = True
    result = texrs.rectify(look_at_floor(), view=PlaneView(plane=PLANE, ground=ground))
    rows, columns = np.rint(result.source_map.coordinates).astype(int).reshape(-1, 2).T
    assert ground[rows, columns].mean() > 0.99


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda: texrs.rectify(look_at_floor(), view=Plane((9, 9), 0)),
            "plane: must have the shape of the image, 240 x 288",
        ),
        (
            lambda: texrs.rectify(look_at_floor(), view=PLANE, resolution=7.9),
            "resolution: must be at most|almost no part",
        ),
        (lambda: texrs.rectify(look_at_floor(), view=PlaneView(slant=88, fov=10)), "sharp|in front of its horizon"),
        (
            lambda: texrs.rectify(look_at_floor(), view=PlaneView(ground=np.zeros((240, 288), bool))),
            "ground: must mark at least one pixel",
        ),
        (lambda: texrs.rectify(look_at_floor(), view=PlaneView(ground=np.zeros((9, 9), bool))), "ground"),
    ],
)
def test_what_cannot_be_rectified_gets_a_sentence(make: Callable[[], object], words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        make()


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    photo, out, source = (str(tmp_path / n) for n in ("floor.png", "flat.png", "map.npz"))
    io.write(photo, look_at_floor())
    assert (
        main(
            [
                "rectify",
                photo,
                "-o",
                out,
                "--slant",
                "45",
                "--fov",
                "55",
                "--source-map",
                source,
                "--stages",
                str(tmp_path / "s"),
            ]
        )
        == 0
    )
    assert "slant 45.0 and tilt 90.0" in capsys.readouterr().err
    np.testing.assert_array_equal(io.read(out), texrs.rectify(look_at_floor(), view=PlaneView(slant=45, fov=55)).image)
    assert json.loads((tmp_path / "s" / "report.json").read_text())["plane"]["fov"] == 55
    assert main(["apply", source, photo, "-o", str(tmp_path / "again.png")]) == 0
    corners = PLANE.project([[-20, -30], [-20, 40], [25, 40], [25, -30]])
    words = " ".join(f"{c:.4f},{r:.4f}" for r, c in corners)
    assert main(["rectify", photo, "-o", out, "--corners", words, "--wrap", "xy", "--size", "96"]) == 0
    assert io.read(out).shape == (96, 96, 3)
    assert main(["rectify", photo, "-o", out, "--corners", "1,2 3,4"]) == 2
    assert "corners" in capsys.readouterr().err


def test_what_a_camera_states_is_used(tmp_path: Path) -> None:
    from PIL import Image

    exif = Image.Exif()
    exif.get_ifd(0x8769)[0xA405] = 28
    photo, out = tmp_path / "floor.jpg", tmp_path / "flat.png"
    Image.fromarray(look_at_floor()).save(photo, exif=exif, quality=95)
    fov = io.read_fov(photo)
    assert fov == pytest.approx(65.47, abs=0.01)
    said = ["rectify", str(photo), "-o", str(out), "--slant", "45"]
    assert main([*said, "--stages", str(tmp_path)]) == 0
    assert json.loads((tmp_path / "report.json").read_text())["plane"]["fov"] == pytest.approx(fov)
    assert main([*said, "--fov", "50", "--stages", str(tmp_path)]) == 0
    assert json.loads((tmp_path / "report.json").read_text())["plane"]["fov"] == 50
    for damaged in (photo.read_bytes()[:200], b"", b"\xff\xd8\xff\xe1\xff\xffExif\0\0II*\0\xff\xff\xff\xff"):
        (tmp_path / "damaged.jpg").write_bytes(damaged)
        assert io.read_fov(tmp_path / "damaged.jpg") is None

"""``texrs solid`` and ``texrs synthesize``, end to end."""

from __future__ import annotations

import json
import re
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest

import texrs
from texrs import SourceMap, fields, io, samples
from texrs.cli import main
from texrs.cli._texts import parse_axes, parse_bytes
from texrs.errors import InvalidInput

Capture = pytest.CaptureFixture[str]
VOLUME = samples.stripes((32, 32, 32)).image
PICTURE = samples.dots((64, 64)).image


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in a folder with a volume, an image and earlier results."""
    monkeypatch.chdir(tmp_path)
    io.write_volume("v.npy", VOLUME)
    iio.imwrite("in.png", PICTURE)
    for name in ("out.tif", "out.png"):
        Path(name).touch()
    return tmp_path


def files(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() if p.is_file() else b"" for p in folder.rglob("*")}


def test_solid_writes_what_the_function_makes(here: Path, capsys: Capture) -> None:
    options = "--size 18x24x20 --field zigzag:period=16 --seed 3 --quality fast --wrap zx --interpolation cubic"
    more = "--no-labels --memory-limit 1G --threads 1 --stages stages --source-map map.npz"
    assert main(["solid", "v.npy", "-o", "out.tif", *options.split(), *more.split()]) == 0
    expected = texrs.solid(
        VOLUME,
        (20, 24, 18),
        field=fields.zigzag(16),
        seed=3,
        quality="fast",
        wrap=(True, False, True),
        interpolation="cubic",
    )
    np.testing.assert_array_equal(io.read_volume("out.tif"), expected.image)
    places = SourceMap.load("map.npz")
    np.testing.assert_array_equal(places.coordinates, expected.source_map.coordinates)
    report = json.loads(Path("stages/report.json").read_text())
    assert report.pop("texrs")["verb"] == "solid"
    assert report == json.loads(json.dumps(expected.report))
    assert sorted(p.name for p in Path("stages").iterdir())[3] == "04-before-blending.png"
    said = capsys.readouterr()
    assert said.out == ""
    assert "blocks" in said.err
    assert re.search(r"wrote out.tif: 18 x 24 x 20, 3 channels, uint8, in [0-9.]+ s\n$", said.err)
    assert not list(here.glob(".texrs*"))
    # Another map of the example is looked up in the same way.
    io.write_volume("height.npy", VOLUME[..., 0].astype(np.float32))
    assert main(["apply", "map.npz", "height.npy", "-o", "height.tif", "--interpolation", "cubic", "-q"]) == 0
    assert io.read_volume("height.tif").shape == (20, 24, 18)
    assert main(["info", "map.npz"]) == 0
    assert "18 x 24 x 20, made from 32 x 32 x 32" in capsys.readouterr().out


def test_synthesize_writes_what_the_function_makes(here: Path, capsys: Capture) -> None:
    arguments = "--size 56x40 --field spiral:angle=15 --seed 9 --wrap y --quality fast --source-map s.npz --quiet"
    assert main(["synthesize", "in.png", "-o", "out.png", *arguments.split()]) == 0
    spiral = fields.spiral(15, axes=2)
    expected = texrs.synthesize(PICTURE, (40, 56), field=spiral, seed=9, wrap=(True, False), quality="fast")
    np.testing.assert_array_equal(iio.imread("out.png"), expected.image)
    np.testing.assert_array_equal(SourceMap.load("s.npz").coordinates, expected.source_map.coordinates)
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("name", ["a.npy", "a.npz", "a.tif", "a.vti"])
def test_volumes_are_written_in_many_formats(here: Path, name: str) -> None:
    assert main(["solid", "sample:particles", "-o", name, "--size", "16", "--quality", "fast", "-q"]) == 0
    assert Path(name).stat().st_size > 16**3 / 4
    if not name.endswith(".vti"):
        assert io.read_volume(name).shape == (16, 16, 16, 3)


def test_held_values_come_from_files(here: Path) -> None:
    held = np.zeros((20, 20, 20), np.uint8)
    held[6:14, 6:14, 6:14] = 255
    values = VOLUME[:20, :20, :20].copy()
    io.write_volume("held.tif", held)
    io.write_volume("values.npy", values)
    arguments = "--size 20 --constraint-mask held.tif --constraint-values values.npy --quality fast -q"
    assert main(["solid", "v.npy", "-o", "out.tif", *arguments.split()]) == 0
    np.testing.assert_array_equal(io.read_volume("out.tif")[held > 0], values[held > 0])
    mask = np.zeros((64, 64), np.uint8)
    mask[20:40] = 255
    iio.imwrite("mask.png", mask)
    arguments = "--size 64 --constraint-mask mask.png --constraint-values in.png --quality fast -q"
    assert main(["synthesize", "in.png", "-o", "out.png", *arguments.split()]) == 0
    np.testing.assert_array_equal(iio.imread("out.png")[mask > 0], PICTURE[mask > 0])


def test_maps_to_follow_come_from_files(here: Path, capsys: Capture) -> None:
    ramp = np.linspace(0, 1, 64, dtype=np.float32)[:, np.newaxis].repeat(64, 1)
    io.write("mine.tif", ramp)
    io.write("theirs.tif", ramp[::-1, :48])
    arguments = "--size 48x64 --guide-exemplar mine.tif --guide-output theirs.tif --guide-weight 2 --quality fast -q"
    assert main(["synthesize", "in.png", "-o", "out.png", *arguments.split()]) == 0
    expected = texrs.synthesize(
        PICTURE, (64, 48), guide=texrs.Guide(exemplar=ramp, output=ramp[::-1, :48], weight=2), quality="fast"
    )
    np.testing.assert_array_equal(iio.imread("out.png"), expected.image)
    wrong = "synthesize in.png -o no.png --size 32 --guide-exemplar mine.tif --guide-output theirs.tif -q"
    assert main(wrong.split()) == 2
    assert "mine.tif and theirs.tif: the map of the output must contain" in capsys.readouterr().err


def test_frames_come_from_a_file_and_sizes_from_the_example(here: Path) -> None:
    frames = np.stack([fields.rotation(a, "xy", axes=2).constant for a in range(4)]).reshape(2, 2, 2, 2)
    np.savez("frames.npz", frames)
    assert main(["synthesize", "in.png", "-o", "out.png", "--field", "frames.npz", "--quality", "fast", "-q"]) == 0
    field = fields.from_array(frames, (128, 128))
    np.testing.assert_array_equal(
        iio.imread("out.png"), texrs.synthesize(PICTURE, 128, field=field, quality="fast").image
    )


WRONG = [
    ("solid v.npy -o out.tif --size 20x20", "--size: must be WIDTHxHEIGHTxDEPTH, as in 128x96x64, or one number"),
    ("solid v.npy -o out.tif --size 0", "--size: each side must be at least 1"),
    ("solid v.npy -o out.tif --size 10000", "--size: 10000 x 10000 x 10000 has 1000000000000 pixels"),
    (
        "solid v.npy -o out.tif --size 64 --memory-limit 9M",
        "MB of memory, more than the limit of 9.4 MB; write to OUT.zarr",
    ),
    ("solid v.npy -o out.tif --memory-limit lots", "--memory-limit: must be a number of bytes, as in 900M"),
    ("solid v.npy -o out.tif --field circles", "--field: must be one of"),
    ("solid v.npy -o out.tif --field zigzag:angle=x", "--field: angle must be a number"),
    ("solid v.npy -o out.tif --size 20 --field scale_ramp:start=0.125,stop=0.12", "--field: scale_ramp: stop"),
    ("solid v.npy -o out.tif --field none.npz", "none.npz: does not exist"),
    ("solid v.npy -o out.tif --wrap xxy", "--wrap: must be default, none, or some of the letters x, y and z"),
    ("solid v.npy -o out.tif --quality best", "--quality: must be one of preserve, fast, optimise; got 'best'"),
    ("solid v.npy -o out.tif --method literal", "--method: must be one of default, paper, paper-compensated"),
    ("solid v.npy -o out.tif --interpolation best", "--interpolation: must be one of default, nearest, linear, cubic"),
    ("solid v.npy -o out.tif --seed -1", "--seed: must be an integer between 0"),
    ("solid v.npy -o out.tif --labels --size 20", "--labels: must have one channel, got 3"),
    ("solid v.npy -o out.tif --constraint-mask m.npy", "m.npy: does not exist"),
    (
        "solid v.npy -o out.tif --size 20 --constraint-mask v.npy --constraint-values v.npy",
        "v.npy: must have shape 20 x 20 x 20",
    ),
    ("solid v.npy -o out.tif --threads 0", "--threads: must be an integer between 1"),
    ("solid v.npy -o out.png", "out.png: .png cannot store volumes of uint8 with 3 channels"),
    ("solid v.npy -o out.tif --source-map m.txt", "--source-map: must be a name that ends in .npz"),
    ("solid v.npy -o none/out.tif", "does not exist"),
    ("solid w.npy -o out.tif", "w.npy: does not exist"),
    ("solid in.png -o out.tif", "in.png: is an image of 64 x 64, but a volume is needed"),
    ("solid sample:dots -o out.tif", "sample:dots: must be a volume, got an image; built-in volumes are particles"),
    ("solid sample:dotz -o out.tif", "name: must be a generated sample"),
    ("solid v.npy", "Missing option"),
    ("synthesize v.npy -o out.png", "v.npy"),
    ("synthesize in.png -o out.png --size 9x9x9", "--size: must be WIDTHxHEIGHT"),
    ("synthesize in.png -o out.png --wrap z", "--wrap: must be one of default, xy, x, y, none"),
    ("synthesize in.png -o out.png --field rotation_3d", "--field: rotation_3d is only available for volumes"),
    ("synthesize in.png -o out.exr", "out.exr: .exr cannot store"),
]


@pytest.mark.parametrize(("arguments", "says"), WRONG)
def test_wrong_requests_get_a_line_and_change_nothing(here: Path, capsys: Capture, arguments: str, says: str) -> None:
    before = files(here)
    assert main([*arguments.split(), "--quiet"]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert says in said.err
    assert said.err.count("\n") == 1
    assert files(here) == before


def test_thin_and_broken_volumes(here: Path, capsys: Capture) -> None:
    io.write_volume("thin.npy", VOLUME[:1])
    io.write_volume("nan.npy", np.full((20, 20, 20), np.nan, np.float32))
    for name, says in (
        ("thin", "each side must be at least 16, got shape 32 x 32 x 1"),
        ("nan", "must be finite, but 8000 of 8000 values"),
    ):
        assert main(["solid", f"{name}.npy", "-o", "out.tif", "-q"]) == 2
        assert f"{name}.npy: {says}" in capsys.readouterr().err
    assert Path("out.tif").read_bytes() == b""


def test_words() -> None:
    assert parse_axes("zx", axes=3) == (True, False, True)
    assert parse_axes("none", axes=3) == (False, False, False)
    assert parse_axes("x", axes=2) == (False, True)
    assert [parse_bytes(t) for t in ("7", "900M", "2 GiB".replace(" ", ""), "1kb")] == [7, 900 << 20, 2 << 30, 1024]
    for text in ("", "0", "1.5G", "-1", "G"):
        with pytest.raises(InvalidInput, match="--memory-limit"):
            parse_bytes(text)

"""The commands that mend an image, end to end: ``texrs tile`` and ``texrs inpaint``."""

from __future__ import annotations

import functools
import importlib
import re
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest

import texrs
from texrs import SourceMap, samples
from texrs.cli import main

Capture = pytest.CaptureFixture[str]
COLOURS = samples.load("pebbles", size=(64, 80)).image
HOLE = np.zeros((64, 80), bool)
HOLE[20:34, 30:50] = True
BEFORE = b""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in a folder with an image, a hole in it, another image and an earlier result."""
    monkeypatch.chdir(tmp_path)
    iio.imwrite("in.png", COLOURS)
    iio.imwrite("hole.png", HOLE.astype(np.uint8) * 255)
    iio.imwrite("other.png", samples.load("beans", size=(64, 64)).image)
    Path("out.png").write_bytes(BEFORE)
    return tmp_path


def files(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() if p.is_file() else b"" for p in folder.rglob("*")}


# --- results ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "options"),
    [
        ("", {}),
        ("--wrap x --overlap 12", {"wrap": (False, True), "overlap": 12}),
        ("--wrap y --overlap 30x10 --threads 1", {"wrap": (True, False), "overlap": (10, 30)}),
        ("--wrap none", {"wrap": False}),
        ("--size 60x48", {"size": (48, 60)}),
    ],
)
def test_tile_writes_what_the_function_makes(here: Path, capsys: Capture, arguments: str, options: dict) -> None:
    more = ["--stages", "stages", "--source-map", "s.npz"]
    assert main(["tile", "in.png", "-o", "out.png", *arguments.split(), *more]) == 0
    expected = texrs.tile(COLOURS, **options)
    assert (iio.imread("out.png") == expected.image).all()
    assert (SourceMap.load("s.npz").coordinates == expected.source_map.coordinates).all()
    assert sorted(p.name for p in Path("stages").iterdir()) == [
        "01-shifted.png",
        "02-source-regions.png",
        "03-before-blending.png",
        "report.json",
    ]
    rows, columns = expected.image.shape[:2]
    out, err = capsys.readouterr()
    assert out == ""
    last = (
        rf"texrs: wrote out.png: {columns} x {rows}, 3 channels, uint8, [0-9]+% of the pixels in place.*, in [0-9.]+ s"
    )
    assert re.fullmatch(last, err.splitlines()[-1])


def test_inpaint_writes_what_the_function_makes(here: Path, capsys: Capture) -> None:
    options = (
        "--patch-size 10 --boundary-width 2 --no-allow-mirror --wrap x --seed 4 --stages stages --source-map s.npz"
    )
    assert main(["inpaint", "in.png", "hole.png", "-o", "out.png", *options.split()]) == 0
    expected = texrs.inpaint(
        COLOURS, HOLE, patch_size=10, boundary_width=2, allow_mirror=False, wrap=(False, True), seed=4
    )
    assert (iio.imread("out.png") == expected.image).all()
    assert (SourceMap.load("s.npz").label == expected.source_map.label).all()
    assert (iio.imread("stages/01-known.png")[HOLE] == COLOURS[~HOLE].min()).all()
    out, err = capsys.readouterr()
    assert out == ""
    assert err.splitlines()[0] == "texrs: inpaint"


def test_inpaint_from_another_picture_and_apply(here: Path) -> None:
    command = ["inpaint", "in.png", "hole.png", "--exemplar", "other.png", "-o", "out.png", "--source-map", "s.npz"]
    assert main([*command, "-q"]) == 0
    expected = texrs.inpaint(COLOURS, HOLE, exemplar=iio.imread("other.png")).image
    assert (iio.imread("out.png") == expected).all()
    assert main(["apply", "s.npz", "in.png", "other.png", "-o", "again.png", "-q"]) == 0
    assert (iio.imread("again.png") == expected).all()


def test_any_mask_is_a_hole(here: Path) -> None:
    grey = HOLE.astype(np.uint8) * 3
    for name, mask in (
        ("rgb.png", np.dstack([grey, 0 * grey, 0 * grey])),
        ("rgba.png", np.dstack([grey, grey, grey, grey * 0 + 255])),
        ("ga.png", np.dstack([grey, grey * 0 + 255])),
        ("one.png", grey),
        ("wide.png", grey.astype(np.uint16) * 257),
    ):
        iio.imwrite(name, mask)
        assert main(["inpaint", "in.png", name, "-o", f"out-{name}", "-q"]) == 0
        assert (iio.imread(f"out-{name}") == iio.imread("out-rgb.png")).all()


def test_floats_may_be_unknown_in_the_hole(here: Path) -> None:
    image = COLOURS.astype(np.float32) / 64
    image[HOLE] = np.nan
    np.save("in.npy", image)
    assert main(["inpaint", "in.npy", "hole.png", "-o", "out.exr", "-q"]) == 0
    result = texrs.io.read("out.exr")
    assert np.isfinite(result).all()
    assert (result[~HOLE] == image[~HOLE]).all()


def test_same_command_same_bytes(here: Path, capsys: Capture) -> None:
    for command in (["tile", "in.png"], ["inpaint", "in.png", "hole.png"]):
        for count in ("1", "2", "7"):
            assert main([*command, "-q", "--threads", count, "-o", f"{count}.png", "--force"]) == 0
        assert len({Path(f"{count}.png").read_bytes() for count in "127"}) == 1
    assert capsys.readouterr() == ("", "")


def test_photograph_by_name(here: Path) -> None:
    assert main(["tile", "sample:dots", "-o", "out.png", "-q"]) == 0
    assert (iio.imread("out.png") == texrs.tile(samples.load("dots").image).image).all()


# --- what is refused -------------------------------------------------------------------------------------------------

REFUSED = {
    "tile no.png": "no.png",
    "tile in.png --wrap z": "--wrap: must be one of",
    "tile in.png --overlap 0": "--overlap: each side must be at least 1",
    "tile in.png --overlap 33": "--overlap: must be an integer between 1 and 32, got 33 (at most half of the 64 rows)",
    "tile in.png --overlap 41x10": "between 1 and 40, got 41 (at most half of the 80 columns)",
    "tile in.png --overlap a": "--overlap: must be WIDTHxHEIGHT",
    "tile in.png --source-map s.png": "--source-map: must be a name that ends in .npz",
    "tile in.png --stages in.png": "in.png: is not a folder",
    "tile in.png --stages out.png": "--stages: out.png is already the output of --out",
    "tile in.png --threads 0": "--threads: must be",
    "tile in.png hole.png": "--help",
    "tile": "--help",
    "inpaint in.png": "MASK: must be a mask",
    "inpaint in.png no.png": "no.png",
    "inpaint no.png hole.png": "no.png",
    "inpaint in.png other.png": "other.png: must have shape 80 x 64, got 64 x 64",
    "inpaint in.png white.png": "white.png: must leave pixels to copy from, but covers the whole image",
    "inpaint in.png lines.png": "lines.png: must leave a square of 4 x 4 known pixels",
    "inpaint in.png hole.png --patch-size 65": "--patch-size: must be an integer between 4 and 64, got 65",
    "inpaint in.png hole.png --patch-size 60": "--patch-size: a patch of side 60 does not fit",
    "inpaint in.png hole.png --boundary-width -1": "--boundary-width: must be",
    "inpaint in.png hole.png --seed -1": "--seed: must be",
    "inpaint in.png hole.png --wrap yes": "--wrap: must be one of",
    "inpaint in.png hole.png --exemplar hole.png": "hole.png: must have the dtype and channels of the image",
    "inpaint in.png hole.png --exemplar no.png": "no.png",
    "inpaint nan.npy hole.png": "nan.npy",
    "inpaint in.png nan.npy": "nan.npy: must be finite",
}


def test_the_width_of_a_correction_is_checked_before_maps_are_read(here: Path, capsys: Capture) -> None:
    SourceMap.identity((64, 80)).save("map.npz")
    assert main(["apply", "map.npz", "no.png", "-o", "out.png", "--band", "-5"]) == 2
    assert "--band: must be an integer between 1" in capsys.readouterr().err


@pytest.mark.parametrize("command", REFUSED)
def test_bad_input_gets_one_line_and_leaves_what_was_there(here: Path, capsys: Capture, command: str) -> None:
    lines = HOLE.copy()
    lines[::3] = True
    iio.imwrite("lines.png", lines.astype(np.uint8))
    iio.imwrite("white.png", np.full((64, 80), 255, np.uint8))
    np.save("nan.npy", np.where(np.arange(64 * 80).reshape(64, 80) == 3, np.nan, np.float32(1)))
    before = files(here)
    assert main([*command.split(), "-o", "out.png" if "nan.npy hole" not in command else "out.tif"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    lines = [line for line in err.splitlines() if line not in ("texrs: inpaint", "texrs: join columns")]
    assert len(lines) == 1, err
    assert lines[0].startswith("texrs: ")
    assert REFUSED[command] in lines[0]
    assert files(here) == before


@pytest.mark.parametrize("command", ["tile in.png", "inpaint in.png hole.png"])
@pytest.mark.parametrize("out", ["out.xyz", "no/out.png", ".", "out.exr"])
def test_outputs_are_checked_before_the_work(
    here: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch, command: str, out: str
) -> None:
    for name, verb in (("texrs.tiling", "tile"), ("texrs.inpainting", "inpaint")):
        module = importlib.import_module(name)

        # Arguments must be refused before the verb is called, so a call is an internal error.
        def fail(*arguments: object, **options: object) -> None:
            raise RuntimeError("the work has begun")

        monkeypatch.setattr(module, verb, functools.wraps(getattr(module, verb))(fail))
    before = files(here)
    assert main([*command.split(), "-o", out]) == 2
    assert files(here) == before
    assert len(capsys.readouterr().err.splitlines()) == 1


@pytest.mark.parametrize("command", ["tile in.png", "inpaint in.png hole.png"])
def test_failed_writing_leaves_what_was_there(
    here: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch, command: str
) -> None:
    def full(*args: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(SourceMap, "save", full)
    before = files(here)
    assert main([*command.split(), "-q", "-o", "out.png", "--source-map", "s.npz"]) == 2
    assert "no space left on device" in capsys.readouterr().err
    assert files(here) == before

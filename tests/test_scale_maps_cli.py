"""The command that makes scale maps, end to end."""

from __future__ import annotations

import json
import re
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest

from texrs import io, samples, scale_maps
from texrs.cli import main

Capture = pytest.CaptureFixture[str]
FLOOR = samples.tilted_discs((96, 128))
EDITS = [{"op": "magnify", "region": [40, 40, 12], "factor": 2}, {"op": "smooth", "sigma": 3}]
BEFORE = b""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in a folder with an image, its mask, a hole, edits and an earlier result."""
    monkeypatch.chdir(tmp_path)
    iio.imwrite("in.png", FLOOR.image)
    iio.imwrite("mask.png", FLOOR.mask.astype(np.uint8) * 255)
    hole = np.zeros((96, 128, 3), np.uint8)
    hole[30:60, 40:80] = 200
    iio.imwrite("hole.png", hole)
    iio.imwrite("small.png", np.full((8, 8), 255, np.uint8))
    Path("edits.json").write_text(json.dumps(EDITS), encoding="utf-8")
    Path("bad.json").write_text('[{"op": "erase"}]', encoding="utf-8")
    Path("out.tif").write_bytes(BEFORE)
    return tmp_path


KNOWN = np.ones((96, 128), bool)
KNOWN[30:60, 40:80] = False


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ("--slant 45 --tilt 10", lambda: scale_maps.from_angles((96, 128), 45, 10)),
        ("--slant 45", lambda: scale_maps.from_angles((96, 128), 45, 90)),
        ("--slant 40 --tilt 10 --fov 50", lambda: scale_maps.from_angles((96, 128), 40, 10, fov=50)),
        ("--mask mask.png", lambda: scale_maps.from_mask(FLOOR.mask)),
        (
            "--mask mask.png --measure count --window 40 --trend plane",
            lambda: scale_maps.from_mask(FLOOR.mask, measure="count", window=40, trend="plane"),
        ),
        ("--auto", lambda: scale_maps.from_mask(scale_maps.auto_mask(FLOOR.image))),
        (
            "--auto --hole hole.png --trend linear",
            lambda: scale_maps.from_mask(scale_maps.auto_mask(FLOOR.image, known=KNOWN), known=KNOWN, trend="linear"),
        ),
        (
            "--slant 30 --edit magnify,magnify",
            lambda: scale_maps.edit(scale_maps.from_angles((96, 128), 30, 90), ["magnify"] * 2),
        ),
        ("--slant 30 --edit edits.json", lambda: scale_maps.edit(scale_maps.from_angles((96, 128), 30, 90), EDITS)),
        (
            "--slant 30 --size 150x120 --mode extend",
            lambda: scale_maps.resample(scale_maps.from_angles((96, 128), 30, 90), (120, 150), "extend"),
        ),
        ("--slant 30 --size 50", lambda: scale_maps.resample(scale_maps.from_angles((96, 128), 30, 90), (50, 50))),
    ],
)
def test_it_writes_what_the_functions_make(here: Path, capsys: Capture, arguments: str, expected) -> None:
    assert main(["scale-map", "in.png", "-o", "out.tif", *arguments.split()]) == 0
    assert (io.read("out.tif") == expected()).all()
    assert re.search(
        r"texrs: wrote out\.tif: \d+ x \d+, (widths|roots of areas) \S+ to \S+, in", capsys.readouterr().err
    )


def test_a_map_made_before_is_edited_and_encoded(here: Path) -> None:
    made = scale_maps.from_angles((96, 128), 30, 90)
    for name, options, read in (
        ("map.npy", [], lambda v: v),
        ("map.exr", [], lambda v: v),
        ("map.png", [], scale_maps.decode),
        ("paper.png", ["--encoding", "paper"], lambda v: scale_maps.decode(v, "paper")),
    ):
        assert main(["scale-map", "in.png", "-o", name, "--slant", "30", "-q", *options]) == 0
        assert np.abs(np.log(read(io.read(name)) / made)).max() < 0.02
        assert (
            main(["scale-map", "in.png", "-o", "two.npy", "--scale-map", name, "--edit", "edits.json", *options]) == 0
        )
        values = io.read("two.npy")
        edited = scale_maps.decode(values, "paper") if options else values
        assert np.abs(np.log(edited / scale_maps.edit(made, EDITS))).max() < 0.02


def test_stages_are_pictures_to_look_at(here: Path, capsys: Capture) -> None:
    more = ["--edit", "edits.json", "--size", "64x64", "--stages", "stages", "--quiet"]
    assert main(["scale-map", "in.png", "-o", "out.png", "--mask", "mask.png", *more]) == 0
    names = sorted(p.name for p in Path("stages").iterdir())
    assert names == ["01-mask.png", "02-scale.png", "03-edited.png", "04-resampled.png", "report.json"]
    assert (iio.imread("stages/01-mask.png") == iio.imread("mask.png")).all()
    assert (iio.imread("stages/02-scale.png") == scale_maps.picture(scale_maps.from_mask(FLOOR.mask))).all()
    assert capsys.readouterr().err == ""
    report = json.loads(Path("stages/report.json").read_text(encoding="utf-8"))
    assert report["edit"] == EDITS
    assert report["size"] == [64, 64]
    # The same edits are read from the report of the run.
    again = ["scale-map", "in.png", "-o", "again.png", "--mask", "mask.png", "--edit", "stages/report.json", "-q"]
    assert main([*again, "--size", "64x64"]) == 0
    assert (iio.imread("again.png") == iio.imread("out.png")).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("", "--mask, --auto, --slant, --scale-map: exactly one of these must be given, got none"),
        ("--auto --slant 3", "--mask, --auto, --slant, --scale-map: exactly one of these must be given, got --auto and"),
        ("--auto --tilt 3", "--tilt: must be used with --slant, got --auto"),
        ("--slant 3 --hole hole.png", "--hole: must be used with --mask or --auto, got --slant"),
        ("--slant 89", "--slant: must be a number between 0 and 85.0, got 89.0"),
        ("--slant 80 --fov 100", "--slant: at 80 degrees the horizon is inside"),
        ("--mask small.png", "--mask: must have the size of the image, 128 x 96; got 8 x 8"),
        ("--auto --hole small.png", "--hole: must have the size of the image, 128 x 96; got 8 x 8"),
        ("--mask mask.png --window 3", "--window: must be an integer between 16 and 128, got 3"),
        ("--mask mask.png --measure area2", "--measure: must be one of boundary, skeleton, count, area"),
        ("--mask mask.png --trend up", "--trend: must be one of none, plane, linear, quadratic; got 'up'"),
        ("--mask hole.png", "hole.png: must mark more features"),
        ("--slant 3 --edit bad.json", "--edit: step 1 must have an 'op', one of magnify"),
        ("--slant 3 --edit none.json", "none.json: "),
        ("--slant 3 --edit mask.png", "--edit: step 1 must have an 'op', one of magnify"),
        ("--slant 3 --edit [", "--edit: is not JSON ("),
        ("--slant 3 --mode user", "--mode: must be one of stretch, extend; got 'user'"),
        ("--slant 3 --encoding log", "--encoding: must be one of log2, paper; got 'log'"),
        ("--slant 3 --size 5x0", "--size: each side must be at least 1"),
        ("--scale-map in.png", "in.png: must contain grey levels, got colours"),
        ("--scale-map none.npy", "none.npy:"),
    ],
)  # fmt: skip
def test_what_cannot_be_done_is_said_and_nothing_is_written(
    here: Path, capsys: Capture, arguments: str, message: str
) -> None:
    assert main(["scale-map", "in.png", "-o", "out.tif", *arguments.split()]) == 2
    # Notices about masks come first.
    *said, error = capsys.readouterr().err.splitlines()
    assert error.startswith(f"texrs: {message}"), error
    assert all("read as a mask that marks" in line for line in said)
    assert Path("out.tif").read_bytes() == BEFORE

"""Invalid arguments are refused before long work, in the words of the command line."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import typer

import texrs
from texrs import cli, io
from texrs.cli import app, main

COMMANDS = {
    "inpaint": "in.png hole.png",
    "design": "in.png",
    "extend": "in.png --left 64 --slant 0",
    "perspective": "in.png --scale-map front",
    "rectify": "in.png --slant 20 --tilt 90 --fov 50",
    "remove": "in.png hole.png --slant 0",
    "self-splice": "in.png",
    "solid": "volume.tif",
    "splice": "in.png sample:dots",
    "synthesize": "in.png",
    "tile": "in.png",
    "scale-map": "in.png --slant 20",
    "apply": "map.npz in.png",
    "slice": "volume.tif",
    "slice --cube": "volume.tif",
    "slice --turntable": "volume.tif",
}
BAD = ("bogus", "-5")
FREE = {
    *((command, "--stages", value) for command in COMMANDS for value in BAD),
    *((command, flag, "-5") for command in COMMANDS for flag in ("--tilt", "--direction", "--azimuth", "--elevation")),
    ("apply", "--band", "-5"),
    *((command, "--grow", "-5") for command in COMMANDS),
}
"""Valid values: names of folders, angles below 0, masks that shrink, and options that need another option."""


class Work(Exception):
    """Long work has begun."""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    picture = texrs.samples.dots((64, 96)).image
    hole = np.zeros((64, 96), np.uint8)
    hole[24:40, 24:40] = 255
    io.write("in.png", picture)
    io.write("hole.png", hole)
    io.write("small.png", picture[:40, :30])
    io.write("tiny.png", picture[:8, :12])
    io.write("small-mask.png", hole[:40, :30])
    io.write_volume("volume.tif", texrs.samples.stripes((32, 36, 40)).image)
    texrs.SourceMap.identity((64, 96)).save("map.npz")
    return tmp_path


@contextmanager
def refuse_work(*, quiet: bool) -> Iterator[object]:
    """Replace the display of progress by an exception."""

    def watch(stage: str, share: float) -> None:
        if share > 0:
            raise Work(stage)

    yield watch


@pytest.mark.parametrize("command", COMMANDS)
def test_bad_options_are_refused_before_the_work(
    here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, command: str
) -> None:
    for module in ("_verb", "_scales", "_maps", "_slices"):
        monkeypatch.setattr(f"texrs.cli.{module}.show_progress", refuse_work, raising=False)

    def read(path: str) -> None:
        raise Work(path)

    monkeypatch.setattr("texrs.cli._slices.read_volume", read)
    monkeypatch.setattr("texrs.cli.make_command", cache(cli.make_command))
    group = typer.main.get_command(app)
    verb, *mode = command.split()
    known = group.get_command(typer.Context(group), verb)  # type: ignore[attr-defined]
    out = "out.gif" if "--turntable" in mode else "out.tif"
    before = sorted(here.rglob("*"))
    late = []
    for option in known.params:
        flag = option.opts[0]
        if option.param_type_name != "option" or option.is_flag or flag in COMMANDS[command].split():
            continue
        for value in BAD:
            if "--out" in option.opts or (command, flag, value) in FREE:
                continue
            code = main([verb, *mode, *COMMANDS[command].split(), "-o", out, flag, value])
            said = capsys.readouterr().err.strip().splitlines()
            # The message must have one line, which names the option or its file.
            if code != 2 or not said or not (flag in said[-1] or value in said[-1]):
                late.append((flag, value, code, said))
    assert not late
    assert sorted(here.rglob("*")) == before


SIZES = {
    "design in.png --size 30000x20000": "--size: 30000 x 20000 has 600000000 pixels",
    "design in.png --size 8x40": "--size: each side must be at least 16, got 8 x 40",
    "tile in.png --size 30000x20000": "--size: 30000 x 20000 has",
    "splice in.png sample:dots --size 30000x20000": "--size: 30000 x 20000 has",
    "self-splice in.png --size 30000x20000": "--size: 30000 x 20000 has",
    "synthesize in.png --size 30000x20000": "--size: 30000 x 20000 has",
    "perspective in.png --scale-map front --size 30000x20000": "--size: 30000 x 20000 has",
    "rectify in.png --slant 20 --tilt 90 --fov 50 --size 30000x20000": "--size: 30000 x 20000 has",
    "solid volume.tif --size 3000x2000x1000": "--size: 3000 x 2000 x 1000 has",
    "extend in.png --slant 0 --size 30000x20000": "--size: 30000 x 20000 has",
    "extend in.png --slant 0 --size 10x5000": "--size: must be at least 96 x 64 pixels, and at most 16384 pixels larger",
    "inpaint in.png small-mask.png": "small-mask.png: must have shape 96 x 64, got 30 x 40",
    "remove in.png small-mask.png --slant 0": "small-mask.png: must have shape 96 x 64, got 30 x 40",
    "apply map.npz small.png": "small.png: exemplar 0 must have size 96 x 64, got 30 x 40",
    "design tiny.png": "tiny.png: each side must be at least 16, got shape 12 x 8",
    "splice tiny.png sample:dots": "tiny.png: each side must be at least 16, got shape 12 x 8",
    "design in.png --element-labels small-mask.png": "small-mask.png: must be integers of shape 96 x 64, got uint8 30 x 40",
    "design in.png in.png --density small-mask.png": "array of shape 192 x 128 or 192 x 128 with 1 channel; got shape 30 x 40",
    "slice volume.tif --oblique 99,99,99/1,1,0": "--oblique: must specify a slice that crosses the volume",
    "extend in.png --slant 0": "--top, --bottom, --left, --right: at least one must be above 0",
}


@pytest.mark.parametrize("command", SIZES)
def test_errors_speak_of_sizes_as_options_do(here: Path, capsys: pytest.CaptureFixture[str], command: str) -> None:
    assert main([*command.split(), "-o", "out.tif", "-q"]) == 2
    assert SIZES[command] in capsys.readouterr().err

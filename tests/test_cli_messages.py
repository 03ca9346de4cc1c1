"""Messages and help texts use the words of the command line: similar names are suggested, and no Python names occur."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer

import texrs
from texrs import cli, io, samples
from texrs.cli import COMMANDS, Group, app, main
from texrs.cli._limits import OPTIONS as LIMITS

Capture = pytest.CaptureFixture[str]
GROUP: Any = typer.main.get_command(app)
CALLS = {
    "analyse": "in.png -o e.npz",
    "apply": "map.npz in.png -o out.tif",
    "batch": "tile in.png -o made",
    "check": "in.png -o out.tif",
    "compare": "in.png --task tile --crop 48 --larger 48 --no-seconds -o out.html",
    "inpaint": "in.png hole.png -o out.tif",
    "database": "db splice dots dots -o out.png",
    "demo": "-o in.png/folder",
    "design": "in.png -o out.tif",
    "extend": "in.png --left 64 --slant 0 -o out.tif",
    "info": "in.png",
    "paint": "in.obj volume.tif -o out.glb",
    "perspective": "in.png --scale-map front -o out.tif",
    "rectify": "in.png --slant 20 --tilt 90 --fov 50 -o out.tif",
    "remove": "in.png hole.png --slant 0 -o out.tif",
    "rerun": "in.png",
    "samples": "dots -o made",
    "scale-map": "in.png --slant 20 -o out.tif",
    "self-splice": "in.png -o out.tif",
    "slice": "volume.tif -o out.tif",
    "solid": "volume.tif -o out.tif",
    "splice": "in.png sample:dots -o out.tif",
    "synthesize": "in.png -o out.tif",
    "tile": "in.png -o out.tif",
    "tiles": "in.png --tile-size 48 --pictures 1 --size 40 -o out.tif",
}
BAD = ("bogus", "-5", "missing.png", "1,2")
COMMON = {*LIMITS, "count", "strict", "force", "quiet"}
"""Options that all commands have. They are tested on one command."""
PYTHON = re.compile(
    r"\b[a-z]+_[a-z_]+\b|\bNone\b|\bTrue\b|\bFalse\b|\btexrs\.[a-z]|\bndarray\b|\barray_like\b|\brows?, columns?\b"
    r"|internal error"
)
"""Words that only programmers know."""


class Work(Exception):
    """Long work has begun."""


@contextmanager
def refuse_work(*, quiet: bool) -> Iterator[object]:
    """Replace the display of progress by an exception."""

    def watch(stage: str, share: float) -> None:
        raise Work(stage)

    yield watch


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("messages")
    picture = samples.dots((64, 96)).image
    io.write(place / "in.png", picture)
    io.write(place / "hole.png", np.pad(np.full((16, 16), 255, np.uint8), ((24, 24), (24, 56))))
    io.write_volume(place / "volume.tif", samples.stripes((32, 36, 40)).image)
    texrs.SourceMap.identity((64, 96)).save(place / "map.npz")
    (place / "in.obj").write_text("v 0 0 0\nv 8 0 0\nv 0 8 0\nv 0 0 8\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    texrs.TextureDatabase(place / "db").add(place / "in.png", "dots", layout="disjoint")
    return place


def test_every_command_is_tried() -> None:
    assert set(CALLS) == set(COMMANDS)


@pytest.mark.parametrize("command", CALLS)
def test_messages_name_options_and_never_python(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture, command: str
) -> None:
    monkeypatch.chdir(folder)
    made = cache(cli.make_command)
    monkeypatch.setattr("texrs.cli.make_command", made)
    monkeypatch.setattr(Group, "make_command", staticmethod(made))
    for module in ("_verb", "_scales", "_maps", "_slices", "_elements", "_paint", "_tiles", "_parts", "_compare"):
        monkeypatch.setattr(f"texrs.cli.{module}.show_progress", refuse_work, raising=False)
    monkeypatch.setattr("texrs.cli._batch.run_jobs", lambda *args, **given: ([], 0))
    wrong = []
    for option in GROUP.get_command(None, command).params:
        flag = max(option.opts, key=len)
        # Skip options that name results, because any text is a valid name.
        if option.param_type_name != "option" or option.is_flag or "--out" in option.opts:
            continue
        if option.name in COMMON and command != "tile":
            continue
        for value in BAD:
            code = main([command, *CALLS[command].split(), f"{flag}={value}"])
            said = capsys.readouterr().err.strip().splitlines()
            if code == 0 or not said or "Work:" in said[-1]:
                continue
            # Remove quoted values, which users gave, and lists of names, which may look like Python.
            plain = re.sub(r"'[^']*'|(?<=one of ).*|(?<=known are ).*", "", said[-1])
            if PYTHON.search(plain):
                wrong.append((flag, value, said[-1]))
    assert not wrong


@pytest.mark.parametrize("command", COMMANDS)
def test_help_texts_never_mention_python(command: str) -> None:
    for parameter in GROUP.get_command(None, command).params:
        text = parameter.help or ""
        assert not re.search(r"\bNone\b|\bTrue\b|\btexrs\.[a-z]|\bndarray\b|\barray_like\b", text), (
            parameter.name,
            text,
        )
        if re.search("WIDTHx|X,Y", parameter.metavar or ""):
            # Sizes give the width or x first, so the text must not give rows first.
            assert not re.search(r"\brows?(,| and) columns?\b", text, re.IGNORECASE), (parameter.name, text)


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("desing in.png -o out.png", "No such command 'desing'; did you mean design?"),
        ("scalemap in.png -o out.png", "did you mean scale-map?"),
        ("zzz", "No such command 'zzz' (see texrs --help)"),
        ("design in.png -o out.png --sise 3", "No such option: --sise; did you mean --size?"),
        (
            "batch desing in.png -o made",
            "verb: must be a command that writes one file, got 'desing'; did you mean design?",
        ),
        (
            "batch design in.png -o made --set sise=3",
            "No such option: --sise; did you mean --size? (see texrs design --help",
        ),
        ("samples gravl -o made", "must be the name of a sample, got 'gravl'; did you mean gravel?"),
        ("solid in.png -o out.tif", "in.png: is an image of 96 x 64, but a volume is needed: a TIFF of several slices"),
        ("slice in.png -o out.png", "in.png: is an image of 96 x 64, but a volume is needed"),
        ("tile volume.tif -o out.png", "use texrs slice or texrs solid"),
        ("perspective in.png --direction bogus -o out.png", "--direction: must be one of identity"),
        ("samples dots -o made --size 5x5x5", "--size: must be WIDTHxHEIGHT"),
        (
            "inpaint in.png --mask in.png -o out.png",
            "No such option: --mask; give its value without an option name: texrs inpaint IMAGE MASK",
        ),
        (
            "rectify in.png --corners 9,9 80,9 80,50 9,50 -o out.png",
            "put places in quotes, as in '20,20 104,24 110,100 14,112'",
        ),
        (
            "samples gravel -o made --size 64 --strict",
            "gravel: --size is not used, because this sample is a photograph",
        ),
    ],
)
def test_mistakes_are_answered_with_what_to_do(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture, command: str, words: str
) -> None:
    monkeypatch.chdir(folder)
    assert main(command.split()) == 2
    assert words in capsys.readouterr().err

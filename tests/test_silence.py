"""Every command reports unused parts of its inputs, and facts that an input does not state.

The cases are generated from the commands: every argument and option that accepts a folder, several files, or points.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer

from test_cli_messages import CALLS, refuse_work
from texrs import SourceMap, cli, io, samples
from texrs.cli import COMMANDS, Group, app, main

Capture = pytest.CaptureFixture[str]
GROUP: Any = typer.main.get_command(app)
PARAMETERS = [(command, p) for command in COMMANDS for p in GROUP.get_command(None, command).params]
OWN = ("rerun", "demo", "samples", "database")
"""Commands with their own folders, or whose folders are outputs."""


def takes_folder(command: str, parameter: Any) -> bool:
    """Return whether an input may be a folder of maps."""
    if parameter.name in cli._outputs.OUTPUTS or command in OWN or (command == "batch" and parameter.name != "inputs"):
        return False
    words = f"{parameter.metavar} {parameter.help}"
    return bool(re.search(r"FOLDER|[Ff]olders? of (the )?(maps|volumes)|folders,? with", words))


FOLDERS = [(command, p.name) for command, p in PARAMETERS if takes_folder(command, p)]
MASKS = [(command, p.name) for command, p in PARAMETERS if re.match("Mask of|Measure in a mask of", p.help or "")]
POINTS = [(command, p.name) for command, p in PARAMETERS if "csv" in (p.metavar or "")]


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in a folder of inputs, and stop each command where its work begins."""
    monkeypatch.chdir(tmp_path)
    picture = samples.dots((64, 96)).image
    volume = samples.stripes((32, 36, 40)).image
    for name in ("rock", "block"):
        Path(name).mkdir()
    io.write("rock/albedo.png", picture)
    io.write("rock/height.png", picture[..., 0])
    io.write_volume("block/albedo.tif", volume)
    io.write_volume("block/height.tif", volume[..., 0])
    io.write("in.png", picture)
    io.write("hole.png", np.pad(np.full((16, 16), 255, np.uint8), ((24, 24), (24, 56))))
    Path("in.obj").write_text("v 0 0 0\nv 8 0 0\nv 0 8 0\nv 0 0 8\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    made = cache(cli.make_command)
    monkeypatch.setattr("texrs.cli.make_command", made)
    monkeypatch.setattr(Group, "make_command", staticmethod(made))
    for module in ("_verb", "_scales", "_maps", "_slices", "_elements", "_paint", "_tiles", "_parts", "_compare"):
        monkeypatch.setattr(f"texrs.cli.{module}.show_progress", refuse_work, raising=False)
    return tmp_path


def make_words(command: str, name: str, text: str) -> list[str]:
    """Return a call with a text for one argument or option."""
    arguments = [p for p in GROUP.get_command(None, command).params if p.param_type_name == "argument"]
    words = CALLS[command].replace("out.tif", "made").split()
    place = next((k for k, p in enumerate(arguments) if p.name == name), None)
    if place is not None:
        return [command, *words[:place], text, *words[place + 1 :]]
    flag = max(next(p.opts for c, p in PARAMETERS if c == command and p.name == name), key=len)
    # Use materials for the other inputs as well, so that all inputs fit each other.
    return [command, *(text if word == "in.png" else word for word in words), f"{flag}={text}"]


def test_many_inputs_are_tried() -> None:
    assert {command for command, _ in FOLDERS} >= {
        *("analyse", "batch", "inpaint", "design", "extend", "info", "paint", "perspective", "rectify", "remove"),
        *("self-splice", "splice", "synthesize", "tile", "tiles"),
    }
    assert ("inpaint", "exemplar") in FOLDERS
    assert {command for command, _ in POINTS} == {"analyse", "database"}


@pytest.mark.parametrize(("command", "name"), FOLDERS)
def test_unused_files_are_reported(here: Path, capsys: Capture, command: str, name: str) -> None:
    folder = "block" if command == "paint" else "rock"
    suffix = ".tif" if folder == "block" else ".png"
    for unused, content in (("preview" + suffix, (here / folder / f"albedo{suffix}").read_bytes()), ("rock.sbs", b"x")):
        (here / folder / unused).write_bytes(content)
        # Test each file alone, so that none hides another.
        strict = [*make_words(command, name, folder), "--strict"]
        before = sorted(here.rglob("*"))
        code = main(strict)
        err = capsys.readouterr().err
        assert unused in err, err
        assert "--strict" in err
        # In a batch, a job finds the unused preview, so the exit code is 3.
        assert code == (3 if command == "batch" and unused.startswith("preview") else 2)
        assert sorted(here.rglob("*")) == before or command == "batch"
        main(make_words(command, name, folder))
        said = capsys.readouterr()
        assert unused in said.err + said.out
        (here / folder / unused).unlink()
    main(make_words(command, name, folder))
    assert "not used" not in capsys.readouterr().err


@pytest.mark.parametrize(("command", "name"), [c for c in FOLDERS if c[0] not in ("paint", "info")])
def test_unused_files_of_a_list_are_reported(here: Path, capsys: Capture, command: str, name: str) -> None:
    io.write("rock/preview.png", io.read("in.png"))
    several = "rock/{albedo,height,preview}.png"
    code = main([*make_words(command, name, several), "--strict"])
    err = capsys.readouterr().err
    assert "preview.png" in err, err
    assert code == (3 if command == "batch" else 2)


@pytest.mark.parametrize(("command", "name"), FOLDERS)
def test_assumptions_are_shown(here: Path, capsys: Capture, command: str, name: str) -> None:
    if command == "paint":
        pytest.skip("maps of volumes need other labels")
    ids = np.random.default_rng(0).integers(0, 60000, (8, 12)).astype(np.uint16)
    io.write("rock/blocks.png", np.kron(ids, np.ones((8, 8), np.uint16)))
    main(make_words(command, name, "rock"))
    said = capsys.readouterr()
    assert "blocks.png read as" in said.err + said.out


@pytest.mark.parametrize(("command", "name"), MASKS)
def test_masks_that_mark_nothing_are_refused(here: Path, capsys: Capture, command: str, name: str) -> None:
    io.write("empty.png", np.zeros((64, 96), np.uint8))
    SourceMap.identity((64, 96)).save("map.npz")
    place = next(p for p in GROUP.get_command(None, command).params if p.name == name)
    io.write_volume("empty.tif", np.zeros((32, 36, 40), np.uint8))
    io.write_volume("volume.tif", samples.stripes((32, 36, 40)).image)
    empty = "empty.tif" if command == "solid" else "empty.png"
    words = ["out.tif" if word == "made" else word for word in make_words(command, name, empty)]
    if place.param_type_name == "option":
        words = ["in.png" if word == "empty.png" else word for word in words]
    if command == "database":
        words = ["database", "db", "add", "in.png", "--mask", "empty.png"]
    elif command == "scale-map":
        # A hole is only used if the map is measured.
        words = [word for word in words if word not in ("--slant", "20")] + ["--auto"] * (name == "hole")
    assert main(words) == 2, capsys.readouterr().err
    assert f"{empty}: marks nothing" in capsys.readouterr().err


@pytest.mark.parametrize(("command", "name"), POINTS)
def test_points_without_an_order_are_reported(here: Path, capsys: Capture, command: str, name: str) -> None:
    Path("points.csv").write_text("10,20\n30,40\n50,20\n")
    words = ["db", "add", "in.png"] if command == "database" else ["in.png", "-o", "e.npz"]
    main([command, *words, "--points", "points.csv"])
    assert "points.csv: read as x,y" in capsys.readouterr().err

"""No command overwrites its inputs."""

from __future__ import annotations

import functools
import inspect
import os
from pathlib import Path
from typing import Any

import imageio.v3 as iio
import pytest
import typer

import texrs
from combinations import rotate
from commands import COLOURS, TINY, Capture, complaint, files
from texrs import SourceMap, samples
from texrs.cli import COMMANDS, app, main
from texrs.cli._outputs import OUTPUTS
from texrs.cli._provenance import as_flag
from texrs.errors import InvalidInput

COMMAND: Any = typer.main.get_command(app)


@functools.cache
def find_command(command: str) -> Any:
    return COMMAND.get_command(None, command)


def parameters(command: str) -> list[Any]:
    found: list[Any] = find_command(command).params
    return found


def writes(parameter: Any) -> bool:
    return parameter.name in OUTPUTS and parameter.param_type_name == "option"


def reads_and_writes() -> dict[str, tuple[list[str], list[str]]]:
    """Return for each command the arguments that may name an input file, and the outputs."""
    found = {}
    for command in COMMANDS:
        given = parameters(command)
        kinds = inspect.signature(find_command(command).callback, eval_str=True).parameters
        texts = [p.name for p in given if "str" in str(kinds[p.name].annotation).split(", <")[0] and not writes(p)]
        found[command] = texts, [p.name for p in given if writes(p)]
    return found


def list_pairs() -> list[tuple[str, str, str]]:
    """Return each command with each argument that it may read and each of its outputs, at least once.

    A command finds its inputs and its outputs independently, so not every pair is needed.
    """
    return [
        (command, *pair) for command, (reads, outputs) in reads_and_writes().items() for pair in rotate(reads, outputs)
    ]


def test_all_commands_are_known_to_read_and_write() -> None:
    known = reads_and_writes()
    both = {command for command, _, _ in list_pairs()}
    assert both >= {"design", "apply", "tile", "inpaint", "scale-map", "perspective", "solid", "synthesize", "slice"}
    assert both >= {"splice", "self-splice", "analyse", "database"}
    assert "source" in known["apply"][0]
    assert "out" in known["apply"][1]
    assert any("guide" in read for read in known["solid"][0])
    assert "source_map" in known["solid"][1]
    assert any("labels" in read for read in known["design"][0])
    assert "stages" in known["design"][1]


@pytest.mark.parametrize(("command", "read", "written"), list_pairs(), ids="-".join)
def test_no_command_writes_over_what_it_reads(here: Path, command: str, read: str, written: str) -> None:
    Path("st").mkdir()
    target = "st/01-known.png" if written == "stages" else "there.npz" if written == "source_map" else "there.png"
    Path(target).write_bytes(b"dear")
    Path("symbolic.png").symlink_to(target)
    os.link(target, "hard.png")
    before = files(here)
    for name in (target, "symbolic.png", "hard.png"):
        arguments, options = [], []
        for p in parameters(command):
            value = name if p.name == read else ("st" if p.name == "stages" else target) if p.name == written else None
            if value is not None or p.required:
                values = [value or ("new.png" if p.name == "out" else "in.png")] * max(p.nargs, 1)
                if p.param_type_name == "argument":
                    arguments += values
                else:
                    options += [max(p.opts, key=len), *values]
        with pytest.raises(InvalidInput, match=f"{as_flag(written)}: {target} is an input"):
            find_command(command).main([*arguments, *options], standalone_mode=False)
        assert files(here) == before


@pytest.mark.parametrize(
    "command",
    [
        "apply map.npz in.png -o in.png",
        "apply map.npz in.png -o map.npz",
        "design in.png -o ./in.png",
        "design many-1.png -o many.png --variants 2",
        "design in.png --element-labels s-1/report.json -o many.png --variants 2 --stages s",
        "apply map.npz in.png s-1/in.png -o s-1",
        "database db matrix -o in.png",
        "database db matrix -o db/dots.npz",
        "database db add db/dots.npz",
        "self-splice in.png --edit s-1/report.json -o new.png --stages s-1",
    ],
)
def test_no_name_that_a_command_makes_is_read(here: Path, capsys: Capture, command: str) -> None:
    Path("s-1").mkdir()
    Path("s-1/report.json").write_text("{}")
    iio.imwrite("s-1/in.png", COLOURS)
    SourceMap.identity((64, 64)).save("map.npz")
    iio.imwrite("many-1.png", COLOURS)
    mask = samples.load("dots", size=(64, 64)).mask
    texrs.TextureDatabase("db").add("in.png", "dots", mask=mask, layout="disjoint")
    before = files(here)
    assert main(command.split()) == 2
    assert "is an input" in complaint(capsys)
    assert files(here) == before


def test_a_folder_of_inputs_may_take_what_replaces_none(here: Path, capsys: Capture) -> None:
    assert main(["tile", "in.png", "-o", "out.png", "-q", "--stages", "."]) == 0
    assert (iio.imread("in.png") == COLOURS).all()
    Path("gravel").mkdir()
    assert main(["samples", "gravel", "-o", "gravel", "-q"]) == 0
    assert main(["design", "in.png", *TINY, "-o", "many.png", "--variants", "2", "--stages", "."]) == 2
    assert "--stages: must contain a file name" in complaint(capsys)

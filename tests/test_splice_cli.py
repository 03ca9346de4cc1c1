"""The commands that arrange elements."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import texrs
from reference.look_up import view
from texrs import io
from texrs.cli import main
from texrs.papers.splice.edit import STEPS


@pytest.fixture(autouse=True)
def pictures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Work in a folder with two small images."""
    monkeypatch.chdir(tmp_path)
    for name in ("dots", "pebbles"):
        io.write(f"{name}.png", texrs.samples.load(name, size=(96, 96)).image)
    # Save the known elements, so that the command does not have to find them.
    for name, side in (("bricks", 160), ("pebbles", 96)):
        texrs.ElementAnalysis.of_sample(texrs.samples.load(name, size=(side, side))).save(f"{name}.npz")


def test_splice(tmp_path: Path) -> None:
    out, source, stages = tmp_path / "out.png", tmp_path / "map.npz", tmp_path / "stages"
    line = [
        "splice",
        "sample:dots",
        "pebbles.png",
        "-o",
        str(out),
        "--size",
        "112x96",
        "--seed",
        "2",
        "--screening",
        "0",
        "-q",
    ]
    assert main([*line, "--source-map", str(source), "--stages", str(stages)]) == 0
    image = io.read(out)
    assert image.shape == (96, 112, 3)
    np.testing.assert_array_equal(view(texrs.SourceMap.load(source), texrs.samples.dots().image), image)
    assert json.loads((stages / "report.json").read_text())["seed"] == 2
    assert len(list(stages.glob("*.png"))) >= 7


def test_splice_by_cells(tmp_path: Path) -> None:
    made = []
    for number, options in enumerate(
        (["--use-cells"], ["--no-use-cells"], ["--use-cells", "--allow-rotation", "--strength", "0.5"])
    ):
        stages = tmp_path / str(number)
        line = ["splice", "bricks.npz", "pebbles.npz", "-o", str(tmp_path / "out.png"), "--size", "96", "-q"]
        assert main([*line, *options, "--stages", str(stages)]) == 0
        made.append(json.loads((stages / "report.json").read_text()))
    assert [report["method"] for report in made] == ["cells", "default", "cells"]
    assert [made[0]["strength"], made[2]["strength"]] == [1.0, 0.5]
    assert made[2]["allow_rotation"] is True


def test_self_splice_and_its_replay(tmp_path: Path) -> None:
    first, again, stages = tmp_path / "a.png", tmp_path / "b.png", tmp_path / "stages"
    line = ["self-splice", "dots.png", "-q", "--seed", "3"]
    assert main([*line, "-o", str(first), "--edit", "randomise", "--stages", str(stages)]) == 0
    assert main([*line, "-o", str(again), "--edit", str(stages / "report.json")]) == 0
    assert (io.read(first) == io.read(again)).all()
    moved = '[{"op": "move", "element": 1, "by": [3, 4]}]'
    assert main([*line, "-o", str(again), "--edit", moved]) == 0


def test_self_splice_in_another_size(tmp_path: Path) -> None:
    out = tmp_path / "a.png"
    for options in ([], ["--edit", "randomise"]):
        assert main(["self-splice", "dots.png", "-q", "-o", str(out), "--size", "160x144", *options]) == 0
        assert io.read(out).shape[:2] == (144, 160)


def test_the_help_names_every_step(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["self-splice", "--help"]) == 0
    words = capsys.readouterr().out
    assert not [step for step in STEPS if step not in words]


def test_entries_are_taken(tmp_path: Path) -> None:
    entry, out = tmp_path / "dots.npz", tmp_path / "out.png"
    box = ["--box", "62,60,25,25", "--layout", "F=d"]
    assert main(["analyse", "dots.png", "-o", str(entry), *box, "-q"]) == 0
    assert main(["splice", str(entry), "pebbles.png", "-o", str(out), "--size", "64", "-q"]) == 0
    assert io.read(out).shape == (64, 64, 3)
    assert main(["splice", str(tmp_path / "none.npz"), str(entry), "-o", str(out), "-q"]) == 2


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (["splice", "dots.png", "nothing.png"], "nothing.png"),
        (["splice", "dots.png", "pebbles.png", "--method", "fast"], "--method"),
        (["splice", "dots.png", "pebbles.png", "--size", "4"], "--size"),
        (["splice", "dots.png", "pebbles.png", "--strength", "2"], "--strength"),
        (["splice", "dots.png", "pebbles.npz", "--use-cells"], "--use-cells"),
        (["self-splice", "dots.png", "--edit", "melt"], "--edit"),
        (["self-splice", "dots.png", "--edit", "[3"], "not JSON"),
        (["self-splice", "dots.png", "--size", "4"], "--size"),
        (["self-splice", "dots.png", "--edit", "gone.json"], "gone.json"),
    ],
)
def test_bad_use(line: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out.png"
    assert main([*line, "-o", str(out), "-q"]) == 2
    assert words in capsys.readouterr().err
    assert not out.exists()

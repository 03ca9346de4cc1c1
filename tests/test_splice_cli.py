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


def test_splice(tmp_path: Path) -> None:
    out, source, stages = tmp_path / "out.png", tmp_path / "map.npz", tmp_path / "stages"
    line = ["splice", "sample:dots", "sample:pebbles", "-o", str(out), "--size", "96x112", "--seed", "2", "-q"]
    assert main([*line, "--map", str(source), "--stages", str(stages)]) == 0
    image = io.read(out)
    assert image.shape == (96, 112, 3)
    np.testing.assert_array_equal(view(texrs.SourceMap.load(source), texrs.samples.dots().image), image)
    assert json.loads((stages / "report.json").read_text())["seed"] == 2
    assert len(list(stages.glob("*.png"))) >= 7


def test_self_splice_and_its_replay(tmp_path: Path) -> None:
    first, again, stages = tmp_path / "a.png", tmp_path / "b.png", tmp_path / "stages"
    line = ["self-splice", "sample:dots", "-q", "--seed", "3"]
    assert main([*line, "-o", str(first), "--edit", "randomise", "--stages", str(stages)]) == 0
    assert main([*line, "-o", str(again), "--edit", str(stages / "report.json")]) == 0
    assert first.read_bytes() == again.read_bytes()
    moved = '[{"op": "move", "element": 1, "by": [3, 4]}]'
    assert main([*line, "-o", str(again), "--edit", moved]) == 0


def test_entries_are_taken(tmp_path: Path) -> None:
    entry, out = tmp_path / "dots.npz", tmp_path / "out.png"
    box = ["--box", "60,62,25,25", "--layout", "F=d"]
    assert main(["analyse", "sample:dots", "-o", str(entry), *box, "-q"]) == 0
    assert main(["splice", str(entry), "sample:pebbles", "-o", str(out), "--size", "64", "-q"]) == 0
    assert io.read(out).shape == (64, 64, 3)
    assert main(["splice", str(tmp_path / "none.npz"), str(entry), "-o", str(out), "-q"]) == 2


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (["splice", "sample:dots", "nothing.png"], "nothing.png"),
        (["splice", "sample:dots", "sample:net", "--method", "fast"], "--method"),
        (["splice", "sample:dots", "sample:net", "--size", "4"], "--size"),
        (["self-splice", "sample:dots", "--edit", "melt"], "--edit"),
        (["self-splice", "sample:dots", "--edit", "[3"], "not JSON"),
        (["self-splice", "sample:dots", "--edit", "gone.json"], "gone.json"),
    ],
)
def test_bad_use(line: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out.png"
    assert main([*line, "-o", str(out), "-q"]) == 2
    assert words in capsys.readouterr().err
    assert not out.exists()

"""Bad files, bad options and failures in the work: one line, an exit code, and nothing lost."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from commands import COLOURS, GREY, TINY, Capture, complaint, files, npy, png, replace_design
from texrs import SourceMap
from texrs.cli import main

NAN = np.where(GREY > 128, np.nan, np.float32(1))
INPUTS: dict[str, tuple[bytes | None, str]] = {
    "missing": (None, "does not exist"),
    "empty": (b"", "empty"),
    "text": (b"hello, this is no picture\n" * 9, "must be a file in one of"),
    "truncated": (png(COLOURS)[:-900], "bad.png"),
    "NaN": (npy(NAN), "NaN or infinite"),
    "objects": (npy(np.array([[{}, 1], [2, 3]], object), pickle=True), "bad.png"),
    "complex": (npy(COLOURS[..., 0] * 1j), "bad.png"),
    "words": (npy(np.array([["a", "b"]])), "bad.png"),
    "volume": (npy(np.zeros((20, 20, 70), np.uint8)), "bad.png"),
    "four axes": (npy(np.zeros((20, 20, 20, 3), np.uint8)), "bad.png"),
    "one axis": (npy(np.zeros(400, np.uint8)), "bad.png"),
    "1 x 1": (npy(GREY[:1, :1]), "at least 16"),
    "7 x 3": (npy(GREY[:7, :3]), "at least 16"),
    "20000 x 1": (npy(np.ones((20000, 1), np.uint8)), "at least 16"),
    "no pixels": (npy(GREY[:0]), "bad.png"),
}


@pytest.mark.parametrize("name", INPUTS)
def test_hostile_inputs(here: Path, capsys: Capture, name: str) -> None:
    content, words = INPUTS[name]
    if content is not None:
        Path("bad.png").write_bytes(content)
    before = files(here)
    assert main(["design", "bad.png", "-o", "out.png", "-q", "--source-map", "s.npz", "--stages", "st"]) == 2
    line = complaint(capsys)
    assert words in line
    assert "bad.png" in line
    assert files(here) == before


ARGUMENTS: dict[str, str] = {
    "folder": "design .",
    "empty name": "design ",
    "unknown sample": "design sample:nowhere",
    "a volume": "design sample:stripes",
    **{f"size {s}": f"design in.png --size {s}" for s in ("0", "-5", "axb", "x", "1.5", "1e3", "8x8x8", "５x５", "9")},
    "size nothing": "design in.png --size ",
    "size huge": "design in.png --size 1000000000x1000000000",
    "size of many digits": f"design in.png --size {'9' * 5000}",
    "size too much": "design in.png --size 20000x20000",
    "seed negative": "design in.png --seed -1",
    "seed too large": f"design in.png --seed {2**64}",
    "seed a word": "design in.png --seed many",
    "wrap": "design in.png --wrap z",
    "scale reversed": "design in.png --scale 1.2:0.8",
    "scale words": "design in.png --scale a:b",
    "scale three": "design in.png --scale 0.8:1:1.2",
    "scale NaN": "design in.png --scale nan:1",
    "growth rate": "design in.png --growth-rate inf",
    "fixed point": "design in.png --start 0.5",
    "start": "design in.png --start 1",
    "copies": "design in.png --copies 0",
    "threads": "design in.png --threads 0",
    "threads many": "design in.png --threads 99999",
    "element segmentation": "design in.png --element-segmentation some",
    "layers": "design in.png --element-layers 99",
    "patch size": "design in.png --patch-size 3",
    "screening": "design in.png --screening -1",
    "method": "design in.png --method best",
    "rotate": "design in.png --rotate 181",
    "translate": "design in.png --translate -0.1",
    "operations": "design in.png --operations 9",
    "labels missing": "design in.png --element-labels no.png",
    "map suffix": "design in.png --source-map s.png",
    "map folder": "design in.png --source-map no/s.npz",
    "stages are a file": "design in.png --stages in.png",
    "stages below a file": "design in.png --stages in.png/st",
    "stages the result": "design in.png --stages out.png",
    "unknown option": "design in.png --colour red",
    "examples that do not agree": "design in.png sample:grass",
    "no example": "design",
    "unknown command": "desing in.png",
    "apply to no map": "apply in.png",
    "apply no source": "apply in.png in.png",
    "apply a missing source": "apply no.npz in.png",
    "apply map type": "apply no.npz in.png --map-type bump",
    "apply screening": "apply no.npz in.png --screening -1",
    "apply wrap": "apply no.npz in.png --wrap z",
    "apply green": "apply no.npz in.png --green left",
    "apply interpolation": "apply no.npz in.png --interpolation best",
    "demo in a file": "demo",
    "samples to a file": "samples dots",
    "samples unknown": "samples nowhere",
    "info of nothing": "info no.png",
}


@pytest.mark.parametrize("name", ARGUMENTS)
def test_hostile_arguments(here: Path, capsys: Capture, name: str) -> None:
    words = ARGUMENTS[name].split(" ")
    arguments = [*words, "-o", "out.png"] if words[0] in ("design", "apply", "demo", "samples") else words
    before = files(here)
    assert main([w for w in arguments if w or name in ("empty name", "size nothing")]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    # Some of these errors are found during the work, after its first progress line, so ignore that line.
    lines = [line for line in err.splitlines() if line != "texrs: segment"]
    assert len(lines) == 1, err
    assert lines[0].startswith("texrs: ")
    assert files(here) == before


NAMES = {
    "out.xyz": ".png",
    "out": ".png",
    "no/out.png": "the folder no does not exist",
    ".": "folder",
    "folder.png": "folder",
    "in.png/out.png": "in.png",
    "out.hdr": "uint8",
    "out.exr": "uint8",
    "/dev/null": "",
    f"{'n' * 300}.png": "name",
}


@pytest.mark.parametrize("name", NAMES)
def test_outputs_are_checked_before_the_work(
    here: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    Path("folder.png").mkdir()
    before = files(here)
    replace_design(monkeypatch, None)  # Any work would fail with an internal error.
    assert main(["design", "in.png", "-o", name]) == 2
    assert NAMES[name] in complaint(capsys)
    assert main(["design", "in.png", "-o", "out.jpg", "--size", "16x65501"]) == 2
    assert "65500" in complaint(capsys)
    assert main(["design", "in.png", "-o", "s.npz", "--source-map", "./s.npz"]) == 2
    assert "--out" in complaint(capsys)
    assert files(here) == before


class Panic(BaseException):
    """A stand-in for a panic of the compiled part, which is not an Exception."""


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (MemoryError(), 2, "memory"),
        (RuntimeError("one\ntwo \x1b[31m"), 1, r"internal error: RuntimeError: one two \x1b[31m"),
        (Panic("boom"), 1, "internal error: Panic: boom"),
        (PermissionError(13, "Permission denied", "some.png"), 2, "some.png: permission denied"),
        (BrokenPipeError(), 141, None),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, BaseException) else "",
)
def test_failures_in_the_work(
    here: Path,
    capsys: Capture,
    monkeypatch: pytest.MonkeyPatch,
    error: BaseException,
    code: int,
    words: str | None,
) -> None:
    replace_design(monkeypatch, error)
    monkeypatch.setattr("texrs.cli._console.os.dup2", lambda *descriptors: None)
    before = files(here)
    assert main(["design", "in.png", "-o", "out.png", "--source-map", "s.npz", "--stages", "st"]) == code
    if words is None:
        assert capsys.readouterr() == ("", "")
    else:
        assert words in complaint(capsys)
    assert files(here) == before


def test_traceback_on_request(here: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    replace_design(monkeypatch, None)
    monkeypatch.setenv("TEXRS_TRACEBACK", "1")
    assert main(["design", "in.png", "-o", "out.png"]) == 1
    assert "Traceback" in capsys.readouterr().err


def test_failed_writing_leaves_what_was_there(here: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*args: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(SourceMap, "save", full)
    before = files(here)
    assert main(["design", "in.png", "-q", *TINY, "-o", "out.png", "--source-map", "s.npz"]) == 2
    assert "no space left on device" in complaint(capsys)
    assert files(here) == before

"""The command line, end to end: results, exit codes, one-line errors, and files that stay whole."""

from __future__ import annotations

import functools
import importlib
import inspect
import io
import os
import re
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import imageio.v3 as iio
import numpy as np
import pytest
import typer

import texrs
from reference.look_up import view
from texrs import SourceMap, samples
from texrs.cli import COMMANDS, app, main
from texrs.cli._console import Stopped
from texrs.cli._outputs import OUTPUTS
from texrs.elements import Elements
from texrs.errors import InvalidInput

Capture = pytest.CaptureFixture[str]
COLOURS = samples.load("dots", size=(64, 64)).image
GREY = np.ascontiguousarray(COLOURS[..., 1])
TINY = ("--size", "48", "--tiles", "1")


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in a folder that holds an exemplar, and an empty file, which any command may replace."""
    monkeypatch.chdir(tmp_path)
    iio.imwrite("in.png", COLOURS)
    Path("out.png").touch()
    return tmp_path


def files(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() if p.is_file() else b"" for p in folder.rglob("*")}


def replace_design(monkeypatch: pytest.MonkeyPatch, error: BaseException | None) -> None:
    """Let the work of texrs design fail; its options are those of the function."""
    module = importlib.import_module("texrs.papers.design")

    @functools.wraps(module.design)
    def fail(*arguments: object, **options: object) -> None:
        raise error or RuntimeError("the work has begun")

    monkeypatch.setattr(module, "design", fail)


def complaint(capture: Capture) -> str:
    """Return the one line on stderr, and nothing on stdout."""
    out, err = capture.readouterr()
    assert out == ""
    assert re.fullmatch(r"texrs: [^\n]+\n", err), err
    assert "Traceback" not in err
    return err


# --- design ----------------------------------------------------------------------------------------------------------


def test_design_writes_what_the_function_makes(here: Path, capsys: Capture) -> None:
    options = "--seed 3 --wrap x --element-layers 2 --element-kind grid --translate 0.1 --rotate 20 --scale 0.9:1.1 --no-mirror"
    more = (
        "--start 0.3 --growth-rate 1.9 --patch 12 --tiles 2 --operations 1 --stages stages --map source.npz -o out.png"
    )
    assert main(["design", "in.png", "--size", "56x40", *options.split(), *more.split()]) == 0
    expected = texrs.design(
        COLOURS,
        (40, 56),
        seed=3,
        wrap=(False, True),
        elements=texrs.ElementOptions(layers=2, kind="grid"),
        deformation=texrs.DeformationOptions(
            operations=1, translate=0.1, rotate=20.0, scale=(0.9, 1.1), mirror=False, start=0.3, growth_rate=1.9
        ),
        patch=12,
        tiles=2,
    )
    assert (iio.imread("out.png") == expected.image).all()
    assert (SourceMap.load("source.npz").coordinates == expected.source.coordinates).all()
    written = sorted(p.name for p in Path("stages").iterdir())
    assert written[0] == "01-segmentation.png"
    assert written[-1] == "report.json"
    # Each layer has a colour of its own: numbers of layers would be black.
    layers = iio.imread("stages/01-segmentation.png")
    assert layers.max() > 100
    assert len(np.unique(layers.reshape(-1, layers.shape[-1]), axis=0)) > 1
    assert not list(here.glob(".texrs*"))
    out, err = capsys.readouterr()
    assert out == ""
    lines = err.splitlines()
    assert lines[0] == "texrs: segment"
    assert "texrs: stitch" in lines
    assert re.fullmatch(r"texrs: wrote out.png: 56 x 40, 3 channels, uint8, in [0-9.]+ s", lines[-1])


def test_same_command_same_bytes(here: Path, capsys: Capture) -> None:
    for out, *more in (("a.png",), ("b.png",), ("c.png", "--threads", "1"), ("d.png", "--threads", "3")):
        arguments = ["design", "in.png", "-q", *TINY, "--seed", "5", "-o", out, "--map", f"{out}.npz", *more]
        assert main(arguments) == 0
    assert main(["design", "in.png", "-q", *TINY, "--seed", "6", "-o", "e.png"]) == 0
    assert capsys.readouterr() == ("", "")
    one = Path("a.png").read_bytes()
    assert all(Path(f"{n}.png").read_bytes() == one for n in "bcd")
    assert all(Path(f"{n}.png.npz").read_bytes() == Path("a.png.npz").read_bytes() for n in "bcd")
    assert Path("e.png").read_bytes() != one


def test_several_examples_and_several_variants(here: Path, capsys: Capture) -> None:
    texrs.io.write("other.png", samples.load("dots", size=(64, 64)).image)
    mixed = [
        "design",
        "in.png",
        "other.png",
        "-q",
        *TINY,
        "--weights",
        "3:1",
        "-o",
        "mixed.png",
        "--map",
        "mixed.npz",
    ]
    assert main(mixed) == 0
    assert set(np.unique(SourceMap.load("mixed.npz").exemplar)) == {0, 1}
    assert main(["design", "in.png", "-q", *TINY, "--seed", "4", "--variants", "3", "-o", "many.png"]) == 0
    assert sorted(p.name for p in here.glob("many*")) == ["many-4.png", "many-5.png", "many-6.png", "many.png"]
    assert main(["design", "in.png", "-q", *TINY, "--seed", "5", "-o", "alone.png"]) == 0
    assert Path("alone.png").read_bytes() == Path("many-5.png").read_bytes()
    one, table = texrs.io.read("alone.png").shape, texrs.io.read("many.png").shape
    assert table[:2] == (2 * one[0], 2 * one[1])
    assert capsys.readouterr() == ("", "")
    for weights in ("3", "1:x", "0:0"):
        assert main(["design", "in.png", "other.png", *TINY, "--weights", weights, "-o", "bad.png"]) == 2
        assert "weights" in capsys.readouterr().err.splitlines()[-1]
    assert not Path("bad.png").exists()


@pytest.mark.parametrize(("error", "code"), [(Stopped(signal.SIGINT), 130), (MemoryError(), 2)], ids=["stop", "error"])
def test_variants_that_are_made_stay_when_the_next_fails(
    here: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException, code: int
) -> None:
    command = ["design", "in.png", "-q", *TINY, "--variants", "3", "--stages", "st", "--map", "s.npz"]
    assert main([*command, "-o", "whole.png"]) == 0
    before = files(here)
    made = []

    def one(*arguments: Any) -> Any:
        if len(made) == 2:
            raise error
        made.append(make(*arguments))
        return made[-1]

    # What each texture is made with.
    module = importlib.import_module("texrs.papers.design")
    make = module.make_texture
    monkeypatch.setattr(module, "make_texture", one)
    command[-1], command[-3] = "t.npz", "tt"
    assert main([*command, "-o", "out.png"]) == code
    after = files(here)
    expected = {"out": "whole", "t": "s", "tt": "st"}
    for name, content in after.items():
        if name not in before:
            stem, dash, rest = name.partition("-")
            assert content == before[f"{expected[stem]}{dash}{rest}"], name
    assert {"out-0.png", "out-1.png", "t-1.npz", "tt-1/report.json"} <= set(after)
    assert not {"out-2.png", "t-2.npz", "tt-2"} & set(after)
    assert after["out.png"] == b""
    assert not list(here.glob(".texrs*"))


def test_labels_by_hand(here: Path, capsys: Capture) -> None:
    labels = samples.load("dots", size=(64, 64)).labels
    assert labels is not None
    iio.imwrite("labels.png", labels.astype(np.uint8))
    assert main(["design", "in.png", "--element-labels", "labels.png", *TINY, "-o", "out.png", "--stages", "s"]) == 0
    assert iio.imread("out.png").shape == (48, 48, 3)
    assert '"kind": "labels"' in Path("s/report.json").read_text()
    before = files(here)
    capsys.readouterr()
    assert main(["design", "in.png", "--element-labels", "in.png", *TINY, "-o", "out.png"]) == 2
    assert "in.png: needs integers of shape" in capsys.readouterr().err
    assert files(here) == before


def test_analysed_elements_as_example(here: Path, capsys: Capture) -> None:
    entry = Elements.of_sample(samples.load("dots", size=(96, 96)))
    entry.save("dots.npz")
    iio.imwrite("dots.png", entry.image)
    made = []
    for given in (["dots.npz"], ["dots.png", "--element-labels", "dots.npz"]):
        assert main(["design", *given, *TINY, "-o", "out.png", "--stages", "s", "--force"]) == 0
        assert '"kind": "labels"' in Path("s/report.json").read_text()
        made.append(iio.imread("out.png"))
    assert (made[0] == made[1]).all()
    Path("none.npz").write_bytes(b"nothing")
    capsys.readouterr()
    assert main(["design", "none.npz", *TINY, "-o", "out.png"]) != 0
    assert "none.npz" in complaint(capsys)


def test_sample_as_example(here: Path) -> None:
    assert main(["design", "sample:dots", *TINY, "-o", "out.png", "-q"]) == 0
    expected = texrs.design(samples.load("dots").image, 48, tiles=1).image
    assert (iio.imread("out.png") == expected).all()


def palette() -> bytes:
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(COLOURS).quantize(16).save(buffer, "png")
    return buffer.getvalue()


def npy(array: object, *, pickle: bool = False) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, np.asarray(array), allow_pickle=pickle)
    return buffer.getvalue()


def png(array: np.ndarray) -> bytes:
    return iio.imwrite("<bytes>", array, extension=".png")


ALPHA = np.dstack([COLOURS, 255 - GREY])
HONEST: dict[str, tuple[bytes, str, tuple[int, ...], type]] = {
    "rgba": (png(ALPHA), "o.png", (48, 48, 4), np.uint8),
    "grey and alpha": (png(ALPHA[..., 2:]), "o.png", (48, 48, 2), np.uint8),
    "palette": (palette(), "o.png", (48, 48, 3), np.uint8),
    "16 bit": (png(GREY.astype(np.uint16) * 257), "o.png", (48, 48), np.uint16),
    "float": (npy(COLOURS.astype(np.float32) * 9), "o.exr", (48, 48, 3), np.float32),
    "half": (npy(GREY.astype(np.float16)), "o.npy", (48, 48), np.float16),
    "bool": (npy(GREY > 99), "o.npy", (48, 48), np.bool_),
    "five channels": (npy(np.dstack([ALPHA, GREY])), "o.tif", (48, 48, 5), np.uint8),
    "constant": (npy(np.full((40, 40, 3), 7, np.uint8)), "o.png", (48, 48, 3), np.uint8),
    "jpeg out": (png(COLOURS), "o.jpg", (48, 48, 3), np.uint8),
    "strip": (npy(np.tile(GREY[:16], (1, 40))), "o.png", (48, 48), np.uint8),
}


@pytest.mark.parametrize("name", HONEST)
def test_any_image_goes_out_as_it_came(here: Path, name: str) -> None:
    content, out, shape, dtype = HONEST[name]
    Path("image").write_bytes(content)
    assert main(["design", "image", *TINY, "-o", out, "-q"]) == 0
    result = texrs.io.read(out)
    assert (result.shape, result.dtype) == (shape, dtype)


# --- what is refused -------------------------------------------------------------------------------------------------


NAN = np.where(GREY > 128, np.nan, np.float32(1))
INPUTS: dict[str, tuple[bytes | None, str]] = {
    "missing": (None, "no such file"),
    "empty": (b"", "empty"),
    "text": (b"hello, this is no picture\n" * 9, "content is none of"),
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
    assert main(["design", "bad.png", "-o", "out.png", "-q", "--map", "s.npz", "--stages", "st"]) == 2
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
    "tiles": "design in.png --tiles 0",
    "threads": "design in.png --threads 0",
    "threads many": "design in.png --threads 99999",
    "element kind": "design in.png --element-kind some",
    "layers": "design in.png --element-layers 99",
    "patch": "design in.png --patch 3",
    "blend": "design in.png --blend -1",
    "method": "design in.png --method best",
    "rotate": "design in.png --rotate 181",
    "translate": "design in.png --translate -0.1",
    "operations": "design in.png --operations 9",
    "labels missing": "design in.png --element-labels no.png",
    "map suffix": "design in.png --map s.png",
    "map folder": "design in.png --map no/s.npz",
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
    "apply kind": "apply no.npz in.png --kind bump",
    "apply blend": "apply no.npz in.png --blend -1",
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
    # Some of these are found out by the work itself, after its first line of progress.
    lines = [line for line in err.splitlines() if line != "texrs: segment"]
    assert len(lines) == 1, err
    assert lines[0].startswith("texrs: ")
    assert files(here) == before


NAMES = {
    "out.xyz": ".png",
    "out": ".png",
    "no/out.png": "no folder",
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
    replace_design(monkeypatch, None)  # Would be an internal error.
    assert main(["design", "in.png", "-o", name]) == 2
    assert NAMES[name] in complaint(capsys)
    assert main(["design", "in.png", "-o", "out.jpg", "--size", "16x65501"]) == 2
    assert "65500" in complaint(capsys)
    assert main(["design", "in.png", "-o", "s.npz", "--map", "./s.npz"]) == 2
    assert "--out" in complaint(capsys)
    assert files(here) == before


class Panic(BaseException):
    """What a panic of the compiled part looks like from here: no Exception."""


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
    assert main(["design", "in.png", "-o", "out.png", "--map", "s.npz", "--stages", "st"]) == code
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
    assert main(["design", "in.png", "-q", *TINY, "-o", "out.png", "--map", "s.npz"]) == 2
    assert "no space left on device" in complaint(capsys)
    assert files(here) == before


# --- apply -----------------------------------------------------------------------------------------------------------


def test_apply(here: Path, capsys: Capture) -> None:
    assert main(["design", "in.png", "-q", *TINY, "-o", "out.png", "--map", "s.npz"]) == 0
    places = SourceMap.load("s.npz")
    height = GREY.astype(np.float32) - 100
    np.save("height.npy", height)
    Path("results").mkdir()
    assert main(["apply", "s.npz", "in.png", "height.npy", "-o", "results"]) == 0
    assert len(capsys.readouterr().err.splitlines()) == 2
    # Finished as the result was, without an option.
    assert (iio.imread("results/in.png") == iio.imread("out.png")).all()
    result = np.load("results/height.npy")
    assert result.dtype == np.float32
    assert (result == texrs.apply(places, height)).all()
    assert main(["apply", "s.npz", "in.png", "height.npy", "-o", "results", "--blend", "0", "-q"]) == 0
    assert (iio.imread("results/in.png") == view(places, COLOURS)).all()
    np.testing.assert_allclose(np.load("results/height.npy"), view(places, height), rtol=1e-6)
    normal = [
        "--kind",
        "normal",
        "--green",
        "down",
        "--interpolation",
        "linear",
        "--blend",
        "0",
        "-q",
        "--threads",
        "1",
    ]
    assert main(["apply", "s.npz", "in.png", "-o", "normal.tif", *normal]) == 0
    expected = places.render(COLOURS, kind="normal", green="down", interpolation="linear")
    assert (texrs.io.read("normal.tif") == expected).all()
    assert main(["apply", "s.npz", "in.png", "-q", "--kind", "color", "-o", "colour.png"]) == 0
    assert (iio.imread("colour.png") == iio.imread("out.png")).all()


def test_apply_blends(here: Path) -> None:
    assert main(["design", "in.png", "-q", *TINY, "-o", "out.png", "--map", "s.npz"]) == 0
    assert main(["design", "in.png", "-q", *TINY, "--blend", "0", "-o", "plain.png", "--map", "plain.npz"]) == 0
    # The map of a result that was not blended can be, and the other way round.
    for source, blend, same in (("s.npz", "0", "plain.png"), ("plain.npz", "0.15", "out.png")):
        assert main(["apply", source, "in.png", "-q", "--blend", blend, "-o", "again.png", "--force"]) == 0
        assert (iio.imread("again.png") == iio.imread(same)).all()
    assert (iio.imread("plain.png") != iio.imread("out.png")).any()


def test_apply_is_all_or_nothing(here: Path, capsys: Capture) -> None:
    SourceMap.identity((64, 64)).save("s.npz")
    iio.imwrite("small.png", COLOURS[:40])
    Path("other").mkdir()
    iio.imwrite("other/in.png", COLOURS)
    Path("results").mkdir()
    Path("results/in.png").touch()
    before = files(here)
    for maps, out, words in (
        ("in.png small.png", "results", "small.png: number 0 needs size"),
        ("in.png small.png", "one.png", "needs a folder"),
        ("in.png", ".", "--out: ./in.png is read as in.png, and would be lost"),
        ("in.png other/in.png", "results", "two maps have the name in.png"),
        ("in.png", "out.exr", "uint8"),
        ("in.png no.png", "results", "no.png"),
    ):
        assert main(["apply", "s.npz", *maps.split(), "-o", out, "-q"]) == 2
        assert words in complaint(capsys)
        assert files(here) == before


def test_apply_takes_as_many_maps_as_there_were_examples(here: Path, capsys: Capture) -> None:
    first = SourceMap.identity((64, 64))
    which = (np.arange(64) % 2 * np.ones((64, 1))).astype(np.uint16)
    SourceMap(first.coordinates, which, first.label, None, ((64, 64), (64, 64))).save("two.npz")
    iio.imwrite("other.png", 255 - COLOURS)
    assert main(["apply", "two.npz", "in.png", "other.png", "-o", "out.png", "-q"]) == 0
    assert (iio.imread("out.png") == np.where(which[..., None] == 0, COLOURS, 255 - COLOURS)).all()
    assert main(["apply", "two.npz", "in.png", "-o", "out.png"]) == 2
    assert "made from 2 exemplars" in complaint(capsys)


def test_apply_to_a_volume(here: Path) -> None:
    SourceMap.identity((20, 24, 28)).save("s.npz")
    volume = samples.load("stripes", size=(32, 32, 32)).image[:20, :24, :28]
    texrs.io.write_volume("v.tif", volume)
    assert main(["apply", "s.npz", "v.tif", "-o", "w.tif", "-q"]) == 0
    assert (texrs.io.read_volume("w.tif") == volume).all()


# --- outputs that are inputs -----------------------------------------------------------------------------------------

COMMAND: Any = typer.main.get_command(app)


@functools.cache
def find_command(command: str) -> Any:
    return COMMAND.get_command(None, command)


def parameters(command: str) -> list[Any]:
    found: list[Any] = find_command(command).params
    return found


def writes(parameter: Any) -> bool:
    return parameter.name in OUTPUTS and parameter.param_type_name == "option"


def pairs() -> list[tuple[str, str, str]]:
    """Return each command with each of its texts that may name a file that is read, and each of its outputs."""
    found = []
    for command in COMMANDS:
        given = parameters(command)
        kinds = inspect.signature(find_command(command).callback, eval_str=True).parameters
        texts = [p.name for p in given if "str" in str(kinds[p.name].annotation).split(", <")[0] and not writes(p)]
        found += [(command, read, p.name) for read in texts for p in given if writes(p)]
    return found


def test_all_commands_are_known_to_read_and_write() -> None:
    both = {command for command, _, _ in pairs()}
    assert both >= {"design", "apply", "tile", "complete", "scale-map", "perspective", "solid", "synthesize", "slice"}
    assert both >= {"splice", "self-splice", "analyse", "database"}
    assert ("apply", "source", "out") in pairs()
    assert any(command == "solid" and "guide" in read and written == "map" for command, read, written in pairs())
    assert any(command == "design" and "labels" in read and written == "stages" for command, read, written in pairs())


@pytest.mark.parametrize(("command", "read", "written"), pairs(), ids="-".join)
def test_no_command_writes_over_what_it_reads(here: Path, command: str, read: str, written: str) -> None:
    Path("st").mkdir()
    target = "st/01-known.png" if written == "stages" else "there.npz" if written == "map" else "there.png"
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
        with pytest.raises(InvalidInput, match=f"--{written}: {target} is read"):
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
    assert "is read" in complaint(capsys)
    assert files(here) == before


def test_a_folder_of_inputs_may_take_what_replaces_none(here: Path, capsys: Capture) -> None:
    assert main(["tile", "in.png", "-o", "out.png", "-q", "--stages", "."]) == 0
    assert (iio.imread("in.png") == COLOURS).all()
    Path("gravel").mkdir()
    assert main(["samples", "gravel", "-o", "gravel", "-q"]) == 0
    assert main(["design", "in.png", *TINY, "-o", "many.png", "--variants", "2", "--stages", "."]) == 2
    assert "--stages: needs a name" in complaint(capsys)


# --- the small commands ----------------------------------------------------------------------------------------------


def test_version_help_and_names(capsys: Capture) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr() == (f"texrs {texrs.__version__}\n", "")
    assert main(["samples"]) == 0
    assert capsys.readouterr().out.split() == [*samples.names(), *samples.photographs()]
    for arguments in (["-h"], ["design", "--help"], ["apply", "-h"], ["demo", "-h"], ["samples", "-h"], ["info", "-h"]):
        assert main(arguments) == 0
        out, err = capsys.readouterr()
        assert out.startswith("Usage: texrs")
        assert err == ""


def test_samples_are_written(here: Path, capsys: Capture) -> None:
    assert main(["samples", "weave", "-o", "new/folder", "--size", "48x40", "--seed", "2"]) == 0
    assert (iio.imread("new/folder/weave.png") == samples.weave((40, 48), seed=2).image).all()
    assert capsys.readouterr().err.startswith("texrs: wrote new/folder/weave.png")
    assert main(["samples", "stripes", "-o", ".", "--size", "32x32x32", "-q"]) == 0
    assert texrs.io.read_volume("stripes.tif").shape == (32, 32, 32, 3)
    assert main(["samples", "gravel", "-o", ".", "-q"]) == 0
    assert capsys.readouterr() == ("", "")


def test_info(here: Path, capsys: Capture) -> None:
    assert main(["info", "in.png"]) == 0
    assert capsys.readouterr().out.startswith("image: 64 x 64, 3 channels, uint8, ")
    SourceMap.identity((20, 30)).save("s.npz")
    assert main(["info", "s.npz"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "source map: 30 x 20, made from 30 x 20"
    assert lines[1] == "copied unchanged: 100.0% of the pixels, in 1 regions"


# --- processes: signals, terminals, pipes ----------------------------------------------------------------------------

posix = pytest.mark.skipif(os.name != "posix", reason="signals, pipes and terminals of POSIX")
LONG = ["design", "in.png", "-o", "out.png", "--size", "3000", "--map", "s.npz", "--stages", "st"]


def start(*arguments: str, **options: object) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "texrs", *arguments]

    def heed() -> None:
        """Take interrupts, which a shell lets its background jobs ignore."""
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    return subprocess.Popen(command, stderr=subprocess.PIPE, preexec_fn=heed, **options)  # type: ignore[call-overload, no-any-return]


@posix
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_signals_leave_nothing_half_written(here: Path, number: int, code: int) -> None:
    before = files(here)
    with start(*LONG) as process:
        assert process.stderr is not None
        while b"stitch" not in (line := process.stderr.readline()):
            assert line.startswith(b"texrs: ")
        process.send_signal(number)
        rest = process.stderr.read()
    assert process.returncode == code
    assert rest.splitlines()[-1] == b"texrs: stopped; nothing was left half-written"
    assert b"Traceback" not in rest
    assert files(here) == before


@posix
def test_a_bar_on_a_terminal(here: Path) -> None:
    import pty

    mine, theirs = pty.openpty()
    command = [sys.executable, "-m", "texrs", "design", "in.png", *TINY, "-o", "out.png"]
    environment = os.environ | {"TERM": "xterm"}
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=theirs, env=environment, check=True)
    os.close(theirs)
    shown = b""
    # A terminal without a writer ends with an error on Linux and with nothing elsewhere.
    try:
        while part := os.read(mine, 4096):
            shown += part
    except OSError:
        pass
    os.close(mine)
    assert done.stdout == b""
    assert b"\x1b[" in shown
    assert b"100 %" in shown
    assert b"texrs: wrote out.png" in shown


@posix
def test_nobody_reads(here: Path) -> None:
    read, write = os.pipe()
    os.close(read)
    with start("samples", stdout=write) as process:
        os.close(write)
        assert process.stderr is not None
        assert process.stderr.read() == b""
    assert process.returncode == 141

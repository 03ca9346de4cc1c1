"""The command line, end to end: results, small commands, and files that stay whole."""

from __future__ import annotations

import importlib
import io
import re
import signal
from pathlib import Path
from typing import Any

import imageio.v3 as iio
import numpy as np
import pytest

import texrs
from commands import COLOURS, GREY, TINY, Capture, complaint, files, npy, png
from reference.look_up import view
from texrs import SourceMap, samples
from texrs.cli import main
from texrs.cli._console import Stopped
from texrs.elements import ElementAnalysis

# --- design ----------------------------------------------------------------------------------------------------------


def test_design_writes_what_the_function_makes(here: Path, capsys: Capture) -> None:
    options = "--seed 3 --wrap x --element-layers 2 --element-segmentation none"
    options += " --translate 0.1 --rotate 20 --scale 0.9:1.1 --no-allow-mirror"
    more = "--start 0.3 --growth-rate 1.9 --patch-size 12 --copies 2 --operations 1"
    more += " --stages stages --source-map source.npz -o out.png"
    assert main(["design", "in.png", "--size", "56x40", *options.split(), *more.split()]) == 0
    expected = texrs.design(
        COLOURS,
        (40, 56),
        seed=3,
        wrap=(False, True),
        elements=texrs.ElementOptions(layers=2, segmentation="none"),
        deformation=texrs.DeformationOptions(
            operations=1, translate=0.1, rotate=20.0, scale=(0.9, 1.1), allow_mirror=False, start=0.3, growth_rate=1.9
        ),
        patch_size=12,
        copies=2,
    )
    assert (iio.imread("out.png") == expected.image).all()
    assert (SourceMap.load("source.npz").coordinates == expected.source_map.coordinates).all()
    written = sorted(p.name for p in Path("stages").iterdir())
    assert written[0] == "01-segmentation.png"
    assert written[-1] == "report.json"
    # Each layer has its own colour. Layer numbers would look black.
    layers = iio.imread("stages/01-segmentation.png")
    assert layers.max() > 100
    assert len(np.unique(layers.reshape(-1, layers.shape[-1]), axis=0)) > 1
    assert not list(here.glob(".texrs*"))
    out, err = capsys.readouterr()
    assert out == ""
    lines = err.splitlines()
    assert lines[0] == "texrs: segment"
    assert "texrs: stitch" in lines
    wrote = r"texrs: wrote out.png: 56 x 40, 3 channels, uint8, borders of columns [0-9.]+ .*, in [0-9.]+ s"
    assert re.fullmatch(wrote, lines[-1])


def test_same_command_same_bytes(here: Path, capsys: Capture) -> None:
    for out, *more in (("a.png",), ("b.png",), ("c.png", "--threads", "1"), ("d.png", "--threads", "3")):
        arguments = ["design", "in.png", "-q", *TINY, "--seed", "5", "-o", out, "--source-map", f"{out}.npz", *more]
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
        "--source-map",
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
    command = ["design", "in.png", "-q", *TINY, "--variants", "3", "--stages", "st", "--source-map", "s.npz"]
    assert main([*command, "-o", "whole.png"]) == 0
    before = files(here)
    made = []

    def one(*arguments: Any) -> Any:
        if len(made) == 2:
            raise error
        made.append(make(*arguments))
        return made[-1]

    # Record the arguments of each texture.
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
    assert '"segmentation": "labels"' in Path("s/report.json").read_text()
    before = files(here)
    capsys.readouterr()
    assert main(["design", "in.png", "--element-labels", "in.png", *TINY, "-o", "out.png"]) == 2
    assert "in.png: must be integers of shape" in capsys.readouterr().err
    assert files(here) == before


def test_analysed_elements_as_example(here: Path, capsys: Capture) -> None:
    entry = ElementAnalysis.of_sample(samples.load("dots", size=(96, 96)))
    entry.save("dots.npz")
    iio.imwrite("dots.png", entry.image)
    made = []
    for given in (["dots.npz"], ["dots.png", "--element-labels", "dots.npz"]):
        assert main(["design", *given, *TINY, "-o", "out.png", "--stages", "s", "--force"]) == 0
        assert '"segmentation": "labels"' in Path("s/report.json").read_text()
        made.append(iio.imread("out.png"))
    assert (made[0] == made[1]).all()
    Path("none.npz").write_bytes(b"nothing")
    capsys.readouterr()
    assert main(["design", "none.npz", *TINY, "-o", "out.png"]) != 0
    assert "none.npz" in complaint(capsys)


def test_sample_as_example(here: Path) -> None:
    assert main(["design", "sample:dots", *TINY, "-o", "out.png", "-q"]) == 0
    expected = texrs.design(samples.load("dots").image, 48, copies=1, way="still").image
    assert (iio.imread("out.png") == expected).all()


def palette() -> bytes:
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(COLOURS).quantize(16).save(buffer, "png")
    return buffer.getvalue()


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
    "strip": (npy(np.tile(GREY[:16], (1, 10))), "o.png", (48, 48), np.uint8),
}


@pytest.mark.parametrize("name", HONEST)
def test_any_image_goes_out_as_it_came(here: Path, name: str) -> None:
    content, out, shape, dtype = HONEST[name]
    Path("image").write_bytes(content)
    assert main(["design", "image", *TINY, "-o", out, "-q"]) == 0
    result = texrs.io.read(out)
    assert (result.shape, result.dtype) == (shape, dtype)


# --- apply -----------------------------------------------------------------------------------------------------------


def test_apply(here: Path, capsys: Capture) -> None:
    assert main(["design", "in.png", "-q", *TINY, "-o", "out.png", "--source-map", "s.npz"]) == 0
    places = SourceMap.load("s.npz")
    height = GREY.astype(np.float32) - 100
    np.save("height.npy", height)
    Path("results").mkdir()
    assert main(["apply", "s.npz", "in.png", "height.npy", "-o", "results"]) == 0
    assert len(capsys.readouterr().err.splitlines()) == 2
    # The image is finished like the result, without an option for it.
    assert (iio.imread("results/in.png") == iio.imread("out.png")).all()
    result = np.load("results/height.npy")
    assert result.dtype == np.float32
    assert (result == texrs.apply(places, height)).all()
    assert main(["apply", "s.npz", "in.png", "height.npy", "-o", "results", "--screening", "0", "-q"]) == 0
    assert (iio.imread("results/in.png") == view(places, COLOURS)).all()
    np.testing.assert_allclose(np.load("results/height.npy"), view(places, height), rtol=1e-6)
    normal = [
        "--map-type",
        "normal",
        "--green",
        "down",
        "--interpolation",
        "linear",
        "--screening",
        "0",
        "-q",
        "--threads",
        "1",
    ]
    assert main(["apply", "s.npz", "in.png", "-o", "normal.tif", *normal]) == 0
    expected = places.render(COLOURS, map_type="normal", green="down", interpolation="linear")
    assert (texrs.io.read("normal.tif") == expected).all()
    assert main(["apply", "s.npz", "in.png", "-q", "--map-type", "color", "-o", "colour.png"]) == 0
    assert (iio.imread("colour.png") == iio.imread("out.png")).all()


def test_apply_blends(here: Path) -> None:
    assert main(["design", "in.png", "-q", *TINY, "-o", "out.png", "--source-map", "s.npz"]) == 0
    assert (
        main(["design", "in.png", "-q", *TINY, "--screening", "0", "-o", "plain.png", "--source-map", "plain.npz"]) == 0
    )
    # The map of a result without blending can be blended, and vice versa.
    for source, blend, same in (("s.npz", "0", "plain.png"), ("plain.npz", "0.02", "out.png")):
        assert main(["apply", source, "in.png", "-q", "--screening", blend, "-o", "again.png", "--force"]) == 0
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
        ("in.png small.png", "results", "small.png: exemplar 0 must have size"),
        ("in.png small.png", "one.png", "must be an existing folder"),
        ("in.png", ".", "--out: ./in.png is an input (in.png), and would be lost"),
        ("in.png other/in.png", "results", "two results would have the name in.png"),
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
    assert "each result needs 2 images" in complaint(capsys)


def test_apply_to_a_volume(here: Path) -> None:
    SourceMap.identity((20, 24, 28)).save("s.npz")
    volume = samples.load("stripes", size=(32, 32, 32)).image[:20, :24, :28]
    texrs.io.write_volume("v.tif", volume)
    assert main(["apply", "s.npz", "v.tif", "-o", "w.tif", "-q"]) == 0
    assert (texrs.io.read_volume("w.tif") == volume).all()


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

"""Unbounded designs on the command line: tile sets, and windows of them."""

from pathlib import Path

import numpy as np
import pytest

import texrs
from texrs import io, samples
from texrs.cli import main

DOTS = samples.dots((64, 64)).image
OPTIONS = ["--tile-size", "48", "--pictures", "1", "--way", "still", "-q"]
FAR = 10**12


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    io.write("dots.png", DOTS)
    return tmp_path


@pytest.fixture(scope="module")
def tiles() -> texrs.CornerTiles:
    return texrs.CornerTiles(DOTS, 48, variants=1, way="still")


def test_the_set_is_what_engines_read(here: Path, tiles: texrs.CornerTiles, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["tiles", "dots.png", "-o", "set", "--index", "12x8", *OPTIONS]
    assert main(words) == 0
    assert np.array_equal(io.read("set/image.png"), tiles.atlas)
    assert io.read("set/index.png").shape == (8, 12)
    assert {p.name for p in Path("set").iterdir()} >= {"tiles.glsl", "tiles.gdshader"}
    assert main(words) == 0  # The command replaces its own files.
    assert main(["rerun", "set", "-q"]) == 0
    assert capsys.readouterr().out.count("the same bytes") == 4
    Path("set/tiles.glsl").write_text("mine")  # Files of the user are kept.
    assert main(words) == 2
    assert "tiles.glsl was changed since" in capsys.readouterr().err


def test_windows_of_pictures_and_of_materials(here: Path, tiles: texrs.CornerTiles) -> None:
    assert main(["tiles", "dots.png", "-o", "w.png", "--size", "50x40", "--origin", f"{FAR},-7", *OPTIONS]) == 0
    assert np.array_equal(io.read("w.png"), tiles[-7:33, FAR : FAR + 50])
    texrs.Material({"albedo": DOTS, "height": DOTS[..., 0]}).save("stones")
    assert main(["tiles", "stones", "-o", "out", "--size", "50x40", *OPTIONS]) == 0
    made = texrs.CornerTiles(texrs.Material.read("stones"), 48, variants=1, way="still").window(0, (40, 50))
    assert made.material is not None
    for name in ("albedo", "height"):
        assert np.array_equal(io.read(f"out/{name}.png"), made.material[name].pixels)


def test_windows_larger_than_memory(here: Path, tiles: texrs.CornerTiles) -> None:
    stores = pytest.importorskip("texrs.stores")
    pytest.importorskip("zarr")
    words = ["--size", "90x70", "--chunks", "64", "--origin", f"5,{FAR}", *OPTIONS]
    assert main(["tiles", "dots.png", "-o", "w.zarr", *words]) == 0
    wanted = tiles[FAR : FAR + 70, 5:95]
    assert np.array_equal(stores.open_store("w.zarr").compute(), wanted)
    assert main(["tiles", "dots.png", "-o", "w.raw", *words]) == 0
    assert np.array_equal(io.read_volume("w.nhdr")[0], wanted)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["-o", "set", "--origin", "3,4"], "--origin: must be combined with --size"),
        (["-o", "set", "--workers", "2"], "--workers: must be combined with --size"),
        (["-o", "w.png", "--size", "8", "--index", "8"], "--index: cannot be combined with --size"),
        (["-o", "set", "--tile-size", "50"], "--tile-size: must be a multiple of 4"),
        (["-o", "w.png", "--size", "8", "--origin", "1"], "--origin: must be X,Y"),
        (["-o", "set", "--role", "a=height"], "--role: only available for materials"),
        (["-o", "dots.png", "--size", "8"], "dots.png is an input"),
    ],
)
def test_what_is_refused(here: Path, words: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["tiles", "dots.png", *words]) == 2
    assert message in capsys.readouterr().err
    assert [p.name for p in here.iterdir()] == ["dots.png"]

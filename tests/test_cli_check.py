"""``texrs check``, and what ``texrs tile`` prints about borders and sizes."""

from __future__ import annotations

import numpy as np
import pytest

import texrs
from texrs import io, samples
from texrs.cli import main


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    io.write("in.png", samples.load("pebbles", size=(128, 128)).image)
    return tmp_path


def test_a_picture_is_checked_and_shown_twice_by_twice(folder, capsys):
    assert main(["check", "in.png", "-o", "twice.png"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0] == "in.png: 128 x 128, 3 channels, uint8"
    assert said[1].startswith("rows (bottom to top): do not tile, seam ")
    assert said[2].startswith("columns (right to left): do not tile, seam ")
    np.testing.assert_array_equal(io.read("twice.png"), np.tile(io.read("in.png"), (2, 2, 1)))


def test_a_tile_is_left_as_it_is(folder, capsys):
    assert main(["tile", "in.png", "-o", "tile.png"]) == 0
    said = capsys.readouterr().err
    assert "of the pixels in place, " in said
    assert "% unchanged, borders of rows " in said
    assert ", seams between rows " in said
    assert main(["check", "tile.png"]) == 0
    assert [line.partition(", seam")[0] for line in capsys.readouterr().out.splitlines()[1:]] == [
        "rows (bottom to top): tile",
        "columns (right to left): tile",
    ]
    assert main(["tile", "tile.png", "-o", "again.png"]) == 0
    said = capsys.readouterr().err
    assert "is already tileable along the rows and columns, which are not changed" in said
    assert "100% of the pixels in place" in said
    np.testing.assert_array_equal(io.read("tile.png"), io.read("again.png"))


def test_seams_inside_are_checked_with_a_source_map(folder, capsys):
    assert main(["tile", "in.png", "-o", "tile.png", "--source-map", "map.npz", "-q"]) == 0
    assert main(["check", "tile.png", "--source-map", "map.npz"]) == 0
    said = capsys.readouterr().out.splitlines()
    found = texrs.check_tiling(io.read("tile.png"), texrs.SourceMap.load("map.npz"))
    assert said[1].endswith(f"; seams inside not visible, {found.step[0]:.2f}")
    assert said[2].endswith(f"; seams inside not visible, {found.step[1]:.2f}")
    assert main(["check", "in.png"]) == 0
    assert "inside" not in capsys.readouterr().out
    io.write("less.png", io.read("tile.png")[:64])
    assert main(["check", "less.png", "--source-map", "map.npz"]) == 2
    assert "--source-map: must have the size of the image" in capsys.readouterr().err


def test_the_reason_of_another_size_is_printed(folder, capsys):
    io.write("scales.png", samples.load("scales", size=(256, 256)).image)
    assert main(["tile", "scales.png", "-o", "tile.png"]) == 0
    assert ", columns 256 -> 202 pixels: 2 whole periods of about 100.8" in capsys.readouterr().err


def test_each_map_of_a_folder_is_checked(folder, capsys):
    (folder / "rock").mkdir()
    image = io.read("in.png")
    io.write("rock/rock_albedo.png", image)
    io.write("rock/rock_height.png", image[..., 0].astype(np.uint16) * 257)
    assert main(["check", "rock"]) == 0
    said = capsys.readouterr().out
    assert all(f"{name}: columns (right to left): " in said for name in ("albedo", "height"))


def test_uneven_light_is_printed_and_may_be_kept(folder, capsys):
    grit = samples.load("grit", size=(128, 128)).image
    ramp = np.linspace(0.55, 1.45, 128)[:, np.newaxis]
    io.write("lit.png", np.clip(np.rint(grit * ramp), 0, 255).astype(np.uint8))
    assert main(["tile", "lit.png", "-o", "even.png"]) == 0
    assert "is lit unevenly" in capsys.readouterr().err
    assert main(["tile", "lit.png", "-o", "kept.png", "--no-flatten-lighting"]) == 0
    assert "unevenly" not in capsys.readouterr().err


def test_an_output_is_checked_before_the_work(folder, capsys):
    assert main(["check", "in.png", "-o", "in.png"]) == 2
    assert main(["check", "nowhere.png"]) == 2
    assert "nowhere.png" in capsys.readouterr().err

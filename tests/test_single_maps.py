"""Single files that are maps by their name and values: normals are rotated with the surface, and labels stay labels."""

from pathlib import Path

import numpy as np
import pytest

import texrs
from texrs import Material, SourceMap, io
from texrs._typing import Array
from texrs.cli import main

PEBBLES = texrs.samples.pebbles((96, 96)).image
VERBS = {
    "tile": "",
    "design": "--size 80x96 --rotate 90",
    "inpaint": "hole.png",
    "synthesize": "--size 64x64",
    "perspective": "--size 64x64 --target plane:slant=40",
    "rectify": "--slant 30 --fov 60",
    "extend": "--right 12 --slant 30 --fov 60",
    "remove": "hole.png --slant 30 --fov 60",
    "self-splice": "--edit regularise",
}
"""All verbs that take and write an image, with their other arguments."""


def draw_normals(*, down: bool) -> Array:
    rise, run = np.gradient(PEBBLES[..., 1] / 40)
    vectors = np.dstack([-run, -rise if down else rise, np.ones_like(run)])
    vectors /= np.linalg.norm(vectors, axis=2, keepdims=True)
    return np.rint((vectors + 1) * 127.5).astype(np.uint8)


NORMALS = {name: draw_normals(down=name.endswith("dx")) for name in ("rock_normal_gl", "rock_normal_dx")}
LABELS = np.kron(np.random.default_rng(5).integers(0, 60000, (12, 12)).astype(np.uint16), np.ones((8, 8), np.uint16))


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name, pixels in NORMALS.items():
        io.write(f"{name}.png", pixels)
    io.write("x_labels.png", LABELS)
    io.write("photo_normal.png", PEBBLES)
    io.write("photo.png", PEBBLES)
    io.write("hole.png", np.pad(np.full((20, 20), 255, np.uint8), 38))
    return tmp_path


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("name", NORMALS)
def test_a_single_normal_map_is_one(here: Path, capsys: pytest.CaptureFixture[str], verb: str, name: str) -> None:
    """The result equals the source map's lookup of the normals as a map of a material."""
    assert main([verb, f"{name}.png", *VERBS[verb].split(), "-o", "out.png", "--source-map", "map.npz"]) == 0
    role = "normal-dx" if name.endswith("dx") else "normal"
    assert f"{name}.png: read as {role}, because its name and its values match this role" in capsys.readouterr().err
    truth = Material({"map": NORMALS[name]}, roles={"map": role}).apply(SourceMap.load("map.npz"))["map"].pixels
    made = io.read("out.png")
    assert (made == truth).all()
    assert np.abs(np.linalg.norm(made / 127.5 - 1, axis=2) - 1).max() < 0.01


@pytest.mark.parametrize("verb", VERBS)
def test_single_labels_stay_labels(here: Path, verb: str) -> None:
    assert main([verb, "x_labels.png", *VERBS[verb].split(), "-o", "out.png"]) == 0
    assert np.isin(io.read("out.png"), LABELS).all()


def test_values_must_agree_with_the_name(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["tile", "photo.png", "-o", "plain.png"]) == 0
    capsys.readouterr()
    assert main(["tile", "photo_normal.png", "-o", "named.png"]) == 0
    said = capsys.readouterr().err
    assert "photo_normal.png: read as colours, because its values do not match the role normal" in said
    assert "normals without z" not in said
    assert (io.read("named.png") == io.read("plain.png")).all()


def test_tiles_and_variants_of_a_single_map_are_images(here: Path) -> None:
    assert main(["tiles", "rock_normal_gl.png", "--size", "72x72", "-o", "window.png"]) == 0
    lengths = np.linalg.norm(io.read("window.png") / 127.5 - 1, axis=2)
    assert np.abs(lengths - 1).max() < 0.01
    assert main(["design", "rock_normal_gl.png", "--size", "64x64", "--variants", "2", "-o", "many.png"]) == 0
    assert io.read("many-1.png").shape == (64, 64, 3)
    assert (
        main(["inpaint", "rock_normal_gl.png", "hole.png", "--exemplar", "rock_normal_gl.png", "-o", "filled.png"]) == 0
    )
    # Several inputs are mixed as images, because they may differ in kind.
    assert main(["design", "rock_normal_gl.png", "photo.png", "--size", "64x64", "-o", "mixed.png"]) == 0

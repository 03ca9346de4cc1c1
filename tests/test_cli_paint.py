"""Meshes painted from the command line."""

import json
import struct
from pathlib import Path

import numpy as np
import pytest

import texrs
from texrs import io, samples
from texrs.cli import main
from texrs.painting.reading import read_mesh

trimesh = pytest.importorskip("trimesh")
pytest.importorskip("xatlas")

STRIPES = samples.stripes((32, 32, 32)).image[:20, :20, :20]
SMALL = ["--voxels", "2", "-q"]


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    trimesh.creation.icosphere(subdivisions=1, radius=6.0).export("ball.stl")
    io.write_volume("stripes.tif", STRIPES)
    return tmp_path


def read_glb(path: str) -> dict:
    data = Path(path).read_bytes()
    (length,) = struct.unpack("<I", data[12:16])
    return json.loads(data[20 : 20 + length])


def test_an_atlas_and_its_provenance(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["paint", "ball.stl", "stripes.tif", "-o", "a.glb", "--atlas", "64", *SMALL]
    assert main(words) == 0
    made = texrs.painting.texture_mesh("ball.stl", texrs.SolidTexture(STRIPES), scale=2, atlas=64)
    shown = trimesh.load("a.glb", force="mesh", process=False)
    assert np.array_equal(np.asarray(shown.visual.material.baseColorTexture)[..., :3], made.maps["image"])
    assert main(["rerun", "a.glb", "-q"]) == 0
    assert "the same bytes" in capsys.readouterr().out
    assert main([*words, "--padding", "2"]) == 0  # The command replaces its own file.


def test_a_material_in_16_bit_along_an_axis_as_obj(here: Path) -> None:
    texrs.Material({"albedo": STRIPES, "height": STRIPES[..., 0]}, axes=3).save("block")
    words = ["paint", "ball.stl", "block", "-o", "a.obj", "--atlas", "32", "--bits", "16", "--directions", "around:z"]
    words += ["--quality", "fast"]
    assert main([*words, "--along", "y", "--voxels", "1", "-q"]) == 0
    lines = Path("a.mtl").read_text().splitlines()
    named = {word: name for word, _, name in (line.partition(" ") for line in lines)}
    assert named["map_Kd"] == "a_basecolor.png"
    assert {word for word, name in named.items() if name.endswith(".png")} == {"map_Kd", "norm", "map_Bump"}
    assert all(io.read(name).dtype == np.uint16 for name in named.values() if name.endswith(".png"))
    shown = trimesh.load("a.obj", force="mesh", process=False)
    assert len(shown.faces) == 80
    assert shown.visual.uv.shape == (len(shown.vertices), 2)


def test_directions_are_at_the_scale_of_the_atlas(here: Path) -> None:
    """The field and the texture have one scale, also if the atlas limits it."""
    words = [
        "paint",
        "ball.stl",
        "stripes.tif",
        "-o",
        "a.glb",
        "--atlas",
        "32",
        "--directions",
        "around:z",
        "--quality",
        "fast",
    ]
    assert main([*words, "-q"]) == 0
    texture, surface = texrs.SolidTexture(STRIPES, quality="fast"), read_mesh("ball.stl")
    scale = texrs.painting.find_scale(surface, texture, atlas=32)
    assert scale < 4 * 20 / 12
    turned = texrs.painting.field_on_surface("ball.stl", "around:z", scale=scale)
    made = texrs.painting.texture_mesh(
        "ball.stl", texrs.SolidTexture(STRIPES, field=turned, quality="fast"), scale=scale, atlas=32
    )
    shown = trimesh.load("a.glb", force="mesh", process=False)
    assert np.array_equal(np.asarray(shown.visual.material.baseColorTexture)[..., :3], made.maps["image"])


def test_colours_of_corners(here: Path) -> None:
    assert main(["paint", "ball.stl", "stripes.tif", "-o", "c.ply", "--vertices", *SMALL]) == 0
    vertices, faces = texrs.painting.reading.read_mesh("ball.stl")[:2]
    wanted = texrs.SolidTexture(STRIPES).sample(vertices[:, ::-1] * 2)
    assert np.array_equal(trimesh.load("c.ply", process=False).visual.vertex_colors[:, :3], wanted)
    assert len(faces) == 80


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["-o", "a.png"], "must be a .glb, .gltf or .obj file"),
        (["-o", "a.ply"], ".ply is only for colours of vertices"),
        (["-o", "a.glb", "--along", "y"], "--along: must be combined with --directions"),
        (["-o", "a.glb", "--directions", "up"], "--directions: must be an axis such as x"),
        (["-o", "a.glb", "--directions", "x", "--field", "circular"], "cannot be combined with"),
        (["-o", "a.glb", "--bits", "12"], "--bits: must be one of 8, 16"),
        (["-o", "a.glb", "--role", "a=height"], "--role: only available for materials"),
        (["-o", "a.glb", "--voxels", "0"], "--voxels"),
    ],
)
def test_what_is_refused(here: Path, words: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    before = sorted(p.name for p in here.iterdir())
    assert main(["paint", "ball.stl", "stripes.tif", *words]) == 2
    assert message in capsys.readouterr().err
    assert sorted(p.name for p in here.iterdir()) == before

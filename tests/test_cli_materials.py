"""Materials on the command line: folders of maps in and out, without loss."""

import hashlib
import json
import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import texrs
from texrs import Material, io, samples
from texrs.cli import main
from texrs.cli._verbs import NAMES

SIZE = ["--size", "64x64", "-q"]


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in a folder with a material of two maps and one with unclear names."""
    monkeypatch.chdir(tmp_path)
    image = samples.pebbles((48, 64)).image
    Path("rock").mkdir()
    io.write("rock/rock_albedo.png", image)
    io.write("rock/rock_height.png", image[..., 1].astype(np.uint16) * 257)
    io.write("rock/rock_wet.png", image[..., 2])
    return tmp_path


def files(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def test_a_folder_is_designed_in_one_go(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["design", "rock", "-o", "new", *SIZE, "--seed", "3", "--preview", "lit.png", "--source-map", "map.npz"]
    assert main([*words, "--role", "rock_wet.png=other"]) == 0
    assert sorted(p.name for p in Path("new").iterdir()) == ["rock_albedo.png", "rock_height.png", "rock_wet.png"]
    material = Material.read("rock", roles={"rock_wet": "other"})
    made = texrs.design(material, 64, seed=3).material
    assert made is not None
    for name, each in made.items():
        assert (io.read(f"new/rock_{name}.png") == each.pixels).all()
    assert (io.read("lit.png") == made.preview()).all()
    # ``texrs apply`` without options gives the same result for one map.
    assert main(["apply", "map.npz", "rock/rock_height.png", "-o", "again.png", "-q"]) == 0
    assert (io.read("again.png") == made["height"].pixels).all()
    assert main(["rerun", "new/rock_height.png", "-q"]) == 0
    assert "the same bytes" in capsys.readouterr().out
    assert main(["info", "new/rock_albedo.png"]) == 0
    said = capsys.readouterr().out
    assert "rock/rock_wet.png" in said
    assert "--role rock_wet.png=other" in said


def test_colours_are_brought_into_even_light_and_heights_are_not(here: Path) -> None:
    lit = (io.read("rock/rock_albedo.png") * np.linspace(0.4, 1, 64)[:, np.newaxis]).astype(np.uint8)
    io.write("rock/rock_albedo.png", lit)
    assert main(["tile", "rock", "-o", "new", "--flatten-lighting", "--source-map", "map.npz", "-q"]) == 0
    source = texrs.SourceMap.load("map.npz")
    for name in ("albedo", "height"):
        assert main(["apply", "map.npz", f"rock/rock_{name}.png", "-o", f"{name}.png", "-q"]) == 0
        assert (io.read(f"{name}.png") == io.read(f"new/rock_{name}.png")).all()
    assert (io.read("new/rock_height.png") == source.render(io.read("rock/rock_height.png"))).all()
    assert main(["apply", "map.npz", "rock/rock_albedo.png", "-o", "lit.png", "--no-flatten-lighting", "-q"]) == 0
    assert (io.read("lit.png") == source.render(lit)).all()
    assert (io.read("albedo.png") != io.read("lit.png")).any()


def test_what_names_do_not_tell_is_left_out_and_said(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["tile", "rock", "-o", "new"]) == 0
    assert "rock_wet.png not used: the name gives no role" in capsys.readouterr().err
    assert sorted(p.name for p in Path("new").iterdir()) == ["rock_albedo.png", "rock_height.png"]


def test_depth_and_format(here: Path) -> None:
    assert main(["design", "rock", "-o", "new/deep", *SIZE, "--depth", "16", "--format", "tif"]) == 0
    assert io.read("new/deep/rock_albedo.tif").dtype == np.uint16
    assert main(["design", "rock", "-o", "float", *SIZE, "--depth", "32"]) == 0
    assert io.read("float/rock_height.exr").dtype == np.float32


VERBS = {
    "inpaint": "inpaint rock hole.png",
    "design": "design rock --size 64",
    "extend": "extend rock --left 8 --slant 0",
    "perspective": "perspective rock --size 64 --scale-map front",
    "rectify": "rectify rock --slant 20 --tilt 90 --fov 50",
    "remove": "remove rock hole.png --slant 0",
    "self-splice": "self-splice rock",
    "splice": "splice rock sample:dots --size 64",
    "synthesize": "synthesize rock --size 64",
    "tile": "tile rock",
}


def test_every_verb_of_pictures_is_tried() -> None:
    assert VERBS.keys() == set(NAMES) - {"solid"}


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_takes_a_folder(here: Path, capsys: pytest.CaptureFixture[str], verb: str) -> None:
    io.write("hole.png", np.pad(np.full((8, 8), 255, np.uint8), 28))
    # Use separate elements, and sides as long as the verbs for photographs need.
    dots = samples.dots((64, 64)).image
    Path("rock/rock_wet.png").unlink()
    io.write("rock/rock_albedo.png", dots)
    io.write("rock/rock_height.png", dots[..., 1].astype(np.uint16) * 257)
    shown = "--preview lit.png --gltf it.glb --source-map map.npz -q"
    assert main([*VERBS[verb].split(), "-o", "new", *shown.split()]) == 0, capsys.readouterr().err
    made = Material.read("new")
    assert {name: str(each.pixels.dtype) for name, each in made.items()} == {"albedo": "uint8", "height": "uint16"}
    assert (made["height"].pixels.shape) == texrs.SourceMap.load("map.npz").shape
    assert main(["apply", "map.npz", "rock/rock_height.png", "-o", "again.png", "-q"]) == 0
    assert (io.read("again.png") == made["height"].pixels).all()
    # Records depend on the format of a file and not on the verb, so all formats are tested with one verb only.
    again = ("new", "lit.png", "it.glb", "map.npz") if verb == "tile" else ("new",)
    for each in again:
        assert main(["rerun", each, "-q"]) == 0
    # The folder of a material contains two files, so it has one line more than the other outputs.
    assert capsys.readouterr().out.count("the same bytes") == len(again) + 1


@pytest.mark.parametrize("verb", [*VERBS, "info", "analyse", "tiles"])
def test_no_command_ignores_a_file_silently(here: Path, capsys: pytest.CaptureFixture[str], verb: str) -> None:
    """Each command reads the folder before it works, so a strict run fails at once."""
    io.write("hole.png", np.pad(np.full((8, 8), 255, np.uint8), 28))
    words = VERBS.get(verb, f"{verb} rock").split()
    out = {"info": [], "analyse": ["-o", "new.npz"]}.get(verb, ["-o", "new"])
    assert main([*words, *out, "--strict"]) == 2
    assert "rock: rock_wet.png not used: the name gives no role; this is an error" in capsys.readouterr().err
    assert not Path("new").exists()


def test_a_layout_may_be_that_of_a_material(here: Path) -> None:
    """Only positions of the second input count. The result is an image, like the first input."""
    io.write("dots.png", samples.dots((64, 64)).image)
    io.write("rock/rock_albedo.png", samples.dots((64, 64), seed=5).image)
    io.write("rock/rock_height.png", samples.dots((64, 64), seed=5).image[..., 0])
    Path("rock/rock_wet.png").unlink()
    assert main(["splice", "dots.png", "rock", "-o", "made.png", "-q"]) == 0
    assert io.read("made.png").shape == (64, 64, 3)


def test_what_else_lies_in_a_folder_of_maps_does_not_count(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("rock/notes.txt").write_text("1")
    assert main(["tile", "rock", "-o", "new", "-q", "--stages", "rock/stages"]) == 0
    Path("rock/notes.txt").write_text("2")
    io.write("rock/lit.png", np.zeros((8, 8), np.uint8))
    assert main(["rerun", "new", "-q"]) == 0
    capsys.readouterr()
    assert main(["info", "new/rock_albedo.png"]) == 0
    out = capsys.readouterr().out
    assert "rock_albedo.png" in out
    assert "notes" not in out
    assert "wet" not in out
    io.write("rock/rock_height.png", np.zeros((48, 64), np.uint8))
    assert main(["rerun", "new", "-q"]) == 2
    assert "rock_height.png has changed since" in capsys.readouterr().err


def test_a_material_says_itself_what_labels_are(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["synthesize", "rock", "-o", "new", "--size", "64", "--labels", "-q"]) == 2
    assert "--labels: not available for materials" in capsys.readouterr().err


def test_a_folder_is_made_again_as_a_whole(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["design", "rock", "-o", "new", *SIZE, "--mipmaps", "small"]) == 0
    io.write("new/mine.png", np.zeros((8, 8), np.uint8))
    capsys.readouterr()
    assert main(["rerun", "new", "-q"]) == 0
    assert [line.split(":")[:2] for line in capsys.readouterr().out.splitlines()] == [
        ["new/rock_albedo.png", " the same bytes, SHA-256 " + texrs_hash("new/rock_albedo.png")],
        ["new/rock_height.png", " the same bytes, SHA-256 " + texrs_hash("new/rock_height.png")],
    ]
    assert main(["rerun", "small", "-q"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 12
    assert main(["rerun", "new", "-o", "other", "-q"]) == 2
    assert "--out: only available for one file" in capsys.readouterr().err
    assert main(["rerun", "rock", "-q"]) == 2
    assert "rock: contains no file with a record of the command that made it" in capsys.readouterr().err
    assert main(["tile", "rock", "-o", "other", "-q"]) == 0
    os.rename("other/rock_albedo.png", "new/other.png")
    assert main(["rerun", "new", "-q"]) == 2
    assert "contains results of several commands" in capsys.readouterr().err


def texrs_hash(path: str) -> str:
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def test_layers_of_a_file(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("OpenEXR", reason="layers of EXR files need the package")
    assert main(["design", "rock", "-o", "new.exr", *SIZE]) == 0
    assert main(["tile", "new.exr", "-o", "tiled", "-q"]) == 0
    assert io.read("tiled/height.png").dtype == np.uint16
    capsys.readouterr()
    assert main(["info", "new.exr"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[:3] == [
        "material: 64 x 64, 2 layers",
        "albedo: colour, sRGB, 3 channels, uint8",
        "height: height, linear, 1 channel, uint16",
    ]
    assert main(["rerun", "new.exr", "-q"]) == 0
    assert "the same bytes" in capsys.readouterr().out


def test_what_engines_load(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    io.write("rock/rock_rough.png", samples.pebbles((48, 64)).image[..., 0])
    shown = ["--mipmaps", "small", "--gltf", "rock.glb", "--materialx", "mtlx", "--pack", "orm"]
    assert main(["design", "rock", "-o", "new", *SIZE, *shown]) == 0
    assert "rock_orm.png" in {p.name for p in Path("new").iterdir()}
    assert {"rock_albedo.1.png", "rock_albedo.6.png", "rock_orm.1.png"} <= {p.name for p in Path("small").iterdir()}
    assert io.read("small/rock_albedo.1.png").shape == (32, 32, 3)
    assert Path("rock.glb").read_bytes()[:4] == b"glTF"
    assert "standard_surface" in Path("mtlx/material.mtlx").read_text()
    for made, says in {
        "small/rock_height.2.png": "image: 16 x 16, 1 channel, uint16",
        "rock.glb": "scene: glTF 2.0, plane, sphere, textures ",
        "mtlx/material.mtlx": "material: MaterialX 1.",
    }.items():
        assert main(["rerun", made, "-q"]) == 0, made
        assert "the same bytes" in capsys.readouterr().out
        assert main(["info", made]) == 0
        assert capsys.readouterr().out.startswith(says)
    assert main(["info", "new"]) == 0
    assert capsys.readouterr().out.splitlines()[:2] == [
        "material: 64 x 64, 3 maps",
        "albedo: colour, sRGB, 3 channels, uint8",
    ]
    for name in ("bad.glb", "bad.mtlx"):
        Path(name).write_bytes(b"something else")
        assert main(["info", name]) == 2
        assert re.search(f"{name}: (is damaged or )?not a ", capsys.readouterr().err)


def test_variants_go_to_folders_of_their_own(here: Path) -> None:
    assert main(["design", "rock", "-o", "new", *SIZE, "--variants", "2"]) == 0
    assert sorted(files(here / "new-0")) == sorted(files(here / "new-1")) == ["rock_albedo.png", "rock_height.png"]
    assert files(here / "new-0") != files(here / "new-1")
    assert not Path("new").exists()


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("design rock -o new --depth 12", "--depth: must be one of 8, 16, 32; got 12"),
        ("design rock -o new --format jpg", "--format: must be one of png, tif, exr; got 'jpg'"),
        ("design rock -o new --pack rgb", "--pack: must be one of orm, none; got 'rgb'"),
        ("design rock -o new --gltf rock.gltf", "--gltf: must be a name that ends in .glb"),
        ("design rock/rock_albedo.png -o new.png --mipmaps small", "--mipmaps: only available for materials"),
        ("solid sample:stripes -o new.tif --size 32x32x32 --depth 16", "No such option: --depth"),
        ("design rock -o new --role wet", "--role: must be MAP=ROLE"),
        ("design rock -o new --role rock_wet=shiny", "must be one of"),
        ("design rock -o new --role dry=mask", "got 'dry'"),
        ("design rock -o new.exr --depth 16", "--out: must be a folder with --depth"),
        ("design rock/rock_albedo.png -o new.png --depth 16", "--depth: only available for materials"),
        ("design rock/rock_albedo.png -o new.png --preview lit.png", "--preview: only available for materials"),
        ("design rock rock/rock_albedo.png -o new", "must either all be materials or all be images"),
        ("design rock -o mine", "mine/rock_albedo.png exists"),
        ("design same -o same", "--out: same is the folder of an input, and would contain other maps"),
        ("tile rock -o new --mipmaps links/../rock", "rock is the folder of an input, and would contain other maps"),
        ("tile uneven -o new", "uneven: must all have the same size, but height has"),
        ("design rock -o links", "is an input (rock/rock_albedo.png), and would be lost"),
        ("design rock -o new --preview rock/rock_wet.png", "--preview: rock/rock_wet.png is an input"),
        ("design empty -o new", "empty: no image has a name that indicates its role"),
    ],
)
def test_nothing_is_lost_and_nothing_half_written(
    words: str, says: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("mine").mkdir()
    Path("mine/rock_albedo.png").write_bytes(b"somebody's")
    Path("uneven").mkdir()
    io.write("uneven/albedo.png", np.zeros((32, 32, 3), np.uint8))
    io.write("uneven/height.png", np.zeros((32, 33), np.uint8))
    Path("same").mkdir()
    io.write("same/albedo.png", np.zeros((32, 32, 3), np.uint8))
    Path("links").mkdir()
    os.symlink("../rock/rock_albedo.png", "links/rock_albedo.png")
    Path("empty").mkdir()
    before = files(here)
    assert main([*words.split(), "-q"]) == 2
    assert says in capsys.readouterr().err
    assert files(here) == before
    assert not Path("new").exists()


def test_whatever_a_folder_does_not_give_is_reported(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Another format, a file without a role and a subfolder: info, the verb and the report give the reason for each."""
    Path("rock/rock_normal.tga_").write_bytes(b"1")
    Path("rock/licence.txt").write_text("CC0")
    Path("rock/.hidden.png").write_bytes(b"1")
    Path("rock/Thumbs.db").write_bytes(b"1")
    for inner, file in (("source", "raw.png"), ("mipmaps", "albedo.1.png"), ("notes", "notes.txt")):
        Path("rock", inner).mkdir()
        Path("rock", inner, file).write_bytes(b"1")
    expected = [
        "rock: rock_normal.tga_ not used: maps are not read from files of this format",
        "rock: source not used: maps are not read from subfolders",
        "rock: rock_wet.png not used: the name gives no role",
    ]
    assert main(["info", "rock"]) == 0
    said = capsys.readouterr()
    assert [line.removeprefix("texrs: ") for line in said.err.splitlines()] == expected
    assert said.out.splitlines() == [
        "material: 64 x 48, 2 maps",
        "albedo: colour, sRGB, 3 channels, uint8",
        "height: height, linear, 1 channel, uint16",
    ]
    assert main(["tile", "rock", "-o", "new", "--stages", "stages"]) == 0
    said = capsys.readouterr()
    assert all(line in said.err for line in expected)
    assert json.loads(Path("stages/report.json").read_text())["ignored"] == expected
    for words in (["info", "rock"], ["tile", "rock", "-o", "strict"]):
        assert main([*words, "--strict"]) == 2
        assert "rock_normal.tga_" in capsys.readouterr().err
    Path("rock/rock_albedo.png").unlink()
    Path("rock/rock_height.png").unlink()
    assert main(["info", "rock"]) == 2
    assert "rock_normal.tga_ not used: maps are not read from files of this format" in capsys.readouterr().err


def test_a_profile_that_a_folder_loses_is_reported(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from PIL import Image, ImageCms

    albedo = io.read("rock/rock_albedo.png")
    lab = ImageCms.ImageCmsProfile(ImageCms.createProfile("LAB")).tobytes()
    srgb = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    for profile, count in ((srgb, 0), (lab, 1), (b"damaged" * 40, 1)):
        Image.fromarray(albedo).save("rock/rock_albedo.png", icc_profile=profile)
        assert main(["info", "rock"]) == 0
        assert capsys.readouterr().err.count("ICC profile") == count


def test_primaries_and_gamma_that_a_folder_loses_are_reported(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wide = (0.32168, 0.33767, 0.713, 0.293, 0.165, 0.83, 0.128, 0.044)
    plain = (0.3127, 0.329, 0.64, 0.33, 0.3, 0.6, 0.15, 0.06)
    png, exr = Path("rock/rock_albedo.png"), Path("rock/rock_diffuse.exr")
    io.write(exr, io.read(png).astype(np.float32))
    for file, notes, words in (
        (png, io.Metadata(primaries=wide), "the primaries 0.713, 0.293, 0.165, 0.83, 0.128, 0.044 are not used"),
        (exr, io.Metadata(primaries=wide), "the primaries 0.713, 0.293, 0.165, 0.83, 0.128, 0.044 are not used"),
        (png, io.Metadata(gamma=1 / 1.8), "the gamma 0.556 is not used"),
        (png, io.Metadata(primaries=plain, gamma=1 / 2.2), ""),
        (exr, io.Metadata(primaries=plain), ""),
    ):
        kept = file.read_bytes()
        io.write(file, io.read(file), notes=replace(notes, multiplied=None))
        assert main(["info", "rock"]) == 0
        said = capsys.readouterr().err
        assert (f"{file}: {words}" in said) if words else (str(file) not in said)
        file.write_bytes(kept)

"""Batches of trees: results have the same tree and formats, and unused files are reported."""

import codecs
import json
from pathlib import Path

import numpy as np
import pytest

from test_batch import files, said, workers_of
from texrs import Material, io, samples
from texrs.cli import main

Capture = pytest.CaptureFixture[str]
IMAGE = samples.dots((48, 48)).image
HOLE = np.pad(np.full((6, 6), 255, np.uint8), 21)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def put(path: str, image: np.ndarray = IMAGE) -> None:
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    io.write(path, image)


def made(folder: str) -> list[str]:
    """Return the results in a folder, without the records next to them."""
    found = set(files(Path(folder)))
    return sorted(name for name in found if name.removesuffix(".json") not in found - {name})


def test_a_tree_comes_out_as_it_went_in(here: Path, capsys: Capture) -> None:
    put("textures/One.JPG")
    put("textures/a/two.png")
    put("textures/a/b/three.jpeg")
    put("textures/a/b/deep.tif", IMAGE.astype(np.uint16))
    put("textures/c/rock_albedo.png")
    put("textures/c/rock_height.png", IMAGE[..., 0])
    Path("textures/.hidden").mkdir()
    Path("textures/.DS_Store").write_bytes(b"x")
    command = ["batch", "tile", "textures", "-o", "out"]
    assert main(command) == 0
    expected = ["One.JPG", "a/b/deep.tif", "a/b/three.jpeg", "a/two.png", "c/albedo.png", "c/height.png"]
    assert [name.replace("c/rock_", "c/") for name in made("out")] == expected
    assert Path("out/One.JPG").read_bytes()[:3] == b"\xff\xd8\xff"
    assert io.read("out/a/b/deep.tif").dtype == np.uint16
    assert capsys.readouterr().err.splitlines()[-1].startswith("texrs: 5 of 5 results are complete, 0 failed, in ")
    before = files(here)
    assert main(command) == 0
    assert capsys.readouterr().err.count("exists already") == 5
    assert files(here) == before
    # Results inside the tree are not inputs.
    assert main(["batch", "tile", ".", "-o", "out", "-q"]) == 0
    assert len([n for n in made("out") if n.startswith("textures")]) == 6
    assert main(["batch", "tile", ".", "-o", "out", "-q"]) == 0
    assert not Path("out/out").exists()


def test_links_are_followed_once(here: Path) -> None:
    put("far/one.png")
    Path("textures").mkdir()
    Path("textures/link").symlink_to("../far")
    Path("far/back").symlink_to("../textures")
    assert main(["batch", "tile", "textures", "-o", "out", "-q"]) == 0
    assert made("out") == ["link/one.png"]


def test_a_pattern_keeps_the_folders_below_its_first_wildcard(here: Path) -> None:
    for name in ("in/a/one.png", "in/b/one.png", "in/b/old/two.png"):
        put(name)
    assert main(["batch", "tile", "in/*/one.png", "-o", "out", "-q"]) == 0
    assert made("out") == ["a/one.png", "b/one.png"]
    assert main(["batch", "tile", "in/b*", "-o", "more", "-q"]) == 0
    assert made("more") == ["b/old/two.png", "b/one.png"]


def test_maps_of_one_material_in_a_folder_of_several_are_one_job(here: Path, capsys: Capture) -> None:
    for name in ("T_Rock", "T_Moss", "T_Rock_Wet"):
        put(f"in/{name}_BaseColor.png")
        put(f"in/{name}_Roughness.png", IMAGE[..., 0])
    put("in/T_Rock_preview.png")
    put("in/photo.jpg")
    put("in/bark_normal.png")
    for number, inputs in enumerate((["in"], ["in/*"], sorted(map(str, Path("in").iterdir())))):
        assert main(["batch", "tile", *inputs, "-o", f"out{number}"]) == 0
        err = capsys.readouterr().err
        assert "5 of 5 results are complete, 0 failed, 1 ignored parts of their inputs" in err
        assert err.count("T_Rock_preview.png") == 1
        assert "bark_normal.png (assumed: in/bark_normal.png: read as colours" in err
        folders = {Path(name).parts[0] for name in made(f"out{number}")}
        assert folders == {"T_Rock", "T_Moss", "T_Rock_Wet", "photo.jpg", "bark_normal.png"}
        assert len(made(f"out{number}")) == 8
    # Each result equals the result of the command for the same files, also if it is repeated from its record.
    one = "in/T_Moss_{BaseColor,Roughness}.png"
    assert main(["tile", one, "-o", "alone", "-q"]) == 0
    for name in made("alone"):
        assert (io.read(f"alone/{name}") == io.read(f"out0/T_Moss/{name}")).all()
    name = made("alone")[0]
    assert said(f"alone/{name}")["arguments"] == [f"../{one}"]
    assert len(said(f"alone/{name}")["inputs"]) == 2
    assert main(["rerun", "alone", "-q"]) == 0
    assert capsys.readouterr().out.count("the same bytes") == 2


def test_some_files_of_a_folder_are_a_material(here: Path) -> None:
    put("in/a_albedo.png")
    put("in/a_height.png", IMAGE[..., 0])
    put("in/b_height.png", IMAGE[:40, :40, 0])
    read = Material.read(["in/a_albedo.png", "in/a_height.png"])
    assert list(read) == ["albedo", "height"]
    assert main(["tile", "in/a_{albedo,none}.png", "-o", "out", "-q"]) == 2


@pytest.mark.parametrize("how", [None, "--workers"])
def test_each_job_shows_its_notices(here: Path, capsys: Capture, how: str | None) -> None:
    for name in ("rock", "moss"):
        put(f"in/{name}/albedo.png")
        put(f"in/{name}/height.png", IMAGE[..., 0])
    put("in/moss/preview.png")
    command = ["batch", "tile", "in", "-o", "out", *([how, "2"] if how else [])]
    assert main([*command, "--strict"]) == 3
    err = capsys.readouterr().err
    assert "preview.png" in err
    assert "this is an error because of --strict" in err
    assert {Path(n).parts[0] for n in made("out")} == {"rock"}
    assert main(command) == 0
    lines = capsys.readouterr().err.splitlines()
    [line] = [line for line in lines if "wrote out/moss" in line]
    assert "(ignored: in/moss: preview.png" in line
    assert "0 failed, 1 ignored parts of their inputs" in lines[-1]


def test_files_that_are_not_read_are_counted(here: Path, capsys: Capture) -> None:
    put("in/a.png")
    put("in/sub/b.png")
    for name in ("notes.txt", "sub/Thumbs.db", "list.sbs", "sub/0.psb", *(f"sub/{k}.blend" for k in range(9))):
        Path("in", name).write_bytes(b"x")
    assert main(["batch", "tile", "in", "-o", "out"]) == 0
    err = capsys.readouterr().err
    assert "in: 11 files not used, because texrs does not read this suffix: in/list.sbs, " in err
    assert " and 3 more" in err
    assert main(["batch", "tile", "in", "-o", "strict", "--strict"]) == 2
    assert not Path("strict").exists()


def test_masks_by_name_and_one_for_all(here: Path, capsys: Capture) -> None:
    put("photos/one.jpg")
    put("photos/a/two.png")
    put("masks/one_mask.png", HOLE)
    command = ["batch", "inpaint", "photos", "-o", "out", "--argument", "masks/{folder}/{name}_mask.png"]
    assert main(command) == 2
    assert "files are missing for 1 of 2 inputs: photos/a/two.png needs masks/a/two_mask.png" in capsys.readouterr().err
    assert not Path("out").exists()
    put("masks/a/two_mask.png", HOLE)
    assert main([*command, "-q"]) == 0
    assert made("out") == ["a/two.png", "one.jpg"]
    assert said("out/a/two.png")["arguments"] == ["../../photos/a/two.png", "../../masks/a/two_mask.png"]
    # A single mask applies to all images, however it is given, and even if it is among the inputs.
    put("photos/hole.png", HOLE)
    for number, words in enumerate(
        (
            ["--argument", "photos/hole.png"],
            ["--set", "mask=photos/hole.png"],
            ["--argument={input}", "--argument=photos/hole.png"],
        )
    ):
        assert main(["batch", "inpaint", "photos", "-o", f"one{number}", *words, "-q"]) == 0
        assert made(f"one{number}") == ["a/two.png", "one.jpg"]
    assert main(["batch", "remove", "photos", "-o", "none"]) == 2
    assert "--argument: must specify the argument MASK of texrs remove for each input" in capsys.readouterr().err


def test_masks_next_to_the_images_are_not_inputs(here: Path) -> None:
    put("photos/one.png")
    put("photos/one_mask.png", HOLE)
    put("photos/a/two.png")
    put("photos/a/two_mask.png", HOLE)
    words = ["--argument", "photos/{folder}/{name}_mask.png"]
    assert main(["batch", "inpaint", "photos", "-o", "out", *words, "-q"]) == 0
    assert made("out") == ["a/two.png", "one.png"]


def test_names_of_folders_at_any_level(here: Path) -> None:
    put("shop/wood/oak/map.png")
    put("shop/wood/elm/map.png")
    assert main(["batch", "tile", "shop", "-o", "flat/{parent2}-{parent}-{name}{suffix}", "-q"]) == 0
    assert made("flat") == ["wood-elm-map.png", "wood-oak-map.png"]
    assert main(["batch", "tile", "shop/wood/oak", "-o", "up/{parent3}.png", "-q"]) == 0
    assert made("up") == ["shop.png"]


@pytest.mark.parametrize("encode", ["utf-8-sig", "utf-16"])
def test_recipes_of_windows_are_read(here: Path, encode: str) -> None:
    put("stönes/a.png")
    text = 'verb = "tile"\r\ninputs = "stönes"\r\nout = "out"\r\n\r\n[options]\r\nwrap = "x"\r\n'
    Path("all.toml").write_bytes(text.encode(encode))
    assert Path("all.toml").read_bytes()[:2] in (codecs.BOM_UTF8[:2], codecs.BOM_UTF16)
    assert main(["batch", "all.toml", "-q"]) == 0
    assert said("out/a.png")["options"] == {"--wrap": "x"}


def test_results_of_other_kinds_have_their_own_formats(here: Path) -> None:
    put("in/a.jpg")
    assert main(["batch", "scale-map", "in", "-o", "scales", "--set", "slant=20", "-q"]) == 0
    assert main(["batch", "analyse", "in", "-o", "found", "-q"]) == 0
    assert made("scales") + made("found") == ["a.png", "a.npz"]


def test_files_that_a_batch_writes_are_not_inputs(here: Path) -> None:
    put("in/a.png")
    words = ["--set", "source-map=in/{name}.npz", "--set", "size=48", "--set", "copies=1", "--sheet", "sheet.png", "-q"]
    for _ in range(2):
        assert main(["batch", "design", "in", "-o", "in/{name}-big.png", *words]) == 0
        assert made("in") == ["a-big.png", "a.npz", "a.png"]
    assert json.loads(io.read_metadata("in/a.npz").made or "")["verb"] == "design"


def test_a_cluster_returns_notices(here: Path, capsys: Capture) -> None:
    put("in/rock/albedo.png")
    put("in/rock/height.png", IMAGE[..., 0])
    put("in/rock/preview.png")
    with workers_of("--scheduler") as words:
        assert main(["batch", "tile", "in", "-o", "out", *words]) == 0
    assert "(ignored: in/rock: preview.png" in capsys.readouterr().err

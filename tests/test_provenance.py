"""Outputs of commands are never lost: only own files are replaced, and each file has a record of its creation."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageCms

import texrs
from texrs import SourceMap, io, samples
from texrs.cli import main
from texrs.io.annotation import write_record
from texrs.io.formats import FORMATS

Capture = pytest.CaptureFixture[str]
PROFILE = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
SMALL = ("--size", "48", "--copies", "1", "-q")


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in a folder with inputs for every command."""
    monkeypatch.chdir(tmp_path)
    sample = samples.load("dots", size=(64, 64))
    io.write("in.png", sample.image)
    io.write("mask.png", sample.mask)
    io.write("hole.png", np.pad(np.full((8, 8), 255, np.uint8), 28))
    io.write_volume("in.tif", samples.load("stripes", size=(32, 32, 32)).image)
    SourceMap.identity((64, 64)).save("map.npz")
    Path("in.obj").write_text("v 0 0 0\nv 8 0 0\nv 0 8 0\nv 0 0 8\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    texrs.TextureDatabase("db").add("in.png", "dots", mask=sample.mask, layout="disjoint")
    return tmp_path


def files(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def said(path: str | Path) -> dict[str, Any]:
    made = io.read_metadata(path).made
    assert made is not None, path
    found: dict[str, Any] = json.loads(made)
    return found


WRITERS = {
    "analyse": "analyse in.png --mask mask.png --layout disjoint -o {}.npz",
    "apply": "apply map.npz in.png -o {}.png",
    "compare": "compare in.png --task tile --crop 48 --larger 48 --no-seconds -o {}.html",
    "inpaint": "inpaint in.png hole.png -o {}.png",
    "database matrix": "database db matrix -o {}.png",
    "database splice": "database db splice dots dots -o {}.png",
    "design": "design in.png --size 48 --copies 1 -o {}.png",
    "check": "check in.png -o {}.png",
    "extend": "extend in.png --left 8 --slant 0 -o {}.png",
    "paint": "paint in.obj in.tif --vertices --voxels 2 -o {}.glb",
    "perspective": "perspective in.png --size 64 -o {}.png",
    "rectify": "rectify in.png --slant 20 --tilt 90 --fov 50 -o {}.png",
    "remove": "remove in.png hole.png --slant 0 -o {}.png",
    "scale-map": "scale-map in.png --slant 30 -o {}.tif",
    "self-splice": "self-splice in.png -o {}.png",
    "slice": "slice in.tif --at plane=3 -o {}.png",
    "solid": "solid in.tif --size 16 -o {}.tif",
    "splice": "splice in.png in.png -o {}.png",
    "synthesize": "synthesize in.png --size 48 -o {}.png",
    "tile": "tile in.png -o {}.png",
    "tiles": "tiles in.png --tile-size 48 --pictures 1 --way still --size 40 -o {}.png",
}
"""A command of each kind that writes one file."""


def test_every_command_that_writes_a_file_is_tried() -> None:
    from texrs.cli import COMMANDS

    assert {name.split()[0] for name in WRITERS} == set(COMMANDS) - {"batch", "demo", "info", "rerun", "samples"}


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("link", ["", "symbolic", "hard"])
def test_no_command_replaces_what_it_did_not_make(here: Path, capsys: Capture, name: str, link: str) -> None:
    command = WRITERS[name].format("there").split()
    target = command[-1]
    Path("dear").write_bytes(b"dear")
    if link == "symbolic":
        Path(target).symlink_to("dear")
    elif link == "hard":
        os.link("dear", target)
    else:
        Path(target).write_bytes(b"dear")
    before = files(here)
    assert main([*command, "-q"]) == 2
    assert f"{target} exists" in (err := capsys.readouterr().err)
    assert "--force" in err
    assert files(here) == before


@pytest.mark.parametrize(
    "name", [n for n in WRITERS if n not in ("perspective", "extend", "remove", "solid", "splice")]
)
def test_commands_replace_what_they_made(here: Path, capsys: Capture, name: str) -> None:
    command = [*WRITERS[name].format("made").split(), "-q"]
    assert main(command) == 0, capsys.readouterr().err
    target = command[-2]
    first = Path(target).read_bytes()
    assert said(target)["verb"] == name.split()[0]
    assert main([*command, "--threads", "1"]) == 0
    assert Path(target).read_bytes() == first
    # A file that was changed afterwards belongs to the user.
    if target.endswith(".png"):
        picture = io.read(target)
        io.write(target, picture[::-1].copy())
        write_record(Path(target), json.dumps(said_before(first, here)))
        changed = files(here)
        assert main(command) == 2
        assert "was changed since" in capsys.readouterr().err
        assert files(here) == changed
        assert main([*command, "--force"]) == 0
        assert Path(target).read_bytes() == first


def said_before(content: bytes, folder: Path) -> dict[str, Any]:
    (folder / "former.png").write_bytes(content)
    found = said(folder / "former.png")
    (folder / "former.png").unlink()
    return found


def test_another_verb_or_another_example_asks(here: Path, capsys: Capture) -> None:
    io.write("other.png", samples.load("weave", size=(64, 64)).image)
    assert main(["tile", "in.png", "-o", "out.png", "-q"]) == 0
    assert main(["tile", "in.png", "-o", "out.png", "--wrap", "x", "-q"]) == 0
    assert main(["tile", "./in.png", "-o", str(here / "out.png"), "-q"]) == 0
    capsys.readouterr()
    before = files(here)
    assert main(["tile", "other.png", "-o", "out.png"]) == 2
    assert "was made with other arguments: in.png" in capsys.readouterr().err
    assert main(["design", "in.png", *SMALL, "-o", "out.png"]) == 2
    assert "was made by texrs tile" in capsys.readouterr().err
    assert files(here) == before
    assert main(["design", "in.png", *SMALL, "-o", "out.png", "--force"]) == 0
    assert said("out.png")["verb"] == "design"


def test_maps_stages_and_pages_are_not_replaced(here: Path, capsys: Capture) -> None:
    Path("st").mkdir()
    Path("st/report.json").write_text("{}")
    Path("page.html").write_text("dear")
    Path("big.npy.json").write_text("[]")
    before = files(here)
    for more in (["--source-map", "map.npz"], ["--stages", "st"]):
        assert main(["tile", "in.png", "-o", "new.png", *more]) == 2
        assert "exists" in capsys.readouterr().err
    assert main([*WRITERS["analyse"].format("e").split(), "--page", "page.html"]) == 2
    assert main([*WRITERS["analyse"].format("e").split(), "--stages", "st"]) == 2
    assert main(["tile", "in.png", "-o", "big.npy"]) == 2
    assert "big.npy.json exists" in capsys.readouterr().err
    assert main(["samples", "weave", "-o", "."]) == 0
    assert main(["samples", "weave", "-o", ".", "--seed", "3"]) == 0
    Path("dots.png").write_text("dear")
    assert main(["samples", "-o", ".", "--size", "40"]) == 2
    Path("weave.png").unlink()
    Path("dots.png").unlink()
    assert files(here) == before
    Path("each").mkdir()
    Path("each/dots-on-dots.png").write_text("dear")
    assert main(["database", "db", "matrix", "-o", "all.png", "--each", "each"]) == 2
    assert Path("each/dots-on-dots.png").read_text() == "dear"
    assert not Path("all.png").exists()
    assert main(["design", "in.png", *SMALL, "--variants", "2", "-o", "v.png"]) == 0
    Path("v-1.png").write_text("dear")
    assert main(["design", "in.png", *SMALL, "--variants", "2", "-o", "v.png"]) == 2
    assert Path("v-1.png").read_text() == "dear"


def test_colours_and_density_go_through(here: Path) -> None:
    deep = (io.read("in.png").astype(np.uint16)) * 257
    known = io.Metadata(profile=PROFILE, density=(3000.0, 2000.0))
    for name, pixels in (("p.png", deep), ("p.tif", deep), ("p.jpg", io.read("in.png"))):
        io.write(name, pixels, notes=known)
        for out in ("o.png", "o.tif", *(["o.jpg"] if pixels.dtype == np.uint8 else [])):
            assert main(["tile", name, "-o", out, "-q", "--force"]) == 0
            found = io.read_metadata(out)
            assert found.profile == PROFILE, (name, out)
            assert found.density == pytest.approx((3000, 2000), rel=0.01)
            assert io.read(out).dtype == pixels.dtype
    assert main(["apply", "map.npz", "p.png", "-o", "applied.png", "-q"]) == 0
    assert io.read_metadata("applied.png").profile == PROFILE
    io.write("in.png", io.read("in.png"), notes=io.Metadata(gamma=1.0))
    assert main(["tile", "in.png", "-o", "linear.png", "-q"]) == 0
    assert io.read_metadata("linear.png").gamma == 1.0
    # A rotated photograph is turned upright, and its orientation is removed.
    picture = Image.fromarray(io.read("in.png")[:, :48])
    exif = picture.getexif()
    exif[274] = 6
    picture.save("turned.jpg", exif=exif, dpi=(100, 200))
    assert main(["tile", "turned.jpg", "-o", "upright.png", "-q", "--size", "60x40"]) == 0
    with Image.open("upright.png") as made:
        assert made.getexif().get(274, 1) == 1
        assert [round(d) for d in made.info["dpi"]] == [200, 100]


# --- stopped ---------------------------------------------------------------------------------------------------------

posix = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")


def begin(*arguments: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "texrs", *arguments]

    def heed() -> None:
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    return subprocess.Popen(command, stderr=subprocess.PIPE, preexec_fn=heed)


@posix
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_variants_that_are_done_stay(here: Path, number: int) -> None:
    before = files(here)
    with begin("design", "in.png", "--size", "48", "--copies", "1", "--variants", "4000", "-o", "v.png") as process:
        for _ in range(600):
            if Path("v-1.png").exists():
                break
            time.sleep(0.1)
        process.send_signal(number)
        assert process.stderr is not None
        rest = process.stderr.read().decode()
    assert process.returncode == (130 if number == signal.SIGINT else -9)
    if number == signal.SIGINT:
        lines = rest.splitlines()
        assert lines[-2] == "texrs: stopped; no incomplete files are left"
        assert lines[-1].startswith("texrs: files that were finished before are kept: v-0.png, v-1.png")
        assert not list(here.glob(".texrs*"))
    after = {n: c for n, c in files(here).items() if not Path(n).name.startswith(".texrs")}
    assert {n: after[n] for n in before} == before
    made = sorted(set(after) - set(before))
    assert "v-0.png" in made
    assert "v.png" not in made
    for name in made:
        assert io.read(name).shape == (48, 48, 3)
        assert "--variants" not in said(name)["options"]
        assert said(name).get("seed") == int(name[2:-4])


# --- made again ------------------------------------------------------------------------------------------------------

AGAIN = {
    "apply": "apply map.npz in.png -o r.png --interpolation linear",
    "analyse": "analyse in.png --mask mask.png --layout disjoint -o r.npz --stages st --page r.html",
    "inpaint": "inpaint in.png hole.png -o r.jpg --source-map r.npz",
    "database": "database db matrix -o r.png --each each --cell 32",
    "design": "design in.png --size 64x48 --copies 1 --seed 3 --element-labels mask.png "
    "-o r.exr --source-map r.npz --stages st",
    "sample": "tile sample:weave -o r.webp --wrap x",
    "scale-map": "scale-map in.png --slant 40 --tilt 80 -o r.png --stages st",
    "scale-map npy": "scale-map in.png --slant 30 -o r.npy",
    "slice": "slice in.tif --cube -o r.png",
    "turntable": "slice in.tif --turntable --frames 3 --size 32 -o r.gif",
    "solid": "solid in.tif --size 16 -o r.vti --source-map r.npz",
    "tile": "tile in.png -o r.bmp --stages st",
    "variants": "design in.png --size 48 --copies 1 --variants 2 --seed 7 -o r.png --source-map r.npz --stages st",
    "samples": "samples weave dots -o st --size 48",
    "add": "database db add in.png --name again --mask mask.png --layout disjoint",
}
"""Commands that write every kind of file."""


@pytest.mark.parametrize("name", AGAIN)
def test_every_output_is_made_again(here: Path, capsys: Capture, name: str) -> None:
    if name == "design":
        io.write("in.png.tif", io.read("in.png").astype(np.float32))
    command = AGAIN[name].replace("in.png", "in.png.tif") if name == "design" else AGAIN[name]
    before = set(files(here))
    assert main([*command.split(), "-q"]) == 0, capsys.readouterr().err
    made = {n for n in set(files(here)) - before if not n.startswith("db/manifest")}
    sidecars = {n for n in made if n.endswith(".json") and n.removesuffix(".json") in made}
    assert made - sidecars
    whole = files(here)
    for output in sorted(made - sidecars):
        capsys.readouterr()
        assert main(["rerun", output, "-q"]) == 0, (output, capsys.readouterr().err)
        assert capsys.readouterr().out.startswith(f"{output}: the same bytes, SHA-256 "), output
        assert main(["info", output]) == 0, (output, capsys.readouterr().err)
        assert f"made by texrs {texrs.__version__}: texrs {command.split()[0]}" in capsys.readouterr().out
    assert files(here) == whole


@pytest.mark.parametrize("suffix", FORMATS)
def test_every_format_says_what_it_holds_and_is_made_again(here: Path, capsys: Capture, suffix: str) -> None:
    allowed = FORMATS[suffix]
    made = []
    if suffix == ".jxl":
        pytest.importorskip("pillow_jxl")
    if allowed.images:
        dtype = np.float32 if np.dtype(np.float32) in allowed.dtypes else np.uint8
        image = io.read("in.png")
        # Reduce the colours for GIF, which stores at most 256.
        image = image // 64 * 64 if suffix == ".gif" else image
        io.write("in.npy", image if dtype == np.uint8 else image.astype(dtype) / 255)
        made.append(("image", f"tile in.npy -o image{suffix} --wrap x", "3 channels"))
    if allowed.volumes:
        made.append(("volume", f"solid in.tif -o volume{suffix} --size 16x17x18", "16 x 17 x 18, 3 channels"))
    assert made
    for kind, command, sides in made:
        assert main([*command.split(), "-q"]) == 0, capsys.readouterr().err
        capsys.readouterr()
        output = f"{kind}{suffix}"
        assert main(["rerun", output, "-q"]) == 0, capsys.readouterr().err
        assert capsys.readouterr().out.startswith(f"{output}: the same bytes, SHA-256 ")
        assert main(["info", output]) == 0
        words = capsys.readouterr().out
        assert words.startswith(f"{kind}: "), words
        assert sides in words or kind == "volume"
        assert f"made by texrs {texrs.__version__}: texrs {command.split()[0]}" in words


def test_made_again_elsewhere_and_from_a_folder_that_moved(here: Path, capsys: Capture) -> None:
    Path("a/out").mkdir(parents=True)
    os.rename("in.png", "a/in.png")
    assert main(["tile", "a/in.png", "-o", "a/out/r.npy", "-q", "--wrap", "y"]) == 0
    whole = Path("a/out/r.npy").read_bytes(), Path("a/out/r.npy.json").read_bytes()
    os.rename("a", "b")
    assert main(["rerun", "b/out/r.npy", "-o", "new.npy", "-q"]) == 0
    assert (Path("new.npy").read_bytes(), Path("new.npy.json").read_bytes()) == whole
    assert main(["rerun", "b/out/r.npy", "-o", "new.npy", "-q"]) == 0
    Path("dear.npy").write_bytes(b"dear")
    capsys.readouterr()
    assert main(["rerun", "b/out/r.npy", "-o", "dear.npy", "-q"]) == 2
    assert "--force" in capsys.readouterr().err
    assert main(["rerun", "b/out/r.npy", "-o", "b/out/r.npy", "-q"]) == 2
    assert "is an input" in capsys.readouterr().err
    assert main(["rerun", "b/out/r.npy", "-o", "b/in.png", "-q"]) == 2
    assert Path("dear.npy").read_bytes() == b"dear"


def test_what_changed_is_named(here: Path, capsys: Capture) -> None:
    assert main(["inpaint", "in.png", "hole.png", "-o", "r.png", "-q"]) == 0
    whole = Path("r.png").read_bytes()
    io.write("r.png", io.read("r.png"))
    assert main(["rerun", "r.png"]) == 2
    assert "has no record of the command that made it" in capsys.readouterr().err
    Path("r.png").write_bytes(whole)
    picture = io.read("in.png")
    io.write("in.png", picture[::-1].copy())
    os.rename("hole.png", "kept.png")
    assert main(["rerun", "r.png"]) == 2
    err = capsys.readouterr().err
    assert "in.png has changed since (SHA-256 " in err
    assert "hole.png is missing (SHA-256 " in err
    io.write("in.png", picture)
    os.rename("kept.png", "hole.png")
    # This result was painted over, and still has its record.
    io.write("r.png", picture)
    write_record(Path("r.png"), json.dumps(said_before(whole, here)))
    assert main(["info", "r.png"]) == 0
    assert "changed since it was made" in capsys.readouterr().out
    assert main(["rerun", "r.png", "-o", "former.png", "-q"]) == 0
    assert "r.png: was changed since it was made" in capsys.readouterr().out
    assert Path("former.png").read_bytes() == whole
    assert main(["rerun", "no.png"]) == 2
    assert "no.png: does not exist" in capsys.readouterr().err


def test_info_knows_volumes_and_surfaces(here: Path, capsys: Capture) -> None:
    volume = io.read_volume("in.tif")
    for name in ("v.vti", "v.nrrd", "v.nii.gz", "v.npy"):
        io.write_volume(name, volume)
        assert (io.read_volume(name) == volume).all()
        assert main(["info", name]) == 0
        assert capsys.readouterr().out.startswith("volume: 32 x 32 x 32, 3 channels, uint8, ")
    io.write_surface("s.stl", np.eye(3), np.array([[0, 1, 2]]))
    assert main(["info", "s.stl"]) == 0
    assert capsys.readouterr().out == "surface: 1 triangles\n"
    assert main(["info", "db/dots.npz"]) == 0
    assert capsys.readouterr().out.startswith("elements: ")
    assert main(["info", "in.tif.no"]) == 2
    assert "does not exist" in capsys.readouterr().err

"""``texrs slice``, end to end."""

from __future__ import annotations

from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest
from PIL import Image

from texrs import fields, io, samples, volume
from texrs.cli import main
from texrs.cli._readers import read_field
from texrs.cli._texts import About
from texrs.errors import TexrsError

VOLUME = samples.stripes((32, 36, 40)).image


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    io.write_volume("v.npy", VOLUME)
    Path("out.png").touch()
    return tmp_path


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ("", lambda: volume.slices(VOLUME)),
        ("--at=-5,4,3", lambda: volume.slices(VOLUME, (3, 4, -5))),
        ("--at plane=30", lambda: VOLUME[30]),
        ("--at z=30", lambda: VOLUME[30]),
        ("--at y=-1", lambda: VOLUME[:, -1]),
        ("--at x=7", lambda: VOLUME[:, :, 7]),
        ("--at row=-1", lambda: VOLUME[:, -1]),
        ("--at column=7", lambda: VOLUME[:, :, 7]),
        ("--oblique /0,1,1", lambda: volume.oblique_slice(VOLUME, None, (1, 1, 0))),
        (
            "--oblique 7,8.5,9/0.2,-1,1 --interpolation nearest",
            lambda: volume.oblique_slice(VOLUME, (9, 8.5, 7), (1, -1, 0.2), interpolation="nearest"),
        ),
        ("--cube --size 64 --threads 1", lambda: volume.render_block(VOLUME, 64)),
    ],
)
def test_slice_writes_what_the_functions_make(here, capsys, arguments, expected):
    assert main(["slice", "v.npy", "-o", "out.png", *arguments.split()]) == 0
    np.testing.assert_array_equal(iio.imread("out.png"), expected())
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("texrs: wrote out.png: ")
    assert sorted(p.name for p in here.iterdir()) == ["out.png", "v.npy"]


def test_turntables_and_samples(here, capsys):
    assert (
        main(["slice", "sample:particles", "-o", "t.gif", "--turntable", "--size", "48", "--frames", "3", "--quiet"])
        == 0
    )
    with Image.open("t.gif") as gif:
        assert (gif.n_frames, gif.size) == (3, (48, 48))
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ("v.npy -o out.png --at depth=3", "--at: must be a slice such as"),
        ("v.npy -o out.png --at plane=3.5", "--at: must be a slice such as"),
        ("v.npy -o out.png --at 3,4", "--at: must be a slice such as"),
        ("v.npy -o out.png --at plane=99", "--at: must be an integer between -32 and 31, got 99"),
        ("v.npy -o out.png --at 99,4,3", "--at: must be an integer between -40 and 39"),
        ("v.npy -o out.png --oblique 1,1,0", "--oblique: must be X,Y,Z/X,Y,Z"),
        ("v.npy -o out.png --oblique /1,1", "--oblique: must be X,Y,Z/X,Y,Z"),
        ("v.npy -o out.png --oblique /0,0,0", "--oblique: must be three finite numbers"),
        ("v.npy -o out.png --oblique 900,2,1/1,0,0", "must specify a slice that crosses"),
        ("v.npy -o out.png --cube --at plane=3", "--at and --cube: cannot be combined"),
        ("v.npy -o out.png --cube --size 9", "--size: must be an integer between 16"),
        ("v.npy -o out.png --cube --interpolation best", "--interpolation: must be one of nearest"),
        (
            "v.npy -o out.png --interpolation cubic",
            "--interpolation: must be used with --oblique or --cube or --turntable, got --at",
        ),
        ("v.npy -o out.png --cube --seconds 9", "--seconds: must be used with --turntable, got --cube"),
        ("v.npy -o out.png --turntable", "--out: must end in .gif with --turntable"),
        ("v.npy -o out.gif --cube", "--out: must not end in .gif without --turntable"),
        ("v.npy -o out.jpg --cube", "out.jpg: .jpg cannot store uint8 with 4 channels"),
        ("v.npy -o out.tiff --cube --threads 0", "--threads"),
        ("v.npy -o none/out.png", "does not exist"),
        ("w.npy -o out.png", "does not exist"),
        ("out.png -o out.png", "out.png"),
        (
            "sample:bricks -o out.png",
            "sample:bricks: must be a volume, got an image; built-in volumes are particles, stripes, weave_solid",
        ),
        ("v.npy", "Missing option"),
    ],
)
def test_wrong_requests_get_a_line_and_change_nothing(here, capsys, arguments, says):
    before = {p.name: p.read_bytes() for p in here.iterdir()}
    assert main(["slice", *arguments.split()]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert says in said.err
    assert said.err.count("\n") == 1
    assert {p.name: p.read_bytes() for p in here.iterdir()} == before


@pytest.mark.parametrize("dtype", ["bool", "uint8", "int8", "uint16", "int32"])
def test_labels_are_painted(here, capsys, dtype):
    marked = samples.particles((32, 32, 32)).labels % 100
    io.write_volume("labels.npy", marked.astype(dtype))
    assert main(["slice", "labels.npy", "-o", "a.png", "--labels", "--at", "row=9"]) == 0
    expected = volume.label_to_color((marked != 0 if dtype == "bool" else marked).astype(np.int64))
    np.testing.assert_array_equal(iio.imread("a.png"), expected[:, 9])
    assert main(["slice", "v.npy", "-o", "b.png", "--labels"]) == 2
    assert "v.npy: must be integers of shape" in capsys.readouterr().err


def test_fields_in_words_and_in_files(here):
    size = (40, 48, 56)
    assert read_field("circular:axis=y", About(size=size)) == fields.circular("y").over(size)
    frames = np.stack([fields.rotation_3d(a, a).constant for a in range(8)]).reshape(2, 2, 2, 3, 3)
    np.savez("frames.npz", frames)
    assert read_field("frames.npz", About(size=size)) == fields.from_array(frames, size)
    np.savez("two.npz", frames, frames)
    np.savez("flat.npz", frames * 0)
    for text, extent, says in (
        ("round", size, "--field: must be one of identity"),
        ("rotation_3d", size[:2], "--field: rotation_3d is only available for volumes"),
        ("two.npz", size, "two.npz: must contain a single array, or one with the key"),
        ("flat.npz", size, "flat.npz: the frame at"),
        ("frames.npz", size[:2], "frames.npz: must have 2 axes, got shape (2, 2, 2, 3, 3), a field with 3 axes"),
        ("none.npz", size, "none.npz: does not exist"),
    ):
        with pytest.raises(TexrsError) as caught:
            read_field(text, About(size=extent))
        assert says in str(caught.value)


def test_volumes_of_other_dtypes(here, capsys):
    io.write_volume("f.npy", VOLUME[..., 0] / np.float32(255))
    assert main(["slice", "f.npy", "-o", "a.png"]) == 2
    assert "a.png: .png cannot store float32 with 1 channel" in capsys.readouterr().err
    assert main(["slice", "f.npy", "-o", "a.exr", "--at", "row=3"]) == 0
    assert main(["slice", "f.npy", "-o", "a.png", "--cube", "--size", "32"]) == 0
    io.write_volume("n.npy", np.full((4, 4, 4), np.nan))
    assert main(["slice", "n.npy", "-o", "b.png"]) == 2
    assert "n.npy: must be finite, but 64 of 64 values are NaN" in capsys.readouterr().err

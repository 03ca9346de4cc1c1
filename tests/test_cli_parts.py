"""Commands whose results are larger than memory: in chunks, by any workers."""

import errno
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import texrs
from texrs import io, samples, stores
from texrs.cli import main
from texrs.errors import InvalidInput, LimitExceeded

pytest.importorskip("dask")
pytest.importorskip("zarr")

STRIPES = samples.stripes((32, 32, 32)).image[:24, :24, :24]
WEAVE = samples.weave((48, 64)).image


@pytest.fixture
def files(tmp_path: Path) -> Path:
    io.write_volume(tmp_path / "stripes.tif", STRIPES)
    io.write(tmp_path / "weave.png", WEAVE)
    return tmp_path


@pytest.mark.parametrize("workers", [None, 2])
def test_a_solid_into_zarr(files: Path, workers: int | None, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["solid", f"{files}/stripes.tif", "-o", f"{files}/out.zarr", "--size", "30x20x24", "--chunks", "16"]
    words += ["--origin", "-5,7,1", "--seed", "3", *(["--workers", str(workers)] if workers else [])]
    assert main(words) == 0
    said = capsys.readouterr().err
    assert "each worker needs up to" in said
    assert "9 chunks, of which 0 existed already" in said
    wanted = texrs.SolidTexture(STRIPES, seed=3)[1:25, 7:27, -5:25]
    assert np.array_equal(stores.open_store(files / "out.zarr").compute(), wanted)
    assert main(words) == 0
    found = capsys.readouterr().err
    assert "9 chunks, of which 9 existed already" in found
    assert main([*words[:-2], "--seed", "4"]) == 2
    assert "contains other data" in capsys.readouterr().err
    if not workers:
        assert main([*words, "--seed", "4", "--force"]) == 0


@pytest.mark.parametrize("name", ["out.npy", "out.tif", "out.raw", "out.vti"])
def test_files_of_any_format(files: Path, name: str) -> None:
    words = ["solid", f"{files}/stripes.tif", "-o", f"{files}/{name}", "--size", "20x18x17", "--chunks", "16", "-q"]
    assert main([*words, "--origin", "2,3,4"]) == 0
    wanted = texrs.SolidTexture(STRIPES)[4:21, 3:21, 2:22]
    assert np.array_equal(io.read_volume(files / name.replace(".raw", ".nhdr")), wanted)
    assert not [each for each in files.iterdir() if "texrs-part" in each.name]
    if name == "out.raw":
        assert (files / name).read_bytes() == wanted.tobytes()


@pytest.mark.parametrize("name", ["out.npy", "out.raw"])
def test_files_by_workers_and_after_a_stop(
    files: Path, name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each chunk is computed once, by any worker. Two processes continue an interrupted run."""
    words = ["solid", f"{files}/stripes.tif", "-o", f"{files}/{name}", "--size", "24", "--chunks", "24x24x8"]
    texture, made = texrs.SolidTexture(STRIPES), []
    read = type(texture).__getitem__

    def stop(self: texrs.SolidTexture, index: tuple[slice, ...]) -> np.ndarray:
        if len(made) == 2:
            raise KeyboardInterrupt
        made.append(index)
        return read(self, index)

    with monkeypatch.context() as patch:
        patch.setattr(texrs.SolidTexture, "__getitem__", stop)
        assert main([*words, "--chunks", "24x24x8"]) == 130
    assert not (files / name).exists()
    part = files / f".{name}.texrs-part"
    journal = files / f"{part.name}.json"
    assert journal.read_text().splitlines()[1:] == ["0", "1"]
    with journal.open("a") as file:
        file.write("2")  # The entry of chunk 2 is cut off, so the chunk is computed again.
    capsys.readouterr()
    assert main([*words, "--workers", "2"]) == 0
    assert "3 chunks, of which 2 existed already" in capsys.readouterr().err
    whole = np.fromfile(files / name, np.uint8)[-(24**3) * 3 :].reshape(24, 24, 24, 3)
    assert np.array_equal(whole, texture[0:24, 0:24, 0:24])


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_workers_of_a_run_that_ends_end_too_and_the_store_is_gone_on_with(files: Path, number: int) -> None:
    """Ctrl-C reaches all processes of a terminal. A killed run ends its workers."""
    words = ["synthesize", f"{files}/weave.png", "--size", "130", "--chunks", "16", "--seed", "3", "-o"]

    def heed() -> None:
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    command = [sys.executable, "-m", "texrs", *words, f"{files}/a.zarr", "--workers", "2", "-q"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, preexec_fn=heed, start_new_session=True) as process:
        while process.poll() is None and len(list(files.glob("a.zarr/0/c/*/*/*"))) < 3:
            time.sleep(0.01)
        if number == signal.SIGINT:
            os.killpg(process.pid, number)
        else:
            process.send_signal(number)
        assert process.stderr is not None
        rest = process.stderr.read().decode()  # Reading ends with the last worker.
    assert process.returncode == (130 if number == signal.SIGINT else -9)
    assert "Traceback" not in rest
    there = {p: p.stat().st_mtime_ns for p in files.glob("a.zarr/0/c/*/*/*") if p.name.isdigit()}
    assert 3 <= len(there) < 81
    assert main([*words, f"{files}/a.zarr", "-q"]) == 0
    assert {p: p.stat().st_mtime_ns for p in there} == there
    assert np.array_equal(
        stores.open_store(files / "a.zarr").compute(), texrs.PlaneTexture(WEAVE, seed=3)[0:130, 0:130]
    )


def test_a_worker_that_leaves_tells_nothing_of_what_is_half_made() -> None:
    code = """
from texrs._chunks import workers
class Half:
    def __del__(self):
        raise ValueError("half made")
workers._BUSY = True
try:
    workers._leave(15, None)
finally:
    Half()
"""
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stdout, ran.stderr) == (1, "", "")


def test_what_has_no_room_is_said_before_the_work(
    files: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(*given: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "posix_fallocate", full, raising=False)
    before = sorted(files.iterdir())
    assert main(["solid", f"{files}/stripes.tif", "-o", f"{files}/out.npy", "--size", "24", "--chunks", "8"]) == 2
    assert "has too little space for 0.00 GiB; nothing was written" in capsys.readouterr().err
    assert sorted(files.iterdir()) == before


def test_what_no_file_can_hold_is_said_before_the_work(files: Path) -> None:
    tiles = texrs.CornerTiles(WEAVE, 32)
    before = sorted(files.iterdir())
    with pytest.raises(texrs.errors.FileError, match="the disk has too little space for 12884901888.00 GiB"):
        tiles.to_file(files / "out.npy", 2**31)
    assert sorted(files.iterdir()) == before


def test_a_window_of_a_picture(files: Path) -> None:
    words = ["synthesize", f"{files}/weave.png", "-o", f"{files}/far.png", "--size", "40x30", "--origin"]
    assert main([*words, "1000000,-7", "-q"]) == 0
    assert np.array_equal(io.read(files / "far.png"), texrs.PlaneTexture(WEAVE)[-7:23, 1000000:1000040])
    assert (
        main(["synthesize", f"{files}/weave.png", "-o", f"{files}/p.zarr", "--size", "70", "--chunks", "32", "-q"]) == 0
    )
    assert np.array_equal(stores.open_store(files / "p.zarr").compute(), texrs.PlaneTexture(WEAVE)[0:70, 0:70])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--out", "x.bin", "--workers", "2"], "the suffix must be one of"),
        (["--out", "x.exr", "--workers", "2"], "x.exr: .exr cannot store volumes"),
        (["--out", "x.zarr", "--workers", "2", "--scheduler", "tcp://a"], "cannot be combined with"),
        (["--out", "x.zarr", "--workers", "0"], "--workers: must be an integer"),
        (["--out", "x.zarr", "--wrap", "xyz"], "--wrap: only available for results that are not written in parts"),
        (["--out", "x.zarr", "--source-map", "m.npz"], "--source-map: cannot be combined with"),
        (["--out", "x.zarr", "--origin", "1,2"], "--origin: must be X,Y,Z"),
        (["--out", "x.npy", "--size", "2048"], "write to OUT.zarr, or pass --chunks, to compute the result in parts"),
        (["--out", "x.zarr", "--chunks", "0"], "--chunks: each side must be at least 1"),
    ],
)
def test_what_is_refused(files: Path, words: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    given = [f"{files}/{w}" if w.startswith(("x.", "m.")) else w for w in words]
    assert main(["solid", f"{files}/stripes.tif", *given]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("option", ["--convention gltf", "--depth 16", "--format tif", "--pack orm"])
def test_how_maps_are_written_is_not_ignored(option: str, files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["synthesize", f"{files}/weave.png", "-o", f"{files}/p.zarr", "--size", "70", "--chunks", "32"]
    assert main([*words, *option.split()]) == 2
    assert f"{option.split()[0]}: only available for results" in capsys.readouterr().err


def test_maps_are_looked_up_into_a_store(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    weave, heights = f"{files}/weave.png", f"{files}/heights.npy"
    np.save(heights, WEAVE[..., 1].astype(np.float32))
    assert (
        main(["synthesize", weave, "-o", f"{files}/a.png", "--size", "80x60", "--source-map", f"{files}/m.npz", "-q"])
        == 0
    )
    words = ["apply", f"{files}/m.npz", "-o"]
    assert main([*words, f"{files}/b.npy", heights, "-q"]) == 0
    assert main([*words, f"{files}/b.zarr", heights]) == 0
    assert "b.zarr: 80 x 60, 1 chunks" in capsys.readouterr().err
    assert np.array_equal(io.read(files / "b.zarr"), np.load(files / "b.npy"))
    assert main([*words, f"{files}/b.zarr", weave]) == 2
    assert "contains other data" in capsys.readouterr().err
    assert main([*words, f"{files}/b.zarr", weave, "--force", "--map-type", "label", "-q"]) == 0
    assert np.array_equal(io.read(files / "b.zarr"), io.read(files / "a.png"))
    assert main([*words, f"{files}/c.zarr", weave, "--screening", "0.2"]) == 2
    assert "pass --screening 0" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["design"], "40000 x 40000 has 1600000000 pixels, .*; texrs tiles creates an unbounded design"),
        (["tile"], "; texrs tiles creates an unbounded design, and writes windows of any size$"),
        (
            ["tiles"],
            "--size: .* more than the limit of 268435456; write to OUT.zarr, or pass --chunks, to compute",
        ),
        (
            ["synthesize"],
            "more than the limit of 268435456; write to OUT.zarr, or pass --chunks, to compute the result in parts$",
        ),
        (["perspective"], "more than the limit of 268435456$"),
    ],
)
def test_what_is_too_large_is_told_how_it_is_made(
    files: Path, words: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*words, f"{files}/weave.png", "-o", f"{files}/x.png", "--size", "40000"]) == 2
    assert re.search(message, capsys.readouterr().err.strip())


def test_python_is_told_in_its_own_words() -> None:
    for verb, words in (
        (texrs.design, "texrs.CornerTiles creates"),
        (texrs.tile, "texrs.CornerTiles creates"),
        (texrs.synthesize, "texrs.PlaneTexture.to_zarr and to_dask make it in parts"),
    ):
        with pytest.raises(LimitExceeded, match=words):
            verb(WEAVE, size=40_000)
    with (
        texrs.limits.context(memory=4e9),
        pytest.raises(LimitExceeded, match=r"texrs\.SolidTexture\.to_zarr and to_dask"),
    ):
        texrs.solid(STRIPES, 600)
    with pytest.raises(LimitExceeded, match=r"texrs\.PlaneTexture\.to_zarr"):
        texrs.PlaneTexture(WEAVE)[0:20_000, 0:20_000]


def test_voxels_of_results_lie_as_far_apart_as_those_of_examples(files: Path) -> None:
    apart = (2.0, 0.5, 0.25)
    io.write_volume(files / "a.nrrd", np.resize(STRIPES, (32, 32, 32, 3)), spacing=apart)
    words = ["solid", f"{files}/a.nrrd", "--size", "16", "--quality", "fast", "-q", "-o"]
    assert main([*words, f"{files}/once.vti", "--source-map", f"{files}/m.npz"]) == 0
    for name, more in (("b.zarr", []), ("b.raw", []), ("b.vti", ["--chunks", "8"])):
        assert main([*words, f"{files}/{name}", *more]) == 0
    assert main(["apply", f"{files}/m.npz", f"{files}/a.nrrd", "-o", f"{files}/again.nii.gz", "-q"]) == 0
    for name in ("once.vti", "b.zarr", "b.nhdr", "b.vti", "again.nii.gz"):
        assert io.read_spacing(files / name) == apart
    assert main([*words, f"{files}/plain.tif"]) == 0
    texture = texrs.SolidTexture(STRIPES)
    texture.to_file(files / "c.vti", 8, spacing=apart)
    assert io.read_spacing(files / "c.vti") == apart
    with pytest.raises(InvalidInput, match="spacing: cannot be stored in .npy"):
        texture.to_file(files / "c.npy", 8, spacing=apart)

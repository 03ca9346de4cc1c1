"""Batches: recipes and patterns. Finished results stay and are not computed again, and failures do not stop the rest."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from texrs import io, samples
from texrs.cli import main
from texrs.io.annotation import write_record

Capture = pytest.CaptureFixture[str]
RECIPE = """
verb = "design"
inputs = ["stones/*.png"]
out = "made/{name}-{preset}-{seed}.png"
seeds = "3:5"
options = { size = 48, copies = 1, source_map = "maps/{name}-{preset}-{seed}.npz" }
sheet = "made/sheet.png"

[presets.still]
way = "still"
[presets.turned]
rotate = 180.0
allow_mirror = false
"""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("stones").mkdir()
    Path("maps").mkdir()
    for name in ("dots", "weave"):
        io.write(f"stones/{name}.png", samples.load(name, size=(48, 48)).image)
    Path("all.toml").write_text(RECIPE)
    return tmp_path


def files(folder: Path) -> dict[str, bytes]:
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def said(path: str | Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(io.read_metadata(path).made or "{}")
    return found


def test_a_recipe_is_done_once(here: Path, capsys: Capture) -> None:
    before = files(here)
    assert main(["batch", "all.toml"]) == 0
    names = [f"{n}-{p}-{s}" for n in ("dots", "weave") for p in ("still", "turned") for s in (3, 4)]
    made = set(files(here)) - set(before)
    maps = {f"maps/{n}.npz{beside}" for n in names for beside in ("", ".json")}
    assert made == {f"made/{n}.png" for n in names} | maps | {"made/sheet.png"}
    err = capsys.readouterr().err.splitlines()
    assert err[0] == "texrs: 1 of 8: wrote made/dots-still-3.png"
    assert err[-1].startswith("texrs: 8 of 8 results are complete, 0 failed, in ")
    assert io.read("made/sheet.png").shape == (768, 768, 3)
    assert said("made/sheet.png")["verb"] == "batch"
    one = said("made/dots-turned-4.png")
    assert one["arguments"] == ["../stones/dots.png"]
    assert one["options"] == {
        "--size": "48",
        "--rotate": "180.0",
        "--no-allow-mirror": True,
        "--copies": "1",
        "--seed": "4",
    }
    # A result of the batch equals the result of the command alone, called from any folder.
    alone = [
        "design",
        "stones/dots.png",
        "--size",
        "48",
        "--copies",
        "1",
        "--rotate",
        "180",
        "--no-allow-mirror",
        "--seed",
        "4",
    ]
    assert main([*alone, "-o", "made/alone.png", "-q"]) == 0
    assert Path("made/alone.png").read_bytes() == Path("made/dots-turned-4.png").read_bytes()
    Path("made/alone.png").unlink()
    whole = files(here)
    times = {n: os.stat(n).st_mtime_ns for n in whole}
    os.chdir("maps")
    assert main(["batch", "../all.toml"]) == 0
    os.chdir("..")
    err = capsys.readouterr().err.splitlines()
    assert sum("exists already" in line for line in err) == 8
    assert files(here) == whole
    assert {n for n in whole if os.stat(n).st_mtime_ns != times[n]} == {"made/sheet.png"}
    # Results that are missing, changed or made in another way are computed again.
    Path("maps/dots-still-3.npz").unlink()
    io.write("made/weave-still-3.png", np.zeros((48, 48, 3), np.uint8))
    write_record(Path("made/weave-still-3.png"), str(io.read_metadata("made/weave-turned-3.png").made))
    assert main(["batch", "all.toml", "--force"]) == 0
    err = capsys.readouterr().err.splitlines()
    assert [line for line in err if "wrote" in line] == [
        "texrs: 1 of 8: wrote made/dots-still-3.png",
        "texrs: 5 of 8: wrote made/weave-still-3.png",
        "texrs: wrote made/sheet.png",
    ]
    assert files(here) == whole
    capsys.readouterr()
    assert main(["rerun", "made/sheet.png", "-q"]) == 0
    assert "the same bytes" in capsys.readouterr().out
    assert main(["batch", "all.toml", "--set", "size=40", "--seeds", "3", "-q"]) == 0
    assert io.read("made/dots-still-3.png").shape == (40, 40, 3)
    assert Path("made/dots-still-4.png").read_bytes() == whole["made/dots-still-4.png"]


def test_one_that_fails_stops_no_other(here: Path, capsys: Capture) -> None:
    Path("stones/broken.png").write_bytes(Path("stones/dots.png").read_bytes()[:200])
    io.write("stones/small.png", np.zeros((1, 1, 3), np.uint8))
    Path("out").mkdir()
    Path("out/weave.png").write_bytes(b"dear")
    command = ["batch", "tile", "stones", "-o", "out", "--sheet", "sheet.png"]
    assert main(command) == 3
    err = capsys.readouterr().err.splitlines()
    assert "texrs: 2 of 4: wrote out/dots.png" in err
    failed = [line for line in err if line.startswith("texrs: failed: ")]
    assert [line.split()[2] for line in failed] == ["stones/broken.png", "stones/small.png", "stones/weave.png"]
    assert "cut off" in failed[0]
    assert "--force" in failed[2]
    assert err[-1].startswith("texrs: 1 of 4 results are complete, 3 failed")
    assert Path("out/weave.png").read_bytes() == b"dear"
    assert io.read("sheet.png").shape == (512, 512, 3)
    assert main([*command, "-q"]) == 3
    assert len(capsys.readouterr().err.splitlines()) == 4


def test_patterns_folders_and_places(here: Path, capsys: Capture) -> None:
    assert main(["batch", "tile", "stones/*.png", "-o", "stones", "--set", "wrap=x", "-q"]) == 2
    assert "would be lost" in capsys.readouterr().err
    assert main(["batch", "tile", "stones/*.png", "-o", "stones/{name}-{verb}.png", "--set", "wrap=x", "-q"]) == 0
    before = files(here)
    assert sorted(n for n in before if "tile" in n) == ["stones/dots-tile.png", "stones/weave-tile.png"]
    # Earlier results in the folder of the inputs are not inputs.
    assert main(["batch", "tile", "stones/*.png", "-o", "stones/{name}-{verb}.png", "--set", "wrap=x", "-q"]) == 0
    assert files(here) == before
    Path("masks").mkdir()
    for name in ("dots", "weave"):
        io.write(f"masks/{name}.png", np.pad(np.full((6, 6), 255, np.uint8), 21))
    recipe = 'verb = "inpaint"\ninputs = ["stones/dots.png", "stones/weave.png"]\nout = "whole"\n'
    Path("holes.toml").write_text(recipe + 'arguments = ["{input}", "masks/{name}.png"]\n')
    assert main(["batch", "holes.toml", "-q"]) == 0
    assert said("whole/weave.png")["arguments"] == ["../stones/weave.png", "../masks/weave.png"]
    assert main(["batch", "tile", "sample:weave", "-o", "s", "-q"]) == 0
    assert Path("s/weave.png").exists()


@pytest.mark.parametrize(
    ("recipe", "words"),
    [
        ("", "verb is missing"),
        ('verb = "design"', "inputs is missing"),
        ('verb = "design"\ninputs = "stones"', "out is missing"),
        ('verb = "design"\ninputs = "stones"\nout = "o"\nseed = 3', "unknown key 'seed'; must be one of verb, inputs"),
        ('verb = "desing"\ninputs = "stones"\nout = "o"', "got 'desing'"),
        ('verb = "batch"\ninputs = "stones"\nout = "o"', "got 'batch'"),
        ('verb = "design"\ninputs = "no/*.png"\nout = "o"', "none match 'no/*.png'"),
        ('verb = "design"\ninputs = [1]\nout = "o"', "inputs: must be a string or a list of strings, got [1]"),
        ('verb = "design"\ninputs = "stones"\nout = "o"\nseeds = "5:5"', "seeds: must be A:B as in 0:32"),
        ('verb = "design"\ninputs = "stones"\nout = "o"\nseeds = [1.5]', "seeds: must be A:B as in 0:32"),
        ('verb = "design"\ninputs = "stones"\nout = "o.png"', "several have the name o.png"),
        ('verb = "design"\ninputs = "stones"\nout = "{name}.png"\nseeds = "0:2"', "several have the name"),
        ('verb = "design"\ninputs = "stones"\nout = "o"\noptions = {sise = 3}', "No such option: --sise"),
        (
            'verb = "design"\ninputs = "stones"\nout = "o"\noptions = {size = {a = 3}}',
            "size must be a string, a number",
        ),
        ('verb = "design"\ninputs = "stones"\nout = "o"\noptions = 3', "options must be a table"),
        ('verb = "design"\ninputs = "stones"\nout = "o"\npresets = {a = 3}', "each preset must be a table"),
        ('verb = "tile"\ninputs = "stones"\nout = "o"\nsheet = "stones/dots.png"', "is an input"),
        ("verb = ", "is not TOML"),
    ],
)
def test_bad_recipes_are_refused_before_the_work(here: Path, capsys: Capture, recipe: str, words: str) -> None:
    Path("bad.toml").write_text(recipe)
    before = files(here)
    assert main(["batch", "bad.toml"]) == 2
    assert words in capsys.readouterr().err
    assert files(here) == before


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_a_batch_that_was_stopped_goes_on(here: Path, capsys: Capture, number: int) -> None:
    command = ["batch", "all.toml"]

    def heed() -> None:
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    with subprocess.Popen(
        [sys.executable, "-m", "texrs", *command], stderr=subprocess.PIPE, preexec_fn=heed
    ) as process:
        assert process.stderr is not None
        assert process.stderr.readline() == b"texrs: 1 of 8: wrote made/dots-still-3.png\n"
        assert process.stderr.readline() == b"texrs: 2 of 8: wrote made/dots-still-4.png\n"
        time.sleep(0.02)
        process.send_signal(number)
        rest = process.stderr.read().decode().splitlines()
    assert process.returncode == (130 if number == signal.SIGINT else -9)
    if number == signal.SIGINT:
        assert any("the same command continues from there" in line for line in rest)
        assert "files that were finished before are kept: made/dots-still-3.png, made/dots-still-4.png" in rest[-1]
    done = {n: (here / n).stat().st_mtime_ns for n in files(here) if n.startswith("made/dots-still")}
    assert len(done) >= 2
    assert main(command) == 0
    assert {n: (here / n).stat().st_mtime_ns for n in done} == done
    assert len(list(here.glob("made/*-*-*.png"))) == 8


@pytest.mark.parametrize("how", ["--workers", "--scheduler"])
def test_workers_make_the_same_bytes_each_once(here: Path, capsys: Capture, how: str) -> None:
    """Processes and clusters write the same files, keep existing ones, and report failures at the end."""
    Path("stones/broken.png").write_bytes(Path("stones/dots.png").read_bytes()[:200])
    assert main(["batch", "all.toml"]) == 3
    alone = files(here)
    kept = {n: os.stat(n).st_mtime_ns for n in alone if n.startswith("made/dots-still")}
    for name in alone:
        if name.startswith("made/weave") or name.endswith("turned-3.png"):
            Path(name).unlink()
    capsys.readouterr()
    with workers_of(how) as words:
        assert main(["batch", "all.toml", *words]) == 3
        err = capsys.readouterr().err.splitlines()
        assert files(here) == alone
        assert {n: os.stat(n).st_mtime_ns for n in kept} == kept
        assert sum("exists already" in line for line in err) == 3
        assert sum(": wrote made/dots" in line or ": wrote made/weave" in line for line in err) == 5
        assert err[-5].startswith("texrs: failed: stones/broken.png to made/broken-still-3.png: ")
        assert err[-1].startswith("texrs: 8 of 12 results are complete, 4 failed")
        assert main(["batch", "all.toml", *words, "-q"]) == 3
    assert files(here) == alone


@contextmanager
def workers_of(how: str) -> Iterator[list[str]]:
    """The option for two processes, or for two threads of a cluster's worker."""
    if how == "--workers":
        yield [how, "2"]
        return
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=1, threads_per_worker=2, dashboard_address=":0") as cluster:
        yield [how, cluster.scheduler_address]


def test_who_shares_the_work_is_checked(here: Path, capsys: Capture) -> None:
    for words, message in (
        (["--workers", "0"], "--workers: must be an integer"),
        (["--workers", "2", "--scheduler", "tcp://a"], "cannot be combined with"),
        (["--scheduler", "nobody"], "--scheduler: no scheduler answers at 'nobody'"),
    ):
        before = files(here)
        assert main(["batch", "all.toml", *words]) == 2
        assert message in capsys.readouterr().err
        assert files(here) == before


def test_stores_of_zarr_are_inputs(here: Path) -> None:
    zarr = pytest.importorskip("zarr")
    block = samples.stripes((32, 32, 32)).image
    for name in ("one", "two"):
        zarr.save_array(f"vols/{name}.zarr", block)
    words = ["batch", "solid", "-o", "made", "--set", "size=20", "--set", "quality=fast", "-q"]
    for inputs in (["vols"], ["vols/*.zarr"], ["vols/one.zarr", "vols/two.zarr"]):
        assert main([*words, *inputs]) == 0
        assert sorted(n for n in files(here) if n.startswith("made") and n.endswith(".npy")) == [
            "made/one.npy",
            "made/two.npy",
        ]
    assert main(["batch", "slice", "vols", "-o", "cuts", "-q"]) == 0
    assert Path("cuts/two.png").exists()
    assert list(said("made/one.npy")["inputs"]) == ["../vols/one.zarr"]


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_stopped_workers_leave_nothing_and_nobody(here: Path, number: int) -> None:
    """Ctrl-C reaches all processes of a terminal at once. A kill reaches only the first process."""
    size = ["--set", "size=400", "--seeds", "0:4", "--workers", "2"]

    def heed() -> None:
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    with subprocess.Popen(
        [sys.executable, "-m", "texrs", "batch", "all.toml", *size],
        stderr=subprocess.PIPE,
        preexec_fn=heed,
        start_new_session=True,
    ) as process:
        assert process.stderr is not None
        first = process.stderr.readline().decode()
        assert ": wrote made/" in first
        if number == signal.SIGINT:
            os.killpg(process.pid, number)
        else:
            process.send_signal(number)
        # All workers hold the other end of the pipe, so reading ends when the last worker has ended.
        rest = process.stderr.read().decode()
    assert process.returncode == (130 if number == signal.SIGINT else -9)
    assert "Traceback" not in rest
    if number == signal.SIGINT:
        assert "the same command continues from there" in rest
    assert not [n for n in files(here) if ".texrs-" in n]


def test_folders_of_maps_are_done_as_a_whole(here: Path, capsys: Capture) -> None:
    for name in ("rock", "moss"):
        Path("stacks", name).mkdir(parents=True)
        image = samples.load("dots", size=(48, 48), seed=len(name)).image
        io.write(f"stacks/{name}/{name}_albedo.png", image)
        io.write(f"stacks/{name}/{name}_height.png", image[..., 0].astype(np.uint16))
    words = ["batch", "design", "-o", "made", "--seeds", "0:2", "--set", "size=48", "--set", "copies=1"]
    for inputs in (["stacks/*"], ["stacks"]):
        assert main([*words, *inputs]) == 0, capsys.readouterr().err
        made = sorted(str(p.relative_to(here)) for p in Path("made").resolve().rglob("*.png"))
        assert made == [
            f"made/{n}-{s}/{n}_{m}.png" for n in ("moss", "rock") for s in (0, 1) for m in ("albedo", "height")
        ]
    # In the second run, all results exist already.
    assert capsys.readouterr().err.count("exists already") == 4
    assert main([*words, "stacks", "--sheet", "sheet.png", "-q"]) == 0
    assert io.read("made/rock-0/rock_height.png").dtype == np.uint16
    assert io.read("sheet.png").std() > 5
    # Only lost or changed results are computed again.
    whole = files(here)
    Path("made/rock-1/rock_height.png").unlink()
    capsys.readouterr()
    assert main([*words, "stacks"]) == 0
    assert capsys.readouterr().err.count("exists already") == 3
    assert files(here) == whole
    assert main(["rerun", "made/moss-1", "-q"]) == 0
    assert capsys.readouterr().out.count("the same bytes") == 2

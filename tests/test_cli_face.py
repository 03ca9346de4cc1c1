"""The interface of the command line: grouped help, completion, Ctrl-C from the start, unambiguous sizes."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from texrs import io
from texrs.cli import COMMANDS, GROUPS, main

Capture = pytest.CaptureFixture[str]


def test_alone_it_shows_the_help_with_the_four_systems_first(capsys: Capture) -> None:
    assert main([]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert [line.strip(" :") for line in out.splitlines() if line in {f"{g}:" for g in GROUPS}] == list(GROUPS)
    lines = [line.split()[0] for line in out.splitlines() if re.match(r"  [a-z][a-z-]+ {2,}\S", line)]
    assert lines == list(COMMANDS)
    assert list(GROUPS["The four systems"])[:5] == ["design", "splice", "self-splice", "perspective", "solid"]
    assert main(["nothing"]) == 2


@pytest.mark.parametrize("command", COMMANDS)
def test_three_options_come_first_and_groups_hold_all(capsys: Capture, command: str) -> None:
    assert main([command, "--help"]) == 0
    out = capsys.readouterr().out
    titles = re.findall(r"^(\S.*):$", out, re.MULTILINE)
    assert titles[0] in ("Arguments", "Options")
    assert titles[-1] == "Execution" or command == "info"
    if command not in ("info", "database"):
        first = out[out.index("Options:\n") :].split("\n\n")[0]
        assert 1 <= len(re.findall(r"^  -", first, re.MULTILINE)) <= 3
        assert "--out" in first.splitlines()[1]
    if command == "design":
        assert {"Elements", "Deformation"} <= set(titles)
        assert "--rotate" in out[out.index("Deformation:\n") :]


def test_the_shell_completes(tmp_path: Path) -> None:
    environment = os.environ | {"_TEXRS_COMPLETE": "complete_bash", "COMP_WORDS": "texrs desi", "COMP_CWORD": "1"}
    code = "import sys; sys.argv = ['texrs']; from texrs.__main__ import main; sys.exit(main())"
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["design"]
    environment["COMP_WORDS"], environment["COMP_CWORD"] = "texrs design --se", "2"
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["--seed"]


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize("library", ["typer", "numpy"])
def test_ctrl_c_while_it_loads_leaves_no_traceback(tmp_path: Path, library: str) -> None:
    stub = f"import os, signal, time\nos.kill(os.getpid(), {signal.SIGINT:d})\ntime.sleep(5)\n"
    (tmp_path / f"{library}.py").write_text(stub)
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])

    def heed() -> None:
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    done = subprocess.run(
        [sys.executable, "-m", "texrs", "tile", "in.png", "-o", "out.png"],
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
        cwd=tmp_path,
        preexec_fn=heed,
    )
    assert done.returncode == 130
    assert done.stderr.splitlines() == ["texrs: stopped; no incomplete files are left"]


def test_a_hole_in_alpha_is_filled_from_a_picture_without(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    random = np.random.default_rng(0)
    source = random.integers(0, 256, (48, 48, 3)).astype(np.uint8)
    picture = np.dstack([source[::-1], np.full((48, 48), 255, np.uint8)])
    picture[16:26, 18:30] = 0
    for suffix, pixels, other in (
        ("png", picture, source),
        ("tif", picture.astype(np.uint16) * 257, source.astype(np.uint16) * 257),
        ("exr", picture.astype(np.float32) / 255, source.astype(np.float32) / 255),
        ("grey.png", picture[..., [0, 3]], source[..., 0]),
    ):
        io.write(f"in.{suffix}", pixels)
        io.write(f"from.{suffix}", other)
        assert (
            main(["inpaint", f"in.{suffix}", "alpha", "--exemplar", f"from.{suffix}", "-o", f"out.{suffix}", "-q"]) == 0
        )
        made = io.read(f"out.{suffix}")
        assert made.dtype == pixels.dtype
        assert made.shape == pixels.shape
        assert (made[..., -1] == (1 if suffix == "exr" else np.iinfo(pixels.dtype).max)).all()
        assert (made[:16] == pixels[:16]).all()
        assert np.isin(made[17:25, 19:29, 0], other if other.ndim == 2 else other[..., 0]).all()


@pytest.mark.parametrize("text", ["64,48", "64:48", "64 48", "64*48", "64x", "x48", "64x48x3", "64.0x48", ""])
def test_sizes_cannot_be_mistaken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture, text: str) -> None:
    monkeypatch.chdir(tmp_path)
    io.write("in.png", np.arange(48 * 48, dtype=np.uint8).reshape(48, 48))
    assert main(["tile", "in.png", "-o", "out.png", "--size", text]) == 2
    assert "--size: must be WIDTHxHEIGHT, as in 1024x512, or one number" in capsys.readouterr().err
    assert main(["tile", "in.png", "-o", "out.png", "--size", "64x56"]) == 0
    assert io.read("out.png").shape == (56, 64)
    assert "wrote out.png: 64 x 56, 1 channel" in capsys.readouterr().err

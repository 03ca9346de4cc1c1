"""The command as a process: signals, terminals, pipes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from commands import TINY, files, start

posix = pytest.mark.skipif(os.name != "posix", reason="signals, pipes and terminals of POSIX")
LONG = ["design", "in.png", "-o", "out.png", "--size", "3000", "--source-map", "s.npz", "--stages", "st"]


@posix
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_signals_leave_nothing_half_written(here: Path, number: int, code: int) -> None:
    before = files(here)
    with start(*LONG) as process:
        assert process.stderr is not None
        while b"stitch" not in (line := process.stderr.readline()):
            assert line.startswith(b"texrs: ")
        process.send_signal(number)
        rest = process.stderr.read()
    assert process.returncode == code
    assert rest.splitlines()[-1] == b"texrs: stopped; no incomplete files are left"
    assert b"Traceback" not in rest
    assert files(here) == before


@posix
def test_a_bar_on_a_terminal(here: Path) -> None:
    import pty

    mine, theirs = pty.openpty()
    command = [sys.executable, "-m", "texrs", "design", "in.png", *TINY, "-o", "out.png"]
    environment = os.environ | {"TERM": "xterm"}
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=theirs, env=environment, check=True)
    os.close(theirs)
    shown = b""
    # On Linux, reading a terminal without a writer ends with an error. Elsewhere it returns nothing.
    try:
        while part := os.read(mine, 4096):
            shown += part
    except OSError:
        pass
    os.close(mine)
    assert done.stdout == b""
    assert b"\x1b[" in shown
    assert b"100 %" in shown
    assert b"texrs: wrote out.png" in shown


@posix
def test_nobody_reads(here: Path) -> None:
    read, write = os.pipe()
    os.close(read)
    with start("samples", stdout=write) as process:
        os.close(write)
        assert process.stderr is not None
        assert process.stderr.read() == b""
    assert process.returncode == 141

"""Helpers of the tests of the command line."""

from __future__ import annotations

import functools
import importlib
import io
import re
import signal
import subprocess
import sys
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest

from texrs import samples

Capture = pytest.CaptureFixture[str]
COLOURS = samples.load("dots", size=(64, 64)).image
GREY = np.ascontiguousarray(COLOURS[..., 1])
TINY = ("--size", "48", "--copies", "1", "--way", "still")
"""Options of the fastest designs: the default tries several ways, which takes seconds."""


def files(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() if p.is_file() else b"" for p in folder.rglob("*")}


def replace_design(monkeypatch: pytest.MonkeyPatch, error: BaseException | None) -> None:
    """Replace the work of texrs design by a failure. Its options stay the same."""
    module = importlib.import_module("texrs.papers.design")

    @functools.wraps(module.design)
    def fail(*arguments: object, **options: object) -> None:
        raise error or RuntimeError("the work has begun")

    monkeypatch.setattr(module, "design", fail)


def complaint(capture: Capture) -> str:
    """Return the one line on stderr, and nothing on stdout."""
    out, err = capture.readouterr()
    assert out == ""
    assert re.fullmatch(r"texrs: [^\n]+\n", err), err
    assert "Traceback" not in err
    return err


def npy(array: object, *, pickle: bool = False) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, np.asarray(array), allow_pickle=pickle)
    return buffer.getvalue()


def png(array: np.ndarray) -> bytes:
    return iio.imwrite("<bytes>", array, extension=".png")


def start(*arguments: str, **options: object) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "texrs", *arguments]

    def heed() -> None:
        """Accept interrupts, which a shell lets its background jobs ignore."""
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    return subprocess.Popen(command, stderr=subprocess.PIPE, preexec_fn=heed, **options)  # type: ignore[call-overload, no-any-return]

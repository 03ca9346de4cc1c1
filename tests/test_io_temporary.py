"""Files are complete and durable when they get their names, and remains of killed processes are removed."""

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from texrs import io as tio
from texrs.errors import FileError
from texrs.io import temporary

posix = pytest.mark.skipif(os.name != "posix", reason="whether a process is there is asked of POSIX")

KILLED = """
import os, signal, sys
from texrs import io
with io.atomic(sys.argv[1]) as temporary:
    temporary.write_bytes(b"half")
    os.kill(os.getpid(), signal.SIGKILL)
"""


@posix
def test_what_a_killed_process_left_goes_when_the_next_one_writes(tmp_path):
    path = tmp_path / "a.npy"
    path.write_bytes(b"former")
    done = subprocess.run([sys.executable, "-c", KILLED, str(path)], check=False)
    assert done.returncode == -9
    (left,) = tmp_path.glob(".texrs-*.npy")
    assert (left.read_bytes(), path.read_bytes()) == (b"half", b"former")
    tio.write(path, np.ones((2, 2)))
    assert list(tmp_path.iterdir()) == [path]


@posix
def test_only_what_nobody_is_making_is_swept(tmp_path):
    home = temporary._find_home()
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    other = f"{int(home, 16) ^ 1:08x}"
    week = time.time() - 8 * 24 * 3600
    kept = {
        f"{temporary.name_prefix()}00000000.png",
        f".texrs-{home}-1-00000000.png",
        f".texrs-{other}-{gone.pid}-00000000.png",
        f".texrs-{home}-{gone.pid}-00000000.former",
        f".texrs-{home}-{gone.pid}-0.png",
        f".texrs-{home}-99999999999-00000000.png",
        f".a.npy-{home}-{gone.pid}-00000000.png",
        ".texrs-notes.txt",
        ".a.raw.texrs-part",
    }
    swept = {
        f".texrs-{home}-{gone.pid}-{8 * c}{end}" for c, end in zip("0123", ("", ".png", ".nii.gz", ".x"), strict=True)
    }
    for name in kept | swept:
        (tmp_path / name).write_bytes(b"x")
    store = tmp_path / f".texrs-{home}-{gone.pid}-00000000.zarr"
    (store / "c").mkdir(parents=True)
    (store / "c" / "0").write_bytes(b"x")
    old = tmp_path / f".texrs-{other}-{gone.pid}-11111111.png"
    old.write_bytes(b"x")
    os.utime(old, (week, week))
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "mine").write_bytes(b"x")
    (tmp_path / f".texrs-{home}-{gone.pid}-22222222").symlink_to(elsewhere)
    temporary.sweep(os.fspath(tmp_path))
    assert {p.name for p in tmp_path.iterdir()} == kept | {"elsewhere"}
    assert (elsewhere / "mine").exists()


@pytest.fixture
def steps(monkeypatch):
    """Record the operations on files in order: bytes on the disk, and renamings."""
    done = []
    sync, replace = os.fsync, os.replace

    def tell_sync(number):
        done.append(("sync", os.path.realpath(f"/proc/self/fd/{number}")))
        sync(number)

    def tell_replace(old, new):
        done.append(("replace", os.fspath(new)))
        replace(old, new)

    monkeypatch.setattr(os, "fsync", tell_sync)
    monkeypatch.setattr(os, "replace", tell_replace)
    return done


@pytest.mark.skipif(sys.platform != "linux", reason="files are named by their numbers")
@pytest.mark.parametrize("name", ["a.npy", "a.png", "a.tif"])
def test_bytes_are_on_the_disk_before_they_have_the_name(tmp_path, steps, name):
    """After a power failure, a file system may have any beginning of this list: the former file, or the whole new one."""
    path = tmp_path / name
    for value in (1, 2):
        steps.clear()
        tio.write(path, np.full((4, 4), value, np.uint8))
        assert [kind for kind, _ in steps] == ["sync", "replace", "sync"]
        assert Path(steps[0][1]).name.startswith(".texrs-")
        assert steps[1:] == [("replace", str(path)), ("sync", str(tmp_path))]


def test_a_disk_that_cannot_take_the_bytes_leaves_the_former_file(tmp_path, monkeypatch):
    path = tmp_path / "a.npy"
    tio.write(path, np.zeros((2, 2)))
    before = path.read_bytes()

    def fail(number):
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(FileError, match="input/output error"):
        tio.write(path, np.ones((2, 2)))
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_store_that_cannot_take_its_place_leaves_the_former_one(tmp_path, monkeypatch):
    pytest.importorskip("zarr")
    path = tmp_path / "a.zarr"
    tio.write_volume(path, np.zeros((4, 4, 4), np.uint8))
    replace = os.replace

    def fail(old, new):
        if os.fspath(old).endswith(".zarr") and os.fspath(new) == os.fspath(path):
            raise OSError(5, "Input/output error")
        replace(old, new)

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(FileError, match="input/output error"):
        tio.write_volume(path, np.ones((4, 4, 4), np.uint8))
    monkeypatch.undo()
    assert tio.read_volume(path).max() == 0
    assert list(tmp_path.iterdir()) == [path]
    tio.write_volume(path, np.ones((4, 4, 4), np.uint8))
    assert tio.read_volume(path).min() == 1
    assert list(tmp_path.iterdir()) == [path]

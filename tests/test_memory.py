"""Available memory, according to the machine, its containers and limits, checked before it is allocated."""

import subprocess
import sys

import numpy as np
import pytest

import texrs
from texrs import _memory, limits
from texrs._checks import check_memory
from texrs.errors import InvalidInput, LimitExceeded


@pytest.mark.parametrize(
    ("own", "files", "found"),
    [
        ("0::/\n", {"memory.max": "1000"}, [1000]),
        ("0::/\n", {"memory.max": "max"}, []),
        ("0::/a/b\n", {"a/b/memory.max": "max", "a/memory.max": "500", "memory.max": "900"}, [500, 900]),
        ("0::/outside/of/it\n", {"memory.max": "700"}, [700]),
        ("4:cpu,memory:/x\n3:pids:/x\n", {"memory/x/memory.limit_in_bytes": "300"}, [300]),
        ("4:cpu:/x\n", {"memory/x/memory.limit_in_bytes": "300"}, []),
        ("0::/\n", {"memory.max": "-1"}, []),
        ("nothing\n", {}, []),
        ("", {}, []),
    ],
)
def test_what_control_groups_allow(tmp_path, own, files, found):
    (tmp_path / "own").write_text(own)
    for name, text in files.items():
        file = tmp_path / "groups" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text + "\n")
    assert _memory._read_groups(tmp_path / "groups", tmp_path / "own") == found
    assert _memory._read_groups(tmp_path / "groups", tmp_path / "none") == []


def test_a_limit_in_the_environment(monkeypatch):
    monkeypatch.setenv("TEXRS_MEMORY", "2e6")
    assert limits.current().memory == 2_000_000
    check_memory(2_000_000)
    with pytest.raises(LimitExceeded, match=r"size: needs 2.0 MB of memory, more than the limit of 2.0 MB; smaller"):
        check_memory(2_000_001, way="smaller")
    with pytest.raises(LimitExceeded, match="size"):
        texrs.perspective(np.zeros((32, 32), np.uint8), np.ones((32, 32)), (400, 400))
    with pytest.raises(LimitExceeded, match="size"):
        texrs.design(np.zeros((32, 32), np.uint8), (400, 400))
    for text in ("much", "-1", "nan", "inf", "0"):
        monkeypatch.setenv("TEXRS_MEMORY", text)
        with pytest.raises(InvalidInput, match="TEXRS_MEMORY"):
            limits.current()


@pytest.mark.skipif(sys.platform != "linux", reason="limits of a process are set as Linux has them")
def test_a_limit_of_the_process():
    code = (
        "import resource; resource.setrlimit(resource.RLIMIT_AS, (2**32, 2**32))\n"
        "from texrs import _memory; print(_memory.find_memory())\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert int(done.stdout) <= 2**32

"""Where memory ends: each kernel, in processes whose address space may grow by so much, ends by an exception."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

MEGABYTES = (1, 8, 32, 96, 256)
"""What a process may grow by. What a kernel frees does not help it: it is the first that runs in its process."""
KERNELS = {
    "poisson": "_rust.poisson(image, (image, image), 0.01, ('free', 'free'), None, None)",
    "poisson in a disc": "_rust.poisson(image, None, 0.01, ('free', 'free'), disc, None)",
    "patch_search": "_rust.PatchIndex([image], [None], (64, 64))",
    "ncc": "_rust.Correlation(image)",
    "mean_shift": "_rust.mean_shift(image, 1, 0.1, 1, 1.0, (False, False), None)",
    "seam": "_rust.seam_cut(image, other, whole, whole, None, disc, None, None, 'gradient', (False, False))",
    "labels": "_rust.seam_labels(two, (one, one), (one, one), (False, False))",
    "strip": "_rust.seam_strips([(image, other, 1, None)], False, 'gradient')",
    "distance": "_rust.outlines(disc.astype(np.int32), [(1, (0, 0), (1024, 1024))])",
    "warp": "_rust.warp_mesh((side, side), places.reshape(-1, 2), np.zeros(side * side, np.uint8), (side, side), None)",
}
SCRIPT = """
import os, re, resource, sys
import numpy as np, texrs
from texrs import _rust
from texrs.errors import TexrsError

side = 1024
rng = np.random.default_rng(0)
image, other = (rng.random((side, side, 3), dtype=np.float32) for _ in range(2))
one, two = np.full((side, side), 0.2, np.float32), np.ascontiguousarray(image[..., :2])
row, column = np.mgrid[:side, :side]
disc = (row - side / 2) ** 2 + (column - side / 2) ** 2 < (0.4 * side) ** 2
whole = np.ones((side, side), bool)
places = np.stack([row, column], -1).astype(np.float64)
clean = (TexrsError, MemoryError)
_rust.poisson(image[:16, :16].copy(), None, 0.01, ('free', 'free'), None, None)


def ends(name, call, more):
    into, out = os.pipe()
    child = os.fork()
    if not child:
        size = int(re.search(r"VmSize:\\s+(\\d+)", open("/proc/self/status").read())[1]) * 1024
        resource.setrlimit(resource.RLIMIT_AS, (size + (more << 20),) * 2)
        try:
            with texrs.threads(1):
                eval(call)
            os.write(out, b"done")
        except clean as error:
            os.write(out, type(error).__name__.encode())
        except BaseException as error:
            os.write(out, f"{type(error).__name__}: {error}"[:500].encode())
        os._exit(0)
    os.close(out)
    _, status = os.waitpid(child, 0)
    word = os.read(into, 1000).decode()
    os.close(into)
    print(f"{name} | {more} | {status} | {word}", flush=True)


for call in sys.argv[2:]:
    for more in map(int, sys.argv[1].split()):
        ends(call.split("|")[0], call.split("|")[1], more)
"""


def run(calls: dict[str, str], sizes: tuple[int, ...]) -> list[list[str]]:
    plain = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "RAYON_NUM_THREADS": "1", "MALLOC_ARENA_MAX": "1"}
    given = [" ".join(map(str, sizes)), *(f"{name}|{call}" for name, call in calls.items())]
    ran = subprocess.run([sys.executable, "-c", SCRIPT, *given], env=plain, capture_output=True, text=True, timeout=600)
    assert ran.returncode == 0, ran.stderr[-3000:]
    return [line.split(" | ") for line in ran.stdout.splitlines()]


@pytest.mark.skipif(sys.platform != "linux", reason="limits of the address space are of Linux")
def test_kernels_that_find_no_room_say_so():
    lines = run(KERNELS, MEGABYTES)
    assert len(lines) == len(KERNELS) * len(MEGABYTES)
    bad = [line for line in lines if line[2] != "0" or line[3] not in ("done", "LimitExceeded", "MemoryError")]
    assert not bad, bad
    # Each was refused once, and each had room enough at last.
    assert {line[0] for line in lines if line[3] == "LimitExceeded"} == KERNELS.keys()
    assert {line[0] for line in lines if line[3] == "done"} == KERNELS.keys()

"""Exhausted memory: each kernel, in processes with a limited address space, ends by an exception."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

MEGABYTES = (1, 8, 32, 96, 256)
"""Megabytes that a process may grow by.

Memory that a kernel frees does not help it, because it is the first in its process.
"""
KERNELS = {
    "poisson": "_rust.poisson(image, (image, image), 0.01, ('free', 'free'), None, None)",
    "poisson in a disc": "_rust.poisson(image, None, 0.01, ('free', 'free'), disc, None)",
    "patch_search": "_rust.PatchIndex([image], [None], (64, 64))",
    "ncc": "_rust.Correlation(image)",
    "mean_shift": "_rust.mean_shift(image, 1, 0.1, 1, 1.0, (False, False), None)",
    "reconstruction": "_rust.reconstruct(one, one, (False, False))",
    "regions": "_rust.merge_regions(image, 0.2, 0.4, 24, (False, False), None)",
    "seam": "_rust.seam_cut(image, other, whole, whole, None, disc, None, None, 'gradient', (False, False))",
    "labels": "_rust.seam_labels(two, (one, one), (one, one), (False, False))",
    "strip": "_rust.seam_strips([(image, other, 1, None)], False, 'gradient')",
    "distance": "_rust.outlines(disc.astype(np.int32), [(1, (0, 0), (1024, 1024))])",
    "complete": "_rust.complete(*hole, patches, *plain, (16, 16), (3, 2, 3.0), 0, False, None, None, None)",
    "complete in step": "_rust.complete(*hole, itself, *plain, (16, 16), (3, 2, 3.0), 0, False, 0, studs, None)",
    "complete as printed": "_rust.complete(*hole, patches, (True,) * 2, (16, 16), (1, 0, 9), 0, True, None, None, None)",
    "appearance": "_rust.Appearance(small, (256, 256), (False, False), 2)",
    "blocks": "looks.blocks(region, still, 16, 1, 1, 0.5, 0.5, 0.1, 1, 0, none, no_places, None, None)",
    "optimize": "looks.correct(start, region, still, none, 1, 0, False, 1, 0.1, 0.1, 1, 0.0, 1, None, None)",
    "coherence": "_rust.similar(_rust.Appearance(small, (256, 256), (False, False), 1), 2, 7, 8, None)",
    "coherence, a pass": "_rust.cohere(looks, sets, 2, start, region, still, none, (bytes_, bytes_), 1, 8, False, None)",
    "pyramid": "_rust.upsample(start, region, ((2 * side, 2 * side), (0, 0), (False, False)), still)",
    "jitter": "_rust.jitter(start, region, none, 4096, 1, 0)",
    "stitcher's source": "_rust.Stitcher(flat, (side, side), (False, False), numbers, depth, bytes_, no_costs)",
    "stitcher": "source.stitch(half, still, patch, weights, (0.1, 4.0, 1.0), 1, none, no_places, none, None, None, None)",
    "quilt": "_rust.quilt([(image, None, (0, 0))], pixels, patches_of, patched, begin, [], None)",
    "stitcher of samples": "_rust.PatchSamples(flat, np.zeros(side * side, np.float32), (0.1, 0.1))",
    "sparse": "_rust.Cholesky(*matrix, 1 << 32)",
    "gather": "_rust.gather([image], (False, False), np.zeros(0, np.uint16), points, 'linear')",
    "nearby": "_rust.sum_nearby(corner, np.ones(1, np.float32), (side, side), True, (1.0, 0.5))",
    "smooth": "_rust.smooth(image.reshape(-1), image.shape, [((0.5, 0.25), 'reflect')] * 2 + [((), 'reflect')])",
    "contours": "_rust.contour_strength(words, 64, 30.0)",
    "watershed": "_rust.watershed_regions(one, 2)",
    "adjacency": "_rust.region_adjacency(words.astype(np.uint32), one, 1 << 18, 0.5)",
    "candidates": "_rust.region_candidates(area, colour, pairs, borders, area < 0, [(1, 0, 0)] * 8, 4, 4000)",
    "measures": "_rust.measure_regions(starts, members, pairs, edges, leaf_words, extremes)",
    "sums": "_rust.sum_regions(starts, members, np.ones((len(area), 256)))",
    "disjoint sets": "_rust.choose_disjoint(tops, places_of, worth, worth, 4)",
    "outlines": "_rust.refine_outlines(disc.astype(np.int32), image[..., 0].copy(), one, 0.5, [0, 24])",
    "place": "_rust.place(one, (0, 0), (512, 512), ((1, 0.1), (0, 1)), (0.5, 0), (side, side), 1.0)",
    "points": "_rust.warp_points(corners, corners, (side, side))",
    "warp": "_rust.warp_mesh((side, side), places.reshape(-1, 2), np.zeros(side * side, np.uint8), (side, side), None)",
}
SCRIPT = """
import os, re, resource, sys
import numpy as np, texrs
from scipy.sparse import diags_array
from texrs import _rust
from texrs.kernels.sparse import _list_entries
from texrs.errors import TexrsError

side = 1024
rng = np.random.default_rng(0)
image, other = (rng.random((side, side, 3), dtype=np.float32) for _ in range(2))
one, two = np.full((side, side), 0.2, np.float32), np.ascontiguousarray(image[..., :2])
row, column = np.mgrid[:side, :side]
disc = (row - side / 2) ** 2 + (column - side / 2) ** 2 < (0.4 * side) ** 2
whole = np.ones((side, side), bool)
places = np.stack([row, column], -1).astype(np.float64)
points = places.reshape(-1, 2).astype(np.float32)
holes = np.ones((side, side), bool)
holes[40:60, 40:60] = False
patches = _rust.PatchIndex([image[:64, :64].copy()], [None], (16, 16))
itself = _rust.PatchIndex([image], [None], (16, 16))
hole, plain, studs = (image, holes, None), ((False, False),), [[30, 0], [0, 30]]
flat = image.reshape(-1, 3)
small = image[:256, :256].reshape(-1, 3)
looks = _rust.Appearance(image[:32, :32].reshape(-1, 3), (32, 32), (False, False), 2)
region, still = ((side, side), (0, 0), (False, False)), np.array([[[4096, 0], [0, 4096]]], np.int16)
half = ((512, 512), (0, 0), (False, False))
none, no_places, bytes_ = np.zeros(0, bool), np.zeros(0, np.int32), np.zeros(0, np.uint8)
no_costs, numbers, depth = np.zeros(0, np.float32), np.zeros(0, np.uint32), np.zeros(0, np.float32)
start = (rng.random(side * side * 2) * 32 * 4096).astype(np.int32)
sets = _rust.similar(looks, 2, 7, 8, None)
source = _rust.Stitcher(image[:96, :96].reshape(-1, 3), (96, 96), (False, False), numbers, depth, bytes_, no_costs)
patch, weights = (64.0, 0.2, 1, 0.0, False, False), (0.1, 1.0, 1.0, 0.15, 0.5, 0.0, 0.0, 0.03, 0.5)
corner, corners = np.zeros((1, 2), np.int64), np.array([(0, 0), (0, side - 1), (side - 1, 0), (side - 1, side - 1.0)])
many = side * side
pixels = (np.zeros(many, np.uint16), points, np.zeros(many, bool), np.zeros(many, np.uint32))
patches_of, begin = _rust.PatchSamples(flat, np.zeros(many, np.float32), (0.1, 0.1)), (((0, 64, 0, 0),) * 2, 0, (0, 0))
patched = ((side, side), (False, False), (64, 64), False, None)
matrix = [each for each in _list_entries(diags_array([-1.0, 4.1, -1.0], offsets=[-128, 0, 128], shape=(side * 64,) * 2))]
words = rng.integers(0, 64, (side, side), np.uint8)
leaves, count = _rust.watershed_regions(image[..., 0].copy(), 2)
pairs, edges, extremes = _rust.region_adjacency(leaves, one, count, 0.5)
area, colour, borders = np.bincount(leaves.ravel()).astype(float), rng.random((count, 3)), edges[:, :2].copy()
leaf_words = np.ones((count, 8), np.float32)
starts, members, _ = _rust.region_candidates(area, colour, pairs, borders, area < 0, [(0, 1, 0)], 4, 1000)
tops, places_of, worth = np.arange(many + 1), np.arange(many, dtype=np.uint32), rng.random(many)
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
    # Return freed memory to the system, so that it cannot be used again.
    plain |= {"MALLOC_MMAP_THRESHOLD_": "131072", "MALLOC_TRIM_THRESHOLD_": "131072"}
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
    # Each kernel ran out of memory at least once, and finished at least once.
    assert {line[0] for line in lines if line[3] == "LimitExceeded"} == KERNELS.keys()
    assert {line[0] for line in lines if line[3] == "done"} == KERNELS.keys()

"""Exact nearest neighbours of appearance vectors in 8 dimensions, against SciPy's k-d tree and FAISS' flat index.

python benches/neighbours_vs_peers.py [rounds]

For each pixel of a texture the nearest other one, in the whole of it: what similarity sets are made of. All take the
same vectors, build what they need, and use two threads. Rounds are interleaved; seconds of processors hang less on what
else the machine does. FAISS is left out where it is not installed (pip install faiss-cpu).
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree
from skimage import data

from texrs import samples, threads
from texrs._engine.appearance import Appearance
from texrs._engine.coherence import find_similar

try:
    import faiss
except ImportError:
    faiss = None

BORDER = 2
"""Pixels along the border whose windows do not lie inside."""


def measured(work: Callable[[], np.ndarray]) -> tuple[float, float, np.ndarray]:
    """Return seconds on the clock, seconds of CPU, and what the work gives."""
    start = time.perf_counter(), time.process_time()
    result = work()
    return time.perf_counter() - start[0], time.process_time() - start[1], result


def case(name: str, image: np.ndarray, rounds: int) -> None:
    side = image.shape[0]
    appearance = Appearance(image.astype(np.float32) / 255, axes=2)
    inner = slice(BORDER, side - BORDER)
    vectors = appearance.arrays()["features"].reshape(side, side, -1)[inner, inner, :8].reshape(-1, 8)
    doubles, singles = np.ascontiguousarray(vectors, np.float64), np.ascontiguousarray(vectors, np.float32)

    def ours() -> np.ndarray:
        with threads(2):
            return find_similar(appearance, k=2, n=1).sets

    def tree() -> np.ndarray:
        return cKDTree(doubles).query(doubles, k=2, workers=2)[0][:, 1]

    def flat() -> np.ndarray:
        faiss.omp_set_num_threads(2)
        index = faiss.IndexFlatL2(8)
        index.add(singles)
        return np.sqrt(np.maximum(index.search(singles, 2)[0][:, 1], 0))

    tasks = {"texrs": ours, "cKDTree": tree} | ({"FAISS flat": flat} if faiss is not None else {})
    walls: dict[str, list[float]] = {task: [] for task in tasks}
    works: dict[str, list[float]] = {task: [] for task in tasks}
    results = {}
    for number in range(rounds):
        for task, work in tasks.items():
            if task == "FAISS flat" and number >= 2:
                continue
            wall, cpu, results[task] = measured(work)
            walls[task].append(wall)
            works[task].append(cpu)
    places = np.arange(side * side).reshape(side, side)[inner, inner].ravel()
    features = appearance.arrays()["features"].reshape(side * side, -1)[:, :8].astype(np.float64)
    apart = np.sqrt(((features[results["texrs"][places, 1]] - features[places]) ** 2).sum(axis=1))
    same = np.allclose(apart, results["cKDTree"], atol=1e-6)
    row = "  ".join(
        f"{task} {1e3 * min(walls[task]):.0f} ms ({min(walls[task]) / min(walls['texrs']):.1f}x, "
        f"CPU {min(works[task]) / max(min(works['texrs']), 1e-9):.1f}x)"
        for task in tasks
    )
    print(f"{name} {side}^2, {len(vectors)} points: {row}; same distances: {same}", flush=True)


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 7
    for length in (128, 256):
        case("grass", data.grass()[:length, :length], count)
        case("brick", data.brick()[:length, :length], count)
        case("pebbles", samples.load("pebbles", size=(length, length)).image, count)

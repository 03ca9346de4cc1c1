"""Exact nearest windows in 30 dimensions, against SciPy's k-d tree and FAISS' flat index.

python benches/window_search_vs_peers.py [rounds] [--pictures GLOB]

Windows of 8 x 8 pixels of a picture of 160^2, in the axes of their 30 leading principal components. Two tasks: for each
window the nearest other one, and for each window of another part of the picture (every second row and column, as PERSPECTIVE
as printed searches them) the nearest one. All take the same vectors, build what they need, and use two threads. Rounds are
interleaved; CPU seconds do not hang on what else the machine does. FAISS is left out where it is not installed
(pip install faiss-cpu).
"""

from __future__ import annotations

import argparse
import glob
import os
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from texrs import _threads as threads
from texrs import io, samples
from texrs._arrays import to_unit
from texrs.kernels.nearest import Nearest

try:
    import faiss
except ImportError:
    faiss = None

SIDE, WINDOW, KEEP = 160, 8, 30


def measured(work: Callable[[], np.ndarray]) -> tuple[float, float, np.ndarray]:
    """Return seconds on the clock, seconds of CPU, and what the work gives."""
    before, start = os.times(), time.perf_counter()
    result = work()
    wall, after = time.perf_counter() - start, os.times()
    return wall, after.user - before.user + after.system - before.system, result


def windows(image: np.ndarray, spacing: int) -> np.ndarray:
    every = np.lib.stride_tricks.sliding_window_view(image, (WINDOW, WINDOW), axis=(0, 1))[::spacing, ::spacing]
    return every.reshape(every.shape[0] * every.shape[1], -1)


def vectors_of(image: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the vectors of the picture's first part and of its last, and the share of the variance that they keep."""
    top = (image.shape[0] - SIDE) // 2
    first, last = image[top : top + SIDE, :SIDE], image[top : top + SIDE, -SIDE:]
    mine, theirs = windows(first, 1), windows(last, 2)
    mean = mine.mean(axis=0)
    spread, axes = np.linalg.eigh(np.cov((mine - mean).T))
    basis = axes[:, ::-1][:, :KEEP]
    return (mine - mean) @ basis, (theirs - mean) @ basis, float(spread[-KEEP:].sum() / spread.sum())


def flat(vectors: np.ndarray, queries: np.ndarray, k: int) -> np.ndarray:
    faiss.omp_set_num_threads(2)
    index = faiss.IndexFlatL2(vectors.shape[1])
    index.add(vectors)
    found = index.search(queries, k)[1]
    return found[:, 0] if k == 1 else other(found)


def other(pairs: np.ndarray) -> np.ndarray:
    """Give, of the two windows found for each window, the one that is not itself: it need not be the first."""
    return np.where(pairs[:, 1] == np.arange(len(pairs)), pairs[:, 0], pairs[:, 1])


def ours(vectors: np.ndarray, queries: np.ndarray | None) -> np.ndarray:
    with threads(2):
        nearest = Nearest(vectors)
        return (nearest.others() if queries is None else nearest.query(queries)).which


def distances(vectors: np.ndarray, queries: np.ndarray, found: np.ndarray) -> np.ndarray:
    return np.sqrt(((vectors[found] - queries) ** 2).sum(axis=1))


def compared(name: str, tasks: dict[str, Callable[[], np.ndarray]], rounds: int, apart: Callable) -> list[float]:
    """Print times by task, and give how many times the first one's CPU the others take."""
    works: dict[str, list[float]] = {task: [] for task in tasks}
    walls: dict[str, list[float]] = {task: [] for task in tasks}
    results = {}
    for _ in range(rounds):
        for task, work in tasks.items():
            wall, cpu, results[task] = measured(work)
            walls[task].append(wall)
            works[task].append(cpu)
    mine = apart(results["texrs"])
    # FAISS adds in single precision, so that of windows as good as equal it may find another, which is a little farther.
    off = {task: apart(r) - mine for task, r in results.items()}
    same = np.abs(off["cKDTree"]).max() <= 1e-9 and all(o.min() >= -1e-9 for o in off.values())
    off_by = f"; FAISS finds windows farther by up to {off['FAISS flat'].max():.1e}" if "FAISS flat" in off else ""
    ratios = [sum(works[task]) / max(sum(works["texrs"]), 1e-9) for task in tasks]
    row = "  ".join(
        f"{task} {1e3 * min(walls[task]):.0f} ms ({min(walls[task]) / min(walls['texrs']):.1f}x, CPU {ratio:.1f}x)"
        for task, ratio in zip(tasks, ratios, strict=True)
    )
    print(f"{name}: {row}; same distances: {same}{off_by}", flush=True)
    return ratios


def case(name: str, image: np.ndarray, rounds: int) -> list[list[float]]:
    mine, theirs, kept = vectors_of(np.asarray(image, np.float64))
    mine, theirs = np.ascontiguousarray(mine), np.ascontiguousarray(theirs)
    singles = mine.astype(np.float32), theirs.astype(np.float32)
    print(f"{name}: {len(mine)} windows, {kept:.1%} of their variance")
    others = {"texrs": lambda: ours(mine, None), "cKDTree": lambda: other(cKDTree(mine).query(mine, k=2, workers=2)[1])}
    second = {"texrs": lambda: ours(mine, theirs), "cKDTree": lambda: cKDTree(mine).query(theirs, workers=2)[1]}
    if faiss is not None:
        others["FAISS flat"] = lambda: flat(singles[0], singles[0], 2)
        second["FAISS flat"] = lambda: flat(singles[0], singles[1], 1)
    return [
        compared("  nearest other", others, rounds, lambda found: distances(mine, mine, found)),
        compared(f"  nearest of {len(theirs)} elsewhere", second, rounds, lambda found: distances(mine, theirs, found)),
    ]


def main() -> None:
    """Print a line a picture and task, and the geometric means."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rounds", type=int, nargs="?", default=3)
    parser.add_argument("--pictures", default="", help="files to search windows of, each side at least 160")
    asked = parser.parse_args()
    pictures = {Path(f).stem: to_unit(io.read(f))[..., :3] for f in sorted(glob.glob(asked.pictures))}
    if not pictures:
        pictures = {n: to_unit(samples.load(n, size=(200, 320)).image) for n in ("pebbles", "tilted_discs", "bricks")}
    ratios = [case(name, image, asked.rounds) for name, image in pictures.items()]
    for number, task in enumerate(("nearest other", "nearest elsewhere")):
        mean = np.exp(np.log([r[number] for r in ratios]).mean(axis=0))
        print(f"{task}, CPU seconds of cKDTree and FAISS flat by ours: {', '.join(f'{m:.1f}x' for m in mean[1:])}")


if __name__ == "__main__":
    main()

"""Measure the time of a splice, and the growth of time and memory with the size.

    python benches/splice_speed.py [SIDE ...]
    python benches/splice_speed.py growth [SIDE ...]

The similarity sets are computed in advance. "cold": nothing else is cached. "cached": the factor and the parts of
elements are. The side of the system includes the margin. "growth" analyses and splices larger and larger images, of
disjoint elements and of a wall. Each has its own process, whose peak memory is printed. There, the similarity sets are
part of a splice.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import time
from collections.abc import Callable

import numpy as np
from scipy.ndimage import binary_erosion

import texrs
from texrs import samples
from texrs.elements import ElementAnalysis, analyse
from texrs.kernels.warp import mesh
from texrs.papers.splice import factors
from texrs.papers.splice.entry import CACHES

ROUNDS = 5


def entry(name: str, side: int) -> ElementAnalysis:
    return ElementAnalysis.of_sample(samples.load(name, size=(side, side)))


def best(
    work: Callable[[], object], before: Callable[[], object] = lambda: None, rounds: int = ROUNDS
) -> tuple[float, float]:
    """Return the minimum wall time, and the minimum time of all processors, in milliseconds."""
    found = []
    for _ in range(rounds):
        before()
        start = time.perf_counter(), time.process_time()
        work()
        found.append((time.perf_counter() - start[0], time.process_time() - start[1]))
    wall, busy = zip(*found, strict=True)
    return 1e3 * min(wall), 1e3 * min(busy)


def forget() -> None:
    factors._FACTORS.clear()
    for cache in CACHES:
        cache.clear()


def splices(sides: list[int]) -> None:
    print("splice            side  system   cold ms (processors)   cached ms (processors)   preview, cached")
    for side in sides:
        for a, b in (("dots", "pebbles"), ("net", "pebbles"), ("bricks", "pebbles")):
            if a == "net" and side > 256:
                continue
            mine, theirs = entry(a, side), entry(b, side)

            def work(mine: ElementAnalysis = mine, theirs: ElementAnalysis = theirs) -> texrs.Synthesis:
                return texrs.splice(mine, theirs, seed=1)

            # Textures composed of cells or knots have no system to solve, so their report lacks its size.
            system = work().report.get("system", [0])
            cold, cached = best(work, forget), best(work)
            preview = best(lambda mine=mine, theirs=theirs: texrs.splice(mine, theirs, seed=1, method="preview"))
            times = "   ".join(f"{wall:8.1f} ({busy:8.1f})" for wall, busy in (cold, cached, preview))
            print(f"{a + '/' + b:16s} {side:5d}  {system[0]:4d}^2  {times}", flush=True)


def warps() -> None:
    side = 512
    grid = np.moveaxis(np.indices((side, side)), 0, -1) * 1.0
    target = grid + 3 * np.sin(grid / 9)
    weight = np.random.default_rng(0).random((side, side)) < 0.4
    wall, busy = best(lambda: mesh(target, weight), rounds=20)
    print(f"\ndense warp of {side}^2: {wall:.1f} ms ({busy:.1f} of processors)")


def grown(what: str, side: int) -> None:
    """Process an image of one side. Return the time and the peak memory."""
    mine = entry("bricks" if what == "wall" else "dots", side)
    theirs = entry("pebbles", side) if what in ("splice", "wall") else mine
    middle = np.abs(mine.points - side / 2).sum(axis=1).argmin()
    before = resource.getrusage(resource.RUSAGE_SELF)
    if what in ("splice", "wall"):
        texrs.splice(mine, theirs, seed=1)
    elif what == "similarity":
        mine.similarity()
    else:
        background = np.argwhere(binary_erosion(~mine.mask, iterations=4))[:1]
        analyse(mine.image, box=(*mine.points[middle], *mine.box), background=background, layout="disjoint")
    after = resource.getrusage(resource.RUSAGE_SELF)
    busy = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(f"{what:12s} {side:5d}^2 {busy:8.2f} s of processors, {after.ru_maxrss / 1024:7.0f} MB at most", flush=True)


if __name__ == "__main__":
    words = sys.argv[1:]
    if words[:1] == ["grown"]:
        grown(words[1], int(words[2]))
    elif words[:1] == ["growth"]:
        for work in ("analyse", "similarity", "splice", "wall"):
            for length in words[1:] or ["256", "512", "1024", "2048"]:
                subprocess.run([sys.executable, __file__, "grown", work, length], check=True)
    else:
        asked = [int(x) for x in words] or [128, 192, 256, 512]
        splices(asked)
        warps()

"""How long a splice takes, and its factorisation against other solvers.

    python benches/splice_speed.py [SIDE ...]

The similarity sets are made beforehand. "cold": nothing else is kept; "cached": the factor and the texels' parts are. The
system's side includes the margin. SciPy's splu is asked for its symmetric mode, on the same matrix, in turns with ours.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np
from scipy.sparse.linalg import splu

import texrs
from texrs import samples
from texrs.kernels.sparse import Cholesky
from texrs.kernels.warp import mesh
from texrs.papers import _splice_layout, _splice_source, _splice_warp
from texrs.papers._splice_warp import energy
from texrs.texels import Texels

ROUNDS = 5


def entry(name: str, side: int) -> Texels:
    return Texels.of_sample(samples.load(name, size=(side, side)))


def best(
    work: Callable[[], object], before: Callable[[], object] = lambda: None, rounds: int = ROUNDS
) -> tuple[float, float]:
    """Give the least time that passed, and the least time of all processors, in milliseconds."""
    found = []
    for _ in range(rounds):
        before()
        start = time.perf_counter(), time.process_time()
        work()
        found.append((time.perf_counter() - start[0], time.process_time() - start[1]))
    wall, busy = zip(*found, strict=True)
    return 1e3 * min(wall), 1e3 * min(busy)


def forget() -> None:
    _splice_warp._FACTORS.clear()
    _splice_source._PARTS.clear()
    _splice_source._EXTENDED.clear()
    _splice_source._FOLDED.clear()
    _splice_layout._DIRECTIONS.clear()
    _splice_layout._LAYOUTS.clear()
    _splice_layout._REACHES.clear()


def splices(sides: list[int]) -> None:
    print("splice            side  system   cold ms (processors)   cached ms (processors)")
    for side in sides:
        for a, b in (("dots", "pebbles"), ("net", "pebbles"), ("bricks", "pebbles")):
            if a != "dots" and side > 256:
                continue
            mine, theirs = entry(a, side), entry(b, side)

            def work(mine: Texels = mine, theirs: Texels = theirs) -> texrs.Synthesis:
                return texrs.splice(mine, theirs, seed=1)

            system = work().report["system"]
            cold, cached = best(work, forget), best(work)
            times = "   ".join(f"{wall:8.1f} ({busy:8.1f})" for wall, busy in (cold, cached))
            print(f"{a + '/' + b:16s} {side:5d}  {system[0]:4d}^2  {times}", flush=True)


def solvers(sides: list[int]) -> None:
    print("\nEq. 5, 13 points: factor + two solves, ms of a processor   ours     splu   ratio")
    for side in sides:
        sample = samples.load("net", size=(side, side))
        assert sample.mask is not None
        assert sample.centres is not None
        at = np.rint(sample.centres).astype(np.intp)
        matrix = energy(sample.mask, at[:, 0] * side + at[:, 1], 1, upright=False)
        right = np.random.default_rng(0).standard_normal((side * side, 2))
        options = {"SymmetricMode": True}
        ours, theirs = [], []
        for _ in range(2 if side > 300 else ROUNDS):
            ours.append(best(lambda: Cholesky(matrix).solve(right), rounds=1)[1])
            theirs.append(
                best(
                    lambda: splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0, options=options).solve(right),
                    rounds=1,
                )[1]
            )
        print(f"{side:4d}^2 {min(ours):47.1f} {min(theirs):8.1f} {min(theirs) / min(ours):7.2f}", flush=True)


def warps() -> None:
    side = 512
    grid = np.moveaxis(np.indices((side, side)), 0, -1) * 1.0
    target = grid + 3 * np.sin(grid / 9)
    weight = np.random.default_rng(0).random((side, side)) < 0.4
    wall, busy = best(lambda: mesh(target, weight), rounds=20)
    print(f"\ndense warp of {side}^2: {wall:.1f} ms ({busy:.1f} of processors)")


if __name__ == "__main__":
    asked = [int(x) for x in sys.argv[1:]] or [128, 192, 256, 512]
    splices(asked)
    solvers(asked)
    warps()

"""Rows 1 to 3: SPLICE compared with the numbers of the paper, and its linear systems.

CHOLMOD, of CVXOPT, is under the GPL, so it is never in the same process as texrs.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from frame import Arrays, Row, Side, Work, is_worse


def make_system(side: int, printed: bool) -> dict[str, Any]:
    """Return the normal matrix of Eq. 5, as texrs solves it or as printed, where only discs are kept together."""
    from scipy.sparse import tril

    from texrs import samples
    from texrs.papers.splice.energy import make_energy_matrix

    sample = samples.load("dots" if printed else "net", size=(side, side))
    at = np.rint(sample.centres).astype(np.intp)
    pins = at[:, 0] * side + at[:, 1]
    matrix = print_matrix(sample.mask, pins) if printed else make_energy_matrix(sample.mask, pins, 1, upright=False)
    lower = tril(matrix).tocoo()
    right = np.random.default_rng(0).standard_normal((side * side, 2))
    return {"data": lower.data, "row": lower.row, "column": lower.col, "right": right}


def print_matrix(rigid: np.ndarray, pins: np.ndarray) -> Any:
    """Return lambda_G P + lambda_R (I - U)' M (I - U), with the mean U of four neighbours, made definite."""
    from scipy.sparse import diags_array, eye_array, kron

    side = len(rigid)
    path = diags_array([np.ones(side - 1)] * 2, offsets=[-1, 1])
    beside = kron(eye_array(side), path) + kron(path, eye_array(side))
    residual = eye_array(side * side) - diags_array(1 / beside.sum(axis=1)) @ beside
    pinned = np.zeros(side * side)
    pinned[pins] = 1e4
    return diags_array(pinned + 1e-6) + 1e2 * residual.T @ diags_array(rigid.ravel() * 1.0) @ residual


def _matrix(given: Arrays) -> Any:
    from scipy.sparse import csc_array, tril

    n = len(given["right"])
    lower = csc_array((given["data"], (given["row"], given["column"])), (n, n))
    return (lower + tril(lower, -1).T).tocsc()


def solve_by_texrs(given: Arrays) -> Work:
    """Factor, and solve for two right sides."""
    from texrs.kernels.sparse import Cholesky

    matrix = _matrix(given)
    return lambda: Cholesky(matrix).solve(given["right"])


def solve_by_scipy(given: Arrays) -> Work:
    """Use SuperLU with the option for symmetric matrices."""
    from scipy.sparse.linalg import splu

    matrix, options = _matrix(given), {"SymmetricMode": True}
    ready = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0, "options": options}
    return lambda: splu(matrix, **ready).solve(given["right"])


def solve_by_cholmod(given: Arrays) -> Work:
    """Use CHOLMOD of CVXOPT: symbolic and numeric factor, and two right sides."""
    import cvxopt
    from cvxopt import cholmod

    parts = (given["data"], given["row"].astype(np.int64), given["column"].astype(np.int64))
    n = len(given["right"])
    matrix = cvxopt.spmatrix(*map(cvxopt.matrix, parts), (n, n))

    def work() -> np.ndarray:
        sides = cvxopt.matrix(given["right"])
        factor = cholmod.symbolic(matrix)
        cholmod.numeric(matrix, factor)
        cholmod.solve(factor, sides)
        return np.array(sides)

    return work


def _with(side: Side) -> Side:
    """Compute the error of a solution once, when results are compared."""

    def ready(given: Arrays) -> Work:
        work = side(given)
        return lambda: (given, work())

    return ready


def measure_error(result: Any) -> list[float]:
    """Return the relative change of the system for which the solution would be exact."""
    given, solution = result
    matrix, right = _matrix(given), given["right"]
    size = abs(matrix).sum(axis=1).max() * np.abs(solution).max() + np.abs(right).max()
    return [float(np.abs(matrix @ solution - right).max() / size)]


def make_nothing() -> dict[str, Any]:
    """Return no arrays, because samples are loaded by name."""
    return {}


def splice_by_texrs(side: int, cold: bool, method: str | None) -> Side:
    """Splice elements of one texture into the layout of another. Compute similarity sets in advance, as in the paper."""

    def ready(given: Arrays) -> Work:
        import texrs
        from texrs import samples
        from texrs.elements import ElementAnalysis
        from texrs.papers.splice import factors
        from texrs.papers.splice.entry import CACHES

        mine, theirs = (
            ElementAnalysis.of_sample(samples.load(name, size=(side, side))) for name in ("dots", "pebbles")
        )
        mine.similarity()

        def work() -> np.ndarray:
            if cold:
                factors._FACTORS.clear()
                for cache in CACHES:
                    cache.clear()
            return texrs.splice(mine, theirs, seed=1, method=method).image

        work()
        return work

    return ready


PAPER = "Liu et al. 2009, Core 2 Duo, 2.66 GHz"
ROWS = {
    **{
        f"splice-{side}{'-again' * (not cold)}{f'-{method}' if method else ''}": Row(
            "1" if cold else "2",
            f"a splice of {side}² {f'by method={method!r}' if method else 'by default'}, "
            f"{'only similarity sets cached' if cold else 'factors cached'}",
            "the right size",
            make_nothing,
            {"texrs": splice_by_texrs(side, cold, method)},
            lambda result: [float(n) for n in np.shape(result)],
            asked={PAPER: 50 if cold else 250},
            published={PAPER: published},
        )
        for side, cold, published in ((128, True, 1400.0), (192, True, 2900.0), (128, False, 1400.0))
        for method in ("paper", "preview", None)
    },
    **{
        f"warp-{side}{'-printed' * printed}": Row(
            "3",
            f"a splice's warp field, {side}², {'as printed, for discs' if printed else 'as in texrs'}: factor, solve twice",
            "backward errors below 10⁻¹²",
            lambda side=side, printed=printed: make_system(side, printed),
            {"texrs": _with(solve_by_texrs), "CHOLMOD": _with(solve_by_cholmod), "SciPy": _with(solve_by_scipy)},
            measure_error,
            is_worse,
            1e-12,
            asked={"CHOLMOD": 2},
        )
        for side in (128, 192)
        for printed in (True, False)
    },
}

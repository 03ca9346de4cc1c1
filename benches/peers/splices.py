"""Rows 1 to 3: SPLICE beside what the paper says, and its linear systems.

CHOLMOD, of CVXOPT, is under the GPL: it never is where texrs is.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from frame import Arrays, Row, Side, Work, is_worse


def make_system(side: int, printed: bool) -> dict[str, Any]:
    """Eq. 5's normal matrix: as texrs solves it, or as printed, where nothing but discs is held together."""
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
    """lambda_G P + lambda_R (I - U)' M (I - U), U the mean of four neighbours, and what makes it definite."""
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
    """Factored, and solved for two right sides."""
    from texrs.kernels.sparse import Cholesky

    matrix = _matrix(given)
    return lambda: Cholesky(matrix).solve(given["right"])


def solve_by_scipy(given: Arrays) -> Work:
    """SuperLU, told that the matrix is symmetric."""
    from scipy.sparse.linalg import splu

    matrix, options = _matrix(given), {"SymmetricMode": True}
    ready = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0, "options": options}
    return lambda: splu(matrix, **ready).solve(given["right"])


def solve_by_cholmod(given: Arrays) -> Work:
    """CHOLMOD, as CVXOPT has it: symbolic and numeric factor, and two right sides."""
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
    """How right a solution is is worked out once, when results are compared."""

    def ready(given: Arrays) -> Work:
        work = side(given)
        return lambda: (given, work())

    return ready


def measure_error(result: Any) -> list[float]:
    """Return how much the system would have to change for the solution to be exact, as a share of it."""
    given, solution = result
    matrix, right = _matrix(given), given["right"]
    size = abs(matrix).sum(axis=1).max() * np.abs(solution).max() + np.abs(right).max()
    return [float(np.abs(matrix @ solution - right).max() / size)]


def make_nothing() -> dict[str, Any]:
    """Samples are made by name."""
    return {}


def splice_by_texrs(side: int, cold: bool, method: str | None) -> Side:
    """Elements of one texture laid out as those of another; similarity sets are made beforehand, as in the paper."""

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

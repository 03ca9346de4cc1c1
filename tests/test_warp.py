"""Warps of meshes and of points: they agree where both apply, and refuse unsuitable input."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import texrs
from texrs.errors import InvalidInput
from texrs.kernels.sparse import Cholesky
from texrs.kernels.warp import from_points, mesh


def grid(rows: int, columns: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.moveaxis(np.indices((rows, columns)), 0, -1).astype(float)


def slow(target: Any, weight: Any, size: tuple[int, int]) -> tuple[Any, Any]:
    """Compute every triangle over every pixel: the heaviest wins, then the unturned, then the first."""
    rows, columns = target.shape[:2]
    best = np.zeros(size, int)
    found = np.zeros((*size, 2))
    pixels = grid(*size)
    for y in range(rows - 1):
        for x in range(columns - 1):
            for half in (((0, 0), (0, 1), (1, 0)), ((0, 1), (1, 1), (1, 0))):
                corners = np.array([(y + i, x + j) for i, j in half])
                a, b, c = target[tuple(corners.T)]
                area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
                if abs(area) < 1e-9:
                    continue
                away = pixels - a
                u = (away[..., 0] * (c[1] - a[1]) - away[..., 1] * (c[0] - a[0])) / area
                v = ((b[0] - a[0]) * away[..., 1] - (b[1] - a[1]) * away[..., 0]) / area
                rank = 1 + 2 * int(weight[tuple(corners.T)].sum()) + int(area < 0)
                here = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9) & (rank > best)
                best[here] = rank
                found[here] = (
                    (1 - u - v)[..., None] * corners[0] + u[..., None] * corners[1] + v[..., None] * corners[2]
                )[here]
    return found, best > 0


@given(st.integers(0, 10_000), st.floats(0, 3))
def test_meshes_are_those_of_the_slow_twin(seed: int, amount: float) -> None:
    random = np.random.default_rng(seed)
    target = grid(9, 11) + random.uniform(-amount, amount, (9, 11, 2))
    weight = random.integers(0, 2, (9, 11)).astype(np.uint8)
    wanted, covered = slow(target, weight, (10, 12))
    found = mesh(target, weight, size=(10, 12))
    assert (found.covered == covered).all()
    assert np.allclose(found.coordinates[covered], wanted[covered], atol=1e-4)


def test_both_warps_agree_where_both_apply() -> None:
    """A bend that is affine in each cell of a coarse lattice gives the same with pixel meshes and lattice triangles."""
    corners = grid(4, 4).reshape(-1, 2) * 15
    moved = corners @ np.array([[1.05, 0.1], [-0.08, 0.95]]) + (1.5, -2)
    loose = from_points(corners, moved, (46, 46))
    dense = mesh(grid(46, 46) @ np.array([[1.05, 0.1], [-0.08, 0.95]]) + (1.5, -2))
    both = (loose.triangle > 0) & dense.covered
    assert both.mean() > 0.7
    assert np.abs(loose.coordinates[both] - dense.coordinates[both]).max() < 1e-3
    # A single corner is raised, so only the triangles around it move.
    bent = corners.copy()
    bent[5] += (4, 3)
    loose = from_points(corners, bent, (46, 46))
    rest = loose.coordinates == grid(46, 46)
    assert rest.all(axis=-1).mean() > 0.5


def test_points_give_frames() -> None:
    corners = np.array([[0, 0], [0, 30], [30, 0], [30, 30.0]])
    found = from_points(corners, corners * 2, (31, 31), size=61)
    assert found.triangle.shape == (61, 61)
    assert np.allclose(found.frames[found.triangle][20, 20], np.eye(2) / 2)


def test_threads_do_not_matter() -> None:
    random = np.random.default_rng(0)
    target = grid(90, 70) + random.uniform(-2, 2, (90, 70, 2))
    weight = random.integers(0, 2, (90, 70)) > 0
    found = []
    for count in (1, 2, 7):
        with texrs.threads(count):
            found.append(mesh(target, weight).coordinates.tobytes())
    assert found[0] == found[1] == found[2]


def test_bad_warps() -> None:
    three = np.array([[0, 0], [0, 9], [9, 0.0]])
    for source, target, words in (
        (three[:2], three[:2], "three points"),
        (three, three[:2], "shape"),
        (three[[0, 0, 1]], three, "same place"),
        (np.array([[0, 0], [1, 1], [2, 2.0]]), three, "line"),
        (three, three * np.nan, "finite"),
        (["abc"], three, "must be real numbers"),
    ):
        with pytest.raises(InvalidInput, match=words):
            from_points(source, target, (10, 10))  # type: ignore[arg-type]
    with pytest.raises(InvalidInput, match="at least two"):
        mesh(np.zeros((1, 5, 2)))


# --- factors ---------------------------------------------------------------------------------------------------------


def test_factors_agree_with_scipy() -> None:
    from scipy.sparse.linalg import spsolve

    from texrs.papers.splice.energy import make_energy_matrix

    random = np.random.default_rng(0)
    rigid = random.random((24, 30)) < 0.4
    pins = random.choice(rigid.size, 12, replace=False)
    for axis in (0, 1):
        for upright in (False, True):
            matrix = make_energy_matrix(rigid, pins, axis, upright=upright)
            assert abs(matrix - matrix.T).max() < 1e-9
            right = np.zeros((rigid.size, 2))
            right[pins] = random.uniform(-1e4, 1e4, (12, 2)) * 5
            found = Cholesky(matrix).solve(right)
            assert np.abs(found - spsolve(matrix, right)).max() < 1e-4 * np.abs(found).max()


def test_several_factors_are_each_what_one_is() -> None:
    from scipy.sparse import diags_array

    matrices = [diags_array([-1.0, x, -1.0], offsets=[-1, 0, 1], shape=(40, 40)) for x in (2.5, 3.0, 4.0)]
    right = np.arange(40.0)
    for matrix, factor in zip(matrices, Cholesky.several(matrices), strict=True):
        assert (factor.solve(right) == Cholesky(matrix).solve(right)).all()
    with pytest.raises(InvalidInput, match="positive definite"):
        Cholesky.several([matrices[0], -matrices[1]])


def test_energy_is_that_of_the_paper() -> None:
    """Compare with Eq. 5, Table 1 and Figure 5 pixel by pixel, for the displacement along columns."""
    from texrs.papers.splice.energy import weigh_neighbours

    rigid = np.random.default_rng(3).random((7, 8)) < 0.5
    coupling, small = 0.25, 0.1

    def m(y: int, x: int) -> bool:
        inside = 0 <= y < 7 and 0 <= x < 8
        return bool(rigid[y, x]) if inside else True

    for axis in (0, 1):
        found = weigh_neighbours(rigid, axis, coupling, small)
        for y in range(7):
            for x in range(8):
                for k, (dy, dx) in enumerate(((-1, 0), (1, 0), (0, -1), (0, 1))):
                    qy, qx = y + dy, x + dx
                    if not (0 <= qy < 7 and 0 <= qx < 8):
                        assert found[k, y, x] == 0
                        continue
                    along = dx != 0 if axis == 1 else dy != 0
                    sides = ((0, -1), (0, 1)) if axis == 1 else ((-1, 0), (1, 0))
                    p, q = m(y, x), m(qy, qx)
                    edge = p and q and any(not m(y + i, x + j) and not m(qy + i, qx + j) for i, j in sides)
                    full = along or (not p and not q) or edge
                    assert found[k, y, x] == pytest.approx((1 if full else coupling) * (q + small))


def test_bad_matrices() -> None:
    from scipy.sparse import eye_array

    with pytest.raises(InvalidInput, match="positive definite"):
        Cholesky(-eye_array(4))

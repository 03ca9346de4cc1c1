"""Minimum cuts: values recomputed with NumPy, SciPy's maximum flow as reference, bad input."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array
from scipy.sparse.csgraph import maximum_flow

from texrs.errors import InvalidInput
from texrs.kernels import seam

SCALE = 65536


def noise(seed: int, shape: tuple[int, ...]) -> np.ndarray:
    return np.random.default_rng(seed).random(shape, np.float32)


def edge_costs(a, b, overlap, wrap, cost="gradient", penalty=None):
    """Return the cost of each pair (p, next of p) along each axis, 0 if it is not an edge of the overlap."""
    axes = overlap.ndim
    a, b = (i.reshape(*overlap.shape, -1).astype(np.float64) for i in (a, b))
    difference = np.abs(a - b).sum(-1)
    costs = []
    for axis in range(axes):
        after = [np.roll(i, -1, axis) for i in (a, b)]
        edge = difference + np.roll(difference, -1, axis)
        if cost == "gradient":
            edge /= np.abs(a - after[0]).sum(-1) + np.abs(b - after[1]).sum(-1) + 0.05
        edge += 1e-4
        if penalty is not None:
            edge *= 1 + (penalty + np.roll(penalty, -1, axis)) / 2
        edge[~(overlap & np.roll(overlap, -1, axis))] = 0
        if not wrap[axis] or overlap.shape[axis] == 1:
            edge[(slice(None),) * axis + (-1,)] = 0
        costs.append(edge)
    return costs


def cut_value(costs, mask):
    return sum(c[mask != np.roll(mask, -1, axis)].sum() for axis, c in enumerate(costs))


def beside(mask, wrap):
    """Return pixels that have a neighbour in the mask."""
    found = np.zeros_like(mask)
    for axis in range(mask.ndim):
        for step in (1, -1):
            moved = np.roll(mask, step, axis)
            if not wrap[axis]:
                moved[(slice(None),) * axis + (0 if step == 1 else -1,)] = False
            found |= moved
    return found


def least(costs, source, sink):
    """Return the minimum cut by SciPy, in cost units."""
    n = source.size
    index = np.arange(n).reshape(source.shape)
    capacity: dict[tuple[int, int], int] = {}

    def add(p, q, c):
        for i, j, w in zip(p.ravel(), q.ravel(), c.ravel(), strict=True):
            if w:
                capacity[int(i), int(j)] = capacity.get((int(i), int(j)), 0) + int(w)

    add(np.full_like(index, n), index, np.where(source, 2**30, 0))
    add(index, np.full_like(index, n + 1), np.where(sink, 2**30, 0))
    for axis, cost in enumerate(costs):
        units = np.round(cost * SCALE).astype(np.int64)
        add(index, np.roll(index, -1, axis), units)
        add(np.roll(index, -1, axis), index, units)
    rows, columns = np.array(list(capacity)).reshape(-1, 2).T
    matrix = csr_array((np.array(list(capacity.values()), np.int32), (rows, columns)), shape=(n + 2,) * 2)
    return maximum_flow(matrix, n, n + 1).flow_value / SCALE


@settings(deadline=None, max_examples=60)
@given(
    seed=st.integers(0, 2**32),
    shape=st.one_of(
        st.tuples(st.integers(2, 8), st.integers(2, 8)),
        st.tuples(st.integers(2, 4), st.integers(2, 4), st.integers(2, 4)),
    ),
    cost=st.sampled_from(["gradient", "paper"]),
    wraps=st.tuples(*[st.booleans()] * 3),
    penalised=st.booleans(),
)
def test_cut_is_the_minimum(seed, shape, cost, wraps, penalised):
    random = np.random.default_rng(seed)
    wrap = wraps[: len(shape)]
    a, b = noise(seed, (*shape, 3)), noise(seed + 1, (*shape, 3))
    mask_a, mask_b = random.random((2, *shape)) < 0.85
    core_a = mask_a & (random.random(shape) < 0.1)
    core_b = mask_b & ~core_a & (random.random(shape) < 0.1)
    penalty = random.random(shape).astype(np.float32) * 3 if penalised else None
    found = seam.cut(a, b, mask_a, mask_b, core_a=core_a, core_b=core_b, penalty=penalty, cost=cost, wrap=wrap)
    overlap = mask_a & mask_b
    assert np.array_equal(found.mask[~overlap], mask_b[~overlap])
    costs = edge_costs(a, b, overlap, wrap, cost, penalty)
    assert found.value == pytest.approx(cut_value(costs, found.mask), rel=1e-4, abs=1e-4)
    to_a = overlap & ~core_b & (core_a | beside(mask_a & ~mask_b, wrap))
    to_b = overlap & ~to_a & (core_b | beside(mask_b & ~mask_a, wrap))
    assert not found.mask[to_a].any()
    assert found.mask[to_b].all()
    assert found.value == pytest.approx(least(costs, to_a, to_b), rel=1e-3, abs=5e-3)
    crossed = [(c > 0) & (found.mask != np.roll(found.mask, -1, axis)) for axis, c in enumerate(costs)]
    assert found.edges == sum(map(np.count_nonzero, crossed))


@settings(deadline=None, max_examples=60)
@given(
    seed=st.integers(0, 2**32),
    shape=st.tuples(st.integers(2, 10), st.integers(2, 10)),
    axis=st.sampled_from([0, 1]),
    cyclic=st.booleans(),
    cost=st.sampled_from(["gradient", "paper"]),
)
def test_strip_is_the_minimum(seed, shape, axis, cyclic, cost):
    a, b = noise(seed, (*shape, 3)), noise(seed + 1, (*shape, 3))
    found = seam.cut_strip(a, b, axis=axis, cyclic=cyclic, cost=cost)
    wrap = (cyclic and axis == 1, cyclic and axis == 0)
    costs = edge_costs(a, b, np.ones(shape, bool), wrap, cost)
    first, last = np.zeros((2, *shape), bool)
    np.moveaxis(first, axis, 0)[0] = np.moveaxis(last, axis, 0)[-1] = True
    assert not found.mask[first].any()
    assert found.mask[last].all()
    assert found.value == pytest.approx(cut_value(costs, found.mask), rel=1e-4)
    assert found.value == pytest.approx(least(costs, first, last), rel=1e-3, abs=5e-3)


def test_cyclic_seam_closes():
    """A seam that need not close ends in another column than it starts. The closed one costs no less."""
    a, b = noise(0, (40, 60, 3)), noise(1, (40, 60, 3))
    opened, closed = seam.cut_strip(a, b), seam.cut_strip(a, b, cyclic=True)
    costs = edge_costs(a, b, np.ones((40, 60), bool), (True, False))
    assert closed.value == pytest.approx(cut_value(costs, closed.mask), rel=1e-4)
    assert opened.value <= closed.value <= cut_value(costs, opened.mask) + 1e-6
    shifted = seam.cut_strip(np.roll(a, 17, 0), np.roll(b, 17, 0), cyclic=True)
    assert shifted.value == pytest.approx(closed.value)


@settings(deadline=None, max_examples=60)
@given(
    seed=st.integers(0, 2**32),
    shape=st.sampled_from([(1, 1), (3, 3), (1, 9), (2, 2, 2), (9, 1)]),
    wrap=st.booleans(),
)
def test_labels_are_the_best_of_all(seed, shape, wrap):
    random = np.random.default_rng(seed)
    n = int(np.prod(shape))
    unary = random.normal(size=(*shape, 2)).astype(np.float32)
    pairs = [(random.random(shape, np.float32), random.random(shape, np.float32)) for _ in shape]
    found = seam.binary_labels(unary, pairs, wrap=wrap)
    every = (np.arange(2**n)[:, None] >> np.arange(n) & 1).astype(bool).reshape(-1, *shape)
    energy = np.where(every, unary[..., 1], unary[..., 0]).reshape(len(every), -1).sum(1, dtype=np.float64)
    for axis, (forward, backward) in enumerate(pairs):
        after = np.roll(every, -1, axis + 1)
        cost = np.where(~every & after, forward, 0) + np.where(every & ~after, backward, 0)
        if not wrap or shape[axis] == 1:
            cost[(slice(None),) * (axis + 1) + (-1,)] = 0
        energy += cost.reshape(len(every), -1).sum(1, dtype=np.float64)
    assert found.energy == pytest.approx(energy.min(), abs=1e-5)
    assert energy[np.flatnonzero((every == found.mask).reshape(len(every), -1).all(1))[0]] == pytest.approx(
        found.energy, abs=1e-5
    )


def nothing_old(shape):
    """Return old seams without a cost. They do not change the problem, but only the general solver accepts them."""
    zeros = [np.zeros(shape, np.float32)] * len(shape)
    return seam.OldSeams(kept=zeros, ab=zeros, ba=zeros)


def disc(shape, centre, radius):
    away = [(np.arange(n) - c) ** 2 for n, c in zip(shape, centre, strict=True)]
    return sum(np.meshgrid(*away, indexing="ij")) <= radius**2


@settings(deadline=None, max_examples=100)
@given(
    seed=st.integers(0, 2**32),
    shape=st.tuples(st.integers(50, 120), st.integers(50, 120)),
    levels=st.sampled_from([2, 4, 256]),
    cost=st.sampled_from(["gradient", "paper"]),
    odd=st.sampled_from(["", "two cores", "core at the border", "holes", "cyclic", "penalty"]),
)
def test_a_ring_is_the_cut_of_the_general_solver(seed, shape, levels, cost, odd):
    """The result is the same set of pixels for any shape. Few levels give many equal cuts."""
    random = np.random.default_rng(seed)
    a, b = (random.integers(0, levels, (*shape, 3)) / max(levels - 1, 1) for _ in range(2))
    middle = [n * x for n, x in zip(shape, random.uniform(0.3, 0.7, 2), strict=True)]
    mask_a, mask_b = np.ones(shape, bool), disc(shape, middle, min(shape) * random.uniform(0.3, 0.8))
    core = disc(shape, middle, min(shape) * 0.1) & mask_b
    if odd == "two cores":
        core |= np.roll(core, shape[1] // 3, 1) & mask_b
    elif odd == "core at the border":
        core[shape[0] // 2, : shape[1] // 2] = mask_b[shape[0] // 2, : shape[1] // 2] = True
    elif odd == "holes":
        mask_a &= (random.random(shape) < 0.95) | core
        mask_b &= (random.random(shape) < 0.98) | core
    penalty = random.random(shape) * 3 if odd == "penalty" else None
    given = {"core_b": core, "cost": cost, "wrap": odd == "cyclic", "penalty": penalty}
    found = seam.cut(a, b, mask_a, mask_b, **given)
    general = seam.cut(a, b, mask_a, mask_b, old=nothing_old(shape), **given)
    assert np.array_equal(found.mask, general.mask)
    assert (found.value, found.edges) == (general.value, general.edges)


def test_a_large_ring_is_the_cut_of_the_general_solver():
    a, b = noise(0, (150, 170, 3)), noise(1, (150, 170, 3))
    everywhere = np.ones((150, 170), bool)
    given = {"mask_b": disc((150, 170), (70, 80), 68), "core_b": disc((150, 170), (75, 70), 25)}
    found = seam.cut(a, b, everywhere, **given)
    general = seam.cut(a, b, everywhere, old=nothing_old((150, 170)), **given)
    assert np.array_equal(found.mask, general.mask)
    assert found.value == general.value


def test_a_shell_is_cut_in_three_dimensions():
    shape = (9, 10, 11)
    a, b = noise(0, (*shape, 1)), noise(1, (*shape, 1))
    given = {"mask_b": disc(shape, (4, 5, 5), 4), "core_b": disc(shape, (4, 5, 5), 1)}
    found = seam.cut(a, b, np.ones(shape, bool), **given)
    assert found.mask[given["core_b"]].all()
    assert not found.mask[~given["mask_b"]].any()
    border = given["mask_b"] & beside(~given["mask_b"], (False,) * 3)
    costs = edge_costs(a, b, given["mask_b"], (False,) * 3)
    assert found.value == pytest.approx(least(costs, border & ~given["core_b"], given["core_b"]), rel=1e-3)


def test_old_seam_is_covered_where_that_is_cheaper():
    """A contains a visible seam between columns 3 and 4, where B is the same on both sides."""
    left, right = np.zeros((6, 8), np.float32), np.ones((6, 8), np.float32)
    columns = np.arange(8)
    a, b = np.where(columns < 4, left, right), np.full((6, 8), 0.5, np.float32)
    mask_b = (columns > 0) & (columns < 7) & np.ones((6, 1), bool)
    everywhere = np.ones((6, 8), bool)

    def m(p_source, q_source, p_other, q_other):
        return np.abs(p_source - p_other) + np.abs(q_source - q_other)

    def old(strength):
        zero = np.zeros((6, 8), np.float32)
        kept, ab, ba = zero.copy(), zero.copy(), zero.copy()
        kept[:, 3] = strength * m(left, left, right, right)[:, 3]
        ab[:, 3] = m(left, left, b, b)[:, 3]
        ba[:, 3] = m(b, b, right, right)[:, 3]
        return seam.OldSeams(kept=[zero, kept], ab=[zero, ab], ba=[zero, ba])

    plain = seam.cut(a, b, everywhere, mask_b, cost="paper")
    assert not plain.mask.any()
    assert plain.value == 0
    kept = seam.cut(a, b, everywhere, mask_b, cost="paper", old=old(0.01))
    assert not kept.mask.any()
    assert kept.value == pytest.approx(6 * 2 * 0.01, abs=1e-3)
    # A core of B is next to the seam. Joining at the old seam costs 1 for each row, like any other join, and covers
    # it.
    core = np.zeros((6, 8), bool)
    core[:, 4] = True
    covered = seam.cut(a, b, everywhere, mask_b, cost="paper", old=old(1), core_b=core)
    assert covered.mask[:, 4].all()
    assert covered.value == pytest.approx(12, abs=0.1)


def test_penalty_moves_the_seam():
    a, b = np.zeros((5, 9)), np.ones((5, 9))
    columns = np.arange(9)
    penalty = np.where(columns == 6, 0.0, 1.0) * np.ones((5, 1))
    found = seam.cut_strip(a, b, penalty=penalty)
    assert found.edges == 5
    assert ((found.mask.argmax(1) == 6) | (found.mask.argmax(1) == 7)).all()


def test_dtypes_agree():
    a, b = (np.random.default_rng(i).integers(0, 256, (12, 12, 3), np.uint8) for i in (0, 1))
    found = seam.cut_strip(a, b)
    for other in (
        seam.cut_strip(a.astype(np.uint16) * 257, b.astype(np.uint16) * 257),
        seam.cut_strip(a / 255, b / 255),
        seam.cut_strip(np.asfortranarray(a), b[::1]),
    ):
        assert np.array_equal(found.mask, other.mask)
        assert found.value == pytest.approx(other.value)


def test_no_overlap_and_no_b_only_pixel():
    half = np.arange(8) < 4
    halves = seam.cut(np.zeros((3, 8)), np.ones((3, 8)), [half] * 3, [~half] * 3)
    assert (halves.value, halves.edges) == (0, 0)
    assert np.array_equal(halves.mask, [~half] * 3)
    everywhere = np.ones((3, 8), bool)
    assert not seam.cut(np.zeros((3, 8)), np.ones((3, 8)), everywhere, everywhere).mask.any()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"b": np.zeros((4, 5))}, "b: must have the shape of a"),
        ({"mask_a": np.ones((4, 5), bool)}, "mask_a: must have shape"),
        (
            {"core_a": np.ones((4, 4), bool), "core_b": np.ones((4, 4), bool)},
            "core_a, core_b: ",
        ),
        ({"core_a": np.ones((4, 4), bool), "mask_a": np.zeros((4, 4), bool)}, "core_a: .*image"),
        ({"penalty": np.full((4, 4), -1.0)}, "penalty: .*-1"),
        ({"penalty": np.full((4, 4), np.nan)}, "penalty: .*NaN"),
        ({"penalty": np.full((4, 4), 3e38)}, "penalty: .*infinite"),
        ({"penalty": ["much"]}, "penalty: must be real numbers"),
        ({"old": seam.OldSeams([], [], [])}, r"old\.kept: must be 2 arrays"),
        ({"old": seam.OldSeams(*[[np.full((4, 4), -1.0)] * 2] * 3)}, "old: .*-1"),
    ],
)
def test_bad_input_to_cut(change, message):
    everywhere = np.ones((4, 4), bool)
    good = {"a": np.zeros((4, 4)), "b": np.ones((4, 4)), "mask_a": everywhere, "mask_b": everywhere}
    with pytest.raises(InvalidInput, match=message):
        seam.cut(**(good | change))


def test_bad_input_to_strip():
    with pytest.raises(InvalidInput, match="pixels along axis 1"):
        seam.cut_strip(np.zeros((4, 1)), np.ones((4, 1)))


def test_many_strips_are_cut_as_each_by_itself():
    strips = []
    for number, (shape, axis) in enumerate((((9, 14), 1), ((20, 5), 0), ((3, 2), 1))):
        a, b = noise(number, (*shape, 3)), noise(number + 10, (*shape, 3))
        strips.append(seam.Strip(a, b, axis, noise(number + 20, shape) if number else None))
    for strip, found in zip(strips, seam.cut_strips(strips, cost="paper"), strict=True):
        alone = seam.cut_strip(strip.a, strip.b, axis=strip.axis, penalty=strip.penalty, cost="paper")
        assert (found.mask == alone.mask).all()
        assert (found.value, found.edges) == (alone.value, alone.edges)
    assert seam.cut_strips([]) == []


@pytest.mark.parametrize(
    ("strip", "message"),
    [
        (seam.Strip(np.zeros((4, 4)), np.zeros((4, 4)), 1), "strips: a: must have shape"),
        (seam.Strip(np.zeros((4, 4, 1)), np.zeros((4, 3, 1)), 1), "strips: b: must have shape"),
        (seam.Strip(np.zeros((4, 4, 1)), np.full((4, 4, 1), np.nan), 1), "a, b: .*finite"),
        (seam.Strip(np.zeros((4, 4, 1)), np.zeros((4, 4, 1)), 2), "axis: must be an integer between 0 and 1"),
        (seam.Strip(np.zeros((4, 4, 1)), np.zeros((4, 4, 1)), 0, np.ones((3, 4))), "penalty: must have shape"),
    ],
)
def test_bad_input_to_strips(strip, message):
    with pytest.raises(InvalidInput, match=message):
        seam.cut_strips([strip])


def test_bad_input_to_labels():
    with pytest.raises(InvalidInput, match="unary: must be real numbers"):
        seam.binary_labels(["none"], 1.0)


def test_infinity_forbids_and_huge_costs_keep_the_precision():
    unary = np.zeros((1, 5, 2), np.float32)
    unary[0, 0] = [0, np.inf]
    unary[0, 4] = [1e30, 0]
    pairwise = np.float32([[4, 3, 1, 2, 0]]) * 1e-3
    found = seam.binary_labels(unary, [0.0, pairwise])
    assert found.mask.tolist() == [[False, False, False, True, True]]
    assert found.energy == pytest.approx(1e-3)

"""Rows 5 and 6: minimum cuts on grids.

Peers solve the same integer problem as texrs, and get the costs of the graph in advance.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from frame import Arrays, Row, Work

SCALE = 65536
STEPS = 1024
"""Energies of labels are multiples of 1 / STEPS, so that the finer integers of texrs equal the peers' integers.
"""


def texture(name: str, side: int) -> np.ndarray:
    """Return an RGB crop of a texture in scikit-image's wheel."""
    from skimage import data

    grey = getattr(data, name)()[:side, :side].astype(np.float32) / 255
    return np.ascontiguousarray(grey[..., None] * np.float32([1, 0.9, 0.7]))


def cost_edges(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return gradient costs as integers for each axis, in the order of operations of the kernel."""

    def l1(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        total = np.zeros(x.shape[:-1], np.float32)
        for channel in range(x.shape[-1]):
            total += np.abs(x[..., channel] - y[..., channel])
        return total

    costs = []
    for axis in range(2):
        a_next, b_next = (np.roll(i, -1, axis) for i in (a, b))
        difference = l1(a, b)
        scale = l1(a, a_next) + l1(b, b_next) + np.float32(0.05)
        cost = (difference + np.roll(difference, -1, axis)) / scale + np.float32(1e-4)
        cost[(slice(None),) * axis + (-1,)] = 0
        costs.append(np.floor(cost.astype(np.float64) * SCALE + 0.5).astype(np.int64))
    return np.stack(costs)


def value_cut(given: Arrays, mask: np.ndarray) -> int:
    """Return the cost of a cut, and of its terminals without fixed labels."""
    total = sum(cost[mask != np.roll(mask, -1, axis)].sum() for axis, cost in enumerate(given["costs"]))
    if "unary" in given:
        total += given["source"][mask].sum() + given["sink"][~mask].sum()
    return int(total)


def make_strip(side: int) -> dict[str, Any]:
    """Prepare a cut from the left border to the right one."""
    a, b = texture("brick", side), texture("gravel", side)
    source, sink = np.zeros((2, side, side), np.int64)
    source[:, 0] = sink[:, -1] = 2**31
    return {"a": a, "b": b, "costs": cost_edges(a, b), "source": source, "sink": sink}


def make_ring(side: int) -> dict[str, Any]:
    """Prepare a patch on an image, with a fixed core and a free ring."""
    from scipy.ndimage import binary_erosion

    a, b = texture("brick", side), texture("gravel", side)
    everywhere = np.ones((side, side), bool)
    core, patch = binary_erosion(everywhere, iterations=side // 3), binary_erosion(everywhere)
    rim = patch & ~binary_erosion(patch)
    costs = cost_edges(a, b)
    # Pairs with a pixel outside the patch are not edges of the overlap, so they cost nothing.
    for axis, cost in enumerate(costs):
        cost[~(patch & np.roll(patch, -1, axis))] = 0
    source, sink = np.where(rim, 2**31, 0), np.where(core, 2**31, 0)
    return {"a": a, "b": b, "patch": patch, "core": core, "costs": costs, "source": source, "sink": sink}


def make_labels(side: int) -> dict[str, Any]:
    """Prepare foreground and background by grey values, smoothed by contrast."""
    image = texture("brick", side)[..., 0]
    terminal = np.round((image - np.median(image)) * 2 * STEPS)
    costs = []
    for axis in range(2):
        cost = np.round(np.exp(-np.abs(image - np.roll(image, -1, axis)) * 8) * 0.4 * STEPS)
        cost[(slice(None),) * axis + (-1,)] = 0
        costs.append(cost.astype(np.int64))
    unary = np.stack([np.maximum(-terminal, 0), np.maximum(terminal, 0)], axis=-1).astype(np.float32)
    source, sink = (np.maximum(sign * terminal, 0).astype(np.int64) for sign in (1, -1))
    return {"unary": unary, "costs": np.stack(costs), "source": source, "sink": sink}


def cut_by_texrs(given: Arrays) -> Work:
    """Return the mask from images or costs, and the cost of its cut."""
    from texrs.kernels import seam

    if "unary" in given:
        pairwise = [cost.astype(np.float32) for cost in given["costs"]]
        return lambda: seam.binary_labels(given["unary"], pairwise).mask
    if "core" in given:
        everywhere = np.ones(given["core"].shape, bool)
        return lambda: seam.cut(given["a"], given["b"], everywhere, given["patch"], core_b=given["core"]).mask
    return lambda: seam.cut_strip(given["a"], given["b"]).mask


def cut_by_pymaxflow(given: Arrays) -> Work:
    """Build the graph, solve it and read the labels. A node on the sink's side is True."""
    import maxflow

    source, sink = given["source"], given["sink"]

    def work() -> np.ndarray:
        graph = maxflow.GraphInt(source.size, 4 * source.size)
        nodes = graph.add_grid_nodes(source.shape)
        for axis, cost in enumerate(given["costs"]):
            structure = np.zeros((3, 3))
            structure[(2, 1) if axis == 0 else (1, 2)] = 1
            graph.add_grid_edges(nodes, cost, structure, symmetric=True)
        graph.add_grid_tedges(nodes, source, sink)
        graph.maxflow()
        return graph.get_grid_segments(nodes)

    return work


def cut_by_scipy(given: Arrays) -> Work:
    """Use Dinic's algorithm. A node is on the source's side if a residual path leads to it."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import breadth_first_order, maximum_flow

    source, sink = given["source"], given["sink"]
    n = source.size
    index = np.arange(n).reshape(source.shape)

    def work() -> np.ndarray:
        rows, columns, values = [np.full(n, n), index.ravel()], [index.ravel(), np.full(n, n + 1)], []
        values += [source.ravel(), sink.ravel()]
        for axis, cost in enumerate(given["costs"]):
            p, q, c = index.ravel(), np.roll(index, -1, axis).ravel(), cost.ravel()
            rows += [p, q]
            columns += [q, p]
            values += [c, c]
        entries, ends = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
        keep = entries > 0
        parts = (entries[keep].astype(np.int32), (ends[0][keep], ends[1][keep]))
        matrix = csr_array(parts, shape=(n + 2, n + 2))
        residual = matrix - maximum_flow(matrix, n, n + 1, method="dinic").flow
        residual.eliminate_zeros()
        beyond = np.ones(n + 2, bool)
        beyond[breadth_first_order(residual, n, return_predecessors=False)] = False
        return beyond[:n].reshape(source.shape)

    return work


def _valued(side: Any) -> Any:
    """Compute the cost of the cut once, when results are compared."""

    def ready(given: Arrays) -> Work:
        work = side(given)
        return lambda: (given, work())

    return ready


def _value(result: Any) -> list[float]:
    return [float(value_cut(*result))]


PEERS = {"texrs": _valued(cut_by_texrs), "PyMaxflow": _valued(cut_by_pymaxflow)}
ROWS = {
    **{
        f"strip-{side}": Row(
            "5",
            f"seam from border to border, {side}²",
            "equal cut value",
            lambda side=side: make_strip(side),
            PEERS,
            _value,
            asked={"PyMaxflow": asked},
            most_ms=most,
        )
        for side, asked, most in ((128, 40, 0.75), (512, 300, 13))
    },
    **{
        f"ring-{side}": Row(
            "6",
            f"seam around a patch, {side}²",
            "equal cut value",
            lambda side=side: make_ring(side),
            PEERS,
            _value,
            asked={"PyMaxflow": 3} if side == 512 else {},
        )
        for side in (256, 512)
    },
    "labels-512": Row(
        "6",
        "two labels of least energy, 512²",
        "equal energy",
        lambda: make_labels(512),
        {**PEERS, "SciPy": _valued(cut_by_scipy)},
        _value,
        asked={"PyMaxflow": 3},
        most_ms=21,
    ),
}

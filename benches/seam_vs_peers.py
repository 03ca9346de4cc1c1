"""Minimum cuts against PyMaxflow (Boykov and Kolmogorov's solver) and SciPy.

    pip install "PyMaxflow>=1.3"
    python benches/seam_vs_peers.py [--repeat 5] [--only strip]

Interleaved, in one thread. Times of texrs hold all that a user waits for, from images or costs to
labels: for strips and rings also the costs of the edges, which the peers are given ready. Peers:
graph, solution and labels. Every peer solves the very integers that texrs solves, and its value
must be equal.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable, Iterator

import numpy as np
import scipy.ndimage
from scipy.sparse import csr_array
from scipy.sparse.csgraph import maximum_flow
from skimage import data

from texrs import _rust
from texrs.kernels import seam

try:
    import maxflow
except ImportError:
    maxflow = None

SCALE = 65536
FORWARD = [
    np.array([[0, 0, 0], [0, 0, 0], [0, 1, 0]]),
    np.array([[0, 0, 0], [0, 0, 1], [0, 0, 0]]),
]


def texture(name: str, side: int) -> np.ndarray:
    """An RGB crop of a texture in scikit-image's wheel."""
    grey = getattr(data, name)()[:side, :side].astype(np.float32) / 255
    return np.ascontiguousarray(grey[..., None] * np.float32([1, 0.9, 0.7]))


def edge_costs(a: np.ndarray, b: np.ndarray, wrap: tuple[bool, ...]) -> list[np.ndarray]:
    """Gradient costs as integers, in the order of operations of the kernel."""

    def l1(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        total = np.zeros(x.shape[:-1], np.float32)
        for channel in range(x.shape[-1]):
            total += np.abs(x[..., channel] - y[..., channel])
        return total

    costs = []
    for axis in range(a.ndim - 1):
        a_next, b_next = (np.roll(i, -1, axis) for i in (a, b))
        difference = l1(a, b)
        cost = (difference + np.roll(difference, -1, axis)) / (
            l1(a, a_next) + l1(b, b_next) + np.float32(0.05)
        ) + np.float32(1e-4)
        if not wrap[axis]:
            cost[(slice(None),) * axis + (-1,)] = 0
        costs.append(np.floor(cost.astype(np.float64) * SCALE + 0.5).astype(np.int64))
    return costs


def cut_value(costs: list[np.ndarray], mask: np.ndarray) -> int:
    """Sum of the costs that a mask cuts."""
    return int(sum(c[mask != np.roll(mask, -1, axis)].sum() for axis, c in enumerate(costs)))


def by_pymaxflow(
    costs: list[np.ndarray], source: np.ndarray, sink: np.ndarray, wrap: tuple[bool, ...]
) -> tuple[int, np.ndarray]:
    """Flow and labels."""
    graph = maxflow.GraphInt(source.size, 2 * source.ndim * source.size)
    nodes = graph.add_grid_nodes(source.shape)
    for axis, cost in enumerate(costs):
        structure = np.zeros((3,) * source.ndim)
        structure[(1,) * axis + (2,) + (1,) * (source.ndim - axis - 1)] = 1
        periodic = np.array(wrap) & (np.arange(source.ndim) == axis)
        graph.add_grid_edges(nodes, cost, structure, symmetric=True, periodic=periodic)
    graph.add_grid_tedges(nodes, source, sink)
    return int(graph.maxflow()), graph.get_grid_segments(nodes)


def by_scipy(costs: list[np.ndarray], source: np.ndarray, sink: np.ndarray, wrap: tuple[bool, ...]) -> tuple[int, None]:
    """Flow of SciPy's Dinic."""
    n = source.size
    index = np.arange(n).reshape(source.shape)
    rows, columns, values = [np.full(n, n), index.ravel()], [index.ravel(), np.full(n, n + 1)], []
    values += [source.ravel(), sink.ravel()]
    for axis, cost in enumerate(costs):
        p, q, c = index.ravel(), np.roll(index, -1, axis).ravel(), cost.ravel()
        rows += [p, q]
        columns += [q, p]
        values += [c, c]
    entries = np.concatenate(values)
    keep = entries > 0
    matrix = csr_array(
        (
            entries[keep].astype(np.int32),
            (np.concatenate(rows)[keep], np.concatenate(columns)[keep]),
        ),
        shape=(n + 2, n + 2),
    )
    return int(maximum_flow(matrix, n, n + 1, method="dinic").flow_value), None


Case = tuple[str, Callable[[], np.ndarray], dict[str, Callable[[], object]], Callable[[np.ndarray], int]]


def strips() -> Iterator[Case]:
    """Seams between the left and the right border, open and cyclic."""
    for side, cyclic in ((128, False), (256, False), (512, False), (128, True), (256, True)):
        a, b = texture("brick", side), texture("gravel", side)
        wrap = (cyclic, False)
        costs = edge_costs(a, b, wrap)
        source, sink = np.zeros((2, side, side), np.int64)
        source[:, 0] = sink[:, -1] = 2**31
        yield (
            f"strip {'cyclic ' * cyclic}{side}",
            lambda a=a, b=b, cyclic=cyclic: seam.cut_strip(a, b, cyclic=cyclic).mask,
            {"PyMaxflow": lambda c=costs, s=source, t=sink, w=wrap: by_pymaxflow(c, s, t, w)[0]},
            lambda mask, c=costs: cut_value(c, mask),
        )


def rings() -> Iterator[Case]:
    """A patch whose core must stay and whose ring is free, on an image."""
    for side in (64, 128, 256, 512):
        a, b = texture("brick", side), texture("gravel", side)
        everywhere = np.ones((side, side), bool)
        core = scipy.ndimage.binary_erosion(everywhere, iterations=side // 3)
        patch = scipy.ndimage.binary_erosion(everywhere, iterations=1)
        rim = patch & ~scipy.ndimage.binary_erosion(patch)
        costs = edge_costs(a, b, (False, False))
        # Pairs that leave the patch are no edges of the overlap.
        for axis, cost in enumerate(costs):
            cost[~(patch & np.roll(patch, -1, axis))] = 0
        source, sink = np.where(rim, 2**31, 0), np.where(core, 2**31, 0)
        yield (
            f"ring {side}",
            lambda a=a, b=b, e=everywhere, p=patch, c=core: seam.cut(a, b, e, p, core_b=c).mask,
            {"PyMaxflow": lambda c=costs, s=source, t=sink: by_pymaxflow(c, s, t, (False, False))[0]},
            lambda mask, c=costs: cut_value(c, mask),
        )


def segmentations() -> Iterator[Case]:
    """Foreground and background by unary costs of grey values, smoothed by contrast."""
    for shape, wrap in (
        ((128, 128), False),
        ((512, 512), False),
        ((512, 512), True),
        ((48, 48, 48), False),
    ):
        image = (
            data.brick()[: shape[0], : shape[1]].astype(np.float32) / 255
            if len(shape) == 2
            else scipy.ndimage.gaussian_filter(np.random.default_rng(0).random(shape, np.float32), 1.2) * 4 - 1.5
        )
        # Multiples of 2^-10, so that texrs' finer integers and the peers' are the same energy.
        steps = 1024
        terminal = np.round((image - np.median(image)) * 2 * steps)
        wraps = (wrap,) * len(shape)
        costs = []
        for axis in range(len(shape)):
            cost = np.round(np.exp(-np.abs(image - np.roll(image, -1, axis)) * 8) * 0.4 * steps)
            if not wrap:
                cost[(slice(None),) * axis + (-1,)] = 0
            costs.append(cost.astype(np.int64))
        unary = np.stack([np.maximum(-terminal, 0), np.maximum(terminal, 0)], axis=-1).astype(np.float32)
        pairwise = [c.astype(np.float32) for c in costs]
        source, sink = (
            np.maximum(terminal, 0).astype(np.int64),
            np.maximum(-terminal, 0).astype(np.int64),
        )

        def value(mask: np.ndarray, c=costs, s=source, t=sink) -> int:
            return cut_value(c, mask) + int(s[mask].sum() + t[~mask].sum())

        # With PyMaxflow a node of the sink's side is True and pays for its source's edge, as here.
        peers = {
            "PyMaxflow": lambda c=costs, s=source, t=sink, w=wraps: by_pymaxflow(c, s, t, w)[0],
            "SciPy": lambda c=costs, s=source, t=sink, w=wraps: by_scipy(c, s, t, w)[0],
        }
        yield (
            f"labels {'x'.join(map(str, shape))}{' cyclic' * wrap}",
            lambda u=unary, p=pairwise, w=wraps: seam.binary_labels(u, p, wrap=w).mask,
            peers,
            value,
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--patience", type=float, default=20.0, help="seconds after which a peer is not repeated")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    _rust.set_threads(1)
    print(f"{'case':<22}{'texrs ms':>10}{'peer':>12}{'peer ms':>11}{'ratio':>9}  value")
    for cases in (strips, rings, segmentations):
        for name, ours, peers, value in cases():
            if options.only not in name:
                continue
            times: dict[str, list[float]] = {"texrs": [], **{peer: [] for peer in peers}}
            values = {}
            for _ in range(options.repeat):
                for who, work in {"texrs": ours, **peers}.items():
                    if sum(times[who]) > options.patience:
                        continue
                    start = time.perf_counter()
                    result = work()
                    times[who].append(time.perf_counter() - start)
                    values[who] = value(result) if who == "texrs" else result
            if len(set(values.values())) != 1:
                raise SystemExit(f"{name}: the values differ: {values}")
            mine = statistics.median(times["texrs"])
            for peer in peers:
                theirs = statistics.median(times[peer])
                times_ms = f"{mine * 1e3:>10.2f}{peer:>12}{theirs * 1e3:>11.2f}"
                print(f"{name:<22}{times_ms}{theirs / mine:>9.1f}  {values['texrs']}", flush=True)


if __name__ == "__main__":
    main()

"""Knots laid: at each target a knot of A with what hangs on it, cut to what its neighbours show in a band between them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, guidance
from texrs._engine.stitcher import FREE, Pasting, Samples
from texrs._typing import Bools, Floats, Progress
from texrs.elements import ElementAnalysis

__all__ = ["Laid", "lay_knots"]

Points = NDArray[np.float64]

REACH = 1.4
"""Spacings around a knot that it may show, where no other one is nearer: in gaps of a layout a net goes on as it is."""
BAND = 0.3
"""Spacings by which a pixel may be farther from a knot than from the next one, and show what hangs on it; pixels that are so
much nearer show nothing else."""
CORE = 0.18
"""Spacings around a knot that show it in any case."""
LOOSE = 0.05
"""Spacings by which a knot may miss its target, so that its lines meet those that are there."""
TRIED, CUT = 6, 6
"""Knots that are shifted, and places that are cut in, of which the cheapest stays."""
GRAPH, BEYOND, USES, AWAY, CHANCE = 1.0, 6.0, 0.1, 0.3, 0.02
"""What places cost beside their colours: by the graph, by what lies beyond the picture, by the uses of the knot, by what it
misses its target by, and by chance; places that have nothing to do with each other differ by one in colour."""
COLOUR, DEPTH, DEEP = 1.0, 0.3, 6.0
"""What a seam costs by the colours on both sides, in standard deviations, and by how many pixels deep in the foreground it is,
which beyond so many is all the same: keys stay whole."""
SEEN = 16
"""Pixels of a spacing that are looked at, one in so many, where places are judged."""
LOST = 0.35
"""Share of a window that may lie beyond the picture."""


@dataclass(frozen=True, slots=True, eq=False)
class Laid:
    """What knots show.

    Attributes
    ----------
    places : (H, W, 2) int32
        The pixel of A that each pixel shows; 0 where none is known.
    target : (H, W) uint32
        The target it belongs to, a row of the targets, or ``FREE`` where it shows nothing.
    source : (n,) int
        The knot of each target, or -1.
    found : (n, 2) float64
        Where that would lie; NaN where there is none.

    """

    places: NDArray[np.int32]
    target: NDArray[np.uint32]
    source: NDArray[np.intp]
    found: Points


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """What may be laid around a target.

    Attributes
    ----------
    box : (slice, slice)
        Of the output.
    off : (h, w, 2) int
        Pixels as seen from the target's.
    cell, core : (h, w) bool
        Pixels that a knot may cover there, and those that it must.

    """

    box: tuple[slice, slice]
    off: NDArray[np.intp]
    cell: Bools
    core: Bools


def lay_knots(
    a: ElementAnalysis, mine: Floats, targets: Points, theirs: Floats, unit: float, seed: int, watch: Progress
) -> Laid:
    """Lay a knot at each target.

    Parameters
    ----------
    a : ElementAnalysis
        The texture.
    mine : (h, w, 4) float32
        Where in its net each of its pixels lies (`describe_places`).
    targets : (n, 2) float64
        Where knots are wanted, also around the output.
    theirs : (H, W, 4) float32
        Where in the wanted net each pixel of the output lies.
    unit : float
        Spacing of both.
    seed : int
        Chooses among knots that fit alike.
    watch : callable
        Called as ``watch("nets", share)``.

    """
    from scipy.ndimage import distance_transform_edt
    from scipy.spatial import cKDTree

    points, shape, size = a.points, np.array(mine.shape[:2]), theirs.shape[:2]
    colours = guidance(as_image(a.image)).astype(np.float32)
    colours = colours / max(float(colours.std()), 1e-6)
    flat = np.ascontiguousarray(colours.reshape(-1, colours.shape[-1]))
    described = np.dstack([mine, colours])
    step = max(2, int(unit / SEEN))
    depth = np.minimum(distance_transform_edt(a.mask), DEEP).astype(np.float32).ravel()
    samples = Samples(flat, depth, (COLOUR, DEPTH))
    shown, seams = np.full(size, FREE, np.uint32), np.zeros((*size, 2), np.float32)
    owner = np.full(size, FREE, np.uint32)
    source, found = np.full(len(targets), -1, np.intp), np.full((len(targets), 2), np.nan)
    middles, used = np.rint(points).astype(np.intp), np.zeros(len(points))
    chance = CHANCE * np.random.default_rng(seed).random((len(targets), len(points)))
    shifts = list_shifts(LOOSE * unit)
    tree = cKDTree(targets)
    order = np.lexsort((targets[:, 1], np.round(2 * targets[:, 0] / unit)))
    for turn, t in enumerate(order.tolist()):
        watch("nets", turn / len(order))
        window = open_window(targets, t, tree, size, unit)
        if window is None:
            continue
        box = window.box
        known = (shown[box] != FREE) & window.cell
        there = flat[np.where(known, shown[box], 0)]

        judge = partial(judge_places, window, described, there, known, theirs[box], step)
        first = judge(middles) + USES * used + chance[t]
        best = np.argsort(first, kind="stable")[:TRIED]
        best = best[np.isfinite(first[best])]
        if not len(best):
            continue
        of, away = np.repeat(best, len(shifts)), np.tile(shifts, (len(best), 1))
        cost = judge(middles[of] + away) + USES * used[of] + chance[t, of] + AWAY * np.hypot(*away.T) / unit
        tried = np.argsort(cost, kind="stable")[:CUT]
        tried = tried[np.isfinite(cost[tried])]
        offers = [make_patch(window, middles[of[k]] + away[k], shape) for k in tried.tolist()]
        pastings = [Pasting(shown[box], seams[box], window.cell & ok, window.core & ok) for _, ok in offers]
        price = [samples.judge(p, patch[None])[0] for p, (patch, _) in zip(pastings, offers, strict=True)]
        k = int(np.argmin(price))
        take, after = samples.cut(pastings[k], offers[k][0])
        shown[box] = np.where(take, offers[k][0], shown[box])
        owner[box] = np.where(take, np.uint32(t), owner[box])
        seams[box] = after
        source[t] = of[tried[k]]
        found[t] = np.rint(targets[t]) - middles[source[t]] - away[tried[k]] + points[source[t]]
        used[source[t]] += 1
    places = np.stack(np.divmod(np.where(shown == FREE, 0, shown).astype(np.int32), np.int32(shape[1])), axis=-1)
    return Laid(places, owner, source, found)


def list_shifts(most: float) -> NDArray[np.intp]:
    """Return steps (n, 2) no longer than so many pixels, none first."""
    reach = int(most)
    step = max(1, -(-reach // 2))
    every = np.arange(-(reach // step), reach // step + 1) * step
    found = np.stack(np.meshgrid(every, every, indexing="ij"), axis=-1).reshape(-1, 2)
    length = np.hypot(*found.T)
    found = found[np.argsort(length, kind="stable")]
    return np.asarray(found[np.sort(length) <= max(most, 0)], np.intp)


def open_window(targets: Points, t: int, tree: object, size: tuple[int, ...], unit: float) -> Window | None:
    """Return what may be laid around a target, or None where that is nothing of the output."""
    middle, reach = np.rint(targets[t]).astype(np.intp), int(np.ceil(REACH * unit))
    low, high = np.maximum(middle - reach, 0), np.minimum(middle + reach + 1, size)
    if (low >= high).any():
        return None
    here = np.stack(np.meshgrid(*(np.arange(a, b) for a, b in zip(low, high, strict=True)), indexing="ij"), axis=-1)
    far, which = tree.query(here, k=2)  # type: ignore[attr-defined]
    own = np.hypot(*np.moveaxis(here - targets[t], -1, 0))
    other = np.where(which[..., 0] == t, far[..., 1], far[..., 0])
    farther = (own - other) / unit
    # What must show another knot is not covered.
    cell = (farther <= BAND) & (own <= REACH * unit) & ~((other <= CORE * unit) & (farther > 0))
    core = ((farther <= -BAND) | ((own <= CORE * unit) & (farther < 0))) & cell
    if not cell.any():
        return None
    return Window((slice(low[0], high[0]), slice(low[1], high[1])), here - middle, cell, core)


def judge_places(
    window: Window,
    described: Floats,
    there: Floats,
    known: Bools,
    theirs: Floats,
    step: int,
    corners: NDArray[np.intp],
) -> Floats:
    """Return how badly A fits a window when so many of its pixels (n, 2) lie on the target; infinitely if it cannot.

    A is ``described``, (h, w, 4 + C), by its net and its colours. Every so manieth pixel is looked at.
    """
    thin = (slice(None, None, step),) * 2
    cell, shape = window.cell[thin], np.array(described.shape[:2])
    cost = np.full(len(corners), np.inf)
    if not cell.any():
        return cost
    off, known = window.off[thin][cell], known[thin][cell]
    asked = np.concatenate([theirs[thin][cell], there[thin][cell]], axis=-1)
    rows = described.reshape(-1, described.shape[-1])
    low, high = off.min(axis=0), off.max(axis=0)
    for k, corner in enumerate(corners):
        at, wanted, both = off + corner, asked, known
        if (low + corner < 0).any() or (high + corner >= shape).any():
            ok = ((at >= 0) & (at < shape)).all(axis=-1)
            at, wanted, both = at[ok], asked[ok], known[ok]
        lost = 1 - len(at) / len(off)
        if lost > LOST:
            continue
        apart = (rows.take(at[:, 0] * shape[1] + at[:, 1], axis=0) - wanted) ** 2
        cost[k] = GRAPH * apart[:, :4].sum(axis=-1).mean() + BEYOND * lost
        if both.any():
            cost[k] += apart[both, 4:].mean() / 2
    return cost


def make_patch(window: Window, corner: NDArray[np.intp], shape: NDArray[np.intp]) -> tuple[NDArray[np.uint32], Bools]:
    """Return the pixels of A, numbered in a row, that a window shows, and which of them there are."""
    at = window.off + corner
    ok = ((at >= 0) & (at < shape)).all(axis=-1)
    rows, columns = np.moveaxis(np.clip(at, 0, shape - 1), -1, 0)
    return np.asarray(rows * shape[1] + columns, np.uint32), np.asarray(ok)

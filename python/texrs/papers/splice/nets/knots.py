"""Copy knots of A to the targets, each with its lines, and cut them along seams in bands between the targets."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, guidance
from texrs._engine.stitcher import FREE, Pasting, Samples
from texrs._typing import Bools, Floats, Progress
from texrs.elements import ElementAnalysis

__all__ = ["PlacedKnots", "lay_knots"]

Points = NDArray[np.float64]

REACH = 1.4
"""Radius around a target that its knot can cover if no other target is nearer, in spacings.

The net then continues in gaps of a layout as it does in A.
"""
BAND = 0.3
"""Half width of the band between two targets, in spacings.

A pixel in the band can belong to either knot. A pixel outside the band belongs to the nearer target.
"""
CORE = 0.18
"""Radius around a target that its knot always covers, in spacings."""
LOOSE = 0.05
"""Maximum distance of a knot from its target, in spacings. Such a shift makes its lines meet the lines of others."""
TRIED, CUT = 6, 6
"""Number of best knots that are also tried with shifts, and number of best places whose seams are computed."""
GRAPH, BEYOND, USES, AWAY, CHANCE = 1.0, 6.0, 0.1, 0.3, 0.02
"""Weights of a place's cost: graph, pixels beyond the image, earlier uses of the knot, distance to the target, chance.

For comparison, the colours of two unrelated places cost 1 on average.
"""
COLOUR, DEPTH, DEEP = 1.0, 0.3, 6.0
"""Weights of a seam: for colour differences, in standard deviations, and for the depth in the foreground, in pixels.

The last number is the maximum depth, in pixels. The weight keeps seams out of elements such as the keys of a keyboard.
"""
SEEN = 16
"""Number of compared pixels per spacing when the cost of a place is computed."""
LOST = 0.35
"""Maximum share of a window that is beyond the image of A."""


@dataclass(frozen=True, slots=True, eq=False)
class PlacedKnots:
    """Knots of A, copied to their targets.

    Attributes
    ----------
    places : (H, W, 2) int32
        Source pixel in A of each pixel, or 0 for pixels without a knot.
    target : (H, W) uint32
        Target of each pixel, as an index of the targets, or ``FREE`` without a target.
    source : (n,) int
        Knot of A at each target, or -1 without a knot.
    found : (n, 2) float64
        Position of that knot in the output, or NaN without a knot.

    """

    places: NDArray[np.int32]
    target: NDArray[np.uint32]
    source: NDArray[np.intp]
    found: Points


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """Pixels around a target that a knot may cover.

    Attributes
    ----------
    box : (slice, slice)
        Slices of the window in the output.
    off : (h, w, 2) int
        Offset of each pixel from the target, in rows and columns.
    cell, core : (h, w) bool
        ``cell`` is True for pixels that the knot can cover, and ``core`` for pixels that it must cover.

    """

    box: tuple[slice, slice]
    off: NDArray[np.intp]
    cell: Bools
    core: Bools


def lay_knots(
    a: ElementAnalysis, mine: Floats, targets: Points, theirs: Floats, unit: float, seed: int, watch: Progress
) -> PlacedKnots:
    """Copy a knot of A to each target, and cut it against the earlier knots.

    Parameters
    ----------
    a : ElementAnalysis
        The texture.
    mine : (h, w, 4) float32
        Features of each pixel of A in its net (`describe_places`).
    targets : (n, 2) float64
        Requested places of knots, including places around the output.
    theirs : (H, W, 4) float32
        Features of each output pixel in the requested net.
    unit : float
        Spacing of both nets, in pixels.
    seed : int
        Seed of the choice among knots that fit equally well.
    watch : callable
        Function called as ``watch("nets", share)``.

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
    # Visit the targets row by row, so that each knot is cut against earlier neighbours.
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
        # Rank knots without a shift first, then small shifts of the best knots.
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
        # Use the place with the cheapest seam.
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
    return PlacedKnots(places, owner, source, found)


def list_shifts(most: float) -> NDArray[np.intp]:
    """Return all tried offsets (n, 2) up to a length in pixels, with (0, 0) first."""
    reach = int(most)
    step = max(1, -(-reach // 2))
    every = np.arange(-(reach // step), reach // step + 1) * step
    found = np.stack(np.meshgrid(every, every, indexing="ij"), axis=-1).reshape(-1, 2)
    length = np.hypot(*found.T)
    found = found[np.argsort(length, kind="stable")]
    return np.asarray(found[np.sort(length) <= max(most, 0)], np.intp)


def open_window(targets: Points, t: int, tree: object, size: tuple[int, ...], unit: float) -> Window | None:
    """Return the window of a target, or None if it is outside the output."""
    middle, reach = np.rint(targets[t]).astype(np.intp), int(np.ceil(REACH * unit))
    low, high = np.maximum(middle - reach, 0), np.minimum(middle + reach + 1, size)
    if (low >= high).any():
        return None
    here = np.stack(np.meshgrid(*(np.arange(a, b) for a, b in zip(low, high, strict=True)), indexing="ij"), axis=-1)
    far, which = tree.query(here, k=2)  # type: ignore[attr-defined]
    own = np.hypot(*np.moveaxis(here - targets[t], -1, 0))
    other = np.where(which[..., 0] == t, far[..., 1], far[..., 0])
    farther = (own - other) / unit
    # Do not cover pixels that must show another knot.
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
    """Return the costs of placing pixels (n, 2) of A at the target. The cost is infinite for impossible places.

    ``described``, (h, w, 4 + C), contains the features of A in its net, and its colours. Only every ``step``-th pixel
    is compared along each axis.
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
    """Return the pixels of A that a window would show, as flat indices, and True for pixels inside the image."""
    at = window.off + corner
    ok = ((at >= 0) & (at < shape)).all(axis=-1)
    rows, columns = np.moveaxis(np.clip(at, 0, shape - 1), -1, 0)
    return np.asarray(rows * shape[1] + columns, np.uint32), np.asarray(ok)

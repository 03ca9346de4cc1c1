"""Mix several exemplars in one texture, with borders along the outlines of elements.

Each exemplar is stitched separately into a texture of the full size. A map selects the texture that is visible at each
pixel. Without a map, smooth noise selects it, and is adjusted until every exemplar has its share. The regions of one
texture are its territories. A minimum cut then moves their borders to the least visible places, by at most about the
size of an element. Such a place is the outline of an element on either side, which then overlaps the other side.
Borders avoid the inside of elements.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import exp_single, log_single
from texrs._typing import Bools, Floats
from texrs.kernels.seam import binary_labels
from texrs.source_map import SourceMap

__all__ = ["Layer", "mix"]

OUTLINE, DEEP = 0.03, 6.0
"""Cost of a border along the outline of an element that is not cut, and cost added in the middle of an element.

A border on plain background costs 1.
"""
CREASE = 0.15
"""Cost of a border along the strongest colour edges.

It is low because the outlines of elements in heaps are uncertain, and colour edges often follow them.
"""
PULL = 0.5
"""Cost of a layer in a pixel at the largest allowed distance from the pixels where this layer is requested.

The cost grows with the square of the distance.
"""
FORBIDDEN = 1e3
"""Cost of a layer in a pixel beyond the largest allowed distance."""
ROUNDS, FREE, EXACT, STEP = 16, 8, 0.01, 0.05
"""Maximum number of rounds that adapt the costs of the exemplars until their shares are right.

Number of rounds after which `PULL` doubles in each round, because large regions can change together, and the shares
change abruptly with them. Allowed relative error of a share. Initial change of the costs for a given error.
"""
FINER, FAINTER = 2.5, 0.5
"""Second, finer noise of the territories: its frequency relative to the first noise, and its relative amplitude."""
KNOTS = 6
"""Number of random values along the side of a territory. The noise is interpolated between these values.

The values are smoothed by a Gaussian filter whose standard deviation is a third of this number, so that borders do not
favour an axis.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """A texture of the full size from one exemplar."""

    source: SourceMap
    colours: Floats
    depth: Floats
    """Depth of each pixel inside an element, 0 to 1. It is 0 on the background."""
    elements: Bools
    """Pixels of elements."""


def mix(
    layers: Sequence[Layer],
    shares: NDArray[np.float64],
    *,
    extent: float,
    territory: float,
    wrap: tuple[bool, bool],
    seed: int,
) -> SourceMap:
    """Combine the textures of several exemplars into one.

    Parameters
    ----------
    layers : sequence of Layer
        One layer per exemplar, all of the same size.
    shares : (n,) or (rows, columns, n) float64
        Share of each exemplar in the whole texture, or in each pixel. Shares sum to 1.
    extent : float
        Size of an element, in pixels: the largest distance of a border from its requested place.
    territory : float
        Size of the territories in pixels. Territories occur where several exemplars have a share.
    wrap : (bool, bool)
        Axes along which the texture is periodic.
    seed : int
        Seed of the territories.

    Returns
    -------
    SourceMap

    """
    size = layers[0].source.shape
    wanted = draw_territories(shares, size, territory, seed)
    chosen = cut_borders(layers, wanted, extent, wrap)
    place = chosen.astype(np.uint32) * np.uint32(wanted.size) + np.arange(wanted.size, dtype=np.uint32).reshape(size)
    return SourceMap.from_selection([layer.source for layer in layers], place, chosen.astype(np.uint32))


def draw_territories(
    shares: NDArray[np.float64], size: tuple[int, ...], territory: float, seed: int
) -> NDArray[np.uint16]:
    """Return the index of the requested exemplar at each pixel.

    If Gumbel noise is added to the logarithms of the shares, the probability that an exemplar has the largest sum is
    its share. Smooth noise turns this random choice into territories.
    """
    count = shares.shape[-1]
    if ((shares == 0) | (shares == 1)).all():
        return np.asarray(np.broadcast_to(shares.argmax(axis=-1), size), np.uint16)
    with np.errstate(divide="ignore"):
        scores = log_single(np.broadcast_to(shares, (*size, count)))
    for which in range(count):
        scores[..., which] -= log_single(-log_single(draw_noise(size, territory, (seed, which))))
    due = np.broadcast_to(shares, (*size, count)).mean(axis=(0, 1))
    for _ in range(4 * ROUNDS):
        wanted = scores.argmax(axis=-1)
        got = np.bincount(wanted.ravel(), minlength=count) / wanted.size
        if measure_error(got, due) <= EXACT / 4:
            break
        scores += np.log(np.maximum(due, 1e-6) / np.maximum(got, 1e-3 * due + 1e-6)).astype(np.float32)
    return np.asarray(wanted, np.uint16)


def draw_noise(size: tuple[int, ...], grain: float, seed: tuple[int, int]) -> Floats:
    """Return smooth periodic noise, uniformly distributed between 0 and 1, without 0 and 1 themselves."""
    from scipy.ndimage import gaussian_filter, zoom
    from scipy.special import ndtr

    rng = np.random.default_rng(seed)
    total = np.zeros(size, np.float32)
    for fine, strength in ((1.0, 1.0), (FINER, FAINTER)):
        cells = [min(n, max(2, round(KNOTS * n * fine / grain))) for n in size]
        knots = gaussian_filter(rng.standard_normal(cells), KNOTS / 3, mode="wrap").astype(np.float32)
        knots /= max(float(knots.std()), 1e-6)
        factors = [n / c for n, c in zip(size, cells, strict=True)]
        total += strength * zoom(knots, factors, order=3, mode="grid-wrap", grid_mode=True)
    even = ndtr((total - total.mean()) / max(float(total.std()), 1e-6))
    return np.asarray(np.clip(even, 1e-4, 1 - 1e-4), np.float32)


def measure_error(got: NDArray[np.float64], due: NDArray[np.float64]) -> float:
    """Return the largest relative error of a share."""
    asked = due > 0
    return float((np.abs(got - due)[asked] / due[asked]).max())


def cut_borders(
    layers: Sequence[Layer], wanted: NDArray[np.uint16], extent: float, wrap: tuple[bool, bool]
) -> NDArray[np.uint16]:
    """Return the layer of each pixel, with the borders moved to inconspicuous places and the shares preserved.

    A minimum cut stitches each layer in turn into the others. The cost of each layer is adapted until the shares are
    correct.
    """
    count, size = len(layers), wanted.size
    ends = [measure_ends(layer) for layer in layers]
    away = np.stack([measure_distance(wanted == which, extent, wrap) for which in range(count)])
    far, squares = away > 1, away**2
    due = np.bincount(wanted.ravel(), minlength=count) / size
    best, price, found, off, step = wanted, np.zeros(count), np.zeros(count), np.inf, 0.0
    for number in range(ROUNDS):
        pull = PULL * 2.0 ** max(0, number - FREE)
        asked = price + step * found
        costs = np.where(far, FORBIDDEN, pull * squares + asked[:, np.newaxis, np.newaxis]).astype(np.float32)
        chosen = np.zeros(wanted.shape, np.uint16)
        # With two layers, one cut is optimal. With more layers, cut each layer against all others in turn.
        for which in range(1, count) if count == 2 else [*range(1, count), *range(count)]:
            chosen = cut_in(which, chosen, ends, costs, wrap)
        # Keep the round with the smallest error. If the error grows, try smaller changes of the costs.
        got = np.bincount(chosen.ravel(), minlength=count) / size
        error = measure_error(got, due)
        if error < off:
            best, price, off = chosen, asked, error
            found = np.where(due > 0, got - due, 0) / float(due[due > 0].min())
            step = 1.5 * step or STEP
        else:
            step /= 3
        if off <= EXACT:
            break
    return best


def measure_ends(layer: Layer) -> NDArray[np.float32]:
    """Return the cost of a layer's border between each pixel and the next: (axis, side that is kept, rows, columns)."""
    ends = np.empty((2, 2, *layer.depth.shape), np.float32)
    for axis in range(2):
        colours, depth = np.roll(layer.colours, -1, axis), np.roll(layer.depth, -1, axis)
        elements = np.roll(layer.elements, -1, axis)
        edge = np.abs(layer.colours - colours).sum(axis=-1)
        ground = CREASE + (1 - CREASE) * exp_single(-edge / max(2 * float(edge.mean()), 1e-6))
        plain = ground + DEEP * np.minimum(layer.depth, depth)
        ends[axis, 0] = np.where(layer.elements & ~elements, OUTLINE, plain)
        ends[axis, 1] = np.where(elements & ~layer.elements, OUTLINE, plain)
    return ends


def measure_distance(asked: Bools, extent: float, wrap: tuple[bool, bool]) -> Floats:
    """Return the distance of each pixel from the requested pixels, in units of ``extent``.

    Values above 1 are not exact.
    """
    from scipy.ndimage import distance_transform_edt

    if not asked.any():
        return np.full(asked.shape, 2, np.float32)
    margin = [min(int(extent) + 2, n) if cyclic else 0 for n, cyclic in zip(asked.shape, wrap, strict=True)]
    around = np.pad(asked, [(m, m) for m in margin], mode="wrap")
    inner = tuple(slice(m, m + n) for m, n in zip(margin, asked.shape, strict=True))
    return np.asarray(distance_transform_edt(~around)[inner] / extent, np.float32)


def cut_in(
    which: int,
    chosen: NDArray[np.uint16],
    ends: Sequence[NDArray[np.float32]],
    costs: NDArray[np.float32],
    wrap: tuple[bool, bool],
) -> NDArray[np.uint16]:
    """Stitch a layer into the visible layers along a minimum cut, and return the layer of each pixel.

    The cost of a border is the lower cost of its two sides, because the layer with the lower cost overlaps the other.
    """
    kept = np.take_along_axis(costs, chosen[np.newaxis].astype(np.intp), axis=0)[0]
    unary = np.stack([np.where(chosen == which, np.float32(np.inf), kept), costs[which]], axis=-1)
    pairs = []
    for axis in range(2):
        shown = np.zeros((2, *chosen.shape), np.float32)
        after = np.roll(chosen, -1, axis)
        for layer, end in enumerate(ends):
            shown[0][chosen == layer] = end[axis, 0][chosen == layer]
            shown[1][after == layer] = end[axis, 1][after == layer]
        new = ends[which][axis]
        pairs.append((np.minimum(shown[0], new[1]), np.minimum(new[0], shown[1])))
    taken = binary_labels(unary, pairs, wrap=wrap).mask
    return np.where(taken, np.uint16(which), chosen)

"""What belongs to the texels (section 3.3): a graph cut between the colours of foreground and background."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools, Floats
from texrs.kernels.noise import uniform
from texrs.kernels.seam import binary_labels
from texrs.texels._mixture import Mixture

__all__ = ["Model", "cut", "disc", "ellipse", "lab", "stamp", "tidy"]

Model: TypeAlias = Literal["mixture", "nearest"]
Wrap: TypeAlias = tuple[bool, bool]

SMOOTH = 2.0
"""Cost of parting neighbours of the same colour."""
NATS = 12.0
"""Most that a pixel's colour may speak for one side."""
RADIUS = 4
"""Of what a point of the background stands for, in pixels."""
SAMPLES = 4000
"""Colours of each side that a model is made from."""
HOLE, SPECK = 0.1, 0.25
"""Largest hole that is filled, as a share of its component, and smallest component that is kept, of the chosen texel."""
ALIKE = 0.5
"""Share of the box, those colours least like the background, that foreground is learnt from where it is a net."""


def lab(guide: Floats) -> Floats:
    """Give Lab / 100, so that a just visible difference is about 0.02."""
    from skimage.color import rgb2lab

    rgb = guide if guide.shape[-1] == 3 else np.repeat(guide[..., :1], 3, axis=-1)
    return np.asarray(rgb2lab(rgb) / 100, np.float32)


def ellipse(box: tuple[int, int], share: float = 1.0) -> Bools:
    """Give the ellipse inscribed in a box, or one that much smaller."""
    rows, columns = (np.arange(n) - (n - 1) / 2 for n in box)
    inside: Bools = np.add.outer((2 * rows / box[0]) ** 2, (2 * columns / box[1]) ** 2) <= share**2
    return inside


def disc(shape: tuple[int, int], points: NDArray[np.float64], radius: int = RADIUS) -> Bools:
    """Mark what lies within a radius of points."""
    marked = np.zeros(shape, bool)
    stamp(marked, points, ellipse((2 * radius + 1, 2 * radius + 1)), (False, False))
    return marked


def stamp(mask: Bools, points: NDArray[Any], shape: Bools, wrap: Wrap) -> None:
    """Mark copies of a shape around points, as far as they lie inside."""
    rows, columns = np.nonzero(shape)
    offsets = np.stack([rows - shape.shape[0] // 2, columns - shape.shape[1] // 2], axis=-1)
    places = (np.rint(points).astype(np.intp)[:, np.newaxis] + offsets).reshape(-1, 2)
    keep = np.ones(len(places), bool)
    for axis in range(2):
        side = mask.shape[axis]
        if wrap[axis]:
            places[:, axis] %= side
        else:
            keep &= (places[:, axis] >= 0) & (places[:, axis] < side)
    mask[tuple(places[keep].T)] = True


def cut(
    colours: Floats,
    centres: NDArray[Any],
    shape: Bools,
    background: Bools,
    *,
    net: bool,
    given: bool = False,
    wrap: Wrap = (False, False),
    seed: int = 0,
    model: Model = "mixture",
) -> Bools:
    """Part foreground from background.

    Parameters
    ----------
    colours : (H, W, 3) float32
        Lab / 100.
    centres : (n, 2)
        The texels, the chosen one first.
    shape : bool
        What of the chosen one's box is foreground, as far as is known.
    background : (H, W) bool
        Known background.
    net : bool
        Whether the foreground is connected: then what it looks like is what in the boxes looks least like background.
    given : bool
        Whether ``shape`` is certain.
    """
    size = background.shape
    flat = colours.reshape(-1, 3).astype(np.float64)
    back = _some(flat[background.ravel()], seed)
    likely = np.zeros(size, bool)
    stamp(likely, centres, np.ones_like(shape) if net and not given else shape, wrap)
    likely &= ~background
    cost = [np.zeros(0)] * 2
    if model == "nearest":
        cost = [_nearest(flat, samples) for samples in (back, _some(flat[likely.ravel()], seed + 1))]
    else:
        cost[0] = -Mixture.fit(back, seed=seed).log(flat)
        fore = flat[likely.ravel()]
        if net and not given:
            unlike = cost[0][likely.ravel()]
            fore = fore[unlike >= np.quantile(unlike, 1 - ALIKE)]
        cost[1] = -Mixture.fit(_some(fore, seed + 1), seed=seed + 1).log(flat)
    difference = np.clip(cost[1] - cost[0], -NATS, NATS).reshape(size)
    unary = np.stack([np.maximum(-difference, 0), np.maximum(difference, 0)], axis=-1).astype(np.float32)
    if not net or given:
        sure = np.zeros(size, bool)
        stamp(sure, centres[:1], shape, wrap)
        unary[sure & ~background, 0] = np.inf
    unary[background, 1] = np.inf
    return binary_labels(unary, _smoothness(colours, wrap, model), wrap=wrap).mask


def _some(samples: NDArray[np.float64], seed: int) -> NDArray[np.float64]:
    """Take at most `SAMPLES`, at even steps from a hashed start."""
    if len(samples) <= SAMPLES:
        return samples
    at = (np.arange(SAMPLES) + uniform(seed, 1 << 20)) * (len(samples) / SAMPLES)
    return samples[np.minimum(at.astype(np.intp), len(samples) - 1)]


def _nearest(colours: NDArray[np.float64], samples: NDArray[np.float64]) -> NDArray[np.float64]:
    """Equation 2, its sign made right: the squared distance to the nearest sample, of colours from 0 to 255."""
    from scipy.spatial import cKDTree

    found: NDArray[np.float64] = (255 * cKDTree(samples).query(colours)[0]) ** 2
    return found


def _smoothness(colours: Floats, wrap: Wrap, model: Model) -> Sequence[Any]:
    """Equation 3, for pairs along each axis; its sigma is that of the picture, or 1 to the letter."""
    squares = [((colours - np.roll(colours, -1, axis)) ** 2).sum(axis=-1) for axis in range(2)]
    inner = [s if wrap[axis] else np.delete(s, -1, axis) for axis, s in enumerate(squares)]
    mean = float(np.concatenate([s.ravel() for s in inner]).mean(dtype=np.float64))
    scale = 1 / max(2 * mean, 1e-12) if model == "mixture" else 255**2 / 2
    strength = SMOOTH if model == "mixture" else 1.0
    return [(strength * np.exp(-s * scale)).astype(np.float32) for s in squares]


def tidy(mask: Bools, area: float) -> Bools:
    """Fill small holes, smooth the outline by a pixel, and drop specks; ``area`` is the chosen texel's."""
    from scipy import ndimage

    pieces, count = ndimage.label(mask)
    holes, _ = ndimage.label(~mask)
    size = np.bincount(holes.ravel())
    # The component around a hole is the one above its first pixel.
    first = np.unique(holes, return_index=True)[1]
    above = np.where(first >= mask.shape[1], pieces.ravel()[first - mask.shape[1]], 0)
    areas = np.bincount(pieces.ravel(), minlength=count + 1)
    fill = (above > 0) & (size[: len(first)] < HOLE * np.minimum(areas[above], 4 * area))
    fill[0] = False
    opened = ndimage.binary_opening(np.pad(mask | fill[holes], 1, mode="edge"))[1:-1, 1:-1]
    pieces, count = ndimage.label(opened)
    kept = np.bincount(pieces.ravel(), minlength=count + 1) >= SPECK * area
    kept[0] = False
    cleaned: Bools = kept[pieces]
    return cleaned

"""Find the pixels of elements (section 3.3) by a graph cut between foreground and background colours."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import exp_single
from texrs._engine.noise import uniform
from texrs._typing import Bools, Floats
from texrs.elements._layout import Layout
from texrs.elements._mixture import Mixture
from texrs.elements._options import Model
from texrs.kernels.seam import binary_labels

Wrap: TypeAlias = tuple[bool, bool]

SMOOTH = 2.0
"""Cost of a boundary between two neighbouring pixels of the same colour."""
NATS, PRIOR = 12.0, 6.0
"""Maximum cost of a pixel's colour, and bonus for the middle of an element, both in nats."""
RADIUS = 4
"""Radius around a point of the background that counts as background, in pixels."""
SAMPLES = 4000
"""Maximum number of colour samples of the foreground, and of the background, that a colour model is fitted to."""
HOLE, SPECK = 0.1, 0.25
"""Maximum area of a hole that is filled, as a share of the area of its component.

Minimum area of a component, as a share of the area of the chosen element.
"""
CORE, MESH, OUTER, FAR = 0.8, 0.6, 0.9, 1.3
"""Sizes relative to the box: the middle of an element, and the middle of a mesh.

The last values are the inner limits of the net around a mesh, and of the background around separate elements.
"""
WHOLE = 0.35
"""Minimum distance of a detection from the border for learning colours from it, in box sides."""
ALIKE = 0.3
"""Share of the pixels of a possible net that its colours are learned from.

These pixels differ most from the background.
"""


def ellipse(box: tuple[int, int], share: float = 1.0) -> Bools:
    """Return a mask of the ellipse inscribed in a box, scaled by ``share``."""
    rows, columns = (np.arange(n) - (n - 1) / 2 for n in box)
    inside: Bools = np.add.outer((2 * rows / box[0]) ** 2, (2 * columns / box[1]) ** 2) <= share**2
    return inside


def disc(shape: tuple[int, int], points: NDArray[np.float64], radius: int = RADIUS) -> Bools:
    """Return a mask of the pixels within a radius of any of the points."""
    marked = np.zeros(shape, bool)
    stamp(marked, points, ellipse((2 * radius + 1, 2 * radius + 1)), (False, False))
    return marked


def pose(shape: Bools, angle: float, scale: float) -> Bools:
    """Return a shape rotated by an angle in degrees, and scaled about its middle.

    The sense of rotation is the same as in the element search.
    """
    from scipy.ndimage import affine_transform

    turn = np.deg2rad(angle)
    back = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]) / scale
    reach = np.abs(np.linalg.inv(back)) @ np.array(shape.shape)
    size = np.array([round_to_odd(n) for n in reach])
    offset = (np.array(shape.shape) - 1) / 2 - back @ ((size - 1) / 2)
    posed = affine_transform(shape.astype(np.float32), back, offset, output_shape=tuple(size), order=1)
    return np.asarray(posed >= 0.5)


def stamp_posed(mask: Bools, points: NDArray[Any], poses: NDArray[np.float64], shape: Bools, wrap: Wrap) -> None:
    """Mark copies of a shape around points. The columns of ``poses`` are the rotation in degrees and the scale of each."""
    for angle, scale in np.unique(poses, axis=0).tolist():
        here = ((poses == (angle, scale)).all(axis=1)).nonzero()[0]
        plain = angle == 0.0 and scale == 1.0
        stamp(mask, points[here], shape if plain else pose(shape, angle, scale), wrap)


def stamp(mask: Bools, points: NDArray[Any], shape: Bools, wrap: Wrap) -> None:
    """Mark copies of a shape around points. Parts outside the image are dropped, or wrap along periodic axes."""
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


def cut_foreground(
    colours: Floats,
    centres: NDArray[Any],
    box: tuple[int, int],
    background: Bools,
    *,
    layout: Layout,
    poses: NDArray[np.float64] | None = None,
    shape: Bools | None = None,
    wrap: Wrap = (False, False),
    seed: int = 0,
    model: Model = "mixture",
) -> Bools:
    """Return the foreground mask of a texture by a graph cut between the colours of elements and background.

    Parameters
    ----------
    colours : (H, W, 3) float32
        Colours in Lab / 100.
    centres : (n, 2)
        Centres of the elements in pixels, the centre of the chosen element first.
    box : tuple of int
        Height and width of the box of an element.
    background : (H, W) bool
        Known background.
    layout : Layout
        Layout of the elements. For a net, a box can contain a mesh. Other elements cover the middles of their boxes.
    poses : (n, 2), optional
        Rotation in degrees and relative size of each element. They are applied to the middle of its box. Default: the
        rotation and size of the chosen element.
    shape : bool, optional
        Foreground of the chosen element within its box, if it is known.
    """
    size = background.shape
    if layout == Layout.JOINTED and model == "mixture":
        colours = flatten_shading(colours, max(box), wrap)
    flat = colours.reshape(-1, 3).astype(np.float64)

    turned = np.tile((0.0, 1.0), (len(centres), 1)) if poses is None else poses

    def mark(part: Bools, number: int | None = None) -> Bools:
        marked = np.zeros(size, bool)
        stamp_posed(marked, centres[:number], turned[:number], part, wrap)
        return marked

    def cost(mine: Sequence[NDArray[np.float64]], number: int) -> NDArray[np.float64]:
        samples = np.concatenate([_subsample(m, SAMPLES // len(mine), seed + number) for m in mine if len(m)])
        if model == "nearest":
            return _measure_nearest_costs(flat, samples)
        return -Mixture.fit(samples, seed=seed + number).log(flat)

    half = WHOLE * turned[:, 1:] * np.array(box)
    whole = ((centres >= half) & (centres <= np.array(size) - 1 - half)) | np.array(wrap)
    whole[0] = True
    # Do not learn from detections cut by the border, because they can be wrong.
    centres, turned = centres[whole.all(axis=1)], turned[whole.all(axis=1)]
    known = flat[background.ravel()]
    core = shape if shape is not None else ellipse(box, CORE)
    certain = mark(core, 1) & ~background
    fore, back = mark(core) & ~background, np.zeros(size, bool)
    unlikeness, mesh = cost([known], 0), False
    if layout == Layout.CONNECTED and shape is None:
        certain[:] = False
        outer = mark(~ellipse(box, OUTER)) & ~background
        mesh = bool(np.median(unlikeness[fore.ravel()]) < np.median(unlikeness[outer.ravel()]))
        if mesh:
            # The box contains a mesh of the net: the net is around it, and the middle of the mesh is background.
            fore, back = outer & ~fore, mark(ellipse(box, MESH)) & ~outer
        unlike = unlikeness[fore.ravel()]
        fore.ravel()[np.flatnonzero(fore.ravel())[unlike < np.quantile(unlike, 1 - ALIKE)]] = False
    elif layout == Layout.DISJOINT and model == "mixture":
        back = ~mark(np.ones((round_to_odd(box[0] * FAR), round_to_odd(box[1] * FAR)), bool))
    costs = [cost([known, flat[(back & ~background).ravel()]], 0), cost([flat[fore.ravel()]], 1)]
    difference = np.clip(costs[1] - costs[0], -NATS, NATS).reshape(size)
    if model == "mixture" and (layout != Layout.CONNECTED or mesh):
        difference += np.where(mark(ellipse(box, MESH)), PRIOR if mesh else -PRIOR, 0)
    unary = np.stack([np.maximum(-difference, 0), np.maximum(difference, 0)], axis=-1).astype(np.float32)
    unary[certain, 0] = np.inf
    unary[background, 1] = np.inf
    return binary_labels(unary, _measure_smoothness_costs(colours, wrap, model), wrap=wrap).mask


def flatten_shading(colours: Floats, reach: float, wrap: Wrap) -> Floats:
    """Remove slow changes of colour, which are lighting if elements are spread evenly."""
    from scipy.ndimage import gaussian_filter

    mode = ["wrap" if w else "nearest" for w in wrap]
    slow = np.stack([gaussian_filter(colours[..., c], reach, mode=mode) for c in range(3)], axis=-1)
    return np.asarray(colours - slow + slow.mean(axis=(0, 1)), np.float32)


def round_to_odd(length: float) -> int:
    """Return the odd whole number nearest to a length, at least 3."""
    return max(3, 2 * int(np.floor(length / 2)) + 1)


def _subsample(samples: NDArray[np.float64], most: int, seed: int) -> NDArray[np.float64]:
    """Return at most ``most`` evenly spaced samples. The first one depends on the seed."""
    if len(samples) <= most:
        return samples
    at = (np.arange(most) + uniform(seed, 1 << 20)) * (len(samples) / most)
    return samples[np.minimum(at.astype(np.intp), len(samples) - 1)]


def _measure_nearest_costs(colours: NDArray[np.float64], samples: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the squared distance of colours to the nearest sample (equation 2 with corrected sign), on a scale of 0 to 255."""
    from scipy.spatial import cKDTree

    found: NDArray[np.float64] = (255 * cKDTree(samples).query(colours)[0]) ** 2
    return found


def _measure_smoothness_costs(colours: Floats, wrap: Wrap, model: Model) -> Sequence[Any]:
    """Return the cost of a boundary between neighbours (equation 3), along each axis.

    Its sigma is measured in the image. The model of the paper uses sigma 1, as printed.
    """
    squares = [((colours - np.roll(colours, -1, axis)) ** 2).sum(axis=-1) for axis in range(2)]
    inner = [s if wrap[axis] else np.delete(s, -1, axis) for axis, s in enumerate(squares)]
    mean = float(np.concatenate([s.ravel() for s in inner]).mean(dtype=np.float64))
    scale = 1 / max(2 * mean, 1e-12) if model == "mixture" else 255**2 / 2
    strength = SMOOTH if model == "mixture" else 1.0
    return [np.float32(strength) * exp_single(-s * scale) for s in squares]


def tidy_mask(mask: Bools, area: float, *, net: bool = False) -> Bools:
    """Fill small holes in a mask, smooth its outline by a pixel, and remove small components.

    ``area`` is the area of the chosen element.

    If ``net``, the outline is not smoothed and only very small components are removed, because nets consist of thin
    lines.
    """
    from scipy import ndimage

    pieces, count = ndimage.label(mask)
    holes, _ = ndimage.label(~mask)
    size = np.bincount(holes.ravel())
    # A hole is in the component of the pixel above the first pixel of the hole.
    first = np.unique(holes, return_index=True)[1]
    above = np.where(first >= mask.shape[1], pieces.ravel()[first - mask.shape[1]], 0)
    areas = np.bincount(pieces.ravel(), minlength=count + 1)
    fill = (above > 0) & (size[: len(first)] < HOLE * np.minimum(areas[above], 4 * area))
    fill[0] = False
    opened = mask | fill[holes]
    if not net:
        opened = ndimage.binary_opening(np.pad(opened, 1, mode="edge"))[1:-1, 1:-1]
    pieces, count = ndimage.label(opened)
    kept = np.bincount(pieces.ravel(), minlength=count + 1) >= (SPECK / 5 if net else SPECK) * area
    kept[0] = False
    cleaned: Bools = kept[pieces]
    return cleaned

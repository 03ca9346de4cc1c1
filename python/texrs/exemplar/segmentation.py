"""Split an exemplar into layers, and its layers into elements.

Layers: a mean-shift filter (Comaniciu and Meer, IEEE PAMI 2002), the graph-based merge of Felzenszwalb and Huttenlocher
(IJCV 2004), and a k-means of the regions' mean colours. Elements (child layers): components of the layers above the
background, split where they touch; where nothing speaks for them, a jittered grid of cells.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, as_int, to_unit
from texrs._engine.noise import uniform
from texrs._typing import Array, Floats, Labels, Progress
from texrs.errors import InvalidInput
from texrs.exemplar import components as _elements
from texrs.exemplar.layers import Regions, smooth_on_grain
from texrs.exemplar.regularity import Lattice, lattice

__all__ = ["Children", "Segmentation", "segment"]

Children: TypeAlias = Literal["auto", "components", "grid", "none"]

LEAST_COVERED, LARGEST, SPREAD = 0.05, 0.25, 1.6
"""Elements cover at least this share of the image, each at most this one, and their areas vary by at most so many means."""
WHOLE, INSIDE, OUTSIDE, HEAP = 0.79, 1.6, 1.5, 0.6
"""Least solidity; least contrast across outlines over that inside; over that of the background, unless they lie in a heap,
which covers at least this share of the image and has a background of gaps."""
CONVINCING = 0.83
"""Score of elements from which on no other background is tried."""
USUAL_LAYERS, MOST_LAYERS = 2, 4
"""Layers by default, and at most unless asked for."""
APART, CLEARLY, SAME_SIZE = 0.45, 1.15, 0.6
"""Share of the image that elements which lie apart cover at most; how many times more of it further layers must bring; least
ratio of median areas of elements that are of the same size."""
SMOOTH_GROUND = 0.6
"""Share of the ground that may be smooth where the ground is taken to be of fine grain."""
GRID_SHARE = 1 / 6
"""Side of a grid cell, as a share of the exemplar's shorter side."""


@dataclass(frozen=True, slots=True, eq=False)
class Segmentation:
    """An exemplar in layers and elements.

    Attributes
    ----------
    layers : (H, W) int32
        The layer of each pixel; 0 is the background.
    elements : (H, W) int32
        The element of each pixel, from 1; 0 is the background.
    children : {"components", "grid", "none", "labels"}
        How the elements were found.
    reason : str
        Why the grid was taken when components were asked for automatically, and what keeps elements in their places;
        empty otherwise.
    lattice : Lattice, optional
        The lattice that the exemplar repeats on, if any. Elements marked by hand are free of it.

    """

    layers: Labels
    elements: Labels
    children: str
    reason: str
    lattice: Lattice | None = None

    @property
    def count(self) -> int:
        """Number of elements."""
        return int(self.elements.max())

    def depth(self, reach: float) -> Floats:
        """Return how deep inside an element each pixel is: 0 at its outline and outside, 1 from ``reach`` pixels on."""
        from scipy.ndimage import distance_transform_edt

        labels = np.pad(self.elements, 1, mode="edge")
        outline = np.zeros(labels.shape, bool)
        for axis in range(2):
            change = np.diff(labels, axis=axis) != 0
            outline |= np.pad(change, [(0, int(a == axis)) for a in range(2)])
            outline |= np.pad(change, [(int(a == axis), 0) for a in range(2)])
        if not outline.any():
            return np.asarray(self.elements > 0, np.float32)
        distance = distance_transform_edt(~outline)[1:-1, 1:-1]
        return np.asarray(np.clip(distance / reach, 0, 1) * (self.elements > 0), np.float32)


def segment(
    image: Array,
    *,
    layers: int | None = None,
    children: Children = "auto",
    labels: NDArray[np.integer] | None = None,
    progress: Progress | None = None,
) -> Segmentation:
    """Segment an exemplar into a background and elements.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array
        The exemplar, any dtype; the first three channels count, or the first one when there are two.
    layers : int, optional
        Number of colour layers, 1 to 16. Fewer are made where the image has fewer colours. By default two, or three or
        four where these find clearly more elements of the same size that lie apart; where the ground is of fine grain,
        what is smooth belongs to the layer above it.
    children : {"auto", "components", "grid", "none"}
        "components": connected pieces of the layers above the background. "grid": jittered cells of 1/6 of the side,
        for images without separate elements. "none": whole layers. "auto": components, or the grid where nothing
        speaks for them: they cover less than 5 % of the image or one more than 25 %, they are ragged, of all sizes,
        or their outlines stand out neither from what they hold nor from what lies around them.
    labels : (H, W) array of int, optional
        Elements marked by hand, 0 = background. Replaces the whole segmentation.
    progress : callable, optional
        Called as ``progress("segment", share)`` along the way, with a rising share; raising stops the work. The longest
        step between two calls is scikit-image's merge of regions: 0.7 s for 1024 x 1024 pixels, growing with these.

    Returns
    -------
    Segmentation
        Layers and elements.

    Raises
    ------
    InvalidInput
        An argument of another shape, type or range.

    Examples
    --------
    >>> from texrs import samples
    >>> from texrs.exemplar import segmentation as segment
    >>> bool(segment.segment(samples.dots().image).count > 10)
    True

    """
    pixels = as_image(image)
    height, width = pixels.shape[:2]
    most = USUAL_LAYERS if layers is None else as_int(layers, "layers", 1, 16)
    if children not in ("auto", "components", "grid", "none"):
        raise InvalidInput(f"children: allowed are auto, components, grid and none; got {children!r}")
    if labels is not None:
        return _from_labels(labels, (height, width))
    rgb = _colours(to_unit(pixels))
    watch = _Watch(progress)
    regions = Regions.of(rgb, watch)
    found = regions.layers(most)
    if children == "none":
        return Segmentation(found, found.copy(), "none", "")
    regular = lattice(rgb)
    reasons = [f"elements keep to {regular}"] if regular else []
    if children != "grid":
        seen = _Seen.of(rgb)
        found, elements, trouble = _best_background(found, seen, watch)
        if layers is None:
            smooth = None if trouble or (elements > 0).mean() > APART else _smooth_too(rgb, seen, found, elements)
            if smooth is not None:
                found, elements = smooth
            else:
                found, elements, trouble = _more_layers(regions, seen, found, elements, trouble, watch)
        if children == "components" or not trouble:
            return Segmentation(found, _elements.whole(elements), "components", "; ".join(reasons), regular)
        reasons.insert(0, trouble)
    return Segmentation(found, _grid(height, width), "grid", "; ".join(reasons), regular)


class _Watch:
    """Reports a share that comes nearer to the whole with each call: nobody knows how many steps there will be."""

    def __init__(self, progress: Progress | None) -> None:
        self.progress, self.left = progress, 1.0

    def __call__(self) -> None:
        self.left *= 0.9
        if self.progress is not None:
            self.progress("segment", 1 - self.left)


def _from_labels(labels: NDArray[np.integer], shape: tuple[int, int]) -> Segmentation:
    given = np.asarray(labels)
    if given.shape != shape or given.dtype.kind not in "biu":
        raise InvalidInput(f"labels: needs integers of shape {shape}, got {given.dtype} {given.shape}")
    if given.size and int(given.min()) < 0:
        raise InvalidInput(f"labels: 0 is the background and elements count from 1, got {int(given.min())}")
    values, dense = np.unique(given, return_inverse=True)
    dense = dense.reshape(shape).astype(np.int32)
    if values[0] != 0:
        dense += 1
    return Segmentation((dense > 0).astype(np.int32), dense.astype(np.int32), "labels", "")


def _colours(unit: Floats) -> Floats:
    """Return three colour channels in [0, 1]: those there are, or the first of them three times."""
    chosen = unit[..., :3] if unit.shape[-1] >= 3 else np.repeat(unit[..., :1], 3, axis=-1)
    return np.ascontiguousarray(chosen)


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """What elements are found by, beside their layers."""

    crease: Floats
    contrast: Floats

    @classmethod
    def of(cls, rgb: Floats) -> _Seen:
        lab = _elements.lightness_and_colour(rgb)
        return cls(_elements.creases(lab), _elements.contrast(lab))

    def elements(self, layers: Labels) -> tuple[Labels, _elements.Evidence]:
        """Find the elements of the layers above 0, and what speaks for them."""
        found = _elements.find(layers, self.crease)
        return found, _elements.evidence(found, self.crease, self.contrast)


def _best_background(layers: Labels, seen: _Seen, watch: Callable[[], object]) -> tuple[Labels, Labels, str]:
    """Take as the background the layer that leaves the most convincing elements; put it first.

    Gives the layers, the elements and why they cannot be trusted, which is empty if they can.
    """
    best: tuple[float, Labels, Labels, str] | None = None
    for background in range(int(layers.max()) + 1):
        swapped = np.where(layers == background, 0, np.where(layers < background, layers + 1, layers)).astype(np.int32)
        watch()
        elements, evidence = seen.elements(swapped)
        watch()
        trouble = _trouble(evidence)
        score = evidence.solidity - 0.05 * background - (1.0 if trouble else 0.0)
        if best is None or score > best[0] + 1e-9:
            best = (score, swapped, elements, trouble)
        if score >= CONVINCING:
            break
    assert best is not None
    return best[1:]


def _more_layers(
    regions: Regions,
    seen: _Seen,
    layers: Labels,
    elements: Labels,
    trouble: str,
    watch: Callable[[], object],
) -> tuple[Labels, Labels, str]:
    """Add layers as long as they find clearly more elements of the same size, which lie apart.

    Two layers see the light stones on a dark ground, and not those that are as dark as the ground.
    """
    for count in range(USUAL_LAYERS + 1, MOST_LAYERS + 1):
        if trouble or (elements > 0).mean() > APART:
            break
        more = _best_background(regions.layers(count), seen, watch)
        area, before = (np.bincount(e.ravel())[1:] for e in (more[1], elements))
        alike = len(area) > 0 and SAME_SIZE <= np.median(area) / np.median(before) <= 1 / SAME_SIZE
        if more[2] or area.sum() > APART * elements.size or not alike or area.sum() < CLEARLY * before.sum():
            break
        layers, elements, trouble = more
    return layers, elements, trouble


def _smooth_too(rgb: Floats, seen: _Seen, layers: Labels, elements: Labels) -> tuple[Labels, Labels] | None:
    """Add what is smooth on a ground of fine grain, as stones as dark as their sand; None where that is not clearly more."""
    smooth = smooth_on_grain(rgb)
    # Where there is no grain at all, only outlines are not smooth.
    if smooth is None or smooth[layers == 0].mean() > SMOOTH_GROUND:
        return None
    more = (smooth | (layers > 0)).astype(np.int32)
    found, evidence = seen.elements(more)
    if _trouble(evidence) or (found > 0).sum() < CLEARLY * (elements > 0).sum():
        return None
    return more, found


def _trouble(evidence: _elements.Evidence) -> str:
    """Return why elements cannot be trusted; empty if they can."""
    e = evidence
    if e.covered < LEAST_COVERED:
        return f"elements cover {e.covered:.0%} of the image, less than {LEAST_COVERED:.0%}"
    if e.largest > LARGEST:
        return f"one element covers {e.largest:.0%} of the image, more than {LARGEST:.0%}"
    if e.solidity < WHOLE:
        return f"elements fill only {e.solidity:.0%} of their convex hulls, less than {WHOLE:.0%}"
    if e.inside < INSIDE:
        return f"contrast across outlines is only {e.inside:.2f} times that inside elements, less than {INSIDE}"
    if e.covered < HEAP and e.outside < OUTSIDE:
        return f"contrast across outlines is only {e.outside:.2f} times that of the background, less than {OUTSIDE}"
    if e.spread > SPREAD:
        return f"the areas of elements vary by {e.spread:.2f} of their mean, more than {SPREAD}"
    return ""


def _grid(height: int, width: int) -> Labels:
    """Cut the image into jittered Voronoi cells; every other cell, as on a chequerboard, is an element."""
    from scipy.spatial import KDTree

    side = max(6.0, GRID_SHARE * min(height, width))
    rows, columns = max(1, round(height / side)), max(1, round(width / side))
    centres, chosen = [], []
    for i in range(rows):
        for j in range(columns):
            jitter = [0.5 + 0.6 * (uniform(0, i, j, axis) - 0.5) for axis in range(2)]
            centres.append([(i + jitter[0]) * height / rows, (j + jitter[1]) * width / columns])
            chosen.append((i + j) % 2 == 0)
    label = np.zeros(len(centres), np.int32)
    label[np.array(chosen)] = np.arange(1, sum(chosen) + 1, dtype=np.int32)
    grid = np.stack(np.meshgrid(np.arange(height), np.arange(width), indexing="ij"), axis=-1).reshape(-1, 2)
    nearest = KDTree(np.array(centres)).query(grid)[1]
    return np.asarray(label[nearest], np.int32).reshape(height, width)

"""Split an exemplar into layers, and its layers into elements.

Layers: a mean-shift filter (Comaniciu and Meer, IEEE PAMI 2002), the graph-based merge of Felzenszwalb and Huttenlocher
(IJCV 2004), and a k-means of the regions' mean colours. Elements (child layers): components of the layers above the
background, split where they touch; where that cannot be trusted, a jittered grid of cells.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, as_int, to_unit
from texrs._typing import Array, Bools, Floats, Labels
from texrs.errors import InvalidInput
from texrs.kernels.mean_shift import mean_shift
from texrs.kernels.noise import uniform

__all__ = ["Children", "Segmentation", "segment"]

Children: TypeAlias = Literal["auto", "components", "grid", "none"]

SPATIAL_RADIUS, RANGE_RADIUS = 6, 14 / 255
"""Of the mean-shift filter: pixels, and colour units of [0, 1]."""
MERGE_SCALE, MERGE_BLUR, MERGE_MINIMUM = 60, 0.4, 24
"""k, sigma and least area in pixels of the graph-based merge, colours in 0..255."""
WHOLE_SOLIDITY = 0.75
"""Share of their convex hulls that elements must fill to be taken for things rather than for the gaps between them."""
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
        Why the grid was taken when components were asked for automatically; empty otherwise.

    """

    layers: Labels
    elements: Labels
    children: str
    reason: str

    @property
    def count(self) -> int:
        """Number of elements."""
        return int(self.elements.max())

    def depth(self, reach: float) -> Floats:
        """Give how deep inside an element each pixel is: 0 at its outline and outside, 1 from ``reach`` pixels on."""
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
    layers: int = 2,
    children: Children = "auto",
    labels: NDArray[np.integer] | None = None,
) -> Segmentation:
    """Segment an exemplar into a background and elements.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array
        The exemplar, any dtype; the first three channels count, or the first one when there are two.
    layers : int
        Number of colour layers, 1 to 16. Fewer are made where the image has fewer colours.
    children : {"auto", "components", "grid", "none"}
        "components": connected pieces of the layers above the background. "grid": jittered cells of 1/6 of the side,
        for images without separate elements. "none": whole layers. "auto": components, or the grid where components
        cover less than 5 % or more than 60 % of the image, or one covers more than 25 %.
    labels : (H, W) array of int, optional
        Elements marked by hand, 0 = background. Replaces the whole segmentation.

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
    >>> from texrs import samples, segment
    >>> bool(segment.segment(samples.dots().image).count > 10)
    True

    """
    pixels = as_image(image)
    height, width = pixels.shape[:2]
    as_int(layers, "layers", 1, 16)
    if children not in ("auto", "components", "grid", "none"):
        raise InvalidInput(f"children: allowed are auto, components, grid and none; got {children!r}")
    if labels is not None:
        return _from_labels(labels, (height, width))
    found = _layers(to_unit(pixels), layers)
    if children == "none":
        return Segmentation(found, found.copy(), "none", "")
    if children == "grid":
        return Segmentation(found, _grid(height, width), "grid", "")
    found, elements = _best_background(found)
    trouble = _trouble(elements)
    if children == "auto" and trouble:
        return Segmentation(found, _grid(height, width), "grid", trouble)
    return Segmentation(found, elements, "components", "")


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


# --- layers ----------------------------------------------------------------------------------------------------------


def colours(unit: Floats) -> Floats:
    """Give three colour channels in [0, 1]: those there are, or one of them three times."""
    chosen = unit[..., :3] if unit.shape[-1] >= 3 else np.repeat(unit[..., :1], 3, axis=-1)
    return np.ascontiguousarray(chosen)


def _layers(unit: Floats, count: int) -> Labels:
    """Assign each pixel to one of ``count`` layers, the largest first."""
    from skimage.color import rgb2lab
    from skimage.segmentation import felzenszwalb

    rgb = colours(unit)
    filtered: Floats = mean_shift(rgb, SPATIAL_RADIUS, RANGE_RADIUS)
    region = felzenszwalb(filtered.astype(np.float64), MERGE_SCALE, MERGE_BLUR, MERGE_MINIMUM)
    area = np.bincount(region.ravel()).astype(np.float64)
    lab = rgb2lab(filtered).reshape(-1, 3)
    mean = np.stack([np.bincount(region.ravel(), lab[:, c]) / area for c in range(3)], axis=-1)
    layer = _weighted_k_means(mean, area, min(count, len(area)))
    share = np.bincount(layer, area)
    order = np.argsort(-share, kind="stable")
    rank = np.empty(len(order), np.int32)
    rank[order] = np.arange(len(order), dtype=np.int32)
    result: Labels = rank[layer][region]
    return result


def _weighted_k_means(points: NDArray[np.float64], weight: NDArray[np.float64], count: int) -> NDArray[np.intp]:
    """Cluster weighted points; starts at the heaviest and then the farthest ones, so it needs no randomness."""
    centres = points[[int(np.argmax(weight))]]
    while len(centres) < count:
        distance = ((points[:, None] - centres[None]) ** 2).sum(axis=-1).min(axis=1)
        if distance.max() < 1e-12:
            break
        centres = np.concatenate([centres, points[[int(np.argmax(distance * weight))]]])
    nearest = np.zeros(len(points), np.intp)
    for _ in range(100):
        distance = ((points[:, None] - centres[None]) ** 2).sum(axis=-1)
        nearest, before = distance.argmin(axis=1), nearest
        if (nearest == before).all() and _ > 0:
            break
        for k in range(len(centres)):
            mine = nearest == k
            if mine.any():
                centres[k] = np.average(points[mine], axis=0, weights=weight[mine])
    return np.unique(nearest, return_inverse=True)[1]


# --- elements --------------------------------------------------------------------------------------------------------


def _best_background(layers: Labels) -> tuple[Labels, Labels]:
    """Take as the background the layer that leaves the most convincing elements; put it first."""
    best: tuple[float, Labels, Labels] | None = None
    for background in range(int(layers.max()) + 1):
        swapped = np.where(layers == background, 0, np.where(layers < background, layers + 1, layers)).astype(np.int32)
        elements = _components(swapped)
        score = _conviction(elements) - 0.05 * background
        if best is None or score > best[0] + 1e-9:
            best = (score, swapped, elements)
    assert best is not None
    return best[1], best[2]


def _conviction(elements: Labels) -> float:
    """Score elements: their mean solidity by area, less a penalty where they cannot be trusted."""
    return _solidity(elements) - (1.0 if _trouble(elements) else 0.0)


def _solidity(elements: Labels) -> float:
    """Give the share of their convex hulls that elements fill: gaps between things fill little of theirs."""
    from skimage.measure import regionprops

    regions = regionprops(elements)
    area = np.array([r.area for r in regions], np.float64)
    return float((area * [r.solidity for r in regions]).sum() / area.sum()) if len(area) else 0.0


def _components(layers: Labels) -> Labels:
    """Find the elements of the layers above 0: connected, with their small holes filled, split where they touch."""
    from scipy import ndimage
    from skimage.segmentation import watershed

    height, width = layers.shape
    least = max(20.0, 0.0015 * height * width)
    elements = np.zeros(layers.shape, np.int32)
    count = 0
    square = np.ones((3, 3), bool)
    for layer in range(1, int(layers.max()) + 1):
        mask = ndimage.binary_opening(ndimage.binary_closing(np.pad(layers == layer, 2, mode="edge"), square), square)
        pieces, _ = ndimage.label(mask[2:-2, 2:-2], square)
        for i, where in enumerate(ndimage.find_objects(pieces), start=1):
            piece = pieces[where] == i
            area = int(piece.sum())
            if area < least:
                continue
            parts = piece.astype(np.int32)
            if area > 0.08 * height * width or _solidity(parts) < 0.9:
                distance = ndimage.distance_transform_edt(np.pad(piece, 1, mode="constant"))[1:-1, 1:-1]
                smooth = ndimage.gaussian_filter(distance, 1.5)
                seeds = _peaks(smooth, piece, max(6, round(0.06 * min(height, width))))
                parts = watershed(-smooth, seeds, mask=piece).astype(np.int32)
            for part in range(1, int(parts.max()) + 1):
                mine = _fill_small_holes(parts == part)
                if mine.sum() >= least:
                    count += 1
                    elements[where][mine] = count
    return elements


def _fill_small_holes(piece: Bools) -> Bools:
    from scipy import ndimage

    filled: Bools = ndimage.binary_fill_holes(piece)
    holes, count = ndimage.label(filled & ~piece)
    if not count:
        return piece
    small = np.bincount(holes.ravel()) < 0.1 * piece.sum()
    small[0] = False
    result: Bools = piece | small[holes]
    return result


def _peaks(height_map: NDArray[np.float64], mask: Bools, separation: int) -> Labels:
    """Mark the local maxima that are at least ``separation`` apart, the highest first, ties in scan order."""
    from skimage.feature import peak_local_max

    peaks = peak_local_max(height_map, min_distance=separation, labels=mask.astype(np.int32), exclude_border=False)
    seeds = np.zeros(mask.shape, np.int32)
    for i, (row, column) in enumerate(peaks, start=1):
        seeds[row, column] = i
    return seeds


def _trouble(elements: Labels) -> str:
    """Say why the elements cannot be trusted; empty if they can."""
    area = np.bincount(elements.ravel())[1:] / elements.size
    covered = float(area.sum())
    if covered < 0.05:
        return f"elements cover {covered:.0%} of the image, less than 5 %"
    if area.max() > 0.25:
        return f"one element covers {area.max():.0%} of the image, more than 25 %"
    if (solidity := _solidity(elements)) < WHOLE_SOLIDITY:
        return f"elements fill only {solidity:.0%} of their convex hulls"
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

"""Find the cells of a connected texture: bricks in mortar, stones between gaps, honeycomb, scales.

Joints are lines that are darker or lighter than the cells between them. The sizes of cells and the lightness of joints
are not known in advance, so dark and light joints are tried with several sizes. The best tessellation has closed
joints, and solid cells of one size without joints inside. Each tessellation starts with too many cells. Neighbours are
then merged unless the joint between them, their common shape, or the usual size of cells is evidence for two cells.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_float, as_image, guidance, to_lab
from texrs._progress import ask
from texrs._show import brief
from texrs._typing import Array, Bools, Floats, Labels, Progress
from texrs.errors import InvalidInput
from texrs.exemplar.contours import measure_moments, trace
from texrs.exemplar.merging import join_parts, measure_usual_area
from texrs.exemplar.shapes import Shapes, mark_outlines, widen

__all__ = ["Cells", "fill_gaps", "find_cells", "take_cells"]

WORKING = 22.0
"""Width of a cell at the working resolution, in pixels. Images with larger cells are reduced."""
SIZES, STEP = (7.0, 0.4), 1.4
"""Cell widths that are tried: minimum in pixels, maximum as a share of the shorter side, and ratio between successive
widths.
"""
RADII = (0.14, 0.28)
"""Radii of the morphological closings that detect joints, in cell widths."""
JOINT = 82.0
"""Percentile of the joint strength above which pixels are first taken as joints."""
PARTS = 0.42
"""Minimum strength of a joint that separates cells, as a fraction of the range from the 40th to the 90th percentile."""
BASIN = 0.09
"""Minimum height between two basins of the distance map that become two cells, in cell widths."""
FRAGMENT = 0.15
"""Share of the usual area below which a part is merged with the neighbour behind the weakest joint."""
FEWEST = 4
"""Minimum number of cells for estimating their size."""
NEAR = (-0.75, 0.0, 0.75)
"""Sizes that are tried around a given width, as exponents of the step between sizes."""
CLEAR, SPREAD = 0.2, 0.2
"""Minimum distance from the outline, in cell widths, of the inner part of a cell that should be free of joints.

Standard deviation of the logarithm of areas below which cells count as equally large.
"""
EVEN, WIDTH = 0.38, 0.04
"""Score of a texture that is equally likely to have cells or not, and score difference for odds of 2.7 to 1.

A higher score was measured for 17 of 19 textures with cells, and for 0 of 12 without. The values were chosen on these
same textures.
"""
SURE, FINE = 0.15, 0.3
"""Minimum distance from the outline, in cell widths, where pixels keep their cell at full resolution.

Weight of the full-resolution lightness relative to the joint strength.
"""
GAP, MISSED = 0.15, 0.3
"""Minimum half width, in cell widths, and minimum area, in usual areas, of a gap that contains a missed cell."""


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """Cells of a texture, each with its own outline.

    Attributes
    ----------
    labels : (H, W) int32
        Cell of each pixel, from 1. Joints are divided among the adjacent cells, so that every pixel has a cell.
    outlines : (n, P, 2) float64
        Outline of each cell as P equally spaced points (row, column). Index n - 1 belongs to cell n.
    centre : (n, 2) float64
        Centroids of the outlines.
    area : (n,) float64
        Areas in squared pixels.
    angle : (n,) float64
        Direction of the longest axis, in degrees in [0, 180), from the column axis towards the row axis.
    whole : (n,) bool
        True if no border of the image cuts the cell.
    certain : (n,) float64
        Certainty of each cell, 0 to 1: how completely its joints close, times how free of joints its inside is.
    joints : (H, W) float32
        Joint strength: 0 inside cells, about 1 in joints.
    confidence : float
        Certainty of the whole tessellation, 0 to 1.
    polarity : int
        -1 if joints are darker than cells, 1 if they are lighter.

    """

    labels: Labels
    outlines: NDArray[np.float64]
    centre: NDArray[np.float64]
    area: NDArray[np.float64]
    angle: NDArray[np.float64]
    whole: Bools
    certain: NDArray[np.float64]
    joints: Floats
    confidence: float
    polarity: int

    __repr__ = brief

    @property
    def count(self) -> int:
        """Number of cells."""
        return len(self.area)

    @property
    def size(self) -> float:
        """Side of a square with the median area of cells, in pixels.

        Only cells that no border cuts are used. Borders cut large cells more often. Each cell is therefore weighted by
        the inverse probability that a cell of its size is uncut (Miles and Lantuéjoul). If there are too few uncut
        cells, the median of the larger half of all cells is used.
        """
        if np.count_nonzero(self.whole) < FEWEST:
            return float(np.sqrt(np.quantile(self.area, 0.75)))
        rows, columns = self.labels.shape
        high, wide = np.ptp(self.outlines[self.whole], axis=1).T
        weight = 1 / (np.maximum(rows - high, 1) * np.maximum(columns - wide, 1))
        order = np.argsort(self.area[self.whole], kind="stable")
        middle = np.searchsorted(np.cumsum(weight[order]), weight.sum() / 2)
        return float(np.sqrt(self.area[self.whole][order[min(middle, len(order) - 1)]]))

    @property
    def joint_width(self) -> float:
        """Usual width of a joint, in pixels: total area of joints divided by total outline length."""
        return 2 * float((self.joints > 0.5).sum()) / max(int(mark_outlines(self.labels).sum()), 1)


class _Tessellation(NamedTuple):
    """Cells found with one size and one polarity of joints, at the working resolution."""

    labels: Labels
    relief: Floats
    closed: NDArray[np.float64]
    clean: NDArray[np.float64]
    score: float
    polarity: int
    width: float


def find_cells(
    image: object, *, size: float | None = None, joints: object = None, progress: Progress | None = None
) -> Cells:
    """Find the cells of a connected texture.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array
        Texture with sides of at least 16, of any dtype.
    size : float, optional
        Approximate width of a cell across its shorter axis, in pixels. Default: estimated.
    joints : (H, W) array of bool, optional
        Mask of known joints. It gives one more tessellation, and the best of all is returned.
    progress : callable, optional
        Function that is called as ``progress("cells", share)``. An exception from it stops the work.

    Returns
    -------
    Cells
        The best tessellation. Its confidence is low if the texture probably has no cells.

    Raises
    ------
    InvalidInput
        If an argument has another type, shape or range.

    Examples
    --------
    >>> from texrs import samples
    >>> from texrs.exemplar.cells import find_cells
    >>> wall = samples.bricks((128, 128))
    >>> found = find_cells(wall.image)
    >>> found.polarity, found.confidence > 0.5
    (1, True)

    """
    pixels = as_image(image, "image", minimum=16)
    lab = to_lab(guidance(pixels))
    light = lab[..., 0]
    if joints is not None:
        joints = np.asarray(joints)
        if joints.shape != light.shape or joints.dtype != np.bool_:
            raise InvalidInput(f"joints: must be bool of shape {light.shape}, got {joints.dtype} {joints.shape}")
    sizes = _list_sizes(light.shape)
    if size is not None:
        about = as_float(size, "size", 3, max(light.shape))
        sizes = [about * STEP**k for k in NEAR]
    trials = [partial(_tessellate, light, s, p) for s in sizes for p in (-1, 1)]
    if joints is not None and joints.any() and not joints.all():
        seen = _project(lab, joints)
        trials += [partial(_tessellate_mask, joints, seen), *(partial(_tessellate, seen, s, 1) for s in sizes)]
    watch, best = progress or (lambda stage, share: ask()), None
    for done, trial in enumerate(trials):
        watch("cells", done / len(trials))
        found = trial()
        best = found if best is None or found.score > best.score else best
    assert best is not None  # at least one size is tried
    return _measure(best, light)


def take_cells(labels: Labels, image: object) -> Cells:
    """Create `Cells` from a label image of known cells.

    Parameters
    ----------
    labels : (H, W) array of int
        Cell of each pixel, from 1, with consecutive numbers; 0 in joints, which the adjacent cells share. If cells
        touch, their outlines are the joints.
    image : (H, W) or (H, W, C) array
        Texture, for measuring whether joints are darker or lighter.

    Returns
    -------
    Cells
        The cells, with a confidence of 1.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs.exemplar.cells import take_cells
    >>> halves = np.repeat([[1, 1, 0, 2, 2]], 4, axis=0)
    >>> take_cells(halves, np.zeros((4, 5))).labels[0].tolist()
    [1, 1, 1, 2, 2]

    """
    from scipy.ndimage import distance_transform_edt

    nearest = distance_transform_edt(labels == 0, return_distances=False, return_indices=True)
    full = np.ascontiguousarray(labels[tuple(nearest)], np.int32)
    joint = (labels == 0) | mark_outlines(full)
    outlines = trace(full, np.arange(1, int(full.max()) + 1))
    moments = measure_moments(outlines)
    relief, light = joint.astype(np.float32), to_lab(guidance(as_image(image)))[..., 0]
    sure, polarity = np.ones(len(outlines)), _compare(light, relief)
    whole = _mark_whole(full)
    return Cells(full, outlines, moments.centre, moments.area, moments.angle, whole, sure, relief, 1.0, polarity)


def fill_gaps(labels: Labels) -> Labels:
    """Return known cells with further cells in wide gaps, where cells were missed.

    Without them, the adjacent cells would share the gap, although no joint divides it.
    """
    from scipy.ndimage import distance_transform_edt, label

    count = int(labels.max())
    usual = float(np.median(np.bincount(labels.ravel())[1:])) if count else 0.0
    reach = GAP * float(np.sqrt(usual))
    depth = distance_transform_edt(labels == 0)
    pieces, _ = label(depth > reach)
    if not pieces.any():
        return labels
    away, at = distance_transform_edt(pieces == 0, return_indices=True)
    gaps = np.where((labels == 0) & (away < reach), pieces[tuple(at)], 0)
    large = np.bincount(gaps.ravel()) >= MISSED * usual
    large[0] = False
    # Leave joints of the usual width. The mean depth of a joint is about a quarter of its width, plus a half.
    narrow = depth[(labels == 0) & ~large[gaps]]
    gaps[depth <= (min(4 * float(narrow.mean()) - 2, 2 * reach) if len(narrow) else 0)] = 0
    # A gap that is not wider than a joint is not a cell.
    large &= np.bincount(gaps.ravel(), minlength=len(large)) > 0
    number = np.where(large, count + np.cumsum(large), 0)
    return np.asarray(np.where(labels > 0, labels, number[gaps]), np.int32)


def _project(lab: Floats, joints: Bools) -> Floats:
    """Return one channel that separates joints from cells best: a linear combination of colours (Fisher).

    Its values are higher in joints.
    """
    inside, outside = lab[joints].astype(np.float64), lab[~joints].astype(np.float64)
    within = (np.cov(inside.T, bias=True) * len(inside) + np.cov(outside.T, bias=True) * len(outside)) / lab[
        ..., 0
    ].size
    weight = np.linalg.solve(within + 1e-4 * np.eye(3), inside.mean(axis=0) - outside.mean(axis=0))
    return np.asarray(lab @ (weight / max(float(np.linalg.norm(weight)), 1e-9)), np.float32)


def _list_sizes(shape: tuple[int, ...]) -> list[float]:
    low, high = max(SIZES[0], min(shape) / 40), max(SIZES[0], SIZES[1] * min(shape))
    count = 1 + max(0, round(np.log(high / low) / np.log(STEP)))
    return [low * STEP**k for k in range(count)]


# --- one tessellation ------------------------------------------------------------------------------------------------


def _tessellate(light: Floats, size: float, polarity: int) -> _Tessellation:
    """Find cells of about one width, between dark joints (polarity -1) or light joints (1)."""
    from scipy.ndimage import distance_transform_edt, gaussian_filter, label
    from skimage.morphology import h_minima
    from skimage.segmentation import watershed

    shrink = min(1.0, WORKING / size)
    small = _shrink(light, shrink)
    width = size * shrink
    relief = _measure_relief(-polarity * small, width)
    joint = relief > np.percentile(relief, JOINT)
    depth = gaussian_filter(distance_transform_edt(~joint).astype(np.float32), 0.05 * width)
    floor = -np.minimum(depth, 0.6 * width)
    seeds, _ = label(h_minima(floor, BASIN * width))
    parts = watershed(0.25 * width * relief + 0.5 * floor, seeds).astype(np.int32)
    relief /= _find_threshold(relief)
    parts = join_parts(parts, relief, least=FRAGMENT * FRAGMENT * width**2)
    usual = measure_usual_area(np.bincount(parts.ravel())[1:].astype(np.float64))
    parts = join_parts(parts, relief, usual, least=FRAGMENT * usual)
    return _judge(parts, relief, width, polarity)


def _tessellate_mask(joints: Bools, seen: Floats) -> _Tessellation:
    """Use the connected areas between known joints as cells, and divide the joints between them."""
    from scipy.ndimage import distance_transform_edt, label
    from skimage.segmentation import watershed

    pieces, _ = label(~joints)
    areas = np.bincount(pieces.ravel())
    usual = measure_usual_area(areas[1:].astype(np.float64))
    pieces[areas[pieces] < FRAGMENT * usual] = 0
    _, pieces = np.unique(pieces, return_inverse=True)
    away = distance_transform_edt(pieces == 0)
    labels = watershed(away, pieces.reshape(joints.shape)).astype(np.int32)
    # Measure the joint strength in the image as well, because masks are often made from colours only.
    width = float(np.sqrt(usual))
    shrink = min(1.0, WORKING / width)
    relief = _measure_relief(-_shrink(seen, shrink), width * shrink)
    return _judge(labels, _resize(relief / _find_threshold(relief), joints.shape), width, 1)


def _find_threshold(relief: Floats) -> float:
    """Return the divisor of the joint strength after which the threshold between cells and joints is 0.5."""
    low, high = np.percentile(relief, (40, 90))
    return max(2 * float(low + PARTS * (high - low)), 1e-6)


def _shrink(light: Floats, factor: float) -> Floats:
    return _resize(light, tuple(max(8, round(n * factor)) for n in light.shape)) if factor < 1 else light


def _resize(values: Floats, shape: tuple[int, ...]) -> Floats:
    from skimage.transform import resize

    if values.shape == shape:
        return values
    smaller = shape[0] < values.shape[0]
    return np.asarray(resize(values, shape, order=1, anti_aliasing=smaller, preserve_range=True), np.float32)


def _measure_relief(light: Floats, width: float) -> Floats:
    """Return how strongly each pixel looks like a dark joint, at least 0.

    The strength is the sum of the change by morphological closings, and the darkness relative to the surroundings.
    """
    from scipy.ndimage import gaussian_filter, grey_closing
    from skimage.morphology import disk

    fine = gaussian_filter(light, max(0.6, 0.025 * width))
    found = np.zeros_like(fine)
    for share in RADII:
        filled = grey_closing(fine, footprint=disk(max(1, round(share * width)))) - fine
        found += filled / max(float(np.percentile(filled, 97)), 1e-6)
    mean = gaussian_filter(fine, width)
    spread = np.sqrt(gaussian_filter((fine - mean) ** 2, width))
    found += 0.5 * np.clip((mean - fine) / np.maximum(spread, 1e-6), -1, 2)
    return np.asarray(np.maximum(gaussian_filter(found, max(0.5, 0.03 * width)), 0), np.float32)


def _judge(labels: Labels, relief: Floats, width: float, polarity: int) -> _Tessellation:
    """Rate a tessellation by closed joints, cells without joints inside, solid cells and equal areas."""
    from scipy.ndimage import distance_transform_edt

    count = int(labels.max())
    outline = mark_outlines(labels)
    ridge = widen(relief) > 0.5
    # Subtract the share of an outline that would be on joints by chance.
    chance = min(0.9, float(ridge.mean()))
    closed = np.clip((_average(ridge, labels, outline, count) - chance) / (1 - chance), 0, 1)
    clean = 1 - _average(relief > 0.5, labels, distance_transform_edt(~outline) > CLEAR * width, count)
    area, solid = _measure_solidity(labels)
    whole = _mark_whole(labels)
    if count < FEWEST:
        return _Tessellation(labels, relief, closed, clean, 0.0, polarity, width)
    alike = np.log(area[whole] if np.count_nonzero(whole) >= FEWEST else area)
    spread = max(0.0, float(alike.std()) - SPREAD)
    closed_all, clean_all, solid_all = (float((x * area).sum() / area.sum()) for x in (closed, clean, solid))
    score = closed_all * clean_all * solid_all**4 * float(np.exp(-0.5 * spread))
    return _Tessellation(labels, relief, closed, clean, score, polarity, width)


def _average(values: Array, labels: Labels, where: Bools, count: int) -> NDArray[np.float64]:
    """Return the mean of values over the selected pixels of each label, or 0 if none is selected."""
    chosen = labels[where]
    number = np.bincount(chosen, minlength=count + 1)[1:]
    return np.asarray(np.bincount(chosen, values[where], count + 1)[1:] / np.maximum(number, 1))


def _measure_solidity(labels: Labels) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    shapes = Shapes.of(labels)
    return shapes.area[1:], shapes.measure_solidity()[1:]


def _mark_whole(labels: Labels) -> Bools:
    whole = np.ones(int(labels.max()) + 1, bool)
    for side in (labels[0], labels[-1], labels[:, 0], labels[:, -1]):
        whole[side] = False
    return whole[1:]


# --- the best one ----------------------------------------------------------------------------------------------------


def _measure(found: _Tessellation, light: Floats) -> Cells:
    """Compute the cells at full resolution and their measures."""
    labels, relief = (found.labels, found.relief) if found.labels.shape == light.shape else _enlarge(found, light)
    outlines = trace(labels, np.arange(1, int(labels.max()) + 1))
    moments = measure_moments(outlines)
    return Cells(
        labels,
        outlines,
        moments.centre,
        moments.area,
        moments.angle,
        _mark_whole(labels),
        found.closed * found.clean,
        relief,
        float(1 / (1 + np.exp((EVEN - found.score) / WIDTH))),
        _compare(light, relief),
    )


def _compare(light: Floats, relief: Floats) -> int:
    """Return 1 if joints are lighter than the other pixels, else -1."""
    joint = relief > 0.5
    return 1 if joint.any() and not joint.all() and light[joint].mean() > light[~joint].mean() else -1


def _enlarge(found: _Tessellation, light: Floats) -> tuple[Labels, Floats]:
    """Return the labels and the joint strength of a tessellation at full resolution.

    The borders of labels follow the ridges of the joints.
    """
    from scipy.ndimage import distance_transform_edt, gaussian_filter
    from skimage.segmentation import watershed

    depth = distance_transform_edt(~mark_outlines(found.labels))
    seeds = np.where(depth > SURE * found.width, found.labels, 0)
    # Keep at least the deepest pixels of each cell as a seed, so that narrow cells do not vanish.
    peak = np.zeros(int(found.labels.max()) + 1)
    np.maximum.at(peak, found.labels.ravel(), depth.ravel())
    seeds = np.where(depth >= 0.7 * peak[found.labels], found.labels, seeds)
    factor = [n / m for n, m in zip(light.shape, seeds.shape, strict=True)]
    at = [
        np.minimum(((np.arange(n) + 0.5) / f).astype(np.intp), m - 1)
        for n, m, f in zip(light.shape, seeds.shape, factor, strict=True)
    ]
    relief = _resize(found.relief, light.shape)
    dark = gaussian_filter(found.polarity * light, 0.5 * max(factor))
    relief_here = relief + dark / max(float(dark.std()), 1e-6) * FINE
    labels = watershed(relief_here, seeds[at[0][:, None], at[1][None]]).astype(np.int32)
    return labels, relief

"""Join cells: each is cut into the earlier ones where the seam is least visible, in a band around its outline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, guidance
from texrs._engine.stitcher import FREE, Pasting, Samples
from texrs._typing import Array, Bools
from texrs.exemplar.cells import Cells
from texrs.exemplar.shapes import mark_outlines
from texrs.kernels.gather import sample
from texrs.mosaic.charts import BAND, Charts

__all__ = ["Joined", "join"]

COLOUR, DEPTH = 1.0, 30.0
"""Weights of a seam's cost: for colour differences, in standard deviations, and for the depth inside a cell."""
STEEP, DEEP = 4.0, 6.0
"""Depth at one joint's width from the middle of a joint, and maximum depth."""
CORE = 0.5
"""Depth inside the outline beyond which a cell keeps its pixels, in widths of the band."""


@dataclass(frozen=True, slots=True, eq=False)
class Joined:
    """Source of each output pixel: a chart, and a pixel of this chart.

    Attributes
    ----------
    pixel : (H, W) uint32
        Index of the pixel in the array of all charts' pixels.
    chart : (H, W) int32
        Index of the pixel's chart.

    """

    pixel: NDArray[np.uint32]
    chart: NDArray[np.int32]


def join(image: Array, cells: Cells, charts: Charts, size: tuple[int, int]) -> Joined:
    """Cut the charts into the output, one after the other, along the cheapest seams."""
    from scipy.ndimage import distance_transform_edt

    colours = guidance(as_image(image))
    colours = colours / max(float(colours.std()), 1e-6)
    far = distance_transform_edt(~mark_outlines(cells.labels)).astype(np.float32)
    looked = sample(np.dstack([colours, far]), charts.places[None], interpolation="linear")[0]
    band = max(2.0, BAND * cells.size)
    # Add the depth inside a cell to the cost, so that seams run along joints.
    inside = np.clip(STEEP * (looked[:, -1] / (0.5 * cells.joint_width + 0.5) - 1), 0, DEEP)
    samples = Samples(np.ascontiguousarray(looked[:, :-1]), np.ascontiguousarray(inside), (COLOUR, DEPTH))
    # A cell has no joint where the border of A cuts it, so the neighbour's joint is used there.
    limits = np.array(cells.labels.shape) - 1
    within = 0.5 * cells.joint_width + 1
    bare: Bools = np.asarray((np.minimum(charts.places, limits - charts.places) < within).any(axis=-1))
    pixel = np.full(size, FREE, np.uint32)
    seams = np.zeros((*size, 2), np.float32)
    for k in range(len(charts.target)):
        box = charts.box(k)
        shape = tuple(charts.sides[k])
        row = slice(charts.first[k], charts.first[k + 1])
        depth = charts.depth[row].reshape(shape)
        mask: Bools = depth >= -band
        if not cells.whole[charts.source[k]]:
            mask &= ~bare[row].reshape(shape) | (depth >= CORE * band)
        if not mask.any():
            continue
        patch = np.arange(row.start, row.stop, dtype=np.uint32).reshape(shape)
        take, after = samples.cut(Pasting(pixel[box], seams[box], mask, depth >= CORE * band), patch)
        pixel[box] = np.where(take, patch, pixel[box])
        seams[box] = after
    _fill(pixel, charts)
    chart = (np.searchsorted(charts.first, pixel, side="right") - 1).astype(np.int32)
    return Joined(pixel, chart)


def _fill(pixel: NDArray[np.uint32], charts: Charts) -> None:
    """Fill pixels that no chart covers from the chart whose outline is nearest."""
    from scipy.ndimage import distance_transform_edt

    if not (pixel == FREE).any():
        return
    best = np.full(pixel.shape, -np.inf, np.float32)
    for k in range(len(charts.target)):
        box, shape = charts.box(k), tuple(charts.sides[k])
        row = slice(charts.first[k], charts.first[k + 1])
        depth = charts.depth[row].reshape(shape)
        number = np.arange(row.start, row.stop, dtype=np.uint32).reshape(shape)
        free = (best[box] > -np.inf) | (pixel[box] == FREE)
        better = free & (depth > best[box])
        pixel[box] = np.where(better, number, pixel[box])
        best[box] = np.where(better, depth, best[box])
    # Gaps that are farther from all outlines repeat the nearest pixel.
    free = pixel == FREE
    if free.any():
        pixel[...] = pixel[tuple(distance_transform_edt(free, return_distances=False, return_indices=True))]

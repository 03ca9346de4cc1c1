"""Replace stretched pixels of charts by pixels of A that are not stretched and fit their neighbours.

The background between separate elements is refined in the same way (`texrs.papers.splice.refine`). Joints and
unstretched pixels do not change, and pixels of joints are not used inside a cell.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, guidance, hypot_single
from texrs._engine.pyramid import ONE, Region
from texrs._typing import Floats, Progress
from texrs.elements import ElementAnalysis
from texrs.exemplar.cells import Cells
from texrs.exemplar.shapes import mark_outlines
from texrs.mosaic.charts import Charts
from texrs.mosaic.joining import Joined
from texrs.papers.splice.refine import Draft, Refinement, correct_draft

__all__ = ["refine_charts"]

STRETCH = 1.35
"""Stretch above which pixels are corrected, in output pixels per pixel of A."""
EDGE = 2.0
"""Width of the border next to a joint that is not corrected, in pixels.

Joints are lines, which the correction would fray.
"""
SMALLEST = 24.0
"""Minimum size of cells for a correction, in pixels. Windows in smaller cells contain more joints than cells."""
GRAIN, FINE = 0.24, 2.0
"""Minimum share of fine detail in the variance inside cells.

The second number is the standard deviation of the filter that removes fine detail, in pixels.

Smooth cells, and cells with a single figure such as a honeycomb's bottom, look better stretched than corrected.
"""
LEAST = 0.01
"""Minimum share of stretched output pixels. With fewer, the result is not corrected."""


@dataclass(frozen=True, slots=True, eq=False)
class TurnedRefinement(Refinement):
    """Refinement that rotates samples of A like their charts."""

    turned: Floats

    def frames(self, region: Region, spacing: int) -> NDArray[np.int16]:
        """Return the Jacobian of each pixel: the rotation of its chart."""
        turned = np.rint(self.turned[::spacing, ::spacing] * ONE)
        return np.ascontiguousarray(turned.reshape(region.points, 2, 2), np.int16)


def refine_charts(
    a: ElementAnalysis,
    cells: Cells,
    charts: Charts,
    joined: Joined,
    places: Floats,
    frames: Floats,
    seed: int,
    progress: Progress,
) -> tuple[Floats, Floats]:
    """Return source positions and Jacobians, corrected where charts stretch A."""
    if cells.size < SMALLEST or _measure_grain(a, cells) < GRAIN:
        return places, frames
    stretch = 1 / np.maximum(_measure_least(frames), 1e-3)
    loose = (stretch > STRETCH) & (charts.depth[joined.pixel] > 0.5 * cells.joint_width + EDGE)
    if loose.mean() < LEAST:
        return places, frames
    pixels = np.rint(places).astype(np.int32)
    kinds = (cells.joints > 0.5).astype(np.uint8)
    wanted = kinds[pixels[..., 0], pixels[..., 1]]
    known = np.ones(loose.shape, bool)
    draft = Draft(pixels, known, ~loose, kinds, wanted, np.zeros((*loose.shape, 2), bool))
    angle = np.radians(charts.turn)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]], np.float32)
    turned = np.ascontiguousarray(turn.transpose(2, 0, 1)[joined.chart])
    base = Refinement.of(a.image, a.wrap, draft, seed)
    refinement = TurnedRefinement(base.exemplar, draft, seed, base.coarsest, base.levels, turned)
    found = correct_draft(refinement, a.wrap, progress).astype(np.float32)
    return np.where(loose[..., None], found, places), np.where(loose[..., None, None], turned, frames)


def _measure_least(frames: Floats) -> Floats:
    """Return the smaller singular value of matrices (..., 2, 2)."""
    (a, b), (c, d) = np.moveaxis(frames, (-2, -1), (0, 1))
    return np.asarray(np.abs(hypot_single(a + d, b - c) - hypot_single(a - d, b + c)) / 2, np.float32)


def _measure_grain(a: ElementAnalysis, cells: Cells) -> float:
    """Return the share of detail finer than `FINE` pixels in the variance of lightness inside cells."""
    from scipy.ndimage import distance_transform_edt, gaussian_filter

    light = guidance(as_image(a.image)).mean(axis=-1)
    inside = distance_transform_edt(~mark_outlines(cells.labels)) > 0.5 * cells.joint_width + FINE
    if not inside.any():
        return 0.0
    fine, slow = ((light - gaussian_filter(light, s))[inside] for s in (FINE, 0.5 * cells.size))
    return float(fine.var() / max(float(slow.var()), 1e-12))

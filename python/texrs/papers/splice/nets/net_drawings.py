"""Images of the stages of `texrs.papers.splice.nets`, drawn on access."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Array
from texrs.elements import ElementAnalysis
from texrs.papers.splice.nets.graph import join_knots
from texrs.papers.splice.stage_drawings import (
    BLUE,
    GREEN,
    RED,
    Stages,
    draw_lines,
    draw_outlines,
    mark_points,
    to_picture,
)

__all__ = ["draw_net_stages"]

Picture = NDArray[np.uint8]
Points = NDArray[np.float64]


def draw_net_stages(
    a: ElementAnalysis, b: ElementAnalysis, targets: Points, label: NDArray[np.uint32], image: Array
) -> Stages:
    """Return the stages of a splice by nets, as images that are drawn on access."""
    return Stages(
        {
            "source net": lambda: _draw_net(to_picture(a.image), a.points),
            "target layout": lambda: mark_points(to_picture(b.image), b.points, BLUE),
            "target net": lambda: _draw_net(np.full((*label.shape, 3), 255, np.uint8), targets),
            "cuts": lambda: draw_outlines(to_picture(image), label.astype(np.int32) + 1, GREEN),
            "before_blending": lambda: image,
        }
    )


def _draw_net(picture: Picture, points: Points) -> Picture:
    """Draw a ring around each knot, and lines between connected knots."""
    pairs = join_knots(points)
    return mark_points(draw_lines(picture, points[pairs[:, 0]], points[pairs[:, 1]]), points, RED)

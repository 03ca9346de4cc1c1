"""Propose the box, the background and the layout of a search, with a confidence for each.

1. Box: around one of the given points, or a typical element of the finder.
2. Layout: by the components of a given mask, or the layout that the finder finds.
3. Background: the places farthest from all elements, among places of the most common colours.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import to_lab
from texrs._typing import Bools, Floats
from texrs.elements._finder_view import choose_layout, view_elements
from texrs.elements._layout import Layout
from texrs.elements._mask import disc, round_to_odd
from texrs.elements._options import Settings
from texrs.elements._search import search_similar
from texrs.elements._separation import label_components
from texrs.elements.arguments import LEAST, Arguments, Box, as_box
from texrs.errors import InvalidInput
from texrs.point_sets import spacing

PLACES = 12
"""Maximum number of proposed places of the background."""
DOUBTFUL = 0.65
"""Confidence below which a proposal is doubtful.

Measured on the layouts of 50 images (`benches/elements.py`). The share of correct layouts was 29 % below 0.65, 88 % up
to 0.8, and 100 % above.
"""
ADVICE = {
    "box": "draw a box around one element",
    "background": "give a few places between the elements",
    "layout": "give the layout of the elements",
}
"""Advice to the user for each doubtful proposal."""
OPEN = 0.3
"""Minimum share of background for a given mask to contain separate elements. Otherwise its components are jointed."""


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """Starting point of an analysis: the given arguments, and proposals for the others.

    Attributes
    ----------
    box : Box
        Box of one element.
    layout : Layout
        Layout of the elements.
    background : (H, W) bool, optional
        Pixels that are certainly outside all elements. Can be None if the foreground is known.
    proposed : list of str
        Names of the proposed arguments.
    confidence : dict
        Confidence of each proposal, 0 to 1.

    """

    box: Box
    layout: Layout
    background: Bools | None
    proposed: list[str]
    confidence: dict[str, float]


def propose(guide: Floats, given: Arguments, how: Settings, progress: Callable[[float], object]) -> Start:
    """Propose the arguments that are not given."""
    size = (guide.shape[0], guide.shape[1])
    box, layout, background, points = given.box, given.layout, given.background, given.points
    blind = background is None and given.whole is None
    missing = (("box", box is None), ("background", blind), ("layout", layout is None))
    sure: dict[str, float] = {}
    if box is None:
        if points is not None and len(points) > 2:
            box, sure["box"] = _place_box(points, size), 0.5
        else:
            view = view_elements(guide, given, how.wrap, how.seed, lambda stage, share: progress(0.8 * share))
            if view is None:
                raise InvalidInput("box: no box could be proposed for this image; give a box or the points")
            box, sure["box"] = view.box, float(view.confidence[0])
    if layout is None:
        layout, sure["layout"] = _choose_layout(guide, given.whole, how.seed)
    progress(0.8)
    if blind:
        # The background depends on where the elements are, so search for the elements first.
        if points is None:
            rest = partial(_report_part, progress, 0.8, 0.9)
            points = search_similar(guide, box.centre, box.size, wrap=how.wrap, progress=rest).points
        progress(0.9)
        others = points[np.abs(points - box.centre).max(axis=1) > max(box.size) / 2][:PLACES]
        if "layout" in sure and layout == Layout.CONNECTED and len(others):
            # If the repeated parts are the openings of a net, their middles are background, except the chosen one.
            background = disc(size, others, int(np.clip(min(box.size) // 8, 1, 4)))
            sure["background"] = sure["layout"]
        else:
            away = measure_distance(size, points, box.size, how.wrap)
            background, sure["background"] = _choose_background(guide, away, box)
        if given.mask is not None:
            background = background & ~given.mask
    progress(1.0)
    return Start(box, layout, background, [name for name, lacks in missing if lacks], sure)


def _report_part(progress: Callable[[float], object], low: float, high: float, share: float) -> None:
    progress(low + (high - low) * share)


def _place_box(points: NDArray[np.float64], size: tuple[int, int]) -> Box:
    """Return a box with sides of 0.75 of the spacing of points, around the point farthest from the border."""
    side = max(float(LEAST), 0.75 * spacing(points))
    side = min(side, min(size) - 1.0)
    depth = np.minimum(points, np.array(size) - 1 - points).min(axis=1)
    centre = np.clip(points[int(depth.argmax())], side / 2 - 0.5, np.array(size) - 0.5 - side / 2)
    return as_box((*centre.tolist(), side, side), size)


def _choose_layout(guide: Floats, mask: Bools | None, seed: int) -> tuple[Layout, float]:
    """Return the most likely layout and its confidence."""
    if mask is None:
        # Import the finder only here, because it imports SciPy.
        from texrs.exemplar.element_finder import find_elements

        return choose_layout(find_elements(guide, seed=seed).layouts)
    pieces, count = label_components(mask, (False, False))
    main = float(np.bincount(pieces.ravel())[1:].max(initial=0)) / max(float(mask.sum()), 1.0)
    if main > 0.5 or count < 3:
        return Layout.CONNECTED, min(1.0, main)
    return (Layout.DISJOINT, 0.7) if float((~mask).mean()) > OPEN else (Layout.JOINTED, 0.6)


def measure_distance(
    size: tuple[int, int], points: NDArray[np.float64], box: tuple[int, int], wrap: tuple[bool, bool]
) -> Floats:
    """Return the distance of each pixel to the nearest element, in half boxes."""
    from scipy.spatial import cKDTree

    if not len(points):
        return np.full(size, 9.0, np.float32)
    half = np.array(box) / 2
    copies = [points]
    for axis in range(2):
        if wrap[axis]:
            move = np.zeros(2)
            move[axis] = size[axis]
            copies = [c + k * move for c in copies for k in (-1, 0, 1)]
    grid = np.indices(size).reshape(2, -1).T
    found = cKDTree(np.concatenate(copies) / half).query(grid / half)[0]
    return np.asarray(found.reshape(size), np.float32)


def _choose_background(guide: Floats, away: Floats, box: Box) -> tuple[Bools, float]:
    """Return a mask of the places farthest from all elements with the most common colour, and its confidence."""
    from scipy.ndimage import gaussian_filter, maximum_filter

    colours = to_lab(guide)
    reach = round_to_odd(min(box.size) / 2)
    top = maximum_filter(away, reach) == away
    places = np.argwhere(top)
    order = np.lexsort((places[:, 1], places[:, 0], -away[tuple(places.T)]))
    places = places[order[: 3 * PLACES]]
    smooth = np.stack([gaussian_filter(colours[..., c], 1.0) for c in range(3)], axis=-1)
    shown = smooth[tuple(places.T)]
    usual = np.median(shown, axis=0)
    apart = np.sqrt(((shown - usual) ** 2).sum(axis=1))
    kept = places[np.argsort(apart, kind="stable")[: max(3, min(PLACES, len(places) // 2 + 1))]]
    radius = int(np.clip(min(box.size) // 12, 1, 4))
    sure = float(np.clip((float(np.median(away[tuple(kept.T)])) - 0.9) / 0.6, 0.1, 0.9))
    return disc((away.shape[0], away.shape[1]), kept.astype(np.float64), radius), sure

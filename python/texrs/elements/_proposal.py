"""Propose the box, the background and the layout of an analysis, with a confidence for each.

1. Sizes: blobs of every scale, areas of a colour segmentation, and periods of the autocorrelation propose boxes.
2. Element: copies of each box are searched for in a small image. The box that is repeated best is used.
3. Background: the places farthest from all detections, among places of the most common colours.
4. Layout: elements that have more edges and vary more than the rest are objects on a background, unless the whole
   image certainly consists of cells. Otherwise the rest is a net if it has a high contrast, and joints if not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import hypot_single, to_lab
from texrs._progress import answering
from texrs._typing import Bools, Floats
from texrs.elements._arguments import LEAST, Arguments, Box, as_box
from texrs.elements._boxes import propose_boxes, resize_box
from texrs.elements._layout import Layout
from texrs.elements._mask import disc, round_to_odd
from texrs.elements._search import Detections, describe_appearance, search_similar
from texrs.elements._separation import find_nearest_pixels, label_components
from texrs.errors import InvalidInput
from texrs.exemplar.cells import find_cells
from texrs.point_sets import spacing

SMALL = 224
"""Maximum side, in pixels, of the small image for comparing boxes."""
GROWN, STEPS = 3, 5
"""Number of the best boxes that are resized step by step, and maximum number of steps."""
AGAIN = 6
"""Number of the best boxes that are moved to the middle of an object, and then searched for again."""
WIDE = 1.3
"""Sides of the window for locating the object, relative to the box."""
OUT = 1.1
"""Minimum distance of a background pixel from the centre of an element, in half boxes."""
PLACES = 12
"""Maximum number of proposed places of the background."""
CLEAR = 0.68
"""Minimum ratio for objects on a background: edges times variation in elements, divided by the same product for the rest.
"""
LEAST_EDGE = 0.002
"""Negligible edge strength or colour difference, which is added to both parts of a ratio. Lightness has a range of 1.
"""
NET = 0.2
"""Minimum lightness contrast (0 to 1) of a net to its openings if these are evenly spaced.

Half of this contrast is enough if the openings are not evenly spaced.
"""
EVEN = 0.15
"""Maximum standard deviation of nearest distances, relative to their mean, for even spacing."""
CELLS, LARGE = 0.99, 256
"""Minimum confidence of cells that are used although elements look like objects.

The second value is the maximum side, in pixels, of the image for finding cells.

Chosen on photographs: walls and tiles have a higher confidence, heaps of fruit or stones a lower one.
"""
SMALLEST = 16
"""Minimum shorter side of the reduced image for finding cells, in pixels."""
DOUBTFUL = 0.65
"""Confidence below which a proposal is doubtful.

Measured on layouts of 23 photographs, their parts, and four generated textures of each of eight kinds. The share of
correct layouts was 28 % below 0.5, 49 % up to 0.65, 78 % up to 0.8, and 100 % above.
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


def propose(guide: Floats, given: Arguments, wrap: tuple[bool, bool], progress: Callable[[float], object]) -> Start:
    """Propose the arguments that are not given."""
    size = (guide.shape[0], guide.shape[1])
    box, layout, background, points = given.box, given.layout, given.background, given.points
    blind = background is None and given.whole is None
    if box is not None and layout is not None and not blind:
        return Start(box, layout, background, [], {})
    missing = (("box", box is None), ("background", blind), ("layout", layout is None))
    sure: dict[str, float] = {}
    # If no box is given, place one at the given points, or choose one in a small image.
    if box is None:
        if points is not None and len(points) > 2:
            box, sure["box"] = _place_box(points, size), 0.5
        else:
            box, sure["box"] = _choose_box(guide, wrap, progress)
    # The background and the layout depend on where the elements are, so search for the elements first.
    if points is None:
        rest = partial(_report_part, progress, 0.8, 0.9)
        points = search_similar(guide, box.centre, box.size, wrap=wrap, progress=rest).points
    progress(0.9)
    away = measure_distance(size, points, box.size, wrap)
    if layout is None:
        with answering(progress, 0.9):
            layout, sure["layout"] = _choose_layout(guide, away, points, given.whole)
        progress(0.95)
    if blind and "layout" in sure and layout == Layout.CONNECTED:
        # If the repeated parts are the openings of a net, the middles of all except the chosen one are background.
        middle = np.array(box.centre)
        others = points[np.abs(points - middle).max(axis=1) > max(box.size) / 2][:PLACES]
        if len(others):
            background = disc(size, others, int(np.clip(min(box.size) // 8, 1, 4)))
            sure["background"] = sure["layout"]
    if blind and background is None:
        background, sure["background"] = _choose_background(guide, away, box)
    if blind and background is not None and given.mask is not None:
        background = background & ~given.mask
    progress(1.0)
    return Start(box, layout, background, [name for name, lacks in missing if lacks], sure)


def _report_part(progress: Callable[[float], object], low: float, high: float, share: float) -> None:
    progress(low + (high - low) * share)


# --- the element -------------------------------------------------------------------------------------------------------


def _choose_box(guide: Floats, wrap: tuple[bool, bool], progress: Callable[[float], object]) -> tuple[Box, float]:
    """Return the box whose copies explain a small image best, and its confidence."""
    step = max(1, -(-max(guide.shape[:2]) // SMALL))
    small = downscale(guide, step)
    with answering(progress, 0.0):
        # Use a small image, because every box needs a search of its own.
        boxes = propose_boxes(small)
    if not boxes:
        raise InvalidInput("box: no box could be proposed for this image; give a box or the points")
    light, features = to_lab(small)[..., 0], describe_appearance(small, wrap)[0]
    best: tuple[float, Box] | None = None
    reached = 0.0
    tried: list[tuple[float, Box, Detections]] = []

    def attempt(box: Box) -> float:
        nonlocal best
        known = [value for value, other, _ in tried if other == box]
        if known:
            return known[0]
        found = search_similar(small, box.centre, box.size, wrap=wrap, features=features)
        value = _score(light, found, box)
        tried.append((value, box, found))
        progress(reached)
        if best is None or value > best[0] + 1e-6:
            best = (value, box)
        return value

    # Try all proposed boxes first.
    for number, box in enumerate(boxes):
        attempt(box)
        reached = 0.5 * (number + 1) / len(boxes)
    # Move the best boxes so that the found elements are in their middle.
    for _, box, found in sorted(tried, key=lambda t: -t[0])[:AGAIN]:
        moved = _recentre(light, found, box)
        if moved is not None:
            attempt(moved)
    # Resize the best boxes step by step while their score rises.
    for number, (value, box, _) in enumerate(sorted(tried, key=lambda t: -t[0])[:GROWN]):
        for _ in range(STEPS):
            better = [(attempt(b), b) for b in resize_box(box, small.shape[:2])]
            top = max(better, key=lambda t: t[0], default=(0.0, box))
            if top[0] <= value:
                break
            value, box = top
        reached = 0.5 + 0.3 * (number + 1) / GROWN
    assert best is not None
    sure = _measure_confidence(light, best[1], next(f for _, b, f in tried if b == best[1]))
    # Convert the best box to pixels of the full image, and move it into the image.
    row, column = (float(c * step + (step - 1) / 2) for c in best[1].centre)
    height, width = (float(s * step) for s in best[1].size)
    whole = (guide.shape[0], guide.shape[1])
    height, width = min(height, whole[0] - 1.0), min(width, whole[1] - 1.0)
    row = float(np.clip(row, height / 2 - 0.5, whole[0] - 0.5 - height / 2))
    column = float(np.clip(column, width / 2 - 0.5, whole[1] - 0.5 - width / 2))
    return as_box((row, column, height, width), whole), sure


def shrink(guide: Floats) -> tuple[Floats, int]:
    """Return a reduced image for finding cells, and the factor of reduction."""
    sides = guide.shape[:2]
    step = max(1, min(-(-max(sides) // LARGE), min(sides) // SMALLEST))
    return downscale(guide, step), step


def downscale(guide: Floats, step: int) -> Floats:
    """Reduce an image by averaging squares of ``step`` x ``step`` pixels."""
    rows, columns = (n // step for n in guide.shape[:2])
    cut = guide[: rows * step, : columns * step]
    return np.ascontiguousarray(
        cut.reshape(rows, step, columns, step, -1).mean(axis=(1, 3), dtype=np.float64), np.float32
    )


def _score(light: Floats, found: Detections, box: Box) -> float:
    """Return a score, at least 0, of how well copies of a box explain an image.

    The score rises with the similarity of the copies, their contrast to other places, and the area that they cover. It
    also depends on whether the mean of the copies shows one object in the middle of the box.
    """
    if len(found.scores) < 4:
        return 0.0
    inner = found.scores[1:]
    alike = float(inner.mean())
    cover = min(1.0, len(found.scores) * box.size[0] * box.size[1] / float(light.size))
    clear = float(inner.mean() - np.median(found.similarity))
    window = _average_window(light, found, box, WIDE)
    if window is None:
        return 0.0
    # Prefer large boxes, which are less often similar by chance (Fisher's z grows with the square root of the area).
    large = float(np.sqrt(box.size[0] * box.size[1] / light.size))
    return (
        large * alike * float(np.sqrt(cover)) * max(0.0, clear) * _measure_closure(window, np.zeros(2), box.size) ** 2
    )


def _measure_confidence(light: Floats, box: Box, found: Detections) -> float:
    """Return the confidence of a box, 0.05 to 0.95, from the similarity of its copies and whether it contains one object."""
    window = _average_window(light, found, box, WIDE)
    if window is None or len(found.scores) < 4:
        return 0.1
    return float(np.clip(found.scores[1:].mean() * _measure_closure(window, np.zeros(2), box.size) * 1.5, 0.05, 0.95))


def _average_window(light: Floats, found: Detections, box: Box, wide: float) -> Floats | None:
    """Return the mean of the windows around detections that are inside the image. None if there are none."""
    half = [round_to_odd(wide * s) // 2 for s in box.size]
    sides = light.shape
    whole = [p for p in found.pixels.tolist() if all(half[a] <= p[a] < sides[a] - half[a] for a in range(2))]
    if not whole:
        return None
    cuts = [light[r - half[0] : r + half[0] + 1, c - half[1] : c + half[1] + 1] for r, c in whole[:64]]
    return np.asarray(np.mean(cuts, axis=0, dtype=np.float64), np.float32)


def _measure_closure(window: Floats, centre: NDArray[np.float64], size: tuple[int, int]) -> float:
    """Return the share of edges in a window that face towards or away from a centre, 0 to 1.

    The share is high for the outline of a single object.
    """
    rows, columns = np.gradient(window)
    middle = (np.array(window.shape) - 1) / 2 + centre
    out = [np.arange(n) - m for n, m in zip(window.shape, middle, strict=True)]
    y, x = (o / (s / 2) for o, s in zip(out, size, strict=True))
    away = np.maximum(np.hypot(y[:, np.newaxis], x), 1e-6)
    # Measure in units of the box, so that an oblong object is treated like a round one.
    slope = rows * size[0], columns * size[1]
    total = hypot_single(*slope) * (away < WIDE)
    outward = (slope[0] * y[:, np.newaxis] + slope[1] * x) / away * (away < WIDE)
    change = float(total.sum())
    if change < 1e-9:
        return 0.0
    return float(0.5 * np.abs(outward).sum() + 0.5 * abs(outward.sum())) / change


def _recentre(light: Floats, found: Detections, box: Box) -> Box | None:
    """Move a box by up to half its size, so that one object is in the middle of the mean of its copies."""
    window = _average_window(light, found, box, 2.2)
    if window is None:
        return None
    best, move = 0.0, np.zeros(2)
    for row in np.linspace(-0.55, 0.55, 9) * box.size[0]:
        for column in np.linspace(-0.55, 0.55, 9) * box.size[1]:
            half = [int(WIDE * s / 2) for s in box.size]
            at = [round((n - 1) / 2 + d) for n, d in zip(window.shape, (float(row), float(column)), strict=True)]
            low = [max(0, a - h) for a, h in zip(at, half, strict=True)]
            part = window[low[0] : at[0] + half[0] + 1, low[1] : at[1] + half[1] + 1]
            offset = np.array([a - lo - (n - 1) / 2 for a, lo, n in zip(at, low, part.shape, strict=True)])
            value = _measure_closure(part, offset, box.size)
            if value > best + 1e-6:
                best, move = value, np.array([row, column])
    half_box = np.array(box.size) // 2
    for place in found.pixels:
        centre = np.floor(place + move + 0.5).astype(int)
        if ((centre >= half_box) & (centre < np.array(light.shape) - half_box)).all():
            return Box((int(centre[0]), int(centre[1])), box.size)
    return None


def _place_box(points: NDArray[np.float64], size: tuple[int, int]) -> Box:
    """Return a box with sides of 0.75 of the spacing of points, around the point farthest from the border."""
    side = max(float(LEAST), 0.75 * spacing(points))
    side = min(side, min(size) - 1.0)
    depth = np.minimum(points, np.array(size) - 1 - points).min(axis=1)
    centre = np.clip(points[int(depth.argmax())], side / 2 - 0.5, np.array(size) - 0.5 - side / 2)
    return as_box((*centre.tolist(), side, side), size)


# --- background and layout ----------------------------------------------------------------------------------------------


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


def _choose_layout(
    guide: Floats, away: Floats, points: NDArray[np.float64], mask: Bools | None
) -> tuple[Layout, float]:
    """Return the most likely layout and its confidence."""
    from scipy.spatial import cKDTree

    if mask is not None:
        pieces, count = label_components(mask, (False, False))
        main = float(np.bincount(pieces.ravel())[1:].max(initial=0)) / max(float(mask.sum()), 1.0)
        if main > 0.5 or count < 3:
            return Layout.CONNECTED, min(1.0, main)
        return (Layout.DISJOINT, 0.7) if float((~mask).mean()) > OPEN else (Layout.JOINTED, 0.6)
    if len(points) < 3:
        return Layout.DISJOINT, 0.1
    share, contrast = compare_elements(to_lab(guide), away, points)
    sure = _measure_odds(share / CLEAR)
    if share >= CLEAR:
        cells = find_cells(shrink(guide)[0]).confidence
        if cells < CELLS:
            return Layout.DISJOINT, sure
        sure = cells
    near = cKDTree(points).query(points, k=2)[0][:, 1]
    spread = float(near.std() / max(float(near.mean()), 1e-9))
    # Compare the contrast with that of a net. Evenly spaced openings require more contrast, because bricks are evenly
    # spaced too.
    net = contrast / (NET if spread < EVEN else NET / 2)
    return (Layout.CONNECTED if net >= 1 else Layout.JOINTED), sure * _measure_odds(net)


def _measure_odds(ratio: float) -> float:
    """Return the confidence of a choice made by comparing a ratio with 1.

    The confidence is 0.5 at a ratio of 1, and rises on both sides.
    """
    return float(1 / (1 + min(ratio, 1 / max(ratio, 1e-9)) ** 1.5))


def compare_elements(colours: Floats, away: Floats, points: NDArray[np.float64]) -> tuple[float, float]:
    """Return how much elements look like objects on a background, and their difference in lightness from the rest.

    Openings of a net and bricks between joints are smooth and similar, and all lines, edges and other colours are
    between them. Objects have edges and colours of their own, and the background between them is smooth.
    """
    from scipy.ndimage import gaussian_filter, gaussian_gradient_magnitude

    inner, outer = away < 0.5, away > OUT
    if not inner.any() or not outer.any():
        return CLEAR, 0.0
    light = colours[..., 0]
    edges = gaussian_gradient_magnitude(light, 1.0)
    smooth = np.stack([gaussian_filter(colours[..., c], 2.0) for c in range(3)], axis=-1)
    at = find_nearest_pixels(points, light.shape)

    def unlike(some: Floats) -> float:
        return float(np.median(np.sqrt(((some - np.median(some, axis=0)) ** 2).sum(axis=-1))))

    busy = (float(np.median(edges[inner])) + LEAST_EDGE) / (float(np.median(edges[outer])) + LEAST_EDGE)
    varied = (unlike(smooth[at]) + LEAST_EDGE) / (unlike(smooth[outer]) + LEAST_EDGE)
    return busy * varied, abs(float(np.median(light[inner])) - float(np.median(light[outer])))


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

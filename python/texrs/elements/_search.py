"""Find all places of a texture that look like the chosen element (section 3.2), to a fraction of a pixel."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from texrs._engine.appearance import Appearance
from texrs._typing import Floats
from texrs.elements._mask import round_to_odd
from texrs.elements._options import ElementSearch
from texrs.kernels.ncc import Correlation

Wrap: TypeAlias = tuple[bool, bool]

CHANNELS = 8
"""Number of channels of an appearance vector that are compared (section 3.2)."""
RADIUS = 2
"""Radius of the windows that an appearance vector describes: 5 x 5 pixels."""
COVERED = 0.95
"""Share of the similarity map that must be removed before the search for candidates ends (section 3.2)."""
CONTEXT = 1.3
"""Sides of the window that is compared, relative to the box.

The surroundings help to recognise an element, and the inside of a tile or a coin may only contain noise.
"""
APART = 1.3
"""Sides of the area around a candidate that excludes other candidates, relative to the box.

Boxes of neighbours can overlap, but rarely by more than this.
"""
RANGE = 0.25
"""Minimum range of the scores of candidates. If the range is smaller, no threshold is applied."""
BINS = 64
"""Number of bins, over [-1, 1], of the histogram whose entropy chooses a channel."""


@dataclass(frozen=True, slots=True)
class Template:
    """Template: the box of the element with its surroundings, rotated and scaled."""

    box: tuple[int, int]
    inner: tuple[int, int]
    """Height and width of the box without its surroundings, in pixels."""
    angle: float = 0.0
    scale: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Detections:
    """Places that look like the element, best first.

    Attributes
    ----------
    pixels : (n, 2) intp
        Local maxima of the similarity, in pixels.
    points : (n, 2) float64
        Positions of the maxima, to a fraction of a pixel.
    scores : (n,) float64
        Similarity at the maxima, -1 to 1.
    template : (n,) intp
        Index of the most similar template.
    similarity : (H, W) float32
        Similarity of each pixel to the element, -1 to 1.
    threshold : float
        Minimum similarity of accepted candidates. -1 if all were accepted.
    channel : int or None
        Channel that was used. None if all channels were used, weighted by their variance.
    templates : list of Template
        All templates, the unchanged element first.
    """

    pixels: NDArray[np.intp]
    points: NDArray[np.float64]
    scores: NDArray[np.float64]
    template: NDArray[np.intp]
    similarity: Floats
    threshold: float
    channel: int | None
    templates: Sequence[Template] = (Template((3, 3), (3, 3)),)

    @property
    def poses(self) -> NDArray[np.float64]:
        """Rotation in degrees and size of each detection, relative to the element, (n, 2)."""
        found = [(t.angle, t.scale) for t in (self.templates[k] for k in self.template)]
        return np.array(found, np.float64).reshape(-1, 2)


def pad(array: NDArray[Any], margin: tuple[int, int], wrap: Wrap) -> NDArray[Any]:
    """Extend an image beyond its borders: periodically along axes that wrap, and mirrored along others."""
    for axis in range(2):
        widths = [(margin[axis], margin[axis]) if a == axis else (0, 0) for a in range(array.ndim)]
        array = np.pad(array, widths, mode="wrap" if wrap[axis] else "symmetric" if len(array) < 2 else "reflect")
    return array


def describe_appearance(colours: Floats, wrap: Wrap, patches: Sequence[Floats] = ()) -> tuple[Floats, list[Floats]]:
    """Return the appearance vectors (H, W, 8) of an image, and of additional patches.

    The patches must have margins of `RADIUS` pixels.

    All vectors are computed together, so that they have the same components.
    """
    image = pad(colours, (RADIUS, RADIUS), wrap)
    height, width = image.shape[:2]
    atlas = image
    if patches:
        extra = sum(len(p) for p in patches), max(0, *(p.shape[1] - width for p in patches))
        atlas = np.pad(image, ((0, extra[0]), (0, extra[1]), (0, 0)), mode="symmetric")
    tops, top = [], height
    for patch in patches:
        atlas[top : top + len(patch), : patch.shape[1]] = patch
        tops.append(top)
        top += len(patch)
    features = Appearance(atlas, axes=2, radius=RADIUS).arrays()["features"]
    described = features.reshape(*atlas.shape[:2], -1)[..., :CHANNELS].astype(np.float32)

    def inside(top: int, shape: tuple[int, ...]) -> Floats:
        return described[top + RADIUS : top + shape[0] - RADIUS, RADIUS : shape[1] - RADIUS]

    return inside(0, image.shape), [inside(top, p.shape) for top, p in zip(tops, patches, strict=True)]


def make_bank(box: tuple[int, int], rotations: int, scales: Sequence[float]) -> list[Template]:
    """Return the templates for all directions and sizes, the unchanged element first."""
    found = []
    for scale in sorted(scales, key=lambda s: abs(np.log(s))):
        for turn in range(rotations):
            angle = 360.0 * turn / rotations
            share = float(np.cos(np.deg2rad(angle)) ** 2)
            sides = (box[0] * share + box[1] * (1 - share), box[1] * share + box[0] * (1 - share))
            inner = (round_to_odd(sides[0] * scale), round_to_odd(sides[1] * scale))
            found.append(
                Template(
                    (round_to_odd(inner[0] * CONTEXT), round_to_odd(inner[1] * CONTEXT)), inner, angle, float(scale)
                )
            )
    return found


def extract_template(colours: Floats, centre: tuple[int, int], template: Template, wrap: Wrap) -> Floats:
    """Return the image around an element in a rotated and scaled window, with a margin of `RADIUS`."""
    from scipy.ndimage import map_coordinates

    half = [n // 2 + RADIUS for n in template.box]
    rows, columns = np.mgrid[-half[0] : half[0] + 1, -half[1] : half[1] + 1].astype(np.float64)
    angle = np.deg2rad(template.angle)
    # Convert each offset in the template to an offset in the element, by the inverse rotation and scale.
    back = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]) / template.scale
    places = [back[i, 0] * rows + back[i, 1] * columns + centre[i] for i in range(2)]
    modes = ["grid-wrap" if w else "mirror" for w in wrap]
    if modes[0] != modes[1]:
        side = colours.shape[1 if wrap[1] else 0]
        places[1 if wrap[1] else 0] %= side
    mode = modes[0] if modes[0] == modes[1] else "mirror"
    channels = [map_coordinates(colours[..., c], places, order=1, mode=mode) for c in range(colours.shape[-1])]
    return np.stack(channels, axis=-1).astype(np.float32)


def search_similar(
    colours: Floats,
    centre: tuple[int, int],
    box: tuple[int, int],
    *,
    wrap: Wrap = (False, False),
    options: ElementSearch = ElementSearch(),
    cut: bool = True,
    features: Floats | None = None,
    progress: Callable[[float], object] | None = None,
) -> Detections:
    """Find the places of a texture that look like the box around ``centre``.

    Parameters
    ----------
    colours : (H, W, 1 or 3) float32
        Image in [0, 1].
    centre, box : (int, int)
        Centre and sides of the box of the element, in pixels.
    wrap : (bool, bool)
        Axes along which the image is periodic.
    options : ElementSearch
        Directions, sizes, minimum similarity and channels.
    cut : bool
        If True, apply a threshold to the candidates, and drop candidates that overlap better ones.
    features : (H, W, 8) float32, optional
        Result of `describe_appearance` for the image, to save time if many boxes are searched for. Default: computed.
    progress : callable, optional
        Function that is called with the finished share of the work, 0 to 1.
    """
    templates = make_bank(box, options.rotations, options.scales)
    turned = [t for t in templates if t.angle or t.scale != 1.0]
    patches: list[Floats] = []
    if features is None or turned:
        features, patches = describe_appearance(
            colours, wrap, [extract_template(colours, centre, t, wrap) for t in turned]
        )
    # Pad the features, so that elements at the border can be found.
    margin = tuple(max(t.box[axis] for t in templates) // 2 for axis in range(2))
    around = pad(features, (margin[0], margin[1]), wrap)
    # Weight each channel by its variance, so that channels with little content have little influence.
    variance = features.reshape(-1, CHANNELS).var(axis=0, dtype=np.float64)
    weights = (variance / max(float(variance.sum()), 1e-12)).astype(np.float32)
    correlation = Correlation(around)
    best: Floats | None = None
    which = np.zeros(colours.shape[:2], np.intp)
    chosen: int | None = None
    # Keep the similarity of the best template at each pixel.
    for i, template in enumerate(templates):
        half = [n // 2 for n in template.box]
        if template in turned:
            patch = patches[turned.index(template)]
        else:
            at = [centre[axis] + margin[axis] - half[axis] for axis in range(2)]
            patch = around[at[0] : at[0] + template.box[0], at[1] : at[1] + template.box[1]]
        maps = correlation.maps(patch)
        first = [margin[axis] - half[axis] for axis in range(2)]
        maps = maps[first[0] : first[0] + colours.shape[0], first[1] : first[1] + colours.shape[1]]
        if options.channel == "min-entropy":
            chosen = choose_channel(maps) if chosen is None else chosen
            here = np.ascontiguousarray(maps[..., chosen])
        else:
            # Sum in a fixed order, so that the last bits do not depend on a library.
            here = np.zeros(colours.shape[:2], np.float32)
            for c in range(CHANNELS):
                here += weights[c] * maps[..., c]
        if best is None:
            best = here
        else:
            better = here > best
            best[better], which[better] = here[better], i
        if progress is not None:
            progress((i + 1) / len(templates))
    assert best is not None
    # Elements are at local maxima of the similarity.
    pixels = suppress_non_maxima(best, [t.inner for t in templates], which, wrap)
    scores = best[tuple(pixels.T)].astype(np.float64)
    least = -1.0
    if options.threshold is not None:
        least = options.threshold
    elif cut and len(scores) and scores[1:].max(initial=-1) - scores[-1] > RANGE:
        least = threshold_otsu(scores[1:])
    if cut:
        # Determine the threshold with candidates between elements included. Afterwards, drop those that overlap a
        # better one.
        apart = suppress_non_maxima(best, [t.inner for t in templates], which, wrap, share=APART)
        pixels, scores = apart, best[tuple(apart.T)].astype(np.float64)
    pixels, scores = pixels[scores >= least], scores[scores >= least]
    points = pixels + offset_maxima(best, pixels, wrap)
    return Detections(pixels, points, scores, which[tuple(pixels.T)], best, least, chosen, templates)


def choose_channel(maps: Floats) -> int:
    """Return the channel whose similarity map has the lowest entropy (section 3.2, as printed)."""
    entropies = []
    for c in range(maps.shape[-1]):
        share = np.histogram(maps[..., c], BINS, (-1, 1))[0] / maps[..., c].size
        share = share[share > 0]
        entropies.append(float(-(share * np.log(share)).sum()))
    return int(np.argmin(entropies))


def suppress_non_maxima(
    map: Floats, boxes: Sequence[tuple[int, int]], which: NDArray[np.intp], wrap: Wrap, share: float = 1.0
) -> NDArray[np.intp]:
    """Return local maxima, the best first. Each maximum removes the area around it from the candidates.

    The result is (n, 2), in the order of choice.
    """
    from scipy.ndimage import maximum_filter

    top = maximum_filter(map, 3, mode=["wrap" if w else "nearest" for w in wrap]) == map
    rows, columns = np.nonzero(top)
    order = np.lexsort((columns, rows, -map[rows, columns]))
    free = np.ones(map.shape, bool)
    left, taken = map.size, []
    for row, column in zip(rows[order].tolist(), columns[order].tolist(), strict=True):
        if not free[row, column]:
            continue
        taken.append((row, column))
        spans = []
        for axis, at in enumerate((row, column)):
            half = int(share * (boxes[which[row, column]][axis] // 2))
            span = np.arange(at - half, at + half + 1)
            side = map.shape[axis]
            spans.append(np.unique(span % side) if wrap[axis] else span[(span >= 0) & (span < side)])
        window = np.ix_(*spans)
        left -= int(free[window].sum())
        free[window] = False
        if left <= (1 - COVERED) * map.size:
            break
    return np.array(taken, np.intp).reshape(-1, 2)


def threshold_otsu(values: NDArray[np.float64]) -> float:
    """Return the threshold that divides numbers into two classes with the largest variance between them (Otsu)."""
    ordered = np.sort(values)
    count = np.arange(1, len(ordered))
    below = np.cumsum(ordered)[:-1] / count
    above = (ordered.sum() - np.cumsum(ordered)[:-1]) / (len(ordered) - count)
    between = count * (len(ordered) - count) * (above - below) ** 2
    split = int(np.argmax(between)) if len(between) else 0
    return float((ordered[split] + ordered[min(split + 1, len(ordered) - 1)]) / 2)


def offset_maxima(map: Floats, pixels: NDArray[np.intp], wrap: Wrap) -> NDArray[np.float64]:
    """Return the offset of the true peak at each maximum, from a parabola along each axis, within half a pixel."""
    offsets = np.zeros((len(pixels), 2))
    for axis in range(2):
        near = []
        for step in (-1, 0, 1):
            moved = pixels.copy()
            moved[:, axis] += step
            side = map.shape[axis]
            moved[:, axis] = moved[:, axis] % side if wrap[axis] else np.clip(moved[:, axis], 0, side - 1)
            near.append(map[tuple(moved.T)].astype(np.float64))
        bend = near[0] - 2 * near[1] + near[2]
        slope = (near[0] - near[2]) / 2
        offsets[:, axis] = np.where(bend < -1e-9, np.clip(slope / np.minimum(bend, -1e-9), -0.5, 0.5), 0.0)
    return offsets

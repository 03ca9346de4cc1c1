"""Find separate elements of an exemplar, which the stitcher keeps whole.

The elements of an image are those of `texrs.exemplar.element_finder`. The elements of a volume are areas on a connected
background. Its colours are reduced to a small palette. The background is the connected part of the palette whose
removal leaves many bounded areas, and it is accepted only if it meets all criteria. Other textures are better cut by
the frequency of neighbouring colours (`texrs.exemplar.adjacency`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texrs._progress import ask
from texrs._show import brief
from texrs._typing import Array, Bools, Floats
from texrs.exemplar.adjacency import classify
from texrs.exemplar.segmentation import SURE, find_fault

if TYPE_CHECKING:
    from texrs.exemplar.element_finder import FoundElements

__all__ = ["Instances", "find_instances"]

COLOURS = 6
"""Number of colours of the palette."""
LEAST = 6
"""Minimum number of areas, and minimum number of samples of an area."""
LARGEST = 0.15
"""Maximum size of an element, as a share of the total size of all elements."""
FAIR, SHARE, COMPACT, EXPLAINED, PLAIN = 0.9, 0.65, 0.9, 0.3, 0.45
"""Criteria for accepting a background, in this order.

- Minimum score of the background.
- Maximum share of the exemplar that elements cover.
- Minimum share of elements shorter than half of the exemplar.
- Minimum share of colour variance between elements and background.
- Maximum variance of the background, as a share of the total.
"""
REACH, DEEP = np.float32(3), np.float32(8)
"""Depth in pixels beyond which all seams inside an uncertain element cost the same, and the depth that gives this cost.
"""
PAD = 12
"""Number of samples added around a periodic exemplar before distances are measured. Larger distances are not exact."""


@dataclass(frozen=True, slots=True, eq=False)
class Instances:
    """The elements of an exemplar.

    Attributes
    ----------
    labels : uint32 array
        Index of the element of each sample, from 1, and 0 for none. Samples where two elements touch are 0.
    depth : float32 array
        Distance of each sample to the background, 0 in the background.
    sure : bool
        False if the elements are not separate, as in a heap. Seams inside such elements only cost more.

    """

    labels: NDArray[np.uint32]
    depth: Floats
    sure: bool = True

    __repr__ = brief

    @property
    def count(self) -> int:
        """Number of elements."""
        return int(self.labels.max(initial=0))

    @property
    def nbytes(self) -> int:
        """Size of the arrays in bytes."""
        return self.labels.nbytes + self.depth.nbytes


class _Pieces(NamedTuple):
    score: float
    mask: Bools
    labels: NDArray[np.intp]


def find_instances(colours: Floats, wrap: Sequence[bool]) -> Instances | None:
    """Find the separate elements of an exemplar.

    Those of an image are the elements of `texrs.exemplar.element_finder`.

    Parameters
    ----------
    colours : (..., C) float32
        Exemplar with two or three axes.
    wrap : one bool per axis
        Axes along which the exemplar is periodic.

    Returns
    -------
    Instances or None
        The elements. None if an image has none or may be a net, or if no connected background of a volume leaves
        bounded areas.

    Examples
    --------
    >>> import texrs
    >>> from texrs.exemplar.separate_elements import find_instances
    >>> stones = texrs.Exemplar(texrs.samples.particles((48, 48, 48)).image, axes=3)
    >>> find_instances(stones.colours, stones.repeat).count > 10
    True

    """
    from scipy import ndimage

    if len(wrap) == 2:
        # Import the finder only here, because it imports SciPy.
        from texrs.exemplar.element_finder import find_elements

        return _view_instances(find_elements(colours), wrap)
    # Smooth slightly, because grain would divide areas.
    modes = ["wrap" if closed else "nearest" for closed in wrap]
    smooth = np.stack([ndimage.gaussian_filter(colours[..., c], 0.7, mode=modes) for c in range(colours.shape[-1])], -1)
    palette = classify(smooth, COLOURS)
    best: _Pieces | None = None
    background: list[int] = []
    while len(background) < COLOURS - 1:
        tries = [_try_background(palette, [*background, c], wrap) for c in range(COLOURS) if c not in background]
        colour = max(range(len(tries)), key=lambda k: tries[k].score)
        if best is not None and tries[colour].score <= best.score + 0.005:
            break
        best = tries[colour]
        background.append([c for c in range(COLOURS) if c not in background][colour])
    if best is None or not _stand_out(colours, best, wrap):
        return None
    return Instances(best.labels.astype(np.uint32), _measure_depth(best.mask, wrap))


def _measure_depth(mask: Bools, wrap: Sequence[bool]) -> Floats:
    """Return the distance of each sample in a mask to the background, in samples."""
    from scipy import ndimage

    padded = np.pad(mask, PAD, mode="wrap" if all(wrap) else "edge")
    depth = ndimage.distance_transform_edt(padded)[(slice(PAD, -PAD),) * mask.ndim]
    return np.asarray(depth, np.float32)


def _try_background(palette: NDArray[np.uint8], colours: list[int], wrap: Sequence[bool]) -> _Pieces:
    """Return the areas that remain if some palette colours are used as the background, with a score.

    The areas are tried unchanged and eroded by one sample, which separates areas that just touch.
    """
    from scipy import ndimage

    ask()
    mask = ~np.isin(palette, colours)
    ground = np.bincount(label_components(~mask, wrap).ravel())[1:]
    whole = ground.max(initial=0) / max(ground.sum(), 1)
    found = [_score_pieces(mask, mask, whole, wrap)]
    apart = ndimage.binary_erosion(mask, border_value=1)
    if apart.sum() > 0.25 * mask.sum():
        pieces = _score_pieces(mask, apart, whole, wrap)
        found.append(pieces._replace(score=0.96 * pieces.score))
    return max(found, key=lambda pieces: pieces.score)


def _score_pieces(mask: Bools, apart: Bools, whole: float, wrap: Sequence[bool]) -> _Pieces:
    labels = label_components(apart, wrap)
    sizes = np.bincount(labels.ravel())[1:]
    if len(sizes) < LEAST:
        return _Pieces(0.0, mask, labels)
    bounded = sizes[(sizes >= LEAST) & (sizes <= LARGEST * sizes.sum())].sum() / sizes.sum()
    return _Pieces(float(bounded * whole**2), mask, labels)


def _stand_out(colours: Floats, pieces: _Pieces, wrap: Sequence[bool]) -> bool:
    """Return True if areas look like elements on a background.

    Elements cover few samples and are short, and their background is plain and has another colour.
    """
    from scipy import ndimage

    if pieces.score < FAIR or pieces.mask.mean() > SHARE:
        return False
    sizes = np.bincount(pieces.labels.ravel())[1:]
    boxes = ndimage.find_objects(pieces.labels)
    short = [
        all(closed or 2 * (s.stop - s.start) <= n for s, n, closed in zip(box, pieces.labels.shape, wrap, strict=True))
        for box in boxes
    ]
    if sizes[short].sum() < COMPACT * sizes.sum():
        return False
    samples = colours.reshape(-1, colours.shape[-1])
    inside = pieces.mask.reshape(-1)
    variances = [
        float(part.var(axis=0, dtype=np.float64).sum()) for part in (samples, samples[inside], samples[~inside])
    ]
    share, whole = float(inside.mean()), max(variances[0], 1e-12)
    explained = 1 - (share * variances[1] + (1 - share) * variances[2]) / whole
    return explained >= EXPLAINED and variances[2] <= PLAIN * whole


def label_components(mask: Bools, wrap: Sequence[bool]) -> NDArray[np.intp]:
    """Label the connected parts of a mask from 1. Parts continue across periodic axes."""
    from scipy import ndimage

    return join_ends(np.asarray(ndimage.label(mask)[0], np.intp), wrap)


def join_ends(labels: NDArray[np.intp], wrap: Sequence[bool]) -> NDArray[np.intp]:
    """Join parts that touch across the ends of periodic axes, and number the parts from 1."""
    if not any(wrap):
        return labels
    roots = np.arange(int(labels.max()) + 1)

    def root(k: int) -> int:
        while roots[k] != k:
            k = roots[k]
        return k

    for axis, closed in enumerate(wrap):
        if closed:
            first, last = np.take(labels, 0, axis).ravel(), np.take(labels, -1, axis).ravel()
            both = (first > 0) & (last > 0)
            for a, b in np.unique(np.stack([first[both], last[both]], -1), axis=0):
                low, high = sorted((root(a), root(b)))
                roots[high] = low
    parts = np.array([root(k) for k in range(len(roots))])
    return np.asarray(np.unique(parts, return_inverse=True)[1][labels], np.intp)


def _view_instances(found: FoundElements, wrap: Sequence[bool]) -> Instances | None:
    """Return the elements that the finder found. None if they may be the meshes of a net, or not elements."""
    from scipy import ndimage

    if find_fault(found):
        return None
    labels = join_ends(found.labels.astype(np.intp), wrap)
    modes = ["wrap" if closed else "nearest" for closed in wrap]
    high = ndimage.maximum_filter(labels, 3, mode=modes)
    low = ndimage.minimum_filter(np.where(labels > 0, labels, len(found.elements)), 3, mode=modes)
    labels[low < high] = 0
    depth = _measure_depth(labels > 0, wrap)
    if found.layouts["separate"] >= SURE:
        return Instances(labels.astype(np.uint32), depth)
    return Instances(labels.astype(np.uint32), DEEP * np.minimum(depth / REACH, 1), sure=False)


def as_instances(classes: Array, wrap: Sequence[bool]) -> Instances | None:
    """Return the elements of an image of classes: connected areas of all classes except the background.

    The background is the most connected class.
    """
    parts = {int(c): label_components(classes == c, wrap) for c in np.unique(classes)}
    largest = {c: np.bincount(p.ravel())[1:].max() / classes.size for c, p in parts.items()}
    ground = max(largest, key=lambda c: (largest[c], -c))
    mask = classes != ground
    labels, count = np.zeros(classes.shape, np.uint32), 0
    for c, part in parts.items():
        if c != ground:
            labels[part > 0] = (part[part > 0] + count).astype(np.uint32)
            count += int(part.max())
    sizes = np.bincount(labels.ravel())[1:]
    if len(sizes) < LEAST or sizes.max() > LARGEST * sizes.sum() or mask.mean() > SHARE:
        return None
    return Instances(labels, _measure_depth(mask, wrap))

"""Check and measure known elements, which are given as a label for each pixel."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import try_array
from texrs._typing import Labels
from texrs.elements._separation import label_components
from texrs.errors import InvalidInput

__all__ = ["as_element_labels", "extend_points", "measure_box", "measure_centres"]

Points = NDArray[np.float64]


def as_element_labels(value: object, shape: tuple[int, int], wrap: tuple[bool, ...]) -> Labels:
    """Check a label image of elements, and renumber the labels consecutively from 1.

    The order of the labels is kept.

    For a bool mask, the connected components are the elements.
    """
    labels: NDArray[Any] = try_array(value)
    if labels.shape != shape or labels.dtype.kind not in "biu":
        raise InvalidInput(f"labels: must be integers or bool of shape {shape}, got {labels.dtype} {labels.shape}")
    if labels.dtype == np.bool_:
        return label_components(labels, (wrap[0], wrap[1]))[0]
    if labels.dtype.kind == "i" and labels.min() < 0:
        raise InvalidInput(f"labels: must be 0 or more, got {int(labels.min())}")
    names, dense = np.unique(labels, return_inverse=True)
    return (dense.reshape(shape) + int(names[0] != 0)).astype(np.int32)


def measure_box(labels: Labels) -> tuple[int, int]:
    """Return the median height and width of elements, in pixels, as odd numbers."""
    from scipy.ndimage import find_objects

    found = [box for box in find_objects(labels) if box is not None]
    height, width = (int(np.median([box[axis].stop - box[axis].start for box in found])) | 1 for axis in (0, 1))
    return height, width


def extend_points(points: Points, labels: Labels, wrap: tuple[bool, ...]) -> Points:
    """Append the centroids of elements that have no point to a list of points."""
    return np.concatenate([points, measure_centres(labels, wrap)[len(points) :]])


def measure_centres(labels: Labels, wrap: tuple[bool, ...]) -> Points:
    """Return the centroid of each element, (n, 2), across the borders of periodic axes."""
    count, flat = int(labels.max()), labels.ravel()
    area = np.bincount(flat, minlength=count + 1)[1:]
    centres = np.empty((count, 2))
    for axis, side in enumerate(labels.shape):
        at: NDArray[np.int64] = np.indices(labels.shape)[axis]
        # Along a periodic axis, measure from the approximate middle of each element, so that the border does not
        # divide it.
        middle = _find_middles(labels, at, side) if wrap[axis] else np.zeros(count, np.int64)
        away = at - np.concatenate([[0], middle])[labels]
        away = (away + side // 2) % side - side // 2 if wrap[axis] else away
        mean = middle + np.bincount(flat, away.ravel(), count + 1)[1:] / area
        # Centres range from -0.5 to side - 0.5, because the last pixel extends half a pixel beyond its centre.
        centres[:, axis] = (mean + 0.5) % side - 0.5 if wrap[axis] else mean
    return centres


def _find_middles(labels: Labels, at: NDArray[np.int64], side: int) -> NDArray[np.int64]:
    """Return the approximate middle of each element on a periodic axis of a given length."""
    turn = 2 * np.pi * at.ravel() / side
    up, along = (np.bincount(labels.ravel(), f(turn), int(labels.max()) + 1)[1:] for f in (np.sin, np.cos))
    return np.rint(np.arctan2(up, along) * side / (2 * np.pi)).astype(np.int64)

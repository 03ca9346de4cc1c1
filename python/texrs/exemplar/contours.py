"""Trace the outlines of labels as closed polygons with a fixed number of points, and measure them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Labels

__all__ = ["POINTS", "Moments", "measure_moments", "measure_profiles", "paint", "resample", "trace"]

Polygons = NDArray[np.float64]

POINTS = 48
"""Number of points of an outline."""
SMOOTH = 1.0
"""Standard deviation of the Gaussian that smooths the steps of pixels, in pixels."""


class Moments(NamedTuple):
    """Area, centroid, direction and elongation of polygons.

    Attributes
    ----------
    area : (n,) float64
        Areas in squared pixels.
    centre : (n, 2) float64
        Centroids, (row, column).
    angle : (n,) float64
        Direction of the longest axis, in degrees in [0, 180), from the column axis towards the row axis.
    aspect : (n,) float64
        Ratio of the longest to the shortest axis of the ellipse with the same second moments, at least 1.

    """

    area: NDArray[np.float64]
    centre: Polygons
    angle: NDArray[np.float64]
    aspect: NDArray[np.float64]


def trace(labels: Labels, numbers: NDArray[np.integer], *, smooth: float = SMOOTH) -> Polygons:
    """Trace the outlines of labels.

    Parameters
    ----------
    labels : (H, W) int32
        Label image. Pixels outside the image have no label.
    numbers : (n,) int
        Labels to trace. Each must occur in the image.
    smooth : float
        Standard deviation of the Gaussian that smooths the steps of pixels, in pixels. It is reduced for labels that
        would vanish.

    Returns
    -------
    (n, POINTS, 2) float64
        Equally spaced points (row, column) along the longest outline of each label. All outlines run in the same
        sense: from the row axis towards the column axis.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs.exemplar.contours import measure_moments, trace
    >>> square = np.zeros((30, 30), np.int32)
    >>> square[5:25, 5:25] = 1
    >>> measure_moments(trace(square, np.array([1]))).centre.round(1).tolist()
    [[14.5, 14.5]]

    """
    from scipy.ndimage import find_objects, gaussian_filter
    from skimage.measure import find_contours

    boxes = find_objects(labels)
    out = np.zeros((len(numbers), POINTS, 2))
    for k, number in enumerate(np.asarray(numbers).tolist()):
        box = boxes[number - 1]
        inside = np.pad((labels[box] == number).astype(np.float32), 3)
        sigma = smooth
        soft = gaussian_filter(inside, sigma)
        while soft.max() <= 0.55:
            sigma /= 2
            soft = gaussian_filter(inside, sigma)
        found = max(find_contours(soft, 0.5), key=len)[:-1]
        out[k] = resample(found) + np.array([box[0].start - 3, box[1].start - 3])
    turned = _measure_signed_area(out) < 0
    out[turned] = out[turned, ::-1]
    return out


def paint(polygons: Polygons, shape: tuple[int, ...]) -> Labels:
    """Return the number of the polygon that contains each pixel, from 1.

    Pixels in no polygon or in several polygons have the value 0.
    """
    from skimage.draw import polygon

    labels, times = np.zeros(shape, np.int32), np.zeros(shape, np.uint8)
    for number, outline in enumerate(polygons, start=1):
        rows, columns = polygon(outline[:, 0], outline[:, 1], shape)
        labels[rows, columns] = number
        times[rows, columns] = np.minimum(times[rows, columns], 1) + 1
    labels[times > 1] = 0
    return labels


def resample(polygon: Polygons, count: int = POINTS) -> Polygons:
    """Return a given number of equally spaced points along a closed polygon (n, 2)."""
    closed = np.concatenate([polygon, polygon[:1]])
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(closed, axis=0).T))])
    at = np.linspace(0, along[-1], count, endpoint=False)
    return np.stack([np.interp(at, along, closed[:, a]) for a in range(2)], axis=-1)


def _measure_signed_area(polygons: Polygons) -> NDArray[np.float64]:
    after = np.roll(polygons, -1, axis=-2)
    cross = polygons[..., 0] * after[..., 1] - after[..., 0] * polygons[..., 1]
    return np.asarray(cross.sum(axis=-1) / 2)


def measure_moments(polygons: Polygons) -> Moments:
    """Return area, centroid, direction and elongation of polygons (n, points, 2), by Green's theorem."""
    middle = polygons.mean(axis=-2, keepdims=True)
    p = polygons - middle
    q = np.roll(p, -1, axis=-2)
    cross = p[..., 0] * q[..., 1] - q[..., 0] * p[..., 1]
    area = cross.sum(axis=-1) / 2
    safe = np.where(np.abs(area) > 1e-9, area, 1.0)
    centre = ((p + q) * cross[..., None]).sum(axis=-2) / (6 * safe[:, None])
    rr, cc = (((p[..., a] ** 2 + p[..., a] * q[..., a] + q[..., a] ** 2) * cross).sum(axis=-1) / 12 for a in range(2))
    rc = (p[..., 0] * q[..., 1] + 2 * p[..., 0] * p[..., 1] + 2 * q[..., 0] * q[..., 1] + q[..., 0] * p[..., 1]) * cross
    mixed = rc.sum(axis=-1) / 24 / safe - centre[:, 0] * centre[:, 1]
    down, across = rr / safe - centre[:, 0] ** 2, cc / safe - centre[:, 1] ** 2
    angle = np.degrees(0.5 * np.arctan2(2 * mixed, across - down)) % 180.0
    mean, spread = (down + across) / 2, np.hypot((across - down) / 2, mixed)
    aspect = np.sqrt((mean + spread) / np.maximum(mean - spread, 1e-9))
    return Moments(np.abs(area), centre + middle[:, 0], angle, aspect)


def measure_profiles(polygons: Polygons, centres: Polygons, rays: int) -> NDArray[np.float64]:
    """Return the distances from the centre to the outline along equally spaced rays, (n, rays).

    The first ray points along the column axis.
    """
    away = polygons - centres[:, None]
    turn = np.arctan2(away[..., 0], away[..., 1])
    radius = np.hypot(away[..., 0], away[..., 1])
    order = np.argsort(turn, axis=-1, kind="stable")
    turn, radius = (np.take_along_axis(x, order, axis=-1) for x in (turn, radius))
    at = 2 * np.pi * np.arange(rays) / rays
    return np.stack([np.interp(at, t, r, period=2 * np.pi) for t, r in zip(turn, radius, strict=True)])

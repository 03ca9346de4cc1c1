"""Propose boxes around one element, from blobs of every size, segmented areas and lattice cells."""

from __future__ import annotations

import numpy as np

from texrs._arrays import to_lab
from texrs._typing import Floats
from texrs.elements._arguments import LEAST, Box
from texrs.elements._mask import round_to_odd
from texrs.elements._separation import rank_pieces
from texrs.exemplar.regularity import find_lattice
from texrs.exemplar.segmentation import ElementOptions, segment

SIGMAS = (2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0)
"""Standard deviations of the Gaussians for detecting blobs, in pixels."""
A_KIND, PIECES = 3, 6
"""Maximum number of boxes for blobs of one size, and maximum number for segmented areas."""
BLOB = 2.6
"""Side of the box around a blob, in standard deviations of the blob's Gaussian.

The diameter of a disc is 2.83 standard deviations.
"""
LARGEST = 0.34
"""Maximum side of a box, as a share of the side of the image, so that nearly three boxes fit."""


def propose_boxes(small: Floats) -> list[Box]:
    """Return candidate boxes around one element, without duplicates."""
    size = (small.shape[0], small.shape[1])
    found: list[tuple[float, float, float, float]] = [*_find_blobs(small), *_find_pieces(small), *_find_periods(small)]
    kept: dict[tuple[int, ...], Box] = {}
    for row, column, height, width in found:
        if min(height, width) < LEAST + 2 or height > LARGEST * size[0] or width > LARGEST * size[1]:
            continue
        centre = (int(np.floor(row + 0.5)), int(np.floor(column + 0.5)))
        sides = (round_to_odd(height), round_to_odd(width))
        if all(sides[a] // 2 <= centre[a] < size[a] - sides[a] // 2 for a in range(2)):
            kept[(*centre, *sides)] = Box(centre, sides)
    return list(kept.values())


def _find_blobs(small: Floats) -> list[tuple[float, float, float, float]]:
    """Return boxes around blobs: maxima of the normalised Laplacian in scale and space (Lindeberg 1998)."""
    from scipy.ndimage import gaussian_laplace, maximum_filter

    light = to_lab(small)[..., 0]
    stack = np.stack([-(s * s) * gaussian_laplace(light, s, mode="nearest") for s in SIGMAS])
    found = []
    for sign in (1.0, -1.0):
        signed = sign * stack
        for k, sigma in enumerate(SIGMAS):
            near = signed[max(0, k - 1) : k + 2].max(axis=0)
            margin = int(BLOB * sigma / 2) + 1
            top = (maximum_filter(near, 2 * int(sigma) + 1) == signed[k]) & (signed[k] > 0.01)
            inner = np.zeros_like(top)
            inner[margin:-margin, margin:-margin] = True
            places = np.argwhere(top & inner)
            if len(places) < 3:
                continue
            values = signed[k][tuple(places.T)]
            # Prefer blobs of usual strength, because the strongest blobs are often not elements.
            order = np.lexsort((places[:, 1], places[:, 0], np.abs(values - np.quantile(values, 0.7))))
            found += [(float(r), float(c), BLOB * sigma, BLOB * sigma) for r, c in places[order[:A_KIND]]]
    return found


def _find_pieces(small: Floats) -> list[tuple[float, float, float, float]]:
    """Return boxes around segmented areas of the most usual size."""
    inner = rank_pieces(segment(small, ElementOptions(segmentation="components")).elements)
    if len(inner) < 3:
        return []
    sides = [np.median([r.bbox[a + 2] - r.bbox[a] for r in inner[: max(3, len(inner) // 2)]]) for a in range(2)]
    found = []
    for r in inner[:PIECES]:
        middle = [(r.bbox[a] + r.bbox[a + 2] - 1) / 2 for a in range(2)]
        found.append((middle[0], middle[1], float(r.bbox[2] - r.bbox[0]), float(r.bbox[3] - r.bbox[1])))
        found.append((middle[0], middle[1], float(sides[0]), float(sides[1])))
    return found


def _find_periods(small: Floats) -> list[tuple[float, float, float, float]]:
    """Return boxes of one lattice cell each, at the places of the image with the fewest edges."""
    from scipy.ndimage import gaussian_gradient_magnitude, uniform_filter

    regular = find_lattice(small)
    if regular is None:
        return []
    sides = [max(abs(regular.a[axis]), abs(regular.b[axis])) * 0.8 for axis in range(2)]
    edges = gaussian_gradient_magnitude(small.mean(axis=-1), 1.0)
    found = []
    for share in (1.0, 0.5):
        height, width = (max(5.0, share * s) for s in sides)
        even = uniform_filter(edges, (round_to_odd(height * 0.7), round_to_odd(width * 0.7)))
        rows, columns = (int(s / 2) + 1 for s in (height, width))
        inner = even[rows:-rows, columns:-columns]
        if not inner.size:
            continue
        for place in np.argsort(inner, axis=None, kind="stable")[:: max(1, inner.size // 3)][:2]:
            row, column = np.unravel_index(int(place), inner.shape)
            found.append((float(row + rows), float(column + columns), height, width))
    return found


def resize_box(box: Box, size: tuple[int, ...]) -> list[Box]:
    """Return larger and smaller variants of a box, with one or both sides changed by about 1/3, if they fit."""
    found = []
    for tall, wide in ((1.35, 1), (1, 1.35), (0.74, 1), (1, 0.74), (1.35, 1.35), (0.74, 0.74)):
        sides = (round_to_odd(box.size[0] * tall + 0.5), round_to_odd(box.size[1] * wide + 0.5))
        fits = all(sides[a] // 2 <= box.centre[a] < size[a] - sides[a] // 2 for a in range(2))
        if fits and min(sides) >= LEAST + 2 and all(sides[a] <= LARGEST * size[a] for a in range(2)):
            found.append(Box(box.centre, sides))
    return found

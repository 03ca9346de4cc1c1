"""Measure the size of elements all over an image: on a plane, on a curved surface, or on any other surface.

If no plane fits, several independent methods measure the sizes: fine and coarse patterns (`_patterns`), and masks of
pixels that are lighter than their surroundings. The masks differ in the size of their smallest feature. A single mask
may be misleading. It may mark gaps in one part of an image and elements in another, or only grain where elements are
large. Its sizes may then change in the wrong direction. Therefore the result is the mean of the largest group of maps
that agree. If no maps agree, sizes remain unknown.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from texrs import scale_maps
from texrs._arrays import as_image, as_mask, exp_single, guidance, log_single
from texrs._progress import ask
from texrs._typing import Array, Bools, Floats
from texrs.errors import InvalidInput
from texrs.planes._find import find, prepare
from texrs.planes._patterns import blur_levels, measure_in_sizes
from texrs.planes._plane import Plane
from texrs.scale_maps import ScaleMap
from texrs.scale_maps.trend import follow

__all__ = ["SURE", "ScaleEstimate", "Shape", "measure_scale"]

Reals = NDArray[np.float64]
Shape: TypeAlias = Literal["plane", "curved", "free", "even"]
"""Kind of surface to which measured sizes belong."""

SURE = 0.4
"""Confidence below which a plane or a map is not trusted. Callers then warn."""
BANDS = 1.0, 1.6, 2.5
"""Standard deviations of the Gaussians for measuring patterns of the usual size, in samples."""
LADDER, SETTLING = tuple(0.6 * 1.3**k for k in range(9)), 6
"""Standard deviations of the evaluated Gaussians; and number of iterations that adapt the Gaussian to local sizes.

A fixed Gaussian blurs small patterns away and misses a third to a half of the change in size.
"""
FINEST, DETAILS = 1 / 400, (1.0, 2.5, 6.0)
"""Smallest feature of a mask as a share of the shorter side, at least one pixel; and its multiple for each mask."""
LATTICE = 24
"""Approximate number of positions along each side for comparing maps."""
APART, LEVEL = 0.6, 0.03
"""Maximum difference of two maps that agree, and the least value of this limit. Both are standard deviations.

The first limit is a share of the larger standard deviation of the two maps, the second is in natural logarithms.
"""
BENT, MORE = 0.04, 0.8
"""Maximum deviation from a plane, and the same limit as a share of the variation of the plane.

Both are standard deviations, the first in natural logarithms. The share is needed because distant parts are blurred,
so steep planes seem to bend.
"""
ROUGH = 0.12
"""Maximum standard deviation of sizes from a curved surface that fits, in natural logarithms."""
UNEVEN = 0.6
"""Logarithm of the ratio between the ranges of size of two bands that lowers the confidence to 1 / e."""
FEWEST = 24
"""Minimum number of windows for the fit of a curved surface."""
TERMS = 6
"""Number of terms of a quadratic surface."""


@dataclass(frozen=True, slots=True, eq=False)
class ScaleEstimate:
    """Sizes of elements in an image, as measured.

    Attributes
    ----------
    scale : (H, W) ScaleMap
        Scale map. Its kind is "width" if the shape is a plane, else "area". The kind is also "area" if the image is
        too small for patterns.
    shape : {"plane", "curved", "free", "even"}
        Surface that was measured. "plane": a plane. "curved": sizes that are quadratic in the position, as on a
        cylinder or a bulge. "free": neither. "even": no agreement, so all elements are assumed to be equally large.
    plane : Plane or None
        The plane that was found. None for other shapes, and for a plane that only fits the measured sizes.
    confidence : float
        Agreement of the measurements by several methods, 0 to 1. The confidence is 0 if the image is too small for
        more than one method.

    Examples
    --------
    >>> from texrs import planes, samples
    >>> found = planes.measure_scale(samples.tilted_discs((128, 128)).image)
    >>> found.scale.shape, found.shape
    ((128, 128), 'plane')

    """

    scale: ScaleMap
    shape: Shape
    plane: Plane | None
    confidence: float

    def as_dict(self) -> dict[str, Any]:
        """Return everything except the map as JSON types.

        Returns
        -------
        dict
            ``shape``, ``scale_kind``, ``confidence`` from 0 to 1, and ``plane``, a dict or None.

        Examples
        --------
        >>> from texrs import planes, samples
        >>> sorted(planes.measure_scale(samples.tilted_discs((128, 128)).image).as_dict())
        ['confidence', 'plane', 'scale_kind', 'shape']

        """
        plane = None if self.plane is None else self.plane.as_dict()
        return {"shape": self.shape, "scale_kind": self.scale.kind, "confidence": self.confidence, "plane": plane}


def measure_scale(image: object, *, known: object = None) -> ScaleEstimate:
    """Measure the size of elements all over an image.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array
        A texture that is homogeneous on its surface, each side at least 16 pixels.
    known : (H, W) bool array, optional
        Mask of the pixels that show the texture. Default: all pixels.

    Returns
    -------
    ScaleEstimate
        The scale map, the kind of its surface, the plane if there is one, and the confidence.

    Raises
    ------
    InvalidInput
        If the image has one colour, or too little detail to be measured.

    Examples
    --------
    >>> from texrs import planes, samples
    >>> found = planes.measure_scale(samples.tilted_discs((192, 192)).image)
    >>> found.shape, found.scale.kind, bool(found.scale[-1, 96] > 2 * found.scale[0, 96])
    ('plane', 'width', True)

    """
    pixels = as_image(image)
    size = pixels.shape[0], pixels.shape[1]
    there = np.ones(size, np.bool_) if known is None else as_mask(known, "known", size)
    try:
        # Measure patterns on the plane, where they are most similar, or on the image if the plane is uncertain.
        plane = find(pixels, known=there)
        sure = plane.confidence >= SURE
        voices = list_patterns(pixels, there, plane if sure else Plane(size, 0.0))
    except InvalidInput:
        # The image, or its known part, is too small for patterns, but a mask may still be possible.
        plane, sure, voices = None, False, []
    if plane is not None and sure and not bends(plane, voices):
        return ScaleEstimate(ScaleMap(plane.scale_map(), "width"), "plane", plane, plane.confidence)
    if not voices:
        mask = scale_maps.auto_mask(pixels, known=there)
        return ScaleEstimate(
            ScaleMap(scale_maps.from_mask(mask, trend="plane", known=there), "area"), "plane", None, 0.0
        )
    places = list_places(size, there)
    # Compare the sizes from patterns with the sizes from masks, all as smooth surfaces.
    said = [evaluate(v, places, size) for v in voices]
    masks = list_masks(pixels, there)
    said += [evaluate(fit(places, m[places].astype(np.float64), size), places, size) for m in masks]
    agreed, confidence = agree(said)
    confidence = float(f"{confidence * weigh_bands(said[: len(voices)]):.3g}")
    if confidence < SURE and plane is not None and sure:
        # The surface may be bent, but the methods do not agree on its shape, so keep the plane.
        return ScaleEstimate(ScaleMap(plane.scale_map(), "width"), "plane", plane, plane.confidence)
    if confidence < SURE:
        return ScaleEstimate(ScaleMap(np.ones(size, np.float32), "area"), "even", None, confidence)
    mean = np.mean([said[k] for k in agreed], axis=0)
    return shape_of(mean, places, [m for k, m in enumerate(masks) if k + len(voices) in agreed], size, confidence)


def list_patterns(pixels: Array, known: Bools, plane: Plane) -> list[Reals]:
    """Return a quadratic surface of log sizes for each band of patterns, measured near a plane."""
    size = pixels.shape[0], pixels.shape[1]
    grey, there, step = prepare(guidance(pixels), known)
    # The image was shrunk by the step, so the rise per pixel grows by the step.
    rise = plane._rise * step
    points, sizes = measure_in_sizes(blur_levels(grey), there, rise, LADDER)
    if len(points) < FEWEST:
        return []
    width = 1 / (1 - points[:, 0] * rise[0] - points[:, 1] * rise[1])
    rows, columns = (points[:, k] * width * step + (size[k] - 1) / 2 for k in range(2))
    terms = list_terms((rows, columns), size)
    found = []
    for sigma in BANDS:
        away = np.zeros(len(points))
        for _ in range(SETTLING):
            ask()
            # Take the sizes on the flattened plane, where all patterns have about the same size.
            flat = look_up(sizes, np.log(sigma / LADDER[0]) / np.log(LADDER[1] / LADDER[0]) + away)
            smooth = np.einsum("ni,i->n", terms, fit((rows, columns), flat, size))
            away = (smooth - np.median(smooth)) / np.log(LADDER[1] / LADDER[0])
        found.append(fit((rows, columns), flat + 1.5 * np.log(width), size))
    return found


def look_up(sizes: Reals, steps: Reals) -> Reals:
    """Interpolate a table of values at a fractional index for each position (column), clipped to its ends."""
    at = np.clip(steps, 0, len(sizes) - 1)
    low = np.minimum(at.astype(np.intp), len(sizes) - 2)
    places = np.arange(sizes.shape[1])
    return np.asarray(sizes[low, places] + (at - low) * (sizes[low + 1, places] - sizes[low, places]), np.float64)


def list_masks(pixels: Array, known: Bools) -> list[Floats]:
    """Return maps (H, W) of log sizes, one for each smallest feature, from masks of the image."""
    found = []
    finest = max(1.0, FINEST * min(pixels.shape[:2]))
    for times in DETAILS:
        try:
            mask = scale_maps.auto_mask(pixels, min_feature_size=times * finest, trend="quadratic", known=known)
            found.append(log_single(scale_maps.from_mask(mask, known=known)))
        except InvalidInput:
            # The image has no features of this size, so continue with the next size.
            continue
    return found


def list_places(size: tuple[int, int], known: Bools) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the known positions of a lattice."""
    steps = [max(1, n // LATTICE) for n in size]
    thin = np.zeros(size, np.bool_)
    thin[steps[0] // 2 :: steps[0], steps[1] // 2 :: steps[1]] = True
    chosen = thin & known
    rows, columns = np.nonzero(chosen if np.count_nonzero(chosen) >= FEWEST else known)
    return rows, columns


def list_terms(places: tuple[Array, Array], size: tuple[int, int]) -> Reals:
    """Return the terms 1, y, x, yy, yx, xx of a quadratic surface, (n, 6), with positions from -1 to 1."""
    y, x = (2 * at / max(1, n - 1) - 1 for at, n in zip(places, size, strict=True))
    return np.stack([np.ones_like(y), y, x, y * y, y * x, x * x], axis=-1)


def fit(places: tuple[Array, Array], logs: Reals, size: tuple[int, int]) -> Reals:
    """Fit a quadratic surface robustly, so that outliers count little."""
    terms = list_terms(places, size)
    weights, found = np.ones(len(logs)), np.zeros(TERMS)
    for _ in range(12):
        heavy = terms * weights[:, np.newaxis]
        normal = np.einsum("ni,nj->ij", heavy, terms) + 1e-9 * len(logs) * np.eye(TERMS)
        found = np.linalg.solve(normal, np.einsum("ni,n->i", heavy, logs))
        away = np.abs(logs - np.einsum("ni,i->n", terms, found))
        weights = 1 / np.sqrt(1 + (away / max(1.5 * float(np.median(away)), 1e-6)) ** 2)
    # Round the result, because the last bits of a fit depend on the processor.
    return np.asarray(np.rint(found * 2.0**20) / 2.0**20, np.float64)


def evaluate(surface: Reals, places: tuple[Array, Array], size: tuple[int, int]) -> Reals:
    """Return the values of a quadratic surface at positions, minus their mean."""
    values = np.einsum("ni,i->n", list_terms(places, size), surface)
    return np.asarray(values - values.mean(), np.float64)


def bends(plane: Plane, voices: list[Reals]) -> bool:
    """Return True if the patterns of all bands show that the surface is curved in the same way."""
    if len(voices) < 2:
        return False
    places = list_places(plane.shape, np.ones(plane.shape, np.bool_))
    flat = np.log(plane.scale_map("area")[places].astype(np.float64))
    off = [evaluate(v, places, plane.shape) - (flat - flat.mean()) for v in voices]
    # Remove the linear part: an error of the slope is not a bend.
    basis = list_terms(places, plane.shape)[:, :3]
    normal = np.einsum("ni,nj->ij", basis, basis)
    slopes = [np.linalg.solve(normal, np.einsum("ni,n->i", basis, o)) for o in off]
    bent = [o - np.einsum("ni,i->n", basis, s) for o, s in zip(off, slopes, strict=True)]
    common = np.mean(bent, axis=0)
    much, apart = float(common.std()), max(float((b - common).std()) for b in bent)
    return much > max(BENT, MORE * float(flat.std())) and apart < 0.5 * much


def agree(said: list[Reals]) -> tuple[list[int], float]:
    """Return the indices of the maps that agree, and a confidence from their number and similarity."""
    if len(said) < 2:
        return list(range(len(said))), 0.0
    apart = np.array([[float((a - b).std()) for b in said] for a in said])
    ranges = np.array([float(a.std()) for a in said])
    near = apart <= np.maximum(LEVEL, APART * np.maximum.outer(ranges, ranges))
    votes = near.sum(axis=1)
    # Choose the map that most maps agree with. If there are several, choose the map closest to the others.
    best = min(range(len(said)), key=lambda k: (-votes[k], float(np.median(apart[k])), k))
    agreed = [int(k) for k in np.nonzero(near[best])[0]]
    if len(agreed) < 2:
        return agreed, 0.0
    share = (len(agreed) - 1) / (len(said) - 1)
    spread = max(float(ranges[agreed].mean()), LEVEL)
    alike = float(np.mean([apart[best, k] for k in agreed if k != best]))
    return agreed, float(f"{share * np.exp(-((alike / (2 * spread)) ** 2)):.3g}")


def weigh_bands(said: list[Reals]) -> float:
    """Return a factor of the confidence, which is lower if one band measures a wider range of sizes than another.

    All bands measure the same few elements, so random changes of size are the same in all bands. But coarse bands
    contain fewer patterns, so a random change gives them another range than fine bands.
    """
    ranges = [max(float(a.std()), LEVEL) for a in said]
    return float(np.exp(-((np.log(max(ranges) / min(ranges)) / UNEVEN) ** 2))) if ranges else 1.0


def shape_of(
    mean: Reals,
    places: tuple[NDArray[np.intp], NDArray[np.intp]],
    free: list[Floats],
    size: tuple[int, int],
    sure: float,
) -> ScaleEstimate:
    """Return the map of the agreed sizes: a plane if it fits well, else a curved surface, else the map from masks."""
    surface = fit(places, mean, size)
    every = tuple(np.indices(size).reshape(2, -1))
    curved = np.einsum("ni,i->n", list_terms((every[0], every[1]), size), surface).reshape(size)
    low, high = float(mean.min()) - np.log(2), float(mean.max()) + np.log(2)
    logs = np.clip(curved, low, high).astype(np.float32)
    widths = logs * np.float32(2 / 3)
    flat = follow(widths, "plane")
    if float((flat - widths)[places].std()) * 1.5 < BENT:
        return ScaleEstimate(ScaleMap(exp_single(flat - flat.mean()), "width"), "plane", None, sure)
    if len(free) > 1:
        both = np.mean([m[places] - m[places].mean() for m in free], axis=0)
        apart = max(float((m[places] - m[places].mean() - both).std()) for m in free)
        if float((both - mean).std()) > ROUGH and apart < 0.5 * float((both - mean).std()):
            whole = np.asarray(sum(free[1:], free[0]) / np.float32(len(free)), np.float32)
            return ScaleEstimate(ScaleMap(exp_single(whole - whole.mean()), "area"), "free", None, sure)
    return ScaleEstimate(ScaleMap(exp_single(logs - logs.mean()), "area"), "curved", None, sure)

"""How large things are all over a picture: on a plane, on something curved, or anyhow; and how sure that is.

Where no plane fits, sizes are measured in ways that know nothing of each other: by patterns, fine and coarse (`_patterns`), and
by masks of what is lighter than its surroundings, with several bounds of what is too fine to count. A mask may mark the gaps in
one part of a picture and the things in another, or grain where things are large, and then tells sizes the wrong way round; so
each way has a voice, and what most of them say counts. Where they say nothing in common, nothing is known.
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
from texrs.scale_maps._trend import follow

__all__ = ["SURE", "ScaleEstimate", "Shape", "measure_scale"]

Reals = NDArray[np.float64]
Shape: TypeAlias = Literal["plane", "curved", "free", "even"]
"""What sizes are those of."""

SURE = 0.4
"""Confidence below which it is said that what was found may be wrong."""
BANDS = 1.0, 1.6, 2.5
"""Standard deviations of the Gaussians under which patterns are looked at, in samples, where they are of the usual size."""
LADDER, SETTLING = tuple(0.6 * 1.3**k for k in range(9)), 6
"""Those under which they are measured; and how often each is looked at anew under one that grows with it. Under one that does
not, small patterns are blurred away, and a third to a half of what sizes change is not seen."""
FINEST, DETAILS = 1 / 400, (1.0, 2.5, 6.0)
"""Of the shorter side, and at least one pixel: what is too fine to be a feature of a mask; and so many times of it."""
LATTICE = 24
"""Places along each side, about, where maps are compared."""
APART, LEVEL = 0.6, 0.03
"""Standard deviation of the difference of two maps up to which they say the same, as a share of that of the map that says more;
and what it may be in any case, in logarithms."""
BENT, MORE = 0.04, 0.8
"""Standard deviation, in logarithms, of what bends off a plane, below which the plane is good enough; and the share of that of
the plane itself: what is far is blurred, so that steep planes seem to bend."""
ROUGH = 0.12
"""The same of what is off a curved surface."""
UNEVEN = 0.6
"""Logarithm of the ratio of what patterns of two bands say sizes change by, at which the confidence is 1 / e of what it was."""
FEWEST = 24
"""Windows that say something about a curved surface."""
TERMS = 6
"""Of a quadratic surface."""


@dataclass(frozen=True, slots=True, eq=False)
class ScaleEstimate:
    """How large things are in a picture, as it was measured.

    Attributes
    ----------
    scale : (H, W) ScaleMap
        Of widths on a plane, else of square roots of areas.
    shape : {"plane", "curved", "free", "even"}
        What was measured: a plane; a surface whose sizes are quadratic in the picture, as those of a cylinder or a bulge; none
        of these; or nothing in common, so that all is taken for equally large.
    plane : Plane or None
        Of "plane", where it was found.
    confidence : float
        From 0 to 1: how much what was measured in several ways is alike. 0 of pictures that are too small for more than one.

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
        """Return what is known beside the map, as JSON types: shape, what the map holds, confidence, and the plane or None.

        Returns
        -------
        dict
            ``shape``, ``scale_kind``, ``confidence`` from 0 to 1 and ``plane``.

        Examples
        --------
        >>> from texrs import planes, samples
        >>> sorted(planes.measure_scale(samples.tilted_discs((128, 128)).image).as_dict())
        ['confidence', 'plane', 'scale_kind', 'shape']

        """
        plane = None if self.plane is None else self.plane.as_dict()
        return {"shape": self.shape, "scale_kind": self.scale.kind, "confidence": self.confidence, "plane": plane}


def measure_scale(image: object, *, known: object = None) -> ScaleEstimate:
    """Measure how large things are all over a picture.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array
        A texture that is the same all over its surface, each side at least 16.
    known : (H, W) bool array, optional
        Where the picture shows it; all of it by default.

    Returns
    -------
    ScaleEstimate
        The map, what it is of, and how sure it is.

    Raises
    ------
    InvalidInput
        A picture of one colour, or in which there is too little to be measured.

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
        plane = find(pixels, known=there)
        sure = plane.confidence >= SURE
        voices = list_patterns(pixels, there, plane if sure else Plane(size, 0.0))
    except InvalidInput:
        # Too small, or too little of it is known; a mask may still be found.
        plane, sure, voices = None, False, []
    if plane is not None and sure and not bends(plane, voices):
        return ScaleEstimate(ScaleMap(plane.scale_map(), "width"), "plane", plane, plane.confidence)
    if not voices:
        mask = scale_maps.auto_mask(pixels, known=there)
        return ScaleEstimate(
            ScaleMap(scale_maps.from_mask(mask, trend="plane", known=there), "area"), "plane", None, 0.0
        )
    places = list_places(size, there)
    said = [evaluate(v, places, size) for v in voices]
    masks = list_masks(pixels, there)
    said += [evaluate(fit(places, m[places].astype(np.float64), size), places, size) for m in masks]
    agreed, confidence = agree(said)
    confidence = float(f"{confidence * weigh_bands(said[: len(voices)]):.3g}")
    if confidence < SURE and plane is not None and sure:
        # It may bend, but nobody knows how.
        return ScaleEstimate(ScaleMap(plane.scale_map(), "width"), "plane", plane, plane.confidence)
    if confidence < SURE:
        return ScaleEstimate(ScaleMap(np.ones(size, np.float32), "area"), "even", None, confidence)
    mean = np.mean([said[k] for k in agreed], axis=0)
    return shape_of(mean, places, [m for k, m in enumerate(masks) if k + len(voices) in agreed], size, confidence)


def list_patterns(pixels: Array, known: Bools, plane: Plane) -> list[Reals]:
    """Return quadratic surfaces of the logarithms of sizes, as patterns of each band have them, measured on about a plane."""
    size = pixels.shape[0], pixels.shape[1]
    grey, there, step = prepare(guidance(pixels), known)
    # Of what is shrunk.
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
            # On the plane, where all are about as large.
            flat = look_up(sizes, np.log(sigma / LADDER[0]) / np.log(LADDER[1] / LADDER[0]) + away)
            smooth = np.einsum("ni,i->n", terms, fit((rows, columns), flat, size))
            away = (smooth - np.median(smooth)) / np.log(LADDER[1] / LADDER[0])
        found.append(fit((rows, columns), flat + 1.5 * np.log(width), size))
    return found


def look_up(sizes: Reals, steps: Reals) -> Reals:
    """Return what each place, a column, has at so many steps of a ladder, between its rungs, and no further than its ends."""
    at = np.clip(steps, 0, len(sizes) - 1)
    low = np.minimum(at.astype(np.intp), len(sizes) - 2)
    places = np.arange(sizes.shape[1])
    return np.asarray(sizes[low, places] + (at - low) * (sizes[low + 1, places] - sizes[low, places]), np.float64)


def list_masks(pixels: Array, known: Bools) -> list[Floats]:
    """Return maps of the logarithms of sizes, (H, W), by masks of what is coarser than each detail."""
    found = []
    finest = max(1.0, FINEST * min(pixels.shape[:2]))
    for times in DETAILS:
        try:
            mask = scale_maps.auto_mask(pixels, min_feature_size=times * finest, trend="quadratic", known=known)
            found.append(log_single(scale_maps.from_mask(mask, known=known)))
        except InvalidInput:
            # Nothing is so coarse; others may say something.
            continue
    return found


def list_places(size: tuple[int, int], known: Bools) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return places of a lattice where the picture is known."""
    steps = [max(1, n // LATTICE) for n in size]
    thin = np.zeros(size, np.bool_)
    thin[steps[0] // 2 :: steps[0], steps[1] // 2 :: steps[1]] = True
    chosen = thin & known
    rows, columns = np.nonzero(chosen if np.count_nonzero(chosen) >= FEWEST else known)
    return rows, columns


def list_terms(places: tuple[Array, Array], size: tuple[int, int]) -> Reals:
    """Return what a quadratic surface is the sum of, (n, 6): 1, y, x, yy, yx, xx, from -1 to 1."""
    y, x = (2 * at / max(1, n - 1) - 1 for at, n in zip(places, size, strict=True))
    return np.stack([np.ones_like(y), y, x, y * y, y * x, x * x], axis=-1)


def fit(places: tuple[Array, Array], logs: Reals, size: tuple[int, int]) -> Reals:
    """Fit a quadratic surface, by weights that let few strays count little."""
    terms = list_terms(places, size)
    weights, found = np.ones(len(logs)), np.zeros(TERMS)
    for _ in range(12):
        heavy = terms * weights[:, np.newaxis]
        normal = np.einsum("ni,nj->ij", heavy, terms) + 1e-9 * len(logs) * np.eye(TERMS)
        found = np.linalg.solve(normal, np.einsum("ni,n->i", heavy, logs))
        away = np.abs(logs - np.einsum("ni,i->n", terms, found))
        weights = 1 / np.sqrt(1 + (away / max(1.5 * float(np.median(away)), 1e-6)) ** 2)
    # The last bits of a fit hang on the processor.
    return np.asarray(np.rint(found * 2.0**20) / 2.0**20, np.float64)


def evaluate(surface: Reals, places: tuple[Array, Array], size: tuple[int, int]) -> Reals:
    """Return the values of a quadratic surface at places, about their mean."""
    values = np.einsum("ni,i->n", list_terms(places, size), surface)
    return np.asarray(values - values.mean(), np.float64)


def bends(plane: Plane, voices: list[Reals]) -> bool:
    """Tell whether patterns of every band say that what is seen is bent off a plane, and all in the same way."""
    if len(voices) < 2:
        return False
    places = list_places(plane.shape, np.ones(plane.shape, np.bool_))
    flat = np.log(plane.scale_map("area")[places].astype(np.float64))
    off = [evaluate(v, places, plane.shape) - (flat - flat.mean()) for v in voices]
    # A slope that is off is no bend.
    basis = list_terms(places, plane.shape)[:, :3]
    normal = np.einsum("ni,nj->ij", basis, basis)
    slopes = [np.linalg.solve(normal, np.einsum("ni,n->i", basis, o)) for o in off]
    bent = [o - np.einsum("ni,i->n", basis, s) for o, s in zip(off, slopes, strict=True)]
    common = np.mean(bent, axis=0)
    much, apart = float(common.std()), max(float((b - common).std()) for b in bent)
    return much > max(BENT, MORE * float(flat.std())) and apart < 0.5 * much


def agree(said: list[Reals]) -> tuple[list[int], float]:
    """Return which maps say the same, and how sure that is: by how many they are, and how much alike."""
    if len(said) < 2:
        return list(range(len(said))), 0.0
    apart = np.array([[float((a - b).std()) for b in said] for a in said])
    ranges = np.array([float(a.std()) for a in said])
    near = apart <= np.maximum(LEVEL, APART * np.maximum.outer(ranges, ranges))
    votes = near.sum(axis=1)
    # Of the most voices the closest.
    best = min(range(len(said)), key=lambda k: (-votes[k], float(np.median(apart[k])), k))
    agreed = [int(k) for k in np.nonzero(near[best])[0]]
    if len(agreed) < 2:
        return agreed, 0.0
    share = (len(agreed) - 1) / (len(said) - 1)
    spread = max(float(ranges[agreed].mean()), LEVEL)
    alike = float(np.mean([apart[best, k] for k in agreed if k != best]))
    return agreed, float(f"{share * np.exp(-((alike / (2 * spread)) ** 2)):.3g}")


def weigh_bands(said: list[Reals]) -> float:
    """Return how much it counts that patterns of all bands say the same: less where one says more than another.

    They see the same few things, so what is only chance is the same to all, but coarse ones see fewer of them.
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
    """Return the map of what was agreed on: of a plane where that is enough, else curved, else as masks have it."""
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

"""Find the plane that an image shows, from its pixels only.

There are two sources of evidence. Patterns of a texture differ only by perspective (`_patterns`). Straight lines in
one direction meet on the horizon (`_lines`). Both determine only the horizon, and the angle of view then determines
the slant. Fine and coarse patterns are evaluated separately, and the confidence depends on their agreement.
"""

from __future__ import annotations

from math import atan, ceil, cos, degrees, erf, exp, radians, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_float, as_image, as_mask, guidance
from texrs._typing import Bools, Floats
from texrs.errors import InvalidInput
from texrs.planes._lines import find_lines, lean
from texrs.planes._patterns import LEAST, blur_levels, follow
from texrs.planes._plane import FOV, Plane
from texrs.planes.projective import find_focal
from texrs.scale_maps.auto import take_grey

__all__ = ["find"]

Reals = NDArray[np.float64]

SMALLEST = 64
"""Minimum side of an image, in pixels."""
LARGEST = 520
"""Maximum longer side after shrinking, in pixels. Slopes of finer patterns contain little information."""
FINE = 1.0, 1.6
"""Standard deviations, in samples, of the Gaussians that blur the image. Each should give the same plane."""
HALVED, FIRST = 400, 4
"""Minimum longer side in pixels for first rounds at half the resolution; and maximum number of these rounds."""
RIGHT, STRAIGHT = (8.0, 15.0), 20.0
"""Maximum errors of slant and tilt of a correct plane; and slant below which a larger error of the tilt is accepted.

All are in degrees. A small slant does not determine the tilt well.
"""
DOUBT = 0.04, 0.05, 0.35, 0.4
"""Terms of the standard deviation of the rise over the longer side. The confidence depends on this deviation.

The terms are a constant, and factors of the rise, of the deviation of measurements from the plane, and of the
difference between bands. Chosen on 168 generated floors.
"""
ROUGH = 0.25
"""Deviation of measurements from the plane that lowers the confidence to 1 / e.

Curved surfaces deviate more, and so do images without a surface.
"""
SMALL = 256
"""Longer side in pixels below which bands may differ more: fewer elements are visible, and each is more blurred."""
UNSURE = 0.02, 0.03, 2.0
"""Terms of the standard deviation of the rise from patterns over the longer side.

The terms are a constant, and factors of the rise and of the deviation of measurements. The difference between bands is
added.
"""
SHARED = 0.5
"""Minimum share of the bands' difference that remains after lines are used. Both bands use the same lines."""
FEWEST = 20
"""Minimum number of lines. If there are fewer, lines are not used."""


def find(image: object, *, fov: float | None = None, known: object = None) -> Plane:
    """Find the orientation of the plane that an image shows.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array
        An oblique view of a plane with a homogeneous texture, each side at least 64 pixels.
    fov : float, optional
        Angle of view of the longer side in degrees, 1 to 170. The image does not determine this angle. The tilt is
        valid for any angle of view, the slant only for this angle. Default: `FOV`.
    known : (H, W) bool array, optional
        Mask of the pixels that show the plane. Default: all pixels.

    Returns
    -------
    Plane
        The plane. Its confidence, 0 to 1, is about the probability that the slant is right within 8 degrees and the
        tilt within 15. It depends on the agreement of fine and coarse patterns, and of all parts of the image.

    Raises
    ------
    InvalidInput
        If the image is too small or has one colour, or too few pixels are known.

    Examples
    --------
    >>> from texrs import planes, samples
    >>> floor = samples.tilted_discs((192, 256))
    >>> plane = planes.find(floor.image)
    >>> abs(plane.tilt - 90) < 8
    True

    """
    pixels = as_image(image, minimum=SMALLEST)
    size = pixels.shape[0], pixels.shape[1]
    angle = FOV if fov is None else as_float(fov, "fov", 1, 170)
    there = np.ones(size, np.bool_) if known is None else as_mask(known, "known", size)
    colours = guidance(pixels)
    if there.sum() < SMALLEST**2 / 4:
        raise InvalidInput(f"known: must mark at least {SMALLEST**2 // 4} pixels of the plane, got {int(there.sum())}")
    if float(colours[there].std(axis=0).max()) < 1e-4:
        raise InvalidInput(
            "image: must contain a texture, but has a single colour; give the corners or angles of the plane"
        )
    grey, there, step = prepare(colours, there)
    rise, confidence = look(grey, there, find_focal(grey.shape, angle) / max(grey.shape))
    # Keep six digits, because later digits of a fit depend on the processor.
    rounded = [float(f"{r / step / max(grey.shape):.6g}") for r in rise]
    return Plane._of_line(size, np.array([*rounded, 1.0]), "image", angle, float(f"{confidence:.3g}"))


def prepare(colours: Floats, known: Bools) -> tuple[Floats, Bools, int]:
    """Return a grey image of at most `LARGEST` pixels a side, its known pixels, and the pixels per sample."""
    step = max(1, ceil(max(known.shape) / LARGEST))
    small, there = _shrink(colours, known, step)
    return take_grey(small, there), there, step


def _shrink(colours: Floats, known: Bools, step: int) -> tuple[Floats, Bools]:
    """Return the means of blocks of ``step`` pixels a side, and whether each block is completely known."""
    if step == 1:
        return colours, known
    rows, columns = (n // step * step for n in known.shape)
    parts = [colours[i:rows:step, j:columns:step] for i in range(step) for j in range(step)]
    whole = known[:rows, :columns].reshape(rows // step, step, columns // step, step).all(axis=(1, 3))
    return np.asarray(sum(parts[1:], parts[0]) * np.float32(1 / step**2), np.float32), np.asarray(whole)


def look(grey: Floats, known: Bools, focal: float) -> tuple[Reals, float]:
    """Return the rise (2,) of the width over the longer side, and its confidence.

    The focal length is also relative to the longer side.
    """
    side = max(grey.shape)
    starts = [np.zeros(2) for _ in FINE]
    if side >= HALVED:
        # Start each band separately: a band that started from the result of another band would agree with it too soon.
        small, whole = _shrink(grey[..., np.newaxis], known, 2)
        levels = blur_levels(small[..., 0])
        starts = [follow(levels, whole, sigma, at, FIRST)[0] / 2 for sigma, at in zip(FINE, starts, strict=True)]
    levels = blur_levels(grey)
    found = [follow(levels, known, sigma, at) for sigma, at in zip(FINE, starts, strict=True)]
    told = [(rise * side, off) for rise, off in found if np.isfinite(off)]
    if not told:
        return np.zeros(2), 0.0
    bands, offs = [rise for rise, _ in told], [off for _, off in told]
    apart = measure(bands[-1] - bands[0]) if len(bands) > 1 else 1.0
    lines = find_lines(grey, known)
    if len(lines.lengths) >= FEWEST:
        rough = UNSURE[2] * max(0.0, min(offs) - LEAST)
        bands = [lean(lines, side, b, UNSURE[0] + UNSURE[1] * measure(b) + rough + apart, focal).rise for b in bands]
        if len(bands) > 1:
            apart = max(SHARED * apart, measure(bands[-1] - bands[0]))
    return bands[0], trust(measure(bands[0]), apart / max(1.0, SMALL / side) ** 0.5, offs[0], focal)


def trust(rise: float, apart: float, off: float, focal: float) -> float:
    """Return the probability that slant and tilt are right, from the difference of bands and the deviation.

    The same error of the rise changes the tilt much if the rise is small, and the slant little if the rise is large.
    """
    constant, rising, rough, differing = DOUBT
    doubt = constant + rising * rise + rough * max(0.0, off - LEAST) + differing * apart
    slant = atan(rise * focal)
    allowed = RIGHT[1] * max(1.0, sin(radians(STRAIGHT)) / max(sin(slant), 1e-6))
    chances = [
        erf(most / degrees(each) / sqrt(2))
        for most, each in ((RIGHT[0], doubt * focal * cos(slant) ** 2), (allowed, doubt / max(rise, 1e-6)))
    ]
    return chances[0] * chances[1] * exp(-((off / ROUGH) ** 2))


def measure(way: Reals) -> float:
    """Return the length of a vector."""
    return float(np.sqrt((way * way).sum()))

"""The plane of a picture, found in the picture alone.

Two things tell of it: patterns, which are the same all over a texture but for how they are seen (`_patterns`), and straight
lines, which meet on the horizon where many run in one direction (`_lines`). Both tell only the horizon; the angle of view then
gives the slant. Fine and coarse patterns are followed for themselves: how sure a plane is hangs on whether they agree.
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
from texrs.planes._projective import find_focal
from texrs.scale_maps._auto import take_grey

__all__ = ["find"]

Reals = NDArray[np.float64]

SMALLEST = 64
"""Pixels across the smallest picture that a plane is looked for in."""
LARGEST = 520
"""A longer side is shrunk to so many pixels: slopes of patterns finer than that tell little."""
FINE = 1.0, 1.6
"""Standard deviations of the Gaussians under which slopes are taken, in samples: each should find the same plane."""
HALVED, FIRST = 400, 4
"""Pixels of the longer side from which on the first rounds, and so many at most, look at half the resolution."""
RIGHT, STRAIGHT = (8.0, 15.0), 20.0
"""Degrees by which slant and tilt may be off where a plane counts as found; and the slant below which tilts may be off by more,
as they tell less."""
DOUBT = 0.04, 0.05, 0.35, 0.4
"""Standard deviation of the rise, over the longer side, that the confidence counts with: a constant, what the rise adds, what
adds that what is measured deviates from the plane, and that bands differ. Chosen on 168 generated floors."""
ROUGH = 0.25
"""Deviation of what is measured from the plane at which the confidence is 1 / e: of curved things, and of none."""
SMALL = 256
"""Pixels of the longer side below which bands may differ more: there are fewer things to be seen, and the camera blurs more of
each."""
UNSURE = 0.02, 0.03, 2.0
"""Standard deviation of the rise that patterns tell, over the longer side: a constant, what the rise adds, and what adds that
they deviate; what bands differ is added to it."""
SHARED = 0.5
"""Lines are the same for both bands, so what these differ counts by so much at least."""
FEWEST = 20
"""Lines from which on they are asked."""


def find(image: object, *, fov: float | None = None, known: object = None) -> Plane:
    """Find how the plane lies that a picture shows.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array
        A texture seen aslant, the same all over its plane; each side at least 64.
    fov : float, optional
        Degrees that the longer side of the picture spans, 1 to 170; `FOV` by default. The picture does not tell: the tilt holds
        for any, the slant for this one.
    known : (H, W) bool array, optional
        Where the picture shows the plane; all of it by default.

    Returns
    -------
    Plane
        With a confidence from 0 to 1, about how likely the slant is right within 8 degrees, and the tilt within 15: whether
        fine and coarse patterns say the same, and all parts of the picture.

    Raises
    ------
    InvalidInput
        A picture that is too small, of one colour, or of which too little is known.

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
        raise InvalidInput(
            f"known: {int(there.sum())} pixels of the picture show the plane; {SMALLEST**2 // 4} are needed"
        )
    if float(colours[there].std(axis=0).max()) < 1e-4:
        raise InvalidInput("image: has one colour, so no plane can be found in it; give its corners, or angles")
    grey, there, step = prepare(colours, there)
    rise, confidence = look(grey, there, find_focal(grey.shape, angle) / max(grey.shape))
    # What a fit says beyond these digits hangs on the processor.
    rounded = [float(f"{r / step / max(grey.shape):.6g}") for r in rise]
    return Plane._of_line(size, np.array([*rounded, 1.0]), "image", angle, float(f"{confidence:.3g}"))


def prepare(colours: Floats, known: Bools) -> tuple[Floats, Bools, int]:
    """Return a picture of one channel of at most `LARGEST` pixels a side, what of it is known, and how many pixels each is."""
    step = max(1, ceil(max(known.shape) / LARGEST))
    small, there = _shrink(colours, known, step)
    return take_grey(small, there), there, step


def _shrink(colours: Floats, known: Bools, step: int) -> tuple[Floats, Bools]:
    """Return the means of squares of so many pixels a side, and whether all of each is known."""
    if step == 1:
        return colours, known
    rows, columns = (n // step * step for n in known.shape)
    parts = [colours[i:rows:step, j:columns:step] for i in range(step) for j in range(step)]
    whole = known[:rows, :columns].reshape(rows // step, step, columns // step, step).all(axis=(1, 3))
    return np.asarray(sum(parts[1:], parts[0]) * np.float32(1 / step**2), np.float32), np.asarray(whole)


def look(grey: Floats, known: Bools, focal: float) -> tuple[Reals, float]:
    """Return the rise of the width over the longer side, (2,), and how sure it is; the focal length is over that side too."""
    side = max(grey.shape)
    starts = [np.zeros(2) for _ in FINE]
    if side >= HALVED:
        # Each band for itself: one that starts where another ended agrees with it too soon.
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
    """Return how likely a plane is that slant and tilt are right, by what bands differ and what is measured is off it.

    The same doubt about the rise is many degrees of the tilt where the rise is small, and few of the slant where it is large.
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
    """Return the length of a way."""
    return float(np.sqrt((way * way).sum()))

"""The plane of a picture, found in the picture alone.

Of a texture that is the same everywhere, seen aslant, local patterns differ only by how they are seen. What is measured of
one is the covariance C of its autocorrelation, from mean products of slopes over the variance, N = C^-1: its size, its shape
and its direction at once, with no mask of elements, whatever the contrast. The plane is that on which C is the same
everywhere. Only its horizon can be told so: a linear change of such a texture is such a texture. The angle of view then gives
the slant.

Each round flattens the picture by the horizon found so far, measures there, and corrects it: what measuring does to large and
small patterns is the same where all are of one size. What the camera blurs is known, in pixels, and taken off: C = N^-1 - B.
"""

from __future__ import annotations

from math import ceil, hypot
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_float, as_image, as_mask, guidance
from texrs._typing import Bools, Floats
from texrs.errors import InvalidInput
from texrs.kernels.gather import gather
from texrs.planes._plane import FOV, Plane
from texrs.scale_maps._auto import take_grey

__all__ = ["find"]

SMALLEST = 64
"""Pixels across the smallest picture that a plane is looked for in."""
LARGEST = 400
"""A longer side is shrunk to so many pixels: slopes of patterns finer than that tell little."""
SPREAD = 0.1
"""Standard deviation of the windows that are measured, as a share of the side of what is flattened."""
FULL = 0.55
"""Share of a window that must be known."""
FINE = 1.0, 1.6
"""Standard deviations of the Gaussians under which slopes are taken, in samples: each should find the same plane."""
CAMERA = 0.7
"""Standard deviation of what a pixel sees, in pixels."""
FAR, COARSE = 0.25, 0.1
"""Nearer to the horizon than this share of the middle's scale nothing is looked at. The flattened picture has the resolution
of this quantile of scales: what is finer would be blurred where it is farther."""
LEVELS = 4
"""Blurred versions of the picture, each for twice the step."""
ROUNDS, STEPS = 5, 10
"""How often the picture is flattened anew, and steps of each fit."""
STEP, PARTS = 1e-4, 2.0**15
"""Differences that a fit takes its slopes from, and to which it is rounded: its last bits hang on the processor."""
LEAST = 0.03
"""Standard deviation of what is measured, in natural logarithms, that is always allowed for."""
TILTED = 0.95
"""The horizon stays so far outside: scales fall at most by this share from the middle to a corner."""
APART, ROUGH = 0.15, 0.25
"""Difference of what two bands find, and deviation of what is measured from the plane, at which the confidence is 1 / e."""
DEVIATES = 1.4826
"""Standard deviation over the median of absolute values."""
FEWEST = 8
"""Windows that say something about a plane."""
CELLS = 4
"""Cells to a standard deviation of a window, in which what is measured is summed up first."""


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
        With a confidence from 0 to 1: whether fine and coarse patterns say the same, and all parts of the picture.

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
    grey, there, step = _shrink(take_grey(colours, there), there)
    found = [_follow(grey, there, sigma) for sigma in FINE]
    told = [(rise, off) for rise, off in found if np.isfinite(off)]
    if not told:
        return Plane(size, 0.0, 90.0, angle, 0.0, 0.0)
    rise, off = told[0]
    apart = float(np.linalg.norm(told[-1][0] - rise)) * max(grey.shape) if len(told) > 1 else 1.0
    confidence = float(f"{np.exp(-((apart / APART) ** 2) - (off / ROUGH) ** 2):.3g}")
    # What a fit says beyond these digits hangs on the processor.
    rounded = [float(f"{r / step:.6g}") for r in rise]
    return Plane._of_line(size, np.array([*rounded, 1.0]), "image", angle, confidence)


def _shrink(grey: Floats, known: Bools) -> tuple[Floats, Bools, int]:
    """Return a picture of at most `LARGEST` pixels a side, by means of squares, and the side of those."""
    step = max(1, ceil(max(grey.shape) / LARGEST))
    if step == 1:
        return grey, known, 1
    rows, columns = (n // step * step for n in grey.shape)
    parts = (a[:rows, :columns].reshape(rows // step, step, columns // step, step) for a in (grey, known))
    values, seen = parts
    return values.mean(axis=(1, 3), dtype=np.float32), np.asarray(seen.all(axis=(1, 3))), step


def _follow(grey: Floats, known: Bools, sigma: float) -> tuple[NDArray[np.float64], float]:
    """Return the rise of the width a pixel, (2,), and by how much what is measured deviates from that."""
    from scipy.ndimage import gaussian_filter

    levels = [grey, *(gaussian_filter(grey, 0.5 * (4.0**k - 1) ** 0.5) for k in range(1, LEVELS))]
    rise, off = np.zeros(2), float("nan")
    for _ in range(ROUNDS):
        flat = _Flat(levels, known, rise)
        points, slopes = flat.measure(sigma)
        if len(points) < FEWEST:
            break
        change, off = _fit(points, slopes, max(grey.shape))
        rise = rise + change
        # The farthest corner lies before the horizon.
        fall = float(np.abs(rise) @ np.array(grey.shape)) / 2
        rise *= min(1.0, TILTED / max(fall, 1e-12))
        if hypot(*change) * max(grey.shape) < 0.01:
            break
    return rise, off


class _Flat:
    """A picture flattened by a horizon: its samples lie at (low + index) / resolution, in pixels of its middle."""

    def __init__(self, levels: list[Floats], known: Bools, rise: NDArray[np.float64]) -> None:
        shape = levels[0].shape
        middle = (np.array(shape) - 1) / 2
        away = np.moveaxis(np.indices(shape), 0, -1) - middle
        width = 1 + away @ rise
        open_ = known & (width > FAR)
        spread = away[open_] / width[open_][:, np.newaxis]
        low, high = spread.min(axis=0), spread.max(axis=0)
        self.rise, self.low, self.resolution = rise, low, float(np.quantile(width[open_], COARSE))
        sides = [int(n) + 1 for n in (high - low) * self.resolution]
        points = low + np.moveaxis(np.indices(sides), 0, -1) / self.resolution
        near = 1 - points @ rise
        wide = 1 / np.maximum(near, 1e-3)
        at = points * wide[..., np.newaxis] + middle
        inside = ((at >= 0) & (at <= np.array(shape) - 1)).all(axis=-1) & (near > 0) & (wide > FAR)
        places = np.clip(at, 0, np.array(shape) - 1).astype(np.float32)
        nearest = np.rint(places).astype(np.intp)
        self.known = inside & known[nearest[..., 0], nearest[..., 1]]
        octave = np.clip(np.log2(np.maximum(wide / self.resolution, 1)), 0, len(levels) - 1)
        self.picture = np.zeros(sides, np.float64)
        for k, level in enumerate(levels):
            part = np.maximum(0, 1 - np.abs(octave - k))
            if part.any():
                self.picture += part * gather(level[..., np.newaxis], places, interpolation="linear")[..., 0]

    def measure(self, sigma: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return points of the plane, (n, 2), and N around each, (n, 2, 2)."""
        from scipy.ndimage import gaussian_filter

        def blur(values: NDArray[Any], by: float) -> NDArray[np.float64]:
            return np.asarray(gaussian_filter(values, by, mode="constant"), np.float64)

        seen = self.known.astype(np.float64)
        share = blur(seen, sigma)
        picture = blur(self.picture * seen, sigma) / np.maximum(share, 1e-6)
        rows, columns = (np.asarray(slope, np.float64) for slope in np.gradient(picture))
        inner = share > 0.98
        inner[[0, -1]] = inner[:, [0, -1]] = False
        weight = inner.astype(np.float64)
        spread = SPREAD * float(np.sqrt(self.known.sum()))
        cell = max(1, int(spread / CELLS))

        def sum_up(values: NDArray[Any]) -> NDArray[np.float64]:
            rows, columns = (n // cell for n in values.shape)
            cells = values[: rows * cell, : columns * cell].reshape(rows, cell, columns, cell).mean(axis=(1, 3))
            return blur(cells, spread / cell)[lattice]

        lattice = (slice(CELLS // 2, None, CELLS),) * 2
        total = sum_up(weight)
        at = np.nonzero(total > FULL)

        def mean(values: NDArray[Any]) -> NDArray[np.float64]:
            return np.asarray(sum_up(values * weight)[at] / total[at], np.float64)

        value = mean(picture)
        variance = np.maximum(mean(picture * picture) - value**2, 1e-8)
        products = [mean(v) / variance for v in (rows * rows, rows * columns, columns * columns)]
        slopes = np.stack([products[0], products[1], products[1], products[2]], axis=-1).reshape(-1, 2, 2)
        # What a window says holds at the middle of what it sees.
        middles = [mean(v) for v in np.indices(self.known.shape, np.float64)]
        points = self.low + np.stack(middles, axis=-1) / self.resolution
        return points, self._sharpen(points, slopes + 1e-9 * np.eye(2))

    def _sharpen(self, points: NDArray[np.float64], slopes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Take off what the camera, and the levels, have blurred."""
        width = 1 / (1 - points @ self.rise)
        step = (np.eye(2) - points[:, :, np.newaxis] * self.rise) * (self.resolution / width)[:, np.newaxis, np.newaxis]
        blurred = CAMERA**2 + 0.25 * (np.maximum(width / self.resolution, 1) ** 2 - 1)
        covariance = np.linalg.inv(slopes)
        values, vectors = np.linalg.eigh(
            covariance - blurred[:, np.newaxis, np.newaxis] * step @ step.transpose(0, 2, 1)
        )
        values = np.maximum(values, 0.3 * np.linalg.eigvalsh(covariance)[:, :1])
        return np.asarray((vectors / values[:, np.newaxis]) @ vectors.transpose(0, 2, 1), np.float64)


def _fit(points: NDArray[np.float64], slopes: NDArray[np.float64], side: int) -> tuple[NDArray[np.float64], float]:
    """Return the change of the rise after which all of N is alike, and how far it is from that still."""
    from scipy.optimize import least_squares

    change, spread = np.zeros(2), np.ones(3)

    def differ(asked: NDArray[np.float64], spread: NDArray[np.float64]) -> NDArray[np.float64]:
        return (_compare(asked / side, points, slopes) / spread).ravel()

    for _ in range(2):
        found = least_squares(
            differ,
            change * side,
            loss="soft_l1",
            diff_step=STEP,
            x_scale=0.3,
            max_nfev=STEPS,
            args=(spread,),
        )
        change = np.rint(found.x * PARTS) / PARTS / side
        spread = np.maximum(DEVIATES * np.median(np.abs(_compare(change, points, slopes)), axis=0), LEAST)
    return change, float(np.sqrt(np.mean(spread**2)))


def _compare(
    change: NDArray[np.float64], points: NDArray[np.float64], slopes: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return how N differs from the usual one after a change of the horizon: logarithm of size, and two of shape, (n, 3)."""
    width = 1 + points @ change
    if width.min() < 0.05:
        return np.full((len(points), 3), 10.0)
    grown = width[:, np.newaxis, np.newaxis]
    back = np.linalg.inv((np.eye(2) * grown - points[:, :, np.newaxis] * change) / grown**2)
    seen = back.transpose(0, 2, 1) @ slopes @ back
    usual = np.median(seen, axis=0)
    values, vectors = np.linalg.eigh(usual)
    root = (vectors / np.sqrt(np.maximum(values, 1e-9 * values[-1]))) @ vectors.T
    values, vectors = np.linalg.eigh(root @ seen @ root)
    logs = (vectors * np.log(np.maximum(values, 1e-12))[:, np.newaxis]) @ vectors.transpose(0, 2, 1)
    parts = np.stack([(logs[:, 0, 0] + logs[:, 1, 1]) / 2, (logs[:, 0, 0] - logs[:, 1, 1]) / 2, logs[:, 0, 1]], axis=-1)
    return np.asarray(parts - np.median(parts, axis=0), np.float64)

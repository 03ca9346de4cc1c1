"""Find the pixels of a photograph that show its ground, and not sky, walls, or objects on the ground.

A ground is a surface with one texture. Its colours and its contrast are about the same everywhere, or change slowly
with light and distance. The search fits the slow change that most of the image follows, and excludes the windows that
deviate from it. Windows blur borders. Near a border, each pixel therefore gets the side whose usual colours match its
own.
"""

from __future__ import annotations

from math import ceil

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, as_mask, guidance
from texrs._light import Light
from texrs._progress import ask
from texrs._typing import Bools, Floats
from texrs.errors import InvalidInput
from texrs.planes._boundary_line import find_step

__all__ = ["find_ground"]

SMALLEST, TELLING = 64, 160
"""Minimum side of an image for the search, and minimum side for detecting other objects than the ground."""
LARGEST = 240
"""Maximum longer side after shrinking, in pixels."""
WINDOW, NARROWEST = 0.045, 8.0
"""Standard deviation of the windows as a share of the shorter side, and its minimum in pixels of the shrunk image."""
BANDS = 1.0, 2.5
"""Standard deviations of the Gaussians that separate detail from colours, in pixels of the shrunk image."""
COLOUR, CONTRAST = 0.02, 0.2
"""Minimum deviation that is assumed for colours, from 0 to 1, and for logarithms of contrast."""
RANGE, PLAIN = np.array([1.0, 1.0, 1.0, 4.0, 4.0]), -5.0
"""Ranges of three colours and two logarithms of contrast in images without a ground; and logarithm of the contrast of a
smooth surface.
"""
LOOSE = 1.5
"""Maximum deviation within one ground, as a multiple of the minimum deviation."""
POWER = 4
"""Exponent of the mean of deviations. It is high, so that a large deviation of one fact dominates."""
EVEN = 1.0
"""Weight of the penalty on changes across the image, relative to the fit. Positions are from -1 to 1."""
FAR = 4.0
"""Minimum deviation of a window that does not follow the ground, in standard deviations."""
ROUNDS = 20
"""Number of steps of the robust fit."""
BINS, FINE = 12, 0.012
"""Bins per colour channel; and standard deviation of windows for comparing colours, as a share of the shorter side."""
DOUBT = 2.0
"""Width of the band along a border where colours decide, as a multiple of the windows' standard deviation."""
PART, USUAL = 0.08, 0.25
"""Maximum area of a part that is added back to the ground, as a share of the image; and quantile for its colours.

The median likelihood of its colours must reach this quantile of the likelihoods within the ground.
"""
LEAST, OBJECT = 0.004, 0.02
"""Minimum share of the image of a separate part of the ground, and of another object.

A single button among many is not an object on a floor.
"""
LIT = 0.13
"""Maximum share of the variance of brightness that remains after uneven light is divided out.

For walls and skies, more remains.
"""
FEWEST = 0.03
"""Minimum share of the image that must deviate from the ground. Below it, a step is searched for instead."""


def find_ground(image: object, *, known: object = None) -> Bools:
    """Find the ground in an image: the texture that most of the image shows.

    An image of less than 160 pixels across contains too few elements to detect other objects. All of its known pixels
    are then ground.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array
        A photograph, any real dtype, each side at least 64.
    known : (H, W) bool array, optional
        Mask of the known pixels. Default: all pixels.

    Returns
    -------
    (H, W) bool array
        True on the ground, and False elsewhere and at unknown pixels.

    Raises
    ------
    InvalidInput
        If the image is too small, or no pixel is known.

    Examples
    --------
    >>> from texrs import planes, samples
    >>> floor = samples.tilted_discs((192, 192)).image
    >>> bool(planes.find_ground(floor).all())
    True
    >>> floor[:60] = (150, 180, 230)
    >>> bool(planes.find_ground(floor)[:50].any())
    False

    """
    from scipy.ndimage import distance_transform_edt

    pixels = as_image(image, minimum=SMALLEST)
    size = pixels.shape[0], pixels.shape[1]
    there = np.ones(size, np.bool_) if known is None else as_mask(known, "known", size)
    if not there.any():
        raise InvalidInput("known: must mark at least one pixel, got none")
    if min(size) < TELLING:
        return there
    # A small image is enough, because the windows blur fine detail.
    colours, seen = shrink(guidance(pixels), there)
    follows = seen if is_evenly_covered(colours, seen) else find_windows(colours, seen)
    if np.count_nonzero(seen & ~follows) < FEWEST * np.count_nonzero(seen):
        # One slow change fits the whole image, but two changes with a step between them may fit better.
        side = find_step(*look(colours, seen), seen)
        if side is None:
            return there
        follows = side
    ground = settle(colours, seen, follows)
    if np.count_nonzero(seen & ~ground) < OBJECT * ground.size:
        return there
    # Give blocks with unknown pixels the value of the nearest known block.
    nearest = distance_transform_edt(~seen, return_distances=False, return_indices=True)
    ground = ground[tuple(nearest)]
    rows, columns = (np.minimum(np.arange(n) * m // n, m - 1) for n, m in zip(size, ground.shape, strict=True))
    return np.asarray(ground[np.ix_(rows, columns)] & there, np.bool_)


def is_evenly_covered(colours: NDArray[np.float64], known: Bools) -> bool:
    """Return True if the whole image follows one ground after uneven light is divided out."""
    light = Light.of(colours, known)
    if light is None:
        return False
    rows, columns = (np.asarray(p, np.intp) for p in np.indices(known.shape))
    factor = light.at(rows, columns)[..., np.newaxis]
    means = blur(colours.mean(axis=-1, keepdims=True), known, 2 * NARROWEST)
    seen, off = (np.log(m[known] + COLOUR) for m in (means, means / factor))
    if off.var() > LIT * seen.var():
        # The brightness step comes from a wall above a floor, not from uneven light.
        return False
    even = colours / factor
    return bool(np.count_nonzero(known & ~find_windows(even, known)) < PART * np.count_nonzero(known))


def shrink(colours: Floats, known: Bools) -> tuple[NDArray[np.float64], Bools]:
    """Return an image of three channels of at most `LARGEST` pixels a side, and its known pixels.

    Blocks of pixels are averaged.
    """
    step = max(1, ceil(max(known.shape) / LARGEST))
    rows, columns = (n // step * step for n in known.shape)
    three = colours if colours.shape[2] == 3 else np.repeat(colours[..., :1], 3, axis=2)
    parts = three[:rows, :columns].reshape(rows // step, step, columns // step, step, 3)
    whole = known[:rows, :columns].reshape(rows // step, step, columns // step, step).all(axis=(1, 3))
    return parts.mean(axis=(1, 3), dtype=np.float64), np.asarray(whole)


def blur(values: NDArray[np.float64], known: Bools, sigma: float) -> NDArray[np.float64]:
    """Return the Gaussian means of known pixels around each pixel, channel by channel."""
    from scipy.ndimage import gaussian_filter

    seen = known.astype(np.float64)
    share = np.maximum(gaussian_filter(seen, sigma), 1e-6)
    channels = [gaussian_filter(c * seen, sigma) / share for c in np.moveaxis(values, -1, 0)]
    return np.stack(channels, axis=-1)


def look(colours: NDArray[np.float64], known: Bools) -> tuple[NDArray[np.float64], float]:
    """Return window means of colours and of two bands of squared detail, and the windows' standard deviation."""
    sigma = max(NARROWEST, WINDOW * min(known.shape))
    details = [np.square(colours - blur(colours, known, s)).sum(axis=-1) for s in BANDS]
    return blur(np.stack([*np.moveaxis(colours, -1, 0), *details], axis=-1), known, sigma), sigma


def find_windows(colours: NDArray[np.float64], known: Bools) -> Bools:
    """Mark the pixels whose windows follow the slow change that most of the image follows."""
    facts, sigma = look(colours, known)
    facts[..., 3:] = 0.5 * np.log(facts[..., 3:] + 1e-5)
    least = np.array([COLOUR] * 3 + [CONTRAST] * len(BANDS))
    step = max(1, int(sigma / 2))
    thin = np.zeros_like(known)
    thin[step // 2 :: step, step // 2 :: step] = True
    thin &= known
    places = np.indices(known.shape).astype(np.float64)
    terms = np.stack([np.ones(known.shape), *(2 * p / max(known.shape) - 1 for p in places)], axis=-1)
    best: tuple[float, NDArray[np.float64]] | None = None
    for start in list_starts(thin):
        ask()
        coefficients, spread = fit(terms[thin], facts[thin], start[thin], least)
        off = np.sqrt(measure_off(facts - terms @ coefficients, spread))
        # Compute the gain in log likelihood over a uniform distribution. Detailed parts count more, because a ground
        # is rarely smooth.
        gain = np.log(RANGE / (2.5 * spread)).sum() - len(spread) * off[thin] ** 2 / 2
        value = float((np.maximum(gain, 0) * np.clip(facts[thin][:, 3] - PLAIN, 0.2, 2)).sum())
        if best is None or value > best[0]:
            best = value, off
    assert best is not None
    return np.asarray((best[1] < FAR) & known, np.bool_)


def list_starts(thin: Bools) -> list[Bools]:
    """Return initial guesses of the ground: the whole image, its halves, and its middle."""
    rows, columns = np.indices(thin.shape)
    height, width = thin.shape
    middle = (np.abs(rows - height / 2) < height / 4) & (np.abs(columns - width / 2) < width / 4)
    halves = [rows >= height * 0.6, rows < height * 0.4, columns < width * 0.4, columns >= width * 0.6, middle]
    return [thin, *(h & thin for h in halves if (h & thin).sum() >= 8)]


def measure_off(rest: NDArray[np.float64], spread: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the squared deviation of each window from its facts, in standard deviations. A large one dominates."""
    return np.asarray((np.abs(rest / spread) ** POWER).mean(axis=-1) ** (2 / POWER), np.float64)


def fit(
    terms: NDArray[np.float64], facts: NDArray[np.float64], start: Bools, least: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Fit a slow change to a part and all windows that follow it; return coefficients (terms, facts) and deviations."""
    weight = start.astype(np.float64)
    coefficients, spread = np.zeros((terms.shape[1], facts.shape[1])), least
    even = np.diag([0.0] + [EVEN] * (terms.shape[1] - 1))
    for _ in range(ROUNDS):
        if weight.sum() < 8:
            break
        scaled = terms * weight[:, np.newaxis]
        coefficients = np.linalg.solve(scaled.T @ terms + weight.sum() * even, scaled.T @ facts)
        rest = facts - terms @ coefficients
        own = np.abs(rest[weight > 0.1 * weight.max()])
        spread = np.clip(1.4826 * np.median(own, axis=0), least, LOOSE * least)
        off = measure_off(rest, spread)
        # Reduce the weight of outliers by Tukey's biweight.
        weight = np.square(np.maximum(0, 1 - off / FAR**2))
    return coefficients, spread


def measure_chances(cell: NDArray[np.intp], part: Bools) -> NDArray[np.float64]:
    """Return the log likelihood of the colour of each pixel within a part of the image."""
    from scipy.ndimage import gaussian_filter

    count = np.bincount(np.ravel_multi_index(tuple(cell[part].T), (BINS,) * 3), minlength=BINS**3).astype(np.float64)
    smooth = gaussian_filter(count.reshape((BINS,) * 3), 0.7, mode="nearest")
    return np.asarray(np.log(smooth / smooth.sum() + 1e-4)[tuple(np.moveaxis(cell, -1, 0))], np.float64)


def return_parts(cell: NDArray[np.intp], known: Bools, ground: Bools) -> Bools:
    """Add small parts that have the colours of the ground back to the ground, such as one large tile of a floor."""
    from scipy.ndimage import label

    own = ground & known
    if not own.any():
        return ground
    chance = measure_chances(cell, own)
    usual = float(np.quantile(chance[own], USUAL))
    pieces, count = label(~ground & known)
    result = ground.copy()
    for number in range(1, count + 1):
        piece = pieces == number
        if piece.sum() < PART * known.size and float(np.median(chance[piece])) >= usual:
            result |= piece
    return result


def settle(colours: NDArray[np.float64], known: Bools, follows: Bools) -> Bools:
    """Draw the border of the ground by the colours on both sides."""
    from scipy.ndimage import distance_transform_edt, label, median_filter

    side = min(known.shape)
    wide = DOUBT * max(NARROWEST, WINDOW * side)
    low, high = colours.min(axis=(0, 1)), colours.max(axis=(0, 1))
    scaled = (colours - low) / np.maximum(high - low, 1e-6)
    cell = np.minimum((scaled * BINS).astype(np.intp), BINS - 1)
    ground = return_parts(cell, known, follows)
    for _ in range(3):
        if not (ground & known).any() or not (~ground & known).any():
            break
        inside, outside = (
            distance_transform_edt(np.pad(m, 1, constant_values=True))[1:-1, 1:-1] for m in (ground | ~known, ~ground)
        )
        sure = [(ground & known & (inside > wide / 2)), (~ground & known & (outside > wide / 2))]
        sure = [s if s.any() else part for s, part in zip(sure, (ground & known, ~ground & known), strict=True)]
        chances = [measure_chances(cell, part) for part in sure]
        says = blur(np.clip(chances[0] - chances[1], -3, 3)[..., np.newaxis], known, max(1.0, FINE * side))[..., 0]
        near = np.where(ground, inside, outside) < wide
        ground = np.where(near, says > 0, ground) & known
        ground = median_filter(ground, 5) & known
    for value, least in ((True, LEAST), (False, OBJECT)):
        # Merge parts that are too small with their surroundings.
        pieces, _ = label(ground == value)
        small = np.bincount(pieces.ravel()) < least * ground.size
        small[0] = False
        ground = np.where(small[pieces], not value, ground)
    return np.asarray(ground & known, np.bool_)

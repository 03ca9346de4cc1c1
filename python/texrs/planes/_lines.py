"""Estimate the horizon of a plane from straight lines of its image that run in one or two directions.

Parallel lines of a plane meet in one point of its horizon. If most straight borders in an image run in one or two
directions, they determine the horizon better than any patch of texture.

Borders are detected as by Burns et al. Adjacent pixels whose slopes have about the same direction form a border, and
its principal axis is a line. A mixture model then describes the lines: a line runs in one of the two directions, with
an error, or in a random direction.

J. B. Burns, A. R. Hanson and E. M. Riseman, "Extracting straight lines", IEEE Transactions on Pattern Analysis and
Machine Intelligence 8, 1986.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools, Floats

__all__ = ["Lean", "Lines", "find_lines", "lean"]

Reals = NDArray[np.float64]

SMOOTH = 1.0
"""Standard deviation of the Gaussian before slopes are computed, in pixels."""
STEEP = 0.5
"""Minimum slope of a border, as a share of the root mean square of the slopes around it."""
AROUND = 0.06
"""Standard deviation of the windows for the mean of squared slopes, as a share of the longer side."""
SHORTEST = 12.0
"""Minimum length of a line, in pixels."""
THIN = 0.6
"""Maximum standard deviation of pixels across a straight line, in pixels."""
TANGENT = 0.4142135623730951
"""Tangent of 22.5 degrees, an eighth of a half turn."""
ASKEW = 0.12
"""Maximum sine of the angle between a line and the perpendicular of its slopes."""
MOST = 1500
"""Maximum number of lines that are used. If there are more, the longest are used."""
COUNTED, TOLD = 60.0, 300.0
"""Length above which the weight of a line is constant; and length that counts as one independent measurement.

Both lengths are in pixels.

The second length is larger because adjacent lines are not independent.
"""
FINEST, BROADEST = np.radians(0.7), np.radians(12.0)
"""Minimum and maximum standard deviation of the angle between a line and its direction."""
STRAIGHT, CURVED = np.radians(3.0), np.radians(6.0)
"""Maximum standard deviation of this angle for directions that count fully, and minimum for those that do not count.

A larger deviation means that borders are curved.
"""
LOOSE = 0.05
"""Minimum share of lines in random directions."""
BINS, BETWEEN = 90, 12
"""Number of bins of half a turn for finding the two directions, and minimum number of bins between them."""
ROUNDS = 30
"""Maximum number of steps of expectation and maximisation."""


@dataclass(frozen=True, slots=True)
class Lines:
    """Straight lines of an image: middles (n, 2) in pixels from its middle, directions (n, 2), and lengths (n,)."""

    middles: Reals
    ways: Reals
    lengths: Reals


@dataclass(frozen=True, slots=True)
class Lean:
    """Estimate of a horizon from lines.

    Attributes
    ----------
    rise : (2,) array
        Rise of the relative width over the longer side, from the lines and the prior estimate.
    told : (2, 2) array
        Inverse of the covariance of the rise, from the lines only.
    spreads, shares : (2,) arrays
        Standard deviation of the angle between lines and each of two directions, in radians; and the share of lines in
        it.

    """

    rise: Reals
    told: Reals
    spreads: Reals
    shares: Reals


def find_lines(grey: Floats, known: Bools) -> Lines:
    """Return the straight borders in the known pixels of an image (H, W)."""
    from scipy.ndimage import binary_erosion, gaussian_filter

    smooth = gaussian_filter(grey.astype(np.float64), SMOOTH, mode="nearest")
    down, right = np.gradient(smooth)
    steep = np.hypot(down, right)
    inner = known.copy()
    inner[[0, 1, 2, -3, -2, -1]] = inner[:, [0, 1, 2, -3, -2, -1]] = False
    if not known.all():
        inner &= binary_erosion(known, iterations=3)
    # Keep the pixels that are much steeper than their surroundings.
    border = inner & (steep > STEEP * np.sqrt(_look_around(steep**2, inner))) & (steep > 1e-4)
    crests, away = _mark_crests(steep, down, right)
    border &= crests
    # Number the border pixels, and list the pairs that are adjacent in any of eight directions.
    rows, columns = np.nonzero(border)
    number = np.full(grey.shape, -1, np.intp)
    number[rows, columns] = np.arange(len(rows))
    pairs = [
        (number[1:], number[:-1]),
        (number[:, 1:], number[:, :-1]),
        (number[1:, 1:], number[:-1, :-1]),
        (number[1:, :-1], number[:-1, 1:]),
    ]
    beside = np.concatenate([np.stack([a, b], axis=-1)[(a >= 0) & (b >= 0)] for a, b in pairs])
    slopes = np.stack([down[rows, columns], right[rows, columns]], axis=-1)
    # Group slopes by eighths of a turn, and again by eighths that are shifted by half an eighth. A line at the limit
    # of two eighths is in the middle of an eighth of the other grouping.
    parts = [_join(_tell_eighths(slopes, turn), beside) for turn in (0.0, np.pi / 8)]
    sizes = [np.bincount(part) if len(part) else np.zeros(1, np.intp) for part in parts]
    first = sizes[0][parts[0]] >= sizes[1][parts[1]]
    places = np.stack([rows, columns], axis=-1) + away[rows, columns]
    found = []
    for part, size, won in zip(parts, sizes, (first, ~first), strict=True):
        # Choose a part if, for most of its pixels, the part of the other grouping is not larger.
        votes = np.bincount(part, won, minlength=len(size))
        chosen = (votes >= 0.5 * size) & (size >= SHORTEST)
        found.append(_measure(part, chosen, places, steep[rows, columns], slopes))
    middles, ways, lengths = (np.concatenate(each) for each in zip(*found, strict=True))
    order = np.argsort(-lengths, kind="stable")[:MOST]
    centre = (np.array(grey.shape) - 1) / 2
    return Lines(middles[order] - centre, ways[order], lengths[order])


def _look_around(values: Reals, known: Bools) -> Reals:
    """Return the mean of known values in the window around each pixel, computed by cells."""
    from scipy.ndimage import gaussian_filter

    sigma = AROUND * max(values.shape)
    cell = max(1, int(sigma / 4))
    starts = [np.arange(0, n, cell) for n in values.shape]
    total, count = (
        gaussian_filter(np.add.reduceat(np.add.reduceat(v, starts[0], axis=0), starts[1], axis=1), sigma / cell)
        for v in (np.where(known, values, 0.0), known.astype(np.float64))
    )
    means = total / np.maximum(count, 1e-6)
    return np.asarray(means.repeat(cell, axis=0).repeat(cell, axis=1)[: values.shape[0], : values.shape[1]])


def _tell_eighths(slopes: Reals, turn: float) -> NDArray[np.intp]:
    """Return the index of the eighth of a turn that contains each slope, turned by an angle."""
    y = slopes[:, 0] * np.cos(turn) - slopes[:, 1] * np.sin(turn)
    x = slopes[:, 0] * np.sin(turn) + slopes[:, 1] * np.cos(turn)
    return np.asarray((y > 0) * 4 + (x > 0) * 2 + (np.abs(y) > np.abs(x)), np.intp)


def _join(kinds: NDArray[np.intp], beside: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the index of the connected part of each pixel. Adjacent pixels of the same kind are connected."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    same = beside[kinds[beside[:, 0]] == kinds[beside[:, 1]]]
    graph = coo_matrix((np.ones(len(same), np.bool_), (same[:, 0], same[:, 1])), shape=(len(kinds), len(kinds)))
    return np.asarray(connected_components(graph, directed=False)[1], np.intp)


def _mark_crests(steep: Reals, down: Reals, right: Reals) -> tuple[Bools, Reals]:
    """Mark pixels of maximum slope across a border; return the mask and the offsets to the exact maxima."""
    padded = np.pad(steep, 1)
    rows, columns = steep.shape

    def shift(y: int, x: int) -> Reals:
        return padded[1 + y : 1 + y + rows, 1 + x : 1 + x + columns]

    flat, upright = np.abs(down) > TANGENT * np.abs(right), np.abs(right) > TANGENT * np.abs(down)
    crests, away = np.zeros(steep.shape, np.bool_), np.zeros((*steep.shape, 2))
    same = down * right > 0
    for way, where in (
        ((0, 1), ~flat),
        ((1, 0), ~upright),
        ((1, 1), flat & upright & same),
        ((1, -1), flat & upright & ~same),
    ):
        after, before = shift(*way), shift(-way[0], -way[1])
        here = where & (steep >= after) & (steep > before)
        crests |= here
        bend = 2 * steep - after - before
        away[here] = (0.5 * (after - before)[here] / np.maximum(bend[here], 1e-12))[:, np.newaxis] * way
    return crests, away


def _measure(
    part: NDArray[np.intp], chosen: Bools, places: Reals, steep: Reals, slopes: Reals
) -> tuple[Reals, Reals, Reals]:
    """Return middle, direction and length of each chosen part that is straight."""
    some = chosen[part]
    which, places, weight, slopes = part[some], places[some], steep[some], slopes[some]

    def add_up(values: Reals) -> Reals:
        return np.asarray(np.bincount(which, values, minlength=len(chosen)), np.float64)

    total = np.maximum(add_up(weight), 1e-12)
    y, x = add_up(weight * places[:, 0]) / total, add_up(weight * places[:, 1]) / total
    off = places[:, 0] - y[which], places[:, 1] - x[which]
    yy, yx, xx = (add_up(weight * a * b) / total for a, b in ((off[0], off[0]), (off[0], off[1]), (off[1], off[1])))
    middle, half = (yy + xx) / 2, np.hypot((yy - xx) / 2, yx)
    length, across = np.sqrt(12 * (middle + half)), np.sqrt(np.maximum(middle - half, 0))
    angle = 0.5 * np.arctan2(2 * yx, yy - xx)
    ways = np.stack([np.cos(angle), np.sin(angle)], -1)
    # Skip parts whose slopes are not perpendicular to them, because they are rows of other borders.
    mean = np.stack([add_up(slopes[:, 0]), add_up(slopes[:, 1])], -1)
    askew = np.abs((ways * mean).sum(axis=-1)) / np.maximum(np.hypot(*mean.T), 1e-12)
    good = chosen & (length >= SHORTEST) & (across <= THIN + 0.01 * length) & (askew <= ASKEW)
    return np.stack([y, x], -1)[good], ways[good], length[good]


def lean(lines: Lines, side: int, before: Reals, sure: float, focal: float) -> Lean:
    """Estimate the horizon from lines and a prior estimate.

    Parameters
    ----------
    lines : Lines
        Straight lines of the image.
    side : int
        Longer side of the image, in pixels.
    before : (2,) array
        Prior estimate of the rise of the relative width over the longer side.
    sure : float
        Standard deviation of the prior estimate.
    focal : float
        Focal length over the longer side. It determines how random directions on the plane are distributed in the
        image.
    """
    mixture = _Mixture(lines, side, before, focal)
    known = np.eye(2) / sure**2
    for _ in range(ROUNDS):
        told, pull = mixture.step()
        if not mixture.move(told, pull, known, before):
            break
    told, _ = mixture.step()
    return Lean(mixture.rise, mixture.free(told), mixture.spreads, mixture.shares[:2])


class _Mixture:
    """Mixture model of lines: two directions on a plane, and random directions on it."""

    def __init__(self, lines: Lines, side: int, rise: Reals, focal: float) -> None:
        self.places, self.ways, self.focal = lines.middles / side, lines.ways, focal
        self.weights = np.minimum(lines.lengths, COUNTED) / TOLD
        self.errors = (1 / lines.lengths) ** 2
        self.rise = rise
        self.spreads, self.shares = np.radians([4.0, 4.0]), np.array([0.25, 0.25, 0.5])
        self.angles = self._start()

    def _flatten(self, ways: Reals) -> Reals:
        """Return the directions on the plane that appear as given directions in the image."""
        width = 1 + self.places[:, 0] * self.rise[0] + self.places[:, 1] * self.rise[1]
        along = ways[:, 0] * self.rise[0] + ways[:, 1] * self.rise[1]
        flat = ways * width[:, np.newaxis] - self.places * along[:, np.newaxis]
        steep = max(float(np.hypot(*self.rise)), 1e-12)
        down = self.rise / steep
        stretch = np.sqrt(1 + (steep * self.focal) ** 2) - 1
        return np.asarray(flat + stretch * (flat[:, 0] * down[0] + flat[:, 1] * down[1])[:, np.newaxis] * down)

    def _start(self) -> Reals:
        """Return the two directions of most lines, as angles on the plane before the stretch along its slope."""
        from scipy.ndimage import gaussian_filter1d

        flat = self._flatten(self.ways)
        # Shift the bins, so that usual directions, such as rows, are not at the limit of two bins.
        turns = np.arctan2(flat[:, 1], flat[:, 0]) / np.pi + 0.3 / BINS
        bins = np.floor(turns * BINS).astype(np.intp) % BINS
        count = gaussian_filter1d(np.bincount(bins, self.weights, minlength=BINS), 1.5, mode="wrap")
        first = int(count.argmax())
        away = np.abs((np.arange(BINS) - first + BINS // 2) % BINS - BINS // 2)
        second = int(np.where(away >= BETWEEN, count, -1.0).argmax())
        angles = (np.array([first, second]) + 0.2) * np.pi / BINS
        ways = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        steep = max(float(np.hypot(*self.rise)), 1e-12)
        down = self.rise / steep
        squeeze = 1 / np.sqrt(1 + (steep * self.focal) ** 2) - 1
        ways = ways + squeeze * (ways[:, 0] * down[0] + ways[:, 1] * down[1])[:, np.newaxis] * down
        return np.asarray(np.arctan2(ways[:, 1], ways[:, 0]))

    def step(self) -> tuple[Reals, Reals]:
        """Assign lines to directions; return the normal matrix and right-hand side for the change of rise and angles."""
        # Compute the density of random directions on the plane, as they appear in the image at the direction of each
        # line.
        flat = self._flatten(self.ways)
        aside = self._flatten(np.stack([-self.ways[:, 1], self.ways[:, 0]], axis=-1))
        turned = np.abs(flat[:, 0] * aside[:, 1] - flat[:, 1] * aside[:, 0])
        loose = self.shares[2] / np.pi * turned / np.maximum((flat**2).sum(axis=-1), 1e-12)
        off, slopes = zip(*(self._differ(k) for k in range(2)), strict=True)
        variances = [spread**2 + self.errors for spread in self.spreads]
        chances = [
            share * np.exp(-0.5 * o * o / v) / np.sqrt(2 * np.pi * v)
            for share, o, v in zip(self.shares, off, variances, strict=False)
        ]
        total = np.maximum(chances[0] + chances[1] + loose, 1e-30)
        matrix, pull = np.zeros((4, 4)), np.zeros(4)
        whole = max(float(self.weights.sum()), 1e-12)
        spreads, shares = self.spreads.copy(), self.shares.copy()
        for k in range(2):
            part = self.weights * chances[k] / total
            heavy = part / variances[k] * np.clip((CURVED - self.spreads[k]) / (CURVED - STRAIGHT), 1e-3, 1)
            matrix += np.einsum("n,ni,nj->ij", heavy, slopes[k], slopes[k])
            pull -= np.einsum("n,n,ni->i", heavy, off[k], slopes[k])
            shares[k] = float(part.sum()) / whole
            spread = float((part * (off[k] ** 2 - self.errors)).sum()) / max(float(part.sum()), 1e-12)
            spreads[k] = np.sqrt(np.clip(spread, FINEST**2, BROADEST**2))
        shares[2] = max(LOOSE, 1 - shares[0] - shares[1])
        self.spreads, self.shares = spreads, shares
        return matrix, pull

    def _differ(self, which: int) -> tuple[Reals, Reals]:
        """Return the angle of each line to a direction, and its derivatives by rise and angles, (n, 4)."""
        turn = self.angles[which]
        way, aside = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
        towards = way + self.places * float((self.rise * way).sum())
        square = np.maximum((towards**2).sum(axis=-1), 1e-12)

        def turn_by(moved: Reals) -> Reals:
            return np.asarray((towards[:, 1] * moved[:, 0] - towards[:, 0] * moved[:, 1]) / square, np.float64)

        off = np.arctan2(
            towards[:, 0] * self.ways[:, 1] - towards[:, 1] * self.ways[:, 0], (towards * self.ways).sum(axis=-1)
        )
        slopes = np.zeros((len(off), 4))
        slopes[:, 0], slopes[:, 1] = turn_by(self.places * way[0]), turn_by(self.places * way[1])
        slopes[:, 2 + which] = turn_by(aside + self.places * float((self.rise * aside).sum()))
        return (off + np.pi / 2) % np.pi - np.pi / 2, slopes

    def move(self, matrix: Reals, pull: Reals, known: Reals, before: Reals) -> bool:
        """Update rise and angles; return True if the change was above 1e-5."""
        whole, right = matrix + 1e-6 * np.eye(4), pull.copy()
        whole[:2, :2] += known
        right[:2] += np.einsum("ij,j->i", known, before - self.rise)
        change = np.linalg.solve(whole, right)
        self.rise, self.angles = self.rise + change[:2], self.angles + change[2:]
        return float(np.abs(change).max()) > 1e-5

    def free(self, matrix: Reals) -> Reals:
        """Return the inverse covariance of the rise if the angles are unknown."""
        least = matrix[2:, 2:] + 1e-6 * np.eye(2)
        return np.asarray(matrix[:2, :2] - matrix[:2, 2:] @ np.linalg.solve(least, matrix[2:, :2]))

"""Find the period of an image that repeats along one direction only, such as stripes, a fence or corrugated iron.

Such an image has no lattice, because nothing repeats along the stripes. Its Fourier transform has a peak whose phase is
the same in all parts of the image. The phases of the parts of a stochastic texture differ.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from texrs._progress import ask
from texrs._show import brief
from texrs._typing import Floats
from texrs.exemplar.closing import FRACTIONS, check_size, rate, say_misfit
from texrs.exemplar.regularity import (
    PARTS,
    REACH,
    SHORTEST,
    Lattice,
    as_reach,
    correlate,
    draw_views,
    level_light,
    list_places,
)
from texrs.exemplar.shapes import widen

__all__ = ["Period", "confirm_lattice", "find_period"]

FEWEST = 2.5
"""Minimum number of periods in an image."""
PEAKS = 4
"""Number of the highest peaks of the spectrum that are considered as multiples of the frequency."""
DIVISORS, MULTIPLES = 3, 5
"""Maximum divisor of the frequency of a peak, and number of multiples of a frequency whose energies are added."""
BETTER = 0.85
"""Minimum ratio of two energies for choosing the shorter period."""
BLOCKS = 4, 8
"""Minimum and maximum number of parts along each side of an image whose phases are compared.

There is one part for each period within these limits.
"""
ALIKE, ENERGY = 0.6, 0.1
"""Minimum agreement of the phases, 0 to 1, and minimum share of the variance that repeats.

Chosen on 280 generated stochastic images. None has a period. 2 of 560 others have one. Long
grain has one in 4 of 160 images. Photographs of walls and studs agree by 0.6 to 0.97.
"""
GAIN, CORE = 0.06, 6
"""Minimum gain of a lattice over a single period, and minimum distance of compared shifts along the stripes, in pixels.

The gain is the difference of the correlations at lattice points and at all shifts along the same stripes. It is
at most 0.04 in generated stripes, fences and courses of 160 pixels and more. It is at least 0.1 in photographs of studs,
weaves and walls, and 0.07 in walls with uneven bonds.
"""
CLEARER = 1.5
"""Ratio of the energies of edges and of colours above which the period of the edges is used."""
FINER, TIMES = 4, 3
"""Number of steps on each side for refining a frequency, and number of refinements."""

Matrix = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Period:
    """The shortest translation across the stripes of an image that repeats along one direction only.

    Attributes
    ----------
    step : (float, float)
        Translation perpendicular to the stripes, (row, column) in pixels.
    agreement : float
        Agreement of the phases of all parts of the image, 0 to 1.

    Examples
    --------
    >>> from texrs.exemplar.period import Period
    >>> print(Period((0.0, 12.5), 0.9))
    a single period of (0.0, 12.5) (agreement 0.90)

    """

    step: tuple[float, float]
    agreement: float
    """Agreement of the phases of all parts of the image, 0 to 1."""

    __repr__ = brief

    def __str__(self) -> str:
        return f"a single period of ({self.step[0]:.1f}, {self.step[1]:.1f}) (agreement {self.agreement:.2f})"

    @property
    def vectors(self) -> Matrix:
        """The translation and a zero vector as columns, (2, 2), as in `Lattice.vectors`."""
        return np.array([[self.step[0], 0.0], [self.step[1], 0.0]])

    @property
    def frequency(self) -> Matrix:
        """Number of periods per pixel along (rows, columns)."""
        step = np.array(self.step)
        return np.asarray(step / (step[0] ** 2 + step[1] ** 2))

    def along(self) -> Matrix:
        """Return the distances between stripes along (rows, columns), in pixels. They can be infinite."""
        frequency = np.abs(self.frequency)
        return np.asarray(np.where(frequency > 0, 1 / np.maximum(frequency, 1e-9), np.inf))

    def scale(self, factor: float) -> Period:
        """Return the period of the image in another size, whose sides are multiplied by `factor`."""
        return Period((factor * self.step[0], factor * self.step[1]), self.agreement)

    def close(self, size: tuple[int, int], wrap: tuple[bool, bool]) -> Matrix | None:
        """Return the smallest rotation and stretch after which whole periods fit into a size (`Lattice.close`)."""
        lengths, around = check_size(size, wrap)
        if not any(around):
            return np.eye(2)
        changes = [change for _, change in self._list_changes(lengths, around)]
        excess, total = rate(np.array(changes))
        total[~(excess <= 1)] = np.inf
        best = int(np.argmin(total))
        return np.rint(changes[best] * FRACTIONS) / FRACTIONS + 0.0 if np.isfinite(total[best]) else None

    def find_size(self, size: tuple[int, int], wrap: tuple[bool, bool]) -> tuple[int, int] | None:
        """Return the size nearest to a given one into which whole periods fit (`Lattice.find_size`)."""
        lengths, around = check_size(size, wrap)
        found: list[tuple[float, tuple[int, int]]] = []
        for counts, _ in self._list_changes(lengths, around):
            exact = [
                round(abs(n / k)) if wraps and n and k else side
                for n, k, side, wraps in zip(counts, self.frequency.tolist(), lengths, around, strict=True)
            ]
            for rows, columns in ((exact[0], lengths[1]), (lengths[0], exact[1]), (exact[0], exact[1])):
                if self.close((rows, columns), around) is not None:
                    ratios = (rows / lengths[0], columns / lengths[1])
                    found.append((max(ratios[0], 1 / ratios[0]) * max(ratios[1], 1 / ratios[1]), (rows, columns)))
        return min(found)[1] if found else None

    def explain(self, size: tuple[int, int], wrap: tuple[bool, bool]) -> str:
        """Return a sentence for reports: why a size does not fit, and which size near it does."""
        return say_misfit(size, self.find_size(size, wrap))

    def _list_changes(
        self, size: tuple[int, int], wrap: tuple[bool, bool]
    ) -> Iterator[tuple[tuple[float, float], Matrix]]:
        """Yield numbers of periods along both sides, with the rotation and stretch that fit them."""
        length = np.sqrt(self.step[0] ** 2 + self.step[1] ** 2)
        unit = np.array(self.step) / length
        ideal = unit / length * np.array(size)
        near = [np.rint(n) + np.arange(-1, 2) if wraps else np.array([n]) for n, wraps in zip(ideal, wrap, strict=True)]
        for down in near[0].tolist():
            for across in near[1].tolist():
                if not (down or across):
                    continue
                frequency = np.array([down / size[0], across / size[1]])
                other = np.sqrt(frequency[0] ** 2 + frequency[1] ** 2)
                turned = frequency / other
                cosine = unit[0] * turned[0] + unit[1] * turned[1]
                sine = unit[0] * turned[1] - unit[1] * turned[0]
                stretch = np.eye(2) + (1 / (other * length) - 1) * np.multiply.outer(unit, unit)
                rotated = [cosine * stretch[0] - sine * stretch[1], sine * stretch[0] + cosine * stretch[1]]
                yield (down, across), np.array(rotated)


def find_period(guide: Floats) -> Period | None:
    """Find the period of an image that repeats along one direction only, in its lightness or edges."""
    levels = [level_light(picture).astype(np.float64) for picture in draw_views(guide)]
    if not levels:
        return None
    light, edges = (level - level.mean() for level in levels)
    ask()
    first, least = _find_frequency(light)
    ask()
    second, most = _find_frequency(edges)
    if second is None or most <= CLEARER * least:
        return first
    # Both edges of a stripe look alike, so its edges can repeat twice as often as its colours.
    return first if _measure(light, second.frequency / 2, 1)[1] >= ALIKE else second


def confirm_lattice(guide: Floats, lattice: Lattice | None) -> Lattice | None:
    """Return the lattice of an image, or None if the image has a single period and does not repeat along its stripes."""
    period = None if lattice is None else find_period(guide)
    if lattice is None or period is None:
        return lattice
    for picture in draw_views(guide):
        level = level_light(picture)
        correlation = widen(correlate(level, as_reach(level.shape, REACH), whole=True), 2)
        if _measure_gain(correlation, lattice, period) >= GAIN:
            return lattice
    return None


def _measure_gain(correlation: Floats, lattice: Lattice, period: Period) -> float:
    """Return how much a correlation is higher at lattice points than at other shifts along the same stripes."""
    reach = np.array(correlation.shape) // 2
    rows, columns = (np.arange(-r, r + 1) for r in reach)
    length = np.sqrt(period.step[0] ** 2 + period.step[1] ** 2)
    down, right = period.step[0] / length, period.step[1] / length
    across = np.rint(np.add.outer(down * rows, right * columns)).astype(np.intp) + int(reach.sum())
    kept = np.abs(np.add.outer(-right * rows, down * columns)) > CORE
    counts = np.bincount(across[kept], minlength=across.max() + 1)
    usual = np.bincount(across[kept], correlation[kept], minlength=len(counts)) / np.maximum(counts, 1)
    places = tuple((list_places(lattice.vectors, reach) + reach).T)
    return float((correlation[places] - usual[across[places]]).mean()) if len(places[0]) else np.inf


def _find_frequency(level: Matrix) -> tuple[Period | None, float]:
    """Return the period of a level image, and the share of its variance that repeats."""
    variance = max(float((level**2).mean()), 1e-12)
    best, most, agreement = None, 0.0, 0.0
    for peak in _list_peaks(level):
        frequency = _refine(level, peak)
        # The refined frequency can be too low.
        if _count_periods(frequency, level.shape) < FEWEST or _measure(level, frequency, 1)[1] < ALIKE:
            continue
        # A peak can be a multiple of the frequency. Multiples of the period repeat as well, so choose the shortest.
        several = [
            frequency / k for k in range(1, DIVISORS + 1) if _count_periods(frequency / k, level.shape) >= FEWEST
        ]
        measured = [_measure(level, each, MULTIPLES) for each in several]
        least = BETTER * max(energy for energy, _ in measured)
        first = next(k for k, (energy, _) in enumerate(measured) if energy >= least)
        energy, alike = measured[first][0] / variance, measured[first][1]
        if energy >= ENERGY and alike >= ALIKE and energy > most:
            best, most, agreement = several[first], energy, alike
    if best is None:
        return None, 0.0
    frequency = best
    step = np.rint(frequency / (frequency**2).sum() * PARTS) / PARTS + 0.0
    return Period((float(step[0]), float(step[1])), round(agreement, 4)), most


def _count_periods(frequency: Matrix, shape: tuple[int, ...]) -> float:
    """Return the number of periods between opposite corners of an image."""
    return float((np.abs(frequency) * shape).sum())


def _list_peaks(level: Matrix) -> list[Matrix]:
    """Return the frequencies of the highest peaks of the spectrum, in periods per pixel."""
    from scipy.fft import rfft2
    from scipy.ndimage import maximum_filter

    shape = level.shape
    down, across = (np.hanning(n + 2)[1:-1] for n in shape)
    spectrum = rfft2(level * down[:, np.newaxis] * across)
    # Frequencies from below zero to above zero, with one more on each side, which are only neighbours.
    reach = [n // SHORTEST + 1 for n in shape]
    rows, columns = (np.arange(-r, r + 1) / n for r, n in zip(reach, shape, strict=True))
    spectrum = spectrum[np.arange(-reach[0], reach[0] + 1), : reach[1] + 1]
    power = spectrum.real**2 + spectrum.imag**2
    power = np.concatenate([power[::-1, :0:-1], power], axis=1)
    seen = np.add.outer(np.abs(rows) * shape[0], np.abs(columns) * shape[1])
    inside = (np.add.outer(rows**2, columns**2) < SHORTEST**-2) & (seen >= FEWEST)
    half = (rows[:, np.newaxis] > 0) | ((rows[:, np.newaxis] == 0) & (columns > 0))
    peaks = np.argwhere((maximum_filter(power, 3) == power) & inside & half)
    order = np.argsort(-power[tuple(peaks.T)], kind="stable")[:PEAKS]
    return [np.array([rows[row], columns[column]]) for row, column in peaks[order]]


def _refine(level: Matrix, frequency: Matrix) -> Matrix:
    """Return the frequency near a peak with the largest Fourier coefficient of an image."""
    steps = np.arange(-FINER, FINER + 1) / FINER
    for turn in range(TIMES):
        rows, columns = (f + steps * FINER**-turn / n for f, n in zip(frequency, level.shape, strict=True))
        power = np.abs(_transform(level, _make_waves(len(level), rows)) @ _make_waves(level.shape[1], columns).T)
        row, column = np.unravel_index(int(np.rint(power / power.max() * FRACTIONS).argmax()), power.shape)
        frequency = np.array([rows[row], columns[column]])
    return frequency


def _make_waves(count: int, frequencies: Matrix) -> NDArray[np.complex128]:
    """Return waves of some frequencies, (frequencies, count)."""
    phases = 2 * np.pi * np.multiply.outer(frequencies, np.arange(count) - (count - 1) / 2)
    return np.asarray(np.cos(phases) - 1j * np.sin(phases))


def _transform(level: Matrix, waves: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Return the Fourier transform of each column of an image at the frequencies of waves, (frequencies, columns)."""
    return np.asarray(waves.real @ level + 1j * (waves.imag @ level))


def _measure(level: Matrix, frequency: Matrix, multiples: int) -> tuple[float, float]:
    """Return the energy at multiples of a frequency, and the agreement of the phases of all parts, 0 to 1."""
    periods = (np.abs(frequency) * level.shape).astype(int)
    blocks = np.clip(periods, *BLOCKS)
    rows, columns = (np.linspace(0, n, count + 1).astype(int) for n, count in zip(level.shape, blocks, strict=True))
    numbers = [k for k in range(1, multiples + 1) if k == 1 or 4 * k * k * float((frequency**2).sum()) < 1]
    down, across = (_make_waves(n, f * np.array(numbers)) for n, f in zip(level.shape, frequency, strict=True))
    bands = [_transform(level[a:b], down[:, a:b]) * across for a, b in pairwise(rows.tolist())]
    parts = np.add.reduceat(np.stack(bands), columns[:-1], axis=-1) * (blocks.prod() / level.size)
    mean = parts.mean(axis=(0, 2))
    square = mean.real**2 + mean.imag**2
    every = (parts.real**2 + parts.imag**2).mean(axis=(0, 2))
    return 2 * float(square.sum()), float(square.sum() / max(float(every.sum()), 1e-300))

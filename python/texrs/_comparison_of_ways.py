"""Compare textures of one exemplar that were synthesised in different ways, by what the eye dislikes.

Six figures are measured, each 0 for a crop of the exemplar. None of them knows of a segmentation:

- ``irregular``: peaks of the exemplar's autocorrelation that are missing. It shows torn weaves, ornaments and courses.
- ``broken``, ``broken_coarse``: lines that break off at seams, at two scales: outlines, and joints some pixels wide.
- ``foreign``: cells of 8 pixels that are unlike all cells of the exemplar. The limit is the 95th percentile of the
  distances between its own cells, measured in oriented energies. It shows fused, foggy and bent elements.
- ``stepped``: seams with a step of tone, compared with the roughness on both sides. The limit is the 95th percentile of
  all neighbours in the exemplar. It shows cuts through plain faces.
- ``blotched``: the same for tones averaged over about 20 pixels. It shows patches from places with other light.

Exemplars differ more in these figures than ways do, so only ways of one exemplar are compared. Each figure is divided by
the sum of its mean over the ways and a floor. Below the floor, what the figure measures is hardly visible. The score is
the mean of the square roots of these quotients. Ways with large unchanged patches are favoured (`FAVOURED`).
Repetition is not a figure, because it does not agree with the eye.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, as_rgb, guidance
from texrs._progress import ask
from texrs._typing import Array, Bools, Floats
from texrs.exemplar import Exemplar
from texrs.exemplar.regularity import correlate
from texrs.metrics import Seam, find_breaks, find_seam, list_neighbours, measure_salience, measure_use
from texrs.source_map import SourceMap

__all__ = ["EQUAL", "Faults", "Judge", "choose", "compare", "try_ways"]

CELL, ORIENTATIONS = 8, 6
"""Side of the cells whose energies are compared, in pixels, and number of orientations of the filters."""
REACH, FAR, PEAKS, PEAK = 0.7, 96, 12, 0.15
"""Largest shift of the autocorrelation, as a share of the side and in pixels; number and least height of its peaks."""
LINE, USUAL = 85, 95
"""Percentile of gradients above which a pixel is on a line, and percentile of the exemplar's values as a limit of faults.
"""
FAINT = 0.1
"""Deviation of a colour difference, relative to that of the lightness, below which it is not compared."""
MOST = 512
"""Largest number of cells of the exemplar that other cells are compared with."""
SOFT, APART = 6.0, 8
"""Standard deviation for averaging tones, and their distance from a seam when they are compared, in pixels."""
PAIRS = 20_000
"""Number of pairs of neighbours for estimating the shares of the exemplar, to about 1 %."""
FAVOURED = {"still": 0.8, "lattice": 0.8, "courses": 0.63, "stitch": 0.8}
"""Factors of the scores of ways with unchanged patches, which tear least.

Readers graded all ways of 64 pictures, from 0 to 2. The factor 0.8 and `EQUAL` were chosen on 32 of them. On the other 32
the mean grade of the way taken is 1.17, of at most 1.33. It is the best way or as good for 72 %. Without the factor of
"stitch" and with `EQUAL` 0.02, these are 1.14 and 62 %. Courses are used unless another way is much better. Four
generated walls in courses need a factor of at most 0.67. A wall that is not in courses needs at least 0.60.
"""
EQUAL = 0.05
"""Difference of scores below which two ways are equally good."""
FLOORS = {
    "irregular": 0.05,
    "broken": 0.003,
    "broken_coarse": 0.002,
    "foreign": 0.03,
    "stepped": 0.05,
    "blotched": 0.05,
}
"""Values of the figures below which a fault is hardly visible. Chosen by eye on half of 51 pictures."""


Name = TypeVar("Name", bound=str)
"""Name of a way."""


@dataclass(frozen=True, slots=True)
class Faults:
    """Faults of a texture (see the module). 0 is the best value of each."""

    irregular: float
    broken: float
    broken_coarse: float
    foreign: float
    stepped: float
    blotched: float

    def report(self) -> dict[str, float]:
        """Return the figures, rounded to four places."""
        return {name: round(value, 4) for name, value in asdict(self).items()}


def compare(faults: Mapping[Name, Faults]) -> dict[Name, float]:
    """Return the score of each way of one exemplar. Lower is better. Scores of two exemplars cannot be compared."""
    table = {name: np.array([asdict(each)[key] for key in FLOORS]) for name, each in faults.items()}
    usual = np.mean(list(table.values()), axis=0) + np.array(list(FLOORS.values()))
    return {name: round(float(np.sqrt(row / usual).mean()), 4) for name, row in table.items()}


def try_ways(
    exemplar: Exemplar, depth: Floats, ways: Mapping[Name, Callable[[], tuple[SourceMap, Array] | None]]
) -> dict[Name, dict[str, float]]:
    """Return the score, the faults and the use of the exemplar of a texture in each way. All textures are periodic.

    Parameters
    ----------
    exemplar : Exemplar
        The exemplar.
    depth : (H, W) float32
        Depth of its pixels inside elements, which repeat more visibly than the background.
    ways : mapping of str to callable
        Functions that lay a texture and return its source map and its image. Ways that return None are left out.

    """
    judge = exemplar.cached("judge of ways", lambda: Judge(exemplar))
    salience = measure_salience(exemplar.guidance, depth)
    faults: dict[Name, Faults] = {}
    use: dict[Name, dict[str, float]] = {}
    for name, lay in ways.items():
        laid = lay()
        if laid is None:
            continue
        faults[name] = judge.measure(*laid, wrap=True)
        repetition, coverage = measure_use(salience, exemplar.shape, laid[0])
        use[name] = {"repetition": round(repetition, 4), "coverage": round(coverage, 4)}
    scores = compare(faults)
    scores = {name: round(FAVOURED.get(name, 1.0) * score, 4) for name, score in scores.items()}
    return {name: {"score": scores[name], **faults[name].report(), **use[name]} for name in faults}


def choose(tried: Mapping[Name, Mapping[str, float]], mirrored: Collection[Name] = ()) -> Name:
    """Return the way with the least score.

    If several ways are equally good, return one without mirrored copies, and of these the one that repeats least.
    Mirrored copies can invert the light.
    """
    least = min(each["score"] for each in tried.values())
    equal = [name for name, each in tried.items() if each["score"] <= least + EQUAL]
    return min(equal, key=lambda name: (name in mirrored, tried[name]["repetition"]))


class Judge:
    """Usual values of an exemplar, measured once, to which any number of its textures are compared.

    Parameters
    ----------
    exemplar : Exemplar
        The exemplar, an image.

    """

    def __init__(self, exemplar: Exemplar) -> None:
        planes = split_colours(exemplar.guidance)
        spread = planes.std(axis=(1, 2))
        self.kept = [0, *(k for k in range(1, len(planes)) if spread[k] > FAINT * spread[0])]
        self.planes = planes[self.kept]
        self.peaks, self.heights, self.reach = find_peaks(self.planes[0])
        self.lines = {scale: measure_lines(exemplar.guidance, scale) for scale in (1.0, 2.0)}
        ask()
        energies = measure_energies(self.planes)
        self.scale = np.maximum(energies.mean(axis=(1, 2)), 0.01 * max(float(energies.mean()), 1e-9))
        cells = self.normalise(energies)
        # Regular positions could coincide with a period of the texture, so choose the cells at random.
        chosen = np.sort(np.random.default_rng(0).permutation(cells.shape[1])[:MOST])
        self.cells = cells[:, chosen]
        row, column = np.divmod(chosen, energies.shape[2])
        beside = (np.abs(row[:, None] - row) < 4) & (np.abs(column[:, None] - column) < 4)
        own = find_distances(self.cells, self.cells, beside)
        self.usual = float(np.percentile(own[np.isfinite(own)], USUAL)) if np.isfinite(own).any() else np.inf
        ask()
        pairs = [pick(list_neighbours(exemplar.shape, axis)[0]) for axis in range(2)]
        steps = [rate_steps(self.planes, axis, at) for axis, at in enumerate(pairs)]
        self.step = float(np.percentile(np.concatenate(steps), USUAL))
        tones = soften(self.planes)
        self.blot = float(
            np.percentile(np.concatenate([rate_tones(tones, k, at) for k, at in enumerate(pairs)]), USUAL)
        )

    def measure(self, source: SourceMap, image: Array, *, wrap: bool) -> Faults:
        """Return the faults of a texture with its source map. `wrap` states whether both axes are periodic."""
        planes, area = split_colours(guidance(as_image(image)))[self.kept], source.shape[0] * source.shape[1]
        seams = [find_seam(source, axis, wrap) for axis in range(2)]
        fine, coarse = (self.count_breaks(scale, seams, area) for scale in (1.0, 2.0))
        ask()
        far = find_distances(self.normalise(measure_energies(planes)), self.cells) > self.usual
        ask()
        tones, excess = soften(planes), []
        for rate, values, most in ((rate_steps, planes, self.step), (rate_tones, tones, self.blot)):
            above = np.concatenate([rate(values, axis, seam.at) > most for axis, seam in enumerate(seams)])
            share = float(above.mean()) if len(above) else 0.0
            excess.append(float(np.clip(share - (1 - USUAL / 100), 0, 0.4)))
        return Faults(self.miss_peaks(planes[0]), fine, coarse, float(far.mean()), *excess)

    def miss_peaks(self, light: Floats) -> float:
        """Return the share of the peaks' height that a texture lacks. Each is looked for around its place."""
        if not len(self.peaks):
            return 0.0
        found, lost = correlate_fine(light, self.reach), 0.0
        for (row, column), height in zip(self.peaks, self.heights, strict=True):
            near = 2 + int(0.06 * np.hypot(row, column - self.reach[1]))
            around = found[max(0, row - near) : row + near + 1, max(0, column - near) : column + near + 1]
            lost += height * max(0.0, height - float(around.max(initial=0.0)))
        return float(lost / self.heights.sum())

    def count_breaks(self, scale: float, seams: list[Seam], area: int) -> float:
        """Return the lines that break off at seams beyond the usual number, as a share of the expected lines."""
        slopes, line, usual, lines = self.lines[scale]
        broken, _ = find_breaks(slopes, line, seams)
        return max(0.0, float(broken.sum()) - usual * len(broken)) / max(lines * area, 1.0)

    def normalise(self, energies: Floats) -> Floats:
        """Return the energies of each cell as a column, in units of the exemplar's means."""
        return np.asarray(np.sqrt(energies / self.scale[:, None, None]).reshape(len(energies), -1), np.float32)


def split_colours(colours: Floats) -> Floats:
    """Return the lightness and two colour differences of an image, (3, H, W), or its lightness alone."""
    if colours.shape[-1] == 1:
        return np.moveaxis(colours, -1, 0)
    red, green, blue = np.moveaxis(as_rgb(colours), -1, 0)
    return np.stack([(red + green + blue) / 3, (red - green) / 2, (red + green - 2 * blue) / 4])


def correlate_fine(light: Floats, reach: tuple[int, int]) -> Floats:
    """Return the correlation of an image with itself, without its slow changes.

    Rows are shifts from 0, columns are shifts from ``-reach`` to ``reach``.
    """
    from scipy.ndimage import gaussian_filter

    return correlate(light - gaussian_filter(light, max(reach) / 3), reach)[reach[0] :]


def find_peaks(light: Floats) -> tuple[NDArray[np.intp], Floats, tuple[int, int]]:
    """Return the places and heights of the highest peaks of the autocorrelation, and the search range along each axis."""
    from scipy.ndimage import maximum_filter

    rows, columns = (max(1, min(int(REACH * n), FAR)) for n in light.shape)
    found = correlate_fine(light, (rows, columns))
    at = np.argwhere((found == maximum_filter(found, 7)) & (found > PEAK))
    # The peak at no shift has the width of a few pixels.
    at = at[np.hypot(at[:, 0], at[:, 1] - columns) > 5]
    at = at[np.argsort(-found[tuple(at.T)], kind="stable")[:PEAKS]]
    return at, found[tuple(at.T)], (rows, columns)


def pick(at: tuple[NDArray[np.intp], ...]) -> tuple[NDArray[np.intp], ...]:
    """Return some of many pixels, evenly spread, for measuring shares."""
    step = max(1, len(at[0]) // PAIRS)
    return tuple(index[::step] for index in at)


def measure_lines(colours: Floats, scale: float) -> tuple[Floats, float, float, float]:
    """Return gradients, the least gradient of a line, and the usual shares of broken lines and of lines."""
    from scipy.ndimage import gaussian_filter

    soft, shape = gaussian_filter(colours, (scale, scale, 0)), colours.shape[:2]
    slopes = np.concatenate(np.gradient(soft, axis=(0, 1)), axis=-1).astype(np.float32)
    line = max(float(np.percentile(np.abs(slopes).reshape(*shape, 2, -1).mean(axis=-1), LINE)), 1e-6)
    own = SourceMap.identity(shape)
    pairs = [Seam(own, axis, *(pick(side) for side in list_neighbours(shape, axis))) for axis in range(2)]
    usual, lines = (float(marks.mean()) for marks in find_breaks(slopes, line, pairs))
    return slopes, line, usual, lines


@lru_cache(maxsize=16)
def make_filters(shape: tuple[int, int], scales: tuple[int, ...]) -> Floats:
    """Return the spectra of filters of six orientations at some scales, (filters, H, W), for images of a size."""
    from scipy import fft

    row, column = np.meshgrid(*(fft.fftfreq(n) for n in shape), indexing="ij")
    radius, angle, found = np.maximum(np.hypot(row, column), 1e-6), np.arctan2(row, column), []
    for scale in scales:
        radial = np.exp(-0.5 * (np.log2(radius / (0.33 / 2**scale)) / 0.55) ** 2)
        for k in range(ORIENTATIONS):
            off = np.angle(np.exp(1j * (angle - np.pi * k / ORIENTATIONS)))
            found.append((radial * np.exp(-0.5 * (off / (0.7 * np.pi / ORIENTATIONS)) ** 2)).astype(np.float32))
    return np.asarray(found)


def filter_oriented(x: Floats, scales: tuple[int, ...]) -> Floats:
    """Return the magnitudes of complex filters of six orientations at some scales, (filters, H, W)."""
    from scipy import fft

    # The margin is about the reach of the widest filter.
    margin = 16
    size = [fft.next_fast_len(n + 2 * margin) for n in x.shape]
    after = [n - m - margin for n, m in zip(size, x.shape, strict=True)]
    padded = np.pad(x, [(margin, n) for n in after], mode="symmetric").astype(np.float64)
    spectrum, inside = fft.fft2(padded), tuple(slice(margin, -n) for n in after)
    found = (fft.ifft2(spectrum * one)[inside] for one in make_filters(padded.shape, scales))
    return np.stack([np.abs(one).astype(np.float32) for one in found])


def average(x: Floats, side: int) -> Floats:
    """Return the means over square cells of the last two axes. Incomplete cells are left out."""
    rows, columns = x.shape[-2] // side, x.shape[-1] // side
    shape = (*x.shape[:-2], rows, side, columns, side)
    return np.asarray(x[..., : rows * side, : columns * side].reshape(shape).mean(axis=(-3, -1)), np.float32)


def measure_energies(planes: Floats) -> Floats:
    """Return the oriented energies of cells, (energies, rows, columns), also of the energies of the lightness.

    Energies of energies distinguish corners, ends and crossings from lines (Bruna and Mallat, "Invariant scattering
    convolution networks", 2013).
    """
    found = []
    for number, plane in enumerate(planes):
        ask()
        first = filter_oriented(plane, (0, 1, 2))
        found.append(average(first, CELL))
        # Colour differences are signed, so make them positive.
        found.append(0.25 * average(plane[None] + (0.5 if number else 0.0), CELL))
        if number:
            continue
        for scale, scales in ((0, (0, 1)), (1, (1,))):
            for energy in average(first[scale * ORIENTATIONS : (scale + 1) * ORIENTATIONS], 2):
                found.append(average(filter_oriented(energy, scales), CELL // 2))
    rows, columns = (min(f.shape[axis] for f in found) for axis in (1, 2))
    return np.asarray(np.maximum(np.concatenate([f[:, :rows, :columns] for f in found]), 0), np.float32)


def find_distances(these: Floats, those: Floats, without: Bools | None = None) -> Floats:
    """Return the distance of each column to the nearest of the others. Pairs in `without` do not count."""
    from scipy.spatial.distance import cdist

    # A matrix product would be faster, but its last bits depend on the processor.
    found = cdist(these.T, those.T)
    if without is not None:
        found[without] = np.inf
    return np.asarray(found.min(axis=1), np.float32)


def rate_steps(planes: Floats, axis: int, at: tuple[NDArray[np.intp], ...]) -> Floats:
    """Return how much the mean tones of four pixels on both sides of places differ, relative to their roughness."""
    lines = np.moveaxis(planes, 1 + axis, 1)
    here, aside = at[axis], at[1 - axis]

    def look(steps: tuple[int, ...]) -> Floats:
        return np.stack([lines[:, np.clip(here + s, 0, lines.shape[1] - 1), aside] for s in steps])

    before, behind = look((-4, -3, -2, -1)), look((2, 3, 4, 5))
    step = np.abs(before.mean(axis=0) - behind.mean(axis=0)).sum(axis=0)
    rough = sum(np.abs(np.diff(side, axis=0)).sum(axis=1).mean(axis=0) for side in (before, behind))
    # A hundredth of the range is the least roughness, so that noise in flat areas is not a step.
    return np.asarray(step / (rough + 0.01), np.float32)


def soften(planes: Floats) -> Floats:
    """Return planes averaged over about 20 pixels."""
    from scipy.ndimage import gaussian_filter

    return np.asarray(gaussian_filter(planes, (0, SOFT, SOFT)), np.float32)


def rate_tones(tones: Floats, axis: int, at: tuple[NDArray[np.intp], ...]) -> Floats:
    """Return how much averaged tones on both sides of places differ."""
    lines = np.moveaxis(tones, 1 + axis, 1)
    here, aside = at[axis], at[1 - axis]
    before, behind = (lines[:, np.clip(here + s, 0, lines.shape[1] - 1), aside] for s in (-APART, APART + 1))
    return np.asarray(np.abs(before - behind).sum(axis=0), np.float32)

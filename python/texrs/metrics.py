"""Quality of a synthesised texture, measured from its source map.

The figures measure torn elements, lines that break off at seams, blur along seams, repeated places, and parts of the
exemplar that are never shown.

Only seams are examined, which the source map contains. Each figure is relative to the usual value in the exemplar, so
that a crop of the exemplar scores 0. Two figures measure tears. ``torn`` uses the elements of a segmentation.
``broken`` measures lines that break off, without elements: an edge of the exemplar that meets a seam must continue
beyond it. A cut along wrongly segmented outlines is therefore not rewarded by itself.

The distance of windows at seams to the nearest windows of the exemplar is not used, because it is smallest for fused
elements.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, as_instance, as_wrap, guidance
from texrs._typing import Array, Bools, Floats
from texrs.errors import InvalidInput
from texrs.exemplar import ElementOptions, Exemplar
from texrs.exemplar.shapes import mark_outlines
from texrs.kernels.gather import sample
from texrs.source_map import SourceMap

__all__ = ["Quality", "evaluate"]


def __dir__() -> list[str]:
    return __all__


REACH, INSIDE = 8.0, 1 / 8
"""Depth in pixels of a pixel fully inside an element, and share of this depth above which a pixel counts as inside."""
VISIBLE, UNSEEN = 90, 0.25
"""Percentile of the exemplar's differences above which a difference is visible, and weight of an invisible tear.
"""
EDGE, TURNED = 85, 0.6
"""Percentile of gradients above which a pixel is on a line, and the missing share of a gradient that breaks the line.
"""
BAND = 3
"""Width in pixels on both sides of a seam for the measurement of blur."""
CELL = 8
"""Side of the cells for which use and repetition are counted, in pixels."""
GROUND = 0.1
"""Weight of the background relative to elements when repetition is measured."""
ALIKE = 4
"""Number of steps per unit to which frames are rounded before they are compared."""
TORN, BROKEN, BLUR, REPETITION, UNUSED = 1.0, 1.0, 0.5, 0.1, 0.1
"""Weights of the figures in the score."""


@dataclass(frozen=True, slots=True)
class Quality:
    """Faults of a texture. The best value of each figure is 0, except for ``coverage``.

    Attributes
    ----------
    torn : float
        Length of seams that cross elements, divided by the expected total outline length: 0 or more. Invisible
        seams have a weight of 0.25.
    broken : float
        Length of lines that break off at seams, beyond the usual amount in the exemplar: 0 or more. It is divided by
        the expected total length of lines.
    seam_blur : float
        Share of the detail of the exemplar that is missing next to seams, 0 to 1.
    repetition : float
        Amount of exact repetition compared with random patches, weighted by how conspicuous the places are. It is 0 if
        nothing repeats, 1 if patches are random, and 0.25 if they are also mirrored.
    coverage : float
        Share of the exemplar that is shown, 0 to 1, relative to the share that a texture of this size can show.

    Examples
    --------
    >>> from texrs.metrics import Quality
    >>> bad, good = Quality(0.2, 0.1, 0.0, 0.5, 0.9), Quality(0.0, 0.0, 0.0, 0.1, 0.9)
    >>> good.score < bad.score
    True

    """

    torn: float
    broken: float
    seam_blur: float
    repetition: float
    coverage: float

    @property
    def score(self) -> float:
        """Weighted sum of the figures. Lower is better."""
        flaws = TORN * self.torn + BROKEN * self.broken + BLUR * self.seam_blur
        return flaws + REPETITION * self.repetition + UNUSED * (1 - self.coverage)

    def report(self) -> dict[str, float]:
        """Return the figures and the score as JSON types.

        Returns
        -------
        dict of str to float
            Figures rounded to four places.

        Examples
        --------
        >>> from texrs.metrics import Quality
        >>> sorted(Quality(0.2, 0.1, 0.0, 0.5, 0.9).report())
        ['broken', 'coverage', 'repetition', 'score', 'seam_blur', 'torn']

        """
        return {name: round(value, 4) for name, value in {"score": self.score, **asdict(self)}.items()}


def evaluate(
    exemplar: Array | Exemplar,
    source: SourceMap,
    image: Array | None = None,
    *,
    elements: ElementOptions = ElementOptions(),
    wrap: bool | tuple[bool, bool] = False,
) -> Quality:
    """Measure the quality of a texture that was synthesised from one exemplar.

    Parameters
    ----------
    exemplar : (H, W) or (H, W, C) array, or Exemplar
        Exemplar of the texture.
    source : SourceMap
        Source of each pixel, shape (h, w).
    image : (h, w) or (h, w, C) array, optional
        The texture, if its colours were corrected. It is used to measure blur. Default: blur is not measured.
    elements : ElementOptions
        Options that control how elements of the exemplar are found. Default: the default options.
    wrap : bool or (rows, columns)
        Axes along which the texture is periodic. Default: none.

    Returns
    -------
    Quality

    Raises
    ------
    InvalidInput
        If the source map refers to several exemplars or to one of another shape, or the image has another shape.

    Examples
    --------
    >>> import texrs
    >>> from texrs.metrics import evaluate
    >>> pebbles = texrs.samples.pebbles((96, 96)).image
    >>> evaluate(pebbles, texrs.SourceMap.identity((96, 96))).score
    0.0
    >>> made = texrs.synthesize(pebbles, 96)
    >>> evaluate(pebbles, made.source_map).score > 0
    True

    """
    as_instance(source, "source", SourceMap)
    as_instance(elements, "elements", ElementOptions)
    known = exemplar if isinstance(exemplar, Exemplar) else Exemplar(exemplar)
    if known.axes != 2 or source.shapes != (known.shape,):
        raise InvalidInput(f"source: must have one exemplar of shape {known.shape}, got {source.shapes}")
    cyclic = as_wrap(wrap)
    traits = known.cached(("traits", elements.key), lambda: _measure_traits(known, elements))
    seams = [find_seam(source, axis, cyclic[axis]) for axis in range(2)]
    seam_blur = 0.0
    if image is not None:
        pixels = guidance(as_image(image, "image"))
        if pixels.shape[:2] != source.shape:
            raise InvalidInput(f"image: must have the size of the source map, {source.shape}, got {pixels.shape[:2]}")
        seam_blur = _measure_blur(traits, source, seams, pixels)
    repetition, coverage = measure_use(traits.salience, traits.colours.shape, source)
    area = source.shape[0] * source.shape[1]
    return Quality(
        _measure_tears(traits, seams, area), _measure_breaks(traits, seams, area), seam_blur, repetition, coverage
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Traits:
    """Usual values within an exemplar, to which textures are compared.

    Attributes
    ----------
    colours : (H, W, C) float32
        Colours that are compared.
    depth : (H, W) float32
        Depth of each pixel inside an element, 0 to 1.
    outlines : float
        Number of pairs of neighbours that an outline separates, divided by the number of pixels.
    step : float
        Difference between neighbours above which it is visible.
    slopes : (H, W, 2 C) float32
        Gradients of all channels along rows, then along columns.
    line : float
        Minimum gradient of a line.
    broken : float
        Share of the pairs of neighbouring pixels where a line breaks off.
    lines : float
        Share of the pairs of neighbouring pixels that are on a line.
    salience : (h, w) float64
        Conspicuousness of each cell, 1 on average.

    """

    colours: Floats
    depth: Floats
    outlines: float
    step: float
    slopes: Floats
    line: float
    broken: float
    lines: float
    salience: NDArray[np.float64]

    @property
    def nbytes(self) -> int:
        """Bytes of the arrays."""
        return self.colours.nbytes + self.depth.nbytes + self.slopes.nbytes + self.salience.nbytes


def _measure_traits(exemplar: Exemplar, elements: ElementOptions) -> _Traits:
    """Measure the usual values of an exemplar."""
    from scipy.ndimage import gaussian_filter

    colours, parts = exemplar.guidance, exemplar.segment(elements)
    found = parts.kind in ("components", "labels")
    depth = parts.measure_depth(REACH) if found else np.zeros(exemplar.shape, np.float32)
    outline = mark_outlines(parts.elements).mean() if found else 1.0
    steps = np.concatenate([np.abs(np.diff(colours, axis=axis)).mean(axis=-1).ravel() for axis in range(2)])
    soft = gaussian_filter(colours, (1, 1, 0))
    slopes = np.concatenate(np.gradient(soft, axis=(0, 1)), axis=-1).astype(np.float32)
    sizes = np.abs(slopes).reshape(*exemplar.shape, 2, -1).mean(axis=-1)
    own = SourceMap.identity(exemplar.shape)
    pairs = [Seam(own, axis, *list_neighbours(exemplar.shape, axis)) for axis in range(2)]
    line = max(float(np.percentile(sizes, EDGE)), 1e-6)
    broken, lines = (float(marks.mean()) for marks in find_breaks(slopes, line, pairs))
    step = float(np.percentile(steps, VISIBLE))
    return _Traits(colours, depth, float(outline), step, slopes, line, broken, lines, measure_salience(colours, depth))


def measure_salience(colours: Floats, depth: Floats) -> NDArray[np.float64]:
    """Return the conspicuousness of each cell.

    The value is the deviation of a cell's mean colour and contrast from the medians of all cells, in standard
    deviations. If there are elements, the background has a low weight, because its repetition is not noticed.
    """
    rows, columns = (-(-n // CELL) for n in colours.shape[:2])
    fill = ((0, rows * CELL - colours.shape[0]), (0, columns * CELL - colours.shape[1]), (0, 0))
    cells = np.pad(colours, fill, mode="edge").reshape(rows, CELL, columns, CELL, -1).astype(np.float64)
    traits = np.concatenate([cells.mean(axis=(1, 3)), cells.std(axis=(1, 3))], axis=-1)
    away = np.abs(traits - np.median(traits, axis=(0, 1))) / np.maximum(traits.std(axis=(0, 1)), 1e-9)
    salience: NDArray[np.float64] = 0.5 + away.mean(axis=-1)
    if depth.any():
        inside = np.pad(depth > 0, fill[:2], mode="edge").reshape(rows, CELL, columns, CELL).mean(axis=(1, 3))
        salience *= GROUND + (1 - GROUND) * inside
    return np.asarray(salience / salience.mean(), np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class Seam:
    """Pairs of neighbouring pixels along an axis whose sources are not neighbours."""

    source: SourceMap
    axis: int
    at: tuple[NDArray[np.intp], ...]
    after: tuple[NDArray[np.intp], ...]

    def look_across(self, image: Floats) -> tuple[Floats, Floats]:
        """Return the values of an image of the exemplar at the sources of the pixels on both sides."""
        first, second = (sample(image, self.source.coordinates[at], interpolation="nearest") for at in self.sides)
        return first, second

    @property
    def sides(self) -> tuple[tuple[NDArray[np.intp], ...], tuple[NDArray[np.intp], ...]]:
        """Pixels before and after the seam."""
        return self.at, self.after


def list_neighbours(shape: tuple[int, ...], axis: int) -> tuple[tuple[NDArray[np.intp], ...], ...]:
    """Return the pixels of an image that have a neighbour along an axis, and these neighbours."""
    at = np.nonzero(np.ones([n - (a == axis) for a, n in enumerate(shape)], bool))
    return at, tuple(index + (a == axis) for a, index in enumerate(at))


def find_seam(source: SourceMap, axis: int, wrap: bool) -> Seam:
    """Return the pairs of neighbours along an axis that a seam separates."""
    parted = ~source.is_coherent(axis, wrap=wrap)
    if not wrap:
        np.moveaxis(parted, axis, 0)[-1] = False
    at = np.nonzero(parted)
    after = tuple((index + (a == axis)) % n for a, (index, n) in enumerate(zip(at, source.shape, strict=True)))
    return Seam(source, axis, at, after)


def _measure_tears(traits: _Traits, seams: list[Seam], area: int) -> float:
    """Return the length of seams inside elements, divided by the expected outline length."""
    length = 0.0
    for seam in seams:
        depth = np.minimum(*seam.look_across(traits.depth[..., np.newaxis]))[:, 0]
        before, behind = seam.look_across(traits.colours)
        seen = np.abs(before - behind).mean(axis=-1) > traits.step
        length += float(((depth > INSIDE) * np.where(seen, 1.0, UNSEEN)).sum())
    return length / max(traits.outlines * area, 1.0)


def _measure_breaks(traits: _Traits, seams: list[Seam], area: int) -> float:
    """Return the length of lines that break off at seams, minus the usual length, as a share of all lines."""
    found, _ = find_breaks(traits.slopes, traits.line, seams)
    excess = float(found.sum()) - traits.broken * len(found)
    return max(0.0, excess) / max(traits.lines * area, 1.0)


def find_breaks(slopes: Floats, line: float, seams: list[Seam]) -> tuple[Bools, Bools]:
    """Return masks of the pairs with a broken crossing line, and of the pairs with any line.

    A line crosses a seam if there is a strong gradient along the seam. It is broken if the other side does not have a
    similar gradient within one pixel. An edge along the seam on one side is an exception, because an element ends
    there, and the line continues hidden below the element.
    """
    ends = np.zeros(seams[0].source.shape, bool)
    for seam in seams:
        for at in seam.sides:
            # Use both axes, because a seam along a slanted outline goes in steps.
            ends[at] |= np.abs(_list_slopes(slopes, seam, at, seam.axis)[1]).mean(axis=-1) > line
    broken, lines = [], []
    for seam in seams:
        first, second = (_list_slopes(slopes, seam, at, 1 - seam.axis) for at in seam.sides)
        off, crossed = np.zeros(len(seam.at[0]), bool), np.zeros(len(seam.at[0]), bool)
        for here, there in ((first, second), (second, first)):
            size = np.abs(here[1]).mean(axis=-1)
            lack = np.min([np.abs(here[1] - other).mean(axis=-1) for other in there], axis=0)
            off |= (size > line) & (lack > TURNED * size)
            crossed |= size > line
        broken.append(off & ~ends[seam.at] & ~ends[seam.after])
        lines.append(crossed)
    return np.concatenate(broken), np.concatenate(lines)


def _list_slopes(slopes: Floats, seam: Seam, at: tuple[NDArray[np.intp], ...], along: int) -> list[Array]:
    """Return the gradients along an output axis at the sources of pixels, and one pixel to each side."""
    source = seam.source
    frame = source.jacobian_array()
    ways = np.zeros((len(at[0]), 2), np.float32)
    if frame is None:
        ways[:, along] = 1
    else:
        ways[:] = (frame[source.label[at]] if frame.ndim == 3 else frame[at])[..., along]
    found = []
    for step in (-1, 0, 1):
        each = sample(slopes, source.coordinates[at] + np.float32(step) * ways, interpolation="nearest")
        rows, columns = np.split(each, 2, axis=-1)
        found.append(rows * ways[:, :1] + columns * ways[:, 1:])
    return found


def _measure_blur(traits: _Traits, source: SourceMap, seams: list[Seam], image: Floats) -> float:
    """Return the share of the detail of the sources that is missing next to seams."""
    from scipy.ndimage import binary_dilation, laplace

    at_seam = np.zeros(source.shape, bool)
    for seam in seams:
        for side in seam.sides:
            at_seam[side] = True
    # Leave out the seams themselves, which may be sharp even if their surroundings are not.
    near = binary_dilation(at_seam, iterations=1)
    band = binary_dilation(near, iterations=BAND - 1) & ~near
    if not band.any():
        return 0.0
    # Scaled or rotated pixels are softer, which is not seam blur: the source gives the expected detail.
    wanted, shown = (
        np.abs(np.stack([laplace(seen[..., c]) for c in range(seen.shape[-1])], axis=-1)[band]).mean()
        for seen in (sample(traits.colours, source.coordinates, interpolation="cubic"), image)
    )
    return float(np.clip(1 - shown / wanted, 0, 1)) if wanted > 0 else 0.0


def measure_use(salience: NDArray[np.float64], shape: tuple[int, ...], source: SourceMap) -> tuple[float, float]:
    """Return the amount of exact repetition, and the share of the exemplar that is shown."""
    rows, columns = salience.shape
    last = np.array(shape[:2]) - 1
    row, column = np.moveaxis(np.clip(np.rint(source.coordinates), 0, last).astype(np.intp) // CELL, -1, 0)
    cell = (row * columns + column).ravel()
    area = np.bincount(cell, minlength=rows * columns)
    # Rotated, scaled or mirrored copies do not count as equal.
    key, ways = cell, _number_frames(source)
    if ways is not None:
        key = ways.ravel() * (rows * columns) + cell
    shown, number = np.unique(key, return_inverse=True)
    times = np.bincount(number) / CELL**2
    again = salience.ravel()[shown % (rows * columns)] * times * np.maximum(times - 1, 0)
    drawn = cell.size / (shape[0] * shape[1])
    repetition = float(again.sum() / (cell.size / CELL**2) / drawn)
    coverage = min(1.0, float((area > CELL).mean()) / min(1.0, drawn))
    return repetition, coverage


def _number_frames(source: SourceMap) -> NDArray[np.intp] | None:
    """Return a number for each pixel, equal for pixels with about the same rotation and scale."""
    frame = source.jacobian_array()
    if frame is None:
        return None
    rough = np.rint(ALIKE * frame.reshape(-1, 4)).astype(np.intp)
    number = np.unique(rough, axis=0, return_inverse=True)[1].reshape(frame.shape[:-2])
    return np.asarray(number[source.label] if frame.ndim == 3 else number, np.intp)

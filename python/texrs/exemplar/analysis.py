"""Analyse an exemplar before synthesis: a pyramid, with appearance vectors at each level."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import log2

import numpy as np

from texrs._arrays import as_bool, as_image, to_unit
from texrs._engine.appearance import Appearance
from texrs._engine.pyramid import halve
from texrs._show import brief
from texrs._typing import Array, Floats
from texrs.errors import InvalidInput

__all__ = ["COARSEST", "Analysis", "analyse_colours", "are_labels", "code_colours", "count_levels", "measure_repeat"]

COARSEST = 16
"""Minimum side of the coarsest level, in samples. On smaller levels, a window would cover most of the exemplar."""
SIMILAR = 1.25
"""Maximum ratio of the difference across the ends of a periodic axis to the difference of neighbours within it."""


@dataclass(frozen=True, slots=True, eq=False)
class Analysis:
    """Pyramid of an exemplar with appearance vectors at each level.

    Attributes
    ----------
    levels : tuple of Appearance
        Levels from the coarsest to the resolution of the exemplar. Each has twice the resolution of the previous one.

    Examples
    --------
    >>> from texrs import Exemplar, samples
    >>> len(Exemplar(samples.dots((64, 64)).image).analyse().levels)
    3

    """

    levels: tuple[Appearance, ...]

    __repr__ = brief

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of samples of the exemplar along each axis."""
        return self.levels[-1].shape

    @property
    def wrap(self) -> tuple[bool, ...]:
        """Axes along which the exemplar is periodic."""
        return self.levels[-1].wrap

    @property
    def nbytes(self) -> int:
        """Approximate size of the analysis in bytes."""
        return sum(int(np.prod(level.shape)) * 56 for level in self.levels)

    def arrays(self) -> dict[str, Array]:
        """Return the analysis as plain arrays for storage. `from_arrays` restores it.

        Returns
        -------
        dict of str to array
            The arrays by level and name, such as ``"0/basis"``.

        Examples
        --------
        >>> from texrs import Exemplar, samples
        >>> sorted(Exemplar(samples.dots((64, 64)).image).analyse().arrays())[:3]
        ['0/basis', '0/bias', '0/channels']

        """
        return {f"{i}/{name}": value for i, level in enumerate(self.levels) for name, value in level.arrays().items()}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Array]) -> Analysis:
        """Return the analysis from its arrays.

        Parameters
        ----------
        arrays : mapping of str to array
            Arrays as returned by `arrays`. Names without a slash are ignored.

        Returns
        -------
        Analysis

        Raises
        ------
        InvalidInput
            If an array is missing, or the arrays do not match each other.

        Examples
        --------
        >>> from texrs import Exemplar, samples
        >>> from texrs.exemplar import Analysis
        >>> known = Exemplar(samples.dots((64, 64)).image).analyse()
        >>> len(Analysis.from_arrays(known.arrays()).levels) == len(known.levels)
        True

        """
        if not isinstance(arrays, Mapping) or not all(isinstance(name, str) for name in arrays):
            raise InvalidInput(f"arrays: must be a mapping of names to arrays, got {type(arrays).__name__}")
        # Restore single numbers, which a file stores as arrays with one value.
        mine = {name: a.reshape(()) if a.size == 1 else a for name, a in arrays.items() if "/" in name}
        count = len({name.split("/")[0] for name in mine})
        if not count:
            raise InvalidInput("analysis: must have at least one level")
        parts = ({k.partition("/")[2]: v for k, v in mine.items() if k.startswith(f"{i}/")} for i in range(count))
        return cls(tuple(Appearance.from_arrays(part) for part in parts))


def count_levels(shape: Sequence[int], coarsest: int) -> int:
    """Return the maximum number of pyramid levels whose coarsest level has at least a given side."""
    return max(1, int(log2(max(1, min(shape) / coarsest))) + 1)


def analyse_colours(seen: Floats, wrap: tuple[bool, ...], radii: Sequence[int], count: int) -> Analysis:
    """Return the analysis of colours with a given number of levels."""
    pyramid, axes = [seen], len(wrap)
    for _ in range(count - 1):
        pyramid.append(halve(pyramid[-1], wrap, axes=axes))
    pyramid.reverse()
    radius = [radii[min(i, len(radii) - 1)] for i in range(count)]
    levels = (Appearance(level, axes=axes, wrap=wrap, radius=r) for level, r in zip(pyramid, radius, strict=True))
    return Analysis(tuple(levels))


def code_colours(image: Array, labels: bool | None = None) -> Floats:
    """Return up to four channels, in [0, 1], for comparing the windows of an exemplar.

    Colours are weighted by their opacity. Classes become corners of a cube, which are all about equally far apart. If
    there are more than four channels, the four principal components are used.
    """
    if are_labels(image, labels):
        values, index = np.unique(image[..., 0], return_inverse=True)
        if len(values) > 4096:
            raise InvalidInput(f"labels: must have at most 4096 classes, got {len(values)}")
        if len(values) == 2:
            code = np.array([[0], [1]], np.float32)  # With two classes, a second channel would contain the same values.
        elif len(values) <= 4:
            code = np.eye(len(values), dtype=np.float32)
        else:
            base = next(b for b in range(2, 9) if b**4 >= len(values))
            digits = np.arange(len(values))[:, np.newaxis] // base ** np.arange(4) % base
            code = (digits / (base - 1)).astype(np.float32)
        return np.ascontiguousarray(code[index.reshape(image.shape[:-1])])
    unit = to_unit(image)
    channels = unit.shape[-1]
    if channels in (2, 4):
        return np.concatenate([unit[..., :-1] * unit[..., -1:], unit[..., -1:]], axis=-1)
    if channels <= 4:
        return unit
    flat = unit.reshape(-1, channels).astype(np.float64)
    flat -= flat.mean(axis=0)
    _, vectors = np.linalg.eigh(flat.T @ flat)
    leading = vectors[:, :-5:-1]
    leading *= np.sign(leading[np.abs(leading).argmax(axis=0), np.arange(4)])
    found = (flat @ leading).astype(np.float32).reshape(*unit.shape[:-1], 4)
    return np.ascontiguousarray((found - found.min()) / max(float(np.ptp(found)), 1e-12))


def are_labels(image: Array, labels: bool | None = None) -> bool:
    """Return True if the values of an exemplar are unordered classes.

    By default, one channel of integers or bool with 2 to 16 values contains classes.

    Interpolation between so few values would produce values that are not classes.
    """
    if labels is not None:
        if as_bool(labels, "labels") and image.shape[-1] != 1:
            raise InvalidInput(f"labels: must have one channel, got {image.shape[-1]}")
        return labels
    if image.dtype.kind not in "bui" or image.shape[-1] != 1:
        return False
    return 2 <= len(np.unique(image)) <= 16


def measure_repeat(exemplar: object, *, axes: int, levels: int = 1) -> tuple[bool, ...]:
    """Measure along which axes an exemplar is periodic, by comparing its opposite ends.

    An axis is periodic if its ends differ by at most 25 % more than neighbouring samples inside, at every level of the
    pyramid. Its length must also be a multiple of the span of one sample of the coarsest level.

    Examples
    --------
    >>> from texrs import samples
    >>> measure_repeat(samples.particles().image, axes=3), measure_repeat(samples.particles().image[:, :, 9:], axes=3)
    ((True, True, True), (True, True, False))

    """
    image = as_image(exemplar, "exemplar", axes=axes, minimum=4)
    found = [n % (1 << (levels - 1)) == 0 for n in image.shape[:axes]]
    level: Floats = to_unit(image)
    for k in range(max(levels, 1)):
        if k:
            level = halve(level, tuple(found), axes=axes)
        for axis in range(axes):
            line = np.moveaxis(level, axis, 0)
            inner = np.abs(np.diff(line, axis=0)).mean(axis=tuple(range(1, line.ndim)))
            across = float(np.abs(line[0] - line[-1]).mean())
            found[axis] &= across <= SIMILAR * float(np.median(inner)) + 1e-6
    return tuple(found)

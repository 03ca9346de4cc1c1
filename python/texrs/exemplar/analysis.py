"""What is known of an exemplar before anything is grown from it: a pyramid, and appearance vectors at each level."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import log2
from pathlib import Path as FilePath

import numpy as np

from texrs._arrays import as_image, as_int, as_wrap, to_unit
from texrs._cache import Cache, content_hash
from texrs._engine.appearance import Appearance
from texrs._engine.coherence import Similarity, similar
from texrs._engine.pyramid import halve
from texrs._typing import Array, Floats, Path
from texrs.errors import FileError, InvalidInput

__all__ = ["Analysis", "analyse", "are_labels", "colours", "repeats", "similarity"]

FORMAT = 1
COARSEST = 16
"""Least side of the coarsest level: below, a window covers most of the exemplar."""
SIMILAR = 1.25
"""An exemplar repeats along an axis if its ends differ by at most this much more than neighbours within it."""
CACHED = 256 << 20
"""Bytes of analyses that are kept in memory, and of similarity sets; one that is larger is kept alone."""


@dataclass(frozen=True, slots=True, eq=False)
class Analysis:
    """An analysed exemplar.

    Attributes
    ----------
    levels : tuple of Appearance
        From the coarsest to the exemplar's own resolution, each twice as fine as the one before.
    key : str
        Digest of the exemplar and of the options: the same key, the same analysis.

    Examples
    --------
    >>> from texrs import samples
    >>> from texrs.exemplar import analysis
    >>> found = analysis.analyse(samples.stripes((32, 32, 48)).image, axes=3)
    >>> [level.shape for level in found.levels], found.wrap
    ([(16, 16, 24), (32, 32, 48)], (False, False, False))

    """

    levels: tuple[Appearance, ...]
    key: str

    @property
    def shape(self) -> tuple[int, ...]:
        """Samples of the exemplar along each axis."""
        return self.levels[-1].shape

    @property
    def wrap(self) -> tuple[bool, ...]:
        """Axes along which the exemplar repeats."""
        return self.levels[-1].wrap

    @property
    def nbytes(self) -> int:
        """Memory that the analysis takes, about."""
        return sum(int(np.prod(level.shape)) * 56 for level in self.levels)

    def arrays(self) -> dict[str, Array]:
        """Return the analysis as plain arrays, to be kept; `from_arrays` takes them back."""
        return {f"{i}/{name}": value for i, level in enumerate(self.levels) for name, value in level.arrays().items()}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Array], key: str) -> Analysis:
        """Return the analysis whose arrays are among these.

        Raises
        ------
        InvalidInput
            Arrays that are missing or do not belong together.

        """
        # Single numbers come back from a file as arrays of one.
        mine = {name: a.reshape(()) if a.size == 1 else a for name, a in arrays.items() if "/" in name}
        count = len({name.split("/")[0] for name in mine})
        if not count:
            raise InvalidInput("analysis: has no levels")
        parts = ({k.partition("/")[2]: v for k, v in mine.items() if k.startswith(f"{i}/")} for i in range(count))
        return cls(tuple(Appearance.from_arrays(part) for part in parts), key)

    def save(self, path: Path) -> None:
        """Write the analysis to a .npz file; a former file is replaced only when all is written."""
        from texrs.io import atomic

        arrays = {"format": np.array(FORMAT), "key": np.frombuffer(bytes.fromhex(self.key), np.uint8)}
        with atomic(path) as temporary, FilePath(temporary).open("wb") as file:
            np.savez(file, **arrays, **self.arrays())  # type: ignore[arg-type]

    @classmethod
    def load(cls, path: Path) -> Analysis:
        """Read an analysis that `save` wrote.

        Raises
        ------
        FileError
            The file cannot be read, is of another version, or is damaged.

        """
        from texrs.io import read_arrays

        arrays = read_arrays(path)
        try:
            if int(arrays.get("format", np.array(-1)).reshape(())) != FORMAT:
                raise FileError(f"{path}: not an analysis of this version of texrs")
            return cls.from_arrays(arrays, arrays["key"].astype(np.uint8).tobytes().hex())
        except FileError:
            raise
        except (InvalidInput, KeyError, TypeError, ValueError, IndexError, OverflowError) as error:
            raise FileError(f"{path}: is damaged ({error})") from None


def analyse(
    exemplar: object,
    *,
    axes: int,
    wrap: bool | Sequence[bool] | None = None,
    labels: bool | None = None,
    radii: Sequence[int] = (2,),
    coarsest: int = COARSEST,
    cache: bool = True,
) -> Analysis:
    """Analyse an exemplar: its pyramid, and the appearance vector of each sample at each level.

    Parameters
    ----------
    exemplar : (..., [C]) array
        Shape (rows, columns[, C]) or (planes, rows, columns[, C]), any real dtype, each side at least 16.
    axes : int
        2 or 3.
    wrap : bool, or one an axis, optional
        Axes along which the exemplar repeats; None measures it (see `repeats`).
    labels : bool, optional
        Whether values are classes without an order; None: where they are integers or bool, of one channel, with 2 to 16
        values.
    radii : sequence of int
        Radius of the windows from the coarsest level on; the last one serves all that follow.
    coarsest : int
        Least side of the coarsest level.
    cache : bool
        Whether to keep the analysis in memory, and take it from there: by the exemplar's content.

    Returns
    -------
    Analysis

    Raises
    ------
    InvalidInput
        A side below 16, or windows that do not fit.

    Examples
    --------
    >>> from texrs import samples
    >>> len(analyse(samples.load("weave").image, axes=2).levels)
    5

    """
    image = as_image(exemplar, "exemplar", axes=axes, minimum=COARSEST)
    closed = None if wrap is None else as_wrap(wrap, axes=axes)
    near = [as_int(r, "radii", 1, 8) for r in radii]
    least = as_int(coarsest, "coarsest", 2 * max(near) + 2, 1 << 16)
    key = content_hash(image, FORMAT, closed, labels, near, least).hex()
    if not cache:
        return _analyse(image, axes, closed, labels, near, least, key)
    return _ANALYSES.get_or_make(key, lambda: _analyse(image, axes, closed, labels, near, least, key))


def _analyse(
    image: Array, axes: int, wrap: tuple[bool, ...] | None, labels: bool | None, radii: list[int], least: int, key: str
) -> Analysis:
    count = levels_of(image.shape[:axes], least)
    seen = colours(image, labels)
    return analyse_colours(seen, repeats(seen, axes=axes, levels=count) if wrap is None else wrap, radii, count, key)


def levels_of(shape: Sequence[int], coarsest: int) -> int:
    """Return how many levels a pyramid has whose coarsest one has at least so many samples a side."""
    return max(1, int(log2(max(1, min(shape) / coarsest))) + 1)


def analyse_colours(seen: Floats, wrap: tuple[bool, ...], radii: Sequence[int], count: int, key: str) -> Analysis:
    """Return the analysis of the colours that windows are compared by, at so many levels."""
    pyramid, axes = [seen], len(wrap)
    for _ in range(count - 1):
        pyramid.append(halve(pyramid[-1], wrap, axes=axes))
    pyramid.reverse()
    radius = [radii[min(i, len(radii) - 1)] for i in range(count)]
    levels = (Appearance(level, axes=axes, wrap=wrap, radius=r) for level, r in zip(pyramid, radius, strict=True))
    return Analysis(tuple(levels), key)


def colours(image: Array, labels: bool | None = None) -> Floats:
    """Return the up to four channels, within [0, 1], that an exemplar's windows are compared by.

    Transparent colours count as little as they are seen. Classes become corners of a cube, all equally far apart or
    nearly so; more than four channels become their four principal components.
    """
    if are_labels(image, labels):
        values, index = np.unique(image[..., 0], return_inverse=True)
        if len(values) > 4096:
            raise InvalidInput(f"labels: up to 4096 classes are allowed, got {len(values)}")
        if len(values) == 2:
            code = np.array([[0], [1]], np.float32)  # A second channel would say the same again.
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
    """Return whether an exemplar's values are classes: as said, or integers or bool of one channel, with 2 to 16 values.

    Between so few values interpolation would invent others.
    """
    if labels is not None:
        if labels and image.shape[-1] != 1:
            raise InvalidInput(f"labels: classes need one channel, got {image.shape[-1]}")
        return labels
    if image.dtype.kind not in "bui" or image.shape[-1] != 1:
        return False
    return 2 <= len(np.unique(image)) <= 16


def repeats(exemplar: object, *, axes: int, levels: int = 1) -> tuple[bool, ...]:
    """Return along which axes an exemplar repeats, by what lies across its ends.

    The ends of an axis must differ no more than neighbouring samples within it, by a quarter, at every level of the
    pyramid; and its length must be a multiple of what a sample of the coarsest level spans.

    Examples
    --------
    >>> from texrs import samples
    >>> repeats(samples.particles().image, axes=3), repeats(samples.particles().image[:, :, 9:], axes=3)
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


def similarity(
    analysis: Analysis,
    level: int,
    *,
    k: int = 3,
    n: int = 7,
    numbers: int = 8,
    progress: Callable[[float], object] | None = None,
) -> Similarity:
    """Return the similarity sets of a level, made when first asked for and kept in memory by the analysis' key.

    Parameters
    ----------
    analysis : Analysis
        Of the exemplar.
    level : int
        From 0, the coarsest.
    k, n, numbers, progress
        As of `texrs._engine.coherence.similar`.

    Returns
    -------
    Similarity

    Raises
    ------
    InvalidInput
        A level that is not there, or no ``k`` samples so far apart.
    Cancelled
        The work was stopped.

    Examples
    --------
    >>> from texrs import samples
    >>> found = analyse(samples.load("weave").image, axes=2)
    >>> similarity(found, 0, k=2).sets.shape == (found.levels[0].shape[0] * found.levels[0].shape[1], 2)
    True

    """
    here = analysis.levels[as_int(level, "level", 0, len(analysis.levels) - 1)]
    return _SIMILARITIES.get_or_make(
        (analysis.key, level, k, n, numbers), lambda: similar(here, k=k, n=n, numbers=numbers, progress=progress)
    )


_ANALYSES: Cache[str, Analysis] = Cache(CACHED, lambda made: min(made.nbytes, CACHED))
_SIMILARITIES: Cache[tuple[object, ...], Similarity] = Cache(CACHED, lambda made: min(made.nbytes, CACHED))

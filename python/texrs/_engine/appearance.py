"""Appearance vectors of an exemplar, synthesis of coherent blocks with them, and correction of the blocks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texrs import _rust
from texrs._arrays import as_float, as_image, as_int, as_seed, as_wrap
from texrs._engine.pyramid import Region, flatten
from texrs._typing import Array
from texrs.errors import InvalidInput

__all__ = ["Appearance", "Corrected", "Demand"]

Report = Callable[[float], object]

_PARTS = ("colours", "features", "basis", "bias", "gain", "spacing")


class Demand(NamedTuple):
    """Values that the points of an output should have, in addition to similarity to the exemplar.

    Attributes
    ----------
    exemplar : (samples * 4) int16
        Four values of each sample of the exemplar, -2048 to 2047. Unused values are 0.
    output : (points * 4) or (points) int16
        Requested values at the points of the output. With a single value per point, the other three values are 0.
    weight : (points) or (1) uint16
        Cost of a squared difference of 1, in units of 1/256, as one number per point or a single number. Unrelated
        windows differ by about 2 * 512^2. If 0, nothing is requested.
    order : (any) uint32
        Samples in ascending order of their first value. Random candidates are then drawn from samples near the
        requested value. If empty, they are drawn from all samples.
    excess : int
        Weight of a first value above the requested value, in 1/256 of the weight of a first value below it. If it is
        not 256, only first values are compared.

    """

    exemplar: NDArray[np.int16]
    output: NDArray[np.int16]
    weight: NDArray[np.uint16]
    order: NDArray[np.uint32] = np.zeros(0, np.uint32)
    excess: int = 256


class Corrected(NamedTuple):
    """Source coordinates after a correction.

    Attributes
    ----------
    places : (points * A) int32
        Source coordinates, in units of 1/4096 of a sample.
    passes : int
        Number of completed passes.
    changed : float
        Share of the points that the last two passes changed.

    """

    places: NDArray[np.int32]
    passes: int
    changed: float


class Appearance:
    """Description of the surroundings of each sample of an exemplar by 24 numbers, its appearance vector.

    Windows of colours, weighted by a Gaussian, are projected onto their leading principal components [1]_. All
    arithmetic is on 12-bit integers, so results are the same on any processor and for any number of threads.

    Parameters
    ----------
    colours : (..., C) array
        Colours for the comparison of windows, with up to four channels of any scale. Shape (rows, columns[, C]) or
        (planes, rows, columns[, C]).
    axes : int
        Number of axes, 2 or 3.
    wrap : bool or one per axis
        Axes along which the exemplar is periodic.
    radius : int
        Radius of a window in samples; its side is 2 radius + 1.

    Raises
    ------
    InvalidInput
        If a side is below 2 radius + 2, there are more than four channels, or windows have more than 2048 numbers.

    References
    ----------
    .. [1] S. Lefebvre and H. Hoppe, "Appearance-space texture synthesis", SIGGRAPH 2006.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs._engine.pyramid import Region, to_fixed
    >>> noise = np.random.default_rng(0).random((32, 32))
    >>> exemplar = Appearance(noise, axes=2)
    >>> region = Region.whole((40, 40))
    >>> frames = to_fixed(None, region)
    >>> start = exemplar.blocks(region, frames, seed=3)
    >>> exemplar.correct(start, region, frames, seed=3).places.shape
    (3200,)

    """

    def __init__(self, colours: object, *, axes: int, wrap: bool | Sequence[bool] = False, radius: int = 2) -> None:
        image = as_image(colours, "colours", axes=axes)
        flat = np.ascontiguousarray(image.reshape(-1, image.shape[-1]), np.float32)
        near = as_int(radius, "radius", 1, 8)
        self._inner = _rust.Appearance(flat, image.shape[:axes], as_wrap(wrap, axes=axes), near)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of samples along each axis."""
        return tuple(self._inner.shape)

    @property
    def wrap(self) -> tuple[bool, ...]:
        """Axes along which the exemplar is periodic."""
        return tuple(self._inner.wrap)

    @property
    def radius(self) -> int:
        """Radius of a window, in samples."""
        return self._inner.radius

    @property
    def spacing(self) -> float:
        """Median squared distance from a window to the nearest other window, relative to the variance of all windows.

        It is the unit of the acceptance threshold.
        """
        return self._inner.spacing

    def arrays(self) -> dict[str, Array]:
        """Return the analysis as plain arrays for storage. `from_arrays` restores it."""
        kept: dict[str, Any] = dict(zip(_PARTS, self._inner.parts(), strict=True))
        kept |= {"shape": self.shape, "wrap": self.wrap, "radius": self.radius, "channels": self._inner.channels}
        return {name: np.asarray(value) for name, value in kept.items()}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Array]) -> Appearance:
        """Restore an analysis from the arrays of `arrays`.

        Raises
        ------
        InvalidInput
            If arrays are missing or inconsistent.

        """
        missing = {*_PARTS, "shape", "wrap", "radius", "channels"} - set(arrays)
        if missing:
            raise InvalidInput(f"analysis: lacks the arrays {', '.join(sorted(missing))}")
        made = cls.__new__(cls)
        try:
            colours, features, basis = (
                np.ascontiguousarray(arrays[name], np.int16).reshape(-1) for name in ("colours", "features", "basis")
            )
            made._inner = _rust.Appearance.from_parts(
                [int(n) for n in arrays["shape"]],
                [bool(w) for w in arrays["wrap"]],
                int(arrays["radius"]),
                int(arrays["channels"]),
                colours,
                features,
                basis,
                np.ascontiguousarray(arrays["bias"], np.int64).reshape(-1),
                int(arrays["gain"]),
                int(arrays["spacing"]),
            )
        except (TypeError, ValueError, OverflowError) as error:
            raise InvalidInput(f"analysis: its arrays do not match each other ({error})") from None
        return made

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the analysis as plain arrays."""
        return Appearance.from_arrays, (self.arrays(),)

    def blocks(
        self,
        region: Region,
        frames: NDArray[np.int16],
        *,
        cell: int = 6,
        rounds: int = 6,
        candidates: int = 512,
        contrast: float = 1.0,
        continuation: float = 0.15,
        repetition: float = 0.3,
        seed: int = 0,
        margin: int = 0,
        held: NDArray[np.bool_] | None = None,
        given: NDArray[np.int32] | None = None,
        demand: Demand | None = None,
        progress: Report | None = None,
    ) -> NDArray[np.int32]:
        """Fill the cells of a region with pieces of the exemplar that fit each other.

        Parameters
        ----------
        region : Region
            Region to fill.
        frames : (1 or points, A, A) int16
            Jacobians over the region (see `texrs._engine.pyramid.to_fixed`).
        cell : int
            Side of a cell in points, 2 to 256. Default: 6.
        rounds : int
            Number of half-rounds, 1 to 64. Each half-round chooses the pieces of all cells of even or odd parity, in
            turn.
        candidates : int
            Number of candidates of a cell in each half-round, 1 to 65535.
        contrast : float
            Extent to which misfits are divided by the contrast of the pieces, 0 (not at all) to 1 (fully). A value of
            0 prefers pieces of low contrast, because they are similar to every piece on average.
        continuation : float
            Cost of continuing exactly where a neighbour ends, 0 to 4, relative to the misfit of unrelated pieces. A
            value of 0 copies the exemplar in large pieces.
        repetition : float
            Cost of using the same samples as a neighbouring cell, 0 to 4, relative to the misfit of unrelated pieces.
        seed : int
            Seed of the random choices. Random numbers depend on positions in the output's coordinates, not on the
            region.
        margin : int
            Number of points along the borders that will be cut off, up to 2^20. Cells that only affect these points
            are not chosen.
        held : (points) bool, optional
            True for fixed points. The other points are chosen to fit them.
        given : (points * A) int32, optional
            Coordinates of the fixed points, in units of 1/4096 of a sample. Values of other points are ignored.
        demand : Demand, optional
            Values that the points should have.
        progress : callable, optional
            Function called with the completed share. An exception that it raises stops the work.

        Returns
        -------
        (points * A) int32
            Source coordinates, in units of 1/4096 of a sample.

        Raises
        ------
        InvalidInput
            If an option is out of its range, or arrays do not have the size of the region.
        Cancelled
            If the work was stopped.

        """
        self.check(region)
        return self._inner.blocks(
            region.place,
            frames,
            as_int(cell, "cell", 2, 256),
            as_int(rounds, "rounds", 1, 64),
            as_int(candidates, "candidates", 1, 65535),
            as_float(contrast, "contrast", 0, 1),
            as_float(continuation, "continuation", 0, 4),
            as_float(repetition, "repetition", 0, 4),
            as_seed(seed),
            as_int(margin, "margin", 0, 1 << 20),
            flatten(held),
            np.zeros(0, np.int32) if given is None else given,
            demand,
            progress,
        )

    def correct(
        self,
        places: NDArray[np.int32],
        region: Region,
        frames: NDArray[np.int16],
        *,
        passes: int = 6,
        first: int = 0,
        exhaustive: bool = False,
        reach: int = 2,
        acceptance: float = 2.0,
        coherence: float = 0.0,
        vote: int = 0,
        settled: float = 0.0,
        seed: int = 0,
        held: NDArray[np.bool_] | None = None,
        demand: Demand | None = None,
        overwrite: bool = False,
        progress: Report | None = None,
    ) -> Corrected:
        """Correct source coordinates until every window of the output resembles a window of the exemplar.

        Parameters
        ----------
        places : (points * A) int32
            Source coordinates, in units of 1/4096 of a sample.
        region, frames
            As for `blocks`.
        passes : int
            Maximum number of passes, up to 1000. Each corrects every other point, as on a chess board.
        first : int
            Index of the first pass, for work that is divided into several calls.
        exhaustive : bool
            If True, each pass compares each window with all windows of the exemplar. Use it for small exemplars.
        reach : int
            Distance of the neighbours whose matches are tried, 1 or 2 points.
        acceptance : float
            Minimum improvement for which a random match replaces the present one, in units of `spacing`, 0 to 100. It
            keeps good matches.
        coherence : float
            Cost of each neighbour that belongs to another piece of the exemplar, in units of `spacing`, 0 to 100. It
            keeps pieces together if several candidates fit equally well.
        vote : int
            Radius of the windows that vote on the coordinates of a point, up to `radius`. If 0, each point uses its
            own match.
        settled : float
            Share of points, 0 to 1. The correction stops when two passes change fewer points. The result then depends
            on the whole region.
        seed : int
            Seed of the random choices.
        held : (points) bool, optional
            True for points whose coordinates are fixed.
        overwrite : bool
            If True, the result is written over ``places``, which saves 4 bytes for each number.
        demand, progress
            As for `blocks`.

        Returns
        -------
        Corrected

        Raises
        ------
        InvalidInput
            If an option is out of its range, or arrays do not have the size of the region.
        Cancelled
            If the work was stopped.

        """
        self.check(region)
        region.check_places(places)
        if not overwrite:
            places = places.copy()
        passes, changed = self._inner.correct(
            places,
            region.place,
            frames,
            flatten(held),
            as_int(passes, "passes", 0, 1000),
            as_int(first, "first", 0, 1 << 20),
            exhaustive,
            as_int(reach, "reach", 1, 2),
            as_float(acceptance, "acceptance", 0, 100),
            as_float(coherence, "coherence", 0, 100),
            as_int(vote, "vote", 0, self.radius),
            as_float(settled, "settled", 0, 1),
            as_seed(seed),
            demand,
            progress,
        )
        return Corrected(places, passes, changed)

    def check(self, region: Region) -> None:
        """Raise an error if a region does not have as many axes as the exemplar."""
        if len(region.shape) != len(self.shape):
            raise InvalidInput(f"region: must have {len(self.shape)} axes like the exemplar, got shape {region.shape}")

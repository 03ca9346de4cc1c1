"""Constraints of an output: given points, and a guide map that it should follow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texrs._arrays import as_float, as_mask, check_memory, try_array
from texrs._engine.appearance import Demand
from texrs._engine.pyramid import ONE, Region
from texrs._notices import ignore
from texrs._show import brief
from texrs._typing import Array, Bools, Floats
from texrs.errors import InvalidInput
from texrs.kernels.gather import gather

__all__ = ["NOTHING", "Asked", "Conditions", "Constraints", "Guide", "Pins", "Surroundings", "average_points"]

WEIGHT = 1500
"""Cost of a squared difference from a given colour, in units of 1/256.

A difference of a tenth of the range costs about as much as two unrelated windows.
"""
FOLLOW = 150
"""Cost of a squared difference from a guide map, in units of 1/256.

A difference of a third of the range costs about as much as two unrelated windows.
"""


# --- what a caller asks ----------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Constraints:
    """Given points of an output, specified by their values or by their source coordinates.

    Attributes
    ----------
    mask : (rows, columns) or (planes, rows, columns) bool or int array
        Mask of the points of the output that are given. Python marks points by values other than 0.
    values : (size[, C]) array, optional
        Values of the given points, in the exemplar's dtype and channels. The output shows them exactly. Values of
        other points are ignored.
    coordinates : (size, A) array, optional
        Source coordinates of the given points, instead of values: (row, column) or (plane, row, column) in samples,
        within the exemplar. Coordinates of other points are ignored, and may be NaN.

    Raises
    ------
    InvalidInput
        If neither values nor coordinates are given, or if both are given.

    Examples
    --------
    An image that continues a part of its exemplar:

    >>> import numpy as np
    >>> import texrs
    >>> weave = texrs.samples.weave((64, 64)).image
    >>> mask = np.zeros((64, 96), bool)
    >>> mask[:, :20] = True
    >>> left = texrs.Constraints(mask=mask, values=np.pad(weave, ((0, 0), (0, 32), (0, 0))))
    >>> made = texrs.synthesize(weave, (64, 96), constraints=left)
    >>> bool((made.image[:, :20] == weave[:, :20]).all())
    True

    """

    mask: Array
    values: Array | None = None
    coordinates: Array | None = None

    __repr__ = brief

    def __post_init__(self) -> None:
        """Raise an error unless exactly one of values and coordinates is given."""
        if (self.values is None) == (self.coordinates is None):
            raise InvalidInput(
                "constraints: must have either values or coordinates for the points of mask, but not both"
            )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Guide:
    """Guide for exemplars with a trend: a map of the exemplar, and the map that the output should follow.

    Attributes
    ----------
    exemplar : (H, W[, C]) or (D, H, W[, C]) array_like
        Quantity that guides the synthesis, at each sample of the exemplar, such as its depth. Python accepts finite
        numbers that broadcast to the exemplar's axes.
    output : (rows, columns[, C]) or (planes, rows, columns[, C]) array_like
        Requested quantity at each point of the output, in the same unit. Python accepts finite numbers that broadcast
        to the size of the output.
    weight : float
        Weight of the guide compared with similarity to the exemplar, 0 to 100. If it is 1, a difference of a third of
        the quantity's range in the exemplar costs as much as two unrelated windows.

    Raises
    ------
    InvalidInput
        If a map contains values that are not finite numbers, or the weight is out of its range.

    Examples
    --------
    An exemplar that becomes brighter downwards, synthesised upside down:

    >>> import numpy as np
    >>> import texrs
    >>> ramp = np.linspace(0, 1, 64)[:, np.newaxis]
    >>> image = np.random.default_rng(0).random((64, 64)) * 0.3 + ramp
    >>> made = texrs.synthesize(image, 96, guide=texrs.Guide(exemplar=ramp, output=np.linspace(1, 0, 96)[:, np.newaxis]))
    >>> bool(made.image[:20].mean() > made.image[-20:].mean())
    True

    """

    exemplar: ArrayLike
    output: ArrayLike
    weight: float = 1.0

    __repr__ = brief

    def __post_init__(self) -> None:
        """Check the values of the maps and the weight, which do not depend on a size."""
        as_float(self.weight, "weight", 0, 100)
        for name, given in (("exemplar", self.exemplar), ("output", self.output)):
            values = try_array(given)
            check_memory(values.size, "guide")
            if values.dtype.kind not in "biuf" or not np.isfinite(values).all():
                raise InvalidInput(
                    f"guide: the map of the {name} must contain finite numbers, "
                    f"got {values.dtype} of shape {values.shape}"
                )


# --- what is asked of a level ----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class Asked:
    """Constraints of the points of one level.

    Attributes
    ----------
    demand : Demand, optional
        Values that the points should have.
    held : (points) bool, optional
        True for points whose coordinates are fixed.
    given : (points * A) int32, optional
        Coordinates of the fixed points, in units of 1/4096 of a sample. None if the level already contains them.
    surrounds : bool
        If True, the start also receives the fixed points, and places its blocks around them.

    """

    demand: Demand | None = None
    held: Bools | None = None
    given: NDArray[np.int32] | None = None
    surrounds: bool = False

    def place(self, places: NDArray[np.int32]) -> NDArray[np.int32]:
        """Insert the given coordinates into the coordinates of a level."""
        if self.held is None or self.given is None:
            return places
        return np.where(np.repeat(self.held, len(places) // len(self.held)), self.given, places)


NOTHING = Asked()


class Held(Protocol):
    """Points of the output whose coordinates are fixed."""

    def at(self, region: Region, spacing: int) -> tuple[Bools, NDArray[np.int32]]:
        """Return True for fixed points of a level, (points) bool, and their coordinates, (points * A) int32."""


@dataclass(frozen=True, slots=True, eq=False)
class Pins:
    """Scattered fixed points.

    A point of a level is fixed if it covers any fixed point of the output. It gets the coordinates of the first one.

    ``mask`` is (size) bool, and ``coordinates`` is (size, A) float32.
    """

    mask: Bools
    coordinates: Floats

    def at(self, region: Region, spacing: int) -> tuple[Bools, NDArray[np.int32]]:
        """Return True for fixed points of a level, and their coordinates."""
        axes = len(region.shape)
        held, places = np.zeros(region.points, bool), np.zeros((region.points, axes), np.int32)
        # Write in reverse order to keep the first value, because NumPy keeps the last value that is written to a
        # place.
        at = np.argwhere(self.mask)[::-1]
        theirs = self.coordinates[self.mask][::-1]
        index = np.ravel_multi_index(tuple(np.minimum(at // spacing, np.array(region.shape) - 1).T), region.shape)
        held[index] = True
        places[index] = np.rint(((theirs + 0.5) / spacing - 0.5) * ONE).astype(np.int32)
        return held, places.reshape(-1)


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """Known points around a hole.

    A point of a level is fixed if at least half of the points that it covers are known. Otherwise coarse levels would
    have no information about the known points around a hole. ``mask`` is (size) bool. ``places`` is (size, A) int32,
    the source sample of each point.
    """

    mask: Bools
    places: NDArray[np.int32]

    def at(self, region: Region, spacing: int) -> tuple[Bools, NDArray[np.int32]]:
        """Return True for fixed points of a level, and their coordinates."""
        share = average_points(self.mask.astype(np.float32), region.shape, spacing)
        starts = [np.minimum(np.arange(n) * spacing, m - 1) for n, m in zip(region.shape, self.mask.shape, strict=True)]
        first = self.places[np.ix_(*starts)].astype(np.float64)
        return (share >= 0.5).reshape(-1), np.asarray(np.rint(first.reshape(-1) * ONE / spacing), np.int32)


@dataclass(frozen=True, slots=True, eq=False)
class Conditions:
    """Constraints and a guide that were checked for an exemplar and an output size.

    `at` converts them to the constraints of a level.

    Attributes
    ----------
    image : (..., C) array
        Image or volume of the exemplar.
    mask : (size) bool, optional
        True for given points.
    values : (size, C) array, optional
        Values of the given points.
    pins : Pins, optional
        Source coordinates of the given points.
    maps : (Floats, Floats), optional
        Guide: the map of the exemplar and the map of the output, both scaled to values from 0 to 1.
    weight : int
        Weight of the guide, in 1/256.

    """

    image: Array
    mask: Bools | None = None
    values: Array | None = None
    pins: Pins | None = None
    maps: tuple[Floats, Floats] | None = None
    weight: int = 0

    @classmethod
    def of(
        cls, image: Array, shape: tuple[int, ...], constraints: Constraints | None, guide: Guide | None
    ) -> Conditions:
        """Check the constraints and the guide for an output of a given shape.

        Raises
        ------
        InvalidInput
            If constraints or maps have the wrong shape or type, if coordinates are outside the exemplar, or if a guide
            is combined with values.

        """
        for given, kind, name in ((constraints, Constraints, "constraints"), (guide, Guide, "guide")):
            if given is not None and not isinstance(given, kind):
                raise InvalidInput(f"{name}: must be a texrs.{kind.__name__}, got {type(given).__name__}")
        mask = values = pins = maps = None
        if constraints is not None:
            mask = as_mask(constraints.mask, "mask", shape)
            if not mask.any():
                ignore("constraints: not used, because mask marks nothing")
            if constraints.coordinates is not None:
                pins = Pins(mask, _check_coordinates(constraints.coordinates, mask, image))
                values = gather(image, pins.coordinates, interpolation="nearest")
            else:
                values = _check_values(constraints.values, mask, image)
        if guide is not None:
            if values is not None and pins is None:
                raise InvalidInput(
                    "guide: cannot be combined with constraints that have values; give coordinates instead"
                )
            maps = _check_maps(guide, image.shape[: len(shape)], shape)
        return cls(image, mask, values, pins, maps, 0 if guide is None else round(FOLLOW * guide.weight))

    @property
    def count(self) -> int:
        """Number of given points."""
        return 0 if self.mask is None else int(self.mask.sum())

    @property
    def free(self) -> bool:
        """True if there are neither constraints nor a guide."""
        return not self.count and self.maps is None

    def show(self, composite: Array) -> Array:
        """Insert the given values into an image, so that they are exact."""
        if self.mask is None or self.values is None or self.pins is not None:
            return composite
        result = composite.copy()
        result[self.mask] = self.values[self.mask].reshape(result[self.mask].shape)
        return result

    def at(self, level: int, region: Region, spacing: int) -> Asked:
        """Return the constraints of a level whose points are ``spacing`` pixels apart."""
        held, given = (None, None) if self.pins is None else self.pins.at(region, spacing)
        return Asked(self._make_demand(region, spacing), held, given)

    def _make_demand(self, region: Region, spacing: int) -> Demand | None:
        """Return the values that a level should have: means of the guide's map, or of the given values."""
        if self.maps is not None and self.weight:
            mine, theirs = self.maps
            points = _pool(np.ones((*theirs.shape[:-1], 1), np.float32), region.shape, spacing)
            wished = np.asarray(_pool(theirs, region.shape, spacing) / np.maximum(points, 1), np.float32)
            everywhere = np.full(region.points, self.weight, np.uint16)
            return Demand(_code(_shrink(mine, spacing)), _code(wished), everywhere)
        if self.mask is None or self.values is None or not self.mask.any():
            return None
        wanted = _as_channels(self.values, self.image)
        total = _pool(wanted * self.mask[..., np.newaxis], region.shape, spacing)
        count = _pool(self.mask[..., np.newaxis].astype(np.float32), region.shape, spacing)
        mean = np.asarray(total / np.maximum(count, 1), np.float32)
        weight = np.where(count[..., 0] > 0, WEIGHT, 0).astype(np.uint16)
        small = _shrink(_as_channels(self.image, self.image), spacing)
        return Demand(_code(small), _code(mean), weight.reshape(-1))


def average_points(values: Array, shape: tuple[int, ...], spacing: int) -> Array:
    """Return the mean of the output points that each point of a level covers. The last point also covers the rest."""
    sizes = [np.diff([*_find_starts(n, m, spacing), m]) for n, m in zip(shape, values.shape, strict=True)]
    return np.asarray(_pool(values, shape, spacing) / np.maximum(np.multiply.outer(*sizes), 1))


# --- checks ----------------------------------------------------------------------------------------------------------


def _check_coordinates(given: Array, mask: Bools, image: Array) -> Floats:
    axes = mask.ndim
    places, wanted = np.asarray(given), (*mask.shape, axes)
    if places.dtype.kind not in "iuf" or places.shape != wanted:
        raise InvalidInput(
            f"coordinates: must be numbers of shape {wanted}, got {places.dtype} of shape {places.shape}"
        )
    inside = (places >= 0) & (places <= np.array(image.shape[:axes]) - 1)
    if not inside[mask].all():
        raise InvalidInput("coordinates: must be finite and inside the exemplar at the points of mask")
    return np.where(mask[..., np.newaxis], places, 0).astype(np.float32)


def _check_values(given: object, mask: Bools, image: Array) -> Array:
    values, wanted = np.asarray(given), (*mask.shape, image.shape[-1])
    if values.dtype != image.dtype or values.shape not in (wanted, wanted[:-1] if wanted[-1] == 1 else wanted):
        raise InvalidInput(
            f"values: must be {image.dtype} (the dtype of the exemplar) of shape {wanted}, got {values.dtype} of shape "
            f"{values.shape}"
        )
    values = values.reshape(wanted)
    if values.dtype.kind == "f" and not np.isfinite(values[mask]).all():
        raise InvalidInput("values: must be finite at the points of mask")
    return np.where(mask[..., np.newaxis], values, np.zeros((), values.dtype))


def _check_maps(guide: Guide, mine: tuple[int, ...], theirs: tuple[int, ...]) -> tuple[Floats, Floats]:
    maps = []
    for given, name, shape in ((guide.exemplar, "exemplar", mine), (guide.output, "output", theirs)):
        try:
            maps.append(np.broadcast_to(np.asarray(given), shape).astype(np.float64))
        except ValueError:
            raise InvalidInput(
                f"guide: the map of the {name} must contain numbers and broadcast to shape {shape}, got shape "
                f"{np.shape(given)}"
            ) from None
    low, span = maps[0].min(), float(np.ptp(maps[0])) or 1.0
    first, second = (np.asarray(np.clip((m - low) / span, 0, 1)[..., np.newaxis], np.float32) for m in maps)
    return first, second


# --- from level to level ---------------------------------------------------------------------------------------------


def _as_channels(values: Array, image: Array) -> Floats:
    """Return up to four channels, scaled so that the exemplar's range is 0 to 1."""
    low = image.reshape(-1, image.shape[-1]).min(axis=0).astype(np.float64)
    span = float((image.reshape(-1, image.shape[-1]).max(axis=0) - low).max()) or 1.0
    return np.asarray((values[..., :4].astype(np.float64) - low[:4]) / span, np.float32)


def _code(values: Floats) -> NDArray[np.int16]:
    """Return values from 0 to 1 as four 12-bit integers per point."""
    flat = values.reshape(-1, values.shape[-1])
    out = np.zeros((len(flat), 4), np.int16)
    out[:, : flat.shape[1]] = np.clip(np.rint(flat * 2047), -2048, 2047)
    return out.reshape(-1)


def _find_starts(count: int, length: int, spacing: int) -> NDArray[np.intp]:
    """Return the first output coordinate that each point of a level covers, along an axis."""
    return np.minimum(np.arange(count) * spacing, length - 1)


def _pool(values: Floats, shape: tuple[int, ...], spacing: int) -> Floats:
    """Sum output values over the points that each point of a level covers."""
    for axis, n in enumerate(shape):
        values = np.add.reduceat(values, _find_starts(n, values.shape[axis], spacing), axis=axis)
    return values


def _shrink(exemplar: Floats, spacing: int) -> Floats:
    """Average an exemplar's map over the samples of a level. Remaining samples at the ends are left out."""
    axes = exemplar.ndim - 1
    trimmed = exemplar[tuple(slice(0, n // spacing * spacing) for n in exemplar.shape[:axes])]
    for axis in range(axes):
        line = np.moveaxis(trimmed, axis, 0)
        trimmed = np.moveaxis(line.reshape(-1, spacing, *line.shape[1:]).mean(axis=1), 0, axis)
    return np.ascontiguousarray(trimmed, np.float32)

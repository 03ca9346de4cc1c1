"""What is asked of an output beside the texture: points whose values or places are given, and a map to follow."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_float, as_mask
from texrs._engine.appearance import Appearance, Guide
from texrs._engine.pyramid import ONE, Region
from texrs._typing import Array, Bools, Floats
from texrs.errors import InvalidInput
from texrs.kernels.gather import gather

__all__ = ["Hold"]

WEIGHT = 1500
"""Cost of another colour than the given one, in 1/256: a tenth of the range costs about as much as windows that have
nothing to do with each other."""
FOLLOW = 150
"""The same of a map that is followed: there a third of the range costs as much."""


@dataclass(frozen=True, slots=True, eq=False)
class Hold:
    """What is held, over the whole output; nothing where ``mask`` is none. And the two maps that are followed, 0 to 1."""

    image: Array
    mask: Bools | None = None
    values: Array | None = None
    coordinates: Floats | None = None
    followed: tuple[Floats, Floats] | None = None
    weight: int = 0

    @classmethod
    def of(cls, image: Array, shape: tuple[int, ...], held: object, values: object, coordinates: object) -> Hold:
        """Check what a caller gives."""
        if held is None:
            if values is not None or coordinates is not None:
                raise InvalidInput("held: needed with values or coordinates, to say which points they are for")
            return cls(image)
        mask = as_mask(held, "held", shape)
        if (values is None) == (coordinates is None):
            raise InvalidInput("held: needs either values or coordinates of the held points")
        axes = len(shape)
        if coordinates is not None:
            places = np.asarray(coordinates)
            if places.dtype.kind not in "iuf" or places.shape != (*shape, axes):
                raise InvalidInput(
                    f"coordinates: needs numbers of shape {(*shape, axes)}, got {places.dtype} {places.shape}"
                )
            inside = (places >= 0) & (places <= np.array(image.shape[:axes]) - 1)
            if not inside[mask].all():
                raise InvalidInput("coordinates: those of held points must lie inside the exemplar and be finite")
            places = np.where(mask[..., np.newaxis], places, 0).astype(np.float32)
            return cls(image, mask, gather(image, places, interpolation="nearest"), places)
        given = np.asarray(values)
        wanted = (*shape, image.shape[-1])
        if given.dtype != image.dtype or given.shape not in (wanted, wanted[:-1] if wanted[-1] == 1 else wanted):
            raise InvalidInput(
                f"values: needs {image.dtype} of shape {wanted}, as the exemplar has, got {given.dtype} {given.shape}"
            )
        given = given.reshape(wanted)
        if given.dtype.kind == "f" and not np.isfinite(given[mask]).all():
            raise InvalidInput("values: those of held points must be finite")
        return cls(image, mask, np.where(mask[..., np.newaxis], given, np.zeros((), given.dtype)))

    def following(self, guide: object, strength: float, shape: tuple[int, ...]) -> Hold:
        """Add maps of the exemplar and of the output, of which the one is to show what the other says."""
        weight = round(FOLLOW * as_float(strength, "guide_weight", 0, 100))
        if guide is None:
            return self
        if self.values is not None and self.coordinates is None:
            raise InvalidInput("guide: cannot be followed where values are held; give coordinates, or leave one out")
        if not isinstance(guide, tuple | list) or len(guide) != 2:
            raise InvalidInput("guide: needs two maps, of the exemplar and of the output")
        axes = len(shape)
        maps = [
            _followed(g, name, s)
            for g, name, s in zip(guide, ("exemplar", "output"), (self.image.shape[:axes], shape), strict=True)
        ]
        low, span = maps[0].min(), float(np.ptp(maps[0])) or 1.0
        mine, theirs = (np.asarray(np.clip((m - low) / span, 0, 1)[..., np.newaxis], np.float32) for m in maps)
        return replace(self, followed=(mine, theirs), weight=weight)

    @property
    def count(self) -> int:
        """Number of held points."""
        return 0 if self.mask is None else int(self.mask.sum())

    def shown(self, composite: Array) -> Array:
        """Return the picture with the held values, exactly."""
        if self.mask is None or self.values is None or self.coordinates is not None:
            return composite
        result = composite.copy()
        result[self.mask] = self.values.reshape(*self.mask.shape, -1)[self.mask].reshape(result[self.mask].shape)
        return result

    def guide(self, appearance: Appearance, region: Region, spacing: int) -> Guide | None:
        """Ask for the held values at a level: the mean of those that a point of the level stands for."""
        if self.followed is not None and self.weight:
            mine, theirs = self.followed
            points = _pooled(np.ones((*theirs.shape[:-1], 1), np.float32), region, spacing)
            wished = np.asarray(_pooled(theirs, region, spacing) / np.maximum(points, 1), np.float32)
            everywhere = np.full(region.points, self.weight, np.uint16)
            return Guide(_coded(_shrunk(mine, appearance.shape, spacing)), _coded(wished), everywhere)
        if self.mask is None or self.values is None or not self.mask.any():
            return None
        exemplar = _channels(self.image, self.image)
        wanted = _channels(self.values.reshape(*self.mask.shape, -1), self.image)
        total = _pooled(wanted * self.mask[..., np.newaxis], region, spacing)
        count = _pooled(self.mask[..., np.newaxis].astype(np.float32), region, spacing)
        mean = np.asarray(total / np.maximum(count, 1), np.float32)
        weight = np.where(count[..., 0] > 0, WEIGHT, 0).astype(np.uint16)
        small = _shrunk(exemplar, appearance.shape, spacing)
        return Guide(_coded(small), _coded(mean), weight.reshape(-1))

    def fixed(self, region: Region, spacing: int) -> Bools | None:
        """Return which points of a level keep their places."""
        if self.mask is None or self.coordinates is None:
            return None
        return (_pooled(self.mask[..., np.newaxis].astype(np.float32), region, spacing)[..., 0] > 0).reshape(-1)

    def place(self, places: NDArray[np.int32], region: Region, spacing: int) -> NDArray[np.int32]:
        """Return held points of a level the places that are given."""
        fixed = self.fixed(region, spacing)
        if fixed is None or self.coordinates is None or self.mask is None:
            return places
        axes = len(region.shape)
        # The first held point that a point of the level stands for speaks for it.
        at = np.argwhere(self.mask)[::-1]
        held = self.coordinates[self.mask][::-1]
        out = places.reshape(-1, axes).copy()
        index = np.ravel_multi_index(tuple(np.minimum(at // spacing, np.array(region.shape) - 1).T), region.shape)
        out[index] = np.rint(((held + 0.5) / spacing - 0.5) * ONE).astype(np.int32)
        return out.reshape(-1)


def _followed(given: object, name: str, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Check a map: finite numbers that broadcast to a shape."""
    values = np.asarray(given)
    try:
        whole = np.broadcast_to(values, shape)
    except ValueError:
        whole = None
    if whole is None or values.dtype.kind not in "biuf" or not np.isfinite(values).all():
        raise InvalidInput(
            f"guide: the map of the {name} needs finite numbers that broadcast to {shape}, "
            f"got {values.dtype} {values.shape}"
        )
    return whole.astype(np.float64)


def _channels(values: Array, image: Array) -> Floats:
    """Return up to four channels in units of the exemplar's range."""
    low = image.reshape(-1, image.shape[-1]).min(axis=0).astype(np.float64)
    span = float((image.reshape(-1, image.shape[-1]).max(axis=0) - low).max()) or 1.0
    return np.asarray((values[..., :4].astype(np.float64) - low[:4]) / span, np.float32)


def _coded(values: Floats) -> NDArray[np.int16]:
    """Return values in [0, 1] as four numbers of 12 bits each."""
    flat = values.reshape(-1, values.shape[-1])
    out = np.zeros((len(flat), 4), np.int16)
    out[:, : flat.shape[1]] = np.clip(np.rint(flat * 2047), -2048, 2047)
    return out.reshape(-1)


def _pooled(values: Floats, region: Region, spacing: int) -> Floats:
    """Sum values of the output over the points of a level."""
    for axis, n in enumerate(region.shape):
        starts = np.minimum(np.arange(n) * spacing, values.shape[axis] - 1)
        values = np.add.reduceat(values, starts, axis=axis)
    return values


def _shrunk(exemplar: Floats, shape: tuple[int, ...], spacing: int) -> Floats:
    """Return the mean of the samples that a sample of a level stands for."""
    trimmed = exemplar[tuple(slice(0, n * spacing) for n in shape)]
    for axis, n in enumerate(shape):
        line = np.moveaxis(trimmed, axis, 0)
        trimmed = np.moveaxis(line.reshape(n, spacing, *line.shape[1:]).mean(axis=1), 0, axis)
    return np.ascontiguousarray(trimmed, np.float32)

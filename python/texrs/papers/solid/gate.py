"""The trial that "optimise" must pass: it straightens lattices and walls, but on other textures it washes rare things out."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from texrs import volume
from texrs._engine.pyramid import Region
from texrs._typing import Array, Floats
from texrs.fields import Field
from texrs.kernels.gather import gather
from texrs.source_map import SourceMap

__all__ = ["Trial", "choose_trial_region"]

SHARE = 0.15
"""How far the share of each class of colours may stray."""
FREQUENCY = 0.1
"""How far the mean frequency may stray."""
USE = 15.0
"""How often the most used cell of the exemplar may be shown, over the mean."""


@dataclass(frozen=True, slots=True)
class Trial:
    """What a trial gave. Frequency and shares are relative to the exemplar's."""

    shares: list[float]
    frequency: float
    most_used: float

    @property
    def accepted(self) -> bool:
        """Whether nothing is lost."""
        return (
            all(abs(s - 1) <= SHARE for s in self.shares)
            and abs(self.frequency - 1) <= FREQUENCY
            and self.most_used <= USE
        )

    def report(self) -> dict[str, object]:
        """Return the figures as JSON types."""
        return asdict(self) | {"accepted": self.accepted}

    @classmethod
    def of(cls, image: Array, coordinates: Floats, field: Field | None) -> Trial:
        """Judge a grown region by the exemplar, whose own samples are looked up: interpolation changes shares too."""
        axes = coordinates.shape[-1]
        shown = gather(image, coordinates, interpolation="nearest")
        found = volume.classes(image, axes=axes)
        count = len(found.centres)
        shares = [
            np.bincount(found.of(seen, axes=axes).ravel(), minlength=count) / (seen.size // seen.shape[-1])
            for seen in (image, shown)
        ]
        relative = shares[1] / np.maximum(shares[0], 1e-12)
        window = max(16, min(*image.shape[:axes], *shown.shape[:axes], 64))
        fine = [
            volume.frequency(volume.lightness(seen, axes=axes), window=window, whole=field is not None and axes == 3)
            for seen in (image, shown)
        ]
        used = volume.cell_reuse(SourceMap.from_coordinates(coordinates, image.shape[:axes])).most_used
        return cls([round(float(r), 4) for r in relative], round(fine[1] / max(fine[0], 1e-12), 4), round(used, 2))


def choose_trial_region(region: Region, image: Array) -> Region:
    """Return the middle of a region, no larger than the exemplar: what a trial is made on, under the field as it is there."""
    shape, origin = [], []
    for n, first, most in zip(region.shape, region.origin, image.shape, strict=False):
        side = min(n, max(most, 32))
        shape.append(side)
        origin.append(first + (n - side) // 2)
    return Region(tuple(shape), tuple(origin), (False,) * len(shape))

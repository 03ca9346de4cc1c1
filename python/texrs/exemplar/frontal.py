"""Prepare an exemplar seen from the front, with elements of one size, for covering curved surfaces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Floats
from texrs.exemplar.adjacency import Adjacency, measure_adjacency
from texrs.exemplar.atlas import pack, resize
from texrs.exemplar.separate_elements import Instances, find_instances
from texrs.exemplar.sheet import FINE, FLAT, MOST, OPEN, Copies, measure_seen, round_frames

__all__ = ["Frontal"]

SMALLEST = 32
"""Minimum number of samples of the shorter side after reduction."""


@dataclass(frozen=True, eq=False)
class Frontal(Copies):
    """An exemplar seen from the front, in its own size or reduced.

    Its patches are bent to the size and direction that the surface requires.

    Attributes
    ----------
    size : float
        Scale of the exemplar's elements.

    """

    size: float

    weight, guide, excess, heal = 0.0, 0.0, 256, True

    @classmethod
    def over(cls, colours: Floats, size: float, target: Floats) -> Frontal:
        """Resize an exemplar to the resolution that a target requires."""
        shape = (colours.shape[0], colours.shape[1])
        finest = float(np.sqrt(np.prod(np.quantile(target, [FINE, 1 - FINE])))) / size
        factor = min(1.0, max(finest, SMALLEST / min(shape)), float(np.sqrt(MOST / np.prod(shape))))
        (copy,) = pack([(factor, (0, shape[0], 0, shape[1]))], 1)
        return cls(
            shape,
            resize(colours, copy),
            np.zeros(copy.shape, np.float32),
            np.ones(copy.shape, np.bool_),
            (copy,),
            np.zeros(copy.shape, np.uint16),
            size,
        )

    def analyse(self) -> tuple[Instances | None, Adjacency]:
        """Find the elements and the costs of neighbouring colours at the resolution of the sheet."""
        return find_instances(self.colours, OPEN), measure_adjacency(self.colours, OPEN)

    def describe(self) -> dict[str, Any]:
        """Return the kind of the sheet and its resolution, as JSON types."""
        return {"kind": "front", "resolution": round(float(np.sqrt(np.prod(self.copies[0].factor))), 5)}

    def side(self, target: Floats) -> float:
        """Return the side of a patch in samples, as a share of the sheet's side.

        The side does not depend on ``target``, because patches are warped to follow the surface.
        """
        return FLAT * float(np.sqrt(self.free.size))

    def bend(self, jacobians: NDArray[np.float64], target: Floats) -> NDArray[np.int16]:
        """Return the Jacobians of an output that shows a surface, in samples of the sheet, in fixed point."""
        return round_frames(jacobians * (self.size * np.array(self.copies[0].factor)[:, np.newaxis]))

    def measure_error(self, places: NDArray[np.int32], target: Floats, frames: NDArray[np.int16]) -> float:
        """Return the median error of log scales, weighted by the area of the exemplar that each pixel shows."""
        return measure_seen(places, frames)

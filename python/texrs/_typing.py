"""Type names that appear in signatures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from os import PathLike
from typing import Any, Literal, Protocol, TypeAlias, runtime_checkable

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[Any]
Floats: TypeAlias = NDArray[np.float32]
Bools: TypeAlias = NDArray[np.bool_]
Labels: TypeAlias = NDArray[np.int32]
Matrix: TypeAlias = tuple[tuple[float, float], tuple[float, float]]
"""Linear map in two dimensions, given by its rows."""
Path: TypeAlias = str | PathLike[str]
Interpolation: TypeAlias = Literal["nearest", "linear", "cubic"]
Progress: TypeAlias = Callable[[str, float], object]
"""Function that is called with the name of the stage and its completed share, 0 to 1.

An exception that it raises stops the work.
"""


@runtime_checkable
class Frames(Protocol):
    """Object that gives a frame at each point of a grid, as in `texrs.fields`."""

    axes: int

    def lattice(self, shape: Sequence[int], *, origin: Any = 0, step: float = 1) -> Floats:
        """Return the Jacobians (..., A, A) at the points of a grid of the given shape."""

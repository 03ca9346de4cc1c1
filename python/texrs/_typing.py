"""Names for the types that appear in signatures."""

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
"""Linear map of two axes, as rows."""
Path: TypeAlias = str | PathLike[str]
Interpolation: TypeAlias = Literal["nearest", "linear", "cubic"]
Progress: TypeAlias = Callable[[str, float], object]
"""Called with the name of the stage and its completed share. An exception stops the work."""


@runtime_checkable
class Frames(Protocol):
    """A frame for each point of a lattice, as in `texrs.fields`."""

    axes: int

    def lattice(self, shape: Sequence[int], *, origin: Any = 0, step: float = 1) -> Floats:
        """Return the Jacobians (..., A, A) of a lattice of that shape."""

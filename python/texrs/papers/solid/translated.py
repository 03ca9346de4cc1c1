"""Fields with coordinates relative to a window of an unbounded texture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs.fields import Field

__all__ = ["Translated"]


@dataclass(frozen=True, eq=False, repr=False)
class Translated(Field):
    """A field whose coordinates are relative to the first voxel of a window."""

    field: Field
    by: tuple[int, ...]

    @property
    def axes(self) -> int:  # type: ignore[override]
        """Number of axes of the field."""
        return self.field.axes

    @property
    def _rigid(self) -> bool:  # type: ignore[override]
        return self.field._rigid

    def _frames(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.field._frames(points + self.by)

    def _content(self) -> tuple[Any, ...] | None:
        return None if self.field.key is None else (self.field.key, self.by)

    def describe(self) -> str:
        """Return the words for the field and the window's origin."""
        return f"{self.field.describe()}; seen from ({', '.join(map(str, self.by))})"

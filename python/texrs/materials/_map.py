"""One map of a material: its values, what it is for, and how it encodes light."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from texrs._colours import Space
from texrs._typing import Array
from texrs.materials._roles import Role

__all__ = ["Map", "Space", "find_space"]


def find_space(role: Role, dtype: np.dtype[Any]) -> Space:
    """Return how a file of this dtype encodes a map of this role: integers of colours are sRGB, all else is linear."""
    return "srgb" if role.coloured and dtype.kind in "ui" else "linear"


@dataclass(frozen=True, slots=True, eq=False)
class Map:
    """One map of a material.

    Attributes
    ----------
    pixels : (H, W), (H, W, C), (D, H, W) or (D, H, W, C) array
        Its values, in any dtype that a picture may have.
    role : Role
        What it is for.
    space : {"srgb", "linear"}
        How its values encode light: integers of colours are sRGB, all else is linear, unless something else is said.

    Examples
    --------
    >>> import numpy as np
    >>> import texrs
    >>> one = texrs.Material({"height": np.zeros((8, 8), np.float32)})["height"]
    >>> one.role.value, one.space
    ('height', 'linear')

    """

    pixels: Array
    role: Role
    space: Space

    @property
    def depth(self) -> int:
        """Bits of each sample."""
        return 1 if self.pixels.dtype == np.bool_ else 8 * self.pixels.itemsize

    @property
    def channels(self) -> int:
        """How many values each pixel has."""
        return 1 if self.pixels.ndim == 2 else self.pixels.shape[-1]

    def __repr__(self) -> str:
        """Return the role, the size and the dtype."""
        sides = " x ".join(map(str, self.pixels.shape))
        return f"<{self.role.value} map of {sides}, {self.pixels.dtype}, {self.space}>"

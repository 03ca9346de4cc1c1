"""One map of a material: its pixels, role and colour encoding."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from texrs._colours import Space
from texrs._typing import Array
from texrs.materials._roles import CODED, Role

__all__ = ["Map", "Space", "find_space", "split_channels", "take_channels"]


def find_space(role: Role, dtype: np.dtype[Any]) -> Space:
    """Return the usual encoding of a map in a file: "srgb" for integer colours, "linear" for everything else."""
    return "srgb" if role.coloured and dtype.kind in "ui" else "linear"


@dataclass(frozen=True, slots=True, eq=False)
class Map:
    """Map of a material: its pixels, its role and its encoding.

    Attributes
    ----------
    pixels : (H, W), (H, W, C), (D, H, W) or (D, H, W, C) array
        Pixels, of any dtype that images can have.
    role : Role
        Role of the map, such as colour, normal or height.
    space : {"srgb", "linear"}
        Encoding of the values. Files usually have "srgb" for integer colours, and "linear" for everything else.
    file : str
        Name, without the suffix, of the file that the map was read from, and to which it is written again. Empty for a
        map from an array. Default: "".
    layer : tuple of str
        Full names of the channels in the EXR file that the map was read from, such as ``"ViewLayer.Depth.Z"``. The map
        is written to channels of the same names. Default: ().

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
    file: str = ""
    layer: tuple[str, ...] = ()

    @property
    def depth(self) -> int:
        """Number of bits per sample."""
        return 1 if self.pixels.dtype == np.bool_ else 8 * self.pixels.itemsize

    @property
    def channels(self) -> int:
        """Number of channels, including alpha."""
        return 1 if self.pixels.ndim == 2 else self.pixels.shape[-1]

    def __repr__(self) -> str:
        """Return a description with the role, size and dtype."""
        sides = " x ".join(map(str, self.pixels.shape))
        return f"<{self.role.value} map of {sides}, {self.pixels.dtype}, {self.space}>"


def take_channels(each: Map, first: int, last: int, role: Role) -> Map:
    """Return a range of channels as a map with another role."""
    return replace(each, pixels=np.ascontiguousarray(each.pixels[..., first:last]), role=role)


def split_channels(each: Map, axes: int) -> list[Map]:
    """Split a map into groups of channels that are processed in the same way: normals, codes, or other values.

    Most maps are one group. The fourth channel of packed data is not an alpha channel, so it is a group of its own.
    """
    count = each.pixels.shape[-1] if each.pixels.ndim > axes else 1
    if not (each.role.packed or each.role.bare):
        return [each]
    coded = [channel < len(each.role.layout) and each.role.layout[channel] in CODED for channel in range(count)]
    first = 0
    parts = []
    if each.role.normal:
        first = 2
        parts.append(take_channels(each, 0, 2, Role.NORMAL_DX_XY if each.role.down else Role.NORMAL_XY))
    elif count > 2 and not any(coded):
        first = 3
        parts.append(take_channels(each, 0, 3, each.role))
    for channel in range(first, count):
        parts.append(take_channels(each, channel, channel + 1, Role.LABELS if coded[channel] else Role.OTHER))
    return parts if len(parts) > 1 else [each]

"""What a material is shown and written as."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from texrs.errors import InvalidInput
from texrs.materials._map import Map

__all__ = ["Exports"]


class Exports(Mapping[str, Map]):
    """Maps in register that can be shown and written."""

    @property
    @abstractmethod
    def axes(self) -> int:
        """2 for pictures, 3 for volumes."""

    def preview(
        self, *, tiles: tuple[int, int] = (2, 2), light: tuple[float, float] = (135.0, 45.0), side: int = 2048
    ) -> NDArray[np.uint8]:
        """Return a picture of the material under a light, seen from straight above.

        Colours, normals (heights where there are none), roughness, metal, occlusion, emission and opacity all count; without
        colours the surface is grey. A flat, dull surface shows its own colours; what is transparent is shown over squares.

        Parameters
        ----------
        tiles : (int, int)
            How often the material is shown, down and across: more than once shows whether it wraps.
        light : (float, float)
            Where the light comes from, in degrees: counter-clockwise from the right, which makes 135 the upper left; and how
            high above the surface, 1 to 90.
        side : int
            Pixels that the longer side of the picture may have; what is larger is averaged.

        Returns
        -------
        (H, W, 3) uint8 array
            sRGB.

        Raises
        ------
        InvalidInput
            A volume, or something else that cannot be shown.

        Examples
        --------
        >>> import texrs
        >>> pebbles = texrs.samples.pebbles((64, 64)).image
        >>> stones = texrs.Material({"albedo": pebbles, "height": pebbles[..., 1]})
        >>> stones.preview().shape, stones.preview(tiles=(1, 3), side=96).shape
        ((128, 128, 3), (32, 96, 3))

        """
        from texrs.materials._preview import render_preview

        self._check_flat()
        return render_preview(self, tiles, light, side)

    def _check_flat(self) -> None:
        if self.axes != 2:
            raise InvalidInput("material: is a volume; pictures are shown, such as a slice of it")

"""An unbounded texture as maps that can be read in parts."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from texrs._cache import content_hash
from texrs._chunks.grid import Box, as_sides
from texrs._chunks.parts import InParts, Part
from texrs._chunks.reading import Channel
from texrs._typing import Array
from texrs.errors import InvalidInput
from texrs.exemplar import Exemplar
from texrs.materials import Material
from texrs.papers.solid.ranges import MAX_COORDINATE, as_origin

__all__ = ["Endless"]

IMAGE = "image"
"""Name of the only map of a texture that is made from an array."""


class Endless(InParts):
    """An unbounded texture that can be read in parts of any size, chunk by chunk."""

    @property
    @abstractmethod
    def exemplar(self) -> Exemplar:
        """Exemplar of the texture."""

    @property
    @abstractmethod
    def material(self) -> Material | None:
        """Material of the texture, if it is made from one."""

    @property
    @abstractmethod
    def key(self) -> str | None:
        """Digest of all data that determine the texture, or None if it cannot be computed."""

    @abstractmethod
    def __getitem__(self, index: Any) -> Array:
        """Return a window of the texture, as an array."""

    @abstractmethod
    def _look_up(self, origin: Sequence[int], size: Sequence[int], names: Sequence[str]) -> Material:
        """Return the given maps of a material in a window."""

    def _read_part(self, origin: int | Sequence[int], shape: int | Sequence[int]) -> Part:
        """Return the reader of a part, after checking that the part is within the allowed coordinates."""
        start, sides = as_origin(origin, self.axes), as_sides(shape, "shape", self.axes)
        if any(o + n > MAX_COORDINATE for o, n in zip(start, sides, strict=True)):
            raise InvalidInput(
                f"origin, shape: the window must end at coordinates of at most {MAX_COORDINATE}, got {start} and {sides}"
            )
        return Part(_Windows(self, start), start, IMAGE if self.material is None else self.material.base_name)


@dataclass(frozen=True)
class _Windows:
    """Reader of parts of a texture, with indices relative to an origin."""

    texture: Endless
    origin: tuple[int, ...]

    @property
    def maps(self) -> Mapping[str, Channel]:
        """Maps of the material, or the only map."""
        texture = self.texture
        if texture.material is None:
            image = texture.exemplar.image
            return {IMAGE: Channel.of(image, texture.axes, labelled=texture.exemplar.labels)}
        return {
            name: Channel.of(each.pixels, texture.axes, labelled=each.role.labelled)
            for name, each in texture.material.items()
        }

    @property
    def key(self) -> str | None:
        """Digest of the texture and the origin, or None if the texture does not have a key."""
        return None if self.texture.key is None else content_hash(self.texture.key, self.origin).hex()

    def read(self, box: Box, names: Sequence[str]) -> Mapping[str, Array]:
        """Return the given maps in a box of indices."""
        start = tuple(s.start + o for s, o in zip(box, self.origin, strict=True))
        size = tuple(s.stop - s.start for s in box)
        if self.texture.material is None:
            there = tuple(slice(a, a + n) for a, n in zip(start, size, strict=True))
            return {IMAGE: np.asarray(self.texture[there])}
        return {name: each.pixels for name, each in self.texture._look_up(start, size, names).items()}

"""A source map as an array in chunks: each is looked up when it is asked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from texrs._cache import content_hash
from texrs._chunks.grid import Box
from texrs._chunks.reading import Channel
from texrs._typing import Array

__all__ = ["IMAGE", "Lookups"]

IMAGE = "image"


@dataclass(frozen=True)
class Lookups:
    """Reads parts of what exemplars look like through a source map."""

    look_up: Callable[[Box], Array]
    channel: Channel
    content: tuple[Any, ...] = field(repr=False)

    @property
    def maps(self) -> Mapping[str, Channel]:
        """The one there is."""
        return {IMAGE: self.channel}

    @property
    def key(self) -> str | None:
        """Digest of the map, the exemplars and the options."""
        return content_hash(*self.content).hex()

    def read(self, box: Box, names: Sequence[str]) -> Mapping[str, Array]:
        """Return a part."""
        return {IMAGE: self.look_up(box)}

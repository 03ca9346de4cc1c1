"""Interface of the sources of chunked arrays: objects that return any box of their maps, in any process."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from texrs._chunks.grid import Box
from texrs._typing import Array

__all__ = ["Channel", "Reader"]


@dataclass(frozen=True, slots=True)
class Channel:
    """Dtype and channels of a map, which are known before any chunk is computed.

    Attributes
    ----------
    dtype : numpy.dtype
        Dtype of the values.
    channels : tuple of int
        Number of channels as a tuple, or an empty tuple if the map has no channel axis.
    labelled : bool
        If True, the values are classes, which cannot be averaged.

    """

    dtype: np.dtype[Any]
    channels: tuple[int, ...] = ()
    labelled: bool = False

    @classmethod
    def of(cls, image: Array, axes: int, *, labelled: bool = False) -> Channel:
        """Return the description of a map that has the dtype and channels of an image. A bool image is labelled."""
        return cls(image.dtype, image.shape[axes:], labelled or image.dtype == np.bool_)


class Reader(Protocol):
    """Source of several maps of the same size. It can be pickled."""

    @property
    def maps(self) -> Mapping[str, Channel]:
        """Description of each map, by name."""

    @property
    def key(self) -> str | None:
        """Digest of everything that determines the values, or None if it cannot be computed."""

    def read(self, box: Box, names: Sequence[str]) -> Mapping[str, Array]:
        """Return a box of the maps with the given names."""

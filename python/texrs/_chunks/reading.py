"""What arrays in chunks are read from: anything that gives any part of its maps, in any process."""

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
    """What is known of a map before any of it is made.

    Attributes
    ----------
    dtype : numpy.dtype
        Of its values.
    channels : tuple of int
        Their number, or nothing where there is no such axis.
    labelled : bool
        Whether the values are classes, of which there is no mean.

    """

    dtype: np.dtype[Any]
    channels: tuple[int, ...] = ()
    labelled: bool = False

    @classmethod
    def of(cls, image: Array, axes: int, *, labelled: bool = False) -> Channel:
        """Return what is known of a map that is like an image."""
        return cls(image.dtype, image.shape[axes:], labelled or image.dtype == np.bool_)


class Reader(Protocol):
    """Gives parts of maps that are in register; it can be pickled."""

    @property
    def maps(self) -> Mapping[str, Channel]:
        """What there is, by name."""

    @property
    def key(self) -> str | None:
        """Digest of all that decides the values; None where that cannot be known."""

    def read(self, box: Box, names: Sequence[str]) -> Mapping[str, Array]:
        """Return a part of some maps."""

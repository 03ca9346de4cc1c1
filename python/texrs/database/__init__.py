"""A folder of analysed textures, and what can be spliced from it."""

from __future__ import annotations

from texrs.database._folder import Record
from texrs.database._textures import Matrix, TextureDatabase

__all__ = ["Matrix", "Record", "TextureDatabase"]

"""Database: a folder of analysed textures that can be spliced with each other."""

from __future__ import annotations

from texrs.database._folder import Record
from texrs.database._textures import Matrix, TextureDatabase

__all__ = ["Matrix", "Record", "TextureDatabase"]

"""Store analysed textures in a folder, and splice them with each other."""

from __future__ import annotations

from texrs.database._folder import Record
from texrs.database._textures import Matrix, TextureDatabase

__all__ = ["Matrix", "Record", "TextureDatabase"]

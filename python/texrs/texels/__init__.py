"""Texels: where the repeated elements of a texture are, and what belongs to them (Liu et al. 2009, section 3)."""

from __future__ import annotations

from texrs.texels._analyse import analyse
from texrs.texels._entry import Tag, Texels

__all__ = ["Tag", "Texels", "analyse"]

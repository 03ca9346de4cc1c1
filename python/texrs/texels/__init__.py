"""Texels: where the repeated elements of a texture are, and what belongs to them (Liu et al. 2009, section 3).

`analyse` finds them, from a box around one and a few places between them, or by itself; `load` reads what
`Texels.save` wrote. `Texels.of_sample` takes over what is known of a generated texture.
"""

from __future__ import annotations

from texrs.texels._analyse import analyse
from texrs.texels._entry import Tag, Texels
from texrs.texels._file import FORMAT, digest, load
from texrs.texels._pictures import pictures

__all__ = ["FORMAT", "Tag", "Texels", "analyse", "digest", "load", "pictures"]

"""Elements: where the repeated elements of a texture are, and what belongs to them (Liu et al. 2009, section 3).

`analyse` finds them, from a box around one and a few places between them, or by itself; `load` reads what
`Elements.save` wrote. `Elements.of_sample` takes over what is known of a generated texture.
"""

from __future__ import annotations

from texrs.elements._analyse import analyse
from texrs.elements._elements import FORMAT, Elements, Tag, digest, load
from texrs.elements._pictures import pictures

__all__ = ["FORMAT", "Elements", "Tag", "analyse", "digest", "load", "pictures"]


def __dir__() -> list[str]:
    return __all__

"""Elements: where the repeated elements of a texture are, and what belongs to them (Liu et al. 2009, section 3).

`analyse` finds them, from a box around one and a few places between them, or by itself; `correct` puts right what it got
wrong, and `to_html` shows it; `load` reads what `ElementAnalysis.save` wrote. `ElementAnalysis.of_sample` takes the truth of a
generated texture. `ElementAnalysis.instances` are the elements one by one, and `ElementAnalysis.arrangement` is how they lie.
`Layout` is how they are connected, and `ElementSearch` how they are looked for.
"""

from __future__ import annotations

from texrs.elements._analyse import analyse
from texrs.elements._arrangement import Arrangement
from texrs.elements._corrections import correct
from texrs.elements._drawn_stages import draw
from texrs.elements._elements import FORMAT, ElementAnalysis, hash_image, load
from texrs.elements._instances import Instance
from texrs.elements._layout import Layout, LayoutName
from texrs.elements._options import ElementSearch
from texrs.elements._page import to_html

__all__ = [
    "FORMAT",
    "Arrangement",
    "ElementAnalysis",
    "ElementSearch",
    "Instance",
    "Layout",
    "LayoutName",
    "analyse",
    "correct",
    "draw",
    "hash_image",
    "load",
    "to_html",
]


def __dir__() -> list[str]:
    return __all__

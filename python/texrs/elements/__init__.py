"""Analyse the repeated elements of a texture: their positions and pixels (Liu et al. 2009, section 3).

`analyse` finds the elements automatically, or from a box around one of them and a few points of the background.
`correct` corrects its mistakes, and `to_html` shows the result. `load` reads a file that `ElementAnalysis.save` wrote.
`ElementAnalysis.of_sample` uses the known elements of a generated texture. `ElementAnalysis.instances` lists the
elements one by one, and `ElementAnalysis.arrangement` describes their positions. `Layout` specifies how elements are
connected, and `ElementSearch` specifies the search for them.
"""

from __future__ import annotations

from texrs.elements._analyse import analyse
from texrs.elements._arrangement import Arrangement
from texrs.elements._corrections import correct
from texrs.elements._drawn_stages import draw
from texrs.elements._elements import FORMAT, ElementAnalysis, hash_image, load
from texrs.elements._layout import Layout, LayoutName
from texrs.elements._options import ElementSearch
from texrs.elements._page import to_html
from texrs.elements.instances import Instance

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

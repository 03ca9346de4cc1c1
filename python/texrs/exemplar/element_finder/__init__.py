"""Find the elements of an image: separate ones, heaps, jointed cells, and the meshes of nets.

1. *Contours*: the strength of contours from local histograms of code words, and dark and light lines.
2. *Leaves*: regions of a watershed of the strength.
3. *Trees*: leaves are merged in several orders. Every node is a candidate, also with its holes filled.
4. *Quality*: each candidate is rated by its outline and its shape.
5. *Choice*: the best disjoint set of candidates, among several usual sizes and readings of lines.
6. *Consensus*: the chosen candidates support those that look like them, and the choice is made again.
7. *Marks*: elements that are known by strokes are kept, or grow from them.
8. *Outlines*: minimum cuts in bands around the first outlines, at the full size.
9. *Layout*: from the contact of elements and the gaps between them. For heaps, the overlaps are also found.
"""

from __future__ import annotations

from texrs.exemplar.element_finder._finder import Element, FoundElements, find_elements
from texrs.exemplar.element_finder._layout_class import Arrangement
from texrs.exemplar.element_finder._overlaps import Overlap

__all__ = ["Arrangement", "Element", "FoundElements", "Overlap", "find_elements"]


def __dir__() -> list[str]:
    return __all__

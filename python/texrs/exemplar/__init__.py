"""Represent an exemplar: its pixels, features, elements, lattice, colour layers and resized copies."""

from texrs.exemplar import element_finder
from texrs.exemplar._exemplar import Exemplar, as_exemplar
from texrs.exemplar.analysis import Analysis
from texrs.exemplar.regularity import Lattice
from texrs.exemplar.segmentation import ElementOptions, Segmentation, segment

__all__ = [
    "Analysis",
    "ElementOptions",
    "Exemplar",
    "Lattice",
    "Segmentation",
    "as_exemplar",
    "element_finder",
    "segment",
]


def __dir__() -> list[str]:
    return __all__

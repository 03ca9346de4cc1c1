"""Represent an exemplar: its pixels, features, elements, lattice, colour layers and resized copies."""

from types import ModuleType

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


def __getattr__(name: str) -> ModuleType:
    """Load the element finder on first use, because it loads SciPy."""
    if name != "element_finder":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    import texrs.exemplar.element_finder as finder

    return finder


def __dir__() -> list[str]:
    return __all__

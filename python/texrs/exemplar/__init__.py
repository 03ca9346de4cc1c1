"""What an exemplar is: its pixels, the channels that guide, features, labels, repeats, layers and scaled copies."""

from texrs.exemplar._exemplar import Exemplar, as_exemplar
from texrs.exemplar.analysis import Analysis, analyse, repeats
from texrs.exemplar.regularity import Lattice
from texrs.exemplar.segmentation import ElementOptions, Segmentation, segment

__all__ = [
    "Analysis",
    "ElementOptions",
    "Exemplar",
    "Lattice",
    "Segmentation",
    "analyse",
    "as_exemplar",
    "repeats",
    "segment",
]


def __dir__() -> list[str]:
    return __all__

"""Looking at volumes, and measuring whether a synthesised one is like its exemplar.

Statistics: `compare` makes a report of them all.
"""

from texrs.volume.compare import Comparison, compare
from texrs.volume.reuse import CellReuse, cell_reuse, coherent
from texrs.volume.statistics import (
    Classes,
    Particles,
    autocorrelation,
    classes,
    frequency,
    isolated,
    lightness,
    lineal_path,
    orientation_errors,
    particles,
    seam_planes,
    slice_distances,
    texture_normal,
    two_point,
)

__all__ = [
    "CellReuse",
    "Classes",
    "Comparison",
    "Particles",
    "autocorrelation",
    "cell_reuse",
    "classes",
    "coherent",
    "compare",
    "frequency",
    "isolated",
    "lightness",
    "lineal_path",
    "orientation_errors",
    "particles",
    "seam_planes",
    "slice_distances",
    "texture_normal",
    "two_point",
]

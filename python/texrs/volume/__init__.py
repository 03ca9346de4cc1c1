"""Pictures of volumes, and statistics of how like its exemplar a synthesised one is.

Pictures: `slices`, `oblique`, `cube`, `transparent` (seen through), `turntable`, `Viewer` (a page with sliders); `paint` gives
labels colours, `surface` the triangles around one. `cubes` makes cubes of other voxels.

Statistics, each of which can be used alone, most of them for pictures too; `compare` makes a report of them all:

===========================  ===============================================================
`classes`                    the colours of a texture's materials, and their shares
`two_point` `lineal_path`    how materials lie along the axes
`particles`                  how many pieces of a material there are, and how large
`autocorrelation`            of values along the axes
`frequency`                  how fine a texture is
`orientation_errors`         whether layers lie as a field turns them
`seam_planes` `speckle`      traces of an algorithm: its lattice, and speckle
`slice_distances`            whether each slice has the values of the exemplar
`coherence` `cell_reuse`     which parts of the exemplar are used, in how large pieces
`integrity`                  whether elements are whole, apart, and of one colour
===========================  ===============================================================
"""

from texrs.volume._stretch import cubes
from texrs.volume.compare import Comparison, compare
from texrs.volume.integrity import Integrity, integrity
from texrs.volume.labels import paint, surface
from texrs.volume.pictures import cube, oblique, slices, turntable
from texrs.volume.reuse import CellReuse, cell_reuse, coherence
from texrs.volume.statistics import Classes, Particles, classes, lightness, lineal_path, particles, two_point
from texrs.volume.structure import (
    autocorrelation,
    frequency,
    orientation_errors,
    seam_planes,
    slice_distances,
    speckle,
    texture_normal,
)
from texrs.volume.transparent import transparent
from texrs.volume.viewer import Viewer

__all__ = [
    "CellReuse",
    "Classes",
    "Comparison",
    "Integrity",
    "Particles",
    "Viewer",
    "autocorrelation",
    "cell_reuse",
    "classes",
    "coherence",
    "compare",
    "cube",
    "cubes",
    "frequency",
    "integrity",
    "lightness",
    "lineal_path",
    "oblique",
    "orientation_errors",
    "paint",
    "particles",
    "seam_planes",
    "slice_distances",
    "slices",
    "speckle",
    "surface",
    "texture_normal",
    "transparent",
    "turntable",
    "two_point",
]


def __dir__() -> list[str]:
    return __all__

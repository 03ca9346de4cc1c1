"""Images of volumes, and statistics of the similarity of a synthesised volume to its exemplar.

Images: `slices`, `oblique_slice`, `render_block`, `render_volume` (transparent), `turntable` and `Viewer` (a page with
sliders). `label_to_color` gives labels colours, and `extract_surface` returns the triangles around a label. `cubes`
converts other voxels to cubes.

Statistics. Each can be used alone, most of them also for images. `compare` makes a report of all:

===========================  ===============================================================
`classes`                    the colours of a texture's materials, and their shares
`two_point_correlation`      how materials lie along the axes
`lineal_path_function`       how long lines within one material are
`component_statistics`       how many pieces of a material there are, and how large
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
from texrs.volume.labels import extract_surface, label_to_color
from texrs.volume.rendering import oblique_slice, render_block, slices, turntable
from texrs.volume.statistics import (
    Classes,
    ComponentStatistics,
    classes,
    component_statistics,
    lightness,
    lineal_path_function,
    two_point_correlation,
)
from texrs.volume.structure import (
    autocorrelation,
    frequency,
    orientation_errors,
    seam_planes,
    slice_distances,
    speckle,
    texture_normal,
)
from texrs.volume.transparent import render_volume
from texrs.volume.usage import CellReuse, cell_reuse, coherence
from texrs.volume.viewer import Viewer

__all__ = [
    "CellReuse",
    "Classes",
    "Comparison",
    "ComponentStatistics",
    "Integrity",
    "Viewer",
    "autocorrelation",
    "cell_reuse",
    "classes",
    "coherence",
    "compare",
    "component_statistics",
    "cubes",
    "extract_surface",
    "frequency",
    "integrity",
    "label_to_color",
    "lightness",
    "lineal_path_function",
    "oblique_slice",
    "orientation_errors",
    "render_block",
    "render_volume",
    "seam_planes",
    "slice_distances",
    "slices",
    "speckle",
    "texture_normal",
    "turntable",
    "two_point_correlation",
]


def __dir__() -> list[str]:
    return __all__

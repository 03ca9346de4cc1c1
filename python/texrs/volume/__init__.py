"""Render volumes, and measure the similarity of a synthesised volume to its exemplar.

Images: `slices`, `oblique_slice`, `render_block`, `render_volume` (transparent), `turntable` and `Viewer` (a page with
sliders). `label_to_color` gives each label a colour, and `extract_surface` returns the triangles of the surface of a
label. `cubes` converts volumes to cubic voxels.

Statistics: each function can be used alone, and most of them also accept images. `compare` reports all of them:

===========================  ===============================================================
`classes`                    colours of the materials of a texture, and their fractions
`two_point_correlation`      probability that two points at a distance are in a material
`lineal_path_function`       probability that a whole segment is in a material
`component_statistics`       number and sizes of the connected components of a material
`autocorrelation`            correlation of values at a distance along the axes
`frequency`                  mean spectral frequency, which measures how fine a texture is
`orientation_errors`         angles between layers and their directions under a field
`seam_planes` `speckle`      artefacts: steps between planes, and isolated voxels
`slice_distances`            distance between the values of each slice and the exemplar's
`coherence` `cell_reuse`     parts of the exemplar that are used, and sizes of the patches
`integrity`                  whether elements are whole, separate, and of one colour
===========================  ===============================================================
"""

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
from texrs.volume.stretch import cubes
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

# The public names of texrs and their modules. Type checkers read this list, and lazy_loader reads it when texrs is
# imported.
from . import (
    elements,
    errors,
    exemplar,
    fields,
    io,
    kernels,
    layouts,
    limits,
    materials,
    metrics,
    painting,
    planes,
    samples,
    scale_maps,
    stores,
    transforms,
    volume,
)
from ._masks import Mask
from ._threads import threads
from ._version import __version__
from .blending import blend
from .corner_tiles import CornerTiles
from .database import TextureDatabase
from .elements import ElementAnalysis
from .exemplar import ElementOptions, Exemplar
from .extension import extend
from .growth.constraints import Constraints, Guide
from .inpainting import inpaint
from .materials import Material, apply
from .papers.design import DeformationOptions, design, design_variants
from .papers.perspective import perspective
from .papers.solid import solid, synthesize
from .papers.solid.window import PlaneTexture, SolidTexture
from .papers.splice import self_splice, splice
from .planes import Plane, PlaneView
from .rectification import rectify
from .removal import remove
from .source_map import CopyStatistics, RenderOptions, SourceMap
from .synthesis import ResultList, Synthesis
from .tiling import Tiling, check_tiling, tile

__all__ = [
    "Constraints",
    "CopyStatistics",
    "CornerTiles",
    "DeformationOptions",
    "ElementAnalysis",
    "ElementOptions",
    "Exemplar",
    "Guide",
    "Mask",
    "Material",
    "Plane",
    "PlaneTexture",
    "PlaneView",
    "RenderOptions",
    "ResultList",
    "SolidTexture",
    "SourceMap",
    "Synthesis",
    "TextureDatabase",
    "Tiling",
    "__version__",
    "apply",
    "blend",
    "check_tiling",
    "design",
    "design_variants",
    "elements",
    "errors",
    "exemplar",
    "extend",
    "fields",
    "inpaint",
    "io",
    "kernels",
    "layouts",
    "limits",
    "materials",
    "metrics",
    "painting",
    "perspective",
    "planes",
    "rectify",
    "remove",
    "samples",
    "scale_maps",
    "self_splice",
    "solid",
    "splice",
    "stores",
    "synthesize",
    "threads",
    "tile",
    "transforms",
    "volume",
]

"""Make new textures from one example.

The verbs: `design` (many natural textures from one example), `splice` (the texels of one texture in the arrangement of
another) and `self_splice` (in an edited one), `perspective` (texels as large as a map says), `solid` and `synthesize`
(volumes and pictures grown under a frame field), `tile` (any picture made cyclic) and `complete` (holes filled by
example). Each gives a `Synthesis`, whose `SourceMap` looks anything that is in register with the exemplar up in the same
way.
"""

from texrs import analysis, errors, fields, io, kernels, samples, scale_maps, texels, volume
from texrs._rust import VERSION as __version__
from texrs.completion import complete
from texrs.cyclic import tile
from texrs.database import TextureDatabase
from texrs.papers._solid_window import PlaneTexture, SolidTexture
from texrs.papers.design import design
from texrs.papers.perspective import perspective
from texrs.papers.solid import solid, synthesize
from texrs.papers.splice import self_splice, splice
from texrs.report import Synthesis
from texrs.source_map import Reuse, SourceMap
from texrs.texels import Texels
from texrs.threads import threads

__all__ = [
    "PlaneTexture",
    "Reuse",
    "SolidTexture",
    "SourceMap",
    "Synthesis",
    "Texels",
    "TextureDatabase",
    "__version__",
    "analysis",
    "complete",
    "design",
    "errors",
    "fields",
    "io",
    "kernels",
    "perspective",
    "samples",
    "scale_maps",
    "self_splice",
    "solid",
    "splice",
    "synthesize",
    "texels",
    "threads",
    "tile",
    "volume",
]

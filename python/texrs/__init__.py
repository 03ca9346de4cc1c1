"""Make new textures from one example.

The verbs: `design` (many natural textures from one example), `splice` (the elements of one texture in the arrangement of
another) and `self_splice` (in an edited one), `perspective` (elements as large as a map says), `solid` and `synthesize`
(volumes and pictures grown under a frame field), `tile` (any picture made cyclic) and `complete` (holes filled by
example). Each gives a `Synthesis`, whose `SourceMap` looks anything that is in register with the exemplar up in the same
way.
"""

from texrs import elements as elements
from texrs import errors, fields, io, kernels, samples, scale_maps, volume
from texrs._rust import VERSION as __version__
from texrs._threads import threads
from texrs.completion import complete
from texrs.database import TextureDatabase
from texrs.elements import Elements
from texrs.exemplar import analysis
from texrs.papers.design import design
from texrs.papers.perspective import perspective
from texrs.papers.solid import solid, synthesize
from texrs.papers.solid.window import PlaneTexture, SolidTexture
from texrs.papers.splice import self_splice, splice
from texrs.source_map import Reuse, SourceMap
from texrs.synthesis import Synthesis
from texrs.tiling import tile

__all__ = [
    "Elements",
    "PlaneTexture",
    "Reuse",
    "SolidTexture",
    "SourceMap",
    "Synthesis",
    "TextureDatabase",
    "__version__",
    "analysis",
    "complete",
    "design",
    "elements",
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
    "threads",
    "tile",
    "volume",
]

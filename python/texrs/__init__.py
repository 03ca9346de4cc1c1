"""Make new textures from one example.

The verbs: `design` (many natural textures from one example), `splice` (the elements of one texture in the arrangement of
another) and `self_splice` (in an edited one), `perspective` (elements as large as a map says), `solid` and `synthesize`
(volumes and pictures grown under a frame field), `tile` (any picture made cyclic), `inpaint` (holes filled by example),
`rectify` (the flat texture of a plane that was photographed aslant), `extend` (more of such a photograph), `remove` (something
taken out of one) and `blend` (colours corrected so that seams disappear). Each returns a `Synthesis`, whose `SourceMap` looks
anything that is in register with the exemplar up in the same way.

Names are loaded when they are first used; the stub beside this file lists them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

"""Generate new textures from one example.

Each function below synthesises or edits a texture. `design` generates many natural textures from one example. `splice`
puts the elements of one texture into the layout of another, and `self_splice` edits a layout. `perspective` follows a
scale map. `solid` and `synthesize` grow volumes and images that follow a frame field. `tile` makes an image tileable,
and `inpaint` fills holes by example. `rectify` flattens a photographed plane, `extend` enlarges such a photograph, and
`remove` removes an object from it. `blend` corrects colours so that seams disappear. All of them return a `Synthesis`.
Its `SourceMap` applies the result to any array that is aligned with the exemplar.

Names are imported on first use. The stub file next to this module lists them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

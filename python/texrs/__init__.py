"""Make new textures from one example.

Each function below makes or edits a texture. `design` makes many natural textures from one example. `splice` puts the
elements of one texture into the layout of another, and `self_splice` edits a layout. `perspective` follows a scale
map. `solid` and `synthesize` grow volumes and images under a frame field. `tile` makes an image tileable, and
`inpaint` fills holes by example. `rectify` flattens a photographed plane, `extend` enlarges such a photograph, and
`remove` takes an object out of it. `blend` corrects colours so that seams disappear. All return a `Synthesis`. Its
`SourceMap` applies the result to any array in register with the exemplar.

Names are loaded on first use. The stub next to this file lists them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

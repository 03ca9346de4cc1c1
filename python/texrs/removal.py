"""Removal of an object from a photograph: the background is filled in, in the perspective of the plane behind it.

This is `texrs.inpaint` with all options. The plane is found in the known ground. Patches are copied from the ground
only, at the scale of their position, and colours follow the light. Areas off the ground, such as the sky above a
floor, are filled from such areas. Each of several planes is filled from its own pixels.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from texrs._arrays import as_bool, as_float, as_image, as_int, as_ndarray, as_seed, check_work
from texrs._masks import Mask, as_marks, check_share, fade, mark, name_marks, widen
from texrs._progress import answering, listen
from texrs._typing import Array, Progress
from texrs._verbs import takes_materials
from texrs.blending import apply
from texrs.errors import InvalidInput
from texrs.inpainting.planes import Part, add_rest, fill_parts
from texrs.materials import Material
from texrs.planes import Plane, PlaneView
from texrs.planes.choose import as_views, find_grounds, follow_plane
from texrs.synthesis import Synthesis

__all__ = ["remove"]

MARGIN = 1 / 150
"""Growth of a mask, as a share of the shorter side, because outlines are drawn too tightly and objects have soft
edges.
"""
RIM = 1 / 40
"""Width of the band around the mask that seams may use, as a share of the shorter side."""
ELEMENT_WIDTH = 1 / 12
"""Width of this band on planes with separate elements, where elements that the mask cuts are removed as a whole."""


@takes_materials("image")
def remove(
    image: Array | Material,
    mask: Array | Mask | str,
    *,
    view: PlaneView | Plane | Sequence[PlaneView | Plane] | None = None,
    margin: int | None = None,
    boundary_width: int | None = None,
    patch_size: int | None = None,
    screening: float | None = 0.1,
    match_lighting: bool = True,
    seed: int = 0,
    progress: Progress | bool | None = None,
) -> Synthesis:
    """Remove an object from a photograph.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array
        The photograph, of any real dtype, at least 64 pixels a side.
    mask : (H, W) array, path or Mask
        Mask of the object to remove and of its shadow. See `texrs.Mask` for how a mask is read, inverted, grown and
        feathered.
    view : PlaneView or Plane, or a sequence of them, optional
        Position of the plane behind the object in the photograph, as far as it is known. Other properties of the plane
        are found. If the result is uncertain, or the plane is seen from the front, patches are copied without a change
        of scale. Several planes, such as a floor and a wall, are filled separately. Only one of them may lack a
        ground.
    margin : int, optional
        Growth of the mask on all sides in pixels, 0 to 64. Default: 1/150 of the shorter side.
    boundary_width : int, optional
        Width in pixels of the band around the mask that may also change, 0 to 64, so that seams are least visible.
        Only pixels that a seam encloses change. Default: 1/40 of the shorter side, or 1/12 for planes with separate
        elements.
    patch_size : int, optional
        Side of the patches in pixels, from 4 to the shorter side, as in `texrs.inpaint`. Default: as in
        `texrs.inpaint`.
    screening : float, optional
        Weight of the original values in the colour correction of the filled pixels, as in `texrs.inpaint`. None or 0:
        no correction. Default: 0.1.
    match_lighting : bool
        If True, the filled pixels follow gradual changes of light, such as towards a window. The light of the source
        is divided out, and the light of the target is multiplied in. Default: True.
    seed : int
        Seed of the random choices. Default: 0.
    progress : callable or True, optional
        Called as ``progress(stage, share)`` with the completed share of the stage. An exception that it raises stops
        the work. True shows a bar. Default: no reports.

    Returns
    -------
    Synthesis
        The photograph without the object, in its dtype and with its channels. Only the mask, its margin and its
        boundary change. The source map refers to the photograph. The stages are ``"known"``, ``"ground"`` (each plane
        in its own shade), ``"patches"`` and ``"before_blending"``. The report contains the planes that were used,
        and ``"filled"``, the filled share of the image with the margin, 0 to 1.

        Stages:

        - ``known``: The image with the marked part in one colour.
        - ``ground``: The planes, each in its own shade.
        - ``patches``: The patches, each in its own shade.
        - ``before_blending``: The result before colours are corrected.

        Report:

        - ``filled``: Share of the image that was filled, 0 to 1.
        - ``patches``: For each plane, the number of patches.
        - ``replaced_outside``: Number of known pixels that changed.
        - ``boundary_width``: Width of the band that could change, in pixels.
        - ``screening``: Weight of the values in the colour correction.
        - ``match_lighting``: Whether filled pixels follow gradual changes of light.
        - ``seed``: The seed.
        - ``margin``: Pixels that were added around the mask.
        - ``planes``: For each plane: ``plane`` with its slant, tilt and angle of view, and whether it was ``found`` in
          the image.
        - ``ground``: For each plane, the share of the image where it is visible.
        - ``beyond``: Share of the image that was filled without a plane.

    Raises
    ------
    InvalidInput
        If options are out of their ranges, or a mask or ground has another shape. This error is also raised if nothing
        is marked, no source remains, or the plane is described twice.

    Warns
    -----
    UserWarning
        If a plane is found with a confidence below 0.4. It is not used; give corners or angles.

    Examples
    --------
    >>> import numpy as np
    >>> import texrs
    >>> floor = texrs.samples.tilted_discs((128, 128)).image
    >>> mask = np.zeros((128, 128), bool)
    >>> mask[60:90, 50:80] = True
    >>> mended = texrs.remove(floor, mask, view=texrs.PlaneView(slant=35, fov=60))
    >>> bool((mended.image[:40] == floor[:40]).all())
    True

    """
    progress = listen(progress)
    image = as_ndarray(image, "image")
    pixels = as_image(image, minimum=64)
    shape = pixels.shape[0], pixels.shape[1]
    asked = as_marks(mask)
    marked = mark(asked, "mask", shape)
    check_share(marked, "mask", name_marks(asked, "mask"), "remove")
    wide = max(1, round(MARGIN * min(shape))) if margin is None else as_int(margin, "margin", 0, 64)
    rim, element_width = round(RIM * min(shape)), min(64, round(ELEMENT_WIDTH * min(shape)))
    if boundary_width is not None:
        rim = element_width = as_int(boundary_width, "boundary_width", 0, 64)
    screening = as_float(0.0 if screening is None else screening, "screening", 0, 1e6)
    number, follow = as_seed(seed), as_bool(match_lighting, "match_lighting")
    watch = progress or (lambda stage, share: None)
    side = None if patch_size is None else as_int(patch_size, "patch_size", 4, min(shape))
    views = as_views(view)
    settled = [v.settle(shape) for v in views]
    # The margin is replaced completely; the feather fades outside it.
    inner = widen(marked, wide)
    hole = widen(inner, asked.feather)
    if hole.all():
        raise InvalidInput("mask: must leave pixels to copy from, but with its margin it covers the whole photograph")
    check_work("remove", [pixels], shape, "image")
    watch("plane", 0.0)
    with answering(progress, "plane", 0.0):
        grounds = find_grounds(pixels, settled, ~hole, everywhere=False)
        planes = [
            follow_plane(pixels, ground, said, v.fov)
            for v, (said, _), ground in zip(views, settled, grounds, strict=True)
        ]
    watch("plane", 1.0)
    # Each plane is a part with its own pixels, and areas off all planes are other parts.
    parts = add_rest([Part.of(g, plane) for g, (plane, _) in zip(grounds, planes, strict=True)], hole, pixels)
    made = fill_parts(
        pixels,
        hole,
        parts,
        boundary=rim,
        element_width=element_width,
        light=follow,
        patch=side,
        seed=number,
        progress=progress,
    )
    # Store the steps after copying in the source map, so that they can be applied to other maps.
    how = made.finish(screening, (0, 0) if follow else None)
    how |= {"known": (~hole,)} if how else {}
    how |= {"fade": np.rint(255 * fade(inner, asked.feather)).astype(np.uint8)} if asked.feather else {}
    source = made.source.with_finish((False, False), **how)
    result = apply(source, pixels, progress=progress)
    watch("done", 1.0)
    stages = made.show(pixels, hole) | {"before_blending": source.render(pixels)}
    report: dict[str, Any] = {
        "filled": float(hole.mean()),
        "patches": list(made.counts),
        "replaced_outside": int(np.count_nonzero(made.replaced & ~hole)),
        "margin": wide,
        "boundary_width": rim,
        "screening": screening,
        "match_lighting": follow,
        "seed": number,
        "planes": [{"plane": None if plane is None else plane.as_dict(), "found": found} for plane, found in planes],
        "ground": [round(float(ground.mean()), 4) for ground in grounds],
        "beyond": round(float((hole & (made.owner >= len(grounds))).mean()), 6),
    }
    if image.ndim == 2:
        result = result.reshape(shape)
        stages |= {name: stages[name].reshape(shape) for name in ("known", "before_blending")}
    return Synthesis(result, source, stages, report)

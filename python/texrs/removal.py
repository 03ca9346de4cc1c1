"""Something taken out of a photograph: what is behind it is filled in, in the perspective of the plane that is seen there.

Completion with everything on (`texrs.complete`): the plane is found in what is known of the ground, patches are copied from
the ground alone, each as large as things are there, and colours follow the light. What lies beyond the ground, as the sky
above a floor, is filled from what is not ground.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from texrs._arrays import as_float, as_image, as_int, as_mask, as_seed
from texrs._typing import Array, Bools, Progress
from texrs._verbs import takes_materials
from texrs.blending import apply
from texrs.completion import complete
from texrs.completion._holes import widen
from texrs.errors import InvalidInput
from texrs.materials import Material
from texrs.planes import Plane, View, find, find_ground
from texrs.planes._choose import SURE
from texrs.synthesis import Synthesis

__all__ = ["remove"]

MARGIN = 1 / 150
"""By how much a mask is widened, of the shorter side: outlines are drawn too close, and things have soft edges."""
RIM = 1 / 40
"""How far around it seams may run, of the shorter side."""
FLAT = 8.0
"""Degrees of slant up to which a plane is taken for seen from the front."""
LEAST = 0.05
"""Nearer to the horizon than this share of the middle's scale nothing is ground."""
FEWEST = 0.02
"""Share of the photograph that something beside the ground must take for anything to lie behind it."""


@takes_materials("image")
def remove(
    image: Array | Material,
    mask: Array,
    *,
    view: View | Plane | None = None,
    margin: int | None = None,
    boundary: int | None = None,
    patch: int | None = None,
    blend: float | None = 0.1,
    seed: int = 0,
    progress: Progress | None = None,
) -> Synthesis:
    """Take something out of a photograph.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array
        The photograph, any real dtype, each side at least 64.
    mask : (H, W) array
        Not 0 where there is what is to go, its shadow included.
    view : View or Plane, optional
        How the photograph shows the plane that it stands on, as far as that is to be said; what is not is found. Where that
        is not sure, or the plane is seen from the front, things are filled in as large as they are seen anywhere.
    margin : int, optional
        Pixels by which the mask is widened, 0 to 64; by default 1/150 of the shorter side.
    boundary : int, optional
        Pixels around that which may change too, 0 to 64, so that seams run where they show least, between things; by default
        1/40 of the shorter side.
    patch : int, optional
        Side of the patches in pixels, as in `texrs.complete`.
    blend : float, optional
        Weight of the values when the colours of what is filled in are corrected, as in `texrs.complete`; None or 0: no
        correction.
    seed : int
        Chooses among what fits.
    progress : callable, optional
        Called as ``progress(stage, share)``, with the share of the stage that is done; raising stops the work.

    Returns
    -------
    Synthesis
        The photograph without it, in its dtype and with its channels; nothing changes but what is marked, its margin and
        boundary. Its source map leads to the photograph. The stages are ``"known"``, ``"ground"``, ``"patches"`` and
        ``"composite"``. The report has the plane, if one was followed.

    Raises
    ------
    InvalidInput
        Options out of their ranges, a mask or ground of another shape, nothing marked, nothing left, or two ways to say how the
        plane lies.

    Warns
    -----
    UserWarning
        A plane that was found with a confidence below 0.4, and is not followed: give corners, or angles.

    Examples
    --------
    >>> import numpy as np
    >>> import texrs
    >>> floor = texrs.samples.tilted_discs((128, 128)).image
    >>> mask = np.zeros((128, 128), bool)
    >>> mask[60:90, 50:80] = True
    >>> mended = texrs.remove(floor, mask, view=texrs.View(slant=35, fov=60))
    >>> bool((mended.image[:50] == floor[:50]).all())
    True

    """
    pixels = as_image(image, minimum=64)
    shape = pixels.shape[0], pixels.shape[1]
    marked = as_mask(mask, "mask", shape)
    if not marked.any():
        raise InvalidInput("mask: marks nothing, so there is nothing to remove")
    wide = max(1, round(MARGIN * min(shape))) if margin is None else as_int(margin, "margin", 0, 64)
    rim = round(RIM * min(shape)) if boundary is None else as_int(boundary, "boundary", 0, 64)
    screening = as_float(0.0 if blend is None else blend, "blend", 0, 1e6)
    number = as_seed(seed)
    watch = progress or (lambda stage, share: None)
    hole = widen(marked, wide)
    asked = View.of(view)
    said, ground = asked.settle(shape)
    if hole.all():
        raise InvalidInput("mask: with its margin it covers the whole photograph, so nothing is left to fill it from")
    watch("plane", 0.0)
    shown = np.asarray((find_ground(pixels, known=~hole) if ground is None else ground) & ~hole, np.bool_)
    if not shown.any():
        raise InvalidInput("ground: nothing of it is left beside the mask")
    seen, found = follow_plane(pixels, shown, said, asked.fov)
    watch("plane", 1.0)
    width = None if seen is None else seen.scale_map("width")
    on = choose_side(hole, shown, None if width is None else width > LEAST)
    options: dict[str, Any] = {
        "boundary": rim,
        "patch": patch,
        "blend": screening,
        "seed": number,
        "progress": progress,
    }
    made: Synthesis | None = None
    steps = []
    beyond = hole & ~on
    # What is farther away lies behind, and goes on behind what is nearer.
    for part, open_, usable, scale in ((beyond, hole, ~shown & ~hole, None), (on, on, shown, width)):
        if part.any():
            before = pixels if made is None else made.image
            new = complete(before, open_, allowed=usable if usable.any() else None, scale_map=scale, **options)
            source, result = new.source, new.image
            if made is not None:
                source = source.compose(made.source)
                how = {"within": source.label > 0, "known": (~hole,)} if screening else {}
                source = source.finished((False, False), screening=screening or None, **how)
                result = apply(source, pixels)
            made = Synthesis(result, source, new.stages, new.report)
            steps.append(new.report["patches"])
    assert made is not None
    squeeze = np.asarray(image).ndim == 2
    bare = pixels.copy()
    bare[hole] = bare.min() if hole.any() else 0
    report: dict[str, Any] = {
        **made.report,
        "hole": float(hole.mean()),
        "patches": steps,
        "margin": wide,
        "boundary": rim,
        "plane": None if seen is None else seen.as_dict(),
        "found": found,
        "ground": round(float(shown.mean()), 4),
        "beyond": round(float(beyond.mean()), 6),
    }
    composite = made.source.render(pixels, interpolation="cubic")
    stages = {"known": bare, "ground": shown, "patches": made.stages["patches"], "composite": composite}
    result = made.image
    if squeeze:
        result = result.reshape(shape)
        stages["known"], stages["composite"] = bare[..., 0], composite[..., 0]
    return Synthesis(result, made.source, stages, report)


def follow_plane(pixels: Array, ground: Bools, said: Plane | None, fov: float | None) -> tuple[Plane | None, bool]:
    """Return the plane that is said, or found surely enough, and whether it was found; none that is seen from the front."""
    if said is not None:
        return (None if said.slant < FLAT else said), False
    try:
        seen = find(pixels, fov=fov, known=ground)
    except InvalidInput:
        # Too little of it is known.
        return None, False
    if seen.confidence < SURE:
        warnings.warn(
            f"the plane was found with a confidence of {seen.confidence:.2f} of 1, so it is not followed; give the corners "
            "of a rectangle of it, or slant and tilt",
            stacklevel=3,
        )
        return None, False
    return (None, False) if seen.slant < FLAT else (seen, True)


def choose_side(hole: Bools, ground: Bools, before: Bools | None) -> Bools:
    """Mark the part of a hole that lies on the ground: nearer to it than to what is not, and before the horizon."""
    from scipy.ndimage import distance_transform_edt, label

    pieces, _ = label(~ground & ~hole)
    large = np.bincount(pieces.ravel()) >= FEWEST * hole.size
    large[0] = False
    other = large[pieces]
    if not other.any():
        return hole
    nearest = distance_transform_edt(~ground) <= distance_transform_edt(~other)
    on = hole & nearest & (True if before is None else before)
    return np.asarray(on, np.bool_)

"""Use the plane that the user gives, or find the plane in the image."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from texrs._typing import Array, Bools
from texrs.errors import InvalidInput
from texrs.planes._find import find
from texrs.planes._ground import find_ground
from texrs.planes._plane import Plane
from texrs.planes._view import PlaneView
from texrs.planes.sizes import SURE, ScaleEstimate, measure_scale

__all__ = ["SURE", "Seen", "as_views", "find_grounds", "follow_plane", "measure_known_scale", "see"]


FLAT = 8.0
"""Maximum slant in degrees of a plane that is treated as seen from the front."""


@dataclass(frozen=True, slots=True)
class Seen:
    """A plane in a photograph, given by the user or found."""

    plane: Plane
    ground: Bools
    """Mask (H, W) of the pixels that show the plane."""
    found: bool
    """If True, the orientation was found, not given."""


def see(pixels: Array, view: PlaneView) -> Seen:
    """Return the given facts about a plane, and find the missing facts; warn if the plane is uncertain.

    All facts are checked before the search starts.
    """
    said = view.settle(pixels.shape)
    known = np.ones((pixels.shape[0], pixels.shape[1]), np.bool_)
    ground = find_grounds(pixels, [said], known, everywhere=True)[0]
    if said[0] is not None:
        return Seen(said[0], ground, False)
    found = find(pixels, fov=view.fov, known=ground)
    if found.confidence < SURE:
        warnings.warn(
            f"the plane was found with a confidence of {found.confidence:.2f} of 1 (slant {found.slant:.0f}, tilt "
            f"{found.tilt:.0f}); if the result is wrong, give the corners of a rectangle, or slant and tilt",
            stacklevel=3,
        )
    return Seen(found, ground, True)


def follow_plane(pixels: Array, ground: Bools, said: Plane | None, fov: float | None) -> tuple[Plane | None, bool]:
    """Return the plane and whether it was found. None replaces a plane that is uncertain or seen from the front."""
    if said is not None:
        return (None if said.slant < FLAT else said), False
    try:
        seen = find(pixels, fov=fov, known=ground)
    except InvalidInput:
        # Too few pixels are known to find a plane, so treat it as seen from the front.
        return None, False
    if seen.confidence < SURE:
        warnings.warn(
            f"the plane was found with a confidence of {seen.confidence:.2f} of 1, so it is not used; give the corners "
            "of a rectangle on it, or slant and tilt",
            stacklevel=4,
        )
        return None, False
    return (None, False) if seen.slant < FLAT else (seen, True)


def as_views(view: PlaneView | Plane | Sequence[PlaneView | Plane] | None) -> list[PlaneView]:
    """Return the views of one plane or of several planes."""
    if not isinstance(view, Sequence):
        return [PlaneView.of(view)]
    if not view:
        raise InvalidInput("view: must contain at least one plane, got an empty list")
    views = [PlaneView.of(each) for each in view]
    if len(views) > 1 and sum(v.ground is None for v in views) > 1:
        raise InvalidInput("ground: must be given for all but one of several planes; pass a mask for each")
    return views


def find_grounds(
    pixels: Array, settled: Sequence[tuple[Plane | None, Bools | None]], known: Bools, *, everywhere: bool
) -> list[Bools]:
    """Return the mask of each plane: the given mask, or the plane found in the pixels outside the other masks.

    Parameters
    ----------
    pixels : (H, W, C) array
        The image.
    settled : sequence of (Plane, (H, W) bool)
        Known facts about each plane (`PlaneView.settle`). If two masks overlap, the first gets the common pixels.
    known : (H, W) bool
        Mask of the known pixels.
    everywhere : bool
        If True, a plane of known orientation without a mask gets all pixels outside the other masks.

    """
    free, found = known.copy(), []
    # Given masks have priority over found ones, and earlier masks over later ones.
    for _, ground in settled:
        if ground is not None:
            found.append(np.asarray(ground & free, np.bool_))
            free &= ~ground
            if not found[-1].any():
                raise InvalidInput("ground: must have pixels outside the hole and the other planes, got none")
    # The pixels that remain belong to the plane without a mask, or are searched for its ground.
    missing = next((n for n, (_, ground) in enumerate(settled) if ground is None), None)
    if missing is not None:
        if not free.any():
            raise InvalidInput(
                "ground: the other planes leave no pixels for the plane without a mask; pass a mask for it"
            )
        whole = everywhere and settled[missing][0] is not None
        found.insert(missing, free if whole else find_ground(pixels, known=free))
    return found


def measure_known_scale(pixels: Array, known: Bools) -> ScaleEstimate:
    """Return the size of elements at each pixel of an image; warn if it is uncertain."""
    found = measure_scale(pixels, known=known)
    if found.confidence < SURE:
        why = "the measured sizes do not agree, so all elements are assumed to be equally large"
        if found.shape != "even":
            why = "the image is too small for several measurements, so the sizes of light areas are used"
        warnings.warn(
            f"scale_map: no plane was found with confidence, and {why} (confidence {found.confidence:.2f} of 1); if the "
            "result is wrong, give a map",
            stacklevel=3,
        )
    return found

"""The plane that a user says, or the one that is found."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from texrs import scale_maps
from texrs._typing import Array, Bools, Floats
from texrs.errors import InvalidInput
from texrs.planes._find import find
from texrs.planes._ground import find_ground
from texrs.planes._plane import Plane
from texrs.planes._view import View

SURE = 0.4
"""Confidence below which it is said that a plane that was found may be wrong."""


@dataclass(frozen=True, slots=True)
class Seen:
    """A plane in a photograph, as it is said or as it was found."""

    plane: Plane
    ground: Bools
    """(H, W): where the photograph shows it."""
    found: bool
    """Whether nobody said how it lies."""


def see(pixels: Array, view: View) -> Seen:
    """Return what is said of a plane, and what is found where nothing is: all is checked before anything is looked for."""
    said, ground = view.settle(pixels.shape)
    if ground is None:
        ground = find_ground(pixels) if said is None else np.ones((pixels.shape[0], pixels.shape[1]), np.bool_)
    if said is not None:
        return Seen(said, ground, False)
    found = find(pixels, fov=view.fov, known=ground)
    if found.confidence < SURE:
        warnings.warn(
            f"the plane was found with a confidence of {found.confidence:.2f} of 1 (slant {found.slant:.0f}, tilt "
            f"{found.tilt:.0f}); where the result does not look right give the corners of a rectangle, or slant and tilt",
            stacklevel=3,
        )
    return Seen(found, ground, True)


def measure_scale(pixels: Array, known: Bools) -> Floats:
    """Return how large things are at each pixel of a picture: by the plane that is found in it, or by a mask of features."""
    try:
        found = find(pixels, known=known)
    except InvalidInput:
        # Too small, or too little of it is known; a mask may still be found.
        found = None
    if found is not None and found.confidence >= SURE:
        return found.scale_map()
    if found is not None:
        warnings.warn(
            f"scale_map: no plane was found surely (confidence {found.confidence:.2f} of 1), so sizes are measured in what is "
            "lighter than its surroundings; where the result does not look right give a map",
            stacklevel=3,
        )
    return scale_maps.from_mask(scale_maps.auto_mask(pixels, known=known), trend="plane", known=known)

"""The plane that a user says, in one of three ways, or the one that is found."""

from __future__ import annotations

import warnings

import numpy as np

from texrs import scale_maps
from texrs._arrays import as_mask
from texrs._typing import Array, Bools, Floats
from texrs.errors import InvalidInput
from texrs.planes._find import find
from texrs.planes._ground import find_ground
from texrs.planes._plane import FOV, Plane

SURE = 0.4
"""Confidence below which it is said that a plane that was found may be wrong."""


def choose_ground(pixels: Array, ground: object, *said: object) -> Bools:
    """Return where the picture shows the plane: as is given, or found where nothing is said of how the plane lies."""
    size = pixels.shape[0], pixels.shape[1]
    if ground is not None:
        return as_mask(ground, "ground", size)
    return find_ground(pixels) if all(s is None for s in said) else np.ones(size, np.bool_)


def choose_plane(
    pixels: Array,
    ground: Bools,
    plane: Plane | None,
    corners: object,
    slant: float | None,
    tilt: float | None,
    fov: float | None,
) -> tuple[Plane, bool]:
    """Return the plane that was given in one of three ways, or the one that is found, and whether it was."""
    size = pixels.shape[0], pixels.shape[1]
    ways = {"plane": plane, "corners": corners, "slant": slant}
    given = [name for name, value in ways.items() if value is not None]
    if len(given) > 1:
        raise InvalidInput(f"{given[1]}: {given[0]} says how the plane lies already")
    if tilt is not None and slant is None:
        raise InvalidInput("tilt: needs slant")
    if plane is not None:
        if not isinstance(plane, Plane) or plane.shape != size:
            raise InvalidInput(f"plane: needs a texrs.Plane of a picture of {size[0]} x {size[1]}, got {plane!r}")
        if fov is not None:
            raise InvalidInput("fov: the plane has one already")
        return plane, False
    if corners is not None:
        return Plane.of_corners(size, np.asarray(corners, np.float64), fov=fov), False
    if slant is not None:
        return Plane(size, slant, 90.0 if tilt is None else tilt, FOV if fov is None else fov), False
    found = find(pixels, fov=fov, known=ground)
    if found.confidence < SURE:
        warnings.warn(
            f"the plane was found with a confidence of {found.confidence:.2f} of 1 (slant {found.slant:.0f}, tilt "
            f"{found.tilt:.0f}); where the result does not look right give the corners of a rectangle, or slant and tilt",
            stacklevel=3,
        )
    return found, True


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

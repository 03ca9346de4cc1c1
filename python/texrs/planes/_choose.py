"""The plane that a user says, or the one that is found."""

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
from texrs.planes._sizes import SURE, ScaleEstimate, measure_scale
from texrs.planes._view import PlaneView

__all__ = ["SURE", "Seen", "as_views", "find_grounds", "follow_plane", "measure_known_scale", "see"]


FLAT = 8.0
"""Degrees of slant up to which a plane is taken for seen from the front."""


@dataclass(frozen=True, slots=True)
class Seen:
    """A plane in a photograph, as it is said or as it was found."""

    plane: Plane
    ground: Bools
    """(H, W): where the photograph shows it."""
    found: bool
    """Whether nobody said how it lies."""


def see(pixels: Array, view: PlaneView) -> Seen:
    """Return what is said of a plane, and what is found where nothing is, with a warning where that is not sure.

    All is checked before anything is looked for.
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
            f"{found.tilt:.0f}); where the result does not look right give the corners of a rectangle, or slant and tilt",
            stacklevel=3,
        )
    return Seen(found, ground, True)


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
            stacklevel=4,
        )
        return None, False
    return (None, False) if seen.slant < FLAT else (seen, True)


def as_views(view: PlaneView | Plane | Sequence[PlaneView | Plane] | None) -> list[PlaneView]:
    """Return what is said of one plane, or of each of several."""
    if not isinstance(view, Sequence):
        return [PlaneView.of(view)]
    if not view:
        raise InvalidInput("view: needs at least one, got an empty list")
    views = [PlaneView.of(each) for each in view]
    if len(views) > 1 and sum(v.ground is None for v in views) > 1:
        raise InvalidInput("ground: of several planes all but one need one, for they are told apart by that")
    return views


def find_grounds(
    pixels: Array, settled: Sequence[tuple[Plane | None, Bools | None]], known: Bools, *, everywhere: bool
) -> list[Bools]:
    """Return where the picture shows each plane: as is given, or as is found in what the others leave.

    Parameters
    ----------
    pixels : (H, W, C) array
        The picture.
    settled : sequence of (Plane, (H, W) bool)
        What is said of each plane (`PlaneView.settle`). Of two grounds that overlap the first counts.
    known : (H, W) bool
        Where the picture says anything.
    everywhere : bool
        Whether a plane is seen in all that the others leave where it is said how it lies.

    """
    free, found = known.copy(), []
    for _, ground in settled:
        if ground is not None:
            found.append(np.asarray(ground & free, np.bool_))
            free &= ~ground
            if not found[-1].any():
                raise InvalidInput("ground: nothing of it is left beside what is to be filled, and other planes")
    missing = next((n for n, (_, ground) in enumerate(settled) if ground is None), None)
    if missing is not None:
        if not free.any():
            raise InvalidInput("ground: the others leave nothing for the plane whose ground is not said")
        whole = everywhere and settled[missing][0] is not None
        found.insert(missing, free if whole else find_ground(pixels, known=free))
    return found


def measure_known_scale(pixels: Array, known: Bools) -> ScaleEstimate:
    """Return how large things are at each pixel of a picture, with a warning where that is not sure."""
    found = measure_scale(pixels, known=known)
    if found.confidence < SURE:
        why = "what was measured in several ways has little in common, so all things are taken to be equally large"
        if found.shape != "even":
            why = "there is too little to measure in more than one way, so sizes are those of what is lighter than around it"
        warnings.warn(
            f"scale_map: no plane was found surely, and {why} (confidence {found.confidence:.2f} of 1); where the result does "
            "not look right give a map",
            stacklevel=3,
        )
    return found

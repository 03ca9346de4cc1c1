"""Preparation of the exemplar for an output: the sheet to cut patches from, and its view (see the verb's departures)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import atan, cos

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import power_single
from texrs._typing import Floats
from texrs.exemplar.atlas import LARGEST, SMALLEST
from texrs.exemplar.frontal import Frontal
from texrs.exemplar.sheet import Copies, Flattened, Sheet, find_plane, multiply
from texrs.papers.perspective.request import Request
from texrs.papers.perspective.sizes import Outside, bring_within, choose_sizes
from texrs.planes._projective import find_focal
from texrs.scale_maps._slope import LEVEL, Slope

__all__ = ["PreparedExemplar", "lay_out"]


@dataclass(frozen=True, slots=True, eq=False)
class PreparedExemplar:
    """A prepared exemplar.

    Attributes
    ----------
    sheet : Sheet
        Sheet that patches are cut from.
    target : (rows, columns) float32
        Requested size of elements, in the units of the sheet.
    wanted : (rows, columns) float32
        The same as the caller requested it, if given.
    frames : (points, 2, 2) int16, optional
        View of the sheet. None if the target determines it.
    outside : Outside
        Requested scales that do not exist.
    sizes : sequence of float
        Sizes of the copies, or the possible sizes of a plane.

    """

    sheet: Sheet
    target: Floats
    wanted: Floats
    frames: NDArray[np.int16] | None
    outside: Outside
    sizes: tuple[float, ...]


def lay_out(asked: Request) -> PreparedExemplar:
    """Prepare an exemplar for the requested output."""
    colours = asked.exemplar.guidance
    plane = find_slope(asked, colours)
    if asked.surface is not None:
        return lay_under(asked, turned(asked, asked.surface), colours, plane)
    if asked.turn is not None and plane is None and is_frontal(asked):
        large = asked.target.astype(np.float64)[..., np.newaxis, np.newaxis]
        return lay_under(asked, asked.turn / large, colours, None)
    if plane is not None:
        asked = asked.match_kinds(plane.power)
    sizes = choose_sizes(asked.scale, asked.target, asked.sizes, plane)
    wanted, outside = bring_within(asked.scale, asked.target, sizes)
    sheet: Sheet
    if plane is None:
        target, sheet = wanted, Copies.of(colours, asked.scale, sizes, wanted)
    else:
        # From here on scales are widths.
        target = power_single(wanted, plane.power)
        sheet = Flattened.of(colours, plane, target)
    frames = None if asked.turn is None else sheet.frames(target, asked.wrap, asked.turn)
    return PreparedExemplar(sheet, target, wanted, frames, outside, sizes)


def lay_under(asked: Request, surface: NDArray[np.float64], colours: Floats, plane: Slope | None) -> PreparedExemplar:
    """Prepare an exemplar for a surface: its plane flattened, the image as it is from the front, or copies."""
    areas = asked.target.astype(np.float64)
    front = plane is None and is_frontal(asked)
    scale, target, power = asked.scale, asked.target, 1.0
    if plane is not None:
        # Elements on a plane have an area for each width. Request the width with the requested area.
        scale, power = power_single(scale, plane.power), 1.5
        target = np.cbrt(areas * areas * (plane.scale / plane.lean)).astype(np.float32)
    sizes = (1.0, SMALLEST, LARGEST) if front else choose_sizes(scale, target, asked.sizes, plane)
    held, outside = bring_within(scale, target, sizes)
    # If elements of this size do not exist, move the surface nearer or farther away.
    share = np.power(target.astype(np.float64) / held, power)[..., np.newaxis, np.newaxis]
    shown = np.where(share == 1, surface, surface * share)
    wanted = (areas / share[..., 0, 0]).astype(np.float32)
    sheet: Sheet
    if plane is not None:
        sheet = Flattened.of(colours, plane, held)
    elif front:
        sheet = Frontal.over(colours, float(np.median(scale)), held)
    else:
        sheet = Copies.of(colours, scale, sizes, held)
    return PreparedExemplar(sheet, held, wanted, sheet.bend(shown, held), outside, sizes)


def turned(asked: Request, surface: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a surface with a rotated texture."""
    return surface if asked.turn is None else multiply(asked.turn, surface)


def is_frontal(asked: Request) -> bool:
    """Return whether an exemplar may be resized and has elements of one size."""
    free = asked.strength > 0 and asked.sizes in (True, "auto")
    return free and float(asked.scale.max()) < LEVEL * float(asked.scale.min())


def find_slope(asked: Request, colours: Floats) -> Slope | None:
    """Return the plane of an exemplar: the given one, or the plane of its scale map."""
    if asked.strength == 0 or asked.sizes not in (True, "auto"):
        return None
    if asked.plane is not None:
        return asked.plane.as_slope()
    found = find_plane(colours, asked.scale, asked.kinds[0])
    if found is None:
        return None
    # A map of widths does not determine lengths, but the angle of view does.
    lean = cos(atan(found.slope / found.scale * find_focal(asked.exemplar.shape, asked.fov)))
    return replace(found, lean=lean)

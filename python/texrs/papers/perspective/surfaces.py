"""Prepare the exemplar for an output: the sheet that patches are cut from, and how the output shows it."""

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
from texrs.papers.perspective.request import Perspective
from texrs.papers.perspective.sizes import Outside, bring_within, choose_sizes
from texrs.planes.projective import find_focal
from texrs.scale_maps.slope import LEVEL, Slope

__all__ = ["PreparedExemplar", "lay_out"]


@dataclass(frozen=True, slots=True, eq=False)
class PreparedExemplar:
    """An exemplar as a sheet of patches, with the sizes that the output requests.

    Attributes
    ----------
    sheet : Sheet
        Sheet that patches are cut from.
    target : (rows, columns) float32
        Requested size of elements, in the units of the sheet.
    wanted : (rows, columns) float32
        Requested size of elements in the units of the caller's target, limited to the available scales.
    frames : (points, 2, 2) int16, optional
        Jacobians of the sheet at each point of the output. None if ``target`` determines them.
    outside : Outside
        Part of the requested scales that is not available.
    sizes : sequence of float
        Sizes of the copies, or the possible sizes of a plane, relative to the exemplar.

    """

    sheet: Sheet
    target: Floats
    wanted: Floats
    frames: NDArray[np.int16] | None
    outside: Outside
    sizes: tuple[float, ...]


def lay_out(asked: Perspective) -> PreparedExemplar:
    """Prepare the sheet of an exemplar for the requested output."""
    colours = asked.exemplar.guidance
    plane = find_slope(asked, colours)
    if asked.surface is not None:
        return lay_under(asked, turned(asked, asked.surface), colours, plane)
    if asked.turn is not None and plane is None and is_frontal(asked):
        large = asked.wanted.astype(np.float64)[..., np.newaxis, np.newaxis]
        return lay_under(asked, asked.turn / large, colours, None)
    if plane is not None:
        asked = asked.match_kinds(plane.power)
    sizes = choose_sizes(asked.scale, asked.wanted, asked.augment_scales, plane)
    wanted, outside = bring_within(asked.scale, asked.wanted, sizes)
    sheet: Sheet
    if plane is None:
        target, sheet = wanted, Copies.of(colours, asked.scale, sizes, wanted)
    else:
        # If the exemplar shows a plane, convert the target from scales to widths, which the flattened sheet requires.
        target = power_single(wanted, plane.power)
        sheet = Flattened.of(colours, plane, target)
    frames = None if asked.turn is None else sheet.frames(target, asked.wrap, asked.turn)
    return PreparedExemplar(sheet, target, wanted, frames, outside, sizes)


def lay_under(
    asked: Perspective, surface: NDArray[np.float64], colours: Floats, plane: Slope | None
) -> PreparedExemplar:
    """Prepare an exemplar for a surface: as a flattened plane, a frontal image, or copies in several sizes."""
    areas = asked.wanted.astype(np.float64)
    front = plane is None and is_frontal(asked)
    scale, target, power = asked.scale, asked.wanted, 1.0
    if plane is not None:
        # On a plane, the area of an element determines its width, so convert the requested areas to widths.
        scale, power = power_single(scale, plane.power), 1.5
        target = np.cbrt(areas * areas * (plane.scale / plane.lean)).astype(np.float32)
    sizes = (1.0, SMALLEST, LARGEST) if front else choose_sizes(scale, target, asked.augment_scales, plane)
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


def turned(asked: Perspective, surface: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the Jacobians of a surface after the texture is rotated as requested."""
    return surface if asked.turn is None else multiply(asked.turn, surface)


def is_frontal(asked: Perspective) -> bool:
    """Return whether an exemplar can be resized and has elements of one size."""
    free = asked.scale_weight > 0 and asked.augment_scales in (True, "auto")
    return free and float(asked.scale.max()) < LEVEL * float(asked.scale.min())


def find_slope(asked: Perspective, colours: Floats) -> Slope | None:
    """Return the plane of an exemplar: the given one, or the plane of its scale map."""
    if asked.scale_weight == 0 or asked.augment_scales not in (True, "auto"):
        return None
    if asked.found[0] is not None:
        return asked.found[0].as_slope()
    found = find_plane(colours, asked.scale, asked.kinds[0])
    if found is None:
        return None
    # A map of widths does not determine lengths along the slope, which also depend on the angle of view.
    lean = cos(atan(found.slope / found.scale * find_focal(asked.exemplar.shape, asked.view)))
    return replace(found, lean=lean)

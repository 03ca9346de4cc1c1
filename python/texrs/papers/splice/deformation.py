"""Deform a texture so that its elements move to their targets, in `texrs.papers.splice` (section 4.2).

Disjoint elements move by whole pixels without deformation, and displacements are interpolated between them. A
connected figure gets the shape of least energy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools
from texrs.elements import ElementAnalysis, Layout
from texrs.papers.splice.energy import minimise_energy
from texrs.papers.splice.interpolation import interpolate
from texrs.papers.splice.matching import Match
from texrs.papers.splice.texture_extension import Extension

__all__ = ["Deformation", "deform", "deform_by_energy", "find_rigid_shifts", "mark_removed"]

SHRINKAGE = 0.9
"""Share of the distance to the middle of their element that erased pixels move."""


@dataclass(frozen=True, slots=True, eq=False)
class Deformation:
    """The extended texture after its deformation.

    Attributes
    ----------
    target : (H, W, 2) float64
        Position of each pixel in the output.
    rigid : (H, W) bool
        True for pixels of parts that keep their shape.
    removed : (H, W) bool
        True for pixels that are not drawn.

    """

    target: NDArray[np.float64]
    rigid: Bools
    removed: Bools


def deform(a: ElementAnalysis, match: Match) -> Deformation:
    """Compute where each pixel of the extended texture moves."""
    if a.layout != Layout.DISJOINT:
        return deform_by_energy(a, match)
    extension = match.extension
    shift = interpolate(*_list_constraints(match))
    # In a splice, do not erase the background around removed elements, because it is stretched over their places. Each
    # erased pixel would leave a hole of many pixels.
    removed = mark_removed(extension, match.assigned, grown=int(extension.originals > 0))
    return Deformation(_add_places(shift, extension.origin), extension.instance > 0, removed)


def deform_by_energy(a: ElementAnalysis, match: Match) -> Deformation:
    """Compute where each pixel moves by Eq. 5. The rigid parts are the foreground of a net, or the joints of a wall."""
    extension, jointed = match.extension, a.layout == Layout.JOINTED
    rigid = ~extension.mask if jointed else extension.mask
    pins = np.rint(match.starts).astype(np.intp) - np.array(extension.origin)
    inside = ((pins >= 0) & (pins < np.array(rigid.shape))).all(axis=1)
    shift = minimise_energy(rigid, pins[inside], match.shift[inside], upright=jointed)
    return Deformation(_add_places(shift, extension.origin), rigid, np.zeros(rigid.shape, bool))


def _add_places(shift: NDArray[np.float64], origin: tuple[int, int]) -> NDArray[np.float64]:
    """Add pixel positions to displacements, in place. The first pixel is at ``origin``."""
    shift[..., 0] += np.arange(origin[0], origin[0] + shift.shape[0])[:, None]
    shift[..., 1] += np.arange(origin[1], origin[1] + shift.shape[1])
    return shift


# --- disjoint elements -----------------------------------------------------------------------------------------------


def _list_constraints(match: Match) -> tuple[Bools, NDArray[np.float32]]:
    """Return True for pixels with a given displacement, and these displacements, (2, H, W).

    All pixels of an element have the same displacement. Erased elements also shrink towards their middle, so that they
    leave a smaller hole. If most of the image stays in place, as in an edit, stray pixels are not moved either.
    """
    extension = match.extension
    still = extension.originals > 0
    number = extension.instance if still else extension.piece
    middle = extension.points if still else np.concatenate([extension.points, extension.stray_points])
    shift = np.zeros((2, len(middle) + 1), np.float32)
    shift[:, 1:] = find_rigid_shifts(match, middle).T
    # Write into the final array, because copies of whole images take longer than the computation.
    given = np.empty((2, *number.shape), np.float32)
    for along, place in zip(shift, given, strict=True):
        along.take(number, out=place, mode="clip")
    if not still:
        idle = np.ones(len(middle) + 1, bool)
        idle[0] = False
        idle[match.assigned + 1] = False
        gone = np.flatnonzero(idle.take(number))
        centre = (middle - extension.origin).take(number.take(gone) - 1, axis=0)
        for axis, at in enumerate(np.divmod(gone, number.shape[1])):
            given[axis].ravel()[gone] += SHRINKAGE * (centre[:, axis] - at)
    return number > 0, given


def find_rigid_shifts(match: Match, points: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
    """Return each element's displacement in whole pixels. Elements without a target move like their neighbours.

    If ``points`` has more points than the extension, these also move like their neighbours.
    """
    from scipy.spatial import cKDTree

    points = match.extension.points if points is None else points
    shift = np.zeros((len(points), 2))
    shift[match.assigned] = np.rint(match.shift)
    idle = np.ones(len(shift), bool)
    idle[match.assigned] = False
    if idle.any():
        count = min(4, len(match.assigned))
        far, near = cKDTree(match.starts).query(points[idle], k=[*range(1, count + 1)])
        weight = 1 / (far**2 + 1e-6)
        mean = (weight[..., None] * shift[match.assigned][near]).sum(axis=1) / weight.sum(axis=1)[:, None]
        shift[idle] = np.rint(mean)
    return shift


def mark_removed(extension: Extension, assigned: NDArray[np.intp], grown: int = 1) -> Bools:
    """Return True for erased pixels: elements without a target and stray pixels, with the pixels around them."""
    from scipy.ndimage import maximum_filter

    used = np.zeros(len(extension.points) + 1, bool)
    used[assigned + 1] = True
    moved = used.take(extension.instance)
    idle = (extension.instance > 0) & ~moved
    # In an edit, stray pixels are erased without the pixels around them.
    gone = idle if extension.originals else idle | extension.stray
    wide = maximum_filter(gone.view(np.uint8), 2 * grown + 1).view(bool) if grown else gone
    return np.asarray((wide | extension.stray) & ~moved)

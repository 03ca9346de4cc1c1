"""The texture deformed so that its elements go where they are matched, in `texrs.papers.splice`: section 4.2.

Disjoint elements move whole, by whole pixels, and what lies between is interpolated. A connected figure takes the shape
of least energy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools
from texrs.elements import ElementAnalysis, Layout
from texrs.papers.splice.energy import minimise_energy
from texrs.papers.splice.extension import Extension
from texrs.papers.splice.interpolation import interpolate
from texrs.papers.splice.matching import Match

__all__ = ["Deformation", "deform", "deform_by_energy", "find_rigid_shifts", "mark_removed"]

SHRINKAGE = 0.9
"""How far what is erased moves towards its middle."""


@dataclass(frozen=True, slots=True, eq=False)
class Deformation:
    """The extended texture, deformed.

    Attributes
    ----------
    target : (H, W, 2) float64
        Where each of its pixels goes, in the output.
    rigid : (H, W) bool
        What keeps its shape.
    removed : (H, W) bool
        What is not drawn.

    """

    target: NDArray[np.float64]
    rigid: Bools
    removed: Bools


def deform(a: ElementAnalysis, match: Match) -> Deformation:
    """Move every pixel of the texture, as its layout says."""
    if a.layout != Layout.DISJOINT:
        return deform_by_energy(a, match)
    extension = match.extension
    shift = interpolate(*_list_constraints(match))
    # Ground beside what shrinks is drawn out over the place of that: a pixel of it less is a hole of many.
    removed = mark_removed(extension, match.assigned, grown=int(extension.originals > 0))
    return Deformation(_add_places(shift, extension.origin), extension.instance > 0, removed)


def deform_by_energy(a: ElementAnalysis, match: Match) -> Deformation:
    """Move every pixel as Eq. 5 says: of a net the foreground is rigid, of elements that are jointed the joints."""
    extension, jointed = match.extension, a.layout == Layout.JOINTED
    rigid = ~extension.mask if jointed else extension.mask
    pins = np.rint(match.starts).astype(np.intp) - np.array(extension.origin)
    inside = ((pins >= 0) & (pins < np.array(rigid.shape))).all(axis=1)
    shift = minimise_energy(rigid, pins[inside], match.shift[inside], upright=jointed)
    return Deformation(_add_places(shift, extension.origin), rigid, np.zeros(rigid.shape, bool))


def _add_places(shift: NDArray[np.float64], origin: tuple[int, int]) -> NDArray[np.float64]:
    """Turn displacements, in place, into where pixels go: the first one lies at the origin."""
    shift[..., 0] += np.arange(origin[0], origin[0] + shift.shape[0])[:, None]
    shift[..., 1] += np.arange(origin[1], origin[1] + shift.shape[1])
    return shift


# --- disjoint elements -----------------------------------------------------------------------------------------------


def _list_constraints(match: Match) -> tuple[Bools, NDArray[np.float32]]:
    """Return what does not go along with the ground, and how far its pixels move, (2, H, W).

    Elements move whole. What is erased shrinks besides towards its middle: it then leaves a smaller hole. But where a picture
    stays itself, nothing moves that is not asked to.
    """
    extension = match.extension
    still = extension.originals > 0
    number = extension.instance if still else extension.piece
    middle = extension.points if still else np.concatenate([extension.points, extension.stray_points])
    shift = np.zeros((2, len(middle) + 1), np.float32)
    shift[:, 1:] = find_rigid_shifts(match, middle).T
    # Where it is to be at once: copies of whole pictures cost more than what is computed here.
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
    """Return the whole pixels that every element moves by; those that go nowhere go along with the ones around them.

    So do further ``points`` that follow those of the extension, where some are given.
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
    """Mark what is erased: elements that go nowhere, and strays, with the pixels around them."""
    from scipy.ndimage import maximum_filter

    used = np.zeros(len(extension.points) + 1, bool)
    used[assigned + 1] = True
    moved = used.take(extension.instance)
    idle = (extension.instance > 0) & ~moved
    # Of a picture that stays itself only what is taken out leaves an outline.
    gone = idle if extension.originals else idle | extension.stray
    wide = maximum_filter(gone.view(np.uint8), 2 * grown + 1).view(bool) if grown else gone
    return np.asarray((wide | extension.stray) & ~moved)

"""Find the source pixel of each output pixel of a deformed texture in `texrs.papers.splice` (Figure 6).

The texture is deformed as a mesh with one vertex per pixel, which is drawn into the output. For previews, and for
edits that list moved points, triangles between the elements are drawn instead.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._progress import stage
from texrs._typing import Bools, Floats, Progress
from texrs.elements import ElementAnalysis, Layout
from texrs.kernels.warp import from_points, mesh
from texrs.papers.splice.deformation import Deformation, deform, deform_by_energy, find_rigid_shifts, mark_removed
from texrs.papers.splice.matching import Match

__all__ = ["BackwardWarp", "warp_backwards"]


@dataclass(frozen=True, slots=True, eq=False)
class BackwardWarp:
    """Result of the backward warp (W_BA): the source of each output pixel in the extended texture.

    Attributes
    ----------
    place : (h, w, 2) intp
        Row and column of the source pixel in the extension.
    known : (h, w) bool
        True for output pixels that have a source.
    target : (H, W, 2) float64
        Position in the output of each pixel of the extension.
    triangles, flipped, flipped_rigid : int
        Number of triangles of the dense mesh, number of flipped triangles, and number of flipped rigid triangles. All
        are 0 without a mesh.

    """

    place: NDArray[np.intp]
    known: Bools
    target: NDArray[np.float64]
    triangles: int = 0
    flipped: int = 0
    flipped_rigid: int = 0


def warp_backwards(
    a: ElementAnalysis, match: Match, size: tuple[int, int], *, method: str | None, listed: bool, progress: Progress
) -> BackwardWarp:
    """Deform the texture and find the source pixel of each output pixel.

    Parameters
    ----------
    a : ElementAnalysis
        The texture.
    match : Match
        Targets of the texture's elements.
    size : (int, int)
        Rows and columns of the output.
    method : {None, "paper", "preview"}
        Algorithm, as for `texrs.splice`.
    listed : bool
        If True, the match is an edit that only lists moved points. Each moved element then changes only the pixels
        around it.
    progress : callable
        Function called as ``progress(stage, share)``.

    """
    if method == "preview":
        return _draw_preview(match, size)
    if method is None and listed and a.layout == Layout.DISJOINT:
        return _draw_elements(match, size)
    if method == "paper":
        return _draw_mesh(deform_by_energy(a, match), size, stage(progress, "warp"))
    progress("deform", 0.0)
    deformation = deform(a, match)
    progress("deform", 1.0)
    return _draw_mesh(deformation, size, stage(progress, "warp"))


def _draw_mesh(
    deformation: Deformation, size: tuple[int, int], progress: Callable[[float], object] | None
) -> BackwardWarp:
    """Draw the rows and columns of the dense mesh that are visible in the output."""
    target, rigid = deformation.target, deformation.rigid
    seen = np.ones(rigid.shape, bool)
    for axis in range(2):
        seen &= (target[..., axis] > -2) & (target[..., axis] < size[axis] + 1)
    part, first = (slice(None), slice(None)), (0, 0)
    if seen.any():
        (top, bottom), (left, right) = (np.flatnonzero(seen.any(axis=1 - a))[[0, -1]].tolist() for a in range(2))
        first = (max(top - 1, 0), max(left - 1, 0))
        part = (slice(first[0], bottom + 2), slice(first[1], right + 2))
    drawn = mesh(target[part], rigid[part], void=deformation.removed[part], size=size, progress=progress)
    place = _find_nearest_pixels(drawn.coordinates, rigid[part].shape) + first
    return BackwardWarp(place, drawn.covered, target, drawn.triangles, drawn.flipped, drawn.flipped_heavy)


def _draw_preview(match: Match, size: tuple[int, int]) -> BackwardWarp:
    """Draw triangles between the matched elements."""
    extension = match.extension
    origin = np.array(extension.origin)
    loose = from_points(match.starts - origin, match.targets, extension.mask.shape, size=size)
    target = np.moveaxis(np.indices(extension.mask.shape), 0, -1) + origin * 1.0
    return BackwardWarp(_find_nearest_pixels(loose.coordinates, extension.mask.shape), loose.triangle > 0, target)


def _draw_elements(match: Match, size: tuple[int, int]) -> BackwardWarp:
    """Draw the background as triangles between the elements, and undeformed elements above it."""
    extension = match.extension
    shape, origin = np.array(extension.mask.shape), np.array(extension.origin)
    shift = find_rigid_shifts(match)
    corners = np.array([[y, x] for y in (0, shape[0] - 1) for x in (0, shape[1] - 1)], float)
    start = np.concatenate([extension.points - origin, corners])
    end = np.concatenate([extension.points + shift, corners + origin])
    loose = from_points(start, end, (int(shape[0]), int(shape[1])), size=size)
    place = _find_nearest_pixels(loose.coordinates, extension.mask.shape)
    ground = (extension.instance == 0) & ~mark_removed(extension, match.assigned)
    known = (loose.triangle > 0) & ground[place[..., 0], place[..., 1]]
    moved = np.zeros((len(shift) + 1, 2), np.intp)
    moved[1:] = shift
    used = np.zeros(len(moved), bool)
    used[match.assigned + 1] = True
    pixels = np.argwhere(used[extension.instance])
    goal = pixels + origin + moved[extension.instance[tuple(pixels.T)]]
    seen = ((goal >= 0) & (goal < np.array(size))).all(axis=1)
    place[tuple(goal[seen].T)] = pixels[seen]
    known[tuple(goal[seen].T)] = True
    target = np.moveaxis(np.indices(extension.mask.shape), 0, -1) + origin + moved[extension.instance] * 1.0
    return BackwardWarp(place, known, target)


def _find_nearest_pixels(coordinates: Floats, shape: tuple[int, ...]) -> NDArray[np.intp]:
    """Round coordinates to the nearest pixels of the texture."""
    places = np.floor(coordinates + np.float32(0.5)).astype(np.intp)
    return np.asarray(np.clip(places, 0, np.array(shape[:2]) - 1), np.intp)

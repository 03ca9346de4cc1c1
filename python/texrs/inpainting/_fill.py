"""Fill one hole: in perspective if a plane is visible, else with patches of the image as it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from texrs._typing import Array, Bools, Floats, Progress
from texrs.exemplar.symmetry import Flip
from texrs.inpainting._depth import fill_in_depth
from texrs.inpainting._patches import fill_with_patches
from texrs.scale_maps.slope import Slope
from texrs.source_map import SourceMap


@dataclass(frozen=True, slots=True, eq=False)
class Filling:
    """An image whose hole is filled, and facts about the filling."""

    source: SourceMap
    side: float
    """Side of the patches in pixels."""
    count: int
    """Number of patches."""
    tried: list[tuple[int, float]]
    """Sides that were tried, each with the visibility of the seams."""
    whole: bool
    """If True, all coordinates are integers."""
    in_step: bool = False
    """Whether patches are in step with a lattice of the image."""


def fill(
    pictures: Sequence[Array],
    open_: Bools,
    wide: Bools,
    *,
    far: Bools | None = None,
    usable: Bools,
    plane: Slope | None,
    scales: Sequence[Floats] | None,
    patch: int | None,
    mirrors: Sequence[Flip],
    wrap: tuple[bool, bool],
    seed: int,
    progress: Progress | None,
) -> Filling:
    """Fill a hole.

    Parameters
    ----------
    pictures : sequence of array
        Image, and another image to copy from if there is one.
    open_, wide : (H, W) bool
        Mask of the hole, and mask of the pixels that may be replaced.
    far : (H, W) bool, optional
        Pixels that may be replaced on a plane with separate elements. Elements that the hole cuts are not copied.
    usable : (H, W) bool
        Mask of the pixels that may be copied.
    plane : Plane, optional
        Plane that patches are copied from and pasted into.
    scales : sequence of (H, W) float32, optional
        Size of the elements. It is used if no plane is known, or only a small part of it.
    patch : int, optional
        Side of the patches, in pixels.
    mirrors : sequence of Flip
        Mirror images that patches are copied from. Planes are not mirrored.
    wrap : (bool, bool)
        Axes along which the image is periodic.
    seed : int
        Seed of the random choices of patches that have no known pixels around them.
    progress : callable, optional
        Function that is called with the stage and its finished share.

    """
    if plane is not None:
        deep = fill_in_depth(
            pictures[0],
            open_,
            plane,
            wide,
            far=far,
            usable=usable,
            side=patch,
            wrap=wrap,
            seed=seed,
            progress=progress,
        )
        if deep is not None:
            source, side, count = deep
            return Filling(source, side, count, [], False)
    source, whole_side, tried, in_step = fill_with_patches(
        pictures,
        open_,
        scales,
        patch,
        ~wide,
        usable=usable,
        mirrors=mirrors,
        wrap=wrap,
        seed=seed,
        watch=progress or (lambda stage, share: None),
    )
    return Filling(source, whole_side, int(source.label.max()), tried, True, in_step)

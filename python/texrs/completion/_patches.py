"""Holes filled with patches of several sizes, of which the best is kept.

What repeats in a picture may be small or large, and only patches of about its size make it whole. A hole takes little time to
fill, so it is filled with patches of several sizes; kept is the one whose seams show least where they end and go on.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from texrs._arrays import as_image, guidance
from texrs._typing import Array, Bools, Floats, Progress
from texrs.completion._judge import Filled, judge_seams
from texrs.errors import InvalidInput
from texrs.exemplar.patches import choose_usual_side, index_patches, mark_corners, place_patches
from texrs.exemplar.symmetry import ALL, NONE
from texrs.kernels.complete import complete as fill
from texrs.source_map import SourceMap

SCALED = np.float32(2.0)
"""Weight of scales as colours that patches are compared by: elements larger by a half are as far off as black from white."""
LEAST = 4
"""Side of the smallest patch that still says anything of a texture."""
PLACES = 64
"""Places to copy from that a patch should have; where it has fewer, smaller patches are taken."""
SIZES = (0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.25, 3.0, 4.0)
"""Sides of patches that are tried, in usual ones."""
WIDEST = 0.3
"""The largest of them is at most this share of the shorter side."""
MANY = 64
"""Only patches are tried of which about so many fill the holes."""
COVERS = 0.4
"""Share of a patch that fills a hole."""
MARGIN = 256
"""Pixels around the holes that patches are copied from."""
PLENTY = 4
"""Known pixels there, in pixels of the holes; where they are fewer, all of the picture is copied from."""


def fill_with_patches(
    pictures: Sequence[Array],
    open_: Bools,
    scales: Sequence[Floats] | None,
    chosen: int | None,
    keep: Bools,
    *,
    mirror: bool,
    wrap: tuple[bool, bool],
    seed: int,
    watch: Progress,
) -> tuple[SourceMap, int, list[tuple[int, float]]]:
    """Fill a hole with patches.

    Returns
    -------
    SourceMap
        Of the picture without holes.
    int
        The side of the patches.
    list of (int, float)
        The sides that were tried, and what the seams of each show.

    """
    shapes = tuple((p.shape[0], p.shape[1]) for p in pictures)
    itself = len(pictures) == 1
    part, cyclic = choose_part(open_, keep, wrap)
    near = [pictures[0][part], *pictures[1:]]
    known, kept = ~open_[part], keep[part]
    guides = guide_together(near)
    if scales is not None:
        pairs = zip(guides, (scales[0][part], *scales[1:]), strict=True)
        guides = [np.concatenate([g, SCALED * np.log(s)[..., np.newaxis]], axis=-1) for g, s in pairs]
    mirrors = ALL if mirror else (NONE,)
    free = known if itself else np.ones(shapes[-1], bool)
    # Where scales differ, those within a large patch do too.
    sizes = SIZES if scales is None else (1.0,)
    sides = list_sides(free, int(np.count_nonzero(~known)), chosen, min(*known.shape, *free.shape), sizes)
    tried: list[tuple[int, float]] = []
    best: tuple[Filled, int] | None = None
    for number, side in enumerate(sides):
        filled = fill(
            guides[0],
            known,
            index_patches(guides[-1], side, mirrors, free),
            patch=side,
            keep=kept,
            wrap=cyclic,
            seed=seed,
            shown=0 if itself else None,
            progress=lambda share, number=number: watch("complete", (number + share) / len(sides)),  # type: ignore[misc]
        )
        new, coordinates, jacobians = place_patches(filled, mirrors, (free.shape[0], free.shape[1]))
        places = np.zeros((*known.shape, 2), np.float32)
        places[new] = coordinates
        frames = np.stack([np.eye(2, dtype=np.float32), *jacobians])
        made = Filled(filled.colours, filled.label + 1, places, frames)
        shown = judge_seams(made, guides[-1], free, cyclic) if len(sides) > 1 else 0.0
        if best is None or shown < min(cost for _, cost in tried):
            best = (made, side)
        tried.append((side, shown))
        if shown == 0:
            break
    if best is None:
        raise AssertionError("one side at least is tried")
    made, side = best
    new = np.nonzero(made.label)
    corner = np.array([p.start for p in part], np.float32)
    source = map_untouched(shapes)
    source.coordinates[part][new] = made.coordinates[new] + (corner if itself else 0)
    source.exemplar[part][new] = len(shapes) - 1
    source.label[part] = made.label
    return SourceMap(source.coordinates, source.exemplar, source.label, made.frames, shapes), side, tried


def choose_part(open_: Bools, keep: Bools, wrap: tuple[bool, bool]) -> tuple[tuple[slice, slice], tuple[bool, bool]]:
    """Return the part of a picture that is looked at, and which of its axes are cyclic: what is around its holes."""
    parts, cyclic = [], []
    for axis, closed in enumerate(wrap):
        side = open_.shape[axis]
        touched = np.flatnonzero(~keep.all(axis=1 - axis) | open_.any(axis=1 - axis))
        low, high = int(touched[0]) - MARGIN, int(touched[-1]) + 1 + MARGIN
        if closed and (low <= 0 or high >= side):
            low, high = 0, side
        low, high = max(0, low), min(side, high)
        parts.append(slice(low, high))
        cyclic.append(closed and high - low == side)
    part = (parts[0], parts[1])
    holes = open_[part]
    if holes.size < (1 + PLENTY) * np.count_nonzero(holes):
        return (slice(0, open_.shape[0]), slice(0, open_.shape[1])), wrap
    return part, (cyclic[0], cyclic[1])


def map_untouched(shapes: tuple[tuple[int, ...], ...]) -> SourceMap:
    """Return the source map of a picture of which nothing is replaced yet."""
    identity = SourceMap.identity(shapes[0])
    return SourceMap(identity.coordinates, identity.exemplar, identity.label, None, shapes)


def guide_together(pictures: Sequence[Array]) -> list[Floats]:
    """Return the colours that patches are compared by, brought to [0, 1] together."""
    pixels = [as_image(p) for p in pictures]
    if len(pixels) == 1:
        return [guidance(pixels[0])]
    lines = guidance(np.concatenate([p.reshape(1, -1, p.shape[-1]) for p in pixels], axis=1))
    found, start = [], 0
    for p in pixels:
        count = p.shape[0] * p.shape[1]
        found.append(np.ascontiguousarray(lines[0, start : start + count].reshape(*p.shape[:2], -1)))
        start += count
    return found


def list_sides(free: Bools, holes: int, chosen: int | None, largest: int, sizes: Sequence[float]) -> list[int]:
    """Return the sides of patches to try: the one asked for, or those about the usual one that have places enough."""
    if chosen is not None:
        if not mark_corners(free, chosen).any():
            fits = next((s for s in range(chosen - 1, LEAST - 1, -1) if mark_corners(free, s).any()), None)
            hint = f"at most {fits} has one" if fits else "nor has any other; give an exemplar"
            raise InvalidInput(f"patch: {chosen} has no place in the image that is free of holes; {hint}")
        return [chosen]
    usual = choose_usual_side(min(free.shape))
    sides = [round(usual * size) for size in sizes]
    most = max(usual, round(WIDEST * min(free.shape)))
    sides = [s for s in sides if s <= min(most, largest) and np.count_nonzero(mark_corners(free, s)) >= PLACES]
    few = [s for s in sides if holes <= MANY * COVERS * s * s] or sides[-1:]
    if few:
        return few
    for side in range(min(largest, usual), LEAST - 1, -1):
        if np.count_nonzero(mark_corners(free, side)) >= PLACES:
            return [side]
    if not mark_corners(free, LEAST).any():
        raise InvalidInput(f"hole: leaves no {LEAST} x {LEAST} pixels in one piece to copy from; give an exemplar")
    return [LEAST]

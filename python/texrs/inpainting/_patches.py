"""Fill holes with patches of several sizes, and keep the best result.

The elements of an image can be small or large, and only patches of about their size reproduce them. A hole takes little time
to fill. It is therefore filled with patches of two very different sizes, and then with sizes near the better one. The result
whose seams are least visible is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, as_rgb, guidance, log_single
from texrs._progress import answering
from texrs._typing import Array, Bools, Floats, Progress
from texrs.errors import InvalidInput
from texrs.exemplar.courses import find_regularity
from texrs.exemplar.patches import choose_usual_side, mark_corners
from texrs.exemplar.symmetry import ALL, NONE, Flip, find_mirrors
from texrs.inpainting._judge import Filled, judge_seams
from texrs.inpainting._scene import Scene
from texrs.source_map import SourceMap

SCALED = np.float32(2.0)
"""Weight of scales in the comparison of patches. Elements that are 50 % larger differ as much as black and white."""
LEAST = 4
"""Smallest side of a patch that still shows a part of a texture, in pixels."""
PLACES = 64
"""Minimum number of places that a patch can be copied from. With fewer places, smaller patches are used."""
SIZES = (0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.25, 3.0, 4.0)
"""Sides of patches that are tried, relative to the usual side."""
FINE = (0.75, 1.0, 1.5)
"""Smaller sides that are also tried in a reduced copy, relative to the usual side at full size."""
STARTS = (1, 5)
"""Indices of the sides that are tried first, from the largest. The neighbours of the best side follow, until none is better.
This takes half the time of all sides. Seams are 1 % more visible, measured in 75 holes of 22 images."""
WIDEST = 0.3
"""Maximum side, as a share of the shorter side of the image."""
CLEARLY = 0.97
"""Maximum visibility of seams, relative to a larger patch, for which a smaller patch is preferred."""
WITHIN = 1.3
"""Maximum side, relative to the side of a square as large as all holes.

A larger patch of a wall would show joints of its own inside the hole.
"""
MANY = 256
"""Maximum number of patches that fill the holes. Smaller patches are not tried."""
COVERS = 0.4
"""Share of the area of a patch that fills the hole, on average."""
MARGIN = 256
"""Width of the band around the holes that patches are copied from, in pixels."""
PLENTY = 2
"""Minimum number of known pixels in this band, relative to the pixels of the holes.

With fewer pixels, the whole image is used.
"""
DRIFT = 3.0
"""Maximum distance of opposite borders of a periodic image from a shift of its lattice, in pixels."""
LARGE = 160**2
"""Area in pixels above which sizes are tried in a copy of half the size or less."""
SMALLEST = 64
"""Smallest side of an image that is halved, in pixels."""


def fill_with_patches(
    pictures: Sequence[Array],
    open_: Bools,
    scales: Sequence[Floats] | None,
    chosen: int | None,
    keep: Bools,
    *,
    usable: Bools,
    mirrors: Sequence[Flip],
    wrap: tuple[bool, bool],
    seed: int,
    watch: Progress,
) -> tuple[SourceMap, int, list[tuple[int, float]], bool]:
    """Fill a hole with patches. If the filled image has a lattice, fill the hole again in step with it.

    Returns
    -------
    SourceMap
        The source map of the image without holes.
    int
        The side of the patches.
    list of (int, float)
        The tried sides. Each has the visibility of its seams.
    bool
        True if patches are in step with a lattice.

    """
    shapes = tuple((p.shape[0], p.shape[1]) for p in pictures)
    part, cyclic = choose_part(open_, keep, wrap, usable)
    guides = guide_together([pictures[0][part], *pictures[1:]])
    if scales is not None:
        pairs = zip(guides, (scales[0][part], *scales[1:]), strict=True)
        guides = [np.concatenate([g, SCALED * log_single(s)[..., np.newaxis]], axis=-1) for g, s in pairs]
    known, itself = ~open_[part], len(pictures) == 1
    free = usable[part] if itself else np.ones(shapes[-1], bool)
    scene = Scene(guides[0], known, keep[part], guides[-1], free, cyclic)
    if chosen is not None:
        check_places(free, chosen)
    elif scales is not None:
        # If scales differ across the image, they also differ within a large patch, so smaller patches are used.
        chosen = list_sides(scene, choose_usual_side(min(free.shape)), (1.0,))[0]
    side, tried, made = fill_scene(scene, chosen, mirrors, seed, lambda share: watch("inpaint", 0.5 * share))
    if itself and scales is None:
        with answering(watch, "inpaint", 0.5):
            lattice = find_lattice(made.colours, cyclic)
        if lattice is not None:
            scene = replace(scene, lattice=lattice)
            side, tried, made = fill_scene(
                scene, chosen, mirrors, seed, lambda share: watch("inpaint", 0.5 + 0.5 * share)
            )
    new = np.nonzero(made.label)
    corner = np.array([p.start for p in part], np.float32)
    source = map_untouched(shapes)
    source.coordinates[part][new] = made.coordinates[new] + (corner if itself else 0)
    source.exemplar[part][new] = len(shapes) - 1
    source.label[part] = made.label
    filled = SourceMap(source.coordinates, source.exemplar, source.label, made.frames, shapes)
    return filled, side, tried, scene.lattice is not None


def fill_scene(
    scene: Scene, chosen: int | None, mirrors: Sequence[Flip], seed: int, watch: Callable[[float], object]
) -> tuple[int, list[tuple[int, float]], Filled]:
    """Fill holes with patches of a given side, or else of the best one. Return the side, all tried sides and the result."""
    tried: list[tuple[int, float]] = []
    made: Filled | None = None
    if chosen is None:
        chosen, tried, made = try_sides(scene, mirrors, seed, lambda share: watch(0.5 * share))
    if made is None:
        made = scene.fill(chosen, mirrors, seed, lambda share: watch(0.5 + 0.5 * share))
    return chosen, tried, made


def find_lattice(colours: Floats, wrap: tuple[bool, bool]) -> NDArray[np.float64] | None:
    """Return the lattice of an image, with a shift in each column. None if there is none, or if it does not wrap."""
    lattice, _ = find_regularity(as_rgb(colours))
    size = colours.shape[0], colours.shape[1]
    closing = None if lattice is None else lattice.close(size, wrap)
    if lattice is None or closing is None or np.abs(closing - np.eye(2)).max() * max(size) > DRIFT:
        return None
    return lattice.vectors


def choose_mirrors(pictures: Sequence[Array], open_: Bools, mirror: bool | None) -> tuple[Flip, ...]:
    """Return the mirror images that patches are copied from: the requested ones, or those that look like the image."""
    if mirror is not None:
        return ALL if mirror else (NONE,)
    if len(pictures) == 2:
        return find_mirrors(guidance(as_image(pictures[1])))
    rows, columns = (np.flatnonzero(open_.any(axis=1 - axis)) for axis in range(2))
    whole = pictures[0]
    beside = [whole[: rows[0]], whole[rows[-1] + 1 :], whole[:, : columns[0]], whole[:, columns[-1] + 1 :]]
    # Use the largest strip next to the holes, because the outline of a hole would look like directional light.
    known = max(beside, key=lambda part: part.shape[0] * part.shape[1])
    return find_mirrors(guidance(as_image(known))) if known.size else ALL


def try_sides(
    scene: Scene, mirrors: Sequence[Flip], seed: int, watch: Callable[[float], object]
) -> tuple[int, list[tuple[int, float]], Filled | None]:
    """Return the best side, all tried sides with the visibility of their seams, and a full-size filling, if any."""
    small, times = scene, 1
    # Try sides in a reduced image if the holes are large, as long as it has enough places for patches.
    while small.holes > LARGE and min(*small.known.shape, *small.free.shape) >= SMALLEST:
        half = small.halve()
        if np.count_nonzero(mark_corners(half.free, 2 * LEAST)) < PLACES:
            break
        small, times = half, 2 * times
    # List the sides to try, largest first. In a reduced copy, also try sides that correspond to usual sides of the
    # full image.
    usual = choose_usual_side(min(scene.free.shape))
    sides = list_sides(small, choose_usual_side(min(small.free.shape)), SIZES)
    if times > 1:
        sides += [side for side in list_sides(small, usual / times, FINE) if side < sides[-1]]
    shown: dict[int, float] = {}

    def fill(number: int) -> Filled:
        done = len(shown)
        return small.fill(sides[number], mirrors, seed, lambda share: watch((done + share) / len(sides)))

    best, made = 0, None
    wanted = sorted({min(number, len(sides) - 1) for number in STARTS})
    # Try a few sides, then the neighbours of the best one, until neither is better.
    while wanted and 0 not in shown.values():
        for number in wanted:
            found = fill(number)
            shown[number] = judge_seams(found, small.source, small.free, small.wrap) if len(sides) > 1 else 0.0
            if made is None or is_better(number, best, shown):
                best, made = number, found
            if shown[number] == 0:
                break
        wanted = [number for number in (best - 1, best + 1) if 0 <= number < len(sides) and number not in shown]
    tried = [(times * sides[number], shown[number]) for number in sorted(shown)]
    chosen = times * sides[best]
    if times == 1:
        return chosen, tried, made
    # A side that fitted the reduced image may be too large in the full one.
    while not mark_corners(scene.free, chosen).any():
        chosen -= 1
    return chosen, tried, None


def is_better(number: int, best: int, shown: Mapping[int, float]) -> bool:
    """Return whether the seams of a size are less visible than the seams of the best larger size."""
    if number > best:
        return shown[number] < CLEARLY * shown[best]
    return CLEARLY * shown[number] <= min(shown.values())


def choose_part(
    open_: Bools, keep: Bools, wrap: tuple[bool, bool], usable: Bools
) -> tuple[tuple[slice, slice], tuple[bool, bool]]:
    """Return the part of an image around its holes, and its periodic axes."""
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
    if np.count_nonzero(usable[part]) < PLENTY * np.count_nonzero(holes):
        return (slice(0, open_.shape[0]), slice(0, open_.shape[1])), wrap
    return part, (cyclic[0], cyclic[1])


def map_untouched(shapes: tuple[tuple[int, ...], ...]) -> SourceMap:
    """Return the source map of an image without replaced pixels."""
    identity = SourceMap.identity(shapes[0])
    return SourceMap(identity.coordinates, identity.exemplar, identity.label, None, shapes)


def guide_together(pictures: Sequence[Array]) -> list[Floats]:
    """Return the colours of each image for comparing patches. All images are scaled together to [0, 1]."""
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


def check_places(free: Bools, side: int) -> None:
    """Raise an error if no place is large enough for copying patches of this size."""
    if not mark_corners(free, side).any():
        fits = next((s for s in range(side - 1, LEAST - 1, -1) if mark_corners(free, s).any()), None)
        hint = f"the largest size that fits is {fits}" if fits else "no other size fits; give an exemplar"
        raise InvalidInput(f"patch_size: a patch of side {side} does not fit into the image outside the holes; {hint}")


def list_sides(scene: Scene, usual: float, sizes: Sequence[float]) -> list[int]:
    """Return the sides around the usual one that have enough places, the largest first."""
    free = scene.free
    largest = min(*scene.known.shape, *free.shape)
    most = min(largest, max(round(usual), round(min(WIDEST * min(free.shape), WITHIN * scene.holes**0.5))))
    sides = sorted({round(usual * size) for size in sizes}, reverse=True)
    found = [s for s in sides if LEAST <= s <= most and np.count_nonzero(mark_corners(free, s)) >= PLACES]
    few = [s for s in found if scene.holes <= MANY * COVERS * s * s] or found[:1]
    if few:
        return few
    for side in range(min(largest, round(usual)), LEAST - 1, -1):
        if np.count_nonzero(mark_corners(free, side)) >= PLACES:
            return [side]
    if not mark_corners(free, LEAST).any():
        raise InvalidInput(
            f"mask: must leave a square of {LEAST} x {LEAST} known pixels to copy from; or give an exemplar"
        )
    return [LEAST]

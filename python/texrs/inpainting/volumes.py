"""Fill holes in volumes: patches of the known voxels, cut along minimum cuts, and a correction of the seams.

The stitcher of `texrs._engine.stitcher` fills the hole. Known voxels are held, and samples in the hole cost so much
that no patch shows them. The correction then keeps the differences inside each patch, and moves its values so that the
patches fit together.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from math import prod, sqrt

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_float, as_image, as_int, as_seed, check_memory, try_array
from texrs._engine.appearance import Demand
from texrs._engine.pyramid import ONE, Region
from texrs._masks import as_marks, widen
from texrs._notices import assume
from texrs._progress import answering, stage
from texrs._typing import Array, Bools, Progress
from texrs.errors import InvalidInput
from texrs.exemplar import Exemplar
from texrs.growth.start import OVERLAP, weights_of
from texrs.inpainting._holes import find_hole, is_value
from texrs.io.grids import holds_volume
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis

__all__ = ["inpaint_volume", "is_volume"]

LEAST = 16
"""Minimum side of a volume, in voxels."""
MOST_CHANNELS = 4
"""Maximum length of a third axis that contains channels of an image."""
SIDES = (12, 32)
"""Smallest and largest side of the patches, in voxels. Smaller patches lose features. Larger patches do not fit all around."""
SHARES = {False: (1.0, 2 / 3, 1 / 2), True: (1.0, 2 / 3, 1 / 2, 0.4)}
"""Sides that are tried, as shares of the usual side, without and with labels. Smaller patches fit better around the hole:
steps at its border decrease from 2.0 to 1.2 for labels, which cannot be corrected. They lose larger features."""
SMALLEST = 6
"""Smallest side of a patch, in voxels."""
SEEN = 1.2
"""Largest step at the border of a hole that is not visible. Smaller patches are only tried above it."""
MARGIN = 48
"""Width, in voxels, of the margin around the hole that patches are copied from.

The time to search for a patch is proportional to the number of these voxels.
"""
PLENTY = 8
"""Minimum number of voxels that patches are copied from, relative to the voxels of the hole, if the volume allows it."""
CANDIDATES, RECOVER = {False: 16, True: 48}, 2.0
"""Number of places that are compared for a patch, and number of patches that replace the worst seams, as a share of all.

More places are compared for labels, because their seams cannot be corrected.
"""
FORBIDDEN = 5.0
"""Weight of the guide, which gives samples in the hole a high cost."""
BLEND = 0.1
"""Default weight of the values in the correction, which then fades within about three voxels."""
SWEEPS, RELAXED = (40, 400), 1.6
"""Number of sweeps of the correction without and with labels, and the overrelaxation factor."""
CODE = 2047
"""Largest value of a guide."""


def is_volume(image: object, hole: object) -> bool:
    """Return whether an image is a volume.

    An exemplar with three axes is a volume, and so is an image whose hole has three axes. If the values of the image
    define the hole, its file or its number of axes decides.
    """
    if isinstance(image, Exemplar):
        return image.axes == 3
    marks = as_marks(hole).marks
    sides: tuple[int, ...] = getattr(image, "shape", ())
    # An array with few channels is an image, whatever marks its hole.
    deep = len(sides) == 4 or (len(sides) == 3 and sides[2] > MOST_CHANNELS)
    if is_value(marks):
        if isinstance(image, str | os.PathLike):
            return os.path.exists(image) and holds_volume(image)
        if deep:
            assume(
                f"image: {' x '.join(map(str, sides))} is read as a volume; with a mask of two axes, it is read as an image"
            )
        return deep
    if isinstance(marks, str | os.PathLike):
        return os.path.exists(marks) and holds_volume(marks)
    shape = try_array(marks).shape
    return len(shape) == 3 and shape[2] > MOST_CHANNELS and (deep or len(sides) != 3)


def inpaint_volume(
    image: Array | Exemplar,
    hole: object,
    *,
    patch_size: int | None,
    boundary_width: int,
    screening: float | None,
    seed: int,
    progress: Progress | None,
) -> Synthesis:
    """Fill a hole in a volume; see `texrs.inpaint`."""
    volume, hole_ = check_volume(image.image if isinstance(image, Exemplar) else image, hole)
    shape, labels = hole_.shape, image._labels if isinstance(image, Exemplar) else None
    width, number = as_int(boundary_width, "boundary_width", 0, 1024), as_seed(seed)
    weight = None if screening is None else as_float(screening, "screening", 0, 1e6)
    side = None if patch_size is None else as_int(patch_size, "patch_size", SMALLEST, min(shape))
    watch = progress or (lambda stage, share: None)
    watch("inpaint", 0.0)
    source, count, seams, side = SourceMap.identity(shape), 0, 0.0, side or 0
    labelled, tried = False, list[list[float]]()
    composite = result = volume.copy()
    if hole_.any():
        # Work on the part of the volume around the hole.
        painted = paint_over(volume, hole_)
        part = choose_part(hole_)
        with answering(progress, "exemplar", 0.0):
            known = Exemplar(painted[part], axes=3, repeat=False, labels=labels)
            labelled = known.labels
        wide = widen(hole_, width)
        weight = (0.0 if labelled else BLEND) if weight is None else weight
        if weight and labelled:
            raise InvalidInput("screening: must be omitted or 0 for labels, which cannot be mixed")
        best: Filled | None = None
        # Try smaller patches only while the border of the hole is visible.
        for each in [side] if side else list_sides(choose_side(wide, known.shape), labels=labelled):
            made = fill_part(volume[part], known, hole_[part], wide[part], each, number, weight, watch, progress)
            tried.append([each, round(made.step, 3)])
            best = made if best is None or made.step < best.step else best
            if best.step <= SEEN:
                break
        assert best is not None
        side, count, seams = best.side, best.count, best.seams
        corner = np.array([s.start for s in part], np.float32)
        # Insert the part, whose coordinates are relative to its first voxel.
        new = best.label > 0
        source.coordinates[part][new] = best.places[new] + corner
        source.label[part][new] = best.label[new]
        composite, result = volume.copy(), volume.copy()
        composite[part], result[part] = best.composite, best.image
    watch("done", 1.0)
    # Draw the stages: each patch has a shade, and the hole is empty.
    shades = np.zeros(shape, np.uint8)
    new_ = source.label > 0
    shades[new_] = 55 + source.label[new_] * 67 % 200
    bare = volume.copy()
    bare[hole_] = bare.min() if not hole_.all() else 0
    report: dict[str, object] = {
        "method": "patch",
        "seed": number,
        "filled": float(hole_.mean()),
        "replaced_outside": int(np.count_nonzero(new_ & ~hole_)),
        "patch_size": side,
        "candidates": tried,
        "patches": count,
        "seams": round(seams, 6),
        "labels": labelled,
        "screening": weight or 0.0,
        "screening_in_source_map": not weight,
    }
    stages = {"known": bare, "patches": shades, "before_blending": composite}
    finished = source.with_finish((False,) * 3, interpolation="nearest")
    return Synthesis(result, finished, stages, report)


def check_volume(image: object, hole: object) -> tuple[Array, Bools]:
    """Return the volume with a known value in its hole, and the hole."""
    asked = as_marks(hole)
    if asked.feather:
        raise InvalidInput("feather: only available for images; omit it for a volume")
    pixels, mask = find_hole(image, asked, (False,) * 3, axes=3)
    volume = pixels.copy()
    if mask.all():
        raise InvalidInput("mask: must leave voxels to copy from, but covers the whole volume")
    volume[mask] = volume[np.unravel_index(mask.argmin(), mask.shape)]
    as_image(volume, "image", axes=3, minimum=LEAST)
    check_memory(24 * mask.size, "image")
    return volume, mask


def paint_over(volume: Array, hole: Bools) -> Array:
    """Return a volume whose hole has the nearest known values. Patches at its border are compared with these."""
    from scipy.ndimage import distance_transform_edt

    part = find_box(hole, 1)
    nearest = distance_transform_edt(hole[part], return_distances=False, return_indices=True)
    painted = volume.copy()
    painted[part] = volume[part][tuple(nearest)]
    return painted


def find_box(mask: Bools, margin: int) -> tuple[slice, ...]:
    """Return the smallest box that contains all marked points, widened by a margin within the array.

    Examples
    --------
    >>> import numpy as np
    >>> find_box(np.eye(5, dtype=bool)[1:3], 1)
    (slice(0, 2, None), slice(0, 4, None))

    """
    box = []
    for axis, length in enumerate(mask.shape):
        marked = np.flatnonzero(mask.any(axis=tuple(a for a in range(mask.ndim) if a != axis)))
        box.append(slice(max(0, int(marked[0]) - margin), min(length, int(marked[-1]) + margin + 1)))
    return tuple(box)


def choose_part(hole: Bools) -> tuple[slice, slice, slice]:
    """Return the part of a volume to work on: the hole, and enough known voxels around it."""
    margin = MARGIN
    while True:
        part = find_box(hole, margin)
        inside = hole[part]
        if inside.size - np.count_nonzero(inside) >= PLENTY * np.count_nonzero(inside) or inside.shape == hole.shape:
            return part[0], part[1], part[2]
        margin *= 2


def choose_side(hole: Bools, shape: tuple[int, ...]) -> int:
    """Return the side of the patches for the extent of a hole."""
    box = find_box(hole, 0)
    across: int = min(s.stop - s.start for s in box)
    return min(*shape, max(SIDES[0], min(SIDES[1], round(10 + across / 4))))


def list_sides(side: int, *, labels: bool) -> list[int]:
    """Return the sides of patches that are tried in turn, the largest first.

    Examples
    --------
    >>> list_sides(15, labels=False), list_sides(12, labels=True)
    ([15, 10, 8], [12, 8, 6])

    """
    shares = SHARES[labels]
    return list(dict.fromkeys(max(SMALLEST, round(side * share)) for share in shares))


@dataclass(frozen=True, slots=True, eq=False)
class Filled:
    """A part of a volume whose hole is filled with patches of one size."""

    side: int
    places: NDArray[np.intp]
    """Voxel that each voxel is copied from, (D, H, W, 3)."""
    label: NDArray[np.uint32]
    """Patch of each voxel, 0: the voxel itself."""
    count: int
    seams: float
    composite: Array
    image: Array
    """The part after the correction of seams."""
    step: float
    """Mean difference across the border of the replaced voxels, as a multiple of the mean difference elsewhere."""


def fill_part(
    volume: Array,
    known: Exemplar,
    hole: Bools,
    wide: Bools,
    side: int,
    seed: int,
    weight: float,
    watch: Progress,
    progress: Progress | None,
) -> Filled:
    """Fill the hole in a part of a volume, and correct seams if ``weight`` is not 0."""
    places, label, frames, seams = stitch(known, hole, wide, side, seed, progress)
    new = label > 0
    composite = volume.copy()
    composite[new] = volume[tuple(places[new].T)]
    image = correct_seams(composite, hole, new, places, weight, watch) if weight else composite
    step = measure_step(image, new, labels=known.labels)
    return Filled(side, places, label, len(frames), seams, composite, image, step)


def measure_step(volume: Array, new: Bools, *, labels: bool) -> float:
    """Return the mean difference across the border of replaced voxels, as a multiple of the mean difference elsewhere.

    Labels are equal or different, because the distance of two labels has no meaning.
    """
    values = volume.reshape(*new.shape, -1)
    sums, counts = np.zeros(2), np.zeros(2)
    for axis in range(3):
        low, high = (tuple(s if a == axis else slice(None) for a in range(3)) for s in (slice(-1), slice(1, None)))
        if labels:
            change = (values[low] != values[high]).any(axis=-1).astype(np.float64)
        else:
            change = np.abs(values[high].astype(np.float64) - values[low]).mean(axis=-1)
        across = new[low] != new[high]
        sums += change[across].sum(), change[~across].sum()
        counts += np.count_nonzero(across), np.count_nonzero(~across)
    inside, elsewhere = sums / np.maximum(counts, 1)
    return float(inside / elsewhere) if elsewhere else float(inside > 0)


def stitch(
    exemplar: Exemplar, hole: Bools, wide: Bools, side: int, seed: int, progress: Progress | None
) -> tuple[NDArray[np.intp], NDArray[np.uint32], NDArray[np.int16], float]:
    """Return the voxel that each voxel is copied from (D, H, W, 3), its patch (0: itself), the frames, and the seam cost."""
    # Include a margin of one patch, because patches may extend beyond the hole by up to their side.
    part = find_box(wide, side)
    here = hole[part]
    region = Region.whole(here.shape, (False,) * 3)
    own = np.stack(np.meshgrid(*(np.arange(s.start, s.stop) for s in part), indexing="ij"), axis=-1)
    # Voxels of the hole must not be copied: the guide gives them a high cost.
    forbidden = np.zeros((hole.size, 4), np.int16)
    forbidden[hole.reshape(-1), 0] = CODE
    asked = np.zeros(4 * region.points, np.int16)
    with answering(progress, "exemplar", 0.5):
        stitcher = exemplar.stitcher
    made = stitcher.stitch(
        region,
        np.eye(3, dtype=np.int16)[np.newaxis] * np.int16(ONE),
        patch=side,
        overlap=OVERLAP[3],
        candidates=CANDIDATES[exemplar.labels],
        weights=replace(weights_of(exemplar.stitcher), guide=FORBIDDEN),
        recover=RECOVER,
        repetition=0.0,
        continuation=0.0,
        balance=0.0,
        seed=seed,
        held=~here.reshape(-1),
        loose=(wide[part] & ~here).reshape(-1),
        given=np.ascontiguousarray(own.reshape(-1), np.int32) * np.int32(ONE),
        demand=Demand(forbidden.reshape(-1), asked, np.full(region.points, 2**16 - 1, np.uint16)),
        progress=stage(progress, "patches"),
    )
    # Insert the part into the volume. Other voxels are copied from themselves.
    places = np.stack(np.meshgrid(*(np.arange(n) for n in hole.shape), indexing="ij"), axis=-1)
    label = np.zeros(hole.shape, np.uint32)
    found = np.rint(made.places.reshape(*region.shape, 3) / ONE).astype(np.intp)
    shown = made.patches.reshape(region.shape)
    laid = shown < len(made.frames)
    if hole[tuple(np.moveaxis(found, -1, 0))].any():
        raise InvalidInput(
            f"mask: must leave more known voxels around the hole for patches of side {side}; pass a "
            "smaller patch_size, at least 6"
        )
    places[part], label[part] = found, np.where(laid, shown + 1, 0)
    return places, label, made.frames, made.seams


def correct_seams(
    composite: Array, hole: Bools, new: Bools, places: NDArray[np.intp], weight: float, watch: Progress
) -> Array:
    """Return a volume whose replaced voxels differ from their neighbours by the same amounts as in their sources.

    The values x minimise ``sum((x[q] - x[p] - g[p, q]) ** 2) + weight * sum((x - composite) ** 2)`` over pairs of neighbours.
    The requested difference g of a pair is its difference at the source.
    """
    box = find_box(new, 1)
    first = np.array([s.start for s in box])
    shape, ends = new[box].shape, hole.shape
    colours = composite.reshape(*ends, -1).astype(np.float64)
    free, at = new[box], places[box]
    pairs = []
    total = np.full((*shape, 1), weight)
    wanted = weight * colours[box]
    for axis in range(3):
        low, high = (tuple(s if a == axis else slice(None) for a in range(3)) for s in (slice(-1), slice(1, None)))
        slopes = np.zeros((*at[low].shape[:3], colours.shape[-1]))
        seen = np.zeros((*at[low].shape[:3], 1))
        # The requested difference of two voxels is the mean of two differences: at the source of one voxel, and of the
        # other.
        for start, step in ((at[low], 1), (at[high], -1)):
            beside = start.copy()
            beside[..., axis] = np.clip(beside[..., axis] + step, 0, ends[axis] - 1)
            there = (beside[..., axis] != start[..., axis]) & ~hole[tuple(np.moveaxis(beside, -1, 0))]
            change = colours[tuple(np.moveaxis(beside, -1, 0))] - colours[tuple(np.moveaxis(start, -1, 0))]
            slopes += step * change * there[..., np.newaxis]
            seen += there[..., np.newaxis]
        counts = ((seen > 0) & (free[low] | free[high])[..., np.newaxis]).astype(np.float64)
        slopes *= counts / np.maximum(seen, 1)
        total[low] += counts
        total[high] += counts
        wanted[low] -= slopes
        wanted[high] += slopes
        pairs.append((low, high, counts))
    x = colours[box].copy()
    # Update the voxels of one colour of a chessboard at once, because none of them are neighbours.
    odd = np.indices(shape).sum(axis=0) % 2 == 1
    sweeps = round(min(SWEEPS[1], max(SWEEPS[0], 12 / sqrt(weight))))
    for sweep in range(sweeps):
        watch("blend", sweep / sweeps)
        for chosen in (free & odd, free & ~odd):
            sums = wanted.copy()
            for low, high, counts in pairs:
                sums[low] += counts * x[high]
                sums[high] += counts * x[low]
            x[chosen] += RELAXED * (sums / total - x)[chosen]
    known = colours.reshape(prod(ends), -1)[~hole.reshape(-1)]
    x = np.clip(x, known.min(axis=0), known.max(axis=0))
    out = composite.reshape(*ends, -1).copy()
    filled = np.rint(x[free]) if composite.dtype.kind in "bui" else x[free]
    out[tuple(slice(f, f + n) for f, n in zip(first, shape, strict=True))][free] = filled.astype(composite.dtype)
    return out.reshape(composite.shape)

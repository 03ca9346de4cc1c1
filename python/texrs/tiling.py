"""Any picture made cyclic: its outer edges meet inside, along a cut that shows the least.

J. Shen, X. Jin, X. Mao and J. Feng, "Completion-based texture design using deformation", 2006, section 3.5. Along an
axis the second half of the picture comes first and its first half second, so that what meets across the wrap are
neighbours of the picture. The former edges overlap in the middle and are joined by a minimum cut.

Departures, with their reasons:

- The paper swaps the halves for columns, but prints them in order for rows, which would not be cyclic: here both swap.
- The cut of the second axis lives on a cylinder and closes on itself. One that is cut open ends at two heights and
  opens the wrap of the first axis again.
- The overlap is searched around the paper's 50 pixels for the one with the least cut. It is the period of the result:
  in brickwork one of these makes the courses meet, and a fixed one hardly ever does.
- The picture is parted at a calm line near its middle, so that the border of the result does not follow an edge.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from texrs._arrays import as_int, as_wrap
from texrs._typing import Array, Bools, Floats, Progress
from texrs.errors import InvalidInput
from texrs.exemplar import Exemplar, as_exemplar
from texrs.kernels.seam import cut_strip
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis

__all__ = ["tile"]

OVERLAP, SHARE = 50, 4
"""The usual overlap in pixels, and the part of the side that it is at most."""
SEARCH = 2
"""An overlap that is chosen is between the usual one divided by this and multiplied by it."""
SLACK = 0.05
"""How much dearer a cut may be than the cheapest when that keeps more of the picture."""
REACH = 8
"""The first line of the result is at most the side divided by this away from the middle."""
AXES = ("rows", "columns")


def tile(
    image: Array | Exemplar,
    *,
    wrap: bool | Sequence[bool] = (True, True),
    overlap: int | Sequence[int] | None = None,
    progress: Progress | None = None,
) -> Synthesis:
    """Make a picture cyclic: copies of the result side by side have no edge between them.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array, or Exemplar
        The picture, any real dtype, at least 2 pixels along an axis that wraps.
    wrap : bool or (rows, columns)
        Axes along which the result repeats.
    overlap : int or (rows, columns), optional
        How many pixels of two opposite edges are laid over each other, 1 to half the side. By default one with a
        cheap cut, between half and twice the usual 50 pixels (or a quarter of the side, where that is less).
    progress : callable, optional
        Called as ``progress(stage, share)``, with the share of the stage that is done; raising stops the work.

    Returns
    -------
    Synthesis
        The image, (H - overlap, W - overlap) in the dtype and with the channels of the picture; an axis that does not
        wrap keeps its length. Each pixel is one of the picture. The stages are ``"swapped"`` (the halves exchanged,
        nothing cut yet), ``"pieces"`` (which part of the picture each pixel is from) and ``"composite"``, the result.
        The report names for each axis the overlap, how many were tried, and the cost of the cut.

    Raises
    ------
    InvalidInput
        A volume, a side that is too short, or an overlap outside its limits.

    References
    ----------
    .. [1] J. Shen, X. Jin, X. Mao, J. Feng, "Completion-based texture design using deformation", The Visual Computer
       22, 2006, section 3.5. :doi:`10.1007/s00371-006-0079-2`

    Examples
    --------
    >>> import texrs
    >>> pebbles = texrs.samples.pebbles((96, 96)).image
    >>> result = texrs.tile(pebbles, overlap=(16, 20))
    >>> result.image.shape
    (80, 76, 3)
    >>> row, column = result.source.coordinates[30, 40].astype(int)
    >>> bool((result.image[30, 40] == pebbles[row, column]).all())
    True

    """
    exemplar, cyclic = as_exemplar(image, "image"), as_wrap(wrap)
    picture, shape = exemplar.image, (exemplar.shape[0], exemplar.shape[1])
    ranges = as_overlaps(overlap, shape, cyclic)
    watch = progress or (lambda stage, share: None)

    source = SourceMap.identity(shape)
    joints: dict[int, Joint] = {}
    # Columns before rows, as in the paper.
    for axis in (1, 0):
        if cyclic[axis]:
            joint = join(
                source.render(exemplar.guidance),
                axis,
                ranges[axis],
                closed=bool(joints),
                progress=lambda share, axis=axis: watch(f"join {AXES[axis]}", share),  # type: ignore[misc]
            )
            source = joint.source.compose(source)
            joints[axis] = joint
    result = source.render(picture)
    watch("done", 1.0)
    shift = [joints[a].split if a in joints else 0 for a in range(2)]
    stages = {
        "swapped": np.roll(picture, (-shift[0], -shift[1]), (0, 1)),
        "pieces": (source.label * 85).astype(np.uint8),
        "composite": result,
    }
    report = {
        "method": "tile",
        "size": list(source.shape),
        "wrap": list(cyclic),
        "overlap": [joints[a].overlap if a in joints else 0 for a in range(2)],
        "joints": {AXES[a]: joint.describe() for a, joint in joints.items()},
    }
    return Synthesis(result, source, stages, report)


def as_overlaps(value: object, shape: tuple[int, int], wrap: Sequence[bool]) -> list[range]:
    """Return the overlaps of each axis that may be chosen; none where it does not wrap."""
    for axis, side in enumerate(shape):
        if wrap[axis] and side < 2:
            raise InvalidInput(f"image: needs at least 2 {AXES[axis]} to wrap them, got {side}")
    if value is None:
        usual = [min(OVERLAP, side // SHARE) for side in shape]
        most = [side // 2 for side in shape]
        return [range(max(1, u // SEARCH), max(1, min(m, u * SEARCH)) + 1) for u, m in zip(usual, most, strict=True)]
    several = list(value) if isinstance(value, Sequence | np.ndarray) and not isinstance(value, str) else [value] * 2
    if len(several) != 2:
        raise InvalidInput(f"overlap: needs one number or (rows, columns), got {value!r}")
    found = []
    for axis, (each, side) in enumerate(zip(several, shape, strict=True)):
        if wrap[axis]:
            try:
                chosen = as_int(each, "overlap", 1, side // 2)
            except InvalidInput as error:
                raise InvalidInput(f"{error}: at most half of the {side} {AXES[axis]}") from None
            found.append(range(chosen, chosen + 1))
        else:
            found.append(range(0))
    return found


@dataclass(frozen=True, slots=True, eq=False)
class Joint:
    """One axis made cyclic."""

    source: SourceMap
    split: int
    """The first line of the result is this one of the picture."""
    overlap: int
    value: float
    """Cost of the cut."""
    edges: int
    """Pairs of pixels that the cut parts."""
    tried: int
    """Overlaps that were cut."""

    def describe(self) -> dict[str, object]:
        """Return what was done."""
        return {
            "split": self.split,
            "overlap": self.overlap,
            "overlaps_tried": self.tried,
            "cost": round(self.value, 4),
            "cost_of_a_pair": round(self.value / max(self.edges, 1), 4),
        }


def join(
    guide: Floats, axis: int, overlaps: range, *, closed: bool, progress: Callable[[float], object] = lambda share: None
) -> Joint:
    """Make one axis cyclic with the smallest overlap whose cut is about as cheap as the cheapest.

    Parameters
    ----------
    guide : (H, W, C) float32
        The picture.
    axis : {0, 1}
        The axis that becomes cyclic.
    overlaps : range
        Overlaps that may be chosen.
    closed : bool
        Whether the other axis is cyclic already, so that the cut must close on itself.
    progress : callable
        Called with the share that is done.

    """
    values = []
    for number, m in enumerate(overlaps):
        progress(number / len(overlaps))
        values.append(cut_seam(guide, axis, m, closed=closed)[0])
    enough = min(values) * (1 + SLACK)
    overlap = next(m for m, value in zip(overlaps, values, strict=True) if value <= enough)
    value, edges, mask = cut_seam(guide, axis, overlap, closed=closed)
    at = find_calm_line(guide, axis, overlap)
    return Joint(swap_halves(guide.shape[:2], axis, at, mask), at, overlap, value, edges, len(overlaps))


def cut_seam(guide: Floats, axis: int, overlap: int, *, closed: bool) -> tuple[float, int, Bools]:
    """Cut from the end of the picture to its beginning: cost, pairs parted, and where the beginning is taken."""
    lines = np.moveaxis(guide, axis, 0)
    end, start = (np.moveaxis(part, 0, axis) for part in (lines[len(lines) - overlap :], lines[:overlap]))
    if overlap == 1:
        # A single line leaves nothing to choose.
        difference = np.abs(end - start).sum(dtype=np.float64)
        return float(difference), end.shape[1 - axis], np.zeros(end.shape[:2], bool)
    found = cut_strip(end, start, axis=axis, cyclic=closed)
    return found.value, found.edges, found.mask


def find_calm_line(guide: Floats, axis: int, overlap: int) -> int:
    """Return the line nearest to the middle that differs from the one before no more than lines usually do.

    It becomes the first one. Half of the picture, as printed, may be the edge of something, which would then lie along
    the border of the result: no fault of a cyclic picture, but what shows first where its border is sampled badly.
    """
    lines = np.moveaxis(guide, axis, 0)
    half, side = len(lines) // 2, len(lines)
    jumps = np.abs(np.diff(lines, axis=0)).mean(axis=(1, 2), dtype=np.float64)
    low, high = max(overlap, half - side // REACH), min(side - overlap, half + side // REACH)
    near = sorted(range(low, high + 1), key=lambda line: (abs(line - half), line))
    return next((line for line in near if jumps[line - 1] <= np.median(jumps)), half)


def swap_halves(shape: tuple[int, ...], axis: int, split: int, mask: Bools) -> SourceMap:
    """Return the map of a picture whose part from ``split`` on comes first, joined to the rest along a cut."""
    side, overlap = shape[axis], mask.shape[axis]
    size = tuple(n - overlap if a == axis else n for a, n in enumerate(shape))
    late = np.zeros(size, bool)
    lines = np.moveaxis(late, axis, 0)
    lines[side - split :] = True
    lines[side - split - overlap : side - split] = np.moveaxis(mask, axis, 0)
    coordinates = SourceMap.identity(size).coordinates
    coordinates[..., axis] += np.where(late, np.float32(split + overlap - side), np.float32(split))
    return SourceMap.from_coordinates(coordinates, shape[:2], label=late.astype(np.uint32))

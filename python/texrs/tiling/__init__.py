"""Any picture made cyclic: its outer edges meet inside, along cuts that show the least.

J. Shen, X. Jin, X. Mao and J. Feng, "Completion-based texture design using deformation", 2006, section 3.5. Along an
axis the second half of the picture comes first and its first half second, so that what meets across the wrap are
neighbours of the picture. The former edges overlap in the middle and are joined by a minimum cut.

Departures, with their reasons:

- The paper swaps the halves for columns, but prints them in order for rows, which would not be cyclic: here both swap.
- The cut of the second axis lives on a cylinder and closes on itself. One that is cut open ends at two heights and
  opens the wrap of the first axis again.
- The overlap is searched, up to seven sixteenths of the side, not fixed at 50 pixels. It is the period of the result: in
  brickwork few of them make the courses meet, and large stones can only be parted where they end. What is laid over each
  other must fit, which a cheap cut through plain ground does not say.
- Where two cuts are about as cheap as one, what is shown around the former edges is taken from elsewhere in the picture,
  and the result keeps the picture's size; not on a lattice, which goes on only where its period does.
- A cut costs more the deeper inside elements it runs.
- The picture is parted at a calm line near its middle, so that the border of the result does not follow an edge.
- A result larger than the picture is a cyclic quilt of it; a lattice is stretched by as little as makes it close, as in
  `texrs.design`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_bool, as_float, as_int, as_size, as_wrap, check_work
from texrs._evening import flatten as even_light
from texrs._progress import listen
from texrs._typing import Array, Floats, Progress
from texrs._verbs import takes_materials
from texrs.blending import apply
from texrs.errors import InvalidInput
from texrs.exemplar import Exemplar, as_exemplar
from texrs.materials import Material
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis
from texrs.tiling._extend import extend
from texrs.tiling._joints import Choice, Joined, find_joint, make_levels
from texrs.tiling._maps import PIECES, find_calm_line, lay_out
from texrs.tiling._things import SMALLEST, find_things

__all__ = ["tile"]

SHARE, LEAST = 8, 25
"""An overlap that is chosen is at least the side divided by the one, or the other in pixels."""
LARGER = "texrs.TileSet makes an endless design, and gives it in parts"
"""How larger ones are made."""
MOST = 7
"""Sixteenths of the side that it is at most."""
LARGE = 0.22
"""Elements larger than this share of a side are seldom whole between two cuts: their ends are not covered."""
AXES = ("rows", "columns")


@takes_materials("image")
def tile(
    image: Array | Exemplar | Material,
    *,
    wrap: bool | Sequence[bool] | None = None,
    size: int | Sequence[int] | None = None,
    overlap: int | Sequence[int] | None = None,
    blend: float | None = None,
    flatten: bool = False,
    progress: Progress | bool | None = None,
) -> Synthesis:
    """Make a picture cyclic: copies of the result side by side have no edge between them.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array, or Exemplar
        The picture, any real dtype, at least 2 pixels along an axis that wraps.
    wrap : bool or (rows, columns), optional
        Axes along which the result repeats; None: both.
    size : int or (rows, columns), optional
        Size of the result in pixels, at least 2 along an axis that wraps. By default the picture's, or less along an axis
        where one cut between its ends shows clearly less than a cover of them. A result larger than the picture, at
        least 8 pixels a side, is a quilt of it, for which a lattice is stretched so that it closes.
    overlap : int or (rows, columns), optional
        How many pixels of two opposite edges are laid over each other, 1 to half the side, instead of a size. By
        default what shows least.
    blend : float, optional
        Weight of the values, 0 to 1e6, when colours are corrected so that seams disappear: the smaller, the wider the
        correction. None or 0: no correction, so that each pixel is one of the picture. See `texrs.blend`.
    flatten : bool
        Whether uneven light is taken out first, as far as there is evidence of it: copies of a lawn that is lighter at one end
        show bands. Of a material colours are flattened. See `texrs.materials.flatten`.
    progress : callable or True, optional
        Called as ``progress(stage, share)``, with the share of the stage that is done; raising stops the work.
        True shows a bar.

    Returns
    -------
    Synthesis
        The image, in the dtype and with the channels of the picture; an axis that does not wrap keeps its length, or that
        much of its middle that was asked for. The stages are ``"swapped"`` (the halves
        exchanged, nothing cut yet), ``"pieces"`` (which part of the picture each pixel is from) and ``"composite"``, the
        result before ``blend``. The report names for each axis the overlap, 0 where the ends are covered, how many joints were
        tried, and the cost of the cuts.

    Raises
    ------
    InvalidInput
        A volume, a side that is too short, a size or an overlap outside its limits, or both of them.

    References
    ----------
    .. [1] J. Shen, X. Jin, X. Mao, J. Feng, "Completion-based texture design using deformation", The Visual Computer
       22, 2006, section 3.5. :doi:`10.1007/s00371-006-0079-2`

    Examples
    --------
    >>> import texrs
    >>> pebbles = texrs.samples.pebbles((96, 96)).image
    >>> result = texrs.tile(pebbles, size=(80, 96))
    >>> result.image.shape
    (80, 96, 3)
    >>> row, column = result.source.coordinates[30, 40].astype(int)
    >>> bool((result.image[30, 40] == pebbles[row, column]).all())
    True

    """
    progress = listen(progress)
    exemplar, cyclic = as_exemplar(image, "image"), as_wrap(wrap, usual=True)
    evened = as_bool(flatten, "flatten")
    if evened:
        exemplar = as_exemplar(even_light(exemplar.image))
    shape = (exemplar.shape[0], exemplar.shape[1])
    wanted, weight = as_sides(size, shape, cyclic), as_float(0.0 if blend is None else blend, "blend", 0, 1e6)
    choices = as_choices(overlap, size is None, shape, wanted, cyclic)
    watch = progress or (lambda stage, share: None)
    check_work("tile", [exemplar.pixels], wanted, "image" if size is None else "size", way=LARGER)
    watch("segment", 0.0)
    found: dict[int, Joined] = {}
    if any(n > m for n, m in zip(wanted, shape, strict=True)):
        source, firsts = extend(exemplar.guidance, wanted, cyclic, watch), (0, 0)
    else:
        source, found, firsts = join_ends(exemplar.guidance, wanted, choices, cyclic, watch)
    source = source.finished(cyclic, screening=weight or None, flatten=evened)
    composite = source.render(exemplar.image)
    # The picture is in even light already.
    finish = None if source.finish is None else replace(source.finish, flatten=False)
    result = apply(source, exemplar.image, finish=finish, progress=progress) if weight else composite
    watch("done", 1.0)
    stages = {
        "swapped": np.roll(exemplar.image, [-first for first in firsts], (0, 1)),
        "pieces": (source.label * 85 % 256).astype(np.uint8),
        "composite": composite,
    }
    report = {
        "method": "tile" if found or source.shape == shape else "quilt",
        "size": list(source.shape),
        "wrap": list(cyclic),
        "blend": weight,
        "flatten": evened,
        "overlap": [found[a].joint.width if a in found and not found[a].joint.cover else 0 for a in range(2)],
        "joints": {AXES[a]: describe(joined, firsts[a]) for a, joined in found.items()},
    }
    return Synthesis(result, source, stages, report)


def as_sides(size: object, shape: tuple[int, int], wrap: Sequence[bool]) -> tuple[int, int]:
    """Return the size of the result, as far as it is known: what was asked for, or the picture's."""
    for axis, side in enumerate(shape):
        if wrap[axis] and side < 2:
            raise InvalidInput(f"image: needs at least 2 {AXES[axis]} to wrap them, got {side}")
    if size is None:
        return shape
    rows, columns = as_size(size, way=LARGER)
    for axis, side in enumerate((rows, columns)):
        if wrap[axis] and side < 2:
            raise InvalidInput(f"size: needs at least 2 {AXES[axis]} to wrap them, got {side}")
        if side > shape[axis] and min(shape) < SMALLEST:
            raise InvalidInput(
                f"size: more than the picture's {shape} needs {SMALLEST} pixels a side of it, got {side}"
            )
    return rows, columns


def as_choices(
    overlap: object, free: bool, shape: tuple[int, int], size: tuple[int, int], wrap: Sequence[bool]
) -> list[Choice]:
    """Return the joints of each axis that may be chosen; ``free``: whether they choose the size."""
    if overlap is None:
        return [_choose(n, m, free) for n, m in zip(shape, size, strict=True)]
    if not free:
        raise InvalidInput("overlap: the size says it already; give one of the two")
    several = list(overlap) if isinstance(overlap, Sequence | np.ndarray) and not isinstance(overlap, str) else None
    several = [overlap] * 2 if several is None else several
    if len(several) != 2:
        raise InvalidInput(f"overlap: needs one number or (rows, columns), got {overlap!r}")
    found = []
    for axis, (each, side) in enumerate(zip(several, shape, strict=True)):
        try:
            chosen = as_int(each, "overlap", 1, side // 2) if wrap[axis] else 0
        except InvalidInput as error:
            raise InvalidInput(f"{error}: at most half of the {side} {AXES[axis]}") from None
        found.append(Choice(chosen, chosen))
    return found


def _choose(side: int, wanted: int, free: bool) -> Choice:
    if free:
        # Of all that lies over each other every line but one would be taken: the border could not be at a calm one.
        return Choice(max(1, min(LEAST, side // SHARE)), max(1, side * MOST // 16), side)
    # More than half cannot be laid over each other.
    overlap = min(side - wanted, wanted)
    return Choice(max(1, overlap), overlap, wanted)


def join_ends(
    colours: Floats, wanted: tuple[int, int], choices: Sequence[Choice], wrap: Sequence[bool], watch: Progress
) -> tuple[SourceMap, dict[int, Joined], tuple[int, int]]:
    """Return the map of a picture no larger than it, the joints of its axes, and which lines of it come first."""
    shape = (colours.shape[0], colours.shape[1])
    # Of more than can be laid over each other the middle is taken.
    kept = [min(n, 2 * m) if cyclic else m for n, m, cyclic in zip(shape, wanted, wrap, strict=True)]
    corner = [(n - m) // 2 for n, m in zip(shape, kept, strict=True)]
    part = tuple(slice(low, low + n) for low, n in zip(corner, kept, strict=True))
    # What each pixel shows: which pixel of the picture, and which piece of it.
    place = np.arange(shape[0] * shape[1]).reshape(shape)[part]
    label: NDArray[np.uint32] = np.zeros(place.shape, np.uint32)
    things = find_things(colours)
    shown, depth = colours[part], things.depth[part]
    found: dict[int, Joined] = {}
    firsts = [0, 0]
    # Columns before rows, as in the paper.
    for axis in (1, 0):
        if not wrap[axis]:
            continue
        if found:
            shown = colours.reshape(-1, colours.shape[-1]).take(place, axis=0)
            depth = things.depth.take(place)
        joined = find_joint(
            make_levels(shown, depth),
            axis,
            # Ends that are covered keep the picture's length, which no lattice has but by chance.
            choices[axis].without_cover(things.regular or things.side > LARGE * place.shape[axis]),
            closed=bool(found),
            progress=lambda share, axis=axis: watch(f"join {AXES[axis]}", share),  # type: ignore[misc]
        )
        first = find_calm_line(shown, axis, joined)
        line, piece = lay_out(place.shape[1 - axis], joined, first)
        line, piece = np.moveaxis(line, 0, axis), np.moveaxis(piece, 0, axis)
        place = np.take_along_axis(place, line, axis)
        label = np.take_along_axis(label, line, axis) * np.uint32(len(PIECES)) + piece if found else piece
        found[axis], firsts[axis] = joined, first + corner[axis]
    coordinates = np.stack(np.divmod(place, shape[1]), axis=-1).astype(np.float32)
    return SourceMap.from_coordinates(coordinates, shape, label=label), found, (firsts[0], firsts[1])


def describe(joined: Joined, first: int) -> dict[str, object]:
    """Return what was done at one axis."""
    joint, edges = joined.joint, sum(cut.edges for cut in joined.cuts)
    cost = sum(cut.value for cut in joined.cuts)
    return {
        "split": first,
        "overlap": 0 if joint.cover else joint.width,
        "cover": joint.cover,
        "joints_tried": joined.tried,
        "cost": round(cost, 4),
        "cost_of_a_pair": round(cost / max(edges, 1), 4),
    }

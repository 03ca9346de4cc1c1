"""Make images tileable: join opposite edges along the least visible seams.

J. Shen, X. Jin, X. Mao and J. Feng, "Completion-based texture design using deformation", 2006, section 3.5. There the
halves of the image are swapped, and its former edges overlap in the middle, where a minimum cut joins them.

Departures, with their reasons:

- An axis along which the image is tileable already is not changed.

- The halves are not swapped, because the seam is cut at the border. Pixels far from it stay in place.

- The seam of the second axis ends at the position where it starts. Otherwise its ends would differ, and the result
  would no longer be tileable along the first axis.

- The overlap is searched for, up to 7/16 of the side, instead of being fixed at 50 pixels. It determines the period of
  the result. The courses of a wall continue across the border only for some periods, and a seam between large stones
  exists only for some overlaps.

- The overlapping parts must be similar. The cost of a seam does not measure this if the seam runs through plain
  background.

- If two seams cost little more than one, the lines near the former edges are covered by other parts of the image. The
  result then keeps the size of the image.

- The cost of a seam rises with its depth inside elements.

- Uneven light is evened out first if there is evidence of it.

- The border and the seams of the result are measured. If they are visible, other overlaps are tried.

- A result larger than the image is laid in one of the ways of `texrs.design`, which are compared at a small size. A
  lattice is first stretched slightly so that a whole number of periods fits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_bool, as_choice, as_float, as_image, as_int, as_size, as_wrap, check_work
from texrs._lighting_correction import flatten_lighting as even_light
from texrs._notices import assume, collect
from texrs._palettes import find as find_palette
from texrs._palettes import has_few_colours
from texrs._progress import listen
from texrs._typing import Array, Floats, Progress
from texrs._verbs import takes_materials
from texrs.blending import apply
from texrs.errors import InvalidInput
from texrs.exemplar import Exemplar, as_exemplar
from texrs.materials import Material
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis
from texrs.tiling._enlarging import Enlarging, enlarge, find_obstacle
from texrs.tiling._joints import Choice, Joined, find_joint, make_levels
from texrs.tiling._lighting_choice import is_uneven, name_image
from texrs.tiling._maps import PIECES, lay_out
from texrs.tiling._whole_elements import SMALLEST, WholeElements, find_whole_elements
from texrs.tiling.borders import SEEN
from texrs.tiling.check import AXES, Tiling, check_result, check_tiling, find_tiled, report_tiling

__all__ = ["Tiling", "check_tiling", "tile"]

SHARE, LEAST = 8, 25
"""Minimum overlap that the search tries: the side divided by 8, at most 25 pixels."""
LARGER = "texrs.CornerTiles creates an unbounded design in parts"
"""Remedy in errors about results that are too large."""
MOST = 7
"""Maximum overlap that the search tries, in 1/16 of the side."""
REGULAR, DEAR = 1.0, 0.5
"""Ratio of the seam costs of a cover and of an overlap below which the cover is preferred.

The first value is for elements on a lattice. The second value is for covers that are unlikely to fit, because elements
are large or the side is not a multiple of their period.
"""
PERIODIC = 3.0
"""Weight of the lost length in the price of a joint, if the period of the elements determines the size.

An overlap of the whole side would add this multiple of the cost of its seam.
"""
REFUSED = ((0, 1), (1, 0), (1, 1))
"""Groups of best joints that each further attempt skips, along (rows, columns).

Attempts are made only if a border or seam is visible. The least visible attempt is used.
"""
ELEMENT = 0.22
"""Minimum side of large elements, as a share of the side of the image.

A joint with two seams cuts most elements of this size.
"""


def tile(
    image: Array | Exemplar | Material,
    *,
    wrap: bool | Sequence[bool] | None = None,
    size: int | Sequence[int] | None = None,
    way: Enlarging | Literal["auto"] = "auto",
    overlap: int | Sequence[int] | None = None,
    screening: float | None = None,
    flatten_lighting: bool | None = None,
    progress: Progress | bool | None = None,
) -> Synthesis:
    """Make an image tileable: copies of the result side by side have no visible edge between them.

    An axis along which the image is tileable already is not changed. Pixels far from the border stay in place.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array, or Exemplar
        The image, of any real dtype, at least 2 pixels along an axis that wraps.
    wrap : bool or (rows, columns), optional
        Axes along which the result repeats. Default: both.
    size : int or (rows, columns), optional
        Size of the result in pixels, at least 2 along an axis that wraps. A larger result is stitched from patches of
        the image, which must have at least 8 pixels a side. A lattice is then stretched so that it closes, if this
        changes it little. If the default size is smaller than the image, the report contains the reason. Default: the
        size of the image, or less along an axis if the joint is then clearly less visible.
    way : {"auto", "still", "lattice", "stitch", "cells"}
        Way that a larger result is laid in, as in `texrs.design`. "still" joins large patches on a grid, "lattice" the
        same in step with a lattice of the image. "stitch" joins smaller patches, each where it fits best. "cells"
        bends jointed cells or the stones of a heap into a new arrangement. "auto" tries the ways that suit the image
        at a small size and uses the best one. Other ways than "auto" need a size that is larger than the image along
        an axis. Default: "auto".
    overlap : int or (rows, columns), optional
        Overlap of two opposite edges in pixels, from 1 to half the side. It cannot be combined with ``size``. Default:
        the overlap with the least visible joint.
    screening : float, optional
        Weight of the original values when colours are corrected to hide seams, 0 to 1e6. A smaller weight spreads the
        correction wider. None or 0: no correction, so that each pixel is a pixel of the image. See `texrs.blend`.
        Default: no correction.
    flatten_lighting : bool, optional
        If True, uneven light is evened out first, as far as it cannot be due to chance. Only the colours of a material
        are changed. See `texrs.materials.flatten_lighting`. Default: True if one part is lit at least 1.6 times
        brighter than another part, and no side is shorter than 128 pixels.
    progress : callable or True, optional
        Called as ``progress(stage, share)``, with the finished share of the stage. If it raises an exception, the work
        stops. True shows a bar.

    Returns
    -------
    Synthesis
        The image, in the dtype and with the channels of the input. An axis that does not wrap keeps its length, or is
        cropped to the middle part of the requested length.

        Stages:

        - ``shifted``: The image with its halves exchanged, before seams are cut.
        - ``source_regions``: A grey level for each part of the image that pixels were copied from.
        - ``before_blending``: The result before its colours are corrected.

        Report:

        - ``method``: "tile", or "quilt" if the result is larger than the image.
        - ``way``: Way that a larger result was laid in, as in `texrs.design`: "still", "lattice", "stitch" or "cells".
        - ``refused``: For a larger result, the reason against the way "lattice", if there is one.
        - ``candidates``: For a larger result, the figures of each way that was tried, or None.
        - ``size``: (rows, columns).
        - ``wrap``: (rows, columns): whether the result repeats along each axis.
        - ``screening``: Weight of the original values in the colour correction.
        - ``flatten_lighting``: Whether uneven light was evened out.
        - ``already``: Axes along which the image is tileable already.
        - ``resized``: For each axis with another length than the image, the reason.
        - ``overlap``: For each axis, the overlap of the ends in pixels; 0 if the ends are covered by other parts.
        - ``joints``: For each axis: ``overlap``, ``cover`` (distance of the covering lines), ``joints_tried``,
          ``cost`` (of all seams) and ``mean_seam_cost`` (per pair of pixels).
        - ``in_place``: Share of the pixels that are copied from the same position in the image.
        - ``in_step``: Whether the elements are on a strict lattice. The size must then be a multiple of its period.
        - ``unchanged``: Share of the pixels that equal the pixel of the image at the same position.
        - ``tiling``: For each axis that wraps, the result of `texrs.check_tiling` with the source map: ``tiles``,
          ``seam``, ``place`` and ``step``.
        - ``warnings``: One sentence for each border or seam that is still visible.

    Raises
    ------
    InvalidInput
        The image is a volume, a side is too short, the size or the overlap is out of range, or both are given.
        Or the way does not suit the image or the size.

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
    >>> row, column = result.source_map.coordinates[30, 40].astype(int)
    >>> bool((result.image[30, 40] == pebbles[row, column]).all())
    True

    """
    given = image if isinstance(image, Material) else as_exemplar(image, "image")
    cyclic = as_wrap(wrap, usual=True)
    pixels = as_image(given.base, "image") if isinstance(given, Material) else given.pixels
    rows, columns = pixels.shape[:2]
    wanted, weight = (
        _as_sides(size, (rows, columns), cyclic),
        as_float(0.0 if screening is None else screening, "screening", 0, 1e6),
    )
    choices = _as_choices(overlap, size is None, (rows, columns), wanted, cyclic)
    if as_choice(way, "way", ("auto", *get_args(Enlarging))) != "auto" and wanted[0] <= rows and wanted[1] <= columns:
        raise InvalidInput(f'way: must be "auto" for a result that is not larger than the image; got {way!r}')
    check_work("tile", [pixels], wanted, "image" if size is None else "size", way=LARGER)
    evened = None if flatten_lighting is None else as_bool(flatten_lighting, "flatten_lighting")
    with collect() as notices:
        # An axis that is tileable already is not changed, unless the size is given.
        free = [cyclic[a] and overlap is None and wanted == (rows, columns) for a in range(2)]
        already = [] if evened else find_tiled(given, free)
        # Uneven light causes a step at the border, so even it out by default if the evidence is clear.
        if evened is None:
            evened = len(already) < sum(cyclic) and not _keeps_colours(image, weight) and is_uneven(given)
        if evened:
            even = given.flatten_lighting() if isinstance(given, Material) else as_exemplar(even_light(given.image))
            already = find_tiled(even, free)
            image = image if isinstance(image, Material) else even
        if already:
            along = " and ".join(AXES[a] for a in already)
            assume(f"{name_image(given)}: is already tileable along the {along}, which are not changed")
        join = partial(
            _join_edges,
            image,
            wrap=cyclic,
            size=wanted,
            way=way,
            choices=choices,
            already=already,
            screening=weight,
            flatten_lighting=evened,
            progress=listen(progress),
        )
        made = join()
        # If a border or seam is visible, try other joints, and keep the least visible result.
        for refused in REFUSED:
            if find_boldest(made) <= SEEN or not made.report["joints"] or made.report["in_step"]:
                break
            other = join(refused=refused)
            # Do not accept a joint that makes the result smaller.
            if find_boldest(other) < find_boldest(made) and other.source_map.label.size >= made.source_map.label.size:
                made = other
    report = {**made.report, "unchanged": measure_unchanged(made.image, pixels), "warnings": list_visible(made)}
    return replace(made, report=notices.add_to(report))


tile.takes = ("image",)  # type: ignore[attr-defined]


@takes_materials("image")
def _join_edges(
    image: Array | Exemplar | Material,
    *,
    wrap: Sequence[bool],
    size: tuple[int, int],
    way: Enlarging | Literal["auto"],
    choices: Sequence[Choice],
    already: Sequence[int],
    screening: float,
    flatten_lighting: bool,
    refused: Sequence[int] = (0, 0),
    progress: Progress | None,
) -> Synthesis:
    """Return a result whose edges are joined, except along the axes ``already`` that are tileable already.

    ``flatten_lighting``: whether the light of the image was evened out before. ``refused``: see `find_joint`.
    """
    exemplar, watch = as_exemplar(image, "image"), progress or (lambda stage, share: None)
    shape = (exemplar.shape[0], exemplar.shape[1])
    larger = any(n > m for n, m in zip(size, shape, strict=True))
    watch("segment", 0.0)
    found: dict[int, Joined] = {}
    reasons: dict[str, str] = {}
    elements = None if len(already) == sum(wrap) else find_whole_elements(exemplar.guidance)
    # A larger result is a quilt of patches. Otherwise join the ends of the image.
    laid, tried, obstacle = None, None, ""
    if larger:
        obstacle = find_obstacle(exemplar, size, (wrap[0], wrap[1]))
        source, laid, tried = enlarge(exemplar, size, wrap, way, watch)
    else:
        source, found, reasons = _join_ends(exemplar.guidance, elements, size, choices, wrap, already, refused, watch)
    weight = screening if found or larger else 0.0
    source = source.with_finish(wrap, screening=weight or None, flatten_lighting=flatten_lighting)
    composite = source.render(exemplar.image)
    # Apply the finish without evening out the light, which has been done before.
    finish = None if source.finish is None else replace(source.finish, flatten_lighting=False)
    result = apply(source, exemplar.image, finish=finish, progress=progress) if weight else composite
    watch("done", 1.0)
    stages = {
        "shifted": np.roll(exemplar.image, [n // 2 if c else 0 for n, c in zip(shape, wrap, strict=True)], (0, 1)),
        "source_regions": (source.label * 85 % 256).astype(np.uint8),
        "before_blending": composite,
    }
    # Measure the finished image, because the colour correction changes the visibility of borders and seams.
    report = {
        "method": "tile" if found or source.shape == shape else "quilt",
        "way": laid,
        "refused": {"lattice": obstacle} if obstacle else {},
        "candidates": None if tried is None else {name: dict(figures) for name, figures in tried.items()},
        "size": list(source.shape),
        "wrap": list(wrap),
        "screening": weight,
        "flatten_lighting": flatten_lighting,
        "already": [AXES[a] for a in already],
        "resized": reasons,
        "overlap": [found[a].joint.width if a in found and not found[a].joint.cover else 0 for a in range(2)],
        "joints": {AXES[a]: _describe(joined) for a, joined in found.items()},
        "in_place": round(_measure_kept_places(source), 4),
        "in_step": elements is not None and elements.strict,
        "tiling": report_tiling(
            check_result(result, source, wrap, regular=elements is not None and elements.regular), wrap
        ),
    }
    return Synthesis(result, source, stages, report)


def find_boldest(made: Synthesis) -> float:
    """Return the largest visibility of a border or seam of a result, where 1 is as bold as the boldest lines elsewhere."""
    figures: list[float] = [each[k] or 0.0 for each in made.report["tiling"].values() for k in ("seam", "step")]
    return max(figures, default=0.0)


def list_visible(made: Synthesis) -> list[str]:
    """Return one sentence for each visible border or seam of a result."""
    return [
        f"{axis}: {where} is visible, {each[name]:.1f} times as bold as the boldest lines elsewhere"
        for axis, each in made.report["tiling"].items()
        for name, where in (("seam", "the border"), ("step", "a seam inside the image"))
        if (each[name] or 0.0) > SEEN
    ]


def measure_unchanged(image: Array, given: Array) -> float:
    """Return the share of pixels of a result that equal the pixel of the input at the same position."""
    rows, columns = (min(n, m) for n, m in zip(image.shape[:2], given.shape[:2], strict=True))
    shown, before = (each[:rows, :columns].reshape(rows, columns, -1) for each in (image, given))
    # Compare channel by channel, because `numpy.all` over a few channels takes 10x as long.
    same = np.ones((rows, columns), bool)
    for channel in range(shown.shape[-1]):
        same &= shown[..., channel] == before[..., channel]
    return float(round(same.sum() / (image.shape[0] * image.shape[1]), 4))


def _keeps_colours(image: Array | Exemplar | Material, screening: float) -> bool:
    """Return whether a result must use only the colours of the image, so that its light must not be evened out."""
    if isinstance(image, Material):
        return has_few_colours(np.asarray(image.base))
    return find_palette({"image": image, "screening": screening}, ("image",), {}) is not None


def _measure_kept_places(source: SourceMap) -> float:
    """Return the share of pixels that are copied from the same position in the image."""
    rows, columns = (np.arange(n, dtype=np.float32) for n in source.shape)
    there = (source.coordinates[..., 0] == rows[:, np.newaxis]) & (source.coordinates[..., 1] == columns)
    return float(there.mean())


def _as_sides(size: object, shape: tuple[int, int], wrap: Sequence[bool]) -> tuple[int, int]:
    """Check the requested size of the result. By default, return the size of the image."""
    for axis, side in enumerate(shape):
        if wrap[axis] and side < 2:
            raise InvalidInput(f"image: must have at least 2 {AXES[axis]} to wrap them, got {side}")
    if size is None:
        return shape
    rows, columns = as_size(size, way=LARGER)
    for axis, side in enumerate((rows, columns)):
        if wrap[axis] and side < 2:
            raise InvalidInput(f"size: must have at least 2 {AXES[axis]} to wrap them, got {side}")
        if side > shape[axis] and min(shape) < SMALLEST:
            raise InvalidInput(
                f"size: must be at most the size of the image, {shape}, if the image has a side below {SMALLEST} "
                f"pixels, got {side}"
            )
    return rows, columns


def _as_choices(
    overlap: object, free: bool, shape: tuple[int, int], size: tuple[int, int], wrap: Sequence[bool]
) -> list[Choice]:
    """Return the allowed overlaps of each axis. If ``free``, the joint may also change the size of the result."""
    if overlap is None:
        return [_choose(n, m, free) for n, m in zip(shape, size, strict=True)]
    if not free:
        raise InvalidInput("overlap: cannot be combined with size")
    several = list(overlap) if isinstance(overlap, Sequence | np.ndarray) and not isinstance(overlap, str) else None
    several = [overlap] * 2 if several is None else several
    if len(several) != 2:
        raise InvalidInput(f"overlap: must be one number or (rows, columns), got {overlap!r}")
    found = []
    for axis, (each, side) in enumerate(zip(several, shape, strict=True)):
        try:
            chosen = as_int(each, "overlap", 1, side // 2) if wrap[axis] else 0
        except InvalidInput as error:
            raise InvalidInput(f"{error} (at most half of the {side} {AXES[axis]})") from None
        found.append(Choice(chosen, chosen))
    return found


def _choose(side: int, wanted: int, free: bool) -> Choice:
    if free:
        # A larger overlap would leave a single possible border line, which could cross bold features.
        return Choice(max(1, min(LEAST, side // SHARE)), max(1, side * MOST // 16), side)
    # The overlapping parts can be at most half of the image each.
    overlap = min(side - wanted, wanted)
    return Choice(max(1, overlap), overlap, wanted)


def _join_ends(
    colours: Floats,
    elements: WholeElements | None,
    wanted: tuple[int, int],
    choices: Sequence[Choice],
    wrap: Sequence[bool],
    already: Sequence[int],
    refused: Sequence[int],
    watch: Progress,
) -> tuple[SourceMap, dict[int, Joined], dict[str, str]]:
    """Return the source map of a result of at most the image's size, the joint of each axis, and why lengths changed.

    ``already``: axes along which the image is tileable. ``refused``: see `find_joint`.
    """
    shape = (colours.shape[0], colours.shape[1])
    # If the image is more than twice as long as the result, use only its middle, because two parts can overlap at most
    # fully.
    kept = [min(n, 2 * m) if cyclic else m for n, m, cyclic in zip(shape, wanted, wrap, strict=True)]
    corner = [(n - m) // 2 for n, m in zip(shape, kept, strict=True)]
    part = tuple(slice(low, low + n) for low, n in zip(corner, kept, strict=True))
    # Each pixel of the result has the flat index of the image pixel that it is copied from, and the label of its
    # piece.
    place = np.arange(shape[0] * shape[1]).reshape(shape)[part]
    label: NDArray[np.uint32] = np.zeros(place.shape, np.uint32)
    found: dict[int, Joined] = {}
    reasons: dict[str, str] = {}
    # Join columns before rows, as in the paper.
    for axis in (1, 0):
        if not wrap[axis] or axis in already or elements is None:
            continue
        shown = colours.reshape(-1, colours.shape[-1]).take(place, axis=0) if found else colours[part]
        depth = elements.depth.take(place) if found else elements.depth[part]
        choice = choices[axis]
        if elements.side > ELEMENT * place.shape[axis]:
            choice = replace(choice, covered=DEAR)
        elif elements.is_out_of_step(axis, place.shape[axis]):
            # If the length may be any multiple of the period, prefer the largest one.
            choice = replace(choice, covered=DEAR, loss=PERIODIC)
        elif elements.regular:
            choice = replace(choice, covered=REGULAR)
        joined = find_joint(
            make_levels(shown, depth),
            axis,
            choice,
            closed=bool(found) or 1 - axis in already,
            progress=lambda share, axis=axis: watch(f"join {AXES[axis]}", share),  # type: ignore[misc]
            refused=refused[axis],
        )
        line, piece = lay_out(place.shape[1 - axis], joined)
        line, piece = np.moveaxis(line, 0, axis), np.moveaxis(piece, 0, axis)
        place = np.take_along_axis(place, line, axis)
        label = np.take_along_axis(label, line, axis) * np.uint32(len(PIECES)) + piece if found else piece
        found[axis] = joined
        if choice.period and not joined.joint.cover:
            reasons[AXES[axis]] = _give_reason(joined, elements, axis, shape[axis])
    coordinates = np.stack(np.divmod(place, shape[1]), axis=-1).astype(np.float32)
    return SourceMap.from_coordinates(coordinates, shape, label=label), found, reasons


def _give_reason(joined: Joined, elements: WholeElements, axis: int, side: int) -> str:
    """Return the reason why an axis became shorter, as report text."""
    length, period = joined.joint.period, elements.find_period(axis)
    if times := elements.count_periods(axis, length):
        return f"{side} -> {length} pixels: {times} whole periods of about {period:.1f}"
    if elements.side > ELEMENT * side:
        return f"{side} -> {length} pixels: elements are large, and fewer are cut at this length"
    if elements.is_out_of_step(axis, side):
        return f"{side} -> {length} pixels: no multiple of the period of about {period:.1f} fits, and the ends fit better here"
    return f"{side} -> {length} pixels: a joint that keeps the length costs {joined.dearer:.1f} times as much"


def _describe(joined: Joined) -> dict[str, object]:
    """Return the report entry of the joint of one axis."""
    joint, edges = joined.joint, sum(cut.edges for cut in joined.cuts)
    cost = sum(cut.value for cut in joined.cuts)
    return {
        "overlap": 0 if joint.cover else joint.width,
        "cover": joint.cover,
        "joints_tried": joined.tried,
        "cost": round(cost, 4),
        "mean_seam_cost": round(cost / max(edges, 1), 4),
    }

"""Measure whether an image is tileable: how visible its borders and the seams inside it are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
from typing import Any

from texrs._arrays import as_image, guidance
from texrs._typing import Array, Floats
from texrs.errors import InvalidInput
from texrs.exemplar import Exemplar
from texrs.exemplar.regularity import find_lattice
from texrs.materials import Material
from texrs.source_map import SourceMap
from texrs.tiling._steps import measure_steps
from texrs.tiling.borders import SEEN, measure_border

AXES = ("rows", "columns")


@dataclass(frozen=True, slots=True)
class Tiling:
    """Visibility of the borders between copies of an image, and of the seams inside it.

    Attributes
    ----------
    seam : (float or None, float or None)
        Boldness of the borders between the last and the first row, and between the last and the first column.
        A border of 1 is as bold as the boldest lines elsewhere in the image. None: fewer than 8 lines.
    place : ((int, int) or None, (int, int) or None)
        Boldest part of each border: its first pixel along the border, and the first pixel after it.
    maps : mapping of str to Tiling
        Result for each map of a material. The other attributes are those of the map with the boldest border. Empty for
        an image.
    step : (float or None, float or None)
        Boldness of the steps across seams of the source map: between rows, and between columns. A step of 1 is as
        bold as the boldest lines elsewhere in the image. None: no source map, or no seam of a quarter of a side.

    Examples
    --------
    >>> from texrs import Tiling
    >>> Tiling((0.9, 2.5), ((0, 16), (32, 48))).tiles
    (True, False)

    """

    seam: tuple[float | None, float | None]
    place: tuple[tuple[int, int] | None, tuple[int, int] | None]
    maps: Mapping[str, Tiling] = field(default_factory=dict)
    step: tuple[float | None, float | None] = (None, None)

    @property
    def visible(self) -> bool:
        """Whether a seam inside the image is visible: ``step`` above 1.25."""
        return max(step or 0.0 for step in self.step) > SEEN

    @property
    def tiles(self) -> tuple[bool, bool]:
        """Whether the image is tileable along the rows and along the columns: ``seam`` at most 1.25."""
        rows, columns = (seam is not None and seam <= SEEN for seam in self.seam)
        return rows, columns

    def report(self) -> dict[str, Any]:
        """Return the measured values as JSON types.

        Returns
        -------
        dict
            ``rows`` and ``columns``, each with ``tiles``, ``seam``, ``place`` and ``step``; ``maps`` for a material.

        Examples
        --------
        >>> from texrs import Tiling
        >>> Tiling((0.9, 2.5), ((0, 16), (32, 48))).report()["columns"]
        {'tiles': False, 'seam': 2.5, 'place': [32, 48], 'step': None}

        """
        made: dict[str, Any] = {
            name: {"tiles": tiles, "seam": seam, "place": None if place is None else list(place), "step": step}
            for name, tiles, seam, place, step in zip(AXES, self.tiles, self.seam, self.place, self.step, strict=True)
        }
        if self.maps:
            made["maps"] = {name: each.report() for name, each in self.maps.items()}
        return made


def check_tiling(image: Array | Exemplar | Material, source_map: SourceMap | None = None) -> Tiling:
    """Check whether an image tiles: whether copies side by side have no visible border between them.

    The step across the border is compared with the steps at other lines of the image. This is done at several scales,
    along the whole border and in short parts of it. With a source map, the seams inside the image are compared with
    other places as well. Results of `tile` have such seams.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array, Exemplar or Material
        The image, any real dtype. Each map of a material is checked.
    source_map : SourceMap, optional
        Source map of the image, (H, W): the attribute ``source_map`` of a result. Default: only borders are checked.

    Returns
    -------
    Tiling
        Attributes ``tiles``, ``seam`` and ``step``, each (rows, columns). ``tiles`` is wrong for about 2 % of the
        invisible borders and for 7 % of the visible ones.

    Raises
    ------
    InvalidInput
        The argument is not an image, or the source map has another size.

    Examples
    --------
    >>> import texrs
    >>> pebbles = texrs.samples.pebbles((96, 96)).image
    >>> made = texrs.tile(pebbles)
    >>> texrs.check_tiling(pebbles).tiles, texrs.check_tiling(made.image, made.source_map).tiles
    ((False, False), (True, True))

    """
    if not isinstance(image, Material):
        known = image.guidance if isinstance(image, Exemplar) else guidance(as_image(image, "image"))
        return measure_tiling(known, source=source_map)
    maps = {
        name: measure_tiling(guidance(as_image(each.pixels, name)), source=source_map) for name, each in image.items()
    }
    boldest = [max(maps.values(), key=lambda each, axis=axis: each.seam[axis] or 0.0) for axis in range(2)]  # type: ignore[misc]
    rows, columns = boldest
    down, across = (max((each.step[axis] for each in maps.values()), key=lambda step: step or 0.0) for axis in range(2))
    return Tiling((rows.seam[0], columns.seam[1]), (rows.place[0], columns.place[1]), maps, (down, across))


def measure_tiling(
    guide: Floats,
    wrap: Sequence[bool] = (True, True),
    *,
    regular: bool = True,
    source: SourceMap | None = None,
    enough: float = inf,
) -> Tiling:
    """Measure the borders of a guide (H, W, C) along the axes that wrap, and the seams of its source map.

    ``regular``: whether the image can have a lattice. ``enough``: boldness above which a border is not measured
    further.
    """
    if source is not None and not isinstance(source, SourceMap):
        raise InvalidInput(f"source_map: must be a source map, got {type(source).__name__}")
    if source is not None and source.shape != guide.shape[:2]:
        raise InvalidInput(f"source_map: must have the size of the image, {guide.shape[:2]}, got {source.shape}")
    borders = [measure_border(guide, axis, enough=enough) if cyclic else None for axis, cyclic in enumerate(wrap)]
    if regular and any(each is not None and each.tiles for each in borders):
        # Copies that cover the seams of a tileable image are not a lattice.
        lattice = find_lattice(guide, far=False)
        borders = [each and measure_border(guide, axis, lattice) for axis, each in enumerate(borders)]
    rows, columns = (None if each is None else each.figure for each in borders)
    down, across = (None if each is None else (each.start, each.stop) for each in borders)
    step = (None, None) if source is None else measure_steps(guide, source, wrap)
    return Tiling((rows, columns), (down, across), step=step)


def find_tiled(image: Exemplar | Material, wrap: Sequence[bool]) -> list[int]:
    """Return the axes among ``wrap`` along which an image, or every map of a material, is tileable."""
    maps = [image] if isinstance(image, Exemplar) else [Exemplar(each.pixels) for each in image.values()]
    left = list(wrap)
    for each in maps:
        if any(left):
            left = list(measure_tiling(each.guidance, left, enough=SEEN).tiles)
    return [axis for axis, tiles in enumerate(left) if tiles]


def check_result(image: Array, source: SourceMap | None, wrap: Sequence[bool], *, regular: bool) -> Tiling:
    """Measure the borders of a result along the axes that wrap, and the steps across the seams of its source map."""
    return measure_tiling(guidance(as_image(image)), wrap, regular=regular, source=source)


def report_tiling(found: Tiling, wrap: Sequence[bool]) -> dict[str, Any]:
    """Return the report entries of the axes along which a result wraps."""
    report = found.report()
    return {name: report[name] for name, cyclic in zip(AXES, wrap, strict=True) if cyclic}

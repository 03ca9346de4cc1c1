"""Whether a picture tiles, and how bold its border is if it does not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from texrs._arrays import as_image, guidance
from texrs._typing import Array, Floats
from texrs.exemplar import Exemplar
from texrs.exemplar.regularity import find_lattice
from texrs.materials import Material
from texrs.tiling._borders import SEEN, measure_border

AXES = ("rows", "columns")


@dataclass(frozen=True, slots=True)
class Tiling:
    """How bold the borders between copies of a picture are.

    Attributes
    ----------
    seam : (float or None, float or None)
        Boldness of the borders between the last and the first row, and between the last and the first column.
        The value 1 means as bold as the boldest lines elsewhere in the image. None: fewer than 8 lines.
    place : ((int, int) or None, (int, int) or None)
        Where each border is boldest: first pixel along the border, and first pixel after that.
    maps : mapping of str to Tiling
        Each map of a material; ``seam`` and ``place`` are those of the boldest map. Empty for a picture.

    Examples
    --------
    >>> from texrs import Tiling
    >>> Tiling((0.9, 2.5), ((0, 16), (32, 48))).tiles
    (True, False)

    """

    seam: tuple[float | None, float | None]
    place: tuple[tuple[int, int] | None, tuple[int, int] | None]
    maps: Mapping[str, Tiling] = field(default_factory=dict)

    @property
    def tiles(self) -> tuple[bool, bool]:
        """Whether the picture tiles along the rows and along the columns: a seam of at most 1.25."""
        rows, columns = (seam is not None and seam <= SEEN for seam in self.seam)
        return rows, columns

    def report(self) -> dict[str, Any]:
        """Return the figures as JSON types.

        Returns
        -------
        dict
            ``rows`` and ``columns``, each with ``tiles``, ``seam`` and ``place``; ``maps`` for a material.

        Examples
        --------
        >>> from texrs import Tiling
        >>> Tiling((0.9, 2.5), ((0, 16), (32, 48))).report()["columns"]
        {'tiles': False, 'seam': 2.5, 'place': [32, 48]}

        """
        made: dict[str, Any] = {
            name: {"tiles": tiles, "seam": seam, "place": None if place is None else list(place)}
            for name, tiles, seam, place in zip(AXES, self.tiles, self.seam, self.place, strict=True)
        }
        if self.maps:
            made["maps"] = {name: each.report() for name, each in self.maps.items()}
        return made


def check_tiling(image: Array | Exemplar | Material) -> Tiling:
    """Check whether a picture tiles: whether copies side by side have no visible border between them.

    The step across the border is compared with the steps between other lines of the image. This is done at several
    scales, on the whole border and on each part of it.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array, Exemplar or Material
        The picture, any real dtype. Each map of a material is checked.

    Returns
    -------
    Tiling
        Attributes ``tiles`` and ``seam``, each (rows, columns). It is wrong for about 2 % of the borders that tile and for
        7 % of those that do not.

    Raises
    ------
    InvalidInput
        Not a picture.

    Examples
    --------
    >>> import texrs
    >>> pebbles = texrs.samples.pebbles((96, 96)).image
    >>> texrs.check_tiling(pebbles).tiles, texrs.check_tiling(texrs.tile(pebbles).image).tiles
    ((False, False), (True, True))

    """
    if not isinstance(image, Material):
        known = image.guidance if isinstance(image, Exemplar) else guidance(as_image(image, "image"))
        return measure_tiling(known)
    maps = {name: measure_tiling(guidance(as_image(each.pixels, name))) for name, each in image.items()}
    boldest = [max(maps.values(), key=lambda each, axis=axis: each.seam[axis] or 0.0) for axis in range(2)]  # type: ignore[misc]
    rows, columns = boldest
    return Tiling((rows.seam[0], columns.seam[1]), (rows.place[0], columns.place[1]), maps)


def measure_tiling(guide: Floats, wrap: Sequence[bool] = (True, True), *, regular: bool = True) -> Tiling:
    """Return the tiling of a guide (H, W, C), along some axes only; ``regular``: whether it can be on a lattice."""
    borders = [measure_border(guide, axis) if cyclic else None for axis, cyclic in enumerate(wrap)]
    if regular and any(each is not None and each.tiles for each in borders):
        lattice = find_lattice(guide)
        borders = [each and measure_border(guide, axis, lattice) for axis, each in enumerate(borders)]
    rows, columns = (None if each is None else each.figure for each in borders)
    down, across = (None if each is None else (each.start, each.stop) for each in borders)
    return Tiling((rows, columns), (down, across))


def find_tiled(image: Exemplar | Material, wrap: Sequence[bool]) -> list[int]:
    """Return the axes along which a picture tiles, or each map of a material, of some axes."""
    maps = [image] if isinstance(image, Exemplar) else [Exemplar(each.pixels) for each in image.values()]
    left = list(wrap)
    for each in maps:
        if any(left):
            left = list(measure_tiling(each.guidance, left).tiles)
    return [axis for axis, tiles in enumerate(left) if tiles]


def report_tiling(image: Array, wrap: Sequence[bool], *, regular: bool) -> dict[str, Any]:
    """Return the report of a result about the axes along which it wraps."""
    found = measure_tiling(guidance(as_image(image)), wrap, regular=regular).report()
    return {name: found[name] for name, cyclic in zip(AXES, wrap, strict=True) if cyclic}

"""What each verb takes, as measured: bytes of a pixel of the example and of the result."""

from __future__ import annotations

import math
import numbers
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from texrs.errors import InvalidInput

if TYPE_CHECKING:
    # Numpy would come with it.
    from numpy.typing import DTypeLike

__all__ = ["estimate_memory"]


@dataclass(frozen=True, slots=True)
class Cost:
    """Bytes that a verb takes, as ``benches/memory_table.py`` measures them.

    Two things are done one after the other: the examples are analysed, then the result is made beside what is known of them.
    """

    analysed: float
    """Of a pixel of the examples, while they are analysed."""
    known: float
    """Of a pixel of the examples, while the result is made."""
    made: float
    """Of a pixel of the result, beside its colours."""
    fixed: float = 3e6
    """Whatever the sizes."""
    several: float = 0
    """Of a pixel of the result, for each example where there are several."""
    field: float = 0
    """Of a pixel of the result, where a field says how it is turned."""

    def count(self, examples: int, of: int, result: int, colours: int, field: bool) -> float:
        """Return the bytes for so many pixels, so many examples, and so many bytes of their colours."""
        point = self.made + COPIES * colours + self.several * of * (of > 1) + self.field * field
        return self.fixed + max(self.analysed * examples, self.known * examples + point * result)


COPIES = 4
"""How often the colours of a result are there at once."""
BEYOND = 600
"""Bytes of a pixel that splice lets a texture go on by, where it gives elements or an arrangement to something larger."""
COSTS: dict[str, dict[str | None, Cost]] = {
    "design": {None: Cost(1000, 680, 73, several=55)},
    "splice": {None: Cost(0, 350, 100)},
    "self_splice": {None: Cost(0, 186, 452)},
    "perspective": {None: Cost(0, 330, 190)},
    "solid": {None: Cost(0, 300, 59, field=40), "fast": Cost(0, 50, 56, field=40)},
    "synthesize": {None: Cost(0, 268, 52, field=22), "fast": Cost(0, 230, 62, field=22)},
    "tile": {None: Cost(0, 40, 80, fixed=6e6)},
    "inpaint": {None: Cost(0, 0, 60, fixed=14e6)},
    "extend": {None: Cost(0, 0, 384, fixed=20e6)},
    "rectify": {None: Cost(0, 0, 78, fixed=12e6)},
    "remove": {None: Cost(0, 0, 360, fixed=16e6)},
    "analyse": {None: Cost(480, 0, 0, fixed=14e6)},
    "CornerTiles": {None: Cost(1000, 680, 90)},
}
"""By verb, and by the ``method`` or the ``quality`` that takes another amount than the others."""


def estimate_memory(
    verb: str,
    exemplar: Sequence[int] | Sequence[Sequence[int]],
    size: Sequence[int] | None = None,
    *,
    dtype: DTypeLike = "uint8",
    method: str | None = None,
    field: bool = False,
) -> int:
    """Return about how many bytes a verb takes, beside what the process has already.

    Parameters
    ----------
    verb : str
        Its name: design, splice, self_splice, perspective, solid, synthesize, tile, inpaint, extend, rectify, remove,
        analyse (`texrs.elements.analyse`), or CornerTiles (`texrs.CornerTiles`).
    exemplar : sequence of int, or a sequence of them
        Shape of the example, (H, W), (H, W, C), or for solid (D, H, W[, C]); of several their shapes.
    size : sequence of int, optional
        Of the result, which of a CornerTiles is its atlas, nine tiles a side; by default that of the first example.
    dtype : dtype
        Of the example.
    method : str, optional
        The ``method`` or ``quality`` that is asked for.
    field : bool
        Whether solid or synthesize are given a field that varies.

    Returns
    -------
    int
        Bytes. ``benches/memory_table.py`` compares it with the peak that is measured, of textures of 256 pixels a side and
        more; splice and perspective take twice as much for some textures as for others.

    Raises
    ------
    InvalidInput
        No such verb, or no shapes of examples.

    Examples
    --------
    >>> import texrs
    >>> needed = texrs.limits.estimate_memory("design", (256, 256, 3), (2048, 2048))
    >>> 300e6 < needed < 450e6
    True

    """
    if not isinstance(verb, str) or verb not in COSTS:
        raise InvalidInput(f"verb: must be one of {', '.join(COSTS)}; got {verb!r}")
    axes = 3 if verb == "solid" else 2
    shapes = [_as_shape(each, axes) for each in _list_shapes(exemplar)]
    result = shapes[0][:axes] if size is None else _as_shape(size, axes, "size")
    from numpy import dtype as make_dtype

    try:
        itemsize = make_dtype(dtype).itemsize
    except (TypeError, ValueError):
        raise InvalidInput(f"dtype: needs one of NumPy, got {dtype!r}") from None
    if not isinstance(field, bool):
        raise InvalidInput(f"field: needs True or False, got {field!r}")
    costs = COSTS[verb]
    cost = costs[method if isinstance(method, str) and method in costs else None]
    colours = itemsize * math.prod(shapes[0][axes:])
    pixels = sum(math.prod(shape[:axes]) for shape in shapes)
    return int(cost.count(pixels, len(shapes), math.prod(result[:axes]), colours, field))


def _list_shapes(value: object) -> list[object]:
    """Return one shape, or several, as a list of them."""
    if isinstance(value, Sequence) and not isinstance(value, str | bytes | range) and len(value) > 0:
        return list(value) if isinstance(value[0], Sequence) else [value]
    return [value]


def _as_shape(value: Any, axes: int, name: str = "exemplar") -> tuple[int, ...]:
    """Check a shape with or without channels."""
    if isinstance(value, Sequence) and not isinstance(value, str | bytes) and len(value) in (axes, axes + 1):
        sides = tuple(value)
        if all(not isinstance(n, bool) and isinstance(n, numbers.Integral) and int(n) > 0 for n in sides):
            return tuple(map(int, sides))
    raise InvalidInput(f"{name}: needs a shape of {axes} sides, or with channels, got {value!r}")

"""Estimate the memory of each verb, from measured bytes per pixel of the example and of the result."""

from __future__ import annotations

import math
import numbers
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from texrs.errors import InvalidInput

if TYPE_CHECKING:
    # Import the type only for type checkers, because the import would load NumPy.
    from numpy.typing import DTypeLike

__all__ = ["estimate_memory"]


@dataclass(frozen=True, slots=True)
class Cost:
    """Memory of a verb in bytes, as measured by ``benches/memory_table.py``.

    A verb first analyses the examples. Then it computes the result, while the results of the analysis stay in memory.
    """

    analysed: float
    """Bytes per pixel of the examples during the analysis."""
    known: float
    """Bytes per pixel of the examples while the result is computed."""
    made: float
    """Bytes per pixel of the result, without its colours."""
    fixed: float = 3e6
    """Bytes that do not depend on the sizes."""
    several: float = 0
    """Bytes per pixel of the result for each example, if there are several examples."""
    field: float = 0
    """Bytes per pixel of the result if a field varies."""

    def count(self, examples: int, of: int, result: int, colours: int, field: bool) -> float:
        """Return the bytes for numbers of pixels, a number of examples, and the bytes of the colours of a pixel."""
        point = self.made + COPIES * colours + self.several * of * (of > 1) + self.field * field
        return self.fixed + max(self.analysed * examples, self.known * examples + point * result)


COPIES = 4
"""Number of copies of the result's colours that are in memory at the same time."""
BEYOND = 600
"""Bytes per pixel of an extended texture. `splice` extends a texture to cover a larger result."""
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
"""Costs by verb, and by the ``method`` or ``quality`` if their costs differ."""


def estimate_memory(
    verb: str,
    exemplar: Sequence[int] | Sequence[Sequence[int]],
    size: Sequence[int] | None = None,
    *,
    dtype: DTypeLike = "uint8",
    method: str | None = None,
    field: bool = False,
) -> int:
    """Estimate the bytes that a verb needs, in addition to the current memory of the process.

    Parameters
    ----------
    verb : str
        Name of the verb: design, splice, self_splice, perspective, solid, synthesize, tile, inpaint, extend, rectify,
        remove, analyse (`texrs.elements.analyse`), or CornerTiles (`texrs.CornerTiles`).
    exemplar : sequence of int, or sequence of such sequences
        Shape of the example, (H, W) or (H, W, C), or for solid (D, H, W[, C]). For several examples, a sequence of
        their shapes.
    size : sequence of int, optional
        Size of the result. For CornerTiles, the size of its atlas of nine tiles a side. Default: the size of the first
        example.
    dtype : dtype
        Dtype of the example. Default: "uint8".
    method : str, optional
        Value of ``method`` or ``quality``. Default: the default value of the verb.
    field : bool
        If True, the call of solid or synthesize has a field that varies. Default: False.

    Returns
    -------
    int
        Number of bytes. ``benches/memory_table.py`` compares it with the measured peak, for textures of at least 256
        pixels a side. The verbs splice and perspective need twice as much for some textures as for others.

    Raises
    ------
    InvalidInput
        If the verb does not exist, or the shapes of the examples are wrong.

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
        raise InvalidInput(f"dtype: must be a NumPy dtype, got {dtype!r}") from None
    if not isinstance(field, bool):
        raise InvalidInput(f"field: must be True or False, got {field!r}")
    costs = COSTS[verb]
    cost = costs[method if isinstance(method, str) and method in costs else None]
    colours = itemsize * math.prod(shapes[0][axes:])
    pixels = sum(math.prod(shape[:axes]) for shape in shapes)
    return int(cost.count(pixels, len(shapes), math.prod(result[:axes]), colours, field))


def _list_shapes(value: object) -> list[object]:
    """Return one shape or several shapes as a list."""
    if isinstance(value, Sequence) and not isinstance(value, str | bytes | range) and len(value) > 0:
        return list(value) if isinstance(value[0], Sequence) else [value]
    return [value]


def _as_shape(value: Any, axes: int, name: str = "exemplar") -> tuple[int, ...]:
    """Check a shape with or without channels."""
    if isinstance(value, Sequence) and not isinstance(value, str | bytes) and len(value) in (axes, axes + 1):
        sides = tuple(value)
        if all(not isinstance(n, bool) and isinstance(n, numbers.Integral) and int(n) > 0 for n in sides):
            return tuple(map(int, sides))
    raise InvalidInput(
        f"{name}: must be a shape of {axes} sides, optionally followed by the number of channels, got {value!r}"
    )

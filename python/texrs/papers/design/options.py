"""How `texrs.design` deforms elements: what a user may choose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from texrs._arrays import as_bool, as_float, as_int
from texrs.errors import InvalidInput
from texrs.papers.design.logistic_map import iterate

__all__ = ["DeformationOptions"]


@dataclass(frozen=True, slots=True, kw_only=True)
class DeformationOptions:
    """How the elements of an exemplar are deformed (section 3.3 of the paper).

    Attributes
    ----------
    operations : int, optional
        Deformations that are combined on each element, one after the other, 0 to 8. By default 2, and 1 in heaps and as
        printed. In a heap the first one takes another element's place, turned and scaled to its shape, and others turn,
        mirror and scale it as far as it still fills that. On a lattice and where no separate elements are found there is one,
        a move from place to place: all else shows. The report says which it is, ``report["arrangement"]``.
    translate : float
        Longest translation, as a share of the exemplar's shorter side, 0 to 0.5. In a heap and on a lattice elements go as
        far as the next place that fits, unless this is 0.
    rotate : float, optional
        Largest rotation in degrees, 0 to 180; 0 for textures lit from one side or with letters. By default 60, but 0
        where the example has directions of its own (bark, brickwork), no separate elements, or a lattice.
    scale : (float, float)
        Least and largest scaling, within 0.5 to 2.
    allow_mirror : bool, optional
        Whether elements, backgrounds and patches may be mirrored; False for lettered textures, True for both axes whatever
        they show. By default along those axes where nothing tells the example from its mirror image, as light from one side
        or a slant does; along none where ``rotate=0`` is given, which says that the example has an upper side.
    start : float, optional
        Start of the logistic map (Eq. 2), within (-1, 1); the seed draws one for each element by default.
    growth_rate : float
        The lambda of the logistic map (Eq. 2), 0 to 2; below about 1.4 its sequence is periodic.
    u : int
        Divisor of a value h of the logistic map, 1 to 256. The operation is mod(mod(h, u), v). As printed the extent is
        n = mod(h, u) as well, so the larger u the finer are the extents; by default it is another value's.
    v : int
        Number of operations to choose from, 1 to 4: translation, rotation, mirror and scale, in this order.
    xi : float
        As printed, what n is multiplied by for the scaling extent e, 0.001 to 2; it is brought within ``scale``. By default
        extents are drawn within ``scale`` evenly.

    Raises
    ------
    InvalidInput
        A field of another type or out of range, or a start that the logistic map does not leave; the message names it.

    Examples
    --------
    >>> DeformationOptions(rotate=20, allow_mirror=False).rotate
    20.0

    """

    operations: int | None = None
    translate: float = 0.12
    rotate: float | None = None
    scale: tuple[float, float] = (0.8, 1.2)
    allow_mirror: bool | None = None
    start: float | None = None
    growth_rate: float = 2.0
    u: int = 10
    v: int = 4
    xi: float = 0.13

    def __post_init__(self) -> None:
        if not isinstance(self.scale, Sequence) or isinstance(self.scale, str) or len(self.scale) != 2:
            raise InvalidInput(f"scale: needs (least, largest), got {self.scale!r}")
        low, high = (as_float(s, "scale", 0.5, 2) for s in self.scale)
        if low > high:
            raise InvalidInput(f"scale: the least comes first, got {self.scale!r}")
        values: dict[str, object] = {
            "operations": None if self.operations is None else as_int(self.operations, "operations", 0, 8),
            "translate": as_float(self.translate, "translate", 0, 0.5),
            "rotate": None if self.rotate is None else as_float(self.rotate, "rotate", 0, 180),
            "scale": (low, high),
            "allow_mirror": None if self.allow_mirror is None else as_bool(self.allow_mirror, "allow_mirror"),
            "growth_rate": as_float(self.growth_rate, "growth_rate", 0, 2),
            "u": as_int(self.u, "u", 1, 256),
            "v": as_int(self.v, "v", 1, 4),
            "xi": as_float(self.xi, "xi", 0.001, 2),
        }
        if self.start is not None:
            iterate(self.start, self.growth_rate)
        for name, value in values.items():
            object.__setattr__(self, name, value)

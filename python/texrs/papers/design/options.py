"""Options of `texrs.design` that control how elements are deformed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from texrs._arrays import as_bool, as_float, as_int
from texrs.errors import InvalidInput
from texrs.papers.design.logistic_map import iterate

__all__ = ["DeformationOptions"]


@dataclass(frozen=True, slots=True, kw_only=True)
class DeformationOptions:
    """Options that control how the elements of an exemplar are deformed (section 3.3 of the paper).

    Attributes
    ----------
    operations : int, optional
        Number of deformations that are applied in sequence to each element, 0 to 8. The first deformation in a heap
        moves the element to the place of another element, and fits it to the shape of that element. Further
        deformations turn, mirror and scale the element as long as it still fills that place. On a lattice, and if
        elements are cells of a grid, only translations are used, because other deformations would be visible.
        ``report["arrangement"]`` contains the arrangement that was found. Default: 2, but 1 in heaps and with
        ``method="paper"``.
    translate : float
        Longest translation, as a share of the exemplar's shorter side, 0 to 0.5. Elements of a heap move to the place
        of a similar element at any distance. On a lattice, elements move at least to the nearest places. If 0,
        elements do not change places. Default: 0.12.
    rotate : float, optional
        Largest rotation in degrees, 0 to 180. Use 0 for textures with light from one side or with letters. Default:
        60, but 0 if the example has a preferred direction (bark, brickwork), cells instead of elements, or a lattice.
    scale : (float, float)
        Smallest and largest scale factor, 0.5 to 2. Default: 0.8 to 1.2.
    allow_mirror : bool, optional
        If True, elements, backgrounds and patches may be mirrored along both axes. If False, as for letters, they are
        not mirrored. With ``rotate=0`` the example has an upper side. Default: True, except if ``rotate`` is 0, and
        except along axes where light or slanted elements would reveal the mirroring.
    start : float, optional
        Initial value of the logistic map (Eq. 2), within (-1, 1). Default: drawn from the seed for each element.
    growth_rate : float
        Growth rate of the logistic map (lambda in Eq. 2), 0 to 2. Below about 1.4 the sequence is periodic. Default:
        2.
    u : int
        Divisor u in mod(mod(h, u), v), 1 to 256, which selects the operation. The value h is from the logistic map,
        and v is the number of operations. With ``method="paper"``, the extent is n = mod(h, u), so a larger u gives
        finer extents. Otherwise the extent comes from another value of the map. Default: 10.
    v : int
        Number of operations to choose from, 1 to 4: translation, rotation, mirror and scale, in this order. Default:
        4.
    xi : float
        Factor xi of the scale factor e = xi n with ``method="paper"``, 0.001 to 2, where n = mod(h, u). The scale
        factor is limited to ``scale``. Other methods ignore xi, and draw scale factors within ``scale``. Default:
        0.13.

    Raises
    ------
    InvalidInput
        An attribute has the wrong type or is out of range, or the logistic map reaches a fixed point from ``start``.
        The message names the attribute.

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
            raise InvalidInput(f"scale: must be a pair (smallest, largest), got {self.scale!r}")
        low, high = (as_float(s, "scale", 0.5, 2) for s in self.scale)
        if low > high:
            raise InvalidInput(f"scale: must have the smallest factor first, got {self.scale!r}")
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

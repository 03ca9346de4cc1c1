"""What a caller asks of `texrs.perspective`, checked before anything is done."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from texrs import scale_maps
from texrs._arrays import as_choice, as_float, as_method, as_seed, as_size, as_wrap, power_single
from texrs._typing import Array, Floats, Interpolation
from texrs.errors import InvalidInput
from texrs.exemplar import Exemplar, as_exemplar
from texrs.materials import Material
from texrs.papers.perspective.sizes import Sizes, check_sizes
from texrs.planes._choose import measure_scale
from texrs.scale_maps import Measuring
from texrs.scale_maps._kinds import AREAS, Kind, as_kind, find_kind
from texrs.scale_maps._maps import as_map

__all__ = ["Method", "Request"]

Method: TypeAlias = Literal["paper"] | None

LEAST = 16
"""Least side of an exemplar."""


@dataclass(frozen=True, slots=True, eq=False)
class Request:
    """The arguments of a synthesis, checked.

    Attributes
    ----------
    exemplar : Exemplar
        What it grows from.
    scale : (H, W) float32
        How large its elements are.
    target : (rows, columns) float32
        How large those of the output are to be.
    kinds : (kind, kind)
        What the two maps hold; None where nobody says.
    method : {None, "paper"}
        Which algorithm.
    strength : float
        How much the scale counts.
    sizes : {"auto", True, False} or sequence of float
        The copies that may be copied from.
    wrap : (bool, bool)
        Axes along which the output is to repeat.
    seed : int
        Chooses the texture.
    interpolation : {"nearest", "linear", "cubic"}
        Between the exemplar's samples, in the last look-up.

    """

    exemplar: Exemplar
    scale: Floats
    target: Floats
    kinds: tuple[Kind | None, Kind | None]
    method: Method
    strength: float
    sizes: Sizes
    wrap: tuple[bool, ...]
    seed: int
    interpolation: Interpolation

    @classmethod
    def check(
        cls,
        exemplar: Array | Exemplar | Material,
        scale_map: Array | str,
        size: int | Sequence[int] | None,
        *,
        target: Array | None,
        kind: Kind | None,
        measuring: Measuring | None,
        method: Method,
        scale_weight: float,
        augment_scales: Sizes,
        wrap: bool | Sequence[bool],
        seed: int,
        interpolation: Interpolation,
    ) -> Request:
        """Return the request of a caller, or raise what is wrong with it."""
        known = as_exemplar(exemplar, minimum=LEAST)
        # What is cheap to check comes before what is measured.
        strength = as_float(scale_weight, "scale_weight", 0, 16)
        as_method(method, None, "paper")
        as_choice(interpolation, "interpolation", ("nearest", "linear", "cubic"))
        check_sizes(augment_scales)
        closed, number = as_wrap(wrap), as_seed(seed)
        said = None if kind is None else as_kind(kind)
        asked = None if target is None else as_map(target, "target")
        if size is None:
            size = [2 * n for n in known.shape] if asked is None else asked.shape
        sides = as_size(size)
        shape = (sides[0], sides[1])
        if isinstance(scale_map, str):
            as_choice(scale_map, "scale_map", ("auto",))
            scale = find_scale(known, measuring)
        elif measuring is not None:
            raise InvalidInput("measuring: a scale map is given, so that nothing is measured; leave out one of them")
        else:
            scale = scale_map
        mine = as_map(scale, "scale_map", known.shape)
        kinds = find_kind(scale) or said, find_kind(scale if target is None else target) or said
        wanted = scale_maps.resample(mine if asked is None else asked, shape)
        check_wrap(wanted, closed, asked is None)
        return cls(known, mine, wanted, kinds, method, strength, augment_scales, closed, number, interpolation)

    def match_kinds(self, power: float) -> Request:
        """Return the request with a target that holds what the exemplar's map does: a power of it holds widths."""
        theirs = {None: power, "width": 1.0, "area": AREAS}[self.kinds[1]]
        return self if theirs == power else replace(self, target=power_single(self.target, theirs / power))


def find_scale(exemplar: Exemplar, measuring: Measuring | None) -> Floats:
    """Return how large elements are in an exemplar of which nothing is said, or only how that is measured."""
    if measuring is None:
        return measure_scale(exemplar.image, np.ones(exemplar.shape, np.bool_))
    if not isinstance(measuring, Measuring):
        raise InvalidInput(f"measuring: needs a texrs.scale_maps.Measuring, got {measuring!r}")
    return measuring.measure(exemplar.image)


def check_wrap(target: Floats, wrap: Sequence[bool], stretched: bool) -> None:
    """Refuse a target whose ends do not meet where the output is to repeat."""
    for axis, closed in enumerate(wrap):
        if not closed:
            continue
        logs = np.log(target)
        inner = float(np.abs(np.diff(logs, axis=axis)).max(initial=0.0))
        across = float(np.abs(np.take(logs, 0, axis) - np.take(logs, -1, axis)).max())
        if across > 2 * inner + 0.02:
            name = ("rows", "columns")[axis]
            way = "give a target that repeats" if stretched else "make it repeat"
            raise InvalidInput(
                f"wrap: the target's first and last {name} differ by a factor of {np.exp(across):.2f}, so the result "
                f"cannot repeat along {name}; {way}, or leave wrap off along {name}"
            )

"""What a caller asks of `texrs.perspective`, checked before anything is done."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from texrs import scale_maps
from texrs._arrays import as_choice, as_float, as_method, as_seed, as_size, as_wrap
from texrs._typing import Array, Floats, Interpolation
from texrs.errors import InvalidInput
from texrs.exemplar import Exemplar, as_exemplar
from texrs.papers.perspective.sizes import Sizes, check_sizes
from texrs.planes._choose import measure_scale
from texrs.scale_maps import Measuring
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
    method: Method
    strength: float
    sizes: Sizes
    wrap: tuple[bool, ...]
    seed: int
    interpolation: Interpolation

    @classmethod
    def check(
        cls,
        exemplar: Array | Exemplar,
        scale_map: Array | str,
        size: int | Sequence[int] | None,
        *,
        target: Array | None,
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
        asked = None if target is None else as_map(target, "target")
        if size is None:
            size = [2 * n for n in known.shape] if asked is None else asked.shape
        sides = as_size(size)
        shape = (sides[0], sides[1])
        if isinstance(scale_map, str):
            as_choice(scale_map, "scale_map", ("auto",))
            mine = find_scale(known, measuring)
        elif measuring is not None:
            raise InvalidInput("measuring: a scale map is given, so that nothing is measured; leave out one of them")
        else:
            mine = as_map(scale_map, "scale_map", known.shape)
        wanted = scale_maps.resample(mine if asked is None else asked, shape)
        check_wrap(wanted, closed, asked is None)
        return cls(known, mine, wanted, method, strength, augment_scales, closed, number, interpolation)


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

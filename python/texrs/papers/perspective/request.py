"""Arguments of `texrs.perspective`, checked before the work begins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

import numpy as np

from texrs import scale_maps
from texrs._arrays import (
    as_choice,
    as_float,
    as_method,
    as_seed,
    as_size,
    as_wrap,
    check_work,
    log_single,
    power_single,
)
from texrs._typing import Array, Floats, Interpolation
from texrs.errors import InvalidInput
from texrs.exemplar import Exemplar, as_exemplar
from texrs.materials import Material
from texrs.papers.perspective.directions import as_turn
from texrs.papers.perspective.sizes import Sizes, check_sizes
from texrs.papers.perspective.targets import Surface, as_surface, as_target, find_size, is_map, is_words, read_plane
from texrs.planes import FOV, Plane
from texrs.planes import ScaleEstimate as Measured
from texrs.planes.choose import measure_known_scale
from texrs.scale_maps import Measuring
from texrs.scale_maps.jacobians import measure_sizes
from texrs.scale_maps.kinds import AREAS, Kind, as_kind, find_kind
from texrs.scale_maps.maps import as_map

__all__ = ["Method", "Request"]

Method: TypeAlias = Literal["paper"] | None

LEAST = 16
"""Minimum side of an exemplar, in pixels."""


@dataclass(frozen=True, slots=True, eq=False)
class Request:
    """Checked arguments of `texrs.perspective`.

    Attributes
    ----------
    exemplar : Exemplar
        The example image.
    scale : (H, W) float32
        Size of the exemplar's elements at each pixel.
    target : (rows, columns) float32
        Requested size of elements at each pixel of the output.
    kinds : (kind, kind)
        Quantities in ``scale`` and in ``target``: "width" or "area", or None if unknown.
    measured : texrs.planes.ScaleEstimate, optional
        Element sizes measured in the image, and their confidence.
    plane : texrs.Plane, optional
        Plane that the exemplar shows, if given.
    surface : (rows, columns, 2, 2) float64, optional
        Jacobians of the surface that the output shows. ``target`` contains the sizes of elements on it.
    turn : (rows, columns, 2, 2) float64, optional
        Rotations of the copied texture.
    fov : float
        Angle of view of the exemplar's longer side in degrees.
    method : {None, "paper"}
        Algorithm to use.
    strength : float
        Weight of the requested scale, 0 to 16.
    sizes : {"auto", True, False} or sequence of float
        Resizing of the exemplar, or sizes of its copies.
    wrap : (bool, bool)
        Axes along which the output is periodic.
    seed : int
        Seed of the random choices.
    interpolation : {"nearest", "linear", "cubic"}
        Interpolation between the exemplar's samples in the final look-up.

    """

    exemplar: Exemplar
    scale: Floats
    target: Floats
    kinds: tuple[Kind | None, Kind | None]
    measured: Measured | None
    plane: Plane | None
    surface: Surface | None
    turn: Surface | None
    fov: float
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
        scale_map: Array | Plane | str,
        size: int | Sequence[int] | None,
        *,
        target: Array | Plane | str | None,
        target_green: Literal["up", "down"],
        scale_kind: Kind | None,
        fov: float | None,
        direction: object,
        scale_measurement: Measuring | None,
        method: Method,
        scale_weight: float,
        augment_scales: Sizes,
        wrap: bool | Sequence[bool] | None,
        seed: int,
        interpolation: Interpolation,
    ) -> Request:
        """Return the checked arguments of a call, or raise an error."""
        known = as_exemplar(exemplar, minimum=LEAST)
        # Check arguments before the exemplar is measured, because measurements take longer.
        strength = as_float(scale_weight, "scale_weight", 0, 16)
        as_method(method, None, "paper")
        as_choice(interpolation, "interpolation", ("nearest", "linear", "cubic"))
        check_sizes(augment_scales)
        closed, number = as_wrap(wrap, usual=False), as_seed(seed)
        said = None if scale_kind is None else as_kind(scale_kind)
        angle = FOV if fov is None else as_float(fov, "fov", 1, 170)
        if fov is not None and (isinstance(scale_map, Plane) or is_words(scale_map)):
            raise InvalidInput("fov: cannot be combined with a plane, which has its own field of view")
        as_choice(target_green, "target_green", ("up", "down"))
        # The size of the target is the default size of the result.
        asked = as_target(target, target_green)
        if size is None:
            size = find_size(asked) or [2 * n for n in known.shape]
        sides = as_size(size)
        shape = (sides[0], sides[1])
        check_work("perspective", [known.pixels], shape, method=method)
        surface = None if asked is None or is_map(asked) else as_surface(asked, shape)
        turn = None if direction is None else as_turn(direction, shape, closed)
        if method == "paper" and (surface is not None or turn is not None):
            raise InvalidInput(
                "method: 'paper' cannot be combined with a surface as target or with direction; omit method, or give a scale "
                "map as target and omit direction"
            )
        # Determine the scale map, and resize the target to the size of the result.
        plane, scale, measured = find_scale(known, scale_map, scale_measurement)
        mine = as_map(scale, "scale_map", known.shape)
        kinds = find_kind(scale) or said, find_kind(scale if target is None else target) or said
        if surface is None:
            wanted = scale_maps.resample(mine if asked is None else asked, shape)
            check_wrap(log_single(wanted), wanted, closed, asked is None)
        else:
            sizes = measure_sizes(surface)
            wanted, kinds = sizes.astype(np.float32), (kinds[0], "area")
            check_wrap(surface * sizes[..., np.newaxis, np.newaxis], wanted, closed, False)
        return cls(
            known,
            mine,
            wanted,
            kinds,
            measured,
            plane,
            surface,
            turn,
            angle,
            method,
            strength,
            augment_scales,
            closed,
            number,
            interpolation,
        )

    def describe_measured(self) -> dict[str, Any] | None:
        """Return the measurement of the exemplar's sizes as JSON types, or None if they were given."""
        return None if self.measured is None else self.measured.as_dict()

    def match_kinds(self, power: float) -> Request:
        """Return the arguments with the target converted to the quantity of the exemplar's scale map.

        The exemplar's quantity, raised to ``power``, is a width.
        """
        theirs = {None: power, "width": 1.0, "area": AREAS}[self.kinds[1]]
        return self if theirs == power else replace(self, target=power_single(self.target, theirs / power))


def find_scale(
    exemplar: Exemplar, scale_map: Array | Plane | str, scale_measurement: Measuring | None
) -> tuple[Plane | None, Array, Measured | None]:
    """Return the plane of an exemplar or None, the size of its elements per pixel, and the measurement or None."""
    if scale_measurement is not None and not (isinstance(scale_map, str) and scale_map == "auto"):
        raise InvalidInput(
            "scale_measurement: cannot be combined with a scale map that is given, because it is not measured; omit one of them"
        )
    if is_words(scale_map):
        scale_map = read_plane(scale_map, exemplar.shape, "scale_map")
    if isinstance(scale_map, Plane):
        if scale_map.shape != exemplar.shape:
            raise InvalidInput(
                f"scale_map: a plane must belong to an image of shape {exemplar.shape}, like the exemplar, got "
                f"{scale_map.shape}"
            )
        return scale_map, scale_map.scale_map(), None
    if not isinstance(scale_map, str):
        return None, scale_map, None
    if as_choice(scale_map, "scale_map", ("auto", "front")) == "front":
        return Plane((exemplar.shape[0], exemplar.shape[1]), 0.0), np.ones(exemplar.shape, np.float32), None
    if scale_measurement is None:
        found = measure_known_scale(exemplar.image, np.ones(exemplar.shape, np.bool_))
        return None, found.scale, found
    if not isinstance(scale_measurement, Measuring):
        raise InvalidInput(f"scale_measurement: must be a texrs.scale_maps.Measuring, got {scale_measurement!r}")
    return None, scale_measurement.measure(exemplar.image), None


def check_wrap(values: Array, target: Floats, wrap: Sequence[bool], stretched: bool) -> None:
    """Raise an error if values of a target jump at the border, although the output is periodic along this axis."""
    for axis, closed in enumerate(wrap):
        if not closed:
            continue
        inner = float(np.abs(np.diff(values, axis=axis)).max(initial=0.0))
        across = float(np.abs(np.take(values, 0, axis) - np.take(values, -1, axis)).max())
        if across > 2 * inner + 0.02:
            ratio = np.exp(np.abs(np.subtract(*log_single(np.take(target, [0, -1], axis).swapaxes(0, axis)))).max())
            name = ("rows", "columns")[axis]
            way = "give a target that repeats" if stretched else "make the target repeat"
            raise InvalidInput(
                f"wrap: the target's first and last {name} differ by a factor of {ratio:.2f}; {way}, or turn off wrap "
                f"along {name}"
            )

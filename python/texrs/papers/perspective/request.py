"""Parameters of `texrs.perspective`, checked before the work begins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY
from functools import partial
from typing import Any, Literal, TypeAlias

import numpy as np

from texrs import scale_maps
from texrs._arrays import as_choice, as_size, check_work, log_single, power_single
from texrs._requests import (
    PROGRESS,
    SEED,
    Request,
    Word,
    as_given,
    choice,
    method,
    optional,
    periodic,
    real,
    request,
    tied,
)
from texrs._typing import Array, Floats, Interpolation, Progress
from texrs.errors import InvalidInput
from texrs.exemplar import Exemplar, as_exemplar
from texrs.fields import Field
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

__all__ = ["Perspective"]

Method: TypeAlias = Literal["paper"] | None

LEAST = 16
"""Minimum side of an exemplar, in pixels."""


def as_sizes(value: Sizes, name: str) -> Sizes:
    """Check the sizes of copies."""
    check_sizes(value)
    return value


@request
class Perspective(Request):
    """Parameters of `texrs.perspective`.

    - ``exemplar`` ((H, W) or (H, W, C) array, or Exemplar): Example image, of any real dtype and number of channels,
      at least 16 pixels a side.
    - ``scale_map`` ((H, W) float array, Plane, "auto" or "front"): Size of the exemplar's elements at each pixel,
      above 0, in any unit (`texrs.scale_maps`). A `texrs.Plane`, or a text such as
      ``"plane:slant=50,tilt=90,fov=60"``, gives the sizes on a plane. "auto" uses the plane that is found in the image
      (`texrs.planes.find`), or else measures the sizes (`texrs.planes.measure_scale`). "front" means that all elements
      have the same size. Default: "auto".
    - ``size`` (int or (int, int), optional): Size of the result in pixels. Default: the size of ``target``, or else
      twice the size of the exemplar.
    - ``target`` (array or Plane, optional): Requested size of elements at each pixel of the result, in the units of
      ``scale_map``. It is a scale map, or a surface that the texture is placed on. A `texrs.Plane` or its text gives
      another plane, with elements of size 1 in its middle. Normals (rows, columns, 3) describe a curved surface, seen
      from far away. Coordinates (rows, columns, 2) on a surface, or Jacobians (rows, columns, 2, 2), specify the step
      on the texture for a step of one pixel (`texrs.scale_maps.jacobians_of_normals`,
      `texrs.scale_maps.jacobians_of_coordinates`, `texrs.Plane.jacobians`). A target of another size is resized so
      that its borders are the borders of the result (`texrs.scale_maps.resample`). Default: ``scale_map``, resized.
    - ``target_green`` ({"up", "down"}): Direction of the y axis of normals in ``target``: up (OpenGL) or down
      (DirectX). Default: "up".
    - ``scale_kind`` ({"width", "area"}, optional): Quantity that a map contains, if the map does not state it
      (`texrs.scale_maps.ScaleMap`): "width" (widths across the slope) or "area" (square roots of areas). The target
      has the same quantity. Default: the quantity for which the scale map fits a plane best.
    - ``fov`` (float, optional): Angle of view of the longer side of the exemplar in degrees, 1 to 170. The
      foreshortening of a plane is computed from this angle and the scale map. A ``target`` that is a surface uses it,
      and so does ``direction``. Cannot be combined with a plane as ``scale_map``, which has its own angle. Default: 60
      (`texrs.planes.FOV`).
    - ``direction`` (float, (rows, columns) array or Field, optional): Counter-clockwise rotation of the copied texture
      in degrees: one number, or one per pixel. Maps of another size are resized. A `texrs.fields.Field` with two axes,
      or a text such as ``"circular"`` or ``"zigzag:period=64,angle=30"``, gives the rotation of the field. On a plane
      or another surface, the texture rotates within this surface. Default: 0.
    - ``scale_measurement`` (Measuring, optional): Options that measure the sizes for ``scale_map="auto"`` in a mask of
      features (`texrs.scale_maps.Measuring`). Default: the sizes come from a plane in the image.
    - ``method`` ({None, "paper"}): Algorithm to use. "paper" is the algorithm as printed, for comparison. It averages
      windows and is slow, supports at most four channels, and cannot wrap. Default: the algorithm with departures from
      the paper.
    - ``scale_weight`` (float): Weight of the requested scale compared with similarity to the exemplar, 0 to 16. It
      decides which resized copies are used. Elements on a plane have the requested size with any weight above 0, but
      another sharpness. If 0, scales are ignored. Default: 1.
    - ``augment_scales`` ({"auto", True, False} or sequence of float): Resizing of the exemplar to all requested
      scales. True flattens a plane and renders it at any depth, and makes copies of other exemplars in several sizes.
      "auto" does the same, but makes no copies if the exemplar has enough of every requested scale. False replaces
      missing scales by the nearest existing ones, with a warning. Numbers from 1/8 to 4 are the sizes of copies, and
      disable flattening. Default: "auto".
    - ``wrap`` (bool or (rows, columns), optional): Axes along which the result is periodic. The target must also be
      periodic along these axes. Default: none.
    - ``seed`` (int): Seed of the random choices, 0 to 2^64 - 1. The same seed gives the same bytes. Default: 0.
    - ``interpolation`` ({"nearest", "linear", "cubic"}): Interpolation between the exemplar's samples where it is
      resized. Default: "cubic".
    """

    stage = "scale map"
    exemplar: Word[Array | Exemplar | Material, Exemplar] = Word(partial(as_exemplar, minimum=LEAST))
    scale_map: Word[Array | Plane | str, Any] = Word(as_given, default="auto")
    size: Word[int | Sequence[int] | None, Any] = Word(as_given, default=None)
    _: KW_ONLY
    target: Word[Array | Plane | str | None, Any] = Word(as_given, default=None)
    target_green: Word[Literal["up", "down"], Literal["up", "down"]] = Word(choice("up", "down"), default="up")
    scale_kind: Word[Kind | None, Kind | None] = Word(optional(lambda value, name: as_kind(value)), default=None)
    fov: Word[float | None, float | None] = Word(optional(real(1, 170)), default=None)
    direction: Word[float | Array | Field | str | None, Any] = Word(as_given, default=None)
    scale_measurement: Word[Measuring | None, Any] = Word(as_given, default=None)
    method: Word[Method, Method] = Word(method(None, "paper"), default=None)
    scale_weight: Word[float, float] = Word(real(0, 16), default=1.0)
    augment_scales: Word[Sizes, Sizes] = Word(as_sizes, default="auto")
    wrap: Word[bool | Sequence[bool] | None, tuple[bool, bool]] = Word(periodic(False), default=None)
    seed: Word[int, int] = SEED
    interpolation: Word[Interpolation, Interpolation] = Word(choice("nearest", "linear", "cubic"), default="cubic")
    progress: Word[Progress | bool | None, Progress | None] = PROGRESS

    @tied
    def view(self) -> float:
        """Angle of view of the exemplar's longer side in degrees."""
        if self.fov is not None and (isinstance(self.scale_map, Plane) or is_words(self.scale_map)):
            raise InvalidInput("fov: cannot be combined with a plane, which has its own field of view")
        return FOV if self.fov is None else self.fov

    @tied
    def shown(self) -> Any:
        """Target as a map or a surface, or None."""
        return as_target(self.target, self.target_green)

    @tied
    def shape(self) -> tuple[int, int]:
        """Size of the result. The size of the target is the default."""
        sides = as_size(
            self.size if self.size is not None else find_size(self.shown) or [2 * n for n in self.exemplar.shape]
        )
        check_work("perspective", [self.exemplar.pixels], sides, method=self.method)
        return sides[0], sides[1]

    @tied
    def surface(self) -> Surface | None:
        """Jacobians (rows, columns, 2, 2) of the surface that the output shows."""
        return None if self.shown is None or is_map(self.shown) else as_surface(self.shown, self.shape)

    @tied
    def turn(self) -> Surface | None:
        """Rotations (rows, columns, 2, 2) of the copied texture."""
        turn = None if self.direction is None else as_turn(self.direction, self.shape, self.wrap)
        if self.method == "paper" and (self.surface is not None or turn is not None):
            raise InvalidInput(
                "method: 'paper' cannot be combined with a surface as target or with direction; omit method, or give a scale "
                "map as target and omit direction"
            )
        return turn

    @tied
    def found(self) -> tuple[Plane | None, Array, Measured | None]:
        """Plane that the exemplar shows, sizes of its elements, and their measurement. None for missing ones."""
        return find_scale(self.exemplar, self.scale_map, self.scale_measurement)

    @tied
    def scale(self) -> Floats:
        """Size of the exemplar's elements at each pixel."""
        return as_map(self.found[1], "scale_map", self.exemplar.shape)

    @tied
    def wanted(self) -> Floats:
        """Requested size of elements at each pixel of the output."""
        if self.surface is None:
            wanted = scale_maps.resample(self.scale if self.shown is None else self.shown, self.shape)
            check_wrap(log_single(wanted), wanted, self.wrap, self.shown is None)
            return wanted
        sizes = measure_sizes(self.surface)
        wanted = sizes.astype(np.float32)
        check_wrap(self.surface * sizes[..., np.newaxis, np.newaxis], wanted, self.wrap, False)
        return wanted

    @property
    def kinds(self) -> tuple[Kind | None, Kind | None]:
        """Quantities in ``scale`` and in ``wanted``: "width" or "area", or None if unknown."""
        of_target = find_kind(self.found[1] if self.target is None else self.target)
        return find_kind(
            self.found[1]
        ) or self.scale_kind, "area" if self.surface is not None else of_target or self.scale_kind

    def describe_measured(self) -> dict[str, Any] | None:
        """Return the measurement of the exemplar's sizes as JSON types, or None if they were given."""
        return None if self.found[2] is None else self.found[2].as_dict()

    def match_kinds(self, power: float) -> Perspective:
        """Return the arguments with the target converted to the quantity of the exemplar's scale map.

        The exemplar's quantity, raised to ``power``, is a width.
        """
        theirs = {None: power, "width": 1.0, "area": AREAS}[self.kinds[1]]
        return self if theirs == power else self.vary(wanted=power_single(self.wanted, theirs / power))


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

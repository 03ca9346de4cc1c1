"""Parameters of `texrs.solid` and `texrs.synthesize`, checked before the work begins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY
from typing import Any, ClassVar, Literal, TypeAlias

import numpy as np

from texrs._arrays import as_choice, as_size, as_wrap
from texrs._engine.pyramid import Region
from texrs._requests import PROGRESS, SEED, Request, Word, as_given, method, request, tied
from texrs._typing import Array, Interpolation, Progress
from texrs.errors import InvalidInput
from texrs.exemplar import Exemplar, as_exemplar
from texrs.exemplar.analysis import COARSEST
from texrs.fields import Field, FieldLike
from texrs.fields import as_field as make_field
from texrs.fields.spaced import as_distances, find_distances
from texrs.growth import Conditions, Constraints, Guide
from texrs.materials import Material
from texrs.papers.solid.memory_check import LARGER, check_region
from texrs.papers.solid.plans import Choice, check_plan
from texrs.papers.solid.settings import Quality, as_quality

__all__ = ["GrowthRequest", "Solid", "Synthesize", "as_field", "as_interpolation"]

Method: TypeAlias = Literal["paper", "paper-compensated"] | None


def as_bending(value: object, name: str) -> bool | None:
    """Check whether patches are bent. None means that the exemplar determines it."""
    if value is not None and not isinstance(value, bool):
        raise InvalidInput(f"{name}: must be True, False or None, got {value!r}")
    return value


@request
class GrowthRequest(Request):
    """Parameters of `texrs.solid` and `texrs.synthesize`.

    - ``seed`` (int): Seed of the random choices, 0 to 2^64 - 1. The same seed gives the same bytes. Default: 0.
    - ``quality`` ({"preserve", "fast", "optimise"}): Balance of quality and speed. "preserve" stitches patches along
      minimum cuts, which keeps elements whole. "optimise" tries three times as many source positions for each patch.
      "fast" corrects blocks point by point, for textures without elements. Default: "preserve".
    - ``bend_patches`` (bool, optional): If True, patches are bent along the field, which suits courses and nets. If
      False, they are rotated and scaled as a whole, which suits separate elements. Default: False if the exemplar has
      separate elements.
    - ``method`` ({None, "paper", "paper-compensated"}): Algorithm to use. "paper" is the algorithm as printed, for
      comparison. "paper-compensated" adds the windows of Lefebvre and Hoppe, which the paper omits. Neither can be
      combined with ``quality``, constraints or a guide, and both look up the nearest sample by default. Default: the
      algorithm with departures from the paper.
    - ``guide`` (Guide, optional): A map that the result should follow, for exemplars with a trend, such as grains that
      grow downwards (`texrs.Guide`).
    - ``interpolation`` ({"nearest", "linear", "cubic"}, optional): Interpolation between the exemplar's samples in the
      final look-up. Labels always use the nearest sample. Default: "cubic".
    - ``memory_limit`` (int, optional): Maximum memory of the computation in bytes. Default: the available memory,
      unless a lower limit is set (`texrs.limits`).
    """

    axes: ClassVar[int]
    exemplar: Word[Array | Exemplar | Material, Any] = Word(as_given)
    size: Word[int | Sequence[int], Any] = Word(as_given)
    _: KW_ONLY
    field: Word[FieldLike | None, Any] = Word(as_given, default=None)
    seed: Word[int, int] = SEED
    wrap: Word[bool | Sequence[bool] | None, Any] = Word(as_given, default=None)
    quality: Word[Quality, Quality] = Word(lambda value, name: as_quality(value), default="preserve")
    bend_patches: Word[bool | None, bool | None] = Word(as_bending, default=None)
    method: Word[Method, Method] = Word(method(None, "paper", "paper-compensated"), default=None)
    constraints: Word[Constraints | None, Any] = Word(as_given, default=None)
    guide: Word[Guide | None, Any] = Word(as_given, default=None)
    interpolation: Word[Interpolation | None, Any] = Word(as_given, default=None)
    memory_limit: Word[int | None, Any] = Word(as_given, default=None)
    progress: Word[Progress | bool | None, Progress | None] = PROGRESS

    @tied
    def distances(self) -> Sequence[float] | None:
        """Voxel size along each axis, if it is given or if the exemplar's file states it."""
        return find_distances(vars(self).get("spacing"), self.exemplar, self.axes)

    @tied
    def example(self) -> Exemplar:
        """Analysed exemplar."""
        return as_exemplar(self.exemplar, axes=self.axes, minimum=COARSEST)

    @tied
    def region(self) -> Region:
        """Shape and periodic axes of the output."""
        shape = as_size(self.size, axes=self.axes, way=LARGER[self.axes])
        return Region.whole(shape, as_wrap(self.wrap, axes=self.axes, usual=False))

    @tied
    def plan(self) -> Choice:
        """Method of stitching, and a check of the options that the printed algorithm does not have."""
        if self.method is not None and (self.constraints is not None or self.guide is not None):
            what = "constraints" if self.constraints is not None else "guide"
            raise InvalidInput(f"{what}: cannot be combined with method={self.method!r}; omit one of them")
        return check_plan(vars(self).get("patches", "default"), self.method, self.quality)

    @tied
    def sampling(self) -> Interpolation:
        """Interpolation between the exemplar's samples in the final look-up."""
        return as_interpolation(self.interpolation, self.example, "cubic" if self.method is None else "nearest")

    @tied
    def frames(self) -> Field | None:
        """Frame field over the output. None leaves the texture as it is."""
        field = as_field(self.field, self.axes, self.region.shape, self.distances)
        return None if field is None else field.over(self.region.shape)

    @tied
    def conditions(self) -> Conditions:
        """Constraints and guide, read after a check of the memory."""
        check_region(self.example.pixels, self.region, self.frames, self.quality, self.memory_limit)
        return Conditions.of(self.example.pixels, self.region.shape, self.constraints, self.guide)

    @tied
    def steps(self) -> tuple[float, ...] | None:
        """Checked voxel size along each axis, or None."""
        return None if self.distances is None else as_distances(self.distances, self.axes)


@request
class Solid(GrowthRequest):
    """Parameters of `texrs.solid`.

    - ``exemplar`` ((D, H, W) or (D, H, W, C) array, or Exemplar): Example volume, of any real dtype and number of
      channels, at least 16 voxels a side. A `texrs.Exemplar` with ``axes=3`` states whether its values are labels, and
      along which axes it is periodic; for other types, both are measured.
    - ``size`` (int or (planes, rows, columns)): Size of the result in voxels. One number gives a cube.
    - ``field`` (Field, str, array_like or path_like, optional): Field that rotates and scales the texture at each
      voxel (`texrs.fields`). Python accepts a field or its words. Python also accepts directions (P, R, C, 3) or
      frames (P, R, C, 3, 3) over the output, as an array or a file. None leaves the texture as it is.
    - ``wrap`` (bool or (planes, rows, columns), optional): Axes along which the result is periodic. Default: none.
    - ``constraints`` (Constraints, optional): Given voxels, specified by their values or by their source coordinates
      (`texrs.Constraints`).
    - ``spacing`` ((plane, row, column) float, optional): Voxel size along each axis of the exemplar and of the result,
      in any unit. The field rotates and scales the texture in space, not in voxels, and its places and lengths are in
      this unit. Default: the spacing that the exemplar's file states, else 1.
    """

    axes = 3
    _: KW_ONLY
    spacing: Word[Sequence[float] | None, Any] = Word(as_given, default=None, after="interpolation")


@request
class Synthesize(GrowthRequest):
    """Parameters of `texrs.synthesize`.

    - ``exemplar`` ((H, W) or (H, W, C) array, or Exemplar): Example image, of any real dtype and number of channels,
      at least 16 pixels a side. A `texrs.Exemplar` states whether its values are labels, and along which axes it is
      periodic; for other types, both are measured.
    - ``size`` (int or (int, int)): Size of the result in pixels. One number gives a square.
    - ``field`` (Field, str, array_like or path_like, optional): Field that rotates and scales the texture at each
      pixel (`texrs.fields`). Python accepts a field or its words. Python also accepts directions (R, C, 2) or frames
      (R, C, 2, 2) over the output, as an array or a file. None leaves the texture as it is.
    - ``wrap`` (bool or (rows, columns), optional): Axes along which the result is periodic. Default: none.
    - ``patches`` ({"auto", "default", "large", "unmasked", "unmasked-large"}): Method of stitching. "large": patches a
      quarter larger than the default, which tear fewer elements but copy larger parts. "unmasked": seams may cross
      elements. "unmasked-large": both. "auto": each method is tried twice on a small image and evaluated
      (`texrs.metrics`), and a clearly better one replaces the default. The report key "candidates" contains the
      measures of each. Default: patches of the usual size, and seams that avoid elements ("default").
    - ``constraints`` (Constraints, optional): Given pixels, specified by their values or by their source coordinates
      (`texrs.Constraints`).
    """

    axes = 2
    _: KW_ONLY
    patches: Word[Choice, Any] = Word(as_given, default="default", after="bend_patches")


def as_field(
    field: object, axes: int, extent: Sequence[int] | None = None, spacing: Sequence[float] | None = None
) -> Field | None:
    """Check a field, or create it from words or an array and a voxel ``spacing``. The identity is returned as None."""
    as_distances(spacing, axes)
    known = make_field(field, axes, extent, spacing=spacing)
    still = known is None or (
        known.constant is not None and np.array_equal(known.constant, np.eye(axes, dtype=np.float32))
    )
    return None if still else known


def as_interpolation(value: Interpolation | None, exemplar: Exemplar, default: Interpolation) -> Interpolation:
    """Check the interpolation, or return the default. Labels always use the nearest sample."""
    if value is not None:
        as_choice(value, "interpolation", ("nearest", "linear", "cubic"))
    return "nearest" if exemplar.labels else value or default

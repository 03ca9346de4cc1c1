"""Check the arguments of `texrs.solid` and `texrs.synthesize` before the work begins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from texrs._arrays import as_choice, as_method, as_seed, as_size, as_wrap
from texrs._engine.pyramid import Region
from texrs._typing import Array, Interpolation
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

__all__ = ["Method", "Request", "as_field", "as_interpolation"]

Method: TypeAlias = Literal["paper", "paper-compensated"] | None


@dataclass(frozen=True, slots=True, eq=False)
class Request:
    """Checked arguments of a synthesis.

    Attributes
    ----------
    exemplar : Exemplar
        Analysed exemplar.
    region : Region
        Shape and periodic axes of the output.
    field : Field, optional
        Frame field over the output. None leaves the texture as it is.
    seed : int
        Seed of the random choices.
    quality : {"preserve", "fast", "optimise"}
        Amount of work.
    bend_patches : bool, optional
        If True, patches are bent along the field. If None, the exemplar determines it.
    patches : {"auto", "default", "large", "unmasked", "unmasked-large"}
        Method of stitching.
    method : {None, "paper", "paper-compensated"}
        Algorithm: with departures from the paper, as printed, or as printed with compensated windows.
    conditions : Conditions
        Constraints and guide.
    interpolation : {"nearest", "linear", "cubic"}
        Interpolation between the exemplar's samples in the final look-up.
    spacing : sequence of float, optional
        Voxel size along each axis.

    """

    exemplar: Exemplar
    region: Region
    field: Field | None
    seed: int
    quality: Quality
    bend_patches: bool | None
    patches: Choice
    method: Method
    conditions: Conditions
    interpolation: Interpolation
    spacing: tuple[float, ...] | None = None

    @classmethod
    def check(
        cls,
        exemplar: Array | Exemplar | Material,
        size: int | Sequence[int],
        *,
        axes: int,
        field: FieldLike | None,
        seed: int,
        wrap: bool | Sequence[bool] | None,
        quality: Quality,
        bend_patches: bool | None,
        method: Method,
        constraints: Constraints | None,
        guide: Guide | None,
        interpolation: Interpolation | None,
        memory_limit: int | None,
        patches: Choice = "default",
        spacing: Sequence[float] | None = None,
    ) -> Request:
        """Check the arguments of a call, and return them as a request."""
        spacing = find_distances(spacing, exemplar, axes)
        known = as_exemplar(exemplar, axes=axes, minimum=COARSEST)
        region = Region.whole(as_size(size, axes=axes, way=LARGER[axes]), as_wrap(wrap, axes=axes, usual=False))
        as_method(method, None, "paper", "paper-compensated")
        if method is not None and (constraints is not None or guide is not None):
            what = "constraints" if constraints is not None else "guide"
            raise InvalidInput(f"{what}: cannot be combined with method={method!r}; omit one of them")
        if bend_patches is not None and not isinstance(bend_patches, bool):
            raise InvalidInput(f"bend_patches: must be True, False or None, got {bend_patches!r}")
        chosen = check_plan(patches, method, as_quality(quality))
        how = as_interpolation(interpolation, known, "cubic" if method is None else "nearest")
        turned = as_field(field, axes, region.shape, spacing)
        if turned is not None:
            turned = turned.over(region.shape)
        check_region(known.pixels, region, turned, as_quality(quality), memory_limit)
        conditions = Conditions.of(known.pixels, region.shape, constraints, guide)
        steps = None if spacing is None else as_distances(spacing, axes)
        return cls(
            known,
            region,
            turned,
            as_seed(seed),
            as_quality(quality),
            bend_patches,
            chosen,
            method,
            conditions,
            how,
            steps,
        )


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

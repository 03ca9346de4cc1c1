"""Estimate the memory of a synthesis before it begins."""

from __future__ import annotations

from texrs._arrays import as_int, check_memory
from texrs._engine.pyramid import Region
from texrs._typing import Array
from texrs.fields import Field
from texrs.limits import estimate_memory

__all__ = ["LARGER", "check_region", "estimate_bytes"]

LARGER = {
    2: "texrs.PlaneTexture.to_zarr and to_dask make it in parts",
    3: "texrs.SolidTexture.to_zarr and to_dask make it in parts",
}
"""Advice in error messages, by the number of axes: methods for larger results."""


def estimate_bytes(image: Array, region: Region, field: Field | None, quality: str) -> int:
    """Return the approximate memory that a synthesis needs, in bytes."""
    verb = "solid" if len(region.shape) == 3 else "synthesize"
    varies = field is not None and field.constant is None
    return estimate_memory(verb, image.shape, region.shape, dtype=image.dtype, method=quality, field=varies)


def check_region(
    image: Array, region: Region, field: Field | None, quality: str, limit: object, beside: int = 0
) -> None:
    """Raise an error if a synthesis would need more memory than allowed, before anything is allocated."""
    most = None if limit is None else as_int(limit, "memory_limit", 1, 1 << 62)
    needed = estimate_bytes(image, region, field, quality) + beside
    check_memory(needed, "size", limit=most, way=LARGER[len(region.shape)])

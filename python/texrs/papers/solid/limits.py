"""Memory, known before it is used."""

from __future__ import annotations

from texrs._arrays import as_int
from texrs._engine.pyramid import Region
from texrs._typing import Array
from texrs.errors import LimitExceeded
from texrs.fields import Field
from texrs.growth import patch_side

__all__ = ["LARGER", "check_memory", "estimate_bytes"]

CUT = 1000
"""Bytes of a point of a patch: places that are tried at once, what they show, pairs and capacities."""
LARGER = {
    2: "texrs.PlaneTexture.to_zarr and to_dask make it in parts",
    3: "texrs.SolidTexture.to_zarr and to_dask make it in parts",
}
"""How larger ones are made, by the number of axes."""
LIMIT = 8 << 30
"""Bytes that a synthesis may take unless another limit is given."""


def estimate_bytes(image: Array, region: Region, field: Field | None) -> int:
    """Return the bytes that a synthesis takes at most, about.

    A point of the output has its place four times over (12 bytes an axis triple), what its window shows, its value and
    where the field varies its frame; the coarser levels add a seventh. A sample of the exemplar has its vector
    and its colours, what patches show of it and their spectra. A point of a patch has all that a cut is made from.
    """
    axes = len(region.shape)
    point = 4 * 4 * axes + 12 + 2 * image.itemsize * image.shape[-1] + 6
    if field is not None and field.constant is None:
        point += 2 * axes * axes
    samples = image.size // image.shape[-1]
    patch = min(region.points, round((1.5 * patch_side(image.shape[:axes])) ** axes))
    return int(region.points * point * 8 // 7 + samples * (160 + 8 * image.shape[-1]) + patch * CUT + (24 << 20))


def check_memory(image: Array, region: Region, field: Field | None, limit: object, beside: int = 0) -> None:
    """Refuse what would take more memory than allowed, with so many bytes beside it, before anything is allocated."""
    most = LIMIT if limit is None else as_int(limit, "memory_limit", 1, 1 << 62)
    total = estimate_bytes(image, region, field) + beside
    if total > most:
        raise LimitExceeded(
            f"size: {region.shape} would take {total / 2**30:.1f} GiB, more than the limit of "
            f"{most / 2**30:.1f} GiB (memory_limit); {LARGER[len(region.shape)]}"
        )

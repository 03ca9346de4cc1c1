"""Describe the axes, levels and position of an image in the metadata of OME-Zarr."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

__all__ = ["describe_image"]

VERSION = "0.5"
"""Version of the OME-Zarr format that is written."""
_COLOURS = {1: ("FFFFFF",), 2: ("FFFFFF", "808080"), 3: ("FF0000", "00FF00", "0000FF")}


def describe_image(
    name: str,
    axes: int,
    levels: int,
    channels: int | None,
    origin: Sequence[int],
    spacing: Sequence[float],
    unit: str | None,
) -> dict[str, Any]:
    """Return the OME-Zarr metadata of an image: its axes, levels and positions, with channels first.

    References
    ----------
    .. [1] J. Moore et al., "OME-Zarr: a cloud-optimized bioimaging file format", 2023; specification 0.5.

    """
    space = [{"name": letter, "type": "space", **({"unit": unit} if unit else {})} for letter in "zyx"[3 - axes :]]
    before = [] if channels is None else [{"name": "c", "type": "channel"}]
    datasets = []
    for level in range(levels):
        step = 2**level
        # A sample of a coarse level is at the centre of the samples that it averages.
        first = [(o + (step - 1) / 2) * s for o, s in zip(origin, spacing, strict=True)]
        one, none = [1.0] * len(before), [0.0] * len(before)
        moves = [
            {"type": "scale", "scale": [*one, *(s * step for s in spacing)]},
            {"type": "translation", "translation": [*none, *first]},
        ]
        datasets.append({"path": str(level), "coordinateTransformations": moves})
    said: dict[str, Any] = {
        "version": VERSION,
        "multiscales": [{"name": name, "axes": before + space, "datasets": datasets, "type": "mean"}],
    }
    if channels in _COLOURS:
        shown = [{"label": str(i), "color": c, "active": True} for i, c in enumerate(_COLOURS[channels])]
        said["omero"] = {"channels": shown}
    return said

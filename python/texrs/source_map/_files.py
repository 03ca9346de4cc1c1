"""Source maps in files: one ``.npz`` of arrays."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np

from texrs._typing import Path
from texrs.errors import FileError, InvalidInput
from texrs.source_map._finish import Finish
from texrs.source_map._parts import Parted

__all__ = ["read_map", "write_map"]

FORMAT = 1
"""Version of the file layout."""

Map = TypeVar("Map", bound=Parted)


def write_map(source: Parted, path: Path) -> None:
    """Write a map, whole or not at all."""
    from texrs.io import atomic

    parts: dict[str, Any] = {
        "texrs_source_map": np.array(FORMAT),
        "coordinates": source.coordinates,
        "exemplar": source.exemplar,
        "label": source.label,
        "shapes": np.array(source.shapes, np.int64),
    }
    if (frame := source.frame_array()) is not None:
        parts["frame"] = frame
    if source.finish is not None:
        parts |= source.finish.arrays()
    with atomic(path) as temporary, open(temporary, "wb") as file:
        np.savez_compressed(file, **parts)


def read_map(path: Path, make: type[Map]) -> Map:
    """Return the map that a file holds, made of its parts."""
    from texrs.io import read_arrays

    parts = read_arrays(path)
    names = ("texrs_source_map", "coordinates", "exemplar", "label", "shapes")
    if any(name not in parts for name in names):
        raise FileError(f"{path}: is not a source map")
    if parts["texrs_source_map"].ravel().tolist() != [FORMAT]:
        raise FileError(f"{path}: has another layout than {FORMAT}, which this version of texrs reads")
    try:
        shapes = tuple(tuple(int(n) for n in s) for s in parts["shapes"])
        rest = (parts["label"], parts.get("frame"), shapes)
        made = make(parts["coordinates"], parts["exemplar"], *rest)
        if "finish" not in parts:
            return made
        finish = Finish.from_arrays(parts, made.shape, shapes)
        return make(parts["coordinates"], parts["exemplar"], *rest, finish)
    except (InvalidInput, TypeError, ValueError) as error:
        raise FileError(f"{path}: is damaged ({error})") from None

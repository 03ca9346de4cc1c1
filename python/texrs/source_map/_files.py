"""Read and write source maps: one ``.npz`` file of arrays."""

from __future__ import annotations

from collections.abc import Mapping
from math import prod
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from texrs._checks import as_limit
from texrs._typing import Path
from texrs.errors import FileError, InvalidInput, LimitExceeded
from texrs.source_map._finish import RenderOptions
from texrs.source_map._parts import Parted

if TYPE_CHECKING:
    from texrs.io import Header

__all__ = ["read_map", "write_map"]

FORMAT = 1
"""Version of the file layout."""
NAMES = ("texrs_source_map", "coordinates", "exemplar", "label", "shapes")
LEAST = 2**26
"""Number of bytes that a table of Jacobians may always have. Large maps may have one matrix for each pixel."""

Map = TypeVar("Map", bound=Parted)


def write_map(source: Parted, path: Path) -> None:
    """Write a map, completely or not at all."""
    from texrs.io import atomic

    parts: dict[str, Any] = {
        "texrs_source_map": np.array(FORMAT),
        "coordinates": source.coordinates,
        "exemplar": source.exemplar,
        "label": source.label,
        "shapes": np.array(source.shapes, np.int64),
    }
    if (jacobian := source.jacobian_array()) is not None:
        parts["jacobian"] = jacobian
    if source.finish is not None:
        parts |= source.finish.arrays()
    with atomic(path) as temporary, open(temporary, "wb") as file:
        np.savez_compressed(file, **parts)


def read_map(path: Path, make: type[Map]) -> Map:
    """Read a map from a file, as an instance of ``make``."""
    from texrs.io import read_arrays

    def choose(headers: Mapping[str, Header]) -> list[str]:
        return choose_parts(headers, path)

    parts = read_arrays(path, choose=choose)
    if parts["texrs_source_map"].ravel().tolist() != [FORMAT]:
        raise FileError(f"{path}: must have file layout {FORMAT}, the only layout that this version of texrs reads")
    try:
        shapes = tuple(tuple(int(n) for n in s) for s in parts["shapes"])
        rest = (parts["label"], parts.get("jacobian", parts.get("frame")), shapes)
        made = make(parts["coordinates"], parts["exemplar"], *rest)
        if "finish" not in parts:
            return made
        finish = RenderOptions.from_arrays(parts, made.shape, shapes)
        return make(parts["coordinates"], parts["exemplar"], *rest, finish)
    except (InvalidInput, TypeError, ValueError) as error:
        raise FileError(f"{path}: is damaged ({error})") from None


def choose_parts(headers: Mapping[str, Header], path: Path) -> list[str]:
    """Check the headers of a file before any array is read, and return the names of the map's arrays."""
    if any(name not in headers for name in NAMES):
        raise FileError(f"{path}: is not a source map")
    shape = headers["coordinates"].shape[:-1]
    pixels, limit = prod(shape), as_limit(None, axes=len(shape))
    if pixels > limit:
        raise LimitExceeded(f"{path}: has {pixels} pixels, more than the limit of {limit}")
    wanted = {"coordinates": (*shape, len(shape)), "exemplar": shape, "label": shape}
    for name, shaped in wanted.items():
        if headers[name].shape != shaped or len(shape) not in (2, 3):
            raise FileError(f"{path}: is damaged ({name} has shape {headers[name].shape})")
    # A damaged or hostile file may declare arrays of any size, so limit each.
    most = {
        "texrs_source_map": 8,
        "coordinates": 4 * len(shape) * pixels,
        "exemplar": 2 * pixels,
        "label": 4 * pixels,
        "shapes": 8 * 3 * 2**16,
        **dict.fromkeys(("jacobian", "frame"), max(4 * len(shape) ** 2 * pixels, LEAST)),
        "finish": 2**20,
        "finish/within": pixels,
        "finish/parts": 2 * pixels,
        "finish/fade": pixels,
    }
    # The masks of exemplars have sizes of their own, so limit their sum.
    known = [name for name in headers if name.startswith("finish/known/")]
    chosen = [name for name in most if name in headers]
    for name in chosen:
        if headers[name].size > most[name]:
            raise FileError(
                f"{path}: is damaged ({name} has dtype {headers[name].dtype} and shape {headers[name].shape})"
            )
    if sum(headers[name].size for name in known) > limit:
        raise LimitExceeded(f"{path}: the masks of its exemplars have more pixels than the limit of {limit}")
    return [*chosen, *known]

"""Reader plugin for napari (extra ``texrs[napari]``): shows stores, volumes, source maps and elements as layers.

Its manifest is `napari.yaml`, next to this file. Nothing of napari is imported, because the reader returns plain
tuples (data, options, layer type). Stores are opened lazily, with all their levels.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from texrs import elements, io
from texrs._typing import Array
from texrs.errors import FileError, TexrsError
from texrs.io.formats import READ_VOLUMES
from texrs.source_map import SourceMap

LayerData = tuple[Any, dict[str, Any], str]
"""Layer of napari: its data, its options and its type."""
_BRIGHT = 4
"""Maximum length of a last axis without a name that is treated as channels."""


def get_reader(path: str | Sequence[str]) -> Callable[[str | Sequence[str]], list[LayerData]] | None:
    """Return the reader for one or several paths, or None if texrs cannot read all of them.

    Examples
    --------
    >>> get_reader("picture.docx") is None
    True

    """
    names = [path] if isinstance(path, str | os.PathLike) else list(path)
    known = [io.is_store(name) or os.fspath(name).lower().endswith(READ_VOLUMES) for name in names]
    return read if names and all(known) else None


def read(path: str | Sequence[str]) -> list[LayerData]:
    """Return the layers of all given paths."""
    names = [path] if isinstance(path, str | os.PathLike) else list(path)
    return [layer for name in names for layer in _read(Path(name))]


def _read(path: Path) -> list[LayerData]:
    stem = path.name.partition(".")[0]
    if io.is_store(path):
        return read_store(path, stem)
    if path.suffix.lower() == ".npz":
        for make in (read_source_map, read_elements):
            with suppress(TexrsError):
                return make(path, stem)
    try:
        array, axes, spacing = io.read_volume(path), 3, io.read_spacing(path)
    except FileError as error:
        try:
            array, axes, spacing = io.read(path), 2, None
        except FileError:
            raise error from None
    return [show(array, axes, stem, spacing)]


def show(array: Array, axes: int, name: str, spacing: Sequence[float] | None = None) -> LayerData:
    """Return a layer for an image or a volume: RGB colours, a single channel, or separate channels."""
    said: dict[str, Any] = {"name": name}
    if spacing is not None:
        said["scale"] = [float(s) for s in spacing]
    if axes == 3 and array.shape[0] == 1:
        # Show a single plane as an image, because it needs no slider.
        array, axes = array[0], 2
        if spacing is not None:
            said["scale"] = said["scale"][1:]
    if array.dtype == np.bool_:
        return array.astype(np.uint8), said, "labels"
    if array.ndim == axes:
        return array, said, "image"
    if array.shape[-1] in (3, 4) and _are_colours(array):
        return array, said | {"rgb": True}, "image"
    return np.moveaxis(array, -1, 0), said | {"channel_axis": 0}, "image"


def _are_colours(array: Any) -> bool:
    """Return True if the values are in a range that is displayed as colours."""
    if array.dtype in (np.uint8, np.uint16):
        return True
    return bool(array.dtype.kind == "f" and array.size and float(array.min()) >= 0 and float(array.max()) <= 1)


def read_source_map(path: Path, name: str) -> list[LayerData]:
    """Return two layers for a source map: the source coordinates as colours, and the patches as labels."""
    places = SourceMap.load(path)
    most = np.array(places.shapes)[places.exemplar] - 1
    share = np.clip(places.coordinates / np.maximum(most, 1), 0, 1)
    blue = 0.25 + 0.75 * places.exemplar[..., np.newaxis] / max(len(places.shapes) - 1, 1)
    # In images, red and green show the coordinates and blue shows the exemplar. In volumes, all three show
    # coordinates.
    colours = np.concatenate([share, blue], axis=-1) if places.axes == 2 else share
    shown = np.rint(255 * colours).astype(np.uint8)
    patches = places.label.astype(np.int64) + 1
    return [
        (shown, {"name": f"{name} places", "rgb": True}, "image"),
        (patches, {"name": f"{name} patches", "opacity": 0.4, "visible": False}, "labels"),
    ]


def read_elements(path: Path, name: str) -> list[LayerData]:
    """Return layers for an image, the elements found in it, and their centres."""
    entry = elements.load(path)
    return [
        show(entry.image, 2, name),
        (entry.labels.astype(np.int32), {"name": f"{name} elements", "opacity": 0.4}, "labels"),
        (entry.points, {"name": f"{name} middles", "size": max(2, min(entry.box) / 8)}, "points"),
    ]


# --- stores ----------------------------------------------------------------------------------------------------------


def read_store(path: Path, name: str) -> list[LayerData]:
    """Return a layer for each image of a Zarr store, with all its levels. Pixels are read on demand."""
    import zarr
    from dask import array as lazy

    try:
        node = zarr.open(os.fspath(path), mode="r")
    except Exception as error:
        raise FileError(f"{path}: is not a Zarr store ({error})") from None
    if isinstance(node, zarr.Array):
        return [_show_lazy([lazy.from_zarr(node)], _name_axes(node), {"name": name})]
    layers = _find_images(node, name)
    if not layers:
        raise FileError(f"{path}: does not contain an image")
    return layers


def _find_images(group: Any, name: str, depth: int = 3) -> list[LayerData]:
    """Return layers for the images of a group: its own image, or the images of its arrays and subgroups."""
    from dask import array as lazy

    said = group.attrs.get("ome", group.attrs)
    images = said.get("multiscales") if isinstance(said, Mapping) else None
    if images:
        levels = [lazy.from_zarr(group[each["path"]]) for each in images[0]["datasets"]]
        axes = images[0].get("axes") or list("tczyx"[-levels[0].ndim :])
        names = [str(a["name"] if isinstance(a, Mapping) else a) for a in axes]
        scale, move = _find_place(images[0], len(names))
        labelled = _is_labelled(group, name)
        return [_show_lazy(levels, names, {"name": name, "scale": scale, "translate": move}, labelled=labelled)]
    found = [
        _show_lazy([lazy.from_zarr(a)], _name_axes(a), {"name": n}) for n, a in sorted(group.arrays()) if a.ndim > 1
    ]
    for n, inner in sorted(group.groups()) if depth else ():
        found += _find_images(inner, n, depth - 1)
    return found


def _name_axes(array: Any) -> list[str] | None:
    names = getattr(array.metadata, "dimension_names", None)
    return [str(n) for n in names] if names and all(names) else None


def _find_place(image: Mapping[str, Any], axes: int) -> tuple[list[float], list[float]]:
    """Return the distance between samples along each axis, and the position of the first sample."""
    scale, move = [1.0] * axes, [0.0] * axes
    for each in image["datasets"][0].get("coordinateTransformations", ()):
        if each.get("type") == "scale":
            scale = [float(s) for s in each["scale"]]
        elif each.get("type") == "translation":
            move = [float(m) for m in each["translation"]]
    return scale, move


def _is_labelled(group: Any, name: str) -> bool:
    """Return True if the values of a store that texrs wrote are labels."""
    for root in (group, None if group.path == "" else _open_root(group)):
        said = {} if root is None else root.attrs.get("texrs", {})
        if isinstance(said, Mapping) and "maps" in said:
            known = said["maps"]
            entry = known.get(name) or (next(iter(known.values())) if len(known) == 1 else None)
            return bool(entry and entry[2])
    return False


def _open_root(group: Any) -> Any:
    import zarr

    with suppress(Exception):
        return zarr.open_group(group.store, mode="r")
    return None


def _show_lazy(
    levels: list[Any], names: list[str] | None, options: dict[str, Any], *, labelled: bool = False
) -> LayerData:
    """Return a layer for an image with several levels, with the channel axis where napari expects it."""
    first = levels[0]
    channel: int | None = None
    if names is not None:
        channel = names.index("c") if "c" in names else None
    elif first.ndim > 2 and first.shape[-1] <= _BRIGHT:
        channel = first.ndim - 1
    several = len(levels) > 1
    if channel is None:
        kept: dict[str, Any] = {}
    else:
        # The range of a lazy array is unknown without reading it, so treat only 8- and 16-bit integers as colours.
        colours = first.shape[channel] in (3, 4) and first.dtype in (np.uint8, np.uint16)
        if colours:
            from dask import array as lazy

            levels = [lazy.moveaxis(level, channel, -1) for level in levels]
            kept = {"rgb": True}
        else:
            kept = {"channel_axis": channel}
        for key in ("scale", "translate"):
            if key in options:
                options[key] = [v for a, v in enumerate(options[key]) if a != channel]
    data = levels if several else levels[0]
    if labelled and not kept and first.dtype.kind in "iub":
        return data, {**options, "multiscale": several}, "labels"
    if first.dtype == np.uint8 and "rgb" not in kept:
        # Fix the contrast limits, so that they do not depend on the part that is viewed first.
        kept["contrast_limits"] = [0, 255]
    return data, {**options, **kept, "multiscale": several}, "image"

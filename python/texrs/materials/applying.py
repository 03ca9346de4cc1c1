"""Apply a source map to one map of a material. The file name or the values of the map decide how it is resampled."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Literal

import numpy as np

from texrs import blending
from texrs._arrays import as_choice, as_instance, as_list, as_ndarray
from texrs._notices import assume
from texrs._progress import listen
from texrs._typing import Array, Path, Progress
from texrs.io.formats import READ_IMAGES
from texrs.materials._labels import REASON, holds_labels
from texrs.materials._map import Map, split_channels
from texrs.materials._roles import Role, guess_role
from texrs.materials.conventions import cut_name, guess_roles
from texrs.source_map import RenderOptions, SourceMap

__all__ = ["Green", "Kind", "apply", "choose_finish", "choose_kind"]

Kind = Literal["colour", "normal", "vector", "label"]
Green = Literal["up", "down"]


def apply(
    source: SourceMap,
    exemplars: Array | Path | Sequence[Array | Path],
    *,
    map_type: Kind | None = None,
    green: Green | None = None,
    finish: RenderOptions | None = None,
    progress: Progress | bool | None = None,
) -> Array:
    """Apply a source map to a map of the exemplar, with the finish that its verb used.

    ``apply(result.source_map, exemplar)`` equals ``result.image`` bit for bit, except that `texrs.splice` can relight
    elements. It corrects seams, interpolates samples and keeps known pixels in the same way. If the source map has no
    finish, nothing is corrected.

    Parameters
    ----------
    source : SourceMap
        Source map of an image or a volume.
    exemplars : (H, W[, C]) or (D, H, W[, C]) array or path_like, or a sequence of one per exemplar
        Any map of the height and width (and depth) of the exemplar, with any dtype and channels. For several
        exemplars, a sequence with one map each. A file name gives the role of the map, as in a folder of maps
        (`texrs.materials.guess_role`). Each channel of a packed map is processed separately.
    map_type : {"colour", "normal", "vector", "label"}, optional
        Type of the map. "colour": colours, heights and other values that can be mixed. If the finish removes uneven
        light, it does so here. "normal", "vector": normals in tangent space, or directions on the surface. They are
        rotated as in `SourceMap.render`. "label": unordered classes. The nearest sample is used, and nothing is
        corrected. Default: from the file name. If the name gives no role: "label" for integers that form regions of
        unrelated values, else "colour".
    green : {"up", "down"}, optional
        Direction of the y axis of normals and vectors: up (OpenGL) or down (DirectX). Default: from the file name,
        else "up".
    finish : RenderOptions, optional
        Finish to use instead of the finish of the source map. Default: None.
    progress : callable or True, optional
        Function that is called as ``progress("blend", share)`` during the seam correction, with a share from 0 to 1.
        An exception that it raises stops the work. True shows a progress bar. Default: None.

    Returns
    -------
    array
        Output with the channels and the dtype of the map.

    Raises
    ------
    InvalidInput
        The number or size of the exemplars differs from the source map, or the type is unknown.
    FileError
        A file cannot be read.

    See Also
    --------
    texrs.SourceMap.render : Only the look-up.
    texrs.blend : Only the seam correction, with any strength.

    Examples
    --------
    >>> import texrs
    >>> pebbles = texrs.samples.pebbles((64, 64)).image
    >>> result = texrs.design(pebbles, 64)
    >>> bool((texrs.apply(result.source_map, pebbles) == result.image).all())
    True
    >>> heights = pebbles[..., :1].astype("float32")
    >>> texrs.apply(result.source_map, heights).dtype
    dtype('float32')

    """
    progress = listen(progress)
    as_instance(source, "source", SourceMap)
    given = as_list(exemplars)
    several = [as_ndarray(each, "exemplars", axes=source.axes) for each in given]
    name = os.fspath(given[0]) if given and isinstance(given[0], str | os.PathLike) else None
    if finish is None and source.finish is not None:
        finish = choose_finish(source.finish, name)
    if map_type is None and green is None and (packed := find_packed(name)) is not None:
        maps = [Map(each, packed, "linear") for each in several]
        return look_up(source, maps, finish, lambda share: progress and progress("blend", share))
    map_type, green = choose_kind(name, several, source.axes, map_type, green)
    return blending.apply(source, several, map_type=map_type, green=green, finish=finish, progress=progress)


def find_named(name: str | None, *, report: bool = False) -> Role | None:
    """Return the role that a file name gives, alone or with the other names in its folder; None if there is none."""
    if name is None:
        return None
    file = FilePath(name)
    if (role := guess_role(file.stem)) is not None or not file.is_file():
        return role
    stems = {each.stem for each in file.parent.iterdir() if each.suffix.lower() in READ_IMAGES} | {file.stem}
    found, why = guess_roles(sorted(stem for stem in stems if cut_name(stem) == cut_name(file.stem)))
    if report and file.stem in found:
        assume(f"{name}: read as {found[file.stem].value} ({why[file.stem]})")
    return found.get(file.stem)


def find_packed(name: str | None) -> Role | None:
    """Return the role in a file name if its channels are different quantities (a packed map), and report it."""
    role = find_named(name)
    if role is None or not role.packed:
        return None
    find_named(name, report=True)
    assume(f"{name}: read as {role.value}: {', '.join(word or 'not used' for word in role.layout)}")
    return role


def look_up(
    source: SourceMap, several: Sequence[Map], finish: RenderOptions | None, watch: Callable[[float], object]
) -> Array:
    """Apply a source map to one map of each exemplar. Each group of channels is processed according to its role."""
    groups = list(zip(*(split_channels(each, source.axes) for each in several), strict=True))
    made = []
    for done, group in enumerate(groups):
        role = group[0].role

        def tell(_: str, share: float, done: int = done) -> None:
            watch((done + share) / len(groups))

        green: Green = "down" if role.down else "up"
        images = [each.pixels for each in group]
        made.append(blending.apply(source, images, map_type=find_kind(role), green=green, finish=finish, progress=tell))
    return made[0] if len(made) == 1 else np.concatenate(made, axis=-1)


def choose_kind(
    name: str | None, pixels: Sequence[Array], axes: int, map_type: Kind | None = None, green: Green | None = None
) -> tuple[Kind, Green]:
    """Return the type of a map and its direction of y: as given, from its file name, or from its values."""
    if map_type is not None:
        as_choice(map_type, "map_type", ("colour", "normal", "vector", "label"))
    if green is not None:
        as_choice(green, "green", ("up", "down"))
    role = find_named(name, report=map_type is None)
    title, usual = name or "exemplars", find_kind(role)
    found = map_type or usual
    if role is None and map_type is None and pixels and all(holds_labels(each, axes) for each in pixels):
        found = "label"
        assume(f"{title}: read as {REASON}")
    y: Green = green or ("down" if role is not None and role.down else "up")
    if map_type is None and role is not None and usual in ("normal", "vector"):
        assume(f"{title}: read as {usual}s with y {y}")
    elif map_type is None and role is not None and usual == "label":
        assume(f"{title}: read as labels, whose values are not mixed")
    elif name is not None and map_type is None and role is None and found == "colour":
        # A short name such as stone_n only has a role next to other maps of the same material.
        if cut_name(FilePath(name).stem) != FilePath(name).stem:
            assume(f"{title}: read as colours, because no other map in the folder explains the name")
    elif green is None and found in ("normal", "vector"):
        assume(f"{title}: read with y {y}")
    return found, y


def find_kind(role: Role | None) -> Kind:
    """Return how maps of a role are resampled: as "colour", "normal", "vector" or "label"."""
    if role is None:
        return "colour"
    if role.labelled:
        return "label"
    if role.normal:
        return "normal"
    return "vector" if role is Role.VECTOR else "colour"


def choose_finish(finish: RenderOptions, name: str | None) -> RenderOptions:
    """Return the finish for a map: only colours get their uneven light removed."""
    role = find_named(name)
    return (
        replace(finish, flatten_lighting=False)
        if finish.flatten_lighting and role not in (None, Role.COLOUR)
        else finish
    )

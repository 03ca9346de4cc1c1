"""The command that computes other maps of a result: ``texrs apply``."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

from texrs import io
from texrs._arrays import as_float, as_int
from texrs._lighting_correction import flatten_lighting
from texrs._threads import threads
from texrs._typing import Array
from texrs.cli import _outputs, _provenance
from texrs.cli._console import note, show_progress
from texrs.cli._options import Options, take_options
from texrs.cli._outputs import Quiet, Threads, describe, make_argument, name_arguments, show_sides, to_write
from texrs.cli._parts import is_stored
from texrs.cli._provenance import check_free
from texrs.errors import InvalidInput
from texrs.materials import Map, apply
from texrs.materials.applying import Green, Kind, choose_finish, choose_kind, find_packed, look_up
from texrs.source_map import RenderOptions, SourceMap

APPLIED = Options(
    apply,
    leave={
        "source": "it is an argument",
        "exemplars": "they are arguments, as many as wanted",
        "finish.known": "there is one mask per exemplar, and no map of them",
        "finish.parts": "the verb gives them",
        "finish.light": "the verb gives the position of its pixels",
        "finish.fade": "the verb gives the fade of its filling",
    },
    optional=dict.fromkeys(
        (
            *("wrap", "interpolation", "antialias", "screening", "band", "across", "outlines"),
            *("flatten_lighting", "within"),
        ),
        "as in the source map",
    )
    | {"map_type": "from the file name", "green": "from the file name, else up"},
)


@take_options(APPLIED)
def apply_command(
    source: Annotated[str, make_argument("MAP.npz", "Source map that the option --source-map of a command wrote.")],
    maps: Annotated[
        list[str],
        make_argument("IMAGE", "Images that are aligned with the exemplar, such as its heights or normals."),
    ],
    out: Annotated[str, to_write("out", text="Image or .zarr file to write, or a folder for several images.")],
    given: dict[str, Any],
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Compute the heights, normals or labels of a result through its source map, with the same finish as the result."""
    values = APPLIED.read(given, which=lambda o: not o.file)
    places = SourceMap.load(source)
    if given["finish_screening"] and places.axes != 2:
        raise InvalidInput("--screening: only available for source maps of images, not of volumes")
    groups = group(maps, len(places.shapes))
    targets = name_targets(groups, out, [source, *maps])
    finish = change_finish(places, values | APPLIED.read(given, which=lambda o: o.file))
    if is_stored(out):
        with name_arguments(**APPLIED.name_values(given), exemplars=" and ".join(maps)):
            store_map(places, maps, out, fit(finish, maps, given), values, count=count, quiet=quiet)
        return
    records = [_provenance.narrow([source, *paths]) for paths in groups]
    for target, made in zip(targets, records, strict=True):
        with _provenance.record(made):
            check_free(target)
    read = io.read if places.axes == 2 else io.read_volume
    # Give all results their final names together at the end, so that a failure leaves none.
    with ExitStack() as stack, threads(count):
        for paths, target, made in zip(groups, targets, records, strict=True):
            images = [read(path) for path in paths]
            _outputs.check_output(target, images[0], places.shape)
            like = replace(io.read_metadata(paths[0]), georeference=())
            temporary = stack.enter_context(_outputs.write_output(target, made=made))
            with name_arguments(**APPLIED.name_values(given), exemplars=" and ".join(paths)):
                image = make_map(paths[0], images, places, values, fit(finish, paths, given))
            if places.axes == 2:
                packed = find_packed(paths[0]) is not None
                coloured = not packed and read_kind(paths[0], images, places, values)[0] == "colour"
                io.write(temporary, image, notes=replace(like, multiplied=like.multiplied if coloured else None))
            else:
                _outputs.write_like(temporary, image, _outputs.find_volume(paths[0], 3), notes=like)
            note(f"{paths[0]} gives {target}: {describe(image, places.axes)}", quiet=quiet)


def store_map(
    places: SourceMap,
    paths: Sequence[str],
    out: str,
    finish: RenderOptions,
    values: Mapping[tuple[str, ...], Any],
    *,
    count: int | None,
    quiet: bool,
) -> None:
    """Write a result to a store, chunk by chunk, so that it does not have to fit in memory."""
    if finish.screening is not None or finish.light is not None or finish.fade is not None:
        raise InvalidInput(
            f"--out: {out} is written in parts, where colours cannot be corrected; write to another format, or for "
            "seams pass --screening 0"
        )
    read = io.read if places.axes == 2 else io.read_volume
    images = [read(path) for path in paths]
    kind, green = read_kind(paths[0], images, places, values)
    if finish.flatten_lighting and kind == "colour":
        images = [flatten_lighting(image) for image in images]
    how: dict[str, Any] = {"interpolation": finish.interpolation, "antialias": finish.antialias}
    how |= {"interpolation": "nearest"} if kind == "label" else {"map_type": kind, "green": green}
    running = _provenance.RUNNING.get()
    with show_progress(quiet=quiet) as progress:
        done = places.to_zarr(
            out,
            images,
            spacing=_outputs.read_kept_spacing(paths[0], out, places.axes),
            threads=count,
            overwrite=bool(running and running.force),
            progress=progress,
            **how,
        )
    note(f"{paths[0]} gives {out}: {show_sides(places.shape)}, {done.chunks} chunks", quiet=quiet)


def change_finish(places: SourceMap, values: Mapping[tuple[str, ...], Any]) -> RenderOptions:
    """Return the render options of the source map, with given options in place of its own."""
    known = places.finish or RenderOptions((True,) * places.axes)
    fields = {path[1]: value for path, value in values.items() if path[0] == "finish"}
    if "screening" in fields:
        fields["screening"] = as_float(fields["screening"], "--screening", 0, 1e6) or None
    if "band" in fields:
        fields["band"] = as_int(fields["band"], "--band", 1, 2**31)
    return replace(known, **fields)


def make_map(
    path: str,
    images: Sequence[Array],
    places: SourceMap,
    values: Mapping[tuple[str, ...], Any],
    finish: RenderOptions,
) -> Array:
    """Return a map of the result, rendered according to the options or the name of its file."""
    packed = None if {("map_type",), ("green",)} & values.keys() else find_packed(path)
    if packed is not None:
        return look_up(places, [Map(image, packed, "linear") for image in images], finish, lambda share: None)
    kind, green = read_kind(path, images, places, values)
    return apply(places, images, map_type=kind, green=green, finish=finish)


def read_kind(
    path: str, images: Sequence[Array], places: SourceMap, values: Mapping[tuple[str, ...], Any]
) -> tuple[Kind, Green]:
    """Return the type of a map and its green direction: as the options specify, else as its name and values suggest."""
    return choose_kind(path, images, places.axes, values.get(("map_type",)), values.get(("green",)))


def fit(finish: RenderOptions, paths: Sequence[str], given: Mapping[str, Any]) -> RenderOptions:
    """Return the render options for a map.

    Unless an option requests it, light is not removed from maps that do not contain colours, according to their file
    names.
    """
    return finish if given["finish_flatten_lighting"] is not None else choose_finish(finish, paths[0])


def group(maps: Sequence[str], count: int) -> list[list[str]]:
    """Return the maps in groups, each with one map for each exemplar of the source map."""
    if len(maps) % count:
        raise InvalidInput(
            f"IMAGE: each result needs {count} images, one for each exemplar of the source map; got {len(maps)}"
        )
    return [list(maps[i : i + count]) for i in range(0, len(maps), count)]


def name_targets(groups: Sequence[Sequence[str]], out: str, inputs: Sequence[str]) -> list[str]:
    """Return the names of the outputs: ``out`` itself, or files in this folder with the names of the maps."""
    if len(groups) == 1 and not Path(out).is_dir():
        return [out]
    if not Path(out).is_dir():
        raise InvalidInput(f"--out: must be an existing folder for {len(groups)} results, got {out!r}")
    targets = [os.path.join(out, Path(paths[0]).name) for paths in groups]
    for i, target in enumerate(targets):
        _outputs.check_apart(inputs, {"out": target})
        if target in targets[:i]:
            raise InvalidInput(f"--out: two results would have the name {Path(target).name}; write them one by one")
    return targets


COMMAND = apply_command

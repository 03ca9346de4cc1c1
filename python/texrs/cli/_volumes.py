"""Commands that show volumes: ``texrs slice``."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, cast

import numpy as np
import typer

from texrs import fields, io, samples
from texrs._arrays import as_image, as_int
from texrs._threads import threads
from texrs._typing import Array, Interpolation
from texrs.cli import _files
from texrs.cli._console import Quiet, Threads, note, watching
from texrs.cli._files import SAMPLE, describe, named
from texrs.errors import FileError, InvalidInput
from texrs.fields import Field
from texrs.volume import cube, oblique, paint, slices, turntable

__all__ = ["read_field", "read_volume", "slice_command"]

_AXES = ("plane", "row", "column")
_BETWEEN = ("linear", "cubic", "nearest")


def read_volume(text: str) -> Array:
    """Read a volume, or make the built-in one that ``sample:NAME`` names; all of it must be finite."""
    if text.startswith(SAMPLE):
        volume: Array = samples.load(text.removeprefix(SAMPLE)).image
        if volume.ndim != 4:
            known = ", ".join(n for n in samples.names() if n.endswith("solid") or n in ("particles", "stripes"))
            raise InvalidInput(f"{text}: is a picture; volumes are {known}")
    else:
        volume = io.read_volume(text)
    as_image(volume, text, axes=3)
    return volume


def read_field(text: str, size: tuple[int, ...]) -> Field:
    """Make the field that words describe, or sample the frames of an .npz file, over an output of a size."""
    if Path(text).suffix.lower() != ".npz":
        with named(field="--field"):
            return fields.parse(text, len(size), size)
    arrays = list(io.read_arrays(text).values())
    if len(arrays) != 1:
        raise FileError(f"{text}: needs a single array of frames, has {len(arrays)}")
    with named(frames=text):
        field = fields.from_array(arrays[0], size if arrays[0].ndim == len(size) + 2 else None)
    if field.axes != len(size):
        raise InvalidInput(f"{text}: holds frames of {field.axes} axes, {len(size)} are needed")
    return field


def slice_command(
    volume: Annotated[
        str, typer.Argument(metavar="VOLUME", help="The volume: a file, or sample:NAME.", show_default=False)
    ],
    out: Annotated[str, typer.Option("--out", "-o", metavar="OUT", help="Image file to write.", show_default=False)],
    at: Annotated[
        str | None,
        typer.Option(
            metavar="AXIS=N",
            help="One slice: plane=30, row=-1 (the last) or column=7; or three: 30,20,10.",
            show_default="three, through the middle",
        ),
    ] = None,
    oblique_cut: Annotated[
        str | None,
        typer.Option(
            "--oblique",
            metavar="POINT/NORMAL",
            help="A cut through 30,20,10 across the direction 1,1,0: 30,20,10/1,1,0; /1,1,0 is through the middle.",
            show_default=False,
        ),
    ] = None,
    as_cube: Annotated[bool, typer.Option("--cube", help="A block of the material, on a transparent ground.")] = False,
    as_turntable: Annotated[bool, typer.Option("--turntable", help="The block turning, as an animated GIF.")] = False,
    size: Annotated[
        int | None, typer.Option(help="Side of --cube and --turntable, in pixels.", show_default="512, and 320")
    ] = None,
    frames: Annotated[int, typer.Option(help="Pictures of --turntable.")] = 24,
    interpolation: Annotated[
        str, typer.Option(help="Between voxels: linear, cubic, or nearest, for labels.")
    ] = "linear",
    labels: Annotated[bool, typer.Option("--labels", help="The volume holds labels: each is given a colour.")] = False,
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Show a volume: slices along its axes, a cut in any direction, a cube or a turntable."""
    start = time.monotonic()
    asked = {"--at": at is not None, "--oblique": oblique_cut is not None, "--cube": as_cube}
    given = [option for option, there in (asked | {"--turntable": as_turntable}).items() if there]
    if len(given) > 1:
        raise InvalidInput(f"{' and '.join(given)}: one of them can be asked for")
    if interpolation not in _BETWEEN:
        raise InvalidInput(f"--interpolation: allowed are {', '.join(_BETWEEN)}; got {interpolation!r}")
    between = cast(Interpolation, interpolation)
    place = None if at is None else _parse_at(at)
    cut = None if oblique_cut is None else _parse_oblique(oblique_cut)
    moving = Path(out).suffix.lower() == ".gif"
    if moving != as_turntable:
        raise InvalidInput(f"--out: {'a picture is not' if moving else '--turntable is'} written to .gif, got {out!r}")
    _files.check_output(out, np.zeros((1, 1, 4), np.uint8) if as_cube else None)
    voxels = read_volume(volume)
    if labels:
        with named(labels=volume):
            voxels = paint(voxels)
        between = "nearest"
    if not (as_cube or as_turntable):
        _files.check_output(out, voxels[0])
    names = {"volume": volume, "point": "--oblique", "normal": "--oblique", "count": "--threads"}
    with named(**names), threads(count):
        if as_turntable:
            with watching(quiet=quiet) as progress:
                side = 320 if size is None else size
                turntable(voxels, out, frames=frames, size=side, interpolation=between, progress=progress)
            note(f"wrote {out}: {frames} pictures, in {time.monotonic() - start:.1f} s", quiet=quiet)
            return
        if as_cube:
            picture: Array = cube(voxels, 512 if size is None else size, interpolation=between)
        elif cut is not None:
            picture = oblique(voxels, cut[0], cut[1], interpolation=between)
        elif isinstance(place, tuple):
            axis, number = place
            length = voxels.shape[axis]
            picture = np.take(voxels, as_int(number, "at", -length, length - 1), axis=axis)
        else:
            picture = slices(voxels, place)
    with _files.output(out) as temporary:
        io.write(temporary, picture)
    note(f"wrote {out}: {describe(picture, 2)}, in {time.monotonic() - start:.1f} s", quiet=quiet)


def _parse_at(text: str) -> tuple[int, int] | list[int]:
    """Read ``plane=30`` as an axis and a place, ``30,20,10`` as a place on each."""
    axis, equals, number = (p.strip() for p in text.partition("="))
    try:
        if equals and axis in _AXES:
            return _AXES.index(axis), int(number)
        if not equals and text.count(",") == 2:
            return [int(p) for p in text.split(",")]
    except ValueError:
        pass
    raise InvalidInput(f"--at: needs plane=, row= or column= and a number, or three such as 30,20,10; got {text!r}")


def _parse_oblique(text: str) -> tuple[list[float] | None, list[float]]:
    """Read ``30,20,10/1,1,0`` as a point and a direction."""
    point, slash, normal = text.partition("/")
    try:
        middle = None if not point.strip() else [float(p) for p in point.split(",")]
        direction = [float(p) for p in normal.split(",")]
    except ValueError:
        middle, direction = None, []
    if not slash or len(direction) != 3 or (middle is not None and len(middle) != 3):
        raise InvalidInput(f"--oblique: needs POINT/NORMAL such as 30,20,10/1,1,0, or /1,1,0; got {text!r}")
    return middle, direction

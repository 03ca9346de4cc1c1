"""The command that shows volumes: ``texrs slice``."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from texrs import io
from texrs._arrays import as_int
from texrs._threads import threads
from texrs._typing import Array
from texrs.cli import _outputs
from texrs.cli._console import note, show_progress
from texrs.cli._kinds import Kind
from texrs.cli._options import Options, check_needed, take_options
from texrs.cli._outputs import Quiet, Threads, describe, make_argument, name_arguments, to_write
from texrs.cli._places import turn
from texrs.cli._readers import read_stated_spacing, read_volume
from texrs.cli._texts import About, parse_numbers
from texrs.errors import InvalidInput
from texrs.fields.spaced import as_distances
from texrs.volume import Viewer, cubes, label_to_color, oblique_slice, render_block, render_volume, slices, turntable
from texrs.volume.rendering import as_steps, check_cube, check_turntable
from texrs.volume.stretch import find_cube
from texrs.volume.transparent import check_transfer, parse_transfer
from texrs.volume.values import as_direction

_AXES = {"plane": 0, "row": 1, "column": 2, "z": 0, "y": 1, "x": 2}
"""Names of axes, as array axes and as coordinates, and the index of each."""


def parse_at(text: str, about: About) -> tuple[int, int] | list[float]:
    """Convert ``z=30`` to an axis and a position, or ``10,20,30`` to (plane, row, column)."""
    axis, equals, number = (p.strip() for p in text.partition("="))
    try:
        if equals and axis in _AXES:
            return _AXES[axis], int(number)
        if not equals and text.count(",") == 2:
            return turn([int(p) for p in text.split(",")])
    except ValueError:
        pass
    raise InvalidInput(
        f"{about.option}: must be a slice such as z=30 (x, y or z), or a point such as 10,20,30; got {text!r}"
    )


def parse_oblique(text: str, about: About) -> tuple[list[float] | None, list[float]]:
    """Convert ``10,20,30/0,1,1`` to a point and a direction, each (plane, row, column)."""
    point, slash, normal = text.partition("/")
    wanted = "X,Y,Z/X,Y,Z, a point and a normal such as 10,20,30/0,1,1, or /0,1,1"
    if not slash:
        raise InvalidInput(f"{about.option}: must be {wanted}; got {text!r}")
    sides = [
        turn(parse_numbers(p, about.option, wanted, counts=(3,), between=",")) if p.strip() else None
        for p in (point, normal)
    ]
    if sides[1] is None:
        raise InvalidInput(f"{about.option}: must be {wanted}; got {text!r}")
    return sides[0], sides[1]


ACROSS = Options(
    slices,
    only=("at",),
    kinds={
        "at": Kind(
            "AXIS=N|X,Y,Z",
            parse_at,
            "A point such as 10,20,30, or one slice: z=30 (a plane), y=-1 (the last row), x=7.",
        )
    },
)
CUT = Options(
    oblique_slice,
    only=("normal", "interpolation"),
    names={"normal": "oblique"},
    kinds={
        "normal": Kind(
            "X,Y,Z/X,Y,Z",
            parse_oblique,
            "A point and a normal, such as 10,20,30/0,1,1. Without a point, /0,1,1 is through the middle.",
        )
    },
)
_SHOWN = {"size": "512, or 320 for --turntable", "elevation": "30, or 25 for --turntable"}
BLOCK = Options(render_block, only=("size", "azimuth", "elevation", "interpolation"), optional=_SHOWN)
CLEAR = Options(
    render_volume,
    only=("size", "azimuth", "elevation", "transfer", "shading"),
    optional=_SHOWN,
    kinds={
        "transfer": Kind(
            "V:COLOUR:ALPHA,...",
            lambda text, about: parse_transfer(text),
            "For example 0:own:0,0.4:own:0,0.6:#cc3322:0.2, where own is the colour of the voxel.",
        )
    },
)
APART = Options(cubes, only=("spacing",), optional={"spacing": "as the file states"}, axes=3)
TURNED = Options(turntable, only=("size", "frames", "elevation", "seconds", "interpolation"), optional=_SHOWN)


@take_options(ACROSS, CUT, BLOCK, CLEAR, TURNED, APART)
def slice_command(
    volume: Annotated[str, make_argument("VOLUME", "The volume: a file, or sample:NAME.")],
    out: Annotated[str, to_write("out", text="Image file to write, or a page (.html) with sliders.")],
    given: dict[str, Any],
    as_cube: Annotated[
        bool, typer.Option("--cube", help="Draw a block of the material on a transparent background.")
    ] = False,
    as_clear: Annotated[
        bool, typer.Option("--transparent", help="Draw the block with the transparency of --transfer.")
    ] = False,
    as_turntable: Annotated[
        bool, typer.Option("--turntable", help="Draw the rotating block as an animated GIF.")
    ] = False,
    labels: Annotated[bool, typer.Option("--labels", help="Draw each label of the volume in its own colour.")] = False,
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Show a volume: slices along its axes, an oblique slice, a block, a transparent view, or a turntable."""
    start = time.monotonic()
    asked = {
        "--at": given["at"],
        "--oblique": given["normal"],
        "--cube": as_cube,
        "--transparent": as_clear,
        "--turntable": as_turntable,
    }
    # At most one kind of picture can be requested.
    chosen = [option for option, there in asked.items() if there]
    if len(chosen) > 1:
        raise InvalidInput(f"{' and '.join(chosen)}: cannot be combined")
    owners = {"--at": ACROSS, "--oblique": CUT, "--cube": BLOCK, "--transparent": CLEAR, "--turntable": TURNED}
    used = owners[(chosen or ["--at"])[0]]
    options = used.call(used.read(given))
    check_needed(given, owners, (chosen or ["--at"])[0])
    paged = Path(out).suffix.lower() in (".html", ".htm")
    if paged and chosen:
        raise InvalidInput(
            f"--out: must be an image with {chosen[0]}, got {out!r}; an HTML page shows only slices along the axes"
        )
    with name_arguments(point="--oblique", normal="--oblique", count="--threads"), threads(count):
        check_view(used, options)
    with name_arguments():
        spacing = as_distances(said, 3) if (said := APART.call(APART.read(given)).get("spacing")) else None
    moving = Path(out).suffix.lower() == ".gif"
    if moving != as_turntable:
        raise InvalidInput(
            f"--out: must {'not end in .gif without' if moving else 'end in .gif with'} --turntable, got {out!r}"
        )
    _outputs.check_output(out, np.zeros((1, 1, 4), np.uint8) if as_cube or as_clear else None)
    # Read the volume after all checks, and resample it to cubic voxels.
    voxels = read_volume(volume)
    length = voxels.shape[:3]
    if spacing is None:
        spacing = read_stated_spacing(volume)
    if spacing is not None:
        with name_arguments(volume=volume):
            voxels = cubes(voxels, spacing)
        place_in_cubes(options, length, voxels.shape[:3])
    if labels:
        with name_arguments(labels=volume):
            voxels = label_to_color(voxels)
        if used not in (ACROSS, CLEAR):
            options["interpolation"] = "nearest"
    if not (as_cube or as_clear or as_turntable or paged):
        _outputs.check_output(out, voxels[0])
    with name_arguments(volume=volume, point="--oblique", normal="--oblique", count="--threads"), threads(count):
        if as_turntable:
            with show_progress(quiet=quiet) as progress, _outputs.write_output(out) as temporary:
                turntable(voxels, temporary, **options, progress=progress)
            note(f"wrote {out}: {given['frames']} images, in {time.monotonic() - start:.1f} s", quiet=quiet)
            return
        if paged:
            with _outputs.write_output(out) as temporary:
                Viewer(voxels).save(temporary)
            note(f"wrote {out}: {describe(voxels, 3)}, in {time.monotonic() - start:.1f} s", quiet=quiet)
            return
        picture = draw(voxels, used, options)
    with _outputs.write_output(out) as temporary:
        io.write(temporary, picture)
    note(f"wrote {out}: {describe(picture, 2)}, in {time.monotonic() - start:.1f} s", quiet=quiet)


def check_view(used: Options, options: dict[str, Any]) -> None:
    """Check the requested view before the volume is read, because reading can take a long time."""
    asked = {name: value for name, value in options.items() if name != "interpolation"}
    if used is BLOCK:
        check_cube(**asked)
    elif used is CLEAR:
        check_cube(**{name: asked[name] for name in ("size", "azimuth", "elevation") if name in asked})
        check_transfer(asked.get("transfer"))
    elif used is TURNED:
        check_turntable(**asked)
    elif used is CUT:
        point, normal = asked["normal"]
        as_steps(normal, None)
        if point is not None:
            as_direction(point, "point")


def place_in_cubes(options: dict[str, Any], length: Sequence[int], sides: Sequence[int]) -> None:
    """Convert places in voxels to places in cubic voxels."""
    place = options.get("at")
    if isinstance(place, tuple):
        axis, number = place
        options["at"] = (axis, find_cube(number, length[axis], sides[axis]))
    elif place is not None:
        options["at"] = [find_cube(*each) for each in zip(place, length, sides, strict=True)]
    if "normal" in options and options["normal"][0] is not None:
        point, normal = options["normal"]
        scaled = [(p + 0.5) * n / m - 0.5 for p, n, m in zip(point, sides, length, strict=True)]
        options["normal"] = scaled, normal


def draw(voxels: Array, used: Options, options: dict[str, Any]) -> Array:
    """Return the image of the requested view."""
    if used is BLOCK:
        return render_block(voxels, **options)
    if used is CLEAR:
        return render_volume(voxels, **options)
    if used is CUT:
        point, normal = options.pop("normal")
        return oblique_slice(voxels, point, normal, **options)
    place = options.get("at")
    if isinstance(place, tuple):
        axis, number = place
        length = voxels.shape[axis]
        return np.asarray(np.take(voxels, as_int(number, "at", -length, length - 1), axis=axis))
    return slices(voxels, place)


COMMAND = slice_command

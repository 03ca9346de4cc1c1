"""The command of unbounded designs: ``texrs tiles``."""

from __future__ import annotations

import os
import time
from typing import Annotated, Any

import typer

from texrs import io
from texrs._checks import as_size
from texrs._threads import threads
from texrs.cli import _outputs
from texrs.cli._console import note, show_progress
from texrs.cli._kinds import EXAMPLE
from texrs.cli._options import Options, take_options
from texrs.cli._outputs import Quiet, Threads, describe, make_option, name_arguments, to_write
from texrs.cli._parts import BEYOND, Asked, is_stored, write_part
from texrs.cli._provenance import check_free
from texrs.cli._stacks import Roles, Stack, is_stack
from texrs.cli._texts import About, parse_size
from texrs.corner_tiles import CornerTiles
from texrs.errors import InvalidInput
from texrs.materials import Material
from texrs.materials.single import SingleMap
from texrs.papers.design import design_variants

CELLS = 256
"""Number of cells of the index texture along each side."""
TILED = Options(CornerTiles, arguments={"exemplar": EXAMPLE}, names={"variants": "pictures"})
DESIGNED = Options(
    design_variants,
    only=("elements", "deformation", "way", "copies", "patch_size", "screening"),
    names={"elements": "element"},
)
PANEL = "Larger than memory"


@take_options(TILED, DESIGNED)
def tiles_command(
    out: Annotated[
        str,
        to_write(
            "out", "DIR|OUT", "Folder for the atlas, its index and shaders, or an image or .zarr file for a window."
        ),
    ],
    given: dict[str, Any],
    size: Annotated[
        str | None, make_option("WIDTHxHEIGHT", "Size in pixels of a window to write instead of the tile set.")
    ] = None,
    origin: Annotated[
        str | None, make_option("X,Y", "First pixel of the window: integers from -10^15 to 10^15.")
    ] = None,
    index: Annotated[
        str | None, make_option("WIDTHxHEIGHT", f"Size of the index texture in cells. Default: {CELLS}x{CELLS}.")
    ] = None,
    chunks: Annotated[
        str | None,
        typer.Option(
            metavar="WIDTHxHEIGHT",
            help="Size of a chunk of the window in pixels.",
            show_default=False,
            rich_help_panel=PANEL,
        ),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            metavar="N", help="Number of processes that compute the chunks.", show_default=False, rich_help_panel=PANEL
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Address of a Dask cluster that computes the chunks.",
            show_default=False,
            rich_help_panel=PANEL,
        ),
    ] = None,
    role: Roles = None,
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Cut corner tiles from designs: an unbounded texture with any window on request."""
    start = time.monotonic()
    said = {"origin": origin, "chunks": chunks, "workers": workers, "scheduler": scheduler}
    asked, windowed = Asked.read(said, 2), size is not None
    for name, value in said.items():
        if value is not None and not windowed:
            raise InvalidInput(f"--{name}: must be combined with --size, because it only affects windows")
    if windowed and index is not None:
        raise InvalidInput("--index: cannot be combined with --size (a window has no index texture)")
    sides = parse_size(size or str(CELLS), limit=1 << 60) if windowed else parse_size(index or str(CELLS), "--index")
    parts = is_stored(out) or chunks is not None or asked.scheduler is not None
    if windowed and not parts:
        # Check the size before the tiles are cut, which takes a long time.
        as_size(sides, "--size", way=BEYOND)
    stack = Stack.take(dict.fromkeys(("depth", "format", "pack")) | {"role": role})
    values = TILED.read(given, which=lambda o: not o.file) | DESIGNED.read(given)
    folder = is_stack(given["exemplar"])
    if not windowed:
        _outputs.check_folder(out)
        for name in ("index.png", "tiles.glsl", "tiles.gdshader"):
            check_free(os.path.join(out, name))
    elif not parts and not folder:
        _outputs.check_output(out)
    values |= TILED.read(given, About(roles=stack.roles), which=lambda o: o.file)
    names = DESIGNED.name_values(given) | TILED.name_values(given)
    with name_arguments(**names):
        call = TILED.call(values) | DESIGNED.call(
            {path: v for path, v in values.items() if path not in {o.path for o in TILED}}
        )
    example = call["exemplar"]
    single = isinstance(example, SingleMap)
    if isinstance(example, Material) and not single:
        if windowed and not parts:
            stack.check_outputs(example, {"out": out}, [])
    elif role:
        stack.refuse({})
    with name_arguments(**names, count="--threads"), threads(count), show_progress(quiet=quiet) as progress:
        tiles = CornerTiles(**call, progress=progress)
    note(f"made {tiles!r}, in {time.monotonic() - start:.1f} s", quiet=quiet)
    if not windowed:
        # `write_folder` checks that each existing file is from this command before it is replaced.
        with _outputs.write_folder(out, "out") as place:
            files = tiles.save(place, sides)
        note(f"wrote {out}: {', '.join(file.name for file in files)}", quiet=quiet)
        return
    if parts:
        write_part(tiles, out, sides, asked, count=count, quiet=quiet)
        return
    with name_arguments(size="--size", origin="--origin"):
        made = tiles.window(asked.origin, sides)
    if made.material is None or single:
        notes = io.read_metadata(given["exemplar"]) if os.path.isfile(given["exemplar"]) else io.Metadata()
        like = io.Metadata(profile=notes.profile, srgb=notes.srgb, multiplied=notes.multiplied)
        with _outputs.write_output(out) as temporary:
            io.write(temporary, made.image, notes=like)
    else:
        stack.deliver(made, {"out": out})
    note(f"wrote {out}: {describe(made.image, 2)}, in {time.monotonic() - start:.1f} s", quiet=quiet)


COMMAND = tiles_command

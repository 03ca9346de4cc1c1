"""Commands that mend a picture: ``texrs tile`` and ``texrs complete``."""

from __future__ import annotations

import time
from typing import Annotated, Literal, cast

import numpy as np
import typer

from texrs._threads import threads
from texrs.cli import _files
from texrs.cli._console import Out, Quiet, Source, Stages, Threads, note, watching
from texrs.cli._files import describe, named
from texrs.cli._scales import read_scale
from texrs.completion import complete
from texrs.tiling import tile

__all__ = ["complete_command", "tile_command"]

Picture = Annotated[
    str, typer.Argument(metavar="IN", help="The picture: an image file, or sample:NAME.", show_default=False)
]


def tile_command(
    image: Picture,
    out: Out,
    wrap: Annotated[
        str, typer.Option(metavar="AXES", help="Where the result tiles: xy, x (left-right), y (top-bottom) or none.")
    ] = "xy",
    overlap: Annotated[
        str | None,
        typer.Option(
            metavar="N|ROWSxCOLS",
            help="Pixels of two opposite edges that are laid over each other, up to half the side.",
            show_default="a cheap one between 25 and 100",
        ),
    ] = None,
    stages: Stages = None,
    source: Source = None,
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Make a picture cyclic, so that copies side by side have no edge between them."""
    start = time.monotonic()
    cyclic, lines = _files.parse_wrap(wrap), _files.parse_size(overlap, name="--overlap")
    _files.check_outputs(out, source, stages)
    pixels = _files.read_exemplar(image)
    _files.check_output(out, pixels, pixels.shape[:2])
    with named(image=image, count="--threads"), threads(count), watching(quiet=quiet) as progress:
        result = tile(pixels, wrap=cyclic, overlap=lines, progress=progress)
    _files.deliver(result, out, source, stages)
    note(f"wrote {out}: {describe(result.image, 2)}, in {time.monotonic() - start:.1f} s", quiet=quiet)


def complete_command(
    image: Picture,
    hole: Annotated[
        str,
        typer.Argument(
            metavar="HOLE",
            help="Image of the same size: what is not black is filled; or alpha: what is transparent in IN.",
            show_default=False,
        ),
    ],
    out: Out,
    source_image: Annotated[
        str | None,
        typer.Option(
            metavar="FILE", help="Picture to copy from, of the same dtype and channels.", show_default="IN itself"
        ),
    ] = None,
    scale: Annotated[
        str | None,
        typer.Option(
            metavar="MAP|auto",
            help="For pictures taken at an angle: their scale map, or auto to measure it.",
            show_default=False,
        ),
    ] = None,
    source_scale: Annotated[
        str | None,
        typer.Option(
            metavar="MAP|auto",
            help="With --scale: the scale map of --source-image, or auto.",
            show_default="seen from the front",
        ),
    ] = None,
    method: Annotated[str, typer.Option(help="patch, or optimise: windows corrected until they fit.")] = "patch",
    patch: Annotated[
        int | None,
        typer.Option(
            help="Side of the patches, in pixels, at least 4; not with --method optimise.",
            show_default="by the picture's size",
        ),
    ] = None,
    boundary: Annotated[
        int, typer.Option(help="Pixels around the hole that may be replaced too, to hide the seam.")
    ] = 0,
    mirror: Annotated[
        bool | None,
        typer.Option("--mirror/--no-mirror", help="Whether patches may be mirrored.", show_default="not with --scale"),
    ] = None,
    blend: Annotated[
        float | None,
        typer.Option(
            metavar="WEIGHT",
            help="Make the seams of what is filled disappear, as design --blend does; 0.003 is usual.",
            show_default=False,
        ),
    ] = None,
    wrap: Annotated[
        str, typer.Option(metavar="AXES", help="Where the picture tiles: xy, x (left-right), y (top-bottom) or none.")
    ] = "none",
    seed: Annotated[int, typer.Option(help="Chooses patches where nothing is known around.")] = 0,
    stages: Stages = None,
    source: Source = None,
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Fill a hole in a picture with patches of what is known of it, or of another picture."""
    start = time.monotonic()
    cyclic = _files.parse_wrap(wrap)
    _files.check_outputs(out, source, stages)
    pixels = _files.read_picture(image)
    mask = hole if hole == "alpha" else _files.read_hole(hole)
    scaled, theirs = (s if s is None or s == "auto" else read_scale(s) for s in (scale, source_scale))
    other = None if source_image is None else _files.read_exemplar(source_image)
    # In the hole anything may stand that the format of the result cannot hold.
    _files.check_output(out, np.nan_to_num(pixels), pixels.shape[:2])
    names = {"image": image, "hole": "HOLE" if hole == "alpha" else hole, "exemplar": str(source_image)}
    names |= {"scale_map": str(scale), "exemplar_scale_map": source_scale or "--source-scale", "count": "--threads"}
    with named(**names), threads(count), watching(quiet=quiet) as progress:
        result = complete(
            pixels,
            mask,
            exemplar=other,
            scale_map=scaled,
            exemplar_scale_map=theirs,
            method=cast(Literal["patch", "optimise"], method),
            patch=patch,
            boundary=boundary,
            mirror=mirror,
            blend=blend,
            wrap=cyclic,
            seed=seed,
            progress=progress,
        )
    _files.deliver(result, out, source, stages)
    note(f"wrote {out}: {describe(result.image, 2)}, in {time.monotonic() - start:.1f} s", quiet=quiet)

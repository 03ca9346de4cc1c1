"""The command that grows textures in perspective: ``texrs perspective``."""

from __future__ import annotations

import time
import warnings
from typing import Annotated, Literal, cast

import typer

from texrs._threads import threads
from texrs._typing import Interpolation
from texrs.cli import _files
from texrs.cli._console import Method, Out, Quiet, Source, Stages, Threads, as_method, note, watching
from texrs.cli._files import describe, named
from texrs.cli._scales import read_scale
from texrs.errors import InvalidInput
from texrs.papers.perspective import perspective

__all__ = ["perspective_command"]


def perspective_command(
    image: Annotated[
        str, typer.Argument(metavar="IMAGE", help="The example: an image file, or sample:NAME.", show_default=False)
    ],
    out: Out,
    scale: Annotated[
        str,
        typer.Option(metavar="MAP", help="Scale map of the example, of texrs scale-map.", show_default=False),
    ],
    size: Annotated[
        str | None,
        typer.Option(metavar="ROWSxCOLS", help="Size of the result, in pixels.", show_default="twice the example"),
    ] = None,
    target: Annotated[
        str | None,
        typer.Option(
            metavar="MAP", help="Scale map of the result, of its size.", show_default="that of the example, stretched"
        ),
    ] = None,
    scale_weight: Annotated[
        float, typer.Option(help="How much the scale counts beside looking like the example, 0 to 16.")
    ] = 1.0,
    augment_scales: Annotated[
        str,
        typer.Option(
            metavar="SIZES", help="Resized copies to copy from: auto, yes, no, or their sizes as in 0.8:1.25."
        ),
    ] = "auto",
    wrap: Annotated[
        str, typer.Option(metavar="AXES", help="Where the result tiles: xy, x (left-right), y (top-bottom) or none.")
    ] = "none",
    seed: Annotated[int, typer.Option(help="Chooses the texture; the same seed gives the same bytes.")] = 0,
    interpolation: Annotated[
        str, typer.Option(help="Where the example is resized: cubic, linear or nearest.")
    ] = "cubic",
    method: Method = "default",
    stages: Stages = None,
    source: Source = None,
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Grow a picture whose elements are as large as a scale map says."""
    start = time.monotonic()
    shape, cyclic = _files.parse_size(size), _files.parse_wrap(wrap)
    sizes = _parse_sizes(augment_scales)
    if interpolation not in ("cubic", "linear", "nearest"):
        raise InvalidInput(f"--interpolation: allowed are cubic, linear and nearest; got {interpolation!r}")
    how = as_method(method)
    _files.check_outputs(out, source, stages)
    example = _files.read_exemplar(image)
    wanted = None if target is None else read_scale(target)
    if shape is None:
        shape = tuple(2 * n for n in example.shape[:2]) if wanted is None else wanted.shape
    _files.check_output(out, example, shape)
    names = {"exemplar": image, "scale_map": scale, "target": str(target), "count": "--threads"}
    names |= {"scale_weight": "--scale-weight", "augment_scales": "--augment-scales"}
    with (
        named(**names),
        threads(count),
        watching(quiet=quiet) as progress,
        warnings.catch_warnings(record=True) as said,
    ):
        warnings.simplefilter("always")
        result = perspective(
            example,
            read_scale(scale),
            shape,
            target=wanted,
            method=how,
            scale_weight=scale_weight,
            augment_scales=sizes,
            wrap=cyclic,
            seed=seed,
            interpolation=cast(Interpolation, interpolation),
            progress=progress,
        )
    for warning in said:
        if issubclass(warning.category, UserWarning):
            note(str(warning.message), quiet=quiet)
    _files.deliver(result, out, source, stages)
    note(f"wrote {out}: {describe(result.image, 2)}, in {time.monotonic() - start:.1f} s", quiet=quiet)


def _parse_sizes(text: str) -> Literal["auto"] | bool | list[float]:
    """Read ``auto``, ``yes``, ``no``, or sizes as in ``0.8:1.25``."""
    word = text.strip().lower()
    if word in ("auto", "yes", "no"):
        return "auto" if word == "auto" else word == "yes"
    try:
        return [float(part) for part in word.split(":")]
    except ValueError:
        raise InvalidInput(f"--augment-scales: needs auto, yes, no, or sizes as in 0.8:1.25; got {text!r}") from None

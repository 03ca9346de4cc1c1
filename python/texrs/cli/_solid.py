"""Commands that grow textures under a frame field: ``texrs solid`` and ``texrs synthesize``."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from typing import Annotated, Any, cast

import numpy as np
import typer

from texrs import io
from texrs._threads import threads
from texrs._typing import Array, Interpolation
from texrs.cli import _files
from texrs.cli._console import Method, Out, Quiet, Source, Stages, Threads, as_method, note, watching
from texrs.cli._files import describe, named
from texrs.cli._volumes import read_field, read_volume
from texrs.errors import InvalidInput
from texrs.exemplar import Exemplar
from texrs.growth import Constraints, Guide
from texrs.papers.solid import solid, synthesize
from texrs.synthesis import Synthesis

__all__ = ["solid_command", "synthesize_command"]

FieldText = Annotated[
    str | None,
    typer.Option(
        "--field",
        metavar="WORDS|FILE.npz",
        help="How the texture is turned and scaled: circular:axis=z, zigzag:period=64,angle=30, or frames in a file.",
        show_default="as the example stands",
    ),
]
Seed = Annotated[int, typer.Option(help="Chooses the texture; the same seed gives the same bytes.")]
Quality = Annotated[
    str, typer.Option(help="preserve keeps what is rare, fast does less work, optimise straightens lattices.")
]
Held = Annotated[
    str | None,
    typer.Option(metavar="FILE", help="Mask of the result's size: what is not 0 shows --values.", show_default=False),
]
Values = Annotated[
    str | None,
    typer.Option(metavar="FILE", help="What is held, in the example's dtype and channels.", show_default=False),
]
Guided = Annotated[
    tuple[str, str] | None,
    typer.Option(
        metavar="MAP MAP",
        help="Two maps of one channel, of the example and of the result: where the one shows what the other says is looked.",
        show_default=False,
    ),
]
Weight = Annotated[float, typer.Option(help="How much --guide counts beside looking like the example, 0 to 100.")]
Labels = Annotated[
    bool | None,
    typer.Option(
        "--labels/--no-labels",
        help="Whether values are classes without an order.",
        show_default="2 to 16 whole numbers of one channel are",
    ),
]
Between = Annotated[str | None, typer.Option("--interpolation", help="cubic, linear or nearest.", show_default=False)]
Memory = Annotated[
    str | None,
    typer.Option(metavar="BYTES", help="Most memory that the work may take, as in 900M or 16G.", show_default="8G"),
]


def solid_command(
    volume: Annotated[
        str, typer.Argument(metavar="VOLUME", help="The example: a file, or sample:NAME.", show_default=False)
    ],
    out: Out,
    size: Annotated[
        str | None,
        typer.Option(
            metavar="PLANESxROWSxCOLS", help="Size of the result, in voxels.", show_default="twice the example"
        ),
    ] = None,
    field: FieldText = None,
    seed: Seed = 0,
    wrap: Annotated[
        str,
        typer.Option(
            metavar="AXES", help="Where the result repeats: x (columns), y (rows), z (planes), as in xyz, or none."
        ),
    ] = "none",
    quality: Quality = "preserve",
    held: Held = None,
    values: Values = None,
    guide: Guided = None,
    guide_weight: Weight = 1.0,
    labels: Labels = None,
    interpolation: Between = None,
    method: Method = "default",
    memory_limit: Memory = None,
    stages: Stages = None,
    source: Source = None,
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Grow a volume from a volume, under a frame field."""
    asked = locals()
    _grow(3, solid, asked.pop("volume"), **asked)


def synthesize_command(
    image: Annotated[
        str,
        typer.Argument(metavar="IMAGE", help="The example: an image file, or sample:NAME.", show_default=False),
    ],
    out: Out,
    size: Annotated[
        str | None,
        typer.Option(metavar="ROWSxCOLS", help="Size of the result, in pixels.", show_default="twice the example"),
    ] = None,
    field: FieldText = None,
    seed: Seed = 0,
    wrap: Annotated[
        str, typer.Option(metavar="AXES", help="Where the result tiles: xy, x (left-right), y (top-bottom) or none.")
    ] = "none",
    quality: Quality = "preserve",
    held: Held = None,
    values: Values = None,
    guide: Guided = None,
    guide_weight: Weight = 1.0,
    labels: Labels = None,
    interpolation: Between = None,
    method: Method = "default",
    memory_limit: Memory = None,
    stages: Stages = None,
    source: Source = None,
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Grow a picture from a picture, under a frame field."""
    asked = locals()
    _grow(2, synthesize, asked.pop("image"), **asked)


def _grow(
    axes: int,
    verb: Callable[..., Synthesis],
    name: str,
    *,
    out: str,
    size: str | None,
    field: str | None,
    wrap: str,
    held: str | None,
    values: str | None,
    guide: tuple[str, str] | None,
    guide_weight: float,
    labels: bool | None,
    interpolation: str | None,
    method: str,
    memory_limit: str | None,
    stages: str | None,
    source: str | None,
    count: int | None,
    quiet: bool,
    **options: Any,
) -> None:
    """Do what both commands do: with two axes or three."""
    start = time.monotonic()
    shape, cyclic = _files.parse_size(size, axes=axes), _files.parse_axes(wrap, axes=axes)
    if interpolation not in (None, "cubic", "linear", "nearest"):
        raise InvalidInput(f"--interpolation: allowed are cubic, linear and nearest; got {interpolation!r}")
    how = as_method(method)
    if (held is None) != (values is None):
        raise InvalidInput("--held and --values: needed together, to say where something is held, and what")
    limit = None if memory_limit is None else parse_bytes(memory_limit)
    _files.check_outputs(out, source, stages)
    example = read_volume(name) if axes == 3 else _files.read_exemplar(name)
    sides = shape or tuple(2 * n for n in example.shape[:axes])
    _files.check_output(out, example, sides)
    frames = None if field is None else read_field(field, sides)
    names = {"exemplar": name, "image": name, "mask": str(held), "values": str(values), "constraints": "--held"}
    names |= {"count": "--threads", "memory_limit": "--memory-limit", "weight": "--guide-weight"}
    names |= {"guide": "--guide " + " ".join(guide or ())}
    with named(**names), threads(count), watching(quiet=quiet) as progress:
        given = maps = None
        if held is not None and values is not None:
            given = Constraints(mask=_read_mask(held, axes), values=_read_like(values, example, axes))
        if guide is not None:
            mine, theirs = (_read_map(path, axes) for path in guide)
            maps = Guide(exemplar=mine, output=theirs, weight=guide_weight)
        result = verb(
            example if labels is None else Exemplar(example, axes=axes, labels=labels),
            sides,
            field=frames,
            wrap=cyclic,
            constraints=given,
            guide=maps,
            interpolation=cast(Interpolation | None, interpolation),
            method=how,
            memory_limit=limit,
            progress=progress,
            **options,
        )
    _files.deliver(result, out, source, stages)
    note(f"wrote {out}: {describe(result.image, axes)}, in {time.monotonic() - start:.1f} s", quiet=quiet)


def _read_mask(path: str, axes: int) -> Array:
    """Read a mask: anything but black, or 0 in all channels, is marked."""
    if axes == 2:
        return _files.read_hole(path)
    mask = io.read_volume(path)
    marked: Array = mask != 0 if mask.ndim == 3 else (mask != 0).any(axis=-1)
    return marked


def _read_like(path: str, example: Array, axes: int) -> Array:
    """Read the values that are held; what is not marked may be anything, also NaN."""
    given: Array = io.read_volume(path) if axes == 3 else io.read(path)
    # Of one channel a file may keep the axis or not.
    return given[..., np.newaxis] if given.ndim < example.ndim else given


def _read_map(path: str, axes: int) -> Array:
    """Read a map of numbers: one channel, or the mean of several."""
    given: Array = io.read_volume(path) if axes == 3 else io.read(path)
    return given if given.ndim == axes else np.asarray(given.mean(axis=-1))


def parse_bytes(text: str) -> int:
    """Read ``900M`` or ``16G`` as a number of bytes, in powers of 1024."""
    found = re.fullmatch(r"([0-9]{1,18})([kmgt]?)(i?b)?", text.strip().lower())
    if not found or int(found[1]) == 0:
        raise InvalidInput(f"--memory-limit: needs a number of bytes, as in 900M or 16G; got {text!r}")
    return int(found[1]) << 10 * " kmgt".index(found[2] or " ")

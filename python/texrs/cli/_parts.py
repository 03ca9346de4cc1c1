"""Write results larger than memory, in chunks: ``texrs solid``, ``synthesize`` and ``tiles``."""

from __future__ import annotations

import inspect
import math
import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from texrs._checks import as_int
from texrs._chunks.flat import HEADER, RAW, check_suffix, fill
from texrs._chunks.grid import Grid
from texrs._chunks.parts import InParts as Parts
from texrs._chunks.store import Stored
from texrs._notices import Notices
from texrs._typing import Progress
from texrs.cli import _outputs, _provenance
from texrs.cli._console import note, show_progress
from texrs.cli._options import make_parameter
from texrs.cli._outputs import name_arguments, read_kept_spacing
from texrs.cli._provenance import as_flag
from texrs.cli._stacks import Stack
from texrs.cli._texts import About, parse_numbers, parse_size
from texrs.cli._verb import Verb
from texrs.errors import InvalidInput
from texrs.papers.solid.window import PlaneTexture, SolidTexture

__all__ = ["BEYOND", "OPTIONS", "Asked", "InParts", "is_stored", "make_options", "read_scheduler", "write_part"]

OPTIONS: dict[str, tuple[Any, str, str]] = {
    "origin": (
        str,
        "X,Y[,Z]",
        "First pixel or voxel of a window of the unbounded texture: integers from -10^9 to 10^9.",
    ),
    "chunks": (
        str,
        "WIDTHxHEIGHT[xDEPTH]",
        "Size of a chunk in pixels or voxels, for results that are larger than memory.",
    ),
    "workers": (int, "N", "Number of processes that compute the chunks."),
    "scheduler": (str, "ADDRESS", "Address of a Dask cluster that computes the chunks."),
}
"""Options for writing a part of an unbounded texture: type, form and description of each."""
TAKEN = ("exemplar", "field", "seed", "quality", "interpolation", "spacing", "memory_limit")
"""Parameters that unbounded textures have in common with the commands."""
BEYOND = "write to OUT.zarr, or pass --chunks, to compute the result in parts"
"""Remedy in errors about results that do not fit in memory."""
PAUSE = 5.0
"""Minimum time between two updates of the remaining time, in seconds."""


def make_options() -> list[inspect.Parameter]:
    """Return the parameters of the options for parts."""
    made = []
    for name, (kind, metavar, text) in OPTIONS.items():
        info = typer.Option(metavar=metavar, help=text, show_default=False, rich_help_panel="Larger than memory")
        made.append(make_parameter(name, Annotated[kind | None, info], None))
    return made


@dataclass(frozen=True, slots=True)
class InParts(Verb):
    """A command whose result can be larger than memory. Such a result is a part of an unbounded texture."""

    def make_parameters(self) -> list[inspect.Parameter]:
        """Return the parameters of the command, followed by the parameters for parts."""
        return [*Verb.make_parameters(self), *make_options()]

    def make(
        self, *, count: int | None, quiet: bool, notices: Notices, variants: int | None = None, **given: Any
    ) -> None:
        """Run the command. The result is computed at once, or in chunks if the options request it."""
        said = {name: given.pop(name, None) for name in OPTIONS}
        out = str(given["out"])
        if not (is_stored(out) or out.lower().endswith(RAW)) and all(value is None for value in said.values()):
            Verb.make(self, count=count, quiet=quiet, notices=notices, variants=variants, **given)
            return
        self.run_parts(given, said, count=count, quiet=quiet)

    def run_parts(self, given: dict[str, Any], said: Mapping[str, Any], *, count: int | None, quiet: bool) -> None:
        """Compute a part of an unbounded texture chunk by chunk, and write it."""
        axes, options = self.options.axes, self.options
        paths = {name: given.pop(name, None) for name in _outputs.OUTPUTS}
        for name, path in paths.items():
            if path is not None and name != "out":
                raise InvalidInput(
                    f"{as_flag(name)}: cannot be combined with {_list(said)}, because the result is written in parts"
                )
        # Refuse the options of materials, which are not written in parts.
        stack = Stack.take(given)
        for flag, value in stack.list_writing().items():
            if value is not None:
                raise InvalidInput(f"{flag}: only available for results that are not written in parts")
        text = given["size"]
        size = None if text is None else parse_size(text, axes=axes, limit=1 << 50)
        asked = Asked.read(said, axes)
        values = options.read(given | {"size": None, "field": None}, About(axes=axes, roles=stack.roles))
        values = {**self.knows(given), **values}
        about = About(axes=axes, roles=stack.roles, spacing=values.get(("spacing",)))
        call = options.call(values | options.read(given, about, which=lambda option: option.name == "field"))
        # Refuse other options that unbounded textures do not have.
        usual = {p.name: p.default for p in inspect.signature(options.function).parameters.values()}
        for name, value in call.items():
            if name not in (*TAKEN, "size", "progress") and value is not usual[name] and value != usual[name]:
                raise InvalidInput(f"{as_flag(name)}: only available for results that are not written in parts")
        kind = SolidTexture if axes == 3 else PlaneTexture
        with name_arguments(**options.name_values(given), shape="--size", origin="--origin", chunks="--chunks"):
            texture = kind(**{name: call[name] for name in TAKEN if name in call})
        sides = size or tuple(self.times * n for n in texture.exemplar.shape)
        memory = texture.estimate_memory(Grid.of(sides, asked.chunks, axes).chunks)
        note(f"each worker needs up to {memory / 2**30:.1f} GiB", quiet=quiet)
        first = given[next(o.name for o in options if o.argument)]
        spacing = call.get("spacing") or read_kept_spacing(first, str(paths["out"]), axes)
        write_part(texture, str(paths["out"]), sides, asked, spacing, count=count, quiet=quiet)


@dataclass(frozen=True, slots=True)
class Asked:
    """Requested part of an unbounded texture, and the workers that compute it."""

    origin: tuple[int, ...]
    chunks: tuple[int, ...] | None
    scheduler: int | str | None

    @classmethod
    def read(cls, said: Mapping[str, Any], axes: int) -> Asked:
        """Check the options for parts, and convert them."""
        chunks = None if said["chunks"] is None else parse_size(said["chunks"], "--chunks", axes=axes)
        return cls(_parse_origin(said["origin"], axes), chunks, read_scheduler(said["workers"], said["scheduler"]))


def read_scheduler(workers: int | None, scheduler: str | None) -> int | str | None:
    """Return a number of processes, the address of a cluster, or None to compute in this process."""
    if workers is not None and scheduler is not None:
        raise InvalidInput("--workers: cannot be combined with --scheduler")
    return scheduler if workers is None else as_int(workers, "--workers", 1, 1024)


def is_stored(out: str) -> bool:
    """Return True if a name has the suffix of a Zarr store."""
    return out.lower().rstrip("/").endswith(".zarr")


def write_part(
    whole: Parts,
    out: str,
    sides: tuple[int, ...],
    asked: Asked,
    spacing: Sequence[float] | None = None,
    *,
    count: int | None,
    quiet: bool,
) -> None:
    """Write a part of an unbounded texture to a store or a file. Chunks of an interrupted run are kept."""
    start, running = time.monotonic(), _provenance.RUNNING.get()
    grid = Grid.of(sides, asked.chunks, whole.axes)
    with (
        name_arguments(scheduler="--scheduler", shape="--size", origin="--origin", chunks="--chunks"),
        show_progress(quiet=quiet) as progress,
    ):
        watch = _Forecast(progress, math.prod(sides))
        if is_stored(out):
            done = whole.to_zarr(
                out,
                sides,
                grid.chunks,
                origin=asked.origin,
                spacing=spacing,
                scheduler=asked.scheduler,
                threads=count,
                overwrite=bool(running and running.force),
                progress=watch,
            )
        else:
            done = write_file(whole, out, grid, asked, spacing, count, watch)
    there = f"{done.chunks} chunks, of which {done.chunks - done.made} existed already"
    note(f"wrote {out}: {_outputs.show_sides(sides)}, {there}, in {time.monotonic() - start:.1f} s", quiet=quiet)


def write_file(
    whole: Parts,
    out: str,
    grid: Grid,
    asked: Asked,
    spacing: Sequence[float] | None,
    count: int | None,
    watch: Progress,
) -> Stored:
    """Write a file by filling a partial file first. The finished file contains the record of the command."""
    part = whole._read_part(asked.origin, grid.shape)
    check_suffix(out, whole.axes, part.reader.maps[part.base], grid.chunks)
    header = str(Path(out).with_suffix(HEADER)) if Path(out).suffix.lower() == RAW else None
    # Check before the work that the files can be written and replaced.
    for name in filter(None, (out, header)):
        _outputs.check_output(name)
    filled = fill(part.reader, part.base, grid, out, scheduler=asked.scheduler, threads=count, progress=watch)
    if header is not None:
        with _outputs.write_output(header) as temporary:
            temporary.write_text(filled.describe(os.path.basename(out), spacing), encoding="ascii")
    with _outputs.write_output(out) as temporary:
        filled.finish(temporary, spacing)
    return filled.stored


class _Forecast:
    """Adds the speed and the remaining time to the progress."""

    def __init__(self, watch: Progress, total: int) -> None:
        self.watch, self.total, self.said, self.at = watch, total, "", -math.inf
        self.first: tuple[float, float] | None = None

    def __call__(self, stage: str, share: float) -> None:
        now = time.monotonic()
        self.first = self.first or (now, share)
        gone, done = now - self.first[0], share - self.first[1]
        if done > 0 and gone > 0 and now - self.at >= PAUSE:
            left = round((1 - share) * gone / done)
            self.said = f", {self.total * done / gone / 1e6:.2f} million a second, {left // 60}:{left % 60:02d} left"
            self.at = now
        self.watch(stage + self.said, share)


def _list(said: Mapping[str, Any]) -> str:
    return ", ".join(f"--{name}" for name, value in said.items() if value is not None) or "a .zarr file"


def _parse_origin(text: str | None, axes: int) -> tuple[int, ...]:
    """Convert ``X,Y`` to (row, column), or ``X,Y,Z`` to (plane, row, column). Default: zeros."""
    if text is None:
        return (0,) * axes
    wanted = ("X,Y, as in -40,1000", "X,Y,Z, as in 0,-40,1000")[axes - 2]
    numbers = parse_numbers(text, "--origin", wanted, counts=(axes,), between=",")
    if any(n != int(n) for n in numbers):
        raise InvalidInput(f"--origin: must be {wanted}; got {text!r}")
    return tuple(int(n) for n in reversed(numbers))

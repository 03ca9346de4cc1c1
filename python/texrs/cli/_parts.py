"""Results that are larger than memory: ``texrs solid`` and ``texrs synthesize`` in chunks, by any workers."""

from __future__ import annotations

import inspect
import math
import os
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import typer

from texrs import io
from texrs._checks import as_int
from texrs._chunks.grid import Grid
from texrs._threads import threads
from texrs._typing import Array, Progress
from texrs.cli import _outputs, _provenance
from texrs.cli._console import note, show_progress
from texrs.cli._options import make_parameter
from texrs.cli._outputs import name_arguments
from texrs.cli._stacks import Stack
from texrs.cli._texts import About, parse_numbers, parse_size
from texrs.cli._verb import Verb
from texrs.errors import InvalidInput, LimitExceeded
from texrs.papers.solid.window import PlaneTexture, SolidTexture

__all__ = ["InParts"]

OPTIONS: dict[str, tuple[Any, str, str]] = {
    "origin": (str, "X,Y[,Z]", "A window of the texture without borders that begins there; any integers within 10^9."),
    "chunks": (str, "WIDTHxHEIGHT", "In chunks of that size, for results that are larger than memory."),
    "workers": (int, "N", "So many processes make the chunks of a .zarr."),
    "scheduler": (str, "ADDRESS", "The workers of a cluster of Dask make the chunks of a .zarr."),
}
"""Options that ask for a part of a texture without borders."""
TAKEN = ("exemplar", "field", "seed", "quality", "interpolation", "memory_limit")
"""Parameters that textures without borders have too."""
PAUSE = 5.0
"""Seconds between two forecasts."""


@dataclass(frozen=True, slots=True)
class InParts(Verb):
    """A verb whose result may be as large as a disk: then it is a part of the texture without borders."""

    def make_parameters(self) -> list[inspect.Parameter]:
        """Return the verb's own, and those of parts."""
        parameters = Verb.make_parameters(self)
        for name, (kind, metavar, text) in OPTIONS.items():
            info = typer.Option(metavar=metavar, help=text, show_default=False, rich_help_panel="Larger than memory")
            parameters.append(make_parameter(name, Annotated[kind | None, info], None))
        return parameters

    def run(self, *, count: int | None, quiet: bool, variants: int | None = None, **given: Any) -> None:
        """Do the command: at once, or in parts where that is asked for."""
        said = {name: given.pop(name, None) for name in OPTIONS}
        stored = str(given["out"]).lower().rstrip("/").endswith(".zarr")
        if not stored and all(value is None for value in said.values()):
            try:
                Verb.run(self, count=count, quiet=quiet, variants=variants, **given)
            except LimitExceeded as error:
                raise LimitExceeded(f"{error}; to OUT.zarr, or with --chunks, it is made in parts") from None
            return
        for name in ("workers", "scheduler"):
            if said[name] is not None and not stored:
                raise InvalidInput(f"--{name}: is for results in a .zarr, got --out {given['out']}")
        if said["workers"] is not None and said["scheduler"] is not None:
            raise InvalidInput("--workers, --scheduler: one of them can be asked for")
        self.run_parts(given, said, stored, count=count, quiet=quiet)

    def run_parts(
        self, given: dict[str, Any], said: Mapping[str, Any], stored: bool, *, count: int | None, quiet: bool
    ) -> None:
        """Make a part of the texture without borders, chunk by chunk."""
        start, axes, options = time.monotonic(), self.options.axes, self.options
        paths = {name: given.pop(name, None) for name in _outputs.OUTPUTS}
        for name, path in paths.items():
            if path is not None and name != "out":
                raise InvalidInput(f"--{name}: is for results that are made at once, without {_list(said)}")
        roles = Stack.take(given).roles
        out, text = str(paths["out"]), given["size"]
        size = None if text is None else parse_size(text, axes=axes, limit=1 << 50)
        chunks = None if said["chunks"] is None else parse_size(said["chunks"], "--chunks", axes=axes)
        origin = _parse_origin(said["origin"], axes)
        call = options.call(options.read(given | {"size": None}, About(axes=axes, roles=roles)))
        usual = {p.name: p.default for p in inspect.signature(options.function).parameters.values()}
        for name, value in call.items():
            if name not in (*TAKEN, "size", "progress") and value is not usual[name] and value != usual[name]:
                raise InvalidInput(f"--{name.replace('_', '-')}: is for results that are made at once")
        kind = SolidTexture if axes == 3 else PlaneTexture
        with name_arguments(**options.name_values(given), shape="--size", origin="--origin", chunks="--chunks"):
            texture = kind(**{name: call[name] for name in TAKEN if name in call})
        sides = size or tuple(self.times * n for n in texture.exemplar.shape)
        grid = Grid.of(sides, chunks, axes)
        memory = texture.estimate_memory(grid.chunks if stored else (grid.chunks[0], *sides[1:]))
        note(f"each worker takes up to {memory / 2**30:.1f} GiB", quiet=quiet)
        with show_progress(quiet=quiet) as progress, name_arguments(scheduler="--scheduler", shape="--size"):
            watch = _Forecast(progress, math.prod(sides))
            if stored:
                running = _provenance.RUNNING.get()
                workers = said["workers"]
                done = texture.to_zarr(
                    out,
                    sides,
                    grid.chunks,
                    origin=origin,
                    scheduler=said["scheduler"] if workers is None else as_int(workers, "--workers", 1, 1024),
                    threads=count,
                    overwrite=bool(running and running.force),
                    progress=watch,
                )
                what = f"{done.chunks} chunks, of which {done.chunks - done.made} were there"
            else:
                what = "x".join(map(str, reversed(sides)))
                with threads(count):
                    self.write_slabs(texture, out, grid, origin, watch)
        note(f"wrote {out}: {what}, in {time.monotonic() - start:.1f} s", quiet=quiet)

    def write_slabs(
        self, texture: PlaneTexture | SolidTexture, out: str, grid: Grid, origin: tuple[int, ...], watch: Progress
    ) -> None:
        """Write a file of one array; of a volume no more than a slab is in memory."""
        sides = grid.shape

        def make() -> Iterator[Array]:
            for first in range(0, sides[0], grid.chunks[0]):
                last = min(first + grid.chunks[0], sides[0])
                ends = [(first, last), *((0, n) for n in sides[1:])]
                yield texture[tuple(slice(o + a, o + b) for o, (a, b) in zip(origin, ends, strict=True))]
                watch("slabs", last / sides[0])

        with _outputs.write_output(out) as temporary:
            if len(sides) == 2:
                io.write(temporary, np.concatenate(list(make())))
            elif os.path.splitext(out)[1].lower() in (".npy", ".tif", ".tiff"):
                io.write_slabs(temporary, make(), (*sides, *texture.exemplar.image.shape[3:]))
            else:
                io.write_volume(temporary, np.concatenate(list(make())))


class _Forecast:
    """Says how fast it goes, and how long it will take."""

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
    return ", ".join(f"--{name}" for name, value in said.items() if value is not None) or "a .zarr"


def _parse_origin(text: str | None, axes: int) -> tuple[int, ...]:
    """Return (row, column) of ``X,Y``: the column comes first in the text, as the width does in sizes."""
    if text is None:
        return (0,) * axes
    wanted = ("X,Y, as in -40,1000", "X,Y,Z, as in 0,-40,1000")[axes - 2]
    numbers = parse_numbers(text, "--origin", wanted, counts=(axes,), between=",")
    if any(n != int(n) for n in numbers):
        raise InvalidInput(f"--origin: needs {wanted}; got {text!r}")
    return tuple(int(n) for n in reversed(numbers))

"""Define the options of every command that limit its work, such as time and memory."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Annotated, Any

import typer

from texrs import limits
from texrs._notices import collect
from texrs.cli._console import note
from texrs.cli._options import make_parameter
from texrs.cli._outputs import name_arguments
from texrs.cli._texts import parse_bytes

__all__ = ["limit", "list_parameters"]

OPTIONS: dict[str, tuple[Any, str, str, str]] = {
    "memory_limit": (str, "BYTES", "Maximum memory in bytes, such as 900M or 16G.", "available memory"),
    "pixel_limit": (int, "N", "Maximum number of pixels or voxels that are computed or read at once.", "268435456"),
    "time_limit": (float, "SECONDS", "Maximum duration of the command in seconds.", "no limit"),
}


STRICT = Annotated[bool, typer.Option("--strict", help="Fail if a part of an input would be ignored.")]


def list_parameters(there: list[inspect.Parameter]) -> list[inspect.Parameter]:
    """Return the options of limits that a command does not define itself."""
    own = {p.name for p in there}
    made = []
    for name, (kind, metavar, text, usual) in OPTIONS.items():
        if name not in own:
            info = typer.Option(metavar=metavar, help=text, show_default=usual)
            made.append(make_parameter(name, Annotated[kind | None, info], None))
    return [*made, make_parameter("strict", STRICT, False)]


@contextmanager
def limit(
    *,
    memory_limit: str | None = None,
    pixel_limit: int | None = None,
    time_limit: float | None = None,
    strict: bool = False,
    quiet: bool = False,
) -> Iterator[None]:
    """Run a block within the given limits. Show which parts of inputs were ignored, and what was assumed."""
    memory = None if memory_limit is None else parse_bytes(memory_limit)
    with ExitStack() as stack:
        with name_arguments(pixels="--pixel-limit", seconds="--time-limit", memory="--memory-limit"):
            stack.enter_context(
                limits.context(pixels=pixel_limit, voxels=pixel_limit, memory=memory, seconds=time_limit)
            )
        stack.enter_context(collect(show=lambda line: note(line, quiet=quiet), strict=strict))
        yield

"""The signatures of all public functions, classes and methods, and the help texts of all commands."""

from __future__ import annotations

import enum
import inspect
from collections.abc import Iterator

import click
import typer

import hostile
from texrs.cli import COMMANDS, app


def list_signatures() -> Iterator[str]:
    """Yield a line for each public function, class and constant, and for each public part of a class."""
    for module in hostile.public_modules():
        for name in sorted(module.__all__):
            thing, full = getattr(module, name), f"{module.__name__}.{name}"
            yield f"{full}{describe(thing)}"
            owners = [each for each in getattr(thing, "__mro__", ()) if each.__module__.startswith("texrs")]
            # The signature of a class with fields contains them.
            fields = getattr(thing, "__dataclass_fields__", {}).keys()
            for part in sorted({part for owner in owners for part in vars(owner)} - fields):
                if part in hostile.OPERATORS or not part.startswith("_"):
                    yield f"{full}.{part}{describe(inspect.getattr_static(thing, part))}"


def describe(thing: object) -> str:
    """Return the signature of a function or class, or the type of a property or of another value."""
    thing = getattr(thing, "func", getattr(thing, "__func__", thing))
    if isinstance(thing, property):
        return f": property {inspect.signature(thing.fget).return_annotation}" if thing.fget else ": property"
    if inspect.isclass(thing) and issubclass(thing, BaseException | enum.Enum):
        return f": {', '.join(each.__name__ for each in thing.__mro__[1:])}"
    if inspect.isclass(thing) or inspect.isfunction(thing):
        return str(inspect.signature(thing))
    return f": {type(thing).__name__}"


def list_helps() -> Iterator[str]:
    """Yield the lines of the help texts of `texrs` and of its commands, without trailing blanks."""
    group = typer.main.get_command(app)
    assert isinstance(group, click.Group | typer.core.TyperGroup)
    for name in ("", *COMMANDS):
        command = group.get_command(None, name) if name else group  # type: ignore[arg-type]
        context = command.make_context(f"texrs {name}".strip(), [], resilient_parsing=True, terminal_width=100)
        yield from (f"===== texrs {name}".strip(), *map(str.rstrip, command.get_help(context).splitlines()), "")

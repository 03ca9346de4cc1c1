"""The command ``texrs``.

Results are written to files, and text results to stdout. Progress and errors are written to stderr. Exit codes: 0
done, 1 internal error, 2 invalid input or usage, 3 some jobs of a batch failed, 130 stopped by Ctrl-C. Inputs are
checked before the work begins, as far as possible. Files are written completely or not at all, so that a failure keeps
the existing files.

Each command is created when it is first used, so that the libraries of other commands are not loaded.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from texrs.cli._console import NAMES, run, say, suggest

__all__ = ["main"]

GROUPS: dict[str, dict[str, str]] = {
    "The four systems": {
        "design": "Design a texture of any size from one example.",
        "splice": "Arrange the elements of one texture in the layout of another.",
        "self-splice": "Edit the layout of a texture's own elements.",
        "perspective": "Synthesise an image whose elements have the sizes in a scale map.",
        "solid": "Synthesise a volume from an example volume. A field can rotate and scale it.",
        "synthesize": "Synthesise an image from an example image. A field can rotate and scale it.",
    },
    "Images": {
        "tiles": "Cut corner tiles from designs, for an endless texture or a window of it.",
        "tile": "Make an image tileable, so that adjacent copies have no visible border.",
        "check": "Test whether an image tiles along each axis, and how visible its borders are.",
        "inpaint": "Fill holes in an image or a volume with patches of the rest or of another image.",
        "extend": "Enlarge a photograph of a plane on any side, in the same perspective.",
        "rectify": "Make the flat texture of a plane in an oblique photograph.",
        "remove": "Remove an object from a photograph, and fill in the plane behind it in perspective.",
    },
    "Analysis of an image": {
        "analyse": "Find the elements of a texture, and the parts that belong to them.",
        "database": "Store analysed textures in a folder, and splice two of them or all pairs.",
        "scale-map": "Make a scale map: the apparent size of the elements at each pixel of an image.",
    },
    "Results": {
        "apply": "Compute the heights, normals or labels of a result through its source map.",
        "paint": "Paint a mesh with a solid texture from an example volume.",
        "slice": "Draw a volume: slices along its axes, an oblique slice, a block or a turntable.",
        "info": "Show the contents of a file, and the command that wrote it.",
        "rerun": "Repeat the command that wrote a file, and compare the results.",
        "batch": "Run a command for many images, seeds and presets. Existing results are kept.",
    },
    "Examples": {
        "samples": "List the built-in examples, or write them to a folder.",
        "demo": "Write a page of results on built-in examples.",
        "compare": "Compare methods of texrs and of other installed programs on one page.",
    },
}
"""All commands and their purposes by group, as the help shows them."""
if not Path(__file__).parents[1].joinpath("demo").is_dir():
    # Wheels do not contain the demo.
    del GROUPS["Examples"]["demo"]
COMMANDS = {name: text for group in GROUPS.values() for name, text in group.items()}
NAMES.update(COMMANDS)


def load(name: str) -> Callable[..., None]:
    """Import the module of a command and return its function."""
    # Import only the module of this command, so that other commands start quickly.
    match name:
        case "analyse" | "database":
            from texrs.cli import _elements

            return _elements.COMMANDS[name]
        case "scale-map":
            from texrs.cli import _scales

            return _scales.COMMAND
        case "paint":
            from texrs.cli import _paint

            return _paint.COMMAND
        case "tiles":
            from texrs.cli import _tiles

            return _tiles.COMMAND
        case "slice":
            from texrs.cli import _slices

            return _slices.COMMAND
        case "batch":
            from texrs.cli import _batch

            return _batch.COMMAND
        case "apply":
            from texrs.cli import _maps

            return _maps.COMMAND
        case "info" | "rerun":
            from texrs.cli import _rerun

            return _rerun.COMMANDS[name]
        case "check":
            from texrs.cli import _check

            return _check.COMMAND
        case "compare":
            from texrs.cli import _compare

            return _compare.COMMAND
        case "demo" | "samples":
            from texrs.cli import _examples

            return _examples.COMMANDS[name]
    from texrs.cli import _verbs

    return _verbs.make_verb(name).make_command()


def make_command(name: str) -> Any:
    """Create a command with its own options and the options of limits.

    A command that writes files also gets ``--force``.
    """
    from texrs.cli._limits import limit, list_parameters
    from texrs.cli._options import as_command, make_parameter
    from texrs.cli._outputs import OUTPUTS, Command, Force

    work = load(name)
    parameters = list(inspect.signature(work, eval_str=True).parameters.values())
    limits = list_parameters(parameters)
    forced = [make_parameter("force", Force, False)] if any(p.name in OUTPUTS for p in parameters) else []
    ours = {p.name for p in (*limits, *forced)}

    def limited(**given: Any) -> None:
        # Do not pass --force, because `Command` records it before the work for the checks of existing files.
        with limit(**{p.name: given[p.name] for p in limits}, quiet=given.get("quiet", False)):
            work(**{name: value for name, value in given.items() if name not in ours})

    function = as_command(limited, [*parameters, *limits, *forced])
    alone = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    alone.command(name, cls=Command, help=COMMANDS[name])(function)
    return typer.main.get_command(alone)


class Group(TyperGroup):
    """The group of all commands. Each command is created on demand."""

    make_command = staticmethod(make_command)
    """Function that creates a command. It can be sent to other processes."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of all commands."""
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Create the command with a given name, or return None if there is none."""
        return make_command(cmd_name) if cmd_name in COMMANDS else None

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the requested command. For a mistyped name, raise an error that suggests the most similar command."""
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            ctx.fail(f"No such command {args[0]!r}{suggest(args[0], COMMANDS)}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """List the commands without creating them."""
        for title, group in GROUPS.items():
            with formatter.section(title):
                formatter.write_dl(list(group.items()))


app = typer.Typer(
    cls=Group,
    help="Make new textures from one example.",
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Parameters
    ----------
    arguments : sequence of str, optional
        Arguments after ``texrs``. Default: those from the shell.

    Examples
    --------
    >>> from texrs.cli import main
    >>> main(["samples", "nowhere"])
    2

    """
    command = typer.main.get_command(app)
    given = list(arguments) if arguments is not None else None
    return run(lambda: command.main(given, prog_name="texrs", standalone_mode=False))


def _show_version(asked: bool) -> None:
    if asked:
        from texrs._version import __version__

        say(f"texrs {__version__}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def texrs(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Make new textures from one example."""
    if context.invoked_subcommand is None:
        say(context.get_help())

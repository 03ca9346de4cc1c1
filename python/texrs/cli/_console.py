"""Run commands in a shell: exit codes, one-line errors, signals and progress."""

from __future__ import annotations

import math
import os
import re
import signal
import sys
import threading
import time
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from types import FrameType
from typing import TYPE_CHECKING, cast

import typer

from texrs._progress import show_lines
from texrs.errors import TexrsError

if TYPE_CHECKING:
    # Import typing names only for type checkers, because they would load NumPy.
    from texrs._typing import Progress

DONE, INTERNAL, BAD_INPUT, PARTLY = 0, 1, 2, 3
"""Exit codes: done, internal error, invalid input, some jobs failed.

A signal ends a command with 128 plus its number, such as 130 for Ctrl-C.
"""
TRACEBACK = "TEXRS_TRACEBACK"
"""Environment variable that turns on the traceback of internal errors."""
PIPE = int(getattr(signal, "SIGPIPE", 13))
"""Number of SIGPIPE. Windows does not have this signal, but pipes can break there too."""
GRACE = 1.0
"""Time after a signal during which further signals are ignored, in seconds."""

# Base class of the exceptions that typer raises on wrong usage. Depending on the version of typer, this is click's
# class or typer's own copy.
UsageFailure = cast(type[Exception], next(c for c in typer.BadParameter.__mro__ if c.__name__ == "ClickException"))


SIDES = re.compile(r"\((\d+(?:, \d+){1,3})\)")
ANY_SHAPE = re.compile(r"\([A-Za-z.]\w*,|\(\d+, [A-Za-z]")
SPEAKS_OF_SIZES = re.compile(r"\b(?:pixels|voxels|sides?|sizes?|shapes?)\b")
MOST_CHANNELS = 4
"""Maximum last number of a shape that error texts treat as a number of channels."""
NAMES: set[str] = set()
"""Names of all commands."""
PYTHON = {
    r"read (?:it|them) with texrs\.io\.read_volume": "use texrs slice or texrs solid",
    r"a mask, 'alpha', or an image that is a masked array": "a mask, or 'alpha'",
}
"""Patterns for Python expressions in errors and help texts, and the replacement of each on the command line."""
_HUSHED: ContextVar[bool] = ContextVar("hushed", default=False)
KEPT: list[str] = []
"""Names of finished files of a batch, which are listed if a later part of the batch fails."""


class Stopped(BaseException):
    """A signal ended the work. KeyboardInterrupt is not used, because typer handles it in its own way."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def run(work: Callable[[], object]) -> int:
    """Run a command and return its exit code. An error is printed as one line on stderr."""
    KEPT.clear()
    code = _run(work)
    if code not in (DONE, PARTLY) and KEPT:
        names = ", ".join(KEPT[:8]) + (f" and {len(KEPT) - 8} more" if len(KEPT) > 8 else "")
        complain(f"files that were finished before are kept: {names}")
    return code


def keep(path: str) -> None:
    """Record that a file of a batch is finished."""
    KEPT.append(path)


def _run(work: Callable[[], object]) -> int:
    try:
        with raise_on_signals(), silence_warnings():
            code = work()
            if sys.stdout is not None:
                sys.stdout.flush()
    except Stopped as stopped:
        return _end_stopped(stopped.number)
    except BrokenPipeError:
        return _end_stopped(PIPE)
    except (KeyboardInterrupt, typer.Abort):
        return _end_stopped(signal.SIGINT)
    except SystemExit as leaving:
        code = leaving.code
    except UsageFailure as failure:
        complain(_describe_usage(failure))
        code = BAD_INPUT
    except TexrsError as error:
        complain(say_error(error))
        code = BAD_INPUT
    except MemoryError:
        complain("the command needs more memory than is available; use a smaller size or exemplar")
        code = BAD_INPUT
    except OSError as error:
        name = f"{error.filename}: " if isinstance(error.filename, str) else ""
        complain(f"{name}{(error.strerror or str(error)).lower()}")
        code = BAD_INPUT
    except BaseException as error:  # Panics of the Rust code are not subclasses of Exception.
        if os.environ.get(TRACEBACK, "0") not in ("", "0"):
            traceback.print_exception(error)
        else:
            what = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
            complain(f"internal error: {what} (run with {TRACEBACK}=1 for the traceback)")
        code = INTERNAL
    return code if isinstance(code, int) else DONE


def say(line: str) -> None:
    """Print a line of a result on stdout."""
    try:
        print(line, flush=True)
    except BrokenPipeError:
        # Handle a broken pipe here, because typer would report it as an error of the command.
        raise Stopped(PIPE) from None


@contextmanager
def hush() -> Iterator[None]:
    """Suppress result lines during a block, for commands that another command runs."""
    token = _HUSHED.set(True)
    try:
        yield
    finally:
        _HUSHED.reset(token)


def note(line: str, *, quiet: bool) -> None:
    """Print a result line, unless ``--quiet`` is given."""
    if not quiet and not _HUSHED.get():
        complain(line)


def say_sizes(message: str) -> str:
    """Return an error text with sizes as on the command line: the width first.

    Functions take rows first, and so do sizes in their errors. Shapes in errors about arrays are not changed.

    Examples
    --------
    >>> say_sizes("size: each side must be at least 16, got (40, 8)")
    'size: each side must be at least 16, got 8 x 40'
    >>> say_sizes("mask.png: must have shape (64, 96), got (40, 30, 3)")
    'mask.png: must have shape 96 x 64, got 30 x 40 with 3 channels'
    >>> say_sizes("points: must be numbers of shape (n, 2), got shape (40, 30)")
    'points: must be numbers of shape (n, 2), got shape (40, 30)'

    """
    if not SPEAKS_OF_SIZES.search(message) or ANY_SHAPE.search(message):
        return message

    def turn(found: re.Match[str]) -> str:
        sides = [n.strip() for n in found[1].split(",")]
        # If the last number of a shape is small, it is the number of channels, because no volume has so few columns.
        channels = sides.pop() if len(sides) > 2 and int(sides[-1]) <= MOST_CHANNELS else ""
        many = f" with {channels} channel{'s' if channels != '1' else ''}" if channels else ""
        return " x ".join(reversed(sides)) + many

    return SIDES.sub(turn, message)


def name_commands(message: str) -> str:
    """Replace the names of Python functions in a text by the names of commands.

    Examples
    --------
    >>> name_commands("texrs.elements.analyse takes a box")
    'texrs analyse takes a box'

    """
    for python, words in PYTHON.items():
        message = re.sub(python, words, message)

    def turn(found: re.Match[str]) -> str:
        name = found[1].replace("_", "-")
        return f"texrs {name}" if name in NAMES else found[0]

    return re.sub(r"\btexrs\.(?:[a-z_]+\.)*([a-z_]+)\b", turn, message)


EXTRA_PLACES = re.compile(r"extra argument.*\(-?[\d.]+,-?[\d.]+\b")
"""Pattern of the message about too many arguments if the shell has split coordinates."""


def say_error(error: Exception) -> str:
    """Return the text of an error with command-line names and the width first."""
    return name_commands(say_sizes(str(error)))


def suggest(word: str, known: Iterable[str]) -> str:
    """Return a question that suggests the most similar known word, or an empty text if no word is similar.

    Examples
    --------
    >>> suggest("desing", ["design", "tile"])
    '; did you mean design?'

    """
    from difflib import get_close_matches

    near = get_close_matches(word, list(known), 1)
    return f"; did you mean {near[0]}?" if near else ""


def complain(message: str) -> None:
    """Print one line to stderr. Special characters, for example in file names, are allowed."""
    text = " ".join(message.split())
    line = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)
    with suppress(OSError, ValueError):
        print(f"texrs: {line}", file=sys.stderr, flush=True)


@contextmanager
def raise_on_signals() -> Iterator[None]:
    """Raise `Stopped` on Ctrl-C and on requests to terminate, so that partial files are removed."""
    last = -math.inf

    def stop(number: int, frame: FrameType | None) -> None:
        nonlocal last
        now = time.monotonic()
        # Ignore repeated signals, because they must not interrupt the removal of partial files.
        if now - last > GRACE:
            last = now
            raise Stopped(number)

    before = {}
    if threading.current_thread() is threading.main_thread():
        for name in ("SIGINT", "SIGTERM", "SIGHUP"):
            number = getattr(signal, name, None)
            # If signals are already ignored, keep ignoring them: nohup and background jobs of scripts depend on this.
            if number is not None and signal.getsignal(number) not in (signal.SIG_IGN, None):
                before[number] = signal.signal(number, stop)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def silence_warnings() -> Iterator[None]:
    """Hide Python warnings on the terminal, unless Python was started with an option to show them."""
    with warnings.catch_warnings():
        if not sys.warnoptions:
            warnings.simplefilter("ignore")
        yield


@contextmanager
def show_progress(*, quiet: bool) -> Iterator[Progress]:
    """Return a callback that shows progress on stderr: as a bar on a terminal, otherwise as lines."""
    if quiet or sys.stderr is None:
        yield lambda stage, share: None
    elif sys.stderr.isatty() and os.environ.get("TERM") != "dumb":
        with _show_bar() as progress:
            yield progress
    else:
        yield show_lines(complain)


@contextmanager
def _show_bar() -> Iterator[Progress]:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=1.0)
        yield lambda stage, share: bar.update(task, description=stage, completed=share)


def _end_stopped(number: int) -> int:
    """Return the exit code of a command that a signal ended, and report it. A broken pipe is not reported."""
    if number == PIPE:
        # Drop the buffered output, because Python would report at exit that writing failed.
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    else:
        complain("stopped; no incomplete files are left")
    return 128 + number


def _describe_usage(failure: Exception) -> str:
    """Return the text of an error in the arguments, with a reference to the help."""
    message = failure.format_message() if hasattr(failure, "format_message") else str(failure)
    wrong = getattr(failure, "option_name", None)
    if wrong and hasattr(failure, "possibilities"):
        message = f"No such option: {wrong}{suggest(wrong, failure.possibilities or ())}"
    context = getattr(failure, "ctx", None)
    parameters = context.command.params if context is not None else ()
    # Use the names of arguments in the help: the parameter "mask_marks" is the argument MASK.
    placed = [p.name.removesuffix("_marks") for p in parameters if p.param_type_name == "argument"]
    if context is not None and wrong is not None and wrong.lstrip("-").replace("-", "_") in placed:
        usage = " ".join(name.upper() for name in placed)
        message = f"No such option: {wrong}; give its value without an option name: {context.command_path} {usage}"
    if EXTRA_PLACES.search(message):
        message += "; put places in quotes, as in '20,20 104,24 110,100 14,112'"
    command = context.command_path if context is not None else "texrs"
    # Inside a batch, the name of the command lacks the prefix texrs.
    command = command if command.startswith("texrs") else f"texrs {command}"
    return f"{message.rstrip('.')} (see {command} --help)"

"""Commands that arrange elements: ``texrs splice`` and ``texrs self-splice``."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from texrs._threads import threads
from texrs._typing import Array
from texrs.cli import _files
from texrs.cli._console import Out, Quiet, Source, Stages, Threads, as_method, note, watching
from texrs.cli._files import describe, named
from texrs.elements import Elements, load
from texrs.errors import FileError, InvalidInput
from texrs.papers.splice import self_splice, splice
from texrs.synthesis import Synthesis

__all__ = ["self_splice_command", "splice_command"]

Seed = Annotated[int, typer.Option(help="Chooses what is random; the same seed gives the same bytes.")]
Refine = Annotated[bool, typer.Option("--refine/--no-refine", help="Whether to refine what is not rigid.")]
ENTRY = "An image file, sample:NAME, or an entry that texrs analyse wrote (.npz)."


def splice_command(
    a: Annotated[str, typer.Argument(metavar="A", help=f"Whose elements are shown. {ENTRY}", show_default=False)],
    b: Annotated[str, typer.Argument(metavar="B", help=f"Whose layout they take. {ENTRY}", show_default=False)],
    out: Out,
    size: Annotated[
        str | None, typer.Option(metavar="ROWSxCOLS", help="Size of the result, in pixels.", show_default="that of A")
    ] = None,
    seed: Seed = 0,
    align: Annotated[
        bool, typer.Option("--align/--no-align", help="Whether to turn the layout as A's lines run.")
    ] = True,
    snap_rows: Annotated[bool, typer.Option("--snap-rows", help="Bring elements of about one row to one row.")] = False,
    refine: Refine = True,
    method: Annotated[
        str, typer.Option(help="default, paper (the published algorithm to the letter) or preview.")
    ] = "default",
    stages: Stages = None,
    source: Source = None,
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Arrange the elements of one texture as those of another are."""
    start = time.monotonic()
    shape = _files.parse_size(size)
    how = as_method(method, "paper", "preview")
    _files.check_outputs(out, source, stages)
    mine, theirs = read_elements(a), read_elements(b)
    example = mine.image if isinstance(mine, Elements) else mine
    _files.check_output(out, example, shape or example.shape[:2])
    with named(a=a, b=b, count="--threads"), threads(count), watching(quiet=quiet) as progress:
        result = splice(
            mine,
            theirs,
            shape,
            seed=seed,
            method=how,
            align=align,
            snap_rows=snap_rows,
            refine=refine,
            progress=progress,
        )
    finish(result, out, source, stages, start, quiet=quiet)


def self_splice_command(
    a: Annotated[str, typer.Argument(metavar="A", help=f"The texture. {ENTRY}", show_default=False)],
    out: Out,
    edit: Annotated[
        str,
        typer.Option(
            metavar="WORDS|JSON|FILE.json",
            help="What is done: regularise, randomise, or a list of steps as the report's edit has it.",
            show_default=False,
        ),
    ],
    seed: Seed = 0,
    refine: Refine = True,
    method: Annotated[str, typer.Option(help="default or preview.")] = "default",
    stages: Stages = None,
    source: Source = None,
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Edit the layout of a texture's own elements."""
    start = time.monotonic()
    how = as_method(method, "preview")
    steps = read_edit(edit)
    _files.check_outputs(out, source, stages)
    mine = read_elements(a)
    example = mine.image if isinstance(mine, Elements) else mine
    _files.check_output(out, example, example.shape[:2])
    with named(a=a, edit="--edit", count="--threads"), threads(count), watching(quiet=quiet) as progress:
        result = self_splice(mine, steps, seed=seed, method=how, refine=refine, progress=progress)
    finish(result, out, source, stages, start, quiet=quiet)


def read_elements(text: str) -> Elements | Array:
    """Read an entry, or a picture, which is analysed by whoever takes it."""
    if not text.lower().endswith(".npz"):
        return _files.read_exemplar(text)
    return load(text)


def read_edit(text: str) -> Any:
    """Read an edit: names with commas between them, JSON, or a file of JSON."""
    where = "--edit"
    if text.lower().endswith(".json"):
        where = text
        try:
            text = Path(text).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise FileError(f"{where}: {error}") from None
    elif not text.lstrip().startswith(("[", "{")):
        return [word.strip() for word in text.split(",")]
    try:
        found = json.loads(text)
    except (json.JSONDecodeError, RecursionError) as error:
        raise InvalidInput(f"{where}: is not JSON ({error})") from None
    # A report holds its edit beside other things.
    return found["edit"] if isinstance(found, dict) and "edit" in found else found


def finish(result: Synthesis, out: str, source: str | None, stages: str | None, start: float, *, quiet: bool) -> None:
    """Write what was made, and say so."""
    _files.deliver(result, out, source, stages)
    report = result.report
    matched = len(report["matches"])
    note(
        f"wrote {out}: {describe(np.asarray(result.image), 2)}, {matched} elements moved, in {time.monotonic() - start:.1f} s",
        quiet=quiet,
    )

"""The command ``texrs compare``."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from texrs._threads import threads
from texrs.cli import _outputs
from texrs.cli._console import note, show_progress
from texrs.cli._outputs import SAMPLE, Quiet, Threads, make_argument, make_option, name_arguments, to_write
from texrs.cli._readers import read_picture
from texrs.errors import InvalidInput

USUAL = ("pebbles", "leaves_and_flowers", "bricks", "weave", "bark", "dots", "brick", "gravel", "grass", "coins")
"""Default images of a comparison: built-in generated examples and photographs."""
SHOWN = ("more", "tile", "hole")


def compare_command(
    pictures: Annotated[
        list[str] | None, make_argument("FILE", "Images, or sample:NAME. Default: ten built-in examples.")
    ] = None,
    out: Annotated[str, to_write("out", "OUT.html", "HTML page to write.")] = "",
    task: Annotated[
        list[str] | None, make_option("|".join(SHOWN), "Task to compare. May be repeated. Default: all.")
    ] = None,
    crop: Annotated[int, typer.Option(help="Side in pixels of the crop from the middle of each image.")] = 128,
    larger: Annotated[
        int | None,
        make_option(None, "Side of the larger textures in pixels. Default: 1.5 times the side of the example."),
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of all methods that use random numbers.")] = 0,
    program: Annotated[
        list[str] | None,
        make_option("NAME=PATH", "Path of another program: embark or resynthesizer. May be repeated."),
    ] = None,
    timed: Annotated[
        bool,
        typer.Option(
            "--seconds/--no-seconds",
            help="If --seconds, the page contains the time of each method. If --no-seconds, each run writes the same bytes.",
        ),
    ] = True,
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Compare methods of texrs and of other installed programs on images: a page of results and figures."""
    start = time.monotonic()
    # Import here, because the comparison loads all functions of texrs.
    from texrs.comparison import compare

    if not out:
        raise InvalidInput("--out: is required")
    _outputs.check_suffix("out", out, ".html")
    _outputs.check_output(out)
    named = {}
    for text in program or ():
        name, equals, path = text.partition("=")
        if not equals:
            raise InvalidInput(f"--program: must be NAME=PATH, got {text!r}")
        named[name] = path
    texts = pictures or [SAMPLE + name for name in USUAL]
    given = {}
    for text in texts:
        name = text.removeprefix(SAMPLE) if text.startswith(SAMPLE) else Path(text).stem
        if name in given:
            raise InvalidInput(f"{text}: must have another name, because another image is also called {name}")
        given[name] = read_picture(text)
    names = {"tasks": "--task", "side": "--crop", "size": "--larger", "programs": "--program", "seed": "--seed"}
    with name_arguments(**names, count="--threads"), threads(count), show_progress(quiet=quiet) as progress:
        found = compare(
            given,
            tasks=task or SHOWN,
            side=crop,
            size=larger,
            seed=seed,
            programs=named,
            timed=timed,
            progress=progress,
        )
    with _outputs.write_output(out) as temporary:
        temporary.write_text(found.page(), encoding="utf-8")
    failed = sum(r.image is None for r in found.results)
    tail = f", {failed} failed" if failed else ""
    note(
        f"wrote {out}: {len(given)} images, {len(found.results)} results{tail}, "
        f"{len(found.missing)} methods not installed, in {time.monotonic() - start:.1f} s",
        quiet=quiet,
    )


COMMAND = compare_command

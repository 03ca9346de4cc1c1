"""The command that runs another command for many images, seeds and presets: ``texrs batch``.

Each result is written completely as soon as it is ready, with a record of its command. The same batch command
therefore continues a batch that was stopped, even by a power cut, and keeps the results that were written.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from texrs import io
from texrs._chunks import workers
from texrs._notices import collect
from texrs._show import preview
from texrs._threads import count_threads
from texrs._typing import Array
from texrs.cli import _outputs, _provenance
from texrs.cli._console import (
    PARTLY,
    Stopped,
    UsageFailure,
    complain,
    hush,
    keep,
    note,
    say_error,
    silence_warnings,
    suggest,
)
from texrs.cli._outputs import WORK, Quiet, Threads, make_argument, make_option, name_arguments, to_write
from texrs.cli._parts import read_scheduler
from texrs.cli._provenance import check_free
from texrs.cli._recipes import (
    Job,
    check_files,
    check_recipe,
    check_results,
    list_jobs,
    parse_options,
    place_arguments,
    read_recipe,
)
from texrs.errors import FileError, InvalidInput, TexrsError
from texrs.io.annotation import is_unchanged
from texrs.materials import Material

CELL = 256
"""Side of a cell of the contact sheet, in pixels."""
NOT_ONE = ("batch", "rerun", "info", "demo", "samples", "database")
"""Commands that a batch cannot run, because they do not write one result from input files."""
THERE, MADE = "is there", "wrote"
"""States of a successful job: its result existed, or was written now. Any other text is the reason for a failure."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """Outcome of a job, which can be sent between processes."""

    said: str
    ignored: tuple[str, ...] = ()
    assumed: tuple[str, ...] = ()

    def show(self) -> str:
        """Return the notices of the job as text for the end of its line, or an empty text."""
        parts = [f"{title}: {'; '.join(lines)}" for title, lines in self.list_notices() if lines]
        return f" ({'; '.join(parts)})" if parts else ""

    def list_notices(self) -> tuple[tuple[str, tuple[str, ...]], ...]:
        """Return the notices of the job, grouped under titles."""
        return ("ignored", self.ignored), ("assumed", self.assumed)


def batch_command(
    context: typer.Context,
    what: Annotated[str, make_argument("RECIPE.toml|VERB", "A recipe, or a command that makes one file.")],
    inputs: Annotated[
        list[str] | None,
        make_argument("INPUT", "Files, patterns such as 'stones/*.jpg', or folders with their subfolders."),
    ] = None,
    folder: Annotated[
        str | None,
        typer.Option(
            "--out",
            "-o",
            metavar="DIR",
            help="Folder for the results, or a pattern of their paths, such as 'made/{folder}/{name}-{seed}.png'.",
        ),
    ] = None,
    seeds: Annotated[
        str | None, make_option("A:B", "Seeds from A to B - 1, such as 0:32, or a list such as 1,5,9.")
    ] = None,
    options: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="OPTION=VALUE", help="Option of the command, such as size=512. May be repeated."),
    ] = None,
    argument: Annotated[
        list[str] | None,
        typer.Option(
            metavar="TEXT",
            help="Further argument of the command, such as mask.png or 'masks/{name}.png'. May be repeated.",
        ),
    ] = None,
    sheet: Annotated[str | None, to_write("sheet")] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            metavar="N", help="Number of processes that share the work.", show_default=False, rich_help_panel=WORK
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Address of a Dask cluster that shares the work. Its workers must use the same disk.",
            show_default=False,
            rich_help_panel=WORK,
        ),
    ] = None,
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Run a command for many images, seeds and presets. Existing results are kept."""
    start, who = time.monotonic(), read_scheduler(workers, scheduler)
    running = _provenance.RUNNING.get()
    more = ["--force"] * bool(running and running.force) + ["--strict"] * bool(context.params.get("strict"))
    over: dict[str, Any] = {"out": folder, "sheet": sheet, "seeds": seeds, "options": parse_options(options or [])}
    over["arguments"] = argument
    if what.lower().endswith(".toml"):
        if inputs:
            raise InvalidInput(f"INPUT: cannot be combined with a recipe, which lists its inputs; got {inputs[0]!r}")
        base, said = os.path.dirname(what) or ".", read_recipe(what)
        # Paths on the command line are relative to the current folder, and not to the folder of the recipe.
        over |= {key: os.path.abspath(over[key]) for key in ("out", "sheet") if over[key] is not None}
    else:
        base, said = ".", {"verb": what, "inputs": inputs or []}
    options_ = said.get("options", {})
    merged = {**options_, **over["options"]} if isinstance(options_, dict) else options_
    recipe = check_recipe({**said, **{k: v for k, v in over.items() if v}, "options": merged}, what)
    with inside(base):
        root: Any = context.find_root().command
        command = root.get_command(context, recipe.verb)
        if command is None or recipe.verb in NOT_ONE:
            near = suggest(recipe.verb, (name for name in root.list_commands(context) if name not in NOT_ONE))
            raise InvalidInput(f"verb: must be a command that writes one file, got {recipe.verb!r}{near}")
        recipe = place_arguments(recipe, command.params)
        jobs = list(list_jobs(recipe, command.params))
        check_results(jobs)
        contexts = [(job, make_context(command, recipe.verb, [*job.words, *more])) for job in jobs]
        check_files(contexts, command.params)
        _provenance.add_inputs(*(file for job in jobs for file in _outputs.list_files([job.source])))
        if recipe.sheet is not None:
            _outputs.check_apart([job.source for job in jobs], {"sheet": recipe.sheet})
            check_free(recipe.sheet, "sheet")
        shown = who is None and not quiet and sys.stderr is not None and sys.stderr.isatty()
        more += ["--quiet"] * (not shown)
        work = Work(root.make_command, recipe.verb, jobs, more, os.getcwd(), who is not None or count is not None)
        failed, partly = run_jobs(work, who, count, quiet=quiet)
        if recipe.sheet is not None:
            with _outputs.write_output(recipe.sheet, "sheet") as temporary:
                io.write(temporary, draw_sheet([job.out for job in jobs]))
            note(f"wrote {recipe.sheet}", quiet=quiet)
    for job, reason in failed:
        complain(f"failed: {job.source} to {job.out}: {reason}")
    done = f"{len(jobs) - len(failed)} of {len(jobs)} results are complete"
    parts = f", {partly} ignored parts of their inputs" if partly else ""
    note(f"{done}, {len(failed)} failed{parts}, in {time.monotonic() - start:.1f} s", quiet=quiet and not failed)
    if failed:
        raise typer.Exit(PARTLY)


def make_context(command: Any, verb: str, words: list[str]) -> Any:
    """Return the parsed options of a job. An error about a missing argument explains how a batch specifies it."""
    try:
        return command.make_context(verb, words)
    except UsageFailure as failure:
        missing = getattr(failure, "param", None)
        if type(failure).__name__ != "MissingParameter" or missing is None or missing.param_type_name != "argument":
            raise
        name = missing.metavar or missing.name.upper()
        raise InvalidInput(
            f"--argument: must specify the argument {name} of texrs {verb} for each input, as in "
            "--argument 'masks/{name}.png'"
        ) from None


def run_jobs(work: Work, who: int | str | None, count: int | None, *, quiet: bool) -> tuple[list[tuple[Job, str]], int]:
    """Run all jobs whose result is missing.

    Return the failed jobs with the reasons, and the number of jobs that ignored a part of an input.
    """
    failed: dict[int, str] = {}
    total, over, partly = len(work.jobs), 0, 0
    try:
        with name_arguments(scheduler="--scheduler", count="--threads"):
            for number, outcome in workers.run(work, range(total), who, threads_each=count, spare=True):
                over += 1
                # If a task ended its worker process, the result is an error text instead of an `Outcome`.
                one = outcome if isinstance(outcome, Outcome) else Outcome(str(outcome))
                said, partly = one.said, partly + bool(one.ignored)
                job, where = work.jobs[number], f"{number + 1} of {total}"
                if said == THERE:
                    note(f"{where}: {job.out} exists already", quiet=quiet)
                elif said == MADE:
                    keep(job.out)
                    note(f"{where}: wrote {job.out}{one.show()}", quiet=quiet)
                else:
                    failed[number] = said
                    note(f"{where}: {job.source} failed{one.show()}", quiet=quiet)
    except (Stopped, KeyboardInterrupt, typer.Abort):
        complain(f"stopped after {over} of {total} results; the same command continues from there")
        raise
    return [(work.jobs[number], failed[number]) for number in sorted(failed)], partly


_ALONE = threading.Lock()
"""Lock that lets only one command at a time run in a process, because commands change the current folder.

A worker of a cluster can have several threads.
"""


@dataclass(frozen=True, slots=True)
class Work:
    """Runs the jobs of a batch, in this or another process."""

    load: Callable[[str], Any]
    """Function that creates a command."""
    verb: str
    jobs: list[Job]
    more: list[str]
    """Additional arguments for all commands."""
    folder: str
    """Folder that file names are relative to."""
    limited: bool
    """If True, commands get the current limit of threads."""

    def __call__(self, number: int) -> Outcome:
        """Run a job if its result is missing, and return its outcome."""
        with _ALONE, silence_warnings(), collect() as notices:
            said = self.attempt(self.jobs[number])
        return Outcome(said, tuple(notices.ignored), tuple(notices.assumed))

    def attempt(self, job: Job) -> str:
        """Run a job if its result is missing. Return its state, or the reason of its failure."""
        try:
            with inside(self.folder), hush():
                return self.do(job)
        except UsageFailure as failure:
            return str(failure.format_message())  # type: ignore[attr-defined]
        except MemoryError:
            return "needs more memory than is available"
        except (TexrsError, OSError) as error:
            return say_error(error)
        except Exception as error:  # An error in one job does not stop the others.
            if isinstance(error, typer.Abort):
                raise
            return f"internal error: {type(error).__name__}: {error}"

    def do(self, job: Job) -> str:
        """Run a job if its result is missing. Return its state."""
        command, more = self.load(self.verb), list(self.more)
        if self.limited and any(p.name == "count" for p in command.params):
            more += ["--threads", str(count_threads())]
        words = [*job.words, *more]
        if is_done(command, command.make_context(self.verb, list(words)), job):
            return THERE
        Path(job.out).parent.mkdir(parents=True, exist_ok=True)
        command.main(words, prog_name=self.verb, standalone_mode=False)
        return MADE


def is_done(command: Any, context: Any, job: Job) -> bool:
    """Return True if all outputs of a command exist, and the same command wrote them from the same inputs."""
    record = _provenance.make_record(command, context.params, force=False)
    for option in ("out", "source_map", "page"):
        path = context.params.get(option)
        if path is None:
            continue
        if option == "out" and io.is_store(path):
            # Always run a command that writes a store, because the writer skips existing chunks.
            return False
        if option == "out" and os.path.isdir(path):
            packed = any(context.params.get(option) is not None for option in ("pack", "convention"))
            if not is_folder_done(record, path, 1 if packed else job.maps):
                return False
            continue
        made = io.read_metadata(path).made if os.path.isfile(path) else None
        if made is None or not is_unchanged(path, made):
            return False
        said, wanted = json.loads(made), json.loads(record.tell(path, output=option))
        if any(said.get(key) != value for key, value in wanted.items() if key != "content"):
            return False
    stages = context.params.get("stages")
    return stages is None or bool(_outputs.list_stages(stages))


def is_folder_done(record: _provenance.Record, folder: str, least: int) -> bool:
    """Return True if a folder contains enough maps, and the same command wrote them from the same inputs."""
    count = 0
    names = _provenance.list_folder(folder)
    for path in names:
        made = io.read_metadata(path).made
        # The record of another file is not a result.
        if made is None or path.removesuffix(".json") in set(names) - {path}:
            continue
        said, wanted = json.loads(made), json.loads(record.tell(path, inside=True))
        if any(said.get(key) != value for key, value in wanted.items() if key != "content") or not is_unchanged(
            path, made
        ):
            return False
        count += 1
    return count >= max(least, 1) and not any(name.startswith(".texrs-") for name in os.listdir(folder))


# --- around the work -------------------------------------------------------------------------------------------------


@contextmanager
def inside(folder: str) -> Iterator[None]:
    """Change the current folder during a block, because names in a recipe are relative to its folder."""
    before = os.getcwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def draw_sheet(paths: Sequence[str]) -> Array:
    """Return a contact sheet of images, each reduced to fit a cell. Cells of missing images are grey."""
    columns = int(np.ceil(np.sqrt(len(paths))))
    sheet = np.full((-(-len(paths) // columns) * CELL, columns * CELL, 3), 64, np.uint8)
    for i, path in enumerate(paths):
        try:
            small = preview(_outputs.shrink(read_shown(path), CELL))
        except (TexrsError, OSError):
            continue
        colours = small[..., np.newaxis] if small.ndim == 2 else small[..., : 1 if small.shape[2] == 2 else 3]
        top, left = i // columns * CELL, i % columns * CELL
        sheet[top : top + small.shape[0], left : left + small.shape[1]] = colours
    return sheet


def read_shown(path: str) -> Array:
    """Read an image, the preview of a material, or the middle plane of a volume."""
    if os.path.isdir(path) and not io.is_store(path):
        return Material.read(path).preview(tiles=(1, 1), side=CELL)
    try:
        image: Array = io.read(path)
    except FileError:
        volume: Array = io.read_volume(path)
        image = volume[len(volume) // 2]
    return image


COMMAND = batch_command

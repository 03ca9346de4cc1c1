"""The command that does another for many pictures, seeds and presets: ``texrs batch``.

Each result is written as soon as it is made, whole or not at all, and says how it was made. So a batch that was stopped, even
by a power cut, goes on where it was when the same command is given again: what was made in the same way is left alone.
"""

from __future__ import annotations

import glob
import itertools
import json
import os
import re
import sys
import time
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from texrs import io
from texrs._show import preview
from texrs._typing import Array
from texrs.cli import _outputs, _provenance
from texrs.cli._console import PARTLY, Stopped, UsageFailure, complain, hush, keep, note, say_sizes
from texrs.cli._outputs import SAMPLE, Quiet, Threads, make_argument, make_option, to_write
from texrs.cli._provenance import check_free, read_status
from texrs.errors import FileError, InvalidInput, TexrsError
from texrs.io._annotation import is_unchanged
from texrs.materials import Material, guess_role

PICTURES = (".png", ".tif", ".tiff", ".exr", ".hdr", ".webp", ".jpg", ".jpeg", ".bmp", ".gif", ".npy", ".npz")
VOLUMES = (".tif", ".tiff", ".npy", ".npz", ".nrrd", ".nii", ".gz", ".vti")
KEPT = (".png", ".tif", ".tiff", ".exr", ".hdr", ".npy", ".nrrd", ".nii", ".vti")
"""Formats of inputs that results have too; of others the results are .png."""
KEYS = ("verb", "inputs", "arguments", "out", "seeds", "options", "presets", "sheet")
"""What a recipe may say."""
MOST = 2**16
"""Results of a batch."""
CELL = 256


@dataclass(frozen=True, slots=True)
class Recipe:
    """What is to be done."""

    verb: str
    inputs: list[str]
    """Files, folders, patterns, or ``sample:NAME``."""
    arguments: list[str]
    """Of the verb; ``{input}`` is one of the inputs."""
    out: str
    seeds: list[int]
    options: dict[str, Any]
    presets: dict[str, dict[str, Any]]
    sheet: str | None


@dataclass(frozen=True, slots=True)
class Job:
    """A command of the batch."""

    source: str
    out: str
    words: list[str]


def batch_command(
    context: typer.Context,
    what: Annotated[str, make_argument("RECIPE.toml|VERB", "A recipe, or a command that makes one file.")],
    inputs: Annotated[
        list[str] | None, make_argument("INPUT", "Of a command: files, folders, or patterns such as 'stones/*.jpg'.")
    ] = None,
    folder: Annotated[
        str | None,
        typer.Option(
            "--out", "-o", metavar="DIR", help="Folder for the results, or a name such as 'made/{name}-{seed}.png'."
        ),
    ] = None,
    seeds: Annotated[str | None, make_option("A:B", "Seeds from A to B - 1, as in 0:32, or some, as in 1,5,9.")] = None,
    options: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="OPTION=VALUE", help="Option of the command, as in size=512; may be repeated."),
    ] = None,
    sheet: Annotated[str | None, to_write("sheet")] = None,
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Do a command for many pictures, seeds and presets; what is done already is not done again."""
    start = time.monotonic()
    running = _provenance.RUNNING.get()
    more = ([] if count is None else ["--threads", str(count)]) + ["--force"] * bool(running and running.force)
    over: dict[str, Any] = {"out": folder, "sheet": sheet, "seeds": seeds, "options": parse_options(options or [])}
    if what.lower().endswith(".toml"):
        if inputs:
            raise InvalidInput(f"INPUT: a recipe says which, got {inputs[0]!r}")
        base, said = os.path.dirname(what) or ".", read_recipe(what)
        # What is given here is seen from here.
        over |= {key: os.path.abspath(over[key]) for key in ("out", "sheet") if over[key] is not None}
    else:
        base, said = ".", {"verb": what, "inputs": inputs or []}
    options_ = said.get("options", {})
    merged = {**options_, **over["options"]} if isinstance(options_, dict) else options_
    recipe = check_recipe({**said, **{k: v for k, v in over.items() if v}, "options": merged}, what)
    with inside(base):
        command = context.find_root().command.get_command(context, recipe.verb)  # type: ignore[attr-defined]
        if command is None or recipe.verb in ("batch", "rerun", "info", "demo", "samples", "database"):
            raise InvalidInput(f"verb: needs a command that makes one file of others, got {recipe.verb!r}")
        jobs = list(list_jobs(recipe))
        check_results(jobs)
        contexts = [command.make_context(recipe.verb, [*job.words, *more]) for job in jobs]
        if recipe.sheet is not None:
            _outputs.check_apart([job.source for job in jobs], {"sheet": recipe.sheet})
            check_free(recipe.sheet, "sheet")
        failed = run_jobs(command, jobs, contexts, more, quiet=quiet)
        if recipe.sheet is not None:
            with _outputs.write_output(recipe.sheet, "sheet") as temporary:
                io.write(temporary, draw_sheet([job.out for job in jobs]))
            note(f"wrote {recipe.sheet}", quiet=quiet)
    for job, reason in failed:
        complain(f"failed: {job.source} to {job.out}: {reason}")
    done = f"{len(jobs) - len(failed)} of {len(jobs)} results are there"
    note(f"{done}, {len(failed)} failed, in {time.monotonic() - start:.1f} s", quiet=quiet and not failed)
    if failed:
        raise typer.Exit(PARTLY)


def run_jobs(
    command: Any, jobs: Sequence[Job], contexts: Sequence[Any], more: list[str], *, quiet: bool
) -> list[tuple[Job, str]]:
    """Do what is not done; return what failed, and why."""
    failed: list[tuple[Job, str]] = []
    shown = not quiet and sys.stderr is not None and sys.stderr.isatty()
    for number, (job, context) in enumerate(zip(jobs, contexts, strict=True), start=1):
        where = f"{number} of {len(jobs)}"
        try:
            if is_done(command, context, job):
                note(f"{where}: {job.out} is there", quiet=quiet)
                continue
            Path(job.out).parent.mkdir(parents=True, exist_ok=True)
            with hush():
                words = [*job.words, *more, *(["--quiet"] * (not shown))]
                command.main(words, prog_name=command.name, standalone_mode=False)
        except (Stopped, KeyboardInterrupt, typer.Abort):
            complain(f"stopped at {where}; the same command goes on from there")
            raise
        except UsageFailure as failure:
            failed.append((job, failure.format_message()))  # type: ignore[attr-defined]
        except MemoryError:
            failed.append((job, "needs more memory than there is"))
        except (TexrsError, OSError) as error:
            failed.append((job, say_sizes(str(error))))
        except Exception as error:  # One that is broken does not stop the others.
            failed.append((job, f"internal error: {type(error).__name__}: {error}"))
        else:
            keep(job.out)
            note(f"{where}: wrote {job.out}", quiet=quiet)
            continue
        note(f"{where}: {job.source} failed", quiet=quiet)
    return failed


def is_done(command: Any, context: Any, job: Job) -> bool:
    """Return whether all that a command writes is there, and was made as it would be now."""
    record = _provenance.make_record(command, context.params, force=False)
    for option in ("out", "map", "page"):
        path = context.params.get(option)
        if path is None:
            continue
        if os.path.isdir(path) and option == "out":
            packed = context.params.get("pack") is not None
            if not is_folder_done(record, path, 1 if packed else len(list_maps(job.source))):
                return False
            continue
        made = io.read_notes(path).made if os.path.isfile(path) else None
        if made is None or not is_unchanged(path, made):
            return False
        said, wanted = json.loads(made), json.loads(record.tell(path, output=option))
        if any(said.get(key) != value for key, value in wanted.items() if key != "content"):
            return False
    stages = context.params.get("stages")
    return stages is None or bool(_outputs.list_stages(stages))


def is_folder_done(record: _provenance.Record, folder: str, least: int) -> bool:
    """Return whether so many maps or more are in a folder, all made as they would be now."""
    count = 0
    for path in _provenance.list_folder(folder):
        made = io.read_notes(path).made
        if made is None:
            continue
        said, wanted = json.loads(made), json.loads(record.tell(path, inside=True))
        if any(said.get(key) != value for key, value in wanted.items() if key != "content") or not is_unchanged(
            path, made
        ):
            return False
        count += 1
    return count >= max(least, 1) and not any(name.startswith(".texrs-") for name in os.listdir(folder))


# --- recipes ---------------------------------------------------------------------------------------------------------


def read_recipe(path: str) -> dict[str, Any]:
    """Return what a recipe says."""
    try:
        with open(path, "rb") as file:
            return tomllib.load(file)
    except OSError as error:
        raise FileError(f"{path}: cannot be read ({(error.strerror or str(error)).lower()})") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InvalidInput(f"{path}: is not TOML ({error})") from None


def check_recipe(said: Mapping[str, Any], where: str) -> Recipe:
    """Return a recipe whose parts have the right types."""
    for key in said:
        if key not in KEYS:
            raise InvalidInput(f"{where}: has {key!r}; allowed are {', '.join(KEYS)}")
    for key, kind, wanted in (
        ("verb", str, "the name of a command"),
        ("out", str, "a folder, or a name such as made/{name}-{seed}.png"),
        ("sheet", str, "the name of a file"),
        ("options", dict, "a table"),
        ("presets", dict, "tables of options, by name"),
    ):
        if key in said and not (isinstance(said[key], kind) and said[key]) and said[key] != {}:
            raise InvalidInput(f"{where}: {key} needs to be {wanted}, got {said[key]!r}")
    for key in ("verb", "inputs", "out"):
        if key not in said or not said[key]:
            option = {"out": "--out", "inputs": "INPUT"}.get(key, key) if not where.endswith(".toml") else key
            raise InvalidInput(f"{where}: needs {option}")
    presets = said.get("presets", {})
    if not all(isinstance(value, dict) for value in presets.values()):
        raise InvalidInput(f"{where}: presets needs to be tables of options, by name, got {presets!r}")
    return Recipe(
        said["verb"],
        as_texts(said["inputs"], f"{where}: inputs"),
        as_texts(said.get("arguments", ["{input}"]), f"{where}: arguments"),
        said["out"],
        parse_seeds(said.get("seeds", []), f"{where}: seeds"),
        said.get("options", {}),
        presets,
        said.get("sheet"),
    )


def as_texts(value: Any, where: str) -> list[str]:
    """Return one text or several as a list."""
    several = [value] if isinstance(value, str) else value
    if not isinstance(several, list) or not all(isinstance(v, str) for v in several):
        raise InvalidInput(f"{where}: needs a text or a list of texts, got {value!r}")
    return several


def parse_seeds(value: Any, where: str) -> list[int]:
    """Return the numbers of ``0:32``, of ``1,5,9``, of a number or of a list of numbers."""
    wanted = f"{where}: needs A:B as in 0:32, numbers as in 1,5,9, or a list of them; got {value!r}"
    if isinstance(value, str):
        found = re.fullmatch(r"\s*(\d{1,20})\s*:\s*(\d{1,20})\s*", value)
        if found:
            first, end = int(found[1]), int(found[2])
            if not first < end <= first + MOST:
                raise InvalidInput(wanted)
            return list(range(first, end))
        if not re.fullmatch(r"\s*\d{1,20}(\s*,\s*\d{1,20})*\s*", value):
            raise InvalidInput(wanted)
        return [int(n) for n in value.split(",")]
    several = value if isinstance(value, list) else [value]
    if not all(isinstance(n, int) and not isinstance(n, bool) and n >= 0 for n in several):
        raise InvalidInput(wanted)
    return several


def parse_options(texts: Sequence[str]) -> dict[str, Any]:
    """Return the options of texts such as ``size=512``; without a value a flag is set."""
    return {(parts := text.partition("="))[0].lstrip("-"): parts[2] if parts[1] else True for text in texts}


def find_inputs(recipe: Recipe) -> list[str]:
    """Return the files that are meant, in the order of the recipe, each once; folders of maps where there are no files."""
    suffixes = VOLUMES if recipe.verb in ("solid", "slice") else PICTURES
    found: dict[str, None] = {}
    for text in recipe.inputs:
        if text.startswith(SAMPLE) or os.path.isfile(text):
            some = [text]
        elif os.path.isdir(text):
            there = (os.path.join(text, name) for name in sorted(os.listdir(text)) if not name.startswith("."))
            several = list(there)
            some = [p for p in several if os.path.isfile(p) and Path(p).suffix.lower() in suffixes]
            some = some or [p for p in several if is_material(p, recipe.verb)]
        else:
            several = sorted(glob.glob(text, recursive=True))
            some = [p for p in several if os.path.isfile(p)]
            some = some or [p for p in several if is_material(p, recipe.verb)]
        if not some:
            raise InvalidInput(f"inputs: nothing is found for {text!r}")
        found |= dict.fromkeys(some)
    return list(found)


def is_material(path: str, verb: str) -> bool:
    """Return whether a folder holds maps of a material, which a command takes as a whole."""
    if verb in ("solid", "slice") or not os.path.isdir(path) or Path(path).name.startswith("."):
        return False
    return bool(list_maps(path))


def list_maps(folder: str) -> list[str]:
    """Return the pictures in a folder whose names say what they are for."""
    names = sorted(os.listdir(folder)) if os.path.isdir(folder) else []
    return [n for n in names if Path(n).suffix.lower() in PICTURES and guess_role(Path(n).stem) is not None]


def list_jobs(recipe: Recipe) -> Iterator[Job]:
    """Return the commands, one for each input, preset and seed."""
    inputs = find_inputs(recipe)
    every = {source: list(expand(recipe, source)) for source in inputs}
    # What an earlier run has made is no input, if it lies where inputs are looked for.
    made = {os.path.realpath(job.out): source for source, jobs in every.items() for job in jobs}
    taken: dict[str, str] = {}
    total = 0
    for source, jobs in every.items():
        if made.get(os.path.realpath(source), source) != source:
            continue
        for job in jobs:
            other = taken.setdefault(os.path.realpath(job.out), source)
            if other != source or len({os.path.realpath(j.out) for j in jobs}) < len(jobs):
                raise InvalidInput(
                    f"out: several results have the name {job.out}; it may hold {{name}}, {{parent}}, {{preset}}, {{seed}}"
                )
            total += 1
            if total > MOST:
                raise InvalidInput(f"inputs, seeds: are more than {MOST} results")
            yield job


def expand(recipe: Recipe, source: str) -> Iterator[Job]:
    """Return the commands for one input."""
    path = Path(source.removeprefix(SAMPLE))
    name = path.name.removesuffix(".gz") if path.suffix.lower() == ".gz" else path.name
    stem, suffix = Path(name).stem, Path(name).suffix.lower()
    out = recipe.out
    if "{" not in out and not Path(out).suffix:
        parts = ["{name}", *(["{preset}"] if recipe.presets else []), *(["{seed}"] if len(recipe.seeds) > 1 else [])]
        # The maps of a material go to a folder of their own.
        end = "" if os.path.isdir(source) else suffix if suffix in KEPT else ".png"
        out = os.path.join(out, "-".join(parts) + end)
    presets = recipe.presets or {"": {}}
    chosen: list[int | None] = [*recipe.seeds] or [None]
    for (preset, options), seed in itertools.product(presets.items(), chosen):
        known = {
            "input": source,
            "name": stem if not source.startswith(SAMPLE) else str(path),
            "parent": path.parent.name,
            "preset": preset,
            "seed": "" if seed is None else str(seed),
            "verb": recipe.verb,
        }
        words = [fill(text, known) for text in recipe.arguments]
        for key, value in {**recipe.options, **options}.items():
            words += write_option(key, value, known)
        if seed is not None:
            words += ["--seed", str(seed)]
        target = fill(out, known)
        yield Job(source, target, [*words, "--out", target])


def check_results(jobs: Sequence[Job]) -> None:
    """Check that no result takes the place of an input."""
    read = {(s.st_dev, s.st_ino): job.source for job in jobs if (s := read_status(job.source)) is not None}
    for job in jobs:
        status = read_status(job.out)
        if status is not None and (source := read.get((status.st_dev, status.st_ino))) is not None:
            raise InvalidInput(f"out: {job.out} is read as {source}, and would be lost; write to another folder")


def fill(text: str, known: Mapping[str, str]) -> str:
    """Return a text with what stands in braces filled in; other braces are left alone."""
    return re.sub(r"\{(input|name|parent|preset|seed|verb)\}", lambda found: known[found[1]], text)


def write_option(key: str, value: Any, known: Mapping[str, str]) -> list[str]:
    """Return an option as the command line takes it."""
    flag = key.replace("_", "-")
    if isinstance(value, bool):
        return [f"--{'' if value else 'no-'}{flag}"]
    several = value if isinstance(value, list) else [value]
    if not all(isinstance(v, str | int | float) for v in several):
        raise InvalidInput(f"options: {key} needs a text, a number, true or false, got {value!r}")
    return [word for v in several for word in (f"--{flag}", fill(str(v), known))]


# --- around the work -------------------------------------------------------------------------------------------------


@contextmanager
def inside(folder: str) -> Iterator[None]:
    """Work in a folder: names in a recipe are seen from where it lies."""
    before = os.getcwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def draw_sheet(paths: Sequence[str]) -> Array:
    """Return pictures side by side, each as large as fits a cell; what is missing is grey."""
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
    """Read a picture, or the middle plane of a volume."""
    if os.path.isdir(path):
        return Material.read(path).preview(tiles=(1, 1), side=CELL)
    try:
        image: Array = io.read(path)
    except FileError:
        volume: Array = io.read_volume(path)
        image = volume[len(volume) // 2]
    return image


COMMAND = batch_command

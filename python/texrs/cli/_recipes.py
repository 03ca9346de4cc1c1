"""What a batch is to do: recipes, what they say, and the commands that come of them."""

from __future__ import annotations

import glob
import itertools
import os
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from texrs import io
from texrs.cli._outputs import SAMPLE
from texrs.cli._provenance import read_status
from texrs.errors import FileError, InvalidInput
from texrs.io._formats import READ_IMAGES, READ_VOLUMES, WRITTEN_IMAGES, WRITTEN_VOLUMES
from texrs.materials import guess_role

__all__ = ["Job", "Recipe", "check_recipe", "check_results", "list_jobs", "list_maps", "parse_options", "read_recipe"]

KEPT = tuple(s for s in WRITTEN_IMAGES if s not in (".webp", ".jpg", ".jpeg", ".bmp", ".npz"))
KEPT_VOLUMES = tuple(s for s in WRITTEN_VOLUMES if s not in (".npz", ".nii.gz"))
"""Formats of inputs that results have too; of others the results are .png, or .npy."""
OF_VOLUMES = ("solid", "slice")
"""Commands that take volumes."""
KEYS = ("verb", "inputs", "arguments", "out", "seeds", "options", "presets", "sheet")
"""What a recipe may say."""
MOST = 2**16
"""Results of a batch."""


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
    found: dict[str, None] = {}
    for text in recipe.inputs:
        if text.startswith(SAMPLE) or os.path.isfile(text) or io.is_store(text):
            some = [text]
        elif os.path.isdir(text):
            several = [os.path.join(text, name) for name in sorted(os.listdir(text)) if not name.startswith(".")]
            suffixes = READ_VOLUMES if recipe.verb in OF_VOLUMES else READ_IMAGES
            some = [p for p in several if (os.path.isfile(p) and p.lower().endswith(suffixes)) or io.is_store(p)]
            some = some or [p for p in several if is_material(p, recipe.verb)]
        else:
            several = sorted(glob.glob(text, recursive=True))
            some = [p for p in several if os.path.isfile(p) or io.is_store(p)]
            some = some or [p for p in several if is_material(p, recipe.verb)]
        if not some:
            raise InvalidInput(f"inputs: nothing is found for {text!r}")
        found |= dict.fromkeys(some)
    return list(found)


def is_material(path: str, verb: str) -> bool:
    """Return whether a folder holds maps of a material, which a command takes as a whole."""
    if verb in OF_VOLUMES or not os.path.isdir(path) or Path(path).name.startswith("."):
        return False
    return bool(list_maps(path))


def list_maps(folder: str) -> list[str]:
    """Return the pictures in a folder whose names say what they are for."""
    names = sorted(os.listdir(folder)) if os.path.isdir(folder) else []
    return [n for n in names if n.lower().endswith(READ_IMAGES) and guess_role(Path(n).stem) is not None]


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
        kept, usual = (KEPT_VOLUMES, ".npy") if recipe.verb == "solid" else (KEPT, ".png")
        end = suffix if suffix in kept else usual
        if os.path.isdir(source) and not io.is_store(source):
            end = ""
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

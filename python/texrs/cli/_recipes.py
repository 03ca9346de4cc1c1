"""Read the recipe of a batch, and list its commands."""

from __future__ import annotations

import codecs
import itertools
import os
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from texrs import io
from texrs._arrays import as_list
from texrs.cli._inputs import Source, fill, find_sources, list_known
from texrs.cli._outputs import OUTPUTS, SAMPLE
from texrs.cli._provenance import expand_braces, read_status
from texrs.errors import FileError, InvalidInput
from texrs.io.formats import READ_IMAGES, READ_VOLUMES, WRITTEN_IMAGES, WRITTEN_VOLUMES

__all__ = [
    "Job",
    "Recipe",
    "check_files",
    "check_recipe",
    "check_results",
    "list_jobs",
    "parse_options",
    "place_arguments",
    "read_recipe",
]

KEPT = tuple(s for s in WRITTEN_IMAGES if s not in (".gif", ".npz"))
KEPT_VOLUMES = tuple(s for s in WRITTEN_VOLUMES if s != ".npz")
"""Formats that results have in common with their inputs. Results of inputs in other formats are .png or .npy files."""
LOSSY = (".jpg", ".jpeg", ".webp", ".avif", ".jxl")
EXACT = ("scale-map",)
"""Commands whose results are measurements. Their results are not written in lossy formats."""
NAMED = (*READ_IMAGES, *READ_VOLUMES, ".csv", ".json", ".npz")
"""Suffixes of arguments that are names of files."""
KEYS = ("verb", "inputs", "arguments", "out", "seeds", "options", "presets", "sheet")
"""Keys that a recipe can have."""
MOST = 2**16
"""Maximum number of jobs of a batch."""


@dataclass(frozen=True, slots=True)
class Recipe:
    """Description of a batch."""

    verb: str
    inputs: list[str]
    """Files, folders, patterns, or ``sample:NAME``."""
    arguments: list[str]
    """Arguments of the command. ``{input}`` stands for an input."""
    out: str
    seeds: list[int]
    options: dict[str, Any]
    presets: dict[str, dict[str, Any]]
    sheet: str | None


@dataclass(frozen=True, slots=True)
class Job:
    """One command of a batch."""

    source: str
    out: str
    words: list[str]
    maps: int = 0
    """Number of maps of the material. 0 for a file."""


def read_recipe(path: str) -> dict[str, Any]:
    """Read the recipe in a TOML file as a table."""
    try:
        content = Path(path).read_bytes()
        # Windows editors can write a byte order mark or UTF-16.
        wide = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        return tomllib.loads(content.decode("utf-16" if wide else "utf-8-sig"))
    except OSError as error:
        raise FileError(f"{path}: cannot be read ({(error.strerror or str(error)).lower()})") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InvalidInput(f"{path}: is not TOML ({error})") from None


def check_recipe(said: Mapping[str, Any], where: str) -> Recipe:
    """Check the types in the table of a recipe, and return the recipe."""
    for key in said:
        if key not in KEYS:
            raise InvalidInput(f"{where}: unknown key {key!r}; must be one of {', '.join(KEYS)}")
    for key, kind, wanted in (
        ("verb", str, "the name of a command"),
        ("out", str, "a folder, or a name such as made/{name}-{seed}.png"),
        ("sheet", str, "the name of a file"),
        ("options", dict, "a table"),
        ("presets", dict, "a table of presets"),
    ):
        if key in said and not (isinstance(said[key], kind) and said[key]) and said[key] != {}:
            raise InvalidInput(f"{where}: {key} must be {wanted}, got {said[key]!r}")
    for key in ("verb", "inputs", "out"):
        if key not in said or not said[key]:
            option = {"out": "--out", "inputs": "INPUT"}.get(key, key) if not where.endswith(".toml") else key
            raise InvalidInput(f"{where}: {option} is missing")
    presets = said.get("presets", {})
    if not all(isinstance(value, dict) for value in presets.values()):
        raise InvalidInput(f"{where}: each preset must be a table of options, got {presets!r}")
    return Recipe(
        said["verb"],
        as_texts(said["inputs"], f"{where}: inputs"),
        place_input(as_texts(said.get("arguments", []), f"{where}: arguments")),
        said["out"],
        parse_seeds(said.get("seeds", []), f"{where}: seeds"),
        said.get("options", {}),
        presets,
        said.get("sheet"),
    )


def place_input(arguments: list[str]) -> list[str]:
    """Return the arguments of the command. The input is the first one, unless an argument contains ``{input}``."""
    return arguments if any("{input}" in text for text in arguments) else ["{input}", *arguments]


def as_texts(value: Any, where: str) -> list[str]:
    """Return one or several texts as a list."""
    several = [value] if isinstance(value, str) else value
    if not isinstance(several, list) or not all(isinstance(v, str) for v in several):
        raise InvalidInput(f"{where}: must be a string or a list of strings, got {value!r}")
    return several


def parse_seeds(value: Any, where: str) -> list[int]:
    """Return the seeds that ``0:32``, ``1,5,9``, a number or a list of numbers describes."""
    wanted = f"{where}: must be A:B as in 0:32, numbers as in 1,5,9, or a list of them; got {value!r}"
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
    """Return the options in texts such as ``size=512``. A name without a value is a flag."""
    return {(parts := text.partition("="))[0].lstrip("-"): parts[2] if parts[1] else True for text in texts}


def list_jobs(recipe: Recipe, parameters: Sequence[Any]) -> Iterator[Job]:
    """Return the commands of a batch: one for each input, preset and seed."""
    base = recipe.out.partition("{")[0]
    every: dict[Source, list[Job]] = {}
    for source in find_sources(
        recipe.inputs,
        recipe.verb,
        stacked=any(p.name == "role" for p in parameters),
        templates=[*recipe.arguments, *list_files(recipe, parameters)],
        out=base if base == recipe.out and not Path(base).suffix else os.path.dirname(base),
    ):
        every[source] = list(expand(recipe, source))
    # Exclude results of an earlier run from the inputs, even if a pattern matches them.
    flags = {flag for names, _, _ in OUTPUTS.values() for flag in names}
    made: dict[str, Source] = {}
    for source, jobs in every.items():
        for job in jobs:
            written = [after for word, after in itertools.pairwise(job.words) if word in flags]
            made |= {os.path.realpath(path): source for path in written}
    if recipe.sheet is not None and '"verb": "batch"' in (io.read_metadata(recipe.sheet).made or ""):
        made[os.path.realpath(recipe.sheet)] = Source("", "")
    taken: dict[str, Source] = {}
    total = 0
    for source, jobs in every.items():
        place = Path(os.path.realpath(source.text))
        if any(made.get(str(p), source) != source for p in (place, *place.parents)):
            continue
        for job in jobs:
            other = taken.setdefault(os.path.realpath(job.out), source)
            if other != source or len({os.path.realpath(j.out) for j in jobs}) < len(jobs):
                raise InvalidInput(
                    f"out: must differ for each result, but several have the name {job.out}; add {{folder}}, "
                    f"{{name}}, {{suffix}}, {{parent}}, {{preset}} or {{seed}} to it"
                )
            total += 1
            if total > MOST:
                raise InvalidInput(f"inputs, seeds: must result in at most {MOST} files")
            yield job


def list_files(recipe: Recipe, parameters: Sequence[Any]) -> list[str]:
    """Return the options of a recipe that name a file to read, with the names as written there."""
    read = {max(p.opts, key=len) for p in parameters if names_file(p)}
    several = {**recipe.options, **{k: v for each in recipe.presets.values() for k, v in each.items()}}
    given = [(f"--{key.replace('_', '-')}", value) for key, value in several.items()]
    return [text for flag, value in given if flag in read for text in as_list(value) if isinstance(text, str)]


def names_file(parameter: Any) -> bool:
    """Return True if an option or an argument of a command can name an input file."""
    if parameter.param_type_name == "argument":
        return True
    return parameter.name not in OUTPUTS and re.search("FILE|csv", parameter.metavar or "") is not None


def check_files(jobs: Sequence[tuple[Job, Any]], parameters: Sequence[Any]) -> None:
    """Check that all other files that jobs read exist. An error names all missing files."""
    missing = {}
    for job, context in jobs:
        for p in parameters:
            if not names_file(p):
                continue
            for text in as_list(context.params.get(p.name)):
                named = isinstance(text, str) and text != job.source and text.lower().endswith(NAMED)
                if named and not (os.path.exists(text) or text.startswith(SAMPLE) or expand_braces(text)):
                    missing[job.source, text] = f"{job.source} needs {text}"
    if missing:
        names = ", ".join(list(missing.values())[:8])
        more = f" and {len(missing) - 8} more" if len(missing) > 8 else ""
        count = len({source for source, _ in missing})
        total = len({job.source for job, _ in jobs})
        raise InvalidInput(f"arguments: files are missing for {count} of {total} inputs: {names}{more}")


def place_arguments(recipe: Recipe, parameters: Sequence[Any]) -> Recipe:
    """Return a recipe whose options are moved to arguments if they are arguments of the command, such as ``mask``."""
    options, arguments = dict(recipe.options), list(recipe.arguments)
    flags = {flag.lstrip("-") for p in parameters for flag in p.opts if p.param_type_name == "option"}
    for place, p in enumerate(q for q in parameters if q.param_type_name == "argument"):
        name = (p.metavar or p.name).lower()
        if name in options and name not in flags and place == len(arguments):
            arguments.append(str(options.pop(name)))
    return replace(recipe, arguments=arguments, options=options)


def expand(recipe: Recipe, source: Source) -> Iterator[Job]:
    """Return the commands for one input."""
    out = recipe.out
    if "{" not in out and not Path(out).suffix:
        parts = ["{name}", *(["{preset}"] if recipe.presets else []), *(["{seed}"] if len(recipe.seeds) > 1 else [])]
        out = os.path.join(out, "{folder}", "-".join(parts) + choose_suffix(recipe.verb, source))
    presets = recipe.presets or {"": {}}
    chosen: list[int | None] = [*recipe.seeds] or [None]
    for (preset, options), seed in itertools.product(presets.items(), chosen):
        known = list_known(source) | {"preset": preset, "seed": "" if seed is None else str(seed), "verb": recipe.verb}
        words = [fill(text, known) for text in recipe.arguments]
        for key, value in {**recipe.options, **options}.items():
            words += write_option(key, value, known)
        if seed is not None:
            words += ["--seed", str(seed)]
        target = fill(out, known)
        yield Job(source.text, target, [*words, "--out", target], source.maps)


def choose_suffix(verb: str, source: Source) -> str:
    """Return the suffix of a result. It is the suffix of the input if results can be written in this format."""
    if source.maps:
        # A material is written to a folder, whose name has no suffix.
        return ""
    suffix = source.suffix.lower()
    if verb == "analyse":
        return ".npz"
    kept, usual = (KEPT_VOLUMES, ".npy") if verb == "solid" else (KEPT, ".png")
    return source.suffix if suffix in kept and not (verb in EXACT and suffix in LOSSY) else usual


def check_results(jobs: Sequence[Job]) -> None:
    """Check that no result of a batch replaces an input."""
    files = {file: None for job in jobs for file in (expand_braces(job.source) or [job.source])}
    read = {(s.st_dev, s.st_ino): file for file in files if (s := read_status(file)) is not None}
    for job in jobs:
        status = read_status(job.out)
        if status is not None and (source := read.get((status.st_dev, status.st_ino))) is not None:
            raise InvalidInput(f"out: {job.out} is the input {source}, and would be lost; write to another folder")


def write_option(key: str, value: Any, known: Mapping[str, str]) -> list[str]:
    """Return the command-line arguments for an option and its value."""
    flag = key.replace("_", "-")
    if isinstance(value, bool):
        return [f"--{'' if value else 'no-'}{flag}"]
    several = value if isinstance(value, list) else [value]
    if not all(isinstance(v, str | int | float) for v in several):
        raise InvalidInput(f"options: {key} must be a string, a number, true or false, got {value!r}")
    return [word for v in several for word in (f"--{flag}", fill(str(v), known))]

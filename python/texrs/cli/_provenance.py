"""Record how files were made: each output contains its command, which is checked before the file is replaced.

The record contains everything that the result depends on. This is the version, the command, its arguments, the options
that differ from their defaults, the seed, and the SHA-256 of every input file. File names are relative to the folder
of the output, so that a folder can be moved as a whole. Options without an effect on the result (threads, progress,
names of outputs) and dates are omitted. The same command therefore gives the same bytes.
"""

from __future__ import annotations

import json
import os
import re
import stat
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from texrs import io
from texrs._version import __version__
from texrs.cli._places import has_rows_first
from texrs.cli._tails import split_tail
from texrs.errors import InvalidInput
from texrs.io.annotation import BLANK, hash_file, is_unchanged, name_sidecar, needs_sidecar
from texrs.materials.conventions import guess_roles
from texrs.materials.files import read_labels, split_suffix

LEFT = (
    "count",
    "quiet",
    "memory_limit",
    "pixel_limit",
    "time_limit",
    "force",
    "strict",
    "each",
    "out",
    "source_map",
    "stages",
    "preview",
    "mipmaps",
    "gltf",
    "materialx",
    "page",
    "sheet",
    "workers",
    "scheduler",
)
"""Parameters that are not recorded: parameters without an effect on the result, and names of outputs."""
BRACES = re.compile(r"([^{}]*)\{([^{}/]*,[^{}/]*)\}([^{}/]*)")
"""Pattern of a text that names several files of a folder."""
CHANGED = "changed while it was read"
"""Value in place of the SHA-256 of a file that changed while it was read."""


@dataclass(slots=True)
class Record:
    """Record of a command and its inputs."""

    verb: str
    arguments: list[str | None]
    """Arguments of the command. None represents the output folder."""
    options: dict[str, Any]
    """Options that differ from their defaults. Each value is a string, a list of strings, or True."""
    seed: int | None
    files: dict[str, os.stat_result]
    """Input files, with their status at the start."""
    places: dict[str, str]
    """Absolute paths of the inputs and of the folder, because the current folder can change during the work."""
    folder: str | None = None
    """Folder of a database, or another folder that can contain inputs."""
    stacks: tuple[str, ...] = ()
    """Folders of maps whose files are all inputs."""
    placed: bool = False
    """If True, the arguments contain places, so the record states the order of their coordinates."""
    force: bool = False
    """If True, any existing file can be replaced."""
    original: Mapping[str, str] = field(default_factory=dict)
    """Recorded names of files that are read from other paths, if a result is made again."""
    checked: set[str] = field(default_factory=set)
    """Outputs that were checked before."""
    hashes: dict[str, str] = field(default_factory=dict)

    def find_hash(self, name: str) -> str:
        """Return the SHA-256 of an input file, or `CHANGED` if the file changed during the work."""
        if name not in self.hashes:
            # Hash lazily: a rejected command never needs the hash.
            place = self.places[name]
            self.hashes[name] = hash_file(place)
            now, then = os.stat(place), self.files[name]
            if (now.st_size, now.st_mtime_ns, now.st_ino) != (then.st_size, then.st_mtime_ns, then.st_ino):
                self.hashes[name] = CHANGED
        return self.hashes[name]

    def rename(self, text: Any, folder: str) -> Any:
        """Return a file name relative to a folder. Texts that are not inputs are returned unchanged."""
        if isinstance(text, list):
            return [self.rename(t, folder) for t in text]
        if not isinstance(text, str):
            return text
        if (named := split_tail(text))[1]:
            return self.rename(named[0], folder) + named[1]
        if not (text in self.files or text == self.folder or text in self.stacks):
            return text
        if text in self.original:
            return self.original[text]
        real = self.places[text]
        try:
            return Path(os.path.relpath(real, folder)).as_posix()
        except ValueError:  # On Windows, a file on another drive cannot have a relative path.
            return Path(real).as_posix()

    def tell(self, target: str, *, output: str = "out", inside: bool = False, suffix: str = "") -> str:
        """Return the record for an output file as JSON.

        The record also states which option named the file, and whether the option named its folder.
        """
        folder = os.path.dirname(os.path.realpath(target))
        said: dict[str, Any] = {
            "texrs": __version__,
            "verb": self.verb,
            "arguments": self.rename(self.arguments, folder),
            "options": {flag: self.rename(value, folder) for flag, value in self.options.items()},
        }
        if self.seed is not None:
            said["seed"] = self.seed
        used = self._find_used()
        said["inputs"] = {self.rename(name, folder): self.find_hash(name) for name in self.files if name in used}
        said["output"] = as_flag(output)
        if inside:
            said["file"] = os.path.basename(target)
        if self.placed and not has_rows_first():
            said["places"] = "x,y"
        if suffix:
            # Add the suffix, because reports and maps can depend on the format of the result.
            said["suffix"] = suffix
        return json.dumps(said)[:-1] + f", {BLANK}}}"

    def _find_used(self) -> set[str]:
        """Return the names of the input files that the record mentions. A folder stands for the files read from it."""
        texts = [*self.arguments, *(t for v in self.options.values() for t in (v if isinstance(v, list) else [v]))]
        folders = {Path(f) for f in (self.folder, *(s for s in self.stacks if s in texts)) if f is not None}
        inside = {n for n in self.files if Path(n).parent in folders}
        inside |= {n for s in self.stacks if s in texts for n in expand_braces(s)} & self.files.keys()
        return {split_tail(t)[0] for t in texts if isinstance(t, str)} | inside


RUNNING: ContextVar[Record | None] = ContextVar("record", default=None)
"""Record of the running command."""
ORIGINAL: ContextVar[Mapping[str, str] | None] = ContextVar("original", default=None)
"""Recorded names of input files that are read from other paths."""


def as_flag(name: str) -> str:
    """Return the option of a parameter, such as ``--source-map`` for ``source_map``."""
    return "--" + name.replace("_", "-")


def read_status(path: str) -> os.stat_result | None:
    """Return the status of a regular file or Zarr store, or None if the path is neither."""
    with suppress(OSError, ValueError):
        status = os.stat(path)
        if stat.S_ISREG(status.st_mode) or io.is_store(path):
            return status
    return None


def expand_braces(text: str) -> list[str]:
    """Return the files that a text such as ``in/rock_{albedo,normal}.png`` names. Other texts give an empty list."""
    found = BRACES.fullmatch(text)
    if not found or os.path.lexists(text):
        return []
    return [f"{found[1]}{part}{found[3]}" for part in found[2].split(",")]


def list_folder(name: str) -> list[str]:
    """Return the files in a folder, or the files that a text with braces names. Other texts give an empty list."""
    if not name or "\0" in name or io.is_store(name):
        return []
    if not os.path.isdir(name):
        return [file for file in expand_braces(name) if os.path.isfile(file)]
    return sorted(os.path.join(name, entry.name) for entry in os.scandir(name) if entry.is_file())


def make_record(command: Any, given: Mapping[str, Any], *, force: bool) -> Record:
    """Return the record of a command with given values of its parameters."""
    arguments: list[str | None] = []
    options: dict[str, Any] = {}
    names: list[str] = []
    # A batch can run any command, so its options can contain places.
    placed = command.name == "batch"
    for p in command.params:
        value = given.get(p.name)
        if p.name in LEFT or value in (None, [], ()):
            continue
        texts = [str(v) for v in value] if isinstance(value, list | tuple) else [str(value)]
        placed = placed or (value != p.default and re.search("X,Y|csv", p.metavar or "") is not None)
        if p.param_type_name == "argument":
            arguments += texts
            names += texts
        elif value != p.default:
            flag = max(p.opts, key=len)
            if isinstance(value, bool):
                options[flag if value else max(p.secondary_opts, key=len)] = True
            else:
                options[flag] = texts if isinstance(value, list | tuple) else texts[0]
                # Options that do not name files, such as --wrap x, are not inputs even if a file has this name.
                names += texts if re.search("FILE|csv", p.metavar or "") else []
    shared = any(given.get(name) is not None for name in ("workers", "scheduler"))
    if shared and given.get("origin", "") is None and given.get("chunks") is None:
        # Workers and schedulers are not recorded, but they make the result a part of an unbounded texture. Record an
        # origin, which has the same effect.
        options["--origin"] = "0,0,0" if command.name == "solid" else "0,0"
    names = [split_tail(name)[0] for name in names]
    files = {name: status for name in names if (status := read_status(name)) is not None}
    stacks = tuple(dict.fromkeys(name for name in names if list_folder(name))) if command.name != "database" else ()
    said = [str(text).partition("=")[0] for text in given.get("role") or ()]
    # From a folder, only the maps of a material are inputs. A batch is an exception, because it reads all images.
    every = command.name == "batch"
    inside = [f for name in stacks for f in (list_folder(name) if every else list_maps(name, said))]
    files |= {f: status for f in inside if (status := read_status(f)) is not None}
    folder = arguments[0] if command.name == "database" else given.get("folder")
    seed = given.get("seed")
    places = {name: os.path.realpath(name) for name in (*files, *stacks, *([folder] if folder is not None else []))}
    return Record(
        command.name, arguments, options, seed, files, places, folder, stacks, placed, force, ORIGINAL.get() or {}
    )


def list_maps(folder: str, said: Sequence[str]) -> list[str]:
    """Return the files in a folder that are maps of its material, according to names, contents or the option --role."""
    parts = {f: split_suffix(os.path.basename(f)) for f in list_folder(folder)}
    stems = {f: stem for f, (stem, suffix) in parts.items() if suffix}
    known = {*said, *guess_roles(list(stems.values()))[0]}
    return [
        f
        for f, stem in stems.items()
        if stem in known or os.path.basename(f) in known or read_labels(Path(f)) is not None
    ]


@contextmanager
def record(one: Record | None) -> Iterator[None]:
    """Use a record for all files that are written during a block."""
    token = RUNNING.set(one)
    try:
        yield
    finally:
        RUNNING.reset(token)


def narrow(
    arguments: Sequence[str | None] | None = None,
    options: Mapping[str, Any] | None = None,
    seed: int | None = None,
    files: Sequence[str] | None = None,
) -> Record | None:
    """Return the record of the running command with other arguments and options.

    Options with the value None are removed.
    """
    whole = RUNNING.get()
    if whole is None:
        return None
    changed = {f: v for f, v in {**whole.options, **(options or {})}.items() if v is not None}
    kept = whole.arguments if arguments is None else list(arguments)
    read = whole.files if files is None else {n: s for n, s in whole.files.items() if n in files}
    return replace(whole, arguments=kept, options=changed, seed=whole.seed if seed is None else seed, files=read)


def add_inputs(*names: str) -> None:
    """Add files to the inputs of the running command. Files that are written later record them."""
    running = RUNNING.get()
    if running is not None:
        found = {name: status for name in names if (status := read_status(name)) is not None}
        running.files |= found
        running.places |= {name: os.path.realpath(name) for name in found}


# --- what may be replaced --------------------------------------------------------------------------------------------


def check_free(path: str, option: str = "out", *, inside: bool = False) -> None:
    """Check that a file can be replaced: an existing file must be from the same command with the same arguments."""
    running = RUNNING.get()
    if running is None or running.force:
        return
    real = os.path.realpath(path)
    if real in running.checked:
        return
    status = read_status(path)
    if status is not None and status.st_size > 0:
        reason = _find_other(running, path)
        if reason:
            raise InvalidInput(
                f"{as_flag(option)}: {path} {reason}; pass --force to replace it, or write to another file"
            )
    beside = str(name_sidecar(Path(real)))
    if (
        needs_sidecar(Path(real))
        and status is None
        and read_status(beside) is not None
        and io.read_metadata(beside).made is None
    ):
        raise InvalidInput(
            f"{as_flag(option)}: {beside} exists, but the record of {path} must be written there; pass --force to "
            "replace it"
        )
    running.checked.add(real)


def _find_other(running: Record, path: str) -> str:
    """Return the reason why an existing file is not from the running command, or an empty text."""
    made = io.read_metadata(path).made
    if made is None:
        return "exists, and was not written by a texrs command"
    if not is_unchanged(path, made):
        return "was changed since texrs made it"
    said = json.loads(made)
    folder = os.path.dirname(os.path.realpath(path))
    if said.get("verb") != running.verb:
        return f"was made by texrs {said.get('verb')}"
    if said.get("arguments") != running.rename(running.arguments, folder):
        return f"was made with other arguments: {' '.join(str(a) for a in said.get('arguments', ()) if a is not None)}"
    return ""

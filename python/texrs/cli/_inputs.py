"""Find the inputs of a batch: files, folders with all subfolders, and patterns. Unused files are reported."""

from __future__ import annotations

import glob
import itertools
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from texrs import io
from texrs._notices import ignore
from texrs.cli._outputs import SAMPLE
from texrs.cli._provenance import expand_braces
from texrs.errors import InvalidInput
from texrs.io.files import find_suffix
from texrs.io.formats import READ_IMAGES, READ_VOLUMES
from texrs.materials import Role
from texrs.materials.conventions import cut_name, guess_roles
from texrs.materials.files import DOCUMENTS, SYSTEM

__all__ = ["OF_VOLUMES", "Source", "fill", "find_sources", "list_known"]

OF_VOLUMES = ("solid", "slice")
"""Commands whose inputs are volumes."""
SHOWN = 8
"""Maximum number of names that a notice lists. The notice gives only the number of further names."""
FIELDS = re.compile(r"\{(input|name|folder|suffix|preset|seed|verb|parent(?:[2-9]|[1-9][0-9])?)\}")
"""Pattern of the words in braces that are replaced, such as ``{name}``."""


@dataclass(frozen=True, slots=True)
class Source:
    """An input of one or several jobs of a batch."""

    text: str
    """Text of the input as a command-line argument."""
    name: str
    suffix: str = ""
    """Suffix of the file, or an empty text for a material."""
    folder: str = ""
    """Folder of the input, relative to the folder or pattern that the user gave."""
    maps: int = 0
    """Number of maps of a material. 0 for a file."""


def find_sources(
    texts: Sequence[str],
    verb: str,
    *,
    stacked: bool = False,
    templates: Sequence[str] = (),
    out: str = "",
) -> list[Source]:
    """Return the inputs that texts describe, without duplicates and in the order of the texts.

    Parameters
    ----------
    texts : sequence of str
        Files, folders, patterns, or ``sample:NAME``. Folders are searched with all their subfolders.
    verb : str
        Command that processes the inputs.
    stacked : bool
        If True, all files of one material are a single input.
    templates : sequence of str
        Names of other files that jobs read, such as ``masks/{name}.png``. These files are not inputs.
    out : str
        Folder of the results, which is not searched.

    """
    found = _Found(READ_VOLUMES if verb in OF_VOLUMES else READ_IMAGES, os.path.realpath(out) if out else "")
    for text in texts:
        if not found.add(text):
            raise InvalidInput(f"inputs: must be existing files, but none match {text!r}")
    found.drop_used(templates)
    several = list(found.make_sources(stacked=stacked))
    if not several:
        raise InvalidInput(f"inputs: must be existing files, but none match {' '.join(map(repr, texts))}")
    return several


@dataclass(slots=True)
class _Found:
    """Files of all inputs, while they are collected."""

    suffixes: tuple[str, ...]
    out: str
    files: dict[str, str] = field(default_factory=dict)
    """Found files, each with the folder that its path is relative to.

    The folder is empty for files that were named one by one.
    """
    walked: set[str] = field(default_factory=set)
    """Folders that were searched completely."""

    def add(self, text: str) -> bool:
        """Add the files that a text describes. Return True if there are any."""
        before = len(self.files)
        if text.startswith(SAMPLE) or os.path.isfile(text) or io.is_store(text) or expand_braces(text):
            self.files.setdefault(text, "")
        elif os.path.isdir(text):
            self._walk(text, text)
        else:
            there = sorted(glob.glob(text, recursive=True))
            base = re.split(r"[*?\[]", text, maxsplit=1)[0]
            base = os.path.dirname(base)
            named = [p for p in there if os.path.isfile(p) or io.is_store(p)]
            self._take(text, named, base)
            for folder in (p for p in there if os.path.isdir(p) and p not in named):
                self._walk(folder, base)
        return len(self.files) > before or any(p == text or p.startswith(text) for p in self.files)

    def _walk(self, folder: str, base: str) -> None:
        """Add the files of a folder and of all its subfolders, including linked folders."""
        several: list[str] = []
        seen: set[str] = set()
        for place, folders, names in os.walk(folder, followlinks=True):
            inner = sorted(os.path.join(place, n) for n in folders if not n.startswith("."))
            stores = [p for p in inner if io.is_store(p)]
            # Skip folders that were visited, because a link can lead back to a folder above it.
            go = [p for p in inner if p not in stores and os.path.realpath(p) not in seen | {self.out}]
            seen |= {os.path.realpath(p) for p in go}
            folders[:] = [os.path.basename(p) for p in go]
            several += [os.path.join(place, n) for n in sorted(names) if not n.startswith(".")] + stores
            self.walked.add(os.path.normpath(place))
        self._take(folder, several, base)

    def _take(self, text: str, paths: Sequence[str], base: str) -> None:
        """Add the files with suffixes of supported formats, and report the others."""
        read = [p for p in paths if p.lower().endswith(self.suffixes) or io.is_store(p)]
        # If no file that matches a pattern has a known suffix, add them all, because the content decides the format.
        read = read or ([] if os.path.isdir(text) else list(paths))
        taken = {*read, *(p for p in paths if os.path.basename(p).lower() in SYSTEM or p.lower().endswith(DOCUMENTS))}
        left = [p for p in paths if p not in taken]
        if left:
            ignore(f"{text}: {_count(left, 'file')} not used, because texrs does not read this suffix: {_list(left)}")
        for path in read:
            self.files.setdefault(path, base)

    def drop_used(self, templates: Iterable[str]) -> None:
        """Remove the files that the names in ``templates`` refer to, because they are not inputs."""
        known = [list_known(_name(path, base)) for path, base in self.files.items()]
        used = {os.path.realpath(fill(t, each)) for t in templates if t != "{input}" for each in known}
        self.files = {path: base for path, base in self.files.items() if os.path.realpath(path) not in used}

    def make_sources(self, *, stacked: bool) -> Iterator[Source]:
        """Return the inputs for all files. If ``stacked``, the files of one material are a single input."""
        folders: dict[str, list[str]] = {}
        for path in self.files:
            plain = path.startswith(SAMPLE) or not os.path.isfile(path)
            folders.setdefault(path if plain else os.path.dirname(path), []).append(path)
        for folder, paths in folders.items():
            if paths == [folder] or not stacked:
                yield from (_name(path, self.files[path]) for path in paths)
            else:
                yield from self._group(folder, paths)

    def _group(self, folder: str, paths: Sequence[str]) -> Iterator[Source]:
        """Return the inputs in a folder: the folder itself if it is one material, else its materials and images."""
        stems = {path: os.path.basename(path)[: -len(find_suffix(Path(path))) or None] for path in paths}
        roles = find_roles(stems)
        keys: dict[str, list[str]] = {}
        for path in roles:
            keys.setdefault(cut_name(stems[path]), []).append(path)
        materials = {key: own for key, own in keys.items() if len({roles[p] for p in own}) > 1}
        base = self.files[paths[0]]
        if len(materials) == len(keys) == 1 and os.path.normpath(folder or ".") in self.walked:
            inside = os.path.normpath(folder or ".")
            above = os.path.dirname(os.path.relpath(inside, base)) if base != folder else ""
            name = os.path.basename(os.path.abspath(inside))
            # If the folder also contains other inputs, list the files of the material, because a folder is read as a
            # whole.
            deeper = any(path.startswith(os.path.join(folder, "")) for path in self.files if path not in paths)
            text = join_braces(paths) if deeper else folder
            yield Source(text, name, folder=above.removeprefix("."), maps=len(roles))
            return
        taken = {path: key for key, own in materials.items() for path in own}
        for path in paths:
            # Assign a file to a material if its name begins with the name of the material. This includes unknown maps,
            # because the reader reports them.
            starts = [k for k in materials if k and re.match(rf"{re.escape(k)}[_\-. ]", stems[path])]
            if path not in roles and starts:
                taken[path] = max(starts, key=len)
        done: set[str] = set()
        for path in paths:
            key = taken.get(path)
            if key is None:
                yield _name(path, self.files[path])
            elif key not in done:
                done.add(key)
                own = [p for p in paths if taken.get(p) == key]
                one = _name(path, self.files[path])
                yield Source(join_braces(own), key or one.name, folder=one.folder, maps=len(materials[key]))


def _name(path: str, base: str) -> Source:
    """Return the input for a file."""
    if path.startswith(SAMPLE):
        return Source(path, path.removeprefix(SAMPLE))
    inside = os.path.relpath(os.path.dirname(path) or ".", base or ".") if base or not os.path.dirname(path) else ""
    suffix = find_suffix(Path(path))
    name = os.path.basename(path.rstrip("/"))
    folder = "" if inside == "." else inside
    return Source(path, name.removesuffix(suffix), suffix, folder, len(expand_braces(path)))


# --- materials -------------------------------------------------------------------------------------------------------


def find_roles(stems: Mapping[str, str]) -> dict[str, Role]:
    """Return the roles of maps that file names state, by file. Files without a role are omitted."""
    found, _ = guess_roles(list(stems.values()))
    return {path: found[stem] for path, stem in stems.items() if stem in found}


def join_braces(paths: Sequence[str]) -> str:
    """Return one text that names several files of a folder, such as ``in/rock_{albedo,normal}.png``."""
    start = paths[0][: _count_alike(paths)]
    rest = [p[len(start) :] for p in paths]
    end = rest[0][len(rest[0]) - _count_alike([r[::-1] for r in rest]) :]
    text = f"{start}{{{','.join(r[: len(r) - len(end)] for r in rest)}}}{end}"
    if sorted(expand_braces(text)) != sorted(paths):
        raise InvalidInput(
            f"inputs: {paths[0]} and {len(paths) - 1} more files are maps of one material; put them in a folder of "
            "their own"
        )
    return text


def _count_alike(texts: Sequence[str]) -> int:
    """Return the number of characters that all texts have in common at their beginning."""
    return sum(1 for _ in itertools.takewhile(lambda each: len(set(each)) == 1, zip(*texts, strict=False)))


# --- words -----------------------------------------------------------------------------------------------------------


def list_known(source: Source) -> dict[str, str]:
    """Return the values that replace words in braces, by word.

    ``{parent}`` is the folder of the input, ``{parent2}`` the folder above it.
    """
    known = {"input": source.text, "name": source.name, "folder": source.folder or ".", "suffix": source.suffix}
    above = Path(os.path.abspath(source.text.removeprefix(SAMPLE))).parents
    names = [] if source.text.startswith(SAMPLE) else [p.name for p in above]
    return known | {"parent": names[0] if names else ""} | {f"parent{k}": n for k, n in enumerate(names[1:], 2)}


def fill(text: str, known: Mapping[str, str]) -> str:
    """Replace the words in braces in a text. Unknown braces are kept."""
    filled = FIELDS.sub(lambda found: known.get(found[1], ""), text)
    return os.path.normpath(filled) if "{folder}" in text else filled


def _count(several: Sequence[str], what: str) -> str:
    return f"{len(several)} {what}{'s' if len(several) > 1 else ''}"


def _list(several: Sequence[str]) -> str:
    more = f" and {len(several) - SHOWN} more" if len(several) > SHOWN else ""
    return ", ".join(several[:SHOWN]) + more

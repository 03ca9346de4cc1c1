"""What files say beside their values, read and written, whatever their format."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

from texrs._checks import as_instance
from texrs._typing import Path as PathLike
from texrs.errors import FileError
from texrs.io import _chunks, _files, _pillow, _tags, _texts
from texrs.io._formats import detect_kind
from texrs.io._notes import Metadata
from texrs.io._stores import is_store

BLOCK = 2**20
DIGEST = re.compile(r'"content": "[0-9a-f]{64}"')
"""Where a record says what the rest of its file holds."""
BLANK = f'"content": "{"0" * 64}"'
MOST_JPEG = 65_533
"""Bytes of a comment of JPEG."""

_READERS: dict[str, Callable[[Path], dict[str, object]]] = {
    "png": _chunks.read_png,
    "jpeg": _chunks.read_jpeg,
    "webp": _chunks.read_webp,
    "bmp": _chunks.read_bmp,
    "gif": _chunks.read_gif,
    "tiff": _tags.read_tiff,
    "exr": _tags.read_exr,
    "npz": _texts.read_npz,
    "html": _texts.read_html,
    "json": _texts.read_json,
    **{kind: partial(_pillow.read_notes, kind=kind) for kind in ("psd", "avif", "jxl")},
}
_WRITERS: dict[str, Callable[[Path, Metadata], None]] = {
    "png": _chunks.write_png,
    "jpeg": _chunks.write_jpeg,
    "webp": _chunks.write_webp,
    "bmp": _chunks.write_bmp,
    "gif": _chunks.write_gif,
    "tiff": _tags.write_tiff,
    "exr": _tags.write_exr,
    "npz": _texts.write_npz,
    "html": _texts.write_html,
    "json": _texts.write_json,
}
_FINDERS: dict[str, Callable[[Path], tuple[int, int] | None]] = {
    "png": _chunks.find_png,
    "jpeg": _chunks.find_jpeg,
    "gif": _chunks.find_gif,
    "tiff": _tags.find_tiff,
    "exr": _tags.find_exr,
    "html": _texts.find_html,
}
_DIGESTS: dict[str, Callable[[Path], str]] = {"npz": _texts.digest_npz, "json": _texts.digest_json}
_SIDECAR = ("webp", "bmp", "")
"""Kinds of files that have no place for how they were made; a file beside them says it."""
_IN_PLACE = ("tiff", "exr")
_SUFFIXES = {
    ".png": "png",
    ".jpg": "jpeg",
    ".jpeg": "jpeg",
    ".webp": "webp",
    ".bmp": "bmp",
    ".gif": "gif",
    ".tif": "tiff",
    ".tiff": "tiff",
    ".exr": "exr",
    ".npz": "npz",
    ".html": "html",
    ".json": "json",
}


def read_metadata(path: PathLike) -> Metadata:
    """Return what a file says beside its values.

    Parameters
    ----------
    path : path_like
        Any file. Of one that is no picture, or damaged, nothing is known.

    Returns
    -------
    texrs.io.Metadata
        How its colours and its pixels are to be understood, and how texrs made it, where that is so: from the file, or
        from the file of the same name and ``.json`` beside it.

    Raises
    ------
    InvalidInput
        Not a path.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> from texrs import io
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "grey.png")
    ...     io.write(path, np.zeros((8, 8), np.uint8))
    ...     io.write_metadata(path, io.Metadata(gamma=1.0))
    ...     io.read_metadata(path).gamma
    1.0

    """
    name = _files.as_path(path)
    kind = _find_kind(name)
    found: dict[str, object] = {}
    if kind in _READERS:
        # Whatever a file holds, nothing depends on what it says of itself.
        with suppress(Exception):
            found = _READERS[kind](name)
    with suppress(Exception):
        found |= {"multiplied": True} if kind == "exr" and "A" in _tags.list_exr_channels(name) else {}
    with suppress(Exception):
        if (colours := _pillow.read_palette(name, kind)) is not None:
            found["palette"] = colours.tobytes()
    if "made" not in found:
        with suppress(Exception):
            found |= _texts.read_json(name_sidecar(Path(os.path.realpath(name))))
    return Metadata(**found)  # type: ignore[arg-type]


def write_metadata(path: PathLike, notes: Metadata, beside: PathLike | None = None) -> Path | None:
    """Let a file say something beside its values; what its format has no place for is left out.

    Parameters
    ----------
    path : path_like
        A file that was just written: it is changed where it lies.
    notes : Metadata
        What it is to say. ``"content": "000...0"`` in ``made``, of 64 zeros, becomes the SHA-256 of all else in the file.
    beside : path_like, optional
        The name that the file is to have, where ``path`` is a temporary one: a file of that name and ``.json`` takes
        ``made`` where the format cannot.

    Returns
    -------
    pathlib.Path or None
        The file beside it, if there is one.

    Raises
    ------
    FileError
        The file is not of the kind that its suffix says, or cannot be written.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> from texrs import io
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "grey.tif")
    ...     io.write(path, np.zeros((8, 8), np.uint8))
    ...     io.write_metadata(path, io.Metadata(density=(2835.0, 2835.0)))
    ...     [round(d) for d in io.read_metadata(path).density]
    [2835, 2835]

    """
    name = _files.as_path(path)
    kind = _SUFFIXES.get(name.suffix.lower(), "")
    made = as_instance(notes, "notes", Metadata).made
    apart = (
        kind in _SIDECAR
        or (kind == "exr" and not _tags.takes_exr(name))
        or (kind == "jpeg" and len((made or "").encode()) > MOST_JPEG)
    )
    with _files.translate_errors(name, "writing what it says of itself"):
        # Of a table of tags what is said moves what lies around it, so it is said first, and filled in.
        notes = replace(notes, palette=None)
        first = notes if kind in _IN_PLACE and not apart else replace(notes, made=None)
        kind = "" if apart and kind == "exr" else kind
        if kind in _WRITERS and first != Metadata():
            _WRITERS[kind](name, first)
        if made is None:
            return None
        made = made.replace(BLANK, f'"content": "{digest(name)}"') if BLANK in made else made
        if not apart:
            _WRITERS[kind](name, Metadata(made=made))
            return None
    there = name_sidecar(_files.as_path(beside if beside is not None else path))
    with _files.atomic(there) as temporary:
        temporary.write_text(_texts.dump({"texrs": made}), encoding="utf-8")
    return there


def needs_sidecar(path: Path) -> bool:
    """Return whether files of a suffix have no place for how they were made."""
    return _SUFFIXES.get(path.suffix.lower(), "") in _SIDECAR


def name_sidecar(path: Path) -> Path:
    """Return the name of the file that says how one was made that has no place for it."""
    return path.with_name(path.name + ".json")


def is_unchanged(path: PathLike, made: str) -> bool:
    """Return whether a file is as it was when it was said how it was made."""
    stated = DIGEST.search(made)
    return stated is not None and stated[0] == f'"content": "{digest(_files.as_path(path))}"'


def digest(path: Path) -> str:
    """Return the SHA-256 of a file but for what it says of how it was made."""
    kind = _find_kind(path)
    if kind in _DIGESTS:
        return _DIGESTS[kind](path)
    span = _FINDERS[kind](path) if kind in _FINDERS else None
    begin, end = span or (0, 0)
    whole = hashlib.sha256()
    with path.open("rb") as file:
        while part := file.read(min(BLOCK, begin - file.tell())):
            whole.update(part)
        file.seek(end)
        while part := file.read(BLOCK):
            whole.update(part)
    return whole.hexdigest()


def hash_file(path: PathLike) -> str:
    """Return the SHA-256 of a file, or of a store, that of the names and the contents of all its files."""
    if is_store(path):
        files = sorted(p for p in _files.as_path(path).rglob("*") if p.is_file())
        lines = [f"{hash_file(p)} {p.relative_to(path).as_posix()}" for p in files]
        return hashlib.sha256("\n".join(lines).encode()).hexdigest()
    with _files.as_path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _find_kind(path: Path) -> str:
    """Return the kind of a file by its content, or where that says nothing by its suffix."""
    suffix = path.suffix.lower()
    try:
        return detect_kind(path)
    except FileError:
        known = os.path.isfile(path) and suffix in (".html", ".json")
        return _SUFFIXES[suffix] if known else ""

"""Read and write the metadata of files of all formats."""

from __future__ import annotations

import hashlib
import os
import re
import zlib
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from mmap import ACCESS_READ, mmap
from pathlib import Path

from texrs._checks import as_instance
from texrs._typing import Path as PathLike
from texrs.errors import FileError
from texrs.io import _png_chunks, _texts, _tiff, exr_layers, pillow
from texrs.io import files as _files
from texrs.io._notes import Metadata
from texrs.io._zarr import is_store
from texrs.io.formats import detect_kind

DIGEST = re.compile(r'"content": "[0-9a-f]{64}"')
"""Part of a record that contains the digest of the rest of its file."""
BLANK = f'"content": "{"0" * 64}"'
MOST_JPEG = 65_533
"""Maximum size of a JPEG comment in bytes."""

_READERS: dict[str, Callable[[Path], dict[str, object]]] = {
    "tiff": _tiff.read_notes,
    "exr": exr_layers.read_notes,
    "npz": _texts.read_npz,
    "html": _texts.read_html,
    "json": _texts.read_json,
    **{kind: partial(pillow.read_notes, kind=kind) for kind in ("png", *pillow.DECODED)},
}
_WRITERS: dict[str, Callable[[Path, Metadata], None]] = {
    "png": _png_chunks.write_png,
    "jpeg": lambda path, notes: _png_chunks.write_jpeg(path, notes, _read_record(path, "jpeg")),
    "gif": lambda path, notes: _png_chunks.write_gif(path, notes, _read_record(path, "gif")),
    "webp": partial(pillow.write_notes, kind="webp"),
    "bmp": partial(pillow.write_notes, kind="bmp"),
    "tiff": _tiff.write_notes,
    "exr": exr_layers.write_notes,
    "npz": _texts.write_npz,
    "html": _texts.write_html,
    "json": _texts.write_json,
}
_VERBATIM = ("png", "jpeg", "gif", "tiff", "exr")
"""Formats whose files contain the bytes of the record, so that it can be overwritten in place."""
_DIGESTS: dict[str, Callable[[Path], str]] = {
    "npz": _texts.digest_npz,
    "html": _texts.digest_html,
    "json": _texts.digest_json,
}
_SUFFIXES = {f".{kind}": kind for kind in _WRITERS} | {".jpg": "jpeg", ".tif": "tiff"}


def read_metadata(path: PathLike) -> Metadata:
    """Return the metadata of a file: colour profile, density, and the record of how texrs made it.

    Parameters
    ----------
    path : path_like
        File of any format. A damaged file, or a file of an unknown format, gives empty metadata.

    Returns
    -------
    texrs.io.Metadata
        Metadata of the file. The record of how texrs made it is read from the file, or else from a file of the same
        name with ``.json`` appended.

    Raises
    ------
    InvalidInput
        ``path`` is not a path.

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
        # Ignore damaged metadata, because no result depends on them.
        with suppress(Exception):
            found = {key: value for key, value in _READERS[kind](name).items() if value is not None}
    with suppress(Exception):
        if (colours := pillow.read_palette(name, kind)) is not None:
            found["palette"] = colours.tobytes()
    if "made" not in found:
        with suppress(Exception):
            found |= _texts.read_json(name_sidecar(Path(os.path.realpath(name))))
    return Metadata(**found)  # type: ignore[arg-type]


def write_metadata(path: PathLike, notes: Metadata, beside: PathLike | None = None) -> Path | None:
    """Write metadata into a file, as far as its format can store them.

    Parameters
    ----------
    path : path_like
        File that was just written. It is changed in place.
    notes : Metadata
        Metadata to write. If ``made`` contains ``"content": "000...0"`` with 64 zeros, these become the SHA-256 of the
        rest of the file.
    beside : path_like, optional
        Final name of the file if ``path`` is temporary. If the format cannot store ``made``, it is written to a file
        of this name with ``.json`` appended. Default: ``path``.

    Returns
    -------
    pathlib.Path or None
        Path of the ``.json`` file, or None if none was written.

    Raises
    ------
    FileError
        The content does not fit the suffix, or the file cannot be written.

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
    notes = replace(as_instance(notes, "notes", Metadata), palette=None, multiplied=False)
    made = notes.made
    apart = needs_sidecar(name) or (kind == "jpeg" and len((made or "").encode()) > MOST_JPEG)
    with _files.translate_errors(name, "writing its metadata"):
        if made is not None and kind in _DIGESTS:
            made = _fill_in(name, made)
        inside = replace(notes, made=None if apart else made)
        if kind in _WRITERS and inside != Metadata():
            _WRITERS[kind](name, inside)
        if made is None:
            return None
        if not apart:
            # The digest excludes the record itself, so first write the record with zeros, and then overwrite them with
            # the digest of the rest.
            if BLANK in made:
                _replace_record(name, kind, made, _fill_in(name, made))
            return None
        made = _fill_in(name, made)
    there = name_sidecar(_files.as_path(beside if beside is not None else path))
    with _files.atomic(there) as temporary:
        temporary.write_text(_texts.dump({"texrs": made}), encoding="utf-8")
    return there


def _fill_in(path: Path, made: str) -> str:
    """Return a record whose zeros are replaced by the digest of the rest of its file."""
    return made.replace(BLANK, f'"content": "{digest(path)}"') if BLANK in made else made


def _read_record(path: Path, kind: str) -> bytes:
    """Return the bytes of the record in a file, or empty bytes if there is none."""
    with suppress(Exception):
        return _png_chunks.encode_record(kind, str(_READERS[kind](path).get("made") or ""))
    return b""


def _replace_record(path: Path, kind: str, former: str, made: str) -> None:
    """Overwrite the record in a file with a record of the same length."""
    record = _png_chunks.encode_record(kind, made)
    with path.open("r+b") as file:
        with mmap(file.fileno(), 0, access=ACCESS_READ) as data:
            file.seek(data.find(_png_chunks.encode_record(kind, former)))
        file.write(record)
        if kind == "png":
            file.write(zlib.crc32(b"iTXt" + _png_chunks.KEYWORD + record).to_bytes(4, "big"))


def needs_sidecar(path: Path) -> bool:
    """Return True if a file with this suffix cannot contain a record, so that it needs a ``.json`` file next to it."""
    return _SUFFIXES.get(path.suffix.lower(), "") not in (*_VERBATIM, *_DIGESTS)


def name_sidecar(path: Path) -> Path:
    """Return the name of the ``.json`` file that contains the record of a file."""
    return path.with_name(path.name + ".json")


def is_unchanged(path: PathLike, made: str) -> bool:
    """Return True if the digest in a record still matches the content of its file."""
    stated = DIGEST.search(made)
    return stated is not None and stated[0] == f'"content": "{digest(_files.as_path(path))}"'


def digest(path: Path) -> str:
    """Return the SHA-256 of a file without its record."""
    kind = _find_kind(path)
    if kind in _DIGESTS:
        return _DIGESTS[kind](path)
    record = _read_record(path, kind) if kind in _VERBATIM else b""
    with path.open("rb") as file, mmap(file.fileno(), 0, access=ACCESS_READ) as data, memoryview(data) as view:
        begin = max(data.find(record), 0)
        # In PNG, leave out the checksum of the chunk, which follows its text.
        end = begin + len(record) + 4 * (kind == "png") if begin else 0
        whole = hashlib.sha256(view[:begin])
        whole.update(view[end:])
    return whole.hexdigest()


def hash_file(path: PathLike) -> str:
    """Return the SHA-256 of a file, or of the names and contents of all files of a store."""
    if is_store(path):
        files = sorted(p for p in _files.as_path(path).rglob("*") if p.is_file())
        lines = [f"{hash_file(p)} {p.relative_to(path).as_posix()}" for p in files]
        return hashlib.sha256("\n".join(lines).encode()).hexdigest()
    with _files.as_path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _find_kind(path: Path) -> str:
    """Return the format of a file according to its content, or else to its suffix."""
    suffix = path.suffix.lower()
    try:
        return detect_kind(path)
    except FileError:
        known = os.path.isfile(path) and suffix in (".html", ".json")
        return _SUFFIXES[suffix] if known else ""

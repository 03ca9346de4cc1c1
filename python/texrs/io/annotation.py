"""Read the metadata of files of all formats, and record how texrs made a file."""

from __future__ import annotations

import hashlib
import os
import re
import zlib
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from mmap import ACCESS_READ, mmap
from pathlib import Path

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

_READERS: dict[str, Callable[[Path], dict[str, object]]] = {
    "tiff": _tiff.read_notes,
    "exr": exr_layers.read_notes,
    "json": _texts.read_json,
    **{kind: partial(pillow.read_notes, kind=kind) for kind in ("png", *pillow.DECODED)},
}
_WRITERS: dict[str, Callable[[Path, str], None]] = {
    "png": _png_chunks.write_record,
    "tiff": _tiff.write_record,
    "exr": exr_layers.write_record,
    "json": _texts.write_record,
}
"""Formats whose files contain the bytes of the record, so that it can be overwritten in place."""


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
    ...     io.write(path, np.zeros((8, 8), np.uint8), notes=io.Metadata(gamma=1.0))
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


def write_record(path: Path, made: str, beside: Path | None = None) -> None:
    """Write the record of how texrs made a file into the file, or into a ``.json`` file next to it.

    PNG, TIFF, EXR and JSON files contain the record. 64 zeros in ``"content": "000...0"`` become the SHA-256 of the
    rest of the file. ``beside`` is the final name of the file if ``path`` is temporary.
    """
    with _files.translate_errors(path, "writing its metadata"):
        kind = _find_suffix_kind(path)
        if kind in _WRITERS:
            # The digest excludes the record itself, so first write the record with zeros, and then overwrite them with
            # the digest of the rest.
            _WRITERS[kind](path, made)
            if BLANK in made:
                _replace_record(path, kind, made, _fill_in(path, made))
            return
        with _files.atomic(name_sidecar(beside or path)) as temporary:
            temporary.write_text(_texts.dump({"texrs": _fill_in(path, made)}), encoding="utf-8")


def _fill_in(path: Path, made: str) -> str:
    """Return a record whose zeros are replaced by the digest of the rest of its file."""
    return made.replace(BLANK, f'"content": "{digest(path)}"') if BLANK in made else made


def _replace_record(path: Path, kind: str, former: str, made: str) -> None:
    """Overwrite the record in a file with a record of the same length."""
    with path.open("r+b") as file:
        with mmap(file.fileno(), 0, access=ACCESS_READ) as data:
            file.seek(data.find(former.encode()))
        file.write(made.encode())
        if kind == "png":
            file.write(zlib.crc32(b"iTXt" + _png_chunks.KEYWORD + made.encode()).to_bytes(4, "big"))


def _find_suffix_kind(path: Path) -> str:
    """Return the format that a suffix stands for, in lower case and without a dot."""
    suffix = path.suffix.lower()
    return {".tif": "tiff"}.get(suffix, suffix[1:])


def needs_sidecar(path: Path) -> bool:
    """Return True if a file with this suffix cannot contain a record, so that it needs a ``.json`` file next to it."""
    return _find_suffix_kind(path) not in _WRITERS


def name_sidecar(path: Path) -> Path:
    """Return the name of the ``.json`` file that contains the record of a file."""
    return path.with_name(path.name + ".json")


def is_unchanged(path: PathLike, made: str) -> bool:
    """Return True if the digest in a record still matches the content of its file."""
    stated = DIGEST.search(made)
    return stated is not None and stated[0] == f'"content": "{digest(_files.as_path(path))}"'


def digest(path: Path) -> str:
    """Return the SHA-256 of a file without its record."""
    kind, record = _find_kind(path), b""
    if kind in _WRITERS:
        with suppress(Exception):
            record = str(_READERS[kind](path).get("made") or "").encode()
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
    try:
        return detect_kind(path)
    except FileError:
        return "json" if path.suffix.lower() == ".json" and os.path.isfile(path) else ""

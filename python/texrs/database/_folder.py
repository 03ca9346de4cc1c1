"""Manage the folder of a database: one file per texture, and a manifest that can be rebuilt from these files."""

from __future__ import annotations

import json
import os
import re
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from texrs import io
from texrs._typing import Array
from texrs.elements import FORMAT, ElementAnalysis, ElementSearch, Layout, hash_image, load
from texrs.errors import FileError, InvalidInput, TexrsError

MANIFEST, LOCK = "manifest.json", ".lock"
VERSION = 2
"""Version of the format of the manifest."""
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}")
PATIENCE, PAUSE = 60.0, 0.05
"""Maximum time to wait for the lock of another process, and time between two attempts, in seconds."""


@dataclass(frozen=True, slots=True)
class Record:
    """Description of a texture in the manifest."""

    name: str
    file: str
    """Name of the texture's file in the folder."""
    image: str
    """Path of the image, relative to the folder or absolute."""
    hash: str
    version: int
    layout: Layout
    box: tuple[int, ...]
    elements: int
    options: Mapping[str, Any] = field(repr=False)
    """Options of `texrs.elements.analyse` for this texture."""


class Folder:
    """Folder of a database, with the operations that change its manifest and its files."""

    def __init__(self, path: FilePath, log: Callable[[str], object] | None) -> None:
        self.path, self._say, self._made = path, log, False
        if not path.is_dir() and (path.exists() or not path.parent.is_dir()):
            raise FileError(f"{path}: must be a folder, or a new name in an existing folder")

    def keep(
        self,
        name: str,
        entry: ElementAnalysis,
        image: str,
        options: Mapping[str, Any],
        *,
        pixels: Array | None = None,
        replace_other: bool = True,
    ) -> ElementAnalysis:
        """Write an entry and its record. If ``pixels`` are given, write them to the file ``image`` as well."""
        plain = {k: _to_plain(v) for k, v in options.items()}
        # Store everything that the manifest contains, so that a lost manifest can be rebuilt.
        entry = replace(entry, report={**entry.report, "database": {"image": image, "options": plain}})
        file = f"{name}.npz"
        record = _record_of(name, file, entry)
        with self._lock_manifest():
            found = self._parse()
            found = self._scan() if found is None else found
            # Another process may have taken the name during the analysis.
            if not replace_other:
                check_free(found, name, record.hash)
            if pixels is not None:
                io.write(self.path / image, pixels)
            entry.save(self.path / file)
            found[name] = record
            self._write(found)
        return entry

    def drop(self, name: str) -> bool:
        """Remove a texture, and the copy of its pixels if there is one. Return True if the texture existed."""
        if not self.path.is_dir():
            return False
        with self._lock_manifest():
            found = self._parse()
            found = self._scan() if found is None else found
            record = found.pop(name, None)
            if record is None:
                return False
            # Write the manifest first: a leftover file is harmless, but an entry without its file would be damaged.
            self._write(found)
            pixels = f"{name}.npy" if record.image == f"{name}.npy" else None
            for file in (record.file, f"{record.file}.json", pixels):
                if file is not None:
                    (self.path / file).unlink(missing_ok=True)
        return True

    def read(self) -> dict[str, Record]:
        """Read the manifest, or rebuild it from the entries if it is damaged."""
        found = self._parse()
        if found is None:
            with self._lock_manifest():
                found = self._parse()
                if found is None:
                    found = self._scan()
                    self.warn(f"{self.path / MANIFEST}: was damaged, so it was rebuilt from {len(found)} entries")
                    self._write(found)
        return found

    def _parse(self) -> dict[str, Record] | None:
        try:
            text = (self.path / MANIFEST).read_text(encoding="utf-8")
        except FileNotFoundError:
            # If there are entries, the manifest was lost. Otherwise the database is new.
            return None if any(self.path.glob("*.npz")) else {}
        except (OSError, UnicodeDecodeError):
            return None
        try:
            table = json.loads(text)
            version = int(table.get("version", 1))
            if version != VERSION:
                raise FileError(
                    f"{self.path / MANIFEST}: has version {version}, but this texrs reads version {VERSION}; "
                    "add the textures to a new folder"
                )
            return {name: _read_record(name, item) for name, item in table["textures"].items()}
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError, OverflowError):
            return None

    def _scan(self) -> dict[str, Record]:
        found = {}
        for file in sorted(self.path.glob("*.npz")):
            with suppress(TexrsError):
                if NAME.fullmatch(file.stem):
                    found[file.stem] = _record_of(file.stem, file.name, load(file))
        return found

    def _write(self, found: Mapping[str, Record]) -> None:
        table = {
            "version": VERSION,
            "textures": {
                name: {key: value for key, value in asdict(record).items() if key != "name"}
                for name, record in sorted(found.items())
            },
        }
        with io.atomic(self.path / MANIFEST) as temporary:
            temporary.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")

    @contextmanager
    def _lock_manifest(self) -> Iterator[None]:
        """Lock the manifest during a block, against changes by other processes and threads."""
        number, end = self._open_lock(), time.monotonic() + PATIENCE
        try:
            while not (_lock_file(number) and self._is_lock(number)):
                if time.monotonic() > end:
                    raise FileError(f"{self.path}: another process has locked this folder for {PATIENCE:g} s")
                time.sleep(PAUSE)
                if not self._is_lock(number):
                    # The process that held the lock has removed its empty folder, so create the folder again.
                    os.close(number)
                    number = self._open_lock()
            yield
        finally:
            # After a failure, remove the folder if this process created it and it is empty.
            if self._made and os.name == "posix" and self._is_lock(number) and os.listdir(self.path) == [LOCK]:
                with suppress(OSError):
                    (self.path / LOCK).unlink()
                    self.path.rmdir()
            os.close(number)

    def _open_lock(self) -> int:
        """Open the lock file, and create the folder if it is missing."""
        for _ in range(100):
            try:
                with suppress(FileExistsError):
                    self.path.mkdir()
                    self._made = True
                return os.open(self.path / LOCK, os.O_RDWR | os.O_CREAT, 0o666)
            except FileNotFoundError:
                # Another process removed the folder after it was created, so try again.
                continue
            except OSError as error:
                raise FileError(f"{self.path}: cannot be written to ({error.strerror})") from None
        raise FileError(f"{self.path}: other processes keep creating and removing the folder")

    def _is_lock(self, number: int) -> bool:
        """Return True if an open file is still the lock file of the folder."""
        with suppress(OSError):
            return os.path.samestat(os.fstat(number), os.stat(self.path / LOCK))
        return False

    def warn(self, sentence: str) -> None:
        """Report that a damaged or outdated file was rebuilt."""
        if self._say is not None:
            self._say(sentence)
        else:
            warnings.warn(sentence, stacklevel=5)


def check_free(found: Mapping[str, Record], name: str, hash: str) -> None:
    """Raise an error if another image is already stored under a name."""
    if name in found and found[name].hash != hash:
        raise InvalidInput(f"name: {name} exists already with another image; pass replace=True to replace it")


def _lock_file(number: int) -> bool:
    """Lock an open file, and return True on success. The lock ends when the file is closed or the process dies."""
    try:
        try:
            import fcntl
        except ImportError:  # Windows
            import msvcrt

            locking: Any = msvcrt
            locking.locking(number, locking.LK_NBLCK, 1)
        else:
            fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _record_of(name: str, file: str, entry: ElementAnalysis) -> Record:
    kept = entry.report.get("database", {})
    box = tuple(int(n) for n in entry.report.get("box", (0, 0, *entry.box)))
    image, options = str(kept.get("image", "")), dict(kept.get("options", {}))
    return Record(name, file, image, hash_image(entry.image), FORMAT, entry.layout, box, len(entry.points), options)


def _read_record(name: str, item: Mapping[str, Any]) -> Record:
    # Accept only names of files in this folder, because a damaged manifest could contain a path or "..".
    if not NAME.fullmatch(name) or not re.fullmatch(rf"{NAME.pattern}\.npz", item["file"]):
        raise ValueError(name)
    return Record(
        name,
        str(item["file"]),
        str(item["image"]),
        str(item["hash"]),
        int(item["version"]),
        Layout(item["layout"]),
        tuple(int(n) for n in item["box"]),
        int(item["elements"]),
        dict(item["options"]),
    )


def _to_plain(value: Any) -> Any:
    """Return an option as JSON types. Masks are stored by the positions where their value changes."""
    if isinstance(value, np.ndarray) and value.dtype.kind in "b" and value.ndim == 2:
        changes = np.flatnonzero(np.diff(value.ravel().astype(np.int8), prepend=0))
        return {"shape": list(value.shape), "changes": changes.tolist()}
    if isinstance(value, ElementSearch):
        return {k: _to_plain(v) for k, v in asdict(value).items()}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Sequence) and not isinstance(value, str | bytes):
        return [_to_plain(v) for v in value]
    return value


def restore_option(value: Any) -> Any:
    """Return an option in the form that it had before `_to_plain`."""
    if isinstance(value, dict) and "shape" not in value:
        return ElementSearch(**value)
    if isinstance(value, dict):
        rows, columns = (int(n) for n in value["shape"])
        steps = np.zeros(rows * columns, np.int8)
        steps[value["changes"]] = 1
        return (np.cumsum(steps) % 2).astype(bool).reshape(rows, columns)
    return value

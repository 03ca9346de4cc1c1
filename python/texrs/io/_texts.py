"""Records of how texrs made archives of arrays, pages and reports."""

from __future__ import annotations

import hashlib
import json
import re
import zipfile
from pathlib import Path
from typing import Any

from texrs.io._notes import Metadata

MEMBER = "texrs.json"
_COMMENT = re.compile(rb"<!-- texrs ((?:(?!--).)*) -->\n\Z", re.DOTALL)


def dump(values: dict[str, Any]) -> str:
    """Return an object as JSON. The record is already JSON, and is put on one line."""
    made = values.get("texrs")
    rest = {key: value for key, value in values.items() if key != "texrs"}
    text = json.dumps(rest, indent=2)
    if made is None:
        return text + "\n"
    return (text[:-2] + f',\n  "texrs": {made}\n}}\n') if rest else f'{{\n  "texrs": {made}\n}}\n'


def read_json(path: Path) -> dict[str, Any]:
    """Return the record in a report, or in a file of its own."""
    values = json.loads(path.read_text(encoding="utf-8"))
    made = values.get("texrs") if isinstance(values, dict) else None
    return {"made": json.dumps(made)} if isinstance(made, dict) else {}


def write_json(path: Path, notes: Metadata) -> None:
    """Add a record to a report."""
    values = json.loads(path.read_text(encoding="utf-8"))
    if notes.made is not None and isinstance(values, dict):
        path.write_text(dump({**values, "texrs": notes.made}), encoding="utf-8")


def digest_json(path: Path) -> str:
    """Return the SHA-256 of a report without its record."""
    values = json.loads(path.read_text(encoding="utf-8"))
    rest = {key: value for key, value in values.items() if key != "texrs"} if isinstance(values, dict) else values
    return hashlib.sha256(json.dumps(rest).encode()).hexdigest()


def read_npz(path: Path) -> dict[str, Any]:
    """Return the record in an archive."""
    with zipfile.ZipFile(path) as archive:
        if MEMBER not in archive.namelist():
            return {}
        member = archive.getinfo(MEMBER)
        # Python unpacks other compressions as a whole.
        if member.file_size > 2**24 or member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            return {}
        return {"made": archive.read(MEMBER).decode("utf-8")}


def write_npz(path: Path, notes: Metadata) -> None:
    """Add a record to an archive, or replace its record."""
    if notes.made is None:
        return
    with zipfile.ZipFile(path) as archive:
        there = MEMBER in archive.namelist()
        kept = [(m, archive.read(m)) for m in archive.infolist() if m.filename != MEMBER] if there else []
    with zipfile.ZipFile(path, "w" if there else "a") as archive:
        for member, data in kept:
            archive.writestr(member, data)
        # Without a date, so that the same input gives the same bytes.
        archive.writestr(zipfile.ZipInfo(MEMBER), notes.made)


def digest_npz(path: Path) -> str:
    """Return the SHA-256 of the checksums of the arrays in an archive."""
    with zipfile.ZipFile(path) as archive:
        parts = [f"{m.filename} {m.CRC} {m.file_size}" for m in archive.infolist() if m.filename != MEMBER]
        whole = hashlib.sha256("\n".join(parts).encode())
    return whole.hexdigest()


def read_html(path: Path) -> dict[str, Any]:
    """Return the record of a page."""
    found = _COMMENT.search(path.read_bytes())
    return {"made": found[1].decode("utf-8")} if found else {}


def write_html(path: Path, notes: Metadata) -> None:
    """Put a comment at the end of a page."""
    if notes.made is not None:
        # A comment cannot contain two dashes.
        text = notes.made.replace("--", "\\u002d\\u002d").encode()
        path.write_bytes(_COMMENT.sub(b"", path.read_bytes()) + b"<!-- texrs " + text + b" -->\n")


def digest_html(path: Path) -> str:
    """Return the SHA-256 of a page without the record."""
    return hashlib.sha256(_COMMENT.sub(b"", path.read_bytes())).hexdigest()

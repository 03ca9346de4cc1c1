"""Read and write the record of how texrs made an .npz, HTML or JSON file."""

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
    """Return a dictionary as JSON text. The value of "texrs", a record, is already JSON and stays on one line."""
    made = values.get("texrs")
    rest = {key: value for key, value in values.items() if key != "texrs"}
    text = json.dumps(rest, indent=2)
    if made is None:
        return text + "\n"
    return (text[:-2] + f',\n  "texrs": {made}\n}}\n') if rest else f'{{\n  "texrs": {made}\n}}\n'


def read_json(path: Path) -> dict[str, Any]:
    """Return the record in a JSON report, or in a ``.json`` file next to an image."""
    values = json.loads(path.read_text(encoding="utf-8"))
    made = values.get("texrs") if isinstance(values, dict) else None
    return {"made": json.dumps(made)} if isinstance(made, dict) else {}


def write_json(path: Path, notes: Metadata) -> None:
    """Add a record to a JSON report."""
    values = json.loads(path.read_text(encoding="utf-8"))
    if notes.made is not None and isinstance(values, dict):
        path.write_text(dump({**values, "texrs": notes.made}), encoding="utf-8")


def digest_json(path: Path) -> str:
    """Return the SHA-256 of a JSON report without its record."""
    values = json.loads(path.read_text(encoding="utf-8"))
    rest = {key: value for key, value in values.items() if key != "texrs"} if isinstance(values, dict) else values
    return hashlib.sha256(json.dumps(rest).encode()).hexdigest()


def read_npz(path: Path) -> dict[str, Any]:
    """Return the record in an .npz file."""
    with zipfile.ZipFile(path) as archive:
        if MEMBER not in archive.namelist():
            return {}
        member = archive.getinfo(MEMBER)
        # Ignore other compressions, because Python would unpack them completely.
        if member.file_size > 2**24 or member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            return {}
        return {"made": archive.read(MEMBER).decode("utf-8")}


def write_npz(path: Path, notes: Metadata) -> None:
    """Add a record to an .npz file, or replace its record."""
    if notes.made is None:
        return
    with zipfile.ZipFile(path) as archive:
        there = MEMBER in archive.namelist()
        kept = [(m, archive.read(m)) for m in archive.infolist() if m.filename != MEMBER] if there else []
    with zipfile.ZipFile(path, "w" if there else "a") as archive:
        for member, data in kept:
            archive.writestr(member, data)
        # Write no date, so that the same input gives the same bytes.
        archive.writestr(zipfile.ZipInfo(MEMBER), notes.made)


def digest_npz(path: Path) -> str:
    """Return the SHA-256 of the names, checksums and sizes of the arrays in an .npz file."""
    with zipfile.ZipFile(path) as archive:
        parts = [f"{m.filename} {m.CRC} {m.file_size}" for m in archive.infolist() if m.filename != MEMBER]
        whole = hashlib.sha256("\n".join(parts).encode())
    return whole.hexdigest()


def read_html(path: Path) -> dict[str, Any]:
    """Return the record in an HTML page."""
    found = _COMMENT.search(path.read_bytes())
    return {"made": found[1].decode("utf-8")} if found else {}


def write_html(path: Path, notes: Metadata) -> None:
    """Write a record as a comment at the end of an HTML page."""
    if notes.made is not None:
        # An HTML comment cannot contain two consecutive hyphens, so escape them.
        text = notes.made.replace("--", "\\u002d\\u002d").encode()
        path.write_bytes(_COMMENT.sub(b"", path.read_bytes()) + b"<!-- texrs " + text + b" -->\n")


def digest_html(path: Path) -> str:
    """Return the SHA-256 of an HTML page without the record."""
    return hashlib.sha256(_COMMENT.sub(b"", path.read_bytes())).hexdigest()

"""How archives of arrays, pages and reports say how they were made."""

from __future__ import annotations

import hashlib
import json
import zipfile
from pathlib import Path
from typing import Any

from texrs.io._notes import Metadata

MEMBER = "texrs.json"
_BEGIN, _END = b"<!-- texrs ", b" -->\n"


def dump(values: dict[str, Any]) -> str:
    """Return an object as JSON; what says how it was made is JSON itself and stands in one line."""
    made = values.get("texrs")
    rest = {key: value for key, value in values.items() if key != "texrs"}
    text = json.dumps(rest, indent=2)
    if made is None:
        return text + "\n"
    return (text[:-2] + f',\n  "texrs": {made}\n}}\n') if rest else f'{{\n  "texrs": {made}\n}}\n'


def read_json(path: Path) -> dict[str, Any]:
    """Return how a report was made, or the file that this one lies beside."""
    values = json.loads(path.read_text(encoding="utf-8"))
    made = values.get("texrs") if isinstance(values, dict) else None
    return {"made": json.dumps(made)} if isinstance(made, dict) else {}


def write_json(path: Path, notes: Metadata) -> None:
    """Add to a report how it was made."""
    values = json.loads(path.read_text(encoding="utf-8"))
    if notes.made is not None and isinstance(values, dict):
        path.write_text(dump({**values, "texrs": notes.made}), encoding="utf-8")


def digest_json(path: Path) -> str:
    """Return the SHA-256 of a report but for how it was made."""
    values = json.loads(path.read_text(encoding="utf-8"))
    rest = {key: value for key, value in values.items() if key != "texrs"} if isinstance(values, dict) else values
    return hashlib.sha256(json.dumps(rest).encode()).hexdigest()


def read_npz(path: Path) -> dict[str, Any]:
    """Return how an archive was made."""
    with zipfile.ZipFile(path) as archive:
        if MEMBER not in archive.namelist():
            return {}
        member = archive.getinfo(MEMBER)
        # By other packings Python unpacks more than is asked for.
        if member.file_size > 2**24 or member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            return {}
        return {"made": archive.read(MEMBER).decode("utf-8")}


def write_npz(path: Path, notes: Metadata) -> None:
    """Add a member to an archive, or put it in place of the one that was added last."""
    if notes.made is None:
        return
    with zipfile.ZipFile(path, "a") as archive:
        there = MEMBER in archive.namelist()
        if not there:
            # Without a date: the same is made of the same.
            archive.writestr(zipfile.ZipInfo(MEMBER), notes.made)
    if there:
        with zipfile.ZipFile(path) as archive:
            kept = [(m, archive.read(m)) for m in archive.infolist() if m.filename != MEMBER]
        with zipfile.ZipFile(path, "w") as archive:
            for member, data in kept:
                archive.writestr(member, data)
            archive.writestr(zipfile.ZipInfo(MEMBER), notes.made)


def digest_npz(path: Path) -> str:
    """Return the SHA-256 of what the arrays of an archive are."""
    with zipfile.ZipFile(path) as archive:
        parts = [f"{m.filename} {m.CRC} {m.file_size}" for m in archive.infolist() if m.filename != MEMBER]
        whole = hashlib.sha256("\n".join(parts).encode())
    return whole.hexdigest()


def read_html(path: Path) -> dict[str, Any]:
    """Return how a page was made."""
    span = find_html(path)
    if span is None:
        return {}
    return {"made": path.read_bytes()[span[0] + len(_BEGIN) : span[1] - len(_END)].decode("utf-8")}


def write_html(path: Path, notes: Metadata) -> None:
    """Put a comment at the end of a page."""
    if notes.made is None:
        return
    data, span = path.read_bytes(), find_html(path)
    if span is not None:
        data = data[: span[0]] + data[span[1] :]
    # A comment may not hold two dashes.
    text = notes.made.replace("--", "\\u002d\\u002d").encode()
    path.write_bytes(data + _BEGIN + text + _END)


def find_html(path: Path) -> tuple[int, int] | None:
    """Return where the comment lies that says how a page was made."""
    data = path.read_bytes()
    start = data.rfind(_BEGIN)
    return None if start < 0 or not data.endswith(_END) else (start, len(data))

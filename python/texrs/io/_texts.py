"""Read and write the record of how texrs made a file as JSON: in a report, or in a file next to an image."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


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


def write_record(path: Path, made: str) -> None:
    """Add a record to a JSON report."""
    values = json.loads(path.read_text(encoding="utf-8"))
    if isinstance(values, dict):
        path.write_text(dump({**values, "texrs": made}), encoding="utf-8")

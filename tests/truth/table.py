"""The table: its cases by name, and the stored line of each part of a result."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from texrs import Synthesis

Parts = Mapping[str, Any]
"""Arrays and JSON values, by name."""
Lines = dict[str, dict[str, str]]
"""Stored lines: for each case, a line for each of its parts."""
BAR = " | "
"""Separator between a digest and its description."""
LONG = 120
"""Maximum length of a part that is not an array and is stored whole, in characters."""

STORED = Path(__file__).with_name("digests.json")
CASES: dict[str, Callable[[], Parts]] = {}


def case(make: Callable[[], Parts]) -> Callable[[], Parts]:
    """Add a function to the table under its own name."""
    assert make.__name__ not in CASES, f"two cases are named {make.__name__}"
    CASES[make.__name__] = make
    return make


def parts_of(result: Synthesis, *, report: Sequence[str] = (), stages: Sequence[str] = ()) -> dict[str, Any]:
    """Return the parts of a verb's result: the image, the source map, and the named stages and report values."""
    source = result.source_map
    return {
        "image": result.image,
        "coordinates": source.coordinates,
        "exemplar": source.exemplar,
        "label": source.label,
        "jacobian": source.jacobian_array(),
        **{f"stage {name}": result.stages[name] for name in stages},
        **{f"report {name}": result.report[name] for name in report},
    }


def witness(parts: Parts) -> dict[str, str]:
    """Return the line to store for each part of a result."""
    return {name: line(part) for name, part in parts.items()}


def line(part: Any) -> str:
    """Return a part in short: whole if it is short, else a digest with a description for people."""
    if isinstance(part, np.ndarray):
        little = np.ascontiguousarray(part, part.dtype.newbyteorder("<"))
        mean = f"{part.mean(dtype=np.float64):.6f}" if part.size else "none"
        shape = "x".join(map(str, part.shape))
        return digest(f"{part.dtype.name} {shape}", little.tobytes()) + f"{BAR}{part.dtype.name} {shape} mean {mean}"
    text = json.dumps(plain(part))
    return text if len(text) <= LONG else digest("json", text.encode()) + f"{BAR}{text[: LONG - 40]}..."


def digest(kind: str, content: bytes) -> str:
    """Return a digest of bytes and their description."""
    return hashlib.blake2b(kind.encode() + b"\0" + content, digest_size=16).hexdigest()


def plain(value: Any) -> Any:
    """Return a value as JSON: floats to six significant digits, and only values of mappings, whose keys are words."""
    if isinstance(value, Mapping):
        value = list(value.values())
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    value = value.item() if isinstance(value, np.generic) else value
    return float(f"{value:.6g}") if isinstance(value, float) else value


def differences(stored: Mapping[str, str], found: Mapping[str, str]) -> list[str]:
    """Return a sentence for each part that differs."""
    sentences = []
    for name in sorted(stored.keys() | found.keys()):
        if name not in found or name not in stored:
            sentences.append(f"{name}: {'is gone' if name not in found else 'is not stored'}")
        # Ignore the description for people, because the sum of a mean depends on the processor.
        elif stored[name].split(BAR)[0] != found[name].split(BAR)[0]:
            sentences.append(f"{name}: stored {stored[name]}, now {found[name]}")
    return sentences


def read() -> Lines:
    """Return the stored table, or an empty one."""
    return json.loads(STORED.read_text(encoding="utf-8")) if STORED.exists() else {}


def write(lines: Lines) -> None:
    """Store the table, replacing the former one."""
    # Use a name of this process, because several processes may write the same table at once.
    whole = STORED.with_name(f"{STORED.name}.{os.getpid()}")
    whole.write_text(json.dumps(lines, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    whole.replace(STORED)

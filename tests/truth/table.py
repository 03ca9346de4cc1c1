"""The table: its cases by name, and the line that is stored of each part of a result."""

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
"""Arrays, and what JSON can hold, by name."""
Lines = dict[str, dict[str, str]]
"""What is stored: of each case, a line of each of its parts."""
BAR = " | "
"""Between a digest and what it is of."""
LONG = 120
"""Characters up to which a part that is no array is stored whole."""

STORED = Path(__file__).with_name("digests.json")
CASES: dict[str, Callable[[], Parts]] = {}


def case(make: Callable[[], Parts]) -> Callable[[], Parts]:
    """Enter a function into the table under its own name."""
    assert make.__name__ not in CASES, f"two cases are named {make.__name__}"
    CASES[make.__name__] = make
    return make


def parts_of(result: Synthesis, *, report: Sequence[str] = (), stages: Sequence[str] = ()) -> dict[str, Any]:
    """Return the parts of what a verb returns: the image, the source map, and the stages and figures that are named."""
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
    """Return the line that is stored of each part of a result."""
    return {name: line(part) for name, part in parts.items()}


def line(part: Any) -> str:
    """Return a part in short: whole where that is short, else a digest, and after it, for people, what it is of."""
    if isinstance(part, np.ndarray):
        little = np.ascontiguousarray(part, part.dtype.newbyteorder("<"))
        mean = f"{part.mean(dtype=np.float64):.6f}" if part.size else "none"
        shape = "x".join(map(str, part.shape))
        return digest(f"{part.dtype.name} {shape}", little.tobytes()) + f"{BAR}{part.dtype.name} {shape} mean {mean}"
    text = json.dumps(plain(part))
    return text if len(text) <= LONG else digest("json", text.encode()) + f"{BAR}{text[: LONG - 40]}..."


def digest(kind: str, content: bytes) -> str:
    """Return a digest of bytes and of what they are."""
    return hashlib.blake2b(kind.encode() + b"\0" + content, digest_size=16).hexdigest()


def plain(value: Any) -> Any:
    """Return a value as JSON knows it: floats to six significant digits, of mappings the values, for keys are only words."""
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
        # What is there for people does not count: how a mean is summed hangs on the processor.
        elif stored[name].split(BAR)[0] != found[name].split(BAR)[0]:
            sentences.append(f"{name}: stored {stored[name]}, now {found[name]}")
    return sentences


def read() -> Lines:
    """Return the stored table; an empty one where there is none."""
    return json.loads(STORED.read_text(encoding="utf-8")) if STORED.exists() else {}


def write(lines: Lines) -> None:
    """Store the table in the place of the former one."""
    # Several processes may do so at once; each writes the same.
    whole = STORED.with_name(f"{STORED.name}.{os.getpid()}")
    whole.write_text(json.dumps(lines, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    whole.replace(STORED)

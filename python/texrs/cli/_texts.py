"""Convert texts on the command line to values: sizes, axes, numbers, points and edits."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from texrs._arrays import as_size
from texrs._typing import Array
from texrs.errors import FileError, InvalidInput

FOUND = "found"
"""Word that replaces a value of a plane if texrs must find the value."""
PLANE = "plane:"
"""Prefix of the words that describe a plane."""


@dataclass(frozen=True, slots=True)
class About:
    """Context for converting the text of an option."""

    option: str = ""
    """Name of the option in errors."""
    axes: int = 2
    first: str = ""
    """Text of the first argument, usually the name of the example."""
    size: tuple[int, ...] = ()
    """Size of the result, once it is known."""
    like: Array | None = None
    """Exemplar, once it is read."""
    spacing: tuple[float, ...] | None = None
    """Voxel spacing of the exemplar, (plane, row, column), if it is stated."""
    roles: Mapping[str, str] = field(default_factory=dict)
    """Roles of the maps of a material, by name."""


def parse_size(text: str, option: str = "--size", *, axes: int = 2, limit: int | None = None) -> tuple[int, ...]:
    """Convert ``1024x512``, width and height, to (rows, columns). A single number gives a square.

    With three axes, ``WIDTHxHEIGHTxDEPTH`` becomes (planes, rows, columns).
    """
    parts = re.split(r"[x×]", text.strip().lower())
    if len(parts) not in (1, axes) or not all(re.fullmatch(r"\s*-?[0-9]{1,18}\s*", p) for p in parts):
        wanted = ("WIDTHxHEIGHT, as in 1024x512", "WIDTHxHEIGHTxDEPTH, as in 128x96x64")[axes - 2]
        raise InvalidInput(f"{option}: must be {wanted}, or one number; got {text!r}")
    sides = [int(p) for p in reversed(parts)]
    return as_size(sides if len(sides) > 1 else sides[0], option, axes=axes, limit=limit)


def parse_axes(text: str, option: str = "--wrap", *, axes: int = 2) -> tuple[bool, ...]:
    """Return whether each axis is named by a letter in the text: x for columns, y for rows, z for planes."""
    known = "zyx"[-axes:]
    letters = text.strip().lower()
    if letters != "none" and (not letters or set(letters) - set(known) or len(set(letters)) < len(letters)):
        wanted = (
            "must be one of default, xy, x, y, none"
            if axes == 2
            else "must be default, none, or some of the letters x, y and z, each once"
        )
        raise InvalidInput(f"{option}: {wanted}; got {text!r}")
    return tuple(letters != "none" and letter in letters for letter in known)


def show_axes(wrap: bool | Sequence[bool]) -> str:
    """Return the letters of the marked axes as text."""
    if isinstance(wrap, bool):
        return "all" if wrap else "none"
    return "".join(letter for letter, cyclic in zip("xyz", reversed(wrap), strict=False) if cyclic) or "none"


def parse_numbers(
    text: str, option: str, wanted: str, *, counts: Sequence[int] = (), between: str = ":"
) -> list[float]:
    """Convert numbers that are separated by a character. All must be finite."""
    try:
        numbers = [float(p) for p in text.split(between)]
    except ValueError:
        numbers = []
    if not numbers or (counts and len(numbers) not in counts):
        raise InvalidInput(f"{option}: must be {wanted}; got {text!r}")
    return numbers


def parse_spacing(text: str, about: About) -> tuple[float, ...]:
    """Convert ``0.7x0.7x1.6``, the width, height and depth of a voxel, to (z, y, x). One number gives a cube."""
    wanted = "WIDTHxHEIGHTxDEPTH of a voxel, as in 0.7x0.7x1.6, or one number"
    numbers = parse_numbers(text.lower().replace("×", "x"), about.option, wanted, counts=(1, about.axes), between="x")
    return tuple(numbers[::-1]) if len(numbers) > 1 else tuple(numbers) * about.axes


def parse_range(text: str, about: About) -> tuple[float, float]:
    """Convert ``0.8:1.2`` to (minimum, maximum). A single number is used for both."""
    numbers = parse_numbers(text, about.option, "LEAST:LARGEST, as in 0.8:1.2", counts=(1, 2))
    return numbers[0], numbers[-1]


def parse_sizes(text: str, about: About) -> str | bool | list[float]:
    """Convert a text to "auto", to a bool for yes or no, or to numbers."""
    word = text.strip().lower()
    if word in ("auto", "yes", "no"):
        return "auto" if word == "auto" else word == "yes"
    return parse_numbers(word, about.option, "auto, yes, no, or sizes as in 0.8:1.25")


def parse_bytes(text: str, option: str = "--memory-limit") -> int:
    """Convert ``900M`` or ``16G`` to a number of bytes, with powers of 1024."""
    found = re.fullmatch(r"([0-9]{1,18})([kmgt]?)(i?b)?", text.strip().lower())
    if not found or int(found[1]) == 0:
        raise InvalidInput(f"{option}: must be a number of bytes, as in 900M or 16G; got {text!r}")
    return int(found[1]) << 10 * " kmgt".index(found[2] or " ")


def parse_each(texts: Sequence[str], about: About) -> list[float | None]:
    """Convert texts to one number for each plane. The word "found" becomes None."""
    found: list[float | None] = []
    for text in texts:
        word = text.strip().lower()
        found.append(
            None if word == FOUND else parse_numbers(word, about.option, f"a number, or {FOUND}", counts=(1,))[0]
        )
    return found


def read_steps(text: str, about: About) -> Any:
    """Read the steps of an edit: comma-separated names, JSON, or a JSON file."""
    if not text.lower().endswith(".json") and not text.lstrip().startswith(("[", "{")):
        return [word.strip() for word in text.split(",")]
    found = read_json(text, about.option)
    # A report contains its edit under the key "edit".
    return found["edit"] if isinstance(found, dict) and "edit" in found else found


def read_json(text: str, option: str) -> Any:
    """Parse JSON text, or read a JSON file."""
    where = option
    if text.lower().endswith(".json"):
        where = text
        try:
            text = Path(text).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise FileError(f"{where}: {error}") from None
    try:
        return json.loads(text)
    except (json.JSONDecodeError, RecursionError) as error:
        raise InvalidInput(f"{where}: is not JSON ({error})") from None


def read_corrections(text: str, about: About) -> Any:
    """Read a list of corrections from JSON text or a JSON file."""
    if not (text.lower().endswith(".json") or text.lstrip().startswith("[")):
        raise InvalidInput(f"{about.option}: must be a .json file, or a list of corrections as JSON; got {text!r}")
    return read_steps(text, about)

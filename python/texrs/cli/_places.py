"""Convert places on the command line, where x comes first, as the width does in sizes, and y grows downwards.

Functions take (row, column) and (plane, row, column). Every option for places reverses the order here.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

import numpy as np

from texrs._notices import assume
from texrs.cli._texts import About, parse_numbers
from texrs.errors import FileError, InvalidInput

__all__ = [
    "PLACE",
    "PLACED",
    "check_corners",
    "has_rows_first",
    "parse_box",
    "parse_corners",
    "parse_places",
    "put_rows_first",
    "read_points",
    "say_places",
    "show_box",
    "turn",
    "turn_centre",
]

PLACE = r"\s*-?[0-9]+(\.[0-9]*)?\s*,\s*-?[0-9]+(\.[0-9]*)?\s*"
"""Pattern of x and y, separated by a comma."""
PLACED = ("corners", "background", "points", "box", "at", "point", "normal")
"""Arguments of functions that contain places."""
HEADERS = {"x": 0, "column": 0, "columns": 0, "col": 0, "y": 1, "row": 1, "rows": 1}
"""Names of columns in a CSV file of points, and the index of the coordinate in x, y order."""
_ROWS_FIRST: ContextVar[bool] = ContextVar("rows_first", default=False)


@contextmanager
def put_rows_first() -> Iterator[None]:
    """Interpret places as row,column during a block. Old records without a stated order use this order."""
    token = _ROWS_FIRST.set(True)
    try:
        yield
    finally:
        _ROWS_FIRST.reset(token)


def has_rows_first() -> bool:
    """Return whether places are interpreted as row,column."""
    return _ROWS_FIRST.get()


def turn(numbers: Sequence[float]) -> list[float]:
    """Reverse coordinates: x,y to (row, column), or x,y,z to (plane, row, column)."""
    return list(numbers) if has_rows_first() else list(reversed(numbers))


def parse_box(text: str, about: About) -> list[float]:
    """Convert a text to a box (row, column, height, width)."""
    numbers = _parse_finite(text, 4, about.option, "X,Y,WIDTH,HEIGHT, as in 92,96,50,50")
    return [*turn(numbers[:2]), *turn(numbers[2:])]


def turn_centre(text: str) -> str:
    """Return the words of a field with its centre converted to (row, column) or (plane, row, column)."""

    def swap(found: re.Match[str]) -> str:
        return found[1] + "x".join(reversed(re.split("[x×]", found[2])))

    return text if has_rows_first() else re.sub(r"(\bcentre\s*=\s*)([^,]*)", swap, text)


def show_box(box: Sequence[float]) -> str:
    """Return the text that gives a box (row, column, height, width) on the command line."""
    row, column, height, width = box
    return f"{column},{row},{width},{height}"


def parse_places(texts: Sequence[str], about: About) -> list[list[float]]:
    """Convert one or several texts to points (row, column)."""
    parts = [p for text in texts for p in re.split(r"[\s;]+", text.strip()) if p]
    return [turn(_parse_finite(p, 2, about.option, "X,Y, as in 125,60")) for p in parts]


def parse_corners(text: str, about: About) -> list[list[float]]:
    """Convert a text to four points (row, column)."""
    points = parse_places([text], about)
    if len(points) != 4:
        raise InvalidInput(
            f"{about.option}: must be four points X,Y, as in '20,20 104,24 110,100 14,112', got {text!r}"
        )
    return points


def _parse_finite(text: str, count: int, option: str, wanted: str) -> list[float]:
    numbers = parse_numbers(text, option, wanted, counts=(count,), between=",")
    if not all(math.isfinite(n) for n in numbers):
        raise InvalidInput(f"{option}: must be {wanted}; got {text!r}")
    return numbers


def read_points(path: str, about: About) -> list[list[float]]:
    """Read points (row, column) from a file with two numbers per line. A header such as ``x,y`` is optional."""
    try:
        lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "is not text"
        raise FileError(f"{path}: cannot be read ({reason})") from None
    found: list[list[float]] = []
    order: list[int] | None = None
    for number, line in enumerate(lines, start=1):
        parts = [p.strip() for p in re.split(r"[,;\t]", line.strip())]
        if parts == [""]:
            continue
        try:
            values = [float(p) for p in parts]
        except ValueError:
            if number == 1:
                named = [HEADERS.get(p.strip("\"'# ").lower(), -1) for p in parts]
                order = named if sorted(named) == [0, 1] else None
                continue
            values = []
        if len(values) != 2:
            raise InvalidInput(f"{path}: line {number} must be x,y, got {line.strip()[:60]!r}")
        found.append(values)
    if not found:
        raise InvalidInput(f"{path}: contains no points")
    if has_rows_first():
        return found
    if order is None:
        assume(f"{path}: read as x,y, because the first line does not name the columns (x,y or row,column)")
    return found if order == [1, 0] else [values[::-1] for values in found]


# --- what errors say -------------------------------------------------------------------------------------------------


def say_places(message: str) -> str:
    """Return an error text with places as on the command line: x first.

    Examples
    --------
    >>> say_places("background: point 0, (row, column) = [10.0, 900.0], lies outside")
    'background: point 0, (x, y) = [900.0, 10.0], lies outside'

    """
    if has_rows_first():
        return message
    for rows, places in (
        ("(row, column, height, width)", "(x, y, width, height)"),
        ("(plane, row, column)", "(x, y, z)"),
        ("(row, column)", "(x, y)"),
    ):
        message = message.replace(rows, places)
    message = re.sub(r"image of \((\d+), (\d+)\)", r"image of \2 x \1", message)

    def swap(found: re.Match[str]) -> str:
        parts = found[1].split(", ")
        ordered = [parts[1], parts[0], parts[3], parts[2]] if len(parts) == 4 else parts[::-1]
        return f"[{', '.join(ordered)}]"

    return re.sub(r"\[([^\[\],]+(?:, [^\[\],]+){1,3})\]", swap, message)


def check_corners(corners: Sequence[Sequence[float]], size: Sequence[int]) -> None:
    """Check that four corners (row, column) form a convex quadrilateral inside an image."""
    points = np.asarray(corners, np.float64)
    said = " ".join(f"{column:g},{row:g}" for row, column in points)
    reason = _find_fault(points, size)
    if reason:
        other = (
            ""
            if _find_fault(points[:, ::-1], size)
            else "; they would fit as row,column: exchange the numbers of each corner"
        )
        raise InvalidInput(f"corners: {reason}; as x,y, they are {said} in an image of {size[1]} x {size[0]}{other}")


def _find_fault(points: np.ndarray, size: Sequence[int]) -> str:
    """Return why four points cannot be the corners of a convex quadrilateral in an image, or an empty text."""
    # Corners are placed by hand, so allow one pixel beyond the border.
    outside = ((points < -1) | (points > np.asarray(size[:2]))).any(axis=1)
    if outside.any():
        return f"{outside.sum()} of the four are outside the image"
    sides = np.roll(points, -1, axis=0) - points
    after = np.roll(sides, -1, axis=0)
    turns = sides[:, 0] * after[:, 1] - sides[:, 1] * after[:, 0]
    if np.all(turns > 0) or np.all(turns < 0):
        return ""
    return "the sides cross, or the shape is not convex: give the corners in their order around the shape"

"""The tasks of a comparison, and their measures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from texrs._typing import Array
from texrs.comparison import _measures as m
from texrs.comparison._results import Request


@dataclass(frozen=True, slots=True)
class Task:
    """A task: its heading, a sentence about it, and the function that measures a result."""

    title: str
    lead: str
    measure: Callable[[Request, Array], dict[str, float]]


def judge_more(asked: Request, made: Array) -> dict[str, float]:
    """Measure a larger texture, which should be tileable."""
    return judge_tile(asked, made) | {"repetition": m.measure_repetition(asked.picture, made)}


def judge_tile(asked: Request, made: Array) -> dict[str, float]:
    """Measure an image that should have no seam."""
    return {
        "colours": m.measure_colours(asked.picture, made),
        "detail": m.measure_detail(asked.picture, made),
        "border": m.measure_border(asked.picture, made),
    }


def judge_hole(asked: Request, made: Array) -> dict[str, float]:
    """Measure a filled hole."""
    assert asked.hole is not None
    return {
        "error": m.measure_error(asked.picture, made, asked.hole),
        "colours": m.measure_colours(asked.picture, made, asked.hole),
        "detail": m.measure_detail(asked.picture, made, asked.hole),
        "rim": m.measure_rim(asked.picture, made, asked.hole),
    }


TASKS = {
    "more": Task("A larger texture", "A larger texture from a small image, tileable along both axes.", judge_more),
    "tile": Task(
        "A tileable image",
        "The image itself, changed so that copies have no visible border. The results are shown as 2 x 2 copies.",
        judge_tile,
    ),
    "hole": Task("A filled hole", "A square in the middle of the image was removed and then filled.", judge_hole),
}
"""Tasks by the names that options use."""

"""What is compared, and by which measures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from texrs._typing import Array
from texrs.comparison import _measures as m
from texrs.comparison._results import Request


@dataclass(frozen=True, slots=True)
class Task:
    """A task: its heading, a sentence, and what is measured of a result."""

    title: str
    lead: str
    measure: Callable[[Request, Array], dict[str, float]]


def judge_more(asked: Request, made: Array) -> dict[str, float]:
    """Measure a larger texture, which is to be cyclic."""
    return judge_tile(asked, made) | {"repetition": m.measure_repetition(asked.picture, made)}


def judge_tile(asked: Request, made: Array) -> dict[str, float]:
    """Measure a picture that is to have no seam."""
    return {
        "colours": m.measure_colours(asked.picture, made),
        "detail": m.measure_detail(asked.picture, made),
        "border": m.measure_border(asked.picture, made),
    }


def judge_hole(asked: Request, made: Array) -> dict[str, float]:
    """Measure what a hole was filled with."""
    assert asked.hole is not None
    return {
        "error": m.measure_error(asked.picture, made, asked.hole),
        "colours": m.measure_colours(asked.picture, made, asked.hole),
        "detail": m.measure_detail(asked.picture, made, asked.hole),
        "rim": m.measure_rim(asked.picture, made, asked.hole),
    }


TASKS = {
    "more": Task("More of a texture", "A larger texture from a small picture, cyclic along both axes.", judge_more),
    "tile": Task(
        "No seam",
        "The picture itself, so that copies have no edge between them: results are shown two by two.",
        judge_tile,
    ),
    "hole": Task("A hole filled", "A square in the middle was taken out, and is filled.", judge_hole),
}
"""By the names that options have for them."""

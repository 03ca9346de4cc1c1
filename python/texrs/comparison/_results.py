"""What methods gave, and which of them are not here."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from texrs._typing import Array


@dataclass(frozen=True, slots=True, eq=False)
class Request:
    """What a method is asked for: a texture of a size from a picture, or a hole in it filled."""

    picture: Array
    size: int
    seed: int
    hole: Array | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Result:
    """What a method made of a picture.

    Attributes
    ----------
    picture, task, method : str
        Their names.
    image : (h, w, 3) uint8 array or None
        What was made.
    seconds : float
        Processor seconds, of all threads and programs.
    figures : mapping of str to float
        What is measured; of each, less is better.
    failure : str
        Why nothing was made.

    """

    picture: str
    task: str
    method: str
    image: Array | None
    seconds: float
    figures: Mapping[str, float]
    failure: str = ""


@dataclass(frozen=True, slots=True)
class Missing:
    """A method that is not here, and how to get it."""

    method: str
    task: str
    get: str

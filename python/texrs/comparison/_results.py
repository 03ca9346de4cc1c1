"""Results of methods, and methods that are not installed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from texrs._typing import Array


@dataclass(frozen=True, slots=True, eq=False)
class Request:
    """A request to a method: a texture of a given size, or a hole in the image to fill."""

    picture: Array
    size: int
    seed: int
    hole: Array | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Result:
    """Result of a method for an image.

    Attributes
    ----------
    picture, task, method : str
        Names of the image, the task and the method.
    image : (h, w, 3) uint8 array or None
        The result, or None if the method failed.
    seconds : float
        Processor seconds of all threads and programs.
    figures : mapping of str to float
        Measures of the result by name. Less is better.
    failure : str
        Reason if the method failed, else empty.

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
    """A method that is not installed, and how to get it."""

    method: str
    task: str
    get: str

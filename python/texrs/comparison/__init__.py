"""Methods x pictures x measures in one page: what texrs makes, beside what other programs make of the same pictures.

Three tasks are compared: more of a texture, a picture without a seam, and a hole that is filled. Each has methods of texrs,
those of others as far as they are here, and what costs nothing, as copies side by side. What is not here is listed, with how to
get it. All methods get the same 8-bit RGB pictures, and what they give is judged by its pixels alone, so that no method is
favoured for what it says of itself. A method that fails is shown as failed.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from texrs._arrays import as_image
from texrs._checks import as_choice, as_int, as_seed
from texrs._show import preview
from texrs._typing import Array, Bools, Progress
from texrs.comparison._measures import MEASURES
from texrs.comparison._methods import METHODS, PROGRAMS
from texrs.comparison._page import make_page
from texrs.comparison._results import Missing, Request, Result
from texrs.comparison._tasks import TASKS
from texrs.errors import InvalidInput

__all__ = ["MEASURES", "METHODS", "PROGRAMS", "TASKS", "Comparison", "compare"]

LEAST, MOST = 48, 1024
"""Pixels of a side of what is compared."""
HOLE = 0.28
"""Sides of a hole, as a share of those of the picture."""


@dataclass(frozen=True)
class Comparison:
    """What methods made of pictures.

    Attributes
    ----------
    pictures : mapping of str to (H, W, 3) uint8 array
        What they were given.
    results : tuple of Result
        What each made of each, and how it is measured.
    missing : tuple of Missing
        Methods that are not here, and how to get them.
    timed : bool
        Whether the page says how long each took.

    """

    pictures: Mapping[str, Array]
    results: tuple[Result, ...]
    missing: tuple[Missing, ...] = ()
    timed: bool = True
    holes: Mapping[str, Bools] = field(default_factory=dict)

    def page(self) -> str:
        """Return a page that holds all of it: HTML that refers to nothing outside itself."""
        return make_page(self.pictures, self.holes, self.results, self.missing, timed=self.timed)


def compare(
    pictures: Mapping[str, Array],
    *,
    tasks: Sequence[str] = tuple(TASKS),
    side: int = 128,
    size: int | None = None,
    seed: int = 0,
    programs: Mapping[str, str] | None = None,
    timed: bool = True,
    progress: Progress | None = None,
) -> Comparison:
    """Let all methods that are here do the tasks on some pictures.

    Parameters
    ----------
    pictures : mapping of str to (H, W) or (H, W, C) array
        By their names; each is compared in 8-bit RGB.
    tasks : sequence of str
        Of ``"more"``, ``"tile"`` and ``"hole"``.
    side : int
        The middle of each picture is compared, at most so many pixels a side; 48 to 1024.
    size : int, optional
        Pixels a side of the larger textures, at least ``side``; by default half as many again.
    seed : int
        Seed of all methods that have one.
    programs : mapping of str to path, optional
        Programs that are not found by their usual name: ``"embark"`` and ``"resynthesizer"``.
    timed : bool
        Whether the page says how long each method took; without it, the same methods give the same bytes.
    progress : callable, optional
        Called as ``progress(stage, share)``; raising stops the work.

    Returns
    -------
    Comparison

    Raises
    ------
    InvalidInput
        No picture, one that is too small, an unknown task or program, or a program that cannot be run.

    Examples
    --------
    >>> import texrs
    >>> from texrs.comparison import compare
    >>> found = compare({"grit": texrs.samples.grit((64, 64)).image}, tasks=["tile"])
    >>> found.results[0].method
    'as it is'

    """
    chosen = [as_choice(t, "tasks", tuple(TASKS)) for t in tasks]
    if not chosen or not pictures:
        raise InvalidInput(f"{'tasks' if pictures else 'pictures'}: needs at least one")
    side = as_int(side, "side", LEAST, MOST)
    size = side * 3 // 2 if size is None else as_int(size, "size", side, 2 * MOST)
    seed = as_seed(seed)
    named = check_programs(programs or {})
    given = {name: take_middle(image, side, name) for name, image in pictures.items()}
    holes = {name: make_hole(image.shape[:2]) for name, image in given.items()} if "hole" in chosen else {}
    here, missing = [], []
    for method in METHODS:
        if method.task in chosen:
            if (do := method.find(named)) is not None:
                here.append((method, do))
            else:
                missing.append(Missing(method.name, method.task, method.get))
    results = []
    pairs = [(name, method, do) for name in given for method, do in here]
    for at, (name, method, do) in enumerate(pairs):
        if progress is not None:
            progress(f"{name}: {method.name}", at / len(pairs))
        truth = Request(given[name], size, seed, holes.get(name) if method.task == "hole" else None)
        # What was in the hole is shown to none.
        asked = truth if truth.hole is None else replace(truth, picture=blank(truth.picture, truth.hole))
        made, seconds, failure = attempt(do, asked)
        figures = {} if made is None else TASKS[method.task].measure(truth, made)
        results.append(Result(name, method.task, method.name, made, seconds, figures, failure))
    if progress is not None:
        progress("compared", 1.0)
    return Comparison(given, tuple(results), tuple(missing), timed, holes)


def check_programs(programs: Mapping[str, str]) -> dict[str, str]:
    """Check that the programs are known, and are there to be run."""
    for name, path in programs.items():
        if name not in PROGRAMS:
            raise InvalidInput(f"programs: must be one of {', '.join(PROGRAMS)}; got {name!r}")
        if not (os.path.isfile(path) and os.access(path, os.X_OK)):
            raise InvalidInput(f"programs: {path!r}, which is to be {name}, is not a program that can be run")
    return {name: os.path.abspath(path) for name, path in programs.items()}


def take_middle(image: Array, side: int, name: str) -> Array:
    """Return the middle of a picture as 8-bit RGB."""
    whole = preview(as_image(image, name, minimum=LEAST))
    pixels = whole if whole.ndim == 3 else whole[..., np.newaxis]
    pixels = np.repeat(pixels[..., :1], 3, axis=-1) if pixels.shape[-1] < 3 else pixels[..., :3]
    corner = [max(0, (n - side) // 2) for n in pixels.shape[:2]]
    return np.ascontiguousarray(pixels[corner[0] : corner[0] + side, corner[1] : corner[1] + side])


def make_hole(shape: tuple[int, ...]) -> Bools:
    """Mark a square in the middle."""
    hole = np.zeros(shape, bool)
    rows, columns = (slice(int(n * (1 - HOLE) / 2), int(n * (1 + HOLE) / 2)) for n in shape)
    hole[rows, columns] = True
    return hole


def blank(picture: Array, hole: Bools) -> Array:
    """Return a picture in whose hole is grey."""
    return np.where(hole[..., np.newaxis], np.uint8(128), picture)


def attempt(do: Callable[[Request], Array], request: Request) -> tuple[Array | None, float, str]:
    """Return what a method makes, the processor seconds that it took, and why it failed, if it did."""
    start = count_seconds()
    try:
        made = do(request)
    except Exception as error:
        # Of others anything may come; the comparison goes on.
        return None, count_seconds() - start, (str(error).strip().splitlines() or [type(error).__name__])[0][:160]
    seconds = count_seconds() - start
    made = np.ascontiguousarray(made)
    if made.dtype != np.uint8 or made.ndim != 3 or made.shape[2] != 3:
        return None, seconds, f"gave {made.dtype} of {made.shape}"
    return made, seconds, ""


def count_seconds() -> float:
    """Return the processor seconds of this process and of the programs that it ran."""
    spent = os.times()
    return time.process_time() + spent.children_user + spent.children_system

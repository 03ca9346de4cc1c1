"""Compare results of texrs with results of other programs for the same images, on one page.

There are three tasks: more of a texture, an image without a seam, and a filled hole. For each task, the page shows
methods of texrs, methods of other programs that are installed, and trivial methods, such as copies side by side. It
also lists the programs that are not installed and how to get them. All methods get the same 8-bit RGB images. Measures
use only the pixels of a result, so no method benefits from its own report. A method that fails is shown as failed.
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
"""Minimum and maximum side of the compared images, in pixels."""
HOLE = 0.28
"""Sides of the hole as a share of the image's sides."""


@dataclass(frozen=True)
class Comparison:
    """Results of all methods for all images.

    Attributes
    ----------
    pictures : mapping of str to (H, W, 3) uint8 array
        Images that the methods got, by name.
    results : tuple of Result
        Results with their measures, one for each image and method.
    missing : tuple of Missing
        Methods that are not installed, and how to get them.
    timed : bool
        If True, the page reports the time of each method.
    holes : mapping of str to (H, W) bool array
        Mask of the hole in each image, by the name of the image. The mapping is empty if holes were not a task.

    """

    pictures: Mapping[str, Array]
    results: tuple[Result, ...]
    missing: tuple[Missing, ...] = ()
    timed: bool = True
    holes: Mapping[str, Bools] = field(default_factory=dict)

    def page(self) -> str:
        """Return a self-contained HTML page with all results."""
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
    """Run all installed methods on some images, and measure their results.

    Parameters
    ----------
    pictures : mapping of str to (H, W) or (H, W, C) array
        Images by name. Each is compared in 8-bit RGB.
    tasks : sequence of str
        Tasks from ``"more"``, ``"tile"`` and ``"hole"``. Default: all.
    side : int
        Maximum side, in pixels, of the middle part of each image that is compared, 48 to 1024. Default: 128.
    size : int, optional
        Side of the larger textures in pixels, ``side`` to 2048. Default: 1.5 times ``side``.
    seed : int
        Seed of all methods that have one. Default: 0.
    programs : mapping of str to path, optional
        Paths of the programs ``"embark"`` and ``"resynthesizer"``, if they have unusual names or are not in the path.
    timed : bool
        If True, the page reports the time of each method. If False, the same methods give the same bytes. Default:
        True.
    progress : callable, optional
        Called as ``progress(stage, share)`` with the completed share. An exception that it raises stops the work.

    Returns
    -------
    Comparison

    Raises
    ------
    InvalidInput
        If the images are missing or too small, a task or program is unknown, or a program cannot be run.

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
        raise InvalidInput(f"{'tasks' if pictures else 'pictures'}: must have at least one entry, got none")
    side = as_int(side, "side", LEAST, MOST)
    size = side * 3 // 2 if size is None else as_int(size, "size", side, 2 * MOST)
    seed = as_seed(seed)
    named = check_programs(programs or {})
    given = {name: take_middle(image, side, name) for name, image in pictures.items()}
    holes = {name: make_hole(image.shape[:2]) for name, image in given.items()} if "hole" in chosen else {}
    # List the methods before the work starts, because the progress needs their number.
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
        # Methods do not get the original pixels of the hole.
        asked = truth if truth.hole is None else replace(truth, picture=blank(truth.picture, truth.hole))
        made, seconds, failure = attempt(do, asked)
        figures = {} if made is None else TASKS[method.task].measure(truth, made)
        results.append(Result(name, method.task, method.name, made, seconds, figures, failure))
    if progress is not None:
        progress("compared", 1.0)
    return Comparison(given, tuple(results), tuple(missing), timed, holes)


def check_programs(programs: Mapping[str, str]) -> dict[str, str]:
    """Check that the programs are known and executable, and return their absolute paths."""
    for name, path in programs.items():
        if name not in PROGRAMS:
            raise InvalidInput(f"programs: must be one of {', '.join(PROGRAMS)}, got {name!r}")
        if not (os.path.isfile(path) and os.access(path, os.X_OK)):
            raise InvalidInput(f"programs: {name} must be an executable file, got {path!r}")
    return {name: os.path.abspath(path) for name, path in programs.items()}


def take_middle(image: Array, side: int, name: str) -> Array:
    """Return the middle of an image as 8-bit RGB."""
    whole = preview(as_image(image, name, minimum=LEAST))
    pixels = whole if whole.ndim == 3 else whole[..., np.newaxis]
    pixels = np.repeat(pixels[..., :1], 3, axis=-1) if pixels.shape[-1] < 3 else pixels[..., :3]
    corner = [max(0, (n - side) // 2) for n in pixels.shape[:2]]
    return np.ascontiguousarray(pixels[corner[0] : corner[0] + side, corner[1] : corner[1] + side])


def make_hole(shape: tuple[int, ...]) -> Bools:
    """Return the mask of a square hole in the middle of an image."""
    hole = np.zeros(shape, bool)
    rows, columns = (slice(int(n * (1 - HOLE) / 2), int(n * (1 + HOLE) / 2)) for n in shape)
    hole[rows, columns] = True
    return hole


def blank(picture: Array, hole: Bools) -> Array:
    """Return an image with a grey hole."""
    return np.where(hole[..., np.newaxis], np.uint8(128), picture)


def attempt(do: Callable[[Request], Array], request: Request) -> tuple[Array | None, float, str]:
    """Run a method. Return its result, its processor seconds, and the reason if it failed."""
    start = count_seconds()
    try:
        made = do(request)
    except Exception as error:
        # Continue the comparison after any exception, because other programs can raise exceptions of any class.
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

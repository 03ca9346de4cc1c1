"""Row 9: square holes in textures, filled by example.

Results are compared by the patch error over each hole. It is the mean of 1 minus the correlation between 9 x 9 patches
that touch the hole and the most similar patches of the known image. It is shown next to the times. (With squared
differences, blurred images are nearest to all others. Two of three results of the Resynthesizer are then better than
the photograph itself.)

The Resynthesizer (github.com/bootchk/resynthesizer, GPL) is an external program, given by the variable RESYNTHESIZER.
`fillers.py` describes how to build it.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
from frame import Arrays, Row, Side, Timed, Work

sys.path.append(str(Path(__file__).resolve().parents[1]))  # The module fillers is shared with the tables.
PATCH = 9
GIVEN = 32
EVEN = 2.0
"""Grey levels of deviation, below which a patch shows nothing."""
TEXTURES = ("brick", "grass", "gravel")


def make_holes(side: int) -> dict[str, Any]:
    """Remove a square of a quarter of the side in the middle of each of three textures."""
    from skimage import data

    truth = np.stack([np.stack([getattr(data, name)()[:side, :side]] * 3, axis=-1) for name in TEXTURES])
    hole = np.zeros((side, side), bool)
    hole[side * 3 // 8 : side * 5 // 8, side * 3 // 8 : side * 5 // 8] = True
    return {"images": np.where(hole[..., None], np.uint8(0), truth), "hole": hole, "truth": truth}


def fill_by_texrs(given: Arrays) -> Work:
    """Fill with all steps of the verb."""
    import texrs

    return lambda: [texrs.inpaint(image, given["hole"]).image for image in given["images"]]


def fill_by_one_size(given: Arrays) -> Work:
    """Fill with the given patch size, as the others have only one.

    By default several are tried, and the best result is kept.
    """
    import texrs

    return lambda: [texrs.inpaint(image, given["hole"], patch_size=GIVEN).image for image in given["images"]]


def fill_by_opencv(given: Arrays) -> Work:
    """Fill with shifted pieces, in Lab as its documentation requests."""
    import cv2

    from fillers import by_opencv

    cv2.setNumThreads(1)
    return lambda: [by_opencv(image, given["hole"])[0] for image in given["images"]]


def fill_by_program(given: Arrays) -> Work:
    """Fill with one thread and default parameters. The program reports its time."""
    from fillers import by_program

    fill = by_program(Path(os.environ["RESYNTHESIZER"]).resolve())

    def work() -> Timed:
        made, seconds = zip(*(fill(image, given["hole"]) for image in given["images"]), strict=True)
        return Timed(made, sum(seconds))

    return work


def measure_patches(truth: np.ndarray, made: np.ndarray, hole: np.ndarray) -> float:
    """Return the mean of 1 - correlation between patches that touch the hole and the most similar known ones."""
    from numpy.lib.stride_tricks import sliding_window_view

    touched = sliding_window_view(hole, (PATCH, PATCH)).any((2, 3))
    known, new = np.argwhere(~touched), np.random.default_rng(0).permutation(np.argwhere(touched))[:1000]

    def cut(picture: np.ndarray, at: np.ndarray) -> np.ndarray:
        patches = sliding_window_view(picture.mean(-1, dtype=np.float32), (PATCH, PATCH))[at[:, 0], at[:, 1]]
        patches = patches.reshape(len(at), -1)
        patches = patches - patches.mean(1, keepdims=True)
        # Limit the norm from below, so that the noise of plain patches is not compared.
        return patches / np.maximum(np.linalg.norm(patches, axis=1, keepdims=True), EVEN * PATCH)

    wanted, best = cut(made, new), np.zeros(len(new))
    for first in range(0, len(known), 20000):
        best = np.maximum(best, (wanted @ cut(truth, known[first : first + 20000]).T).max(1))
    return float(1 - best.mean())


def _with(side: Side) -> Side:
    def ready(given: Arrays) -> Work:
        work = side(given)

        def done() -> Any:
            made = work()
            return Timed((given, made.result), made.seconds) if isinstance(made, Timed) else (given, made)

        return done

    return ready


def _error(result: Any) -> list[float]:
    given, made = result
    return [float(np.mean([measure_patches(t, m, given["hole"]) for t, m in zip(given["truth"], made, strict=True)]))]


ROWS = {
    f"holes-{side}{suffix}": Row(
        "9",
        f"three holes of {side // 4}² filled in {side}² RGB{how}",
        "mean patch error over the holes, 1 - correlation; that of texrs must not be larger",
        lambda side=side: make_holes(side),
        {
            "texrs": _with(fill),
            "Resynthesizer": _with(fill_by_program),
            "OpenCV shift maps": _with(fill_by_opencv),
        },
        _error,
        asked={"Resynthesizer": 20, "OpenCV shift maps": 40},
        most_ms=most,
        shown="patch error",
    )
    for side, most in ((256, 69), (512, 420))
    for suffix, how, fill in (
        ("", ", by default", fill_by_texrs),
        ("-given", f", by patches of {GIVEN}", fill_by_one_size),
    )
}

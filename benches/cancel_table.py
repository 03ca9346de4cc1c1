"""How long a verb works without asking whether it is to stop: the longest gap between two calls of its progress, by stage.

    python benches/cancel_table.py [VERB ...]

In seconds of processor time, for wall time hangs on what else the machine does; with one thread, so that the two are alike.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

import texrs

SIDE, SIZE = 192, 384
PICTURE = texrs.samples.pebbles((SIDE, SIDE)).image
FLOOR = texrs.samples.tilted_discs((SIDE, SIDE)).image
VOLUME = texrs.samples.particles((48, 48, 48)).image
HOLE = np.zeros((SIDE, SIDE), np.bool_)
HOLE[64:128, 64:128] = True
VERBS: dict[str, Callable[[Any], object]] = {
    "design": lambda watch: texrs.design(PICTURE, SIZE, progress=watch),
    "design, as printed": lambda watch: texrs.design(PICTURE, SIZE, method="paper", progress=watch),
    "splice": lambda watch: texrs.splice(PICTURE, np.rot90(PICTURE).copy(), progress=watch),
    "self_splice": lambda watch: texrs.self_splice(PICTURE, "randomise", progress=watch),
    "perspective": lambda watch: texrs.perspective(PICTURE, size=SIZE, progress=watch),
    "synthesize": lambda watch: texrs.synthesize(PICTURE, SIZE, progress=watch),
    "synthesize, fast": lambda watch: texrs.synthesize(PICTURE, SIZE, quality="fast", progress=watch),
    "solid": lambda watch: texrs.solid(VOLUME, 80, progress=watch),
    "tile": lambda watch: texrs.tile(PICTURE, progress=watch),
    "complete": lambda watch: texrs.complete(PICTURE, HOLE, progress=watch),
    "complete, optimise": lambda watch: texrs.complete(PICTURE, HOLE, method="optimise", progress=watch),
    "extend": lambda watch: texrs.extend(FLOOR, right=96, bottom=96, progress=watch),
    "rectify": lambda watch: texrs.rectify(FLOOR, progress=watch),
    "remove": lambda watch: texrs.remove(FLOOR, HOLE, progress=watch),
    "analyse": lambda watch: texrs.elements.analyse(PICTURE, progress=watch),
}


def measure(call: Callable[[Any], object]) -> dict[str, float]:
    """Return the longest gap that ended in each stage."""
    longest: dict[str, float] = {}
    last, before = time.process_time(), "begin"

    def watch(stage: str, share: float) -> None:
        nonlocal last, before
        now = time.process_time()
        name = stage if stage == before else f"{before} > {stage}"
        longest[name] = max(longest.get(name, 0.0), now - last)
        last, before = now, stage

    call(watch)
    longest[f"{before} > end"] = time.process_time() - last
    return longest


def main(words: list[str]) -> None:
    """Print a row for each stage of each verb in which a gap is above a twentieth of a second."""
    warnings.simplefilter("ignore")
    print("| verb | stage | longest gap, processor s |\n|---|---|---|")
    for name in words or VERBS:
        with texrs.threads(1):
            VERBS[name](None)  # So that its libraries are loaded.
            found = measure(VERBS[name])
        for stage, gap in sorted(found.items(), key=lambda item: -item[1]):
            if gap >= 0.05:
                print(f"| {name} | {stage} | {gap:.2f} |", flush=True)
        if max(found.values()) < 0.05:
            print(f"| {name} | all | below 0.05 |", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])

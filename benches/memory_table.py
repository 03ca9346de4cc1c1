"""Compare the memory of each verb: the estimate of `texrs.limits.estimate_memory` and the measured peak.

    python benches/memory_table.py [VERB ...]

Each verb has its own process. The table gives its peak resident memory during the verb, minus the memory before. The
verb has then already processed a small input, so that its libraries are loaded. Linux only.
"""

from __future__ import annotations

import ctypes
import gc
import re
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import texrs

SIZES: dict[str, list[tuple[int, int]]] = {
    "design": [(256, 512), (128, 1024), (512, 1024)],
    "splice": [(256, 256), (256, 512), (512, 512)],
    "self_splice": [(256, 256), (256, 512), (512, 512)],
    "perspective": [(256, 512), (512, 512), (256, 1024)],
    "synthesize": [(256, 512), (128, 1024), (512, 1024)],
    "solid": [(32, 64), (32, 96), (48, 96)],
    "tile": [(512, 512), (1024, 1024), (512, 1024)],
    "inpaint": [(512, 512), (1024, 1024), (1536, 1536)],
    "extend": [(256, 384), (512, 768), (256, 768)],
    "rectify": [(512, 512), (1024, 1024), (1536, 1536)],
    "remove": [(256, 256), (512, 512), (1024, 1024)],
    "analyse": [(256, 256), (512, 512), (768, 768)],
    "CornerTiles": [(256, 576), (256, 1152), (512, 1152)],
}
"""Sides of the example and of the result. For tiles, the result is the atlas of 81 tiles."""


def make_call(verb: str, picture: np.ndarray[Any, Any], size: int) -> Callable[[], object]:
    """Return the call to measure."""
    side = picture.shape[0]
    hole = np.zeros(picture.shape[:2], np.bool_)
    hole[side // 3 : side * 2 // 3, side // 3 : side * 2 // 3] = True
    calls: dict[str, Callable[[], object]] = {
        "design": lambda: texrs.design(picture, size),
        "splice": lambda: texrs.splice(picture, np.rot90(picture).copy(), size),
        "self_splice": lambda: texrs.self_splice(picture, "randomise", size),
        "perspective": lambda: texrs.perspective(picture, size=size),
        "synthesize": lambda: texrs.synthesize(picture, size),
        "solid": lambda: texrs.solid(picture, size),
        "tile": lambda: texrs.tile(picture, size=size if size != side else None),
        "inpaint": lambda: texrs.inpaint(picture, hole),
        "extend": lambda: texrs.extend(picture, right=size - side, bottom=size - side),
        "rectify": lambda: texrs.rectify(picture, view=texrs.PlaneView(slant=40)),
        "remove": lambda: texrs.remove(picture, hole),
        "analyse": lambda: texrs.elements.analyse(picture),
        "CornerTiles": lambda: texrs.CornerTiles(picture, size // 9),
    }
    return calls[verb]


def make_picture(verb: str, side: int) -> np.ndarray[Any, Any]:
    """Return an example: a volume, an oblique floor, or stones."""
    if verb == "solid":
        return texrs.samples.particles((side,) * 3).image
    aslant = verb in ("extend", "rectify", "remove")
    return (texrs.samples.tilted_discs if aslant else texrs.samples.pebbles)((side, side)).image


def measure(name: str) -> int:
    """Return a memory value of this process from the system, in bytes."""
    return int(re.findall(rf"{name}:\s+(\d+)", Path("/proc/self/status").read_text())[0]) * 1024


def run(verb: str, side: int, size: int) -> None:
    """Measure one verb, and print its line."""
    warnings.simplefilter("ignore")
    # Load the libraries with a small image. It differs from the measured one, because results for an image are cached.
    small, larger = {"solid": (36, 40), "CornerTiles": (96, 288)}.get(verb, (96, 128))
    make_call(verb, make_picture(verb, small), larger)()
    picture = make_picture(verb, side)
    call, result = make_call(verb, picture, size), (size,) * (3 if verb == "solid" else 2)
    several = [picture.shape] * (2 if verb == "splice" else 1)
    predicted = texrs.limits.estimate_memory(verb, several, result, dtype=picture.dtype)
    gc.collect()
    # Return the memory that the C library keeps for later, so that the verb has to request its memory again.
    ctypes.CDLL(None).malloc_trim(0)
    Path("/proc/self/clear_refs").write_text("5")
    before, start = measure("VmRSS"), time.process_time()
    call()
    taken = measure("VmHWM") - before
    seconds = time.process_time() - start
    row = f"| {verb} | {side} | {size} | {predicted / 1e6:.0f} | {taken / 1e6:.0f} | {predicted / taken:.2f} | {seconds:.1f} |"
    print(row, flush=True)


def main(words: list[str]) -> None:
    """Measure all verbs, or the named ones."""
    if words[:1] == ["--one"]:
        run(words[1], int(words[2]), int(words[3]))
        return
    print(
        "| verb | example | result | predicted, MB | measured, MB | ratio | processor s |\n|---|---|---|---|---|---|---|"
    )
    for verb in words or SIZES:
        for side, size in SIZES[verb]:
            subprocess.run([sys.executable, __file__, "--one", verb, str(side), str(size)], check=False)


if __name__ == "__main__":
    main(sys.argv[1:])

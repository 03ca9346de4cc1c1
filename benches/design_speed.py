"""Measure the time of each part of DESIGN: interleaved rounds, medians, a Markdown table.

python benches/design_speed.py [--rounds 3] [--threads N] [--quick]

The exemplar is the sample "pebbles" of 256 x 256 pixels. `--quick` skips the texture of 4096 x 4096 pixels.
"""

from __future__ import annotations

import argparse
import os
import platform
import resource
import sys
import time
from collections.abc import Callable
from contextlib import nullcontext

import numpy as np

import texrs
from texrs import samples


def timed(task: Callable[[], object]) -> float:
    start = time.perf_counter()
    task()
    return time.perf_counter() - start


class Stages:
    """Seconds of each stage of a call, measured by its progress reports."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.stage, self.since = "", time.perf_counter()

    def __call__(self, stage: str, share: float) -> None:
        now = time.perf_counter()
        if stage != self.stage:
            if self.stage:
                self.seconds[self.stage] = self.seconds.get(self.stage, 0.0) + now - self.since
            self.stage, self.since = stage, now


def peak() -> float:
    """Return the peak resident memory so far, in MiB."""
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most / (2**20 if sys.platform == "darwin" else 2**10)


def stages_of(image: np.ndarray, size: int, **options: object) -> dict[str, float]:
    watch = Stages()
    start = time.perf_counter()
    texrs.design(image, size, progress=watch, **options)
    watch("", 1.0)
    return {**watch.seconds, "all": time.perf_counter() - start}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--threads", type=int)
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args()
    image = samples.pebbles((256, 256)).image
    with texrs.threads(options.threads) if options.threads else nullcontext():
        run(image, options)


def run(image: np.ndarray, options: argparse.Namespace) -> None:
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    print(f"{platform.machine()}, {os.cpu_count()} cores, load {load:.1f} at the start; medians of {options.rounds}\n")
    tasks: dict[str, Callable[[], object]] = {
        # The time of one further variant is the difference between the times of two variants and of one.
        "one 256^2 texture of 1 tile": lambda: texrs.design(image, 256, copies=1),
        "one 256^2 texture of 2 tiles": lambda: texrs.design(image, 256, copies=2),
        "1024^2, cyclic, 8 tiles": lambda: texrs.design(image, 1024, copies=8),
        "1024^2, not cyclic, 8 tiles": lambda: texrs.design(image, 1024, copies=8, wrap=False),
        "1024^2, cyclic, 8 tiles, screening=0": lambda: texrs.design(image, 1024, copies=8, screening=0),
    }
    growth = (256, 512, 1024, 2048)
    for size in growth:
        tasks[f"{size}^2, 4 tiles"] = lambda size=size: texrs.design(image, size)
    parts: list[dict[str, float]] = []
    times: dict[str, list[float]] = {name: [] for name in tasks}
    tasks["one 256^2 texture of 1 tile"]()
    for _ in range(options.rounds):
        for name, task in tasks.items():
            times[name].append(timed(task))
        parts.append(stages_of(image, 1024, copies=8))
    median = {name: float(np.median(t)) for name, t in times.items()}
    print("| task | seconds | Mpixel/s |\n|---|---|---|")
    for name, seconds in median.items():
        side = int(name.split("^")[0].split()[-1])
        print(f"| {name} | {seconds:.2f} | {side * side / seconds / 1e6:.2f} |")
    further = median["one 256^2 texture of 2 tiles"] - median["one 256^2 texture of 1 tile"]
    print(f"| a further 256^2 tile (difference) | {further:.2f} | |")
    first, last = (median[f"{size}^2, 4 tiles"] for size in (growth[1], growth[-1]))
    exponent = np.log(last / first) / np.log((growth[-1] / growth[1]) ** 2)
    print(f"\nGrowth from {growth[1]}^2 to {growth[-1]}^2: seconds ~ pixels^{exponent:.2f}\n")
    print("| stage of 1024^2, cyclic, 8 tiles | seconds |\n|---|---|")
    for stage in parts[0]:
        name = "segment and index" if stage == "segment" else stage
        print(f"| {name} | {np.median([p.get(stage, 0.0) for p in parts]):.2f} |")
    if not options.quick:
        before = peak()
        seconds = timed(lambda: texrs.design(image, 4096, copies=8))
        print(f"\n4096^2, cyclic, 8 tiles, once: {seconds:.1f} s ({4096**2 / seconds / 1e6:.2f} Mpixel/s), ")
        print(f"peak of memory {peak():.0f} MiB ({before:.0f} MiB before).")


if __name__ == "__main__":
    main()

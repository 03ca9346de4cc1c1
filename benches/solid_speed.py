"""Measure the time of each part of SOLID and its lower bound: interleaved rounds, medians, Markdown tables.

    python benches/solid_speed.py [--rounds 3] [--threads N] [--quick] [--optimise]

Volumes grow from 64^3 voxels of the sample "particles", by default under the field circular:axis=x. Images grow from
256 x 256 pixels of "pebbles" under zigzag:period=64. The lower bound ("floor") is the time of the multiplications and
additions of the projections of all windows, in a float32 matrix product on the same cores. The kernel skips windows
without borders of pieces, so it may be faster than this bound. The naive loop is the twin of the tests, which has the
same result to the bit. `--quick` skips 256^3.
"""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import nullcontext
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

import texrs
from texrs import fields, samples
from texrs._engine.pyramid import Region, to_fixed
from texrs.exemplar._exemplar import _FACTS

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "reference"))
from solid import Twin

KEEP, WINDOW = 24, 5
GROWTH = (64, 128, 256)


def timed(task: Callable[[], Any]) -> tuple[float, Any]:
    start = time.perf_counter()
    result = task()
    return time.perf_counter() - start, result


def products(report: dict[str, Any], channels: int) -> float:
    """Return the multiplications of the windows' projections: each window of each iteration of each level."""
    axes = len(report["levels"][0]["shape"])
    each = KEEP * channels * WINDOW**axes
    return sum(float(prod(level["shape"])) * level["passes"] / 2 * each for level in report["levels"])


def rate() -> float:
    """Return the multiplications for each second of a matrix product of windows and components."""
    rng = np.random.default_rng(0)
    windows, basis = (rng.random(shape, dtype=np.float32) for shape in ((1 << 16, 375), (375, KEEP)))
    seconds = min(timed(lambda: windows @ basis)[0] for _ in range(7))
    return windows.shape[0] * 375 * KEEP / seconds


def peak(size: int, quality: str) -> tuple[float, float]:
    """Return the peak memory of a process that grows a volume, and of one that only loads texrs, in MiB."""
    # On Linux a process inherits ru_maxrss from its parent, so read its own peak from /proc.
    script = (
        "import pathlib, re, resource, sys, texrs; from texrs import fields, samples\n"
        "size = int(sys.argv[1])\n"
        "image = samples.particles().image\n"
        "if size: texrs.solid(image, size, quality=sys.argv[2], field=fields.circular(axis='x'))\n"
        "status = pathlib.Path('/proc/self/status')\n"
        "most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n"
        "print(re.search(r'VmHWM:\\s*([0-9]+)', status.read_text())[1] if status.exists() else most)"
    )
    found = []
    for side in (size, 0):
        done = subprocess.run(
            [sys.executable, "-c", script, str(side), quality], capture_output=True, text=True, check=True
        )
        found.append(int(done.stdout) / (2**20 if sys.platform == "darwin" else 2**10))
    return found[0], found[1]


def naive() -> float:
    """Return the time of the tests' slow twin for the same passes, divided by the time of the kernel on one thread."""
    level = texrs.Exemplar(samples.particles().image, axes=3).analyse().levels[0]
    region = Region.whole((12, 12, 12))
    frames = to_fixed(fields.circular(axis="x").over(region.shape), region)
    start = level.blocks(region, frames)
    twin = Twin(level.arrays(), region, frames)
    slow, wanted = timed(lambda: twin.correct(start, passes=2, coherence=0.2)[-1])
    with texrs.threads(1):
        runs = [timed(lambda: level.correct(start, region, frames, passes=2, coherence=0.2)) for _ in range(9)]
    assert np.array_equal(runs[0][1].places.reshape(-1, 3), wanted)
    return slow / min(seconds for seconds, _ in runs)


def analyse(image: np.ndarray, axes: int) -> Any:
    """Return the analysis of an exemplar without the cache."""
    _FACTS.clear()
    return texrs.Exemplar(image, axes=axes).analyse()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--threads", type=int)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--optimise", action="store_true")
    options = parser.parse_args()
    with texrs.threads(options.threads) if options.threads else nullcontext():
        run(options)


def run(options: argparse.Namespace) -> None:
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    print(f"{platform.machine()}, {os.cpu_count()} cores, load {load:.1f} at the start; medians of {options.rounds}\n")
    solid, flat = samples.particles().image, samples.pebbles((256, 256)).image
    wound, zigzag = fields.circular(axis="x"), fields.zigzag(64, axes=2)

    def grow(size: int, **more: Any) -> Callable[[], Any]:
        return lambda: texrs.solid(solid, size, **more)

    def draw(size: int, **more: Any) -> Callable[[], Any]:
        return lambda: texrs.synthesize(flat, size, field=zigzag, **more)

    tasks: dict[str, Callable[[], Any]] = {
        "analysis of 64^3": lambda: analyse(solid, 3),
        "analysis of 256^2": lambda: analyse(flat, 2),
        "128^3 fast": grow(128, field=wound, quality="fast"),
        "128^3 fast, no field": grow(128, quality="fast"),
        "128^3 preserve": grow(128, field=wound),
        "128^3 preserve, no field": grow(128),
        "256^2 fast": draw(256, quality="fast"),
        "256^2 preserve": draw(256),
        "2048^2 fast": draw(2048, quality="fast"),
    }
    if options.optimise:
        tasks["128^3 optimise"] = grow(128, field=wound, quality="optimise")
    sizes = GROWTH[:-1] if options.quick else GROWTH
    for size in sizes:
        if size != 128:
            tasks[f"{size}^3 fast"] = grow(size, field=wound, quality="fast")
    for quality in ("fast", "optimise") if options.optimise else ("fast",):
        texrs.solid(solid, 32, quality=quality)  # The analysis is cached here, and timed separately.
        texrs.synthesize(flat, 64, quality="fast")
    times: dict[str, list[float]] = {name: [] for name in tasks}
    work: dict[str, float] = {}
    rates = []
    for _ in range(options.rounds):
        rates.append(rate())
        for name, task in tasks.items():
            seconds, made = timed(task)
            times[name].append(seconds)
            if isinstance(made, texrs.Synthesis):
                work[name] = products(made.report, 3)
    fastest = max(rates)
    print(f"{fastest / 1e9:.0f} thousand million multiplications a second in a matrix product\n")
    print("| task | seconds | points a second | floor, seconds | over the floor |\n|---|---|---|---|---|")
    median = {name: float(np.median(t)) for name, t in times.items()}
    for name, seconds in median.items():
        side, axes = (int(n) for n in name.removeprefix("analysis of ").split()[0].split("^"))
        floor = work.get(name, 0.0) / fastest
        cells = (f"{floor:.2f}", f"{seconds / floor:.1f}") if floor else ("", "")
        print(f"| {name} | {seconds:.3f} | {side**axes / seconds / 1e6:.2f} million | {cells[0]} | {cells[1]} |")
    each = [median[f"{n}^3 fast"] / n**3 for n in sizes]
    growth = ", ".join(f"{n}^3 {1e6 * t:.2f}" for n, t in zip(sizes, each, strict=True))
    print(f"\nMicroseconds a voxel, fast: {growth}; the largest over the least {max(each) / min(each):.2f}")
    print(f"The naive loop takes {naive():.0f} times as long as the kernel on one thread, for the same bytes.")
    for quality in ("fast", "preserve"):
        whole, empty = peak(128, quality)
        print(f"Peak of memory of 128^3 {quality}: {whole:.0f} MiB, {whole - empty:.0f} MiB more than texrs itself")


if __name__ == "__main__":
    main()

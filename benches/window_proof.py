"""Check the bytes of random windows of unbounded textures: they must not depend on the order of requests.

Run ``python benches/window_proof.py [--windows 100] [--seed 1] [--axes N] [--only FIELD]``. For images and volumes,
each without a field and under two, a whole is computed first. Then workers, forked and spawned, with 1, 2 and 7
threads, request the same random windows in different orders. Their textures cache all, little or nothing. Pixels and
coordinates are compared with the whole, byte by byte. Each row of the table is a worker. The exit code is 1 if any
byte differs.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor

import numpy as np

import texrs
from texrs import fields, samples

FIELDS: dict[str, Callable[[int], fields.Field | None]] = {
    "none": lambda axes: None,
    "circular": lambda axes: fields.circular(centre=(5,) * axes, axes=axes),
    "zigzag": lambda axes: fields.zigzag(period=24, angle=30, axes=axes),
}
"""Fields. The pole of the circular field and folds of the zigzag field are inside the whole."""
SIDE, LARGEST = {2: 160, 3: 28}, {2: 48, 3: 10}
"""Side of the whole, whose middle is the origin, and of a window."""
KEPT = (1 << 28, 1 << 17, 0)
"""Bytes that textures cache."""
SELDOM = (1, 20, 100)
"""One in this many windows is requested from a texture with each cache size. A smaller cache takes longer."""

Window = tuple[tuple[int, ...], tuple[int, ...]]
"""Origin and size."""
Task = tuple[int, str, int, int, tuple[Window, ...]]
"""Axes, field, threads, seed of the order, and windows."""


def make_texture(axes: int, field: str, kept: int) -> texrs.PlaneTexture | texrs.SolidTexture:
    """Return a texture with a given cache size in bytes."""
    if axes == 2:
        return texrs.PlaneTexture(samples.dots((48, 48)).image, field=FIELDS[field](2), seed=3, cache_bytes=kept)
    return texrs.SolidTexture(samples.particles((32, 32, 32)).image, field=FIELDS[field](3), seed=3, cache_bytes=kept)


def draw(axes: int, count: int, seed: int) -> tuple[Window, ...]:
    """Return random windows of the whole."""
    rng, half = np.random.default_rng([seed, axes]), SIDE[axes] // 2
    sizes = rng.integers(1, LARGEST[axes] + 1, (count, axes))
    origins = rng.integers(-half, half - sizes + 1)
    return tuple((tuple(o), tuple(n)) for o, n in zip(origins.tolist(), sizes.tolist(), strict=True))


def ask(task: Task) -> tuple[list[tuple[int, bytes, bytes]], float]:
    """Return the windows in the requested order (number, pixels and coordinates), and processor seconds."""
    axes, field, threads, seed, windows = task
    rng = np.random.default_rng([seed, axes, threads])
    kept = [make_texture(axes, field, size) for size in KEPT]
    found = []
    with texrs.threads(threads):
        for number, k in enumerate(rng.permutation(len(windows)).tolist()):
            least = max(j for j, every in enumerate(SELDOM) if number % every == every - 1)
            seen = kept[least].window(*windows[k])
            found.append((k, seen.image.tobytes(), seen.source_map.coordinates.tobytes()))
    return found, time.process_time()


def cut(whole: np.ndarray, axes: int, window: Window) -> bytes:
    """Return the bytes of a window of the whole."""
    here = tuple(slice(o + SIDE[axes] // 2, o + SIDE[axes] // 2 + n) for o, n in zip(*window, strict=True))
    return whole[here].tobytes()


def count_differing(a: bytes, b: bytes) -> int:
    """Return the number of different bytes, or all bytes if the numbers differ."""
    if len(a) != len(b):
        return max(len(a), len(b))
    return int(np.count_nonzero(np.frombuffer(a, np.uint8) != np.frombuffer(b, np.uint8)))


def prove(axes: int, field: str, windows: Sequence[Window], seed: int) -> tuple[int, int]:
    """Run all workers, and print a line for each. Return the numbers of windows and of different bytes."""
    began, half = time.perf_counter(), SIDE[axes] // 2
    whole = make_texture(axes, field, KEPT[0]).window((-half,) * axes, (SIDE[axes],) * axes)
    image, coordinates = np.asarray(whole.image), np.asarray(whole.source_map.coordinates)
    print(f"| {axes}-D | {field} | the whole | | | | {time.perf_counter() - began:.1f} |", flush=True)
    asked, differing = 0, 0
    for method in ("fork", "spawn"):
        if method not in multiprocessing.get_all_start_methods():
            continue
        for threads in (1, 2, 7):
            began = time.perf_counter()
            with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context(method)) as pool:
                task = (axes, field, threads, seed + (method == "spawn"), tuple(windows))
                found, spent = pool.submit(ask, task).result()
            wrong = sum(
                count_differing(pixels, cut(image, axes, windows[k]))
                + count_differing(places, cut(coordinates, axes, windows[k]))
                for k, pixels, places in found
            )
            asked, differing = asked + len(found), differing + wrong
            took = time.perf_counter() - began
            print(
                f"| {axes}-D | {field} | {method} | {threads} | {len(found)} | {wrong} | {took:.1f} ({spent:.1f}) |",
                flush=True,
            )
    return asked, differing


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--windows", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--axes", type=int, choices=(2, 3))
    parser.add_argument("--only", choices=FIELDS)
    given = parser.parse_args()
    print(
        "| | field | worker | threads | windows | differing bytes | seconds (of processors) |\n|---|---|---|---|---|---|---|"
    )
    total = np.zeros(2, np.int64)
    for axes in (2, 3) if given.axes is None else (given.axes,):
        windows = draw(axes, given.windows, given.seed)
        for field in FIELDS if given.only is None else (given.only,):
            total += prove(axes, field, windows, given.seed)
    print(f"\n{total[0]} windows, {total[1]} bytes differ")
    sys.exit(int(total[1] > 0))


if __name__ == "__main__":
    main()

"""Measure how fast workers fill a store, and their memory; check that the bytes are the same.

Run ``python benches/stores_table.py volume|items|matrix|tiles|model [--side 512] [--workers 1,2]``. Processor seconds
are printed next to wall seconds, which are only valid on an idle machine. Their ratio is the efficiency on an idle
machine.
"""

import argparse
import functools
import hashlib
import itertools
import multiprocessing
import os
import resource
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np

import texrs
from texrs import samples, stores
from texrs._chunks.grid import Grid
from texrs._engine.pyramid import Region

CLOSED = (False, False, False)


@dataclass
class Spent:
    """Time and memory of work, in this process and in its finished children."""

    wall: float = 0.0
    processor: float = 0.0
    memory: float = 0.0
    """Memory of the largest child process, in GiB."""


@contextmanager
def measure() -> Iterator[Spent]:
    spent = Spent()
    both = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    start, before = time.perf_counter(), sum(u.ru_utime + u.ru_stime for u in map(resource.getrusage, both))
    yield spent
    # Wait for child processes, because their memory is only known after their end.
    for each in multiprocessing.active_children():
        each.join(60)
    used = list(map(resource.getrusage, both))
    spent.wall = time.perf_counter() - start
    spent.processor = sum(u.ru_utime + u.ru_stime for u in used) - before
    spent.memory = used[1].ru_maxrss / 2**20


def digest(array: np.ndarray) -> str:
    return hashlib.sha256(np.ascontiguousarray(array)).hexdigest()[:16]


def volume(given: argparse.Namespace, folder: str) -> None:
    """Fill a volume, and compare it with windows computed separately."""
    texture = texrs.SolidTexture(samples.particles((48, 48, 48)).image, seed=1, cache_bytes=given.cache << 20)
    stated = texture.estimate_memory(given.chunks) / 2**30
    first = None
    for workers in map(int, given.workers.split(",")):
        path = f"{folder}/{workers}.zarr"
        with measure() as spent:
            texture.to_zarr(path, given.side, given.chunks, levels=given.levels, scheduler=workers, threads=1)
        whole = stores.open_store(path)
        rng, same = np.random.default_rng(0), []
        for _ in range(given.windows):
            low = rng.integers(0, given.side - 40, 3)
            made = texture.window(low.tolist(), 40).image
            same.append(np.array_equal(made, whole[tuple(slice(a, a + 40) for a in low)].compute()))
        rate = given.side**3 / spent.wall / 1e6
        said = digest(np.stack([digest(whole[i : i + 64].compute()) for i in range(0, given.side, 64)]))
        print(
            f"{given.side}^3 in chunks of {given.chunks}^3, {workers} workers: {spent.wall:.0f} s of the wall "
            f"({rate:.3f} million voxels a second), {spent.processor:.0f} processor seconds "
            f"({spent.processor / given.side**3 * 1e6:.2f} a million voxels), {spent.memory:.2f} GiB at most "
            f"({stated:.2f} stated beforehand); {sum(same)} of {len(same)} windows the same; {said}",
            flush=True,
        )
        if first is None:
            first = workers, spent
        else:
            share = first[1].processor / spent.processor * workers / first[0]
            print(f"  efficiency by processor seconds {share:.2f}, by the wall {first[1].wall / spent.wall:.2f}")
        if not given.keep:
            shutil.rmtree(path)


def model(given: argparse.Namespace, folder: str) -> None:
    """Count the boxes that workers would compute, instead of computing them.

    Boxes at the sides of their parts are computed twice.
    """
    texture = texrs.SolidTexture(samples.particles((48, 48, 48)).image, seed=1, cache_bytes=given.cache << 20)
    world, made = texture._world, 0
    texture.window(0, 1)
    size = world.cached // len(world._kept._kept)

    def make(*_: object) -> SimpleNamespace:
        nonlocal made
        made += 1
        return SimpleNamespace(nbytes=size)

    world._make = make
    grid, first = Grid.of(given.side, given.chunks, 3), None
    order = grid.sort(range(len(grid)))
    for workers in map(int, given.workers.split(",")):
        made = 0
        for k in range(workers):
            world.clear()
            for number in order[len(order) * k // workers : len(order) * (k + 1) // workers]:
                box = Region(
                    tuple(s.stop - s.start for s in grid[number]), tuple(s.start for s in grid[number]), CLOSED
                )
                for _ in world._make_all(world._meeting(len(world.shifts) - 1, box), None):
                    pass
        first = first or (made, workers)
        least = (len(world.shifts) - 1) * (given.side / world.side) ** 3
        print(
            f"{given.side}^3 in chunks of {given.chunks}^3, {workers} workers: {made} boxes of {world.side}^3, "
            f"{made / least:.2f} times as many as fill it; efficiency {first[0] / made:.2f}",
            flush=True,
        )


def make_variant(image: np.ndarray, size: int, folder: str | None, seed: int) -> texrs.Synthesis:
    if folder is not None:
        with open(f"{folder}/{os.getpid()}.log", "a") as file:
            file.write(f"{seed}\n")
    return texrs.synthesize(image, size, seed=seed)


def make_pair(pictures: list[np.ndarray], size: int, folder: str | None, row: int, column: int) -> np.ndarray:
    if folder is not None:
        with open(f"{folder}/{os.getpid()}.log", "a") as file:
            file.write(f"{row} {column}\n")
    return texrs.splice(pictures[row], pictures[column]).image[:size, :size]


def compute(given: argparse.Namespace, folder: str, function: functools.partial, items: list, shape: object) -> None:
    """Compute items in this process and on a cluster. Compare time and digests."""
    from distributed import Client, LocalCluster

    spent, found = {}, {}
    counts = {0: min(given.alone or len(items), len(items)), 2: len(items)}
    for workers, count in counts.items():
        log = f"{folder}/log{workers}"
        os.makedirs(log)
        work = functools.partial(function.func, *function.args, log)
        path = f"{folder}/{workers}.items"
        with measure() as spent[workers]:
            if workers:
                with (
                    LocalCluster(
                        n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=":0"
                    ) as cluster,
                    Client(cluster) as client,
                ):
                    stores.map_to_zarr(work, items, path, shape=shape, key="bench", scheduler=client)
            else:
                stores.map_to_zarr(
                    work, items[:count], path, shape=shape if count == len(items) else None, key="bench", threads=1
                )
        made = stores.open_store(path, "image")
        found[workers] = digest(made.reshape(-1, *made.shape[-3:])[: counts[0]].compute())
        lines = [line for each in Path(log).iterdir() for line in each.read_text().splitlines()]
        print(
            f"{count} items, {workers or 'no'} workers: {spent[workers].wall:.1f} s of the wall, "
            f"{spent[workers].processor:.1f} processor seconds, {spent[workers].processor / count:.4f} an item; "
            f"computed {len(lines)} times, {len(set(lines))} different; {found[workers]}",
            flush=True,
        )
    each = {workers: (spent[workers].processor / n, spent[workers].wall / n) for workers, n in counts.items()}
    print(
        f"  of ideal {each[0][0] / each[2][0]:.2f} by processor seconds, {each[0][1] / each[2][1] / 2:.2f} by the wall; "
        f"the first {counts[0]} the same: {found[0] == found[2]}",
        flush=True,
    )


def items(given: argparse.Namespace, folder: str) -> None:
    """Return variants of one image."""
    image = samples.dots((96, 96)).image
    work = functools.partial(make_variant, image, given.size)
    compute(given, folder, work, [{"seed": seed} for seed in range(given.count)], None)


def matrix(given: argparse.Namespace, folder: str) -> None:
    """Return splices of all pairs of images."""
    pictures = [samples.dots((96, 96), seed=seed).image for seed in range(given.rows)]
    work = functools.partial(make_pair, pictures, 96)
    pairs = [{"row": r, "column": c} for r, c in itertools.product(range(given.rows), repeat=2)]
    compute(given, folder, work, pairs, (given.rows, given.rows))


def tiles(given: argparse.Namespace, folder: str) -> None:
    """Return windows of corner tiles far away."""
    with measure() as spent:
        made = texrs.CornerTiles(samples.pebbles((192, 192)).image, seed=1)
    print(f"{made}: made in {spent.processor:.0f} processor seconds")
    for far in (0, 10**12):
        start, busy = time.perf_counter(), time.process_time()
        window = made[far : far + 4096, -far : 4096 - far]
        busy = time.process_time() - busy
        print(
            f"4096^2 at {far}: {time.perf_counter() - start:.3f} s of the wall, {busy:.3f} processor; {digest(window)}"
        )
    with measure():
        made.to_zarr(f"{folder}/t.zarr", 4096, 1024, origin=(10**12, -(10**12)), levels=1, scheduler=2)
    print(f"  by two workers {digest(stores.open_store(f'{folder}/t.zarr').compute())}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("part", choices=("volume", "items", "matrix", "tiles", "model"))
    parser.add_argument("--side", type=int, default=256)
    parser.add_argument("--chunks", type=int, default=128)
    parser.add_argument("--cache", type=int, default=256, help="MiB of finished parts that each worker keeps.")
    parser.add_argument("--levels", type=int, default=1)
    parser.add_argument("--windows", type=int, default=4)
    parser.add_argument("--workers", default="1,2")
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument(
        "--alone", type=int, help="How many items one process computes to compare with; all by default."
    )
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--rows", type=int, default=20)
    parser.add_argument("--folder", help="For the stores; a temporary one by default.")
    parser.add_argument("--keep", action="store_true", help="Keep the volumes.")
    given = parser.parse_args()
    part = {"volume": volume, "items": items, "matrix": matrix, "tiles": tiles, "model": model}[given.part]
    with tempfile.TemporaryDirectory(dir=given.folder) as folder:
        part(given, given.folder if given.keep else folder)


if __name__ == "__main__":
    main()

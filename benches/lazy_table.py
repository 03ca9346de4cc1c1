"""How fast workers fill a store, what memory they take, and whether all is the same.

Run ``python benches/lazy_table.py [--side 192] [--chunks 96] [--items 200]``. Seconds are of the wall: let nothing else run.
"""

import argparse
import functools
import resource
import tempfile
import time

import numpy as np

import texrs
from texrs import lazy, samples


def store(texture: texrs.SolidTexture, side: int, chunks: int, folder: str, workers: int) -> tuple[float, np.ndarray]:
    start = time.perf_counter()
    done = texture.to_zarr(f"{folder}/{workers}.zarr", side, chunks, levels=1, scheduler=workers, threads=1)
    return time.perf_counter() - start, lazy.open(done.path).compute()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--side", type=int, default=192)
    parser.add_argument("--chunks", type=int, default=96)
    parser.add_argument("--items", type=int, default=200)
    given = parser.parse_args()
    texture = texrs.SolidTexture(samples.particles((48, 48, 48)).image, seed=1)
    texture.exemplar.stitcher  # noqa: B018
    with tempfile.TemporaryDirectory() as folder:
        times, volumes = zip(*(store(texture, given.side, given.chunks, folder, n) for n in (1, 2)), strict=True)
        memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 2**20
        rng = np.random.default_rng(0)
        low = rng.integers(0, given.side - 40, 3)
        window = texture.window(low.tolist(), 40).image
        same = np.array_equal(window, volumes[1][tuple(slice(a, a + 40) for a in low)])
        rate = given.side**3 / times[1] / 1e6
        print(f"{given.side}^3, chunks {given.chunks}^3: 1 worker {times[0]:.1f} s, 2 workers {times[1]:.1f} s,")
        print(f"  efficiency {times[0] / times[1]:.2f}, {rate:.3f} million voxels a second, {memory:.2f} GiB at most,")
        print(f"  equal {np.array_equal(*volumes)}, and to a window made alone {same}")
        make = functools.partial(texrs.synthesize, samples.dots((96, 96)).image, 128)
        items = [{"seed": seed} for seed in range(given.items)]
        spent = {}
        for workers in (None, 2):
            start = time.perf_counter()
            lazy.map(make, items, f"{folder}/{workers}.items", scheduler=workers)
            spent[workers] = time.perf_counter() - start
        share = spent[None] / spent[2]
        print(
            f"{given.items} variants of 128^2: here {spent[None]:.1f} s, 2 workers {spent[2]:.1f} s, ratio {share:.2f}"
        )


if __name__ == "__main__":
    main()

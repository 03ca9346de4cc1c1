"""Measure time and memory of windows of unbounded textures.

Run ``python benches/solid_window.py [--quality Q] [--volume N]``. Processor seconds are the sum over all threads. On
an idle machine, divide them by its cores to get wall time. ``--volume`` also writes a volume of N voxels a side to
disk, slab by slab.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import texrs
from texrs import fields, io, samples


def measured(name: str, work: Callable[[], object]) -> None:
    """Print the time of a call."""
    began, processor = time.perf_counter(), time.process_time()
    work()
    print(
        f"{name:44s} {time.perf_counter() - began:7.2f} s  {time.process_time() - processor:7.2f} processor s",
        flush=True,
    )


def peak() -> str:
    """Return the peak memory so far."""
    return f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB at most"


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--volume", type=int, default=0)
    parser.add_argument("--quality", choices=("preserve", "optimise", "fast"), default="preserve")
    asked = parser.parse_args()
    exemplar, picture = samples.particles().image, samples.load("weave").image
    exemplar, picture = texrs.Exemplar(exemplar, axes=3), texrs.Exemplar(picture)
    for known in (exemplar, picture):
        known.analyse()
        _ = known.stitcher
    for field in (None, fields.circular(), fields.zigzag()):
        texture = texrs.SolidTexture(exemplar, field=field, seed=1, quality=asked.quality)
        name = "none" if field is None else field.describe().split(",")[0].split(" of")[0]
        measured(f"64^3, field {name}, cold", lambda t=texture: t[0:64, 0:64, 0:64])
        measured(f"64^3, field {name}, its neighbour", lambda t=texture: t[0:64, 0:64, 64:128])
        measured(f"64^3, field {name}, again", lambda t=texture: t[0:64, 0:64, 32:96])
    texture = texrs.SolidTexture(exemplar, seed=1, quality=asked.quality)
    measured("slice of 256^2 across (1, 1, 1), cold", lambda: texture.slice((0, 0, 0), (1, 1, 1), size=256))
    plane = texrs.PlaneTexture(picture, seed=1, quality=asked.quality)
    measured("256^2, cold", lambda: plane[0:256, 0:256])
    measured("256^2, its neighbour", lambda: plane[0:256, 256:512])
    measured("2048^2, cold", lambda: plane[5000:7048, 0:2048])
    print(peak())
    if side := asked.volume:
        texture = texrs.SolidTexture(exemplar, seed=1, quality=asked.quality)
        slabs = (texture[z : min(z + 32, side), 0:side, 0:side] for z in range(0, side, 32))
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "large.npy")
            measured(f"{side}^3 to disk", lambda: io.write_slabs(path, slabs, (side, side, side, 3)))
        print(peak())


if __name__ == "__main__":
    main()

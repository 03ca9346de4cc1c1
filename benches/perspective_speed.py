"""Measure time and memory of PERSPECTIVE: wall and CPU seconds by size, growth with the output, bytes for each pixel.

Memory is the peak resident size since the start, without the remains of a small result and the returned image, source
map and stages. The resized copies of the exemplar, about 20 MB here, do not grow with the output.

python benches/perspective_speed.py [--largest 1024] [--repeat 3]
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
from pathlib import Path

import numpy as np

import texrs
from texrs import scale_maps

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))
import perspective_checks as checks


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--largest", type=int, default=1024)
    parser.add_argument("--repeat", type=int, default=3)
    asked = parser.parse_args()
    image, scale = checks.floor((160, 160))
    texrs.perspective(image, scale, 64)  # Do the work that is done only once.
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print("| output | seconds | CPU | microseconds of CPU a pixel | bytes a pixel above what is given back |")
    print("|---|---|---|---|---|")
    for side in (192, 256, 512, 1024, 2048):
        if side > asked.largest:
            break
        wall, cpu = [], []
        for seed in range(asked.repeat):
            start = time.perf_counter(), time.process_time()
            made = texrs.perspective(image, scale, side, seed=seed)
            wall.append(time.perf_counter() - start[0])
            cpu.append(time.process_time() - start[1])
            source = made.source_map
            parts = (source.coordinates, source.exemplar, source.label, *made.stages.values())
            given = sum(part.nbytes for part in parts)
            del made, source, parts  # Do not count this result with the next one.
        peak = ((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024 - given) / side**2
        print(
            f"| {side}^2 | {min(wall):.2f} | {min(cpu):.2f} | {min(cpu) / side**2 * 1e6:.2f} | {peak:.0f} |", flush=True
        )
    mask = scale_maps.auto_mask(checks.floor((256, 256))[0])
    large = np.tile(mask, (4, 4))
    start = time.process_time()
    scale_maps.from_mask(large)
    print(f"\nscale map of a mask of one megapixel: {time.process_time() - start:.2f} s of CPU")


if __name__ == "__main__":
    main()

"""Flat textures of floors whose planes are known: how evenly large things are in them, and how square.

    [TEXRS_TEXTURES=FOLDER] python benches/rectify_table.py [--pictures DIR]

Each floor, generated or told by ``ground-truth.json`` in FOLDER, is made flat as `texrs.rectify` finds it. Of every pixel of
the texture the true plane says how large a piece of the floor it shows, and how far from square that is. The spread is the
standard deviation of the natural logarithm of the size; 0.08 is asked at most. By hand, of the true plane, there is none. All
are homographies, so that straight lines stay straight. With `--pictures` each photograph and its flat texture are written.
"""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from itertools import chain
from pathlib import Path

import numpy as np

import texrs
from texrs import io

sys.path.insert(0, str(Path(__file__).resolve().parent))
from planes_table import floors, told


def measure(made: texrs.Synthesis, true: texrs.Plane) -> tuple[float, float]:
    """Return the spread of sizes of a flat texture, and by how much things are stretched in the median."""
    at = made.source.coordinates[::4, ::4].astype(np.float64)
    shown = np.linalg.inv(true.unfold(true.flatten(at))) @ made.source.frames()[::4, ::4]
    values = np.linalg.svd(shown, compute_uv=False)
    return float(np.log(values).mean(axis=-1).std()), float(np.median(values[..., 0] / values[..., 1]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pictures", type=Path)
    options = parser.parse_args()
    print("| floor | true slant | found | confidence | spread | stretched | by hand |\n" + "|---" * 7 + "|", flush=True)
    spreads = []
    for number, (name, plane, picture) in enumerate(chain(floors(1), told(os.environ.get("TEXRS_TEXTURES")))):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            made = texrs.rectify(picture, view=texrs.View(fov=plane.fov))
        found = made.report["plane"]
        spread, stretched = measure(made, plane)
        hand, _ = measure(texrs.rectify(picture, view=plane), plane)
        spreads.append(spread)
        sure = f"{found['slant']:.1f} | {found['confidence']:.2f}"
        print(f"| {name} | {plane.slant:.1f} | {sure} | {spread:.3f} | {stretched:.2f} | {hand:.3f} |", flush=True)
        if options.pictures:
            options.pictures.mkdir(parents=True, exist_ok=True)
            io.write(options.pictures / f"{number:02d}-{name}.png", picture)
            io.write(options.pictures / f"{number:02d}-{name}-flat.png", made.image)
    within = sum(s <= 0.08 for s in spreads)
    print(f"\nspread at most 0.08 in {within} of {len(spreads)}; median {np.median(spreads):.3f}")


if __name__ == "__main__":
    main()

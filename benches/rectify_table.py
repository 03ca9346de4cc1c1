"""Check flat textures of floors with known planes: how equal the sizes of elements are, and whether they can be tiled.

    [TEXRS_TEXTURES=FOLDER] python benches/rectify_table.py [--pictures DIR]
        [--evaluator <texture_quality.py>] [--tears <deep_quality.py>]

Each floor is generated, or specified by ``ground-truth.json`` in FOLDER, and flattened by `texrs.rectify` without
hints. The true plane gives the size and the stretch of the floor area that each pixel shows. The spread is the
standard deviation of the natural logarithm of this size. At most 0.08 is required. The columns "by hand" are for a
person who clicks the four corners of a rectangle of the true plane. Their coordinates are whole pixels, and off by up
to one pixel. All results are homographies, so straight lines stay straight.

With an evaluator that has `tile`, two tiles are judged: the result with ``wrap=True``, and the texture by hand as it
is. The table gives the bounds that each tile fails. A line inside it may be 1.5 times as visible as in the flat
texture. With an evaluator that has `Judge`, the tile is rolled by half of its size, and the table gives the share that
looks torn compared with the flat texture. At most 0.18 is required. `--pictures` writes each photograph, its flat
texture, and both tiles, 2 x 2 of each.
"""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

import texrs
from texrs import io

sys.path.insert(0, str(Path(__file__).resolve().parent))
from evaluators import as_float, load
from planes_table import floors, told


def measure(made: texrs.Synthesis, true: texrs.Plane) -> tuple[float, float]:
    """Return the spread of sizes of a flat texture, and the median stretch."""
    at = made.source_map.coordinates[::4, ::4].astype(np.float64)
    shown = np.linalg.inv(true.projection_jacobians(true.flatten(at))) @ made.source_map.jacobians()[::4, ::4]
    values = np.linalg.svd(shown, compute_uv=False)
    return float(np.log(values).mean(axis=-1).std()), float(np.median(values[..., 0] / values[..., 1]))


def click(plane: texrs.Plane, rng: np.random.Generator) -> texrs.Plane:
    """Return the plane of four corners of a rectangle that a person clicks in a photograph, up to one pixel off."""
    rows, columns = plane.shape
    middle = plane.flatten(np.array([[0.62 * rows, 0.5 * columns]]))[0]
    for half in np.geomspace(0.5 * min(rows, columns), 8, 24):
        corners = plane.project(middle + half * np.array([[-1, -1], [-1, 1], [1, 1], [1, -1]]))
        if (corners >= 2).all() and (corners <= np.array([rows, columns]) - 3).all():
            break
    seen = np.rint(corners) + rng.integers(-1, 2, corners.shape)
    return texrs.Plane.of_corners(plane.shape, seen, fov=plane.fov)


def judge_tile(evaluator: Any, tears: Any, flat: np.ndarray, tile: np.ndarray) -> tuple[list[str], float]:
    """Return the evaluator's bounds that a tile fails, and the share that another evaluator finds torn."""
    one, other = as_float(flat), as_float(tile)
    failed = []
    if evaluator is not None:
        found, own = evaluator.tile(other), evaluator.tile(one)
        bounds = {n: evaluator.BOUNDS[n] for n in found if n in evaluator.BOUNDS}
        bounds["hidden"] = 0.0, 1.5 * max(own["hidden"], 0.2)
        failed = [n for n, (low, high) in bounds.items() if not low <= found[n] <= high]
    rolled = np.roll(other, (other.shape[0] // 2, other.shape[1] // 2), (0, 1))
    torn = (
        np.nan
        if tears is None or min(*flat.shape[:2], *tile.shape[:2]) < 96
        else tears.Judge(one).scores(rolled)["tear"]
    )
    return failed, float(torn)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pictures", type=Path)
    parser.add_argument("--evaluator", type=Path)
    parser.add_argument("--tears", type=Path)
    options = parser.parse_args()
    evaluator, tears = (None if path is None else load(path) for path in (options.evaluator, options.tears))
    judged = evaluator is not None or tears is not None
    names = ["floor", "true slant", "found", "confidence", "spread", "stretched", "by hand: spread", "stretched"]
    names += ["tile: fails", "torn", "by hand: fails", "torn"] if judged else []
    print("| " + " | ".join(names) + " |\n" + "|---" * len(names) + "|", flush=True)
    spreads, fails, rng = [], [], np.random.default_rng(0)
    for number, (name, plane, picture) in enumerate(chain(floors(1), told(os.environ.get("TEXRS_TEXTURES")))):
        view = texrs.PlaneView(fov=plane.fov)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            made = texrs.rectify(picture, view=view)
            found = made.report["plane"]
            spread, stretched = measure(made, plane)
            by_hand = texrs.rectify(picture, view=click(plane, rng))
            hand, aside = measure(by_hand, plane)
            spreads.append(spread)
            cells = [name, f"{plane.slant:.1f}", f"{found['slant']:.1f}", f"{found['confidence']:.2f}"]
            cells += [f"{spread:.3f}", f"{stretched:.2f}", f"{hand:.3f}", f"{aside:.2f}"]
            tile = texrs.rectify(picture, view=view, wrap=True).image if judged else made.image
        if judged:
            ours = judge_tile(evaluator, tears, made.image, tile)
            cut = judge_tile(evaluator, tears, by_hand.image, by_hand.image)
            fails.append([len(ours[0]), len(cut[0]), ours[1] <= 0.18, cut[1] <= 0.18])
            for failed, torn in (ours, cut):
                cells += [", ".join(failed) or "-", f"{torn:.2f}"]
        print("| " + " | ".join(cells) + " |", flush=True)
        if options.pictures:
            options.pictures.mkdir(parents=True, exist_ok=True)
            io.write(options.pictures / f"{number:02d}-{name}.png", picture)
            io.write(options.pictures / f"{number:02d}-{name}-flat.png", made.image)
            for kind, shown in (("tile", tile), ("hand", by_hand.image)) if judged else ():
                io.write(options.pictures / f"{number:02d}-{name}-{kind}.png", np.tile(shown, (2, 2, 1)))
    within = sum(s <= 0.08 for s in spreads)
    print(f"\nspread at most 0.08 in {within} of {len(spreads)}; median {np.median(spreads):.3f}")
    if judged:
        ours, cut, whole, pieces = zip(*fails, strict=True)
        print(f"no bound failed: {sum(n == 0 for n in ours)}, by hand {sum(n == 0 for n in cut)} of {len(fails)}")
        print(
            f"torn at most 0.18: {sum(whole)}, by hand {sum(pieces)} of {len(fails)}; too small for a judge count as torn"
        )


if __name__ == "__main__":
    main()

"""Check volumes of separate elements: are they whole, separate, of one colour, and of the expected number?

    python benches/integrity_table.py [--size 96] [--seeds 3] [--only NAME] [--pictures DIR]

This script draws volumes of 64^3 voxels: cells of several colours with walls of three and of two voxels, and spheres of
several colours on a background. The sample "particles" is added. All are grown without a field and under a
circular one. For each seed the table gives:

- contacts without a border in 1000 voxels, and the share of the largest part;
- torn elements, and parts of several colours;
- parts for each voxel, divided by the exemplar's;
- the minimum and maximum share of the classes of elements, divided by the exemplar's;
- the share of points that show a sample which another point also shows.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

import texrs
from texrs import fields, io, samples, volume

SIDE = 64
COLOURS = np.array([[196, 58, 46], [52, 120, 190], [228, 180, 60], [70, 150, 84], [150, 90, 160]], np.float64)
DARK = np.array([34.0, 30, 28])

Volume = NDArray[np.uint8]
Labels = NDArray[np.int64]


def draw_cells(seed: int = 0, apart: float = 15.0, wall: float = 3.0) -> tuple[Volume, Labels]:
    """Draw cells of five colours with dark walls. Return the volume and the colour index of each voxel, 0 for none."""
    random = np.random.default_rng(seed)
    steps = np.arange(-1.0, SIDE // apart + 2) * apart
    points = np.stack(np.meshgrid(*[steps] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    points += random.uniform(-0.35, 0.35, points.shape) * apart
    grid = np.stack(np.meshgrid(*[np.arange(SIDE)] * 3, indexing="ij"), axis=-1)
    away, near = cKDTree(points).query(grid, k=2)
    kind = random.integers(1, len(COLOURS) + 1, len(points))[near[..., 0]]
    return _paint(np.where(away[..., 1] - away[..., 0] < wall, 0, kind), random)


def draw_spheres(seed: int = 0, radius: tuple[float, float] = (4.0, 8.0)) -> tuple[Volume, Labels]:
    """Draw separate spheres of five colours on a dark background. Return the volume and the colour index, 0 for none."""
    random = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(*[np.arange(SIDE)] * 3, indexing="ij"), axis=-1)
    kind = np.zeros((SIDE,) * 3, np.int64)
    put: list[tuple[NDArray[np.float64], float]] = []
    for _ in range(6000):
        centre, size = random.uniform(-4, SIDE + 4, 3), random.uniform(*radius)
        if all(np.hypot.reduce(centre - c) > size + s + 1.5 for c, s in put):
            put.append((centre, size))
            kind[((grid - centre) ** 2).sum(axis=-1) <= size**2] = random.integers(1, len(COLOURS) + 1)
    return _paint(kind, random)


def _paint(kind: Labels, random: np.random.Generator) -> tuple[Volume, Labels]:
    colours = np.concatenate([DARK[np.newaxis], COLOURS])[kind]
    soft = ndimage.gaussian_filter(colours, (0.6, 0.6, 0.6, 0)) + random.normal(0, 4, (*kind.shape, 1))
    return np.clip(soft, 0, 255).astype(np.uint8), kind


def measure_copies(source: texrs.SourceMap) -> float:
    """Return the share of points that show a sample which another point also shows."""
    places = np.rint(source.coordinates).astype(np.int64)
    flat = np.sort(places.reshape(-1, 3) @ np.array([1 << 40, 1 << 20, 1]))
    return float((np.diff(flat) == 0).mean())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", type=int, default=96)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--only", default="")
    parser.add_argument("--pictures", type=Path)
    asked = parser.parse_args()
    cases: dict[str, Callable[[], tuple[Any, Labels | None]]] = {
        "cells": draw_cells,
        "cells, thin walls": lambda: draw_cells(wall=2.0),
        "spheres": draw_spheres,
        "particles": lambda: (samples.particles((SIDE,) * 3).image, None),
    }
    print("| volume | field | seed | contacts | largest | torn | mixed | parts | classes | samples used again | s |")
    print("|" + "---|" * 11)
    for name, draw in cases.items():
        if asked.only not in name:
            continue
        image, kind = draw()
        known = texrs.Exemplar(image, axes=3)
        for title, field in (("none", None), ("circular", fields.circular(axis="x", radial="z"))):
            for seed in range(1, asked.seeds + 1):
                began = time.process_time()
                made = texrs.solid(known, asked.size, field=field, seed=seed)
                spent = time.process_time() - began
                found = volume.integrity(known, made.source_map)
                if found is None:
                    print(f"| {name} | {title} | {seed} | no separate elements |")
                    continue
                shares = "-"
                if kind is not None:
                    shown = made.source_map.render(kind.astype(np.uint8), interpolation="nearest")
                    counts = [np.bincount(k.ravel().astype(int), minlength=6)[1:] / k.size for k in (kind, shown)]
                    ratio = counts[1] / counts[0]
                    shares = f"{ratio.min():.2f} to {ratio.max():.2f}"
                print(
                    f"| {name} | {title} | {seed} | {found.contacts[1]:.2f} ({found.contacts[0]:.2f}) | {found.largest[1]:.3f} "
                    f"| {found.torn:.3f} | {found.mixed[1]:.3f} ({found.mixed[0]:.3f}) "
                    f"| {found.density[1] / found.density[0]:.2f} | {shares} | {measure_copies(made.source_map):.2f} "
                    f"| {spent:.1f} |",
                    flush=True,
                )
                if asked.pictures is not None:
                    asked.pictures.mkdir(parents=True, exist_ok=True)
                    page = np.concatenate(
                        [
                            np.pad(image[SIDE // 2], ((0, asked.size - SIDE), (0, 0), (0, 0))),
                            made.image[asked.size // 2],
                            made.image[:, asked.size // 2],
                        ],
                        axis=1,
                    )
                    io.write(asked.pictures / f"{name.replace(', ', '-').replace(' ', '-')}-{title}-{seed}.png", page)


if __name__ == "__main__":
    main()

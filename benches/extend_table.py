"""Extend photographs of planes to twice the size, and measure the plane, the sharpness and the time.

    python benches/extend_table.py OUT PICTURE ... [--seed 1]

The script writes `OUT/NAME.png` for each picture: the image extended by `texrs.extend(size=)` with default options.
The plane is found again in the added part only. The table gives its error in degrees and the confidence; a plane that
was not followed has none. Sharpness is the mean gradient of the added part divided by the mean gradient of the
photograph. Border is the mean difference across the photograph's border divided by the mean difference of the next
lines. Both are 1 in the ideal case. Look at the images as well.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from pathlib import Path

import numpy as np

import texrs
from texrs import Plane, PlaneView, io, planes

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))
from plane_checks import turn_between

BESIDE = 6
"""Lines on both sides of a border for the comparison."""


def measure_border(image: np.ndarray, inner: tuple[slice, slice]) -> float:
    """Return the colour difference across the inner borders of a part, divided by the difference next to them."""
    grey = image[..., :3].mean(axis=-1) if image.ndim == 3 else image.astype(float)
    found = []
    for axis in (0, 1):
        lines = np.moveaxis(grey, axis, 0)
        part, count = inner[axis], grey.shape[axis]
        lines = lines[:, inner[1 - axis]]
        steps = np.abs(np.diff(lines, axis=0)).mean(axis=1)
        for at in (part.start - 1, part.stop - 1):
            if BESIDE <= at < count - 1 - BESIDE:
                near = np.r_[at - BESIDE : at - 1, at + 2 : at + BESIDE + 1]
                found.append(steps[at] / max(float(steps[near].mean()), 1e-9))
    return float(np.mean(found)) if found else float("nan")


def measure_gradient(image: np.ndarray, where: np.ndarray) -> float:
    """Return the mean gradient in a part of an image."""
    grey = image[..., :3].mean(axis=-1) if image.ndim == 3 else image.astype(float)
    return float(np.hypot(*np.gradient(grey))[where].mean())


def find_again(image: np.ndarray, new: np.ndarray, seen: Plane) -> str:
    """Return the error of the plane found in the added part, compared with the followed plane, in the larger image."""
    try:
        anew = planes.find(image, fov=seen.fov, known=new)
    except texrs.TexrsError as error:
        return str(error)[:40]
    slant, tilt = turn_between(anew, seen)
    return f"{slant:.1f} / {tilt:.1f} ({anew.confidence:.2f})"


def main() -> None:
    """Write the images and the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("pictures", type=Path, nargs="+")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    names = [
        "picture",
        "slant",
        "tilt",
        "confidence",
        "anew off: slant / tilt",
        "sharpness",
        "border",
        "s of processors",
    ]
    print("| " + " | ".join(names) + " |\n" + "|---" * len(names) + "|", flush=True)
    for path in options.pictures:
        image = io.read(path)
        rows, columns = image.shape[:2]
        start = time.process_time()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            made = texrs.extend(image, size=(2 * rows, 2 * columns), seed=options.seed)
        spent = time.process_time() - start
        io.write(options.out / f"{path.stem}.png", made.image)
        top, left = made.report["added"]["top"], made.report["added"]["left"]
        inner = (slice(top, top + rows), slice(left, left + columns))
        new = np.ones(made.image.shape[:2], np.bool_)
        new[inner] = False
        said = made.report["planes"][0]["plane"]
        cells = ["not followed", "-", "-", "-"]
        if said is not None:
            plane = Plane.of(said)
            # Compute the corners of a rectangle of the plane, in the larger image.
            flat = plane.flatten(np.array([[rows / 2, columns / 2]]))[0]
            ways = min(rows, columns) / 8 * np.array([[-1, -1], [-1, 1], [1, 1], [1, -1]])
            corners = plane.project(flat + ways) + np.array([top, left])
            larger = PlaneView(corners=corners).settle(new.shape)[0]
            cells = [f"{plane.slant:.1f}", f"{plane.tilt:.0f}", f"{plane.confidence:.2f}"]
            cells.append("-" if larger is None else find_again(made.image, new, larger))
        sharp = measure_gradient(made.image, new) / measure_gradient(image, np.ones((rows, columns), np.bool_))
        cells += [f"{sharp:.2f}", f"{measure_border(made.image, inner):.2f}", f"{spent:.1f}"]
        print("| " + " | ".join([path.stem, *cells]) + " |", flush=True)


if __name__ == "__main__":
    main()

"""Check filled holes in oblique images: a Markdown table of texture, method and check, and images.

    TEXRS_TEXTURES=<folder> python benches/holes_table.py [--only NAME] [--resynthesizer PROGRAM] [--pictures DIR]

Textures are the same as in `perspective_table.py`; without a folder, a generated floor of discs. Three holes are cut
into each, one after the other, and filled. Both methods of `texrs.inpaint` use the true scale map, a measured one,
blended colours, and no scales. OpenCV uses `inpaint`, and xphoto's shift map if its contributed modules are installed.
The Resynthesizer is described in `fillers.py`.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import texrs
from texrs import io

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))
import perspective_checks as checks
from fillers import by_opencv, by_program
from perspective_table import textures

try:
    import cv2
except ImportError:
    cv2 = None

Filler = Callable[[np.ndarray, np.ndarray, np.ndarray, int], np.ndarray]
MEANING = """
scale: correlation of the logarithms of the local wavelength and of the true scale in the hole, as a share of the
photograph's own (>= 0.95); seam: mean gradient across its boundary over that inside it, as a share of the photograph's own
(0.7 to 1.4); kept: whether all known pixels are as they were. Figures are means over the holes; **bold** fails.
"""
OPTIONS: dict[str, dict[str, Any]] = {
    "patch": {"method": "patch"},
    "patch, measured": {"method": "patch", "scale_map": "auto"},
    "patch, blended": {"method": "patch", "screening": 0.003},
    "patch, no scales": {"method": "patch", "scale_map": None},
    "optimise": {"method": "optimise"},
    "optimise, measured": {"method": "optimise", "scale_map": "auto"},
    "optimise, blended": {"method": "optimise", "screening": 0.003},
    "optimise, no scales": {"method": "optimise", "scale_map": None},
}


def ours(options: dict[str, Any]) -> Filler:
    def fill(image: np.ndarray, hole: np.ndarray, scale: np.ndarray, seed: int) -> np.ndarray:
        known = np.where(hole, np.nan, scale).astype(np.float32)
        return np.asarray(texrs.inpaint(image, hole, seed=seed, **{"scale_map": known, **options}).image)

    return fill


def peers(program: Path | None) -> dict[str, Filler]:
    """Return the installed peers. None of them supports scales or seeds."""
    found: dict[str, Filler] = {}
    if cv2 is not None:
        found["OpenCV inpaint"] = lambda image, hole, scale, seed: cv2.inpaint(
            image, hole.astype(np.uint8), 5, cv2.INPAINT_TELEA
        )
    if hasattr(cv2, "xphoto"):
        found["OpenCV shift map"] = lambda image, hole, scale, seed: by_opencv(image, hole)[0]
    if program is not None:
        fill = by_program(program)
        found["Resynthesizer"] = lambda image, hole, scale, seed: fill(image, hole)[0]
    return found


def holes_of(shape: tuple[int, ...]) -> list[np.ndarray]:
    """Return three holes side by side where the scale changes: 0.44 of the height and 0.31 of the width in total."""
    found = []
    for middle in (0.3, 0.5, 0.7):
        hole = np.zeros(shape, bool)
        left, right = round(shape[1] * (middle - 0.155)), round(shape[1] * (middle + 0.155))
        hole[round(shape[0] * 0.28) : round(shape[0] * 0.72), left:right] = True
        found.append(hole)
    return found


def without(image: np.ndarray, hole: np.ndarray) -> np.ndarray:
    return np.where(hole[..., np.newaxis], 0, image).astype(np.uint8)


def agreement(image: np.ndarray, hole: np.ndarray, scale: np.ndarray) -> float:
    """Return the correlation of measured and true sizes in a hole, away from its boundary."""
    at = np.argwhere(hole)
    (top, left), (bottom, right) = at.min(axis=0) + 6, at.max(axis=0) - 5
    inside = (slice(top, bottom), slice(left, right))
    seen = checks.wavelength(image)[inside].ravel()
    return float(np.corrcoef(np.log(seen), np.log(scale[inside].ravel()))[0, 1])


def shown(value: float, low: float, high: float = np.inf) -> str:
    return f"{value:.2f}" if low <= value <= high else f"**{value:.2f}**"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="")
    parser.add_argument("--resynthesizer", type=Path)
    parser.add_argument("--pictures", type=Path)
    asked = parser.parse_args()
    fillers = {name: ours(options) for name, options in OPTIONS.items()}
    fillers |= peers(asked.resynthesizer.resolve() if asked.resynthesizer else None)
    print(MEANING + "\n| texture | method | scale | seam | kept | seconds |\n" + "|---" * 6 + "|")
    for name, image, scale in textures(os.environ.get("TEXRS_TEXTURES")):
        if asked.only not in name:
            continue
        holes = holes_of(image.shape[:2])
        own = [agreement(image, hole, scale) for hole in holes]
        edges = [checks.seam(image, hole) for hole in holes]
        print(f"| {name} | itself | ({np.mean(own):.2f}) | ({np.mean(edges):.2f}) | | |", flush=True)
        row = [image, without(image, holes[1])]
        for filler, fill in fillers.items():
            start = time.perf_counter()
            made = [fill(without(image, hole), hole, scale, seed) for seed, hole in enumerate(holes, start=1)]
            spent = (time.perf_counter() - start) / len(holes)
            pairs = list(zip(made, holes, strict=True))
            likeness = np.mean([agreement(m, hole, scale) for m, hole in pairs]) / np.mean(own)
            edge = np.mean([checks.seam(m, hole) for m, hole in pairs]) / np.mean(edges)
            same = all((m[~hole] == image[~hole]).all() for m, hole in pairs)
            print(
                f"| {name} | {filler} | {shown(float(likeness), 0.95)} | {shown(float(edge), 0.7, 1.4)} | "
                f"{'yes' if same else '**no**'} | {spent:.2f} |",
                flush=True,
            )
            row.append(made[1])
        if asked.pictures:
            asked.pictures.mkdir(parents=True, exist_ok=True)
            for label, picture in zip(["itself", "hole", *fillers], row, strict=True):
                io.write(asked.pictures / f"{name}-{label.replace(', ', '-').replace(' ', '-').lower()}.png", picture)


if __name__ == "__main__":
    main()

"""Find planes in single images: generated floors and photographs with known planes; accuracy, reliability and speed.

    [TEXRS_TEXTURES=FOLDER] python benches/planes_table.py [--rounds 4] [--pictures DIR]

Floors are flat samples seen by a pinhole camera: slants of 20 to 65 degrees, all tilts, four angles of view, with and
without noise, half as JPEG. FOLDER contains images and ``ground-truth.json``, which specifies slant, tilt, focal
length and a scale map of some. With `--pictures`, each is drawn next to its flat texture. After the errors of each
texture, four results follow:

- the share of correct planes among those with high confidence;
- the fit of automatic scale maps to the folder's maps;
- the accuracy of the ground plane next to skies, walls and objects;
- the time of each verb at 1024 x 1024.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Iterator
from itertools import pairwise
from math import atan, degrees
from pathlib import Path

import numpy as np

import texrs
from texrs import Plane, io, planes

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))
from plane_checks import dress, look, squeeze, turn_between
from texrs.planes.choose import measure_known_scale

NAMES = ("bricks", "setts", "pebbles", "dots", "weave", "beans", "scales")
SIZE = (256, 320)
RIGHT = (8.0, 15.0)
"""Maximum errors in slant and in tilt, in degrees, of a found plane."""
BINS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)


def floors(rounds: int) -> Iterator[tuple[str, Plane, np.ndarray]]:
    """Return random images of floors with horizons outside."""
    rng = np.random.default_rng(0)
    for number in range(rounds):
        for name in NAMES:
            while True:
                plane = Plane(SIZE, rng.uniform(20, 65), rng.uniform(0, 360), float(rng.choice([40, 50, 60, 70])))
                if plane.width(np.argwhere(np.ones(SIZE))).min() > 0.12:
                    break
            picture = look(name, plane, seed=number, noise=float(rng.choice([0, 6])))
            quality = int(rng.choice([0, 0, 60, 85]))
            yield name, plane, squeeze(picture, quality) if quality else picture


def told(folder: str | None) -> Iterator[tuple[str, Plane, np.ndarray]]:
    """Return the images of a folder whose planes are in its ground truth."""
    for path in sorted(Path(folder).rglob("ground-truth.json")) if folder else ():
        for name, truth in json.loads(path.read_text(encoding="utf-8")).items():
            if isinstance(truth, dict) and {"slant_deg", "tilt_deg", "focal_px"} <= set(truth):
                image = io.read(path.parent / name)
                fov = 2 * degrees(atan(max(image.shape[:2]) / 2 / truth["focal_px"]))
                yield Path(name).stem, Plane(image.shape[:2], truth["slant_deg"], truth["tilt_deg"], fov), image


def print_maps(folder: str | None) -> None:
    """Print how well automatic scale maps of a folder's images fit its ground truth."""
    print("\n| picture | correlation of the scale map |\n|---|---|")
    for path in sorted(Path(folder).rglob("*-scale.npy")) if folder else ():
        image = io.read(path.with_name(path.name.replace("-scale.npy", ".png")))
        truth = np.log(np.load(path).astype(np.float64))
        mine = np.log(measure_known_scale(image, np.ones(image.shape[:2], np.bool_)).scale[::2, ::2])
        print(f"| {path.stem} | {np.corrcoef(mine.ravel(), truth.ravel())[0, 1]:.4f} |")


SCENES = {"nothing": {}, "sky": {"above": "sky"}, "things": {"things": 3}, "sky, things": {"above": "sky", "things": 3}}
SCENES |= {f"a wall of {name}": {"above": name} for name in ("bark", "grit", "bricks")}


def print_grounds() -> None:
    """Print the accuracy of the ground area of each scene (intersection over union) and of its plane (degrees)."""
    print("\n| beside the floor | ground: mean | least | plane off: slant | tilt, medians |\n" + "|---" * 5 + "|")
    for kind, options in SCENES.items():
        over, offs = [], []
        for number, name in enumerate(NAMES):
            plane = Plane((300, 400), 30.0 + 6 * number, 60.0 + 12 * number, 55)
            if f"wall of {name}" in kind:
                continue
            picture, truth = dress(look(name, plane), plane.tilt, seed=number, **options)
            found = planes.find_ground(picture)
            over.append((found & truth).sum() / (found | truth).sum())
            offs.append(turn_between(planes.find(picture, fov=55, known=found), plane))
        slant, tilt = np.median(offs, axis=0)
        print(f"| {kind} | {np.mean(over):.2f} | {min(over):.2f} | {slant:.1f} | {tilt:.1f} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=4)
    parser.add_argument("--pictures", type=Path)
    options = parser.parse_args()
    errors: dict[str, list[tuple[float, float]]] = {}
    stated: list[tuple[float, bool]] = []
    for source in (floors(options.rounds), told(os.environ.get("TEXRS_TEXTURES"))):
        for number, (name, plane, picture) in enumerate(source):
            found = planes.find(picture, fov=plane.fov)
            off = turn_between(found, plane)
            errors.setdefault(name, []).append(off)
            stated.append((found.confidence, all(e <= most for e, most in zip(off, RIGHT, strict=True))))
            if options.pictures:
                options.pictures.mkdir(parents=True, exist_ok=True)
                io.write(options.pictures / f"{name}-{number}.png", picture)
                flat = texrs.rectify(picture, view=found)
                io.write(options.pictures / f"{name}-{number}-flat.png", flat.image)
    print("| texture | floors | slant off: median | 90 % | tilt off: median | 90 % |\n" + "|---" * 6 + "|")
    generated = [off for name in NAMES for off in errors[name]]
    for name, offs in [*errors.items(), ("generated", generated)]:
        (slant, tilt), (most, aside) = np.median(offs, axis=0), np.quantile(offs, 0.9, axis=0)
        print(f"| {name} | {len(offs)} | {slant:.1f} | {most:.1f} | {tilt:.1f} | {aside:.1f} |")
    print("\n| confidence | planes | right |\n|---|---|---|")
    for low, high in pairwise(BINS):
        right = [good for sure, good in stated if low <= sure < high or sure == high == 1]
        print(f"| {low} to {high} | {len(right)} | {np.mean(right) if right else float('nan'):.2f} |")
    print_maps(os.environ.get("TEXRS_TEXTURES"))
    print_grounds()
    plane = Plane((1024, 1024), 45, 90, 55)
    picture = look("pebbles", plane)
    hole = np.zeros((1024, 1024), np.bool_)
    hole[500:756, 300:556] = True
    for name, work in (
        ("find", lambda: planes.find(picture, fov=55)),
        ("ground", lambda: planes.find_ground(picture)),
        ("rectify", lambda: texrs.rectify(picture, view=plane)),
        ("extend by 256", lambda: texrs.extend(picture, right=256, view=plane)),
        ("remove a sixteenth", lambda: texrs.remove(picture, hole)),
    ):
        spent = []
        for _ in range(3):
            start = time.process_time()
            work()
            spent.append(time.process_time() - start)
        print(f"\n{name} at 1024 x 1024: {min(spent):.2f} s of processors", end="")
    print()


if __name__ == "__main__":
    main()

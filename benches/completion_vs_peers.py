"""Completion of a square hole in photographs against the Resynthesizer engine and OpenCV: one thread, interleaved.

    python benches/completion_vs_peers.py [--rounds 3] [--resynthesizer PROGRAM] [--out FOLDER] [PHOTOGRAPH ...]

A hole of a quarter of the side, 128 x 128 in 512 x 512, is cut into the middle of each photograph (by default some of
scikit-image's) and filled again. Times are CPU seconds of one thread, the median of the rounds; for texrs of all that
`texrs.complete` does, for the engine without reading and writing files. Quality, over the hole: root mean square error against
the photograph (grey levels), and the patch error: how far 9 x 9 patches that touch the hole are, in the mean, from the nearest
one of the photograph around it (`known`; that of the photograph itself is given as `truth`).

The Resynthesizer (https://github.com/bootchk/resynthesizer, GPL) is an external program that is neither part of texrs nor
linked to it: PROGRAM IMAGE.ppm MASK.pgm OUT.ppm prints the CPU seconds that `imageSynth` of `lib/imageSynth.h` took with the
parameters of `setDefaultParams` on image and mask (255 in the hole). To build it, write a `main` of some twenty lines around
that call and compile it with imageSynth.c, engine.c, glibProxy.c, engineParams.c, imageFormat.c and progress.c of its folder
`lib`: `gcc -O3 -march=native -DNDEBUG -DSYNTH_LIB_ALONE`, after taking SYNTH_THREADED and SYNTH_USE_GLIB_THREADS out of
`lib/buildSwitches.h`.

OpenCV takes part where its contributed module xphoto is installed (`pip install opencv-contrib-python-headless`).
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from skimage import data, io

import texrs
from texrs._rust import set_threads

try:
    import cv2
except ImportError:
    cv2 = None

Picture = np.ndarray
Filler = Callable[[Picture, np.ndarray], tuple[Picture, float]]
PHOTOGRAPHS = ["brick", "grass", "gravel", "rocket", "astronaut", "coffee"]
SIDE, PATCH = 512, 9


def by_texrs(image: Picture, hole: np.ndarray) -> tuple[Picture, float]:
    start = time.process_time()
    made = texrs.complete(image, hole).image
    return made, time.process_time() - start


def by_program(program: Path) -> Filler:
    def fill(image: Picture, hole: np.ndarray) -> tuple[Picture, float]:
        rows, columns = hole.shape
        with tempfile.TemporaryDirectory() as folder:
            names = [Path(folder) / n for n in ("image.ppm", "mask.pgm", "out.ppm")]
            names[0].write_bytes(b"P6\n%d %d\n255\n" % (columns, rows) + image.tobytes())
            names[1].write_bytes(b"P5\n%d %d\n255\n" % (columns, rows) + (hole * np.uint8(255)).tobytes())
            done = subprocess.run([program, *names], check=True, capture_output=True, text=True, timeout=600)
            return io.imread(names[2]), float(done.stdout)

    return fill


def by_opencv(image: Picture, hole: np.ndarray) -> tuple[Picture, float]:
    made, known = np.zeros_like(image), np.where(hole, 0, 255).astype(np.uint8)
    lab = cv2.cvtColor(image, cv2.COLOR_RGB2Lab)
    start = time.process_time()
    cv2.xphoto.inpaint(lab, known, made, cv2.xphoto.INPAINT_SHIFTMAP)
    return cv2.cvtColor(made, cv2.COLOR_Lab2RGB), time.process_time() - start


def patch_error(truth: Picture, made: Picture, hole: np.ndarray) -> float:
    """Return the mean distance of patches that touch the hole from the nearest known one, over a fixed sample of both."""
    touched = sliding_window_view(hole, (PATCH, PATCH)).any((2, 3))
    rng = np.random.default_rng(0)

    def some(picture: Picture, where: np.ndarray, count: int) -> np.ndarray:
        at = rng.permutation(np.argwhere(where))[:count]
        patches = sliding_window_view(picture, (PATCH, PATCH), (0, 1))[at[:, 0], at[:, 1]]
        return patches.reshape(len(at), -1).astype(np.float32)

    known, new = some(truth, ~touched, 20000), some(made, touched, 1000)
    squares = (new**2).sum(1)[:, None] - 2 * new @ known.T + (known**2).sum(1)
    return float(np.sqrt(np.maximum(squares.min(1), 0) / known.shape[1]).mean())


def square(picture: Picture) -> Picture:
    """Return the middle of a picture in three channels, at most 512 pixels a side."""
    side = min(SIDE, *picture.shape[:2])
    top, left = ((n - side) // 2 for n in picture.shape[:2])
    crop = picture[top : top + side, left : left + side]
    return np.ascontiguousarray(np.stack([crop] * 3, axis=-1) if crop.ndim == 2 else crop[..., :3], np.uint8)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("photographs", nargs="*", type=Path)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--resynthesizer", type=Path, help="the program that is described above")
    parser.add_argument("--out", type=Path, help="a folder for the pictures")
    options = parser.parse_args()
    pictures = {p.stem: io.imread(p) for p in options.photographs}
    pictures = pictures or {name: getattr(data, name)() for name in PHOTOGRAPHS}
    fillers: dict[str, Filler] = {"texrs": by_texrs}
    if options.resynthesizer:
        fillers["resynthesizer"] = by_program(options.resynthesizer.resolve())
    if hasattr(cv2, "xphoto"):
        cv2.setNumThreads(1)
        fillers["xphoto"] = by_opencv
    set_threads(1)
    for name, picture in pictures.items():
        truth = square(picture)
        side = len(truth)
        hole = np.zeros((side, side), bool)
        hole[side * 3 // 8 : side * 5 // 8, side * 3 // 8 : side * 5 // 8] = True
        image = np.where(hole[..., None], np.uint8(0), truth)
        print(f"{name}, {side} x {side}: patch error of the truth {patch_error(truth, truth, hole):.2f}")
        times: dict[str, list[float]] = {f: [] for f in fillers}
        made = {}
        for _ in range(options.rounds):
            for filler, fill in fillers.items():
                made[filler], seconds = fill(image, hole)
                times[filler].append(seconds)
        for filler, result in made.items():
            error = np.sqrt(np.mean((result.astype(float) - truth)[hole] ** 2))
            ratio = np.median(times[filler]) / np.median(times["texrs"])
            print(
                f"  {filler:13s} {np.median(times[filler]):7.3f} s ({ratio:5.1f}x)  error {error:6.2f}  "
                f"patch error {patch_error(truth, result, hole):6.2f}"
            )
            if options.out:
                options.out.mkdir(parents=True, exist_ok=True)
                io.imsave(options.out / f"{name}-{filler}.png", result, check_contrast=False)


if __name__ == "__main__":
    main()

"""Other programs that fill holes: each gets an image and a mask, and returns a result and CPU seconds of one thread.

The Resynthesizer (https://github.com/bootchk/resynthesizer, GPL) is an external program that is neither part of texrs
nor linked to it. PROGRAM IMAGE.ppm MASK.pgm OUT.ppm prints the CPU seconds of `imageSynth` of `lib/imageSynth.h`, with
the parameters of `setDefaultParams` on image and mask (255 in the hole). To build it, write a `main` of about twenty
lines around that call. Remove SYNTH_THREADED and SYNTH_USE_GLIB_THREADS from `lib/buildSwitches.h`. Compile with
imageSynth.c, engine.c, glibProxy.c, engineParams.c, imageFormat.c and progress.c of its folder `lib`: `gcc -O3
-march=native -DNDEBUG -DSYNTH_LIB_ALONE`.

OpenCV is included if its contributed module xphoto is installed (`pip install opencv-contrib-python-headless`).
"""

from __future__ import annotations

import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from skimage import io

try:
    import cv2
except ImportError:
    cv2 = None

Picture = np.ndarray
Filler = Callable[[Picture, np.ndarray], tuple[Picture, float]]


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

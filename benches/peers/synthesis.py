"""Rows 10, 11 and 13: textures from patches, from coordinates, and in three dimensions.

The results are different textures, so only their size is checked.

Three programs of others take part if a variable names them. Their sources have no licence, so they are neither part of
texrs nor linked to it. Users must build them themselves:

- QUILTING IN.ppm OUT.png BLOCK OVERLAP COUNT makes COUNT x COUNT blocks. It prints the processor seconds of
  `image_quilting` of github.com/MarH19/fast-image-quilting-for-texture-synthesis, with a tolerance of 3/10. Write a
  `main` of ten lines, and compile it with all of its folder src: `gcc -O3 -mfma -fno-tree-vectorize -march=native
  -Iinclude`.
- LEFEBVRE IN.ppm OUT.ppm makes a texture of twice the side, in two passes. It prints the processor seconds of
  `synthesize` of github.com/Nanored4498/Texture-Synthesis, without its `-c`. Use its `main` without the writing,
  compiled without OpenMP and with an empty `stbi_write_png`.
- APPEARANCE is the folder `code` of github.com/anikabahl76/appearance-space-texture-synthesis, in Python.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from frame import Arrays, Row, Side, Timed, Work

BLOCK, OVERLAP, COUNT = 32, 8, 21


def make_bricks() -> dict[str, Any]:
    """Return an image of 128 x 128 pixels."""
    from skimage import data

    grey = data.brick()[:128, :128]
    return {"image": np.stack([grey, grey * 0.9, grey * 0.7], axis=-1).astype(np.uint8)}


def run_program(variable: str, given: Arrays, ending: str, *words: object) -> Timed:
    """Run a program that makes an image and reports its time."""
    from skimage import io

    image = given["image"]
    with tempfile.TemporaryDirectory() as folder:
        names = [Path(folder, "in.ppm"), Path(folder, f"out.{ending}")]
        names[0].write_bytes(b"P6\n%d %d\n255\n" % image.shape[1::-1] + image.tobytes())
        command = [os.environ[variable], *map(str, names), *map(str, words)]
        done = subprocess.run(command, check=True, capture_output=True, text=True, timeout=600)
        return Timed(io.imread(names[1]), float(done.stdout))


def quilt_by_texrs(given: Arrays) -> Work:
    """Make the same blocks, each cut in by a minimum cut, chosen among several that fit."""
    from texrs.quilting import Picture, quilt
    from texrs.source_map import SourceMap

    image = given["image"]
    depth = np.zeros(image.shape[:2], np.float32)
    picture = Picture(image.astype(np.float32) / 255, SourceMap.identity(image.shape[:2]), depth)
    size = (COUNT * (BLOCK - OVERLAP) + OVERLAP,) * 2
    options = {"patch": BLOCK, "overlap": OVERLAP, "wrap": (False, False), "seed": 1, "progress": lambda share: None}
    return lambda: quilt([picture], size, **options).render([image])


def quilt_by_program(given: Arrays) -> Work:
    """Make blocks in raster order, cut by dynamic programming."""
    return lambda: run_program("QUILTING", given, "png", BLOCK, OVERLAP, COUNT)


def correct_by_texrs(given: Arrays) -> Work:
    """Correct coordinates. Similarity sets are computed in advance, by the first run."""
    import texrs

    exemplar = texrs.Exemplar(given["image"])
    texrs.synthesize(exemplar, 256, method="paper-compensated")
    return lambda: texrs.synthesize(exemplar, 256, method="paper-compensated").image


def correct_by_program(given: Arrays) -> Work:
    """Correct windows of colours, with only the neighbours' candidates (k = 1)."""
    return lambda: run_program("LEFEBVRE", given, "ppm")


def make_small_bricks() -> dict[str, Any]:
    """Return an image of 64 x 64 pixels."""
    return {"image": make_bricks()["image"][:64, :64]}


def run_process(given: Arrays, command: list[str], made: str, where: str | None = None) -> Timed:
    """Run a command on an image in a folder. The whole process counts."""
    from skimage import io

    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryDirectory() as folder:
        io.imsave(f"{folder}/in.png", given["image"], check_contrast=False)
        single = {"RAYON_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "Agg"}
        # Keep byte code, as installed programs do. The first run, which is not measured, writes it.
        single["PYTHONDONTWRITEBYTECODE"] = ""
        words = [word.format(folder=folder) for word in command]
        subprocess.run(
            words, check=True, cwd=where or folder, env={**os.environ, **single}, capture_output=True, timeout=600
        )
        image = io.imread(made.format(folder=folder))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return Timed(image, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


def start_texrs(given: Arrays) -> Work:
    """Run the whole command. Imports and the analysis of the exemplar take most of the time."""
    words = ["synthesize", "in.png", "-o", "out.png", "--size", "512", "--method", "paper-compensated", "--quiet"]
    return lambda: run_process(given, [sys.executable, "-m", "texrs", *words], "{folder}/out.png")


def start_program(given: Arrays) -> Work:
    """Run the same with the program, with eight times the side of its example, because its scale is twice as large."""
    where = os.environ["APPEARANCE"]
    words = ["lefebvre_hoppe_synthesis.py", "--data", "{folder}", "--image_path", "in.png", "--scale", "16"]
    return lambda: run_process(given, [sys.executable, *words], f"{where}/../out/lefebvre_hoppe_in.png", where)


def make_floor() -> dict[str, Any]:
    """Return discs on an oblique floor."""
    from texrs import samples

    return {"image": samples.tilted_discs((128, 128)).image}


def slope_by_texrs(given: Arrays) -> Work:
    """Run the whole verb. Facts about the exemplar are cached by the first run."""
    import texrs

    return lambda: texrs.perspective(given["image"], size=256).image


def compare_by_texrs(given: Arrays) -> Work:
    """Find for every sample of the volume the two most similar ones that are more than three samples away."""
    import texrs
    from texrs._engine.coherence import find_similar

    level = texrs.Exemplar(given["image"], axes=3).analyse().levels[-1]
    return lambda: find_similar(level, k=3, n=7, numbers=8).sets


def make_particles() -> dict[str, Any]:
    """Return a volume of 64^3 voxels."""
    from texrs import samples

    return {"image": samples.particles().image}


def grow_by_texrs(given: Arrays) -> Work:
    """Grow a volume around an axis. Analysis and similarity sets are computed in advance."""
    import texrs
    from texrs import fields

    exemplar = texrs.Exemplar(given["image"], axes=3)
    exemplar.analyse()
    for level in range(len(exemplar.analyse().levels)):
        exemplar.similarity(level, k=3, n=7, numbers=8)
    return lambda: texrs.solid(exemplar, 128, method="paper", field=fields.circular(axis="x")).image


def make_small_particles() -> dict[str, Any]:
    """Return the input for the slow twin: a pass over 12^3 voxels from 64^3."""
    return make_particles()


def _ready(given: Arrays) -> tuple[Any, Any, Any, Any]:
    import texrs
    from texrs import fields
    from texrs._engine.pyramid import Region, to_fixed

    level = texrs.Exemplar(given["image"], axes=3).analyse().levels[0]
    region = Region.whole((12, 12, 12))
    frames = to_fixed(fields.circular(axis="x").over(region.shape), region)
    return level, region, frames, level.blocks(region, frames)


def correct_small_by_texrs(given: Arrays) -> Work:
    """Run the kernel."""
    level, region, frames, start = _ready(given)
    return lambda: level.correct(start, region, frames, passes=2, coherence=0.2).places


def correct_small_by_twin(given: Arrays) -> Work:
    """Run the slow NumPy twin of the tests."""
    import sys

    sys.path.append(str(Path(__file__).resolve().parents[2] / "tests" / "reference"))
    from solid import Twin

    level, region, frames, start = _ready(given)
    return lambda: Twin(level.arrays(), region, frames).correct(start, passes=2, coherence=0.2)[-1]


def _size(result: Any) -> list[float]:
    return [float(n) for n in np.shape(result)]


QUILTING = "MarH19's quilting in C"
CORRECTING = "Nanored4498's C++ of Lefebvre and Hoppe 2005"
PROCESS = "anikabahl76's Python of Lefebvre and Hoppe 2006"
PATCHES: dict[str, Side] = {"texrs": quilt_by_texrs, QUILTING: quilt_by_program}
ROWS = {
    "quilt-512": Row(
        "10",
        f"quilting, 128² to 512², blocks of {BLOCK} that overlap by {OVERLAP}",
        "the right size; texrs cuts whole overlaps and tries several blocks, the program cuts strips",
        make_bricks,
        PATCHES,
        _size,
        asked={QUILTING: 3},
        most_ms=60,
    ),
    "correct-256": Row(
        "11",
        'appearance-space synthesis, 128² to 256², k = 3, two passes (method="paper-compensated")',
        "the right size; the program compares windows of colours and takes k = 1",
        make_bricks,
        {"texrs": correct_by_texrs, CORRECTING: correct_by_program},
        _size,
        asked={CORRECTING: 60},
        most_ms=16,
    ),
    "process-512": Row(
        "11",
        "appearance-space synthesis, 64² to 512², the whole process of a command",
        "the right size",
        make_small_bricks,
        {"texrs": start_texrs, PROCESS: start_program},
        _size,
        asked={PROCESS: 30},
    ),
    "perspective-256": Row(
        "12",
        "an oblique floor, 128² to 256², by texrs.perspective",
        "the right size",
        make_floor,
        {"texrs": slope_by_texrs},
        _size,
        most_ms=1300,
    ),
    "sets-64": Row(
        "13",
        "similarity sets of 64³, k = 3, for samples more than three apart; all pairs would take at least 1.7 s",
        "the right size",
        make_particles,
        {"texrs": compare_by_texrs},
        _size,
        most_ms=1700,
    ),
    "solid-128": Row(
        "13",
        'solid synthesis, 64³ to 128³ under a field, k = 3, two passes (method="paper")',
        "the right size",
        make_particles,
        {"texrs": grow_by_texrs},
        _size,
        most_ms=2900,
        most_mb=200,
    ),
    "solid-twin": Row(
        "13",
        "two passes over 12³ voxels of windows from 64³",
        "the same places",
        make_small_particles,
        {"texrs": correct_small_by_texrs, "texrs' twin in NumPy": correct_small_by_twin},
        asked={"texrs' twin in NumPy": 3},
    ),
}

"""The compared methods: methods of texrs, methods of other installed programs, and trivial methods.

Other programs are called as their documentation shows, with their own defaults. They run with one thread if only this
makes the result repeatable. None of them is part of texrs or linked to it.
"""

from __future__ import annotations

import importlib
import importlib.util
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from texrs import io
from texrs._typing import Array
from texrs.comparison._results import Request
from texrs.errors import TexrsError
from texrs.inpainting import inpaint
from texrs.papers.design import design
from texrs.papers.solid import synthesize
from texrs.tiling import tile

Do = Callable[[Request], Array]
PATIENCE = 900
"""Maximum time of a program, in seconds."""
PROGRAMS = {"embark": "texture-synthesis", "resynthesizer": "resynthesizer-fill"}
"""Other programs, and the names of their executables."""


@dataclass(frozen=True, slots=True)
class Method:
    """A method: its name, its task, a function that finds it, and how to get it."""

    name: str
    task: str
    find: Callable[[Mapping[str, str]], Do | None]
    get: str = ""


def always(do: Do) -> Callable[[Mapping[str, str]], Do | None]:
    """Return a finder for a method that is always available."""
    return lambda named: do


def find_module(name: str, do: Callable[[Any, Request], Array]) -> Callable[[Mapping[str, str]], Do | None]:
    """Return a finder for a method of a module, which it loads.

    For a submodule such as ``cv2.xphoto``, the finder loads its parent module.
    """

    def find(named: Mapping[str, str]) -> Do | None:
        outer, _, inner = name.partition(".")
        if importlib.util.find_spec(outer) is None:
            return None
        try:
            module = importlib.import_module(outer)
        except Exception:
            # The module is installed but cannot be loaded.
            return None
        return partial(do, module) if not inner or hasattr(module, inner) else None

    return find


def find_program(name: str, do: Callable[[str, Request], Array]) -> Callable[[Mapping[str, str]], Do | None]:
    """Return a finder for a program: the given path, or an executable in the path."""

    def find(named: Mapping[str, str]) -> Do | None:
        path = named.get(name) or shutil.which(PROGRAMS[name])
        return partial(do, path) if path else None

    return find


FREE = ("copies", "as it is")
"""Trivial methods, shown only for comparison."""

# --- trivial methods -------------------------------------------------------------------------------------------------


def put_side_by_side(asked: Request) -> Array:
    """Repeat the image."""
    height, width = asked.picture.shape[:2]
    copies = (-(-asked.size // height), -(-asked.size // width), 1)
    return np.tile(asked.picture, copies)[: asked.size, : asked.size]


# --- other programs --------------------------------------------------------------------------------------------------


def run(*words: object) -> None:
    """Run a program. If it fails, raise an error with its error output."""
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True, timeout=PATIENCE)
    if done.returncode != 0:
        raise TexrsError(done.stderr.strip() or f"failed with exit code {done.returncode}")


def run_embark(more: bool, program: str, asked: Request) -> Array:
    """Generate a texture with Embark's texture-synthesis, or fill a hole. The hole is black in the mask."""
    height, width = (asked.size, asked.size) if more else asked.picture.shape[:2]
    with tempfile.TemporaryDirectory() as folder:
        example, mask, out = (Path(folder, f"{n}.png") for n in ("example", "mask", "out"))
        io.write(example, asked.picture)
        said = ["--tiling"]
        if asked.hole is not None and not more:
            io.write(mask, np.where(asked.hole, 0, 255).astype(np.uint8))
            said = ["--inpaint", str(mask)]
        common = ["--seed", asked.seed, "--threads", 1, "--no-progress", "--out-size", f"{width}x{height}"]
        run(program, *common, *said, "--out", out, "generate", example)
        return np.ascontiguousarray(io.read(out)[..., :3])


def run_resynthesizer(program: str, asked: Request) -> Array:
    """Fill a hole with the engine of Resynthesizer: PROGRAM IMAGE.ppm MASK.pgm OUT.ppm. Pixels of the hole are 255."""
    from imageio.v3 import imread

    assert asked.hole is not None
    height, width = asked.hole.shape
    with tempfile.TemporaryDirectory() as folder:
        image, mask, out = (Path(folder, n) for n in ("image.ppm", "mask.pgm", "out.ppm"))
        image.write_bytes(b"P6\n%d %d\n255\n" % (width, height) + asked.picture.tobytes())
        mask.write_bytes(b"P5\n%d %d\n255\n" % (width, height) + (asked.hole * np.uint8(255)).tobytes())
        run(program, image, mask, out)
        return np.asarray(imread(out), np.uint8)


def blend_borders(module: Any, asked: Request) -> Array:
    """Blend the opposite borders with img2texture."""
    from PIL import Image

    return np.asarray(module.image_to_seamless(Image.fromarray(asked.picture), overlap=0.2).convert("RGB"))


def continue_colours(flag: str, cv2: Any, asked: Request) -> Array:
    """Continue the colours at the border of the hole inwards, with OpenCV."""
    assert asked.hole is not None
    made: Array = cv2.inpaint(asked.picture, asked.hole.astype(np.uint8), 5, getattr(cv2, flag))
    return made


def shift_maps(cv2: Any, asked: Request) -> Array:
    """Fill the hole with shifted pieces of the image, with the contributed modules of OpenCV."""
    assert asked.hole is not None
    made, known = np.zeros_like(asked.picture), np.where(asked.hole, 0, 255).astype(np.uint8)
    cv2.xphoto.inpaint(cv2.cvtColor(asked.picture, cv2.COLOR_RGB2Lab), known, made, cv2.xphoto.INPAINT_SHIFTMAP)
    shown: Array = cv2.cvtColor(made, cv2.COLOR_Lab2RGB)
    return shown


def match_patches(module: Any, asked: Request) -> Array:
    """Fill the hole with PyPatchMatch."""
    assert asked.hole is not None
    made: Array = np.asarray(module.inpaint(asked.picture, asked.hole.astype(np.uint8) * 255, patch_size=5))
    return made


def smooth(asked: Request) -> Array:
    """Fill the hole with the smoothest surface, with scikit-image."""
    from skimage.restoration import inpaint_biharmonic

    made = np.clip(inpaint_biharmonic(asked.picture, asked.hole, channel_axis=-1), 0, 1)
    shown: Array = np.rint(made * 255).astype(np.uint8)
    return shown


EMBARK = "cargo install texture-synthesis-cli, or --program embark=PATH"
OPENCV = "pip install opencv-python-headless"
XPHOTO = "pip install opencv-contrib-python-headless"
RESYNTHESIZER = (
    "no ready program is published: build one around its engine, as described in benches/fillers.py, and give its path "
    "with --program resynthesizer=PATH"
)
PATCH_MATCH = "build https://github.com/vacancy/PyPatchMatch, which installs the module patch_match"

METHODS = (
    Method("copies", "more", always(put_side_by_side)),
    Method("texrs design", "more", always(lambda a: design(a.picture, a.size, seed=a.seed).image)),
    Method(
        "texrs design, as printed",
        "more",
        always(lambda a: design(a.picture, a.size, seed=a.seed, method="paper").image),
    ),
    Method("texrs synthesize", "more", always(lambda a: synthesize(a.picture, a.size, seed=a.seed, wrap=True).image)),
    Method("Embark texture-synthesis", "more", find_program("embark", partial(run_embark, True)), EMBARK),
    Method("as it is", "tile", always(lambda a: a.picture)),
    Method("texrs tile", "tile", always(lambda a: tile(a.picture).image)),
    Method("img2texture", "tile", find_module("img2texture", blend_borders), "pip install img2texture"),
    Method("texrs inpaint", "hole", always(lambda a: inpaint(a.picture, a.hole, boundary_width=4, seed=a.seed).image)),
    Method(
        "texrs inpaint, optimised",
        "hole",
        always(lambda a: inpaint(a.picture, a.hole, method="optimise", seed=a.seed).image),
    ),
    Method("scikit-image biharmonic", "hole", always(smooth)),
    Method("OpenCV Telea", "hole", find_module("cv2", partial(continue_colours, "INPAINT_TELEA")), OPENCV),
    Method("OpenCV Navier-Stokes", "hole", find_module("cv2", partial(continue_colours, "INPAINT_NS")), OPENCV),
    Method("OpenCV shift maps", "hole", find_module("cv2.xphoto", shift_maps), XPHOTO),
    Method("PyPatchMatch", "hole", find_module("patch_match", match_patches), PATCH_MATCH),
    Method("Embark texture-synthesis", "hole", find_program("embark", partial(run_embark, False)), EMBARK),
    Method("Resynthesizer", "hole", find_program("resynthesizer", run_resynthesizer), RESYNTHESIZER),
)
"""All methods, in the order of the page."""

"""Run each verb on materials with one command: alignment, shading, dtypes, time and memory.

    python benches/materials_table.py OUT FOLDER ... [--size 2048] [--verb VERB ...] [--limit SECONDS]

Each FOLDER contains the maps of a material with the usual names. A map with the numbers of its pixels is added, as
labels. Every verb computes the whole material in one command, which also writes a lit preview, a glTF file, a
MaterialX document and mipmaps. These stay in OUT for inspection. Verbs that continue an image (inpaint, extend,
remove, rectify, self-splice) get the designed one.

Register is the share of pixels with the number of the pixel nearest to the coordinates of the source map. Shading is
the mean angle, in degrees, between the computed normals and the example's normals, rotated independently by the frames
of the source map. The angle without rotation is next to it. Seconds are wall time and the processor time of all
processors. Memory is the peak of the command.
"""

from __future__ import annotations

import argparse
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import texrs
from texrs import io
from texrs.materials import Role
from texrs.materials.lit_maps import decode_normals

IDS = "ids"
NEAR = 0.501
"""Maximum distance of a nearest pixel, in pixels."""
ALONE = ("design", "tile", "synthesize", "perspective", "splice")


def list_commands(stack: Path, designed: Path, hole: Path, size: int) -> Iterator[tuple[str, list[str], Path]]:
    """Return each verb, its arguments, and the material that it looks up."""
    wanted = ["--size", str(size)]
    yield "design", [str(stack), *wanted], stack
    yield "tile", [str(stack), *wanted, "--flatten-lighting"], stack
    yield "synthesize", [str(stack), *wanted, "--wrap", "xy"], stack
    yield "perspective", [str(stack), *wanted, "--target", "plane:slant=45,tilt=90", "--scale-map", "front"], stack
    yield "splice", [str(stack), "sample:pebbles", *wanted], stack
    yield "inpaint", [str(designed), str(hole)], designed
    yield "extend", [str(designed), "--left", str(size // 8), "--slant", "0"], designed
    yield "remove", [str(designed), str(hole), "--slant", "0"], designed
    yield "rectify", [str(designed), "--slant", "20", "--tilt", "90", "--fov", "50"], designed
    yield "self-splice", [str(designed), "--edit", "randomise"], designed


def prepare(folder: Path, target: Path) -> Path:
    """Copy the maps of a material, and add a map with the numbers of its pixels."""
    shutil.rmtree(target, ignore_errors=True)
    shutil.copytree(folder, target)
    number_pixels(target)
    return target


def number_pixels(folder: Path) -> None:
    """Write the map of pixel numbers of a material, over an existing one."""
    (folder / f"{IDS}.tif").unlink(missing_ok=True)
    rows, columns = texrs.Material.read(folder).shape
    io.write(folder / f"{IDS}.tif", np.arange(rows * columns, dtype=np.int32).reshape(rows, columns))


def check(made: Path, example: Path, source: texrs.SourceMap) -> list[str]:
    """Return whether register and dtypes are exact, and the error of normals."""
    before, after = texrs.Material.read(example), texrs.Material.read(made)
    shown = np.stack(np.divmod(after[IDS].pixels, before.shape[1]), axis=-1)
    # A position halfway between two pixels has two nearest pixels, so `NEAR` is slightly above 0.5. Positions beyond
    # the border use the last pixel.
    places = np.clip(source.coordinates, 0, np.array(before.shape) - 1)
    exact = float((np.abs(shown - places).max(axis=-1) <= NEAR).mean())
    kept = all(after[name].pixels.dtype == each.pixels.dtype for name, each in before.items())
    name = before.find(Role.NORMAL) or before.find(Role.NORMAL_DX)
    angles = "-"
    if name is not None:
        own = decode_normals(before[name].pixels, before[name].role, signed=False)
        plain = decode_normals(source.render(before[name].pixels), before[name].role, signed=False)
        made_so = decode_normals(after[name].pixels, after[name].role, signed=False)
        frames, looked = source.jacobians(), source.render(own, interpolation="linear")
        # Heights h(S(p)) have the slopes J^T grad h. Rows grow downwards and y grows upwards, so the sign changes.
        slopes = np.einsum("...ji,...j->...i", frames, np.stack([-looked[..., 1], looked[..., 0]], -1))
        expected = np.concatenate([slopes[..., 1:], -slopes[..., :1], looked[..., 2:]], axis=-1)
        expected /= np.linalg.norm(expected, axis=-1, keepdims=True)
        turned = [np.degrees(np.arccos(np.clip((each * expected).sum(-1), -1, 1))) for each in (made_so, plain)]
        angles = f"{turned[0].mean():.2f} ({turned[1].mean():.2f})"
    return [f"{exact:.6f}", angles, "yes" if kept else "NO"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("--size", type=int, default=2048)
    parser.add_argument("--verb", action="append")
    parser.add_argument("--limit", type=float, default=600.0)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    hole = np.zeros((given.size, given.size), np.uint8)
    part = slice(given.size // 2, given.size // 2 + given.size // 8)
    hole[part, part] = 255
    io.write(given.out / "hole.png", hole)
    print(f"{'material':16} {'verb':12} {'seconds':>8} {'work':>7} {'MB':>6}  {'register':8}  {'normals':>16}  dtypes")
    for folder in given.folders:
        stack = prepare(folder, given.out / folder.name)
        designed = given.out / f"{folder.name}-design"
        for verb, words, example in list_commands(stack, designed, given.out / "hole.png", given.size):
            if given.verb and verb not in given.verb:
                continue
            if verb not in ALONE:
                number_pixels(designed)
            report(folder.name, verb, words, example, given)


def report(name: str, verb: str, words: list[str], example: Path, given: argparse.Namespace) -> None:
    """Run one command, and print its row."""
    made = given.out / f"{name}-{verb}"
    beside = {
        flag: str(made) + end for flag, end in (("--preview", ".png"), ("--gltf", ".glb"), ("--source-map", ".npz"))
    }
    beside |= {"--mipmaps": f"{made}-mipmaps", "--materialx": f"{made}-materialx"}
    line = [sys.executable, "-m", "texrs", verb, *words, "-o", str(made), "-q", "--force"]
    start = time.monotonic()
    process = subprocess.Popen([*line, *(word for pair in beside.items() for word in pair)])
    try:
        while (done := os.wait4(process.pid, os.WNOHANG))[0] == 0:
            time.sleep(0.2)
            if time.monotonic() - start > given.limit:
                # Kill by number, because `Popen.kill` would fetch the exit status, which os.wait4 must get.
                os.kill(process.pid, signal.SIGKILL)
    except KeyboardInterrupt:
        process.kill()
        raise
    _, status, used = done
    seconds, work, most = time.monotonic() - start, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024
    found = check(made, example, texrs.SourceMap.load(f"{made}.npz")) if status == 0 else [f"failed ({status})", "", ""]
    print(
        f"{name:16} {verb:12} {seconds:8.1f} {work:7.1f} {most:6.0f}  {found[0]}  {found[1]:>16}  {found[2]}",
        flush=True,
    )


if __name__ == "__main__":
    main()

"""Measure how long a verb works before it can be stopped: the longest gap between two progress reports, by stage.

    python benches/cancel_table.py [VERB ...]

Times are seconds of one thread's processor time, because wall time depends on other work of the machine. The last row
is the longest time that a verb continued after a request to stop in each of its stages. Each measured verb gets new
images, because results for an image are cached.
"""

from __future__ import annotations

import functools
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

import texrs

SIDE, SIZE = 192, 384
SHOWN = 0.05
"""Minimum seconds of a gap with its own row."""
Call = Callable[[Any], object]


class Given:
    """Inputs of verbs: images with a number, which are not in any cache."""

    def __init__(self, number: int) -> None:
        self.picture = np.roll(texrs.samples.pebbles((SIDE, SIDE)).image, 3 * number, (0, 1))
        # Roll the floor only sideways, because a vertical roll would break its perspective.
        self.floor = np.roll(texrs.samples.tilted_discs((SIDE, SIDE)).image, 3 * number, 1)
        self.volume = np.roll(texrs.samples.particles((48, 48, 48)).image, number, (0, 1, 2))
        self.hole = np.zeros((SIDE, SIDE), np.bool_)
        self.hole[64:128, 64:128] = True
        self.folder = tempfile.mkdtemp()

    @functools.cached_property
    def base(self) -> texrs.TextureDatabase:
        """Return a database of two textures."""
        base = texrs.TextureDatabase(f"{self.folder}/two")
        base.add(self.picture, "a")
        base.add(self.turned, "b")
        return base

    @functools.cached_property
    def made(self) -> texrs.Synthesis:
        """Return a result with seams."""
        return texrs.synthesize(self.picture, SIZE)

    @functools.cached_property
    def material(self) -> texrs.Material:
        """Return a material of two maps."""
        return texrs.Material({"albedo": self.picture, "height": self.picture[..., 0].copy()})

    @functools.cached_property
    def ball(self) -> tuple[NDArray[Any], NDArray[Any]]:
        """Return vertices and triangles."""
        import trimesh

        ball = trimesh.creation.icosphere(subdivisions=4)
        return np.asarray(ball.vertices), np.asarray(ball.faces)

    @functools.cached_property
    def light(self) -> NDArray[np.float32]:
        """Return the image in single precision, larger."""
        return (np.tile(self.picture, (4, 4, 1)) / np.float32(255)).astype(np.float32)

    @functools.cached_property
    def turned(self) -> NDArray[np.uint8]:
        """Return the image, rotated by a quarter turn."""
        return np.rot90(self.picture).copy()

    @functools.cached_property
    def seeds(self) -> list[dict[str, int]]:
        """Return the items to compute."""
        return [{"seed": seed} for seed in range(3)]


def bind(function: Callable[..., Any], *arguments: object, **options: object) -> Call:
    """Return a call that lacks only its progress argument."""
    return lambda watch: function(*arguments, progress=watch, **options)


def list_variants(*arguments: Any, **options: Any) -> list[texrs.Synthesis]:
    """Compute variants, which are returned one by one."""
    return list(texrs.design_variants(*arguments, **options))


VERBS: dict[str, Callable[[Given], Call]] = {
    "design": lambda g: bind(texrs.design, g.picture, SIZE),
    "design, as printed": lambda g: bind(texrs.design, g.picture, SIZE, method="paper"),
    "design_variants": lambda g: bind(list_variants, g.picture, 3, SIDE),
    "splice": lambda g: bind(texrs.splice, g.picture, g.turned),
    "self_splice": lambda g: bind(texrs.self_splice, g.picture, "randomise"),
    "perspective": lambda g: bind(texrs.perspective, g.picture, size=SIZE),
    "perspective, a floor": lambda g: bind(texrs.perspective, g.floor, size=SIZE),
    "perspective, as printed": lambda g: bind(texrs.perspective, g.floor, method="paper"),
    "synthesize": lambda g: bind(texrs.synthesize, g.picture, SIZE),
    "synthesize, fast": lambda g: bind(texrs.synthesize, g.picture, SIZE, quality="fast"),
    "solid": lambda g: bind(texrs.solid, g.volume, 80),
    "solid, fast": lambda g: bind(texrs.solid, g.volume, 64, quality="fast"),
    "tile": lambda g: bind(texrs.tile, g.picture),
    "inpaint": lambda g: bind(texrs.inpaint, g.picture, g.hole),
    "inpaint, optimise": lambda g: bind(texrs.inpaint, g.picture, g.hole, method="optimise"),
    "extend": lambda g: bind(texrs.extend, g.floor, right=96, bottom=96),
    "rectify": lambda g: bind(texrs.rectify, g.floor),
    "remove": lambda g: bind(texrs.remove, g.floor, g.hole),
    "blend": lambda g: bind(texrs.blend, g.made.source_map, g.picture, wrap=False),
    "apply": lambda g: bind(texrs.apply, g.made.source_map, g.picture),
    "Material.apply": lambda g: bind(g.material.apply, g.made.source_map),
    "analyse": lambda g: bind(texrs.elements.analyse, g.picture),
    "segment": lambda g: bind(texrs.Exemplar(g.picture).segment),
    "similarity": lambda g: lambda watch: texrs.Exemplar(g.picture).similarity(-1, progress=in_one_stage(watch)),
    "TextureDatabase.add": lambda g: bind(g.base.add, g.picture[:, ::-1].copy(), "c"),
    "TextureDatabase.splice": lambda g: bind(g.base.splice, "a", "b"),
    "TextureDatabase.matrix": lambda g: bind(g.base.matrix),
    "CornerTiles": lambda g: bind(texrs.CornerTiles, g.picture, 96),
    "CornerTiles.window": lambda g: bind(texrs.CornerTiles(g.picture, 64).window, (0, 0), SIZE),
    "CornerTiles.to_zarr": lambda g: bind(texrs.CornerTiles(g.picture, 64).to_zarr, g.folder + "/tiles.zarr", 2 * SIZE),
    "PlaneTexture.window": lambda g: bind(texrs.PlaneTexture(g.picture).window, (0, 0), SIZE),
    "PlaneTexture.to_zarr": lambda g: bind(texrs.PlaneTexture(g.picture).to_zarr, g.folder + "/plane.zarr", SIZE),
    "PlaneTexture.to_file": lambda g: bind(texrs.PlaneTexture(g.picture).to_file, g.folder + "/plane.tif", SIZE),
    "SolidTexture.window": lambda g: bind(texrs.SolidTexture(g.volume).window, (0, 0, 0), 64),
    "SolidTexture.slice": lambda g: bind(texrs.SolidTexture(g.volume).slice, (0, 0, 0), (1, 1, 0), size=96),
    "SourceMap.to_zarr": lambda g: bind(g.made.source_map.to_zarr, g.folder + "/map.zarr", g.picture),
    "stores.map_to_zarr": lambda g: bind(
        texrs.stores.map_to_zarr, functools.partial(texrs.synthesize, g.picture, SIDE), g.seeds, g.folder + "/many.zarr"
    ),
    "paint": lambda g: bind(texrs.painting.texture_mesh, g.ball, texrs.SolidTexture(g.volume), scale=40, atlas=256),
    "turntable": lambda g: bind(texrs.volume.turntable, g.volume, g.folder + "/turn.gif", frames=8),
    "kernels.mean_shift": lambda g: bind(texrs.kernels.mean_shift.mean_shift, g.light, 7, 0.1),
    "kernels.regions": lambda g: bind(texrs.kernels.regions.felzenszwalb, g.light, 0.2),
}


def in_one_stage(watch: Callable[[str, float], object] | None) -> Callable[[float], object] | None:
    """Return a callback that gets only a share."""
    return None if watch is None else lambda share: watch("all", share)


def measure(call: Call) -> tuple[dict[str, float], list[str]]:
    """Return the longest gap at the end of each stage, and the stages."""
    longest: dict[str, float] = {}
    stages: list[str] = []
    last, before = time.process_time(), "begin"

    def watch(stage: str, share: float) -> None:
        nonlocal last, before
        now = time.process_time()
        name = stage if stage == before else f"{before} > {stage}"
        longest[name] = max(longest.get(name, 0.0), now - last)
        last, before = now, stage
        if stage not in stages:
            stages.append(stage)

    call(watch)
    longest[f"{before} > end"] = time.process_time() - last
    return longest, stages


def measure_stop(call: Call, stage: str) -> float:
    """Return how long a call continues after a request to stop at the second report of a stage, if it stops."""
    seen, told = 0, 0.0

    def watch(now: str, share: float) -> None:
        nonlocal seen, told
        seen += now == stage
        if seen == 2:
            told = time.process_time()
            raise KeyboardInterrupt

    try:
        call(watch)
    except KeyboardInterrupt:
        return time.process_time() - told
    return 0.0


def main(words: list[str]) -> None:
    """Print a row for each stage of each verb with a gap above 0.05 s."""
    warnings.simplefilter("ignore")
    print("| verb | stage | longest gap, processor s |\n|---|---|---|")
    for name in words or VERBS:
        with texrs.threads(1):
            VERBS[name](Given(0))(None)  # The first call loads libraries, so it is not measured.
            found, stages = measure(VERBS[name](Given(1)))
            told = [(measure_stop(VERBS[name](Given(2 + n)), stage), stage) for n, stage in enumerate(stages)]
            stop = max(told, default=(0.0, "none"))
        for stage, gap in sorted(found.items(), key=lambda item: -item[1]):
            if gap >= SHOWN:
                print(f"| {name} | {stage} | {gap:.2f} |", flush=True)
        if max(found.values()) < SHOWN:
            print(f"| {name} | all | below {SHOWN} |", flush=True)
        print(f"| {name} | told to stop in {stop[1]} | {stop[0]:.2f} |", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])

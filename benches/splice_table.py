"""Splice each texture on the layout of each other one: a table and a contact sheet.

    TEXRS_TEXTURES=FOLDER python benches/splice_table.py OUT [--size 192] [--auto] [--method paper] [--tears
    deep_quality.py]

The folder contains ``b-disjoint``, ``c-connected`` and ``d-background``: images next to JSON files with a box,
scribbles and a tag, all in (x, y). With ``--auto`` only the images are used. Without a folder the built-in samples are
spliced.

Each row is a texture, with means over all other layouts. The columns are:

- the method;
- the share of targets with an element within 0.2 of its size, by the source map;
- the share of the displacement that was reached;
- the mean gradient, divided by the texture's own, of the whole image and of the background between separate elements;
- broken lines (`texrs.metrics`);
- the share of torn cells on the texture's own layout and on others, with ``--tears``, a module with
  `Judge(exemplar).scores(picture)`;
- the correlation of the results on two layouts, and the processor seconds.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from itertools import combinations
from pathlib import Path

import numpy as np
from scipy.ndimage import binary_dilation

import evaluators
import texrs
from texrs import elements, io, metrics, samples
from texrs.elements import ElementAnalysis, Layout
from texrs.errors import TexrsError
from texrs.papers.splice.stage_drawings import to_picture

CLEAR = 4
"""Minimum distance in pixels between the measured background and elements, because their shadows are nearer."""
HEAD = "| texture | method | present | realised | sharpness | ground | broken | torn: own | others | alike | s |"
SAMPLES = ("dots", "pebbles", "leaves_and_flowers", "net", "bricks", "scales", "weave")


def read(path: Path, *, auto: bool) -> ElementAnalysis:
    """Analyse an image with its JSON, or automatically."""
    image = io.read(path)
    told = json.loads(path.with_suffix(".json").read_text())
    if auto:
        return elements.analyse(image)
    box = told["foreground_box"]
    x, y = box["center"]
    width, height = box["size"]
    background = np.array(told["background_scribble"])[:, ::-1]
    return elements.analyse(image, box=(y, x, height, width), background=background, layout=told["tag"])


def entries(folder: str | None, *, auto: bool) -> dict[str, ElementAnalysis]:
    """Return the textures by name, disjoint foregrounds first."""
    if folder is None:
        return {name: ElementAnalysis.of_sample(samples.load(name, size=(256, 256))) for name in SAMPLES}
    told = [
        p for kind in ("b-disjoint", "c-connected", "d-background") for p in sorted(Path(folder, kind).glob("*.json"))
    ]
    found: dict[str, ElementAnalysis] = {}
    for path in told:
        picture = next(p for p in path.parent.glob(f"{path.stem}.*") if p.suffix != ".json")
        try:
            found[path.stem] = read(picture, auto=auto)
        except TexrsError as error:
            print(f"{path.stem}: {error}", flush=True)
    return found


def measure_sharpness(image: np.ndarray) -> float:
    """Return the mean gradient length of the grey values."""
    grey = to_picture(image).mean(axis=-1)
    return float(np.hypot(*np.gradient(grey)).mean())


def measure_ground(a: ElementAnalysis, result: texrs.Synthesis) -> float:
    """Return the mean gradient of the background between elements, divided by the texture's own; NaN if it is flat."""

    def steep(image: np.ndarray, elements: np.ndarray) -> float:
        grey = to_picture(image).mean(axis=-1)
        return float(np.hypot(*np.gradient(grey))[~binary_dilation(elements, iterations=CLEAR)].mean())

    own = steep(a.image, a.mask) if a.layout == Layout.DISJOINT else 0.0
    return steep(result.image, result.source_map.label > 0) / own if own else np.nan


def measure_likeness(images: list[np.ndarray]) -> float:
    """Return the mean correlation of all pairs of images."""
    flat = [to_picture(i).mean(axis=-1).ravel() for i in images]
    return float(np.mean([np.corrcoef(a, b)[0, 1] for a, b in combinations(flat, 2)])) if len(flat) > 1 else 0.0


def measure_present(result: texrs.Synthesis) -> float:
    """Return the share of targets well inside the image with an element."""
    report = result.report
    if "present" in report:
        return float(report["present"])
    size = np.array(result.source_map.shape)
    inner = [m for m in report["matches"] if all(0 <= v <= n - 1 for v, n in zip(m["target"], size, strict=True))]
    return float(np.mean([m["found"] is not None for m in inner])) if inner else 1.0


def small(image: np.ndarray, side: int = 192) -> np.ndarray:
    """Return the top left corner, padded to a square."""
    shown = to_picture(image)[:side, :side]
    return np.pad(shown, ((0, side - shown.shape[0] + 4), (0, side - shown.shape[1] + 4), (0, 0)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, nargs="?", default=Path("splice-table"), help="folder for the pictures")
    parser.add_argument("--size", type=int, default=192)
    parser.add_argument("--method")
    parser.add_argument("--auto", action="store_true", help="use the pictures alone, no annotations")
    parser.add_argument("--tears", type=Path, help="module with Judge(exemplar).scores(picture)")
    options = parser.parse_args()
    out, size, method = options.out, options.size, options.method
    known = entries(os.environ.get("TEXRS_TEXTURES"), auto=options.auto)
    out.mkdir(parents=True, exist_ok=True)
    rows = [np.concatenate([small(np.zeros((4, 4), np.uint8)), *(small(b.image) for b in known.values())], axis=1)]
    tears = evaluators.load(options.tears) if options.tears else None
    print(f"{HEAD}\n" + "|---" * (HEAD.count("|") - 1) + "|")
    for mine, a in known.items():
        row, made, numbers, methods, torn = [small(a.image)], [], [], set(), {True: [np.nan], False: []}
        judge = None if tears is None else tears.Judge(evaluators.as_float(a.image))
        for theirs, b in known.items():
            start = time.process_time()
            try:
                result = texrs.splice(a, b, size, seed=1, method=method)
            except TexrsError as error:
                print(f"{mine} on {theirs}: {error}")
                row.append(small(np.zeros((4, 4), np.uint8)))
                continue
            spent = time.process_time() - start
            io.write(out / f"{mine}-on-{theirs}.png", result.image)
            row.append(small(result.image))
            methods.add(result.report["method"])
            if judge is not None:
                torn[theirs == mine].append(judge.scores(evaluators.as_float(result.image))["tear"])
            if theirs != mine:
                made.append(result.image)
                sharp = measure_sharpness(result.image) / measure_sharpness(a.image)
                broken = metrics.evaluate(a.image, result.source_map, result.image).broken
                ground = measure_ground(a, result)
                numbers.append(
                    (measure_present(result), result.report["displacement_reached"], sharp, ground, broken, spent)
                )
        present, realised, sharp, ground, broken, spent = np.mean(numbers, axis=0)
        how, alike = " ".join(sorted(methods)), measure_likeness(made)
        print(
            f"| {mine} | {how} | {present:.2f} | {realised:.2f} | {sharp:.2f} | {ground:.2f} | {broken:.3f} "
            f"| {torn[True][-1]:.3f} "
            f"| {np.mean(torn[False] or [np.nan]):.3f} | {alike:.2f} | {spent:.1f} |",
            flush=True,
        )
        rows.append(np.concatenate(row, axis=1))
        io.write(out / "matrix.png", np.concatenate(rows))


if __name__ == "__main__":
    main()

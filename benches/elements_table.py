"""Measure how well elements are found in annotated textures (check S1), from given boxes and automatically.

TEXRS_TEXTURES=FOLDER python benches/elements_table.py [PICTURES]

FOLDER holds b-disjoint, c-connected and d-background, each image with its annotation. With PICTURES, a folder, what
was found is drawn there. Detections within half a box of the border do not count; of the keyboard, whose centres are
not all listed, recall alone does. IoU is the mean over the cells of `data/cells.json`, which were drawn by hand, of the
intersection over the union with the element that covers most of each. After the table it says how reliable what the
automatic start states is: in bins of stated confidence, how much was right, of layouts and of single elements.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from pathlib import Path

import numpy as np

from texrs import elements, io
from texrs.errors import TexrsError

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from element_checks import Annotated, annotated, pair, passes, score

BINS = (0.0, 0.5, 0.65, 0.8, 0.9, 1.0)
"""Between which stated confidences are put together."""
DRAWN = Path(__file__).resolve().parent / "data" / "cells.json"
"""Outlines of cells of ten of the textures, (row, column), drawn by hand; of each some, all over it."""
Stated = list[tuple[float, bool]]
"""How sure something was said to be, and whether it was right."""


def main(folder: Path, pictures: Path | None) -> None:
    print("| texture | layout | start | elements | of | recall | inner | precision | error | IoU | mask | s | S1 |")
    print("|---|---|---|---|---|---|---|---|---|---|---|---|---|")
    drawn = json.loads(DRAWN.read_text(encoding="utf-8"))
    totals = {"box": [0, 0, 0], "auto": [0, 0, 0]}
    layouts: Stated = []
    single: Stated = []
    for texture in annotated(folder):
        image = io.read(texture.image)
        given = {"box": texture.box, "background": texture.background, "layout": texture.layout}
        for start, options in (("box", given), ("auto", {})):
            began = time.perf_counter()
            try:
                found = elements.analyse(image, **options)
            except TexrsError as error:
                print(f"| {texture.name} | {texture.layout} | {start} | {error} |")
                continue
            seconds = time.perf_counter() - began
            total = totals[start]
            total[2] += found.layout == texture.layout
            if start == "auto":
                layouts.append((found.report["confidence"]["layout"], found.layout == texture.layout))
                single += judge_elements(found, texture)
            row = [texture.name, texture.layout if start == "box" else f"{found.layout}", start, len(found.points)]
            if texture.centres is None:
                row += ["-", "-", "-", "-", "-"]
            else:
                result = score(found.points, texture.centres, texture.box[2:], image.shape)
                row += [len(texture.centres), *(f"{v:.2f}" for v in (result.recall, result.inner, result.precision))]
                row.append(f"{result.error:.1f}")
            row.append(f"{measure_overlap(found, drawn[texture.name]):.2f}" if texture.name in drawn else "-")
            row += [f"{found.report['mask']} {found.mask.mean():.2f}", f"{seconds:.1f}"]
            if texture.centres is None:
                row.append("-")
            else:
                met = passes(result, recall_only="keyboard" in texture.name)
                total[0] += met
                total[1] += 1
                row.append("yes" if met else "no")
            print("| " + " | ".join(map(str, row)) + " |", flush=True)
            if pictures is not None:
                for name, picture in elements.draw(found).items():
                    io.write(pictures / f"{texture.name}-{start}-{name}.png", picture)
    for start, (met, count, right) in totals.items():
        print(f"{start}: S1 met on {met} of {count}; layout right on {right}")
    print_reliability("layouts", layouts)
    print_reliability("single elements", single)


def measure_overlap(found: elements.ElementAnalysis, cells: list[list[list[float]]]) -> float:
    """Return the mean intersection over union of drawn cells and the elements that cover most of each."""
    from skimage.draw import polygon2mask

    labels, shares = found.labels, []
    area = np.bincount(labels.ravel())
    for outline in cells:
        inside = polygon2mask(labels.shape, np.array(outline) + 0.5)
        seen = np.bincount(labels[inside], minlength=len(area))
        seen[0] = 0
        best = int(seen.argmax())
        shares.append(seen[best] / (inside.sum() + area[best] - seen[best]))
    return float(np.mean(shares))


def judge_elements(found: elements.ElementAnalysis, texture: Annotated) -> Stated:
    """Return how sure each element is said to be, and whether one is there; of those that are not all listed, none.

    Those of a wrong layout count, those within half a box of the border do not.
    """
    if texture.centres is None or "keyboard" in texture.name:
        return []
    half = np.array(texture.box[2:]) / 2
    inner = ((found.points >= half) & (found.points <= np.array(found.mask.shape) - 1 - half)).all(axis=1)
    right = np.isin(np.arange(len(inner)), pair(found.points, texture.centres, texture.box[2:])[0])
    sure = np.array([one.confidence for one in found.instances[: len(inner)]])
    return list(zip(sure[inner].tolist(), right[inner].tolist(), strict=True))


def print_reliability(name: str, stated: Stated) -> None:
    """Print how much was right of what was stated to be about as sure, and by how much the two differ on the average."""
    if not stated:
        return
    print(f"\n| {name}: stated | number | mean stated | right |")
    print("|---|---|---|---|")
    sure, right = (np.array(column, float) for column in zip(*stated, strict=True))
    which = np.searchsorted(BINS[1:-1], sure, side="right")
    apart = 0.0
    for k in np.unique(which):
        mean, share = sure[which == k].mean(), right[which == k].mean()
        apart += abs(mean - share) * np.mean(which == k)
        print(f"| {BINS[k]:.2f} to {BINS[k + 1]:.2f} | {np.sum(which == k)} | {mean:.2f} | {share:.2f} |")
    print(f"\n{name}: {len(sure)} stated, {right.mean():.0%} right, {apart:.2f} apart")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pictures", type=Path, nargs="?", help="folder for pictures of what was found")
    where = parser.parse_args().pictures
    if "TEXRS_TEXTURES" not in os.environ:
        parser.error("TEXRS_TEXTURES: needs the folder of the annotated textures")
    if where is not None:
        where.mkdir(parents=True, exist_ok=True)
    main(Path(os.environ["TEXRS_TEXTURES"]), where)

"""Measure how well elements are found in annotated textures (check S1), from given boxes and automatically.

TEXRS_TEXTURES=FOLDER python benches/elements_table.py [PICTURES]

FOLDER contains b-disjoint, c-connected and d-background, each image with its annotation. PICTURES is a folder for
drawings of the found elements. Detections within half a box of the border do not count. For the keyboard only recall
counts, because not all of its centres are listed. IoU is the mean over the hand-drawn cells of `data/cells.json`. It
is the intersection over the union with the element that covers most of the cell. After the table, the reliability of
the automatic start is printed: for each bin of stated confidence, the share of correct layouts and elements.
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
"""Limits of the bins of stated confidence."""
DRAWN = Path(__file__).resolve().parent / "data" / "cells.json"
"""Outlines of some cells of ten textures, (row, column), drawn by hand and spread over each texture."""
Stated = list[tuple[float, bool]]
"""A stated confidence, and whether the statement was right."""


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
    """Return the confidence of each element, and whether there is one. Textures without a full list have none.

    Elements of a wrong layout count. Elements within half a box of the border do not count.
    """
    if texture.centres is None or "keyboard" in texture.name:
        return []
    half = np.array(texture.box[2:]) / 2
    inner = ((found.points >= half) & (found.points <= np.array(found.mask.shape) - 1 - half)).all(axis=1)
    right = np.isin(np.arange(len(inner)), pair(found.points, texture.centres, texture.box[2:])[0])
    sure = np.array([one.confidence for one in found.instances[: len(inner)]])
    return list(zip(sure[inner].tolist(), right[inner].tolist(), strict=True))


def print_reliability(name: str, stated: Stated) -> None:
    """Print the share of correct statements by confidence, and the mean difference between the two."""
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

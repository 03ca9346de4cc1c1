"""Measure a finder of elements against outlines drawn by hand and against generated samples.

python benches/elements.py FINDER --textures FOLDER --truth FOLDER [--samples] [--sheets FOLDER]

FINDER is design (`Exemplar.segment`), splice (`elements.analyse`), texrs (`exemplar.element_finder`), or a Python file with
`find_things`. TRUTH contains NAME.json files and layouts.json:

- image: path relative to TEXTURES. crop: null, or [row, column, rows, columns].
- layout: accepted classes, the best one first: separate, heap, jointed, net, none. The elements of a net are its meshes.
- polygons: outlines of the elements, rows and columns in turn, pixel centres at integers. Later ones cover earlier
  ones.
- ignore: polygons of areas where nothing counts. Elements are cut out of them.

An element is found if its intersection over union (IoU) with a found one is above 0.5. Because labels do not overlap,
this pairs each with one at most. Elements below 16 pixels, or below 4 % of the median area of the image, do not count. At the
border of the image the limit is 10 %.
Neither do found ones that are mostly inside ignored areas or such small elements.
"""

from __future__ import annotations

import argparse
import ctypes
import importlib.util
import json
import re
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from scipy import ndimage
from skimage.draw import polygon2mask
from skimage.segmentation import find_boundaries

from texrs import Exemplar, elements, io, samples
from texrs.errors import TexrsError
from texrs.exemplar.element_finder import find_elements

sys.path.insert(0, str(Path(__file__).resolve().parent))
from elements_table import print_reliability

SMALL = 16, 0.04, 0.1
"""Pixels, and shares of the median area in the image and at its border, below which elements do not count."""
SAMPLES = {
    "dots": ["separate"],
    "pebbles": ["separate", "heap"],
    "leaves_and_flowers": ["separate"],
    "beans": ["heap"],
    "scales": ["heap", "jointed"],
    "bricks": ["jointed"],
    "tilted_bricks": ["jointed"],
    "tilted_discs": ["separate", "jointed"],
    "weave": ["jointed"],
    "net": ["net"],
    "bark": ["none"],
    "grit": ["none", "heap"],
}
"""Generated samples and their layouts."""
SPLICE = {"disjoint": ("separate", "heap"), "connected": ("net",), "jointed": ("jointed",)}
"""Layouts that a layout of SPLICE stands for."""


@dataclass
class Case:
    """An image whose elements are known, or only its layout."""

    name: str
    image: NDArray[Any]
    layout: list[str]
    labels: NDArray[np.int32] | None = None
    ignore: NDArray[np.bool_] | None = None


@dataclass
class Found:
    """The result of a finder. A finder that does not state confidences or a layout leaves them empty."""

    labels: NDArray[np.int32]
    layout: tuple[str, ...] = ()
    sure: float | None = None
    confidence: dict[int, float] = field(default_factory=dict)


@dataclass
class Score:
    """Counts and measures of one image."""

    expected: int
    found: int
    pairs: list[tuple[int, int, float]]
    away: float
    counted: list[int]
    missed: list[int]

    @property
    def precision(self) -> float:
        """Share of the found elements that are right."""
        return len(self.pairs) / self.found if self.found else float(not self.expected)

    @property
    def recall(self) -> float:
        """Share of the elements that were found."""
        return len(self.pairs) / self.expected if self.expected else 1.0

    @property
    def f(self) -> float:
        """Harmonic mean of precision and recall."""
        return 2 * len(self.pairs) / max(self.expected + self.found, 1)

    @property
    def iou(self) -> float:
        """Mean IoU of the pairs."""
        return float(np.mean([iou for _, _, iou in self.pairs])) if self.pairs else 0.0


def find(image: NDArray[Any]) -> Found:
    """Return the elements of `texrs.exemplar.element_finder`."""
    found = find_elements(image)
    sure = {i: each.confidence for i, each in enumerate(found.elements, 1)}
    return Found(found.labels, (found.layout,), found.confidence, sure)


def find_design(image: NDArray[Any]) -> Found:
    """Return the elements of DESIGN, which does not state a layout. Cells of a grid are not elements."""
    found = Exemplar(image).segment()
    return Found(found.elements if found.kind == "components" else np.zeros_like(found.elements))


def find_splice(image: NDArray[Any]) -> Found:
    """Return the elements of SPLICE."""
    found = elements.analyse(image)
    sure = {i: float(one.confidence) for i, one in enumerate(found.instances, 1)}
    return Found(found.labels, SPLICE[str(found.layout)], float(found.report["confidence"]["layout"]), sure)


def load_finder(name: str) -> Callable[[NDArray[Any]], Found]:
    """Return the finder of that name, or `find_things` of a Python file."""
    if name in (known := {"design": find_design, "splice": find_splice, "texrs": find}):
        return known[name]
    spec = importlib.util.spec_from_file_location("finder", name)
    if spec is None or spec.loader is None:
        raise SystemExit(f"finder: must be one of {', '.join(known)} or a Python file, got {name}")
    module = sys.modules["finder"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)

    def run(image: NDArray[Any]) -> Found:
        found = module.find_things(image)
        quality = np.clip(found.quality, 0, 1).tolist()
        layout = {"cells": "jointed"}.get(found.layout, found.layout)
        return Found(found.labels, (layout,), float(found.confidence), dict(enumerate(quality, 1)))

    return run


def fill(shape: Sequence[int], polygons: list[Any]) -> NDArray[np.int32]:
    """Return the labels of polygons, from 1. Later polygons cover earlier ones."""
    labels = np.zeros(shape, np.int32)
    for i, polygon in enumerate(polygons, 1):
        labels[polygon2mask(tuple(shape), np.array(polygon).reshape(-1, 2))] = i
    return labels


def read_case(file: Path, textures: Path) -> Case:
    """Return the image of one file of the truth, with its elements."""
    truth = json.loads(file.read_text(encoding="utf-8"))
    image = io.read(textures / truth["image"])
    if truth["crop"]:
        row, column, rows, columns = truth["crop"]
        image = np.ascontiguousarray(image[row : row + rows, column : column + columns])
    labels = fill(image.shape[:2], truth["polygons"])
    ignore = (fill(image.shape[:2], truth["ignore"]) > 0) & (labels == 0)
    return Case(file.stem, image, truth["layout"], labels, ignore)


def read_cases(textures: Path | None, truth: Sequence[Path], generated: bool) -> Iterator[Case]:
    """Yield the images with outlines, then the generated samples, then the images of which only the layout is known."""
    drawn = set()
    for file in sorted(file for folder in truth for file in folder.glob("*.json") if file.stem != "layouts"):
        if textures is not None:
            case = read_case(file, textures)
            drawn.add(case.name)
            yield case
    for name, layout in SAMPLES.items() if generated else ():
        for seed in (0, 1):
            sample = samples.load(name, size=(256, 256), seed=seed)
            yield Case(f"sample {name} {seed}", sample.image, layout, sample.labels)
    for folder in truth:
        if textures is not None and (folder / "layouts.json").exists():
            for path, layout in json.loads((folder / "layouts.json").read_text(encoding="utf-8")).items():
                if Path(path).stem not in drawn:
                    yield Case(Path(path).stem, io.read(textures / path), layout)


def rate(found: NDArray[np.int32], case: Case) -> Score:
    """Return how well the found labels match the elements of an image."""
    assert case.labels is not None
    labels, ignored = case.labels, np.zeros(found.shape, bool) if case.ignore is None else case.ignore
    area, whole = np.bincount(labels.ravel()), np.bincount(found.ravel())
    both = np.zeros((len(area), len(whole)), int)
    np.add.at(both, (labels, found), 1)
    hidden = np.bincount(found[ignored], minlength=len(whole))
    iou = both / np.maximum(area[:, None] + (whole - hidden)[None] - both, 1)
    area[0] = whole[0] = 0
    iou[0] = iou[:, 0] = 0
    usual = float(np.median(area[area > 0])) if area.any() else 0.0
    counts = area >= measure_least(labels, usual)
    aside = hidden + both[1:][~counts[1:]].sum(axis=0)
    pairs = [(int(i), int(j), float(iou[i, j])) for i, j in np.argwhere(iou > 0.5) if counts[i]]
    counted = (whole >= measure_least(found, usual)) & (2 * aside < whole)
    counted[[j for _, j, _ in pairs]] = True
    missed = sorted(set(np.flatnonzero(counts).tolist()) - {i for i, _, _ in pairs})
    seen = np.where(ignored, 0, found)
    away = float(np.mean([measure_distance(labels == i, seen == j) for i, j, _ in pairs])) if pairs else 0.0
    return Score(int(counts.sum()), int(counted.sum()), pairs, away, np.flatnonzero(counted).tolist(), missed)


def measure_least(labels: NDArray[np.int32], usual: float) -> NDArray[np.float64]:
    """Return the area from which on each label counts, where `usual` is the median area of the elements."""
    least = np.full(int(labels.max()) + 1, max(SMALL[0], SMALL[1] * usual))
    for side in (labels[0], labels[-1], labels[:, 0], labels[:, -1]):
        least[side] = max(SMALL[0], SMALL[2] * usual)
    return least


def measure_distance(a: NDArray[np.bool_], b: NDArray[np.bool_]) -> float:
    """Return the mean distance of two outlines in pixels, both ways. The border of the image is not an outline."""
    where = ndimage.find_objects((a | b).astype(np.uint8))[0]
    box = tuple(slice(max(s.start - 1, 0), s.stop + 1) for s in where)
    edges = [find_boundaries(one[box], mode="inner") for one in (a, b)]
    if not all(edge.any() for edge in edges):
        return 0.0
    one, two = (ndimage.distance_transform_edt(~edge) for edge in edges)
    return float((two[edges[0]].mean() + one[edges[1]].mean()) / 2)


def measure_peak(reset: bool = False) -> int:
    """Return the peak of the resident memory of this process in bytes, or reset it and return the present value."""
    if reset:
        ctypes.CDLL(None).malloc_trim(0)
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    key = "VmRSS" if reset else "VmHWM"
    match = re.search(rf"{key}:\s+(\d+)", Path("/proc/self/status").read_text(encoding="ascii"))
    return 1024 * int(match[1]) if match else 0


def draw(case: Case, found: Found, score: Score | None, side: int = 400) -> Image.Image:
    """Return the image with outlines: green if right, red if wrong, yellow if missed. Ignored areas are darker."""
    image = case.image
    image = np.repeat(image[..., None], 3, -1) if image.ndim == 2 else image[..., :3]
    zoom = side / max(image.shape[:2])
    size = (round(image.shape[1] * zoom), round(image.shape[0] * zoom))
    canvas = np.array(Image.fromarray(np.ascontiguousarray(image)).resize(size, Image.Resampling.BICUBIC))

    def enlarge(labels: NDArray[Any]) -> NDArray[Any]:
        return np.array(Image.fromarray(labels.astype(np.int32)).resize(size, Image.Resampling.NEAREST))

    if case.ignore is not None:
        canvas[enlarge(case.ignore) > 0] //= 2
    right = [j for _, j, _ in score.pairs] if score else []
    wrong = sorted(set(score.counted) - set(right)) if score else np.unique(found.labels)[1:].tolist()
    for labels, which, colour in (
        (case.labels, score.missed if score else [], (255, 255, 0)),
        (found.labels, wrong, (255, 0, 0)),
        (found.labels, right, (0, 255, 0)),
    ):
        if labels is not None and len(which):
            large = enlarge(labels)
            canvas[find_boundaries(np.where(np.isin(large, which), large, 0), mode="inner")] = colour
    picture = Image.new("RGB", (side, side + 14))
    picture.paste(Image.fromarray(canvas), (0, 14))
    text = f"{case.name}  {'/'.join(found.layout) or '-'}" + (f"  F {score.f:.2f} IoU {score.iou:.2f}" if score else "")
    ImageDraw.Draw(picture).text((2, 1), text, fill=(255, 255, 255))
    return picture


def write_sheets(pictures: list[Image.Image], folder: Path, name: str) -> None:
    """Write the pictures in sheets of twelve."""
    folder.mkdir(parents=True, exist_ok=True)
    for start in range(0, len(pictures), 12):
        wide, high = pictures[start].size
        sheet = Image.new("RGB", (4 * wide + 12, 3 * high))
        for k, picture in enumerate(pictures[start : start + 12]):
            sheet.paste(picture, (k % 4 * (wide + 4), k // 4 * high))
        sheet.save(folder / f"{name}-{start // 12 + 1:02d}.png")


def main(finder: str, cases: Iterator[Case], sheets: Path | None) -> None:
    """Measure a finder and print the tables."""
    run = load_finder(finder)
    print(
        "| image | elements | found | precision | recall | F | IoU | outline | found layout | true | sure | s | B/px |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|---|---|")
    single: list[tuple[float, bool]] = []
    layouts: list[tuple[float, bool]] = []
    means: dict[str, list[tuple[float, ...]]] = {}
    guessed: list[tuple[bool, bool]] = []
    pictures = []
    for case in cases:
        before, began = measure_peak(reset=True), time.process_time()
        try:
            found = run(case.image)
        except TexrsError as error:
            print(f"| {case.name}: {str(error)[:60]} |")
            found = Found(np.zeros(case.image.shape[:2], np.int32), ("error",))
        seconds, peak = time.process_time() - began, measure_peak() - before
        cost = (seconds, peak / (case.image.shape[0] * case.image.shape[1]))
        row = ["-"] * 7
        score = None
        if case.labels is not None:
            score = rate(found.labels, case)
            values = (score.precision, score.recall, score.f, score.iou, score.away)
            means.setdefault("samples" if case.name.startswith("sample ") else "drawn", []).append((*values, *cost))
            row = [str(score.expected), str(score.found), *(f"{v:.2f}" for v in values)]
            right = {j for _, j, _ in score.pairs}
            single += [(found.confidence[j], j in right) for j in score.counted if j in found.confidence]
        if found.layout:
            guessed.append((bool(set(found.layout) & set(case.layout)), case.layout[0] in found.layout))
            if found.sure is not None:
                layouts.append((found.sure, guessed[-1][0]))
        sure = "-" if found.sure is None else f"{found.sure:.2f}"
        row += ["/".join(found.layout) or "-", "/".join(case.layout), sure, f"{cost[0]:.2f}", f"{cost[1]:.0f}"]
        print(f"| {case.name} | " + " | ".join(row) + " |", flush=True)
        if sheets is not None:
            pictures.append(draw(case, found, score))
    for name, rows in means.items():
        texts = [f"{v:.2f}" for v in np.mean(rows, axis=0)]
        worst = min(row[2] for row in rows)
        print(
            f"| mean of {len(rows)} {name} (least F {worst:.2f}) | | | " + " | ".join(texts[:5]) + " | | | | ", end=""
        )
        print(" | ".join(texts[5:]) + " |")
    if guessed:
        accepted, best = np.mean(guessed, axis=0)
        print(f"\nlayout of {len(guessed)}: {accepted:.0%} among the accepted classes, {best:.0%} the best one")
    print_reliability("layouts", layouts)
    print_reliability("single elements", single)
    if sheets is not None:
        write_sheets(pictures, sheets, Path(finder).stem)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("finder", help="design, splice, texrs, or a Python file with find_things")
    parser.add_argument("--textures", type=Path, help="folder of the textures")
    parser.add_argument("--truth", type=Path, action="append", default=[], help="folder of outlines; may be repeated")
    parser.add_argument("--samples", action="store_true", help="also measure generated samples")
    parser.add_argument("--sheets", type=Path, help="folder for sheets of twelve pictures of the elements found")
    given = parser.parse_args()
    if given.truth and given.textures is None:
        parser.error("--truth: requires --textures")
    main(given.finder, read_cases(given.textures, given.truth, given.samples), given.sheets)

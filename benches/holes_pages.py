"""Write blind pages of filled holes: can a viewer find the filled place?

    python benches/holes_pages.py OUT PICTURE ... [--resynthesizer PROGRAM] [--holes 3]
    python benches/holes_pages.py OUT --votes votes.json

The first form writes `OUT/NUMBER.png`, each an image whose round holes one method has filled. The methods are
`texrs.remove` with default options, `texrs.inpaint` without scales, OpenCV (`inpaint`), and the Resynthesizer (see
`fillers.py`). Each unchanged image is also a page, without holes to find. Numbers and positions of holes are random
for each page, so that no page gives hints about another. `OUT/key.json` is hidden.

The second form compares `{"NUMBER": [[row, column], ...]}`, the suspected positions of holes, with the key. A hole is
found if a position is inside it, or outside by less than a quarter of its width. Positions outside all holes are also
counted, because many guesses find holes by chance.
"""

from __future__ import annotations

import argparse
import json
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

import texrs
from fillers import by_program
from texrs import io

try:
    import cv2
except ImportError:
    cv2 = None

Filler = Callable[[np.ndarray, np.ndarray], np.ndarray]
WIDE = 0.2
"""Diameter of a hole, as a share of the shorter side."""
BESIDE = 0.25
"""Maximum distance from a hole of a position that finds it, as a share of the diameter."""


def fillers(program: Path | None) -> dict[str, Filler]:
    """Return the installed methods."""
    found: dict[str, Filler] = {
        "untouched": lambda image, hole: image,
        "texrs.remove": lambda image, hole: texrs.remove(image, hole, seed=1).image,
        "texrs.inpaint": lambda image, hole: texrs.inpaint(image, hole, seed=1).image,
    }
    if cv2 is not None:
        found["OpenCV"] = lambda image, hole: cv2.inpaint(image, hole.astype(np.uint8), 5, cv2.INPAINT_TELEA)
    if program is not None:
        fill = by_program(program)
        found["Resynthesizer"] = lambda image, hole: fill(image, hole)[0]
    return found


def draw_holes(shape: tuple[int, ...], count: int, rng: np.random.Generator) -> list[tuple[float, float, float]]:
    """Return centres and diameters of round holes that are apart from each other and from the border."""
    side = min(shape[:2])
    wide, found = WIDE * side, list[tuple[float, float, float]]()
    for _ in range(10_000):
        row, column = (float(rng.uniform(0.7 * wide, n - 0.7 * wide)) for n in shape[:2])
        if all(np.hypot(row - r, column - c) > 1.5 * wide for r, c, _ in found):
            found.append((round(row, 1), round(column, 1), round(wide, 1)))
        if len(found) == count:
            break
    return found


def mark(shape: tuple[int, ...], holes: list[tuple[float, float, float]]) -> np.ndarray:
    """Return the mask of the holes."""
    rows, columns = np.indices(shape[:2])
    return np.any([np.hypot(rows - r, columns - c) < wide / 2 for r, c, wide in holes], axis=0)


def make(options: argparse.Namespace) -> None:
    """Write the pages and their key."""
    options.out.mkdir(parents=True, exist_ok=True)
    methods, rng = fillers(options.resynthesizer), np.random.default_rng()
    pages = [(path, name) for path in options.pictures for name in methods]
    key = {}
    for number, at in enumerate(rng.permutation(len(pages)).tolist()):
        path, name = pages[at]
        image = io.read(path)
        image = np.ascontiguousarray(image[..., :3] if image.ndim == 3 else np.repeat(image[..., None], 3, axis=2))
        holes = draw_holes(image.shape, options.holes, rng)
        hole = mark(image.shape, holes)
        # Blacken the holes, so that no method can read their pixels.
        bare = np.where(hole[..., np.newaxis], np.uint8(0), image) if name != "untouched" else image
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            made = methods[name](bare, hole)
        io.write(options.out / f"{number:03d}.png", made)
        key[f"{number:03d}"] = {"picture": path.stem, "method": name, "holes": holes if name != "untouched" else []}
        (options.out / "key.json").write_text(json.dumps(key), encoding="utf-8")


def is_found(hole: list[float], places: list[list[float]]) -> bool:
    """Return whether a position finds a hole."""
    row, column, wide = hole
    return any(np.hypot(row - r, column - c) < wide * (0.5 + BESIDE) for r, c in places)


def reveal(options: argparse.Namespace) -> None:
    """Print the found holes of each method."""
    key = json.loads((options.out / "key.json").read_text(encoding="utf-8"))
    votes = json.loads(options.votes.read_text(encoding="utf-8"))
    print("| method | holes | not found | share | places beside |\n" + "|---" * 5 + "|")
    for method in dict.fromkeys(page["method"] for page in key.values()):
        pages = {n: p for n, p in key.items() if p["method"] == method and n in votes}
        missed = [not is_found(hole, votes[n]) for n, p in pages.items() for hole in p["holes"]]
        beside = sum(
            not any(is_found(hole, [place]) for hole in p["holes"]) for n, p in pages.items() for place in votes[n]
        )
        share = f"{np.mean(missed):.2f}" if missed else "-"
        print(f"| {method} | {len(missed)} | {sum(missed)} | {share} | {beside} |")
    ours = {n: p for n, p in key.items() if p["method"] == "texrs.remove" and n in votes}
    print("\n| picture | not found of texrs.remove |\n|---|---|")
    for n, p in sorted(ours.items(), key=lambda item: item[1]["picture"]):
        missed = sum(not is_found(hole, votes[n]) for hole in p["holes"])
        print(f"| {p['picture']} | {missed} of {len(p['holes'])} |")


def main() -> None:
    """Write pages, or compare votes with their key."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("pictures", type=Path, nargs="*")
    parser.add_argument("--resynthesizer", type=Path)
    parser.add_argument("--holes", type=int, default=3)
    parser.add_argument("--votes", type=Path)
    options = parser.parse_args()
    if options.votes:
        reveal(options)
    elif options.pictures:
        make(options)
    else:
        parser.error("needs pictures, or --votes")


if __name__ == "__main__":
    main()

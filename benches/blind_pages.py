"""Write blind pages: an example, and results of texrs and the Resynthesizer in a hidden random order.

    python benches/blind_pages.py OUT PICTURE ... --resynthesizer PROGRAM [--seed 1]
    python benches/blind_pages.py OUT --votes votes.json

The first form writes `OUT/NAME.png` for each picture, with the exemplar between results A and B, and the hidden key
`OUT/key.json`. Exemplars are the middles of the images, and results have twice the side. The second form compares
`{"NAME": "A" | "B" | "="}` with the key, and prints the chosen programs. PROGRAM is the same as for
`synthesize_table.py`. Existing results are used again, so that pages can be updated if only texrs has changed.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from pathlib import Path

import numpy as np

import texrs
from synthesize_table import by_resynthesizer, middle
from texrs import io

GAP = 12
"""Pixels between the images of a page."""


def page(exemplar: np.ndarray, left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the three images side by side, on white."""
    pictures = [p if p.ndim == 3 else np.repeat(p[..., None], 3, axis=2) for p in (left, exemplar, right)]
    rows = max(p.shape[0] for p in pictures)
    sheet = np.full((rows, sum(p.shape[1] + GAP for p in pictures) - GAP, 3), 255, np.uint8)
    at = 0
    for picture in pictures:
        sheet[: picture.shape[0], at : at + picture.shape[1]] = picture[..., :3]
        at += picture.shape[1] + GAP
    return sheet


def make(options: argparse.Namespace) -> None:
    """Write the pages and their key."""
    options.out.mkdir(parents=True, exist_ok=True)
    key = {}
    order = np.random.default_rng()
    for path in options.pictures:
        exemplar = middle(io.read(path))
        exemplar = exemplar[..., :3] if exemplar.ndim == 3 else exemplar
        kept = options.out / "peers" / f"{path.stem}.png"
        if not kept.exists():
            kept.parent.mkdir(exist_ok=True)
            io.write(kept, by_resynthesizer(options.resynthesizer, exemplar))
        rows, columns = exemplar.shape[:2]
        ours = texrs.design(exemplar, (2 * rows, 2 * columns), seed=options.seed).image
        pair = [("ours", ours), ("peer", io.read(kept))]
        order.shuffle(pair)
        key[path.stem] = {"A": pair[0][0], "B": pair[1][0]}
        io.write(options.out / f"{path.stem}.png", page(exemplar, pair[0][1], pair[1][1]))
    (options.out / "key.json").write_text(json.dumps(key), encoding="utf-8")


def reveal(options: argparse.Namespace) -> None:
    """Print the chosen programs."""
    key = json.loads((options.out / "key.json").read_text(encoding="utf-8"))
    votes = json.loads(options.votes.read_text(encoding="utf-8"))
    chosen = {name: "equal" if vote == "=" else key[name][vote] for name, vote in votes.items()}
    print("| picture | chosen |\n|---|---|")
    for name, who in chosen.items():
        print(f"| {name} | {who} |")
    count = Counter(chosen.values())
    print(f"\nours chosen or equal: {count['ours'] + count['equal']} of {len(chosen)} ({dict(count)})")


def main() -> None:
    """Write pages, or compare votes with their key."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("pictures", type=Path, nargs="*")
    parser.add_argument("--resynthesizer", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--votes", type=Path)
    options = parser.parse_args()
    if options.votes:
        reveal(options)
    else:
        make(options)


if __name__ == "__main__":
    main()

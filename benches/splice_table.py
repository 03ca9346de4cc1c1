"""A table of splices, with the checks of `tests/splice_checks.py`, and a contact sheet of them.

    TEXRS_TEXTURES=FOLDER python benches/splice_table.py OUT [--size 192] [--auto]

The folder holds ``b-disjoint``, ``c-connected`` and ``d-background``: pictures beside JSON files with a box, scribbles and a
tag, all of them (x, y). With ``--auto`` only the pictures are used. Without a folder the built-in samples are spliced.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

import splice_checks as checks
import texrs
from texrs import elements, io, samples
from texrs.elements import Elements, Layout
from texrs.errors import TexrsError
from texrs.papers.splice.pictures import picture

ROWS = (
    ("coins-greek", "dots-two-colours", "bubbles-teal"),
    ("honeycomb-amber", "chainmail"),
    ("brick-wall-clean", "brick-wall-grey", "red-floor-tiles"),
)
SAMPLES = (("dots", "pebbles", "leaves_and_flowers"), ("net",), ("bricks",))


def read(path: Path, *, auto: bool) -> Elements:
    """Analyse a picture, as its JSON says or all by itself."""
    image = io.read(path)
    told = json.loads(path.with_suffix(".json").read_text())
    if auto:
        return elements.analyse(image)
    box = told["foreground_box"]
    x, y = box["center"]
    width, height = box["size"]
    background = np.array(told["background_scribble"])[:, ::-1]
    return elements.analyse(image, box=(y, x, height, width), background=background, layout=told["tag"])


def entries(folder: str | None, *, auto: bool) -> dict[str, Elements]:
    """Return the textures by name, disjoint foregrounds first."""
    found: dict[str, Elements] = {}
    for name in (n for group in (ROWS if folder else SAMPLES) for n in group):
        if folder:
            path = next(p for p in Path(folder).glob(f"[b-d]-*/{name}.*") if p.suffix != ".json")
            found[name] = read(path, auto=auto)
            continue
        found[name] = Elements.of_sample(samples.load(name, size=(256, 256)))
    return found


def verdict(a: Elements, b: Elements, result: texrs.Synthesis) -> dict[str, float]:
    """Measure a splice; what does not apply is left out."""
    found = {
        "colours": checks.copied(a, result)[0],
        "holes": result.report["holes"],
        "ground": (checks.coherence(a, result) or (np.nan,))[0],
    }
    if a.layout == Layout.DISJOINT:
        windows = checks.windows(a, result)
        if windows:
            found |= dict(zip(("found", "away"), checks.presence(a, result), strict=True))
            found |= dict(zip(("shape p5", "shape"), checks.shapes(a, result), strict=True))
        found |= {"flipped": result.report["flipped_rigid"], "doubled": checks.doubled(a, result)}
    return {k: round(float(v), 3) for k, v in found.items()}


def small(image: np.ndarray, side: int = 192) -> np.ndarray:
    """Show the top left corner, padded to a square."""
    shown = picture(image)[:side, :side]
    return np.pad(shown, ((0, side - shown.shape[0] + 4), (0, side - shown.shape[1] + 4), (0, 0)))


def main() -> None:
    words = [w for w in sys.argv[1:] if not w.startswith("--")]
    out = Path(words[0] if words else "splice-table")
    size = int(sys.argv[sys.argv.index("--size") + 1]) if "--size" in sys.argv else 192
    known = entries(os.environ.get("TEXRS_TEXTURES"), auto="--auto" in sys.argv)
    out.mkdir(parents=True, exist_ok=True)
    rows = [np.concatenate([small(np.zeros((4, 4), np.uint8)), *(small(b.image) for b in known.values())], axis=1)]
    for mine, a in known.items():
        row = [small(a.image)]
        for theirs, b in known.items():
            start = time.perf_counter()
            try:
                result = texrs.splice(a, b, size, seed=1)
            except TexrsError as error:
                print(f"{mine:22s} {theirs:22s} {error}")
                row.append(small(np.zeros((4, 4), np.uint8)))
                continue
            spent = time.perf_counter() - start
            io.write(out / f"{mine}-on-{theirs}.png", result.image)
            row.append(small(result.image))
            print(f"{mine:22s} {theirs:22s} {spent:5.1f} s  {verdict(a, b, result)}", flush=True)
        rows.append(np.concatenate(row, axis=1))
        io.write(out / "matrix.png", np.concatenate(rows))


if __name__ == "__main__":
    main()

"""Compare scale maps with ground truth: correlation, slope and speed in a Markdown table, and images.

    TEXRS_TEXTURES=<folder> python benches/scale_maps_table.py [--out table.md] [--pictures DIR]

Without a folder: the generated samples. A folder is searched for ``ground-truth.json``.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from texrs import io, samples, scale_maps
from texrs._arrays import to_unit

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))
import scale_checks as checks

MEASURES = ("skeleton", "count", "area")
TRENDS = ("plane", "linear", "quadratic")
HEAD = (
    "picture", "angles", "with fov", "mask", "inverted", *TRENDS, *MEASURES, "width", "in a hole", "without hole",
)  # fmt: skip
MEANING = """
Correlation of the scales with the width of elements (truth^(2/3)) / slope of their logarithms. `angles`: from_angles with
the true slant and tilt (>= .999); `with fov` (slope .95 to 1.05); `mask`, `inverted`: from_mask by auto_mask and by its
opposite (>= .90, stone wall .75); then brought to a trend (`plane` >= .98, stone wall .94); other
measures; `width`: plane and foreshortened. A mask gives the root of the area, so the ideal slope of `mask` and of the
trends is 1.5 and that of `width` 1. `in a hole`: measured around a hole of 30 % of each side and continued into it, beside
the same pixels where nothing is missing.
"""


def row(case: checks.Case) -> list[str]:
    mask = scale_maps.auto_mask(case.image)
    found = [
        *checks.by_angles(case),
        checks.by_mask(case, mask),
        checks.by_mask(case, ~mask),
        *(checks.by_mask(case, mask, trend=trend) for trend in TRENDS),
        *(checks.by_mask(case, mask, measure=measure) for measure in MEASURES),
        checks.by_mask(case, mask, trend="plane", foreshortened=True),
        *checks.in_hole(case),
    ]
    cells = [
        f"{a.correlation:.4f} / {a.slope:.2f}" if i < 2 else f"{a.correlation:.3f} / {a.slope:.2f}"
        for i, a in enumerate(found)
    ]
    return [case.name, *cells]


def picture(case: checks.Case) -> np.ndarray:
    """Return the image, its mask, the truth, the map of the mask and the map of the angles, side by side."""
    mask = scale_maps.auto_mask(case.image)
    shown = np.rint(to_unit(case.image)[..., :3] * 255).astype(np.uint8)
    if shown.shape[-1] == 1:
        shown = np.repeat(shown, 3, axis=-1)
    maps = (
        case.width / np.exp(np.log(case.width).mean()),
        scale_maps.from_mask(mask, foreshortened=True),
        scale_maps.from_angles(mask.shape, case.slant, case.tilt, fov=case.fov),
    )
    black = np.repeat(mask[..., np.newaxis], 3, axis=-1).astype(np.uint8) * 255
    return np.concatenate([shown, black, *(scale_maps.picture(m, largest=4) for m in maps)], axis=1)


def seconds(work: Callable[[], object]) -> float:
    """Return the minimum processor time of five runs, which other work on the machine disturbs least."""
    spent = []
    for _ in range(5):
        start = time.process_time()
        work()
        spent.append(time.process_time() - start)
    return min(spent)


def speed() -> list[str]:
    sample = samples.tilted_discs((1024, 1024))
    assert sample.mask is not None
    known = np.ones(sample.mask.shape, np.bool_)
    known[300:600, 200:700] = False
    options: list[tuple[str, Callable[[], object]]] = [
        ("from_mask", lambda: scale_maps.from_mask(sample.mask)),
        ("from_mask, plane", lambda: scale_maps.from_mask(sample.mask, trend="plane")),
        ("from_mask, windows of 16", lambda: scale_maps.from_mask(sample.mask, window=16)),
        ("from_mask, skeleton", lambda: scale_maps.from_mask(sample.mask, measure="skeleton")),
        ("from_mask, count", lambda: scale_maps.from_mask(sample.mask, measure="count")),
        ("from_mask, area (as printed)", lambda: scale_maps.from_mask(sample.mask, measure="area")),
        ("from_mask, with a hole", lambda: scale_maps.from_mask(sample.mask, known=known)),
        ("auto_mask", lambda: scale_maps.auto_mask(sample.image)),
        ("from_angles", lambda: scale_maps.from_angles(1024, 45, 90)),
    ]
    return [f"| {name} | {seconds(work):.3f} |" for name, work in options]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, help="markdown file, instead of stdout")
    parser.add_argument("--pictures", type=Path, help="folder for pictures")
    options = parser.parse_args()
    folder = os.environ.get("TEXRS_TEXTURES")
    cases = list(checks.in_folder(Path(folder)) if folder else checks.generated(384))
    if not cases:
        sys.exit(f"{folder}: holds no ground-truth.json")
    lines = [f"| {' | '.join(HEAD)} |", f"|{'---|' * len(HEAD)}"]
    for case in cases:
        lines.append(f"| {' | '.join(row(case))} |")
        if options.pictures:
            options.pictures.mkdir(parents=True, exist_ok=True)
            io.write(options.pictures / f"{case.name.replace(' ', '-')}.png", picture(case))
    text = "\n".join([*lines, MEANING, "| a megapixel | processor seconds |", "|---|---|", *speed(), ""])
    if options.out:
        options.out.write_text(text, encoding="utf-8")
    else:
        print(text)


if __name__ == "__main__":
    main()

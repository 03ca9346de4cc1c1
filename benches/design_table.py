"""Run the acceptance checks of DESIGN on many textures: a Markdown table and images.

    TEXRS_TEXTURES=<folder> python benches/design_table.py [--seeds 3] [--size 2x] [--out table.md] [--pictures DIR]

Without a folder, the generated samples and scikit-image's photographs are used. A folder may contain any tree of
images that `texrs.io` reads. Other files are named and skipped. A long side is first cropped to `--crop` pixels.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import texrs
from texrs import samples
from texrs.errors import TexrsError

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))
import design_checks as checks

HEAD = ("D1", "D2", "D2b", "D3", "D3b", "D4", "D5", "D6", "D7", "D8", "D12", "D13")
MEANING = """
D1 holes before fill; D2 gradient at seams over the exemplar's (<= 1.5), share above its 99th percentile (<= 3 %); D2b
the same before > after the correction; D3 jump across the wrap over the inner gradient (<= 1.5), worst run of nine over
the usual worst (<= 2); D3b deviation of the wrap's rows, columns in sigmas (<= 3); D4 distance of patches to the
exemplar over its own, mean (<= 1.15), 95th percentile (<= 1.25); D5 difference of seeds, median (>= 0.8), least
(>= 0.5); of parts to the exemplar and its mirrors (>= 0.4), also moved (>= 0.2); D6 change of gradients away from seams,
median (<= 0.3), 99th percentile (<= 2), change of smoothed colours (<= 5), of 255; D7 distance of histograms (<= 12 of
255); D8 elements an area (0.6 to 1.5), their median area (0.6 to 1.4), (elements counted in the exemplar);
D12 length of axes on which the picture meets its mirror image, of height plus width (<= 0.1); D13 effective share of the
exemplar that is used (>= 0.5), how often its favourite cell is shown over the mean (<= 5). Figures are
those of the worst seed; **bold** fails; "-" where there is nothing to measure.
"""


def generated(crop: int) -> Iterator[tuple[str, np.ndarray, np.ndarray | None]]:
    for name in ("pebbles", "leaves_and_flowers", "beans", "dots", "grit", "bark", "bricks", "net", "scales", "weave"):
        sample = samples.load(name)
        yield name, sample.image[:crop, :crop], None if sample.labels is None else sample.labels[:crop, :crop]
    for name in samples.photographs():
        yield name, np.ascontiguousarray(samples.photograph(name).image[:crop, :crop]), None


def in_folder(folder: Path, crop: int) -> Iterator[tuple[str, np.ndarray, np.ndarray | None]]:
    """Return the images of a folder and its subfolders. Print the skipped files and the reasons."""
    for path in sorted(p for p in folder.rglob("*") if p.is_file()):
        name = str(path.relative_to(folder))
        try:
            image = texrs.io.read(path)
        except TexrsError as error:
            print(f"left out: {name}: {str(error).removeprefix(f'{path}: ')}", file=sys.stderr)
            continue
        # Use the middle, because the borders of a photograph often do not show the texture.
        box = tuple(slice(max(0, (n - crop) // 2), max(0, (n - crop) // 2) + crop) for n in image.shape[:2])
        yield name, np.ascontiguousarray(image[box]), None


def size_of(text: str, image: np.ndarray) -> tuple[int, int]:
    """Read ``2x`` (times the exemplar), ``300`` or ``300x400``."""
    if text.endswith("x"):
        rows, columns = (round(float(text[:-1]) * n) for n in image.shape[:2])
    else:
        rows, columns = (int(n) for n in (text.split("x") * 2)[:2])
    return rows, columns


def worst(found: list[Any]) -> Any:
    """Return the first record that fails, or else the first."""
    return next((f for f in found if f.applies and not f.passed), found[0])


def measure(
    image: np.ndarray, labels: np.ndarray | None, size: tuple[int, int], seeds: int
) -> tuple[dict[str, Any], list[Any], float]:
    """Design a texture with several seeds.

    Return the worst record of each check, the results, and the seconds for a result.
    """
    results, seconds = [], []
    for seed in range(seeds):
        start = time.perf_counter()
        results.append(texrs.design(image, size, seed=seed))
        seconds.append(time.perf_counter() - start)
    found: dict[str, list[Any]] = {name: [] for name in HEAD if name != "D5"}
    for r in results:
        before = r.stages["before_blending"]
        found["D1"].append(checks.d1(image, r, size))
        found["D2"].append(checks.d2(image, r.image, r.source_map))
        found["D2b"].append(checks.d2b(image, before, r.image, r.source_map))
        found["D3"].append(checks.d3(r.image))
        found["D3b"].append(checks.d3b(r.image))
        found["D4"].append(checks.d4(image, r.image))
        found["D6"].append(checks.d6(image, before, r.image, r.source_map))
        found["D7"].append(checks.d7(image, r.image))
        found["D8"].append(checks.d8(image, r.image, r.source_map, labels, r.report))
        found["D12"].append(checks.d12(r.source_map))
        found["D13"].append(checks.d13(r.source_map))
    records = {name: worst(records) for name, records in found.items()}
    records["D5"] = checks.d5(image, [r.image for r in results], results[0].report)
    return records, results, float(np.median(seconds))


def cell(record: Any) -> str:
    if not record.applies:
        return "-"
    return record.figures if record.passed else f"**{record.figures}**"


def row(name: str, image: np.ndarray, records: dict[str, Any], results: list[Any], seconds: float) -> str:
    report = results[0].report
    failed = [n for n in HEAD if records[n].applies and not records[n].passed]
    cells = [
        f"{name} {image.shape[1]}x{image.shape[0]}",
        str(report["elements"]),
        report["segmentation"] + (", not turned" if report.get("rotate") == 0 else ""),
        *(cell(records[n]) for n in HEAD),
        "pass" if not failed else f"fails {', '.join(failed)}",
        f"{seconds:.1f}",
    ]
    return "| " + " | ".join(cells) + " |"


def seen(image: np.ndarray) -> np.ndarray:
    """Return an image as 8-bit RGB for display."""
    values = np.rint(255 * np.clip(checks.unit(image), 0, 1)).astype(np.uint8)
    return values[..., :3] if values.shape[-1] >= 3 else np.repeat(values[..., :1], 3, axis=-1)


def sheet(image: np.ndarray, result: Any) -> np.ndarray:
    """Put the exemplar and the result side by side."""
    left, right = seen(image), seen(result.image)
    out = np.full((max(left.shape[0], right.shape[0]), left.shape[1] + 8 + right.shape[1], 3), 255, np.uint8)
    out[: left.shape[0], : left.shape[1]] = left
    out[: right.shape[0], left.shape[1] + 8 :] = right
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--size", default="2x", help="2x (times the exemplar), 300 or 300x400")
    parser.add_argument("--crop", type=int, default=256, help="longest side of an exemplar")
    parser.add_argument("--only", default="", help="textures whose names hold this")
    parser.add_argument("--out", type=Path, help="file for the table; it is printed in any case")
    parser.add_argument("--pictures", type=Path, help="folder for sheets of exemplar and result")
    parser.add_argument("--suffix", choices=(".jpg", ".png"), default=".jpg", help="format of the sheets")
    options = parser.parse_args()
    folder = os.environ.get("TEXRS_TEXTURES")
    textures = in_folder(Path(folder), options.crop) if folder else generated(options.crop)
    head = ("texture", "elements", "kind", *HEAD, "verdict", "seconds")
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    print(*lines, sep="\n", flush=True)
    for name, image, labels in textures:
        if options.only not in name:
            continue
        try:
            records, results, seconds = measure(image, labels, size_of(options.size, image), options.seeds)
        except TexrsError as error:
            print(f"left out: {name}: {error}", file=sys.stderr)
            continue
        lines.append(row(name, image, records, results, seconds))
        print(lines[-1], flush=True)
        if options.pictures:
            options.pictures.mkdir(parents=True, exist_ok=True)
            stem = name.replace(os.sep, "-").replace(".", "-")
            for seed, result in enumerate(results):
                texrs.io.write(options.pictures / f"{stem}-{seed}{options.suffix}", sheet(image, result))
    print(MEANING)
    if options.out:
        options.out.write_text("\n".join(lines) + "\n" + MEANING, encoding="utf-8")


if __name__ == "__main__":
    main()

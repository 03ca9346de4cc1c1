"""Check SOLID on many volumes: a Markdown table of texture, field and check, and images.

    [TEXRS_TEXTURES=<folder>] python benches/solid_table.py [--seeds 3] [--size 96] [--only NAME] [--quality preserve]
        [--evaluator <texture_quality.py>] [--out table.md] [--pictures DIR]

Without a folder: the generated volumes. With one: also each volume in it, cropped to its middle 64 voxels a side. With
`--evaluator`, a module with `compare_volumes` and `failures`, its verdict is a column.
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
from texrs import fields, samples, volume
from texrs.errors import TexrsError

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))
import evaluators
import solid_checks as checks

CROP = 64
HEAD = ("S1", "S2", "S3", "S3b", "S5", "S6", "S9")
FIELDS = {
    "identity": fields.identity(),
    # The folds of this zigzag must not be on planes where S6 looks for traces of the algorithm.
    "zigzag": fields.zigzag(period=60, angle=30, plane="xz"),
    "circular": fields.circular(axis="x", radial="z"),
    "rotation": fields.rotation(30, "xz"),
    "rotation_3d": fields.rotation_3d(30, 30),
}
LAYERED, ROUND, TRUNK = tuple(FIELDS), ("identity", "circular"), ("identity", "zigzag")
ASKED = {"stripes": LAYERED, "pebbles": ROUND, "particles": ROUND, "wood": TRUNK, "foam": TRUNK}
COHERENT = {"identity": 0.65, "zigzag": 0.55, "circular": 0.4, "rotation": 0.55, "rotation_3d": 0.55}
MEANING = """
S1 where the layers lie (stripes): degrees that the field turns the normal (>= 10), median and 90th percentile of the
error (exemplar's own + 3, + 6); S2 mean frequency over the exemplar's (0.90 to 1.15), less that of the identity
(+-0.06), at the nearest samples; S3 share of each class of colour over the exemplar's, dark to light (+-20 %, under a
field +-30 %); S3b particles (sample "particles"): count, mean and median size over the exemplar's (+-20, 25, 20 %, under a
field +-35 %); S5 coherent neighbours (>= 0.65 identity, 0.55, 0.4 circular), largest patch (<= 6 % or four cells), most
used cell over the mean (<= 15); S6 change at planes of 8, 16, 24, 32 over the mean (0.8 to 1.25), where it is more than
at all others so far apart, and by more than they differ; isolated voxels in per cent; S9 a field of right angles against
the turned exemplar: shares, frequency, distance of autocorrelations (<= 0.08).
Figures are means over the seeds; **bold** fails; "-" where a check does not apply.
"""


def textures(folder: str | None) -> Iterator[tuple[str, np.ndarray, np.ndarray | None]]:
    """Return the samples, and the volumes of a folder with sides of at least 16."""
    for name in samples.names():
        sample = samples.load(name)
        if sample.image.ndim == 4:
            yield name, sample.image, sample.mask if name == "particles" else None
    for path in sorted(p for p in Path(folder).rglob("*") if p.is_file()) if folder else ():
        try:
            whole = texrs.io.read_volume(path)
        except TexrsError:
            continue
        box = tuple(slice((n - min(n, CROP)) // 2, (n + min(n, CROP)) // 2) for n in whole.shape[:3])
        if min(whole.shape[:3]) < 16:
            print(f"left out: {path.name}: {whole.shape} is too thin", file=sys.stderr)
            continue
        yield path.stem, np.ascontiguousarray(whole[box]), None


def asked(name: str) -> tuple[str, ...]:
    return next((kinds for word, kinds in ASKED.items() if word in name), ("identity",))


def measure(
    name: str, image: np.ndarray, mask: np.ndarray | None, kind: str, results: list[Any], still: list[Any], side: int
) -> dict[str, Any]:
    """Return the results of each check, the mean over the seeds, or none if a check does not apply."""
    turned = kind != "identity"
    found: dict[str, list[Any]] = {check: [] for check in HEAD}
    for seed, (made, unturned) in enumerate(zip(results, still, strict=True)):
        if turned and "stripes" in name:
            found["S1"].append(checks.s1(image, made.image, FIELDS[kind]))
        found["S2"].append(checks.s2(image, made, unturned if turned else None))
        if "stripes" not in name:
            found["S3"].append(checks.s3(image, made.image, 0.3 if turned else 0.2))
            found["S6"].append(checks.s6(image, made.image))
        if mask is not None:
            found["S3b"].append(checks.s3b(mask, made, turned=turned))
        found["S5"].append(checks.s5(made, COHERENT[kind]))
        if not turned and "stripes" in name:
            found["S9"].append(checks.s9(image, side, seed))
    return {check: checks.mean(several) if several else None for check, several in found.items()}


def cell(record: Any) -> str:
    if record is None:
        return "-"
    return record.figures if record.passed else f"**{record.figures}**"


def judged(evaluator: Any, image: np.ndarray, made: np.ndarray) -> str:
    """Return the evaluator's numbers for a volume, and the names of those that fail."""
    try:
        scores = evaluator.compare_volumes(image, made)
    except ValueError as problem:
        return f"not judged: {problem}"
    failed = evaluator.failures(scores)
    return ", ".join(f"**{k} {v:.2f}**" if k in failed else f"{k} {v:.2f}" for k, v in scores.items())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--size", type=int, default=96, help="side of the results")
    parser.add_argument("--quality", default="preserve", choices=("preserve", "fast", "optimise"))
    parser.add_argument("--only", default="", help="textures whose names hold this")
    parser.add_argument("--evaluator", type=Path, help="Python file with compare_volumes and failures")
    parser.add_argument("--out", type=Path, help="file for the table; it is printed in any case")
    parser.add_argument("--pictures", type=Path, help="folder for slices of exemplar and results")
    options = parser.parse_args()
    evaluator = evaluators.load(options.evaluator) if options.evaluator else None
    head = ["texture", "field", *HEAD, "verdict", "seconds"] + ["evaluator"] * (evaluator is not None)
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    print(*lines, sep="\n", flush=True)
    for name, image, mask in textures(os.environ.get("TEXRS_TEXTURES")):
        if options.only not in name:
            continue
        still: list[Any] = []
        for kind in asked(name):
            results, seconds = [], []
            for seed in range(options.seeds):
                start = time.perf_counter()
                grown = texrs.solid(image, options.size, seed=seed, field=FIELDS[kind], quality=options.quality)
                results.append(grown)
                seconds.append(time.perf_counter() - start)
            still = still or results
            records = measure(name, image, mask, kind, results, still, options.size)
            failed = [c for c, r in records.items() if r is not None and not r.passed]
            verdict = "pass" if not failed else f"fails {', '.join(failed)}"
            row = [name, kind, *(cell(records[c]) for c in HEAD), verdict, f"{np.median(seconds):.1f}"]
            if evaluator is not None:
                row.append(judged(evaluator, image, results[0].image) if kind == "identity" else "-")
            lines.append("| " + " | ".join(row) + " |")
            print(lines[-1], flush=True)
            if options.pictures:
                options.pictures.mkdir(parents=True, exist_ok=True)
                for seed, result in enumerate(results):
                    shown = texrs.synthesis.preview(volume.slices(result.image))
                    texrs.io.write(options.pictures / f"{name}-{kind}-{seed}.png", shown)
    print(MEANING)
    if options.out:
        options.out.write_text("\n".join(lines) + "\n" + MEANING, encoding="utf-8")


if __name__ == "__main__":
    main()

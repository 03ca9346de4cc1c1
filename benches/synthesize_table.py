"""Judge verbs on many images, compared with plain quilting and the Resynthesizer, by evaluators.

    python benches/synthesize_table.py OUT --evaluator FILE.py ... [--verb synthesize] [--seeds 3] [--whole] [--size 768]
        [--shown 768] [--quality preserve] [--only NAME] [--resynthesizer PROGRAM] PICTURE ...

The verbs are `texrs.synthesize`, `texrs.design`, and windows of `texrs.CornerTiles`. The exemplar is the middle 256
pixels a side of each image, or all of it. Results have twice its size, or the requested one, and stay in OUT.
Evaluators get the middle of results larger than `--shown`. A result is good if all its scores are in their bounds, or at
most 1.1 times the score of a second crop of the same photograph. This crop is as far from the
exemplar as possible. Quilting is `texrs.design` without deformation, mirror images and blending. The Resynthesizer is
an external program (see `fillers.py`). It fills the rest around the exemplar, once.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from skimage import io

import evaluators
import texrs

SIDE = 256
STILL = texrs.DeformationOptions(operations=0, allow_mirror=False)


def middle(image: np.ndarray, side: int = SIDE) -> np.ndarray:
    row, column = ((n - min(n, side)) // 2 for n in image.shape[:2])
    return np.ascontiguousarray(image[row : row + side, column : column + side])


def second(image: np.ndarray) -> np.ndarray | None:
    """Return the largest corner of the image that overlaps the middle least, or none without other pixels."""
    if max(image.shape[:2]) < 1.5 * SIDE:
        return None
    rows, columns = (min(n, SIDE) for n in image.shape[:2])
    return np.ascontiguousarray(image[:rows, :columns])


def by_resynthesizer(program: Path, image: np.ndarray) -> np.ndarray:
    """Return the engine's result next to the exemplar, with colours of the exemplar only."""
    rows, columns = image.shape[:2]
    canvas = np.zeros((2 * rows, 3 * columns, 3), np.uint8)
    canvas[:rows, :columns] = image[..., :3] if image.ndim == 3 else image[..., None]
    hole = np.full(canvas.shape[:2], 255, np.uint8)
    hole[:rows, :columns] = 0
    with tempfile.TemporaryDirectory() as folder:
        names = [Path(folder) / n for n in ("image.ppm", "mask.pgm", "out.ppm")]
        names[0].write_bytes(b"P6\n%d %d\n255\n" % canvas.shape[1::-1] + canvas.tobytes())
        names[1].write_bytes(b"P5\n%d %d\n255\n" % canvas.shape[1::-1] + hole.tobytes())
        ran = {**os.environ, "MATCH_CONTEXT": "0"}
        subprocess.run([program, *names], check=True, capture_output=True, timeout=900, env=ran)
        made = io.imread(names[2])
    return made[:, columns:]


def results(image: np.ndarray, options: argparse.Namespace) -> Iterator[tuple[str, int, np.ndarray]]:
    """Return the results of each method, one for each seed."""
    size = (options.size, options.size) if options.size else (2 * image.shape[0], 2 * image.shape[1])
    for seed in range(1, options.seeds + 1):
        if options.verb == "design":
            made = texrs.design(image, size, seed=seed).image
        elif options.verb == "tiles":
            made = texrs.CornerTiles(image, seed=seed)[0 : size[0], 0 : size[1]]
        else:
            made = texrs.synthesize(image, size, seed=seed, quality=options.quality).image
        yield "texrs", seed, made
        if options.peers:
            plain = texrs.design(image, size, seed=seed, copies=1, deformation=STILL, screening=None)
            yield "quilting", seed, plain.image
    if options.resynthesizer:
        yield "resynthesizer", 1, by_resynthesizer(options.resynthesizer, image)


def judged(judges: evaluators.Judges, scores: dict[str, float], real: dict[str, float]) -> tuple[list[str], str]:
    """Return the scores that are neither in bounds nor similar to a real crop's, and their text."""
    bad = [n for n in judges.failed(scores) if n not in real or judges.worse(n, scores[n], real[n]) > 1.1]
    return bad, " ".join(f"{n} {scores[n]:.2f}" for n in bad)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("pictures", type=Path, nargs="+")
    parser.add_argument("--evaluator", type=Path, action="append", required=True)
    parser.add_argument("--verb", default="synthesize", choices=("synthesize", "design", "tiles"))
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--whole", action="store_true", help="the whole pictures are the exemplars")
    parser.add_argument("--size", type=int, help="side of the results")
    parser.add_argument("--shown", type=int, default=768, help="side of the middle that evaluators are shown")
    parser.add_argument("--quality", default="preserve", choices=("preserve", "fast", "optimise"))
    parser.add_argument("--only", default="", help="pictures whose names hold this")
    parser.add_argument("--peers", action="store_true", help="plain quilting as well")
    parser.add_argument("--resynthesizer", type=Path)
    options = parser.parse_args()
    modules = [evaluators.load(path) for path in options.evaluator]
    options.out.mkdir(parents=True, exist_ok=True)
    fine: dict[str, list[list[bool]]] = {}
    print("| picture | way | fine | tear | verbatim | out of bounds (seed: score) |\n" + "|---" * 6 + "|", flush=True)
    for path in options.pictures:
        if options.only not in path.stem:
            continue
        whole = texrs.io.read(path)
        image = whole if options.whole else middle(whole)
        judges = evaluators.Judges(modules, image)
        crop, real = None if options.whole else second(whole), None
        texrs.io.write(options.out / f"{path.stem}.png", image)
        rows: dict[str, list[tuple[int, str, dict[str, float]]]] = {}
        for way, seed, picture in results(image, options):
            texrs.io.write(options.out / f"{path.stem}-{way}-{seed}.png", picture)
            scores = judges.scores(middle(picture, options.shown))
            bad, words = judged(judges, scores, {})
            if bad and crop is not None:
                real = judges.scores(crop) if real is None else real
                bad, words = judged(judges, scores, real)
            rows.setdefault(way, []).append((seed, words, scores))
        for way, found in rows.items():
            good = [not words for _, words, _ in found]
            most = " | ".join(f"{max(s.get(n, np.nan) for _, _, s in found):.3f}" for n in ("tear", "verbatim_share"))
            fine.setdefault(way, []).append(good)
            said = "; ".join(f"{seed}: {words}" for seed, words, _ in found if words)
            print(f"| {path.stem} | {way} | {sum(good)}/{len(good)} | {most} | {said} |", flush=True)
    for way, pictures in fine.items():
        count, total = sum(map(sum, pictures)), sum(map(len, pictures))
        print(f"\n{way}: {count} of {total} results fine; {sum(map(all, pictures))} of {len(pictures)} in all seeds")


if __name__ == "__main__":
    sys.exit(main())

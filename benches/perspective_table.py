"""Check PERSPECTIVE on textures with known scale: a Markdown table of texture, target and check, and images.

    [TEXRS_TEXTURES=<folder>] python benches/perspective_table.py [--seeds 3] [--size 320x384] [--only NAME]
        [--variants default,alone,plain,paper] [--evaluator <texture_quality.py>] [--tears <deep_quality.py>]
        [--out table.md] [--pictures DIR]

The textures are generated discs and ellipses on a floor. With a folder, each image in it is also a texture. The scale
map of an image is `NAME-scale.npy`, which contains square roots of areas, S^1.5. If the file is missing, the map is
measured. Variants:

- `alone` neither flattens nor resizes the exemplar;
- `copies` uses four further sizes, and does not use the plane;
- `plain` does not weight scales in the choice of patches;
- `paper` is the algorithm as printed.

With `--evaluator`, a module with `perspective_agreement`, the table has columns for its rank correlation, slope and
spread. The rows `drawn` have its values for discs that are drawn to the same target, without synthesis. With
`--tears`, a module with `Judge(exemplar).scores(picture)`, the table has a column for the share of torn cells."""

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
from texrs import io, scale_maps

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))
import evaluators
import perspective_checks as checks

VARIANTS: dict[str, dict[str, Any]] = {
    "default": {},
    "alone": {"augment_scales": False},
    "copies": {"augment_scales": (0.8, 0.64, 1.25, 1.5625)},
    "plain": {"scale_weight": 0.0},
    "paper": {"method": "paper"},
}
"""Options of the verb."""
HEAD = ("rho", "slope", "spread", "tear", "wavelength", "error", "sharp", "colour", "rows", "seconds")
BOUNDS = {
    "spread": (0, 0.1),
    "tear": (0, 0.15),
    "error": (0, 0.08),
    "sharp": (0.9, 1.1),
    "colour": (0, 0.012),
    "rows": (-1, 0),
}
MEANING = """
rho, slope: rank correlation and slope of the logarithms of the evaluator's scale and the wanted one (>= 0.95 where the map is
stretched ("larger") and on a ramp, 0.85 on a wave, 0.9 on a hill, or 0.95 of the exemplar's own; slopes of 0.75 to 1.25 are
wanted, but the evaluator's windows flatten waves and hills to a half, and foreshortened elements, whose areas go with S^3,
steepen all: see `drawn` and `itself`); spread: deviation of the logarithms where all is to be of one size (<= 0.1); tear:
share of torn cells (<= 0.15);
wavelength: rank correlation of the local wavelength; error: median of |log S_e(S(p)) - log S| (<= 0.08); sharp: mean gradient
over the exemplar's at the same scales (0.9 to 1.1); colour: distance of quantiles from the exemplar's at the same scales (<=
0.012); rows: autocorrelation along rows, less the exemplar's (<= 0); seconds: of processors. Figures are means over the seeds;
**bold** fails, and the last line counts. The first line of a texture is the exemplar's own; `drawn` are discs of the very sizes
that are asked for.
"""


def textures(folder: str | None) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Return names, images and scale maps."""
    yield ("discs", *checks.floor((256, 256)))
    ellipses = texrs.samples.tilted_discs((256, 256))
    yield "ellipses", ellipses.image, ellipses.scale_map
    for path in sorted(p for p in Path(folder).iterdir() if p.suffix in (".png", ".jpg")) if folder else ():
        image = io.read(path)[..., :3]
        truth = path.with_name(f"{path.stem}-scale.npy")
        if truth.exists():
            root = np.load(truth).astype(np.float32) ** np.float32(2 / 3)
            scale = scale_maps.resample(root, image.shape[:2])
        else:
            scale = scale_maps.from_mask(scale_maps.auto_mask(image))
        yield path.stem, image, np.asarray(scale / np.exp(np.log(scale).mean()), np.float32)


def drawn(evaluator: Any, target: np.ndarray, seeds: int) -> dict[str, float]:
    """Return the evaluator's values for discs that have the requested sizes by construction."""
    relative = target / np.exp(np.log(target).mean())
    pictures = [checks.drawn(relative, seed) for seed in range(1, seeds + 1)]
    seen = [evaluator.perspective_agreement(p, target) for p in pictures]
    local = [checks.fidelity(p, target)[0] for p in pictures]
    mean = {"rho": np.mean([s["rho"] for s in seen]), "slope": np.mean([s["gain"] for s in seen])}
    return {**{name: float(v) for name, v in mean.items()}, "wavelength": float(np.mean(local))}


def ask(scale: np.ndarray, shape: tuple[int, int]) -> dict[str, np.ndarray]:
    """Return the targets: the exemplar's stretched map, three others, and one size everywhere."""
    constant = np.full(shape, np.exp(np.log(scale).mean()), np.float32)
    return {"larger": scale_maps.resample(scale, shape), **checks.targets(scale, shape), "constant": constant}


def measure(
    evaluator: Any, judge: Any, image: np.ndarray, target: np.ndarray, example: np.ndarray, scale: np.ndarray
) -> dict[str, float]:
    """Return the numbers of one image, except those that only its synthesis has."""
    flat = float(np.ptp(np.log(target))) < 1e-6
    agreed = {} if evaluator is None else evaluator.perspective_agreement(image, target)
    return {
        "rho": agreed.get("rho", np.nan),
        "slope": agreed.get("gain", np.nan),
        "spread": agreed.get("spread", np.nan) if flat else np.nan,
        "tear": np.nan if judge is None else judge.scores(evaluators.as_float(image))["tear"],
        "wavelength": np.nan if flat else checks.fidelity(image, target)[0],
        "sharp": checks.sharpness(example, scale, image, target),
        "colour": checks.colour_distance(example, scale, image, target),
        "rows": checks.repetition(image) - checks.repetition(example),
    }


def shown(name: str, value: float, target: str, own: dict[str, float]) -> str:
    """Return a number as text, bold if it fails."""
    low, high = BOUNDS.get(name, (-np.inf, np.inf))
    if name == "rho":
        asked = {"larger": 0.95, "ramp": 0.95, "wave": 0.85, "radial": 0.9, "constant": -1.0}[target]
        low = min(asked, 0.95 * own["rho"])
    text = f"{value:.3f}"
    return text if low <= value <= high or np.isnan(value) else f"**{text}**"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--size", default="320x384")
    parser.add_argument("--only", default="")
    parser.add_argument("--variants", default="default,plain")
    parser.add_argument("--evaluator", type=Path)
    parser.add_argument("--tears", type=Path)
    parser.add_argument("--out")
    parser.add_argument("--pictures")
    asked = parser.parse_args()
    rows, columns = (int(side) for side in asked.size.split("x"))
    evaluator = evaluators.load(asked.evaluator) if asked.evaluator else None
    tears = evaluators.load(asked.tears) if asked.tears else None
    lines = [MEANING, "| texture | target | variant | " + " | ".join(HEAD) + " |", "|---" * (len(HEAD) + 3) + "|"]

    passed: dict[str, list[bool]] = {variant: [] for variant in asked.variants.split(",")}

    def say(line: str) -> None:
        lines.append(line)
        print(line, flush=True)

    for name, image, scale in textures(os.environ.get("TEXRS_TEXTURES")):
        if asked.only not in name:
            continue
        judge = None if tears is None else tears.Judge(evaluators.as_float(image))
        own = measure(evaluator, judge, image, scale, image, scale)
        say(f"| {name} | | itself | " + " | ".join(f"{own[h]:.3f}" if h in own else "" for h in HEAD) + " |")
        for kind, target in ask(scale, (rows, columns)).items():
            if evaluator is not None and kind != "constant":
                truth = drawn(evaluator, target, asked.seeds)
                cells = [f"{truth[h]:.3f}" if h in truth else "" for h in HEAD]
                say(f"| {name} | {kind} | drawn | " + " | ".join(cells) + " |")
            for variant in asked.variants.split(","):
                found = []
                for seed in range(1, asked.seeds + 1):
                    start = time.process_time()
                    made = texrs.perspective(image, scale, target.shape, target=target, seed=seed, **VARIANTS[variant])
                    spent = time.process_time() - start
                    figures = {**measure(evaluator, judge, made.image, target, image, scale), "seconds": spent}
                    figures["error"] = made.report.get("scale_error", np.nan)
                    found.append(figures)
                    if asked.pictures and seed == 1:
                        Path(asked.pictures).mkdir(parents=True, exist_ok=True)
                        io.write(Path(asked.pictures) / f"{name}-{kind}-{variant}.png", made.image)
                mean = {h: float(np.mean([f[h] for f in found])) for h in HEAD}
                cells = [shown(h, mean[h], kind, own) for h in HEAD]
                say(f"| {name} | {kind} | {variant} | " + " | ".join(cells) + " |")
                passed[variant].append(not any(c.startswith("**") for c in cells))
    say("\n" + "; ".join(f"{v}: {sum(p)} of {len(p)} pass" for v, p in passed.items()))
    if asked.out:
        Path(asked.out).write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

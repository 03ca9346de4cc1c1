"""PERSPECTIVE over textures whose scale is known: texture x target x check as a markdown table, and pictures to look at.

    [TEXRS_TEXTURES=<folder>] python benches/perspective_table.py [--seeds 3] [--size 256] [--only NAME]
        [--variants default,alone,plain,paper] [--evaluator <texture_quality.py>] [--out table.md] [--pictures DIR]

Without a folder: a generated floor of discs. With one: each `NAME.png` in it beside which a `NAME-scale.npy` stands, the square
root of area ratios, S^1.5. Variants: `alone` has no resized copies, `copies` five and no plane, `plain` has no weight of
scales. With `--evaluator`, a module that has `perspective_agreement`, its rank correlation and slope are columns; the lines
`drawn` are what it says of discs that are drawn to the same target, without synthesis.
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
HEAD = ("rho", "slope", "wavelength", "error", "sharp", "colour", "rows", "seconds")
BOUNDS = {"error": (0, 0.08), "sharp": (0.9, 1.1), "colour": (0, 0.012)}
MEANING = """
rho, slope: rank correlation and slope of the logarithms of the evaluator's scale and the wanted one (>= 0.9 on a ramp and a
wave, 0.8 on a hill, or 0.95 of the exemplar's own; slopes of 0.75 to 1.25 are wanted, but the evaluator's windows flatten
waves and hills to a half, and foreshortened elements, whose areas go with S^3, steepen all: see `drawn` and `itself`);
wavelength: rank correlation of the local wavelength; error: median of |log S_e(S(p)) - log S| (<= 0.08); sharp: mean gradient
over the exemplar's at the same scales (0.9 to 1.1); colour: distance of quantiles from the exemplar's at the same scales (<=
0.012); rows: autocorrelation along rows, less the exemplar's (<= 0.15). Figures are means over the seeds; **bold** fails, and
the last line counts. The first line of a texture is the exemplar's own; `drawn` are discs of the very sizes that are asked
for.
"""


def textures(folder: str | None) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Return names, pictures and scale maps."""
    if folder is None:
        yield ("discs", *checks.floor((256, 256)))
        return
    for path in sorted(Path(folder).glob("*.png")):
        truth = path.with_name(f"{path.stem}-scale.npy")
        if truth.exists():
            image = io.read(path)[..., :3]
            root = np.load(truth).astype(np.float32) ** np.float32(2 / 3)
            scale = scale_maps.resample(root, image.shape[:2])
            yield path.stem, image, np.asarray(scale / np.exp(np.log(scale).mean()), np.float32)


def drawn(evaluator: Any, target: np.ndarray, seeds: int) -> dict[str, float]:
    """Return what the evaluator says of discs that have the wanted sizes by construction."""
    relative = target / np.exp(np.log(target).mean())
    pictures = [checks.drawn(relative, seed) for seed in range(1, seeds + 1)]
    seen = [evaluator.perspective_agreement(p, target) for p in pictures]
    local = [checks.fidelity(p, target)[0] for p in pictures]
    mean = {"rho": np.mean([s["rho"] for s in seen]), "slope": np.mean([s["gain"] for s in seen])}
    return {**{name: float(v) for name, v in mean.items()}, "wavelength": float(np.mean(local))}


def measure(
    evaluator: Any, image: np.ndarray, target: np.ndarray, example: np.ndarray, scale: np.ndarray
) -> dict[str, float]:
    """Return the figures of one picture but those that only its synthesis knows."""
    agreed = {"rho": np.nan, "gain": np.nan} if evaluator is None else evaluator.perspective_agreement(image, target)
    return {
        "rho": agreed["rho"],
        "slope": agreed["gain"],
        "wavelength": checks.fidelity(image, target)[0],
        "sharp": checks.sharpness(example, scale, image, target),
        "colour": checks.colour_distance(example, scale, image, target),
        "rows": checks.repetition(image) - checks.repetition(example),
    }


def shown(name: str, value: float, target: str, own: dict[str, float]) -> str:
    """Write a figure, bold where it fails."""
    low, high = BOUNDS.get(name, (-np.inf, np.inf))
    if name == "rho":
        low = min({"ramp": 0.9, "wave": 0.9, "radial": 0.8}[target], 0.95 * own["rho"])
    if name == "rows":
        high = 0.15
    text = f"{value:.3f}"
    return text if low <= value <= high or np.isnan(value) else f"**{text}**"


def main() -> None:
    """Make the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--only", default="")
    parser.add_argument("--variants", default="default,plain")
    parser.add_argument("--evaluator", type=Path)
    parser.add_argument("--out")
    parser.add_argument("--pictures")
    asked = parser.parse_args()
    evaluator = evaluators.load(asked.evaluator) if asked.evaluator else None
    lines = [MEANING, "| texture | target | variant | " + " | ".join(HEAD) + " |", "|---" * (len(HEAD) + 3) + "|"]

    passed: dict[str, list[bool]] = {variant: [] for variant in asked.variants.split(",")}

    def say(line: str) -> None:
        lines.append(line)
        print(line, flush=True)

    for name, image, scale in textures(os.environ.get("TEXRS_TEXTURES")):
        if asked.only not in name:
            continue
        own = measure(evaluator, image, scale, image, scale)
        say(f"| {name} | | itself | " + " | ".join(f"{own[h]:.3f}" if h in own else "" for h in HEAD) + " |")
        for kind, target in checks.targets(scale, (asked.size, asked.size)).items():
            if evaluator is not None:
                truth = drawn(evaluator, target, asked.seeds)
                cells = [f"{truth[h]:.3f}" if h in truth else "" for h in HEAD]
                say(f"| {name} | {kind} | drawn | " + " | ".join(cells) + " |")
            for variant in asked.variants.split(","):
                found = []
                for seed in range(1, asked.seeds + 1):
                    start = time.perf_counter()
                    made = texrs.perspective(image, scale, target.shape, target=target, seed=seed, **VARIANTS[variant])
                    figures = measure(evaluator, made.image, target, image, scale)
                    figures["seconds"] = time.perf_counter() - start
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

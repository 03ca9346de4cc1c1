"""Compare images along fields: costs of seams and shares of colours, for quality "preserve" and "fast".

    [TEXRS_TEXTURES=<folder>] python benches/fields_table.py [--size 256] [--seed 1] [--only NAME] [--pictures DIR]

The middle 192 x 192 pixels of each image are the exemplar. Without a folder, the images are the generated samples. A
result is grown under circular, zigzag, slanted, ramped and drawn frames. The quality "fast" starts from blocks and
corrects single points.

A seam is a pair of neighbours that are not neighbours in the exemplar. Its cost is the difference between each pixel
of the pair and the exemplar's continuation of the other pixel. The table gives the mean over all pairs of neighbours,
in 1000ths of the range. It also gives the minimum and maximum of the shares of four classes of brightness in the
result, divided by their shares in the exemplar, where the classes are equally large."""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import texrs
from texrs import fields, io, samples

SIDE, CROP = 256, 192
SUFFIXES = {".png", ".jpg", ".jpeg", ".tif"}


def load() -> Iterator[tuple[str, NDArray[np.uint8]]]:
    """Yield the images."""
    folder = os.environ.get("TEXRS_TEXTURES")
    if folder is None:
        for name in ("bricks", "dots", "net", "pebbles", "weave"):
            yield name, samples.load(name, size=(CROP, CROP)).image
        return
    for path in sorted(p for p in Path(folder).rglob("*") if p.suffix.lower() in SUFFIXES):
        image = io.read(path)
        if image.ndim == 3 and image.dtype == np.uint8 and min(image.shape[:2]) >= CROP:
            top, left = ((n - CROP) // 2 for n in image.shape[:2])
            yield path.stem, image[top : top + CROP, left : left + CROP, :3]


def list_fields(size: int) -> dict[str, texrs.fields.Field]:
    """Return the fields. The last one is drawn: its directions follow slowly changing noise."""
    angle = np.add.outer(np.sin(np.arange(size) / 40), np.cos(np.arange(size) / 55)) * 0.6
    drawn = np.stack([np.stack([np.cos(angle), -np.sin(angle)], -1), np.stack([np.sin(angle), np.cos(angle)], -1)], -2)
    return {
        "circular": fields.circular(axes=2),
        "zigzag": fields.zigzag(period=64, angle=30, axes=2),
        "rotation": fields.rotation(30, axes=2),
        "ramp": fields.scale_ramp(1, 1.6, length=size, axes=2),
        "drawn": fields.from_array(drawn),
    }


def measure_seams(image: NDArray[np.uint8], source: texrs.SourceMap) -> float:
    """Return the mean cost of seams for a pair of neighbours, in 1000ths of the range."""
    colours = image.astype(np.float64) / 255
    at, frames = source.coordinates.astype(np.float64), source.jacobians()
    total, pairs = 0.0, 0
    for axis in range(2):
        near, far = (tuple(slice(*s) if a == axis else slice(None) for a in range(2)) for s in ((0, -1), (1, None)))
        step = np.zeros(2)
        step[axis] = 1
        for here, there, sign in ((near, far, 1.0), (far, near, -1.0)):
            aside = at[here] + sign * frames[here] @ step
            seam = np.abs(aside - at[there]).max(axis=-1) > 1
            place = np.clip(np.rint(aside), 0, np.array(image.shape[:2]) - 1).astype(np.intp)
            apart = np.abs(colours[place[..., 0], place[..., 1]] - source_colours(colours, at[there])).mean(axis=-1)
            total += float(apart[seam].sum())
            pairs += seam.size
    return 1000 * total / pairs


def source_colours(colours: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the colours at the nearest pixels of coordinates."""
    place = np.clip(np.rint(at), 0, np.array(colours.shape[:2]) - 1).astype(np.intp)
    return np.asarray(colours[place[..., 0], place[..., 1]])


def measure_shares(image: NDArray[np.uint8], made: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Return the shares of four classes of brightness divided by the shares of the exemplar."""
    before, after = image.mean(axis=-1), made.mean(axis=-1)
    ends = np.quantile(before, (0.25, 0.5, 0.75))
    counts = [np.bincount(np.digitize(x, ends).ravel(), minlength=4) / x.size for x in (before, after)]
    return np.asarray(counts[1] / np.maximum(counts[0], 1e-9))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", type=int, default=SIDE)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="")
    parser.add_argument("--pictures", type=Path)
    asked = parser.parse_args()
    print("| picture | field | seams, fast | preserve | ratio | shares | s, fast | preserve |\n|" + "---|" * 8)
    ratios, even, number = [], 0, 0
    for name, image in load():
        if asked.only not in name:
            continue
        rows = []
        for title, field in list_fields(asked.size).items():
            found = {}
            for quality in ("fast", "preserve"):
                began = time.process_time()
                made = texrs.synthesize(image, asked.size, field=field, seed=asked.seed, quality=quality)
                found[quality] = measure_seams(image, made.source_map), made.image, time.process_time() - began
            (before, old, slow), (after, new, spent) = found["fast"], found["preserve"]
            share = measure_shares(image, new)
            ratios.append(after / max(before, 1e-9))
            even += bool((np.abs(share - 1) <= 0.15).all())
            number += 1
            print(
                f"| {name} | {title} | {before:.1f} | {after:.1f} | {ratios[-1]:.2f} "
                f"| {share.min():.2f} to {share.max():.2f} | {slow:.1f} | {spent:.1f} |",
                flush=True,
            )
            rows.append(np.concatenate([old, new], axis=0))
        if asked.pictures is not None:
            asked.pictures.mkdir(parents=True, exist_ok=True)
            io.write(asked.pictures / f"{name}.png", np.concatenate(rows, axis=1))
    halved = sum(r <= 0.5 for r in ratios)
    print(
        f"\nseams: {np.mean(ratios):.2f} of fast's in the mean, halved in {halved} of {number}; shares even in {even}"
    )


if __name__ == "__main__":
    main()

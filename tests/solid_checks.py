"""The acceptance checks of grown volumes: measured values and limits.

Each check takes an exemplar and a volume grown from it, and returns a `Found`. The limits are from the specification.
`mean` averages several results where it requires the mean over seeds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from texrs import fields, volume
from texrs._typing import Interpolation
from texrs.papers.solid import solid
from texrs.synthesis import Synthesis

MARGIN = 6
"""Voxels over which the direction of layers is measured."""
CELL = 24
"""Side of the cells that a volume starts from, in voxels."""


@dataclass(frozen=True)
class Found:
    """Numbers by name, each with its minimum and maximum to pass."""

    numbers: dict[str, tuple[float, float, float]]

    @property
    def failed(self) -> list[str]:
        return [k for k, (x, low, high) in self.numbers.items() if not low <= x <= high]

    @property
    def passed(self) -> bool:
        return not self.failed

    @property
    def figures(self) -> str:
        return ", ".join(f"{name} {x:.2f}".strip() for name, (x, _, _) in self.numbers.items())


def mean(several: Sequence[Found]) -> Found:
    """Average the results of several seeds."""
    first = several[0].numbers
    return Found({k: (float(np.mean([f.numbers[k][0] for f in several])), *first[k][1:]) for k in first})


def s1(exemplar: np.ndarray, image: np.ndarray, field: fields.Field) -> Found:
    """Layers follow the field: at most 3 and 6 degrees worse than the exemplar's own deviation from its mean.

    Points are left out if the requested direction 6 voxels away differs by more than 30 degrees. At the folds of a
    zigzag and at the axis of circles, a measurement over a few voxels means nothing.
    """
    grey, seen = volume.lightness(exemplar), volume.lightness(image)
    normal = volume.texture_normal(grey)
    own = volume.orientation_errors(grey, None, normal)
    field = field.over(seen.shape)
    off = volume.orientation_errors(seen, field, normal, margin=MARGIN)
    at = np.stack(np.meshgrid(*map(np.arange, seen.shape), indexing="ij"), axis=-1)
    wanted = np.einsum("...ji,j->...i", field.jacobians(at), normal.astype(np.float32))
    wanted /= np.linalg.norm(wanted, axis=-1, keepdims=True)
    inner = tuple(slice(MARGIN, n - MARGIN) for n in seen.shape)
    steady = np.ones(off.shape, bool)
    for axis in range(seen.ndim):
        for step in (-MARGIN, MARGIN):
            there = np.roll(wanted, step, axis)[inner]
            steady &= np.abs((there * wanted[inner]).sum(axis=-1)) > np.cos(np.radians(30))
    turned = np.degrees(np.arccos(np.minimum(np.abs(wanted @ normal.astype(np.float32)), 1)))
    return Found(
        {
            "turned": (float(turned.mean()), 10, 90),
            "median": (float(np.median(off[steady])), 0, float(np.median(own)) + 3),
            "90th": (float(np.quantile(off[steady], 0.9)), 0, float(np.quantile(own, 0.9)) + 6),
        }
    )


def s2(exemplar: np.ndarray, made: Synthesis, still: Synthesis | None = None, scale: float = 1.0) -> Found:
    """Features have their size: mean frequency over the exemplar's, and over that of the identity field.

    Uses nearest samples, because interpolation smooths. Enlarged parts would have steps.
    """
    how: Interpolation = "nearest" if scale == 1 else "linear"
    several = [exemplar, *(m.source_map.render(exemplar, interpolation=how) for m in (made, still) if m is not None)]
    window = min(64, *(n for i in several for n in i.shape[:3]))
    found = [volume.frequency(volume.lightness(i), window=window, whole=True) for i in several]
    ratio = found[1] / found[0]
    if scale != 1:
        return Found({"frequency": (ratio, 1 / scale - 0.08, 1 / scale + 0.08)})
    numbers = {"frequency": (ratio, 0.90, 1.15)}
    if still is not None:
        numbers["over identity"] = (ratio - found[2] / found[0], -0.06, 0.06)
    return Found(numbers)


def s3(exemplar: np.ndarray, image: np.ndarray, tolerance: float = 0.2) -> Found:
    """Each colour class keeps its share."""
    classes = volume.classes(exemplar, 4)
    before, after = (np.bincount(classes.of(i).ravel(), minlength=4) / i[..., 0].size for i in (exemplar, image))
    ratios = after / before
    return Found({f"class {k}": (float(r), 1 - tolerance, 1 + tolerance) for k, r in enumerate(ratios)})


def s3b(mask: np.ndarray, made: Synthesis, *, turned: bool = False) -> Found:
    """Particles have the same number and size; ``mask`` marks the particles of the exemplar.

    They are counted in boxes of the exemplar's size, whose borders cut as many particles.
    """
    there = made.source_map.render(mask.astype(np.uint8), interpolation="nearest") > 0
    before = volume.component_statistics(mask)
    found = []
    for corner in np.ndindex(2, 2, 2):
        starts = [c * max(0, n - m) for c, n, m in zip(corner, there.shape, mask.shape, strict=True)]
        part = tuple(slice(s, s + m) for s, m in zip(starts, mask.shape, strict=True))
        p = volume.component_statistics(there[part])
        found.append((p.density / before.density, p.mean / before.mean, p.median / before.median))
    count, size, median = np.mean(found, axis=0)
    limits = (0.35, 0.35, 0.35) if turned else (0.2, 0.25, 0.2)
    return Found(
        {
            name: (float(x), 1 - limit, 1 + limit)
            for name, x, limit in zip(("count", "mean size", "median"), (count, size, median), limits, strict=True)
        }
    )


def s5(made: Synthesis, least: float = 0.65) -> Found:
    """Neighbours continue each other, but nothing is only copied, and no part of the exemplar is preferred.

    In small volumes, a few of the cells that the volume starts from are a large share of it, so four of them may form
    one piece.
    """
    reuse = volume.cell_reuse(made.source_map)
    four = 4 * CELL**3 / made.source_map.label.size
    return Found(
        {
            "coherent": (reuse.coherent, least, 1),
            "largest": (reuse.largest, 0, max(0.06, four)),
            # The limit is high, because patches that cover seams are chosen however often they are used.
            "most used": (reuse.most_used, 0, 16),
        }
    )


def has_period(profile: np.ndarray, period: int) -> bool:
    """Return whether a profile repeats after some steps, like a weave's."""
    if len(profile) < period + 8:
        return False
    near, far = (part - part.mean() for part in (profile[:-period], profile[period:]))
    return float(near @ far) > 0.9 * float(np.linalg.norm(near) * np.linalg.norm(far)) > 0


def s6(exemplar: np.ndarray, image: np.ndarray) -> Found:
    """The planes of the algorithm's own lattices are invisible, and there is no speckle."""
    seen, own = volume.lightness(image), volume.lightness(exemplar)
    worst, beyond = 1.0, 0.0
    for change, profile in zip(volume.seam_planes(seen), volume.seam_planes(own), strict=True):
        for period in (8, 16, 24, 32):
            if has_period(profile, period):
                continue  # The texture itself has this period.
            # Planes of the algorithm's lattice have the last offset. Planes of the texture's own lattice can have any
            # offset.
            combs = [change[first::period] for first in range(period)]
            over = [abs(float(np.log(max(comb.mean(), 1e-9) / change.mean()))) for comb in combs if len(comb)]
            if len(over) < period:
                continue
            # Subtract the spread of the other offsets: if they vary widely, a larger change does not give evidence.
            more = over[-1] - max(over[:-1]) - 2 * float(np.std(over[:-1]))
            if more > beyond:
                worst, beyond = float(np.exp(over[-1])), more
    speckle = volume.speckle(seen)
    return Found(
        {
            "planes": (worst, 0.8, 1.25),
            "isolated": (100 * speckle, 0, 150 * volume.speckle(volume.lightness(exemplar)) + 0.1),
        }
    )


def turned_exemplar(exemplar: np.ndarray, frame: np.ndarray) -> np.ndarray:
    """Return the exemplar rotated by a frame of right angles."""
    order = np.abs(frame).argmax(axis=1)
    out = exemplar.transpose(*order.tolist(), *range(3, exemplar.ndim))
    flipped = [a for a in range(3) if frame[a, order[a]] < 0]
    return np.ascontiguousarray(np.flip(out, flipped))


def s9(exemplar: np.ndarray, size: int, seed: int = 0) -> Found:
    """A field of right angles gives the texture of the rotated exemplar."""
    field = fields.rotation(90, "xz")
    image = solid(exemplar, size, seed=seed, field=field).image
    assert field.constant is not None
    wanted = turned_exemplar(exemplar, field.constant)
    report = volume.compare(wanted, image)
    off = np.abs(report.autocorrelation[1] - report.autocorrelation[0])
    shares = s3(wanted, image).numbers
    shares["frequency"] = (report.frequency_ratio, 0.90, 1.15)
    shares["autocorrelation"] = (float(off.mean()), 0, 0.08)
    return Found(shares)

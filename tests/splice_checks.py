"""Measures of spliced textures, with separate code: from the images, the matches and the source map only."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label, uniform_filter
from scipy.spatial import cKDTree
from scipy.stats import wasserstein_distance

from texrs import Synthesis
from texrs.elements import ElementAnalysis

Points = NDArray[np.float64]


def grey(image: NDArray[Any]) -> NDArray[np.float64]:
    values = np.asarray(image, np.float64)
    return values.mean(axis=-1) if values.ndim == 3 else values


def colours(image: NDArray[Any]) -> NDArray[np.float64]:
    values = np.asarray(image, np.float64)
    return values if values.ndim == 3 else values[..., None]


def windows(
    a: ElementAnalysis, result: Synthesis, share: float = 0.75
) -> list[tuple[Points, Points, Points, tuple[int, int]]]:
    """Return targets whose windows are inside the output and the texture: target, source, other data, half sizes."""
    half = tuple(max(2, int(share * n / 2)) for n in a.box)
    found = []
    for m in result.report["matches"]:
        target, source = np.rint(m["found"]), np.rint(m["point"])
        rest = (m["point"] - source) - (m["found"] - target)
        inside = True
        for at, shape in ((target, result.image.shape), (source, a.mask.shape)):
            inside &= all(h + 3 <= x < n - h - 3 for x, h, n in zip(at, half, shape, strict=False))
        if inside:
            found.append((target, source, rest, half))
    return found


def correlation(a: NDArray[Any], b: NDArray[Any]) -> float:
    x, y = a - a.mean(), b - b.mean()
    power = float(np.sqrt((x * x).sum() * (y * y).sum()))
    return float((x * y).sum()) / power if power > 1e-9 else 0.0


def presence(a: ElementAnalysis, result: Synthesis) -> tuple[float, float]:
    """Return the share of targets that show their element, and the distances in pixels (S2 and S3)."""
    one, other = grey(a.image), grey(result.image)
    hits, away = [], []
    for target, source, rest, (h, w) in windows(a, result):
        y, x = source.astype(int)
        template = one[y - h : y + h + 1, x - w : x + w + 1]
        best, place = -1.0, (0, 0)
        for dy in range(-3, 4):
            for dx in range(-3, 4):
                ty, tx = int(target[0]) + dy, int(target[1]) + dx
                value = correlation(template, other[ty - h : ty + h + 1, tx - w : tx + w + 1])
                if value > best:
                    best, place = value, (dy, dx)
        hits.append(best > 0.7)
        if best > 0.7:
            away.append(np.hypot(*(place + rest)))
    return float(np.mean(hits)), float(np.mean(away))


def component(mask: NDArray[np.bool_], at: Points, h: int, w: int) -> NDArray[np.bool_]:
    y, x = at.astype(int)
    crop = mask[y - h : y + h + 1, x - w : x + w + 1]
    number, count = label(crop)
    if not count:
        return crop
    pixels = np.argwhere(crop)
    nearest = pixels[np.abs(pixels - (h, w)).sum(axis=1).argmin()]
    return number == number[tuple(nearest)]


def shapes(a: ElementAnalysis, result: Synthesis) -> tuple[float, float]:
    """Return the overlap of an element's foreground before and after, 5th percentile and median (S4)."""
    rows, columns = np.moveaxis(result.source_map.coordinates.astype(int), -1, 0)
    shown = a.mask[rows, columns]
    overlaps = []
    for target, source, _, (h, w) in windows(a, result, 1.0):
        one, other = component(a.mask, source, h, w), component(shown, target, h, w)
        best = 0.0
        for dy in (-1, 0, 1):
            for dx in (-1, 0, 1):
                moved = np.roll(other, (dy, dx), (0, 1))
                best = max(best, (one & moved).sum() / max(1, (one | moved).sum()))
        overlaps.append(best)
    return float(np.percentile(overlaps, 5)), float(np.median(overlaps))


def copied(a: ElementAnalysis, result: Synthesis) -> tuple[float, float | None]:
    """Return the share of colours from the texture, and of rigid pixels that show the matched element, if any (S5)."""
    flat = colours(a.image).reshape(-1, colours(a.image).shape[-1])
    known = {c.tobytes() for c in flat}
    out = colours(result.image).reshape(-1, flat.shape[1])
    share = float(np.mean([c.tobytes() in known for c in out[:: max(1, len(out) // 20000)]]))
    number = result.source_map.label.astype(int)
    rigid = np.argwhere(number > 0)
    if not len(rigid):
        return share, None
    goals = np.array([m["found"] for m in result.report["matches"]])
    starts = np.array([m["point"] for m in result.report["matches"]])
    which = number[tuple(rigid.T)] - 1
    away = (result.source_map.coordinates[tuple(rigid.T)] - starts[which]) - (rigid - goals[which])
    # Elements move by whole pixels, so allow a rounding error of one pixel.
    return share, float((np.abs(away) <= 1.01).all(axis=1).mean())


def coherence(a: ElementAnalysis, result: Synthesis, seed: int = 0) -> tuple[float, float] | None:
    """Return the RMS distance of 9 x 9 background patches to the texture's, p95, over the texture's own (S8)."""
    side = 9
    rows, columns = np.moveaxis(result.source_map.coordinates.astype(int), -1, 0)
    shown = a.mask[rows, columns]
    pictures = [(colours(a.image) / 255, a.mask), (colours(result.image) / 255, shown)]
    patches, corners = [], []
    for picture, mask in pictures:
        free = uniform_filter(mask.astype(float), side, mode="constant", cval=1.0) < 0.5 / side**2
        view = np.lib.stride_tricks.sliding_window_view(picture, (side, side), axis=(0, 1))
        at = np.argwhere(free[side // 2 : -(side // 2), side // 2 : -(side // 2)])
        if len(at) < 50:
            return None  # There is too little background.
        corners.append(at)
        patches.append(view[at[:, 0], at[:, 1]].reshape(len(at), -1))
    draw = np.random.default_rng(seed)
    ours = patches[1][draw.permutation(len(patches[1]))[:300]]
    own = draw.permutation(len(patches[0]))[:300]

    def nearest(one: NDArray[Any], allowed: NDArray[np.bool_] | None = None) -> NDArray[np.float64]:
        square = (one**2).sum(1)[:, None] + (patches[0] ** 2).sum(1) - 2 * one @ patches[0].T
        if allowed is not None:
            square[~allowed] = np.inf
        return np.sqrt(np.maximum(square.min(axis=1), 0) / patches[0].shape[1])

    apart = np.abs(corners[0][own][:, None] - corners[0][None]).max(axis=-1) > 8
    theirs = nearest(patches[0][own], apart)
    found = float(np.percentile(nearest(ours), 95))
    return found / max(1e-9, float(np.percentile(theirs[np.isfinite(theirs)], 95))), found


def layout(result: Synthesis, a: ElementAnalysis, b: ElementAnalysis) -> dict[str, float]:
    """Compare rigid pixels with the targets and with A's own layout, in spacings, and colours with B's (S10).

    Colours are in standard deviations of B's.
    """
    goals = np.array([m["found"] for m in result.report["matches"]])
    number = result.source_map.label.astype(int)
    size = np.array(number.shape)
    inside = ((goals >= a.box[0] / 2) & (goals < size - a.box[1] / 2)).all(axis=1)
    centres, wanted = [], []
    starts = np.array([m["point"] for m in result.report["matches"]])
    for k in np.flatnonzero(inside):
        pixels = np.argwhere(number == k + 1)
        if len(pixels):
            offset = result.source_map.coordinates[tuple(pixels.T)] - starts[k]
            centres.append((pixels - offset).mean(axis=0))
            wanted.append(goals[k])
    found, goal = np.array(centres), np.array(wanted)

    def neighbours(p: Points, k: int) -> Points:
        return np.asarray(cKDTree(p).query(p, k=k + 1)[0])[:, 1:]

    k = min(5, len(goal) - 1)
    scale = float(np.median(neighbours(goal, k).mean(axis=1)))
    return {
        "spacing": abs(float(np.median(neighbours(found, k).mean(axis=1))) / scale - 1),
        "nearest": wasserstein_distance(neighbours(found, 1)[:, 0], neighbours(goal, 1)[:, 0]) / scale,
        "away": float(np.hypot(*(found - goal).T).mean()),
        "own": float(cKDTree(np.asarray(a.points)).query(found)[0].mean() / np.median(neighbours(goal, 1))),
        "colour": float(
            np.mean(
                [
                    wasserstein_distance(x.ravel(), y.ravel()) / max(float(np.std(y)), 1.0)
                    for x, y in zip(
                        np.moveaxis(colours(result.image), -1, 0), np.moveaxis(colours(b.image), -1, 0), strict=False
                    )
                ]
            )
        ),
    }


def doubled(a: ElementAnalysis, result: Synthesis) -> float:
    """Return the largest rigid region of the output over the largest element of the texture (S12)."""
    areas = np.bincount(label(a.mask)[0].ravel())[1:]
    rows, columns = np.moveaxis(result.source_map.coordinates.astype(int), -1, 0)
    number = np.where(a.mask[rows, columns], result.source_map.label, 0)
    return float(np.bincount(number.ravel())[1:].max() / areas.max())


def share(a: ElementAnalysis, result: Synthesis) -> float:
    """Return the foreground's share of the output over the share of as many mean elements as there are targets (S13)."""
    rows, columns = np.moveaxis(result.source_map.coordinates.astype(int), -1, 0)
    shown = float(a.mask[rows, columns].mean())
    number, count = label(a.mask)
    areas = np.bincount(number.ravel())[1:]
    border = np.unique(np.concatenate([number[0], number[-1], number[:, 0], number[:, -1]]))
    whole = np.delete(areas, border[border > 0] - 1) if count else areas
    goals = np.array([m["found"] for m in result.report["matches"]])
    size = np.array(result.source_map.shape)
    inside = ((goals >= 0) & (goals <= size - 1)).all(axis=1).sum()
    return shown / (inside * float(whole.mean()) / float(size.prod()))

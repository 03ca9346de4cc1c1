"""Compute the guide image of several maps: the three most informative combinations of their channels.

A seam that is invisible in the albedo can be visible in the normals. Each map is therefore scaled so that equal
differences are about equally visible, and weighted. The guide contains the leading principal components of all
channels together.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from texrs._arrays import power_single, to_unit
from texrs._typing import Array, Floats
from texrs.materials._roles import Role

__all__ = ["WEIGHTS", "make_guides", "take_features"]

WEIGHTS: dict[Role, float] = dict.fromkeys(Role, 0.5) | {
    Role.COLOUR: 1.0,
    Role.NORMAL: 1.0,
    Role.NORMAL_DX: 1.0,
    Role.NORMAL_XY: 1.0,
    Role.NORMAL_DX_XY: 1.0,
    Role.LABPBR_NORMAL: 1.0,
    Role.HEIGHT: 0.75,
    Role.LABELS: 0.0,
    Role.OTHER: 0.25,
}
"""Default weights of maps for decisions. Normals have a high weight because shading depends on them.

Heights have a lower weight, because they are visible only through normals.
"""
DISPLAY = 1 / 2.2
"""Exponent that converts linear light to values for display."""
TAILS = 0.005
"""Fraction of the lowest and of the highest heights that is clipped."""
CHANNELS = 3
LEAST = 1e-3
"""Minimum fraction of the total variance that a component must explain."""
SAMPLES = 1 << 18
"""Approximate number of pixels that determine the components."""


def take_features(pixels: Array, role: Role, space: str, axes: int) -> Floats:
    """Return the features of a map, (..., C) float32. A difference of 1 is as visible as black next to white."""
    image = pixels if pixels.ndim > axes else pixels[..., np.newaxis]
    if role.normal or role is Role.VECTOR:
        # Use only x and y of vectors, because shading depends on them, and z follows from them.
        vector = _decode(image)
        return vector[..., : min(2, vector.shape[-1])] * np.float32(0.5)
    if role is Role.HEIGHT:
        values = to_unit(image) if image.dtype.kind in "b" else image.astype(np.float32)
        # Halve the values, because the difference of two heights can exceed the range of float32. The scaled result is
        # the same.
        if float(values.max()) - float(values.min()) > float(np.finfo(np.float32).max):
            values = values * np.float32(0.5)
        low, high = np.quantile(values, [TAILS, 1 - TAILS])
        shown: Floats = np.clip((values - np.float32(low)) / np.float32(max(high - low, 1e-12)), 0, 1)
        return shown
    unit = to_unit(image)
    if role.coloured:
        if space == "linear":
            unit = power_single(unit, DISPLAY)
        if unit.shape[-1] in (2, 4):
            unit = np.concatenate([unit[..., :-1] * unit[..., -1:], unit[..., -1:]], axis=-1)
    return unit


def _decode(image: Array) -> Floats:
    """Return vectors with components in [-1, 1]. Unsigned integers and non-negative floats are decoded as 2 v - 1."""
    values = to_unit(image) if image.dtype.kind in "ub" else image.astype(np.float32)
    if image.dtype.kind == "i":
        return np.asarray(values / np.float32(np.iinfo(image.dtype).max), np.float32)
    return values if image.dtype.kind == "f" and values.min() < 0 else values * np.float32(2) - np.float32(1)


def make_guides(features: Sequence[Sequence[Floats]]) -> list[Floats]:
    """Return guides of several exemplars, with values in [0, 1] and the same principal components for all."""
    stacks = [np.concatenate(list(each), axis=-1) for each in features]
    channels = stacks[0].shape[-1]
    flat = [s.reshape(-1, channels) for s in stacks]
    step = max(1, sum(len(f) for f in flat) // SAMPLES)
    some = np.concatenate([f[::step] for f in flat]).astype(np.float64)
    mean = some.mean(axis=0)
    some -= mean
    # Sum in a fixed order, because the last bits of a matrix product depend on the processor.
    spread = np.einsum("ni,nj->ij", some, some) / len(some)
    # Round, because the last bits of the eigenvectors also depend on the processor.
    values, vectors = np.linalg.eigh(np.round(spread, 9))
    count = max(1, int(np.count_nonzero(values[::-1][:CHANNELS] > LEAST * values.sum())))
    leading = np.round(vectors[:, : -count - 1 : -1], 6)
    leading *= np.where(leading[np.abs(leading).argmax(axis=0), np.arange(count)] < 0, -1.0, 1.0)
    if count == 2:
        # Add a third channel, because the second of two channels would be read as alpha.
        leading = np.pad(leading, ((0, 0), (0, 1)))
    middle = (mean[:, np.newaxis] * leading).sum(axis=0)
    found = [np.einsum("nc,ck->nk", f, leading, dtype=np.float64) - middle for f in flat]
    reach = max(float(np.quantile(np.abs(f), 1 - TAILS / 5)) for f in found)
    scale = 0.5 / max(reach, 1e-9)
    return [
        np.clip(0.5 + scale * f, 0, 1).astype(np.float32).reshape(*stack.shape[:-1], -1)
        for f, stack in zip(found, stacks, strict=True)
    ]

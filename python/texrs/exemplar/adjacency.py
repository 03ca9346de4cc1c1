"""Which colours of an exemplar are seen side by side, and how surprising other pairs are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Floats

__all__ = ["Adjacency", "classify", "measure_adjacency"]

CLASSES = 48
"""Colours of the palette whose pairs are counted."""
SAMPLES = 6000
"""Samples that a palette is made from, at most."""
MOST = 6.0
"""Surprise, in natural units, that counts as the greatest."""


@dataclass(frozen=True, slots=True, eq=False)
class Adjacency:
    """How surprising pairs of neighbours are.

    Attributes
    ----------
    classes : uint8 array
        Class of each sample's colour.
    costs : (K, K) float32
        Minus the pointwise mutual information of two classes side by side, 0 to 1.

    """

    classes: NDArray[np.uint8]
    costs: Floats

    @property
    def nbytes(self) -> int:
        """Bytes of the arrays."""
        return self.classes.nbytes + self.costs.nbytes


def classify(colours: Floats, count: int) -> NDArray[np.uint8]:
    """Return the class of each sample, of at most ``count`` colours that k-means finds; always the same ones.

    ``colours`` is (..., C); a picture of few colours keeps them as its classes.
    """
    from scipy.cluster.vq import kmeans, vq

    flat = np.ascontiguousarray(colours.reshape(-1, colours.shape[-1]), np.float64)
    step = max(1, len(flat) // SAMPLES)
    # Every so many, at places that no period of a texture follows.
    some = flat[np.random.default_rng(0).permutation(len(flat))[: len(flat) // step]]
    distinct = np.unique(some, axis=0)
    centres = distinct if len(distinct) <= count else kmeans(some, _spread(distinct, count))[0]
    return np.asarray(vq(flat, centres)[0].reshape(colours.shape[:-1]), np.uint8)


def _spread(colours: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Return colours far from each other: each the farthest from those before."""
    chosen = [int(np.linalg.norm(colours - colours.mean(axis=0), axis=-1).argmin())]
    away = np.linalg.norm(colours - colours[chosen[0]], axis=-1)
    while len(chosen) < count:
        chosen.append(int(away.argmax()))
        away = np.minimum(away, np.linalg.norm(colours - colours[chosen[-1]], axis=-1))
    return colours[chosen]


def measure_adjacency(colours: Floats, wrap: Sequence[bool]) -> Adjacency:
    """Count which colours lie side by side along the axes.

    Parameters
    ----------
    colours : (..., C) float32
        The exemplar.
    wrap : one bool an axis
        Axes along which it repeats.

    Returns
    -------
    Adjacency

    Examples
    --------
    Stripes of two colours: a pair of both is as usual as any other, next to what is never seen.

    >>> import numpy as np
    >>> from texrs.exemplar.adjacency import measure_adjacency
    >>> stripes = np.indices((12, 12))[1] // 2 % 3 / 2.0
    >>> costs = measure_adjacency(stripes[..., np.newaxis], (True, True)).costs
    >>> bool(costs.diagonal().max() < 0.1)
    True

    """
    classes = classify(colours, CLASSES)
    count = int(classes.max()) + 1
    pairs = np.zeros((count, count), np.float64)
    for axis, closed in enumerate(wrap):
        line = np.moveaxis(classes, axis, 0).astype(np.intp)
        first, second = (line, np.roll(line, -1, 0)) if closed else (line[:-1], line[1:])
        pairs += np.bincount((first * count + second).ravel(), minlength=count * count).reshape(count, count)
    pairs += pairs.T
    share = pairs.sum(axis=1) / pairs.sum()
    expected = pairs.sum() * np.multiply.outer(share, share)
    surprise = -np.log((pairs + 1) / (expected + 1))
    return Adjacency(classes, np.asarray(np.clip(surprise, 0, MOST) / MOST, np.float32))

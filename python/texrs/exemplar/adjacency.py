"""Measure how often pairs of colours are neighbours in an exemplar, and how surprising each pair is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Floats

__all__ = ["Adjacency", "classify", "measure_adjacency"]

CLASSES = 48
"""Maximum number of palette colours whose pairs are counted."""
SAMPLES = 6000
"""Maximum number of samples for computing a palette."""
MOST = 6.0
"""Maximum surprise of a pair, in nats. Larger values are clipped, and costs are divided by this maximum."""


@dataclass(frozen=True, slots=True, eq=False)
class Adjacency:
    """Costs of pairs of neighbouring colours: how surprising each pair is in the exemplar.

    Attributes
    ----------
    classes : uint8 array
        Class of the colour of each sample.
    costs : (K, K) float32
        Negative pointwise mutual information of neighbouring classes, clipped and scaled to [0, 1].

    """

    classes: NDArray[np.uint8]
    costs: Floats

    @property
    def nbytes(self) -> int:
        """Size of the arrays in bytes."""
        return self.classes.nbytes + self.costs.nbytes


def classify(colours: Floats, count: int) -> NDArray[np.uint8]:
    """Assign each sample to one of at most ``count`` colour classes (k-means).

    ``colours`` is (..., C). If there are at most ``count`` colours, each of them is a class. The same colours always
    give the same classes.
    """
    from scipy.cluster.vq import kmeans, vq

    flat = np.ascontiguousarray(colours.reshape(-1, colours.shape[-1]), np.float64)
    step = max(1, len(flat) // SAMPLES)
    # Choose the samples at random, because regular positions could coincide with a period of the texture.
    some = flat[np.random.default_rng(0).permutation(len(flat))[: len(flat) // step]]
    distinct = np.unique(some, axis=0)
    centres = distinct if len(distinct) <= count else kmeans(some, _spread(distinct, count))[0]
    return np.asarray(vq(flat, centres)[0].reshape(colours.shape[:-1]), np.uint8)


def _spread(colours: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Return ``count`` colours that are far apart. Each is the farthest from the colours chosen before."""
    chosen = [int(np.linalg.norm(colours - colours.mean(axis=0), axis=-1).argmin())]
    away = np.linalg.norm(colours - colours[chosen[0]], axis=-1)
    while len(chosen) < count:
        chosen.append(int(away.argmax()))
        away = np.minimum(away, np.linalg.norm(colours - colours[chosen[-1]], axis=-1))
    return colours[chosen]


def measure_adjacency(colours: Floats, wrap: Sequence[bool]) -> Adjacency:
    """Measure which colours are neighbours along the axes of an exemplar.

    Parameters
    ----------
    colours : (..., C) float32
        Colours of the exemplar.
    wrap : one bool per axis
        Axes along which the exemplar is periodic.

    Returns
    -------
    Adjacency

    Examples
    --------
    A pair of equal colours in these stripes is as usual as any other pair that occurs.

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

"""Fit Gaussian mixtures to colours with reproducible results, using NumPy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._engine.noise import uniform
from texrs._progress import ask

Doubles = NDArray[np.float64]

COMPONENTS, ROUNDS = 5, 25
"""Number of Gaussians in a mixture, and number of iterations of expectation and maximisation."""
FLOOR = 1e-3
"""Minimum variance of a Gaussian along any direction, as a share of the mean variance of the samples."""
LEAST = 1e-5
"""Absolute minimum variance, in squared units of Lab / 100. Its square root is about the size of an 8-bit step."""


@dataclass(frozen=True, slots=True, eq=False)
class Mixture:
    """A mixture of weighted Gaussians with full covariance.

    Attributes
    ----------
    weights : (k,) float64
    means : (k, d) float64
    whiten : (k, d, d) float64
        Lower triangular matrices W that whiten each Gaussian: W cov W^T = 1.
    """

    weights: Doubles
    means: Doubles
    whiten: Doubles

    @classmethod
    def fit(cls, samples: Doubles, *, seed: int = 0, components: int = COMPONENTS) -> Mixture:
        """Fit a mixture to samples (n, d), n >= 1, by expectation and maximisation, from a k-means++ start."""
        count = max(1, min(components, len(np.unique(samples, axis=0)), len(samples) // 8))
        centres = _start(samples, count, seed)
        apart = ((samples[:, np.newaxis] - centres) ** 2).sum(axis=-1)
        share = (apart == apart.min(axis=1, keepdims=True)).astype(np.float64)
        share /= share.sum(axis=1, keepdims=True)
        floor = max(FLOOR * float(samples.var(axis=0).mean()), LEAST)
        model = cls._estimate(samples, share, floor)
        for _ in range(ROUNDS):
            ask()
            logs = model._measure_logs(samples)
            share = np.exp(logs - logs.max(axis=1, keepdims=True))
            share /= share.sum(axis=1, keepdims=True)
            model = cls._estimate(samples, share, floor)
        return model

    @classmethod
    def _estimate(cls, samples: Doubles, share: Doubles, floor: float) -> Mixture:
        # Avoid matrix products, because a library can sum in another order if the number of threads changes.
        mass = share.sum(axis=0) + 1e-12
        means = np.einsum("nk,nd->kd", share, samples) / mass[:, np.newaxis]
        off = samples[:, np.newaxis] - means
        spread = np.einsum("nk,nki,nkj->kij", share, off, off) / mass[:, np.newaxis, np.newaxis]
        spread += floor * np.eye(samples.shape[1])
        return cls(mass / mass.sum(), means, np.linalg.inv(np.linalg.cholesky(spread)))

    def _measure_logs(self, samples: Doubles) -> Doubles:
        found = np.empty((len(samples), len(self.weights)))
        dimensions = samples.shape[1]
        for k, (weight, mean, whiten) in enumerate(zip(self.weights, self.means, self.whiten, strict=True)):
            off = samples - mean
            square = np.zeros(len(samples))
            for i in range(dimensions):
                line = whiten[i, 0] * off[:, 0]
                for j in range(1, i + 1):
                    line += whiten[i, j] * off[:, j]
                square += line * line
            scale = np.log(weight) + np.log(np.diag(whiten)).sum() - 0.5 * dimensions * np.log(2 * np.pi)
            found[:, k] = scale - 0.5 * square
        return found

    def log(self, samples: Doubles) -> Doubles:
        """Return the natural logarithm of the density at samples (n, d)."""
        logs = self._measure_logs(samples)
        top = logs.max(axis=1)
        density: Doubles = top + np.log(np.exp(logs - top[:, np.newaxis]).sum(axis=1))
        return density


def _start(samples: Doubles, count: int, seed: int) -> Doubles:
    """Return initial centres that are far apart (k-means++: Arthur and Vassilvitskii 2007)."""
    chosen = [int(uniform(seed, 0) * len(samples))]
    apart = ((samples - samples[chosen[0]]) ** 2).sum(axis=1)
    for i in range(1, count):
        reach = np.cumsum(apart)
        at = int(np.searchsorted(reach, uniform(seed, i) * reach[-1], side="right"))
        chosen.append(min(at, len(samples) - 1))
        apart = np.minimum(apart, ((samples - samples[chosen[-1]]) ** 2).sum(axis=1))
    return samples[chosen]

"""Colours in balance: what an output shows too often becomes dear, and what it shows too seldom cheap.

W. Dong, N. Zhou and J.-C. Paul, "Perspective-aware texture analysis and synthesis", 2008, Eq. 8, weighs a sample by
how much its colour is in excess in the output as it is. Here that excess is added up from pass to pass. Such sums are
the multipliers of a constraint, so they grow until the output's histograms are those that were asked for: not the
exemplar's, but those of its samples weighted to the scales that the output has.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._engine.appearance import Demand
from texrs._engine.pyramid import ONE
from texrs._typing import Array
from texrs.exemplar.atlas import BINS

__all__ = ["Balance"]

BANDS = 12
"""Parts of the range of the wanted scales, within each of which the exemplar's samples count alike."""
NARROWEST = 51
"""Least width of such a part, a tenth in the units of wanted scales: a target may be constant."""
SLAB = 1 << 15
"""Points that are looked at at once."""
UNRELATED = 2 * 512**2
"""Cost of windows that have nothing to do with each other."""


@dataclass(frozen=True, slots=True, eq=False)
class Balance:
    """What the colours of samples cost, (channels, bins), and the shares that they are to have of the output."""

    tones: NDArray[np.uint8]
    order: NDArray[np.uint32]
    shares: Array
    costs: Array

    @classmethod
    def of(cls, tones: NDArray[np.uint8], demand: Demand) -> Balance:
        """Return a balance that asks for the histograms of the samples that may be copied, weighted to the wanted scales.

        Parameters
        ----------
        tones : (channels, samples) uint8
            The bin of each sample in the histogram of each channel.
        demand : Demand
            The scales of samples, and of points one number each; its order holds what may be copied.
        """
        weight = _weigh(demand.exemplar[0::4][demand.order].astype(np.int64), demand.output.astype(np.int64))
        shares = [np.bincount(tone[demand.order], weight, BINS) for tone in tones]
        return cls(tones, demand.order, np.stack(shares), np.zeros((len(tones), BINS)))

    def note(self, places: NDArray[np.int32], shape: tuple[int, ...], step: float) -> None:
        """Add the excess of what an output shows, in places of an atlas of a shape, to the costs."""
        points = places.reshape(-1, 2)
        counts = np.zeros(self.costs.shape)
        for start in range(0, len(points), SLAB):
            row, column = np.rint(points[start : start + SLAB] / np.float32(ONE)).astype(np.intp).T
            shown = self.tones[:, row * shape[1] + column]
            counts += [np.bincount(tone, minlength=BINS) for tone in shown]
        excess = (counts / len(points) - self.shares) / np.maximum(self.shares, 1 / BINS)
        self.costs[...] += step * np.clip(excess, -1, 1)

    def onto(self, demand: Demand) -> Demand:
        """Return a demand for cheap colours, too: a cost is the square of a value of the sample, where points ask for 0."""
        cost = np.zeros(self.tones.shape[1])
        for tone, each in zip(self.tones, self.costs, strict=True):
            cost += each[tone]
        cost = np.maximum(cost - cost[self.order].min(), 0)
        values = demand.exemplar.copy()
        values[2::4] = np.minimum(np.rint(np.sqrt(cost * UNRELATED * 256 / int(demand.weight[0]))), 2047)
        return demand._replace(exemplar=values)


def _weigh(mine: NDArray[np.int64], asked: NDArray[np.int64]) -> Array:
    """Weigh samples of some scales, so that together they have those that are asked for."""
    low, high = int(asked.min()), int(asked.max())
    width = max(NARROWEST, -(-(high - low) // BANDS))
    count = (high - low + width // 2) // width + 1
    wanted = np.bincount((asked - low + width // 2) // width, minlength=count)
    band = (mine - low + width // 2) // width
    inside = (band >= 0) & (band < count)
    there = np.bincount(band[inside], minlength=count)
    weight = np.zeros(len(mine))
    weight[inside] = (wanted / np.maximum(there, 1))[band[inside]]
    total = weight.sum()
    # Where nothing has a scale that is asked for, all of it counts.
    return weight / total if total > 0 else np.full(len(mine), 1 / len(mine))

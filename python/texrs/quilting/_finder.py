"""What fits where a patch of a quilt is to lie: looked for at half the size, then exactly around the few that are taken."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from texrs._typing import Bools, Floats
from texrs.kernels.patch_search import Match, PatchIndex


class Finder:
    """Finds matches in pictures: everywhere at half their size, then exactly around the few that are taken.

    Where an axis is fixed, patches keep their places along it, and all are compared exactly.
    """

    def __init__(self, colours: Sequence[Floats], patch: tuple[int, int], fixed: int | None = None) -> None:
        self.fixed = fixed
        self.shapes = [(c.shape[0] - patch[0], c.shape[1] - patch[1]) for c in colours]
        self.whole = PatchIndex(colours, max_patch=patch)
        self.half = PatchIndex([halve(c) for c in colours], max_patch=(patch[0] // 2, patch[1] // 2))

    def find_pool(self, colours: Floats, known: Bools, count: int, corner: tuple[int, int]) -> list[Match]:
        """Return so many matches of a patch that are apart, to within a pixel; ``corner`` is where it lies."""
        if self.fixed is not None:
            return self.compare_all(colours, known, count, corner[self.fixed])
        weight = halve(known[..., np.newaxis].astype(np.float32))[..., 0] == 1
        found = self.half.best(halve(colours), weight, count=count, separation=max(1, min(weight.shape) // 16))
        pool = []
        for m in found:
            row, column = (
                min(2 * at, most) for at, most in zip((m.row, m.column), self.shapes[m.exemplar], strict=True)
            )
            pool.append(Match(m.cost, m.exemplar, row, column))
        return pool

    def compare_all(self, colours: Floats, known: Bools, count: int, place: int) -> list[Match]:
        """Return the best matches of a patch that keeps its place along the fixed axis."""
        every = [
            (number, place, at) if self.fixed == 0 else (number, at, place)
            for number, most in enumerate(self.shapes)
            for at in range(most[1 - (self.fixed or 0)] + 1)
        ]
        return self.whole.best_among(colours, known, candidates=every, count=count, separation=1)

    def refine(self, matches: Sequence[Match], colours: Floats, known: Bools) -> list[Match]:
        """Return the best match within a pixel of each of some of the pool."""
        if self.fixed is not None:
            return list(matches)
        near = []
        for m in matches:
            rows, columns = (
                range(max(0, at - 1), min(most, at + 1) + 1)
                for at, most in zip((m.row, m.column), self.shapes[m.exemplar], strict=True)
            )
            near.append([(m.exemplar, row, column) for row in rows for column in columns])
        every = sorted({place for places in near for place in places})
        scored = self.whole.best_among(colours, known, candidates=every, count=len(every), separation=0)
        ranks = {(m.exemplar, m.row, m.column): rank for rank, m in enumerate(scored)}
        return [scored[min(ranks[place] for place in places)] for places in near]


def halve(image: Floats) -> Floats:
    """Return an image at half its size, each pixel the mean of four; an odd last line is left out."""
    rows, columns = (n // 2 * 2 for n in image.shape[:2])
    fours = [image[i:rows:2, j:columns:2] for i in range(2) for j in range(2)]
    return np.asarray(sum(fours) * np.float32(0.25), np.float32)

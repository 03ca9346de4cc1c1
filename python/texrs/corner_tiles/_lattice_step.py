"""Alignment of tiles with a lattice or stripes: if an exemplar repeats, all pieces are cut at equivalent positions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Array
from texrs.exemplar.period import Period
from texrs.exemplar.regularity import Lattice

__all__ = ["Draw", "choose_side", "find_step"]

SMALLER = 0.7
"""Minimum side of a tile that contains whole periods, as a share of the usual side."""
HALF = 0.5
"""Maximum deviation of a translation from a period, in pixels."""
WHOLE = 0.01
"""Maximum deviation of the number of periods in a side from an integer."""


@dataclass(frozen=True, slots=True)
class Step:
    """Equivalent positions in tileable images, which are at the same point of a period."""

    shifts: NDArray[np.intp]
    """Lattice translations within an image, (n, 2). The image looks similar after each."""
    phases: NDArray[np.intp]
    """Position in each image that corresponds to the first pixel of the first image, (images, 2)."""


@dataclass(frozen=True, slots=True)
class Draw:
    """Generator of random positions in images."""

    rng: np.random.Generator
    count: int
    """Number of images."""
    size: tuple[int, int]
    """Rows and columns of each image."""
    step: Step | None
    """Equivalent positions to choose from. None allows all positions."""

    def __call__(self, row: int = 0, column: int = 0, which: int | None = None) -> tuple[int, int, int]:
        """Choose a random image, or image ``which``, and a position for content at this offset from a corner."""
        drawn = int(self.rng.integers(self.count))
        picture = drawn if which is None else which
        if self.step is None:
            return picture, int(self.rng.integers(self.size[0])), int(self.rng.integers(self.size[1]))
        shift = self.step.shifts[self.rng.integers(len(self.step.shifts))] + self.step.phases[picture]
        return picture, row + int(shift[0]), column + int(shift[1])


def choose_side(repeats: Lattice | Period | None, usual: int) -> int:
    """Return the side of a tile, a multiple of 4, that fits whole periods with the least change, or the usual side."""
    if repeats is None:
        return usual
    changes = []
    for side in range(usual, max(32, round(SMALLER * usual) // 4 * 4) - 1, -4):
        closing = repeats.close((side, side), (True, True))
        if closing is not None:
            changes.append((float(np.abs(closing - np.eye(2)).max()), -side))
    return -min(changes)[1] if changes else usual


def find_step(images: Sequence[Array], repeats: Lattice | Period | None, side: int) -> Step | None:
    """Return equivalent positions in tileable images, or None if a tile does not contain whole periods."""
    size = (images[0].shape[0], images[0].shape[1])
    closing = None if repeats is None else repeats.close(size, (True, True))
    if repeats is None or closing is None:
        return None
    vectors = closing @ repeats.vectors
    shifts = (
        _list_along(vectors[:, 0], size, side) if isinstance(repeats, Period) else _list_shifts(vectors, size, side)
    )
    return (
        None if shifts is None else Step(shifts, np.stack([_find_phase(images[0], image, shifts) for image in images]))
    )


def _list_shifts(vectors: NDArray[np.float64], size: tuple[int, int], side: int) -> NDArray[np.intp] | None:
    """Return the lattice translations within an image, or None if a tile does not contain whole periods."""
    turns = np.linalg.solve(vectors, np.diag(np.array(size, np.float64)))
    within = turns * side / np.array(size, np.float64)
    if np.abs(within - np.rint(within)).max() > WHOLE:
        return None
    most = int(np.abs(np.rint(turns)).sum()) + 1
    steps = np.stack(np.meshgrid(*(np.arange(-most, most + 1),) * 2, indexing="ij"), axis=-1).reshape(-1, 2)
    places = np.rint(steps @ vectors.T).astype(np.intp)
    return np.unique(places[((places >= 0) & (places < size)).all(axis=1)], axis=0)


def _list_along(step: NDArray[np.float64], size: tuple[int, int], side: int) -> NDArray[np.intp] | None:
    """Return the translations along and across stripes within an image, or None if a tile has no whole periods."""
    length = np.sqrt(step[0] ** 2 + step[1] ** 2)
    frequency = step / length**2
    if np.abs(frequency * side - np.rint(frequency * side)).max() > WHOLE:
        return None
    phase = np.add.outer(*(np.arange(n) * f for n, f in zip(size, frequency, strict=True)))
    # A translation by whole pixels deviates from the stripes by at most half a pixel.
    return np.argwhere(np.abs(phase - np.rint(phase)) * length <= HALF)


def _find_phase(first: Array, other: Array, shifts: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the shift between two images that gives the best correlation over all periods."""
    comb = np.zeros(first.shape[:2])
    comb[tuple(shifts.T)] = 1 / len(shifts)
    pictures = (image.reshape(*comb.shape, -1)[..., :3].mean(axis=-1, dtype=np.float64) for image in (first, other))
    light, beside, periods = (np.fft.fft2(each) for each in (*pictures, comb))
    alike = np.fft.ifft2(np.conj(light) * beside * np.conj(periods)).real
    # Round the scores, so that the first of equally good shifts wins on every processor.
    best = np.rint(alike / max(float(np.abs(alike).max()), 1e-300) * 2**24).argmax()
    return np.array(np.unravel_index(best, alike.shape), np.intp)

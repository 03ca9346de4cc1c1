"""Patches of pictures stitched into a texture of any size.

Raster order and minimum cuts after Efros and Freeman, "Image quilting", SIGGRAPH 2001, and Kwatra et al., "Graphcut
textures",
SIGGRAPH 2003. On a cyclic axis the patches lie on a ring, so the last one is chosen and cut to fit both its neighbours.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools, Floats
from texrs.kernels.noise import uniform
from texrs.kernels.patch_search import Match, PatchIndex
from texrs.kernels.seam import cut
from texrs.source_map import SourceMap

__all__ = ["quilt"]

POOL, CANDIDATES = 40, 5
"""Matches that are looked at for how often their content was used; those of them that are cut in."""
RATIO = 4.0
"""How much worse than the best match the worst in the pool may be."""
REPETITION = 4.0
"""How much dearer a patch is that shows what all others show."""
STRIDE = 4
"""Use is counted on every fourth row and column."""


def quilt(
    pictures: Sequence[Floats],
    size: tuple[int, int],
    *,
    patch: int,
    overlap: int,
    wrap: tuple[bool, bool],
    penalties: Sequence[Floats],
    origins: Sequence[NDArray[np.int64]],
    kinds: Sequence[int],
    shares: NDArray[np.float64],
    seed: int,
    progress: Callable[[float], object],
) -> SourceMap:
    """Stitch patches of pictures into a texture.

    Parameters
    ----------
    pictures : sequence of (h, w, C) float32
        What patches are taken from.
    size : (rows, columns)
        Size of the texture.
    patch, overlap : int
        Side of a patch and overlap of neighbours, in pixels; the overlap grows so that patches divide the texture
        evenly.
    wrap : (bool, bool)
        Axes along which the texture is cyclic.
    penalties : sequence of (h, w) float32
        For each picture, how much dearer a seam is at a pixel: its cost is multiplied by one more than this.
    origins : sequence of (h, w) int64
        Which cell of an exemplar each pixel of each picture shows, as a number from 0: patches that show the same cells
        are avoided.
    kinds : sequence of int
        The kind of each picture, from 0.
    shares : (kinds,) or (rows, columns, kinds) float64
        Share of the texture that each kind gets, on the whole or place by place.
    seed : int
        Chooses the first patch, and the kinds.
    progress : callable
        Called with the share that is done.

    Returns
    -------
    SourceMap
        It looks into the pictures.

    """
    height, width = (min(p.shape[axis] for p in pictures) for axis in range(2))
    rows = spans(size[0], height, min(patch, height), overlap, wrap[0])
    columns = spans(size[1], width, min(patch, width), overlap, wrap[1])
    shape = (rows[0][1], columns[0][1])
    members = [[i for i, k in enumerate(kinds) if k == kind] for kind in range(max(kinds) + 1)]
    indices = [PatchIndex([pictures[i] for i in mine], max_patch=shape) for mine in members]
    canvas = Quilt.empty(size, pictures[0].shape[2], shape, wrap)
    usage = Usage(origins, shape)
    places = [(r, c) for r, _ in rows for c, _ in columns]
    wanted = deal(places, shape, size, shares, seed)
    for number, at in enumerate(places):
        progress(number / len(places))
        mine = members[wanted[number]]
        if number == 0:
            which = mine[int(uniform(seed, 0, 0, 0, 3) * len(mine))]
            free = (n - m + 1 for n, m in zip(pictures[which].shape, shape, strict=False))
            row, column = (int(uniform(seed, 1 + axis, 0, 0, 3) * n) for axis, n in enumerate(free))
            matches = [Match(0.0, which, row, column)]
        else:
            window = canvas.window(at)
            known = canvas.covered[window].astype(np.float32)
            separation = max(2, min(shape) // 16)
            found = indices[wanted[number]].best(
                canvas.colours[window], known, count=POOL, separation=separation, ratio=RATIO
            )
            found = [Match(m.cost, mine[m.exemplar], m.row, m.column) for m in found]
            matches = sorted(found, key=lambda m: m.cost * usage.factor(m))[:CANDIDATES]
        usage.add(canvas.paste(at, matches, [usage.factor(m) for m in matches], pictures, penalties, number))
    progress(1.0)
    shapes = tuple(p.shape[:2] for p in pictures)
    return SourceMap(canvas.coordinates, canvas.picture, canvas.label, None, shapes)


def deal(
    places: Sequence[tuple[int, int]],
    patch: tuple[int, int],
    size: tuple[int, int],
    shares: NDArray[np.float64],
    seed: int,
) -> list[int]:
    """Give each patch its kind, so that every kind gets its share.

    Always taking the best match would let one kind win everywhere: it matches itself best.
    """
    count = shares.shape[-1]
    order = sorted(range(len(places)), key=lambda i: uniform(seed, i, 0, 0, 5))
    due, kinds = np.zeros(count), [0] * len(places)
    for i in order:
        here = shares
        if shares.ndim == 3:
            # What the middle of the patch asks for: its borders are shared with its neighbours.
            middle = tuple((start + n // 2) % m for start, n, m in zip(places[i], patch, size, strict=True))
            here = shares[middle]
        due += here
        due_here = np.where(here > 0, due, -np.inf)
        kinds[i] = int(np.argmax(due_here))
        due[kinds[i]] -= 1
    return kinds


@dataclass(slots=True, eq=False)
class Usage:
    """How often each place of the exemplar has been copied, so that no part of it stands out by repetition."""

    origins: Sequence[NDArray[np.int64]]
    patch: tuple[int, int]
    count: NDArray[np.float64] = field(init=False)
    pastes: int = 0

    def __post_init__(self) -> None:
        self.count = np.zeros(max(int(o.max()) for o in self.origins) + 1)

    def shown(self, match: Match) -> NDArray[np.int64]:
        """Give the places that a match shows, thinned out."""
        rows = slice(match.row, match.row + self.patch[0], STRIDE)
        return self.origins[match.exemplar][rows, match.column : match.column + self.patch[1] : STRIDE].ravel()

    def factor(self, match: Match) -> float:
        """Give how much dearer a match is because of what it repeats: 1 where nothing, 2 where what all others show."""
        if not self.pastes:
            return 1.0
        return 1.0 + float(self.count[self.shown(match)].mean()) / self.pastes * REPETITION

    def add(self, match: Match) -> None:
        """Count a match."""
        shown = self.shown(match)
        self.count[np.unique(shown)] += 1
        self.pastes += 1


def spans(length: int, side: int, patch: int, overlap: int, wrap: bool) -> list[tuple[int, int]]:
    """Divide an axis evenly into overlapping patches: the start and the extent of each."""
    step = max(1, patch - overlap)
    if not wrap and length <= side:
        return [(0, length)]
    if wrap:
        count = max(2, math.ceil(length / step))
        extent = min(length, side, math.ceil(length / count) + overlap)
        return [(length * i // count, extent) for i in range(count)]
    count = max(2, math.ceil((length - overlap) / step))
    return [((length - patch) * i // (count - 1), patch) for i in range(count)]


@dataclass(slots=True, eq=False)
class Quilt:
    """The texture in the making."""

    colours: Floats
    coordinates: Floats
    picture: NDArray[np.uint16]
    label: NDArray[np.uint32]
    penalty: Floats
    covered: Bools
    patch: tuple[int, int]
    wrap: tuple[bool, bool]
    offsets: Floats

    @classmethod
    def empty(cls, size: tuple[int, int], channels: int, patch: tuple[int, int], wrap: tuple[bool, bool]) -> Quilt:
        """Start with nothing covered."""
        return cls(
            np.zeros((*size, channels), np.float32),
            np.zeros((*size, 2), np.float32),
            np.zeros(size, np.uint16),
            np.zeros(size, np.uint32),
            np.zeros(size, np.float32),
            np.zeros(size, bool),
            patch,
            wrap,
            np.stack(
                np.meshgrid(*(np.arange(n, dtype=np.float32) for n in patch), indexing="ij"),
                axis=-1,
            ),
        )

    def window(self, at: tuple[int, int]) -> tuple[NDArray[np.intp], ...]:
        """Give the pixels of the patch that starts at ``at``, around the edges."""
        size = self.covered.shape
        return np.ix_(*((start + np.arange(n)) % m for start, n, m in zip(at, self.patch, size, strict=True)))

    def paste(
        self,
        at: tuple[int, int],
        matches: Sequence[Match],
        factors: Sequence[float],
        pictures: Sequence[Floats],
        penalties: Sequence[Floats],
        label: int,
    ) -> Match:
        """Cut each match into what is covered, keep the one whose cut is the cheapest, and return it."""
        window = self.window(at)
        known, old = self.covered[window], self.colours[window]
        everywhere = np.ones(self.patch, bool)
        taken, chosen, least = everywhere, matches[0], math.inf
        if known.any():
            rim = known & self.rim(at) & ~beside(~known)
            for match, factor in zip(matches, factors, strict=True):
                there = self.box(match)
                penalty = self.penalty[window] + penalties[match.exemplar][there]
                seam = cut(
                    old,
                    pictures[match.exemplar][there],
                    known,
                    everywhere,
                    core_a=rim,
                    penalty=penalty,
                )
                if seam.value * factor < least:
                    taken, chosen, least = seam.mask, match, seam.value * factor
        there = self.box(chosen)
        self.colours[window] = np.where(taken[..., np.newaxis], pictures[chosen.exemplar][there], old)
        origin = np.array([chosen.row, chosen.column], np.float32)
        self.coordinates[window] = np.where(taken[..., np.newaxis], self.offsets + origin, self.coordinates[window])
        self.picture[window] = np.where(taken, chosen.exemplar, self.picture[window])
        self.label[window] = np.where(taken, label, self.label[window])
        self.penalty[window] = np.where(taken, penalties[chosen.exemplar][there], self.penalty[window])
        self.covered[window] = True
        return chosen

    def box(self, match: Match) -> tuple[slice, slice]:
        """Give the part of a picture that a match copies."""
        return slice(match.row, match.row + self.patch[0]), slice(match.column, match.column + self.patch[1])

    def rim(self, at: tuple[int, int]) -> Bools:
        """Mark the rim of a patch, but not where it is the edge of the texture: what is there stays."""
        rim = np.zeros(self.patch, bool)
        for axis, start in enumerate(at):
            lines = np.moveaxis(rim, axis, 0)
            if self.wrap[axis] or start > 0:
                lines[0] = True
            if self.wrap[axis] or start + self.patch[axis] < self.covered.shape[axis]:
                lines[-1] = True
        return rim


def beside(mask: Bools) -> Bools:
    """Mark the pixels that share a side with a marked one."""
    padded = np.pad(mask, 1)
    result: Bools = padded[:-2, 1:-1] | padded[2:, 1:-1] | padded[1:-1, :-2] | padded[1:-1, 2:]
    return result

"""Patches of pictures stitched into a texture of any size.

Raster order after Efros and Freeman, "Image quilting", SIGGRAPH 2001: each patch is cut into what lies there along one
least seam for each neighbour. On a cyclic axis the patches lie on a ring, so the last one is chosen and cut to fit both
its neighbours.

Departures, with their reasons:

- Each seam is the exact minimum cut of its strip, which may turn back, and not a row-by-row recurrence.
- Costs are plain differences. Divided by the local gradient, as Kwatra et al. have it, they lead the seams along strong
  edges, and what is left of the seams shows there (gradient at seams 1.3 to 1.9 times the usual, 1.1 to 1.7 without).
- A patch is charged for showing what others show already, and for going on where a neighbour ends. A charge that
  multiplies the match would let the exact continuation of a neighbour, whose match costs nothing, win for ever.
- A patch that shows the mirror image of what it overlaps is refused: along the axis of a mirror the two meet without a
  seam, and the eye sees nothing else.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._engine.noise import uniform
from texrs._typing import Bools, Floats
from texrs.kernels.patch_search import Match, PatchIndex
from texrs.kernels.seam import Strip, cut_strips
from texrs.source_map import SourceMap, pixels_of

__all__ = ["Picture", "quilt"]

POOL, CANDIDATES = 48, 3
"""Matches that are looked at for what they repeat; those of them that are cut in."""
REPETITION, GOOD, ON_LATTICE = 10.0, 0.1, 1.5
"""Charge for showing what all other patches show, in units of a match that is better than all but this share: where few
places fit, as between things on plain ground, others would tear what they are put on. And on a lattice, where all places are
much alike and must meet exactly, in units of a typical match."""
CONTINUATION = 2.0
"""Charge for going on with the piece of the exemplar that lies there already, in units of a typical match."""
CELL = 8
"""Use is counted in cells of so many pixels a side, and overlaps are compared on as many rows and columns."""
CALM, RUN = 64, 9
"""Lines that are looked at for a calm one; pixels of a line that make a visible piece of an edge."""
MIRRORED, NEAR = 0.02, 8.0
"""Share of its overlap on which a patch may show the mirror image of what lies there, within so many pixels: a cell, or the
axis of a mirror could lie between two lines that are compared."""


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """What patches are taken from: a picture made from one exemplar."""

    colours: Floats
    """(h, w, C)"""
    source: SourceMap
    penalty: Floats
    """(h, w): how much dearer a seam is at a pixel; its cost is multiplied by one more than this."""
    regular: bool = False
    """Whether it repeats on a lattice."""

    @property
    def kind(self) -> int:
        """The exemplar it was made from."""
        return int(self.source.exemplar[0, 0])


def quilt(
    pictures: Sequence[Picture],
    size: tuple[int, int],
    *,
    patch: int,
    overlap: int,
    wrap: tuple[bool, bool],
    shares: NDArray[np.float64],
    seed: int,
    progress: Callable[[float], object],
) -> SourceMap:
    """Stitch patches of pictures into a texture.

    Parameters
    ----------
    pictures : sequence of Picture
        What patches are taken from.
    size : (rows, columns)
        Size of the texture.
    patch, overlap : int
        Side of a patch and overlap of neighbours, in pixels, the overlap at most half the patch; it grows so that
        patches divide the texture evenly.
    wrap : (bool, bool)
        Axes along which the texture is cyclic.
    shares : (exemplars,) or (rows, columns, exemplars) float64
        Share of the texture that each exemplar gets, on the whole or place by place.
    seed : int
        Chooses the first patch, and the exemplars.
    progress : callable
        Called with the share that is done.

    Returns
    -------
    SourceMap
        It looks into the exemplars.

    """
    sides = [min(p.colours.shape[axis] for p in pictures) for axis in range(2)]
    rows, columns = (spans(size[a], sides[a], min(patch, sides[a]), overlap, wrap[a]) for a in range(2))
    shape = (rows[0].extent, columns[0].extent)
    members = [[i for i, p in enumerate(pictures) if p.kind == kind] for kind in range(shares.shape[-1])]
    finders = [Finder(pictures, mine, shape) for mine in members]
    canvas = Quilt(pictures, size)
    windows = [Window(r, c) for r in rows for c in columns]
    wanted = deal(windows, size, shares, seed)
    for number, window in enumerate(windows):
        progress(number / len(windows))
        if number == 0:
            mine = members[wanted[number]]
            which = mine[int(uniform(seed, 0, 0, 0, 3) * len(mine))]
            free = [n - m + 1 for n, m in zip(pictures[which].colours.shape, shape, strict=False)]
            row, column = (int(uniform(seed, 1 + axis, 0, 0, 3) * n) for axis, n in enumerate(free))
            canvas.first(window, Match(0.0, which, row, column))
        else:
            canvas.paste(window, finders[wanted[number]])
    progress(1.0)
    if shares.ndim == 1:
        # A cyclic texture may begin anywhere. Beside a map of shares it stays where it is.
        for axis in range(2):
            if wrap[axis]:
                canvas.roll(axis, uniform(seed, axis, 0, 0, 6))
    return canvas.source()


# --- where patches lie -----------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Span:
    """The part of an axis that a patch covers, and its overlaps with patches that lie there already."""

    start: int
    extent: int
    before: int
    """Overlap in pixels at its beginning."""
    after: int
    """Overlap at its end: not 0 only for the last one of a ring."""


def spans(length: int, side: int, patch: int, overlap: int, wrap: bool) -> list[Span]:
    """Divide an axis evenly into overlapping patches, none longer than ``side``."""
    if not wrap and length <= side:
        return [Span(0, length, 0, 0)]
    step = max(1, patch - overlap)
    if wrap:
        count = max(2, math.ceil(length / step))
        # On a ring only the last patch may meet the first one again.
        most = 2 * (length // count) if count > 2 else length
        extent = min(side, math.ceil(length / count) + overlap, most)
        starts = [length * i // count for i in range(count)]
    else:
        count = max(2, math.ceil((length - overlap) / step))
        extent = patch
        starts = [(length - patch) * i // (count - 1) for i in range(count)]
    before = [0] + [a + extent - b for a, b in pairwise(starts)]
    after = [0] * (count - 1) + [starts[-1] + extent - length]
    return [Span(*values) for values in zip(starts, [extent] * count, before, after, strict=True)]


@dataclass(frozen=True, slots=True)
class Window:
    """Where a patch lies."""

    rows: Span
    columns: Span

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the patch."""
        return self.rows.extent, self.columns.extent

    def bands(self) -> list[tuple[int, bool, tuple[slice, slice]]]:
        """Return the overlaps: the axis that the seam crosses, whether the patch lies after it, and where it is."""
        whole = slice(None)
        found = []
        for axis, span in enumerate((self.rows, self.columns)):
            for width, part, after in (
                (span.before, slice(0, span.before), True),
                (span.after, slice(span.extent - span.after, None), False),
            ):
                if width:
                    found.append((axis, after, (part, whole) if axis == 0 else (whole, part)))
        return found

    def known(self) -> Bools:
        """Mark what other patches cover."""
        known = np.zeros(self.shape, bool)
        for _, _, band in self.bands():
            known[band] = True
        return known

    def on(self, size: tuple[int, int]) -> Any:
        """Return the index of its pixels in a texture of this size, around the edges."""
        ends = [s.start + s.extent <= n for s, n in zip((self.rows, self.columns), size, strict=True)]
        if all(ends):
            return tuple(slice(s.start, s.start + s.extent) for s in (self.rows, self.columns))
        places = ((s.start + np.arange(s.extent)) % n for s, n in zip((self.rows, self.columns), size, strict=True))
        return np.ix_(*places)


def deal(windows: Sequence[Window], size: tuple[int, int], shares: NDArray[np.float64], seed: int) -> list[int]:
    """Return each patch its exemplar, so that every one gets its share.

    Always taking the best match would let one win everywhere: it matches itself best.
    """
    count = shares.shape[-1]
    order = sorted(range(len(windows)), key=lambda i: uniform(seed, i, 0, 0, 5))
    due, kinds = np.zeros(count), [0] * len(windows)
    for i in order:
        here = shares
        if shares.ndim == 3:
            # What the middle of the patch asks for: its borders are shared with its neighbours.
            spans_of = (windows[i].rows, windows[i].columns)
            here = shares[tuple((s.start + s.extent // 2) % n for s, n in zip(spans_of, size, strict=True))]
        due += here
        kinds[i] = int(np.argmax(np.where(here > 0, due, -np.inf)))
        due[kinds[i]] -= 1
    return kinds


# --- what fits -------------------------------------------------------------------------------------------------------


class Finder:
    """Finds matches in some of the pictures: everywhere at half their size, then exactly around the few that are taken."""

    def __init__(self, pictures: Sequence[Picture], members: Sequence[int], patch: tuple[int, int]) -> None:
        colours = [pictures[i].colours for i in members]
        self.members = members
        self.shapes = [(c.shape[0] - patch[0], c.shape[1] - patch[1]) for c in colours]
        self.whole = PatchIndex(colours, max_patch=patch)
        self.half = PatchIndex([halved(c) for c in colours], max_patch=(patch[0] // 2, patch[1] // 2))

    def pool(self, colours: Floats, known: Bools) -> list[Match]:
        """Return matches of a patch that are apart, to within a pixel."""
        weight = halved(known[..., np.newaxis].astype(np.float32))[..., 0] == 1
        found = self.half.best(halved(colours), weight, count=POOL, separation=max(1, min(weight.shape) // 16))
        pool = []
        for m in found:
            row, column = (
                min(2 * at, most) for at, most in zip((m.row, m.column), self.shapes[m.exemplar], strict=True)
            )
            pool.append(Match(m.cost, m.exemplar, row, column))
        return pool

    def exact(self, matches: Sequence[Match], colours: Floats, known: Bools) -> list[Match]:
        """Return the best match within a pixel of each of some of the pool, in one of all pictures."""
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
        best = (scored[min(ranks[place] for place in places)] for places in near)
        return [Match(b.cost, self.members[b.exemplar], b.row, b.column) for b in best]


def halved(image: Floats) -> Floats:
    """Return an image at half its size, each pixel the mean of four; an odd last line is left out."""
    rows, columns = (n // 2 * 2 for n in image.shape[:2])
    fours = [image[i:rows:2, j:columns:2] for i in range(2) for j in range(2)]
    return np.asarray(sum(fours) * np.float32(0.25), np.float32)


# --- the texture in the making ---------------------------------------------------------------------------------------


class Quilt:
    """The texture in the making.

    The pixels of all pictures stand in one row; what a texture shows at a pixel is a place in that row.
    """

    def __init__(self, pictures: Sequence[Picture], size: tuple[int, int]) -> None:
        channels = pictures[0].colours.shape[2]
        self.pictures = pictures
        self.size = size
        self.place = np.zeros(size, np.uint32)
        self.label = np.zeros(size, np.uint32)
        self.pastes = 0
        self.pixels = pixels_of([p.source for p in pictures])
        self.all_colours = np.concatenate([p.colours.reshape(-1, channels) for p in pictures])
        self.all_penalties = np.concatenate([p.penalty.ravel() for p in pictures])
        self.all_hands = np.concatenate([np.linalg.det(p.source.frames()).ravel() > 0 for p in pictures])
        self.cells = np.concatenate([cells(p.source).ravel() for p in pictures])
        self.used = np.zeros(int(self.cells.max()) + 1)

    def box(self, match: Match, window: Window) -> tuple[slice, slice]:
        """Return the part of a picture that a match copies."""
        return slice(match.row, match.row + window.rows.extent), slice(
            match.column, match.column + window.columns.extent
        )

    def places(self, matches: Sequence[Match], window: Window, step: int = 1) -> NDArray[np.uint32]:
        """Return the places in the row that matches copy, or of each ``step``-th row and column: (matches, rows, columns)."""
        which = [m.exemplar for m in matches]
        rows, columns = (np.arange(0, n, step) for n in window.shape)
        width, first = self.pixels.shapes[which, 1], self.pixels.first[which]
        corner = first + np.array([m.row for m in matches]) * width + [m.column for m in matches]
        lines = corner[:, np.newaxis] + np.multiply.outer(width, rows)
        return np.asarray(lines[..., np.newaxis] + columns, np.uint32)

    def first(self, window: Window, match: Match) -> None:
        """Lay the first patch."""
        self._lay(window, match, np.ones(window.shape, bool))

    def paste(self, window: Window, finder: Finder) -> None:
        """Cut the most promising matches into what is there, and keep the one that shows and repeats the least."""
        old, known = self.place[window.on(self.size)], window.known()
        colours = self.all_colours.take(old, axis=0)
        pool = finder.pool(colours, known)
        shown = self.places([Match(m.cost, finder.members[m.exemplar], m.row, m.column) for m in pool], window, CELL)
        good, usual = np.quantile([m.cost for m in pool], (GOOD, 0.5)).tolist()
        usual = usual or 1.0
        regular = self.pictures[finder.members[0]].regular
        charges = (ON_LATTICE if regular else REPETITION * (good or usual) / usual) * self.repeated(shown)
        continued, mirrored = self.alike(shown, known, old)
        charges += CONTINUATION * continued
        free = np.flatnonzero(mirrored <= MIRRORED) if (mirrored <= MIRRORED).any() else np.arange(len(pool))
        best = sorted(free.tolist(), key=lambda k: pool[k].cost / usual + charges[k])[:CANDIDATES]
        exact = finder.exact([pool[k] for k in best], colours, known)
        seams = self.cut(window, colours, self.all_penalties.take(old), exact)
        usual = float(np.median([value for value, _ in seams])) or 1.0
        chosen = min(range(len(best)), key=lambda i: seams[i][0] / usual + charges[best[i]])
        self._lay(window, exact[chosen], seams[chosen][1])

    def _lay(self, window: Window, match: Match, mask: Bools) -> None:
        at, [places] = window.on(self.size), self.places([match], window)
        self.place[at] = np.where(mask, places, self.place[at])
        self.label[at] = np.where(mask, np.uint32(self.pastes), self.label[at])
        self.used[np.unique(self.cells[places[::CELL, ::CELL]])] += 1
        self.pastes += 1

    def cut(
        self, window: Window, colours: Floats, penalty: Floats, matches: Sequence[Match]
    ) -> list[tuple[float, Bools]]:
        """Cut matches in along one seam for each overlap: what the seams cost, and where each match is taken."""
        bands, strips = window.bands(), []
        for match in matches:
            picture, box = self.pictures[match.exemplar], self.box(match, window)
            fresh, dear = picture.colours[box], picture.penalty[box]
            for axis, after, band in bands:
                sides = (colours[band], fresh[band]) if after else (fresh[band], colours[band])
                strips.append(Strip(*sides, axis, dear[band] + penalty[band]))
        cuts = iter(cut_strips(strips, cost="paper"))
        found = []
        for _ in matches:
            taken, value = np.ones(window.shape, bool), 0.0
            for _, after, band in bands:
                seam = next(cuts)
                taken[band] &= seam.mask == after
                value += seam.value
            found.append((value, taken))
        return found

    def alike(
        self, shown: NDArray[np.uint32], known: Bools, old: NDArray[np.uint32]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the shares of its overlap on which each match shows what lies there, and the mirror image of it."""
        seen = known[::CELL, ::CELL]
        there, here = old[::CELL, ::CELL][seen], shown[:, seen]
        near = self.pixels.exemplar[here] == self.pixels.exemplar[there]
        for axis in range(2):
            place = self.pixels.coordinates[:, axis]
            near &= np.abs(place[here] - place[there]) <= NEAR
        turned = self.all_hands[here] != self.all_hands[there]
        return (near & ~turned).mean(axis=1), (near & turned).mean(axis=1)

    def repeated(self, shown: NDArray[np.uint32]) -> NDArray[np.float64]:
        """Return how much of each match others show: 0 nothing, 1 what they all do."""
        shares: NDArray[np.float64] = self.used[self.cells[shown]].mean(axis=(1, 2)) / self.pastes
        return shares

    def roll(self, axis: int, chance: float) -> None:
        """Let a cyclic axis begin at one of the calm lines, so that the border of the texture does not follow an edge."""
        lines = np.moveaxis(self.place, axis, 0)
        found = calm(self.all_colours[lines[: CALM + 1]])
        start = found[int(chance * len(found))]
        # One after the other, so that no more than one is there twice.
        self.place = np.roll(self.place, -start, axis)
        self.label = np.roll(self.label, -start, axis)

    def source(self) -> SourceMap:
        """Return the map into the exemplars; the quilt is used up."""
        return SourceMap.pick([p.source for p in self.pictures], self.place, self.label, overwrite=True)


def cells(source: SourceMap) -> NDArray[np.int64]:
    """Return the number of the cell of the exemplars that each pixel shows."""
    which = int(source.exemplar[0, 0])
    first = sum((h // CELL + 1) * (w // CELL + 1) for h, w in source.shapes[:which])
    cell = np.clip(source.coordinates, 0, np.array(source.shapes[which]) - 1).astype(np.int64) // CELL
    numbers: NDArray[np.int64] = first + cell[..., 0] * (source.shapes[which][1] // CELL + 1) + cell[..., 1]
    return numbers


def calm(lines: Floats) -> list[int]:
    """Return the lines that differ from the one before them as usual, rather less than more, and no more at their worst."""
    from scipy.ndimage import uniform_filter1d

    jumps = np.abs(np.diff(lines, axis=0)).mean(axis=-1)
    whole, worst = jumps.mean(axis=1), uniform_filter1d(jumps, RUN, axis=1).max(axis=1)
    usual = (whole >= np.quantile(whole, 0.25)) & (whole <= np.median(whole)) & (worst <= np.median(worst))
    found = np.flatnonzero(usual) if usual.any() else [np.argmin(whole)]
    return [1 + int(line) for line in found]

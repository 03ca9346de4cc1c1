"""A quilt in the making: patches cut in one by one, the one that shows and repeats the least."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._engine.stitcher import FREE, Pasting, Samples
from texrs._threads import SideBySide
from texrs._typing import Bools, Floats
from texrs.kernels.patch_search import Match
from texrs.quilting._finder import Finder
from texrs.quilting._windows import Surroundings, Window
from texrs.source_map import SourceMap
from texrs.source_map._pixels import Pixels

POOL = (48, 96)
"""Matches that are looked at for what they repeat; more on a lattice, where many are out of step."""
CANDIDATES = 3
"""Matches of the pool that are cut in."""
REPETITION, GOOD, ON_LATTICE = 10.0, 0.1, 2.5
"""Charge for showing what all other patches show, in units of a match that is better than all but this share: where few
places fit, as between things on plain ground, others would tear what they are put on. And on a lattice, where all places are
much alike and must meet exactly, in units of a typical match."""
COLOUR, DEPTH = 1.0, 1.0
"""What a seam costs: squared differences of the colours, and the depth inside of elements of the pixels that meet there."""
CONTINUATION = 2.0
"""Charge for going on with the piece of the exemplar that lies there already, in units of a typical match."""
IN_STEP, AS_WELL = 0.15, 1.3
"""How far a patch of what repeats on a lattice may be out of step, in shifts of the lattice, and by what factor a match that is
in step may be worse: where a lattice is only about regular, what fits is more than what is in step."""
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
    depth: Floats
    """(h, w): how deep inside an element each pixel is, 0 between elements, where seams are cheap."""
    regular: bool = False
    """Whether it repeats on a lattice."""
    lattice: NDArray[np.float64] | None = None
    """(2, 2): the lattice, a shift (row, column) in each column, where the texture has it too."""


class Quilt:
    """The texture in the making.

    The pixels of all pictures stand in one row; what a texture shows at a pixel is a place in that row.
    """

    def __init__(self, pictures: Sequence[Picture], size: tuple[int, int], wrap: tuple[bool, bool]) -> None:
        channels = pictures[0].colours.shape[2]
        self.pictures = pictures
        self.size = size
        self.wrap = wrap
        self.place = np.full(size, FREE, np.uint32)
        self.label = np.zeros(size, np.uint32)
        self.seams = np.zeros((*size, 2), np.float32)
        self.pastes = 0
        self.pixels = Pixels.chain([p.source for p in pictures])
        self.all_colours = np.concatenate([p.colours.reshape(-1, channels) for p in pictures])
        depth = np.concatenate([p.depth.ravel() for p in pictures])
        self.samples = Samples(self.all_colours, depth, (COLOUR, DEPTH))
        self.all_hands = np.concatenate([mark_hands(p.source).ravel() for p in pictures])
        self.cells = np.concatenate([number_cells(p.source).ravel() for p in pictures])
        self.used = np.zeros(int(self.cells.max()) + 1)
        self.steps: dict[int, NDArray[np.float64]] = {}

    def list_places(self, matches: Sequence[Match], window: Window, step: int = 1) -> NDArray[np.uint32]:
        """Return the places in the row that matches copy, or of each ``step``-th row and column: (matches, rows, columns)."""
        which = [m.exemplar for m in matches]
        rows, columns = (np.arange(0, n, step) for n in window.shape)
        width, first = self.pixels.shapes[which, 1], self.pixels.first[which]
        corner = first + np.array([m.row for m in matches]) * width + [m.column for m in matches]
        lines = corner[:, np.newaxis] + np.multiply.outer(width, rows)
        return np.asarray(lines[..., np.newaxis] + columns, np.uint32)

    def paste(self, windows: Sequence[Window], finder: Finder, beside: SideBySide) -> None:
        """Cut a patch into each of some windows that lie apart: each is chosen as if it were the first of them."""
        chosen = beside.do(lambda window, _: self.choose(window, finder), windows)
        for window, (match, around, taken, seams) in zip(windows, chosen, strict=True):
            self.seams[around.index] = seams
            self.lay(window, match, taken[around.inner])

    def choose(self, window: Window, finder: Finder) -> tuple[Match, Surroundings, Bools, Floats]:
        """Cut the most promising matches into what is there, and return the one that shows and repeats the least.

        With it, the window and what is beside it, which pixels of these take the patch, and the seams that there are then.
        """
        old, known = self.place[window.index(self.size)], window.mark_known()
        colours = self.all_colours.take(old, axis=0, mode="clip")
        regular = self.pictures[0].regular
        pool = finder.find_pool(colours, known, POOL[regular], window.corner)
        shown = self.list_places(pool, window, CELL)
        good, usual = np.quantile([m.cost for m in pool], (GOOD, 0.5)).tolist()
        usual = usual or 1.0
        charges = (ON_LATTICE if regular else REPETITION * (good or usual) / usual) * self.measure_repetition(shown)
        continued, mirrored = self.measure_likeness(shown, known, old)
        charges += CONTINUATION * continued
        free = np.flatnonzero(mirrored <= MIRRORED) if (mirrored <= MIRRORED).any() else np.arange(len(pool))
        free = self.keep_in_step(pool, free, window)
        best = sorted(free.tolist(), key=lambda k: pool[k].cost / usual + charges[k])[:CANDIDATES]
        exact = finder.refine([pool[k] for k in best], colours, known)
        around = window.surround(self.size, self.wrap)
        pasting = self.open_pasting(window, around)
        patches = np.zeros((len(best), *pasting.shown.shape), np.uint32)
        patches[:, *around.inner] = self.list_places(exact, window)
        seams = self.samples.judge(pasting, patches)
        least = float(np.median(seams)) or 1.0
        if regular:
            # A seam through plain ground would not tell a place that is out of step.
            charges += [m.cost / usual for m in pool]
        chosen = min(range(len(best)), key=lambda i: seams[i] / least + charges[best[i]])
        return exact[chosen], around, *self.samples.cut(pasting, patches[chosen])

    def lay(self, window: Window, match: Match, mask: Bools | None = None) -> None:
        """Lay a patch, or what of it a mask marks."""
        at, [places] = window.index(self.size), self.list_places([match], window)
        self.steps.setdefault(match.exemplar, np.subtract(window.corner, (match.row, match.column)).astype(np.float64))
        self.place[at] = places if mask is None else np.where(mask, places, self.place[at])
        self.label[at] = self.pastes if mask is None else np.where(mask, np.uint32(self.pastes), self.label[at])
        self.used[np.unique(self.cells[places[::CELL, ::CELL]])] += 1
        self.pastes += 1

    def open_pasting(self, window: Window, around: Surroundings) -> Pasting:
        """Return what lies where a patch is to lie and beside it, and what it may cover of it."""
        shown = self.place[around.index]
        mask, core = np.zeros(shown.shape, bool), np.zeros(shown.shape, bool)
        mask[around.inner], core[around.inner] = True, window.mark_core()
        for axis in np.flatnonzero(around.closed):
            # It meets itself there, so its ends stay what they are.
            for line in (0, -1):
                ends = np.moveaxis(mask, axis, 0)[line]
                ends &= np.moveaxis(shown, axis, 0)[line] == FREE
        return Pasting(shown, self.seams[around.index], mask, core)

    def measure_likeness(
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

    def keep_in_step(self, pool: Sequence[Match], free: NDArray[np.intp], window: Window) -> NDArray[np.intp]:
        """Return those of some matches that are in step with what their pictures show elsewhere, if these match as well."""
        away = np.zeros(len(free))
        for k, m in enumerate(pool[i] for i in free.tolist()):
            lattice = self.pictures[m.exemplar].lattice
            if lattice is not None and m.exemplar in self.steps:
                moved = np.subtract(window.corner, (m.row, m.column)) - self.steps[m.exemplar]
                times = np.linalg.solve(lattice, moved)
                # The nearest shift is one of the four around.
                around = np.floor(times)[:, np.newaxis] + [[0, 0, 1, 1], [0, 1, 0, 1]]
                rest = np.linalg.norm(moved[:, np.newaxis] - lattice @ around, axis=0).min()
                away[k] = rest / np.linalg.norm(lattice, axis=0).min()
        kept = free[away <= IN_STEP]
        least, least_kept = (min((pool[i].cost for i in rows.tolist()), default=np.inf) for rows in (free, kept))
        return kept if least_kept <= AS_WELL * least else free

    def measure_repetition(self, shown: NDArray[np.uint32]) -> NDArray[np.float64]:
        """Return how much of each match others show: 0 nothing, 1 what they all do."""
        shares: NDArray[np.float64] = self.used[self.cells[shown]].mean(axis=(1, 2)) / self.pastes
        return shares

    def finish(self, rolled: Mapping[int, float]) -> SourceMap:
        """Return the map into the exemplars; the quilt is used up.

        The axes in ``rolled`` begin at one of the calm lines, so that the border of the texture does not follow an edge: at
        the first one for 0, and at the last for 1.
        """
        del self.seams
        for axis, chance in rolled.items():
            lines = np.moveaxis(self.place, axis, 0)
            found = find_calm_lines(self.all_colours[lines[: CALM + 1]])
            start = found[int(chance * len(found))]
            # One after the other, so that no more than one is there twice.
            self.place = np.roll(self.place, -start, axis)
            self.label = np.roll(self.label, -start, axis)
        return SourceMap.pick([p.source for p in self.pictures], self.place, self.label, overwrite=True)


def number_cells(source: SourceMap) -> NDArray[np.int64]:
    """Return the number of the cell of the exemplars that each pixel shows."""
    which = int(source.exemplar[0, 0])
    first = sum((h // CELL + 1) * (w // CELL + 1) for h, w in source.shapes[:which])
    cell = np.clip(source.coordinates, 0, np.array(source.shapes[which]) - 1).astype(np.int64) // CELL
    numbers: NDArray[np.int64] = first + cell[..., 0] * (source.shapes[which][1] // CELL + 1) + cell[..., 1]
    return numbers


def mark_hands(source: SourceMap) -> Bools:
    """Mark the pixels that show an exemplar, and not its mirror image."""
    frame = source.frame_array()
    if frame is None:
        return np.ones(source.shape, np.bool_)
    unturned = frame[..., 0, 0] * frame[..., 1, 1] > frame[..., 0, 1] * frame[..., 1, 0]
    return np.asarray(unturned[source.label] if frame.ndim == 3 else unturned, np.bool_)


def find_calm_lines(lines: Floats) -> list[int]:
    """Return the lines that differ from the one before them as usual, rather less than more, and no more at their worst."""
    from scipy.ndimage import uniform_filter1d

    jumps = np.abs(np.diff(lines, axis=0)).mean(axis=-1)
    whole, worst = jumps.mean(axis=1), uniform_filter1d(jumps, RUN, axis=1).max(axis=1)
    usual = (whole >= np.quantile(whole, 0.25)) & (whole <= np.median(whole)) & (worst <= np.median(worst))
    found = np.flatnonzero(usual) if usual.any() else [np.argmin(whole)]
    return [1 + int(line) for line in found]

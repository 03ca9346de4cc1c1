"""Slow, obvious twin of quilting: patches chosen and cut in by NumPy, one by one."""

from __future__ import annotations

import numpy as np

from texrs.kernels.patch_search import Match, PatchIndex
from texrs.quilting._quilt import COLOUR, DEPTH, find_phase, mark_hands, number_cells
from texrs.source_map.pixels import Pixels

FREE = 2**32 - 1
POOL, CANDIDATES, CELL = (48, 96), 3, 8
REPETITION, GOOD, ON_LATTICE, CONTINUATION = 10.0, 0.1, 2.5, 2.0
IN_STEP, AS_WELL, MIRRORED, NEAR = 0.15, 4.0, 0.02, 8.0


def stitch(pictures, size, wrap, fixed, first, waves, progress):
    """Do the same as `texrs.quilting._quilt.stitch`, with the same arguments."""
    quilt = Quilt(pictures, size, wrap, fixed, first[0].shape)
    window, which, (row, column) = first
    quilt.lay(window, Match(0.0, which, row, column))
    for wave in waves:
        chosen = [quilt.choose(window) for window in wave]
        for window, (match, around, inner, (take, seams)) in zip(wave, chosen, strict=True):
            quilt.seams[around] = seams.reshape(*quilt.seams[around].shape)
            quilt.lay(window, match, take.reshape(quilt.place[around].shape)[inner])
    return quilt.place, quilt.label


class Quilt:
    def __init__(self, pictures, size, wrap, fixed, patch):
        from texrs._engine.stitcher import Samples

        channels = pictures[0].colours.shape[2]
        self.pictures, self.size, self.wrap, self.fixed = pictures, size, wrap, fixed
        self.place = np.full(size, FREE, np.uint32)
        self.label = np.zeros(size, np.uint32)
        self.seams = np.zeros((*size, 2), np.float32)
        self.pastes = 0
        self.pixels = Pixels.chain([p.source for p in pictures])
        self.colours = np.concatenate([p.colours.reshape(-1, channels) for p in pictures])
        depth = np.concatenate([p.depth.ravel() for p in pictures])
        self.samples = Samples(self.colours, depth, (COLOUR, DEPTH)).inner
        self.hands = np.concatenate([mark_hands(p.source).ravel() for p in pictures])
        self.cells = np.concatenate([number_cells(p.source).ravel() for p in pictures])
        self.used = np.zeros(int(self.cells.max()) + 1)
        self.step = None
        self.phases = [find_phase(pictures[0], picture) for picture in pictures]
        self.most = [(p.colours.shape[0] - patch[0], p.colours.shape[1] - patch[1]) for p in pictures]
        self.whole = PatchIndex([p.colours for p in pictures], max_patch=patch)
        if fixed is None:
            self.half = PatchIndex([halve(p.colours) for p in pictures], max_patch=(patch[0] // 2, patch[1] // 2))

    def list_places(self, match, window, step=1):
        width, first = self.pixels.shapes[match.exemplar, 1], self.pixels.first[match.exemplar]
        rows, columns = (np.arange(0, n, step) for n in window.shape)
        return np.asarray(first + (match.row + rows[:, None]) * width + match.column + columns, np.uint32)

    def lay(self, window, match, mask=True):
        at, places = index(window, self.size), self.list_places(match, window)
        if self.step is None:
            self.step = self.measure_step(match, window)
        self.place[at] = np.where(mask, places, self.place[at])
        self.label[at] = np.where(mask, np.uint32(self.pastes), self.label[at])
        self.used[np.unique(self.cells[places[::CELL, ::CELL]])] += 1
        self.pastes += 1

    def choose(self, window):
        old, known = self.place[index(window, self.size)], mark_known(window)
        colours = self.colours.take(old, axis=0, mode="clip")
        regular = self.pictures[0].regular
        pool = self.find_pool(colours, known, POOL[regular], window.corner)
        costs = np.array([m.cost for m in pool])
        shown = np.array([self.list_places(m, window, CELL) for m in pool])
        good, usual = np.quantile(costs, (GOOD, 0.5)).tolist()
        usual = usual or 1.0
        charges = (ON_LATTICE if regular else REPETITION * (good or usual) / usual) * (
            self.used[self.cells[shown]].mean(axis=(1, 2)) / self.pastes
        )
        seen = known[::CELL, ::CELL]
        there, here = old[::CELL, ::CELL][seen], shown[:, seen]
        near = self.pixels.exemplar[here] == self.pixels.exemplar[there]
        for axis in range(2):
            place = self.pixels.coordinates[:, axis]
            near &= np.abs(place[here] - place[there]) <= NEAR
        turned = self.hands[here] != self.hands[there]
        charges += CONTINUATION * (near & ~turned).mean(axis=1)
        unmirrored = (near & turned).mean(axis=1) <= MIRRORED
        free = np.flatnonzero(unmirrored) if unmirrored.any() else np.arange(len(pool))
        free = self.keep_in_step(pool, free, window)
        best = sorted(free.tolist(), key=lambda k: costs[k] / usual + charges[k])[:CANDIDATES]
        exact = [self.refine(pool[k], colours, known) for k in best]
        around, inner, closed = surround(window, self.size, self.wrap)
        shown = self.place[around]
        mask, core = np.zeros(shown.shape, bool), np.zeros(shown.shape, bool)
        mask[inner], core[inner] = True, mark_core(window)
        for axis in np.flatnonzero(closed):
            for line in (0, -1):
                np.moveaxis(mask, axis, 0)[line] &= np.moveaxis(shown, axis, 0)[line] == FREE
        seams = np.ascontiguousarray(self.seams[around])
        pasting = (shown.shape, shown.ravel(), seams.ravel(), mask.ravel(), core.ravel())
        patches = np.zeros((len(best), *shown.shape), np.uint32)
        for patch, match in zip(patches, exact, strict=True):
            patch[inner] = self.list_places(match, window)
        values = self.samples.judge(pasting, patches.reshape(len(best), -1))
        least = float(np.median(values)) or 1.0
        if regular:
            charges += costs / usual
        chosen = min(range(len(best)), key=lambda i: values[i] / least + charges[best[i]])
        return exact[chosen], around, inner, self.samples.cut(pasting, patches[chosen].ravel())

    def find_pool(self, colours, known, count, corner):
        if self.fixed is not None:
            every = [
                (number, corner[0], at) if self.fixed == 0 else (number, at, corner[1])
                for number, most in enumerate(self.most)
                for at in range(most[1 - self.fixed] + 1)
            ]
            return self.whole.best_among(colours, known, candidates=every, count=count, separation=1)
        weight = halve(known[..., np.newaxis].astype(np.float32))[..., 0] == 1
        found = self.half.best(halve(colours), weight, count=count, separation=max(1, min(weight.shape) // 16))
        return [
            Match(
                m.cost,
                m.exemplar,
                *(min(2 * a, n) for a, n in zip((m.row, m.column), self.most[m.exemplar], strict=True)),
            )
            for m in found
        ]

    def refine(self, match, colours, known):
        if self.fixed is not None:
            return match
        rows, columns = (
            range(max(0, at - 1), min(most, at + 1) + 1)
            for at, most in zip((match.row, match.column), self.most[match.exemplar], strict=True)
        )
        near = [(match.exemplar, row, column) for row in rows for column in columns]
        return self.whole.best_among(colours, known, candidates=near, separation=0)[0]

    def measure_step(self, match, window):
        return np.subtract(window.corner, (match.row, match.column)) + self.phases[match.exemplar]

    def keep_in_step(self, pool, free, window):
        away = np.zeros(len(free))
        for k, m in enumerate(pool[i] for i in free.tolist()):
            lattice = self.pictures[m.exemplar].lattice
            if lattice is not None and self.step is not None:
                moved = self.measure_step(m, window) - self.step
                if not lattice[:, 1].any():
                    times = lattice[:, 0] @ moved / (lattice[:, 0] @ lattice[:, 0])
                    away[k] = abs(times - np.rint(times))
                    continue
                around = np.floor(np.linalg.solve(lattice, moved))[:, np.newaxis] + [[0, 0, 1, 1], [0, 1, 0, 1]]
                rest = np.linalg.norm(moved[:, np.newaxis] - lattice @ around, axis=0).min()
                away[k] = rest / np.linalg.norm(lattice, axis=0).min()
        kept = free[away <= IN_STEP]
        least, least_kept = (min((pool[i].cost for i in rows.tolist()), default=np.inf) for rows in (free, kept))
        return kept if least_kept <= AS_WELL * least else free


def halve(image):
    rows, columns = (n // 2 * 2 for n in image.shape[:2])
    fours = [image[i:rows:2, j:columns:2] for i in range(2) for j in range(2)]
    return np.asarray(sum(fours) * np.float32(0.25), np.float32)


def mark_known(window):
    """Mark the pixels that other patches cover."""
    known = np.zeros(window.shape, bool)
    for axis, span in enumerate((window.rows, window.columns)):
        lines = np.moveaxis(known, axis, 0)
        lines[: span.before] = True
        lines[span.extent - span.after :] = True
    return known


def mark_core(window):
    """Mark the middle: pixels that no other patch covers, or else the place where overlaps meet."""
    rows, columns = (
        slice(min(s.before, s.extent - s.after - 1), max(s.before, s.extent - s.after - 1) + 1)
        for s in (window.rows, window.columns)
    )
    core = np.zeros(window.shape, bool)
    core[rows, columns] = True
    return core


def surround(window, size, wrap):
    """Return the index of a window and its neighbours, the window in it, and the axes that it goes around."""
    ends, inner, closed = [], [], []
    for span, length, cyclic in zip((window.rows, window.columns), size, wrap, strict=True):
        low, high = span.start - 1, span.start + span.extent + 1
        own = cyclic and high - low > length
        if own:
            low, high = low + 1, high - 1
        elif not cyclic:
            low, high = max(low, 0), min(high, length)
        ends.append(np.arange(low, high) % length)
        inner.append(slice(span.start - low, span.start - low + span.extent))
        closed.append(own)
    return np.ix_(*ends), tuple(inner), closed


def index(window, size):
    """Return the index of a window's pixels, wrapped at the edges."""
    spans = (window.rows, window.columns)
    return np.ix_(*(np.arange(s.start, s.start + s.extent) % n for s, n in zip(spans, size, strict=True)))

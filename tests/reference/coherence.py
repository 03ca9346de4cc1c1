"""Slow, obvious twin of k-coherence: similarity sets, jitter, and the correction in passes."""

from __future__ import annotations

from itertools import product

import numpy as np

ONE = 4096


def philox(counter, key):
    """Return Philox4x32-10 of arrays of counters (n, 4)."""
    c = [np.uint64(counter[:, i]) for i in range(4)]
    k = [np.uint64(key[0]), np.uint64(key[1])]
    low = np.uint64(0xFFFFFFFF)
    for turn in range(10):
        if turn:
            k = [(k[0] + np.uint64(0x9E3779B9)) & low, (k[1] + np.uint64(0xBB67AE85)) & low]
        p, q = np.uint64(0xD2511F53) * c[0], np.uint64(0xCD9E8D57) * c[2]
        c = [(q >> np.uint64(32)) ^ c[1] ^ k[0], q & low, (p >> np.uint64(32)) ^ c[3] ^ k[1], p & low]
    return np.stack(c, axis=1)


def jitter(places, region, reach, seed, level):
    axes = len(region.shape)
    key = philox(np.array([[4, 0x70617274, 0, 0]]), (seed & 0xFFFFFFFF, seed >> 32))[0, :2]
    points = np.indices(region.shape).reshape(axes, -1).T + np.array(region.origin)
    counter = np.zeros((len(points), 4), np.int64)
    counter[:, :axes], counter[:, 3] = points & 0xFFFFFFFF, level
    words = philox(counter, key)[:, :axes]
    most = round(reach * ONE)
    drawn = (words * np.uint64(2 * most + 1) >> np.uint64(32)).astype(np.int64) - most
    return (places.reshape(-1, axes) + drawn).astype(np.int32).reshape(-1)


class Exemplar:
    """Vectors of an exemplar, from the arrays of its analysis."""

    def __init__(self, appearance, numbers):
        arrays = appearance.arrays()
        self.shape, self.wrap = appearance.shape, appearance.wrap
        self.vectors = np.int64(arrays["features"]).reshape(*self.shape, -1)[..., :numbers]
        self.border = [0 if w else appearance.radius for w in self.wrap]

    def inside(self, sample):
        """Return the sample, along periodic axes, or None if its window is not inside."""
        out = []
        for x, n, w, b in zip(sample, self.shape, self.wrap, self.border, strict=True):
            if not w and not b <= x < n - b:
                return None
            out.append(x % n)
        return tuple(out)

    def bring(self, place):
        out = []
        for x, n, w, b in zip(place, self.shape, self.wrap, self.border, strict=True):
            near = (x + ONE // 2) // ONE
            # The nearest sample decides whether the window is inside. A coordinate whose window is inside keeps its
            # fraction.
            held = x if b <= near < n - b else min(max(near, b), n - 1 - b) * ONE
            out.append(x % (n * ONE) if w else held)
        return tuple(out)

    def vector(self, sample):
        """Return the vector of the nearest sample whose window is inside."""
        at = []
        for x, n, w, b in zip(sample, self.shape, self.wrap, self.border, strict=True):
            at.append(x % n if w else min(max(x, b), n - 1 - b))
        return self.vectors[tuple(at)]


def similar(appearance, k, n, numbers=8):
    e = Exemplar(appearance, numbers)
    count = int(np.prod(e.shape))
    sets = np.repeat(np.arange(count)[:, np.newaxis], k, axis=1)
    points = np.indices(e.shape).reshape(len(e.shape), -1).T
    valid = np.array([e.inside(p) is not None for p in points])
    flat = e.vectors.reshape(count, -1)
    for i in np.flatnonzero(valid):
        cost = ((flat - flat[i]) ** 2).sum(axis=1)
        allowed = valid.copy()
        for j in range(1, k):
            gap = np.abs(points - points[sets[i, j - 1]])
            gap = np.where(e.wrap, np.minimum(gap, np.array(e.shape) - gap), gap)
            allowed &= gap.max(axis=1) > n // 2
            sets[i, j] = np.flatnonzero(allowed)[cost[allowed].argmin()]
    return sets


def nearest(place):
    return tuple((x + ONE // 2) >> 12 for x in place)


def corners(frame, compensated):
    """Return (diagonal, step, J step, neighbour) of each corner."""
    axes = len(frame)
    inverse = np.rint(np.linalg.inv(frame / ONE) * ONE).astype(np.int64)
    found = []
    for diagonal in product((-1, 1), repeat=axes):
        phi = inverse @ diagonal
        step = np.where(4 * phi * phi >= (phi * phi).sum(), np.sign(phi), 0)
        moved = np.int64(frame) @ step
        found.append((diagonal, step, moved, np.array(diagonal) * ONE - moved if compensated else 0 * moved))
    return found


def correct(appearance, sets, places, region, frames, *, passes, numbers=8, compensated=False):
    e = Exemplar(appearance, numbers)
    axes = len(e.shape)
    now = np.array([e.bring(map(int, p)) for p in places.reshape(-1, axes)]).reshape(*region.shape, axes)
    frames = np.broadcast_to(frames, (region.points, axes, axes)).reshape(*region.shape, axes, axes)
    for _ in range(passes):
        for parity in product((0, 1), repeat=axes):
            old = now.copy()
            for point in np.ndindex(*region.shape):
                if all((p + o) % 2 == b for p, o, b in zip(point, region.origin, parity, strict=True)):
                    now[point] = _choose(e, sets, old, point, region, frames[point], compensated)
    return now.astype(np.int32).reshape(-1)


def _choose(e, sets, old, point, region, frame, compensated):
    seen, candidates = [], []
    for diagonal, step, moved, beside in corners(frame, compensated):
        q = []
        for p, s, n, w in zip(point, step, region.shape, region.wrap, strict=True):
            q.append((p + s) % n if w else p + s)
        if any(not 0 <= x < n for x, n in zip(q, region.shape, strict=True)):
            continue
        place = old[tuple(q)]
        seen.append((e.vector(nearest(e.bring(map(int, place + beside)))), diagonal))
        sample = np.array(nearest(place))
        at = np.ravel_multi_index(
            tuple(np.minimum(np.where(e.wrap, sample % e.shape, sample), np.array(e.shape) - 1)), e.shape
        )
        for s in sets[at]:
            candidates.append(np.array(np.unravel_index(s, e.shape)) * ONE + place - sample * ONE - moved)
    best, least = old[point], np.inf
    for candidate in candidates:
        u = e.inside(nearest(candidate))
        if u is None:
            continue
        cost = sum(int(((v - e.vector(np.add(u, d))) ** 2).sum()) for v, d in seen)
        if cost < least:
            best, least = candidate, cost
    return e.bring(map(int, best))

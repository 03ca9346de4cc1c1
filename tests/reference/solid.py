"""Slow, obvious twin of the correction of coordinates, pass by pass: windows, matches, votes."""

from __future__ import annotations

from itertools import product

import numpy as np

ONE, KEEP, MASK = 4096, 24, 0xFFFFFFFF


def philox(counter, key):
    """Return Philox4x32-10 of Salmon, Moraes, Dror and Shaw (2011)."""
    (a, b, c, d), (k, m) = counter, key
    for _ in range(10):
        p, q = 0xD2511F53 * a, 0xCD9E8D57 * c
        a, b, c, d = q >> 32 ^ b ^ k, q & MASK, p >> 32 ^ d ^ m, p & MASK
        k, m = (k + 0x9E3779B9) & MASK, (m + 0xBB67AE85) & MASK
    return a, b, c, d


class Twin:
    """An analysed exemplar and a region of the output, with a frame for each of its points."""

    def __init__(self, arrays, region, frames):
        self.shape, self.wrap = np.array(arrays["shape"]), np.array(arrays["wrap"])
        self.axes, self.radius = len(self.shape), int(arrays["radius"])
        self.channels = int(arrays["channels"])
        self.colours = arrays["colours"].astype(np.int64).reshape(*self.shape, 4)
        self.features = arrays["features"].astype(np.int64).reshape(*self.shape, KEEP)
        side = np.arange(-self.radius, self.radius + 1)
        self.offsets = np.stack(np.meshgrid(*[side] * self.axes, indexing="ij"), axis=-1).reshape(-1, self.axes)
        self.basis = arrays["basis"].astype(np.int64).reshape(KEEP, -1)[:, : len(self.offsets) * self.channels]
        self.bias, self.gain = [int(b) for b in arrays["bias"]], int(arrays["gain"])
        self.spacing = max(int(arrays["spacing"]), 512**2 // 256)
        self.region = region
        points = np.stack(np.meshgrid(*map(np.arange, region.shape), indexing="ij"), axis=-1)
        self.points = points.reshape(-1, self.axes)
        self.frames = np.broadcast_to(frames.astype(np.int64), (len(self.points), self.axes, self.axes))

    def step(self, point, step):
        """Return the number of the point one step away, wrapped along periodic axes, or None beyond an end."""
        q = point + step
        size = np.array(self.region.shape)
        q = np.where(self.region.wrap, q % size, q)
        return None if ((q < 0) | (q >= size)).any() else int(np.ravel_multi_index(tuple(q), self.region.shape))

    def clamped(self, sample):
        return tuple(np.where(self.wrap, sample % self.shape, np.clip(sample, 0, self.shape - 1)).tolist())

    def inside(self, sample):
        """Return the sample, if its whole window is inside the exemplar."""
        near = np.where(self.wrap, 0, self.radius)
        i = np.where(self.wrap, sample % self.shape, sample)
        return tuple(i.tolist()) if ((i >= near) & (i < self.shape - near)).all() else None

    def bring_inside(self, places):
        near = np.where(self.wrap, 0, self.radius)
        sample = nearest(places)
        held = np.clip(sample, near, self.shape - 1 - near)
        kept = np.where(sample == held, places, held * ONE)
        return np.where(self.wrap, places % (self.shape * ONE), kept)

    def same(self, a, b):
        """Return whether two coordinates for one point belong to one piece."""
        d = np.abs(a - b)
        around = d % (self.shape * ONE)
        d = np.where(self.wrap, np.minimum(around, self.shape * ONE - around), d)
        return bool((d <= 3 * ONE // 4).all())

    def meet(self, places, p):
        """Return whether pieces meet next to a point."""
        for step in product((-1, 0, 1), repeat=self.axes):
            q = self.step(self.points[p], np.array(step))
            if q is not None and not self.same(places[p] + self.frames[p] @ np.array(step), places[q]):
                return True
        return False

    def near(self, p, changed):
        """Return whether a point or a neighbour changed."""
        away = np.abs(self.points[changed] - self.points[p])
        size = np.array(self.region.shape)
        away = np.where(self.region.wrap, np.minimum(away, size - away), away)
        return bool((away <= 1).all(axis=1).any())

    def window(self, places, p):
        """Return the appearance vector of the window around a point: the sample at F o belongs at o."""
        frame = self.frames[p]
        back = np.rint(np.linalg.inv(frame / ONE) * ONE).astype(np.int64)
        numbers = []
        for o in self.offsets:
            step = (back @ o + ONE // 2) >> 12
            q = self.step(self.points[p], step)
            place = places[p] + o * ONE if q is None else places[q] + o * ONE - frame @ step
            numbers.extend(self.colours[self.clamped(nearest(place))][: self.channels])
        sums = [int(s) for s in self.basis @ np.array(numbers)]
        scaled = [((s - b) * self.gain + (1 << 31)) >> 32 for s, b in zip(sums, self.bias, strict=True)]
        return np.clip(scaled, -2047, 2047)

    def improve(self, places, p, reach, limit, coherence, number, seed, exhaustive):
        """Return the best of a point's own match, its neighbours' matches, and some random ones."""
        feature = self.window(places, p)

        def cost(at):
            return int(((feature - self.features[at]) ** 2).sum())

        best = places[p]
        at = self.clamped(nearest(best))
        least = cost(at)
        if exhaustive:
            near = np.where(self.wrap, 0, self.radius)
            for there in np.ndindex(*(self.shape - 2 * near)):
                centre = np.array(there) + near
                if cost(tuple(centre.tolist())) < least:
                    best, at = centre * ONE, tuple(centre.tolist())
                    least = cost(at)
        proposals = []
        for far in range(1, reach + 1):
            for axis in range(self.axes):
                for side in (-far, far):
                    step = np.zeros(self.axes, np.int64)
                    step[axis] = side
                    q = self.step(self.points[p], step)
                    place = None if q is None else places[q] - self.frames[p] @ step
                    there = None if q is None else self.inside(nearest(place))
                    if there is not None:
                        proposals.append((far, place, there))

        def apart(place):
            return coherence * sum(not self.same(other, place) for far, other, _ in proposals if far == 1)

        least += apart(best)
        for _, place, there in proposals:
            if there != at and cost(there) + apart(place) < least:
                best, at, least = place, there, cost(there) + apart(place)
        if least <= limit + limit // 2:
            return best
        key = philox((3, 0x70617274, 0, 0), (seed & MASK, seed >> 32))[:2]
        world = [int(w) & MASK for w in self.points[p] + self.region.origin] + [0]
        centre = best
        for draw in range(6):
            words = philox((*world[:3], number << 8 | draw), key)
            radius = self.shape >> draw
            shift = [(words[a] * (2 * int(radius[a]) + 1) >> 32) - int(radius[a]) for a in range(self.axes)]
            place = centre + np.array(shift) * ONE
            there = self.inside(nearest(place))
            if there is not None and cost(there) + apart(place) + limit < least:
                best, least = place, cost(there) + apart(place) + limit
        return best

    def elect(self, matches, p, radius):
        """Return the proposal of the windows around a point that is nearest to their mean colour."""
        flat = self.colours.reshape(-1, 4).astype(float)
        variance = (flat**2).sum() / len(flat) - (flat.mean(axis=0) ** 2).sum()
        proposals, total, count = [], np.zeros(4, np.int64), 0
        for o in self.offsets[np.abs(self.offsets).max(axis=1) <= radius]:
            q = self.step(self.points[p], o)
            place = None if q is None else matches[q] - self.frames[p] @ o
            at = None if q is None else self.inside(nearest(place))
            if at is None:
                continue
            weight = np.exp(-(o**2).sum() / 8)
            share = round(256 * weight)
            total, count = total + share * self.colours[at], count + share
            proposals.append((place, self.colours[at], int(0.03 * (1 - weight) * variance)))
        best, least = matches[p], None
        for place, colour, handicap in proposals:
            mean = np.sign(total) * (np.abs(total) // max(count, 1))
            cost = handicap + int(((colour - mean) ** 2).sum())
            if least is None or cost < least:
                best, least = place, cost
        return best

    def correct(
        self,
        places,
        *,
        passes=2,
        first=0,
        exhaustive=False,
        reach=2,
        acceptance=2.0,
        coherence=0.0,
        vote=0,
        seed=0,
        held=None,
    ):
        """Return the coordinates after each pass."""
        now = self.bring_inside(places.astype(np.int64).reshape(-1, self.axes))
        limit, alone = int(acceptance * self.spacing), int(coherence * self.spacing)
        done = [now]
        changed = [np.ones(len(now), bool)] * 2
        for number in range(first, first + passes):
            fresh = [p for p, recently in enumerate(changed[0] | changed[1]) if recently]
            mine = [
                p
                for p, point in enumerate(self.points)
                if (point + self.region.origin).sum() % 2 == number % 2
                and not (held is not None and held[p])
                and self.near(p, fresh)
                and (exhaustive or self.meet(now, p))
            ]
            matches = now.copy()
            for p in mine:
                matches[p] = self.bring_inside(self.improve(now, p, reach, limit, alone, number, seed, exhaustive))
            elected = matches.copy()
            for p in mine if vote else ():
                elected[p] = self.bring_inside(self.elect(matches, p, vote))
            changed = [changed[1], (elected != now).any(axis=1)]
            now = elected
            done.append(now)
        return done


def nearest(place):
    return (place + ONE // 2) >> 12


def upsampled(places, parents, region, frames):
    """Twin of `texrs._engine.pyramid.upsample`."""
    axes = len(region.shape)
    coarse = places.astype(np.int64).reshape(*parents.shape, axes)
    out = []
    for i, point in enumerate(np.ndindex(*region.shape)):
        world = np.array(point) + region.origin
        at = np.minimum(world // 2 - parents.origin, np.array(parents.shape) - 1)
        frame = frames[i if len(frames) > 1 else 0].astype(np.int64)
        twice = 2 * (world - 2 * (at + parents.origin)) - 1
        out.append(2 * coarse[tuple(at)] + ONE // 2 + ((frame @ twice) >> 1))
    return np.array(out)

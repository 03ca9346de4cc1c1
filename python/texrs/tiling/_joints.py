"""Where the ends of an axis are joined: every joint tried on a small picture, the best ones followed to the full size.

A small picture tells as well as the full one where two ends of it agree, and a cut of an eighth of the side takes a
hundredth of the time. So all overlaps up to half of the side are cut there, and all covers; the cheapest are followed from
level to level, where each may be one of a few, which are told apart by what the seam of the level before costs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from texrs._typing import Floats
from texrs.kernels.seam import Cut, Strip, cut_strips
from texrs.tiling._closed import cut_overlaps

COARSEST = 96
"""The shorter side of the coarsest level is at least so long, and less than twice that."""
DEEP = 8.0
"""How many times more a pair deep inside an element costs to part, less one."""
FOLLOWED = 3
"""Joints that are followed from the coarsest level to the next, of which one goes on."""
APART = 2
"""Pixels of the coarsest level by which they differ at least."""
LOSS = 1.5
"""Share of the price of a cut that an overlap of the whole side would add: what is overlapped is lost."""
COVERED = 1.6
"""Factor of the cost that a cut next to a cover may have, relative to the cut of an overlap. A cover needs two cuts,
but nothing is lost."""
BAND = 4
"""Either cut of a cover is made in the side divided by this."""
NEAR = 6
"""Lines on either side of a seam within which it is looked for at the next level, to judge a joint."""


@dataclass(frozen=True, slots=True, eq=False)
class Level:
    """A picture at one size."""

    colours: Floats
    """(H, W, C)"""
    depth: Floats
    """(H, W): how deep inside an element each pixel is, 0 to 1."""

    def halve(self) -> Level:
        """Return the level of half the size; an odd last line is left out."""
        return Level(_halve(self.colours), _halve(self.depth))


def make_levels(colours: Floats, depth: Floats) -> list[Level]:
    """Return a picture at all sizes, the coarsest first."""
    levels = [Level(colours, depth)]
    while min(levels[0].depth.shape) >= 2 * COARSEST:
        levels.insert(0, levels[0].halve())
    return levels


@dataclass(frozen=True, slots=True)
class Joint:
    """How the ends of an axis of some lines meet.

    One cut: what comes ``width`` lines and less after the period is laid over the first lines. Or, with a ``cover``, two
    cuts: around the ends the lines that come so many before are shown. The period is then any length.
    """

    period: int
    width: int
    cover: int = 0

    def list_overlaps(self) -> list[tuple[int, int]]:
        """Return the first lines of what is cut from and of what is cut to, for each cut."""
        if not self.cover:
            return [(self.period, 0)]
        back = self.period - self.cover
        return [(self.period - self.width, back - self.width), (back, 0)]

    def list_finer(self, choice: Choice, side: int) -> list[Joint]:
        """Return what it may be at a level of twice the size."""
        if self.cover:
            width = max(1, choice.period // BAND)
            low, high = max(width, 2 * self.cover - 1), min(choice.period - width, 2 * self.cover + 2)
            return [Joint(choice.period, width, cover) for cover in range(low, high + 1)]
        low, high = max(choice.low, 2 * self.width - 1), min(choice.high, 2 * self.width + 2)
        near = range(low, high + 1) or [min(max(low, choice.low), choice.high)]
        return [Joint(side - width, width) for width in near]


@dataclass(frozen=True, slots=True)
class Choice:
    """Joints of an axis that may be chosen."""

    low: int
    """The least overlap of one cut; none where ``high`` is less."""
    high: int
    period: int = 0
    """The length of what is covered; 0: no cover."""
    covered: float = COVERED
    """Factor of the cost that a cut next to a cover may have, relative to the cut of an overlap."""
    loss: float = LOSS
    """Share of the price of a cut that an overlap of the whole side would add."""

    def coarsen(self, times: int, side: int) -> Choice:
        """Return the choice at a level of ``side``, halved so many times."""
        if not times:
            return self
        low = max(1, (self.low >> times) - 1)
        high = min((self.high >> times) + 1, side // 2) if self.high >= self.low else low - 1
        return replace(self, low=low, high=high, period=min(self.period >> times, side))

    def list_joints(self, side: int) -> list[Joint]:
        """Return all joints; those that lose nothing come first."""
        width, period = max(1, self.period // BAND), self.period
        covers = [Joint(period, width, cover) for cover in range(width, period - width + 1)] if period else []
        return covers + [Joint(side - width, width) for width in range(self.low, self.high + 1)]


@dataclass(frozen=True, slots=True, eq=False)
class Joined:
    """A joint, and its cuts."""

    joint: Joint
    cuts: tuple[Cut, ...]
    factor: float = 1.0
    """What the joint's price is multiplied by, besides the cost of its cuts."""
    tried: int = 1
    dearer: float = 1.0
    """How many times more the best joint that keeps the length costs, at the coarsest level."""

    @property
    def price(self) -> float:
        """The mean cost of a cut, dearer where the joint loses something, and does not fit."""
        return self.factor * sum(cut.value for cut in self.cuts) / len(self.cuts)


def find_joint(
    levels: Sequence[Level], axis: int, choice: Choice, *, closed: bool, progress: Callable[[float], object]
) -> Joined:
    """Return the joint of an axis that shows least and loses least.

    Parameters
    ----------
    levels : sequence of Level
        The picture at all sizes, the coarsest first.
    axis : {0, 1}
        The axis that becomes cyclic.
    choice : Choice
        At the full size.
    closed : bool
        Whether the other axis is cyclic already, so that cuts must close on themselves.
    progress : callable
        Called with the share that is done.

    """
    last = len(levels) - 1
    sides = [level.depth.shape[axis] for level in levels]
    choices = [choice.coarsen(last - k, side) for k, side in enumerate(sides)]
    progress(0.0)
    all_joints = choices[0].list_joints(sides[0])
    cuts = cut_joints(levels[0], axis, all_joints)
    misfits = np.array([measure_misfit(levels[0], axis, joint) for joint in all_joints])
    usual = float(np.median(misfits)) or 1.0
    # Where a seam runs through plain ground its cost does not say that a course or a lattice is out of step.
    costs = misfits / usual * [sum(each.value for each in cut) / len(cut) for cut in cuts]
    whole = min((cost for joint, cost in zip(all_joints, costs, strict=True) if joint.cover), default=0.0)
    found = []
    for joint, cut, misfit, cost in zip(all_joints, cuts, misfits.tolist(), costs.tolist(), strict=True):
        loss = 1 / choice.covered if joint.cover else 1 + choice.loss * joint.width / sides[0]
        found.append(Joined(joint, cut, loss * misfit / usual, len(all_joints), whole / cost if cost else 1.0))
    best = _spread(found, FOLLOWED if last else 1)
    if closed:
        # Seams that close cost little more, and take longer.
        again = cut_joints(levels[0], axis, [each.joint for each in best], closed=True)
        best = [replace(each, cuts=cut) for each, cut in zip(best, again, strict=True)]
    for k in range(1, last + 1):
        progress(k / (last + 1))
        best = [_refine(each, levels[k], axis, choices[k], closed=closed) for each in best]
        best = [min(best, key=lambda each: each.price)]
    return best[0]


def _spread(found: Sequence[Joined], count: int) -> list[Joined]:
    """Return the cheapest joints that are apart."""
    taken: list[Joined] = []
    for each in sorted(found, key=lambda each: each.price):
        place = each.joint.cover or -each.joint.width
        if all(abs(place - (t.joint.cover or -t.joint.width)) > APART for t in taken):
            taken.append(each)
        if len(taken) == count:
            break
    return taken


def _refine(found: Joined, level: Level, axis: int, choice: Choice, *, closed: bool) -> Joined:
    """Return a joint at the next level: the one of which the seams that are known would cost least, cut anew."""
    near = found.joint.list_finer(choice, level.depth.shape[axis])
    costs = judge_seams(level, axis, near, found.cuts)
    joint = near[int(np.argmin(costs))]
    [cuts] = cut_joints(level, axis, [joint], closed=closed)
    return replace(found, joint=joint, cuts=cuts)


def cut_joints(level: Level, axis: int, joints: Sequence[Joint], *, closed: bool = False) -> list[tuple[Cut, ...]]:
    """Cut each joint: where what comes after the period, or before the cover, ends."""
    made = iter(cut_overlaps([s for joint in joints for s in _lay_over(level, axis, joint)], closed=closed))
    return [tuple(next(made) for _ in joint.list_overlaps()) for joint in joints]


def _lay_over(level: Level, axis: int, joint: Joint) -> list[Strip]:
    """Return what is to be cut, with its lines first."""
    colours, depth = np.moveaxis(level.colours, axis, 0), np.moveaxis(level.depth, axis, 0)
    strips = []
    for both in joint.list_overlaps():
        (a, deep), (b, other) = (
            (colours[first : first + joint.width], depth[first : first + joint.width]) for first in both
        )
        strips.append(Strip(a, b, 0, (deep + other) * np.float32(DEEP / 2)))
    return strips


def measure_misfit(level: Level, axis: int, joint: Joint) -> float:
    """Return the mean difference of what is laid over each other."""
    colours = np.moveaxis(level.colours, axis, 0)
    pairs = [[colours[first : first + joint.width] for first in both] for both in joint.list_overlaps()]
    return float(np.mean([np.abs(a - b).mean() for a, b in pairs]))


def judge_seams(level: Level, axis: int, joints: Sequence[Joint], cuts: Sequence[Cut]) -> list[float]:
    """Return what each joint costs if its seams run near those of the level before."""
    colours, depth = np.moveaxis(level.colours, axis, 0), np.moveaxis(level.depth, axis, 0)
    along = np.arange(colours.shape[1])
    strips = []
    for joint in joints:
        for (a, b), cut in zip(joint.list_overlaps(), cuts, strict=True):
            middle = 2 * np.count_nonzero(~cut.mask, axis=0)[np.minimum(along // 2, cut.mask.shape[1] - 1)]
            line = np.clip(middle + np.arange(-NEAR, NEAR)[:, np.newaxis], 0, joint.width - 1)
            deep = (depth[a + line, along] + depth[b + line, along]) * np.float32(DEEP / 2)
            strips.append(Strip(colours[a + line, along], colours[b + line, along], 0, deep))
    values = [cut.value for cut in cut_strips(strips)]
    costs: list[float] = np.reshape(values, (len(joints), -1)).sum(axis=1).tolist()
    return costs


def _halve(image: Floats) -> Floats:
    rows, columns = (n // 2 * 2 for n in image.shape[:2])
    lines = image[0:rows:2, :columns] + image[1:rows:2, :columns]
    return np.asarray((lines[:, 0::2] + lines[:, 1::2]) * np.float32(0.25), np.float32)

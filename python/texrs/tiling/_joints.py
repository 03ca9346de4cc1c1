"""Find the best joint of the two ends of an axis: try all joints in a small copy, and refine the best ones.

If two ends of an image fit, they also fit in a small copy. Cutting at 1/8 of the side takes 1/100 of the time. The
search therefore cuts every overlap (up to half the side) and every cover in a small copy. It refines the cheapest
joints level by level. It tries a few similar joints at each level, and keeps the best one according to the cost near
the seam of the previous level.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from texrs._typing import Floats
from texrs.kernels.seam import Cut, Strip, cut_strips
from texrs.tiling._closed import cut_overlaps

COARSEST = 96
"""Minimum length, in pixels, of the shorter side of the coarsest level. The actual length is less than twice this."""
DEEP = 8.0
"""Additional cost of a seam at full depth inside an element, as a multiple of the usual cost."""
FOLLOWED = 3
"""Number of joints that are refined from the coarsest level to the next. Only the best one is refined further."""
APART = 2
"""Minimum difference between these joints in overlap or cover, in pixels of the coarsest level."""
LOSS = 1.5
"""Weight of the lost length in the price of a joint.

An overlap of the whole side would add this multiple of the cost of its seam.
"""
COVERED = 1.6
"""Ratio of the seam costs of a cover and of an overlap below which the cover is preferred.

A cover needs two seams, but keeps the size.
"""
BAND = 4
"""Divisor of the period that gives the width of the strip for each seam of a cover."""
MANY = 4
"""Number of joints above which the lines of a level are copied once, so that the kernel does not copy them for each joint.
"""
NEAR = 6
"""Number of lines on either side of a seam that are searched at the next level to measure the cost of a joint."""


@dataclass(frozen=True, slots=True, eq=False)
class Level:
    """An image at one resolution."""

    colours: Floats
    """Colours, (H, W, C)."""
    depth: Floats
    """Depth of each pixel inside an element, (H, W), 0 to 1."""

    def halve(self) -> Level:
        """Return the level at half the size. An odd last line is dropped."""
        return Level(halve(self.colours), halve(self.depth))


def make_levels(colours: Floats, depth: Floats) -> list[Level]:
    """Return an image at all resolutions, the coarsest first."""
    levels = [Level(colours, depth)]
    while min(levels[0].depth.shape) >= 2 * COARSEST:
        levels.insert(0, levels[0].halve())
    return levels


@dataclass(frozen=True, slots=True)
class Joint:
    """How the two ends of an axis are joined.

    Without a ``cover``, the ``width`` lines after the period overlap the first lines, and one seam is cut. With a
    ``cover``, the lines around the ends are replaced by the lines that are ``cover`` lines before them, and two seams
    are cut. The period can then be any length.
    """

    period: int
    width: int
    cover: int = 0

    def list_overlaps(self) -> list[tuple[int, int]]:
        """Return the first lines of the two overlapping strips of each seam."""
        if not self.cover:
            return [(self.period, 0)]
        back = self.period - self.cover
        return [(self.period - self.width, back - self.width), (back, 0)]

    def list_finer(self, choice: Choice, side: int) -> list[Joint]:
        """Return the joints similar to this one at the next level, which is twice as large."""
        if self.cover:
            width = max(1, choice.period // BAND)
            low, high = max(width, 2 * self.cover - 1), min(choice.period - width, 2 * self.cover + 2)
            return [Joint(choice.period, width, cover) for cover in range(low, high + 1)]
        low, high = max(choice.low, 2 * self.width - 1), min(choice.high, 2 * self.width + 2)
        near = range(low, high + 1) or [min(max(low, choice.low), choice.high)]
        return [Joint(side - width, width) for width in near]


@dataclass(frozen=True, slots=True)
class Choice:
    """Range of the joints that may be chosen for an axis."""

    low: int
    """Minimum overlap in lines. Overlaps are not allowed if ``high`` is less."""
    high: int
    period: int = 0
    """Length of a result with a cover, in lines. 0 if covers are not allowed."""
    covered: float = COVERED
    """Ratio of the seam costs of a cover and of an overlap below which the cover is preferred."""
    loss: float = LOSS
    """Weight of the lost length in the price of a joint."""

    def coarsen(self, times: int, side: int) -> Choice:
        """Return the range at a level whose axis has ``side`` lines, after halving the image ``times`` times."""
        if not times:
            return self
        low = max(1, (self.low >> times) - 1)
        high = min((self.high >> times) + 1, side // 2) if self.high >= self.low else low - 1
        return replace(self, low=low, high=high, period=min(self.period >> times, side))

    def list_joints(self, side: int) -> list[Joint]:
        """Return all allowed joints. Covers, which keep the length, come first."""
        width, period = max(1, self.period // BAND), self.period
        covers = [Joint(period, width, cover) for cover in range(width, period - width + 1)] if period else []
        return covers + [Joint(side - width, width) for width in range(self.low, self.high + 1)]


@dataclass(frozen=True, slots=True, eq=False)
class Joined:
    """A joint and the seams that were cut for it."""

    joint: Joint
    cuts: tuple[Cut, ...]
    factor: float = 1.0
    """Factor of the price, for lost length and for differences of the overlapping parts."""
    tried: int = 1
    dearer: float = 1.0
    """Cost of the best joint with a cover, relative to this joint, at the coarsest level."""

    @property
    def price(self) -> float:
        """Mean cost of the seams times `factor`. Joints are ranked by it."""
        return self.factor * sum(cut.value for cut in self.cuts) / len(self.cuts)


def find_joint(
    levels: Sequence[Level],
    axis: int,
    choice: Choice,
    *,
    closed: bool,
    progress: Callable[[float], object],
    refused: int = 0,
) -> Joined:
    """Return the joint of an axis that is least visible and loses the least length.

    Parameters
    ----------
    levels : sequence of Level
        The image at all resolutions, the coarsest first.
    axis : {0, 1}
        The axis that becomes periodic.
    choice : Choice
        Range of the possible joints at full resolution.
    closed : bool
        If True, the other axis is periodic already, so that seams must end where they start.
    progress : callable
        Function called with the finished share of the work, 0 to 1.
    refused : int
        Number of earlier calls whose joint was rejected. The best joints of those calls are skipped.

    """
    last = len(levels) - 1
    sides = [level.depth.shape[axis] for level in levels]
    choices = [choice.coarsen(last - k, side) for k, side in enumerate(sides)]
    progress(0.0)
    all_joints = choices[0].list_joints(sides[0])
    cuts = cut_joints(levels[0], axis, all_joints)
    misfits = np.array([measure_misfit(levels[0], axis, joint) for joint in all_joints])
    usual = float(np.median(misfits)) or 1.0
    # Multiply by the misfit: a seam through plain background is cheap even if courses or a lattice do not continue
    # across it.
    costs = misfits / usual * [sum(each.value for each in cut) / len(cut) for cut in cuts]
    whole = min((cost for joint, cost in zip(all_joints, costs, strict=True) if joint.cover), default=0.0)
    found = []
    for joint, cut, misfit, cost in zip(all_joints, cuts, misfits.tolist(), costs.tolist(), strict=True):
        loss = 1 / choice.covered if joint.cover else 1 + choice.loss * joint.width / sides[0]
        found.append(Joined(joint, cut, loss * misfit / usual, len(all_joints), whole / cost if cost else 1.0))
    followed = FOLLOWED if last else 1
    best = _spread(found, followed * (refused + 1))
    best = best[followed * refused :] or best[:followed]
    if closed:
        # Cut closed seams only for the best joints: they take longer to compute, and cost little more than open ones.
        again = cut_joints(levels[0], axis, [each.joint for each in best], closed=True)
        best = [replace(each, cuts=cut) for each, cut in zip(best, again, strict=True)]
    for k in range(1, last + 1):
        progress(k / (last + 1))
        best = [_refine(each, levels[k], axis, choices[k], closed=closed) for each in best]
        best = [min(best, key=lambda each: each.price)]
    return best[0]


def _spread(found: Sequence[Joined], count: int) -> list[Joined]:
    """Return the ``count`` cheapest joints that differ enough from each other."""
    taken: list[Joined] = []
    for each in sorted(found, key=lambda each: each.price):
        place = each.joint.cover or -each.joint.width
        if all(abs(place - (t.joint.cover or -t.joint.width)) > APART for t in taken):
            taken.append(each)
        if len(taken) == count:
            break
    return taken


def _refine(found: Joined, level: Level, axis: int, choice: Choice, *, closed: bool) -> Joined:
    """Return the joint at the next level that costs least near the seams of this level, with new seams."""
    near = found.joint.list_finer(choice, level.depth.shape[axis])
    costs = judge_seams(level, axis, near, found.cuts)
    joint = near[int(np.argmin(costs))]
    [cuts] = cut_joints(level, axis, [joint], closed=closed)
    return replace(found, joint=joint, cuts=cuts)


def cut_joints(level: Level, axis: int, joints: Sequence[Joint], *, closed: bool = False) -> list[tuple[Cut, ...]]:
    """Return the cut of each seam of each joint."""
    lines = Level(np.moveaxis(level.colours, axis, 0), np.moveaxis(level.depth, axis, 0))
    if len(joints) > MANY:
        # Make the lines contiguous once, because the kernel would copy them for each joint.
        lines = Level(np.ascontiguousarray(lines.colours), np.ascontiguousarray(lines.depth))
    made = iter(cut_overlaps([s for joint in joints for s in _lay_over(lines, joint)], closed=closed))
    return [tuple(next(made) for _ in joint.list_overlaps()) for joint in joints]


def _lay_over(lines: Level, joint: Joint) -> list[Strip]:
    """Return the pair of overlapping strips for each seam of a joint."""
    strips = []
    for both in joint.list_overlaps():
        (a, deep), (b, other) = (
            (lines.colours[first : first + joint.width], lines.depth[first : first + joint.width]) for first in both
        )
        strips.append(Strip(a, b, 0, (deep + other) * np.float32(DEEP / 2)))
    return strips


def measure_misfit(level: Level, axis: int, joint: Joint) -> float:
    """Return the mean absolute colour difference of the overlapping strips."""
    colours = np.moveaxis(level.colours, axis, 0)
    pairs = [[colours[first : first + joint.width] for first in both] for both in joint.list_overlaps()]
    return float(np.mean([np.abs(a - b).mean() for a, b in pairs]))


def judge_seams(level: Level, axis: int, joints: Sequence[Joint], cuts: Sequence[Cut]) -> list[float]:
    """Return the cost of each joint if its seams run near the seams of the previous level."""
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


def halve(image: Floats) -> Floats:
    rows, columns = (n // 2 * 2 for n in image.shape[:2])
    lines = image[0:rows:2, :columns] + image[1:rows:2, :columns]
    return np.asarray((lines[:, 0::2] + lines[:, 1::2]) * np.float32(0.25), np.float32)

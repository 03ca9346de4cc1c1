"""Choice: the best disjoint set of candidates, and the consensus that the chosen ones lend to all."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from texrs import _rust
from texrs._progress import ask
from texrs._typing import Floats, Labels
from texrs.exemplar.element_finder._candidates import Candidates, Leaves, make_candidates, make_leaves, measure
from texrs.exemplar.element_finder._contour_strength import Contours
from texrs.exemplar.element_finder._marks import heed_marks
from texrs.exemplar.element_finder._quality import FLOOR, measure_quality

Values = NDArray[np.float64]

VOICE = 0.2
"""Weight of code words in a quality, per unit of log-likelihood. 0.28 loses elements of rare colours, 0.1 finds background."""
ALIKE = 0.12
"""Weight of the likeness in size and shape to the other elements."""
SIZE = 0.22
"""Loss of quality if the size differs from the usual one by one spread."""
BLEND = 0.1
"""Loss of quality if both sides of an outline look alike, unlike those of other elements."""
FAR = 1.3
"""Distance from the usual size, in spreads, beyond which the size does not count against a candidate any further."""
RARE = 0.8
"""Share of the votes of code words against a candidate that a usual shape overrules: elements may have rare colours."""
LARGER = 0.1
"""Power of the usual area in the value of a choice: of equal choices the one of larger elements wins."""
CONVEX = 6
"""Power of the convexity in the value of a choice. On 30 images, 6 picks the best reading of lines most often."""
VALUE = {
    "worth": 3.55,
    "solid": 21.7,
    "ellipse": 59.3,
    "remainder": -6.43,
    "ground": 4.27,
    "leaves": 0.72,
    "size": -0.21,
}
"""Weights of the measures of a choice, see `compare_choices`.

They maximise the expected product of F and IoU of a choice with a probability proportional to exp(value).
They were fitted on 111 images: drawn ones, the same at other sizes and in other colours, and generated ones.
With each kind of texture left out in turn, the mean F is 0.848.
It is 0.813 with the worth and two powers of the area and the convexity.
"""
USUAL = -3.32
"""Logarithm of the best median area of the elements, as a share of the image: about 5 elements along each side."""
OTHERS = 48
"""Number of elements that each candidate is compared with."""
AT_ONCE = 1024
"""Number of candidates that are compared at once. It has no influence on the result."""
KEPT = 6, 3, 2, 1
"""Number of sets, the best ones, that each round of the consensus continues.

The first one is the number of usual sizes to start with: the mean F of drawn images is 0.81 with 1, 0.90 with 6.
Continuing all six four times takes a fifth longer and gives the same F and IoU.
"""
CROSS = ndimage.generate_binary_structure(2, 1)
"""Neighbourhood that elements grow into by one pixel. Without it, the mean F of 141 images is 0.05 lower, the IoU 0.02."""
STRANGE = -1.0
"""Log-likelihood of a code word below which elements do not grow into its pixels. -1.5 to -0.5 gave the same F and IoU."""
TOUCH = 0.1
"""Least share of an outline along which two elements touch that may be parts of one element."""
PARTS, EVEN, NOTCHED = 1.5, 0.25, 0.02
"""Least number of parts of an element on average, largest spread of the sizes, and largest loss of convexity.

On 74 images the groups of one steel tread plate pass, with F 0.11 before and 0.93 after. The spread of its sizes is
0.03. The next ones lose at least 0.08 of convexity.
"""
DOUBTFUL = 0.36
"""Difference from the median quality below which an element on a background is a part of the background.

Coins between which squares of the ground were elements: F 0.94 before, 1 after. Generated flowers: 0.90 and 0.97.
"""
FEWEST = 3, 1
"""Least number of elements of a choice. The second value is used if an image has no choice with the first one."""


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """A disjoint set of candidates.

    Attributes
    ----------
    labels : int32 array, (H, W)
        Element of each pixel.
    chosen : Candidates
        The elements.
    quality : float64 array, (N,)
        Quality of each element.
    value : float
        Mean quality of the elements above the floor, more if they are convex and large.
    score : float
        Value of the choice in comparison with other choices of the same image.
    lines : {"dark", "none", "light"}
        Lines that count as contours.
    level : float
        Strength of a clear contour.
    strength : float32 array, (H, W)
        Strength of contours.

    """

    labels: NDArray[np.int32]
    chosen: Candidates
    quality: Values
    value: float
    score: float
    lines: str
    level: float
    strength: Floats


def choose(contours: Contours, marks: Labels | None) -> Choice | None:
    """Return the best choice over all readings of lines, or None without elements."""
    for fewest in FEWEST:
        found = [choose_reading(contours, lines, fewest, marks) for lines in ("none", "dark", "light")]
        best = max((one for one in found if one is not None), key=lambda one: one.score, default=None)
        if best is not None:
            return best
    return None


def choose_reading(contours: Contours, lines: str, fewest: int, marks: Labels | None) -> Choice | None:
    """Return the best choice if lines of one kind are contours."""
    ask()
    # Merge the leaves, and keep candidates with a sufficient outline.
    strength, level = read_strength(contours, lines)
    leaves = make_leaves(strength, contours, 0.5 * level)
    total = strength.size
    least, most = max(20.0, total / 1500), total / 6
    candidates = make_candidates(leaves, least, most)
    base = measure_quality(candidates.features, level)
    keep = np.flatnonzero(base > FLOOR - 0.12)
    if len(keep) < fewest:
        return None
    candidates, base = candidates.pick(keep), base[keep]
    f = candidates.features
    # Elements that the border of the image cuts are larger than their visible part.
    visible = np.clip(1 - 0.9 * f["frame"] / (f["length"] + f["frame"]), 0.3, 1)
    sizes = np.log(f["area"] / visible)
    best: tuple[float, NDArray[np.bool_], Values] | None = None
    seen: set[bytes] = set()
    ladder = np.arange(np.log(least * 1.5), np.log(most), 0.35)
    starts = choose_sizes(candidates, base, sizes, ladder, fewest)
    for kept in KEPT:
        ranked = []
        for chosen, quality in starts[:kept]:
            # A set that occurred before would be followed by the same sets again.
            if chosen.tobytes() in seen:
                continue
            seen.add(chosen.tobytes())
            ask()
            extra = measure_consensus(candidates, chosen, quality, leaves)
            weights = np.sqrt(f["area"][chosen]) * np.maximum(quality[chosen] - FLOOR, 0.01)
            away = measure_gap(sizes, weighted_median(sizes[chosen], weights), f["frame"])
            spread = np.clip(1.5 * np.median(away[chosen]), 0.3, 0.55)
            quality = base + extra - SIZE * np.minimum(away / (2.0 * spread), FAR) ** 2
            chosen = select(candidates, quality, 6)
            if chosen.sum() < fewest:
                continue
            score = compare_choices(candidates, quality, chosen, leaves, level)
            ranked.append((score, chosen, quality))
            if best is None or score > best[0]:
                best = (score, chosen, quality)
        starts = [one[1:] for one in sorted(ranked, key=lambda one: -one[0])]
    if best is None:
        return None
    score, chosen, quality = best
    picked = np.flatnonzero(chosen)
    value = measure_value(candidates, quality, chosen)
    elements, rated = join_parts(candidates.pick(picked), quality[picked], leaves)
    if marks is not None:
        heeded = heed_marks(elements, rated, leaves, level, marks)
        if heeded is None:
            return None
        elements, rated = heeded
    return Choice(grow(elements, leaves, contours), elements, rated, value, score, lines, level, strength)


def join_parts(parts: Candidates, quality: Values, leaves: Leaves) -> tuple[Candidates, Values]:
    """Return the groups of elements that touch, if they are the more regular elements, and the quality of each.

    The two lit faces of a stud touch each other and nothing else. Their groups are alike in size and as convex as the
    faces. Whole elements that touch form groups of different sizes, or groups with notches between them.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    count, f = len(parts), parts.features
    part = np.full(leaves.count, -1)
    part[parts.members] = np.repeat(np.arange(count), np.diff(parts.starts))
    one, other = part[leaves.pairs.astype(np.intp)].T
    touch = (one >= 0) & (other >= 0) & (one != other)
    length = coo_array((leaves.arcs[touch, 0], (one[touch], other[touch])), shape=(count, count)).tocoo()
    length.sum_duplicates()
    near = length.data > TOUCH * np.minimum(f["length"][length.row], f["length"][length.col])
    links = coo_array((near[near], (length.row[near], length.col[near])), shape=(count, count))
    groups, group = connected_components(links, directed=False)
    if groups < FEWEST[0] or count < PARTS * groups:
        return parts, quality
    of_member = group[part[parts.members]]
    members = parts.members[np.argsort(of_member, kind="stable")]
    starts = np.concatenate([[0], np.cumsum(np.bincount(of_member, minlength=groups))])
    features, words = measure(leaves, starts, members)
    joined = Candidates(starts, members, features | {"seam": np.zeros(groups)}, words)

    def convexity(elements: Candidates) -> float:
        return float(np.average(elements.features["solid"], weights=elements.features["area"]))

    uneven = measure_spread(joined) > min(measure_spread(parts), EVEN)
    if uneven or convexity(joined) < convexity(parts) - NOTCHED:
        return parts, quality
    rated = np.bincount(group, f["area"] * quality) / np.bincount(group, f["area"])
    return joined, rated


def measure_spread(elements: Candidates) -> float:
    """Return the spread of the logarithms of the areas of elements inside the image, infinite for fewer than three."""
    sizes = np.log(elements.features["area"][elements.features["frame"] == 0])
    return float(np.median(np.abs(sizes - np.median(sizes)))) if len(sizes) >= FEWEST[0] else np.inf


def drop_doubtful(choice: Choice) -> Choice:
    """Return a choice without the elements whose quality is far below that of the others."""
    keep = choice.quality >= np.median(choice.quality) - DOUBTFUL
    number = np.concatenate([[0], np.where(keep, np.cumsum(keep), 0)]).astype(np.int32)
    chosen = choice.chosen.pick(np.flatnonzero(keep))
    return replace(choice, labels=number[choice.labels], chosen=chosen, quality=choice.quality[keep])


def read_strength(contours: Contours, lines: str) -> tuple[Floats, float]:
    """Return the strength of contours under one reading of lines, evened out over the image, and that of a clear one."""
    strength = contours.edges
    if lines != "none":
        strength = 0.45 * strength + 0.75 * (contours.dark if lines == "dark" else contours.light)
    # Three means over boxes are close to a Gaussian of 0.12 times the longer side, and take a tenth of the time.
    around = strength
    for _ in range(3):
        around = ndimage.uniform_filter(around, 2 * round(0.12 * max(strength.shape)) + 1)
    strength = strength / (0.35 + 0.65 * around / max(float(around.mean()), 1e-6))
    level = max(float(np.quantile(strength, 0.85)), 0.7 * float(np.quantile(strength, 0.97))) + 0.03
    return np.asarray(strength, np.float32), level


def grow(elements: Candidates, leaves: Leaves, contours: Contours) -> NDArray[np.int32]:
    """Return the labels of elements that are one pixel larger.

    Outlines on the crests of lines are inside the true outlines. Pixels that look like the background are left out.
    """
    labels = elements.paint(leaves)
    everything, inside = leaves.values[:, 7:].sum(0), elements.words.sum(0)
    few = 0.002 * labels.size
    inside, outside = inside + few, everything - inside + few
    likely = np.log(inside / inside.sum()) - np.log(outside / outside.sum()) > STRANGE
    larger = ndimage.maximum_filter(labels, footprint=CROSS)
    return np.where((labels == 0) & likely[contours.words], larger, labels)


def choose_sizes(
    candidates: Candidates, base: Values, sizes: Values, ladder: Values, fewest: int
) -> list[tuple[NDArray[np.bool_], Values]]:
    """Return the choices of the best usual sizes, and the qualities under each."""
    found = []
    for size in ladder:
        quality = base - SIZE * np.minimum(measure_gap(sizes, size, candidates.features["frame"]) / 1.2, 1.5) ** 2
        chosen = select(candidates, quality, 2)
        if chosen.sum() >= fewest:
            found.append((measure_value(candidates, quality, chosen), chosen, quality))
    found.sort(key=lambda one: -one[0])
    return [(chosen, quality) for _, chosen, quality in found[: KEPT[0]]]


def select(candidates: Candidates, quality: Values, rounds: int) -> NDArray[np.bool_]:
    """Return which candidates are in the disjoint set of the largest worth: area times quality above the floor."""
    worth = candidates.features["area"] * (quality - FLOOR)
    return _rust.choose_disjoint(candidates.starts, candidates.members, worth, quality, rounds)


def measure_gap(sizes: Values, size: float, frame: Values) -> Values:
    """Return the distance of sizes from a usual one. Elements that the border of the image cuts may be smaller."""
    gap = sizes - size
    return np.where((gap < 0) & (frame > 0), -0.35 * gap, np.abs(gap))


def weighted_median(values: Values, weights: Values) -> float:
    """Return the value below which half of the weight lies."""
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(total, total[-1] / 2)])


def measure_value(candidates: Candidates, quality: Values, chosen: NDArray[np.bool_]) -> float:
    """Return the value of a choice: its mean quality above the floor, more if elements are convex and large."""
    area = candidates.features["area"][chosen]
    mean = float((area * (quality[chosen] - FLOOR)).sum() / area.sum())
    convex = float((area * candidates.features["solid"][chosen]).sum() / area.sum())
    return float(mean * convex**CONVEX * np.median(area) ** LARGER)


def compare_choices(
    candidates: Candidates, quality: Values, chosen: NDArray[np.bool_], leaves: Leaves, level: float
) -> float:
    """Return the value of a choice in comparison with other choices of the same image."""
    f = candidates.features
    area = f["area"][chosen]
    worth, solid, ellipse = (
        float((area * each[chosen]).sum() / area.sum()) for each in (quality - FLOOR, f["solid"], f["ellipse"])
    )
    inside = np.zeros(leaves.count, bool)
    inside[candidates.pick(np.flatnonzero(chosen)).members] = True
    # Clear contours between two parts of the background are a sign that elements are missing.
    free = ~inside[leaves.pairs].any(axis=1)
    remainder = leaves.arcs[free, 1].sum() / max(leaves.arcs[free, 0].sum(), 1.0) / level
    words = leaves.values[:, 7:]
    own, other = (part.sum(0) / max(part.sum(), 1.0) for part in (words[inside], words[~inside]))
    usual = float(np.median(area))
    measures = {
        "worth": np.log(max(worth, 0.02)),
        "solid": np.log(solid),
        "ellipse": ellipse,
        "remainder": remainder,
        "ground": 0.5 * ((own - other) ** 2 / (own + other + 1e-6)).sum(),
        "leaves": np.log(usual / np.median(leaves.values[:, 0])),
        "size": (np.log(usual / leaves.labels.size) - USUAL) ** 2,
    }
    return float(sum(weight * measures[name] for name, weight in VALUE.items()))


def measure_consensus(candidates: Candidates, chosen: NDArray[np.bool_], quality: Values, leaves: Leaves) -> Values:
    """Return the amount that the chosen candidates add to each quality, for its code words and its shape.

    Better candidates count more. A candidate itself does not count for or against itself.
    """
    picked = np.flatnonzero(chosen)
    low, high = np.quantile(quality[picked], [0.1, 0.6])
    weight = np.clip((quality[picked] - low) / max(high - low, 0.04), 0.0, 1)
    own = candidates.pick(picked)
    of_leaf = np.zeros(leaves.count)
    of_leaf[own.members] = np.repeat(weight, np.diff(own.starts))
    words = leaves.values[:, 7:]
    by_leaf = words * of_leaf[:, None]
    everything, inside = words.sum(0), by_leaf.sum(0)
    mine = _rust.sum_regions(candidates.starts, candidates.members, by_leaf)
    element = np.maximum(inside - mine, 0)
    other = np.maximum(everything - inside - (candidates.words - mine), 0)
    few = 0.01 * everything + 1
    element += few
    other += few
    element /= other
    element *= max((everything - inside).sum(), 1) / max(inside.sum(), 1)
    ratio = np.clip(np.log(element, out=element), -2, 2, out=element)
    mean = np.einsum("ij,ij->i", ratio, candidates.words) / candidates.features["area"]
    f = candidates.features
    some = picked[np.linspace(0, len(picked) - 1, min(len(picked), OTHERS)).astype(np.intp)]
    like = measure_likeness(f, some, weight[np.searchsorted(picked, some)] + 0.05)
    like = like / max(float(np.quantile(like[picked], 0.9)), 1e-6)
    # A usual shape overrules most of the evidence against a rare colour.
    mean = np.maximum(mean, 0) + np.minimum(mean, 0) * (1 - RARE * np.minimum(like, 1))
    # Patches of the background look like their surroundings, more so than elements do.
    usual = weighted_median(f["alike"][picked], np.sqrt(f["area"][picked]))
    blend = np.clip((f["alike"] - usual - 0.1) / 0.4, 0, 1)
    return np.asarray(-BLEND * blend + VOICE * np.clip(mean, -1.0, 0.8) + ALIKE * np.clip(like - 0.5, -0.5, 0.5))


def measure_likeness(f: dict[str, Values], some: NDArray[np.intp], say: Values) -> Values:
    """Return how alike in size and shape each candidate is to some of them, a mean with weights."""
    # Four numbers of shape, in units of their usual differences between elements of one kind.
    form = np.stack([2 * np.log(f["area"]), 3.3 * np.log(f["elongation"]), f["solid"] / 0.08, f["ellipse"] / 0.08])
    form = form.astype(np.float32)
    like = np.empty(form.shape[1])
    for start in range(0, len(like), AT_ONCE):
        far = sum((row[start : start + AT_ONCE, None] - row[some]) ** 2 for row in form)
        # A matrix product and the exponential in single precision depend on the processor.
        like[start : start + AT_ONCE] = np.einsum("ij,j->i", np.exp(-0.5 * far.astype(np.float64)) * (far > 1e-9), say)
    like /= say.sum()
    return like

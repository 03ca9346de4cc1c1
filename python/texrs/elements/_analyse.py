"""The analysis of a texture (section 3): where its elements are, what belongs to them, how they are connected."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_float, as_image, as_int, as_mask, as_seed, as_wrap, check_memory, guidance
from texrs._typing import Array, Bools, Floats, Progress
from texrs.elements import _given, _mask, _start
from texrs.elements._clean import Cleaned, add_missing, clean, components
from texrs.elements._elements import Elements, Tag
from texrs.elements._given import Box
from texrs.elements._search import Channel, Found, search
from texrs.errors import InvalidInput
from texrs.layouts import directions, spacing

__all__ = ["analyse"]

FEWEST = 3
"""Elements without which there is no layout."""
SHORTEST = 16
"""Least side of an image."""
AGAIN = 0.8
"""Share of the elements of a proposed box that those of a better one must be."""
BYTES = 500
"""Of memory for a pixel, at the most: vectors, spectra and running sums of eight channels, and colour models."""
LITTLE, MUCH = 0.02, 0.95
"""Shares of foreground outside of which a mask cannot be right."""


def analyse(
    image: object,
    *,
    box: Sequence[float] | None = None,
    mask: object = None,
    background: object = None,
    tag: Tag | None = None,
    points: object = None,
    rotations: int = 1,
    scales: Sequence[float] = (1.0,),
    threshold: float | None = None,
    channel: Channel | None = None,
    model: _mask.Model | None = None,
    method: Literal["paper"] | None = None,
    wrap: bool | Sequence[bool] = False,
    seed: int = 0,
    progress: Progress | None = None,
) -> Elements:
    """Find the elements of a texture, what belongs to them and how they are connected [1]_.

    Everything may be left out: then the element, the background and the tag are proposed, and the report says how sure
    that is.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array
        The texture, sides of at least 16; any dtype.
    box : (row, column, height, width), optional
        Centre and size, in pixels, of the box around one element. Of a connected foreground it holds a mesh or a knot.
    mask : (H, W) array of bool, optional
        The foreground: of the chosen element if it lies within the box, else of the whole image, which is then not cut.
    background : (n, 2) points or (H, W) array of bool, optional
        Places (row, column) that lie between the elements, each good for 4 pixels around, or all that is known.
    tag : {"F=d", "F=c", "B=c"}, optional
        Separate elements, a connected foreground, or a connected background.
    points : (n, 2) array, optional
        The elements (row, column), instead of a search.
    rotations : int
        How many directions the element is looked for in, 1 to 72.
    scales : sequence of float
        Sizes in which it is looked for, 0.25 to 4.
    threshold : float, optional
        Least similarity, -1 to 1. By default what best parts the candidates in two classes (Otsu).
    channel : {"weighted", "min-entropy"}, optional
        The similarity of all channels by their variance, or that of the least entropy.
    model : {"mixture", "nearest"}, optional
        Colours as mixtures of Gaussians, or by the nearest sample.
    method : {None, "paper"}
        "paper": the published algorithm, its misprints repaired: one channel, no cut, nearest samples, no cleaning.
    wrap : bool or (rows, columns)
        Whether the texture repeats without a seam.
    seed : int
        Chooses the samples of the mixtures.
    progress : callable, optional
        Called as ``progress(stage, share)``; raising stops the work.

    Returns
    -------
    Elements
        Points by falling similarity, mask, tag and the directions in which the points line up.

    Raises
    ------
    InvalidInput
        An argument of another shape, type or range; a box outside of the image; a background that contradicts box or
        mask; a tag that contradicts the mask; or fewer than three elements.

    References
    ----------
    .. [1] Y. Liu, J. Wang, S. Xue, X. Tong, S. B. Kang and B. Guo, "Texture splicing", Computer Graphics Forum 28(7),
       2009. :doi:`10.1111/j.1467-8659.2009.01569.x`

    Examples
    --------
    >>> from texrs import samples
    >>> from texrs import elements as elements
    >>> sample = samples.load("dots", size=(128, 128))
    >>> found = elements.analyse(sample.image, mask=sample.mask, tag="F=d")
    >>> len(found.points) >= len(sample.centres)
    True

    """
    pixels = as_image(image, "image", minimum=SHORTEST)
    size = (pixels.shape[0], pixels.shape[1])
    check_memory(BYTES * size[0] * size[1], "image")
    rows, columns = as_wrap(wrap)
    how = _How.of(method, channel, model, rotations, scales, threshold, (rows, columns), seed)
    given = None if box is None else _given.as_box(box, size)
    known, said = _given.as_background(background, size), _given.as_tag(tag)
    marked = None if mask is None else as_mask(mask, "mask", size)
    listed = None if points is None else _given.as_points(points, size, "points")
    watch = _Watch(progress)
    guide = guidance(pixels)
    if guide.shape[-1] == 2:
        guide = np.concatenate([guide, guide[..., :1]], axis=-1)

    # 1. The element, the background and the tag: as said, or proposed.
    shape: Bools | None = None
    whole: Bools | None = None
    if marked is not None:
        if not marked.any() or marked.all():
            raise InvalidInput(f"mask: is {'all' if marked.any() else 'no'} foreground")
        given = _given.chosen(marked, given, said, components(marked, how.wrap)[0])
        shape, whole = _shape(marked, given, how.wrap)
    report: dict[str, Any] = {"proposed": [], "doubts": []}
    blind = known is None and whole is None
    if given is None or blind or said is None:
        proposal = _start.propose(guide, how.wrap, given, known, whole, said, listed, watch.part("propose"))
        report["proposed"] = [
            name for name, missing in (("box", given is None), ("background", blind), ("tag", said is None)) if missing
        ]
        report["confidence"] = proposal.confidence
        given, said = proposal.box, proposal.tag
        if blind:
            known = proposal.background & ~marked if marked is not None else proposal.background
    _given.check_agreement(marked, known, given, said)
    if whole is not None:
        _agree(whole, said, how.wrap)

    # 2. Where the texture looks like it.
    found = _listed(listed, size) if listed is not None else how.search(guide, given, watch.part("search"))
    watch("separate", 0.0)

    # 3. What belongs to the elements.
    cut = whole if whole is not None else how.cut(guide, given, found, known, said, shape)
    result = _agreed(cut, found, given, said, shape, how, listed=listed is not None, certain=whole is not None)
    if len(result.points) < FEWEST:
        raise InvalidInput(
            f"image: {len(result.points)} elements were found, at least {FEWEST} are needed; try another box, more "
            f"rotations or scales, a lower threshold (it was {found.threshold:.2f}), or give the points"
        )
    if "box" in report["proposed"] and said == "F=d" and result.source == "cut" and not how.literal and listed is None:
        again = _centred(pixels, result, known, how)
        if again is not None:
            return replace(
                again, report={**again.report, "proposed": report["proposed"], "confidence": proposal.confidence}
            )
    if whole is None:
        doubt = _given.disagreement(
            result.mask, said, components(result.mask, how.wrap)[0], _ground(result.mask, how.wrap)
        )
        if doubt:
            report["doubts"].append(doubt)
    if not LITTLE <= result.mask.mean() <= MUCH:
        report["doubts"].append(f"{result.mask.mean():.0%} of the image is foreground")
    report |= {
        "box": [*given.centre, *given.size],
        "background": [] if known is None else _some_points(known),
        "method": method or "default",
        "channel": found.channel,
        "threshold": found.threshold,
        "detections": len(found.points),
        "added": int((result.origin < 0).sum()),
        "mask": "given" if whole is not None else result.source,
        "foreground": float(result.mask.mean()),
        "spacing": spacing(result.points),
    }
    picked = [found.templates[found.which[i] if i >= 0 else 0] for i in result.origin]
    watch("separate", 1.0)
    return Elements(
        pixels,
        result.points,
        result.mask,
        given.size,
        said,
        result.scores,
        directions(result.points),
        how.wrap,
        report,
        np.array([t.angle for t in picked]),
        np.array([t.scale for t in picked]),
    )


@dataclass(frozen=True, slots=True)
class _How:
    """How to look, checked."""

    literal: bool
    channel: Channel
    model: _mask.Model
    rotations: int
    scales: Sequence[float]
    threshold: float | None
    wrap: tuple[bool, bool]
    seed: int

    @classmethod
    def of(
        cls,
        method: str | None,
        channel: Channel | None,
        model: _mask.Model | None,
        rotations: int,
        scales: Sequence[float],
        threshold: float | None,
        wrap: tuple[bool, bool],
        seed: int,
    ) -> _How:
        if method not in (None, "paper"):
            raise InvalidInput(f"method: None or 'paper' is allowed, got {method!r}")
        literal = method == "paper"
        channel = ("min-entropy" if literal else "weighted") if channel is None else channel
        model = ("nearest" if literal else "mixture") if model is None else model
        if channel not in ("weighted", "min-entropy"):
            raise InvalidInput(f"channel: allowed are weighted and min-entropy; got {channel!r}")
        if model not in ("mixture", "nearest"):
            raise InvalidInput(f"model: allowed are mixture and nearest; got {model!r}")
        turns, chance = as_int(rotations, "rotations", 1, 72), as_seed(seed)
        if (
            isinstance(scales, str | bytes)
            or not isinstance(scales, Sequence | np.ndarray)
            or not 1 <= len(scales) <= 16
        ):
            raise InvalidInput(f"scales: needs 1 to 16 numbers, got {scales!r}")
        sizes = [as_float(s, f"scales[{i}]", 0.25, 4.0) for i, s in enumerate(scales)]
        least = None if threshold is None else as_float(threshold, "threshold", -1, 1)
        return cls(literal, channel, model, turns, sizes, least, wrap, chance)

    def search(self, guide: Floats, box: Box, progress: Any) -> Found:
        return search(
            guide,
            box.centre,
            box.size,
            wrap=self.wrap,
            rotations=self.rotations,
            scales=self.scales,
            channel=self.channel,
            threshold=self.threshold,
            cut=not self.literal,
            progress=progress,
        )

    def cut(
        self, guide: Floats, box: Box, found: Found, background: Bools | None, tag: Tag, shape: Bools | None
    ) -> Bools:
        centres = np.concatenate([[box.centre], found.pixels])
        ground = np.zeros(guide.shape[:2], bool) if background is None else background
        mask = _mask.cut(
            _mask.lab(guide),
            centres,
            box.size,
            ground,
            tag=tag,
            shape=shape,
            wrap=self.wrap,
            seed=self.seed,
            model=self.model,
        )
        if self.literal:
            return mask
        return _mask.tidy(mask, float(_mask.ellipse(box.size).sum()), net=tag != "F=d")


def _agreed(
    cut: Bools, found: Found, box: Box, tag: Tag, shape: Bools | None, how: _How, *, listed: bool, certain: bool
) -> Cleaned:
    """Make detections and mask agree, as far as the tag says how."""
    plain = Cleaned(found.points, found.scores, np.arange(len(found.points)), cut, "cut")
    if how.literal or not len(found.points):
        return plain
    if tag == "F=d":
        own = shape if shape is not None else _mask.ellipse(box.size)
        cleaned = clean(cut, found.points, found.scores, found.map, own, how.wrap, certain=certain)
        # What a user lists stays as it is; the mask alone follows.
        return replace(plain, mask=cleaned.mask, source=cleaned.source) if listed else cleaned
    at = np.clip(np.rint(found.points).astype(np.intp), 0, np.array(cut.shape) - 1)
    if not listed and (tag == "B=c" or cut[tuple(at.T)].mean() < 0.5):
        return add_missing(plain, found.map, how.wrap, joints=tag == "B=c")
    return plain


def _centred(pixels: Array, result: Cleaned, known: Bools | None, how: _How) -> Elements | None:
    """Analyse again from the box of a usual piece of the mask: what was proposed may lie beside the middle of an element."""
    try:
        middle = _given.chosen(result.mask, None, "F=d", components(result.mask, how.wrap)[0])
        again = analyse(
            pixels,
            box=(*middle.centre, *middle.size),
            background=known,
            tag="F=d",
            rotations=how.rotations,
            scales=how.scales,
            threshold=how.threshold,
            channel=how.channel,
            model=how.model,
            wrap=how.wrap,
            seed=how.seed,
        )
    except InvalidInput:
        return None
    return again if len(again.points) >= AGAIN * len(result.points) else None


class _Watch:
    def __init__(self, progress: Progress | None) -> None:
        self.progress = progress

    def __call__(self, stage: str, share: float) -> None:
        if self.progress is not None:
            self.progress(stage, share)

    def part(self, stage: str) -> Any:
        return lambda share: self(stage, share)


def _shape(mask: Bools | None, box: Box, wrap: tuple[bool, bool]) -> tuple[Bools | None, Bools | None]:
    """Tell a mask of the chosen element, cut out with its box, from one of the whole image."""
    if mask is None:
        return None, None
    inside = np.zeros(mask.shape, bool)
    _mask.stamp(inside, np.array([box.centre]), np.ones(tuple(n + 2 for n in box.size), bool), wrap)
    pieces, count = components(mask, wrap)
    crossing = np.unique(pieces[mask & inside])
    alone = not (mask & ~inside).any() or (count == 1 and not len(crossing))
    corner = [box.centre[a] - box.size[a] // 2 for a in range(2)]
    window = [np.arange(corner[a], corner[a] + box.size[a]) for a in range(2)]
    own: Bools = mask[
        np.ix_(*(w % n if c else np.clip(w, 0, n - 1) for w, n, c in zip(window, mask.shape, wrap, strict=True)))
    ]
    if not own.any():
        raise InvalidInput("mask: has no foreground in the box")
    return own, None if alone else mask


def _agree(mask: Bools, tag: Tag, wrap: tuple[bool, bool]) -> None:
    trouble = _given.disagreement(mask, tag, components(mask, wrap)[0], _ground(mask, wrap))
    if trouble:
        raise InvalidInput(f"tag: contradicts the mask: {trouble}")


def _ground(mask: Bools, wrap: tuple[bool, bool]) -> Any:
    return components(~mask, wrap)[0]


def _listed(points: NDArray[np.float64], shape: tuple[int, ...]) -> Found:
    """Take points as they are given, all equally like the element."""
    pixels = np.clip(np.floor(points + 0.5).astype(np.intp), 0, np.array(shape) - 1)
    scores = np.ones(len(points))
    return Found(pixels, points, scores, np.zeros(len(points), np.intp), np.ones(shape, np.float32), -1.0, None)


def _some_points(marked: Bools, most: int = 64) -> list[list[int]]:
    places = np.argwhere(marked)
    return [[int(r), int(c)] for r, c in places[:: max(1, len(places) // most)]]

"""The analysis of a texture (section 3): where its texels are, what belongs to them, how they are connected."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_float, as_image, as_int, as_mask, as_seed, as_wrap, guidance
from texrs._typing import Bools, Progress
from texrs.errors import InvalidInput
from texrs.texels import _given, _mask, _start
from texrs.texels._clean import Cleaned, add_missing, clean, components
from texrs.texels._entry import Tag, Texels
from texrs.texels._given import Box
from texrs.texels._points import peaks, spacing
from texrs.texels._search import Channel, Found, search

__all__ = ["analyse"]

FEWEST = 3
"""Texels without which there is no layout."""
SHORTEST = 16
"""Least side of an image."""
AGAIN = 0.8
"""Share of the texels of a proposed box that those of a better one must be."""
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
    method: Literal["default", "paper"] = "default",
    wrap: bool | Sequence[bool] = False,
    seed: int = 0,
    progress: Progress | None = None,
) -> Texels:
    """Find the texels of a texture, what belongs to them and how they are connected [1]_.

    Everything may be left out: then the texel, the background and the tag are proposed, and the report says how sure
    that is.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array
        The texture, sides of at least 16; any dtype.
    box : (row, column, height, width), optional
        Centre and size, in pixels, of the box around one texel. Of a connected foreground it holds a mesh or a knot.
    mask : (H, W) array of bool, optional
        The foreground: of the chosen texel if it lies within the box, else of the whole image, which is then not cut.
    background : (n, 2) points or (H, W) array of bool, optional
        Places (row, column) that lie between the texels, each good for 4 pixels around, or all that is known.
    tag : {"F=d", "F=c", "B=c"}, optional
        Separate texels, a connected foreground, or a connected background.
    points : (n, 2) array, optional
        The texels (row, column), instead of a search.
    rotations : int
        How many directions the texel is looked for in, 1 to 72.
    scales : sequence of float
        Sizes in which it is looked for, 0.25 to 4.
    threshold : float, optional
        Least similarity, -1 to 1. By default what best parts the candidates in two classes (Otsu).
    channel : {"weighted", "min-entropy"}, optional
        The similarity of all channels by their variance, or that of the least entropy.
    model : {"mixture", "nearest"}, optional
        Colours as mixtures of Gaussians, or by the nearest sample.
    method : {"default", "paper"}
        "paper": the published algorithm, its misprints repaired: one channel, no cut, nearest samples, no cleaning.
    wrap : bool or (rows, columns)
        Whether the texture repeats without a seam.
    seed : int
        Chooses the samples of the mixtures.
    progress : callable, optional
        Called as ``progress(stage, share)``; raising stops the work.

    Returns
    -------
    Texels
        Points by falling similarity, mask, tag and the directions in which the points line up.

    Raises
    ------
    InvalidInput
        An argument of another shape, type or range; a box outside of the image; a background that contradicts box or
        mask; a tag that contradicts the mask; or fewer than three texels.

    References
    ----------
    .. [1] Y. Liu, J. Wang, S. Xue, X. Tong, S. B. Kang and B. Guo, "Texture splicing", Computer Graphics Forum 28(7),
       2009. :doi:`10.1111/j.1467-8659.2009.01569.x`

    Examples
    --------
    >>> from texrs import samples, texels
    >>> sample = samples.load("dots", size=(128, 128))
    >>> found = texels.analyse(sample.image, mask=sample.mask, tag="F=d")
    >>> len(found.points) >= len(sample.centres)
    True

    """
    pixels = as_image(image, "image", minimum=SHORTEST)
    size = (pixels.shape[0], pixels.shape[1])
    closed = as_wrap(wrap)
    around = (closed[0], closed[1])
    if method not in ("default", "paper"):
        raise InvalidInput(f"method: allowed are default and paper; got {method!r}")
    literal = method == "paper"
    channel = ("min-entropy" if literal else "weighted") if channel is None else channel
    model = ("nearest" if literal else "mixture") if model is None else model
    if channel not in ("weighted", "min-entropy"):
        raise InvalidInput(f"channel: allowed are weighted and min-entropy; got {channel!r}")
    if model not in ("mixture", "nearest"):
        raise InvalidInput(f"model: allowed are mixture and nearest; got {model!r}")
    turns, chance = as_int(rotations, "rotations", 1, 72), as_seed(seed)
    if isinstance(scales, str | bytes) or not 1 <= len(scales) <= 16:
        raise InvalidInput(f"scales: needs 1 to 16 numbers, got {scales!r}")
    sizes = [as_float(s, f"scales[{i}]", 0.25, 4.0) for i, s in enumerate(scales)]
    least = None if threshold is None else as_float(threshold, "threshold", -1, 1)
    given = None if box is None else _given.as_box(box, size)
    known, said = _given.as_background(background, size), _given.as_tag(tag)
    marked = None if mask is None else as_mask(mask, "mask", size)
    listed = None if points is None else _given.as_points(points, size, "points")
    watch = _Watch(progress)

    guide = guidance(pixels)
    if guide.shape[-1] == 2:
        guide = np.concatenate([guide, guide[..., :1]], axis=-1)
    report: dict[str, Any] = {"proposed": [], "doubts": []}
    if marked is not None:
        if not marked.any() or marked.all():
            raise InvalidInput(f"mask: is {'all' if marked.any() else 'no'} foreground")
        given = _given.chosen(marked, given, said, components(marked, around)[0])
    if given is None or (known is None and marked is None) or said is None:
        proposal = _start.propose(guide, around, given, known, marked, said, listed, watch.part("propose"))
        report["proposed"] = [
            name
            for name, old in (("box", given), ("background", known if marked is None else 1), ("tag", said))
            if old is None
        ]
        report["confidence"] = proposal.confidence
        given, said = proposal.box, proposal.tag
        known = proposal.background if known is None and marked is None else known
    _given.check_agreement(marked, known, given, said)
    shape, whole = _shape(marked, given, around)
    if whole is not None:
        _agree(whole, said, around)

    if listed is None:
        found = search(
            guide,
            given.centre,
            given.size,
            wrap=around,
            rotations=turns,
            scales=sizes,
            channel=channel,
            threshold=least,
            cut=not literal,
            progress=watch.part("search"),
        )
    else:
        found = _listed(listed, guide.shape[:2])
    watch("separate", 0.0)
    if whole is not None:
        cut = whole
    else:
        assert known is not None
        centres = np.concatenate([[given.centre], found.pixels])
        colours = _mask.lab(guide)
        cut = _mask.cut(
            colours,
            centres,
            given.size,
            known,
            tag=said,
            shape=shape,
            wrap=around,
            seed=chance,
            model=model,
        )
        if not literal:
            cut = _mask.tidy(cut, float(_mask.ellipse(given.size).sum()), net=said != "F=d")
    result = Cleaned(found.points, found.scores, np.arange(len(found.points)), cut, "cut")
    if said == "F=d" and not literal:
        own = shape if shape is not None else _mask.ellipse(given.size)
        result = clean(cut, found.points, found.scores, found.map, own, around, certain=whole is not None)
    elif not literal and listed is None and len(result.points):
        at = np.clip(np.rint(result.points).astype(np.intp), 0, np.array(size) - 1)
        if said == "B=c" or result.mask[tuple(at.T)].mean() < 0.5:
            result = add_missing(result, found.map, around, joints=said == "B=c")
    if len(result.points) < FEWEST:
        raise InvalidInput(
            f"image: {len(result.points)} texels were found, at least {FEWEST} are needed; try another box, more "
            f"rotations or scales, a lower threshold (it was {found.threshold:.2f}), or give the points"
        )
    if whole is None:
        doubt = _given.disagreement(result.mask, said, components(result.mask, around)[0], _ground(result.mask, around))
        if doubt:
            report["doubts"].append(doubt)
    if not LITTLE <= result.mask.mean() <= MUCH:
        report["doubts"].append(f"{result.mask.mean():.0%} of the image is foreground")
    if "box" in report["proposed"] and said == "F=d" and result.source == "cut" and not literal and listed is None:
        pieces = components(result.mask, around)[0]
        with suppress(InvalidInput):
            middle = _given.chosen(result.mask, None, said, pieces)
            # What was proposed may lie beside the middle of a texel; its piece of the mask does not.
            again = analyse(
                pixels,
                box=(*middle.centre, *middle.size),
                background=known,
                tag=said,
                rotations=turns,
                scales=sizes,
                threshold=least,
                channel=channel,
                model=model,
                wrap=around,
                seed=chance,
            )
            if len(again.points) >= AGAIN * len(result.points):
                kept = {name: report[name] for name in ("proposed", "confidence")}
                return replace(again, report=again.report | kept)
    templates = found.templates
    picked = [templates[found.which[i]] if i >= 0 else templates[0] for i in result.origin]
    report |= {
        "box": [*given.centre, *given.size],
        "background": [] if known is None else _some_points(known),
        "method": method,
        "channel": found.channel,
        "threshold": found.threshold,
        "detections": len(found.points),
        "added": int((result.origin < 0).sum()),
        "mask": "given" if whole is not None else result.source,
        "foreground": float(result.mask.mean()),
        "spacing": spacing(result.points),
    }
    watch("separate", 1.0)
    return Texels(
        pixels,
        result.points,
        result.mask,
        given.size,
        said,
        result.scores,
        peaks(result.points),
        around,
        report,
        np.array([t.angle for t in picked]),
        np.array([t.scale for t in picked]),
    )


class _Watch:
    def __init__(self, progress: Progress | None) -> None:
        self.progress = progress

    def __call__(self, stage: str, share: float) -> None:
        if self.progress is not None:
            self.progress(stage, share)

    def part(self, stage: str) -> Any:
        return lambda share: self(stage, share)


def _shape(mask: Bools | None, box: Box, wrap: tuple[bool, bool]) -> tuple[Bools | None, Bools | None]:
    """Tell a mask of the chosen texel, cut out with its box, from one of the whole image."""
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
    """Take points as they are given, all equally like the texel."""
    pixels = np.clip(np.floor(points + 0.5).astype(np.intp), 0, np.array(shape) - 1)
    scores = np.ones(len(points))
    return Found(pixels, points, scores, np.zeros(len(points), np.intp), np.ones(shape, np.float32), -1.0, None)


def _some_points(marked: Bools, most: int = 64) -> list[list[int]]:
    places = np.argwhere(marked)
    return [[int(r), int(c)] for r, c in places[:: max(1, len(places) // most)]]

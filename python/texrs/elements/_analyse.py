"""Analyse a texture (section 3): positions, pixels and layout of its elements."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, check_work, guidance, to_lab
from texrs._progress import answering, listen
from texrs._typing import Array, Bools, Floats, Progress
from texrs.elements import _mask
from texrs.elements._corrections import correct, read_steps
from texrs.elements._elements import ElementAnalysis
from texrs.elements._finder_view import FEWEST, View, view_elements
from texrs.elements._layout import Layout, LayoutName
from texrs.elements._options import ElementSearch, Settings
from texrs.elements._proposal import ADVICE, DOUBTFUL, Start, propose
from texrs.elements._search import Detections, search_similar
from texrs.elements._separation import Separation, add_missing, find_nearest_pixels, reconcile
from texrs.elements.arguments import Arguments, check_consistency, find_contradiction
from texrs.errors import InvalidInput
from texrs.materials import Material
from texrs.point_sets import directions, spacing

SHORTEST = 16
"""Minimum side of an image, in pixels."""
SURE = 0.9
"""Confidence of the analysis of a material's colours above which its other maps are not analysed."""
LITTLE, MUCH = 0.02, 0.95
"""Minimum and maximum plausible share of the image that is foreground."""


def analyse(
    image: object,
    *,
    box: Sequence[float] | None = None,
    mask: object = None,
    background: object = None,
    layout: Layout | LayoutName | None = None,
    points: object = None,
    search: ElementSearch = ElementSearch(),
    method: Literal["paper"] | None = None,
    wrap: bool | Sequence[bool] = False,
    seed: int = 0,
    corrections: Sequence[Mapping[str, object]] | None = None,
    progress: Progress | bool | None = None,
) -> ElementAnalysis:
    """Find the elements of a texture, their pixels and their layout [1]_.

    All arguments except the image are optional. The elements are those of `texrs.exemplar.element_finder`, which DESIGN
    uses as well. The report contains the confidence of the layout and of the elements. It also contains the
    ``"lattice"`` or the ``"courses"`` of the image, if any, with their confidence. The layout of a heap is "disjoint",
    and the report's ``"found"`` is "heap". If ``layout`` or ``background`` is given, it replaces what was
    found. With a ``box``, the elements like the one in the box remain. If no element has the size of the box, the
    elements are the places that look like the box. The same applies if a ``mask`` or a ``search`` is given.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array, or Material
        Texture, of any real dtype, at least 16 pixels a side. The colours of a material are analysed first. If their
        result is uncertain, all maps are analysed as well, and the more certain result is used. The result contains
        the colours.
    box : (row, column, height, width), optional
        Centre and size of the box around one element, in pixels. The element of a connected foreground is one mesh or
        one knot.
    mask : (H, W) array of bool, path or Mask, optional
        Mask of the foreground. If it is within the box, it is the foreground of the chosen element. Otherwise it is
        the foreground of the whole image, and the graph cut is skipped. Default: found by a graph cut.
    background : (n, 2) points or (H, W) array of bool, optional
        Points (row, column) between the elements, where each marks a radius of 4 pixels. Elements that they hit are
        removed. Python also accepts a mask of all known background.
    layout : Layout or str, optional
        Layout of the elements: separate ("disjoint"), a connected foreground ("connected"), or separated by joints
        ("jointed"). The paper's "F=d", "F=c" and "B=c" are accepted. Default: the layout that is found.
    points : (n, 2) array, optional
        Centres of the elements (row, column). They replace the search.
    search : ElementSearch
        Options of the search: directions, sizes, minimum similarity and colour model.
    method : {None, "paper"}
        Method of the analysis. "paper" is the published algorithm with its misprints corrected: one channel, no cut,
        nearest samples, no cleaning. Default: the algorithm with the improvements of texrs.
    wrap : bool or (rows, columns)
        Axes along which the texture is tileable. Python also accepts a single bool for both. Default: none.
    seed : int
        Seed of the random samples that colours are learned from. Default: 0.
    corrections : sequence of dict, optional
        Corrections of the result (`texrs.elements.correct`).
    progress : callable or True, optional
        Function that is called as ``progress(stage, share)``. An exception from it stops the work. True shows a
        progress bar.

    Returns
    -------
    ElementAnalysis
        The analysis: points in order of falling confidence or similarity, mask, layout and the directions of rows of
        points.

    Raises
    ------
    InvalidInput
        If an argument has an invalid shape, type or range, or the box is outside the image. The background contradicts
        the box or the mask, or the layout contradicts the mask. A correction is impossible, or fewer than three
        elements are found.

    References
    ----------
    .. [1] Y. Liu, J. Wang, S. Xue, X. Tong, S. B. Kang and B. Guo, "Texture splicing", Computer Graphics Forum 28(7),
       2009.

    Examples
    --------
    >>> from texrs import elements, samples
    >>> sample = samples.load("dots", size=(128, 128))
    >>> found = elements.analyse(sample.image, mask=sample.mask, layout="disjoint")
    >>> len(found.points) >= len(sample.centres)
    True

    """
    progress = listen(progress)
    if isinstance(image, Material):
        rest: dict[str, Any] = {"box": box, "mask": mask, "background": background, "layout": layout, "points": points}
        rest |= {"search": search, "method": method, "wrap": wrap, "seed": seed, "corrections": corrections}
        return _choose_map(image, partial(analyse, **rest, progress=progress))
    pixels, steps = as_image(image, "image", minimum=SHORTEST), read_steps(() if corrections is None else corrections)
    size = (pixels.shape[0], pixels.shape[1])
    check_work("analyse", [pixels], size, "image")
    how = Settings.of(search, method, wrap, seed)
    given = Arguments.of(size, how.wrap, box=box, layout=layout, background=background, mask=mask, points=points)
    watch = progress or (lambda stage, share: None)
    guide = _repeat_channel(guidance(pixels))

    # 1. Use the elements of the finder if the foreground, the points or a search are not given.
    free = given.mask is None and given.points is None and search == ElementSearch() and not how.literal
    view = view_elements(guide, given, how.wrap, seed, watch) if free else None
    entry = _search(pixels, guide, given, how, watch) if view is None else _take_view(pixels, given, view, how)
    watch("separate", 1.0)
    unsure = [
        f"{name} is proposed, {sure:.0%} sure: {ADVICE[name]}"
        for name, sure in entry.report["confidence"].items()
        if sure < DOUBTFUL
    ]
    entry = replace(entry, report={**entry.report, "warnings": [*entry.report["warnings"], *unsure]})
    return correct(entry, steps)


def _take_view(pixels: Array, given: Arguments, view: View, how: Settings) -> ElementAnalysis:
    """Return the elements of the finder as an analysis."""
    places = find_nearest_pixels(view.points, view.mask.shape)
    found = Detections(
        np.stack(places, axis=-1),
        view.points,
        view.confidence,
        np.zeros(len(view.points), np.intp),
        np.ones(view.mask.shape, np.float32),
        -1.0,
        None,
    )
    likely = {"box": float(view.confidence[0]), "background": float(view.confidence.mean()), "layout": view.sure}
    sure = {name: value for name, value in likely.items() if getattr(given, name) is None}
    start = Start(view.box, view.layout, given.background, list(sure), sure)
    parted = Separation(view.points, view.confidence, np.arange(len(view.points)), view.mask, "finder")
    _check(given, start, how)
    entry = _make_entry(pixels, given, start, found, parted, how)
    report = entry.report if given.layout is not None else {**entry.report, "found": view.found.layout}
    for name, kept in (("lattice", view.found.lattice), ("courses", view.found.courses)):
        if kept is not None:
            report[name] = {"description": str(kept), "confidence": kept.confidence}
    return replace(entry, known=view.labels, report=report)


def _search(pixels: Array, guide: Floats, given: Arguments, how: Settings, watch: Progress) -> ElementAnalysis:
    """Find the places that look like one element, and their pixels."""
    start = propose(guide, given, how, partial(watch, "propose"))
    _check(given, start, how)
    seen = _detect(guide, given, start, how, partial(watch, "search"))
    watch("separate", 0.0)
    with answering(watch, "separate", 0.0):
        parted = _separate(guide, given, start, seen, how)
    if len(parted.points) < FEWEST:
        lower = f"a threshold below {seen.threshold:.2f}, " if seen.threshold > -1 else ""
        raise InvalidInput(
            f"image: must show at least {FEWEST} elements, found {len(parted.points)}; try another box, "
            f"more rotations or scales, {lower}or give the points"
        )
    return _make_entry(pixels, given, start, seen, parted, how)


def _choose_map(material: Material, look: Callable[[Array], ElementAnalysis]) -> ElementAnalysis:
    """Analyse the colours of a material, and all its maps if the result is uncertain. Return the surer result."""
    entries: list[ElementAnalysis] = []
    trouble: InvalidInput | None = None
    for pixels in (material.base, material.guide):
        try:
            entries.append(look(pixels))
        except InvalidInput as error:
            trouble = error
        if entries and _be_sure(entries[-1]) >= SURE:
            break
    if not entries:
        assert trouble is not None
        raise trouble
    return replace(max(entries, key=_be_sure), image=as_image(material.base))


def _be_sure(entry: ElementAnalysis) -> float:
    """Return the lowest confidence of the proposals of an analysis, 0 to 1. 1 if nothing was proposed."""
    return float(min(entry.report["confidence"].values(), default=1.0))


def _repeat_channel(guide: Floats) -> Floats:
    """Return colours with two channels as three channels, by repeating the first one. Others are unchanged."""
    return np.concatenate([guide, guide[..., :1]], axis=-1) if guide.shape[-1] == 2 else guide


def _check(given: Arguments, start: Start, how: Settings) -> None:
    """Check that the arguments and the proposals do not contradict each other."""
    check_consistency(given.mask, start.background, start.box, start.layout)
    trouble = "" if given.whole is None else find_contradiction(given.whole, start.layout, how.wrap)
    if trouble:
        raise InvalidInput(f"layout: contradicts the mask: {trouble}")


def _detect(guide: Floats, given: Arguments, start: Start, how: Settings, progress: Any) -> Detections:
    """Find the places that look like the element. Given points are used instead, with similarity 1."""
    if given.points is not None:
        size = guide.shape[:2]
        pixels = np.clip(np.floor(given.points + 0.5).astype(np.intp), 0, np.array(size) - 1)
        ones = np.ones(len(pixels))
        return Detections(
            pixels, given.points, ones, np.zeros(len(pixels), np.intp), np.ones(size, np.float32), -1.0, None
        )
    return search_similar(
        guide,
        start.box.centre,
        start.box.size,
        wrap=how.wrap,
        options=how.search,
        cut=not how.literal,
        progress=progress,
    )


def _separate(guide: Floats, given: Arguments, start: Start, found: Detections, how: Settings) -> Separation:
    """Find the pixels of the elements, and correct the detected elements by their pixels."""
    mask = given.whole if given.whole is not None else _cut(guide, given, start, found, how)
    plain = Separation(found.points, found.scores, np.arange(len(found.points)), mask, "cut")
    if how.literal or not len(found.points):
        return plain
    listed = given.points is not None
    if start.layout == Layout.DISJOINT:
        own = given.shape if given.shape is not None else _mask.ellipse(start.box.size)
        certain = given.whole is not None
        agreed = reconcile(mask, found, own, how.wrap, certain=certain)
        # Keep the points of the user, and adapt only the mask.
        return replace(plain, mask=agreed.mask, made_by=agreed.made_by) if listed else agreed
    jointed = start.layout == Layout.JOINTED
    if not listed and (jointed or mask[find_nearest_pixels(found.points, mask.shape)].mean() < 0.5):
        return add_missing(plain, found.similarity, how.wrap, joints=jointed)
    return plain


def _cut(guide: Floats, given: Arguments, start: Start, found: Detections, how: Settings) -> Bools:
    """Separate the foreground from the background by their colours (section 3.3)."""
    mask = _mask.cut_foreground(
        to_lab(guide),
        np.concatenate([[start.box.centre], found.pixels]),
        start.box.size,
        np.zeros(guide.shape[:2], bool) if start.background is None else start.background,
        layout=start.layout,
        poses=np.concatenate([[[0.0, 1.0]], found.poses]),
        shape=given.shape,
        wrap=how.wrap,
        seed=how.seed,
        model=how.model,
    )
    if how.literal:
        return mask
    area = float(_mask.ellipse(start.box.size).sum())
    return _mask.tidy_mask(mask, area, net=start.layout != Layout.DISJOINT)


def _make_entry(
    pixels: Array, given: Arguments, start: Start, found: Detections, parted: Separation, how: Settings
) -> ElementAnalysis:
    """Return the analysis of a texture with its report."""
    report: dict[str, Any] = {
        "proposed": start.proposed,
        "warnings": _list_doubts(given, start, parted, how),
        "confidence": start.confidence,
        "box": [*start.box.centre, *start.box.size],
        "background": [] if start.background is None else _sample_places(start.background),
        "method": "paper" if how.literal else "default",
        "channel": found.channel,
        "threshold": found.threshold,
        "detections": len(found.points),
        "added": int((parted.detection < 0).sum()),
        "mask": "given" if given.whole is not None else parted.made_by,
        "foreground": float(parted.mask.mean()),
        "spacing": spacing(parted.points),
    }
    poses = np.concatenate([found.poses, [[0.0, 1.0]]])[parted.detection]
    return ElementAnalysis(
        pixels,
        parted.points,
        parted.mask,
        start.box.size,
        start.layout,
        parted.scores,
        directions(parted.points),
        how.wrap,
        report,
        poses[:, 0],
        poses[:, 1],
    )


def _list_doubts(given: Arguments, start: Start, parted: Separation, how: Settings) -> list[str]:
    """Return warnings about an implausible result."""
    share = parted.mask.mean()
    # Known elements may touch each other.
    said = given.whole is not None or parted.made_by == "finder"
    found = [] if said else [find_contradiction(parted.mask, start.layout, how.wrap)]
    if not LITTLE <= share <= MUCH:
        found.append(f"{share:.0%} of the image is foreground")
    return [doubt for doubt in found if doubt]


def _sample_places(marked: Bools, most: int = 64) -> list[list[int]]:
    """Return the positions of up to ``most`` marked pixels, evenly spread."""
    places: NDArray[np.intp] = np.argwhere(marked)
    return [[int(r), int(c)] for r, c in places[:: max(1, len(places) // most)]]

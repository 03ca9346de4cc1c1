"""SPLICE: the elements of one texture in the arrangement of another.

Y. Liu, J. Wang, S. Xue, X. Tong, S. B. Kang and B. Guo, "Texture splicing", Computer Graphics Forum 28(7), 2009. Its texton
is our element. The flow, in the paper's order:

1. bring B's layout to the spacing and the orientation of A's and match the points one to one (section 4.1, Eq. 4);
2. deform A so that its elements go there, and what is rigid keeps its shape (section 4.2, Eq. 5, Table 1, Figure 5);
3. draw the deformed mesh backwards: where each pixel of the output comes from (Figure 6);
4. fill the holes and refine what is not rigid by texture synthesis (section 4.3).

Elements are analysed beforehand (section 3; `texrs.elements`).

Departures, with their reasons:

- Both point sets go on beyond their pictures, by reflection at the lines where the layout goes on as it is: otherwise
  a third of the output is empty, and elements at its rim are missing.
- There are more elements than targets; those that go nowhere are erased. As printed, point sets must have equal size. What is
  erased shrinks, and the ground around it closes in: else a fifth of the output is a hole.
- Connected figures take the layout where their elements go least far, and neighbours differ in how far they go by no more
  than a share of an element: else courses are torn where a layout has none.
- Layouts grow until disjoint elements have room, and those that still collide are pushed apart: spacing alone makes chains.
- Distances are squared in Eq. 4: the best matching then has no crossings.
- Disjoint elements move whole, by whole pixels: Eq. 5 in the limit of its weights. The soft energy stretches components that
  hold two pins by dozens of pixels. The ground between them is harmonic, so nothing of it moves further than its elements, and
  so smooth that it is solved for at every other pixel.
- Eq. 5 sums over rigid pixels only, so the others have no equation and the system is singular, or, for brick walls,
  moves nothing but its pins: here they count a hundredth. Long joints, which the decoupling of Table 1 leaves free to slide,
  are tied to their neighbours by a hair.
- Elements that reflection mirrors are turned back, and those that the border cuts are left out.
- Wide holes are filled with patches of the ground; random pixels come out as noise there.
- Refinement leaves what is rigid as it is, and so whatever the warp copied whole: there is nothing to mend. In its
  place nothing comes that is not ground itself.
- Triangles between elements carry previews, and edits that list moved points: what moves then stirs its neighbours alone.

``method="paper"`` leaves out what can be left out (`texrs.papers.splice.literal`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_seed, as_size
from texrs._progress import stage
from texrs._typing import Array, Bools, Progress
from texrs.elements import Elements, Layout
from texrs.errors import InvalidInput
from texrs.layouts import spacing
from texrs.papers.splice.backward import Field, Warped, drawn, previewed, scattered
from texrs.papers.splice.edit import as_steps
from texrs.papers.splice.entry import as_elements
from texrs.papers.splice.layout import (
    Match,
    apart,
    eased,
    edited_match,
    matched,
    snapped,
    told,
    trimmed,
    void_of,
    whole_shifts,
)
from texrs.papers.splice.literal import literal_field, literal_fill, literal_match
from texrs.papers.splice.pictures import Stages
from texrs.papers.splice.refine import Draft, fill, refined_places
from texrs.papers.splice.source import parts_of
from texrs.papers.splice.warp import STEP, carried, coarseness, stretched
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis

__all__ = ["self_splice", "splice"]

Method: TypeAlias = Literal["paper", "preview"] | None
Edit: TypeAlias = str | Mapping[str, Any] | Sequence[Mapping[str, Any]]


def splice(
    a: Elements | Array,
    b: Elements | Array,
    size: int | Sequence[int] | None = None,
    *,
    seed: int = 0,
    method: Method = None,
    align: bool = True,
    snap_rows: bool = False,
    refine: bool = True,
    progress: Progress | None = None,
) -> Synthesis:
    """Arrange the elements of one texture as those of another are.

    Parameters
    ----------
    a : Elements, or (H, W) or (H, W, C) array
        The texture whose elements are shown; a picture is analysed by `texrs.elements.analyse`.
    b : Elements, or array
        The texture whose layout they take.
    size : int or (rows, columns), optional
        Size of the result, in pixels; that of ``a`` by default.
    seed : int
        Chooses what fills holes, and the noise of the refinement.
    method : {None, "paper", "preview"}
        "paper": the algorithm as printed, with only its misprints repaired. "preview": triangles between the elements,
        drawn where these go; nothing is kept rigid or filled.
    align : bool
        Whether to turn the layout so that lines of its points agree with those of ``a``.
    snap_rows : bool
        Whether to bring targets of about one row to one row: for walls, whose long joints then stay straight.
    refine : bool
        Whether to refine what is not rigid.
    progress : callable, optional
        Called as ``progress(stage, share)``, with the share of the stage that is done; raising stops the work.

    Returns
    -------
    Synthesis
        The picture; a source map of whole pixels of ``a``, whose label is the target (counted from 1, as in the report)
        that a rigid pixel belongs to, or 0; pictures of the stages, drawn when they are looked at; and a report.

    Raises
    ------
    InvalidInput
        Entries or options that cannot be spliced; the message says why.

    References
    ----------
    .. [1] Y. Liu et al., "Texture splicing", Computer Graphics Forum 28(7), 2009. :doi:`10.1111/j.1467-8659.2009.01569.x`

    Examples
    --------
    >>> import texrs
    >>> from texrs.elements import Elements, Layout
    >>> buttons = Elements.of_sample(texrs.samples.dots((128, 128)))
    >>> stones = Elements.of_sample(texrs.samples.pebbles((128, 128)))
    >>> result = texrs.splice(buttons, stones, seed=1)
    >>> result.image.shape, bool((result.source.render(buttons.image) == result.image).all())
    ((128, 128, 3), True)

    """
    if method not in (None, "paper", "preview"):
        raise InvalidInput(f"method: allowed are None, 'paper' and 'preview', got {method!r}")
    watch = progress or (lambda stage, share: None)
    mine, theirs = as_elements(a, "a", watch), as_elements(b, "b", watch)
    shape = as_size(size if size is not None else mine.mask.shape, minimum=16)
    number = as_seed(seed)
    watch("match", 0.0)
    if method == "paper":
        found = literal_match(mine, theirs, (shape[0], shape[1]), align=bool(align))
    else:
        found = matched(mine, theirs, (shape[0], shape[1]), align=bool(align))
    if method != "paper" and mine.layout == Layout.DISJOINT:
        found = apart(mine, found)
    elif snap_rows:
        found = replace(found, targets=snapped(found.targets, 0.25 * spacing(found.targets)))
    if method != "paper" and mine.layout != Layout.DISJOINT:
        found = eased(mine, found)
    found = trimmed(mine, found, (shape[0], shape[1]))
    watch("match", 1.0)
    return made(
        mine, found, (shape[0], shape[1]), number, method=method, refined=bool(refine), watch=watch, theirs=theirs
    )


def self_splice(
    a: Elements | Array,
    edit: Edit,
    *,
    seed: int = 0,
    method: Literal["preview"] | None = None,
    refine: bool = True,
    progress: Progress | None = None,
) -> Synthesis:
    """Edit the layout of a texture's own elements (Figure 9).

    Parameters
    ----------
    a : Elements, or (H, W) or (H, W, C) array
        The texture; a picture is analysed by `texrs.elements.analyse`.
    edit : str, mapping, or sequence of mappings
        What is done, step by step, in plain JSON types: ``{"op": "scale", "factor": 1.2}`` or ``[1.2, 1]`` (the layout, not the
        elements), ``{"op": "shift", "by": [4, 0]}``, ``{"op": "rows", "by": 6}`` (every other row to the right, those between to
        the left), ``{"op": "randomise", "amount": 0.25, "least": 0.7}`` (Gaussian, in spacings; the share of the least usual
        distance that is kept), ``{"op": "regularise", "amount": 1}`` (to the lattice that fits best), ``{"op": "move",
        "element": 3, "by": [0, 8]}`` or ``"to"``, ``{"op": "remove", "element": 3}``, ``{"op": "points", "points": [[row, column],
        ...]}``. A name alone is a step with its defaults. The report's "edit" replays.
    seed : int
        Chooses random steps, what fills holes, and the noise of the refinement.
    method : {None, "preview"}
        "preview": triangles between the elements, drawn where these go; nothing is kept rigid or filled.
    refine : bool
        Whether to refine what is deformed.
    progress : callable, optional
        Called as ``progress(stage, share)``, with the share of the stage that is done; raising stops the work.

    Returns
    -------
    Synthesis
        As of `splice`. Where nothing is moved the picture is the texture, exactly.

    Raises
    ------
    InvalidInput
        A step that is not known, lacks something, or names an element that is not there.

    Examples
    --------
    >>> import texrs
    >>> from texrs.elements import Elements, Layout
    >>> entry = Elements.of_sample(texrs.samples.dots((96, 96)))
    >>> same = texrs.self_splice(entry, {"op": "move", "element": 0, "by": [0, 0]})
    >>> bool((same.image == entry.image).all())
    True
    >>> texrs.self_splice(entry, "randomise", seed=5).report["edit"]
    [{'op': 'randomise', 'seed': 5}]

    """
    if method not in (None, "preview"):
        raise InvalidInput(f"method: allowed are None and 'preview', got {method!r}")
    watch = progress or (lambda stage, share: None)
    mine, number = as_elements(a, "a", watch), as_seed(seed)
    steps = as_steps(edit, number)
    found, listed = edited_match(mine, steps)
    size = (mine.mask.shape[0], mine.mask.shape[1])
    result = made(
        mine, found, size, number, method=method, refined=bool(refine), watch=watch, theirs=None, listed=listed
    )
    return replace(result, report={**result.report, "edit": steps})


def made(
    a: Elements,
    found: Match,
    size: tuple[int, int],
    seed: int,
    *,
    method: Method,
    refined: bool,
    watch: Progress,
    theirs: Elements | None,
    listed: bool = False,
) -> Synthesis:
    """Make the picture of a matching: sections 4.2 and 4.3."""
    if method == "preview":
        warped = previewed(found, size)
    elif method == "paper":
        warped = drawn(Field(*literal_field(a, found)), size, stage(watch, "warp"))
    elif listed and a.layout == Layout.DISJOINT:
        warped = scattered(found, size)
    else:
        watch("deform", 0.0)
        field = deform(a, found)
        watch("deform", 1.0)
        warped = drawn(field, size, stage(watch, "warp"))
    draft, label = drafted(a, found, warped, whole=method is None)
    full, places = draft, draft.places
    if method == "paper":
        full = literal_fill(draft, seed)
        places = refined_places(a.image, a.wrap, full, seed, watch) if refined else full.places
    elif method != "preview":
        full = fill(a.image, draft, spacing(np.asarray(a.points, np.float64)), seed, watch)
        places = refined_places(a.image, a.wrap, full, seed, watch) if refined else full.places
    shape = (a.mask.shape[0], a.mask.shape[1])
    frame = frames_of(full.mirrored)
    source = SourceMap(places.astype(np.float32), np.zeros(size, np.uint16), label, frame, (shape,))
    image = source.render(a.image, interpolation="nearest")
    step = STEP if a.layout == Layout.DISJOINT else coarseness(found.source.mask.shape)
    report: dict[str, Any] = {
        "method": method or "default",
        "seed": seed,
        "size": list(size),
        "layout": a.layout.value,
        **found.report(),
        "holes": float(1 - warped.known.mean()),
        "triangles": warped.triangles,
        "flipped": warped.flipped / max(warped.triangles, 1),
        "flipped_rigid": warped.flipped_rigid / max(warped.triangles, 1),
        "system": [-(-n // step) for n in found.source.mask.shape],
        "matches": matches(a, found),
    }
    watch("done", 1.0)
    return Synthesis(image, source, Stages(a, theirs, found, warped.target, draft, full, image), report)


def frames_of(mirrored: Bools) -> NDArray[np.float32] | None:
    """Return the Jacobians of pixels, some of which show the texture mirrored; none where none does."""
    if not mirrored.any():
        return None
    frame = np.zeros((*mirrored.shape, 2), np.float32)
    for axis in range(2):
        frame[..., axis, axis] = np.where(mirrored[..., axis], -1, 1)
    return frame


# --- the deformation: section 4.2 ------------------------------------------------------------------------------------


def deform(a: Elements, found: Match) -> Field:
    """Move every pixel of the texture, as its layout says."""
    source = found.source
    shape, origin = source.mask.shape, np.array(source.origin)
    if a.layout == Layout.DISJOINT:
        delta = carried(*told(found))
        # Ground beside what shrinks is drawn out over the place of that: a pixel of it less is a hole of many.
        void = void_of(source, found.of, grown=int(source.own > 0))
        return Field(moved(delta, source.origin), source.instance > 0, void)
    rigid = source.mask if a.layout == Layout.CONNECTED else ~source.mask
    pins = np.rint(source.points[found.of]).astype(np.intp) - origin
    inside = ((pins >= 0) & (pins < np.array(shape))).all(axis=1)
    delta = stretched(rigid, pins[inside], found.shift[inside], upright=a.layout == Layout.JOINTED)
    return Field(moved(delta, source.origin), rigid, np.zeros(shape, bool))


def moved(delta: NDArray[np.float64], origin: tuple[int, int]) -> NDArray[np.float64]:
    """Turn displacements, in place, into where pixels go: the first one lies at the origin."""
    delta[..., 0] += np.arange(origin[0], origin[0] + delta.shape[0])[:, None]
    delta[..., 1] += np.arange(origin[1], origin[1] + delta.shape[1])
    return delta


# --- what of it stays ------------------------------------------------------------------------------------------------


def drafted(a: Elements, found: Match, warped: Warped, *, whole: bool) -> tuple[Draft, NDArray[np.uint32]]:
    """Read the warp as pixels of the texture: T_AB0, what of it stays, and the target of each pixel that moved ``whole``."""
    source, known = found.source, warped.known
    y, x = warped.there[..., 0], warped.there[..., 1]
    there = y * source.mask.shape[1] + x
    places, mirrored = (v.reshape(-1, 2).take(there, axis=0) for v in (source.table, source.mirrored))
    stays = copied(places, mirrored, known)
    step = found.shift[0]
    if source.own and (found.shift == step).all():
        # The picture is moved as a whole: its own pixels stay, whatever comes beside them.
        rows, columns = np.ogrid[: known.shape[0], : known.shape[1]]
        stays |= known & (places[..., 0] == rows - step[0]) & (places[..., 1] == columns - step[1])
    label = np.zeros(known.shape, np.uint32)
    if whole and a.layout == Layout.DISJOINT:
        goal = np.zeros(len(source.points) + 1, np.uint32)
        goal[found.of + 1] = np.arange(1, len(found.of) + 1)
        number = source.instance.take(there)
        label = np.where(known, goal.take(number), 0).astype(np.uint32)
        # Rims that the mesh draws out are no elements: what is rigid lies exactly where its element goes.
        shift = np.zeros((2, len(goal)), np.intp)
        shift[:, 1:] = whole_shifts(found).T
        rows, columns = np.ogrid[: known.shape[0], : known.shape[1]]
        here = y + shift[0].take(number) == rows - source.origin[0]
        here &= x + shift[1].take(number) == columns - source.origin[1]
        drawn_out = (number > 0) & ~here
        label[drawn_out] = 0
        known = known & ~drawn_out
        kinds = ((parts_of(a).region > 0) | a.mask).astype(np.uint8)
        return Draft(places, known, stays | (label > 0), kinds, np.zeros(known.shape, np.uint8), mirrored), label
    kinds = np.asarray(~a.mask if a.layout == Layout.JOINTED else a.mask).astype(np.uint8)
    wanted = np.where(known, kinds.take(places[..., 0] * kinds.shape[1] + places[..., 1]), 255).astype(np.uint8)
    return Draft(places, known, stays | (known & (wanted == 1)), kinds, wanted, mirrored), label


def copied(places: NDArray[np.int32], mirrored: Bools, known: Bools) -> Bools:
    """Mark what the warp copies whole: there is nothing to refine."""
    from scipy.ndimage import maximum_filter

    broken = np.zeros(known.shape, bool)
    halves = (slice(None, -1), slice(1, None))
    for axis in range(2):
        along, across = (np.diff(places[..., a], axis=axis) for a in (axis, 1 - axis))
        there, turned, b = (np.moveaxis(v, axis, 0) for v in (known, mirrored[..., axis], broken))
        both, one = (f(*(np.moveaxis(turned[h], 0, axis) for h in halves)) for f in (np.logical_and, np.logical_or))
        joined = (across == 0) & (((along == 1) & ~both) | ((along == -1) & one))
        apart = ~np.moveaxis(joined, axis, 0) & there[halves[0]] & there[halves[1]]
        for half in halves:
            b[half] |= apart
    rough = maximum_filter(broken.astype(np.uint8), 3) > 0
    return np.asarray(known & ~rough)


def matches(a: Elements, found: Match) -> list[dict[str, Any]]:
    """Return which element goes where."""
    points = parts_of(a).points if a.layout == Layout.DISJOINT else np.asarray(a.points, float)
    return [
        {
            "target": [round(float(v), 3) for v in goal],
            "element": int(element),
            "source": [round(float(v), 3) for v in points[element]],
        }
        for goal, element in zip(found.targets, found.source.of[found.of], strict=True)
    ]

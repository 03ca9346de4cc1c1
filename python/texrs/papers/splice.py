"""SPLICE: the texels of one texture in the arrangement of another.

Y. Liu, J. Wang, S. Xue, X. Tong, S. B. Kang and B. Guo, "Texture splicing", Computer Graphics Forum 28(7), 2009. Its texton
is our texel. The flow, in the paper's order:

1. bring B's layout to the spacing and the orientation of A's and match the points one to one (section 4.1, Eq. 4);
2. deform A so that its texels go there, and what is rigid keeps its shape (section 4.2, Eq. 5, Table 1, Figure 5);
3. draw the deformed mesh backwards: where each pixel of the output comes from (Figure 6);
4. fill the holes and refine what is not rigid by texture synthesis (section 4.3).

Texels are analysed beforehand (section 3; `texrs.texels`).

Departures, with their reasons:

- Both point sets go on beyond their pictures, by reflection at the lines where the layout goes on as it is: otherwise
  a third of the output is empty, and texels at its rim are missing.
- There are more texels than targets; those that go nowhere are erased. As printed, point sets must have equal size.
- Layouts grow until disjoint texels have room, and those that still collide are pushed apart: spacing alone makes chains.
- Distances are squared in Eq. 4: the best matching then has no crossings.
- Disjoint texels move whole, by whole pixels: Eq. 5 in the limit of its weights. The soft energy stretches components that
  hold two pins by dozens of pixels. The ground between them is harmonic, so nothing of it moves further than its texels.
- Eq. 5 sums over rigid pixels only, so the others have no equation and the system is singular, or, for brick walls,
  moves nothing but its pins: here they count a hundredth.
- Texels that reflection mirrors are turned back, and those that the border cuts are left out.
- Wide holes are filled with patches of the ground; random pixels come out as noise there.
- Refinement leaves rigid texels as they are, and elsewhere lets what is rigid come only from what is.

``method="paper"`` leaves out what can be left out (`texrs.papers._splice_literal`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_seed, as_size
from texrs._progress import stage
from texrs._typing import Array, Bools, Progress
from texrs.errors import InvalidInput
from texrs.kernels.warp import Warp, mesh
from texrs.papers._splice_entry import as_texels
from texrs.papers._splice_layout import Match, apart, matched, snapped, void_of
from texrs.papers._splice_pictures import Stages
from texrs.papers._splice_refine import Draft, fill, refine
from texrs.papers._splice_source import Extended
from texrs.papers._splice_warp import carried, stretched
from texrs.report import Synthesis
from texrs.source_map import SourceMap
from texrs.texels import Texels

__all__ = ["splice"]

Method: TypeAlias = Literal["paper", "preview"] | None


def splice(
    a: Texels | Array,
    b: Texels | Array,
    size: int | Sequence[int] | None = None,
    *,
    seed: int = 0,
    method: Method = None,
    align: bool = True,
    snap_rows: bool = False,
    refine: bool = True,
    progress: Progress | None = None,
) -> Synthesis:
    """Arrange the texels of one texture as those of another are.

    Parameters
    ----------
    a : Texels, or (H, W) or (H, W, C) array
        The texture whose texels are shown; a picture is analysed by `texrs.texels.analyse`.
    b : Texels, or array
        The texture whose layout they take.
    size : int or (rows, columns), optional
        Size of the result, in pixels; that of ``a`` by default.
    seed : int
        Chooses what fills holes, and the noise of the refinement.
    method : {None, "paper", "preview"}
        "paper": the algorithm as printed, with only its misprints repaired. "preview": triangles between the texels,
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
    >>> import numpy as np
    >>> import texrs
    >>> from texrs.texels import Texels
    >>> def entry(sample, side):
    ...     count = len(sample.centres)
    ...     return Texels(sample.image, sample.centres, sample.mask, (side, side), sample.tag, np.ones(count))
    >>> buttons = entry(texrs.samples.dots((128, 128)), 21)
    >>> stones = entry(texrs.samples.pebbles((128, 128)), 21)
    >>> result = texrs.splice(buttons, stones, seed=1)
    >>> result.image.shape, bool((result.source.render(buttons.image) == result.image).all())
    ((128, 128, 3), True)

    """
    if method not in (None, "paper", "preview"):
        raise InvalidInput(f"method: allowed are None, 'paper' and 'preview', got {method!r}")
    watch = progress or (lambda stage, share: None)
    mine, theirs = as_texels(a, "a", watch), as_texels(b, "b", watch)
    shape = as_size(size if size is not None else mine.mask.shape, minimum=16)
    watch("match", 0.0)
    found = matched(mine, theirs, (shape[0], shape[1]), align=bool(align))
    if mine.tag == "F=d":
        found = apart(mine, found)
    elif snap_rows:
        found = Match(snapped(found.targets, 0.25 * found.scale), *(getattr(found, f) for f in _REST))
    watch("match", 1.0)
    return made(mine, found, (shape[0], shape[1]), as_seed(seed), refined=bool(refine), watch=watch, theirs=theirs)


_REST = ("source", "of", "scale", "angle", "gain", "cost")


@dataclass(frozen=True, slots=True, eq=False)
class Deformed:
    """The texture deformed: where its pixels go, what is rigid, and what is not drawn."""

    target: NDArray[np.float64]
    rigid: Bools
    void: Bools
    moved: Match


def made(
    a: Texels, found: Match, size: tuple[int, int], seed: int, *, refined: bool, watch: Progress, theirs: Texels | None
) -> Synthesis:
    """Make the picture of a matching: sections 4.2 and 4.3."""
    watch("deform", 0.0)
    deformed = deform(a, found)
    watch("deform", 1.0)
    warp = mesh(
        deformed.target, deformed.rigid, void=deformed.void, size=size, progress=stage(watch, "warp")
    )
    draft, label = drafted(a, deformed, warp)
    full = fill(a.image, draft, found.scale, seed, watch)
    places = full.places
    if refined:
        places = refine(a.image, a.wrap, full, seed, watch)
    source = SourceMap(
        places.astype(np.float32), np.zeros(size, np.uint16), label, None, ((a.mask.shape[0], a.mask.shape[1]),)
    )
    image = source.render(a.image, interpolation="nearest")
    holes = warp.source.label == 0
    report: dict[str, Any] = {
        "method": "splice",
        "seed": seed,
        "size": list(size),
        "tag": a.tag,
        **deformed.moved.report(),
        "holes": float(holes.mean()),
        "triangles": warp.triangles,
        "flipped": warp.flipped / max(warp.triangles, 1),
        "flipped_rigid": warp.flipped_heavy / max(warp.triangles, 1),
        "system": list(deformed.rigid.shape),
        "matches": matches(a, deformed.moved),
    }
    watch("done", 1.0)
    stages = Stages(a, theirs, deformed.moved, deformed.target, draft, full, image)
    return Synthesis(image, source, stages, report)


def deform(a: Texels, found: Match) -> Deformed:
    """Move every pixel of the texture: section 4.2, as its tag says."""
    source = found.source
    origin = np.array(source.origin)
    shape = source.mask.shape
    grid = np.moveaxis(np.indices(shape), 0, -1) + origin
    if a.tag == "F=d":
        shift, moved = whole_shifts(found)
        delta = carried(source.instance, shift)
        return Deformed(grid + delta, source.instance > 0, void_of(source, found.of), moved)
    rigid = source.mask if a.tag == "F=c" else ~source.mask
    pins = np.clip(np.rint(source.points[found.of]).astype(np.intp) - origin, 0, np.array(shape) - 1)
    delta = stretched(rigid, pins, found.shift, upright=a.tag == "B=c")
    return Deformed(grid + delta, rigid, np.zeros(shape, bool), found)


def whole_shifts(found: Match) -> tuple[NDArray[np.float64], Match]:
    """Give the whole pixels that every texel moves by; those that go nowhere go along with the ones around them."""
    from scipy.spatial import cKDTree

    source = found.source
    shift = np.zeros((len(source.points), 2))
    shift[found.of] = np.rint(found.shift)
    idle = np.ones(len(shift), bool)
    idle[found.of] = False
    if idle.any():
        count = min(4, len(found.of))
        far, near = cKDTree(source.points[found.of]).query(source.points[idle], k=[*range(1, count + 1)])
        weight = 1 / (far**2 + 1e-6)
        mean = (weight[..., None] * shift[found.of][near]).sum(axis=1) / weight.sum(axis=1)[:, None]
        shift[idle] = np.rint(mean)
    return shift, found


def drafted(a: Texels, deformed: Deformed, warp: Warp) -> tuple[Draft, NDArray[np.uint32]]:
    """Read the warp as pixels of the texture: T_AB0, what of it is rigid, and the target of each rigid pixel."""
    source: Extended = deformed.moved.source
    known = warp.source.label > 0
    limits = np.array(source.mask.shape) - 1
    there = np.clip(np.rint(warp.source.coordinates).astype(np.intp), 0, limits)
    y, x = there[..., 0], there[..., 1]
    places = source.table[y, x]
    label = np.zeros(known.shape, np.uint32)
    if a.tag == "F=d":
        goal = np.zeros(len(source.points) + 1, np.uint32)
        goal[deformed.moved.of + 1] = np.arange(1, len(deformed.moved.of) + 1)
        label = np.where(known, goal[source.instance[y, x]], 0).astype(np.uint32)
        kinds = ground_kinds(a)
        return Draft(places, known, label > 0, kinds, np.zeros(known.shape, np.uint8), source.mirrored[y, x]), label
    rigid = np.asarray(a.mask if a.tag == "F=c" else ~a.mask)
    kinds = rigid.astype(np.uint8)
    wanted = np.where(known, kinds[places[..., 0], places[..., 1]], 255).astype(np.uint8)
    return Draft(places, known, known & (wanted == 1), kinds, wanted, source.mirrored[y, x]), label


def ground_kinds(a: Texels) -> NDArray[np.uint8]:
    """Give 0 for the ground of disjoint texels and 1 for these and their rim."""
    from texrs.papers._splice_source import parts_of

    return ((parts_of(a).region > 0) | a.mask).astype(np.uint8)


def matches(a: Texels, found: Match) -> list[dict[str, Any]]:
    """Say which texel goes where."""
    from texrs.papers._splice_source import parts_of

    points = parts_of(a).points if a.tag == "F=d" else np.asarray(a.points, float)
    return [
        {
            "target": [round(float(v), 3) for v in goal],
            "texel": int(texel),
            "source": [round(float(v), 3) for v in points[texel]],
        }
        for goal, texel in zip(found.targets, found.source.of[found.of], strict=True)
    ]

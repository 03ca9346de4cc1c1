"""DESIGN: many natural textures from one example.

J. Shen, X. Jin, X. Mao and J. Feng, "Completion-based texture design using deformation", The Visual Computer 22,
2006. The flow, in the paper's order:

1. segment the exemplar into layers and child layers (section 3.2);
2. deform each child by a chaotic choice of translations, rotations, mirrors and scales (section 3.3, Eq. 1 and 2);
3. stitch the deformed layers by graph cut (section 3.4, Eq. 3) and mark the holes (Eq. 4);
4. fill the holes by example (section 3.4);
5. repeat for several tiles and stitch them into the large texture (section 3.1, step 4);
6. correct its colours so that the seams disappear (section 3.6, Eq. 5 and 6).

Departures, with their reasons:

- Children are elements, not colour layers: a layer moved as a whole tears the elements that its border crosses.
- The literal generator uses one number for the operation and for its extent, so it never enlarges and often does
  nothing; here each operation takes three chaotic values. Each child has its own start, after a burn-in.
- An element that the border of the exemplar cuts only slides along that border; elements keep out of each other's
  cores.
- In a cut, the core of an element is tied to it and a ring of its surroundings is offered with it: otherwise the
  minimum cut makes a wholly overlapped element vanish.
- Where patches of the large texture meet, cuts are dearer inside elements, so seams run between them.
- Where elements of one shape lie in a heap they take each other's places, turned and scaled to the shape that they fill; in a
  heap of leaves most rest. If all moved there would be nothing left to lie on. An element brings only background along, not
  pieces of its neighbours.
- Holes are filled with background alone where the example has enough of it.
- Nothing is mirrored along an axis on which the example plainly differs from its mirror image (light from one side, leaves
  that hang), nor turned where the example has directions of its own (bark, brickwork); where it repeats on a lattice, elements
  move from place to place of the lattice and nowhere else.
- A cyclic texture (section 3.5) is stitched on the torus from the start: patches are chosen to fit both sides of the
  wrap, where the paper folds a finished picture that was never chosen to fit.
- The differences that the colours are corrected to are those of the sources on both sides of a seam, where the paper
  takes those of the picture itself; some weight on the values keeps the colours from drifting.

``method="paper"`` leaves the departures out (`texrs.papers.design.literal`), but for the torus.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any, Literal, TypeAlias, overload

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_float, as_image, as_int, as_seed, as_size, as_wrap, check_memory, guidance
from texrs._typing import Array, Floats, Progress
from texrs.blending import SCREENING, visibility
from texrs.blending import blend as blended
from texrs.errors import InvalidInput
from texrs.exemplar.segmentation import Children, segment
from texrs.exemplar.symmetry import Flip, flip_coordinates, flip_frame
from texrs.kernels.complete import complete
from texrs.kernels.gather import gather
from texrs.papers.design.deformation import Canvas, deform
from texrs.papers.design.literal import Layered, start, stitch_layers
from texrs.papers.design.pictures import outlined
from texrs.papers.design.source import Source, as_shares, check_moves, check_sources, to_unit_together
from texrs.quilting import Picture, quilt
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis

__all__ = ["design"]

MINIMUM_SIDE = 16
"""An exemplar with a shorter side holds no texture to speak of."""


Exemplars: TypeAlias = Array | Sequence[Array]
Size: TypeAlias = int | Sequence[int] | None
Method: TypeAlias = Literal["paper"] | None


@overload
def design(exemplar: Exemplars, size: Size = ..., *, variants: None = ..., **options: Any) -> Synthesis: ...
@overload
def design(exemplar: Exemplars, size: Size = ..., *, variants: int, **options: Any) -> list[Synthesis]: ...
def design(  # type: ignore[misc]  # the overloads leave the options to this signature
    exemplar: Exemplars,
    size: Size = None,
    *,
    seed: int = 0,
    variants: int | None = None,
    wrap: bool | Sequence[bool] = (True, True),
    weights: object = None,
    layers: int | None = None,
    children: Children = "auto",
    labels: NDArray[np.integer] | Sequence[NDArray[np.integer]] | None = None,
    tiles: int = 4,
    operations: int = 2,
    translate: float = 0.12,
    rotate: float | None = None,
    scale: Sequence[float] = (0.8, 1.2),
    mirror: bool = True,
    x0: float | None = None,
    chaos: float = 2.0,
    patch: int | None = None,
    blend: float | None = SCREENING,
    method: Method = None,
    progress: Progress | None = None,
    keep: Callable[[Synthesis], object] | None = None,
) -> Synthesis | list[Synthesis]:
    """Design a large texture from one example.

    Parameters
    ----------
    exemplar : (H, W) or (H, W, C) array, or a sequence of them
        The example, any real dtype, at least 16 pixels a side. Several, of one dtype and one number of channels, are
        mixed.
    size : int or (rows, columns), optional
        Size of the result, in pixels; twice the exemplar by default.
    seed : int
        Chooses the texture: the same exemplar, options, seed and version give the same bytes.
    variants : int, optional
        Make so many different textures, with the seeds ``seed``, ``seed + 1``, ...; the result is a list.
    wrap : bool or (rows, columns)
        Axes along which the result repeats without a seam.
    weights : (n,), (rows, columns) of int, or (rows, columns, n) array, optional
        Shares of n exemplars in the result, or which one is where, or their shares everywhere; equal by default.
    layers, children, labels
        How the exemplar is segmented: see `texrs.exemplar.segmentation.segment`.
    tiles : int
        Deformed variants of the exemplar that the result is stitched from, 1 to 64.
    operations : int
        Deformations that are combined on each element, 0 to 8 (section 3.3).
    translate : float
        Longest translation, as a share of the exemplar's shorter side, 0 to 0.5. In a heap and on a lattice elements go as
        far as the next place that fits, unless this is 0.
    rotate : float, optional
        Largest rotation in degrees, 0 to 180; 0 for textures lit from one side or with letters. By default 60, but 0
        where the example has directions of its own (bark, brickwork), no separate elements, or a lattice.
    scale : (float, float)
        Least and largest scaling, within 0.5 to 2.
    mirror : bool
        Whether elements, backgrounds and patches may be mirrored; False for lettered textures. Where the example plainly
        differs from its mirror image, as lit from one side, it is not mirrored along that axis in any case.
    x0 : float, optional
        Start of the chaotic sequence (Eq. 2), within (-1, 1); the seed draws one for each element by default.
    chaos : float
        The lambda of Eq. 2, 0 to 2; below about 1.4 the sequence is periodic.
    patch : int, optional
        Side of the patches that fill holes, in pixels; a sixth of the shorter side, 12 to 32, by default.
    blend : float, optional
        Weight of the values when colours are corrected so that seams disappear (section 3.6): the smaller, the wider
        the correction. None or 0: no correction. See `texrs.blending.blend`, which corrects other maps in the same way.
    method : {None, "paper"}
        "paper": the algorithm as printed, with only its misprints repaired, for comparison. Whole colour layers are moved,
        once each, by the literal generator, and stitched at the plain cost; holes take the best match; colours are
        corrected without weight on the values. ``children``, ``operations``, ``translate``, ``rotate``, ``scale`` and
        ``mirror`` play no part, nor does the amount of ``blend``.
    progress : callable, optional
        Called as ``progress(stage, share)``, with the share of the stage that is done; raising stops the work.
    keep : callable, optional
        Called with each result as soon as it is made, so that what is made of several is not lost if the work stops.

    Returns
    -------
    Synthesis, or a list of them with ``variants``
        The image in the exemplar's dtype and channels, its source map, pictures of the stages, and the log of
        operations.

    Raises
    ------
    InvalidInput
        An argument of the wrong type or out of range; a start that the chaotic sequence does not leave.
    LimitExceeded
        A size of more than 2^28 pixels, or that needs more memory than the machine has.

    Notes
    -----
    For each pixel of the result 18 bytes are needed, or 14 and twice those of a pixel of the image where that is more,
    and 0.5 GB beside it: 5.9 GB for 16384 x 16384 pixels of 8-bit RGB. Each further variant adds 14 bytes a pixel and
    twice those of the image; ``method="paper"`` takes 24 more, a map of ``weights`` 8 for each exemplar.

    References
    ----------
    .. [1] J. Shen, X. Jin, X. Mao, J. Feng, "Completion-based texture design using deformation", The Visual Computer
       22, 2006. :doi:`10.1007/s00371-006-0040-9`

    Examples
    --------
    >>> import texrs
    >>> pebbles = texrs.samples.pebbles((96, 96)).image
    >>> result = texrs.design(pebbles, (128, 160), seed=3)
    >>> result.image.shape, result.image.dtype
    ((128, 160, 3), dtype('uint8'))
    >>> bool((result.source.render(pebbles) == result.stages["composite"]).all())
    True

    """
    several: list[Any] = list(exemplar) if isinstance(exemplar, list | tuple) else [exemplar]
    pixels = [as_image(e, "exemplar", minimum=MINIMUM_SIDE) for e in several]
    check_sources(pixels, labels)
    shape = as_size(size if size is not None else tuple(2 * n for n in pixels[0].shape[:2]), minimum=MINIMUM_SIDE)
    seed, cyclic, count = as_seed(seed), as_wrap(wrap), as_int(tiles, "tiles", 1, 64)
    shares = as_shares(weights, len(pixels), shape)
    screening = as_float(0.0 if blend is None else blend, "blend", 0, 1e6)
    moves = check_moves(operations, translate, 0.0 if rotate is None else rotate, scale, mirror, x0, chaos)
    side = None if patch is None else as_int(patch, "patch", 4, min(min(p.shape[:2]) for p in pixels))
    if method not in (None, "paper"):
        raise InvalidInput(f"method: None or 'paper' is allowed, got {method!r}")
    paper = method == "paper"
    total = 1 if variants is None else as_int(variants, "variants", 1, 4096)
    check_memory(memory(shape, pixels[0], total, shares, paper=paper))
    watch = progress or (lambda stage, share: None)

    watch("segment", 0.0)
    unit = to_unit_together(pixels)
    sources = []
    for number, picture in enumerate(unit):
        marked: Any = labels[number] if isinstance(labels, list | tuple) else labels
        done = partial(_part, watch, number, len(pixels))
        kind: Children = "none" if paper else children
        parts = segment(picture, layers=layers, children=kind, labels=marked, progress=done)
        automatic = rotate is None
        sources.append(Source.of(guidance(picture), parts, moves, automatic=automatic, side=side, paper=paper))
        watch("segment", (number + 1) / len(pixels))
    made = []
    for k in range(total):
        made.append(one(several, sources, shape, cyclic, shares, count, screening, (seed + k) % 2**64, watch))
        if keep is not None:
            keep(made[-1])
    watch("done", 1.0)
    return made[0] if variants is None else made


def _part(watch: Progress, number: int, count: int, stage: str, share: float) -> None:
    """Report the share of one of several alike."""
    watch(stage, (number + share) / count)


SPARE = 500_000_000
"""Bytes that do not grow with the result."""


def memory(size: tuple[int, ...], exemplar: Array, variants: int, shares: NDArray[np.float64], *, paper: bool) -> int:
    """Return the bytes that textures take: the source map is 14 a pixel, 18 while it is made; the picture is kept twice."""
    kept = 14 + 2 * exemplar.shape[-1] * exemplar.itemsize
    return int(math.prod(size) * (max(18, kept) + 24 * paper + (variants - 1) * kept) + shares.nbytes + SPARE)


def one(
    exemplars: list[Array],
    sources: Sequence[Source],
    size: tuple[int, ...],
    wrap: tuple[bool, ...],
    shares: NDArray[np.float64],
    tiles: int,
    screening: float,
    seed: int,
    watch: Progress,
) -> Synthesis:
    """Make one texture from analysed exemplars: the paper's steps 2 to 4, and section 3.6."""
    shapes = tuple(s.guide.shape[:2] for s in sources)
    pictures = []
    for number in range(tiles * len(sources)):
        watch("deform and complete", number / (tiles * len(sources)))
        which = number % len(sources)
        pictures.append(variant(sources[which], shapes, which, seed, number // len(sources)))
    composite = large(sources, pictures, size, wrap, shares, seed, partial(watch, "stitch"))
    picture = image = composite.render(exemplars)
    before = after = visibility(composite, exemplars, picture, wrap=wrap)
    if screening:
        free = sources[0].paper
        image = blended(
            composite,
            exemplars,
            wrap=False if free else wrap,
            screening=0.0 if free else screening,
            progress=watch,
        )
        after = visibility(composite, exemplars, image, wrap=wrap)
    segmented = outlined(sources[0].parts.elements, sources[0].guide)
    stages = {"segmentation": segmented, **pictures[0].stages, "composite": picture}
    report: dict[str, Any] = {
        "method": "paper" if sources[0].paper else "default",
        "seed": seed,
        "size": list(size),
        "wrap": list(wrap),
        "elements": sum(s.parts.count for s in sources),
        "children": sources[0].parts.children,
        "children_reason": sources[0].parts.reason,
        "rotate": sources[0].moves.rotate,
        "shares": [int(np.count_nonzero(composite.exemplar == which)) for which in range(len(sources))],
        "holes": [v.holes for v in pictures],
        "blend": screening,
        "seams": {"before": asdict(before), "after": asdict(after)},
        "operations": [v.log for v in pictures],
    }
    return Synthesis(image, composite, stages, report)


# --- one variant: sections 3.3 and 3.4 -------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class Variant:
    """A deformed and completed texture of the exemplar's size."""

    source: SourceMap
    colours: Floats
    holes: float
    log: list[Any]
    stages: dict[str, Array]


def variant(source: Source, shapes: tuple[tuple[int, ...], ...], which: int, seed: int, number: int) -> Variant:
    """Deform the elements, or the layers to the letter, and fill what is left open."""
    guide, flips = source.guide, source.flips
    shape = guide.shape[:2]
    canvas: Layered | Canvas
    if source.paper:
        canvas, base, log = deform_layers(source, which, seed, number)
    else:
        canvas, base, log = deform(guide, source.parts, source.moves, flips, seed, number)
    holes = ~canvas.covered
    deformed = np.where(holes[..., np.newaxis], np.float32(0), canvas.colours)
    coordinates = flip_coordinates(canvas.coordinates, base, shape)
    label = canvas.label
    frames: list[NDArray[np.floating]] = [flip_frame(base) @ f for f in canvas.frames]
    if holes.any():
        filled = complete(
            canvas.colours,
            canvas.covered,
            source.index,
            patch=source.side,
            seed=(seed + number) % 2**64,
            count=1 if source.paper else CANDIDATES,
            paper=source.paper,
            shown=flips.index(base),
        )
        pasted = filled.label >= 0
        origin = np.where(pasted, filled.source[filled.label], -1)
        for k, mirror in enumerate(flips):
            coordinates[origin == k] = flip_coordinates(filled.coordinates[origin == k], mirror, shape)
        label = np.where(pasted, len(frames) + filled.label, label).astype(np.uint32)
        frames += [flip_frame(flips[k]) for k in filled.source]
    exemplar = np.full(shape, which, np.uint16)
    made = SourceMap(coordinates, exemplar, label, np.array(frames, np.float32), shapes)
    colours = gather(guide, coordinates, interpolation="cubic")
    return Variant(
        made, colours, float(holes.mean()), log, {"deformed": deformed, "holes": holes, "completed": colours}
    )


CANDIDATES = 5
"""Matches of a hole that are cut in; the cheapest is kept."""


def deform_layers(source: Source, which: int, seed: int, number: int) -> tuple[Layered, Flip, list[Any]]:
    """Move whole layers, as printed."""
    moves = source.moves
    x0 = start(moves.x0, moves.chaos, seed, which, number)
    layered = stitch_layers(source.guide, source.parts.elements, x0, moves.chaos)
    return layered, (False, False), layered.log


# --- the large texture: section 3.1, step 4 --------------------------------------------------------------------------

PATCH, OVERLAP = 0.6, 0.25
"""Side of a patch and overlap of two, as shares of the exemplar's shorter side."""
WHOLENESS, JOINTED = 8.0, 2.0
"""How many times dearer a seam is inside an element than between elements. And where elements of a lattice lie close, as bricks
do: the joints between them go on across every seam, and one that kept to them would show."""
CLOSE = 0.5
"""Share of the exemplar that elements cover from which on they lie close."""


def large(
    sources: Sequence[Source],
    variants: Sequence[Variant],
    size: tuple[int, ...],
    wrap: tuple[bool, ...],
    shares: NDArray[np.float64],
    seed: int,
    progress: Callable[[float], object],
) -> SourceMap:
    """Stitch patches of the variants into a texture of any size, on the torus where it wraps."""
    inside = []
    for source in sources:
        parts = source.parts
        whole = parts.children in ("components", "labels")
        jointed = parts.lattice is not None and (parts.elements > 0).mean() > CLOSE
        dearer = JOINTED if jointed else WHOLENESS
        inside.append(dearer * parts.depth(3) if whole else np.zeros(source.guide.shape[:2], np.float32))
    side = min(min(i.shape) for i in inside)
    pictures = []
    for v in variants:
        which = int(v.source.exemplar[0, 0])
        penalty = gather(inside[which], v.source.coordinates, interpolation="nearest")
        pictures.append(Picture(v.colours, v.source, penalty, sources[which].parts.lattice is not None))
    return quilt(
        pictures,
        (size[0], size[1]),
        patch=round(PATCH * side),
        overlap=round(OVERLAP * side),
        wrap=(wrap[0], wrap[1]),
        shares=shares,
        seed=seed,
        progress=progress,
    )

"""DESIGN: many natural textures from one example.

J. Shen, X. Jin, X. Mao and J. Feng, "Completion-based texture design using deformation", The Visual Computer 22,
2006. The flow, in the paper's order:

1. segment the exemplar into layers and child layers (section 3.2);
2. deform each child by translations, rotations, mirrors and scales that a logistic map chooses (section 3.3, Eq. 1 and 2);
3. stitch the deformed layers by graph cut (section 3.4, Eq. 3) and mark the holes (Eq. 4);
4. fill the holes by example (section 3.4);
5. repeat for several tiles and stitch them into the large texture (section 3.1, step 4);
6. correct its colours so that the seams disappear (section 3.6, Eq. 5 and 6).

Departures, with their reasons:

- Children are elements, not colour layers: a layer moved as a whole tears the elements that its border crosses.
- The literal generator uses one number for the operation and for its extent, so it never enlarges and often does
  nothing; here each operation takes three values of the map. Each child has its own start, after a burn-in.
- An element that the border of the exemplar cuts only slides along that border; elements keep out of each other.
- In a cut, the inside of an element is a hard constraint, and a context band of its surroundings is offered with it:
  otherwise the minimum cut makes a wholly overlapped element vanish.
- Where patches of the large texture meet, cuts pay the square of the difference, and for the depth inside of the elements that
  meet there, so seams run between them and out of edges that do not fit (see `texrs.quilting`).
- Where elements of one shape lie in a heap they take each other's places, turned and scaled to the shape that they fill; in a
  heap of leaves most rest. If all moved there would be nothing left to lie on. An element brings only background along, not
  pieces of its neighbours.
- Holes are filled with background alone where the example has enough of it. Where it has not, what is left of an element in a
  heap whose place another one took stays. The inside of elements is never filled over: patches would tear them.
- Where moved elements are judged clearly worse than the example as it is, they stay where they are, and variety comes from
  patches alone: both are tried at a small size (see `texrs.metrics`). In heaps of fruit, where elements can only be cut out
  roughly, torn outlines fall to a third.
- Nothing is mirrored along an axis on which something tells the example from its mirror image (light from one side, leaves
  that hang), or at all where ``rotate=0`` says that it has an upper side, unless that is asked for. Nor is it turned where it
  has directions of its own (bark, brickwork); where it repeats on a lattice, elements move from place to place of the lattice
  and nowhere else.
- What repeats on a lattice is stretched and sheared a little, by 15 % at most, so that a whole number of periods goes around
  a cyclic texture, and patches are taken in step with each other: else bricks run together where the courses close. The
  report's "lattice_stretch" says by how much.
- What lies in courses without repeating along them, as a wall of stones of all lengths, is made level and laid course by
  course, as tall as the texture, a few times, those as tall exchanged for each other; patches are free along the courses and
  keep their places across, so all joints go through (`texrs.papers.design.sheets`). The report's "courses" says what was found.
- A cyclic texture (section 3.5) is stitched on the torus from the start: patches are chosen to fit both sides of the
  wrap, where the paper folds a finished picture that was never chosen to fit.
- Several exemplars are each stitched into a texture of the full size. Which one shows is asked by a map, or drawn as
  territories of smooth noise; a cut moves their borders to outlines, by an element at most (`texrs.papers.design.mixing`).
  Dealing patches to exemplars gives rectangles, and no map is obeyed. Colours are not corrected where exemplars meet.
  Or things of the others are scattered over the first one, as densely as asked (`texrs.papers.design.scattering`).
- The differences that the colours are corrected to are those of the sources on both sides of a seam, where the paper
  takes those of the picture itself; some weight on the values keeps the colours from drifting. Along the outline of a thing
  the step stays.

``method="paper"`` leaves the departures out (`texrs.papers.design.literal`), but for the torus and the squares.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

from texrs._progress import listen
from texrs._typing import Progress
from texrs._verbs import takes_materials
from texrs.blending import SCREENING
from texrs.elements import ElementAnalysis
from texrs.exemplar import ElementOptions
from texrs.papers.design.arguments import Arguments, Choice, Density, Exemplars, Method, Size, Weights, check_arguments
from texrs.papers.design.options import DeformationOptions
from texrs.papers.design.plan import Plan, make_plan
from texrs.papers.design.report import describe, draw_stages
from texrs.papers.design.texture import correct_colours, look_up
from texrs.papers.design.trials import choose_plan, make_composite
from texrs.synthesis import Synthesis
from texrs.tiling._check import check_result, report_tiling

__all__ = ["DeformationOptions", "design", "design_variants"]


@takes_materials("exemplar")
def design(
    exemplar: Exemplars,
    size: Size = None,
    *,
    seed: int = 0,
    wrap: bool | Sequence[bool] | None = None,
    weights: Weights = None,
    density: Density = None,
    elements: ElementOptions | ElementAnalysis = ElementOptions(),
    deformation: DeformationOptions = DeformationOptions(),
    motion: Choice = "auto",
    copies: int = 4,
    patch_size: int | None = None,
    screening: float | None = SCREENING,
    method: Method = None,
    progress: Progress | bool | None = None,
) -> Synthesis:
    """Design a large texture from one example.

    Parameters
    ----------
    exemplar : (H, W) or (H, W, C) array, Exemplar, ElementAnalysis, or a sequence of them
        The example, any real dtype, at least 16 pixels a side. Several, of one dtype and one number of channels, are
        mixed. An entry of analysed elements, as `splice` takes them, brings its own elements along.
    size : int or (rows, columns), optional
        Size of the result, in pixels, at least 16 a side; twice the exemplar by default.
    seed : int
        Chooses the texture, 0 to 2^64 - 1: the same exemplar, options, seed and version give the same bytes.
    wrap : bool or (rows, columns), optional
        Axes along which the result repeats without a seam; None: both.
    weights : (n,), (rows, columns) of int, or (rows, columns, n) array, optional
        Shares of n exemplars in the result, or which one is where, or their shares everywhere; equal by default. Borders
        follow outlines, by an element at most from where a map has them; shares on the whole are kept within 3 %.
    density : float, (n - 1,), (rows, columns), or (rows, columns, n - 1) array, optional
        Share of the area on which things of all exemplars but the first are seen, 0 to 1, of each or of all, on the whole or
        place by place: they are scattered over a texture of the first, each whole, those of the last on top. Not for use
        with ``weights``. The report's "density" says what was asked and reached, and what their own exemplar has.
    elements : ElementOptions or ElementAnalysis
        How the elements of the exemplar are found, or what `texrs.elements.analyse` found: its ``labels`` are used.
    deformation : DeformationOptions
        How elements are deformed.
    motion : {"auto", "move", "keep"}
        What is done with elements. "move": they are deformed, as the paper has it. "keep": they stay as they are, and
        patches of the exemplar and its mirror images are joined between them. "auto": both are tried at a small size and
        judged, and the better one is taken; where ``deformation`` is given, or the ``method``, elements move. What lies in
        courses is laid course by course unless they move.
    copies : int
        Deformed copies of the exemplar that the result is stitched from, 1 to 64.
    patch_size : int, optional
        Side of the patches that fill holes, in pixels, 4 to the exemplar's shorter side; a sixth of that, 12 to 32, by
        default.
    screening : float, optional
        Weight of the values, 0 to 1e6, when colours are corrected so that seams disappear (section 3.6): the smaller, the
        wider the correction. None or 0: no correction. See `texrs.blend`, which corrects other maps in the same way,
        of several exemplars with ``across=False``.
    method : {None, "paper"}
        "paper": the algorithm as printed, with only its misprints repaired, for comparison. Whole colour layers are moved
        by the printed generator, once each or as ``operations`` says, and stitched at the plain cost; holes take the best
        match; colours are corrected without weight on the values. The ``segmentation`` of elements and ``translate``,
        ``rotate`` and ``mirror`` of their deformation play no part, nor does the amount of ``screening``.
    progress : callable or True, optional
        Called as ``progress(stage, share)``, with the share of the stage that is done; raising stops the work.
        True shows a bar.

    Returns
    -------
    Synthesis
        The image in the exemplar's dtype and channels, its source map, pictures of the stages, and the log of
        operations.

        Stages:

        - ``segmentation``: The first example, each element in a colour.
        - ``deformed``: The moved elements of the first copy.
        - ``holes``: Pixels of this copy that no element covers.
        - ``completed``: This copy with filled holes.
        - ``before_blending``: The texture before colours are corrected.

        Report:

        - ``method``: "default" or "paper".
        - ``seed``: The seed.
        - ``size``: (rows, columns).
        - ``wrap``: Whether the texture repeats along (rows, columns).
        - ``elements``: Number of elements that were found in all examples.
        - ``segmentation``: Kind of elements of the first example: "components", "grid" or "none".
        - ``reason``: Why this kind was chosen, one sentence.
        - ``arrangement``: For each example: "apart", "heap", "leaves", "full", "layers" or "courses".
        - ``motion``: For each example: "move" or "keep".
        - ``candidates``: For each example, the figures of either motion, or None if it was given. They are ``score`` (0 is
          best), ``torn``, ``broken``, ``seam_blur``, ``repetition`` and ``coverage`` of `texrs.metrics.evaluate`.
        - ``courses``: For each example, the courses that it was laid in, or None.
        - ``lattice_stretch``: For each example, the (2, 2) matrix that made its lattice fit the size, or None.
        - ``rotate``: Largest rotation that was used, in degrees.
        - ``pixel_counts``: Number of pixels from each example.
        - ``density``: For each scattered example, its density as ``asked``, ``reached`` and in the example (``own``), and the
          number of ``things``; else None.
        - ``holes``: For each copy, the share of its pixels that were filled.
        - ``screening``: Weight of the values in the colour correction.
        - ``seams``: Visibility of the seams ``before`` and ``after`` the correction: number of ``edges``, ``mean`` (1 is that
          of the example) and share of ``outliers``.
        - ``operations``: For each copy, the operations on each element. An entry names the ``element``, its ``operations``
          and its ``place``.
        - ``tiling``: What `texrs.check_tiling` finds along each axis that wraps: ``tiles``, ``seam`` and ``place``.

    Raises
    ------
    InvalidInput
        An argument of the wrong type or out of range.
    LimitExceeded
        A size of more than 2^28 pixels, or that needs more memory than the machine has.

    See Also
    --------
    design_variants : Many different textures of one example, which is analysed once.

    Notes
    -----
    For each pixel of the result 18 bytes are needed, or 14 and twice those of a pixel of the image where that is more,
    and 0.5 GB beside it: 5.9 GB for 16384 x 16384 pixels of 8-bit RGB. ``method="paper"`` takes 24 more. Several
    exemplars take 100 more and 75 for each, and a map of ``weights`` 8 for each.

    References
    ----------
    .. [1] J. Shen, X. Jin, X. Mao, J. Feng, "Completion-based texture design using deformation", The Visual Computer
       22, 2006. :doi:`10.1007/s00371-006-0079-2`

    Examples
    --------
    >>> import numpy as np
    >>> import texrs
    >>> pebbles = texrs.samples.pebbles((96, 96)).image
    >>> result = texrs.design(pebbles, (128, 160), seed=3)
    >>> result.image.shape, result.image.dtype
    ((128, 160, 3), dtype('uint8'))
    >>> heights = np.linspace(0, 1, 96 * 96, dtype=np.float32).reshape(96, 96)
    >>> result.source_map.render(heights).shape
    (128, 160)
    >>> stones = texrs.elements.ElementAnalysis.of_sample(texrs.samples.pebbles((96, 96)))
    >>> texrs.design(stones, 96, copies=1, motion="move").report["segmentation"]
    'labels'
    >>> still = texrs.design(pebbles, 128, deformation=texrs.DeformationOptions(rotate=0, allow_mirror=False))

    """
    progress = listen(progress)
    variants = design_variants(
        exemplar,
        1,
        size,
        seed=seed,
        wrap=wrap,
        weights=weights,
        density=density,
        elements=elements,
        deformation=deformation,
        motion=motion,
        copies=copies,
        patch_size=patch_size,
        screening=screening,
        method=method,
        progress=progress,
    )
    return next(variants)


@takes_materials("exemplar")
def design_variants(
    exemplar: Exemplars,
    count: int,
    size: Size = None,
    *,
    seed: int = 0,
    wrap: bool | Sequence[bool] | None = None,
    weights: Weights = None,
    density: Density = None,
    elements: ElementOptions | ElementAnalysis = ElementOptions(),
    deformation: DeformationOptions = DeformationOptions(),
    motion: Choice = "auto",
    copies: int = 4,
    patch_size: int | None = None,
    screening: float | None = SCREENING,
    method: Method = None,
    progress: Progress | bool | None = None,
) -> Iterator[Synthesis]:
    """Design several different textures from one example, which is analysed once.

    The arguments are checked at once, and each texture is made when it is asked for, so that those before it are there
    when the work is stopped. All are what `design` makes with their seed.

    Parameters
    ----------
    exemplar : (H, W) or (H, W, C) array, Exemplar, ElementAnalysis, or a sequence of them
        The example, any real dtype, at least 16 pixels a side. Several, of one dtype and one number of channels, are
        mixed. An entry of analysed elements, as `splice` takes them, brings its own elements along.
    count : int
        How many, 1 to 4096.
    size : int or (rows, columns), optional
        Size of each texture, in pixels, at least 16 a side; twice the exemplar by default.
    seed : int
        Chooses the textures, 0 to 2^64 - 1: they have the seeds ``seed``, ``seed + 1``, ...
    wrap : bool or (rows, columns), optional
        Axes along which each texture repeats without a seam; None: both.
    weights : (n,), (rows, columns) of int, or (rows, columns, n) array, optional
        Shares of n exemplars in each texture, or which one is where, or their shares everywhere; equal by default. Borders
        follow outlines, by an element at most from where a map has them; shares on the whole are kept within 3 %.
    density : float, (n - 1,), (rows, columns), or (rows, columns, n - 1) array, optional
        Share of the area on which things of all exemplars but the first are seen, 0 to 1, of each or of all, on the whole or
        place by place: they are scattered over a texture of the first, each whole, those of the last on top. Not for use
        with ``weights``. The report's "density" says what was asked and reached, and what their own exemplar has.
    elements : ElementOptions or ElementAnalysis
        How the elements of the exemplar are found, or what `texrs.elements.analyse` found: its ``labels`` are used.
    deformation : DeformationOptions
        How elements are deformed.
    motion : {"auto", "move", "keep"}
        What is done with elements. "move": they are deformed, as the paper has it. "keep": they stay as they are, and
        patches of the exemplar and its mirror images are joined between them. "auto": both are tried at a small size and
        judged, and the better one is taken; where ``deformation`` is given, or the ``method``, elements move. What lies in
        courses is laid course by course unless they move.
    copies : int
        Deformed copies of the exemplar that each texture is stitched from, 1 to 64.
    patch_size : int, optional
        Side of the patches that fill holes, in pixels, 4 to the exemplar's shorter side; a sixth of that, 12 to 32, by
        default.
    screening : float, optional
        Weight of the values, 0 to 1e6, when colours are corrected so that seams disappear (section 3.6): the smaller, the
        wider the correction. None or 0: no correction. See `texrs.blend`, which corrects other maps in the same way,
        of several exemplars with ``across=False``.
    method : {None, "paper"}
        "paper": the algorithm as printed, with only its misprints repaired, for comparison. Whole colour layers are moved
        by the printed generator, once each or as ``operations`` says, and stitched at the plain cost; holes take the best
        match; colours are corrected without weight on the values. The ``segmentation`` of elements and ``translate``,
        ``rotate`` and ``mirror`` of their deformation play no part, nor does the amount of ``screening``.
    progress : callable or True, optional
        Called as ``progress(stage, share)``, with the share of the stage that is done; raising stops the work.
        True shows a bar.

    Returns
    -------
    iterator of Synthesis
        Results as of `design`.

    Raises
    ------
    InvalidInput
        An argument of the wrong type or out of range.
    LimitExceeded
        A size of more than 2^28 pixels, or that needs more memory than the machine has.

    Examples
    --------
    >>> import texrs
    >>> dots = texrs.samples.dots((64, 64)).image
    >>> made = [result.image for result in texrs.design_variants(dots, 2, 64, seed=7, copies=1)]
    >>> bool((made[1] == texrs.design(dots, 64, seed=8, copies=1).image).all())
    True

    """
    progress = listen(progress)
    arguments = check_arguments(
        exemplar,
        count,
        size,
        seed=seed,
        wrap=wrap,
        weights=weights,
        density=density,
        elements=elements,
        deformation=deformation,
        motion=motion,
        copies=copies,
        patch_size=patch_size,
        screening=screening,
        method=method,
        progress=progress,
    )
    return make_textures(arguments)


def make_textures(arguments: Arguments) -> Iterator[Synthesis]:
    """Segment the exemplars, and make a texture for each seed."""
    plans = segment(arguments)
    for number, seed in enumerate(arguments.seeds, start=1):
        made = make_texture(plans, arguments, seed)
        if number == len(arguments.seeds):
            arguments.watch("done", 1.0)
        yield made


def segment(arguments: Arguments) -> list[Plan]:
    """Segment each exemplar, and settle how its elements may move: step 1."""
    plans: list[Plan] = []
    # The printed algorithm moves whole layers.
    elements = replace(arguments.elements, segmentation="none") if arguments.literal else arguments.elements
    arguments.watch("segment", 0.0)
    for number, exemplar in enumerate(arguments.guides):
        progress = partial(report_share, arguments.watch, number, len(arguments.guides))
        chosen = elements.select(number)
        parts = exemplar.segment(chosen, progress=progress)
        plan = make_plan(exemplar, parts, arguments.deformation, side=arguments.side, literal=arguments.literal)
        scattered = number > 0 and arguments.density is not None
        plans.append(plan if scattered else choose_plan(plan, exemplar, chosen, arguments))
        arguments.watch("segment", (number + 1) / len(arguments.guides))
    return plans


def make_texture(plans: Sequence[Plan], arguments: Arguments, seed: int) -> Synthesis:
    """Make one texture of analysed exemplars: steps 2 to 6."""
    tiles, composite = make_composite(plans, arguments, seed)
    picture = look_up(composite, arguments)
    image, seams = correct_colours(composite, picture, arguments)
    report = describe(plans, tiles, composite, seams, arguments, seed)
    if any(arguments.wrap):
        found = check_result(image, None, arguments.wrap, regular=plans[0].parts.lattice is not None)
        report["tiling"] = report_tiling(found, arguments.wrap)
    return Synthesis(image, composite, draw_stages(plans[0], tiles[0], picture), report)


def report_share(watch: Progress, number: int, count: int, stage: str, share: float) -> None:
    """Report the share of one of several alike."""
    watch(stage, (number + share) / count)

"""Synthesise many natural textures from one example (DESIGN).

J. Shen, X. Jin, X. Mao and J. Feng, "Completion-based texture design using deformation", The Visual Computer 22,
2006. The steps, in the paper's order:

1. Segment the exemplar into layers and child layers (section 3.2).

2. Deform each child by translations, rotations, mirrors and scales that a logistic map chooses (section 3.3, Eq. 1 and 2).

3. Stitch the deformed layers by graph cut (section 3.4, Eq. 3) and mark the holes (Eq. 4).

4. Fill the holes by example (section 3.4).

5. Repeat for several deformed copies ("tiles") and stitch them into the large texture (section 3.1, step 4).

6. Correct its colours so that the seams disappear (section 3.6, Eq. 5 and 6).

Departures from the paper, with their reasons:

- The child layers are elements, not colour layers. A layer that moves as a whole tears the elements that its border
  crosses.

- The printed generator uses one number for the operation and for its extent. It therefore never enlarges and often
  does nothing. Here each operation takes three values of the map. Each child has its own start, after a burn-in.

- An element that the border of the exemplar cuts only slides along that border. Elements do not overlap.

- The inside of an element is a hard constraint of each cut. A context band of its surroundings is offered with it.
  Without these, the minimum cut removes an element that is wholly overlapped.

- Seams between patches of the large texture cost the squared difference, plus the depth inside the elements that meet
  there. Seams therefore run between elements, and avoid edges that do not fit (see `texrs.quilting`).

- Elements of one shape that are in a heap take each other's places. They are turned and scaled to the shape that they
  fill. Most elements of a heap of leaves stay, because no background would remain if all moved. An element brings only
  background along, not parts of its neighbours.

- Holes are filled with background only, if the example has enough of it. Otherwise, if another element took an
  element's place in a heap, the uncovered rest of the old element stays. The inside of elements is never filled over,
  because patches would tear it.

- If moved elements score clearly worse than elements in place, they stay, and only patches give variety. Both ways are
  tried at a small size (see `texrs.metrics`). Elements in heaps of fruit can only be cut out roughly. There this
  reduces the length of torn outlines to a third.

- Images are not mirrored along an axis if the example differs from its mirror image. Reasons are light from one side
  or hanging leaves. ``rotate=0`` states that the example has an upper side, and then mirroring is off.
  ``allow_mirror`` overrides both. Examples with directions of their own (bark, brickwork) are not turned. On a
  lattice, elements move only from one lattice position to another.

- An example on a lattice is stretched and sheared by at most 15 %. A whole number of periods then fits a tileable
  texture. Patches are shifted by whole periods only, so that bricks do not merge where the courses close. The report's
  "lattice_stretch" contains the stretch.

- An example in courses that do not repeat, such as a wall of stones of all lengths, is levelled. Its courses are laid
  on top of each other, as tall as the texture, several times, with courses of equal height exchanged. Patches move
  freely along the courses and keep their place across them, so that all joints continue
  (`texrs.papers.design.course_sheets`). The report's "courses" describes the courses that were found.

- A tileable texture (section 3.5) is stitched on the torus from the start. Patches are chosen to fit both sides of the
  border. The paper instead folds a finished image whose patches were not chosen to fit there.

- Each of several exemplars is stitched into a texture of the full size. A map, or territories of smooth noise, choose
  which texture is visible. A cut moves their borders to outlines, by at most the size of an element
  (`texrs.papers.design.mixing`). Assigning patches to exemplars, as in the paper, gives rectangles and cannot follow a
  map. Colours are not corrected where exemplars meet. With ``density``, elements of the other exemplars are scattered
  over the first one (`texrs.papers.design.scattering`).

- The colour correction restores the differences of the sources on both sides of a seam. The paper restores the
  differences of the image itself. A weight on the values keeps the colours from drifting. The step along the outline
  of an element is kept.

``method="paper"`` leaves out the departures (`texrs.papers.design.literal`), except for the torus and the squares.
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
        Example image, of any real dtype, at least 16 pixels a side. Several exemplars are mixed if they have the same
        dtype and number of channels. A set of analysed elements, as for `splice`, contains its own elements.
    size : int or (rows, columns), optional
        Size of the result, in pixels, at least 16 a side. Default: twice the size of the exemplar.
    seed : int
        Number that selects the texture, 0 to 2^64 - 1. The same exemplar, options, seed and version give the same
        bytes. Default: 0.
    wrap : bool or (rows, columns), optional
        Axes along which the result repeats without a visible border. Default: both.
    weights : (n,), (rows, columns) of int, or (rows, columns, n) array, optional
        Share of each exemplar, as one number each, 0 or more. Python also accepts a map of exemplar numbers or a map
        of shares per pixel. Borders follow outlines, at most one element away from their place in a map. The total
        shares are kept within 3 %. Default: equal shares.
    density : float, (n - 1,), (rows, columns), or (rows, columns, n - 1) array, optional
        Share of the area that elements of each exemplar after the first cover, 0 to 1. Give one number, one for each
        of these exemplars, or maps. Whole elements are scattered over a texture of the first exemplar. Elements of the
        last exemplar are on top. Cannot be combined with ``weights``. The report's "density" contains the requested
        and the reached densities, and the densities in the exemplars. Default: elements are not scattered.
    elements : ElementOptions or ElementAnalysis
        Options that control how elements are found, or the result of `texrs.elements.analyse`, whose ``labels`` are
        used. Default: the default options.
    deformation : DeformationOptions
        Options that control how elements are deformed. Default: the default options.
    motion : {"auto", "move", "keep"}
        Treatment of the elements. "move" deforms elements, as in the paper. "keep" leaves elements in place, and joins
        patches of the exemplar and its mirror images between them. "auto" tries both at a small size and uses the
        better one. With "auto", elements move if ``deformation`` or ``method`` is given. An exemplar in courses is
        laid course by course unless elements move. Default: "auto".
    copies : int
        Number of deformed copies of the exemplar that the result is stitched from, 1 to 64. Default: 4.
    patch_size : int, optional
        Side of the patches that fill holes, in pixels, from 4 to the exemplar's shorter side. Default: 1/6 of the
        shorter side, but 12 to 32.
    screening : float, optional
        Weight of the original values when colours are corrected to hide seams, 0 to 1e6 (section 3.6). A smaller
        weight spreads the correction wider. None or 0: colours are not corrected. `texrs.blend` corrects other maps in
        the same way, with ``across=False`` if there are several exemplars. Default: 0.15.
    method : {None, "paper"}
        Algorithm to use. "paper" is the algorithm as printed, with only its misprints repaired, for comparison. The
        printed generator moves whole colour layers, once each or ``operations`` times. They are stitched at the plain
        cost, holes take the best match, and colours are corrected without a weight on the values. The ``segmentation``
        of elements has no effect then, nor have ``translate``, ``rotate`` and ``mirror`` of their deformation, nor the
        amount of ``screening``. Default: the algorithm with departures from the paper.
    progress : callable or True, optional
        Function called as ``progress(stage, share)`` with the finished share of the stage. If it raises an exception,
        the work stops. True shows a progress bar. Default: none.

    Returns
    -------
    Synthesis
        The ``image`` in the exemplar's dtype and channels, its ``source_map``, images of the ``stages``, and the
        ``report``. The report's "operations" contains the operations on each element.

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
          number of ``elements``; else None.
        - ``holes``: For each copy, the share of its pixels that were filled.
        - ``screening``: Weight of the values in the colour correction.
        - ``seams``: Visibility of the seams ``before`` and ``after`` the correction: number of ``edges``, ``mean`` (1 is that
          of the example) and share of ``outliers``.
        - ``operations``: For each copy, the operations on each element. An entry names the ``element``, its ``operations``
          and its ``place``.
        - ``tiling``: Result of `texrs.check_tiling` along each axis that wraps: ``tiles``, ``seam`` and ``place``.

    Raises
    ------
    InvalidInput
        An argument has the wrong type or is out of range.
    LimitExceeded
        The size exceeds 2^28 pixels, or needs more memory than the machine has.

    See Also
    --------
    design_variants : Many different textures of one example, which is analysed once.

    Notes
    -----
    Each pixel of the result needs 18 bytes, or 14 bytes plus twice the bytes of a pixel of the image if this is more.
    Another 0.5 GB are needed in any case: 5.9 GB for 16384 x 16384 pixels of 8-bit RGB. ``method="paper"`` needs 24
    more bytes per pixel. Several exemplars need 100 more and 75 for each exemplar, and a map of ``weights`` needs 8
    for each exemplar.

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

    The arguments are checked at once. Each texture is generated on request, so that finished textures are available if
    the work stops. Each equals the result of `design` with its seed.

    Parameters
    ----------
    exemplar : (H, W) or (H, W, C) array, Exemplar, ElementAnalysis, or a sequence of them
        Example image, of any real dtype, at least 16 pixels a side. Several exemplars are mixed if they have the same
        dtype and number of channels. A set of analysed elements, as for `splice`, contains its own elements.
    count : int
        Number of textures, 1 to 4096.
    size : int or (rows, columns), optional
        Size of each texture, in pixels, at least 16 a side. Default: twice the size of the exemplar.
    seed : int
        Number that selects the textures, 0 to 2^64 - 1. Their seeds are ``seed``, ``seed + 1``, ... Default: 0.
    wrap : bool or (rows, columns), optional
        Axes along which each texture repeats without a visible border. Default: both.
    weights : (n,), (rows, columns) of int, or (rows, columns, n) array, optional
        Share of each exemplar, as one number each, 0 or more. Python also accepts a map of exemplar numbers or a map
        of shares per pixel. Borders follow outlines, at most one element away from their place in a map. The total
        shares are kept within 3 %. Default: equal shares.
    density : float, (n - 1,), (rows, columns), or (rows, columns, n - 1) array, optional
        Share of the area that elements of each exemplar after the first cover, 0 to 1. Give one number, one for each
        of these exemplars, or maps. Whole elements are scattered over a texture of the first exemplar. Elements of the
        last exemplar are on top. Cannot be combined with ``weights``. The report's "density" contains the requested
        and the reached densities, and the densities in the exemplars. Default: elements are not scattered.
    elements : ElementOptions or ElementAnalysis
        Options that control how elements are found, or the result of `texrs.elements.analyse`, whose ``labels`` are
        used. Default: the default options.
    deformation : DeformationOptions
        Options that control how elements are deformed. Default: the default options.
    motion : {"auto", "move", "keep"}
        Treatment of the elements. "move" deforms elements, as in the paper. "keep" leaves elements in place, and joins
        patches of the exemplar and its mirror images between them. "auto" tries both at a small size and uses the
        better one. With "auto", elements move if ``deformation`` or ``method`` is given. An exemplar in courses is
        laid course by course unless elements move. Default: "auto".
    copies : int
        Number of deformed copies of the exemplar that each texture is stitched from, 1 to 64. Default: 4.
    patch_size : int, optional
        Side of the patches that fill holes, in pixels, from 4 to the exemplar's shorter side. Default: 1/6 of the
        shorter side, but 12 to 32.
    screening : float, optional
        Weight of the original values when colours are corrected to hide seams, 0 to 1e6 (section 3.6). A smaller
        weight spreads the correction wider. None or 0: colours are not corrected. `texrs.blend` corrects other maps in
        the same way, with ``across=False`` if there are several exemplars. Default: 0.15.
    method : {None, "paper"}
        Algorithm to use. "paper" is the algorithm as printed, with only its misprints repaired, for comparison. The
        printed generator moves whole colour layers, once each or ``operations`` times. They are stitched at the plain
        cost, holes take the best match, and colours are corrected without a weight on the values. The ``segmentation``
        of elements has no effect then, nor have ``translate``, ``rotate`` and ``mirror`` of their deformation, nor the
        amount of ``screening``. Default: the algorithm with the departures of `design`.
    progress : callable or True, optional
        Function called as ``progress(stage, share)`` with the finished share of the stage. If it raises an exception,
        the work stops. True shows a progress bar. Default: none.

    Returns
    -------
    iterator of Synthesis
        One result per seed, as of `design`.

    Raises
    ------
    InvalidInput
        An argument has the wrong type or is out of range.
    LimitExceeded
        The size exceeds 2^28 pixels, or needs more memory than the machine has.

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
    """Segment the exemplars, and synthesise a texture for each seed."""
    plans = segment(arguments)
    for number, seed in enumerate(arguments.seeds, start=1):
        made = make_texture(plans, arguments, seed)
        if number == len(arguments.seeds):
            arguments.watch("done", 1.0)
        yield made


def segment(arguments: Arguments) -> list[Plan]:
    """Segment each exemplar, and decide how its elements may move (step 1)."""
    plans: list[Plan] = []
    # The printed algorithm moves whole layers, so elements are not segmented.
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
    """Synthesise one texture from analysed exemplars (steps 2 to 6)."""
    tiles, composite = make_composite(plans, arguments, seed)
    picture = look_up(composite, arguments)
    image, seams = correct_colours(composite, picture, arguments)
    report = describe(plans, tiles, composite, seams, arguments, seed)
    if any(arguments.wrap):
        found = check_result(image, None, arguments.wrap, regular=plans[0].parts.lattice is not None)
        report["tiling"] = report_tiling(found, arguments.wrap)
    return Synthesis(image, composite, draw_stages(plans[0], tiles[0], picture), report)


def report_share(watch: Progress, number: int, count: int, stage: str, share: float) -> None:
    """Report the progress of one of several equal parts."""
    watch(stage, (number + share) / count)

"""Synthesise many natural textures from one example (DESIGN).

J. Shen, X. Jin, X. Mao and J. Feng, "Completion-based texture design using deformation", The Visual Computer 22,
2006. The steps, in the paper's order:

1. Segment the exemplar into layers and child layers (section 3.2).

2. Deform each child by translations, rotations, mirrors and scales that a logistic map chooses (section 3.3, Eq. 1 and
   2).

3. Stitch the deformed layers by graph cut (section 3.4, Eq. 3) and mark the holes (Eq. 4).

4. Fill the holes by example (section 3.4).

5. Repeat for several deformed copies ("tiles") and stitch them into the large texture (section 3.1, step 4).

6. Correct its colours so that the seams disappear (section 3.6, Eq. 5 and 6).

Departures from the paper, with their reasons:

- The child layers are elements instead of colour layers, because a colour layer that moves as a whole tears the
  elements that its border crosses.

- The printed generator uses one number for both the operation and its extent. It therefore never enlarges an element,
  and often leaves it unchanged. Here each operation uses three values of the logistic map. Each child layer has its
  own start of the map, after a burn-in.

- An element that the border of the exemplar cuts can only move along that border. Elements do not overlap.

- The inside of an element is a hard constraint of each cut. The pixels around the element, its context band, are
  offered to the cut too. Without both, the minimum cut would remove an element that lies completely over known pixels.

- A seam between patches of the large texture costs the squared colour difference, plus the depth inside the elements
  that it crosses. Seams therefore run between elements, and avoid edges that do not match (see `texrs.quilting`).

- Elements of a heap exchange places with elements of similar shape. Each is turned and scaled to the shape of the
  element that it replaces. If the heap consists of leaves, most elements stay in place, because no background would
  remain if all moved. A moved element brings along only background from its surroundings, not parts of its neighbours.

- Holes are filled with background only, if the example has enough of it. Otherwise, if an element in a heap is
  replaced and its successor does not cover all of it, the rest remains visible. Patches never replace the inside of
  elements, because they would tear it.

- The child layers are the elements that `texrs.exemplar.element_finder` finds, instead of segments of colour layers. If
  an example has no elements, or if they are the meshes of a net, a jittered grid of cells takes their place.

- An example that clearly shows an oblique plane is flattened first, because elements from its near and far parts do not
  fit each other (`texrs.papers.design.oblique`).

- Several ways are tried at a small size (`texrs.papers.design.ways`), and the one with the fewest faults is used. The
  faults are measured without a segmentation: lost regularity, lines that break off, foreign content, and steps of
  tone. The paper always moves elements, which tears those that are close together.

- Images are not mirrored along an axis if the mirror image looks different from the example. Light from one side and
  hanging leaves cause such a difference. ``rotate=0`` means that the example has an upper side, and disables
  mirroring. ``allow_mirror`` overrides both rules. Elements of examples with a preferred direction (bark, brickwork)
  are not turned. On a lattice, elements move only from one lattice position to another.

- An example on a lattice is stretched and sheared by at most 15 %, so that a whole number of periods fits a tileable
  texture. Patches are shifted by whole periods only, so that bricks do not merge where the texture repeats. The
  report's "lattice_stretch" contains the matrix of the stretch.

- An example in courses (rows of stones) that do not repeat is levelled. Several sheets as tall as the texture are
  built from its courses, and courses of similar height are exchanged between the sheets. Patches of the sheets move
  freely along the courses, but keep their position across the courses, so that all joints continue
  (`texrs.papers.design.course_sheets`). The report's "courses" describes the courses that were found.

- A tileable texture (section 3.5) is stitched on a torus from the start, so that patches match on both sides of the
  border. The paper instead folds a finished image, whose patches were not chosen to match at the border.

- If there are several exemplars, each is stitched into a texture of the full size. A map, or territories of smooth
  noise, select the texture that is visible at each pixel. A cut then moves the borders between textures to outlines of
  elements, by at most the size of an element (`texrs.papers.design.mixing`). The paper assigns patches to exemplars,
  which gives rectangles and cannot follow a map. Colours are not corrected where exemplars meet. With ``density``,
  elements of the other exemplars are scattered over a texture of the first one (`texrs.papers.design.scattering`).

- The colour correction restores the colour differences that the sources have on both sides of a seam. The paper
  restores the differences of the stitched image itself. A weight on the original values prevents the colours from
  drifting. The colour step along the outline of an element is kept.

``method="paper"`` omits these departures (`texrs.papers.design.literal`), except for the torus and the squared seam
cost.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

from texrs._progress import answering
from texrs._typing import Progress
from texrs._verbs import verb
from texrs.errors import InvalidInput
from texrs.papers.design.arguments import Design, DesignRequest, DesignVariants
from texrs.papers.design.oblique import flatten_exemplar
from texrs.papers.design.options import DeformationOptions
from texrs.papers.design.plan import Plan, make_plan
from texrs.papers.design.report import describe, draw_stages
from texrs.papers.design.texture import correct_colours, look_up, say_finish
from texrs.papers.design.trials import choose_other, choose_plan, make_composite
from texrs.planes.flattening import FlatView
from texrs.synthesis import Synthesis
from texrs.tiling.check import check_result, report_tiling

__all__ = ["DeformationOptions", "design", "design_variants"]


@verb(Design, "exemplar")
def design(asked: Design) -> Synthesis:
    """Synthesise a large texture from one example by moving its elements and stitching patches.

    Parameters
    ----------
    {parameters}

    Returns
    -------
    Synthesis
        The ``image`` in the exemplar's dtype and channels, its ``source_map``, images of the ``stages``, and the
        ``report``. The report's "operations" contains the operations on each element.

        Stages:

        - ``segmentation``: The first example, with each element in a different colour.
        - ``ways``: The trial textures of the first example side by side, in the order of the report's "candidates". Only
          if ways were tried.
        - ``deformed``: The moved elements of the first copy.
        - ``holes``: Pixels of this copy that neither elements nor background cover.
        - ``completed``: This copy after its holes are filled.
        - ``before_blending``: The texture before its colours are corrected.

        Report:

        - ``method``: "default" or "paper".
        - ``seed``: The seed of this texture.
        - ``size``: (rows, columns).
        - ``wrap``: Whether the texture repeats along (rows, columns).
        - ``elements``: Total number of elements that were found in the examples.
        - ``segmentation``: Kind of elements of the first example: "components" (separate elements), "labels" (given as
          labels), "grid" (cells) or "none".
        - ``reason``: Reason for this kind, as one sentence.
        - ``arrangement``: For each example: "apart", "heap", "leaves", "full", "layers" or "courses". A "heap" has
          similar shapes, "leaves" are a heap of irregular shapes, and "full" means a lattice or cells.
        - ``way``: Way that each example was laid in.
        - ``refused``: For each example, the ways that it or the size does not allow, with the reason as one sentence.
          If a lattice does not fit the size, the reason contains the nearest size that it fits.
        - ``candidates``: For each example, the figures of each way that was tried, or None without a trial. 0 is
          best for ``score`` and the faults. The faults are missing regularity (``irregular``), fine and coarse lines
          that break off (``broken``, ``broken_coarse``) and cells unlike the example (``foreign``). Fine and coarse
          steps of tone at seams are ``stepped`` and ``blotched``. ``repetition`` and ``coverage`` are those
          of `texrs.metrics.evaluate`.
        - ``courses``: For each example, the courses that the texture is built from, or None.
        - ``period``: For each example that repeats along one direction only, such as stripes, its period as (row, column)
          in pixels, or None.
        - ``lattice_stretch``: For each example, the (2, 2) matrix that stretches its periods to fit the size, or None.
        - ``rotate``: Largest permitted rotation of elements of the first example, in degrees.
        - ``pixel_counts``: Number of pixels from each example.
        - ``density``: For each scattered example, its densities (0 to 1) as ``asked``, as ``reached`` and in the
          example (``own``), and the number of ``elements``. None without ``density``.
        - ``holes``: For each copy, the share of its pixels that were filled, 0 to 1.
        - ``screening``: Weight of the original values in the colour correction.
        - ``seams``: Visibility of the seams ``before`` and ``after`` the correction. It consists of the number of
          ``edges`` (pairs of pixels), the ``mean`` difference (1 is the mean of the example) and the share of
          ``outliers``.
        - ``flattened``: The plane that the example was found to show obliquely, as `texrs.planes.Plane.as_dict`. The
          example is then flattened first, if ``way`` and ``elements`` have their defaults. Otherwise None.
        - ``operations``: For each copy, the operations on each element. An entry contains the ``element``, its
          ``operations`` and, if the element replaces another one, the translation to its ``place`` in pixels.
        - ``tiling``: Result of `texrs.check_tiling` for each axis that wraps: ``tiles``, ``seam`` and ``place``.

    Raises
    ------
    InvalidInput
        An argument has the wrong type or is out of range.
    LimitExceeded
        The size exceeds 2^28 pixels, or needs more memory than the machine has.

    See Also
    --------
    design_variants : Generate many different textures of one example, which is analysed only once.

    Notes
    -----
    Each pixel of the result needs 18 bytes, or 14 bytes plus twice the bytes of a pixel of the image if this is more.
    Another 0.5 GB are always needed, so that 16384 x 16384 pixels of 8-bit RGB need 5.9 GB. ``method="paper"`` needs
    24 more bytes per pixel. Several exemplars need 100 more bytes per pixel, plus 75 for each exemplar. A map of
    ``weights`` needs another 8 for each exemplar.

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
    >>> texrs.design(stones, 96, copies=1, way="move").report["segmentation"]
    'labels'
    >>> still = texrs.design(pebbles, 128, deformation=texrs.DeformationOptions(rotate=0, allow_mirror=False))

    """
    return next(make_textures(asked))


@verb(DesignVariants, "exemplar")
def design_variants(asked: DesignVariants) -> Iterator[Synthesis]:
    """Synthesise several different textures from one example, which is analysed only once.

    The arguments are checked when the function is called. Each texture is computed when the iterator reaches it, so
    that finished textures are available if the work stops. It equals the result of `design` with its seed.

    Parameters
    ----------
    {parameters}

    Returns
    -------
    iterator of Synthesis
        One result for each seed. Stages and report are as in `design`.

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
    return make_textures(asked)


def make_textures(arguments: DesignRequest) -> Iterator[Synthesis]:
    """Segment the exemplars, and synthesise a texture for each seed."""
    with answering(arguments.watch, "segment", 0.0):
        flat, view = flatten_exemplar(arguments)
    plans = segment(flat)
    for number, seed in enumerate(arguments.seeds, start=1):
        made = make_texture(plans, flat, seed)
        if view is not None:
            made = refer_to_view(made, view, arguments)
        if number == len(arguments.seeds):
            arguments.watch("done", 1.0)
        yield made


def segment(arguments: DesignRequest) -> list[Plan]:
    """Segment each exemplar, and decide how its elements can move (step 1)."""
    plans: list[Plan] = []
    # The printed algorithm moves whole layers, so elements are not segmented.
    elements = replace(arguments.search, segmentation="none") if arguments.literal else arguments.search
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


def make_texture(plans: Sequence[Plan], arguments: DesignRequest, seed: int) -> Synthesis:
    """Synthesise one texture from analysed exemplars (steps 2 to 6)."""
    try:
        tiles, composite = make_composite(plans, arguments, seed)
    except InvalidInput:
        # A new arrangement can be too large for the size of the texture. Then the next best way is used.
        others = [choose_other(plan) for plan in plans]
        if others == list(plans):
            raise
        return make_texture(others, arguments, seed)
    picture = look_up(composite, arguments)
    image, seams = correct_colours(composite, picture, arguments)
    report = describe(plans, tiles, composite, seams, arguments, seed)
    if any(arguments.wrap):
        found = check_result(image, None, arguments.wrap, regular=plans[0].parts.repeats is not None)
        report["tiling"] = report_tiling(found, arguments.wrap)
    return Synthesis(image, composite, draw_stages(plans[0], tiles[0], picture), report)


def refer_to_view(made: Synthesis, view: FlatView, arguments: DesignRequest) -> Synthesis:
    """Return a texture of a flattened exemplar as a texture of the exemplar itself."""
    source = say_finish(made.source_map.compose(view.source), arguments)
    picture = look_up(source, arguments)
    image, seams = correct_colours(source, picture, arguments)
    report = {**made.report, "seams": seams, "flattened": view.plane.as_dict()}
    return Synthesis(image, source, {**made.stages, "before_blending": picture}, report)


def report_share(watch: Progress, number: int, count: int, stage: str, share: float) -> None:
    """Report the progress of one of several equal parts."""
    watch(stage, (number + share) / count)

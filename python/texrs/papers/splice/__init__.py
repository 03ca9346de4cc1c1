"""Arrange the elements of one texture in the layout of another (SPLICE).

Y. Liu, J. Wang, S. Xue, X. Tong, S. B. Kang and B. Guo, "Texture splicing", Computer Graphics Forum 28(7), 2009. The
paper's texton is called element here. The steps, in the paper's order, and the module of each step:

1. Scale and rotate B's layout to the spacing and the orientation of A's, and match the points one to one (section 4.1,
   Eq. 4: `matching`). A is extended beyond its borders (`texture_extension`), and the targets are adjusted to the
   elements (`adjustment`).

2. Deform A so that its elements move to their targets and rigid pixels keep their shape (section 4.2: `deformation`).
   Displacements are interpolated between disjoint elements (`interpolation`). For connected figures they minimise the
   energy of Eq. 5, Table 1 and Figure 5 (`energy`).

3. Draw the deformed mesh backwards, to find the source of each output pixel (Figure 6: `backward_warp`).

4. Fill the holes, and refine pixels that are not rigid by texture synthesis (section 4.3: `draft`, `refine`).

The elements are found before these steps (section 3: `texrs.elements`). An edit of a texture's own layout replaces the
first step (Figure 9: `edit`). If another size is requested, the texture is brought to that size before its edit
(`resizing`).

Departures from the paper, with their reasons:

- Both point sets continue beyond their images. They are reflected at lines where the layout continues regularly.
  Without this, a third of the output would be empty, and elements would be missing at its border.

- There can be more elements than targets. The printed algorithm needs point sets of equal size. Here, elements without
  a target are erased. They shrink, and the background around them closes. Without this, a fifth of the output would be
  a hole.

- For connected figures, the layout is shifted so that their elements move least. Displacements of neighbours differ by
  at most a share of an element. Otherwise courses are torn if the layout does not have courses.

- Layouts are enlarged until disjoint elements have room, and elements that still collide are pushed apart. If only the
  spacing is matched, elements touch and form chains.

- Distances are squared in Eq. 4, because the best matching then has no crossings.

- If cells are found in a connected texture, it is composed of these cells, each in a cell of B's layout (`cells`).
  Bending a figure reaches only half of the displacement. A connected texture without cells, such as chainmail, is
  composed of its knots and the lines between them (`nets`). The departures below for connected figures apply if there
  are too few knots, or with ``use_cells=False`` and ``use_nets=False``.

- Disjoint elements move without deformation, by whole pixels, which is the limit of Eq. 5 for large weights. The soft
  energy of the paper stretches components with two pins by dozens of pixels. Displacements of the background are
  harmonic, so no part of it moves further than its elements. They are smooth enough to be solved at every other pixel.

- Eq. 5 sums over rigid pixels only. Other pixels then have no equation and the system is singular, or only the pins of
  a brick wall move. Here other pixels count with weight 0.01. Table 1 lets long joints slide freely. Here a weak
  spring ties them to their neighbours.

- Elements of reflected copies are not mirrored, and elements that the border cuts are left out. With a strength near
  0, cut elements stay in place.

- The background between separate elements of a splice is neither warped nor refined, because refinement blurs it. It
  is completed where the elements were, and grown by patches if more is needed. Each element is cut into it together
  with the surroundings that all elements share, such as a shadow. Colours are corrected along the cuts (`ground`).

- If the light varies across an image of separate elements, it is removed before the elements move. Afterwards the
  light of the new place is applied to each element (`shading`). Without this correction, each element would keep
  the light of its old place.

- Edits of separate elements put them into their new places on the texture's own background, which is completed at
  their old places (`rearrangement`). Pixels that do not move keep their values. If an element that the border cuts
  would move inwards, a complete element replaces it. The departures below for separate elements apply to textures
  whose visible background is too small.

- Wide holes are filled with patches that are as rough as the background. The paper's random pixels look like noise
  there, and the patches with the best fit are the smoothest and look blurred.

- Refinement does not change rigid pixels, so elements that the warp copied stay as they are. Other pixels are only
  replaced by background pixels.

- Previews, and edits that list moved points, use triangles between elements, so that a moved element changes only its
  surroundings.

``method="paper"`` leaves out departures where possible (`texrs.papers.splice.literal`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal, TypeAlias

from texrs._arrays import as_bool, as_float, as_method, as_seed, as_size, check_work
from texrs._progress import listen
from texrs._typing import Array, Progress
from texrs._verbs import takes_materials
from texrs.elements import ElementAnalysis, Layout
from texrs.errors import InvalidInput
from texrs.materials import Material
from texrs.papers.splice.adjustment import adjust_targets, crop_extension, straighten_rows
from texrs.papers.splice.backward_warp import warp_backwards
from texrs.papers.splice.cells import find_entry_cells, splice_cells
from texrs.papers.splice.draft import draft_pixels
from texrs.papers.splice.edit import as_steps
from texrs.papers.splice.entry import as_elements
from texrs.papers.splice.ground import lay_ground, survey
from texrs.papers.splice.literal import fill_literally, match_literally
from texrs.papers.splice.matching import (
    Match,
    edit_layout,
    interpolate_layouts,
    is_own,
    keep_cut,
    match_edit,
    match_layouts,
)
from texrs.papers.splice.nets import has_knots, is_net, splice_nets
from texrs.papers.splice.rearrangement import rearrange
from texrs.papers.splice.refine import fill, refine_places
from texrs.papers.splice.resizing import check_resized, crop, read_elements, report_resized
from texrs.papers.splice.result import compose, compose_edit
from texrs.point_sets import spacing
from texrs.synthesis import Synthesis

__all__ = ["self_splice", "splice"]

Method: TypeAlias = Literal["paper", "preview"] | None
NO_NET = "elements must have at least six knots that are at least 8 pixels apart; use a larger image, or another box"
NO_CELLS = "no reliable cells were found; give texrs.elements.analyse a box around one cell, or a mask of the joints"
SCREENING = 0.01
"""Default weight of the original values in the colour correction.

It evens out light that changes slowly.
"""
Edit: TypeAlias = str | Mapping[str, Any] | Sequence[Mapping[str, Any]]


@takes_materials("elements", beside=("layout",), analysed=True)
def splice(
    elements: ElementAnalysis | Material | Array,
    layout: ElementAnalysis | Material | Array,
    size: int | Sequence[int] | None = None,
    *,
    seed: int = 0,
    method: Method = None,
    strength: float = 1.0,
    layout_scale: float | None = None,
    align: bool | None = None,
    snap_rows: bool = False,
    use_cells: bool | None = None,
    use_nets: bool | None = None,
    allow_rotation: bool | None = None,
    refine: bool = True,
    screening: float | None = SCREENING,
    progress: Progress | bool | None = None,
) -> Synthesis:
    """Arrange the elements of one texture like those of another.

    Parameters
    ----------
    elements : ElementAnalysis, or (H, W) or (H, W, C) array
        Texture whose elements are used. An image is first analysed by `texrs.elements.analyse`.
    layout : ElementAnalysis, or array
        Texture or drawn layout (`texrs.layouts`) that determines the positions of the elements.
    size : int or (rows, columns), optional
        Size of the result, in pixels. Default: the size of the image of ``elements``.
    seed : int
        Seed of the patches that fill holes, and of the noise of the refinement, 0 to 2^64 - 1. Default: 0.
    method : {None, "paper", "preview"}
        Algorithm to use. "paper" is the algorithm as printed, with only its misprints repaired. "preview" draws
        triangles between the moved elements, without keeping elements rigid or filling holes. Default: the algorithm
        with departures from the paper.
    strength : float
        Fraction of the way that elements move, from their own layout (0) to the other layout (1). With 0, separate
        elements stay in place, so the result at the texture's own size equals the texture. Default: 1.
    layout_scale : float, optional
        Scale of the layout, 0.01 to 100. With 1, a pixel of the layout is a pixel of the result, and the centres of
        both images coincide. With 2, separate elements are half as dense along each axis. Elements that are too dense
        are pushed apart. Default: the scale that fits the layout to the spacing or the size of the elements.
    align : bool, optional
        If True, the layout is rotated so that lines of its points agree with lines of the elements. This has no effect
        on cells and nets. Default: True if ``layout_scale`` is not given.
    snap_rows : bool
        If True, target positions that are nearly in a row are moved onto one line. For example, the long joints of a
        curved wall become straight. Default: False.
    use_cells : bool, optional
        If True, a connected texture is composed of its cells. If False, its figure is bent. Default: True if cells are
        found.
    use_nets : bool, optional
        If True, a connected texture is composed of its knots and the lines between them, even if it has cells. If
        False, its figure is bent. Default: True if the texture has no cells and a reliable layout of at least six
        knots, and ``use_cells`` is not given.
    allow_rotation : bool, optional
        If True, cells may be rotated. Default: True, unless light or letters show which side of the texture is up.
    refine : bool
        If True, deformed pixels between rigid elements, or stretched pixels of cells, are refined. Nets, and separate
        elements on their own background, are never refined. Default: True.
    screening : float, optional
        Weight of the original values when colours are corrected at the borders between elements and background, 0 to
        1e6, see `texrs.blend`. This only affects separate elements on their background. A texture that is lit from one
        side gives a result that is lit in the same way. None or 0: colours are not corrected, and the image is the
        texture at the coordinates of the source map. Default: 0.01.
    progress : callable or True, optional
        Function called as ``progress(stage, share)`` with the finished share of the stage. If it raises an exception,
        the work stops. True shows a progress bar. Default: none.

    Returns
    -------
    Synthesis
        The ``image``, the ``source_map``, the ``stages`` and the ``report``. Coordinates of the source map are whole
        pixels of ``elements``. Its label is the number of a rigid pixel's target, counted from 1 in the order of the
        report's "matches", and 0 for other pixels. Stages are drawn on access. If ``report["method"]`` is "cells",
        coordinates are fractional and each pixel has a target. If it is "nets", each pixel has the target of its knot.

        Stages:

        - ``source points``: Centres of the elements in the first texture.
        - ``target points``: Centres of the elements in the layout.
        - ``mask``: The first texture with its background dimmed.
        - ``matching``: Line from each element to its target.
        - ``warped mesh``: Mesh that moves the elements.
        - ``before refinement``: The deformed texture, with its holes.
        - ``filled``: The deformed texture with its holes filled.
        - ``source cells``: Cells of the first texture, for method "cells".
        - ``source net``: Knots and lines of the first texture, for method "nets".
        - ``target layout``: Elements of the layout, for methods "cells" and "nets".
        - ``target cells``: Outlines of the target cells, for method "cells".
        - ``target net``: Knots and lines of the target, for method "nets".
        - ``assignment``: Target cells in the colour of their source cell, for method "cells".
        - ``cuts``: Borders between the cells or knots, for methods "cells" and "nets".
        - ``before_blending``: The resulting image.

        Report:

        - ``method``: "default", "paper", "cells" or "nets".
        - ``seed``: The seed.
        - ``size``: (rows, columns).
        - ``layout``: Kind of the layout of ``elements``: "disjoint", "jointed" or "connected".
        - ``scale``: Scale factor of the other layout.
        - ``angle``: Rotation of the other layout, in degrees.
        - ``gain``: Factor within ``scale`` that makes room for the elements, or 1 if they fit without it.
        - ``targets``: Number of targets.
        - ``candidates``: Number of elements that may be used, including copies beyond the borders.
        - ``cost``: Mean squared distance from an element to its target, in pixels squared.
        - ``displacement_reached``: Share of the requested displacements that was reached, 0 to 1.
        - ``screening``: Weight of the original values in the colour correction.
        - ``holes``: Share of the pixels that were filled.
        - ``triangles``: Number of triangles of the mesh.
        - ``flipped``: Share of triangles that the deformation turned over.
        - ``flipped_rigid``: Share of triangles that are in elements and were turned over.
        - ``system``: Rows and columns of the grid of solved pixels.
        - ``strength``: The strength, for methods "cells" and "nets".
        - ``allow_rotation``: True if cells could rotate, for method "cells".
        - ``continued``: How the layout was continued beyond its image, for methods "cells" and "nets".
        - ``cells``: For method "cells": ``count``, number of ``usable`` cells, ``size`` in pixels, ``polarity`` and
          ``confidence``.
        - ``knots``: For method "nets": ``count``, ``spacing`` in pixels and number of ``lines``.
        - ``grown``: Share of the pixels that no knot covers, for method "nets".
        - ``present``: Share of the targets whose element is visible, for methods "cells" and "nets".
        - ``matches``: One entry per target. ``target`` is the requested place, and ``found`` is the element's place in
          the result. ``displacement_reached`` is the reached share of the displacement. ``element`` is the number of
          the element and ``point`` its place in the example. Cells also have a ``turn`` and a ``scale``.

    Raises
    ------
    InvalidInput
        The textures or options cannot be spliced. The message gives the reason.

    References
    ----------
    .. [1] Y. Liu et al., "Texture splicing", Computer Graphics Forum 28(7), 2009.

    Examples
    --------
    >>> import texrs
    >>> from texrs.elements import ElementAnalysis, Layout
    >>> buttons = ElementAnalysis.of_sample(texrs.samples.dots((128, 128)))
    >>> stones = ElementAnalysis.of_sample(texrs.samples.pebbles((128, 128)))
    >>> result = texrs.splice(buttons, stones, seed=1, screening=None)
    >>> row, column = result.source_map.coordinates[30, 40].astype(int)
    >>> result.image.shape, bool((result.image[30, 40] == buttons.image[row, column]).all())
    ((128, 128, 3), True)

    """
    progress = listen(progress)
    as_method(method, None, "paper", "preview")
    number, part, screening = as_seed(seed), as_float(strength, "strength", 0, 1), _as_screening(screening)
    enlarged = None if layout_scale is None else as_float(layout_scale, "layout_scale", 0.01, 100)
    turned = enlarged is None if align is None else as_bool(align, "align")
    if enlarged is not None and method == "paper":
        raise InvalidInput(
            'layout_scale: cannot be combined with method="paper", which scales the layout to the spacing of the elements'
        )
    given = {"use_cells": use_cells, "use_nets": use_nets, "allow_rotation": allow_rotation}
    wanted, net, may_turn = (None if v is None else as_bool(v, n) for n, v in given.items())
    for name, either in (("refine", refine), ("snap_rows", snap_rows)):
        if either is not None:
            as_bool(either, name)
    for name, asked in (("use_cells", wanted), ("use_nets", net)):
        if asked and method is not None:
            raise InvalidInput(
                f'{name}: cannot be combined with method="{method}", which deforms connected textures instead'
            )
    if wanted and net:
        raise InvalidInput(
            "use_nets: cannot be combined with use_cells, because a texture is composed either of cells or of knots"
        )
    # Analyse the images only after all cheap checks of the arguments.
    watch, shape = progress or (lambda stage, share: None), None if size is None else as_size(size, minimum=16)
    mine, theirs = as_elements(elements, "elements", watch), as_elements(layout, "layout", watch)
    rows, columns = shape or as_size(mine.mask.shape, minimum=16)
    check_work("splice", [mine.image, theirs.image], (rows, columns))
    if net and not has_knots(mine):
        raise InvalidInput(
            f"use_nets: {'elements must be a net, got separate elements' if mine.layout == Layout.DISJOINT else NO_NET}"
        )
    # Compose a connected texture of its cells, if it has any.
    found = find_entry_cells(mine, watch) if method is None and wanted is not False and not net else None
    if wanted and found is None:
        raise InvalidInput(
            f"use_cells: {'elements must have cells, got separate elements' if mine.layout == Layout.DISJOINT else NO_CELLS}"
        )
    if found is not None:
        return splice_cells(
            mine,
            theirs,
            found,
            (rows, columns),
            strength=part,
            scale=enlarged,
            turns=may_turn,
            refine=bool(refine),
            seed=number,
            watch=watch,
        )
    # Compose a net of its knots, unless the caller chose another way.
    if net or (net is None and wanted is None and method is None and is_net(mine)):
        theirs_cells = find_entry_cells(theirs, watch)
        return splice_nets(
            mine, theirs, theirs_cells, (rows, columns), strength=part, scale=enlarged, seed=number, watch=watch
        )
    # Match elements with targets, and adjust the targets.
    watch("match", 0.0)
    if method == "paper":
        match = match_literally(mine, theirs, (rows, columns), align=turned)
    else:
        match = match_layouts(mine, theirs, (rows, columns), align=turned, scale=enlarged)
    if part < 1:
        match = interpolate_layouts(mine, match, part)
    match = replace(match, wanted=match.targets)
    if method != "paper":
        match = adjust_targets(mine, match, snap=bool(snap_rows), part=part < 1 or is_own(mine, theirs))
    elif snap_rows:
        match = straighten_rows(match)
    if part < 1 and method is None and mine.layout == Layout.DISJOINT and mine.mask.shape == (rows, columns):
        match = keep_cut(mine, match, part)
    match = crop_extension(mine, match, (rows, columns))
    watch("match", 1.0)
    return _synthesize(
        mine,
        theirs,
        match,
        (rows, columns),
        number,
        method=method,
        refine=bool(refine),
        screening=screening,
        watch=watch,
    )


@takes_materials("elements", analysed=True)
def self_splice(
    elements: ElementAnalysis | Material | Array,
    edit: Edit | None = None,
    size: int | Sequence[int] | None = None,
    *,
    seed: int = 0,
    method: Method = None,
    refine: bool = True,
    screening: float | None = SCREENING,
    progress: Progress | bool | None = None,
) -> Synthesis:
    """Rearrange the elements of one texture by editing their layout (Figure 9).

    Parameters
    ----------
    elements : ElementAnalysis, or (H, W) or (H, W, C) array
        Texture to edit. An image is first analysed by `texrs.elements.analyse`.
    edit : str, mapping, or sequence of mappings, optional
        Steps of the edit in order: scale, shift, rows, randomise, regularise, move, remove or points. Python accepts
        plain JSON types. Steps change the layout, but not the size of elements.  ``{"op": "scale", "factor": 1.2}`` or
        ``[1.2, 1]`` scales the layout, not the elements. ``{"op": "shift", "by": [4, 0]}`` moves all elements by rows
        and columns, in pixels. ``{"op": "rows", "by": 6}`` moves every other row to the right and the other rows to
        the left. ``{"op": "randomise", "amount": 0.25, "least": 0.7}`` adds Gaussian displacements with a standard
        deviation of 0.25 spacings. The minimum distance of elements is then 0.7 of the usual minimum. ``{"op":
        "regularise", "amount": 1}`` moves elements onto the lattice that fits best. ``{"op": "move", "element": 3,
        "by": [0, 8]}`` moves one element; ``"to"`` gives its new place instead. ``{"op": "remove", "element": 3}``
        removes one element. ``{"op": "points", "points": [[row, column], ...]}`` lists new places. A name without
        options is a step with its defaults. The report's "edit" lists the steps. Default: the layout is not changed.
    size : int or (rows, columns), optional
        Size of the result, in pixels, at least 16 along each axis. Before the edit, the texture is continued to a
        larger size, or cropped to its middle. A larger result continues the texture's own layout, as in a splice with
        itself. A smaller result is the middle of the texture. The steps use the element numbers of the report's
        "elements", which lists their places before the steps. Default: the size of the image of ``elements``.
    seed : int
        Seed of random steps, elements that enter over a border, patches in holes, and the noise of the refinement, 0
        to 2^64 - 1. Default: 0.
    method : {None, "paper", "preview"}
        Algorithm to use. "paper" is the algorithm as printed, with only its misprints repaired. "preview" draws
        triangles between the moved elements, without keeping elements rigid or filling holes. Default: the algorithm
        with departures from the paper.
    refine : bool
        If True, deformed pixels are refined. Only connected figures, and separate elements whose visible background is
        too small, are deformed. Default: True.
    screening : float, optional
        Weight of the original values when colours are corrected where moved elements meet the background, 0 to 1e6, as
        in `splice`. This only affects separate elements on their background. None or 0: colours are not corrected.
        Default: 0.01.
    progress : callable or True, optional
        Function called as ``progress(stage, share)`` with the finished share of the stage. If it raises an exception,
        the work stops. True shows a progress bar. Default: none.

    Returns
    -------
    Synthesis
        The ``image``, the ``source_map``, the ``stages`` and the ``report``. Coordinates of the source map are whole
        pixels of ``elements``. Its label is the number of a rigid pixel's target, counted from 1 in the order of the
        report's "matches", and 0 for other pixels. If nothing moves, the image equals the texture. If elements are
        separate, pixels that do not move keep their values.

        Stages:

        - ``resized``: The texture in the new size, if ``size`` is given.
        - ``source points``: Centres of the elements in the texture.
        - ``target points``: Centres of the elements in the layout.
        - ``mask``: The texture with its background dimmed.
        - ``matching``: Line from each element to its target.
        - ``warped mesh``: Mesh that moves the elements.
        - ``before refinement``: The texture with elements in their new places, with its holes.
        - ``filled``: This texture with its holes filled.
        - ``before_blending``: The resulting image.

        Report:

        - ``method``: "default" or "paper".
        - ``seed``: The seed.
        - ``size``: (rows, columns).
        - ``layout``: Kind of the layout of ``elements``: "disjoint", "jointed" or "connected".
        - ``scale``: Scale factor of the layout.
        - ``angle``: Rotation of the layout, in degrees.
        - ``gain``: Factor within ``scale`` that makes room for the elements, or 1 if they fit without it.
        - ``targets``: Number of targets.
        - ``candidates``: Number of elements that may be used, including copies beyond the borders.
        - ``cost``: Mean squared distance from an element to its target, in pixels squared.
        - ``displacement_reached``: Share of the requested displacements that was reached, 0 to 1.
        - ``screening``: Weight of the original values in the colour correction.
        - ``holes``: Share of the pixels that were filled.
        - ``triangles``: Number of triangles of the mesh.
        - ``flipped``: Share of triangles that the deformation turned over.
        - ``flipped_rigid``: Share of triangles that are in elements and were turned over.
        - ``system``: Rows and columns of the grid of solved pixels.
        - ``matches``: One entry per target. ``target`` is the requested place, and ``found`` is the element's place in
          the result. ``displacement_reached`` is the reached share of the displacement. ``element`` is the number of
          the element and ``point`` its place in the example.
        - ``changed``: Share of the pixels that changed.
        - ``edit``: The steps, each with all its options.
        - ``elements``: Places of the elements before the edit, if ``size`` is given.

    Raises
    ------
    InvalidInput
        A step is unknown, lacks an option, or names an element that does not exist. A step removes an element of a
        connected figure, which has no background that could close the gap. The size is invalid, or the resized texture
        has fewer than three elements.
    LimitExceeded
        The requested size is too large.

    Examples
    --------
    >>> import texrs
    >>> from texrs.elements import ElementAnalysis, Layout
    >>> entry = ElementAnalysis.of_sample(texrs.samples.dots((96, 96)))
    >>> same = texrs.self_splice(entry, {"op": "move", "element": 0, "by": [0, 0]})
    >>> bool((same.image == entry.image).all())
    True
    >>> texrs.self_splice(entry, "randomise", seed=5).report["edit"]
    [{'op': 'randomise', 'seed': 5}]
    >>> texrs.self_splice(entry, size=(128, 160), seed=5).image.shape
    (128, 160, 3)

    """
    progress = listen(progress)
    as_method(method, None, "paper", "preview")
    asked, number = None if size is None else as_size(size, minimum=16), as_seed(seed)
    steps, screening = as_steps(() if edit is None else edit, number), _as_screening(screening)
    watch = progress or (lambda stage, share: None)
    mine = as_elements(elements, "elements", watch)
    check_work("self_splice", [mine.image], asked or mine.mask.shape, "elements" if asked is None else "size")
    # If another size is requested, extend or crop the texture first, and then edit the result.
    if asked is not None and asked != mine.mask.shape:
        rest: dict[str, Any] = {
            "seed": number,
            "method": method,
            "refine": refine,
            "screening": screening,
            "progress": watch,
        }
        inside = all(n <= m for n, m in zip(asked, mine.mask.shape, strict=True))
        resized = crop(mine, asked) if inside else splice(mine, mine, asked, align=False, **rest)
        entry = read_elements(mine, resized)
        edited = self_splice(check_resized(entry), steps, **rest) if steps else resized
        return report_resized(mine, entry, resized, edited, steps)
    # Rearrange separate elements on their background, and warp all other textures.
    laid = rearrange(mine, steps, number, watch) if method is None and mine.layout == Layout.DISJOINT else None
    if laid is not None:
        result = compose_edit(mine, laid, seed=number, screening=screening)
        watch("done", 1.0)
    else:
        moved = edit_layout(mine, steps)
        result = _synthesize(
            mine,
            None,
            match_edit(mine, moved),
            (mine.mask.shape[0], mine.mask.shape[1]),
            number,
            method=method,
            refine=bool(refine),
            watch=watch,
            listed=moved.listed,
        )
    return replace(result, report={**result.report, "edit": steps})


def _as_screening(screening: object) -> float:
    return as_float(0.0 if screening is None else screening, "screening", 0, 1e6)


def _synthesize(
    a: ElementAnalysis,
    b: ElementAnalysis | None,
    match: Match,
    size: tuple[int, int],
    seed: int,
    *,
    method: Method,
    refine: bool,
    watch: Progress,
    screening: float = 0.0,
    listed: bool = False,
) -> Synthesis:
    """Deform the texture, draw it into the output, fill its holes and refine it (sections 4.2 and 4.3)."""
    warp = warp_backwards(a, match, size, method=method, listed=listed, progress=watch)
    draft, label = draft_pixels(a, match, warp, whole=method is None)
    scene = survey(a) if b and method is None and a.layout == Layout.DISJOINT else None
    laid = lay_ground(scene, match, draft, label, seed, watch) if scene is not None else None
    if laid is not None:
        filled = laid
    elif method == "paper":
        filled = fill_literally(draft, seed)
    elif method == "preview":
        filled = draft
    else:
        filled = fill(a.image, draft, spacing(a.points), seed, watch)
    places = filled.places
    if refine and method != "preview" and laid is None:
        places = refine_places(a.image, a.wrap, filled, seed, watch)
    weight = screening if laid is not None else 0.0
    light = scene.light if scene is not None else None
    result = compose(
        a, b, match, warp, draft, filled, places, label, method=method, seed=seed, screening=weight, light=light
    )
    watch("done", 1.0)
    return result

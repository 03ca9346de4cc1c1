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

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from texrs._verbs import verb
from texrs.elements import ElementAnalysis, Layout
from texrs.errors import InvalidInput
from texrs.exemplar.cells import Cells
from texrs.papers.splice.adjustment import adjust_targets, crop_extension, straighten_rows
from texrs.papers.splice.backward_warp import warp_backwards
from texrs.papers.splice.cells import find_entry_cells, splice_cells
from texrs.papers.splice.draft import draft_pixels
from texrs.papers.splice.entry import SelfSplice, Splice
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

NO_NET = "elements must have at least six knots that are at least 8 pixels apart; use a larger image, or another box"
NO_CELLS = "no reliable cells were found; give texrs.elements.analyse a box around one cell, or a mask of the joints"


@verb(Splice, "elements", beside=("layout",), analysed=True)
def splice(asked: Splice) -> Synthesis:
    """Arrange the elements of one texture like those of another.

    Parameters
    ----------
    {parameters}

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
    for find, make in PIPELINES:
        found = find(asked)
        if found is not None:
            return make(asked, found)
    raise AssertionError("the last pipeline suits all textures")


@verb(SelfSplice, "elements", analysed=True)
def self_splice(asked: SelfSplice) -> Synthesis:
    """Rearrange the elements of one texture by editing their layout (Figure 9).

    Parameters
    ----------
    {parameters}

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
    mine, steps = asked.mine, asked.steps
    # If another size is requested, extend or crop the texture first, and then edit the result.
    if asked.size is not None and asked.size != mine.mask.shape:
        rest: dict[str, Any] = {
            "seed": asked.seed,
            "method": asked.method,
            "refine": asked.refine,
            "screening": asked.screening,
            "progress": asked.watch,
        }
        inside = all(n <= m for n, m in zip(asked.size, mine.mask.shape, strict=True))
        resized = crop(mine, asked.size) if inside else splice(mine, mine, asked.size, align=False, **rest)
        entry = read_elements(mine, resized)
        edited = self_splice(check_resized(entry), steps, **rest) if steps else resized
        return report_resized(mine, entry, resized, edited, steps)
    # Rearrange separate elements on their background, and warp all other textures.
    separate = asked.method is None and mine.layout == Layout.DISJOINT
    laid = rearrange(mine, steps, asked.seed, asked.watch) if separate else None
    if laid is not None:
        result = compose_edit(mine, laid, seed=asked.seed, screening=asked.screening)
        asked.watch("done", 1.0)
    else:
        moved = edit_layout(mine, steps)
        size = (mine.mask.shape[0], mine.mask.shape[1])
        result = deform(asked, None, match_edit(mine, moved), size, listed=moved.listed)
    return replace(result, report={**result.report, "edit": steps})


def find_cells(asked: Splice) -> Cells | None:
    """Return the cells of a connected texture, if it has any and is composed of them."""
    if asked.method is not None or asked.use_cells is False or asked.use_nets:
        return None
    found = find_entry_cells(asked.mine, asked.watch)
    if asked.use_cells and found is None:
        separate = asked.mine.layout == Layout.DISJOINT
        raise InvalidInput(f"use_cells: {'elements must have cells, got separate elements' if separate else NO_CELLS}")
    return found


def find_net(asked: Splice) -> bool | None:
    """Return True if a net is composed of its knots, and None for other textures."""
    if asked.use_nets and not has_knots(asked.mine):
        separate = asked.mine.layout == Layout.DISJOINT
        raise InvalidInput(f"use_nets: {'elements must be a net, got separate elements' if separate else NO_NET}")
    free = asked.use_nets is None and asked.use_cells is None and asked.method is None
    return True if asked.use_nets or (free and is_net(asked.mine)) else None


def find_match(asked: Splice) -> Match:
    """Match elements with targets, and adjust the targets."""
    mine, theirs, size, part = asked.mine, asked.theirs, asked.extent, asked.strength
    asked.watch("match", 0.0)
    if asked.method == "paper":
        match = match_literally(mine, theirs, size, align=asked.turned)
    else:
        match = match_layouts(mine, theirs, size, align=asked.turned, scale=asked.layout_scale)
    if part < 1:
        match = interpolate_layouts(mine, match, part)
    match = replace(match, wanted=match.targets)
    if asked.method != "paper":
        match = adjust_targets(mine, match, snap=asked.snap_rows, part=part < 1 or is_own(mine, theirs))
    elif asked.snap_rows:
        match = straighten_rows(match)
    if part < 1 and asked.method is None and mine.layout == Layout.DISJOINT and mine.mask.shape == size:
        match = keep_cut(mine, match, part)
    match = crop_extension(mine, match, size)
    asked.watch("match", 1.0)
    return match


PIPELINES: tuple[tuple[Callable[[Splice], Any], Callable[[Splice, Any], Synthesis]], ...] = (
    (find_cells, splice_cells),
    (find_net, lambda asked, found: splice_nets(asked, find_entry_cells(asked.theirs, asked.watch))),
    (find_match, lambda asked, found: deform(asked, asked.theirs, found, asked.extent)),
)
"""Ways to compose a texture, each with a function that returns what it needs, or None if it does not suit.

The first suitable way is used.
"""


def deform(
    asked: Splice | SelfSplice, b: ElementAnalysis | None, match: Match, size: tuple[int, int], *, listed: bool = False
) -> Synthesis:
    """Deform the texture, draw it into the output, fill its holes and refine it (sections 4.2 and 4.3)."""
    a, method, seed, watch = asked.mine, asked.method, asked.seed, asked.watch
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
    if asked.refine and method != "preview" and laid is None:
        places = refine_places(a.image, a.wrap, filled, seed, watch)
    weight = asked.screening if laid is not None else 0.0
    light = scene.light if scene is not None else None
    result = compose(
        a, b, match, warp, draft, filled, places, label, method=method, seed=seed, screening=weight, light=light
    )
    watch("done", 1.0)
    return result

"""SPLICE: the elements of one texture in the arrangement of another.

Y. Liu, J. Wang, S. Xue, X. Tong, S. B. Kang and B. Guo, "Texture splicing", Computer Graphics Forum 28(7), 2009. Its texton
is our element. The flow, in the paper's order, and where each stage is:

1. bring B's layout to the spacing and the orientation of A's and match the points one to one (section 4.1, Eq. 4: `matching`,
   on A as it goes on beyond its borders, `extension`); adjust the targets to what goes there (`adjustment`);
2. deform A so that its elements go there, and what is rigid keeps its shape (section 4.2, `deformation`: `interpolation`
   between disjoint elements, the `energy` of Eq. 5, Table 1 and Figure 5 for connected figures);
3. draw the deformed mesh backwards: where each pixel of the output comes from (Figure 6, `backward_warp`);
4. fill the holes and refine what is not rigid by texture synthesis (section 4.3: `draft`, `refine`).

Elements are analysed beforehand (section 3; `texrs.elements`). An edit of a texture's own layout takes the place of the first
stage (Figure 9, `edit`); where it is asked for in another size the texture is brought to that first (`resizing`).

Departures, with their reasons:

- Both point sets go on beyond their pictures, by reflection at the lines where the layout goes on as it is: otherwise
  a third of the output is empty, and elements at its border are missing.
- There are more elements than targets; those that go nowhere are erased. As printed, point sets must have equal size. What is
  erased shrinks, and the ground around it closes in: else a fifth of the output is a hole.
- Connected figures take the layout where their elements go least far, and neighbours differ in how far they go by no more
  than a share of an element: else courses are torn where a layout has none.
- Layouts grow until disjoint elements have room, and those that still collide are pushed apart: spacing alone makes chains.
- Distances are squared in Eq. 4: the best matching then has no crossings.
- Connected textures whose cells are found are put together from these, each in a cell of B's layout (`cells`): bending a
  figure goes half of the way. Those without, as chainmail, are put together from their knots and what hangs on these (`nets`).
  What follows of connected figures is for those that show too few knots, for `use_cells=False` and for `use_nets=False`.
- Disjoint elements move whole, by whole pixels: Eq. 5 in the limit of its weights. The soft energy stretches components that
  hold two pins by dozens of pixels. The ground between them is harmonic, so nothing of it moves further than its elements, and
  so smooth that it is solved for at every other pixel.
- Eq. 5 sums over rigid pixels only, so the others have no equation and the system is singular, or, for brick walls,
  moves nothing but its pins: here they count a hundredth. Long joints, which the decoupling of Table 1 leaves free to slide,
  are tied to their neighbours by a weak spring.
- Elements that reflection mirrors are turned back, and those that the border cuts are left out; with no or little strength they
  stay where they are.
- In splices the ground between separate elements is neither warped nor refined, which averages it: it is completed where the
  elements were, grown by patches where more is needed, and each element is cut into it with what lies around all of them
  alike, its shadow say; colours are corrected where they meet (`ground`).
- Light that differs across a picture of separate elements is taken off before they are moved, and put back after, in the
  measure in which it falls on elements (`light`): else each brings that of its old place.
- Edits of separate elements put these into their new places on the texture's own ground, completed where one was
  (`rearrangement`): what does not move keeps its bytes. Where an element that the border cuts would come in, a whole one takes
  its place. What follows of separate elements is for textures that show too little of their ground.
- Wide holes are filled with patches of the ground, as rough as it is: random pixels come out as noise there, and of patches the
  smoothest fit best, which looks blurred.
- Refinement leaves what is rigid as it is, and so whatever the warp copied whole: there is nothing to mend. In its
  place nothing comes that is not ground itself.
- Triangles between elements carry previews, and edits that list moved points: what moves then changes its neighbours alone.

``method="paper"`` leaves out what can be left out (`texrs.papers.splice.literal`).
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
    go_part_of_the_way,
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
NO_NET = "elements has fewer than six knots, or they lie closer than 8 pixels; take a larger picture, or another box"
NO_CELLS = "none were found that are sure enough; give texrs.elements.analyse a box around one, or a mask of the joints"
SCREENING = 0.01
"""Weight of the values when colours are corrected, by default: light that changes slowly is evened out."""
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
    """Arrange the elements of one texture as those of another are.

    Parameters
    ----------
    elements : ElementAnalysis, or (H, W) or (H, W, C) array
        The texture whose elements are shown; a picture is analysed by `texrs.elements.analyse`.
    layout : ElementAnalysis, or array
        The texture whose layout they take, or a layout that was drawn (`texrs.layouts`).
    size : int or (rows, columns), optional
        Size of the result, in pixels; that of ``elements`` by default.
    seed : int
        Chooses what fills holes, and the noise of the refinement.
    method : {None, "paper", "preview"}
        "paper": the algorithm as printed, with only its misprints repaired. "preview": triangles between the elements,
        drawn where these go; nothing is kept rigid or filled.
    strength : float
        How much of the way elements go, from the texture's own layout, 0, to the other's, 1. With 0, separate elements at the
        texture's own size make the texture itself.
    layout_scale : float, optional
        What the layout is enlarged by, 0.01 to 100: its pixels are those of the result at 1, the middle of the one on that of
        the other. Twice as large, separate elements lie half as dense along each axis; where too dense they are pushed
        apart. By default it is brought to the spacing, or the size, of the elements of ``elements``.
    align : bool, optional
        Whether to turn the layout so that lines of its points agree with those of ``elements``; by default where no
        ``layout_scale`` is given. Cells and nets take it as it lies.
    snap_rows : bool
        Whether to bring targets of about one row to one row: for walls that are bent, whose long joints then stay straight.
    use_cells : bool, optional
        Whether a connected texture is put together from its cells; False bends its figure. By default where cells are found.
    use_nets : bool, optional
        Whether a connected texture is put together from its knots and the lines that hang on them; False bends its figure.
        By default where no cells are found, unless ``use_cells`` is given, and there are six knots or more in a layout that is
        sure enough. True goes before cells.
    allow_rotation : bool, optional
        Whether cells may be turned; by default where nothing tells ``elements`` from itself upside down, as light and
        letters do.
    refine : bool
        Whether to refine what is not rigid; by cells, what is stretched. Nets, and ground between separate elements, need none.
    screening : float, optional
        Of separate elements on their ground: weight of the values, 0 to 1e6, when colours are corrected so that the light
        does not change where they meet, see `texrs.blend`; where the texture has a lit side the result has it too, and things
        do not bring the light of their old places. None or 0: no correction, and the picture is the texture looked up through
        the source map. All else is not corrected.
    progress : callable or True, optional
        Called as ``progress(stage, share)``, with the share of the stage that is done; raising stops the work.
        True shows a bar.

    Returns
    -------
    Synthesis
        The picture; a source map of whole pixels of ``elements``, whose label is the target (counted from 1, as in the report)
        that a rigid pixel belongs to, or 0; pictures of the stages, drawn when they are looked at; and a report, whose
        "matches" say of each element where it was wanted, where it is, and how much of its way was realised. By cells
        (``report["method"]`` is "cells") the map lies between pixels, and each has its target; by knots ("nets") each has
        that whose knot it hangs on.

        Stages:

        - ``source points``: Elements of the first texture.
        - ``target points``: Elements of the layout.
        - ``mask``: Mask of these elements.
        - ``matching``: Line from each element to its target.
        - ``warped mesh``: Mesh that moves the elements.
        - ``before refinement``: Elements in their new places.
        - ``filled``: The result with a filled background.
        - ``source cells``: Cells of the first texture, for method "cells".
        - ``source net``: Knots and lines of the first texture, for method "nets".
        - ``target layout``: Elements of the layout, for both methods.
        - ``target cells``: Outlines of the target cells.
        - ``target net``: Knots and lines of the target.
        - ``assignment``: Cells in the colour of their source.
        - ``cuts``: Borders between the pieces.
        - ``before_blending``: The result.

        Report:

        - ``method``: "default", "paper", "cells" or "nets".
        - ``seed``: The seed.
        - ``size``: (rows, columns).
        - ``layout``: Kind of the own layout: "disjoint", "jointed" or "connected".
        - ``scale``: Factor that the other layout was scaled by.
        - ``angle``: Angle that this layout was turned by, in degrees.
        - ``gain``: Part of the scale that makes room for the elements.
        - ``targets``: Number of targets.
        - ``candidates``: Number of elements to choose from, with those beyond the borders.
        - ``cost``: Mean squared distance from an element to its target, in pixels squared.
        - ``displacement_reached``: Share of their ways that elements were moved, 0 to 1.
        - ``screening``: Weight of the values in the colour correction.
        - ``holes``: Share of the pixels that were filled.
        - ``triangles``: Number of triangles of the mesh.
        - ``flipped``: Share of triangles that are turned over.
        - ``flipped_rigid``: Share of triangles inside of elements that are turned over.
        - ``system``: Size of the grid that the equations were solved on.
        - ``strength``: The strength, for methods "cells" and "nets".
        - ``allow_rotation``: Whether cells could turn, for method "cells".
        - ``continued``: How the layout was continued beyond its image.
        - ``cells``: For method "cells": ``count``, number of ``usable`` cells, ``size`` in pixels, ``polarity`` and
          ``confidence``.
        - ``knots``: For method "nets": ``count``, ``spacing`` in pixels and number of ``lines``.
        - ``grown``: Share of the pixels that no knot covers, for method "nets".
        - ``present``: Share of the targets whose element is visible.
        - ``matches``: For each target: its place (``target``), the place where the element is (``found``), ``realised``, the
          number of the ``element`` and its ``point`` in the example. Cells also have a ``turn`` and a ``scale``.

    Raises
    ------
    InvalidInput
        Entries or options that cannot be spliced; the message says why.

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
        raise InvalidInput('layout_scale: method="paper" brings the layout to the spacing of the elements')
    given = {"use_cells": use_cells, "use_nets": use_nets, "allow_rotation": allow_rotation}
    wanted, net, may_turn = (None if v is None else as_bool(v, n) for n, v in given.items())
    for name, either in (("refine", refine), ("snap_rows", snap_rows)):
        if either is not None:
            as_bool(either, name)
    for name, asked in (("use_cells", wanted), ("use_nets", net)):
        if asked and method is not None:
            raise InvalidInput(f'{name}: method="{method}" bends figures')
    if wanted and net:
        raise InvalidInput(
            "use_nets: a texture is put together either from its cells or from its knots; give one of the two"
        )
    watch, shape = progress or (lambda stage, share: None), None if size is None else as_size(size, minimum=16)
    mine, theirs = as_elements(elements, "elements", watch), as_elements(layout, "layout", watch)
    rows, columns = shape or as_size(mine.mask.shape, minimum=16)
    check_work("splice", [mine.image, theirs.image], (rows, columns))
    if net and not has_knots(mine):
        raise InvalidInput(f"use_nets: {'separate elements are no net' if mine.layout == Layout.DISJOINT else NO_NET}")
    found = find_entry_cells(mine, watch) if method is None and wanted is not False and not net else None
    if wanted and found is None:
        raise InvalidInput(
            f"use_cells: {'separate elements have none' if mine.layout == Layout.DISJOINT else NO_CELLS}"
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
    if net or (net is None and wanted is None and method is None and is_net(mine)):
        theirs_cells = find_entry_cells(theirs, watch)
        return splice_nets(
            mine, theirs, theirs_cells, (rows, columns), strength=part, scale=enlarged, seed=number, watch=watch
        )
    watch("match", 0.0)
    if method == "paper":
        match = match_literally(mine, theirs, (rows, columns), align=turned)
    else:
        match = match_layouts(mine, theirs, (rows, columns), align=turned, scale=enlarged)
    if part < 1:
        match = go_part_of_the_way(mine, match, part)
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
    """Edit the layout of a texture's own elements (Figure 9).

    Parameters
    ----------
    elements : ElementAnalysis, or (H, W) or (H, W, C) array
        The texture; a picture is analysed by `texrs.elements.analyse`.
    edit : str, mapping, or sequence of mappings, optional
        What is done, step by step: scale, shift, rows, randomise, regularise, move, remove or points. In plain JSON
        types: ``{"op": "scale", "factor": 1.2}`` or ``[1.2, 1]`` (the layout, not
        the elements), ``{"op": "shift", "by": [4, 0]}``, ``{"op": "rows", "by": 6}`` (every other row to the right, those
        between to the left), ``{"op": "randomise", "amount": 0.25, "least": 0.7}`` (Gaussian, in spacings; the share of the
        least usual distance that is kept), ``{"op": "regularise", "amount": 1}`` (to the lattice that fits best),
        ``{"op": "move", "element": 3, "by": [0, 8]}`` or ``"to"``, ``{"op": "remove", "element": 3}``,
        ``{"op": "points", "points": [[row, column], ...]}``. A name alone is a step with its
        defaults; no step, the default, leaves the layout as it is. The report's "edit" replays.
    size : int or (rows, columns), optional
        Size of the result, in pixels, sides of at least 16; that of ``elements`` by default. In a larger one the texture's own
        layout goes on, as in a splice with itself, before the steps are done; a smaller one is the middle of the texture. Steps
        then count the elements as the report's "elements" lists them, whose places they have before the steps.
    seed : int
        Chooses random steps, the elements that come in over a border, what fills holes, and the noise of the refinement.
    method : {None, "paper", "preview"}
        "paper": the algorithm as printed, with only its misprints repaired. "preview": triangles between the elements, drawn
        where these go; nothing is kept rigid or filled.
    refine : bool
        Whether to refine what is deformed: connected figures, and separate elements that show too little of their ground.
    screening : float, optional
        Of separate elements on their ground: weight of the values, 0 to 1e6, when the colours of what changed are corrected
        so that the light does not change where things meet, as in `splice`. All else keeps its values. None or 0: no
        correction.
    progress : callable or True, optional
        Called as ``progress(stage, share)``, with the share of the stage that is done; raising stops the work.
        True shows a bar.

    Returns
    -------
    Synthesis
        The picture; a source map of whole pixels of ``elements``, whose label is the target (counted from 1, as in the report)
        that a rigid pixel belongs to, or 0; pictures of the stages; and a report. Where nothing is moved the picture is the
        texture, exactly; of separate elements, all that does not move is.

        Stages:

        - ``resized``: The texture in the new size, if a size was given.
        - ``source points``: Elements of the first texture.
        - ``target points``: Elements of the layout.
        - ``mask``: Mask of these elements.
        - ``matching``: Line from each element to its target.
        - ``warped mesh``: Mesh that moves the elements.
        - ``before refinement``: Elements in their new places.
        - ``filled``: The result with a filled background.
        - ``before_blending``: The result.

        Report:

        - ``method``: "default" or "paper".
        - ``seed``: The seed.
        - ``size``: (rows, columns).
        - ``layout``: Kind of the own layout: "disjoint", "jointed" or "connected".
        - ``scale``: Factor that the other layout was scaled by.
        - ``angle``: Angle that this layout was turned by, in degrees.
        - ``gain``: Part of the scale that makes room for the elements.
        - ``targets``: Number of targets.
        - ``candidates``: Number of elements to choose from, with those beyond the borders.
        - ``cost``: Mean squared distance from an element to its target, in pixels squared.
        - ``displacement_reached``: Share of their ways that elements were moved, 0 to 1.
        - ``screening``: Weight of the values in the colour correction.
        - ``holes``: Share of the pixels that were filled.
        - ``triangles``: Number of triangles of the mesh.
        - ``flipped``: Share of triangles that are turned over.
        - ``flipped_rigid``: Share of triangles inside of elements that are turned over.
        - ``system``: Size of the grid that the equations were solved on.
        - ``matches``: For each target: its place (``target``), the place where the element is (``found``), ``realised``, the
          number of the ``element`` and its ``point`` in the example. Cells also have a ``turn`` and a ``scale``.
        - ``changed``: Share of the pixels that changed.
        - ``edit``: The steps, each with all its options.
        - ``elements``: Places of the elements before the edit, if a size was given.

    Raises
    ------
    InvalidInput
        A step that is not known, lacks something, or names an element that is not there, or one to be removed from a
        connected figure, which has no ground to close over it; a size that is no size, or that shows fewer than three
        elements, of which no step can make a layout.
    LimitExceeded
        A size that is too large.

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
    """Deform the texture, draw it backwards, fill and refine: sections 4.2 and 4.3, which splices and edits share."""
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

"""Ways of laying a texture from one exemplar. Each gives a source map of any size, on the torus if it wraps.

- "move": patches of copies whose elements moved, as in the paper (sections 3.1 and 3.3).
- "still": patches of the unchanged exemplar and its mirror images, on a grid.
- "lattice": the same for an exemplar on a lattice, or with a single period, such as stripes. Patches are in step with
  it. It is stretched so that whole periods fit a periodic texture. If this would change it too much, this way is refused.
- "courses": patches of sheets that are built from the courses of the exemplar.
- "stitch": patches of the unchanged exemplar, each where it fits best.
- "cells": bent cells of the exemplar in a new arrangement of its cells, for jointed cells and heaps.
- "sow": whole elements in a new arrangement, on a background that is grown from the exemplar's background.

All but the first are departures from the paper. `texrs.papers.design.trials` chooses between them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from texrs._typing import Floats, Progress
from texrs.exemplar.regularity import bend
from texrs.exemplar.symmetry import flip_frame
from texrs.growth import stitch_image
from texrs.kernels.gather import sample
from texrs.mosaic import rearrange_cells
from texrs.papers.design.arguments import DesignRequest
from texrs.papers.design.canvas import Tile
from texrs.papers.design.course_sheets import lay_sheets, measure_stones
from texrs.papers.design.deformation import classify
from texrs.papers.design.plan import Plan, Way
from texrs.papers.design.sown_elements import lay_sown_elements, list_whole
from texrs.quilting import Picture, quilt
from texrs.source_map import SourceMap

__all__ = ["DEEP", "find_obstacle", "lay", "list_ways"]

PATCH, OVERLAP = 0.6, 0.25
"""Side of a patch and overlap of two patches, as shares of the exemplar's shorter side."""
DEEP = 6.0
"""Depth in pixels beyond which all pixels of an element count as equally deep."""
FEWEST = 6
"""Minimum number of whole elements for a new arrangement."""
STRICT = 0.65
"""Minimum correlation of a lattice for trying only ways that are in step with it."""
SMALLEST = 12
"""Minimum size of cells that are bent, in pixels. The joints of smaller cells are not wide enough for cuts."""


def list_ways(plan: Plan, size: tuple[int, int], wrap: tuple[bool, bool]) -> list[Way]:
    """Return the ways that are tried for an exemplar, for textures of a size."""
    ways: list[Way] = ["move", "courses", "lattice", "still", "stitch", "cells", "sow"]
    if plan.parts.courses:
        # Elements that move, and a lattice, would break the courses.
        ways = ["courses", "still", "stitch", "cells"]
        return [way for way in ways if not find_obstacle(plan, way, size, wrap)]
    if plan.parts.kind == "grid":
        # Moved cells of a grid show more seams than patches, and nothing else.
        ways.remove("move")
    if plan.parts.lattice is not None and find_obstacle(plan, "lattice", size, wrap):
        ways.remove("sow")
    elif plan.parts.period is not None:
        # Patches on a grid that are not in step are not better.
        ways.remove("lattice" if find_obstacle(plan, "lattice", size, wrap) else "still")
    elif plan.parts.lattice is not None and plan.parts.lattice.correlation >= STRICT:
        # Large patches keep a strict lattice as well as the stitcher does, and a trial takes time.
        ways = [way for way in ways if way in ("move", "lattice")]
    elif plan.parts.lattice is not None:
        ways = [way for way in ways if way in ("move", "lattice", "stitch", "cells")]
    return [way for way in ways if not find_obstacle(plan, way, size, wrap)]


def find_obstacle(plan: Plan, way: Way, size: tuple[int, int], wrap: tuple[bool, bool]) -> str:
    """Return the reason against a way of laying a texture of a size, or an empty text if there is none."""
    parts = plan.parts
    found = parts.kind in ("components", "labels")
    if way == "courses" and not parts.courses:
        return "no courses were found in the exemplar"
    if way == "lattice" and parts.repeats is None:
        return "no lattice or single period was found in the exemplar"
    if way == "lattice" and parts.repeats is not None and parts.repeats.close(size, wrap) is None:
        return parts.repeats.explain(size, wrap)
    if way == "cells" and not (found and (parts.layout in ("jointed", "heap") or parts.kind == "labels")):
        return "neither jointed cells nor a heap of elements were found in the exemplar"
    if way == "sow" and not (found and plan.pure and classify(parts) == "apart"):
        return "no separate elements on a background were found in the exemplar"
    if way in ("cells", "sow") and len(whole := list_whole(plan)) < FEWEST:
        return f"fewer than {FEWEST} whole elements were found in the exemplar"
    if way == "cells" and np.median([e.area for e in whole]) < SMALLEST**2:
        return f"the cells in the exemplar are smaller than {SMALLEST} pixels"
    return ""


def lay(number: int, plans: Sequence[Plan], tiles: Sequence[Tile], arguments: DesignRequest, seed: int) -> SourceMap:
    """Lay a texture from one of the exemplars, in the way of its plan."""
    plan, watch = plans[number], partial(report_share, arguments.watch, number, len(plans))
    if plan.way == "stitch":
        return stitch_patches(number, arguments, seed, watch)
    if plan.way == "cells":
        return lay_new_cells(number, plan, arguments, seed)
    if plan.way == "sow":
        bare = quilt_tiles(
            [draw_picture(tiles[0], np.zeros_like(tiles[0].colours[..., 0]))], plan, arguments, seed, watch
        )
        return lay_sown_elements(plan, bare, arguments.wrap, seed)
    courses = plan.parts.courses if plan.way == "courses" else None
    pictures = (
        draw_pictures(plan, tiles, arguments) if courses is None else draw_sheets(plan, tiles[0], arguments, seed)
    )
    return quilt_tiles(pictures, plan, arguments, seed, watch, fixed=None if courses is None else courses.axis)


def quilt_tiles(
    pictures: list[Picture],
    plan: Plan,
    arguments: DesignRequest,
    seed: int,
    watch: Callable[[float], object],
    *,
    fixed: int | None = None,
) -> SourceMap:
    """Stitch large patches of images into a texture."""
    side = min(plan.guide.shape[:2])
    return quilt(
        pictures,
        arguments.extent,
        patch=round(PATCH * side),
        overlap=round(OVERLAP * side),
        wrap=arguments.wrap,
        fixed=fixed,
        seed=seed,
        progress=watch,
    )


def stitch_patches(number: int, arguments: DesignRequest, seed: int, watch: Callable[[float], object]) -> SourceMap:
    """Stitch patches of one exemplar, each from the place where it fits best. The patches are not mirrored."""
    coordinates, patches, frame = stitch_image(
        arguments.guides[number], arguments.extent, arguments.wrap, seed, lambda stage, share: watch(share)
    )
    exemplars = np.full(patches.shape, number, np.uint16)
    frames = np.broadcast_to(frame, (int(patches.max()) + 1, 2, 2)).copy()
    return SourceMap(coordinates, exemplars, patches, frames, arguments.shapes)


def lay_new_cells(number: int, plan: Plan, arguments: DesignRequest, seed: int) -> SourceMap:
    """Lay bent cells of an exemplar in a new arrangement of its cells. The result is always periodic."""
    turns = (True, True) in plan.mirrors
    laid = rearrange_cells(plan.parts.elements, plan.guide, arguments.extent, turns=turns, seed=seed)
    exemplars = np.full(arguments.extent, number, np.uint16)
    return SourceMap(laid.places, exemplars, laid.label, laid.frames, arguments.shapes)


def draw_pictures(plan: Plan, tiles: Sequence[Tile], arguments: DesignRequest) -> list[Picture]:
    """Return the tiles as sources of patches. Whole periods are stretched to fit a periodic texture."""
    depth, lattice = measure_depth(plan), plan.parts.repeats
    closing = None if lattice is None else lattice.close(arguments.extent, arguments.wrap)
    if closing is None:
        return [draw_picture(tile, depth) for tile in tiles]
    pictures = []
    for tile in tiles:
        colours, source, shifts = tile.colours, tile.source, None
        if lattice is not None and closing is not None:
            mirror = flip_frame(tile.mirror)
            shifts = mirror @ closing @ lattice.vectors
            if any(arguments.wrap):
                source = bend(source.shape, mirror @ closing @ mirror).compose(source)
                colours = sample(plan.guide, source.coordinates, interpolation="cubic")
        shown = sample(depth, source.coordinates, interpolation="nearest")
        pictures.append(Picture(colours, source, shown, lattice is not None, shifts))
    return pictures


def draw_picture(tile: Tile, depth: Floats) -> Picture:
    """Return a tile as a source of patches, with the depth of the exemplar's pixels inside elements."""
    return Picture(tile.colours, tile.source, sample(depth, tile.source.coordinates, interpolation="nearest"))


def draw_sheets(plan: Plan, tile: Tile, arguments: DesignRequest, seed: int) -> list[Picture]:
    """Return sources of patches for an exemplar in courses: sheets of its courses, as tall as the texture."""
    courses = plan.parts.courses
    assert courses is not None
    axis = courses.axis
    level = courses.level(plan.guide.shape[:2]).compose(tile.source)
    depth = DEEP * measure_stones(courses, sample(plan.guide, level.coordinates, interpolation="cubic"), DEEP)
    sheets = lay_sheets(
        courses,
        level.shape,
        arguments.extent[axis],
        min(level.shape),
        count=arguments.copies,
        wrap=arguments.wrap[axis],
        mirror=(axis == 1, axis == 0) in plan.mirrors,
        seed=seed,
    )
    pictures = []
    for sheet in sheets:
        source = sheet.compose(level)
        colours = sample(plan.guide, source.coordinates, interpolation="cubic")
        pictures.append(Picture(colours, source, sample(depth, sheet.coordinates, interpolation="nearest")))
    return pictures


def measure_depth(plan: Plan) -> Floats:
    """Return the depth of each pixel of an exemplar inside an element, so that seams run between elements."""
    parts = plan.parts
    if parts.kind not in ("components", "labels"):
        return np.zeros(plan.guide.shape[:2], np.float32)
    return DEEP * parts.measure_depth(DEEP)


def report_share(watch: Progress, number: int, count: int, share: float) -> None:
    """Report the progress of one of several equal parts."""
    watch("stitch", (number + share) / count)

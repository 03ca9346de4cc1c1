"""Fill holes in images of several planes. Each plane is filled from its own visible pixels, in its own perspective.

Parts outside the planes, such as the sky above a floor, continue behind the planes. Two planes that meet in a hole are
both filled a little beyond their visible part, and cut at the line where they meet (`texrs.inpainting._sides`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import guidance
from texrs._light import divide_out, measure_lights
from texrs._masks import widen
from texrs._typing import Array, Bools, Floats, Progress
from texrs.exemplar.symmetry import NONE
from texrs.inpainting._fill import fill
from texrs.inpainting._holes import paint_over
from texrs.inpainting._patches import choose_mirrors
from texrs.inpainting._sides import share_out
from texrs.planes import Plane
from texrs.scale_maps.slope import LEVEL, Slope
from texrs.source_map import SourceMap

LEAST = 0.05
"""Minimum scale of a visible point of a plane, relative to the scale in the middle.

Smaller scales are near the horizon.
"""
FEWEST = 0.02
"""Minimum share of the image outside the planes. A smaller part does not continue behind them."""
BESIDE = 0.5
"""Maximum coordinate of a corner along the direction towards the camera, if the corner shows a part behind the planes.

Each axis of the image is from -1 to 1.
"""
MOSTLY = 0.8
"""Share of the pixels around a hole that must show the same part. The hole then belongs to this part."""
ALIKE = 0.15
"""Largest difference of the mean colours, 0 to 1, of regions of one part, such as the sky on both sides of a tower."""
BAND, NARROWEST, WIDEST = 0.4, 16, 64
"""Width of the band that extends a plane beyond its visible part, if it meets another plane.

The unit is the square root of its area. The minimum and the maximum are in pixels.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A part of an image with holes that continues in them."""

    shown: Bools
    """Mask of the visible pixels, (H, W)."""
    slope: Slope | None = None
    """Orientation of the part. None: seen from the front."""
    reach: Bools | None = None
    """Mask of the pixels that the part can reach, (H, W). None: all pixels."""
    large: Bools | None = None
    """Mask of the places where enough of the part is visible to continue behind other parts, (H, W).

    None: everywhere that it is visible.
    """

    @classmethod
    def of(cls, shown: Bools, plane: Plane | None, origin: Sequence[int] = (0, 0)) -> Part:
        """Return the part of an image that shows a plane.

        ``origin`` is the position (row, column) of the first pixel in the plane's own image.
        """
        if plane is None:
            return cls(shown)
        places = np.moveaxis(np.indices(shown.shape), 0, -1) + np.asarray(origin)
        return cls(shown, lay(plane, shown.shape, origin), plane.width(places) > LEAST)


def lay(plane: Plane, shape: Sequence[int], origin: Sequence[int] = (0, 0)) -> Slope | None:
    """Return the slope of a plane in an image (rows, columns) that begins at ``origin`` in the plane's own image.

    The result is None if the plane is seen from the front. Pixels beyond its horizon do not count.
    """
    middle = np.array(plane.principal_point) - origin
    corners = np.array([[y, x] for y in (0, shape[0] - 1) for x in (0, shape[1] - 1)], np.float64)
    widths = plane.width(corners + np.asarray(origin))
    least, largest = max(float(widths.min()), LEAST), float(widths.max())
    if largest < LEVEL * least:
        return None
    row, column = plane.principal_point
    one, *beside = plane.width([[row, column], [row + 1, column], [row, column + 1]]).tolist()
    rise = [round(w - one, 12) for w in beside]
    steep = hypot(*rise)
    down = (rise[0] / steep, rise[1] / steep)
    return Slope((float(middle[0]), float(middle[1])), 1.0, steep, down, (-down[1], down[0]), least, largest, 0.0)


def add_rest(parts: Sequence[Part], hole: Bools, pixels: Array) -> list[Part]:
    """Return the parts, and the regions outside them that continue behind them.

    A sky or a wall surrounds a hole, or contains an image corner towards which a plane recedes from the camera. Floors
    recede upwards if their orientation is not known. An object on a plane, such as a cup on a table, is not such a
    region. Regions of different colours are different parts: a wall does not continue as the sky next to it.
    """
    from scipy.ndimage import label

    rest = ~hole
    for part in parts:
        rest = rest & ~part.shown
    pieces, count = label(rest)
    areas = np.bincount(pieces.ravel(), minlength=count + 1)
    rows, columns = (np.flatnonzero((~hole).any(axis=axis)) for axis in (1, 0))
    behind = np.zeros(count + 1, np.bool_)
    for y, row in ((-1, rows[0]), (1, rows[-1])):
        for x, column in ((-1, columns[0]), (1, columns[-1])):
            downs = [(1.0, 0.0) if part.slope is None else part.slope.down for part in parts]
            behind[pieces[row, column]] |= min(y * down[0] + x * down[1] for down in downs) <= BESIDE
    holes, number = label(hole)
    for each in range(1, number + 1):
        around = pieces[widen(holes == each, 1) & ~hole]
        behind |= np.bincount(around, minlength=count + 1) > MOSTLY * max(1, len(around))
    behind &= areas >= FEWEST * np.count_nonzero(~hole)
    behind[0] = False
    colours, groups = guidance(paint_over(pixels, hole)), list[tuple[Floats, list[int]]]()
    for piece in sorted(np.flatnonzero(behind).tolist(), key=lambda n: (-int(areas[n]), n)):
        own = colours[pieces == piece].mean(axis=0, dtype=np.float64).astype(np.float32)
        like = next((group for mean, group in groups if float(np.abs(own - mean).max()) <= ALIKE), None)
        if like is None:
            groups.append((own, [piece]))
        else:
            like.append(piece)
    found = [Part(np.isin(pieces, group), large=np.isin(pieces, group)) for _, group in groups]
    if found:
        # Pixels of objects on a plane are assigned to the first region, but do not continue: they are not in
        # ``large``.
        found[0] = Part(found[0].shown | (rest & ~behind[pieces]), large=found[0].large)
    return [*parts, *found]


@dataclass(frozen=True, slots=True, eq=False)
class Mended:
    """An image whose holes are filled, each part separately."""

    source: SourceMap
    owner: NDArray[np.uint16]
    """Part that each pixel shows, (H, W)."""
    replaced: Bools
    """Mask of the pixels that are copied from other places, (H, W)."""
    counts: tuple[int, ...]
    """Number of patches of each part."""
    shades: NDArray[np.uint8]
    """(H, W) grey levels: where each part was visible, lighter for earlier parts; 0 in the holes and outside all parts."""

    def finish(self, screening: float, first: tuple[int, int] | None) -> dict[str, Any]:
        """Return the arguments of `RenderOptions`.

        Seams are corrected, except where two parts meet, because the colours of one part would bleed into the other.
        If the position of the first pixel in the known image is given, patches are adapted to the light.
        """
        if not screening and first is None:
            return {}
        apart = self.owner if len(self.counts) > 1 else None
        return {"screening": screening or None, "within": self.replaced, "parts": apart, "light": first}

    def show(self, pixels: Array, hole: Bools) -> dict[str, Array]:
        """Return the stages: the known pixels, the part of each pixel, and the patches, each in its own shade."""
        known = pixels.copy()
        known[hole] = pixels[~hole].min()
        shades = np.zeros(hole.shape, np.uint8)
        shades[self.replaced] = 55 + self.source.label[self.replaced] * 67 % 200
        return {"known": known, "ground": self.shades, "patches": shades}


def fill_parts(
    pixels: Array,
    hole: Bools,
    parts: Sequence[Part],
    *,
    boundary: int = 0,
    element_width: int = 0,
    light: bool = False,
    patch: int | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> Mended:
    """Fill the holes of an image.

    Parameters
    ----------
    pixels : (H, W, C) array
        Image. Its values in the holes have no effect.
    hole : (H, W) bool
        Mask of the pixels to fill.
    parts : sequence of Part
        Parts that continue in the holes.
    boundary : int
        Width of the band around the holes that may also change, in pixels.
    element_width : int
        Width of this band on planes with separate elements, in pixels.
    light : bool
        If True, patches are compared and continued as they would look in even light.
    patch : int, optional
        Side of the patches in pixels.
    seed : int
        Seed of the random choices of patches that have no known pixels around them.
    progress : callable, optional
        Function that is called with the stage and its finished share.

    """
    everywhere = np.ones_like(hole)
    seen = [p.shown if p.large is None else p.large for p in parts]
    # Divide the holes between the parts, up to the lines where the parts meet.
    owner = share_out(hole, seen, [everywhere if p.reach is None else p.reach for p in parts])
    shades = np.zeros(hole.shape, np.uint8)
    belongs = owner.copy()
    for number, part in enumerate(parts):
        belongs[(belongs < 0) & part.shown] = number
        if part.large is None:
            shades[part.shown] = 255 - 40 * min(number, 5)
    belongs[belongs < 0] = len(parts) - 1
    # Compare patches in even light, so that they can be copied from a darker place.
    known = even_light(pixels, hole, [(belongs == n) & ~hole for n in range(len(parts))] if light else [])
    identity = SourceMap.identity(hole.shape)
    coordinates, label = identity.coordinates, identity.label
    frames = np.broadcast_to(np.eye(2, dtype=np.float32), (*hole.shape, 2, 2)).copy()
    counts = []
    for number, part in enumerate(parts):
        region = owner == number
        if not region.any():
            counts.append(0)
            continue
        open_ = region
        near, far = (region | (widen(region, width) & part.shown) for width in (boundary, max(boundary, element_width)))
        if len(parts) > 1:
            band = round(min(max(BAND * float(np.count_nonzero(region)) ** 0.5, NARROWEST), WIDEST))
            open_ = region | (widen(region, band) & ~part.shown)
        usable = part.shown if part.large is None else part.large
        usable = usable if usable.any() else ~hole
        made = fill(
            [known],
            open_,
            open_ | near,
            far=open_ | far,
            usable=usable & ~hole,
            plane=part.slope,
            scales=None,
            patch=patch,
            mirrors=(NONE,) if part.slope is not None else choose_mirrors([known], open_, None),
            wrap=(False, False),
            seed=seed,
            progress=progress,
        )
        new = far & (made.source.label > 0)
        coordinates[new] = made.source.coordinates[new]
        frames[new] = made.source.jacobians()[new]
        label[new] = made.source.label[new] + sum(counts)
        counts.append(made.count)
        belongs[new] = number
    return Mended(
        SourceMap(coordinates, identity.exemplar, label, frames, (hole.shape,)),
        belongs.astype(np.uint16),
        label > 0,
        tuple(counts),
        shades,
    )


def even_light(pixels: Array, hole: Bools, parts: Sequence[Bools]) -> Array:
    """Return an image with its holes painted over, and with the light of each part divided out if it is uneven."""
    lights = measure_lights(pixels, parts)
    if all(light is None for light in lights):
        return paint_over(pixels, hole)
    even = divide_out(pixels, lights, parts)
    if pixels.dtype.kind == "u":
        even = np.clip(even / np.float32(np.iinfo(pixels.dtype).max), 0, 1)
    return paint_over(even, hole)

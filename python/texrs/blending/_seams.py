"""Seams of a source map, and the values of the sources on both sides of each seam."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from texrs import _rust
from texrs._typing import Array, Bools, Floats, Interpolation
from texrs.blending._values import Samples
from texrs.source_map import SourceMap

ALONG = 2.0
"""Standard deviation, in pixels, of the window along a seam that is used to detect outlines."""
REACH = 8
"""Radius of the window, in pixels."""
BELL = np.exp(-0.5 * np.square(np.arange(REACH + 1) / ALONG))
# Round, because the last bits of exponentials depend on the processor.
WINDOW = np.round(BELL / (2 * BELL.sum() - 1), 15).tolist()
"""Weights of the window by distance. They sum to 1 over both directions."""
OUTLINE = (0.35, 0.6)
"""Minimum shares of the step across a seam that are also present in one of its sources.

Above the first share, the seam may be an outline of an element. Above the second share, it certainly is an outline.
For seams through noise, the share is at most 0.25.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """A source map with the exemplars, and the options of the look-up."""

    samples: Samples
    known: list[Floats] | None
    source: SourceMap
    across: bool
    """If True, there are seams where two exemplars meet."""
    parts: NDArray[np.uint16] | None
    """Index of the part of each pixel, (H, W). Borders of parts are not seams."""
    outlines: bool
    """If True, the steps across outlines of elements are kept."""
    interpolation: Interpolation
    map_type: Literal["colour", "vector", "slope"]
    green: Literal["up", "down"]

    def look_beside(self, at: tuple[Array, ...], axis: int, step: int) -> tuple[Floats, Bools]:
        """Return the values ``step`` pixels further along an axis in the pixels' sources, and whether they exist."""
        source = self.source
        frames = _list_frames(source, at)
        places = source.coordinates[at] + np.float32(step) * frames[..., axis]
        which = source.exemplar[at]
        # Allow a small tolerance, because the coordinates of mirrored or rotated copies are rounded.
        last = np.array(source.shapes, np.float32)[which] - 1
        inside: Bools = np.all((places >= -1e-3) & (places <= last + np.float32(1e-3)), axis=-1)
        row = SourceMap(
            places[np.newaxis],
            which[np.newaxis],
            np.arange(len(which), dtype=np.uint32)[np.newaxis],
            None if self.map_type == "colour" else frames,
            source.shapes,
        )
        shown = row.render(
            self.samples.images, interpolation=self.interpolation, map_type=self.map_type, green=self.green
        )
        if self.known is not None:
            inside = inside & (np.abs(row.render(self.known, interpolation=self.interpolation)[0] - 1) < 1e-3)
        return shown[0], inside

    def find_seams(self, axis: int, wrap: bool) -> Seam:
        """Return the seams across an axis, with the target differences minus the differences of the image."""
        at, after = list_seams(self.source, axis, wrap)
        if not self.across:
            same = self.source.exemplar[at] == self.source.exemplar[after]
            at, after = (tuple(index[same] for index in ends) for ends in (at, after))
        if self.parts is not None:
            same = self.parts[at] == self.parts[after]
            at, after = (tuple(index[same] for index in ends) for ends in (at, after))
        if not len(at[0]):
            return Seam(at, after, np.zeros((0, self.samples.channels), np.float32))
        here, _ = self.look_beside(at, axis, 0)
        there, _ = self.look_beside(after, axis, 0)
        ahead, forward = self.look_beside(at, axis, 1)
        behind, backward = self.look_beside(after, axis, -1)
        # Average the differences in both sources. If one of them is outside the exemplar, use only the other.
        own = ((ahead - here) * forward[:, np.newaxis], (there - behind) * backward[:, np.newaxis])
        known = np.maximum(forward.astype(np.float32) + backward, 1)[:, np.newaxis]
        step = there - here
        lack = (own[0] + own[1]) / known - step
        if self.outlines:
            outline = measure_outlines(step, own, at, self.source.shape, cyclic=wrap)
            lack *= 1 - outline[:, np.newaxis]
        return Seam(at, after, lack)


@dataclass(frozen=True, slots=True, eq=False)
class Seam:
    """Pairs of neighbours on both sides of a seam."""

    at: tuple[Array, ...]
    after: tuple[Array, ...]
    lack: Floats
    """Target differences from ``at`` to ``after`` minus the actual differences, (n, C), for values in [0, 1]."""


def measure_outlines(
    step: Floats, own: tuple[Floats, Floats], at: tuple[Array, ...], shape: tuple[int, ...], *, cyclic: bool
) -> Floats:
    """Return the certainty, 0 to 1, that each pair of neighbours is on the outline of a covering element.

    On an outline, one of the sources contains most of the step itself. The steps are summed along the seam, because in
    noise a single pair may agree by chance.
    """
    points = np.stack(at, axis=1, dtype=np.int64)

    def sum_up(values: Floats) -> Floats:
        return _rust.sum_nearby(points, values, shape, cyclic, WINDOW)

    shown = np.maximum(*(sum_up((mine * step).sum(axis=-1)) for mine in own))
    least, sure = OUTLINE
    surely: Floats = np.clip((shown / np.maximum(sum_up((step**2).sum(axis=-1)), 1e-12) - least) / (sure - least), 0, 1)
    return surely


def list_seams(source: SourceMap, axis: int, wrap: bool) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """Return the pixels before and after the seams across an axis, each as (rows, columns)."""
    parted = ~source.is_coherent(axis, wrap=wrap)
    if not wrap:
        np.moveaxis(parted, axis, 0)[-1] = False
    at = np.nonzero(parted)
    after = tuple((index + (a == axis)) % n for a, (index, n) in enumerate(zip(at, source.shape, strict=True)))
    return at, after


def _list_frames(source: SourceMap, at: tuple[Array, ...]) -> NDArray[np.float32]:
    """Return the Jacobians of the given pixels, (n, 2, 2)."""
    frame = source.jacobian_array()
    if frame is None:
        return np.broadcast_to(np.eye(2, dtype=np.float32), (len(at[0]), 2, 2))
    return frame[source.label[at]] if frame.ndim == 3 else frame[at]


def wrap_rows(first: int, last: int, height: int) -> slice | NDArray[np.intp]:
    """Return rows of a periodic image, as a slice without a copy if they do not cross its end."""
    return slice(first, last) if first >= 0 and last <= height else np.arange(first, last) % height


def take_rows(source: SourceMap, rows: slice | NDArray[np.intp]) -> SourceMap:
    """Return some rows of a source map."""
    frame = source.jacobian_array()
    frame = frame if frame is None or frame.ndim == 3 else frame[rows]
    return SourceMap(source.coordinates[rows], source.exemplar[rows], source.label[rows], frame, source.shapes)

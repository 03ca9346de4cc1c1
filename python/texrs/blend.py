"""Seams healed: the colours of a composite corrected so that its differences are those of the exemplar.

Section 3.6 (Eq. 5 and 6) of Shen, Jin, Mao and Feng, "Completion-based texture design using deformation", 2006, after
Agarwala et al., "Interactive digital photomontage", SIGGRAPH 2004. As printed, the differences wanted are those of the
composite itself, whose solution is the composite; here they come from the sources on both sides of a seam.

The correction depends on the source map and on one map of the exemplar alone, so it can be made for each map of a
material: colours, heights, normals, in any dtype.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_float, as_image, as_int, as_mask, as_wrap
from texrs._typing import Array, Bools, Floats, Interpolation, Progress
from texrs.errors import InvalidInput
from texrs.kernels.poisson import Boundary, spread
from texrs.source_map import SourceMap

__all__ = ["Visibility", "blend", "visibility"]

SCREENING = 0.15
"""Weight of the values: with less, rare colours drift by three grey levels and more, with this by two; seams show 1 to
2 % more than with 0.1."""
STRIP = 2**22
"""Pixels that are solved at once; up to four times as many where corrections reach far."""
REACH = 9.0
"""Strips overlap by this over the root of the screening, in pixels: corrections fall to exp(-9) there."""
BAND = 64
"""Rows whose values are converted at once."""
LOOK = 2**22
"""Pixels whose seams are measured, and four times as many as those of an exemplar that they are compared with."""


def blend(
    source: SourceMap,
    exemplars: Array | Sequence[Array],
    *,
    wrap: bool | Sequence[bool],
    screening: float = SCREENING,
    band: int | None = None,
    within: Array | None = None,
    known: Array | Sequence[Array] | None = None,
    interpolation: Interpolation = "cubic",
    kind: Literal["colour", "normal"] = "colour",
    green: Literal["up", "down"] = "up",
    progress: Progress | None = None,
) -> Array:
    """Render a map of the exemplar through a source map, and correct its values so that seams disappear.

    Minimises ``sum((v[q] - v[p] - g[p, q]) ** 2) + screening * sum((v - I) ** 2)`` over neighbours p, q, for each
    channel by itself, where I is ``source.render(exemplars)`` [1]_. Where the source continues from p to q the
    difference wanted, g, is that of I. Across a seam it is the mean of what the sources of p and of q would show there,
    of those that lie inside their exemplar: ``I(S(p) + J(p) e) - I(S(p))`` and ``I(S(q)) - I(S(q) - J(q) e)``; 0 where
    neither does.

    Parameters
    ----------
    source : SourceMap
        Of a picture, shape (H, W).
    exemplars : array, or a sequence of one an exemplar
        Any map of the exemplar's height and width: (h, w) or (h, w, C).
    wrap : bool or (rows, columns)
        Axes along which the picture is cyclic. Along the others the outermost pixels keep their values,
        unless ``within`` says which do.
    screening : float
        Weight of the values against the differences, at least 0; 0 is the paper's. Colours drift over about
        ``screening ** -0.5`` pixels: 0.01 makes the transitions of smooth exemplars softer.
    band : int, optional
        Correct only what is at most this many pixels from a seam; all else keeps its values. By default everything.
    within : (H, W) bool or integers, optional
        Correct only pixels that are True, or not zero; all else keeps its values: of a picture whose hole was filled, the
        hole.
    known : (h, w) bool or integers, or a sequence of one an exemplar, optional
        What of the exemplars may be looked at beyond a seam. By default all.
    interpolation : {"cubic", "linear", "nearest"}
        As in `SourceMap.render`.
    kind, green
        As in `SourceMap.render`; normals are brought back to unit length.
    progress : callable, optional
        Called as ``progress("blend", share)``, with the share that is done; raising stops the work.

    Returns
    -------
    (H, W) or (H, W, C) array
        In the dtype of the exemplar, within the range of its values in each channel; integers are rounded.

    Raises
    ------
    InvalidInput
        The map of a volume; another number of exemplars, or of another size, than the map was made from; an option out
        of range.

    Notes
    -----
    Some values have no meaning between them, and come back as `SourceMap.render` gives them: the last of two or of four
    channels (transparency), and whatever is bool, signed integers or ``interpolation="nearest"`` (labels).

    Pictures of more than 2^22 pixels are solved in overlapping strips of rows, so that beside the result at most
    0.4 GB are needed, if the screening lets corrections die out within a strip: at 0.01, up to 2^15 pixels wide, at
    0.001, up to 2^13. Others, as all without screening, are solved whole, one channel after another: 8 bytes a pixel,
    and 24 for normals.

    References
    ----------
    .. [1] J. Shen, X. Jin, X. Mao, J. Feng, "Completion-based texture design using deformation", The Visual Computer
       22, 2006, section 3.6. :doi:`10.1007/s00371-006-0040-9`

    Examples
    --------
    Two parts of a ramp meet in a step of 40. The ramp goes on across it:

    >>> import numpy as np
    >>> from texrs import SourceMap
    >>> from texrs.blend import blend
    >>> ramp = np.tile(np.uint8(2) * np.arange(60, dtype=np.uint8), (16, 1))
    >>> whole = SourceMap.identity((16, 60))
    >>> places = np.concatenate([whole.coordinates[:, :20], whole.coordinates[:, 40:]], axis=1)
    >>> source = SourceMap(places, whole.exemplar[:, :40], whole.label[:, :40], None, whole.shapes)
    >>> int(np.diff(source.render(ramp)[8].astype(int)).max())
    42
    >>> int(np.diff(blend(source, ramp, wrap=False)[8].astype(int)).max())
    10

    """
    if source.axes != 2:
        raise InvalidInput("source: a picture is needed, got the source map of a volume")
    cyclic = as_wrap(wrap)
    weight = as_float(screening, "screening", 0, 1e6)
    width = None if band is None else as_int(band, "band", 1, 2**31)
    inside = None if within is None else as_mask(within, "within", source.shape)
    result = source.render(exemplars, interpolation=interpolation, kind=kind, green=green)
    several = list(exemplars) if isinstance(exemplars, list | tuple) else [exemplars]
    shown = None if known is None else as_known(known, source.shapes)
    samples = Samples.of([as_image(e) for e in several], kind)
    if samples is None or interpolation == "nearest":
        return result
    # Seen with a channel axis; what is written to it is written to the result.
    pixels = result.reshape((*source.shape, -1))
    strips = list(_strips(source.shape, cyclic[0], weight))
    groups = samples.groups(len(strips), math.prod(source.shape), kind)
    steps = [(part, channels) for part in strips for channels in groups]
    seen: list[Seam] = []
    for number, (part, channels) in enumerate(steps):
        around = (part.cyclic, cyclic[1])
        if channels == groups[0]:
            look = Look(samples, shown, _rows(source, part.rows), interpolation, kind, green)
            seen = [look.across(axis, around[axis]) for axis in range(2)]
        if any(len(seam.lack) for seam in seen):
            report = None if progress is None else _share(progress, number, len(steps))
            marked = None if inside is None else inside[part.rows]
            correction = _correction(look.source.shape, seen, channels, around, weight, width, marked, report)
            samples.correct(pixels[part.kept], correction[part.inner], channels, kind)
        if progress is not None:
            progress("blend", (number + 1) / len(steps))
    return result


def _share(progress: Progress, number: int, steps: int) -> Callable[[float], object]:
    return lambda share: progress("blend", (number + share) / steps)


def as_known(value: object, shapes: Sequence[tuple[int, ...]]) -> list[Floats]:
    """Check masks of the exemplars; 1 is what they have."""
    several = list(value) if isinstance(value, list | tuple) else [value]
    if len(several) != len(shapes):
        raise InvalidInput(f"known: needs a mask for each of {len(shapes)} exemplars, got {len(several)}")
    return [as_mask(k, "known", shape).astype(np.float32) for k, shape in zip(several, shapes, strict=True)]


# --- values ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """The exemplars' values in [0, 1], so that the solver's precision does not depend on their range."""

    images: list[Floats]
    low: float
    span: float
    channels: int
    """How many channels are corrected."""
    least: Array
    most: Array
    """Range of each channel."""

    @classmethod
    def of(cls, given: Sequence[Array], kind: str) -> Samples | None:
        """Scale them; None where no values between theirs make sense."""
        dtype, channels = given[0].dtype, given[0].shape[-1]
        if kind == "normal":
            top = float(np.iinfo(dtype).max) if dtype.kind in "ui" else 1.0
            low = -top if dtype.kind != "u" and min(float(e[..., :3].min()) for e in given) < 0 else 0.0
            high, channels = top, 3
        else:
            if dtype.kind in "bi":
                return None
            channels -= channels in (2, 4)
            low = min(float(e[..., :channels].min()) for e in given)
            high = max(float(e[..., :channels].max()) for e in given)
        if high <= low:
            return None
        if not math.isfinite(high - low):
            raise InvalidInput(f"exemplars: the range of values is too large, {low:g} to {high:g}")
        return cls(
            [_scaled(e[..., :channels], low, high) for e in given],
            low,
            high - low,
            channels,
            np.min([e[..., :channels].min(axis=(0, 1)) for e in given], axis=0),
            np.max([e[..., :channels].max(axis=(0, 1)) for e in given], axis=0),
        )

    def groups(self, strips: int, pixels: int, kind: str) -> list[slice]:
        """Give the channels that are solved together: all, but one by one where a large picture is one strip."""
        if strips > 1 or pixels <= STRIP or kind == "normal":
            return [slice(0, self.channels)]
        return [slice(c, c + 1) for c in range(self.channels)]

    def correct(self, pixels: Array, correction: Floats, channels: slice, kind: str) -> None:
        """Add a correction to channels of pixels in the exemplar's own values, in place."""
        exact = np.dtype("f4" if pixels.dtype.itemsize <= 2 else "f8")
        for rows in _bands(len(pixels)):
            mine = pixels[rows, :, channels]
            value = mine.astype(exact) + correction[rows].astype(exact) * self.span
            if kind == "normal":
                vector = 2 * (value - self.low) / self.span - 1
                vector /= np.maximum(np.linalg.norm(vector, axis=-1, keepdims=True), 1e-12)
                value = (vector + 1) / 2 * self.span + self.low
            else:
                value = np.clip(value, self.least[channels], self.most[channels])
            mine[...] = np.rint(value) if pixels.dtype.kind in "ui" else value


def _scaled(image: Array, low: float, high: float) -> Floats:
    """Bring ``low`` to ``high`` to [0, 1], a band of rows at a time."""
    result = np.empty(image.shape, np.float32)
    for rows in _bands(len(image)):
        result[rows] = (image[rows].astype(np.float64) - low) / (high - low)
    return result


def _bands(rows: int) -> Iterator[slice]:
    """Divide rows so that what is made of them in float64 stays small."""
    return (slice(first, min(first + BAND, rows)) for first in range(0, rows, BAND))


# --- differences -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """A source map with what is looked up through it."""

    samples: Samples
    known: list[Floats] | None
    source: SourceMap
    interpolation: Interpolation
    kind: Literal["colour", "normal"]
    green: Literal["up", "down"]

    def beside(self, at: tuple[Array, ...], axis: int, step: int) -> tuple[Floats, Bools]:
        """Give what the sources of pixels show ``step`` pixels on along an axis, and whether the exemplar has that."""
        source = self.source
        frames = _frames(source, at)
        places = source.coordinates[at] + np.float32(step) * frames[..., axis]
        which = source.exemplar[at]
        # Coordinates of a mirrored or turned copy carry rounding.
        last = np.array(source.shapes, np.float32)[which] - 1
        inside: Bools = np.all((places >= -1e-3) & (places <= last + np.float32(1e-3)), axis=-1)
        row = SourceMap(
            places[np.newaxis],
            which[np.newaxis],
            np.arange(len(which), dtype=np.uint32)[np.newaxis],
            frames if self.kind == "normal" else None,
            source.shapes,
        )
        shown = row.render(self.samples.images, interpolation=self.interpolation, kind=self.kind, green=self.green)
        if self.known is not None:
            inside = inside & (np.abs(row.render(self.known, interpolation=self.interpolation)[0] - 1) < 1e-3)
        return shown[0], inside

    def across(self, axis: int, wrap: bool) -> Seam:
        """Give the seams that cross an axis: the differences wanted less those of the picture."""
        at, after = seams(self.source, axis, wrap)
        if not len(at[0]):
            return Seam(at, after, np.zeros((0, self.samples.channels), np.float32))
        here, _ = self.beside(at, axis, 0)
        there, _ = self.beside(after, axis, 0)
        ahead, forward = self.beside(at, axis, 1)
        behind, backward = self.beside(after, axis, -1)
        known = forward.astype(np.float32) + backward
        total = (ahead - here) * forward[:, np.newaxis] + (there - behind) * backward[:, np.newaxis]
        return Seam(at, after, total / np.maximum(known, 1)[:, np.newaxis] - (there - here))


@dataclass(frozen=True, slots=True, eq=False)
class Seam:
    """Pairs of neighbours that seams part."""

    at: tuple[Array, ...]
    after: tuple[Array, ...]
    lack: Floats
    """What the differences from ``at`` to ``after`` lack, (n, C) in [0, 1]."""


def _correction(
    shape: tuple[int, ...],
    seen: Sequence[Seam],
    channels: slice,
    wrap: tuple[bool, bool],
    screening: float,
    band: int | None,
    within: Bools | None,
    progress: Callable[[float], object] | None,
) -> Floats:
    """Solve for what must be added to some channels of the composite, (H, W, C) in [0, 1].

    With v = I + c the differences wanted of c are g less those of I: nothing but at seams.
    """
    flow = np.zeros((*shape, channels.stop - channels.start), np.float32)
    near = np.zeros(shape if band is not None else (0, 0), bool)
    for seam in seen:
        flow[seam.at] -= seam.lack[:, channels]
        flow[seam.after] += seam.lack[:, channels]
        if band is not None:
            near[seam.at] = near[seam.after] = True
    free = within is not None and not within.all()
    rows, columns = (_boundary(w, free) for w in wrap)
    mask = within
    if band is not None:
        close = _close(near, band, wrap)
        mask = close if within is None else close & within
    spread(flow, screening=screening, boundary=(rows, columns), mask=mask, progress=progress)
    return flow


def seams(source: SourceMap, axis: int, wrap: bool) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """Give the pixels before the seams that cross an axis, and those after them, each as (rows, columns)."""
    parted = ~source.continues(axis, wrap=wrap)
    if not wrap:
        np.moveaxis(parted, axis, 0)[-1] = False
    at = np.nonzero(parted)
    after = tuple((index + (a == axis)) % n for a, (index, n) in enumerate(zip(at, source.shape, strict=True)))
    return at, after


def _frames(source: SourceMap, at: tuple[Array, ...]) -> NDArray[np.float32]:
    """Give the Jacobians of some pixels, (n, 2, 2)."""
    frame = source.frame_array()
    if frame is None:
        return np.broadcast_to(np.eye(2, dtype=np.float32), (len(at[0]), 2, 2))
    return frame[source.label[at]] if frame.ndim == 3 else frame[at]


def _boundary(wrap: bool, free: bool) -> Boundary:
    return "periodic" if wrap else "free" if free else "dirichlet"


def _close(near: Bools, band: int, wrap: tuple[bool, bool]) -> Bools:
    """Mark what is at most ``band`` pixels from a marked pixel, around cyclic axes."""
    from scipy.ndimage import distance_transform_edt

    pads = [min(band, n) if w else 0 for n, w in zip(near.shape, wrap, strict=True)]
    padded = np.pad(near, [(p, p) for p in pads], mode="wrap")
    close = distance_transform_edt(~padded) <= band
    result: Bools = close[pads[0] : pads[0] + near.shape[0], pads[1] : pads[1] + near.shape[1]]
    return result


# --- strips ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class Strip:
    """Rows that are solved together."""

    rows: slice | NDArray[np.intp]
    kept: slice
    """The rows whose result is kept."""
    inner: slice
    """Where they lie among ``rows``."""
    cyclic: bool


def _strips(shape: tuple[int, ...], wrap: bool, screening: float) -> Iterator[Strip]:
    """Divide a picture into strips of rows, each with a margin in which corrections from beyond it die out."""
    height, width = shape
    margin = math.ceil(REACH / math.sqrt(screening)) if screening > 0 else height
    rows = max(STRIP // width, 2 * margin)
    whole = height * width <= STRIP or rows + 2 * margin >= height
    if whole or (rows + 2 * margin) * width > 4 * STRIP:
        yield Strip(slice(0, height), slice(0, height), slice(0, height), wrap)
        return
    for start in range(0, height, rows):
        stop = min(start + rows, height)
        first, last = start - margin, stop + margin
        if not wrap:
            first, last = max(first, 0), min(last, height)
        inner = slice(start - first, stop - first)
        yield Strip(_around(first, last, height), slice(start, stop), inner, False)


def _around(first: int, last: int, height: int) -> slice | NDArray[np.intp]:
    """Give rows of a picture that is cyclic, without a copy where they do not cross its end."""
    return slice(first, last) if first >= 0 and last <= height else np.arange(first, last) % height


def _rows(source: SourceMap, rows: slice | NDArray[np.intp]) -> SourceMap:
    """Take some rows of a source map."""
    frame = source.frame_array()
    frame = frame if frame is None or frame.ndim == 3 else frame[rows]
    return SourceMap(source.coordinates[rows], source.exemplar[rows], source.label[rows], frame, source.shapes)


# --- how visible seams are -------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Visibility:
    """How the differences across seams compare with the exemplar's own.

    Attributes
    ----------
    edges : int
        Pairs of neighbours that a seam parts, of those that were looked at.
    mean : float
        Mean difference across seams over the exemplar's mean difference.
    outliers : float
        Share of the differences across seams that exceed the 99th percentile of the exemplar's; 0.01 is what the
        exemplar itself has.

    """

    edges: int
    mean: float
    outliers: float


def visibility(
    source: SourceMap, exemplars: Array | Sequence[Array], image: Array, *, wrap: bool | Sequence[bool]
) -> Visibility:
    """Measure how visible the seams of a picture are.

    Parameters
    ----------
    source : SourceMap
        Of the picture, shape (H, W).
    exemplars : array, or a sequence of one an exemplar
        What the picture was made from.
    image : (H, W) or (H, W, C) array
        The picture, corrected or not. Its first three channels count, or the first one of two.
    wrap : bool or (rows, columns)
        Axes along which the picture is cyclic.

    Returns
    -------
    Visibility
        All 0 where there is no seam, or where the exemplar is constant.

    Notes
    -----
    Of a picture of more than 2^22 pixels, bands of rows spread over it are looked at; of an exemplar of more than 2^20,
    rows spread over it.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import SourceMap
    >>> from texrs.blend import visibility
    >>> visibility(SourceMap.identity((8, 8)), np.eye(8), np.eye(8), wrap=False)
    Visibility(edges=0, mean=0.0, outliers=0.0)

    """
    cyclic = as_wrap(wrap)
    several = [as_image(e, "exemplars") for e in (exemplars if isinstance(exemplars, list | tuple) else [exemplars])]
    pixels = as_image(image)
    if pixels.shape[:2] != source.shape:
        raise InvalidInput(f"image: needs the size of the source map, {source.shape}, got {pixels.shape[:2]}")
    count = min(3, pixels.shape[-1] - (pixels.shape[-1] == 2))
    own = np.concatenate([_steps(e[..., :count], axis) for e in several for axis in range(2)])
    height, width = source.shape
    across = []
    for band in list(_bands(height))[:: -(-height * width // LOOK)]:
        # With the row after it, for the differences that leave the band.
        last = min(band.stop + 1, height + cyclic[0])
        rows = _around(band.start, last, height)
        piece, shown = _rows(source, rows), pixels[rows, :, :count]
        for axis in range(2):
            at, after = seams(piece, axis, axis == 1 and cyclic[1])
            own_row = at[0] < band.stop - band.start
            before, beyond = (shown[i[0][own_row], i[1][own_row]].astype(np.float64) for i in (at, after))
            across.append(np.abs(beyond - before).mean(axis=-1))
    difference = np.concatenate(across)
    if not len(difference) or not own.any():
        return Visibility(len(difference), 0.0, 0.0)
    outliers = (difference > np.percentile(own, 99)).mean()
    return Visibility(len(difference), float(difference.mean() / own.mean()), float(outliers))


def _steps(image: Array, axis: int) -> NDArray[np.float64]:
    """Give the sizes of an exemplar's differences along an axis; of rows spread over a large one."""
    every = -(-image.shape[0] * image.shape[1] // (LOOK // 4))
    before = image[::every] if axis == 1 else image[:-1:every]
    after = before[:, 1:] if axis == 1 else image[1::every]
    before = before[:, :-1] if axis == 1 else before
    sizes: NDArray[np.float64] = np.abs(after.astype(np.float64) - before).mean(axis=-1).ravel()
    return sizes

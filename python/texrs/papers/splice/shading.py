"""Remove light that varies across an image of separate elements before they move, and restore it afterwards.

A moved pixel keeps the light of its old place: a dark patch of background in a bright corner, a bright element among
dark ones. If the background's low frequencies vary more than the rest of it, they count as light and not as texture.
The light is modelled as a sum, such as haze or glare. The contrast of elements therefore stays, and the noise of dark
corners is not amplified. The share of light on the elements is measured: coins under a haze on the glass behind them
are as bright as the others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, to_unit
from texrs._engine.smoothing import Edge, smooth
from texrs._typing import Array, Bools, Floats, Labels
from texrs.elements import ElementAnalysis
from texrs.point_sets import spacing

__all__ = ["Light", "measure_light"]

WIDE = 0.75
"""Standard deviation of the filter that leaves only light, in spacings."""
UNEVEN = 1.2
"""Ratio of variation, low frequencies to the rest, above which a background counts as unevenly lit.

Rust and stains reach 0.8 and woven cloth 0.3; photographs with a lit side have 1.6 and more.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Light:
    """A texture in even light, and the removed light.

    Attributes
    ----------
    even : (h, w, C) float32
        The texture in even light, in units of its dtype's range. Transparency is unchanged.
    field : (h, w, c) float32
        Light that was removed from the colour channels of the background.
    elements : (h, w) bool
        Pixels of elements.
    share : float
        Share of the light that was removed from elements, 0 to 1.
    low, span : float
        Value of the texture that 0 stands for, and the number of its values in one unit.

    """

    even: Floats
    field: Floats
    elements: Bools
    share: float
    low: float
    span: float

    def spread(self, size: tuple[int, ...]) -> Floats:
        """Return the light for an output of any size, stretched from the whole image to the whole output."""
        from skimage.transform import resize

        shape = (*size, self.field.shape[-1])
        return np.asarray(resize(self.field, shape, order=1, mode="edge", anti_aliasing=False), np.float32)

    def put_back(self, even: Array, field: Floats, places: NDArray[np.int32], image: Array) -> Array:
        """Return an evenly lit image with light added, in the dtype and the range of the texture.

        Parameters
        ----------
        even : (H, W, C) float32
            The image in even light.
        field : (H, W, c) float32
            The light.
        places : (H, W, 2) int32
            The texture pixel that each pixel shows.
        image : (h, w) or (h, w, C) array
            The texture.

        """
        field = field * dim(self.elements[places[..., 0], places[..., 1]], self.share)
        like, channels = as_image(image), self.field.shape[-1]
        out = np.asarray(even, np.float64) * self.span + self.low
        least, most = (f(like[..., :channels], axis=(0, 1)) for f in (np.min, np.max))
        out[..., :channels] = (out[..., :channels] + field * self.span).clip(least, most)
        found = (np.rint(out) if like.dtype.kind in "ui" else out).astype(like.dtype)
        return found[..., 0] if np.ndim(image) == 2 else found


def measure_light(a: ElementAnalysis, ground: Bools, elements: Labels) -> Light | None:
    """Return the light on a texture, measured on its background; None if it is even, or if the values are not colours.

    Parameters
    ----------
    a : ElementAnalysis
        The texture.
    ground : (h, w) bool
        Pixels that are neither in an element nor near one.
    elements : (h, w) int32
        Number of the element of each pixel, counted from 1; 0 elsewhere.

    """
    image = as_image(a.image)
    if image.dtype.kind in "bi" or not ground.any():
        return None
    unit = to_unit(image)
    channels = unit.shape[-1] - (unit.shape[-1] in (2, 4))
    modes: list[Edge] = ["wrap" if w else "nearest" for w in a.wrap]
    sigma = WIDE * spacing(a.points)

    def spread(values: NDArray[np.float32]) -> Floats:
        return smooth(values, sigma, mode=modes, truncate=3.0)

    weight = np.maximum(spread(ground.astype(np.float32)), 1e-4)
    shown = [spread(np.where(ground, unit[..., c], 0).astype(np.float32)) / weight for c in range(channels)]
    field: Floats = np.stack(shown, axis=-1)
    rest = (unit[..., :channels] - field)[ground]
    field -= field[ground].mean(axis=0)
    if float(field[ground].std(axis=0).mean()) <= UNEVEN * float(rest.std(axis=0).mean()) + 1 / 255:
        return None
    low, high = _find_unit(image)
    share = measure_share(unit[..., :channels], field, elements)
    even = unit.copy()
    even[..., :channels] -= field * dim(elements > 0, share)
    return Light(even, field, elements > 0, share, low, high - low)


def dim(elements: Bools, share: float) -> Floats:
    """Return the share of the light that falls on each pixel, (H, W, 1)."""
    return np.where(elements, np.float32(share), np.float32(1))[..., np.newaxis]


def measure_share(colours: Floats, field: Floats, elements: Labels) -> float:
    """Return the share of a light that falls on elements: the least-squares slope of their brightness against it."""
    count = np.bincount(elements.ravel())[1:]
    bright, lit = (
        np.bincount(elements.ravel(), values.mean(axis=-1).ravel())[1:][count > 0] / count[count > 0]
        for values in (colours, field)
    )
    lit = lit - lit.mean()
    variance = float(lit @ lit)
    return float(np.clip(lit @ bright / variance, 0, 1)) if variance > 0 else 1.0


def _find_unit(image: Array) -> tuple[float, float]:
    """Return the values that `to_unit` maps to 0 and 1."""
    if image.dtype.kind == "u":
        return 0.0, float(np.iinfo(image.dtype).max)
    low, high = float(image.min()), float(image.max())
    return (0.0, 1.0) if low >= 0 and high <= 1 else (min(low, 0.0), high)

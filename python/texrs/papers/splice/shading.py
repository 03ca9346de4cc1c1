"""Remove light that varies across an image of separate elements before they move, and restore it afterwards.

A moved pixel keeps the light of its old place. Without a correction, bright corners would have dark patches of
background, and dark corners bright elements. Low frequencies of the background count as light if they vary more than
the rest of it. The light is modelled as a sum, as for haze or glare. The contrast of elements therefore does not
change, and the noise of dark corners is not amplified. The share of the light on the elements is measured, because
haze on the glass behind coins does not make the coins brighter.
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
"""Standard deviation of the low-pass filter that separates light from texture, in spacings."""
UNEVEN = 1.2
"""Minimum ratio of low-frequency variation to other variation in an unevenly lit background.

The ratio is up to 0.8 for rust and stains, 0.3 for woven cloth, and at least 1.6 for photographs lit from one side.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Light:
    """A texture without its uneven light, and the removed light.

    Attributes
    ----------
    even : (h, w, C) float32
        The texture in even light, scaled by ``low`` and ``span``. Transparency is unchanged.
    field : (h, w, c) float32
        Light that was removed from the colour channels of the background.
    elements : (h, w) bool
        True for pixels of elements.
    share : float
        Share of the light that was removed from elements, 0 to 1.
    low, span : float
        Scale of ``even``: ``even * span + low`` has the values of the texture.

    """

    even: Floats
    field: Floats
    elements: Bools
    share: float
    low: float
    span: float

    def spread(self, size: tuple[int, ...]) -> Floats:
        """Return the light for an output of any size, by stretching the light of the image over the output."""
        from skimage.transform import resize

        shape = (*size, self.field.shape[-1])
        return np.asarray(resize(self.field, shape, order=1, mode="edge", anti_aliasing=False), np.float32)

    def put_back(self, even: Array, field: Floats, places: NDArray[np.int32], image: Array) -> Array:
        """Add light to an evenly lit image, and return it in the dtype and value range of the texture.

        Parameters
        ----------
        even : (H, W, C) float32
            The image in even light.
        field : (H, W, c) float32
            The light on the background at each pixel.
        places : (H, W, 2) int32
            Source pixel in the texture of each pixel.
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
    """Measure the light on a texture's background. Return None if it is even, or if the values are not colours.

    Parameters
    ----------
    a : ElementAnalysis
        The texture.
    ground : (h, w) bool
        True for pixels of the background that are not near an element.
    elements : (h, w) int32
        Index of the element of each pixel, counted from 1, and 0 for other pixels.

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
    """Return the share of the light that falls on each pixel, (H, W, 1): ``share`` on elements, 1 elsewhere."""
    return np.where(elements, np.float32(share), np.float32(1))[..., np.newaxis]


def measure_share(colours: Floats, field: Floats, elements: Labels) -> float:
    """Return the share of the light that falls on elements: the least-squares slope of their brightness against it."""
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

"""Light that differs across a picture of separate elements: taken off before they are moved, and put back after.

What is looked up far from where it is shown brings the light of its own place along: a dark patch of ground into the bright
corner, a bright element among dark ones. Where the ground's low frequencies vary more than all the rest of it, that is light,
and no texture. It is taken for an addition, as a haze or a glare is: the contrast of elements stays as it was, and the noise
of dark corners is not multiplied. How much of it falls on the elements themselves is measured: coins under a haze on the glass
behind them are as bright as the others.
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
"""Spacings: the standard deviation of the filter that leaves nothing but light."""
UNEVEN = 1.2
"""How much more the low frequencies of a ground vary than the rest of it, for them to be light: rust and stains reach .8, woven
cloth .3; pictures with a lit side 1.6 and more."""


@dataclass(frozen=True, slots=True, eq=False)
class Light:
    """A texture in even light, and what was taken off.

    Attributes
    ----------
    even : (h, w, C) float32
        The texture in even light, in units of its dtype's range; transparency as it was.
    field : (h, w, c) float32
        What was taken off the ground's channels of colour.
    elements : (h, w) bool
        Where elements are.
    share : float
        How much of it was taken off them, 0 to 1.
    low, span : float
        What 0 and the unit are in the texture's own values.

    """

    even: Floats
    field: Floats
    elements: Bools
    share: float
    low: float
    span: float

    def spread(self, size: tuple[int, ...]) -> Floats:
        """Return the light of an output of some size: the whole of the picture's falls on the whole of it."""
        from skimage.transform import resize

        shape = (*size, self.field.shape[-1])
        return np.asarray(resize(self.field, shape, order=1, mode="edge", anti_aliasing=False), np.float32)

    def put_back(self, even: Array, field: Floats, places: NDArray[np.int32], image: Array) -> Array:
        """Return a picture in even light with light put on it, in the dtype and the range of the texture.

        Parameters
        ----------
        even : (H, W, C) float32
            The picture.
        field : (H, W, c) float32
            The light.
        places : (H, W, 2) int32
            The pixels of the texture that it shows.
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
    """Return the light on a texture as its ground shows it; None where that is even, or its values are no colours.

    Parameters
    ----------
    a : ElementAnalysis
        The texture.
    ground : (h, w) bool
        What is neither element nor near one.
    elements : (h, w) int32
        The element of each pixel, counted from 1; 0 elsewhere.

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
    """Return how much of a light falls where, (H, W, 1)."""
    return np.where(elements, np.float32(share), np.float32(1))[..., np.newaxis]


def measure_share(colours: Floats, field: Floats, elements: Labels) -> float:
    """Return how much of a light falls on elements: the slope of their brightness against it, by least squares."""
    count = np.bincount(elements.ravel())[1:]
    bright, lit = (
        np.bincount(elements.ravel(), values.mean(axis=-1).ravel())[1:][count > 0] / count[count > 0]
        for values in (colours, field)
    )
    lit = lit - lit.mean()
    variance = float(lit @ lit)
    return float(np.clip(lit @ bright / variance, 0, 1)) if variance > 0 else 1.0


def _find_unit(image: Array) -> tuple[float, float]:
    """Return what becomes 0 and 1 in `to_unit`."""
    if image.dtype.kind == "u":
        return 0.0, float(np.iinfo(image.dtype).max)
    low, high = float(image.min()), float(image.max())
    return (0.0, 1.0) if low >= 0 and high <= 1 else (min(low, 0.0), high)

"""The scene of a planar sample, which is laid out, lit and photographed.

A scene is always a torus with two samples per pixel along each axis. A tileable sample is the whole torus. Any other
sample is cut out of a larger torus, so elements enter across the border as in a photograph. Even samples are at pixel
centres and odd samples between them. Labels are read at pixel centres, and the image is an average around them with
tent weights.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_bool
from texrs.samples._noise import Floats, blur, clouds, encode, fold, light
from texrs.samples._sample import LayoutName, Sample

_FINE = 2
_Number = TypeVar("_Number", bound=np.generic)


class Window(NamedTuple):
    """A rectangle of the torus around a point."""

    where: tuple[NDArray[np.intp], NDArray[np.intp]]
    y: Floats
    x: Floats


class Scene:
    """Height, colour, gloss and label of every sample of a torus.

    Parameters
    ----------
    size : (int, int)
        Rows and columns of the image.
    rng : numpy.random.Generator
        Random generator.
    period : (int, int)
        Rows and columns of the torus, in pixels, at least `size`.
    origin : (int, int)
        Position of the image's pixel (0, 0) on the torus.
    """

    def __init__(
        self,
        size: tuple[int, ...],
        rng: np.random.Generator,
        *,
        period: tuple[int, int] | None = None,
        origin: tuple[int, int] = (0, 0),
    ) -> None:
        self.size = (size[0], size[1])
        self.rng = rng
        self.period = self.size if period is None else period
        self.origin = origin
        self.shape = (_FINE * self.period[0], _FINE * self.period[1])
        self.height = np.zeros(self.shape, np.float32)
        self.albedo = np.zeros((*self.shape, 3), np.float32)
        self.gloss = np.zeros(self.shape, np.float32)
        self.label = np.zeros(self.shape, np.int32)
        self.anchors: list[tuple[float, float]] = []

    @classmethod
    def around(cls, size: tuple[int, ...], rng: np.random.Generator, *, wrap: bool, margin: int) -> Scene:
        """Return a scene of the size of the image (`wrap`), or with `margin` pixels around it."""
        if as_bool(wrap, "wrap"):
            return cls(size, rng)
        period = (size[0] + 2 * margin, size[1] + 2 * margin)
        return cls(size, rng, period=period, origin=(margin, margin))

    @property
    def y(self) -> Floats:
        """Rows of the samples on the torus, in pixels, (2H, 1)."""
        return (np.arange(self.shape[0], dtype=np.float32) / _FINE)[:, None]

    @property
    def x(self) -> Floats:
        """Columns of the samples on the torus, in pixels, (1, 2W)."""
        return (np.arange(self.shape[1], dtype=np.float32) / _FINE)[None, :]

    def noise(
        self, coarse: float, fine: float = 1.0, gain: float = 0.5, stretch: tuple[float, float] | None = None
    ) -> Floats:
        """Return `clouds` over the torus, with wavelengths in pixels."""
        return clouds(self.shape, self.rng, coarse=coarse * _FINE, fine=fine * _FINE, gain=gain, stretch=stretch)

    def window(self, centre: tuple[float, float], reach: float, wide: float = 0.0) -> Window:
        """Return the rectangle within `reach` rows and `wide` (default: `reach`) columns of `centre`."""
        axes, offsets = [], []
        for c, r, n in zip(centre, (reach, wide or reach), self.shape, strict=True):
            # Do not take a sample twice if the torus is smaller than the rectangle.
            r = min(r, (n - 1) / (2 * _FINE))
            first = int(np.ceil((c - r) * _FINE))
            count = int(np.floor((c + r) * _FINE)) - first + 1
            at = np.arange(first, first + count)
            axes.append(at % n)
            offsets.append((at / _FINE - c).astype(np.float32))
        rows, cols = np.ix_(axes[0], axes[1])
        return Window((rows, cols), offsets[0][:, None], offsets[1][None, :])

    def add(self, anchor: tuple[float, float]) -> int:
        """Add an element around `anchor`, and return its label."""
        self.anchors.append((float(anchor[0]), float(anchor[1])))
        return len(self.anchors)

    def paint(
        self,
        window: Window,
        inside: NDArray[np.bool_],
        height: Floats,
        albedo: Floats,
        *,
        label: int = 0,
        gloss: float | Floats = 0.0,
        over: bool = False,
    ) -> None:
        """Paint the samples that are `inside` and higher than the scene, or all `inside` samples if `over`."""
        rows, cols = window.where
        shown = inside if over else inside & (height > self.height[rows, cols])
        where = np.nonzero(shown)
        r, c = rows[where[0], 0], cols[0, where[1]]
        self.height[r, c] = np.broadcast_to(height, shown.shape)[where]
        self.albedo[r, c] = np.broadcast_to(albedo, (*shown.shape, 3))[where]
        self.gloss[r, c] = np.broadcast_to(np.float32(gloss), shown.shape)[where]
        self.label[r, c] = label

    def picture(self, *, grain: float = 0.012, soft: float = 0.0, **lamp: float) -> Floats:
        """Return the lit torus in sRGB 0..1, with two samples per pixel and with sensor noise."""
        lit = light(self.height, self.albedo, self.gloss, pitch=1 / _FINE, **lamp)
        if soft:
            lit = np.stack([blur(lit[..., k], soft * _FINE) for k in range(3)], -1)
        # Photon noise grows with the square root of the light, so it is about uniform in sRGB.
        shade = clouds(self.shape, self.rng, coarse=8, fine=2, gain=1.0)[..., None]
        tint = self.rng.standard_normal(lit.shape, dtype=np.float32)
        return encode(lit) + np.float32(grain) * (shade + np.float32(0.7) * tint)

    def centroids(self) -> NDArray[np.float64]:
        """Return the centroid of each label on the torus, in pixels; NaN if a label is not visible."""
        rows, cols = np.nonzero(self.label)
        owner = self.label[rows, cols]
        anchors = np.array([(0.0, 0.0), *self.anchors])
        count = np.bincount(owner, minlength=len(anchors))
        result = np.full_like(anchors, np.nan)
        seen = count > 0
        # Average the offsets from the anchors, because elements can cross the border of the torus.
        for k, (at, n) in enumerate(zip((rows, cols), self.period, strict=True)):
            away = (at / _FINE - anchors[owner, k] + n / 2) % n - n / 2
            total = np.bincount(owner, away, len(anchors))
            result[seen, k] = anchors[seen, k] + total[seen] / count[seen]
        return result[1:]

    def finish(
        self,
        name: str,
        *,
        layout: LayoutName | None,
        mask: Callable[[NDArray[np.int32]], NDArray[np.bool_]] | None = None,
        truth: bool = True,
        grain: float = 0.012,
        soft: float = 0.0,
        **lamp: float,
    ) -> Sample:
        """Photograph the scene, and return the image and its labels, cropped to the image's size.

        Parameters
        ----------
        name, layout : str
            Name and layout of the sample.
        mask : callable, optional
            Function that returns the foreground for labels. Default: ``labels > 0``.
        truth : bool
            If False, return only the image. Textures without countable elements use this.
        grain, soft : float
            Sensor noise as a fraction of white, and lens blur in pixels.
        **lamp : float
            Options of `light`.
        """
        fine = self.picture(grain=grain, soft=soft, **lamp)
        # Average the samples around each pixel with tent weights 1, 2, 1.
        for axis in (0, 1):
            fine = (np.roll(fine, 1, axis) + 2 * fine + np.roll(fine, -1, axis)) / 4
        picture = self._crop(fine)
        image = np.rint(np.clip(picture, 0, 1) * 255).astype(np.uint8)
        if not truth:
            return Sample(name, image)
        centres, labels = relabel(self._crop(self.label), self._move_inside())
        return Sample(name, image, centres, labels, labels > 0 if mask is None else mask(labels), layout)

    def _crop(self, fine: NDArray[_Number]) -> NDArray[_Number]:
        """Return the samples of the torus that are pixels of the image."""
        (top, left), (height, width) = self.origin, self.size
        return np.ascontiguousarray(fine[::_FINE, ::_FINE][top : top + height, left : left + width])

    def _move_inside(self) -> NDArray[np.float64]:
        """Return the centroids in pixels of the image."""
        box = np.array(self.period, np.float64)
        # Wrap to -0.5 <= centre < period - 0.5, because pixel 0 covers -0.5 to 0.5.
        return fold(self.centroids() - np.array(self.origin) + 0.5, box) - 0.5


def relabel(raw: NDArray[np.int32], centres: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Return the centres inside an image, and its labels renumbered so that their elements come first.

    Parameters
    ----------
    raw : int32 array, (H, W)
        ``i + 1`` is the element of ``centres[i]``.
    centres : float64 array, (n, 2)
        Centres of the elements; NaN for an element that is not visible.
    """
    within = ((centres >= -0.5) & (centres < np.array(raw.shape) - 0.5)).all(1)
    seen = np.bincount(raw.ravel(), minlength=len(centres) + 1)[1:] > 0
    inside = within & seen
    order = np.concatenate([np.nonzero(inside)[0], np.nonzero(seen & ~within)[0]])
    number = np.zeros(len(centres) + 1, np.int32)
    number[order + 1] = np.arange(1, len(order) + 1)
    return centres[inside], number[raw]

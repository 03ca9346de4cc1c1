"""Oblique views of planes, with the known scale and Jacobian at every pixel.

A pinhole camera of focal length f looks at a plane. Let p be the offset of a pixel from the middle of the image, and
``a`` the slope of the plane's depth, with ``|a| = tan(tilt)``. The ray through p meets the plane at X = p / w, where
w = 1 - a.p / f. Lengths on the plane along a are 1 / cos(tilt) times those of X:

    S = g M X,   J = dS/dp = g M (I / w + p a' / (f w^2)),   det J = g^2 / (cos(tilt) w^3),

The scale is det(J)^(-1/2) = sqrt(cos(tilt)) w^(3/2) / g. The factor g makes its geometric mean over the image 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import cos, pi, radians, sin, sqrt, tan

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_size
from texrs.samples._noise import Floats, mix, palette, ramp, single, transform
from texrs.samples._regular import lay_bricks
from texrs.samples._sample import MIN_SIDE, LayoutName, Sample, make_generator
from texrs.samples._scene import Scene, relabel

_PITCH, _RADIUS = 26.0, 10.5


def tilted_discs(size: Sequence[int] = (256, 256), *, seed: int = 0) -> Sample:
    """Generate a floor of round glazed tiles that recedes towards the top.

    On the plane, the tiles are discs of radius 10.5 pixels on a hexagonal lattice with a distance of 26 pixels. The
    layout is "disjoint".

    Parameters
    ----------
    size : (int, int)
        Rows and columns, at least 32. Default: (256, 256).
    seed : int
        Seed of the tiles. The plane does not depend on it. Default: 0.

    Returns
    -------
    Sample
        It has `centres`, `labels`, `mask`, `scale_map` and `jacobians`. A centre is the disc's centre on the plane,
        projected into the image. It is near the centroid of the visible disc, but not equal to it.

    Raises
    ------
    ValueError
        If `size` or `seed` is out of its range.

    Examples
    --------
    >>> from texrs import samples
    >>> sample = samples.tilted_discs((96, 96))
    >>> sample.jacobians.shape, bool(sample.scale_map.max() > 3 * sample.scale_map.min())
    ((96, 96, 2, 2), True)
    """
    rng = make_generator("tilted_discs", seed)
    plane = _Plane.tilt(as_size(size, minimum=MIN_SIDE), tilt=50.0, towards=pi)
    rise = _PITCH * sqrt(3) / 2
    rows = 2 * int(np.ceil(plane.extent[0] / (2 * rise)))
    cols = int(np.ceil(plane.extent[1] / _PITCH))
    scene = Scene((round(rows * rise), round(cols * _PITCH)), rng)
    _lay_tiles(scene, rows, cols)
    return _view(scene, plane, "tilted_discs", layout="disjoint")


def tilted_bricks(size: Sequence[int] = (256, 256), *, seed: int = 0) -> Sample:
    """Generate a wall of bricks that recedes obliquely.

    The wall on the plane is the wall of `bricks` at 0.8 times its size. The layout is "jointed".

    Parameters
    ----------
    size : (int, int)
        Rows and columns, at least 32. Default: (256, 256).
    seed : int
        Seed of the bricks. The plane does not depend on it. Default: 0.

    Returns
    -------
    Sample
        It has `centres`, `labels`, `mask`, `scale_map` and `jacobians`. A centre is the brick's centroid on the
        plane, projected into the image.

    Raises
    ------
    ValueError
        If `size` or `seed` is out of its range.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import samples
    >>> sample = samples.tilted_bricks((96, 96))
    >>> abs(float(np.log(sample.scale_map).mean())) < 1e-3
    True
    """
    rng = make_generator("tilted_bricks", seed)
    plane = _Plane.tilt(as_size(size, minimum=MIN_SIDE), tilt=45.0, towards=radians(-112.0), zoom=1.25)
    courses = 2 * int(np.ceil(plane.extent[0] / 68))
    across = int(np.ceil(plane.extent[1] / 80))
    scene = Scene((courses * 34, across * 80), rng)
    lay_bricks(scene, courses, across)
    return _view(scene, plane, "tilted_bricks", layout="jointed")


@dataclass(frozen=True, slots=True)
class _Plane:
    """The map S from the image to the plane.

    Attributes
    ----------
    size : (int, int)
        Rows and columns of the image.
    slope : float64 array, (2,)
        a / f: the slope of the plane's depth, divided by the focal length.
    stretch : float64 array, (2, 2)
        The matrix g M of the equations above, without `zoom`.
    zoom : float
        Units of the plane's texture in one unit of S.
    corner : float64 array, (2,)
        Offset that moves the visible part of the plane's texture to (0, 0).
    extent : float64 array, (2,)
        Size of the visible part of the plane, in units of its texture.
    """

    size: tuple[int, int]
    slope: NDArray[np.float64]
    stretch: NDArray[np.float64]
    zoom: float
    corner: NDArray[np.float64]
    extent: NDArray[np.float64]

    @classmethod
    def tilt(cls, size: tuple[int, ...], *, tilt: float, towards: float, zoom: float = 1.0) -> _Plane:
        """Return a plane tilted by `tilt` degrees, whose depth grows `towards` an angle in radians from +row to +col."""
        along = np.array([cos(towards), sin(towards)])
        lean = radians(tilt)
        slope = along * tan(lean) / (1.5 * max(size))
        stretch = np.eye(2) + (1 / cos(lean) - 1) * np.outer(along, along)
        plane = cls((size[0], size[1]), slope, stretch, zoom, np.zeros(2), np.zeros(2))
        # Round the mean, because its last bits depend on the processor's order of summation.
        mean = float(np.float32(np.exp(np.log(plane.scale()).mean())))
        plane = replace(plane, stretch=stretch * mean)
        ends = [(r, c) for r in (-1, size[0]) for c in (-1, size[1])]
        corners = plane.source(np.array(ends, np.float64))
        low, high = corners.min(0) - 4, corners.max(0) + 4
        return replace(plane, corner=-low, extent=high - low)

    def pixels(self, pitch: float = 1.0) -> NDArray[np.float64]:
        """Return the coordinates of samples of the image, one every `pitch` pixels, (H, W, 2)."""
        axes = [np.arange(0, n - 1 + pitch / 2, pitch) for n in self.size]
        return np.stack(np.meshgrid(*axes, indexing="ij"), -1)

    def _offset(self, at: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return p and w of the equations above, for pixels `at`."""
        p = at - (np.array(self.size) - 1) / 2
        # The depth grows along a, so w falls there, and the ray meets the plane farther out: at p / w.
        return p, 1 - transform(p, self.slope[:, None])[..., 0]

    def source(self, at: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the coordinates on the plane's texture that are visible at the pixels `at` (..., 2)."""
        p, w = self._offset(at)
        return transform(p / w[..., None], self.zoom * self.stretch.T) + self.corner

    def picture(self, on_plane: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the pixels that show the coordinates `on_plane` (..., 2). This is the inverse of `source`."""
        (a, b), (c, d) = self.zoom * self.stretch
        inverse = np.array([[d, -c], [-b, a]]) / (a * d - b * c)
        x = transform(on_plane - self.corner, inverse)
        p = x / (1 + transform(x, self.slope[:, None]))
        return np.asarray(p + (np.array(self.size) - 1) / 2)

    def scale(self) -> NDArray[np.float64]:
        """Return the scale at every pixel, (H, W)."""
        _, w = self._offset(self.pixels())
        (a, b), (c, d) = self.stretch
        return np.asarray(w * np.sqrt(w) / sqrt(a * d - b * c))

    def jacobian(self) -> NDArray[np.float64]:
        """Return dS/dp at every pixel, (H, W, 2, 2)."""
        p, w = self._offset(self.pixels())
        w = w[..., None, None]
        inner = np.eye(2) / w + p[..., :, None] * self.slope / w**2
        return np.asarray(self.stretch @ inner)


def _lay_tiles(scene: Scene, rows_of: int, cols_of: int) -> None:
    """Fill the torus of `scene` with a hexagonal lattice of round tiles, separated by grout."""
    rng = scene.rng
    sand, cloud = scene.noise(3, 1, gain=1.0), scene.noise(40, 2, gain=0.7)
    scene.height += np.float32(0.14) * sand
    scene.albedo[:] = palette("8d857a")[0] * (1 + np.float32(0.16) * cloud + np.float32(0.08) * sand)[..., None]
    tones = palette("3f5f6b", "587a7a", "a89f8c", "34474f", "7f8f86", "5d4c43", "b3a587")
    glaze, craze = scene.noise(14, 2, gain=0.7), scene.noise(4, 1, gain=0.8)
    pitch = (scene.period[0] / rows_of, scene.period[1] / cols_of)
    for row in range(rows_of):
        for k in range(cols_of):
            middle = ((row + 0.5) * pitch[0], (k + 0.5 * (row % 2)) * pitch[1])
            window = scene.window(middle, _RADIUS + 1.5)
            rows, cols = window.where
            r = single(np.hypot, window.y, window.x) / np.float32(_RADIUS)
            edge = np.sqrt(np.clip(1 - np.clip((r - 0.72) / 0.28, 0, 1) ** 2, 0, 1))
            lean = rng.uniform(-0.02, 0.02, 2)
            height = 0.2 + 1.5 * edge + lean[0] * window.y + lean[1] * window.x
            height = height + np.float32(0.06) * glaze[rows, cols]
            tone = tones[rng.integers(len(tones))] * rng.uniform(0.8, 1.15)
            shade = 1 + np.float32(0.13) * glaze[rows, cols] + np.float32(0.04) * craze[rows, cols]
            albedo = tone * shade[..., None]
            albedo = mix(albedo, tone * 1.5, 0.5 * ramp(r, 0.74, 0.86) * (1 - ramp(r, 0.88, 1.0)))
            scene.paint(window, r <= 1, height, albedo, label=scene.add(middle), gloss=0.3, over=True)


def _view(scene: Scene, plane: _Plane, name: str, *, layout: LayoutName) -> Sample:
    """Render the lit `scene` as it appears through the map `plane`."""
    from scipy import ndimage

    lit = scene.picture(grain=0.0, reach=6.0, exposure=0.95)
    # Average 3 x 3 rays per pixel: far away, a pixel covers much more of the texture than nearby.
    rays = (np.arange(3) - 1) / 3
    at = plane.pixels()
    seen = np.zeros((*plane.size, 3), np.float32)
    for dy in rays:
        for dx in rays:
            where = 2 * plane.source(at + np.array([dy, dx]))
            coordinates = np.moveaxis(where, -1, 0)
            for k in range(3):
                seen[..., k] += ndimage.map_coordinates(
                    lit[..., k], coordinates, order=1, mode="grid-wrap", output=np.float32
                )
    seen /= 9
    grain = scene.rng.standard_normal(seen.shape, dtype=np.float32)
    seen += np.float32(0.009) * grain
    # Labels cannot be averaged, so take the nearest sample of the scene.
    nearest = np.rint(2 * plane.source(at)).astype(np.intp)
    raw = scene.label[nearest[..., 0] % scene.shape[0], nearest[..., 1] % scene.shape[1]]
    centres, labels = relabel(raw, plane.picture(_unwrap(scene, plane)))
    image: NDArray[np.uint8] = np.rint(np.clip(seen, 0, 1) * 255).astype(np.uint8)
    return Sample(
        name,
        image,
        centres,
        labels,
        labels > 0,
        layout,
        plane.scale().astype(np.float32),
        plane.jacobian().astype(np.float32),
    )


def _unwrap(scene: Scene, plane: _Plane) -> NDArray[np.float64]:
    """Return the centroids on the plane, each in the copy of the torus nearest to the middle of the image."""
    box = np.array(scene.period, np.float64)
    middle: Floats | NDArray[np.float64] = plane.extent / 2
    return np.asarray((scene.centroids() - middle + box / 2) % box - box / 2 + middle)

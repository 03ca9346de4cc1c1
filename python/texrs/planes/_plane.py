"""A plane in perspective: its orientation, and the maps between an image and the flattened plane."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import atan, cos, degrees, hypot, radians, sin, tan
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_array, as_float, as_size
from texrs._typing import Array
from texrs.errors import InvalidInput
from texrs.planes.projective import along, as_places, find_focal, lift, to_digits, to_grid, transform
from texrs.scale_maps.kinds import AREAS, ScaleMap, as_kind, find_kind
from texrs.scale_maps.maps import MIN_SCALE, as_map
from texrs.scale_maps.slope import Slope

__all__ = ["FOV", "MAX_SLANT", "Plane"]

Pair = tuple[float, float]

FOV = 60.0
"""Default angle of view of the longer side in degrees: about that of a telephone, or of a 30 mm lens on 35 mm film."""
MAX_SLANT = 88.0
"""Maximum slant in degrees. Beyond it the plane is seen edge on."""
FIT = 0.15
"""Residual of a scale map, in natural logarithms, that lowers the confidence in its plane to 1 / e."""
FLAT = 1e-9
"""Change of the relative width over the longer side below which a plane is seen from the front.

Such a plane has no horizon, and its tilt is 90 degrees.
"""


@dataclass(frozen=True, slots=True)
class Plane:
    """A plane seen by a pinhole camera: the point of the plane at each pixel, and the size of elements there.

    The optical axis passes through the middle of the image, (size - 1) / 2. Points of the flattened plane are (row,
    column) pairs. Their origin is the middle of the image, and their unit is a pixel there. Near the origin, the
    flattened plane is the image stretched along its slope.

    Parameters
    ----------
    shape : (rows, columns)
        Size of the image in pixels.
    slant : float
        Angle between the line of sight and the plane's normal in degrees, 0 (seen from the front) to 88.
    tilt : float
        Direction in the image along which depth grows, in degrees counter-clockwise from +x with y up. Default: 90, a
        floor.
    fov : float, optional
        Angle of view of the longer side in degrees, 1 to 170. The sizes of distant elements are right only if this
        angle is about right. Default: `FOV`.
    rotation : float
        Rotation of the flattened plane in degrees, counter-clockwise, for example to level courses of bricks. Default:
        0.
    confidence : float
        Confidence in the plane, 0 to 1. Default: 1.

    Raises
    ------
    InvalidInput
        If an angle is out of its range.

    Examples
    --------
    The horizon of a floor at 60 degrees, and the width of elements at the lower border relative to the middle:

    >>> from texrs import Plane
    >>> floor = Plane((101, 201), slant=60, tilt=90, fov=60)
    >>> [round(float(row), 1) for row, _ in floor.horizon]
    [-50.5, -50.5]
    >>> round(float(floor.width([[100, 100]])[0]), 2)
    1.5
    >>> floor.project(floor.flatten([[20.0, 7.0]])).round(6).tolist()
    [[20.0, 7.0]]

    """

    shape: tuple[int, int]
    slant: float
    tilt: float = 90.0
    fov: float = FOV
    rotation: float = 0.0
    confidence: float = 1.0

    def __post_init__(self) -> None:
        rows, columns = as_size(self.shape, "shape")
        values = {
            "shape": (rows, columns),
            "slant": as_float(self.slant, "slant", 0, MAX_SLANT),
            "tilt": as_float(self.tilt, "tilt", -1e6, 1e6) % 360,
            "fov": as_float(self.fov, "fov", 1, 170),
            "rotation": (as_float(self.rotation, "rotation", -1e6, 1e6) + 180) % 360 - 180,
            "confidence": as_float(self.confidence, "confidence", 0, 1),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    # --- other constructors ------------------------------------------------------------------------------------------

    @classmethod
    def of_horizon(
        cls, shape: Sequence[int], horizon: Array | Sequence[Sequence[float]], *, fov: float | None = None
    ) -> Plane:
        """Return the plane with a horizon through two points.

        Parameters
        ----------
        shape : (rows, columns)
            Size of the image in pixels.
        horizon : (2, 2) array_like
            Two points (row, column), which may be outside the image. The plane is on the side of the horizon that
            contains the middle of the image.
        fov : float, optional
            Angle of view of the longer side in degrees, 1 to 170. Default: `FOV`.

        Returns
        -------
        Plane

        Raises
        ------
        InvalidInput
            If the points are equal, or the horizon passes through the middle of the image.

        Examples
        --------
        >>> from texrs import Plane
        >>> round(Plane.of_horizon((101, 201), [[-50.5, 0], [-50.5, 200]], fov=60).slant, 1)
        60.0

        """
        size = as_size(shape, "shape")
        points = as_array(horizon, "horizon", np.float64, (2, 2))
        line = np.cross(*lift(points, size))
        return cls._of_line(size, line, "horizon", fov)

    @classmethod
    def of_vanishing_points(
        cls, shape: Sequence[int], points: Array | Sequence[Sequence[float]], *, fov: float | None = None
    ) -> Plane:
        """Return the plane of two perpendicular directions, given their vanishing points.

        Parameters
        ----------
        shape : (rows, columns)
            Size of the image in pixels.
        points : (2, 2) array_like
            Vanishing points (row, column) of the first and the second direction. A point is very far outside the image
            if the lines of its direction are parallel in the image.
        fov : float, optional
            Angle of view of the longer side in degrees, 1 to 170. Default: the angle that makes the directions
            perpendicular, or `FOV` if a point is too far away to determine it.

        Returns
        -------
        Plane
            A plane that is rotated so that lines to the first point are columns of the flattened plane. They are
            rows if rows need less rotation.

        Raises
        ------
        InvalidInput
            If the points are equal, or on a line with the middle of the image.

        Examples
        --------
        >>> import numpy as np
        >>> from texrs import Plane
        >>> floor = Plane((240, 320), slant=50, tilt=70, fov=55)
        >>> seen = Plane.of_vanishing_points((240, 320), floor.vanishing_points)
        >>> [round(v, 6) for v in (seen.slant, seen.tilt, seen.fov)]
        [50.0, 70.0, 55.0]

        """
        size = as_size(shape, "shape")
        lifted = lift(as_array(points, "points", np.float64, (2, 2)), size)
        return cls._of_directions(size, lifted, "points", fov)

    @classmethod
    def of_corners(
        cls, shape: Sequence[int], corners: Array | Sequence[Sequence[float]], *, fov: float | None = None
    ) -> Plane:
        """Return the plane of a rectangle, given its four corners in the image.

        Parameters
        ----------
        shape : (rows, columns)
            Size of the image in pixels.
        corners : (4, 2) array_like
            Positions (row, column) of the corners, in order around the rectangle.
        fov : float, optional
            Angle of view of the longer side in degrees, 1 to 170. Default: the angle that makes the corners right
            angles, or `FOV` if a vanishing point is too far away to determine it.

        Returns
        -------
        Plane
            A plane that is rotated so that the rectangle is level.

        Raises
        ------
        InvalidInput
            If the corners do not form a convex quadrilateral.

        Examples
        --------
        >>> from texrs import Plane
        >>> floor = Plane((240, 320), slant=50, tilt=70, fov=55)
        >>> corners = floor.project([[-20, -30], [-20, 40], [25, 40], [25, -30]])
        >>> round(Plane.of_corners((240, 320), corners).slant, 6)
        50.0

        """
        size = as_size(shape, "shape")
        given = as_array(corners, "corners", np.float64, (4, 2))
        sides = np.roll(given, -1, axis=0) - given
        after = np.roll(sides, -1, axis=0)
        turns = sides[:, 0] * after[:, 1] - sides[:, 1] * after[:, 0]
        if not (np.all(turns > 1e-6) or np.all(turns < -1e-6)):
            raise InvalidInput("corners: must form a convex quadrilateral; give the corners in order around it")
        lifted = lift(given, size)
        lines = [np.cross(lifted[i], lifted[(i + 1) % 4]) for i in range(4)]
        # Opposite sides of the rectangle meet in a vanishing point.
        return cls._of_directions(
            size, np.array([np.cross(lines[1], lines[3]), np.cross(lines[0], lines[2])]), "corners", fov
        )

    @classmethod
    def of_scale_map(
        cls, scale: Array, *, scale_kind: Literal["width", "area"] | None = None, fov: float | None = None
    ) -> Plane:
        """Return the plane that fits a scale map.

        Parameters
        ----------
        scale : (H, W) float array
            Scale map (`texrs.scale_maps`).
        scale_kind : {"area", "width"}, optional
            Kind of the map. "area": square roots of areas, as `texrs.scale_maps.from_mask` measures them. "width":
            widths across the slope, as `texrs.scale_maps.from_angles` returns them. Default: the kind of a
            `texrs.scale_maps.ScaleMap`, else "area".
        fov : float, optional
            Angle of view of the longer side in degrees, 1 to 170. Default: `FOV`.

        Returns
        -------
        Plane
            The plane. Its confidence depends on how well the map fits.

        Raises
        ------
        InvalidInput
            If the map is not a scale map, or its horizon would pass through the middle of the image.

        Examples
        --------
        >>> from texrs import Plane, scale_maps
        >>> scale = scale_maps.from_angles((96, 128), 50, 120, fov=60)
        >>> plane = Plane.of_scale_map(scale, fov=60)
        >>> round(plane.slant, 2), round(plane.tilt, 2)
        (50.0, 120.0)

        """
        given = as_map(scale)
        what = find_kind(scale) or "area" if scale_kind is None else as_kind(scale_kind)
        size = (given.shape[0], given.shape[1])
        slope = Slope.fit(given, 1.0 if what == "width" else AREAS)
        if slope is None:
            return cls(size, 0.0, 90.0, FOV if fov is None else fov)
        rise = np.array(slope.down) * (slope.slope / slope.scale)
        sure = float(np.exp(-((slope.residual / FIT) ** 2)))
        return cls._of_line(size, np.array([*rise, 1.0]), "scale", fov, confidence=sure)

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> Plane:
        """Return the plane that a mapping from `as_dict` describes.

        Parameters
        ----------
        given : mapping
            ``shape`` (rows, columns) in pixels and ``slant`` in degrees. Optional: ``tilt``, ``fov`` and ``rotation``
            in degrees, and ``confidence``, 0 to 1.

        Returns
        -------
        Plane

        Raises
        ------
        InvalidInput
            If `given` is not such a mapping, or a value is out of its range.

        Examples
        --------
        >>> from texrs import Plane
        >>> plane = Plane((64, 96), slant=50)
        >>> Plane.of(plane.as_dict()) == plane
        True

        """
        if not isinstance(given, Mapping) or not {"shape", "slant"} <= set(given) <= set(cls.__dataclass_fields__):
            raise InvalidInput(
                f"plane: must be a mapping with shape, slant and optional tilt, fov, rotation, confidence, got {given!r}"
            )
        return cls(**given)

    @classmethod
    def _of_directions(cls, size: tuple[int, ...], points: NDArray[np.float64], name: str, fov: float | None) -> Plane:
        """Return the plane of perpendicular directions, by their homogeneous vanishing points (2, 3) from the middle."""
        long_ = max(size)
        finite = [abs(p[2]) * 50 * long_ > hypot(p[0], p[1]) for p in points]
        if fov is None and all(finite):
            first, second = (p[:2] / p[2] for p in points)
            squared = -float(first @ second)
            if squared > 0:
                found = 2 * degrees(atan(long_ / 2 / squared**0.5))
                fov = found if 5 <= found <= 150 else None
        plane = cls._of_line(size, np.cross(*points), name, fov)
        # Compute the angles of both directions on the flattened plane.
        ways = [plane._affine @ (p[:2] / np.linalg.norm(p)) for p in points]
        angles = [degrees(np.arctan2(-way[0], way[1])) for way in ways]
        # Rotate by the first direction, to the nearer axis: a column or a row.
        off = [(a + 45) % 90 - 45 for a in angles]
        return cls(plane.shape, plane.slant, plane.tilt, plane.fov, to_digits(-off[0]), plane.confidence)

    @classmethod
    def _of_line(
        cls, size: tuple[int, ...], line: NDArray[np.float64], name: str, fov: float | None, confidence: float = 1.0
    ) -> Plane:
        """Return the plane of a horizon: coefficients of a line in (row, column, 1), from the middle of the image."""
        scale = np.linalg.norm(line[:2]) * max(size) + abs(line[2])
        if not np.isfinite(line).all() or scale == 0:
            raise InvalidInput(f"{name}: must be different points, got equal points")
        if abs(line[2]) < 1e-6 * scale:
            raise InvalidInput(
                f"{name}: must give a horizon that does not pass through the middle of the image; crop the image to the plane"
            )
        rise = line[:2] / line[2]
        angle = FOV if fov is None else as_float(fov, "fov", 1, 170)
        steep = hypot(*rise)
        slant = degrees(atan(steep * find_focal(size, angle)))
        if slant > MAX_SLANT:
            raise InvalidInput(
                f"{name}: must give a slant of at most {MAX_SLANT:.0f} degrees, got {slant:.1f}; the plane is seen edge on"
            )
        # The tilt is the direction of increasing depth, opposite to the growth of the scale.
        tilt = degrees(np.arctan2(rise[0], -rise[1])) if steep > FLAT / max(size) else 90.0
        return cls((size[0], size[1]), to_digits(slant), to_digits(tilt), to_digits(angle), 0.0, confidence)

    # --- properties and maps -----------------------------------------------------------------------------------------

    @property
    def principal_point(self) -> Pair:
        """Row and column of the middle of the image."""
        return (self.shape[0] - 1) / 2, (self.shape[1] - 1) / 2

    @property
    def focal(self) -> float:
        """Focal length in pixels."""
        return find_focal(self.shape, self.fov)

    @property
    def homography(self) -> NDArray[np.float64]:
        """Matrix (3, 3) from (row, column, 1) in the image to homogeneous (row, column, 1) on the flattened plane."""
        move = np.eye(3)
        move[:2, 2] = np.negative(self.principal_point)
        matrix = np.eye(3)
        matrix[:2, :2], matrix[2, :2] = self._affine, self._rise
        return np.asarray(matrix @ move, np.float64)

    @property
    def horizon(self) -> tuple[Pair, Pair] | None:
        """Two points (row, column) of the horizon, one longer side apart. None for a plane seen from the front."""
        rise = self._rise
        steep = float(rise @ rise)
        if steep < (FLAT / max(self.shape)) ** 2:
            return None
        foot = np.array(self.principal_point) - rise / steep
        along = np.array([-rise[1], rise[0]]) / steep**0.5 * max(self.shape) / 2
        ends = foot - along, foot + along
        first, second = sorted(ends, key=lambda p: (p[1], p[0]))
        return (float(first[0]), float(first[1])), (float(second[0]), float(second[1]))

    @property
    def vanishing_points(self) -> NDArray[np.float64]:
        """Vanishing points (row, column) of the columns and of the rows of the flattened plane, (2, 2)."""
        ways = np.concatenate([np.eye(2), np.zeros((2, 1))], axis=1) @ np.linalg.inv(self.homography).T
        tiny = np.where(np.abs(ways[:, 2:]) < 1e-12, 1e-12, ways[:, 2:])
        return np.asarray(ways[:, :2] / tiny, np.float64)

    def width(self, points: Array | Sequence[Sequence[float]]) -> NDArray[np.float64]:
        """Return the apparent width of elements at points, across the slope.

        Parameters
        ----------
        points : (..., 2) array_like
            Rows and columns in the image, in pixels.

        Returns
        -------
        (...) float64
            Relative widths: 1 in the middle of the image, 0 at the horizon, and negative beyond it.

        Raises
        ------
        ValueError
            If the points are not pairs of numbers.

        Examples
        --------
        >>> from texrs import Plane
        >>> round(float(Plane((65, 97), slant=50).width([32, 48])), 3)
        1.0

        """
        return 1 + along(as_places(points) - self.principal_point, self._rise)

    def scale_map(self, scale_kind: Literal["width", "area"] = "width") -> ScaleMap:
        """Return the apparent size of elements at each pixel.

        Parameters
        ----------
        scale_kind : {"width", "area"}
            "width": widths across the slope. "area": square roots of areas, which are widths to the power 1.5 because
            elements are also foreshortened along the slope. Default: "width".

        Returns
        -------
        (H, W) ScaleMap
            Sizes in float32, 1 in the middle of the image. The minimum is 0.001, at the horizon and beyond it.

        Raises
        ------
        InvalidInput
            If the kind is not one of these.

        Examples
        --------
        >>> from texrs import Plane
        >>> Plane((3, 3), slant=0).scale_map().ravel().tolist() == [1.0] * 9
        True

        """
        what = as_kind(scale_kind)
        wide = np.maximum(self.width(np.moveaxis(np.indices(self.shape), 0, -1)), MIN_SCALE)
        return ScaleMap(
            np.maximum(wide if what == "width" else wide ** (1 / AREAS), MIN_SCALE).astype(np.float32), what
        )

    def flatten(self, points: Array | Sequence[Sequence[float]]) -> NDArray[np.float64]:
        """Return the points of the flattened plane that are visible at points of the image.

        Parameters
        ----------
        points : (..., 2) array_like
            Rows and columns in the image, in pixels.

        Returns
        -------
        (..., 2) float64
            Rows and columns on the plane, from the middle of the image and in pixels there. Positions of points
            beyond the horizon are meaningless.

        Raises
        ------
        ValueError
            If the points are not pairs of numbers.

        Examples
        --------
        >>> from texrs import Plane
        >>> Plane((65, 97), slant=50).flatten([32, 48]).tolist()
        [0.0, 0.0]

        """
        given = as_places(points)
        wide = np.maximum(self.width(given), MIN_SCALE)
        return transform(self._affine, given - self.principal_point) / wide[..., np.newaxis]

    def project(self, points: Array | Sequence[Sequence[float]]) -> NDArray[np.float64]:
        """Return the positions in the image of points of the flattened plane.

        Parameters
        ----------
        points : (..., 2) array_like
            Rows and columns on the plane, as `flatten` returns them.

        Returns
        -------
        (..., 2) float64
            Rows and columns in the image, in pixels. NaN for points behind the camera.

        Raises
        ------
        ValueError
            If the points are not pairs of numbers.

        Examples
        --------
        >>> from texrs import Plane
        >>> plane = Plane((65, 97), slant=50)
        >>> plane.project(plane.flatten([[10.0, 20.0]])).round(6).tolist()
        [[10.0, 20.0]]

        """
        given = transform(self._inverse, as_places(points))
        nearness = 1 - along(given, self._rise)
        with np.errstate(divide="ignore", invalid="ignore"):
            seen = given / np.where(nearness > 0, nearness, np.nan)[..., np.newaxis]
        return np.asarray(seen + self.principal_point, np.float64)

    def projection_jacobians(self, points: Array | Sequence[Sequence[float]]) -> NDArray[np.float64]:
        """Return the Jacobians of `project` at points of the flattened plane.

        Parameters
        ----------
        points : (..., 2) array_like
            Rows and columns on the plane, as `flatten` returns them.

        Returns
        -------
        (..., 2, 2) float64
            Matrices from a step (row, column) on the plane to the step in the image.

        Raises
        ------
        ValueError
            If the points are not pairs of numbers.

        Examples
        --------
        >>> from texrs import Plane
        >>> Plane((65, 97), slant=60).projection_jacobians([0, 0]).round(3).tolist()
        [[0.5, 0.0], [0.0, 1.0]]

        """
        given = transform(self._inverse, as_places(points))
        wide = (1 / (1 - along(given, self._rise)))[..., np.newaxis, np.newaxis]
        bent = np.eye(2) + wide * given[..., :, np.newaxis] * self._rise
        return np.asarray(wide * np.einsum("...ij,jk->...ik", bent, self._inverse), np.float64)

    def jacobians(self) -> NDArray[np.float64]:
        """Return the Jacobians of `flatten` at each pixel.

        Returns
        -------
        (H, W, 2, 2) float64 array
            Matrices from a step (row, column) in the image to the step on the flattened plane. They have no meaning
            beyond the horizon.

        Examples
        --------
        >>> from texrs import Plane
        >>> floor = Plane((101, 101), slant=60, tilt=90, fov=60)
        >>> floor.jacobians()[50, 50].round(6).tolist()
        [[2.0, 0.0], [0.0, 1.0]]

        """
        away = np.moveaxis(np.indices(self.shape, np.float64), 0, -1) - self.principal_point
        wide = np.maximum(1 + along(away, self._rise), MIN_SCALE)[..., np.newaxis, np.newaxis]
        flat = transform(self._affine, away)
        return np.asarray(self._affine / wide - flat[..., :, np.newaxis] * self._rise / (wide * wide), np.float64)

    def as_slope(self) -> Slope | None:
        """Return the slope of the width map, with the slant and the rotation, which a width map does not contain.

        Returns
        -------
        Slope or None
            A slope as in `texrs.scale_maps`. None for a plane that is seen from the front.

        Examples
        --------
        >>> from texrs import Plane
        >>> Plane((65, 97), slant=0).as_slope() is None
        True

        """
        found = Slope.fit(self.scale_map())
        return None if found is None else replace(found, lean=cos(radians(self.slant)), rotation=self.rotation)

    def as_dict(self) -> dict[str, Any]:
        """Return the plane as JSON types, which `Plane.of` accepts.

        Returns
        -------
        dict
            ``shape`` in pixels, ``slant``, ``tilt``, ``fov`` and ``rotation`` in degrees, and ``confidence`` from 0 to
            1.

        Examples
        --------
        >>> from texrs import Plane
        >>> Plane((64, 96), slant=50).as_dict()["shape"]
        [64, 96]

        """
        return {name: getattr(self, name) for name in self.__dataclass_fields__} | {"shape": list(self.shape)}

    @property
    def _way(self) -> NDArray[np.float64]:
        """Direction in the image along which depth grows, (row, column)."""
        angle = radians(self.tilt)
        return to_grid([-sin(angle), cos(angle)])

    @property
    def _rise(self) -> NDArray[np.float64]:
        """Growth of the relative width per pixel, (row, column)."""
        return to_grid(-self._way * (tan(radians(self.slant)) / self.focal))

    @property
    def _affine(self) -> NDArray[np.float64]:
        """Stretch along the slope, followed by the rotation."""
        return to_grid(np.einsum("ij,jk->ik", self._turned, self._stretched(1 / cos(radians(self.slant)))))

    @property
    def _inverse(self) -> NDArray[np.float64]:
        return to_grid(np.einsum("ij,kj->ik", self._stretched(cos(radians(self.slant))), self._turned))

    @property
    def _turned(self) -> NDArray[np.float64]:
        """Rotation matrix, counter-clockwise in the image because rows grow downwards."""
        angle = radians(self.rotation)
        return np.array([[cos(angle), -sin(angle)], [sin(angle), cos(angle)]])

    def _stretched(self, factor: float) -> NDArray[np.float64]:
        return np.asarray(np.eye(2) + (factor - 1) * np.outer(self._way, self._way), np.float64)

"""The known facts about a plane in a photograph: its orientation, and the pixels that show it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import islice

import numpy as np

from texrs._arrays import as_array, as_float, as_items, as_mask, as_size
from texrs._masks import Mask
from texrs._typing import Array, Bools
from texrs.errors import InvalidInput
from texrs.planes._plane import FOV, MAX_SLANT, Plane

__all__ = ["PlaneView"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlaneView:
    """The known facts about a plane in a photograph. Missing facts are found in the photograph.

    `texrs.rectify`, `texrs.extend` and `texrs.remove` accept a view, or only a `Plane`, as ``view``.

    Parameters
    ----------
    plane : Plane, optional
        The plane. Default: the plane of ``corners`` or ``slant`` if one is given, else the plane that
        `texrs.planes.find` finds.
    corners : four of (row, column), optional
        Positions of the corners of a rectangle on the plane, in order around it.
    slant : float, optional
        Angle between the line of sight and the plane's normal in degrees, 0 (seen from the front) to 88.
    tilt : float, optional
        Direction in the image along which depth grows, in degrees counter-clockwise from the right. It requires
        ``slant``. Default: 90, a floor.
    fov : float, optional
        Angle of view of the longer side of the photograph in degrees, 1 to 170 (`texrs.io.read_fov`). Default: the
        angle that a command reads from the file, else the angle that the corners determine, else 60.
    ground : (H, W) array, path or Mask, optional
        Mask of the pixels that show the plane. Default: the pixels that are found automatically
        (`texrs.planes.find_ground`), or all pixels if the plane is given and the photograph is rectified or extended.

    Raises
    ------
    InvalidInput
        If an option is out of its range, or the orientation is given twice.

    Examples
    --------
    >>> import texrs
    >>> floor = texrs.samples.tilted_discs((128, 128)).image
    >>> texrs.extend(floor, right=32, view=texrs.PlaneView(slant=35, fov=55)).image.shape
    (128, 160, 3)
    >>> texrs.PlaneView(slant=35, corners=[[9, 20], [9, 80], [90, 99], [90, 4]])
    Traceback (most recent call last):
        ...
    texrs.errors.InvalidInput: slant: cannot be combined with corners

    """

    plane: Plane | None = None
    corners: Sequence[Sequence[float]] | Array | None = None
    slant: float | None = None
    tilt: float | None = None
    fov: float | None = None
    ground: Array | Mask | str | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        given = [name for name in ("plane", "corners", "slant") if getattr(self, name) is not None]
        if len(given) > 1:
            raise InvalidInput(f"{given[1]}: cannot be combined with {given[0]}")
        if self.plane is not None and not isinstance(self.plane, Plane):
            raise InvalidInput(f"plane: must be a texrs.Plane, got {self.plane!r}")
        if self.tilt is not None and self.slant is None:
            raise InvalidInput("tilt: requires slant; give both")
        if self.plane is not None and self.fov is not None:
            raise InvalidInput("fov: cannot be combined with plane, which has its own field of view")
        for name, least, most in (("slant", 0, MAX_SLANT), ("tilt", -1e6, 1e6), ("fov", 1, 170)):
            value = getattr(self, name)
            object.__setattr__(self, name, None if value is None else as_float(value, name, least, most))
        if self.corners is not None:
            object.__setattr__(self, "corners", as_array(self.corners, "corners", np.float64, (4, 2)))

    @classmethod
    def of(cls, given: PlaneView | Plane | Sequence[PlaneView | Plane] | None) -> PlaneView:
        """Return a view: the given view, a view of the given plane, or a view without known facts for None.

        Parameters
        ----------
        given : PlaneView or Plane, optional
            The known facts about the photograph.

        Returns
        -------
        PlaneView

        Raises
        ------
        InvalidInput
            If `given` is of another type, or a sequence of planes. Only one plane can be rectified at a time.

        Examples
        --------
        >>> from texrs import Plane, PlaneView
        >>> PlaneView.of(Plane((64, 96), slant=50)).plane.slant
        50.0

        """
        if given is None or isinstance(given, Plane):
            return cls(plane=given)
        if isinstance(given, list | tuple):
            raise InvalidInput(f"view: must be one plane, got a sequence of {len(given)}")
        if not isinstance(given, PlaneView):
            raise InvalidInput(f"view: must be a texrs.PlaneView or a texrs.Plane, got {given!r}")
        return given

    def settle(self, shape: Sequence[int]) -> tuple[Plane | None, Bools | None]:
        """Return the known plane and the known ground of a photograph.

        Parameters
        ----------
        shape : (rows, columns)
            Size of the photograph in pixels.

        Returns
        -------
        plane : Plane or None
            The plane, or None if it must be found.
        ground : (rows, columns) bool or None
            Mask of the pixels that show the plane, or None if it must be found.

        Raises
        ------
        InvalidInput
            If the plane or the ground has another shape, the ground marks nothing, or the corners are not convex.

        Examples
        --------
        >>> from texrs import PlaneView
        >>> plane, ground = PlaneView(slant=40, tilt=90).settle((64, 96))
        >>> plane.shape, ground is None
        ((64, 96), True)

        """
        rows, columns = as_size(list(islice(as_items(shape, "shape"), 2)), "shape")
        size = rows, columns
        ground = None if self.ground is None else as_mask(self.ground, "ground", size)
        if ground is not None and not ground.any():
            raise InvalidInput("ground: must mark at least one pixel, got none")
        if self.plane is not None and self.plane.shape != size:
            raise InvalidInput(f"plane: must have the shape of the image, {size[0]} x {size[1]}, got {self.plane!r}")
        if self.corners is not None:
            return Plane.of_corners(size, np.asarray(self.corners), fov=self.fov), ground
        if self.slant is not None:
            tilt, fov = 90.0 if self.tilt is None else self.tilt, FOV if self.fov is None else self.fov
            return Plane(size, self.slant, tilt, fov), ground
        return self.plane, ground

"""What is said of a plane in a photograph: how it lies, and where it is seen."""

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
    """How a photograph shows a plane, as far as somebody says: what is not said is found.

    `texrs.rectify`, `texrs.extend` and `texrs.remove` take one, or a `Plane` alone, as ``view``.

    Parameters
    ----------
    plane : Plane, optional
        How the plane lies. By default what ``corners``, or ``slant``, says, else it is found (`texrs.planes.find`).
    corners : four of (row, column), optional
        Where the corners of a rectangle of the plane are seen, in the order in which one goes around.
    slant : float, optional
        Degrees between the line of sight and the plane's normal, 0 (seen from the front) to 88.
    tilt : float, optional
        With ``slant``: the direction in the picture in which depth grows, degrees counter-clockwise from the right; by default
        90, a floor.
    fov : float, optional
        Degrees that the longer side of the photograph spans, 1 to 170 (`texrs.io.read_fov`; the command reads it of the
        file). By default what the corners tell, else 60.
    ground : (H, W) array, path or Mask, optional
        Mask of the pixels that show the plane. Default: the ground that is found (`texrs.planes.find_ground`). If the plane is
        given and the photograph is made flat or larger, the default is all pixels.

    Raises
    ------
    InvalidInput
        Options out of their ranges, or two ways to say how the plane lies.

    Examples
    --------
    >>> import texrs
    >>> floor = texrs.samples.tilted_discs((128, 128)).image
    >>> texrs.extend(floor, right=32, view=texrs.PlaneView(slant=35, fov=55)).image.shape
    (128, 160, 3)
    >>> texrs.PlaneView(slant=35, corners=[[9, 20], [9, 80], [90, 99], [90, 4]])
    Traceback (most recent call last):
        ...
    texrs.errors.InvalidInput: slant: corners says how the plane lies already

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
            raise InvalidInput(f"{given[1]}: {given[0]} says how the plane lies already")
        if self.plane is not None and not isinstance(self.plane, Plane):
            raise InvalidInput(f"plane: needs a texrs.Plane, got {self.plane!r}")
        if self.tilt is not None and self.slant is None:
            raise InvalidInput("tilt: needs slant")
        if self.plane is not None and self.fov is not None:
            raise InvalidInput("fov: the plane has one already")
        for name, least, most in (("slant", 0, MAX_SLANT), ("tilt", -1e6, 1e6), ("fov", 1, 170)):
            value = getattr(self, name)
            object.__setattr__(self, name, None if value is None else as_float(value, name, least, most))
        if self.corners is not None:
            object.__setattr__(self, "corners", as_array(self.corners, "corners", np.float64, (4, 2)))

    @classmethod
    def of(cls, given: PlaneView | Plane | Sequence[PlaneView | Plane] | None) -> PlaneView:
        """Return a view as it is, one of a plane, or one of which nothing is said.

        Parameters
        ----------
        given : PlaneView or Plane, optional
            What is known of the photograph.

        Returns
        -------
        PlaneView

        Raises
        ------
        InvalidInput
            Something else, or several planes: one is made flat at a time.

        Examples
        --------
        >>> from texrs import Plane, PlaneView
        >>> PlaneView.of(Plane((64, 96), slant=50)).plane.slant
        50.0

        """
        if given is None or isinstance(given, Plane):
            return cls(plane=given)
        if isinstance(given, list | tuple):
            raise InvalidInput(f"view: one plane is made flat at a time, got {len(given)}")
        if not isinstance(given, PlaneView):
            raise InvalidInput(f"view: needs a texrs.PlaneView, or a texrs.Plane, got {given!r}")
        return given

    def settle(self, shape: Sequence[int]) -> tuple[Plane | None, Bools | None]:
        """Return the plane and the ground that are said of a photograph.

        Parameters
        ----------
        shape : (rows, columns)
            Of the photograph, in pixels.

        Returns
        -------
        plane : Plane or None
            None: it is to be found.
        ground : (rows, columns) bool or None
            Where the plane is seen. None: that is to be found.

        Raises
        ------
        InvalidInput
            A plane or a ground of another shape, a ground that marks nothing, or corners of no convex shape.

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
            raise InvalidInput("ground: marks nothing, so the plane is nowhere seen")
        if self.plane is not None and self.plane.shape != size:
            raise InvalidInput(f"plane: needs one of a picture of {size[0]} x {size[1]}, got {self.plane!r}")
        if self.corners is not None:
            return Plane.of_corners(size, np.asarray(self.corners), fov=self.fov), ground
        if self.slant is not None:
            tilt, fov = 90.0 if self.tilt is None else self.tilt, FOV if self.fov is None else self.fov
            return Plane(size, self.slant, tilt, fov), ground
        return self.plane, ground

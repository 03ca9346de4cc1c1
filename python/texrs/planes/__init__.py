"""Planes in photographs: their orientation, the point of the plane at each pixel, and the size of elements there.

A `Plane` is given by angles, by four corners of a rectangle, by two vanishing points, by its horizon, or by a scale
map. `find` finds the plane in an image, and `find_ground` finds the pixels that show it. A `PlaneView` contains the
facts about both that are known. `measure_scale` returns the size of elements at each pixel, also for images that do
not show a plane.
"""

from texrs.planes._find import find
from texrs.planes._ground import find_ground
from texrs.planes._plane import FOV, MAX_SLANT, Plane
from texrs.planes._view import PlaneView
from texrs.planes.sizes import ScaleEstimate, measure_scale

__all__ = ["FOV", "MAX_SLANT", "Plane", "PlaneView", "ScaleEstimate", "find", "find_ground", "measure_scale"]


def __dir__() -> list[str]:
    return __all__

"""Planes in photographs: how they lie, where each pixel is on them, and how large things are there.

A `Plane` is said by angles, by four corners of a rectangle, by two vanishing points, by its horizon or by a scale map; `find`
finds it in a picture alone, and `find_ground` where the picture shows it. A `PlaneView` is what somebody says of both.
`measure_scale` returns the sizes of elements all over a picture, also where the picture does not show a plane.
"""

from texrs.planes._find import find
from texrs.planes._ground import find_ground
from texrs.planes._plane import FOV, MAX_SLANT, Plane
from texrs.planes._sizes import ScaleEstimate, measure_scale
from texrs.planes._view import PlaneView

__all__ = ["FOV", "MAX_SLANT", "Plane", "PlaneView", "ScaleEstimate", "find", "find_ground", "measure_scale"]


def __dir__() -> list[str]:
    return __all__

"""Target of an output (section 4): the size of elements at each pixel, or a surface that the texture covers.

The paper has only scale maps. A surface also specifies that elements are foreshortened more along one direction than
along another. It is given as a plane, normals, texture coordinates or Jacobians. All are converted to Jacobians: the
step on the texture for a step of one pixel in the image, at each pixel.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, TypeAlias, TypeGuard

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_float, check_memory, try_array
from texrs._typing import Array, Floats
from texrs.errors import InvalidInput
from texrs.planes import Plane
from texrs.scale_maps import jacobians_of_coordinates, jacobians_of_normals
from texrs.scale_maps.jacobians import as_jacobians
from texrs.scale_maps.maps import as_map
from texrs.scale_maps.resampling import stretch

__all__ = ["Surface", "as_surface", "as_target", "find_size", "is_map", "is_words", "read_plane"]

PREFIX = "plane:"
"""Prefix of a text that describes a plane."""
WORDS = ("slant", "tilt", "fov", "rotation")
NEAREST = 0.02
"""Minimum scale in an image of a plane, as a share of the scale in its middle. Smaller scales are near the horizon.
"""

Surface: TypeAlias = NDArray[np.float64]
"""Jacobians (rows, columns, 2, 2): the step on the texture for a step of one pixel in the image."""


def as_target(target: object, green: Literal["up", "down"] = "up") -> Plane | str | Floats | Surface | None:
    """Return a checked target: a plane, its text, a scale map, or the Jacobians of a surface."""
    if target is None or isinstance(target, Plane):
        return target
    if isinstance(target, str):
        read_plane(target, (1, 1), "target")
        return target
    given = try_array(target)
    check_memory(8 * given.size, "target")
    if given.ndim == 4:
        return as_jacobians(given, "target")
    if given.ndim == 3 and given.shape[2] in (2, 3):
        if given.shape[2] == 2 and given.dtype.kind != "f":
            raise InvalidInput(f"target: coordinates of shape (rows, columns, 2) must be floats, got {given.dtype}")
        try:
            made = jacobians_of_coordinates(given) if given.shape[2] == 2 else jacobians_of_normals(given, green=green)
        except InvalidInput as error:
            raise InvalidInput(f"target: {error}") from None
        return as_jacobians(made, "target")
    return as_map(target, "target")


def find_size(target: Plane | str | Array | None) -> tuple[int, int] | None:
    """Return the (rows, columns) of a target, or None if it does not have a size."""
    if target is None or isinstance(target, str):
        return None
    return target.shape[0], target.shape[1]


def is_map(target: Plane | str | Floats | Surface) -> TypeGuard[Floats]:
    """Return whether a target is a scale map."""
    return not isinstance(target, Plane | str) and target.ndim == 2


def is_words(value: object) -> TypeGuard[str]:
    """Return whether a value is a text that describes a plane."""
    return isinstance(value, str) and value.startswith(PREFIX)


def as_surface(target: Plane | str | Floats | Surface, size: tuple[int, int]) -> Surface:
    """Return the Jacobians of a surface in an image of a given size.

    A plane gets a camera of this size, and other surfaces are resized.
    """
    if isinstance(target, str):
        target = read_plane(target, size, "target")
    if not isinstance(target, Plane):
        bent = np.asarray(target, np.float64)
        return bent if bent.shape[:2] == size else as_jacobians(stretch(bent, size), "target")
    seen = Plane(size, target.slant, target.tilt, target.fov, target.rotation)
    rows, columns = size[0] - 1, size[1] - 1
    near = float(seen.width([[0, 0], [0, columns], [rows, 0], [rows, columns]]).min())
    if near < NEAREST:
        raise InvalidInput(
            f"target: must not contain the horizon, but with slant {seen.slant:g} and fov {seen.fov:g} degrees it does; "
            "give a smaller slant or fov"
        )
    return seen.jacobians()


def read_plane(words: str, shape: Sequence[int], name: str) -> Plane:
    """Return the plane that a text such as ``plane:slant=50,tilt=90,fov=60`` describes."""
    form = (
        f"{name}: must be plane:slant=DEGREES with optional tilt=, fov= and rotation=, such as plane:slant=50,tilt=90"
    )
    if not words.startswith(PREFIX):
        raise InvalidInput(f"{form}; got {words!r}")
    values: dict[str, float] = {}
    for part in words.removeprefix(PREFIX).split(","):
        word, _, text = (p.strip() for p in part.partition("="))
        try:
            number = float(text)
        except ValueError:
            number = np.nan
        if word not in WORDS or word in values or not np.isfinite(number):
            raise InvalidInput(f"{form}; got {words!r}")
        values[word] = as_float(number, f"{name}: {word}", -1e6, 1e6)
    if "slant" not in values:
        raise InvalidInput(f"{form}; got {words!r}")
    try:
        return Plane((shape[0], shape[1]), **values)
    except InvalidInput as error:
        raise InvalidInput(f"{name}: {error}") from None

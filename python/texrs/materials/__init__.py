"""Materials: maps of one surface in register, which every verb takes for an example and gives back as a whole."""

from texrs._lighting_correction import flatten_lighting
from texrs.materials._applying import apply
from texrs.materials._map import Map, Space
from texrs.materials._material import Material
from texrs.materials._roles import Role, guess_role

__all__ = ["Map", "Material", "Role", "Space", "apply", "flatten_lighting", "guess_role"]


def __dir__() -> list[str]:
    return __all__

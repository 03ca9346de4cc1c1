"""Materials: several maps of one surface, aligned pixel by pixel.

Every verb takes a material as an example and returns all of its maps.
"""

from texrs._lighting_correction import flatten_lighting
from texrs.materials._map import Map, Space
from texrs.materials._roles import Role, guess_role
from texrs.materials.applying import apply
from texrs.materials.material import Material

__all__ = ["Map", "Material", "Role", "Space", "apply", "flatten_lighting", "guess_role"]


def __dir__() -> list[str]:
    return __all__

"""What a map of a material is for, and how its name says so.

===================== ========================================================================================
Role                  Words of a name, or of its end
===================== ========================================================================================
``colour``            albedo, alb, basecolor, base_color, base_colour, color, colour, col, diffuse, diff, bc
``normal``            normal, normals, nor, nrm, norm, normal_gl, nor_gl, nrm_gl, normal_opengl (y grows up)
``normal-dx``         normal_dx, nor_dx, nrm_dx, normal_directx (y grows down)
``height``            height, displacement, disp, bump
``roughness``         roughness, rough, rgh
``metallic``          metallic, metalness, metal, met
``occlusion``         ao, occlusion, occ, ambient_occlusion
``opacity``           opacity, alpha, transparency
``emission``          emission, emissive, emit, glow
``orm``               orm, arm: occlusion, roughness and metallic as red, green and blue
``mask``              mask
``labels``            labels, label, ids, id, segmentation
``vector``            vector, flow, flowmap, tangent, direction
``other``             gloss, glossiness, smoothness, specular, spec, translucency, other
===================== ========================================================================================

Words are parted by ``_``, ``-``, ``.``, spaces and capitals, and numbers and sizes (``2k``, ``4096``) do not count:
``Rock035_2K_NormalDX.png`` and ``rock-nor_dx.png`` are both ``normal-dx``.
"""

from __future__ import annotations

import re
from enum import Enum

from texrs._checks import as_instance
from texrs.errors import InvalidInput

__all__ = ["Role", "as_role", "guess_role"]


class Role(Enum):
    """What a map is for; how it is looked up, blended, turned and written follows from it.

    Parameters
    ----------
    value : str
        As "colour", "normal" (y up), "normal-dx" (y down), "height" and so on.

    Examples
    --------
    >>> from texrs.materials import Role
    >>> Role("normal-dx").normal, Role.LABELS.labelled
    (True, True)

    """

    COLOUR = "colour"
    NORMAL = "normal"
    NORMAL_DX = "normal-dx"
    HEIGHT = "height"
    ROUGHNESS = "roughness"
    METALLIC = "metallic"
    OCCLUSION = "occlusion"
    OPACITY = "opacity"
    EMISSION = "emission"
    ORM = "orm"
    MASK = "mask"
    LABELS = "labels"
    VECTOR = "vector"
    OTHER = "other"

    @property
    def coloured(self) -> bool:
        """Whether its values are seen, so that 8 and 16 bit are encoded as sRGB."""
        return self in (Role.COLOUR, Role.EMISSION)

    @property
    def normal(self) -> bool:
        """Whether its values are normals of the surface."""
        return self in (Role.NORMAL, Role.NORMAL_DX)

    @property
    def labelled(self) -> bool:
        """Whether its values have no meaning between them."""
        return self in (Role.MASK, Role.LABELS)


WORDS: dict[Role, str] = {
    Role.COLOUR: "albedo alb basecolor basecolour color colour col diffuse diff bc",
    Role.NORMAL: "normal normals nor nrm norm normalgl norgl nrmgl normalopengl",
    Role.NORMAL_DX: "normaldx nordx nrmdx normaldirectx",
    Role.HEIGHT: "height displacement disp bump",
    Role.ROUGHNESS: "roughness rough rgh",
    Role.METALLIC: "metallic metalness metal met",
    Role.OCCLUSION: "ao occlusion occ ambientocclusion",
    Role.OPACITY: "opacity alpha transparency",
    Role.EMISSION: "emission emissive emit glow",
    Role.ORM: "orm arm",
    Role.MASK: "mask",
    Role.LABELS: "labels label ids id segmentation",
    Role.VECTOR: "vector flow flowmap tangent direction",
    Role.OTHER: "gloss glossiness smoothness specular spec translucency other",
}
ROLES = {word: role for role, words in WORDS.items() for word in words.split()}
SIZE = re.compile(r"\d+k?")
AMERICAN = {"color": "colour", "normal-gl": "normal"}


def guess_role(name: str) -> Role | None:
    """Return the role that a name says a map has; None where it says none.

    The last words count, longer ones first: ``ambient_occlusion`` is one, ``wood_diff`` is by its end.

    Parameters
    ----------
    name : str
        Of a map or of its file, without the suffix.

    Returns
    -------
    Role or None

    Raises
    ------
    TypeError
        Not a text.

    Examples
    --------
    >>> guess_role("Rock035_2K_NormalDX"), guess_role("fabric-ao-4096"), guess_role("preview")
    (<Role.NORMAL_DX: 'normal-dx'>, <Role.OCCLUSION: 'occlusion'>, None)

    """
    as_instance(name, "name", str)
    # A run of capitals is a word: NormalDX, fabricAO.
    parted = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", name)
    words = [w for w in re.split(r"[^a-z0-9]+", parted.lower()) if w and not SIZE.fullmatch(w)]
    for end in range(len(words), 0, -1):
        for count in (3, 2, 1):
            if count <= end and (role := ROLES.get("".join(words[end - count : end]))) is not None:
                return role
    return None


def as_role(value: object, name: str) -> Role:
    """Check a role, or the word for it.

    Raises
    ------
    InvalidInput
        No such role.

    """
    if isinstance(value, Role):
        return value
    as_instance(value, name, str, Role)
    try:
        return Role(AMERICAN.get(str(value), value))
    except ValueError:
        allowed = ", ".join(role.value for role in Role)
        raise InvalidInput(f"{name}: allowed roles are {allowed}; got {value!r}") from None

"""Roles of the maps of a material, the quantity in each channel, and the file names that give a role.

====================== =======================================================================================
Role                   Words at the end of a name
====================== =======================================================================================
``colour``             albedo, alb, basecolor, base_color, base_colour, basemap, color, colour, col, diffuse, diff, bc,
                       albedo_transparency, albedo_opacity, image, photo
``normal``             normal, normals, nor, nrm, norm, normal_gl, nor_gl, nrm_gl, normal_opengl (y up)
``normal-dx``          normal_dx, nor_dx, nrm_dx, normal_directx (y down)
``normal-xy``          normal_xy, normal_rg (y up; z is not stored)
``normal-dx-xy``       normal_dx_xy, normal_dx_rg (y down; z is not stored)
``height``             height, displacement, disp, bump
``roughness``          roughness, rough, rgh
``smoothness``         smoothness, smooth, gloss, glossiness (1 - roughness)
``metallic``           metallic, metalness, metal, met
``occlusion``          ao, occlusion, occ, ambient_occlusion
``opacity``            opacity, alpha, transparency
``emission``           emission, emissive, emit, glow
``orm``                orm, arm, occlusion_roughness_metallic, ao_roughness_metallic
``metallic-roughness`` metallic_roughness, roughness_metallic
``metallic-smoothness`` metallic_smoothness, metallic_gloss
``mask-map``           mask_map
``labpbr-normal``      labpbr_n
``labpbr-specular``    labpbr_s
``mask``               mask
``labels``             labels, label, ids, id, segmentation
``vector``             vector, flow, flowmap, tangent, direction
``other``              specular, spec, reflectance, porosity, emissiveness, detail, translucency, translucent, other
====================== =======================================================================================

The last word of a name gives the role: ``metallic_paint_color`` is a colour map. Words are separated by ``_``, ``-``,
``.``, spaces and capital letters. Numbers, sizes (``2k``, ``4096``), versions (``v2``) and words such as ``map``,
``png`` or ``tileable`` are ignored.
"""

from __future__ import annotations

import re
from enum import Enum

from texrs._checks import as_instance
from texrs.errors import InvalidInput

__all__ = ["Role", "as_role", "guess_role"]


class Role(Enum):
    """Role of a map. It determines how the map is resampled, blended, rotated and encoded.

    Parameters
    ----------
    value : str
        Name of the role, such as "colour", "normal" (y up), "normal-dx" (y down) or "height".

    Examples
    --------
    >>> from texrs.materials import Role
    >>> Role("normal-dx").normal, Role.LABELS.labelled
    (True, True)
    >>> Role("mask-map").layout
    ('metallic', 'occlusion', 'detail', 'smoothness')

    """

    COLOUR = "colour"
    NORMAL = "normal"
    NORMAL_DX = "normal-dx"
    NORMAL_XY = "normal-xy"
    NORMAL_DX_XY = "normal-dx-xy"
    HEIGHT = "height"
    ROUGHNESS = "roughness"
    SMOOTHNESS = "smoothness"
    METALLIC = "metallic"
    OCCLUSION = "occlusion"
    OPACITY = "opacity"
    EMISSION = "emission"
    ORM = "orm"
    METALLIC_ROUGHNESS = "metallic-roughness"
    METALLIC_SMOOTHNESS = "metallic-smoothness"
    MASK_MAP = "mask-map"
    LABPBR_NORMAL = "labpbr-normal"
    LABPBR_SPECULAR = "labpbr-specular"
    MASK = "mask"
    LABELS = "labels"
    VECTOR = "vector"
    OTHER = "other"

    @property
    def quantities(self) -> tuple[str, ...]:
        """Quantity in each channel, such as ("normal", "normal", "occlusion", "height")."""
        return tuple("normal" if word in ("x", "y", "-y", "z") else word for word in self.layout) or (self.value,)

    @property
    def coloured(self) -> bool:
        """True if the values are visible colours, which are encoded as sRGB in 8 and 16 bits."""
        return self in (Role.COLOUR, Role.EMISSION)

    @property
    def layout(self) -> tuple[str, ...]:
        """Meaning of each channel, such as ("occlusion", "roughness", "metallic") or ("x", "y").

        It is empty if all channels belong to one quantity.
        """
        return LAYOUTS.get(self, ())

    @property
    def normal(self) -> bool:
        """True if the first channels are surface normals."""
        return "x" in self.layout

    @property
    def down(self) -> bool:
        """True if the y axis of the normals points down, as in DirectX."""
        return "-y" in self.layout

    @property
    def bare(self) -> bool:
        """True if the normals are stored without z."""
        return self.normal and "z" not in self.layout

    @property
    def packed(self) -> bool:
        """True if the channels are different quantities."""
        return bool(self.layout) and (self is Role.LABPBR_NORMAL or not self.normal)

    @property
    def labelled(self) -> bool:
        """True if values between two of its values have no meaning, so that they must not be mixed."""
        return self in (Role.MASK, Role.LABELS)


LAYOUTS: dict[Role, tuple[str, ...]] = {
    Role.NORMAL: ("x", "y", "z"),
    Role.NORMAL_DX: ("x", "-y", "z"),
    Role.NORMAL_XY: ("x", "y"),
    Role.NORMAL_DX_XY: ("x", "-y"),
    Role.ORM: ("occlusion", "roughness", "metallic"),
    Role.METALLIC_ROUGHNESS: ("", "roughness", "metallic"),
    Role.METALLIC_SMOOTHNESS: ("metallic", "metallic", "metallic", "smoothness"),
    Role.MASK_MAP: ("metallic", "occlusion", "detail", "smoothness"),
    Role.LABPBR_NORMAL: ("x", "-y", "occlusion", "height"),
    Role.LABPBR_SPECULAR: ("smoothness", "reflectance", "porosity", "emissiveness"),
}
"""Quantity in each channel of a map. "" is a channel without a meaning."""
CODED = ("reflectance", "porosity", "emissiveness")
"""Quantities of labPBR that are codes above a certain value, and therefore must not be mixed."""
WORDS: dict[Role, str] = {
    Role.COLOUR: "albedo alb basecolor basecolour basemap color colour col diffuse diff bc image photo "
    "albedotransparency albedoopacity",
    Role.NORMAL: "normal normals nor nrm norm normalgl norgl nrmgl normalopengl",
    Role.NORMAL_DX: "normaldx nordx nrmdx normaldirectx",
    Role.NORMAL_XY: "normalxy normalrg",
    Role.NORMAL_DX_XY: "normaldxxy normaldxrg",
    Role.HEIGHT: "height displacement disp bump",
    Role.ROUGHNESS: "roughness rough rgh",
    Role.SMOOTHNESS: "smoothness smooth gloss glossiness",
    Role.METALLIC: "metallic metalness metal met",
    Role.OCCLUSION: "ao occlusion occ ambientocclusion",
    Role.OPACITY: "opacity alpha transparency",
    Role.EMISSION: "emission emissive emit glow",
    Role.ORM: "orm arm occlusionroughnessmetallic aoroughnessmetallic",
    Role.METALLIC_ROUGHNESS: "metallicroughness roughnessmetallic",
    Role.METALLIC_SMOOTHNESS: "metallicsmoothness metallicgloss",
    Role.MASK_MAP: "maskmap",
    Role.LABPBR_NORMAL: "labpbrn",
    Role.LABPBR_SPECULAR: "labpbrs",
    Role.MASK: "mask",
    Role.LABELS: "labels label ids id segmentation",
    Role.VECTOR: "vector flow flowmap tangent direction",
    Role.OTHER: "specular spec reflectance porosity emissiveness detail translucency translucent other",
}
ROLES = {word: role for role, words in WORDS.items() for word in words.split()}
NEUTRAL = re.compile(
    r"v?\d+(k|px|bit)?|k|v|map|tex|texture|png|jpe?g|tiff?|exr|tga|webp|bmp|srgb|raw|linear|lin|tiled|tileable|seamless|final|copy"
)
"""Words that are ignored after the word for the role."""
AMERICAN = {"color": "colour", "normal-gl": "normal"}


def split_name(name: str) -> list[tuple[int, str]]:
    """Split a name into lower-case words with their positions. A run of capital letters is one word.

    Examples
    --------
    >>> split_name("Rock035_2K_NormalDX")
    [(0, 'rock035'), (8, '2'), (9, 'k'), (11, 'normal'), (17, 'dx')]

    """
    parted = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "\0", name)
    found, place = [], 0
    for part in re.split(r"([^A-Za-z0-9]+)", parted):
        if part and part[0].isascii() and part[0].isalnum():
            found.append((place, part.lower()))
        place += len(part) - part.count("\0")
    return found


def find_role(name: str) -> tuple[Role, int, int] | None:
    """Return the role that a name gives, and where its words begin and end; None if it gives none."""
    words = split_name(name)
    while words and NEUTRAL.fullmatch(words[-1][1]) and not _match(words):
        words.pop()
    count = _match(words)
    if not count:
        return None
    role = ROLES["".join(word for _, word in words[-count:])]
    return role, words[-count][0], words[-1][0] + len(words[-1][1])


def states_y(name: str) -> bool:
    """Return True if the name of a normal map states the direction of y, such as GL or DX."""
    found = find_role(name)
    words = split_name(name)
    if found is None:
        # In Unreal, a name such as T_Rock_N means y down.
        return name.startswith("T_") and words[-1][1] == "n"
    return re.search("gl|dx|directx", name[found[1] : found[2]].lower().replace("_", "")) is not None


def _match(words: list[tuple[int, str]]) -> int:
    """Return how many words at the end of a name give a role, 0 to 3."""
    counts = range(min(3, len(words)), 0, -1)
    return next((c for c in counts if "".join(word for _, word in words[-c:]) in ROLES), 0)


def guess_role(name: str) -> Role | None:
    """Return the role that a name gives, or None.

    The longest sequence of last words that is a role is used: ``ambient_occlusion`` is one role, and
    ``metallic_paint_color`` is a colour map.

    Parameters
    ----------
    name : str
        Name of a map, or of its file without the suffix.

    Returns
    -------
    Role or None

    Raises
    ------
    TypeError
        ``name`` is not a str.

    Examples
    --------
    >>> guess_role("Rock035_2K_NormalDX"), guess_role("fabric-ao-4096"), guess_role("preview")
    (<Role.NORMAL_DX: 'normal-dx'>, <Role.OCCLUSION: 'occlusion'>, None)
    >>> guess_role("car_occlusionRoughnessMetallic"), guess_role("metallic_paint_color"), guess_role("metallic_paint")
    (<Role.ORM: 'orm'>, <Role.COLOUR: 'colour'>, None)

    """
    found = find_role(as_instance(name, "name", str))
    return None if found is None else found[0]


def as_role(value: object, name: str) -> Role:
    """Return the role with the given name. A `Role` is returned unchanged.

    Raises
    ------
    InvalidInput
        The role is unknown.

    """
    if isinstance(value, Role):
        return value
    as_instance(value, name, str, Role)
    try:
        return Role(AMERICAN.get(str(value), value))
    except ValueError:
        allowed = ", ".join(role.value for role in Role)
        raise InvalidInput(f"{name}: must be one of {allowed}; got {value!r}") from None

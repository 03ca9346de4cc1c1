"""Naming conventions of tools and libraries: file names, and the quantity in each channel."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile

from texrs._notices import assume
from texrs.errors import InvalidInput
from texrs.materials._roles import Role, find_role, split_name

__all__ = ["CONVENTIONS", "File", "as_convention", "cut_name", "guess_roles", "list_conventions"]


@dataclass(frozen=True, slots=True)
class File:
    """One file of a convention: the end of its name, its role, and whether its alpha channel is the opacity."""

    end: str
    role: Role
    opacity: bool = False


@dataclass(frozen=True, slots=True)
class Convention:
    """File names and packings of one tool. If several files contain the same quantity, only the first is written."""

    title: str
    files: tuple[File, ...]
    start: str = ""

    @property
    def down(self) -> bool:
        """True if the y axis of normals points down."""
        return next(file.role.down for file in self.files if file.role.normal)


def _list(text: str) -> tuple[File, ...]:
    """Parse the files of a convention.

    Each line has the end of the name, the role, and "+ opacity" if alpha is the opacity.
    """
    files = []
    for line in text.strip().splitlines():
        end, role, *more = line.split()
        files.append(File(end.strip("."), Role(role), bool(more)))
    return tuple(files)


UNITY = """
_AlbedoTransparency colour + opacity
_MetallicSmoothness metallic-smoothness
_Normal normal
_Height height
_Occlusion occlusion
_Emission emission
"""
CONVENTIONS = {
    "ambientcg": Convention(
        "ambientCG",
        _list("""
_Color colour
_NormalGL normal
_NormalDX normal-dx
_Displacement height
_Roughness roughness
_Metalness metallic
_AmbientOcclusion occlusion
_Opacity opacity
_Emission emission
"""),
    ),
    "polyhaven": Convention(
        "Poly Haven",
        _list("""
_diff colour
_nor_gl normal
_nor_dx normal-dx
_disp height
_rough roughness
_metal metallic
_ao occlusion
_arm orm
_opacity opacity
_emission emission
"""),
    ),
    "gltf": Convention(
        "glTF",
        _list("""
_baseColor colour + opacity
_normal normal
_occlusionRoughnessMetallic orm
_metallicRoughness metallic-roughness
_occlusion occlusion
_emissive emission
"""),
    ),
    "unreal": Convention(
        "Unreal",
        _list("""
_D colour + opacity
_N normal-dx
_ORM orm
_R roughness
_M metallic
_AO occlusion
_H height
_E emission
"""),
        "T_",
    ),
    "unity": Convention("Unity built-in", _list(UNITY)),
    "urp": Convention("Unity URP", _list(UNITY)),
    "hdrp": Convention(
        "Unity HDRP",
        _list("""
_BaseMap colour + opacity
_MaskMap mask-map
_Normal normal
_Height height
_Emissive emission
"""),
    ),
    "labpbr": Convention(
        "labPBR",
        _list("""
. colour + opacity
_n labpbr-normal
_s labpbr-specular
"""),
    ),
    "substance": Convention(
        "Substance, metallic and roughness",
        _list("""
_Base_Color colour
_Normal_OpenGL normal
_Normal_DirectX normal-dx
_Height height
_Roughness roughness
_Metallic metallic
_Mixed_AO occlusion
_Opacity opacity
_Emissive emission
"""),
    ),
    "substance-unreal": Convention(
        "Substance, Unreal packed",
        _list("""
_BaseColor colour + opacity
_Normal normal-dx
_OcclusionRoughnessMetallic orm
_Height height
_Emissive emission
"""),
    ),
}
"""Conventions by the value of ``convention``."""
LETTERS = {file.end[1:].lower(): file.role for file in CONVENTIONS["unreal"].files} | {
    "bc": Role.COLOUR,
    "s": Role.OTHER,
}
MEANINGS = {
    "x": "normal x",
    "y": "normal y (up)",
    "-y": "normal y (down)",
    "z": "normal z",
    "": "not used",
    "reflectance": "reflectance at 0 degrees (230 to 255: metal)",
    "porosity": "porosity (65 to 255: scattering)",
    "emissiveness": "emission (255: none)",
}


def as_convention(value: object, name: str) -> str:
    """Return the convention with a given name.

    Raises
    ------
    InvalidInput
        The convention is unknown.

    """
    if not isinstance(value, str) or value not in CONVENTIONS:
        raise InvalidInput(f"{name}: must be one of {', '.join(CONVENTIONS)}, got {value!r}")
    return value


def list_conventions() -> str:
    """Return a Markdown table of all conventions."""
    lines = ["| `--convention` | For | File | Role | Channels |", "|---|---|---|---|---|"]
    for key, convention in CONVENTIONS.items():
        for number, file in enumerate(convention.files):
            first = f"`{key}` | {convention.title}" if number == 0 else " | "
            held = ", ".join(MEANINGS.get(word, word) for word in file.role.layout) or file.role.value
            more = "; alpha: opacity, if there is any" if file.opacity else ""
            lines.append(f"| {first} | `{convention.start}NAME{file.end}` | `{file.role.value}` | {held}{more} |")
    return "\n".join(lines)


def guess_roles(stems: Sequence[str]) -> tuple[dict[str, Role], dict[str, str]]:
    """Return the roles that the file names of a folder give, and the reason for each uncertain role.

    First, words at the end of a name give the role (see `guess_role`). Next, short endings give it if other names
    confirm them, as in Unreal (``T_Rock_N``) and labPBR (``stone``, ``stone_n``, ``stone_s``). Last, a name with which
    other names begin is the colour map (``rock`` next to ``rock_normal``).
    """
    found = {stem: each[0] for stem in stems if (each := find_role(stem)) is not None}
    why: dict[str, str] = {}
    bases = {stem: _cut(stem) for stem in stems}
    shared = Counter(base for base in bases.values() if base)
    # Single letters after the same base can be a numbering, as in shot_a, shot_b and shot_d, and then give no role.
    ends = {stem: words[-1][1] for stem in stems if (words := split_name(stem))}
    doubtful = {bases[s] for s, end in ends.items() if len(end) == 1 and end not in LETTERS and s not in found}
    for stem in stems:
        words, base = split_name(stem), bases[stem]
        letter = words[-1][1] if words else ""
        if stem in found or letter not in LETTERS or not base:
            continue
        if {base + stem[len(base)] + end for end in "ns"} <= set(stems) and base in stems:
            found[stem], why[stem] = (
                Role.LABPBR_NORMAL if letter == "n" else Role.LABPBR_SPECULAR if letter == "s" else LETTERS[letter],
                "a name of labPBR",
            )
        elif stem.startswith("T_"):
            found[stem], why[stem] = LETTERS[letter], "a name of Unreal"
        elif (shared[base] > 1 or base in stems) and base not in doubtful:
            role = LETTERS[letter]
            found[stem] = Role.NORMAL if role is Role.NORMAL_DX else role
            why[stem] = f"the folder has other maps of {base}"
    plain = [stem for stem in stems if stem not in found and shared[stem] and Role.COLOUR not in found.values()]
    for stem in plain[:1]:
        found[stem], why[stem] = Role.COLOUR, "the names of the other maps begin with its name"
    # A word in the middle of a name gives the role if no other file has this role. Example: rock_albedo_wet, but not
    # rock_color_chart next to rock_color.
    pairs = zip(min(stems, default=""), max(stems, default=""), strict=False)
    common = "".join(one for one, _ in takewhile(lambda pair: pair[0] == pair[1], pairs))
    common = common[: max(common.rfind(sign) for sign in "_-. ") + 1]
    for stem in stems:
        if stem in found or len(stems) < 2:
            continue
        rest = [word for _, word in split_name(stem[len(common) :])]
        for end in range(len(rest) - 1, 0, -1):
            said = find_role("_".join(rest[:end]))
            if said is not None and said[0] not in found.values():
                found[stem], why[stem] = said[0], f"the word {rest[end - 1]!r}"
                break
    return found, why


def report_guesses(why: Mapping[str, str], roles: Mapping[str, Role], said: Collection[str]) -> None:
    """Report the uncertain roles and the reasons for them, except roles that the caller states."""
    for name, reason in why.items():
        if name not in said:
            assume(f"{name}: read as {roles[name].value} ({reason})")


def cut_name(file: str) -> str:
    """Return a file name without the word for its map, so that it is the same for all files of a material."""
    found, words = find_role(file), split_name(file)
    if found is not None:
        return (file[: found[1]].rstrip("_-. ") + file[found[2] :]).lstrip("_-. ")
    return _cut(file) if words and words[-1][1] in LETTERS else file


def _cut(stem: str) -> str:
    """Return the part of a name before the word for its map, or ""."""
    found, words = find_role(stem), split_name(stem)
    place = found[1] if found else words[-1][0] if len(words) > 1 else 0
    return stem[:place].rstrip("_-. ")

"""Write a material as a MaterialX 1.38 document: a standard surface whose inputs are maps in files next to it.

Maps for which the standard surface has no input are omitted: occlusion, which renderers compute, and masks, labels and
directions.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path as FilePath
from xml.etree import ElementTree

import numpy as np

from texrs import io
from texrs._typing import Array, Path
from texrs.errors import FileError, InvalidInput
from texrs.io.files import as_path
from texrs.materials._map import Map
from texrs.materials._packing import make_plain
from texrs.materials._roles import Role, guess_role
from texrs.materials.converting import convert
from texrs.materials.files import choose_suffix, write_maps
from texrs.materials.lit_maps import find_map
from texrs.materials.surface import GREY, METAL, ROUGH, list_signed, measure_relief, measure_slopes, take_normals

__all__ = ["write_materialx"]

VERSION = "1.38"
INTEGERS = (np.dtype(np.uint8), np.dtype(np.uint16))
FLOATS = (np.dtype(np.float16), np.dtype(np.float32))
UPWARD = {"DirectX": "OpenGL", "directx": "opengl", "DX": "GL", "Dx": "Gl", "dx": "gl"}
"""Words in file names for y down, and their replacements for y up."""
SPACES = {"srgb": "srgb_texture", "linear": "lin_rec709"}
USED = (
    Role.COLOUR,
    Role.NORMAL,
    Role.NORMAL_DX,
    Role.HEIGHT,
    Role.ORM,
    Role.ROUGHNESS,
    Role.METALLIC,
    Role.EMISSION,
    Role.OPACITY,
)


def write_materialx(maps: Mapping[str, Map], path: Path, depth: int | None) -> list[FilePath]:
    """Write the document and the maps that it names, and return the paths of the files."""
    target = as_path(path)
    if target.suffix.lower() != ".mtlx":
        raise FileError(f"{path}: the suffix must be .mtlx, got {target.suffix!r}")
    maps = make_plain(maps)
    chosen = {role: name for role in USED for name, each in maps.items() if each is find_map(maps, role)}
    if Role.NORMAL in chosen:
        chosen.pop(Role.NORMAL_DX, None)
    if not chosen:
        raise InvalidInput(f"material: must have a map that describes a surface, such as albedo, got {', '.join(maps)}")
    names = {name: rename(name, maps[name].role) for name in chosen.values()}
    chosen = {role: names[name] for role, name in chosen.items()}
    stored = {f"{target.stem}_{new}": prepare(name, maps, depth) for name, new in names.items()}
    if Role.HEIGHT in chosen and (slopes := measure_slopes(maps, (True, True))) is not None:
        normals = take_normals(maps, {}, slopes, slopes.shape[:2])
        chosen[Role.NORMAL] = "normal"
        packed = Map((normals + 1) * np.float32(0.5), Role.NORMAL, "linear")
        stored[f"{target.stem}_normal"] = convert("normal", packed, depth or 16)
    files = {role: f"{target.stem}_{name}" for role, name in chosen.items()}
    document = compose(
        re.sub(r"\W", "_", target.stem, flags=re.ASCII),
        {role: name + choose_suffix(stored[name], None) for role, name in files.items()},
        {role: stored[name] for role, name in files.items()},
        measure_relief(maps),
    )
    ElementTree.indent(document)
    text = ElementTree.tostring(document, encoding="utf-8", xml_declaration=True)
    with io.atomic(target) as temporary:
        temporary.write_bytes(text + b"\n")
        written = write_maps(stored, target.parent)
    return [target, *written]


def rename(name: str, role: Role) -> str:
    """Return the file name of a map that is written with y up. Words for y down are replaced.

    Examples
    --------
    >>> rename("nor_dx", Role.NORMAL_DX), rename("NormalDX", Role.NORMAL_DX), rename("stone_n", Role.NORMAL_DX)
    ('nor_gl', 'NormalGL', 'stone_n_gl')

    """
    if not role.normal or (role is Role.NORMAL and guess_role(name) is not Role.NORMAL_DX):
        return name
    for down, up in UPWARD.items():
        if down in name:
            return up.join(name.rsplit(down, 1))
    return f"{name}_gl"


def prepare(name: str, maps: Mapping[str, Map], depth: int | None) -> Map:
    """Return a map as renderers expect it: colours with 3 or 4 channels, normals with y up, others with one channel."""
    each = maps[name]
    pixels = each.pixels if each.pixels.ndim > 2 else each.pixels[..., np.newaxis]
    if each.role.coloured:
        pixels = spread_grey(pixels)
    elif each.role.normal:
        if pixels.dtype in INTEGERS:
            pixels = turn_green(pixels) if each.role is Role.NORMAL_DX else pixels
        else:
            pixels = (take_normals({name: each}, list_signed(maps), None, pixels.shape[:2]) + 1) * np.float32(0.5)
        pixels = pixels[..., :3]
    elif each.role is Role.ORM:
        pixels = pixels[..., :3]
    else:
        pixels = pixels[..., 0]
    if depth is None and pixels.dtype not in (*INTEGERS, *FLOATS, np.dtype(np.bool_)):
        depth = 32 if pixels.dtype.kind == "f" else 16
    return convert(name, Map(pixels, Role.NORMAL if each.role.normal else each.role, each.space), depth)


def spread_grey(pixels: Array) -> Array:
    """Convert grey colours to three channels, or to four with alpha."""
    channels = pixels.shape[-1]
    if channels > 2:
        return pixels[..., :4]
    return np.concatenate([np.repeat(pixels[..., :1], 3, axis=-1), pixels[..., 1:]], axis=-1)


def turn_green(pixels: Array) -> Array:
    """Return normals with inverted y."""
    turned = pixels.copy()
    turned[..., 1] = np.iinfo(pixels.dtype).max - turned[..., 1]
    return turned


def compose(
    name: str, files: Mapping[Role, str], maps: Mapping[Role, Map], relief: float | None
) -> ElementTree.Element:
    """Return the XML document: a graph of images, the surface that uses them, and the material."""
    root = ElementTree.Element("materialx", version=VERSION, colorspace=SPACES["linear"])
    graph = ElementTree.SubElement(root, "nodegraph", name=f"NG_{name}")
    surface = ElementTree.Element("standard_surface", name=f"SR_{name}", type="surfaceshader")
    outputs: list[ElementTree.Element] = []

    def node(kind: str, title: str, type_: str, **inputs: tuple[str, str]) -> str:
        made = ElementTree.SubElement(graph, kind, name=title, type=type_)
        for key, (their, value) in inputs.items():
            by = "nodename" if their.startswith(">") else "value"
            ElementTree.SubElement(made, "input", {"name": key, "type": their.lstrip(">"), by: value})
        return title

    def image(role: Role, title: str, type_: str) -> str:
        made = node("image", title, type_, file=("filename", files[role]))
        if role.coloured:
            graph[-1][0].set("colorspace", SPACES[maps[role].space])
        return made

    def feed(key: str, type_: str, source: str | None, value: str = "") -> None:
        taken = ElementTree.SubElement(surface, "input", name=key, type=type_)
        if source is None:
            taken.set("value", value)
            return
        outputs.append(ElementTree.Element("output", name=f"{key}_out", type=type_, nodename=source))
        taken.attrib |= {"nodegraph": graph.attrib["name"], "output": f"{key}_out"}

    # The opacity is a map, or the alpha channel of the colours.
    opacity = image(Role.OPACITY, "opacity_image", "float") if Role.OPACITY in files else None
    feed("base", "float", None, "1.0")
    if Role.COLOUR not in files:
        feed("base_color", "color3", None, f"{GREY}, {GREY}, {GREY}")
    elif maps[Role.COLOUR].channels == 3:
        feed("base_color", "color3", image(Role.COLOUR, "colour_image", "color3"))
    else:
        both = image(Role.COLOUR, "colour_image", "color4")
        feed("base_color", "color3", node("convert", "colour", "color3", **{"in": (">color4", both)}))
        if opacity is None:
            index = ("integer", "3")
            opacity = node("extract", "opacity_channel", "float", **{"in": (">color4", both), "index": index})
    if opacity is not None:
        feed("opacity", "color3", node("convert", "opacity", "color3", **{"in": (">float", opacity)}))
    # Roughness and metallic are maps of their own, channels of a packed map, or constants.
    packed = image(Role.ORM, "orm_image", "vector3") if Role.ORM in files else None
    for role, key, channel, usual in (
        (Role.ROUGHNESS, "specular_roughness", 1, ROUGH),
        (Role.METALLIC, "metalness", 2, METAL),
    ):
        if role in files:
            feed(key, "float", image(role, f"{role.value}_image", "float"))
        elif packed is not None:
            index = ("integer", str(channel))
            feed(key, "float", node("extract", role.value, "float", **{"in": (">vector3", packed), "index": index}))
        else:
            feed(key, "float", None, str(usual))
    if Role.EMISSION in files:
        feed("emission", "float", None, "1.0")
        kind = "color3" if maps[Role.EMISSION].channels == 3 else "color4"
        light = image(Role.EMISSION, "emission_image", kind)
        if kind == "color4":
            light = node("convert", "emission", "color3", **{"in": (">color4", light)})
        feed("emission_color", "color3", light)
    # Normals already have y up here.
    normal = next((role for role in (Role.NORMAL, Role.NORMAL_DX) if role in files), None)
    if normal is not None:
        bent = image(normal, "normal_image", "vector3")
        feed("normal", "vector3", node("normalmap", "normal", "vector3", **{"in": (">vector3", bent)}))
    # The material refers to the surface, and to the displacement if there are heights.
    root.append(surface)
    material = ElementTree.Element("surfacematerial", name=name if name[:1].isalpha() else f"M_{name}", type="material")
    reference = {"name": "surfaceshader", "type": "surfaceshader", "nodename": f"SR_{name}"}
    ElementTree.SubElement(material, "input", reference)
    if Role.HEIGHT in files and relief is not None:
        rise = image(Role.HEIGHT, "height_image", "float")
        outputs.append(ElementTree.Element("output", name="displacement_out", type="float", nodename=rise))
        lift = ElementTree.SubElement(root, "displacement", name=f"DP_{name}", type="displacementshader")
        graphed = {"nodegraph": graph.attrib["name"], "output": "displacement_out"}
        ElementTree.SubElement(lift, "input", {"name": "displacement", "type": "float", **graphed})
        ElementTree.SubElement(lift, "input", {"name": "scale", "type": "float", "value": f"{relief:.6g}"})
        reference = {"name": "displacementshader", "type": "displacementshader", "nodename": f"DP_{name}"}
        ElementTree.SubElement(material, "input", reference)
    root.append(material)
    # MaterialX requires the outputs at the end of a graph, and does not allow empty graphs.
    graph.extend(outputs)
    if not len(graph):
        root.remove(graph)
    return root

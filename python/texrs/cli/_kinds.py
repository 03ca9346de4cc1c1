"""Kinds of values: how each is written on the command line, and read. All that the signatures of the functions do not say."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from texrs import io, samples
from texrs._arrays import as_image, as_size
from texrs._typing import Array, Floats
from texrs.cli._outputs import SAMPLE, name_arguments
from texrs.errors import FileError, InvalidInput

FOUND = "found"
"""Stands for what is not said of a plane."""
PLANE = "plane:"
"""Before the words that say how a plane lies."""
PLACE = r"\s*-?[0-9]+(\.[0-9]*)?\s*,\s*-?[0-9]+(\.[0-9]*)?\s*"
"""A row and a column, as text."""


@dataclass(frozen=True, slots=True)
class About:
    """What the text of an option may be understood by."""

    option: str = ""
    """What errors call it."""
    axes: int = 2
    size: tuple[int, ...] = ()
    """Of the result, once it is known."""
    like: Array | None = None
    """The exemplar, once it is read."""
    roles: Mapping[str, str] = field(default_factory=dict)
    """What maps of materials are for."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of value."""

    metavar: str | tuple[str, str]
    """The form of the text; of pictures and of volumes where they differ."""
    read: Callable[[Any, About], Any]
    """Make the value of the text, or of the list of texts."""
    note: str | tuple[str, str] = ""
    """What the form does not say."""
    show: Callable[[Any], str] = str
    """Make the text of a default."""
    file: bool = False
    """Whether the text names a file, which is read when it is known that the result can be written."""
    words: tuple[str, ...] = ()
    """Texts that name no file, and are given to the function as they are."""
    many: bool = False
    """Whether there may be any number of texts."""
    plain: bool = False
    """Whether it is written in this way even where typer could read the type."""

    @staticmethod
    def pick(text: str | tuple[str, str], axes: int) -> str:
        """Return what is said of pictures, or of volumes."""
        return text if isinstance(text, str) else text[axes - 2]


# --- values that are written -----------------------------------------------------------------------------------------


def parse_size(text: str, option: str = "--size", *, axes: int = 2) -> tuple[int, ...]:
    """Return (rows, columns) of ``1024x512``, which is the width and the height, or of ``512`` a square.

    With three axes the depth comes last in the text, and the planes first in what is returned.
    """
    parts = re.split(r"[x×]", text.strip().lower())
    if len(parts) not in (1, axes) or not all(re.fullmatch(r"\s*-?[0-9]{1,18}\s*", p) for p in parts):
        wanted = ("WIDTHxHEIGHT, as in 1024x512", "WIDTHxHEIGHTxDEPTH, as in 128x96x64")[axes - 2]
        raise InvalidInput(f"{option}: needs {wanted}, or one number; got {text!r}")
    sides = [int(p) for p in reversed(parts)]
    return as_size(sides if len(sides) > 1 else sides[0], option, axes=axes)


def parse_axes(text: str, option: str = "--wrap", *, axes: int = 2) -> tuple[bool, ...]:
    """Return whether each axis is among the letters: x for columns, y for rows, z for planes."""
    known = "zyx"[-axes:]
    letters = text.strip().lower()
    if letters != "none" and (not letters or set(letters) - set(known) or len(set(letters)) < len(letters)):
        wanted = "allowed are xy, x, y and none" if axes == 2 else "needs axes among x, y and z, each once, or none"
        raise InvalidInput(f"{option}: {wanted}; got {text!r}")
    return tuple(letters != "none" and letter in letters for letter in known)


def show_axes(wrap: bool | Sequence[bool]) -> str:
    """Return the letters of the axes."""
    if isinstance(wrap, bool):
        return "all" if wrap else "none"
    return "".join(letter for letter, cyclic in zip("xyz", reversed(wrap), strict=False) if cyclic) or "none"


def parse_numbers(
    text: str, option: str, wanted: str, *, counts: Sequence[int] = (), between: str = ":"
) -> list[float]:
    """Return finite numbers with a sign between them."""
    try:
        numbers = [float(p) for p in text.split(between)]
    except ValueError:
        numbers = []
    if not numbers or (counts and len(numbers) not in counts):
        raise InvalidInput(f"{option}: needs {wanted}; got {text!r}")
    return numbers


def parse_range(text: str, about: About) -> tuple[float, float]:
    """Return the least and the largest of ``0.8:1.2``; of ``1``, it for both."""
    numbers = parse_numbers(text, about.option, "LEAST:LARGEST, as in 0.8:1.2", counts=(1, 2))
    return numbers[0], numbers[-1]


def parse_sizes(text: str, about: About) -> str | bool | list[float]:
    """Return auto, or the answer of yes or no, or numbers."""
    word = text.strip().lower()
    if word in ("auto", "yes", "no"):
        return "auto" if word == "auto" else word == "yes"
    return parse_numbers(word, about.option, "auto, yes, no, or sizes as in 0.8:1.25")


def parse_bytes(text: str, option: str = "--memory-limit") -> int:
    """Return ``900M`` or ``16G`` as a number of bytes, in powers of 1024."""
    found = re.fullmatch(r"([0-9]{1,18})([kmgt]?)(i?b)?", text.strip().lower())
    if not found or int(found[1]) == 0:
        raise InvalidInput(f"{option}: needs a number of bytes, as in 900M or 16G; got {text!r}")
    return int(found[1]) << 10 * " kmgt".index(found[2] or " ")


def parse_box(text: str, about: About) -> list[float]:
    """Return the middle and the sides of a box."""
    return _parse_finite(text, 4, about.option, "ROW,COL,HEIGHT,WIDTH, as in 96,92,50,50")


def parse_each(texts: Sequence[str], about: About) -> list[float | None]:
    """Return a number for each plane, or None for one that is to be found."""
    found: list[float | None] = []
    for text in texts:
        word = text.strip().lower()
        found.append(
            None if word == FOUND else parse_numbers(word, about.option, f"a number, or {FOUND}", counts=(1,))[0]
        )
    return found


def parse_places(texts: Sequence[str], about: About) -> list[list[float]]:
    """Return the points of one text or of several."""
    parts = [p for text in texts for p in re.split(r"[\s;]+", text.strip()) if p]
    return [_parse_finite(p, 2, about.option, "ROW,COL, as in 125,60") for p in parts]


def _parse_finite(text: str, count: int, option: str, wanted: str) -> list[float]:
    numbers = parse_numbers(text, option, wanted, counts=(count,), between=",")
    if not all(math.isfinite(n) for n in numbers):
        raise InvalidInput(f"{option}: needs {wanted}; got {text!r}")
    return numbers


def read_steps(text: str, about: About) -> Any:
    """Return an edit: names with commas between them, JSON, or a file of JSON."""
    if not text.lower().endswith(".json") and not text.lstrip().startswith(("[", "{")):
        return [word.strip() for word in text.split(",")]
    found = read_json(text, about.option)
    # A report holds its edit beside other things.
    return found["edit"] if isinstance(found, dict) and "edit" in found else found


def read_json(text: str, option: str) -> Any:
    """Return what JSON says, or a file of it."""
    where = option
    if text.lower().endswith(".json"):
        where = text
        try:
            text = Path(text).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise FileError(f"{where}: {error}") from None
    try:
        return json.loads(text)
    except (json.JSONDecodeError, RecursionError) as error:
        raise InvalidInput(f"{where}: is not JSON ({error})") from None


def read_corrections(text: str, about: About) -> Any:
    """Return a list of corrections: JSON, or a file of it."""
    if not (text.lower().endswith(".json") or text.lstrip().startswith("[")):
        raise InvalidInput(f"{about.option}: needs a file of JSON, or a list of steps as JSON; got {text!r}")
    return read_steps(text, about)


# --- values that stand in files --------------------------------------------------------------------------------------


def read_picture(text: str, *, finite: bool = True) -> Array:
    """Read an image file, or make the built-in exemplar that ``sample:NAME`` names."""
    image: Array = samples.load(text.removeprefix(SAMPLE)).image if text.startswith(SAMPLE) else io.read(text)
    if finite:
        as_image(image, text)
    return image


def match_alpha(image: Any, like: Array | None) -> Any:
    """Return a picture with an alpha channel, all of it there, if that is all that it lacks; without one that says nothing."""
    if not isinstance(image, np.ndarray):
        return image
    colours = [1 if a.ndim == 2 else a.shape[2] for a in (image, image if like is None else like)]
    whole = 1 if image.dtype.kind == "f" else np.iinfo(image.dtype).max if image.dtype.kind in "ui" else True
    if colours in ([3, 4], [1, 2]):
        pixels = image[..., np.newaxis] if image.ndim == 2 else image
        return np.concatenate([pixels, np.full_like(pixels[..., :1], whole)], axis=2)
    if colours in ([4, 3], [2, 1]) and (image[..., -1] == whole).all():
        return np.ascontiguousarray(image[..., :-1] if colours[1] > 1 else image[..., 0])
    return image


def read_example(text: str, about: About, *, finite: bool = True) -> Any:
    """Read a picture, or a material: a folder of maps, or an EXR file of several layers."""
    from texrs.cli._stacks import is_stack

    if text.startswith(SAMPLE) or not is_stack(text):
        return read_picture(text, finite=finite)
    from texrs.materials import Material

    with name_arguments(roles="--role", maps=text):
        return Material.read(text, roles=about.roles)


def read_volume(text: str) -> Array:
    """Read a volume, or make the built-in one that ``sample:NAME`` names; all of it must be finite."""
    if text.startswith(SAMPLE):
        volume: Array = samples.load(text.removeprefix(SAMPLE)).image
        if volume.ndim != 4:
            known = ", ".join(n for n in samples.names() if n.endswith("solid") or n in ("particles", "stripes"))
            raise InvalidInput(f"{text}: is a picture; volumes are {known}")
    else:
        volume = io.read_volume(text)
    as_image(volume, text, axes=3)
    return volume


def read_array(path: str, axes: int) -> Array:
    """Read a picture or a volume, which may hold anything."""
    array: Array = io.read_volume(path) if axes == 3 else io.read(path)
    return array


def read_values(path: str, about: About) -> Array:
    """Read values like those of the exemplar: of one channel a file may keep the axis or not."""
    given = read_array(path, about.axes)
    return given[..., np.newaxis] if about.like is not None and given.ndim < about.like.ndim else given


def read_numbers(path: str, about: About) -> Array:
    """Read a number for each point: of several channels the mean."""
    given = read_array(path, about.axes)
    return given if given.ndim == about.axes else np.asarray(given.mean(axis=-1))


def read_density(text: str, about: About) -> Any:
    """Return numbers, or shares that a picture shows: all of an integer's range is 0 to 1."""
    if re.fullmatch(r"[-+.:0-9eE]+", text.strip()):
        return parse_numbers(text, about.option, "numbers such as 0.3 or 0.3:0.1, or a file")
    given = np.asarray(read_array(text, about.axes))
    most = 1.0 if given.dtype.kind == "f" else float(np.iinfo(given.dtype).max)
    return np.asarray((given if given.ndim == about.axes else given.mean(axis=-1)) / most, np.float64)


def read_mask(path: str, axes: int = 2) -> Array:
    """Read a mask: any colour but black, or 0 in all channels, is marked, whatever an alpha channel of a picture says."""
    mask = read_array(path, axes)
    if mask.ndim == axes:
        return mask
    colours = mask[..., :-1] if axes == 2 and mask.shape[-1] in (2, 4) else mask
    marked: Array = (colours != 0).any(axis=-1)
    return marked


def read_scale_map(path: str, encoding: str = "log2") -> Floats:
    """Read a scale map, with its kind where the file says it: floats are scales, grey levels are decoded."""
    from texrs import scale_maps
    from texrs.scale_maps._kinds import keep_kind, parse_kind

    values, kind = io.read(path), parse_kind(io.read_description(path))
    if values.dtype.kind == "f":
        scale = np.asarray(values if values.ndim == 2 else values[..., 0], np.float32)
    else:
        levels: Any = encoding
        with name_arguments(image=path):
            scale = scale_maps.decode(values, levels)
    with name_arguments(scale=path):
        return keep_kind(scale, kind)


def read_target(text: str) -> Any:
    """Read what an output is to show: a scale map, normals, texture coordinates, or Jacobians; of a plane the words stay."""
    if text.lower().startswith(PLANE):
        return text
    try:
        values = io.read(text)
    except FileError:
        if Path(text).suffix.lower() not in (".npy", ".npz"):
            raise
        # Jacobians have four axes.
        return io.read_volume(text)
    if values.ndim == 3 and values.shape[2] == 2:
        return values
    colours = values.ndim == 3 and values.shape[2] >= 3 and bool((values[..., :3] != values[..., :1]).any())
    return values[..., :3] if colours else read_scale_map(text)


def read_field(text: str, size: tuple[int, ...]) -> Any:
    """Return the field that words describe, or that of the frames in an .npz file, over an output of a size."""
    from texrs import fields

    if Path(text).suffix.lower() != ".npz":
        with name_arguments(field="--field"):
            return fields.parse(text, len(size), size)
    arrays = list(io.read_arrays(text).values())
    if len(arrays) != 1:
        raise FileError(f"{text}: needs a single array of frames, has {len(arrays)}")
    with name_arguments(frames=text):
        field = fields.from_array(arrays[0], size if arrays[0].ndim == len(size) + 2 else None)
    if field.axes != len(size):
        raise InvalidInput(f"{text}: holds frames of {field.axes} axes, {len(size)} are needed")
    return field


def read_direction(text: str, about: About) -> Any:
    """Read degrees, one number or a picture of them, or a field: its words, or frames in a file."""
    try:
        return float(text)
    except ValueError:
        pass
    suffix = Path(text).suffix.lower()
    return io.read(text) if suffix and suffix != ".npz" and "=" not in text else read_field(text, about.size)


def read_entry(text: str, about: About) -> Any:
    """Read analysed elements, or a picture, which is analysed by whoever takes it."""
    from texrs import elements

    return elements.load(text) if text.lower().endswith(".npz") else read_example(text, about)


def read_layout(text: str, about: About) -> Any:
    """Read analysed elements or a picture, as `read_entry` does, or make a layout of JSON; its labels may be a picture."""
    if not text.lower().endswith(".json") and not text.lstrip().startswith("{"):
        return read_entry(text, about)
    from texrs import layouts

    said = read_json(text, about.option)
    if isinstance(said, dict) and isinstance(said.get("labels"), str):
        said = {**said, "labels": io.read(said["labels"])}
    return layouts.make(said)


def read_labels(path: str, about: About) -> Array:
    """Read the labels of elements: a picture of them, or those of an entry."""
    from texrs import elements

    return elements.load(path).labels if path.lower().endswith(".npz") else io.read(path)


def read_points(path: str, about: About) -> list[list[float]]:
    """Read a list of points, row,column a line; a first line of words and empty lines are passed over."""
    try:
        lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "is no text"
        raise FileError(f"{path}: cannot be read ({reason})") from None
    found: list[list[float]] = []
    for number, line in enumerate(lines, start=1):
        parts = [p.strip() for p in re.split(r"[,;\t]", line.strip())]
        if parts == [""]:
            continue
        try:
            values = [float(p) for p in parts]
        except ValueError:
            if number == 1:
                continue
            values = []
        if len(values) != 2:
            raise InvalidInput(f"{path}: line {number} needs row,column, got {line.strip()[:60]!r}")
        found.append(values)
    if not found:
        raise InvalidInput(f"{path}: holds no points")
    return found


# --- the kinds -------------------------------------------------------------------------------------------------------

PICTURE = Kind("FILE", lambda text, about: read_picture(text), "A file, or sample:NAME.", file=True)
EXAMPLE = Kind("FILE|FOLDER", read_example, "A file, a folder of the maps of a material, or sample:NAME.", file=True)
SOURCE = replace(EXAMPLE, read=lambda text, about: match_alpha(read_example(text, about), about.like))
"""A picture of the same things as the first, which may have an alpha channel that this one lacks."""
UNKNOWN = replace(EXAMPLE, read=lambda text, about: read_example(text, about, finite=False))
"""A picture in which some is not known, and may be anything."""
VOLUME = replace(PICTURE, read=lambda text, about: read_volume(text))
ENTRY = Kind(
    "FILE|FOLDER",
    read_entry,
    "An image file, a folder of the maps of a material, sample:NAME, or an entry that texrs analyse wrote (.npz).",
    file=True,
)
LAYOUT = Kind(
    "FILE|JSON",
    read_layout,
    "As the first, or a layout: JSON, or a file of it (.json), as texrs.layouts.make takes it.",
    file=True,
)
ENTRIES = replace(
    ENTRY,
    read=lambda texts, about: [read_entry(text, about) for text in texts],
    note="Files, folders of the maps of a material, sample:NAME, or entries that texrs analyse wrote (.npz).",
    many=True,
)
MASK = Kind("FILE", lambda path, about: read_mask(path, about.axes), "What is not black is marked.", file=True)
GROUNDS = replace(
    MASK,
    metavar=f"FILE|{FOUND}",
    words=(FOUND,),
    read=lambda texts, about: [None if text == FOUND else read_mask(text, about.axes) for text in texts],
    note=f"What is not black is marked; the option may be repeated, for several planes, one of which may be {FOUND}.",
    many=True,
)
CORNERS = Kind(
    "ROW,COL ...",
    lambda texts, about: [None if text == FOUND else parse_places([text], about) for text in texts],
    f"Four, with spaces between them; of several planes in the order of their grounds, or {FOUND}.",
    many=True,
)
EACH = Kind("NUMBER", parse_each, f"Of several planes in the order of their grounds, or {FOUND}.", many=True)
"""Of each plane of a photograph."""
HOLE = replace(MASK, words=("alpha",))
MAP = Kind("FILE", lambda path, about: read_scale_map(path), "A file that texrs scale-map wrote.", file=True)
SEEN = Kind(
    "FILE|auto",
    lambda text, about: text if text.startswith(PLANE) else read_scale_map(text),
    "A file that texrs scale-map wrote; or front; or plane:slant=50,tilt=90.",
    file=True,
    words=("auto", "front"),
)
TARGET = Kind(
    "FILE|plane:...",
    lambda text, about: read_target(text),
    "A file that texrs scale-map wrote, a normal map, or coordinates or Jacobians (.npy).",
    file=True,
)
DIRECTION = Kind(
    "DEGREES|WORDS|FILE",
    read_direction,
    "Or a file of degrees (.npy, .tif), or a field: words such as circular, or frames (.npz).",
    file=True,
)
MAP_OR_AUTO = replace(MAP, metavar="FILE|auto", words=("auto",))
NUMBERS = Kind("FILE", read_numbers, "Of several channels the mean counts.", file=True)
AXES = Kind(
    ("xy|x|y|none", "xyz|...|none"),
    lambda text, about: parse_axes(text, about.option, axes=about.axes),
    (
        "x is from left to right, y from top to bottom.",
        "x is from left to right, y from top to bottom, z from plane to plane.",
    ),
    show_axes,
)
SIZE = Kind(
    ("WIDTHxHEIGHT", "WIDTHxHEIGHTxDEPTH"),
    lambda text, about: parse_size(text, about.option, axes=about.axes),
    show=str,
)
SHARES = Kind("A:B:...", lambda text, about: parse_numbers(text, about.option, "numbers such as 2:1:1"))

KINDS = {
    "size": SIZE,
    "to": SIZE,
    "overlap": SIZE,
    "wrap": AXES,
    "repeat": AXES,
    "weights": SHARES,
    "density": Kind("A:B:...|FILE", read_density, "Or a picture, white where all is to be covered.", file=True),
    "scales": replace(SHARES, show=lambda numbers: ":".join(f"{n:g}" for n in numbers)),
    "scale": Kind("LEAST:LARGEST", parse_range, show=lambda numbers: ":".join(f"{n:g}" for n in numbers)),
    "augment_scales": Kind("auto|yes|no|A:B:...", parse_sizes),
    "memory_limit": Kind(
        "BYTES", lambda text, about: parse_bytes(text, about.option), "As in 900M or 16G.", plain=True
    ),
    "field": Kind(
        "WORDS|FILE.npz",
        lambda text, about: read_field(text, about.size),
        "As in circular:axis=z or zigzag:period=64,angle=30, or frames in a file.",
        file=True,
    ),
    "scale_map": MAP,
    "target": MAP,
    "mask": MASK,
    "within": MASK,
    "ground": MASK,
    "allowed": MASK,
    "corners": Kind(
        "ROW,COL ...", lambda text, about: parse_places([text], about), "Four, with spaces between them.", plain=True
    ),
    "labels": Kind("FILE", read_labels, "Or an entry that texrs analyse wrote (.npz).", file=True),
    "values": Kind("FILE", read_values, file=True),
    "coordinates": Kind("FILE", lambda path, about: np.asarray(read_array(path, about.axes)), file=True),
    "background": Kind("ROW,COL", parse_places, "The option may be repeated.", many=True),
    "box": Kind("ROW,COL,HEIGHT,WIDTH", parse_box),
    "points": Kind("POINTS.csv", read_points, "A file of row,column a line.", file=True),
    "corrections": Kind("JSON|FILE.json", read_corrections, "As the page of texrs analyse --page lists them."),
    "edit": Kind("WORDS|JSON|FILE.json", read_steps, "Names, JSON, or a file of it: a report is done again."),
    "steps": Kind("WORDS|JSON|FILE.json", read_steps, "Names, JSON, or a file of it: a report is done again."),
}
"""Of parameters whose type does not tell, by name: a name means the same everywhere."""

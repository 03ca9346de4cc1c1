"""Define kinds of values: the form of their text on the command line, and the conversion to Python values.

All other properties of options are taken from the signatures of the functions.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from texrs.cli._places import parse_box, parse_corners, parse_places, read_points
from texrs.cli._readers import (
    fit_volume,
    match_alpha,
    name_file,
    read_array,
    read_density,
    read_direction,
    read_entry,
    read_example,
    read_field,
    read_hole,
    read_labels,
    read_layout,
    read_mask,
    read_numbers,
    read_picture,
    read_scale_map,
    read_target,
    read_values,
    read_volume,
)
from texrs.cli._texts import (
    FOUND,
    PLANE,
    About,
    parse_axes,
    parse_bytes,
    parse_each,
    parse_numbers,
    parse_range,
    parse_size,
    parse_sizes,
    parse_spacing,
    read_corrections,
    read_steps,
    show_axes,
)


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of value on the command line."""

    metavar: str | tuple[str, str]
    """Form of the text in the help. Images and volumes can have different forms."""
    read: Callable[[Any, About], Any]
    """Function that converts the text, or the list of texts, to the value."""
    note: str | tuple[str, str] = ""
    """Additional description for the help. Images and volumes can have different descriptions."""
    show: Callable[[Any], str] = str
    """Function that converts a default value to its text."""
    file: bool = False
    """If True, the text names a file. It is read after checking that the result can be written."""
    words: tuple[str, ...] = ()
    """Texts that do not name a file. They are passed to the function unchanged."""
    many: bool = False
    """If True, the option accepts several texts."""
    plain: bool = False
    """If True, this kind is used even for types that typer can convert."""

    @staticmethod
    def pick(text: str | tuple[str, str], axes: int) -> str:
        """Return the text for the number of axes: for images (2) or volumes (3)."""
        return text if isinstance(text, str) else text[axes - 2]


PICTURE = Kind("FILE", lambda text, about: read_picture(text), "A file, or sample:NAME.", file=True)
EXAMPLE = Kind("FILE|FOLDER", read_example, "A file, a folder of the maps of a material, or sample:NAME.", file=True)
SOURCE = replace(EXAMPLE, read=lambda text, about: match_alpha(read_example(text, about), about.like))
"""Kind of an image that is aligned with the first image of the command.

If the first image has an alpha channel, this image gets an opaque one. If the first image has none, an opaque alpha
channel of this image is removed.
"""
UNKNOWN = replace(EXAMPLE, read=lambda text, about: read_example(text, about, finite=False))
"""Kind of an image whose unknown pixels can have any values, such as NaN."""
VOLUME = replace(PICTURE, read=lambda text, about: read_volume(text))
UNKNOWN_VOLUME = replace(VOLUME, read=lambda text, about: read_volume(text, finite=False))
"""Kind of a volume whose unknown voxels can have any values, such as NaN."""
ENTRY = Kind(
    "FILE|FOLDER",
    read_entry,
    "An image file, a folder of the maps of a material, sample:NAME, or an entry that texrs analyse wrote (.npz).",
    file=True,
)
LAYOUT = Kind(
    "FILE|JSON",
    read_layout,
    "The same kinds of files as ELEMENTS, or a layout as JSON or in a .json file.",
    file=True,
)
ENTRIES = replace(
    ENTRY,
    read=lambda texts, about: [read_entry(text, about, single=len(texts) == 1) for text in texts],
    note="Files, folders of the maps of a material, sample:NAME, or entries that texrs analyse wrote (.npz).",
    many=True,
)
WHITE = "White pixels are marked, or opaque pixels if the mask has transparency."
WORDS = (
    f"{WHITE} FILE:invert marks the other pixels. "
    "FILE:threshold=0.2,grow=4 acts like --threshold 0.2 --grow 4 of texrs remove."
)
"""Description of masks in the help."""
MASK = Kind("FILE", lambda path, about: fit_volume(read_mask(path, about.axes), path, about), WORDS, file=True)
GROUNDS = replace(
    MASK,
    metavar=f"FILE|{FOUND}",
    words=(FOUND,),
    read=lambda texts, about: [None if text == FOUND else read_mask(text, about.axes) for text in texts],
    note=f"{WORDS} For several planes, repeat the option. Give '{FOUND}' for each plane whose pixels texrs must find.",
    many=True,
)
QUOTED = "Four points in quotes, such as '20,20 104,24 110,100 14,112'."
CORNERS = Kind(
    "X,Y ...",
    lambda texts, about: [None if text == FOUND else parse_corners(text, about) for text in texts],
    f"{QUOTED} For several planes, repeat the option in the order of --ground. "
    f"Give '{FOUND}' for each plane that texrs must find.",
    many=True,
)
EACH = Kind(
    "NUMBER",
    parse_each,
    "For several planes, repeat the option in the order of --ground. "
    f"Give '{FOUND}' for each value that texrs must find.",
    many=True,
)
"""Kind of a parameter with one value for each plane of a photograph."""
OBJECT = Kind("FILE", lambda path, about: name_file(path), WHITE, file=True)
"""Kind of a mask that the function itself reads, according to other options."""
FILLED = Kind(
    "FILE|alpha|nan|nodata|VALUE",
    read_hole,
    f"{WHITE} alpha: pixels that are not fully opaque. nan: NaN or infinite pixels. "
    "nodata: pixels of the value that the file states. VALUE: pixels of this value.",
    file=True,
    words=("alpha", "nan", "nodata"),
)
MAP = Kind("FILE", lambda path, about: read_scale_map(path), "A file that texrs scale-map wrote.", file=True)
SEEN = Kind(
    "FILE|auto",
    lambda text, about: text if text.startswith(PLANE) else read_scale_map(text),
    "A file that texrs scale-map wrote, auto, front (no perspective), or plane:slant=50,tilt=90.",
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
    "A file of degrees (.npy, .tif), or a field: a name such as circular, or frames (.npz).",
    file=True,
)
MAP_OR_AUTO = replace(
    MAP, metavar="FILE|auto", note="A file that texrs scale-map wrote, or auto to measure the sizes.", words=("auto",)
)
NUMBERS = Kind("FILE", read_numbers, "The mean of several channels is used.", file=True)
AXES = Kind(
    ("default|xy|x|y|none", "default|xyz|...|none"),
    lambda text, about: parse_axes(text, about.option, axes=about.axes),
    (
        "x is from left to right, y from top to bottom.",
        "x is from left to right, y from top to bottom, z from plane to plane.",
    ),
    show_axes,
    words=("default",),
)
SIZE = Kind(
    ("WIDTHxHEIGHT", "WIDTHxHEIGHTxDEPTH"),
    lambda text, about: parse_size(text, about.option, axes=about.axes),
    show=str,
)
SHARES = Kind("A:B:...", lambda text, about: parse_numbers(text, about.option, "numbers such as 2:1:1"))

STEPS = "Give names of steps, JSON, or a JSON file. The report.json of an earlier run applies its steps again."

KINDS = {
    "size": SIZE,
    "to": SIZE,
    "overlap": SIZE,
    "wrap": AXES,
    "repeat": AXES,
    "weights": SHARES,
    "density": Kind(
        "A:B:...|FILE", read_density, "A map is an image whose white pixels are covered completely.", file=True
    ),
    "scales": replace(SHARES, show=lambda numbers: ":".join(f"{n:g}" for n in numbers)),
    "scale": Kind("LEAST:LARGEST", parse_range, show=lambda numbers: ":".join(f"{n:g}" for n in numbers)),
    "augment_scales": Kind("auto|yes|no|A:B:...", parse_sizes),
    "memory_limit": Kind(
        "BYTES", lambda text, about: parse_bytes(text, about.option), "For example 900M or 16G.", plain=True
    ),
    "field": Kind(
        "WORDS|FILE",
        read_field,
        "Give a text, such as circular:axis=z,centre=16x24x0 (x first) or zigzag:period=64, or a file of frames or directions.",
        file=True,
    ),
    "spacing": Kind(
        ("WIDTHxHEIGHT", "WIDTHxHEIGHTxDEPTH"),
        parse_spacing,
        ("For example 0.7x1.6.", "For example 0.7x0.7x1.6."),
    ),
    "scale_map": MAP,
    "target": MAP,
    "mask": MASK,
    "within": MASK,
    "ground": MASK,
    "allowed": MASK,
    "corners": Kind("X,Y ...", parse_corners, QUOTED, plain=True),
    "labels": Kind("FILE", read_labels, "A label image, or an entry that texrs analyse wrote (.npz).", file=True),
    "values": Kind("FILE", read_values, file=True),
    "coordinates": Kind("FILE", lambda path, about: np.asarray(read_array(path, about.axes)), file=True),
    "background": Kind("X,Y", parse_places, "The option may be repeated.", many=True),
    "box": Kind("X,Y,WIDTH,HEIGHT", parse_box, "X and Y are counted from the upper left corner of the image."),
    "points": Kind(
        "POINTS.csv", read_points, "Each line is x,y. A first line row,column states the other order.", file=True
    ),
    "corrections": Kind(
        "JSON|FILE.json",
        read_corrections,
        "Make them by clicking on the page that texrs analyse --page writes, which lists them as JSON.",
    ),
    "edit": Kind("WORDS|JSON|FILE.json", read_steps, STEPS),
    "steps": Kind("WORDS|JSON|FILE.json", read_steps, STEPS),
}
"""Kinds of parameters by name, for parameters whose type does not determine the kind.

A name has the same kind in all commands.
"""

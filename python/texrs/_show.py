"""Display results: as one line in the console, and as an image in a notebook."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

import numpy as np

from texrs._arrays import to_unit
from texrs._typing import Array

LONG = 60
"""Maximum number of characters of a value that is written in full."""
FEW = 8
"""Maximum number of list entries that are written."""


def brief(thing: Any) -> str:
    """Describe a dataclass in one line, with the dtype and size of arrays and without default values.

    Use it as ``__repr__ = brief`` in the class.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass
    ... class Found:
    ...     mask: np.ndarray
    ...     share: float
    ...     points: np.ndarray | None = None
    ...     __repr__ = brief
    >>> Found(np.zeros((3, 4), bool), 0.25)
    Found(mask=bool of 3 x 4, share=0.25)

    """
    parts = []
    for each in fields(thing):
        value = getattr(thing, each.name)
        default = each.default if each.default_factory is MISSING else each.default_factory()
        if each.repr and not (value is default or (np.isscalar(value) and value == default)):
            parts.append(f"{each.name}={spell(value)}")
    return f"{type(thing).__name__}({', '.join(parts)})"


def spell(value: object) -> str:
    """Describe a value in a few words."""
    if isinstance(value, np.ndarray):
        return f"{value.dtype} of {' x '.join(map(str, value.shape))}" if value.ndim else repr(value.item())
    if isinstance(value, Mapping):
        text = f"{{{', '.join(map(str, value))}}}"
    elif isinstance(value, list | tuple) and any(isinstance(each, np.ndarray) for each in value):
        text = f"[{', '.join(map(spell, value))}]"
    else:
        text = " ".join(repr(value).split())
    if len(text) <= LONG:
        return text
    return f"{len(value)} entries" if isinstance(value, Mapping | list | tuple) else f"{text[: LONG - 3]}..."


def spell_list(several: Sequence[object]) -> str:
    """Describe a list in one line: its first entries and its length."""
    shown = ", ".join(map(repr, several[:FEW]))
    return f"[{shown}, ... {len(several)} in all]" if len(several) > FEW else f"[{shown}]"


def measure(image: Array, axes: int) -> str:
    """Describe the size, channels and dtype of an image or a volume."""
    count = image.shape[axes] if image.ndim > axes else 1
    sides = " x ".join(map(str, image.shape[:axes]))
    return f"{sides}, {count} channel{'s' * (count > 1)} of {image.dtype}"


def preview(image: Array) -> Array:
    """Convert an image to 8-bit grey, RGB or RGBA for display."""
    if image.dtype == np.bool_:
        return image.astype(np.uint8) * np.uint8(255)
    seen = image if image.ndim == 2 or image.shape[-1] in (3, 4) else image[..., 0]
    if seen.dtype == np.uint8:
        return seen
    return np.rint(to_unit(seen) * 255).astype(np.uint8)


def as_png(image: Array) -> bytes:
    """Return an image as the bytes of a PNG file."""
    from texrs.io.image_io import encode

    return encode("image", np.ascontiguousarray(preview(image)), "png")


def fill_page(name: str, **values: object) -> str:
    """Return a file of the folder ``pages`` with the given values in place of each ``@name@``."""
    text = Path(__file__).with_name("pages").joinpath(name).read_text(encoding="utf-8")
    return re.sub(r"@(\w+)@", lambda found: str(values[found[1]]), text)

"""Entries as files: arrays alone, a version, and the hash of the image."""

from __future__ import annotations

import hashlib
import json
from typing import Any, get_args

import numpy as np

from texrs._arrays import as_image
from texrs._engine.coherence import Similarity
from texrs._typing import Array, Path
from texrs.elements._elements import Elements, Tag
from texrs.errors import FileError, InvalidInput
from texrs.io import atomic, read_arrays

__all__ = ["FORMAT", "digest", "load", "save"]

FORMAT = 1
"""Of the file, and of what the analysis gives: an entry of another one is made anew."""
MARK = "texrs_elements"


def digest(image: Array) -> str:
    """Return a hash of an image: its shape, dtype and values."""
    pixels = as_image(image)
    made = hashlib.blake2b(digest_size=16, person=b"texrs.elements")
    made.update(repr((pixels.shape, pixels.dtype.str)).encode())
    made.update(pixels.data)
    return made.hexdigest()


def save(entry: Elements, path: Path) -> None:
    """Write an entry to an ``.npz`` file, whole or not at all."""
    parts: dict[str, Any] = {
        MARK: np.array(FORMAT),
        "image": entry.image,
        "hash": _text(digest(entry.image)),
        "points": entry.points,
        "mask": entry.mask,
        "box": np.array(entry.box, np.int64),
        "tag": _text(entry.tag),
        "scores": entry.scores,
        # An array of no length cannot be told from a damaged one.
        "peaks": np.array([np.nan, *entry.peaks]),
        "wrap": np.array(entry.wrap, bool),
        "report": _text(json.dumps(entry.report, allow_nan=False)),
    }
    for name in ("angles", "scales"):
        if getattr(entry, name) is not None:
            parts[name] = getattr(entry, name)
    if entry.sets is not None:
        parts |= {"sets": entry.sets.sets, "numbers": np.array(entry.sets.numbers)}
    with atomic(path) as temporary, open(temporary, "wb") as file:
        np.savez_compressed(file, allow_pickle=False, **parts)


def load(path: Path) -> Elements:
    """Read an entry that `save` wrote.

    Raises
    ------
    FileError
        Not there, no entry, of another version, or damaged.

    """
    parts = read_arrays(path)
    if MARK not in parts:
        raise FileError(f"{path}: is no entry of a texture's elements")
    version = parts[MARK].ravel().tolist()
    if version != [FORMAT]:
        raise FileError(
            f"{path}: is an entry of version {', '.join(map(str, version))}, this texrs reads version {FORMAT}; "
            "analyse the texture again"
        )
    try:
        image = as_image(parts["image"])
        if _words(parts["hash"]) != digest(image):
            raise InvalidInput("its image is not the one that was analysed")
        word, report = _words(parts["tag"]), json.loads(_words(parts["report"]))
        tag: Tag | None = next((t for t in get_args(Tag) if t == word), None)
        if tag is None or not isinstance(report, dict):
            raise InvalidInput(f"tag {word!r}")
        count, size = len(parts["points"]), image.shape[:2]
        shapes = {"points": (count, 2), "mask": size, "box": (2,), "scores": (count,), "wrap": (2,)}
        shapes |= {name: (count,) for name in ("angles", "scales") if name in parts}
        for name, shape in shapes.items():
            if parts[name].shape != shape:
                raise InvalidInput(f"{name} of shape {parts[name].shape}")
        if parts["mask"].dtype != np.bool_ or not np.isfinite(parts["points"]).all():
            raise InvalidInput("mask or points")
        sets = None
        if "sets" in parts:
            sets = Similarity(parts["sets"].astype(np.uint32), int(parts["numbers"].ravel()[0]))
            if sets.sets.ndim != 2 or len(sets.sets) != size[0] * size[1] or int(sets.sets.max()) >= len(sets.sets):
                raise InvalidInput("similarity sets")
        rows, columns = (int(n) for n in parts["box"])
        return Elements(
            image,
            parts["points"].astype(np.float64),
            parts["mask"],
            (rows, columns),
            tag,
            parts["scores"].astype(np.float64),
            tuple(float(p) for p in parts["peaks"][1:]),
            (bool(parts["wrap"][0]), bool(parts["wrap"][1])),
            report,
            parts.get("angles"),
            parts.get("scales"),
            sets,
        )
    except (InvalidInput, KeyError, TypeError, ValueError, OverflowError) as error:
        raise FileError(f"{path}: is damaged ({' '.join(str(error).split())})") from None


def _text(words: str) -> Array:
    return np.frombuffer(words.encode(), np.uint8)


def _words(array: Array) -> str:
    if array.dtype != np.uint8:
        raise InvalidInput("text")
    return array.tobytes().decode()

"""What commands read and write, checked before any long work."""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from texrs import io, samples
from texrs._arrays import as_image, as_size
from texrs._typing import Array
from texrs.errors import FileError, InvalidInput, TexrsError
from texrs.synthesis import Synthesis

__all__ = [
    "check_apart",
    "check_distinct",
    "check_folder",
    "check_npz",
    "check_output",
    "check_outputs",
    "deliver",
    "describe",
    "named",
    "output",
    "parse_axes",
    "parse_range",
    "parse_size",
    "parse_wrap",
    "read_exemplar",
    "read_hole",
    "read_picture",
]

SAMPLE = "sample:"
"""What the name of a built-in exemplar starts with."""
LONGEST_PROBE = 2**17
"""Longer than a side may be in any format that limits it."""
STAGE = re.compile(r"[0-9]{2,}-.*\.png|(points|mask)\.png|report\.json")
"""Names of what is written to a folder of stages."""


# --- values ----------------------------------------------------------------------------------------------------------


def parse_size(text: str | None, *, name: str = "--size", axes: int = 2) -> tuple[int, ...] | None:
    """Read ``512x384`` as rows and columns, ``512`` as a square; with three axes planes come first."""
    if text is None:
        return None
    parts = re.split(r"[x×]", text.strip().lower())
    if len(parts) not in (1, axes) or not all(re.fullmatch(r"\s*-?[0-9]{1,18}\s*", p) for p in parts):
        wanted = ("ROWSxCOLS, as in 512x384", "PLANESxROWSxCOLS, as in 64x96x128")[axes - 2]
        raise InvalidInput(f"{name}: needs {wanted}, or one number; got {text!r}")
    sides = [int(p) for p in parts]
    return as_size(sides if len(sides) > 1 else sides[0], name, axes=axes)


def parse_wrap(text: str) -> tuple[bool, bool]:
    """Read the axes that wrap: x is left to right, so along the columns, y is top to bottom."""
    axes = {"none": "", "x": "x", "y": "y", "xy": "xy", "yx": "xy"}.get(text.strip().lower())
    if axes is None:
        raise InvalidInput(f"--wrap: allowed are xy, x, y and none; got {text!r}")
    return "y" in axes, "x" in axes


def parse_axes(text: str, *, axes: int) -> tuple[bool, ...]:
    """Read the axes that wrap, of a picture as `parse_wrap` does, of a volume with z for the planes too."""
    if axes == 2:
        return parse_wrap(text)
    letters = text.strip().lower()
    if letters != "none" and (not letters or set(letters) - set("xyz") or len(set(letters)) < len(letters)):
        raise InvalidInput(f"--wrap: needs axes among x, y and z, each once, or none; got {text!r}")
    return tuple(letters != "none" and letter in letters for letter in "zyx")


def parse_range(text: str, *, name: str) -> tuple[float, float]:
    """Read ``0.8:1.2`` as the least and the largest, ``1`` as both."""
    parts = text.split(":")
    try:
        values = [float(p) for p in parts]
    except ValueError:
        values = []
    if len(values) not in (1, 2):
        raise InvalidInput(f"{name}: needs LEAST:LARGEST, as in 0.8:1.2; got {text!r}")
    return values[0], values[-1]


@contextmanager
def named(**names: str) -> Iterator[None]:
    """Name the file or the option where an error names the argument of a function.

    Arguments that are not given have the option of their own name.
    """
    try:
        yield
    except InvalidInput as error:
        argument, colon, rest = str(error).partition(":")
        if not colon or not argument.isidentifier():
            raise
        raise type(error)(f"{names.get(argument, f'--{argument}')}:{rest}") from None


# --- reading ---------------------------------------------------------------------------------------------------------


def read_picture(text: str) -> Array:
    """Read an image file, or make the built-in exemplar that ``sample:NAME`` names."""
    if text.startswith(SAMPLE):
        image: Array = samples.load(text.removeprefix(SAMPLE)).image
        return image
    return io.read(text)


def read_exemplar(text: str) -> Array:
    """Read a picture as `read_picture`, all of which must be finite."""
    image = read_picture(text)
    as_image(image, text)
    return image


def read_hole(path: str) -> Array:
    """Read a mask: any colour but black is the hole, whatever an alpha channel says."""
    mask = io.read(path)
    if mask.ndim == 2:
        return mask
    colours = mask[..., :-1] if mask.shape[-1] in (2, 4) else mask
    hole: Array = (colours != 0).any(axis=-1)
    return hole


# --- writing ---------------------------------------------------------------------------------------------------------


@contextmanager
def output(path: str) -> Iterator[Path]:
    """Return a temporary name that takes the place of ``path`` at the end; errors speak of ``path``."""
    with io.atomic(path) as temporary:
        try:
            yield temporary
        except TexrsError as error:
            message = str(error).replace(str(temporary), path)
            if message.startswith("array:"):
                message = path + message.removeprefix("array")
            raise type(error)(message) from None


class _Enough(Exception):
    """What there was to try out worked."""


def check_output(path: str, like: Array | None = None, size: tuple[int, ...] = (1, 1)) -> None:
    """Try whether an image of the dtype and channels of ``like`` can be written; leave no trace of it.

    Without ``like``, only whether a file can be.
    """
    with suppress(_Enough), output(path) as temporary:
        if like is None:
            temporary.touch()
        else:
            # As long as the result, which some formats limit, and with the value that .hdr may refuse.
            axes = len(size)
            longest = min(max(size), LONGEST_PROBE)
            probe = np.full((longest, *(1,) * (axes - 1), *like.shape[axes:]), like.min(), like.dtype)
            (io.write if axes == 2 else io.write_volume)(temporary, probe)
        raise _Enough


def check_outputs(out: str, source: str | None, stages: str | None) -> None:
    """Check that what stands beside the result can be written: the source map and the folder of the stages."""
    check_distinct(out=out, source=source, stages=stages)
    if source is not None:
        check_npz(source)
        check_output(source)
    if stages is not None:
        check_folder(stages)


def deliver(result: Synthesis, out: str, source: str | None, stages: str | None) -> None:
    """Write a result and what was asked for beside it."""
    # The result takes its name last, when all else is written.
    with output(out) as temporary:
        (io.write if result.source.axes == 2 else io.write_volume)(temporary, result.image)
        if source is not None:
            result.source.save(source)
        if stages is not None:
            result.save_stages(stages)


def variant_names(seed: int, **paths: str | None) -> dict[str, Any]:
    """Return the names of what is written of one of several results: each ends in its seed."""
    for option, path in paths.items():
        if path is not None and not Path(path).name:
            raise InvalidInput(f"--{option}: needs a name that the seed of a variant can follow, got {path!r}")
    return {option: None if p is None else beside(Path(p), seed) for option, p in paths.items()}


def beside(path: Path, seed: int) -> str:
    """Return the name of one of several results."""
    return str(path.with_name(f"{path.stem}-{seed}{path.suffix}"))


def contact_sheet(images: Sequence[Array], side: int = 256) -> Array:
    """Set small versions of images of one size into a grid, in their dtype."""
    # Every n-th pixel, so that any dtype and any channels can be shown.
    step = max(1, -(-max(images[0].shape[:2]) // side))
    small = [image[::step, ::step] for image in images]
    columns = int(np.ceil(np.sqrt(len(small))))
    rows = -(-len(small) // columns)
    height, width = small[0].shape[:2]
    sheet = np.zeros((rows * height, columns * width, *small[0].shape[2:]), small[0].dtype)
    for i, one in enumerate(small):
        top, left = i // columns * height, i % columns * width
        sheet[top : top + height, left : left + width] = one
    return sheet


def parse_shares(text: str | None) -> list[float] | None:
    """Read shares such as 2:1:1."""
    if text is None:
        return None
    try:
        return [float(part) for part in text.split(":")]
    except ValueError:
        raise InvalidInput(f"--weights: needs numbers such as 2:1:1, one an example, got {text!r}") from None


def check_npz(path: str) -> None:
    """Check the name of a source map."""
    if Path(path).suffix.lower() != ".npz":
        raise InvalidInput(f"--source: needs a name that ends in .npz, got {path!r}")


def describe(image: Array, axes: int) -> str:
    """Say the size, the channels and the dtype of an image."""
    channels = image.shape[axes] if image.ndim > axes else 1
    sides = " x ".join(map(str, image.shape[:axes]))
    return f"{sides}, {channels} channel{'s'[: channels != 1]}, {image.dtype}"


def check_folder(path: str) -> None:
    """Check that a folder is there and can be written to, or can be made."""
    if not path or "\0" in path:
        raise FileError(f"{path!r}: is not the name of a folder")
    there = Path(path)
    while not os.path.lexists(there) and there != there.parent:
        there = there.parent
    if not there.is_dir():
        raise FileError(f"{path}: {there} is not a folder" if str(there) != path else f"{path}: is not a folder")
    if not os.access(there, os.W_OK | os.X_OK):
        raise FileError(f"{path}: the folder {there} cannot be written to")


def check_apart(inputs: Iterable[str], **outputs: str | None) -> None:
    """Check that no output is an input, under whatever name, nor what the pictures of the stages would replace."""
    found = [(name, status) for name in inputs if (status := _status(name)) is not None]
    for option, path in outputs.items():
        if path is None:
            continue
        files = [path]
        if option == "stages":
            there = sorted(os.listdir(path)) if os.path.isdir(path) else []
            files = [os.path.join(path, name) for name in there if STAGE.fullmatch(name)]
        for file in files:
            old = _status(file)
            for name, status in found:
                if old is not None and os.path.samestat(old, status):
                    known = "" if name == file else f" as {name}"
                    raise InvalidInput(f"--{option}: {file} is read{known}, and would be lost; write to another file")


def _status(path: str) -> os.stat_result | None:
    """Return the status of the regular file that a path leads to, if there is one."""
    with suppress(OSError, ValueError):
        status = os.stat(path)
        if stat.S_ISREG(status.st_mode):
            return status
    return None


def check_distinct(**paths: str | None) -> None:
    """Check that no two outputs are one file."""
    seen: dict[str, str] = {}
    for option, path in paths.items():
        if path is None:
            continue
        other = seen.setdefault(os.path.realpath(path), option)
        if other != option:
            raise InvalidInput(f"--{option}: {path} is already the file of --{other}")

"""What commands write, declared once and checked before any long work: never over what they read."""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from typer.core import TyperCommand

from texrs import io
from texrs._arrays import as_list
from texrs._typing import Array
from texrs.errors import FileError, InvalidInput, TexrsError
from texrs.synthesis import Synthesis

SAMPLE = "sample:"
"""What the name of a built-in exemplar starts with."""
LONGEST_PROBE = 2**17
"""Longer than a side may be in any format that limits it."""
STAGE = re.compile(r"[0-9]{2,}-.*\.png|(points|mask|numbers)\.png|report\.json")
"""Names of what is written to a folder of stages."""

OUTPUTS: dict[str, tuple[tuple[str, ...], str, str]] = {
    "out": (("--out", "-o"), "OUT", "File to write; its name says the format."),
    "map": (("--map",), "OUT.npz", "File for the source map, for texrs apply."),
    "stages": (("--stages",), "DIR", "Folder for pictures of the stages and report.json."),
    "page": (("--page",), "OUT.html", "Page that shows what was found, to be corrected by clicking."),
}
"""All options that say what is written: what the shell calls them, what they are, and what they are for."""
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print no progress.")]
Threads = Annotated[
    int | None,
    typer.Option("--threads", metavar="N", help="Threads, 1 to 1024; same bytes with any.", show_default="all cores"),
]


def make_argument(metavar: str, text: str) -> Any:
    """Return what tells typer of an argument."""
    return typer.Argument(metavar=metavar, help=text, show_default=False)


def make_option(metavar: str | None, text: str) -> Any:
    """Return what tells typer of an option that may be left out."""
    return typer.Option(metavar=metavar, help=text, show_default=False)


def to_write(name: str, metavar: str | None = None, text: str | None = None) -> Any:
    """Return the option for one of the outputs, which a command may describe in its own way."""
    flags, usual, purpose = OUTPUTS[name]
    return typer.Option(*flags, metavar=metavar or usual, help=text or purpose, show_default=False)


class Command(TyperCommand):
    """A command that never writes over what it reads: whatever names a file and is no output may be read."""

    def invoke(self, ctx: Any) -> Any:
        """Do the command, if no output is an input."""
        outputs = {p.name for p in self.params if p.name in OUTPUTS and p.param_type_name == "option"}
        given = ctx.params.items()
        inputs = [text for name, value in given if name not in outputs for text in find_texts(value)]
        check_apart(inputs, {name: value for name, value in given if name in outputs})
        return super().invoke(ctx)


def find_texts(value: object) -> list[str]:
    """Return the texts among the values of a parameter."""
    return [v for v in as_list(value) if isinstance(v, str)]


# --- checks ----------------------------------------------------------------------------------------------------------


def check_outputs(paths: Mapping[str, str | None]) -> None:
    """Check what stands beside the result: other files than it, a name of a source map, a folder for the stages."""
    seen: dict[str, str] = {}
    for option, path in paths.items():
        if path is not None:
            other = seen.setdefault(os.path.realpath(path), option)
            if other != option:
                raise InvalidInput(f"--{option}: {path} is already the file of --{other}")
    if (source := paths.get("map")) is not None:
        check_suffix("map", source)
        check_output(source)
    if (stages := paths.get("stages")) is not None:
        check_folder(stages)


def check_suffix(option: str, path: str) -> None:
    """Check that the name of a file of arrays says so."""
    if Path(path).suffix.lower() != ".npz":
        raise InvalidInput(f"--{option}: needs a name that ends in .npz, got {path!r}")


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


def check_apart(inputs: Iterable[str], outputs: Mapping[str, str | None]) -> None:
    """Check that no output is an input, under whatever name, nor what the pictures of the stages would replace."""
    found = [(name, status) for name in inputs if (status := _read_status(name)) is not None]
    for option, path in outputs.items():
        if path is None:
            continue
        files = [path]
        if option == "stages":
            there = sorted(os.listdir(path)) if os.path.isdir(path) else []
            files = [os.path.join(path, name) for name in there if STAGE.fullmatch(name)]
        for file in files:
            old = _read_status(file)
            for name, status in found:
                if old is not None and os.path.samestat(old, status):
                    known = "" if name == file else f" as {name}"
                    raise InvalidInput(f"--{option}: {file} is read{known}, and would be lost; write to another file")


def _read_status(path: str) -> os.stat_result | None:
    """Return the status of the regular file that a path leads to, if there is one."""
    with suppress(OSError, ValueError):
        status = os.stat(path)
        if stat.S_ISREG(status.st_mode):
            return status
    return None


class _Enough(Exception):
    """What there was to try out worked."""


def check_output(path: str, like: Array | None = None, size: tuple[int, ...] = (1, 1)) -> None:
    """Try whether an image of the dtype and channels of ``like`` can be written; leave no trace of it.

    Without ``like``, only whether a file can be.
    """
    with suppress(_Enough), write_output(path) as temporary:
        if like is None:
            temporary.touch()
        else:
            # As long as the result, which some formats limit, and with the value that .hdr may refuse; where a picture is
            # not known anything may stand.
            axes = len(size)
            longest = min(max(size), LONGEST_PROBE)
            least = np.nan_to_num(np.fmin.reduce(like, axis=None))
            probe = np.full((longest, *(1,) * (axes - 1), *like.shape[axes:]), least, like.dtype)
            (io.write if axes == 2 else io.write_volume)(temporary, probe)
        raise _Enough


# --- writing ---------------------------------------------------------------------------------------------------------


@contextmanager
def write_output(path: str) -> Iterator[Path]:
    """Return a temporary name that takes the place of ``path`` at the end; errors speak of ``path``."""
    with io.atomic(path) as temporary:
        try:
            yield temporary
        except TexrsError as error:
            message = str(error).replace(str(temporary), path)
            if message.startswith("array:"):
                message = path + message.removeprefix("array")
            raise type(error)(message) from None


@contextmanager
def name_arguments(**names: str) -> Iterator[None]:
    """Name the file or the option where an error names the argument of a function.

    Arguments that are not given have the option of their own name.
    """
    try:
        yield
    except InvalidInput as error:
        argument, colon, rest = str(error).partition(":")
        if not colon or not argument.isidentifier():
            raise
        raise type(error)(f"{names.get(argument, '--' + argument.replace('_', '-'))}:{rest}") from None


def deliver(result: Synthesis, paths: Mapping[str, str | None]) -> None:
    """Write a result and what was asked for beside it."""
    # The result takes its name last, when all else is written.
    with write_output(paths["out"] or "") as temporary:
        (io.write if result.source.axes == 2 else io.write_volume)(temporary, result.image)
        if (source := paths.get("map")) is not None:
            result.source.save(source)
        if (stages := paths.get("stages")) is not None:
            result.save_stages(stages)


def name_variants(seed: int, paths: Mapping[str, str | None]) -> dict[str, str | None]:
    """Return the names of what is written of one of several results: each ends in its seed."""
    for option, path in paths.items():
        if path is not None and not Path(path).name:
            raise InvalidInput(f"--{option}: needs a name that the seed of a variant can follow, got {path!r}")
    places = {option: None if path is None else Path(path) for option, path in paths.items()}
    return {o: None if p is None else str(p.with_name(f"{p.stem}-{seed}{p.suffix}")) for o, p in places.items()}


def make_contact_sheet(images: Sequence[Array]) -> Array:
    """Set images of one size into a grid, in their dtype."""
    columns = int(np.ceil(np.sqrt(len(images))))
    height, width = images[0].shape[:2]
    sheet = np.zeros((-(-len(images) // columns) * height, columns * width, *images[0].shape[2:]), images[0].dtype)
    for i, one in enumerate(images):
        top, left = i // columns * height, i % columns * width
        sheet[top : top + height, left : left + width] = one
    return sheet


def shrink(image: Array, side: int = 256) -> Array:
    """Return every n-th pixel, so that any dtype and any channels can be shown."""
    step = max(1, -(-max(image.shape[:2]) // side))
    small: Array = image[::step, ::step].copy()
    return small


def describe(image: Array, axes: int) -> str:
    """Return the size, the channels and the dtype of an image."""
    channels = image.shape[axes] if image.ndim > axes else 1
    sides = " x ".join(map(str, image.shape[:axes]))
    return f"{sides}, {channels} channel{'s'[: channels != 1]}, {image.dtype}"

"""Declare the outputs of commands, and check them before the work. Outputs never replace inputs."""

from __future__ import annotations

import os
import re
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from typer.core import TyperCommand

from texrs import io
from texrs._arrays import as_list
from texrs._notices import ignore
from texrs._typing import Array
from texrs.cli import _provenance
from texrs.cli._places import PLACED, say_places
from texrs.cli._provenance import RUNNING, as_flag, check_free, read_status
from texrs.cli._tails import split_tail
from texrs.errors import FileError, InvalidInput, TexrsError
from texrs.io.annotation import name_sidecar, needs_sidecar, write_record
from texrs.io.files import find_suffix
from texrs.io.formats import RAW, STORE, check, detect_kind, holds_spacing, keeps_spacing
from texrs.io.pillow import write_indexed
from texrs.io.temporary import name_prefix, put, sweep
from texrs.synthesis import Synthesis

NEGATIVE = re.compile(r"-[0-9.]+(e[-+]?[0-9]+)?", re.IGNORECASE)
"""Pattern of a negative number, which click would interpret as an option."""
SAMPLE = "sample:"
"""Prefix of the names of built-in exemplars."""
LONGEST_PROBE = 2**17
"""Side of a test image that is longer than any format with a limit allows, in pixels."""
STAGE = re.compile(r"[0-9]{2,}-.*\.png|(points|mask|numbers)\.png|report\.json")
"""Pattern of the names of files in a folder of stages."""

MAIN, MORE, FILES, WORK = "Options", "More options", "Other files to write", "Execution"
"""Groups of options in the help."""
NO_MATERIALS = ("batch", "samples")
"""Commands that do not read a folder as a material. Their outputs can be in a folder of inputs."""
MATTER = ("out", "folder", "size", "seed", "seeds", "options", "field", "wrap", "slant", "at")
"""Options that the help of a command lists first. The first three that a command has are its main options."""

OUTPUTS: dict[str, tuple[tuple[str, ...], str, str]] = {
    "out": (("--out", "-o"), "OUT", "File to write. Its suffix selects the format."),
    "source_map": (("--source-map",), "OUT.npz", "File for the source map, which texrs apply reads."),
    "stages": (("--stages",), "DIR", "Folder for images of the intermediate stages, and for report.json."),
    "sheet": (("--sheet",), "OUT.png", "Contact sheet of all results."),
    "preview": (("--preview",), "OUT.png", "Image of the lit material: 2 x 2 copies."),
    "mipmaps": (("--mipmaps",), "DIR", "Folder for the mipmaps of a material."),
    "gltf": (("--gltf",), "OUT.glb", "Material on a plane and on a sphere, as one glTF 2.0 file."),
    "materialx": (("--materialx",), "DIR", "Folder for the material as MaterialX: material.mtlx and its maps."),
    "page": (("--page",), "OUT.html", "HTML page of the elements, for corrections by clicking."),
}
"""Options of all outputs: their names, metavars and descriptions."""
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print neither progress nor notices.")]
Threads = Annotated[
    int | None,
    typer.Option(
        "--threads",
        metavar="N",
        help="Number of threads, 1 to 1024. The result does not depend on it.",
        show_default="all cores",
    ),
]


Force = Annotated[
    bool,
    typer.Option("--force", help="Overwrite files that this command did not write."),
]


def make_argument(metavar: str, text: str) -> Any:
    """Return typer's description of an argument."""
    return typer.Argument(metavar=metavar, help=text, show_default=False)


def make_option(metavar: str | None, text: str) -> Any:
    """Return typer's description of an option that is not required."""
    return typer.Option(metavar=metavar, help=text, show_default=False)


def to_write(name: str, metavar: str | None = None, text: str | None = None) -> Any:
    """Return the option of an output. A command can replace its description."""
    flags, usual, purpose = OUTPUTS[name]
    return typer.Option(*flags, metavar=metavar or usual, help=text or purpose, show_default=False)


class Command(TyperCommand):
    """A command that never overwrites its inputs. Every file name that is not an output counts as an input."""

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """List the options in groups: the main options, further options, groups by subject, other files, and limits."""
        sections: dict[str, list[tuple[str, str]]] = {title: [] for title in ("Arguments", MAIN, MORE)}
        last: dict[str, list[tuple[str, str]]] = {title: [] for title in (FILES, WORK)}
        options = [p for p in self.get_params(ctx) if p.param_type_name == "option"]
        main = [name for name in MATTER if name in {p.name for p in options}][:3]
        rank = {name: place for place, name in enumerate(main)}
        for p in sorted(self.get_params(ctx), key=lambda p: rank.get(p.name, len(rank))):
            entry = p.get_help_record(ctx)
            if entry is None:
                continue
            if p.param_type_name != "option":
                title = "Arguments"
            elif p.name in main:
                title = MAIN
            elif p.name in OUTPUTS or p.name == "each":
                title = FILES
            elif p.name in ("count", "quiet", "force", "help", "memory_limit", "pixel_limit", "time_limit", "strict"):
                title = WORK
            else:
                title = getattr(p, "rich_help_panel", None) or MORE
            (last if title in last else sections).setdefault(title, []).append(entry)
        for title, entries in (sections | last).items():
            if entries:
                with formatter.section(title):
                    formatter.write_dl(entries)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the arguments. A negative number is an argument, such as a pixel value, unless it follows an option."""
        before = ["", *args]
        shielded = [
            f" {a}" if NEGATIVE.fullmatch(a) and b[:1] != "-" else a for b, a in zip(before, args, strict=False)
        ]
        rest: list[str] = super().parse_args(ctx, shielded)
        ctx.params |= {
            n: v.strip() for n, v in ctx.params.items() if isinstance(v, str) and NEGATIVE.fullmatch(v.strip())
        }
        return rest

    def invoke(self, ctx: Any) -> Any:
        """Run the command, after checking that no output is an input. Its files contain a record of the command."""
        outputs = {p.name for p in self.params if p.name in OUTPUTS and p.param_type_name == "option"}
        force = ctx.params.get("force", False)
        given = ctx.params.items()
        inputs = [text for name, value in given if name not in outputs for text in find_texts(value)]
        written = {name: value for name, value in given if name in outputs}
        check_apart(list_files(inputs), written)
        if self.name not in NO_MATERIALS:
            check_folders_apart(inputs, written)
        with _provenance.record(_provenance.make_record(self, ctx.params, force=force) if outputs else None):
            return super().invoke(ctx)


def check_folders_apart(inputs: Iterable[str], outputs: Mapping[str, Any]) -> None:
    """Raise an error if an output is in the folder of a material that is read, because it would become a map of it."""
    read = {os.path.realpath(text): text for text in inputs if os.path.isdir(text)}
    for name, value in outputs.items():
        if isinstance(value, str) and os.path.realpath(value) in read:
            raise InvalidInput(
                f"{as_flag(name)}: {value} is the folder of an input, and would contain other maps afterwards; "
                "write to another folder"
            )


def list_files(texts: Iterable[str]) -> list[str]:
    """Return the files that texts name. A folder stands for the files in it."""
    return [file for text in texts for file in (_provenance.list_folder(text) or [split_tail(text)[0]])]


def find_texts(value: object) -> list[str]:
    """Return the texts among the values of a parameter."""
    return [v for v in as_list(value) if isinstance(v, str)]


# --- checks ----------------------------------------------------------------------------------------------------------


def check_outputs(paths: Mapping[str, str | None]) -> None:
    """Check the outputs other than the result.

    They must be different files. The source map must have a valid name, and the stages a usable folder.
    """
    seen: dict[str, str] = {}
    for option, path in paths.items():
        if path is not None:
            other = seen.setdefault(os.path.realpath(path), option)
            if other != option:
                raise InvalidInput(f"{as_flag(option)}: {path} is already the output of {as_flag(other)}")
    if (source := paths.get("source_map")) is not None:
        check_suffix("source_map", source)
        check_output(source, option="source_map")
    if (shown := paths.get("preview")) is not None:
        check_output(shown, np.zeros((1, 1, 3), np.uint8), option="preview")
    if (solid := paths.get("gltf")) is not None:
        check_suffix("gltf", solid, ".glb")
        check_output(solid, option="gltf")
    for option in ("mipmaps", "materialx"):
        if (folder := paths.get(option)) is not None:
            check_folder(folder)
    if (stages := paths.get("stages")) is not None:
        check_stages(stages)


def check_suffix(option: str, path: str, suffix: str = ".npz") -> None:
    """Check that the suffix of a file name belongs to a supported format. Default: formats of arrays."""
    if Path(path).suffix.lower() != suffix:
        raise InvalidInput(f"{as_flag(option)}: must be a name that ends in {suffix}, got {path!r}")


def check_folder(path: str) -> None:
    """Check that a folder exists and can be written to, or can be created."""
    if not path or "\0" in path:
        raise FileError(f"{path!r}: is not the name of a folder")
    there = Path(path)
    while not os.path.lexists(there) and there != there.parent:
        there = there.parent
    if not there.is_dir():
        raise FileError(f"{path}: {there} is not a folder" if str(there) != path else f"{path}: is not a folder")
    if not os.access(there, os.W_OK | os.X_OK):
        raise FileError(f"{path}: the folder {there} cannot be written to")


def check_stages(folder: str) -> None:
    """Check that the images of stages can be written to a folder, and that they replace only such images."""
    check_folder(folder)
    for file in list_stages(folder):
        check_free(file, "stages")


def list_stages(folder: str) -> list[str]:
    """Return the existing files in a folder that the images of stages can replace."""
    there = sorted(os.listdir(folder)) if os.path.isdir(folder) else []
    return [os.path.join(folder, name) for name in there if STAGE.fullmatch(name)]


def check_apart(inputs: Iterable[str], outputs: Mapping[str, str | None]) -> None:
    """Check that no output is an input, even under another name or through links, and that stages do not replace inputs."""
    found = [(name, status) for name in inputs if (status := read_status(name)) is not None]
    for option, path in outputs.items():
        if path is None:
            continue
        files = list_stages(path) if option == "stages" else [path]
        if option != "stages" and path and "\0" not in path and needs_sidecar(real := Path(os.path.realpath(path))):
            files.append(str(name_sidecar(real)))
        for file in files:
            old = read_status(file)
            for name, status in found:
                if old is not None and os.path.samestat(old, status):
                    known = "" if name == file else f" ({name})"
                    raise InvalidInput(
                        f"{as_flag(option)}: {file} is an input{known}, and would be lost; write to another file"
                    )


class _Enough(Exception):
    """Raised to stop a test of writing that succeeded."""


def check_output(
    path: str,
    like: Array | None = None,
    size: tuple[int, ...] = (1, 1),
    *,
    option: str = "out",
    fills: bool = False,
) -> None:
    """Check that an image with the dtype and channels of ``like`` can be written. No file is left.

    Without ``like``, only check that a file can be created. An existing file must be from the same command, unless
    ``--force`` is given. If ``fills`` is True, a transparent image can become opaque.
    """
    with suppress(_Enough), write_output(path, option) as temporary:
        if like is None:
            temporary.touch()
        else:
            # Use the longest side of the result, because some formats limit it, and the minimum value, because .hdr
            # rejects negative values. Ignore NaN, which can mark unknown pixels.
            axes = len(size)
            longest = min(max(size), LONGEST_PROBE)
            least = np.nan_to_num(np.fmin.reduce(like, axis=None))
            probe = np.full((longest, *(1,) * (axes - 1), *like.shape[axes:]), least, like.dtype)
            if axes == 2 and like.shape[2:] in ((2,), (4,)):
                probe[..., -1] = like[..., -1].max() if fills else like[..., -1].min()
            if find_suffix(temporary).lower() == ".gif":
                check(like, ".gif", axes)
            (io.write if axes == 2 else io.write_volume)(temporary, probe)
        raise _Enough


# --- writing ---------------------------------------------------------------------------------------------------------


@contextmanager
def write_output(
    path: str,
    option: str = "out",
    *,
    inside: bool = False,
    suffix: str = "",
    made: _provenance.Record | None = None,
) -> Iterator[Path]:
    """Provide a temporary name for a file that becomes ``path`` at the end. Errors name ``path``.

    The file contains the record of the command, or the record ``made``. If ``inside`` is True, the option names the
    folder of the file.
    """
    if find_suffix(Path(path)).lower() == STORE:
        raise FileError(f"{path}: only texrs solid, synthesize, tiles and apply write Zarr stores")
    with io.atomic(path) as temporary:
        check_free(path, option)
        try:
            yield temporary
            running = made or RUNNING.get()
            if running is not None:
                said = running.tell(path, output=option, inside=inside, suffix=suffix)
                write_record(temporary, said, Path(os.path.realpath(path)))
        except TexrsError as error:
            message = str(error).replace(str(temporary), path)
            if message.startswith("array:"):
                message = path + message.removeprefix("array")
            raise type(error)(message) from None


@contextmanager
def write_folder(path: str, option: str, *, suffix: str = "", made: _provenance.Record | None = None) -> Iterator[Path]:
    """Provide a temporary folder whose files are moved to ``path`` at the end. Each file records the command."""
    os.makedirs(path, exist_ok=True)
    sweep(os.path.realpath(path))
    temporary = Path(tempfile.mkdtemp(prefix=name_prefix(), dir=path))
    try:
        yield temporary
        running = made or RUNNING.get()
        for file in sorted(temporary.iterdir()):
            target = os.path.join(path, file.name)
            check_free(target, option)
            if running is not None:
                write_record(file, running.tell(target, output=option, inside=True, suffix=suffix))
            if (beside := name_sidecar(file)).exists():
                put(beside, name_sidecar(Path(target)))
            put(file, Path(target))
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


@contextmanager
def name_arguments(**names: str) -> Iterator[None]:
    """Replace the names of function arguments in errors by the file or the option.

    Arguments that are not given are replaced by the option of the same name.
    """
    try:
        yield
    except InvalidInput as error:
        several = error.argument.split(", ")
        if not all(each.isidentifier() for each in several):
            raise
        called = dict.fromkeys(names.get(each, as_flag(each)) for each in several)
        said = say_places(error.reason) if set(several) & set(PLACED) else error.reason
        # Also replace other argument names in the text, but only names with an underscore, because others can be
        # ordinary words.
        for other in (name for name in names if "_" in name):
            said = re.sub(rf"\b{other}\b", names[other], said)
        raise type(error)(f"{', '.join(called)}: {said}", remedy=error.remedy) from None


PLACING = ("nrrd", "nii", "nii.gz")
"""Volume formats that store the position of the voxels."""


def find_volume(source: Any, axes: int) -> str | None:
    """Return the volume file whose spacing, orientation, origin and units are copied to the result.

    Return None if such a file does not exist.
    """
    there = axes == 3 and isinstance(source, str) and not source.startswith(SAMPLE)
    return source if there else None


def read_kept_spacing(source: Any, out: str, axes: int) -> Sequence[float] | None:
    """Return the voxel spacing of a file if the format of the result can store it, else None."""
    suffix = find_suffix(Path(out)).lower()
    volume = find_volume(source, axes)
    return io.read_spacing(volume) if volume is not None and (suffix == RAW or keeps_spacing(suffix)) else None


def deliver(
    result: Synthesis,
    paths: Mapping[str, str | None],
    *,
    like: io.Metadata | None = None,
    volume: str | None = None,
    spacing: Sequence[float] | None = None,
    made: _provenance.Record | None = None,
    option: str = "out",
) -> None:
    """Write a result and its additional outputs. ``like`` is the colour description for the file.

    Voxels keep the position of the file ``volume``, with another spacing if ``spacing`` is given.
    """
    out = paths["out"] or ""
    image, axes = np.asarray(result.image), result.source_map.axes
    suffix = find_suffix(Path(out))
    # Give the result its final name only after all other files are written.
    with write_output(out, option, inside=option != "out", made=made) as temporary:
        if axes == 3:
            write_like(temporary, image, volume, spacing, notes=like)
        elif like is None or not write_indexed(temporary, image, like):
            io.write(temporary, result.image, notes=like)
        deliver_beside(result, paths, suffix, made)


def write_like(
    path: Path,
    image: Array,
    volume: str | None,
    spacing: Sequence[float] | None = None,
    notes: io.Metadata | None = None,
) -> None:
    """Write a volume with the position of another file, as far as the format can store it."""
    stated = spacing or (None if volume is None else io.read_spacing(volume))
    suffix = find_suffix(path).lower()
    if stated is None or not holds_spacing(image, suffix):
        if stated is not None and any(step != 1 for step in stated):
            ignore(
                f"{volume or '--spacing'}: the spacing is not kept, because {suffix} of {image.dtype} cannot store it"
            )
        io.write_volume(path, image, notes=notes)
        return
    kind = "" if volume is None else detect_kind(Path(volume))
    if kind in PLACING and not suffix[1:].startswith(kind[:3]):
        ignore(f"{volume}: its orientation, origin and unit are not kept, because only the same format can take them")
    io.write_volume(path, image, spacing=stated, like=volume, notes=notes)


def deliver_beside(
    result: Synthesis, paths: Mapping[str, str | None], suffix: str, made: _provenance.Record | None
) -> None:
    """Write the additional outputs of a result: its source map, and images of its stages."""
    if (source := paths.get("source_map")) is not None:
        with write_output(source, "source_map", suffix=suffix, made=made) as place:
            result.source_map.save(place)
    if (stages := paths.get("stages")) is not None:
        with write_folder(stages, "stages", suffix=suffix, made=made) as folder:
            result.save_stages(folder)


def name_variants(seed: int, paths: Mapping[str, str | None]) -> dict[str, str | None]:
    """Return the output names for one of several results. The seed is added to each name."""
    for option, path in paths.items():
        if path is not None and not Path(path).name:
            raise InvalidInput(
                f"{as_flag(option)}: must contain a file name, because a seed is added to it, got {path!r}"
            )
    named: dict[str, str | None] = {}
    for option, path in paths.items():
        suffix = "" if path is None else find_suffix(Path(path))
        named[option] = None if path is None else f"{path.removesuffix(suffix)}-{seed}{suffix}"
    return named


def make_contact_sheet(images: Sequence[Array]) -> Array:
    """Arrange images of one size in a grid, in their dtype."""
    columns = int(np.ceil(np.sqrt(len(images))))
    height, width = images[0].shape[:2]
    sheet = np.zeros((-(-len(images) // columns) * height, columns * width, *images[0].shape[2:]), images[0].dtype)
    for i, one in enumerate(images):
        top, left = i // columns * height, i % columns * width
        sheet[top : top + height, left : left + width] = one
    return sheet


def shrink(image: Array, side: int = 256) -> Array:
    """Reduce an image by taking every n-th pixel, for any dtype and number of channels."""
    step = max(1, -(-max(image.shape[:2]) // side))
    small: Array = image[::step, ::step].copy()
    return small


def describe(image: Array, axes: int) -> str:
    """Return a text with width, height, channels and dtype, and depth for a volume."""
    channels = image.shape[axes] if image.ndim > axes else 1
    return f"{show_sides(image.shape[:axes])}, {channels} channel{'s'[: channels != 1]}, {image.dtype}"


def show_sides(shape: Sequence[int]) -> str:
    """Return a text of sides as on the command line: the width first."""
    return " x ".join(map(str, reversed(shape)))

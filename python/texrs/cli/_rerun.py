"""Commands about existing files: ``texrs info`` describes a file, ``texrs rerun`` makes it again."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import tempfile
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from texrs import io
from texrs._typing import Array
from texrs._version import __version__
from texrs.cli._console import hush, note, say
from texrs.cli._outputs import Quiet, Threads, describe, make_argument, show_sides, to_write
from texrs.cli._places import put_rows_first
from texrs.cli._provenance import CHANGED, ORIGINAL, RUNNING, expand_braces
from texrs.cli._stacks import is_stack
from texrs.cli._tails import split_tail
from texrs.errors import FileError, InvalidInput
from texrs.io.annotation import hash_file, is_unchanged, name_sidecar, needs_sidecar
from texrs.io.formats import detect_kind
from texrs.io.grids import holds_volume
from texrs.io.pillow import count_frames
from texrs.io.raw import strip_raw
from texrs.io.temporary import name_prefix
from texrs.materials import Map, Material
from texrs.source_map import SourceMap

PLACED_FLAGS = {"--at", "--background", "--box", "--corners", "--oblique", "--points"}
"""Options whose places were row,column before records stated the order."""
SHORT = 16
"""Number of digits of a SHA-256 that are displayed."""


@dataclass(frozen=True, slots=True)
class Recipe:
    """Record, in a file, of the command that wrote it."""

    path: str
    text: str
    """The record as JSON text."""
    version: str
    verb: str
    arguments: list[str | None]
    options: dict[str, Any]
    inputs: dict[str, str]
    """SHA-256 of each input, by its name relative to the folder of the file."""
    output: str
    file: str | None
    """Name of the file within the output folder, if the output is a folder."""
    suffix: str
    rows_first: bool
    """If True, places in the record are row,column. Records that do not state x,y are read in this way."""

    @classmethod
    def read(cls, path: str) -> Recipe | None:
        """Read the record in a file, or return None if there is none."""
        text = io.read_metadata(path).made
        if text is None:
            return None
        said = json.loads(text)
        try:
            one = cls(
                path,
                text,
                str(said["texrs"]),
                str(said["verb"]),
                [a if a is None else str(a) for a in said["arguments"]],
                dict(said["options"]),
                {str(name): str(sha) for name, sha in said["inputs"].items()},
                str(said["output"]),
                said.get("file"),
                str(said.get("suffix", "")),
                said.get("places") != "x,y",
            )
        except (KeyError, TypeError, AttributeError, ValueError):
            raise FileError(f"{path}: the record of its command is damaged") from None
        if one.file is not None and os.path.basename(str(one.file)) != one.file:
            raise FileError(f"{path}: the record of its command is damaged")
        return one

    def make_command(self, names: Mapping[str, str], folder: str) -> list[str]:
        """Return the command that writes the file to another folder, from the present paths of its inputs."""
        target = folder if self.file is not None else os.path.join(folder, os.path.basename(self.path))

        def find(text: str) -> str:
            file, tail = split_tail(text)
            return names.get(text, text) if not tail else names.get(file, file) + tail

        words = [self.verb, *(target if a is None else find(a) for a in self.arguments)]
        for flag, value in self.options.items():
            for text in value if isinstance(value, list) else [value]:
                words += [flag] if text is True else [flag, find(str(text))]
        if None in self.arguments:
            return words
        if self.output not in ("--out", "--sheet"):
            # Give the main result a name as well, because the command always writes it.
            words += ["--out", os.path.join(folder, f"result{self.suffix or '.npz'}")]
        return [*words, self.output, target]

    def show(self) -> str:
        """Return the command as a user would type it in a shell."""
        words = ["texrs", self.verb, *("FOLDER" if a is None else a for a in self.arguments)]
        for flag, value in self.options.items():
            for text in value if isinstance(value, list) else [value]:
                words += [flag] if text is True else [flag, str(text)]
        return shlex.join(words)

    def find_inputs(self) -> dict[str, str]:
        """Return the present path of each input file. An error lists all missing or changed files."""
        folder = os.path.dirname(os.path.realpath(self.path))
        found, wrong = {}, []
        for name, sha in self.inputs.items():
            # Search for the recorded path relative to the result, then relative to the current folder, and for the
            # file name next to the result.
            places = (os.path.join(folder, name), name, os.path.join(folder, os.path.basename(name)))
            there = [os.path.normpath(p) for p in places if os.path.isfile(p) or io.is_store(p)]
            same = next((p for p in there if hash_file(p) == sha), None)
            if sha == CHANGED:
                wrong.append(f"{name} {CHANGED}")
            elif same is not None:
                found[name] = same
            elif there:
                now = hash_file(there[0])[:SHORT]
                wrong.append(f"{name} has changed since (SHA-256 {sha[:SHORT]}... then, {now}... now in {there[0]})")
            else:
                wrong.append(f"{name} is missing (SHA-256 {sha[:SHORT]}...)")
        if wrong:
            raise InvalidInput(f"{self.path}: cannot be made again: {'; '.join(wrong)}")
        for text in (*self.arguments, *(t for v in self.options.values() for t in (v if isinstance(v, list) else [v]))):
            # A record lists the maps in a folder but not the folder, so find the folder of its maps.
            inside = [found[name] for name in self.inputs if isinstance(text, str) and os.path.dirname(name) == text]
            if inside and text not in found:
                found[str(text)] = os.path.dirname(inside[0])
            listed = expand_braces(text) if isinstance(text, str) else []
            if listed and all(name in found for name in listed):
                found[text] = os.path.join(os.path.dirname(found[listed[0]]), os.path.basename(text))
        if self.verb == "database" and self.arguments[0] is not None:
            first = self.arguments[0]
            found[first] = os.path.normpath(os.path.join(folder, first))
        return found


def rerun_command(
    context: typer.Context,
    output: Annotated[str, make_argument("OUTPUT", "A file that texrs wrote, or a folder that one command wrote.")],
    out: Annotated[
        str | None, to_write("out", text="Path for the new result. Default: the result is only compared with OUTPUT.")
    ] = None,
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Make a file that texrs wrote again, from the same inputs, and compare."""
    recipes = read_recipes(output)
    recipe = recipes[0]
    if out is not None and os.path.isdir(output):
        raise InvalidInput(f"--out: only available for one file; {output} is a folder, whose files are only compared")
    running = RUNNING.get()
    if out is not None and not (running and running.force):
        check_same(out, recipe)
    command = context.find_root().command.get_command(context, recipe.verb)  # type: ignore[attr-defined]
    if command is None:
        raise InvalidInput(f"{output}: was made by the command texrs {recipe.verb}, which this version lacks")
    # Repeat the command in a temporary folder.
    names = recipe.find_inputs()
    beside = os.path.dirname(os.path.dirname(os.path.realpath(recipe.path))) if None in recipe.arguments else None
    folder = tempfile.mkdtemp(prefix=name_prefix(), dir=beside)
    token = ORIGINAL.set({place: name for name, place in names.items()})
    try:
        with hush(), put_rows_first() if recipe.rows_first else nullcontext():
            words = recipe.make_command(names, folder) + ([] if count is None else ["--threads", str(count)])
            command.main(words[1:] + ["--quiet"] * quiet, prog_name=recipe.verb, standalone_mode=False, parent=context)
        # Compare all new files with the recorded ones, and keep the requested one.
        made = os.path.join(folder, recipe.file or os.path.basename(output))
        for each in recipes:
            compare(each, os.path.join(folder, each.file) if each.file is not None else made)
        if out is not None:
            with io.atomic(out) as temporary:
                shutil.copyfile(made, temporary)
            if needs_sidecar(Path(made)):
                with io.atomic(name_sidecar(Path(os.path.realpath(out)))) as temporary:
                    shutil.copyfile(name_sidecar(Path(made)), temporary)
            note(f"wrote {out}", quiet=quiet)
    finally:
        ORIGINAL.reset(token)
        shutil.rmtree(folder, ignore_errors=True)


def read_recipes(output: str) -> list[Recipe]:
    """Return the record of a file, or the records of the files in a folder that one command wrote."""
    if not os.path.isdir(output):
        recipe = Recipe.read(output)
        if recipe is None:
            there = os.path.exists(output)
            raise InvalidInput(
                f"{output}: has no record of the command that made it" if there else f"{output}: does not exist"
            )
        return [recipe]
    inside = {entry.path for entry in os.scandir(output) if entry.is_file()}
    # Ignore a file that only contains the record of another file.
    files = sorted(file for file in inside if not (file.endswith(".json") and file.removesuffix(".json") in inside))
    known = [recipe for file in files if (recipe := Recipe.read(file)) is not None and recipe.file is not None]
    if not known:
        raise InvalidInput(f"{output}: contains no file with a record of the command that made it")
    if len({(each.show(), each.output, tuple(each.inputs.items())) for each in known}) > 1:
        raise InvalidInput(f"{output}: contains results of several commands; name one of its files")
    return known


def check_same(path: str, recipe: Recipe) -> None:
    """Check that writing to ``path`` does not replace another file."""
    if os.path.lexists(path) and not (os.path.isfile(path) and os.path.getsize(path) == 0):
        made = io.read_metadata(path).made if os.path.isfile(path) else None
        if made is None or json.loads(made) != json.loads(recipe.text) or not is_unchanged(path, made):
            raise InvalidInput(f"--out: {path} exists and has other contents; pass --force to replace it")


def compare(recipe: Recipe, made: str) -> None:
    """Print whether the new file equals the existing one."""
    now, then = hash_file(made), hash_file(recipe.path)
    again = io.read_metadata(made).made
    if now == then and again is not None and json.loads(again) == json.loads(recipe.text):
        say(f"{recipe.path}: the same bytes, SHA-256 {now}")
        return
    if is_unchanged(made, recipe.text):
        say(f"{recipe.path}: was changed since it was made; its inputs still give the original file, SHA-256 {now}")
        return
    why = f"; it was made by texrs {recipe.version}, this is {__version__}" if recipe.version != __version__ else ""
    raise InvalidInput(
        f"{recipe.path}: its inputs now give a different file (SHA-256 {now}, but {then} for this file){why}"
    )


# --- what a file holds -----------------------------------------------------------------------------------------------


def info_command(
    file: Annotated[str, make_argument("FILE", "Any file that texrs reads or writes, or a folder of maps.")],
) -> None:
    """Print the contents of a file, and how texrs made it."""
    if io.is_store(file):
        say(describe_store(file))
        return
    if os.path.isdir(file):
        for line in describe_folder(file):
            say(line)
        return
    if strip_raw(file) != file:
        say(describe_volume(file, io.read_volume(file)))
        return
    recipe = Recipe.read(file)
    for line in describe_file(file, recipe):
        say(line)
    # Print the metadata of the image.
    notes = io.read_metadata(file)
    if notes.profile is not None:
        say(f"colours: ICC profile of {len(notes.profile)} bytes")
    elif notes.srgb or notes.gamma is not None:
        say(f"colours: {'sRGB' if notes.srgb else f'gamma {notes.gamma:g}'}")
    if notes.density is not None:
        down, across = (d * 0.0254 for d in notes.density)
        say(f"density: {across:.4g} x {down:.4g} pixels per inch")
    if recipe is None:
        return
    say(f"made by texrs {recipe.version}: {recipe.show()}")
    if recipe.rows_first and PLACED_FLAGS & recipe.options.keys():
        say(
            "its places are row,column, because older files did not store the order; texrs rerun reads them in this order"
        )
    for name, sha in recipe.inputs.items():
        say(f"from {name}, SHA-256 {sha}")
    if not is_unchanged(file, recipe.text):
        say("changed since it was made")


def describe_file(file: str, recipe: Recipe | None) -> list[str]:
    """Return lines that describe the contents of a file of any kind."""
    if not os.path.isfile(file):
        io.read(file)
    suffix = Path(file).suffix.lower()
    # Describe files that do not contain arrays.
    if suffix in (".html", ".json") and recipe is not None:
        return [f"{'page' if suffix == '.html' else 'report'}: {os.path.getsize(file)} bytes"]
    if suffix == ".stl":
        count = int.from_bytes(Path(file).read_bytes()[80:84], "little")
        return [f"surface: {count} triangles"]
    if suffix in (".glb", ".mtlx"):
        return [describe_scene(file) if suffix == ".glb" else describe_document(file)]
    if suffix == ".npz":
        for read in (describe_map, describe_elements, describe_arrays):
            try:
                return read(file)
            except FileError:
                continue
    if is_stack(file):
        return describe_material(file, "layer")
    # Other files are images or volumes.
    made_by_solid = recipe is not None and recipe.verb == "solid" and recipe.output == "--out"
    volume = made_by_solid or (Path(file).suffix.lower() == ".npy" and holds_volume(file))
    try:
        image, axes = (io.read_volume(file), 3) if volume else (io.read(file), 2)
    except FileError as error:
        try:
            image, axes = io.read_volume(file), 3
        except FileError:
            raise error from None
    if axes == 3:
        return [describe_volume(file, image)]
    what = "scale map" if recipe is not None and recipe.verb == "scale-map" else "image"
    frames, palette = count_frames(Path(file), detect_kind(Path(file))), io.read_metadata(file).palette
    also = [f"animation: {frames} frames, the first is read"] * (frames > 1)
    also += [] if palette is None else [f"palette: {len(palette) // 4} colours"]
    return [f"{what}: {describe(image, axes)}, {image.min()} to {image.max()}", *also]


def describe_folder(folder: str) -> list[str]:
    """Return lines that describe the maps in a folder, or the volume whose slices it contains."""
    try:
        return describe_material(folder, "map")
    except FileError as error:
        try:
            volume = io.read_volume(folder)
        except FileError as second:
            raise (second if "missing" in str(second) else error) from None
        return [describe_volume(folder, volume)]


def describe_volume(path: str, volume: Array) -> str:
    """Return a line that describes a volume: its sides, its values and its stated spacing."""
    spacing = io.read_spacing(path)
    steps = "" if spacing is None else f", voxels of {' x '.join(f'{s:g}' for s in reversed(spacing))}"
    return f"volume: {describe(volume, 3)}, {volume.min()} to {volume.max()}{steps}"


def describe_store(path: str) -> str:
    """Return a line that describes the array of a Zarr store, with its sides in array order."""
    array, _ = io.read_vectors(path)
    return f"store: {' x '.join(map(str, array.shape))} of {array.dtype}, {array.min()} to {array.max()}"


def describe_material(path: str, what: str) -> list[str]:
    """Return lines that describe the maps of a folder or the layers of a file. Notices name the unused files."""
    shown = Material.read(path)
    first = f"material: {show_sides(shown.shape)}, {len(shown)} {what}{'s'[: len(shown) != 1]}"
    return [first, *(describe_layer(name, each) for name, each in shown.items())]


def describe_scene(file: str) -> str:
    """Return a line that describes a binary glTF file."""
    content = Path(file).read_bytes()
    length = int.from_bytes(content[12:16], "little")
    try:
        if content[:4] != b"glTF":
            raise ValueError
        scene = json.loads(content[20 : 20 + length])
        shapes = ", ".join(node["name"] for node in scene["nodes"] if "mesh" in node)
        pictures = ", ".join(image["name"] for image in scene["images"])
        return f"scene: glTF {scene['asset']['version']}, {shapes}, textures {pictures}"
    except (ValueError, KeyError, TypeError, AttributeError):
        raise FileError(f"{file}: is damaged or not a binary glTF file") from None


def describe_document(file: str) -> str:
    """Return a line that describes a MaterialX document."""
    try:
        root = ElementTree.fromstring(Path(file).read_bytes())
    except ElementTree.ParseError:
        raise FileError(f"{file}: is damaged or not a MaterialX document") from None
    names = [each.get("value", "") for each in root.iter("input") if each.get("type") == "filename"]
    return f"material: MaterialX {root.get('version', '')}, of {', '.join(dict.fromkeys(names))}"


def describe_layer(name: str, each: Map) -> str:
    """Return a text with the name, role, encoding and samples of a map."""
    space = "sRGB" if each.space == "srgb" else each.space
    return (
        f"{name}: {each.role.value}, {space}, {each.channels} channel{'s'[: each.channels != 1]}, {each.pixels.dtype}"
    )


def describe_map(file: str) -> list[str]:
    """Return lines that describe a source map."""
    places = SourceMap.load(file)
    reuse = places.reuse()
    shapes = " and ".join(show_sides(shape) for shape in places.shapes)
    what = "pixels" if places.axes == 2 else "voxels"
    return [
        f"source map: {show_sides(places.shape)}, made from {shapes}",
        f"copied unchanged: {reuse.verbatim:.1%} of the {what}, in {reuse.regions} regions",
        f"largest region: {reuse.largest:.1%} of the example",
    ]


def describe_elements(file: str) -> list[str]:
    """Return lines that describe an analysis of elements."""
    from texrs import elements

    entry = elements.load(file)
    return [f"elements: {len(entry.points)}, {entry.layout}, of an image of {describe(entry.image, 2)}"]


def describe_arrays(file: str) -> list[str]:
    """Return one line for each array of a file. A single array with two or three axes is described as an image."""
    arrays = io.read_headers(file)
    if len(arrays) == 1 or "image" in arrays:
        raise FileError(f"{file}: contains only one array")
    return [f"{name}: {' x '.join(map(str, array.shape or (1,)))}, {array.dtype}" for name, array in arrays.items()]


COMMANDS: dict[str, Callable[..., None]] = {"info": info_command, "rerun": rerun_command}

"""Read a folder of maps by their usual file names, and write it under the same names."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import replace
from io import BytesIO
from pathlib import Path as FilePath
from typing import cast

import numpy as np

from texrs import io
from texrs._alpha import divide, has_alpha, multiply
from texrs._checks import as_choice
from texrs._notices import assume, ignore
from texrs._threads import SideBySide
from texrs._typing import Array, Path
from texrs.errors import FileError, InvalidInput, TexrsError
from texrs.io.files import as_path, find_suffix
from texrs.io.formats import FORMATS, READ, READ_IMAGES, READ_VOLUMES, STORE, WRITTEN_IMAGES, WRITTEN_VOLUMES
from texrs.materials._labels import REASON, holds_labels
from texrs.materials._map import Map, Space, find_space
from texrs.materials._mipmaps import halve
from texrs.materials._roles import Role, as_role
from texrs.materials.conventions import guess_roles, report_guesses
from texrs.materials.converting import choose_dtype, convert
from texrs.source_map.vectors import stores_z

__all__ = ["read_maps", "write_maps"]

DOCUMENTS = (".txt", ".md", ".json", ".html", ".htm", ".pdf", ".csv", ".yaml", ".yml", ".toml", ".url")
"""Suffixes of files that accompany maps but are not maps."""
SYSTEM = ("thumbs.db", "desktop.ini")
"""Files that file managers create, without a leading dot."""
NAMED = 8
"""Maximum number of names that a notice lists."""
PRIMARIES = (0.3127, 0.329, 0.64, 0.33, 0.3, 0.6, 0.15, 0.06)
"""Chromaticities (x, y) of white, red, green and blue of sRGB."""
LOSSY = (".jpg", ".jpeg")
"""Suffixes of formats with lossy compression."""
FULL = 255
"""Value of the third channel in normal maps whose z is not stored."""
MOST = 64
"""Maximum number of maps in a material."""
AT_ONCE = 4
"""Maximum number of files that are written in parallel."""
SMALLER = "mipmaps"
"""Subfolder for mipmaps. They are not in the folder itself, so that all maps there have the same size."""


def read_maps(path: Path | Sequence[Path], roles: dict[str, Role | str], axes: int) -> tuple[dict[str, Map], set[str]]:
    """Return the maps of a folder by the distinctive part of their names, and the maps whose role the caller gives."""
    path, there = list_places(path)
    files, left = list_files(there, axes)
    stems = {name: split_suffix(name)[0] for name in files}
    said: dict[str, Role] = {}
    for name, role in roles.items():
        chosen = [file for file in files if name in (file, stems[file])]
        if not chosen:
            raise InvalidInput(f"roles: must name images in {path} ({', '.join(files) or 'none'}), got {name!r}")
        said |= dict.fromkeys(chosen, as_role(role, f"roles[{name!r}]"))
    # Guess the roles that the caller does not state.
    guessed, why = guess_roles(list(stems.values()))
    found = {name: said.get(name) or guessed.get(stems[name]) for name in files}
    taken = {name: role for name, role in found.items() if role is not None}
    unknown = [name for name, role in found.items() if role is None]
    if not taken:
        left["the name gives no role"] = unknown
        lines = "; ".join(describe_unused(left))
        raise FileError(
            f"{path}: no image has a name that indicates its role, such as albedo.png; give roles"
            f"{f' ({lines})' if lines else ''}"
        )
    if len(taken) > MOST:
        raise FileError(f"{path}: must have at most {MOST} maps, got {len(taken)}")
    maps = {name: read_map(files[name], role, axes) for name, role in taken.items()}
    shape = next(iter(maps.values())).pixels.shape[:axes]
    # A file whose name gives no role can still be recognised as labels from its values.
    labels = {name: pixels for name in unknown if (pixels := read_labels(files[name], shape)) is not None}
    left["the name gives no role"] = [name for name in unknown if name not in labels]
    for line in describe_unused(left):
        ignore(f"{path}: {line}")
    if labels:
        assume(f"{path}: {show_names(list(labels))} read as {REASON}")
    maps |= {name: Map(pixels, Role.LABELS, "linear") for name, pixels in labels.items()}
    # Name the maps after their files, without the common beginning.
    short = shorten([stems[name] for name in maps])
    if len(set(short)) < len(short):
        twice = next(name for name in short if short.count(name) > 1)
        raise FileError(f"{path}: must contain only one file for the map {twice}, got two")
    report_guesses(why, guessed, {stems[name] for name in said})
    named = {key: replace(each, file=stems[name]) for key, (name, each) in zip(short, maps.items(), strict=True)}
    return named, {key for key, name in zip(short, maps, strict=True) if name in said}


def list_files(places: Iterable[FilePath], axes: int) -> tuple[dict[str, FilePath], dict[str, list[str]]]:
    """Return the files that can be maps, by name, and the names of all other files, by the reason."""
    files: dict[str, FilePath] = {}
    formats, inner = list[str](), list[str]()
    known = READ_IMAGES if axes == 2 else READ_VOLUMES
    for place in sorted(places):
        name, lower = place.name, place.name.lower()
        if name.startswith(".") or lower in SYSTEM or lower.endswith(DOCUMENTS):
            continue
        if place.is_dir() and not io.is_store(place):
            own = name == SMALLER or (place / "report.json").exists()
            if not own and any(split_suffix(f)[1] for _, _, several in os.walk(place) for f in several):
                inner.append(name)
        elif place.is_file() and split_suffix(name, known)[1]:
            files[name] = place
        else:
            formats.append(name)
    what = "maps" if axes == 2 else "maps of volumes"
    return files, {
        f"{what} are not read from files of this format": formats,
        f"{what} are not read from subfolders": inner,
    }


def split_suffix(name: str, known: Sequence[str] = READ) -> tuple[str, str]:
    """Return the name of a file without its suffix, and the suffix, or "" if the suffix is unknown."""
    suffix = max((s for s in known if name.lower().endswith(s)), key=len, default="")
    return name[: len(name) - len(suffix)], suffix


def show_names(names: Sequence[str]) -> str:
    """Return up to eight names as text, followed by the number of further names."""
    shown = ", ".join(names[:NAMED])
    return shown if len(names) <= NAMED else f"{shown} and {len(names) - NAMED} more"


def read_labels(file: FilePath, shape: tuple[int, ...] | None = None) -> Array | None:
    """Return the labels in a file whose name gives no role, or None if its values are not labels of this shape."""
    form = FORMATS.get(find_suffix(file).lower())
    if form is None or not any(dtype.kind == "u" for dtype in form.dtypes):
        return None
    axes = 2 if shape is None else len(shape)
    with suppress(TexrsError):
        pixels = (io.read if axes == 2 else io.read_volume)(file)
        if shape in (None, pixels.shape[:axes]) and holds_labels(pixels, axes):
            return pixels
    return None


def describe_unused(left: Mapping[str, Sequence[str]]) -> list[str]:
    """Return a sentence for each reason why files are not used."""
    return [f"{show_names(names)} not used: {reason}" for reason, names in left.items() if names]


def read_map(file: FilePath, role: Role, axes: int) -> Map:
    """Read a map from a file. Colours are sRGB or linear as the file states, or else as usual for the dtype."""
    pixels = (io.read if axes == 2 else io.read_volume)(file)
    space = find_space(role, pixels.dtype)
    if role.coloured:
        notes = io.read_metadata(file)
        if space == "srgb" and notes.gamma == 1 and not notes.srgb:
            space = "linear"
        report_colours(file, notes, space)
        if file.suffix.lower() == ".exr" and has_alpha(pixels):
            pixels = divide(pixels, file.name)
    elif role in (Role.NORMAL, Role.NORMAL_DX) and file.suffix.lower() in LOSSY and pixels.ndim == axes + 1 == 3:
        pixels = restore_z(file, pixels)
    return Map(pixels, role, space)


def restore_z(file: FilePath, pixels: Array) -> Array:
    """Recompute z of normals from x and y, if the vectors have unit length apart from JPEG artefacts."""
    if pixels.shape[-1] != 3 or pixels.dtype != np.uint8 or stores_z([pixels]) or np.median(pixels[..., 2]) >= FULL:
        return pixels
    vectors = pixels / np.float32(127.5) - 1
    low, middle, high = np.percentile(np.linalg.norm(vectors, axis=-1), (5, 50, 95))
    if low < 0.75 or high > 1.25 or abs(middle - 1) > 0.05:
        return pixels
    assume(f"{file.name}: z of the normals is computed from x and y, because JPEG has changed it")
    z = np.sqrt(np.maximum(1 - (vectors[..., :2] ** 2).sum(axis=-1), 0))
    return np.dstack([pixels[..., :2], np.rint((z + 1) * 127.5).astype(np.uint8)])


def report_colours(file: Path, notes: io.Metadata, space: Space) -> None:
    """Report the colour space that a file states, if it is not sRGB."""
    stated = []
    if notes.profile is not None and (title := name_profile(notes.profile)) is not None:
        stated.append(f"the ICC profile {title!r}")
    if notes.primaries is not None and np.abs(np.subtract(notes.primaries, PRIMARIES)).max() > 0.01:
        stated.append(f"the primaries {', '.join(f'{n:.3g}' for n in notes.primaries[2:])}")
    if space == "srgb" and notes.gamma is not None and abs(notes.gamma - 1 / 2.2) > 0.01:
        stated.append(f"the gamma {notes.gamma:.3g}")
    if stated and not notes.srgb:
        verb = "are" if len(stated) > 1 or "primaries" in stated[0] else "is"
        ignore(f"{file}: {' and '.join(stated)} {verb} not used, because colours of maps are read and written as sRGB")


def name_profile(profile: bytes) -> str | None:
    """Return the name of an ICC profile; None if it is sRGB."""
    from PIL import ImageCms

    title = "unknown"
    # Ignore a damaged profile, because only the notice contains its name.
    with suppress(OSError, ImageCms.PyCMSError):
        title = " ".join(ImageCms.getProfileDescription(ImageCms.ImageCmsProfile(BytesIO(profile))).split())
    return None if "srgb" in title.lower() else title


def list_places(path: Path | Sequence[Path]) -> tuple[Path, list[FilePath]]:
    """Return the folder and its files. ``path`` is a folder, or a list of files in one folder."""
    if not isinstance(path, list | tuple):
        folder = as_path(cast(Path, path))
        if not folder.is_dir():
            raise FileError(f"{path}: must be a folder of maps")
        return cast(Path, path), list(folder.iterdir())
    several = [as_path(each) for each in path]
    if not several or len({each.parent for each in several}) > 1:
        raise InvalidInput(f"path: must be files in one folder, got {', '.join(map(str, several)) or 'an empty list'}")
    for each in several:
        if not each.is_file():
            raise FileError(f"{each}: does not exist")
    return several[0].parent, several


def shorten(names: list[str]) -> list[str]:
    """Remove the common beginning of names, up to a word boundary.

    Examples
    --------
    >>> shorten(["rock_2k_albedo", "rock_2k_nor_gl"]), shorten(["albedo", "ao"])
    (['albedo', 'nor_gl'], ['albedo', 'ao'])

    """
    if len(names) < 2:
        return names
    short, long_ = min(names), max(names)
    common = short[: next((i for i, (a, b) in enumerate(zip(short, long_, strict=False)) if a != b), len(short))]
    while common and common[-1] not in "_-. ":
        common = common[:-1]
    return [name[len(common) :] for name in names]


def write_maps(
    maps: Mapping[str, Map],
    folder: Path,
    *,
    axes: int = 2,
    depth: int | None = None,
    suffix: str | None = None,
    mipmaps: bool = False,
) -> list[FilePath]:
    """Write each map under its name. Files are renamed to their final names only after all are written."""
    place = as_path(folder)
    smaller = place / SMALLER
    for needed in (place, smaller) if mipmaps else (place,):
        if needed.exists() and not needed.is_dir():
            raise FileError(f"{needed}: must be a folder")
    if suffix is not None:
        known = WRITTEN_IMAGES if axes == 2 else (*WRITTEN_VOLUMES, STORE)
        as_choice(suffix.lower() if isinstance(suffix, str) else suffix, "suffix", known)
    endings = {name: suffix or choose_suffix(each, depth, axes) for name, each in maps.items()}
    write = io.write if axes == 2 else io.write_volume
    files: list[FilePath] = []
    small: list[FilePath] = []
    (smaller if mipmaps else place).mkdir(parents=True, exist_ok=True)
    with ExitStack() as stack:
        work: list[tuple[FilePath, str, Map]] = []
        for name, each in maps.items():
            stem = each.file or name
            files.append(place / f"{stem}{endings[name]}")
            work.append((stack.enter_context(io.atomic(files[-1])), name, each))
            for level, less in enumerate(halve(convert(name, each, depth, axes), axes) if mipmaps else (), 1):
                small.append(smaller / f"{stem}.{level}{endings[name]}")
                work.append((stack.enter_context(io.atomic(small[-1])), name, less))
        with SideBySide(AT_ONCE) as beside:
            beside.do(
                lambda each, _: write(each[0], prepare(each[1], convert(each[1], each[2], depth, axes), each[0])), work
            )
    return files + small


def prepare(name: str, each: Map, file: FilePath) -> Array:
    """Return the values as the format stores them: in EXR files, colours are multiplied by alpha."""
    multiplied = file.suffix.lower() == ".exr" and each.role.coloured and has_alpha(each.pixels)
    return multiply(each.pixels, name) if multiplied else each.pixels


def choose_suffix(each: Map, depth: int | None, axes: int = 2) -> str:
    """Return the suffix of a format that stores a map exactly: PNG if possible, else EXR or TIFF."""
    shape, dtype = each.pixels.shape, choose_dtype(each.pixels.dtype, depth)
    if axes == 3 or (len(shape) == 3 and shape[-1] > 4):
        return ".tif"
    if dtype in (np.bool_, np.uint8, np.uint16):
        return ".png"
    return ".exr" if dtype in (np.float16, np.float32) else ".tif"

"""Folders of maps: read by the usual names, written under the same ones."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path as FilePath

import numpy as np

from texrs import io
from texrs._arrays import to_unit
from texrs._checks import as_instance
from texrs._notices import ignore
from texrs._threads import SideBySide
from texrs._typing import Array, Path
from texrs.errors import FileError, InvalidInput
from texrs.io._files import as_path
from texrs.io._formats import READ
from texrs.materials._map import Map
from texrs.materials._mipmaps import halve
from texrs.materials._roles import Role, as_role, guess_role

__all__ = ["read_maps", "write_maps"]

SUFFIXES = READ
"""Of files that may be maps."""
MOST = 64
"""Maps that a material may have."""
AT_ONCE = 4
"""Files that are written at once."""
SMALLER = "mipmaps"
"""Folder of what is not a map of the material itself, so that reading finds maps of one size."""


def read_maps(path: Path, roles: dict[str, Role | str], axes: int) -> tuple[dict[str, Array], dict[str, Role]]:
    """Return the maps of a folder and their roles, by the names that they have without what is common to all."""
    folder = as_path(path)
    if not folder.is_dir():
        raise FileError(f"{path}: is not a folder of maps")
    files = {f.name: f for f in sorted(folder.iterdir()) if f.is_file() and f.name.lower().endswith(SUFFIXES)}
    stems = {name: _cut_suffix(name) for name in files}
    said: dict[str, Role] = {}
    for name, role in roles.items():
        chosen = [file for file in files if name in (file, stems[file])]
        if not chosen:
            raise InvalidInput(f"roles: there is no picture {name!r} in {path}; there are {', '.join(files) or 'none'}")
        said |= dict.fromkeys(chosen, as_role(role, f"roles[{name!r}]"))
    found = {name: said.get(name) or guess_role(stems[name]) for name in files}
    left = [name for name, role in found.items() if role is None]
    taken = {name: role for name, role in found.items() if role is not None}
    if not taken:
        raise FileError(f"{path}: no picture has a name that says what it is for, such as albedo.png; say it by roles")
    if len(taken) > MOST:
        raise FileError(f"{path}: has {len(taken)} maps, up to {MOST} are allowed")
    if left:
        ignore(f"{path}: {', '.join(left)} not used: no role is known for the name")
    short = shorten([stems[name] for name in taken])
    if len(set(short)) < len(short):
        twice = next(name for name in short if short.count(name) > 1)
        raise FileError(f"{path}: two files are the map {twice}; a material has one of each")
    read = io.read if axes == 2 else io.read_volume
    maps = {key: read(files[name]) for key, name in zip(short, taken, strict=True)}
    return maps, dict(zip(short, taken.values(), strict=True))


def _cut_suffix(name: str) -> str:
    """Return a file's name without its suffix, of which some have two parts."""
    suffix = max((s for s in SUFFIXES if name.lower().endswith(s)), key=len)
    return name[: -len(suffix)]


def shorten(names: list[str]) -> list[str]:
    """Return names without what all of them begin with, up to a place where words part.

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
    """Write each map under its name; all files take their names when all are written."""
    place = as_path(folder)
    smaller = place / SMALLER
    for needed in (place, smaller) if mipmaps else (place,):
        if needed.exists() and not needed.is_dir():
            raise FileError(f"{needed}: is not a folder")
    if suffix is not None:
        as_instance(suffix, "suffix", str)
    endings = {name: suffix or choose_suffix(each, depth) for name, each in maps.items()}
    write = io.write if axes == 2 else io.write_volume
    files: list[FilePath] = []
    small: list[FilePath] = []
    (smaller if mipmaps else place).mkdir(parents=True, exist_ok=True)
    with ExitStack() as stack:
        work: list[tuple[FilePath, Map]] = []
        for name, each in maps.items():
            files.append(place / f"{name}{endings[name]}")
            work.append((stack.enter_context(io.atomic(files[-1])), each))
            for level, less in enumerate(halve(each, axes) if mipmaps else (), 1):
                small.append(smaller / f"{name}.{level}{endings[name]}")
                work.append((stack.enter_context(io.atomic(small[-1])), less))
        with SideBySide(AT_ONCE) as beside:
            beside.do(lambda each, _: write(each[0], convert(each[1].pixels, depth)), work)
    return files + small


def choose_suffix(each: Map, depth: int | None) -> str:
    """Return the format that keeps a map as it is: PNG for 8 and 16 bit of up to four channels, TIFF or EXR for the rest."""
    pixels = convert(each.pixels[:1], depth)
    if pixels.ndim > 3 or (pixels.ndim == 3 and pixels.shape[-1] > 4):
        return ".tif"
    if pixels.dtype in (np.bool_, np.uint8, np.uint16):
        return ".png"
    return ".exr" if pixels.dtype in (np.float16, np.float32) else ".tif"


def convert(pixels: Array, depth: int | None) -> Array:
    """Return values in so many bits: integers of 8 or 16, floats of 32; as they are where nothing is asked."""
    if depth is None or pixels.dtype == np.bool_:
        return pixels
    if depth == 32:
        return pixels if pixels.dtype.kind == "f" and pixels.itemsize <= 4 else to_unit(pixels)
    kind = np.dtype(f"u{depth // 8}")
    if pixels.dtype == kind:
        return pixels
    return np.rint(to_unit(pixels) * np.float64(np.iinfo(kind).max)).astype(kind)

"""Read the values of options from files."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from texrs import io, samples
from texrs._arrays import as_image
from texrs._conversion import report_nodata
from texrs._masks import mark
from texrs._notices import assume, ignore
from texrs._typing import Array, Floats
from texrs.cli._outputs import SAMPLE, name_arguments
from texrs.cli._places import turn_centre
from texrs.cli._provenance import expand_braces
from texrs.cli._tails import make_mask
from texrs.cli._texts import PLANE, About, parse_numbers, read_json
from texrs.errors import FileError, InvalidInput
from texrs.io.files import check_file

VOLUMES = "a TIFF of several slices, .npy, .npz, .vti, NRRD, NIfTI or Zarr"
"""File formats of volumes, as errors list them."""


MOST_CHANNELS = 4
"""Maximum length of a third axis that is read as channels without reporting it."""


def read_picture(text: str, *, finite: bool = True) -> Array:
    """Read an image file, or generate the built-in example of ``sample:NAME``."""
    image: Array = samples.load(text.removeprefix(SAMPLE)).image if text.startswith(SAMPLE) else io.read(text)
    if finite:
        as_image(image, text)
        report_nodata(text, image)
    if image.ndim == 3 and image.shape[2] > MOST_CHANNELS:
        assume(f"{text}: {' x '.join(map(str, image.shape))} is read as an image with {image.shape[2]} channels")
    return image


def match_alpha(image: Any, like: Array | None) -> Any:
    """Add an opaque alpha channel to an image, or remove an opaque one, so that the image matches another image."""
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


def read_example(text: str, about: About, *, finite: bool = True, single: bool = True) -> Any:
    """Read an image or a material: a folder of maps, an EXR file of several layers, or a single map by its name."""
    from texrs.cli._stacks import is_stack
    from texrs.materials import Material
    from texrs.materials.single import read_single

    if text.startswith(SAMPLE) or not is_stack(text):
        alone = read_single(text) if single and os.path.isfile(text) else None
        return read_picture(text, finite=finite) if alone is None else alone

    with name_arguments(roles="--role", maps=text):
        return Material.read(expand_braces(text) or text, roles=about.roles)


def is_solid(sample: str) -> bool:
    """Return True if a built-in example is a volume."""
    return sample.endswith("solid") or sample in ("particles", "stripes")


def find_image(path: str) -> tuple[int, ...] | None:
    """Return the shape of an image file, or None if the file is not an image."""
    with suppress(FileError):
        return tuple(io.read(path).shape)
    return None


def read_volume(text: str, *, finite: bool = True) -> Array:
    """Read a volume file, or generate the built-in volume of ``sample:NAME``."""
    if text.startswith(SAMPLE):
        volume: Array = samples.load(text.removeprefix(SAMPLE)).image
        if volume.ndim != 4:
            known = ", ".join(n for n in samples.names() if is_solid(n))
            raise InvalidInput(f"{text}: must be a volume, got an image; built-in volumes are {known}")
    else:
        try:
            volume = io.read_volume(text)
        except FileError:
            if (shape := find_image(text)) is None:
                raise
            message = f"{text}: is an image of {shape[1]} x {shape[0]}, but a volume is needed: {VOLUMES}"
            raise FileError(f"{message}. Use texrs synthesize for images") from None
    if finite:
        as_image(volume, text, axes=3)
    return volume


def read_array(path: str, axes: int) -> Array:
    """Read an image or a volume whose values can be of any kind."""
    array: Array = io.read_volume(path) if axes == 3 else io.read(path)
    return array


def fit_volume(given: Array, path: str, about: About) -> Array:
    """Resample a volume to the voxels of the result, if both have a voxel spacing and the spacings differ.

    Both volumes begin at the same corner. The nearest voxel is used, so that values do not change.
    """
    stated = read_stated_spacing(path) if about.axes == 3 and about.spacing is not None and about.size else None
    if stated is None or about.spacing is None or given.shape[:3] == about.size or np.allclose(stated, about.spacing):
        return given
    for axis, (side, mine, theirs) in enumerate(zip(about.size, about.spacing, stated, strict=True)):
        # Allow a difference in extent of less than a voxel, which rounding can cause.
        if abs(side * mine - given.shape[axis] * theirs) > max(mine, theirs):
            spans = [
                show_extent(each)
                for each in (zip(given.shape, stated, strict=False), zip(about.size, about.spacing, strict=True))
            ]
            raise InvalidInput(f"{path}: must have the extent of the result, {spans[1]}, got {spans[0]}")
        at = np.minimum(((np.arange(side) + 0.5) * mine / theirs).astype(np.intp), given.shape[axis] - 1)
        given = given.take(at, axis=axis)
    assume(f"{path}: resampled by its spacing, because its voxels and the voxels of the result differ in size")
    return given


def show_extent(sides: Iterable[tuple[int, float]]) -> str:
    """Return a text with the extent of the voxels along x, y and z, in units of the spacing."""
    return " x ".join(f"{count * step:g}" for count, step in reversed(list(sides)))


def read_values(path: str, about: About) -> Array:
    """Read values of the same kind as the exemplar. An axis for a single channel is optional."""
    given = fit_volume(read_array(path, about.axes), path, about)
    return given[..., np.newaxis] if about.like is not None and given.ndim < about.like.ndim else given


def read_numbers(path: str, about: About) -> Array:
    """Read a number for each point. Several channels are averaged."""
    given = fit_volume(read_array(path, about.axes), path, about)
    return given if given.ndim == about.axes else np.asarray(given.mean(axis=-1))


def read_density(text: str, about: About) -> Any:
    """Read numbers from an array, or shares from an image, where the range of an integer dtype becomes 0 to 1."""
    if re.fullmatch(r"[-+.:0-9eE]+", text.strip()):
        return parse_numbers(text, about.option, "numbers such as 0.3 or 0.3:0.1, or a file")
    given = np.asarray(read_array(text, about.axes))
    most = 1.0 if given.dtype.kind == "f" else float(np.iinfo(given.dtype).max)
    return np.asarray((given if given.ndim == about.axes else given.mean(axis=-1)) / most, np.float64)


def read_mask(path: str, axes: int = 2) -> Array:
    """Read a mask according to `texrs.Mask` and the words after its name. Report the marked share."""
    mask = make_mask(path)
    path = name_file(mask.marks)
    marked = mark(mask, path, ("planes", "rows", "columns")[3 - axes :])
    if not marked.any():
        raise InvalidInput(f"{path}: marks nothing; marked pixels of a mask must be white")
    assume(f"{os.path.basename(path)}: read as a mask that marks {100 * float(marked.mean()):.3g} % of the image")
    return marked


def name_file(path: str) -> str:
    """Return the name of a file that the function reads later, or None if the name is not given."""
    if not io.is_store(path):
        check_file(Path(path))
    return path


def read_hole(text: str, about: About) -> Any:
    """Return a number, or the name of a file as text."""
    return float(text) if is_number(text) else name_file(text)


def is_number(text: str) -> bool:
    """Return True if a text is a number and not the name of a file."""
    try:
        float(text)
    except ValueError:
        return False
    return not os.path.exists(text)


def read_scale_map(path: str, encoding: str = "log2") -> Floats:
    """Read a scale map, with its kind if the file states it. Floats are scales, and grey levels are decoded to scales."""
    from texrs import scale_maps
    from texrs.scale_maps.kinds import keep_kind, parse_kind

    values, kind = io.read(path), parse_kind(io.read_description(path))
    if values.dtype.kind == "f":
        if values.ndim == 3 and (values != values[..., :1]).any():
            ignore(f"{path}: only the first of {values.shape[2]} channels is used, because a scale map has one channel")
        scale = np.asarray(values if values.ndim == 2 else values[..., 0], np.float32)
    else:
        levels: Any = encoding
        with name_arguments(image=path):
            scale = scale_maps.decode(values, levels)
    with name_arguments(scale=path):
        return keep_kind(scale, kind)


def read_target(text: str) -> Any:
    """Read the target of an output: a scale map, normals, texture coordinates or Jacobians.

    Words that describe a plane are returned unchanged.
    """
    if text.lower().startswith(PLANE):
        return text
    try:
        values = io.read(text)
    except FileError:
        if Path(text).suffix.lower() not in (".npy", ".npz"):
            raise
        # The file has four axes, so read it as Jacobians.
        return io.read_volume(text)
    if values.ndim == 3 and values.shape[2] == 2:
        return values
    if values.ndim == 2 or values.shape[2] < 3 or not (values[..., :3] != values[..., :1]).any():
        return read_scale_map(text)
    assume(f"{text}: read as normals of a surface")
    if values.shape[2] > 3:
        ignore(f"{text}: {values.shape[2] - 3} of {values.shape[2]} channels not used, because normals have three")
    return values[..., :3]


def read_field(text: str, about: About) -> Any:
    """Return a field for an output of a given size, from words, or from frames or directions in a file."""
    from texrs import fields

    with name_arguments(field=about.option or "--field"):
        axes, size = len(about.size) or about.axes, about.size or None
        return fields.as_field(turn_centre(text), axes, size, spacing=about.spacing)


def read_stated_spacing(text: str | None) -> tuple[float, float, float] | None:
    """Return the voxel spacing of a file, or None if the file does not state it."""
    return None if text is None or text.startswith(SAMPLE) else io.read_spacing(text)


def read_direction(text: str, about: About) -> Any:
    """Read angles in degrees (a number or an image of numbers), or a field from words or from frames in a file."""
    try:
        return float(text)
    except ValueError:
        pass
    suffix = Path(text).suffix.lower()
    return io.read(text) if suffix and suffix != ".npz" and "=" not in text else read_field(text, about)


def read_entry(text: str, about: About, *, single: bool = True) -> Any:
    """Read an analysis of elements, or an image, which the command will analyse."""
    from texrs import elements

    return elements.load(text) if text.lower().endswith(".npz") else read_example(text, about, single=single)


def read_layout(text: str, about: About) -> Any:
    """Read an analysis or an image like `read_entry`, or create a layout from JSON.

    The labels in the JSON can be the name of an image.
    """
    if not text.lower().endswith(".json") and not text.lstrip().startswith("{"):
        return read_entry(text, about)
    from texrs import layouts

    said = read_json(text, about.option)
    if isinstance(said, dict) and isinstance(said.get("labels"), str):
        said = {**said, "labels": io.read(said["labels"])}
    return layouts.from_dict(said)


def read_labels(path: str, about: About) -> Array:
    """Read the labels of elements: an image of labels, or the labels of an entry."""
    from texrs import elements

    return elements.load(path).labels if path.lower().endswith(".npz") else io.read(path)

"""The command that makes scale maps: ``texrs scale-map``."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path
from typing import Annotated, Any, Literal, cast

import numpy as np
import typer

from texrs import io, scale_maps
from texrs._threads import threads
from texrs._typing import Array, Floats
from texrs.cli import _files
from texrs.cli._console import Out, Quiet, Stages, Threads, note
from texrs.cli._files import named
from texrs.cli._splice import read_edit
from texrs.errors import InvalidInput
from texrs.synthesis import preview

__all__ = ["read_scale", "scale_map_command"]

FLOATS = (".npy", ".npz", ".tif", ".tiff", ".exr")
"""Formats that keep the scales themselves; pictures of 8 bits keep them encoded."""


def scale_map_command(
    image: Annotated[
        str, typer.Argument(metavar="IMAGE", help="The texture: an image file, or sample:NAME.", show_default=False)
    ],
    out: Out,
    mask: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="Measure in a mask of the elements: what is not black.", show_default=False),
    ] = None,
    auto: Annotated[bool, typer.Option("--auto", help="Measure in a mask that is found in the image.")] = False,
    slant: Annotated[
        float | None,
        typer.Option(
            metavar="DEGREES", help="The map of a plane seen aslant: 0 from the front, up to 85.", show_default=False
        ),
    ] = None,
    scale: Annotated[
        str | None,
        typer.Option(metavar="MAP", help="A map made before, to edit or to bring to another size.", show_default=False),
    ] = None,
    tilt: Annotated[
        float | None,
        typer.Option(
            metavar="DEGREES",
            help="With --slant: where depth grows, counter-clockwise from the right; 90 is up.",
            show_default="90",
        ),
    ] = None,
    fov: Annotated[
        float | None,
        typer.Option(
            metavar="DEGREES", help="With --slant: the angle that the longer side spans, if known.", show_default=False
        ),
    ] = None,
    measure: Annotated[
        str | None,
        typer.Option(
            metavar="KIND",
            help="Of masks: boundary, skeleton, count, or area (the published one to the letter).",
            show_default="boundary",
        ),
    ] = None,
    window: Annotated[
        int | None,
        typer.Option(help="Of masks: side of the windows, in pixels.", show_default="by the spacing of the features"),
    ] = None,
    trend: Annotated[
        str | None,
        typer.Option(
            metavar="KIND",
            help="Of masks: what the map is brought to: none, plane, linear or quadratic.",
            show_default="none",
        ),
    ] = None,
    hole: Annotated[
        str | None,
        typer.Option(
            metavar="HOLE",
            help="Of masks: image of the same size; what is not black is no texture, and continued.",
            show_default=False,
        ),
    ] = None,
    edit: Annotated[
        str | None,
        typer.Option(
            metavar="WORDS|JSON|FILE.json",
            help="What is done to the map: a list of steps, as the report's edit has it.",
            show_default=False,
        ),
    ] = None,
    size: Annotated[
        str | None, typer.Option(metavar="ROWSxCOLS", help="Size of the map.", show_default="that of the image")
    ] = None,
    mode: Annotated[
        str, typer.Option(metavar="MODE", help="With --size: stretch the map, or extend it around the image.")
    ] = "stretch",
    encoding: Annotated[
        str | None,
        typer.Option(
            metavar="KIND",
            help="Grey levels of maps in 8 bits: log2 (128 + 64 log2 S) or paper (128 S).",
            show_default="log2 for formats without floats",
        ),
    ] = None,
    stages: Stages = None,
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Make a scale map: how large the elements of a picture are at each place."""
    start = time.monotonic()
    sides = _files.parse_size(size)
    sources = {"mask": mask, "auto": auto or None, "slant": slant, "scale": scale}
    of_angles = {"tilt": tilt, "fov": fov}
    of_masks = {"measure": measure, "window": window, "trend": trend, "hole": hole}
    _check_source(sources, of_angles, of_masks)
    for name, value, allowed in (
        ("mode", mode, ("stretch", "extend")),
        ("encoding", encoding, (None, "log2", "paper")),
    ):
        if value not in allowed:
            raise InvalidInput(f"--{name}: allowed are {allowed[-2]} and {allowed[-1]}; got {value!r}")
    if stages is not None:
        _files.check_folder(stages)
    steps = None if edit is None else read_edit(edit)
    pixels = _files.read_exemplar(image)
    levels = encoding or ("log2" if Path(out).suffix.lower() not in FLOATS else None)
    _files.check_output(out, np.ones(1, np.uint8 if levels else np.float32)[0], sides or pixels.shape[:2])
    shown: dict[str, Array] = {}
    names = {
        "image": image,
        "mask": mask or image,
        "scale": scale,
        "known": hole,
        "steps": "--edit",
        "count": "--threads",
    }
    with named(**{key: str(name) for key, name in names.items()}), threads(count):
        if scale is not None:
            made = read_scale(scale, encoding or "log2")
        elif slant is not None:
            made = scale_maps.from_angles(pixels.shape[:2], slant, 90 if tilt is None else tilt, fov=fov)
        else:
            known = None if hole is None else _same_size(_files.read_hole(hole), pixels, "--hole") == 0
            drawn = _mask(pixels, mask, known)
            options: dict[str, Any] = {"measure": measure or "boundary", "window": window, "trend": trend or "none"}
            made = scale_maps.from_mask(drawn, known=known, **options)
            shown["mask"] = drawn != 0
        shown["scale"] = scale_maps.picture(made)
        if steps is not None:
            made = scale_maps.edit(made, steps)
            shown["edited"] = scale_maps.picture(made)
        if sides is not None:
            made = scale_maps.resample(made, sides, cast(Literal["stretch", "extend"], mode))
            shown["resampled"] = scale_maps.picture(made)
    least, largest = float(made.min()), float(made.max())
    with _files.output(out) as temporary:
        io.write(temporary, made if levels is None else scale_maps.encode(made, cast(scale_maps.Encoding, levels)))
        if stages is not None:
            asked = {**sources, **of_angles, **of_masks, "edit": steps, "mode": mode, "encoding": levels}
            report = {name: value for name, value in asked.items() if value is not None}
            _save(shown, {**report, "size": made.shape, "least": least, "largest": largest}, stages)
    extent, seconds = " x ".join(map(str, made.shape)), time.monotonic() - start
    note(f"wrote {out}: {extent}, scales {least:.3g} to {largest:.3g}, in {seconds:.1f} s", quiet=quiet)


def read_scale(path: str, encoding: str = "log2") -> Floats:
    """Read a scale map: floats are scales, grey levels are decoded."""
    values = io.read(path)
    if values.dtype.kind == "f":
        return np.asarray(values if values.ndim == 2 else values[..., 0], np.float32)
    with named(image=path):
        return scale_maps.decode(values, cast(scale_maps.Encoding, encoding))


def _check_source(given: dict[str, Any], of_angles: dict[str, Any], of_masks: dict[str, Any]) -> None:
    """Check that the map comes from one thing, and that every option belongs to it."""
    options = [name for name, value in given.items() if value is not None]
    if len(options) != 1:
        found = " and ".join(f"--{name}" for name in options) or "none of them"
        raise InvalidInput(f"scale-map: needs one of --mask, --auto, --slant and --scale, got {found}")
    for others, wanted in ((of_angles, ("slant",)), (of_masks, ("mask", "auto"))):
        for name, value in others.items():
            if value is not None and options[0] not in wanted:
                raise InvalidInput(f"--{name}: needs {' or '.join(f'--{w}' for w in wanted)}, got --{options[0]}")


def _mask(pixels: Array, mask: str | None, known: Array | None) -> Array:
    if mask is None:
        return scale_maps.auto_mask(pixels, known=known)
    return _same_size(_files.read_hole(mask), pixels, "--mask")


def _same_size(mask: Array, pixels: Array, option: str) -> Array:
    if mask.shape[:2] != pixels.shape[:2]:
        sizes = (" x ".join(map(str, a.shape[:2])) for a in (pixels, mask))
        raise InvalidInput("{}: needs the size of the image, {}; got {}".format(option, *sizes))
    return mask


def _save(shown: dict[str, Array], report: dict[str, Any], folder: str) -> None:
    Path(folder).mkdir(parents=True, exist_ok=True)
    for number, (name, picture) in enumerate(shown.items(), start=1):
        io.write(os.path.join(folder, f"{number:02d}-{name}.png"), preview(picture))
    with io.atomic(os.path.join(folder, "report.json")) as temporary:
        temporary.write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")

"""The command that writes scale maps: ``texrs scale-map``."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from texrs import io, scale_maps
from texrs._show import preview
from texrs._threads import threads
from texrs._typing import Array
from texrs.cli import _outputs
from texrs.cli._console import note
from texrs.cli._kinds import WORDS
from texrs.cli._options import Options, check_needed, make_choice, take_options
from texrs.cli._outputs import Quiet, Threads, make_argument, make_option, name_arguments, to_write
from texrs.cli._readers import read_mask, read_picture, read_scale_map
from texrs.errors import InvalidInput
from texrs.scale_maps.kinds import describe_kind, find_kind

FLOATS = (".npy", ".npz", ".tif", ".tiff", ".exr")
"""Formats that store scales as floats. Images of 8 bits store scales encoded as grey levels."""
ANGLES = Options(scale_maps.from_angles, only=("slant", "tilt", "fov"), optional={"slant": "", "tilt": "90"})
MASKS = Options(scale_maps.from_mask, only=("measure", "window", "trend", "foreshortened"))
FOUND = Options(scale_maps.auto_mask, only=("min_feature_size",))
EDITED = Options(scale_maps.edit, only=("steps",), names={"steps": "edit"}, optional={"steps": ""})
RESIZED = Options(
    scale_maps.resample,
    only=("size", "mode"),
    kinds={"mode": make_choice(["stretch", "extend"])},
    optional={"size": "that of the image"},
)
ENCODED = Options(scale_maps.encode, only=("encoding",), optional={"encoding": "log2 for formats without floats"})


@take_options(ANGLES, MASKS, FOUND, EDITED, RESIZED, ENCODED)
def scale_map_command(
    image: Annotated[str, make_argument("IMAGE", "The texture: an image file, or sample:NAME.")],
    out: Annotated[str, to_write("out")],
    given: dict[str, Any],
    mask: Annotated[str | None, make_option("FILE", f"Mask of the elements to measure. {WORDS}")] = None,
    auto: Annotated[bool, typer.Option("--auto", help="Find the mask of the elements in the image.")] = False,
    scale_map: Annotated[str | None, make_option("FILE", "Existing scale map to edit or resize.")] = None,
    hole: Annotated[
        str | None,
        make_option(
            "FILE",
            f"Mask of the part without texture, into which the map is continued. Requires --mask or --auto. {WORDS}",
        ),
    ] = None,
    stages: Annotated[str | None, to_write("stages")] = None,
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Make a scale map: the apparent size of the elements at each pixel of an image."""
    start = time.monotonic()
    origins = {"--mask": mask, "--auto": auto or None, "--slant": given["slant"], "--scale-map": scale_map}
    chosen = [option for option, value in origins.items() if value is not None]
    if len(chosen) != 1:
        found = " and ".join(chosen) or "none"
        raise InvalidInput(f"{', '.join(origins)}: exactly one of these must be given, got {found}")
    check_needed(given, {"--slant": ANGLES, "--mask": MASKS, "--auto": (*MASKS, *FOUND)}, chosen[0])
    if hole is not None and chosen[0] not in ("--mask", "--auto"):
        raise InvalidInput(f"--hole: must be used with --mask or --auto, got {chosen[0]}")
    asked = {
        key: value
        for each in (ANGLES, MASKS, FOUND, EDITED, RESIZED, ENCODED)
        for key, value in each.read(given).items()
    }
    if stages is not None:
        _outputs.check_stages(stages)
    # Read the image, and check that the map can be written.
    pixels = read_picture(image)
    encoding = given["encoding"]
    levels: Any = encoding or ("log2" if Path(out).suffix.lower() not in FLOATS else None)
    sides = asked.get(("size",), pixels.shape[:2])
    _outputs.check_output(out, np.ones(1, np.uint8 if levels else np.float32)[0], sides)
    shown: dict[str, Array] = {}
    narrow = False
    names = {"image": image, "mask": mask or image, "known": str(hole), "steps": "--edit", "count": "--threads"}
    with name_arguments(**names), threads(count):
        # Read, compute or measure the map.
        if scale_map is not None:
            made = read_scale_map(scale_map, encoding or "log2")
        elif given["slant"] is not None:
            angles = {"tilt": 90.0} | find_fov(image) | ANGLES.call(ANGLES.read(given))
            narrow = "fov" not in angles
            made = scale_maps.from_angles(pixels.shape[:2], **angles)
        else:
            known = None if hole is None else check_same_size(read_mask(hole), pixels, "--hole") == 0
            if mask is None:
                drawn = scale_maps.auto_mask(pixels, known=known, **FOUND.call(FOUND.read(given)))
            else:
                drawn = check_same_size(read_mask(mask), pixels, "--mask")
            made = scale_maps.from_mask(drawn, known=known, **MASKS.call(MASKS.read(given)))
            shown["mask"] = drawn != 0
        # Edit the map, and then resize it.
        shown["scale"] = scale_maps.picture(made)
        if ("steps",) in asked:
            made = scale_maps.edit(made, asked["steps",])
            shown["edited"] = scale_maps.picture(made)
        if ("size",) in asked:
            made = scale_maps.resample(made, **RESIZED.call(RESIZED.read(given)))
            shown["resampled"] = scale_maps.picture(made)
    least, largest, kind = float(made.min()), float(made.max()), find_kind(made)
    with _outputs.write_output(out) as temporary:
        io.write(
            temporary, made if levels is None else scale_maps.encode(made, levels), description=describe_kind(made)
        )
        if stages is not None:
            said = {name: value for name, value in given.items() if value is not None and name not in ("steps", "size")}
            inputs = {"mask": mask, "auto": auto or None, "scale_map": scale_map, "hole": hole, "encoding": levels}
            report = said | {name: value for name, value in inputs.items() if value is not None}
            report |= {"edit": asked["steps",]} if ("steps",) in asked else {}
            report |= {} if kind is None else {"scale_kind": kind}
            with _outputs.write_folder(stages, "stages", suffix=Path(out).suffix) as folder:
                save(shown, {**report, "size": made.shape, "least": least, "largest": largest}, folder)
    extent, seconds = _outputs.show_sides(made.shape), time.monotonic() - start
    what = {None: "scales", "width": "widths", "area": "roots of areas"}[kind]
    if narrow:
        note("without --fov, sizes vary less than in the photograph, by up to a factor of two", quiet=quiet)
    note(f"wrote {out}: {extent}, {what} {least:.3g} to {largest:.3g}, in {seconds:.1f} s", quiet=quiet)


def find_fov(image: str) -> dict[str, float]:
    """Return the angle of view from a photograph's metadata as an argument, or no argument if it is not stated."""
    fov = None if image.startswith(_outputs.SAMPLE) else io.read_fov(image)
    return {} if fov is None else {"fov": fov}


def check_same_size(mask: Array, pixels: Array, option: str) -> Array:
    """Check that a mask has the size of the image, and return it."""
    if mask.shape[:2] != pixels.shape[:2]:
        sizes = (_outputs.show_sides(a.shape[:2]) for a in (pixels, mask))
        raise InvalidInput("{}: must have the size of the image, {}; got {}".format(option, *sizes))
    return mask


def save(shown: dict[str, Array], report: dict[str, Any], folder: Path) -> None:
    """Write the images of the stages and the report."""
    for number, (name, picture) in enumerate(shown.items(), start=1):
        io.write(os.path.join(folder, f"{number:02d}-{name}.png"), preview(picture))
    with io.atomic(os.path.join(folder, "report.json")) as temporary:
        temporary.write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")


COMMAND = scale_map_command

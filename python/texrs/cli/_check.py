"""The command that tests whether images tile: ``texrs check``."""

from __future__ import annotations

from typing import Annotated

import numpy as np
import typer

from texrs import io
from texrs._threads import threads
from texrs.cli import _outputs
from texrs.cli._console import note, say
from texrs.cli._outputs import Quiet, Threads, describe, make_argument, name_arguments, to_write
from texrs.cli._readers import read_example
from texrs.cli._texts import About
from texrs.materials import Material
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis
from texrs.tiling import Tiling, check_tiling
from texrs.tiling.borders import SEEN

COPIES = (2, 2)
BORDERS = {"rows": "bottom to top", "columns": "right to left"}
"""Axes along which an image can be tileable, and the border between copies along each."""


def check_command(
    file: Annotated[str, make_argument("FILE", "An image, a folder of the maps of a material, or sample:NAME.")],
    source_map: Annotated[
        str | None,
        typer.Option(
            "--source-map",
            metavar="MAP.npz",
            help="Source map of the image (.npz). The seams inside the image are checked too.",
            show_default="only the borders are checked",
        ),
    ] = None,
    out: Annotated[str | None, to_write("out", text="Image file for 2 x 2 copies of the image.")] = None,
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Test whether an image tiles along each axis, and measure the visibility of its borders and seams."""
    if out is not None:
        _outputs.check_output(out)
    given = read_example(file, About(), single=False)
    shown = np.asarray(given.base if isinstance(given, Material) else given)
    if out is not None:
        _outputs.check_output(out, shown)
    with name_arguments(image=file, source_map="--source-map", count="--threads"), threads(count):
        found = check_tiling(given, None if source_map is None else SourceMap.load(source_map))
    say(f"{file}: {describe(shown, 2)}")
    for name, each in (found.maps or {"": found}).items():
        for line in list_borders(each):
            say(f"{name}: {line}" if name else line)
    if out is not None:
        picture = np.tile(shown, COPIES + (1,) * (shown.ndim - 2))
        with _outputs.write_output(out) as temporary:
            io.write(temporary, picture)
        note(f"wrote {out}: {describe(picture, 2)}", quiet=quiet)


def list_borders(found: Tiling) -> list[str]:
    """Return one line for each axis: whether the image is tileable, and how visible its border and seams are."""
    lines = []
    for (axis, border), tiles, seam, place in zip(BORDERS.items(), found.tiles, found.seam, found.place, strict=True):
        if seam is None or place is None:
            lines.append(f"{axis} ({border}): too few {axis} for a test")
            continue
        other = "columns" if axis == "rows" else "rows"
        where = "" if tiles else f", most visible at {other} {place[0]} to {place[1] - 1}"
        step = found.step[0 if axis == "rows" else 1]
        inside = "" if step is None else f"; seams inside {'visible' if step > SEEN else 'not visible'}, {step:.2f}"
        lines.append(f"{axis} ({border}): {'tile' if tiles else 'do not tile'}, seam {seam:.2f}{where}{inside}")
    return lines


def tell_tiling(result: Synthesis) -> str:
    """Return a text about the visible borders and seams of a result, its changes, and the reason for another size."""
    report = result.report
    said = []
    if "in_place" in report:
        said.append(f", {report['in_place']:.0%} of the pixels in place, {report['unchanged']:.0%} unchanged")
    for key, words in (("seam", "borders of"), ("step", "seams between")):
        found = report.get("tiling", {}).items()
        figures = [f"{name} {each[key]:.2f}" for name, each in found if each[key] is not None]
        said += [f", {words} {', '.join(figures)}"] if figures else []
    said += [" (1: as elsewhere)"] if report.get("tiling") else []
    said += [f", {each}" for each in report.get("warnings", [])]
    said += [f", {name} {reason}" for name, reason in report.get("resized", {}).items()]
    return "".join(said)


COMMAND = check_command

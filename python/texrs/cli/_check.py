"""The command that tests whether pictures tile: ``texrs check``."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from texrs import io
from texrs._threads import threads
from texrs.cli import _outputs
from texrs.cli._console import note, say
from texrs.cli._outputs import Quiet, Threads, describe, make_argument, name_arguments, to_write
from texrs.cli._readers import read_example
from texrs.cli._texts import About
from texrs.materials import Material
from texrs.synthesis import Synthesis
from texrs.tiling import Tiling, check_tiling

COPIES = (2, 2)
BORDERS = {"rows": "bottom to top", "columns": "right to left"}
"""The axes along which a picture tiles, and the border of each."""


def check_command(
    file: Annotated[str, make_argument("FILE", "A picture, a folder of the maps of a material, or sample:NAME.")],
    out: Annotated[str | None, to_write("out", text="Picture of 2 x 2 copies to write.")] = None,
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Test whether a picture tiles along each axis, and how bold its borders are."""
    if out is not None:
        _outputs.check_output(out)
    given = read_example(file, About(), single=False)
    shown = np.asarray(given.base if isinstance(given, Material) else given)
    if out is not None:
        _outputs.check_output(out, shown)
    with name_arguments(image=file, count="--threads"), threads(count):
        found = check_tiling(given)
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
    """Return a line about each axis."""
    lines = []
    for (axis, border), tiles, seam, place in zip(BORDERS.items(), found.tiles, found.seam, found.place, strict=True):
        if seam is None or place is None:
            lines.append(f"{axis} ({border}): too few {axis} to tell")
            continue
        other = "columns" if axis == "rows" else "rows"
        where = "" if tiles else f", boldest at {other} {place[0]} to {place[1] - 1}"
        lines.append(f"{axis} ({border}): {'tile' if tiles else 'do not tile'}, seam {seam:.2f}{where}")
    return lines


def tell_tiling(result: Synthesis) -> str:
    """Return how bold the borders of a result are, what was changed, and why its size is another one."""
    report = result.report
    said = [f", {report['in_place']:.0%} of the pixels in place"] if "in_place" in report else []
    seams = [
        f"{name} {each['seam']:.2f}" for name, each in report.get("tiling", {}).items() if each["seam"] is not None
    ]
    said += [f", seam of {', '.join(seams)} (1: as elsewhere)"] if seams else []
    said += [f", {name} {reason}" for name, reason in report.get("resized", {}).items()]
    return "".join(said)


COMMAND = check_command

"""Commands about the elements of textures: ``texrs analyse`` and ``texrs database``."""

from __future__ import annotations

import os
import re
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any

from texrs import io
from texrs._threads import threads
from texrs.cli import _outputs
from texrs.cli._console import complain, note, say, show_progress
from texrs.cli._kinds import PICTURE, PLACE, read_picture
from texrs.cli._options import Options, take_options
from texrs.cli._outputs import SAMPLE, Quiet, Threads, make_argument, name_arguments, to_write
from texrs.database import TextureDatabase
from texrs.elements import analyse, pictures
from texrs.errors import FileError, InvalidInput

PICTURED = Options(analyse, arguments={"image": PICTURE})
ANALYSED = Options(analyse, leave={"image": "there may be several"})
KEPT = Options(TextureDatabase.add, only=("name", "similarity", "replace"))
SIMILAR = Options(TextureDatabase.add, only=("similarity",))
MATRIX = Options(TextureDatabase.matrix, only=("size", "cell"))


@take_options(PICTURED, SIMILAR)
def analyse_command(
    out: Annotated[str, to_write("out", "ENTRY.npz", "Entry to write.")],
    given: dict[str, Any],
    more: Annotated[list[str] | None, make_argument("ROW,COL", "More places of --background.")] = None,
    stages: Annotated[str | None, to_write("stages", text="Folder for pictures of the points and the mask.")] = None,
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Find the elements of a texture, and what belongs to them."""
    start = time.monotonic()
    given["background"] = [*(given["background"] or ()), *(more or ())]
    options = PICTURED.read(given, which=lambda o: not o.file)
    _outputs.check_suffix("out", out)
    _outputs.check_output(out)
    if stages is not None:
        _outputs.check_folder(stages)
    options |= PICTURED.read(given, which=lambda o: o.file)
    names = {o.path[-1]: o.flag for o in PICTURED} | {"image": given["image"], "count": "--threads"}
    with name_arguments(**names), threads(count), show_progress(quiet=quiet) as progress:
        entry = analyse(**PICTURED.call(options), progress=progress)
        if given["similarity"]:
            entry = entry.with_similarity()
    entry.save(out)
    if stages is not None:
        os.makedirs(stages, exist_ok=True)
        for name, picture in pictures(entry).items():
            io.write(os.path.join(stages, f"{name}.png"), picture)
    explain(entry, quiet=quiet)
    note(f"wrote {out}: {len(entry.points)} elements, {entry.layout}, in {time.monotonic() - start:.1f} s", quiet=quiet)


@take_options(ANALYSED, KEPT, MATRIX)
def database_command(
    folder: Annotated[str, make_argument("DIR", "Folder of the database; made if it is not there.")],
    action: Annotated[str, make_argument("add|list|matrix", "Add images, list what is there, or splice all with all.")],
    given: dict[str, Any],
    items: Annotated[list[str] | None, make_argument("IMAGE|NAME", "Images to add; names for matrix.")] = None,
    out: Annotated[str | None, to_write("out", text="Image file for matrix.")] = None,
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Keep analysed textures in a folder: add, list, or splice all with all."""
    if action not in ("add", "list", "matrix"):
        raise InvalidInput(f"add|list|matrix: allowed are add, list and matrix; got {action!r}")
    if action == "add":
        add(folder, list(items or ()), given, count, quiet=quiet)
        return
    if not os.path.isdir(folder):
        raise FileError(f"{folder}: there is no such folder")
    textures = TextureDatabase(folder, say=complain)
    if action == "list":
        for record in textures.list():
            box = ",".join(map(str, record.box))
            say(f"{record.name}\t{record.layout}\t{record.elements} elements\tbox {box}\t{record.image}")
        return
    if out is None:
        raise InvalidInput("--out: matrix needs the name of an image file")
    kept = [os.path.join(folder, file) for record in textures.list() for file in (record.file, record.image)]
    _outputs.check_apart(kept, {"out": out})
    _outputs.check_output(out)
    options = MATRIX.call(MATRIX.read(given))
    with name_arguments(count="--threads"), threads(count), show_progress(quiet=quiet) as progress:
        made = textures.matrix(items or None, items or None, **options, progress=progress, seed=given["seed"])
    for (a, b), reason in made.failed.items():
        complain(f"{a} on {b}: {reason}")
    with _outputs.write_output(out) as temporary:
        io.write(temporary, made.sheet)
    note(f"wrote {out}: {len(made.results)} splices", quiet=quiet)


def add(folder: str, items: Sequence[str], given: dict[str, Any], count: int | None, *, quiet: bool) -> None:
    """Add images to a database; what looks like a place is one between the elements."""
    given["background"] = [*(given["background"] or ()), *(i for i in items if re.fullmatch(PLACE, i))]
    images = [i for i in items if not re.fullmatch(PLACE, i)]
    values = ANALYSED.read(given)
    if not images:
        raise InvalidInput("IMAGE: add needs images")
    if len(images) > 1 and (given["name"] or {("box",), ("background",), ("mask",), ("points",)} & values.keys()):
        raise InvalidInput(
            "IMAGE: --name, --box, --background, --mask and --points belong to one image; add one by one"
        )
    for image in images:
        _outputs.check_apart([image], {"name": os.path.join(folder, f"{given['name'] or Path(image).stem}.npz")})
    textures = TextureDatabase(folder, say=complain)
    options = ANALYSED.call(values) | KEPT.call(KEPT.read(given, which=lambda o: o.name != "name"))
    for image in images:
        sample = image.startswith(SAMPLE)
        name = given["name"] or (image.removeprefix(SAMPLE) if sample else None)
        with name_arguments(image=image, count="--threads"), threads(count), show_progress(quiet=quiet) as progress:
            entry = textures.add(read_picture(image) if sample else image, name, **options, progress=progress)
        explain(entry, quiet=quiet)
        note(f"added {image}: {len(entry.points)} elements, {entry.layout}", quiet=quiet)


def explain(entry: Any, *, quiet: bool) -> None:
    """Print what was proposed, how sure that is, and what is doubtful."""
    sure = entry.report.get("confidence", {})
    for name in entry.report["proposed"]:
        value = {"box": ",".join(map(str, entry.report["box"])), "layout": entry.layout}.get(name, "as drawn")
        note(f"proposed {name}: {value} ({sure.get(name, 0):.0%} sure)", quiet=quiet)
    for doubt in entry.report["doubts"]:
        note(f"doubtful: {doubt}", quiet=quiet)


COMMANDS: dict[str, Callable[..., None]] = {"analyse": analyse_command, "database": database_command}

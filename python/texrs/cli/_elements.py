"""Commands about the elements of textures: ``texrs analyse`` and ``texrs database``."""

from __future__ import annotations

import itertools
import os
import re
import shutil
import time
import warnings
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

from texrs import io
from texrs._threads import threads
from texrs.cli import _outputs, _provenance
from texrs.cli._console import complain, keep, note, say, show_progress
from texrs.cli._kinds import EXAMPLE, Kind
from texrs.cli._options import Option, Options, check_needed, take_options
from texrs.cli._outputs import SAMPLE, Quiet, Threads, make_argument, make_option, name_arguments, to_write
from texrs.cli._places import PLACE, show_box
from texrs.cli._provenance import RUNNING, check_free
from texrs.cli._readers import read_picture
from texrs.cli._stacks import Roles, read_roles
from texrs.cli._texts import About
from texrs.database import TextureDatabase
from texrs.elements import analyse, draw
from texrs.elements import to_html as draw_page
from texrs.errors import FileError, InvalidInput
from texrs.materials import Material
from texrs.materials.single import SingleMap
from texrs.papers.splice import splice
from texrs.synthesis import Synthesis

PICTURED = Options(analyse, arguments={"image": EXAMPLE})
ANALYSED = Options(analyse, leave={"image": "there may be several"})
KEPT = Options(TextureDatabase.add, only=("name", "similarity", "replace"))
SIMILAR = Options(TextureDatabase.add, only=("similarity",))
NAMES = Kind("NAME,NAME,...", lambda text, about: [name.strip() for name in text.split(",")])
MATRIX = Options(TextureDatabase.matrix, only=("rows", "columns", "cell"), kinds={"rows": NAMES, "columns": NAMES})
SPLICED = Options(splice, leave={"elements": "is named", "layout": "is named"})
ACTIONS: dict[str, tuple[Option, ...]] = {
    "add": (*ANALYSED, *KEPT),
    "list": (),
    "remove": (),
    "splice": tuple(SPLICED),
    "matrix": (*MATRIX, *SPLICED),
}
"""Actions on a database, and the options that each accepts."""


@take_options(PICTURED, SIMILAR)
def analyse_command(
    out: Annotated[str, to_write("out", "ENTRY.npz", "File of the elements to write.")],
    given: dict[str, Any],
    more: Annotated[list[str] | None, make_argument("X,Y", "More points for --background.")] = None,
    stages: Annotated[str | None, to_write("stages", text="Folder for images of the points and the mask.")] = None,
    page: Annotated[str | None, to_write("page")] = None,
    role: Roles = None,
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Find the elements of a texture, and the parts that belong to them."""
    start = time.monotonic()
    given["background"] = [*(given["background"] or ()), *(more or ())]
    options = PICTURED.read(given, which=lambda o: not o.file)
    _outputs.check_suffix("out", out)
    _outputs.check_output(out)
    if stages is not None:
        _outputs.check_stages(stages)
    if page is not None:
        _outputs.check_outputs({"out": out, "page": page})
        _outputs.check_output(page, option="page")
    # Read the files only now, after the checks of all other options and of the outputs.
    about = About(roles=read_roles(role))
    with warnings.catch_warnings(record=True) as left:
        warnings.simplefilter("always")
        options |= PICTURED.read(given, about, which=lambda o: o.file)
    for warning in left:
        note(str(warning.message), quiet=quiet)
    material = isinstance(options["image",], Material) and not isinstance(options["image",], SingleMap)
    if role and not material:
        raise InvalidInput("--role: only available for materials, which are folders of maps or EXR files of layers")
    names = {o.path[-1]: o.flag for o in PICTURED} | {"image": given["image"], "count": "--threads"}
    with name_arguments(**names), threads(count), show_progress(quiet=quiet) as progress:
        entry = analyse(**PICTURED.call(options), progress=progress)
        if given["similarity"]:
            entry = entry.with_similarity()
    # Write the analysis, then the pictures of its stages, and then the HTML page.
    with _outputs.write_output(out) as temporary:
        entry.save(temporary)
    if stages is not None:
        with _outputs.write_folder(stages, "stages") as pictured:
            for name, picture in draw(entry).items():
                io.write(pictured / f"{name}.png", picture)
    if page is not None:
        with _outputs.write_output(page, "page") as temporary:
            temporary.write_text(draw_page(entry, Path(given["image"]).name), encoding="utf-8")
    explain(entry, quiet=quiet)
    note(f"wrote {out}: {len(entry.points)} elements, {entry.layout}, in {time.monotonic() - start:.1f} s", quiet=quiet)


@take_options(SPLICED, ANALYSED, KEPT, MATRIX)
def database_command(
    folder: Annotated[str, make_argument("DIR", "Folder of the database, created if needed.")],
    action: Annotated[
        str,
        make_argument(
            "|".join(ACTIONS),
            "Action: add images, list textures, remove textures, splice two, or splice all pairs (matrix).",
        ),
    ],
    given: dict[str, Any],
    items: Annotated[
        list[str] | None, make_argument("IMAGE|NAME", "Images (for add) or texture names (for the other actions).")
    ] = None,
    out: Annotated[str | None, to_write("out", text="Image file for splice and matrix.")] = None,
    each: Annotated[
        str | None, make_option("DIR", "Folder for all results of matrix at full size, named A-on-B.png.")
    ] = None,
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Keep analysed textures in a folder: add, list, remove, or splice them."""
    names = list(items or ())
    if action not in ACTIONS:
        raise InvalidInput(f"{'|'.join(ACTIONS)}: must be one of {', '.join(ACTIONS)}; got {action!r}")
    check_needed(given, ACTIONS, action)
    for flag, value, users in (("--out", out, ("splice", "matrix")), ("--each", each, ("matrix",))):
        if value is not None and action not in users:
            raise InvalidInput(f"{flag}: must be used with {' or '.join(users)}, got {action}")
    if action == "add":
        add(folder, names, given, count, quiet=quiet)
        return
    if not os.path.isdir(folder):
        raise FileError(f"{folder}: the folder does not exist")
    textures = TextureDatabase(folder, log=complain)
    match action:
        case "list":
            for record in textures.list():
                box = show_box(record.box)
                say(f"{record.name}\t{record.layout}\t{record.elements} elements\tbox {box}\t{record.image}")
        case "remove":
            if not names:
                raise InvalidInput("NAME: requires at least one texture to remove, got none")
            for name in names:
                textures.remove(name)
                note(f"removed {name}", quiet=quiet)
        case _:
            write_splices(textures, action, names, given, out, each, count, quiet=quiet)


def write_splices(
    textures: TextureDatabase,
    action: str,
    names: Sequence[str],
    given: dict[str, Any],
    out: str | None,
    each: str | None,
    count: int | None,
    *,
    quiet: bool,
) -> None:
    """Splice two textures of a database, or all pairs. Each result is written as soon as it is ready."""
    if out is None:
        raise InvalidInput(f"--out: must be the name of an image file for {action}")
    if action == "splice" and len(names) != 2:
        raise InvalidInput(
            "NAME: must be two names for splice: the texture with the elements, and the texture with the layout; "
            f"got {len(names)}"
        )
    records = {record.name: record for record in textures.list()}
    files = {name: os.path.join(textures.path, record.file) for name, record in records.items()}
    # Do not record names as input files, because they refer to textures in the folder.
    running = RUNNING.get()
    if running is not None:
        running.files = {}
    _provenance.add_inputs(*(files[n] for n in (names or sorted(files)) if n in files))
    kept = [os.path.join(textures.path, file) for record in textures.list() for file in (record.file, record.image)]
    _outputs.check_apart(kept, {"out": out})
    _outputs.check_output(out)
    options = SPLICED.call(SPLICED.read(given))
    chosen = {"rows": names or None, "columns": names or None} | MATRIX.call(MATRIX.read(given))
    several = dict.fromkeys(("--rows", "--columns", "--cell"))

    def alone(a: str, b: str) -> _provenance.Record | None:
        """Return the record for one of several results of the command."""
        known = [files[n] for n in (a, b) if n in files]
        return _provenance.narrow([str(textures.path), "splice", a, b], several, files=known)

    if each is not None:
        _outputs.check_folder(each)
        os.makedirs(each, exist_ok=True)
        for a, b in itertools.product(chosen["rows"] or files, chosen["columns"] or files):
            with _provenance.record(alone(a, b)):
                check_free(os.path.join(each, f"{a}-on-{b}.png"), "each")
    with name_arguments(name="NAME", count="--threads"), threads(count), show_progress(quiet=quiet) as progress:
        if action == "splice":
            _outputs.deliver(textures.splice(names[0], names[1], **options, progress=progress), {"out": out})
            note(f"wrote {out}: {names[0]} on {names[1]}", quiet=quiet)
            return

        def write(a: str, b: str, result: Synthesis) -> None:
            if each is not None:
                place = os.path.join(each, f"{a}-on-{b}.png")
                _outputs.check_apart(kept, {"each": place})
                _outputs.deliver(result, {"out": place}, made=alone(a, b))
                keep(place)

        made = textures.matrix(**chosen, **options, each=write, progress=progress)
    for (a, b), reason in made.failed.items():
        complain(f"{a} on {b}: {reason}")
    with _outputs.write_output(out) as temporary:
        io.write(temporary, made.sheet)
    done = len(made.rows) * len(made.columns) - len(made.failed)
    note(f"wrote {out}: {done} splices{f', each in {each}' if each else ''}", quiet=quiet)


def add(folder: str, items: Sequence[str], given: dict[str, Any], count: int | None, *, quiet: bool) -> None:
    """Add images to a database."""
    given["background"] = [*(given["background"] or ()), *(i for i in items if re.fullmatch(PLACE, i))]
    images = [i for i in items if not re.fullmatch(PLACE, i)]
    values = ANALYSED.read(given)
    if not images:
        raise InvalidInput("IMAGE: requires at least one image to add, got none")
    if len(images) > 1 and (given["name"] or {("box",), ("background",), ("mask",), ("points",)} & values.keys()):
        raise InvalidInput(
            "IMAGE: must be a single image with --name, --box, --background, --mask or --points; add images one by one"
        )
    for image in images:
        _outputs.check_apart([image], {"name": os.path.join(folder, f"{given['name'] or Path(image).stem}.npz")})
    textures = TextureDatabase(folder, log=complain)
    options = ANALYSED.call(values) | KEPT.call(KEPT.read(given, which=lambda o: o.name != "name"))
    for image in images:
        sample = image.startswith(SAMPLE)
        name = given["name"] or (image.removeprefix(SAMPLE) if sample else None)
        with name_arguments(image=image, count="--threads"), threads(count), show_progress(quiet=quiet) as progress:
            entry = textures.add(read_picture(image) if sample else image, name, **options, progress=progress)
        with suppress(FileError):
            sign(os.path.join(folder, f"{name or Path(image).stem}.npz"), image)
        keep(image)
        explain(entry, quiet=quiet)
        note(f"added {image}: {len(entry.points)} elements, {entry.layout}", quiet=quiet)


def sign(path: str, image: str) -> None:
    """Store the record of the command in the file of a database entry."""
    made = _provenance.narrow([None, "add", image], {"--name": Path(path).stem, "--replace": None})
    with (
        _provenance.record(made and replace(made, force=True)),
        _outputs.write_output(path, "DIR", inside=True) as place,
    ):
        shutil.copyfile(path, place)


def explain(entry: Any, *, quiet: bool) -> None:
    """Print the proposed layout, its confidence, and warnings about it."""
    sure = entry.report.get("confidence", {})
    for name in entry.report["proposed"]:
        value = {"box": show_box(entry.report["box"]), "layout": entry.layout}.get(name, "as drawn")
        note(f"proposed {name}: {value} ({sure.get(name, 0):.0%} sure)", quiet=quiet)
    for name in ("lattice", "courses"):
        if known := entry.report.get(name):
            note(f"found {known['description']} ({known['confidence']:.0%} sure)", quiet=quiet)
    note(f"elements: {entry.arrangement.describe(entry.layout)}", quiet=quiet)
    for doubt in entry.report.get("warnings", ()):
        note(f"doubtful: {doubt}", quiet=quiet)


COMMANDS: dict[str, Callable[..., None]] = {"analyse": analyse_command, "database": database_command}

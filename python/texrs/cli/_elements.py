"""Commands about the elements of textures: ``texrs analyse`` and ``texrs database``."""

from __future__ import annotations

import functools
import inspect
import math
import os
import re
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from texrs import io
from texrs._threads import threads
from texrs.cli import _files
from texrs.cli._console import Method, Quiet, Threads, as_method, complain, note, say, watching
from texrs.cli._files import named
from texrs.database import TextureDatabase
from texrs.elements import ElementSearch, analyse, pictures
from texrs.errors import FileError, InvalidInput

__all__ = ["analyse_command", "database_command"]

BoxText = Annotated[
    str | None,
    typer.Option(
        "--box",
        metavar="ROW,COL,HEIGHT,WIDTH",
        help="Centre and size of the box around one element, in pixels.",
        show_default="proposed",
    ),
]
Places = Annotated[
    list[str] | None,
    typer.Option(
        "--background",
        metavar="ROW,COL",
        help="A place between the elements; more may follow, or the option be repeated.",
        show_default="proposed",
    ),
]
LayoutText = Annotated[
    str | None,
    typer.Option(
        "--layout",
        metavar="LAYOUT",
        help="disjoint: separate elements, connected: a connected foreground, jointed: elements parted by joints.",
        show_default="proposed",
    ),
]
MaskFile = Annotated[
    str | None,
    typer.Option(
        "--mask",
        metavar="FILE",
        help="The foreground, of one element or of all: what is not black.",
        show_default=False,
    ),
]
PointsFile = Annotated[
    str | None,
    typer.Option("--points", metavar="POINTS.csv", help="The elements: row,column a line.", show_default="searched"),
]
Rotations = Annotated[int, typer.Option(help="Directions in which the element is looked for, 1 to 72.")]
Scales = Annotated[str, typer.Option(metavar="S:S:...", help="Sizes in which it is looked for, 0.25 to 4.")]
Threshold = Annotated[
    float | None, typer.Option(help="Least similarity, -1 to 1.", show_default="what parts the candidates best")
]
Wrap = Annotated[
    str, typer.Option(metavar="AXES", help="Where the texture tiles: xy, x (left-right), y (top-bottom) or none.")
]
Seed = Annotated[int, typer.Option(help="Chooses the samples of the colour models.")]


def read_options(
    box: BoxText = None,
    background: Places = None,
    layout: LayoutText = None,
    mask: MaskFile = None,
    points: PointsFile = None,
    rotations: Rotations = 1,
    scales: Scales = "1",
    threshold: Threshold = None,
    method: Method = "default",
    wrap: Wrap = "none",
    seed: Seed = 0,
) -> dict[str, Any]:
    """Read what every command takes that analyses."""
    how = as_method(method)
    try:
        sizes = [float(s) for s in scales.split(":")]
    except ValueError:
        raise InvalidInput(f"--scales: needs numbers such as 0.8:1:1.25, got {scales!r}") from None
    with named():
        search = ElementSearch(rotations=rotations, scales=sizes, threshold=threshold)
    return {
        "box": None if box is None else _numbers(box, 4, "--box", "ROW,COL,HEIGHT,WIDTH, as in 96,92,50,50"),
        "background": _places(background or ()) or None,
        "layout": layout,
        "mask": None if mask is None else np.asarray(_files.read_hole(mask)) != 0,
        "points": None if points is None else read_points(points),
        "search": search,
        "method": how,
        "wrap": _files.parse_wrap(wrap),
        "seed": seed,
    }


def analysing(command: Callable[..., None]) -> Callable[..., None]:
    """Return a command the options of `read_options`, and what is read of them as ``options``."""
    own, shared = (inspect.signature(c, eval_str=True).parameters for c in (command, read_options))

    @functools.wraps(command)
    def wrapped(**given: Any) -> None:
        options = read_options(**{name: given.pop(name) for name in shared})
        command(**given, options=options)

    parameters = [p for name, p in own.items() if name != "options"]
    first = next(i for i, p in enumerate(parameters) if p.name in ("similarity", "replace"))
    parameters[first:first] = shared.values()
    wrapped.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    wrapped.__annotations__ = {p.name: p.annotation for p in parameters}
    return wrapped


@analysing
def analyse_command(
    image: Annotated[
        str, typer.Argument(metavar="IMAGE", help="The texture: an image file, or sample:NAME.", show_default=False)
    ],
    out: Annotated[str, typer.Option("--out", "-o", metavar="ENTRY.npz", help="Entry to write.", show_default=False)],
    more: Annotated[
        list[str] | None,
        typer.Argument(metavar="[ROW,COL]...", help="More places between the elements.", show_default=False),
    ] = None,
    similarity: Annotated[
        bool, typer.Option("--similarity/--no-similarity", help="Whether similarity sets are made now and kept too.")
    ] = False,
    stages: Annotated[
        str | None,
        typer.Option(metavar="DIR", help="Folder for pictures of the points and the mask.", show_default=False),
    ] = None,
    count: Threads = None,
    quiet: Quiet = False,
    *,
    options: dict[str, Any],
) -> None:
    """Find the elements of a texture, and what belongs to them."""
    start = time.monotonic()
    if Path(out).suffix.lower() != ".npz":
        raise InvalidInput(f"--out: needs a name that ends in .npz, got {out!r}")
    _files.check_output(out)
    if stages is not None:
        _files.check_folder(stages)
    options["background"] = [*(options["background"] or ()), *_places(more or ())] or None
    pixels = _files.read_exemplar(image)
    with named(image=image, count="--threads"), threads(count), watching(quiet=quiet) as progress:
        entry = analyse(pixels, progress=progress, **options)
        if similarity:
            entry = entry.with_similarity()
    entry.save(out)
    if stages is not None:
        _draw(stages, entry)
    _explain(entry, quiet=quiet)
    note(f"wrote {out}: {len(entry.points)} elements, {entry.layout}, in {time.monotonic() - start:.1f} s", quiet=quiet)


@analysing
def database_command(
    folder: Annotated[
        str, typer.Argument(metavar="DIR", help="Folder of the database; made if it is not there.", show_default=False)
    ],
    action: Annotated[
        str,
        typer.Argument(
            metavar="add|list|matrix",
            help="Add images, list what is there, or splice all with all.",
            show_default=False,
        ),
    ],
    items: Annotated[
        list[str] | None,
        typer.Argument(metavar="[IMAGE|NAME]...", help="Images to add; names for matrix.", show_default=False),
    ] = None,
    out: Annotated[
        str | None, typer.Option("--out", "-o", metavar="OUT", help="Image file for matrix.", show_default=False)
    ] = None,
    name: Annotated[
        str | None, typer.Option(help="Name of the texture that is added.", show_default="that of the file")
    ] = None,
    replace: Annotated[
        bool, typer.Option("--replace/--no-replace", help="Whether another texture of the name may be replaced.")
    ] = False,
    size: Annotated[
        str | None,
        typer.Option(metavar="ROWSxCOLS", help="Size of each splice of matrix.", show_default="that of the elements"),
    ] = None,
    cell: Annotated[int, typer.Option(help="Side of a picture of matrix, in pixels.")] = 160,
    count: Threads = None,
    quiet: Quiet = False,
    *,
    options: dict[str, Any],
) -> None:
    """Keep analysed textures in a folder: add, list, or splice all with all."""
    given = list(items or ())
    if action not in ("add", "list", "matrix"):
        raise InvalidInput(f"add|list|matrix: allowed are add, list and matrix; got {action!r}")
    if action == "add":
        places = [*(options["background"] or ()), *_places([i for i in given if re.fullmatch(PLACE, i)])]
        options["background"] = places or None
        given = [i for i in given if not re.fullmatch(PLACE, i)]
        if not given:
            raise InvalidInput("IMAGE: add needs images")
        if len(given) > 1 and (name or any(options[k] is not None for k in ("box", "background", "mask", "points"))):
            raise InvalidInput(
                "IMAGE: --name, --box, --background, --mask and --points belong to one image; add one by one"
            )
        for image in given:
            _files.check_apart([image], name=os.path.join(folder, f"{name or Path(image).stem}.npz"))
        textures = TextureDatabase(folder, say=complain)
        for image in given:
            sample = image.startswith(_files.SAMPLE)
            what: Any = _files.read_exemplar(image) if sample else image
            label = name or (image.removeprefix(_files.SAMPLE) if sample else None)
            with named(image=image, count="--threads"), threads(count), watching(quiet=quiet) as progress:
                entry = textures.add(what, label, replace=replace, progress=progress, **options)
            _explain(entry, quiet=quiet)
            note(f"added {image}: {len(entry.points)} elements, {entry.layout}", quiet=quiet)
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
    _files.check_apart(kept, out=out)
    _files.check_output(out)
    shape = _files.parse_size(size)
    with named(count="--threads"), threads(count), watching(quiet=quiet) as progress:
        made = textures.matrix(
            given or None, given or None, size=shape, cell=cell, progress=progress, seed=options["seed"]
        )
    for (a, b), reason in made.failed.items():
        complain(f"{a} on {b}: {reason}")
    with _files.output(out) as temporary:
        io.write(temporary, made.sheet)
    note(f"wrote {out}: {len(made.results)} splices", quiet=quiet)


PLACE = r"\s*-?[0-9]+(\.[0-9]*)?\s*,\s*-?[0-9]+(\.[0-9]*)?\s*"


def _places(texts: Sequence[str]) -> list[list[float]]:
    parts = [p for text in texts for p in re.split(r"[\s;]+", text.strip()) if p]
    return [_numbers(p, 2, "--background", "ROW,COL, as in 125,60") for p in parts]


def _numbers(text: str, count: int, name: str, wanted: str) -> list[float]:
    try:
        numbers = [float(p) for p in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(math.isfinite(n) for n in numbers):
        raise InvalidInput(f"{name}: needs {wanted}; got {text!r}")
    return numbers


def read_points(path: str) -> list[list[float]]:
    """Read a list of points, row,column a line; a first line of words and empty lines are passed over."""
    try:
        lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "is no text"
        raise FileError(f"{path}: cannot be read ({reason})") from None
    found: list[list[float]] = []
    for number, line in enumerate(lines, start=1):
        parts = [p.strip() for p in re.split(r"[,;\t]", line.strip())]
        if parts == [""]:
            continue
        try:
            values = [float(p) for p in parts]
        except ValueError:
            if number == 1:
                continue
            values = []
        if len(values) != 2:
            raise InvalidInput(f"{path}: line {number} needs row,column, got {line.strip()[:60]!r}")
        found.append(values)
    if not found:
        raise InvalidInput(f"{path}: holds no points")
    return found


def _draw(folder: str, entry: Any) -> None:
    os.makedirs(folder, exist_ok=True)
    for name, picture in pictures(entry).items():
        io.write(os.path.join(folder, f"{name}.png"), picture)


def _explain(entry: Any, *, quiet: bool) -> None:
    """Say what was proposed, how sure that is, and what is doubtful."""
    sure = entry.report.get("confidence", {})
    for name in entry.report["proposed"]:
        value = {"box": ",".join(map(str, entry.report["box"])), "layout": entry.layout}.get(name, "as drawn")
        note(f"proposed {name}: {value} ({sure.get(name, 0):.0%} sure)", quiet=quiet)
    for doubt in entry.report["doubts"]:
        note(f"doubtful: {doubt}", quiet=quiet)

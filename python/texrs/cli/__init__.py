"""The command ``texrs``.

Results go to files and, where they are text, to stdout; progress and errors go to stderr. Exit codes: 0 done,
1 internal error, 2 bad input or usage, 130 stopped by Ctrl-C. What can be checked is checked before the work begins,
and files are written whole or not at all, so that a failure leaves what was there.
"""

from __future__ import annotations

import os
import re
import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated, Any, cast

import typer

from texrs import io, samples
from texrs._arrays import as_float, as_int
from texrs._threads import threads
from texrs._version import __version__
from texrs.blending import SCREENING
from texrs.blending import blend as healed
from texrs.cli import _elements, _files, _perspective, _pictures, _scales, _solid, _splice, _volumes
from texrs.cli._console import Command, Method, Quiet, Threads, as_method, note, run, say, watching
from texrs.cli._files import describe, named
from texrs.errors import FileError, InvalidInput
from texrs.exemplar.segmentation import ElementOptions, Kind
from texrs.papers.design import DeformationOptions, design_variants
from texrs.source_map import SourceMap

__all__ = ["main"]

app = typer.Typer(
    help="Make new textures from one example.",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("analyse")(_elements.analyse_command)
app.command("database")(_elements.database_command)
app.command("tile")(_pictures.tile_command)
app.command("complete")(_pictures.complete_command)
app.command("scale-map")(_scales.scale_map_command)
app.command("perspective")(_perspective.perspective_command)
app.command("solid")(_solid.solid_command)
app.command("synthesize")(_solid.synthesize_command)
app.command("splice")(_splice.splice_command)
app.command("self-splice")(_splice.self_splice_command)
app.command("slice")(_volumes.slice_command)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and give its exit code.

    Parameters
    ----------
    arguments : sequence of str, optional
        What comes after ``texrs``; by default what the shell gave.

    Examples
    --------
    >>> from texrs.cli import main
    >>> main(["samples", "nowhere"])
    2

    """
    command = typer.main.get_command(app)
    given = list(arguments) if arguments is not None else None
    return run(lambda: command.main(given, prog_name="texrs", standalone_mode=False))


def _show_version(asked: bool) -> None:
    if asked:
        say(f"texrs {__version__}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def texrs(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Make new textures from one example."""
    if context.invoked_subcommand is None:
        commands = ", ".join(sorted(cast(Any, context.command).commands))
        raise InvalidInput(f"a command is missing: one of {commands} (texrs --help describes them)")


@app.command("design")
def design_command(
    exemplar: Annotated[
        list[str],
        typer.Argument(
            metavar="IN...", help="The example, or several to mix: files, or sample:NAME.", show_default=False
        ),
    ],
    out: Annotated[str, typer.Option("--out", "-o", metavar="OUT", help="Image file to write.", show_default=False)],
    size: Annotated[
        str | None,
        typer.Option(metavar="ROWSxCOLS", help="Size of the result, in pixels.", show_default="twice the example"),
    ] = None,
    seed: Annotated[int, typer.Option(help="Chooses the texture; the same seed gives the same bytes.")] = 0,
    wrap: Annotated[
        str, typer.Option(metavar="AXES", help="Where the result tiles: xy, x (left-right), y (top-bottom) or none.")
    ] = "xy",
    weights: Annotated[
        str | None,
        typer.Option(metavar="A:B:...", help="Shares of several examples.", show_default="equal shares"),
    ] = None,
    variants: Annotated[
        int | None,
        typer.Option(
            help="Make so many textures, OUT-SEED each, and OUT as their contact sheet.", show_default="one, in OUT"
        ),
    ] = None,
    layers: Annotated[
        int | None, typer.Option(help="Colour layers of the example, 1 to 16; by default as many as find its elements.")
    ] = None,
    kind: Annotated[
        str, typer.Option(metavar="KIND", help="Elements of the layers: auto, components, grid or none.")
    ] = "auto",
    labels: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="Elements marked by hand: integers, 0 is background.", show_default=False),
    ] = None,
    tiles: Annotated[int, typer.Option(help="Variants of the example to stitch from, 1 to 64.")] = 4,
    operations: Annotated[int, typer.Option(help="Deformations combined on each element, 0 to 8.")] = 2,
    translate: Annotated[
        float, typer.Option(help="Longest translation, as a share of the shorter side, 0 to 0.5.")
    ] = 0.12,
    rotate: Annotated[
        float | None,
        typer.Option(help="Largest rotation in degrees, 0 to 180.", show_default="60, or 0 for directed examples"),
    ] = None,
    scale: Annotated[
        str, typer.Option(metavar="LEAST:LARGEST", help="Range of scaling, within 0.5 and 2.")
    ] = "0.8:1.2",
    mirror: Annotated[bool, typer.Option("--mirror/--no-mirror", help="Whether anything may be mirrored.")] = True,
    start: Annotated[
        float | None, typer.Option(help="Start of the logistic map, inside (-1, 1).", show_default="from the seed")
    ] = None,
    growth_rate: Annotated[float, typer.Option(help="Lambda of the logistic map, 0 to 2.")] = 2.0,
    patch: Annotated[
        int | None,
        typer.Option(help="Side of the patches that fill holes, in pixels.", show_default="by the example's size"),
    ] = None,
    blend: Annotated[
        float, typer.Option(help="Weight of the values when seams are made to disappear; 0 leaves them.")
    ] = SCREENING,
    method: Method = "default",
    stages: Annotated[
        str | None,
        typer.Option(metavar="DIR", help="Folder for pictures of the stages and report.json.", show_default=False),
    ] = None,
    source: Annotated[
        str | None,
        typer.Option(metavar="FILE.npz", help="File for the source map, for texrs apply.", show_default=False),
    ] = None,
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Design a texture of any size from one example."""
    began = time.monotonic()
    shape, cyclic = _files.parse_size(size), _files.parse_wrap(wrap)
    factors = _files.parse_range(scale, name="--scale")
    _files.check_outputs(out, source, stages)
    where: list[dict[str, Any]] = [{"out": out, "source": source, "stages": stages}]
    if variants is not None:
        numbers = range(seed, seed + as_int(variants, "--variants", 1, 4096))
        where = [_files.variant_names(number, **where[0]) for number in numbers]
        for names in where:
            _files.check_apart([*exemplar, labels or ""], **names)
    shares = _files.parse_shares(weights)
    pixels = [_files.read_exemplar(name) for name in exemplar]
    marked = None if labels is None else io.read(labels)
    _files.check_output(out, pixels[0], shape or tuple(2 * n for n in pixels[0].shape[:2]))
    with (
        named(exemplar=" ".join(exemplar), labels=str(labels), weights="--weights", count="--threads"),
        threads(count),
        watching(quiet=quiet) as progress,
    ):
        found = design_variants(
            pixels if len(pixels) > 1 else pixels[0],
            1 if variants is None else variants,
            shape,
            seed=seed,
            wrap=cyclic,
            weights=shares,
            elements=ElementOptions(layers=layers, kind=cast(Kind, kind), labels=marked),
            deformation=DeformationOptions(
                operations=operations,
                translate=translate,
                rotate=rotate,
                scale=factors,
                mirror=mirror,
                start=start,
                growth_rate=growth_rate,
            ),
            tiles=tiles,
            patch=patch,
            blend=blend,
            method=as_method(method),
            progress=progress,
        )
        made = []
        for result, names in zip(found, where, strict=True):
            _files.deliver(result, **names)
            made.append(result)
    if variants is not None:
        with _files.output(out) as temporary:
            io.write(temporary, _files.contact_sheet([result.image for result in made]))
    several = "" if variants is None else f"{variants} textures and their contact sheet, each "
    seconds = time.monotonic() - began
    note(f"wrote {out}: {several}{describe(made[0].image, 2)}, in {seconds:.1f} s", quiet=quiet)


@app.command("apply")
def apply_command(
    source: Annotated[
        str, typer.Argument(metavar="SOURCE.npz", help="A source map that --source wrote.", show_default=False)
    ],
    maps: Annotated[
        list[str],
        typer.Argument(metavar="MAP...", help="Images in register with the example.", show_default=False),
    ],
    out: Annotated[
        str,
        typer.Option(
            "--out", "-o", metavar="OUT", help="Image file to write; a folder for several.", show_default=False
        ),
    ],
    kind: Annotated[str, typer.Option(help="colour, or normal: vectors turn with what they belong to.")] = "colour",
    green: Annotated[str, typer.Option(help="Where y of normals points: up (OpenGL) or down (DirectX).")] = "up",
    interpolation: Annotated[str, typer.Option(help="cubic, linear, or nearest, for labels.")] = "cubic",
    blend: Annotated[
        float,
        typer.Option(
            metavar="WEIGHT", help="Make seams disappear as design --blend does; 0 leaves them, 0.15 is usual."
        ),
    ] = 0.0,
    wrap: Annotated[
        str, typer.Option(metavar="AXES", help="With --blend: where the result tiles, as for design.")
    ] = "xy",
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Make the heights, normals or labels of a result."""
    if kind == "color":
        kind = "colour"
    for option, value, allowed in (
        ("kind", kind, ("colour", "normal")),
        ("green", green, ("up", "down")),
        ("interpolation", interpolation, ("cubic", "linear", "nearest")),
    ):
        if value not in allowed:
            raise InvalidInput(f"--{option}: allowed are {' and '.join(allowed)}; got {value!r}")
    cyclic = _files.parse_wrap(wrap)
    weight = as_float(blend, "--blend", 0, 1e6)
    places = SourceMap.load(source)
    if weight and places.axes != 2:
        raise InvalidInput("--blend: is for pictures; the source map is that of a volume")
    groups = _groups(maps, len(places.shapes))
    targets = _targets(groups, out, [source, *maps])
    read = io.read if places.axes == 2 else io.read_volume
    write = io.write if places.axes == 2 else io.write_volume
    # All results or none take their names, at the end.
    with ExitStack() as stack, threads(count):
        for group, target in zip(groups, targets, strict=True):
            images = [read(path) for path in group]
            _files.check_output(target, images[0], places.shape)
            temporary = stack.enter_context(_files.output(target))
            with named(exemplars=" and ".join(group)):
                options: dict[str, Any] = {"interpolation": interpolation, "kind": kind, "green": green}
                if weight:
                    image = healed(places, images, wrap=cyclic, screening=weight, **options)
                else:
                    image = places.render(images, **options)
            write(temporary, image)
            note(f"{group[0]} gives {target}: {describe(image, places.axes)}", quiet=quiet)


@app.command("demo")
def demo_command(
    out: Annotated[str, typer.Option("--out", "-o", metavar="DIR", help="Folder for index.html.", show_default=False)],
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Write a page that shows what texrs makes, on built-in examples."""
    # Imported here, for no other command needs it.
    from texrs.demo import page

    start = time.monotonic()
    _files.check_folder(out)
    index = os.path.join(out, "index.html")
    if Path(out).is_dir():
        _files.check_output(index)
    with named(count="--threads"), threads(count), watching(quiet=quiet) as progress:
        text = page(progress=progress)
    Path(out).mkdir(parents=True, exist_ok=True)
    with _files.output(index) as temporary:
        temporary.write_text(text, encoding="utf-8")
    note(f"wrote {index}, in {time.monotonic() - start:.1f} s", quiet=quiet)


@app.command("samples")
def samples_command(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="NAME...", help="Which; all by default.", show_default=False)
    ] = None,
    out: Annotated[
        str | None,
        typer.Option(
            "--out", "-o", metavar="DIR", help="Folder to write them to, as .png and .tif.", show_default=False
        ),
    ] = None,
    size: Annotated[
        str | None,
        typer.Option(
            metavar="SIZE", help="Size of those that are generated: 256, 192x256, 64x64x64.", show_default=False
        ),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of those that are generated.", show_default=False)] = None,
    quiet: Quiet = False,
) -> None:
    """List the built-in examples, or write them to a folder."""
    known = (*samples.names(), *samples.photographs())
    for name in names or ():
        if name not in known:
            raise InvalidInput(f"there is no sample {name!r}; allowed are {', '.join(known)}")
    chosen = names or list(known)
    if out is None:
        for name in chosen:
            say(name)
        return
    _files.check_folder(out)
    made = {}
    for name in chosen:
        options: dict[str, Any] = {} if seed is None else {"seed": seed}
        if size is not None:
            # A size of three sides is that of a volume.
            options["size"] = _files.parse_size(size, axes=len(re.split("[x×]", size)))
        made[name] = samples.load(name, **(options if name in samples.names() else {})).image
    Path(out).mkdir(parents=True, exist_ok=True)
    for name, image in made.items():
        volume = image.ndim == 4
        path = os.path.join(out, f"{name}.{'tif' if volume else 'png'}")
        (io.write_volume if volume else io.write)(path, image)
        note(f"wrote {path}: {describe(image, 3 if volume else 2)}", quiet=quiet)


@app.command("info")
def info_command(
    file: Annotated[str, typer.Argument(metavar="FILE", help="An image or a source map.", show_default=False)],
) -> None:
    """Say what an image or a source map holds."""
    try:
        places = SourceMap.load(file)
    except FileError:
        image = io.read(file)
        say(f"image: {describe(image, 2)}, {image.min()} to {image.max()}")
        return
    reuse = places.reuse()
    shapes = " and ".join(" x ".join(map(str, shape)) for shape in places.shapes)
    say(f"source map: {' x '.join(map(str, places.shape))}, made from {shapes}")
    say(f"copied unchanged: {reuse.verbatim:.1%} of the pixels, in {reuse.regions} regions")
    say(f"largest region: {reuse.largest:.1%} of the example")


def _groups(maps: Sequence[str], count: int) -> list[list[str]]:
    """Take as many maps together as there were examples."""
    if len(maps) % count:
        raise InvalidInput(
            f"MAP: the source map was made from {count} examples, so it needs {count} each; got {len(maps)}"
        )
    return [list(maps[i : i + count]) for i in range(0, len(maps), count)]


def _targets(groups: Sequence[Sequence[str]], out: str, inputs: Sequence[str]) -> list[str]:
    """Name what is written: the file itself, or in a folder files of the names of the maps."""
    if len(groups) == 1 and not Path(out).is_dir():
        return [out]
    if not Path(out).is_dir():
        raise InvalidInput(f"--out: needs a folder that exists for {len(groups)} results, got {out!r}")
    targets = [os.path.join(out, Path(group[0]).name) for group in groups]
    for i, target in enumerate(targets):
        _files.check_apart(inputs, out=target)
        if target in targets[:i]:
            raise InvalidInput(f"--out: two maps have the name {Path(target).name}; write them one by one")
    return targets


for registered in app.registered_commands:
    registered.cls = Command

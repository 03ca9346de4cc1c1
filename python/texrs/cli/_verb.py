"""Run a function of the library as a command: read the inputs, call the function and write the result."""

from __future__ import annotations

import inspect
import itertools
import os
import time
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from texrs import io
from texrs._arrays import as_int
from texrs._notices import Notices, collect, ignore
from texrs._palettes import ask
from texrs._threads import threads
from texrs._typing import Array
from texrs.cli import _outputs, _provenance
from texrs.cli._console import keep, note, show_progress
from texrs.cli._options import Options, as_command, make_parameter
from texrs.cli._outputs import Quiet, Threads, describe, name_arguments, to_write
from texrs.cli._provenance import check_free
from texrs.cli._stacks import OPTIONS, SHOWN, Stack
from texrs.cli._texts import About
from texrs.errors import LimitExceeded
from texrs.materials import Material, guess_role
from texrs.materials.single import SingleMap
from texrs.synthesis import Synthesis

VARIANTS = typer.Option(
    help="Number of variants. Each is written to OUT-SEED, and a contact sheet of all to OUT.",
    show_default="1, written to OUT",
    metavar="N",
)
PALETTE = Annotated[
    bool | None,
    typer.Option(
        "--palette/--no-palette",
        help="If --palette, only colours of the input are used: pixels are neither interpolated nor corrected at seams.",
        show_default="if the input is indexed or has few colours",
    ),
]


@dataclass(frozen=True, slots=True)
class Verb:
    """A command that calls a function which returns a `Synthesis`."""

    options: Options
    times: int = 1
    """Default size of the result, as a multiple of the first input."""
    shape: str = ""
    """Name of the parameter whose file determines the size of the result, if no size is given."""
    several: Callable[..., Iterable[Synthesis]] | None = None
    """Function that computes several results for ``--variants``."""
    says: Callable[[Synthesis], str] = lambda result: ""
    """Function that returns additional text about a result."""
    scaled: bool = True
    """If True, a pixel of the result shows the same length as a pixel of the first input."""
    fills: bool = False
    """If True, the command fills pixels of the first input and keeps all other pixels in place.

    A transparent input can then become opaque.
    """
    keeps: bool = False
    """If True, pixels stay in place if the result has the size of the input.

    A georeference is then written only to a result of the same size.
    """
    beyond: str = ""
    """Remedy in errors about results that are too large."""
    knows: Callable[[Mapping[str, Any]], Mapping[tuple[str, ...], Any]] = lambda given: {}
    """Function that returns values for options that are not given, from the texts of the given options."""

    def make_command(self) -> Callable[..., None]:
        """Return the function of the command for typer."""
        return as_command(self.run, self.make_parameters())

    def make_parameters(self) -> list[inspect.Parameter]:
        """Return the parameters of all arguments and options of the command."""
        parameters = [o.make_parameter() for o in self.options if o.argument]
        parameters.append(make_parameter("out", Annotated[str, to_write("out")]))
        parameters += [o.make_parameter() for o in self.options if not o.argument]
        if self.several is not None:
            parameters.append(make_parameter("variants", Annotated[int | None, VARIANTS], None))
        # Only commands for images can write a material.
        stacked = self.options.axes == 2
        for name in ("source_map", "stages", *(SHOWN if stacked else ())):
            parameters.append(make_parameter(name, Annotated[str | None, to_write(name)], None))
        parameters += [make_parameter(name, type_, None) for name, type_ in OPTIONS.items() if stacked]
        if stacked:
            parameters.append(make_parameter("palette", PALETTE, None))
        return [*parameters, make_parameter("count", Threads, None), make_parameter("quiet", Quiet, False)]

    def run(
        self, *, count: int | None, quiet: bool, variants: int | None = None, palette: bool | None = None, **given: Any
    ) -> None:
        """Run the command. Errors about size contain a remedy for larger results."""
        try:
            with collect() as notices, ask(palette):
                self.make(count=count, quiet=quiet, variants=variants, notices=notices, **given)
        except LimitExceeded as error:
            if not self.beyond or error.argument not in ("size", "--size"):
                raise
            # Replace the Python remedy, which does not help on the command line.
            raise LimitExceeded(f"{error.argument}: {error.reason}", remedy=self.beyond) from None

    def make(
        self, *, count: int | None, quiet: bool, notices: Notices, variants: int | None = None, **given: Any
    ) -> None:
        """Run the command. Arguments and outputs are checked before files are read, and before the work."""
        start, options = time.monotonic(), self.options
        stack = Stack.take(given)
        paths: dict[str, str | None] = {name: given.pop(name, None) for name in _outputs.OUTPUTS}
        out = paths["out"] or ""
        values = options.read(given, which=lambda o: not o.file)
        read = _outputs.list_files(text for value in given.values() for text in _outputs.find_texts(value))
        # Check the outputs of all variants.
        places = [paths]
        if variants is not None:
            seeds = range(given["seed"], given["seed"] + as_int(variants, "--variants", 1, 4096))
            places = [_outputs.name_variants(seed, paths) for seed in seeds]
            for each in places:
                _outputs.check_apart(read, each)
                check_free(each["out"] or "")
        for each in places:
            _outputs.check_outputs(each)
        # Read the example first, because the other inputs and the size depend on it.
        first = given[next(o.name for o in options if o.argument)]
        about = About(axes=options.axes, first=first if isinstance(first, str) else "", roles=stack.roles)
        with warnings.catch_warnings(record=True) as early:
            warnings.simplefilter("always")
            values |= options.read(given, about, which=lambda o: o.file and (o.argument or o.name == self.shape))
        example, like = self.find_example(values), self.read_colours(given, out)
        size = self.find_size(values, example)
        material = self.find_material(values)
        spacing = {**self.knows(given), **values}.get(("spacing",))
        volume = _outputs.find_volume(first, options.axes)
        apart = {} if volume is None and spacing is None else {"volume": volume, "spacing": spacing}
        if material is None:
            stack.refuse(paths)
            _outputs.check_output(out, example, size, fills=self.fills)
            deliver: Callable[..., None] = _outputs.deliver
        else:
            for each in places:
                stack.check_outputs(material, each, read)
            deliver = stack.deliver
        steps = spacing or (None if volume is None else io.read_spacing(volume))
        about = replace(about, size=size, like=example, spacing=steps)
        small, made = [], None
        with (
            name_arguments(**options.name_values(given), count="--threads"),
            threads(count),
            show_progress(quiet=quiet) as progress,
            warnings.catch_warnings(record=True) as said,
        ):
            warnings.simplefilter("always")
            values |= options.read(given, about, which=lambda o: o.file and o.path not in values)
            call = options.call({**self.knows(given), **values})
            if any(o.name == "size" and o.required for o in options):
                call["size"] = size
            # Compute and write one result, or each variant as soon as it is finished.
            if variants is None or self.several is None:
                made = options.function(**call, progress=progress)
                if self.keeps and like.georeference and made.image.shape[:2] != example.shape[:2]:
                    ignore(f"{os.path.basename(first)}: its georeference is not written, because the size changed")
                    like = replace(like, georeference=())
                made = replace(made, report=notices.add_to(made.report))
                deliver(made, paths, like=like, **apart)
            else:
                several = self.several(count=variants, **call, progress=progress)
                for seed, each, made in zip(itertools.count(given["seed"]), places, several, strict=False):
                    made = replace(made, report=notices.add_to(made.report))
                    alone = {"--variants": None, "--seed": str(seed) if seed else None}
                    deliver(made, each, like=like, made=_provenance.narrow(options=alone, seed=seed))
                    keep(each["out"] or "")
                    small.append(_outputs.shrink(made.image))
        for warning in (*early, *said):
            if issubclass(warning.category, UserWarning):
                note(str(warning.message), quiet=quiet)
        if small and material is None:
            with _outputs.write_output(out) as temporary:
                sheet_notes = replace(like, georeference=(), multiplied=None)
                io.write(temporary, _outputs.make_contact_sheet(small), notes=sheet_notes)
        assert made is not None
        sheet = " and their contact sheet" if material is None else ""
        many = f"{len(small)} textures{sheet}, each " if small else ""
        what = f"{many}{describe(np.asarray(made.image), options.axes)}{self.says(made)}"
        note(f"wrote {out}: {what}, in {time.monotonic() - start:.1f} s", quiet=quiet)

    def find_material(self, values: Mapping[tuple[str, ...], Any]) -> Material | None:
        """Return the input material whose maps the result also has, or None.

        Inputs that only guide the result are ignored.
        """
        names = getattr(self.options.function, "takes", ())
        several = (value for path, value in values.items() if path[0] in names)
        every = (each for value in several for each in (value if isinstance(value, list) else [value]))
        return next((each for each in every if isinstance(each, Material) and not isinstance(each, SingleMap)), None)

    def find_example(self, values: Mapping[tuple[str, ...], Any]) -> Array:
        """Return the pixels of the first input, as an array."""
        first = values[next(o.path for o in self.options if o.argument)]
        first = first[0] if isinstance(first, list) else first
        # An analysis contains its image, and a material contains an image that represents it.
        return np.asarray(first.base if isinstance(first, Material) else getattr(first, "image", first))

    def read_colours(self, given: Mapping[str, Any], out: str) -> io.Metadata:
        """Return the metadata of the first input that the result keeps, such as its colour profile."""
        first = given[next(o.name for o in self.options if o.argument)]
        name = first[0] if isinstance(first, list) else first
        notes = io.read_metadata(name) if os.path.isfile(name) else io.Metadata()
        kept = self.fills or self.keeps
        if kept and notes.georeference and Path(out).suffix.lower() not in (".tif", ".tiff"):
            ignore(f"{os.path.basename(name)}: its georeference is not written, because only TIFF files store it")
        notes = notes if kept else replace(notes, georeference=())
        role = guess_role(Path(name).stem)
        if role is not None and not role.coloured:
            notes = replace(notes, multiplied=None)
        return replace(notes, made=None, density=notes.density if self.scaled else None)

    def find_size(self, values: Mapping[tuple[str, ...], Any], example: Array) -> tuple[int, ...]:
        """Return the approximate size of the result before it is computed."""
        if ("size",) in values:
            return tuple(values["size",])
        if (self.shape,) in values and not isinstance(values[self.shape,], str):
            return tuple(values[self.shape,].shape[: self.options.axes])
        return tuple(self.times * n for n in example.shape[: self.options.axes])

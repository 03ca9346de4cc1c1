"""Commands that make one thing of another: each is a verb, the kinds of its inputs, and what its options cannot be made of."""

from __future__ import annotations

import itertools
import os
import time
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import wraps
from typing import Annotated, Any

import numpy as np
import typer

from texrs import io
from texrs._arrays import as_int
from texrs._threads import threads
from texrs._typing import Array
from texrs.cli import _outputs, _provenance
from texrs.cli._console import keep, note, show_progress
from texrs.cli._kinds import (
    CORNERS,
    DIRECTION,
    EACH,
    ENTRIES,
    ENTRY,
    EXAMPLE,
    GROUNDS,
    HOLE,
    LAYOUT,
    MAP_OR_AUTO,
    MASK,
    NUMBERS,
    SEEN,
    SOURCE,
    TARGET,
    UNKNOWN,
    VOLUME,
    Kind,
)
from texrs.cli._options import Options, as_command, make_parameter
from texrs.cli._outputs import Quiet, Threads, describe, name_arguments, to_write
from texrs.cli._provenance import check_free
from texrs.cli._stacks import OPTIONS, SHOWN, Stack
from texrs.cli._texts import PLANE, About
from texrs.errors import InvalidInput
from texrs.materials import Material
from texrs.synthesis import Synthesis

VARIANTS = typer.Option(
    help="Make so many, OUT-SEED each, and OUT as their contact sheet.", show_default="one, in OUT", metavar="N"
)


@dataclass(frozen=True, slots=True)
class Verb:
    """A function that makes a `Synthesis`, as a command."""

    options: Options
    times: int = 1
    """How large the result is, of the sides of the first input, where no size is given."""
    shape: str = ""
    """The file whose shape the result has, where one is given and no size is."""
    several: Callable[..., Iterable[Synthesis]] | None = None
    """The function that makes ``count`` of them."""
    says: Callable[[Synthesis], str] = lambda result: ""
    """What else is to be said of the result."""
    scaled: bool = True
    """Whether a pixel of the result is as large as one of the first input."""
    knows: Callable[[Mapping[str, Any]], Mapping[tuple[str, ...], Any]] = lambda given: {}
    """Values that the texts of the options tell, where they are not given."""

    def make_command(self) -> Callable[..., None]:
        """Return the function of the command."""
        parameters = [o.make_parameter() for o in self.options if o.argument]
        parameters.append(make_parameter("out", Annotated[str, to_write("out")]))
        parameters += [o.make_parameter() for o in self.options if not o.argument]
        if self.several is not None:
            parameters.append(make_parameter("variants", Annotated[int | None, VARIANTS], None))
        # Materials are pictures.
        stacked = self.options.axes == 2
        for name in ("map", "stages", *(SHOWN if stacked else ())):
            parameters.append(make_parameter(name, Annotated[str | None, to_write(name)], None))
        parameters += [make_parameter(name, type_, None) for name, type_ in OPTIONS.items() if stacked]
        parameters += [make_parameter("count", Threads, None), make_parameter("quiet", Quiet, False)]
        return as_command(self.run, parameters)

    def run(self, *, count: int | None, quiet: bool, variants: int | None = None, **given: Any) -> None:
        """Do the command: what can be checked is checked before any file is read, and before the work."""
        start, options = time.monotonic(), self.options
        stack = Stack.take(given)
        paths: dict[str, str | None] = {name: given.pop(name, None) for name in _outputs.OUTPUTS}
        out = paths["out"] or ""
        values = options.read(given, which=lambda o: not o.file)
        read = _outputs.list_files(text for value in given.values() for text in _outputs.find_texts(value))
        places = [paths]
        if variants is not None:
            seeds = range(given["seed"], given["seed"] + as_int(variants, "--variants", 1, 4096))
            places = [_outputs.name_variants(seed, paths) for seed in seeds]
            for each in places:
                _outputs.check_apart(read, each)
                check_free(each["out"] or "")
        for each in places:
            _outputs.check_outputs(each)
        about = About(axes=options.axes, roles=stack.roles)
        with warnings.catch_warnings(record=True) as early:
            warnings.simplefilter("always")
            values |= options.read(given, about, which=lambda o: o.file and (o.argument or o.name == self.shape))
        example, like = self.find_example(values), self.read_colours(given)
        size = self.find_size(values, example)
        material = self.find_material(values)
        if material is None:
            stack.refuse(paths)
            _outputs.check_output(out, example, size)
            deliver: Callable[..., None] = _outputs.deliver
        else:
            for each in places:
                stack.check_outputs(material, each, read)
            deliver = stack.deliver
        about = replace(about, size=size, like=example)
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
            if variants is None or self.several is None:
                made = options.function(**call, progress=progress)
                deliver(made, paths, like=like)
            else:
                several = self.several(count=variants, **call, progress=progress)
                for seed, each, made in zip(itertools.count(given["seed"]), places, several, strict=False):
                    alone = {"--variants": None, "--seed": str(seed) if seed else None}
                    deliver(made, each, like=like, made=_provenance.narrow(options=alone, seed=seed))
                    keep(each["out"] or "")
                    small.append(_outputs.shrink(made.image))
        for warning in (*early, *said):
            if issubclass(warning.category, UserWarning):
                note(str(warning.message), quiet=quiet)
        if small and material is None:
            with _outputs.write_output(out, like=like) as temporary:
                io.write(temporary, _outputs.make_contact_sheet(small))
        assert made is not None
        sheet = " and their contact sheet" if material is None else ""
        many = f"{len(small)} textures{sheet}, each " if small else ""
        what = f"{many}{describe(np.asarray(made.image), options.axes)}{self.says(made)}"
        note(f"wrote {out}: {what}, in {time.monotonic() - start:.1f} s", quiet=quiet)

    def find_material(self, values: Mapping[tuple[str, ...], Any]) -> Material | None:
        """Return the material that is read, if there is one."""
        every = (each for value in values.values() for each in (value if isinstance(value, list) else [value]))
        return next((each for each in every if isinstance(each, Material)), None)

    def find_example(self, values: Mapping[tuple[str, ...], Any]) -> Array:
        """Return the pixels of the first input."""
        first = values[next(o.path for o in self.options if o.argument)]
        first = first[0] if isinstance(first, list) else first
        # Analysed elements hold theirs, and materials have one that shows them.
        return np.asarray(first.base if isinstance(first, Material) else getattr(first, "image", first))

    def read_colours(self, given: Mapping[str, Any]) -> io.Notes:
        """Return what the first input says of its colours, which are those of the result, and of its pixels."""
        first = given[next(o.name for o in self.options if o.argument)]
        name = first[0] if isinstance(first, list) else first
        notes = io.read_notes(name) if os.path.isfile(name) else io.Notes()
        return replace(notes, made=None, density=notes.density if self.scaled else None)

    def find_size(self, values: Mapping[tuple[str, ...], Any], example: Array) -> tuple[int, ...]:
        """Return about how large the result will be."""
        if ("size",) in values:
            return tuple(values["size",])
        if (self.shape,) in values and not isinstance(values[self.shape,], str):
            return tuple(values[self.shape,].shape[: self.options.axes])
        return tuple(self.times * n for n in example.shape[: self.options.axes])


# --- the verbs -------------------------------------------------------------------------------------------------------

NAMES = (
    "complete",
    "design",
    "extend",
    "perspective",
    "rectify",
    "remove",
    "self-splice",
    "solid",
    "splice",
    "synthesize",
    "tile",
)
TWICE = {"size": "twice the exemplar"}
GROWN = {"constraints": "constraint", "guide": "guide", "exemplar.image": "exemplar"}


def make_verb(name: str) -> Verb:
    """Return the verb of a name; its function is imported now."""
    match name:
        case "complete":
            from texrs.completion import complete

            kinds = {"exemplar": SOURCE, "scale_map": MAP_OR_AUTO, "exemplar_scale_map": MAP_OR_AUTO}
            names = {"exemplar": "from", "exemplar_scale_map": "from-scale-map", "kind": "scale-kind"}
            options = Options(complete, arguments={"image": UNKNOWN, "hole": HOLE}, kinds=kinds, names=names)
            return Verb(options, says=tell_sizes)
        case "design":
            from texrs.papers.design import design, design_variants

            options = Options(design, arguments={"exemplar": ENTRIES}, names={"elements": "element"})
            return Verb(options, times=2, several=design_variants)
        case "perspective":
            from texrs.papers.perspective import perspective

            options = Options(
                perspective,
                arguments={"exemplar": EXAMPLE},
                kinds={"scale_map": SEEN, "target": TARGET, "direction": DIRECTION},
                names={"kind": "scale-kind"},
            )
            return Verb(options, times=2, shape="target", says=tell_sizes, knows=read_exemplar_camera)
        case "rectify":
            from texrs.rectification import rectify

            return replace(_see(rectify), scaled=False)
        case "extend":
            from texrs.extension import extend

            return _see(extend)
        case "remove":
            from texrs.removal import remove

            return _see(remove, mask=MASK)
        case "solid":
            from texrs.papers.solid import solid

            return _grow(solid, VOLUME, 3)
        case "synthesize":
            from texrs.papers.solid import synthesize

            return _grow(synthesize, EXAMPLE, 2)
        case "splice":
            from texrs.papers.splice import splice

            return Verb(Options(splice, arguments={"a": ENTRY, "b": LAYOUT}), says=count_moved)
        case "self-splice":
            from texrs.papers.splice import self_splice

            return Verb(Options(self_splice, arguments={"a": ENTRY}), says=count_moved)
        case _:
            from texrs.tiling import tile

            return Verb(Options(tile, arguments={"image": EXAMPLE}))


def count_moved(result: Synthesis) -> str:
    """Return how many elements moved."""
    return f", {len(result.report['matches'])} elements moved"


def tell_sizes(result: Synthesis) -> str:
    """Return of what sizes were measured, and how surely."""
    found = result.report["measured"]
    if found is None:
        return ""
    where = {"curved": "on a curved surface", "free": "place by place", "even": "nowhere"}.get(
        found["shape"], "on a plane"
    )
    if found["plane"] is not None:
        where += f" (slant {found['plane']['slant']:.0f}, tilt {found['plane']['tilt']:.0f})"
    return f", sizes measured {where} with a confidence of {found['confidence']:.2f}"


def read_exemplar_camera(given: Mapping[str, Any]) -> dict[tuple[str, ...], Any]:
    """Return the angle of view that an exemplar states."""
    said = (given["scale_map"] or "").startswith(PLANE)
    fovs = [] if said else list(read_camera({"image": given["exemplar"]}).values())
    return {("fov",): fovs[0]} if fovs else {}


def read_camera(given: Mapping[str, Any]) -> dict[tuple[str, ...], Any]:
    """Return the angle of view that the photograph states."""
    fov = None if given["image"].startswith(_outputs.SAMPLE) else io.read_fov(given["image"])
    return {} if fov is None else {("view", "fov"): fov}


def say_planes(result: Synthesis) -> str:
    """Return how the planes lie that were followed."""
    said = []
    for each in result.report.get("planes", [result.report]):
        plane = each["plane"]
        if plane is None:
            said.append(", no plane followed")
            continue
        found = f", found with confidence {plane['confidence']:.2f}" if each["found"] else ""
        said.append(f", slant {plane['slant']:.1f} and tilt {plane['tilt']:.1f}{found}")
    return "".join(said)


def make_views(
    corners: list[Any] | None = None,
    slant: list[float | None] | None = None,
    tilt: list[float | None] | None = None,
    fov: list[float | None] | float | None = None,
    ground: list[Array | None] | None = None,
) -> Any:
    """Return what is said of each plane: of one for each ground, or of the only one."""
    from texrs.planes import View

    given = {"corners": corners, "slant": slant, "tilt": tilt, "fov": fov, "ground": ground}
    several = {n: value if isinstance(value, list) else [value] for n, value in given.items() if value is not None}
    count = len(several.get("ground", [None]))
    # One camera sees all of them.
    several |= {"fov": several["fov"] * count} if len(several.get("fov", [])) == 1 else {}
    for name, values in several.items():
        if len(values) != count:
            many = f"one for each of {count} grounds, in their order, or 'found'" if count > 1 else "to be given once"
            raise InvalidInput(f"{name}: needs {many}; it was given {len(values)} times")
    fields: list[dict[str, Any]] = [{name: values[k] for name, values in several.items()} for k in range(count)]
    views = [View(**each) for each in fields]
    return views if count > 1 else views[0]


def _see(verb: Callable[..., Synthesis], **more: Kind) -> Verb:
    left = {"view.plane": "the command says how it lies by corners or angles"}
    kinds = {"ground": GROUNDS, "corners": CORNERS, "slant": EACH, "tilt": EACH, "fov": EACH}
    options = Options(
        verb,
        arguments={"image": EXAMPLE, **more},
        kinds={f"view.{name}": kind for name, kind in kinds.items()},
        leave=left,
        makers={"view": make_views},
    )
    return Verb(options, says=say_planes, knows=read_camera)


def _grow(verb: Callable[..., Synthesis], kind: Kind, axes: int) -> Verb:
    from texrs.exemplar import Exemplar

    @wraps(Exemplar)
    def make_exemplar(image: Any, **said: Any) -> Any:
        if not isinstance(image, Material):
            return Exemplar(image, **said)
        for name in said.keys() - {"axes"}:
            raise InvalidInput(
                f"--{name.replace('_', '-')}: is for a picture; of a material the roles of its maps say it"
            )
        return image

    options = Options(
        verb,
        arguments={"exemplar.image": kind},
        kinds={"guide.exemplar": NUMBERS, "guide.output": NUMBERS},
        names=GROWN,
        makers={"exemplar": make_exemplar},
        optional=TWICE,
        axes=axes,
    )
    return Verb(options, times=2)

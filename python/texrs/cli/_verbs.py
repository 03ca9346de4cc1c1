"""Define the commands for functions of the library: the kinds of their inputs, and their special options."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import wraps
from pathlib import Path
from typing import Any

from texrs import io
from texrs._notices import assume
from texrs._typing import Array
from texrs.cli import _outputs
from texrs.cli._kinds import (
    CORNERS,
    DIRECTION,
    EACH,
    ENTRIES,
    ENTRY,
    EXAMPLE,
    FILLED,
    GROUNDS,
    LAYOUT,
    MAP_OR_AUTO,
    NUMBERS,
    OBJECT,
    SEEN,
    SOURCE,
    TARGET,
    UNKNOWN,
    UNKNOWN_VOLUME,
    VOLUME,
    Kind,
)
from texrs.cli._options import Options
from texrs.cli._places import check_corners
from texrs.cli._readers import is_number, read_stated_spacing
from texrs.cli._texts import PLANE
from texrs.cli._verb import Verb
from texrs.errors import FileError, InvalidInput
from texrs.io.grids import holds_volume
from texrs.materials import Material, guess_role
from texrs.synthesis import Synthesis

# --- the verbs -------------------------------------------------------------------------------------------------------

NAMES = (
    "inpaint",
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
TILES = "texrs tiles creates an unbounded design, and writes windows of any size"
TWICE = {"size": "twice the exemplar", "spacing": "as the file states"}
GROWN = {"constraints": "constraint", "guide": "guide", "exemplar.image": "exemplar"}


def make_verb(name: str) -> Verb:
    """Create the command with a given name. The module of its function is imported now."""
    match name:
        # Each case imports only its own function, so that other commands start quickly.
        case "inpaint":
            from texrs.inpainting import inpaint

            kinds = {"exemplar": SOURCE, "scale_map": MAP_OR_AUTO, "exemplar_scale_map": MAP_OR_AUTO}
            arguments, marked = {"image": UNKNOWN, "mask.marks": FILLED}, {"mask.marks": "mask"}
            flat = Options(inpaint, arguments=arguments, kinds=kinds, names=marked, optional={"marks": ""})
            deep = Options(
                inpaint,
                arguments={**arguments, "image": UNKNOWN_VOLUME},
                kinds=kinds,
                names=marked,
                optional={"marks": ""},
                axes=3,
            )
            return Filling(
                flat,
                says=lambda made: tell_filled(made) + tell_sizes(made),
                fills=True,
                deep=Verb(deep, says=tell_filled_volume, fills=True),
            )
        case "design":
            from texrs.cli._check import tell_tiling
            from texrs.papers.design import design, design_variants

            options = Options(design, arguments={"exemplar": ENTRIES}, names={"elements": "element"})
            return Verb(options, times=2, several=design_variants, says=tell_tiling, beyond=TILES)
        case "perspective":
            from texrs.papers.perspective import perspective

            options = Options(
                perspective,
                arguments={"exemplar": EXAMPLE},
                kinds={"scale_map": SEEN, "target": TARGET, "direction": DIRECTION},
                optional={"target_green": "from the file name, else up"},
            )
            return Verb(options, times=2, shape="target", says=tell_sizes, knows=read_cameras)
        case "rectify":
            from texrs.rectification import rectify

            return replace(_see(rectify), scaled=False)
        case "extend":
            from texrs.extension import extend

            return _see(extend)
        case "remove":
            from texrs.removal import remove

            verb = _see(remove, {"mask.marks": "mask"}, **{"mask.marks": OBJECT})
            return replace(verb, says=lambda made: tell_filled(made) + say_planes(made), fills=True)
        case "solid":
            from texrs.papers.solid import solid

            return _grow(solid, VOLUME, 3)
        case "synthesize":
            from texrs.papers.solid import synthesize

            return _grow(synthesize, EXAMPLE, 2)
        case "splice":
            from texrs.papers.splice import splice

            return Verb(Options(splice, arguments={"elements": ENTRY, "layout": LAYOUT}), says=count_moved)
        case "self-splice":
            from texrs.papers.splice import self_splice

            return Verb(Options(self_splice, arguments={"elements": ENTRY}), says=count_moved)
        case _:
            from texrs.cli._check import tell_tiling
            from texrs.tiling import tile

            return Verb(Options(tile, arguments={"image": EXAMPLE}), says=tell_tiling, keeps=True, beyond=TILES)


@dataclass(frozen=True, slots=True)
class Filling(Verb):
    """A command for images that also processes volumes."""

    deep: Verb | None = None

    def run(self, **given: Any) -> None:
        """Fill a volume if the mask is a volume, or if the values of a volume define the hole. Otherwise fill an image."""
        mask = given["mask_marks"]
        named = given["image"] if mask is None or mask in FILLED.words or is_number(mask) else mask
        deep = None
        # Ignore an unreadable file here, because the reader raises an error later.
        with suppress(FileError):
            deep = self.deep if not named.startswith(_outputs.SAMPLE) and holds_volume(named) else None
        Verb.run(deep or self, **given)


def count_moved(result: Synthesis) -> str:
    """Return a text with the number of elements that moved."""
    return f", {len(result.report['matches'])} elements moved"


def tell_filled(result: Synthesis) -> str:
    """Return a text with the filled share of the image."""
    return f", {100 * result.report['filled']:.3g} % filled"


def tell_filled_volume(result: Synthesis) -> str:
    """Return a text with the filled share of a volume, and the step at the border of the hole."""
    from texrs.inpainting.volumes import SEEN

    step = dict(result.report["candidates"])[result.report["patch_size"]]
    visible = "" if step <= SEEN else " and visible: try --patch-size, --seed or --boundary-width"
    return f"{tell_filled(result)}, step at its border {step:.2f} (1: as elsewhere){visible}"


def tell_sizes(result: Synthesis) -> str:
    """Return a text with the source and confidence of measured sizes, or an empty text without a measurement."""
    found = result.report["measured"]
    if found is None:
        return ""
    where = {"curved": "on a curved surface", "free": "place by place", "even": "as equal everywhere"}.get(
        found["shape"], "on a plane"
    )
    if found["plane"] is not None:
        where += f" (slant {found['plane']['slant']:.0f}, tilt {found['plane']['tilt']:.0f})"
    return f", sizes measured {where} with a confidence of {found['confidence']:.2f}"


def read_cameras(given: Mapping[str, Any]) -> dict[tuple[str, ...], Any]:
    """Return options found in files: the angle of view of an exemplar, and the y direction of a target's normals."""
    found = read_exemplar_camera(given)
    target = given["target"] or ""
    if not target.startswith(PLANE) and (role := guess_role(Path(target).stem)) is not None and role.down:
        found["target_green",] = "down"
        if given["target_green"] is None:
            assume(f"{target}: read with y down, because of its name")
    return found


def read_exemplar_camera(given: Mapping[str, Any]) -> dict[tuple[str, ...], Any]:
    """Return the option for the angle of view of an exemplar, or no option if its metadata do not state the angle."""
    said = (given["scale_map"] or "").startswith(PLANE)
    fovs = [] if said else list(read_camera({"image": given["exemplar"]}).values())
    return {("fov",): fovs[0]} if fovs else {}


def read_camera(given: Mapping[str, Any]) -> dict[tuple[str, ...], Any]:
    """Return the option for the angle of view of a photograph, or no option if its metadata do not state the angle."""
    fov = None if given["image"].startswith(_outputs.SAMPLE) else io.read_fov(given["image"])
    return {} if fov is None else {("view", "fov"): fov}


def read_voxels(given: Mapping[str, Any]) -> dict[tuple[str, ...], Any]:
    """Return the option for the voxel spacing of a volume, or no option if its file does not state the spacing."""
    spacing = read_stated_spacing(given["exemplar_image"])
    return {} if spacing is None else {("spacing",): spacing}


def say_planes(result: Synthesis) -> str:
    """Return a text about the slant and tilt of the planes that were used."""
    from texrs.planes.sizes import SURE

    said = []
    for each in result.report.get("planes", [result.report]):
        plane = each["plane"]
        if plane is None:
            said.append(", without perspective")
            continue
        sure = plane["confidence"] or 0.0
        found = f", found with confidence {sure:.2f}" if each["found"] else ""
        found += " (unsure: give --corners or --slant)" if each["found"] and sure < SURE else ""
        said.append(f", slant {plane['slant']:.1f} and tilt {plane['tilt']:.1f}{found}")
    return "".join(said)


def make_views(
    corners: list[Any] | None = None,
    slant: list[float | None] | None = None,
    tilt: list[float | None] | None = None,
    fov: list[float | None] | float | None = None,
    ground: list[Array | None] | None = None,
) -> Any:
    """Return the views of the planes as a list, or the view itself if there is only one plane."""
    from texrs.planes import PlaneView

    given = {"corners": corners, "slant": slant, "tilt": tilt, "fov": fov, "ground": ground}
    several = {n: value if isinstance(value, list) else [value] for n, value in given.items() if value is not None}
    count = len(several.get("ground", [None]))
    # Use the same angle of view for all planes, because one camera took the photograph.
    several |= {"fov": several["fov"] * count} if len(several.get("fov", [])) == 1 else {}
    for name, values in several.items():
        if len(values) != count:
            many = f"given for each of {count} planes, in the order of --ground" if count > 1 else "given once"
            raise InvalidInput(f"{name}: must be {many}; got {len(values)} values")
    fields: list[dict[str, Any]] = [{name: values[k] for name, values in several.items()} for k in range(count)]
    views = [PlaneView(**each) for each in fields]
    return views if count > 1 else views[0]


def _see(verb: Callable[..., Synthesis], names: Mapping[str, str] | None = None, **more: Kind) -> Verb:
    left = {"view.plane": "the command says how it lies by corners or angles"}
    kinds = {"ground": GROUNDS, "corners": CORNERS, "slant": EACH, "tilt": EACH, "fov": EACH}

    @wraps(verb)
    def check_and_see(image: Any, *args: Any, view: Any = None, **given: Any) -> Synthesis:
        for each in view if isinstance(view, list) else [view]:
            if each is not None and each.corners is not None:
                check_corners(each.corners, image.shape)
        return verb(image, *args, view=view, **given)

    options = Options(
        check_and_see,
        arguments={"image": EXAMPLE, **more},
        kinds={f"view.{name}": kind for name, kind in kinds.items()},
        names=names,
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
                f"--{name.replace('_', '-')}: not available for materials, which use the roles of their maps"
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
    from texrs.cli._parts import BEYOND, InParts

    return InParts(options, times=2, beyond=BEYOND, knows=read_voxels if axes == 3 else lambda given: {})

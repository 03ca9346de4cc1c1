"""The command that paints meshes: ``texrs paint``."""

from __future__ import annotations

import os
import shutil
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

import typer

from texrs._threads import threads
from texrs.cli import _outputs
from texrs.cli._console import note, show_progress
from texrs.cli._kinds import Kind
from texrs.cli._options import Options, take_options
from texrs.cli._outputs import Quiet, Threads, make_option, name_arguments, to_write
from texrs.cli._provenance import check_free
from texrs.cli._readers import read_stated_spacing, read_volume
from texrs.cli._stacks import Roles, read_roles
from texrs.cli._texts import About
from texrs.errors import InvalidInput
from texrs.io.temporary import name_prefix
from texrs.materials import Material
from texrs.painting import field_on_surface, find_scale, texture_mesh
from texrs.painting.files import check_suffix
from texrs.painting.reading import read_mesh
from texrs.papers.solid.window import SolidTexture


def read_block(text: str, about: About) -> Any:
    """Read a volume, or a material from a folder of volumes."""
    if not os.path.isdir(text):
        return read_volume(text)
    with name_arguments(roles="--role", maps=text):
        return Material.read(text, roles=about.roles, axes=3)


BLOCK = Kind(
    "FILE|FOLDER",
    read_block,
    "A volume file, a folder of volumes that are the maps of a material, or sample:NAME.",
    file=True,
)
TEXTURE = Options(SolidTexture, arguments={"exemplar": BLOCK}, leave={"cache_bytes": "one process makes all"}, axes=3)
MESH = Kind("FILE", lambda text, about: text)
PAINTED = Options(
    texture_mesh,
    only=("mesh", "scale", "atlas", "padding", "unwrap"),
    arguments={"mesh": MESH},
    names={"scale": "voxels"},
)
FOLLOWED = Options(
    field_on_surface,
    only=("directions", "along"),
    kinds={
        "directions": Kind(
            "AXIS|around:AXIS|curvature|FILE.json",
            lambda text, about: text,
            "AXIS is x, y, z or three numbers such as 1,0,1.",
        )
    },
    optional={"directions": "the texture is not rotated"},
)


@take_options(PAINTED, TEXTURE, FOLLOWED)
def paint_command(
    out: Annotated[
        str, to_write("out", "OUT.glb", "Mesh to write: .glb, .gltf, .obj (with .mtl), or .ply for vertex colours.")
    ],
    given: dict[str, Any],
    corners: Annotated[bool, typer.Option("--vertices", help="Write vertex colours instead of an atlas.")] = False,
    bits: Annotated[
        int | None, make_option("8|16", "Bits per channel of the images. Default: 8 if all maps have 8, else 16.")
    ] = None,
    role: Roles = None,
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Paint a mesh with a solid texture, made from a volume."""
    start, mesh = time.monotonic(), given["mesh"]
    if bits not in (None, 8, 16):
        raise InvalidInput(f"--bits: must be one of 8, 16; got {bits}")
    with name_arguments(**{out: "--out"}):
        check_suffix(out, baked=not corners)
    folder = os.path.dirname(os.path.realpath(out))
    _outputs.check_output(out)
    values = {**PAINTED.read(given), **FOLLOWED.read(given), **TEXTURE.read(given, which=lambda o: not o.file)}
    if ("directions",) in values and given["field"] is not None:
        raise InvalidInput("--directions: cannot be combined with --field")
    if ("along",) in values and ("directions",) not in values:
        raise InvalidInput("--along: must be combined with --directions")
    # A folder of maps does not state a voxel spacing.
    whole = given["exemplar"] if not os.path.isdir(given["exemplar"]) else None
    spacing = values.get(("spacing",)) or read_stated_spacing(whole)
    values |= {("spacing",): spacing} if spacing else {}
    values |= TEXTURE.read(given, About(axes=3, roles=read_roles(role), spacing=spacing), which=lambda o: o.file)
    call, painted, followed = (
        o.call({p: v for p, v in values.items() if p in {i.path for i in o}}) for o in (TEXTURE, PAINTED, FOLLOWED)
    )
    if role and not isinstance(call["exemplar"], Material):
        raise InvalidInput("--role: only available for materials, which are folders of maps")
    painted.pop("mesh")
    surface = read_mesh(mesh)
    names = {n: v for o in (FOLLOWED, PAINTED, TEXTURE) for n, v in o.name_values(given).items()}
    with name_arguments(**names, count="--threads"), threads(count), show_progress(quiet=quiet) as progress:
        texture = SolidTexture(**call)
        painted["atlas"] = None if corners else painted.get("atlas", given["atlas"])
        if followed:
            # Find the scale first, because the field depends on the size of the texture on the mesh.
            if "scale" not in painted:
                painted["scale"] = find_scale(surface, texture, **painted)
            texture = SolidTexture(
                **call | {"field": field_on_surface(surface[:2], **followed, scale=painted["scale"])}
            )
        made = texture_mesh(surface, texture, **painted, progress=progress)
    depth: Any = bits
    with TemporaryDirectory(prefix=name_prefix(), dir=folder) as beside:
        # Write the files under their final names in a temporary folder first, because they refer to each other.
        *others, last = reversed(made.save(Path(beside, os.path.basename(out)), depth=depth))
        targets = [os.path.join(folder, file.name) for file in others]
        for target in targets:
            check_free(target)
        for file, target in zip(others, targets, strict=True):
            with _outputs.write_output(target, inside=False) as temporary:
                shutil.copyfile(file, temporary)
        with _outputs.write_output(out) as temporary:
            shutil.copyfile(last, temporary)
    many = f"{len(made.sets)} texture sets" if len(made.sets) > 1 else "an atlas"
    size_ = f"{len(made.vertices)} corners" if made.uv is None else f"{many} of {given['atlas']} x {given['atlas']}"
    note(f"wrote {out}: {len(made.faces)} triangles, {size_}, in {time.monotonic() - start:.1f} s", quiet=quiet)


COMMAND = paint_command

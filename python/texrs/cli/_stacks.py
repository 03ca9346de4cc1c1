"""Read and write materials, as folders of maps or as layers of an EXR file."""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

import typer

from texrs import io
from texrs._notices import collect
from texrs.cli import _outputs, _provenance
from texrs.cli._provenance import check_free, expand_braces
from texrs.errors import FileError, InvalidInput
from texrs.io.exr_layers import list_channels
from texrs.materials import Material
from texrs.materials.conventions import CONVENTIONS, as_convention
from texrs.materials.converting import convert
from texrs.materials.files import SMALLER, choose_suffix, split_suffix
from texrs.synthesis import Synthesis

PANEL = "Materials"
DEPTHS = (8, 16, 32)
LAYERED = ".exr"
SHOWN = ("preview", "mipmaps", "gltf", "materialx")
"""Outputs that only materials have."""


def _option(type_: Any, flag: str, metavar: str, text: str, default: str | bool = False) -> Any:
    """Return typer's description of an option that only materials have."""
    return Annotated[
        type_ | None, typer.Option(flag, metavar=metavar, help=text, show_default=default, rich_help_panel=PANEL)
    ]


Roles = Annotated[
    list[str] | None,
    typer.Option(
        "--role",
        metavar="MAP=ROLE",
        help="Role of a map whose name does not state it. The option may be repeated.",
        show_default=False,
        rich_help_panel=PANEL,
    ),
]
OPTIONS: dict[str, Any] = {
    "role": Roles,
    "depth": _option(
        int,
        "--depth",
        "8|16|32",
        "Bits per channel of the maps of a material: 8 or 16 (integers), or 32 (floats).",
        "those of each map",
    ),
    "format": _option(
        str,
        "--format",
        "png|tif|exr",
        "File format of the maps of a material.",
        "png, or a format that can store the map",
    ),
    "pack": _option(
        str,
        "--pack",
        "orm|none",
        "Packing of occlusion, roughness and metallic: orm for one map, none for separate maps.",
        "as in the input",
    ),
    "convention": _option(
        str,
        "--convention",
        "NAME",
        f"Convention for names, packing and y direction of the maps: {', '.join(CONVENTIONS)}.",
        "those of the input",
    ),
}
"""Options for reading and writing materials, by parameter."""


@dataclass(frozen=True, slots=True)
class Stack:
    """Options for reading and writing a material."""

    roles: Mapping[str, str]
    depth: int | None
    suffix: str | None
    pack: str | None
    convention: str | None

    @classmethod
    def take(cls, given: dict[str, Any]) -> Stack:
        """Remove these options from the arguments of a command, and check them."""
        roles, depth, suffix, pack, convention = (given.pop(name, None) for name in OPTIONS)
        said = read_roles(roles)
        if depth not in (None, *DEPTHS):
            raise InvalidInput(f"--depth: must be one of 8, 16, 32; got {depth}")
        if suffix not in (None, "png", "tif", "exr"):
            raise InvalidInput(f"--format: must be one of png, tif, exr; got {suffix!r}")
        if pack not in (None, "orm", "none"):
            raise InvalidInput(f"--pack: must be one of orm, none; got {pack!r}")
        if convention is not None:
            as_convention(convention, "--convention")
            if pack is not None:
                raise InvalidInput("--pack: cannot be combined with --convention, which specifies the packing")
        return cls(said, depth, None if suffix is None else f".{suffix}", pack, convention)

    def list_writing(self) -> dict[str, object]:
        """Return the options that change how a material is written, with their values."""
        return {
            "--depth": self.depth,
            "--format": self.suffix,
            "--pack": self.pack,
            "--convention": self.convention,
        }

    def refuse(self, paths: Mapping[str, str | None]) -> None:
        """Raise an error if options are given that only apply to materials."""
        given = {"--role": self.roles, **self.list_writing()}
        given |= {f"--{name}": paths.get(name) for name in SHOWN}
        for flag, value in given.items():
            if value:
                raise InvalidInput(
                    f"{flag}: only available for materials, which are folders of maps or EXR files of layers"
                )

    def check_outputs(self, material: Material, paths: Mapping[str, str | None], read: Sequence[str]) -> None:
        """Check before the work that all files can be written, and that they replace neither inputs nor other files."""
        out = paths["out"] or ""
        if Path(out).suffix.lower() == LAYERED:
            if self.suffix or self.depth or self.pack or self.convention:
                raise InvalidInput(
                    "--out: must be a folder with --depth, --format, --pack or --convention; a file of layers keeps "
                    "each map as it is"
                )
            _outputs.check_output(out)
            return
        # `texrs rerun` passes a name with .npz for results that are not needed.
        if split_suffix(out)[1] not in ("", ".npz") and not os.path.isdir(out):
            raise InvalidInput(f"--out: must be a folder or one {LAYERED} file for the maps of a material, got {out!r}")
        _outputs.check_folder(out)
        there = Path(out)
        while not there.exists():
            there = there.parent
        for name, each in material._list_files(self.pack, self.convention).items():
            file = f"{each.file or name}{self.suffix or choose_suffix(each, self.depth, material.axes)}"
            _outputs.check_apart(read, {"out": os.path.join(out, file)})
            check_free(os.path.join(out, file))
            # Try to write in the folder, or in the folder where it will be created.
            _outputs.check_output(
                str(there / f".texrs-{file}"), convert(name, each, self.depth, material.axes).pixels, material.shape
            )

    def save(self, material: Material, folder: Path, *, mipmaps: bool = False) -> list[Path]:
        """Write the maps to a folder. If ``mipmaps`` is True, also write them at half, quarter and smaller sizes."""
        depth: Any = self.depth
        pack: Any = self.pack
        how = {"pack": pack, "convention": self.convention, "mipmaps": mipmaps}
        return material.save(folder, depth=depth, suffix=self.suffix, **how)

    def save_smaller(self, material: Material, folder: Path) -> None:
        """Write only the smaller versions of the maps, each half as large as the previous one."""
        for file in self.save(material, folder, mipmaps=True):
            if file.parent == folder:
                file.unlink()
            else:
                file.rename(folder / file.name)
        (folder / SMALLER).rmdir()

    def deliver(
        self,
        result: Synthesis,
        paths: Mapping[str, str | None],
        *,
        like: io.Metadata | None = None,
        made: _provenance.Record | None = None,
        option: str = "out",
    ) -> None:
        """Write the maps of a result, and its additional outputs."""
        material, out = result.material, paths["out"] or ""
        assert material is not None
        # Write the additional outputs first, so that the maps in the folder replace the existing files last and
        # together.
        _outputs.deliver_beside(result, paths, Path(out).suffix or "/", made)
        if Path(out).suffix.lower() == LAYERED:
            with _outputs.write_output(out, option, inside=option != "out", made=made) as place:
                material.save_exr(place)
        else:
            with _outputs.write_folder(out, option, made=made) as folder:
                self.save(material, folder)
        if (shown := paths.get("preview")) is not None:
            with _outputs.write_output(shown, "preview", made=made) as place:
                io.write(place, material.preview())
        if (solid := paths.get("gltf")) is not None:
            # Write the file under its final name in a temporary folder, because this name becomes the name of the
            # material.
            with _outputs.write_output(solid, "gltf", made=made) as place, TemporaryDirectory() as beside:
                material.save_gltf(file := Path(beside, Path(solid).name))
                shutil.copyfile(file, place)
        if (described := paths.get("materialx")) is not None:
            with _outputs.write_folder(described, "materialx", made=made) as folder:
                material.save_materialx(folder / "material.mtlx")
        if (smaller := paths.get("mipmaps")) is not None:
            with _outputs.write_folder(smaller, "mipmaps", made=made) as folder:
                self.save_smaller(material, folder)


def read_roles(texts: Sequence[str] | None) -> dict[str, str]:
    """Convert texts such as NAME=ROLE to the roles of maps, by name."""
    said = {}
    for text in texts or ():
        name, equals, role = text.partition("=")
        if not (name and equals and role):
            raise InvalidInput(f"--role: must be MAP=ROLE, as in rock.png=height; got {text!r}")
        said[name] = role
    return said


def is_stack(text: str) -> bool:
    """Return True if a text names a material: a folder, several files, or an EXR file with layers."""
    if os.path.isdir(text):
        return not io.is_store(text)
    if expand_braces(text):
        return True
    if Path(text).suffix.lower() != LAYERED or not os.path.isfile(text):
        return False
    with suppress(Exception):
        # Channels of layers have names such as layer.R, with a dot.
        if any("." in name for name in list_channels(Path(text))):
            return True
    with suppress(FileError), collect(show=lambda line: None):
        io.read(text)
        return False
    return True

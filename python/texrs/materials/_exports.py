"""What a material is shown and written as."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path as FilePath
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_one
from texrs._checks import as_bool
from texrs._typing import Path
from texrs.errors import InvalidInput
from texrs.materials._map import Map

__all__ = ["Exports"]


class Exports(Mapping[str, Map]):
    """Maps in register that can be shown and written."""

    @property
    @abstractmethod
    def axes(self) -> int:
        """2 for pictures, 3 for volumes."""

    @property
    @abstractmethod
    def weights(self) -> Mapping[str, float]:
        """What was said of how much maps count when decisions are made."""

    def preview(
        self, *, tiles: tuple[int, int] = (2, 2), light: tuple[float, float] = (135.0, 45.0), side: int = 2048
    ) -> NDArray[np.uint8]:
        """Return a picture of the material under a light, seen from straight above.

        Colours, normals (heights where there are none), roughness, metal, occlusion, emission and opacity all count; without
        colours the surface is grey. A flat, dull surface shows its own colours; what is transparent is shown over squares.

        Parameters
        ----------
        tiles : (int, int)
            How often the material is shown, down and across: more than once shows whether it wraps.
        light : (float, float)
            Where the light comes from, in degrees: counter-clockwise from the right, which makes 135 the upper left; and how
            high above the surface, 1 to 90.
        side : int
            Pixels that the longer side of the picture may have; what is larger is averaged.

        Returns
        -------
        (H, W, 3) uint8 array
            sRGB.

        Raises
        ------
        InvalidInput
            A volume, or something else that cannot be shown.

        Examples
        --------
        >>> import texrs
        >>> pebbles = texrs.samples.pebbles((64, 64)).image
        >>> stones = texrs.Material({"albedo": pebbles, "height": pebbles[..., 1]})
        >>> stones.preview().shape, stones.preview(tiles=(1, 3), side=96).shape
        ((128, 128, 3), (32, 96, 3))

        """
        from texrs.materials._preview import render_preview

        self._check_flat()
        return render_preview(self, tiles, light, side)

    def save(
        self,
        folder: Path,
        *,
        depth: Literal[8, 16, 32] | None = None,
        suffix: str | None = None,
        pack: Literal["orm", "none"] | None = None,
        convention: str | None = None,
        mipmaps: bool = False,
    ) -> list[FilePath]:
        """Write each map to a file, all or none.

        A map that was read from a file gets the name of that file, others get their own name.

        Parameters
        ----------
        folder : path_like
            Made where it is missing; files of these names are replaced.
        depth : {8, 16, 32}, optional
            Bits of each sample: integers of 8 or 16, floats of 32. By default those of each map.
        suffix : str, optional
            Of all files, such as ``".tif"``, which says the format; by default PNG, or TIFF and EXR for what it cannot hold.
        pack : {"orm", "none"}, optional
            "orm" writes occlusion, roughness and metallic, as far as there are any, to one file ``orm`` as red, green and blue.
            "none" writes each quantity of packed maps to a file of its own. By default maps stay as they are.
        convention : str, optional
            Names, packings and direction of y: "ambientcg", "polyhaven", "gltf", "unreal", "unity", "urp", "hdrp", "labpbr",
            "substance" or "substance-unreal". By default the names and packings of the maps that were read.
        mipmaps : bool
            Whether each map is also written in half, a quarter, ... of its size, until each side is 1, to the folder
            ``mipmaps``: ``albedo.1.png``, ``albedo.2.png``, ... Colours are averaged as light, normals keep their length,
            labels and masks are not mixed.

        Returns
        -------
        list of pathlib.Path
            The files, in the order of the maps, and then their mipmaps.

        Raises
        ------
        FileError
            A file cannot be written. What was there is as it was.
        InvalidInput
            Another depth, way to pack or convention, or values that the format cannot hold.

        Warns
        -----
        InputWarning
            The convention has no file for a channel of a packed map.

        Examples
        --------
        >>> import tempfile
        >>> import numpy as np
        >>> import texrs
        >>> stones = texrs.Material({"albedo": np.zeros((8, 8, 3), np.uint8), "height": np.zeros((8, 8), np.float32)})
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in stones.save(folder)], texrs.Material.read(folder)["height"].depth
        (['albedo.png', 'height.exr'], 32)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in stones.save(folder, convention="unreal")]
        ['T_material_D.png', 'T_material_H.exr']

        """
        from texrs.materials._files import write_maps

        as_one(depth, "depth", None, 8, 16, 32)
        as_bool(mipmaps, "mipmaps")
        maps = self._list_files(pack, convention)
        return write_maps(maps, folder, axes=self.axes, depth=depth, suffix=suffix, mipmaps=mipmaps)

    def _list_files(self, pack: str | None, convention: str | None) -> Mapping[str, Map]:
        """Return the maps that are written."""
        from texrs.materials._arranging import arrange_maps
        from texrs.materials._conventions import as_convention
        from texrs.materials._packing import pack_maps, unpack_maps

        as_one(pack, "pack", None, "orm", "none")
        if convention is not None:
            as_convention(convention, "convention")
            if pack is not None:
                raise InvalidInput("pack: cannot be combined with convention, which has its own packings")
            return arrange_maps(self, convention, self.axes)
        if pack is None:
            return self
        return pack_maps(self, self.axes) if pack == "orm" else unpack_maps(self)

    def save_exr(self, path: Path, *, depth: Literal[16, 32] | None = None) -> FilePath:
        """Write all maps to one EXR file, a layer each, that `Material.read` reads again.

        The channels of ``albedo`` are ``albedo.R``, ``albedo.G`` and ``albedo.B``, those of normals end in X, Y and Z, others
        in Y. As everywhere in EXR, colours are linear light: sRGB is decoded. The header keeps roles, spaces and dtypes, so
        that integers of up to 16 bit, labels and linear floats come back to the bit.

        Parameters
        ----------
        path : path_like
            With the suffix .exr.
        depth : {16, 32}, optional
            Bits of the floats that are written, and then come back as such; by default those that hold what is there. Labels
            are always whole numbers.

        Returns
        -------
        pathlib.Path
            The file.

        Raises
        ------
        FileError
            Another suffix, or the file cannot be written. A former file is unchanged.
        InvalidInput
            A volume, another depth, or values that EXR cannot hold whole.

        Examples
        --------
        >>> import tempfile
        >>> import texrs
        >>> pebbles = texrs.samples.pebbles((64, 64)).image
        >>> stones = texrs.Material({"albedo": pebbles, "height": pebbles[..., 1].astype("uint16")})
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     texrs.Material.read(stones.save_exr(f"{folder}/stones.exr"))
        <Material of 64 x 64: albedo (colour, uint8), height (height, uint16)>

        """
        from texrs.materials._exr import write_exr

        self._check_flat()
        as_one(depth, "depth", None, 16, 32)
        return write_exr(self, path, depth, self.weights)

    def save_gltf(
        self,
        path: Path,
        *,
        shapes: Sequence[Literal["plane", "sphere"]] = ("plane", "sphere"),
        repeat: int = 2,
        depth: Literal[8, 16] = 8,
    ) -> list[FilePath]:
        """Write a glTF 2.0 scene that shows the material on a plane and on a sphere.

        The material is that of the standard: base colours with opacity as alpha, occlusion, roughness and metal packed as red,
        green and blue, normals with y up (those of DirectX are turned; heights give them where there are none), emission,
        also brighter than white. It repeats without a step where it wraps.

        Parameters
        ----------
        path : path_like
            With the suffix .glb, one file; or .gltf, with a .bin and the pictures beside it (``stones_basecolor.png``, ...).
        shapes : sequence of {"plane", "sphere"}
            What it is shown on, from the left to the right.
        repeat : int
            How often along each side of the plane and from pole to pole, 1 to 64.
        depth : {8, 16}
            Bits of the pictures. Some viewers read 8 alone.

        Returns
        -------
        list of pathlib.Path
            The files, the scene first.

        Raises
        ------
        FileError
            Another suffix, or a file cannot be written. What was there is as it was.
        InvalidInput
            A volume, or another shape, number or depth.

        Examples
        --------
        >>> import tempfile
        >>> import texrs
        >>> pebbles = texrs.samples.pebbles((64, 64)).image
        >>> stones = texrs.Material({"albedo": pebbles, "height": pebbles[..., 1]})
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in stones.save_gltf(f"{folder}/stones.gltf")]
        ['stones.gltf', 'stones.bin', 'stones_normal.png', 'stones_basecolor.png']

        """
        from texrs.materials._gltf import write_gltf

        self._check_flat()
        as_one(depth, "depth", 8, 16)
        return write_gltf(self, path, shapes, repeat, depth)

    def save_materialx(self, path: Path, *, depth: Literal[8, 16, 32] | None = None) -> list[FilePath]:
        """Write a MaterialX document: a standard surface whose inputs are the maps, in files beside it.

        Normals have y up (those of DirectX are turned; heights give them where there are none); heights displace the surface
        as far as fits the normals, on a surface as wide as the picture is shown once. Occlusion, which renderers work out
        themselves, and what a surface has no input for, are left out.

        Parameters
        ----------
        path : path_like
            With the suffix .mtlx. Maps are named after it and after themselves: ``stones.mtlx``, ``stones_albedo.png``.
        depth : {8, 16, 32}, optional
            Bits of each sample of the maps: integers of 8 or 16, floats of 32. By default those of each map.

        Returns
        -------
        list of pathlib.Path
            The files, the document first.

        Raises
        ------
        FileError
            Another suffix, or a file cannot be written. What was there is as it was.
        InvalidInput
            A volume, another depth, or no map that a surface has.

        Examples
        --------
        >>> import tempfile
        >>> import texrs
        >>> pebbles = texrs.samples.pebbles((64, 64)).image
        >>> stones = texrs.Material({"albedo": pebbles, "roughness": pebbles[..., 1]})
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in stones.save_materialx(f"{folder}/stones.mtlx")]
        ['stones.mtlx', 'stones_albedo.png', 'stones_roughness.png']

        """
        from texrs.materials._materialx import write_materialx

        self._check_flat()
        as_one(depth, "depth", None, 8, 16, 32)
        return write_materialx(self, path, depth)

    def _check_flat(self) -> None:
        if self.axes != 2:
            raise InvalidInput("material: is a volume; this is for pictures, such as slices of it")

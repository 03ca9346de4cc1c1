"""Display and files of a material."""

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
        """2 for images, 3 for volumes."""

    @property
    @abstractmethod
    def weights(self) -> Mapping[str, float]:
        """Given weights of maps for decisions."""

    def preview(
        self, *, tiles: tuple[int, int] = (2, 2), light: tuple[float, float] = (135.0, 45.0), side: int = 2048
    ) -> NDArray[np.uint8]:
        """Render an image of the material under a light, seen from straight above.

        Colours, normals (or heights without normals), roughness, metallic, occlusion, emission and opacity are used.
        Without colours the surface is grey. A flat, dull surface shows its own colours. Transparent parts are shown
        over squares.

        Parameters
        ----------
        tiles : (int, int)
            Number of repetitions down and across. More than one shows whether the material is tileable.
        light : (float, float)
            Direction of the light in degrees: counter-clockwise from the right, so 135 is the upper left; and
            elevation above the surface, 1 to 90.
        side : int
            Maximum length of the longer side of the image in pixels. Larger materials are averaged.

        Returns
        -------
        (H, W, 3) uint8 array
            Image in sRGB.

        Raises
        ------
        InvalidInput
            If it is a volume, or cannot be shown.

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
        """Write all maps to files, or none.

        A map that was read from a file gets the name of that file, others get their own name.

        Parameters
        ----------
        folder : path_like
            Folder, created if needed. Files with these names are replaced.
        depth : {8, 16, 32}, optional
            Bits of each sample: integers of 8 or 16, floats of 32. Default: the bits of each map.
        suffix : str, optional
            Suffix of all files, such as ``".tif"``, which selects the format. Default: PNG, or TIFF and EXR for maps
            that PNG cannot hold.
        pack : {"orm", "none"}, optional
            "orm" writes occlusion, roughness and metallic, if present, to one file ``orm`` as red, green and blue.
            "none" writes each quantity of packed maps to its own file. Default: maps are not repacked.
        convention : str, optional
            Names, packings and direction of y: "ambientcg", "polyhaven", "gltf", "unreal", "unity", "urp", "hdrp",
            "labpbr", "substance" or "substance-unreal". Default: those of the maps that were read.
        mipmaps : bool
            If True, each map is also written at a half, a quarter, ... of its size, until each side is 1. The folder
            is ``mipmaps``: ``albedo.1.png``, ``albedo.2.png``, ... Colours are averaged as light, normals keep their
            length, and labels and masks are not mixed.

        Returns
        -------
        list of pathlib.Path
            The files, in the order of the maps, and then their mipmaps.

        Raises
        ------
        FileError
            If a file cannot be written. Existing files are unchanged.
        InvalidInput
            If the depth, the packing or the convention is invalid, or the format cannot hold the values.

        Warns
        -----
        InputWarning
            If the convention has no file for a channel of a packed map.

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
        """Write all maps to one EXR file, each as a layer, for `Material.read`.

        The channels of ``albedo`` are ``albedo.R``, ``albedo.G`` and ``albedo.B``. Names of normals end in X, Y and Z,
        others in Y. Colours are linear light, as in all EXR files: sRGB is decoded. The header stores roles, spaces
        and dtypes, so that integers of up to 16 bit, labels and linear floats are restored to the bit.

        Parameters
        ----------
        path : path_like
            File with the suffix .exr.
        depth : {16, 32}, optional
            Bits of the floats that are written, which are then also read. Default: enough for the values. Labels are
            always whole numbers.

        Returns
        -------
        pathlib.Path
            The file.

        Raises
        ------
        FileError
            If the suffix differs, or the file cannot be written. An existing file is unchanged.
        InvalidInput
            If it is a volume, the depth is invalid, or EXR cannot hold the values exactly.

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
        """Write a glTF 2.0 scene with the material on a plane and on a sphere.

        The material follows the standard. Base colours have opacity as alpha. Occlusion, roughness and metallic are
        packed as red, green and blue. Normals have y up (DirectX normals are converted, and heights replace missing
        normals). Emission may be brighter than white. It repeats without a step if it is tileable.

        Parameters
        ----------
        path : path_like
            File with the suffix .glb, one file; or .gltf, with a .bin and the images next to it
            (``stones_basecolor.png``, ...).
        shapes : sequence of {"plane", "sphere"}
            Shapes that show it, from left to right.
        repeat : int
            Number of repetitions along each side of the plane and from pole to pole, 1 to 64.
        depth : {8, 16}
            Bits of the images. Some viewers read 8 only.

        Returns
        -------
        list of pathlib.Path
            The files, the scene first.

        Raises
        ------
        FileError
            If the suffix differs, or a file cannot be written. Existing files are unchanged.
        InvalidInput
            If it is a volume, or a shape, number or depth is invalid.

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
        """Write a MaterialX document: a standard surface with the maps as inputs, in files next to it.

        Normals have y up (DirectX normals are converted, and heights replace missing normals). Heights displace the
        surface by the amount that fits the normals, on a surface as wide as one repetition. Occlusion, which renderers
        compute, and maps without an input in the surface are left out.

        Parameters
        ----------
        path : path_like
            File with the suffix .mtlx. Names of maps are its name and their own: ``stones.mtlx``,
            ``stones_albedo.png``.
        depth : {8, 16, 32}, optional
            Bits of each sample of the maps: integers of 8 or 16, floats of 32. Default: the bits of each map.

        Returns
        -------
        list of pathlib.Path
            The files, the document first.

        Raises
        ------
        FileError
            If the suffix differs, or a file cannot be written. Existing files are unchanged.
        InvalidInput
            If it is a volume, the depth is invalid, or no map is an input of a surface.

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
            raise InvalidInput("material: must not be a volume; use slices of it")

"""Methods of a material that render and save it."""

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
    """Base class of materials: renders their maps and writes them to files."""

    @property
    @abstractmethod
    def axes(self) -> int:
        """Number of axes: 2 for images, 3 for volumes."""

    @property
    @abstractmethod
    def weights(self) -> Mapping[str, float]:
        """Weights of maps for decisions, as given by the caller."""

    def preview(
        self, *, tiles: tuple[int, int] = (2, 2), light: tuple[float, float] = (135.0, 45.0), side: int = 2048
    ) -> NDArray[np.uint8]:
        """Render an image of the lit material, seen from straight above.

        The image shows colours, normals (or heights if normals are missing), roughness, metallic, occlusion, emission
        and opacity. Without colours the surface is grey. A flat, rough surface shows exactly its colours. Transparent
        parts are shown over a checkerboard.

        Parameters
        ----------
        tiles : (int, int)
            Number of repetitions (down, across), 1 to 64 each. More than one shows whether the material is tileable.
            Default: (2, 2).
        light : (float, float)
            Direction of the light (azimuth, elevation) in degrees. The azimuth, -360 to 360, is counter-clockwise from
            the right, so 135 is the upper left. The elevation above the surface is 1 to 90. Default: (135, 45).
        side : int
            Maximum length of the longer side of the image in pixels, 1 to 65536. Larger materials are averaged.
            Default: 2048.

        Returns
        -------
        (H, W, 3) uint8 array
            Rendered image in sRGB.

        Raises
        ------
        InvalidInput
            The material is a volume, or an argument is out of range.

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
        """Write all maps to files of a folder. If an error occurs, no file is changed.

        A map that was read from a file is written under the name of that file, and other maps under their own names.

        Parameters
        ----------
        folder : path_like
            Folder. It is created if needed. Files with the same names are replaced.
        depth : {8, 16, 32}, optional
            Bits per sample: integers of 8 or 16 bits, or floats of 32. Default: the bits of each map.
        suffix : str, optional
            Suffix of all files, such as ``".tif"``, which selects the format. Default: PNG, or TIFF or EXR for maps
            that PNG cannot store.
        pack : {"orm", "none"}, optional
            "orm" writes occlusion, roughness and metallic, if present, to one file ``orm`` as red, green and blue.
            "none" writes each quantity of packed maps to its own file. Default: packed maps stay as they are.
        convention : str, optional
            Naming convention of the files, with its packings and direction of y: "ambientcg", "polyhaven", "gltf",
            "unreal", "unity", "urp", "hdrp", "labpbr", "substance" or "substance-unreal". Default: the names and
            packings of the maps that were read.
        mipmaps : bool
            If True, each map is also written at half, a quarter, ... of its size, down to a side of 1. These files are
            in the subfolder ``mipmaps``: ``albedo.1.png``, ``albedo.2.png``, ... Colours are averaged as light,
            normals are normalised, and labels and masks are not mixed. Default: False.

        Returns
        -------
        list of pathlib.Path
            Written files in the order of the maps, followed by their mipmaps.

        Raises
        ------
        FileError
            A file cannot be written. Existing files are unchanged.
        InvalidInput
            The depth, the packing or the convention is invalid, or the format cannot store the values.

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
        from texrs.materials.files import write_maps

        as_one(depth, "depth", None, 8, 16, 32)
        as_bool(mipmaps, "mipmaps")
        maps = self._list_files(pack, convention)
        return write_maps(maps, folder, axes=self.axes, depth=depth, suffix=suffix, mipmaps=mipmaps)

    def _list_files(self, pack: str | None, convention: str | None) -> Mapping[str, Map]:
        """Return the maps to be written, repacked and renamed as requested."""
        from texrs.materials._arranging import arrange_maps
        from texrs.materials._packing import pack_maps, unpack_maps
        from texrs.materials.conventions import as_convention

        as_one(pack, "pack", None, "orm", "none")
        if convention is not None:
            as_convention(convention, "convention")
            if pack is not None:
                raise InvalidInput("pack: cannot be combined with convention, which defines the packing")
            return arrange_maps(self, convention, self.axes)
        if pack is None:
            return self
        return pack_maps(self, self.axes) if pack == "orm" else unpack_maps(self)

    def save_exr(self, path: Path, *, depth: Literal[16, 32] | None = None) -> FilePath:
        """Write all maps to one EXR file, with one layer per map, which `Material.read` can read.

        The channels of ``albedo`` are named ``albedo.R``, ``albedo.G`` and ``albedo.B``. Channels of normals end in X,
        Y and Z, and single channels in Y. Colours are linear light, as in all EXR files: sRGB is decoded. The header
        stores roles, colour spaces and dtypes. Integers of up to 16 bits, labels and linear floats are therefore
        restored exactly.

        Parameters
        ----------
        path : path_like
            File with the suffix .exr.
        depth : {16, 32}, optional
            Bits of the floats in the file. If given, the file is read as these floats. Default: enough bits for exact
            values. Labels are always stored as integers.

        Returns
        -------
        pathlib.Path
            Path of the file.

        Raises
        ------
        FileError
            The suffix is not .exr, or the file cannot be written. An existing file is unchanged.
        InvalidInput
            The material is a volume, the depth is invalid, or EXR cannot store the values exactly.

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

        The material follows the glTF standard. Opacity is the alpha of the base colours. Occlusion, roughness and
        metallic are packed as red, green and blue. Normals have y up: DirectX normals are converted, and heights
        replace missing normals. Emission can be brighter than white. A tileable material repeats without visible
        borders.

        Parameters
        ----------
        path : path_like
            File with the suffix .glb, which contains everything, or .gltf. With .gltf, a .bin file and the images
            (``stones_basecolor.png``, ...) are written next to it.
        shapes : sequence of {"plane", "sphere"}
            Shapes that show the material, from left to right. Default: both.
        repeat : int
            Number of repetitions along each side of the plane, and from pole to pole of the sphere, 1 to 64. Default:
            2.
        depth : {8, 16}
            Bits per channel of the images. Some viewers read only 8. Default: 8.

        Returns
        -------
        list of pathlib.Path
            Written files, with the scene first.

        Raises
        ------
        FileError
            The suffix is not .glb or .gltf, or a file cannot be written. Existing files are unchanged.
        InvalidInput
            The material is a volume, or a shape, ``repeat`` or ``depth`` is invalid.

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
        from texrs.materials.gltf import write_gltf

        self._check_flat()
        as_one(depth, "depth", 8, 16)
        return write_gltf(self, path, shapes, repeat, depth)

    def save_materialx(self, path: Path, *, depth: Literal[8, 16, 32] | None = None) -> list[FilePath]:
        """Write a MaterialX document with a standard surface. Its inputs are the maps, which are written next to it.

        Normals have y up: DirectX normals are converted, and heights replace missing normals. Heights displace the
        surface. Their scale is fitted to the normals and assumes that the surface is one repetition wide. Occlusion,
        which renderers compute themselves, and maps without an input in the standard surface are omitted.

        Parameters
        ----------
        path : path_like
            File with the suffix .mtlx. The names of the map files begin with its name: ``stones.mtlx``,
            ``stones_albedo.png``.
        depth : {8, 16, 32}, optional
            Bits per sample of the maps: integers of 8 or 16 bits, or floats of 32. Default: the bits of each map.

        Returns
        -------
        list of pathlib.Path
            Written files, with the document first.

        Raises
        ------
        FileError
            The suffix is not .mtlx, or a file cannot be written. Existing files are unchanged.
        InvalidInput
            The material is a volume, the depth is invalid, or no map is an input of a standard surface.

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
            raise InvalidInput("material: must not be a volume; write slices of the volume")

"""Read images and volumes with the dtype of the file, and write them without loss.

===================== =========================================== ========== ====================
Suffix                dtypes                                      Channels   Loss
===================== =========================================== ========== ====================
``.png``              bool, uint8, uint16                         1, 2, 3, 4 nothing
``.tif`` ``.tiff``    bool, (u)int8/16/32, float16/32/64          1 to 64    nothing
``.exr``              float16, float32                            1, 2, 3, 4 nothing
``.hdr``              float32, finite, not negative               3          beyond 8 bits (a)
``.webp``             bool, uint8                                 3, 4       nothing
``.jpg`` ``.jpeg``    bool, uint8                                 1, 3       JPEG, quality 95
``.bmp``              bool, uint8                                 1, 3       nothing
``.gif``              bool, uint8, up to 256 colours              3, 4       nothing
``.tga``              bool, uint8                                 1, 2, 3, 4 nothing
``.dds``              bool, uint8, uncompressed                   1, 2, 3, 4 nothing
``.avif`` (b)         bool, uint8                                 3, 4       AVIF, quality 95
``.jxl`` (b)          bool, uint8                                 1, 2, 3, 4 nothing
``.npy`` ``.npz``     bool, (u)int8/16/32/64, float16/32/64       1 to 64    nothing
``.nrrd`` (c)         bool, (u)int8/16/32/64, float32/64          1 to 64    nothing
``.nii`` (c)          bool, (u)int8/16/32/64, float32/64          1 to 64    nothing
``.nii.gz`` (c)       the same                                    1 to 64    nothing
``.vti`` (d)          bool, (u)int8/16/32/64, float32/64          1 to 64    nothing
``.zarr`` (e)         bool, (u)int8/16/32/64, float16/32/64       1 to 64    nothing
===================== =========================================== ========== ====================

(a) The three channels of a pixel share one exponent, and the largest channel keeps 8 significant bits.

(b) AVIF needs Pillow 11.3 or newer. JPEG XL needs a plugin: ``pip install pillow-jxl-plugin``.

(c) Volumes only. These formats need the extra ``vol``: ``pip install texrs[vol]``.

(d) Volumes only, for ParaView. Files are read in every encoding that VTK writes.

(e) A folder, written as OME-Zarr of one level. It needs the extra ``dask``: ``pip install texrs[dask]``. Plain Zarr
arrays and OME-Zarr images are read. Unbounded textures can be written to stores of any size
(`texrs.SolidTexture.to_zarr`).

PSD files are read only: their flattened image, with 8 bits per channel. The package OpenEXR reads and writes EXR, and
tifffile reads and writes TIFF. Pillow reads and writes WebP, JPEG, GIF, BMP, TGA, DDS, AVIF and JPEG XL, and also
reads PSD and compressed DDS (BC1 to BC7). Some compressed TIFF files need the extra ``tiff``: ``pip install
texrs[tiff]``. CMYK is converted to sRGB by the profile of the file. Frames and pages that are not read are reported.

Volumes are written to ``.tif``, ``.tiff``, ``.npy``, ``.npz`` and to the last five formats, which also keep the
distances between voxels (`read_spacing`). In those five formats, the axes plane, row and column are called z, y and x,
and x varies fastest in the file. Volumes larger than memory are written slab by slab (`write_slabs`), and surfaces as
``.stl`` (`write_surface`). A dtype that a format cannot store raises an error. It is never converted. Bool arrays are
written as 0 and 255, but stay bool in ``.npy`` and ``.npz``. An opaque alpha channel is omitted if the format has
none. An image of one channel is read without a channel axis, except from ``.npy`` and ``.npz``, which keep the shape.
``.npz`` files have the key ``image``.

The content of a file decides how it is read (for TGA, the suffix). The suffix decides how it is written. The size in a
header is compared with the limit before memory is allocated. `read_metadata` reads metadata, such as ICC profiles,
densities and the record of how texrs made a file, and `write` writes them (``notes``). Every file is first written under
a temporary name and then renamed.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import chain
from math import atan, degrees, prod
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from texrs import _alpha
from texrs._checks import as_instance, as_items, as_limit, try_array
from texrs._typing import Array
from texrs._typing import Path as PathLike
from texrs.errors import FileError, InvalidInput
from texrs.io import (
    _npy,
    _png_chunks,
    _series,
    _slabs,
    _tiff,
    _volumes,
    _vtk,
    _zarr,
    exr_layers,
    files,
    image_io,
    origins,
    pillow,
    raw,
)
from texrs.io._notes import Metadata
from texrs.io._npy import Header, read_arrays, read_headers
from texrs.io._vectors import read_vectors
from texrs.io._zarr import is_store
from texrs.io.annotation import read_metadata
from texrs.io.files import atomic, find_suffix
from texrs.io.formats import FORMATS, READ_IMAGES, STORE, VOLUMES, as_spacing, check, detect_kind, holds_spacing
from texrs.io.grids import READERS, read_numpy, read_spacing, read_unit

__all__ = [
    "Header",
    "Metadata",
    "atomic",
    "is_store",
    "read",
    "read_arrays",
    "read_description",
    "read_fov",
    "read_headers",
    "read_metadata",
    "read_spacing",
    "read_vectors",
    "read_volume",
    "write",
    "write_slabs",
    "write_surface",
    "write_volume",
]

FILM = 36.0
"""Longer side, in millimetres, of the 35 mm film frame that focal lengths in Exif refer to."""


def __dir__() -> list[str]:
    return __all__


def read(path: PathLike, *, limit: int | None = None) -> Array:
    """Read an image from a file.

    Parameters
    ----------
    path : path_like
        PNG, TIFF, EXR, HDR, WebP, JPEG, GIF, BMP, TGA, DDS, PSD, AVIF, JPEG XL, .npy or .npz file, or the folder of a
        Zarr store. The content decides the format (for TGA, the suffix). Only the first frame of an animation is read.
    limit : int, optional
        Maximum number of pixels. The maximum number of bytes is 16 times this number. Default: as `texrs.limits`
        allows.

    Returns
    -------
    ndarray
        Image of shape (H, W) or (H, W, C) with the dtype of the file. Palettes are applied, and samples of fewer than
        8 bits are scaled to 8 bits. CMYK is converted to sRGB. The image is turned upright according to the Exif
        orientation.

    Raises
    ------
    FileError
        The file is missing, not readable, empty, truncated, corrupt, of another format, or a stack of images, which
        `read_volume` reads.
    LimitExceeded
        The image has more pixels or needs more memory than the limit.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "ramp.png")
    ...     write(path, np.arange(12, dtype=np.uint16).reshape(3, 4))
    ...     read(path)
    array([[ 0,  1,  2,  3],
           [ 4,  5,  6,  7],
           [ 8,  9, 10, 11]], dtype=uint16)

    """
    name, limit = files.as_path(path), as_limit(limit)
    kind = detect_kind(name)
    if kind == "tiff":
        planes, orientation = _tiff.read_tiff(name, limit)
        return origins.mark(_tiff.take_image(name, planes, orientation), name, False)
    if kind in ("npy", "npz"):
        return read_numpy(name, kind, limit, 2)
    if kind == "zarr":
        return _zarr.read_store(name, limit, 2)
    if kind in VOLUMES:
        raise FileError(f"{name}: is a {kind} file, which contains a volume; read it with texrs.io.read_volume")
    if kind == "exr":
        return origins.mark(exr_layers.read_image(name, limit), name, False)
    file = files.load(name, limit)
    if kind in pillow.DECODED:
        array = pillow.read(name, kind, file, limit)
    else:
        with files.translate_errors(name, "decoding"):
            array = files.turn_upright(*image_io.decode(name, file, limit))
    pillow.ignore_frames(name, kind, file)
    return origins.mark(array, name, kind == "gif" or pillow.is_indexed(name, kind, file))


def read_fov(path: PathLike) -> float | None:
    """Return the angle of view of a photograph, in degrees, from its Exif metadata.

    Parameters
    ----------
    path : path_like
        JPEG, TIFF, PNG or WebP file.

    Returns
    -------
    float or None
        Angle in degrees that the longer side of the uncropped photograph spans; None if the file does not state a
        focal length.

    Raises
    ------
    InvalidInput
        ``path`` is not a path.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "grey.png")
    ...     write(path, np.zeros((8, 8), np.uint8))
    ...     read_fov(path) is None
    True

    """
    focal = pillow.read_focal(files.as_path(path))
    return None if focal is None else 2 * degrees(atan(FILM / 2 / focal))


def read_description(path: PathLike) -> str | None:
    """Return the description that is stored in a PNG or TIFF file.

    Parameters
    ----------
    path : path_like
        PNG file (text chunk "Description") or TIFF file (tag ImageDescription).

    Returns
    -------
    str or None
        Text of the description; None if the file does not have one.

    Raises
    ------
    InvalidInput
        ``path`` is not a path.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "grey.png")
    ...     write(path, np.zeros((8, 8), np.uint8), description="nothing but black")
    ...     read_description(path)
    'nothing but black'

    """
    return pillow.read_description(files.as_path(path))


def read_volume(
    path: PathLike, *, shape: Sequence[int] | None = None, dtype: DTypeLike | None = None, limit: int | None = None
) -> Array:
    """Read a volume from a file or from a folder of slices.

    Parameters
    ----------
    path : path_like
        TIFF stack (a single image is a volume of one plane), .npy, .npz, .vti, NRRD or NIfTI file, or the folder of a
        Zarr store. NRRD and NIfTI need the extra ``vol``, and Zarr the extra ``dask``. The content decides the format.
        A NIfTI file with scaled samples gives float32. The finest level of OME-Zarr is read; to read another level,
        pass its path inside the store. A folder of numbered slices (``scan_1.tif`` to ``scan_48.tif``) is read in the
        order of the numbers. For samples without a header, append the width, height, depth and type to the name, and
        ``:big`` for big-endian samples: ``scan.raw:96x96x48:uint16``.
    shape : sequence of int, optional
        Shape (D, H, W) or (D, H, W, C) of a file without a header, if it is not appended to the name. Default: None.
    dtype : dtype, optional
        Type of the samples of a file without a header, such as "uint16" or ">i2". Default: None.
    limit : int, optional
        Maximum number of voxels. The maximum number of bytes is 16 times this number. Default: as `texrs.limits`
        allows.

    Returns
    -------
    ndarray
        Volume of shape (D, H, W) or (D, H, W, C) with the dtype of the file.

    Raises
    ------
    FileError
        The file is missing, not readable, empty, truncated, corrupt or not a volume; or slices are missing or differ
        in shape or dtype.
    LimitExceeded
        The volume has more voxels or needs more memory than the limit.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "cube.raw")
    ...     np.zeros((5, 4, 3), np.uint16).tofile(path)
    ...     read_volume(path, shape=(5, 4, 3), dtype="uint16").shape, read_volume(f"{path}:3x4x5:uint16").shape
    ((5, 4, 3), (5, 4, 3))

    """
    name, limit = files.as_path(path), as_limit(limit, axes=3)
    if shape is not None or dtype is not None:
        return raw.make_raw(name, shape, dtype).read(limit)
    kind = detect_kind(name)
    if kind == "slices":
        slices = _series.read_series(name, READ_IMAGES, limit, lambda path, most: read(path, limit=most))
        return origins.mark(slices, name, False)
    if kind not in READERS:
        raise FileError(
            f"{name}: is a {kind} file, which contains one image; volumes are .npy, .npz, .vti, NRRD, NIfTI, Zarr, "
            ".raw, TIFF or folders of numbered slices"
        )
    return origins.mark(READERS[kind](name, limit), name, False)


def write(
    path: PathLike,
    array: Array,
    *,
    overwrite: bool = True,
    description: str | None = None,
    notes: Metadata | None = None,
) -> None:
    """Write an image to a file. If writing fails, an existing file is unchanged.

    Parameters
    ----------
    path : path_like
        File to write. Its suffix decides the format. The table of `texrs.io` lists what each format can store.
    array : array_like
        Image of shape (H, W) or (H, W, C).
    overwrite : bool
        If True, an existing file is replaced. Default: True.
    description : str, optional
        Description in ASCII. Only PNG and TIFF store it (`read_description`). Default: None.
    notes : Metadata, optional
        Metadata to write, as far as the format can store them. PNG, TIFF, JPEG, WebP and AVIF files store the ICC
        profile. PNG, TIFF, EXR, JPEG and BMP files store the pixel density. PNG files store the gamma, PNG and EXR
        files the primaries, and TIFF files the georeference. Colours are multiplied by alpha in EXR files and divided by alpha
        in all other files, unless ``multiplied`` states that this is already done. Default: None.

    Raises
    ------
    InvalidInput
        The format cannot store the array. The message names formats that can.
    FileError
        The suffix is unknown, or the file cannot be written. An existing file is unchanged.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write(pathlib.Path(folder, "height.png"), np.zeros((2, 2), np.float32))
    Traceback (most recent call last):
        ...
    texrs.errors.InvalidInput: array: .png cannot store float32 with 1 channel; use one of .exr, ...

    """
    if description is not None and not (isinstance(description, str) and description.isascii()):
        raise InvalidInput(f"description: must be an ASCII string, got {description!r}")
    said = Metadata(multiplied=None) if notes is None else as_instance(notes, "notes", Metadata)
    array = _alpha.adapt(array, files.as_path(path), said.multiplied)
    _write(path, array, 2, overwrite, None, said, description)


def write_volume(
    path: PathLike,
    array: Array,
    *,
    overwrite: bool = True,
    spacing: Sequence[float] | None = None,
    like: PathLike | None = None,
    notes: Metadata | None = None,
) -> None:
    """Write a volume to a file or a Zarr store. If writing fails, an existing file is unchanged.

    Parameters
    ----------
    path : path_like
        File with the suffix .tif, .tiff, .npy, .npz, .nrrd, .nii, .nii.gz or .vti, or folder with the suffix .zarr.
        NRRD and NIfTI need the extra ``vol``. A .zarr folder needs the extra ``dask``, and is written as OME-Zarr of
        one level.
    array : array_like
        Volume of shape (D, H, W) or (D, H, W, C).
    overwrite : bool
        If True, an existing file is replaced. Default: True.
    spacing : sequence of 3 float, optional
        Distances between planes, rows and columns, in any unit. The formats .nrrd, .nii, .nii.gz, .vti and .zarr store
        it. .tif files store it as ImageJ does, if the dtype is uint8, uint16 or float32. `read_spacing` reads it.
        Default: the spacing of ``like``, or 1.
    like : path_like, optional
        Volume whose spacing is copied. Orientation, origin and units are also copied between two NRRD files or two
        NIfTI files, and the unit between two TIFF files. Default: None.
    notes : Metadata, optional
        Metadata to write. Only TIFF files store them: the ICC profile, and the pixel density if no spacing is given.
        Default: None.

    Raises
    ------
    InvalidInput
        The format cannot store the array. The message names formats that can.
    FileError
        The suffix is unknown, or the file cannot be written. An existing file is unchanged.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "cube.npy")
    ...     write_volume(path, np.zeros((5, 4, 3, 3), np.uint8))
    ...     read_volume(path).shape
    (5, 4, 3, 3)

    """
    said = Metadata() if notes is None else as_instance(notes, "notes", Metadata)
    _write(path, array, 3, overwrite, spacing, said, like=None if like is None else files.as_path(like))


def write_slabs(path: PathLike, slabs: Iterable[Array], shape: Sequence[int], *, overwrite: bool = True) -> None:
    """Write a volume slab by slab, with only one slab in memory. If writing fails, an existing file is unchanged.

    Parameters
    ----------
    path : path_like
        File with the suffix .npy, .tif or .tiff.
    slabs : iterable of array_like
        Slabs of shape (d, H, W) or (d, H, W, C) and of one dtype, in the order of the planes.
    shape : sequence of int
        Shape of the whole volume, (D, H, W) or (D, H, W, C).
    overwrite : bool
        If True, an existing file is replaced. Default: True.

    Raises
    ------
    InvalidInput
        The slabs do not add up to ``shape``, or the format cannot store them.
    FileError
        The suffix is not supported, or the file cannot be written. An existing file is unchanged, also if the iterable
        of slabs raises an error.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "large.npy")
    ...     write_slabs(path, (np.full((2, 3, 4), i, np.uint8) for i in range(5)), (10, 3, 4))
    ...     read_volume(path)[::2, 0, 0]
    array([0, 1, 2, 3, 4], dtype=uint8)

    """
    target = files.as_path(path)
    suffix = target.suffix.lower()
    if suffix not in (".npy", ".tif", ".tiff"):
        raise FileError(f"{target}: the suffix must be one of .npy, .tif, .tiff for slabs; got {suffix!r}")
    sides = _slabs.as_shape(shape)
    with atomic(target, overwrite=overwrite) as temporary:
        # Errors that the iterable of slabs raises are passed on unchanged.
        parts = _slabs.check((check(slab, suffix, 3) for slab in as_items(slabs, "slabs")), sides)
        first = next(parts)
        whole = chain((first,), parts)
        if suffix == ".npy":
            _npy.write_parts(temporary, whole, sides, first.dtype)
        else:
            channels, size = prod(sides[3:]), prod(sides) * first.itemsize
            _tiff.write_tiff(temporary, _slabs.split_planes(whole), channels, size, Metadata())


def write_surface(path: PathLike, vertices: Array, faces: Array, *, overwrite: bool = True) -> None:
    """Write a triangle mesh, such as one of `texrs.volume.extract_surface`, as a binary .stl file.

    Parameters
    ----------
    path : path_like
        File with the suffix .stl. An existing file is unchanged if writing fails.
    vertices : (N, 3) array_like
        Vertices (x, y, z).
    faces : (M, 3) array_like
        Indices of the three vertices of each triangle, counter-clockwise if seen from outside.
    overwrite : bool
        If True, an existing file is replaced. Default: True.

    Raises
    ------
    InvalidInput
        The faces are not triangles, or an index is out of range.
    FileError
        The suffix is not .stl, or the file cannot be written. An existing file is unchanged.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "triangle.stl")
    ...     write_surface(path, [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    ...     path.stat().st_size
    134

    """
    target = files.as_path(path)
    if target.suffix.lower() != ".stl":
        raise FileError(f"{target}: the suffix must be .stl for surfaces, got {target.suffix!r}")
    corners, triangles = try_array(vertices), try_array(faces)
    if corners.ndim != 2 or corners.shape[-1] != 3 or corners.dtype.kind not in "uif":
        raise InvalidInput(f"vertices: must be numbers of shape (N, 3), got {corners.dtype} of shape {corners.shape}")
    if triangles.ndim != 2 or triangles.shape[-1] != 3 or triangles.dtype.kind not in "ui":
        raise InvalidInput(f"faces: must be integers of shape (M, 3), got {triangles.dtype} of shape {triangles.shape}")
    if not np.isfinite(corners).all() or not 0 < len(triangles) < 2**32:
        raise InvalidInput("vertices, faces: vertices must be finite, and faces must contain at least one triangle")
    if int(triangles.min()) < 0 or int(triangles.max()) >= len(corners):
        raise InvalidInput(f"faces: must contain indices of vertices from 0 to {len(corners) - 1}")
    with atomic(target, overwrite=overwrite) as temporary, files.translate_errors(target, "writing"):
        _volumes.write_stl(temporary, corners.astype(np.float32), triangles.astype(np.int64))


def _write(
    path: PathLike,
    value: Array,
    axes: int,
    overwrite: bool,
    spacing: Sequence[float] | None,
    notes: Metadata,
    description: str | None = None,
    like: Path | None = None,
) -> None:
    target = files.as_path(path)
    suffix = find_suffix(target).lower()
    if suffix not in FORMATS and suffix != STORE:
        raise FileError(f"{target}: the suffix must be one of {', '.join(FORMATS)}, {STORE}; got {suffix!r}")
    array = check(value, suffix, axes)
    if spacing is None and like is not None and holds_spacing(array, suffix):
        spacing = read_spacing(like)
    steps = as_spacing(spacing, suffix)
    # Stores are folders, which another function replaces as a whole.
    if suffix == STORE:
        _zarr.write_store(target, array, axes, steps[3 - axes :], overwrite=overwrite)
        return
    with atomic(target, overwrite=overwrite) as temporary, files.translate_errors(target, "writing"):
        # Image formats do not have bool, so write 0 and 255.
        if array.dtype == np.bool_ and suffix not in (".npy", ".npz"):
            array = array.astype(np.uint8) * np.uint8(255)
        flat = array[..., 0] if array.ndim > axes and array.shape[-1] == 1 else array
        channels = flat.shape[axes] if flat.ndim > axes else 1
        notes = notes.fit(min(channels, 5))
        match suffix:
            case ".npy":
                _npy.write_npy(temporary, array)
            case ".npz":
                _npy.write_npz(temporary, array)
            case ".tif" | ".tiff":
                planes = flat.reshape(-1, *flat.shape[axes - 2 : axes], channels)
                # Only TIFF files in the form of ImageJ store a spacing.
                if spacing is None:
                    _tiff.write_tiff(temporary, planes, channels, planes.nbytes, notes, description)
                elif _tiff.keeps_spacing(planes.dtype, channels):
                    _tiff.write_imagej(temporary, planes, steps, read_unit(like), notes.profile)
                else:
                    raise InvalidInput(
                        "spacing: .tif can store it only for uint8, uint16 and float32 with one channel, and for "
                        f"uint8 with 3 channels; got {array.dtype} with {channels} channels"
                    )
            case ".nrrd":
                _volumes.write_nrrd(temporary, flat, steps, _find_header(like, "nrrd"))
            case ".vti":
                _vtk.write_vti(temporary, flat, steps)
            case ".nii" | ".nii.gz":
                header = _find_header(like, "nii", "nii.gz")
                _volumes.write_nifti(temporary, flat, steps, header, compressed=suffix == ".nii.gz")
            case ".exr":
                exr_layers.write_image(temporary, flat, notes)
            case ".png" | ".hdr":
                file = image_io.encode(target, flat, suffix[1:])
                added = replace(notes, made=None)
                temporary.write_bytes(_png_chunks.add_chunks(file, added, description) if suffix == ".png" else file)
            case _:
                temporary.write_bytes(pillow.encode(target, flat, suffix, notes=notes))


def _find_header(like: Path | None, *kinds: str) -> Any:
    """Return the header of an NRRD or NIfTI file whose positions of voxels are copied; None for other files."""
    return _volumes.read_header(like) if like is not None and detect_kind(like) in kinds else None

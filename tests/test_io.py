"""Written files are read back unchanged; values that a format cannot store are refused; files are whole or absent."""

import os
import stat
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest
import tifffile
from numpy.testing import assert_array_equal

import image_files as make
from combinations import pairwise
from texrs import io as tio
from texrs.errors import FileError, InputWarning, InvalidInput, LimitExceeded

TIFF = [f"{kind}{bits}" for kind in ("uint", "int") for bits in (8, 16, 32)]
TIFF += ["float16", "float32", "float64"]
NUMPY = ["bool", "uint64", "int64", *TIFF]
LOSSLESS = [
    *((".png", dtype, c) for dtype in ("uint8", "uint16") for c in (1, 2, 3, 4)),
    *((".exr", dtype, c) for dtype in ("float16", "float32") for c in (1, 2, 3, 4)),
    *((".webp", "uint8", c) for c in (3, 4)),
    *((suffix, "uint8", c) for suffix in (".tga", ".dds") for c in (1, 2, 3, 4)),
    *((".bmp", "uint8", c) for c in (1, 3)),
    *((".tif", dtype, c) for dtype in TIFF for c in (1, 2, 3, 4, 5)),
    (".tiff", "uint8", 3),
    *((suffix, dtype, c) for suffix in (".npy", ".npz") for dtype in NUMPY for c in (1, 3, 6)),
]


@pytest.mark.parametrize(("suffix", "dtype", "channels"), LOSSLESS)
def test_lossless_formats_give_back_what_came(tmp_path, suffix, dtype, channels):
    for rows, columns in ((1, 1), (3, 7), (33, 40), (4, 3)):
        shape = (rows, columns) if channels == 1 else (rows, columns, channels)
        image = make.picture(shape, dtype, channels)
        path = tmp_path / f"{rows}{suffix}"
        tio.write(path, image)
        back = tio.read(path)
        assert back.dtype == image.dtype
        assert back.flags.c_contiguous
        assert back.flags.writeable
        assert_array_equal(back, image)
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(f"{n}{suffix}" for n in (1, 3, 33, 4))


@pytest.mark.parametrize(
    ("dtype", "channels", "suffix"),
    pairwise(["uint8", "uint16", "float16", "float32", "float64"], [None, 1, 2, 3, 4, 7], [".tif", ".npy", ".npz"]),
)
def test_volumes_give_back_what_came(tmp_path, suffix, channels, dtype):
    for planes in (1, 3, 4, 9):
        shape = (planes, 6, 5) if channels is None else (planes, 6, 5, channels)
        volume = make.picture(shape, dtype)
        path = tmp_path / f"volume{suffix}"
        tio.write_volume(path, volume)
        back = tio.read_volume(path)
        assert back.dtype == volume.dtype
        if suffix == ".tif" and channels == 1:
            volume = volume[..., 0]
        assert_array_equal(back, volume)
    if suffix == ".tif":
        with pytest.raises(FileError, match=r"9 planes; read them with texrs\.io\.read_volume"):
            tio.read(path)


@pytest.mark.parametrize("suffix", [".png", ".webp", ".tif", ".bmp"])
def test_bool_is_written_as_0_and_255(tmp_path, suffix):
    mask = make.picture((9, 8, 3), bool)
    tio.write(tmp_path / f"mask{suffix}", mask)
    assert_array_equal(tio.read(tmp_path / f"mask{suffix}"), mask * np.uint8(255))


def test_floats_survive_bit_for_bit(tmp_path):
    odd = np.array([[0.0, -0.0, np.inf, -np.inf], [np.nan, 1e-45, 3e38, -1e-7]], np.float32)
    for suffix in (".exr", ".tif", ".npy"):
        tio.write(tmp_path / f"odd{suffix}", odd)
        back = tio.read(tmp_path / f"odd{suffix}")
        assert_array_equal(back.view(np.uint32), odd.view(np.uint32))


def test_radiance_keeps_eight_bits_of_the_largest_channel(tmp_path):
    image = np.exp(make.picture((20, 30, 3), np.float32) * 2).astype(np.float32)
    image[0, 0] = 0
    tio.write(tmp_path / "high.hdr", image)
    back = tio.read(tmp_path / "high.hdr")
    assert back.dtype == np.float32
    assert back.max() > 100
    assert (np.abs(back - image) <= image.max(-1, keepdims=True) / 128).all()
    assert_array_equal(back[0, 0], 0)
    tio.write(tmp_path / "again.hdr", back)
    assert_array_equal(tio.read(tmp_path / "again.hdr"), back)


def test_jpeg_is_close(tmp_path):
    ramp = np.linspace(0, 255, 64 * 48 * 3).reshape(64, 48, 3).astype(np.uint8)
    for image in (ramp, ramp[..., 0]):
        tio.write(tmp_path / "ramp.jpg", image)
        back = tio.read(tmp_path / "ramp.jpg")
        assert (back.dtype, back.shape) == (np.uint8, image.shape)
        assert np.abs(back.astype(int) - image).max() <= 8


def turned(image, orientation):
    """Return the image that a viewer shows, by the table of the Exif standard."""
    return {
        1: image,
        2: image[:, ::-1],
        3: image[::-1, ::-1],
        4: image[::-1],
        5: image.swapaxes(0, 1),
        6: np.rot90(image, -1),
        7: image[::-1, ::-1].swapaxes(0, 1),
        8: np.rot90(image, 1),
    }[orientation]


@pytest.mark.parametrize("orientation", range(1, 9))
def test_exif_orientation_is_obeyed(tmp_path, orientation):
    image = np.zeros((16, 32, 3), np.uint8)
    image[:8, :8] = (250, 20, 20)
    image[8:, :16] = (20, 250, 20)
    block = make.exif(orientation, "<>"[orientation % 2])
    rows = b"".join(b"\0" + row.tobytes() for row in image)
    files = {
        "png": make.png(32, 16, 8, 2, zlib.compress(rows), [(b"eXIf", block)]),
        "png-behind": make.png(32, 16, 8, 2, zlib.compress(rows), behind=[(b"eXIf", block)]),
        "jpg": make.pillow(image, "JPEG", quality=100, subsampling=0, exif=b"Exif\0\0" + block),
        "webp": make.pillow(image, "WEBP", lossless=True, exif=b"Exif\0\0" + block),
    }
    files["webp-bare"] = files["webp"].replace(b"Exif\0\0" + block, block + b"\0" * 6)
    for name, file in files.items():
        path = tmp_path / name
        path.write_bytes(file)
        back = tio.read(path)
        expected = turned(image, orientation)
        assert back.shape == expected.shape, name
        assert np.abs(back.astype(int) - expected).max() <= (40 if name == "jpg" else 0), name
    path = tmp_path / "turned.tif"
    tifffile.imwrite(path, image, photometric="rgb", extratags=[(274, 3, 1, orientation, True)])
    assert_array_equal(tio.read(path), turned(image, orientation))
    assert_array_equal(tio.read_volume(path)[0], turned(image, orientation))


def test_palettes_and_few_bits_become_samples(tmp_path):
    colours = np.array([[10, 20, 30], [200, 100, 0], [7, 7, 7], [255, 0, 255]], np.uint8)
    indices = np.arange(12).reshape(3, 4) % 4
    path = tmp_path / "palette"
    path.write_bytes(make.palette_png(indices, colours))
    assert_array_equal(tio.read(path), colours[indices])
    path.write_bytes(make.palette_png(indices, colours, [255, 0]))
    alpha = np.array([255, 0, 255, 255], np.uint8)
    assert_array_equal(tio.read(path), np.concatenate([colours, alpha[:, None]], 1)[indices])
    path.write_bytes(make.png(9, 1, 1, 0, zlib.compress(b"\0\xaa\x80")))
    assert_array_equal(tio.read(path), np.array([[255, 0] * 4 + [255]], np.uint8))
    path.write_bytes(make.png(4, 1, 4, 0, zlib.compress(b"\0\x01\x2f")))
    assert_array_equal(tio.read(path), np.array([[0, 17, 34, 255]], np.uint8))

    table = np.zeros((3, 256), np.uint16)
    table[:, :4] = colours.T.astype(np.uint16) * 257
    tifffile.imwrite(path, indices.astype(np.uint8), photometric="palette", colormap=table)
    assert_array_equal(tio.read(path), colours[indices])
    few = make.Image.fromarray(make.picture((9, 8, 3))).quantize(5)
    few.save(path, "TIFF")
    assert_array_equal(tio.read(path), np.array(few.convert("RGB")))
    grey = make.picture((5, 6), "uint16")
    tifffile.imwrite(path, grey, photometric="miniswhite")
    assert_array_equal(tio.read(path), 65535 - grey)
    mask = make.picture((5, 11), bool)
    path.write_bytes(make.pillow(mask, "TIFF"))
    assert_array_equal(tio.read(path), mask * np.uint8(255))
    path.write_bytes(make.pillow(mask, "BMP"))
    assert_array_equal(tio.read(path), mask * np.uint8(255))


def test_gif_gives_the_first_frame(tmp_path):
    frames = [make.Image.fromarray(np.full((4, 5), value, np.uint8)) for value in (40, 90)]
    path = tmp_path / "two.gif"
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=10)
    with pytest.warns(InputWarning, match="frame 2 not used"):
        assert_array_equal(tio.read(path), np.full((4, 5, 3), 40, np.uint8))
    frames[0].save(path, transparency=frames[0].getpixel((0, 0)))
    back = tio.read(path)
    assert back.shape[2] in (3, 4)


@pytest.mark.parametrize("compression", ["tiff_lzw", "tiff_adobe_deflate", "packbits", None])
def test_tiff_of_other_programs(tmp_path, compression):
    image = make.picture((40, 50, 3))
    path = tmp_path / "other.tif"
    differences = [{"tiffinfo": {317: 2}}] * (compression in ("tiff_lzw", "tiff_adobe_deflate"))
    for options in ({}, *differences):
        path.write_bytes(make.pillow(image, "TIFF", compression=compression, **options))
        assert_array_equal(tio.read(path), image)
        grey = make.pillow(image[..., 0], "TIFF", compression=compression, **options)
        path.write_bytes(grey)
        assert_array_equal(tio.read(path), image[..., 0])
    tifffile.imwrite(path, np.moveaxis(image, -1, 0), photometric="rgb", planarconfig="separate", tile=(16, 16))
    assert_array_equal(tio.read(path), image)
    stack = make.picture((5, 2, 7, 6), "uint16")
    tifffile.imwrite(path, stack, imagej=True, metadata={"axes": "ZCYX"})
    assert_array_equal(tio.read_volume(path), np.moveaxis(stack, 1, -1))


def test_npy_layouts(tmp_path):
    image = make.picture((5, 6, 3), "float32")
    for array in (np.asfortranarray(image), image.astype(">f4"), image[:, ::-1]):
        np.save(tmp_path / "a.npy", array)
        back = tio.read(tmp_path / "a.npy")
        assert back.dtype == np.dtype("=f4")
        assert_array_equal(back, array)
    np.savez(tmp_path / "a.npz", image=image, other=image[0])
    with pytest.warns(InputWarning, match="other not used, because only the array 'image' is read"):
        assert_array_equal(tio.read(tmp_path / "a.npz"), image)
    np.savez(tmp_path / "a.npz", a=image, b=image)
    with pytest.raises(FileError, match="single array, or one with the key 'image'; got a, b"):
        tio.read(tmp_path / "a.npz")
    np.save(tmp_path / "nan.npy", np.full((4, 4), np.nan, np.float32))
    assert np.isnan(tio.read(tmp_path / "nan.npy")).all()


def test_any_layout_is_written(tmp_path):
    image = make.picture((9, 8, 3), "uint16")
    for array in (image[::-1, ::2], np.asfortranarray(image), image.astype(">u2")):
        for suffix in (".png", ".tif", ".npy"):
            tio.write(tmp_path / f"a{suffix}", array)
            assert_array_equal(tio.read(tmp_path / f"a{suffix}"), array)


@pytest.mark.parametrize(
    ("suffix", "array", "says"),
    [
        (".png", np.zeros((2, 2), np.float32), r"use one of \.exr, \.npy, \.npz, \.tif, \.tiff"),
        (".png", np.zeros((2, 2, 3), np.float32), r"use one of \.exr, \.hdr, \.npy, \.npz, \.tif, \.tiff"),
        (".png", np.zeros((2, 2, 5), np.uint8), "uint8 with 5 channels; use one of .npy, .npz, .tif, .tiff"),
        (".jpg", np.zeros((2, 2), np.uint16), "uint16 with 1 channel; use one of .npy, .npz, .png, .tif"),
        (".jpg", np.zeros((2, 2, 4), np.uint8), "use one of .avif, .*.png, .tga, .tif, .tiff, .webp"),
        (".webp", np.zeros((2, 2), np.uint8), ".bmp, .dds, .jpeg, .jpg, .jxl, .npy, .npz, .png, .tga, .tif, .tiff"),
        (".hdr", np.zeros((2, 2, 4), np.float32), ".exr"),
        (".hdr", np.zeros((2, 2, 3), np.float64), "use one of .npy, .npz, .tif, .tiff"),
        (".hdr", np.full((2, 2, 3), -1, np.float32), "negative"),
        (".hdr", np.full((2, 2, 3), np.nan, np.float32), "NaN"),
        (".exr", np.zeros((2, 2, 3), np.float64), "float64"),
        (".tif", np.zeros((2, 2), np.int64), "use one of .npy, .npz"),
        (".npy", np.zeros((2, 2, 65), np.uint8), "no format stores"),
        (".webp", np.zeros((1, 20_000, 3), np.uint8), "16383 pixels"),
        (".npy", np.array([[object()]]), "dtype object"),
        (".npy", np.zeros((2, 2), np.complex64), "complex64"),
        (".npy", [[1, 2], [3]], "must contain numbers"),
        (".npy", "text", "got dtype <U4"),
        (".png", np.zeros((0, 2), np.uint8), "and not be empty"),
        (".png", np.zeros(3, np.uint8), "got shape"),
        (".png", np.zeros((2, 2, 2, 2), np.uint8), "got shape"),
    ],
)
def test_what_a_format_cannot_hold_is_refused(tmp_path, suffix, array, says):
    path = tmp_path / f"a{suffix}"
    with pytest.raises(InvalidInput, match=says):
        tio.write(path, array)
    assert not list(tmp_path.iterdir())


def test_volumes_need_a_format_for_volumes(tmp_path):
    with pytest.raises(InvalidInput, match=r"volumes of uint8 with 1 channel; use one of \.npy, \.npz, \.tif"):
        tio.write_volume(tmp_path / "a.png", np.zeros((2, 2, 2), np.uint8))
    tio.write(tmp_path / "a.png", np.zeros((2, 2), np.uint8))
    with pytest.raises(FileError, match="is a png file, which contains one image"):
        tio.read_volume(tmp_path / "a.png")
    tio.write(tmp_path / "a.npy", np.zeros((2, 2), np.uint8))
    with pytest.raises(FileError, match="a volume has"):
        tio.read_volume(tmp_path / "a.npy")
    tio.write_volume(tmp_path / "a.npy", np.zeros((2, 2, 2, 2), np.uint8))
    with pytest.raises(FileError, match="read_volume"):
        tio.read(tmp_path / "a.npy")


@pytest.mark.parametrize("name", ["two words.png", "Köln-石.tif", "UPPER.PNG", "a" * 250 + ".exr"])
def test_names(tmp_path, name):
    image = make.picture((4, 5, 3), "float32" if name.endswith("exr") else "uint8")
    tio.write(tmp_path / name, image)
    assert_array_equal(tio.read(str(tmp_path / name)), image)


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("a.psd", "the suffix must be one of .png"),
        ("a", "got ''"),
        ("missing/a.png", "does not exist"),
        ("file/a.png", "does not exist"),
        ("folder.png", "got a folder"),
        ("n\0.png", "null"),
        ("x" * 300 + ".png", "each name in the path must have at most"),
    ],
)
def test_unwritable_places(tmp_path, name, says):
    (tmp_path / "file").write_text("regular")
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(FileError, match=says):
        tio.write(tmp_path / name, np.zeros((2, 2), np.uint8))
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "folder.png"]


def test_a_pipe_is_not_replaced(tmp_path):
    if not hasattr(os, "mkfifo"):
        pytest.skip("no named pipes here")
    os.mkfifo(tmp_path / "pipe.png")
    with pytest.raises(FileError, match="not a regular file"):
        tio.write(tmp_path / "pipe.png", np.zeros((2, 2), np.uint8))
    with pytest.raises(FileError, match="not a regular file"):
        tio.read(tmp_path / "pipe.png")


def test_overwrite(tmp_path):
    path = tmp_path / "a.png"
    tio.write(path, np.zeros((2, 2), np.uint8), overwrite=False)
    with pytest.raises(FileError, match="exists already"):
        tio.write(path, np.ones((2, 2), np.uint8), overwrite=False)
    assert tio.read(path).max() == 0
    tio.write(path, np.ones((2, 2), np.uint8))
    assert tio.read(path).max() == 1


@pytest.mark.parametrize("suffix", [".png", ".tif", ".npy", ".npz", ".jpg"])
def test_a_failure_leaves_the_former_file(tmp_path, suffix, monkeypatch):
    path = tmp_path / f"a{suffix}"
    tio.write(path, np.full((4, 4), 7, np.uint8))
    before = path.read_bytes()

    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(FileError, match="no space left"):
        tio.write(path, np.zeros((4, 4), np.uint8))
    monkeypatch.undo()
    monkeypatch.setattr(Path, "write_bytes", full)
    monkeypatch.setattr(Path, "open", full)
    monkeypatch.setattr(tifffile, "TiffWriter", full)
    with pytest.raises(FileError, match="no space left"):
        tio.write(path, np.zeros((4, 4), np.uint8))
    monkeypatch.undo()
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_atomic(tmp_path):
    path = tmp_path / "report.html"

    def interrupted(error):
        with tio.atomic(path) as temporary:
            temporary.write_text("half")
            assert (temporary.parent, temporary.suffix) == (path.parent, path.suffix)
            raise error

    for error in (ZeroDivisionError, KeyboardInterrupt):
        with pytest.raises(error):
            interrupted(error)
        assert not list(tmp_path.iterdir())
    with pytest.raises(FileError, match="cannot be written"), tio.atomic(path):
        pass
    path.write_text("old")
    path.chmod(0o640)
    link = tmp_path / "link.html"
    link.symlink_to(path)
    with tio.atomic(link) as temporary:
        temporary.write_text("new")
    assert path.read_text() == "new"
    assert link.is_symlink()
    if sys.platform != "win32":
        assert stat.S_IMODE(path.stat().st_mode) == 0o640
    with pytest.raises(FileError), tio.atomic(path, overwrite=False):
        pytest.fail("the block must not run")


def test_limits_hold_for_every_format(tmp_path):
    image = make.picture((12, 10, 3))
    for suffix in (".png", ".tif", ".webp", ".jpg", ".bmp", ".npy", ".npz", ".exr", ".hdr", ".gif"):
        path = tmp_path / f"a{suffix}"
        if suffix == ".gif":
            path.write_bytes(make.pillow(image, "GIF"))
        else:
            floats = suffix in (".exr", ".hdr")
            tio.write(path, image.astype(np.float32) if floats else image)
        assert tio.read(path, limit=120).shape == (12, 10, 3)
        with pytest.raises(LimitExceeded):
            tio.read(path, limit=119)
    tio.write_volume(path.with_suffix(".tif"), make.picture((3, 4, 5)))
    with pytest.raises(LimitExceeded, match="60 pixels, more than the limit of 59"):
        tio.read_volume(path.with_suffix(".tif"), limit=59)

"""Every file gives an array or an error message, soon, and in little memory."""

import os
import struct
import subprocess
import sys
import threading
import zlib
from contextlib import suppress

import numpy as np
import pytest
import tifffile

import image_files as make
import texrs
from texrs import io as tio
from texrs.errors import FileError, LimitExceeded, TexrsError


def valid_files():
    """Return one small file of every readable kind."""
    image = make.picture((24, 20, 3))
    floats = make.picture((24, 20, 3), "float32") + np.float32(2.5)
    files = {
        "lossy.webp": make.pillow(image, "WEBP", quality=80),
        "alpha.webp": make.pillow(make.picture((24, 20, 4)), "WEBP", quality=80, exif=make.exif(6)),
        "exif.jpg": make.pillow(image, "JPEG", exif=b"Exif\0\0" + make.exif(6)),
        "progressive.jpg": make.pillow(image, "JPEG", progressive=True),
        "a.gif": make.pillow(image, "GIF"),
        "lzw.tif": make.pillow(image, "TIFF", compression="tiff_lzw"),
        "deflate.tif": make.pillow(image, "TIFF", compression="tiff_adobe_deflate"),
        "tiled.tif": make.pillow(image, "TIFF", compression="tiff_adobe_deflate", tiffinfo={322: 16, 323: 16}),
        "ink.jpg": make.pillow(make.picture((24, 20, 4)), "JPEG", mode="CMYK"),
        "run.tga": make.pillow(image, "TGA", compression="tga_rle"),
        "bc3.dds": make.pillow(make.picture((24, 20, 4)), "DDS", pixel_format="DXT5"),
        "a.psd": make.psd(image),
        "a.avif": make.pillow(image, "AVIF"),
        "palette.png": make.palette_png(np.arange(64).reshape(8, 8) % 4, np.eye(4, 3) * 255),
    }
    for suffix in (".png", ".tif", ".webp", ".bmp", ".tga", ".dds", ".npy", ".npz"):
        files[f"a{suffix}"] = image, suffix
    files["deep.png"] = make.picture((24, 20, 4), "uint16"), ".png"
    for suffix, dtype in ((".exr", "float16"), (".exr", "float32"), (".hdr", "float32")):
        files[f"{dtype}{suffix}"] = floats.astype(dtype), suffix
    return files


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("valid")
    made = {}
    for name, content in valid_files().items():
        if isinstance(content, tuple):
            path = folder / name
            tio.write(path, content[0])
            content = path.read_bytes()
        made[name] = content
    return made


NAMES = sorted(valid_files())


@pytest.mark.parametrize("name", NAMES)
def test_files_that_are_cut_off(files, name, tmp_path):
    path, file = tmp_path / name, files[name]
    path.write_bytes(file)
    whole = tio.read(path)
    for length in {*np.linspace(1, len(file) - 1, 60).astype(int).tolist(), len(file) - 1}:
        path.write_bytes(file[:length])
        with suppress(FileError):
            # If a truncated file can be read, the missing bytes were not pixels, so all pixels must be correct.
            np.testing.assert_array_equal(tio.read(path), whole, str(length))


@pytest.mark.parametrize("name", NAMES)
def test_corrupt_files(files, name, tmp_path, capfd):
    rng = np.random.default_rng(NAMES.index(name))
    path, sentences = tmp_path / name, []
    for data in make.mutations(files[name], 200, rng):
        path.write_bytes(data)
        for read in (tio.read, tio.read_volume):
            try:
                array = read(path, limit=100_000)
            except TexrsError as error:
                sentences.append(str(error))
            else:
                assert array.size > 0
                assert array.dtype.kind in "buif"
    assert sentences
    assert all(s.startswith(str(path)) and "\n" not in s for s in sentences)
    said = capfd.readouterr()
    # The package OpenEXR prints its own lines about a damaged file, so ignore them.
    lines = [] if name.endswith(".exr") else said.err.splitlines()
    assert (said.out, lines) == ("", [])


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", r"is empty \(0 bytes\)"),
        (b"this is no image\n" * 20, "must be a file in one of the formats PNG"),
        (b"\x89PNG\r\n\x1a\n", "cut off"),
        (b"\xff\xd8\xff", "cut off"),
        (b"\xff\xd8\xff\xe0\0\0", "cut off, corrupt"),
        (b"GIF89a", "cut off"),
        (b"DDS ", "DDS failed|unsupported kind of DDS|cut off|decoding failed"),
        (b"8BPS", "cut off"),
        (b"\0\0\0\x20ftypavif", "cut off|decoding failed"),
        (b"BM", "cut off, corrupt"),
        (b"II*\0", "corrupt"),
        (b"v/1\x01", "reading failed"),
        (b"#?RADIANCE\n", "cut off|cannot be decoded"),
        (b"RIFF\0\0\0\0WEBP", "cut off|cannot be decoded"),
        (b"PK\x03\x04", "reading the archive failed"),
        (b"\x93NUMPY", "not a NumPy file"),
        (b"\x93NUMPY\x01\0\xff\xff{", "cut off or longer"),
        (make.npy("{'descr': '|O', 'fortran_order': False, 'shape': (1, 1)}"), "Python objects"),
        (make.npy("{'descr': [('a', 'f4')], 'fortran_order': False, 'shape': (1,)}"), "got"),
        (make.npy("{'descr': '<c8', 'fortran_order': False, 'shape': (2, 2)}"), "got '<c8'"),
        (make.npy("{'descr': '<M8[s]', 'fortran_order': False, 'shape': (2, 2)}"), "got"),
        (make.npy("{'descr': '|u1', 'fortran_order': False, 'shape': (2, -2)}"), "shape"),
        (make.npy("{'descr': '|u1', 'fortran_order': False, 'shape': (2, 0)}"), "empty array"),
        (make.npy("{'descr': '|u1', 'fortran_order': False, 'shape': (2, 2.5)}"), "shape"),
        (make.npy("{'descr': '|u1', 'fortran_order': False, 'shape': (4, 4)}", b"123"), "cut off"),
        (make.npy("{'descr': '|b1', 'fortran_order': False, 'shape': (1, 1)}", b"\7"), "corrupt"),
        (make.npy("__import__('os').system('true')"), "header cannot be read"),
        (make.npy("(" * 4000), "header cannot be read"),
        (make.npz({}), "one of the formats PNG|no arrays"),
        (make.npz({"a.txt": b"text"}), "no arrays"),
        (make.npz({"a.npy": b"text"}), "not a NumPy file"),
        (
            make.npz({"a.npy": make.npy("{'descr': 'O', 'fortran_order': False, 'shape': (1,)}")}),
            "Python objects",
        ),
        (b"\xff\xd8\xff\xda", "cut off, corrupt"),
    ],
)
def test_hostile_files(tmp_path, content, says):
    path = tmp_path / "hostile.png"
    path.write_bytes(content)
    with pytest.raises(FileError, match=says) as error:
        tio.read(path)
    assert str(path) in str(error.value)


def test_colours_that_are_not_read(tmp_path):
    path = tmp_path / "cmyk"
    make.Image.new("LAB", (8, 8)).save(path, "TIFF")
    with pytest.raises(FileError, match="got CIELAB"):
        tio.read(path)
    tifffile.imwrite(path, np.zeros((4, 4), np.complex64))
    with pytest.raises(FileError, match="complex64"):
        tio.read(path)


def test_missing_files_and_folders(tmp_path):
    (tmp_path / "file").write_bytes(b"regular")
    for read in (tio.read, tio.read_volume):
        with pytest.raises(FileError, match="does not exist"):
            read(tmp_path / "missing.png")
        with pytest.raises(FileError, match="got a folder"):
            read(tmp_path)
        with pytest.raises(FileError, match="cannot be opened"):
            read(tmp_path / "file" / "below.png")
        with pytest.raises(FileError, match="each name in the path must have at most 255 bytes"):
            read(tmp_path / ("x" * 300))
        with pytest.raises(FileError, match="null"):
            read("a\0b.png")
    if os.path.exists("/dev/zero"):
        with pytest.raises(FileError, match="not a regular file"):
            tio.read("/dev/zero")


def test_a_png_that_unfolds_to_gigabytes(tmp_path):
    """2.5 gigapixels in 300 kB are refused in a second and in little memory."""
    path = tmp_path / "bomb.png"
    path.write_bytes(make.png_bomb())
    assert path.stat().st_size < 400_000
    code = (
        "import sys, time\n"
        "from pathlib import Path\n"
        "from texrs import errors, io\n"
        "start = time.perf_counter()\n"
        "try:\n"
        "    io.read(sys.argv[1])\n"
        "except errors.LimitExceeded as error:\n"
        "    status = dict(line.split(':', 1) for line in Path('/proc/self/status').read_text().splitlines())\n"
        "    used = int(status['VmHWM'].split()[0])\n"
        "    print(time.perf_counter() - start, used, error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True)
    seconds, kilobytes, message = done.stdout.split(maxsplit=2)
    assert float(seconds) < 1
    assert int(kilobytes) < 200_000
    assert "2500000000 pixels, more than the limit of 268435456 pixels" in message
    assert done.stderr == ""


def test_other_bombs(tmp_path):
    path = tmp_path / "bomb"
    profile = b"name\0\0" + zlib.compress(bytes(200_000_000), 9)
    row = zlib.compress(b"\0\1\2\3")
    bombs = (
        b"BM" + bytes(12) + struct.pack("<IiiHH", 40, 2**20, 2**20, 1, 24) + bytes(24),
        b"GIF89a" + struct.pack("<HHBBB", 1, 1, 0, 0, 0) + b"," + struct.pack("<HHHHB", 0, 0, 65535, 65535, 0),
        b"\xff\xd8\xff\xc0\0\x0b\x08\xff\xff\xff\xff\x01\x01\x11\0\xff\xda\0\x08\1\1\0\0?\0",
        make.npy("{'descr': '<f8', 'fortran_order': False, 'shape': (99999, 99999)}"),
        make.npz({"a.npy": make.npy("{'descr': '<f8', 'fortran_order': False, 'shape': (99999, 99999)}")}),
    )
    for content in bombs:
        path.write_bytes(content)
        with pytest.raises(LimitExceeded, match="more than the limit"):
            tio.read(path)
    path.write_bytes(make.png(1, 1, 8, 2, row, [(b"iCCP", profile)]))
    with suppress(LimitExceeded):
        assert tio.read(path).shape == (1, 1, 3)
    # The archive states a small size and expands to a large one.
    header = make.npy("{'descr': '|u1', 'fortran_order': False, 'shape': (4, 4)}", bytes(10_000_000))
    path.write_bytes(make.npz({"image.npy": header}))
    assert tio.read(path).shape == (4, 4)


def test_large_pictures_do_not_warn(tmp_path, monkeypatch):
    """Pillow's own limit neither warns about nor stops images within the caller's limit."""
    path = tmp_path / "large.jpg"
    tio.write(path, np.zeros((40, 50), np.uint8))
    monkeypatch.setattr(make.Image, "MAX_IMAGE_PIXELS", 1500)
    assert tio.read(path).shape == (40, 50)
    monkeypatch.setattr(make.Image, "MAX_IMAGE_PIXELS", 900)
    with pytest.raises(LimitExceeded, match="Pillow"):
        tio.read(path)
    monkeypatch.setattr(make.Image, "MAX_IMAGE_PIXELS", None)
    assert tio.read(path).shape == (40, 50)


def test_reading_in_threads(files, tmp_path):
    """Decoders in many threads neither block nor disturb each other."""
    paths = [tmp_path / name for name in files]
    for path in paths:
        path.write_bytes(files[path.name])
    expected = [tio.read(path) for path in paths]
    wrong = []

    def work():
        for path, image in zip(paths, expected, strict=True):
            if not np.array_equal(tio.read(path), image):
                wrong.append(path)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(30)
    assert not wrong
    assert not any(thread.is_alive() for thread in threads)


def test_damaged_stores_and_encodings_are_refused_in_a_sentence(tmp_path):
    pytest.importorskip("zarr")
    store = tmp_path / "a.zarr"
    texrs.PlaneTexture(texrs.samples.dots((64, 64)).image).to_zarr(store, (32, 32), (32, 32))
    head = store / "zarr.json"
    whole = head.read_bytes()
    for damaged in (whole[:-20], whole.replace(b'"', b"\xff"), b"[]"):
        head.write_bytes(damaged)
        for read in (tio.read, texrs.stores.open_store):
            with pytest.raises(TexrsError):
                read(store)
    path = tmp_path / "v.tif"
    tio.write_volume(path, make.picture((6, 7, 8)))
    data, chain = bytearray(path.read_bytes()), [4]
    while at := int.from_bytes(data[chain[-1] : chain[-1] + 4], "little"):
        chain.append(at + 2 + 12 * int.from_bytes(data[at : at + 2], "little"))
    # Link the last page to the third one, which forms an endless circle.
    data[chain[-1] : chain[-1] + 4] = data[chain[2] : chain[2] + 4]
    path.write_bytes(data)
    with pytest.raises(FileError, match="in a circle"):
        tio.read_volume(path)

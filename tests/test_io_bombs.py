"""Small files that expand to gigabytes: refused, or read in the memory of their contents, by every reader."""

import io
import lzma
import struct
import subprocess
import sys
import zipfile
import zlib

import numpy as np
import pytest
import tifffile

import image_files as make
from texrs import io as tio

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="memory is measured by what Linux says of a process")

MOST = 200_000
"""Kilobytes that a reader may use for a file of a few megabytes."""
READ = """
import sys
from functools import partial
from pathlib import Path
import numpy, tifffile
import texrs
from texrs import cli, elements, io
from texrs.errors import TexrsError

def measure(name):
    table = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return int(table[name].split()[0])

def database(path):
    return texrs.TextureDatabase(Path(path).parent)[Path(path).stem]

def info(path):
    if cli.main(["info", path]):
        raise TexrsError("said")

readers = {
    "read": io.read, "read_volume": io.read_volume,
    # The following readers accept these files under any suffix.
    "read_vectors": partial(io.read_vectors, limit=2**22), "read_arrays": partial(io.read_arrays, limit=2**22),
    "read_headers": io.read_headers, "read_notes": io.read_metadata, "SourceMap": texrs.SourceMap.load,
    "Exemplar": texrs.Exemplar.load, "elements": elements.load, "database": database, "info": info,
}
small = Path(sys.argv[1]).with_name("small.npz")
numpy.savez(small, numpy.zeros((8, 8), "u1"))
for reader in readers.values():
    try:
        reader(str(small))
    except TexrsError:
        pass
for path in sys.argv[1:]:
    for name, reader in readers.items():
        Path("/proc/self/clear_refs").write_text("5")
        before = measure("VmRSS")
        try:
            reader(path)
            said = "read"
        except TexrsError as error:
            said = f"{type(error).__name__} {error}"
        print("measured", measure("VmHWM") - before, Path(path).name, name, said)
"""


def tiff(data, compression):
    """Return a TIFF file of 16 x 16 pixels, whose only strip has any bytes."""
    entries = [(256, 3, 16), (257, 3, 16), (258, 3, 8), (259, 3, compression), (262, 3, 1), (273, 4, 0), (277, 3, 1)]
    entries += [(278, 3, 16), (279, 4, len(data))]
    start = 8 + 2 + 12 * len(entries) + 4
    file = io.BytesIO()
    file.write(b"II*\0" + struct.pack("<IH", 8, len(entries)))
    for code, kind, value in entries:
        file.write(struct.pack("<HHII", code, kind, 1, start if code == 273 else value))
    file.write(bytes(4) + data)
    return file.getvalue()


def lzma_of_zeros(size):
    packer = lzma.LZMACompressor(preset=0)
    return b"".join(packer.compress(bytes(2**24)) for _ in range(size // 2**24)) + packer.flush()


def other_packing(packing):
    """Return an archive that Python would expand completely, even for a small request."""
    file = io.BytesIO()
    head = make.npy("{'descr': '|u1', 'fortran_order': False, 'shape': (8192, 8192)}")
    with zipfile.ZipFile(file, "w", packing) as archive, archive.open("image.npy", "w") as member:
        member.write(head)
        for _ in range(20):
            member.write(bytes(2**24))
    return file.getvalue()


def bombs():
    huge = (10**9,)
    grey = (2**14, 2**14 + 2**13)
    return {
        "six.npz": make.npz_bomb({f"a{i}": (huge, "u1") for i in range(6)}),
        "image.npz": make.npz_bomb({"image": (huge, "u1")}),
        "large.npz": make.npz_bomb({"image": (grey, "u1")}),
        "flat.npz": make.npz_bomb({"image": ((1, 1, 10**9), "u1")}),
        "map.npz": make.npz_bomb(
            dict.fromkeys(("texrs_source_map", "coordinates", "exemplar", "label", "shapes"), (huge, "u1"))
        ),
        "maps.npz": make.npz_bomb(
            {
                "texrs_source_map": ((), "i8"),
                "coordinates": ((4, 4, 2), "f4"),
                "exemplar": ((4, 4), "u2"),
                "label": ((4, 4), "u4"),
                "shapes": ((1, 2), "i8"),
                "jacobian": (huge, "f4"),
                "finish": (huge, "u1"),
                "finish/known/0": (huge, "?"),
            }
        ),
        "elements.npz": make.npz_bomb(
            {
                "texrs_elements": ((), "i8"),
                "image": ((8, 8, 3), "u1"),
                **dict.fromkeys(("points", "mask", "report", "sets", "known", "other"), (huge, "u1")),
            }
        ),
        "exemplar.npz": make.npz_bomb(
            {"format": ((), "i8"), "image": ((8, 8, 3), "u1"), "said": (huge, "i1"), "0/colours": (huge, "i2")}
        ),
        "bzip2.npz": other_packing(zipfile.ZIP_BZIP2),
        "lzma.npz": other_packing(zipfile.ZIP_LZMA),
        "deflate.tif": tiff(b"\x78\xda" + make.zeros(10**9) + bytes(4), 8),
        "lzma.tif": tiff(lzma_of_zeros(2**29), 34925),
        "packbits.tif": tiff(b"\x81\0" * 1_500_000, 32773),
    }


def test_no_reader_takes_much_memory_for_a_small_file(tmp_path):
    made = bombs()
    for name, content in made.items():
        (tmp_path / name).write_bytes(content)
        assert len(content) < 8_000_000
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", READ, *map(str, (tmp_path / name for name in made))],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    rows = [line.split(maxsplit=4)[1:] for line in done.stdout.splitlines() if line.startswith("measured ")]
    assert len(rows) == 11 * len(made)
    assert [row for row in rows if int(row[0]) > MOST] == []
    # Readers that succeed may only have read headers.
    assert {row[2] for row in rows if row[3] == "read"} <= {"read_headers", "read_notes", "info"}


def test_strips_that_are_filled_up_are_read(tmp_path):
    path = tmp_path / "a.tif"
    pixels = make.picture((16, 16))
    path.write_bytes(tiff(zlib.compress(pixels.tobytes() + bytes(100)), 8))
    np.testing.assert_array_equal(tio.read(path), pixels)
    runs = b"\x80".join(b"\x7f" + half for half in (pixels.tobytes()[:128], pixels.tobytes()[128:]))
    path.write_bytes(tiff(runs, 32773))
    np.testing.assert_array_equal(tio.read(path), pixels)
    for compression in ("zlib", "lzma"):
        large = make.picture((700, 400, 3))
        tifffile.imwrite(path, large, compression=compression, rowsperstrip=700, photometric="rgb")
        np.testing.assert_array_equal(tio.read(path), large)

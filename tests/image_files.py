"""Files of every format, made from scratch, for the tests of reading and writing."""

import io
import struct
import zipfile
import zlib

import numpy as np
from PIL import Image


def picture(shape, dtype="uint8", seed=0):
    """Return smooth stripes with some noise, which compress only partly."""
    dtype = np.dtype(dtype)
    rng = np.random.default_rng(seed)
    values = 0.5 + 0.4 * np.sin(np.arange(np.prod(shape)) * 0.07).reshape(shape)
    values = np.clip(values + rng.normal(0, 0.05, shape), 0, 1)
    if dtype == np.bool_:
        return values > 0.5
    if dtype.kind == "f":
        return (values * 8 - 2).astype(dtype)
    info = np.iinfo(dtype)
    low, high = max(info.min, -(2**52)), min(info.max, 2**52)
    return (low + values * (high - low)).astype(dtype)


def png(width, height, bits, colour, rows, chunks=(), behind=()):
    """Return a PNG file with any header and any stream."""

    def chunk(name, data):
        body = name + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    header = struct.pack(">IIBBBBB", width, height, bits, colour, 0, 0, 0)
    chunks = [(b"IHDR", header), *chunks, (b"IDAT", rows), *behind, (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunk(name, data) for name, data in chunks)


def png_bomb(side=50_000):
    """Return 2.5 gigapixels in 300 kB."""
    packer = zlib.compressobj(9)
    row = bytes((side + 7) // 8 + 1)
    rows = b"".join(packer.compress(row * 1000) for _ in range(side // 1000)) + packer.flush()
    return png(side, side, 1, 0, rows)


def exif(orientation, order="<"):
    """Return an Exif block that contains only the orientation."""
    mark = b"II*\0" if order == "<" else b"MM\0*"
    entry = struct.pack(order + "HHIHH", 274, 3, 1, orientation, 0)
    return mark + struct.pack(order + "IH", 8, 1) + entry + struct.pack(order + "I", 0)


def pillow(array, kind, mode=None, **options):
    """Encode by Pillow, optionally as a mode with other channel names."""
    file = io.BytesIO()
    image = Image.fromarray(array)
    if mode is not None:
        image = Image.frombytes(mode, image.size, array.tobytes())
    image.save(file, kind, **options)
    return file.getvalue()


def psd(array, bits=8, mode=3, resources=b""):
    """Return a PSD file: a header, resources, no layers, and the flattened image."""
    rows, columns, channels = array.shape
    head = b"8BPS" + struct.pack(">H6xHIIHH", 1, channels, rows, columns, bits, mode)
    sections = struct.pack(">II", 0, len(resources)) + resources + struct.pack(">I", 0)
    return head + sections + b"\0\0" + np.moveaxis(array, -1, 0).tobytes()


def palette_png(indices, colours, transparent=None):
    """Return a PNG file with a palette of (n, 3) uint8."""
    rows = b"".join(b"\0" + row.tobytes() for row in indices.astype(np.uint8))
    chunks = [(b"PLTE", colours.astype(np.uint8).tobytes())]
    if transparent is not None:
        chunks.append((b"tRNS", bytes(transparent)))
    return png(indices.shape[1], indices.shape[0], 8, 3, zlib.compress(rows), chunks)


def npy(header, data=b""):
    """Return an .npy file with any header."""
    text = header.encode() + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + data


def npz(members):
    """Return a deflated archive of any members."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return file.getvalue()


def zeros(count, step=2**20):
    """Return deflated zeros of this length, as repetitions of one piece."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    packer.compress(bytes(step)), packer.flush(zlib.Z_FULL_FLUSH)
    piece = packer.compress(bytes(step)) + packer.flush(zlib.Z_FULL_FLUSH)
    return piece * (count // step) + packer.compress(bytes(count % step)) + packer.flush()


def npz_bomb(members, packing=zipfile.ZIP_DEFLATED):
    """Return an archive of zeros, of shape and dtype by name. Its checksums are wrong."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for name, (shape, dtype) in members.items():
            head = npy(f"{{'descr': {np.dtype(dtype).str!r}, 'fortran_order': False, 'shape': {shape}}}")
            size = int(np.prod(shape, dtype=object)) * np.dtype(dtype).itemsize
            # Store the header of the array in an uncompressed deflate block of its own.
            stored = b"\0" + struct.pack("<HH", len(head), len(head) ^ 0xFFFF) + head
            data = stored + zeros(size)
            info = zipfile.ZipInfo(f"{name}.npy")
            at = file.tell()
            archive.writestr(info, data)
            info.compress_type, info.file_size = packing, len(head) + size
            # Write the changed type and size also to the local header of the member.
            end = file.tell()
            file.seek(at)
            file.write(info.FileHeader(False))
            file.seek(end)
    return file.getvalue()


def mutations(file, count, rng):
    """Return damaged versions of a file: changed, cut, doubled, blanked. Half of the damage is in the header."""
    for _ in range(count):
        data = bytearray(file)
        for _ in range(rng.integers(1, 4)):
            reach = len(data) if rng.random() < 0.5 else min(len(data), 128)
            at = int(rng.integers(reach))
            match rng.integers(6):
                case 0 | 1:
                    data[at] = int(rng.integers(256))
                case 2:
                    data[at : at + 4] = rng.choice(
                        [b"\xff\xff\xff\xff", b"\0\0\0\0", b"\x7f\xff\xff\xff", b"\xff\xff\xff\x7f"]
                    )[:4].ljust(4, b"\0")
                case 3:
                    del data[at : at + int(rng.integers(1, 40))]
                case 4:
                    data[at:at] = data[at : at + int(rng.integers(1, 40))]
                case 5:
                    del data[at:]
            if not data:
                break
        yield bytes(data)


def exr_with_chroma(luminance, red, blue):
    """Return an uncompressed EXR file of floats: luminance, and chroma of every second row and column."""
    rows, columns = luminance.shape

    def attribute(name, kind, data):
        return name + b"\0" + kind + b"\0" + struct.pack("<i", len(data)) + data

    planes = ((b"BY", blue, 2), (b"RY", red, 2), (b"Y", luminance, 1))
    channels = b"".join(name + b"\0" + struct.pack("<iiii", 2, 0, step, step) for name, _, step in planes) + b"\0"
    box = struct.pack("<4i", 0, 0, columns - 1, rows - 1)
    head = b"v/1\x01" + struct.pack("<i", 2)
    head += attribute(b"channels", b"chlist", channels) + attribute(b"compression", b"compression", b"\0")
    head += attribute(b"dataWindow", b"box2i", box) + attribute(b"displayWindow", b"box2i", box)
    head += attribute(b"lineOrder", b"lineOrder", b"\0") + attribute(
        b"pixelAspectRatio", b"float", struct.pack("<f", 1)
    )
    head += attribute(b"screenWindowCenter", b"v2f", bytes(8)) + attribute(
        b"screenWindowWidth", b"float", struct.pack("<f", 1)
    )
    head += b"\0"
    lines, at = [], len(head) + 8 * rows
    offsets = b""
    for row in range(rows):
        data = b"".join(p[row // step].astype("<f4").tobytes() for _, p, step in planes if row % step == 0)
        offsets += struct.pack("<Q", at)
        lines.append(struct.pack("<ii", row, len(data)) + data)
        at += len(lines[-1])
    return head + offsets + b"".join(lines)


def ink_profile(corners):
    """Return an ICC profile of CMYK: CIELAB at the 16 corners of the cube of inks, and linear between them."""
    table = np.asarray(corners, float).reshape(16, 3)
    codes = np.rint(np.column_stack([table[:, 0] * 2.55, table[:, 1:] + 128])).astype(np.uint8)
    lut = b"mft1" + bytes(4) + bytes((4, 3, 2, 0)) + struct.pack(">9i", *(65536 if i % 4 == 0 else 0 for i in range(9)))
    lut += bytes(range(256)) * 4 + codes.tobytes() + bytes(range(256)) * 3
    lut += bytes(-len(lut) % 4)
    text = b"desc" + bytes(4) + struct.pack(">I", 5) + b"inks\0" + bytes(78)
    text += bytes(-len(text) % 4)
    white = b"XYZ " + bytes(4) + struct.pack(">3i", 63190, 65536, 54061)
    tags = {b"desc": text, b"wtpt": white, b"A2B0": lut, b"A2B1": lut, b"cprt": b"text" + bytes(4) + b"none"}
    at, entries, body = 128 + 4 + 12 * len(tags), b"", b""
    for name, data in tags.items():
        entries += name + struct.pack(">II", at + len(body), len(data))
        body += data
    size = at + len(body)
    head = struct.pack(">I4sI4s4s4s", size, bytes(4), 0x02400000, b"prtr", b"CMYK", b"Lab ")
    head += struct.pack(">6H", 2026, 1, 1, 0, 0, 0) + b"acsp" + bytes(28) + struct.pack(">3i", 63190, 65536, 54061)
    return head.ljust(128, b"\0") + struct.pack(">I", len(tags)) + entries + body

"""Formats that Pillow and tifffile read: the result is right, or an error names the missing part."""

import struct
import sys
from pathlib import Path

import numpy as np
import pytest
import tifffile
from numpy.testing import assert_allclose, assert_array_equal
from PIL import Image, ImageCms, features

import image_files as make
import texrs
from texrs import io as tio
from texrs._notices import collect
from texrs.cli import main
from texrs.errors import FileError, InputWarning, InvalidInput
from texrs.io import _tiff, formats, pillow
from texrs.materials import Material

COLOURS = make.picture((24, 20, 3))
INKS = make.picture((24, 20, 4))


def read_with_notices(path):
    with collect(show=lambda line: None) as notices:
        return tio.read(path), notices


# --- TGA, DDS, PSD, AVIF, JPEG XL ------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", sorted(pillow.SAVED.keys() - {".jxl"}))
def test_pillow_reads_what_is_written(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    tio.write(path, COLOURS if suffix != ".gif" else COLOURS // 64 * 64)
    with Image.open(path) as opened:
        assert_array_equal(np.asarray(opened.convert("RGB")), tio.read(path))
    assert_allclose(tio.read(path).astype(int), COLOURS if suffix != ".gif" else COLOURS // 64 * 64, atol=24)


@pytest.mark.parametrize("channels", [1, 3, 4])
def test_tga_of_other_programs(tmp_path, channels):
    image = make.picture((24, 20) if channels == 1 else (24, 20, channels))
    path = tmp_path / "a.tga"
    for options in ({}, {"compression": "tga_rle"}, {"orientation": 1}):
        path.write_bytes(make.pillow(image, "TGA", **options))
        assert_array_equal(tio.read(path), image)
    path.rename(tmp_path / "a.dat")
    with pytest.raises(FileError, match="must be a file in one of the formats PNG, .* AVIF, JPEG XL"):
        tio.read(tmp_path / "a.dat")


@pytest.mark.parametrize("layout", ["DXT1", "DXT3", "DXT5", "BC2", "BC3", "BC5"])
def test_compressed_dds(tmp_path, layout):
    path = tmp_path / "a.dds"
    clear = np.dstack([COLOURS, make.picture((24, 20), seed=1)])
    path.write_bytes(make.pillow(COLOURS if layout == "BC5" else clear, "DDS", pixel_format=layout))
    with Image.open(path) as opened:
        expected = np.asarray(opened)
    back = tio.read(path)
    assert_array_equal(back, expected if layout != "DXT1" or back.shape[2] == 4 else expected[..., :3])
    # Opaque colours in compressed blocks are read without alpha.
    path.write_bytes(make.pillow(COLOURS, "DDS", pixel_format=layout))
    assert tio.read(path).shape == (24, 20, 3)


def make_dds(layout, blocks):
    """Return a DDS file of 8 x 8 pixels in blocks of 16 bytes."""
    head = struct.pack("<7I44x", 124, 0x1007, 8, 8, 0, 0, 0) + struct.pack(
        "<2I4s20x5I", 32, 4, b"DX10", 0x1000, 0, 0, 0, 0
    )
    return b"DDS " + head + struct.pack("<5I", layout, 3, 0, 1, 0) + blocks


@pytest.mark.parametrize(
    ("layout", "channels"), [(98, 3), (95, 3), (80, 1), (83, 3)], ids=["BC7", "BC6H", "BC4", "BC5"]
)
def test_dds_of_directx_10(tmp_path, layout, channels):
    path = tmp_path / "a.dds"
    path.write_bytes(make_dds(layout, bytes(range(64))))
    back, notices = read_with_notices(path)
    assert back.shape[:2] == (8, 8)
    assert (back.shape[2:] or (1,)) in ((channels,), (4,))
    assert bool(notices.assumed) == (layout == 95)


def test_dds_that_is_cut_off_is_no_black_picture(tmp_path):
    path = tmp_path / "a.dds"
    file = make.pillow(COLOURS, "DDS")
    path.write_bytes(file[:-200])
    with pytest.raises(FileError, match="cut off"):
        tio.read(path)


def test_psd(tmp_path):
    path = tmp_path / "a.psd"
    path.write_bytes(make.psd(COLOURS))
    assert_array_equal(tio.read(path), COLOURS)
    path.write_bytes(make.psd(INKS))
    assert_array_equal(tio.read(path), INKS)
    path.write_bytes(make.psd(COLOURS.astype(">u2"), bits=16))
    with pytest.raises(FileError, match="unsupported kind of PSD; save it with 8 bits"):
        tio.read(path)
    # In a file without compatibility, Photoshop marks the flattened image as invalid.
    version = b"8BIM" + struct.pack(">HHIIB", 1057, 0, 5, 1, 0) + b"\0"
    path.write_bytes(make.psd(COLOURS, resources=version))
    with pytest.raises(FileError, match="no flattened image; save it with 'maximize compatibility'"):
        tio.read(path)
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    icc = b"8BIM" + struct.pack(">HHI", 1039, 0, len(profile)) + profile + b"\0" * (len(profile) & 1)
    path.write_bytes(make.psd(COLOURS, resources=icc))
    assert tio.read_metadata(path).profile == profile


@pytest.mark.skipif(not features.check("avif"), reason="this Pillow has no AVIF")
def test_avif(tmp_path):
    path = tmp_path / "a.avif"
    path.write_bytes(make.pillow(COLOURS, "AVIF", quality=100, subsampling="4:4:4", exif=make.exif(6)))
    assert tio.read(path).shape == (20, 24, 3)
    assert_allclose(tio.read(path).astype(int), np.rot90(COLOURS, -1), atol=4)
    first = [tio.write(tmp_path / f"{n}.avif", COLOURS) or (tmp_path / f"{n}.avif").read_bytes() for n in "ab"]
    assert first[0] == first[1]


def test_decoders_that_are_missing_are_named(tmp_path, monkeypatch):
    path = tmp_path / "a.jxl"
    path.write_bytes(b"\xff\x0a" + bytes(40))
    monkeypatch.setitem(sys.modules, "pillow_jxl", None)
    monkeypatch.setitem(sys.modules, "jxlpy", None)
    for kind in ("JXL", "AVIF"):
        Image.init()
        monkeypatch.delitem(Image.OPEN, kind, raising=False)
        monkeypatch.delitem(Image.SAVE, kind, raising=False)
    for work in (lambda: tio.read(path), lambda: tio.write(path, COLOURS)):
        with pytest.raises(FileError, match="JPEG XL needs a plugin of Pillow: pip install pillow-jxl-plugin"):
            work()
    path.write_bytes(b"\0\0\0\x20ftypavif" + bytes(40))
    with pytest.raises(FileError, match=r"AVIF needs Pillow 11\.3 or newer"):
        tio.read(path)


def test_gif_is_written_with_up_to_256_colours(tmp_path):
    path = tmp_path / "a.gif"
    few = COLOURS // 64 * 64
    clear = np.dstack([few, np.full((24, 20), 255, np.uint8)])
    clear[:5, :5] = 0
    for image in (few, clear):
        tio.write(path, image)
        assert_array_equal(tio.read(path), image)
    with pytest.raises(InvalidInput, match=r"\.gif cannot store \d+ colours, but only 256"):
        tio.write(path, np.random.default_rng(0).integers(0, 256, (24, 20, 3), np.uint8))
    clear[:5, :5, 3] = 128
    with pytest.raises(InvalidInput, match="more than one transparent colour"):
        tio.write(path, clear)


# --- inks ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["JPEG", "TIFF", "TIFF LZW", "PSD"])
def test_inks_become_srgb(tmp_path, kind):
    path = tmp_path / "a"
    if kind == "PSD":
        # PSD stores inks inverted.
        path.write_bytes(make.psd(255 - INKS, mode=4))
    else:
        options = {"compression": "tiff_lzw"} if kind == "TIFF LZW" else {"quality": 100} if kind == "JPEG" else {}
        path.write_bytes(make.pillow(INKS, kind.split()[0], mode="CMYK", **options))
    back, notices = read_with_notices(path)
    assert back.shape == (24, 20, 3)
    assert notices.assumed == [f"{path}: CMYK without a usable profile; converted to RGB by Pillow's formula"]
    expected = np.asarray(Image.frombytes("CMYK", (20, 24), INKS.tobytes()).convert("RGB"))
    assert_allclose(back.astype(int), expected, atol=8)


@pytest.mark.parametrize("kind", ["JPEG", "TIFF"])
def test_inks_are_converted_by_their_profile(tmp_path, kind):
    """The profile decides the colour of an ink, not the formula."""
    rng = np.random.default_rng(0)
    corners = np.column_stack([rng.uniform(30, 90, 16), rng.uniform(-40, 40, (16, 2))])
    corners[0], corners[8], corners[15] = (100, 0, 0), (65, 40, 60), (0, 0, 0)
    profile = make.ink_profile(corners)
    inks = np.zeros((16, 16, 4), np.uint8)
    inks[..., 0] = 255
    path = tmp_path / "a"
    path.write_bytes(make.pillow(inks, kind, mode="CMYK", icc_profile=profile))
    back, notices = read_with_notices(path)
    assert notices.assumed == [f"{path}: CMYK converted to sRGB by its profile"]
    # The profile maps this ink to CIELAB (65, 40, 60), which is an orange. Pillow's formula would give cyan.
    assert_allclose(back[8, 8].astype(int), (239, 127, 43), atol=6)
    # The profile of the inks does not apply to the converted colours, so it is not written.
    assert tio.read_metadata(path).fit(3).profile is None


def test_a_damaged_profile_of_inks_is_not_used(tmp_path):
    path = tmp_path / "a.jpg"
    path.write_bytes(make.pillow(INKS, "JPEG", mode="CMYK", icc_profile=b"no profile" * 20))
    _, notices = read_with_notices(path)
    assert "without a usable profile" in notices.assumed[0]


# --- TIFF ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "int16", "int32", "float32"])
def test_label_volumes_in_lzw(tmp_path, dtype):
    path = tmp_path / "labels.tif"
    volume = make.picture((5, 24, 20), dtype)
    mode = {"int16": "I;16S"}.get(dtype)
    pages = [Image.fromarray(plane.astype("int32") if mode else plane) for plane in volume]
    pages[0].save(path, "TIFF", compression="tiff_lzw", save_all=True, append_images=pages[1:])
    expected = volume.astype("int32") if mode else volume
    back = tio.read_volume(path)
    assert back.dtype == expected.dtype
    assert_array_equal(back, expected)


def encode_lzw(data: bytes) -> bytes:
    """Return LZW codes of TIFF for single bytes, with a clear code before the table grows."""
    bits = "".join(f"{code:09b}" for i, byte in enumerate(data) for code in ((256, byte) if i % 200 == 0 else (byte,)))
    bits += f"{257:09b}"
    bits += "0" * (-len(bits) % 8)
    return int(bits, 2).to_bytes(len(bits) // 8, "big")


def write_lzw(path, image, *, tile=None, planar=False):
    """Write a TIFF file with strips or tiles compressed by LZW, which tifffile alone cannot write."""
    tifffile.imwrite(
        path,
        np.moveaxis(image, -1, 0) if planar else image,
        photometric="rgb" if image.ndim == 3 else "minisblack",
        planarconfig="separate" if planar else None if image.ndim == 2 else "contig",
        tile=tile,
        metadata=None,
    )
    with tifffile.TiffFile(path) as tif:
        page = tif.pages[0]
        chunks = [
            Path(path).read_bytes()[o : o + n] for o, n in zip(page.dataoffsets, page.databytecounts, strict=True)
        ]
        at = {tag.code: (tag.valueoffset, tag.count) for tag in page.tags.values()}
    file, places, lengths = bytearray(Path(path).read_bytes()), [], []
    for chunk in chunks:
        places.append(len(file))
        file += encode_lzw(chunk)
        lengths.append(len(file) - places[-1])
        file += bytes(len(file) & 1)
    tiled = tile is not None
    for code, values in ((324 if tiled else 273, places), (325 if tiled else 279, lengths)):
        offset, count = at[code]
        width = 4 if code in (324, 273) else page.tags[code].dtype.value
        step = {1: 1, 3: 2, 4: 4}.get(int(width), 4)
        file[offset : offset + step * count] = b"".join(int(v).to_bytes(step, "little") for v in values)
    offset, _ = at[259]
    file[offset : offset + 2] = (5).to_bytes(2, "little")
    Path(path).write_bytes(file)


@pytest.mark.parametrize("planar", [False, True])
@pytest.mark.parametrize("tile", [None, (16, 16)])
def test_lzw_in_tiles_and_planes(tmp_path, tile, planar):
    path = tmp_path / "a.tif"
    image = make.picture((40, 36, 3))
    write_lzw(path, image, tile=tile, planar=planar)
    assert_array_equal(tio.read(path), image)


@pytest.mark.skipif(5 in tifffile.TIFF.DECOMPRESSORS, reason="imagecodecs is there")
def test_tiff_that_needs_a_package_names_it(tmp_path):
    path = tmp_path / "a.tif"
    write_lzw(path, make.picture((40, 36, 3), "uint32"))
    with pytest.raises(FileError, match=r"or needs the package imagecodecs \(pip install texrs\[tiff\]\); .*uint32"):
        tio.read(path)


def test_all_of_tiff_with_imagecodecs(tmp_path):
    pytest.importorskip("imagecodecs")
    for dtype in ("uint8", "uint16", "uint32", "float16", "float64"):
        for compression in ("lzw", "zstd"):
            image = make.picture((40, 36, 3), dtype)
            tifffile.imwrite(tmp_path / "a.tif", image, compression=compression, photometric="rgb", tile=(16, 16))
            assert_array_equal(tio.read(tmp_path / "a.tif"), image)


def test_a_picture_inside_a_tile_that_is_too_large_is_refused():
    small, large = (make.pillow(np.zeros((side, side), np.uint8), "JPEG") for side in (16, 640))
    assert _tiff._measure(7, small, 1024) == 256
    assert _tiff._measure(7, large, 1024) == 640 * 640


def test_the_extra_is_in_the_package():
    import tomllib

    said = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))
    assert "imagecodecs" in said["project"]["optional-dependencies"]["tiff"][0]
    assert "texrs[tiff]" in (Path(__file__).parents[1] / "docs" / "install.md").read_text(encoding="utf-8")


# --- frames and pages ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("kind", "suffix"), [("GIF", ".gif"), ("PNG", ".png"), ("WEBP", ".webp"), ("AVIF", ".avif")])
def test_frames_that_are_not_used_are_reported(tmp_path, kind, suffix, capsys):
    if kind == "AVIF" and not features.check("avif"):
        pytest.skip("this Pillow has no AVIF")
    path = tmp_path / f"a{suffix}"
    frames = [Image.fromarray(np.full((24, 20, 3), value, np.uint8)) for value in (40, 90, 200)]
    options = {"lossless": True} if kind == "WEBP" else {}
    frames[0].save(path, kind, save_all=True, append_images=frames[1:], duration=40, **options)
    with pytest.warns(InputWarning, match=f"a{suffix}: frames 2 to 3 not used"):
        back = tio.read(path)
    assert_allclose(back[..., :3].astype(int), np.full((24, 20, 3), 40), atol=3)
    assert main(["info", str(path)]) == 0
    said = capsys.readouterr()
    assert "3 frames, the first is read" in said.out
    assert main(["tile", str(path), "-o", str(tmp_path / "out.png"), "--strict"]) == 2
    assert "frames 2 to 3 not used; this is an error because of --strict" in capsys.readouterr().err


def test_pages_of_other_sizes_are_reported(tmp_path):
    path = tmp_path / "pages.tif"
    tifffile.imwrite(path, COLOURS, photometric="rgb", metadata=None)
    tifffile.imwrite(path, make.picture((9, 8)), append=True, metadata=None)
    with pytest.warns(
        InputWarning, match=r"pages.tif: 1 of 2 pages not used, because they do not form a stack with the first page"
    ):
        assert_array_equal(tio.read(path), COLOURS)
    # Pages of the same size do not always form a stack.
    with tifffile.TiffWriter(path) as writer:
        for _ in range(3):
            writer.write(COLOURS, photometric="rgb")
    with pytest.warns(
        InputWarning, match=r"2 of 3 pages not used, because they do not form a stack with the first page"
    ):
        assert_array_equal(tio.read(path), COLOURS)
    # A page with a thumbnail is not reported, because it shows the same image.
    tifffile.imwrite(path, COLOURS, photometric="rgb", metadata=None)
    tifffile.imwrite(path, make.picture((9, 8)), append=True, metadata=None, subfiletype=1)
    assert_array_equal(tio.read(path), COLOURS)


def test_a_stack_names_the_commands_for_it(tmp_path):
    tio.write_volume(tmp_path / "a.tif", make.picture((4, 9, 8)))
    with pytest.raises(FileError, match="4 planes; read them with texrs.io.read_volume"):
        tio.read(tmp_path / "a.tif")


# --- one list of suffixes, one path ----------------------------------------------------------------------------------


def test_folders_of_any_format_are_materials(tmp_path):
    for suffix in (".tga", ".dds"):
        folder = tmp_path / suffix[1:]
        folder.mkdir()
        tio.write(folder / f"rock_albedo{suffix}", COLOURS)
        tio.write(folder / f"rock_normal{suffix}", COLOURS)
        assert sorted(Material.read(folder)) == ["albedo", "normal"]


def test_every_suffix_that_is_written_is_read():
    assert set(formats.WRITTEN_IMAGES) <= set(formats.READ_IMAGES)
    assert set(formats.WRITTEN_VOLUMES) <= set(formats.READ_VOLUMES)
    assert set(pillow.SAVED) <= set(formats.WRITTEN_IMAGES)


def test_opaque_alpha_may_go_to_formats_without_alpha(tmp_path):
    opaque = np.dstack([COLOURS, np.full((24, 20), 255, np.uint8)])
    path = tmp_path / "a.jpg"
    with collect(show=lambda line: None) as notices:
        tio.write(path, opaque)
    assert notices.assumed == [".jpg file: written without the alpha channel, which is opaque"]
    assert tio.read(path).shape == (24, 20, 3)
    opaque[3, 4, 3] = 254
    with pytest.raises(InvalidInput, match=r"\.jpg cannot store uint8 with 4 channels"):
        tio.write(path, opaque)


def test_a_hole_that_is_filled_may_go_to_jpeg(tmp_path, capsys):
    image = np.dstack([texrs.samples.pebbles((64, 64)).image, np.full((64, 64), 255, np.uint8)])
    image[20:30, 20:30] = 0
    tio.write(tmp_path / "a.png", image)
    hole = np.zeros((64, 64), np.uint8)
    hole[20:30, 20:30] = 255
    tio.write(tmp_path / "hole.png", hole)
    words = [str(tmp_path / "a.png"), str(tmp_path / "hole.png"), "-o", str(tmp_path / "out.jpg")]
    assert main(["inpaint", *words]) == 0
    assert tio.read(tmp_path / "out.jpg").shape == (64, 64, 3)
    # A design of an image with transparent pixels also has transparency, so JPEG is refused before the work begins.
    assert main(["design", str(tmp_path / "a.png"), "-o", str(tmp_path / "no.jpg")]) == 2
    assert "cannot store uint8 with 4 channels" in capsys.readouterr().err


def test_luminance_and_chroma_of_exr_are_refused_with_a_remedy(tmp_path, capsys):
    path = tmp_path / "a.exr"
    path.write_bytes(make.exr_with_chroma(np.ones((16, 16)), np.zeros((8, 8)), np.zeros((8, 8))))
    with pytest.raises(FileError, match="subsampled chroma .* convert it to R, G and B"):
        tio.read(path)
    assert main(["tile", str(path), "-o", str(tmp_path / "out.exr")]) == 2
    assert "convert it to R, G and B" in capsys.readouterr().err

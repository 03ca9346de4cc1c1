"""Metadata of files: profiles, densities, records of their creation."""

import io as streams
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
import tifffile
from PIL import Image, ImageCms

from texrs import io
from texrs.io.annotation import BLANK, is_unchanged, write_record

PROFILE = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
MADE = '{"texrs": "1", "options": {"--a-b": "\\u00fc"}, ' + BLANK + "}"
PIXELS = np.random.default_rng(0).integers(0, 256, (20, 31, 3)).astype(np.uint8)
PRIMARIES = (0.3127, 0.329, 0.64, 0.33, 0.3, 0.6, 0.15, 0.06)
KINDS = {
    "a.png": PIXELS,
    "b.png": PIXELS.astype(np.uint16) * 257,
    "c.jpg": PIXELS,
    "d.webp": PIXELS,
    "e.bmp": PIXELS,
    "f.tif": PIXELS.astype(np.uint16),
    "g.tiff": PIXELS.astype(np.float32),
    "h.exr": PIXELS.astype(np.float32),
    "i.npz": PIXELS,
    "j.npy": PIXELS,
    "k.hdr": PIXELS.astype(np.float32),
}


@pytest.mark.parametrize("name", KINDS)
def test_notes_come_back_and_change_no_pixel(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    io.write(path, KINDS[name])
    before = io.read(path)
    io.write(path, KINDS[name], notes=io.Metadata(profile=PROFILE, density=(3000.0, 2000.0), primaries=PRIMARIES))
    write_record(path, MADE)
    assert (io.read(path) == before).all()
    found = io.read_metadata(path)
    suffix = path.suffix
    assert (found.profile == PROFILE) == (suffix in (".png", ".jpg", ".webp", ".tif", ".tiff"))
    if suffix in (".png", ".jpg", ".bmp", ".tif", ".tiff", ".exr"):
        assert found.density == pytest.approx((3000, 2000), rel=0.01)
    if suffix in (".png", ".exr"):
        assert found.primaries == pytest.approx(PRIMARIES, abs=1e-5)
    assert found.made is not None
    assert found.made.startswith('{"texrs": "1", "options": {"')
    assert is_unchanged(path, found.made)
    beside = path.with_name(name + ".json")
    assert beside.exists() == (suffix not in (".png", ".tif", ".tiff", ".exr"))
    whole = path.read_bytes()
    write_record(path, MADE)
    assert io.read_metadata(path) == found
    assert path.read_bytes() == whole


@pytest.mark.parametrize("name", KINDS)
def test_a_changed_file_is_told_from_what_was_made(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    io.write(path, KINDS[name])
    write_record(path, MADE)
    other = tmp_path / f"other{path.suffix}"
    io.write(other, KINDS[name][::-1])
    made = io.read_metadata(path).made
    assert made is not None
    write_record(other, made)
    assert io.read_metadata(other).made == made
    assert not is_unchanged(other, made)


@pytest.mark.parametrize("suffix", [".tif", ".npy", ".npz", ".nii.gz", ".nrrd", ".vti"])
def test_volumes_say_how_they_were_made(tmp_path: Path, suffix: str) -> None:
    path, volume = tmp_path / f"v{suffix}", np.arange(5 * 6 * 7 * 3, dtype=np.uint16).reshape(5, 6, 7, 3)
    io.write_volume(path, volume)
    write_record(path, MADE)
    if suffix != ".vti":
        assert (io.read_volume(path) == volume).all()
    made = io.read_metadata(path).made
    assert made is not None
    assert is_unchanged(path, made)


def test_pages_and_reports_say_how_they_were_made(tmp_path: Path) -> None:
    for name, text in (("p.html", "<p>--</p>\n"), ("r.json", '{\n  "a": [1, 2.5]\n}\n'), ("e.json", "{}\n")):
        path = tmp_path / name
        path.write_text(text)
        write_record(path, MADE)
        made = io.read_metadata(path).made
        assert made is not None
        assert is_unchanged(path, made)
        text = path.read_text()
        path.write_text(text.replace("<p>", "<q>") if name == "p.html" else text.replace("{\n", '{"z": 1,\n', 1))
        assert not is_unchanged(path, made)


def test_other_readers_find_the_notes(tmp_path: Path) -> None:
    for name in ("a.png", "b.png", "c.jpg", "f.tif", "d.webp"):
        io.write(tmp_path / name, KINDS[name], notes=io.Metadata(profile=PROFILE, density=(3000.0, 2000.0)))
        write_record(tmp_path / name, MADE)
        with Image.open(tmp_path / name) as picture:
            picture.load()
            assert picture.info["icc_profile"] == PROFILE
            if name != "d.webp":
                assert [float(d) for d in picture.info["dpi"]] == pytest.approx([50.8, 76.2], abs=0.5)
            if name.endswith("png"):
                assert picture.info["texrs"].startswith('{"texrs"')
    with tifffile.TiffFile(tmp_path / "f.tif") as tif:
        assert tif.pages[0].tags["Software"].value.startswith('{"texrs"')
        assert (tif.asarray() == KINDS["f.tif"]).all()


def test_what_other_writers_say_is_read(tmp_path: Path) -> None:
    picture = Image.fromarray(PIXELS)
    for suffix in ("png", "jpg", "tif", "webp"):
        path = tmp_path / f"o.{suffix}"
        exif = picture.getexif()
        exif[274] = 6
        more = {} if suffix == "webp" else {"dpi": (72, 144)}
        picture.save(path, icc_profile=PROFILE, exif=exif, **more)
        found = io.read_metadata(path)
        assert found.profile == PROFILE, suffix
        if more:
            # Reading turns the image upright, which also exchanges its two densities.
            assert found.density == pytest.approx((72 / 0.0254, 144 / 0.0254), rel=1e-3), suffix
    chunks = b"gAMA" + struct.pack(">I", 100_000), b"sRGB\0"
    plain = streams.BytesIO()
    picture.save(plain, "png")
    data = plain.getvalue()
    extra = b"".join(struct.pack(">I", len(c) - 4) + c + struct.pack(">I", zlib.crc32(c)) for c in chunks)
    (tmp_path / "linear.png").write_bytes(data[:33] + extra + data[33:])
    found = io.read_metadata(tmp_path / "linear.png")
    assert (found.gamma, found.srgb) == (1.0, True)
    io.write(tmp_path / "linear.png", PIXELS, notes=io.Metadata(gamma=1.0))
    assert io.read_metadata(tmp_path / "linear.png") == io.Metadata(gamma=1.0)


def test_profiles_fit_channels() -> None:
    grey = PROFILE[:16] + b"GRAY" + PROFILE[20:]
    assert [io.Metadata(profile=PROFILE).fit(n).profile is not None for n in range(1, 6)] == [
        False,
        False,
        True,
        True,
        False,
    ]
    assert [io.Metadata(profile=grey).fit(n).profile is not None for n in range(1, 6)] == [
        True,
        True,
        False,
        False,
        False,
    ]


@pytest.mark.parametrize("name", KINDS)
def test_damaged_files_say_nothing_wrong(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    io.write(path, KINDS[name], notes=io.Metadata(profile=PROFILE, density=(3000.0, 2000.0), primaries=PRIMARIES))
    whole = path.read_bytes()
    random = np.random.default_rng(1)
    for _ in range(60):
        bent = bytearray(whole[: random.integers(1, len(whole))])
        for at in random.integers(0, min(len(bent), 400), 4):
            bent[at] = random.integers(256)
        path.write_bytes(bytes(bent))
        assert io.read_metadata(path).made is None
    path.write_bytes(b"")
    assert io.read_metadata(path) == io.Metadata()
    assert io.read_metadata(tmp_path / "no such file") == io.Metadata()

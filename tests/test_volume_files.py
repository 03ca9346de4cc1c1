"""Volumes for other programs: written so that they and texrs read them back. Damaged files give an error message."""

import base64
import gzip
import re
import struct
import xml.etree.ElementTree as ElementTree
from contextlib import suppress

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import image_files as make
from combinations import pairwise
from texrs import io as tio
from texrs.errors import FileError, InvalidInput, LimitExceeded, TexrsError

nrrd = pytest.importorskip("nrrd")
nibabel = pytest.importorskip("nibabel")

READ = [".nrrd", ".nii", ".nii.gz"]
DTYPES = [f"{kind}int{bits}" for kind in ("u", "") for bits in (8, 16, 32, 64)] + ["float32", "float64"]


@pytest.mark.parametrize(("dtype", "channels", "suffix"), pairwise(DTYPES, [None, 1, 2, 3, 4, 7], READ))
def test_volumes_give_back_what_came(tmp_path, suffix, dtype, channels):
    for sides in ((5, 4, 3), (1, 6, 2), (2, 1, 1)):
        volume = make.picture(sides if channels is None else (*sides, channels), dtype)
        path = tmp_path / f"volume{suffix}"
        tio.write_volume(path, volume)
        back = tio.read_volume(path)
        assert back.dtype == volume.dtype
        assert back.flags.c_contiguous
        assert back.flags.writeable
        assert_array_equal(back, volume[..., 0] if channels == 1 else volume)
    assert [p.name for p in tmp_path.iterdir()] == [f"volume{suffix}"]


@pytest.mark.parametrize("suffix", [*READ, ".vti"])
def test_bool_is_written_as_0_and_255_and_halves_not_at_all(tmp_path, suffix):
    mask = make.picture((3, 4, 5), bool)
    tio.write_volume(tmp_path / f"mask{suffix}", mask)
    assert_array_equal(tio.read_volume(tmp_path / f"mask{suffix}"), mask * np.uint8(255))
    with pytest.raises(
        InvalidInput, match=r"cannot store volumes of float16 with 1 channel; use one of \.npy, \.npz, \.tif"
    ):
        tio.write_volume(tmp_path / f"half{suffix}", mask.astype(np.float16))


def test_other_programs_read_nrrd(tmp_path):
    volume = make.picture((3, 4, 5), "uint16")
    tio.write_volume(tmp_path / "a.nrrd", volume, spacing=(3, 2, 0.5))
    data, header = nrrd.read(str(tmp_path / "a.nrrd"))
    assert_array_equal(data, volume.T)
    assert header["sizes"].tolist() == [5, 4, 3]
    assert header["spacings"].tolist() == [0.5, 2, 3]
    colours = make.picture((3, 4, 5, 3))
    tio.write_volume(tmp_path / "b.nrrd", colours)
    data, header = nrrd.read(str(tmp_path / "b.nrrd"))
    assert header["kinds"][0] == "RGB-color"
    assert_array_equal(data, colours.transpose(3, 2, 1, 0))


@pytest.mark.parametrize("encoding", ["raw", "gzip"])
@pytest.mark.parametrize("endian", ["little", "big"])
def test_nrrd_of_other_programs_is_read(tmp_path, encoding, endian):
    volume = make.picture((6, 4, 5), "int16")
    data = volume.astype(volume.dtype.newbyteorder("<>"[endian == "big"]))
    nrrd.write(str(tmp_path / "a.nrrd"), data.T, {"encoding": encoding, "endian": endian})
    assert_array_equal(tio.read_volume(tmp_path / "a.nrrd"), volume)
    # Write a volume with four axes, whose slowest axis contains the channels.
    four = make.picture((6, 4, 5, 2), "float32")
    header = {"encoding": encoding, "kinds": ["domain", "domain", "domain", "list"]}
    nrrd.write(str(tmp_path / "b.nrrd"), np.moveaxis(four, -1, 0).T, header)
    assert_array_equal(tio.read_volume(tmp_path / "b.nrrd"), four)


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
def test_other_programs_read_nifti(tmp_path, suffix):
    volume = make.picture((3, 4, 5), "int16")
    tio.write_volume(tmp_path / f"a{suffix}", volume, spacing=(3, 2, 0.5))
    image = nibabel.load(tmp_path / f"a{suffix}")
    assert_array_equal(np.asarray(image.dataobj), volume.T)
    assert_allclose(image.header.get_zooms(), (0.5, 2, 3))
    colours = make.picture((3, 4, 5, 3))
    tio.write_volume(tmp_path / f"b{suffix}", colours)
    data = np.asarray(nibabel.load(tmp_path / f"b{suffix}").dataobj)
    assert_array_equal(data["G"], colours[..., 1].T)


@pytest.mark.parametrize("kind", ["Nifti1Image", "Nifti2Image"])
@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
def test_nifti_of_other_programs_is_read(tmp_path, kind, suffix):
    path = tmp_path / f"a{suffix}"
    volume = make.picture((6, 4, 5), "int16")
    nibabel.save(getattr(nibabel, kind)(volume.T, np.eye(4), dtype="int16"), path)
    assert_array_equal(tio.read_volume(path), volume)
    image = getattr(nibabel, kind)(volume.T, np.eye(4), dtype="int16")
    image.header.set_slope_inter(0.5, 3)
    nibabel.save(image, path)
    scaled = np.asarray(nibabel.load(path).dataobj).T
    back = tio.read_volume(path)
    assert back.dtype == np.float32
    assert_allclose(back, scaled, rtol=1e-5)
    series = make.picture((6, 4, 5, 3), "float32")
    nibabel.save(getattr(nibabel, kind)(series.transpose(2, 1, 0, 3), np.eye(4)), path)
    assert_array_equal(tio.read_volume(path), series)


@pytest.mark.parametrize("dtype", ["uint8", "int16", "uint64", "float32"])
@pytest.mark.parametrize("channels", [None, 3])
def test_paraview_files_hold_the_volume(tmp_path, dtype, channels):
    volume = make.picture((3, 4, 5) if channels is None else (3, 4, 5, 3), dtype)
    tio.write_volume(tmp_path / "a.vti", volume, spacing=(3, 2, 0.5))
    root = ElementTree.parse(tmp_path / "a.vti").getroot()
    assert root.attrib["byte_order"] == "LittleEndian"
    image = root.find("ImageData")
    assert image.attrib["WholeExtent"] == "0 4 0 3 0 2"
    assert image.attrib["Spacing"] == "0.5 2.0 3.0"
    array = image.find("Piece/PointData/DataArray")
    assert array.attrib["NumberOfComponents"] == str(channels or 1)
    assert array.attrib["type"].lower() == dtype
    text = root.find("AppendedData").text.strip().removeprefix("_")
    data = base64.b64decode(text)
    assert int.from_bytes(data[:8], "little") == volume.nbytes == len(data) - 8
    assert_array_equal(np.frombuffer(data[8:], dtype).reshape(volume.shape), volume)
    assert_array_equal(tio.read_volume(tmp_path / "a.vti"), volume)
    whole = (tmp_path / "a.vti").read_bytes()
    for bent, words in (
        (whole[:-60], "is cut off"),
        (whole.replace(b"base64", b"raw", 1), "states that its samples have"),
        (whole.replace(b'WholeExtent="0 ', b'WholeExtent="0 9', 1), "cut off|cover the whole extent"),
        (whole[:40], "reading failed"),
    ):
        (tmp_path / "b.vti").write_bytes(bent)
        with pytest.raises(FileError, match=words):
            tio.read_volume(tmp_path / "b.vti")


def test_surfaces(tmp_path):
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    tio.write_surface(tmp_path / "a.stl", corners, faces)
    data = (tmp_path / "a.stl").read_bytes()
    assert len(data) == 84 + 50 * 4
    assert not data.startswith(b"solid")  # A file that begins with "solid" would count as text.
    assert struct.unpack("<I", data[80:84]) == (4,)
    facet = np.frombuffer(data[84:], [("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")])
    assert_array_equal(facet["c"], corners[faces])
    assert_allclose(facet["n"][0], [0, 0, -1])


@pytest.mark.parametrize("suffix", [".npy", ".tif"])
@pytest.mark.parametrize("shape", [(9, 5, 4), (9, 5, 4, 3), (9, 5, 4, 2)])
@pytest.mark.parametrize("dtype", ["uint8", "float32", "bool"])
def test_slabs_make_up_a_volume(tmp_path, suffix, shape, dtype):
    volume = make.picture(shape, dtype)
    tio.write_slabs(tmp_path / f"slabs{suffix}", (volume[a:b] for a, b in ((0, 2), (2, 3), (3, 9))), shape)
    tio.write_volume(tmp_path / f"whole{suffix}", volume)
    slabs, whole = ((tmp_path / f"{name}{suffix}") for name in ("slabs", "whole"))
    assert_array_equal(tio.read_volume(slabs), tio.read_volume(whole))
    assert slabs.read_bytes() == whole.read_bytes()


def test_slabs_need_the_memory_of_one(tmp_path):
    import tracemalloc

    tracemalloc.start()
    tio.write_slabs(tmp_path / "a.npy", (np.full((2, 256, 256), i, np.float32) for i in range(64)), (128, 256, 256))
    assert tracemalloc.get_traced_memory()[1] < 4 * 2**20
    tracemalloc.stop()
    assert tio.read_volume(tmp_path / "a.npy")[-1, 0, 0] == 63


def failing():
    yield np.zeros((2, 4, 4))
    raise RuntimeError("no more")


SLAB = np.zeros((2, 4, 4))


@pytest.mark.parametrize(
    ("slabs", "shape", "name", "error", "says"),
    [
        ([SLAB], (4, 4, 4), "a.npy", InvalidInput, "must have 4 planes, got 2"),
        ([], (4, 4, 4), "a.npy", InvalidInput, "must have 4 planes, got 0"),
        ([SLAB] * 3, (4, 4, 4), "a.npy", InvalidInput, "must end after 4 planes"),
        ([SLAB, SLAB[:, :3]], (4, 4, 4), "a.npy", InvalidInput, r"got float64 of shape \(2, 3, 4\) at plane 2"),
        ([SLAB, SLAB.astype(int)], (4, 4, 4), "a.npy", InvalidInput, "must be float64 of shape \\(d, 4, 4\\)"),
        ([SLAB], (2, 4, 4, 1), "a.npy", InvalidInput, "must be float64"),
        ([SLAB[0]], (2, 4, 4), "a.npy", InvalidInput, "array: must have shape"),
        ([SLAB], (2, 4), "a.npy", InvalidInput, "shape: must be"),
        ([SLAB], (2, 4, -4), "a.npy", InvalidInput, "shape: must be"),
        ([SLAB], "abc", "a.npy", InvalidInput, "shape: must be"),
        ([SLAB.astype(np.int64)], (2, 4, 4), "a.tif", InvalidInput, "cannot store"),
        ([SLAB], (2, 4, 4), "a.vti", FileError, "got '.vti'"),
        (failing(), (4, 4, 4), "a.tif", RuntimeError, "no more"),
    ],
)
def test_slabs_that_do_not_fit_leave_nothing(tmp_path, slabs, shape, name, error, says):
    with pytest.raises(error, match=says):
        tio.write_slabs(tmp_path / name, slabs, shape)
    assert not list(tmp_path.iterdir())


# --- what is refused -------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def valid(tmp_path_factory):
    folder = tmp_path_factory.mktemp("valid")
    made = {}
    for name, volume in {
        "a.nrrd": make.picture((6, 5, 4, 3)),
        "a.nii": make.picture((6, 5, 4), "float32"),
        "b.nii": make.picture((6, 5, 4, 3)),
        "a.nii.gz": make.picture((6, 5, 4), "int16"),
    }.items():
        tio.write_volume(folder / name, volume)
        made[name] = (folder / name).read_bytes()
    nrrd.write(str(folder / "b.nrrd"), make.picture((6, 5, 4), "int16"), {"encoding": "gzip"})
    return made | {"b.nrrd": (folder / "b.nrrd").read_bytes()}


NAMES = ["a.nrrd", "b.nrrd", "a.nii", "b.nii", "a.nii.gz"]


@pytest.mark.parametrize("name", NAMES)
def test_files_that_are_cut_off(valid, name, tmp_path):
    path, file = tmp_path / name, valid[name]
    path.write_bytes(file)
    whole = tio.read_volume(path)
    for length in {*np.linspace(1, len(file) - 1, 80).astype(int).tolist(), len(file) - 1}:
        path.write_bytes(file[:length])
        with suppress(FileError):
            assert_array_equal(tio.read_volume(path), whole, str(length))


@pytest.mark.parametrize("name", NAMES)
def test_corrupt_files(valid, name, tmp_path, capfd):
    rng = np.random.default_rng(NAMES.index(name))
    path, sentences = tmp_path / name, []
    for data in make.mutations(valid[name], 150, rng):
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
    assert (said.out, said.err) == ("", "")


def header(**fields):
    lines = {"type": "uint8", "dimension": 3, "sizes": "2 2 2", "encoding": "raw"} | fields
    text = "".join(f"{k.replace('_', ' ')}: {v}\n" for k, v in lines.items() if v is not None)
    return ("NRRD0004\n" + text + "\n").encode()


def nifti(dims=(3, 2, 2, 2), code=2, bits=8, magic=b"n+1\0", offset=352.0, tail=bytes(8)):
    start = bytearray(352)
    struct.pack_into("<i", start, 0, 348)
    struct.pack_into(f"<{len(dims)}h", start, 40, *dims)
    struct.pack_into("<hh", start, 70, code, bits)
    struct.pack_into("<f", start, 108, offset)
    start[344:348] = magic
    return bytes(start) + tail


@pytest.mark.parametrize(
    ("name", "content", "error", "says"),
    [
        ("a.nrrd", b"NRRD0004\n", FileError, "header does not end"),
        ("a.nrrd", b"NRRD0004\n" + b"#" * 2**17, FileError, "header does not end"),
        ("a.nrrd", header() + bytes(7), FileError, "cut off; its samples need 8 bytes, but only 7 follow"),
        ("a.nrrd", header(data_file="/etc/hostname"), FileError, "has its samples in other files"),
        ("a.nrrd", header(data_file="../b.raw"), FileError, "has its samples in other files"),
        ("a.nrrd", header(encoding="ascii") + b"1 2 3", FileError, "must have the encoding raw or gzip"),
        ("a.nrrd", header(encoding=None) + bytes(8), FileError, "encoding|corrupt"),
        ("a.nrrd", header(type="block") + bytes(8), FileError, "got type 'block'|corrupt"),
        ("a.nrrd", header(sizes="2 2") + bytes(8), FileError, "corrupt|axes"),
        ("a.nrrd", header(sizes="2 0 2") + bytes(8), FileError, "contains no voxels"),
        ("a.nrrd", header(sizes="2 -2 -2") + bytes(8), FileError, "contains no voxels|corrupt"),
        ("a.nrrd", header(sizes="9999 9999 9999"), LimitExceeded, "more than the limit"),
        ("a.nrrd", header(sizes="9999 9999 9999", encoding="gzip"), LimitExceeded, "more than the limit"),
        ("a.nrrd", header(dimension=4, sizes="65 2 2 2") + bytes(520), FileError, "64 channels, got 65"),
        ("a.nrrd", header(dimension=5, sizes="2 2 2 2 2") + bytes(32), FileError, "5 axes"),
        ("a.nrrd", header(byte_skip=-1) + bytes(8), FileError, "skips"),
        ("a.nrrd", header(encoding="gzip") + bytes(8), FileError, "corrupt"),
        (
            "a.nrrd",
            header(encoding="gzip") + gzip.compress(bytes(5), mtime=0),
            FileError,
            "cut off; it contains only 5 of 8 bytes",
        ),
        ("a.nii", nifti(tail=b""), FileError, "cut off"),
        ("a.nii", nifti()[:200], FileError, "cut off"),
        ("a.nii", nifti(magic=b"ni1\0"), FileError, "contains its samples"),
        ("a.nii", nifti(dims=(3, 2, 0, 2)), FileError, "contains no voxels"),
        ("a.nii", nifti(dims=(3, 2, -2, -2)), FileError, "contains no voxels"),
        ("a.nii", nifti(dims=(0, 2, 2, 2)), FileError, "three axes"),
        ("a.nii", nifti(dims=(9, 2, 2, 2)), FileError, "three axes"),
        ("a.nii", nifti(dims=(5, 2, 2, 2, 2, 2)), FileError, "three axes"),
        ("a.nii", nifti(dims=(3, 32767, 32767, 32767)), LimitExceeded, "more than the limit"),
        ("a.nii", nifti(code=32, bits=64), FileError, "complex64"),
        ("a.nii", nifti(code=77), FileError, "corrupt|cannot|failed"),
        ("a.nii", nifti(offset=1e30), FileError, "samples start at byte"),
        ("a.nii", nifti(offset=float("nan")), FileError, "samples start at byte"),
        ("a.nii", nifti(offset=4), FileError, "samples start at byte"),
        ("a.nii.gz", gzip.compress(b"no volume", mtime=0), FileError, "not a NIfTI file"),
        ("a.nii.gz", gzip.compress(nifti(tail=bytes(3)), mtime=0), FileError, "cut off; it contains only 3 of 8 bytes"),
        ("a.nii.gz", gzip.compress(nifti(offset=1e6), mtime=0), FileError, "samples start at byte"),
        ("a.nii.gz", b"\x1f\x8b\x08\0", FileError, "corrupt|cut off|failed"),
    ],
)
def test_hostile_headers_get_a_sentence(tmp_path, name, content, error, says):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(error, match=says) as caught:
        tio.read_volume(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_compressed_zeros_take_no_memory(tmp_path):
    """A megabyte expands to a gigabyte, and the header requests eight bytes."""
    import tracemalloc

    bomb = gzip.compress(bytes(2**28), 9)
    for name, content in (
        ("a.nii.gz", gzip.compress(nifti(tail=bytes(2**28)))),
        ("a.nrrd", header(encoding="gzip") + bomb),
    ):
        (tmp_path / name).write_bytes(content)
        tracemalloc.start()
        assert tio.read_volume(tmp_path / name).shape == (2, 2, 2)
        assert tracemalloc.get_traced_memory()[1] < 2**26
        tracemalloc.stop()


@pytest.mark.parametrize("suffix", [".nrrd", ".nii", ".nii.gz", ".vti"])
def test_pictures_are_not_volumes(tmp_path, suffix):
    with pytest.raises(InvalidInput, match="cannot store uint8 with 3 channels"):
        tio.write(tmp_path / f"a{suffix}", np.zeros((4, 4, 3), np.uint8))
    tio.write_volume(tmp_path / f"a{suffix}", np.zeros((4, 4, 3), np.uint8))
    with pytest.raises(FileError, match=r"contains a volume; read it with texrs\.io\.read_volume"):
        tio.read(tmp_path / f"a{suffix}")


@pytest.mark.parametrize(
    ("make_it", "says"),
    [
        (lambda p: tio.write_volume(p / "a.npy", np.zeros((2, 2, 2)), spacing=(1, 1, 1)), r"cannot be stored in \.npy"),
        (
            lambda p: tio.write_volume(p / "a.tif", np.zeros((2, 2, 2)), spacing=(1, 1, 1)),
            r"\.tif can store it only for uint8",
        ),
        (lambda p: tio.write_volume(p / "a.nrrd", np.zeros((2, 2, 2)), spacing=(1, 1)), "three numbers"),
        (lambda p: tio.write_volume(p / "a.nrrd", np.zeros((2, 2, 2)), spacing=3), "three numbers"),
        (lambda p: tio.write_volume(p / "a.nrrd", np.zeros((2, 2, 2)), spacing=(1, 0, 1)), "spacing: must be a number"),
        (lambda p: tio.write_volume(p / "a.nrrd", np.zeros((2, 2, 2)), spacing="abc"), "spacing"),
        (lambda p: tio.write_volume(p / "a.nii", np.zeros((1, 1, 40_000), np.uint8)), "32767"),
        (lambda p: tio.write_volume(p / "a.nrrd", np.zeros((2, 2, 2, 65))), "65 channels"),
        (lambda p: tio.write_volume(p / "a.gz", np.zeros((2, 2, 2))), "got '.gz'"),
        (lambda p: tio.write_surface(p / "a.obj", np.eye(3), [(0, 1, 2)]), "got '.obj'"),
        (lambda p: tio.write_surface(p / "a.stl", np.eye(3), [(0, 1, 3)]), "indices of vertices from 0 to 2"),
        (lambda p: tio.write_surface(p / "a.stl", np.eye(3), np.zeros((0, 3), int)), "at least one"),
        (lambda p: tio.write_surface(p / "a.stl", np.eye(3) * np.nan, [(0, 1, 2)]), "finite"),
        (lambda p: tio.write_surface(p / "a.stl", np.eye(2), [(0, 1, 2)]), "vertices"),
        (lambda p: tio.write_surface(p / "a.stl", np.eye(3), [(0, 1, 2.0)]), "faces"),
    ],
)
def test_what_cannot_be_written_leaves_nothing(tmp_path, make_it, says):
    with pytest.raises(TexrsError, match=says):
        make_it(tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("library", "suffix"), [("nrrd", ".nrrd"), ("nibabel", ".nii")])
def test_a_missing_extra_is_named(tmp_path, monkeypatch, library, suffix):
    tio.write_volume(tmp_path / f"a{suffix}", np.zeros((2, 2, 2)))
    monkeypatch.setitem(__import__("sys").modules, library, None)
    with pytest.raises(FileError, match=r"not installed \(pip install texrs\[vol\]\)"):
        tio.read_volume(tmp_path / f"a{suffix}")
    with pytest.raises(FileError, match=r"not installed \(pip install texrs\[vol\]\)"):
        tio.write_volume(tmp_path / f"b{suffix}", np.zeros((2, 2, 2)))


def test_nrrd_does_not_say_when_it_was_written(tmp_path):
    """The same volume gives the same bytes at any time."""
    volume = np.arange(24, dtype=np.uint16).reshape(2, 3, 4)
    tio.write_volume(tmp_path / "v.nrrd", volume)
    header = (tmp_path / "v.nrrd").read_bytes().partition(b"\n\n")[0]
    assert header.startswith(b"NRRD0005\n")
    assert not re.search(rb"[0-9]{4}-[0-9]{2}-[0-9]{2}|[0-9]{2}:[0-9]{2}", header)
    assert (tio.read_volume(tmp_path / "v.nrrd") == volume).all()


# --- distances and stores --------------------------------------------------------------------------------------------

APART = (2.5, 0.75, 0.5)


@pytest.mark.parametrize("suffix", [".nrrd", ".nii", ".nii.gz", ".vti", ".zarr"])
@pytest.mark.parametrize("channels", [1, 3])
def test_spacing_comes_back(tmp_path, suffix, channels):
    if suffix == ".zarr":
        pytest.importorskip("zarr")
    volume = np.arange(5 * 6 * 7 * channels, dtype=np.uint8).reshape((5, 6, 7, channels)[: 3 + (channels > 1)])
    tio.write_volume(tmp_path / f"a{suffix}", volume, spacing=APART)
    np.testing.assert_array_equal(tio.read_volume(tmp_path / f"a{suffix}"), volume)
    assert tio.read_spacing(tmp_path / f"a{suffix}") == APART
    with pytest.raises(InvalidInput, match="spacing: cannot be stored in .npy; .*zarr"):
        tio.write_volume(tmp_path / "a.npy", volume, spacing=APART)
    tio.write_volume(tmp_path / "b.npy", volume)
    assert tio.read_spacing(tmp_path / "b.npy") is None


def test_spacing_of_other_programs(tmp_path):
    head = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n"
    turned = "space: left-posterior-superior\nspace directions: (0,3,4) (0.5,0,0) (0,0,2)\n"
    for name, text, wanted in (
        ("a", "", None),
        ("b", "spacings: 0.5 0.25 3\n", (3, 0.25, 0.5)),
        ("c", turned, (2, 0.5, 5)),
        ("d", "spacings: 0.5 nan 3\n", None),
    ):
        (tmp_path / f"{name}.nrrd").write_bytes((head + text + "\n").encode() + bytes(8))
        assert tio.read_spacing(tmp_path / f"{name}.nrrd") == wanted


def test_stores_are_written_whole_and_over_none_but_their_like(tmp_path):
    zarr = pytest.importorskip("zarr")
    volume = np.random.default_rng(0).random((9, 140, 8, 2)).astype(np.float16)
    tio.write_volume(tmp_path / "a.zarr", volume)
    said = zarr.open_group(tmp_path / "a.zarr", mode="r")
    assert [axis["name"] for axis in said.attrs["ome"]["multiscales"][0]["axes"]] == ["c", "z", "y", "x"]
    assert said["0"].chunks == (2, 9, 128, 8)
    with pytest.raises(FileError, match="exists already"):
        tio.write_volume(tmp_path / "a.zarr", volume, overwrite=False)
    tio.write_volume(tmp_path / "a.zarr", volume[:4] > 0.5)
    assert tio.read_volume(tmp_path / "a.zarr").dtype == np.bool_
    tio.write(tmp_path / "p.zarr", volume[0, ..., 0])
    np.testing.assert_array_equal(tio.read(tmp_path / "p.zarr"), volume[0, ..., 0])
    (tmp_path / "mine.zarr").mkdir()
    (tmp_path / "mine.zarr" / "letter.txt").write_text("dear")
    with pytest.raises(FileError, match="is not a Zarr store"):
        tio.write_volume(tmp_path / "mine.zarr", volume)
    with pytest.raises(FileError, match="does not exist"):
        tio.write_volume(tmp_path / "none" / "a.zarr", volume)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.zarr", "mine.zarr", "p.zarr"]

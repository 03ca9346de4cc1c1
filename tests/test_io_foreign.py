"""Volumes and vectors of other programs: Zarr stores, and VTK's image data in every encoding."""

import base64
import lzma
import zlib
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import image_files as make
import texrs
from texrs import fields, io, samples
from texrs.cli import main
from texrs.errors import FileError, InvalidInput, LimitExceeded

zarr = pytest.importorskip("zarr")

VOLUME = make.picture((5, 6, 7), "uint16")
COLOURS = make.picture((5, 6, 7, 3))
FLOW = np.random.default_rng(0).normal(size=(5, 6, 7, 3)).astype(np.float32)


# --- every writer and its reader -------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".tif", ".tiff", ".npy", ".npz", ".nrrd", ".nii", ".nii.gz", ".vti"])
@pytest.mark.parametrize("volume", [VOLUME, COLOURS, FLOW], ids=["grey", "colours", "vectors"])
def test_what_is_written_comes_back(tmp_path: Path, suffix: str, volume: np.ndarray) -> None:
    path = tmp_path / f"a{suffix}"
    io.write_volume(path, volume)
    back = io.read_volume(path)
    assert back.dtype == volume.dtype
    assert_array_equal(back, volume)
    assert_array_equal(io.read_vectors(path)[0], volume)
    assert_array_equal(texrs.volume.slices(str(path)), texrs.volume.slices(volume))


# --- Zarr ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("volume", [VOLUME, COLOURS, FLOW], ids=["grey", "colours", "vectors"])
def test_plain_arrays(tmp_path: Path, version: int, volume: np.ndarray) -> None:
    store = tmp_path / "a.zarr"
    zarr.save_array(store, volume, zarr_format=version)
    assert io.is_store(store)
    assert_array_equal(io.read_volume(store), volume)
    assert_array_equal(io.read_vectors(store)[0], volume)
    zarr.save_group(tmp_path / "b.zarr", volume, zarr_format=version)
    assert_array_equal(io.read_volume(tmp_path / "b.zarr"), volume)


@pytest.mark.parametrize("names", ["zyx", "czyx", "tczyx", "xyz"])
def test_axes_that_have_names(tmp_path: Path, names: str) -> None:
    volume = COLOURS if "c" in names else VOLUME
    there = {"zyx": volume, "xyz": volume.T}.get(names, np.moveaxis(volume, -1, 0))
    there = there[np.newaxis] if "t" in names else there
    array = zarr.create_array(tmp_path / "a.zarr", data=np.ascontiguousarray(there), dimension_names=list(names))
    assert array.shape == there.shape
    assert_array_equal(io.read_volume(tmp_path / "a.zarr"), volume)


@pytest.mark.parametrize("version", ["0.4", "0.5"])
def test_the_finest_level_of_ome_zarr(tmp_path: Path, version: str) -> None:
    group = zarr.create_group(tmp_path / "a.zarr", zarr_format=2 if version == "0.4" else 3)
    moved = np.moveaxis(COLOURS, -1, 0)
    group.create_array("fine", data=moved)
    group.create_array("coarse", data=moved[:, ::2, ::2, ::2])
    axes = [{"name": n, "type": "channel" if n == "c" else "space"} for n in "czyx"]
    said = {"multiscales": [{"axes": axes, "datasets": [{"path": "fine"}, {"path": "coarse"}], "version": version}]}
    group.attrs.update(said if version == "0.4" else {"ome": {"version": version, **said}})
    assert_array_equal(io.read_volume(tmp_path / "a.zarr"), COLOURS)


def test_own_stores(tmp_path: Path) -> None:
    texture = texrs.PlaneTexture(samples.weave((48, 64)).image, seed=1)
    texture.to_zarr(tmp_path / "a.zarr", (64, 80), 32)
    picture = texture[0:64, 0:80]
    assert_array_equal(io.read(tmp_path / "a.zarr"), picture)
    assert io.read(tmp_path / "a.zarr" / "1").shape == (32, 40, 3)
    assert_array_equal(texrs.tile(str(tmp_path / "a.zarr")).image, texrs.tile(picture).image)
    next(p for p in (tmp_path / "a.zarr" / "0").rglob("1") if p.is_file()).unlink()
    with pytest.raises(FileError, match=r"is not finished, 1 of \d+ chunks are missing"):
        io.read(tmp_path / "a.zarr")


def test_a_store_on_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    zarr.save_array(tmp_path / "stripes.zarr", samples.stripes((32, 32, 32)).image)
    io.write_volume(tmp_path / "stripes.npy", samples.stripes((32, 32, 32)).image)
    for kind in ("zarr", "npy"):
        words = ["solid", f"{tmp_path}/stripes.{kind}", "-o", f"{tmp_path}/{kind}.tif", "--size", "24", "-q"]
        assert main(words) == 0
    assert_array_equal(io.read_volume(tmp_path / "zarr.tif"), io.read_volume(tmp_path / "npy.tif"))
    assert main(["slice", f"{tmp_path}/stripes.zarr", "-o", f"{tmp_path}/cut.png", "-q"]) == 0
    assert main(["info", f"{tmp_path}/stripes.zarr"]) == 0
    assert "32 x 32 x 32 x 3 of uint8" in capsys.readouterr().out
    assert main(["rerun", f"{tmp_path}/zarr.tif"]) == 0
    zarr.open_array(tmp_path / "stripes.zarr", mode="r+")[0, 0, 0, 0] ^= 1
    assert main(["rerun", f"{tmp_path}/zarr.tif"]) == 2
    assert "has changed since" in capsys.readouterr().err


def test_stores_that_hold_something_else(tmp_path: Path) -> None:
    group = zarr.create_group(tmp_path / "several.zarr")
    for name in ("albedo", "height"):
        group.create_array(name, data=VOLUME)
    zarr.create_group(tmp_path / "empty.zarr")
    zarr.save_array(tmp_path / "line.zarr", np.zeros(4))
    zarr.save_array(tmp_path / "complex.zarr", np.zeros((4, 4, 4), np.complex64))
    zarr.create_array(tmp_path / "large.zarr", shape=(4096, 4096, 4096), chunks=(64, 64, 64), dtype="u1")
    (tmp_path / "bent.zarr").mkdir()
    (tmp_path / "bent.zarr" / "zarr.json").write_text("{")
    (tmp_path / "folder").mkdir()
    for name, kind, words in (
        ("several", FileError, r"contains several arrays or groups \(albedo, height\); name one, as in .*albedo"),
        ("empty", FileError, "is a Zarr group that contains no arrays"),
        ("line", FileError, "contains an array of 4, which is not a volume"),
        ("complex", FileError, "got complex64"),
        ("large", LimitExceeded, "more than the limit"),
        ("bent", FileError, "reading the store failed"),
    ):
        with pytest.raises(kind, match=words):
            io.read_volume(tmp_path / f"{name}.zarr")
    assert_array_equal(io.read_volume(tmp_path / "several.zarr" / "height"), VOLUME)
    with pytest.raises(FileError, match="got a folder"):
        io.read_volume(tmp_path / "folder")


# --- VTK -------------------------------------------------------------------------------------------------------------


def make_image_data(form: str, packer: str | None, end: str, header: str, cells: bool) -> bytes:
    """Return image data with scalars and vectors, as the VTK library writes it."""
    extent = " ".join(f"0 {n - (not cells)}" for n in VOLUME.shape[::-1])
    appended, arrays = b"", ""
    for name, data in (("density", VOLUME), ("flow", FLOW)):
        swapped = data.astype(data.dtype.newbyteorder("<" if end == "LittleEndian" else ">"))
        size = np.dtype(("<" if end == "LittleEndian" else ">") + ("u8" if header == "UInt64" else "u4"))
        raw = swapped.tobytes()
        if packer is None:
            parts = [np.array([len(raw)], size).tobytes() + raw]
        else:
            pack = zlib.compress if packer == "vtkZLibDataCompressor" else lzma.compress
            blocks = [pack(raw[i : i + 256]) for i in range(0, len(raw), 256)]
            lengths = [len(blocks), 256, len(raw) % 256, *map(len, blocks)]
            parts = [np.array(lengths, size).tobytes(), b"".join(blocks)]
        text = b"".join(map(base64.b64encode, parts))
        body = {"ascii": " ".join(map(str, data.ravel().tolist())), "binary": text.decode()}.get(form, "")
        kind = "UInt16" if name == "density" else "Float32"
        where = f'appended" offset="{len(appended)}' if form.startswith("appended") else form
        appended += text if form == "appended64" else b"".join(parts)
        count = 1 if data.ndim == 3 else 3
        arrays += (
            f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{count}" format="{where}">{body}</DataArray>'
        )
    group = "CellData" if cells else "PointData"
    packed = f' compressor="{packer}"' if packer else ""
    tail = f'<AppendedData encoding="{"base64" if form == "appended64" else "raw"}">_'.encode()
    return (
        (
            f'<VTKFile type="ImageData" version="1.0" byte_order="{end}" header_type="{header}"{packed}>'
            f'<ImageData WholeExtent="{extent}" Origin="0 0 0" Spacing="1 1 1"><Piece Extent="{extent}">'
            f'<{group} Scalars="density" Vectors="flow">{arrays}</{group}></Piece></ImageData>'
        ).encode()
        + (tail + appended + b"</AppendedData>" if form.startswith("appended") else b"")
        + b"</VTKFile>"
    )


@pytest.mark.parametrize("form", ["ascii", "binary", "appended64", "appended"])
@pytest.mark.parametrize("packer", [None, "vtkZLibDataCompressor", "vtkLZMADataCompressor"])
@pytest.mark.parametrize(("end", "header"), [("LittleEndian", "UInt32"), ("BigEndian", "UInt64")])
@pytest.mark.parametrize("cells", [False, True])
def test_image_data(tmp_path: Path, form: str, packer: str | None, end: str, header: str, cells: bool) -> None:
    path = tmp_path / "a.vti"
    path.write_bytes(make_image_data(form, packer, end, header, cells))
    assert_array_equal(io.read_volume(path), VOLUME)
    vectors, spatial = io.read_vectors(path)
    assert spatial
    assert_array_equal(vectors, FLOW)


GOOD = make_image_data("appended", "vtkZLibDataCompressor", "LittleEndian", "UInt32", False)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.vti", GOOD.replace(b"ZLib", b"LZ4", 1), "must be compressed by zlib or LZMA, got vtkLZ4DataCompressor"),
        (
            "a.vti",
            GOOD.replace(b'Scalars="density" Vectors="flow"', b""),
            "must contain a single array, got density, flow",
        ),
        ("a.vti", GOOD.replace(b"UInt16", b"String", 1), "must contain integers or floats, got type 'String'"),
        ("a.vti", GOOD.replace(b"<Piece", b"<Part"), "reading failed|must be image data"),
        ("a.vti", GOOD[:-3000], "reading failed|is cut off"),
        ("a.vti", GOOD.replace(b'<Piece Extent="0 6', b'<Piece Extent="0 9', 1), "is cut off"),
        ("a.vti", GOOD.replace(b'<Piece Extent="0 6', b'<Piece Extent="9 6', 1), "must have at least one voxel"),
        ("a.vti", b'<?xml version="1.0"?><svg/>', "must be image data"),
    ],
)
def test_damaged_grids(tmp_path: Path, name: str, content: bytes, words: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises((FileError, LimitExceeded), match=words):
        io.read_volume(tmp_path / name)


# --- fields ----------------------------------------------------------------------------------------------------------

Z, Y, X = np.mgrid[-6:6, -8:8, -8:8] + 0.5
WOUND = np.stack([0 * Z, X, -Y], axis=-1)
"""Rotation around the axis of planes, as (plane, row, column)."""


@pytest.mark.parametrize("suffix", [".npy", ".npz", ".zarr", ".tif", ".nrrd", ".nii", ".vti", "array", "frames.npy"])
def test_fields_in_files(tmp_path: Path, suffix: str) -> None:
    """A field of vectors is the same from every format. Formats of viewers have components x, y, z."""
    path = tmp_path / f"flow{suffix}"
    wanted = fields.from_directions(WOUND.astype(np.float32))
    there = WOUND.astype(np.float32)
    if suffix in (".nrrd", ".nii", ".vti"):
        there = np.ascontiguousarray(there[..., ::-1])
    if suffix == "array":
        assert fields.as_field(WOUND, 3) == fields.from_directions(WOUND)
        return
    if suffix == ".zarr":
        zarr.save_array(path, there)
    elif suffix == "frames.npy":
        np.save(path, wanted.lattice(Z.shape, jacobians=False))
        wanted = fields.from_array(np.load(path))
    else:
        io.write_volume(path, there)
    assert fields.read(path) == wanted
    assert fields.as_field(str(path), 3) == wanted
    options = ":order=xyz" if suffix in (".npy", ".npz", ".zarr", ".tif") else ":order=zyx"
    if suffix != "frames.npy":
        assert fields.as_field(f"{path}{options}", 3) == fields.from_directions(there, order=options[-3:])


def test_verbs_take_fields_as_people_have_them(tmp_path: Path) -> None:
    stripes = samples.stripes((32, 32, 32)).image
    wanted = texrs.solid(stripes, (12, 16, 16), field=fields.from_directions(WOUND), seed=1).image
    assert_array_equal(texrs.solid(stripes, (12, 16, 16), field=WOUND, seed=1).image, wanted)
    np.save(tmp_path / "flow.npy", WOUND)
    assert_array_equal(texrs.solid(stripes, (12, 16, 16), field=tmp_path / "flow.npy", seed=1).image, wanted)
    io.write_volume(tmp_path / "in.npy", stripes)
    words = ["solid", f"{tmp_path}/in.npy", "-o", f"{tmp_path}/out.npy", "--size", "16x16x12", "--seed", "1", "-q"]
    assert main([*words, "--field", f"{tmp_path}/flow.npy"]) == 0
    assert_array_equal(io.read_volume(tmp_path / "out.npy"), wanted)
    assert texrs.SolidTexture(stripes, field="circular:axis=z").field == fields.circular(axis="z")
    weave = samples.weave((48, 64)).image
    flat = np.stack([X[0], -Y[0]], axis=-1)
    assert_array_equal(
        texrs.synthesize(weave, 32, field=flat, seed=1).image,
        texrs.synthesize(weave, 32, field=fields.from_directions(flat, (32, 32)), seed=1).image,
    )


def test_a_plane_of_vectors_in_space(tmp_path: Path) -> None:
    """ParaView stores vectors of images as one plane with three components."""
    flat = np.stack([0 * X[0], X[0], -Y[0]], axis=-1)
    io.write_volume(tmp_path / "flow.vti", np.ascontiguousarray(flat[np.newaxis, ..., ::-1]))
    assert fields.read(tmp_path / "flow.vti", axes=2) == fields.from_directions(flat[..., 1:])


@pytest.mark.parametrize(
    ("value", "axes", "words"),
    [
        (np.ones((4, 4, 2)), 3, r"field: must have 3 axes, got shape \(4, 4, 2\), a field with 2 axes"),
        (np.zeros((4, 4, 4, 3)), 3, "directions: must not all have length 0"),
        ("nowhere.npy", 3, "does not exist"),
        ("flow.npy:around=z", 3, "options of a file must be one of along=, order=, up=, signed="),
        ("flow.npy:up=1x", 3, "up= must be three numbers"),
        ("flow.npy:signed=1", 3, "signed= must be yes or no"),
        ("flow.npy:along=w", 3, "along: must be one of z, y, x"),
        ("cubes.npy", 3, "cubes.npy: must be directions"),
    ],
)
def test_what_is_no_field(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, value: object, axes: int, words: str
) -> None:
    np.save(tmp_path / "flow.npy", WOUND)
    np.save(tmp_path / "cubes.npy", np.zeros((4, 4, 4)))
    monkeypatch.chdir(tmp_path)
    with pytest.raises((InvalidInput, FileError), match=words):
        fields.as_field(value, axes)

"""Volumes from users: folders of slices, stacks of ImageJ, samples without a header, oriented scans."""

from pathlib import Path

import nibabel
import numpy as np
import pytest
import tifffile

import texrs
from texrs import io as tio
from texrs._notices import collect
from texrs.cli import main
from texrs.errors import FileError, InputWarning, InvalidInput


def write_slices(folder, volume, suffix=".png", start=1):
    folder.mkdir()
    for number, plane in enumerate(volume, start=start):
        tio.write(folder / f"scan_{number}{suffix}", plane)


@pytest.mark.parametrize("suffix", [".png", ".tif"])
def test_slices_are_read_in_the_order_of_their_numbers(tmp_path, suffix):
    volume = np.random.default_rng(0).integers(0, 255, (12, 18, 20, 3), np.uint8)
    write_slices(tmp_path / "scan", volume, suffix)
    np.testing.assert_array_equal(tio.read_volume(tmp_path / "scan"), volume)
    assert tio.read_spacing(tmp_path / "scan") is None
    with pytest.raises(FileError, match="is a slices file, which contains a volume"):
        tio.read(tmp_path / "scan")


def test_missing_and_unlike_slices_are_named(tmp_path):
    volume = np.random.default_rng(0).integers(0, 255, (48, 18, 20), np.uint8)
    scan = tmp_path / "scan"
    write_slices(scan, volume)
    (scan / "scan_17.png").unlink()
    (scan / "scan_30.png").unlink()
    with pytest.raises(FileError, match=r"scan: scan_17.png, scan_30.png are missing; slices 1 to 48 are needed"):
        tio.read_volume(scan)
    tio.write(scan / "scan_17.png", volume[16])
    tio.write(scan / "scan_30.png", volume[29, :, :10])
    with pytest.raises(FileError, match=r"scan_30.png: must have the shape of scan_1.png, \(18, 20\); got \(18, 10\)"):
        tio.read_volume(scan)
    tio.write(scan / "scan_30.png", volume[29].astype(np.uint16))
    with pytest.raises(FileError, match=r"scan_30.png: must have the dtype of scan_1.png, uint8; got uint16"):
        tio.read_volume(scan)
    tio.write(scan / "scan_30.png", volume[29])
    (scan / "notes.txt").write_text("of 2026")
    with pytest.warns(InputWarning, match=r"scan: notes.txt not used, because only scan_N.png are slices"):
        np.testing.assert_array_equal(tio.read_volume(scan), volume)
    tio.write(scan / "label_1.png", volume[0])
    tio.write(scan / "label_2.png", volume[0])
    with pytest.raises(FileError, match=r"must contain one series of numbered slices, got label_N.png and scan_N.png"):
        tio.read_volume(scan)
    tio.write(scan / "scan_017.png", volume[0])
    with pytest.raises(FileError, match="scan_017.png and scan_17.png have the same number"):
        tio.read_volume(scan)


def test_missing_slices_are_named_with_their_zeros(tmp_path):
    scan = tmp_path / "scan"
    scan.mkdir()
    for number in (8, 9, 11):
        tio.write(scan / f"a{number:03d}.png", np.zeros((4, 4), np.uint8))
    with pytest.raises(FileError, match=r"scan: a010.png is missing"):
        tio.read_volume(scan)


def test_imagej_states_the_spacing(tmp_path):
    volume = np.random.default_rng(0).integers(0, 255, (6, 7, 8), np.uint16)
    said = {"spacing": 1.6, "unit": "um", "axes": "ZYX"}
    tifffile.imwrite(tmp_path / "a.tif", volume, imagej=True, resolution=(1 / 0.5, 1 / 0.25), metadata=said)
    assert tio.read_spacing(tmp_path / "a.tif") == (1.6, 0.25, 0.5)
    tio.write_volume(tmp_path / "b.tif", volume, like=tmp_path / "a.tif")
    np.testing.assert_array_equal(tio.read_volume(tmp_path / "b.tif"), volume)
    assert tio.read_spacing(tmp_path / "b.tif") == (1.6, 0.25, 0.5)
    with tifffile.TiffFile(tmp_path / "b.tif") as tif:
        assert tif.imagej_metadata["unit"] == "um"
        assert tif.series[0].axes == "ZYX"
    coloured = np.zeros((6, 7, 8, 3), np.uint8)
    tio.write_volume(tmp_path / "c.tif", coloured, spacing=(3, 2, 1))
    assert tio.read_volume(tmp_path / "c.tif").shape == coloured.shape
    assert tio.read_spacing(tmp_path / "c.tif") == (3, 2, 1)
    # The first stack states nothing. The second one has several planes, but states no distance between them.
    tio.write_volume(tmp_path / "d.tif", volume)
    assert tio.read_spacing(tmp_path / "d.tif") is None
    tifffile.imwrite(tmp_path / "e.tif", volume, resolution=(72, 72))
    assert tio.read_spacing(tmp_path / "e.tif") is None


@pytest.mark.parametrize("dtype", ["uint8", "int16", "uint16", ">u2", "float32", ">f8"])
def test_samples_without_a_header(tmp_path, dtype):
    volume = np.arange(6 * 7 * 8).reshape(6, 7, 8).astype(dtype)
    volume.tofile(tmp_path / "scan.raw")
    np.testing.assert_array_equal(tio.read_volume(tmp_path / "scan.raw", shape=(6, 7, 8), dtype=dtype), volume)
    words = volume.dtype.name + (":big" if dtype.startswith(">") else "")
    np.testing.assert_array_equal(tio.read_volume(f"{tmp_path}/scan.raw:8x7x6:{words}"), volume)
    # A fourth number is the number of channels.
    assert tio.read_volume(f"{tmp_path}/scan.raw:4x7x6x2:{words}").shape == (6, 7, 4, 2)


def test_samples_without_a_header_need_what_they_are(tmp_path):
    np.zeros(96**3, np.uint8).tofile(tmp_path / "scan.raw")
    scan = tmp_path / "scan.raw"
    with pytest.raises(FileError, match=r"scan.raw: has no header; add .* as in .*scan.raw:96x96x96:uint8"):
        tio.read_volume(scan)
    with pytest.raises(FileError, match=r"96 x 96 x 96 samples of uint16 need 1769472 bytes, but the file has 884736"):
        tio.read_volume(f"{scan}:96x96x96:uint16")
    with pytest.raises(
        FileError, match=r"the type of the samples must follow the size, as in .*scan.raw:96x96x96:uint16"
    ):
        tio.read_volume(f"{scan}:96x96x96")
    for options, says in (
        ({"shape": (96, 96, 96)}, "dtype: must be given together with shape"),
        ({"dtype": "uint8"}, "shape: must be given together with dtype"),
        ({"shape": (96, 96), "dtype": "uint8"}, "shape: "),
        ({"shape": (96, 96, 0), "dtype": "uint8"}, "shape: "),
        ({"shape": (96, 96, 96), "dtype": "rgb"}, "dtype: must be one of uint8"),
        ({"shape": (96, 96, 96), "dtype": complex}, "dtype: must be one of uint8"),
    ):
        with pytest.raises(InvalidInput, match=says):
            tio.read_volume(scan, **options)
    with pytest.raises(FileError, match="does not exist"):
        tio.read_volume(tmp_path / "other.raw", shape=(1, 1, 1), dtype="uint8")


def test_orientation_origin_and_units_of_nifti_go_through(tmp_path):
    nibabel = pytest.importorskip("nibabel")
    volume = np.random.default_rng(0).integers(0, 255, (20, 24, 28), np.uint8)
    affine = np.array([[0, -0.7, 0, 10], [0.7, 0, 0, -20], [0, 0, 1.6, 30], [0, 0, 0, 1]])
    for kind in (nibabel.Nifti1Image, nibabel.Nifti2Image):
        image = kind(volume.T, affine)
        image.set_sform(affine, code=2)
        image.set_qform(affine, code=1)
        image.header.set_xyzt_units("mm", "sec")
        nibabel.save(image, tmp_path / "a.nii.gz")
        for name in ("b.nii", "b.nii.gz"):
            tio.write_volume(tmp_path / name, volume[:10, :12, :14].astype(np.float32), like=tmp_path / "a.nii.gz")
            made = nibabel.load(tmp_path / name)
            assert type(made) is kind
            np.testing.assert_allclose(made.affine, affine, atol=1e-6)
            np.testing.assert_allclose(made.get_qform(), affine, atol=1e-5)
            assert (int(made.header["sform_code"]), int(made.header["qform_code"])) == (2, 1)
            assert made.header.get_xyzt_units() == ("mm", "sec")
            np.testing.assert_array_equal(np.asarray(made.dataobj).T, volume[:10, :12, :14])
            np.testing.assert_array_equal(tio.read_volume(tmp_path / name), volume[:10, :12, :14])
    # A given spacing replaces the lengths of the axes, and keeps their directions.
    tio.write_volume(tmp_path / "c.nii", volume, spacing=(3.2, 0.7, 0.7), like=tmp_path / "a.nii.gz")
    np.testing.assert_allclose(nibabel.load(tmp_path / "c.nii").affine[:3, 2], (0, 0, 3.2), atol=1e-6)
    # A file of another format keeps the spacing.
    tio.write_volume(tmp_path / "c.nrrd", volume, like=tmp_path / "a.nii.gz")
    np.testing.assert_allclose(tio.read_spacing(tmp_path / "c.nrrd"), (1.6, 0.7, 0.7), rtol=1e-6)


@pytest.mark.parametrize("channels", [0, 3])
def test_orientation_origin_and_units_of_nrrd_go_through(tmp_path, channels):
    nrrd = pytest.importorskip("nrrd")
    volume = np.random.default_rng(0).integers(0, 255, (20, 24, 28), np.uint8)
    directions = [[0, 0.7, 0], [-0.7, 0, 0], [0, 0, 1.6]]
    header = {
        "space": "left-posterior-superior",
        "space directions": directions,
        "space origin": [1, 2, 3],
        "space units": ["mm", "mm", "mm"],
    }
    nrrd.write(str(tmp_path / "a.nrrd"), volume.T, header)
    made = np.stack([volume] * channels, axis=-1) if channels else volume
    tio.write_volume(tmp_path / "b.nrrd", made, like=tmp_path / "a.nrrd")
    found = nrrd.read_header(str(tmp_path / "b.nrrd"))
    assert found["space"] == "left-posterior-superior"
    assert found["space units"] == ["mm", "mm", "mm"]
    np.testing.assert_allclose(found["space origin"], [1, 2, 3])
    rows = [row for row in found["space directions"] if row is not None and np.isfinite(row).all()]
    np.testing.assert_allclose(rows, directions)
    np.testing.assert_array_equal(tio.read_volume(tmp_path / "b.nrrd"), made)
    assert tio.read_spacing(tmp_path / "b.nrrd") == (1.6, 0.7, 0.7)


def test_commands_read_folders_and_headerless_samples(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    volume = np.random.default_rng(0).integers(0, 255, (20, 24, 28), np.uint8)
    write_slices(tmp_path / "scan", volume)
    volume.astype(">u2").tofile("scan.raw")
    for name in ("scan", "scan.raw:28x24x20:uint16:big"):
        assert main(["slice", name, "-o", "a.png", "--at", "plane=3", "--force", "-q"]) == 0, capsys.readouterr().err
        np.testing.assert_array_equal(tio.read("a.png"), volume[3])
        assert main(["solid", name, "-o", "a.tif", "--size", "20", "--quality", "fast", "--force", "-q"]) == 0
        assert tio.read_volume("a.tif").shape == (20, 20, 20)
    assert main(["solid", "scan.raw:28x24x20:uint16:big", "-o", "scan.raw", "--size", "20", "-q"]) == 2
    assert "scan.raw is an input" in capsys.readouterr().err
    # Data that a format cannot state are reported.
    tio.write_volume("b.nrrd", volume, spacing=(2, 1, 1))
    assert main(["solid", "b.nrrd", "-o", "b.npy", "--size", "20", "--quality", "fast"]) == 0
    assert "b.nrrd: the spacing is not kept, because .npy of uint8 cannot store it" in capsys.readouterr().err
    assert main(["solid", "b.nrrd", "-o", "c.npy", "--size", "20", "--quality", "fast", "--strict", "-q"]) == 2
    assert not Path("c.npy").exists()


def test_phases_stay_as_they_are():
    phases = (
        (np.random.default_rng(1).integers(0, 3, (8, 8, 8)) * 100)
        .astype(np.uint8)
        .repeat(4, 0)
        .repeat(4, 1)
        .repeat(4, 2)
    )
    for options in ({}, {"field": "rotation:angle=30"}, {"quality": "fast"}, {"interpolation": "cubic"}):
        made = texrs.solid(phases, 36, **options).image
        assert set(np.unique(made)) <= set(np.unique(phases))
    assert set(np.unique(texrs.SolidTexture(phases, field="rotation:angle=30")[0:20, 0:20, 0:20])) <= set(
        np.unique(phases)
    )


def test_info_describes_volumes(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    volume = np.random.default_rng(0).integers(0, 255, (20, 24, 28), np.uint8)
    write_slices(tmp_path / "scan", volume)
    volume.tofile("scan.raw")
    tio.write_volume("scan.nrrd", volume, spacing=(2, 1, 0.5))
    first = "volume: 28 x 24 x 20, 1 channel, uint8, 0 to 254"
    for name, after in (("scan", ""), ("scan.raw:28x24x20:uint8", ""), ("scan.nrrd", ", voxels of 0.5 x 1 x 2")):
        assert main(["info", name]) == 0, capsys.readouterr().err
        assert capsys.readouterr().out.splitlines()[0] == first + after
    Path("scan/scan_3.png").unlink()
    assert main(["info", "scan"]) == 2
    assert "scan: scan_3.png is missing" in capsys.readouterr().err


def test_ome_states_channels_spacing_and_time(tmp_path: Path) -> None:
    """Channels of OME-TIFF files are not planes, whichever comes first, and points in time are reported."""
    volume = np.random.default_rng(4).integers(0, 255, (6, 2, 9, 11), np.uint8)
    sizes = {"PhysicalSizeX": 0.5, "PhysicalSizeY": 0.5, "PhysicalSizeZ": 1.5}
    tifffile.imwrite(tmp_path / "a.ome.tif", volume, metadata={"axes": "ZCYX", **sizes})
    tifffile.imwrite(tmp_path / "b.ome.tif", np.moveaxis(volume, 1, 0), metadata={"axes": "CZYX"})
    tifffile.imwrite(tmp_path / "c.ome.tif", volume[:, 0], metadata={"axes": "TYX"})
    for name in "ab":
        assert (tio.read_volume(tmp_path / f"{name}.ome.tif") == np.moveaxis(volume, 1, -1)).all()
    assert tio.read_spacing(tmp_path / "a.ome.tif") == (1.5, 0.5, 0.5)
    assert tio.read_spacing(tmp_path / "b.ome.tif") is None
    with collect() as notices:
        assert (tio.read_volume(tmp_path / "c.ome.tif") == volume[:, 0]).all()
    assert notices.assumed == [f"{tmp_path / 'c.ome.tif'}: its 6 points in time are read as planes"]
    tifffile.imwrite(tmp_path / "d.ome.tif", volume[0], metadata={"axes": "CYX"})
    assert (tio.read(tmp_path / "d.ome.tif") == np.moveaxis(volume[0], 0, -1)).all()


def test_an_orientation_that_a_format_does_not_take_over_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    image = nibabel.Nifti1Image(
        np.random.default_rng(1).integers(0, 255, (16, 16, 16), np.uint8), np.diag([0.7, 0.7, 1.6, 1])
    )
    nibabel.save(image, tmp_path / "a.nii.gz")
    for name in ("o.nrrd", "o.nii", "o.tif"):
        given = [
            "solid",
            str(tmp_path / "a.nii.gz"),
            "--size",
            "16x16x16",
            "--quality",
            "fast",
            "-o",
            str(tmp_path / name),
        ]
        assert main(given) == 0
        lost = "its orientation, origin and unit are not kept" in capsys.readouterr().err
        assert lost is (name != "o.nii")
        np.testing.assert_allclose(tio.read_spacing(tmp_path / name) or 0, (1.6, 0.7, 0.7), rtol=1e-6)


def test_calls_use_the_spacing_that_a_file_states(tmp_path):
    """A field, statistics and comparisons use it, as the command line does; a derived array has none."""
    path, steps = tmp_path / "balls.nrrd", (1.6, 0.7, 0.7)
    tio.write_volume(path, texrs.samples.particles((32, 32, 32)).image, spacing=steps)
    volume = tio.read_volume(path)
    phase = tmp_path / "phase.nrrd"
    tio.write_volume(phase, np.asarray(volume[..., 0] > 128, np.uint8), spacing=steps)
    mask = tio.read_volume(phase)
    counted = [texrs.volume.component_statistics(m).mean for m in (mask, mask.copy())]
    assert counted[0] == pytest.approx(counted[1] * np.prod(steps))
    for measure in (
        texrs.volume.two_point_correlation,
        texrs.volume.lineal_path_function,
        texrs.volume.autocorrelation,
    ):
        np.testing.assert_array_equal(measure(mask, 6), measure(mask.copy(), 6, spacing=steps))
    text = texrs.volume.compare(volume, volume.copy()).text
    assert text == texrs.volume.compare(volume.copy(), volume.copy(), spacing=steps).text
    turned = texrs.fields.rotation(30, "yz")
    made = texrs.solid(volume, 16, field=turned, quality="fast")
    assert made.report["spacing"] == list(steps)
    told = texrs.solid(np.array(volume), 16, field=turned, quality="fast", spacing=steps)
    np.testing.assert_array_equal(made.image, told.image)
    assert texrs.SolidTexture(volume, quality="fast").spacing == steps
    assert texrs.solid(np.array(volume), 16, quality="fast").report.get("spacing") is None

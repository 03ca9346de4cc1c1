"""Volumes with voxels that are not cubes: fields, statistics and images are in units of space."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import texrs
from texrs import fields, io, volume
from texrs.cli import main
from texrs.errors import InvalidInput

SPACING = (1.6, 0.7, 0.7)
"""Millimetres between planes, rows and columns."""
SEMI = (3.2, 2.1, 2.1)
"""Semi-axes of the ellipsoids, in millimetres."""


def make_ellipsoids(shape: tuple[int, int, int] = (28, 48, 48), count: int = 40) -> np.ndarray:
    """Return a periodic volume with separate ellipsoids."""
    rng = np.random.default_rng(0)
    step, semi = np.array(SPACING), np.array(SEMI)
    extent = np.array(shape) * step
    centres: list[np.ndarray] = []
    while len(centres) < count:
        centre = rng.random(3) * extent
        away = [(centre - other + extent / 2) % extent - extent / 2 for other in centres]
        if all(((a / (2.25 * semi)) ** 2).sum() > 1 for a in away):
            centres.append(centre)
    at = np.moveaxis(np.indices(shape), 0, -1) * step
    out = np.zeros(shape, np.uint8)
    for centre in centres:
        away = (at - centre + extent / 2) % extent - extent / 2
        out[((away / semi) ** 2).sum(axis=-1) <= 1] = 200
    return out


ELLIPSOIDS = make_ellipsoids()


def measure(image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the median semi-axes of the pieces in millimetres, and the median direction of the longest axis."""
    from scipy import ndimage

    labels, _ = ndimage.label(image > 100)
    step, axes, directions = np.array(SPACING), [], []
    for number, box in enumerate(ndimage.find_objects(labels), start=1):
        at = np.argwhere(labels[box] == number) * step
        if len(at) < 12 or any(s.start == 0 or s.stop == n for s, n in zip(box, image.shape, strict=True)):
            continue
        # Add the variance of a voxel, because voxels have an extent.
        values, vectors = np.linalg.eigh(np.cov(at.T) + np.diag(step**2 / 12))
        axes.append(np.sqrt(5 * values))
        longest = vectors[:, -1]
        directions.append(longest * np.sign(longest[np.abs(longest).argmax()]))
    assert len(axes) > 15
    return np.median(axes, axis=0), np.median(directions, axis=0)


# --- fields ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("angle", "wanted"), [(90, (0, 0, 1)), (45, (0.71, 0, -0.71))])
def test_ellipsoids_keep_their_axes_in_millimetres(angle: int, wanted: tuple[float, ...]) -> None:
    before, _ = measure(ELLIPSOIDS)
    field = fields.rotation(angle, "xz")
    turned = texrs.solid(ELLIPSOIDS, (30, 56, 56), field=field, spacing=SPACING)
    after, direction = measure(turned.image)
    np.testing.assert_allclose(after, before, rtol=0.1)
    np.testing.assert_allclose(np.abs(direction), np.abs(wanted), atol=0.15)
    assert turned.report["spacing"] == list(SPACING)
    # Without a spacing, the rotated longest axis keeps its number of voxels, so it is longer in millimetres.
    stretched, _ = measure(texrs.solid(ELLIPSOIDS, (30, 56, 56), field=field).image)
    assert stretched[2] > 1.25 * before[2]
    # Phases keep their values.
    assert set(np.unique(turned.image)) <= set(np.unique(ELLIPSOIDS))


def test_the_command_reads_the_spacing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source, out = str(tmp_path / "scan.nrrd"), str(tmp_path / "turned.nrrd")
    io.write_volume(source, ELLIPSOIDS, spacing=SPACING)
    arguments = ["--size", "56x56x30", "--field", "rotation:angle=90,plane=xz", "-q"]
    assert main(["solid", source, "-o", out, *arguments]) == 0, capsys.readouterr().err
    wanted = texrs.solid(ELLIPSOIDS, (30, 56, 56), field="rotation:angle=90,plane=xz", spacing=SPACING)
    np.testing.assert_array_equal(io.read_volume(out), wanted.image)
    assert io.read_spacing(out) == SPACING
    # The command line overrides the spacing in the file.
    assert main(["solid", source, "-o", out, *arguments, "--spacing", "1"]) == 0
    plain = texrs.solid(ELLIPSOIDS, (30, 56, 56), field="rotation:angle=90,plane=xz")
    np.testing.assert_array_equal(io.read_volume(out), plain.image)
    assert io.read_spacing(out) == (1, 1, 1)
    for wrong in ("1x2", "wide", "0x1x1", "1x1x-1"):
        assert main(["solid", source, "-o", out, *arguments, "--spacing", wrong]) == 2
        assert "--spacing" in capsys.readouterr().err.splitlines()[-1]


def test_textures_without_borders_turn_in_space(tmp_path: Path) -> None:
    texture = texrs.SolidTexture(ELLIPSOIDS, field="rotation:angle=90,plane=xz", spacing=SPACING)
    after, direction = measure(texture[0:30, 0:56, 0:56])
    np.testing.assert_allclose(after, measure(ELLIPSOIDS)[0], rtol=0.1)
    assert abs(direction[2]) > 0.9
    assert texture.spacing == SPACING
    assert texture.key != texrs.SolidTexture(ELLIPSOIDS, field="rotation:angle=90,plane=xz").key
    source, out = tmp_path / "scan.nrrd", tmp_path / "part.nrrd"
    io.write_volume(source, ELLIPSOIDS, spacing=SPACING)
    words = ["--size", "56x56x30", "--origin", "0,0,0", "--field", "rotation:angle=90,plane=xz", "-q"]
    assert main(["solid", str(source), "-o", str(out), *words]) == 0
    np.testing.assert_array_equal(io.read_volume(out), texture[0:30, 0:56, 0:56])


@pytest.mark.parametrize(
    "field",
    [fields.rotation(30, "xz"), fields.circular("y"), fields.zigzag(9, axis="z"), fields.scale_ramp(1, 2, axis="z")],
)
def test_frames_are_those_of_space(field: fields.Field) -> None:
    spaced = fields.as_field(field, 3, spacing=SPACING)
    assert spaced is not None
    step = np.array(SPACING)
    points = np.random.default_rng(1).uniform(0, 30, (50, 3))
    wanted = field.frames(points * step).astype(float) * step / step[:, np.newaxis]
    np.testing.assert_allclose(spaced.frames(points), wanted, rtol=1e-5, atol=1e-6)
    # A field with a spacing keeps it, and cubes of side 1 do not change anything.
    assert fields.as_field(spaced, 3, spacing=(1, 2, 3)) is spaced
    assert fields.as_field(field, 3, spacing=(1, 1, 1)) is field


def test_the_middle_and_the_length_are_those_of_the_output_in_space() -> None:
    wound = fields.as_field("circular:axis=y", 3, (11, 21, 31), spacing=SPACING)
    assert "about (8, 7, 10.5)" in str(wound)
    ramp = fields.as_field("scale_ramp:axis=z", 3, (11, 21, 31), spacing=SPACING)
    assert "along z over 16" in str(ramp)
    # The default of an omitted length is a multiple of the smallest voxel side.
    assert "period 22.4 along x" in str(fields.as_field("zigzag", 3, (11, 21, 31), spacing=SPACING))
    assert "period 0.02" in str(fields.as_field("zigzag:period=0.02", 3, spacing=(0.005, 0.005, 0.005)))
    with pytest.raises(InvalidInput, match=r"period: must be at least 1.4 \(2 voxels\), got 1"):
        fields.as_field("zigzag:period=1", 3, spacing=SPACING)
    with pytest.raises(InvalidInput, match=r"period: must be at least 2 \(2 voxels\), got 1"):
        fields.as_field("zigzag:period=1", 3)


def test_arrays_spread_over_voxels_and_turn_in_space() -> None:
    frames = np.broadcast_to(fields.rotation(90, "yz").constant, (4, 4, 4, 3, 3))
    spaced = fields.as_field(frames, 3, (8, 8, 8), spacing=(2, 1, 1))
    np.testing.assert_allclose(spaced.frames((1, 6, 3)), [[0, 0.5, 0], [-2, 0, 0], [0, 0, 1]], atol=1e-6)


def test_constraints_lie_at_places_in_space(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source, out = str(tmp_path / "scan.nrrd"), str(tmp_path / "out.nrrd")
    io.write_volume(source, ELLIPSOIDS, spacing=SPACING)
    # Use a mask and values with voxels of another size, cubes of 1.4 mm.
    near = np.zeros((16, 12, 12), np.uint8)
    near[4:8, 3:6, 2:9] = 255
    for name, volume_ in (("mask", near), ("values", np.where(near, 200, 0).astype(np.uint8))):
        io.write_volume(tmp_path / f"{name}.nrrd", volume_, spacing=(1.4, 1.4, 1.4))
    words = f"--size 24x24x14 --constraint-mask {tmp_path}/mask.nrrd --constraint-values {tmp_path}/values.nrrd".split()
    assert main(["solid", source, "-o", out, *words, "--quality", "fast"]) == 0, capsys.readouterr().err
    made = io.read_volume(out)
    planes = ((np.arange(14) + 0.5) * 1.6 / 1.4).astype(int)
    inside = (planes >= 4) & (planes < 8)
    assert (made[inside][:, 6:12, 4:18] == 200).all()
    assert "mask.nrrd: resampled by its spacing" in capsys.readouterr().err
    io.write_volume(tmp_path / "mask.nrrd", near[:8], spacing=(1.4, 1.4, 1.4))
    assert main(["solid", source, "-o", out, *words, "--quality", "fast"]) == 2
    assert (
        "mask.nrrd: must have the extent of the result, 16.8 x 16.8 x 22.4, got 16.8 x 16.8 x 11.2"
        in capsys.readouterr().err
    )


# --- statistics ------------------------------------------------------------------------------------------------------


def test_statistics_are_those_of_space() -> None:
    # Use layers 8 mm apart, sampled every 2 mm along planes and every 1 mm along rows.
    z, y, x = np.meshgrid(np.arange(40) * 2.0, np.arange(64) * 1.0, np.arange(24) * 1.0, indexing="ij")
    along = ((z // 4) % 2 == 0) | (x < 0)
    across = ((y // 4) % 2 == 0) | (x < 0)
    first = volume.two_point_correlation(along, 16, spacing=(2, 1, 1))[0]
    second = volume.two_point_correlation(across, 16, spacing=(2, 1, 1))[1]
    np.testing.assert_allclose(first[::2], second[::2], atol=0.05)
    np.testing.assert_allclose(
        volume.lineal_path_function(along, 8, spacing=(2, 1, 1))[0, [0, 2, 4]], [0.5, 0.25, 0], atol=0.03
    )
    waves = np.sin(2 * np.pi * z / 16)
    assert volume.autocorrelation(waves, 16, spacing=(2, 1, 1))[0, [8, 16]].round(2).tolist() == [-1, 1]
    pieces = volume.component_statistics(ELLIPSOIDS > 0, spacing=SPACING)
    assert pieces.median == pytest.approx(4 / 3 * np.pi * np.prod(SEMI), rel=0.1)
    # Use layers that are oblique in space.
    layers = np.sin((z + y) * np.pi / 6)
    normal = volume.texture_normal(layers, spacing=(2, 1, 1))
    np.testing.assert_allclose(normal, np.array([1, 1, 0]) / 2**0.5, atol=0.1)
    flat = np.sin(z * np.pi / 6)
    turned = np.sin((z * np.cos(np.pi / 6) + y * np.sin(np.pi / 6)) * np.pi / 6)
    angles = [
        np.median(volume.orientation_errors(turned, fields.rotation(a, "zy"), (1, 0, 0), spacing=(2, 1, 1)))
        for a in (30, 0)
    ]
    assert angles[0] < 8
    assert 22 < angles[1] < 38
    report = volume.compare(
        np.float32(flat / 2 + 0.5), np.float32(turned / 2 + 0.5), field=fields.rotation(30, "zy"), spacing=(2, 1, 1)
    )
    assert report.orientation is not None
    assert report.orientation[1, 0] < 8


# --- pictures --------------------------------------------------------------------------------------------------------


def test_pictures_have_the_proportions_of_space(tmp_path: Path) -> None:
    ramp = np.broadcast_to(np.arange(20, dtype=np.uint8)[:, None, None], (20, 24, 28)).copy()
    cubes = volume.cubes(ramp, (1.6, 0.8, 0.8))
    assert cubes.shape == (40, 24, 28)
    assert (cubes[::2] == ramp).all()
    assert (cubes[1::2] == ramp).all()
    io.write_volume(tmp_path / "a.nrrd", ramp, spacing=(1.6, 0.8, 0.8))
    out = str(tmp_path / "a.png")
    assert main(["slice", str(tmp_path / "a.nrrd"), "-o", out, "--at", "row=3", "-q"]) == 0
    assert io.read(out).shape == (40, 28)
    for place, value in (("plane=7", 7), ("plane=-1", 19)):
        assert main(["slice", str(tmp_path / "a.nrrd"), "-o", out, "--at", place, "-q"]) == 0
        assert np.unique(io.read(out)).tolist() == [value]
    assert main(["slice", str(tmp_path / "a.nrrd"), "-o", out, "--at", "row=3", "--spacing", "1", "-q"]) == 0
    assert io.read(out).shape == (20, 28)
    with pytest.raises(InvalidInput, match="spacing"):
        volume.cubes(ramp, (1, 0, 1))


# --- painting --------------------------------------------------------------------------------------------------------


def test_a_mesh_shows_the_texture_in_its_proportions() -> None:
    pytest.importorskip("trimesh")
    from texrs.painting import texture_mesh

    corners, faces = [[0, 0, 0], [8, 0, 0], [0, 8, 0], [0, 0, 8.0]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    texture = texrs.SolidTexture(ELLIPSOIDS, quality="fast", spacing=(2, 1, 1))
    painted = texture_mesh((corners, faces), texture, scale=3, atlas=None)
    at = np.array(painted.vertices)[:, ::-1] * 3 / (2, 1, 1)
    np.testing.assert_array_equal(painted.maps["image"], texture.sample(at))

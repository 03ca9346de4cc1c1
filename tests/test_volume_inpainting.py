"""Holes in volumes are filled by example, without a step at their border."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import texrs
from texrs import io, samples
from texrs.cli import main
from texrs.errors import InvalidInput
from texrs.inpainting import volumes


def make_ball(shape: tuple[int, ...], radius: float) -> np.ndarray:
    away = np.indices(shape) - ((np.array(shape) - 1) / 2)[:, None, None, None]
    return np.asarray((away**2).sum(axis=0) < radius**2)


def measure_step(volume: np.ndarray, hole: np.ndarray) -> float:
    """Return the mean difference across the border of a hole, divided by that of neighbours elsewhere."""
    values = volume.astype(float).reshape(*hole.shape, -1)
    across, elsewhere = [], []
    for axis in range(3):
        change = np.abs(np.diff(values, axis=axis)).mean(axis=-1)
        first, second = (np.take(hole, range(s, hole.shape[axis] - 1 + s), axis) for s in (0, 1))
        across.append(change[first != second])
        elsewhere.append(change[~first & ~second])
    return float(np.concatenate(across).mean() / np.concatenate(elsewhere).mean())


def make_noise(seed: int = 0) -> np.ndarray:
    from scipy.ndimage import gaussian_filter

    noise = gaussian_filter(np.random.default_rng(seed).normal(size=(40, 40, 40)), 2.0, mode="wrap")
    return np.asarray(np.clip(128 + 40 * noise / noise.std(), 0, 255).astype(np.uint8))


VOLUMES = {
    "noise": make_noise,
    "stripes": lambda: samples.stripes((40, 40, 40)).image,
    "floats": lambda: make_noise(1).astype(np.float32) / 255,
}


@pytest.mark.parametrize("name", VOLUMES)
def test_a_hole_has_no_step_at_its_border(name: str) -> None:
    volume = VOLUMES[name]()
    hole = make_ball(volume.shape[:3], 9)
    given = volume.copy()
    given[hole] = 7
    result = texrs.inpaint(given, hole, seed=3)
    assert (result.image[~hole] == volume[~hole]).all()
    assert measure_step(result.image, hole) <= 1.2
    assert result.image.dtype == volume.dtype
    # The source map without the correction is exact, and never points into the hole.
    np.testing.assert_array_equal(result.source_map.render([given]), result.stages["before_blending"])
    places = np.rint(result.source_map.coordinates).astype(int)
    assert not hole[tuple(np.moveaxis(places, -1, 0))].any()
    # The former contents of the hole do not matter.
    assert (texrs.inpaint(volume, hole, seed=3).image == result.image).all()


def make_cells(seed: int = 5) -> np.ndarray:
    """Return periodic labels of cells around random points."""
    points = np.random.default_rng(seed).uniform(0, 40, (60, 3))
    grid = np.moveaxis(np.indices((40, 40, 40)), 0, -1)[..., np.newaxis, :]
    away = np.abs(grid - points)
    nearest = (np.minimum(away, 40 - away) ** 2).sum(axis=-1).argmin(axis=-1)
    return np.asarray((nearest % 5).astype(np.uint8))


def test_smaller_patches_are_tried_if_the_border_of_a_hole_shows() -> None:
    labels, hole = make_cells(), make_ball((40, 40, 40), 10)
    usual, least = volumes.list_sides(volumes.choose_side(hole, hole.shape), labels=True)[::3]
    made = texrs.inpaint(labels, hole, seed=1)
    fixed = texrs.inpaint(labels, hole, seed=1, patch_size=usual)
    steps = [volumes.measure_step(each.image, hole, labels=True) for each in (made, fixed)]
    assert steps[0] < 0.85 * steps[1]
    assert made.report["candidates"][0] == [usual, round(steps[1], 3)]
    assert least <= made.report["patch_size"] < usual
    # Only the first size is tried if the border is invisible.
    stripes = samples.stripes((40, 40, 40)).image
    assert len(texrs.inpaint(stripes, hole, seed=1).report["candidates"]) == 1


def test_a_correction_outside_the_source_map_is_reported() -> None:
    volume, hole = make_noise(), make_ball((40, 40, 40), 8)
    assert texrs.inpaint(volume, hole).report["screening_in_source_map"] is False
    assert texrs.inpaint(volume, hole, screening=0).report["screening_in_source_map"] is True


def test_labels_are_not_mixed() -> None:
    labels = (make_noise() // 52).astype(np.uint8) * 50
    hole = make_ball(labels.shape, 8)
    result = texrs.inpaint(labels, hole)
    assert result.report["labels"]
    assert result.report["screening"] == 0
    assert set(np.unique(result.image)) <= set(np.unique(labels[~hole]))
    with pytest.raises(InvalidInput, match="screening: must be omitted or 0 for labels"):
        texrs.inpaint(labels, hole, screening=0.1)


def test_the_correction_can_be_left_out() -> None:
    volume = make_noise()
    hole = make_ball(volume.shape, 8)
    # Pass a patch size, because the border after the correction decides whether other sizes are tried.
    plain = texrs.inpaint(volume, hole, screening=0, patch_size=10)
    assert (plain.image == plain.stages["before_blending"]).all()
    assert (texrs.inpaint(volume, hole, patch_size=10).stages["before_blending"] == plain.image).all()


def test_known_voxels_change_within_the_boundary_alone() -> None:
    from scipy.ndimage import distance_transform_edt

    volume = make_noise()
    hole = make_ball(volume.shape, 8)
    result = texrs.inpaint(volume, hole, boundary_width=3)
    far = distance_transform_edt(~hole) > 3
    assert (result.image[far] == volume[far]).all()
    assert result.report["replaced_outside"] > 0


def test_threads_do_not_change_a_voxel() -> None:
    volume = make_noise()
    hole = make_ball(volume.shape, 7)
    with texrs.threads(1):
        one = texrs.inpaint(volume, hole, seed=5).image
    with texrs.threads(3):
        several = texrs.inpaint(volume, hole, seed=5).image
    np.testing.assert_array_equal(one, several)


def test_holes_of_any_shape() -> None:
    volume = make_noise()
    corner = np.zeros(volume.shape, bool)
    corner[:10, :12, 30:] = True
    specks = np.random.default_rng(2).random(volume.shape) < 0.002
    for hole in (corner, specks, corner | specks):
        result = texrs.inpaint(volume, hole, screening=0)
        assert (result.image[~hole] == volume[~hole]).all()
        assert ((result.source_map.label > 0) == hole).all()


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"mask": np.ones((40, 40, 40), bool)}, "mask: "),
        ({"scale_map": "auto"}, "scale_map: only available for images"),
        ({"method": "optimise"}, "method: only available for images"),
        ({"wrap": True}, "wrap: only available for images"),
        ({"patch_size": 3}, "patch_size: "),
        ({"patch_size": 41}, "patch_size: "),
        (
            {"image": np.zeros((40, 40, 8), np.uint8), "mask": np.ones((40, 40, 8), bool)},
            "mask: ",
        ),
    ],
)
def test_refusals(options: dict[str, object], says: str) -> None:
    given = {"image": make_noise(), "mask": make_ball((40, 40, 40), 8)} | options
    with pytest.raises(InvalidInput, match=says):
        texrs.inpaint(**given)


def test_the_command_fills_volumes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    volume = make_noise()
    hole = make_ball(volume.shape, 8)
    io.write_volume(tmp_path / "scan.nrrd", np.where(hole, 0, volume).astype(np.uint8), spacing=(3, 1, 0.5))
    io.write_volume(tmp_path / "hole.nrrd", hole.astype(np.uint8))
    names = [str(tmp_path / name) for name in ("scan.nrrd", "hole.nrrd", "filled.nrrd")]
    assert main(["inpaint", names[0], names[1], "-o", names[2], "-q"]) == 0, capsys.readouterr().err
    np.testing.assert_array_equal(io.read_volume(names[2]), texrs.inpaint(volume, hole).image)
    assert io.read_spacing(names[2]) == (3, 1, 0.5)
    assert main(["inpaint", names[0], names[1], "-o", names[2], "--wrap", "x", "-q"]) == 2
    assert "--wrap: only available for images; omit it for a volume" in capsys.readouterr().err


@pytest.mark.parametrize("suffix", [".npy", ".nrrd", ".tif"])
def test_values_of_a_volume_define_its_hole(suffix: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A volume without a mask was filled as an image of many channels, and known voxels changed."""
    volume = make_noise(1).astype(np.float32)
    hole = make_ball(volume.shape, 6)
    for value, words in ((np.nan, []), (np.nan, ["nan"]), (-7.0, ["--", "-7"])):
        given = np.where(hole, np.float32(value), volume)
        io.write_volume(tmp_path / f"in{suffix}", given)
        out = tmp_path / f"out{suffix}"
        assert main(["inpaint", "-o", str(out), "--force", str(tmp_path / f"in{suffix}"), *words]) == 0
        assert "step at its border" in capsys.readouterr().err
        filled = io.read_volume(out)
        np.testing.assert_array_equal(filled[~hole], volume[~hole])
        assert np.isfinite(filled).all()
        assert filled.min() >= volume.min() - 20
    for mask in (None, "nan"):
        made = texrs.inpaint(np.where(hole, np.nan, volume), mask)
        np.testing.assert_array_equal(made.image[~hole], volume[~hole])
        assert any("is read as a volume" in text for text in made.report["assumed"])

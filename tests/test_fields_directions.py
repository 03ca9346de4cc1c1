"""Fields from directions, slopes and grain."""

from pathlib import Path

import numpy as np
import pytest

import texrs
from texrs import fields, io, samples
from texrs.cli import main
from texrs.errors import InvalidInput

ROWS, COLUMNS = np.mgrid[-16:16, -16:16] + 0.5
Z, Y, X = np.mgrid[-6:6, -8:8, -8:8] + 0.5
AROUND = np.stack([COLUMNS, -ROWS], axis=-1)
WOUND = np.stack([0 * Z, X, -Y], axis=-1)


def angle(a: np.ndarray, b: np.ndarray) -> float:
    """Return the largest angle between directions, in degrees."""
    a, b = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in (a, b))
    return float(np.degrees(np.arccos(np.clip((a * b).sum(axis=-1), -1, 1))).max())


@pytest.mark.parametrize("along", ["x", "y"])
def test_pictures(along: str) -> None:
    frames = fields.from_directions(3 * AROUND, along=along).lattice((32, 32), jacobians=False)
    assert angle(frames[..., "yx".index(along)], AROUND) < 0.05
    assert np.allclose(np.linalg.det(frames), 1, atol=1e-4)


@pytest.mark.parametrize("along", ["x", "y", "z"])
def test_volumes(along: str) -> None:
    field = fields.from_directions(WOUND, along=along)
    frames = field.lattice(Z.shape, jacobians=False)
    assert angle(frames[..., "zyx".index(along)], WOUND) < 0.05
    assert np.allclose(np.linalg.det(frames), 1, atol=1e-4)
    assert np.allclose(frames @ frames.swapaxes(-1, -2), np.eye(3), atol=1e-4)
    upright = frames[..., 0 if along != "z" else 1]
    assert np.allclose(np.abs(upright[..., 0]), 1, atol=1e-4)  # The axis without movement is unchanged.


def test_it_is_the_circular_field() -> None:
    """It equals the field by formula: rows outwards and columns around, or vice versa."""
    found = fields.from_directions(AROUND).lattice((32, 32), jacobians=False)
    wanted = fields.circular(axes=2, centre=(15.5, 15.5)).lattice((32, 32), jacobians=False)
    assert np.allclose(np.abs((found[..., 1] * wanted[..., 1]).sum(axis=-1)), 0, atol=1e-3) or np.allclose(
        np.abs((found[..., 1] * wanted[..., 1]).sum(axis=-1)), 1, atol=1e-3
    )


def test_order_up_extent_and_missing_directions() -> None:
    swapped = fields.from_directions(AROUND[..., ::-1], order="xy")
    assert swapped == fields.from_directions(AROUND)
    coarse = fields.from_directions(AROUND[::4, ::4], extent=(32, 32))
    middle = coarse.frames([(8, 24)])
    assert middle.shape == (1, 2, 2)
    holes = AROUND.copy()
    holes[10:13, 20:22] = 0
    frames = fields.from_directions(holes).lattice((32, 32), jacobians=False)
    assert angle(frames[..., 1], AROUND) < 45
    tilted = fields.from_directions(WOUND, up=(1, 0.2, 0)).lattice(Z.shape, jacobians=False)
    assert angle(tilted[..., 2], WOUND) < 0.05
    assert angle(tilted[..., 0], np.broadcast_to([1, 0.2, 0], WOUND.shape)) < 12
    # The directions are parallel to ``up``.
    everywhere = fields.from_directions(np.broadcast_to([1.0, 0, 0], (4, 4, 4, 3)), up=(1, 0, 0))
    assert np.allclose(np.linalg.det(everywhere.lattice((4, 4, 4))), 1, atol=1e-4)


def test_lines_without_a_sense_are_brought_to_agree() -> None:
    half = AROUND[:, 18:]
    signs = np.sign(np.random.default_rng(0).random(half.shape[:2]) - 0.5)[..., None]
    frames = fields.from_directions(half * signs, signed=False).lattice(half.shape[:2], jacobians=False)
    cosines = (frames[..., 1] * half / np.linalg.norm(half, axis=-1, keepdims=True)).sum(axis=-1)
    assert np.allclose(np.abs(cosines), 1, atol=1e-3)
    assert len(set(np.sign(cosines).reshape(-1))) == 1


def test_slopes_and_grain() -> None:
    hill = -(ROWS**2) - COLUMNS**2
    frames = fields.from_gradient(hill, sigma=1).lattice((32, 32), jacobians=False)
    inwards = -np.stack([ROWS, COLUMNS], axis=-1)
    near = np.hypot(ROWS, COLUMNS) < 13
    assert angle(frames[..., 1][near], inwards[near]) < 6
    across = fields.from_gradient(hill, sigma=1, across=True).lattice((32, 32), jacobians=False)
    assert np.abs((across[..., 1] * inwards).sum(axis=-1))[near].max() < 1.5
    rings = np.sin(np.hypot(ROWS, COLUMNS) * 1.2)
    grain = fields.from_structure(rings[:, 20:], sigma=2).lattice((32, 12), jacobians=False)[..., 1]
    wanted = AROUND[:, 20:] / np.linalg.norm(AROUND[:, 20:], axis=-1, keepdims=True)
    assert np.abs((grain * wanted).sum(axis=-1))[4:-4, 3:-3].min() > 0.97
    fibres = np.sin(1.1 * X) + np.cos(1.3 * Y)
    along = fields.from_structure(fibres, along="z").lattice(Z.shape, jacobians=False)[..., 0]
    assert np.abs(along[2:-2, 2:-2, 2:-2, 0]).min() > 0.99


def test_textures_follow_directions() -> None:
    weave = samples.weave((48, 64)).image
    turned = texrs.synthesize(weave, 64, field=fields.from_directions(AROUND, extent=(64, 64)), seed=1)
    assert turned.image.shape == (64, 64, 3)
    assert turned.report["field"].startswith("array of 32 x 32 frames")


@pytest.mark.parametrize("suffix", [".npy", ".npz"])
def test_files_of_directions(tmp_path: Path, suffix: str) -> None:
    io.write(tmp_path / "weave.png", samples.weave((48, 64)).image)
    path = tmp_path / f"flow{suffix}"
    if suffix == ".npy":
        np.save(path, AROUND)
    else:
        np.savez(path, flow=AROUND)
    words = ["synthesize", f"{tmp_path}/weave.png", "-o", f"{tmp_path}/out.png", "--size", "64", "-q"]
    assert main([*words, "--field", str(path)]) == 0
    field = fields.from_directions(AROUND, (64, 64))
    assert np.array_equal(
        io.read(tmp_path / "out.png"), texrs.synthesize(io.read(tmp_path / "weave.png"), 64, field=field).image
    )


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: fields.from_directions(WOUND, up=(0, 0, 0)), "up: must be one nonzero vector"),
        (lambda: fields.from_gradient(Z, across=True), "across: must be False for a volume"),
    ],
)
def test_wrong_arguments(call, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        call()

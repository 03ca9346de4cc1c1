"""Meshes painted with textures of space."""

from pathlib import Path

import numpy as np
import pytest

import texrs
from texrs import samples
from texrs.errors import FileError, InvalidInput
from texrs.painting import bake_points, paint

trimesh = pytest.importorskip("trimesh")

STRIPES = samples.stripes((32, 32, 32)).image[:24, :24, :24]
TEXTURE = texrs.SolidTexture(STRIPES, seed=1)
BALL = trimesh.creation.icosphere(subdivisions=2, radius=10.0)


def test_corners_show_the_texture_where_they_lie() -> None:
    painted = paint(BALL, TEXTURE, scale=1.5, atlas=None)
    assert np.array_equal(painted.maps["image"], TEXTURE.sample(BALL.vertices[:, ::-1] * 1.5))
    assert painted.uv is None


@pytest.fixture(scope="module")
def baked() -> texrs.painting.Painted:
    pytest.importorskip("xatlas")
    return paint(BALL, TEXTURE, scale=1.0, atlas=128)


def test_texels_show_the_texture_where_they_lie(baked: texrs.painting.Painted) -> None:
    assert baked.uv is not None
    points, there = bake_points(baked.vertices, baked.faces, baked.uv, 128, 0)
    assert there.mean() > 0.3
    radius = np.linalg.norm(points[there], axis=-1)
    assert radius.min() > 9.3
    assert radius.max() < 10.001
    assert np.array_equal(baked.maps["image"][there], TEXTURE.sample(points[there][:, ::-1]))


def test_nothing_is_seen_where_pieces_meet(baked: texrs.painting.Painted) -> None:
    """A point on the edge of two pieces has nearly the same colour in both, with what a viewer mixes."""
    from scipy.ndimage import map_coordinates

    uv, image = baked.uv, baked.maps["image"].astype(float)
    assert uv is not None
    at = np.stack([(1 - uv[:, 1]) * 128 - 0.5, uv[:, 0] * 128 - 0.5])
    shown = np.stack([map_coordinates(image[..., c], at, order=1, mode="nearest") for c in range(3)], axis=-1)
    _, same, counts = np.unique(np.round(baked.vertices, 4), axis=0, return_inverse=True, return_counts=True)
    apart = [np.ptp(shown[same.reshape(-1) == k], axis=0).max() for k in np.flatnonzero(counts > 1)]
    assert len(apart) > 10
    assert np.median(apart) < 12


def test_files_go_around(baked: texrs.painting.Painted, tmp_path: Path) -> None:
    BALL.export(tmp_path / "ball.stl")
    coloured = paint(tmp_path / "ball.stl", TEXTURE, scale=1.0, atlas=None)
    coloured.save(tmp_path / "ball.ply")
    back = trimesh.load(tmp_path / "ball.ply", process=False)
    assert np.array_equal(back.visual.vertex_colors[:, :3], coloured.maps["image"])
    baked.save(tmp_path / "ball.glb")
    there = trimesh.load(tmp_path / "ball.glb", force="mesh", process=False)
    assert np.allclose(there.visual.uv, baked.uv, atol=1e-5)
    assert np.array_equal(np.asarray(there.visual.material.baseColorTexture)[..., :3], baked.maps["image"])
    again = paint(tmp_path / "ball.glb", TEXTURE, scale=1.0, atlas=64)  # Its own atlas is kept.
    assert np.allclose(again.uv, baked.uv, atol=1e-5)


def test_materials_and_depth() -> None:
    maps = {"albedo": STRIPES.astype(np.uint16) * 257, "height": STRIPES[..., 0].astype(np.float32)}
    texture = texrs.SolidTexture(texrs.Material(maps, axes=3))
    painted = paint(BALL, texture, scale=1.0, atlas=None)
    assert {name: (a.shape, str(a.dtype)) for name, a in painted.maps.items()} == {
        "albedo": ((162, 3), "uint16"),
        "height": ((162,), "float32"),
    }


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: paint(BALL, STRIPES), InvalidInput, "texture: needs a texrs.SolidTexture"),
        (lambda: paint(7, TEXTURE), InvalidInput, "mesh: needs a file"),
        (lambda: paint(([[0, 0, 0]], [[0, 0, 1]]), TEXTURE), InvalidInput, "faces reach 1"),
        (lambda: paint(BALL, TEXTURE, scale=0), InvalidInput, "scale"),
        (lambda: paint(BALL, TEXTURE, atlas=4), InvalidInput, "atlas"),
        (lambda: paint("nowhere.obj", TEXTURE), FileError, "nowhere.obj"),
    ],
)
def test_wrong_arguments(call, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        call()

"""Meshes painted with textures of space."""

import json
from pathlib import Path

import numpy as np
import pytest

import texrs
from texrs import painting, samples
from texrs.errors import FileError, InvalidInput
from texrs.painting import field_on_surface, texture_mesh
from texrs.painting._baking import bake_points, lean
from texrs.painting._meshes import find_normals, find_tangents
from texrs.painting._sets import lay_flat
from texrs.painting.reading import read_mesh

trimesh = pytest.importorskip("trimesh")

STRIPES = samples.stripes((32, 32, 32)).image[:24, :24, :24]
TEXTURE = texrs.SolidTexture(STRIPES, seed=1)
BALL = trimesh.creation.icosphere(subdivisions=2, radius=10.0)


def test_corners_show_the_texture_where_they_lie() -> None:
    painted = texture_mesh(BALL, TEXTURE, scale=1.5, atlas=None)
    assert np.array_equal(painted.maps["image"], TEXTURE.sample(BALL.vertices[:, ::-1] * 1.5))
    assert painted.uv is None


@pytest.fixture(scope="module")
def baked() -> texrs.painting.TexturedMesh:
    pytest.importorskip("xatlas")
    return texture_mesh(BALL, TEXTURE, scale=1.0, atlas=128)


def test_texels_show_the_texture_where_they_lie(baked: texrs.painting.TexturedMesh) -> None:
    assert baked.uv is not None
    points, there = bake_points(baked.vertices, baked.faces, baked.uv, 128, 0)
    assert there.mean() > 0.3
    radius = np.linalg.norm(points[there], axis=-1)
    assert radius.min() > 9.3
    assert radius.max() < 10.001
    assert np.array_equal(baked.maps["image"][there], TEXTURE.sample(points[there][:, ::-1]))


@pytest.mark.parametrize("spacing", [None, (2.0, 2.0, 2.0)])
@pytest.mark.parametrize("side", [32, 256])
def test_no_voxel_is_smaller_than_a_texel_by_default(
    side: int, spacing: tuple[float, ...] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("xatlas")
    texture, scales = texrs.SolidTexture(STRIPES, spacing=spacing, quality="fast"), []

    def sample(texture: texrs.SolidTexture, points: np.ndarray, watch: object) -> dict[str, np.ndarray]:
        scales.append(np.ptp(points, axis=0).max() / (texture.spacing[0] * 20))
        return {"image": np.zeros((len(points), 3), np.uint8)}

    monkeypatch.setattr(painting, "_sample", sample)
    texture_mesh(BALL, texture, atlas=side, padding=0)
    surface = read_mesh(BALL)
    finest = 4 * 24 / 20
    texel = painting.find_scale(surface, texture, atlas=side, padding=0) / texture.spacing[0]
    assert scales[0] == pytest.approx(texel, rel=0.02)
    assert (texel == pytest.approx(finest)) == (side == 256)
    laid = lay_flat(surface, side, 0, fresh=False)
    points, there = bake_points(laid.surface.vertices, laid.surface.faces, laid.surface.uv, side, 0)
    apart = np.linalg.norm(np.diff(points, axis=1), axis=-1)[there[:, 1:] & there[:, :-1]]
    assert np.median(apart) * texel < 1.2


def test_nothing_is_seen_where_pieces_meet(baked: texrs.painting.TexturedMesh) -> None:
    """A point on the edge of two pieces has nearly the same colour in both, also after a viewer's interpolation."""
    from scipy.ndimage import map_coordinates

    uv, image = baked.uv, baked.maps["image"].astype(float)
    assert uv is not None
    at = np.stack([(1 - uv[:, 1]) * 128 - 0.5, uv[:, 0] * 128 - 0.5])
    shown = np.stack([map_coordinates(image[..., c], at, order=1, mode="nearest") for c in range(3)], axis=-1)
    _, same, counts = np.unique(np.round(baked.vertices, 4), axis=0, return_inverse=True, return_counts=True)
    apart = [np.ptp(shown[same.reshape(-1) == k], axis=0).max() for k in np.flatnonzero(counts > 1)]
    assert len(apart) > 10
    assert np.median(apart) < 12


def test_files_go_around(baked: texrs.painting.TexturedMesh, tmp_path: Path) -> None:
    BALL.export(tmp_path / "ball.stl")
    coloured = texture_mesh(tmp_path / "ball.stl", TEXTURE, scale=1.0, atlas=None)
    coloured.save(tmp_path / "ball.ply")
    back = trimesh.load(tmp_path / "ball.ply", process=False)
    assert np.array_equal(back.visual.vertex_colors[:, :3], coloured.maps["image"])
    baked.save(tmp_path / "ball.glb")
    there = trimesh.load(tmp_path / "ball.glb", force="mesh", process=False)
    assert np.allclose(there.visual.uv, baked.uv, atol=1e-5)
    assert np.array_equal(np.asarray(there.visual.material.baseColorTexture)[..., :3], baked.maps["image"])
    again = texture_mesh(tmp_path / "ball.glb", TEXTURE, scale=1.0, atlas=64)  # The mesh keeps its own atlas.
    assert np.allclose(again.uv, baked.uv, atol=1e-5)


def test_materials_and_depth() -> None:
    maps = {"albedo": STRIPES.astype(np.uint16) * 257, "height": STRIPES[..., 0].astype(np.float32)}
    texture = texrs.SolidTexture(texrs.Material(maps, axes=3))
    painted = texture_mesh(BALL, texture, scale=1.0, atlas=None)
    assert {name: (a.shape, str(a.dtype)) for name, a in painted.maps.items()} == {
        "albedo": ((162, 3), "uint16"),
        "height": ((162,), "float32"),
    }


def test_heights_lean_as_they_do_on_the_surface(tmp_path: Path) -> None:
    """A ramp along x over a square: its normals lean to the left everywhere, also in the 16-bit file."""
    pytest.importorskip("xatlas")
    corners = np.array([[0, 0, 0], [8, 0, 0], [8, 8, 0], [0, 8, 0]], float)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    points, there = bake_points(corners, faces, corners[:, :2] / 8, 32, 2)
    steep = np.arctan(0.4 * np.sqrt(2))  # Both components together have a slope of 0.4.
    normal = lean(points[..., 0].astype(np.float32), points, there, there)
    assert np.allclose(normal, [-np.sin(steep), 0, np.cos(steep)], atol=1e-5)
    normal = lean(points[..., 1].astype(np.float32), points, there, there)
    assert np.allclose(normal[..., 1], -np.sin(steep), atol=1e-5)
    maps = {"albedo": STRIPES.astype(np.uint16) * 257, "height": STRIPES[..., 0], "roughness": STRIPES[..., 1]}
    painted = texture_mesh(BALL, texrs.SolidTexture(texrs.Material(maps, axes=3)), scale=1.0, atlas=64)
    painted.save(tmp_path / "ball.glb")
    data = (tmp_path / "ball.glb").read_bytes()
    said = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    (material,) = said["materials"]
    assert material["normalTexture"]
    assert material["pbrMetallicRoughness"].keys() >= {"baseColorTexture", "metallicRoughnessTexture"}
    start = 28 + int.from_bytes(data[12:16], "little")
    for image in said["images"]:
        view = said["bufferViews"][image["bufferView"]]
        picture = data[start + view["byteOffset"] :][: view["byteLength"]]
        assert picture[24] == 16  # This byte of the PNG header is the number of bits.
    attributes = said["meshes"][0]["primitives"][0]["attributes"]
    assert set(attributes) == {"POSITION", "NORMAL", "TANGENT", "TEXCOORD_0"}


def carved(vectors: np.ndarray, role: str = "normal", **options: object) -> texrs.SolidTexture:
    """Return a texture of a material with the same normals everywhere."""
    normals = np.broadcast_to(np.float32(vectors), (24, 24, 24, 3)).copy()
    normals[0, 0, 0] = -normals[0, 0, 0]  # Negative values show that normals are not encoded.
    return texrs.SolidTexture(texrs.Material({"albedo": STRIPES, "n": normals}, roles={"n": role}, axes=3), **options)


SQUARE = np.array([[2, 2, 4], [9, 2, 4], [9, 9, 4], [2, 9, 4]], float)
HALVES = np.array([[0, 1, 2], [0, 2, 3]])
TURNED = np.array([[0, 1], [0, 0], [1, 0], [1, 1]], float)  # Columns of the atlas go along y, and its rows up along -x.


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(
    ("vector", "role", "wanted"),
    [
        # The rows of the texture go along the mesh's y, and the y of normals in the opposite direction.
        ((0.6, 0, 0.8), "normal", (0.6, 0, 0.8)),
        ((0, 0.6, 0.8), "normal", (0, -0.6, 0.8)),
        ((0, 0.6, 0.8), "normal-dx", (0, 0.6, 0.8)),
    ],
)
def test_normals_of_space_lean_on_a_plane_as_they_do_in_the_texture(vector, role, wanted, turned: bool) -> None:
    mesh = trimesh.Trimesh(SQUARE, HALVES, process=False)
    mesh.visual = trimesh.visual.TextureVisuals(uv=TURNED if turned else (SQUARE[:, :2] - 2) / 7)
    relief = texture_mesh(mesh, carved(vector, role), scale=1.0, atlas=16).relief
    assert relief is not None
    x, y, z = wanted
    assert np.allclose(np.median(relief, axis=(0, 1)), (y, -x, z) if turned else wanted, atol=1e-5)


def test_normals_of_space_tilt_a_ball_by_what_lies_in_its_surface(baked: texrs.painting.TexturedMesh) -> None:
    """Only the part of a relief along x that is in the surface counts. A viewer's bytes return this normal."""
    from texrs.painting._relief import bake_frames

    flat = texture_mesh(BALL, carved((0, 0, 1)), scale=1.0, atlas=128).relief
    assert flat is not None
    assert np.median(flat[..., 2]) > 0.99999
    relief = texture_mesh(BALL, carved((0.6, 0, 0.8)), scale=1.0, atlas=128).relief
    assert relief is not None
    assert baked.uv is not None
    normals = find_normals(baked.vertices, baked.faces)
    tangents = find_tangents(baked.vertices, baked.faces, baked.uv, normals)
    frames = bake_frames(normals, tangents, baked.faces, baked.uv, 128, 0)
    there = bake_points(baked.vertices, baked.faces, baked.uv, 128, 0)[1]
    shown = np.einsum("nij,ni->nj", frames[there], relief[there])
    out, rise = frames[there][:, 2], np.array([-0.75, 0, 0])
    wanted = out - (rise - (out @ rise)[:, np.newaxis] * out)
    wanted /= np.linalg.norm(wanted, axis=1, keepdims=True)
    apart = np.abs(shown / np.linalg.norm(shown, axis=1, keepdims=True) - wanted).max(axis=1)
    assert np.quantile(apart, 0.99) < 1e-4


def test_normals_of_space_turn_with_the_field_and_are_written(tmp_path: Path) -> None:
    # The texture's columns go along the mesh's y.
    quarter = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], float)
    field = texrs.fields.from_function(lambda points: np.broadcast_to(quarter, (len(points), 3, 3)), 3)
    mesh = trimesh.Trimesh(SQUARE, HALVES, process=False)
    mesh.visual = trimesh.visual.TextureVisuals(uv=(SQUARE[:, :2] - 2) / 7)
    painted = texture_mesh(mesh, carved((0.6, 0, 0.8), field=field), scale=1.0, atlas=16)
    assert painted.relief is not None
    assert np.allclose(np.median(painted.relief, axis=(0, 1)), (0, 0.6, 0.8), atol=1e-5)
    # Normals of a volume are directions in space, and are also rotated; y is opposite to the rows.
    assert np.allclose(np.median(painted.maps["n"], axis=(0, 1)), (0, -0.6, 0.8), atol=1e-5)
    painted.save(tmp_path / "a.glb")
    there = trimesh.load(tmp_path / "a.glb", force="mesh", process=False)
    pixels = np.median(np.asarray(there.visual.material.normalTexture)[..., :3], axis=(0, 1))
    assert np.abs(pixels - 255 * (np.array([0, 0.6, 0.8]) + 1) / 2).max() <= 1


def test_smooth_things_stay_smooth_where_the_atlas_is_cut_and_edges_sharp(baked: texrs.painting.TexturedMesh) -> None:
    normals = find_normals(baked.vertices, baked.faces)
    assert (normals * baked.vertices / 10).sum(axis=1).min() > 0.99
    _, same = np.unique(baked.vertices, axis=0, return_inverse=True)
    for place in np.unique(same):
        assert np.ptp(normals[same.reshape(-1) == place], axis=0).max() < 1e-9
    box = trimesh.creation.box()
    corners = box.vertices[box.faces].reshape(-1, 3)
    split = find_normals(corners, np.arange(36).reshape(-1, 3))
    assert np.allclose(np.sort(np.abs(split), axis=1), [0, 0, 1])


def along_surface(field: texrs.fields.Field, points: np.ndarray) -> np.ndarray:
    """Return the direction of the exemplar's x axis, as x, y, z."""
    return field.frames(points[:, ::-1] * 2.0)[..., 2][:, ::-1]


def test_directions_lie_in_the_surface_as_they_are_said(tmp_path: Path) -> None:
    tube = trimesh.creation.cylinder(radius=4.0, height=30.0, sections=48)
    angle = np.linspace(0, 2 * np.pi, 13)[:-1] + 0.1
    points = np.stack([4 * np.cos(angle), 4 * np.sin(angle), np.linspace(-9, 9, 12)], axis=1)
    out = points * [1, 1, 0] / 4
    around = np.stack([-np.sin(angle), np.cos(angle), 0 * angle], axis=1)
    mesh = (tube.vertices, tube.faces)
    for said, wanted, signed in (
        ("z", np.tile([0, 0, 1.0], (12, 1)), True),
        ("around:z", around, True),
        ("curvature", around, False),
        ("curvature:least", np.tile([0, 0, 1.0], (12, 1)), False),
        ([[[4, 0, -9], [4, 0, 9]]], np.tile([0, 0, 1.0], (12, 1)), True),
    ):
        field = field_on_surface(mesh, said, scale=2.0, resolution=32)
        found = along_surface(field, points)
        dots = (found * wanted).sum(axis=1)
        assert (dots if signed else np.abs(dots)).min() > 0.9, said
        # Planes of the exemplar point out of the surface.
        assert (field.frames(points[:, ::-1] * 2.0)[..., 0][:, ::-1] * out).sum(axis=1).min() > 0.9
    (tmp_path / "s.json").write_text(json.dumps({"strokes": [{"points": [[4, 0, -9], [4, 0, 9]]}]}))
    again = field_on_surface(mesh, str(tmp_path / "s.json"), scale=2.0, resolution=32)
    assert np.array_equal(along_surface(again, points), found)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (
            lambda: texture_mesh(([[0, 0, 0]], [[0, 0, 1]]), TEXTURE),
            InvalidInput,
            "mesh: faces must be indices below 1, got 0 to 1",
        ),
        (lambda: texture_mesh("nowhere.obj", TEXTURE), FileError, "nowhere.obj"),
        (lambda: field_on_surface(BALL, "curvature:some", scale=1), InvalidInput, "must be one of curvature"),
        (lambda: field_on_surface(BALL, "nowhere.json", scale=1), FileError, "nowhere.json"),
    ],
)
def test_wrong_arguments(call, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        call()

"""Meshes from users: materials, objects, tiles, missing UVs, scenes. All of it is written again, or reported."""

import json
from pathlib import Path

import numpy as np
import pytest

import texrs
from texrs import _notices, samples
from texrs.errors import FileError, InputWarning, InvalidInput
from texrs.painting import texture_mesh
from texrs.painting._baking import bake_points
from texrs.painting.reading import read_mesh

trimesh = pytest.importorskip("trimesh")

STRIPES = samples.stripes((32, 32, 32)).image[:24, :24, :24]
TEXTURE = texrs.SolidTexture(STRIPES, seed=1, quality="fast")
PLATE = """# a plate of two materials
o plate
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 2 0 0
v 2 1 0
{uv}
vn 0 0.6 0.8
usemtl m1
s 1
f 1/1/1 2/2/1 3/3/1
f 1/1/1 3/3/1 4/4/1
usemtl m2
g right side
f 2/{0}/1 5/{1}/1 6/{2}/1
f 2/{0}/1 6/{2}/1 3/{3}/1
"""
SIDE_BY_SIDE = PLATE.format(2, 5, 6, 3, uv="vt 0 0\nvt 0.5 0\nvt 0.5 1\nvt 0 1\nvt 1 0\nvt 1 1")
EACH_WHOLE = PLATE.format(1, 2, 3, 4, uv="vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1")
TILES = PLATE.format(2, 5, 6, 3, uv="vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt 2 0\nvt 2 1")


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def bake(text: str, name: str = "plate.obj", **options: object) -> tuple[texrs.painting.TexturedMesh, _notices.Notices]:
    Path(name).write_text(text)
    with _notices.collect(show=lambda _: None) as notices:
        made = texture_mesh(name, TEXTURE, **{"scale": 20.0, "atlas": 32, "padding": 0, **options})
    return made, notices


def read_words(path: str, word: str) -> list[str]:
    return [line for line in Path(path).read_text().splitlines() if line.split()[:1] == [word]]


def check_texels(made: texrs.painting.TexturedMesh) -> None:
    """Check that each texel shows the texture at its place on the surface, in the image of its set."""
    for k in range(len(made.sets)):
        faces = made.faces if made.which is None else made.faces[made.which == k]
        uv = made.uv - np.floor(made.uv[faces].mean(axis=(0, 1)))
        points, there = bake_points(made.vertices, faces, uv, 32, 0)
        shown = made.maps["image"] if len(made.sets) == 1 else made.maps["image"][k]
        assert there.any()
        assert np.array_equal(shown[there], TEXTURE.sample(points[there][:, ::-1] * 20))


@pytest.mark.parametrize(
    ("text", "sets", "pictures"),
    [
        (SIDE_BY_SIDE, ("painted",), {"m1": "a_basecolor.png", "m2": "a_basecolor.png"}),
        (EACH_WHOLE, ("m1", "m2"), {"m1": "a_m1_basecolor.png", "m2": "a_m2_basecolor.png"}),
        (TILES, ("m1_1001", "m2_1002"), {"m1": "a_m1_1001_basecolor.png", "m2": "a_m2_1002_basecolor.png"}),
    ],
    ids=["side by side", "each whole", "tiles"],
)
def test_two_materials_keep_their_uvs_their_names_and_their_order(here, text: str, sets, pictures) -> None:
    made, notices = bake(text)
    assert made.sets == sets
    assert any("texture sets" in each for each in notices.assumed) == (len(sets) > 1)
    assert not notices.ignored
    check_texels(made)
    made.save("a.obj")
    for word in ("v", "vt", "vn", "f", "o", "g", "s", "usemtl"):
        assert read_words("a.obj", word) == read_words("plate.obj", word)
    lines = [line.split() for line in Path("a.mtl").read_text().splitlines()]
    named = [line[1] for line in lines if line[0] in ("newmtl", "map_Kd")]
    assert dict(zip(named[::2], named[1::2], strict=True)) == pictures
    assert all(Path(name).exists() for name in pictures.values())
    made.save("a.glb")
    back, given = read_mesh("a.glb"), read_mesh("plate.obj")
    assert set(back.materials) == {"m1", "m2"}
    assert np.allclose(back.uv[back.faces], given.uv[given.faces], atol=1e-6)
    assert np.allclose(back.vertices[back.faces], given.vertices[given.faces])
    assert np.allclose(back.normals, [0, 0.6, 0.8], atol=1e-6)


def test_objects_of_one_material_that_lie_over_each_other_have_a_set_each(here) -> None:
    made, _ = bake(EACH_WHOLE.replace("usemtl m2\ng right side", "o other").replace("usemtl m1", ""))
    assert made.sets == ("painted", "painted~2")
    check_texels(made)
    made.save("a.obj")
    assert read_words("a.obj", "usemtl") == ["usemtl painted", "usemtl painted~2"]
    made.save("a.glb")
    assert set(trimesh.load_scene("a.glb").geometry) == {"plate", "other"}


def test_faces_that_lie_over_others_of_their_material_are_reported(here) -> None:
    mirrored = EACH_WHOLE.replace("usemtl m2\ng right side\n", "")
    made, notices = bake(mirrored)
    assert made.sets == ("m1",)
    assert len(notices.ignored) == 1
    assert "plate.obj: UVs of 2 faces overlap others" in notices.ignored[0]
    Path("plate.obj").write_text(mirrored)
    with pytest.warns(InputWarning, match="overlap others"):
        texture_mesh("plate.obj", TEXTURE, scale=20.0, atlas=32)
    pytest.importorskip("xatlas")
    apart, notices = bake(mirrored, unwrap=True)
    assert not notices.ignored
    check_texels(apart)


def test_pictures_that_would_repeat_are_refused_with_the_way_out(here) -> None:
    Path("plate.obj").write_text(TILES.replace("vt 2 0", "vt 3.5 0"))
    with pytest.raises(InvalidInput, match=r"UVs of 1 faces cross a tile's border \(u 0 to 3.5.*--unwrap"):
        texture_mesh("plate.obj", TEXTURE, scale=20.0, atlas=32)


def test_faces_without_uvs_are_laid_out_and_the_others_stay(here) -> None:
    pytest.importorskip("xatlas")
    made, notices = bake(
        EACH_WHOLE.replace("2/1/1 5/2/1 6/3/1", "2//1 5//1 6//1").replace("2/1/1 6/3/1 3/4/1", "2//1 6//1 3//1")
    )
    assert any("2 of 4 faces have no UVs" in each for each in notices.assumed)
    assert made.sets == ("m1", "unwrapped")
    assert made.uv[made.faces[:2]].tolist() == [[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]]
    check_texels(made)
    made.save("a.obj")
    assert read_words("a.obj", "usemtl") == ["usemtl m1", "usemtl m2"]


def test_faces_of_four_corners_are_reported_and_go_through(here) -> None:
    quads = SIDE_BY_SIDE.replace("f 1/1/1 2/2/1 3/3/1\nf 1/1/1 3/3/1 4/4/1", "f -6/1/1 2/2/1 3/3/1 4/4/1")
    made, notices = bake(quads)
    assert notices.assumed == ["plate.obj: 1 faces of more than three corners are cut into triangles"]
    assert made.faces.shape == (4, 3)
    made.save("a.obj")
    assert read_words("a.obj", "f") == read_words("plate.obj", "f")
    header = "ply\nformat ascii 1.0\nelement vertex 4\n" + "".join(f"property float {x}\n" for x in "xyz")
    header += "property float quality\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    _, notices = bake(header + "0 0 0 1\n1 0 0 1\n1 1 0 1\n0 1 0 1\n4 0 1 2 3\n", "quad.ply", atlas=None)
    assert notices.assumed == ["quad.ply: faces of more than three corners are cut into triangles"]
    assert notices.ignored == ["quad.ply: quality of its vertices are not used"]


def test_colours_of_an_obj_go_to_its_own_vertices(here) -> None:
    text = SIDE_BY_SIDE.replace("v 2 1 0", "v 2 1 0 1 0 0\nv 9 9 9").replace("f 1/", "l 1 2\nf 1/", 1)
    made, notices = bake(text, atlas=None)
    assert notices.ignored == [
        "plate.obj: lines of l are not used",
        "plate.obj: the colours of its vertices are not used",
    ]
    made.save("a.obj")
    assert read_words("a.obj", "f") == read_words("plate.obj", "f")
    rows = np.array([line.split()[1:] for line in read_words("a.obj", "v")], float)
    given = np.array([line.split()[1:4] for line in read_words("plate.obj", "v")], float)
    assert np.array_equal(rows[:, :3], given)
    assert np.array_equal(np.rint(rows[:, 3:] * 255), TEXTURE.sample(given[:, ::-1] * 20))


def test_a_scene_keeps_places_names_and_uvs_without_materials(here) -> None:
    """Trimesh drops UVs of primitives without a material."""
    flat = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 1, 2]], process=False)
    flat.visual = trimesh.visual.TextureVisuals(uv=[[0, 0], [1, 0], [1, 1]])
    scene = trimesh.Scene()
    scene.add_geometry(flat, node_name="near", geom_name="leaf")
    turn = trimesh.transformations.rotation_matrix(np.pi / 2, [0, 0, 1])
    turn[:3, 3] = [5, 0, 0]
    scene.add_geometry(flat, node_name="far", geom_name="leaf", transform=turn)
    for name, data in trimesh.exchange.gltf.export_gltf(scene).items():
        Path(name).write_bytes(data)
    document = json.loads(Path("model.gltf").read_text())
    del document["materials"]
    for mesh in document["meshes"]:
        del mesh["primitives"][0]["material"]
    Path("bare.gltf").write_text(json.dumps(document | {"animations": [{}], "skins": [{}]}))
    with _notices.collect(show=lambda _: None) as notices:
        surface = read_mesh("bare.gltf")
    assert notices.ignored == ["bare.gltf: animations, skins are not used"]
    assert surface.uv is not None
    assert np.allclose(surface.uv[:3], [[0, 0], [1, 0], [1, 1]])
    assert sorted(surface.vertices.round(6).tolist()) == sorted(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [5, 0, 0], [5, 1, 0], [4, 1, 0]]
    )
    made = texture_mesh(surface, TEXTURE, scale=20.0, atlas=32)
    assert len(made.sets) == 2  # Both copies have the same UVs, and are at different places.
    made.save("painted.glb")
    assert np.allclose(read_mesh("painted.glb").vertices, surface.vertices, atol=1e-6)


def test_progress_moves_with_the_work(here) -> None:
    texture = texrs.SolidTexture(STRIPES, seed=3)
    seen: list[tuple[str, float]] = []
    box = trimesh.creation.box((2, 2, 2))
    texture_mesh(box, texture, scale=20.0, atlas=None, progress=lambda stage, share: seen.append((stage, share)))
    shares = [share for stage, share in seen if stage == "sample"]
    assert shares == sorted(shares)
    assert shares[-1] == 1
    assert len(set(np.round(shares, 2))) > 10
    assert max(np.diff(shares)) < 0.3


@pytest.mark.parametrize("line", ["v 1 2", "v 1 2 x", "f 1 2 99", "f 1 2 0", "f 1/9/1 2/1/1 3/1/1", "f a b c"])
def test_lines_that_cannot_be_read_are_named(here, line: str) -> None:
    Path("plate.obj").write_text(EACH_WHOLE + line + "\n")
    with pytest.raises(FileError, match=r"plate.obj: line 22 cannot be read"):
        read_mesh("plate.obj")

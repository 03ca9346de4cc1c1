"""Materials as glTF: the rules of the standard, reading by other libraries, and the meaning of images."""

import json
import struct
from io import BytesIO
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import pygltflib
import pytest
import trimesh
from PIL import Image

import texrs
from texrs import Material
from texrs._typing import Array
from texrs.errors import FileError, InvalidInput
from texrs.materials.meshes import Mesh, make_plane, make_sphere

STONES = texrs.samples.pebbles((48, 64)).image
GREYS = STONES[..., 0]
RANDOM = np.random.default_rng(1)


def draw_normals(dtype: str) -> Array:
    normal = RANDOM.normal(0, 0.3, (48, 64, 3)) + np.array([0, 0, 1])
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.rint((normal + 1) / 2 * np.iinfo(dtype).max).astype(dtype)


FULL = Material(
    {
        "albedo": STONES,
        "normal_dx": draw_normals("uint8"),
        "ao": GREYS,
        "roughness": STONES[..., 1],
        "metallic": STONES[..., 2] > 128,
        "emission": np.where(STONES > 150, STONES, 0).astype(np.float32) / 51,
        "opacity": GREYS > 60,
        "height": GREYS,
    }
)


def read(path: Path) -> tuple[dict[str, Any], list[bytes], dict[str, Array]]:
    """Return the document, its buffers and its images, and check the standard's requirements for files."""
    if path.suffix == ".glb":
        data = path.read_bytes()
        magic, version, length = struct.unpack("<4sII", data[:12])
        assert (magic, version, length) == (b"glTF", 2, len(data))
        size, kind = struct.unpack("<I4s", data[12:20])
        assert kind == b"JSON"
        assert size % 4 == 0
        document, rest = json.loads(data[20 : 20 + size]), data[20 + size :]
        size, kind = struct.unpack("<I4s", rest[:8])
        assert kind == b"BIN\0"
        assert (size % 4, len(rest)) == (0, 8 + size)
        buffers = [rest[8:]]
        assert 0 <= size - document["buffers"][0]["byteLength"] <= 3
    else:
        document = json.loads(path.read_text())
        buffers = [(path.parent / unquote(b["uri"])).read_bytes() for b in document["buffers"]]
        assert [len(b) for b in buffers] == [b["byteLength"] for b in document["buffers"]]
    pictures = {}
    for image in document.get("images", []):
        if "uri" in image:
            data = (path.parent / unquote(image["uri"])).read_bytes()
        else:
            assert image["mimeType"] == "image/png"
            data = take(document, buffers, image["bufferView"])
        pictures[image["name"]] = np.array(Image.open(BytesIO(data)))
    return document, buffers, pictures


def take(document: dict[str, Any], buffers: list[bytes], number: int) -> bytes:
    view = document["bufferViews"][number]
    assert view["byteOffset"] + view["byteLength"] <= len(buffers[view["buffer"]])
    return buffers[view["buffer"]][view["byteOffset"] :][: view["byteLength"]]


def check_rules(path: Path) -> tuple[dict[str, Any], dict[str, Array]]:
    """Check a file by all rules of severity ERROR of the Khronos validator, and return its contents."""
    document, buffers, pictures = read(path)
    assert document["asset"]["version"] == "2.0"
    assert set(document.get("extensionsUsed", [])) == set(document["materials"][0].get("extensions", {}))
    assert [sorted(scene["nodes"]) for scene in document["scenes"]] == [list(range(len(document["nodes"])))]
    for key in ("nodes", "meshes", "materials", "accessors", "bufferViews", "buffers"):
        assert document[key], "empty arrays are not allowed"
    for key in ("textures", "images", "samplers"):
        assert document.get(key, [0])
    used: set[int] = set()
    for mesh in document["meshes"]:
        for primitive in mesh["primitives"]:
            numbers = dict(primitive["attributes"], indices=primitive["indices"])
            found = {}
            for name, number in numbers.items():
                accessor = document["accessors"][number]
                view = document["bufferViews"][accessor["bufferView"]]
                used.add(accessor["bufferView"])
                kind = {5126: "<f4", 5123: "<u2"}[accessor["componentType"]]
                width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[accessor["type"]]
                assert view["byteOffset"] % 4 == 0
                assert view["target"] == (34963 if name == "indices" else 34962)
                values = np.frombuffer(take(document, buffers, accessor["bufferView"]), kind).reshape(-1, width)
                assert len(values) == accessor["count"]
                assert np.isfinite(values).all()
                if "min" in accessor:
                    assert (values.min(axis=0) == np.float32(accessor["min"])).all()
                    assert (values.max(axis=0) == np.float32(accessor["max"])).all()
                found[name] = values
            assert "min" in document["accessors"][numbers["POSITION"]]
            assert len({len(found[name]) for name in primitive["attributes"]}) == 1
            assert found["indices"].max() < len(found["POSITION"])
            assert len(found["indices"]) % 3 == 0
            np.testing.assert_allclose(np.linalg.norm(found["NORMAL"], axis=1), 1, atol=1e-5)
            np.testing.assert_allclose(np.linalg.norm(found["TANGENT"][:, :3], axis=1), 1, atol=1e-5)
            assert set(found["TANGENT"][:, 3]) <= {1.0, -1.0}
            corners = found["POSITION"][found["indices"].reshape(-1, 3)]
            area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
            assert area.min() > 1e-6, "triangles without an area"
            assert primitive["material"] == 0
    for image in document.get("images", []):
        if "bufferView" in image:
            assert "target" not in document["bufferViews"][image["bufferView"]]
            used.add(image["bufferView"])
    assert used == set(range(len(document["bufferViews"]))), "objects that nothing uses"
    for texture in document.get("textures", []):
        assert texture["sampler"] < len(document["samplers"])
        assert texture["source"] < len(document["images"])
    for slot in slots(document["materials"][0]).values():
        assert slot["index"] < len(document["textures"])
    return document, pictures


def slots(material: dict[str, Any]) -> dict[str, Any]:
    both = material | material["pbrMetallicRoughness"]
    return {key: value for key, value in both.items() if key.endswith("Texture")}


@pytest.mark.parametrize("suffix", [".gltf", ".glb"])
def test_files_obey_the_standard_and_hold_the_maps(suffix: str, tmp_path: Path) -> None:
    paths = FULL.save_gltf(tmp_path / f"my stones{suffix}")
    assert sorted(paths) == sorted(tmp_path.iterdir())
    assert paths[0].name == f"my stones{suffix}"
    document, pictures = check_rules(paths[0])
    material = document["materials"][0]
    assert material["alphaMode"] == "MASK"
    colours = pictures["basecolor"]
    assert (colours[..., :3] == STONES).all()
    assert (colours[..., 3] == 255 * (GREYS > 60)).all()
    packed = pictures["orm"]
    assert (packed == np.dstack([GREYS, STONES[..., 1], 255 * (STONES[..., 2] > 128)])).all()
    assert material["occlusionTexture"] == material["pbrMetallicRoughness"]["metallicRoughnessTexture"]
    # Green is inverted. Otherwise the normals are unchanged, with unit length.
    expected = FULL["normal_dx"].pixels.copy()
    expected[..., 1] = 255 - expected[..., 1]
    assert np.abs(pictures["normal"].astype(int) - expected).max() <= 1
    # Light above white is stored as a factor next to the image.
    strength = material["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"]
    assert strength == FULL["emission"].pixels.max()
    light = np.where(pictures["emission"] > 10, ((pictures["emission"] / 255 + 0.055) / 1.055) ** 2.4, 0) * strength
    np.testing.assert_allclose(light, FULL["emission"].pixels, atol=0.03)


@pytest.mark.parametrize("suffix", [".gltf", ".glb"])
def test_other_libraries_read_it(suffix: str, tmp_path: Path) -> None:
    path = FULL.save_gltf(tmp_path / f"stones{suffix}", repeat=3)[0]
    scene = trimesh.load_scene(path)
    assert set(scene.geometry) == {"plane", "sphere"}
    for mesh in scene.geometry.values():
        material = mesh.visual.material
        assert material.alphaMode == "MASK"
        assert (np.array(material.baseColorTexture)[..., :3] == STONES).all()
        assert material.metallicRoughnessTexture.size == (64, 48)
        assert material.normalTexture.size == material.emissiveTexture.size == (64, 48)
    # trimesh counts rows from below, so compare only the range of the coordinates.
    assert np.ptp(scene.geometry["plane"].visual.uv, axis=0).tolist() == [3, 3]
    ball = scene.geometry["sphere"]
    ball.merge_vertices(merge_tex=True, merge_norm=True)
    assert ball.is_watertight
    assert ball.is_winding_consistent
    assert 4.15 < ball.volume < 4 / 3 * np.pi
    other = pygltflib.GLTF2().load(path)
    assert [m.name for m in other.materials] == ["stones"]
    assert other.accessors[other.meshes[1].primitives[0].indices].count == 3 * len(ball.faces)
    assert other.asset.generator.startswith("texrs ")


@pytest.mark.parametrize("make", [make_plane, make_sphere])
def test_tangents_are_how_pictures_lie(make: Any) -> None:
    mesh: Mesh = make((48, 64), 2)
    corners, places = mesh.positions[mesh.faces].astype(float), mesh.places[mesh.faces].astype(float)
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    out = mesh.normals[mesh.faces].mean(axis=1)
    assert ((np.cross(one, two) * out).sum(axis=1) > 0).all(), "counter-clockwise from outside"
    a, b = places[:, 1] - places[:, 0], places[:, 2] - places[:, 0]
    area = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    assert (area < 0).all(), "rows grow downwards and nothing is mirrored"
    along = (one * b[:, 1:] - two * a[:, 1:]) / area[:, None]
    down = (two * a[:, :1] - one * b[:, :1]) / area[:, None]
    tangents, normals = mesh.tangents[mesh.faces].mean(axis=1), out
    up = np.cross(normals, tangents[:, :3]) * tangents[:, 3:]

    def cosines(u: Array, v: Array) -> Array:
        return (u * v).sum(axis=1) / np.linalg.norm(u, axis=1) / np.linalg.norm(v, axis=1)

    # Leave out triangles at the poles, whose sides have no clear directions.
    middle = np.abs(corners[..., 1]).max(axis=1) < 0.95 if make is make_sphere else slice(None)
    assert (cosines(along, tangents[:, :3])[middle] > 0.99).all()
    assert (cosines(-down, up)[middle] > 0.99).all()
    # Images meet where the sphere closes, and are about as wide as high.
    if make is make_sphere:
        assert mesh.places[:, 0].max() == 3
        ratio = np.linalg.norm(along, axis=1)[middle] / np.linalg.norm(down, axis=1)[middle]
        assert 0.5 < np.median(ratio) / (64 / 48) < 1.3


def test_what_is_not_there_is_not_written(tmp_path: Path) -> None:
    cases: list[tuple[dict[str, Array], set[str], dict[str, float]]] = [
        ({"labels": GREYS.astype(np.int32)}, set(), {"metallicFactor": 0, "roughnessFactor": 0.6}),
        ({"albedo": STONES}, {"basecolor"}, {"metallicFactor": 0}),
        ({"ao": GREYS}, {"orm"}, {"metallicFactor": 0}),
        ({"height": GREYS}, {"normal"}, {"metallicFactor": 0}),
        ({"roughness": GREYS}, {"roughness_metallic"}, {"metallicFactor": 1, "roughnessFactor": 1}),
    ]
    for maps, names, factors in cases:
        document, pictures = check_rules(Material(maps).save_gltf(tmp_path / "a.glb")[0])
        assert set(pictures) == names
        material = document["materials"][0]
        assert factors.items() <= material["pbrMetallicRoughness"].items()
        assert "alphaMode" not in material
        assert ("occlusionTexture" in material) == ("orm" in names)
    assert list(tmp_path.iterdir()) == [tmp_path / "a.glb"]
    # The blue channel, metallic, is 0 if only roughness is known.
    assert (pictures["roughness_metallic"][..., 2] == 0).all()
    soft = np.dstack([STONES, GREYS])
    document, _ = check_rules(Material({"albedo": soft}).save_gltf(tmp_path / "a.glb", shapes=["sphere"])[0])
    assert document["materials"][0]["alphaMode"] == "BLEND"
    assert [node["name"] for node in document["nodes"]] == ["sphere"]
    assert "translation" not in document["nodes"][0]


def test_bumps_of_heights_and_normals_agree(tmp_path: Path) -> None:
    """A slope that rises to the upper right leans to the lower left."""
    rows, columns = np.indices((32, 32))
    bump = np.exp(-((rows - 15.5) ** 2 + (columns - 15.5) ** 2) / 40).astype(np.float32)
    _, pictures = check_rules(Material({"height": bump}).save_gltf(tmp_path / "a.glb")[0])
    normal = pictures["normal"].astype(int)
    assert normal[20, 11, 0] < 118
    assert normal[20, 11, 1] < 118
    assert normal[11, 20, 0] > 137
    assert normal[11, 20, 1] > 137


def test_pictures_of_16_bit(tmp_path: Path) -> None:
    deep = Material({"albedo": STONES.astype(np.uint16) * 257 + 1, "normal": draw_normals("uint16")})
    paths = deep.save_gltf(tmp_path / "a.gltf", depth=16)
    check_rules(paths[0])
    assert (texrs.io.read(tmp_path / "a_basecolor.png") == deep["albedo"].pixels).all()
    normal = texrs.io.read(tmp_path / "a_normal.png").astype(int)
    assert np.abs(normal - deep["normal"].pixels).max() <= 2
    assert [p.read_bytes() for p in paths] == [p.read_bytes() for p in deep.save_gltf(tmp_path / "a.gltf", depth=16)]


@pytest.mark.parametrize(
    ("name", "options", "error", "words"),
    [
        ("a.obj", {}, FileError, "the suffix must be .gltf or .glb"),
        ("none/a.glb", {}, FileError, "does not exist"),
        ("a.glb", {"shapes": []}, InvalidInput, "shapes: must be plane, sphere or both"),
        ("a.glb", {"shapes": ["plane", "plane"]}, InvalidInput, "shapes: must be plane, sphere or both"),
        ("a.glb", {"shapes": ["cube"]}, InvalidInput, "must be one of plane, sphere"),
        ("a.glb", {"repeat": 0}, InvalidInput, "repeat: must be an integer between 1"),
        ("a.glb", {"depth": 32}, InvalidInput, "depth: must be one of 8, 16"),
    ],
)
def test_bad_options_are_refused(name: str, options: dict[str, Any], error: type, words: str, tmp_path: Path) -> None:
    with pytest.raises(error, match=words):
        FULL.save_gltf(tmp_path / name, **options)
    assert not list(tmp_path.iterdir())

"""Conventions of tools: names and packings are read, processed and written, by channel; normals without z."""

import os
import re
from functools import cache
from pathlib import Path

import MaterialX
import numpy as np
import pygltflib
import pytest
from PIL import Image

import texrs
from texrs import Material, SourceMap, io, samples
from texrs._notices import collect
from texrs._typing import Array
from texrs.cli import main
from texrs.errors import InputWarning, InvalidInput
from texrs.io.exr_layers import read_layers
from texrs.materials import Role, guess_role
from texrs.materials._roles import CODED
from texrs.materials.conventions import CONVENTIONS, File, guess_roles, list_conventions
from texrs.source_map.vectors import stores_z

SHAPE = (64, 64)
DOTS = samples.load("dots", size=SHAPE)
GREY = DOTS.image.mean(axis=-1)
HEIGHT = sum(np.roll(GREY, (i, j), (0, 1)) for i in range(-2, 3) for j in range(-2, 3)) / 25 / 255
RANDOM = np.random.default_rng(0)


def draw_normals(*, down: bool, steep: float = 8.0) -> Array:
    """Return the unit normals (x, y, z) of the heights."""
    rows, columns = (np.gradient(np.pad(HEIGHT, 1, "wrap"), axis=axis)[1:-1, 1:-1] * steep for axis in (0, 1))
    normal = np.stack([-columns, -rows if down else rows, np.ones(SHAPE)], axis=-1)
    return normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def encode(values: Array, top: int = 255) -> Array:
    """Return vectors as unsigned integers."""
    return np.rint((values + 1) / 2 * top).astype(np.uint8 if top == 255 else np.uint16)


@cache
def draw_channel(word: str) -> Array:
    """Return a channel of a packed map. Each quantity has its own image."""
    if word in ("x", "y", "-y", "z"):
        return encode(draw_normals(down=word == "-y"))[..., "xyz".index(word[-1])]
    if word == "height":
        return np.rint(HEIGHT * 255).astype(np.uint8)
    if word in CODED:
        return np.where(GREY > 120, 255, np.where(GREY > 60, 230, 10)).astype(np.uint8)
    image = DOTS.image[..., len(word) % 3]
    return np.asarray(image // 2 + len(word), np.uint8)


def draw_file(file: File) -> Array:
    """Return the image of a file of a convention."""
    if file.role.layout:
        return np.stack([draw_channel(word) for word in file.role.layout], axis=-1)
    if file.role is Role.COLOUR and file.opacity:
        return np.dstack([DOTS.image, draw_channel("opacity")])
    return DOTS.image if file.role.coloured else draw_channel(file.role.value)


def write_stack(folder: Path, key: str) -> dict[str, Array]:
    """Write a stack of a convention, and return its images by name."""
    folder.mkdir()
    convention = CONVENTIONS[key]
    pictures = {f"{convention.start}Stone02_1K{file.end}": draw_file(file) for file in convention.files}
    for stem, picture in pictures.items():
        io.write(folder / f"{stem}.png", picture)
    return pictures


def look_up(source: SourceMap, picture: Array, role: Role) -> Array:
    """Look an image up by channel through a source map: vectors are rotated, and codes are not mixed."""
    stack = picture[..., np.newaxis] if picture.ndim == 2 else picture
    row, column = np.moveaxis(np.floor(source.coordinates + np.float32(0.5)).astype(int).clip(0, 63), -1, 0)
    made = np.stack(
        [
            stack[row, column, k] if word in CODED else source.render(np.ascontiguousarray(stack[..., k]))
            for k, word in enumerate(role.layout or ("",) * stack.shape[-1])
        ],
        axis=-1,
    )
    if role.normal:
        count = 2 if role.bare else 3
        vectors = made[..., :count].astype(float) / 127.5 - 1
        if role.bare:
            z = np.sqrt(np.clip(1 - (vectors**2).sum(axis=-1, keepdims=True), 0, None))
            vectors = np.concatenate([vectors, z], axis=-1)
        side = 1 if role.down else -1
        x, y = vectors[..., 0], side * vectors[..., 1]
        frames = source.jacobians().astype(float)
        # The chain rule gives the slope of a surface seen through the map.
        turned = np.stack(
            [
                frames[..., 0, 1] * y + frames[..., 1, 1] * x,
                side * (frames[..., 0, 0] * y + frames[..., 1, 0] * x),
                vectors[..., 2],
            ],
            axis=-1,
        )
        made[..., :count] = encode(turned / np.linalg.norm(turned, axis=-1, keepdims=True))[..., :count]
    return made[..., 0] if picture.ndim == 2 else made


TURNED = texrs.DeformationOptions(rotate=180)


@pytest.mark.parametrize("key", CONVENTIONS)
def test_a_stack_of_each_convention_comes_back_in_register(key: str, tmp_path: Path) -> None:
    pictures = write_stack(tmp_path / "in", key)
    material = Material.read(tmp_path / "in")
    assert [each.file for each in material.values()] == sorted(pictures)
    roles = {f"{CONVENTIONS[key].start}Stone02_1K{file.end}": file.role for file in CONVENTIONS[key].files}
    assert {each.file: each.role for each in material.values()} == roles
    result = texrs.design(material, 64, seed=1, deformation=TURNED, screening=None)
    frames = result.source_map.jacobians()
    assert (np.degrees(np.arctan2(frames[..., 1, 0], frames[..., 0, 0])) > 20).mean() > 0.02
    assert result.material is not None
    for how in ({}, {"convention": key}):
        files = result.material.save(tmp_path / f"out{len(how)}", **how)  # type: ignore[arg-type]
        assert sorted(f.stem for f in files) == sorted(pictures)
        for file in files:
            expected = look_up(result.source_map, pictures[file.stem], roles[file.stem])
            # The last bit of a rotated vector may differ, because halves are rounded.
            assert np.abs(io.read(file).astype(int) - expected).max() <= (1 if roles[file.stem].normal else 0), (
                file.stem
            )


def test_the_guide_shows_the_table() -> None:
    guide = Path(__file__).parents[1] / "docs/guides/materials.md"
    assert list_conventions() in guide.read_text()


@pytest.mark.parametrize("key", CONVENTIONS)
def test_all_conventions_are_written_from_single_maps(key: str, tmp_path: Path) -> None:
    single = {
        "Rock_2K_Color": DOTS.image,
        "Rock_2K_NormalGL": encode(draw_normals(down=False)),
        "Rock_2K_Displacement": draw_channel("height"),
        "Rock_2K_Roughness": draw_channel("roughness"),
        "Rock_2K_Metalness": np.where(GREY > 100, 255, 0).astype(np.uint8),
        "Rock_2K_AmbientOcclusion": draw_channel("occlusion"),
        "Rock_2K_Opacity": draw_channel("opacity"),
        "Rock_2K_Emission": DOTS.image // 3,
        "Rock_2K_mask": GREY > 100,
    }
    (tmp_path / "in").mkdir()
    for stem, picture in single.items():
        io.write(tmp_path / "in" / f"{stem}.png", picture)
    convention = CONVENTIONS[key]
    Material.read(tmp_path / "in").save(tmp_path / "out", convention=key)
    found = {f.stem: io.read(f) for f in (tmp_path / "out").iterdir()}
    assert ((found.pop("Rock_2K_mask") > 0) == single["Rock_2K_mask"]).all()
    known = {f"{convention.start}Rock_2K{file.end}": file for file in convention.files}
    wanted = {"Rock_2K_Displacement"} if not any("height" in f.role.quantities for f in convention.files) else set()
    assert set(found) <= set(known) | wanted
    assert wanted <= set(found)
    words = {
        "x": single["Rock_2K_NormalGL"][..., 0],
        "y": single["Rock_2K_NormalGL"][..., 1],
        "-y": 255 - single["Rock_2K_NormalGL"][..., 1],
        "z": single["Rock_2K_NormalGL"][..., 2],
        "height": single["Rock_2K_Displacement"],
        "roughness": single["Rock_2K_Roughness"],
        "smoothness": 255 - single["Rock_2K_Roughness"],
        "metallic": single["Rock_2K_Metalness"],
        "reflectance": np.where(GREY > 100, 255, 10),
        "occlusion": single["Rock_2K_AmbientOcclusion"],
        "opacity": single["Rock_2K_Opacity"],
        "detail": np.zeros(SHAPE),
        "porosity": np.zeros(SHAPE),
    }
    seen = set()
    for stem, file in known.items():
        if stem not in found:
            continue
        picture = found[stem]
        if file.role is Role.COLOUR:
            assert (picture[..., :3] == DOTS.image).all()
            assert picture.shape[-1] == (4 if file.opacity else 3)
            assert not file.opacity or (picture[..., 3] == single["Rock_2K_Opacity"]).all()
            seen |= {"opacity"} if file.opacity else set()
            continue
        channels = picture[..., np.newaxis] if picture.ndim == 2 else picture
        for k, word in enumerate(file.role.layout or (file.role.value,)):
            if word in words:
                assert (channels[..., k] == words[word]).all(), (stem, word)
        seen |= set(file.role.quantities)
    assert {"normal", "opacity", "occlusion"} <= seen
    # Reading the written files and writing them again loses nothing.
    again = Material.read(tmp_path / "out")
    again.save(tmp_path / "back", convention="ambientcg")
    for stem in ("Color", "Roughness", "Metalness", "AmbientOcclusion", "Displacement"):
        assert (io.read(tmp_path / f"back/Rock_2K_{stem}.png") == single[f"Rock_2K_{stem}"]).all(), stem
    normals = next(f for f in (tmp_path / "back").iterdir() if "Normal" in f.stem)
    back = io.read(normals).astype(int) - single["Rock_2K_NormalGL"] * np.array([1, 1, 1])
    if "DX" in normals.stem:
        back[..., 1] = io.read(normals)[..., 1].astype(int) + single["Rock_2K_NormalGL"][..., 1] - 255
    assert np.abs(back).max() <= 1


# --- names -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "role"),
    [
        ("car_occlusionRoughnessMetallic", Role.ORM),
        ("car_metallicRoughness", Role.METALLIC_ROUGHNESS),
        ("car_AlbedoTransparency", Role.COLOUR),
        ("car_MetallicSmoothness", Role.METALLIC_SMOOTHNESS),
        ("car_MaskMap", Role.MASK_MAP),
        ("car_BaseMap", Role.COLOUR),
        ("car_smoothness", Role.SMOOTHNESS),
        ("wood_gloss_2k", Role.SMOOTHNESS),
        ("metallic_paint_color", Role.COLOUR),
        ("metallic_paint_roughness", Role.ROUGHNESS),
        ("color_wall_normal", Role.NORMAL),
        ("rock_normal_map", Role.NORMAL),
        ("Rock_Normal_DirectX", Role.NORMAL_DX),
        ("Rock_Mixed_AO", Role.OCCLUSION),
        ("brick_diff_v2", Role.COLOUR),
        ("metallic_paint", None),
        ("metallic_paint_preview", None),
        ("T_Rock_N", None),
    ],
)
def test_the_last_word_of_a_name_decides(name: str, role: Role | None) -> None:
    assert guess_role(name) is role


@pytest.mark.parametrize(
    ("names", "roles"),
    [
        (["T_Rock_D", "T_Rock_N"], [Role.COLOUR, Role.NORMAL_DX]),
        (["T_Rock_BC", "T_Rock_ORM", "T_Rock_M", "T_Rock_AO"], [Role.COLOUR, Role.ORM, Role.METALLIC, Role.OCCLUSION]),
        (["rock_D", "rock_N", "rock_R"], [Role.COLOUR, Role.NORMAL, Role.ROUGHNESS]),
        (["plan_b", "plan_n"], [None, None]),
        (["shot_a", "shot_b", "shot_c", "shot_d", "shot_e"], [None] * 5),
        (["vitamin_d"], [None]),
        (["stone", "stone_n", "stone_s"], [Role.COLOUR, Role.LABPBR_NORMAL, Role.LABPBR_SPECULAR]),
        (["stone", "stone_n"], [Role.COLOUR, Role.NORMAL]),
        (["rock", "rock_normal", "rock_rough"], [Role.COLOUR, Role.NORMAL, Role.ROUGHNESS]),
        (["Rock", "Rock_Color", "Rock_NormalGL"], [None, Role.COLOUR, Role.NORMAL]),
        (["metallic_paint_color", "metallic_paint_preview"], [Role.COLOUR, None]),
        (["rock_albedo_wet", "rock_normal"], [Role.COLOUR, Role.NORMAL]),
        (["rock_color", "rock_color_chart"], [Role.COLOUR, None]),
    ],
)
def test_short_ends_count_if_the_folder_makes_them_clear(names: list[str], roles: list[Role | None]) -> None:
    found, why = guess_roles(names)
    assert [found.get(name) for name in names] == roles
    assert all(name in why for name in names if name in found and guess_role(name) is None)


def test_what_no_name_says_alone_is_reported(tmp_path: Path) -> None:
    write_stack(tmp_path / "in", "unreal")
    said = Material.read(tmp_path / "in").notices.assumed
    assert "T_Stone02_1K_D: read as colour (a name of Unreal)" in said
    assert "T_Stone02_1K_N: read as normal-dx (a name of Unreal)" in said


def test_names_come_back_as_they_came(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("tiles").mkdir()
    io.write("tiles/Tiles036_1K_Color.jpg", DOTS.image)
    io.write("tiles/Tiles036_1K_Roughness.jpg", DOTS.image[..., 0])
    assert main(["tile", "tiles", "-o", "out", "-q"]) == 0
    assert sorted(p.name for p in Path("out").iterdir()) == ["Tiles036_1K_Color.png", "Tiles036_1K_Roughness.png"]
    assert list(Material.read("tiles")) == ["Color", "Roughness"]
    assert main(["tile", "tiles", "-o", "packed", "-q", "--pack", "orm", "--mipmaps", "small"]) == 0
    assert sorted(p.name for p in Path("packed").iterdir()) == ["Tiles036_1K_Color.png", "Tiles036_1K_orm.png"]
    assert "Tiles036_1K_orm.1.png" in {p.name for p in Path("small").iterdir()}
    assert main(["tile", "tiles", "-o", "unity", "-q", "--convention", "urp"]) == 0
    assert sorted(p.name for p in Path("unity").iterdir()) == [
        "Tiles036_1K_AlbedoTransparency.png",
        "Tiles036_1K_MetallicSmoothness.png",
    ]
    assert (
        io.read("unity/Tiles036_1K_MetallicSmoothness.png")[..., 3] == 255 - io.read("out/Tiles036_1K_Roughness.png")
    ).all()
    assert main(["rerun", "unity", "-q"]) == 0


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("design in -o new --convention maya", "--convention: must be one of ambientcg, polyhaven, gltf,"),
        ("design in -o new --convention gltf --pack orm", "--pack: cannot be combined with --convention"),
        ("design in/a_color.png -o new.png --convention gltf", "--convention: only available for materials"),
        ("design in -o new.exr --convention gltf", "--out: must be a folder with --depth"),
    ],
)
def test_bad_conventions_are_refused(
    words: str, says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("in").mkdir()
    io.write("in/a_color.png", DOTS.image)
    io.write("in/a_height.png", DOTS.image[..., 0])
    assert main([*words.split(), "-q"]) == 2
    assert says in capsys.readouterr().err
    assert not Path("new").exists()


def test_bad_conventions_are_refused_in_python(tmp_path: Path) -> None:
    dots = Material({"albedo": DOTS.image})
    with pytest.raises(InvalidInput, match="^pack: cannot be combined"):
        dots.save(tmp_path, convention="gltf", pack="orm")


# --- normals without z -----------------------------------------------------------------------------------------------

XY = encode(draw_normals(down=True))[..., :2]
HELD = {
    "two channels": XY,
    "B = 255": np.dstack([XY, np.full(SHAPE, 255, np.uint8)]),
    "B = 0": np.dstack([XY, np.zeros(SHAPE, np.uint8)]),
    "labPBR": np.dstack([XY, draw_channel("occlusion"), draw_channel("height")]),
    "A = height": np.dstack([encode(draw_normals(down=True)), draw_channel("height")]),
}


@pytest.mark.parametrize("held", HELD)
@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32"])
def test_normals_turn_by_x_and_y_and_the_rest_stays(held: str, dtype: str) -> None:
    picture = HELD[held]
    stored = {"uint8": picture, "uint16": picture.astype(np.uint16) * 257}.get(dtype, np.float32(picture / 255))
    material = Material({"albedo": DOTS.image, "n": stored}, roles={"n": "normal-dx"})
    bare = held != "A = height"
    assert material["n"].role is (Role.NORMAL_DX_XY if bare else Role.NORMAL_DX)
    result = texrs.design(material, 64, seed=1, deformation=TURNED, screening=None)
    assert result.material is not None
    made = result.material["n"].pixels
    unit = made if dtype == "float32" else made / np.iinfo(dtype).max
    role = Role.LABPBR_NORMAL if held == "labPBR" else material["n"].role
    fixed = look_up(result.source_map, picture, role) / 255 if picture.shape[-1] <= len(role.layout) else None
    if fixed is not None:
        assert np.abs(unit - fixed).max() < 2.5 / 255
    for channel in range(2 if bare else 3, picture.shape[-1]):
        plain = result.source_map.render(np.ascontiguousarray(stored[..., channel]))
        assert (made[..., channel] == plain).all()
    # `texrs.apply` and `SourceMap.render` give the same result for arrays.
    again = texrs.apply(result.source_map, stored, map_type="normal", green="down")
    assert (again[..., :2] == made[..., :2]).all()
    assert (result.source_map.render(stored, map_type="normal", green="down") == again).all()


@pytest.mark.parametrize("held", ["two channels", "B = 255", "labPBR"])
def test_seams_of_normals_without_z_are_blended_as_those_with_z(held: str) -> None:
    full = Material({"albedo": DOTS.image, "normal_dx": encode(draw_normals(down=True))})
    bare = Material({"albedo": DOTS.image, "normal_dx": HELD[held]}, weights={"normal_dx": 0})
    source = texrs.design(DOTS.image, 64, seed=1, deformation=TURNED).source_map
    wanted, made = full.apply(source)["normal_dx"].pixels, bare.apply(source)["normal_dx"].pixels
    assert np.abs(wanted[..., :2].astype(int) - made[..., :2]).max() <= 2
    if held == "B = 255":
        assert (made[..., 2] == 255).all()


@pytest.mark.parametrize(
    ("third", "stored"),
    [
        (encode(draw_normals(down=False))[..., 2], True),
        (
            (encode(draw_normals(down=False))[..., 2] + RANDOM.integers(-3, 4, SHAPE)).clip(0, 255).astype(np.uint8),
            True,
        ),
        (np.full(SHAPE, 255, np.uint8), False),
        (np.zeros(SHAPE, np.uint8), False),
        (encode(draw_normals(down=False))[::-1, :, 2], False),
        (np.rint(230 + 20 * HEIGHT).astype(np.uint8), False),
        (RANDOM.integers(240, 256, SHAPE).astype(np.uint8), False),
    ],
)
def test_the_length_of_vectors_shows_whether_z_is_stored(third: Array, stored: bool) -> None:
    picture = np.dstack([encode(draw_normals(down=False))[..., :2], third])
    assert stores_z([picture]) is stored
    assert stores_z([picture.astype(np.float32) / 255]) is stored
    assert Material({"normal": picture})["normal"].role is (Role.NORMAL if stored else Role.NORMAL_XY)
    said = Material({"normal": picture}).notices.assumed
    assert (
        "normal: read as normals without z (vectors with channel 3 do not have unit length); channel 3 stays as it is"
        in said
    ) is (not stored)


def test_four_channels_beside_their_colours_are_those_of_labpbr(tmp_path: Path) -> None:
    io.write(tmp_path / "stone.png", DOTS.image)
    io.write(tmp_path / "stone_n.png", HELD["labPBR"])
    material = Material.read(tmp_path)
    assert {each.file: each.role for each in material.values()} == {
        "stone": Role.COLOUR,
        "stone_n": Role.LABPBR_NORMAL,
    }
    assert (
        "stone_n: read as labpbr-normal (its four channels do not store z, and stone exists)"
        in material.notices.assumed
    )
    io.write(tmp_path / "stone_n.png", encode(draw_normals(down=True)))
    assert {each.role for each in Material.read(tmp_path).values()} == {Role.COLOUR, Role.NORMAL_DX}
    assert {e.role for e in Material.read(tmp_path, roles={"stone_n": "normal-xy"}).values()} == {
        Role.COLOUR,
        Role.NORMAL_XY,
    }


def test_flat_normals_are_stored_with_z() -> None:
    flat = np.full((8, 8, 3), (128, 128, 255), np.uint8)
    assert stores_z([flat])
    assert Material({"normal": flat}).notices.assumed == []


@pytest.mark.parametrize("down", [False, True])
@pytest.mark.parametrize("height", [False, True])
@pytest.mark.parametrize("bare", [False, True])
def test_the_surface_shows_whether_y_is_up(down: bool, height: bool, bare: bool, tmp_path: Path) -> None:
    normal = encode(draw_normals(down=down))
    io.write(
        tmp_path / "rock_normal.png",
        np.dstack([XY * 0 + normal[..., :2], np.full(SHAPE, 255, np.uint8)]) if bare else normal,
    )
    io.write(tmp_path / "rock_albedo.png", DOTS.image)
    if height:
        # A map of depths determines the direction of y as well as a map of heights.
        io.write(tmp_path / "rock_height.png", 255 - draw_channel("height"))
    material = Material.read(tmp_path)
    assert material["normal"].role.down is down
    side, shown = ("down" if down else "up"), "the heights, in which white is deep," if height else "the slopes"
    assert f"rock_normal: read as normals with y {side}, as {shown} show" in material.notices.assumed


def test_what_is_stated_is_not_overridden_but_said(tmp_path: Path) -> None:
    io.write(tmp_path / "rock_normal_gl.png", encode(draw_normals(down=True)))
    io.write(tmp_path / "rock_height.png", draw_channel("height"))
    for roles, how in (({}, "its name says so"), ({"rock_normal_gl": "normal"}, "its role is stated")):
        material = Material.read(tmp_path, roles=roles)
        assert material["normal_gl"].role is Role.NORMAL
        assert material.notices.assumed == [
            f"rock_normal_gl: read as normals with y up, because {how}; the heights show y down"
        ]


def test_what_nothing_shows_is_up(tmp_path: Path) -> None:
    flat = np.full((8, 8, 3), (128, 128, 255), np.uint8)
    io.write(tmp_path / "rock_normal.png", flat)
    material = Material.read(tmp_path)
    assert material.notices.assumed == ["rock_normal: read as normals with y up, nothing shows the contrary"]


def test_normals_of_volumes_need_z() -> None:
    with pytest.raises(InvalidInput, match="normals of a volume must have x, y and z, got 2 channels"):
        Material({"normal": np.zeros((4, 4, 4, 2), np.uint8)}, axes=3)


# --- what renderers get ----------------------------------------------------------------------------------------------


def test_gltf_gets_plain_maps_of_packed_ones(tmp_path: Path) -> None:
    for key in ("hdrp", "labpbr", "urp"):
        write_stack(tmp_path / key, key)
        path = Material.read(tmp_path / key).save_gltf(tmp_path / f"{key}.gltf")[0]
        scene = pygltflib.GLTF2().load(str(path))
        assert scene is not None
        pictures = {i.name: np.array(Image.open(tmp_path / i.uri)) for i in scene.images}
        assert scene.materials[0].pbrMetallicRoughness.metallicRoughnessTexture is not None
        orm = pictures["orm"]
        assert (orm[..., 0] == draw_channel("occlusion")).all()
        assert (orm[..., 1] == 255 - draw_channel("smoothness")).all()
        metal = draw_channel("metallic") if key != "labpbr" else np.where(draw_channel("reflectance") >= 230, 255, 0)
        assert (orm[..., 2] == metal).all()
        wanted = encode(draw_normals(down=False))
        assert np.abs(pictures["normal"].astype(int) - wanted).max() <= 2
        assert (pictures["basecolor"][..., 3] == draw_channel("opacity")).all()


def test_materialx_gets_plain_maps_of_packed_ones(tmp_path: Path) -> None:
    for key in ("hdrp", "labpbr", "urp"):
        write_stack(tmp_path / key, key)
        path = Material.read(tmp_path / key).save_materialx(tmp_path / f"{key}.mtlx")[0]
        document = MaterialX.createDocument()
        MaterialX.readFromXmlFile(document, str(path))
        images = {
            node.getName(): io.read(path.parent / node.getInput("file").getValueString())
            for graph in document.getNodeGraphs()
            for node in graph.getNodes("image")
        }
        assert (images["roughness_image"] == 255 - draw_channel("smoothness")).all()
        assert {"metallic_image", "normal_image", "colour_image"} <= set(images)
        assert np.abs(images["normal_image"].astype(int) - encode(draw_normals(down=False))).max() <= 2
        assert "emission_image" in images


def test_what_is_shown_of_packed_maps_is_what_is_shown_of_plain_ones(tmp_path: Path) -> None:
    plain = Material(
        {
            "albedo": DOTS.image,
            "normal_dx": encode(draw_normals(down=True)),
            "roughness": 255 - draw_channel("smoothness"),
            "metallic": draw_channel("metallic"),
            "ao": draw_channel("occlusion"),
        }
    )
    mask = np.stack([draw_channel(word) for word in Role.MASK_MAP.layout], axis=-1)
    packed = Material({"albedo": DOTS.image, "normal_dx": XY, "mask_map": mask})
    difference = np.abs(plain.preview().astype(int) - packed.preview())
    assert difference.mean() < 0.5
    assert difference.max() <= 8
    # Plain and packed maps also have the same features for decisions.
    for one, other in zip(plain.features()[1:2], packed.features()[1:2], strict=True):
        assert (one == other).all()


def test_smaller_copies_keep_codes_and_channels(tmp_path: Path) -> None:
    write_stack(tmp_path / "in", "labpbr")
    files = Material.read(tmp_path / "in").save(tmp_path / "out", mipmaps=True)
    half = {f.stem: io.read(f) for f in files if f.stem.endswith(".1")}
    codes, normal = half["Stone02_1K_s.1"], half["Stone02_1K_n.1"]
    assert set(np.unique(codes[..., 1:])) <= {10, 230, 255}
    for channel, word in ((2, "occlusion"), (3, "height")):
        mean = draw_channel(word).reshape(32, 2, 32, 2).mean(axis=(1, 3))
        assert np.abs(normal[..., channel] - mean).max() <= 1
    vectors = draw_normals(down=True).reshape(32, 2, 32, 2, 3).mean(axis=(1, 3))
    vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
    assert np.abs(normal[..., :2] - encode(vectors)[..., :2].astype(int)).max() <= 2


def test_what_has_no_file_is_a_map_of_its_own_or_reported(tmp_path: Path) -> None:
    write_stack(tmp_path / "in", "labpbr")
    material = Material.read(tmp_path / "in")
    files = {f.stem.removeprefix("Stone02_1K_"): io.read(f) for f in material.save(tmp_path / "out", convention="gltf")}
    assert set(files) == {"baseColor", "normal", "occlusionRoughnessMetallic", "emissive", "height", "porosity"}
    assert (files["height"] == draw_channel("height")).all()
    assert (files["porosity"] == draw_channel("porosity")).all()
    bare = Material({"albedo": DOTS.image, "normal_dx": HELD["labPBR"]})
    with pytest.warns(InputWarning, match=r"normal_dx: channels 3 and 4 are not written, because Unreal has no file"):
        bare.save(tmp_path / "again", convention="unreal")


def test_a_quantity_that_two_maps_have_is_not_lost(tmp_path: Path) -> None:
    write_stack(tmp_path / "in", "labpbr")
    io.write(tmp_path / "in" / "Stone02_1K_emissive.png", DOTS.image)
    io.write(tmp_path / "in" / "Stone02_1K_diffuse.png", DOTS.image[::-1])
    material = Material.read(tmp_path / "in", roles={"Stone02_1K": "colour"})
    files = {f.stem: io.read(f) for f in material.save(tmp_path / "out", convention="labpbr")}
    assert (files["Stone02_1K_emissive"] == DOTS.image).all()
    assert (files["Stone02_1K_diffuse"] == DOTS.image[::-1]).all()


def test_what_no_map_holds_is_written_as_usual_and_said(tmp_path: Path) -> None:
    material = Material({"albedo": DOTS.image, "metallic": DOTS.image[..., 0]})
    with collect() as notices:
        material.save(tmp_path, convention="unity")
    assert notices.assumed == [
        "MetallicSmoothness: some of its quantities have no map, so it is written with smoothness 0.4"
    ]
    assert (io.read(tmp_path / "MetallicSmoothness.png")[..., 3] == 102).all()


def test_packed_maps_are_taken_apart(tmp_path: Path) -> None:
    write_stack(tmp_path / "in", "labpbr")
    material = Material.read(tmp_path / "in")
    files = {f.stem.removeprefix("Stone02_1K"): io.read(f) for f in material.save(tmp_path / "out", pack="none")}
    assert (files["_ao"] == draw_channel("occlusion")).all()
    assert (files["_height"] == draw_channel("height")).all()
    assert (files["_smoothness"] == draw_channel("smoothness")).all()
    assert (files["_metallic"] == np.where(draw_channel("reflectance") >= 230, 255, 0)).all()
    assert np.abs(files["_n"].astype(int) - encode(draw_normals(down=True))).max() <= 2
    packed = {f.stem.removeprefix("Stone02_1K"): io.read(f) for f in material.save(tmp_path / "orm", pack="orm")}
    assert (packed["_orm"][..., 0] == draw_channel("occlusion")).all()
    assert (packed["_orm"][..., 1] == 255 - draw_channel("smoothness")).all()
    assert (packed["_orm"][..., 2] == files["_metallic"]).all()


def test_a_packed_map_is_applied_as_the_material_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_stack(tmp_path / "in", "hdrp")
    assert main(["design", "in", "-o", "out", "--size", "64x64", "--source-map", "map.npz", "-q"]) == 0
    assert main(["apply", "map.npz", "in/Stone02_1K_MaskMap.png", "-o", "again.png", "-q"]) == 0
    made = io.read("out/Stone02_1K_MaskMap.png")
    assert (io.read("again.png") == made).all()
    assert (texrs.apply(SourceMap.load("map.npz"), "in/Stone02_1K_MaskMap.png") == made).all()


def test_layers_keep_packed_maps(tmp_path: Path) -> None:
    pytest.importorskip("OpenEXR", reason="layers of EXR files need the package")
    write_stack(tmp_path / "in", "labpbr")
    material = Material.read(tmp_path / "in")
    again = Material.read(material.save_exr(tmp_path / "stack.exr"))
    for name, each in material.items():
        assert again[name].role is each.role
        assert (again[name].pixels == each.pixels).all()
    # Channels are numbered, so that no other program mistakes the occlusion for z.
    assert {c for c in read_layers(tmp_path / "stack.exr")[0] if "_n." in c} == {f"1K_n.{k}" for k in range(4)}


def test_the_labpbr_example_of_the_command_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A z that was not stored overwrote B."""
    monkeypatch.chdir(tmp_path)
    Path("in").mkdir()
    io.write("in/stone_albedo.png", DOTS.image)
    io.write("in/stone_n.png", np.dstack([XY, draw_channel("height") // 2, draw_channel("height")]))
    words = ["design", "in", "-o", "out", "--role", "stone_n=normal-dx", "--rotate", "180", "-q"]
    assert main(words) == 0
    made = io.read("out/stone_n.png")
    assert np.abs(made[..., 2] - made[..., 3] / 2).mean() < 1
    assert np.corrcoef(made[..., 2].ravel(), made[..., 3].ravel())[0, 1] > 0.98
    said = Material.read("in", roles={"stone_n": "normal-dx"}).notices.assumed
    assert any(re.match("stone_n: read as normals without z .* channels 3 and 4 stay as they are", s) for s in said)
    assert os.listdir("out")


@pytest.mark.parametrize(("z", "quality", "sampling"), [(True, 75, 2), (True, 90, 0), (False, 75, 2)])
def test_normals_in_jpeg_files_have_the_z_of_their_x_and_y(
    z: bool, quality: int, sampling: int, tmp_path: Path
) -> None:
    slopes = np.random.default_rng(2).normal(0, 0.3, (66, 66, 2))
    slopes = sum(np.roll(slopes, (i, j), (0, 1))[:64, :64] for i in range(3) for j in range(3)) / 9
    vectors = np.dstack([slopes, np.ones((64, 64))])
    stored = encode(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))
    assert stores_z([stored])
    if not z:
        stored[..., 2] = 255
    io.write(tmp_path / "rock_Color.png", DOTS.image)
    Image.fromarray(stored).save(tmp_path / "rock_NormalGL.jpg", quality=quality, subsampling=sampling)
    material = Material.read(tmp_path)
    assert material["NormalGL"].role is (Role.NORMAL if z else Role.NORMAL_XY)
    said = "rock_NormalGL.jpg: z of the normals is computed from x and y, because JPEG has changed it"
    assert (said in material.notices.assumed) is z
    assert (material["NormalGL"].pixels[..., :2] == io.read(tmp_path / "rock_NormalGL.jpg")[..., :2]).all()

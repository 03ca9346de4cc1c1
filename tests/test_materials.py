"""Materials: roles by name, maps used for decisions, and every map through one source map in every verb."""

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

import texrs
from texrs import Material, Synthesis, io, samples
from texrs.errors import FileError, InvalidInput
from texrs.materials import Map, Role, guess_role


def make(shape: tuple[int, int] = (64, 80), seed: int = 0) -> Material:
    """Return a material of all dtypes. Its last map contains the coordinates of each pixel."""
    sample = samples.load("pebbles", size=shape, seed=seed)
    height = sample.image[..., 1].astype(np.float32) / 255
    down, right = np.gradient(height * 8)
    normal = np.stack([-right, down, np.ones_like(down)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return Material(
        {
            "albedo": sample.image,
            "normal": np.rint((normal + 1) / 2 * 65535).astype(np.uint16),
            "height": height,
            "roughness": (255 - sample.image[..., 0]).astype(np.uint8),
            "labels": sample.labels.astype(np.int32),
            "place": np.moveaxis(np.indices(shape), 0, -1).astype(np.float32),
        },
        roles={"place": "other"},
        weights={"place": 0},
    )


STONES = make()
FLOOR = samples.load("tilted_discs", size=(96, 112)).image
TILTED = Material({"albedo": FLOOR, "height": FLOOR[..., 0].astype(np.float32)})
HOLE = np.zeros((64, 80), np.bool_)
HOLE[20:40, 30:50] = True
SEEN = texrs.PlaneView(slant=34, fov=60)
DOTS = Material({"albedo": samples.dots((64, 64)).image, "height": samples.dots((64, 64)).image[..., 0]})

VERBS: dict[str, tuple[Callable[[], Synthesis], Material]] = {
    "design": (lambda: texrs.design(STONES, (72, 64)), STONES),
    "design variants": (lambda: next(texrs.design_variants(STONES, 2, 64)), STONES),
    "tile": (lambda: texrs.tile(STONES), STONES),
    "inpaint": (lambda: texrs.inpaint(STONES, HOLE), STONES),
    "synthesize": (lambda: texrs.synthesize(STONES, 64), STONES),
    "perspective": (lambda: texrs.perspective(TILTED, texrs.scale_maps.from_angles((96, 112), 34, 90), 64), TILTED),
    "rectify": (lambda: texrs.rectify(TILTED, view=SEEN), TILTED),
    "extend": (lambda: texrs.extend(TILTED, right=24, view=SEEN), TILTED),
    "remove": (lambda: texrs.remove(TILTED, np.pad(HOLE, ((0, 32), (0, 32))), view=SEEN), TILTED),
    "splice": (lambda: texrs.splice(DOTS, DOTS, 72, seed=1), DOTS),
    "self-splice": (lambda: texrs.self_splice(DOTS, "regularise"), DOTS),
}


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_gives_every_map_back(verb: str) -> None:
    call, material = VERBS[verb]
    result = call()
    made = result.material
    assert made is not None
    assert list(made) == list(material)
    for name, each in made.items():
        assert each.pixels.dtype == material[name].pixels.dtype, name
        assert each.pixels.shape[:2] == result.source_map.shape, name
        assert each.channels == material[name].channels, name
        assert (each.role, each.space) == (material[name].role, material[name].space), name
    assert result.image is made["albedo"].pixels
    assert result.report["maps"]["albedo"] == "colour"
    assert {"guide", "before_blending"} <= result.stages.keys()


def test_maps_stay_in_register_exactly() -> None:
    result = texrs.design(STONES, (72, 64), screening=None)
    assert result.material is not None
    place, labels = result.material["place"].pixels, result.material["labels"].pixels
    whole = (result.source_map.coordinates == np.rint(result.source_map.coordinates)).all(axis=-1)
    assert whole.any()
    assert (place[whole] == result.source_map.coordinates[whole]).all()
    # Labels are never mixed: each is the label of the nearest pixel.
    row, column = np.floor(result.source_map.coordinates + np.float32(0.5)).astype(int).reshape(-1, 2).T
    row, column = np.clip(row, 0, 63), np.clip(column, 0, 79)
    assert (labels.ravel() == STONES["labels"].pixels[row, column]).all()


@pytest.mark.parametrize(("plan", "most"), [("still", 1.5), ("move", 6)])
def test_normals_turn_and_keep_their_length(plan: Literal["still", "move"], most: float) -> None:
    # The correction of seams changes both maps a little, so leave it out.
    turned = texrs.DeformationOptions(allow_mirror=True)
    made = texrs.design(STONES, 96, way=plan, deformation=turned, screening=None).material
    assert made is not None
    vectors = made["normal"].pixels.astype(np.float64) / 65535 * 2 - 1
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=-1), 1, atol=2e-3)
    # Away from seams, the normals still fit the heights, because both maps were mirrored and rotated.
    down, right = np.gradient(made["height"].pixels * 8)
    expected = np.stack([-right, down, np.ones_like(down)], axis=-1)
    expected /= np.linalg.norm(expected, axis=-1, keepdims=True)
    angles = np.degrees(np.arccos(np.clip((vectors * expected).sum(axis=-1), -1, 1)))
    assert np.median(angles) < most


def test_a_single_map_is_decided_on_as_a_picture() -> None:
    pebbles = samples.pebbles((64, 80)).image
    made = texrs.design(Material({"albedo": pebbles}), 64).material
    assert made is not None
    assert (made["albedo"].pixels == texrs.design(pebbles, 64).image).all()


def test_elements_are_those_of_the_colours_where_these_tell_surely() -> None:
    """The map that decides on fits of patches may show joints better than elements."""
    sample = texrs.samples.dots((96, 96))
    random = np.random.default_rng(3)
    noise = random.random((96, 96, 3), np.float32)
    stones = Material({"albedo": sample.image, "normal": noise}, weights={"normal": 20})
    own, found = texrs.elements.analyse(sample.image), texrs.elements.analyse(stones)
    assert min(own.report["confidence"].values()) > 0.6
    assert (found.points == own.points).all()
    assert (found.image == sample.image).all()
    made = texrs.splice(stones, sample.image, seed=1)
    assert made.material is not None
    assert made.material["normal"].pixels.dtype == np.float32
    with pytest.raises(InvalidInput, match=r"^elements: .*pass a box, points or a mask to texrs.elements.analyse"):
        texrs.splice(
            Material({"albedo": np.full((64, 64, 3), 90, np.uint8), "mask": np.zeros((64, 64), bool)}), sample.image
        )


def test_several_materials_are_mixed() -> None:
    other = make(seed=5)
    result = texrs.design([STONES, other], 96, weights=[0.5, 0.5])
    assert result.material is not None
    assert len(result.source_map.shapes) == 2
    assert result.material["normal"].pixels.shape == (96, 96, 3)
    filled = texrs.inpaint(STONES, HOLE, exemplar=other).material
    assert filled is not None
    kept = ~HOLE & (np.abs(filled["height"].pixels - STONES["height"].pixels) == 0)
    assert kept.mean() > 0.5


def test_what_the_albedo_hides_is_decided_on() -> None:
    """Only normals show these grey stones, so decisions differ from those on the grey alone."""
    grey = np.full((64, 80, 3), 128, np.uint8)
    guide = Material({"albedo": grey, "normal": STONES["normal"].pixels}).guide
    assert guide.shape[-1] in (1, 3)
    assert guide.std() > 0.05 * 65535
    assert (
        Material({"albedo": grey, "height": STONES["height"].pixels}, weights={"height": 0}).guide.std() < 1e-3 * 65535
    )


def test_a_volume_of_several_maps() -> None:
    density = samples.load("stripes", size=(32, 32, 32)).image
    material = Material({"density": density, "labels": density[..., 0] > 127}, roles={"density": "other"}, axes=3)
    made = texrs.solid(material, 32, quality="fast").material
    assert made is not None
    assert made["labels"].pixels.shape == (32, 32, 32)
    assert made.axes == 3


@pytest.mark.parametrize(
    ("name", "role"),
    [
        ("albedo", Role.COLOUR),
        ("Rock035_2K_Color", Role.COLOUR),
        ("wood_table_diff_4k", Role.COLOUR),
        ("T_Brick_BaseColor", Role.COLOUR),
        ("fabric_nor_gl_1k", Role.NORMAL),
        ("Rock035_2K_NormalDX", Role.NORMAL_DX),
        ("Rock035_2K_NormalGL", Role.NORMAL),
        ("rock-disp", Role.HEIGHT),
        ("fabricAO", Role.OCCLUSION),
        ("ambient occlusion", Role.OCCLUSION),
        ("x_metalness", Role.METALLIC),
        ("fabric_pattern_07_arm_1k", Role.ORM),
        ("fabric_ORM", Role.ORM),
        ("leaf_opacity", Role.OPACITY),
        ("lamp_emissive", Role.EMISSION),
        ("stone_id", Role.LABELS),
        ("flowmap", Role.VECTOR),
        ("preview", None),
        ("colourful", None),
    ],
)
def test_names_say_roles(name: str, role: Role | None) -> None:
    assert guess_role(name) is role


def test_a_folder_comes_back(tmp_path: Path) -> None:
    paths = STONES.save(tmp_path / "new")
    assert [path.suffix for path in paths] == [".png", ".png", ".exr", ".png", ".tif", ".exr"]
    back = Material.read(tmp_path / "new", roles={"place": "other"})
    assert set(back) == set(STONES)
    for name, each in back.items():
        assert each.pixels.dtype == STONES[name].pixels.dtype
        assert (each.pixels == STONES[name].pixels).all(), name


def test_depths_and_formats_of_files(tmp_path: Path) -> None:
    stones = Material({n: m for n, m in STONES.items() if n in ("albedo", "height")})
    stones.save(tmp_path, depth=16, suffix=".tif")
    assert io.read(tmp_path / "albedo.tif").dtype == io.read(tmp_path / "height.tif").dtype == np.uint16
    assert (io.read(tmp_path / "albedo.tif") == STONES["albedo"].pixels.astype(np.uint16) * 257).all()
    with pytest.raises(InvalidInput, match="depth: must be one of 8, 16, 32; got 12"):
        stones.save(tmp_path, depth=12)  # type: ignore[arg-type]


def test_what_names_do_not_say_is_left_out_and_said(tmp_path: Path) -> None:
    io.write(tmp_path / "rock_albedo.png", STONES["albedo"].pixels)
    io.write(tmp_path / "rock_preview.png", np.zeros((8, 8, 3), np.uint8))
    (tmp_path / "licence.txt").write_text("CC0")
    with pytest.warns(UserWarning, match=r"rock_preview\.png not used"):
        assert list(Material.read(tmp_path)) == ["rock_albedo"]
    with pytest.raises(InvalidInput, match="same size"):
        Material.read(tmp_path, roles={"rock_preview.png": "mask"})
    with pytest.raises(InvalidInput, match="roles: must name images in .*got 'rock'"):
        Material.read(tmp_path, roles={"rock": "mask"})
    (tmp_path / "empty").mkdir()
    with pytest.raises(FileError, match="no image has a name"):
        Material.read(tmp_path / "empty")
    with pytest.raises(FileError, match="must be a folder of maps"):
        Material.read(tmp_path / "licence.txt")


def test_bad_materials_are_refused() -> None:
    picture = STONES["albedo"].pixels
    for maps, options, words in (
        ({}, {}, "maps: must be a mapping"),
        ({"thing": picture}, {}, "thing: the name does not indicate the role"),
        ({"albedo": picture, "height": picture[:-1, :, 0]}, {}, "maps: must all have the same size, but height has"),
        ({"normal": picture[..., 0]}, {}, "normal: a map of role normal must have 2, 3 or 4 channels, got 1"),
        ({"albedo": picture}, {"roles": {"albedo": "shiny"}}, "must be one of"),
        ({"albedo": picture}, {"roles": {"colour": "mask"}}, "roles: must name maps (albedo), got 'colour'"),
        ({"albedo": picture}, {"spaces": {"albedo": "lab"}}, "must be one of srgb, linear"),
        ({"albedo": picture}, {"weights": {"albedo": -1}}, "weights"),
        ({"albedo": picture, "mask": picture}, {"weights": {"albedo": 0, "mask": 0}}, "weights: must not all be 0"),
        ({"albedo": np.zeros((4, 4, 4, 4, 4))}, {}, "albedo: must have shape"),
    ):
        with pytest.raises(InvalidInput) as caught:
            Material(maps, **options)  # type: ignore[arg-type]
        assert words in str(caught.value)
    with pytest.raises(InvalidInput, match="must either all be materials or all be images"):
        texrs.design([STONES, picture], 64)
    with pytest.raises(InvalidInput, match="the same maps"):
        texrs.design([STONES, Material({"albedo": picture})], 64)
    with pytest.raises(InvalidInput, match="the map 'albedo' must have the same role"):
        texrs.design([Material({"albedo": picture}), Material({"albedo": picture.astype(np.uint16)})], 64)


def test_vectors_turn_with_what_they_lie_on() -> None:
    source = texrs.SourceMap.identity((8, 8))
    quarter = np.array([[0, 1], [-1, 0]], np.float32)  # A step down is a step to the left in the exemplar.
    turned = texrs.SourceMap(source.coordinates, source.exemplar, source.label, quarter[np.newaxis], source.shapes)
    flow = np.zeros((8, 8, 2), np.float32)
    flow[..., 0] = -1  # The vectors point to the left, and are not encoded.
    made = Material({"flow": flow}).apply(turned)["flow"].pixels
    np.testing.assert_allclose(made[4, 4], [0, -1], atol=1e-6)  # They point down, because y points up.
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert (Material({"flow": flow}).apply(source)["flow"].pixels == flow).all()


def test_maps_say_what_they_are() -> None:
    each = STONES["albedo"]
    assert repr(each) == "<colour map of 64 x 80 x 3, uint8, srgb>"
    assert (each.depth, STONES["height"].depth, STONES["height"].space) == (8, 32, "linear")
    assert STONES.find("roughness") == "roughness"
    assert STONES.find("opacity") is None
    changed = STONES.replace(albedo=255 - each.pixels)
    assert isinstance(changed["albedo"], Map)
    assert changed["albedo"].role is Role.COLOUR
    with pytest.raises(InvalidInput, match="maps: must name maps of the material .*got 'colour'"):
        STONES.replace(colour=each.pixels)


def test_heights_of_any_range_are_told_apart() -> None:
    """The difference of two heights may exceed single precision. Their halves give the same information."""
    heights = np.linspace(-1, 1, 96, dtype=np.float32).reshape(8, 12) * np.float32(3e38)
    (wide,), (narrow,) = (Material({"height": h}).features() for h in (heights, heights / 4))
    assert np.isfinite(wide).all()
    np.testing.assert_allclose(wide, narrow, atol=1e-6)

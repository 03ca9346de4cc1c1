"""Materials in one EXR file: read back, read by other programs, and files of other programs."""

from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest

from texrs import Material, io
from texrs._colours import decode_srgb
from texrs._typing import Array
from texrs.cli import main
from texrs.errors import FileError, InputWarning, InvalidInput, LimitExceeded
from texrs.io.exr_layers import read_layers
from texrs.materials import Role

RANDOM = np.random.default_rng(7)
SHAPE = (21, 34)


def draw(dtype: str, *channels: int) -> Array:
    kind = np.dtype(dtype)
    if kind.kind == "f":
        return RANDOM.normal(0.3, 1, (*SHAPE, *channels)).astype(kind)
    info = np.iinfo(kind)
    return RANDOM.integers(info.min, info.max, (*SHAPE, *channels), kind, endpoint=True)


def draw_normals(dtype: str) -> Array:
    vectors = RANDOM.normal(0, 1, (*SHAPE, 3)) * [0.3, 0.3, 0] + [0, 0, 1]
    vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.rint((vectors + 1) / 2 * np.iinfo(dtype).max).astype(dtype)


EVERY = Material(
    {
        "albedo": np.maximum(draw("uint8", 4), np.uint8([0, 0, 0, 1])),
        "basecolor": draw("uint16", 3),
        "diffuse": draw("float32", 3),
        "grey": np.maximum(draw("uint8", 2), np.uint8([0, 1])),
        "normal": draw_normals("uint8"),
        "normal_dx": draw_normals("uint16"),
        "nor": draw("float16", 4),
        "height": draw("uint16"),
        "disp": draw("float32", 1),
        "ao": draw("int16"),
        "rough.fine": draw("int8"),
        "arm": draw("uint8", 3),
        "opacity": draw("uint8") > 100,
        "mask": draw("int32"),
        "labels": draw("int32"),
        "id": draw("uint8", 1),
        "ids": draw("uint32"),
        "flow": draw("int8", 2),
        "many": draw("float16", 12),
    },
    roles={"grey": "colour", "many": "other"},
)


def test_every_dtype_comes_back_to_the_bit(tmp_path: Path) -> None:
    path = EVERY.save_exr(tmp_path / "all.exr")
    back = Material.read(path)
    assert set(back) == set(EVERY)
    for name, each in EVERY.items():
        again = back[name]
        assert (again.role, again.space) == (each.role, each.space), name
        assert (again.pixels.dtype, again.pixels.shape) == (each.pixels.dtype, each.pixels.shape), name
        assert (again.pixels == each.pixels).all(), name
    assert path.read_bytes() == EVERY.save_exr(tmp_path / "again.exr").read_bytes()


def test_weights_come_back(tmp_path: Path) -> None:
    stones = Material({"albedo": draw("uint8", 3), "height": draw("uint16")}, weights={"height": 3})
    back = Material.read(stones.save_exr(tmp_path / "a.exr"))
    assert dict(back.weights) == {"height": 3.0}
    assert (back.guide == stones.guide).all()
    assert (back.guide != Material(dict(back)).guide).any()


@pytest.mark.parametrize("dtype", ["uint8", "uint16"])
def test_every_value_of_srgb_comes_back(dtype: str, tmp_path: Path) -> None:
    values = np.arange(np.iinfo(dtype).max + 1).astype(dtype).reshape(16, -1)
    for space in ("srgb", "linear"):
        material = Material({"albedo": values}, spaces={"albedo": space})  # type: ignore[dict-item]
        assert (Material.read(material.save_exr(tmp_path / "a.exr"))["albedo"].pixels == values).all()


def test_other_programs_find_linear_light_by_the_usual_names(tmp_path: Path) -> None:
    path = EVERY.save_exr(tmp_path / "all.exr")
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = {name: channel.pixels for name, channel in file.channels().items()}
    names = {name.rpartition(".")[0]: set() for name in channels}
    for name in channels:
        names[name.rpartition(".")[0]].add(name.rpartition(".")[2])
    assert names["albedo"] == set("RGBA")
    assert names["normal_dx"] == set("XYZ")
    assert names["height"] == names["labels"] == {"Y"}
    assert names["many"] == {str(k) for k in range(12)}
    assert (channels["albedo.G"].dtype, channels["height.Y"].dtype) == (np.float16, np.float32)
    assert channels["labels.Y"].dtype == np.uint32
    red = EVERY["basecolor"].pixels[..., 0]
    np.testing.assert_allclose(channels["basecolor.R"], decode_srgb(red / np.float32(65535)), atol=1e-6)
    np.testing.assert_allclose(channels["albedo.A"], EVERY["albedo"].pixels[..., 3] / 255, atol=3e-4)
    np.testing.assert_allclose(channels["normal.X"], EVERY["normal"].pixels[..., 0] / 127.5 - 1, atol=5e-4)


def test_a_depth_that_is_asked_for(tmp_path: Path) -> None:
    stones = Material({"albedo": draw("uint8", 3), "height": draw("float64"), "labels": draw("int32")})
    with pytest.raises(InvalidInput, match="height: float64 cannot be stored in EXR without loss; pass depth=32"):
        stones.save_exr(tmp_path / "a.exr")
    assert not list(tmp_path.iterdir())
    for depth, dtype in ((16, np.float16), (32, np.float32)):
        back = Material.read(stones.save_exr(tmp_path / "a.exr", depth=depth))  # type: ignore[arg-type]
        assert back["albedo"].pixels.dtype == back["height"].pixels.dtype == dtype
        assert back["albedo"].space == "linear"
        assert (back["labels"].pixels == stones["labels"].pixels).all()
        linear = decode_srgb(stones["albedo"].pixels / np.float32(255))
        np.testing.assert_allclose(back["albedo"].pixels, linear, atol=1e-3)
    with pytest.raises(InvalidInput, match="depth: must be one of 16, 32; got 8"):
        stones.save_exr(tmp_path / "a.exr", depth=8)  # type: ignore[arg-type]


def write(path: Path, parts: list[tuple[dict[str, Any], dict[str, Array]]]) -> Path:
    head = {"type": OpenEXR.scanlineimage}
    if len(parts) == 1:
        OpenEXR.File(head | parts[0][0], parts[0][1]).write(str(path))
    else:
        OpenEXR.File([OpenEXR.Part(head | h, c, h["name"]) for h, c in parts]).write(str(path))
    return path


def test_files_of_other_programs_are_read_by_names(tmp_path: Path) -> None:
    one = draw("float32")
    colours = {"R": one, "G": one + 1, "B": one + 2, "A": one * 0 + 1}
    normals = {f"Stone.Normal.{letter}": one + k for k, letter in enumerate("XYZ")}
    path = write(tmp_path / "a.exr", [({}, {**{f"Stone.Color.{k}": v for k, v in colours.items()}, **normals})])
    back = Material.read(path)
    assert {name: each.role for name, each in back.items()} == {"Color": Role.COLOUR, "Normal": Role.NORMAL}
    assert (back["Color"].pixels == np.stack(list(colours.values()), axis=-1)).all()
    assert (back["Normal"].pixels[..., 2] == one + 2).all()
    # A part whose channels do not have a layer is an image. Other parts are layers.
    parts = [({"name": "colour"}, colours), ({"name": "height"}, {"Z": one.astype(np.float16)})]
    back = Material.read(write(tmp_path / "b.exr", parts))
    assert back["height"].pixels.dtype == np.float16
    assert back["height"].pixels.ndim == 2
    plain = Material.read(write(tmp_path / "c.exr", [({}, {**colours, "depth.V": one})]), roles={"depth": "height"})
    assert {name: each.role for name, each in plain.items()} == {"colour": Role.COLOUR, "depth": Role.HEIGHT}
    with pytest.raises(InvalidInput, match="roles: must name layers of .*got 'deep'"):
        Material.read(tmp_path / "c.exr", roles={"deep": "height"})
    with pytest.raises(FileError, match="no layer has a name"):
        Material.read(write(tmp_path / "d.exr", [({}, {"grace.V": one, "glory.V": one})]))


def write_render(path: Path) -> Path:
    """Write a file like Blender: all layers begin with the name of the view layer."""
    one = draw("float32")
    passes = {"Combined": "RGBA", "Depth": "Z", "Normal": "XYZ", "DiffCol": "RGB", "Mist": "Z", "IndexOB": "X"}
    passes |= {"Vector": "XYZW", "UV": "UVA", "CryptoObject00": "rgba", "Puddles": "RGB"}
    return write(path, [({}, {f"ViewLayer.{name}.{k}": one for name, letters in passes.items() for k in letters})])


def test_every_layer_of_a_render_is_used_or_reported(tmp_path: Path) -> None:
    path = write_render(tmp_path / "render.exr")
    with pytest.warns(InputWarning) as caught:
        back = Material.read(path)
    assert {name: (each.role.value, each.channels) for name, each in back.items()} == {
        "Combined": ("colour", 4),
        "Depth": ("other", 1),
        "DiffCol": ("colour", 3),
        "IndexOB": ("labels", 1),
        "Mist": ("other", 1),
        "Normal": ("normal", 3),
        "UV": ("other", 3),
        "Vector": ("other", 4),
    }
    assert [str(warning.message) for warning in caught] == back.notices.ignored
    assert back.notices.ignored == [
        f"{path}: CryptoObject00 not used: Cryptomatte is not read",
        f"{path}: Puddles not used: the name gives no role",
    ]
    assert back.notices.assumed == [
        f"{path}: Combined: colours are not divided by alpha, because pixels with an alpha of 0 are not black",
        f"{path}: Depth, Mist read as other, because a distance from the camera is not a height",
        f"{path}: IndexOB read as labels",
        f"{path}: Normal read as tangent-space normals with y up, although normals of a render are in world space",
    ]
    assert back.base_name == "Combined"
    with pytest.warns(InputWarning):
        stated = Material.read(path, roles={"Depth": "height", "Normal": "vector"})
    assert stated["Depth"].role is Role.HEIGHT
    assert stated.notices.assumed[1:] == [
        f"{path}: IndexOB read as labels",
        f"{path}: Mist read as other, because a distance from the camera is not a height",
    ]


def test_a_sky_at_infinity_is_reported(tmp_path: Path) -> None:
    one = draw("float32")
    path = write(tmp_path / "a.exr", [({}, {"L.Color.R": one, "L.Depth.Z": np.where(one > 0.5, np.inf, one)})])
    with pytest.warns(InputWarning, match="Depth not used: it contains infinite values"):
        assert list(Material.read(path)) == ["Color"]


def test_channels_beside_a_picture_are_no_part_of_it(tmp_path: Path) -> None:
    """A depth next to R, G and B is not transparency, and reading an image reports that it is not used."""
    one = draw("float32")
    path = write(tmp_path / "a.exr", [({}, {"R": one, "G": one, "B": one, "Z": one})])
    back = Material.read(path)
    assert {name: (each.role.value, each.channels) for name, each in back.items()} == {
        "colour": ("colour", 3),
        "Z": ("other", 1),
    }
    with pytest.warns(InputWarning, match="Z not used, because these channels are not part of the image"):
        assert io.read(path).shape[2] == 3
    io.read(write(tmp_path / "b.exr", [({}, {"R": one, "G": one, "B": one, "A": one})]))
    io.read(write(tmp_path / "c.exr", [({}, {"Z": one})]))


def test_a_command_takes_layers_beside_a_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one = draw("float32")
    path = write(tmp_path / "a.exr", [({}, {"R": one, "G": one, "B": one, "height.Y": one})])
    assert main(["design", str(path), "--size", "16x16", "-o", str(tmp_path / "out")]) == 0
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["colour.exr", "height.exr"]
    assert main(["design", str(path), "--size", "16x16", "-o", str(tmp_path / "out.png")]) == 2
    assert "--out: must be a folder or one .exr file" in capsys.readouterr().err
    assert not (tmp_path / "out.png").exists()
    flat = write(tmp_path / "b.exr", [({}, {"R": one, "G": one, "B": one, "Z": one})])
    assert main(["design", str(flat), "--size", "16x16", "-o", str(tmp_path / "flat.exr")]) == 0
    assert "Z not used" in capsys.readouterr().err
    assert main(["design", str(flat), "--size", "16x16", "-o", str(tmp_path / "no.exr"), "--strict"]) == 2


def test_the_picture_is_the_display_window(tmp_path: Path) -> None:
    one = draw("float32")
    rows, columns = SHAPE
    for (top, left), (height, width) in (((2, 3), (30, 50)), ((-2, -3), (10, 12)), ((-2, 5), (40, 12))):
        windows = {
            "dataWindow": (np.array([left, top], "i4"), np.array([left + columns - 1, top + rows - 1], "i4")),
            "displayWindow": (np.array([0, 0], "i4"), np.array([width - 1, height - 1], "i4")),
        }
        found, words = read_layers(write(tmp_path / "a.exr", [(windows, {"height.Y": one})]))
        expected = np.zeros((height, width), np.float32)
        for row in range(rows):
            for column in range(columns):
                if 0 <= row + top < height and 0 <= column + left < width:
                    expected[row + top, column + left] = one[row, column]
        assert words is None
        assert (found["height.Y"] == expected).all()


def test_bad_files_are_refused(tmp_path: Path) -> None:
    path = EVERY.save_exr(tmp_path / "a.exr")
    whole = path.read_bytes()
    for cut in (5, 200, 5000, len(whole) - 40):
        (tmp_path / "cut.exr").write_bytes(whole[:cut])
        with pytest.raises(FileError, match=r"cut\.exr"):
            Material.read(tmp_path / "cut.exr")
    with pytest.raises(FileError, match="does not exist"):
        Material.read(tmp_path / "none.exr")
    with pytest.raises(FileError, match="the suffix must be .exr for layers"):
        EVERY.save_exr(tmp_path / "a.png")
    with pytest.raises(LimitExceeded, match="more than the limit of 100"):
        read_layers(path, limit=100)
    with pytest.raises(InvalidInput, match="axes: must be 2, because the layers"):
        Material.read(path, axes=3)
    with pytest.raises(InvalidInput, match="must not be a volume"):
        Material({"albedo": np.zeros((4, 4, 4), np.uint8)}, axes=3).save_exr(tmp_path / "b.exr")
    # An invalid description in the header is ignored.
    one = draw("float32")
    for words in ("{", "[]", '{"maps": {"height": {"role": "height", "space": "srgb", "dtype": "O", "channels": 0}}}'):
        write(tmp_path / "words.exr", [({"texrs": words}, {"height.Y": one})])
        assert (Material.read(tmp_path / "words.exr")["height"].pixels == one).all()


def draw_leaf(dtype: str, *, clear: bool) -> Array:
    """Return linear colours with alpha, optionally 0 in some pixels."""
    pixels = np.dstack([RANDOM.uniform(0.1, 1, (*SHAPE, 3)), RANDOM.uniform(0.05, 1, SHAPE)])
    if clear:
        pixels[:5] = 0
    return pixels.astype(dtype)


@pytest.mark.parametrize("clear", [True, False])
def test_colours_are_multiplied_by_alpha_in_files(clear: bool, tmp_path: Path) -> None:
    leaf = draw_leaf("float32", clear=clear)
    opaque = np.float32(leaf[..., :1])
    made = Material({"albedo": leaf, "height": opaque, "nor": leaf}, spaces={"albedo": "linear"})
    channels, _ = read_layers(made.save_exr(tmp_path / "a.exr"))
    for k, letter in enumerate("RGB"):
        np.testing.assert_allclose(channels[f"albedo.{letter}"], leaf[..., k] * leaf[..., 3], atol=1e-7)
    assert (channels["albedo.A"] == leaf[..., 3]).all()
    # The fourth channel of normals is not their transparency.
    assert (channels["nor.0"] == leaf[..., 0]).all()
    np.testing.assert_allclose(Material.read(tmp_path / "a.exr")["albedo"].pixels, leaf, atol=1e-6)
    made.save(tmp_path / "folder", suffix=".exr")
    stored = io.read(tmp_path / "folder" / "albedo.exr")
    np.testing.assert_allclose(stored[..., :3], leaf[..., :3] * leaf[..., 3:], atol=1e-7)
    assert (io.read(tmp_path / "folder" / "nor.exr") == leaf).all()
    back = Material.read(tmp_path / "folder")
    np.testing.assert_allclose(back["albedo"].pixels, leaf, atol=1e-6)
    assert (
        "albedo.exr: colours are divided by alpha, because EXR files store them multiplied by alpha"
        in back.notices.assumed
    )
    # Read a file of another program, with and without clear pixels.
    other = {f"L.Color.{letter}": channels[f"albedo.{letter}"] for letter in "RGBA"}
    foreign = Material.read(write(tmp_path / "b.exr", [({}, other)]))
    np.testing.assert_allclose(foreign["L.Color"].pixels, leaf, atol=1e-6)


def test_colours_under_no_alpha_are_reported(tmp_path: Path) -> None:
    leaf = draw_leaf("float32", clear=False)
    leaf[:7, :, 3] = 0
    with pytest.warns(InputWarning, match=r"albedo: colours of 33 % of the pixels, whose alpha is 0, are lost"):
        Material({"albedo": leaf}).save_exr(tmp_path / "a.exr")
    straight = {f"L.Color.{letter}": leaf[..., k].copy() for k, letter in enumerate("RGBA")}
    back = Material.read(write(tmp_path / "b.exr", [({}, straight)]))
    assert (back["L.Color"].pixels == leaf).all()
    assert (
        "colours are not divided by alpha, because pixels with an alpha of 0 are not black" in back.notices.assumed[0]
    )


def test_a_picture_with_alpha_changes_between_exr_and_others(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """EXR to EXR keeps the values. Other formats contain colours that are not multiplied."""
    leaf = draw_leaf("float32", clear=False)
    bound = np.dstack([leaf[..., :3] * leaf[..., 3:], leaf[..., 3]])
    write(tmp_path / "in.exr", [({}, {letter: bound[..., k].copy() for k, letter in enumerate("RGBA")})])
    io.write(tmp_path / "in.tif", leaf)
    hole = np.zeros(SHAPE, np.uint8)
    hole[8:12, 8:12] = 255
    io.write(tmp_path / "hole.png", hole)
    for given in ("exr", "tif"):
        for out in ("exr", "tif"):
            target = tmp_path / f"{given}-out.{out}"
            mask = str(tmp_path / "hole.png")
            assert main(["inpaint", str(tmp_path / f"in.{given}"), mask, "-o", str(target)]) == 0
            known = io.read(target)[hole == 0]
            truth = (bound if out == "exr" else leaf)[hole == 0]
            np.testing.assert_allclose(known, truth, rtol=0 if given == out else 1e-5)
            said = "output: colours are divided by alpha" in capsys.readouterr().err
            assert said is ((given, out) == ("exr", "tif"))


def test_layers_keep_their_names(tmp_path: Path) -> None:
    """An image without a layer stays the image that other programs show, and Blender finds its layers again."""
    one = RANDOM.uniform(0, 1, SHAPE).astype(np.float32)
    names = [
        "R",
        "G",
        "B",
        "mask.R",
        "ViewLayer.Depth.Z",
        "ViewLayer.Normal.X",
        "ViewLayer.Normal.Y",
        "ViewLayer.Normal.Z",
    ]
    first = Material.read(write(tmp_path / "a.exr", [({}, {name: one + k for k, name in enumerate(names)})]))
    second = Material.read(first.save_exr(tmp_path / "b.exr"))
    channels, _ = read_layers(second.save_exr(tmp_path / "c.exr"))
    assert sorted(channels) == sorted(names)
    for k, name in enumerate(names):
        assert (channels[name] == one + k).all(), name
    assert {name: each.role.value for name, each in second.items()} == {
        name: each.role.value for name, each in first.items()
    }


def test_a_channel_without_a_layer_is_called_by_its_word(tmp_path: Path) -> None:
    one = RANDOM.uniform(0, 1, SHAPE).astype(np.float32)
    path = write(tmp_path / "a.exr", [({}, {"height": one, "roughness": one / 2})])
    back = Material.read(path)
    assert {name: each.role.value for name, each in back.items()} == {"height": "height", "roughness": "roughness"}
    assert (back["roughness"].pixels == one / 2).all()
    ids = Material.read(write(tmp_path / "b.exr", [({}, {"id": (one * 9).astype(np.uint32)})]))
    assert ids["id"].role is Role.LABELS


def test_a_part_that_is_damaged_is_not_left_out(tmp_path: Path) -> None:
    one = draw("float32")
    path = write(tmp_path / "a.exr", [({"name": "a"}, {"height.Y": one}), ({"name": "b"}, {"ao.Y": one})])
    assert set(read_layers(path)[0]) == {"a.height.Y", "b.ao.Y"}
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(FileError, match="some of its pixels are missing"):
        read_layers(path)

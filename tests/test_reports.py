"""Situations in which other programs lost data silently, recreated from code.

Each test contains the address of its public thread.
"""

import json
import multiprocessing
import struct
from pathlib import Path

import numpy as np
import pytest
import tifffile
from PIL import Image, ImageCms

import texrs
from texrs import samples
from texrs.cli import main

PEBBLES = samples.pebbles((96, 96)).image
GREY = PEBBLES[..., 1]
HOLE = np.zeros((96, 96), np.uint8)
HOLE[30:50, 30:50] = 255
HALF = np.full((96, 96, 1), 255, np.uint8)
HALF[:, 48:] = 128


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Image.fromarray(PEBBLES).save("pebbles.png")
    return tmp_path


def read(path: str | Path) -> np.ndarray:
    if str(path).endswith(".tif"):
        return tifffile.imread(path)
    with Image.open(path) as opened:
        return np.asarray(opened)


def read_profile(path: str) -> bytes | None:
    with Image.open(path) as opened:
        return opened.info.get("icc_profile")


def list_pixels(array: np.ndarray) -> set[bytes]:
    return {row.tobytes() for row in np.ascontiguousarray(array).reshape(-1, *array.shape[2:])}


def test_white_is_zero(here: Path) -> None:
    """A mask and an image whose zeros are white: https://github.com/image-rs/image-tiff/issues/296."""
    tifffile.imwrite("mask.tif", 255 - HOLE, photometric="miniswhite")
    Image.fromarray(HOLE).save("mask.png")
    for name in ("mask.tif", "mask.png"):
        assert main(["inpaint", "pebbles.png", name, "-o", f"{name}.png", "-q"]) == 0
    assert np.array_equal(read("mask.tif.png"), read("mask.png.png"))
    assert np.array_equal(read("mask.tif.png")[HOLE == 0], PEBBLES[HOLE == 0])
    tifffile.imwrite("grey.tif", 65535 - GREY.astype(np.uint16) * 257, photometric="miniswhite")
    assert main(["tile", "grey.tif", "-o", "tiled.tif", "-q"]) == 0
    assert np.isin(read("tiled.tif"), GREY.astype(np.uint16) * 257).all()


def test_associated_alpha(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Half-transparent colours of a TIFF that got darker: https://github.com/chaiNNer-org/chaiNNer/issues/409."""
    straight = np.concatenate([PEBBLES, HALF], axis=-1)
    multiplied = np.concatenate([np.rint(PEBBLES * (HALF / 255.0)).astype(np.uint8), HALF], axis=-1)
    tifffile.imwrite("straight.tif", straight, photometric="rgb", extrasamples=["unassalpha"])
    tifffile.imwrite("multiplied.tif", multiplied, photometric="rgb", extrasamples=["assocalpha"])
    assert np.array_equal(texrs.io.read("straight.tif"), straight)
    assert np.abs(texrs.io.read("multiplied.tif").astype(int) - straight).max() <= 1
    tifffile.imwrite(
        "float.tif", multiplied / np.float32(255), photometric="rgb", extrasamples=["assocalpha"], planarconfig="contig"
    )
    assert np.abs(texrs.io.read("float.tif") * 255 - straight).max() <= 1
    # Test the decoders other than tifffile: the compiled one, and Pillow, which divides the colours itself.
    for scheme in ("tiff_lzw", "zstd"):
        Image.fromarray(multiplied).save("coded.tif", compression=scheme)
        data, kind = Path("coded.tif").read_bytes(), b"\x52\x01\x03\x00\x01\x00\x00\x00"
        assert data.count(kind + b"\x02") == 1
        Path("coded.tif").write_bytes(data.replace(kind + b"\x02", kind + b"\x01"))
        assert np.abs(texrs.io.read("coded.tif").astype(int) - straight).max() <= 1
    assert main(["tile", "multiplied.tif", "-o", "tiled.tif"]) == 0
    assert "multiplied.tif: colours are divided by alpha" in capsys.readouterr().err
    with tifffile.TiffFile("tiled.tif") as file:
        assert file.pages[0].extrasamples == (tifffile.EXTRASAMPLE.UNASSALPHA,)
    assert list_pixels(read("tiled.tif")) <= list_pixels(texrs.io.read("multiplied.tif"))


def test_colours_of_transparent_pixels(here: Path) -> None:
    """Colours below an alpha of 0, which extend beyond edges: https://github.com/kornelski/pngquant/issues/298."""
    clear = np.concatenate([PEBBLES, HALF], axis=-1)
    clear[20:60, 20:60, 3] = 0
    Image.fromarray(clear).save("clear.png")
    assert main(["tile", "clear.png", "-o", "tiled.png", "-q"]) == 0
    assert (read("tiled.png")[..., 3] == 0).any()
    assert list_pixels(read("tiled.png")) <= list_pixels(clear)
    # Seams of a design are also corrected in transparent pixels.
    assert main(["design", "clear.png", "-o", "made.png", "--size", "96", "-q"]) == 0
    made = read("made.png")
    below, given = made[made[..., 3] == 0, :3], clear[20:60, 20:60, :3].reshape(-1, 3)
    assert np.abs(below.mean(axis=0) - given.mean(axis=0)).max() < 20
    assert below.max(axis=1).min() >= given.max(axis=1).min() - 10


def test_one_name_with_two_suffixes(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Two inputs of a batch whose results would be one file: https://github.com/apsun/AniConvert/issues/3."""
    Path("in").mkdir()
    Image.fromarray(PEBBLES).save("in/a.png")
    Image.fromarray(255 - PEBBLES).save("in/a.jpg")
    assert main(["batch", "tile", "in/*", "-o", "out/{name}.png"]) == 2
    assert "out/a.png" in capsys.readouterr().err
    assert not Path("out").exists()


def test_no_value_in_a_float_picture(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One NaN made all values 0: https://github.com/mantidproject/mantidimaging/issues/1093."""
    values = GREY / np.float32(255)
    values[10:20, 10:20] = np.nan
    tifffile.imwrite("nan.tif", values)
    assert main(["tile", "nan.tif", "-o", "tiled.tif"]) == 2
    assert "nan.tif: must be finite, but 100 of 9216 values are NaN" in capsys.readouterr().err
    assert not Path("tiled.tif").exists()


def swap_primaries() -> bytes:
    """Return a profile of sRGB with exchanged red and green."""
    data = bytearray(ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes())
    tags = {bytes(data[at : at + 4]): at for at in range(132, 132 + 12 * struct.unpack(">I", data[128:132])[0], 12)}
    red, green = (slice(tags[key] + 4, tags[key] + 12) for key in (b"rXYZ", b"gXYZ"))
    data[red], data[green] = data[green], data[red]
    return bytes(data)


@pytest.mark.parametrize("suffix", ["png", "jpg", "tif"])
def test_colour_profiles(here: Path, suffix: str) -> None:
    """Colours of a wide profile that were written without it: https://github.com/image-rs/image/issues/3072."""
    profile = swap_primaries()
    Image.fromarray(PEBBLES).save(f"wide.{suffix}", icc_profile=profile)
    assert main(["tile", f"wide.{suffix}", "-o", f"tiled.{suffix}", "-q"]) == 0
    assert read_profile(f"tiled.{suffix}") == profile
    assert main(["design", f"wide.{suffix}", "-o", "made.png", "--size", "96", "-q"]) == 0
    assert read_profile("made.png") == profile


def test_a_photograph_that_lies_on_its_side(here: Path) -> None:
    """A stored orientation that tools ignored: https://github.com/naver/dust3r/issues/15. The mask was drawn upright."""
    stored = Image.fromarray(np.ascontiguousarray(np.rot90(PEBBLES[:64])))
    orientation = Image.Exif()
    orientation[0x0112] = 6
    stored.save("photo.jpg", quality=100, subsampling=0, exif=orientation)
    mask = np.zeros((64, 96), np.uint8)
    mask[10:30, 60:80] = 255
    Image.fromarray(mask).save("mask.png")
    assert main(["inpaint", "photo.jpg", "mask.png", "-o", "made.png", "-q"]) == 0
    upright, made = np.rot90(read("photo.jpg"), -1), read("made.png")
    assert made.shape == (64, 96, 3)
    assert np.array_equal(made[mask == 0], upright[mask == 0])
    assert (made != upright).any(axis=-1)[mask > 0].mean() > 0.9
    assert main(["inpaint", "made.png", "mask.png", "-o", "again.jpg", "-q"]) == 0
    with Image.open("again.jpg") as opened:
        assert opened.getexif().get(0x0112, 1) == 1


def test_heights_in_the_alpha_of_normals(here: Path) -> None:
    """Heights packed next to normals, dropped on import: https://github.com/godotengine/godot/issues/19223."""
    down, right = np.gradient(GREY / 40.0)
    normals = np.dstack([-right, down, np.ones_like(down)])
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    Path("rock").mkdir()
    packed = np.dstack([np.rint((normals + 1) * 127.5), GREY]).astype(np.uint8)
    Image.fromarray(packed).save("rock/rock_normal.png")
    Image.fromarray(PEBBLES).save("rock/rock_albedo.png")
    assert main(["design", "rock", "-o", "out", "--size", "96", "--source-map", "map.npz", "-q"]) == 0
    (found,) = Path("out").glob("*normal*.png")
    source = texrs.SourceMap.load("map.npz")
    made = read(found)
    assert made.shape == (96, 96, 4)
    assert np.array_equal(made[..., 3], source.render(GREY, interpolation="nearest"))


def test_twelve_bits_in_sixteen(here: Path) -> None:
    """Values above 255 of a 16-bit TIFF became 255: https://github.com/python-pillow/Pillow/issues/274."""
    given = GREY.astype(np.uint16) * 16 + 3
    for byteorder in "<>":
        tifffile.imwrite("twelve.tif", given, byteorder=byteorder)
        assert main(["tile", "twelve.tif", "-o", "tiled.png", "-q"]) == 0
        made = read("tiled.png")
        assert made.dtype == np.uint16
        assert np.isin(made, given).all()
        assert made.max() > 2000


def test_labels_that_are_resized(here: Path) -> None:
    """New classes between existing ones: https://github.com/vanvalenlab/deepcell-tf/issues/369."""
    labels = (np.arange(96)[:, np.newaxis] // 8 * 12 + np.arange(96) // 8).astype(np.uint16) * 37
    picture = np.dstack([labels % 251, labels % 241, labels % 239]).astype(np.uint8)
    augment = texrs.transforms.TextureAugment()
    for seed in range(2):
        made = augment(picture, labels, seed=seed)
        assert made.mask.dtype == np.uint16
        assert np.isin(made.mask, labels).all()
    Image.fromarray(labels).save("x_labels.png")
    assert main(["tile", "x_labels.png", "-o", "tiled.png", "-q"]) == 0
    assert np.isin(read("tiled.png"), labels).all()


def test_layers_without_a_default(here: Path) -> None:
    """An EXR of named layers only: https://github.com/disneyresearch/jeri/issues/14.

    All of its layers are in the result.
    """
    exr = pytest.importorskip("OpenEXR")
    light = ((PEBBLES / 255) ** 2.2).astype(np.float32)
    channels = {
        f"{layer}.{c}": light[..., i] * share
        for layer, share in (("color", 1), ("albedo", 0.5))
        for i, c in enumerate("RGB")
    }
    header = {"compression": exr.ZIP_COMPRESSION, "type": exr.scanlineimage}
    with exr.File(header, {name: np.ascontiguousarray(v, np.float32) for name, v in channels.items()}) as file:
        file.write("layers.exr")
    assert main(["tile", "layers.exr", "-o", "tiled.exr", "-q"]) == 0
    with exr.File("tiled.exr", separate_channels=True) as file:
        made = {name: each.pixels for name, each in file.channels().items()}
    assert made.keys() == channels.keys()
    for c in "RGB":
        assert np.allclose(made[f"albedo.{c}"], made[f"color.{c}"] / 2, atol=1e-6)


def draw(seed: int | None) -> bytes:
    return texrs.transforms.TextureAugment()(PEBBLES, seed=seed).image.tobytes()


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_workers_that_draw_the_same(here: Path) -> None:
    """All workers of a loader returned the same samples: https://github.com/pytorch/pytorch/issues/5059."""
    if "fork" not in multiprocessing.get_all_start_methods():
        pytest.skip("this system cannot fork")
    with multiprocessing.get_context("fork").Pool(2) as pool:
        assert len(set(pool.map(draw, [None] * 4, chunksize=1))) == 4
        assert len(set(pool.map(draw, [7] * 2, chunksize=1))) == 1


SHEET = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
SHEET += "usemtl left\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\nusemtl right\nf 2/1 5/2 6/3\nf 2/1 6/3 3/4\n"


def test_an_obj_of_two_materials(here: Path) -> None:
    """UVs and materials changed on loading: https://github.com/mikedh/trimesh/issues/1831 and /999."""
    Path("sheet.obj").write_text(SHEET)
    texrs.io.write_volume("stripes.tif", samples.stripes((32, 32, 32)).image)
    words = [
        "paint",
        "sheet.obj",
        "stripes.tif",
        "-o",
        "out.obj",
        "--atlas",
        "32",
        "--voxels",
        "16",
        "--quality",
        "fast",
        "-q",
    ]
    assert main(words) == 0
    assert Path("out.obj").read_text() == "mtllib out.mtl\n" + SHEET
    pictures = [read(f"out_{name}_basecolor.png") for name in ("left", "right")]
    assert not np.array_equal(*pictures)


def test_uvs_without_a_material(here: Path) -> None:
    """UVs of a glTF file, dropped without a material: https://github.com/KhronosGroup/COLLADA2GLTF/issues/282."""
    trimesh = pytest.importorskip("trimesh")
    uv = [[0.1, 0.2], [0.9, 0.2], [0.9, 0.7]]
    mesh = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 1, 2]], process=False)
    mesh.visual = trimesh.visual.TextureVisuals(uv=uv)
    for name, data in trimesh.exchange.gltf.export_gltf(trimesh.Scene(mesh)).items():
        Path(name).write_bytes(data)
    document = json.loads(Path("model.gltf").read_text())
    del document["materials"], document["meshes"][0]["primitives"][0]["material"]
    Path("leaf.gltf").write_text(json.dumps(document))
    made = texrs.painting.texture_mesh("leaf.gltf", texrs.SolidTexture(samples.stripes((32, 32, 32)).image), atlas=16)
    assert np.allclose(made.uv, uv)

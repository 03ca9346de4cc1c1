"""Images with a palette or few colours: no verb adds colours, and palettes come back."""

import numpy as np
import pytest
from PIL import Image

import image_files as make
import texrs
from texrs import io, samples
from texrs._notices import collect
from texrs._palettes import ask, has_few_colours
from texrs.cli import main
from texrs.materials import Material

TABLE = np.array([(20, 12, 28), (68, 36, 52), (48, 52, 109), (133, 76, 48), (52, 101, 36), (200, 0, 200)], np.uint8)


def make_indices(side=64, step=4, seed=0):
    """Return bricks of a few colours."""
    rng = np.random.default_rng(seed)
    n = side // step
    small = np.full((n, n), 3)
    small[3::4] = 0
    for row in range(0, n, 4):
        small[row : row + 3, row % 8 :: 8] = 0
    small[rng.random((n, n)) < 0.1] = 1
    small[rng.random((n, n)) < 0.05] = 4
    return np.kron(small, np.ones((step, step), int)).astype(np.uint8)


ART = TABLE[make_indices()]
HOLE = np.zeros((64, 64), bool)
HOLE[24:40, 24:40] = True
SIZES = np.repeat(np.linspace(0.5, 1.5, 64, dtype=np.float32)[:, np.newaxis], 64, axis=1)
VERBS = {
    "design": lambda image: texrs.design(image, 80),
    "design of several": lambda image: texrs.design([image, np.ascontiguousarray(image[::-1])], 80),
    "design variants": lambda image: list(texrs.design_variants(image, 2, 80))[1],
    "tile": texrs.tile,
    "inpaint": lambda image: texrs.inpaint(image, HOLE),
    "inpaint from another": lambda image: texrs.inpaint(image, HOLE, exemplar=image[::-1].copy()),
    "synthesize": lambda image: texrs.synthesize(image, 80),
    "synthesize an exemplar": lambda image: texrs.synthesize(texrs.Exemplar(image), 80),
    "perspective": lambda image: texrs.perspective(image, SIZES, 80),
    "extend": lambda image: texrs.extend(image, right=16),
    "remove": lambda image: texrs.remove(image, HOLE),
    "rectify": lambda image: texrs.rectify(image, view=texrs.PlaneView(corners=[(4, 6), (2, 60), (60, 56), (62, 4)])),
    "splice": lambda image: texrs.splice(image, np.ascontiguousarray(image[:, ::-1])),
    "self splice": lambda image: texrs.self_splice(image),
}


def find_colours(image):
    return set(map(tuple, np.asarray(image).reshape(-1, np.asarray(image).shape[-1]).tolist()))


@pytest.mark.filterwarnings("ignore:the plane was found with a confidence")
@pytest.mark.parametrize("verb", VERBS)
def test_no_verb_makes_a_colour(verb):
    made = VERBS[verb](ART)
    assert find_colours(made.image) <= find_colours(ART)
    assert made.report["palette"] == len(find_colours(ART))
    assert any("colours, so pixels are neither interpolated nor corrected" in line for line in made.report["assumed"])
    if "several" not in verb and "another" not in verb:
        np.testing.assert_array_equal(texrs.apply(made.source_map, ART), made.image)


@pytest.mark.parametrize("side", [16, 64])
def test_small_pixel_art_keeps_its_colours(side):
    image = TABLE[make_indices(side, 1 if side == 16 else 4)]
    assert find_colours(texrs.design(image, 64).image) <= find_colours(image)


def test_maps_of_a_material_keep_theirs():
    material = Material({"albedo": ART, "height": np.ascontiguousarray(ART[..., 0])})
    made = texrs.design(material, 80)
    for name, before in material.items():
        assert set(np.unique(made.material[name].pixels)) <= set(np.unique(before.pixels))


def test_it_can_be_turned_off():
    with ask(False):
        assert len(find_colours(texrs.design(ART, 80).image)) > 6
    assert len(find_colours(texrs.design(ART, 80, screening=0.5).image)) > 6
    with ask(True):
        pebbles = samples.pebbles((64, 64)).image
        assert find_colours(texrs.design(pebbles, 80).image) <= find_colours(pebbles)


def test_pictures_of_many_colours_are_left_alone():
    for name in ("dots", "weave", "bricks", "grit"):
        image = samples.load(name).image
        assert not has_few_colours(image)
        assert not has_few_colours(np.ascontiguousarray(image[:16, :16]))
    # A few neighbouring levels are a smooth transition, and interpolation is right for many greys.
    ramp = np.add.outer(np.arange(64), np.arange(64)) // 8
    assert not has_few_colours(ramp.astype(np.uint8))
    assert not has_few_colours(make.picture((64, 64)))
    assert not has_few_colours(np.full((8, 8, 3), 7, np.uint8))
    assert "palette" not in texrs.design(samples.pebbles((64, 64)).image, 80).report


def test_a_file_with_a_palette_is_known_by_it(tmp_path):
    rng = np.random.default_rng(0)
    # The image has 256 colours, so only the palette in the file shows that it is not a photograph.
    table = rng.integers(0, 256, (256, 3), np.uint8)
    image = Image.fromarray(rng.integers(0, 256, (64, 64), np.uint8))
    image.putpalette(table.tobytes())
    for suffix in (".png", ".gif", ".bmp", ".tga"):
        image.save(tmp_path / f"a{suffix}")
        pixels = io.read(tmp_path / f"a{suffix}")
        for given in (pixels, str(tmp_path / f"a{suffix}"), texrs.Exemplar(pixels)):
            made = texrs.synthesize(given, 48)
            assert find_colours(made.image) <= find_colours(pixels)
            assert made.report["assumed"][0].startswith(f"{tmp_path / f'a{suffix}'}: ")
    # A grey photograph as GIF, as in old collections of textures, does not count as a palette image.
    Image.fromarray(make.picture((64, 64))).save(tmp_path / "grey.gif")
    assert "palette" not in texrs.tile(io.read(tmp_path / "grey.gif")).report


@pytest.mark.parametrize("suffix", [".png", ".gif", ".bmp", ".tga"])
@pytest.mark.parametrize("clear", [False, True])
def test_palettes_come_back(tmp_path, suffix, clear):
    if clear and suffix not in (".png", ".gif"):
        pytest.skip("holds no transparent colour in its palette")
    indices = make_indices()
    indices[::16, :] = 5
    image = Image.fromarray(indices)
    image.putpalette(TABLE.tobytes())
    source, out = tmp_path / f"a{suffix}", tmp_path / f"out{suffix}"
    image.save(source, **({"transparency": 5} if clear else {}))
    assert main(["design", str(source), "-o", str(out), "--size", "80", "-q"]) == 0
    with Image.open(source) as before, Image.open(out) as after:
        assert after.mode == "P"
        assert after.getpalette()[:18] == before.getpalette()[:18]
        assert after.info.get("transparency") == before.info.get("transparency")
        assert find_colours(after.convert("RGBA")) <= find_colours(before.convert("RGBA"))
    assert io.read_metadata(out).palette == io.read_metadata(source).palette
    assert main(["rerun", str(out), "-q"]) == 0


def test_the_command_says_it_and_can_be_told_otherwise(tmp_path, capsys):
    io.write(tmp_path / "a.png", ART)
    words = ["design", str(tmp_path / "a.png"), "-o", str(tmp_path / "out.png"), "--size", "80"]
    assert main(words) == 0
    assert "a.png: has only 4 colours, so pixels are neither interpolated" in capsys.readouterr().err
    assert main([*words, "--no-palette", "--force"]) == 0
    assert "colours" not in capsys.readouterr().err
    assert len(find_colours(io.read(tmp_path / "out.png"))) > 4


def test_notices_name_the_file_only_while_its_array_lives(tmp_path):
    io.write(tmp_path / "a.png", ART)
    image = io.read(tmp_path / "a.png")
    with collect(show=lambda line: None) as notices:
        texrs.tile(image)
    assert notices.assumed[0].startswith(str(tmp_path))
    with collect(show=lambda line: None) as notices:
        texrs.tile(image.copy())
    assert notices.assumed[0].startswith("image: ")


def test_unbounded_textures_keep_few_colours():
    """Rotated windows have only colours of the example, unless others are requested."""
    seen = find_colours(ART)
    with collect() as notices:
        plane = texrs.PlaneTexture(ART, field="circular", seed=1)
    assert any("few colours, so pixels are not interpolated" in line for line in notices.assumed)
    assert find_colours(plane[10:74, -30:40]) <= seen
    smooth = texrs.PlaneTexture(ART, field="circular", seed=1, interpolation="cubic")
    assert not find_colours(smooth[10:74, -30:40]) <= seen
    with ask(False):
        assert not find_colours(texrs.PlaneTexture(ART, field="circular", seed=1)[10:74, -30:40]) <= seen
    tiles = texrs.CornerTiles(ART)
    assert find_colours(tiles.window((5, 7), (90, 90)).image) <= seen

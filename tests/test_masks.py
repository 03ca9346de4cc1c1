"""Masks from users: layers, noise of JPEG, inverted ones, soft alpha, and pixels without data."""

from __future__ import annotations

import io as bytes_io
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import tifffile
from PIL import Image
from scipy.ndimage import binary_dilation, binary_erosion, gaussian_filter

import texrs
from texrs import Mask, io, samples
from texrs._arrays import as_mask
from texrs._masks import fade, mark, widen
from texrs._notices import collect
from texrs.cli import main
from texrs.errors import InputWarning, InvalidInput

Capture = pytest.CaptureFixture[str]
SIZE = (96, 112)
BRICKS = samples.load("bricks", size=SIZE).image
ROWS, COLUMNS = np.indices(SIZE)
FAR = np.hypot(ROWS - 48, COLUMNS - 50)
DISC = FAR < 17
WHITE = DISC.astype(np.uint8) * 255
HEIGHTS = (gaussian_filter(np.random.default_rng(1).normal(size=SIZE), 3) * 300 + 500).astype(np.float32)
GEO = (
    (33550, 12, 3, (30.0, 30.0, 0.0)),
    (33922, 12, 6, (0.0, 0.0, 0.0, 440720.0, 3751320.0, 0.0)),
    (34735, 3, 8, (1, 1, 0, 1, 1024, 0, 1, 1)),
    (34737, 2, 7, "WGS 84|"),
    (42113, 2, 6, "-9999"),
)


def as_layer(colour: tuple[int, int, int], alpha: np.ndarray) -> np.ndarray:
    return np.dstack([np.where(alpha > 0, c, 0).astype(np.uint8) for c in colour] + [alpha])


def as_jpeg(mask: np.ndarray, quality: int) -> np.ndarray:
    file = bytes_io.BytesIO()
    Image.fromarray(mask).save(file, "JPEG", quality=quality)
    return np.asarray(Image.open(file))


def read(mask: object) -> tuple[np.ndarray, list[str]]:
    with collect() as notices:
        marked = mark(mask, "mask", SIZE)
    return marked, notices.assumed


# --- how a mask is read ----------------------------------------------------------------------------------------------

NOISE = np.random.default_rng(0).integers(0, 3, SIZE).astype(np.uint8)
MASKS: dict[str, tuple[Callable[[], object], str]] = {
    "bool": (lambda: DISC, ""),
    "white": (lambda: WHITE, ""),
    "0 and 1": (lambda: DISC.astype(np.uint8), ""),
    "0 and 1 of 64 bits": (lambda: DISC.astype(np.int64), ""),
    "0 and 3": (
        lambda: DISC.astype(np.uint8) * 3,
        "read as numbers, because the largest value is 3, and white would be 255",
    ),
    "labels": (lambda: DISC * (1 + ROWS % 7).astype(np.uint8), "values other than 0 are marked"),
    "16 bits": (lambda: DISC.astype(np.uint16) * 65535, ""),
    "shares": (lambda: DISC.astype(np.float32), ""),
    "floats to 255": (lambda: DISC * 255.0, ""),
    "noise of 2 in black and white": (lambda: np.where(DISC, 253, 0).astype(np.uint8) + NOISE, ""),
    "red on black": (lambda: np.dstack([WHITE, 0 * WHITE, 0 * WHITE]), ""),
    "grey noise and dark strokes": (lambda: np.where(DISC, 90, 0).astype(np.uint8) + NOISE, "values of at least 46"),
    "opaque alpha": (lambda: np.dstack([WHITE] * 3 + [np.full(SIZE, 255, np.uint8)]), ""),
    "alpha that is nowhere": (lambda: np.dstack([WHITE] * 3 + [np.zeros(SIZE, np.uint8)]), ""),
    "black stroke on a layer": (lambda: as_layer((0, 0, 0), WHITE), "read as a layer"),
    "red stroke on a layer": (lambda: as_layer((255, 0, 0), WHITE), "read as a layer"),
    "white stroke on a layer": (lambda: as_layer((255, 255, 255), WHITE), "read as a layer"),
    "grey and alpha": (lambda: np.dstack([0 * WHITE, WHITE]), "read as a layer"),
    "black and white, in part transparent": (
        lambda: np.dstack([WHITE] * 3 + [np.where(COLUMNS < 90, 255, 0).astype(np.uint8)]),
        "read as a black and white mask; its transparent parts",
    ),
    "the picture itself with the hole erased": (
        lambda: np.dstack([samples.load("pebbles", size=SIZE).image, 255 - WHITE]),
        "read as an image whose transparent part is marked",
    ),
    "a plain layer over much of the picture": (
        lambda: Mask(as_layer((9, 9, 9), 255 - WHITE), invert=True),
        "as a layer",
    ),
    "picture of PIL": (lambda: Image.fromarray(WHITE), ""),
    "one bit of PIL": (lambda: Image.fromarray(WHITE).convert("1"), ""),
    "inverted": (lambda: Mask(255 - WHITE, invert=True), ""),
}


@pytest.mark.parametrize("name", MASKS)
def test_whatever_marks_is_read(name: str) -> None:
    make, words = MASKS[name]
    marked, said = read(make())
    assert marked.dtype == bool
    np.testing.assert_array_equal(marked, DISC)
    assert len(said) == bool(words)
    assert words in "".join(said)


def test_files_are_read_as_arrays_and_give_their_name(tmp_path: Path) -> None:
    io.write(tmp_path / "stroke.png", as_layer((0, 0, 0), WHITE))
    marked, said = read(tmp_path / "stroke.png")
    np.testing.assert_array_equal(marked, DISC)
    assert said == ["stroke.png: read as a layer, because its transparency varies; its opaque pixels are marked"]
    # All other masks of texrs are read in the same way.
    np.testing.assert_array_equal(as_mask(tmp_path / "stroke.png", "ground", SIZE), DISC)
    np.testing.assert_array_equal(as_mask(Mask(tmp_path / "stroke.png", invert=True), "ground", SIZE), ~DISC)
    with pytest.raises(InvalidInput, match="ground: must not have a feather"):
        as_mask(Mask(WHITE, feather=2), "ground", SIZE)


@pytest.mark.parametrize("quality", [20, 50, 75, 95])
def test_the_usual_threshold_survives_jpeg(quality: int) -> None:
    noisy = as_jpeg(WHITE, quality)
    marked, said = read(noisy)
    assert said == []
    assert np.count_nonzero(marked != DISC) <= 0.005 * DISC.sum()
    # If every pixel that is not black counted, the noise would mark a ring.
    assert np.count_nonzero((noisy > 0) != DISC) > 0.05 * DISC.sum()


def test_threshold_and_grey() -> None:
    soft = np.rint(255 * np.clip((30 - FAR) / 30, 0, 1)).astype(np.uint8)
    usual, said = read(soft)
    np.testing.assert_array_equal(usual, soft >= 128)
    assert "dark grey or mostly transparent, so they are not marked" in said[0]
    for share in (0.0, 0.1, 0.9, 1.0):
        marked, said = read(Mask(soft, threshold=share))
        np.testing.assert_array_equal(marked, (soft >= share * 255) & (soft > 0))
        assert said == []


@pytest.mark.parametrize("shape", [(40, 50), (12, 20, 24)])
def test_grow_is_the_same_in_any_number_of_axes(shape: tuple[int, ...]) -> None:
    some = np.random.default_rng(2).random(shape) < 0.03
    ball = ((np.indices((7,) * len(shape)) - 3) ** 2).sum(axis=0) <= 9
    np.testing.assert_array_equal(mark(Mask(some, grow=3), "mask", shape), binary_dilation(some, ball))
    large = binary_dilation(some, ball, 2)
    np.testing.assert_array_equal(
        mark(Mask(large, grow=-3), "mask", shape), binary_erosion(large, ball, border_value=True)
    )
    np.testing.assert_array_equal(mark(Mask(~some, invert=True, grow=3), "mask", shape), widen(some, 3))


def test_grow_goes_across_cyclic_borders() -> None:
    point = np.zeros(SIZE, bool)
    point[0, 50] = True
    assert mark(Mask(point, grow=3), "mask", SIZE, (True, False))[-3:, 50].all()
    assert not mark(Mask(point, grow=3), "mask", SIZE)[-3:].any()


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Mask(WHITE, threshold=1.5), "threshold: must be a number between 0 and 1"),
        (
            lambda: read(WHITE[:40]),
            r"mask: must have shape \(96, 112\), got \(40, 112\); a mask has the size of the image",
        ),
        (lambda: read(np.full(SIZE, np.nan)), "mask: must be finite"),
        (lambda: read(np.dstack([WHITE] * 5)), "mask: must have shape"),
        (lambda: read(WHITE.astype(complex)), "mask: must contain bool, integers or floats"),
        (lambda: texrs.inpaint(BRICKS, Mask(WHITE, grow=-20)), "mask: marks nothing"),
        (lambda: texrs.inpaint(BRICKS, Mask(DISC | True, invert=True)), "mask: marks nothing"),
        (lambda: texrs.inpaint(BRICKS, Mask(WHITE, feather=200)), "mask: must leave pixels to copy from"),
        (lambda: texrs.inpaint(BRICKS, 300), "mask: no pixel of the image is 300"),
        (lambda: texrs.inpaint(BRICKS, 10**400), "mask: a number must be within the range of a 64-bit float"),
        (lambda: texrs.inpaint(BRICKS, "nodata"), "mask: 'nodata' requires an image that was read from a file"),
        (lambda: texrs.inpaint(BRICKS, Mask(7, threshold=0.5)), "threshold: needs a mask"),
        (lambda: texrs.inpaint(BRICKS, "alpha"), "mask: 'alpha' needs an image with an alpha channel"),
    ],
)
def test_what_marks_nothing_is_refused(make: Callable[[], object], words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        make()


# --- what is filled --------------------------------------------------------------------------------------------------


def test_the_share_that_is_filled_is_reported() -> None:
    made = texrs.inpaint(BRICKS, Mask(WHITE, grow=2))
    assert made.report["filled"] == widen(DISC, 2).mean()
    assert "assumed" not in made.report
    much = texrs.inpaint(BRICKS, 255 - WHITE)
    assert much.report["filled"] == (~DISC).mean()
    assert much.report["assumed"] == ["mask: marks 92 % of the image; if the rest is meant, invert the mask (--invert)"]
    np.testing.assert_array_equal(
        texrs.inpaint(BRICKS, Mask(255 - WHITE, invert=True)).image, texrs.inpaint(BRICKS, DISC).image
    )


def is_magenta(image: np.ndarray) -> np.ndarray:
    red, green, blue = (image[..., c].astype(int) for c in range(3))
    return (red - green > 60) & (blue - green > 60)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_a_softly_erased_hole_keeps_nothing_of_the_brush(dtype: type) -> None:
    alpha = np.clip((FAR - 13) / 14, 0, 1)[..., np.newaxis]
    painted = BRICKS * alpha + np.array([255, 0, 255]) * (1 - alpha)
    soft = np.dstack([np.rint(painted), np.rint(255 * alpha)])
    assert is_magenta(soft).mean() > 0.1
    full = 1.0 if dtype is np.float32 else np.iinfo(dtype).max
    made = texrs.inpaint((soft / 255 * full).astype(dtype), "alpha")
    assert not is_magenta(made.image / full * 255).any()
    assert (made.image[..., 3] == full).all()
    assert made.report["filled"] == (soft[..., 3] < 255).mean()
    # With a threshold, pixels that are hardly transparent are kept.
    kept = texrs.inpaint((soft / 255 * full).astype(dtype), Mask("alpha", threshold=0.5))
    assert kept.report["filled"] == pytest.approx((alpha <= 0.5).mean(), abs=0.01)


def test_an_image_without_an_opaque_pixel_says_what_to_do() -> None:
    veiled = np.dstack([BRICKS, np.where(DISC, 0, 254).astype(np.uint8)])
    with collect() as notices, pytest.raises(InvalidInput, match="mask: must leave pixels to copy from"):
        texrs.inpaint(veiled, "alpha")
    assert "a threshold of 1 fills only fully transparent pixels" in notices.assumed[0]
    assert texrs.inpaint(veiled, Mask("alpha", threshold=1)).report["filled"] == DISC.mean()


def test_a_feathered_filling_fades_into_the_image() -> None:
    base = np.where(DISC, 0, BRICKS[..., 0]).astype(np.uint8)
    made = texrs.inpaint(base, Mask(WHITE, feather=5))
    wide = widen(DISC, 5)
    assert made.report["filled"] == wide.mean()
    # The marked area is replaced, pixels beyond the band stay, and the band is a mixture.
    composite = made.stages["before_blending"]
    np.testing.assert_array_equal(made.image[DISC], composite[DISC])
    np.testing.assert_array_equal(made.image[~wide], base[~wide])
    weight = np.rint(255 * fade(DISC, 5)) / 255
    expected = np.rint(weight * composite + (1 - weight) * base)
    np.testing.assert_array_equal(made.image[wide & ~DISC], expected[wide & ~DISC])
    # Other maps fade in the same way, except labels, which are not mixed.
    np.testing.assert_array_equal(texrs.apply(made.source_map, base), made.image)
    labels = (COLUMNS // 8).astype(np.uint8)
    assert np.isin(texrs.apply(made.source_map, labels, map_type="label"), labels).all()


def test_feather_asks_for_colours_between_those_of_a_palette() -> None:
    checks = np.where((ROWS // 8 + COLUMNS // 8) % 2, 200, 40).astype(np.uint8)
    assert "palette" in texrs.inpaint(checks, WHITE).report
    faded = texrs.inpaint(checks, Mask(WHITE, feather=6))
    assert "palette" not in faded.report
    assert faded.source_map.finish is not None
    assert faded.source_map.finish.fade is not None


def test_feathered_normals_keep_their_length_and_the_map_its_fade(tmp_path: Path) -> None:
    made = texrs.inpaint(BRICKS, Mask(WHITE, feather=8))
    made.source_map.save(tmp_path / "map.npz")
    again = texrs.SourceMap.load(tmp_path / "map.npz")
    np.testing.assert_array_equal(texrs.apply(again, BRICKS), made.image)
    slope = np.dstack([*np.gradient(gaussian_filter(BRICKS[..., 0].astype(float), 2)), np.full(SIZE, 4.0)])
    normals = slope / np.linalg.norm(slope, axis=-1, keepdims=True)
    for encoded, back in (
        (normals.astype(np.float32), lambda n: n),
        (np.rint(255 * (normals + 1) / 2).astype(np.uint8), lambda n: n / 127.5 - 1),
    ):
        turned = back(texrs.apply(again, encoded, map_type="normal"))
        np.testing.assert_allclose(np.linalg.norm(turned, axis=-1), 1, atol=0.02)


def test_remove_grows_and_feathers() -> None:
    floor = samples.tilted_discs((128, 128)).image
    marked = np.zeros((128, 128), np.uint8)
    marked[60:80, 50:70] = 255
    made = texrs.remove(
        floor, Mask(marked, grow=2, feather=3), view=texrs.PlaneView(slant=35, fov=60), margin=0, boundary_width=0
    )
    inner = widen(marked > 0, 2)
    assert made.report["filled"] == widen(inner, 3).mean()
    np.testing.assert_array_equal(texrs.apply(made.source_map, floor), made.image)
    assert (made.image[~widen(inner, 3)] == floor[~widen(inner, 3)]).all()


def test_one_mask_fills_all_maps_of_a_material() -> None:
    rock = texrs.Material({"color": BRICKS, "height": HEIGHTS}, roles={"color": "color", "height": "height"})
    made = texrs.inpaint(rock, Mask(WHITE, feather=4))
    assert made.material is not None
    assert made.report["filled"] == widen(DISC, 4).mean()
    for name in ("color", "height"):
        np.testing.assert_array_equal(
            made.material[name].pixels[~widen(DISC, 4)], rock[name].pixels[~widen(DISC, 4)], err_msg=name
        )


@pytest.mark.parametrize("hole", ["alpha", "nan", "nodata", 0, None, Mask("alpha")])
def test_a_hole_of_a_material_is_a_mask(hole: object) -> None:
    rock = texrs.Material({"color": BRICKS, "height": HEIGHTS})
    with pytest.raises(InvalidInput, match="mask: must be a mask image for a material"):
        texrs.inpaint(rock, hole)  # type: ignore[arg-type]


# --- pixels without data ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64])
@pytest.mark.parametrize("missing", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_filled(dtype: type, missing: float) -> None:
    heights = HEIGHTS.astype(dtype)
    expected = texrs.inpaint(heights, DISC)
    heights[DISC] = missing
    for hole in (None, "nan", Mask("nan"), -9999):
        made = texrs.inpaint(heights, hole)
        np.testing.assert_array_equal(made.image, expected.image)
        assert np.isfinite(made.image).all()
    assert texrs.inpaint(heights).report["assumed"] == [
        f"image: {DISC.sum()} pixels are NaN or infinite; they are filled"
    ]


@pytest.mark.parametrize(
    ("dtype", "value", "text"),
    [
        (np.float32, -9999, "-9999"),
        (np.float32, -3.4028234663852886e38, "-3.40282346638529e+38"),
        (np.float64, -1e30, "-1e+30"),
        (np.int16, -32768, "-32768"),
        (np.uint8, 0, "0"),
        (np.float32, np.nan, "nan"),
    ],
)
def test_nodata_is_what_the_file_states(tmp_path: Path, dtype: type, value: float, text: str) -> None:
    heights = HEIGHTS.astype(np.int64).clip(1, 255).astype(dtype)
    expected = texrs.inpaint(heights, DISC).image
    heights[DISC] = value
    path = tmp_path / "heights.tif"
    tifffile.imwrite(path, heights, extratags=[(42113, 2, len(text) + 1, text, True)])
    assert io.read_metadata(path).nodata == pytest.approx(value, nan_ok=True)
    for hole in ("nodata", float(text)):
        np.testing.assert_array_equal(texrs.inpaint(path, hole).image, expected)
    tifffile.imwrite(path, heights)
    with pytest.raises(InvalidInput, match="does not contain a nodata value"):
        texrs.inpaint(path, "nodata")


def test_a_colour_is_nodata_only_in_all_channels() -> None:
    image = np.maximum(BRICKS, 1)
    image[20:30, 20:30, 0] = 0
    image[DISC] = 0
    expected = DISC & (image == 0).all(axis=-1)
    assert texrs.inpaint(image, 0).report["filled"] == expected.mean()


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in a folder with a georeferenced raster, an image, and masks."""
    monkeypatch.chdir(tmp_path)
    raster = HEIGHTS.copy()
    raster[DISC] = -9999
    tifffile.imwrite("heights.tif", raster, extratags=[(*tag, True) for tag in GEO], byteorder=">")
    io.write("in.png", BRICKS)
    io.write("hole.png", WHITE)
    io.write("empty.png", 0 * WHITE)
    io.write("inverted.png", 255 - WHITE)
    io.write("stroke.png", as_layer((0, 0, 0), WHITE))
    return tmp_path


def read_tags(path: str) -> dict[int, object]:
    with tifffile.TiffFile(path) as tif:
        return {tag.code: tag.value for tag in tif.pages.first.tags if tag.code > 33000}


@pytest.mark.parametrize("hole", ["", "nodata", "-9999", "-9999.0", "hole.png"])
def test_georeference_goes_through(here: Path, capsys: Capture, hole: str) -> None:
    assert main(["inpaint", "heights.tif", *hole.split(), "-o", "out.tif"]) == 0
    lines = capsys.readouterr().err.splitlines()
    assert f"{100 * DISC.mean():.3g} % filled" in lines[-1]
    words = f"heights.tif: {DISC.sum()} pixels are without data (-9999), NaN or infinite; they are filled"
    assert (words in lines[0]) == (not hole)
    made = io.read("out.tif")
    np.testing.assert_array_equal(made, texrs.inpaint("heights.tif", DISC).image)
    assert read_tags("out.tif") == {code: value for code, _, _, value in GEO}
    assert main(["rerun", "out.tif"]) == 0


def test_georeference_that_is_not_written_is_reported(here: Path, capsys: Capture) -> None:
    assert main(["inpaint", "heights.tif", "hole.png", "-o", "out.exr"]) == 0
    assert "heights.tif: its georeference is not written, because only TIFF files store it" in capsys.readouterr().err
    assert main(["inpaint", "heights.tif", "hole.png", "-o", "other.exr", "--strict"]) == 2
    assert not Path("other.exr").exists()
    # A design has pixels at other positions, so it does not keep the georeference.
    assert main(["design", "in.png", "-o", "new.tif", "-q"]) == 0
    assert read_tags("new.tif") == {}


def test_georeference_goes_through_tile_if_the_size_stays(here: Path, capsys: Capture) -> None:
    tifffile.imwrite("whole.tif", HEIGHTS, extratags=[(*tag, True) for tag in GEO])
    assert main(["tile", "whole.tif", "-o", "same.tif"]) == 0
    assert io.read("same.tif").shape == HEIGHTS.shape
    assert read_tags("same.tif") == {code: value for code, _, _, value in GEO}
    assert "georeference" not in capsys.readouterr().err
    assert main(["tile", "whole.tif", "-o", "less.tif", "--size", "40x40"]) == 0
    assert "whole.tif: its georeference is not written, because the size changed" in capsys.readouterr().err
    assert read_tags("less.tif") == {}


def test_nodata_that_is_used_as_values_is_reported(here: Path, capsys: Capture) -> None:
    words = (
        f"heights.tif: its nodata value -9999 is ignored, so {DISC.sum()} pixels with this value are used as data; "
        "texrs inpaint can fill them"
    )
    with pytest.warns(InputWarning, match=words):
        made = texrs.tile("heights.tif")
    assert made.report["ignored"] == [words]
    assert main(["tile", "heights.tif", "-o", "out.tif"]) == 0
    assert words in capsys.readouterr().err
    assert main(["tile", "heights.tif", "-o", "out.tif", "--strict", "--force"]) == 2
    tifffile.imwrite("whole.tif", HEIGHTS, extratags=[(*tag, True) for tag in GEO])
    assert "ignored" not in texrs.tile("whole.tif").report


# --- commands --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("command", ["inpaint in.png", "remove in.png"])
def test_commands_refuse_what_marks_nothing_and_warn_of_much(here: Path, capsys: Capture, command: str) -> None:
    flat = ["--slant", "0"] if command.startswith("remove") else []
    assert main([*command.split(), "empty.png", "-o", "out.png", *flat]) == 2
    assert "empty.png: marks nothing, so there is nothing to " in capsys.readouterr().err
    assert not Path("out.png").exists()
    assert main([*command.split(), "inverted.png", "--invert", "-o", "out.png", *flat]) == 0
    assert "inverted.png" not in capsys.readouterr().err.replace("wrote", "")
    assert main([*command.split(), "hole.png", "-o", "same.png", *flat]) == 0
    assert " % filled" in capsys.readouterr().err.splitlines()[-1]
    np.testing.assert_array_equal(io.read("out.png"), io.read("same.png"))
    assert main([*command.split(), "stroke.png", "-o", "stroke-out.png", *flat]) == 0
    assert "stroke.png: read as a layer" in capsys.readouterr().err
    np.testing.assert_array_equal(io.read("stroke-out.png"), io.read("same.png"))


def test_a_file_that_is_missing_is_named_once(here: Path, capsys: Capture) -> None:
    for command in ("inpaint in.png no.png", "remove in.png no.png", "inpaint in.png hole.png --allowed no.png"):
        assert main([*command.split(), "-o", "out.png"]) == 2
        assert capsys.readouterr().err.splitlines()[-1] == "texrs: no.png: does not exist"


def test_an_inverted_mask_is_warned_of(here: Path, capsys: Capture) -> None:
    assert main(["inpaint", "in.png", "inverted.png", "-o", "out.png"]) == 0
    said = capsys.readouterr().err
    assert "inverted.png: marks 92 % of the image; if the rest is meant, invert the mask (--invert)" in said
    assert "91.7 % filled" in said


def test_options_of_masks_are_those_of_the_class(here: Path, capsys: Capture) -> None:
    options = "--threshold 0.2 --grow 3 --feather 4 --seed 2"
    assert main(["inpaint", "in.png", "hole.png", "-o", "out.png", "--source-map", "map.npz", *options.split()]) == 0
    expected = texrs.inpaint(BRICKS, Mask(WHITE, threshold=0.2, grow=3, feather=4), seed=2)
    np.testing.assert_array_equal(io.read("out.png"), expected.image)
    assert main(["apply", "map.npz", "in.png", "-o", "again.png", "-q"]) == 0
    np.testing.assert_array_equal(io.read("again.png"), expected.image)
    assert main(["inpaint", "in.png", "-o", "no.png", "--grow", "3"]) == 2
    assert "--grow: must be combined with MASK" in capsys.readouterr().err


@pytest.mark.parametrize(
    "command",
    [
        "inpaint in.png hole.png --allowed {}",
        "extend in.png --right 8 --slant 10 --ground {}",
        "analyse in.png --mask {}",
        "scale-map in.png --mask {}",
        "apply map.npz in.png --within {}",
    ],
)
def test_all_masks_of_commands_are_read_alike(here: Path, capsys: Capture, command: str) -> None:
    texrs.SourceMap.identity(SIZE).save("map.npz")
    out = "out.npz" if command.startswith("analyse") else "out.tif"
    drawn = (np.hypot(ROWS % 16 - 8, COLUMNS % 16 - 8) < 5) | (COLUMNS > 90)
    io.write("drawn.png", as_layer((0, 0, 0), drawn.astype(np.uint8) * 255))
    assert main([*command.format("empty.png").split(), "-o", out]) == 2
    assert "empty.png: marks nothing" in capsys.readouterr().err
    assert main([*command.format("drawn.png").split(), "-o", out]) == 0
    said = capsys.readouterr().err
    assert "drawn.png: read as a layer" in said
    assert f"drawn.png: read as a mask that marks {100 * drawn.mean():.3g} % of the image" in said


def test_warnings_of_python_are_only_of_what_is_not_used() -> None:
    """Assumptions are only in the report."""
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("error", InputWarning)
        texrs.inpaint(BRICKS, as_layer((0, 0, 0), WHITE))


def test_words_after_a_name_say_how_a_mask_is_read(here: Path, capsys: Capture) -> None:
    """Commands have several masks, so the words belong to one of them, and `texrs rerun` finds the file."""
    seen = np.full(BRICKS.shape[:2], 255, np.uint8)
    seen[:12] = 0
    io.write("seen.png", seen)
    io.write("unseen.png", 255 - seen)
    io.write("faint.png", seen // 4 + np.uint8(4))
    view = "rectify in.png --slant 30 --fov 60 -o"
    results = []
    for number, words in enumerate(("seen.png", "unseen.png:invert", "faint.png:threshold=0.1")):
        assert main([*f"{view} {number}.png".split(), "--ground", words]) == 0
        results.append(io.read(f"{number}.png"))
    assert all((made == results[0]).all() for made in results)
    capsys.readouterr()
    assert main([*f"{view} grown.png".split(), "--ground", "unseen.png:invert,grow=-4"]) == 0
    share = float(np.mean(np.arange(len(seen)) >= 16))
    assert f"unseen.png: read as a mask that marks {100 * share:.3g} % of the image" in capsys.readouterr().err
    Path("other").mkdir()
    assert (
        main(
            ["rectify", "in.png", "--slant", "30", "--fov", "60", "--ground", "unseen.png:invert", "-o", "other/o.png"]
        )
        == 0
    )
    assert "../unseen.png" in json.loads(str(io.read_metadata("other/o.png").made))["inputs"]
    assert main(["rerun", "other/o.png"]) == 0
    assert main([*f"{view} no.png".split(), "--ground", "seen.png:grow=much"]) == 2
    assert "--grow: must be a number, as in grow=2; got 'much'" in capsys.readouterr().err
    for command in ("scale-map in.png -o s.npy --mask", "analyse in.png -o e.npz --mask"):
        assert main([*command.split(), "unseen.png:invert,grow=-99"]) == 2
        assert "marks nothing" in capsys.readouterr().err


def test_samples_without_a_header_are_made_again_from_another_folder(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    np.tile(BRICKS[:16, :16, 0], (16, 1, 1)).tofile("a.raw")
    Path("other").mkdir()
    assert main(["solid", "a.raw:16x16x16:uint8", "--size", "16x16x16", "--quality", "fast", "-o", "other/o.tif"]) == 0
    assert "../a.raw" in json.loads(str(io.read_metadata("other/o.tif").made))["inputs"]
    monkeypatch.chdir("other")
    assert main(["rerun", "o.tif"]) == 0

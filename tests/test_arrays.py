"""Containers of images: every verb accepts them, or refuses them with a reason."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray
from PIL import Image

import texrs
from texrs._arrays import as_image, as_mask, as_ndarray, to_unit
from texrs.errors import FileError, InvalidInput
from texrs.kernels.gather import gather
from texrs.kernels.mean_shift import mean_shift
from texrs.kernels.poisson import solve
from texrs.kernels.regions import felzenszwalb

PEBBLES = texrs.samples.pebbles((64, 64)).image
DISCS = texrs.samples.tilted_discs((96, 96)).image
HOLE = np.zeros((64, 64), bool)
HOLE[20:34, 24:40] = True
VIEW = texrs.PlaneView(slant=35, fov=60)
NEAR = np.zeros((96, 96), bool)
NEAR[50:60, 40:50] = True


class Handed:
    """An array that only DLPack exports."""

    def __init__(self, array):
        self.array = array

    def __dlpack__(self, **options):
        return self.array.__dlpack__(**options)

    def __dlpack_device__(self):
        return self.array.__dlpack_device__()


def keep(array, how: str, folder: Path) -> Any:
    """Return an array of uint8 in another library's container."""
    match how:
        case "str" | "path":
            path = folder / "picture.png"
            texrs.io.write(path, array)
            return path if how == "path" else str(path)
        case "pil":
            return Image.fromarray(array)
        case "palette":
            return Image.fromarray(array).convert("P", palette=Image.Palette.ADAPTIVE, colors=16)
        case "xarray":
            return xarray.DataArray(array, dims=("y", "x", "band")[: array.ndim])
        case "dlpack":
            return Handed(array)
        case "torch":
            return pytest.importorskip("torch", reason="is no dependency, for its size").from_numpy(array.copy())
        case "masked":
            return np.ma.masked_array(array, np.zeros(array.shape, bool))
        case "list":
            return array.tolist()
        case _:
            return memoryview(array)


WAYS = ("str", "path", "pil", "xarray", "dlpack", "torch", "masked", "memoryview")
VERBS = {
    "tile": (PEBBLES, lambda image: texrs.tile(image).image),
    "design": (PEBBLES, lambda image: texrs.design(image, 96, way="still").image),
    "design of several": (PEBBLES, lambda image: texrs.design([image, image], 64, way="still").image),
    "design_variants": (
        PEBBLES,
        lambda image: next(iter(texrs.design_variants(image, 1, 64))).image,
    ),
    "splice": (PEBBLES, lambda image: texrs.splice(image, image, 64).image),
    "perspective": (PEBBLES, lambda image: texrs.perspective(image, np.ones((64, 64)), 64).image),
    "synthesize": (PEBBLES, lambda image: texrs.synthesize(image, 64).image),
    "solid": (PEBBLES, lambda image: texrs.PlaneTexture(image).window((0, 0), (32, 32)).image),
    "inpaint": (PEBBLES, lambda image: texrs.inpaint(image, HOLE).image),
    "inpaint by": (PEBBLES, lambda image: texrs.inpaint(as_ndarray(image, "image"), HOLE, exemplar=image).image),
    "rectify": (DISCS, lambda image: texrs.rectify(image, view=VIEW).image),
    "extend": (DISCS, lambda image: texrs.extend(image, right=8, view=VIEW).image),
    "remove": (DISCS, lambda image: texrs.remove(image, NEAR, view=VIEW).image),
    "render": (PEBBLES, lambda image: texrs.SourceMap.identity((64, 64)).render(image)),
    "blend": (PEBBLES, lambda image: texrs.blend(texrs.SourceMap.identity((64, 64)), image, wrap=True)),
    "judge": (
        PEBBLES,
        lambda image: texrs.metrics.evaluate(image, texrs.SourceMap.identity((64, 64)), image=image).score,
    ),
    "analyse": (PEBBLES, lambda image: texrs.elements.analyse(image).points),
    "segment": (PEBBLES, lambda image: texrs.exemplar.segment(image).elements),
    "find": (DISCS, lambda image: texrs.planes.find(image).slant),
    "auto_mask": (DISCS, lambda image: texrs.scale_maps.auto_mask(image)),
    "regions": (PEBBLES, lambda image: felzenszwalb(image, 0.2)),
    "mean_shift": (PEBBLES, lambda image: mean_shift(image, 2, 0.1)),
    "solve": (PEBBLES, lambda image: solve(image, np.zeros((64, 64, 3)), np.zeros((64, 64, 3)))),
    "compare": (PEBBLES, lambda image: texrs.volume.compare(image, image, axes=2).autocorrelation),
    "gather": (PEBBLES, lambda image: gather(image, [[1.5, 2.5]])),
}
SLOW = ("splice", "analyse", "find")


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_takes_a_picture_with_a_palette_in_a_file_or_in_hand(verb: str, tmp_path: Path):
    image, call = VERBS[verb]
    picture = keep(image, "palette", tmp_path)
    path = tmp_path / "palette.png"
    picture.save(path)
    colours = np.asarray(picture.convert("RGB"))
    expected = call(colours)
    for given in (picture, path)[verb in SLOW :]:
        assert np.array_equal(call(given), expected)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("shape", [(24, 31), (24, 31, 3)])
def test_an_array_is_the_same_whoever_keeps_it(way: str, shape: tuple[int, ...], tmp_path: Path):
    array = np.random.default_rng(3).integers(0, 256, shape, np.uint8)
    given = keep(array, way, tmp_path)
    taken = as_ndarray(given, "image")
    assert taken.dtype == np.uint8
    assert np.array_equal(taken, array)
    exemplar = texrs.Exemplar(given)
    assert np.array_equal(exemplar.image, array)
    assert exemplar.image.shape == shape


def test_a_volume_is_read_from_a_file_where_a_volume_is_needed(tmp_path: Path):
    texrs.io.write_volume(tmp_path / "cube.tif", np.arange(60, dtype=np.uint8).reshape(3, 4, 5))
    assert as_image(tmp_path / "cube.tif", axes=3).shape == (3, 4, 5, 1)
    with pytest.raises(FileError, match="exemplar: .*read_volume"):
        as_image(tmp_path / "cube.tif", "exemplar")


MODES = {
    "1": ("1", np.bool_, ()),
    "L": ("L", np.uint8, ()),
    "LA": ("LA", np.uint8, (2,)),
    "La": ("LA", np.uint8, (2,)),
    "I;16": ("I;16", np.uint16, ()),
    "I;16B": ("I;16B", np.uint16, ()),
    "I": ("I", np.int32, ()),
    "F": ("F", np.float32, ()),
    "RGB": ("RGB", np.uint8, (3,)),
    "RGBX": ("RGB", np.uint8, (3,)),
    "RGBA": ("RGBA", np.uint8, (4,)),
    "RGBa": ("RGBA", np.uint8, (4,)),
    "P": ("RGB", np.uint8, (3,)),
    "PA": ("RGBA", np.uint8, (4,)),
    "YCbCr": ("RGB", np.uint8, (3,)),
    "HSV": ("RGB", np.uint8, (3,)),
}
"""Conversion of each mode of PIL: the mode, the dtype and the channels."""


def make_picture(mode: str) -> Image.Image:
    """Return an image of a mode, with colours and possibly transparency."""
    colours = np.random.default_rng(1).integers(0, 256, (20, 24, 4), np.uint8)
    whole = Image.fromarray(colours)
    if mode in ("LA", "RGBA", "PA"):
        return whole.convert(mode)
    if mode in ("La", "RGBa"):
        return whole.convert({"La": "LA", "RGBa": "RGBA"}[mode]).convert(mode)
    if mode.startswith("I;16"):
        return Image.frombytes(mode, (24, 20), colours[..., :2].tobytes())
    if mode == "LAB":
        return Image.frombytes(mode, (24, 20), colours[..., :3].tobytes())
    return whole.convert("RGB").convert("L" if mode in ("I", "F") else "RGB").convert(mode)


@pytest.mark.parametrize("mode", MODES)
def test_every_mode_of_pil_is_taken_as_it_looks(mode: str):
    as_what, dtype, channels = MODES[mode]
    picture = make_picture(mode)
    assert picture.mode == mode
    expected = np.asarray(picture if as_what == mode else picture.convert(as_what))
    taken = as_image(picture)
    assert taken.dtype == dtype
    assert taken.shape == (20, 24, *(channels or (1,)))
    assert np.array_equal(taken.reshape(expected.shape), expected)


@pytest.mark.parametrize("mode", ["CMYK", "LAB"])
def test_inks_and_lab_are_refused_with_what_to_do(mode: str):
    with pytest.raises(
        InvalidInput, match=f"image: the mode {mode} of this PIL image is not supported; convert it with "
    ):
        texrs.tile(make_picture(mode))


@pytest.mark.parametrize("mode", ["P", "L", "RGB"])
def test_a_colour_that_stands_for_transparency_becomes_alpha(mode: str, tmp_path: Path):
    picture = make_picture(mode)
    clear = picture.getpixel((3, 2))
    picture.save(tmp_path / "clear.png", transparency=clear)
    opened = Image.open(tmp_path / "clear.png")
    taken = as_image(opened)
    assert taken.shape[-1] == {"L": 2}.get(mode, 4)
    assert taken[2, 3, -1] == 0
    assert taken[..., -1].max() == 255
    assert np.array_equal(taken, as_image(tmp_path / "clear.png"))


def test_what_is_masked_is_a_hole():
    known = np.ma.masked_array(PEBBLES, np.repeat(HOLE[..., np.newaxis], 3, axis=-1))
    expected = texrs.inpaint(PEBBLES, HOLE).image
    assert np.array_equal(texrs.inpaint(known).image, expected)
    # A pixel is filled if one of its channels is masked, and pixels of the given mask are filled as well.
    part = np.ma.masked_array(PEBBLES, np.zeros(PEBBLES.shape, bool))
    part[20:34, 24:40, 1] = np.ma.masked
    upper, lower = HOLE.copy(), HOLE.copy()
    upper[27:], lower[:27] = False, False
    assert np.array_equal(texrs.inpaint(part).image, expected)
    half = np.ma.masked_array(PEBBLES, np.repeat(upper[..., np.newaxis], 3, axis=-1))
    assert np.array_equal(texrs.inpaint(half, lower).image, expected)
    for verb in (texrs.tile, texrs.design, texrs.Exemplar, texrs.elements.analyse):
        with pytest.raises(InvalidInput, match=r": 672 of 12288 values are masked; fill them with texrs.inpaint"):
            verb(known)
    with pytest.raises(
        InvalidInput, match="mask: must be a mask, 'alpha', 'nan', 'nodata' or a number, unless the image"
    ):
        texrs.inpaint(PEBBLES)


@pytest.mark.parametrize("shape", [(3, 64, 64), (1, 64, 64), (4, 256, 256), (3, 12, 9)])
def test_channels_first_is_noticed(shape: tuple[int, ...]):
    with pytest.raises(
        InvalidInput,
        match=rf"image: must have its channels last, .* {shape[0]} channels first.* numpy.moveaxis\(image, 0, -1\)",
    ):
        texrs.tile(np.zeros(shape, np.uint8))


def test_channels_first_is_noticed_in_volumes_and_batches_but_not_guessed():
    with pytest.raises(
        InvalidInput, match=r"exemplar: must have its channels last, got shape \(3, 16, 16, 16\) with 3 channels first"
    ):
        texrs.solid(np.zeros((3, 16, 16, 16), np.uint8), 16)
    with pytest.raises(
        InvalidInput, match="image: must be one image with its channels last, got shape .* a batch of 8 images with"
    ):
        texrs.tile(np.zeros((8, 3, 32, 32), np.uint8))
    for shape in ((3, 64), (3, 64, 3), (2, 5, 6), (9, 64, 64)):
        assert as_image(np.zeros(shape, np.uint8)).shape[:2] == shape[:2]
    assert as_image(np.zeros((3, 64, 64), np.uint8), axes=3).shape == (3, 64, 64, 1)


def test_labels_of_64_bits_go_through_and_stay_exact():
    classes = (np.indices((48, 48)).sum(axis=0) // 6 % 3).astype(np.int64) * 2**61 - 7
    for result in (texrs.tile(classes), texrs.synthesize(classes, 64), texrs.design(classes, 64, way="still")):
        assert result.image.dtype == np.int64
        assert set(np.unique(result.image)) <= set(np.unique(classes))
    hole = np.zeros((48, 48), bool)
    hole[20:28, 20:28] = True
    filled = texrs.inpaint(classes, hole).image
    assert np.array_equal(filled[~hole], classes[~hole])


def test_integers_of_64_bits_are_interpolated_where_floats_hold_them():
    ramp = np.arange(12, dtype=np.uint64).reshape(3, 4) * 10
    assert gather(ramp, [[1, 1.5], [2, 3]]).tolist() == [55, 110]
    large = ramp + np.uint64(2**63)
    assert gather(large, [[2, 3]], interpolation="cubic") == large[2, 3]
    assert gather(large, [[1, 1.6]]) == gather(large, [[1, 1.6]], interpolation="nearest") == large[1, 2]


def test_wide_integers_are_seen_by_their_own_range():
    small = np.array([[0, 51, 255]])
    for dtype in (np.int32, np.uint32, np.int64, np.uint64):
        assert np.array_equal(to_unit(small.astype(dtype)), to_unit(small.astype(np.uint8)))
    assert to_unit(np.full((2, 2), -4)).tolist() == [[0, 0], [0, 0]]
    # The difference of two doubles may exceed the range of doubles.
    assert to_unit(np.array([[-1.7e308, 0.0, 1.7e308]])).tolist() == [[0, 0.5, 1]]


def test_a_mask_may_be_a_file_or_a_coloured_picture(tmp_path: Path):
    marked = np.zeros((*HOLE.shape, 4), np.uint8)
    marked[..., 3] = 255
    marked[HOLE, 1] = 9
    texrs.io.write(tmp_path / "hole.png", marked)
    for given in (tmp_path / "hole.png", Image.fromarray(marked), Image.fromarray(marked[..., :3])):
        assert np.array_equal(as_mask(given, "mask", HOLE.shape), HOLE)
    with pytest.raises(InvalidInput, match="mask: must have shape"):
        as_mask(marked, "mask", HOLE.shape)


def test_what_cannot_be_taken_is_said_in_a_sentence(tmp_path: Path):
    class Elsewhere:
        def __array__(self, dtype=None, copy=None):
            raise RuntimeError("lies on another device;\n call .cpu()")

    with pytest.raises(
        InvalidInput, match=r"^image: is not an array of numbers \(lies on another device; call \.cpu\(\)\)$"
    ):
        texrs.tile(Elsewhere())
    with pytest.raises(FileError, match=r"^image: .*nowhere\.png: does not exist$"):
        texrs.tile(tmp_path / "nowhere.png")
    with pytest.raises(InvalidInput, match="image: must contain integers, floats or bool"):
        texrs.tile([["a", "b"], ["c", "d"]])

"""texrs.inpaint with scale maps and by optimisation."""

import numpy as np
import pytest
from scipy import ndimage
from skimage import data

import perspective_checks as checks
import texrs
from reference.look_up import view
from texrs.errors import FileError, InvalidInput


@pytest.fixture(scope="module")
def floor():
    return checks.floor((160, 160))


def hole_in(shape, *boxes):
    hole = np.zeros(shape, bool)
    for top, bottom, left, right in boxes:
        hole[top:bottom, left:right] = True
    return hole


def fill(image, hole, *, seed=1, **options):
    bare = np.where(hole[..., np.newaxis] if image.ndim == 3 else hole, 0, image).astype(image.dtype)
    return texrs.inpaint(bare, hole, seed=seed, **options)


@pytest.mark.parametrize("method", ["patch", "optimise"])
def test_holes_are_filled_from_outside_them_without_a_seam(floor, method):
    image, scale = floor
    hole = hole_in(image.shape[:2], (40, 110, 45, 115))
    result = fill(image, hole, scale_map=np.where(hole, np.nan, scale).astype(np.float32), method=method)
    np.testing.assert_array_equal(result.image[~hole], image[~hole])
    assert result.report["scaled"]
    assert 0.5 <= checks.seam(result.image, hole) / checks.seam(image, hole) <= 1.6
    # Nothing is copied from the hole.
    at = np.rint(result.source_map.coordinates[hole]).astype(int)
    assert not hole[at[:, 0], at[:, 1]].any()


@pytest.mark.parametrize("method", ["patch", "optimise"])
def test_elements_in_the_hole_grow_as_those_around_it(floor, method):
    image, scale = floor
    hole, inside = hole_in(image.shape[:2], (40, 110, 45, 115)), hole_in(image.shape[:2], (46, 104, 51, 109))
    known = np.where(hole, np.nan, scale).astype(np.float32)

    def agreement(picture):
        return np.corrcoef(np.log(checks.wavelength(picture)[inside]), np.log(scale[inside]))[0, 1]

    # Only a few elements fill the hole, so average several results.
    found = [agreement(fill(image, hole, seed=seed, scale_map=known, method=method).image) for seed in range(6)]
    assert np.mean(found) >= 0.95 * agreement(image), found


@pytest.mark.parametrize(
    "boxes",
    [[(0, 30, 0, 40)], [(20, 40, 100, 160), (90, 130, 20, 60)], [(150, 160, 150, 160)], [(60, 61, 60, 61)]],
    ids=["corner", "several", "last corner", "one pixel"],
)
@pytest.mark.parametrize("scaled", [False, True])
def test_holes_anywhere(floor, boxes, scaled):
    image, scale = floor
    hole = hole_in(image.shape[:2], *boxes)
    result = fill(image, hole, method="optimise", scale_map=scale if scaled else None)
    np.testing.assert_array_equal(result.image[~hole], image[~hole])
    bare = np.where(hole[..., None], 0, image).astype(np.uint8)
    np.testing.assert_array_equal(view(result.source_map, bare), result.image)


@pytest.mark.parametrize("method", ["patch", "optimise"])
def test_a_scale_map_that_is_measured(floor, method):
    image, _ = floor
    hole = hole_in(image.shape[:2], (50, 90, 50, 100))
    result = fill(image, hole, scale_map="auto", method=method)
    np.testing.assert_array_equal(result.image[~hole], image[~hole])


@pytest.mark.parametrize("method", ["patch", "optimise"])
def test_a_second_picture_gives_elements_of_the_size_that_belongs_there(floor, method):
    image, scale = floor
    hole = hole_in(image.shape[:2], (40, 110, 45, 115))
    # Copy from another floor of the same kind, whose elements are large at the other end.
    other, theirs = (np.ascontiguousarray(a[::-1]) for a in checks.floor((170, 190), seed=3))
    result = fill(image, hole, method=method, exemplar=other, scale_map=scale, exemplar_scale_map=theirs)
    np.testing.assert_array_equal(result.image[~hole], image[~hole])
    assert (result.source_map.exemplar == hole).all()
    bare = np.where(hole[..., np.newaxis], 0, image).astype(np.uint8)
    np.testing.assert_array_equal(view(result.source_map, [bare, other]), result.image)
    frame = result.source_map.jacobian_array()
    size = np.ones(image.shape[:2]) if frame is None else 1 / frame[result.source_map.label][..., 0, 0]
    shown = result.source_map.render([scale, theirs], interpolation="linear") * size
    wrong = np.abs(np.log(shown / scale))[hole]
    plain = fill(image, hole, method=method, exemplar=other)
    without = np.abs(np.log(plain.source_map.render([scale, theirs], interpolation="linear") / scale))[hole]
    assert np.median(wrong) < 0.12
    assert np.median(wrong) < 0.7 * np.median(without)


def test_a_source_from_the_front_is_resized(floor):
    image, scale = floor
    hole = hole_in(image.shape[:2], (20, 140, 45, 115))
    flat, _ = checks.floor((160, 160), seed=3, span=(1, 1))
    result = fill(image, hole, method="optimise", exemplar=flat, scale_map=scale)
    size = 1 / result.source_map.jacobian_array()[result.source_map.label][..., 0, 0]
    assert np.corrcoef(np.log(size[hole]), np.log(scale[hole]))[0, 1] > 0.8


def test_all_of_a_picture_from_another():
    other, theirs = checks.floor((96, 96))
    image, everything = np.zeros((64, 80, 3), np.uint8), np.ones((64, 80), bool)
    ramp = np.linspace(0.7, 1.5, 64, dtype=np.float32)[:, np.newaxis].repeat(80, axis=1)
    result = texrs.inpaint(
        image, everything, exemplar=other, scale_map=ramp, exemplar_scale_map=theirs, method="optimise", screening=1e-4
    )
    assert result.source_map.exemplar.all()
    assert result.image.std() > 20


def test_transparency_is_the_hole(floor):
    image, _ = floor
    hole = hole_in(image.shape[:2], (50, 90, 50, 100))
    alpha = np.where(hole, 0, 255).astype(np.uint8)
    result = texrs.inpaint(np.dstack([image, alpha]), "alpha", seed=1)
    np.testing.assert_array_equal(result.image[..., :3], fill(image, hole).image)
    assert (result.image[..., 3] == 255).all()
    with pytest.raises(InvalidInput, match="mask: no pixel of the image is transparent"):
        texrs.inpaint(result.image, "alpha")
    with pytest.raises(FileError, match="mask: beta: does not exist"):
        texrs.inpaint(result.image, "beta")


@pytest.mark.parametrize("method", ["patch", "optimise"])
@pytest.mark.parametrize("box", [(40, 80, 45, 95), (0, 70, 60, 160)], ids=["inside", "corner"])
def test_blending_takes_the_light_of_the_picture(method, box):
    image = data.grass()[:160, :160]
    hole = hole_in(image.shape, box)
    dark = (data.grass()[200:360, 200:360] * 0.7).astype(np.uint8)
    plain = fill(image, hole, method=method, exemplar=dark)
    light = fill(image, hole, method=method, exemplar=dark, screening=1e-4)
    np.testing.assert_array_equal(light.image[~hole], image[~hole])
    np.testing.assert_array_equal(light.stages["before_blending"], plain.image)
    np.testing.assert_array_equal(light.source_map.coordinates, plain.source_map.coordinates)

    def off(picture):
        return abs(picture[hole].mean() - image[hole].mean())

    assert off(light.image) < 0.75 * off(plain.image)
    assert checks.seam(light.image, hole) < checks.seam(plain.image, hole)


def test_any_array_and_the_same_bytes(floor):
    image, scale = floor
    hole = hole_in(image.shape[:2], (50, 90, 50, 100))
    deep = image[..., 0].astype(np.uint16) * 257
    with texrs.threads(1):
        one = fill(deep, hole, scale_map=scale, method="optimise")
    with texrs.threads(7):
        many = fill(deep, hole, scale_map=scale, method="optimise")
    assert one.image.dtype == np.uint16
    assert one.image.shape == deep.shape
    assert one.image.tobytes() == many.image.tobytes()


@pytest.mark.parametrize("boundary", [5, 1024])
def test_optimisation_may_replace_the_boundary(floor, boundary):
    image, scale = floor
    hole = hole_in(image.shape[:2], (60, 90, 60, 100))
    wide = ndimage.distance_transform_edt(~hole) <= boundary
    result = fill(image, hole, method="optimise", scale_map=scale, boundary_width=boundary)
    np.testing.assert_array_equal(result.source_map.label > 0, wide)
    np.testing.assert_array_equal(result.image[~wide], image[~wide])
    assert (result.image != image)[wide & ~hole].any()
    assert result.report["replaced_outside"] == np.count_nonzero(wide & ~hole)


def test_an_output_that_wraps(floor):
    image, _ = floor
    hole = hole_in(image.shape[:2], (60, 100, 0, 20), (60, 100, 140, 160))
    result = fill(image, hole, method="optimise", wrap=(False, True))
    np.testing.assert_array_equal(result.image[~hole], image[~hole])


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"scale_map": np.ones((3, 3))}, "scale_map: must have shape"),
        ({"scale_map": np.zeros((64, 64))}, "scale_map: |scale: "),
        (
            {
                "scale_map": np.ones((64, 64)),
                "exemplar": np.zeros((40, 40), np.uint8),
                "exemplar_scale_map": np.ones((30, 40)),
            },
            "exemplar_scale_map: must have shape",
        ),
        (
            {"method": "optimise", "exemplar": np.zeros((12, 40), np.uint8)},
            "exemplar: must have at least 16",
        ),
        (
            {"mask": np.ones((64, 64), bool), "scale_map": "auto", "exemplar": np.zeros((40, 40), np.uint8)},
            "scale_map: 'auto' requires known pixels",
        ),
        ({"mask": "alpha"}, "mask: 'alpha' needs an image with an alpha channel"),
        ({"method": "optimise", "patch_size": 12}, "patch_size: cannot be combined with method='optimise'"),
        ({"method": "optimise", "mask": np.indices((64, 64)).sum(axis=0) % 4 > 0}, "mask: must leave a larger part"),
    ],
)
def test_bad_input_is_named(options, sentence):
    hole = hole_in((64, 64), (20, 30, 20, 30))
    image = np.random.default_rng(0).integers(0, 255, (64, 64), np.uint8)
    with pytest.raises(InvalidInput, match=sentence):
        texrs.inpaint(image, options.pop("mask", hole), **options)


def test_pictures_without_an_axis_of_channels_are_filled_in_perspective():
    floor = texrs.samples.tilted_discs((96, 96)).image
    hole = np.zeros((96, 96), bool)
    hole[40:60, 40:60] = True
    made = texrs.inpaint(floor[..., 0], hole, scale_map="auto")
    assert np.array_equal(made.image, texrs.inpaint(floor[..., :1], hole, scale_map="auto").image[..., 0])

"""texrs.perspective: valid and invalid arguments, and the agreement of its map and its image."""

import warnings

import numpy as np
import pytest

import texrs
from reference.look_up import view
from texrs import samples
from texrs.errors import Cancelled, InvalidInput


@pytest.fixture(scope="module")
def floor():
    return samples.tilted_discs((96, 96))


def grow(floor, size=64, **options):
    return texrs.perspective(floor.image, floor.scale_map, size, **options)


def test_the_map_is_the_picture(floor):
    result = grow(floor, (64, 80), seed=3)
    assert result.image.shape == (64, 80, 3)
    assert result.image.dtype == floor.image.dtype
    np.testing.assert_array_equal(result.source_map.render(floor.image, antialias=True), result.image)
    # Pixels that are not shrunk are only looked up.
    whole = np.abs(np.linalg.det(result.source_map.jacobians())) <= 1
    assert 0.2 < whole.mean() < 1
    np.testing.assert_array_equal(view(result.source_map, floor.image)[whole], result.image[whole])
    assert result.stages["target"].shape == (64, 80)
    assert result.report["scale_error"] <= 0.08


def test_maps_in_register_follow_in_any_dtype(floor):
    result = grow(floor, seed=1)
    red = floor.image[..., 0]
    for twin in (red.astype(np.uint16) * 257, red.astype(np.float32) / 255):
        shown = result.source_map.render(twin, interpolation="nearest").astype(float) / twin.max() * red.max()
        np.testing.assert_allclose(shown, view(result.source_map, red, "nearest"), atol=1e-3)
    whole = grow(floor, seed=1, augment_scales=False)
    assert (whole.source_map.coordinates == np.rint(whole.source_map.coordinates)).all()


def test_what_comes_in_comes_out():
    floor = samples.tilted_discs((64, 64))
    grey = floor.image[..., 1]
    deep = grey.astype(np.uint16) * 257
    stack = np.concatenate([floor.image, floor.image[..., :2]], axis=-1)
    found = texrs.perspective(grey, floor.scale_map, 48, seed=2)
    assert found.image.shape == (48, 48)
    finer = texrs.perspective(deep, floor.scale_map, 48, seed=2)
    assert finer.image.dtype == np.uint16
    np.testing.assert_array_equal(finer.source_map.coordinates, found.source_map.coordinates)
    assert texrs.perspective(stack, floor.scale_map, 48).image.shape == (48, 48, 5)
    assert texrs.perspective(grey / 255, floor.scale_map, 48).image.dtype == np.float64


@pytest.mark.parametrize("count", [2, 7])
def test_same_bytes_for_any_number_of_threads(floor, count):
    with texrs.threads(1):
        one = grow(floor, 96, seed=5)
    with texrs.threads(count):
        many = grow(floor, 96, seed=5)
    np.testing.assert_array_equal(one.source_map.coordinates, many.source_map.coordinates)
    assert one.image.tobytes() == many.image.tobytes()


def test_seeds_differ(floor):
    assert (grow(floor, seed=1).source_map.coordinates != grow(floor, seed=2).source_map.coordinates).any(
        axis=-1
    ).mean() > 0.5


def test_an_output_that_repeats(floor):
    across = np.exp(0.4 * np.cos(2 * np.pi * np.arange(64) / 64))[np.newaxis].repeat(64, axis=0)
    result = grow(floor, 64, target=across.astype(np.float32), wrap=(False, True), seed=1)
    image = result.image.astype(float)
    inner = np.abs(np.diff(image, axis=1)).mean()
    assert np.abs(image[:, 0] - image[:, -1]).mean() <= 1.6 * inner
    with pytest.raises(InvalidInput, match="wrap: the target's first and last rows differ by a factor of"):
        grow(floor, wrap=(True, False))


def test_scales_that_the_exemplar_has_not_are_made_or_brought_to_those_it_has(floor):
    small = np.full((48, 48), float(floor.scale_map.min()) / 2, np.float32)
    result = grow(floor, 48, target=small, seed=1)
    assert result.report["sheet"]["kind"] == "plane"
    assert result.report["scale_error"] <= 0.1
    mixed = small.copy()
    mixed[:24] = 1
    with pytest.warns(
        UserWarning,
        match=r"target: 50.0% of the pixels are outside the scales of the exemplar's copies, by a factor of",
    ):
        held = grow(floor, 48, target=mixed, augment_scales=False)
    assert held.report["outside"]["share"] == pytest.approx(0.5)
    with pytest.raises(InvalidInput, match="target: some scales must be from"):
        grow(floor, 48, target=small, augment_scales=False)


def test_a_target_of_another_size_is_stretched(floor):
    pattern = np.array([[0.6, 1.2], [0.8, 1.6]], np.float32)
    result = grow(floor, (40, 60), target=pattern, seed=1)
    np.testing.assert_array_equal(result.stages["target"], texrs.scale_maps.resample(pattern, (40, 60)))
    assert result.report["scale_error"] <= 0.15


def test_scales_are_measured_in_a_mask_where_that_is_asked():
    image = samples.tilted_discs((128, 128)).image
    how = texrs.scale_maps.Measuring(min_feature_size=2, foreshortened=True)
    made = texrs.perspective(image, size=64, scale_measurement=how, seed=1)
    given = texrs.perspective(image, how.measure(image), 64, seed=1)
    np.testing.assert_array_equal(made.image, given.image)
    mask = texrs.scale_maps.auto_mask(image, min_feature_size=2)
    wide = texrs.scale_maps.from_mask(mask, trend="plane", foreshortened=True)
    np.testing.assert_array_equal(made.stages["target"], texrs.scale_maps.resample(wide, (64, 64)))


@pytest.mark.parametrize(
    "change",
    [
        {"size": 0},
        {"seed": -1},
        {"augment_scales": [9.0]},
        {"wrap": "xy"},
        {"target": np.zeros((4, 4), np.float32)},
        {"interpolation": "sinc"},
    ],
)
def test_bad_input_is_refused_before_anything_is_measured(floor, change, monkeypatch):
    def measure(*_):
        raise AssertionError("measured")

    monkeypatch.setattr("texrs.papers.perspective.request.measure_known_scale", measure)
    with pytest.raises(InvalidInput, match=next(iter(change))):
        texrs.perspective(floor.image, **change)


def test_without_weight_scales_do_not_count(floor):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = grow(floor, 96, scale_weight=0, seed=1)
    assert result.report["scale_error"] > 0.15


def test_sizes_that_are_given(floor):
    result = grow(floor, augment_scales=[0.5, 1.3])
    assert result.report["sheet"]["sizes"] == pytest.approx([1, 0.5, 1.3], abs=0.02)


def test_progress_and_stopping(floor):
    seen = []
    grow(floor, progress=lambda stage, share: seen.append(stage))
    assert "patches" in seen

    def stop(stage, share):
        raise KeyboardInterrupt

    with pytest.raises((KeyboardInterrupt, Cancelled)):
        grow(floor, progress=stop)


BAD = [
    ({"scale_map": np.ones((9, 9))}, "scale_map: must have shape"),
    ({"scale_map": np.zeros((32, 32))}, "scale_map: 1024 of 1024 scales are outside"),
    ({"scale_map": np.full((32, 32), -1.0)}, "scale_map: "),
    ({"scale_map": np.ones((32, 32), np.uint8)}, "scale_map: must be floats"),
    ({"target": np.ones((5, 5, 7), np.float32)}, "target: must have shape"),
    (
        {"scale_map": "auto", "scale_measurement": {"min_feature_size": 3}},
        "scale_measurement: must be a texrs.scale_maps.Measuring",
    ),
    (
        {"scale_map": "auto", "scale_measurement": texrs.scale_maps.Measuring(min_feature_size=9)},
        "min_feature_size: must be a number between 0.5 and 8",
    ),
    ({"augment_scales": [9.0]}, "augment_scales: "),
]


@pytest.mark.parametrize(("change", "sentence"), BAD, ids=[s for _, s in BAD])
def test_bad_input_is_named(change, sentence):
    given = {"exemplar": np.zeros((32, 32, 3), np.uint8), "scale_map": np.ones((32, 32)), "size": 32} | change
    exemplar, scale, size = (given.pop(k) for k in ("exemplar", "scale_map", "size"))
    with pytest.raises(InvalidInput, match=sentence):
        texrs.perspective(exemplar, scale, size, **given)


@pytest.mark.parametrize("shape", [(16, 16), (16, 300), (17, 33), (1000, 16)])
def test_odd_exemplars_and_outputs(shape):
    noise = np.random.default_rng(1).integers(0, 255, (*shape, 3), np.uint8)
    scale = np.linspace(0.7, 1.4, shape[0], dtype=np.float32)[:, np.newaxis].repeat(shape[1], axis=1)
    for size in ((1, 1), (3, 50), (40, 40)):
        assert texrs.perspective(noise, scale, size).image.shape == (*size, 3)
    plain = np.full((*shape, 3), 7, np.uint8)
    assert (texrs.perspective(plain, scale, 20).image == 7).all()
    assert (texrs.perspective(plain, np.ones(shape), 20).image == 7).all()

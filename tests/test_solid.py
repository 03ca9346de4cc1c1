"""SOLID, end to end: any array, size and border; true source maps; the same bytes for any number of threads."""

from __future__ import annotations

import os
import subprocess
import sys
import tracemalloc

import numpy as np
import pytest

import texrs
from reference.look_up import view
from texrs import fields, samples, volume
from texrs._engine.pyramid import ONE
from texrs.errors import Cancelled, InvalidInput, LimitExceeded
from texrs.exemplar.analysis import are_labels, code_colours, measure_repeat

STRIPES = samples.stripes((32, 32, 32)).image
PARTICLES = samples.particles((32, 32, 32))
WEAVE = samples.weave((48, 48)).image
TURNING = fields.zigzag(period=24)


@pytest.fixture(scope="module")
def result():
    return texrs.solid(STRIPES, (33, 40, 21), seed=3, field=TURNING)


def seen(made, exemplar):
    """Return the exemplar looked up through the source map, by the slow twin."""
    return view(made.source_map, exemplar, made.report["interpolation"])


def check_seen(made, exemplar):
    """Check that the composite equals its map's lookup: integers exactly, floats except for the order of sums."""
    composite, expected = made.stages["before_blending"], seen(made, exemplar)
    assert composite.dtype == expected.dtype
    if composite.dtype.kind == "f":
        np.testing.assert_allclose(composite, expected, rtol=1e-3 if composite.dtype == np.float16 else 1e-6, atol=1e-5)
    else:
        np.testing.assert_array_equal(composite, expected)


# --- any array -------------------------------------------------------------------------------------------------------

GREY = STRIPES[..., 0]
ARRAYS = {
    "uint8, three channels": STRIPES,
    "uint8, none": GREY,
    "uint16, one": GREY[..., None].astype(np.uint16) * 257,
    "float32, colours and alpha": np.concatenate(
        [STRIPES / np.float32(255), PARTICLES.mask[..., None]], axis=-1
    ).astype(np.float32),
    "float64, beyond the unit": (GREY * 3.0 - 200),
    "float16, two": np.stack([GREY, GREY[::-1]], axis=-1).astype(np.float16) / 255,
    "int16, six": np.stack([np.roll(GREY, c, 0) for c in range(6)], axis=-1).astype(np.int16) - 99,
    "bool": PARTICLES.mask,
    "constant": np.full((16, 16, 16), 7, np.uint8),
}


@pytest.mark.parametrize("name", ARRAYS)
def test_what_comes_in_is_what_comes_out(name):
    exemplar = ARRAYS[name]
    made = texrs.solid(exemplar, 24, seed=1, quality="fast", field=fields.rotation(25))
    assert made.image.dtype == exemplar.dtype
    assert made.image.shape == (24, 24, 24, *exemplar.shape[3:])
    check_seen(made, exemplar)
    np.testing.assert_array_equal(made.image, made.stages["before_blending"])
    assert made.image.min() >= exemplar.min() - 1e-3  # the lookup stays in range
    assert made.image.max() <= exemplar.max() + 1e-3


@pytest.mark.parametrize("name", ARRAYS)
def test_pictures_too(name):
    exemplar = ARRAYS[name][5]
    for options in ({"wrap": True}, {"field": fields.rotation(25, axes=2)}, {"quality": "fast"}):
        made = texrs.synthesize(exemplar, (37, 20), seed=1, **options)
        assert made.image.dtype == exemplar.dtype
        assert made.image.shape == (37, 20, *exemplar.shape[2:])
        check_seen(made, exemplar)


@pytest.mark.parametrize("interpolation", ["nearest", "linear", "cubic"])
def test_the_map_renders_the_picture(interpolation):
    made = texrs.synthesize(WEAVE, (40, 56), field=fields.spiral(axes=2), interpolation=interpolation)
    assert made.report["interpolation"] == interpolation
    check_seen(made, WEAVE)


@pytest.mark.parametrize("field", [None, fields.constant([[0.8, -0.6], [0.6, 0.8]])], ids=["straight", "turned"])
def test_patches_of_an_image_are_in_step_with_its_lattice(field):
    rows, columns = np.indices((130, 140))
    noise = np.random.default_rng(0).normal(0, 0.1, rows.shape)
    light = 0.5 + 0.1 * (np.cos(2 * np.pi * rows / 26) + np.cos(2 * np.pi * columns / 26) + noise)
    studs = np.repeat(light[..., None], 3, axis=2).astype(np.float32)
    made = texrs.synthesize(studs, (180, 190), field=field)
    assert made.report["in_step"]
    assert len(np.unique(made.source_map.label)) > 2
    frame = np.eye(2) if field is None else field.jacobians(np.zeros((1, 2)))[0]
    moved = (made.source_map.coordinates - np.moveaxis(np.indices((180, 190)), 0, -1) @ frame.T) / 26
    assert np.abs(moved - np.rint(moved)).max() < 0.2
    # Given points and periodic outputs decide where patches are.
    assert not texrs.synthesize(studs, 96, wrap=True).report["in_step"]


def test_labels_are_classes_without_an_order():
    marked = (np.cumsum(np.random.default_rng(0).random((24, 24, 24)) < 0.06, axis=0) % 5).astype(np.uint8)
    made = texrs.solid(marked, 32, field=TURNING, quality="fast")
    assert made.report["interpolation"] == "nearest"
    assert set(np.unique(made.image)) <= set(range(5))
    # Other names for the classes, in the same order, do not change anything else.
    renamed = np.array([3, 7, 20, 100, 255], np.uint8)
    again = texrs.solid(renamed[marked], 32, field=TURNING, quality="fast")
    np.testing.assert_array_equal(again.image, renamed[made.image])
    codes = code_colours(np.array([3, 0, 4, 1, 2], np.uint8)[marked][..., None])
    assert all(len(np.unique(codes[marked == k], axis=0)) == 1 for k in range(5))
    assert (
        texrs.solid(texrs.Exemplar(marked, axes=3, labels=False), 20, quality="fast").report["interpolation"] == "cubic"
    )
    sparse = (marked * 40).astype(np.int32)
    sparse = texrs.Exemplar(sparse, axes=3, labels=True)
    assert set(np.unique(texrs.solid(sparse, 20, quality="fast").image)) <= set(np.unique(sparse.image))


@pytest.mark.parametrize("values", [(0, 255), (0, 128, 255), (False, True), (-7, 900), range(0, 160, 10)])
def test_few_whole_numbers_are_labels_whatever_they_are(values):
    """No values are invented between them, and their names do not matter."""
    kinds, named = len(values), np.array(values)
    named = named.astype(
        {"i": np.int16, "u": np.uint8, "b": bool}["u" if values[-1] in (150, 255) else named.dtype.kind]
    )
    turned = np.indices((32, 32, 32)).sum(axis=0) // 4 % kinds
    made = texrs.solid(named[turned], 32, field=TURNING, quality="fast")
    assert made.report["interpolation"] == "nearest"
    assert set(np.unique(made.image)) <= set(values)
    codes = code_colours(named[turned][..., None])
    assert codes.shape[-1] == (1 if kinds == 2 else min(kinds, 4))
    np.testing.assert_array_equal(codes, code_colours(turned.astype(np.uint16)[..., None], labels=True))
    grown = texrs.synthesize(named[turned[5]], 40, quality="fast", field=fields.spiral(axes=2))
    assert set(np.unique(grown.image)) <= set(values)


def test_more_values_are_greys():
    assert not are_labels(np.arange(17)[:, None, None])
    assert are_labels(np.arange(16)[:, None, None])
    assert not are_labels(np.zeros((20, 20, 1), np.uint8))
    assert not are_labels(np.array([0.0, 1.0])[:, None, None])


def test_every_map_in_register_follows(result):
    coded = np.stack(np.meshgrid(*[np.arange(32, dtype=np.uint16)] * 3, indexing="ij"), axis=-1)
    at = result.source_map.render(coded, interpolation="nearest")
    np.testing.assert_array_equal(at, np.floor(result.source_map.coordinates + np.float32(0.5)))
    nearest = result.source_map.render(STRIPES, interpolation="nearest")
    np.testing.assert_array_equal(nearest, STRIPES[tuple(np.moveaxis(at, -1, 0))])
    sixteen = result.source_map.render(STRIPES.astype(np.uint16) * 257, interpolation="cubic")
    assert sixteen.dtype == np.uint16
    assert np.abs(sixteen / 257 - result.image).max() <= 0.51


def test_depth_does_not_change_the_decisions():
    eight = texrs.solid(GREY, 24, seed=2, quality="fast").source_map
    sixteen = texrs.solid(GREY.astype(np.uint16) * 257, 24, seed=2, quality="fast").source_map
    np.testing.assert_array_equal(eight.coordinates, sixteen.coordinates)


# --- any size, any border --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [17, (33, 40, 21), (1, 5, 30), (16, 2, 65), 1])
def test_any_size(size):
    made = texrs.solid(STRIPES, size, quality="fast", wrap=(False, True, False))
    sides = (size,) * 3 if isinstance(size, int) else size
    assert made.image.shape == (*sides, 3)
    assert made.source_map.coordinates.shape == (*sides, 3)
    assert (made.source_map.coordinates >= 0).all()
    assert (made.source_map.coordinates <= 31).all()


@pytest.mark.parametrize("size", [17, (1, 70), (50, 3), 1, (16, 200)])
@pytest.mark.parametrize("wrap", [False, True])
def test_any_size_of_pictures(size, wrap):
    made = texrs.synthesize(WEAVE, size, wrap=wrap)
    assert made.image.shape == (*((size, size) if isinstance(size, int) else size), 3)
    assert (made.source_map.coordinates >= 0).all()
    assert (made.source_map.coordinates <= 47).all()


@pytest.mark.parametrize("shape", [(16, 16, 16), (16, 40, 72), (50, 19, 23)])
def test_any_exemplar(shape):
    exemplar = samples.particles((80, 80, 80)).image[tuple(slice(0, n) for n in shape)]
    made = texrs.solid(exemplar, 30, quality="fast")
    assert made.image.shape == (30, 30, 30, 3)
    assert len(made.report["levels"]) == 1
    # A complete copy would not be a texture.
    assert volume.cell_reuse(made.source_map).largest < 0.6


@pytest.mark.parametrize("size", [(36, 40), (37, 41), (64, 33)])
def test_pictures_close_along_the_axes_that_wrap(size):
    pebbles = samples.pebbles((96, 96)).image
    free, closed = (texrs.synthesize(pebbles, size, wrap=w, seed=2).image for w in (False, (True, False)))
    inner, across = changes(closed, (True, False))[0]
    assert across <= 1.25 * np.quantile(inner, 0.95)
    inner, across = changes(free, True)[0]
    assert across > 1.25 * np.median(inner)


def changes(image, wrap):
    """Return for each axis the changes between inner lines, and the change from the last to the first."""
    seen = volume.lightness(image)
    return [(c[:-1], c[-1]) for c in volume.seam_planes(seen, wrap=wrap)]


@pytest.mark.parametrize("size", [(32, 36, 40), (33, 35, 41)])
@pytest.mark.parametrize("wrap", [(True, True, True), (False, False, True)])
def test_volumes_close_along_the_axes_that_wrap(size, wrap):
    made = texrs.solid(samples.particles((48, 48, 48), seed=1).image[:41, :41, :41], size, wrap=wrap, seed=1)
    for (inner, across), closed in zip(changes(made.image, True), wrap, strict=True):
        assert (across <= 1.1 * inner.max()) or not closed, (across, inner.max())
        assert (across > inner.max()) or closed, (across, inner.max())


def test_exemplars_that_repeat_are_found_by_measurement():
    whole = samples.particles((64, 64, 64)).image
    assert measure_repeat(whole, axes=3) == (True, True, True)
    assert measure_repeat(whole[:, 5:], axes=3) == (True, False, True)
    assert measure_repeat(np.roll(whole, 9, 1), axes=3) == (True, True, True)
    assert measure_repeat(STRIPES, axes=3) != (True, True, True)
    around = texrs.solid(whole, 40, seed=4)
    assert around.report["periodic_axes"] == [True, True, True]
    bounded = texrs.solid(texrs.Exemplar(whole, axes=3, repeat=False), 40, seed=4)
    assert bounded.report["periodic_axes"] == [False, False, False]
    # In a periodic exemplar, patches continue across its ends, so all of it can be used.
    across = [
        sum(
            (
                (np.abs(np.diff(made.source_map.coordinates[..., a], axis=a)) > 60)
                & (np.diff(made.source_map.label, axis=a) == 0)
            ).sum()
            for a in range(3)
        )
        for made in (around, bounded)
    ]
    assert across[0] > 500
    assert across[1] == 0


# --- same bytes ------------------------------------------------------------------------------------------------------

SCRIPT = """
import hashlib, os, sys
import texrs
from texrs import fields, samples

def digest():
    made = texrs.solid(samples.stripes((32, 32, 32)).image, (21, 32, 27), seed=5, field=fields.circular(axis="x"))
    flat = texrs.synthesize(samples.weave((48, 48)).image, (50, 41), seed=5, wrap=True)
    return hashlib.sha256(made.source_map.coordinates.tobytes() + made.image.tobytes() + flat.image.tobytes()).hexdigest()

if "fork" in sys.argv:
    print(digest(), flush=True)
    child = os.fork()
    if child == 0:
        print(digest(), flush=True)
        os._exit(0)
    assert os.waitpid(child, 0)[1] == 0
else:
    for count in (1, 2, 7):
        with texrs.threads(count):
            texrs.exemplar._exemplar._FACTS.clear()
            print(digest())
    print(digest())
"""


def digests(*arguments):
    command = [sys.executable, "-c", SCRIPT, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True)
    return done.stdout.split()


def test_same_bytes_for_any_number_of_threads():
    found = digests()
    assert len(found) == 4
    assert len(set(found)) == 1


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the platform has no fork")
def test_a_forked_child_finishes_with_the_same_bytes():
    parent, child = digests("fork")
    assert parent == child


@pytest.mark.parametrize("field", [None, TURNING])
def test_another_seed_is_another_texture(field):
    one, again, other = (
        texrs.solid(STRIPES, 30, seed=s, field=field, quality="fast").source_map for s in (1, 1, 2**64 - 1)
    )
    np.testing.assert_array_equal(one.coordinates, again.coordinates)
    assert (one.coordinates != other.coordinates).any(axis=-1).mean() > 0.9


# --- exemplars -------------------------------------------------------------------------------------------------------


def test_an_exemplar_is_as_good_as_its_array(tmp_path):
    known = texrs.Exemplar(STRIPES, axes=3)
    known.save(tmp_path / "a.npz")
    made = [texrs.solid(e, 24, seed=2) for e in (STRIPES, known, texrs.Exemplar.load(tmp_path / "a.npz"))]
    for other in made[1:]:
        np.testing.assert_array_equal(other.image, made[0].image)
        assert other.report == made[0].report


# --- maps, reports, stages -------------------------------------------------------------------------------------------


def test_a_map_with_a_varying_field_is_kept(result, tmp_path):
    result.source_map.save(tmp_path / "map.npz")
    again = texrs.SourceMap.load(tmp_path / "map.npz")
    np.testing.assert_array_equal(view(again, STRIPES), result.image)
    np.testing.assert_allclose(again.jacobians(), result.source_map.jacobians(), atol=1e-6)
    whole = volume.compare(STRIPES, result.image, result.source_map, TURNING)
    loaded = volume.compare(STRIPES, result.image, again, TURNING)
    assert whole.text == loaded.text
    assert volume.cell_reuse(result.source_map) == volume.cell_reuse(again)
    assert whole.reuse.coherent > 0.4


def test_reports_and_stages_are_saved(result, tmp_path):
    import imageio.v3 as iio

    assert [level["shape"] for level in result.report["levels"]] == [[33, 40, 21]]
    assert list(result.stages) == ["patches", "before_blending"]
    names = [p.name for p in result.save_stages(tmp_path / "stages")]
    assert names == ["01-patches.png", "02-before-blending.png", "report.json"]
    shown = iio.imread(tmp_path / "stages" / "02-before-blending.png")
    np.testing.assert_array_equal(shown, volume.slices(result.image))
    corrected = texrs.solid(STRIPES, (33, 40, 21), quality="fast")
    assert [level["shape"] for level in corrected.report["levels"]] == [[17, 20, 11], [33, 40, 21]]
    assert list(corrected.stages) == ["blocks", "level 1", "level 2", "before_blending"]
    assert result._repr_png_().startswith(b"\x89PNG")
    flat = texrs.synthesize(WEAVE, 40)
    paths = flat.save_stages(tmp_path / "flat")
    np.testing.assert_array_equal(iio.imread(paths[-2]), flat.image)


@pytest.mark.parametrize("size", [20, (3, 17, 40)])
@pytest.mark.parametrize("name", ["uint8, three channels", "int16, six", "bool", "constant"])
def test_optimise_tries_more_places(name, size):
    exemplar = ARRAYS[name]
    made = texrs.solid(exemplar, size, quality="optimise", field=TURNING, seed=1)
    assert made.report["quality"] == "optimise"
    assert made.report["stitched"]["patches"] >= 1
    check_seen(made, exemplar)


def test_more_places_make_cheaper_seams():
    pebbles, field = samples.pebbles((160, 160)).image, fields.circular(axes=2)
    seams = [
        np.mean(
            [
                texrs.synthesize(pebbles, 256, seed=s, quality=q, field=field).report["stitched"]["seams"]
                for s in range(4)
            ]
        )
        for q in ("preserve", "optimise")
    ]
    assert seams[1] < seams[0]


def test_open_fields_are_set_by_the_size():
    made = texrs.solid(STRIPES, 20, field=fields.circular(axis="x"), quality="fast")
    assert "about (9.5, 9.5, 9.5)" in made.report["field"]
    assert texrs.solid(STRIPES, 20, field=fields.identity(), quality="fast").report["field"] is None


def test_progress_is_reported_and_raising_stops_at_each_stage():
    reported = []
    for quality in ("preserve", "fast"):
        texrs.solid(STRIPES, 20, quality=quality, progress=lambda stage, share: reported.append((stage, share)))
    # The analysis of the exemplar is only reported if it takes a long time.
    stages = [stage for stage in dict.fromkeys(stage for stage, _ in reported) if stage != "exemplar"]
    assert stages == ["patches", "blocks", "level 1 of 2", "level 2 of 2"]
    for name in stages:
        shares = [share for stage, share in reported if stage == name]
        assert shares == sorted(shares)
        assert 0 <= shares[0] <= shares[-1] <= 1

        def stop(stage, share, name=name):
            if stage == name:
                raise Cancelled("enough")

        with pytest.raises(Cancelled):
            texrs.solid(STRIPES, 20, quality="preserve" if name == "patches" else "fast", progress=stop)


def test_memory_is_refused_before_it_is_taken():
    texrs.Exemplar(STRIPES, axes=3).analyse()
    tracemalloc.start()
    try:
        for size, options in (
            (10_000, {}),
            ((2**27, 2, 1), {"field": TURNING}),
            (64, {"memory_limit": 2**20}),
            (2**40, {}),
        ):
            with pytest.raises(LimitExceeded, match="size: "):
                texrs.solid(STRIPES, size, **options)
        assert tracemalloc.get_traced_memory()[1] < 2**20
    finally:
        tracemalloc.stop()


# --- bad input -------------------------------------------------------------------------------------------------------

NAN = STRIPES.astype(np.float32)
NAN[3, 4, 5, 0] = np.nan
SIZED = np.ones((20, 20, 20), bool)
MANY = texrs.Exemplar(np.arange(32**3, dtype=np.int32).reshape(32, 32, 32), axes=3, labels=True)


def held(mask, **what):
    """Return the option that fixes some voxels."""
    return {"constraints": texrs.Constraints(mask=mask, **what)}


@pytest.mark.parametrize(
    ("exemplar", "options", "says"),
    [
        (NAN, {}, "exemplar: must be finite, but 1 of 98304 values are NaN"),
        ([["a"]], {}, "exemplar: must contain integers, floats or bool"),
        (STRIPES, {"field": fields.zigzag(axes=2)}, "field: must be a field with 3 axes, got <2-D field"),
        (STRIPES, {"field": fields.constant(np.eye(3) * 0.12)}, "field: must not shrink elements"),
        (
            STRIPES,
            {"field": fields.from_function(lambda p: np.eye(3) * (10 - p[:, 2, None, None]), 3)},
            "field: the frame at (plane, row, column)",
        ),
        (texrs.Exemplar(WEAVE), {}, "exemplar: must be an Exemplar with axes=3, got one with axes=2"),
        (texrs.Exemplar(STRIPES[:15], axes=3), {}, "exemplar: each side must be at least 16"),
        (MANY, {}, "labels: must have at most 4096 classes"),
        (STRIPES, held(SIZED[:9], values=STRIPES), "mask: must have shape (20, 20, 20)"),
        (STRIPES, held(SIZED * 0.5, values=STRIPES), "mask: must be bool or integers"),
        (
            STRIPES,
            held(SIZED, values=STRIPES),
            "values: must be uint8 (the dtype of the exemplar) of shape (20, 20, 20, 3)",
        ),
        (STRIPES, held(SIZED, values=np.zeros((20, 20, 20, 3))), "values: must be uint8"),
        (
            NAN[8:24, 8:24, 8:24],
            held(SIZED, values=np.full((20, 20, 20, 3), np.inf, np.float32)),
            "values: must be finite",
        ),
        (STRIPES, held(SIZED, coordinates=np.full((20, 20, 20, 3), 32.0)), "coordinates: must be finite and inside"),
        (STRIPES, held(SIZED, coordinates=np.full((20, 20, 20, 3), np.nan)), "coordinates: must be finite and inside"),
        (STRIPES, held(SIZED, coordinates=np.zeros((20, 20, 20, 2))), "coordinates: must be numbers of shape"),
    ],
)
def test_bad_input_gets_a_sentence(exemplar, options, says):
    with pytest.raises(InvalidInput) as caught:
        texrs.solid(exemplar, **{"size": 20, **options})
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_bad_input_of_pictures():
    for exemplar, size, options, says in (
        (WEAVE[:10], 20, {}, "exemplar: each side must be at least 16"),
        (STRIPES, 20, {}, "a volume is not an image"),
        (WEAVE, (20, 20, 20), {}, "size: must be an integer or integers (rows, columns)"),
        (WEAVE, 20, {"field": fields.rotation_3d()}, "field: must be a field with 2 axes, got <3-D field"),
    ):
        with pytest.raises(InvalidInput) as caught:
            texrs.synthesize(exemplar, size, **options)
        assert says in str(caught.value)


def test_places_are_exact_in_fixed_point(result):
    steps = result.source_map.coordinates.astype(np.float64) * ONE
    np.testing.assert_array_equal(steps, np.rint(steps))

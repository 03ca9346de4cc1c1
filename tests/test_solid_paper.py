"""SOLID as printed (``method="paper"``), and the reasons for the departures of the default."""

import numpy as np
import pytest

import texrs
from texrs import fields, samples, volume
from texrs._engine.appearance import Appearance
from texrs._engine.pyramid import ONE
from texrs._threads import threads
from texrs.errors import InvalidInput
from texrs.papers.solid.literal import bring_inside

SIZE = 48


def grow(exemplar, field=None, method="paper", size=SIZE, **options):
    made = texrs.solid(exemplar, size, field=field, method=method, seed=1, **options)
    assert np.isfinite(made.source_map.coordinates).all()
    return made


@pytest.fixture(scope="module")
def stripes():
    return samples.stripes((48, 48, 48)).image


@pytest.fixture(scope="module")
def of_stripes(stripes):
    return {method: grow(stripes, method=method) for method in (None, "paper")}


# --- it runs ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("field", [None, fields.zigzag(period=32, axes=2), fields.circular(axes=2)])
@pytest.mark.parametrize("wrap", [False, True])
def test_pictures(field, wrap):
    weave = samples.weave((64, 64)).image
    made = texrs.synthesize(weave, (70, 51), field=field, wrap=wrap, method="paper")
    assert made.image.shape == (70, 51, 3)
    assert made.report["method"] == "paper"
    assert made.report["quality"] is None
    passes = [level["passes"] for level in made.report["levels"]]
    assert passes == [0] * (len(passes) - 3) + [2] * 3
    assert made.report["levels"][0]["shape"] == [1, 1]
    colours = {tuple(c) for c in weave.reshape(-1, 3)}
    assert {tuple(c) for c in made.image.reshape(-1, 3)} <= colours


def test_every_size_down_to_one():
    weave = samples.weave((64, 64)).image
    for size in ((1, 1), (1, 9), (3, 200), (8, 8)):
        assert texrs.synthesize(weave, size, method="paper").image.shape == (*size, 3)


def test_threads_change_nothing(stripes):
    field = fields.zigzag(period=32, axes=3)
    made = []
    for count in (1, 2, 7):
        with threads(count):
            made.append(grow(stripes, field, size=(40, 33, 36)).source_map.coordinates)
    assert made[0].tobytes() == made[1].tobytes() == made[2].tobytes()
    other = texrs.solid(stripes, (40, 33, 36), field=field, method="paper", seed=2).source_map.coordinates
    assert (other != made[0]).any(axis=-1).mean() > 0.9


def test_labels_thin_volumes_and_other_channels():
    rng = np.random.default_rng(0)
    facies = rng.integers(0, 3, (16, 20, 40)).astype(np.uint8)
    assert set(np.unique(grow(facies, size=24).image)) <= {0, 1, 2}
    assert grow(rng.random((17, 18, 19, 2)), size=20).image.shape == (20, 20, 20, 2)


def test_what_it_does_not_do():
    weave = samples.weave((64, 64)).image
    given = texrs.Constraints(mask=np.ones((32, 32), bool), values=weave[:32, :32])
    with pytest.raises(InvalidInput, match="constraints: cannot be combined with method='paper'"):
        texrs.synthesize(weave, 32, method="paper", constraints=given)
    with pytest.raises(InvalidInput, match="method: must be one of None, 'paper', 'paper-compensated'"):
        texrs.synthesize(weave, 32, method="su")
    with pytest.raises(ValueError, match="stop"):
        texrs.synthesize(weave, 32, method="paper", progress=stop)


def stop(_stage, _share):
    raise ValueError("stop")


def test_coordinates_that_leave_come_back_on_the_other_side():
    exemplar = Appearance(np.random.default_rng(0).random((20, 24)), axes=2, wrap=(False, True))
    places = np.array([17, 23, 18, 24, 1, -1, 2, 0], np.int32) * ONE
    assert (bring_inside(places, exemplar, 0).reshape(4, 2) // ONE).tolist() == [
        [17, 23],
        [2, 0],
        [17, -1 % 24],
        [2, 0],
    ]


# --- what it fails, and the default does not -------------------------------------------------------------------------


def speckle(image):
    """Return the share of voxels that differ from both neighbours along an axis, the same way, by 1/3 of the range."""
    grey = volume.lightness(image)
    least = (np.quantile(grey, 0.95) - np.quantile(grey, 0.05)) / 3
    alone = []
    for axis in range(grey.ndim):
        line = np.moveaxis(grey, axis, 0)
        before, after = line[1:-1] - line[:-2], line[1:-1] - line[2:]
        alone.append(((np.minimum(before, after) > least) | (np.maximum(before, after) < -least)).mean())
    return float(np.mean(alone))


def test_neighbours_hardly_ever_go_on_together(of_stripes):
    """Eight diagonal neighbours form separate lattices, and fractions of a voxel never meet."""
    coherent = {m: volume.cell_reuse(made.source_map).coherent for m, made in of_stripes.items()}
    assert coherent["paper"] < 0.03
    assert coherent[None] > 0.65


def test_speckle(of_stripes, stripes):
    found = {m: speckle(made.image) for m, made in of_stripes.items()}
    assert found["paper"] > 20 * speckle(stripes)
    assert found["paper"] > 5 * found[None]


def test_turned_textures_lie_wrong_and_are_too_fine(stripes):
    field = fields.rotation_3d()
    normal = volume.texture_normal(volume.lightness(stripes))
    off, size = {}, {}
    for method in (None, "paper"):
        made = grow(stripes, field, method)
        seen = volume.lightness(made.image)
        off[method] = np.median(volume.orientation_errors(seen, field.over(seen.shape), normal, margin=6))
        same = made.source_map.render(stripes, interpolation="nearest")
        pair = [volume.frequency(volume.lightness(i), window=48, whole=True) for i in (same, stripes)]
        size[method] = pair[0] / pair[1]
    assert off[None] < 8 < 12 < off["paper"]
    assert 0.9 < size[None] < 1.1 < 1.15 < size["paper"]


def test_most_of_which_compensation_cures(stripes):
    """Compensated windows allow for the offset of the lattice (Lefebvre and Hoppe 2006), which the paper omits."""
    field = fields.rotation_3d()
    normal = volume.texture_normal(volume.lightness(stripes))
    off = []
    for method in ("paper", "paper-compensated"):
        made = grow(stripes, field, method)
        assert made.report["method"] == method
        seen = volume.lightness(made.image)
        off.append(np.median(volume.orientation_errors(seen, field.over(seen.shape), normal, margin=6)))
    assert off[1] < 0.8 * off[0]


def test_rare_particles_are_lost():
    sample = samples.particles((48, 48, 48))
    rare = {}
    for method in (None, "paper"):
        made = grow(sample.image, None, method)
        there = made.source_map.render(sample.mask.astype(np.uint8), interpolation="nearest") > 0
        rare[method] = there.mean() / (sample.mask > 0).mean()
    assert rare["paper"] < 0.5 < 0.7 < rare[None]

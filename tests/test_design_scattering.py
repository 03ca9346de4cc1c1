"""Elements of one exemplar scattered over another: whole, separate, and as dense as requested."""

import numpy as np
import pytest
from scipy.ndimage import binary_dilation

import texrs
from texrs import samples
from texrs.elements import ElementAnalysis
from texrs.errors import InvalidInput
from texrs.exemplar.segmentation import Segmentation
from texrs.papers.design.elements import measure_elements
from texrs.papers.design.scattering import EDGE

SIZE = (192, 224)
COPIED = texrs.DeformationOptions(operations=0)


@pytest.fixture(scope="module")
def grit():
    return samples.grit((96, 96)).image


@pytest.fixture(scope="module")
def flowers():
    return samples.leaves_and_flowers((128, 128)).image


@pytest.fixture(scope="module")
def pebbles():
    return ElementAnalysis.of_sample(samples.pebbles((112, 112)))


def covered(result, which):
    return float((result.source_map.exemplar == which).mean())


@pytest.mark.parametrize(("density", "seed"), [(0.05, 0), (0.15, 1), (0.3, 1), (0.45, 0)])
def test_densities_are_kept(grit, pebbles, density, seed):
    result = texrs.design([grit, pebbles], SIZE, density=density, seed=seed, copies=1)
    [said] = result.report["density"]
    assert covered(result, 1) == pytest.approx(density, rel=0.03)
    assert (said["asked"], said["reached"]) == (density, pytest.approx(covered(result, 1), abs=1e-4))
    assert said["elements"] == np.unique(result.source_map.label[result.source_map.exemplar == 1]).size > 3


def test_things_are_whole_and_apart(grit, pebbles):
    result = texrs.design([grit, pebbles], SIZE, density=0.15, deformation=COPIED, copies=1, screening=None)
    source = result.source_map
    whole = {e.label: int((e.distance > EDGE).sum()) for e in measure_elements(pebbles.labels) if not any(e.touches)}
    lies = source.exemplar == 1
    shown = np.where(lies, source.label, 0)
    scattered = np.unique(shown[lies])
    assert len(scattered) > 3
    for label in scattered:
        mine = shown == label
        row, column = source.coordinates[mine].astype(int).T
        [element] = np.unique(pebbles.labels[row, column])
        assert mine.sum() == whole[element]
        rolled = np.pad(mine, 2, mode="wrap")
        beside = binary_dilation(rolled)[2:-2, 2:-2] & ~mine
        assert not lies[beside].any()
    np.testing.assert_array_equal(result.image[lies], pebbles.image[tuple(source.coordinates[lies].astype(int).T)])


def test_a_map_says_where_how_much_lies(grit, pebbles):
    density = np.zeros(SIZE)
    density[:, 112:] = 0.3
    result = texrs.design([grit, pebbles], SIZE, density=density, copies=1, wrap=False)
    lies = result.source_map.exemplar == 1
    assert lies.mean() == pytest.approx(0.15, rel=0.03)
    # An element extends beyond its area by less than half of its size.
    assert lies[:, :100].mean() < 0.01
    assert lies[:, 124:].mean() > 0.25


def test_a_map_may_rise_slowly(grit, flowers):
    density = 0.4 * np.linspace(0, 1, 384) * np.ones((256, 1))
    result = texrs.design([grit, flowers], (256, 384), density=density, copies=1, wrap=False)
    lies, parts = result.source_map.exemplar == 1, [np.s_[:, k : k + 128] for k in (0, 128, 256)]
    for part in parts:
        assert lies[part].mean() == pytest.approx(density[part].mean(), abs=0.06)


def test_later_exemplars_lie_above(grit, flowers, pebbles):
    result = texrs.design([grit, flowers, pebbles], SIZE, density=[0.3, 0.15], deformation=COPIED, copies=1)
    assert [covered(result, k) for k in (1, 2)] == pytest.approx([0.3, 0.15], rel=0.03)
    whole = {e.label: int((e.distance > EDGE).sum()) for e in measure_elements(pebbles.labels)}
    top = result.source_map.exemplar == 2
    for label in np.unique(result.source_map.label[top]):
        mine = result.source_map.label == label
        row, column = result.source_map.coordinates[mine].astype(int).T
        assert mine.sum() == whole[int(pebbles.labels[row[0], column[0]])]


def test_nothing_is_scattered_at_a_density_of_nothing(grit, pebbles):
    alone = texrs.design(grit, SIZE, copies=1)
    none = texrs.design([grit, pebbles], SIZE, density=0, copies=1)
    np.testing.assert_array_equal(alone.image, none.image)


def test_what_cannot_be_reached_is_said(grit, pebbles):
    result = texrs.design([grit, pebbles], (96, 64), density=1.0, copies=1)
    [said] = result.report["density"]
    assert 0.3 < said["reached"] < 1
    assert said["reached"] == pytest.approx(covered(result, 1), abs=1e-4)


def test_things_go_around_the_ends_of_cyclic_axes(grit, pebbles):
    result = texrs.design([grit, pebbles], 96, density=0.3, copies=1, wrap=(True, False), seed=2)
    labels = np.where(result.source_map.exemplar == 1, result.source_map.label, 0)
    around = (labels[0] == labels[-1]) & (labels[0] > 0)
    aside = (labels[:, 0] == labels[:, -1]) & (labels[:, 0] > 0)
    assert around.any()
    assert not aside.any()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"density": 1.2}, "^density: must be shares"),
        ({"density": -0.1}, "^density: must be shares"),
        ({"density": [0.2, 0.2]}, "^density: must be one number"),
        ({"density": np.zeros((5, 5))}, "^density: must be one number"),
        ({"density": "much"}, "^density"),
        ({"density": 0.2, "weights": [1, 1]}, "^density: .*cannot be combined with weights"),
        ({"density": 0.2, "method": "paper"}, "^density: .*cannot be combined with method"),
    ],
)
def test_densities_are_checked(grit, pebbles, options, message):
    with pytest.raises(InvalidInput, match=message):
        texrs.design([grit, pebbles], 64, **options)


def test_there_must_be_things(grit, pebbles):
    with pytest.raises(InvalidInput, match="^density: requires at least two exemplars"):
        texrs.design(grit, 64, density=0.2)
    plain = np.full((64, 64, 3), 90, np.uint8)
    assert isinstance(texrs.Exemplar(plain).segment(), Segmentation)
    with pytest.raises(InvalidInput, match="^density: exemplar 1 must have separate elements"):
        texrs.design([pebbles, plain], 64, density=0.2)

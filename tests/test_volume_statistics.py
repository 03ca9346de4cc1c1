"""Statistics of volumes: known answers, and the checks of a synthesis on good and bad results."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.ndimage import map_coordinates

from texrs import SourceMap, fields, samples, volume
from texrs.errors import InvalidInput

RNG = np.random.default_rng(3)


@pytest.fixture(scope="module")
def stripes():
    return volume.lightness(samples.stripes().image)


@pytest.fixture(scope="module")
def particles():
    return samples.particles()


def warped(exemplar, field, side=56):
    """Return the result of a perfect synthesis of a constant field: the resampled exemplar."""
    grid = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), -1) - (side - 1) / 2
    at = grid @ field.jacobians((0, 0, 0)).T.astype(float) + 31.5
    return map_coordinates(exemplar, np.moveaxis(at, -1, 0), order=5, mode="reflect").astype(np.float32)


def source_of(coordinates, shape):
    count = coordinates.shape[:-1]
    return SourceMap(
        coordinates.astype(np.float32), np.zeros(count, np.uint16), np.zeros(count, np.uint32), None, (shape,)
    )


# --- materials -------------------------------------------------------------------------------------------------------


def test_classes_are_the_colours_that_were_drawn():
    labels = RNG.integers(0, 3, (20, 20, 20))
    tones = np.array([[20, 30, 40], [120, 100, 90], [250, 240, 230]])
    image = np.clip(tones[labels] + RNG.integers(-5, 6, (20, 20, 20, 3)), 0, 255).astype(np.uint8)
    found = volume.classes(image, 3)
    assert_allclose(found.centres * 255, tones, atol=1)
    assert_array_equal(found.of(image), labels)
    assert_allclose(found.shares(image), np.bincount(labels.ravel()) / labels.size)
    assert_array_equal(volume.classes(image, 3).centres, found.centres)


def test_classes_of_few_colours():
    flat = np.full((16, 16, 16), 7, np.uint16)
    assert len(volume.classes(flat).centres) == 1
    assert volume.classes(flat).shares(flat) == pytest.approx([1])


@pytest.mark.parametrize("axes", [2, 3])
@settings(max_examples=15)
@given(seed=st.integers(0, 10_000), share=st.floats(0, 1))
def test_correlations_against_slow_twins(axes, seed, share):
    mask = np.random.default_rng(seed).random((5, 7, 6)[:axes]) < share
    for found, along in ((volume.two_point_correlation(mask, 6), False), (volume.lineal_path_function(mask, 6), True)):
        assert found.shape == (axes, 7)
        for axis in range(axes):
            lines = np.moveaxis(mask, axis, 0)
            for step in range(7):
                hits = [
                    lines[i : i + step + 1].all(axis=0) if along else lines[i] & lines[i + step]
                    for i in range(len(lines) - step)
                ]
                if hits:
                    assert found[axis, step] == pytest.approx(np.mean(hits))
                else:
                    assert np.isnan(found[axis, step])
        assert found[0, 0] == pytest.approx(mask.mean())


def test_particles_are_counted(particles):
    inside = particles.labels > 0
    found = volume.component_statistics(inside)
    sizes = np.bincount(particles.labels.ravel())[1:]
    # Parts of a particle that the border separates count separately.
    assert len(particles.centres) <= found.count <= 1.6 * len(particles.centres)
    assert found.density == pytest.approx(1e5 * found.count / inside.size)
    assert found.mean * found.count == pytest.approx(sizes.sum(), rel=0.02)
    assert found.deciles[0] <= found.deciles[4] <= found.deciles[8]
    blocks = np.zeros((9, 9, 9), bool)
    blocks[0:2, 0:2, 0:2] = blocks[4:7, 4:7, 4:7] = blocks[7, 7, 7] = True  # The last block touches only at a corner.
    three = volume.component_statistics(blocks, least=1)
    assert (three.count, three.mean, three.median) == (3, 12, 8)
    assert three.deciles == (1, 1, 1, 8, 8, 8, 27, 27, 27)
    assert volume.component_statistics(blocks).count == 2
    assert volume.component_statistics(np.zeros((4, 4), bool)).count == 0


# --- structure -------------------------------------------------------------------------------------------------------


def test_frequency_is_that_of_waves():
    at = np.indices((64, 64, 64)).astype(np.float32)
    for period in (6, 9, 16):
        waves = np.sin(2 * np.pi / period * (at[0] * 0.6 + at[1] * 0.8))
        assert volume.frequency(waves, whole=True) == pytest.approx(1 / period, rel=0.06)
    assert np.isnan(volume.frequency(np.zeros((16, 16))))


def test_frequency_halves_where_features_double(stripes):
    double = warped(stripes, fields.constant(np.eye(3) * 2))
    exemplar = volume.frequency(stripes, window=56, whole=True)
    assert volume.frequency(double, window=56, whole=True) / exemplar == pytest.approx(0.5, abs=0.08)


@pytest.mark.parametrize(
    "field", [fields.rotation(30, "yz"), fields.rotation_3d(30, 30), fields.rotation(45, "zx")], ids=str
)
def test_turning_keeps_frequency_and_is_seen_as_orientation(stripes, field):
    turned = warped(stripes, field)
    assert volume.frequency(turned, window=56) / volume.frequency(stripes, window=56) == pytest.approx(1, abs=0.06)
    normal = volume.texture_normal(stripes)
    own = volume.orientation_errors(stripes)
    right = volume.orientation_errors(turned, field, normal)
    wrong = volume.orientation_errors(turned, None, normal)
    assert np.median(right) < np.median(own) + 1
    assert np.quantile(right, 0.9) < np.quantile(own, 0.9) + 1
    assert np.median(wrong) > 20
    assert right.shape == (44, 44, 44)


def test_orientation_follows_shear_as_normals_do():
    at = np.indices((48, 48, 48)).astype(np.float32)
    field = fields.constant([[1, 0, 0], [0, 1, 0.8], [0, 0, 1.5]])
    source = np.einsum("ij,j...->i...", field.jacobians((0, 0, 0)), at)
    errors = volume.orientation_errors(np.sin(source[1]), field, (0, 1, 0))
    assert errors.max() < 3
    flat = volume.orientation_errors(np.sin(at[1, 0]), None, (1, 0))
    assert flat.shape == (36, 36)
    assert flat.max() < 1


def test_orientation_of_a_field_that_varies():
    ys, xs = np.indices((80, 80)) - 39.5
    rings = np.sin(np.hypot(ys, xs) * 0.8)
    errors = volume.orientation_errors(rings, fields.circular(axes=2).over((80, 80)), (0, 1))
    far = np.hypot(ys, xs)[6:-6, 6:-6] > 10
    assert np.quantile(errors[far], 0.99) < 3
    assert np.median(volume.orientation_errors(rings, None, (0, 1))) > 30


def test_seams_and_speckle():
    noise = RNG.random((48, 48, 48)).astype(np.float32) * 0.1
    assert all(abs(change - 1).max() < 0.25 for change in volume.seam_planes(noise))
    noise[:, 24:] += 0.3
    changes = volume.seam_planes(noise)
    assert changes[1].argmax() == 23
    assert changes[1][23] > 2
    cyclic = volume.seam_planes(noise, wrap=(False, True, False))
    assert [len(change) for change in cyclic] == [47, 48, 47]
    assert cyclic[1][47] > 2
    speckled = noise.copy()
    speckled[5::10, 5::10, 5::10] = 1
    assert volume.speckle(noise) == 0
    assert volume.speckle(speckled) == pytest.approx(125 / 48**3)


def test_autocorrelation_of_layers(stripes):
    found = volume.autocorrelation(stripes)
    assert_allclose(found[:, 0], 1)
    assert found[0, 4] < -0.2
    assert found[0, 9] > 0.3
    assert found[1, 4] > 0.6


# --- reuse -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("axes", [2, 3])
def test_copies_are_coherent_and_noise_is_not(axes):
    shape = (24, 32, 40)[:axes]
    copy = SourceMap.identity(shape)
    assert volume.cell_reuse(copy) == volume.CellReuse(1.0, 1.0, 1.0, 0.0)
    noise = source_of(RNG.uniform(0, 23, (*shape, axes)), (24,) * axes)
    found = volume.cell_reuse(noise)
    assert found.coherent < 0.01
    assert found.largest < 0.01
    halves = copy.coordinates.copy()
    halves[12:] = copy.coordinates[:12]
    found = volume.cell_reuse(source_of(halves, shape))
    assert found.largest == 0.5
    assert found.coherent > 0.9
    assert found.unused == pytest.approx(1 / 3)  # Pixels 16 to 24, one of three cells, are not used.
    assert found.most_used == pytest.approx(2)


@pytest.mark.parametrize("name", ["circular", "zigzag", "scale"])
def test_coherence_under_a_field(name):
    shape = (20, 30, 30)
    grid = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), -1)
    if name == "circular":
        field = fields.circular().over(shape)
        away = grid - np.array(shape) / 2 + 0.5
        angle = np.arctan2(away[..., 1], away[..., 2])
        # Polar coordinates follow radial steps exactly, and tangential ones if the radius fits.
        radius = np.hypot(away[..., 1], away[..., 2])
        places = np.stack([grid[..., 0], angle * 15, radius], -1)
        source = source_of(places, (40, 100, 40))
        assert volume.coherence(source, 0, field).all()
        ring = (radius[:, :, :-1] > 12) & (np.abs(np.diff(angle, axis=2)) < 1)
        assert volume.coherence(source, 2, field)[ring].mean() > 0.95
        assert volume.coherence(source, 2)[ring].mean() < 0.6
        return
    field = fields.zigzag(20, 30, plane="xy") if name == "zigzag" else fields.constant(np.eye(3) * 2)
    if name == "zigzag":
        # Each band is a separate rotated copy.
        places = np.einsum("...ij,...j->...i", field.jacobians(grid), grid)
        found = volume.coherence(source_of(places, (99,) * 3), 2, field)
        edges = np.arange(29) % 10 == 9
        assert found[..., ~edges].all()
        assert not found[..., edges].all()
    else:
        source = source_of(grid / 2, shape)
        assert volume.cell_reuse(source, field).coherent == 1
        assert volume.cell_reuse(source).coherent == 1  # half a voxel off is still close
        assert volume.cell_reuse(source_of(grid / 4, shape)).coherent == 0


def test_frames_of_the_map_are_used_where_no_field_is_given():
    shape = (8, 9, 10)
    field = fields.rotation_3d(40, 25)
    plain = source_of(SourceMap.identity(shape).coordinates @ field.jacobians((0, 0, 0)).T, (40,) * 3)
    tables = (None, field.jacobians((0, 0, 0))[None], field.lattice(shape))
    rates = []
    for frame in tables:
        source = SourceMap(plain.coordinates, plain.exemplar, plain.label, frame, plain.shapes)
        rates.append(volume.cell_reuse(source).coherent)
    assert rates[0] < 0.7
    assert rates[1:] == [1, 1]


# --- the report ------------------------------------------------------------------------------------------------------


def test_an_exemplar_is_like_itself(particles):
    report = volume.compare(particles.image, particles.image, SourceMap.identity((64,) * 3), fields.identity())
    assert_allclose(report.relative_shares, 1)
    assert report.frequency_ratio == 1
    assert report.values < 0.01
    # The cosine of the angle is 1 except for its last bits, so the angle is not exactly 0.
    assert report.turned == pytest.approx(0, abs=1e-5)
    assert report.particles[0] == report.particles[1]
    assert report.reuse == volume.CellReuse(1.0, 1.0, 1.0, 0.0)
    text = report.text.splitlines()
    assert text[0].split() == ["exemplar", "output", "output/exemplar"]
    assert all(len(line) < 90 for line in text)
    assert str(report) == report.text


def test_another_seed_is_much_the_same_and_another_texture_is_not(particles):
    same = volume.compare(particles.image, samples.particles(seed=1).image)
    other = volume.compare(particles.image, samples.wood_solid().image)
    assert np.abs(same.relative_shares - 1).max() < 0.3
    assert np.abs(other.relative_shares - 1).max() > 0.5
    assert same.values < other.values / 2
    assert same.frequency_ratio == pytest.approx(1, abs=0.1)


def test_lost_particles_are_reported(particles):
    """A known failure of sparse textures: the background takes over, and other measures hardly change."""
    emptied = particles.image.copy()
    gone = (particles.labels > 0) & (particles.labels % 4 != 0)
    emptied[gone] = particles.image[particles.labels == 0][: gone.sum()]
    report = volume.compare(particles.image, emptied, classes=4)
    assert report.relative_shares.min() < 0.5
    labels = (particles.labels > 0).astype(np.uint8)
    after = np.where(gone, 0, labels).astype(np.uint8)
    counted = volume.compare(labels, after, classes=None)
    assert counted.particles[1].density / counted.particles[0].density < 0.5
    assert counted.shares.shape == (2, 2)


def test_reports_of_pictures_and_of_floats():
    one, other = (samples.pebbles((96, 96), seed=s).image for s in (0, 1))
    report = volume.compare(one, other, field=fields.identity(2))
    assert report.two_point.shape == (2, 2, 13)
    assert report.values < 0.1
    # Floats with another range represent the same texture.
    grey = volume.lightness(one) * 900 - 200
    shifted = volume.compare(grey, grey)
    assert_allclose(shifted.relative_shares, 1)


CUBE = np.zeros((16, 16, 16), np.uint8)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: volume.compare(CUBE, CUBE.astype(np.float32)), "output: must be uint8 with 1 channels"),
        (lambda: volume.compare(CUBE, CUBE, SourceMap.identity((4, 4, 4))), "source: "),
        (lambda: volume.compare(CUBE, CUBE, field=fields.identity(2)), "field: must be a field with 3 axes"),
        (lambda: volume.compare(CUBE, CUBE, classes=None, chosen=4), "chosen"),
        (lambda: volume.classes(["stone"]), "image|exemplar"),
        (lambda: volume.classes([[1, 2], [3]]), "exemplar: is not an array"),
        (lambda: volume.classes(CUBE).of(np.zeros((4, 4, 4, 3), np.uint8)), "must have 1 colour channels, got 3"),
        (lambda: volume.frequency(CUBE, window=99), "window"),
        (lambda: volume.orientation_errors(CUBE, margin=8), "margin"),
        (lambda: volume.coherence(SourceMap.identity((4, 4)), 2), "axis"),
        (lambda: volume.cell_reuse(SourceMap.identity((4, 4)), fields.identity()), "field"),
    ],
)
def test_bad_input_gets_a_sentence(make, says):
    with pytest.raises(InvalidInput, match=says) as caught:
        make()
    assert "\n" not in str(caught.value)

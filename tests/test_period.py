"""Images that repeat along one direction only: stripes, fences, and courses of constant height."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

import texrs
from texrs import samples
from texrs._arrays import as_image, as_rgb, to_unit
from texrs.errors import InvalidInput
from texrs.exemplar.courses import find_regularity
from texrs.exemplar.period import Period, confirm_lattice, find_period
from texrs.exemplar.regularity import find_lattice

PERIOD = 17.3


def stripes(size, degrees=0.0, seed=0):
    """Return stripes whose texture does not repeat along them."""
    rng = np.random.default_rng(seed)
    rows, columns = np.indices(size)
    across = rows * np.cos(turn := np.radians(degrees)) + columns * np.sin(turn)
    tone = 0.5 + 0.2 * np.sin(2 * np.pi * across / PERIOD) + 0.4 * gaussian_filter(rng.normal(size=size), 1.5)
    return np.clip(255 * tone, 0, 255).astype(np.uint8)


def wall(size, height, seed=0):
    """Return bricks of random lengths and tones in steep courses of one height. Their joints are uneven."""
    rng = np.random.default_rng(seed)
    rows, columns = np.indices(size)
    across = rows + 0.3 * columns + 12 * gaussian_filter(rng.normal(size=size), 5)
    course = np.floor(across / height).astype(int)
    image = np.where(across % height < 3, 0.8, 0.4)
    for number in np.unique(course):
        for end in np.cumsum(rng.uniform(height, 3 * height, size[1] // height + 4)) - height:
            image[(course == number) & (columns >= end)] += rng.uniform(-0.1, 0.1)
            image[(course == number) & (np.abs(columns - end) < 1.5)] = 0.8
    return np.clip(255 * image, 0, 255).astype(np.uint8)


def guide(image):
    return np.ascontiguousarray(as_rgb(to_unit(as_image(image))))


@pytest.mark.parametrize("degrees", [0, 30, 90, 135])
@pytest.mark.parametrize("side", [80, 160, 300])
def test_stripes_have_one_period(side, degrees):
    found = find_period(guide(stripes((side, side), degrees)))
    assert found is not None
    turn = np.radians(degrees)
    step = np.array(found.step) * np.sign(found.step[0] * np.cos(turn) + found.step[1] * np.sin(turn))
    # Over the whole image, the stripes deviate by less than a quarter of a period.
    away = step / (step @ step) - np.array([np.cos(turn), np.sin(turn)]) / PERIOD
    assert np.abs(away).max() * side < 0.25
    assert found.agreement > 0.6


@pytest.mark.parametrize("name", ["pebbles", "beans", "grit", "leaves_and_flowers", "bark", "dots"])
def test_scattered_elements_have_none(name):
    assert find_period(guide(samples.load(name, size=(160, 160)).image)) is None


def test_noise_has_no_period():
    rng = np.random.default_rng(0)
    for side in (64, 96, 160):
        for sigma in ((1, 1), (3, 3), (1, 8), (2, 20)):
            noise = gaussian_filter(rng.normal(size=(side, side)), sigma)
            noise -= gaussian_filter(noise, 6)
            assert find_period(guide(((noise - noise.min()) / np.ptp(noise)).astype(np.float32))) is None


def test_edges_that_repeat_twice_as_often_as_colours_do_not_count():
    rows = np.indices((96, 96))[0]
    for periods in (2.3, 2.45):
        wave = (0.5 + 0.3 * np.cos(2 * np.pi * periods * rows / 96)).astype(np.float32)
        assert find_period(wave[..., np.newaxis]) is None


def test_a_frequency_that_is_too_low_does_not_count():
    """The highest peak of this spectrum becomes lower than 2.5 periods if it is refined."""
    noise = gaussian_filter(np.random.default_rng([7, 64]).normal(size=(64, 64)), 6)
    assert find_period(guide(((noise - noise.min()) / np.ptp(noise)).astype(np.float32))) is None


def test_stripes_are_not_a_lattice_but_walls_are():
    for image in (stripes((160, 160), 30), wall((160, 160), 20)):
        colours = guide(image)
        assert find_lattice(colours) is not None
        assert find_regularity(colours) == (None, None)
        assert find_period(colours) is not None
    for name in ("weave", "net", "bricks", "scales"):
        colours = guide(samples.load(name, size=(192, 192)).image)
        assert confirm_lattice(colours, find_lattice(colours)) is not None


@pytest.mark.parametrize("step", [(12.5, 0.0), (0.3, 20.0), (14.0, -9.0)])
@pytest.mark.parametrize("wrap", [(True, True), (True, False), (False, True)])
def test_one_period_closes(step, wrap):
    period = Period(step, 0.9)
    closing = period.close((200, 232), wrap)
    assert closing is not None
    closed = closing @ step
    times = closed / (closed @ closed) * (200, 232)
    assert np.abs(times - np.rint(times))[list(wrap)].max() < 1e-3
    assert np.abs(closing - np.eye(2)).max() < 0.15


def test_one_period_does_not_close_in_small_sizes():
    period = Period((40.0, 0.0), 0.9)
    assert period.close((60, 100), (True, True)) is None
    assert period.find_size((60, 100), (True, True)) == (80, 100)
    assert period.close((60, 100), (False, True)) is not None
    with pytest.raises(
        InvalidInput, match="whole periods of the exemplar do not fit 28 rows and 28 columns, but they fit 21 rows"
    ):
        texrs.design(stripes((96, 96), 35), 28, way="lattice")


@pytest.mark.parametrize("degrees", [15, 35])
def test_patches_of_stripes_are_in_step_and_free_along_them(degrees):
    image = stripes((128, 128), degrees)
    made = texrs.design(image, (200, 232), way="lattice", copies=1, screening=None)
    [step] = made.report["period"]
    closing = np.array(made.report["lattice_stretch"][0])
    closed = closing @ step
    frequency = closed / (closed @ closed)
    places = np.moveaxis(np.indices((200, 232)), 0, -1).astype(float)
    moved = (places - made.source_map.coordinates @ closing.T)[made.source_map.jacobians()[..., 0, 0] > 0]
    moved = moved.reshape(-1, 2)
    assert abs(np.exp(2j * np.pi * (moved @ frequency)).mean()) > 0.8
    along = moved @ [-frequency[1], frequency[0]] / np.linalg.norm(frequency)
    # Several patches moved by different distances along the stripes.
    assert len(np.unique(np.rint(along / 3))) > 4


def test_larger_stripes_have_whole_periods():
    made = texrs.tile(stripes((128, 128), 35), size=(200, 232))
    assert "lattice" not in made.report["refused"]
    assert "lattice" in (made.report["candidates"] or [made.report["way"]])


def test_shorter_stripes_have_whole_periods():
    made = texrs.tile(stripes((160, 160), 35))
    times = np.array(made.image.shape) / PERIOD * [np.cos(np.radians(35)), np.sin(np.radians(35))]
    assert np.abs(times - np.rint(times)).max() < 0.1
    assert "4 whole periods of about 30.2" in made.report["resized"]["columns"]


def test_corner_tiles_continue_stripes():
    image = stripes((160, 160), 35)
    made = texrs.CornerTiles(image, seed=1).window(0, 400)
    strengths = []
    for each in (image, made.image):
        period = find_period(guide(each))
        assert period is not None
        rows, columns = np.indices(each.shape)
        wave = np.exp(2j * np.pi * (rows * period.frequency[0] + columns * period.frequency[1]))
        strengths.append(abs((each * wave).mean()))
    assert strengths[1] > 0.8 * strengths[0]

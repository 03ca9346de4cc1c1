"""The kernels of SOLID compared with their slow twins, exactly: all of it is integer arithmetic."""

from __future__ import annotations

import numpy as np
import pytest

from reference.solid import ONE, Twin, upsampled
from texrs import fields
from texrs._engine.appearance import Appearance
from texrs._engine.pyramid import Region, to_fixed, upsample
from texrs.errors import Cancelled, InvalidInput


def exemplar(axes, wrap=False, channels=2):
    shape = (17, 20) if axes == 2 else (12, 13, 14)
    noise = np.random.default_rng(4).random((*shape, channels))
    for axis in range(axes):
        noise = noise + np.roll(noise, 1, axis) + np.roll(noise, 2, axis)
    return Appearance(noise, axes=axes, wrap=wrap)


def region_of(axes, wrap=False, origin=-3):
    shape = (13, 11) if axes == 2 else (3, 5, 4)
    return Region(shape, (origin,) * axes, (wrap,) * axes)


def scattered(appearance, region, seed=0):
    """Return coordinates of any kind: fractions, outside, far away."""
    rng = np.random.default_rng(seed)
    axes = len(region.shape)
    at = rng.integers(-2 * ONE, (max(appearance.shape) + 1) * ONE, (region.points, axes))
    at[::3] = at[::3] // ONE * ONE
    return at.astype(np.int32).reshape(-1)


FIELDS = {
    "still": lambda axes: None,
    "turned": lambda axes: fields.rotation(33, axes=axes),
    "larger": lambda axes: fields.constant(np.eye(axes) * 1.7),
    "smaller": lambda axes: fields.constant(np.eye(axes) * 0.4),
    "sheared": lambda axes: fields.shear(0.7, axes=axes),
    "circular": lambda axes: fields.circular(centre=(2.5,) * axes, axes=axes),
}


@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize("kind", FIELDS)
@pytest.mark.parametrize("wrap", [False, True])
def test_passes_are_those_of_the_twin(axes, kind, wrap):
    appearance, region = exemplar(axes, wrap=kind == "sheared"), region_of(axes, wrap)
    frames = to_fixed(FIELDS[kind](axes), region)
    twin = Twin(appearance.arrays(), region, frames)
    start = scattered(appearance, region)
    options = {
        "passes": 2,
        "first": 5,
        "reach": 2,
        "acceptance": 0.5,
        "coherence": 0.3,
        "vote": 1,
        "seed": (7 << 40) + 3,
    }
    found = appearance.correct(start, region, frames, **options)
    before, between, after = twin.correct(start, **options)
    np.testing.assert_array_equal(found.places.reshape(-1, axes), after)
    changed = [(a != b).any(axis=1).mean() for a, b in ((before, between), (between, after))]
    assert found.passes == 2
    assert found.changed == pytest.approx(sum(changed))


@pytest.mark.parametrize(
    "options",
    [
        {"reach": 1, "vote": 0},
        {"reach": 2, "vote": 0, "acceptance": 0.0},
        {"reach": 1, "vote": 2, "acceptance": 100.0},
        {"reach": 2, "vote": 1, "exhaustive": True},
    ],
)
@pytest.mark.parametrize("axes", [2, 3])
def test_each_option_is_that_of_the_twin(axes, options):
    appearance, region = exemplar(axes, channels=4 if axes == 2 else 1), region_of(axes, origin=9)
    frames = to_fixed(fields.rotation(-20, axes=axes), region)
    held = np.arange(region.points) % 5 == 0
    start = scattered(appearance, region, seed=1)
    found = appearance.correct(start, region, frames, passes=2, held=held, **options)
    wanted = Twin(appearance.arrays(), region, frames).correct(start, held=held, **options)[-1]
    np.testing.assert_array_equal(found.places.reshape(-1, axes), wanted)


def test_work_in_parts_is_the_work():
    appearance, region = exemplar(2), region_of(2)
    frames = to_fixed(None, region)
    start = scattered(appearance, region)
    whole = appearance.correct(start, region, frames, passes=3, seed=2).places
    part = start
    for first in range(3):
        part = appearance.correct(part, region, frames, passes=1, first=first, seed=2).places
    np.testing.assert_array_equal(part, whole)


@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize("kind", FIELDS)
@pytest.mark.parametrize("wrap", [False, True])
def test_upsampling_is_that_of_the_twin(axes, kind, wrap):
    region = region_of(axes, wrap, origin=0 if wrap else -3)
    parents = region.parents()
    frames = to_fixed(FIELDS[kind](axes), region)
    start = np.random.default_rng(2).integers(-(2**20), 2**20, parents.points * axes).astype(np.int32)
    found = upsample(start, parents, region, frames).reshape(-1, axes)
    np.testing.assert_array_equal(found, upsampled(start, parents, region, frames))


@pytest.mark.parametrize("wrap", [False, True])
def test_blocks_are_pieces_of_the_exemplar(wrap):
    appearance, region = exemplar(3, wrap), Region.whole((18, 24, 20))
    places = appearance.blocks(region, to_fixed(None, region), seed=1).reshape(*region.shape, 3)
    assert (places % ONE == 0).all()
    joined = (places[:, :, 1:] - places[:, :, :-1] == (0, 0, ONE)).all(axis=-1)
    assert joined.mean() > 0.65  # cells are 6 wide
    low, high = (0, appearance.shape) if wrap else (2, np.array(appearance.shape) - 2)
    at = places // ONE
    assert wrap or ((at >= low) & (at < high)).all()


def test_what_a_block_becomes_belongs_to_the_world():
    appearance = exemplar(2)
    whole, part = Region((60, 60), (-30, -30), (False,) * 2), Region((50, 50), (-25, -25), (False,) * 2)
    one, other = (appearance.blocks(r, to_fixed(None, r), cell=4, rounds=1, seed=3) for r in (whole, part))
    one, other = one.reshape(60, 60, 2)[5:55, 5:55], other.reshape(50, 50, 2)
    np.testing.assert_array_equal(one[10:40, 10:40], other[10:40, 10:40])


def test_kernels_report_and_stop():
    appearance, region = exemplar(3), Region.whole((16, 16, 16))
    frames, shares = to_fixed(None, region), []
    appearance.correct(appearance.blocks(region, frames, progress=shares.append), region, frames)
    assert shares == sorted(shares)

    def stop(share):
        raise KeyError("enough")

    # Use a large region, because work cannot be stopped before its first report after 0.05 s.
    long = Region.whole((64, 64, 64))
    with pytest.raises((Cancelled, KeyError)):
        appearance.blocks(long, to_fixed(None, long), progress=stop)


def test_wrong_arrays_get_a_sentence():
    appearance, region = exemplar(2), region_of(2)
    frames, good = to_fixed(None, region), scattered(exemplar(2), region_of(2))
    for call, says in (
        (lambda: appearance.correct(good[:-1], region, frames), "places: must be 286 numbers of int32"),
        (lambda: appearance.correct(good, region, frames[:, :1]), "frames"),
        (lambda: appearance.correct(good, region, np.repeat(frames, 3, axis=0)), "frames"),
        (lambda: appearance.correct(good, region, frames, held=np.zeros(3, bool)), "held"),
        (lambda: appearance.correct(good, region, frames, reach=3), "reach: must be an integer between 1 and 2"),
        (lambda: appearance.correct(good, region, frames, vote=3), "vote: must be an integer between 0 and 2"),
        (lambda: appearance.correct(good, region_of(3), frames), "region: must have 2 axes"),
        (lambda: appearance.blocks(region, frames, cell=1), "cell: must be an integer between 2"),
        (lambda: appearance.blocks(region, frames, contrast=2), "contrast: must be a number between 0 and 1"),
        (lambda: Appearance(np.zeros((4, 4)), axes=2), "must have sides of at least 6"),
    ):
        with pytest.raises(InvalidInput) as caught:
            call()
        assert says in str(caught.value)
        assert "\n" not in str(caught.value)

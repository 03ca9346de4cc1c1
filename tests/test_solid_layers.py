"""Unbounded textures from patches: the same for any requests, and as intact as bounded ones."""

import multiprocessing
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from functools import cache, partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import texrs
from reference.look_up import view
from texrs import fields, samples, volume
from texrs._engine.pyramid import ONE, Region, to_fixed
from texrs._typing import Array
from texrs.errors import InvalidInput, LimitExceeded
from texrs.papers.solid import layers
from texrs.papers.solid.ground import Ground
from texrs.papers.solid.packed_boxes import Box, intersect, join

SOLID = samples.particles((32, 32, 32)).image
PLANE = samples.dots((48, 48)).image
FIELDS: dict[str, Callable[[int], fields.Field | None]] = {
    "none": lambda axes: None,
    "turned": lambda axes: fields.rotation(30, axes=axes),
    "circular": lambda axes: fields.circular(centre=(4 if axes == 2 else -30,) * axes, axes=axes),
    "zigzag": lambda axes: fields.zigzag(40, 35, axes=axes),
    "ramp": lambda axes: fields.scale_ramp(0.4, 1.8, length=60, axes=axes),
}
SIDE = {2: 120, 3: 24}


@cache
def exemplar(axes: int, repeat: bool | None = None) -> texrs.Exemplar:
    return texrs.Exemplar(SOLID if axes == 3 else PLANE, axes=axes, repeat=repeat)


def texture(
    axes: int = 3, field: str = "none", *, repeat: bool | None = None, **options: object
) -> texrs.SolidTexture | texrs.PlaneTexture:
    kind = texrs.SolidTexture if axes == 3 else texrs.PlaneTexture
    return kind(exemplar(axes, repeat), field=FIELDS[field](axes), **({"seed": 5} | options))  # type: ignore[arg-type]


def box(axes: int, start: int, stop: int) -> tuple[slice, ...]:
    return (slice(start, stop),) * axes


@cache
def whole(axes: int, field: str) -> Array:
    return texture(axes, field)[box(axes, -SIDE[axes] // 2, SIDE[axes] // 2)]


def part(axes: int, origin: tuple[int, ...], size: tuple[int, ...], *, field: str, threads: int = 0) -> Array:
    with texrs.threads(threads or 2):
        return texture(axes, field).window(origin, size).image


@settings(max_examples=20, deadline=None)
@given(
    st.tuples(*[st.integers(-SIDE[2] // 2, SIDE[2] // 2 - 40)] * 2),
    st.tuples(*[st.integers(1, 40)] * 2),
    st.sampled_from(list(FIELDS)),
    st.sampled_from([0, 1 << 14, 1 << 24]),
    st.sampled_from([1, 2, 7]),
)
def test_random_windows(origin: tuple[int, ...], size: tuple[int, ...], field: str, kept: int, threads: int) -> None:
    with texrs.threads(threads):
        found = texture(2, field, cache_bytes=kept).window(origin, size)
    inside = tuple(slice(o + SIDE[2] // 2, o + SIDE[2] // 2 + n) for o, n in zip(origin, size, strict=True))
    assert np.array_equal(found.image, whole(2, field)[inside])
    assert np.array_equal(view(found.source_map, PLANE), found.image)


@pytest.mark.parametrize("field", ["none", "circular"])
def test_random_windows_of_volumes(field: str) -> None:
    rng = np.random.default_rng(3)
    shared = texture(3, field)
    for k in range(3):
        size = rng.integers(1, 12, 3)
        origin = [int(rng.integers(-SIDE[3] // 2, SIDE[3] // 2 - n)) for n in size]
        if k == 1:
            shared.clear()
        with texrs.threads((1, 2, 7)[k % 3]):
            found = (texture(3, field, cache_bytes=0) if k == 2 else shared).window(origin, size.tolist())
        inside = tuple(slice(o + SIDE[3] // 2, o + SIDE[3] // 2 + int(n)) for o, n in zip(origin, size, strict=True))
        assert np.array_equal(found.image, whole(3, field)[inside])
    assert np.array_equal(view(found.source_map, SOLID), found.image)


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_other_processes_make_the_same(method: str) -> None:
    if method not in multiprocessing.get_all_start_methods():
        pytest.skip("not on this system")
    work = partial(part, 2, (-9, 30), (20, 40), field="circular")
    wanted = work()
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context(method)) as pool:
        assert np.array_equal(pool.submit(work).result(), wanted)


@pytest.mark.parametrize(("axes", "start"), [(2, -(10**9)), (2, 10**9 - 30)])
def test_far_from_the_origin(axes: int, start: int) -> None:
    shared = texture(axes)
    a = shared[box(axes, start, start + 20)]
    shared.clear()
    assert np.array_equal(shared[box(axes, start + 5, start + 15)], a[box(axes, 5, 15)])


def test_slices_are_picked_from_the_same_texture() -> None:
    t = texture(3, "circular")
    cut = t.slice((7, 2, 3), axes=[(0, 1, 0), (0, 0, 1)], size=(21, 31))  # type: ignore[union-attr]
    assert np.array_equal(cut, t[7, -8:13, -12:19])
    points = np.array([[7, 2, 3], [-20, 4, 30], [7, 2, 3], [11, -3, 0]])
    picked = t._world.pick(points)
    for point, place in zip(points, picked, strict=True):
        assert np.array_equal(t._world.read(Region((1, 1, 1), tuple(point.tolist()), (False,) * 3))[0, 0, 0], place)


def test_seams_are_no_worse_than_those_of_a_bounded_texture() -> None:
    """Boxes overlap, and patches of a box fit the parts that are already covered on all sides."""
    turned = fields.circular(centre=(-40, -40), axes=2)
    for image, field in ((samples.load("pebbles").image[:96, :96], None), (samples.bricks((96, 96)).image, turned)):
        known = texrs.Exemplar(image)
        plain = layers.Layers(known, field, 1, candidates=4, cache_bytes=1 << 26)
        here = Region((200, 200), (0, 0), (False, False))
        parts = list(plain._make_all(plain._meeting(len(plain.shifts) - 1, here), None))
        found = float(join(here, parts).seams.sum()) / here.points
        wanted = texrs.synthesize(known, 200, field=field, seed=1).report["stitched"]["seams"]
        assert found < 1.4 * wanted


def test_nothing_is_torn() -> None:
    known = texrs.Exemplar(samples.particles((40, 40, 40)).image, axes=3)
    made = texrs.SolidTexture(known, seed=2).window(10, 28)
    found = volume.integrity(known, made.source_map)
    assert found is not None
    assert found.torn < 0.1
    assert found.contacts[1] < 0.5


def test_what_is_kept_is_bounded_and_forgotten() -> None:
    small = texture(2, cache_bytes=20_000)
    for start in range(0, 400, 100):
        small[0:60, start : start + 60]
        assert 0 < small.cached <= 20_000
    small.clear()
    assert small.cached == 0
    assert texture(2, cache_bytes=0).cached == 0


def test_the_map_has_the_frames_of_its_patches() -> None:
    field = fields.circular(centre=(0, 0), axes=2)
    found = texrs.PlaneTexture(exemplar(2), field=field, seed=1).window((40, -50), (60, 70))
    assert found.source_map.label is not None
    frames = found.source_map.jacobians()
    # Rigid patches have few frames, about equal to the field.
    assert 1 < len(np.unique(frames.reshape(-1, 4), axis=0)) <= found.source_map.label.max() + 1
    assert np.abs(frames - field.lattice((60, 70), origin=(40, -50))).mean() < 0.5
    assert found.report["quality"] == "preserve"
    assert found.report["origin"] == [40, -50]


def test_another_seed_or_quality_is_another_texture() -> None:
    first = texture(2).window(0, 60).source_map.coordinates
    for options in ({"seed": 6}, {"quality": "optimise"}, {"quality": "fast"}):
        assert not np.array_equal(texture(2, **options).window(0, 60).source_map.coordinates, first)
    with pytest.raises(InvalidInput, match="quality"):
        texture(2, quality="best")


def test_errors_and_progress() -> None:
    seen: list[float] = []
    texture(2).window(0, 60, progress=lambda stage, share: seen.append(share))
    assert seen[0] == 0
    assert max(seen) <= 1
    with pytest.raises(LimitExceeded):
        texture(2, memory_limit=300 << 20)[box(2, 0, 3000)]
    singular = fields.from_function(lambda p: np.eye(3) * (1000.0 - p[:, :1, None]), 3)
    with pytest.raises(InvalidInput, match="field"):
        texrs.SolidTexture(exemplar(3), field=singular)[1000:1008, 0:8, 0:8]

    def stop(stage: str, share: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        texture(3, seed=77).window(0, 96, progress=stop)


def test_classes_stay_classes() -> None:
    labels = (SOLID[..., 0] > 100).astype(np.uint8) + (SOLID[..., 0] > 180)
    assert set(np.unique(texrs.SolidTexture(labels)[0:16, 0:16, 0:16])) <= set(np.unique(labels))


@pytest.mark.parametrize("repeat", [True, False])
@pytest.mark.parametrize("field", list(FIELDS))
def test_the_ground_covers_the_world_with_the_exemplar(field: str, repeat: bool) -> None:
    known = FIELDS[field](2)
    ground = Ground((40, 30), (repeat, repeat), 24, 7, known)
    here = Region((70, 60), (-31, 20), (False, False))
    places, boxes, table = ground.show(here)
    assert boxes.max() + 1 == len(table)
    inner = Region((9, 8), (-3, 41), (False, False))
    assert np.array_equal(ground.show(inner)[0].reshape(9, 8, 2), places.reshape(70, 60, 2)[inner.inside(here)])
    if not repeat:
        assert (places.reshape(-1, 2) >= 0).all()
        assert (places.reshape(-1, 2) <= [39 * ONE, 29 * ONE]).all()
    # Each box has a single frame, so the boxes of a varying field have different frames.
    frames = to_fixed(known, here)
    assert len(table) >= 12
    assert frames.shape[0] == 1 or len(np.unique(table[:, 4:8], axis=0)) > 1


def test_boxes_end_at_folds() -> None:
    field = fields.zigzag(24, 35)
    here = Region((40, 30, 32), (-3, 5, 0), (False,) * 3)
    _, boxes, table = Ground((64,) * 3, (True,) * 3, 32, 7, field).show(here)
    # Each box shows only one band of the field, from end to end, so its frame is exact.
    assert np.array_equal(table[boxes, 6:15].reshape(-1, 3, 3), to_fixed(field, here))
    tiles = 3 * 2 * 1
    assert len(table) <= tiles * (32 // 12 + 2)


def test_folds_do_not_shatter_what_lies_between_them() -> None:
    """Boxes are divided only along the axis of the folds. Along the other axes, patches go from end to end."""
    plain = layers.Layers(exemplar(3), fields.zigzag(16, 30), 3, candidates=2, cache_bytes=1 << 24)
    made = next(plain._make_all([(1, 0, 0, 0)], None))
    assert plain.side > 1.5 * 16
    assert len(made.table) < 4 * 2 * plain.side / 8 + 4 * plain.side / 8
    shown, counts = np.unique(made.patches, return_counts=True)
    assert counts.max() > made.patches.size / 16
    largest = np.argwhere(made.patches == shown[counts.argmax()])
    low, high = largest.min(axis=0), largest.max(axis=0)
    assert (high - low)[:2].min() > 0.5 * plain.side


def test_boxes_are_what_was_packed() -> None:
    plain = layers.Layers(exemplar(2), FIELDS["circular"](2), 3, candidates=2, cache_bytes=1 << 24)
    made = list(plain._make_all([(3, 0, 0), (3, 0, 1)], None))
    for one in made:
        again = join(one.region, [one])
        assert np.array_equal(
            Box.pack(one.region, again, bent=False).show((slice(0, plain.side),) * 2).reshape(-1), again.places
        )
    a, b = (one.region for one in made)
    here, there = intersect(a, Region(a.shape, tuple(o + 3 for o in a.origin), a.wrap))
    assert here == (slice(3, plain.side),) * 2
    assert there == (slice(0, plain.side - 3),) * 2
    assert b.origin == (a.origin[0], a.origin[1] + plain.side)

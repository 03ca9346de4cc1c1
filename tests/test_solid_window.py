"""Unbounded textures: every part is the same for any request."""

import threading
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import texrs
from reference.look_up import view
from texrs import fields, samples, volume
from texrs._engine.pyramid import Region, to_fixed
from texrs._typing import Array
from texrs.errors import InvalidInput, LimitExceeded
from texrs.papers.solid import world

SOLID = samples.particles((32, 32, 32)).image
PLANE = samples.weave((64, 64)).image
FIELDS: dict[str, Callable[[int], fields.Field | None]] = {
    "none": lambda axes: None,
    "circular": lambda axes: fields.circular(centre=(4,) * axes, axes=axes),
    "zigzag": lambda axes: fields.zigzag(24, 35, axes=axes),
    "ramp": lambda axes: fields.scale_ramp(0.6, 1.8, length=60, axes=axes),
}


def texture(axes: int = 3, field: str = "none", **options: object) -> texrs.SolidTexture | texrs.PlaneTexture:
    kind, exemplar = (texrs.SolidTexture, SOLID) if axes == 3 else (texrs.PlaneTexture, PLANE)
    return kind(exemplar, field=FIELDS[field](axes), **({"seed": 5, "quality": "fast"} | options))  # type: ignore[arg-type]


def box(axes: int, start: int, stop: int) -> tuple[slice, ...]:
    return (slice(start, stop),) * axes


@pytest.mark.parametrize(("axes", "field"), [(2, "none"), (2, "circular"), (2, "zigzag"), (2, "ramp"), (3, "circular")])
def test_a_window_is_the_same_wherever_it_is_seen_from(axes: int, field: str) -> None:
    side = 24 if axes == 2 else 12
    wanted = texture(axes, field)[box(axes, 0, side)]
    other = texture(axes, field)
    larger = other[box(axes, -5, side + 3)]
    assert np.array_equal(larger[box(axes, 5, 5 + side)], wanted)
    assert np.array_equal(other[box(axes, 0, side)], wanted)  # from the cache
    with texrs.threads(7):
        forgetful = texture(axes, field, cache_bytes=0)
        assert np.array_equal(forgetful[box(axes, 0, side)], wanted)
        assert forgetful.cached == 0
    chunks = texture(axes, field, cache_bytes=1_000_000)
    with texrs.threads(1):
        for start in (8, 0):
            part = (slice(start, start + 4), *box(axes - 1, 0, side))
            assert np.array_equal(chunks[part], wanted[start : start + 4])


def test_the_same_without_a_field() -> None:
    wanted = texture()[box(3, 0, 16)]
    other = texture(cache_bytes=400_000)
    with texrs.threads(2):
        assert np.array_equal(other[9:16, 5:24, -3:16][:, :11, 3:], wanted[9:16, 5:16, 0:16])
        assert np.array_equal(other[box(3, 0, 16)], wanted)


@pytest.mark.parametrize("field", ["none", "circular"])
@pytest.mark.parametrize("stage", range(5))
def test_a_stage_sees_as_far_as_it_says(stage: int, field: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A larger region does not change anything, and a smaller one does, so the other tests can fail."""
    here = Region((16, 16), (-8, 4), (False, False))
    plane = texrs.PlaneTexture(samples.load("pebbles").image[:64, :64], field=FIELDS[field](2), seed=3, quality="fast")
    assert len(plane._world.stages) > stage
    found = []
    honest = world.World.reach
    for more in (0, 7, -100):

        def reach(self: world.World, at: int, window: int, more: int = more) -> int:
            return max(0, honest(self, at, window) + (more if at == stage else 0))

        monkeypatch.setattr(world.World, "reach", reach)
        plane.clear()
        found.append(plane._world.make(here, stage))
    assert np.array_equal(found[0], found[1])
    assert not np.array_equal(found[0], found[2])


@settings(max_examples=25)
@given(
    st.tuples(*[st.integers(-90, 60)] * 2),
    st.tuples(*[st.integers(1, 60)] * 2),
    st.sampled_from(list(FIELDS)),
    st.sampled_from([0, 1 << 14, 1 << 24]),
)
def test_random_windows(origin: tuple[int, ...], size: tuple[int, ...], field: str, kept: int) -> None:
    found = texture(2, field, cache_bytes=kept).window(origin, size)
    inside = tuple(slice(o + 90, o + 90 + n) for o, n in zip(origin, size, strict=True))
    assert np.array_equal(found.image, whole_plane(field)[inside])
    assert np.array_equal(view(found.source_map, PLANE), found.image)


@cache
def whole_plane(field: str) -> Array:
    return texture(2, field)[box(2, -90, 120)]


def test_a_volume_is_what_its_map_shows() -> None:
    found = texture(3, "circular").window((3, -20, 9), (5, 9, 7))
    assert found.image.shape == (5, 9, 7, 3)
    assert np.array_equal(view(found.source_map, SOLID), found.image)


@pytest.mark.parametrize(("axes", "start"), [(2, -(10**9)), (2, 10**9 - 20), (3, -(10**9))])
def test_far_from_the_origin_and_across_it(axes: int, start: int) -> None:
    a = texture(axes)[box(axes, start, start + 20)]
    b = texture(axes)[box(axes, start + 5, start + 15)]
    assert np.array_equal(a[box(axes, 5, 15)], b)


def test_another_seed_is_another_texture() -> None:
    a, b = (texture(2, seed=seed).window(0, 96).source_map.coordinates for seed in (1, 2))
    assert (a != b).any(axis=-1).mean() > 0.9


def test_what_is_kept_is_bounded_and_forgotten() -> None:
    small = texture(2, cache_bytes=100_000)
    for start in range(0, 400, 100):
        small[0:100, start : start + 100]
        assert 0 < small.cached <= 100_000
    small.clear()
    assert small.cached == 0


def test_many_threads_share_a_texture() -> None:
    shared, found = texture(2, "zigzag"), {}

    def work(start: int) -> None:
        found[start] = shared[0:80, start : start + 80]

    workers = [threading.Thread(target=work, args=(80 * i,)) for i in range(4)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    parts = [found[80 * i] for i in range(4)]
    assert np.array_equal(np.concatenate(parts, axis=1), texture(2, "zigzag")[0:80, 0:320])


def test_a_single_index_selects_a_plane() -> None:
    t = texture()
    assert np.array_equal(t[3, -4:8, 0:9], t[3:4, -4:8, 0:9][0])
    assert t[3, -4, np.int64(0)].shape == (3,)
    grey = texrs.PlaneTexture(PLANE[..., 0])
    assert grey[0:5, 7].shape == (5,)


@pytest.mark.parametrize(
    ("index", "says"),
    [
        ((slice(0, 4),), "must be indexed by 3 ranges"),
        ((slice(None, 4), slice(0, 4), slice(0, 4)), "start:stop, .*got :4"),
        ((slice(0, None), slice(0, 4), slice(0, 4)), "start:stop, .*got 0:"),
        ((slice(0, 4, 2), slice(0, 4), slice(0, 4)), "without a step, got 0:4:2"),
        ((slice(4, 4), slice(0, 4), slice(0, 4)), "empty range, got 4:4"),
        ((slice(0, 4.5), slice(0, 4), slice(0, 4)), "integers"),
        ((slice(0, 4), slice(0, 4), 10**10), "to 1000000000"),
        ((slice(0, 4), slice(0, 4), "x"), "integers and ranges"),
        ((slice(0, 4), slice(0, 4), ...), "integers and ranges"),
        ((slice(0, 4), slice(0, 4), True), "integers and ranges"),
    ],
)
def test_bad_indices(index: tuple[object, ...], says: str) -> None:
    with pytest.raises(InvalidInput, match=says):
        texture()[index]


def test_bad_options() -> None:
    with pytest.raises(InvalidInput, match="field: must be a field with 3 axes"):
        texrs.SolidTexture(SOLID, field=fields.circular(axes=2))
    with pytest.raises(InvalidInput, match="exemplar: must be an Exemplar with axes=3"):
        texrs.SolidTexture(texrs.Exemplar(PLANE))
    with pytest.raises(LimitExceeded):
        texture(memory_limit=200 << 20)[box(3, 0, 300)]
    with pytest.raises(LimitExceeded):
        texture()[box(3, 0, 10**6)]
    singular = fields.from_function(lambda p: np.eye(3) * (1000.0 - p[:, :1, None]), 3)
    with pytest.raises(InvalidInput, match="field"):
        texrs.SolidTexture(SOLID, field=singular)[1000:1008, 0:8, 0:8]


def test_straight_slices_are_planes_of_the_texture() -> None:
    t = texture(3, "circular")
    cut = t.slice((7, 2, 3), axes=[(0, 1, 0), (0, 0, 1)], size=(21, 31))
    assert np.array_equal(cut, t[7, -8:13, -12:19])
    again = texture(3, "circular", cache_bytes=0).slice((7, 2, 3), normal=(1, 0, 0), size=(21, 31))
    assert np.array_equal(cut, again)


def test_oblique_slices_carry_places_on() -> None:
    """No colours are mixed, and a part of a slice is the same."""
    t = texrs.SolidTexture(SOLID, seed=2, interpolation="nearest")
    cut = t.slice((0.3, 0.1, 9.7), normal=(1, 2, 3), size=(60, 20))
    assert cut.shape == (60, 20, 3)
    known = {tuple(c) for c in SOLID.reshape(-1, 3).tolist()}
    assert {tuple(c) for c in cut.reshape(-1, 3).tolist()} <= known
    middle = texrs.SolidTexture(SOLID, seed=2, interpolation="nearest").slice((0.3, 0.1, 9.7), (1, 2, 3), size=(30, 20))
    assert np.array_equal(cut[15:45], middle)
    for bad in ({"normal": (0, 0, 0)}, {"axes": [(1, 0, 0), (2, 0, 0)]}, {}, {"normal": (1, 0)}):
        with pytest.raises(InvalidInput):
            t.slice((0, 0, 0), size=8, **bad)  # type: ignore[arg-type]
    with pytest.raises(InvalidInput, match="within"):
        t.slice((1e9, 0, 0), (1, 0, 0), size=8)


def test_windows_look_as_far_as_their_frames() -> None:
    here = Region.whole((4, 4))
    assert world.window_reach(to_fixed(None, here), 2) == 2
    assert world.window_reach(to_fixed(fields.rotation(45, axes=2), here), 2) == 3
    assert world.window_reach(to_fixed(fields.constant([[3, 0], [0, 1]]), here), 2) == 6
    assert world.blocks_reach(6, 2) == 32


def test_the_source_map_knows_the_field_where_the_window_lies() -> None:
    field = fields.circular(centre=(0, 0), axes=2)
    here = field.lattice((8, 9), origin=(40, -50))
    exact = texrs.PlaneTexture(PLANE, field=field, quality="fast").window((40, -50), (8, 9))
    assert np.array_equal(exact.source_map.jacobians(), here)
    # The frames of patches equal the field in their centres.
    found = texrs.PlaneTexture(PLANE, field=field).window((40, -50), (8, 9))
    assert np.abs(found.source_map.jacobians() - here).max() < 0.6
    assert np.allclose(np.linalg.det(found.source_map.jacobians()), 1, atol=2e-3)
    assert found.report["origin"] == [40, -50]


def test_classes_stay_classes_and_progress_can_stop() -> None:
    labels = (SOLID[..., 0] > 100).astype(np.uint8) + (SOLID[..., 0] > 180)
    t = texrs.SolidTexture(labels)
    assert set(np.unique(t[0:16, 0:16, 0:16])) <= set(np.unique(labels))
    flat = texrs.PlaneTexture(texrs.Exemplar(labels[5] * 7.0, labels=True))
    assert set(np.unique(flat[0:64, 0:64])) <= {0, 7, 14}

    def stop(stage: str, share: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        texrs.SolidTexture(SOLID, seed=77).window(0, 96, progress=stop)


def test_shares_of_classes_are_those_of_the_exemplar() -> None:
    exemplar = samples.particles().image
    shares = volume.compare(exemplar, texrs.SolidTexture(exemplar, seed=1)[0:64, 0:64, 0:64]).relative_shares
    assert (np.abs(shares - 1) < 0.25).all()


def test_a_point_alone_is_looked_up_without_axes():
    image = texrs.samples.stripes((32, 32, 32)).image
    texture = texrs.SolidTexture(image if image.ndim == 3 else image[..., 0])
    point, several = (40, -3, 7), [(40, -3, 7)]
    assert np.array_equal(texture.sample(point), texture.sample(several)[0])

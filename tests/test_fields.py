"""Frame fields: their rotations, their independence of other points, and their errors."""

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from texrs import fields
from texrs.errors import InvalidInput, LimitExceeded

RNG = np.random.default_rng(5)


def bend(points):
    """Return a smooth field. It is at module level so that it can be pickled."""
    axes = points.shape[1]
    return np.eye(axes) * (1.5 + 0.5 * np.sin(points[:, :1] / 9))[:, :, None]


def varied(axes):
    """Return one field of every kind."""
    some = [fields.rotation(a, "xy", axes=axes).constant * s for a, s in ((0, 1), (40, 1.5), (80, 1), (30, 0.7))]
    grid = np.array(some * 2).reshape(*((2, 4) if axes == 2 else (2, 2, 2)), axes, axes)
    stretched = grid @ np.diag([1.0, 2.0, 0.5][:axes])
    made = [
        fields.identity(axes),
        fields.constant(np.diag([2.0, 1.0, -1.0][:axes]) + 0.25),
        fields.rotation(25, "yx", axes=axes),
        fields.shear(0.7, axes=axes),
        fields.zigzag(20, 30, axes=axes),
        fields.zigzag(7.5, 30, axis="y", axes=axes),
        fields.circular(axes=axes),
        fields.circular(axes=axes, radial="y", centre=(3, 5.5, -7)[:axes]),
        fields.spiral(20, axes=axes).over((48,) * axes),
        fields.scale_ramp(0.5, 3, length=40, axes=axes),
        fields.scale_ramp(2, 1, axis="y", axes=axes).over((33,) * axes),
        fields.from_array(grid),
        fields.from_array(grid, (64,) * axes, origin=(-32,) * axes),
        fields.from_array(stretched, (50, 20, 30)[:axes]),
        fields.interpolate(RNG.uniform(0, 64, (8, axes)), grid.reshape(8, axes, axes)),
        fields.interpolate(RNG.uniform(0, 64, (8, axes)), stretched.reshape(8, axes, axes)),
        fields.from_function(bend, axes),
    ]
    if axes == 3:
        made += [fields.rotation_3d(30, 20), fields.circular("x"), fields.circular("y"), fields.spiral(9, "x")]
    return [*made, made[4].inverse(), made[8].inverse(), made[13].inverse()]


EVERY = [(axes, i) for axes in (2, 3) for i in range(len(varied(axes)))]
VARIED = {axes: varied(axes) for axes in (2, 3)}
every = pytest.mark.parametrize(("axes", "i"), EVERY, ids=lambda v: str(v))


@every
def test_frames_and_jacobians_are_inverse(axes, i):
    field = VARIED[axes][i]
    points = RNG.uniform(-70, 70, (200, axes))
    product = field.frames(points).astype(float) @ field.jacobians(points)
    assert_allclose(product, np.broadcast_to(np.eye(axes), product.shape), atol=3e-6)
    inverse = field.inverse()
    assert_allclose(inverse.frames(points), field.jacobians(points), rtol=1e-6, atol=1e-6)
    assert_allclose(inverse.jacobians(points), field.frames(points), rtol=1e-5, atol=1e-5)
    assert inverse.inverse() is field or inverse.inverse() == field


@every
@settings(max_examples=20)
@given(data=st.data())
def test_a_frame_depends_on_its_point_alone(axes, i, data):
    field = VARIED[axes][i]
    count = data.draw(st.integers(1, 70))
    cuts = sorted(data.draw(st.lists(st.integers(0, count), max_size=3)))
    step = data.draw(st.sampled_from([1, 0.5, 1 / 3, 4]))
    points = data.draw(st.integers(-200, 200)) + step * np.arange(count * axes).reshape(count, axes)[::-1]
    whole = field.jacobians(points)
    parts = np.split(points, cuts)
    assert np.concatenate([field.jacobians(p) for p in parts]).tobytes() == whole.tobytes()
    order = np.random.default_rng(count).permutation(count)
    assert field.jacobians(points[order]).tobytes() == whole[order].tobytes()
    assert field.jacobians(points[::-1][:, np.newaxis]).tobytes() == whole[::-1].tobytes()


@every
def test_many_points_are_evaluated_as_few(axes, i):
    field = VARIED[axes][i]
    points = RNG.uniform(-70, 70, (20_001, axes))
    chosen = RNG.integers(0, len(points), 9)
    assert field.frames(points)[chosen].tobytes() == field.frames(points[chosen]).tobytes()


@every
def test_fields_are_pickled_and_known_by_their_content(axes, i):
    field = VARIED[axes][i]
    again = pickle.loads(pickle.dumps(field))
    assert again.describe() == field.describe()
    assert again.axes == field.axes == axes
    points = RNG.uniform(-9, 9, (5, axes))
    assert_array_equal(again.frames(points), field.frames(points))
    if field.key is None:
        assert field != again
        assert field == field
    else:
        assert again.key == field.key
        assert again == field
        assert hash(again) == hash(field)


@pytest.mark.parametrize("axes", [2, 3])
def test_keys_tell_fields_apart(axes):
    keys = [f.key for f in VARIED[axes] if f.key is not None]
    assert len(set(keys)) == len(keys) == len(VARIED[axes]) - 1
    assert fields.rotation(30) == fields.rotation(30.0)
    assert fields.rotation(30) != fields.rotation(30.001)
    assert fields.identity(2) != "identity"


@every
def test_constants_are_constant(axes, i):
    field = VARIED[axes][i]
    points = RNG.uniform(-99, 99, (20, axes))
    frames = field.frames(points)
    same = bool((frames == frames[0]).all())
    assert (field.constant is not None) == same
    if same:
        assert_allclose(field.constant, frames[0], rtol=1e-6)


@pytest.mark.parametrize("axes", [2, 3])
def test_lattices_lie_at_the_middles_of_coarse_voxels(axes):
    field = VARIED[axes][8]
    shape, origin, step = (5, 4, 3)[:axes], (-2, 7, 1)[:axes], 4
    grid = np.stack(np.meshgrid(*(np.arange(o, o + n) for o, n in zip(origin, shape, strict=True)), indexing="ij"), -1)
    assert_array_equal(field.lattice(shape, origin=origin, step=step), field.jacobians((grid + 0.5) * step - 0.5))
    assert_array_equal(field.lattice(shape, jacobians=False), field.frames(grid - origin))


def test_circles():
    field = fields.circular(centre=(0, 20, 20))
    for y, x in RNG.uniform(0, 40, (50, 2)):
        frame = field.frames((RNG.uniform(0, 9), y, x))
        away = np.array([0, y - 20, x - 20]) / np.hypot(y - 20, x - 20)
        assert_allclose(frame[:, 2], away, atol=1e-6)  # x points outwards
        assert_allclose(frame[:, 1], [0, away[2], -away[1]], atol=1e-6)  # y points along
        assert_allclose(frame[:, 0], [1, 0, 0])
        assert np.linalg.det(frame) == pytest.approx(1, abs=1e-5)
    assert_array_equal(field.frames((5, 20, 20)), np.eye(3))
    assert_array_equal(fields.circular().over((9, 41, 41)).frames((0, 3, 4)), field.frames((0, 3, 4)))
    rings = fields.circular("y").over((41, 9, 41))
    assert_allclose(rings.frames((30, 0, 20))[:, 0], [1, 0, 0])  # z points outwards, around y
    assert_allclose(rings.frames((20, 0, 30))[:, 0], [0, 0, 1], atol=1e-7)


def test_spirals_are_circles_turned():
    circles, spirals = fields.circular(axes=2), fields.spiral(35, axes=2)
    points = RNG.uniform(-30, 30, (50, 2))
    cosine = (circles.frames(points)[..., 1] * spirals.frames(points)[..., 1]).sum(-1)
    assert_allclose(cosine, np.cos(np.radians(35)), atol=1e-6)


def test_zigzag_bands():
    field = fields.zigzag(10, 20, axis="y", plane="zx")
    turned = field.frames([(0, y, 0) for y in range(-10, 20)])
    assert_array_equal(np.sign(turned[:, 2, 0]), [1] * 5 + [-1] * 5 + [1] * 5 + [-1] * 5 + [1] * 5 + [-1] * 5)
    assert_allclose(np.degrees(np.arctan2(np.abs(turned[:, 2, 0]), turned[:, 0, 0])), 20, atol=1e-4)


def test_slants_turn_every_axis():
    frame = fields.rotation_3d().constant
    assert (np.abs(np.diag(frame)) < 0.9).all()
    assert_allclose(frame @ frame.T, np.eye(3), atol=1e-6)
    assert fields.rotation(20, "yz").constant[0, 1] == pytest.approx(np.sin(np.radians(20)))


def test_arrays_hold_at_the_middles_of_their_cells():
    frames = np.stack([fields.rotation(a, axes=2).constant for a in np.linspace(0, 90, 12)]).reshape(3, 4, 2, 2)
    field = fields.from_array(frames, (9, 16))
    for row in range(3):
        for column in range(4):
            at = (row * 3 + 1, column * 4 + 1.5)
            assert_allclose(field.frames(at), frames[row, column], atol=1e-6)
    assert_allclose(field.frames((-50, -50)), frames[0, 0], atol=1e-6)
    assert_allclose(field.frames((50, 50)), frames[-1, -1], atol=1e-6)
    assert_allclose(fields.from_array(frames).lattice((3, 4), jacobians=False), frames, atol=1e-6)
    assert_array_equal(field.frames((4, 9)), fields.from_array(frames, (9, 16), origin=(10, -10)).frames((14, -1)))


@pytest.mark.parametrize("axes", [2, 3])
@settings(max_examples=30)
@given(seed=st.integers(0, 999))
def test_between_samples_size_is_kept(axes, seed):
    rng = np.random.default_rng(seed)
    turns = [
        fields.rotation(a, p, axes=axes).constant
        for a, p in zip(rng.uniform(-50, 50, 8), ["xy", "yx"] * 4, strict=True)
    ]
    sizes = np.exp(rng.uniform(-0.5, 0.5, 8))
    frames = (np.array(turns) * sizes[:, None, None]).reshape(*((2, 4) if axes == 2 else (2, 2, 2)), axes, axes)
    field = fields.from_array(frames, (30,) * axes)
    found = field.frames(rng.uniform(-5, 35, (40, axes))).astype(float)
    size = np.abs(np.linalg.det(found)) ** (1 / axes)
    assert (size > sizes.min() * (1 - 1e-5)).all()
    assert (size < sizes.max() * (1 + 1e-5)).all()
    assert_allclose(found.swapaxes(-1, -2) @ found, size[:, None, None] ** 2 * np.eye(axes), atol=1e-5)


def test_stretches_are_kept_apart_from_rotations():
    frame = fields.rotation(30, axes=2).constant @ np.diag([3.0, 0.5])
    points, values = RNG.uniform(0, 9, (5, 2)), np.array([frame] * 5)
    for field in (fields.interpolate(points, values), fields.from_array(values[:4].reshape(2, 2, 2, 2), (20, 20))):
        assert_allclose(field.frames(RNG.uniform(-9, 30, (20, 2))), np.array([frame] * 20), rtol=1e-5, atol=1e-6)


def test_interpolation_passes_through_its_points():
    points = np.array([[0, 0, 0], [10, 20, 30], [40.5, 0, 7]])
    frames = np.array([fields.identity().constant, fields.rotation_3d(50, 10).constant, np.diag([2.0, 2, 2])])
    field = fields.interpolate(points, frames)
    assert_allclose(field.frames(points), frames, atol=1e-5)
    assert_allclose(field.frames(points + 1e-3), frames, atol=1e-2)
    assert np.isfinite(field.frames((1e6, -1e6, 1e6))).all()


def test_mirrored_frames_are_frames():
    flip = np.diag([1.0, -1.0])
    assert fields.constant(flip).constant[1, 1] == -1
    grid = np.array([flip @ fields.rotation(a, axes=2).constant for a in (0, 20, 40, 60)]).reshape(2, 2, 2, 2)
    assert (np.linalg.det(fields.from_array(grid, (9, 9)).lattice((9, 9))) < 0).all()


def narrowing(points):
    return np.eye(3) * np.maximum(10 - points[:, 2], 0.05)[:, None, None]


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (
            lambda: fields.constant([[1, 0], [0, 0]]),
            r"matrix: .* determinant is 0, but must have a magnitude of at least 0\.001",
        ),
        (lambda: fields.constant([[200, 0], [0, 1]]), "100 times"),
        (lambda: fields.constant([[1, np.nan], [0, 1]]), "finite"),
        (lambda: fields.rotation(30, "xx"), "plane: must be one of xy"),
        (lambda: fields.circular("x", axes=2), "axis: must be 'z'"),
        (lambda: fields.circular("z", radial="z"), "radial: must be x or y"),
        (lambda: fields.circular(centre=(1, 2, np.inf)), "centre"),
        (lambda: fields.circular(centre=np.zeros((2, 3))), "centre"),
        (lambda: fields.from_array(np.zeros((4, 4, 2, 2))), r"\(row, column\) = \(0, 0\) is flat"),
        (lambda: fields.from_array([[np.eye(2), np.diag([1, -1])]]), "got 1 mirrored of 2"),
        (lambda: fields.from_array([[np.eye(2), -np.eye(2)]]).frames((0, 0.5)), "opposite directions"),
        (lambda: fields.interpolate([(0, 0)] * 2, [np.eye(2)] * 2), "same point"),
        (lambda: fields.interpolate([(0, 0)], [np.zeros((2, 2))]), "is flat"),
        (lambda: fields.from_function(3), "function: must be a function"),
        (lambda: fields.from_function(lambda p: 1 / 0).frames((0, 0, 0)), "failed with ZeroDivisionError"),
        (lambda: fields.from_function(lambda p: p).frames((0, 0, 0)), "got float64 of shape"),
        (lambda: fields.from_function(lambda p: "no").frames((0, 0, 0)), "must return numbers"),
        (lambda: fields.from_function(narrowing).frames((3, 4, 10)), r"\(3, 4, 10\) is flat"),
        (lambda: fields.identity().frames((1, 2)), "points: must be numbers of shape"),
        (lambda: fields.identity().frames((1, 2, np.nan)), "points: must be finite, but 1 of 3 values"),
        (lambda: fields.identity().frames("here"), "points"),
        (lambda: fields.identity().lattice((3, 3, 3), origin=(1, 2)), "origin: must be one integer"),
        (lambda: fields.from_array(np.tile(np.eye(2), (2, 2, 1, 1)), origin=np.zeros((4, 2))), "origin"),
        (lambda: fields.check(fields.identity(), 2.5), "shape"),
        (lambda: fields.check(fields.identity(), (3, 3, 3), "here"), "origin"),
        (lambda: fields.identity().over((3, 3)), "shape"),
        (lambda: fields.check(fields.identity(), (3, 3)), "must have 2 axes, like the requested size, got 3"),
        (lambda: fields.check(fields.from_function(narrowing), (2, 2, 300)), "field: the frame at"),
    ],
)
def test_bad_input_gets_a_sentence(make, says):
    with pytest.raises(InvalidInput, match=says) as caught:
        make()
    assert "\n" not in str(caught.value)


def test_memory_is_bounded():
    with pytest.raises(LimitExceeded):
        fields.identity().lattice((512,) * 3)
    fields.check(fields.circular(), (10, 100, 1000))
    fields.check(fields.circular(), 50)
    fields.check(fields.identity(), (600,) * 3, (-300, 0, 5))


def test_dense_arrays_of_frames_are_kept_small():
    import tracemalloc

    dense = np.broadcast_to(np.diag([1, 2, 1]).astype(np.float32), (64, 64, 64, 3, 3)).copy()
    tracemalloc.start()
    field = fields.from_array(dense)
    held, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert held < 2.1 * dense.nbytes
    assert peak < 5 * dense.nbytes
    assert_allclose(field.frames((3.5, 7, 8)), dense[0, 0, 0], rtol=1e-6)


def test_the_cause_is_kept():
    with pytest.raises(InvalidInput) as caught:
        fields.from_function(lambda p: 1 / 0).frames((0, 0, 0))
    assert isinstance(caught.value.__cause__, ZeroDivisionError)


def test_fields_in_words():
    for name, text in fields.names().items():
        if name != "rotation_3d":
            assert fields.parse(name, 2).axes == 2
        assert fields.parse(name) == getattr(fields, name)()
        assert text.startswith(name)
    assert fields.parse("zigzag:period=64,angle=15", 2) == fields.zigzag(64, 15, axes=2)
    assert fields.parse(" circular : axis=y , radial=x, centre=1x2.5x-3 ".replace(" : ", ":")) == fields.circular(
        "y", radial="x", centre=(1, 2.5, -3)
    )
    assert fields.parse("circular", 2, (64, 32)) == fields.circular(axes=2, centre=(31.5, 15.5))


@pytest.mark.parametrize(
    ("text", "axes", "says"),
    [
        ("rotation_3d", 2, "for volumes"),
        ("zigzag:32", 2, "zigzag accepts period=, angle=, axis=, plane="),
        ("zigzag:periode=32", 2, "zigzag accepts"),
        ("zigzag:period=", 2, "zigzag accepts"),
        ("zigzag:period=wide", 2, "period must be a number, got 'wide'"),
        ("zigzag:period=3,period=4", 2, "given twice"),
        ("zigzag:period=nan", 2, "zigzag: period: must be a number"),
        ("identity:axes=3", 2, "identity accepts no options"),
        ("circular:centre=a", 2, "centre must be numbers"),
        ("circular:centre=1x2x3", 2, "circular: centre"),
        ("circular:axis=q", 3, "circular: axis: must be one of x, y, z"),
    ],
)
def test_wrong_words_get_a_sentence(text, axes, says):
    with pytest.raises(InvalidInput, match=says) as caught:
        fields.parse(text, axes)
    assert str(caught.value).startswith("field: ")

"""Source maps: looked up, composed, measured, saved."""

import numpy as np
import pytest

from texrs import SourceMap
from texrs.errors import FileError, InvalidInput


def turned(shape, degrees):
    """Return a map that rotates an exemplar of ``shape`` around its centre, with its frame."""
    angle = np.radians(degrees)
    frame = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    middle = (np.array(shape) - 1) / 2
    start = SourceMap.identity(shape)
    coordinates = middle + (start.coordinates - middle) @ frame.T
    return SourceMap(
        coordinates.astype(np.float32),
        start.exemplar,
        start.label,
        frame[None].astype(np.float32),
        (shape,),
    )


def test_identity_renders_the_exemplar():
    image = np.random.default_rng(0).random((8, 9, 4)).astype(np.float16)
    np.testing.assert_array_equal(SourceMap.identity((8, 9)).render(image), image)


def test_composition_of_turns_is_the_turn_by_the_sum():
    a, b = turned((33, 33), 20), turned((33, 33), 40)
    both = a.compose(b)
    inner = np.s_[10:23, 10:23]
    np.testing.assert_allclose(both.coordinates[inner], turned((33, 33), 60).coordinates[inner], atol=1e-4)
    np.testing.assert_allclose(both.jacobians()[0, 0], turned((33, 33), 60).jacobians()[0, 0], atol=1e-6)


def test_composition_through_several_pictures():
    a, b = SourceMap.identity((6, 6)), turned((6, 6), 180)
    rng = np.random.default_rng(3)
    which = rng.integers(0, 2, (10, 12)).astype(np.uint16)
    coordinates = rng.integers(0, 6, (10, 12, 2)).astype(np.float32)
    outer = SourceMap(coordinates, which, which.astype(np.uint32), None, ((6, 6), (6, 6)))
    image = rng.integers(0, 255, (6, 6, 3)).astype(np.uint8)
    two_steps = outer.render([a.render(image), b.render(image)])
    composed = outer.compose([a, b])
    np.testing.assert_array_equal(composed.render(image, interpolation="nearest"), two_steps)
    np.testing.assert_array_equal(
        composed.jacobians()[which == 1], b.jacobians()[0, 0][None].repeat((which == 1).sum(), 0)
    )
    dense = SourceMap(b.coordinates, b.exemplar, b.label, b.jacobians().copy(), b.shapes)
    np.testing.assert_allclose(outer.compose([a, dense]).jacobians(), composed.jacobians())


def test_reuse_counts_pieces():
    start = SourceMap.identity((10, 10))
    reuse = start.reuse()
    assert (reuse.verbatim, reuse.largest, reuse.regions) == (1.0, 1.0, 1)
    coordinates = start.coordinates.copy()
    coordinates[:, 5:] = np.roll(coordinates[:, 5:], 3, axis=0)
    two = SourceMap(coordinates, start.exemplar, start.label, None, start.shapes)
    assert two.reuse().regions == 3
    assert two.reuse().largest == 0.5


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_normals_turn_with_the_frame(dtype):
    # Use a plane that falls to the right, so x of the normal is positive. Rotated by 90 degrees, it falls up or down.
    normal = np.zeros((21, 21, 3))
    normal[...] = np.array([0.6, 0.0, 0.8])
    encoded = normal if dtype == np.float32 else np.rint((normal + 1) / 2 * np.iinfo(dtype).max)
    encoded = encoded.astype(dtype)
    if dtype == np.float32:
        encoded[0, 0] = [-1e-3, 0, 1]  # a negative value shows that floats are signed
    quarter = turned((21, 21), 90)
    out = quarter.render(encoded, map_type="normal")[10, 10].astype(float)
    out = out if dtype == np.float32 else out / np.iinfo(dtype).max * 2 - 1
    # The heights of these normals, rotated by the same map, give the direction independently.
    height = quarter.render(np.tile(-0.75 * np.arange(21.0), (21, 1)))
    slope_row, slope_column = height[11, 10] - height[10, 10], height[10, 11] - height[10, 10]
    expected = np.array([-slope_column, slope_row, 1]) / np.sqrt(slope_row**2 + slope_column**2 + 1)
    np.testing.assert_allclose(out, expected, atol=0.01)
    down = quarter.render(encoded, map_type="normal", green="down")[10, 10].astype(float)
    down = down if dtype == np.float32 else down / np.iinfo(dtype).max * 2 - 1
    np.testing.assert_allclose(down * [1, -1, 1], expected, atol=0.01)


def test_saved_and_loaded_it_is_the_same(tmp_path):
    for number, source in enumerate([SourceMap.identity((5, 6)), turned((7, 7), 30)]):
        path = tmp_path / f"{number}.npz"
        source.save(path)
        again = SourceMap.load(path)
        for name in ("coordinates", "exemplar", "label"):
            np.testing.assert_array_equal(getattr(again, name), getattr(source, name))
        assert again.shapes == source.shapes
        assert (again.jacobian is None) == (source.jacobian is None)
        assert [p.name for p in tmp_path.iterdir()].count(path.name) == 1


ARRAYS = {
    "coordinates": np.zeros((4, 4, 2), np.float32),
    "exemplar": np.zeros((4, 4), np.uint16),
    "label": np.zeros((4, 4), np.uint32),
    "jacobian": None,
    "shapes": ((4, 4),),
}


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *(
            ("shapes", s)
            for s in (((0, 0),), ((4, 0),), ((4, -1),), ((4, 4.5),), ((4,),), (4, 4), 4, None, ("44",), ())
        ),
        *((name, None) for name in ("coordinates", "exemplar", "label")),
        *((name, array.tolist()) for name, array in ARRAYS.items() if isinstance(array, np.ndarray)),
        *((name, array.astype(np.int64)) for name, array in ARRAYS.items() if isinstance(array, np.ndarray)),
        *((name, array[:0]) for name, array in ARRAYS.items() if isinstance(array, np.ndarray)),
        *((name, array[..., 0]) for name, array in ARRAYS.items() if isinstance(array, np.ndarray)),
        *((name, array[..., np.newaxis]) for name, array in ARRAYS.items() if isinstance(array, np.ndarray)),
        ("exemplar", np.ones((4, 4), np.uint16)),
        *(("jacobian", f) for f in (1.5, [[1, 0], [0, 1]], np.eye(2), np.zeros((0, 2, 2), np.float32))),
    ],
)
def test_parts_that_make_no_map(name, value):
    """Results of such parts would fail later, for example in shares of an exemplar's area."""
    with pytest.raises(InvalidInput, match=name):
        SourceMap(**(ARRAYS | {name: value}))
    with pytest.raises(InvalidInput):
        SourceMap(*(a[:0] if isinstance(a, np.ndarray) else a for a in ARRAYS.values()))


def test_files_that_are_not_source_maps(tmp_path):
    bad = tmp_path / "bad.npz"
    for content in (b"", b"text", b"PK\x03\x04 truncated"):
        bad.write_bytes(content)
        with pytest.raises(FileError, match="bad.npz"):
            SourceMap.load(bad)
    np.savez(bad, other=np.zeros(3))
    with pytest.raises(FileError, match="not a source map"):
        SourceMap.load(bad)
    np.savez(bad, texrs_source_map=np.array([{}], dtype=object))
    with pytest.raises(FileError, match="bad.npz"):
        SourceMap.load(bad)
    with pytest.raises(FileError, match="missing"):
        SourceMap.load(tmp_path / "missing.npz")
    with pytest.raises(FileError):
        SourceMap.load(tmp_path)


def test_parts_that_disagree_are_refused():
    start = SourceMap.identity((4, 4))
    with pytest.raises(InvalidInput, match="^label"):
        SourceMap(start.coordinates, start.exemplar, start.label[:3], None, start.shapes)
    with pytest.raises(InvalidInput, match="^jacobian"):
        SourceMap(
            start.coordinates,
            start.exemplar,
            start.label + np.uint32(1),
            np.zeros((1, 2, 2), np.float32),
            start.shapes,
        )
    with pytest.raises(InvalidInput, match="^exemplars"):
        start.render(np.zeros((5, 4)))
    with pytest.raises(InvalidInput, match="^exemplars"):
        start.render([np.zeros((4, 4))] * 2)


@pytest.mark.parametrize("green", ["up", "down"])
def test_directions_of_volumes_turn_in_space(green):
    """A normal belongs to a plane seen through the map, and the map reverses a step."""
    rng = np.random.default_rng(4)
    frames = rng.normal(size=(5, 3, 3)).astype(np.float32)
    start = SourceMap.identity((1, 1, 5))
    source = SourceMap(
        start.coordinates * 0, start.exemplar, np.arange(5, dtype=np.uint32).reshape(1, 1, 5), frames, start.shapes
    )
    side = 1 if green == "down" else -1
    given = rng.normal(size=3)
    own = given[::-1] * [1, side, 1]  # (plane, row, column)
    exemplar = np.tile(given, (1, 1, 5, 1))
    exemplar[0, 0, 1:, 0] = -9  # Negative values show that vectors are not encoded.
    for kind, wanted in (
        ("slope", np.einsum("nji,j->ni", frames, own)),
        ("normal", np.einsum("nji,j->ni", frames, own)),
        ("vector", np.linalg.solve(frames.astype(float), np.tile(own, (5, 1))[..., np.newaxis])[..., 0]),
    ):
        found = source.render(exemplar, map_type=kind, green=green, interpolation="nearest")[0, 0]
        length = {"slope": None, "normal": 1.0, "vector": np.linalg.norm(given)}[kind]
        if length is not None:
            wanted = wanted * length / np.linalg.norm(wanted, axis=1, keepdims=True)
        np.testing.assert_allclose(found[:, ::-1] * [1, side, 1], wanted, rtol=1e-4, atol=1e-5)
    with pytest.raises(InvalidInput, match=r"must have shape \(planes, rows, columns, 3\)"):
        source.render(exemplar[..., :2], map_type="vector")

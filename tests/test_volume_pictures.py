"""Images of volumes: their contents and positions."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from PIL import Image

from texrs import io, samples, volume
from texrs.errors import FileError, InvalidInput, TexrsError

RNG = np.random.default_rng(0)
VOLUME = RNG.integers(0, 256, (7, 9, 11, 3), dtype=np.uint8)


def test_slices_are_the_volume():
    picture = volume.slices(VOLUME, (2, -1, 4), gap=3)
    assert picture.shape == (9, 11 + 3 + 11 + 3 + 9, 3)
    assert_array_equal(picture[:, :11], VOLUME[2])
    assert_array_equal(picture[:7, 14:25], VOLUME[:, -1])
    assert_array_equal(picture[:7, 28:], VOLUME[:, :, 4])
    assert (picture[7:, 14:] == 255).all()
    grey = volume.slices(VOLUME[..., 0].astype(np.float32))
    assert grey.shape == (9, 35)
    assert grey.dtype == np.float32
    assert_array_equal(grey[:, :11], VOLUME[3, ..., 0])


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32", "float64"])
def test_cuts_along_the_axes_are_slices(dtype):
    v = VOLUME.astype(dtype)
    for axis, place in ((0, 3), (1, 4), (2, 7)):
        normal, point = np.eye(3)[axis], np.where(np.arange(3) == axis, place, (np.array(v.shape[:3]) - 1) / 2)
        for sign in (1, -2.5):
            found = volume.oblique_slice(v, point, sign * normal, interpolation="cubic")
            assert found.dtype == v.dtype
            assert_array_equal(found, np.take(v, place, axis=axis))


def test_cuts_in_any_direction():
    ramp = np.einsum("i,ijkl->jkl", [3.0, 5.0, 7.0], np.indices((20, 24, 28))).astype(np.float32)
    normal = np.array([1, -2, 0.5])
    steps = np.array([[2.0, 1, 0], [0.5, 0.5, 1]])  # Both steps are perpendicular to the normal.
    assert_allclose(steps @ normal, 0)
    cut = volume.oblique_slice(ramp, (9, 11, 13), axes=steps, size=(5, 7))
    at = np.array([9, 11, 13]) + np.arange(-2, 3)[:, None, None] * steps[0] + np.arange(-3, 4)[:, None] * steps[1]
    assert_allclose(cut, at @ [3, 5, 7], rtol=1e-5)
    whole = volume.oblique_slice(ramp + 1, (9, 11, 13), normal)
    assert (whole > 0).mean() > 0.5
    wide = volume.oblique_slice(ramp + 1, (9, 11, 13), normal, size=(99, 101))
    assert wide.shape == (99, 101)
    assert (wide[[0, -1]] == 0).all()
    labels = (ramp > 150).astype(np.uint8)
    assert set(np.unique(volume.oblique_slice(labels, None, normal, interpolation="nearest"))) == {0, 1}


def test_the_cube_shows_its_faces():
    v = np.zeros((20, 20, 20, 3), np.uint8)
    v[0, ..., 0] = 255  # The front is red.
    v[0:, 0, :, 1] = 255  # The top is green.
    v[0:, :, -1, 2] = 255  # The right face is blue.
    picture = volume.render_block(v, 200)
    rows, columns = picture.shape[:2]
    assert max(rows, columns) == 200
    assert picture.dtype == np.uint8
    assert (picture[[0, 0, -1, -1], [0, -1, 0, -1], 3] == 0).all()
    for (row, column), channel in {(0.25, 0.5): 1, (0.65, 0.25): 0, (0.65, 0.75): 2}.items():
        pixel = picture[int(row * rows), int(column * columns)]
        assert pixel[3] == 255
        assert pixel[:3].argmax() == channel, (row, column, pixel)
    edge = (picture[..., 3] > 0) & (picture[..., 3] < 255)
    assert 0 < edge.mean() < 0.03
    assert (picture[picture[..., 3] == 0] == 0).all()


def test_from_the_front_the_cube_is_its_first_plane():
    v = np.repeat(np.repeat(VOLUME[:, :7, :9], 4, axis=1), 4, axis=2)
    picture = volume.render_block(v, 1000, azimuth=0, elevation=0, interpolation="nearest")
    inside = picture[..., 3] == 255
    rows, columns = np.flatnonzero(inside.any(1)), np.flatnonzero(inside.any(0))
    middle = picture[np.ix_(
        rows[0] + ((np.arange(7) + 0.5) / 7 * len(rows)).astype(int),
        columns[0] + ((np.arange(9) + 0.5) / 9 * len(columns)).astype(int),
    )]  # fmt: skip
    assert_allclose(middle[..., :3], VOLUME[0, :7, :9] * np.float32(0.86), atol=1)


@pytest.mark.parametrize("shape", [(1, 9, 9), (9, 1, 9, 4), (2, 2, 2, 7), (5, 60, 5)])
def test_cubes_of_odd_volumes(shape):
    for dtype in (np.uint8, np.float32, bool):
        picture = volume.render_block(RNG.random(shape).astype(dtype), 32, azimuth=-130, elevation=-20)
        assert max(picture.shape[:2]) == 32
        assert (picture[..., 3] == 255).any()


def test_turntables_turn(tmp_path):
    v = samples.stripes((32, 32, 32)).image
    stages = []
    path = tmp_path / "turn.gif"
    volume.turntable(
        v, path, frames=6, size=80, seconds=1.2, background=(10, 20, 30), progress=lambda s, x: stages.append(x)
    )
    with Image.open(path) as gif:
        assert gif.n_frames == 6
        assert gif.info["duration"] == 200
        assert gif.info["loop"] == 0
        pictures = []
        for i in range(6):
            gif.seek(i)
            pictures.append(np.asarray(gif.convert("RGB")).astype(int))
    assert pictures[0].shape == (80, 80, 3)
    assert all(np.abs(p[0, 0] - (10, 20, 30)).max() < 16 for p in pictures)
    assert np.abs(pictures[0] - pictures[1]).mean() > 5
    assert stages[-1] == 1
    assert stages == sorted(stages)
    assert [p.name for p in tmp_path.iterdir()] == ["turn.gif"]


def test_a_turntable_that_is_stopped_leaves_nothing(tmp_path):
    def stop(stage, share):
        if share > 0.3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        volume.turntable(VOLUME, tmp_path / "a.gif", frames=4, size=32, progress=stop)
    assert not list(tmp_path.iterdir())


def test_labels_are_painted_apart():
    labels = np.arange(60).reshape(3, 4, 5)
    painted = volume.label_to_color(labels)
    assert painted.shape == (3, 4, 5, 3)
    table = painted.reshape(60, 3).astype(int)
    apart = np.abs(table[:, None] - table).sum(-1) + 999 * np.eye(60, dtype=int)
    assert apart.min() > 5
    assert apart[:16, :16].min() > 40
    assert (volume.label_to_color(labels % 7)[0, 0] == painted[0, 0]).all()
    assert volume.label_to_color(np.array([[0, 2**40]]))[0, 1].tolist() != volume.label_to_color([[0]])[0, 0].tolist()
    assert volume.label_to_color(np.eye(3, dtype=bool), [(0, 0, 0), (255, 0, 9)])[1, 1].tolist() == [255, 0, 9]


def signed_volume(vertices, faces):
    a, b, c = np.moveaxis(vertices.astype(float)[faces], 1, 0)
    return float((np.cross(a, b) * c).sum()) / 6


def test_surfaces_are_closed_and_face_outwards(tmp_path):
    sample = samples.particles((40, 48, 56))
    vertices, faces = volume.extract_surface(sample.labels > 0, spacing=(3, 2, 1))
    inside = 6 * (sample.labels > 0).sum()
    assert signed_volume(vertices, faces) == pytest.approx(inside, rel=0.05)
    assert (vertices.max(0) <= [56, 96, 120]).all()
    assert vertices.max(0)[0] > 45
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    _, shared = np.unique(edges, axis=0, return_counts=True)
    assert (shared % 2 == 0).all()  # Each edge belongs to an even number of triangles.
    io.write_surface(tmp_path / "particles.stl", vertices, faces)
    assert (tmp_path / "particles.stl").stat().st_size == 84 + 50 * len(faces)
    corner = np.zeros((4, 4, 4), bool)
    corner[:2, :2, :2] = True
    closed, opened = volume.extract_surface(corner)[1], volume.extract_surface(corner, closed=False)[1]
    assert len(opened) < len(closed)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda p: volume.slices(VOLUME, (7, 0, 0)), "at: must be an integer between -7 and 6"),
        (lambda p: volume.oblique_slice(VOLUME, (99, 0, 0), (1, 0, 0)), "must specify a slice that crosses the volume"),
        (lambda p: volume.oblique_slice(VOLUME, axes=[[1, 0, 0], [2, 0, 0]]), "not parallel"),
        (lambda p: volume.turntable(VOLUME, p / "a.png"), r"the suffix must be \.gif"),
        (lambda p: volume.turntable(VOLUME, p / "a.gif", frames=1), "frames"),
        (lambda p: volume.turntable(VOLUME, p / "a.gif", frames=100, size=1024), "must have at most 67108864 pixels"),
        (lambda p: volume.turntable(VOLUME, p / "a.gif", background=(1, 2)), "background"),
        (lambda p: volume.turntable(VOLUME, p / "none" / "a.gif", size=16), "does not exist"),
        (lambda p: volume.label_to_color([[0, -1]]), "at least 0, got -1"),
        (lambda p: volume.label_to_color([[0, 2]], [(0, 0, 0)]), "must be less than 1, the number of colours"),
        (lambda p: volume.extract_surface(np.eye(4, dtype=bool)[None].repeat(4, 0), spacing=(1, 1, 0)), "spacing"),
    ],
)
def test_bad_input_gets_a_sentence(make, says, tmp_path):
    with pytest.raises(TexrsError, match=says) as caught:
        make(tmp_path)
    assert isinstance(caught.value, InvalidInput | FileError)
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())

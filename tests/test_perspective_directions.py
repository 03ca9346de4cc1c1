"""Directions of elements: the rotation of the copied parts."""

import numpy as np
import pytest

import texrs
from texrs import Plane, fields, io, samples
from texrs.cli import main
from texrs.errors import InvalidInput

SIDE = 96


@pytest.fixture(scope="module")
def lines():
    """Return level lines that are not quite straight."""
    y, x = np.mgrid[:128, :128]
    wave = np.sin(2 * np.pi * (y + 0.8 * np.sin(x / 9)) / 9)
    return np.rint(127.5 + 100 * wave).astype(np.uint8)


def measure_directions(image, blur=8.0):
    """Return the directions of lines, degrees counter-clockwise from level, -90 to 90, by the structure tensor."""
    from scipy import ndimage

    rows, columns = np.gradient(image.astype(float))
    rr, cc, rc = (ndimage.gaussian_filter(v, blur) for v in (rows * rows, columns * columns, rows * columns))
    # Slopes are across lines, and rows grow downwards.
    return np.degrees(np.arctan2(2 * rc, rr - cc)) / 2


def apart(a, b):
    """Return the difference of line directions, in degrees."""
    return np.abs((np.asarray(a) - b + 90) % 180 - 90)


INNER = (slice(16, -16),) * 2


@pytest.mark.parametrize("angle", [0, 30, -50, 90, 390.0])
def test_what_is_copied_is_turned_counter_clockwise(lines, angle):
    made = texrs.perspective(lines, "front", SIDE, direction=angle, seed=1)
    assert made.report["turned"]
    assert np.median(apart(measure_directions(made.image)[INNER], angle)) < 5
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    np.testing.assert_allclose(
        made.source_map.jacobians(), np.broadcast_to([[c, s], [-s, c]], (SIDE, SIDE, 2, 2)), atol=1e-3
    )


def test_directions_may_change_from_pixel_to_pixel(lines):
    x = np.arange(SIDE)[np.newaxis].repeat(SIDE, axis=0)
    angles = 50 * np.sin(2 * np.pi * x / SIDE)
    made = texrs.perspective(lines, "front", direction=angles, size=SIDE, seed=1)
    assert np.median(apart(measure_directions(made.image, 4.0)[INNER], angles[INNER])) < 8
    # A map of directions of another size is stretched, also across the jump from 350 to 10 degrees.
    coarse = np.array([[350.0, 10.0]])
    level = texrs.perspective(lines, "front", SIDE, direction=coarse, seed=1)
    assert np.median(apart(measure_directions(level.image)[INNER], 0)) < 8


def test_a_field_turns_as_it_does_elsewhere(lines):
    made = texrs.perspective(lines, "front", SIDE, direction="circular", seed=1)
    field = fields.parse("circular", 2, (SIDE, SIDE))
    wanted = field.lattice((SIDE, SIDE))
    np.testing.assert_allclose(made.source_map.jacobians(), wanted, atol=1e-3)
    again = texrs.perspective(lines, "front", SIDE, direction=field, seed=1)
    np.testing.assert_array_equal(again.image, made.image)
    # Only the rotation of frames counts, not their scale.
    ramp = texrs.perspective(lines, "front", SIDE, direction=fields.scale_ramp(1, 2, length=SIDE, axes=2), seed=1)
    np.testing.assert_allclose(ramp.source_map.jacobians(), np.broadcast_to(np.eye(2), (SIDE, SIDE, 2, 2)), atol=1e-3)


def test_sizes_are_followed_at_the_same_time(lines):
    target = np.linspace(0.7, 1.4, SIDE, dtype=np.float32)[:, np.newaxis].repeat(SIDE, axis=1)
    made = texrs.perspective(lines, "front", target=target, direction=60.0, seed=1)
    np.testing.assert_allclose(np.linalg.det(made.source_map.jacobians()), 1 / target**2, rtol=0.01)
    np.testing.assert_allclose(made.stages["target"], target, rtol=1e-5)
    assert np.median(apart(measure_directions(made.image)[INNER], 60)) < 6


def test_on_a_plane_it_turns_there():
    floor = samples.tilted_discs((128, 128)).image
    own, other = Plane((128, 128), 50, 90, 37), Plane((SIDE, SIDE), 40, 90, 40)
    straight = texrs.perspective(floor, own, target=other, direction=0.0, seed=1).source_map
    turned = texrs.perspective(floor, own, target=other, direction=30.0, seed=1).source_map
    flat = {}
    for name, source in (("straight", straight), ("turned", turned)):
        at, frames = source.coordinates.astype(float), source.jacobians().astype(float)
        away, wide = at - own.principal_point, own.width(at)[..., None, None]
        fold = own._affine / wide - (away @ own._affine.T)[..., :, None] * own._rise / wide**2
        flat[name] = fold @ frames
    c, s = np.cos(np.radians(30)), np.sin(np.radians(30))
    np.testing.assert_allclose(flat["turned"], np.array([[c, s], [-s, c]]) @ flat["straight"], atol=0.04)
    # Directions also work with a scale map as target, which keeps the plane's own foreshortening.
    plain = texrs.perspective(floor, own, SIDE, direction=30.0, seed=1)
    assert plain.report["sheet"]["kind"] == "plane"
    assert plain.report["scale_error"] < 0.1


def test_copies_are_turned_too():
    import perspective_checks as checks

    image, scale = checks.floor((128, 128))
    made = texrs.perspective(image, scale, 64, direction=90.0, seed=1)
    assert made.report["sheet"]["kind"] == "copies"
    assert made.report["scale_error"] < 0.1
    frames = made.source_map.jacobians()
    np.testing.assert_allclose(frames[..., 0, 0], 0, atol=1e-3)
    assert (frames[..., 0, 1] > 0).all()
    assert (frames[..., 1, 0] < 0).all()


@pytest.mark.parametrize("count", [2, 7])
def test_same_bytes_for_any_number_of_threads(lines, count):
    with texrs.threads(count):
        many = texrs.perspective(lines, "front", SIDE, direction="zigzag:period=48", seed=3)
    with texrs.threads(1):
        one = texrs.perspective(lines, "front", SIDE, direction="zigzag:period=48", seed=3)
    assert one.image.tobytes() == many.image.tobytes()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"direction": np.full((4, 4), np.inf)}, "direction: all angles must be finite"),
        ({"direction": fields.circular()}, "direction: must be a field with 2 axes"),
        ({"direction": 9.0, "method": "paper"}, "method: 'paper' cannot be combined with a surface"),
        (
            {"direction": np.array([[0.0, 90.0]]), "wrap": (False, True)},
            "wrap: directions of the first and last columns",
        ),
    ],
)
def test_bad_input_is_named(lines, given, words):
    with pytest.raises(InvalidInput, match=words):
        texrs.perspective(lines, "front", 32, **given)


def test_on_the_command_line(tmp_path, monkeypatch, capsys, lines):
    monkeypatch.chdir(tmp_path)
    io.write("lines.png", lines)
    np.save("angles.npy", np.full((8, 8), 40.0))
    for text, given in (("40", 40.0), ("angles.npy", np.full((8, 8), 40.0)), ("circular", "circular")):
        line = f"perspective lines.png -o out.png --scale-map front --size 48 --direction {text} -q"
        assert main(line.split()) == 0, capsys.readouterr().err
        made = texrs.perspective(lines, "front", 48, direction=given)
        np.testing.assert_array_equal(io.read("out.png"), made.image)
    for text, words in (("up", "up"), ("none.npy", "none.npy")):
        line = f"perspective lines.png -o two.png --scale-map front --size 48 --direction {text}"
        assert main(line.split()) == 2
        assert words in capsys.readouterr().err

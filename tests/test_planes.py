"""Planes: every way to give one describes the same plane, and the found plane is the true one."""

from collections.abc import Callable

import numpy as np
import pytest

from plane_checks import look, look_twice, turn_between
from texrs import Plane, planes, samples, scale_maps
from texrs.errors import InvalidInput
from texrs.planes._find import trust
from texrs.planes._lines import Lines, find_lines, lean

FLOOR = Plane((240, 320), slant=50, tilt=70, fov=55)
TURNED = Plane((240, 320), slant=50, tilt=70, fov=55, rotation=20)
POINTS = np.random.default_rng(0).uniform((60, 0), (239, 319), (40, 2))


@pytest.mark.parametrize("plane", [FLOOR, TURNED, Plane((64, 64), 0)])
def test_there_and_back(plane: Plane) -> None:
    points = POINTS % 64 if plane.slant == 0 else POINTS
    there = plane.flatten(points)
    np.testing.assert_allclose(plane.project(there), points, atol=1e-8)
    lifted = np.concatenate([points, np.ones((len(points), 1))], axis=1) @ plane.homography.T
    np.testing.assert_allclose(lifted[:, :2] / lifted[:, 2:], there, atol=1e-8)
    step = 1e-5
    slopes = [(plane.project(there + step * way) - plane.project(there - step * way)) / (2 * step) for way in np.eye(2)]
    np.testing.assert_allclose(plane.projection_jacobians(there), np.stack(slopes, axis=-1), atol=1e-6)
    # Areas follow from the frames, and their square roots are the power 3/2 of widths.
    areas = np.sqrt(np.abs(np.linalg.det(plane.projection_jacobians(there))))
    np.testing.assert_allclose(areas / plane.width(points) ** 1.5, np.cos(np.radians(plane.slant)) ** 0.5)


def test_scales_are_those_of_the_angles() -> None:
    np.testing.assert_allclose(FLOOR.scale_map(), scale_maps.from_angles(FLOOR.shape, 50, 70, fov=55), rtol=1e-5)
    np.testing.assert_allclose(FLOOR.scale_map("area"), FLOOR.scale_map() ** 1.5, rtol=1e-5)


def test_all_ways_to_say_it_are_one_plane() -> None:
    corners = FLOOR.project([[-20, -30], [-20, 40], [25, 40], [25, -30]])
    assert FLOOR.horizon is not None
    said = {
        "corners": Plane.of_corners(FLOOR.shape, corners),
        "corners the other way round": Plane.of_corners(FLOOR.shape, corners[::-1]),
        "vanishing points": Plane.of_vanishing_points(FLOOR.shape, FLOOR.vanishing_points),
        "horizon": Plane.of_horizon(FLOOR.shape, FLOOR.horizon, fov=55),
        "widths": Plane.of_scale_map(FLOOR.scale_map(), scale_kind="width", fov=55),
        "areas": Plane.of_scale_map(FLOOR.scale_map("area"), fov=55),
        "dictionary": Plane.of(FLOOR.as_dict()),
    }
    for name, plane in said.items():
        assert max(turn_between(plane, FLOOR)) < 0.1, name
        assert abs(plane.fov - 55) < 0.1, name


@pytest.mark.parametrize("turn", [-40.0, 0.0, 45.0])
def test_a_rectangle_lies_level(turn: float) -> None:
    plane = Plane((240, 320), slant=50, tilt=70, fov=55, rotation=turn)
    corners = plane.project([[-20, -30], [-20, 40], [25, 40], [25, -30]])
    found = Plane.of_corners(plane.shape, corners)
    flat = found.flatten(corners)
    sides = np.roll(flat, -1, axis=0) - flat
    assert np.abs(sides).min(axis=1).max() < 1e-4
    np.testing.assert_allclose(np.sort(np.abs(sides).max(axis=1)), [45, 45, 70, 70], rtol=1e-4)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda: Plane.of_corners((64, 64), [[0, 0], [9, 9], [0, 9], [9, 0]]),
            "corners: must form a convex quadrilateral",
        ),
        (lambda: Plane.of_horizon((64, 64), [[-5, 3], [-5, 3]]), "horizon: must be different points"),
        (lambda: Plane.of_horizon((64, 64), [[31.5, 0], [31.5, 9]]), "not pass through the middle of the image"),
        (lambda: Plane.of_horizon((64, 64), [[31.0, 0], [31.0, 9]]), "edge on"),
        (lambda: Plane.of_vanishing_points((64, 64), [[1, 2], [np.nan, 2]]), "points"),
        (
            lambda: planes.find(samples.dots().image, known=np.zeros((256, 256), bool)),
            "known: must mark at least 1024 pixels",
        ),
    ],
)
def test_what_is_no_plane_gets_a_sentence(make: Callable[[], object], words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        make()


@pytest.mark.parametrize("name", ["pebbles", "dots", "weave"])
@pytest.mark.parametrize(("slant", "tilt", "noise"), [(35, 90, 0), (45, 205, 6)])
def test_planes_are_found(name: str, slant: float, tilt: float, noise: float) -> None:
    plane = Plane((192, 224), slant, tilt, fov=55)
    found = planes.find(look(name, plane, seed=3, noise=noise), fov=55)
    steep, aside = turn_between(found, plane)
    assert steep <= 8
    assert aside <= 15


@pytest.mark.parametrize(
    ("name", "slant", "tilt", "seed"), [("bricks", 48, 323, 0), ("bricks", 50, 110, 6), ("setts", 57, 237, 7)]
)
def test_straight_lines_tell(name: str, slant: float, tilt: float, seed: int) -> None:
    plane = Plane((256, 320), slant, tilt, fov=55)
    steep, aside = turn_between(planes.find(look(name, plane, seed=seed, noise=6), fov=55), plane)
    assert steep <= 6
    assert aside <= 12


def test_lines_lean_towards_their_horizon() -> None:
    side, rng = 320, np.random.default_rng(0)
    middles = rng.uniform(-120, 120, (400, 2))
    rise = np.array([0.4, -0.7])
    # Three of four lines run in one of two directions of the plane, with an error.
    angles = np.where(rng.uniform(0, 1, 400) < 0.75, rng.choice([0.3, 1.6], 400), rng.uniform(0, np.pi, 400))
    way = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    seen = way + middles / side * (way @ rise)[:, np.newaxis]
    turn = np.arctan2(seen[:, 1], seen[:, 0]) + rng.normal(0, 0.02, 400)
    ways = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    lines = Lines(middles, ways, rng.uniform(15, 50, 400))
    told = lean(lines, side, np.array([0.1, -0.3]), 0.5, 0.9)
    assert np.abs(told.rise - rise).max() < 0.05
    assert np.degrees(told.spreads).max() < 3
    # Random directions are not evidence of a plane.
    anyhow = rng.uniform(0, np.pi, 400)
    loose = Lines(middles, np.stack([np.cos(anyhow), np.sin(anyhow)], axis=-1), lines.lengths)
    assert np.abs(lean(loose, side, np.zeros(2), 0.1, 0.9).rise).max() < 0.1


def test_lines_of_a_board_are_found() -> None:
    board = np.kron(np.indices((6, 8)).sum(axis=0) % 2, np.ones((40, 40))).astype(np.float32)
    lines = find_lines(board, np.ones(board.shape, np.bool_))
    # A line is found for each side of a square where two colours meet.
    assert len(lines.lengths) >= 5 * 8 + 6 * 7
    assert np.abs(np.abs(lines.ways).max(axis=1) - 1).max() < 1e-3
    assert np.median(lines.lengths) == pytest.approx(40, abs=5)


def test_what_is_seen_from_the_front_is_no_slope() -> None:
    for name in ("pebbles", "weave"):
        assert planes.find(samples.load(name, size=(192, 192)).image).slant < 12


def test_what_is_not_the_plane_does_not_count() -> None:
    plane = Plane((192, 224), 40, 90, fov=55)
    picture = look("pebbles", plane)
    ground = np.ones(plane.shape, bool)
    ground[:60] = False
    covered = picture.copy()
    covered[:60] = samples.load("bark", size=(60, 224)).image
    one, other = (planes.find(p, fov=55, known=ground) for p in (picture, covered))
    assert max(turn_between(one, plane)) <= 10
    assert max(turn_between(one, other)) <= 2


def test_the_same_doubt_is_more_of_a_small_slant() -> None:
    # The same error changes the tilt more if the rise is small. Without slant, the tilt does not count.
    steep, aslant, front = (trust(rise, 0.03, 0.06, 1.4) for rise in (0.6, 0.2, 0.001))
    assert aslant < 0.8 * steep
    assert aslant < front
    # The confidence is also lower if bands differ, if measurements deviate from the plane, or with a longer lens,
    # which gives a larger slant for the same rise.
    assert trust(0.6, 0.5, 0.06, 1.4) < 0.7 * steep
    assert trust(0.6, 0.03, 0.3, 1.4) < 0.5 * steep
    assert trust(0.3, 0.03, 0.06, 3.0) < trust(0.3, 0.03, 0.06, 1.0)


def test_confidence_says_what_to_believe() -> None:
    floor = look("weave", Plane((192, 224), 35, 90, fov=55))
    sure = planes.find(floor, fov=55)
    assert planes.find(floor, fov=55) == sure
    # An image of two planes and a wall gives a lower confidence.
    torn = planes.find(look_twice(), fov=55)
    assert 0 <= torn.confidence < sure.confidence <= 1

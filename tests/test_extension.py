"""Photographs of planes extended beyond their borders in the same perspective; user errors; the command."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import texrs
from plane_checks import look, look_at_room, look_twice, turn_between
from texrs import Plane, PlaneView, io, planes
from texrs.cli import main
from texrs.errors import InvalidInput

PLANE = Plane((160, 176), 40, 100, fov=55)


@cache
def look_at_floor() -> np.ndarray:
    return look("pebbles", PLANE)


@cache
def extend_floor() -> texrs.Synthesis:
    return texrs.extend(look_at_floor(), left=64, right=80, bottom=24, view=PLANE, seed=2)


def test_nothing_known_changes() -> None:
    assert extend_floor().image.shape == (184, 320, 3)
    np.testing.assert_array_equal(extend_floor().image[:160, 64:240], look_at_floor())
    np.testing.assert_array_equal(
        extend_floor().source_map.render(look_at_floor(), antialias=True), extend_floor().stages["before_blending"]
    )
    np.testing.assert_array_equal(texrs.apply(extend_floor().source_map, look_at_floor()), extend_floor().image)
    inside = np.moveaxis(np.indices((160, 176)), 0, -1)
    np.testing.assert_array_equal(extend_floor().source_map.coordinates[:160, 64:240], inside)
    assert extend_floor().report["added"] == {"top": 0, "bottom": 24, "left": 64, "right": 80}


def test_it_is_the_same_plane() -> None:
    """The plane of the result is the plane of the photograph, seen from further left."""
    before, after = (planes.find(picture, fov=50) for picture in (look_at_floor(), extend_floor().image[:160, :240]))
    steep, aside = turn_between(before, after)
    assert steep <= 12
    assert aside <= 25
    # Elements of the added part have the size of their neighbours.
    scales = np.abs(np.linalg.det(extend_floor().source_map.jacobians()[:160, 250:310]))
    assert 0.6 < np.median(scales) < 1.7


def test_a_sky_goes_on_above_the_floor_and_a_wall_behind_it() -> None:
    picture, low, floor, wall = look_at_room((160, 200))
    sky = np.broadcast_to(np.array([150, 185, 230], np.uint8), picture.shape)
    above = np.where(low[..., np.newaxis], picture, sky)
    made = texrs.extend(above, right=40, view=PlaneView(plane=floor, ground=low), seed=1)
    new = made.image[:, 200:].astype(int)
    blue = new[..., 2] > new[..., 0] + 40
    # The line between the two planes continues in the added part.
    y, x = np.indices((160, 240))[:, :, 200:]
    line = y - 0.12 * (x - 100) - 0.47 * 160
    assert blue[line < -4].mean() > 0.99
    assert blue[line > 4].mean() < 0.02
    views = [PlaneView(plane=floor, ground=low), PlaneView(plane=wall, ground=~low)]
    room = texrs.extend(picture, right=40, view=views, seed=1)
    rows, columns = np.rint(room.source_map.coordinates[:, 200:]).astype(int).reshape(-1, 2).T
    assert (low[rows, columns] == (line > 0).ravel()).mean() > 0.97


def test_a_thing_at_the_border_does_not_go_on() -> None:
    seen, ground = look_at_floor().copy(), np.ones(look_at_floor().shape[:2], np.bool_)
    ground[100:, 50:120] = False
    seen[~ground] = (210, 20, 200)
    made = texrs.extend(seen, bottom=40, view=PlaneView(plane=PLANE, ground=ground), seed=1)
    rows, columns = np.rint(made.source_map.coordinates[160:]).astype(int).reshape(-1, 2).T
    assert ground[rows, columns].all()
    # An object that covers the whole border continues, such as a wall on the left.
    wall = np.ones_like(ground)
    wall[:, :50] = False
    made = texrs.extend(seen, left=30, view=PlaneView(plane=PLANE, ground=wall), seed=1)
    rows, columns = np.rint(made.source_map.coordinates[:, :30]).astype(int).reshape(-1, 2).T
    assert not wall[rows, columns].any()


def test_a_plane_goes_on_away_from_a_horizon_that_is_seen() -> None:
    steep = Plane((160, 176), 80, 90, fov=55)
    assert steep.width([[0, 88]]).min() < 0
    made = texrs.extend(look_at_floor(), bottom=20, view=steep, seed=1)
    assert made.image.shape == (180, 176, 3)
    with pytest.raises(InvalidInput, match="horizon"):
        texrs.extend(look_at_floor(), top=20, view=steep)


def test_a_doubtful_plane_is_not_followed() -> None:
    with pytest.warns(UserWarning, match="not used"):
        made = texrs.extend(look_twice(), bottom=16, seed=1)
    assert made.report["planes"] == [{"plane": None, "found": False}]
    assert np.abs(np.abs(np.linalg.det(made.source_map.jacobians())) - 1).max() < 1e-6


def test_again_and_otherwise() -> None:
    again = texrs.extend(look_at_floor(), left=64, right=80, bottom=24, view=PLANE, seed=2)
    np.testing.assert_array_equal(again.image, extend_floor().image)
    grey = texrs.extend(
        look_at_floor()[..., 0].astype(np.uint16), top=16, view=PlaneView(slant=40, tilt=100, fov=55), boundary_width=2
    )
    assert grey.image.shape == (176, 176)
    assert grey.image.dtype == np.uint16
    assert grey.stages["before_blending"].shape == (176, 176)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: texrs.extend(look_at_floor(), top=300, view=PLANE), "reach the horizon of the plane"),
        (
            lambda: texrs.extend(look_at_floor(), top=8, view=PlaneView(corners=[[0, 0]] * 4)),
            "corners: must form a convex quadrilateral",
        ),
    ],
)
def test_what_cannot_be_extended_gets_a_sentence(make: Callable[[], object], words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        make()


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    photo, out = str(tmp_path / "floor.png"), str(tmp_path / "larger.png")
    io.write(photo, look_at_floor())
    said = ["--slant", "40", "--tilt", "100", "--fov", "55", "--seed", "2"]
    assert main(["extend", photo, "-o", out, "--left", "64", "--right", "80", "--bottom", "24", *said]) == 0
    np.testing.assert_array_equal(io.read(out), extend_floor().image)
    assert main(["extend", photo, "-o", str(tmp_path / "none.png"), *said]) == 2
    assert "at least one must be above 0" in capsys.readouterr().err
    assert not (tmp_path / "none.png").exists()

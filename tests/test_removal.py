"""Objects removed from photographs: the ground plane, the parts behind it, user errors, the command."""

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

import texrs
from plane_checks import dress, look, look_at_room
from texrs import Plane, PlaneView, io, planes
from texrs.cli import main
from texrs.errors import InvalidInput
from texrs.inpainting._sides import share_out

SIZE = (180, 240)
PLANE = Plane(SIZE, 48, 90, fov=55)


def see(
    name: str, *, sky: bool = False, thing: bool = False
) -> tuple[NDArray[np.uint8], NDArray[np.bool_], NDArray[np.bool_]]:
    """Return an image of a floor, the mask of the floor, and the mask of the object on it."""
    picture = look(name, PLANE, noise=2.0).astype(float)
    ground, marked = np.ones(SIZE, bool), np.zeros(SIZE, bool)
    if sky:
        rng = np.random.default_rng(1)
        clouds = np.clip(15 * gaussian_filter(rng.normal(0, 1, SIZE), 15), 0, 1)[..., np.newaxis]
        rows = np.arange(SIZE[0])[:, np.newaxis, np.newaxis] / SIZE[0]
        blue = np.array([150, 185, 230]) + 60 * rows + 30 * clouds
        ground[:55] = False
        picture[:55] = blue[:55]
    if thing:
        marked[60:120, 100:135] = True
        picture[marked] = (70, 40, 200)
    return np.clip(np.rint(picture), 0, 255).astype(np.uint8), ground, marked


@pytest.mark.parametrize("name", ["pebbles", "dots", "weave", "beans"])
def test_ground_is_told_from_sky_and_things(name: str) -> None:
    plain, *_ = see(name)
    assert planes.find_ground(plain).all()
    picture, ground, marked = see(name, sky=True, thing=True)
    found, there = planes.find_ground(picture), ground & ~marked
    assert (found & there).sum() / (found | there).sum() >= 0.9
    # Unknown pixels do not belong to the ground.
    known = planes.find_ground(picture, known=~marked)
    assert not known[marked].any()
    assert (known & there).sum() / (known | there).sum() >= 0.9


@pytest.mark.parametrize("name", ["pebbles", "dots", "weave"])
def test_strong_light_is_no_other_ground(name: str) -> None:
    picture, *_ = see(name)
    assert planes.find_ground(shine(picture)).all()


@pytest.mark.parametrize(
    ("name", "above"), [("setts", "bark"), ("beans", "bark"), ("weave", "grit"), ("pebbles", "bricks")]
)
def test_a_wall_is_no_ground_where_one_slow_change_follows_both(name: str, above: str) -> None:
    plane = Plane((225, 300), 42, 90, fov=55)
    picture, ground = dress(look(name, plane), plane.tilt, above=above, seed=1)
    found = planes.find_ground(picture)
    assert (found & ground).sum() / (found | ground).sum() >= 0.9
    # The border of a shadow is also a step of brightness, but does not end the ground.
    shadow = np.where(ground[..., np.newaxis], 1.0, 0.8) * look(name, plane)
    assert planes.find_ground(shadow.astype(np.uint8)).mean() > 0.97


def shine(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the image in the light of a window on the right."""
    y, x = (np.indices(SIZE) + 0.5) / np.array(SIZE).reshape(2, 1, 1)
    light = np.exp(0.9 * (x - 0.5) - 0.5 * ((x - 0.5) ** 2 + (y - 0.4) ** 2))
    return np.clip(np.rint(picture * light[..., np.newaxis]), 0, 255).astype(np.uint8)


def test_light_is_followed() -> None:
    lit = shine(look("weave", PLANE))
    marked = np.zeros(SIZE, bool)
    marked[60:125, 150:225] = True
    seen = np.where(marked[..., np.newaxis], np.uint8(90), lit)
    off = {}
    for light in (False, True):
        made = texrs.remove(seen, marked, view=PlaneView(plane=PLANE, ground=~marked), match_lighting=light, seed=1)
        sides = [
            np.log(picture[60:125, 150:225].reshape(65, 3, 25, 3).mean(axis=(0, 2, 3))) for picture in (made.image, lit)
        ]
        off[light] = np.abs(sides[0] - sides[1]).mean()
        np.testing.assert_array_equal(texrs.apply(made.source_map, seen), made.image)
        kept = made.source_map.label == 0
        np.testing.assert_array_equal(made.image[kept], seen[kept])
    assert off[True] < 0.6 * off[False]
    # In even light there is nothing to follow.
    even = [
        texrs.remove(look_at_floor(), MARKED, view=PLANE, match_lighting=light, seed=1).image for light in (False, True)
    ]
    np.testing.assert_array_equal(*even)


def test_a_large_tile_is_no_thing() -> None:
    squares = np.kron((np.indices((8, 8)).sum(axis=0) % 2), np.ones((24, 24)))
    rng = np.random.default_rng(0)
    chequers = 60 + 120 * squares[..., np.newaxis] + rng.normal(0, 6, (192, 192, 3))
    assert planes.find_ground(chequers.astype(np.uint8)).mean() > 0.97


def test_what_goes_is_filled_from_the_ground_alone() -> None:
    picture, ground, marked = see("beans", sky=True, thing=True)
    made = texrs.remove(picture, marked, boundary_width=0, seed=1)
    assert made.report["planes"][0]["found"]
    assert made.report["beyond"] == 0
    wide = made.stages["known"] != picture
    assert wide.any(axis=2)[marked].all()
    np.testing.assert_array_equal(made.image[~wide.any(axis=2)], picture[~wide.any(axis=2)])
    # Filled pixels are not blue, so they are not copied from the sky.
    filled = made.image[marked].astype(float)
    assert (filled[:, 2] < filled[:, 0] + 30).mean() > 0.99
    rows, columns = np.rint(made.source_map.coordinates[marked]).astype(int).T
    assert ground[rows, columns].all()
    assert not marked[rows, columns].any()


def test_a_shadow_that_is_left_does_not_go_on() -> None:
    picture, ground, marked = see("beans", sky=True, thing=True)
    shadow = np.zeros(SIZE, bool)
    shadow[100:, 92:104] = shadow[122:, 92:150] = True
    picture[shadow & ~marked] //= 4
    made = texrs.remove(picture, marked, view=PlaneView(plane=PLANE, ground=ground & ~marked & ~shadow), seed=1)
    rows, columns = np.rint(made.source_map.coordinates[marked]).astype(int).T
    assert not shadow[rows, columns].any()
    # Patches are not copied from the sky either, except into a hole in the sky.
    assert ground[rows, columns].all()
    aloft = np.zeros(SIZE, bool)
    aloft[20:35, 60:90] = True
    made = texrs.remove(picture, aloft, view=PlaneView(plane=PLANE, ground=ground & ~shadow), seed=1)
    rows, columns = np.rint(made.source_map.coordinates[aloft]).astype(int).T
    assert not ground[rows, columns].any()


def test_each_of_several_planes_is_filled_from_its_own() -> None:
    picture, low, floor, wall = look_at_room((160, 200))
    marked = np.zeros(low.shape, bool)
    marked[40:110, 80:110] = True
    views = [PlaneView(plane=floor, ground=low), PlaneView(plane=wall, ground=~low)]
    made = texrs.remove(np.where(marked[..., np.newaxis], np.uint8(9), picture), marked, view=views, seed=1)
    changed = made.source_map.label > 0
    rows, columns = np.rint(made.source_map.coordinates[changed]).astype(int).T
    # The two planes meet in the line that continues their border.
    assert (low[rows, columns] == low[changed]).mean() > 0.97
    assert not marked[rows, columns].any()
    assert [each["plane"]["slant"] for each in made.report["planes"]] == [50, 35]
    assert min(made.report["patches"]) > 0
    np.testing.assert_array_equal(made.image[~changed], picture[~changed])
    # The colours of the planes do not mix: bricks are red, pebbles are not.
    red = made.image[..., 0] - made.image[..., 2].astype(float)
    assert np.median(red[changed & ~low]) > 40 > 25 > np.median(red[changed & low])


@pytest.mark.parametrize("slope", [0.0, -0.4, 1.7])
def test_parts_meet_in_a_hole_in_their_line(slope: float) -> None:
    rows, columns = np.indices((90, 120))
    low = rows - 45 > slope * (columns - 60)
    hole = np.zeros(low.shape, bool)
    # The hole is nearer to the first part.
    hole[20:52, 40:85] = True
    everywhere = np.ones_like(hole)
    owner = share_out(hole, [low & ~hole, ~low & ~hole], [everywhere, everywhere])
    assert (owner[hole] == ~low[hole]).mean() > 0.98
    assert (owner[~hole] == -1).all()
    # A part that cannot reach the hole does not continue there.
    assert (share_out(hole, [low & ~hole, ~low & ~hole], [~everywhere, everywhere])[hole] == 1).all()


def test_parts_that_meet_in_no_line_go_on_where_they_are_nearer() -> None:
    rows, columns = np.indices((80, 80))
    disc = np.hypot(rows - 40, columns - 40) < 18
    hole = np.zeros(disc.shape, bool)
    hole[25:55, 35:75] = True
    everywhere = np.ones_like(hole)
    owner = share_out(hole, [disc & ~hole, ~disc & ~hole], [everywhere, everywhere])
    assert (owner[30:50, 36:40] == 0).all()
    assert (owner[30:50, 66:75] == 1).all()


def test_seams_may_run_a_little_around_it() -> None:
    rows, columns = np.nonzero(
        (texrs.remove(look_at_floor(), MARKED, view=PLANE, margin=2, boundary_width=5).image != look_at_floor()).any(
            axis=2
        )
    )
    assert 63 <= rows.min() <= 68
    assert 91 <= columns.max() <= 97


def test_what_it_hid_of_the_sky_is_sky() -> None:
    picture, _, _ = see("beans", sky=True)
    marked = np.zeros(SIZE, bool)
    marked[20:100, 100:130] = True
    picture[marked] = (70, 40, 200)
    made = texrs.remove(picture, marked, seed=1)
    assert made.report["beyond"] > 0
    blue = made.image[..., 2].astype(int) > made.image[..., 0]
    upper, lower = marked.copy(), marked.copy()
    upper[50:], lower[:62] = False, False
    assert blue[upper].mean() > 0.97
    assert blue[lower].mean() < 0.05


def test_a_plane_seen_from_the_front_needs_no_perspective() -> None:
    wall = texrs.samples.bricks((128, 128)).image
    marked = np.zeros((128, 128), bool)
    marked[40:70, 50:90] = True
    made = texrs.remove(wall, marked, view=PlaneView(slant=0))
    assert made.report["planes"][0]["plane"] is None
    np.testing.assert_array_equal(made.image[:30], wall[:30])


def test_a_doubtful_plane_is_said_and_not_followed() -> None:
    rng = np.random.default_rng(3)
    noise = np.clip(128 + 60 * gaussian_filter(rng.normal(0, 1, (96, 96, 3)), (12, 12, 0)) * 12, 0, 255).astype(
        np.uint8
    )
    noise[:48] = noise[:48] // 2
    marked = np.zeros((96, 96), bool)
    marked[50:60, 50:60] = True
    with pytest.warns(UserWarning, match="not used"):
        made = texrs.remove(noise, marked)
    assert made.report["planes"][0]["plane"] is None


def test_grey_pictures_of_16_bit_and_again() -> None:
    floor = look("pebbles", PLANE)[..., 0].astype(np.uint16) * 200
    marked = np.zeros(SIZE, bool)
    marked[70:90, 60:90] = True
    one, two = (texrs.remove(floor, marked, view=PLANE, seed=4, screening=None) for _ in range(2))
    assert one.image.dtype == np.uint16
    assert one.image.shape == SIZE
    assert one.stages["before_blending"].shape == SIZE
    np.testing.assert_array_equal(one.image, two.image)
    np.testing.assert_array_equal(one.source_map.render(floor), one.image)


@cache
def look_at_floor() -> np.ndarray:
    return look("pebbles", PLANE)


MARKED = np.zeros(SIZE, bool)
MARKED[70:90, 60:90] = True


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda: texrs.remove(look_at_floor(), MARKED, view=PlaneView(ground=MARKED)),
            "ground: must have pixels outside the hole",
        ),
        (lambda: texrs.remove(look_at_floor(), MARKED, view=[PLANE, PLANE]), "ground: must be given for all but one"),
        (
            lambda: texrs.remove(look_at_floor(), MARKED, view=[PlaneView(ground=~MARKED), PlaneView(ground=~MARKED)]),
            "ground: must have pixels outside the hole",
        ),
        (
            lambda: texrs.remove(look_at_floor(), MARKED, view=[PLANE, PlaneView(ground=MARKED | True)]),
            "ground: the other planes leave",
        ),
        (lambda: texrs.remove(look_at_floor(), MARKED, patch_size=2), "patch_size: "),
        (lambda: planes.find_ground(look_at_floor(), known=MARKED & False), "known: must mark at least one"),
        (
            lambda: texrs.inpaint(look_at_floor(), MARKED, allowed=MARKED),
            "allowed: must mark at least one pixel outside the hole",
        ),
        (
            lambda: texrs.inpaint(look_at_floor(), MARKED, allowed=~MARKED, method="optimise"),
            "allowed: cannot be combined",
        ),
        (
            lambda: texrs.inpaint(look_at_floor(), MARKED, allowed=~MARKED, exemplar=look_at_floor()),
            "allowed: cannot be combined",
        ),
    ],
)
def test_what_cannot_be_done_gets_a_sentence(make: Callable[[], object], words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        make()


def test_patches_come_from_where_they_may() -> None:
    allowed = np.zeros(SIZE, bool)
    allowed[100:, :] = True
    made = texrs.inpaint(look_at_floor(), MARKED, allowed=allowed)
    assert (made.source_map.coordinates[MARKED][:, 0] >= 99.5).all()


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    photo, mask, out = (str(tmp_path / f"{name}.png") for name in ("photo", "mask", "out"))
    io.write(photo, look_at_floor())
    io.write(mask, MARKED.astype(np.uint8) * 255)
    assert main(["remove", photo, mask, "-o", out, "--slant", "48", "--fov", "55", "--seed", "2"]) == 0
    assert "slant 48.0" in capsys.readouterr().err
    np.testing.assert_array_equal(
        io.read(out), texrs.remove(look_at_floor(), MARKED, view=PlaneView(slant=48, fov=55), seed=2).image
    )
    assert main(["remove", photo, mask, "-o", str(tmp_path / "no.png"), "--margin", "99"]) == 2
    assert "--margin" in capsys.readouterr().err
    assert not (tmp_path / "no.png").exists()
    picture, low, floor, wall = look_at_room((160, 200))
    marked = np.zeros(low.shape, bool)
    marked[60:90, 80:100] = True
    lower, upper = (str(tmp_path / f"{name}.png") for name in ("lower", "upper"))
    for path, what in ((photo, picture), (mask, marked * 255), (lower, low * 255), (upper, ~low * 255)):
        io.write(path, what.astype(np.uint8))
    said = ["remove", photo, mask, "-o", out, "--ground", lower, "--ground", upper]
    assert main([*said, "--fov", "55", "--slant", "50", "--slant", "35", "--tilt", "90", "--tilt", "10"]) == 0
    views = [PlaneView(plane=floor, ground=low), PlaneView(plane=wall, ground=~low)]
    np.testing.assert_array_equal(io.read(out), texrs.remove(picture, marked, view=views).image)
    capsys.readouterr()
    for more, words in (
        (["--slant", "50"], "--slant: must be given for each of 2 planes"),
        (["--slant", "fifty", "--slant", "3"], "--slant: must be a number, or found"),
        (["--ground", "found", "--ground", "found"], "--ground: must be given for all but one"),
    ):
        assert main([*said, *more]) == 2
        assert re.search(words, capsys.readouterr().err)


def test_a_photograph_is_extended_to_a_size() -> None:
    made = texrs.extend(look_at_floor(), size=(196, 260), view=PLANE, seed=1)
    assert made.image.shape == (196, 260, 3)
    assert made.report["added"] == {"top": 8, "bottom": 8, "left": 10, "right": 10}
    steep = Plane(SIZE, 62, 90, fov=55)
    up = texrs.extend(
        look("pebbles", Plane(SIZE, 60, 90, fov=55)), size=(260, 240), view=steep, bottom=10, seed=1
    ).report["added"]
    assert up["top"] < 35 < up["bottom"]
    assert up["top"] + up["bottom"] == 80
    with pytest.raises(InvalidInput, match=r"size: must be at least \(180, 240\) pixels"):
        texrs.extend(look_at_floor(), size=(100, 300), view=PLANE)

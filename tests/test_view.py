"""Views of planes in photographs: errors, conversions, and checks before anything is searched."""

from collections.abc import Callable

import numpy as np
import pytest

import texrs
from texrs import Plane, PlaneView
from texrs._masks import widen
from texrs.errors import InvalidInput
from texrs.planes import choose

SHAPE = (96, 128)
PLANE = Plane(SHAPE, 40, 100, fov=55)
PICTURE = np.zeros((*SHAPE, 3), np.uint8)
MASK = np.zeros(SHAPE, bool)
MASK[40:50, 40:50] = True
CORNERS = PLANE.project([[-20, -30], [-20, 40], [25, 40], [25, -30]])


def test_each_way_to_say_it_settles_the_plane() -> None:
    angles, ground = PlaneView(slant=40, tilt=100, fov=55).settle(SHAPE)
    assert angles == PLANE
    assert ground is None
    corners, _ = PlaneView(corners=CORNERS, fov=55).settle(SHAPE)
    assert corners is not None
    assert corners.slant == pytest.approx(40, abs=1e-6)
    assert corners.tilt == pytest.approx(100, abs=1e-6)
    assert PlaneView(slant=30).settle(SHAPE)[0] == Plane(SHAPE, 30, 90, fov=60)
    assert PlaneView.of(PLANE).settle(SHAPE)[0] == PLANE
    assert PlaneView.of(None).settle(SHAPE) == (None, None)
    plane, ground = PlaneView(fov=50, ground=MASK.astype(np.uint8) * 9).settle(SHAPE)
    assert plane is None
    assert ground is not None
    np.testing.assert_array_equal(ground, MASK)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: PlaneView(corners=CORNERS, plane=PLANE), "corners: cannot be combined with plane"),
        (lambda: PlaneView(plane=40), "plane: must be a texrs.Plane, got 40"),  # type: ignore[arg-type]
        (lambda: PlaneView(tilt=40), "tilt: requires slant"),
        (lambda: PlaneView(plane=PLANE, fov=50), "fov: cannot be combined with plane"),
        (lambda: PlaneView(corners=[[1, 2], [3, 4]]), "corners: must have shape"),
        (lambda: PlaneView(corners=CORNERS[[0, 2, 1, 3]]).settle(SHAPE), "corners: must form a convex quadrilateral"),
        (lambda: PlaneView.of(PLANE).settle((9, 9)), "plane: must have the shape of the image, 9 x 9"),
        (lambda: PlaneView(ground=MASK).settle((9, 9)), "ground: "),
        (lambda: PlaneView(ground=MASK & False).settle(SHAPE), "ground: must mark at least one pixel"),
    ],
)
def test_what_says_nothing_gets_a_sentence(make: Callable[[], object], words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        make()


@pytest.mark.parametrize("verb", [texrs.rectify, lambda p, **o: texrs.extend(p, top=8, **o)])
def test_nothing_is_looked_for_before_all_is_checked(
    verb: Callable[..., object], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(choose, "find_ground", None)
    with pytest.raises(InvalidInput, match="plane: must have the shape"):
        verb(PICTURE, view=Plane((9, 9), 20))


def test_nor_is_it_in_what_is_taken_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(choose, "find_ground", None)
    with pytest.raises(InvalidInput, match="plane: must have the shape"):
        texrs.remove(PICTURE, MASK, view=Plane((9, 9), 20))
    with pytest.raises(InvalidInput, match="corners: must form a convex quadrilateral"):
        texrs.remove(PICTURE, MASK, view=PlaneView(corners=CORNERS[[0, 2, 1, 3]]))


@pytest.mark.parametrize("wrap", [(False, False), (True, False), (False, True), (True, True)])
def test_masks_are_widened_all_around(wrap: tuple[bool, bool]) -> None:
    mask = np.random.default_rng(0).random((23, 31)) < 0.004
    mask[0, 4] = mask[20, 30] = True
    for width in (0, 1, 3, 40):
        expected = np.zeros_like(mask)
        for row, column in np.argwhere(mask):
            away = [np.abs(np.arange(n) - at) for n, at in zip(mask.shape, (row, column), strict=True)]
            away = [np.minimum(a, n - a) if w else a for a, n, w in zip(away, mask.shape, wrap, strict=True)]
            expected |= away[0][:, np.newaxis] ** 2 + away[1] ** 2 <= width**2
        np.testing.assert_array_equal(widen(mask, width, wrap), expected)
    assert not widen(mask & False, 3, wrap).any()

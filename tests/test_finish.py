"""Source maps contain the finish of their images: other maps are finished in the same way."""

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import texrs
from plane_checks import look_at_room
from texrs import Plane, PlaneView, RenderOptions, SourceMap, Synthesis, samples
from texrs.errors import FileError, InvalidInput

PEBBLES = samples.pebbles((64, 80)).image
LIT = (PEBBLES * np.linspace(0.5, 1, 80)[:, np.newaxis]).astype(np.uint8)
HOLE = np.zeros((64, 80), np.bool_)
HOLE[20:40, 30:50] = True
FLOOR = samples.load("tilted_discs", size=(96, 112)).image
WORDS = json.loads(RenderOptions((True, True)).arrays()["finish"].tobytes())


@cache
def room() -> tuple[np.ndarray, np.ndarray, Plane, Plane]:
    return look_at_room((96, 112))


def remove_from_room() -> Synthesis:
    picture, low, lower, upper = room()
    views = [PlaneView(plane=lower, ground=low), PlaneView(plane=upper, ground=~low)]
    return texrs.remove(picture, np.pad(HOLE, ((16, 16), (16, 16))), view=views)


VERBS: dict[str, tuple[Callable[[], Synthesis], np.ndarray | None]] = {
    "design": (lambda: texrs.design(PEBBLES, (72, 64)), PEBBLES),
    "design without blending": (lambda: texrs.design(PEBBLES, 64, screening=None), PEBBLES),
    "design as printed": (lambda: texrs.design(PEBBLES, 64, method="paper"), PEBBLES),
    "tile": (lambda: texrs.tile(PEBBLES), PEBBLES),
    "tile and blend": (lambda: texrs.tile(PEBBLES, screening=0.1), PEBBLES),
    "tile in even light": (lambda: texrs.tile(LIT, flatten_lighting=True), LIT),
    "tile in even light and blend": (lambda: texrs.tile(LIT, flatten_lighting=True, screening=0.1), LIT),
    "inpaint": (lambda: texrs.inpaint(PEBBLES, HOLE), PEBBLES),
    "inpaint and blend": (lambda: texrs.inpaint(PEBBLES, HOLE, screening=0.1), PEBBLES),
    "synthesize": (lambda: texrs.synthesize(PEBBLES, 64), PEBBLES),
    "perspective": (lambda: texrs.perspective(FLOOR, texrs.scale_maps.from_angles((96, 112), 34, 90), 64), FLOOR),
    "rectify": (lambda: texrs.rectify(FLOOR, view=texrs.PlaneView(slant=34, fov=60)), FLOOR),
    "rectify and grow": (lambda: texrs.rectify(FLOOR, size=150, view=texrs.PlaneView(slant=34, fov=60)), FLOOR),
    "extend": (lambda: texrs.extend(FLOOR, right=24, view=texrs.PlaneView(slant=34, fov=60)), FLOOR),
    "remove": (
        lambda: texrs.remove(FLOOR, np.pad(HOLE, ((0, 32), (0, 32))), view=texrs.PlaneView(slant=34, fov=60)),
        FLOOR,
    ),
    "remove from a room": (remove_from_room, None),
    "self-splice": (
        lambda: texrs.self_splice(samples.dots((64, 64)).image, "regularise"),
        samples.dots((64, 64)).image,
    ),
}


@pytest.fixture(scope="module", params=VERBS)
def made(request: pytest.FixtureRequest) -> tuple[Synthesis, np.ndarray]:
    make, image = VERBS[request.param]
    return make(), room()[0] if image is None else image


def test_applying_a_map_does_what_the_verb_did(made: tuple[Synthesis, np.ndarray]) -> None:
    result, image = made
    again = texrs.apply(result.source_map, image)
    assert again.dtype == image.dtype
    assert (again == result.image).all()


def test_a_finish_comes_back_from_a_file(made: tuple[Synthesis, np.ndarray], tmp_path: Path) -> None:
    result, image = made
    result.source_map.save(tmp_path / "map.npz")
    back = SourceMap.load(tmp_path / "map.npz")
    assert (texrs.apply(back, image) == result.image).all()


def test_labels_are_never_mixed() -> None:
    source = texrs.design(PEBBLES, 64).source_map
    labels = (PEBBLES[..., 0] // 64 * 50).astype(np.uint8)
    found = texrs.apply(source, labels, map_type="label")
    assert set(np.unique(found)) <= set(np.unique(labels))
    with pytest.raises(InvalidInput, match="map_type: must be one of colour, normal, vector, label"):
        texrs.apply(source, labels, map_type="labels")  # type: ignore[arg-type]


def test_labels_are_designed_as_labels() -> None:
    labels = (PEBBLES[..., 0] // 64 * 50).astype(np.uint8)
    result = texrs.design(labels, (72, 64), seed=1)
    assert set(np.unique(result.image)) <= set(np.unique(labels))
    assert (texrs.apply(result.source_map, labels) == result.image).all()


def test_another_finish_may_be_asked_for() -> None:
    source = texrs.design(PEBBLES, 64).source_map
    plain = texrs.apply(source, PEBBLES, finish=RenderOptions((True, True)))
    assert (plain == source.render(PEBBLES)).all()
    assert (plain != texrs.apply(source, PEBBLES)).any()
    # A map created from arrays has no finish, and is only looked up.
    bare = SourceMap(source.coordinates, source.exemplar, source.label, source.jacobian, source.shapes)
    assert (texrs.apply(bare, PEBBLES) == plain).all()


@pytest.mark.parametrize(
    "change",
    [
        {"finish": np.zeros(3, np.uint8)},
        {"finish": np.frombuffer(b"{}", np.uint8)},
        {"finish/within": np.zeros((3, 3), np.bool_)},
        {"finish": np.frombuffer(json.dumps({**WORDS, "light": 3}).encode(), np.uint8)},
        {"finish/parts": np.zeros((3, 3), np.uint16)},
        {"finish/known/0": np.zeros((3, 3), np.bool_)},
    ],
    ids=["no text", "other words", "another hole", "no place of light", "other parts", "another example"],
)
def test_a_damaged_finish_is_said(change: dict[str, np.ndarray], tmp_path: Path) -> None:
    texrs.inpaint(PEBBLES, HOLE, screening=0.1).source_map.save(tmp_path / "map.npz")
    with np.load(tmp_path / "map.npz") as file:
        parts = {**file, **change}
    np.savez(tmp_path / "map.npz", **parts)
    with pytest.raises(FileError, match="is damaged"):
        SourceMap.load(tmp_path / "map.npz")

"""Data for workers are small when pickled, and give the same bytes in every process."""

import copy
import hashlib
import multiprocessing
import pickle
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import cloudpickle
import numpy as np
import pytest

import texrs
from texrs import fields, samples
from texrs.papers.solid import unbounded

WEAVE = samples.weave((48, 64)).image
STRIPES = samples.stripes((32, 32, 32)).image[:24, :24, :24]
TURNED = fields.circular(centre=(-30, 10), axes=2)
MATERIAL = {"albedo": WEAVE, "height": WEAVE[..., 1].astype(np.float32) / 255, "labels": WEAVE[..., 0] > 99}


def digest(array: np.ndarray) -> str:
    return hashlib.sha256(repr((array.shape, array.dtype)).encode() + array.tobytes()).hexdigest()


def used() -> texrs.Exemplar:
    """Return an exemplar with many cached facts."""
    exemplar = texrs.Exemplar(WEAVE, repeat=(False, True))
    exemplar.analyse()
    exemplar.segment()
    assert exemplar.stitcher
    assert exemplar.anisotropy > 0
    return exemplar


THINGS: dict[str, Callable[[], Any]] = {
    "exemplar": used,
    "volume": lambda: texrs.Exemplar(STRIPES, axes=3, labels=False),
    "plane": lambda: texrs.PlaneTexture(used(), seed=3, interpolation="linear"),
    "plane with a field": lambda: texrs.PlaneTexture(WEAVE, seed=3, field=TURNED),
    "fast plane": lambda: texrs.PlaneTexture(WEAVE, seed=3, quality="fast", cache_bytes=0),
    "solid": lambda: texrs.SolidTexture(STRIPES, seed=1, memory_limit=1 << 30),
    "solid with a field": lambda: texrs.SolidTexture(STRIPES, field=fields.circular(axis="x", centre=(5, 5, 5))),
    "material": lambda: texrs.PlaneTexture(texrs.Material(MATERIAL), seed=1),
}
TEXTURES = [name for name in THINGS if name not in ("exemplar", "volume")]


def show(thing: Any) -> list[str]:
    """Return digests of an object's results."""
    if isinstance(thing, texrs.Exemplar):
        found = thing.analyse().arrays()
        return [digest(found[name]) for name in sorted(found)] + [repr((thing.labels, thing.repeat))]
    made = thing.window((-9, 30, 4)[-thing.axes :], (20, 14, 11)[-thing.axes :])
    maps = [] if made.material is None else [each.pixels for each in made.material.values()]
    return [digest(array) for array in (made.image, made.source_map.coordinates, made.source_map.jacobians(), *maps)]


@pytest.mark.parametrize("name", THINGS)
@pytest.mark.parametrize("how", [pickle, cloudpickle], ids=["pickle", "cloudpickle"])
def test_it_travels_small_and_is_the_same(name: str, how: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    thing = THINGS[name]()
    wanted = show(thing)
    sent = how.dumps(thing)
    image = thing.image if isinstance(thing, texrs.Exemplar) else thing.exemplar.image
    pixels = image.nbytes if name != "material" else sum(a.nbytes for a in MATERIAL.values())
    assert len(sent) < pixels + 2000
    unbounded._ARRIVED.clear()
    back = pickle.loads(sent)
    assert back is not thing
    assert back.key == thing.key
    assert show(back) == wanted
    assert show(copy.deepcopy(back)) == wanted


def test_small_facts_travel_and_large_ones_do_not() -> None:
    there = used()
    back = pickle.loads(pickle.dumps(there))
    assert back._facts["anisotropy"] == there.anisotropy
    assert not any(isinstance(fact, tuple) and fact[0] == "analysis" for fact in back._facts)


def test_options_travel() -> None:
    plane = texrs.PlaneTexture(texrs.Exemplar(WEAVE, labels=False, repeat=True), seed=7, quality="optimise")
    back = pickle.loads(pickle.dumps(plane))
    assert repr(back) == repr(plane)
    assert back.exemplar.repeat == (True, True)
    assert (back._quality, back._seed, back._how, back._cache_bytes) == ("optimise", 7, "cubic", 256 << 20)


def test_what_arrives_again_is_what_arrived_before() -> None:
    """This lets parts that are sent one by one share the texture's cache."""
    sent = pickle.dumps(texrs.PlaneTexture(WEAVE, seed=12))
    first = pickle.loads(sent)
    first[0:8, 0:8]
    assert pickle.loads(sent) is first
    assert pickle.loads(pickle.dumps(texrs.PlaneTexture(WEAVE, seed=13))) is not first
    assert pickle.loads(pickle.dumps(texrs.PlaneTexture(WEAVE, seed=12, cache_bytes=0))) is not first


def swell(points: np.ndarray) -> np.ndarray:
    return (1 + 0.2 * np.cos(points[:, 0] / 20))[:, None, None] * np.eye(2)


def test_fields_that_call_functions_travel_too() -> None:
    plane = texrs.PlaneTexture(WEAVE, field=fields.from_function(swell, 2))
    assert plane.key is None
    assert show(pickle.loads(pickle.dumps(plane))) == show(plane)
    local = texrs.PlaneTexture(WEAVE, field=fields.from_function(lambda p: swell(p), 2))
    assert show(pickle.loads(cloudpickle.dumps(local))) == show(plane)


@pytest.mark.parametrize("method", ["fork", "spawn"])
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_workers_make_the_same(method: str) -> None:
    if method not in multiprocessing.get_all_start_methods():
        pytest.skip("not on this system")
    things = [THINGS[name]() for name in ("plane with a field", "fast plane", "solid", "material")]
    # Compute here first, so that the thread pool exists when workers are forked.
    wanted = [show(thing) for thing in things]
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context(method)) as pool:
        assert list(pool.map(show, things)) == wanted


def test_keys_tell_textures_apart() -> None:
    made = [
        texrs.PlaneTexture(WEAVE),
        texrs.PlaneTexture(WEAVE, seed=1),
        texrs.PlaneTexture(WEAVE[:-1]),
        texrs.PlaneTexture(WEAVE, field=TURNED),
        texrs.PlaneTexture(WEAVE, quality="fast"),
        texrs.PlaneTexture(WEAVE, interpolation="nearest"),
        texrs.PlaneTexture(texrs.Material({"albedo": WEAVE})),
        texrs.PlaneTexture(texrs.Material({"emission": WEAVE})),
    ]
    assert len({texture.key for texture in made}) == len(made)


def test_results_travel(tmp_path: Path) -> None:
    dots = samples.dots((96, 96)).image
    made = texrs.synthesize(WEAVE, 48, field=TURNED)
    back = pickle.loads(pickle.dumps(made))
    assert np.array_equal(back.source_map.render(WEAVE), made.stages["before_blending"])
    assert np.array_equal(back.source_map.jacobians(), made.source_map.jacobians())
    assert repr(back.source_map.finish) == repr(made.source_map.finish)
    elements = texrs.elements.analyse(dots)
    again = pickle.loads(pickle.dumps(elements))
    assert np.array_equal(texrs.self_splice(again).image, texrs.self_splice(elements).image)
    database = texrs.TextureDatabase(tmp_path)
    database.add(dots, "dots")
    there = pickle.loads(pickle.dumps(database))
    assert list(there) == ["dots"]
    assert np.array_equal(there["dots"].image, database["dots"].image)


# --- any points ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", TEXTURES)
def test_points_are_pixels_of_windows(name: str) -> None:
    texture = THINGS[name]()
    rng = np.random.default_rng(4)
    points = rng.integers(-20, 20, (40, 2)) if texture.axes == 2 else rng.integers(2, 9, (40, 3))
    found = texture.sample(points)
    low = points.min(axis=0)
    image = texture.window(low.tolist(), (np.ptp(points, axis=0) + 1).tolist()).image
    assert found.dtype == image.dtype
    assert np.array_equal(found, image[tuple((points - low).T)])
    assert np.array_equal(texture.sample(points.reshape(4, 10, -1)), found.reshape(4, 10, *found.shape[1:]))


def test_points_between_pixels_carry_places_on() -> None:
    ramp = np.add.outer(np.arange(32.0), 100 * np.arange(40.0)).astype(np.float32)
    plane = texrs.PlaneTexture(texrs.Exemplar(ramp, labels=False, repeat=False), seed=5, interpolation="linear")
    points = np.random.default_rng(0).uniform(-50, 50, (200, 2))
    voxel = np.floor(points + 0.5)
    at = plane.window((-52, -52), 104).source_map.coordinates[tuple((voxel + 52).astype(int).T)]
    inside = ((at > 1) & (at < (30, 38))).all(axis=1)
    wanted = plane.sample(voxel) + (points - voxel) @ [1, 100]
    assert inside.sum() > 100
    assert np.allclose(plane.sample(points)[inside], wanted[inside], atol=0.02)
    nearest = plane.sample(points, interpolation="nearest")
    assert set(nearest.tolist()) <= set(ramp.reshape(-1).tolist())


def test_labels_are_never_mixed() -> None:
    labels = (WEAVE[..., 0] > 120).astype(np.uint8) * 7
    points = np.random.default_rng(0).uniform(-50, 50, (300, 2))
    plane = texrs.PlaneTexture(labels)
    assert set(plane.sample(points, interpolation="cubic").tolist()) == {0, 7}
    every = texrs.PlaneTexture(texrs.Material(MATERIAL)).sample_maps(points, interpolation="cubic")
    assert every["labels"].dtype == np.bool_
    assert {name: values.shape for name, values in every.items()} == {
        "albedo": (300, 3),
        "height": (300,),
        "labels": (300,),
    }


def test_normals_of_points_turn_with_the_texture() -> None:
    normals = np.zeros((32, 32, 3), np.float32)
    normals[..., 0], normals[..., 2] = 0.6, 0.8
    normals[0, 0] = (-0.6, 0, 0.8)  # Signed.
    turned = texrs.PlaneTexture(
        texrs.Material({"normal": normals, "albedo": WEAVE[:32, :32]}), field=fields.rotation(90, axes=2)
    )
    every = turned.sample_maps([[3.25, 4.5], [10, 10]])["normal"]
    window = turned.window((10, 10), 1).material
    assert window is not None
    assert np.allclose(np.abs(every), [0, 0.6, 0.8], atol=1e-5)
    assert np.array_equal(window["normal"].pixels[0, 0], every[1])


def test_far_and_wrong_points() -> None:
    plane = texrs.PlaneTexture(WEAVE, seed=1)
    far = np.array([[10.0**9 - 5, -(10.0**9)], [0, 0]])
    assert plane.sample(far).shape == (2, 3)
    assert plane.sample(np.zeros((0, 2))).shape == (0, 3)
    for points, message in (
        ([[1, 2, 3]], r"points: must be numbers of shape \(\.\.\., 2\)"),
        ([[np.nan, 0]], "points: must be finite, but 1 of 2 values are NaN"),
        ([[2e9, 0]], "points: coordinates must be from -1000000000"),
    ):
        with pytest.raises(texrs.errors.InvalidInput, match=message):
            plane.sample(points)
    with pytest.raises(texrs.errors.InvalidInput, match="interpolation"):
        plane.sample([[0, 0]], interpolation="bicubic")  # type: ignore[arg-type]
    with pytest.raises(texrs.errors.InvalidInput, match="must be created from a Material"):
        plane.sample_maps([[0, 0]])

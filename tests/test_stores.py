"""Several processes: Dask, Zarr, killed workers, continued stores."""

import errno
import hashlib
import json
import os
import shutil
import subprocess
import warnings
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import texrs
from stores_work import WEAVE, die, end, end_slowly, kill_once, outer, vary
from texrs import fields, samples, stores
from texrs._chunks import store as zarr_store
from texrs._chunks import workers
from texrs._chunks.grid import Grid
from texrs._chunks.pyramid import count_levels, halve_block
from texrs.errors import FileError, InvalidInput

pytest.importorskip("dask")
zarr = pytest.importorskip("zarr")
import dask  # noqa: E402
from distributed import Client, LocalCluster  # noqa: E402

STRIPES = samples.stripes((32, 32, 32)).image[:24, :24, :24]
MATERIAL = {"albedo": WEAVE, "height": WEAVE[..., 1].astype(np.float32) / 255, "labels": WEAVE[..., 0] > 99}
PLANE = texrs.PlaneTexture(WEAVE, seed=3, field=fields.circular(centre=(-30, 10), axes=2))


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 3}),
        LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster,
        Client(cluster, set_as_default=False) as made,
    ):
        yield made


def digest(path: Path) -> dict[str, str]:
    """Return digests of all stored values, by array."""
    found: dict[str, str] = {}

    def walk(group: Any) -> None:
        for _, array in group.arrays():
            values = array[:]
            found[array.path] = hashlib.sha256(
                repr((values.shape, values.dtype)).encode() + values.tobytes()
            ).hexdigest()
        for _, inner in group.groups():
            walk(inner)

    walk(zarr.open_group(path, mode="r"))
    return found


# --- Dask ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("how", ["synchronous", "threads"])
def test_blocks_are_windows(how: str) -> None:
    made = PLANE.to_dask((90, 70), (40, 64), origin=(-20, 5))
    assert made.chunks == ((40, 40, 10), (64, 6), (3,))
    assert made.dtype == np.uint8
    assert np.array_equal(made.compute(scheduler=how), PLANE[-20:70, 5:75])
    assert np.array_equal(made[7:50, 60:66].compute(scheduler=how), PLANE[-13:30, 65:71])


def test_the_texture_is_one_key_of_the_graph_and_the_names_tell_parts_apart() -> None:
    with pytest.raises(InvalidInput, match="must divide the texture into at most 1048576 blocks"):
        PLANE.to_dask(10_000_000, 512)
    few = PLANE.to_dask(200, 64)
    assert len(few.__dask_graph__()) == 16 + 1
    assert few.name == PLANE.to_dask(200, 64).name
    others = [PLANE.to_dask(200, 32), PLANE.to_dask(200, 64, origin=1), texrs.PlaneTexture(WEAVE).to_dask(200, 64)]
    assert len({few.name, *(other.name for other in others)}) == 4


def test_volumes_and_maps_of_materials() -> None:
    solid = texrs.SolidTexture(STRIPES, seed=1)
    assert np.array_equal(solid.to_dask((20, 30, 10), 20).compute(scheduler="synchronous"), solid[0:20, 0:30, 0:10])
    stones = texrs.PlaneTexture(texrs.Material(MATERIAL), seed=1)
    wanted = stones.window((5, 6), (50, 40)).material
    assert wanted is not None
    for name in MATERIAL:
        made = stones.to_dask((50, 40), 32, origin=(5, 6), map=name)
        assert np.array_equal(made.compute(scheduler="synchronous"), wanted[name].pixels)
    assert np.array_equal(stones.to_dask((50, 40), 32, origin=(5, 6)).compute(), wanted["albedo"].pixels)
    with pytest.raises(InvalidInput, match="map: must be one of .* got 'normal'"):
        stones.to_dask(8, map="normal")


def test_a_cluster_makes_the_same(client: Client) -> None:
    made = PLANE.to_dask((90, 70), 40)
    assert np.array_equal(client.compute(made).result(), PLANE[0:90, 0:70])


def test_source_maps_are_looked_up_lazily() -> None:
    made = texrs.synthesize(WEAVE, (70, 90), field=fields.circular(axes=2), seed=1)
    other = WEAVE.astype(np.float32) / 7
    found = made.source_map.to_dask(other, 32)
    assert found.shape == (70, 90, 3)
    assert np.array_equal(found.compute(scheduler="threads"), made.source_map.render(other))
    normals = np.zeros((*WEAVE.shape[:2], 3), np.float32)
    normals[..., 0], normals[..., 2] = -0.6, 0.8
    turned = made.source_map.to_dask(normals, (32, 64), map_type="normal", interpolation="nearest")
    assert np.array_equal(turned.compute(), made.source_map.render(normals, map_type="normal", interpolation="nearest"))
    plain = texrs.design(WEAVE, 96, seed=2)
    assert np.array_equal(plain.source_map.to_dask(WEAVE, 50).compute(), plain.stages["before_blending"])
    with pytest.raises(InvalidInput, match="exemplars: exemplar 0 must have size"):
        made.source_map.to_dask(WEAVE[:-1])


@pytest.mark.parametrize("scheduler", [None, 2])
def test_source_maps_are_looked_up_into_a_store(tmp_path: Path, scheduler: int | None) -> None:
    made = texrs.synthesize(WEAVE, (70, 90), field=fields.circular(axes=2), seed=1)
    other = WEAVE.astype(np.float32) / 7
    each: list[dict[str, Any]] = [{}, {"antialias": True}, {"interpolation": "nearest"}]
    for options in each[1:2] if scheduler else each:
        store = tmp_path / f"{len(options)}{'nearest' in options.values()}.zarr"
        done = made.source_map.to_zarr(store, other, 32, scheduler=scheduler, **options)
        assert (done.shape, done.made) == ((70, 90, 3), done.chunks)
        assert np.array_equal(texrs.io.read(store), made.source_map.render(other, **options))
        assert made.source_map.to_zarr(store, other, 32, **options).made == 0
    with pytest.raises(FileError, match="contains other data"):
        made.source_map.to_zarr(store, other + 1, 32)
    solid = texrs.solid(STRIPES, 32, seed=1)
    solid.source_map.to_zarr(tmp_path / "solid.zarr", STRIPES, 20, levels=1, spacing=(2, 1, 1))
    assert np.array_equal(texrs.io.read_volume(tmp_path / "solid.zarr"), solid.image)


# --- Zarr ------------------------------------------------------------------------------------------------------------


def test_a_store_holds_the_windows_and_their_levels(tmp_path: Path) -> None:
    done = PLANE.to_zarr(tmp_path / "a.zarr", (90, 70), 32, origin=(-20, 5), spacing=(0.5, 0.25), unit="micrometer")
    assert (done.shape, done.chunks, done.made) == ((90, 70, 3), 9 + 4 + 1, 14)
    assert np.array_equal(stores.open_store(done.path).compute(), PLANE[-20:70, 5:75])
    half = stores.open_store(done.path, level=1).compute()
    assert half.shape == (45, 35, 3)
    whole = PLANE[-20:70, 5:75].astype(int)
    mean = (whole[::2, ::2] + whole[1::2, ::2] + whole[::2, 1::2] + whole[1::2, 1::2] + 2) // 4
    assert np.array_equal(half, mean)
    said = zarr.open_group(done.path, mode="r").attrs["ome"]
    scale = said["multiscales"][0]
    assert said["version"] == "0.5"
    assert [axis["name"] for axis in scale["axes"]] == ["c", "y", "x"]
    assert [each["path"] for each in scale["datasets"]] == ["0", "1", "2"]
    second = scale["datasets"][1]["coordinateTransformations"]
    assert second[0] == {"type": "scale", "scale": [1.0, 1.0, 0.5]}
    assert second[1] == {"type": "translation", "translation": [0.0, -9.75, 1.375]}
    assert scale["axes"][1]["unit"] == "micrometer"


def test_materials_are_a_group_each_and_classes_are_not_mixed(tmp_path: Path) -> None:
    stones = texrs.PlaneTexture(texrs.Material(MATERIAL), seed=1)
    done = stones.to_zarr(tmp_path / "m.zarr", 40, 32)
    wanted = stones.window(0, 40).material
    assert wanted is not None
    for name in MATERIAL:
        assert np.array_equal(stores.open_store(done.path, name).compute(), wanted[name].pixels)
    assert stores.open_store(done.path, "labels", level=1).dtype == np.bool_
    with pytest.raises(InvalidInput, match="name: must be given because .* contains albedo, height, labels"):
        stores.open_store(done.path)
    with pytest.raises(FileError, match="does not contain 'gloss'"):
        stores.open_store(done.path, "gloss")


def test_chunks_that_follow_each_other_lie_together() -> None:
    grid = Grid.of((100, 300, 260), 64, 3)
    order = grid.sort(range(len(grid)))
    assert sorted(order) == list(range(len(grid)))
    assert [grid.index(n) for n in order[:4]] == [(0, 0, 0), (0, 0, 1), (0, 1, 0), (0, 1, 1)]
    assert grid.sort([7, 3, 40]) == [n for n in order if n in (3, 7, 40)]
    assert Grid.of((9, 2**30), (9, 1)).sort([2**29, 5]) == [5, 2**29]
    assert grid.sort([]) == []


def test_levels_of_odd_sizes_and_of_classes() -> None:
    assert count_levels(Grid.of((100, 300), 128)) == 3
    rng = np.random.default_rng(0)
    block = rng.integers(0, 3, (5, 6, 7)).astype(np.uint8)
    voted = halve_block(block, 3, labelled=True)
    for at in np.ndindex(voted.shape):
        part = block[tuple(slice(2 * i, 2 * i + 2) for i in at)]
        # A block at an odd end is smaller, so its values count twice.
        repeat = [2 // n for n in part.shape]
        votes = np.bincount(np.tile(part, repeat).reshape(-1), minlength=3)
        assert voted[at] == votes.argmax()
    values = rng.random((4, 6, 2)).astype(np.float32)
    mean = halve_block(values, 2, labelled=False)
    assert np.allclose(mean, values.reshape(2, 2, 3, 2, 2).mean(axis=(1, 3)))
    assert mean.dtype == np.float32


@pytest.mark.parametrize("how", ["processes", "cluster"])
def test_workers_store_the_same(how: str, tmp_path: Path, client: Client) -> None:
    PLANE.to_zarr(tmp_path / "a.zarr", (90, 70), 32)
    heard: list[tuple[str, float]] = []
    done = PLANE.to_zarr(
        tmp_path / "b.zarr",
        (90, 70),
        32,
        scheduler=2 if how == "processes" else client.scheduler.address,
        progress=lambda *told: heard.append(told),
    )
    assert done.made == done.chunks
    assert digest(tmp_path / "a.zarr") == digest(tmp_path / "b.zarr")
    assert heard[-1][1] == 1.0
    assert [share for _, share in heard] == sorted(share for _, share in heard)


def test_what_is_there_is_not_made_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Stop(Exception):
        pass

    def stop(stage: str, share: float) -> None:
        if share > 0.4:
            raise Stop

    with pytest.raises(Stop):
        PLANE.to_zarr(tmp_path / "a.zarr", 100, 32, progress=stop)
    done = PLANE.to_zarr(tmp_path / "a.zarr", 100, 32)
    assert 0 < done.made < done.chunks
    assert PLANE.to_zarr(tmp_path / "a.zarr", 100, 32).made == 0
    (tmp_path / "a.zarr" / "0" / "c" / "0" / "1" / "2").unlink()
    assert PLANE.to_zarr(tmp_path / "a.zarr", 100, 32).made == 1
    PLANE.to_zarr(tmp_path / "b.zarr", 100, 32)
    assert digest(tmp_path / "a.zarr") == digest(tmp_path / "b.zarr")


def test_several_make_one_store(tmp_path: Path) -> None:
    def make(number: int) -> tuple[int, int]:
        path = tmp_path / f"{number // 6}.zarr"
        group = zarr_store.open_group(path, {"of": "a"}, {}, overwrite=False)
        inner = zarr_store._make_group(group, "height")
        return zarr_store.make_array(inner, "0", (4, 4), (2, 2), np.dtype("u1")).shape

    with ThreadPoolExecutor(6) as pool:
        assert set(pool.map(make, range(120))) == {(4, 4)}


def test_another_thing_is_not_written_over(tmp_path: Path) -> None:
    PLANE.to_zarr(tmp_path / "a.zarr", 40, 32)
    before = digest(tmp_path / "a.zarr")
    other = texrs.PlaneTexture(WEAVE, seed=9)
    for made in (
        lambda: other.to_zarr(tmp_path / "a.zarr", 40, 32),
        lambda: PLANE.to_zarr(tmp_path / "a.zarr", 40, 20),
        lambda: PLANE.to_zarr(tmp_path / "a.zarr", 40, 32, origin=1),
    ):
        with pytest.raises(FileError, match="overwrite=True"):
            made()
    assert digest(tmp_path / "a.zarr") == before
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("dear")
    with pytest.raises(FileError, match="is not a Zarr store"):
        PLANE.to_zarr(tmp_path / "mine", 40, 32)
    assert other.to_zarr(tmp_path / "a.zarr", 40, 32, overwrite=True).made == 5
    assert digest(tmp_path / "a.zarr") != before


def test_a_full_disk_leaves_no_half_chunk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    writes = 0
    plain = zarr_store._write

    def fill(store: str, place: str, *rest: Any) -> None:
        nonlocal writes
        writes += 1
        if writes == 3:
            # Cut the file off in the middle, as a full disk does.
            import zarr.storage._local as local

            with pytest.MonkeyPatch.context() as patch:
                patch.setattr(local, "_put", _full)
                plain(store, place, *rest)
        plain(store, place, *rest)

    monkeypatch.setattr(zarr_store, "_write", fill)
    with pytest.raises(FileError, match="No space left"):
        PLANE.to_zarr(tmp_path / "a.zarr", 100, 32)
    monkeypatch.setattr(zarr_store, "_write", plain)
    assert PLANE.to_zarr(tmp_path / "a.zarr", 100, 32).made == 21 - 2
    PLANE.to_zarr(tmp_path / "b.zarr", 100, 32)
    assert digest(tmp_path / "a.zarr") == digest(tmp_path / "b.zarr")


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """Create a disk of 160 kB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    if shutil.which("mount") is None or subprocess.run([*_mount("size=160k"), folder], capture_output=True).returncode:
        pytest.skip("a disk of its own is mounted by the administrator alone")
    yield folder
    subprocess.run(["umount", "--lazy", folder], check=True)


def _mount(options: str) -> list[str]:
    return ["mount", "-t", "tmpfs", "-o", options, "tmpfs"]


@pytest.mark.parametrize("how", [None, 2])
def test_a_disk_that_was_full_is_gone_on_with(how: int | None, tmp_path: Path, small_disk: Path) -> None:
    with pytest.raises(FileError, match="No space left"):
        PLANE.to_zarr(small_disk / "a.zarr", 256, 32, levels=1, scheduler=how)
    there = len(list((small_disk / "a.zarr" / "0" / "c").rglob("*")))
    assert there > 9
    with pytest.raises(FileError, match=r"too little space for 0.00 GiB; nothing was written"):
        PLANE.to_file(small_disk / "a.npy", 256, 32, scheduler=how)
    subprocess.run([*_mount("remount,size=4m"), small_disk], check=True)
    made = PLANE.to_zarr(small_disk / "a.zarr", 256, 32, levels=1, scheduler=how).made
    assert 0 < made < 64
    PLANE.to_zarr(tmp_path / "b.zarr", 256, 32, levels=1)
    assert digest(small_disk / "a.zarr") == digest(tmp_path / "b.zarr")


def _full(*given: Any, **more: Any) -> int:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.parametrize("how", ["processes", "cluster"])
def test_a_worker_is_killed_and_the_store_is_complete(
    how: str, tmp_path: Path, client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    wanted = texrs.PlaneTexture(WEAVE, seed=3, field=fields.from_function(partial(kill_once, tmp_path / "no"), 2))
    wanted.to_zarr(tmp_path / "a.zarr", 100, 32)
    assert (tmp_path / "no").exists()
    dying = texrs.PlaneTexture(WEAVE, seed=3, field=fields.from_function(partial(kill_once, tmp_path / "mark"), 2))
    monkeypatch.setenv("TEXRS_TEST_MAY_DIE", "1")
    if how == "cluster":
        client.run(os.environ.update, {"TEXRS_TEST_MAY_DIE": "1"})
    done = dying.to_zarr(tmp_path / "b.zarr", 100, 32, scheduler=2 if how == "processes" else client)
    assert (tmp_path / "mark").exists()
    assert done.made == done.chunks
    assert digest(tmp_path / "a.zarr") == digest(tmp_path / "b.zarr")


# --- results of any function -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("how", [None, 2, "cluster"])
def test_each_item_is_computed_once(how: Any, tmp_path: Path, client: Client) -> None:
    log = tmp_path / "log"
    items = [(seed, log) for seed in range(12)]
    scheduler = client if how == "cluster" else how
    done = stores.map_to_zarr(vary, items, tmp_path / "v.zarr", scheduler=scheduler)
    assert (done.made, done.chunks, done.shape) == (12, 12, (12,))
    assert sorted(map(int, log.read_text().split())) == list(range(12))
    found = stores.open_store(done.path)
    assert found.chunks == ((1,) * 12, (32,), (32,), (3,))
    assert np.array_equal(found.compute(), np.stack([vary(seed).image for seed in range(12)]))
    (Path(done.path) / "image" / "c" / "5" / "0" / "0" / "0").unlink()
    assert stores.map_to_zarr(vary, items, tmp_path / "v.zarr", scheduler=scheduler).made == 1
    assert log.read_text().split().count("5") == 2


def test_a_matrix_of_several_maps_and_one_that_fails(tmp_path: Path) -> None:
    items = [(row, column) for row in range(3) for column in range(2)]
    with pytest.raises(stores.Failed, match=r"items: 1 failed: 3 \(ValueError: not this one\)") as caught:
        stores.map_to_zarr(outer, items, tmp_path / "m.zarr", shape=(3, 2), scheduler=2)
    assert list(caught.value.reasons) == [3]
    sums = stores.open_store(tmp_path / "m.zarr", "sum").compute()[..., 0]
    assert np.array_equal(sums, [[0, 1], [1, 0], [2, 3]])
    assert stores.open_store(tmp_path / "m.zarr", "rows").shape == (3, 2, 2, 3)
    with pytest.raises(stores.Failed, match="items: 1 failed"):
        stores.map_to_zarr(outer, items, tmp_path / "m.zarr", shape=(3, 2))


def test_results_of_other_shapes_are_named(tmp_path: Path) -> None:
    with pytest.raises(stores.Failed, match=r"2 \(function: must return float64 arrays of shape \(2,\) for all items"):
        stores.map_to_zarr(np.zeros, [2, 2, 3], tmp_path / "m.zarr")
    with pytest.raises(FileError, match="contains other data"):
        stores.map_to_zarr(np.zeros, [2, 2], tmp_path / "m.zarr")
    # A lambda is sent to the workers by cloudpickle.
    stores.map_to_zarr(lambda n: np.full(2, n), [1, 2], tmp_path / "l.zarr", scheduler=2)
    assert stores.open_store(tmp_path / "l.zarr").compute().tolist() == [[1, 1], [2, 2]]


def test_what_always_ends_its_worker_is_said(tmp_path: Path) -> None:
    with pytest.raises(stores.WorkerLost, match="ended without a result 3 times"):
        stores.map_to_zarr(die, range(5), tmp_path / "d.zarr", scheduler=2)


def test_what_ends_its_worker_stops_no_other_where_that_is_asked_for() -> None:
    """Tasks that wait at a worker that ends are not to blame, however often this happens."""
    found = dict(workers.run(end, range(8), 1, spare=True))
    assert {n: r for n, r in found.items() if n not in (2, 5)} == {n: n * n for n in range(8) if n not in (2, 5)}
    assert all(isinstance(found[n], stores.WorkerLost) for n in (2, 5))
    assert "task 2: the worker process ended without a result 3 times" in str(found[2])


def test_a_worker_that_is_to_stop_raises_only_in_its_task(monkeypatch: pytest.MonkeyPatch) -> None:
    """Elsewhere the pool would report an exception, for example at its start."""
    left: list[int] = []
    monkeypatch.setattr(os, "_exit", left.append)
    monkeypatch.setattr(workers, "_LEAVING", True)
    workers._leave(15, None)
    assert left == [1]
    monkeypatch.setattr(workers, "_LEAVING", False)
    monkeypatch.setattr(workers, "_WORK", lambda number: workers._leave(number, None))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(SystemExit):
            workers._do(15)
        warnings.warn(
            "a coroutine was never awaited", RuntimeWarning, stacklevel=1
        )  # It would be reported, although nobody asked.
    assert left == [1]
    assert not workers._BUSY


def test_a_cluster_blames_no_task_that_waits_behind_the_one_that_ends_its_worker() -> None:
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 1}),
        LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=":0") as cluster,
        Client(cluster, set_as_default=False) as alone,
    ):
        found = dict(workers.run(end_slowly, range(4), alone, spare=True))
    assert {n: r for n, r in found.items() if n} == {n: n * n for n in range(1, 4)}
    assert isinstance(found[0], stores.WorkerLost)


@pytest.mark.parametrize("error", [AssertionError(), OSError("timed out"), ValueError("no port")])
def test_a_scheduler_that_does_not_answer_is_named(error: Exception, monkeypatch: pytest.MonkeyPatch) -> None:
    class Deaf(Client):
        def __init__(self, *_: object, **__: object) -> None:
            raise error

        def __del__(self) -> None:
            """Do nothing, because nothing began."""

    monkeypatch.setattr("distributed.Client", Deaf)
    with pytest.raises(
        texrs.errors.InvalidInput, match="scheduler: no scheduler answers at '-5' \\((Asser|timed|no port)"
    ):
        list(workers.run(read_limits, [0], "-5"))


def read_limits(number: int) -> texrs.limits.Limits:
    """Return the limits in force in a worker."""
    return texrs.limits.current()


@pytest.mark.parametrize("scheduler", [None, 1, "cluster"])
def test_workers_go_by_the_limits_of_who_asks(scheduler: int | str | None, request: pytest.FixtureRequest) -> None:
    where = request.getfixturevalue("client") if scheduler == "cluster" else scheduler
    with texrs.limits.context(pixels=1000, voxels=2000, memory=3e8, seconds=60):
        ((_, found),) = workers.run(read_limits, [0], where)
    assert (found.pixels, found.voxels, found.memory) == (1000, 2000, 3 * 10**8)
    # Work outside the block does not have these limits.
    ((_, found),) = workers.run(read_limits, [0], where)
    assert (found.pixels, found.voxels) == (2**28, 2**28)


def test_wrong_arguments(tmp_path: Path) -> None:
    for call, message in (
        (lambda: PLANE.to_zarr(tmp_path / "x.zarr", (0, 4)), "shape: must be an integer or 2"),
        (lambda: PLANE.to_zarr(tmp_path / "x.zarr", 40, (4, 4, 4)), "chunks: must be an integer or 2"),
        (lambda: PLANE.to_zarr(tmp_path / "x.zarr", 40, levels=0), "levels"),
        (lambda: PLANE.to_zarr(tmp_path / "x.zarr", 40, origin=10**9), "origin, shape: the window must end"),
        (lambda: PLANE.to_zarr(tmp_path / "x.zarr", 40, scheduler=1.5), "scheduler: must be None"),
        (lambda: PLANE.to_zarr(tmp_path / "y.zarr", 40, scheduler=0), "scheduler: must be an integer"),
        (lambda: PLANE.to_dask(2**41), "shape"),
        (lambda: stores.map_to_zarr(7, [1], tmp_path / "x.zarr"), "function: must be"),  # type: ignore[arg-type]
        (lambda: stores.map_to_zarr(np.zeros, [], tmp_path / "x.zarr"), "items: must have at least one entry"),
        (
            lambda: stores.map_to_zarr(np.zeros, [1, 2], tmp_path / "x.zarr", shape=(2, 2)),
            "shape: must have a product of 2",
        ),
    ):
        with pytest.raises(InvalidInput, match=message):
            call()
    with pytest.raises(FileError, match="is not a Zarr store"):
        stores.open_store(tmp_path / "none.zarr")


def test_the_metadata_are_json_that_others_read(tmp_path: Path) -> None:
    PLANE.to_zarr(tmp_path / "a.zarr", 40, 32)
    said = json.loads((tmp_path / "a.zarr" / "zarr.json").read_text())
    assert said["zarr_format"] == 3
    assert said["attributes"]["texrs"]["of"]
    assert said["attributes"]["ome"]["omero"]["channels"][0]["color"] == "FF0000"

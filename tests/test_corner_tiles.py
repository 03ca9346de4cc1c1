"""Unbounded designs: corner tiles."""

import pickle
from pathlib import Path

import numpy as np
import pytest

import texrs
from texrs import io, samples
from texrs.corner_tiles._corners import COLOURS, TILES, TORUS, draw_colours, number_tiles
from texrs.corner_tiles._lattice_step import Draw, choose_side, find_step
from texrs.exemplar.regularity import Lattice

DOTS = samples.dots((64, 64)).image
FAR = 10**12


@pytest.fixture(scope="module")
def tiles() -> texrs.CornerTiles:
    return texrs.CornerTiles(DOTS, 48, seed=1, variants=2)


@pytest.fixture(scope="module")
def stones() -> texrs.CornerTiles:
    maps = {"albedo": DOTS, "height": DOTS[..., 1].astype(np.float32) / 255, "labels": DOTS[..., 0] > 128}
    return texrs.CornerTiles(texrs.Material(maps), 32, seed=2, variants=1)


def test_the_torus_holds_each_tile_once() -> None:
    found = number_tiles(np.pad(TORUS, (0, 1), mode="wrap"))
    assert sorted(found.reshape(-1)) == list(range(TILES))


def test_colours_are_even_and_hang_on_the_place_alone() -> None:
    lines = np.arange(-200, 200)
    colours = draw_colours(3, lines, lines)
    assert np.abs(np.bincount(colours.reshape(-1), minlength=COLOURS) / colours.size - 1 / 3).max() < 0.01
    assert np.array_equal(draw_colours(3, lines[50:90], lines[7:9]), colours[50:90, 7:9])
    assert (draw_colours(4, lines, lines) != colours).mean() > 0.6
    pairs = (colours[:, 1:] == colours[:, :-1]).mean(), (colours[1:] == colours[:-1]).mean()
    assert np.allclose(pairs, 1 / 3, atol=0.02)


def test_windows_agree_wherever_they_are(tiles: texrs.CornerTiles) -> None:
    for row, column in ((0, 0), (-1000, 7), (FAR, -FAR)):
        whole = tiles[row : row + 200, column : column + 160]
        assert whole.shape == (200, 160, 3)
        assert np.array_equal(tiles[row + 33 : row + 140, column + 50 : column + 51], whole[33:140, 50:51])
        assert np.array_equal(tiles.window((row + 3, column), (50, 160)).image, whole[3:53])
    assert not np.array_equal(tiles[0:100, 0:100], tiles[FAR : FAR + 100, 0:100])


def _measure_steps(image: np.ndarray, axis: int, side: int) -> np.ndarray:
    """Return the mean difference of neighbours by position in a tile. The last ones are across its end."""
    steps = np.abs(np.diff(image, axis=axis, append=image.take([0], axis))).mean(axis=(1 - axis, 2))
    return np.asarray(steps[:-side].reshape(-1, side).mean(axis=0))


def test_tiles_agree_along_their_edges(tiles: texrs.CornerTiles) -> None:
    """A strip is on both sides of an edge, so the edge is invisible."""
    side = tiles.tile_size
    image = tiles[0 : 12 * side, 0 : 12 * side].astype(float)
    cells = image.reshape(12, side, 12, side, 3)
    mixed = np.random.default_rng(0).permutation(cells.transpose(0, 2, 1, 3, 4).reshape(144, side, side, 3))
    loose = mixed.reshape(12, 12, side, side, 3).transpose(0, 2, 1, 3, 4).reshape(image.shape)
    for axis in (0, 1):
        found, apart = (_measure_steps(each, axis, side) for each in (image, loose))
        # Next to tiles that do not match (``loose``), the difference is largest at the edge of a tile.
        assert apart[-1] == apart.max()
        assert found[-1] < min(1.5 * found.mean(), 0.7 * apart[-1])
    assert tiles.source_map.shape == tiles.atlas.shape[:2] == (9 * side, 9 * side)


def test_the_source_map_shows_the_window(tiles: texrs.CornerTiles) -> None:
    made = tiles.window((FAR + 5, -77), (90, 130))
    shown = made.source_map.render(DOTS).astype(int)
    # Larger differences are colours that the design blended.
    assert np.median(np.abs(shown - made.image)) <= 3
    assert made.source_map.shape == (90, 130)
    assert made.report["origin"] == [FAR + 5, -77]


def test_materials_stay_in_register(stones: texrs.CornerTiles) -> None:
    made = stones.window((-40, FAR), (70, 90))
    assert made.material is not None
    assert {name: (m.pixels.shape, str(m.pixels.dtype)) for name, m in made.material.items()} == {
        "albedo": ((70, 90, 3), "uint8"),
        "height": ((70, 90), "float32"),
        "labels": ((70, 90), "bool"),
    }
    height, albedo = made.material["height"].pixels, made.material["albedo"].pixels[..., 1] / 255
    assert np.corrcoef(height.reshape(-1), albedo.reshape(-1))[0, 1] > 0.95
    assert stones.material is not None
    assert stones.material["height"].pixels.shape == (288, 288)


def test_nothing_repeats_as_a_whole(tiles: texrs.CornerTiles) -> None:
    index = tiles.index((0, 0), (60, 60))
    assert len(np.unique(index)) == TILES
    for step in (1, 2, 9, 16, 32):
        assert (index[step:] == index[:-step]).mean() < 0.05
        assert (index[:, step:] == index[:, :-step]).mean() < 0.05


def test_same_bytes_again_in_threads_and_after_travelling(tiles: texrs.CornerTiles) -> None:
    with texrs.threads(1):
        again = texrs.CornerTiles(DOTS, 48, seed=1, variants=2)
    assert again.key == tiles.key
    assert np.array_equal(again.source_map.coordinates, tiles.source_map.coordinates)
    back = pickle.loads(pickle.dumps(tiles))
    assert np.array_equal(back[FAR : FAR + 60, 0:60], tiles[FAR : FAR + 60, 0:60])
    assert texrs.CornerTiles(DOTS, 48, seed=2, variants=1).key != tiles.key


def test_dask_and_zarr(stones: texrs.CornerTiles, tmp_path: Path) -> None:
    pytest.importorskip("dask")
    pytest.importorskip("zarr")
    lazily = stones.to_dask((100, 70), 32, origin=(FAR, 5), map="height")
    wanted = stones.window((FAR, 5), (100, 70)).material
    assert wanted is not None
    assert np.array_equal(lazily.compute(scheduler="threads"), wanted["height"].pixels)
    done = stones.to_zarr(tmp_path / "t.zarr", (100, 70), 64, origin=(FAR, 5))
    assert np.array_equal(texrs.stores.open_store(done.path, "labels").compute(), wanted["labels"].pixels)
    assert stones.to_zarr(tmp_path / "t.zarr", (100, 70), 64, origin=(FAR, 5)).made == 0


def test_engines_read_what_is_saved(stones: texrs.CornerTiles, tmp_path: Path) -> None:
    """NumPy repeats the work of the shader: the same pixels as a window, and the index wraps."""
    files = stones.save(tmp_path, (8, 12))
    assert [f.name for f in files] == [
        "albedo.png",
        "height.tif",
        "labels.png",
        "index.png",
        "tiles.glsl",
        "tiles.gdshader",
    ]
    atlas, index = io.read(tmp_path / "albedo.png"), io.read(tmp_path / "index.png")
    side = stones.tile_size
    shown = np.concatenate(
        [
            np.concatenate(
                [atlas[t // 9 * side : (t // 9 + 1) * side, t % 9 * side : (t % 9 + 1) * side] for t in map(int, row)],
                axis=1,
            )
            for row in index
        ]
    )
    # The index repeats after its last row and column, where the unbounded plane continues differently.
    assert np.array_equal(shown[: 7 * side, : 11 * side], stones[0 : 7 * side, 0 : 11 * side])
    assert "textureGrad(atlas" in (tmp_path / "tiles.glsl").read_text()
    assert "shader_type spatial" in (tmp_path / "tiles.gdshader").read_text()


def test_wrong_arguments(tiles: texrs.CornerTiles) -> None:
    for call, message in (
        (lambda: texrs.CornerTiles(DOTS, 30), "tile_size: must be an integer between 32"),
        (lambda: texrs.CornerTiles(DOTS, 50), "tile_size: must be a multiple of 4"),
        (lambda: texrs.CornerTiles(DOTS, 48, variants=0), "variants"),
        (lambda: texrs.CornerTiles(DOTS, 48, wrap=True), "wrap: cannot be set; use tile_size"),
        (lambda: tiles.window((0, 10**16), 5), "origin"),
        (lambda: tiles.window(0, (5, 0)), "size"),
        (lambda: tiles[0:5], "index: must be ranges"),
        (lambda: tiles[0:5, ::2], "index: must be ranges"),
        (lambda: tiles.to_dask(50, map="gloss"), "map: must be one of"),
    ):
        with pytest.raises(texrs.errors.InvalidInput, match=message):
            call()


def test_what_repeats_does_so_in_whole_periods() -> None:
    """Each tile is in phase with its neighbours, though no two show the same."""
    tiles = texrs.CornerTiles(samples.weave((96, 96)).image, seed=1, variants=2)
    light = tiles[0 : 4 * tiles.tile_size, 0 : 4 * tiles.tile_size].mean(axis=-1)
    for axis in (0, 1):
        after, before = np.split(light, [tiles.tile_size], axis)[1], np.split(light, [-tiles.tile_size], axis)[0]
        assert np.corrcoef(after.ravel(), before.ravel())[0, 1] > 0.6
        assert not np.array_equal(after, before)


def test_phases_of_pictures_are_found() -> None:
    image = np.random.default_rng(1).random((12, 16, 3))
    wall = np.tile(image, (4, 3, 1))
    lattice = Lattice((12, 0), (0, 16), 1.0)
    step = find_step([wall, np.roll(wall, (5, 7), (0, 1))], lattice, 24)
    assert step is None  # A tile contains 1.5 periods.
    step = find_step([wall, np.roll(wall, (5, 7), (0, 1)), -wall], lattice, 48)
    assert step is not None
    assert step.shifts.tolist() == [[row, column] for row in range(0, 48, 12) for column in range(0, 48, 16)]
    assert step.phases[:2].tolist() == [[0, 0], [5, 7]]
    draw = Draw(np.random.default_rng(2), 2, (48, 48), step)
    for row, column in ((0, 0), (-4, 3)):
        which, y, x = draw(row, column)
        shown = (wall, np.roll(wall, (5, 7), (0, 1)))[which]
        assert np.array_equal(shown[y % 48, x % 48], image[row % 12, column % 16])


def test_a_side_is_chosen_on_which_a_lattice_closes() -> None:
    assert choose_side(None, 256) == 256
    assert choose_side(Lattice((12, 0), (0, 16), 1.0), 256) == 240
    assert choose_side(Lattice((0, 200), (200, 0), 1.0), 64) == 64

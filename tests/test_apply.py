"""Maps looked up one by one: the file name counts as in a folder, and integer labels are recognised."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import texrs
from texrs import Material, io
from texrs._notices import collect
from texrs.cli import main
from texrs.materials import Role
from texrs.materials._labels import holds_labels

PEBBLES = texrs.samples.pebbles((96, 96)).image
HEIGHT = PEBBLES.mean(axis=-1)
DOWN, RIGHT = (np.roll(HEIGHT, -1, axis) - np.roll(HEIGHT, 1, axis) for axis in (0, 1))
SLOPES = np.dstack([-RIGHT, DOWN, np.full_like(HEIGHT, 60)])
SLOPES /= np.linalg.norm(SLOPES, axis=-1, keepdims=True)
UP = np.rint((SLOPES + 1) * 127.5).astype(np.uint8)
IDS = np.kron(np.random.default_rng(3).integers(1, 60000, (12, 12)), np.ones((8, 8))).astype(np.uint16)


@pytest.fixture(scope="module")
def places(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a source map that rotates, and maps in register with its example."""
    folder = tmp_path_factory.mktemp("apply")
    io.write(folder / "a.png", PEBBLES)
    words = ["synthesize", str(folder / "a.png"), "-o", str(folder / "b.png"), "--size", "96x96", "-q"]
    assert main([*words, "--field", "circular", "--source-map", str(folder / "m.npz")]) == 0
    io.write(folder / "rock_normal_gl.png", UP)
    io.write(folder / "rock_nor_dx.png", np.dstack([UP[..., 0], 255 - UP[..., 1], UP[..., 2]]))
    io.write(folder / "rock_flow.png", UP)
    io.write(folder / "rock_mask.png", ((HEIGHT > 110) * 255).astype(np.uint8))
    io.write(folder / "rock_height.png", (HEIGHT * 257).astype(np.uint16))
    io.write(folder / "rock_labels.png", IDS)
    io.write(folder / "x.png", IDS)
    io.write(folder / "y.png", PEBBLES[..., 0])
    return folder


CASES = [
    ("rock_normal_gl.png", ["--map-type", "normal", "--green", "up"], "read as normals with y up"),
    ("rock_nor_dx.png", ["--map-type", "normal", "--green", "down"], "read as normals with y down"),
    ("rock_flow.png", ["--map-type", "vector", "--green", "up"], "read as vectors with y up"),
    ("rock_mask.png", ["--map-type", "label"], "read as labels"),
    ("rock_labels.png", ["--map-type", "label"], "read as labels"),
    ("x.png", ["--map-type", "label"], "read as labels, because its integers form regions of unrelated values"),
    ("rock_height.png", ["--map-type", "colour"], ""),
    ("y.png", ["--map-type", "colour"], ""),
]


@pytest.mark.parametrize(
    ("names", "says", "options"),
    [
        (["T_Rock_N"], "read as normals with y down", ["--map-type", "normal", "--green", "down"]),
        (["stone_n", "stone_h"], "read as normals with y up", ["--map-type", "normal", "--green", "up"]),
        (
            ["stone_n", "stone"],
            "stone_n.png: read as normal (the folder has other maps of stone)",
            ["--map-type", "normal", "--green", "up"],
        ),
        (["stone_n", "brick"], "read as colours, because no other map in the folder", ["--map-type", "colour"]),
    ],
)
def test_short_names_count_with_their_folder(
    places: Path, names: list[str], says: str, options: list[str], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    for name in names:
        io.write(tmp_path / f"{name}.png", UP)
    words = ["apply", str(places / "m.npz"), str(tmp_path / f"{names[0]}.png"), "-o"]
    assert main([*words, str(tmp_path / "plain.tif")]) == 0
    assert says in capsys.readouterr().err
    assert main([*words, str(tmp_path / "told.tif"), *options]) == 0
    assert "read as" not in capsys.readouterr().err
    assert (io.read(tmp_path / "plain.tif") == io.read(tmp_path / "told.tif")).all()


@pytest.mark.parametrize(("name", "options", "says"), CASES)
def test_names_count_as_in_a_folder(
    places: Path, name: str, options: list[str], says: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    words = ["apply", str(places / "m.npz"), str(places / name), "-o"]
    assert main([*words, str(tmp_path / "plain.tif")]) == 0
    said = capsys.readouterr().err
    assert (f"{name}: {says}" in said) if says else "read as" not in said
    assert main([*words, str(tmp_path / "told.tif"), *options]) == 0
    assert "read as" not in capsys.readouterr().err
    plain = io.read(tmp_path / "plain.tif")
    assert (plain == io.read(tmp_path / "told.tif")).all()
    # In Python, the role is also read from the name of a path.
    source = texrs.SourceMap.load(places / "m.npz")
    assert (texrs.apply(source, places / name) == plain).all()
    if "label" in options:
        assert set(np.unique(plain)) <= set(np.unique(io.read(places / name)))
    # Writing to a store in parts must give the same pixels.
    pytest.importorskip("zarr")
    assert main([*words, str(tmp_path / "parts.zarr"), "--screening", "0"]) == 0
    assert main([*words, str(tmp_path / "told.zarr"), "--screening", "0", *options]) == 0
    assert (io.read(tmp_path / "parts.zarr") == io.read(tmp_path / "told.zarr")).all()


def test_turned_normals_fit_turned_heights(places: Path) -> None:
    source = texrs.SourceMap.load(places / "m.npz")
    height = texrs.apply(source, HEIGHT.astype(np.float32))
    normal = texrs.apply(source, places / "rock_normal_gl.png") / 127.5 - 1
    slope = np.roll(height, -1, 1) - np.roll(height, 1, 1)
    assert np.corrcoef(-slope.ravel(), normal[..., 0].ravel())[0, 1] > 0.8


def test_an_option_outweighs_a_name(places: Path) -> None:
    source = texrs.SourceMap.load(places / "m.npz")
    stated = texrs.apply(source, places / "rock_nor_dx.png", green="up")
    assert (stated == texrs.apply(source, io.read(places / "rock_nor_dx.png"), map_type="normal")).all()
    assert (stated != texrs.apply(source, places / "rock_nor_dx.png")).any()


def cells(random: bool) -> NDArray[Any]:
    """Return numbered regions with curved outlines."""
    generator = np.random.default_rng(5)
    points = generator.uniform(0, 96, (40, 2))
    rows, columns = np.indices((96, 96))
    near = ((rows[..., None] - points[:, 0]) ** 2 + (columns[..., None] - points[:, 1]) ** 2).argmin(axis=-1)
    return (generator.permutation(40)[near] if random else np.argsort(np.argsort(points[:, 0]))[near]).astype(np.uint8)


def smooth(times: int) -> NDArray[Any]:
    values = HEIGHT
    for _ in range(times):
        values = sum(np.roll(values, step, axis) for axis in (0, 1) for step in (-1, 1)) / 4
    return np.asarray(values)


@pytest.mark.parametrize(
    ("pixels", "expected"),
    [
        (IDS, True),
        (IDS[..., np.newaxis], True),
        (IDS.astype(np.int32) - 30000, True),
        (cells(random=True), True),
        (cells(random=False), True),
        (np.arange(36).repeat(16).reshape(36, 16).repeat(4, axis=1).reshape(36 * 4, 16)[:96], False),
        (PEBBLES[..., 0], False),
        (PEBBLES, False),
        ((HEIGHT * 257).astype(np.uint16), False),
        (smooth(30).astype(np.uint8), False),
        ((smooth(30) * 257).astype(np.uint16), False),
        ((PEBBLES[..., 0] // 16 * 16), False),
        ((smooth(8) // 8 * 8).astype(np.uint8), False),
        (np.tile(np.arange(96, dtype=np.uint8), (96, 1)), False),
        (((HEIGHT > 110) * 255).astype(np.uint8), False),
        (HEIGHT.astype(np.float32), False),
        (np.zeros((96, 96), np.uint8), False),
        (np.arange(200, dtype=np.uint8)[np.newaxis], False),
    ],
)
def test_labels_are_told_from_pictures(pixels: NDArray[Any], expected: bool) -> None:
    assert holds_labels(pixels, 2) == expected
    if pixels.ndim == 2:
        assert holds_labels(np.stack([pixels] * 3), 3) == (expected and min(pixels.shape) > 1)


def test_a_material_takes_labels_without_a_role_and_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made = Material({"albedo": PEBBLES, "pieces": IDS})
    assert made["pieces"].role is Role.LABELS
    assert made.notices.assumed == ["pieces: read as labels, because its integers form regions of unrelated values"]
    place = tmp_path / "rock"
    place.mkdir()
    io.write(place / "rock_albedo.png", PEBBLES)
    io.write(place / "rock_pieces.png", IDS)
    io.write(place / "rock_small.png", IDS[:64])
    with collect(show=lambda line: None) as notices:
        back = Material.read(place)
    assert {name: each.role for name, each in back.items()} == {"albedo": Role.COLOUR, "pieces": Role.LABELS}
    assert notices.assumed == [
        f"{place}: rock_pieces.png read as labels, because its integers form regions of unrelated values"
    ]
    out = tmp_path / "out"
    words = ["design", str(place), "--size", "64x64", "-o", str(out), "--stages", str(tmp_path / "s")]
    assert main([*words, "--role", "rock_small=mask"]) == 2
    assert "must all have the same size" in capsys.readouterr().err
    (place / "rock_small.png").unlink()
    assert main(words) == 0
    assert "read as labels" in json.loads((tmp_path / "s" / "report.json").read_text())["assumed"][0]
    assert set(np.unique(io.read(out / "rock_pieces.png"))) <= set(np.unique(IDS))
    assert main(["rerun", str(out)]) == 0
    io.write(place / "rock_pieces.png", IDS[::-1])
    assert main(["rerun", str(out)]) == 2
    assert "rock_pieces.png has changed since" in capsys.readouterr().err

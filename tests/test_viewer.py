"""Volumes in a page: all voxels are there, in few bytes, and there is an image without scripts."""

import io
import json
import re
import shutil
import subprocess
from base64 import b64decode
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from PIL import Image

import texrs
from texrs import samples, volume
from texrs._viewer import MOST
from texrs.cli import main
from texrs.errors import FileError, InvalidInput

STRIPES = samples.stripes((32, 36, 40))


def take_apart(page: str) -> tuple[np.ndarray, np.ndarray, dict[str, list[int]]]:
    """Return the voxels in a page, its static image, and the data of its script."""
    pictures = {kind: b64decode(code) for kind, code in re.findall(r"data:image/(\w+);base64,([^\"]+)", page)}
    sheet, still = (np.asarray(Image.open(io.BytesIO(pictures[kind]))) for kind in ("webp", "png"))
    told = {name: json.loads(re.search(rf"\b{name} = (\[[^]]*\]|\d+)", page)[1]) for name in ("n", "step", "wide")}
    planes, rows, columns = told["n"]
    wide = told["wide"]
    voxels = np.stack(
        [
            sheet[p // wide * rows : (p // wide + 1) * rows, p % wide * columns : (p % wide + 1) * columns]
            for p in range(planes)
        ]
    )
    return voxels, still, told


@pytest.mark.parametrize("shape", [(32, 36, 40), (5, 4, 3), (1, 7, 9), (200, 3, 2)])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_all_voxels_are_there(shape: tuple[int, ...], channels: int) -> None:
    given = np.random.default_rng(0).integers(0, 255, (*shape, channels)).astype(np.uint8)
    page = volume.Viewer(given)._repr_html_()
    voxels, still, told = take_apart(page)
    shown = given if channels > 2 else np.repeat(given[..., :1], 3, axis=-1)
    if channels == 4:
        solid = shown[..., 3] > 0  # Transparent voxels have no colour.
        assert_array_equal(voxels[solid], shown[solid])
    else:
        assert_array_equal(voxels, shown)
    assert told["step"] == [1, 1, 1]
    assert still.shape[1] == shape[2] + shape[2] + shape[1] + 4
    assert f'alt="three slices of a volume of {" x ".join(map(str, shape))}"' in page


def test_large_volumes_stay_small() -> None:
    noise = np.random.default_rng(0).integers(0, 255, (160, 170, 180, 3)).astype(np.uint8)
    page = volume.Viewer(noise)._repr_html_()
    voxels, _, told = take_apart(page)
    assert len(page) < 1.2 * MOST
    assert_array_equal(voxels, noise[:: told["step"][0], :: told["step"][1], :: told["step"][2]])
    assert min(voxels.shape[:3]) > 40


@pytest.mark.parametrize("thing", [STRIPES, texrs.Exemplar(STRIPES.image, axes=3)], ids=["Sample", "Exemplar"])
def test_what_is_a_volume_shows_itself_so(thing) -> None:
    assert_array_equal(take_apart(thing._repr_html_())[0], STRIPES.image)


def test_pictures_are_shown_as_pictures() -> None:
    pebbles = samples.pebbles((64, 64))
    for thing in (pebbles, texrs.Exemplar(pebbles.image), texrs.tile(pebbles.image)):
        assert thing._repr_html_() is None
    made = texrs.solid(STRIPES.image[:, :32, :32], 16, quality="fast", seed=1)
    assert_array_equal(take_apart(made._repr_html_())[0], made.image)


def test_pages(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    texrs.io.write_volume(tmp_path / "a.npy", STRIPES.image)
    assert main(["slice", f"{tmp_path}/a.npy", "-o", f"{tmp_path}/a.html", "-q"]) == 0
    text = (tmp_path / "a.html").read_text(encoding="utf-8")
    assert text.startswith("<!doctype html>")
    assert_array_equal(take_apart(text)[0], STRIPES.image)
    assert main(["slice", f"{tmp_path}/a.npy", "-o", f"{tmp_path}/a.html", "--cube"]) == 2
    assert "--out: must be an image with --cube" in capsys.readouterr().err
    labels = np.arange(4 * 4 * 4).reshape(4, 4, 4)
    assert_array_equal(take_apart(volume.Viewer(labels, labels=True)._repr_html_())[0], volume.label_to_color(labels))
    with pytest.raises(FileError, match=r"the suffix must be \.html"):
        volume.Viewer(labels).save(tmp_path / "a.png")
    with pytest.raises(InvalidInput, match="volume"):
        volume.Viewer(np.zeros((4, 4)))


@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node to read JavaScript with")
def test_the_script_is_javascript(tmp_path: Path) -> None:
    script = re.search(r"<script>(.*)</script>", volume.Viewer(STRIPES.image)._repr_html_(), re.DOTALL)[1]
    (tmp_path / "a.js").write_text(script)
    subprocess.run(["node", "--check", str(tmp_path / "a.js")], check=True)

"""The plugin of napari, tested by npe2's harness: each kind of file opens as its layers."""

import tomllib
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import texrs
from texrs import _napari, elements, io, samples
from texrs.errors import FileError

with warnings.catch_warnings():
    # npe2 causes warnings of the newest pydantic.
    warnings.simplefilter("ignore")
    npe2 = pytest.importorskip("npe2")
    from npe2 import _pytest_plugin as harness
zarr = pytest.importorskip("zarr")
pytest.importorskip("dask.array")

MANIFEST = Path(texrs.__file__).with_name("napari.yaml")
STRIPES = samples.stripes((32, 32, 32)).image
WEAVE = samples.weave((48, 64)).image


@pytest.fixture
def manager() -> Iterator[Any]:
    """Yield npe2's manager for tests, with only this plugin."""
    plugins = harness.TestPluginManager()
    with patch("npe2.PluginManager.instance", return_value=plugins), plugins.tmp_plugin(manifest=str(MANIFEST)):
        yield plugins


def open_files(manager, *paths: Path) -> list[Any]:
    return npe2.read([str(p) for p in paths], stack=False, plugin_name="texrs")


def test_the_manifest_is_whole() -> None:
    manifest = npe2.PluginManifest.from_file(MANIFEST)
    manifest.validate_imports()
    assert manifest.contributions.readers[0].accepts_directories
    said = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert said["entry-points"]["napari.manifest"] == {"texrs": "texrs:napari.yaml"}


@pytest.mark.parametrize("suffix", [".npy", ".npz", ".nrrd", ".nii", ".nii.gz", ".tif", ".vti"])
@pytest.mark.parametrize("channels", [1, 3, 5])
def test_volumes(manager: Any, tmp_path: Path, suffix: str, channels: int) -> None:
    volume = np.resize(STRIPES, (6, 7, 8, channels)) if channels > 1 else STRIPES[..., 0]
    io.write_volume(tmp_path / f"a{suffix}", volume)
    [(data, options, kind)] = open_files(manager, tmp_path / f"a{suffix}")
    assert kind == "image"
    assert options["name"] == "a"
    if channels == 5:
        assert options["channel_axis"] == 0
        data = np.moveaxis(data, 0, -1)
    assert options.get("rgb", False) == (channels == 3)
    assert_array_equal(data, volume)


def test_a_store_opens_lazily_with_all_levels(manager: Any, tmp_path: Path) -> None:
    texture = texrs.PlaneTexture(WEAVE, seed=1)
    texture.to_zarr(tmp_path / "a.zarr", (80, 64), 32, origin=(-8, 4), spacing=(0.5, 0.25))
    [(levels, options, kind)] = open_files(manager, tmp_path / "a.zarr")
    assert kind == "image"
    assert options["multiscale"]
    assert options["rgb"]
    assert [level.shape for level in levels] == [(80, 64, 3), (40, 32, 3), (20, 16, 3)]
    assert options["scale"] == [0.5, 0.25]
    assert options["translate"] == [-4, 1]
    assert_array_equal(levels[0].compute(), texture[-8:72, 4:68])


def test_a_store_of_a_material(manager: Any, tmp_path: Path) -> None:
    material = texrs.Material({"albedo": WEAVE, "height": WEAVE[..., 0].astype(np.float32)})
    texture = texrs.PlaneTexture(material, seed=1)
    texture.to_zarr(tmp_path / "m.zarr", 64, 32)
    layers = {options["name"]: (data, options) for data, options, _ in open_files(manager, tmp_path / "m.zarr")}
    assert layers.keys() == {"albedo", "height"}
    assert layers["height"][0][0].dtype == np.float32
    assert "rgb" not in layers["height"][1]


def test_labels_stay_labels(manager: Any, tmp_path: Path) -> None:
    labels = texrs.Exemplar(samples.particles((32, 32, 32)).labels.astype(np.uint16), axes=3, labels=True)
    texrs.SolidTexture(labels, seed=1).to_zarr(tmp_path / "a.zarr", 32, 16)
    [(_, options, kind)] = open_files(manager, tmp_path / "a.zarr")
    assert kind == "labels"
    assert options["multiscale"]


def test_plain_arrays(manager: Any, tmp_path: Path) -> None:
    zarr.save_array(tmp_path / "a.zarr", STRIPES)
    [(data, options, kind)] = open_files(manager, tmp_path / "a.zarr")
    assert (kind, options["rgb"], options["multiscale"]) == ("image", True, False)
    assert_array_equal(data.compute(), STRIPES)
    zarr.create_array(tmp_path / "b.zarr", data=np.moveaxis(STRIPES, -1, 0).copy(), dimension_names=list("czyx"))
    [(data, options, _)] = open_files(manager, tmp_path / "b.zarr")
    assert_array_equal(data.compute(), STRIPES)


def test_source_maps_and_elements(manager: Any, tmp_path: Path) -> None:
    made = texrs.tile(WEAVE)
    made.source_map.save(tmp_path / "map.npz")
    (places, options, kind), (patches, _, second) = open_files(manager, tmp_path / "map.npz")
    assert (kind, options["rgb"], second) == ("image", True, "labels")
    assert places.shape == (*made.source_map.shape, 3)
    assert len(np.unique(patches)) == len(np.unique(made.source_map.label))
    entry = elements.ElementAnalysis.of_sample(samples.bricks((96, 96)))
    entry.save(tmp_path / "entry.npz")
    (image, _, _), (labels, _, kind), (points, _, last) = open_files(manager, tmp_path / "entry.npz")
    assert (kind, last) == ("labels", "points")
    assert_array_equal(image, entry.image)
    assert labels.shape == image.shape[:2]
    assert_array_equal(points, entry.points)


def test_what_texrs_does_not_read(manager: Any, tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("no")
    (tmp_path / "folder").mkdir()
    assert _napari.get_reader(str(tmp_path / "a.txt")) is None
    assert _napari.get_reader(str(tmp_path / "folder")) is None
    (tmp_path / "bad.npy").write_bytes(b"no")
    with pytest.raises(FileError, match="must be a file in one of"):
        _napari.read(str(tmp_path / "bad.npy"))


@pytest.mark.parametrize("suffix", [".nrrd", ".nii.gz", ".vti", ".zarr"])
@pytest.mark.parametrize("channels", [1, 3, 5])
def test_voxels_lie_as_far_apart_as_the_file_says(manager: Any, tmp_path: Path, suffix: str, channels: int) -> None:
    volume = np.resize(STRIPES, (6, 7, 8, channels)) if channels > 1 else STRIPES[..., 0]
    io.write_volume(tmp_path / f"a{suffix}", volume, spacing=(3, 1, 0.5))
    [(_, options, _)] = open_files(manager, tmp_path / f"a{suffix}")
    assert options["scale"] == [3, 1, 0.5]

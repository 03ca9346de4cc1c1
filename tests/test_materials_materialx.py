"""Materials as MaterialX documents: valid by the package's own check, compiled to shaders, and with the right maps."""

from pathlib import Path
from typing import Any

import MaterialX
import numpy as np
import pytest
from MaterialX import PyMaterialXGenGlsl, PyMaterialXGenShader

import texrs
from texrs import Material, io
from texrs._typing import Array
from texrs.errors import FileError, InvalidInput
from texrs.materials.surface import measure_relief

STONES = texrs.samples.pebbles((48, 64)).image
GREYS = STONES[..., 0]
SLOPES = np.dstack([STONES[..., 0] / 512 - 0.25, STONES[..., 1] / 256 - 0.5, np.ones((48, 64))])
NORMAL = np.rint((SLOPES / np.linalg.norm(SLOPES, axis=-1, keepdims=True) + 1) / 2 * 255).astype(np.uint8)
LIBRARY = MaterialX.createDocument()
MaterialX.loadLibraries(MaterialX.getDefaultDataLibraryFolders(), MaterialX.getDefaultDataSearchPath(), LIBRARY, set())


def check(path: Path) -> tuple[dict[str, Any], dict[str, Path]]:
    """Return the inputs of the surface and the files of its images, for a valid document that compiles to a shader."""
    document = MaterialX.createDocument()
    MaterialX.readFromXmlFile(document, str(path))
    # List the graphs before the library is imported, because its graphs then also belong to the document.
    graphs = document.getNodeGraphs()
    document.setDataLibrary(LIBRARY)
    valid, message = document.validate()
    assert valid, message
    materials = document.getMaterialNodes()
    assert len(materials) == 1
    surfaces = MaterialX.getShaderNodes(materials[0], "surfaceshader")
    assert [s.getCategory() for s in surfaces] == ["standard_surface"]
    surface = surfaces[0]
    assert surface.getNodeDef() is not None
    files = {}
    for graph in graphs:
        for node in graph.getNodes():
            assert node.getNodeDef() is not None, f"{node.getName()}: no such node"
            for given in node.getInputs():
                assert node.getNodeDef().getActiveInput(given.getName()).getType() == given.getType()
        for node in graph.getNodes("image"):
            files[node.getName()] = path.parent / node.getInput("file").getValueString()
            assert files[node.getName()].is_file()
    for given in surface.getInputs():
        wanted = surface.getNodeDef().getActiveInput(given.getName())
        assert wanted is not None, f"{given.getName()}: no such input"
        assert wanted.getType() == given.getType()
        assert given.getValueString() or given.getConnectedOutput() is not None
    # The shader generator fails if an input cannot be connected.
    generator = PyMaterialXGenGlsl.GlslShaderGenerator.create()
    context = PyMaterialXGenShader.GenContext(generator)
    context.registerSourceCodeSearchPath(MaterialX.getDefaultDataSearchPath())
    whole = MaterialX.createDocument()
    MaterialX.readFromXmlFile(whole, str(path))
    whole.importLibrary(LIBRARY)
    system = PyMaterialXGenShader.DefaultColorManagementSystem.create(generator.getTarget())
    system.loadLibrary(whole)
    generator.setColorManagementSystem(system)
    shader = generator.generate("shader", whole.getDescendant(surface.getNamePath()), context)
    assert "standard_surface" in shader.getSourceCode(PyMaterialXGenShader.PIXEL_STAGE)
    inputs = {g.getName(): g.getValue() if g.getValueString() else g.getConnectedNode() for g in surface.getInputs()}
    shaders = MaterialX.getShaderNodes(materials[0], "displacementshader")
    if shaders:
        inputs["displacement"] = shaders[0].getInput("scale").getValue()
    return inputs, files


def test_a_document_is_valid_and_names_its_maps(tmp_path: Path) -> None:
    full = Material(
        {
            "albedo": STONES,
            "nor_dx": NORMAL,
            "ao": GREYS,
            "rough": STONES.astype(np.uint16) * 257,
            "metal": GREYS > 128,
            "glow": STONES.astype(np.float32),
            "opacity": GREYS.astype(np.int16),
            "height": GREYS.astype(np.float64),
            "labels": GREYS.astype(np.int32),
        }
    )
    paths = full.save_materialx(tmp_path / "my stones.mtlx")
    assert sorted(paths) == sorted(tmp_path.iterdir())
    inputs, files = check(paths[0])
    assert {name: path.name for name, path in files.items()} == {
        "colour_image": "my stones_albedo.png",
        "normal_image": "my stones_nor_gl.png",
        "roughness_image": "my stones_rough.png",
        "metallic_image": "my stones_metal.png",
        "emission_image": "my stones_glow.exr",
        "opacity_image": "my stones_opacity.png",
        "height_image": "my stones_height.exr",
    }
    assert (io.read(files["colour_image"]) == STONES).all()
    turned = io.read(files["normal_image"])
    assert (turned[..., [0, 2]] == NORMAL[..., [0, 2]]).all()
    assert (turned[..., 1] == 255 - NORMAL[..., 1]).all()
    assert (io.read(files["roughness_image"]) == full["rough"].pixels[..., 0]).all()
    assert (io.read(files["emission_image"]) == full["glow"].pixels).all()
    assert io.read(files["opacity_image"]).dtype == np.uint16
    assert inputs["base_color"].getName() == "colour_image"
    assert inputs["base_color"].getInput("file").getColorSpace() == "srgb_texture"
    assert inputs["emission_color"].getInput("file").getColorSpace() == "lin_rec709"
    assert inputs["normal"].getCategory() == "normalmap"
    assert inputs["displacement"] > 0


@pytest.mark.parametrize(
    ("maps", "images", "values"),
    [
        ({"albedo": STONES}, {"colour_image"}, {"metalness": 0, "specular_roughness": 0.6}),
        ({"albedo": GREYS}, {"colour_image"}, {"metalness": 0}),
        ({"albedo": np.dstack([GREYS, GREYS])}, {"colour_image"}, {}),
        ({"albedo": np.dstack([STONES, GREYS]).astype(np.uint16)}, {"colour_image"}, {}),
        ({"arm": STONES}, {"orm_image"}, {"base": 1}),
        ({"arm": STONES, "roughness": GREYS}, {"orm_image", "roughness_image"}, {}),
        ({"height": GREYS}, {"height_image", "normal_image"}, {}),
        ({"emission": np.dstack([STONES, GREYS])}, {"emission_image"}, {"emission": 1}),
        ({"normal": (NORMAL / 127.5 - 1).astype(np.float32)}, {"normal_image"}, {}),
        ({"normal": (NORMAL / 255).astype(np.float64), "normal_dx": NORMAL}, {"normal_image"}, {}),
    ],
)
def test_every_kind_of_material_is_valid(
    maps: dict[str, Array], images: set[str], values: dict[str, float], tmp_path: Path
) -> None:
    inputs, files = check(Material(maps).save_materialx(tmp_path / "1-a.mtlx")[0])
    assert set(files) == images
    assert {name: inputs[name] for name in values} == pytest.approx(values)
    if "colour_image" in files:
        shown = io.read(files["colour_image"])
        assert (shown[..., 0].ravel() == np.dstack([maps["albedo"]])[..., 0].ravel()).all()
        assert ("opacity" in inputs) == (shown.shape[-1] == 4)
    if "normal_image" in files and "height" not in maps:
        read = io.read(files["normal_image"])
        unit = NORMAL / 127.5 - 1
        unit /= np.linalg.norm(unit, axis=-1, keepdims=True)
        np.testing.assert_allclose(read * 2 - 1, unit, atol=1e-5)


def test_relief_is_that_of_the_normals() -> None:
    rows, columns = np.indices((64, 128)) * 2 * np.pi / 32
    height = (np.sin(rows) + np.cos(columns)) / 4 + 0.5
    down, right = np.gradient(7 * height)
    normal = np.dstack([-right, down, np.ones_like(down)])
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    dx = normal * np.array([1, -1, 1])
    for maps in ({"normal": normal}, {"normal_dx": dx}):
        found = measure_relief(Material({"height": height.astype(np.float32), **maps}))
        assert found == pytest.approx(7 / 128, rel=0.03)
    assert measure_relief(Material({"height": np.zeros((4, 4), np.uint8), "normal": NORMAL[:4, :4]})) is None


def test_a_depth_that_is_asked_for(tmp_path: Path) -> None:
    stones = Material({"albedo": STONES, "height": GREYS.astype(np.float32)})
    for depth, dtype in ((8, np.uint8), (16, np.uint16), (32, np.float32)):
        _, files = check(stones.save_materialx(tmp_path / f"{depth}.mtlx", depth=depth)[0])  # type: ignore[arg-type]
        assert {io.read(path).dtype for path in files.values()} == {np.dtype(dtype)}


def test_what_cannot_be_written_is_refused(tmp_path: Path) -> None:
    stones = Material({"albedo": STONES})
    with pytest.raises(FileError, match="the suffix must be .mtlx"):
        stones.save_materialx(tmp_path / "a.xml")
    with pytest.raises(FileError, match="does not exist"):
        stones.save_materialx(tmp_path / "none" / "a.mtlx")
    with pytest.raises(InvalidInput, match="must have a map that describes a surface, such as albedo, got mask"):
        Material({"mask": GREYS}).save_materialx(tmp_path / "a.mtlx")
    assert not list(tmp_path.iterdir())

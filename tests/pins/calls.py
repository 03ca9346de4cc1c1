"""Small valid calls of public functions, for those whose own example takes long."""

from __future__ import annotations

import ast
import inspect
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import hostile
import texrs
from texrs import samples

CALLS = """
Constraints(mask=hole, values=image)
CornerTiles(many.image, 32, variants=2)
CornerTiles.__getitem__(np.s_[0:4, 0:4])
CornerTiles.index(0, 8)
CornerTiles.save("tiles", 2)
CornerTiles.to_dask((8, 8), 8)
CornerTiles.to_file("tiles.npy", (8, 8), 8)
CornerTiles.to_zarr("tiles.zarr", (8, 8), 8)
CornerTiles.window(0, 8)
ElementAnalysis.of_labels(many.image, many.labels)
ElementAnalysis.of_sample(many)
ElementAnalysis.similarity()
ElementAnalysis.with_similarity()
Exemplar(image)
Exemplar.analyse()
Exemplar.load(exemplar_file)
Exemplar.segment()
Exemplar.similarity(0)
Guide(exemplar=grey, output=grey)
Material({"albedo": image, "height": grey})
Material.apply(own)
Material.find("height")
Material.flatten_lighting()
Material.preview(side=64)
Material.replace(albedo=image)
Material.save("material")
Material.save_exr("material.exr")
Material.save_gltf("material.gltf")
Material.save_materialx("material.mtlx")
PlaneTexture(image)
PlaneTexture.__getitem__(np.s_[0:4, 0:4])
PlaneTexture.estimate_memory(8)
PlaneTexture.sample([[3, 4.5]])
PlaneTexture.sample_maps([[3, 4.5]])
PlaneTexture.to_dask((8, 8), 8)
PlaneTexture.to_file("plane.npy", (8, 8), 8)
PlaneTexture.to_zarr("plane.zarr", (8, 8), 8)
PlaneTexture.trace([[3, 4.5]])
PlaneTexture.window(0, 8)
Plane.of_corners((32, 32), ((4, 4), (4, 28), (28, 31), (28, 1)))
Plane.of_vanishing_points((32, 32), ((-90, 16), (16, 400)))
PlaneView(slant=30)
RenderOptions((False, False))
SolidTexture(solid, quality="fast")
SolidTexture.__getitem__(np.s_[0:4, 0:4, 0:4])
SolidTexture.estimate_memory(8)
SolidTexture.sample([[3, 4, 5.5]])
SolidTexture.sample_maps([[3, 4, 5.5]])
SolidTexture.slice((3, 4, 5), (1, 0, 1), size=4)
SolidTexture.to_dask((8, 8, 8), 8)
SolidTexture.to_file("solid.npy", (8, 8, 8), 8)
SolidTexture.to_zarr("solid.zarr", (8, 8, 8), 8)
SolidTexture.trace([[3, 4, 5.5]])
SolidTexture.window(0, 4)
SourceMap.compose(own)
SourceMap.render(image)
SourceMap.to_dask(image)
SourceMap.to_zarr("own.zarr", image)
Synthesis(image, own)
TextureDatabase.__getitem__("beans")
TextureDatabase.add(many.image, "more", layout="disjoint")
TextureDatabase.matrix()
TextureDatabase.remove("none")
TextureDatabase.splice("beans", "beans")
apply(own, image)
blend(own, image, wrap=False)
check_tiling(image)
design(image, 32, deformation=still, way="still")
design_variants(image, 1, size=32, deformation=still, way="still")
elements.analyse(image, layout="disjoint")
exemplar.segment(image)
extend(large, left=4, view=view)
fields.check(field, (32, 32))
fields.parse("zigzag")
io.atomic("atomic.txt")
io.write("written.png", image)
io.write_slabs("slabs.npy", [solid], (16, 16, 16, 3))
inpaint(image, hole)
layouts.cells(many.labels)
metrics.evaluate(image, own)
painting.texture_mesh(mesh, solid_texture, atlas=None)
perspective(image, scale_map="front")
planes.find(large)
planes.find_ground(large)
planes.measure_scale(many.image)
rectify(large, view=view)
remove(large, large_hole, view=view)
self_splice(entry)
solid(solid, 8)
splice(entry, entry)
synthesize(image, 32)
threads(1)
tile(image)
volume.compare(solid, solid)
volume.integrity(solid, own_solid)
"""


@cache
def values() -> dict[str, Any]:
    """Return the values in CALLS, and an object of each class by its name. Files are in the current folder."""
    dots, solid = samples.dots((32, 32)), samples.stripes((32, 32, 32)).image[:16, :16, :16]
    many, grey = samples.beans((64, 64)), dots.image[..., 0]
    entry = texrs.ElementAnalysis.of_sample(many)
    base = texrs.TextureDatabase(Path("pins").absolute())
    base.add(many.image, "beans", replace=True, layout="disjoint")
    hole = np.zeros((32, 32), bool)
    hole[9:13, 9:13] = True
    material = texrs.Material({"albedo": dots.image, "height": grey})
    solid_texture = texrs.SolidTexture(texrs.Material({"albedo": solid}, axes=3), quality="fast")
    texrs.Exemplar(grey).save("exemplar.npz")
    return {
        "np": np,
        "many": many,
        "image": dots.image,
        "grey": grey,
        "hole": hole,
        "large": samples.dots((64, 64)).image,
        "large_hole": np.pad(hole, 16),
        "field": texrs.fields.identity(2),
        "solid": solid,
        "own": texrs.SourceMap.identity((32, 32)),
        "own_solid": texrs.SourceMap.identity((16, 16, 16)),
        "view": texrs.PlaneView(slant=20, tilt=90, fov=50),
        "exemplar_file": str(Path("exemplar.npz").absolute()),
        "still": texrs.DeformationOptions(operations=0),
        "mesh": (np.eye(3) * 8, np.array([[0, 1, 2]])),
        "solid_texture": solid_texture,
        "entry": entry,
        "CornerTiles": texrs.CornerTiles(many.image, 32, variants=2, way="still"),
        "ElementAnalysis": entry,
        "Exemplar": texrs.Exemplar(dots.image),
        "Material": material,
        "PlaneTexture": texrs.PlaneTexture(material, quality="fast"),
        "SolidTexture": solid_texture,
        "SourceMap": texrs.SourceMap.identity((32, 32)),
        "TextureDatabase": base,
    }


@cache
def read_calls() -> dict[str, hostile.Call]:
    """Return the calls by the full names of their functions."""
    known = {}
    for line in CALLS.split("\n")[1:-1]:
        call = ast.parse(line, mode="eval").body
        assert isinstance(call, ast.Call)
        name = f"texrs.{ast.unparse(call.func)}"
        owner, _, method = name.removeprefix("texrs.").rpartition(".")
        function, _ = hostile.public_calls()[name]
        if owner in values():
            function = getattr(values()[owner], method)
        args = [eval(ast.unparse(each), values()) for each in call.args]
        named = {each.arg: eval(ast.unparse(each.value), values()) for each in call.keywords}
        known[name] = hostile.Call(name, function, inspect.signature(function).bind(*args, **named).arguments)
    return known

"""Whatever a public function is given, a result or a sentence of texrs comes out.

Each function is called as its own example calls it, with one argument after the other replaced by what it is not meant to be
(`hostile`). Here a few values of each argument are tried; `make fuzz` tries all of them.
"""

import contextlib
import inspect
import random
import signal
import sys
import warnings

import numpy as np
import pytest

import hostile
import texrs
from texrs.errors import TexrsError

FEW = 6
"""Values of each argument that are tried by `make test`."""
SKIPPED = {"scheduler", "function", "make"}
"""Arguments that start processes, or whose own errors are whoever gave them."""


class Late(BaseException):
    """A call did not end."""


@contextlib.contextmanager
def end_in(seconds):
    """Interrupt what takes too long, where the system can."""
    if not hasattr(signal, "setitimer"):
        yield
        return

    def stop(number, frame):
        raise Late

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


@pytest.fixture(scope="module", autouse=True)
def _limited():
    """Let what asks for more memory than all this needs fail here, and not the machine."""
    if sys.platform != "linux":
        yield
        return
    import resource

    limits = resource.getrlimit(resource.RLIMIT_AS)
    with open("/proc/self/statm") as file:
        taken = int(file.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (taken + (3 << 30), limits[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, limits)


def try_values(name, place, count):
    """Call a function with some of the hostile values of each argument, or all; return the calls, and what came out wrong."""
    call = hostile.record(name, place)
    if call is None:
        pytest.skip("has no example that calls it")
    calls, wrong = 0, []
    for parameter in inspect.signature(call.function).parameters.values():
        if parameter.name in SKIPPED or parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD):
            continue
        values = list(enumerate(hostile.list_hostile(call.arguments.get(parameter.name))))
        if count is not None:
            values = random.Random(f"{name} {parameter.name}").sample(values, min(count, len(values)))
        for number, value in values:
            calls += 1
            try:
                with texrs.limits.within(seconds=0.15, pixels=2**22, voxels=2**21), end_in(30):
                    call.change(parameter.name, value)
            except TexrsError:
                pass
            except BaseException as error:
                wrong.append(f"{parameter.name}, value {number}: {type(error).__name__}: {error}"[:200])
    return calls, wrong


NAMES = sorted(hostile.public_calls())
LEFT = {
    "texrs.ElementOptions.labels",
    "texrs.Elements.of_labels.labels",
    "texrs.Elements.of_labels.layout",
    "texrs.Elements.similarity.k",
    "texrs.Exemplar.labels",
    "texrs.Exemplar.remember.fact",
    "texrs.Guide.exemplar",
    "texrs.Guide.output",
    "texrs.Material.find.role",
    "texrs.Material.get.key",
    "texrs.Material.read.axes",
    "texrs.Material.save.depth",
    "texrs.Material.save.pack",
    "texrs.Material.save.suffix",
    "texrs.Material.save_exr.depth",
    "texrs.Material.save_gltf.depth",
    "texrs.Material.save_materialx.depth",
    "texrs.SourceMap.compose.inner",
    "texrs.SourceMap.from_coordinates.coordinates",
    "texrs.SourceMap.pick.label",
    "texrs.SourceMap.pick.maps",
    "texrs.SourceMap.pick.place",
    "texrs.SourceMap.render.kind",
    "texrs.SourceMap.to_dask.exemplars",
    "texrs.SourceMap.to_zarr.exemplars",
    "texrs.TextureDatabase.add.replace",
    "texrs.TextureDatabase.add.similarity",
    "texrs.TextureDatabase.path",
    "texrs.TileSet.save.folder",
    "texrs.TileSet.to_zarr.origin",
    "texrs.blend.kind",
    "texrs.complete.scale_map",
    "texrs.design.weights",
    "texrs.design_variants.weights",
    "texrs.elements.ElementSearch.scales",
    "texrs.elements.analyse.background",
    "texrs.elements.analyse.box",
    "texrs.elements.analyse.layout",
    "texrs.elements.analyse.points",
    "texrs.fields.Field.frames.points",
    "texrs.fields.Field.lattice.jacobians",
    "texrs.fields.Field.lattice.origin",
    "texrs.fields.Field.over.shape",
    "texrs.fields.as_field.axes",
    "texrs.fields.as_field.value",
    "texrs.fields.circular.axes",
    "texrs.fields.circular.centre",
    "texrs.fields.from_directions.directions",
    "texrs.fields.from_directions.origin",
    "texrs.fields.from_directions.signed",
    "texrs.fields.from_function.axes",
    "texrs.fields.from_gradient.across",
    "texrs.fields.from_gradient.volume",
    "texrs.fields.from_structure.sigma",
    "texrs.fields.from_structure.volume",
    "texrs.fields.identity.axes",
    "texrs.fields.read.axes",
    "texrs.fields.read.extent",
    "texrs.fields.scale_ramp.axes",
    "texrs.fields.shear.axes",
    "texrs.fields.slant.axes",
    "texrs.fields.spiral.axes",
    "texrs.fields.zigzag.axes",
    "texrs.io.annotate.notes",
    "texrs.io.is_store.path",
    "texrs.io.write.array",
    "texrs.io.write_surface.faces",
    "texrs.io.write_surface.vertices",
    "texrs.io.write_volume.array",
    "texrs.kernels.gather.gather.exemplars",
    "texrs.kernels.seam.cut.mask_a",
    "texrs.layouts.cells.labels",
    "texrs.layouts.courses.height",
    "texrs.lazy.map.items",
    "texrs.lazy.map.key",
    "texrs.lazy.map.shape",
    "texrs.materials.guess_role.name",
    "texrs.painting.follow.directions",
    "texrs.painting.follow.mesh",
    "texrs.painting.paint.mesh",
    "texrs.perspective.direction",
    "texrs.perspective.target",
    "texrs.scale_maps.decode.image",
    "texrs.scale_maps.extend.scale",
    "texrs.scale_maps.from_mask.foreshortened",
    "texrs.scale_maps.jacobians_of_normals.normals",
    "texrs.self_splice.refine",
    "texrs.splice.refine",
    "texrs.splice.snap_rows",
    "texrs.synthesize.field",
    "texrs.volume.Classes.of.axes",
    "texrs.volume.Classes.of.image",
    "texrs.volume.Classes.shares.axes",
    "texrs.volume.Classes.shares.image",
    "texrs.volume.Viewer.labels",
    "texrs.volume.classes.axes",
    "texrs.volume.frequency.whole",
    "texrs.volume.lightness.axes",
    "texrs.volume.orientation_errors.normal",
    "texrs.volume.orientation_errors.values",
    "texrs.volume.paint.colours",
    "texrs.volume.paint.labels",
    "texrs.volume.surface.closed",
    "texrs.volume.surface.mask",
    "texrs.volume.surface.spacing",
    "texrs.volume.texture_normal.values",
    "texrs.volume.transparent.shading",
    "texrs.volume.transparent.transfer",
}
"""Arguments of which some values still end in an error of Python or NumPy: mostly sparse matrices for True or
False, and ranges or views larger than memory. None may come to it."""


def list_left(name, wrong):
    """Return what came out wrong of arguments that are not known to be left."""
    return [each for each in wrong if f"{name}.{each.partition(',')[0]}" not in LEFT]


@pytest.mark.parametrize("name", NAMES[::12])
def test_some_hostile_values(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    warnings.simplefilter("ignore")
    with np.errstate(all="ignore"):
        _, wrong = try_values(name, tmp_path, FEW)
    assert not list_left(name, wrong)


@pytest.mark.fuzz
@pytest.mark.parametrize("name", NAMES)
def test_all_hostile_values(name, tmp_path, monkeypatch, record_property):
    monkeypatch.chdir(tmp_path)
    warnings.simplefilter("ignore")
    with np.errstate(all="ignore"):
        calls, wrong = try_values(name, tmp_path, None)
    record_property("calls", calls)
    assert not list_left(name, wrong)


@pytest.mark.parametrize("progress", [lambda: None, lambda one: None, lambda a, b, c: None, 3, "yes", int])
def test_progress_that_cannot_be_called_is_refused_before_the_work(progress):
    dots = texrs.samples.dots((64, 64)).image
    for verb in (texrs.tile, texrs.design, texrs.elements.analyse):
        with pytest.raises(texrs.errors.InvalidInput, match="^progress: "):
            verb(dots, progress=progress)
    with pytest.raises(texrs.errors.InvalidInput, match="^progress: "):
        texrs.kernels.poisson.spread(np.zeros((8, 8, 2), np.float32), progress=lambda a, b: None)


@pytest.mark.parametrize("shape", [3, None, "ab", (3,), (0, 3), (2.5, 3), (1, 2, 3, 4), np.zeros(()), range(2**60)])
def test_maps_of_no_shape_are_refused(shape):
    with pytest.raises(TexrsError, match="^shape: "):
        texrs.SourceMap.identity(shape)
    with pytest.raises(TexrsError):
        texrs.SourceMap.from_coordinates(np.zeros((4, 4, 2), np.float32), shape)
    with pytest.raises(TexrsError, match="^coordinates: "):
        texrs.SourceMap.from_coordinates(shape, (4, 4))

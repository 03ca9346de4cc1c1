"""A public function returns a result or raises an error of texrs, for any argument.

Each function is called as in its own example, with one argument after the other replaced by unsuitable values
(`hostile`). `make fuzz` tries all of them. The stored refusals (`pins`) try some values of each argument in all tests.
"""

import contextlib
import inspect
import signal
import sys
import warnings

import numpy as np
import pytest

import hostile
import texrs
from texrs import samples
from texrs.errors import TexrsError

SKIPPED = {"scheduler", "function", "make", "each"}
"""Arguments that start processes, or whose errors belong to the caller's functions."""


class Late(BaseException):
    """A call did not end."""


@contextlib.contextmanager
def end_in(seconds):
    """Interrupt long calls, if the system supports it."""
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
    """Limit memory, so that a large request fails here and does not disturb the machine."""
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


@pytest.fixture(scope="module", autouse=True)
def _drawn_anew():
    """Make examples call the original generators of samples, because cached samples are returned without a call."""
    with pytest.MonkeyPatch.context() as patch:
        for name in samples._GENERATORS:
            patch.setattr(samples, name, inspect.unwrap(getattr(samples, name)))
        yield


def try_values(name, place):
    """Call a function with all hostile values of each argument. Return the calls and the errors."""
    call = hostile.record(name, place)
    if call is None:
        return 0, []
    calls, wrong = 0, []
    for parameter in inspect.signature(call.function).parameters.values():
        if parameter.name in SKIPPED or parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD):
            continue
        for number, value in enumerate(hostile.list_hostile(call.arguments.get(parameter.name))):
            calls += 1
            try:
                with texrs.limits.context(seconds=0.15, pixels=2**22, voxels=2**21), end_in(30):
                    call.change(parameter.name, value)
            except TexrsError:
                pass
            except BaseException as error:
                wrong.append(f"{parameter.name}, value {number}: {type(error).__name__}: {error}"[:200])
    return calls, wrong


NAMES = sorted(hostile.public_calls())
MAP, OTHER = texrs.SourceMap.identity((2, 3)), texrs.SourceMap.identity((3, 2))
LEFT = {
    "texrs.volume.Classes.of.image",
    "texrs.volume.Classes.shares.image",
    "texrs.Plane.project.points",
}
"""Arguments with known exceptions. A view of two bytes as an array of 8 GB ends in a MemoryError. Add no new ones."""


def list_left(name, wrong):
    """Return the errors of arguments that are not in LEFT."""
    return [each for each in wrong if f"{name}.{each.partition(',')[0]}" not in LEFT]


@pytest.mark.parametrize("name", samples._GENERATORS)
def test_a_sample_that_was_drawn_before_is_called_again(name, tmp_path):
    kept, _ = hostile.public_calls()[f"texrs.samples.{name}"]
    first = hostile.record(f"texrs.samples.{name}", tmp_path)
    kept(**first.arguments)
    assert hostile.record(f"texrs.samples.{name}", tmp_path).arguments == first.arguments


@pytest.mark.fuzz
@pytest.mark.parametrize("name", NAMES)
def test_all_hostile_values(name, tmp_path, monkeypatch, record_property):
    monkeypatch.chdir(tmp_path)
    warnings.simplefilter("ignore")
    with np.errstate(all="ignore"):
        calls, wrong = try_values(name, tmp_path)
    record_property("calls", calls)
    assert not list_left(name, wrong)


@pytest.mark.parametrize("shape", [3, None, "ab", (3,), (0, 3), (2.5, 3), (1, 2, 3, 4), np.zeros(()), range(2**60)])
def test_maps_of_no_shape_are_refused(shape):
    with pytest.raises(TexrsError, match="^shape: "):
        texrs.SourceMap.identity(shape)
    with pytest.raises(TexrsError):
        texrs.SourceMap.from_coordinates(np.zeros((4, 4, 2), np.float32), shape)
    with pytest.raises(TexrsError, match="^coordinates: "):
        texrs.SourceMap.from_coordinates(shape, (4, 4))


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: texrs.SourceMap.from_selection([], np.zeros((1, 2), np.uint8), np.zeros((1, 2), np.uint32)), "maps: "),
        (
            lambda: texrs.SourceMap.from_selection([MAP], np.full((1, 2), 6, np.uint8), np.zeros((1, 2), np.uint32)),
            "place: values must be below 6",
        ),
        (lambda: texrs.SourceMap.from_selection([MAP], np.zeros((1, 2)), np.zeros((1, 2), np.uint32)), "place: "),
        (
            lambda: texrs.SourceMap.from_selection([MAP], np.zeros((1, 2), np.uint8), np.zeros((2, 1), np.uint32)),
            "label: ",
        ),
        (
            lambda: texrs.SourceMap.from_selection(
                [MAP, OTHER], np.zeros((1, 2), np.uint8), np.zeros((1, 2), np.uint32)
            ),
            "maps: ",
        ),
        (lambda: MAP.compose(range(2**60)), "inner: "),
        (lambda: texrs.fields.identity(axes=np.zeros((2, 2))), "axes: "),
        (
            lambda: texrs.elements.ElementAnalysis.of_labels(
                np.zeros((32, 32)), np.eye(32, dtype=int), layout=np.eye(2)
            ),
            "layout: ",
        ),
        (lambda: texrs.stores.map_to_zarr(len, range(2**60), "no.zarr"), "items: "),
        (lambda: texrs.materials.guess_role(3), "name: "),
    ],
)
def test_what_cannot_be_is_refused_by_name(call, said):
    with pytest.raises(TexrsError, match=f"^{said}"):
        call()


MAY_BE_NONE = {
    "texrs.Plane.project",
    "texrs.kernels.patch_search.PatchIndex.cost_map",
    "texrs.kernels.reconstruction.reconstruct",
    "texrs.volume.autocorrelation",
    "texrs.volume.compare",
}
"""Results with NaN or infinity for points that are not visible, not allowed or missing, or from the input."""


def try_extremes(name, place, count, seed=0):
    """Call a function with numbers whose sums are not finite. Return the errors."""
    call = hostile.record(name, place)
    rng, wrong = np.random.default_rng([seed, *name.encode()]), []
    for number in range(0 if call is None else count):
        given = {k: hostile.exaggerate(v, rng) if rng.random() < 0.7 else v for k, v in call.arguments.items()}
        try:
            with texrs.limits.context(seconds=0.3, pixels=2**22, voxels=2**21), end_in(30):
                made = call.call(given)
            if name not in MAY_BE_NONE and not all(np.isfinite(each).all() for each in hostile.list_floats(made)):
                wrong.append(f"call {number}: no numbers")
        except TexrsError:
            pass
        except BaseException as error:
            wrong.append(f"call {number}: {type(error).__name__}: {error}"[:200])
    return wrong


@pytest.mark.parametrize("name", NAMES[6::12])
def test_some_numbers_become_numbers(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    warnings.simplefilter("ignore")
    assert not try_extremes(name, tmp_path, 3)


@pytest.mark.fuzz
@pytest.mark.parametrize("name", NAMES)
def test_numbers_become_numbers(name, tmp_path, monkeypatch, pytestconfig):
    monkeypatch.chdir(tmp_path)
    warnings.simplefilter("ignore")
    seed = pytestconfig.getoption("hypothesis_seed")
    assert not try_extremes(name, tmp_path, 20, 0 if seed is None else int(seed))

"""Public kernels return a result or an error that names the argument, for any argument, soon and in little memory."""

from __future__ import annotations

import dataclasses
import inspect
import itertools
import math
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import Any, TypeAlias

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.sparse import eye_array

from combinations import rotate
from hostile import DTYPES, LAYOUTS, NUMBERS, OTHERS, VALUES, lay_out
from texrs import kernels
from texrs.errors import TexrsError
from texrs.kernels.gather import gather
from texrs.kernels.inpaint import inpaint
from texrs.kernels.mean_shift import mean_shift
from texrs.kernels.ncc import Correlation
from texrs.kernels.patch_search import PatchIndex
from texrs.kernels.poisson import blend, solve, spread
from texrs.kernels.reconstruction import reconstruct
from texrs.kernels.regions import felzenszwalb
from texrs.kernels.seam import OldSeams, Strip, binary_labels, cut, cut_strip, cut_strips
from texrs.kernels.sparse import Cholesky
from texrs.kernels.warp import from_points, mesh

Array: TypeAlias = NDArray[Any]
Arguments: TypeAlias = dict[str, Any]

MEMORY = 2 << 30
"""Bytes that the tests of this file may use. Larger requests fail here, and do not disturb the machine."""


@pytest.fixture(scope="module", autouse=True)
def _limited_memory() -> Iterator[None]:
    if sys.platform != "linux":
        yield
        return
    import resource

    limits = resource.getrlimit(resource.RLIMIT_AS)
    with open("/proc/self/statm") as file:
        taken = int(file.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (taken + MEMORY, limits[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, limits)


# --- the calls, each with arguments that it takes --------------------------------------------------------------------

NOISE = np.random.default_rng(0).random((9, 10, 2), np.float32)
OTHER = np.random.default_rng(1).random((9, 10, 2), np.float32)
INSIDE = np.pad(np.ones((3, 4), bool), 3)
EVERYWHERE = np.ones((9, 10), bool)
PLACES = np.moveaxis(np.indices((6, 7)), 0, -1) * 1.25
CORNERS = np.array([[0, 0], [0, 5], [5, 0], [5, 5], [2, 3.0]])
MATRIX = eye_array(5, format="csr") * 2.0
INDEX = PatchIndex([NOISE, OTHER], max_patch=4)
SEAMS = [np.full((9, 10), 0.5, np.float32)] * 2
SOLVE: Arguments = {"screening": 0.1, "boundary": "free", "mask": INSIDE, "progress": None}
PICK: Arguments = {"count": 2, "separation": 1, "ratio": 4.0}
PATCH: Arguments = {"patch": NOISE[2:5, 3:6], "weight": np.ones((3, 3))}
CUT: Arguments = {
    "a": NOISE,
    "b": OTHER,
    "mask_a": EVERYWHERE,
    "mask_b": INSIDE,
    "core_a": ~INSIDE,
    "core_b": np.pad(np.ones((1, 2), bool), 4),
    "penalty": NOISE[..., 0],
    "old": None,
    "cost": "gradient",
    "wrap": False,
}


def cut_one(**fields: Any) -> object:
    return cut_strips([Strip(**fields)])


def cut_old(**fields: Any) -> object:
    return cut(**(CUT | {"old": OldSeams(**fields)}))


CALLS: Mapping[str, tuple[Callable[..., object], Arguments]] = {
    "inpaint.inpaint": (
        inpaint,
        {
            "colours": NOISE,
            "known": ~INSIDE,
            "index": INDEX,
            "patch_size": (3, 4),
            "keep": None,
            **PICK,
            "wrap": (True, False),
            "seed": 1,
            "paper": False,
            "shown": 0,
            "lattice": None,
            "progress": None,
        },
    ),
    "gather.gather": (
        gather,
        {
            "exemplars": [NOISE, OTHER[:5]],
            "coordinates": PLACES,
            "which": np.indices((6, 7)).sum(0) % 2,
            "interpolation": "cubic",
            "wrap": (True, False),
        },
    ),
    "mean_shift.mean_shift": (
        mean_shift,
        {
            "image": NOISE,
            "radius": 2,
            "range": 0.5,
            "max_iterations": 5,
            "tolerance": 0.1,
            "wrap": (False, True),
            "progress": None,
        },
    ),
    "ncc.Correlation": (Correlation, {"image": NOISE}),
    "ncc.Correlation.maps": (Correlation(NOISE).maps, {"template": OTHER[:3, :4]}),
    "patch_search.PatchIndex": (
        PatchIndex,
        {"images": [NOISE, OTHER[:7]], "allowed": [EVERYWHERE, None], "max_patch": (4, 5)},
    ),
    "patch_search.PatchIndex.again": (INDEX.again, {"allowed": [EVERYWHERE, None], "max_patch": 4}),
    "patch_search.PatchIndex.best": (INDEX.best, PATCH | PICK),
    "patch_search.PatchIndex.best_among": (INDEX.best_among, PATCH | PICK | {"candidates": [(0, 1, 2), (1, 3, 4)]}),
    "patch_search.PatchIndex.cost_map": (INDEX.cost_map, PATCH | {"exemplar": 1}),
    "poisson.solve": (
        solve,
        {"image": NOISE, "gradient_rows": OTHER, "gradient_columns": OTHER - 1, **SOLVE},
    ),
    "poisson.spread": (spread, {"flow": NOISE, **SOLVE}),
    "poisson.blend": (
        blend,
        {"source": NOISE, "target": OTHER, "mask": INSIDE, "screening": 0.0, "mixed": True, "wrap": False},
    ),
    "reconstruction.reconstruct": (
        reconstruct,
        {"seed": NOISE[..., 0] - 0.2, "mask": NOISE[..., 0], "wrap": (True, False)},
    ),
    "regions.felzenszwalb": (
        felzenszwalb,
        {"image": NOISE, "scale": 0.5, "blur": 0.4, "least": 5, "wrap": (False, True), "progress": None},
    ),
    "seam.cut": (cut, CUT),
    "seam.OldSeams": (cut_old, {"kept": SEAMS, "ab": SEAMS, "ba": SEAMS}),
    "seam.cut_strip": (
        cut_strip,
        {"a": NOISE, "b": OTHER, "axis": 1, "cyclic": True, "penalty": NOISE[..., 0], "cost": "paper"},
    ),
    "seam.Strip": (cut_one, {"a": NOISE, "b": OTHER, "axis": 0, "penalty": NOISE[..., 0]}),
    "seam.cut_strips": (cut_strips, {"strips": [Strip(NOISE, OTHER, 1)], "cyclic": False, "cost": "gradient"}),
    "seam.binary_labels": (
        binary_labels,
        {"unary": NOISE, "pairwise": [0.3, (NOISE[..., 0], 0.5)], "wrap": (False, True)},
    ),
    "sparse.Cholesky": (Cholesky, {"matrix": MATRIX, "limit": 1 << 20}),
    "sparse.Cholesky.several": (Cholesky.several, {"matrices": [MATRIX, np.eye(3)], "limit": 1 << 20}),
    "sparse.Cholesky.solve": (Cholesky(MATRIX).solve, {"sides": np.ones((5, 2))}),
    "warp.mesh": (
        mesh,
        {
            "target": PLACES,
            "weight": np.indices((6, 7)).sum(0) % 2,
            "void": np.zeros((6, 7), bool),
            "size": (8, 9),
            "progress": None,
        },
    ),
    "warp.from_points": (from_points, {"source": CORNERS, "target": CORNERS + 1, "shape": (6, 6), "size": 8}),
}


ALSO = {"seam.OldSeams": ("old",), "sparse.Cholesky.several": ("matrix",)}
"""Other names of an argument in messages, for its parts."""


def public_calls() -> dict[str, Callable[..., object]]:
    """Return the public functions of the kernels, and the dataclasses that are passed to them, by name."""
    found: dict[str, Callable[..., object]] = {}
    data = {}
    for module in kernels.__all__:
        for name in getattr(kernels, module).__all__:
            thing, full = getattr(getattr(kernels, module), name), f"{module}.{name}"
            if inspect.isfunction(thing):
                found[full] = thing
            elif inspect.isclass(thing) and dataclasses.is_dataclass(thing):
                data[full] = thing
            elif inspect.isclass(thing):
                found[full] = thing
                for method, _ in inspect.getmembers(thing, inspect.isroutine):
                    if not method.startswith("_"):
                        found[f"{full}.{method}"] = getattr(thing, method)
    taken = " ".join(str(p.annotation) for call in found.values() for p in parameters(call))
    return found | {name: thing for name, thing in data.items() if re.search(rf"\b{thing.__name__}\b", taken)}


def parameters(call: Callable[..., object]) -> list[inspect.Parameter]:
    return [p for p in inspect.signature(call).parameters.values() if p.name != "self"]


def test_no_argument_of_a_kernel_is_left_out() -> None:
    assert {name: {p.name for p in parameters(call)} for name, call in public_calls().items()} == {
        name: set(arguments) for name, (_, arguments) in CALLS.items()
    }


# --- hostile values --------------------------------------------------------------------------------------------------


@st.composite
def shapes(draw: st.DrawFn, like: tuple[int, ...]) -> tuple[int, ...]:
    """Draw the shape of an array, a shape that differs by one step, any shape, or one larger than any memory."""
    kind = draw(st.sampled_from(("same", "same", "any", "one side", "one axis less", "one axis more", "huge")))
    sides = st.sampled_from((0, 1, 2, 3, 9))
    axis = draw(st.integers(0, max(len(like) - 1, 0)))
    if kind == "any" or not like:
        return tuple(draw(st.lists(sides, max_size=5)))
    if kind == "one side":
        return (*like[:axis], draw(sides), *like[axis + 1 :])
    if kind == "one axis less":
        return (*like[:axis], *like[axis + 1 :])
    if kind == "one axis more":
        return (*like[:axis], draw(sides), *like[axis:])
    if kind == "huge":
        last = like[-1:] if len(like) > 1 and draw(st.booleans()) else ()
        axes = len(like) - len(last)
        return (2 ** (52 // axes),) * axes + last
    return like


@st.composite
def arrays(draw: st.DrawFn, like: Array) -> Array:
    """Draw an array that is partly valid."""
    shape = draw(shapes(like.shape))
    dtype = np.dtype(draw(st.sampled_from((like.dtype.str, like.dtype.str, *DTYPES))))
    value = draw(st.sampled_from((None, *VALUES)))
    with np.errstate(all="ignore"):
        one = np.zeros((), dtype)
        if value is not None and dtype.kind in "buif":
            one = np.asarray(value, np.float64).astype(dtype)
        elif dtype.kind in "OU":
            one = np.asarray(value).astype(dtype)
        if math.prod(shape) > 2**20:
            return np.broadcast_to(one, shape)
        array = np.resize(like, shape).astype(dtype) if dtype.kind in "buifcO" and like.size else np.zeros(shape, dtype)
    if array.size and value is not None:
        if draw(st.booleans()):
            array[...] = one
        else:
            array.flat[draw(st.integers(0, array.size - 1))] = one
    layout = draw(st.sampled_from(LAYOUTS if array.size and dtype.kind in "buif" else LAYOUTS[:1]))
    return np.broadcast_to(array[(0,) * array.ndim], shape) if layout == "broadcast" else lay_out(array, layout)


def hostile(valid: object) -> st.SearchStrategy[object]:
    """Return a strategy for replacements of a valid value, or of one of its items."""
    drawn: list[st.SearchStrategy[object]] = [
        st.sampled_from(NUMBERS),
        st.sampled_from(OTHERS),
        st.lists(st.sampled_from(NUMBERS), min_size=1, max_size=3),
        st.lists(st.sampled_from(NUMBERS), min_size=2, max_size=2).map(tuple),
    ]
    if isinstance(valid, np.ndarray):
        drawn += [arrays(valid)] * 4
    elif isinstance(valid, list | tuple):
        for i, item in enumerate(valid):
            around = valid[:i], valid[i + 1 :]
            several = type(valid)
            drawn += [
                hostile(item).map(lambda new, around=around, several=several: several((*around[0], new, *around[1])))
            ] * 2
    else:
        drawn.append(arrays(np.ones((3, 3), np.float32)))
    return st.one_of(drawn)


@cache
def instead_of(name: str, argument: str) -> st.SearchStrategy[object]:
    return hostile(CALLS[name][1][argument])


PAIRS = [(name, argument) for name, (_, arguments) in CALLS.items() for argument in arguments]


@pytest.mark.timeout(120)
@pytest.mark.parametrize(("name", "argument"), PAIRS, ids=[f"{n}-{a}" for n, a in PAIRS])
@settings(max_examples=settings.default.max_examples // 2)
@given(data=st.data())
def test_a_hostile_argument_gives_a_result_or_is_named(name: str, argument: str, data: st.DataObject) -> None:
    call, arguments = CALLS[name]
    value = data.draw(instead_of(name, argument), argument)
    given = {n: v.copy() if isinstance(v, np.ndarray) else v for n, v in arguments.items()} | {argument: value}
    said = ""
    try:
        call(**given)
    except TexrsError as error:
        said = str(error)
    # Numbers that are valid by themselves may be refused because they do not fit other arguments, which the message
    # may name instead.
    alone = not isinstance(value, np.ndarray | list | tuple | int | float)
    names = (*((argument,) if alone else arguments), *ALSO.get(name, ()))
    assert not said or any(re.search(rf"\b{n}\b", said) for n in names), said


def equal(a: Any, b: Any) -> bool:
    if dataclasses.is_dataclass(a):
        return all(equal(getattr(a, f.name), getattr(b, f.name)) for f in dataclasses.fields(a))
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(itertools.starmap(equal, zip(a, b, strict=True)))
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and bool(np.array_equal(a, b, equal_nan=a.dtype.kind == "f"))
    return type(a).__module__.startswith("texrs") or bool(a == b)


def list_layouts() -> list[tuple[str, str, str]]:
    """Return all array arguments of each kernel, and all layouts for each kernel."""
    found = []
    for name in CALLS.keys() - {"poisson.spread"}:
        arrays = [a for n, a in PAIRS if n == name and isinstance(CALLS[n][1][a], np.ndarray)]
        found += [(name, *pair) for pair in rotate(arrays, LAYOUTS[1:-1])]
    return sorted(found)


@pytest.mark.parametrize(("name", "argument", "layout"), list_layouts())
def test_a_layout_in_memory_does_not_matter(name: str, argument: str, layout: str) -> None:
    call, arguments = CALLS[name]
    assert equal(call(**arguments), call(**(arguments | {argument: lay_out(arguments[argument], layout)})))

"""Unsuitable values for arguments, and valid calls, taken from the examples of the documentation."""

from __future__ import annotations

import contextlib
import doctest
import inspect
import io
import math
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, is_dataclass
from decimal import Decimal
from enum import Enum
from fractions import Fraction
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from scipy.sparse import coo_array, csr_array

import texrs
from texrs.exemplar._exemplar import _FACTS

NUMBERS: tuple[object, ...] = (
    *(True, -1, 0, 1, 2, 7, 2**31 - 1, 2**31, 2**32, 2**63, 2**64, 10**400),
    *(0.5, -0.5, 1e-300, 1e300, math.nan, math.inf, -math.inf),
    *(np.int8(-1), np.uint64(2**64 - 1), np.float16(np.inf), np.float32(np.nan), np.array(3)),
    *(1j, Fraction(1, 3), Decimal(1)),
)
OTHERS: tuple[object, ...] = (
    *("", "nearest", "free", "\0", b"paper", object(), slice(None), range(2**60)),
    *([], (), {}, {0: 1}, [[1], [1, 2]], [None], [[]], ["a", "b"], [[[]]], csr_array((0, 3)), csr_array((3, 4))),
    *(
        coo_array((2**40, 2**40)),
        np.ma.masked_all((9, 10)),
        np.recarray((3,), dtype=[("x", "f4")]),
        np.datetime64(0, "s"),
    ),
)
DTYPES = (
    "?",
    "u1",
    "i1",
    "u2",
    "i4",
    "i8",
    "u8",
    "f2",
    "f4",
    "f8",
    "g",
    "c16",
    "O",
    "U2",
    "S2",
    "M8[s]",
    "V4",
    "f4,f4",
)
VALUES = (0, 1, -1, 0.5, -0.5, 255, 2**31, -(2**31), 2**63, 1e-45, 1e300, math.nan, math.inf, -math.inf)
LAYOUTS = ("plain", "fortran", "strided", "reversed", "swapped", "read-only", "unaligned", "broadcast")
MORE: tuple[object, ...] = (
    None,
    *((1, 2), (1, 2, 3), [0.5, math.nan], (0, 0), (10**9, 10**9), (-1, 5), "auto", "paper", "no such word", "x" * 5000),
    *(
        Path("nowhere"),
        Path(),
        {"a": np.zeros(3)},
        {1, 2},
        frozenset(),
        iter([1]),
        Ellipsis,
        NotImplemented,
        bytearray(3),
    ),
    *(
        int,
        np.float32,
        len,
        lambda: None,
        lambda one: None,
        lambda a, b, c: None,
        type("Odd", (), {"__len__": lambda s: -1})(),
    ),
    *(
        np.zeros((0, 3)),
        np.zeros((2, 2, 2, 2, 2)),
        np.zeros(()),
        np.array(["a"]),
        np.array([None]),
        np.matrix([[1, 2]]),
    ),
    *(memoryview(b"abc"), np.dtype("f4"), Exception("no"), texrs, sys),
)


def lay_out(array: np.ndarray[Any, Any], layout: str) -> np.ndarray[Any, Any]:
    """Return the same values in another memory layout."""
    if layout == "fortran":
        return np.asfortranarray(array)
    if layout == "strided":
        return np.repeat(array[..., np.newaxis], 2, axis=-1)[..., 0]
    if layout == "reversed":
        return np.ascontiguousarray(array[::-1])[::-1] if array.ndim else array
    if layout == "swapped":
        return array.astype(array.dtype.newbyteorder())
    if layout == "read-only":
        array = array.copy()
        array.flags.writeable = False
    if layout == "unaligned":
        raw = np.zeros(array.nbytes + 1, np.uint8)[1:]
        raw[:] = np.frombuffer(array.tobytes(), np.uint8)
        return raw.view(array.dtype).reshape(array.shape)
    return array


def distort(array: np.ndarray[Any, Any]) -> Iterator[object]:
    """Yield variants of a valid array: its values in every dtype and layout, other shapes, other values."""
    for dtype in map(np.dtype, DTYPES):
        with np.errstate(all="ignore"):
            yield array.astype(dtype) if dtype.kind in "buifcO" else np.zeros(array.shape, dtype)
    yield from (lay_out(array, layout) for layout in LAYOUTS if array.size)
    yield from (array[:0], array[..., np.newaxis], array[np.newaxis], array[..., :1], array.ravel(), array.tolist())
    yield from (array[0] if len(array) else array, array[:1], np.broadcast_to(array.dtype.type(0), (2**20,) * 2))
    yield np.broadcast_to(array[:1], (2**30, *array.shape[1:])) if array.ndim and len(array) else array
    yield np.ma.masked_array(array, True)
    if array.dtype.kind == "f" and array.size:
        for value in (math.nan, math.inf, -1.0, 1e30):
            changed = array.copy()
            changed.flat[0] = value
            yield changed


EXTREMES = (
    0.0,
    0.5,
    -1.0,
    1e-40,
    65504.0,
    -65504.0,
    1e15,
    1e30,
    -1e30,
    1.6e38,
    3.4e38,
    -3.4e38,
    1e150,
    1.7e308,
    -1.7e308,
)
"""Numbers whose sums, products or powers are not finite in some dtype."""


def exaggerate(valid: object, rng: np.random.Generator) -> object:
    """Return floats of some dtype in place of valid values: a few, half or all of them are extreme."""
    if isinstance(valid, list | tuple) and valid and all(isinstance(each, np.ndarray) for each in valid):
        return type(valid)(exaggerate(each, rng) for each in valid)
    if not isinstance(valid, np.ndarray) or valid.dtype.kind not in "fu" or not valid.size:
        return valid
    kind = np.dtype(("f2", "f4", "f8")[rng.integers(3)])
    ends = [each for each in EXTREMES if abs(each) <= np.finfo(kind).max]
    there = rng.random(valid.shape) < (0.02, 0.5, 1)[rng.integers(3)]
    return np.where(there, rng.choice(ends, valid.shape), np.clip(valid.astype("f8"), -60000, 60000)).astype(kind)


def list_floats(made: object) -> Iterator[np.ndarray[Any, Any]]:
    """Yield the floats in a result."""
    if isinstance(made, np.ndarray | float):
        if np.asarray(made).dtype.kind == "f":
            yield np.asarray(made)
    elif isinstance(made, list | tuple):
        for each in made:
            yield from list_floats(each)
    elif isinstance(made, dict):
        yield from list_floats(list(made.values()))
    elif is_dataclass(made):
        yield from list_floats([getattr(made, field.name) for field in fields(made)])


def list_hostile(valid: object) -> Iterator[object]:
    """Yield the replacements of a valid value."""
    yield from NUMBERS
    yield from OTHERS
    yield from MORE
    if isinstance(valid, np.ndarray) and valid.ndim:
        yield from distort(valid)
    if isinstance(valid, list | tuple):
        yield from (type(valid)([each]) for each in (None, "a", math.nan, object(), 2**70))
        yield from (type(valid)([each] * len(valid)) for each in (None, "a", math.nan, 10**9, -1))
        if valid and isinstance(valid[0], np.ndarray):
            yield from ([each] for each in distort(valid[0]))


# --- calls that are right ----------------------------------------------------------------------------------------------

SOLID = "texrs.SolidTexture(texrs.samples.stripes((32, 32, 32)).image, quality='fast')"
TILES = "texrs.CornerTiles(texrs.samples.pebbles((96, 96)).image, 32)"
MAPS = "texrs.Material({'albedo': texrs.samples.stripes((32, 32, 32)).image}, axes=3)"
FINDER, LABELS = "texrs.exemplar.element_finder", "numpy.zeros((9, 10), numpy.int32)"
EXAMPLES = {
    "texrs.SolidTexture.window": f"{SOLID}.window((-3, 4, 5), (6, 7, 8))",
    "texrs.SolidTexture.estimate_memory": f"{SOLID}.estimate_memory(64)",
    "texrs.SolidTexture.sample": f"{SOLID}.sample([[3, 4, 5.5]])",
    "texrs.SolidTexture.sample_maps": f"texrs.SolidTexture({MAPS}, quality='fast').sample_maps([[3, 4, 5.5]])",
    "texrs.SolidTexture.trace": f"{SOLID}.trace([[3, 4, 5.5]])",
    "texrs.SolidTexture.to_dask": f"{SOLID}.to_dask((6, 7, 8), 16, origin=(-3, 4, 5))",
    "texrs.SolidTexture.to_zarr": f"{SOLID}.to_zarr('solid.zarr', (6, 7, 8), 16, origin=(-3, 4, 5))",
    "texrs.SolidTexture.to_file": f"{SOLID}.to_file('solid.npy', (6, 7, 8), 16, origin=(-3, 4, 5))",
    "texrs.CornerTiles.to_dask": f"{TILES}.to_dask((40, 50), 32, origin=(-3, 5))",
    "texrs.CornerTiles.to_zarr": f"{TILES}.to_zarr('tiles.zarr', (40, 50), 32, origin=(-3, 5))",
    "texrs.CornerTiles.to_file": f"{TILES}.to_file('tiles.npy', (40, 50), 32, origin=(-3, 5))",
    "texrs.Material.get": f"{MAPS}.get('height', None)",
    "texrs.Material.__contains__": f"'height' in {MAPS}",
    "texrs.TextureDatabase.__getitem__": "texrs.TextureDatabase('base')['rock']",
    "texrs.TextureDatabase.__contains__": "'rock' in texrs.TextureDatabase('base')",
    "texrs.exemplar.Analysis": "texrs.exemplar.Analysis(texrs.Exemplar(texrs.samples.dots((32, 32)).image).analyse().levels)",
    "texrs.exemplar.element_finder.Element": f"{FINDER}.Element((1.5, 2.5), 0.0, 1.0, 24, 0.9, False)",
    "texrs.exemplar.element_finder.FoundElements": f"{FINDER}.FoundElements({LABELS}, (), 'none', 0.9, {{'none': 0.9}})",
}
"""Calls that are not in the examples of the documentation, mostly of methods that classes share."""


def public_modules() -> list[ModuleType]:
    """Return all public modules."""
    found, left = [], [texrs]
    while left:
        module = left.pop()
        found.append(module)
        left += [m for m in (getattr(module, n) for n in module.__all__) if isinstance(m, ModuleType)]
    return sorted(found, key=lambda m: m.__name__)


OPERATORS = ("__getitem__", "__contains__", "__call__")
"""Special methods without another name."""


@cache
def public_calls() -> dict[str, tuple[Callable[..., Any], Callable[..., Any]]]:
    """Return all public functions, classes and methods by name, each with the function that has its code."""
    found: dict[str, tuple[Callable[..., Any], Callable[..., Any]]] = {}
    seen = set()
    for module in public_modules():
        for name in module.__all__:
            thing, full = getattr(module, name), f"{module.__name__}.{name}"
            if id(thing) in seen or (inspect.isclass(thing) and issubclass(thing, BaseException | type)):
                continue
            seen.add(id(thing))
            if inspect.isfunction(thing):
                found[full] = thing, thing.request.__init__ if hasattr(thing, "request") else inspect.unwrap(thing)
            elif inspect.isclass(thing):
                if inspect.isfunction(thing.__init__) and not issubclass(thing, Enum):
                    found[full] = thing, thing.__init__
                for method, value in inspect.getmembers(thing):
                    own = inspect.getattr_static(thing, method)
                    if (
                        (method.startswith("_") and method not in OPERATORS)
                        or not inspect.isroutine(value)
                        or not inspect.isroutine(own)
                    ):
                        continue
                    call = own.__func__ if isinstance(own, classmethod | staticmethod) else value
                    if inspect.isfunction(call):
                        found[f"{full}.{method}"] = value, inspect.unwrap(call)
    return found


@contextlib.contextmanager
def keep_folders(place: Path) -> Iterator[None]:
    """Keep temporary folders, in another place."""

    class Folder:
        def __init__(self, *args: object, **options: object) -> None:
            self.name = tempfile.mkdtemp(dir=place)

        def __enter__(self) -> str:
            return self.name

        def __exit__(self, *failure: object) -> None:
            pass

        def cleanup(self) -> None:
            pass

    before, tempfile.TemporaryDirectory = tempfile.TemporaryDirectory, Folder  # type: ignore[assignment,misc]
    try:
        yield
    finally:
        tempfile.TemporaryDirectory = before  # type: ignore[misc]


@dataclass(frozen=True)
class Call:
    """A valid call."""

    name: str
    function: Callable[..., Any]
    arguments: dict[str, Any]

    def change(self, name: str, value: object) -> object:
        """Call with another value of one argument."""
        return self.call(self.arguments | {name: value})

    def call(self, given: dict[str, Any]) -> object:
        """Call with these arguments."""
        positional, named = [], {}
        for p in inspect.signature(self.function).parameters.values():
            if p.name not in given:
                continue
            if p.kind is p.VAR_POSITIONAL:
                positional += given[p.name]
            elif p.kind is p.VAR_KEYWORD:
                named |= given[p.name]
            elif p.kind is p.KEYWORD_ONLY:
                named[p.name] = given[p.name]
            else:
                positional.append(given[p.name])
        made = self.function(*positional, **named)
        if inspect.isgenerator(made):
            # A generator computes its values on request, so request one.
            made = next(made, None)
        if isinstance(made, contextlib.AbstractContextManager) and hasattr(made, "gen"):
            with made:
                pass
        return made


def record(name: str, place: Path) -> Call | None:
    """Run the examples of a function, and return the last call of it, or None without arguments."""
    thing, function = public_calls()[name]
    found: dict[str, Any] = {}
    # Find the class of a method, because examples of the method may be in the docstring of its class.
    owner = public_calls().get(name.rpartition(".")[0], (None, None))[0]

    def note(frame: Any, event: str, argument: object) -> None:
        if event == "call" and frame.f_code is function.__code__:
            me = frame.f_locals.get("self")
            if me is None or not inspect.isclass(owner) or isinstance(me, owner):
                # Record only calls for objects of the class. An inherited method is also called for others, such as
                # `Mapping.get` for the environment.
                found.clear()
                found.update(frame.f_locals)

    if not set(inspect.signature(thing).parameters) - {"self"}:
        return None
    # Clear the cache of facts about exemplars. Otherwise the measuring functions would not be called again.
    _FACTS.clear()
    space: dict[str, Any] = {**function.__globals__, "__name__": "__main__"}
    own = f">>> import numpy, texrs\n>>> made = {EXAMPLES[name]}\n" if name in EXAMPLES else None
    for text in (own, inspect.getdoc(thing), inspect.getdoc(owner) if owner is not None else None):
        with keep_folders(place), contextlib.redirect_stdout(io.StringIO()):
            for example in doctest.DocTestParser().get_examples(text or ""):
                code = compile(example.source, "<example>", "single")
                # Some examples show an error of texrs.
                with contextlib.suppress(texrs.errors.TexrsError):
                    sys.setprofile(note)
                    try:
                        exec(code, space)
                    finally:
                        sys.setprofile(None)
        if found:
            break
    else:
        raise LookupError(f"{name}: no example calls it, nor one of EXAMPLES")
    if inspect.isclass(thing) or hasattr(thing, "request"):
        found.pop("self", None)
    elif "self" in found:
        thing = getattr(found.pop("self"), function.__name__)
    found.pop("cls", None)
    known = inspect.signature(thing).parameters
    return Call(name, thing, {n: value for n, value in found.items() if n in known})

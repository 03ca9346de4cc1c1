"""The kernels of the element finder: unsuitable arguments give errors, and threads do not change results."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
import pytest
from numpy.typing import NDArray

import texrs
from texrs import _rust
from texrs.errors import TexrsError

Array: TypeAlias = NDArray[Any]

# Noise has many regions, and sums of its values depend on their order.
RNG = np.random.default_rng(0)
SHAPE = (150, 140)
NOISE, OTHER = (RNG.random(SHAPE, np.float32) for _ in range(2))
WORDS = RNG.integers(0, 9, SHAPE, np.uint8)
LABELS, COUNT = _rust.watershed_regions(NOISE, 2)
PAIRS, ARCS, EXTREMES = _rust.region_adjacency(LABELS, NOISE, COUNT, 0.5)
AREA = np.bincount(LABELS.ravel()).astype(np.float64)
COSTS = [(1.0, 0.0, 0.0), (1.0, 0.5, 60.0), (0.0, 1.0, 60.0)]
TREES = (AREA, RNG.random((COUNT, 3)), PAIRS, np.ascontiguousarray(ARCS[:, :2]), RNG.random(COUNT) < 0.2)
STARTS, MEMBERS, SEAMS = _rust.region_candidates(*TREES, COSTS, 20.0, 900.0)
SQUARES = (np.arange(150)[:, None] // 12 * 12 + np.arange(140) // 12 + 1).astype(np.int32)

CALLS: dict[str, tuple[Callable[..., object], tuple[Any, ...]]] = {
    "contour_strength": (_rust.contour_strength, (WORDS, 9, 1.5)),
    "watershed_regions": (_rust.watershed_regions, (NOISE, 2)),
    "region_adjacency": (_rust.region_adjacency, (LABELS, NOISE, COUNT, 0.5)),
    "region_candidates": (_rust.region_candidates, (*TREES, COSTS, 20.0, 900.0)),
    "measure_regions": (
        _rust.measure_regions,
        (STARTS, MEMBERS, PAIRS, ARCS, RNG.random((COUNT, 9), np.float32), EXTREMES),
    ),
    "sum_regions": (_rust.sum_regions, (STARTS, MEMBERS, RNG.random((COUNT, 7)))),
    "choose_disjoint": (_rust.choose_disjoint, (STARTS, MEMBERS, RNG.random(len(SEAMS)) - 0.2, SEAMS, 4)),
    "refine_outlines": (_rust.refine_outlines, (SQUARES, NOISE - 0.5, OTHER, 0.6, [3] * 200)),
}
REFUSED = (TexrsError, TypeError, ValueError, OverflowError, MemoryError)
"""The last four are raised by the conversion of arguments. A panic is none of them."""
FINITE = {
    *(("watershed_regions", 0), ("region_adjacency", 1), ("region_adjacency", 3), ("measure_regions", 4)),
    *(("region_candidates", i) for i in (0, 1, 3, 5, 6, 7)),
    *(("refine_outlines", i) for i in (1, 2, 3)),
    *(("measure_regions", i) for i in (3, 5)),
    *(("contour_strength", 2),),
}
"""Arguments that must be numbers. Worths and sums may be NaN."""


def as_bytes(result: object) -> list[bytes]:
    """Return the bytes of all arrays and numbers of a result."""
    return [np.asarray(each).tobytes() for each in (result if isinstance(result, tuple) else (result,))]


def change_array(array: Array) -> dict[str, Array]:
    """Return arrays that differ from a valid array in shape, layout or values."""
    found = {
        "empty": array[:0],
        "one": array[:1],
        "one of each axis": array[(slice(1),) * array.ndim].copy(),
        "longer": np.concatenate([array, array[:1]]),
        "strided": np.repeat(array, 2, axis=-1)[..., ::2],
        "fortran": np.asfortranarray(array),
        "broadcast": np.broadcast_to(array.ravel()[0], array.shape),
        "one axis more": array[None],
        "another type": array.astype(np.complex64),
    }
    if array.ndim == 2:
        found |= {"no columns": array[:, :0].copy(), "one column": array[:, :1].copy()}
        found |= {"wide": np.zeros((0, 2**59 // array.itemsize), array.dtype)}
    limits: Any = np.finfo(array.dtype) if array.dtype.kind == "f" else None
    if array.dtype.kind in "iu":
        limits = np.iinfo(array.dtype)
    if limits is not None:
        values = [limits.max, limits.min, 0, -1] if array.dtype.kind != "u" else [limits.max, 0]
        values += [np.nan, np.inf, -np.inf, 1e-30] if array.dtype.kind == "f" else []
        for value in values:
            found[f"a value {value}"], found[f"all {value}"] = array.copy(), np.full_like(array, value)
            found[f"a value {value}"].flat[array.size // 2] = value
    return found


def change(value: object) -> dict[str, object]:
    """Return unsuitable values instead of a valid one."""
    if isinstance(value, np.ndarray):
        return dict(change_array(value))
    if isinstance(value, list):
        return {"empty": [], "short": value[:1], "large": [2**40] * len(value), "negative": [-1], "pairs": [(1, 2)]}
    numbers = (0, -1, 1, 2**31, 2**32 - 1, 2**62, 2**64 - 1, 2**64, 1e-300, 1e300, np.nan, np.inf, -np.inf)
    return {str(number): number for number in numbers} | {"none": None, "text": "x"}


PLACES = [(name, i, case) for name, (_, values) in CALLS.items() for i, v in enumerate(values) for case in change(v)]


@pytest.mark.timeout(60)
@pytest.mark.parametrize(("name", "place", "case"), PLACES, ids=[f"{n}-{i}-{c}" for n, i, c in PLACES])
def test_an_unsuitable_argument_gives_a_result_or_an_error(name: str, place: int, case: str) -> None:
    call, values = CALLS[name]
    message = ""
    try:
        call(*values[:place], change(values[place])[case], *values[place + 1 :])
    except REFUSED as error:
        message = str(error)
    # A message has several words.
    assert not message or len(message.split()) > 2
    refused = case in ("strided", "another type", "one axis more")
    refused |= case in ("nan", "a value nan", "all nan") and (name, place) in FINITE
    assert message or not refused


@pytest.mark.parametrize("name", CALLS)
def test_threads_do_not_change_a_result(name: str) -> None:
    call, values = CALLS[name]
    results = []
    for threads in (1, 2, 7):
        with texrs.threads(threads):
            results.append(as_bytes(call(*values)))
    assert results[0] == results[1] == results[2]
    assert any(any(part) for part in results[0])


def test_empty_images_have_empty_results() -> None:
    for shape in ((0, 0), (0, 5), (5, 0)):
        nothing = np.zeros(shape, np.float32)
        labels, count = _rust.watershed_regions(nothing, 2)
        assert labels.shape == shape
        assert count == 0
        assert _rust.contour_strength(nothing.astype(np.uint8), 3, 1.0).shape == shape
        assert [len(each) for each in _rust.region_adjacency(labels, nothing, 0, 0.5)] == [0, 0, 0]
        assert _rust.refine_outlines(nothing.astype(np.int32), nothing, nothing, 0.5, []).shape == shape


def test_one_pixel_is_one_region() -> None:
    one = np.ones((1, 1), np.float32)
    labels, count = _rust.watershed_regions(one, 2)
    assert (labels.tolist(), count) == ([[0]], 1)
    pairs, arcs, extremes = _rust.region_adjacency(labels, one, 1, 0.5)
    assert pairs.shape == (0, 2)
    assert not extremes.any()
    found = _rust.region_candidates(np.ones(1), np.zeros((1, 3)), pairs, arcs[:, :2].copy(), labels[0] < 0, [], 1, 1)
    assert [each.tolist() for each in found] == [[0, 1], [0], [0.0]]
    assert _rust.refine_outlines(np.ones((1, 1), np.int32), one, one, 0.5, [0, 9]).tolist() == [[1]]

"""Fewer combinations of values than a full product, but all that two values can do to each other."""

from collections.abc import Sequence
from typing import Any


def rotate(first: Sequence[Any], second: Sequence[Any]) -> list[tuple[Any, Any]]:
    """Return as few pairs as contain each value of both lists. An empty list gives no pairs."""
    count = max(len(first), len(second)) if first and second else 0
    return [(first[i % len(first)], second[i % len(second)]) for i in range(count)]


def pairwise(first: Sequence[Any], second: Sequence[Any], third: Sequence[Any]) -> list[tuple[Any, Any, Any]]:
    """Return triples that contain all pairs of values of any two lists. The third list must be the shortest."""
    assert len(third) <= min(len(first), len(second))
    return [(a, b, third[(i + j) % len(third)]) for i, a in enumerate(first) for j, b in enumerate(second)]

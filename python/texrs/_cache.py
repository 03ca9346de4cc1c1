"""Cache recent results by the values that they were computed from."""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

import cachetools
import numpy as np

K = TypeVar("K", bound=Hashable)
V = TypeVar("V")


class Cache(Generic[K, V]):
    """Cache of values by key. If it is full, the least recently used values are removed first.

    Parameters
    ----------
    limit : int
        Maximum total size of all values. A single larger value is not stored.
    size : callable, optional
        Function that returns the size of a value, such as its number of bytes. Default: each value has size 1.

    """

    def __init__(self, limit: int, size: Callable[[V], int] | None = None) -> None:
        self._kept: cachetools.LRUCache[K, V] = cachetools.LRUCache(limit, size)
        self._lock = threading.Lock()

    @property
    def used(self) -> int:
        """Total size of the stored values."""
        return int(self._kept.currsize)

    def get(self, key: K) -> V | None:
        """Return the value of a key, or None if it is not stored."""
        with self._lock:
            return self._kept.get(key)

    def put(self, key: K, value: V) -> None:
        """Store a value."""
        with self._lock:
            if self._kept.getsizeof(value) <= self._kept.maxsize:
                self._kept[key] = value

    def get_or_make(self, key: K, make: Callable[[], V]) -> V:
        """Return the value of a key. If it is not stored, compute and store it.

        Two threads can compute the same value at once, because no lock is held during the computation.
        """
        found = self.get(key)
        if found is None:
            found = make()
            self.put(key, found)
        return found

    def clear(self) -> None:
        """Remove all values."""
        with self._lock:
            self._kept.clear()


def content_hash(*parts: object) -> bytes:
    """Return a hash of the shape, dtype and values of arrays, and of the `repr` of other objects."""
    digest = hashlib.blake2b(digest_size=16, person=b"texrs")
    for part in parts:
        if isinstance(part, np.ndarray):
            digest.update(repr((part.shape, part.dtype.str)).encode())
            digest.update(np.ascontiguousarray(part).data)
        else:
            digest.update(repr(part).encode())
        digest.update(b"\x00")
    return digest.digest()

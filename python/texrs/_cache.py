"""What was made lately, kept by what it was made from."""

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
    """Values by their keys, of which those that were not used for longest are dropped.

    Parameters
    ----------
    limit : int
        The most that the sizes of all values may add up to; a value that is larger on its own is not kept.
    size : callable, optional
        Returns the size of a value, as its bytes; by default each counts 1.

    """

    def __init__(self, limit: int, size: Callable[[V], int] | None = None) -> None:
        self._kept: cachetools.LRUCache[K, V] = cachetools.LRUCache(limit, size)
        self._lock = threading.Lock()

    @property
    def used(self) -> int:
        """What the sizes of the values add up to."""
        return int(self._kept.currsize)

    def get(self, key: K) -> V | None:
        """Return the value of a key, or None."""
        with self._lock:
            return self._kept.get(key)

    def put(self, key: K, value: V) -> None:
        """Keep a value."""
        with self._lock:
            if self._kept.getsizeof(value) <= self._kept.maxsize:
                self._kept[key] = value

    def get_or_make(self, key: K, make: Callable[[], V]) -> V:
        """Return the value of a key, made if it is not kept. Two threads may make it at once: no lock is held meanwhile."""
        found = self.get(key)
        if found is None:
            found = make()
            self.put(key, found)
        return found

    def clear(self) -> None:
        """Drop everything."""
        with self._lock:
            self._kept.clear()


def content_hash(*parts: object) -> bytes:
    """Return a hash of arrays, by their shape, dtype and values, and of other parts by their repr."""
    digest = hashlib.blake2b(digest_size=16, person=b"texrs")
    for part in parts:
        if isinstance(part, np.ndarray):
            digest.update(repr((part.shape, part.dtype.str)).encode())
            digest.update(np.ascontiguousarray(part).data)
        else:
            digest.update(repr(part).encode())
        digest.update(b"\x00")
    return digest.digest()

"""Results are cached by content, within a limit."""

import numpy as np

from texrs._cache import Cache, content_hash


def test_the_least_recently_used_goes_first() -> None:
    cache: Cache[str, bytes] = Cache(10, len)
    cache.put("a", b"1234")
    cache.put("b", b"1234")
    assert cache.get("a") == b"1234"
    cache.put("c", b"1234")
    assert cache.get("b") is None
    assert cache.get("a") is not None
    assert cache.used == 8


def test_what_is_too_large_is_not_kept() -> None:
    cache: Cache[str, bytes] = Cache(3, len)
    assert cache.get_or_make("a", lambda: b"1234") == b"1234"
    assert cache.get("a") is None
    none: Cache[str, bytes] = Cache(0, len)
    none.put("a", b"1")
    assert none.get("a") is None


def test_things_are_made_once() -> None:
    cache: Cache[str, list[int]] = Cache(4)
    first = cache.get_or_make("a", lambda: [1])
    assert cache.get_or_make("a", lambda: [2]) is first
    cache.clear()
    assert cache.get_or_make("a", lambda: [3]) == [3]


def test_content_is_shape_type_and_values() -> None:
    values = np.arange(6, dtype=np.int16)
    hashes = [
        content_hash(values),
        content_hash(values.reshape(2, 3)),
        content_hash(values.astype(np.uint16)),
        content_hash(values[::-1]),
        content_hash(values, 1),
        content_hash("a", "bc"),
        content_hash("ab", "c"),
    ]
    assert len(set(hashes)) == len(hashes)
    assert content_hash(values) == content_hash(np.stack([values, values], axis=1)[:, 0])

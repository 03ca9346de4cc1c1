"""How many threads the kernels use."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from texrs import _rust
from texrs._checks import as_int


@contextmanager
def threads(count: int | None = None) -> Iterator[None]:
    """Use ``count`` threads in the kernels that this thread calls inside the ``with`` block.

    Results do not depend on it.

    Parameters
    ----------
    count : int, optional
        1 to 1024. By default ``RAYON_NUM_THREADS``, or as many as there are cores.

    Yields
    ------
    None
        The former number is in force again where the block ends.

    Raises
    ------
    InvalidInput
        A count that is not an integer from 1 to 1024.

    Examples
    --------
    >>> import texrs
    >>> with texrs.threads(1):
    ...     result = texrs.design(texrs.samples.dots((64, 64)).image, 64)

    """
    before = _rust.set_threads(0 if count is None else as_int(count, "count", 1, 1024))
    try:
        yield
    finally:
        _rust.set_threads(before)

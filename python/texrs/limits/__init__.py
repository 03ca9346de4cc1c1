"""Limit the pixels, voxels, bytes of memory and seconds of calls, in one place.

Every verb compares its needs with these limits before it begins, and raises `texrs.errors.LimitExceeded` when its time
is up. By default, an array can have at most 2^28 pixels or voxels. Memory is limited by the machine, the container and
the limits of the process (`ulimit -v`, control groups). Time is not limited.

Limits are set in three ways. If several are set, the smallest applies:

- `context` for a block of code, in this thread or asynchronous task;
- `set` for the whole process;
- the environment variables ``TEXRS_PIXELS``, ``TEXRS_VOXELS``, ``TEXRS_MEMORY`` (bytes) and ``TEXRS_SECONDS``.

`estimate_memory` estimates the memory of a verb in advance.

>>> import texrs
>>> dots = texrs.samples.dots((64, 64)).image
>>> with texrs.limits.context(pixels=500_000):
...     texrs.design(dots, 1024)
Traceback (most recent call last):
    ...
texrs.errors.LimitExceeded: size: (1024, 1024) has 1048576 pixels, more than the limit of 500000; texrs.CornerTiles creates ...
"""

from texrs.limits.active import Limits, context, current, set
from texrs.limits.estimates import estimate_memory

__all__ = ["Limits", "context", "current", "estimate_memory", "set"]


def __dir__() -> list[str]:
    return __all__

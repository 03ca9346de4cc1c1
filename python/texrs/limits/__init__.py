"""Limits of what a call may take: pixels, voxels, bytes of memory and seconds, in one place.

Every verb compares what it needs with them before it begins, and stops with `texrs.errors.LimitExceeded` when its time is up.
Where nothing is said, an array may have 2^28 pixels or voxels, memory is what the machine, the container and the limits of the
process allow (`ulimit -v`, control groups), and there is no limit to the time.

They are said in three ways, of which the least holds:

- in a block of code, for what this thread, or this asynchronous task, does in it: `context`;
- for the whole process: `set`;
- from outside, in the environment: ``TEXRS_PIXELS``, ``TEXRS_VOXELS``, ``TEXRS_MEMORY`` (bytes) and ``TEXRS_SECONDS``.

`estimate_memory` tells beforehand what a verb takes.

>>> import texrs
>>> dots = texrs.samples.dots((64, 64)).image
>>> with texrs.limits.context(pixels=500_000):
...     texrs.design(dots, 1024)
Traceback (most recent call last):
    ...
texrs.errors.LimitExceeded: size: (1024, 1024) has 1048576 pixels, more than the limit of 500000; texrs.CornerTiles creates ...
"""

from texrs.limits._context import Limits, context, current, set
from texrs.limits._estimates import estimate_memory

__all__ = ["Limits", "context", "current", "estimate_memory", "set"]


def __dir__() -> list[str]:
    return __all__

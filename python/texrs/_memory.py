"""How much memory this process may take: the least of what the machine has, its container allows, and its limits say.

What is said in the environment, and by the process itself, is in `texrs.limits`.
"""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path, PurePosixPath

__all__ = ["find_memory"]

GROUPS = Path("/sys/fs/cgroup")
OWN = Path("/proc/self/cgroup")


def find_memory() -> int | None:
    """Return the bytes that this process may take in all, as far as anything tells.

    Examples
    --------
    >>> there = find_memory()
    >>> there is None or there > 2**20
    True

    """
    found = [*_read_machine(), *_read_limits(), *_read_groups(GROUPS, OWN)]
    return min(found, default=None)


def _read_machine() -> list[int]:
    with suppress(AttributeError, ValueError, OSError):
        there = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
        return [there] if there > 0 else []
    return []


def _read_limits() -> list[int]:
    """Return what ``ulimit -v`` and ``-d`` allow."""
    try:
        import resource
    except ImportError:  # Windows
        return []
    limits = (resource.getrlimit(kind)[0] for kind in (resource.RLIMIT_AS, resource.RLIMIT_DATA))
    return [limit for limit in limits if limit not in (resource.RLIM_INFINITY, -1)]


def _read_groups(root: Path, own: Path) -> list[int]:
    """Return what control groups of Linux allow, of either version: those that the process is in, and all above them.

    In a container the names may be those outside of it, where nothing lies; its own limit stands at the root then.
    """
    try:
        lines = own.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        return []
    found = []
    for line in lines:
        _, kinds, name = (*line.split(":", 2), "", "")[:3]
        if kinds and "memory" not in kinds.split(","):
            continue
        top, file = (root / "memory", "memory.limit_in_bytes") if kinds else (root, "memory.max")
        group = PurePosixPath(name.lstrip("/"))
        for step in (group, *group.parents):
            with suppress(OSError, ValueError):
                found.append(int((top / step / file).read_text(encoding="ascii")))
    return [limit for limit in found if limit > 0]

"""Find the memory that this process can use: the minimum of the limits of the machine, the container and the process.

`texrs.limits` handles the limits that users set.
"""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path, PurePosixPath

__all__ = ["find_memory"]

GROUPS = Path("/sys/fs/cgroup")
OWN = Path("/proc/self/cgroup")


def find_memory() -> int | None:
    """Return the number of bytes that this process can use in total, or None if unknown.

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
    """Return the limits of ``ulimit -v`` and ``ulimit -d`` in bytes."""
    try:
        import resource
    except ImportError:  # Windows does not have the module ``resource``.
        return []
    limits = (resource.getrlimit(kind)[0] for kind in (resource.RLIMIT_AS, resource.RLIMIT_DATA))
    return [limit for limit in limits if limit not in (resource.RLIM_INFINITY, -1)]


def _read_groups(root: Path, own: Path) -> list[int]:
    """Return the memory limits of the Linux control groups (versions 1 and 2) of the process and of all parent groups.

    Group names in a container can be names of the host, whose files do not exist there. The limit of the container is
    then at the root.
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

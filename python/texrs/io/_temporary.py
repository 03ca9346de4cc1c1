"""Files that are being made: their names, what dead processes have left of them, and how they take their place for good."""

from __future__ import annotations

import errno
import os
import platform
import re
import secrets
import shutil
import time
from contextlib import suppress
from functools import cache
from hashlib import blake2b
from pathlib import Path

__all__ = ["name_prefix", "name_temporary", "put", "settle", "sweep"]

_NAME = re.compile(r"\.texrs-(?P<home>[0-9a-f]{8})-(?P<process>[0-9]{1,10})-\w{8}(\.(?!former$).*)?", re.DOTALL)
"""What may be swept; a ``.former`` store is what somebody had, and perhaps all that is left of it."""
_WEEK = 7 * 24 * 3600.0
"""Seconds after which what another machine, or this one before it was started anew, has left counts as forgotten."""


def name_prefix() -> str:
    """Return how the names of what this process is making begin."""
    return f".texrs-{_find_home()}-{os.getpid()}-"


def name_temporary(final: Path, suffix: str) -> Path:
    """Return a name for what is to take a place; the first in a folder sweeps it."""
    sweep(os.fspath(final.parent))
    # Fixed and short: the name that it is to have may already be as long as names can be.
    return final.with_name(f"{name_prefix()}{secrets.token_hex(4)}{suffix}")


def put(temporary: Path, final: Path) -> None:
    """Let a file or a folder take a place, so that a loss of power leaves the former one there, or this one whole.

    Its bytes are on the disk before it has the name, and the name is before this returns, as far as the file system can
    tell.

    Raises
    ------
    OSError
        The disk cannot take it.

    """
    settle(temporary)
    os.replace(temporary, final)
    with suppress(OSError):
        _sync(final.parent)


def settle(path: Path) -> None:
    """Wait until a file, or all that is in a folder, is on the disk."""
    for folder, _, files in os.walk(path):
        for name in files:
            _sync(os.path.join(folder, name))
        _sync(folder)
    if not path.is_dir():
        _sync(path)


@cache
def sweep(folder: str) -> None:
    """Remove what processes that are gone have left in a folder, once."""
    try:
        names = os.listdir(folder)
    except OSError:
        return
    for name in names:
        found = _NAME.fullmatch(name)
        if found is None:
            continue
        path = os.path.join(folder, name)
        with suppress(OSError):
            mine = found["home"] == _find_home()
            if _is_gone(int(found["process"])) if mine else time.time() - os.lstat(path).st_mtime > _WEEK:
                if os.path.isdir(path) and not os.path.islink(path):
                    shutil.rmtree(path, ignore_errors=True)
                else:
                    os.unlink(path)


@cache
def _find_home() -> str:
    """Return what tells apart where numbers of processes mean the same: machines, their starts, and containers."""
    parts = [platform.node()]
    with suppress(OSError):
        parts.append(Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii"))
        parts.append(str(os.stat("/proc/self/ns/pid").st_ino))
    return blake2b("\n".join(parts).encode(), digest_size=4).hexdigest()


def _is_gone(process: int) -> bool:
    """Return whether surely no process has a number."""
    if os.name != "posix":  # Elsewhere os.kill would end it.
        return False
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return True
    except (OSError, OverflowError):
        return False
    return False


def _sync(path: str | os.PathLike[str]) -> None:
    """Wait until what a file or a folder holds is on the disk."""
    if os.name != "posix" and os.path.isdir(path):  # Windows opens none.
        return
    number = os.open(path, os.O_RDONLY if os.name == "posix" else os.O_RDWR)
    try:
        os.fsync(number)
    except OSError as error:
        # Some file systems cannot say.
        if error.errno not in (errno.EINVAL, errno.ENOTSUP, errno.EROFS):
            raise
    finally:
        os.close(number)

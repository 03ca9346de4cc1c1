"""Name temporary files, remove the temporary files of dead processes, and rename finished files."""

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
"""Names of temporary files that may be removed.

A ``.former`` store is excluded: it is a user's data, perhaps the only copy.
"""
_WEEK = 7 * 24 * 3600.0
"""Age in seconds after which a temporary file from another machine, or from before a restart, is removed."""


def name_prefix() -> str:
    """Return the prefix of the temporary names of this process."""
    return f".texrs-{_find_home()}-{os.getpid()}-"


def name_temporary(final: Path, suffix: str) -> Path:
    """Return a temporary name for a file. The first call for a folder also removes old temporary files there."""
    sweep(os.fspath(final.parent))
    # Keep the name short, because the final name may already have the maximum length.
    return final.with_name(f"{name_prefix()}{secrets.token_hex(4)}{suffix}")


def put(temporary: Path, final: Path) -> None:
    """Rename a temporary file or folder to its final name, so that a power failure leaves the old or the new one.

    If the file system supports it, the content is on the disk before the renaming, and the name before this function
    returns.

    Raises
    ------
    OSError
        The disk is full or not writable.

    """
    settle(temporary)
    os.replace(temporary, final)
    with suppress(OSError):
        _sync(final.parent)


def settle(path: Path) -> None:
    """Wait until a file, or the content of a folder, is stored on the disk."""
    for folder, _, files in os.walk(path):
        for name in files:
            _sync(os.path.join(folder, name))
        _sync(folder)
    if not path.is_dir():
        _sync(path)


@cache
def sweep(folder: str) -> None:
    """Remove the temporary files of ended processes from a folder, once per process."""
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
    """Return an identifier of the machine, its last start and the container. Process numbers are unique within it."""
    parts = [platform.node()]
    with suppress(OSError):
        parts.append(Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii"))
        parts.append(str(os.stat("/proc/self/ns/pid").st_ino))
    return blake2b("\n".join(parts).encode(), digest_size=4).hexdigest()


def _is_gone(process: int) -> bool:
    """Return True if a process with this number certainly does not exist."""
    if os.name != "posix":  # On other systems, os.kill would end the process.
        return False
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return True
    except (OSError, OverflowError):
        return False
    return False


def _sync(path: str | os.PathLike[str]) -> None:
    """Wait until the content of a file or a folder is stored on the disk."""
    if os.name != "posix" and os.path.isdir(path):  # Windows cannot open folders.
        return
    number = os.open(path, os.O_RDONLY if os.name == "posix" else os.O_RDWR)
    try:
        os.fsync(number)
    except OSError as error:
        # Some file systems do not support fsync, so ignore their errors.
        if error.errno not in (errno.EINVAL, errno.ENOTSUP, errno.EROFS):
            raise
    finally:
        os.close(number)

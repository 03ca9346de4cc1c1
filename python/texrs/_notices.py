"""Notices: which parts of an input a call ignored, and what it assumed about an input."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any

from texrs.errors import InputWarning, InvalidInput

__all__ = ["Notices", "assume", "collect", "ignore", "repeat"]

PACKAGE = os.path.dirname(__file__)


@dataclass(frozen=True, slots=True)
class Notices:
    """The notices that were given in a block of `collect`, each once.

    Attributes
    ----------
    ignored : list of str
        One sentence for each part of an input that was not used.
    assumed : list of str
        One sentence for each fact about an input that the input does not state.

    """

    ignored: list[str] = field(default_factory=list)
    assumed: list[str] = field(default_factory=list)

    def __bool__(self) -> bool:
        """Return whether there are any."""
        return bool(self.ignored or self.assumed)

    def add_to(self, report: Any) -> dict[str, Any]:
        """Return a report with these notices: keys ``ignored`` and ``assumed``, only if there are any."""
        made = dict(report)
        for key, several in (("ignored", self.ignored), ("assumed", self.assumed)):
            if several:
                made[key] = list(dict.fromkeys([*made.get(key, []), *several]))
        return made


@dataclass(frozen=True, slots=True)
class _Collector:
    notices: Notices
    show: Callable[[str], object] | None
    strict: bool


_COLLECTORS: ContextVar[tuple[_Collector, ...]] = ContextVar("collectors", default=())


@contextmanager
def collect(
    *, show: Callable[[str], object] | None = None, strict: bool = False, apart: bool = False
) -> Iterator[Notices]:
    """Collect the notices of a block.

    Parameters
    ----------
    show : callable, optional
        Called with the text of each notice when it is given. Without it, an ignored part is also a Python warning.
    strict : bool
        If True, an ignored part raises `texrs.errors.InvalidInput`.
    apart : bool
        If True, the notices do not reach outer blocks and are not warnings. Default: False.

    Yields
    ------
    Notices
        Grows while the block runs.

    """
    notices = Notices()
    outer = () if apart else _COLLECTORS.get()
    if apart and show is None:
        show = bool
    token = _COLLECTORS.set((*outer, _Collector(notices, show, strict)))
    try:
        yield notices
    finally:
        _COLLECTORS.reset(token)


def ignore(message: str) -> None:
    """Report that a part of an input is not used.

    Parameters
    ----------
    message : str
        One sentence that starts with the name of the input: ``"rock: preview.png is not used (its name gives no
        role)"``.

    Raises
    ------
    InvalidInput
        If a block is strict.

    Warns
    -----
    InputWarning
        If no block of `collect` shows the notice.

    """
    collectors = _COLLECTORS.get()
    if any(c.strict for c in collectors):
        raise InvalidInput(f"{message}; this is an error because of --strict")
    if _add("ignored", message) and not any(c.show for c in collectors):
        warnings.warn(message, InputWarning, stacklevel=_count_frames())


def assume(message: str) -> None:
    """Report a fact that a call assumes because the input does not state it.

    Parameters
    ----------
    message : str
        One sentence that starts with the name of the input: ``"stone_n.png: read as normals with y down"``.

    """
    _add("assumed", message)


def repeat(notices: Notices) -> None:
    """Give notices again that were collected earlier, without a warning: they belong to this call also."""
    for message in notices.ignored:
        _add("ignored", message)
    for message in notices.assumed:
        _add("assumed", message)


def _add(kind: str, message: str) -> bool:
    """Add a notice to all open blocks; return whether it is new to the outermost one."""
    new, shown = True, False
    for rank, collector in enumerate(_COLLECTORS.get()):
        several = getattr(collector.notices, kind)
        if message in several:
            new = new and rank > 0
            continue
        several.append(message)
        if collector.show is not None and not shown:
            shown = True
            collector.show(message)
    return new


def _count_frames() -> int:
    """Return the number of stack frames between a notice and the code that called texrs."""
    frame, count = sys._getframe(1), 1
    while frame.f_back is not None and frame.f_code.co_filename.startswith(PACKAGE):
        frame, count = frame.f_back, count + 1
    return count

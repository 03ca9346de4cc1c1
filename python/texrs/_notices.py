"""Collect notices: which parts of an input were ignored, and what was assumed about an input."""

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
    """Notices of a `collect` block, without repetitions.

    Attributes
    ----------
    ignored : list of str
        One sentence for each part of an input that was not used.
    assumed : list of str
        One sentence for each assumption about an input that the input does not state.

    """

    ignored: list[str] = field(default_factory=list)
    assumed: list[str] = field(default_factory=list)

    def __bool__(self) -> bool:
        """Return True if there are any notices."""
        return bool(self.ignored or self.assumed)

    def add_to(self, report: Any) -> dict[str, Any]:
        """Return a report with these notices added under the keys ``ignored`` and ``assumed``, if there are any."""
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
    """Collect the notices that are given in a ``with`` block.

    Parameters
    ----------
    show : callable, optional
        Function that is called with the text of each notice. If it is None, ignored parts are also Python warnings.
    strict : bool
        If True, an ignored part of an input raises `texrs.errors.InvalidInput`.
    apart : bool
        If True, enclosing blocks do not get the notices, and there are no warnings. Default: False.

    Yields
    ------
    Notices
        Object to which notices are added while the block runs.

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
    """Report that a part of an input was not used.

    Parameters
    ----------
    message : str
        Sentence that starts with the name of the input: ``"rock: preview.png is not used (its name gives no role)"``.

    Raises
    ------
    InvalidInput
        An enclosing block of `collect` is strict.

    Warns
    -----
    InputWarning
        No enclosing block of `collect` shows the notice.

    """
    collectors = _COLLECTORS.get()
    if any(c.strict for c in collectors):
        raise InvalidInput(f"{message}; this is an error because of --strict")
    if _add("ignored", message) and not any(c.show for c in collectors):
        warnings.warn(message, InputWarning, stacklevel=_count_frames())


def assume(message: str) -> None:
    """Report an assumption about an input that the input does not state.

    Parameters
    ----------
    message : str
        Sentence that starts with the name of the input: ``"stone_n.png: read as normals with y down"``.

    """
    _add("assumed", message)


def repeat(notices: Notices) -> None:
    """Give notices again that were collected earlier, without warnings, because they also apply to this call."""
    for message in notices.ignored:
        _add("ignored", message)
    for message in notices.assumed:
        _add("assumed", message)


def _add(kind: str, message: str) -> bool:
    """Add a notice to all enclosing blocks, and return True if it is new to the outermost block."""
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
    """Return the number of stack frames between a notice and the code that called texrs, for warnings."""
    frame, count = sys._getframe(1), 1
    while frame.f_back is not None and frame.f_code.co_filename.startswith(PACKAGE):
        frame, count = frame.f_back, count + 1
    return count

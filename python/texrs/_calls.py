"""Functions that callers give, checked before they are called in the middle of long work."""

from __future__ import annotations

import inspect
from collections.abc import Callable

from texrs.errors import InvalidInput

__all__ = ["check_call"]


def check_call(function: Callable[..., object], name: str, *arguments: str) -> None:
    """Refuse a function that cannot be called with so many arguments, as far as it says what it takes."""
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):
        return
    try:
        signature.bind(*arguments)
    except TypeError:
        raise InvalidInput(
            f"{name}: is called as {name}({', '.join(arguments)}), which {function!r} does not take"
        ) from None

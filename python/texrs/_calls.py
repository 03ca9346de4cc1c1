"""Check functions that callers pass, before long work begins that will call them."""

from __future__ import annotations

import inspect
from collections.abc import Callable

from texrs.errors import InvalidInput

__all__ = ["check_call"]


def check_call(function: Callable[..., object], name: str, *arguments: str) -> None:
    """Raise an error if the signature of a function shows that it cannot be called with the named arguments."""
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):
        return
    try:
        signature.bind(*arguments)
    except TypeError:
        raise InvalidInput(
            f"{name}: must be a function that accepts the call {name}({', '.join(arguments)}), got {function!r}"
        ) from None

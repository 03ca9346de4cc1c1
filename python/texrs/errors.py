"""Exceptions of texrs. Each message names the argument, the given value and the allowed values."""

from __future__ import annotations

__all__ = ["Cancelled", "FileError", "InputWarning", "InvalidInput", "LimitExceeded", "TexrsError"]


def __dir__() -> list[str]:
    return __all__


class TexrsError(Exception):
    """Base class of all exceptions of texrs."""


class InvalidInput(TexrsError, ValueError):
    """An argument is outside what the function allows."""


class LimitExceeded(InvalidInput):
    """The work would need more pixels or memory than the limit in force."""


class FileError(TexrsError, OSError):
    """A file could not be read, decoded or written. No file is left half-written."""


class Cancelled(TexrsError):
    """The caller asked to stop. No file is left half-written."""


class InputWarning(UserWarning):
    """A part of an input was not used, such as a file in a folder whose name gives no role."""

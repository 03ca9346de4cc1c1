"""What texrs raises. Every message says which argument, what came and what is allowed."""

from __future__ import annotations

__all__ = ["Cancelled", "FileError", "InputWarning", "InvalidInput", "LimitExceeded", "TexrsError"]


def __dir__() -> list[str]:
    return __all__


class TexrsError(Exception):
    """Root of everything that texrs raises on purpose."""


class InvalidInput(TexrsError, ValueError):
    """An argument is outside what the function allows."""


class LimitExceeded(InvalidInput):
    """The work would need more pixels or more memory than the limit in force."""


class FileError(TexrsError, OSError):
    """A file could not be read, decoded or written; nothing was left half-written."""


class Cancelled(TexrsError):
    """The caller asked to stop; nothing was left half-written."""


class InputWarning(UserWarning):
    """A part of an input was not used, such as a file in a folder whose name gives no role."""

"""Exceptions of texrs. Each message names the argument, the given value and the allowed values."""

from __future__ import annotations

__all__ = ["Cancelled", "FileError", "InputWarning", "InvalidInput", "LimitExceeded", "TexrsError"]


def __dir__() -> list[str]:
    return __all__


class TexrsError(Exception):
    """Base class of all exceptions of texrs."""


class InvalidInput(TexrsError, ValueError):
    """An argument is outside what the function allows.

    Parameters
    ----------
    text : str
        Text of the form "argument: reason".
    remedy : str
        Advice for the caller, with which the message ends. Default: none.

    Attributes
    ----------
    argument : str
        Name of the argument, or names separated by commas.
    reason : str
        Values that are allowed, and the given value.
    remedy : str
        Advice for the caller, or an empty text.

    """

    def __init__(self, text: str, *, remedy: str = "") -> None:
        super().__init__(f"{text}; {remedy}" if remedy else text)
        argument, colon, reason = text.partition(":")
        self.argument, self.reason, self.remedy = (argument, reason.strip(), remedy) if colon else ("", text, remedy)


class LimitExceeded(InvalidInput):
    """The work would need more pixels or memory than the limit in force."""


class FileError(TexrsError, OSError):
    """A file could not be read, decoded or written. No file is left half-written."""


class Cancelled(TexrsError):
    """The caller asked to stop. No file is left half-written."""


class InputWarning(UserWarning):
    """A part of an input was not used, such as a file in a folder whose name gives no role."""

"""Separate a file name from the words after it: size and type of raw samples, or options for reading a mask."""

from __future__ import annotations

import os
import re
from typing import Any

from texrs._masks import Mask
from texrs.cli._texts import parse_numbers
from texrs.io.raw import RAW, strip_raw

__all__ = ["make_mask", "split_tail"]

WORD = r"(?:invert|threshold=[^,:]+|grow=[^,:]+)"
MASKED = re.compile(rf"(?P<path>.+):(?P<words>{WORD}(?:,{WORD})*)")
"""Pattern of a mask with options, such as ``mask.png:invert,grow=3``."""


def split_tail(text: str) -> tuple[str, str]:
    """Return a file name, and the words after it, starting with their colon.

    Examples
    --------
    >>> split_tail("mask.png:invert,grow=3"), split_tail("scan.raw:8x8x8:uint8"), split_tail("a.png")
    (('mask.png', ':invert,grow=3'), ('scan.raw', ':8x8x8:uint8'), ('a.png', ''))

    """
    if "\0" in text or os.path.lexists(text):
        return text, ""
    if strip_raw(text) != text:
        end = text.lower().rindex(f"{RAW}:") + len(RAW)
        return text[:end], text[end:]
    found = MASKED.fullmatch(text)
    return (found["path"], text[len(found["path"]) :]) if found else (text, "")


def make_mask(text: str) -> Mask:
    """Return the mask of a file, with the options in the words after its name."""
    path, tail = split_tail(text)
    given: dict[str, Any] = {}
    for word in tail[1:].split(",") if tail else ():
        name, _, value = word.partition("=")
        given[name] = (
            True if name == "invert" else parse_numbers(value, name, f"a number, as in {name}=2", counts=(1,))[0]
        )
    if given.get("grow", 0.5).is_integer():
        given["grow"] = int(given["grow"])
    return Mask(path, **given)

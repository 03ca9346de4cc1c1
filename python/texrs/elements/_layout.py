"""Define `Layout`: how the elements of a texture are connected."""

from __future__ import annotations

from enum import StrEnum
from typing import Literal, TypeAlias

from texrs.errors import InvalidInput

LayoutName: TypeAlias = Literal["disjoint", "connected", "jointed", "F=d", "F=c", "B=c"]
"""Texts that `Layout` accepts: its own values, and the tags of the paper."""


class Layout(StrEnum):
    """Connection between the elements of a texture. It determines which parts can move.

    The tags F=d, F=c and B=c of Liu et al. (2009) are accepted as well.

    Examples
    --------
    >>> from texrs.elements import Layout
    >>> Layout("jointed"), Layout("F=d")
    (<Layout.JOINTED: 'jointed'>, <Layout.DISJOINT: 'disjoint'>)

    """

    DISJOINT = "disjoint"
    """Separate elements on a background, such as buttons on paper: a disjoint foreground, F=d."""
    CONNECTED = "connected"
    """A single figure whose repeated parts are the elements, such as the meshes of a net: a connected foreground, F=c.
    """
    JOINTED = "jointed"
    """Elements separated by joints, such as bricks by mortar: a rigid connected background, B=c."""

    @classmethod
    def _missing_(cls, value: object) -> Layout:
        tags = {"F=d": cls.DISJOINT, "F=c": cls.CONNECTED, "B=c": cls.JOINTED}
        if isinstance(value, str) and value in tags:
            return tags[value]
        raise InvalidInput(
            f"layout: must be one of disjoint, connected, jointed, or the paper's F=d, F=c, B=c; got {value!r}"
        )


def as_layout(value: object) -> Layout:
    """Convert a text to a layout.

    Other types raise an error. They are not looked up, because they can be arrays.
    """
    return Layout(value if isinstance(value, str) else repr(value))

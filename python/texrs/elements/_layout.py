"""How the elements of a texture hang together."""

from __future__ import annotations

from enum import StrEnum
from typing import Literal, TypeAlias

from texrs.errors import InvalidInput

LayoutName: TypeAlias = Literal["disjoint", "connected", "jointed", "F=d", "F=c", "B=c"]
"""What a `Layout` can be made from: its values, and the paper's tags."""


class Layout(StrEnum):
    """How the elements of a texture hang together, which decides what may move against what.

    The tags of Liu et al. (2009), F=d, F=c and B=c, are accepted in the place of values.

    Examples
    --------
    >>> from texrs.elements import Layout
    >>> Layout("jointed"), Layout("F=d")
    (<Layout.JOINTED: 'jointed'>, <Layout.DISJOINT: 'disjoint'>)

    """

    DISJOINT = "disjoint"
    """Separate elements on a ground, as buttons on paper: a disjoint foreground, F=d."""
    CONNECTED = "connected"
    """One figure whose repeated parts are the elements, as the meshes of a net: a connected foreground, F=c."""
    JOINTED = "jointed"
    """Elements parted by joints, as bricks by mortar: a rigid connected background, B=c."""

    @classmethod
    def _missing_(cls, value: object) -> Layout:
        tags = {"F=d": cls.DISJOINT, "F=c": cls.CONNECTED, "B=c": cls.JOINTED}
        if isinstance(value, str) and value in tags:
            return tags[value]
        raise InvalidInput(
            f"layout: must be one of disjoint, connected, jointed, or the paper's F=d, F=c, B=c; got {value!r}"
        )


def as_layout(value: object) -> Layout:
    """Check a layout; what is no word is not looked up, for it may be an array."""
    return Layout(value if isinstance(value, str) else repr(value))

"""What is known of a texture's texels: the entry that splicing works with."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

#: How a texture is made: separate texels on a ground, one connected figure, or texels in a connected ground (mortar).
Tag = Literal["F=d", "F=c", "B=c"]


@dataclass(frozen=True, eq=False)
class Texels:
    """The texels of one texture.

    Attributes
    ----------
    image : ndarray of shape (height, width, channels)
        The texture itself, in its own dtype.
    points : ndarray of shape (n, 2), float64
        The centres of the texels, (row, column), in pixels.
    mask : ndarray of shape (height, width), bool
        The foreground: True on texels (for ``B=c`` too: the mortar is where it is False).
    box : tuple of int
        Height and width of a texel's box, odd, in pixels.
    tag : {"F=d", "F=c", "B=c"}
        Disjoint foreground, connected foreground, or connected background.
    scores : ndarray of shape (n,), float64
        How alike each texel is to the chosen one, -1 to 1.
    peaks : tuple of float
        The directions in which the points line up, degrees in [0, 180), strongest first; empty where they do not.
    wrap : tuple of bool
        Whether the texture repeats without a seam along rows and columns.
    report : dict
        What the analysis found and decided; text, numbers and lists alone.
    angles : ndarray of shape (n,), float64, optional
        Degrees by which each texel is turned against the chosen one, as far as was looked for.
    scales : ndarray of shape (n,), float64, optional
        How many times larger each texel is, as far as was looked for.
    """

    image: NDArray[Any]
    points: NDArray[np.float64]
    mask: NDArray[np.bool_]
    box: tuple[int, int]
    tag: Tag
    scores: NDArray[np.float64]
    peaks: tuple[float, ...] = ()
    wrap: tuple[bool, bool] = (False, False)
    report: dict[str, Any] = field(default_factory=dict)
    angles: NDArray[np.float64] | None = None
    scales: NDArray[np.float64] | None = None

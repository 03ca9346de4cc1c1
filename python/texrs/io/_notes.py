"""What a file says beside its values: how its colours and its pixels are to be understood, and how it was made."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

from texrs._checks import as_int

NODATA = 42113
"""TIFF tag of GDAL that states the value of pixels without data."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Metadata:
    """What a file says beside its values.

    Attributes
    ----------
    profile : bytes, optional
        The ICC profile of the colours.
    density : (down, across) of float, optional
        Pixels a metre, of the picture as `read` returns it.
    srgb : bool
        Whether the file says that its colours are sRGB.
    gamma : float, optional
        Exponent that gives samples of light: 1 for linear ones, 1 / 2.2 for most others.
    primaries : tuple of 8 float, optional
        Chromaticities x and y of white, red, green and blue.
    made : str, optional
        JSON: how texrs made the file.
    palette : bytes, optional
        Colours of an indexed image in the order of the file, four bytes each: red, green, blue, alpha.
    georeference : tuple of (int, int, int, object)
        Tags of a TIFF file that state the position of its pixels on the earth, and the value that stands for no data.
        Each has a code, a type, a number of values, and a value, as tifffile returns them. `write` writes them.
    multiplied : bool, optional
        If True, colours are multiplied by alpha, as in EXR files. None for an image whose alpha is not a transparency.
        Default: False.

    Examples
    --------
    >>> from texrs.io import Metadata
    >>> Metadata(density=(11811.0, 11811.0), srgb=True).srgb
    True

    """

    profile: bytes | None = None
    density: tuple[float, float] | None = None
    srgb: bool = False
    gamma: float | None = None
    primaries: tuple[float, ...] | None = None
    made: str | None = None
    palette: bytes | None = None
    georeference: tuple[tuple[int, int, int, Any], ...] = ()
    multiplied: bool | None = False

    @property
    def nodata(self) -> float | None:
        """The value of pixels without data, as GDAL states it."""
        text = next((value for code, _, _, value in self.georeference if code == NODATA), None)
        with suppress(TypeError, ValueError):
            return float(text)  # type: ignore[arg-type]
        return None

    def fit(self, channels: int) -> Metadata:
        """Return what is true of a picture of so many channels: a profile is of grey or of colours.

        Parameters
        ----------
        channels : int
            1 or 2 of grey, 3 or 4 of colours, alpha counted.

        Returns
        -------
        texrs.io.Metadata
            Without the profile where that is of the other kind.

        Examples
        --------
        >>> from texrs.io import Metadata
        >>> colours = Metadata(profile=bytes(16) + b"RGB " + bytes(108))
        >>> colours.fit(3).profile is None, colours.fit(1).profile is None
        (False, True)

        """
        channels = as_int(channels, "channels", 1, 64)
        space = b"RGB " if channels in (3, 4) else b"GRAY" if channels in (1, 2) else b""
        fits = self.profile is not None and self.profile[16:20] == space
        return replace(self, profile=self.profile if fits else None)

"""Metadata of a file: the meaning of its colours and pixels, and the record of how it was made."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

from texrs._checks import as_int

INCH = 0.0254
"""Metres."""
MARK = '{"texrs"'
"""Beginning of the record of how texrs made a file."""
NODATA = 42113
"""TIFF tag of GDAL that states the value of pixels without data."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Metadata:
    """Metadata of a file.

    Attributes
    ----------
    profile : bytes, optional
        The ICC profile of the colours.
    density : (down, across) of float, optional
        Pixels per metre of the image as `read` returns it.
    srgb : bool
        If True, the file states that its colours are sRGB.
    gamma : float, optional
        Exponent that encodes light: 1 for linear samples, 1 / 2.2 for most others.
    primaries : tuple of 8 float, optional
        Chromaticities x and y of white, red, green and blue.
    made : str, optional
        Record of how texrs made the file, as JSON.
    palette : bytes, optional
        Colours of an indexed image in the order of the file, four bytes each: red, green, blue, alpha.
    georeference : tuple of (int, int, int, object)
        Tags of a TIFF file that state the position of its pixels on the earth, and the value of pixels without data.
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
        """Return metadata that fit an image with a number of channels: a profile is for grey or for colours.

        Parameters
        ----------
        channels : int
            1 or 2 for grey, 3 or 4 for colours; alpha counts.

        Returns
        -------
        texrs.io.Metadata
            Without the profile if that does not fit.

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

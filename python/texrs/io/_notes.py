"""Metadata of a file: its colour space, pixel density, and the record of how it was made."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

from texrs._checks import as_int

INCH = 0.0254
"""Length of an inch in metres."""
MARK = '{"texrs"'
"""Beginning of the record of how texrs made a file."""
NODATA = 42113
"""TIFF tag of GDAL that states the value of pixels without data."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Metadata:
    """Metadata of an image or volume file.

    Attributes
    ----------
    profile : bytes, optional
        ICC profile of the colours. Default: None.
    density : (down, across) of float, optional
        Pixels per metre down and across the image as `read` returns it. Default: None.
    srgb : bool
        If True, the file states that its colours are sRGB. Default: False.
    gamma : float, optional
        Exponent that encodes light: 1 for linear samples, 1 / 2.2 for most others. Default: None.
    primaries : tuple of 8 float, optional
        Chromaticities x and y of white, red, green and blue. Default: None.
    made : str, optional
        Record of how texrs made the file, as JSON. Default: None.
    palette : bytes, optional
        Colours of an indexed image in the order of the file, four bytes each: red, green, blue, alpha. Default: None.
    georeference : tuple of (int, int, int, object)
        Tags of a GeoTIFF file: the geographic position of the pixels, and the value of pixels without data. Each tag
        is (code, type, number of values, value), as tifffile returns it. `write` writes them. Default: ().
    multiplied : bool, optional
        If True, colours are multiplied by alpha, as in EXR files. None for an image whose alpha channel is not a
        transparency. Default: False.

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
        """Value of pixels without data, from the GDAL tag; None if there is none."""
        text = next((value for code, _, _, value in self.georeference if code == NODATA), None)
        with suppress(TypeError, ValueError):
            return float(text)  # type: ignore[arg-type]
        return None

    def fit(self, channels: int) -> Metadata:
        """Return the metadata without the ICC profile if that does not fit the number of channels of an image.

        Parameters
        ----------
        channels : int
            Number of channels including alpha: 1 or 2 for grey, 3 or 4 for colours.

        Returns
        -------
        texrs.io.Metadata
            Same metadata, without the profile if that is for grey and the image has colours, or the other way round.

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

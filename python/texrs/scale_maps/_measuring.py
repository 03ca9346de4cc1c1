"""How a scale map is measured where nobody gives one: a mask that is found, and what is counted in it."""

from __future__ import annotations

from dataclasses import dataclass

from texrs._arrays import as_bool, as_float
from texrs._typing import Bools, Floats
from texrs.scale_maps._auto import auto_mask
from texrs.scale_maps._mask import from_mask
from texrs.scale_maps._trend import Trend, as_trend

LARGEST_DETAIL = 4096.0
"""Pixels; a picture allows a quarter of its shorter side."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Measuring:
    """How the scale map of a picture is measured in a mask of features that is found in it.

    Parameters
    ----------
    min_feature_size : float, optional
        Measured in a mask of features, of which what is finer than so many pixels, where elements have their normal size, is
        none (`auto_mask`). By default 1/400 of the picture's shorter side, at least 1.
    trend : {"plane", "linear", "quadratic", "none"}
        What a map that is measured so is brought to by a robust fit (`from_mask`).
    foreshortened : bool
        Whether a map that is measured so shows a plane aslant: widths then, which are the power 2/3 of the square roots of
        areas that a mask gives.

    Raises
    ------
    InvalidInput
        A value outside these.

    Examples
    --------
    >>> from texrs import samples, scale_maps
    >>> measured = scale_maps.Measuring(min_feature_size=3, foreshortened=True).measure(samples.tilted_discs((128, 128)).image)
    >>> bool(measured[-1, 64] > measured[0, 64])
    True

    """

    min_feature_size: float | None = None
    trend: Trend = "plane"
    foreshortened: bool = False

    def __post_init__(self) -> None:
        if self.min_feature_size is not None:
            object.__setattr__(
                self, "min_feature_size", as_float(self.min_feature_size, "min_feature_size", 0.5, LARGEST_DETAIL)
            )
        as_trend(self.trend)
        as_bool(self.foreshortened, "foreshortened")

    def measure(self, image: object, known: Bools | None = None) -> Floats:
        """Return the scale map of a picture, where it is known.

        Parameters
        ----------
        image : (H, W) or (H, W, C) array_like
            Each side at least 16.
        known : (H, W) bool array, optional
            Where it shows the texture.

        Returns
        -------
        (H, W) float32 array

        Raises
        ------
        InvalidInput
            A picture without features, or too small for the detail.

        Examples
        --------
        >>> from texrs import samples
        >>> from texrs.scale_maps import Measuring
        >>> Measuring().measure(samples.tilted_discs((96, 96)).image).shape
        (96, 96)

        """
        mask = auto_mask(image, min_feature_size=self.min_feature_size, trend=self.trend, known=known)
        return from_mask(mask, trend=self.trend, foreshortened=self.foreshortened, known=known)

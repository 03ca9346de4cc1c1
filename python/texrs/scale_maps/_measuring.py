"""Measurement of a scale map without user input: detect a mask of features, then measure it."""

from __future__ import annotations

from dataclasses import dataclass

from texrs._arrays import as_bool, as_float
from texrs._typing import Bools, Floats
from texrs.scale_maps._mask import from_mask
from texrs.scale_maps.auto import auto_mask
from texrs.scale_maps.trend import Trend, as_trend

LARGEST_DETAIL = 4096.0
"""Upper limit of `min_feature_size`, in pixels. Each image also limits it to a quarter of its shorter side."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Measuring:
    """Options for measuring the scale map of an image from a mask of features that is detected in it.

    Parameters
    ----------
    min_feature_size : float, optional
        Smallest feature to measure, in pixels at scale 1, 0.5 to 4096. Finer detail is not in the mask (`auto_mask`).
        Default: 1/400 of the shorter side, at least 1.
    trend : {"plane", "linear", "quadratic", "none"}
        Model fitted robustly to the measured map (`from_mask`). Default: "plane".
    foreshortened : bool
        If True, the image must show an oblique plane, and the map contains widths across the slope. They are computed
        as the power 2/3 of the square roots of areas, which the mask yields. Default: False.

    Raises
    ------
    InvalidInput
        If a value is outside its range.

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
        """Measure the scale map of an image.

        Parameters
        ----------
        image : (H, W) or (H, W, C) array_like
            Image, with sides of at least 16.
        known : (H, W) bool array, optional
            Mask of the pixels that show the texture. Default: all.

        Returns
        -------
        (H, W) float32 array

        Raises
        ------
        InvalidInput
            If the image has no features, or is too small for ``min_feature_size``.

        Examples
        --------
        >>> from texrs import samples
        >>> from texrs.scale_maps import Measuring
        >>> Measuring().measure(samples.tilted_discs((96, 96)).image).shape
        (96, 96)

        """
        mask = auto_mask(image, min_feature_size=self.min_feature_size, trend=self.trend, known=known)
        return from_mask(mask, trend=self.trend, foreshortened=self.foreshortened, known=known)

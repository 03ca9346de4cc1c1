"""Define the options for searching elements in `texrs.elements.analyse`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from texrs._arrays import as_choice, as_float, as_int, as_method, as_seed, as_wrap
from texrs.errors import InvalidInput

Channel: TypeAlias = Literal["weighted", "min-entropy"]
Model: TypeAlias = Literal["mixture", "nearest"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ElementSearch:
    """Options for the search of elements, and for the colour models of elements and background.

    Parameters
    ----------
    rotations : int
        Number of orientations to search for, 1 to 72, evenly spread over 360 degrees. 1 finds only upright elements.
    scales : sequence of float
        Sizes of elements in the search, relative to the box: 1 to 16 numbers from 0.25 to 4.
    threshold : float, optional
        Minimum similarity to the chosen element, -1 to 1. Default: the value that best separates two classes of
        candidates (Otsu).
    channel : {"weighted", "min-entropy"}, optional
        Channels of the appearance vectors that are compared. "weighted" uses all, weighted by their variance, and
        "min-entropy" uses the channel whose map has the lowest entropy. Default: "weighted", or "min-entropy" with
        ``method="paper"``.
    model : {"mixture", "nearest"}, optional
        Model of the colours of foreground and background: mixtures of Gaussians, or the nearest sample. Default:
        "mixture", or "nearest" with ``method="paper"``.

    Raises
    ------
    InvalidInput
        If a field has another type or range.

    Examples
    --------
    >>> from texrs.elements import ElementSearch
    >>> ElementSearch(rotations=4, scales=[0.8, 1.0]).scales
    (0.8, 1.0)

    """

    rotations: int = 1
    scales: Sequence[float] = (1.0,)
    threshold: float | None = None
    channel: Channel | None = None
    model: Model | None = None

    def __post_init__(self) -> None:
        if (
            isinstance(self.scales, str | bytes)
            or getattr(self.scales, "ndim", 1) != 1
            or not isinstance(self.scales, Sequence | np.ndarray)
            or not 1 <= len(self.scales) <= 16
        ):
            raise InvalidInput(f"scales: must be 1 to 16 numbers, got {self.scales!r}")
        sizes = tuple(as_float(s, f"scales[{i}]", 0.25, 4.0) for i, s in enumerate(self.scales))
        object.__setattr__(self, "rotations", as_int(self.rotations, "rotations", 1, 72))
        object.__setattr__(self, "scales", sizes)
        if self.threshold is not None:
            object.__setattr__(self, "threshold", as_float(self.threshold, "threshold", -1, 1))
        if self.channel is not None:
            as_choice(self.channel, "channel", ("weighted", "min-entropy"))
        if self.model is not None:
            as_choice(self.model, "model", ("mixture", "nearest"))


@dataclass(frozen=True, slots=True)
class Settings:
    """Checked options that apply to all steps of an analysis."""

    search: ElementSearch
    model: Model
    literal: bool
    """True if ``method="paper"``, which uses the algorithm as published."""
    wrap: tuple[bool, bool]
    seed: int

    @classmethod
    def of(cls, search: object, method: object, wrap: object, seed: object) -> Settings:
        """Check the options, and choose the defaults that depend on the method."""
        as_method(method, None, "paper")
        if not isinstance(search, ElementSearch):
            raise InvalidInput(f"search: must be a texrs.elements.ElementSearch, got {type(search).__name__}")
        literal = method == "paper"
        channel: Channel = search.channel or ("min-entropy" if literal else "weighted")
        model: Model = search.model or ("nearest" if literal else "mixture")
        rows, columns = as_wrap(wrap)
        return cls(replace(search, channel=channel, model=model), model, literal, (rows, columns), as_seed(seed))

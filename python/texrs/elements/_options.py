"""How elements are looked for: what belongs together of the options of `texrs.elements.analyse`."""

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
    """How the elements of a texture are looked for, and how their colours are told from those of the background.

    Parameters
    ----------
    rotations : int
        Directions in which the element is looked for, 1 to 72, evenly spread over the circle; 1 looks for it upright alone.
    scales : sequence of float
        Sizes in which it is looked for, over that of its box: 1 to 16 numbers of 0.25 to 4.
    threshold : float, optional
        Least similarity, -1 to 1. By default what best parts the candidates in two classes (Otsu).
    channel : {"weighted", "min-entropy"}, optional
        The similarity of all channels of the appearance vectors, weighted by their variance, or that of the one whose map
        has the least entropy. By default the first, and the second with ``method="paper"``.
    model : {"mixture", "nearest"}, optional
        Colours of foreground and background as mixtures of Gaussians, or by the nearest sample. By default the first, and
        the second with ``method="paper"``.

    Raises
    ------
    InvalidInput
        A field of another type or range.

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
            raise InvalidInput(f"scales: needs 1 to 16 numbers, got {self.scales!r}")
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
    """The checked options of an analysis that hold for all of its stages."""

    search: ElementSearch
    model: Model
    literal: bool
    """Whether the published algorithm is wanted as printed."""
    wrap: tuple[bool, bool]
    seed: int

    @classmethod
    def of(cls, search: object, method: object, wrap: object, seed: object) -> Settings:
        """Check the options, and choose what the method leaves open."""
        as_method(method, None, "paper")
        if not isinstance(search, ElementSearch):
            raise InvalidInput(f"search: needs a texrs.elements.ElementSearch, got {type(search).__name__}")
        literal = method == "paper"
        channel: Channel = search.channel or ("min-entropy" if literal else "weighted")
        model: Model = search.model or ("nearest" if literal else "mixture")
        rows, columns = as_wrap(wrap)
        return cls(replace(search, channel=channel, model=model), model, literal, (rows, columns), as_seed(seed))

"""Methods of stitching an image from patches, each tried at a small size and evaluated.

Larger patches tear fewer elements, and copy more of the exemplar in one piece. Seams that avoid supposed elements are
longer than necessary if there are none. The evaluation of small results (`texrs.metrics`) shows which of the two
matters more.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from texrs._arrays import as_choice
from texrs.errors import InvalidInput
from texrs.exemplar import Exemplar
from texrs.growth import Start, from_patches
from texrs.metrics import Quality as TextureQuality
from texrs.metrics import evaluate
from texrs.papers.solid.settings import CANDIDATES, Quality
from texrs.source_map import SourceMap

__all__ = ["PLANS", "Choice", "Plan", "check_plan", "choose_plan"]

Choice: TypeAlias = Literal["auto", "default", "large", "unmasked", "unmasked-large"]


@dataclass(frozen=True, slots=True)
class Plan:
    """A method of cutting and stitching patches."""

    larger: float = 1.0
    """Factor on the usual side of the patches."""
    plain: bool = False
    """If True, elements do not change the costs of seams."""

    def start(self, exemplar: Exemplar, seed: int, quality: Quality, bend: bool | None) -> Start:
        """Return the start from patches."""
        return from_patches(
            exemplar,
            0,
            seed,
            candidates=CANDIDATES[quality],
            bend=bend,
            larger=self.larger,
            plain=self.plain,
        )


LARGE = 1.25
"""Patches half as large again copy more than a fifth of the result in one piece."""
PLANS: Mapping[str, Plan] = {
    "default": Plan(),
    "large": Plan(LARGE),
    "unmasked": Plan(plain=True),
    "unmasked-large": Plan(LARGE, plain=True),
}
TRIALS = (0, 1)
"""Seeds of the textures that evaluate a method. A single one depends more on chance than on the method."""
CLEARLY = 0.85
"""Share of the default method's score below which another method is used."""


def check_plan(patches: object, method: object, quality: Quality) -> Choice:
    """Check the name of a method, and that patches are used."""
    name: Choice = as_choice(patches, "patches", (*PLANS, "auto"))  # type: ignore[assignment]
    if name != "default" and (method is not None or quality == "fast"):
        what = f"method={method!r}" if method is not None else "quality='fast'"
        raise InvalidInput(f"patches: cannot be combined with {what}; omit patches, or {what.partition('=')[0]}")
    return name


def choose_plan(
    exemplar: Exemplar, patches: Choice, quality: Quality, make: Callable[[Plan, int], SourceMap]
) -> tuple[str, Mapping[str, Mapping[str, float]] | None]:
    """Return the name of the method, as given or best evaluated, and the figures of each that was tried.

    Parameters
    ----------
    exemplar : Exemplar
        Exemplar.
    patches : {"auto", "default", "large", "unmasked", "unmasked-large"}
        The given name.
    quality : {"preserve", "optimise"}
        Number of places that are tried for a patch.
    make : callable
        Function that makes a small texture by a method and a seed. It does not depend on the seed or the size of the
        result, so that all textures of an exemplar use the same method.

    """
    # Unordered classes have no colours to evaluate.
    if patches != "auto" or exemplar.labels:
        return ("default" if patches == "auto" else patches), None
    stitcher = exemplar.stitcher
    names = [name for name in PLANS if stitcher.separate or stitcher.guessed or not PLANS[name].plain]
    tried = exemplar.cached(
        ("synthesis trials", quality),
        lambda: {name: average([evaluate(exemplar, make(PLANS[name], seed)) for seed in TRIALS]) for name in names},
    )
    best = min(names, key=lambda name: tried[name]["score"])
    return (best if tried[best]["score"] < CLEARLY * tried["default"]["score"] else "default"), tried


def average(judgements: Sequence[TextureQuality]) -> Mapping[str, float]:
    """Return the mean of each figure."""
    reports = [j.report() for j in judgements]
    return {name: round(float(np.mean([r[name] for r in reports])), 4) for name in reports[0]}

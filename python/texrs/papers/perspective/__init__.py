"""PERSPECTIVE: textures whose elements have the size that a map asks for.

W. Dong, N. Zhou and J.-C. Paul, "Perspective-aware texture analysis and synthesis", The Visual Computer 24, 2008. The
flow:

1. a scale map of the exemplar, from a mask of features or from angles, edited where need be (section 3;
   `texrs.scale_maps`);
2. the scale map of the output: the exemplar's, brought to its size, or any other (section 4);
3. a start from pieces of the exemplar that have the wanted scale (section 4);
4. from coarse to fine, every window of the output made like one of the exemplar, its scale included (Eq. 5 to 7);
5. the exemplar looked up through the coordinates.

Departures, with their reasons:

- The start is hashed coherent blocks that fit each other, drawn from where the exemplar has about the wanted scale; single
  pixels of that scale are noise, which the averages of the paper turn to haze.
- The scale is a cost of showing a sample at a point, (log S_e - log S_o)^2, not a channel of windows, whose values hardly
  differ within a window; ratios of scales are what is seen, so logarithms are compared. The output's map stays as asked.
- What is optimised are coordinates, so that the last word is a copy, not a weighted mean: nothing blurs.
- A point changes for a drawn match only if that gains more than twice the exemplar's own spacing, and the start is balanced
  for contrast. Both keep what is rare.
- The histograms of Eq. 8 are those of the exemplar's samples weighted to the target's scales, and what is in excess of them
  becomes dearer from pass to pass, not for one alone (`texrs.growth`): colours differ by scale, and drift without it.
- Resized copies of the exemplar add to the supply of a scale. A ramp finds only a strip of the exemplar for each of its
  rows, and repeats it; and what is larger or smaller than all of the exemplar is not there at all.

``method="paper"`` leaves the departures out (`texrs.papers.perspective.literal`).
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any, Literal, TypeAlias

import numpy as np

from texrs import scale_maps
from texrs._arrays import as_float, as_image, as_seed, as_size, as_wrap
from texrs._engine.pyramid import Region
from texrs._typing import Array, Floats, Interpolation, Progress
from texrs.errors import InvalidInput
from texrs.growth import LARGEST, LEAST, SMALLEST, Settings, Supply, reaching
from texrs.papers.perspective.literal import SIDE, average
from texrs.scale_maps._maps import as_map
from texrs.source_map import SourceMap
from texrs.source_map._pixels import bands
from texrs.synthesis import Synthesis

__all__ = ["perspective"]

Method: TypeAlias = Literal["paper"] | None
Sizes: TypeAlias = Literal["auto"] | bool | Sequence[float]

SETTINGS = Settings(weights=(4.0, 1.5, 0.5), balance=0.05)
"""Where elements of all sizes lie side by side, the wanted one must be chosen at the coarsest level: later ones hardly move.
Costs of colours that grow faster wash away what is rare: drops on paint."""
FACTORS = (1.0, 0.8, 0.64, 1.25, 1.5625)
"""Sizes of the copies that add to the supply, the exemplar first."""
PLENTY = 0.75
"""Samples of about the wanted scale for each point of the output at which the exemplar alone will do."""
ALIKE = 0.1
"""Natural logarithm of a ratio of scales that are about the same."""


def perspective(
    exemplar: Array,
    scale_map: Array,
    size: int | Sequence[int],
    *,
    target: Array | None = None,
    method: Method = None,
    scale_weight: float = 1.0,
    augment_scales: Sizes = "auto",
    wrap: bool | Sequence[bool] = False,
    seed: int = 0,
    interpolation: Interpolation = "cubic",
    progress: Progress | None = None,
) -> Synthesis:
    """Grow a picture whose elements are as large as a map says.

    Parameters
    ----------
    exemplar : (H, W) or (H, W, C) array
        Any real dtype and channels; each side at least 16.
    scale_map : (H, W) float array
        How large the exemplar's elements are at each pixel, positive; only ratios count (`texrs.scale_maps`).
    size : int or (int, int)
        Rows and columns of the result.
    target : (rows, columns) float array, optional
        How large they are to be at each pixel of the result, in the units of ``scale_map``. None stretches
        ``scale_map`` to the size (`texrs.scale_maps.resample`).
    method : {None, "paper"}
        "paper": the literal algorithm, kept for comparison: averages, and slow.
    scale_weight : float
        How much the scale counts beside looking like the exemplar, 0 to 16. At 1 another scale by a factor of 1.6 costs
        as much as surroundings that have nothing to do with each other; 0 synthesises without regard to scales.
    augment_scales : {"auto", True, False} or sequence of float
        Whether resized copies of the exemplar may be copied from too, or their sizes, 1/8 to 4. "auto" adds them where
        the exemplar has little of a wanted scale, or none. With False, scales that it has not are brought to those it
        has, with a warning.
    wrap : bool or (rows, columns)
        Axes along which the result is to repeat; the target must do so, too.
    seed : int
        Chooses the texture.
    interpolation : {"nearest", "linear", "cubic"}
        Between the exemplar's samples, where it is resized.
    progress : callable, optional
        Called with the stage and the share of it that is done; raising stops the work.

    Returns
    -------
    Synthesis
        The picture; its source map, whose labels tell the copies and whose frames their sizes; the stages, of which
        ``"target"`` is the scale map that was followed; and a report.

    Raises
    ------
    InvalidInput
        Maps of other shapes, or with scales that are not positive; an exemplar that is too small; a target of which the
        exemplar has nothing, or that does not repeat where the result is to.
    Cancelled
        The work was stopped.

    References
    ----------
    .. [1] W. Dong, N. Zhou, J.-C. Paul, "Perspective-aware texture analysis and synthesis", The Visual Computer 24,
       2008. :doi:`10.1007/s00371-008-0232-1`

    Examples
    --------
    >>> import texrs
    >>> floor = texrs.samples.tilted_discs((96, 96))
    >>> result = texrs.perspective(floor.image, floor.scale_map, (96, 128), seed=1)
    >>> result.image.shape, result.report["scale_error"] < 0.1
    ((96, 128, 3), True)

    """
    image = as_image(exemplar, "exemplar", minimum=LEAST)
    mine = as_map(scale_map, "scale_map", image.shape[:2])
    sides = as_size(size)
    shape = (sides[0], sides[1])
    wanted = scale_maps.resample(mine, shape) if target is None else as_map(target, "target", shape)
    closed = as_wrap(wrap)
    check_wrap(wanted, closed, target is None)
    strength, seed = as_float(scale_weight, "scale_weight", 0, 16), as_seed(seed)
    if method not in (None, "paper"):
        raise InvalidInput(f"method: None or 'paper' is allowed, got {method!r}")
    if interpolation not in ("nearest", "linear", "cubic"):
        raise InvalidInput(f"interpolation: allowed are nearest, linear and cubic; got {interpolation!r}")
    if method == "paper":
        return literal(exemplar, mine, wanted, closed, strength, seed, progress)
    sizes = factors_for(mine, wanted, augment_scales)
    wanted, outside = clamped(mine, wanted, sizes)
    if outside["share"] > 0 and strength > 0:
        warnings.warn(_sentence(outside, sizes), stacklevel=2)
    reached = (float(wanted.min()), float(wanted.max()))
    supply = Supply.of(image, mine, sizes, wanted=reached, settings=SETTINGS)
    grown = supply.grow(Region.whole(shape, closed), wanted, strength=strength, seed=seed, progress=progress)
    source, levels, between = supply.source(grown.places, shape), grown.report, grown.stages
    del grown  # Its places take as much memory as all the rest.
    composite = source.render(exemplar, interpolation=interpolation)
    stages = {"target": wanted}
    for name, (places, points) in between.items():
        stages[name] = supply.source(places, points).render(exemplar, interpolation="nearest")
    report: dict[str, Any] = {
        "method": "default",
        "seed": seed,
        "scale_weight": strength,
        "sizes": [round(float(np.sqrt(np.prod(c.factor))), 4) for c in supply.copies],
        "outside": outside,
        "scale_error": scale_error(supply, source, mine, wanted),
        "wrap": list(closed),
        "interpolation": interpolation,
        "levels": levels,
    }
    return Synthesis(composite, source, stages | {"composite": composite}, report)


def literal(
    exemplar: Array,
    scale: Floats,
    target: Floats,
    wrap: Sequence[bool],
    weight: float,
    seed: int,
    progress: Progress | None,
) -> Synthesis:
    """Do what the paper prints; the composite shows what the averages were made of."""
    image = as_image(exemplar, "exemplar")
    if any(wrap):
        raise InvalidInput("wrap: the paper's method knows none; leave out wrap, or method='paper'")
    if image.shape[-1] > 4:
        raise InvalidInput(f"exemplar: the paper's method takes up to 4 channels, got {image.shape[-1]}")
    if min(*image.shape[:2], *target.shape) < 2 * SIDE:
        raise InvalidInput(f"size: the paper's method needs at least {2 * SIDE} pixels a side, got {target.shape}")
    made = average(image, scale, target, weight=weight, seed=seed, progress=progress)
    shape = (target.shape[0], target.shape[1])
    source = SourceMap(
        made.coordinates, np.zeros(shape, np.uint16), np.zeros(shape, np.uint32), None, (image.shape[:2],)
    )
    composite = source.render(exemplar, interpolation="nearest")
    report = {"method": "paper", "seed": seed, "scale_weight": weight, "energies": made.energies}
    return Synthesis(made.image.reshape(composite.shape), source, {"target": target, "composite": composite}, report)


def check_wrap(target: Floats, wrap: Sequence[bool], stretched: bool) -> None:
    """Refuse a target whose ends do not meet where the output is to repeat."""
    for axis, closed in enumerate(wrap):
        if not closed:
            continue
        logs = np.log(target)
        inner = float(np.abs(np.diff(logs, axis=axis)).max(initial=0.0))
        across = float(np.abs(np.take(logs, 0, axis) - np.take(logs, -1, axis)).max())
        if across > 2 * inner + 0.02:
            name = ("rows", "columns")[axis]
            way = "give a target that repeats" if stretched else "make it repeat"
            raise InvalidInput(
                f"wrap: the target's first and last {name} differ by a factor of {np.exp(across):.2f}, so the result "
                f"cannot repeat along {name}; {way}, or leave wrap off along {name}"
            )


def factors_for(scale: Floats, target: Floats, asked: Sizes) -> tuple[float, ...]:
    """Return the sizes of the copies, the exemplar's own first."""
    if isinstance(asked, bool | np.bool_):
        if not asked:
            return (1.0,)
    elif not (isinstance(asked, str) and asked == "auto"):
        return _given(asked)
    elif supplied(scale, target) >= PLENTY:
        return (1.0,)
    return reaching(FACTORS, scale, (float(target.min()), float(target.max())))


def _given(asked: object) -> tuple[float, ...]:
    if isinstance(asked, Sequence) and not isinstance(asked, str) and 1 <= len(asked) <= 16:
        sizes = [as_float(s, "augment_scales", SMALLEST, LARGEST) for s in asked]
        # The exemplar itself is always there.
        return (1.0, *dict.fromkeys(s for s in sizes if s != 1))
    raise InvalidInput(f"augment_scales: needs 'auto', True, False or up to 16 sizes from 1/8 to 4, got {asked!r}")


def supplied(scale: Floats, target: Floats) -> float:
    """Return how many samples of about the wanted scale the exemplar has for each point, where it has the fewest."""
    mine, theirs = np.sort(np.log(scale), axis=None), np.log(target).ravel()
    bins = np.arange(theirs.min(), theirs.max() + ALIKE, ALIKE)
    asked = np.histogram(theirs, np.append(bins, bins[-1] + ALIKE))[0]
    middle = bins + ALIKE / 2
    there = np.searchsorted(mine, middle + ALIKE) - np.searchsorted(mine, middle - ALIKE)
    counts = asked > theirs.size // 200
    return float((there[counts] / asked[counts]).min(initial=np.inf))


def clamped(scale: Floats, target: Floats, sizes: Sequence[float]) -> tuple[Floats, dict[str, float]]:
    """Bring a target to the scales that the copies have, and tell how much of it was beyond them."""
    low, high = float(scale.min()) * min(sizes), float(scale.max()) * max(sizes)
    slack = 1 + 1e-3
    beyond = (target < low / slack) | (target > high * slack)
    if beyond.all():
        raise InvalidInput(
            f"target: asks for scales from {target.min():.3g} to {target.max():.3g} where the exemplar, in all its sizes, "
            f"has {low:.3g} to {high:.3g}; give a target within these, or larger or smaller augment_scales"
        )
    factor = max(low / float(target.min()), float(target.max()) / high, 1.0)
    share = float(beyond.mean())
    return np.clip(target, low, high), {"share": round(share, 6), "factor": round(factor if share else 1.0, 4)}


def _sentence(outside: dict[str, float], sizes: Sequence[float]) -> str:
    way = "augment_scales='auto' would resize it" if len(sizes) == 1 else "nor have its resized copies"
    return (
        f"target: {outside['share']:.1%} of it asks for scales that the exemplar has not, by a factor of up to "
        f"{outside['factor']:.2f}; they were brought to those that it has ({way})"
    )


def scale_error(supply: Supply, source: SourceMap, scale: Floats, target: Floats) -> float:
    """Return the median of |log S_e(S(p)) - log S_o(p)|: how well the synthesiser chose by scale."""
    sizes = np.log([c.factor for c in supply.copies]).mean(axis=1).astype(np.float32)
    shown = source.render(scale, interpolation="linear")
    for band in bands(target.shape):
        part = shown[band]
        np.log(part, out=part)
        part += sizes[source.label[band]]
        part -= np.log(target[band])
    return round(float(np.median(np.abs(shown, out=shown), overwrite_input=True)), 5)

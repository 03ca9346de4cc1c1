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
  differ within a window; ratios of scales are what is seen, so logarithms are compared. The output's map stays as
  asked.
- What is optimised are coordinates, so that the last word is a copy, not a weighted mean: nothing blurs.
- A point changes for a drawn match only if that gains more than twice the exemplar's own spacing, and the start is balanced
  for contrast. Both preserve low-frequency features.
- The histograms of Eq. 8 are those of the exemplar's samples weighted to the target's scales, and what is in excess of them
  becomes dearer from pass to pass, not for one alone (`texrs.growth.balance`): colours differ by scale, and drift
  without it.
- An atlas of resized copies of the exemplar adds to what there is of a scale. A ramp finds only a strip of the exemplar
  for each of its rows, and repeats it; and what is larger or smaller than all of the exemplar is not there at all.

``method="paper"`` leaves the departures out (`texrs.papers.perspective.literal`).
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from texrs._engine.pyramid import Region
from texrs._typing import Array, Interpolation, Progress
from texrs.exemplar import Exemplar
from texrs.exemplar.analysis import count_levels
from texrs.exemplar.atlas import Atlas
from texrs.growth import FROM_ATLAS, grow_from_atlas, to_finest
from texrs.growth.engine import Places
from texrs.papers.perspective.literal import average_windows
from texrs.papers.perspective.request import Method, Request
from texrs.papers.perspective.sizes import Outside, Sizes, bring_within, choose_sizes
from texrs.source_map import SourceMap
from texrs.source_map._pixels import divide_bands
from texrs.synthesis import Synthesis

__all__ = ["perspective"]

SETTINGS = replace(FROM_ATLAS, weights=(4.0, 1.5, 0.5), balance=0.05)
"""Where elements of all sizes lie side by side, the wanted one must be chosen at the coarsest level: later ones hardly move.
Costs of colours that grow faster wash away low-frequency features: drops on paint."""


def perspective(
    exemplar: Array | Exemplar,
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
    exemplar : (H, W) or (H, W, C) array, or Exemplar
        Any real dtype and channels; each side at least 16.
    scale_map : (H, W) float array
        How large the exemplar's elements are at each pixel, positive; only ratios count (`texrs.scale_maps`).
    size : int or (int, int)
        Rows and columns of the result.
    target : (rows, columns) float array, optional
        How large they are to be at each pixel of the result, in the units of ``scale_map``. None stretches
        ``scale_map`` to the size (`texrs.scale_maps.resample`).
    method : {None, "paper"}
        Which algorithm. "paper": the literal one, kept for comparison: averages, and slow. It does not wrap, and
        takes up to four channels.
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
        Chooses the texture, 0 to 2^64 - 1; the same seed gives the same bytes.
    interpolation : {"nearest", "linear", "cubic"}
        Between the exemplar's samples, where it is resized.
    progress : callable, optional
        Called as ``progress(stage, share)`` with the stage and the share of it that is done; raising stops the work.

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
    asked = Request.check(
        exemplar,
        scale_map,
        size,
        target=target,
        method=method,
        scale_weight=scale_weight,
        augment_scales=augment_scales,
        wrap=wrap,
        seed=seed,
        interpolation=interpolation,
    )
    if asked.method == "paper":
        return average_windows(asked, progress)
    sizes = choose_sizes(asked.scale, asked.target, asked.sizes)
    wanted, outside = bring_within(asked.scale, asked.target, sizes)
    if outside.share > 0 and asked.strength > 0:
        warnings.warn(outside.describe(sizes), stacklevel=2)
    asked = replace(asked, target=wanted)
    atlas = make_atlas(asked, sizes)
    source, stages, levels = grow_coordinates(asked, atlas, progress)
    composite = source.render(asked.exemplar.image, interpolation=asked.interpolation)
    report = describe(asked, atlas, source, outside, levels)
    return Synthesis(composite, source, {"target": wanted, **stages, "composite": composite}, report)


def make_atlas(asked: Request, sizes: Sequence[float]) -> Atlas:
    """Analyse copies of the exemplar in the sizes that are of use."""
    return Atlas.of(
        asked.exemplar.guidance,
        asked.scale,
        sizes,
        levels=count_levels(asked.exemplar.shape, SETTINGS.coarsest),
        wanted=(float(asked.target.min()), float(asked.target.max())),
        tones=True,
    )


def grow_coordinates(
    asked: Request, atlas: Atlas, progress: Progress | None
) -> tuple[SourceMap, dict[str, Array], list[dict[str, Any]]]:
    """Return the source map of steps 3 and 4, pictures of the stages, and what was done at each level."""

    def show(places: Places, region: Region, spacing: int) -> Array:
        source = atlas.source(to_finest(places, spacing), region.shape)
        return source.render(asked.exemplar.image, interpolation="nearest")

    grown = grow_from_atlas(
        atlas,
        Region.whole(asked.target.shape, asked.wrap),
        asked.target,
        settings=SETTINGS,
        strength=asked.strength,
        seed=asked.seed,
        show=show,
        progress=progress,
    )
    # Its places take as much memory as all the rest: they go with this function.
    return atlas.source(grown.places, asked.target.shape), dict(grown.stages), [d.report() for d in grown.levels]


def measure_scale_error(asked: Request, atlas: Atlas, source: SourceMap) -> float:
    """Return the median of |log S_e(S(p)) - log S_o(p)|: how well the synthesiser chose by scale."""
    sizes = np.log([c.factor for c in atlas.copies]).mean(axis=1).astype(np.float32)
    shown = source.render(asked.scale, interpolation="linear")
    for band in divide_bands(asked.target.shape):
        part = shown[band]
        np.log(part, out=part)
        part += sizes[source.label[band]]
        part -= np.log(asked.target[band])
    return round(float(np.median(np.abs(shown, out=shown), overwrite_input=True)), 5)


def describe(
    asked: Request, atlas: Atlas, source: SourceMap, outside: Outside, levels: list[dict[str, Any]]
) -> dict[str, Any]:
    """Return the report: JSON types."""
    return {
        "method": "default",
        "seed": asked.seed,
        "scale_weight": asked.strength,
        "sizes": [round(float(np.sqrt(np.prod(c.factor))), 4) for c in atlas.copies],
        "outside": {"share": outside.share, "factor": outside.factor},
        "scale_error": measure_scale_error(asked, atlas, source),
        "wrap": list(asked.wrap),
        "interpolation": asked.interpolation,
        "levels": levels,
    }

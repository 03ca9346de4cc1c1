"""Synthesise a texture whose elements have the sizes that a scale map gives (PERSPECTIVE).

W. Dong, N. Zhou and J.-C. Paul, "Perspective-aware texture analysis and synthesis", The Visual Computer 24, 2008. The
steps are:

1. Compute the scale map of the exemplar from a mask of features or from angles, and edit it if needed (section 3,
   `texrs.scale_maps`).
2. Choose the scale map of the output: the resized map of the exemplar, or any other map (section 4).
3. Prepare the exemplar as a sheet: the flattened plane, or copies in several sizes, with the elements of the exemplar
   (`texrs.exemplar.sheet`).
4. Stitch patches of the sheet, each at the requested scale, along minimum cuts (section 4; `texrs.growth.sheets`).
5. Copy the colours of the exemplar at the resulting coordinates, with smoothing where the exemplar is reduced.

Departures, with their reasons:

- Whole patches are stitched. The paper corrects windows point by point (Eq. 5 to 7), which tears elements larger than
  a window. Whole patches reduce the number of cells that look torn by 80 %.
- An exemplar that shows a plane is flattened. Its elements then have the same size everywhere, and any of them can be
  shown at any depth. Without flattening, each row of a ramp of sizes would find only a strip of the exemplar, and
  repeat it. A plane is detected by the fit of S to a linear function (of its power 2/3 for a map of areas). Edges are
  also used, which get steeper with distance on a plane. The report contains the result. If the target grows along the
  plane's slope, elements are foreshortened as on this plane. If it grows along another line, elements are seen from
  the front. If its sizes both increase and decrease, elements are half as foreshortened.
- Other exemplars are used in several sizes, which add samples of each scale. A patch has an additional cost at each
  place, (log S_e - log S_o)^2, because ratios of scales are visible. The paper treats the scale as another channel of
  the windows. On planes, a reduced element costs 1/7 of an enlarged one, because enlarged elements are blurred. The
  output's scale map is not changed.
- The result is a set of source coordinates. Colours are copied from there instead of averaged, so that they are not
  blurred.
- A target can be a surface: another plane, normals, texture coordinates, or Jacobians (`targets`). Patches are bent to
  follow the surface, so that elements are foreshortened like the surface. The sizes of elements on the surface replace
  S_o.
- Frame fields can rotate the copied texture on its surface (`directions`). Section 6 of the paper leaves directions of
  elements to future work.
- Instead of the histograms of Eq. 8, source places that were already copied often have a cost, as have overrepresented
  classes of colour.

``method="paper"`` omits the departures (`texrs.papers.perspective.literal`).
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from texrs._engine.pyramid import Region
from texrs._progress import answering, stage
from texrs._verbs import verb
from texrs.growth import FromSheet, stitch_sheet
from texrs.papers.perspective.literal import average_windows
from texrs.papers.perspective.request import Perspective
from texrs.papers.perspective.surfaces import PreparedExemplar, lay_out
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis

__all__ = ["perspective"]


@verb(Perspective, "exemplar")
def perspective(asked: Perspective) -> Synthesis:
    """Synthesise an image whose elements have the sizes that a scale map gives.

    Parameters
    ----------
    {parameters}

    Returns
    -------
    Synthesis
        The image and its source map. The labels of the source map number the patches, and its frames contain the scale
        and foreshortening at each pixel. ``source_map.render(map, antialias=True)`` applies the result to any other
        map of the exemplar.

        Stages:

        - ``sheet``: The flattened or resized example that patches are cut from.
        - ``target``: The requested scale map, limited to the scales that are available.
        - ``before_blending``: The result.

        Report:

        - ``method``: "default" or "paper".
        - ``seed``: The seed.
        - ``scale_weight``: Weight of the requested scale.
        - ``measured``: Measured element sizes for ``scale_map="auto"``, as `texrs.planes.ScaleEstimate`, or None.
        - ``sheet``: ``kind`` and ``resolution`` of the sheet that patches are cut from.
        - ``surface``: Whether the target is a surface.
        - ``turned``: Whether a direction was given.
        - ``outside``: ``share`` of the target beyond the available scales, 0 to 1, and the largest ``factor`` beyond
          them.
        - ``scale_error``: Mean error of element sizes, as the natural logarithm of a ratio.
        - ``wrap``: Whether the result repeats along (rows, columns).
        - ``interpolation``: Interpolation between samples of the example.
        - ``elements``: Number of elements that were found.
        - ``stitched``: Number of ``patches``, mean cost of the ``seams`` and number of ``healed`` patches.
        - ``energies``: Energy of each round and pyramid level, only with ``method="paper"``.

    Raises
    ------
    InvalidInput
        If a map has another shape or scales that are not positive, or the exemplar is too small. This error is also
        raised if the exemplar has none of the target's scales, or the result wraps but the target is not periodic.
    Cancelled
        If the work was stopped.

    Warns
    -----
    UserWarning
        If a plane is uncertain, or the exemplar lacks requested scales.

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

    The same discs around a column, by its normals:

    >>> import numpy as np
    >>> x = np.linspace(-0.9, 0.9, 96)[np.newaxis].repeat(96, axis=0)
    >>> column = np.stack([x, 0 * x, np.sqrt(1 - x**2)], axis=-1)
    >>> around = texrs.perspective(floor.image, floor.scale_map, target=column, seed=1)
    >>> around.image.shape, around.report["surface"]
    ((96, 96, 3), True)

    """
    if asked.method == "paper":
        return average_windows(asked)
    stage(asked.progress, "sheet")
    with answering(asked.progress, "sheet", 0.0):
        # Prepare the exemplar: a flattened plane, or copies in several sizes.
        laid = lay_out(asked)
    if laid.outside.share > 0 and asked.scale_weight > 0:
        warnings.warn(laid.outside.describe(laid.sizes), stacklevel=2)
    # Stitch patches of the sheet, each at the requested scale.
    found = stitch_sheet(
        laid.sheet,
        Region.whole(laid.wanted.shape, asked.wrap),
        laid.target,
        frames=laid.frames,
        strength=asked.scale_weight,
        seed=asked.seed,
        progress=asked.progress,
    )
    # Smooth reduced parts of the exemplar in the look-up, because they would alias otherwise.
    source = SourceMap.from_coordinates(
        found.coordinates, asked.exemplar.shape, label=found.patches, jacobian=found.frames
    ).with_finish(asked.wrap, interpolation=asked.interpolation, antialias=True)
    composite = source.render(asked.exemplar.image, interpolation=asked.interpolation, antialias=True)
    stages = {"sheet": laid.sheet.show(asked.exemplar.image), "target": laid.wanted, "before_blending": composite}
    return Synthesis(composite, source, stages, describe(asked, laid, found))


def describe(asked: Perspective, laid: PreparedExemplar, found: FromSheet) -> dict[str, Any]:
    """Return the report as JSON types."""
    elements = laid.sheet.elements
    return {
        "method": "default",
        "seed": asked.seed,
        "scale_weight": asked.scale_weight,
        "measured": asked.describe_measured(),
        "sheet": laid.sheet.describe(),
        "surface": asked.surface is not None,
        "turned": asked.turn is not None,
        "outside": {"share": laid.outside.share, "factor": laid.outside.factor},
        "scale_error": round(found.error, 5),
        "wrap": list(asked.wrap),
        "interpolation": asked.interpolation,
        "elements": 0 if elements is None else elements.count,
        "stitched": {
            "patches": len(np.unique(found.patches)),
            "seams": round(found.stitched.seams, 6),
            "healed": found.stitched.healed,
        },
    }

"""PERSPECTIVE: textures whose elements have the size that a map asks for.

W. Dong, N. Zhou and J.-C. Paul, "Perspective-aware texture analysis and synthesis", The Visual Computer 24, 2008. The
flow:

1. a scale map of the exemplar, from a mask of features or from angles, edited where need be (section 3;
   `texrs.scale_maps`);
2. the scale map of the output: the exemplar's, brought to its size, or any other (section 4);
3. the exemplar laid out as a sheet: a plane flattened, anything else as copies in several sizes, with the elements that are
   found on the exemplar (`texrs.exemplar.sheet`);
4. patches of the sheet, each seen in the wanted scale, stitched along minimum cuts (section 4; `texrs.growth.sheets`);
5. the exemplar looked up through the coordinates, smoothed where it is shrunk.

Departures, with their reasons:

- Patches that are cut in whole stand in for windows that are corrected point by point (Eq. 5 to 7), which tear things
  larger than a window: by four fifths fewer cells of the pictures look torn.
- An exemplar that is a plane is flattened. Its elements are the same everywhere then, and any of them can be seen at any
  depth; without that a ramp finds only a strip of the exemplar for each of its rows, and repeats it. Whether it is a plane is
  told by the fit of S, or of its power 2/3 where the map is one of areas, to a linear function and by edges,
  which get steeper with distance there, and said in the report. A target that grows along the plane's slope shows that
  plane; along another line elements are seen straight ahead; where sizes come and go they are half as foreshortened.
- What is no plane is offered in several sizes, which add to what there is of a scale. The scale is a cost of showing a patch
  at a place, (log S_e - log S_o)^2, not a channel of windows: ratios of scales are what is seen. Of planes it counts a
  seventh where elements are shrunk: what is magnified is blurred. The output's map stays as asked.
- What is found are coordinates, so that the last word is a copy, not a weighted mean: nothing blurs.
- A target may be a surface: another plane, normals, texture coordinates, Jacobians (`targets`). Patches are bent to it, so that
  elements are foreshortened as the surface is; its sizes stand in for S_o.
- Directions of elements, which section 6 leaves to the future: fields turn what is copied, on the surface that it lies on
  (`directions`).
- In place of the histograms of Eq. 8, places are charged for what has been shown often, and for classes of colour in excess.

``method="paper"`` leaves the departures out (`texrs.papers.perspective.literal`).
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from texrs._engine.pyramid import Region
from texrs._progress import answering, listen, stage
from texrs._typing import Array, Interpolation, Progress
from texrs._verbs import takes_materials
from texrs.exemplar import Exemplar
from texrs.fields import Field
from texrs.growth import FromSheet, stitch_sheet
from texrs.materials import Material
from texrs.papers.perspective.laying import Laid, lay_out
from texrs.papers.perspective.literal import average_windows
from texrs.papers.perspective.request import Method, Request
from texrs.papers.perspective.sizes import Sizes
from texrs.planes import Plane
from texrs.scale_maps import Measuring
from texrs.scale_maps._kinds import Kind
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis

__all__ = ["perspective"]


@takes_materials("exemplar")
def perspective(
    exemplar: Array | Exemplar | Material,
    scale_map: Array | Plane | str = "auto",
    size: int | Sequence[int] | None = None,
    *,
    target: Array | Plane | str | None = None,
    target_green: Literal["up", "down"] = "up",
    scale_kind: Kind | None = None,
    fov: float | None = None,
    direction: float | Array | Field | str | None = None,
    scale_measurement: Measuring | None = None,
    method: Method = None,
    scale_weight: float = 1.0,
    augment_scales: Sizes = "auto",
    wrap: bool | Sequence[bool] | None = None,
    seed: int = 0,
    interpolation: Interpolation = "cubic",
    progress: Progress | bool | None = None,
) -> Synthesis:
    """Grow a picture whose elements are as large as a map says.

    Parameters
    ----------
    exemplar : (H, W) or (H, W, C) array, or Exemplar
        Any real dtype and channels; each side at least 16.
    scale_map : (H, W) float array, Plane, "auto" or "front"
        How large the exemplar's elements are at each pixel, positive; only ratios count (`texrs.scale_maps`).
        `texrs.Plane` or its words ``"plane:slant=50,tilt=90,fov=60"`` give the sizes on a plane. "auto": those of the
        plane that is found in it (`texrs.planes.find`), or else measured (`texrs.planes.measure_scale`). "front": all alike.
    size : int or (int, int), optional
        Size of the result in pixels: by default that of the ``target``, else twice the exemplar's.
    target : array or Plane, optional
        How large they are to be at each pixel of the result, in the units of ``scale_map``: a scale map; or a surface that the
        texture is to lie on. `texrs.Plane` or its words give another plane, with elements of size 1 in its middle.
        Normals (rows, columns, 3) of a curved surface, seen from far away. Coordinates (rows, columns, 2) on a surface, or
        Jacobians (rows, columns, 2, 2): for each pixel the step on the texture that a step in the picture is
        (`texrs.scale_maps.jacobians_of_normals`, `texrs.scale_maps.jacobians_of_coordinates`, `texrs.Plane.jacobians`). One of
        another size is stretched to that of the result, its borders on the borders (`texrs.scale_maps.resample`). None:
        ``scale_map``, stretched.
    target_green : {"up", "down"}
        Direction of the y axis of normals in ``target``: up (OpenGL) or down (DirectX).
    scale_kind : {"width", "area"}, optional
        What maps hold that do not say so themselves (`texrs.scale_maps.ScaleMap`): "width", widths across the slope; "area",
        square roots of areas. None: what the scale map fits best, as a map of a plane; the target holds the same.
    fov : float, optional
        Degrees that the longer side of the exemplar spans, 1 to 170; 60 by default (`texrs.planes.FOV`). How much a plane is
        foreshortened besides what a scale map says; a ``target`` that is a surface, and ``direction``, need it. Not of a
        ``scale_map`` that is a plane, which has its own.
    direction : float, (rows, columns) array or Field, optional
        By how many degrees, counter-clockwise, what is copied is turned: everywhere, or at each pixel; an array of another size
        is stretched. Of a `texrs.fields.Field` of two axes, or its words, as ``"circular"`` or ``"zigzag:period=64,angle=30"``,
        how it turns. On a plane or another surface it turns there.
    scale_measurement : Measuring, optional
        How the ``scale_map`` "auto" is measured in a mask of features (`texrs.scale_maps.Measuring`), rather than by a plane.
    method : {None, "paper"}
        Which algorithm. "paper": the literal one, kept for comparison: averages, and slow. It does not wrap, and
        takes up to four channels.
    scale_weight : float
        How much it counts beside looking like the exemplar that elements come from where they have about the wanted scale,
        0 to 16. Copies are chosen by that alone; what is seen on a plane has its size anyway, but another sharpness. 0
        synthesises without regard to scales.
    augment_scales : {"auto", True, False} or sequence of float
        Whether the exemplar may be resized. True: a plane is flattened and seen at any depth, anything else is copied in
        other sizes. "auto": as True, but without copies if the exemplar has enough of every wanted scale. False: wanted
        scales that it lacks are brought to the nearest that it has, with a warning. Sizes, 1/8 to 4: these copies, no plane.
    wrap : bool or (rows, columns), optional
        Axes along which the result is to repeat; None: neither. The target must repeat, too.
    seed : int
        Chooses the texture, 0 to 2^64 - 1; the same seed gives the same bytes.
    interpolation : {"nearest", "linear", "cubic"}
        Between the exemplar's samples, where it is resized.
    progress : callable or True, optional
        Called as ``progress(stage, share)`` with the stage and the share of it that is done; raising stops the work.
        True shows a bar.

    Returns
    -------
    Synthesis
        The picture; its source map, whose labels tell the patches and whose frames how the exemplar is seen at each pixel:
        ``source.render(map, antialias=True)`` brings any map in register along; the stages, of which ``"sheet"`` is what
        patches are cut from and ``"target"`` the scale map that was followed; and a report, in which ``"measured"`` tells
        of a ``scale_map`` "auto" what it is of, as `texrs.planes.ScaleEstimate` has it, and how sure that is.

        Stages:

        - ``sheet``: The flattened example that patches are cut from.
        - ``target``: The scale map that was followed.
        - ``before_blending``: The result.

        Report:

        - ``method``: "default" or "paper".
        - ``seed``: The seed.
        - ``scale_weight``: Weight of the scale.
        - ``measured``: What a ``scale_map`` "auto" found, as `texrs.planes.ScaleEstimate`; else None.
        - ``sheet``: ``kind`` and ``resolution`` of the flattened example.
        - ``surface``: Whether the target is a surface.
        - ``turned``: Whether a direction was given.
        - ``outside``: ``share`` of the target beyond the scales of the example, and the largest ``factor``.
        - ``scale_error``: Mean error of the scale, as a natural logarithm.
        - ``wrap``: Whether the result repeats along (rows, columns).
        - ``interpolation``: Interpolation between samples of the example.
        - ``elements``: Number of elements that were found.
        - ``stitched``: Number of ``patches``, mean cost of the ``seams`` and number of ``healed`` patches.
        - ``energies``: For the paper's method, the energy of each round, by level.

    Raises
    ------
    InvalidInput
        Maps of other shapes, or with scales that are not positive; an exemplar that is too small; a target of which the
        exemplar has nothing, or that does not repeat where the result is to.
    Cancelled
        The work was stopped.

    Warns
    -----
    UserWarning
        A plane that was not found surely, or scales that the exemplar does not have.

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
    progress = listen(progress)
    stage(progress, "scale map")
    with answering(progress, "scale map", 0.0):
        asked = Request.check(
            exemplar,
            scale_map,
            size,
            target=target,
            target_green=target_green,
            scale_kind=scale_kind,
            fov=fov,
            direction=direction,
            scale_measurement=scale_measurement,
            method=method,
            scale_weight=scale_weight,
            augment_scales=augment_scales,
            wrap=wrap,
            seed=seed,
            interpolation=interpolation,
        )
    if asked.method == "paper":
        return average_windows(asked, progress)
    stage(progress, "sheet")
    with answering(progress, "sheet", 0.0):
        laid = lay_out(asked)
    if laid.outside.share > 0 and asked.strength > 0:
        warnings.warn(laid.outside.describe(laid.sizes), stacklevel=2)
    found = stitch_sheet(
        laid.sheet,
        Region.whole(laid.wanted.shape, asked.wrap),
        laid.target,
        frames=laid.frames,
        strength=asked.strength,
        seed=asked.seed,
        progress=progress,
    )
    source = SourceMap.from_coordinates(
        found.coordinates, asked.exemplar.shape, label=found.patches, jacobian=found.frames
    ).with_finish(asked.wrap, interpolation=asked.interpolation, antialias=True)
    composite = source.render(asked.exemplar.image, interpolation=asked.interpolation, antialias=True)
    stages = {"sheet": laid.sheet.show(asked.exemplar.image), "target": laid.wanted, "before_blending": composite}
    return Synthesis(composite, source, stages, describe(asked, laid, found))


def describe(asked: Request, laid: Laid, found: FromSheet) -> dict[str, Any]:
    """Return the report: JSON types."""
    elements = laid.sheet.elements
    return {
        "method": "default",
        "seed": asked.seed,
        "scale_weight": asked.strength,
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

"""The flat texture of a photographed oblique plane.

The plane is flattened at one resolution. Parts that would be blurred, because they are too far away or too much
foreshortened, are not used. The largest rectangle of the rest is the texture. A larger or tileable one is grown from
it. The source map refers to the photograph, so any map in register with it is rectified in the same way.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from texrs._arrays import as_choice, as_float, as_image, as_ndarray, as_seed, as_size, as_wrap, check_work
from texrs._progress import answering, listen
from texrs._typing import Array, Interpolation, Progress
from texrs._verbs import takes_materials
from texrs.blending import apply
from texrs.materials import Material
from texrs.planes import Plane, PlaneView
from texrs.planes.choose import see
from texrs.planes.flattening import SMALLEST, flatten
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis
from texrs.tiling import tile

__all__ = ["rectify"]


@takes_materials("image")
def rectify(
    image: Array | Material,
    *,
    view: PlaneView | Plane | None = None,
    resolution: float | None = None,
    size: int | Sequence[int] | None = None,
    wrap: bool | Sequence[bool] | None = None,
    seed: int = 0,
    interpolation: Interpolation = "cubic",
    progress: Progress | bool | None = None,
) -> Synthesis:
    """Make a flat texture from a photograph of an oblique plane.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array
        The photograph, of any real dtype, at least 64 pixels a side.
    view : PlaneView or Plane, optional
        Position of the plane in the photograph, as far as it is known. The rest is found.
    resolution : float, optional
        Pixels of the texture for one pixel in the middle of the photograph, 0.05 to 8. Default: the median scale of
        the visible plane, or less if the flattened plane would be too large.
    size : int or (rows, columns), optional
        Size of the texture, in pixels. A texture that is larger than the largest sharp rectangle is synthesised from
        the rectangle. A smaller size is the middle of the rectangle. Default: the size of the rectangle.
    wrap : bool or (rows, columns), optional
        Axes along which the texture will be tileable (`texrs.tile`). Default: none.
    seed : int
        Seed of the random choices of the synthesis. Default: 0.
    interpolation : {"cubic", "linear", "nearest"}
        Interpolation between pixels of the photograph. Default: "cubic".
    progress : callable or True, optional
        Called as ``progress(stage, share)`` with the completed share of the stage. An exception that it raises stops
        the work. True shows a bar. Default: no reports.

    Returns
    -------
    Synthesis
        The texture, in the dtype and with the channels of the photograph. Its source map refers to the photograph,
        with the frames of the plane, which also rotate normals. The stages are ``"flat"`` (the visible part of the
        plane), ``"sharp"`` (the part that is used), and ``"before_blending"``. The report contains the plane.

        Stages:

        - ``flat``: The visible part of the plane, flattened.
        - ``sharp``: The part of the flattened plane that is sharp enough.
        - ``before_blending``: The result before seams are corrected.

        Report:

        - ``plane``: ``slant``, ``tilt``, ``fov`` and ``rotation`` in degrees, the ``shape`` of the image in pixels and
          the ``confidence``, 0 to 1.
        - ``found``: Whether the plane was found in the image.
        - ``resolution``: Pixels of the texture for one pixel in the middle of the photograph.
        - ``sharp``: Share of the flattened plane that is sharp enough.
        - ``rectangle``: (rows, columns) of the largest sharp rectangle.
        - ``grown``: Method that made the result from the rectangle: ``"nothing"``, ``"tile"`` or ``"design"``.
        - ``wrap``: Whether the result repeats along (rows, columns).
        - ``seed``: The seed.
        - ``interpolation``: Interpolation between pixels of the photograph.

    Raises
    ------
    InvalidInput
        If options are out of their ranges, the plane is described twice, or too little of it is sharp.

    Warns
    -----
    UserWarning
        If the plane is found with a confidence below 0.4: give corners or angles.

    Examples
    --------
    >>> import texrs
    >>> floor = texrs.samples.tilted_discs((192, 192))
    >>> flat = texrs.rectify(floor.image, view=texrs.PlaneView(slant=50, fov=53))
    >>> flat.source_map.shapes, flat.report["plane"]["slant"]
    (((192, 192),), 50.0)

    """
    progress = listen(progress)
    image = as_ndarray(image, "image")
    pixels = as_image(image, minimum=64)
    watch = progress or (lambda stage, share: None)
    cyclic, number = as_wrap(wrap, usual=False), as_seed(seed)
    asked = None if size is None else as_size(size, minimum=SMALLEST)
    fine = None if resolution is None else as_float(resolution, "resolution", 0.05, 8)
    as_choice(interpolation, "interpolation", ("nearest", "linear", "cubic"))
    check_work("rectify", [pixels], asked or pixels.shape[:2], "image" if asked is None else "size")
    watch("plane", 0.0)
    with answering(progress, "plane", 0.0):
        seen = see(pixels, PlaneView.of(view))
    watch("plane", 1.0)
    # A found plane has an arbitrary rotation, so level its courses.
    flat = flatten(pixels, seen.plane, seen.ground, fine, turn=seen.found)
    known, sheet = flat.source, flat.sheet
    texture = known.render(pixels, interpolation=interpolation, antialias=True)
    laid, grown = _grow(texture, asked, cyclic, number, watch)
    # Correct the seams of a grown texture with the options of the verb that grew it.
    rest = {} if laid.finish is None else {"screening": laid.finish.screening, "across": laid.finish.across}
    source = laid.compose(known).with_finish(cyclic, interpolation=interpolation, antialias=True, **rest)
    # A texture that was not grown does not have to be rendered again.
    as_it_is = source.shape == known.shape and not any(cyclic)
    composite = texture if as_it_is else source.render(pixels, interpolation=interpolation, antialias=True)
    squeeze = image.ndim == 2
    shown = apply(source, pixels, progress=watch) if rest.get("screening") else composite
    stages = {
        "flat": sheet.source.render(pixels, interpolation="linear"),
        "sharp": sheet.sharp,
        "before_blending": composite[..., 0] if squeeze else composite,
    }
    report: dict[str, Any] = {
        "plane": flat.plane.as_dict(),
        "found": seen.found,
        "resolution": round(sheet.resolution, 6),
        "sharp": round(float(sheet.sharp.mean()), 4),
        "rectangle": list(known.shape),
        "grown": grown,
        "wrap": list(cyclic),
        "seed": number,
        "interpolation": interpolation,
    }
    return Synthesis(shown[..., 0] if squeeze and shown.ndim == 3 else shown, source, stages, report)


def _cut(source: SourceMap, box: tuple[slice, slice]) -> SourceMap:
    """Return a rectangle of a map."""
    return SourceMap.from_coordinates(source.coordinates[box], source.shapes[0], jacobian=source.jacobians()[box])


def _grow(
    flat: Array, size: tuple[int, ...] | None, wrap: tuple[bool, ...], seed: int, watch: Progress
) -> tuple[SourceMap, str]:
    """Return the map of a texture of any size, tileable or not, into a flat one, and the method."""
    shape = (flat.shape[0], flat.shape[1])
    if any(wrap):
        made = tile(flat, wrap=wrap, size=size, progress=watch)
        return made.source_map, "tile"
    if size is None or size == shape:
        return SourceMap.identity(shape), "nothing"
    if all(n <= m for n, m in zip(size, shape, strict=True)):
        places = [slice((m - n) // 2, (m - n) // 2 + n) for n, m in zip(size, shape, strict=True)]
        return _cut(SourceMap.identity(shape), (places[0], places[1])), "nothing"
    from texrs.papers.design import design

    return design(flat, size, seed=seed, wrap=False, progress=watch).source_map, "design"

"""Fill holes in images with patches of their surroundings, or of another image.

J. Shen, X. Jin, X. Mao and J. Feng, "Completion-based texture design using deformation", 2006, section 3.4.
Patches that match the pixels around a hole are cut into it, and the patch with the cheapest cut is pasted. The paper fills
a hole in scan order. Here it is filled from its boundary inwards. `texrs.papers.design` fills its holes in the same way.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import (
    as_bool,
    as_float,
    as_image,
    as_int,
    as_mask,
    as_method,
    as_seed,
    as_wrap,
    check_work,
)
from texrs._masks import Mask, as_marks, fade, widen
from texrs._progress import listen
from texrs._typing import Array, Bools, Floats, Progress
from texrs._verbs import takes_materials
from texrs.blending import apply
from texrs.errors import InvalidInput
from texrs.exemplar import Exemplar, as_exemplar
from texrs.exemplar.symmetry import NONE
from texrs.inpainting._depth import see_plane
from texrs.inpainting._fill import Filling, fill
from texrs.inpainting._holes import check_material, find_hole
from texrs.inpainting._optimise import optimise, recover_scale
from texrs.inpainting._patches import LEAST, choose_mirrors
from texrs.inpainting.volumes import inpaint_volume, is_volume
from texrs.materials import Material
from texrs.planes import ScaleEstimate
from texrs.scale_maps.kinds import Kind, as_kind
from texrs.synthesis import Synthesis

__all__ = ["inpaint"]


@takes_materials("image", "exemplar", check=check_material)
def inpaint(
    image: Array | Exemplar | Material,
    mask: Array | Mask | str | float | None = None,
    *,
    exemplar: Array | Exemplar | Material | None = None,
    allowed: Array | Mask | str | None = None,
    scale_map: Array | str | None = None,
    exemplar_scale_map: Array | str | None = None,
    scale_kind: Kind | None = None,
    method: Literal["patch", "optimise"] = "patch",
    patch_size: int | None = None,
    boundary_width: int = 0,
    allow_mirror: bool | None = None,
    screening: float | None = None,
    wrap: bool | Sequence[bool] | None = None,
    seed: int = 0,
    progress: Progress | bool | None = None,
) -> Synthesis:
    """Fill a hole in an image or a volume by example.

    Parameters
    ----------
    image : (H, W[, C]) or (D, H, W[, C]) array, or Exemplar
        An image or a volume of any real dtype, at least 4 pixels or 16 voxels a side. Values in the hole are ignored
        and may be NaN. For a volume, only ``patch_size``, ``boundary_width``, ``screening`` and ``seed`` are allowed;
        the other options are for images.
    mask : (H, W) array, Mask, path, number, "alpha", "nan" or "nodata", optional
        Mask of the pixels to fill. A mask of three axes means a volume. "alpha": all pixels that are not fully opaque.
        "nan": all pixels that are NaN or infinite. "nodata": all pixels of the value that the file of the image states
        for missing data. A number: all pixels of this value. See `texrs.Mask` for how a mask is read, inverted, grown
        and feathered. Default: all pixels that are masked, NaN or infinite.
    exemplar : (h, w) or (h, w, C) array, or Exemplar, optional
        Another image to copy from, of the same dtype and channels. Default: the known pixels of ``image``.
    allowed : (H, W) array, path or Mask, optional
        Mask of the pixels that patches may be copied from, such as the floor without the sky above it. It cannot be
        combined with ``exemplar`` or ``method="optimise"``. Default: all known pixels.
    scale_map : {None, "auto"} or (H, W) float array, optional
        Size of the elements at each pixel (`texrs.scale_maps`), for images taken at an angle. The hole is then filled with
        elements of the right size [2]_. "auto": the map of the plane that is found (`texrs.planes.find`), or a measured map
        (`texrs.planes.measure_scale`). Values in the hole may be NaN, because the map is continued there.
    exemplar_scale_map : {None, "auto"} or (h, w) float array, optional
        Size of the elements in ``exemplar``, in the units of ``scale_map``. Measured maps have a geometric mean of 1.
        Default: 1 everywhere, as in an image taken from the front.
    scale_kind : {"width", "area"}, optional
        Quantity in maps that do not state it (`texrs.scale_maps.ScaleMap`): "width" (widths across the slope) or
        "area" (square roots of areas). Default: the quantity that fits each map best as a map of a plane.
    method : {"patch", "optimise"}
        Method of filling. "patch": patches that match the surroundings are joined along cuts [1]_. If the scale map is
        that of a plane, patches of the plane are projected into the hole, except with an ``exemplar``. "optimise":
        windows are corrected until each is similar to a window of the image or of ``exemplar``, resized by the scale
        map [2]_. It is for large holes, where patches would repeat the surroundings. Default: "patch".
    patch_size : int, optional
        Side of a patch in pixels, at least 4. It should be about the size of the elements. Large holes are tried in a
        small copy. With a scale map, the side is 1/6 of the shorter side, and up to 1/4 for a plane. "optimise" has no
        patches, and does not accept a side. Volumes: at least 6, and 12 to 32 by default, depending on the hole.
        Smaller sides are tried if the border of the hole is visible. Default: the side with the least visible seams,
        0.75 to 4 times 1/6 of the shorter side (limited to 12 to 32).
    boundary_width : int
        Width in pixels of a band around the hole that may also be replaced, 0 to 1024. The seam can then follow the
        least visible path. If 0, known pixels do not change. Default: 0.
    allow_mirror : bool, optional
        If True, patches may be mirrored. Use False for textures with letters. With a scale map patches are not
        mirrored, because an oblique view is not symmetric. Default: True along axes where the surroundings are
        symmetric, which excludes light from one side.
    screening : float, optional
        Weight of the original values when colours are corrected to hide seams, 0 to 1e6. A smaller weight spreads the
        correction wider. A weight of 0.003 is good for patches of the image, and a smaller weight for an ``exemplar``
        in other light. If 0, seams are not corrected. See `texrs.blend`, which corrects other maps in the same way,
        ``within`` the hole. Labels in volumes (integers with at most 16 values) are never mixed. The correction of a
        volume is not in its source map, so other volumes that are rendered through the map have no correction.
        Default: no correction of images and labels, 0.1 for other volumes.
    wrap : bool or (rows, columns), optional
        Axes along which the image is periodic, so that a hole at its border is also filled from the opposite side.
        Default: none.
    seed : int
        Seed of the random choices of patches that have no known pixels around them. Default: 0.
    progress : callable or True, optional
        Function that is called as ``progress(stage, share)``. If it raises, the work stops. True shows a bar.

    Returns
    -------
    Synthesis
        The filled image, in the dtype and with the channels of the input. Its source map points into the image, or
        into ``[image, exemplar]``. Pixels that are kept map to themselves, and no pixel maps into the hole. Replace
        NaN in the hole by any number before you render an image through the map.

        Stages:

        - ``known``: The image, with its hole in one colour.
        - ``patches``: The patches, each in its own shade.
        - ``before_blending``: The result before colours are corrected.

        Report:

        - ``method``: "patch" or "optimise".
        - ``seed``: The seed.
        - ``filled``: Share of the image that was filled, 0 to 1.
        - ``scaled``: Whether scale maps were used.
        - ``measured``: The result of a ``scale_map`` "auto", as `texrs.planes.ScaleEstimate`; else None.
        - ``exemplar_measured``: The same for the exemplar.
        - ``replaced_outside``: Number of known pixels that changed.
        - ``patch_size``: Side of the patches, in pixels.
        - ``candidates``: Sides of patches that were tried, each with the cost of its seams. For volumes, the cost is
          the step at the border of the hole, relative to steps elsewhere.
        - ``patches``: Number of patches.
        - ``in_step``: Whether patches are in step with a lattice, without mirror images.
        - ``allow_mirror``: Whether patches could be mirrored.
        - ``screening``: Weight of the values in the colour correction.
        - ``wrap``: Whether the image repeats along (rows, columns).
        - ``levels``: Levels of method "optimise", each with its ``shape``, number of ``passes`` and the share of points that
          ``changed``.
        - ``seams``: Mean cost of the seams. Only for volumes.
        - ``labels``: Whether the values are labels. Only for volumes.
        - ``screening_in_source_map``: False if seams were corrected, which the source map cannot do again. Only for volumes.

    Raises
    ------
    InvalidInput
        If the hole or ``allowed`` has another shape, the hole marks nothing, the exemplar has another dtype or other
        channels, no pixels can be copied, a patch is larger than the images or the space outside the hole, or a patch
        size is given for "optimise".

    Notes
    -----
    Masked values of a `numpy.ma.MaskedArray` are filled too. A number or "nodata" also fills pixels that are NaN or infinite.

    References
    ----------
    .. [1] J. Shen, X. Jin, X. Mao, J. Feng, "Completion-based texture design using deformation", The Visual Computer
       22, 2006, section 3.4. :doi:`10.1007/s00371-006-0079-2`
    .. [2] W. Dong, N. Zhou, J.-C. Paul, "Perspective-aware texture analysis and synthesis", The Visual Computer 24,
       2008. :doi:`10.1007/s00371-008-0232-1`

    Examples
    --------
    >>> import numpy as np
    >>> import texrs
    >>> wall = np.tile(np.uint8([[0, 0, 9, 9], [9, 9, 0, 0]]), (24, 12))
    >>> hole = np.zeros(wall.shape, bool)
    >>> hole[10:25, 12:30] = True
    >>> result = texrs.inpaint(np.where(hole, 5, wall).astype(np.uint8), hole)
    >>> bool((result.image == wall).all())
    True

    """
    progress = listen(progress)
    as_method(method, "patch", "optimise")
    # Options that are not available for volumes are errors, not ignored.
    if is_volume(image, mask):
        flat = {
            "exemplar": exemplar is not None,
            "allowed": allowed is not None,
            "scale_map": scale_map is not None,
            "exemplar_scale_map": exemplar_scale_map is not None,
            "scale_kind": scale_kind is not None,
            "method": method != "patch",
            "allow_mirror": allow_mirror is not None,
            "wrap": wrap is not None,
        }
        for name in (name for name, given in flat.items() if given):
            raise InvalidInput(f"{name}: only available for images; omit it for a volume")
        volume: Any = image
        return inpaint_volume(
            volume,
            mask,
            patch_size=patch_size,
            boundary_width=boundary_width,
            screening=screening,
            seed=seed,
            progress=progress,
        )
    if exemplar_scale_map is not None and (exemplar is None or scale_map is None):
        raise InvalidInput("exemplar_scale_map: needs exemplar, and scale_map in the same units")
    if scale_kind is not None and scale_map is None:
        raise InvalidInput("scale_kind: has no effect without scale_map; give scale_map or omit scale_kind")
    said = None if scale_kind is None else as_kind(scale_kind)
    if allow_mirror is not None or scale_map is not None:
        allow_mirror = False if allow_mirror is None else as_bool(allow_mirror, "allow_mirror")
    screening = as_float(0.0 if screening is None else screening, "screening", 0, 1e6)
    cyclic, seed, mask = as_wrap(wrap, usual=False), as_seed(seed), as_marks(mask)
    picture, marked = find_hole(image.image if isinstance(image, Exemplar) else image, mask, cyclic)
    open_ = widen(marked, mask.feather, cyclic)
    pictures = _check_pictures(picture, marked, open_, exemplar)
    shapes = tuple((p.shape[0], p.shape[1]) for p in pictures)
    usable = _check_allowed(allowed, open_, exemplar is None and method == "patch")
    width = as_int(boundary_width, "boundary_width", 0, 1024)
    if patch_size is not None and method == "optimise":
        raise InvalidInput(
            "patch_size: cannot be combined with method='optimise', which has no patches; omit it, or use "
            "method='patch'"
        )
    chosen = (
        None
        if patch_size is None
        else as_int(patch_size, "patch_size", LEAST, min(n for shape in shapes for n in shape))
    )
    watch = progress or (lambda stage, share: None)

    check_work("inpaint", pictures, shapes[0], "image", method=method)
    watch("inpaint", 0.0)
    # Measure scale maps after all cheap checks of the arguments.
    scales, measured = _recover_scales(pictures, ~usable, scale_map, exemplar_scale_map, said)
    levels: list[dict[str, object]] = []
    wide = widen(open_, width, cyclic)
    mirrors = choose_mirrors(pictures, open_, allow_mirror) if method == "patch" else (NONE,)
    across = (cyclic[0], cyclic[1])
    if method == "optimise":
        places, levels = optimise(pictures, open_, scales, wide, wrap=across, seed=seed, progress=progress)
        made = Filling(places, 0.0, int(places.label.max()), [], False)
    else:
        own = scales is not None and len(pictures) == 1 and len(mirrors) == 1
        made = fill(
            pictures,
            open_,
            wide,
            usable=usable,
            plane=see_plane(pictures[0], open_, scales[0]) if own and scales is not None else None,
            scales=scales,
            patch=chosen,
            mirrors=mirrors,
            wrap=across,
            seed=seed,
            progress=progress,
        )
    places, count = made.source, made.count
    new = _find_places(places.label)
    # Kept pixels are copied from themselves. Coordinates in patches are integers, except on oblique planes.
    result = pictures[0].copy()
    if not made.whole:
        result[new] = places.render(pictures, interpolation="cubic")[new]
    else:
        row, column = places.coordinates[new].astype(np.intp).T
        result[new] = pictures[-1][row, column]
    composite = result
    how: dict[str, Any] = {}
    if screening:
        known = (~open_, *(np.ones(s, bool) for s in shapes[1:]))
        how = {"screening": screening, "within": places.label > 0, "known": known}
    if mask.feather:
        how["fade"] = np.rint(255 * fade(marked, mask.feather, cyclic)).astype(np.uint8)
    places = places.with_finish(cyclic, **how)
    if how:
        result = apply(places, pictures, progress=progress)
    watch("done", 1.0)
    bare = pictures[0].copy()
    # In the stage, fill the hole with the smallest known value, so that the range of values does not change.
    bare[open_] = 0 if open_.all() else bare.min()
    shades = np.zeros(open_.shape, np.uint8)
    shades[new] = 55 + places.label[new] * 67 % 200
    stages = {"known": bare, "patches": shades, "before_blending": composite}
    report: dict[str, object] = {
        "method": method,
        "seed": seed,
        "filled": float(open_.mean()),
        "scaled": scale_map is not None,
        "measured": None if measured[0] is None else measured[0].as_dict(),
        "exemplar_measured": None if measured[1] is None else measured[1].as_dict(),
        "replaced_outside": int(np.count_nonzero(~open_[new])),
        "patch_size": round(made.side, 3),
        "candidates": [[s, round(shown, 3)] for s, shown in made.tried],
        "patches": count,
        "in_step": made.in_step,
        "allow_mirror": len(mirrors) > 1,
        "screening": screening,
        "wrap": list(cyclic),
    }
    if method == "optimise":
        report["levels"] = levels
    return Synthesis(result, places, stages, report)


def _check_allowed(allowed: object, open_: Bools, fits: bool) -> Bools:
    """Return the known pixels that patches may be copied from, limited by the mask ``allowed`` if it is given."""
    if allowed is None:
        return ~open_
    if not fits:
        raise InvalidInput("allowed: cannot be combined with exemplar or method='optimise'")
    usable: Bools = as_mask(allowed, "allowed", open_.shape) & ~open_
    if not usable.any():
        raise InvalidInput(
            "allowed: must mark at least one pixel outside the hole, because only marked pixels are copied"
        )
    return usable


def _recover_scales(
    pictures: Sequence[Array], open_: Bools, own: object, of_exemplar: object, scale_kind: Kind | None
) -> tuple[list[Floats] | None, list[ScaleEstimate | None]]:
    """Return the scale maps of the image and of the image to copy from, if they are used, and how each was measured."""
    scale, measured = recover_scale(pictures[0], open_, own, scale_kind=scale_kind)
    if scale is None or len(pictures) == 1:
        return None if scale is None else [scale], [measured, None]
    shape = (pictures[1].shape[0], pictures[1].shape[1])
    other, beside = recover_scale(pictures[1], np.zeros(shape, bool), of_exemplar, "exemplar_scale_map", scale_kind)
    return [scale, np.ones(shape, np.float32) if other is None else other], [measured, beside]


def _check_pictures(array: Array, mask: Bools, open_: Bools, exemplar: object | None) -> list[Array]:
    """Return the image with its marked pixels painted over, and the image to copy from if there is one."""
    # Values in the hole must not have an effect, not even on the range of the values.
    array = array.copy()
    first = np.unravel_index(mask.argmin(), mask.shape)
    array[mask] = array[first] if not mask[first] else 0
    pixels = as_image(array, "image", minimum=LEAST)
    if exemplar is None:
        if open_.all():
            raise InvalidInput("mask: must leave pixels to copy from, but covers the whole image; give an exemplar")
        return [pixels.reshape(array.shape)]
    known = as_exemplar(exemplar, minimum=LEAST)
    other = known.pixels
    if other.dtype != pixels.dtype or other.shape[-1] != pixels.shape[-1]:
        raise InvalidInput(
            f"exemplar: must have the dtype and channels of the image, {pixels.dtype} and {pixels.shape[-1]}; got "
            f"{other.dtype} and {other.shape[-1]}"
        )
    if open_.all():
        pixels[...] = other[0, 0]
    return [pixels.reshape(array.shape), other.reshape(other.shape[: array.ndim])]


def _find_places(marked: Array) -> tuple[NDArray[np.intp], ...]:
    """Return the indices of the values that are not zero, as `np.nonzero`, in 10 % of its time."""
    return np.unravel_index(np.flatnonzero(marked), marked.shape)

"""Parameters of `texrs.design` and `texrs.design_variants`, checked before any work begins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_int, as_list, as_size, check_work, to_unit, try_array
from texrs._requests import (
    PROGRESS,
    SEED,
    Request,
    Word,
    as_given,
    as_weight,
    choice,
    instance,
    method,
    periodic,
    request,
    tied,
    whole,
)
from texrs._typing import Array, Progress
from texrs.blending import SCREENING
from texrs.elements import ElementAnalysis
from texrs.errors import InvalidInput
from texrs.exemplar import ElementOptions, Exemplar, as_exemplar
from texrs.materials import Material
from texrs.papers.design.options import DeformationOptions
from texrs.papers.design.plan import Way

__all__ = ["Design", "DesignRequest", "DesignVariants"]

Exemplars: TypeAlias = (
    Array | Exemplar | ElementAnalysis | Material | Sequence[Array | Exemplar | ElementAnalysis | Material]
)
Size: TypeAlias = int | Sequence[int] | None
Weights: TypeAlias = Sequence[float] | Array | None
Density: TypeAlias = float | Sequence[float] | Array | None
Method: TypeAlias = Literal["paper"] | None
Choice: TypeAlias = Literal["auto"] | Way

MINIMUM_SIDE = 16
"""Minimum side of an exemplar, in pixels. A smaller image is too small for a texture."""
LARGER = "texrs.CornerTiles creates an unbounded design in parts"
"""Remedy in error messages about a size that exceeds a limit."""


@request
class DesignRequest(Request):
    """Parameters of `texrs.design` and `texrs.design_variants`.

    - ``exemplar`` ((H, W) or (H, W, C) array, Exemplar, ElementAnalysis, or a sequence of them): Example image, of
      any real dtype, at least 16 pixels a side. Several exemplars are mixed if they have the same dtype and number
      of channels. A `texrs.elements.ElementAnalysis`, as for `splice`, contains an image and its elements.
    - ``seed`` (int): Number that selects the texture, 0 to 2^64 - 1. The same exemplar, options, seed and version
      give the same bytes. Default: 0.
    - ``wrap`` (bool or (rows, columns), optional): Axes along which the result repeats without a visible border.
      Default: both.
    - ``weights`` ((n,), (rows, columns) of int, or (rows, columns, n) array, optional): Shares of the exemplars in
      the result: one number for each, 0 or more. Python also accepts a map of exemplar numbers, or a map of shares
      for each pixel. The shares of the whole result are correct within 3 %. Borders follow the outlines of
      elements, at most one element away from their position in a map. Default: equal shares.
    - ``density`` (float, (n - 1,), (rows, columns), or (rows, columns, n - 1) array, optional): Share of the
      result that is covered by elements of each exemplar after the first, 0 to 1. Give one number for all of these
      exemplars, one number for each, or maps. Whole elements are scattered over a texture of the first exemplar.
      Elements of the last exemplar are on top. Cannot be combined with ``weights``. The report's "density"
      contains the requested and the reached densities, and the densities in the exemplars. Default: elements are
      not scattered.
    - ``elements`` (ElementOptions or ElementAnalysis): Options that control how elements are found, or the result
      of `texrs.elements.analyse`, whose ``labels`` are used. Default: the default options.
    - ``deformation`` (DeformationOptions): Options that control how elements are deformed. Default: the default
      options.
    - ``way`` ({"auto", "move", "still", "lattice", "courses", "stitch", "cells", "sow"}): Way to lay the texture.
      "move" deforms elements, as in the paper. "still" leaves elements in place, and joins patches of the exemplar
      and its mirror images on a grid. If the exemplar has a lattice, stripes or courses, it becomes "lattice" or
      "courses". Patches are then in step with the lattice or stripes, or the texture is built course by course.
      "stitch" joins smaller patches, each where it fits best. "cells" bends jointed cells or stones of a heap into
      a new arrangement. "sow" places whole elements in a new arrangement on a grown background. "auto" tries the
      ways that the exemplar allows at a small size and uses the best one. If ``deformation`` or ``method`` is
      given, it is "move". Default: "auto".
    - ``copies`` (int): Number of deformed copies of the exemplar that the result is stitched from, 1 to 64.
      Default: 4.
    - ``patch_size`` (int, optional): Side of the patches that fill holes, in pixels, from 4 to the exemplar's
      shorter side. Default: 1/6 of the shorter side, but at least 12 and at most 32.
    - ``screening`` (float, optional): Weight of the original values when colours are corrected to hide seams, 0 to
      1e6 (section 3.6). A smaller weight spreads the correction farther from the seams. If None or 0, colours are
      not corrected. `texrs.blend` corrects other maps in the same way, with ``across=False`` if there are several
      exemplars. Default: 0.02.
    - ``method`` ({None, "paper"}): Algorithm to use. "paper" is the algorithm as printed, for comparison, with
      only its misprints repaired. It moves whole colour layers, once each or ``operations`` times. It stitches
      them at the cost of the paper, fills holes with the best match, and corrects colours without a weight on the
      original values. It ignores ``segmentation`` in ``elements``, and ``translate``, ``rotate`` and
      ``allow_mirror`` in ``deformation``. ``screening`` only switches its colour correction on, or off if 0.
      Default: the algorithm with departures from the paper.
    """

    exemplar: Word[Exemplars, list[Any]] = Word(lambda value, name: as_list(value))
    _: KW_ONLY
    seed: Word[int, int] = SEED
    wrap: Word[bool | Sequence[bool] | None, tuple[bool, bool]] = Word(periodic(True), default=None)
    weights: Word[Weights, Weights] = Word(as_given, default=None)
    density: Word[Density, Density] = Word(as_given, default=None)
    elements: Word[ElementOptions | ElementAnalysis, Any] = Word(as_given, default=ElementOptions())
    deformation: Word[DeformationOptions, DeformationOptions] = Word(
        instance(DeformationOptions), default=DeformationOptions()
    )
    way: Word[Choice, Choice] = Word(choice("auto", *get_args(Way)), default="auto")
    copies: Word[int, int] = Word(whole(1, 64), default=4)
    patch_size: Word[int | None, int | None] = Word(as_given, default=None)
    screening: Word[float | None, float] = Word(as_weight, default=SCREENING)
    method: Word[Method, Method] = Word(method(None, "paper"), default=None)
    progress: Word[Progress | bool | None, Progress | None] = PROGRESS

    @tied
    def exemplars(self) -> list[Exemplar]:
        """Exemplars that can be mixed."""
        images = [e.image if isinstance(e, ElementAnalysis) else e for e in self.exemplar]
        return [as_exemplar(image, minimum=MINIMUM_SIDE) for image in images]

    @tied
    def search(self) -> ElementOptions:
        """Options that control how elements are found, with the labels of given elements."""
        search = instance(ElementOptions)(take_entries(self.exemplar, self.exemplars, self.elements), "elements")
        check_together(self.exemplars, search.labels)
        return search

    @tied
    def extent(self) -> tuple[int, int]:
        """Size of each texture in pixels. Both subclasses have a size."""
        size = vars(self)["size"]
        sides = size if size is not None else [2 * n for n in self.exemplars[0].shape]
        rows, columns = as_size(sides, minimum=MINIMUM_SIDE, way=LARGER)
        return rows, columns

    @tied
    def shares(self) -> NDArray[np.float64]:
        """Share of each exemplar: (n,) for the whole texture, or (rows, columns, n)."""
        return as_shares(self.weights, len(self.exemplars), self.extent)

    @tied
    def covered(self) -> NDArray[np.float64] | None:
        """Share of the area that elements of each exemplar after the first cover: (n - 1,), or (rows, columns, n - 1)."""
        if self.density is None:
            return None
        if self.weights is not None or self.method is not None:
            other = "weights" if self.weights is not None else "method"
            raise InvalidInput(
                f"density: cannot be combined with {other}, because density scatters elements over the first exemplar"
            )
        return as_density(self.density, len(self.exemplars), self.extent)

    @tied
    def side(self) -> int | None:
        """Side of the patches that fill holes, in pixels, or None for the default."""
        most = min(min(e.shape) for e in self.exemplars)
        return None if self.patch_size is None else as_int(self.patch_size, "patch_size", 4, most)

    @tied
    def guides(self) -> list[Exemplar]:
        """Exemplars on one common scale of values, which is used for all decisions of the algorithm."""
        # Check that the required memory is available before the work begins.
        check_work("design", [e.pixels for e in self.exemplars], self.extent, way=LARGER, method=self.method)
        return scale_together(self.exemplars)

    @property
    def seeds(self) -> list[int]:
        """Seed of each texture."""
        return [(self.seed + k) % 2**64 for k in range(vars(self).get("count", 1))]

    @property
    def literal(self) -> bool:
        """If True, the paper is followed as printed."""
        return self.method == "paper"

    @property
    def shapes(self) -> tuple[tuple[int, ...], ...]:
        """Height and width of each exemplar."""
        return tuple(e.shape for e in self.exemplars)

    @property
    def images(self) -> list[Array]:
        """The exemplars in their original dtype and values."""
        return [e.image for e in self.exemplars]


@request
class Design(DesignRequest):
    """Parameters of `texrs.design`.

    - ``size`` (int or (rows, columns), optional): Size of the result, in pixels, at least 16 a side. Default:
      twice the size of the exemplar.
    """

    size: Word[Size, Size] = Word(as_given, default=None)


@request
class DesignVariants(DesignRequest):
    """Parameters of `texrs.design_variants`.

    - ``count`` (int): Number of textures, 1 to 4096.
    - ``seed`` (int): Number that selects the textures, 0 to 2^64 - 1. Their seeds are ``seed``, ``seed + 1``, ...
      Default: 0.
    - ``copies`` (int): Number of deformed copies of the exemplar that each texture is stitched from, 1 to 64. Default: 4.
    - ``size`` (int or (rows, columns), optional): Size of each texture, in pixels, at least 16 a side. Default: twice
      the size of the exemplar.
    """

    count: Word[int, int] = Word(whole(1, 4096))
    size: Word[Size, Size] = Word(as_given, default=None)


def take_entries(given: Sequence[object], exemplars: Sequence[Exemplar], elements: Any) -> Any:
    """Return the element options, with the labels of those exemplars that are element analyses.

    If ``elements`` is set explicitly, it overrides the labels of the element analyses.
    """
    if isinstance(elements, ElementAnalysis):
        shapes = [e.shape for e in exemplars]
        if shapes != [elements.mask.shape]:
            raise InvalidInput(
                f"elements: an ElementAnalysis of shape {elements.mask.shape} requires one exemplar of the same shape, got "
                f"shapes {shapes}; for several exemplars, pass each ElementAnalysis as exemplar"
            )
        return ElementOptions(labels=part_at_borders(elements))
    plain = isinstance(elements, ElementOptions) and (elements.layers, elements.segmentation) == (None, "auto")
    if not plain or elements.labels is not None or not any(isinstance(e, ElementAnalysis) for e in given):
        return elements
    labels: list[Any] = [part_at_borders(e) if isinstance(e, ElementAnalysis) else None for e in given]
    return ElementOptions(labels=labels if len(labels) > 1 else labels[0])


def part_at_borders(entry: ElementAnalysis) -> NDArray[np.integer[Any]]:
    """Return the labels of analysed elements, where elements that cross a periodic border are split.

    This is necessary because elements can only move within the exemplar.
    """
    from scipy.ndimage import label

    if not any(entry.wrap):
        return entry.labels
    pieces, count = label(entry.labels > 0)
    return np.asarray(entry.labels * (int(count) + 1) + pieces)


def check_together(exemplars: Sequence[Exemplar], labels: object) -> None:
    """Check that the exemplars can be mixed, and that labels are given for all exemplars or none."""
    if not exemplars:
        raise InvalidInput("exemplar: must contain at least one exemplar, got none")
    kinds = [(e.pixels.dtype.name, e.pixels.shape[-1]) for e in exemplars]
    if len(set(kinds)) > 1:
        raise InvalidInput(f"exemplar: all exemplars must have the same dtype and number of channels, got {kinds}")
    if isinstance(labels, list | tuple) and len(labels) != len(exemplars):
        raise InvalidInput(f"labels: must be a list of {len(exemplars)} entries, one per exemplar, got {len(labels)}")
    if labels is not None and not isinstance(labels, list | tuple) and len(exemplars) > 1:
        raise InvalidInput("labels: must be a list with one entry per exemplar if there are several exemplars")


def scale_together(exemplars: list[Exemplar]) -> list[Exemplar]:
    """Return float exemplars scaled to [0, 1] by one common scale.

    Integers are unchanged, because their dtype sets the scale.
    """
    if len(exemplars) == 1 or exemplars[0].pixels.dtype.kind != "f":
        return exemplars
    pixels = [e.pixels for e in exemplars]
    flat = to_unit(np.concatenate([p.reshape(-1, p.shape[-1]) for p in pixels]))
    ends = np.cumsum([p.shape[0] * p.shape[1] for p in pixels])[:-1]
    return [Exemplar(part.reshape(p.shape)) for part, p in zip(np.split(flat, ends), pixels, strict=True)]


def as_shares(weights: object, count: int, size: tuple[int, ...]) -> NDArray[np.float64]:
    """Return the checked shares of the exemplars: (count,) for the whole texture, or (rows, columns, count)."""
    if weights is None:
        return np.full(count, 1 / count)
    array = try_array(weights, np.float64)
    if array.shape == size and np.asarray(weights).dtype.kind in "iu":
        if array.min() < 0 or array.max() >= count:
            raise InvalidInput(
                f"weights: exemplar numbers must be integers from 0 to {count - 1}, got {array.min()} to {array.max()}"
            )
        return np.eye(count)[array.astype(np.intp)]
    if array.shape not in ((count,), (*size, count)):
        raise InvalidInput(
            f"weights: must be {count} numbers (one per exemplar), an integer array of shape {size}, "
            f"or an array of shape {(*size, count)}; got shape {array.shape}"
        )
    if not np.isfinite(array).all() or array.min() < 0 or (array.sum(axis=-1) <= 0).any():
        raise InvalidInput("weights: must be finite and at least 0, with a sum above 0 in each pixel")
    shares: NDArray[np.float64] = array / array.sum(axis=-1, keepdims=True)
    return shares


def as_density(density: object, count: int, size: tuple[int, ...]) -> NDArray[np.float64]:
    """Return the checked densities of the exemplars after the first: (count - 1,) or (rows, columns, count - 1)."""
    if count < 2:
        raise InvalidInput(
            "density: requires at least two exemplars, because it scatters elements of the further exemplars over the "
            "first; got one"
        )
    array = try_array(density, np.float64)
    if array.ndim == 0:
        array = np.full(count - 1, float(array))
    elif array.shape == size:
        array = np.repeat(array[..., np.newaxis], count - 1, axis=-1)
    if array.shape not in ((count - 1,), (*size, count - 1)):
        raise InvalidInput(
            f"density: must be one number, {count - 1} numbers (one per exemplar after the first), or an array of "
            f"shape {size} or {(*size, count - 1)}; got shape {array.shape}"
        )
    if not np.isfinite(array).all() or array.min() < 0 or array.sum(axis=-1).max() > 1:
        raise InvalidInput("density: must be shares of the area from 0 to 1 whose sum is at most 1")
    return array

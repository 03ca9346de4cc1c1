"""Divide an exemplar into a background and the elements that DESIGN moves.

The elements are those of `texrs.exemplar.element_finder`. If an image has none, or if they are the meshes of a net, a
jittered grid of cells is used instead. The layers of the paper are in `texrs.exemplar.layers`: a mean-shift filter, a
graph-based merge, and k-means of the mean colours of regions.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import (
    as_choice,
    as_float,
    as_image,
    as_instance,
    as_int,
    as_list,
    as_rgb,
    guidance,
    to_unit,
    try_array,
)
from texrs._cache import content_hash
from texrs._engine.noise import uniform
from texrs._progress import answering, ask, listen
from texrs._show import brief
from texrs._typing import Array, Floats, Labels, Progress
from texrs.errors import InvalidInput
from texrs.exemplar.courses import Courses, find_regularity
from texrs.exemplar.layers import Regions
from texrs.exemplar.period import Period, find_period
from texrs.exemplar.regularity import Lattice, scale_lattice
from texrs.exemplar.shapes import mark_outlines

if TYPE_CHECKING:
    from texrs.exemplar.element_finder import Arrangement, FoundElements

__all__ = ["ElementOptions", "Kind", "Segmentation", "segment"]

Kind: TypeAlias = Literal["auto", "components", "grid", "none"]
Marks: TypeAlias = NDArray[np.integer[Any]] | NDArray[np.bool_]

SURE = 0.75
"""Least probability that elements are separate, in a heap or jointed, so that they can be moved."""
USUAL_LAYERS = 2
"""Default number of colour layers: a background and one layer above it."""
GRID_SHARE = 1 / 6
"""Side of a grid cell, as a share of the shorter side of the exemplar."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ElementOptions:
    """Options for finding the elements of an exemplar.

    Attributes
    ----------
    layers : int, optional
        Number of colour layers, 1 to 16, if whole layers move ("none"). If it is given, "auto" means "none". Fewer are
        used if the image has fewer colours. Default: 2.
    segmentation : {"auto", "components", "grid", "none"}
        Elements that move. "components": elements that are found, as separate areas. "grid": jittered cells of 1/6 of
        the side, for images without elements. "none": whole colour layers, as in the paper. "auto": the elements, or
        the grid if there are none or if they are the meshes of a net.
    labels : (H, W) array of int, or a list of one per exemplar, optional
        Elements marked by hand: one number per element, where 0 is the background. They replace the segmentation.

    Raises
    ------
    InvalidInput
        If a field has another type or is out of range. The message contains its name.

    Examples
    --------
    >>> ElementOptions(layers=3)
    ElementOptions(layers=3)

    """

    layers: int | None = None
    segmentation: Kind = "auto"
    labels: Marks | Sequence[Marks] | None = None

    __repr__ = brief

    def __post_init__(self) -> None:
        if self.layers is not None:
            as_int(self.layers, "layers", 1, 16)
        as_choice(self.segmentation, "segmentation", ("auto", "components", "grid", "none"))
        if self.layers is not None and self.segmentation in ("components", "grid"):
            raise InvalidInput(f'layers: requires segmentation="none", got {self.segmentation!r}')
        for marks in as_list(self.labels):
            found = try_array(0 if marks is None else marks)
            if found.dtype.kind not in "biu":
                raise InvalidInput(f"labels: must be integers, got {found.dtype} {found.shape}")
            if found.size and int(found.min()) < 0:
                raise InvalidInput(f"labels: must be 0 (background) or more, got {int(found.min())}")

    @property
    def key(self) -> Hashable:
        """Hashable key of these options. Labels are represented by a hash of their content."""
        return self.layers, self.segmentation, None if self.labels is None else content_hash(np.asarray(self.labels))

    def select(self, number: int) -> ElementOptions:
        """Return the options for one of several exemplars, with the labels of this exemplar.

        Parameters
        ----------
        number : int
            Index of the exemplar, from 0.

        Returns
        -------
        ElementOptions
            The options with the labels of this exemplar. Unchanged if labels are not a list.

        Raises
        ------
        InvalidInput
            If the list does not contain labels for this exemplar.

        Examples
        --------
        >>> import numpy as np
        >>> from texrs import ElementOptions
        >>> marks = [np.zeros((4, 4), int), np.ones((4, 4), int)]
        >>> int(ElementOptions(labels=marks).select(1).labels.sum())
        16

        """
        if not isinstance(self.labels, list | tuple):
            return self
        return replace(self, labels=self.labels[as_int(number, "number", 0, len(self.labels) - 1)])


@dataclass(frozen=True, slots=True, eq=False)
class Segmentation:
    """Layers and elements of an exemplar.

    Attributes
    ----------
    layers : (H, W) int32
        Layer of each pixel. 0 is the background.
    elements : (H, W) int32
        Element of each pixel, from 1. 0 is the background.
    kind : {"components", "grid", "none", "labels"}
        Method that found the elements.
    reason : str
        Reason why "auto" used the grid, or why the elements are not moved. Empty otherwise.
    lattice : Lattice, optional
        Lattice of the exemplar, if any. None for elements marked by hand.
    courses : Courses, optional
        Courses of the exemplar, if any. The exemplar does not repeat along them, so `lattice` is None in this case.
    period : Period, optional
        Single period of an exemplar that repeats along one direction only, such as stripes. None if there is a lattice
        or courses.
    layout : {"separate", "heap", "jointed", "net", "none"}, optional
        Layout of the elements (`texrs.exemplar.element_finder`). None if they are not components.

    Examples
    --------
    >>> from texrs import Exemplar, samples
    >>> found = Exemplar(samples.dots((96, 96)).image).segment()
    >>> found.kind, found.elements.shape, found.elements.dtype
    ('components', (96, 96), dtype('int32'))

    """

    layers: Labels
    elements: Labels
    kind: str
    reason: str
    lattice: Lattice | None = None
    courses: Courses | None = None
    layout: Arrangement | None = None
    period: Period | None = None

    __repr__ = brief

    @property
    def repeats(self) -> Lattice | Period | None:
        """The lattice or the single period that patches are kept in step with."""
        return self.lattice or self.period

    @property
    def count(self) -> int:
        """Number of elements."""
        return int(self.elements.max())

    @property
    def nbytes(self) -> int:
        """Size of the arrays in bytes."""
        return self.layers.nbytes + self.elements.nbytes

    def freeze(self) -> Segmentation:
        """Make the arrays read-only, because the segmentation is shared, and return it.

        Returns
        -------
        Segmentation
            The same object.

        Examples
        --------
        >>> from texrs import Exemplar, samples
        >>> Exemplar(samples.dots((96, 96)).image).segment().freeze().layers.flags.writeable
        False

        """
        self.layers.flags.writeable = self.elements.flags.writeable = False
        return self

    def measure_depth(self, reach: float) -> Floats:
        """Return the depth of each pixel inside its element, 0 to 1.

        Parameters
        ----------
        reach : float
            Distance from the outline where the depth becomes 1, in pixels.

        Returns
        -------
        (H, W) float32
            0 outside elements and at their outlines, 1 at ``reach`` pixels and deeper.

        Raises
        ------
        InvalidInput
            If ``reach`` is not a number from 1e-6 to 1e9.

        Examples
        --------
        >>> from texrs import Exemplar, samples
        >>> depth = Exemplar(samples.dots((96, 96)).image).segment().measure_depth(4.0)
        >>> float(depth.min()), float(depth.max())
        (0.0, 1.0)

        """
        from scipy.ndimage import distance_transform_edt

        reach = as_float(reach, "reach", 1e-6, 1e9)
        labels = np.pad(self.elements, 1, mode="edge")
        outline = mark_outlines(labels)
        if not outline.any():
            return np.asarray(self.elements > 0, np.float32)
        distance = distance_transform_edt(~outline)[1:-1, 1:-1]
        return np.asarray(np.clip(distance / reach, 0, 1) * (self.elements > 0), np.float32)


def segment(
    image: Array, options: ElementOptions = ElementOptions(), *, progress: Progress | bool | None = None
) -> Segmentation:
    """Divide an exemplar into a background and elements.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array
        Exemplar of any dtype. The first three channels are used, or the first if there are two.
    options : ElementOptions
        Options for finding the elements.
    progress : callable or True, optional
        Function that is called as ``progress("segment", share)`` with a rising share. An exception from it stops the
        work. True shows a progress bar.

    Returns
    -------
    Segmentation
        Layers and elements.

    Raises
    ------
    InvalidInput
        If the image or the labels have another shape or type.

    Examples
    --------
    >>> from texrs import samples
    >>> from texrs.exemplar import ElementOptions, segment
    >>> bool(segment(samples.dots().image).count > 10)
    True
    >>> segment(samples.dots().image, ElementOptions(segmentation="grid")).count
    18

    """
    as_instance(options, "options", ElementOptions)
    progress = listen(progress)
    pixels = as_image(image)
    height, width = pixels.shape[:2]
    if options.labels is not None:
        return number_marks(options.labels, (height, width))
    watch = Steps(progress)
    if options.segmentation == "none" or options.layers is not None:
        rgb = np.ascontiguousarray(as_rgb(to_unit(pixels)))
        whole = Regions.of(rgb, watch).layers(options.layers or USUAL_LAYERS)
        return Segmentation(whole, whole.copy(), "none", "")
    # Import the finder only here, because it imports SciPy.
    from texrs.exemplar.element_finder import find_elements

    guide = as_rgb(guidance(pixels))
    with answering(watch):
        found = None if options.segmentation == "grid" else find_elements(guide)
        lattice, courses = find_regularity(guide) if found is None else (found.lattice, found.courses)
        period = None if lattice or courses else find_period(guide)
    reasons = [f"elements keep to {kept}" for kept in (lattice, courses) if kept]
    if found is not None:
        fault = find_fault(found)
        if options.segmentation == "components" or not fault:
            layers = (found.labels > 0).astype(np.int32)
            reason = "; ".join(reasons)
            return Segmentation(layers, found.labels, "components", reason, lattice, courses, found.layout, period)
        reasons.insert(0, fault)
    cells = draw_cells(height, width)
    layers = (cells > 0).astype(np.int32)
    return Segmentation(layers, cells, "grid", "; ".join(reasons), lattice, courses, period=period)


def shrink(parts: Segmentation, times: int) -> Segmentation:
    """Return the segmentation of an image whose sides are shorter by a whole factor.

    The label of a square block is that of its middle pixel, so small elements can vanish.
    """
    rows, columns = (n // times for n in parts.elements.shape)
    layers, elements = (
        each[times // 2 :: times, times // 2 :: times][:rows, :columns] for each in (parts.layers, parts.elements)
    )
    _, numbers = np.unique(elements, return_inverse=True)
    first = 0 if (elements == 0).any() else 1
    return replace(
        parts,
        layers=np.ascontiguousarray(layers),
        elements=np.asarray(numbers.reshape(rows, columns) + first, np.int32),
        lattice=None if parts.lattice is None else scale_lattice(parts.lattice, 1 / times),
        courses=None if parts.courses is None else parts.courses.scale(1 / times),
        period=None if parts.period is None else parts.period.scale(1 / times),
    ).freeze()


def find_fault(found: FoundElements) -> str:
    """Return the reason why the elements of an image cannot be moved, or an empty text if they can."""
    apart = sum(found.layouts[layout] for layout in ("separate", "heap", "jointed"))
    if not found.elements or apart < SURE:
        other = "the meshes of a net" if found.layouts["net"] > found.layouts["none"] else "not elements of a texture"
        return f"the areas that are found are {other} with a probability of {1 - apart:.0%}"
    return ""


class Steps:
    """Reports progress of a work with an unknown number of steps: each call moves the share closer to 1."""

    def __init__(self, progress: Progress | None) -> None:
        self.progress, self.left = progress, 1.0

    def __call__(self) -> None:
        """Report that a step is finished."""
        self.left *= 0.9
        if self.progress is None:
            ask()
        else:
            self.progress("segment", 1 - self.left)


def number_marks(labels: Marks | Sequence[Marks], shape: tuple[int, int]) -> Segmentation:
    """Return the segmentation for elements marked by hand. Elements are renumbered consecutively."""
    marks = np.asarray(labels)
    if marks.shape != shape or marks.dtype.kind not in "biu":
        raise InvalidInput(f"labels: must be integers of shape {shape}, got {marks.dtype} {marks.shape}")
    values, dense = np.unique(marks, return_inverse=True)
    elements = dense.reshape(shape).astype(np.int32) + np.int32(values[0] != 0)
    return Segmentation((elements > 0).astype(np.int32), elements, "labels", "")


def draw_cells(height: int, width: int) -> Labels:
    """Divide an image into jittered Voronoi cells, for images without separate elements.

    Alternate cells are elements, as on a chequerboard. The others are the background.
    """
    from scipy.spatial import KDTree

    side = max(6.0, GRID_SHARE * min(height, width))
    rows, columns = max(1, round(height / side)), max(1, round(width / side))
    centres, chosen = [], []
    for i in range(rows):
        for j in range(columns):
            jitter = [0.5 + 0.6 * (uniform(0, i, j, axis) - 0.5) for axis in range(2)]
            centres.append([(i + jitter[0]) * height / rows, (j + jitter[1]) * width / columns])
            chosen.append((i + j) % 2 == 0)
    label = np.zeros(len(centres), np.int32)
    label[np.array(chosen)] = np.arange(1, sum(chosen) + 1, dtype=np.int32)
    grid = np.stack(np.meshgrid(np.arange(height), np.arange(width), indexing="ij"), axis=-1).reshape(-1, 2)
    nearest = KDTree(np.array(centres)).query(grid)[1]
    return np.asarray(label[nearest], np.int32).reshape(height, width)

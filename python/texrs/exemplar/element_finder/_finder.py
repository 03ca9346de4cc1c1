"""The finder: from an image to its elements, their outlines and their layout."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from texrs._arrays import as_array, as_image, as_rgb, as_seed, guidance
from texrs._cache import Cache, content_hash
from texrs._checks import as_int
from texrs._notices import ignore
from texrs._progress import answering, ask, listen
from texrs._typing import Bools, Floats, Labels, Progress
from texrs.errors import InvalidInput
from texrs.exemplar.courses import Courses, find_regularity
from texrs.exemplar.element_finder._contour_strength import find_contours
from texrs.exemplar.element_finder._layout_class import LAYOUTS, Arrangement, read_layout
from texrs.exemplar.element_finder._outline_cuts import enlarge, refine_outlines
from texrs.exemplar.element_finder._overlaps import Overlap, find_overlaps
from texrs.exemplar.element_finder._selection import Choice, choose, drop_doubtful
from texrs.exemplar.regularity import Lattice

WORK = 200, 360
"""Least and largest length of the longer side of the reduced image, in pixels."""
LEAST = 8
"""Length of the shorter side of the reduced image below which nothing is searched for, in pixels."""
MANY = 1000
"""Largest number of marked elements. Each is searched for by itself."""
EMPTY = 0.9
"""Probability of the layout "none" if no candidates exist."""
RIGHT = 10.14, 8.34, 5.28, -11.99
"""Weights of a constant, the quality, the logarithm of the value of the choice and the mean quality in the log odds.

A logistic regression on elements of 180 images. Fitted without one half of the drawn images, the mean difference between
stated probability and frequency is 0.04 on that half.
"""


@dataclass(frozen=True, slots=True)
class Element:
    """An element of an image.

    Attributes
    ----------
    centre : (float, float)
        Row and column of the centroid, in pixels.
    angle : float
        Angle of the longer axis in radians, from the column axis towards the row axis, -pi/2 to pi/2.
    scale : float
        Square root of the ratio of the area to the median area of all elements. It is 1 for the median.
    area : int
        Number of pixels.
    confidence : float
        Probability that this is a whole element, 0 to 1.
    at_border : bool
        Whether the border of the image cuts it.
    below : tuple of int
        Numbers of the elements on top of this one, if the layout is a heap.

    Examples
    --------
    >>> from texrs import samples
    >>> from texrs.exemplar.element_finder import find_elements
    >>> found = find_elements(samples.dots((128, 128)).image)
    >>> all(element.area == found.mask(i).sum() for i, element in enumerate(found.elements))
    True

    """

    centre: tuple[float, float]
    angle: float
    scale: float
    area: int
    confidence: float
    at_border: bool
    below: tuple[int, ...] = ()

    @property
    def cut(self) -> bool:
        """Whether the border of the image or another element cuts it."""
        return self.at_border or bool(self.below)


@dataclass(frozen=True, slots=True, eq=False)
class FoundElements:
    """The elements of an image.

    Attributes
    ----------
    labels : int32 array, (H, W)
        Element of each pixel: 0 is the background, ``i + 1`` is ``elements[i]``.
    elements : tuple of Element
        The elements.
    layout : {"separate", "heap", "jointed", "net", "none"}
        Arrangement of the elements: on a background, in a heap, as cells between joints, or as the meshes of a net.
        "none": a person would not outline elements.
    confidence : float
        Probability that the layout is right, 0 to 1.
    layouts : dict of str to float
        Probability of each layout.
    overlaps : tuple of Overlap
        Overlapping pairs of elements of a heap, each with the upper and the lower element.
    lattice : Lattice, optional
        Lattice of the image, if any, with its ``confidence``. The elements need not be on it one by one.
    courses : Courses, optional
        Courses of the image, if any, with their ``confidence``. `lattice` is None in this case.

    Examples
    --------
    >>> from texrs import samples
    >>> from texrs.exemplar.element_finder import find_elements
    >>> found = find_elements(samples.dots((128, 128)).image)
    >>> found.labels.shape
    (128, 128)
    >>> len(found.elements) == int(found.labels.max())
    True
    >>> found.background.dtype
    dtype('bool')

    """

    labels: Labels
    elements: tuple[Element, ...]
    layout: Arrangement
    confidence: float
    layouts: dict[Arrangement, float]
    overlaps: tuple[Overlap, ...] = ()
    lattice: Lattice | None = None
    courses: Courses | None = None

    def __repr__(self) -> str:
        """Return the number of elements, the layout, and the lattice or courses, with their confidence."""
        rows, columns = self.labels.shape
        kept = [f", {each}, {each.confidence:.0%} sure" for each in (self.lattice, self.courses) if each is not None]
        found = f"{len(self.elements)} in {rows} x {columns}, {self.layout}, {self.confidence:.0%} sure"
        return f"FoundElements({found}{''.join(kept)})"

    @property
    def background(self) -> Bools:
        """Pixels that are not part of an element, shape (H, W)."""
        return np.asarray(self.labels == 0)

    def mask(self, number: int) -> Bools:
        """Return the pixels of an element.

        Parameters
        ----------
        number : int
            Index of the element in ``elements``, from 0.

        Returns
        -------
        bool array, (H, W)
            True at the pixels of the element.

        Raises
        ------
        InvalidInput
            The element does not exist.

        Examples
        --------
        >>> from texrs import samples
        >>> from texrs.exemplar.element_finder import find_elements
        >>> found = find_elements(samples.dots((128, 128)).image)
        >>> int(found.mask(0).sum()) == found.elements[0].area
        True

        """
        if not self.elements:
            raise InvalidInput(f"number: must be of an element, but none was found, got {number!r}")
        index = as_int(number, "number", 0, len(self.elements) - 1)
        return np.asarray(self.labels == index + 1)


_FOUND: Cache[bytes, FoundElements] = Cache(1 << 26, lambda found: found.labels.nbytes)
"""Recent results, by the colours of the image and the seed."""


def find_elements(
    image: object, *, marks: object = None, seed: int = 0, progress: Progress | bool | None = None
) -> FoundElements:
    """Find the elements that an image repeats, their layout, and their lattice or courses.

    Recent results are cached by the colours of the image.

    Parameters
    ----------
    image : array_like, path_like or PIL.Image.Image
        Shape (H, W) or (H, W, C), any dtype. The first three channels are colours. Transparent pixels are grey.
    marks : array_like of int, optional
        Known pixels, shape (H, W), such as strokes of a pen. Numbers from 1 are those of elements, -1 is the background,
        and 0 is unknown. A few pixels of each element are enough, and at most 1000 elements have marks.
    seed : int
        Seed of the pixels that the code words are learned from. Default: 0.
    progress : callable or True, optional
        Function that is called as ``progress("elements", share)`` during the work. An exception from it stops the
        work. True shows a progress bar.

    Returns
    -------
    FoundElements
        ``labels``, ``elements``, ``layout``, ``lattice``, ``courses`` and their confidences. The labels are read-only.

    Raises
    ------
    InvalidInput
        If the image, the marks or the seed have another type, shape or range.

    Warns
    -----
    InputWarning
        If nothing is found, so that the marks are ignored.

    Examples
    --------
    >>> from texrs import samples
    >>> from texrs.exemplar.element_finder import find_elements
    >>> image = samples.dots((128, 128)).image
    >>> found = find_elements(image)
    >>> found.layout, found.lattice
    ('separate', None)

    A stroke over one of the elements says that it is background:

    >>> marks = -found.mask(0).astype(int)
    >>> bool(find_elements(image, marks=marks).labels[found.mask(0)].any())
    False

    """
    pixels, seed, progress = as_image(image, "image"), as_seed(seed), listen(progress)
    watch = progress or (lambda stage, share: ask())
    # The key contains the colours, so that an image and its colours in [0, 1] share one result.
    rgb = as_rgb(guidance(pixels))
    known = None if marks is None else as_array(marks, "marks", np.int32, pixels.shape[:2])
    if known is not None and known.min() < -1:
        raise InvalidInput(f"marks: must be -1 (background), 0 (unknown) or numbers of elements, got {known.min()}")
    if known is not None and (count := len(np.unique(known[known > 0]))) > MANY:
        raise InvalidInput(f"marks: must have at most {MANY} numbers of elements, got {count}")
    found = _FOUND.get_or_make(
        content_hash(rgb, seed, *([] if known is None else [known])),
        lambda: analyse(rgb, seed, lambda share: watch("elements", share), known),
    )
    if known is not None and known.any() and not found.elements:
        ignore("marks: nothing was found in the image, so they are not used")
    watch("elements", 1.0)
    return found


def analyse(rgb: Floats, seed: int, watch: Callable[[float], object], marks: Labels | None = None) -> FoundElements:
    """Find the elements of an image (H, W, 3) in [0, 1]. `watch` is called with the finished share of the work."""
    with answering(watch, 0.0):
        lattice, courses = find_regularity(rgb)
    return replace(read_elements(rgb, seed, watch, marks), lattice=lattice, courses=courses)


def read_elements(rgb: Floats, seed: int, watch: Callable[[float], object], marks: Labels | None) -> FoundElements:
    """Find the elements of an image and their layout, without its lattice and its courses."""
    small = reduce(rgb)
    if min(small.shape[:2]) < LEAST or float(np.ptp(small)) == 0:
        return report_nothing(rgb.shape[0], rgb.shape[1])
    with answering(watch, 0.0):
        contours = find_contours(small, seed)
    with answering(watch, 0.2):
        choice = choose(contours, None if marks is None else scale_marks(marks, small.shape))
    if choice is None:
        return report_nothing(rgb.shape[0], rgb.shape[1])
    layouts = read_layout(choice, contours)
    layout = max(LAYOUTS, key=lambda name: layouts[name])
    if layout == "separate":
        choice = drop_doubtful(choice)
    with answering(watch, 0.8):
        labels = refine_outlines(choice.labels, contours, rgb, layout == "separate")
    labels.flags.writeable = False
    overlaps = find_overlaps(enlarge(labels, contours.words.shape)) if layout == "heap" else ()
    elements = measure_elements(labels, choice, overlaps)
    return FoundElements(labels, elements, layout, layouts[layout], layouts, overlaps)


def scale_marks(marks: Labels, shape: tuple[int, ...]) -> Labels:
    """Return the marks of an image at its reduced size. Small marks stay."""
    places = np.argwhere(marks)
    small = np.zeros(shape[:2], np.int32)
    small[tuple((places * small.shape // marks.shape).T)] = marks[tuple(places.T)]
    return small


def report_nothing(rows: int, columns: int) -> FoundElements:
    """Return the result of an image without elements."""
    layouts = dict.fromkeys(LAYOUTS, (1 - EMPTY) / (len(LAYOUTS) - 1)) | {"none": EMPTY}
    return FoundElements(np.zeros((rows, columns), np.int32), (), "none", EMPTY, layouts)


def reduce(rgb: Floats) -> Floats:
    """Return an image whose longer side is in the range of `WORK`."""
    from skimage.transform import resize

    longer = max(rgb.shape[:2])
    factor = float(np.clip(1.0, WORK[0] / longer, WORK[1] / longer))
    # Means of whole blocks first, because a blur of all pixels takes longer than all that follows.
    block = max(1, int(1 / (2 * factor)))
    if block > 1:
        rows, columns = (n // block * block for n in rgb.shape[:2])
        if min(rows, columns) == 0:
            return rgb[:1, :1]
        rgb = rgb[:rows, :columns].reshape(rows // block, block, columns // block, block, 3).mean((1, 3))
        factor *= block
    if factor == 1:
        return rgb
    size = tuple(max(1, round(n * factor)) for n in rgb.shape[:2])
    return np.asarray(resize(rgb, size, order=1, anti_aliasing=factor < 1), np.float32)


def measure_elements(labels: Labels, choice: Choice, overlaps: tuple[Overlap, ...]) -> tuple[Element, ...]:
    """Return the measures of all elements."""
    count = len(choice.chosen)
    area, rows, columns = np.zeros(count, int), np.zeros(count), np.zeros(count)
    for i, box in enumerate(ndimage.find_objects(labels, count)):
        if box is not None:
            y, x = np.nonzero(labels[box] == i + 1)
            area[i], rows[i], columns[i] = len(y), box[0].start + y.mean(), box[1].start + x.mean()
    usual = float(np.median(area[area > 0])) if area.any() else 1.0
    border = np.zeros(count + 1, bool)
    for line in (labels[0], labels[-1], labels[:, 0], labels[:, -1]):
        border[line] = True
    above: dict[int, list[int]] = {}
    for overlap in overlaps:
        if overlap.confidence > 0.75:
            above.setdefault(overlap.below, []).append(overlap.above)
    mean = float(np.average(choice.quality, weights=choice.chosen.features["area"]))
    odds = RIGHT[0] + RIGHT[1] * choice.quality + RIGHT[2] * np.log(max(choice.value, 0.02)) + RIGHT[3] * mean
    sure = 1 / (1 + np.exp(-odds))
    return tuple(
        Element(
            (float(rows[i]), float(columns[i])),
            float(choice.chosen.features["angle"][i]),
            float(np.sqrt(area[i] / usual)),
            int(area[i]),
            float(sure[i]),
            bool(border[i + 1]),
            tuple(above.get(i, ())),
        )
        for i in range(count)
    )

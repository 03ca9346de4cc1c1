"""Define the analysis of a texture's elements, and store it in a file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import MAX_PIXELS, as_image, as_instance, as_wrap
from texrs._engine.coherence import Similarity
from texrs._show import as_png
from texrs._typing import Array, Labels, Path
from texrs.elements._arrangement import Arrangement, describe_arrangement
from texrs.elements._drawing import draw_plain, mark_points
from texrs.elements._layout import Layout, LayoutName, as_layout
from texrs.elements.instances import Instance, Labelled, cut_instances, label_elements
from texrs.elements.known import as_element_labels, extend_points, measure_box, measure_centres
from texrs.errors import FileError, InvalidInput
from texrs.exemplar import Exemplar
from texrs.exemplar.shapes import mark_outlines
from texrs.io import Header, atomic, read_arrays
from texrs.samples import Sample

FORMAT = 2
"""Version of the file format and of the analysis.

Files of other versions are rejected, and a database analyses their textures again.
"""
MARK = "texrs_elements"
WORDS = (MARK, "hash", "box", "layout", "directions", "wrap", "report", "numbers")
"""Names of the small arrays in a file, whose size does not depend on the size of the image."""
LONGEST, CHANNELS, SIMILAR = 2**26, 64, 16
"""Maximum size of such an array in bytes, number of channels of an image, and size of a similarity set."""


@dataclass(frozen=True, eq=False)
class ElementAnalysis:
    """The elements of one texture.

    Attributes
    ----------
    image : ndarray of shape (height, width, channels)
        The texture, in its own dtype.
    points : ndarray of shape (n, 2), float64
        Centres of the elements, (row, column), in pixels.
    mask : ndarray of shape (height, width), bool
        Foreground: True on elements. For jointed elements, False is the mortar.
    box : tuple of int
        Height and width of the box of an element, odd, in pixels.
    layout : Layout
        Layout of the elements: disjoint, connected or jointed. Values that `Layout` accepts are converted.
    scores : ndarray of shape (n,), float64
        Similarity of each element to the chosen element, -1 to 1. For elements of the element finder, the probability
        that each is a whole element.
    directions : tuple of float
        Directions of the rows of points, in degrees in [0, 180), strongest first. Empty if they form no rows.
    wrap : tuple of bool
        True if the texture is tileable along rows, and along columns.
    report : dict
        Results and decisions of the analysis, as text, numbers and lists.
    angles : ndarray of shape (n,), float64, optional
        Rotation of each element relative to the chosen element, in degrees. Each is one of the directions of the
        search.
    scales : ndarray of shape (n,), float64, optional
        Size of each element relative to the chosen element, 0.25 to 4. Each is one of the sizes of the search.
    sets : Similarity, optional
        Result of `similarity`, if it was computed so that `save` stores it.
    known : ndarray of shape (height, width), int32, optional
        Element of each pixel, from 1 in the order of the points, if it was given to `of_labels` or comes from the
        element finder. Higher numbers than the number of points are elements that the border cuts.

    Examples
    --------
    >>> from texrs import elements, samples
    >>> sample = samples.load("dots", size=(96, 96))
    >>> found = elements.analyse(sample.image, mask=sample.mask, layout="disjoint")
    >>> found.points.shape[1], found.mask.dtype, str(found.layout)
    (2, dtype('bool'), 'disjoint')

    """

    image: NDArray[Any]
    points: NDArray[np.float64]
    mask: NDArray[np.bool_]
    box: tuple[int, int]
    layout: Layout
    scores: NDArray[np.float64]
    directions: tuple[float, ...] = ()
    wrap: tuple[bool, bool] = (False, False)
    report: dict[str, Any] = field(default_factory=dict)
    angles: NDArray[np.float64] | None = None
    scales: NDArray[np.float64] | None = None
    sets: Similarity | None = None
    known: Labels | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "layout", as_layout(self.layout))

    def __repr__(self) -> str:
        rows, columns = self.image.shape[:2]
        return f"Elements({len(self.points)} of box {self.box} in {rows} x {columns}, {self.layout})"

    def _repr_png_(self) -> bytes:
        """Show the image in a notebook, with a cross on each element."""
        return as_png(mark_points(draw_plain(self.image), self.points, self.box))

    @classmethod
    def of_sample(cls, sample: Sample, *, wrap: tuple[bool, bool] = (False, False)) -> ElementAnalysis:
        """Return the analysis of a generated texture whose elements are known.

        Parameters
        ----------
        sample : Sample
            A texture of `texrs.samples` with centres and a mask.
        wrap : (bool, bool)
            Axes (rows, columns) along which the sample was generated tileable.

        Returns
        -------
        ElementAnalysis
            The analysis with the centres and mask of the sample. Each element has similarity 1.

        Raises
        ------
        InvalidInput
            If the elements of the sample are not known.

        Examples
        --------
        >>> from texrs import samples
        >>> from texrs.elements import ElementAnalysis
        >>> ElementAnalysis.of_sample(samples.bricks((96, 96)))
        Elements(3 of box (25, 47) in 96 x 96, jointed)

        """
        as_instance(sample, "sample", Sample)
        if sample.centres is None or sample.labels is None or sample.image.ndim > 3 or len(sample.centres) < 3:
            raise InvalidInput(f"sample: must be an image with at least three known elements, got {sample!r}")
        mask = sample.labels > 0 if sample.mask is None else sample.mask
        layout, scores = Layout(sample.layout or "disjoint"), np.ones(len(sample.centres))
        # The cells of a wall are known from its generator. Separate elements are derived from their mask.
        known = sample.labels if layout == Layout.JOINTED else None
        box = measure_box(sample.labels)
        return cls(sample.image, sample.centres, mask, box, layout, scores, wrap=wrap, known=known)

    @classmethod
    def of_labels(
        cls,
        image: Array,
        labels: Array,
        *,
        layout: Layout | LayoutName = Layout.DISJOINT,
        wrap: Sequence[bool] | bool = False,
    ) -> ElementAnalysis:
        """Return the analysis of a texture from a label image of its elements.

        The labels may be drawn by hand or come from another program.

        Parameters
        ----------
        image : (H, W) or (H, W, C) array
            The texture.
        labels : (H, W) array of int or bool
            Element of each pixel, as any positive number; 0 is background, mortar or joint. Each connected component
            of a bool mask is an element.
        layout : {"disjoint", "jointed", "connected"}
            Layout of the elements. Cells, such as bricks and stones, are jointed, and do not need joints between them.
        wrap : bool or (bool, bool)
            Axes along which the texture is tileable. A single bool applies to both.

        Returns
        -------
        ElementAnalysis
            The analysis, with one point per label at its centroid.

        Raises
        ------
        InvalidInput
            If the labels have another shape than the image, there are fewer than three elements, or separate elements
            have no background.

        Examples
        --------
        >>> from texrs import samples
        >>> from texrs.elements import ElementAnalysis
        >>> wall = samples.bricks((96, 96))
        >>> ElementAnalysis.of_labels(wall.image, wall.labels, layout="jointed")
        Elements(8 of box (25, 47) in 96 x 96, jointed)

        """
        pixels, around, kind = as_image(image, "image"), as_wrap(wrap, "wrap"), as_layout(layout)
        known = as_element_labels(labels, (pixels.shape[0], pixels.shape[1]), around)
        mask, count = known > 0, int(known.max())
        if count < 3:
            raise InvalidInput(f"labels: must contain at least three elements, got {count}")
        if mask.all() and kind == Layout.DISJOINT:
            raise InvalidInput(
                'labels: must contain background (0) around separate elements; for cells use layout="jointed"'
            )
        if mask.all():
            mask = ~mark_outlines(known)
        points = measure_centres(known, around)
        return cls(
            image, points, mask, measure_box(known), kind, np.ones(count), wrap=(around[0], around[1]), known=known
        )

    @cached_property
    def arrangement(self) -> Arrangement:
        """Arrangement of the elements: spacing, lattice or courses, and whether the space between them is darker.

        Examples
        --------
        >>> from texrs import layouts
        >>> drawn = layouts.lattice(100, (0, 20), (17, 10))
        >>> drawn.arrangement.lattice
        ((0.0, 20.0), (17.0, -10.0))
        >>> layouts.courses(160, 20, 40, shift=0.3).arrangement.courses is None
        False

        """
        return describe_arrangement(self.image, self.points, self.mask)

    @cached_property
    def labels(self) -> Labels:
        """Element of each pixel, (H, W) int32, from 1. 0 is the background.

        The array is computed on first use and is read-only.

        Element ``k + 1`` belongs to point ``k``. Higher numbers are cells and components of the foreground that do not
        have a point. Separate elements are the components of the mask. A component with several points is divided
        between them. For a connected texture whose cells are certain, the elements are the cells without their joints.
        Otherwise, each pixel belongs to the nearest element. Small components without a point are background.

        Examples
        --------
        >>> from texrs import samples
        >>> from texrs.elements import ElementAnalysis
        >>> entry = ElementAnalysis.of_sample(samples.load("dots", size=(96, 96)))
        >>> entry.labels.shape, bool(entry.mask[entry.labels > 0].all())
        ((96, 96), True)

        """
        return self._labelled.labels

    @cached_property
    def instances(self) -> tuple[Instance, ...]:
        """The elements as separate objects, each with a mask, in the order of `labels`. Computed on first use.

        Examples
        --------
        >>> from texrs import samples
        >>> from texrs.elements import ElementAnalysis
        >>> entry = ElementAnalysis.of_sample(samples.load("dots", size=(96, 96)))
        >>> one = entry.instances[0]
        >>> bool(one.mask.sum() == (entry.labels == 1).sum()), one.confidence
        (True, 1.0)

        """
        return cut_instances(self._labelled, self.angles, self.scales, self.wrap)

    @cached_property
    def _labelled(self) -> Labelled:
        if self.known is not None:
            points = extend_points(self.points, self.known, self.wrap)
            # Elements without a point are as certain as the others on average.
            rest = np.full(len(points) - len(self.points), self.scores.mean())
            return Labelled(self.known, points, np.concatenate([self.scores, rest]).clip(0, 1))
        found = label_elements(self.image, self.mask, self.points, self.scores, self.box, self.layout, self.wrap)
        found.labels.flags.writeable = False
        return found

    def similarity(self, *, k: int = 3, progress: Callable[[float], object] | None = None) -> Similarity:
        """Return the most similar samples for each pixel of the texture, starting with the pixel itself.

        Similarity is measured by appearance vectors of 5 x 5 windows. Similar samples are more than 3 pixels apart.
        The result is computed on first use and cached.

        Parameters
        ----------
        k : int
            Number of samples per pixel, including itself, 1 to 16.
        progress : callable, optional
            Function that is called as ``progress(share)`` with the finished share of the work. An exception from it
            stops the work.

        Returns
        -------
        Similarity
            Similar samples. ``sets``, (H W, k), contains the flat indices of samples, starting with the pixel itself.

        Raises
        ------
        InvalidInput
            If ``k`` is out of range.

        Examples
        --------
        >>> from texrs import elements, samples
        >>> sample = samples.load("dots", size=(64, 64))
        >>> elements.analyse(sample.image, mask=sample.mask, layout="disjoint").similarity(k=2).sets.shape
        (4096, 2)

        """
        if self.sets is not None and self.sets.k == k:
            return self.sets
        return Exemplar(self.image, repeat=self.wrap).similarity(-1, k=k, progress=progress)

    def with_similarity(self, *, k: int = 3, progress: Callable[[float], object] | None = None) -> ElementAnalysis:
        """Return the analysis with similar samples of all pixels, so that `save` stores them.

        Parameters
        ----------
        k : int
            Number of samples per pixel, including itself, 1 to 16.
        progress : callable, optional
            Function that is called as ``progress(share)`` with the finished share of the work. An exception from it
            stops the work.

        Returns
        -------
        ElementAnalysis
            The same analysis with the attribute `sets`.

        Raises
        ------
        InvalidInput
            If ``k`` is out of range.

        Examples
        --------
        >>> from texrs import elements, samples
        >>> sample = samples.load("dots", size=(64, 64))
        >>> found = elements.analyse(sample.image, mask=sample.mask, layout="disjoint")
        >>> found.sets is None, found.with_similarity(k=2).sets.k
        (True, 2)

        """
        return replace(self, sets=self.similarity(k=k, progress=progress))

    def save(self, path: Path) -> None:
        """Write the analysis to an ``.npz`` file, which `texrs.elements.load` reads. A failure leaves no partial file.

        Parameters
        ----------
        path : path_like
            Path with the suffix .npz. An existing file is replaced after everything is written.

        Raises
        ------
        FileError
            If the file cannot be written.

        Examples
        --------
        >>> import pathlib, tempfile
        >>> from texrs import elements, samples
        >>> found = elements.ElementAnalysis.of_sample(samples.dots((96, 96)))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = pathlib.Path(folder, "dots.npz")
        ...     found.save(path)
        ...     elements.load(path)
        Elements(8 of box (19, 19) in 96 x 96, disjoint)

        """
        parts: dict[str, Any] = {
            MARK: np.array(FORMAT),
            "image": self.image,
            "hash": _encode_text(hash_image(self.image)),
            "points": self.points,
            "mask": self.mask,
            "box": np.array(self.box, np.int64),
            "layout": _encode_text(self.layout),
            "scores": self.scores,
            # Start with NaN, because an empty array could not be distinguished from a damaged one.
            "directions": np.array([np.nan, *self.directions]),
            "wrap": np.array(self.wrap, bool),
            "report": _encode_text(json.dumps(self.report, allow_nan=False)),
        }
        for name in ("angles", "scales"):
            if getattr(self, name) is not None:
                parts[name] = getattr(self, name)
        if self.known is not None:
            parts["known"] = self.known
        if self.sets is not None:
            parts |= {"sets": self.sets.sets, "numbers": np.array(self.sets.numbers)}
        with atomic(path) as temporary, open(temporary, "wb") as file:
            np.savez_compressed(file, allow_pickle=False, **parts)


def hash_image(image: Array) -> str:
    """Return a hash of an image: its shape, dtype and values.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array
        Image of any supported dtype.

    Returns
    -------
    str
        The hash as 32 hexadecimal digits.

    Raises
    ------
    InvalidInput
        If the argument is not an image.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import elements
    >>> len(elements.hash_image(np.zeros((8, 8), np.uint8)))
    32

    """
    pixels = as_image(image)
    made = hashlib.blake2b(digest_size=16, person=b"texrs.elements")
    made.update(repr((pixels.shape, pixels.dtype.str)).encode())
    made.update(pixels.data)
    return made.hexdigest()


def load(path: Path) -> ElementAnalysis:
    """Read an analysis that `ElementAnalysis.save` wrote.

    Parameters
    ----------
    path : path_like
        Path of the .npz file.

    Returns
    -------
    ElementAnalysis

    Raises
    ------
    FileError
        If the file is missing or damaged, has another version, or does not contain an analysis.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from texrs import elements, samples
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "wall.npz")
    ...     elements.ElementAnalysis.of_sample(samples.bricks((96, 96))).save(path)
    ...     elements.load(path).layout
    <Layout.JOINTED: 'jointed'>

    """

    def choose(headers: Mapping[str, Header]) -> list[str]:
        if MARK not in headers:
            raise FileError(f"{path}: is not an analysis of a texture's elements")
        return choose_parts(headers, path)

    # Check the headers first, so that a large file of another kind is not read.
    parts = read_arrays(path, choose=choose)
    version = parts[MARK].ravel().tolist()
    if version != [FORMAT]:
        raise FileError(
            f"{path}: has version {', '.join(map(str, version))}, but this texrs reads version {FORMAT}; "
            "analyse the texture again"
        )
    try:
        # Check every part now, because a damaged file would cause an error much later, during a splice.
        image = as_image(parts["image"])
        if _decode_text(parts["hash"]) != hash_image(image):
            raise InvalidInput("its image differs from the analysed image")
        layout, report = Layout(_decode_text(parts["layout"])), json.loads(_decode_text(parts["report"]))
        if not isinstance(report, dict):
            raise InvalidInput("report")
        count, size = len(parts["points"]), image.shape[:2]
        shapes = {"points": (count, 2), "mask": size, "box": (2,), "scores": (count,), "wrap": (2,)}
        shapes |= {name: (count,) for name in ("angles", "scales") if name in parts}
        shapes |= {"known": size} if "known" in parts else {}
        for name, shape in shapes.items():
            if parts[name].shape != shape:
                raise InvalidInput(f"{name} must have shape {shape}, got {parts[name].shape}")
        if parts["mask"].dtype != np.bool_ or not np.isfinite(parts["points"]).all():
            raise InvalidInput("mask or points")
        # The similarity sets are stored only if they were computed.
        sets = None
        if "sets" in parts:
            sets = Similarity(parts["sets"].astype(np.uint32), int(parts["numbers"].ravel()[0]))
            if sets.sets.ndim != 2 or len(sets.sets) != size[0] * size[1] or int(sets.sets.max()) >= len(sets.sets):
                raise InvalidInput("similarity sets")
        known = parts["known"].astype(np.int32) if "known" in parts else None
        if known is not None:
            # Labels must be 1, 2, ... without gaps, at least one per point.
            names = np.unique(known[known != 0])
            if len(names) < count or not np.array_equal(names, np.arange(1, len(names) + 1)):
                raise InvalidInput("known elements")
        rows, columns = (int(n) for n in parts["box"])
        return ElementAnalysis(
            image,
            parts["points"].astype(np.float64),
            parts["mask"],
            (rows, columns),
            layout,
            parts["scores"].astype(np.float64),
            tuple(float(p) for p in parts["directions"][1:]),
            (bool(parts["wrap"][0]), bool(parts["wrap"][1])),
            report,
            parts.get("angles"),
            parts.get("scales"),
            sets,
            known,
        )
    except (InvalidInput, KeyError, TypeError, ValueError, OverflowError) as error:
        raise FileError(f"{path}: is damaged ({' '.join(str(error).split())})") from None


def choose_parts(headers: Mapping[str, Header], path: Path) -> list[str]:
    """Return the names of the arrays in a file that form an analysis, after checking their sizes.

    An error is raised before any array is read if one is larger than the image permits.
    """
    shape = headers["image"].shape if "image" in headers else ()
    pixels = prod(shape[:2])
    if len(shape) not in (2, 3) or not 0 < pixels <= MAX_PIXELS or prod(shape[2:]) > CHANNELS:
        raise FileError(f"{path}: is damaged (an image of shape {shape})")
    # Allow at most one element per pixel, and limit the size of texts.
    one = {"mask": 1, "points": 16, "scores": 8, "angles": 8, "scales": 8, "known": 8, "sets": 8 * SIMILAR}
    most = {name: size * pixels for name, size in one.items()} | {"image": headers["image"].size}
    chosen = [name for name in headers if name in most or name in WORDS]
    for name in chosen:
        if headers[name].size > most.get(name, LONGEST):
            raise FileError(f"{path}: is damaged ({name} of {headers[name].dtype}, shape {headers[name].shape})")
    return chosen


def _encode_text(words: str) -> Array:
    return np.frombuffer(words.encode(), np.uint8)


def _decode_text(array: Array) -> str:
    if array.dtype != np.uint8:
        raise InvalidInput("text")
    return array.tobytes().decode()

"""What is known of a texture's elements: the entry that splicing works with."""

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
from texrs.elements._instances import Instance, Labelled, cut_instances, label_elements, rate_closure
from texrs.elements._known import as_element_labels, extend_points, measure_box, measure_centres
from texrs.elements._layout import Layout, LayoutName, as_layout
from texrs.errors import FileError, InvalidInput
from texrs.exemplar import Exemplar
from texrs.exemplar.shapes import mark_outlines
from texrs.io import Header, atomic, read_arrays
from texrs.samples import Sample

FORMAT = 2
"""Of the file, and of what the analysis finds: an entry of another version is refused, and remade by a database."""
MARK = "texrs_elements"
WORDS = (MARK, "hash", "box", "layout", "directions", "wrap", "report", "numbers")
"""What a file says beside arrays as large as the image."""
LONGEST, CHANNELS, SIMILAR = 2**26, 64, 16
"""Bytes of one of them, channels of an image, and members of a similarity set, at most."""


@dataclass(frozen=True, eq=False)
class ElementAnalysis:
    """The elements of one texture.

    Attributes
    ----------
    image : ndarray of shape (height, width, channels)
        The texture itself, in its own dtype.
    points : ndarray of shape (n, 2), float64
        The centres of the elements, (row, column), in pixels.
    mask : ndarray of shape (height, width), bool
        The foreground: True on elements (where they are jointed too: the mortar is where it is False).
    box : tuple of int
        Height and width of an element's box, odd, in pixels.
    layout : Layout
        How the elements hang together: disjoint, connected or jointed. What a `Layout` can be made from becomes one.
    scores : ndarray of shape (n,), float64
        How alike each element is to the chosen one, -1 to 1.
    directions : tuple of float
        The directions in which the points line up, degrees in [0, 180), strongest first; empty where they do not.
    wrap : tuple of bool
        Whether the texture repeats without a seam along rows and columns.
    report : dict
        What the analysis found and decided; text, numbers and lists alone.
    angles : ndarray of shape (n,), float64, optional
        Degrees by which each element is turned against the chosen one, as far as was looked for.
    scales : ndarray of shape (n,), float64, optional
        How many times larger each element is, as far as was looked for.
    sets : Similarity, optional
        What `similarity` returns, where it was made to be kept.
    known : ndarray of shape (height, width), int32, optional
        The element of each pixel, from 1 in the order of the points, where that is known at once: given, as to `of_labels`, or
        of cells beyond doubt. Numbers after those of all points are of elements that only enter the picture.

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
        """Show in a notebook the picture, with a cross on each element."""
        return as_png(mark_points(draw_plain(self.image), self.points, self.box))

    @classmethod
    def of_sample(cls, sample: Sample, *, wrap: tuple[bool, bool] = (False, False)) -> ElementAnalysis:
        """Return the entry of a generated texture, whose elements are known.

        Parameters
        ----------
        sample : Sample
            One of `texrs.samples` with centres and a mask.
        wrap : (bool, bool)
            Whether it was generated to repeat without a seam along rows and columns.

        Returns
        -------
        ElementAnalysis
            With the sample's centres and mask, each element as alike to the chosen one as can be.

        Raises
        ------
        InvalidInput
            Nothing is known of its elements.

        Examples
        --------
        >>> from texrs import samples
        >>> from texrs.elements import ElementAnalysis
        >>> ElementAnalysis.of_sample(samples.bricks((96, 96)))
        Elements(3 of box (25, 47) in 96 x 96, jointed)

        """
        as_instance(sample, "sample", Sample)
        if sample.centres is None or sample.labels is None or sample.image.ndim > 3 or len(sample.centres) < 3:
            raise InvalidInput(f"sample: needs a picture with three known elements or more, got {sample!r}")
        mask = sample.labels > 0 if sample.mask is None else sample.mask
        layout, scores = Layout(sample.layout or "disjoint"), np.ones(len(sample.centres))
        # The cells of a wall are what it is put together from; how separate elements part is read off their mask.
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
        """Return the entry of a texture whose elements are known pixel by pixel: drawn by hand, or found by another program.

        Parameters
        ----------
        image : (H, W) or (H, W, C) array
            The texture.
        labels : (H, W) array of int or bool
            The element of each pixel, any positive numbers; 0 is ground, mortar or joint. Of bools each connected piece is
            an element.
        layout : {"disjoint", "jointed", "connected"}
            How the elements hang together; cells, as bricks and stones, are jointed, and need no joint between them.
        wrap : bool or (bool, bool)
            Whether the texture repeats without a seam along rows and columns.

        Returns
        -------
        ElementAnalysis
            One point a label, at its centroid.

        Raises
        ------
        InvalidInput
            Labels of another shape, with fewer than three elements, or separate elements without ground.

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
            raise InvalidInput(f"labels: three elements or more are needed, got {count}")
        if mask.all() and kind == Layout.DISJOINT:
            raise InvalidInput('labels: separate elements need ground (0) around them; cells are layout="jointed"')
        if mask.all():
            mask = ~mark_outlines(known)
        points = measure_centres(known, around)
        return cls(
            image, points, mask, measure_box(known), kind, np.ones(count), wrap=(around[0], around[1]), known=known
        )

    @cached_property
    def arrangement(self) -> Arrangement:
        """How the elements are arranged: their spacing, the lattice or the courses that they lie in, what is darker.

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
        """The element of each pixel, (H, W) int32, counted from 1; 0 is the ground. Made when first asked for, read-only.

        Element ``k + 1`` belongs to point ``k``. After those of the points come pieces of the foreground, and cells, that no
        point lies in. Separate elements are the pieces of the mask, parted where several points lie in one; elements of a
        connected texture its cells without their joints, where it has any that are sure, else what lies nearest to each.
        Specks of the foreground without a point are ground.

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
        """Each element with a mask of its own, in the order of `labels`; made when first asked for.

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
            scores = np.concatenate([self.scores, np.ones(len(points) - len(self.points))])
            return Labelled(self.known, points, rate_closure(scores))
        found = label_elements(self.image, self.mask, self.points, self.scores, self.box, self.layout, self.wrap)
        found.labels.flags.writeable = False
        return found

    def similarity(self, *, k: int = 3, progress: Callable[[float], object] | None = None) -> Similarity:
        """Return what each pixel of the texture may be replaced by: itself and the ``k - 1`` that look most like it.

        The nearest by appearance vectors of 5 x 5 windows, more than 3 pixels apart; made when first asked for, and kept.

        Parameters
        ----------
        k : int
            How many samples each pixel has, itself among them, 1 to 16.
        progress : callable, optional
            Called as ``progress(share)`` with the share that is done; raising stops the work.

        Returns
        -------
        Similarity
            Its ``sets`` are (H W, k): the flat indices of samples, the pixel's own first.

        Raises
        ------
        InvalidInput
            No such number.

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
        """Return the entry with its similarity sets, so that they are saved with it.

        Parameters
        ----------
        k : int
            How many samples each pixel has, itself among them, 1 to 16.
        progress : callable, optional
            Called as ``progress(share)`` with the share that is done; raising stops the work.

        Returns
        -------
        ElementAnalysis
            The same but for `sets`.

        Raises
        ------
        InvalidInput
            No such number.

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
        """Write the entry to an ``.npz`` file, whole or not at all; `texrs.elements.load` reads it.

        Parameters
        ----------
        path : path_like
            With the suffix .npz; a former file is replaced when all is written.

        Raises
        ------
        FileError
            It cannot be written.

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
            # An array of no length cannot be told from a damaged one.
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
        In any dtype that a picture may have.

    Returns
    -------
    str
        32 hexadecimal digits.

    Raises
    ------
    InvalidInput
        Not an image.

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
    """Read an entry that `save` wrote.

    Parameters
    ----------
    path : path_like
        The .npz file.

    Returns
    -------
    ElementAnalysis

    Raises
    ------
    FileError
        Not there, no entry, of another version, or damaged.

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
            raise FileError(f"{path}: is no entry of a texture's elements")
        return choose_parts(headers, path)

    parts = read_arrays(path, choose=choose)
    version = parts[MARK].ravel().tolist()
    if version != [FORMAT]:
        raise FileError(
            f"{path}: is an entry of version {', '.join(map(str, version))}, this texrs reads version {FORMAT}; "
            "analyse the texture again"
        )
    try:
        image = as_image(parts["image"])
        if _decode_text(parts["hash"]) != hash_image(image):
            raise InvalidInput("its image is not the one that was analysed")
        layout, report = Layout(_decode_text(parts["layout"])), json.loads(_decode_text(parts["report"]))
        if not isinstance(report, dict):
            raise InvalidInput("report")
        count, size = len(parts["points"]), image.shape[:2]
        shapes = {"points": (count, 2), "mask": size, "box": (2,), "scores": (count,), "wrap": (2,)}
        shapes |= {name: (count,) for name in ("angles", "scales") if name in parts}
        shapes |= {"known": size} if "known" in parts else {}
        for name, shape in shapes.items():
            if parts[name].shape != shape:
                raise InvalidInput(f"{name} of shape {parts[name].shape}")
        if parts["mask"].dtype != np.bool_ or not np.isfinite(parts["points"]).all():
            raise InvalidInput("mask or points")
        sets = None
        if "sets" in parts:
            sets = Similarity(parts["sets"].astype(np.uint32), int(parts["numbers"].ravel()[0]))
            if sets.sets.ndim != 2 or len(sets.sets) != size[0] * size[1] or int(sets.sets.max()) >= len(sets.sets):
                raise InvalidInput("similarity sets")
        known = parts["known"].astype(np.int32) if "known" in parts else None
        if known is not None:
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
    """Return which arrays of a file make an entry, none of which is larger than the image says, before any is read."""
    shape = headers["image"].shape if "image" in headers else ()
    pixels = prod(shape[:2])
    if len(shape) not in (2, 3) or not 0 < pixels <= MAX_PIXELS or prod(shape[2:]) > CHANNELS:
        raise FileError(f"{path}: is damaged (an image of shape {shape})")
    # No more elements than pixels; and what is said in words.
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

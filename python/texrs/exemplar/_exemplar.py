"""Provide `Exemplar`, which computes facts about an example on first use and caches them."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from functools import cached_property
from math import prod
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np

from texrs._arrays import (
    MAX_PIXELS,
    as_axes,
    as_image,
    as_instance,
    as_int,
    as_items,
    as_ndarray,
    as_wrap,
    guidance,
    to_unit,
)
from texrs._cache import Cache, content_hash
from texrs._engine.coherence import Similarity, find_similar
from texrs._engine.stitcher import Stitcher
from texrs._progress import listen
from texrs._show import as_png, measure
from texrs._typing import Array, Floats, Path, Progress
from texrs._viewer import as_page
from texrs.errors import FileError, InvalidInput
from texrs.exemplar.analysis import (
    COARSEST,
    Analysis,
    analyse_colours,
    are_labels,
    code_colours,
    count_levels,
    measure_repeat,
)
from texrs.exemplar.regularity import measure_direction
from texrs.exemplar.segmentation import ElementOptions, Segmentation, segment
from texrs.exemplar.separate_elements import Instances, as_instances, find_instances
from texrs.exemplar.stitching import make_stitcher
from texrs.exemplar.symmetry import Flip, find_mirrors
from texrs.io import origins

if TYPE_CHECKING:
    from texrs.exemplar.element_finder import FoundElements
    from texrs.io import Header

T = TypeVar("T")

FORMAT = 2
CACHED = 256 << 20
"""Maximum size, in bytes, of the cache of facts, whose keys depend on the content.

A single larger fact is cached alone.
"""
_SMALL = 1 << 12
_ANALYSED, _SAID = 256, 1 << 24
"""Maximum size of a saved analysis in bytes per sample, and maximum size of the other parts of the file in bytes."""


class Exemplar:
    """An example together with the facts that texrs derives from it.

    Every function that synthesises from an example accepts an array or an `Exemplar`. Facts about the example, such as
    its pyramid of windows, are computed once. They stay with the exemplar, and are cached for a while for any array
    with the same content. A pickled exemplar contains its pixels, its options and the small facts. Large facts (the
    pyramid, the elements) would make the pickle 20 times as large, so each process computes them again when it needs
    them.

    Parameters
    ----------
    image : (H, W), (H, W, C), (D, H, W) or (D, H, W, C) array_like, path_like or PIL.Image.Image
        Pixels: integers, floats of 16, 32 or 64 bits, or bool, with the channels last. Any object that converts to an
        array is accepted (tensors, labelled arrays, DLPack), and a path is read as a file. The pixels are copied.
    axes : int
        Number of axes: 2 for an image, 3 for a volume.
    labels : bool, optional
        If True, the values are unordered classes and are copied from the nearest sample, with any interpolation.
        Default: True for one channel of integers or bool with 2 to 16 values, such as a mask of 0 and 255.
    repeat : bool, or one per axis, optional
        Axes along which the example is periodic. Default: measured.

    Raises
    ------
    InvalidInput
        If the argument is not an image or a volume, or has its channels first. Values are masked or not finite,
            labels have several channels, or an option is invalid.

    See Also
    --------
    cached : The method that adds a fact.

    Examples
    --------
    >>> import texrs
    >>> weave = texrs.Exemplar(texrs.samples.weave((64, 64)).image)
    >>> weave, weave.labels
    (<Exemplar of 64 x 64, 3 channels of uint8>, False)
    >>> pictures = [texrs.synthesize(weave, 96, seed=seed) for seed in range(2)]  # analysed once

    """

    def __init__(
        self, image: Array, *, axes: int = 2, labels: bool | None = None, repeat: bool | Sequence[bool] | None = None
    ) -> None:
        self._axes = as_int(axes, "axes", 2, 3)
        given = as_ndarray(image, "image", axes=self._axes)
        checked = as_image(given, "image", axes=self._axes)
        if labels is not None:
            are_labels(checked, labels)
        self._labels = labels
        self._repeat = None if repeat is None else as_wrap(repeat, "repeat", axes=self._axes)
        # Copy the pixels: facts are cached by content, so a later change must not attach them to other pixels.
        self._pixels = checked.copy()
        self._pixels.flags.writeable = False
        self._image = self._pixels if given.ndim > self._axes else self._pixels[..., 0]
        origins.carry(given, self._image)
        self._facts: dict[Hashable, object] = {}

    def __repr__(self) -> str:
        """Return a short description with the size, the channels and the dtype."""
        return f"<Exemplar of {measure(self._pixels, self._axes)}>"

    def _repr_png_(self) -> bytes:
        """Show the image in a notebook, or the middle plane of a volume."""
        return as_png(self._image if self._axes == 2 else self._image[self.shape[0] // 2])

    def _repr_html_(self) -> str | None:
        """Show a volume in a notebook as slices with sliders."""
        return None if self._axes == 2 else as_page(self._pixels)

    # --- pixels ------------------------------------------------------------------------------------------------------

    @property
    def image(self) -> Array:
        """The array as given, read-only."""
        return self._image

    @property
    def pixels(self) -> Array:
        """The array as given with its channels last, (..., C), read-only."""
        return self._pixels

    @property
    def axes(self) -> int:
        """Number of axes: 2 for an image, 3 for a volume."""
        return self._axes

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of samples along each axis, without the channels."""
        return self._pixels.shape[: self._axes]

    @cached_property
    def normalized(self) -> Floats:
        """Pixels in [0, 1], (..., C) float32.

        Integers are divided by the range of their dtype.

        Floats outside [0, 1] are scaled by their own range.
        """
        return to_unit(self._pixels)

    @cached_property
    def guidance(self) -> Floats:
        """Up to three channels in [0, 1] that guide decisions, with transparency over mid grey."""
        return guidance(self._pixels)

    @cached_property
    def colours(self) -> Floats:
        """Up to four channels in [0, 1] for comparing windows. Classes are corners of a cube."""
        return code_colours(self._pixels, self._labels)

    # --- what is measured --------------------------------------------------------------------------------------------

    @property
    def labels(self) -> bool:
        """True if the values are unordered classes."""
        return self.cached("labels", lambda: are_labels(self._pixels, self._labels))

    @property
    def repeat(self) -> tuple[bool, ...]:
        """Axes along which the example is periodic: as given, or measured at all levels of the pyramid."""
        return self.cached("repeat", lambda: self._measure(count_levels(self.shape, COARSEST)))

    def analyse(self, radii: Sequence[int] = (2,), coarsest: int = COARSEST) -> Analysis:
        """Return the pyramid of the exemplar, with an appearance vector for the window around each sample.

        Parameters
        ----------
        radii : sequence of int
            Radius of the windows at each level, in samples, 1 to 8, starting with the coarsest level. The last radius
            is used for all further levels.
        coarsest : int
            Minimum side of the coarsest level, in samples.

        Returns
        -------
        Analysis

        Raises
        ------
        InvalidInput
            If a side is below 16, or the windows do not fit.

        Examples
        --------
        >>> import texrs
        >>> found = texrs.Exemplar(texrs.samples.stripes((32, 32, 48)).image, axes=3).analyse()
        >>> [level.shape for level in found.levels], found.wrap
        ([(16, 16, 24), (32, 32, 48)], (False, False, False))

        """
        _check_sides(self.shape, "exemplar", COARSEST)
        near = tuple(as_int(r, "radii", 1, 8) for r in as_items(radii, "radii"))
        if not near:
            raise InvalidInput("radii: must contain at least one radius, got none")
        least = as_int(coarsest, "coarsest", 2 * max(near) + 2, 1 << 16)
        count = count_levels(self.shape, least)
        return self.cached(
            ("analysis", near, least), lambda: analyse_colours(self.colours, self._measure(count), near, count)
        )

    def similarity(
        self,
        level: int,
        *,
        coarsest: int = COARSEST,
        k: int = 3,
        n: int = 7,
        numbers: int = 8,
        progress: Callable[[float], object] | None = None,
    ) -> Similarity:
        """Return the most similar samples for each sample of a level of the pyramid.

        Parameters
        ----------
        level : int
            Level of the analysis with windows of radius 2: 0 is the coarsest, -1 the finest.
        coarsest : int
            Minimum side of the coarsest level of the analysis, in samples.
        k : int
            Number of similar samples per sample, 1 to 16.
        n : int
            Side of the box around each chosen sample, in samples. No other sample inside the box is chosen. Must be
            odd.
        numbers : {8, 24}
            Number of leading components of the appearance vectors that are compared.
        progress : callable, optional
            Function that is called with the finished share of the work, 0 to 1.

        Returns
        -------
        Similarity

        Raises
        ------
        InvalidInput
            If the level does not exist, or it does not contain ``k`` samples at this distance from each other.
        Cancelled
            If the work was cancelled.

        Examples
        --------
        >>> import texrs
        >>> texrs.Exemplar(texrs.samples.weave((64, 64)).image).similarity(-1, k=2).sets.shape
        (4096, 2)

        """
        levels = self.analyse(coarsest=coarsest).levels
        number = as_int(level, "level", -len(levels), len(levels) - 1) % len(levels)
        k, n, numbers = as_int(k, "k", 1, 16), as_int(n, "n", 1, 1 << 16), as_int(numbers, "numbers", 1, 1 << 16)
        return self.cached(
            ("similarity", coarsest, number, k, n, numbers),
            lambda: find_similar(levels[number], k=k, n=n, numbers=numbers, progress=progress),
        )

    @property
    def elements(self) -> FoundElements:
        """The elements of an image, their layout, and their lattice or courses, each with a confidence.

        All functions that need elements use this result.

        Raises
        ------
        InvalidInput
            If the exemplar is a volume.

        Examples
        --------
        >>> import texrs
        >>> texrs.Exemplar(texrs.samples.weave((128, 128)).image).elements.layout
        'jointed'

        """
        # Import the finder only here, because it imports SciPy.
        from texrs.exemplar.element_finder import find_elements

        return self.cached("elements", lambda: find_elements(self._pixels))

    @property
    def instances(self) -> Instances | None:
        """The separate elements, in two or three axes. None if the evidence for elements is uncertain."""
        found = self._instances
        return found if found is not None and found.sure else None

    @property
    def _instances(self) -> Instances | None:
        if self.labels:
            return self.cached("instances", lambda: as_instances(self._pixels[..., 0], self.repeat))
        colours = self.guidance if self._axes == 2 else self.colours
        return self.cached("instances", lambda: find_instances(colours, self.repeat))

    @property
    def stitcher(self) -> Stitcher:
        """The exemplar prepared for cutting patches: its elements, and the costs of neighbouring colours.

        If the elements of an image are not separate, seams through them only cost more.
        """
        return self.cached("stitcher", lambda: make_stitcher(self.colours, self.repeat, self._instances))

    @property
    def mirror_symmetries(self) -> tuple[Flip, ...]:
        """Mirror images that look like the example, as pairs (rows mirrored, columns mirrored).

        The first pair is the example itself.
        """
        return self.cached("mirror_symmetries", lambda: find_mirrors(self.guidance))

    @property
    def anisotropy(self) -> float:
        """Share of the edges that agree in one direction, or in two at right angles, from 0 (none) to 1 (all).

        For a volume, the largest value of its three middle slices.
        """
        if self._axes == 2:
            return self.cached("anisotropy", lambda: measure_direction(self.guidance))
        planes = (np.take(self.guidance, n // 2, axis) for axis, n in enumerate(self.shape))
        return self.cached("anisotropy", lambda: max(measure_direction(plane) for plane in planes))

    def segment(
        self, options: ElementOptions = ElementOptions(), *, progress: Progress | bool | None = None
    ) -> Segmentation:
        """Return the background and elements of an image, and their lattice if there is one.

        Parameters
        ----------
        options : ElementOptions
            Options for finding the elements.
        progress : callable or True, optional
            Function that is called as ``progress("segment", share)`` during the work. An exception from it stops the
            work. True shows a progress bar.

        Returns
        -------
        Segmentation
            The segmentation. Its arrays are read-only.

        Raises
        ------
        InvalidInput
            If the exemplar is a volume, or the labels have another shape.

        Examples
        --------
        >>> import texrs
        >>> texrs.Exemplar(texrs.samples.dots((64, 64)).image).segment(texrs.ElementOptions(segmentation="grid")).count
        18

        """
        progress = listen(progress)
        as_instance(options, "options", ElementOptions)
        return self.cached(
            ("segmentation", options.key), lambda: segment(self._pixels, options, progress=progress).freeze()
        )

    def __reduce__(self) -> tuple[Any, ...]:
        """Return the parts for a pickle, without large facts, which are computed again when needed."""
        small = {fact: value for fact, value in self._facts.items() if isinstance(value, bool | float | tuple)}
        return _restore, (self._image, self._axes, self._labels, self._repeat, small)

    # --- what is kept ------------------------------------------------------------------------------------------------

    @cached_property
    def key(self) -> str:
        """Digest of the pixels and the options. Exemplars with equal keys have equal facts."""
        return content_hash(self._pixels, self._axes, self._labels, self._repeat).hex()

    def cached(self, fact: Hashable, make: Callable[[], T]) -> T:
        """Return a fact about the exemplar, which is computed on first use.

        The fact stays with the exemplar, and is cached for other exemplars with the same content while there is room.
        To add a fact, write a method that returns ``self.cached((name, *options), make)``. The options must include
        everything that the fact depends on, except the pixels and the options of the exemplar. A fact never changes.

        Parameters
        ----------
        fact : hashable
            Key of the fact: a name and all options that the fact depends on.
        make : callable
            Function that computes the fact. If the result has an attribute ``nbytes``, this is its size in the cache.

        Returns
        -------
        object
            The result of ``make``, from this call or an earlier one.

        Raises
        ------
        TypeError
            If the key is not hashable. Exceptions from ``make`` are passed on, and nothing is cached.

        Examples
        --------
        >>> from texrs import Exemplar, samples
        >>> known = Exemplar(samples.dots((64, 64)).image)
        >>> known.cached(("brightest",), lambda: int(known.image.max())) <= 255
        True

        """
        try:
            hash(fact)
        except TypeError:
            raise InvalidInput(f"fact: must be hashable, got a {type(fact).__name__}") from None
        if fact not in self._facts:
            self._facts[fact] = _FACTS.get_or_make((self.key, fact), make)
        return cast(T, self._facts[fact])

    def save(self, path: Path) -> None:
        """Write the exemplar and its analysis to a .npz file, which `load` reads.

        An existing file is replaced only after everything is written.

        Parameters
        ----------
        path : path_like
            Path of the file, with the suffix .npz.

        Raises
        ------
        FileError
            If the file cannot be written.

        Examples
        --------
        >>> import pathlib, tempfile
        >>> from texrs import Exemplar, samples
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = pathlib.Path(folder, "dots.npz")
        ...     Exemplar(samples.dots((64, 64)).image).save(path)
        ...     Exemplar.load(path).shape
        (64, 64)

        """
        from texrs.io import atomic

        said = [self._axes, *(-1 if s is None else int(s) for s in (self._labels, *(self._repeat or (None,))))]
        arrays: dict[str, Any] = {"format": np.array(FORMAT), "image": self._image, "said": np.array(said, np.int8)}
        with atomic(path) as temporary, FilePath(temporary).open("wb") as file:
            np.savez(file, **arrays, **self.analyse().arrays())  # type: ignore[arg-type]

    @classmethod
    def load(cls, path: Path) -> Exemplar:
        """Read an exemplar, with its analysis, from a file that `save` wrote.

        Parameters
        ----------
        path : path_like
            Path of the .npz file.

        Returns
        -------
        Exemplar

        Raises
        ------
        FileError
            If the file cannot be read, has another version, or is damaged.

        Examples
        --------
        >>> import pathlib, tempfile
        >>> from texrs import Exemplar, samples
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = pathlib.Path(folder, "stripes.npz")
        ...     Exemplar(samples.stripes((32, 32, 32)).image, axes=3).save(path)
        ...     Exemplar.load(path).axes
        3

        """
        from texrs.io import read_arrays

        def choose(headers: Mapping[str, Header]) -> list[str]:
            # Check the size before reading, because an analysis takes tens of bytes per sample over all levels.
            size = sum(header.size for name, header in headers.items() if "/" in name)
            if any(name not in headers for name in ("format", "image", "said")):
                raise FileError(f"{path}: is not a saved exemplar")
            samples, few = prod(headers["image"].shape), max(headers[name].size for name in ("format", "said"))
            if samples > 4 * MAX_PIXELS or size > _ANALYSED * samples + _SAID or few > _SMALL:
                raise FileError(f"{path}: the file is damaged ({samples} samples, {size} bytes of analysis)")
            return [name for name in headers if "/" in name or name in ("format", "image", "said")]

        arrays = read_arrays(path, choose=choose)
        try:
            if int(arrays.get("format", np.array(-1)).reshape(())) != FORMAT:
                raise FileError(
                    f"{path}: was saved by another version of texrs; save the exemplar again with this version"
                )
            axes, labels, *repeat = (int(s) for s in arrays["said"])
            made = cls(
                arrays["image"],
                axes=axes,
                labels=None if labels < 0 else bool(labels),
                repeat=None if repeat == [-1] else [bool(r) for r in repeat],
            )
            analysis = Analysis.from_arrays(arrays)
            if analysis.shape != made.shape:
                raise InvalidInput(f"the analysis has shape {analysis.shape}, but the image has shape {made.shape}")
        except FileError:
            raise
        except (InvalidInput, KeyError, TypeError, ValueError, IndexError, OverflowError) as error:
            raise FileError(f"{path}: the file is damaged ({error})") from None
        made._facts["analysis", (2,), COARSEST] = analysis
        return made

    def _measure(self, levels: int) -> tuple[bool, ...]:
        return measure_repeat(self.colours, axes=self._axes, levels=levels) if self._repeat is None else self._repeat


def _restore(
    image: Array, axes: int, labels: bool | None, repeat: tuple[bool, ...] | None, facts: dict[Hashable, object]
) -> Exemplar:
    """Return an exemplar from its pickled parts."""
    made = Exemplar(image, axes=axes, labels=labels, repeat=repeat)
    made._facts.update(facts)
    return made


def as_exemplar(value: object, name: str = "exemplar", *, axes: int = 2, minimum: int = 1) -> Exemplar:
    """Convert an argument to an `Exemplar`. An `Exemplar` is returned unchanged.

    Every public function that synthesises calls this for its first argument.

    Parameters
    ----------
    value : Exemplar, array_like, path_like or PIL.Image.Image
        The argument from the user: an exemplar, or any value that `Exemplar` accepts.
    name : str
        Name of the argument, for error messages.
    axes : int
        Required number of axes, 2 or 3.
    minimum : int
        Minimum length of an axis, in samples.

    Returns
    -------
    Exemplar
        The given exemplar, or a new one. Exemplars with equal pixels and options share their facts.

    Raises
    ------
    InvalidInput
        If the exemplar has another number of axes, or the value is not an array, or it is too small.
    FileError
        If the path cannot be read.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs.exemplar import as_exemplar
    >>> known = as_exemplar(np.zeros((8, 8), np.uint8))
    >>> as_exemplar(known) is known
    True

    """
    axes, minimum = as_axes(axes), as_int(minimum, "minimum", 0, 2**31)
    if isinstance(value, Exemplar):
        if value.axes != axes:
            raise InvalidInput(f"{name}: must be an Exemplar with axes={axes}, got one with axes={value.axes}")
        _check_sides(value.shape, name, minimum)
        return value
    given = as_ndarray(value, name, axes=axes)
    as_image(given, name, axes=axes, minimum=minimum)
    return Exemplar(given, axes=axes)


def _check_sides(shape: tuple[int, ...], name: str, minimum: int) -> None:
    if min(shape) < minimum:
        raise InvalidInput(f"{name}: each side must be at least {minimum}, got shape {shape}")


def _measure_size(fact: object) -> int:
    return min(int(getattr(fact, "nbytes", _SMALL)), CACHED)


_FACTS: Cache[tuple[str, Hashable], Any] = Cache(CACHED, _measure_size)

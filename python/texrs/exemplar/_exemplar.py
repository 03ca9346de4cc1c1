"""The one place for what is known of an example: each fact is worked out when it is first asked for, and kept by content."""

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
from texrs.exemplar.instances import Instances, as_instances, find_instances
from texrs.exemplar.regularity import measure_direction
from texrs.exemplar.segmentation import ElementOptions, Segmentation, segment
from texrs.exemplar.stitching import guess_instances, make_stitcher
from texrs.exemplar.symmetry import SUSPECT, Flip, find_mirrors
from texrs.io import _origins

if TYPE_CHECKING:
    from texrs.io import Header

T = TypeVar("T")

FORMAT = 2
CACHED = 256 << 20
"""Bytes of facts that are kept by content; one that is larger is kept alone."""
_SMALL = 1 << 12
_ANALYSED, _SAID = 256, 1 << 24
"""Bytes that the analysis in a file may take a sample, and beside them."""


class Exemplar:
    """An example, and what is known of it.

    Every verb that grows from an example takes an array or an `Exemplar`. What a verb finds out about it, as its
    pyramid of windows, is worked out once: it stays with the exemplar, and is kept for a while for any array of the
    same content. It travels to other processes as its pixels, what was said of them and the small facts; the others (the
    pyramid, the elements) are worked out again where they are asked for, once a process, for they would be 20 times as large.

    Parameters
    ----------
    image : (H, W), (H, W, C), (D, H, W) or (D, H, W, C) array_like, path_like or PIL.Image.Image
        The pixels: integers, floats of 16, 32 or 64 bit, or bool, channels last. Anything that makes itself an array is taken
        (tensors, labelled arrays, DLPack), and a file is read. They are copied.
    axes : int
        2 for a picture, 3 for a volume.
    labels : bool, optional
        Whether the values are classes without an order, looked up at the nearest sample whatever the interpolation.
        None: where they are one channel of integers or bool, with 2 to 16 values, such as a mask of 0 and 255.
    repeat : bool, or one an axis, optional
        Axes along which the example repeats; None measures it.

    Raises
    ------
    InvalidInput
        Not an image or not a volume, channels first, values that are masked or not finite, labels of several channels, or a
            wrong option.

    See Also
    --------
    cached : How a further fact is added.

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
        # A copy: facts that are kept by content must not come to be of another one.
        self._pixels = checked.copy()
        self._pixels.flags.writeable = False
        self._image = self._pixels if given.ndim > self._axes else self._pixels[..., 0]
        _origins.carry(given, self._image)
        self._facts: dict[Hashable, object] = {}

    def __repr__(self) -> str:
        """Return the size, the channels and the dtype."""
        return f"<Exemplar of {measure(self._pixels, self._axes)}>"

    def _repr_png_(self) -> bytes:
        """Show the picture in a notebook; of a volume the middle plane."""
        return as_png(self._image if self._axes == 2 else self._image[self.shape[0] // 2])

    def _repr_html_(self) -> str | None:
        """Show a volume in a notebook by slices with sliders."""
        return None if self._axes == 2 else as_page(self._pixels)

    # --- pixels ------------------------------------------------------------------------------------------------------

    @property
    def image(self) -> Array:
        """The array as it was given, read-only."""
        return self._image

    @property
    def pixels(self) -> Array:
        """The same with its channels last, (..., C), read-only."""
        return self._pixels

    @property
    def axes(self) -> int:
        """2 for a picture, 3 for a volume."""
        return self._axes

    @property
    def shape(self) -> tuple[int, ...]:
        """Samples along each axis, without the channels."""
        return self._pixels.shape[: self._axes]

    @cached_property
    def normalized(self) -> Floats:
        """The pixels in [0, 1], (..., C) float32: integers by the range of their dtype, floats beyond it by their own."""
        return to_unit(self._pixels)

    @cached_property
    def guidance(self) -> Floats:
        """The channels that decisions are made on: up to three in [0, 1], transparency over mid grey."""
        return guidance(self._pixels)

    @cached_property
    def colours(self) -> Floats:
        """The up to four channels in [0, 1] that windows are compared by; classes are corners of a cube."""
        return code_colours(self._pixels, self._labels)

    # --- what is measured --------------------------------------------------------------------------------------------

    @property
    def labels(self) -> bool:
        """Whether the values are classes without an order."""
        return self.cached("labels", lambda: are_labels(self._pixels, self._labels))

    @property
    def repeat(self) -> tuple[bool, ...]:
        """Axes along which the example repeats: as given, or measured at each level of its pyramid."""
        return self.cached("repeat", lambda: self._measure(count_levels(self.shape, COARSEST)))

    def analyse(self, radii: Sequence[int] = (2,), coarsest: int = COARSEST) -> Analysis:
        """Return the pyramid, with the appearance vector of each sample's window at each level.

        Parameters
        ----------
        radii : sequence of int
            Radius of the windows, 1 to 8, from the coarsest level on; the last one serves all that follow.
        coarsest : int
            Least side of the coarsest level, in samples.

        Returns
        -------
        Analysis

        Raises
        ------
        InvalidInput
            A side below 16, or windows that do not fit.

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
            raise InvalidInput("radii: needs at least one")
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
        """Return what each sample of a level may be replaced by: the samples that look most like it.

        Parameters
        ----------
        level : int
            Of the analysis with windows of radius 2; 0 is the coarsest, -1 the finest.
        coarsest : int
            Of that analysis, in samples.
        k : int
            Samples of a set, 1 to 16.
        n : int
            Side of the box around each chosen sample from which no other is chosen; odd.
        numbers : {8, 24}
            How many of the leading numbers of the appearance vectors are compared.
        progress : callable, optional
            Called with the share that is done.

        Returns
        -------
        Similarity

        Raises
        ------
        InvalidInput
            A level that is not there, or no ``k`` samples so far apart.
        Cancelled
            The work was stopped.

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
    def instances(self) -> Instances | None:
        """The separate elements, in two or three axes; None where nothing says for sure that there are any."""
        if self.labels:
            return self.cached("instances", lambda: as_instances(self._pixels[..., 0], self.repeat))
        return self.cached("instances", lambda: find_instances(self.colours, self.repeat))

    @property
    def stitcher(self) -> Stitcher:
        """The exemplar as patches are cut from it: with its elements, and which colours lie side by side.

        Where elements are not found for sure, those that `segment` finds in a picture are cut less.
        """
        return self.cached("stitcher", self._make_stitcher)

    @property
    def mirror_symmetries(self) -> tuple[Flip, ...]:
        """The mirror images that a picture is like, itself first: (rows mirrored, columns mirrored) of each."""
        return self.cached("mirror_symmetries", lambda: find_mirrors(self.guidance, SUSPECT))

    @property
    def anisotropy(self) -> float:
        """How much edges agree in direction, or in two at right angles: 0 not at all, 1 wholly.

        Of a volume: of that of its three middle planes where they agree most.
        """
        if self._axes == 2:
            return self.cached("anisotropy", lambda: measure_direction(self.guidance))
        planes = (np.take(self.guidance, n // 2, axis) for axis, n in enumerate(self.shape))
        return self.cached("anisotropy", lambda: max(measure_direction(plane) for plane in planes))

    def segment(
        self, options: ElementOptions = ElementOptions(), *, progress: Progress | bool | None = None
    ) -> Segmentation:
        """Return the background and the elements of a picture, and the lattice that they may lie on.

        Parameters
        ----------
        options : ElementOptions
            How elements are found.
        progress : callable or True, optional
            Called as ``progress("segment", share)`` along the way; raising stops the work. True shows a bar.

        Returns
        -------
        Segmentation
            Its arrays are read-only.

        Raises
        ------
        InvalidInput
            A volume, or labels of another shape.

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
        """Travel without large facts: they are worked out again, and kept by content."""
        small = {fact: value for fact, value in self._facts.items() if isinstance(value, bool | float | tuple)}
        return _restore, (self._image, self._axes, self._labels, self._repeat, small)

    # --- what is kept ------------------------------------------------------------------------------------------------

    @cached_property
    def key(self) -> str:
        """Digest of the pixels and of what was said of them: the same key, the same facts."""
        return content_hash(self._pixels, self._axes, self._labels, self._repeat).hex()

    def cached(self, fact: Hashable, make: Callable[[], T]) -> T:
        """Return a fact about the exemplar, worked out when it is first asked for.

        It stays with the exemplar, and is kept for any other of the same content as long as there is room. To add a
        fact, write a method that returns ``self.cached((name, *options), make)``: whatever the fact depends on, but
        for the pixels and what the exemplar was made with, must be among the options. A fact is never changed.

        Parameters
        ----------
        fact : hashable
            A name and all options that it depends on.
        make : callable
            Works the fact out. A result with ``nbytes`` is counted by them.

        Returns
        -------
        object
            What ``make`` returned, now or earlier.

        Raises
        ------
        TypeError
            A fact that is not hashable. What ``make`` raises goes through, and nothing is kept.

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
            raise InvalidInput(f"fact: needs what can be a key, got a {type(fact).__name__}") from None
        if fact not in self._facts:
            self._facts[fact] = _FACTS.get_or_make((self.key, fact), make)
        return cast(T, self._facts[fact])

    def save(self, path: Path) -> None:
        """Write the exemplar and its analysis to a .npz file; a former file is replaced only when all is written.

        Parameters
        ----------
        path : path_like
            With the suffix .npz.

        Raises
        ------
        FileError
            It cannot be written.

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
        """Return the exemplar that `save` wrote, with its analysis.

        Parameters
        ----------
        path : path_like
            The .npz file.

        Returns
        -------
        Exemplar

        Raises
        ------
        FileError
            The file cannot be read, is of another version, or is damaged.

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
            # An analysis takes tens of bytes a sample, of all levels together.
            size = sum(header.size for name, header in headers.items() if "/" in name)
            if any(name not in headers for name in ("format", "image", "said")):
                raise FileError(f"{path}: is no exemplar that was saved")
            samples, few = prod(headers["image"].shape), max(headers[name].size for name in ("format", "said"))
            if samples > 4 * MAX_PIXELS or size > _ANALYSED * samples + _SAID or few > _SMALL:
                raise FileError(f"{path}: is damaged ({samples} samples, {size} bytes of analysis)")
            return [name for name in headers if "/" in name or name in ("format", "image", "said")]

        arrays = read_arrays(path, choose=choose)
        try:
            if int(arrays.get("format", np.array(-1)).reshape(())) != FORMAT:
                raise FileError(f"{path}: not an exemplar of this version of texrs")
            axes, labels, *repeat = (int(s) for s in arrays["said"])
            made = cls(
                arrays["image"],
                axes=axes,
                labels=None if labels < 0 else bool(labels),
                repeat=None if repeat == [-1] else [bool(r) for r in repeat],
            )
            analysis = Analysis.from_arrays(arrays)
            if analysis.shape != made.shape:
                raise InvalidInput(f"the analysis is of {analysis.shape}, the image of {made.shape}")
        except FileError:
            raise
        except (InvalidInput, KeyError, TypeError, ValueError, IndexError, OverflowError) as error:
            raise FileError(f"{path}: is damaged ({error})") from None
        made._facts["analysis", (2,), COARSEST] = analysis
        return made

    def _make_stitcher(self) -> Stitcher:
        found = self.instances
        sure = found is not None or self._axes == 3 or self.labels
        return make_stitcher(self.colours, self.repeat, found if sure else guess_instances(self.segment()), sure=sure)

    def _measure(self, levels: int) -> tuple[bool, ...]:
        return measure_repeat(self.colours, axes=self._axes, levels=levels) if self._repeat is None else self._repeat


def _restore(
    image: Array, axes: int, labels: bool | None, repeat: tuple[bool, ...] | None, facts: dict[Hashable, object]
) -> Exemplar:
    """Return an exemplar that has travelled."""
    made = Exemplar(image, axes=axes, labels=labels, repeat=repeat)
    made._facts.update(facts)
    return made


def as_exemplar(value: object, name: str = "exemplar", *, axes: int = 2, minimum: int = 1) -> Exemplar:
    """Return an exemplar as it is, or that of an array: what every verb does with its first argument.

    Parameters
    ----------
    value : Exemplar, array_like, path_like or PIL.Image.Image
        What the user gave: an exemplar, or whatever `Exemplar` takes.
    name : str
        The argument's name, for messages.
    axes : int
        2 or 3, as the verb needs.
    minimum : int
        The least length of an axis, in samples.

    Returns
    -------
    Exemplar
        The one that was given, or a new one; what is known of equal pixels is shared.

    Raises
    ------
    InvalidInput
        An exemplar of other axes, not an array, or too small.
    FileError
        A path that cannot be read.

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
            raise InvalidInput(f"{name}: needs an Exemplar with axes={axes}, got one with axes={value.axes}")
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

"""What is known of a texture's elements: the entry that splicing works with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from texrs._engine.coherence import Similarity
from texrs._typing import Path
from texrs.errors import InvalidInput
from texrs.exemplar import analysis
from texrs.samples import Sample

#: How a texture is made: separate elements on a ground, one connected figure, or elements in a connected ground (mortar).
Tag = Literal["F=d", "F=c", "B=c"]


@dataclass(frozen=True, eq=False)
class Elements:
    """The elements of one texture.

    Attributes
    ----------
    image : ndarray of shape (height, width, channels)
        The texture itself, in its own dtype.
    points : ndarray of shape (n, 2), float64
        The centres of the elements, (row, column), in pixels.
    mask : ndarray of shape (height, width), bool
        The foreground: True on elements (for ``B=c`` too: the mortar is where it is False).
    box : tuple of int
        Height and width of an element's box, odd, in pixels.
    tag : {"F=d", "F=c", "B=c"}
        Disjoint foreground, connected foreground, or connected background.
    scores : ndarray of shape (n,), float64
        How alike each element is to the chosen one, -1 to 1.
    peaks : tuple of float
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
        What `similarity` gives, where it was made to be kept.
    """

    image: NDArray[Any]
    points: NDArray[np.float64]
    mask: NDArray[np.bool_]
    box: tuple[int, int]
    tag: Tag
    scores: NDArray[np.float64]
    peaks: tuple[float, ...] = ()
    wrap: tuple[bool, bool] = (False, False)
    report: dict[str, Any] = field(default_factory=dict)
    angles: NDArray[np.float64] | None = None
    scales: NDArray[np.float64] | None = None
    sets: Similarity | None = None

    def __repr__(self) -> str:
        rows, columns = self.image.shape[:2]
        return f"Elements({len(self.points)} of box {self.box} in {rows} x {columns}, {self.tag})"

    @classmethod
    def of_sample(cls, sample: Sample, *, wrap: tuple[bool, bool] = (False, False)) -> Elements:
        """Return the entry of a generated texture, whose elements are known.

        Parameters
        ----------
        sample : Sample
            One of `texrs.samples` with centres and a mask.
        wrap : (bool, bool)
            Whether it was generated to repeat without a seam along rows and columns.

        Raises
        ------
        InvalidInput
            Nothing is known of its elements.

        Examples
        --------
        >>> from texrs import samples
        >>> from texrs.elements import Elements
        >>> Elements.of_sample(samples.bricks((96, 96)))
        Elements(3 of box (25, 47) in 96 x 96, B=c)

        """
        from scipy.ndimage import find_objects

        if sample.centres is None or sample.labels is None or sample.image.ndim > 3 or len(sample.centres) < 3:
            raise InvalidInput(f"sample: needs a picture with three known elements or more, got {sample!r}")
        found = [box for box in find_objects(sample.labels) if box is not None]
        height, width = (int(np.median([box[axis].stop - box[axis].start for box in found])) | 1 for axis in (0, 1))
        mask = sample.labels > 0 if sample.mask is None else sample.mask
        tag: Tag = "F=d" if sample.tag is None else sample.tag
        return cls(sample.image, sample.centres, mask, (height, width), tag, np.ones(len(sample.centres)), wrap=wrap)

    def similarity(self, *, k: int = 3, progress: Callable[[float], object] | None = None) -> Similarity:
        """Return what each pixel of the texture may be replaced by: itself and the ``k - 1`` that look most like it.

        The nearest by appearance vectors of 5 x 5 windows, more than 3 pixels apart; made when first asked for, and kept.

        Examples
        --------
        >>> from texrs import samples
        >>> from texrs import elements as elements
        >>> sample = samples.load("dots", size=(64, 64))
        >>> elements.analyse(sample.image, mask=sample.mask, tag="F=d").similarity(k=2).sets.shape
        (4096, 2)

        """
        if self.sets is not None and self.sets.k == k:
            return self.sets
        analysed = analysis.analyse(self.image, axes=2, wrap=self.wrap, radii=(2,))
        return analysis.similarity(analysed, len(analysed.levels) - 1, k=k, progress=progress)

    def prepared(self, *, k: int = 3, progress: Callable[[float], object] | None = None) -> Elements:
        """Return the entry with its similarity sets, so that they are saved with it."""
        return replace(self, sets=self.similarity(k=k, progress=progress))

    def save(self, path: Path) -> None:
        """Write the entry to an ``.npz`` file, whole or not at all; `texrs.elements.load` reads it.

        Raises
        ------
        FileError
            It cannot be written.

        """
        from texrs.elements._file import save

        save(self, path)

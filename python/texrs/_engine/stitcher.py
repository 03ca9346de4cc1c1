"""The stitcher: patches of an exemplar pulled into the output through any map, and cut where it shows least."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texrs import _rust
from texrs._arrays import as_float, as_int, as_seed
from texrs._engine.appearance import Demand, Report
from texrs._engine.pyramid import Region, flatten
from texrs._typing import Bools, Floats
from texrs.errors import InvalidInput

__all__ = ["FREE", "Pasting", "Samples", "Shown", "Stitched", "Stitcher", "Weights"]

FREE = 2**32 - 1
"""What a pixel shows that shows nothing yet."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Weights:
    """What a seam costs: each 0 to 100.

    Attributes
    ----------
    colour : float
        Squared differences of the colours on both sides, in the exemplar's standard deviations.
    contact, jump, depth, joint : float
        Two elements in contact, of whatever colours; an element that is cut off; a seam inside of one; elements nearer
        than two samples.
    presence : float
        A point that shows no element: cuts around elements are shorter, and would leave too few of them.
    surprise : float
        Colours that are seldom seen side by side.
    distortion : float
        A point whose patch is bent against the field.
    guide : float
        A point that does not show what is asked.

    """

    colour: float = 0.1
    contact: float = 3.0
    jump: float = 1.0
    depth: float = 0.3
    joint: float = 0.5
    presence: float = 0.02
    surprise: float = 1.0
    distortion: float = 0.03
    guide: float = 0.5


class Stitched(NamedTuple):
    """What has been stitched.

    Attributes
    ----------
    places : (points * A) int32
        In units of 1/4096 of a sample.
    patches : (points) uint32
        The patch that each point shows; beyond the last for points that were given.
    frames : (patches, A, A) int16
        The Jacobian at the centre of each, in units of 1/4096.
    seams : float
        Mean cost of the seams at a point.
    healed : int
        Moves by which elements were made whole, or given up.

    """

    places: NDArray[np.int32]
    patches: NDArray[np.uint32]
    frames: NDArray[np.int16]
    seams: float
    healed: int


class Shown(NamedTuple):
    """What a part of something larger shows: arrays in one row.

    Attributes
    ----------
    places : (points * A) int32
        In units of 1/4096 of a sample.
    patches : (points) uint32
        The patch that each point shows, a row of the table.
    seams : (points * A) float32
        Cost of the seam from each point to the next one along each axis.
    distortion : (points) float32
        How far the patch is from the field; empty where one frame serves all.
    table : (patches, K) int32
        Of each patch: its centre, seen from the part's first point; where that looks; the Jacobian there; the side in units
        of 1/4096 of a sample; and whether it is rigid.

    """

    places: NDArray[np.int32]
    patches: NDArray[np.uint32]
    seams: NDArray[np.float32]
    distortion: NDArray[np.float32]
    table: NDArray[np.int32]

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        return sum(array.nbytes for array in self)


class Stitcher:
    """An exemplar that patches are cut from.

    Parameters
    ----------
    colours : (..., C) float32
        Up to four channels of any scale, of two or three axes.
    wrap : one bool an axis
        Axes along which the exemplar repeats.
    classes : uint8 array
        Class of each sample.
    costs : (K, K) float32
        How surprising two classes side by side are.
    labels : uint32 array, optional
        Number of the element of each sample, from 1; 0 for none.
    depth : float32 array, optional
        Distance of each sample to the background.
    sure : bool
        Whether the elements were found for sure. Those that may be some are kept whole by what cuts cost, and not healed.

    Raises
    ------
    InvalidInput
        Arrays that do not belong together.

    """

    def __init__(
        self,
        colours: Floats,
        *,
        wrap: Sequence[bool],
        classes: NDArray[np.uint8],
        costs: Floats,
        labels: NDArray[np.uint32] | None = None,
        depth: Floats | None = None,
        sure: bool = True,
    ) -> None:
        self.shape = colours.shape[:-1]
        self._inner = _rust.Stitcher(
            np.ascontiguousarray(colours.reshape(-1, colours.shape[-1]), np.float32),
            self.shape,
            wrap,
            np.zeros(0, np.uint32) if labels is None else np.ascontiguousarray(labels.reshape(-1)),
            np.zeros(0, np.float32) if depth is None else np.ascontiguousarray(depth.reshape(-1)),
            np.ascontiguousarray(classes.reshape(-1)),
            np.ascontiguousarray(costs.reshape(-1)),
        )
        self.separate, self.guessed = labels is not None and sure, labels is not None and not sure
        self.nbytes = 32 * int(np.prod(self.shape, dtype=np.int64))

    def stitch(
        self,
        region: Region,
        frames: NDArray[np.int16],
        *,
        patch: float,
        overlap: float = 0.4,
        candidates: int = 3,
        bend: bool = False,
        recover: float = 0.5,
        heal: bool = True,
        weights: Weights = Weights(),
        repetition: float = 0.15,
        continuation: float = 4.0,
        balance: float = 4.0,
        seed: int = 0,
        held: NDArray[np.bool_] | None = None,
        given: NDArray[np.int32] | None = None,
        loose: NDArray[np.bool_] | None = None,
        demand: Demand | None = None,
        progress: Report | None = None,
    ) -> Stitched:
        """Fill a region with patches.

        Parameters
        ----------
        region : Region
            What to fill.
        frames : (1 or points, A, A) int16
            Jacobians over the region (see `texrs._engine.pyramid.to_fixed`).
        patch : float
            Side of a patch in samples of the exemplar, 4 to 4096.
        overlap : float
            Share of it by which neighbours overlap, 0 to 0.8.
        candidates : int
            Places that are cut in, of which the cheapest stays; 1 to 64.
        bend : bool
            Whether patches bend with the field, or are turned and scaled as a whole.
        recover : float
            Patches that cover the worst seams again, as a share of all, 0 to 4. They stay where seams cost less then.
        heal : bool
            Whether torn elements are grown whole, or given up.
        weights : Weights
            What seams cost.
        repetition, continuation : float
            Cost of places that have been shown more often than others, and of going on exactly where a neighbour ends, 0
            to 100; places that have nothing to do with each other differ by 2.
        seed : int
            Chooses the texture.
        held : (points) bool, optional
            Points that keep their places.
        given : (points * A) int32, optional
            The places of the held points; those of others do not count.
        loose : (points) bool, optional
            Which of the held points patches may take all the same, where seams show less then.
        demand : Demand, optional
            What else the points are to show.
        progress : callable, optional
            Called with the share that is done; raising stops the work.

        Returns
        -------
        Stitched

        Raises
        ------
        InvalidInput
            An option out of its range, or arrays of other sizes than the region's.
        Cancelled
            The work was stopped.

        """
        axes = len(self.shape)
        if len(region.shape) != axes:
            raise InvalidInput(f"region: the exemplar has {axes} axes, got {region.shape}")
        places, patches, jacobians, seams, healed = self._inner.stitch(
            region.place,
            frames,
            (
                as_float(patch, "patch", 4, 4096),
                as_float(overlap, "overlap", 0, 0.8),
                as_int(candidates, "candidates", 1, 64),
                as_float(recover, "recover", 0, 4),
                bend,
                heal and not self.guessed,
            ),
            list(astuple(weights)),
            [
                as_float(repetition, "repetition", 0, 100),
                as_float(continuation, "continuation", 0, 100),
                as_float(balance, "balance", 0, 100),
            ],
            as_seed(seed),
            flatten(held),
            np.zeros(0, np.int32) if given is None else given,
            flatten(loose),
            demand,
            progress,
        )
        return Stitched(places, patches, jacobians.reshape(-1, axes, axes), seams, healed)

    def judge(
        self, region: Region, places: NDArray[np.int32], patches: NDArray[np.uint32], weights: Weights = Weights()
    ) -> NDArray[np.float32]:
        """Return what seams cost: (points * A), from each point to the next one along each axis that shows another patch.

        Parameters
        ----------
        region : Region
            Where they are.
        places : (points * A) int32
            Where each point looks.
        patches : (points) uint32
            Which patch it shows.
        weights : Weights
            What seams cost.

        Raises
        ------
        InvalidInput
            Arrays of other sizes than the region's.

        """
        return self._inner.judge(region.place, places, patches, list(astuple(weights)))

    def cover(
        self,
        region: Region,
        frames: NDArray[np.int16],
        shown: Shown,
        *,
        patch: float,
        candidates: int = 3,
        bend: bool = False,
        recover: float = 0.5,
        heal: bool = True,
        weights: Weights = Weights(),
        repetition: float = 0.15,
        continuation: float = 4.0,
        balance: float = 4.0,
        progress: Report | None = None,
    ) -> Shown:
        """Cut a patch into a part of something larger, whose ends stay as they are.

        What becomes of it hangs on what it shows and on its frames alone.

        Parameters
        ----------
        region : Region
            The part.
        frames : (1 or points, A, A) int16
            Jacobians over it.
        shown : Shown
            What it shows before.
        patch : float
            Side of a patch in samples of the exemplar, at most; where it does not fill the part there are several.
        candidates, bend, recover, heal, weights, repetition, continuation, progress
            As for `stitch`; what is charged are the patches that the part shows already.
        balance : float
            Cost of points of classes in excess, as many as a side of a patch has.

        Returns
        -------
        Shown

        Raises
        ------
        InvalidInput
            An option out of its range, or arrays of other sizes than the region's.
        Cancelled
            The work was stopped.

        """
        made = self._inner.cover(
            region.place,
            frames,
            (*shown[:4], np.ascontiguousarray(shown.table.reshape(-1))),
            (
                as_float(patch, "patch", 4, 4096),
                0.0,
                as_int(candidates, "candidates", 1, 64),
                as_float(recover, "recover", 0, 4),
                bend,
                heal and not self.guessed,
            ),
            list(astuple(weights)),
            [
                as_float(repetition, "repetition", 0, 100),
                as_float(continuation, "continuation", 0, 100),
                as_float(balance, "balance", 0, 100),
            ],
            progress,
        )
        return Shown(*made[:4], made[4].reshape(-1, shown.table.shape[1]))


@dataclass(frozen=True, slots=True, eq=False)
class Pasting:
    """A window of an output that patches are cut into.

    Attributes
    ----------
    shown : (h, w) uint32
        The sample that each pixel shows, or `FREE`.
    seams : (h, w, 2) float32
        Cost of the seam from each pixel to the next one along each axis.
    mask, core : (h, w) bool
        Pixels that a patch covers, and those that must take it.

    """

    shown: NDArray[np.uint32]
    seams: Floats
    mask: Bools
    core: Bools

    def pack(self) -> tuple[tuple[int, ...], NDArray[np.uint32], Floats, Bools, Bools]:
        """Return the shape, and the arrays in a row."""
        shown, seams = np.ascontiguousarray(self.shown), np.ascontiguousarray(self.seams)
        return self.shown.shape, shown.reshape(-1), seams.reshape(-1), self.mask.reshape(-1), self.core.reshape(-1)


class Samples:
    """Samples of pictures in one row, from which patches are cut that another search has found and that lie as they are.

    Parameters
    ----------
    colours : (n, C) float32
        Up to four channels of any scale.
    depth : (n) float32
        How deep inside of an element each lies, in pixels; 0 between elements.
    weights : (float, float)
        What a seam costs by colour and depth, as in `Weights`.

    """

    def __init__(self, colours: Floats, depth: Floats, weights: tuple[float, float]) -> None:
        self.inner: Final = _rust.PatchSamples(np.ascontiguousarray(colours), np.ascontiguousarray(depth), weights)

    def judge(self, pasting: Pasting, patches: NDArray[np.uint32]) -> list[float]:
        """Return what the seams of a window cost once each of some patches is cut into it, alone.

        Parameters
        ----------
        pasting : Pasting
            What they are cut into.
        patches : (k, h, w) uint32
            The sample that each pixel would show; of pixels outside the mask any.

        """
        return self.inner.judge(pasting.pack(), patches.reshape(len(patches), -1))

    def cut(self, pasting: Pasting, patch: NDArray[np.uint32]) -> tuple[Bools, Floats]:
        """Cut a patch (h, w) into a window: the pixels that take it, and the window's seams as they are then."""
        take, seams = self.inner.cut(pasting.pack(), patch.reshape(-1))
        return take.reshape(patch.shape), seams.reshape(*patch.shape, 2)

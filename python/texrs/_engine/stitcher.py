"""The stitcher: patches of an exemplar are mapped into the output and cut along the least visible seams."""

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
"""Value of a pixel that is not copied from any place yet."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Weights:
    """Costs of a seam, each 0 to 100.

    Attributes
    ----------
    colour : float
        Cost of squared colour differences across the seam, in the exemplar's standard deviations.
    contact, jump, depth, joint : float
        contact: two touching elements. jump: an element that is cut off. depth: a seam inside an element. joint:
        elements less than two samples apart.
    presence : float
        Cost of a point without an element. Cuts around elements are shorter, and would leave too few elements without
        this cost.
    surprise : float
        Cost of colours that are rarely adjacent.
    distortion : float
        Cost of a point whose patch is bent against the field.
    guide : float
        Cost of a point that does not show the requested value.

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
    """Result of the stitcher.

    Attributes
    ----------
    places : (points * A) int32
        Source coordinates, in units of 1/4096 of a sample.
    patches : (points) uint32
        Patch of each point. Given points have numbers after the last patch.
    frames : (patches, A, A) int16
        Jacobian at the centre of each patch, in units of 1/4096.
    seams : float
        Mean cost of the seams at a point.
    healed : int
        Number of moves that repaired or removed torn elements.

    """

    places: NDArray[np.int32]
    patches: NDArray[np.uint32]
    frames: NDArray[np.int16]
    seams: float
    healed: int


class Shown(NamedTuple):
    """Content of a part of a larger output, as flat arrays.

    Attributes
    ----------
    places : (points * A) int32
        Source coordinates, in units of 1/4096 of a sample.
    patches : (points) uint32
        Patch of each point, a row of the table.
    seams : (points * A) float32
        Cost of the seam from each point to the next one along each axis.
    distortion : (points) float32
        Difference of the patch from the field. Empty if all points have one frame.
    table : (patches, K) int32
        Data of each patch: its centre, relative to the first point of the part; the source coordinates and the
        Jacobian of the centre. Then the side, in units of 1/4096 of a sample, and whether it is rigid.

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
        Up to four channels of any scale, on two or three axes.
    wrap : one bool per axis
        Axes along which the exemplar repeats.
    classes : uint8 array
        Class of each sample.
    costs : (K, K) float32
        Cost of two adjacent classes: higher for rarer pairs.
    labels : uint32 array, optional
        Element of each sample, from 1; 0 for none.
    depth : float32 array, optional
        Distance of each sample to the background.
    sure : bool
        If True, the elements are reliable. Unreliable elements are kept whole by the costs of cuts, and are not
        repaired.

    Raises
    ------
    InvalidInput
        If the arrays do not belong together.

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
            Region to fill.
        frames : (1 or points, A, A) int16
            Jacobians over the region (see `texrs._engine.pyramid.to_fixed`).
        patch : float
            Side of a patch in samples of the exemplar, 4 to 4096.
        overlap : float
            Overlap of neighbours, as a share of the patch side, 0 to 0.8.
        candidates : int
            Number of positions that are cut in for each patch, 1 to 64. The cheapest is kept.
        bend : bool
            If True, patches bend with the field. Otherwise they are rotated and scaled as a whole.
        recover : float
            Number of patches that cover the worst seams again, as a share of all patches, 0 to 4. They are kept if
            they lower the cost.
        heal : bool
            If True, torn elements are completed or removed.
        weights : Weights
            Costs of a seam.
        repetition, continuation : float
            Cost of positions that were used more often than others, and of continuing exactly where a neighbour ends,
            0 to 100. Unrelated positions differ by 2.
        seed : int
            Seed of the random choices.
        held : (points) bool, optional
            Points whose coordinates are fixed.
        given : (points * A) int32, optional
            Coordinates of the fixed points. Others are ignored.
        loose : (points) bool, optional
            Fixed points that patches may still replace if this lowers the cost of seams.
        demand : Demand, optional
            Values that the points should show.
        progress : callable, optional
            Called with the completed share. An exception that it raises stops the work.

        Returns
        -------
        Stitched

        Raises
        ------
        InvalidInput
            If an option is out of its range, or arrays do not have the size of the region.
        Cancelled
            If the work was stopped.

        """
        axes = len(self.shape)
        if len(region.shape) != axes:
            raise InvalidInput(f"region: must have the {axes} axes of the exemplar, got {region.shape}")
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
        """Return the costs of seams, (points * A).

        Parameters
        ----------
        region : Region
            Region of the points.
        places : (points * A) int32
            Source coordinates of each point.
        patches : (points) uint32
            Patch of each point.
        weights : Weights
            Costs of a seam.

        Raises
        ------
        InvalidInput
            If arrays do not have the size of the region.

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
        """Cut a patch into a part of a larger output, whose borders stay unchanged.

        The result depends only on the content and the frames of the part.

        Parameters
        ----------
        region : Region
            The part.
        frames : (1 or points, A, A) int16
            Jacobians over the part.
        shown : Shown
            Content of the part before the call.
        patch : float
            Maximum side of a patch in samples of the exemplar. If one does not fill the part, several are used.
        candidates, bend, recover, heal, weights, repetition, continuation, progress
            As for `stitch`. Repetition is charged against the patches that the part shows already.
        balance : float
            Cost of points of overrepresented classes. The unit is the number of points on a patch side.

        Returns
        -------
        Shown

        Raises
        ------
        InvalidInput
            If an option is out of its range, or arrays do not have the size of the region.
        Cancelled
            If the work was stopped.

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
        Sample of each pixel, or `FREE`.
    seams : (h, w, 2) float32
        Cost of the seam from each pixel to the next one along each axis.
    mask, core : (h, w) bool
        Pixels that a patch covers, and pixels that must take it.

    """

    shown: NDArray[np.uint32]
    seams: Floats
    mask: Bools
    core: Bools

    def pack(self) -> tuple[tuple[int, ...], NDArray[np.uint32], Floats, Bools, Bools]:
        """Return the shape, and the arrays as one flat array."""
        shown, seams = np.ascontiguousarray(self.shown), np.ascontiguousarray(self.seams)
        return self.shown.shape, shown.reshape(-1), seams.reshape(-1), self.mask.reshape(-1), self.core.reshape(-1)


class Samples:
    """Samples of images in one row. Patches found by another search are cut from them without a warp.

    Parameters
    ----------
    colours : (n, C) float32
        Up to four channels of any scale.
    depth : (n) float32
        Depth of each sample inside an element, in pixels; 0 between elements.
    weights : (float, float)
        Costs of a seam by colour and by depth, as in `Weights`.

    """

    def __init__(self, colours: Floats, depth: Floats, weights: tuple[float, float]) -> None:
        self.inner: Final = _rust.PatchSamples(np.ascontiguousarray(colours), np.ascontiguousarray(depth), weights)

    def judge(self, pasting: Pasting, patches: NDArray[np.uint32]) -> list[float]:
        """Return the cost of the window's seams after cutting in each of some patches separately.

        Parameters
        ----------
        pasting : Pasting
            Window that they are cut into.
        patches : (k, h, w) uint32
            Sample of each pixel. Pixels outside the mask may have any value.

        """
        return self.inner.judge(pasting.pack(), patches.reshape(len(patches), -1))

    def cut(self, pasting: Pasting, patch: NDArray[np.uint32]) -> tuple[Bools, Floats]:
        """Cut a patch (h, w) into a window. Return the mask of its pixels, and the new seams of the window."""
        take, seams = self.inner.cut(pasting.pack(), patch.reshape(-1))
        return take.reshape(patch.shape), seams.reshape(*patch.shape, 2)

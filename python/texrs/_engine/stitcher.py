"""The stitcher: it maps patches of an exemplar into an output and cuts them along the least visible seams."""

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
"""Value of a pixel that has no source sample yet."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Weights:
    """Weights of the cost of a seam, each 0 to 100.

    Attributes
    ----------
    colour : float
        Cost of squared colour differences across the seam. Unit: variances of the exemplar's colours.
    contact, jump, depth, joint : float
        Costs at elements. Two touching elements cost ``contact``, and elements less than two samples apart cost
        ``joint``. An element that is cut off costs ``jump``. A seam inside an element costs ``depth``.
    presence : float
        Cost of a point without an element. Cuts around elements are shorter, so there would be too few elements
        without this cost.
    surprise : float
        Cost of neighbouring colours that are rarely adjacent in the exemplar.
    distortion : float
        Cost of a point where the patch deviates from the field.
    guide : float
        Cost of a point that does not have the requested value.

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
        Patch of each point. Fixed points have numbers after the last patch.
    frames : (patches, A, A) int16
        Jacobian at the centre of each patch, in units of 1/4096.
    seams : float
        Mean cost of the seams per point.
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
        Patch of each point, as a row of the table.
    seams : (points * A) float32
        Cost of the seam from each point to the next one along each axis.
    distortion : (points) float32
        Deviation of the patch from the field at each point. The array is empty if all points have the same frame.
    table : (patches, K) int32
        Data of each patch. The first values are the position of its centre relative to the first point, and the source
        coordinates and the Jacobian there. The side in units of 1/4096 of a sample follows. The last value is 1 if the
        patch is rigid.

    """

    places: NDArray[np.int32]
    patches: NDArray[np.uint32]
    seams: NDArray[np.float32]
    distortion: NDArray[np.float32]
    table: NDArray[np.int32]

    @property
    def nbytes(self) -> int:
        """Size of all arrays in bytes."""
        return sum(array.nbytes for array in self)


class Stitcher:
    """An exemplar, prepared so that patches can be cut from it.

    Parameters
    ----------
    colours : (..., C) float32
        Colours of the exemplar: up to four channels of any scale, on two or three axes.
    wrap : one bool per axis
        Axes along which the exemplar is periodic.
    classes : uint8 array
        Class of colour of each sample.
    costs : (K, K) float32
        Cost of two adjacent classes of colour, higher for rarer pairs.
    labels : uint32 array, optional
        Element of each sample, counted from 1, or 0 for the background.
    depth : float32 array, optional
        Distance of each sample to the background, in samples.
    sure : bool
        If True, the elements are reliable. Unreliable elements only have costs for cuts, and are not repaired.

    Raises
    ------
    InvalidInput
        If the arrays are inconsistent.

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
        lattice: NDArray[np.float64] | None = None,
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
            Number of source positions that are tried for each patch, 1 to 64. The position with the cheapest seam is
            used.
        bend : bool
            If True, patches are bent along the field. Otherwise they are rotated and scaled as a whole.
        recover : float
            Number of patches that replace the worst seams, as a share of all patches, 0 to 4. They are used if they
            lower the cost.
        heal : bool
            If True, torn elements are completed or removed.
        weights : Weights
            Weights of the cost of a seam.
        repetition, continuation : float
            Costs, 0 to 100. ``repetition`` applies to source positions that are used more often than others.
            ``continuation`` applies to patches that continue exactly where a neighbour ends in the exemplar. For
            comparison, two unrelated positions differ by 2.
        seed : int
            Seed of the random choices.
        held : (points) bool, optional
            True for points whose coordinates are fixed.
        given : (points * A) int32, optional
            Coordinates of the fixed points, in units of 1/4096 of a sample. Values of other points are ignored.
        loose : (points) bool, optional
            True for fixed points that patches may still replace if this lowers the cost of seams.
        demand : Demand, optional
            Values that the points should have.
        lattice : (2, 2) float64, optional
            Lattice that patches are kept in step with, for images with one frame. The columns are translations of the
            exemplar. The second is 0 if there is a single period.
        progress : callable, optional
            Function called with the completed share. An exception that it raises stops the work.

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
            raise InvalidInput(f"region: must have {axes} axes like the exemplar, got shape {region.shape}")
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
            None if lattice is None else lattice.tolist(),
            progress,
        )
        return Stitched(places, patches, jacobians.reshape(-1, axes, axes), seams, healed)

    def judge(
        self, region: Region, places: NDArray[np.int32], patches: NDArray[np.uint32], weights: Weights = Weights()
    ) -> NDArray[np.float32]:
        """Return the costs of the seams in an output, (points * A), from each point to the next one along each axis.

        Parameters
        ----------
        region : Region
            Region of the points.
        places : (points * A) int32
            Source coordinates of each point, in units of 1/4096 of a sample.
        patches : (points) uint32
            Patch of each point.
        weights : Weights
            Weights of the cost of a seam.

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
        """Cut a patch into a part of a larger output, without changing the borders of the part.

        The result depends only on the content of the part and on its frames.

        Parameters
        ----------
        region : Region
            Region of the part.
        frames : (1 or points, A, A) int16
            Jacobians over the part.
        shown : Shown
            Content of the part before the call.
        patch : float
            Maximum side of a patch in samples of the exemplar. If a single patch does not fill the part, several are
            used.
        candidates, bend, recover, heal, weights, repetition, continuation, progress
            As for `stitch`. The cost of repetition counts patches that are already in the part.
        balance : float
            Cost of points of overrepresented colour classes, 0 to 100. The unit is the number of points along the side
            of a patch.

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
        Sample of each pixel, or `FREE` for pixels without a sample.
    seams : (h, w, 2) float32
        Cost of the seam from each pixel to the next one along each axis.
    mask, core : (h, w) bool
        ``mask`` is True for pixels that a patch can cover, and ``core`` for pixels that it must cover.

    """

    shown: NDArray[np.uint32]
    seams: Floats
    mask: Bools
    core: Bools

    def pack(self) -> tuple[tuple[int, ...], NDArray[np.uint32], Floats, Bools, Bools]:
        """Return the shape of the window, and its arrays in flat form."""
        shown, seams = np.ascontiguousarray(self.shown), np.ascontiguousarray(self.seams)
        return self.shown.shape, shown.reshape(-1), seams.reshape(-1), self.mask.reshape(-1), self.core.reshape(-1)


class Samples:
    """Samples of one or several images as a list. Unwarped patches of these samples can be cut into a window.

    Parameters
    ----------
    colours : (n, C) float32
        Colours of the samples: up to four channels of any scale.
    depth : (n) float32
        Depth of each sample inside an element, in pixels, or 0 between elements.
    weights : (float, float)
        Costs of a seam by colour and by depth, as in `Weights`.

    """

    def __init__(self, colours: Floats, depth: Floats, weights: tuple[float, float]) -> None:
        self.inner: Final = _rust.PatchSamples(np.ascontiguousarray(colours), np.ascontiguousarray(depth), weights)

    def judge(self, pasting: Pasting, patches: NDArray[np.uint32]) -> list[float]:
        """Return the cost of the window's seams for each of several patches, if only that patch is cut in.

        Parameters
        ----------
        pasting : Pasting
            Window that the patches are cut into.
        patches : (k, h, w) uint32
            Sample of each pixel of each patch. Pixels outside the mask can have any value.

        """
        return self.inner.judge(pasting.pack(), patches.reshape(len(patches), -1))

    def cut(self, pasting: Pasting, patch: NDArray[np.uint32]) -> tuple[Bools, Floats]:
        """Cut a patch (h, w) into a window. Return True for pixels that it covers, and the new seams of the window."""
        take, seams = self.inner.cut(pasting.pack(), patch.reshape(-1))
        return take.reshape(patch.shape), seams.reshape(*patch.shape, 2)

"""An image with holes, the pixels that fill them, and both at half the size."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools, Floats
from texrs.exemplar.patches import index_patches, place_patches
from texrs.exemplar.symmetry import Flip
from texrs.inpainting._judge import Filled
from texrs.kernels.inpaint import inpaint as fill
from texrs.kernels.patch_search import PatchIndex


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """An image with holes, and the image that they are filled from."""

    colours: Floats
    """Colours, (H, W, C)."""
    known: Bools
    """Mask of the known pixels, (H, W): False in the holes."""
    keep: Bools
    """Mask of the pixels that no patch may replace, (H, W)."""
    source: Floats
    """Image that patches are copied from, (h, w, C): the same colours, or those of another image."""
    free: Bools
    """Mask of the pixels of ``source`` that may be copied, (h, w)."""
    wrap: tuple[bool, bool]
    """Axes along which the image is periodic."""
    lattice: NDArray[np.float64] | None = None
    """Lattice of the image that patches are kept in step with, (2, 2), with a shift in each column."""
    _made: dict[tuple[Flip, ...], PatchIndex] = field(default_factory=dict, repr=False)
    """Index of each set of mirror images. It serves all sizes of patches."""

    @property
    def itself(self) -> bool:
        """Return whether holes are filled from their own image."""
        return self.source is self.colours

    @property
    def holes(self) -> int:
        """Number of pixels to fill."""
        return int(np.count_nonzero(~self.known))

    def halve(self) -> Scene:
        """Return the scene at half the size, without an odd last line. Partly known pixels are holes."""
        colours = _average(self.colours)
        return Scene(
            colours,
            _all_four(self.known),
            _all_four(self.keep),
            colours if self.itself else _average(self.source),
            _all_four(self.free),
            self.wrap,
            None if self.lattice is None else self.lattice / 2,
        )

    def fill(self, side: int, mirrors: Sequence[Flip], seed: int, progress: Callable[[float], object]) -> Filled:
        """Fill the holes with patches of a size."""
        turned = tuple(mirrors)
        index = index_patches(self.source, side, mirrors, self.free, self._made.get(turned))
        self._made.setdefault(turned, index)
        filled = fill(
            self.colours,
            self.known,
            index,
            patch_size=side,
            keep=self.keep,
            wrap=self.wrap,
            seed=seed,
            shown=0 if self.itself else None,
            lattice=self.lattice,
            progress=progress,
        )
        new, coordinates, jacobians = place_patches(filled, mirrors, (self.free.shape[0], self.free.shape[1]))
        places = np.zeros((*self.known.shape, 2), np.float32)
        places[new] = coordinates
        frames = np.stack([np.eye(2, dtype=np.float32), *jacobians])
        return Filled(filled.colours, (filled.label + 1).astype(np.uint32), places, frames)


def _average(image: Floats) -> Floats:
    rows, columns = (n // 2 * 2 for n in image.shape[:2])
    lines = image[0:rows:2, :columns] + image[1:rows:2, :columns]
    return np.asarray((lines[:, 0::2] + lines[:, 1::2]) * np.float32(0.25), np.float32)


def _all_four(mask: Bools) -> Bools:
    rows, columns = (n // 2 * 2 for n in mask.shape)
    lines = mask[0:rows:2, :columns] & mask[1:rows:2, :columns]
    found: Bools = lines[:, 0::2] & lines[:, 1::2]
    return found

"""The result of all generators, and their random generator."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_seed
from texrs._show import as_png
from texrs._viewer import as_page

LayoutName: TypeAlias = Literal["disjoint", "connected", "jointed"]
"""How the elements are arranged: separate on a background, connected as a net, or separated by joints."""

MIN_SIDE = 32


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """An image or a volume whose contents are known exactly.

    Coordinates are (row, col) or (plane, row, col) in pixels. Pixel centres are at integers, so an image of H rows
    covers -0.5 <= row < H - 0.5. H and W are the numbers of rows and columns, D is the number of planes of a volume. N
    is the number of elements whose centre is inside.

    Attributes
    ----------
    name : str
        Name for `texrs.samples.load`.
    image : uint8 array, (H, W, 3) or (D, H, W, 3); a grey photograph is (H, W)
        The image, in sRGB.
    centres : float64 array, (N, 2) or (N, 3), or None
        Centroids of the elements, in pixels. A centroid is computed from the visible element before the border of the
        image cuts it. For the tilted samples, it is the centroid on the plane, projected into the image.
    labels : int32 array, (H, W) or (D, H, W), or None
        Label of each pixel: 0 for background, ``i + 1`` for the element of ``centres[i]``. A visible element whose
        centre is outside the image has a label above N, so ``labels > N`` selects the elements that are mostly
        outside. With `wrap`, no label is above N: an element that crosses the border continues on the opposite side
        with the same label.
    mask : bool array, (H, W) or (D, H, W), or None
        The foreground. It is ``labels > 0``, unless the generator documents another rule.
    layout : {"disjoint", "connected", "jointed"} or None
        Separate elements on a background, a connected foreground such as a net, or elements separated by joints. None
        if the texture is none of these.
    scale_map : float32 array, (H, W), or None
        Local size of the texture, as a factor on normal lengths: the square root of the ratio of areas. Its geometric
        mean is 1.
    jacobians : float32 array, (H, W, 2, 2) or (D, H, W, 3, 3), or None
        The Jacobian J = dS/dp of the map from the image to the undistorted texture; ``jacobians[..., i, j]`` is dS_i /
        dp_j.

    Examples
    --------
    >>> from texrs import samples
    >>> buttons = samples.load("dots", size=(96, 96))
    >>> buttons.image.dtype, buttons.centres.shape, buttons.labels.shape
    (dtype('uint8'), (8, 2), (96, 96))

    """

    name: str
    image: NDArray[np.uint8]
    centres: NDArray[np.float64] | None = None
    labels: NDArray[np.int32] | None = None
    mask: NDArray[np.bool_] | None = None
    layout: LayoutName | None = None
    scale_map: NDArray[np.float32] | None = None
    jacobians: NDArray[np.float32] | None = None

    def __repr__(self) -> str:
        """Return the name, the shape and the names of the known attributes."""
        shape = "x".join(map(str, self.image.shape))
        known = [f.name for f in fields(self)[2:] if getattr(self, f.name) is not None]
        return f"Sample({self.name!r}, {shape}, known: {', '.join(known) or 'nothing'})"

    def _repr_png_(self) -> bytes:
        """Show the image, or the middle plane of a volume, in a notebook."""
        return as_png(self.image[len(self.image) // 2] if self.image.ndim == 4 else self.image)

    def _repr_html_(self) -> str | None:
        """Show a volume in a notebook by slices with sliders."""
        return as_page(self.image) if self.image.ndim == 4 else None


def make_generator(name: str, seed: object) -> np.random.Generator:
    """Return the random generator of sample `name`. The same seed gives unrelated numbers to different samples."""
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([as_seed(seed), *name.encode()])))

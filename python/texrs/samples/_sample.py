"""The result of every generator, and the checks that all of them share."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_seed
from texrs._show import as_png
from texrs._viewer import as_page

LayoutName: TypeAlias = Literal["disjoint", "connected", "jointed"]
"""How elements hang together: apart on a ground, in one net, or parted by joints."""

MIN_SIDE = 32


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """A picture or a volume whose contents are known exactly.

    Coordinates are (row, col) or (plane, row, col) in pixels; pixel centres are at the integers,
    so that a picture of H rows covers -0.5 <= row < H - 0.5. H, W and D stand for the picture's
    rows and columns and the volume's planes; N is the number of elements whose centre is inside.

    Attributes
    ----------
    name : str
        What `texrs.samples.load` calls it.
    image : uint8 array, (H, W, 3) or (D, H, W, 3); a grey photograph is (H, W)
        The picture, sRGB.
    centres : float64 array, (N, 2) or (N, 3), or None
        Centroids of the elements, in pixels. An element's centroid is that of its whole visible area,
        before the border of the picture cuts it. The tilted samples give the point where the
        centroid on the plane is seen instead.
    labels : int32 array, (H, W) or (D, H, W), or None
        0 is background; ``i + 1`` is the element of ``centres[i]``. An element that shows in the picture
        with its centre outside has a label above N, so that ``labels > N`` is what only enters
        from beyond the border. With `wrap` there are none: an element that crosses the border
        comes back on the other side under the same label.
    mask : bool array, (H, W) or (D, H, W), or None
        The foreground. It is ``labels > 0``, except where the generator says otherwise.
    layout : {"disjoint", "connected", "jointed"} or None
        Separate elements on a ground, a connected foreground such as a net, or elements parted by joints;
        None where the texture is none of these.
    scale_map : float32 array, (H, W), or None
        Local size of the texture: lengths are this many times the normal ones, as the square root
        of the ratio of areas. Its geometric mean is 1.
    jacobians : float32 array, (H, W, 2, 2) or (D, H, W, 3, 3), or None
        The Jacobian J = dS/dp of the map from the picture to the undistorted texture;
        ``jacobians[..., i, j]`` is dS_i / dp_j.

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
        """Return the name, the shape and which of the known answers are there."""
        shape = "x".join(map(str, self.image.shape))
        known = [f.name for f in fields(self)[2:] if getattr(self, f.name) is not None]
        return f"Sample({self.name!r}, {shape}, known: {', '.join(known) or 'nothing'})"

    def _repr_png_(self) -> bytes:
        """Show the picture, or the middle plane of a volume, in a notebook."""
        return as_png(self.image[len(self.image) // 2] if self.image.ndim == 4 else self.image)

    def _repr_html_(self) -> str | None:
        """Show a volume in a notebook by slices with sliders."""
        return as_page(self.image) if self.image.ndim == 4 else None


def make_generator(name: str, seed: object) -> np.random.Generator:
    """Return the generator of sample `name`: a seed gives unrelated numbers to each sample."""
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([as_seed(seed), *name.encode()])))

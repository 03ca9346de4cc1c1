"""k-coherence: each point chooses among samples that are similar to the source samples of its neighbours."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs import _rust
from texrs._arrays import as_float, as_int, as_seed
from texrs._engine.appearance import Appearance
from texrs._engine.pyramid import ONE, Region, flatten
from texrs.errors import InvalidInput

__all__ = ["Similarity", "correct", "find_similar", "jitter"]

Report = Callable[[float], object]


@dataclass(frozen=True, slots=True, eq=False)
class Similarity:
    """For each sample of an exemplar, a set of similar samples that may replace it.

    Attributes
    ----------
    sets : (samples, k) uint32
        Row-major positions of the samples in each set, the sample itself first. If the window of a sample is not
        inside the exemplar, all entries are the sample itself.
    numbers : int
        Number of components of the appearance vectors that are compared.

    """

    sets: NDArray[np.uint32]
    numbers: int

    @property
    def k(self) -> int:
        """Number of samples in a set."""
        return int(self.sets.shape[1])

    @property
    def nbytes(self) -> int:
        """Size of the sets in bytes."""
        return self.sets.nbytes


def find_similar(
    appearance: Appearance, *, k: int = 3, n: int = 7, numbers: int = 8, progress: Report | None = None
) -> Similarity:
    """Find the most similar samples for each sample of an exemplar, far from it and from each other.

    C_1 is the sample itself. Each further C_j is the sample with the nearest appearance vector among all samples that
    are far enough from the earlier samples. The distance is sufficient if it is more than (n - 1) / 2 samples along
    some axis [1]_. The whole exemplar is searched, and the result is exact. If several samples are equally near, the
    first is used.

    Parameters
    ----------
    appearance : Appearance
        Appearance of the exemplar.
    k : int
        Number of samples in a set, 1 to 16.
    n : int
        Side of the box around each chosen sample that excludes other samples, an odd number.
    numbers : {8, 24}
        Number of leading components of the vectors that are compared.
    progress : callable, optional
        Function called with the completed share. An exception that it raises stops the work.

    Returns
    -------
    Similarity

    Raises
    ------
    InvalidInput
        If an option is out of its range, or the exemplar is too small for ``k`` samples at this distance.
    Cancelled
        If the work was stopped.

    References
    ----------
    .. [1] X. Tong et al., "Synthesis of bidirectional texture functions on arbitrary surfaces", SIGGRAPH 2002.

    Examples
    --------
    >>> import numpy as np
    >>> exemplar = Appearance(np.tile(np.arange(8.0), (32, 4)), axes=2)
    >>> find_similar(exemplar, k=2).sets[32 * 16 + 16].tolist()  # row 2, column 8: the first that looks the same
    [528, 72]

    """
    if as_int(n, "n", 1, 1 << 20) % 2 == 0:
        raise InvalidInput(f"n: must be an odd number, because the box is centred on a sample, got {n}")
    count = as_int(k, "k", 1, 16)
    sets = _rust.similar(appearance._inner, count, n, _check_numbers(numbers), progress)
    return Similarity(sets.reshape(-1, count), numbers)


def correct(
    appearance: Appearance,
    similarity: Similarity,
    places: NDArray[np.int32],
    region: Region,
    frames: NDArray[np.int16],
    *,
    passes: int = 2,
    compensated: bool = True,
    held: NDArray[np.bool_] | None = None,
    kinds: tuple[NDArray[np.uint8], NDArray[np.uint8]] | None = None,
    progress: Report | None = None,
) -> NDArray[np.int32]:
    """Correct source coordinates by k-coherence, so that each point fits the appearance of its diagonal neighbours.

    A pass visits the 2^A classes of points with the same parity along each axis, in fixed order [1]_. The source
    samples of a point's 2^A diagonal neighbours, and samples similar to them, are candidates. They are shifted back to
    the point, in the direction that the frames give. Candidates are compared by the appearance vectors of the
    neighbours. If several candidates are equally good, the first is used.

    Parameters
    ----------
    appearance : Appearance
        Appearance of the exemplar.
    similarity : Similarity
        Similarity sets of the same exemplar.
    places : (points * A) int32
        Source coordinates, in units of 1/4096 of a sample.
    region : Region
        Region of the points.
    frames : (1 or points, A, A) int16
        Jacobians over the region (see `texrs._engine.pyramid.to_fixed`).
    passes : int
        Number of passes, 0 to 1000.
    compensated : bool
        If True, neighbours are read at the end of the diagonal in the exemplar, as in the code released with [1]_. If
        False, they are read at the lattice point.
    held : (points) bool, optional
        True for points whose coordinates are fixed.
    kinds : (samples) uint8 and (points) uint8, optional
        Class of each sample, and the class that each point requires. The value 255 allows any class. A point without a
        suitable candidate keeps its coordinates.
    progress : callable, optional
        Function called with the completed share. An exception that it raises stops the work.

    Returns
    -------
    (points * A) int32

    Raises
    ------
    InvalidInput
        If an option is out of its range, or arrays are inconsistent.
    Cancelled
        If the work was stopped.

    References
    ----------
    .. [1] S. Lefebvre and H. Hoppe, "Appearance-space texture synthesis", SIGGRAPH 2006.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs._engine.pyramid import to_fixed
    >>> exemplar = Appearance(np.random.default_rng(0).random((32, 32)), axes=2)
    >>> region = Region.whole((20, 20))
    >>> copy = (np.indices((20, 20)).transpose(1, 2, 0) + 5).astype(np.int32).reshape(-1) * ONE
    >>> bool((correct(exemplar, find_similar(exemplar), copy, region, to_fixed(None, region)) == copy).all())
    True

    """
    region.check_places(places)
    appearance.check(region)
    return _rust.cohere(
        appearance._inner,
        np.ascontiguousarray(similarity.sets, np.uint32).reshape(-1),
        similarity.k,
        places,
        region.place,
        frames,
        flatten(held),
        _flatten_kinds(kinds),
        as_int(passes, "passes", 0, 1000),
        _check_numbers(similarity.numbers),
        compensated,
        progress,
    )


def jitter(
    places: NDArray[np.int32],
    region: Region,
    reach: float,
    *,
    seed: int = 0,
    level: int = 0,
    held: NDArray[np.bool_] | None = None,
) -> NDArray[np.int32]:
    """Displace source coordinates by noise that depends on the positions of their points in the output.

    Parameters
    ----------
    places : (points * A) int32
        Source coordinates, in units of 1/4096 of a sample.
    region : Region
        Region of the points.
    reach : float
        Maximum displacement along an axis, in samples, 0 to 65536.
    seed, level : int
        Seed of the noise, and index of the level, which gives each level its own noise.
    held : (points) bool, optional
        True for points whose coordinates are not displaced.

    Returns
    -------
    (points * A) int32

    Raises
    ------
    InvalidInput
        If an option is out of its range, or arrays do not have the size of the region.

    Examples
    --------
    >>> import numpy as np
    >>> region = Region.whole((2, 2))
    >>> moved = jitter(np.zeros(8, np.int32), region, 0.7, seed=1) / ONE
    >>> bool((np.abs(moved) <= 0.7).all() and np.ptp(moved) > 0.5)
    True

    """
    region.check_places(places)
    most = round(as_float(reach, "reach", 0, 65536) * ONE)
    return _rust.jitter(
        places, region.place, flatten(held), most, as_seed(seed), as_int(level, "level", 0, (1 << 32) - 1)
    )


def _check_numbers(numbers: int) -> int:
    if numbers not in (8, 24):
        raise InvalidInput(f"numbers: must be 8 or 24, got {numbers!r}")
    return int(numbers)


def _flatten_kinds(
    kinds: tuple[NDArray[np.uint8], NDArray[np.uint8]] | None,
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    if kinds is None:
        return np.zeros(0, np.uint8), np.zeros(0, np.uint8)
    samples, points = (np.ascontiguousarray(k, np.uint8).reshape(-1) for k in kinds)
    return samples, points

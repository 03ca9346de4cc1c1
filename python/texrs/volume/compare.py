"""Report how similar a synthesised image or volume is to its exemplar."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texrs._arrays import as_image, as_int, as_ndarray, locate
from texrs._show import brief
from texrs._typing import Array
from texrs.errors import InvalidInput
from texrs.exemplar import Exemplar
from texrs.fields import Field
from texrs.fields.spaced import as_distances, find_distances, space
from texrs.source_map import SourceMap
from texrs.volume import statistics, structure
from texrs.volume.integrity import Integrity, integrity
from texrs.volume.usage import CellReuse, cell_reuse
from texrs.volume.values import check_field, guess_axes, turn_in_space

__all__ = ["Comparison", "compare"]

_REACH = 12


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """Result of `compare`. Each pair contains the value of the exemplar and the value of the output.

    Attributes
    ----------
    shares : (2, K) float64
        Fraction of the points in each of K classes, from dark to light (or by label).
    particles : tuple of ComponentStatistics
        Connected components of the chosen classes or labels: their number per 100 000 points, and their sizes.
    frequency : tuple of float
        Mean spectral frequency of the slices, in cycles per sample.
    two_point : (2, A, 13) float64
        Two-point correlation of the chosen classes along each of A axes, for steps of 0 to 12.
    lineal_path : (2, A, 13) float64
        Lineal path function of the chosen classes along the same axes, by the same steps.
    autocorrelation : (2, A, 13) float64
        Autocorrelation of the lightness along the same axes, by the same steps.
    isolated : tuple of float
        Fraction of the points that differ from the median of their neighbourhood (`speckle`).
    values : float
        Mean Wasserstein distance between the lightness of the output's slices and of the exemplar, in [0, 1].
    seams : (2,) float64
        Minimum and maximum change between adjacent planes of the output, divided by the median change along the same
        axis.
    orientation : (2, 2) float64 or None
        Median and 90th percentile of the angle between the layers and their expected direction, in degrees. The
        expected direction is the exemplar's own normal in the first row, and the normal rotated by the field in the
        second row (the output). None without a field.
    turned : float or None
        Mean angle in degrees between the exemplar's normal before and after its rotation by the field. If it is 0, the
        field does not affect the orientation. None without a field.
    reuse : CellReuse or None
        How much of the exemplar the output uses, and how often. None without a source map.
    integrity : Integrity or None
        Integrity of separate elements. None without a source map, or if the exemplar has no separate elements.

    Examples
    --------
    >>> from texrs import samples, volume
    >>> one, other = (samples.particles((32, 32, 32), seed=s).image for s in (0, 1))
    >>> found = volume.compare(one, other)
    >>> found.shares.shape, found.reuse is None
    ((2, 4), True)

    """

    shares: NDArray[np.float64]
    particles: tuple[statistics.ComponentStatistics, statistics.ComponentStatistics]
    frequency: tuple[float, float]
    two_point: NDArray[np.float64]
    lineal_path: NDArray[np.float64]
    autocorrelation: NDArray[np.float64]
    isolated: tuple[float, float]
    values: float
    seams: NDArray[np.float64]
    orientation: NDArray[np.float64] | None
    turned: float | None
    reuse: CellReuse | None
    integrity: Integrity | None

    __repr__ = brief

    @property
    def relative_shares(self) -> NDArray[np.float64]:
        """Fraction of each class in the output, divided by its fraction in the exemplar, (K,)."""
        return np.asarray(self.shares[1] / np.maximum(self.shares[0], 1e-30))

    @property
    def frequency_ratio(self) -> float:
        """Frequency of the output over the frequency of the exemplar: 1 for equally fine, 0.5 for twice as coarse."""
        return self.frequency[1] / self.frequency[0]

    @property
    def text(self) -> str:
        """Table of the report. If output and exemplar are similar, ratios are near 1 and distances near 0.

        The distances of two-point correlations, lineal paths and autocorrelations are mean absolute differences over
        all axes and steps. "distance of values" is `values`, and "isolated voxels" is `isolated`. "change from plane
        to plane / median" is `seams`, where a large maximum means a visible seam.
        """
        rows = [("", "exemplar", "output", "output/exemplar")]

        def row(name: str, pair: tuple[float, float], form: str) -> None:
            rows.append((name, format(pair[0], form), format(pair[1], form), f"{_divide(pair):.2f}"))

        for k, (before, after) in enumerate(self.shares.T.tolist()):
            # Labels need not be consecutive, so omit labels that do not occur.
            if before or after:
                row(f"share of class {k}", (before, after), ".3f")
        first, second = self.particles
        row("particles in 100 000", (first.density, second.density), ".1f")
        row("mean size", (first.mean, second.mean), ".0f")
        row("median size", (first.median, second.median), ".0f")
        for d in (1, 9):
            row(f"{d}0th percentile of sizes", (first.deciles[d - 1], second.deciles[d - 1]), ".0f")
        row("mean frequency", self.frequency, ".4f")
        row("isolated voxels", self.isolated, ".4f")
        rows.append(("distance of two-point correlations", "", f"{_measure_distance(self.two_point):.3f}", ""))
        rows.append(("distance of lineal paths", "", f"{_measure_distance(self.lineal_path):.3f}", ""))
        rows.append(("distance of autocorrelations", "", f"{_measure_distance(self.autocorrelation):.3f}", ""))
        rows.append(("distance of values", "", f"{self.values:.3f}", ""))
        rows.append(("change from plane to plane / median", "", f"{self.seams[0]:.2f} to {self.seams[1]:.2f}", ""))
        if self.orientation is not None:
            rows.append(("the field turns the normal by", "", f"{self.turned:.1f}", ""))
            for i, name in enumerate(("median error of the normal", "90th percentile of the error")):
                row(name, (float(self.orientation[0, i]), float(self.orientation[1, i])), ".1f")
        if self.reuse is not None:
            rows.append(("coherent neighbours", "", f"{self.reuse.coherent:.3f}", ""))
            rows.append(("largest patch / output", "", f"{self.reuse.largest:.3f}", ""))
            rows.append(("most used cell / mean", "", f"{self.reuse.most_used:.1f}", ""))
            rows.append(("cells not used", "", f"{self.reuse.unused:.3f}", ""))
        if self.integrity is not None:
            row("contacts without a border in 1000", self.integrity.contacts, ".2f")
            row("largest part / all elements", self.integrity.largest, ".3f")
            row("parts of several colours", self.integrity.mixed, ".3f")
            rows.append(("torn elements / all", "", f"{self.integrity.torn:.3f}", ""))
            rows.append(("crumbs in 100 000", "", f"{self.integrity.crumbs:.1f}", ""))
        # Pad the columns to equal widths.
        widths = [max(len(r[i]) for r in rows) for i in range(4)]
        lines = [r[0].ljust(widths[0]) + "".join("  " + r[i].rjust(widths[i]) for i in (1, 2, 3)) for r in rows]
        return "\n".join(line.rstrip() for line in lines)

    def __str__(self) -> str:
        """Return the report as a table."""
        return self.text


def compare(
    exemplar: ArrayLike,
    output: ArrayLike,
    source: SourceMap | None = None,
    field: Field | None = None,
    *,
    classes: int | None = 4,
    chosen: int | tuple[int, ...] | None = None,
    axes: int | None = None,
    spacing: Sequence[float] | None = None,
) -> Comparison:
    """Compare a synthesised image or volume with its exemplar.

    Parameters
    ----------
    exemplar, output : array_like
        Images (H, W[, C]) or volumes (D, H, W[, C]), with the same dtype and number of channels, and sides of at least
        16.
    source : SourceMap, optional
        Source map of the output. If given, the report includes the use of the exemplar and the integrity of elements.
        Default: None.
    field : Field, optional
        Field of the output. If given, the report includes the orientation of layers, and neighbours count as coherent
        if they follow the field. Parameters that the field leaves open are derived from the size of the output
        (`texrs.fields.Field.over`). Default: None.
    classes : int or None
        Number of colour classes of the exemplar, 2 to 16. None if both arrays are labels: integers from 0 to 255,
        without channels. Default: 4.
    chosen : int or tuple of int, optional
        Classes or labels whose connected components are measured. Default: the lighter half of the classes, or all
        labels except 0.
    axes : int, optional
        Number of spatial axes, 2 or 3. Default: from the shape. An array of three axes is an image with channels if
        its last axis has at most 4 entries, and otherwise a volume.
    spacing : sequence of float, optional
        Distances between samples along each axis, for both arrays, in any unit. Correlations, paths, sizes,
        orientations and the field then use this unit. Frequencies remain in cycles per sample. Default: the spacing
        that the file of the exemplar states, else 1.

    Returns
    -------
    Comparison
        Report, which `Comparison.text` formats as a table.

    Raises
    ------
    InvalidInput
        The arrays are invalid or too small, or a chosen class does not exist.

    Examples
    --------
    >>> from texrs import samples, volume
    >>> one, other = (samples.particles((32, 32, 32), seed=s).image for s in (0, 1))
    >>> report = volume.compare(one, other)
    >>> report.relative_shares.shape, report.text.splitlines()[0]
    ((4,), '... exemplar  output  output/exemplar')

    """
    known = 3 if axes is None else as_int(axes, "axes", 2, 3)
    first, second = as_ndarray(exemplar, "exemplar", axes=known), as_ndarray(output, "output", axes=known)
    count = as_int(guess_axes(first) if axes is None else axes, "axes", 2, 3)
    spacing = find_distances(spacing, exemplar, count)
    as_distances(spacing, count)
    check_field(field, count)
    first, second = (as_image(a, n, minimum=16, axes=count) for a, n in ((first, "exemplar"), (second, "output")))
    if (first.dtype, first.shape[-1]) != (second.dtype, second.shape[-1]):
        raise InvalidInput(
            f"output: must be {first.dtype} with {first.shape[-1]} channels, like the exemplar, got {second.dtype} "
            f"with {second.shape[-1]} channels"
        )
    if source is not None and (not isinstance(source, SourceMap) or source.shape != second.shape[:count]):
        raise InvalidInput(f"source: must be the source map of the output, of shape {second.shape[:count]}")
    # Classify both arrays, and choose the classes whose connected components are measured.
    if classes is None:
        labels = _as_labels(first, "exemplar"), _as_labels(second, "output")
        kinds = int(max(a.max() for a in labels)) + 1
        pick = tuple(range(1, kinds)) if chosen is None else _choose(chosen, kinds)
        before, after = (np.asarray(a / max(kinds - 1, 1), np.float32) for a in labels)
    else:
        first, second = _share_range(first, second)
        found = statistics.classes(first, classes, axes=count)
        labels = found.of(first, axes=count), found.of(second, axes=count)
        kinds = len(found.centres)
        pick = tuple(range(kinds // 2 + kinds % 2, kinds)) if chosen is None else _choose(chosen, kinds)
        before, after = statistics.lightness(first, axes=count), statistics.lightness(second, axes=count)
    grey = before, after
    # Use windows of the same size for both arrays, so that their frequencies can be compared.
    masks = tuple(np.isin(a, pick) for a in labels)
    seams = np.concatenate(structure.seam_planes(grey[1]))
    window = min(64, *first.shape[:count], *second.shape[:count])
    orientation, turned = None, None
    # Compare the layers of the output with the exemplar's normal, rotated by the field.
    if field is not None:
        field = space(field, spacing).over(second.shape[:count])
        normal = structure.texture_normal(grey[0], spacing=spacing)
        errors = (
            structure.orientation_errors(grey[0], None, normal, spacing=spacing),
            structure.orientation_errors(grey[1], field, normal, spacing=spacing),
        )
        orientation = np.array([[np.median(e), np.quantile(e, 0.9)] for e in errors])
        turned = _turn_normal(field, second.shape[:count], normal, spacing)
    return Comparison(
        np.stack([np.bincount(a.ravel(), minlength=kinds) / a.size for a in labels]),
        (
            statistics.component_statistics(masks[0], spacing=spacing),
            statistics.component_statistics(masks[1], spacing=spacing),
        ),
        (structure.frequency(grey[0], window=window), structure.frequency(grey[1], window=window)),
        np.stack([statistics.two_point_correlation(m, _REACH, spacing=spacing) for m in masks]),
        np.stack([statistics.lineal_path_function(m, _REACH, spacing=spacing) for m in masks]),
        np.stack([structure.autocorrelation(g, _REACH, spacing=spacing) for g in grey]),
        (structure.speckle(grey[0]), structure.speckle(grey[1])),
        float(structure.slice_distances(*grey).mean()),
        np.array([seams.min(), seams.max()]),
        orientation,
        turned,
        None if source is None else cell_reuse(source, field),
        None if source is None else integrity(Exemplar(np.asarray(exemplar), axes=count), source),
    )


def _turn_normal(
    field: Field, shape: tuple[int, ...], normal: NDArray[np.float64], spacing: Sequence[float] | None
) -> float:
    """Return the mean angle in degrees between the exemplar's normal before and after its rotation by a field."""
    lines = [np.linspace(0, n - 1, min(n, 16)) for n in shape]
    frames = turn_in_space(field, np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1), spacing)
    there = np.einsum("...ji,j->...i", frames, normal)
    cosine = np.abs(there @ normal) / np.linalg.norm(there, axis=-1)
    return float(np.degrees(np.arccos(np.minimum(cosine, 1))).mean())


def _share_range(first: Array, second: Array) -> tuple[Array, Array]:
    """Scale floats outside [0, 1] by the exemplar's range to [0, 1]. Return integers unchanged."""
    low, high = (float(f(first)) for f in (np.min, np.max))
    if first.dtype.kind != "f" or (low >= 0 and high <= 1):
        return first, np.clip(second, 0, 1) if second.dtype.kind == "f" else second
    low = min(low, 0.0)
    before, after = (np.clip(locate(a, low, high), 0, 1) for a in (first, second))
    return before, after


def _as_labels(array: Array, name: str) -> Array:
    if array.shape[-1] != 1 or array.dtype.kind not in "bui" or array.min() < 0 or array.max() > 255:
        raise InvalidInput(f"{name}: must be labels from 0 to 255, without channels")
    return array[..., 0].astype(np.uint8)


def _choose(chosen: object, kinds: int) -> tuple[int, ...]:
    several = chosen if isinstance(chosen, tuple | list) else (chosen,)
    if not several:
        raise InvalidInput("chosen: must contain at least one class")
    return tuple(as_int(k, "chosen", 0, kinds - 1) for k in several)


def _divide(pair: tuple[float, float]) -> float:
    return pair[1] / pair[0] if pair[0] else float("nan")


def _measure_distance(pair: NDArray[np.float64]) -> float:
    """Return the mean absolute difference of two curves at the steps where both are finite."""
    off = np.abs(pair[1] - pair[0])
    return float(off[np.isfinite(off)].mean())

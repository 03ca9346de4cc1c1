"""SOLID: textures grown in two and three dimensions under a frame field.

Y.-L. Su, C.-C. Chang, Z.-C. Shih and W.-K. Tai, "Vector-field-based deformations for three-dimensional texture
synthesis" (appearance vectors, similarity sets and a pyramid of corrections after Lefebvre and Hoppe, SIGGRAPH 2005
and 2006). The flow:

1. analyse the exemplar: a pyramid, and appearance vectors at each level (section 3.1; `texrs.exemplar.analysis`);
2. start at the coarsest level;
3. at each finer level, upsample the coordinates with the field's Jacobian (Eq. 1 and 2), and
4. correct them by the windows around each point, warped by the field (Eq. 3 and 4);
5. look the exemplar up through the coordinates.

Departures, with their reasons:

- The start is a lattice of hashed coherent blocks that are chosen to fit, not one coordinate that is jittered at every
  level: from jitter, sparse particles never form, whatever the correction does.
- A block is credited for its own contrast: by squared differences alone bland blocks win, and rare things get fewer.
- The correction changes a point for a drawn match only if that gains more than twice the exemplar's own spacing:
  otherwise repeated corrections wash rare things out.
- A pass corrects every other point, as on a chess board, and only where pieces of the exemplar meet. When all points
  change at once, neighbours on either side of a seam swap and nothing is gained; votes, which mended that, cost a third
  of what is rare.
- Windows are compensated for where the lattice makes them look (o - J step), which the paper leaves out: without it
  turned textures come out at the wrong scale.
- A row vector in Eq. 1 and a column vector in Eq. 3 turn in opposite ways; here J is the inverse of the frame in both.
- The pyramid is decimated, windows are 5^3 at each level and full colour windows are compared, not eight diagonal
  neighbours, which fall apart into lattices that exchange nothing.
- Pictures that nothing turns or guides start from patches stitched along minimum cuts, at full resolution (`texrs.quilting`):
  cuts keep elements whole, where blocks are repaired by windows smaller than an element.
- Where the exemplar repeats, as measured, its coordinates go around.

``method="paper"`` leaves the departures out (`texrs.papers.solid.literal`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texrs._arrays import as_image, as_seed, as_size, as_wrap
from texrs._engine.appearance import Corrected
from texrs._engine.pyramid import ONE, Region, to_fixed, upsample
from texrs._progress import stage
from texrs._typing import Array, Interpolation, Progress
from texrs.errors import InvalidInput
from texrs.exemplar.analysis import COARSEST, Analysis, analyse, are_labels
from texrs.fields import Field
from texrs.papers.solid.constraints import Hold
from texrs.papers.solid.gate import Trial, trial_region
from texrs.papers.solid.limits import check_memory
from texrs.papers.solid.literal import grow as grow_literally
from texrs.papers.solid.patches import stitch
from texrs.papers.solid.settings import Quality, Settings, settings_of
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis

__all__ = ["solid", "synthesize"]

Method: TypeAlias = Literal["paper"] | None
Places: TypeAlias = NDArray[np.int32]


def solid(
    exemplar: Array,
    size: int | Sequence[int],
    *,
    field: Field | None = None,
    seed: int = 0,
    wrap: bool | Sequence[bool] = False,
    quality: Quality = "preserve",
    method: Method = None,
    labels: bool | None = None,
    repeat: bool | Sequence[bool] | None = None,
    held: Array | None = None,
    values: Array | None = None,
    coordinates: Array | None = None,
    guide: tuple[ArrayLike, ArrayLike] | None = None,
    guide_weight: float = 1.0,
    interpolation: Interpolation | None = None,
    analysis: Analysis | None = None,
    memory_limit: int | None = None,
    progress: Progress | None = None,
) -> Synthesis:
    """Grow a volume from a volume, under a frame field.

    Parameters
    ----------
    exemplar : (D, H, W) or (D, H, W, C) array
        Any real dtype and channels; each side at least 16.
    size : int or (int, int, int)
        Planes, rows and columns of the result.
    field : Field, optional
        How the texture is turned and scaled at each voxel (`texrs.fields`); none leaves it as it is.
    seed : int
        Chooses the texture.
    wrap : bool or one an axis
        Axes along which the result is to repeat.
    quality : {"preserve", "fast", "optimise"}
        "preserve" keeps what is rare. "fast" does a third of the work. "optimise" straightens lattices and walls; it is
        checked on a trial, and "preserve" is done instead, and reported, where it would lose anything.
    method : {None, "paper"}
        "paper": the literal algorithm, kept for comparison. It has no ``quality`` and holds no points; it looks the exemplar
        up at the nearest sample unless ``interpolation`` says otherwise.
    labels : bool, optional
        Whether values are classes without an order, looked up at the nearest sample whatever ``interpolation`` says. None:
        where the exemplar has one channel of integers or bool, with 2 to 16 values, such as a mask of 0 and 255.
    repeat : bool, or one an axis, optional
        Axes along which the exemplar repeats; None measures it.
    held : (size) bool, optional
        Voxels that are given: by ``values`` or by ``coordinates``.
    values : (size[, C]) array, optional
        What held voxels show, exactly, in the exemplar's dtype; other voxels are ignored.
    coordinates : (size, 3) array, optional
        Where held voxels look in the exemplar.
    guide : (array_like, array_like), optional
        Two maps of finite numbers that broadcast to the exemplar's axes and to ``size``: each voxel looks for a place where the
        exemplar's map says about what the output's does. For exemplars with a trend, such as grains that grow downwards.
    guide_weight : float
        How much that counts beside looking like the exemplar, 0 to 100: at 1 a third of the range of the exemplar's map costs
        as much as surroundings that have nothing to do with each other.
    interpolation : {"nearest", "linear", "cubic"}, optional
        Between the exemplar's samples; None is "nearest" for labels, else "cubic".
    analysis : Analysis, optional
        Of the same exemplar (`texrs.exemplar.analysis.analyse`); None makes it, or takes it from memory.
    memory_limit : int, optional
        Bytes that the work may take; None is 8 GiB.
    progress : callable, optional
        Called with the stage and the share of it that is done; raising stops the work.

    Returns
    -------
    Synthesis
        The volume, its source map with the field, pictures of the middle plane at each level, and a report.

    Raises
    ------
    InvalidInput
        An exemplar that is too small or not finite, a field of other axes or singular somewhere, held voxels without
        what they hold, or an option out of its range.
    LimitExceeded
        The work would take more memory than allowed.
    Cancelled
        The work was stopped.

    See Also
    --------
    synthesize : The same in two dimensions.
    texrs.SolidTexture : Any window of an unbounded volume.

    References
    ----------
    .. [1] Y.-L. Su, C.-C. Chang, Z.-C. Shih and W.-K. Tai, "Vector-field-based deformations for three-dimensional
       texture synthesis".

    Examples
    --------
    >>> import texrs
    >>> from texrs import fields, samples
    >>> stripes = samples.stripes((32, 32, 32)).image
    >>> result = texrs.solid(stripes, 40, field=fields.circular(axis="x"), seed=1)
    >>> result.image.shape, result.image.dtype
    ((40, 40, 40, 3), dtype('uint8'))

    """
    options = locals() | {"axes": 3, "interpolation": interpolation or ("nearest" if method == "paper" else "cubic")}
    return _verb(**options)


def synthesize(
    exemplar: Array,
    size: int | Sequence[int],
    *,
    field: Field | None = None,
    seed: int = 0,
    wrap: bool | Sequence[bool] = False,
    quality: Quality = "preserve",
    method: Method = None,
    labels: bool | None = None,
    repeat: bool | Sequence[bool] | None = None,
    held: Array | None = None,
    values: Array | None = None,
    coordinates: Array | None = None,
    guide: tuple[ArrayLike, ArrayLike] | None = None,
    guide_weight: float = 1.0,
    interpolation: Interpolation | None = None,
    analysis: Analysis | None = None,
    memory_limit: int | None = None,
    progress: Progress | None = None,
) -> Synthesis:
    """Grow a picture from a picture, under a frame field.

    Parameters
    ----------
    exemplar : (H, W) or (H, W, C) array
        Any real dtype and channels; each side at least 16.
    size : int or (int, int)
        Rows and columns of the result.
    interpolation : {"nearest", "linear", "cubic"}, optional
        Between the exemplar's samples; None is "nearest" for labels, else "cubic".
    field, seed, wrap, quality, method, labels, repeat, analysis, memory_limit, progress
        As of `solid`, with two axes for three.
    held, values, coordinates, guide, guide_weight
        Likewise.

    Returns
    -------
    Synthesis
        The picture, its source map with the field, the stages, and a report.

    Raises
    ------
    InvalidInput, LimitExceeded, Cancelled
        As of `solid`.

    Examples
    --------
    >>> import texrs
    >>> from texrs import fields, samples
    >>> weave = samples.weave((64, 64)).image
    >>> texrs.synthesize(weave, (96, 128), field=fields.zigzag(period=64, axes=2)).image.shape
    (96, 128, 3)

    """
    options = locals() | {"axes": 2, "interpolation": interpolation or ("nearest" if method == "paper" else "cubic")}
    return _verb(**options)


def _verb(
    *,
    exemplar: Array,
    size: int | Sequence[int],
    axes: int,
    field: Field | None,
    seed: int,
    wrap: bool | Sequence[bool],
    quality: Quality,
    method: Method,
    labels: bool | None,
    repeat: bool | Sequence[bool] | None,
    held: Array | None,
    values: Array | None,
    coordinates: Array | None,
    guide: tuple[ArrayLike, ArrayLike] | None,
    guide_weight: float,
    interpolation: Interpolation,
    analysis: Analysis | None,
    memory_limit: int | None,
    progress: Progress | None,
) -> Synthesis:
    image = as_image(exemplar, "exemplar", axes=axes, minimum=COARSEST)
    region = Region.whole(as_size(size, axes=axes), as_wrap(wrap, axes=axes))
    if method not in (None, "paper"):
        raise InvalidInput(f"method: None or 'paper' is allowed, got {method!r}")
    if quality == "optimise" and min(region.shape) < COARSEST:
        quality = "preserve"  # What is so thin cannot be judged by a trial.
    if method == "paper" and (held is not None or guide is not None):
        what = "held" if held is not None else "guide"
        raise InvalidInput(f"{what}: the paper's method knows none; leave out {what}, or method='paper'")
    settings, seed = settings_of(quality), as_seed(seed)
    if method == "paper":
        settings = settings_of("preserve")  # Windows of 5^D.
    checked = as_field(field, axes)
    if checked is not None:
        checked = checked.over(region.shape)
    check_memory(image, region, checked, memory_limit)
    hold = Hold.of(image, region.shape, held, values, coordinates).following(guide, guide_weight, region.shape)
    if analysis is None:
        analysis = analyse(image, axes=axes, wrap=repeat, labels=labels, radii=settings.radii)
    elif not isinstance(analysis, Analysis):
        raise InvalidInput(f"analysis: needs an Analysis, got {type(analysis).__name__}")
    elif analysis.shape != image.shape[:axes]:
        raise InvalidInput(f"analysis: is of an exemplar of {analysis.shape}, not {image.shape[:axes]}")
    grower = Grower(image, analysis, checked, settings, seed)
    trial = None
    if method == "paper":
        grown = Grown(*grow_literally(analysis, checked, seed, region, grower.picture, progress))
    else:
        if quality == "optimise":
            grower, trial = gated(grower, region, labels, repeat, progress)
        grown = grower.grow(region, hold, progress)
    source = SourceMap(
        (grown.places.reshape(*region.shape, axes) / np.float32(ONE)).astype(np.float32, copy=False),
        np.zeros(region.shape, np.uint16),
        np.zeros(region.shape, np.uint32),
        checked,
        (image.shape[:axes],),
    )
    how: Interpolation = "nearest" if are_labels(image, labels) else interpolation
    composite = source.render(exemplar, interpolation=how)
    report = {
        "method": method or "default",
        "quality": None if method else quality if trial is None or trial.accepted else "preserve",
        "trial": None if trial is None else trial.report(),
        "seed": seed,
        "field": None if checked is None else checked.describe(),
        "repeats": list(analysis.wrap),
        "interpolation": how,
        "held": hold.count,
        "guided": hold.followed is not None,
        "levels": grown.report,
    }
    return Synthesis(hold.shown(composite), source, grown.stages | {"composite": composite}, report)


def as_field(field: object, axes: int) -> Field | None:
    """Check a field; the identity is none."""
    if field is None:
        return None
    if not isinstance(field, Field):
        raise InvalidInput(f"field: needs a field of texrs.fields, got {type(field).__name__}")
    if field.axes != axes:
        raise InvalidInput(f"field: needs {axes} axes, got one of {field.axes}")
    still = field.constant is not None and np.array_equal(field.constant, np.eye(axes, dtype=np.float32))
    return None if still else field


def gated(
    grower: Grower,
    region: Region,
    labels: bool | None,
    repeat: bool | Sequence[bool] | None,
    progress: Progress | None,
) -> tuple[Grower, Trial]:
    """Try "optimise" on a part of the output, and give the grower that serves: it, or "preserve"."""
    part = trial_region(region, grower.image)
    tried = grower.grow(part, Hold(grower.image), None if progress is None else lambda n, s: progress(f"trial: {n}", s))
    axes = len(part.shape)
    coordinates = (tried.places.reshape(*part.shape, axes) / np.float32(ONE)).astype(np.float32, copy=False)
    trial = Trial.of(grower.image, coordinates, grower.field)
    if trial.accepted:
        return grower, trial
    settings = settings_of("preserve")
    analysis = analyse(grower.image, axes=axes, wrap=repeat, labels=labels, radii=settings.radii)
    return Grower(grower.image, analysis, grower.field, settings, grower.seed), trial


@dataclass(frozen=True, slots=True, eq=False)
class Grown:
    """Places of a region, what was done at each level, and pictures of it."""

    places: Places
    report: list[dict[str, Any]]
    stages: dict[str, Array]


@dataclass(frozen=True, slots=True, eq=False)
class Grower:
    """Grows regions from an analysed exemplar: steps 2 to 4."""

    image: Array
    analysis: Analysis
    field: Field | None
    settings: Settings
    seed: int

    def grow(self, region: Region, hold: Hold, progress: Progress | None = None) -> Grown:
        """Grow a bounded region, whose borders are free."""
        regions = [region]
        for _ in self.analysis.levels[1:]:
            regions.insert(0, regions[0].parents())
        places: Places | None = None
        report: list[dict[str, Any]] = []
        stages: dict[str, Array] = {}
        first = 0
        if self.stitches(region, hold):
            first = len(regions) - 1
            places = stitch(self.image, region, self.seed, stage(progress, "patches"))
            stages["patches"] = self.picture(places, region, first)
        for level, here in enumerate(regions[first:], start=first):
            frames = self.frames(level, here)
            if level == first and places is not None:
                pass
            elif places is None:
                places = self.start(here, frames, hold, progress)
                stages["blocks"] = self.picture(places, here, level)
            else:
                places = upsample(places, regions[level - 1], here, frames)
            places, passes, changed = self.correct(places, level, here, frames, hold, progress)
            stages[f"level {level + 1}"] = self.picture(places, here, level)
            report.append(
                {
                    "shape": list(here.shape),
                    "spacing": round(self.analysis.levels[level].spacing, 6),
                    "passes": passes,
                    "changed": round(changed, 6),
                }
            )
        assert places is not None  # there is at least one level
        return Grown(places, report, stages)

    def stitches(self, region: Region, hold: Hold) -> bool:
        """Return whether to start from patches stitched along minimum cuts: in pictures that nothing turns or guides."""
        free = self.field is None and not hold.count and hold.followed is None
        # Of what is thinner there is nothing to cut.
        return self.settings.stitch and free and len(region.shape) == 2 and min(region.shape) >= COARSEST

    def spacing(self, level: int) -> int:
        """Voxels from one point of a level to the next."""
        return 1 << (len(self.analysis.levels) - 1 - level)

    def frames(self, level: int, region: Region) -> NDArray[np.int16]:
        """Jacobians at the points of a level, of their places in the world: averages of turned frames would shrink."""
        return to_fixed(self.field, region, self.spacing(level))

    def start(
        self,
        region: Region,
        frames: NDArray[np.int16],
        hold: Hold,
        progress: Progress | None = None,
        *,
        margin: int = 0,
    ) -> Places:
        """Step 2: coherent blocks; a margin will be cut off."""
        s, coarsest = self.settings, self.analysis.levels[0]
        places = coarsest.blocks(
            region,
            frames,
            cell=s.cell,
            rounds=s.rounds,
            candidates=s.candidates,
            contrast=s.contrast,
            continuation=s.continuation,
            repetition=s.repetition,
            seed=self.seed,
            margin=margin,
            guide=hold.guide(coarsest, region, self.spacing(0)),
            progress=stage(progress, "blocks"),
        )
        return hold.place(places, region, self.spacing(0))

    def correct(
        self,
        places: Places,
        level: int,
        region: Region,
        frames: NDArray[np.int16],
        hold: Hold,
        progress: Progress | None = None,
        *,
        first: int = 0,
        passes: int | None = None,
    ) -> Corrected:
        """Step 4: windows, matches, votes."""
        here = self.analysis.levels[level]
        step = self.settings.at(level, len(self.analysis.levels))
        return here.correct(
            hold.place(places, region, self.spacing(level)),
            region,
            frames,
            passes=step.passes if passes is None else passes,
            first=first,
            exhaustive=step.exhaustive,
            reach=step.reach,
            hysteresis=self.settings.hysteresis,
            unity=self.settings.unity,
            vote=min(step.vote, here.radius),
            settled=self.settings.settled,
            # The noise of a level is its own.
            seed=(self.seed + 0x9E3779B97F4A7C15 * (level + 1)) % (1 << 64),
            held=hold.fixed(region, self.spacing(level)),
            guide=hold.guide(here, region, self.spacing(level)),
            progress=stage(progress, f"level {level + 1} of {len(self.analysis.levels)}"),
        )

    def picture(self, places: Places, region: Region, level: int) -> Array:
        """Show places of a level: all of a picture, the middle plane of a volume, through the exemplar itself."""
        axes = len(region.shape)
        shown = places.reshape(*region.shape, axes)
        if axes == 3:
            shown = shown[region.shape[0] // 2]
        fine = (np.rint(shown / np.float32(ONE)) + 0.5) * self.spacing(level) - 0.5
        at = tuple(np.clip(np.rint(fine[..., a]).astype(np.intp), 0, self.image.shape[a] - 1) for a in range(axes))
        return self.image[at]

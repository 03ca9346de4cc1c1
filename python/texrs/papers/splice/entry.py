"""Parameters of `texrs.splice` and `texrs.self_splice`, checked before any work begins, and analysed textures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, replace
from functools import partial, wraps
from typing import Any, Concatenate, Literal, ParamSpec, TypeAlias, TypeVar

import numpy as np

from texrs._arrays import as_bool, as_image, as_ndarray, as_size, as_wrap, check_work
from texrs._cache import Cache, content_hash
from texrs._requests import (
    PROGRESS,
    SEED,
    Request,
    Word,
    as_given,
    as_weight,
    method,
    optional,
    real,
    request,
    tied,
    truth,
)
from texrs._typing import Array, Progress
from texrs.blending import SCREENING
from texrs.elements import ElementAnalysis, analyse
from texrs.elements.arguments import as_points
from texrs.errors import InvalidInput, LimitExceeded
from texrs.materials import Material
from texrs.papers.splice.edit import as_steps

__all__ = ["SelfSplice", "Splice", "remember"]

P = ParamSpec("P")
T = TypeVar("T")
Making: TypeAlias = Callable[Concatenate[ElementAnalysis, P], T]

FEWEST = 3
SHORTEST = 16
Method: TypeAlias = Literal["paper", "preview"] | None
Edit: TypeAlias = str | Mapping[str, Any] | Sequence[Mapping[str, Any]]
CACHES: list[Cache[bytes, Any]] = []
"""All caches that `remember` created."""


def flag(value: object, name: str) -> bool:
    """Check a bool. None counts as False."""
    return value is not None and as_bool(value, name)


@request
class Splice(Request):
    """Parameters of `texrs.splice`.

    - ``elements`` (ElementAnalysis, or (H, W) or (H, W, C) array): Texture whose elements are used. An image is first
      analysed by `texrs.elements.analyse`.
    - ``layout`` (ElementAnalysis, or array): Texture or drawn layout (`texrs.layouts`) that determines the positions
      of the elements.
    - ``size`` (int or (rows, columns), optional): Size of the result, in pixels. Default: the size of the image of
      ``elements``.
    - ``seed`` (int): Seed of the patches that fill holes, and of the noise of the refinement, 0 to 2^64 - 1. Default:
      0.
    - ``method`` ({None, "paper", "preview"}): Algorithm to use. "paper" is the algorithm as printed, with only its
      misprints repaired. "preview" draws triangles between the moved elements, without keeping elements rigid or
      filling holes. Default: the algorithm with departures from the paper.
    - ``strength`` (float): Fraction of the way that elements move, from their own layout (0) to the other layout (1).
      With 0, separate elements stay in place, so the result at the texture's own size equals the texture. Default: 1.
    - ``layout_scale`` (float, optional): Scale of the layout, 0.01 to 100. With 1, a pixel of the layout is a pixel of
      the result, and the centres of both images coincide. With 2, separate elements are half as dense along each axis.
      Elements that are too dense are pushed apart. Default: the scale that fits the layout to the spacing or the size
      of the elements.
    - ``align`` (bool, optional): If True, the layout is rotated so that lines of its points agree with lines of the
      elements. This has no effect on cells and nets. Default: True if ``layout_scale`` is not given.
    - ``snap_rows`` (bool): If True, target positions that are nearly in a row are moved onto one line. For example,
      the long joints of a curved wall become straight. Default: False.
    - ``use_cells`` (bool, optional): If True, a connected texture is composed of its cells. If False, its figure is
      bent. Default: True if cells are found.
    - ``use_nets`` (bool, optional): If True, a connected texture is composed of its knots and the lines between them,
      even if it has cells. If False, its figure is bent. Default: True if the texture has no cells and a reliable
      layout of at least six knots, and ``use_cells`` is not given.
    - ``allow_rotation`` (bool, optional): If True, cells may be rotated. Default: True, unless light or letters show
      which side of the texture is up.
    - ``refine`` (bool): If True, deformed pixels between rigid elements, or stretched pixels of cells, are refined.
      Nets, and separate elements on their own background, are never refined. Default: True.
    - ``screening`` (float, optional): Weight of the original values when colours are corrected at the borders between
      elements and background, 0 to 1e6, see `texrs.blend`. This only affects separate elements on their background. A
      texture that is lit from one side gives a result that is lit in the same way. None or 0: colours are not
      corrected, and the image is the texture at the coordinates of the source map. Default: 0.02.
    """

    elements: Word[ElementAnalysis | Material | Array, Any] = Word(as_given)
    layout: Word[ElementAnalysis | Material | Array, Any] = Word(as_given)
    size: Word[int | Sequence[int] | None, tuple[int, ...] | None] = Word(
        optional(partial(as_size, minimum=16)), default=None
    )
    _: KW_ONLY
    seed: Word[int, int] = SEED
    method: Word[Method, Method] = Word(method(None, "paper", "preview"), default=None)
    strength: Word[float, float] = Word(real(0, 1), default=1.0)
    layout_scale: Word[float | None, float | None] = Word(optional(real(0.01, 100)), default=None)
    align: Word[bool | None, bool | None] = Word(truth, default=None)
    snap_rows: Word[bool, bool] = Word(flag, default=False)
    use_cells: Word[bool | None, bool | None] = Word(truth, default=None)
    use_nets: Word[bool | None, bool | None] = Word(truth, default=None)
    allow_rotation: Word[bool | None, bool | None] = Word(truth, default=None)
    refine: Word[bool, bool] = Word(flag, default=True)
    screening: Word[float | None, float] = Word(as_weight, default=SCREENING)
    progress: Word[Progress | bool | None, Progress | None] = PROGRESS

    @tied
    def turned(self) -> bool:
        """Whether the layout is rotated so that lines of its points agree with lines of the elements."""
        if self.layout_scale is not None and self.method == "paper":
            raise InvalidInput(
                'layout_scale: cannot be combined with method="paper", which scales the layout to the spacing of the '
                "elements"
            )
        return self.layout_scale is None if self.align is None else self.align

    @tied
    def composed(self) -> bool:
        """Whether cells or nets were requested."""
        for name, wanted in (("use_cells", self.use_cells), ("use_nets", self.use_nets)):
            if wanted and self.method is not None:
                raise InvalidInput(
                    f'{name}: cannot be combined with method="{self.method}", which deforms connected textures instead'
                )
        if self.use_cells and self.use_nets:
            raise InvalidInput(
                "use_nets: cannot be combined with use_cells, because a texture is composed either of cells or of knots"
            )
        return bool(self.use_cells or self.use_nets)

    # Images are analysed only after all cheap checks of the arguments.
    @tied
    def mine(self) -> ElementAnalysis:
        """Analysed texture whose elements are used."""
        return as_elements(self.elements, "elements", self.watch)

    @tied
    def theirs(self) -> ElementAnalysis:
        """Analysed texture that determines the positions of the elements."""
        return as_elements(self.layout, "layout", self.watch)

    @tied
    def extent(self) -> tuple[int, int]:
        """Size of the result in pixels."""
        rows, columns = self.size or as_size(self.mine.mask.shape, minimum=16)
        check_work("splice", [self.mine.image, self.theirs.image], (rows, columns))
        return rows, columns


@request
class SelfSplice(Request):
    """Parameters of `texrs.self_splice`.

    - ``elements`` (ElementAnalysis, or (H, W) or (H, W, C) array): Texture to edit. An image is first analysed by
      `texrs.elements.analyse`.
    - ``edit`` (str, mapping, or sequence of mappings, optional): Steps of the edit in order: scale, shift, rows,
      randomise, regularise, move, remove or points. Python accepts plain JSON types. Steps change the layout, but not
      the size of elements.  ``{"op": "scale", "factor": 1.2}`` or ``[1.2, 1]`` scales the layout, not the elements.
      ``{"op": "shift", "by": [4, 0]}`` moves all elements by rows and columns, in pixels. ``{"op": "rows", "by": 6}``
      moves every other row to the right and the other rows to the left. ``{"op": "randomise", "amount": 0.25, "least":
      0.7}`` adds Gaussian displacements with a standard deviation of 0.25 spacings. The minimum distance of elements
      is then 0.7 of the usual minimum. ``{"op": "regularise", "amount": 1}`` moves elements onto the lattice that fits
      best. ``{"op": "move", "element": 3, "by": [0, 8]}`` moves one element; ``"to"`` gives its new place instead.
      ``{"op": "remove", "element": 3}`` removes one element. ``{"op": "points", "points": [[row, column], ...]}``
      lists new places. A name without options is a step with its defaults. The report's "edit" lists the steps.
      Default: the layout is not changed.
    - ``size`` (int or (rows, columns), optional): Size of the result, in pixels, at least 16 along each axis. Before
      the edit, the texture is continued to a larger size, or cropped to its middle. A larger result continues the
      texture's own layout, as in a splice with itself. A smaller result is the middle of the texture. The steps use
      the element numbers of the report's "elements", which lists their places before the steps. Default: the size of
      the image of ``elements``.
    - ``seed`` (int): Seed of random steps, elements that enter over a border, patches in holes, and the noise of the
      refinement, 0 to 2^64 - 1. Default: 0.
    - ``method`` ({None, "paper", "preview"}): Algorithm to use. "paper" is the algorithm as printed, with only its
      misprints repaired. "preview" draws triangles between the moved elements, without keeping elements rigid or
      filling holes. Default: the algorithm with departures from the paper.
    - ``refine`` (bool): If True, deformed pixels are refined. Only connected figures, and separate elements whose
      visible background is too small, are deformed. Default: True.
    - ``screening`` (float, optional): Weight of the original values when colours are corrected where moved elements
      meet the background, 0 to 1e6, as in `splice`. This only affects separate elements on their background. None or
      0: colours are not corrected. Default: 0.02.
    """

    elements: Word[ElementAnalysis | Material | Array, Any] = Word(as_given)
    edit: Word[Edit | None, Any] = Word(as_given, default=None)
    size: Word[int | Sequence[int] | None, tuple[int, ...] | None] = Word(
        optional(partial(as_size, minimum=16)), default=None
    )
    _: KW_ONLY
    seed: Word[int, int] = SEED
    method: Word[Method, Method] = Word(method(None, "paper", "preview"), default=None)
    refine: Word[bool, bool] = Word(flag, default=True)
    screening: Word[float | None, float] = Word(as_weight, default=SCREENING)
    progress: Word[Progress | bool | None, Progress | None] = PROGRESS

    @tied
    def steps(self) -> list[dict[str, Any]]:
        """Steps of the edit, each with all its options."""
        return as_steps(() if self.edit is None else self.edit, self.seed)

    @tied
    def mine(self) -> ElementAnalysis:
        """Analysed texture whose layout is edited."""
        mine = as_elements(self.elements, "elements", self.watch)
        check_work(
            "self_splice", [mine.image], self.size or mine.mask.shape, "elements" if self.size is None else "size"
        )
        return mine


def as_elements(value: object, name: str, progress: Progress) -> ElementAnalysis:
    """Return an analysed texture after checking it. An image is analysed first."""
    if not isinstance(value, ElementAnalysis):
        given = as_ndarray(value, name)
        as_image(given, name, minimum=SHORTEST)
        try:
            found = analyse(given, progress=progress)
            # Keep the given shape of the image, (H, W) or (H, W, C).
            return check_entry(replace(found, image=given), name)
        except LimitExceeded:
            raise
        except InvalidInput as error:
            raise InvalidInput(
                f"{name}: {error}; to give a box, points or a mask, use texrs.elements.analyse"
            ) from None
    return check_entry(value, name)


def check_entry(entry: ElementAnalysis, name: str) -> ElementAnalysis:
    """Check that the parts of an analysed texture match, and return it with points in double precision."""
    image = as_image(entry.image, f"{name}.image", minimum=SHORTEST)
    shape = image.shape[:2]
    mask = np.asarray(entry.mask)
    if mask.shape != shape or mask.dtype != np.bool_:
        raise InvalidInput(f"{name}.mask: must be bool of shape {shape}, got {mask.dtype} of shape {mask.shape}")
    if mask.all() or not mask.any():
        raise InvalidInput(
            f"{name}.mask: must contain elements and background, got {'only' if mask.any() else 'no'} foreground"
        )
    points = as_points(entry.points, (shape[0], shape[1]), f"{name}.points")
    if len(points) < FEWEST:
        raise InvalidInput(
            f"{name}.points: must contain at least three elements for a layout, got {len(points)}; "
            "give a larger image, another box, or the points"
        )
    as_wrap(entry.wrap, f"{name}.wrap")
    known = entry.known
    if known is not None and (known.shape != shape or known.min() < 0 or not len(points) <= known.max() <= known.size):
        raise InvalidInput(
            f"{name}.known: must be an array of labels of shape {shape}, with a label for each of the {len(points)} points"
        )
    return replace(entry, points=points)


def remember(
    count: int, *, seen: bool = False, size: Callable[[Any], int] | None = None
) -> Callable[[Making[P, T]], Making[P, T]]:
    """Decorate a function of an analysed texture so that its last results are cached.

    Parameters
    ----------
    count : int
        Maximum number of cached results, or their maximum total ``size``.
    seen : bool
        If True, the key also contains the image and the box of an element. This is required for functions that read
        them. Default: False.
    size : callable, optional
        Function that returns the size of a result. Default: each result has size 1.

    """

    def decorate(make: Making[P, T]) -> Making[P, T]:
        cache: Cache[bytes, T] = Cache(count, size)
        CACHES.append(cache)

        @wraps(make)
        def recall(entry: ElementAnalysis, /, *rest: P.args, **options: P.kwargs) -> T:
            content = (np.packbits(entry.mask), entry.points, entry.mask.shape, entry.layout, entry.wrap, entry.known)
            shown = (np.asarray(entry.image), entry.box) if seen else ()
            key = content_hash(*content, *shown, rest, sorted(options.items()))
            return cache.get_or_make(key, lambda: make(entry, *rest, **options))

        return recall

    return decorate

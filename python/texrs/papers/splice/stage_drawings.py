"""Images of the stages of `texrs.papers.splice`, drawn on access."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, as_rgb, to_unit
from texrs._typing import Array, Bools, Labels
from texrs.elements import ElementAnalysis
from texrs.exemplar.shapes import mark_outlines
from texrs.papers.splice.matching import Match
from texrs.papers.splice.refine import Draft

__all__ = ["Stages", "draw_stages"]

Points = NDArray[np.float64]
Picture = NDArray[np.uint8]

RED, BLUE, GREEN, WHITE = (230, 40, 30), (40, 90, 230), (30, 170, 70), (255, 255, 255)
HOLE = (255, 0, 255)


class Stages(Mapping[str, Array]):
    """Mapping from stage names to images, which are drawn on first access."""

    def __init__(self, draw: Mapping[str, Callable[[], Array]]) -> None:
        self._draw = draw
        self._drawn: dict[str, Array] = {}

    def __getitem__(self, name: str) -> Array:
        """Return the image of a stage."""
        if name not in self._drawn:
            self._drawn[name] = self._draw[name]()
        return self._drawn[name]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of the stages."""
        return iter(self._draw)

    def __len__(self) -> int:
        """Return the number of stages."""
        return len(self._draw)


def draw_stages(
    a: ElementAnalysis,
    b: ElementAnalysis | None,
    match: Match,
    target: Points | None,
    draft: Draft,
    filled: Draft,
    image: Array,
) -> Stages:
    """Return the stages of a splice, or of an edit (without ``b``, and without ``target`` if nothing was warped)."""
    extension = match.extension
    origin = np.array(extension.origin)
    shown = to_picture(a.image)
    draw: dict[str, Callable[[], Array]] = {"source points": lambda: mark_points(shown, a.points, RED)}
    if b is not None:
        draw["target points"] = lambda: mark_points(to_picture(b.image), b.points, BLUE)
    draw |= {
        "mask": lambda: dim_ground(shown, a.mask),
        "matching": lambda: draw_lines(
            shown[extension.pixel[..., 0], extension.pixel[..., 1]], match.starts - origin, match.targets - origin
        ),
    }
    if target is not None:
        draw["warped mesh"] = lambda: draw_mesh(target, extension.mask, draft.known.shape)
    draw |= {
        "before refinement": lambda: show_draft(shown, draft),
        "filled": lambda: shown[filled.places[..., 0], filled.places[..., 1]],
        "before_blending": lambda: image,
    }
    return Stages(draw)


def to_picture(image: Array) -> Picture:
    """Return any image as 8-bit RGB."""
    return np.rint(as_rgb(to_unit(as_image(image))) * 255).astype(np.uint8)


def mark_points(image: Picture, points: Points, colour: tuple[int, int, int]) -> Picture:
    """Draw a ring around each point on a copy of an image."""
    out = image.copy()
    angles = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    for radius, shade in ((4, WHITE), (3, colour), (2, colour)):
        at = np.rint(points[:, None] + radius * np.stack([np.sin(angles), np.cos(angles)], axis=-1)).astype(np.intp)
        _put(out, at.reshape(-1, 2), shade)
    return out


def draw_outlines(image: Picture, labels: Labels, colour: tuple[int, int, int]) -> Picture:
    """Return an image with the outlines of labelled regions drawn over it. Label 0 does not have an outline."""
    out = image.copy()
    out[mark_outlines(labels)] = colour
    return out


def dim_ground(image: Picture, mask: Bools) -> Picture:
    """Return the image with its background darkened and tinted blue."""
    return np.where(mask[..., None], image, (image // 3 + np.array(BLUE) // 3).astype(np.uint8)).astype(np.uint8)


def draw_lines(image: Picture, start: Points, end: Points) -> Picture:
    """Draw a line from each element to its target on a faded image."""
    out = (image // 2 + 100).astype(np.uint8)
    share = np.linspace(0, 1, 200)[None, :, None]
    _put(out, np.rint(start[:, None] * (1 - share) + end[:, None] * share).astype(np.intp).reshape(-1, 2), GREEN)
    return mark_points(mark_points(out, start, RED), end, BLUE)


def draw_mesh(target: Points, mask: Bools, size: tuple[int, ...], step: int = 8) -> Picture:
    """Draw every 8th line of the warped mesh, darker on the texture's foreground."""
    out = np.full((*size, 3), 255, np.uint8)
    for of, places in ((mask[::step], target[::step]), (mask[:, ::step], target[:, ::step])):
        for shade, where in (((170, 170, 190), ~of), ((40, 40, 60), of)):
            _put(out, np.rint(places[where]).astype(np.intp), shade)
    return out


def show_draft(image: Picture, draft: Draft) -> Picture:
    """Draw the warped texture, with its holes in one colour."""
    out: Picture = image[draft.places[..., 0], draft.places[..., 1]].copy()
    out[~draft.known] = HOLE
    return out


def _put(image: Picture, at: NDArray[np.intp], colour: tuple[int, int, int]) -> None:
    inside = ((at >= 0) & (at < np.array(image.shape[:2]))).all(axis=1)
    image[at[inside, 0], at[inside, 1]] = colour

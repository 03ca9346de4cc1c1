"""Measures of an analysis: the share of true elements that were found, and of found elements that are true (S1)."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from texrs.elements import Layout

TOLERANCE = 0.2
"""Distance between an element and its detection, as a share of the box along each axis."""


@dataclass(frozen=True)
class Score:
    """Score of points compared with true centres."""

    recall: float
    """Share of all true centres that were found."""
    inner: float
    """Share of the true centres at least half a box away from the border that were found."""
    precision: float
    """Share of the points at least half a box away from the border that are true."""
    error: float
    """Mean distance of the pairs, in pixels."""


def pair(points: Any, centres: Any, box: Any, tolerance: float = TOLERANCE) -> tuple[Any, Any]:
    """Pair points and centres one to one, with as many and as near pairs as possible. Return the indices of both."""
    from scipy.optimize import linear_sum_assignment

    away = np.sqrt((((points[:, None] - centres[None]) / np.asarray(box, float)) ** 2).sum(axis=-1))
    i, j = linear_sum_assignment(np.where(away <= tolerance, away, 1e3))
    paired = away[i, j] <= tolerance
    return i[paired], j[paired]


def score(points: Any, centres: Any, box: Any, shape: Any, tolerance: float = TOLERANCE) -> Score:
    """Score points against true centres. Each centre matches at most one point."""
    box = np.asarray(box, float)
    i, j = pair(points, centres, box, tolerance)
    hit, got = np.zeros(len(points), bool), np.zeros(len(centres), bool)
    hit[i], got[j] = True, True

    def inside(p: Any) -> Any:
        return ((p >= box / 2) & (p <= np.array(shape[:2]) - 1 - box / 2)).all(axis=1)

    near, true = inside(points), inside(centres)
    return Score(
        float(got.mean()),
        float(got[true].mean()) if true.any() else 1.0,
        float(hit[near].mean()) if near.any() else 1.0,
        float(np.linalg.norm(points[i] - centres[j], axis=1).mean()) if len(i) else np.inf,
    )


def passes(found: Score, *, recall_only: bool = False) -> bool:
    """Return whether check S1 is met."""
    return found.inner >= 0.9 and (recall_only or found.precision >= 0.85)


@dataclass(frozen=True)
class Annotated:
    """A texture with its annotation, all in (row, column)."""

    name: str
    image: Path
    layout: Layout
    box: tuple[float, float, float, float]
    background: Any
    centres: Any

    @classmethod
    def of(cls, path: Path) -> Annotated:
        """Read a JSON annotation, which has (x, y)."""
        given = json.loads(path.read_text(encoding="utf-8"))
        (x, y), (width, height) = given["foreground_box"]["center"], given["foreground_box"]["size"]
        centres = given.get("texel_centres")
        return cls(
            path.stem,
            path.parent / given["image"],
            Layout(given["tag"]),
            (y, x, height, width),
            np.array(given["background_scribble"], float)[:, ::-1],
            np.array(centres, float)[:, ::-1] if centres else None,
        )


def annotated(folder: Path) -> list[Annotated]:
    """Read all annotations of the textures with separate elements, nets and joints."""
    folders = ("b-disjoint", "c-connected", "d-background")
    return [Annotated.of(path) for name in folders for path in sorted((folder / name).glob("*.json"))]

"""Agreement of scale maps with the truth, for generated samples and a folder of images with ground truth."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from math import atan, degrees
from pathlib import Path

import numpy as np
from scipy import ndimage

from texrs import io, samples, scale_maps


@dataclass(frozen=True)
class Case:
    """An image of an oblique plane.

    `width` is the size of elements across the slope. Ground truth is the square root of their area, which is the 3/2
    power of it in perspective.
    """

    name: str
    image: np.ndarray
    width: np.ndarray
    slant: float
    tilt: float
    fov: float
    mask: np.ndarray | None = None


@dataclass(frozen=True)
class Agreement:
    """Correlation of the scales, and slope of log S on the log of the truth."""

    correlation: float
    slope: float

    @classmethod
    def of(cls, scale: np.ndarray, truth: np.ndarray, where: np.ndarray | None = None) -> Agreement:
        a, b = (np.asarray(v, np.float64)[... if where is None else where].ravel() for v in (scale, truth))
        return cls(float(np.corrcoef(a, b)[0, 1]), float(np.polyfit(np.log(b), np.log(a), 1)[0]))


def _of_focal(size: tuple[int, ...], focal: float) -> float:
    return degrees(2 * atan(max(size) / 2 / focal))


@cache
def generated(side: int = 256) -> tuple[Case, ...]:
    """Return the tilted samples, and the tiles rotated to other directions."""
    discs, bricks = samples.tilted_discs((side, side)), samples.tilted_bricks((side, side))
    fov = _of_focal((side, side), 1.5 * side)
    cases = []
    for turns in range(4):
        image, area, mask = (
            np.ascontiguousarray(np.rot90(a, turns)) for a in (discs.image, discs.scale_map, discs.mask)
        )
        cases.append(
            Case(f"tiles to {(90 + 90 * turns) % 360}", image, area ** (2 / 3), 50, 90 + 90 * turns, fov, mask)
        )
    bricked = Case("bricks", bricks.image, bricks.scale_map ** (2 / 3), 45, 158, fov, bricks.mask)
    return (*cases, bricked)


def in_folder(folder: Path) -> Iterator[Case]:
    """Return the images of a folder with a ``ground-truth.json``, in it or in one of its subfolders."""
    for listing in sorted(folder.rglob("ground-truth.json")):
        for name, known in json.loads(listing.read_text(encoding="utf-8")).items():
            image = io.read(listing.parent / name)
            size = image.shape[:2]
            # The stored map contains every second pixel, beginning with the first.
            area = np.load(listing.parent / known["scale_map"].split()[0]).astype(np.float64)
            at = np.meshgrid(
                *(np.minimum(np.arange(n) / 2, m - 1) for n, m in zip(size, area.shape, strict=True)), indexing="ij"
            )
            width = ndimage.map_coordinates(area, at, order=1) ** (2 / 3)
            fov = _of_focal(size, known["focal_px"])
            yield Case(Path(name).stem, image, width, known["slant_deg"], known["tilt_deg"], fov)


def by_angles(case: Case) -> tuple[Agreement, Agreement]:
    """Compare the maps from the angles only, and from the angles and the angle of view."""
    size, angles = case.image.shape[:2], (case.slant, case.tilt)
    return (
        Agreement.of(scale_maps.from_angles(size, *angles), case.width),
        Agreement.of(scale_maps.from_angles(size, *angles, fov=case.fov), case.width),
    )


def by_mask(case: Case, mask: np.ndarray, **options: object) -> Agreement:
    """Compare the map measured in a mask."""
    return Agreement.of(scale_maps.from_mask(mask, **options), case.width)


def in_hole(case: Case, share: float = 0.3) -> tuple[Agreement, Agreement]:
    """Compare the map in a hole, measured around it and continued, with the map without a hole."""
    size = case.image.shape[:2]
    known = np.ones(size, np.bool_)
    known[tuple(slice(int(n * (1 - share) / 2), int(n * (1 + share) / 2)) for n in size)] = False
    image = np.where(known[..., np.newaxis], case.image, 0)
    there = scale_maps.from_mask(scale_maps.auto_mask(image, known=known), known=known)
    whole = scale_maps.from_mask(scale_maps.auto_mask(case.image))
    return Agreement.of(there, case.width, ~known), Agreement.of(whole, case.width, ~known)

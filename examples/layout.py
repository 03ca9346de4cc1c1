"""Pictures set side by side and below each other, for the pictures that the README and the documentation show."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from skimage.transform import resize

from texrs.synthesis import preview

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "pictures"
GAP = 8
FONT = 16
"""Smallest size of labels, in pixels."""
COLUMN = 60
"""Width of a picture divided by the size of its labels. The text column shows wide pictures at a smaller scale."""
GIVEN, MADE = (196, 98, 16), (40, 40, 40)
"""Colours of the labels of inputs and of results."""
INPUT, RESULT = True, False
Panel = tuple[np.ndarray, str, bool]
"""A picture, its label, and whether it is an input."""


def rgb(picture: np.ndarray, height: int | None = None) -> np.ndarray:
    """Return an 8-bit RGB version of a picture or a stage, on white where it is transparent, at a height or at its own."""
    seen = preview(np.asarray(picture))
    if seen.ndim == 2:
        seen = np.repeat(seen[..., np.newaxis], 3, axis=-1)
    elif seen.shape[-1] == 4:
        alpha = seen[..., 3:] / 255
        seen = np.rint(seen[..., :3] * alpha + 255 * (1 - alpha)).astype(np.uint8)
    if height in (None, seen.shape[0]):
        return seen
    width = round(seen.shape[1] * height / seen.shape[0])
    return np.rint(resize(seen, (height, width), anti_aliasing=True, order=1) * 255).astype(np.uint8)


def beside(pictures: list[np.ndarray], height: int | None = None) -> np.ndarray:
    """Set pictures side by side, all at one height or on white where they are less high."""
    shown = [rgb(p, height) for p in pictures]
    most = max(p.shape[0] for p in shown)
    cells = [np.pad(p, ((0, most - len(p)), (0, GAP), (0, 0)), constant_values=255) for p in shown]
    return np.concatenate(cells, axis=1)[:, :-GAP]


def below(rows: list[np.ndarray]) -> np.ndarray:
    """Set rows below each other, on white where they are less wide."""
    most = max(r.shape[1] for r in rows)
    cells = [np.pad(r, ((0, GAP), (0, most - r.shape[1]), (0, 0)), constant_values=255) for r in rows]
    return np.concatenate(cells, axis=0)[:-GAP]


def label(picture: np.ndarray, text: str, height: int, *, given: bool = False, font: int = FONT) -> np.ndarray:
    """Return an image with its label on a strip above it; an input is framed and labelled in orange."""
    shown, colour = rgb(picture, height), GIVEN if given else MADE
    if given:
        for edge in (np.s_[:3], np.s_[-3:], np.s_[:, :3], np.s_[:, -3:]):
            shown[edge] = colour
    strip = Image.new("RGB", (shown.shape[1], font * 13 // 8), "white")
    ImageDraw.Draw(strip).text((2, font // 5), text, fill=colour, font=ImageFont.load_default(font))
    return np.concatenate([np.asarray(strip), shown])


def write_panels(file: Path, rows: Sequence[Sequence[Panel]], height: int) -> None:
    """Write rows of labelled panels to a JPEG file. The highest panel of each row has a height in pixels.

    The comment of the file contains the boxes of the panels (left, top, right, bottom). `docs/finish.py` arranges the
    panels for phones by these boxes.
    """
    scales = [height / max(len(image) for image, _, _ in row) for row in rows]

    def draw(font: int) -> list[list[np.ndarray]]:
        return [
            [label(image, text, round(scale * len(image)), given=given, font=font) for image, text, given in row]
            for row, scale in zip(rows, scales, strict=True)
        ]

    wide = max(beside(row).shape[1] for row in draw(FONT))
    panels = draw(max(FONT, wide // COLUMN))
    boxes, top = [], 0
    for row in panels:
        left = 0
        for panel in row:
            boxes.append((left, top, left + panel.shape[1], top + panel.shape[0]))
            left += panel.shape[1] + GAP
        top += max(len(panel) for panel in row) + GAP
    shown = below([beside(row) for row in panels])
    file.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(shown).save(file, quality=88, subsampling=0, comment=json.dumps({"panels": boxes}))
    print(file.name, shown.shape, flush=True)

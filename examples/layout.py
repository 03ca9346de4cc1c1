"""Pictures set side by side and below each other, for the pictures that the README shows."""

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from skimage.transform import resize

from texrs.synthesis import preview

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "pictures"
GAP = 8
STRIP = 26
"""Height of the strip above an image that holds its label, in pixels."""
INPUT, RESULT = (196, 98, 16), (40, 40, 40)
"""Colours of the labels of inputs and of results."""


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


def label(picture: np.ndarray, text: str, height: int, *, given: bool = False) -> np.ndarray:
    """Return an image with its label on a strip above it; an input is framed and labelled in orange."""
    shown, colour = rgb(picture, height), INPUT if given else RESULT
    if given:
        for edge in (np.s_[:3], np.s_[-3:], np.s_[:, :3], np.s_[:, -3:]):
            shown[edge] = colour
    strip = Image.new("RGB", (shown.shape[1], STRIP), "white")
    ImageDraw.Draw(strip).text((2, 3), text, fill=colour, font=ImageFont.load_default(16))
    return np.concatenate([np.asarray(strip), shown])

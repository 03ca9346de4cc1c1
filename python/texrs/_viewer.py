"""Show a volume on an HTML page: a slice and a slider for each axis, without a kernel or a library.

All planes are stored as one image, and a few lines of JavaScript cut the slices from it. If scripts are disabled, as
in previews of notebooks, three fixed slices are shown.
"""

from __future__ import annotations

import hashlib
import math
from base64 import b64encode
from pathlib import Path

import numpy as np

from texrs._show import as_png, fill_page, preview
from texrs._typing import Array
from texrs.io.pillow import encode

MOST = 2**20
"""Approximate maximum number of characters of the page."""
_STEPS = 12
"""Maximum number of attempts to stay below the limit. Each attempt uses fewer voxels."""
_SIDE = 260
"""Length on the screen of the longest side of a volume, in pixels."""
_NAMES = ("plane", "row", "column")


def as_page(volume: Array) -> str:
    """Return HTML that shows a volume (D, H, W, C), with at most about a million characters.

    Larger volumes are shown at a lower resolution.

    Examples
    --------
    >>> import numpy as np
    >>> text = as_page(np.zeros((8, 8, 8, 3), np.uint8))
    >>> text.count("<script>"), len(text) < 5000
    (1, True)

    """
    sides = volume.shape[:3]
    # In each attempt, divide each side by the cube root of 2, which halves the number of voxels.
    for attempt in range(_STEPS):
        least = 2 ** (attempt / 3)
        step = tuple(max(1, math.floor(least * max(1.0, n / 128))) for n in sides)
        seen = _as_bytes(volume[:: step[0], :: step[1], :: step[2]])
        packed, wide = _pack(seen)
        if len(packed) * 4 / 3 < MOST * 0.75:
            break
    still = b64encode(as_png(_show_still(seen))).decode()
    digest = hashlib.sha256(packed).hexdigest()[:12]
    return fill_page(
        "slices.html",
        id=f"texrs-{digest}",
        sides=" x ".join(map(str, sides)),
        still=still,
        shape=list(seen.shape[:3]),
        step=list(step),
        wide=wide,
        names=list(_NAMES),
        side=_SIDE,
        whole=list(sides),
        voxels=b64encode(packed).decode(),
    )


def _as_bytes(volume: Array) -> Array:
    """Return 8-bit colours, (D, H, W, 3 or 4). If there are not 3 or 4 channels, only the first is shown, as grey."""
    seen = preview(volume) if volume.shape[-1] in (3, 4) else preview(volume[..., :1])
    seen = seen if seen.ndim == 4 else seen[..., np.newaxis]
    return np.repeat(seen, 3, axis=-1) if seen.shape[-1] == 1 else seen


def _pack(seen: Array) -> tuple[bytes, int]:
    """Return a lossless image that contains all planes in a grid, and the number of planes per row."""
    planes, rows, columns, channels = seen.shape
    wide = min(planes, max(1, round(math.sqrt(planes * rows / columns))))
    tall = -(-planes // wide)
    grid = np.zeros((tall * wide, rows, columns, channels), np.uint8)
    grid[:planes] = seen
    sheet = grid.reshape(tall, wide, rows, columns, channels).transpose(0, 2, 1, 3, 4)
    image = np.ascontiguousarray(sheet.reshape(tall * rows, wide * columns, channels))
    return encode(Path("volume.webp"), image, ".webp"), wide


def _show_still(seen: Array) -> Array:
    """Return the three middle slices side by side, 2 pixels apart."""
    cuts = [np.take(seen, n // 2, axis=axis) for axis, n in enumerate(seen.shape[:3])]
    height, width = max(c.shape[0] for c in cuts), sum(c.shape[1] for c in cuts) + 4
    out, left = np.full((height, width, seen.shape[3]), 255, np.uint8), 0
    for cut in cuts:
        out[: cut.shape[0], left : left + cut.shape[1]] = cut
        left += cut.shape[1] + 2
    return out

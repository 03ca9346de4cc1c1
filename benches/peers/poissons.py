"""Row 7: images from their differences."""

from __future__ import annotations

from typing import Any

import numpy as np
from frame import Arrays, Row, Work, is_mostly_near, is_near, keep_some


def make_scene(side: int) -> dict[str, Any]:
    """Return two images. The first one gets the differences of the second one."""
    from skimage import data
    from skimage.transform import resize

    image, other = (resize(p, (side, side, 3), anti_aliasing=True) * 255 for p in (data.retina(), data.coffee()))
    return {"image": np.float32(image), "other": np.float32(other)}


def _differences(given: Arrays) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rows, columns = (np.roll(given["other"], -1, axis) - given["other"] for axis in (0, 1))
    return given["image"], rows, columns


def solve_by_texrs(given: Arrays) -> Work:
    """Solve with fixed borders."""
    from texrs.kernels import poisson

    image, rows, columns = _differences(given)
    return lambda: poisson.solve(image, rows, columns, screening=0)


def solve_by_scipy(given: Arrays) -> Work:
    """Solve by sine transforms, channel by channel, in float32."""
    from scipy import fft

    image, rows, columns = _differences(given)
    n, m = image.shape[0] - 2, image.shape[1] - 2

    def work() -> np.ndarray:
        out = image.copy()
        l_rows = 2 - 2 * np.cos(np.pi * np.arange(1, n + 1) / (n + 1))
        l_columns = 2 - 2 * np.cos(np.pi * np.arange(1, m + 1) / (m + 1))
        eigenvalues = (l_rows[:, None] + l_columns).astype(np.float32)
        for c in range(image.shape[2]):
            lack_rows = rows[:-1, :, c] - np.diff(image[..., c], axis=0)
            lack_columns = columns[:, :-1, c] - np.diff(image[..., c], axis=1)
            right = (lack_rows[:-1] - lack_rows[1:])[:, 1:-1]
            right = right + (lack_columns[:, :-1] - lack_columns[:, 1:])[1:-1]
            out[1:-1, 1:-1, c] += fft.idstn(fft.dstn(right, type=1) / eigenvalues, type=1)
        return out

    return work


def _cloning(given: Arrays) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    inside = np.zeros(given["image"].shape[:2], bool)
    inside[2:-2, 2:-2] = True
    return np.uint8(given["other"]), np.uint8(given["image"]), inside


def clone_by_texrs(given: Arrays) -> Work:
    """Clone all except a rim."""
    from texrs.kernels import poisson

    other, image, inside = _cloning(given)
    return lambda: poisson.blend(other, image, inside)


def clone_by_opencv(given: Arrays) -> Work:
    """Do the same by seamlessClone."""
    import cv2

    cv2.setNumThreads(1)
    other, image, inside = _cloning(given)
    mask, centre = np.uint8(255 * inside), (len(inside) // 2, len(inside) // 2)
    return lambda: cv2.seamlessClone(other, image, mask, centre, cv2.NORMAL_CLONE)


ROWS = {
    "poisson-1024": Row(
        "7",
        "Poisson equation, 1024² RGB",
        "within 0.5 grey levels",
        lambda: make_scene(1024),
        {"texrs": solve_by_texrs, "SciPy": solve_by_scipy},
        keep_some,
        is_near,
        0.5,
        asked={"SciPy": 2},
        most_ms=26,
    ),
    "clone-1024": Row(
        "7",
        "seamless cloning, 1024² RGB",
        "within 2 grey levels (median)",
        lambda: make_scene(1024),
        {"texrs": clone_by_texrs, "OpenCV": clone_by_opencv},
        keep_some,
        is_mostly_near,
        2,
        asked={"OpenCV": 10},
    ),
}

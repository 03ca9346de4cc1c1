"""Poisson blending against SciPy (direct transforms) and OpenCV: interleaved, results compared.

python benches/poisson_vs_peers.py [rounds]
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np
from scipy import fft
from skimage import data
from skimage.transform import resize

from texrs._rust import set_threads
from texrs.kernels import poisson

try:
    import cv2
except ImportError:
    cv2 = None


def scene(side: int) -> tuple[np.ndarray, np.ndarray]:
    image = resize(data.retina(), (side, side, 3), anti_aliasing=True) * 255
    other = resize(data.coffee(), (side, side, 3), anti_aliasing=True) * 255
    return np.float32(image), np.float32(other)


def scipy_dst(image: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Dirichlet problem without screening, channel by channel, float32."""
    out = image.copy()
    height, width = image.shape[:2]
    n, m = height - 2, width - 2
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


def measure(tasks: dict[str, tuple[int, Callable[[], object]]], rounds: int) -> dict[str, float]:
    times: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(rounds):
        for name, (threads, task) in tasks.items():
            set_threads(threads)
            start = time.perf_counter()
            task()
            times[name].append(1e3 * (time.perf_counter() - start))
    return {name: float(np.median(t)) for name, t in times.items()}


def report(title: str, times: dict[str, float]) -> None:
    base = next(iter(times.values()))
    row = "  ".join(f"{n} {t:.1f} ({t / base:.2f}x)" for n, t in times.items())
    print(f"{title}: {row}")


def rectangle(side: int, rounds: int) -> None:
    image, other = scene(side)
    rows = np.roll(other, -1, 0) - other
    columns = np.roll(other, -1, 1) - other

    def ours() -> np.ndarray:
        return poisson.solve(image, rows, columns, screening=0)

    def peer() -> np.ndarray:
        return scipy_dst(image, rows, columns)

    difference = np.abs(ours() - peer()).max()
    exact = scipy_dst(*(a.astype(np.float64) for a in (image, rows, columns)))
    error = np.abs(ours() - exact).max()
    times = measure({"texrs 1T": (1, ours), "texrs 2T": (2, ours), "scipy DST": (1, peer)}, rounds)
    report(f"rectangle {side}^2 RGB (error {error:.4f}, scipy float32 differs {difference:.4f})", times)


def clone(side: int, rounds: int) -> None:
    image, other = (np.uint8(a) for a in scene(side))
    inside = np.zeros((side, side), bool)
    inside[2:-2, 2:-2] = True
    y, x = np.mgrid[:side, :side]
    disc = np.hypot(y - side / 2, x - side / 2) < 0.45 * side
    tasks = {
        "texrs 1T": (1, lambda: poisson.blend(other, image, inside)),
        "texrs 2T": (2, lambda: poisson.blend(other, image, inside)),
        "texrs disc 1T": (1, lambda: poisson.blend(other, image, disc)),
        "texrs disc 2T": (2, lambda: poisson.blend(other, image, disc)),
    }
    title = f"clone {side}^2 RGB"
    if cv2 is not None:
        cv2.setNumThreads(1)
        centre = (side // 2, side // 2)

        def peer(mask: np.ndarray) -> np.ndarray:
            return cv2.seamlessClone(other, image, np.uint8(255 * mask), centre, cv2.NORMAL_CLONE)

        tasks["cv2"] = (1, lambda: peer(inside))
        tasks["cv2 disc"] = (1, lambda: peer(disc))
        d = np.abs(poisson.blend(other, image, inside).astype(int) - peer(inside))
        title += f" (differs from cv2 by {np.median(d):.1f} median)"
    report(title, measure(tasks, rounds))


if __name__ == "__main__":
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 7
    for side in (256, 512, 1024, 1025):
        rectangle(side, rounds)
    clone(512, rounds)
    clone(1024, max(rounds // 2, 3))

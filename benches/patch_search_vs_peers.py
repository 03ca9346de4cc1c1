"""Masked patch search against SciPy (cached spectra) and OpenCV: interleaved, results compared.

python benches/patch_search_vs_peers.py [rounds]
"""

from __future__ import annotations

import sys
import time

import numpy as np
from scipy import fft
from skimage import data

from texrs._rust import set_threads
from texrs.kernels.patch_search import PatchIndex

try:
    import cv2
except ImportError:
    cv2 = None

CASES = [  # rows, columns of the image; side of the patch; how many images
    (512, 512, 32, 1),
    (512, 512, 24, 1),
    (180, 180, 24, 1),
    (180, 180, 24, 4),
    (128, 128, 12, 1),
    (64, 64, 8, 1),
]


class SciPy:
    """The same correlation in one piece, spectra of the image kept."""

    def __init__(self, image: np.ndarray) -> None:
        self.image = image
        self.spectra = fft.rfft2(image, axes=(0, 1))
        self.squares = fft.rfft2((image**2).sum(2))

    def __call__(self, patch: np.ndarray, weight: np.ndarray) -> np.ndarray:
        height, width = self.image.shape[:2]
        kernels = fft.rfft2(patch * weight[..., None], (height, width), axes=(0, 1))
        total = np.conj(fft.rfft2(weight, (height, width))) * self.squares
        total -= 2 * (np.conj(kernels) * self.spectra).sum(2)
        p, q = weight.shape
        costs = fft.irfft2(total, (height, width))[: height - p + 1, : width - q + 1]
        return costs + (weight * (patch**2).sum(2)).sum()


def textured(height: int, width: int) -> np.ndarray:
    source = data.retina()[200:1200, 200:1200]
    return np.ascontiguousarray(source[:height, :width].astype(np.float32))


def case(height: int, width: int, side: int, images: int, rounds: int) -> None:
    image = textured(height, width)
    mirrors = [image, image[:, ::-1], image[::-1], image[::-1, ::-1]][:images]
    mirrors = [np.ascontiguousarray(m) for m in mirrors]
    index = PatchIndex(mirrors, max_patch=side)
    peers = [SciPy(m) for m in mirrors]
    rng = np.random.default_rng(1)
    patch = textured(900, 900)[600 : 600 + side, 500 : 500 + side] + rng.normal(0, 3, (side, side, 3))
    patch = patch.astype(np.float32)
    weight = np.zeros((side, side), np.float32)
    weight[: side // 2], weight[:, : side // 2] = 1, 1

    def ours(count: int = 1) -> object:
        return index.best(patch, weight, count=count, ratio=3.0)

    def scipy_best() -> object:
        return [p(patch, weight) for p in peers]

    tasks = {"texrs 1T": (1, ours), "texrs 2T": (2, ours), "texrs 1T K=5": (1, lambda: ours(5))}
    tasks["scipy"] = (1, scipy_best)
    if cv2 is not None:
        mask = np.repeat(weight[..., None], 3, 2)
        tasks["cv2"] = (
            1,
            lambda: [cv2.matchTemplate(m, patch, cv2.TM_SQDIFF, mask=mask) for m in mirrors],
        )
    times: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(rounds):
        for name, (threads, task) in tasks.items():
            set_threads(threads)
            start = time.perf_counter()
            task()
            times[name].append(1e3 * (time.perf_counter() - start))
    found = ours()[0]
    maps = scipy_best()
    best = min((m.min(), i, *np.unravel_index(m.argmin(), m.shape)) for i, m in enumerate(maps))
    assert (found.exemplar, found.row, found.column) == tuple(map(int, best[1:])), (found, best)
    base = np.median(times["texrs 1T"])
    row = "  ".join(f"{n} {np.median(t):.3f} ({np.median(t) / base:.2f}x)" for n, t in times.items())
    print(f"{side}^2 in {images} x {height}x{width}x3: {row}")


def main(rounds: int) -> None:
    if cv2 is not None:
        cv2.setNumThreads(1)
    print("median ms (ratio to texrs); one thread each unless noted")
    for sizes in CASES:
        case(*sizes, rounds)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 15)

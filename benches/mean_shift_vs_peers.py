"""Mean-shift filtering against OpenCV: interleaved, ratio of medians, results compared.

python benches/mean_shift_vs_peers.py [rounds]
"""

from __future__ import annotations

import sys
import time

import cv2
import numpy as np
from skimage import data
from skimage.transform import resize

from texrs._rust import set_threads
from texrs.kernels.mean_shift import mean_shift


def case(name: str, image: np.ndarray, radius: int, limit: float, rounds: int) -> None:
    def ours() -> np.ndarray:
        return mean_shift(image, radius, limit)

    def peer() -> np.ndarray:
        return cv2.pyrMeanShiftFiltering(image, radius, limit, maxLevel=0)

    cv2.setNumThreads(1)
    tasks = {"texrs 1T": (1, ours), "texrs 2T": (2, ours), "cv2": (1, peer)}
    times: dict[str, list[float]] = {t: [] for t in tasks}
    for _ in range(rounds):
        for task, (threads, call) in tasks.items():
            set_threads(threads)
            start = time.perf_counter()
            call()
            times[task].append(1e3 * (time.perf_counter() - start))
    difference = np.abs(ours().astype(int) - peer()).max(-1)
    base = np.median(times["texrs 1T"])
    row = "  ".join(f"{t} {np.median(v):.0f} ({np.median(v) / base:.2f}x)" for t, v in times.items())
    within = ", ".join(f"{100 * np.mean(difference <= d):.0f}% within {d}" for d in (1, 2, 5))
    print(f"{name} sp{radius} sr{limit:g}: {row}; {within}")


if __name__ == "__main__":
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    for name in ("coffee", "retina"):
        for side, radius, limit in ((512, 10, 20), (256, 6, 14)):
            picture = resize(getattr(data, name)(), (side, side, 3), anti_aliasing=True)
            case(f"{name} {side}^2", np.uint8(255 * picture), radius, limit, rounds)

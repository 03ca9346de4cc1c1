"""Rows 4, 8 and 12: exact nearest neighbours, of vectors and of patches."""

from __future__ import annotations

from typing import Any

import numpy as np
from frame import Arrays, Row, Side, Work, is_near, keep_some

BORDER = 2
"""Pixels along the border of an exemplar whose windows are not inside."""


def make_vectors(side: int, numbers: int) -> dict[str, Any]:
    """Compute appearance vectors of a texture, as for similarity sets."""
    from skimage import data

    from texrs._engine.appearance import Appearance

    image = data.grass()[:side, :side].astype(np.float32) / 255
    features = Appearance(image, axes=2).arrays()["features"].reshape(side, side, -1)[..., :numbers]
    inner = slice(BORDER, side - BORDER)
    vectors = np.ascontiguousarray(features[inner, inner].reshape(-1, numbers), np.float32)
    return {"image": image, "vectors": vectors}


def find_by_texrs(given: Arrays) -> Work:
    """Find for each pixel the nearest other one. Compute distances when results are compared."""
    from texrs._engine.appearance import Appearance
    from texrs._engine.coherence import find_similar

    appearance, vectors = Appearance(given["image"], axes=2), given["vectors"]
    side = len(given["image"])
    inner = slice(BORDER, side - BORDER)
    number = np.full((side, side), -1)
    number[inner, inner] = np.arange(len(vectors)).reshape(side - 2 * BORDER, -1)

    def work() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        sets = find_similar(appearance, k=2, n=1, numbers=vectors.shape[1]).sets
        return vectors, sets, number

    return work


def find_by_scipy(given: Arrays) -> Work:
    """Build and query a k-d tree."""
    from scipy.spatial import cKDTree

    doubles = given["vectors"].astype(np.float64)
    return lambda: cKDTree(doubles).query(doubles, k=2)[0][:, 1]


def find_by_faiss(given: Arrays) -> Work:
    """Compare all pairs."""
    import faiss

    faiss.omp_set_num_threads(1)
    vectors = given["vectors"]

    def work() -> np.ndarray:
        index = faiss.IndexFlatL2(vectors.shape[1])
        index.add(vectors)
        return np.sqrt(np.maximum(index.search(vectors, 2)[0][:, 1], 0))

    return work


def _distances(result: Any) -> list[float]:
    if isinstance(result, tuple):
        vectors, sets, number = result
        at = number.ravel() >= 0
        nearest = number.ravel()[sets[at, 1]]
        result = np.sqrt(((vectors[nearest].astype(np.float64) - vectors) ** 2).sum(axis=1))
    return keep_some(result)


def make_patch() -> dict[str, Any]:
    """Return an image, and a patch that is nearly one of its patches, with 3/4 of its pixels counting."""
    from skimage import data

    source = data.retina()[200:1200, 200:1200].astype(np.float32)
    noise = np.random.default_rng(1).normal(0, 3, (32, 32, 3))
    weight = np.zeros((32, 32), np.float32)
    weight[:16], weight[:, :16] = 1, 1
    patch = (source[600:632, 500:532] + noise).astype(np.float32)
    return {"image": np.ascontiguousarray(source[:512, :512]), "patch": patch, "weight": weight}


def match_by_texrs(given: Arrays) -> Work:
    """Match with cached spectra of the image."""
    from texrs.kernels.patch_search import PatchIndex

    index = PatchIndex([given["image"]], max_patch=32)

    def work() -> tuple[int, int]:
        best = index.best(given["patch"], given["weight"])[0]
        return best.row, best.column

    return work


def _least(costs: np.ndarray) -> tuple[int, ...]:
    return tuple(int(n) for n in np.unravel_index(costs.argmin(), costs.shape))


def match_by_scipy(given: Arrays) -> Work:
    """Compute the same correlation in one piece, with cached spectra of the image."""
    from scipy import fft

    image, patch, weight = given["image"], given["patch"], given["weight"]
    height, width = image.shape[:2]
    spectra, squares = fft.rfft2(image, axes=(0, 1)), fft.rfft2((image**2).sum(2))
    p, q = weight.shape

    def work() -> tuple[int, ...]:
        kernels = fft.rfft2(patch * weight[..., None], (height, width), axes=(0, 1))
        total = np.conj(fft.rfft2(weight, (height, width))) * squares
        total -= 2 * (np.conj(kernels) * spectra).sum(2)
        return _least(fft.irfft2(total, (height, width))[: height - p + 1, : width - q + 1])

    return work


def match_by_opencv(given: Arrays) -> Work:
    """Match by matchTemplate with a mask."""
    import cv2

    cv2.setNumThreads(1)
    mask = np.repeat(given["weight"][..., None], 3, 2)
    return lambda: _least(cv2.matchTemplate(given["image"], given["patch"], cv2.TM_SQDIFF, mask=mask))


NEAREST: dict[str, Side] = {"texrs": find_by_texrs, "SciPy": find_by_scipy, "FAISS": find_by_faiss}
ROWS = {
    "near-128": Row(
        "4",
        "nearest of 15 376 vectors of 8 numbers",
        "equal distances",
        lambda: make_vectors(128, 8),
        NEAREST,
        _distances,
        is_near,
        1e-2,
        asked={"FAISS": 6, "SciPy": 4, "Liu et al. 2009, Core 2 Duo": 500},
        published={"Liu et al. 2009, Core 2 Duo": 21100.0},
        most_ms=62,
    ),
    "near-256": Row(
        "4",
        "nearest of 63 504 vectors of 8 numbers",
        "equal distances",
        lambda: make_vectors(256, 8),
        NEAREST,
        _distances,
        is_near,
        1e-2,
        asked={"FAISS": 6, "SciPy": 4},
        most_ms=790,
    ),
    "patch-512": Row(
        "8",
        "best match of a masked 32² patch, 512² RGB",
        "the same place",
        make_patch,
        {"texrs": match_by_texrs, "SciPy": match_by_scipy, "OpenCV": match_by_opencv},
        asked={"OpenCV": 15, "SciPy": 3},
        most_ms=2.2,
    ),
    "near-24": Row(
        "12",
        "nearest of 15 376 vectors of 24 numbers: the search of texture optimisation",
        "equal distances",
        lambda: make_vectors(128, 24),
        NEAREST,
        _distances,
        is_near,
        1e-2,
        asked={"FAISS": 6},
        most_ms=200,
    ),
}

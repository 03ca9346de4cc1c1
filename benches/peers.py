"""Kernels beside their peers: the same work, results that are compared first, rounds in turn; written as JSON.

    make peers
    python benches/peers.py [--rounds 7] [--out benches/peers.json] [--python WHO=PYTHON]

Each side of a case works in a process of its own, with one thread, and takes its turn when it is told to: what the machine
does besides falls on all alike. Seconds are those of the processor. Memory is what the process took beyond what it takes to
load what all sides load. The floor is what copying input and output once takes: nothing can be faster. A library that is
missing is named with how to get it. A side may run in another environment: ``--python FAISS=/other/venv/bin/python``. The page
"Performance" of the documentation is drawn from what is written.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

Work = Callable[[], Any]
HERE = Path(__file__).resolve().parent
ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "RAYON_NUM_THREADS", "MKL_NUM_THREADS"), "1")


@dataclass(frozen=True)
class Case:
    """Work that several do: what makes each side's, how results are reduced, and how far apart they may be."""

    title: str
    sides: dict[str, Callable[[], tuple[Work, int]]]
    reduce: Callable[[Any], list[float]]
    check: str
    tolerance: float


def _find_seam(group: str, name: str, who: str) -> tuple[Work, int]:
    import seam_vs_peers

    found = next(case for case in getattr(seam_vs_peers, group)() if case[0] == name)
    sides = {"texrs": lambda: found[3](found[1]()), **found[2]}
    return sides[who], 2**21


def _seam(group: str, name: str, *peers: str) -> dict[str, Callable[[], tuple[Work, int]]]:
    return {who: lambda who=who: _find_seam(group, name, who) for who in ("texrs", *peers)}


def _poisson(who: str) -> tuple[Work, int]:
    import numpy as np

    from poisson_vs_peers import scene, scipy_dst
    from texrs.kernels import poisson

    image, other = scene(512)
    rows, columns = (np.roll(other, -1, axis) - other for axis in (0, 1))
    work = {
        "texrs": lambda: poisson.solve(image, rows, columns, screening=0),
        "SciPy": lambda: scipy_dst(image, rows, columns),
    }
    return work[who], 4 * image.nbytes


def _clone(who: str) -> tuple[Work, int]:
    import numpy as np

    from poisson_vs_peers import scene
    from texrs.kernels import poisson

    image, other = (np.uint8(a) for a in scene(512))
    inside = np.zeros((512, 512), bool)
    inside[2:-2, 2:-2] = True
    if who == "texrs":
        return lambda: poisson.blend(other, image, inside), 3 * image.nbytes
    import cv2

    cv2.setNumThreads(1)
    mask = np.uint8(255 * inside)
    return lambda: cv2.seamlessClone(other, image, mask, (256, 256), cv2.NORMAL_CLONE), 3 * image.nbytes


def _patch(who: str) -> tuple[Work, int]:
    import numpy as np

    from patch_search_vs_peers import SciPy, textured
    from texrs.kernels.patch_search import PatchIndex

    image = textured(512, 512)
    noise = np.random.default_rng(1).normal(0, 3, (32, 32, 3))
    patch = (textured(900, 900)[600:632, 500:532] + noise).astype(np.float32)
    weight = np.zeros((32, 32), np.float32)
    weight[:16], weight[:, :16] = 1, 1

    def least(costs: Any) -> tuple[int, ...]:
        return tuple(int(n) for n in np.unravel_index(costs.argmin(), costs.shape))

    if who == "texrs":
        index = PatchIndex([image], max_patch=32)
        return lambda: (lambda m: (m.row, m.column))(index.best(patch, weight)[0]), image.nbytes
    if who == "SciPy":
        peer = SciPy(image)
        return lambda: least(peer(patch, weight)), image.nbytes
    import cv2

    cv2.setNumThreads(1)
    mask = np.repeat(weight[..., None], 3, 2)
    return lambda: least(cv2.matchTemplate(image, patch, cv2.TM_SQDIFF, mask=mask)), image.nbytes


def _shift(who: str) -> tuple[Work, int]:
    import numpy as np
    from skimage import data
    from skimage.transform import resize

    from texrs.kernels.mean_shift import mean_shift

    image = np.uint8(255 * resize(data.coffee(), (256, 256, 3), anti_aliasing=True))
    if who == "texrs":
        return lambda: mean_shift(image, 6, 14), 2 * image.nbytes
    import cv2

    cv2.setNumThreads(1)
    return lambda: cv2.pyrMeanShiftFiltering(image, 6, 14, maxLevel=0), 2 * image.nbytes


def _near(who: str) -> tuple[Work, int]:
    import numpy as np
    from skimage import data

    from texrs._engine.appearance import Appearance
    from texrs._engine.coherence import find_similar

    side, inner = 128, slice(2, 126)
    appearance = Appearance(data.grass()[:side, :side].astype(np.float32) / 255, axes=2)
    features = appearance.arrays()["features"].reshape(side, side, -1)[..., :8]
    vectors = features[inner, inner].reshape(-1, 8)
    places = np.arange(side * side).reshape(side, side)[inner, inner].ravel()

    def ours() -> Any:
        found = find_similar(appearance, k=2, n=1).sets[places, 1]
        flat = features.reshape(-1, 8).astype(np.float64)
        return np.sqrt(((flat[found] - flat[places]) ** 2).sum(axis=1))

    if who == "texrs":
        return ours, vectors.nbytes
    if who == "SciPy":
        from scipy.spatial import cKDTree

        doubles = np.ascontiguousarray(vectors, np.float64)
        return lambda: cKDTree(doubles).query(doubles, k=2)[0][:, 1], vectors.nbytes
    import faiss

    faiss.omp_set_num_threads(1)
    singles = np.ascontiguousarray(vectors, np.float32)

    def flat() -> Any:
        index = faiss.IndexFlatL2(8)
        index.add(singles)
        return np.sqrt(np.maximum(index.search(singles, 2)[0][:, 1], 0))

    return flat, vectors.nbytes


def _sides(make: Callable[[str], tuple[Work, int]], *peers: str) -> dict[str, Callable[[], tuple[Work, int]]]:
    return {who: lambda who=who: make(who) for who in ("texrs", *peers)}


def _number(result: Any) -> list[float]:
    return [float(result)]


def _spread(result: Any) -> list[float]:
    """Every 97th value: enough to tell results apart."""
    import numpy as np

    return np.asarray(result, np.float64).ravel()[::97].tolist()


def _list(result: Any) -> list[float]:
    return [float(n) for n in result]


CASES = {
    "strip": Case(
        "seam from border to border, 512²", _seam("strips", "strip 512", "PyMaxflow"), _number, "equal cut value", 0
    ),
    "ring": Case("seam around a patch, 256²", _seam("rings", "ring 256", "PyMaxflow"), _number, "equal cut value", 0),
    "labels": Case(
        "two labels of least energy, 512²",
        _seam("segmentations", "labels 512x512", "PyMaxflow", "SciPy"),
        _number,
        "equal energy",
        0,
    ),
    "poisson": Case(
        "Poisson equation, 512² RGB", _sides(_poisson, "SciPy"), _spread, "within 0.5 grey levels (median)", 0.5
    ),
    "clone": Case("seamless cloning, 512² RGB", _sides(_clone, "OpenCV"), _spread, "within 2 grey levels (median)", 2),
    "patch": Case(
        "best match of a masked 32² patch, 512² RGB", _sides(_patch, "SciPy", "OpenCV"), _list, "the same place", 0
    ),
    "shift": Case(
        "mean shift, 256² RGB, radius 6", _sides(_shift, "OpenCV"), _spread, "within 2 grey levels (median)", 2
    ),
    "near": Case(
        "nearest of 15 376 vectors of 8 numbers",
        _sides(_near, "SciPy", "FAISS"),
        _spread,
        "equal distances (median)",
        1e-5,
    ),
}
NEEDS = {"PyMaxflow": "maxflow", "OpenCV": "cv2", "FAISS": "faiss", "SciPy": "scipy"}
GET = {
    "PyMaxflow": "pip install PyMaxflow",
    "OpenCV": "pip install opencv-python-headless",
    "FAISS": "pip install faiss-cpu",
    "SciPy": "pip install scipy",
}


def work(name: str, who: str) -> None:
    """Be one side of a case: make ready, then do the work whenever a line comes in, and say what it took."""
    import numpy as np

    from texrs._rust import set_threads

    set_threads(1)
    case = CASES[name]
    task, size = case.sides[who]()
    reduced = case.reduce(task())
    peak = read_peak()
    floor = []
    given, taken = np.ones(size, np.uint8), np.empty(size, np.uint8)
    for _ in range(5):
        start = time.process_time()
        np.copyto(taken, given)
        floor.append(time.process_time() - start)
    print(json.dumps({"result": reduced, "floor": min(floor), "peak": peak - _measure_loading()}), flush=True)
    for _ in sys.stdin:
        start = time.process_time()
        task()
        print(json.dumps(time.process_time() - start), flush=True)


def read_peak() -> float:
    """Return the most megabytes that this process has had, since it was started: what it was forked from does not count."""
    found = [line.split()[1] for line in _read("/proc/self/status").splitlines() if line.startswith("VmHWM")]
    return int(found[0]) / 1024 if found else float("nan")


def _measure_loading() -> float:
    """Return the megabytes of a process that has loaded what all sides load."""
    code = f"import scipy.fft, skimage.data, texrs.kernels.poisson, sys; sys.path.append({str(HERE)!r}); import peers"
    return float(subprocess.check_output([sys.executable, "-c", f"{code}; print(peers.read_peak())"], text=True))


def run(name: str, rounds: int, pythons: dict[str, str]) -> dict[str, Any]:
    """Let all sides of a case that are here take turns; return what is written of it."""
    import numpy as np

    case, sides, absent = CASES[name], {}, []
    for who in case.sides:
        python = pythons.get(who, sys.executable)
        needed = NEEDS.get(who)
        if who not in pythons and needed and importlib.util.find_spec(needed) is None:
            absent.append({"who": who, "get": GET[who]})
            continue
        sides[who] = subprocess.Popen(
            [python, __file__, "--side", name, who],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, **ONE_THREAD},
        )
    first = {who: json.loads(side.stdout.readline()) for who, side in sides.items()}  # type: ignore[union-attr]
    mine = np.array(first["texrs"]["result"])
    for who, said in first.items():
        apart = float(np.median(np.abs(np.array(said["result"]) - mine)))
        if apart > case.tolerance:
            raise SystemExit(f"{name}: {who} gives something else: {apart} apart; {case.check}")
    times: dict[str, list[float]] = {who: [] for who in sides}
    for _ in range(rounds):
        for who, side in sides.items():
            side.stdin.write("go\n")  # type: ignore[union-attr]
            side.stdin.flush()  # type: ignore[union-attr]
            times[who].append(json.loads(side.stdout.readline()))  # type: ignore[union-attr]
    for side in sides.values():
        side.communicate()
    base = float(np.median(times["texrs"]))
    rows = [
        {
            "who": who,
            "ms": round(1e3 * float(np.median(taken)), 3),
            "least": round(1e3 * min(taken), 3),
            "most": round(1e3 * max(taken), 3),
            "ratio": round(float(np.median(taken)) / max(base, 1e-9), 2),
            "megabytes": round(max(first[who]["peak"], 0.0), 1),
        }
        for who, taken in times.items()
    ]
    floor = min(said["floor"] for said in first.values())
    return {"case": case.title, "check": case.check, "floor": round(1e3 * floor, 3), "rows": rows, "absent": absent}


def describe_machine() -> dict[str, Any]:
    model = [
        line.partition(": ")[2].strip() for line in _read("/proc/cpuinfo").splitlines() if line.startswith("model name")
    ]
    return {
        "processor": model[0] if model else platform.processor(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "date": date.today().isoformat(),
        "load": round(os.getloadavg()[0], 1),
    }


def _read(path: str) -> str:
    return Path(path).read_text(encoding="utf-8") if Path(path).exists() else ""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--out", type=Path, default=HERE / "peers.json")
    parser.add_argument("--python", action="append", default=[], metavar="WHO=PYTHON")
    parser.add_argument("--only", nargs="*", choices=CASES, default=list(CASES))
    parser.add_argument("--side", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.side:
        work(*options.side)
        return
    pythons = dict(text.split("=", 1) for text in options.python)
    found = {"machine": describe_machine(), "rounds": options.rounds, "cases": []}
    for name in options.only:
        found["cases"].append(run(name, options.rounds, pythons))
        print(json.dumps(found["cases"][-1]), flush=True)
    options.out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

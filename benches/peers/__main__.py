"""Compare texrs with other libraries and programs: results first, then rounds in turn, written as JSON.

    make bench
    python benches/peers [--rounds 5] [--only strip-512 ...] [--out benches/peers.json] [--python .venv-peers/bin/python]

Each side of a row has its own process with one thread. The sides take turns, so that other work of the machine affects
all of them equally. Seconds are processor seconds, except where threads are compared. Megabytes are the additional
memory of the first run, after preparation. The floor is the time of one copy of the input. Other libraries have their
own environment (`make bench` creates .venv-peers), because some are under the GPL, and none is loaded together with
texrs. Other programs are found by a variable or on the PATH: RESYNTHESIZER, QUILTING, LEFEBVRE and APPEARANCE (see
`holes.py` and `synthesis.py`). Missing ones are listed with installation hints. Numbers from papers are marked as
such, because they are from other hardware. The page "Performance" of the documentation shows the output.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Callable
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
from frame import Row, find_rows

HERE = Path(__file__).resolve().parent
ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "RAYON_NUM_THREADS", "MKL_NUM_THREADS"), "1")
PIP = "make bench"
PROGRAMS = {
    "Resynthesizer": ("RESYNTHESIZER", "built by hand, see benches/peers/holes.py"),
    "MarH19's quilting in C": ("QUILTING", "built by hand, see benches/peers/synthesis.py"),
    "Nanored4498's C++ of Lefebvre and Hoppe 2005": ("LEFEBVRE", "built by hand, see benches/peers/synthesis.py"),
    "anikabahl76's Python of Lefebvre and Hoppe 2006": (
        "APPEARANCE",
        "found as described in benches/peers/synthesis.py",
    ),
}
NEEDS = {
    "PyMaxflow": "maxflow",
    "OpenCV": "cv2",
    "OpenCV shift maps": "cv2.xphoto",
    "OpenCV graph segmentation": "cv2.ximgproc",
    "FAISS": "faiss",
    "CHOLMOD": "cvxopt",
    "scikit-image": "skimage",
}
"""Modules of the peers' environment only. NumPy and SciPy are in both environments."""


def look_for(who: str, python: Path) -> str:
    """Return the installation hint of a missing side, or nothing."""
    if who.startswith("texrs"):
        return ""
    if who in PROGRAMS:
        variable, how = PROGRAMS[who]
        return "" if os.access(os.environ.get(variable, ""), os.X_OK) else f"{variable}=..., {how}"
    module = NEEDS.get(who, "scipy")
    try:
        found = subprocess.run([python, "-c", f"import {module}"], capture_output=True, check=False).returncode == 0
    except OSError:
        found = False
    return "" if found else PIP


def measure(name: str, row: Row, rounds: int, python: Path) -> dict[str, Any]:
    """Let all available sides of a row take turns. Return the record of the row."""
    absent = {who: get for who in row.sides if (get := look_for(who, python))}
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "arrays.npz")
        np.savez(file, **row.make())
        sides = {
            who: subprocess.Popen(
                [sys.executable if who.startswith("texrs") else python, HERE / "frame.py", name, who, file],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
                env={**os.environ, **ONE_THREAD},
            )
            for who in row.sides
            if who not in absent
        }
        first: dict[str, Any] = {}
        times: dict[str, list[float]] = {who: [] for who in sides}
        for who, side in sides.items():
            first[who] = _hear(name, who, side)
        if not row.shown:
            compare(name, row, {who: np.array(said["result"]) for who, said in first.items()})
        for _ in range(rounds):
            for who, side in sides.items():
                side.stdin.write("go\n")  # type: ignore[union-attr]
                side.stdin.flush()  # type: ignore[union-attr]
                times[who].append(_hear(name, who, side))
        for side in sides.values():
            side.communicate()
    return describe(row, first, times, absent)


def _hear(name: str, who: str, side: subprocess.Popen[str]) -> Any:
    said = side.stdout.readline()  # type: ignore[union-attr]
    if not said:
        raise SystemExit(f"{name}: {who} ended before it was done")
    return json.loads(said)


def compare(name: str, row: Row, results: dict[str, np.ndarray]) -> None:
    """Refuse to measure sides with different results."""
    mine = results[next(iter(row.sides))]
    for who, theirs in results.items():
        apart = row.apart(mine, theirs)
        if not apart <= row.tolerance:
            raise SystemExit(f"{name}: {who} gives something else, {apart} apart; {row.check}")


def describe(row: Row, first: dict[str, Any], times: dict[str, list[float]], absent: dict[str, str]) -> dict[str, Any]:
    """Return a row as printed."""
    # Use the minimum of wall times, because other work of the machine lengthens the others.
    middle: Callable[[list[float]], float] = min if row.wall else lambda taken: float(np.median(taken))
    base = middle(next(iter(times.values())))
    rows = [
        {
            "who": who,
            "ms": round(1e3 * middle(taken), 4),
            "least": round(1e3 * min(taken), 4),
            "most": round(1e3 * max(taken), 4),
            "ratio": round(middle(taken) / base, 2),
            "asked": row.asked.get(who),
            "megabytes": round(max(first[who]["megabytes"], 0.0), 1),
            "shown": round(first[who]["result"][0], 3) if row.shown else None,
        }
        for who, taken in times.items()
    ]
    rows += [
        {"who": who, "ms": ms, "ratio": round(ms / 1e3 / base, 1), "asked": row.asked.get(who), "published": True}
        for who, ms in row.published.items()
    ]
    return {
        "number": row.number,
        "case": row.title,
        "check": row.check,
        "shown": row.shown,
        "most_ms": row.most_ms,
        "most_mb": row.most_mb,
        "wall": row.wall,
        "floor": round(1e3 * min(said["floor"] for said in first.values()), 3),
        "rows": rows,
        "absent": [{"who": who, "get": get, "asked": row.asked.get(who)} for who, get in absent.items()],
    }


def describe_machine() -> dict[str, Any]:
    cpu = Path("/proc/cpuinfo")
    lines = cpu.read_text(encoding="utf-8").splitlines() if cpu.exists() else []
    model = [line.partition(": ")[2].strip() for line in lines if line.startswith("model name")]
    return {
        "processor": model[0] if model else platform.processor(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "date": date.today().isoformat(),
        "load": round(os.getloadavg()[0], 1),
    }


def main() -> None:
    rows = find_rows()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--out", type=Path, default=HERE.parent / "peers.json")
    parser.add_argument("--python", type=Path, default=HERE.parents[1] / ".venv-peers" / "bin" / "python")
    parser.add_argument("--only", nargs="*", choices=rows, metavar="ROW", help=f"these alone: {', '.join(rows)}")
    options = parser.parse_args()
    found: dict[str, Any] = {"machine": describe_machine(), "rounds": options.rounds, "cases": []}
    if options.only and options.out.exists():
        found = json.loads(options.out.read_text(encoding="utf-8"))
    cases = {case["name"]: case for case in found["cases"] if case.get("name") in rows}
    for name in options.only or rows:
        cases[name] = {"name": name, **measure(name, rows[name], options.rounds, options.python)}
        print(json.dumps(cases[name]), flush=True)
        found["cases"] = [cases[each] for each in rows if each in cases]
        options.out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

"""Measure installations from an empty environment to a first image: texrs and other packages.

    make wheel
    python benches/install_table.py [dist/texrs-*.whl] [--out docs/install.json]

A clean environment is an empty folder, with a Python environment that contains only pip, an empty home and no cache.
Two commands are measured: the installation, and the first image. Seconds are processor seconds, because networks
differ. Megabytes are the size of the environment at the end, minus its size when empty. Packages that cannot be
installed are listed as such.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import resource
import subprocess
import sys
import tempfile
from datetime import date
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
SKIMAGE = """
from skimage import data, io, restoration
import numpy as np
hole = np.zeros((256, 256), bool)
hole[100:130, 100:130] = True
io.imsave("first.png", np.uint8(255 * restoration.inpaint_biharmonic(data.gravel()[:256, :256], hole)), check_contrast=False)
"""
G2S = """
import numpy as np
from g2s import g2s
from PIL import Image
made = g2s("-a", "qs", "-ti", np.random.rand(64, 64), "-di", np.full((128, 128), np.nan), "-dt", [0], "-k", 1.2, "-n", 50)
Image.fromarray(np.uint8(255 * made[0])).save("first.png")
"""


def list_candidates(wheel: Path) -> dict[str, tuple[list[str], list[str], str]]:
    """Return for each candidate the packages, the command for the first image, and a description of the image."""
    return {
        "texrs": (
            [str(wheel)],
            ["texrs", "design", "sample:pebbles", "-o", "first.png", "--size", "256"],
            "a texture of 256 x 256",
        ),
        "scikit-image": (
            ["scikit-image"],
            ["python", "-c", SKIMAGE],
            "a smoothly filled hole; it does not synthesise textures",
        ),
        "G2S": (["G2S", "pillow"], ["python", "-c", G2S], "a simulation of 128 x 128; needs its server"),
    }


def count_bytes(folder: Path) -> int:
    return sum(f.stat().st_size for f in folder.rglob("*") if f.is_file() and not f.is_symlink())


def spend(command: list[str], place: Path) -> tuple[float, str]:
    """Run a command like a new user. Return processor seconds, and the error if there is one."""
    environment = {
        "HOME": str(place / "home"),
        "PATH": f"{place / 'env' / 'bin'}:/usr/bin:/bin",
        "PIP_NO_CACHE_DIR": "1",
        "PIP_DISABLE_PIP_VERSION_CHECK": "1",
    }
    # Keep the configuration of the network, which is not part of the test.
    kept = (name for name in os.environ if name.startswith(("PIP_", "SSL_")) or name.lower().endswith("_proxy"))
    environment = {name: os.environ[name] for name in kept} | environment
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, cwd=place, env=environment, capture_output=True, text=True, check=False, timeout=900)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return spent, "" if done.returncode == 0 else (done.stderr.strip().splitlines() or ["failed"])[-1].partition(", ")[
        0
    ]


def try_out(packages: list[str], picture: list[str], python: str) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        (place / "home").mkdir()
        spend([python, "-m", "venv", str(place / "env")], place)
        empty = count_bytes(place / "env")
        bin_folder = place / "env" / "bin"
        spent, wrong = spend([str(bin_folder / "python"), "-m", "pip", "install", "--quiet", *packages], place)
        if wrong:
            return {"wrong": f"installation: {wrong}"}
        # Make the first image right afterwards, so that byte code is compiled then, as it is for a new user.
        drawn, wrong = spend([str(bin_folder / picture[0]), *picture[1:]], place)
        count = len(list((place / "env").glob("lib/python*/site-packages/*.dist-info"))) - 2
        found = {
            "install": round(spent, 1),
            "megabytes": round((count_bytes(place / "env") - empty) / 1e6),
            "packages": count,
        }
        if wrong or not (place / "first.png").exists():
            return found | {"wrong": f"first picture: {wrong or 'none'}"}
        return found | {"picture": round(drawn, 1)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("wheel", nargs="?", type=Path)
    parser.add_argument("--python", default=sys.executable)
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "install.json")
    options = parser.parse_args()
    wheel = options.wheel or next(iter(sorted((ROOT / "dist").glob("*.whl"))), None)
    if wheel is None:
        raise SystemExit("dist holds no wheel: make wheel")
    found = {}
    for name, (packages, picture, shows) in list_candidates(wheel.resolve()).items():
        found[name] = {"shows": shows, **try_out(packages, picture, options.python)}
        print(name, json.dumps(found[name]), flush=True)
    about = {
        "date": date.today().isoformat(),
        "python": platform.python_version(),
        "wheel": round(wheel.stat().st_size / 1e6, 1),
    }
    options.out.write_text(json.dumps({**about, "rows": found}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

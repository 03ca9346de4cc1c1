"""Kill commands at random moments, and let several write to one place at once: no file may be half-written.

    python tests/kill_commands.py [--count 200] [--seed 1] [--seconds 600]

After each kill an output must be absent or complete. Every few kills the command runs to its end: its output must be
correct, and the remains of killed commands must be gone. Then six processes at a time write to one database, one store
and one file. POSIX only.
"""

from __future__ import annotations

import argparse
import collections
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import texrs
from texrs import io

TOGETHER = 6
"""Processes that write to one place."""
AGAIN = 10
"""Number of kills before a command is run to its end."""
COMMANDS: dict[str, tuple[str, str]] = {
    "tile": ("tile in.png -o out.png --source-map map.npz --stages stages", "out.png map.npz"),
    "design": ("design in.png -o out.png --size 96 --way still --source-map map.npz", "out.png map.npz"),
    "synthesize": ("synthesize in.png -o out.zarr --size 128 --chunks 64", ""),
    "synthesize, to a file": ("synthesize in.png -o out.tif --size 128 --chunks 64", "out.tif"),
    "tiles": ("tiles in.png -o tiles --tile-size 32 --pictures 1 --way still", ""),
    "database": ("database base add in.png --box 78,41,23,21 --layout disjoint", ""),
    "batch": ("batch recipe.toml", ""),
}
"""Commands, and those of their outputs that are single files."""
RECIPE = 'verb = "tile"\ninputs = ["in.png", "other.png"]\nout = "made"\n'
RACES = {
    "one name in a database": "database base add in.png --box 78,41,23,21 --layout disjoint --replace",
    "one store": "synthesize in.png -o out.zarr --size 128 --chunks 64",
    "one file": "tile in.png -o out.png --force",
}


def start(words: str, place: Path) -> subprocess.Popen[bytes]:
    """Start a command in a folder."""
    environment = {**os.environ, "RAYON_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    return subprocess.Popen(
        [sys.executable, "-m", "texrs", *words.split(), "--quiet"],
        cwd=place,
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )


def prepare(place: Path) -> None:
    """Write the inputs."""
    io.write(place / "in.png", texrs.samples.dots((96, 96)).image)
    io.write(place / "other.png", texrs.samples.weave((64, 64)).image)
    (place / "recipe.toml").write_text(RECIPE)


def read_all(place: Path) -> dict[str, bytes]:
    """Return the contents of a folder, without locks."""
    return {
        str(p.relative_to(place)): p.read_bytes() for p in sorted(place.rglob("*")) if p.is_file() and p.name != ".lock"
    }


def is_temporary(name: str) -> bool:
    """Return whether a name belongs to a half-written file."""
    return any(part.startswith(".") and ".texrs-" in part for part in Path(name).parts)


def kill_often(name: str, count: int, rng: random.Random, end: float, counts: collections.Counter[str]) -> list[str]:
    """Kill a command at random moments, and return the errors."""
    words, _ = COMMANDS[name]
    wrong: list[str] = []
    with tempfile.TemporaryDirectory() as first:
        whole = Path(first)
        prepare(whole)
        begun = time.monotonic()
        if (code := start(words, whole).wait()) != 0:
            return [f"{name}: ended with {code}"]
        takes, reference = time.monotonic() - begun, read_all(whole)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        prepare(place)
        inputs = set(read_all(place))
        for number in range(1, count + 1):
            if time.monotonic() > end:
                break
            process = start(words, place)
            time.sleep(rng.random() * takes * 1.05)
            counts["killed" if process.poll() is None else "ended before"] += 1
            process.send_signal(signal.SIGKILL)
            process.wait()
            for file, data in read_all(place).items():
                if is_temporary(file) or ".zarr" in file or file.endswith((".json", ".npz")):
                    # Files with times or manifests differ between runs, and stores list their own missing chunks.
                    continue
                if data != reference.get(file):
                    wrong.append(f"{name}: {file} is half-written, or another, after kill {number}")
            if number % AGAIN == 0 or number == count:
                if start(words, place).wait() not in (0,):
                    wrong.append(f"{name}: does not go on after kill {number}")
                found = read_all(place)
                counts["run to the end"] += 1
                if left := [f for f in found if is_temporary(f)]:
                    wrong.append(f"{name}: {left} are left after kill {number}")
                if set(found) != set(reference):
                    wrong.append(f"{name}: other files after kill {number}: {set(found) ^ set(reference)}")
                for each in set(found) - inputs:
                    path = place / each
                    shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
                shutil.rmtree(place / "out.zarr", ignore_errors=True)
    return wrong


def race(words: str, check: Callable[[Path], object], counts: collections.Counter[str]) -> list[str]:
    """Let several processes write to one place at once."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        prepare(place)
        several = [start(words, place) for _ in range(TOGETHER)]
        codes = [each.wait() for each in several]
        said = [each.stderr.read().decode() for each in several if each.stderr is not None]
        counts["races"] += 1
        wrong = [f"{words}: exit codes {codes}: {said}"] if 0 not in codes or set(codes) - {0, 2} else []
        wrong += [f"{words}: {f} is left" for f in read_all(place) if is_temporary(f)]
        try:
            check(place)
        except Exception as error:
            wrong.append(f"{words}: {error}")
        return wrong


CHECKS: dict[str, Callable[[Path], object]] = {
    "one name in a database": lambda place: texrs.TextureDatabase(place / "base")["in"],
    "one store": lambda place: io.read(place / "out.zarr"),
    "one file": lambda place: io.read(place / "out.png"),
}


def main() -> int:
    """Kill all commands, and let several write at once."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--races", type=int, default=4)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=600)
    asked = parser.parse_args()
    rng, counts, wrong = random.Random(asked.seed), collections.Counter[str](), list[str]()
    begun, share = time.monotonic(), asked.seconds / (len(COMMANDS) + 1)
    for number, name in enumerate(COMMANDS, start=1):
        wrong += kill_often(name, -(-asked.count // len(COMMANDS)), rng, begun + number * share, counts)
    for _ in range(asked.races):
        for name, words in RACES.items():
            if time.monotonic() < begun + asked.seconds:
                wrong += race(words, CHECKS[name], counts)
    print(f"seed {asked.seed}: {', '.join(f'{n} {c}' for n, c in counts.items())}; wrong {len(wrong)}")
    for line in wrong:
        print(line)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

"""Damage files of every readable format at random: each read must give an array, an entry or an error message, soon.

    python tests/fuzz_files.py [--count 100000] [--seed 1] [--seconds 600]

Prints the numbers of read and refused files, and all other outcomes. Files with other outcomes are kept in the folder
`fuzz-SEED`, named after their number. Everything runs in this process with limited memory, so excessive allocations
fail here.
"""

from __future__ import annotations

import argparse
import collections
import os
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import image_files as make
import texrs
from texrs import io as tio
from texrs.cli._recipes import check_recipe, read_recipe
from texrs.errors import TexrsError

Reader = Callable[[Path], object]
MOST = 100_000
"""Maximum pixels of a file."""
SLOW = 5.0
"""Seconds of processor time that count as too long."""
MEMORY = 2 << 30
"""Bytes in addition to the memory at the beginning."""
WRITABLE = (".png", ".tif", ".webp", ".bmp", ".tga", ".dds", ".npy", ".npz", ".exr", ".hdr")
VOLUMES = (".tif", ".npy", ".npz", ".nrrd", ".nii", ".nii.gz", ".vti")
RECIPE = 'verb = "design"\ninputs = ["*.png"]\nout = "out"\nseeds = "0-3"\n[presets.one]\nrotate = 0\nsize = "64x64"\n'


class Late(BaseException):
    """A file took too long."""


def limited(read: Callable[..., object]) -> Reader:
    """Return a reader with a small limit of pixels."""
    return lambda path: read(path, limit=MOST)


def make_files(folder: Path) -> Iterator[tuple[Path, list[Reader]]]:
    """Write a small file of every kind, and yield it with its readers."""
    image, floats = make.picture((24, 20, 3)), np.abs(make.picture((24, 20, 3), "float32"))
    either = [limited(tio.read), limited(tio.read_volume), tio.read_metadata]
    for suffix in WRITABLE:
        path = folder / f"a{suffix}"
        tio.write(path, floats if suffix in (".exr", ".hdr") else image)
        yield path, either
    for suffix in VOLUMES:
        path = folder / f"v{suffix}"
        tio.write_volume(path, make.picture((6, 7, 8)))
        yield path, [limited(tio.read_volume), tio.read_spacing]
    for name, content in {
        "a.gif": make.pillow(image, "GIF"),
        "a.jpg": make.pillow(image, "JPEG", exif=b"Exif\0\0" + make.exif(6)),
        "lzw.tif": make.pillow(image, "TIFF", compression="tiff_lzw"),
        "ink.jpg": make.pillow(make.picture((24, 20, 4)), "JPEG", mode="CMYK"),
        "ink.tif": make.pillow(make.picture((24, 20, 4)), "TIFF", mode="CMYK"),
        "run.tga": make.pillow(image, "TGA", compression="tga_rle"),
        "bc3.dds": make.pillow(make.picture((24, 20, 4)), "DDS", pixel_format="DXT5"),
        "a.psd": make.psd(image),
        "a.avif": make.pillow(image, "AVIF"),
        "palette.png": make.palette_png(np.arange(64).reshape(8, 8) % 4, np.eye(4, 3) * 255),
        "packbits.tif": make.pillow(image, "TIFF", compression="packbits"),
        "deflate.tif": make.pillow(image, "TIFF", compression="tiff_adobe_deflate"),
    }.items():
        (folder / name).write_bytes(content)
        yield folder / name, either
    sample = texrs.samples.dots((64, 64))
    source = texrs.synthesize(sample.image, 32).source_map.with_finish((True, False), screening=0.1)
    source.save(folder / "map.npz")
    yield folder / "map.npz", [texrs.SourceMap.load, limited(tio.read_arrays)]
    texrs.elements.analyse(sample.image, mask=sample.mask, layout="disjoint").save(folder / "entry.npz")
    yield folder / "entry.npz", [texrs.elements.load]
    known = texrs.Exemplar(sample.image)
    known.analyse()
    known.save(folder / "known.npz")
    yield folder / "known.npz", [texrs.Exemplar.load]
    texrs.scale_maps.from_angles((16, 16), 40, 90, fov=50)
    (folder / "recipe.toml").write_text(RECIPE)
    yield folder / "recipe.toml", [lambda path: check_recipe(read_recipe(str(path)), str(path))]


def make_folders(folder: Path) -> Iterator[tuple[Path, Path, list[Reader]]]:
    """Write a database, a material and a store, and yield the files to damage with their readers."""
    sample = texrs.samples.dots((64, 64))
    database = folder / "database"
    texrs.TextureDatabase(database).add(sample.image, "dots", mask=sample.mask, layout="disjoint")
    for file in ("manifest.json", "dots.npz"):
        yield (
            database,
            database / file,
            [lambda path: texrs.TextureDatabase(path, log=lambda text: None).analyse("dots")],
        )
    material = folder / "material"
    texrs.Material({"albedo": sample.image, "height": sample.image[..., 0]}).save(material)
    for file in sorted(material.glob("*.png")):
        yield material, file, [texrs.Material.read]
    with suppress(ImportError, TexrsError):
        texrs.PlaneTexture(sample.image).to_zarr(folder / "store.zarr", (64, 64), (32, 32))
        store = folder / "store.zarr"
        for file in sorted(p for p in store.rglob("*") if p.is_file())[:6]:
            yield store, file, [limited(tio.read), texrs.stores.open_store]


def limit_memory() -> None:
    """Limit the memory of this process to little more than its current size."""
    if sys.platform == "linux":
        import resource

        taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (taken + MEMORY, resource.getrlimit(resource.RLIMIT_AS)[1]))


def try_one(readers: list[Reader], path: Path, counts: collections.Counter[str]) -> str:
    """Read a damaged file by all its readers, and return the errors."""
    wrong = ""
    for read in readers:
        start = time.process_time()
        signal.setitimer(signal.ITIMER_VIRTUAL, SLOW)
        try:
            read(path)
            counts["read"] += 1
        except TexrsError:
            counts["refused"] += 1
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt):
                raise
            counts["wrong"] += 1
            ours = [
                f"{Path(f.filename).name}:{f.lineno}"
                for f in traceback.extract_tb(error.__traceback__)
                if "texrs" in f.filename
            ]
            wrong = f"{type(error).__name__}: {error} ({', '.join(ours[-2:])})"
        finally:
            signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        counts["slowest, ms"] = max(counts["slowest, ms"], round(1000 * (time.process_time() - start)))
    return wrong


def main() -> int:
    """Damage files until the requested number or time is reached."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=600)
    asked = parser.parse_args()
    warnings.simplefilter("ignore")

    def late(number: int, frame: Any) -> None:
        raise Late(f"more than {SLOW} s")

    signal.signal(signal.SIGVTALRM, late)
    place = Path(tempfile.mkdtemp(prefix="texrs-fuzz-", dir="/dev/shm" if os.path.isdir("/dev/shm") else None))
    kept = Path(f"fuzz-{asked.seed}")
    counts: collections.Counter[str] = collections.Counter()
    begun, end = time.process_time(), time.monotonic() + asked.seconds
    try:
        cases = [(path, path, readers) for path, readers in make_files(place)]
        cases += list(make_folders(place))
        contents = [file.read_bytes() for _, file, _ in cases]
        limit_memory()
        rng: np.random.Generator = np.random.default_rng(asked.seed)
        order: NDArray[np.intp] = np.arange(len(cases))
        while counts["files"] < asked.count and time.monotonic() < end:
            for number in order.tolist():
                (target, file, readers), content = cases[number], contents[number]
                for data in make.mutations(content, 10, rng):
                    file.write_bytes(data)
                    counts["files"] += 1
                    if wrong := try_one(readers, target, counts):
                        kept.mkdir(exist_ok=True)
                        name = f"{counts['files']}-{file.name}"
                        (kept / name).write_bytes(data)
                        print(f"{kept / name}: {wrong}", file=sys.stderr, flush=True)
                if target is not file:
                    file.write_bytes(content)
    finally:
        shutil.rmtree(place, ignore_errors=True)
    said = ", ".join(f"{name} {count}" for name, count in counts.items())
    print(f"seed {asked.seed}: {said}; kinds {len(cases)}, {time.process_time() - begun:.0f} s of processor time")
    return 1 if counts["wrong"] else 0


if __name__ == "__main__":
    sys.exit(main())

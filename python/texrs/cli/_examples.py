"""Commands that need no image: ``texrs samples`` and ``texrs demo``."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

from texrs import io, samples
from texrs._notices import ignore
from texrs._threads import threads
from texrs.cli import _outputs, _provenance
from texrs.cli._console import note, say, show_progress, suggest
from texrs.cli._outputs import Quiet, Threads, describe, make_argument, make_option, name_arguments, to_write
from texrs.cli._provenance import check_free
from texrs.cli._readers import is_solid
from texrs.cli._texts import parse_size
from texrs.errors import InvalidInput


def demo_command(
    out: Annotated[str, to_write("out", "DIR", "Folder for the page, index.html.")],
    count: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Write a page of results of texrs on built-in examples."""
    # Import here, because the demo loads all functions of texrs.
    from texrs.demo import page

    start = time.monotonic()
    _outputs.check_folder(out)
    index = os.path.join(out, "index.html")
    if Path(out).is_dir():
        _outputs.check_output(index)
    with name_arguments(count="--threads"), threads(count), show_progress(quiet=quiet) as progress:
        text = page(progress=progress)
    Path(out).mkdir(parents=True, exist_ok=True)
    with _outputs.write_output(index, inside=True) as temporary:
        temporary.write_text(text, encoding="utf-8")
    note(f"wrote {index}, in {time.monotonic() - start:.1f} s", quiet=quiet)


def samples_command(
    names: Annotated[list[str] | None, make_argument("NAME", "Names of samples. Default: all.")] = None,
    out: Annotated[
        str | None,
        to_write("out", "DIR", "Folder for the samples (.png or .tif). Default: their names are only listed."),
    ] = None,
    size: Annotated[
        str | None,
        make_option("SIZE", "Size of generated samples in pixels or voxels, such as 256, 256x192 or 64x64x64."),
    ] = None,
    seed: Annotated[int | None, make_option(None, "Seed of generated samples.")] = None,
    quiet: Quiet = False,
) -> None:
    """List the built-in examples, or write them to a folder."""
    known = (*samples.names(), *samples.photographs())
    for name in names or ():
        if name not in known:
            near = suggest(name, known) or f"; it must be one of {', '.join(known)}"
            raise InvalidInput(f"NAME: must be the name of a sample, got {name!r}{near}")
    chosen = names or list(known)
    if out is None:
        for name in chosen:
            say(name)
        return
    # Check all outputs before a sample is drawn.
    _outputs.check_folder(out)
    records = {name: replace(record, files={}) if (record := _provenance.narrow([name])) else None for name in chosen}
    for name in chosen:
        with _provenance.record(records[name]):
            check_free(os.path.join(out, f"{name}.png"))
            check_free(os.path.join(out, f"{name}.tif"))
    # Draw all samples before one is written, so that an invalid option leaves no files.
    made = {}
    for name in chosen:
        options: dict[str, Any] = {} if seed is None else {"seed": seed}
        if size is not None:
            options["size"] = parse_size(size, axes=3 if is_solid(name) else 2)
        if name not in samples.names():
            for option in options:
                ignore(f"{name}: --{option} is not used, because this sample is a photograph")
            options = {}
        with name_arguments():
            made[name] = samples.load(name, **options).image
    Path(out).mkdir(parents=True, exist_ok=True)
    for name, image in made.items():
        volume = image.ndim == 4
        path = os.path.join(out, f"{name}.{'tif' if volume else 'png'}")
        with _outputs.write_output(path, inside=True, made=records[name]) as temporary:
            (io.write_volume if volume else io.write)(temporary, image)
        note(f"wrote {path}: {describe(image, 3 if volume else 2)}", quiet=quiet)


COMMANDS: dict[str, Callable[..., None]] = {"demo": demo_command, "samples": samples_command}

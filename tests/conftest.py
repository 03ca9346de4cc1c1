"""Settings and fixtures of all tests."""

import functools
import os
from collections.abc import Callable, Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import imageio.v3 as iio
import numpy as np
import pytest
from hypothesis import settings

from texrs import samples

settings.register_profile("fixed", derandomize=True, deadline=None)
settings.register_profile("fuzz", deadline=None, print_blob=True)
# Use the same cases each time. `make fuzz` requests the other profile, with its own seed.
settings.load_profile("fixed")


def draw_once(make: Callable[..., samples.Sample]) -> Callable[..., samples.Sample]:
    """Return a generator that draws a sample once and returns copies, because dozens of modules use the same samples."""
    kept: dict[str, samples.Sample] = {}

    @functools.wraps(make)
    def draw(*given: Any, **options: Any) -> samples.Sample:
        # Use the text of the arguments as the key, because 64.0 equals 64 but must be refused.
        asked = repr((given, options))
        if asked not in kept:
            kept[asked] = make(*given, **options)
        drawn = kept[asked]
        arrays = {f.name: value for f in fields(drawn) if isinstance(value := getattr(drawn, f.name), np.ndarray)}
        return replace(drawn, **{name: array.copy() for name, array in arrays.items()})

    return draw


# Replace the generators by cached ones. Tests reach the originals through `inspect.unwrap`.
for name, generator in samples._GENERATORS.items():
    samples._GENERATORS[name] = draw_once(generator)
    setattr(samples, name, samples._GENERATORS[name])


@pytest.fixture(scope="session", autouse=True)
def _no_waiting_for_a_disk() -> Iterator[None]:
    """Do not sync in this process, because tests would take minutes longer on a slow disk. One test checks the order."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda number: None)
        yield


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in a folder with an exemplar, and an empty file, which any command may replace."""
    monkeypatch.chdir(tmp_path)
    iio.imwrite("in.png", samples.load("dots", size=(64, 64)).image)
    Path("out.png").touch()
    return tmp_path

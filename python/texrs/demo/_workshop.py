"""Where the sections of the demo make their textures: each is made once and shown by several."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from texrs import samples
from texrs._typing import Array, Progress
from texrs.papers.design import design
from texrs.synthesis import Synthesis


@dataclass(frozen=True, slots=True)
class Section:
    """A part of the page.

    Attributes
    ----------
    name : str
        What links inside the page call it.
    title, lead : str
        Its heading, and a sentence or two below it; plain text.
    make : callable
        Given the workshop, makes the pictures and returns HTML.

    """

    name: str
    title: str
    lead: str
    make: Callable[[Workshop], str]


@dataclass(frozen=True)
class Texture:
    """An exemplar, a texture designed from it and the options that made it."""

    sample: samples.Sample
    size: int
    options: Mapping[str, Any]

    @cached_property
    def result(self) -> Synthesis:
        """Design the texture."""
        made: Synthesis = design(self.sample.image, self.size, **self.options)
        return made


@dataclass
class Workshop:
    """What sections share: progress and the textures that were made."""

    progress: Progress
    title: str = ""
    made: dict[str, Texture] = field(default_factory=dict)

    def begin(self, title: str) -> None:
        """Start a section."""
        self.title = title
        self.progress(title, 0.0)

    def watch(self, share: float) -> None:
        """Report the share of the section that is done."""
        self.progress(self.title, share)

    def design(self, name: str, side: int = 160, size: int = 320, **options: Any) -> Texture:
        """Design a texture from a sample, or return the one that was made before."""
        key = repr((name, side, size, sorted(options.items())))
        if key not in self.made:
            self.made[key] = Texture(load_sample(name, side), size, {"seed": 7, **options})
        return self.made[key]


def load_sample(name: str, side: int) -> samples.Sample:
    """Return a sample of a size; of a photograph, which has its own, the middle at half the scale."""
    if name in samples.names():
        return samples.load(name, size=(side, side))
    image: Array = samples.load(name).image
    rows, columns = (n // 2 * 2 for n in image.shape[:2])
    halved = image[:rows, :columns].reshape(rows // 2, 2, columns // 2, 2, -1).mean(axis=(1, 3)).squeeze()
    top, left = ((n - side) // 2 for n in halved.shape[:2])
    return samples.Sample(name, np.rint(halved[top : top + side, left : left + side]).astype(np.uint8))

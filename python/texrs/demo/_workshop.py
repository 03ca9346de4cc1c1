"""Base of the sections of the demo page: each texture is computed once and can be used by several sections."""

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
    """A section of the page.

    Attributes
    ----------
    name : str
        Anchor of the section for links inside the page.
    title, lead : str
        Heading, and one or two sentences below it, as plain text.
    make : callable
        Function that takes the workshop, computes the images and returns HTML.

    """

    name: str
    title: str
    lead: str
    make: Callable[[Workshop], str]


@dataclass(frozen=True)
class Texture:
    """An exemplar, options of DESIGN, and the texture designed with them."""

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
    """Progress and textures that the sections share."""

    progress: Progress
    title: str = ""
    made: dict[str, Texture] = field(default_factory=dict)

    def begin(self, title: str) -> None:
        """Begin a section."""
        self.title = title
        self.progress(title, 0.0)

    def watch(self, share: float) -> None:
        """Report the completed share of the section."""
        self.progress(self.title, share)

    def design(self, name: str, side: int = 160, size: int = 320, **options: Any) -> Texture:
        """Design a texture from a sample, or return the texture if it was designed before."""
        key = repr((name, side, size, sorted(options.items())))
        if key not in self.made:
            self.made[key] = Texture(load_sample(name, side), size, {"seed": 7, **options})
        return self.made[key]


def load_sample(name: str, side: int) -> samples.Sample:
    """Return a sample of a given side. A photograph has its own size, so return its centre at half the scale."""
    if name in samples.names():
        return samples.load(name, size=(side, side))
    image: Array = samples.load(name).image
    rows, columns = (n // 2 * 2 for n in image.shape[:2])
    halved = image[:rows, :columns].reshape(rows // 2, 2, columns // 2, 2, -1).mean(axis=(1, 3)).squeeze()
    top, left = ((n - side) // 2 for n in halved.shape[:2])
    return samples.Sample(name, np.rint(halved[top : top + side, left : left + side]).astype(np.uint8))

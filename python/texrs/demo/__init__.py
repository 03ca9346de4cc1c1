"""A page that shows what texrs makes, on built-in examples: ``texrs demo``.

The page is one file: its pictures are in it, it needs no script and nothing from elsewhere. It is a list of sections;
a system joins it by a `Section` of its own in `SECTIONS`, whose function makes pictures in the `Workshop` and gives
HTML.
"""

from __future__ import annotations

from collections.abc import Sequence

from texrs._html import document, section
from texrs._typing import Progress
from texrs.demo._design import RESULTS, SEEDS, STAGES
from texrs.demo._limits import LIMITS
from texrs.demo._maps import MAPS, OPENING
from texrs.demo._perspective import PERSPECTIVE
from texrs.demo._pictures import COMPLETE, TILE
from texrs.demo._samples import SAMPLES
from texrs.demo._solid import SOLID
from texrs.demo._splice import SPLICE
from texrs.demo._workshop import Section, Workshop

__all__ = ["SECTIONS", "Section", "Workshop", "page"]

SECTIONS: tuple[Section, ...] = (
    OPENING,
    MAPS,
    RESULTS,
    STAGES,
    SEEDS,
    TILE,
    COMPLETE,
    SPLICE,
    PERSPECTIVE,
    SOLID,
    LIMITS,
    SAMPLES,
)


def page(sections: Sequence[Section] = SECTIONS, *, progress: Progress | None = None) -> str:
    """Make the page.

    Parameters
    ----------
    sections : sequence of Section
        What it shows, in this order.
    progress : callable, optional
        Called as ``progress(title, share)``; raising stops the work.

    Returns
    -------
    str
        HTML that refers to nothing outside itself.

    """
    watch = progress or (lambda stage, share: None)
    workshop = Workshop(watch)
    parts = []
    for each in sections:
        workshop.begin(each.title)
        parts.append(section(each.name, each.title, each.lead, each.make(workshop)))
        watch(each.title, 1.0)
    return document([(each.name, each.title) for each in sections], parts)

"""The page of ``texrs demo``, which shows the results of texrs on built-in examples.

The page is one file. It contains its images, needs no script and loads nothing. It is a list of sections. To add a
section, append a `Section` to `SECTIONS`. Its function computes images in the `Workshop` and returns HTML.
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
    """Generate the page.

    Parameters
    ----------
    sections : sequence of Section
        Sections of the page, in this order. Default: all.
    progress : callable, optional
        Function that is called as ``progress(title, share)``. If it raises an exception, the work stops.

    Returns
    -------
    str
        HTML without references to other files.

    """
    watch = progress or (lambda stage, share: None)
    workshop = Workshop(watch)
    parts = []
    for each in sections:
        workshop.begin(each.title)
        parts.append(section(each.name, each.title, each.lead, each.make(workshop)))
        watch(each.title, 1.0)
    return document([(each.name, each.title) for each in sections], parts)

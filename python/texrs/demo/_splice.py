"""Section of the demo page about elements of one texture in the layout of another."""

from __future__ import annotations

from typing import Any

from texrs._html import card, cards, code, figure
from texrs.demo._workshop import Section, Workshop, load_sample
from texrs.elements import ElementAnalysis
from texrs.layouts import courses, lattice
from texrs.papers.splice import self_splice, splice

SIDE = 192
SPLICES = (("dots", "net"), ("dots", "bricks"))
EDITS: tuple[tuple[str, dict[str, Any], str], ...] = (
    ("dots", {"op": "regularise"}, "--edit regularise"),
    ("bricks", {"op": "rows", "by": 8}, "rows shifted by 8 pixels; the joints stay upright"),
)


def _load_entry(name: str) -> ElementAnalysis:
    """Return a sample with its true elements."""
    return ElementAnalysis.of_sample(load_sample(name, SIDE))


def _splice(workshop: Workshop) -> str:
    total = len(SPLICES) + len(EDITS)
    spliced, edited, drawn = [], [], []
    for i, (a, b) in enumerate(SPLICES):
        workshop.watch(i / total)
        elements, layout = _load_entry(a), _load_entry(b)
        made = splice(elements, layout, seed=1)
        given = [figure(elements.image, a), figure(layout.image, b)]
        spliced.append(card(given, figure(made.image, f"{a} laid out as {b}")))
    for i, (a, edit, note) in enumerate(EDITS, start=len(SPLICES)):
        workshop.watch(i / total)
        elements = _load_entry(a)
        made = self_splice(elements, edit, seed=1)
        edited.append(card([figure(elements.image, a)], figure(made.image, str(edit["op"]), note=note)))
    # Also show layouts that are generated from points and do not have an image.
    for a, layout, words in (
        ("bricks", courses(SIDE, [24, 40], 60, shift=1 / 3, vary=0.4, seed=2), "courses"),
        ("dots", lattice(SIDE, (0, 40), (34, 14)), "a lattice"),
    ):
        made = splice(_load_entry(a), layout, seed=1, layout_scale=1)
        given = [figure(_load_entry(a).image, a), figure(layout.image, f"{words}, drawn")]
        drawn.append(card(given, figure(made.image, f"{a} in this layout")))
    return (
        code("texrs splice sample:dots sample:net -o result.png --seed 1")
        + cards(spliced)
        + code(
            'texrs splice sample:bricks \'{"layout": "courses", "size": 192, "height": [24, 40], "length": 60}\''
            " -o result.png --layout-scale 1"
        )
        + cards(drawn)
        + code("texrs self-splice sample:dots --edit regularise -o result.png --seed 1")
        + cards(edited)
    )


SPLICE = Section(
    "splice",
    "The elements of one texture in the layout of another",
    "Rigid elements are copied pixel by pixel, and the background between them is synthesised. Walls are assembled from "
    "their bricks, cell by cell. The layout may also be drawn, or be an edited layout of the texture itself.",
    _splice,
)

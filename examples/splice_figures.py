"""Make figures 2, 5, 7, 8 and 9 of "Texture splicing" (Liu et al. 2009) anew, on built-in examples: splice-figure-N.png.

By default beside ``method="paper"``, where the two differ. ``python splice_figures.py FOLDER [NUMBERS]``; about half a minute.
"""

import sys
from pathlib import Path

import numpy as np

import texrs
from layout import below, beside
from texrs import samples
from texrs.elements import ElementAnalysis, Layout

SIDE = 192
NAMES = ("dots", "leaves_and_flowers", "pebbles", "net", "bricks")


def entry(name: str) -> ElementAnalysis:
    """Return a sample with the elements that it is known to have."""
    return ElementAnalysis.of_sample(samples.load(name, size=(SIDE, SIDE)))


def draw_overview() -> np.ndarray:
    """Figure 2: a texture and a layout, and the stages between them and the result; by default, then as printed."""
    rows = []
    for method in (None, "paper"):
        result = texrs.splice(entry("dots"), entry("bricks"), seed=1, method=method)
        names = ("source points", "target points", "matching", "warped mesh", "before refinement", "before_blending")
        rows.append(beside([result.stages[name] for name in names if name in result.stages], SIDE))
    return below(rows)


def draw_decoupling() -> np.ndarray:
    """Figure 5: a wall in another layout. What its conditions decouple keeps joints upright; taken for a net, they lean.

    The wall, and its figure bent as a wall; the same without the conditions, as a net whose lines are the joints; the default,
    and as printed.
    """
    wall, layout = entry("bricks"), entry("pebbles")
    net = ElementAnalysis(wall.image, wall.points, ~wall.mask, wall.box, Layout.CONNECTED, wall.scores)
    bent = [texrs.splice(a, layout, seed=1, use_cells=False, use_nets=False).image for a in (wall, net)]
    made = [texrs.splice(wall, layout, seed=1, method=method).image for method in (None, "paper")]
    return beside([wall.image, *bent, *made])


def draw_groups() -> np.ndarray:
    """Figure 7: a connected foreground, a disjoint one, and a connected background: A, B, the default, and as printed."""
    rows = []
    for a, b in (("net", "pebbles"), ("leaves_and_flowers", "bricks"), ("bricks", "dots")):
        mine, theirs = entry(a), entry(b)
        made = [texrs.splice(mine, theirs, seed=1, method=method).image for method in (None, "paper")]
        rows.append(beside([mine.image, theirs.image, *made]))
    return below(rows)


def draw_matrix() -> np.ndarray:
    """Figure 8: every texture (first column) in every layout (first row); by default, then as printed."""
    entries = [entry(name) for name in NAMES]
    blank = np.full((SIDE, SIDE, 3), 255, np.uint8)
    tables = []
    for method in (None, "paper"):
        rows = [beside([blank, *(e.image for e in entries)])]
        for a in entries:
            made = [a.image if a is b else texrs.splice(a, b, seed=1, method=method).image for b in entries]
            rows.append(beside([a.image, *made]))
        tables.append(below(rows))
    return below(tables)


def draw_edits() -> np.ndarray:
    """Figure 9: textures, and their own layouts edited: regular, wider, row by row, at random; one moved, one taken away.

    By default, and below it as printed.
    """
    rows = []
    for name in ("dots", "leaves_and_flowers", "pebbles", "bricks"):
        mine = entry(name)
        middle = int(np.hypot(*(mine.points - SIDE / 2).T).argmin())
        edits: list[str | dict[str, object]] = [
            "regularise",
            {"op": "scale", "factor": 1.25},
            {"op": "rows", "by": 10},
            {"op": "randomise", "amount": 0.2},
            {"op": "move", "element": middle, "by": [0, 12]},
        ]
        if mine.layout == Layout.DISJOINT:
            edits.append({"op": "remove", "element": middle})
        for method in (None, "paper"):
            made = [texrs.self_splice(mine, edit, seed=1, method=method).image for edit in edits]
            rows.append(beside([mine.image, *made]))
    return below(rows)


FIGURES = {2: draw_overview, 5: draw_decoupling, 7: draw_groups, 8: draw_matrix, 9: draw_edits}


def main(folder: str = ".", *numbers: str) -> None:
    """Write the figures."""
    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True)
    for number in map(int, numbers or map(str, FIGURES)):
        texrs.io.write(place / f"splice-figure-{number}.png", FIGURES[number]())


if __name__ == "__main__":
    main(*sys.argv[1:])

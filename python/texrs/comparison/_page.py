"""The page of a comparison: for each task a table of the means, then the images with their measures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

import numpy as np

from texrs._html import code, document, encode_uri, section
from texrs._typing import Array, Bools
from texrs.comparison._measures import MEASURES
from texrs.comparison._methods import FREE
from texrs.comparison._results import Missing, Result
from texrs.comparison._tasks import TASKS

SECONDS = "seconds"
INTRO = (
    "All methods get the same 8-bit images and run with their own defaults. Results were not selected. Lower values are "
    "better, and 0 is the value of the example itself. The best value of each column is bold. Look at the images first, "
    "because the measures hardly detect torn and repeated elements. Trivial methods, which return copies or the image "
    "itself, are listed only for comparison."
)
MISS = (
    "Methods that are not installed on this machine, and how to get them. Installed methods are compared automatically."
)


def make_page(
    pictures: Mapping[str, Array],
    holes: Mapping[str, Bools],
    results: Sequence[Result],
    missing: Sequence[Missing],
    *,
    timed: bool,
) -> str:
    """Return a self-contained HTML page."""
    links, parts = [("about", "What is compared")], [section("about", "What is compared", INTRO, explain(timed))]
    # Add a section with a table and the images for each task that has results.
    for task, about in TASKS.items():
        some = [r for r in results if r.task == task]
        if some:
            body = tabulate(some, timed) + show_pictures(pictures, holes if task == "hole" else {}, some)
            links.append((task, about.title))
            parts.append(section(task, about.title, about.lead, body))
    if missing:
        rows = "".join(
            f"<tr><th scope=row>{escape(m.method)}</th><td>{escape(TASKS[m.task].title)}</td><td>{link(m.get)}</td></tr>"
            for m in missing
        )
        head = "<tr><th scope=col>method</th><th scope=col>task</th><th scope=col>how to get it</th></tr>"
        links.append(("missing", "Not installed"))
        parts.append(section("missing", "Not installed", MISS, table(head + rows)))
    end = f"{len(pictures)} images, {len({r.method for r in results})} methods."
    return document(
        links,
        parts,
        title="Comparison",
        lead="Results of several methods for the same images.",
        end=end,
        command="texrs compare",
        style=STYLE,
    )


def explain(timed: bool) -> str:
    """Return the list of measures and their descriptions."""
    rows = [(name, unit, text) for name, (unit, text) in MEASURES.items()]
    if timed:
        rows.append((SECONDS, "", "processor time of all threads and programs, including the time to load a program"))
    entries = "".join(
        f"<dt>{escape(name)}{f' <small>{escape(unit)}</small>' if unit else ''}</dt><dd>{escape(text)}</dd>"
        for name, unit, text in rows
    )
    return f"<dl>{entries}</dl>"


def tabulate(results: Sequence[Result], timed: bool) -> str:
    """Return a table of the means over the images, with a row for each method."""
    names = [*next((r.figures for r in results if r.figures), {}), *([SECONDS] if timed else [])]
    methods = list(dict.fromkeys(r.method for r in results))
    means = {
        (m, n): find_mean([read(r, n) for r in results if r.method == m and r.image is not None])
        for m in methods
        for n in names
    }
    best = {
        n: min((v for m in methods if m not in FREE and (v := means[m, n]) is not None), default=None) for n in names
    }
    head = "<th scope=col>mean over the images</th>" + "".join(f"<th scope=col>{escape(n)}</th>" for n in names)
    rows = []
    for method in methods:
        cells = []
        for name in names:
            value = means[method, name]
            text = "-" if value is None else f"{value:.2f}"
            least = best[name]
            won = method not in FREE and value is not None and least is not None and text == f"{least:.2f}"
            cells.append(f"<td>{f'<b>{text}</b>' if won else text}</td>")
        failed = sum(r.image is None for r in results if r.method == method)
        note = f" <small>{failed} failed</small>" if failed else ""
        rows.append(f"<tr><th scope=row>{escape(method)}{note}</th>{''.join(cells)}</tr>")
    return table(f"<tr>{head}</tr>{''.join(rows)}")


def read(result: Result, name: str) -> float:
    """Return one of the measures of a result."""
    return result.seconds if name == SECONDS else result.figures[name]


def find_mean(values: Sequence[float]) -> float | None:
    """Return the mean, or None if the list is empty."""
    return float(np.mean(values)) if values else None


def show_pictures(pictures: Mapping[str, Array], holes: Mapping[str, Bools], results: Sequence[Result]) -> str:
    """Return a row for each image: the given image and the result of each method."""
    rows = []
    for name, image in pictures.items():
        hole = holes.get(name)
        given = image if hole is None else np.where(hole[..., np.newaxis], np.uint8(255), image)
        shown = [show(given, name, "given", "")]
        for result in (r for r in results if r.picture == name):
            figures = ", ".join(f"{n} {v:.2f}" for n, v in result.figures.items())
            if result.image is None:
                shown.append(
                    f'<figure class="failed"><p>failed: {escape(result.failure)}</p>{caption(result.method)}</figure>'
                )
            else:
                shown.append(show(result.image, name, result.method, figures, four=result.task == "tile"))
        rows.append(f'<h3>{escape(name)}</h3><div class="shown">{"".join(shown)}</div>')
    return "".join(rows)


def show(image: Array, name: str, method: str, figures: str, *, four: bool = False) -> str:
    """Return an image and its measures. If ``four`` is True, show 2 x 2 copies, so that the borders are visible."""
    height, width = image.shape[:2]
    alt = f"{name}: {method}{', two by two' if four else ''}"
    if four:
        style = f"--picture:url({encode_uri(image)});aspect-ratio:{width}/{height}"
        ground = f'<div class="ground four" role="img" aria-label="{escape(alt)}" style="{style}"></div>'
        return f"<figure>{ground}{caption(method, figures)}</figure>"
    picture = f'<img src="{encode_uri(image)}" alt="{escape(alt)}" width="{width}" height="{height}" loading="lazy">'
    return f"<figure>{picture}{caption(method, figures)}</figure>"


def caption(method: str, figures: str = "") -> str:
    """Return the caption of an image."""
    return f"<figcaption>{escape(method)}{f'<small>{escape(figures)}</small>' if figures else ''}</figcaption>"


def table(rows: str) -> str:
    """Return a table that can be scrolled sideways, also with the keyboard, if it is too wide."""
    return f'<div class="wide" tabindex="0"><table>{rows}</table></div>'


def link(text: str) -> str:
    """Return a text as code if it is a command."""
    return code(text) if text.startswith("pip ") and "," not in text else escape(text)


STYLE = """
.wide { overflow-x: auto; margin-bottom: 1.5rem; }
table { border-collapse: collapse; font-size: .9rem; font-variant-numeric: tabular-nums; background: var(--card); }
th, td { padding: .4rem .8rem; border: 1px solid var(--line); text-align: right; vertical-align: top; }
th[scope=row], tr:first-child th:first-child, #missing td, #missing th { text-align: left; }
td pre { margin: 0; padding: 0; border: 0; }
td b { color: var(--accent); }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .3rem 1rem; font-size: .9rem; }
dt { font-weight: 600; } dt small { display: inline; font-weight: 400; } dd { margin: 0; color: var(--soft); }
.shown { display: grid; grid-template-columns: repeat(auto-fill, minmax(150px, 1fr)); gap: 1rem; align-items: start; }
.failed p { margin: 0; padding: 1rem; border: 1px dashed var(--line); border-radius: 6px; font-size: .85rem;
  color: var(--soft); }
@media (max-width: 620px) { dl { grid-template-columns: 1fr; } dd { padding-bottom: .4rem; }
  .shown { grid-template-columns: 1fr 1fr; gap: .7rem; } }
"""

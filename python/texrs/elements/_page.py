"""Write an HTML page that shows an analysis and lets the user correct it."""

from __future__ import annotations

import base64
import json
from html import escape

import imageio.v3 as iio

from texrs._checks import as_instance
from texrs._show import fill_page
from texrs._version import __version__
from texrs.elements._drawing import Picture, draw_plain
from texrs.elements._drawn_stages import draw
from texrs.elements._elements import ElementAnalysis
from texrs.elements._layout import Layout
from texrs.elements._proposal import ADVICE, DOUBTFUL

__all__ = ["to_html"]


def to_html(entry: ElementAnalysis, title: str = "elements") -> str:
    """Return an HTML page that shows an analysis. Elements are corrected by clicking.

    Parameters
    ----------
    entry : ElementAnalysis
        Analysis to show.
    title : str
        Title of the page.

    Returns
    -------
    str
        A page that does not need other files. It ends with the list of corrections for `correct`.

    Examples
    --------
    >>> from texrs import elements, samples
    >>> sample = samples.load("dots", size=(64, 64))
    >>> elements.to_html(elements.analyse(sample.image, mask=sample.mask, layout="disjoint"))[:15]
    '<!doctype html>'

    """
    as_instance(entry, "entry", ElementAnalysis)
    as_instance(title, "title", str)
    drawn, report = draw(entry), entry.report
    height, width = entry.image.shape[:2]
    rows = []
    # Show the confidence of proposed values, and mark doubtful ones.
    for name in ("box", "layout", "background"):
        sure = report.get("confidence", {}).get(name)
        said = "given" if sure is None else f"proposed, {sure:.0%} sure"
        advice = f"; {escape(ADVICE[name])}" if sure is not None and sure < DOUBTFUL else ""
        value = {"layout": str(entry.layout), "box": f"{entry.box[0]} x {entry.box[1]}"}.get(name, "")
        rows.append(f"<tr{' class=doubt' if advice else ''}><th>{name}<td>{escape(value)}<td>{said}{advice}")
    for name in ("lattice", "courses"):
        if known := report.get(name):
            rows.append(f"<tr><th>{name}<td>{escape(known['description'])}<td>found, {known['confidence']:.0%} sure")
    doubts = "".join(f"<li>{escape(doubt)}" for doubt in report.get("warnings", []))
    # The script of the page derives the list of corrections from these data.
    known = {
        "points": entry.points.round(2).tolist(),
        "box": list(entry.box),
        "angles": [0.0] * len(entry.points) if entry.angles is None else entry.angles.tolist(),
        "scales": [1.0] * len(entry.points) if entry.scales is None else entry.scales.tolist(),
        "layout": str(entry.layout),
        "earlier": report.get("corrections", []),
    }
    options = "".join(f"<option{' selected' if one == entry.layout else ''}>{one}" for one in Layout)
    # Escape "<", so that a name in the data cannot end the script element.
    data = json.dumps(known).replace("<", "\\u003c")
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark"><title>{escape(title)}</title><style>
{fill_page("elements.css")}</style></head><body>
<h1>{escape(title)}</h1>
<p>{len(entry.points)} elements in {height} x {width} pixels; foreground {entry.mask.mean():.0%};
{escape(entry.arrangement.describe(entry.layout))}.</p>
<table>{"".join(rows)}</table>{f"<ul>{doubts}</ul>" if doubts else ""}
<p>Click an element to drop it, or any other place to add an element. <label>Layout of the elements:
<select id="layout">{options}</select></label></p>
<svg id="view" viewBox="-0.5 -0.5 {width} {height}" role="img" aria-label="Elements, each with its number">
<image href="{_to_uri(draw_plain(entry.image))}" x="-0.5" y="-0.5" width="{width}" height="{height}"/><g id="marks"></g></svg>
<figure><img src="{_to_uri(drawn["mask"])}" alt="Mask" width="{width}"><figcaption>The foreground; the background is blue.
</figcaption></figure>
<label for="list">Corrections: save them to a file for <code>--corrections FILE.json</code>.</label>
<textarea id="list" rows="6" readonly></textarea>
<script>const known = {data};

{fill_page("elements.js")}</script>
<footer>Made by <code>texrs analyse</code>, version {escape(__version__)}.</footer></body></html>
"""


def _to_uri(picture: Picture) -> str:
    file = iio.imwrite("<bytes>", picture, extension=".png", plugin="pillow") or b""
    return f"data:image/png;base64,{base64.b64encode(file).decode('ascii')}"

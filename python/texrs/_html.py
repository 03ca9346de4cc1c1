"""Build an HTML page in one file: its sections, images and captions."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape

import imageio.v3 as iio

from texrs._show import fill_page, preview
from texrs._typing import Array
from texrs._version import __version__

QUALITY, LARGE_QUALITY = 90, 75
"""JPEG quality of images, and of images with millions of pixels, 1 to 100."""


def encode_uri(image: Array, *, exact: bool = False, quality: int = QUALITY) -> str:
    """Encode an image as a data URI: as PNG if ``exact`` or if it has an alpha channel, else as JPEG."""
    seen = preview(image)
    if seen.ndim == 3 and seen.shape[2] == 1:
        seen = seen[..., 0]
    if exact or (seen.ndim == 3 and seen.shape[2] == 4):
        kind, file = "png", iio.imwrite("<bytes>", seen, extension=".png", plugin="pillow")
    else:
        kind, file = "jpeg", iio.imwrite("<bytes>", seen, extension=".jpg", plugin="pillow", quality=quality)
    return f"data:image/{kind};base64,{base64.b64encode(file or b'').decode('ascii')}"


def figure(image: Array, caption: str, *, exact: bool = False, share: float = 1.0, note: str = "") -> str:
    """Return HTML for an image with a caption. ``share`` is its width as a fraction of the available width."""
    height, width = image.shape[:2]
    style = f' style="width:{share:.0%}"' if share != 1 else ""
    size = f'width="{width}" height="{height}"{style}'
    picture = f'<img src="{encode_uri(image, exact=exact)}" alt="{escape(caption)}" {size}>'
    return f"<figure>{picture}{_caption(caption, note)}</figure>"


def pair(image: Array, caption: str, tiles: str, *, note: str = "") -> str:
    """Return HTML for an image, and next to it the same image repeated 2 x 2."""
    height, width = image.shape[:2]
    ratio = f"aspect-ratio:{width}/{height}"
    picture = '<div class="ground{}" role="img" aria-label="{}" style="{}"></div>'
    return (
        f'<div class="pair" style="--picture:url({encode_uri(image)})">'
        f"<figure>{picture.format('', escape(caption), ratio)}{_caption(caption, note)}</figure>"
        f"<figure>{picture.format(' four', escape(tiles), ratio)}{_caption(tiles)}</figure></div>"
    )


def row(*parts: str) -> str:
    """Return HTML for an exemplar followed by its result."""
    return f'<div class="row">{"".join(parts)}</div>'


def grid(parts: Sequence[str], *, least: int = 150, columns: int = 12) -> str:
    """Return HTML for images of one size side by side, with a minimum width in pixels and a maximum number per row."""
    return f'<div class="grid" style="--least:{least}px;--most:{columns}">{"".join(parts)}</div>'


def card(given: Sequence[str], made: str) -> str:
    """Return HTML that keeps an input and its result together, even in a narrow window."""
    return f'<div class="card"><div class="given">{"".join(given)}</div>{made}</div>'


def cards(parts: Sequence[str]) -> str:
    """Return HTML for cards side by side, two per row if there is room."""
    return f'<div class="cards">{"".join(parts)}</div>'


def opening(image: Array, example: str, caption: str, detail: str, *, note: str = "") -> str:
    """Return HTML for a large image at full size, and below it the example and the same image reduced."""
    height, width = image.shape[:2]
    seen = f'<div class="ground" role="img" aria-label="{escape(caption)}" style="aspect-ratio:{width}/{height}"></div>'
    return (
        f'<div class="opening" style="--picture:url({encode_uri(image, quality=LARGE_QUALITY)});--wide:{width}px">'
        f'<figure><div class="ground detail" role="img" aria-label="{escape(detail)}"></div>{_caption(detail)}</figure>'
        f'<div class="row">{example}<figure>{seen}{_caption(caption, note)}</figure></div></div>'
    )


def code(text: str) -> str:
    """Return HTML for a command."""
    return f"<pre><code>{escape(text)}</code></pre>"


def section(name: str, title: str, lead: str, body: str) -> str:
    """Return HTML for a section."""
    return f'<section id="{escape(name)}"><h2>{escape(title)}</h2><p class="lead">{escape(lead)}</p>{body}</section>'


def document(
    links: Sequence[tuple[str, str]],
    sections: Sequence[str],
    *,
    title: str = "texrs",
    lead: str = "New textures from one example.",
    end: str = "All results were computed when this page was written. The same version gives the same results.",
    command: str = "texrs demo",
    style: str = "",
) -> str:
    """Return the complete page."""
    menu = "".join(f'<a href="#{escape(name)}">{escape(title)}</a>' for name, title in links)
    body = "\n".join(sections)
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{escape(title)}: {escape(lead[:1].lower() + lead[1:].rstrip("."))}</title>
<style>
{fill_page("page.css")}{style}</style>
</head>
<body>
<header><h1>{escape(title)}</h1><p>{escape(lead)}</p><nav>{menu}</nav></header>
<main>
{body}
</main>
<footer>Made by <code>{escape(command)}</code>, version {escape(__version__)}. {escape(end)}</footer>
</body>
</html>
"""


def _caption(text: str, note: str = "") -> str:
    extra = f"<small>{escape(note)}</small>" if note else ""
    return f"<figcaption>{escape(text)}{extra}</figcaption>"

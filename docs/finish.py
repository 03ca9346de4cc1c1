"""Optimise the built pages: give images their sizes and smaller copies, and remove unused scripts and icons.

Each image gets copies in WebP with the widths of a phone and of the text column, and browsers choose among them.
Drawings, and pictures of several panels, also have a version for phones. All images of a page except the first one are
loaded when they come near the window. The theme loads the search index on every page, and icons both as a font and as a
script, with rules for two thousand icons. Only the search page keeps the search index. The font stays, and only rules
of used icons are kept. Marks of docutils and of the gallery are corrected for screen readers: links without text, and
lists without items.
"""

from __future__ import annotations

import json
import re
import shutil
from functools import cache
from html import escape
from pathlib import Path
from urllib.parse import unquote

from PIL import Image

WIDTHS = (480, 960)
"""Widths of the copies, in pixels: for a phone or half a text column, and for a whole text column."""
SMALL = (256, 480)
"""Widths of the copies of images in strips, which are shown at less than a quarter of the text column."""
QUALITY = 74
SIZES = "(max-width: 720px) 94vw, (max-width: 1200px) 66vw, 820px"
THUMBNAIL = "16rem"
NARROW = "(max-width: 720px)"
"""Windows that show the narrow version of a drawing or picture, with few panels in a row."""
PHONE = 520
"""Width of the narrow version of a picture, in pixels: two usual panels in a row."""
MANY = 4
"""Number of columns from which on the rows of a table are lists on phones."""
LONG = 13
"""Length of code that can be broken in a table, in characters."""
GAP = 8
"""Space between the panels of a narrow version, in pixels."""


def finish(app: object, error: Exception | None) -> None:
    """Rewrite all pages and the theme's style sheet. Sphinx calls this after the build."""
    root = Path(app.outdir)  # type: ignore[attr-defined]
    if error is None and app.builder.format == "html":  # type: ignore[attr-defined]
        icons: set[str] = set()
        for page in root.rglob("*.html"):
            if not {"rust", "shown"} & set(page.relative_to(root).parts):
                text = page.read_text(encoding="utf-8")
                if 'bd-sidebar-secondary"' in text or "bd-sidebar-secondary " in text:
                    text = text.replace("<body data-", '<body class="beside" data-', 1).replace(
                        "<body>", '<body class="beside">', 1
                    )
                drawings = Path(app.srcdir) / "generated" / "drawings"  # type: ignore[attr-defined]
                made = name_cells(break_code(name_parts(rewrite(drop_scripts(text, page.name), page.parent, drawings))))
                icons.update(re.findall(r"\bfa-[a-z0-9-]+", made))
                page.write_text(made, encoding="utf-8")
        for script in (root / "_static" / "scripts").glob("pydata-sphinx-theme.js"):
            icons.update(re.findall(r"\bfa-[a-z0-9-]+", script.read_text(encoding="utf-8")))
        for sheet in (root / "_static" / "styles").glob("pydata-sphinx-theme.css"):
            sheet.write_text(drop_icons(sheet.read_text(encoding="utf-8"), icons), encoding="utf-8")


def drop_scripts(text: str, name: str) -> str:
    """Remove the script that draws icons, and on all pages except the search page the scripts of the search."""
    unused = ["scripts/fontawesome"]
    if name != "search.html":
        unused += ["searchtools", "language_data", "searchindex"]
    return re.sub(rf'<script[^>]* src="[^"]*(?:{"|".join(unused)})\.js[^"]*"></script>\n?', "", text)


def name_parts(text: str) -> str:
    """Label the links below thumbnails, whose text is hidden, and mark references as items of their list."""
    text = re.sub(
        r'<p><a class="reference internal" (href="[^"]*")><span class="doc">([^<]*)</span></a></p>',
        r'<p><a class="reference internal" \1 aria-label="\2"><span class="doc">\2</span></a></p>',
        text,
    )
    return text.replace(' role="doc-biblioentry"', ' role="listitem"')


def break_code(text: str) -> str:
    """Mark places after punctuation where long code in table cells can be broken, so that tables fit a phone."""

    def mark(word: re.Match[str]) -> str:
        return re.sub(
            r"(?:(?<=[A-Za-z\])])(?:[._/=,(:]|-(?!-))|(?<=WIDTH|EIGHT)x)(?=[\w&])", r"\g<0><wbr>", word.group(0)
        )

    def mark_words(cell: re.Match[str]) -> str:
        return re.sub(rf'(?<=<span class="pre">)[^<]{{{LONG},}}(?=</span>)', mark, cell.group(0))

    text = re.sub(r'<span class="pre">(?=(?:&#?\w+;|[\'(\[])*-)', '<span class="pre option">', text)
    return re.sub(r"<td\b.*?</td>", mark_words, text, flags=re.DOTALL)


def name_cells(text: str) -> str:
    """Label the cells of tables with many columns, whose rows are lists on phones; and mark lines and options of commands."""

    def label(table: re.Match[str]) -> str:
        head, body = table.group(1), table.group(2)
        names = [re.sub("<.*?>", "", each).strip() for each in re.findall(r"<th\b.*?</th>", head, re.DOTALL)]
        if len(names) < MANY:
            return table.group(0)

        def label_row(row: re.Match[str]) -> str:
            cells = re.findall(r"<td\b[^>]*>(.*?)</td>", row.group(0), re.DOTALL)
            shown = ""
            for name, cell in zip(names, cells, strict=True):
                empty = "" if re.sub("<.*?>", "", cell).strip() else ' class="empty"'
                shown += f'<td data-label="{name}"{empty}>{cell}</td>\n'
            return f"{row.group(1)}{shown}</tr>"

        body = re.sub(r"(<tr\b[^>]*>)(?:\s*<td\b.*?</td>)+\s*</tr>", label_row, body, flags=re.DOTALL)
        return f'<table class="table stacked">{head}<tbody>{body}</table>'

    def mark(block: re.Match[str]) -> str:
        lines = block.group(2).rstrip("\n").split("\n")
        marked = (re.sub(r"(?<=[\s>])--?[A-Za-z][\w-]*", r'<span class="option">\g<0></span>', line) for line in lines)
        return block.group(1) + "".join(f'<span class="line">{line}\n</span>' for line in marked) + "</pre>"

    text = re.sub(r'<table class="table">(.*?)<tbody>(.*?)</table>', label, text, flags=re.DOTALL)
    return re.sub(
        r'(<div class="highlight-sh notranslate"><div class="highlight"><pre>)(.*?)</pre>', mark, text, flags=re.DOTALL
    )


def drop_icons(sheet: str, used: set[str]) -> str:
    """Remove the rules of icons that no page shows."""

    def keep(found: re.Match[str]) -> str:
        return found.group(0) if used & set(re.findall(r"fa-[a-z0-9-]+", found.group(0).partition("{")[0])) else ""

    return re.sub(r"\.fa-[a-z0-9-]+(?:,\.fa-[a-z0-9-]+)*\{--fa:[^}]*\}", keep, sheet)


def rewrite(text: str, folder: Path, drawings: Path) -> str:
    """Add the size, the copies and the loading mode to each image of a page in a folder."""
    count = 0

    def list_copies(near: str, copies: list[tuple[str, int]]) -> str:
        return escape(", ".join(f"{near}/{name} {wide}w" for name, wide in copies))

    def mend(found: re.Match[str]) -> str:
        nonlocal count
        tag = found.group(0)
        # Images from other servers and data URIs stay as they are.
        source = re.search(r' src="([^":?]+)"', tag)
        if source is None:
            return tag
        file = folder / unquote(source.group(1))
        if file.suffix.lower() not in (".png", ".jpg", ".webp") or not file.is_file():
            return tag
        added, before, after = "", "", ""
        near = source.group(1).rpartition("/")[0]
        width, height, copies = make_copies(file)
        # Drawings and pictures have a version for phones, which the browser chooses by the width of the window.
        narrow = file.with_name(f"{file.stem}-{file.suffix[1:]}-narrow.png")
        drawing = drawings / f"{file.stem}-narrow.png"
        if file.suffix == ".png" and drawing.exists():
            shutil.copyfile(drawing, narrow)
            is_narrow = True
        else:
            is_narrow = wrap_panels(file, narrow)
        if is_narrow:
            wide, high, smaller = make_copies(narrow)
            before = (
                f'<picture><source media="{NARROW}" srcset="{list_copies(near, smaller)}" sizes="94vw"'
                f' width="{wide}" height="{high}">'
            )
            after = "</picture>"
        # Known sizes avoid shifts of the layout while the page loads.
        if " width=" not in tag:
            added += f' width="{width}" height="{height}"'
        if copies and " srcset=" not in tag:
            sizes = THUMBNAIL if "thumb" in file.name or "strips" in file.parts else SIZES
            added += f' srcset="{list_copies(near, copies)}" sizes="{sizes}"'
        # The first image is usually visible at once, so it must not be loaded lazily.
        count += 1
        if " loading=" not in tag and count > 1:
            added += ' loading="lazy"'
        elif count == 1:
            tag = tag.replace(' loading="lazy"', "")
        return before + tag.removesuffix(">").removesuffix("/").rstrip() + f"{added}>" + after

    return re.sub(r"<img [^>]*>", mend, text)


@cache
def make_copies(file: Path) -> tuple[int, int, list[tuple[str, int]]]:
    """Write the copies of an image; return its size, and the names and widths of copies with a smaller file."""
    with Image.open(file) as picture:
        width, height = picture.size
        copies = []
        for wide in sorted({min(wide, width) for wide in (SMALL if "strips" in file.parts else WIDTHS)}):
            # The suffix is part of the name, because pictures and drawings of one name differ only in it.
            copy = file.with_name(f"{file.stem}-{file.suffix[1:]}-{wide}.webp")
            if not copy.exists() or copy.stat().st_mtime < file.stat().st_mtime:
                shown = picture.convert(
                    "RGBA" if "A" in picture.getbands() or "transparency" in picture.info else "RGB"
                )
                shown.resize((wide, max(1, round(height * wide / width))), Image.Resampling.LANCZOS).save(
                    copy, quality=QUALITY, method=6
                )
            if copy.stat().st_size < file.stat().st_size:
                copies.append((copy.name, wide))
    return width, height, copies


def wrap_panels(file: Path, narrow: Path) -> bool:
    """Arrange the panels of a picture in rows for a phone. Return False if the picture does not contain their boxes."""
    with Image.open(file) as opened:
        comment = opened.info.get("comment", b"")
        if not comment.startswith(b'{"panels"'):
            return False
        picture = opened.convert("RGB")
    rows: list[list[Image.Image]] = []
    top, was_input = -1, True
    for box in json.loads(comment)["panels"]:
        panel = picture.crop(tuple(box))
        # Inputs have an orange frame. Begin a row with the inputs that follow a result.
        red, green, blue = (int(value) for value in panel.getpixel((panel.width // 2, panel.height - 2)))
        is_input = red > 160 and 60 < green < 140 and blue < 70
        if rows and (box[1] != top or (is_input and not was_input)):
            rows.append([])
        top, was_input = box[1], is_input
        if panel.width > PHONE:
            panel = panel.resize((PHONE, round(panel.height * PHONE / panel.width)), Image.Resampling.LANCZOS)
        if not rows or (rows[-1] and sum(each.width + GAP for each in rows[-1]) + panel.width > PHONE):
            rows.append([])
        rows[-1].append(panel)
    high = sum(max(each.height for each in row) + GAP for row in rows) - GAP
    wide = max(sum(each.width + GAP for each in row) for row in rows) - GAP
    shown = Image.new("RGB", (wide, high), "white")
    top = 0
    for row in rows:
        left = 0
        for panel in row:
            shown.paste(panel, (left, top))
            left += panel.width + GAP
        top += max(each.height for each in row) + GAP
    shown.save(narrow)
    return True

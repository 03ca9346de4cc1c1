"""The demo: one page with all its contents."""

from __future__ import annotations

import re
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path

import pytest

from texrs import samples
from texrs.cli import main
from texrs.demo import SECTIONS, Section, page
from texrs.demo._workshop import Texture, Workshop


class Page(HTMLParser):
    """A parser that collects the references of a page, and checks that its elements are closed."""

    VOID = ("meta", "img", "br", "link", "hr", "input")

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make the demo use small textures, and the minimum size of each volume and image."""
    designed: Callable[..., Texture] = Workshop.design
    monkeypatch.setattr(Workshop, "design", lambda self, name, *sizes, **o: designed(self, name, 64, 64, copies=1, **o))
    monkeypatch.setattr("texrs.demo._pictures.SIDE", 64)
    monkeypatch.setattr("texrs.demo._maps.SIZE", 64)
    monkeypatch.setattr("texrs.demo._maps.LARGE", 256)
    monkeypatch.setattr("texrs.demo._limits.SIDE", 128)
    monkeypatch.setattr("texrs.demo._perspective.SIDE", 128)
    monkeypatch.setattr("texrs.demo._perspective.SIZE", 96)
    monkeypatch.setattr("texrs.demo._splice.SIDE", 96)
    monkeypatch.setattr("texrs.demo._samples.SIDE", 64)
    monkeypatch.setattr("texrs.demo._samples.EDGE", 32)
    for name, side in (("EDGE", 32), ("SIZE", 24), ("SIDE", 64), ("WIDTH", 48), ("CUBE", 48)):
        monkeypatch.setattr(f"texrs.demo._solid.{name}", side)


@pytest.mark.usefixtures("small")
def test_demo_is_one_whole_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["demo", "-o", "new/demo"]) == 0
    out, err = capsys.readouterr()
    assert out == ""
    assert "texrs: Built-in examples" in err
    assert {p.name for p in Path("new/demo").iterdir()} == {"index.html", "index.html.json"}
    text = Path("new/demo/index.html").read_text(encoding="utf-8")
    parsed = Page(text)
    assert not parsed.open
    ids = [a["id"] for _, a in parsed.tags if "id" in a]
    assert len(set(ids)) == len(ids)
    pictures = 0
    for tag, attributes in parsed.tags:
        assert tag not in ("script", "link", "iframe", "object", "base")
        assert not {"srcset", "data", "action", "poster"} & set(attributes)
        assert not any(name.startswith("on") for name in attributes)
        if "href" in attributes:
            assert (attributes["href"] or "")[1:] in ids
        if tag == "img":
            kind = (attributes["src"] or "").partition(";base64,")[0]
            assert kind in ("data:image/png", "data:image/jpeg")
            assert attributes["alt"]
            pictures += 1
    assert pictures > 30
    assert all(name in text for name in samples.names())
    references = re.findall(r"url\((.{12})", text)
    assert references
    assert all(r.startswith("data:image/") for r in references)
    assert "//" not in re.sub(r"base64,[A-Za-z0-9+/=]+", "", text)


def test_a_section_joins_the_page() -> None:
    seen = []
    mine = Section("mine", "A & B", "1 < 2", lambda workshop: "<p>body</p>")
    text = page([mine], progress=lambda stage, share: seen.append((stage, share)))
    assert '<section id="mine"><h2>A &amp; B</h2><p class="lead">1 &lt; 2</p><p>body</p></section>' in text
    assert seen == [("A & B", 0.0), ("A & B", 1.0)]


@pytest.mark.usefixtures("small")
def test_the_page_has_the_same_bytes_again() -> None:
    assert page(SECTIONS[1:2]) == page(SECTIONS[1:2])

"""The comparison of methods: one page with all its contents, the same bytes each time."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from test_demo import Page
from texrs import io, samples
from texrs.cli import main
from texrs.comparison import METHODS, compare
from texrs.comparison import _measures as m
from texrs.errors import InvalidInput

GRIT = samples.grit((64, 64)).image
PROGRAM = """#!{python}
import shutil, sys
if len(sys.argv) == 4:
    shutil.copy(sys.argv[1], sys.argv[3])
else:
    sys.exit("no texture today")
"""


@pytest.fixture
def program(tmp_path: Path) -> Path:
    """Return a program that copies the image to fill, and refuses all other input."""
    path = tmp_path / "program"
    path.write_text(PROGRAM.format(python=sys.executable))
    path.chmod(0o755)
    return path


def test_the_command_writes_one_whole_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    io.write("grit.png", GRIT)
    words = ["compare", "grit.png", "sample:coins", "--crop", "64", "--larger", "80", "--no-seconds", "-o"]
    assert main([*words, "one.html"]) == 0
    assert "2 images" in capsys.readouterr().err
    assert main([*words, "two.html", "--threads", "1", "-q"]) == 0
    text = Path("one.html").read_text(encoding="utf-8")
    assert text == Path("two.html").read_text(encoding="utf-8")
    page = Page(text)
    assert not page.open
    for tag, attributes in page.tags:
        for name in ("src", "href"):
            assert (attributes.get(name) or "#").startswith(("data:", "#")), (tag, name)
        assert tag != "img" or attributes["alt"]
    assert "prefers-color-scheme: dark" in text
    # Methods whose programs are missing are listed as well, with installation hints.
    for method in METHODS:
        assert method.name in text


def test_what_is_installed_takes_part(monkeypatch: pytest.MonkeyPatch, program: Path) -> None:
    def fill(picture: np.ndarray, hole: np.ndarray, radius: int, flag: int) -> np.ndarray:
        # The hole is grey, because no method may read its contents.
        assert (picture[hole > 0] == 128).all()
        return picture

    monkeypatch.setitem(
        sys.modules, "cv2", SimpleNamespace(inpaint=fill, INPAINT_TELEA=1, INPAINT_NS=0, __spec__=SimpleNamespace())
    )
    found = compare({"grit": GRIT}, tasks=["hole"], programs={"resynthesizer": str(program), "embark": str(program)})
    made = {r.method: r for r in found.results}
    assert made["OpenCV Telea"].figures["error"] > made["scikit-image biharmonic"].figures["error"]
    assert made["Resynthesizer"].image is not None
    # Other programs may fail, and the page reports it.
    assert made["Embark texture-synthesis"].failure == "no texture today"
    assert "failed: no texture today" in found.page()
    assert "OpenCV shift maps" in {each.method for each in found.missing}


def test_measures_know_the_best_and_the_worst() -> None:
    pebbles = samples.pebbles((128, 128)).image
    hole = np.zeros((128, 128), bool)
    hole[40:80, 40:80] = True
    soft = pebbles // 2 + 64
    for measure in (m.measure_colours, m.measure_detail, m.measure_repetition):
        assert measure(pebbles, pebbles) == 0
    assert m.measure_colours(pebbles, 255 - pebbles) > m.measure_colours(pebbles, soft) > 1
    assert m.measure_detail(pebbles, soft) == pytest.approx(1, abs=0.1)
    assert m.measure_repetition(pebbles, np.tile(pebbles, (2, 2, 1))) > 0.6
    assert m.measure_border(pebbles, pebbles) > 1
    assert m.measure_border(pebbles, np.concatenate([pebbles, pebbles[::-1]])[:, :1].repeat(9, axis=1)) == 0
    assert m.measure_error(pebbles, pebbles, hole) == m.measure_rim(pebbles, pebbles, hole) == 0
    torn = np.where(hole[..., np.newaxis], 255 - pebbles, pebbles)
    assert m.measure_error(pebbles, torn, hole) > 10
    assert m.measure_rim(pebbles, torn, hole) > 1


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"pictures": {}}, "pictures: must have at least one"),
        ({"tasks": []}, "tasks: must have at least one"),
        ({"tasks": ["all"]}, "tasks"),
        ({"side": 8}, "side"),
        ({"side": 96, "size": 64}, "size"),
        ({"programs": {"gimp": "gimp"}}, "must be one of embark, resynthesizer"),
        ({"programs": {"embark": "/nowhere"}}, "embark must be an executable file"),
        ({"pictures": {"small": GRIT[:20]}}, "small"),
    ],
)
def test_bad_input_is_refused_before_any_work(options: dict[str, object], says: str) -> None:
    with pytest.raises(InvalidInput, match=says):
        compare(**{"pictures": {"grit": GRIT}, "progress": lambda *a: pytest.fail("worked"), **options})


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("-o page.png", "--out"),
        ("-o page.html --program embark", "--program"),
        ("-o page.html --program gimp=gimp", "--program"),
        ("-o page.html --task all", "--task"),
        ("-o page.html --crop 2", "--crop"),
        ("sample:grit sample:grit -o page.html", "grit"),
        ("nowhere.png -o page.html", "nowhere.png"),
    ],
)
def test_the_command_says_which_option(
    words: str, says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["compare", *words.split()]) == 2
    assert says in capsys.readouterr().err
    assert not list(tmp_path.iterdir())

"""Long work is shown by whoever is told to."""

import builtins
import inspect
import sys

import numpy as np
import pytest

import texrs
from texrs._progress import listen, show_lines
from texrs.errors import InvalidInput
from texrs.materials import Material

STRIPES = np.tile(np.uint8([[0, 0, 200, 200]]), (32, 8))
VERBS = [
    getattr(texrs, name)
    for name in texrs.__all__
    if inspect.isfunction(getattr(texrs, name)) and "progress" in inspect.signature(getattr(texrs, name)).parameters
]


def test_true_shows_a_bar_that_goes_when_the_verb_ends(capsys: pytest.CaptureFixture[str]):
    expected = texrs.tile(STRIPES).image
    assert np.array_equal(texrs.tile(STRIPES, progress=True).image, expected)
    shown = capsys.readouterr().err
    assert "join rows" in shown
    assert "100 %" in shown
    assert shown.endswith("\r")


def test_without_tqdm_lines_are_written(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    find = builtins.__import__

    def refuse(name, *rest, **options):
        if name.startswith("tqdm"):
            raise ImportError(name)
        return find(name, *rest, **options)

    monkeypatch.setattr(builtins, "__import__", refuse)
    for name in [n for n in sys.modules if n.startswith("tqdm")]:
        monkeypatch.delitem(sys.modules, name)
    texrs.tile(STRIPES, progress=True)
    assert capsys.readouterr().err.splitlines() == ["segment", "join columns", "join rows"]


def test_a_line_is_written_for_each_stage_and_now_and_then():
    lines: list[str] = []
    show = show_lines(lines.append)
    for share in (0.0, 0.1, 0.2, 1.0):
        show("grow", share)
    show("blend", 0.5)
    assert lines == ["grow", "blend"]


def test_nobody_listens_unless_asked():
    assert listen(None) is listen(False) is None
    assert listen(print) is print


@pytest.mark.parametrize("verb", VERBS, ids=lambda verb: verb.__name__)
def test_every_verb_says_what_progress_may_be(verb):
    few = {
        "apply": (texrs.SourceMap.identity((32, 32)), STRIPES),
        "blend": (texrs.SourceMap.identity((32, 32)), STRIPES),
    }
    needed = [p for p in inspect.signature(verb).parameters.values() if p.default is p.empty]
    given = few.get(verb.__name__, (STRIPES,) * len([p for p in needed if p.kind is p.POSITIONAL_OR_KEYWORD]))
    named = {p.name: True for p in needed if p.kind is p.KEYWORD_ONLY}
    with pytest.raises(InvalidInput, match="progress: needs True, a function to call, or None; got 3"):
        verb(*given, **named, progress=3)


def test_materials_are_shown_by_one_bar(capsys: pytest.CaptureFixture[str]):
    stack = Material({"colour": STRIPES, "height": STRIPES.astype(np.float32)})
    assert np.array_equal(texrs.tile(stack, progress=True).image, texrs.tile(stack).image)
    assert "join rows" in capsys.readouterr().err

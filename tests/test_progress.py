"""Long work is shown by the given listener."""

import builtins
import inspect
import sys
from collections import Counter
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import texrs
from texrs._progress import answering, ask, listen, show_lines
from texrs.materials import Material

PEBBLES = texrs.samples.pebbles((48, 48)).image
STRIPES = np.tile(np.uint8([[0, 0, 200, 200]]), (32, 8))
VERBS = [
    getattr(texrs, name)
    for name in texrs.__all__
    if inspect.isfunction(getattr(texrs, name)) and "progress" in inspect.signature(getattr(texrs, name)).parameters
]


def test_true_shows_a_bar_that_goes_when_the_verb_ends(capsys: pytest.CaptureFixture[str]):
    expected = texrs.tile(PEBBLES).image
    assert np.array_equal(texrs.tile(PEBBLES, progress=True).image, expected)
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
    texrs.tile(PEBBLES, progress=True)
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


def test_materials_are_shown_by_one_bar(capsys: pytest.CaptureFixture[str]):
    stack = Material({"colour": PEBBLES, "height": PEBBLES[..., 1].astype(np.float32)})
    assert np.array_equal(texrs.tile(stack, progress=True).image, texrs.tile(stack).image)
    assert "join rows" in capsys.readouterr().err


def test_who_knows_of_no_progress_asks_who_listens():
    told: list[tuple[object, ...]] = []
    ask()
    with answering(lambda *place: told.append(place), "stage", 0.5):
        ask()
        with answering(None, "inner", 0.0):
            ask()
        with answering(lambda share: told.append((share,)), 0.25):
            ask()
        listen(None)("its own", 1.0)
    ask()
    assert listen(None) is None
    assert told == [("stage", 0.5), ("stage", 0.5), (0.25,), ("stage", 0.5)]


def test_who_listens_is_not_asked_by_what_it_does_itself():
    told = []

    def look(stage: str, share: float) -> None:
        told.append(stage)
        ask()

    with answering(look, "stage", 0.5):
        ask()
    assert told == ["stage"]


class Stop(Exception):
    """An exception that stops the work."""


def stop(*place: object) -> None:
    raise Stop


def test_a_kernel_without_progress_is_stopped_by_who_watches_the_call_around_it():
    # The complete filter would take minutes.
    noise = np.random.default_rng(0).random((512, 512, 3)).astype(np.float32)
    with answering(stop, "stage", 0.0), pytest.raises(Stop):
        texrs.kernels.mean_shift.mean_shift(noise, 200, 0.5)


@pytest.mark.filterwarnings("ignore:scale_map")
def test_long_stages_are_asked_again_and_again():
    told: Counter[str] = Counter()
    # No other test uses pictures of these sizes, so what was found is in no cache.
    floor = texrs.samples.tilted_discs((96, 104)).image
    texrs.perspective(floor, size=64, progress=lambda stage, share: told.update([stage]))
    assert told["scale map"] > 20
    assert told["sheet"] > 5
    told.clear()
    texrs.elements.analyse(texrs.samples.pebbles((100, 96)).image, progress=lambda stage, share: told.update([stage]))
    assert told["propose"] > 20


def test_items_that_are_stopped_have_not_failed(tmp_path: Path):
    pytest.importorskip("zarr")
    make = partial(texrs.synthesize, texrs.samples.dots((68, 76)).image, 64)
    with pytest.raises(Stop):
        texrs.stores.map_to_zarr(make, [{"seed": 1}, {"seed": 2}], tmp_path / "a.zarr", progress=stop)
    told: list[float] = []
    texrs.stores.map_to_zarr(make, [{"seed": 1}], tmp_path / "b.zarr", progress=lambda stage, share: told.append(share))
    # There are reports during the work, and at its end.
    assert told.count(0.0) > 1
    assert told[-1] == 1.0


def test_who_listens_outside_is_asked_from_within():
    """A verb without a progress function passes requests of its inner blocks to the enclosing block."""
    told = []
    with answering(told.append, "outer"):
        inner = listen(None)
        with answering(inner, "inner", 0.5):
            ask()
    assert told == ["outer"]

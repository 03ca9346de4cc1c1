"""Corrections of an analysis, and the page where they are made."""

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import texrs
from texrs import elements, samples
from texrs.cli import main
from texrs.elements import ElementAnalysis, correct
from texrs.errors import InvalidInput

DOTS = samples.load("dots", size=(96, 96))


@pytest.fixture(scope="module")
def found() -> ElementAnalysis:
    return elements.analyse(DOTS.image, mask=DOTS.mask, layout="disjoint")


def test_an_element_that_is_dropped_is_no_foreground(found: ElementAnalysis) -> None:
    row, column = np.rint(found.points[1]).astype(int)
    fewer = correct(found, [{"op": "drop", "elements": [1]}])
    np.testing.assert_array_equal(fewer.points, np.delete(found.points, 1, axis=0))
    assert found.mask[row, column]
    assert not fewer.mask[row, column]
    assert 0.5 < (found.mask & ~fewer.mask).sum() / (found.mask.sum() / len(found.points)) < 2


def test_one_that_is_added_back_is_foreground_again(found: ElementAnalysis) -> None:
    steps = [{"op": "drop", "elements": 1}, {"op": "add", "points": found.points[1:2]}]
    again = correct(found, steps)
    assert sorted(map(tuple, again.points)) == sorted(map(tuple, found.points))
    assert (again.mask & found.mask).sum() / (again.mask | found.mask).sum() > 0.95
    assert len(again.scores) == len(again.points)
    assert json.loads(json.dumps(again.report["corrections"])) == again.report["corrections"]
    assert len(again.report["corrections"]) == 2


def test_the_rest_is_moved_named_and_painted(found: ElementAnalysis) -> None:
    place = found.points[0] + 1
    made = correct(
        found,
        [
            {"op": "move", "element": 0, "to": place.tolist()},
            {"op": "layout", "layout": "F=c"},
            {"op": "foreground", "points": [[0, 0]], "radius": 3},
            {"op": "background", "points": [[95, 95]]},
        ],
    )
    np.testing.assert_array_equal(made.points[0], place)
    assert made.layout == "connected"
    assert made.mask[0, 0]
    assert not made.mask[95, 95]
    # The message gives the definition of a net.
    assert "connected means" in made.report["warnings"][0]


def test_corrections_are_made_again_with_the_analysis(found: ElementAnalysis, tmp_path: Path) -> None:
    steps = [{"op": "drop", "elements": [0, 2]}]
    wanted = correct(found, steps)
    again = elements.analyse(DOTS.image, mask=DOTS.mask, layout="disjoint", corrections=steps)
    np.testing.assert_array_equal(again.points, wanted.points)
    np.testing.assert_array_equal(again.mask, wanted.mask)
    wanted.save(tmp_path / "e.npz")
    assert elements.load(tmp_path / "e.npz").report["corrections"] == steps
    textures = texrs.TextureDatabase(tmp_path / "db")
    textures.add(DOTS.image, "dots", mask=DOTS.mask, layout="disjoint", corrections=steps)
    (tmp_path / "db" / "dots.npz").write_bytes(b"x")
    with pytest.warns(UserWarning, match="analysed again"):
        np.testing.assert_array_equal(textures["dots"].points, wanted.points)


def test_the_command_writes_the_page_and_reads_the_list(
    found: ElementAnalysis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    texrs.io.write("in.png", DOTS.image)
    texrs.io.write("mask.png", (255 * DOTS.mask).astype(np.uint8))
    Path("steps.json").write_text('[{"op": "drop", "elements": [3]}]')
    given = "in.png -q -o e.npz --mask mask.png --layout disjoint --page page.html --corrections"
    command = ["analyse", *given.split()]
    assert main([*command, "steps.json"]) == 0
    entry = elements.load("e.npz")
    np.testing.assert_array_equal(entry.points, correct(found, [{"op": "drop", "elements": [3]}]).points)
    text = Path("page.html").read_text(encoding="utf-8")
    known = json.loads(re.search(r"known = (\{.*\});", text)[1])  # type: ignore[index]
    assert len(known["points"]) == len(entry.points)
    assert known["earlier"] == entry.report["corrections"]
    # The page loads nothing from elsewhere.
    assert "http://" not in text.replace("http://www.w3.org/2000/svg", "")
    assert main([*command, "words"]) == 2
    assert main(["analyse", "in.png", "-q", "-o", "e.npz", "--page", "in.png"]) == 2


def test_what_is_doubtful_is_said_and_what_to_give() -> None:
    plain = elements.analyse(samples.load("bark", size=(160, 160)).image)
    low = {name for name, sure in plain.report["confidence"].items() if sure < 0.65}
    said = plain.report["warnings"]
    sure = plain.report["confidence"]["layout"]
    assert f"layout is proposed, {sure:.0%} sure: give the layout of the elements" in said
    assert {name for name in ("box", "layout", "background") if any(d.startswith(f"{name} is") for d in said)} == low
    given = elements.analyse(DOTS.image, mask=DOTS.mask, layout="disjoint")
    assert not [d for d in given.report["warnings"] if "proposed" in d]


def test_names_do_not_leave_their_place(found: ElementAnalysis) -> None:
    assert "<script>alert" not in elements.to_html(found, "<script>alert(1)</script>")


def test_numbers_are_seen_on_their_elements(found: ElementAnalysis) -> None:
    picture = elements.draw(found)["numbers"]
    assert picture.shape == (192, 192, 3)
    for row, column in np.rint(2 * found.points).astype(int):
        part = picture[max(0, row - 5) : row + 6, max(0, column - 8) : column + 9]
        assert (part == (255, 235, 90)).all(axis=-1).any()


@pytest.mark.parametrize(
    ("steps", "message"),
    [
        ([{"op": "paint"}], "step 0: 'op' must be one of drop, add"),
        ([{"op": "drop"}], "step 0, drop, needs elements"),
        ([{"op": "drop", "elements": [1], "points": []}], "step 0, drop, has no option points"),
        ([{"op": "drop", "elements": [999]}], "step 0, drop: elements: must be an integer between 0"),
        ([{"op": "drop", "elements": [0.5]}], "elements: must be an integer"),
        ([{"op": "drop", "elements": [object()]}], "step 0: must contain only"),
        ([{"op": "drop", "elements": float("nan")}], "step 0: must contain only"),
        ([{"op": "add", "points": [[500, 3]]}], "step 0, add: points: point 0, .* outside"),
        ([{"op": "add", "points": "here"}], "points: must be points"),
        ([{"op": "move", "element": 0, "to": [[1, 2], [3, 4]]}], "to: must be one place"),
        ([{"op": "layout", "layout": "net"}], "layout: must be one of disjoint"),
        ([{"op": "background", "points": [[48, 48]], "radius": 1000}], "leaves no foreground"),
        ([{"op": "foreground", "points": [[48, 48]], "radius": -1}], "radius: must be a number"),
    ],
)
def test_bad_corrections(found: ElementAnalysis, steps: object, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        correct(found, steps)


def test_elements_must_be_left(found: ElementAnalysis) -> None:
    drop: Callable[[int], dict[str, object]] = lambda n: {"op": "drop", "elements": list(range(n))}  # noqa: E731
    with pytest.raises(InvalidInput, match="must leave at least 3 elements, left 2"):
        correct(found, [drop(len(found.points) - 2)])


def test_known_elements_stay_known_until_one_is_added() -> None:
    image = samples.load("beans", size=(128, 128)).image
    heap = elements.analyse(image)
    fewer = elements.correct(heap, {"op": "drop", "elements": [2, 0]})
    assert heap.known is not None
    assert fewer.known is not None
    assert fewer.labels.max() == heap.labels.max() - 2
    assert not fewer.mask[(heap.labels == 1) | (heap.labels == 3)].any()
    np.testing.assert_array_equal(fewer.labels == 1, heap.labels == 2)
    np.testing.assert_array_equal(fewer.labels == 2, heap.labels == 4)
    net = elements.correct(heap, {"op": "layout", "layout": "connected"})
    np.testing.assert_array_equal(net.mask, ~heap.mask)
    np.testing.assert_array_equal(net.labels, heap.labels)
    assert elements.correct(heap, {"op": "add", "points": [[2.0, 2.0]]}).known is None

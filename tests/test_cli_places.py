"""Places on the command line: x comes first, mistakes are named, and older records keep their meaning."""

import json
from pathlib import Path

import numpy as np
import pytest

import texrs
from texrs import elements, fields, io, samples
from texrs._notices import collect
from texrs.cli import COMMANDS, main
from texrs.cli._places import PLACED, put_rows_first, read_points, say_places
from texrs.cli._readers import read_field
from texrs.cli._texts import About

Capture = pytest.CaptureFixture[str]
CORNERS = [[20, 20], [24, 104], [100, 110], [112, 14]]
"""(row, column) of a rectangle of the wall."""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    io.write("wall.png", samples.tilted_bricks((120, 160)).image)
    return tmp_path


def test_no_command_asks_for_rows_first() -> None:
    import typer

    from texrs.cli import app

    group = typer.main.get_command(app)
    for command in COMMANDS:
        for parameter in group.get_command(None, command).params:  # type: ignore[attr-defined]
            assert "ROW" not in (parameter.metavar or ""), (command, parameter.name)
            assert "row,column a" not in (parameter.help or ""), (command, parameter.name)


def test_corners_are_x_and_y(here: Path) -> None:
    words = " ".join(f"{column},{row}" for row, column in CORNERS)
    assert main(["rectify", "wall.png", "-o", "flat.png", "--corners", words, "-q"]) == 0
    expected = texrs.rectify(samples.tilted_bricks((120, 160)).image, view=texrs.PlaneView(corners=CORNERS)).image
    np.testing.assert_array_equal(io.read("flat.png"), expected)


@pytest.mark.parametrize(
    ("corners", "words"),
    [
        ("20,20 110,100 104,24 14,112", "the sides cross"),
        ("20,20 24,150 100,110 112,14", "1 of the four are outside the image; as x,y, they are 20,20 24,150"),
        ("20,20 24,150 100,110 112,14", "they would fit as row,column: exchange the numbers"),
        ("20,20 999,24 110,999 14,112", "2 of the four are outside the image"),
        ("20,20 104,24", "--corners: must be four points X,Y"),
        ("20,20 104,24 110,100 14", "--corners: must be X,Y"),
    ],
)
@pytest.mark.parametrize("verb", ["rectify", "extend", "remove"])
def test_corners_that_cannot_be_meant_are_refused(
    here: Path, capsys: Capture, verb: str, corners: str, words: str
) -> None:
    io.write("mask.png", np.pad(np.full((9, 9), 255, np.uint8), ((50, 61), (60, 91))))
    more = {"rectify": [], "extend": ["--left", "8"], "remove": ["mask.png"]}[verb]
    assert main([verb, "wall.png", *more, "-o", "out.png", "--corners", corners, "-q"]) == 2
    assert words in capsys.readouterr().err
    assert not Path("out.png").exists()


@pytest.mark.parametrize(
    ("content", "found", "assumed"),
    [
        ("x,y\n5,2\n7,3\n", [[2, 5], [3, 7]], False),
        ("row,column\n2,5\n3,7\n", [[2, 5], [3, 7]], False),
        ('"Column";"Row"\n5;2\n7;3\n', [[2, 5], [3, 7]], False),
        ("5,2\n7,3\n", [[2, 5], [3, 7]], True),
        ("# centres\n5,2\n", [[2, 5]], True),
    ],
)
def test_a_file_of_points_states_its_order(here: Path, content: str, found: list[list[float]], assumed: bool) -> None:
    Path("points.csv").write_text(content)
    with collect() as notices:
        assert read_points("points.csv", About("--points")) == found
    assert bool(notices.assumed) == assumed


def test_errors_speak_of_x_and_y(here: Path, capsys: Capture) -> None:
    assert main(["analyse", "wall.png", "-o", "e.npz", "--background", "10,150", "-q"]) == 2
    err = capsys.readouterr().err
    assert "--background: point 0, (x, y) = [10.0, 150.0], is outside the image of 160 x 120" in err
    assert "if the two numbers of each point are exchanged, all are inside" in err
    assert say_places("box: must be (row, column, height, width), got [1, 2, 3, 4]") == (
        "box: must be (x, y, width, height), got [2, 1, 4, 3]"
    )
    assert {"corners", "background", "points", "box"} <= set(PLACED)


def test_a_proposed_box_is_one_that_the_option_takes(here: Path, capsys: Capture) -> None:
    io.write("dots.png", samples.dots((96, 128)).image)
    assert main(["analyse", "dots.png", "-o", "e.npz"]) == 0
    line = next(line for line in capsys.readouterr().err.splitlines() if "proposed box" in line)
    row, column, height, width = elements.load("e.npz").report["box"]
    assert f"proposed box: {column},{row},{width},{height} " in line


def test_the_centre_of_a_field_is_x_first() -> None:
    assert read_field("circular:centre=1x2x3", About(size=(8, 9, 10))) == fields.circular(centre=(3, 2, 1)).over(
        (8, 9, 10)
    )
    assert read_field("circular:centre=1x2", About(size=(8, 9))) == fields.circular(axes=2, centre=(2, 1)).over((8, 9))


def test_records_without_an_order_mean_rows_first(here: Path, capsys: Capture) -> None:
    """Files of earlier versions are made again to the byte: their places are row,column."""
    Path("points.csv").write_text("\n".join(f"{r},{c}" for r, c in [[30, 40], [30, 90], [80, 60]]) + "\n")
    rows_first = " ".join(f"{row},{column}" for row, column in CORNERS)
    commands = (
        ["rectify", "wall.png", "-o", "old.png", "--corners", rows_first, "-q"],
        ["extend", "wall.png", "-o", "wide.png", "--left", "8", "--corners", rows_first, "-q"],
    )
    with put_rows_first():
        for command in commands:
            assert main(command) == 0
    for command in commands:
        made = json.loads(io.read_metadata(command[3]).made or "")
        assert "places" not in made
        assert main(["rerun", command[3], "-q"]) == 0
        assert "the same bytes" in capsys.readouterr().out
    assert main(["info", "old.png"]) == 0
    assert "its places are row,column" in capsys.readouterr().out
    # New records contain places as x,y, and are repeated in the same way.
    words = " ".join(f"{column},{row}" for row, column in CORNERS)
    assert main(["rectify", "wall.png", "-o", "new.png", "--corners", words, "-q"]) == 0
    assert json.loads(io.read_metadata("new.png").made or "")["places"] == "x,y"
    assert main(["rerun", "new.png", "-q"]) == 0
    assert "the same bytes" in capsys.readouterr().out
    np.testing.assert_array_equal(io.read("new.png"), io.read("old.png"))

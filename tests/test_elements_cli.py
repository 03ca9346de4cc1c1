"""The commands about elements, end to end: ``texrs analyse`` and ``texrs database``."""

from __future__ import annotations

import re
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest

from texrs import elements, samples
from texrs.cli import main

Capture = pytest.CaptureFixture[str]
DOTS = samples.load("dots", size=(96, 96))


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in a folder with an image, its mask, and a list of its centres."""
    monkeypatch.chdir(tmp_path)
    iio.imwrite("in.png", DOTS.image)
    iio.imwrite("mask.png", DOTS.mask.astype(np.uint8) * 255)
    lines = [f"{r:.2f},{c:.2f}" for r, c in DOTS.centres]
    Path("points.csv").write_text("row,column\n" + "\n".join(lines) + "\n")
    Path("nan.csv").write_text("1,2\nnan,3\n5,6\n")
    Path("twice.csv").write_text("1,2\n3,4\n1,2\n")
    Path("words.csv").write_text("1,2\nhere,there\n")
    Path("empty.csv").write_text("\n")
    Path("before.npz").touch()
    return tmp_path


def test_analyse_writes_what_the_function_finds(here: Path, capsys: Capture) -> None:
    assert main(["analyse", "in.png", "-o", "e.npz", "--mask", "mask.png", "--layout", "F=d", "--stages", "st"]) == 0
    found = elements.load("e.npz")
    wanted = elements.analyse(DOTS.image, mask=DOTS.mask, layout="disjoint")
    np.testing.assert_array_equal(found.points, wanted.points)
    assert sorted(p.name for p in Path("st").iterdir()) == ["mask.png", "numbers.png", "points.png"]
    assert "wrote e.npz" in capsys.readouterr().err


def test_a_material_is_analysed_by_all_its_maps(here: Path, capsys: Capture) -> None:
    Path("stuff").mkdir()
    flat = np.full_like(DOTS.image, 90)
    iio.imwrite("stuff/stuff_albedo.png", flat)
    iio.imwrite("stuff/stuff_height.png", DOTS.image[..., 0])
    iio.imwrite("stuff/stuff_wet.png", DOTS.image[..., 1])
    assert main(["analyse", "stuff", "-o", "e.npz", "--layout", "disjoint"]) == 0
    assert "stuff_wet.png not used" in capsys.readouterr().err
    found = elements.load("e.npz")
    # Heights show elements that colours do not show. The entry contains the colours.
    assert (found.image == flat).all()
    assert len(found.points) >= 0.8 * len(DOTS.centres)
    assert main(["analyse", "stuff", "-o", "f.npz", "--layout", "disjoint", "--role", "stuff_wet=mask", "-q"]) == 0
    assert main(["rerun", "f.npz", "-q"]) == 0
    assert "the same bytes" in capsys.readouterr().out
    assert main(["analyse", "in.png", "-o", "g.npz", "--role", "wet=mask"]) == 2
    assert "--role: only available for materials" in capsys.readouterr().err
    assert main(["analyse", "stuff", "-o", "g.npz", "--role", "wet"]) == 2
    assert "--role: must be MAP=ROLE" in capsys.readouterr().err
    assert not Path("g.npz").exists()


def test_places_may_follow_each_other(here: Path) -> None:
    from test_elements import annotate

    box, ground = annotate(DOTS)
    places = [f"{c},{r}" for r, c in ground[:4]]
    row, column, height, width = box
    start = ["analyse", "in.png", "-q", "--box", f"{column},{row},{width},{height}", "--layout", "F=d"]
    assert main([*start, "-o", "a.npz", "--background", *places]) == 0
    assert main([*start, "-o", "b.npz", *(x for p in places for x in ("--background", p))]) == 0
    assert main([*start, "-o", "c.npz", "--background", " ".join(places)]) == 0
    made = [elements.load(name) for name in ("a.npz", "b.npz", "c.npz")]
    assert len({(m.points.tobytes(), m.mask.tobytes()) for m in made}) == 1


def test_given_points_and_an_automatic_start(here: Path, capsys: Capture) -> None:
    command = ["analyse", "in.png", "-o", "e.npz", "--points", "points.csv", "--mask", "mask.png", "--layout", "F=d"]
    assert main([*command, "--similarity"]) == 0
    found = elements.load("e.npz")
    assert len(found.points) >= len(DOTS.centres)
    assert found.sets is not None
    assert main(["analyse", "in.png", "-o", "e.npz"]) == 0
    err = capsys.readouterr().err
    assert re.search(r"proposed box: \d+,\d+,\d+,\d+ \(\d+% sure\)", err)
    assert "proposed layout" in err


def test_database(here: Path, capsys: Capture) -> None:
    assert main(["database", "db", "add", "in.png", "--mask", "mask.png", "--layout", "F=d", "--name", "dots"]) == 0
    assert main(["database", "db", "add", "sample:leaves_and_flowers", "-q", "--layout", "F=d"]) == 0
    capsys.readouterr()
    assert main(["database", "db", "list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split("\t")[:2] for line in lines] == [["dots", "disjoint"], ["leaves_and_flowers", "disjoint"]]
    assert main(["database", "db", "matrix", "-o", "sheet.png", "--cell", "32", "--size", "40x40"]) == 0
    assert iio.imread("sheet.png").shape == (108, 108, 3)
    (here / "db" / "dots.npz").write_bytes(b"x")
    assert main(["database", "db", "matrix", "dots", "-o", "one.png", "--cell", "32", "-q"]) == 0
    assert "dots: analysed again" in capsys.readouterr().err
    assert iio.imread("one.png").shape == (72, 72, 3)
    assert main(["database", "db", "splice", "dots", "leaves_and_flowers", "-o", "s.png", "--size", "44x40", "-q"]) == 0
    assert iio.imread("s.png").shape == (40, 44, 3)
    rows = (
        "matrix -q -o two.png --cell 32 --size 44x40 --seed 0 --each all --rows dots --columns leaves_and_flowers,dots"
    )
    assert main(["database", "db", *rows.split()]) == 0
    assert iio.imread("two.png").shape == (72, 108, 3)
    assert sorted(p.name for p in (here / "all").iterdir()) == ["dots-on-dots.png", "dots-on-leaves_and_flowers.png"]
    np.testing.assert_array_equal(iio.imread("all/dots-on-leaves_and_flowers.png"), iio.imread("s.png"))
    assert main(["database", "db", "remove", "leaves_and_flowers"]) == 0
    capsys.readouterr()
    assert main(["database", "db", "list"]) == 0
    assert capsys.readouterr().out.startswith("dots\t")
    for command, message in (
        ("splice dots -o s.png", "NAME: must be two names for splice"),
        ("splice dots nobody -o new.png", "NAME: texture 'nobody' is not in"),
        ("remove", "NAME: requires at least one texture to remove"),
        ("list --cell 32", "--cell: must be used with matrix, got list"),
        ("splice dots dots -o new.png --each all", "--each: must be used with matrix, got splice"),
    ):
        assert main(["database", "db", *command.split(), "-q"]) == 2
        assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("analyse in.png -o before.npz --box 10,20", "--box: must be X,Y,WIDTH,HEIGHT"),
        ("analyse in.png -o before.npz --box 20,500,20,20", "--box: reaches from 490 to 510 along the rows"),
        ("analyse in.png -o before.npz --background 10", "--background: must be X,Y"),
        ("analyse in.png -o before.npz --background 10,nan", "--background: must be X,Y"),
        (
            "analyse in.png -o before.npz --background 900,10",
            r"--background: point 0, \(x, y\) = \[900.0, 10.0\], is outside",
        ),
        ("analyse in.png -o before.npz --layout F=e", "--layout: must be one of default, disjoint, connected, jointed"),
        (
            "analyse in.png -o before.npz --layout F=c --mask mask.png --box 48,48,20,20",
            "--layout: contradicts the mask",
        ),
        ("analyse in.png -o before.npz --points nan.csv", "--points: must be finite, but point 1"),
        ("analyse in.png -o before.npz --points twice.csv", "--points: point 2, .* occurs twice"),
        ("analyse in.png -o before.npz --points words.csv", "words.csv: line 2 must be x,y, got 'here,there'"),
        ("analyse in.png -o before.npz --points empty.csv", "empty.csv: contains no points"),
        ("analyse in.png -o before.npz --points none.csv", "none.csv: cannot be read"),
        ("analyse in.png -o before.npz --scales large", "--scales: must be numbers"),
        ("analyse in.png -o before.npz --method letter", "--method: must be one of default, paper"),
        ("analyse in.png -o before.npz --rotations 0", "--rotations: must be an integer between 1 and 72"),
        ("analyse in.png -o before.png", "--out: must be a name that ends in .npz"),
        ("analyse none.png -o before.npz", "none.png: does not exist"),
        ("database db rename", "add\\|list\\|remove\\|splice\\|matrix: must be one of"),
        ("database db list", "db: the folder does not exist"),
        ("database db add", "IMAGE: requires at least one image to add"),
        ("database in.png add in.png", "in.png: must be a folder, or a new name"),
        ("database db add in.png mask.png --name both", "IMAGE: must be a single image with --name"),
    ],
)
def test_bad_input_gets_one_line_and_leaves_what_was_there(
    here: Path, capsys: Capture, command: str, message: str
) -> None:
    assert main([*command.split(), "-q"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("texrs: ")
    assert said.count("\n") == 1
    assert re.search(message, said), said
    assert Path("before.npz").read_bytes() == b""

"""Notices: each is given once, shown or warned about, raised if strict, and stored in reports."""

import json

import numpy as np
import pytest

import texrs
from texrs._notices import assume, collect, ignore, repeat
from texrs.cli import main
from texrs.errors import InputWarning, InvalidInput


def test_an_ignored_part_is_a_warning_at_the_caller() -> None:
    with pytest.warns(InputWarning, match="a.png is not used") as caught:
        ignore("folder: a.png is not used")
    assert caught[0].filename == __file__


def test_a_block_collects_each_notice_once() -> None:
    shown: list[str] = []
    with collect(show=shown.append) as outer, collect() as inner:
        ignore("folder: a.png is not used")
        ignore("folder: a.png is not used")
        assume("b.png: read as labels")
    assert outer.ignored == inner.ignored == ["folder: a.png is not used"]
    assert outer.assumed == inner.assumed == ["b.png: read as labels"]
    assert shown == ["folder: a.png is not used", "b.png: read as labels"]


def test_repeated_notices_do_not_warn() -> None:
    with pytest.warns(InputWarning), collect() as first:
        ignore("folder: a.png is not used")
    with collect() as second:
        repeat(first)
    assert second.ignored == first.ignored


def test_strict_blocks_refuse() -> None:
    with collect(strict=True), pytest.raises(InvalidInput, match="a.png is not used; this is an error because of"):
        ignore("folder: a.png is not used")


def test_reports_keep_notices() -> None:
    with collect(show=lambda line: None) as notices:
        ignore("folder: a.png is not used")
    assert notices.add_to({"seed": 1}) == {"seed": 1, "ignored": ["folder: a.png is not used"]}
    assert notices.add_to({"ignored": ["x"]}) == {"ignored": ["x", "folder: a.png is not used"]}


@pytest.fixture
def folder(tmp_path):
    place = tmp_path / "rock"
    place.mkdir()
    image = texrs.samples.pebbles((48, 48)).image
    texrs.io.write(place / "albedo.png", image)
    texrs.io.write(place / "preview.png", image)
    return place


def test_a_verb_reports_what_a_folder_had_besides_its_maps(folder) -> None:
    with pytest.warns(InputWarning, match="preview.png"):
        material = texrs.Material.read(folder)
    made = texrs.tile(material)
    assert any("preview.png" in line for line in made.report["ignored"])


def test_a_command_shows_it_stores_it_and_is_strict_if_asked(folder, tmp_path, capsys) -> None:
    out, stages = tmp_path / "out", tmp_path / "stages"
    assert main(["tile", str(folder), "-o", str(out), "--stages", str(stages)]) == 0
    assert capsys.readouterr().err.count("preview.png") == 1
    assert "preview.png" in json.loads((stages / "report.json").read_text())["ignored"][0]
    assert main(["tile", str(folder), "-o", str(tmp_path / "other"), "--strict"]) == 2
    assert "--strict" in capsys.readouterr().err
    assert not (tmp_path / "other").exists()


def test_variants_report_what_is_noticed_while_they_are_made() -> None:
    tiles = np.kron(np.random.default_rng(3).integers(0, 2, (8, 8), np.uint8), np.full((6, 6), 200, np.uint8))
    material = texrs.Material({"albedo": tiles, "height": tiles}, spaces={"albedo": "srgb"})
    several = list(texrs.design_variants(material, 2, 48))
    assert len(several) == 2
    for made in several:
        noticed = "maps: have only a few colours, so pixels are neither interpolated nor corrected"
        assert any(text.startswith(noticed) for text in made.report["assumed"])


def test_an_array_alone_gives_no_notices() -> None:
    made = texrs.tile(np.asarray(texrs.samples.pebbles((48, 48)).image))
    assert "ignored" not in made.report
    assert "assumed" not in made.report

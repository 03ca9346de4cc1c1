"""The database of textures: stored, remade when damaged or outdated, written by two processes, spliced by a stub."""

from __future__ import annotations

import json
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import imageio.v3 as iio
import numpy as np
import pytest

import texrs
from texrs import TextureDatabase, samples
from texrs.elements import ElementSearch, Layout
from texrs.errors import FileError, InvalidInput

DOTS = samples.load("dots", size=(96, 96))
GIVEN = {"mask": DOTS.mask, "layout": "disjoint"}


@pytest.fixture
def said() -> list[str]:
    return []


@pytest.fixture
def textures(tmp_path: Path, said: list[str]) -> TextureDatabase:
    made = TextureDatabase(tmp_path / "db", log=said.append)
    made.add(DOTS.image, "dots", similarity=True, **GIVEN)
    return made


def test_what_is_added_is_kept(textures: TextureDatabase, said: list[str]) -> None:
    again = TextureDatabase(textures.path, log=said.append)
    assert list(again) == ["dots"]
    assert "dots" in again
    assert len(again) == 1
    record = again.list()[0]
    assert (record.layout, record.image, record.elements) == (Layout.DISJOINT, "dots.npy", len(again["dots"].points))
    assert again["dots"].sets is not None
    assert not said


def test_files_stay_where_they_are(tmp_path: Path, textures: TextureDatabase, said: list[str]) -> None:
    file = tmp_path / "buttons.png"
    iio.imwrite(file, DOTS.image)
    before = textures.add(file, **GIVEN)
    assert textures.list()[0].image == str(file)
    assert not said
    iio.imwrite(file, DOTS.image[::-1])
    with pytest.raises(InvalidInput, match="contradicts|mask"):  # The mask of the old image does not fit this one.
        textures.add(file, "buttons", replace=True, mask=~DOTS.mask, layout="disjoint")
    changed = textures["buttons"]
    assert said == ["buttons: analysed again, because its entry belongs to another image"]
    assert (changed.image == DOTS.image[::-1]).all()
    assert (before.image == DOTS.image).all()
    file.unlink()
    assert (textures["buttons"].image == changed.image).all()


@pytest.mark.parametrize("harm", ["cut", "gone", "version", "text"])
def test_a_damaged_entry_is_said_and_remade(textures: TextureDatabase, said: list[str], harm: str) -> None:
    path, before = textures.path / "dots.npz", textures["dots"]
    if harm == "cut":
        path.write_bytes(path.read_bytes()[:300])
    elif harm == "gone":
        path.unlink()
    elif harm == "text":
        path.write_text("no entry")
    else:
        parts = dict(np.load(path))
        np.savez(path, **{**parts, "texrs_elements": np.array(0)})
    after = textures["dots"]
    assert len(said) == 1
    assert said[0].startswith("dots: analysed again")
    np.testing.assert_array_equal(after.points, before.points)
    np.testing.assert_array_equal(after.mask, before.mask)
    assert after.sets is not None
    textures.analyse("dots")
    assert len(said) == 1


def test_entries_are_remade_with_their_options(textures: TextureDatabase, said: list[str]) -> None:
    search = ElementSearch(rotations=2, scales=[0.9, 1.0], threshold=0.5)
    before = textures.add(DOTS.image, "turned", points=DOTS.centres, wrap=(True, False), search=search, **GIVEN)
    kept = json.loads((textures.path / "manifest.json").read_text())["textures"]["turned"]["options"]
    assert kept["search"] == {"rotations": 2, "scales": [0.9, 1.0], "threshold": 0.5, "channel": None, "model": None}
    assert kept["layout"] == "disjoint"
    (textures.path / "turned.npz").unlink()
    after = textures["turned"]
    assert said[0].startswith("turned: analysed again")
    assert (after.report, after.wrap, after.layout) == (before.report, before.wrap, before.layout)
    np.testing.assert_array_equal(after.points, before.points)


def test_an_entry_of_another_version_is_remade(textures: TextureDatabase, said: list[str]) -> None:
    manifest = textures.path / "manifest.json"
    table = json.loads(manifest.read_text())
    table["textures"]["dots"]["version"] = 0
    manifest.write_text(json.dumps(table))
    assert len(textures["dots"].points) > 3
    assert "has version 0" in said[0]
    assert textures.list()[0].version == texrs.elements.FORMAT


@pytest.mark.parametrize(
    "text",
    [
        *("", "{", "[]", '{"version": 2}', '{"version": 2, "textures": {"../x": {}}}', None),
        *('{"version": 1e999, "textures": {}}', '{"version": NaN}', "[" * 100_000),
    ],
)
def test_a_damaged_manifest_is_remade_from_the_entries(
    textures: TextureDatabase, said: list[str], text: str | None
) -> None:
    manifest = textures.path / "manifest.json"
    before = manifest.read_text()
    manifest.unlink() if text is None else manifest.write_text(text)
    assert list(textures) == ["dots"]
    assert "rebuilt from 1 entries" in said[0]
    assert manifest.read_text() == before


@pytest.mark.parametrize("key", ["file", "image", "hash", "version", "layout", "box", "elements", "options"])
@pytest.mark.parametrize(
    "value",
    [
        "1e999",
        "-1e999",
        "NaN",
        "null",
        "[[]]",
        "{}",
        "true",
        '".."',
        '"."',
        '"/etc/passwd"',
        '"a\\u0000"',
        '"../x.npz"',
    ],
)
def test_a_manifest_whose_values_are_hostile(textures: TextureDatabase, said: list[str], key: str, value: str) -> None:
    manifest = textures.path / "manifest.json"
    table = json.loads(manifest.read_text())
    table["textures"]["dots"][key] = "@"
    manifest.write_text(json.dumps(table).replace('"@"', value))
    (record,) = textures.list()
    assert record.file == "dots.npz"
    assert len(textures["dots"].points) > 3


def test_a_warning_where_nobody_listens(textures: TextureDatabase) -> None:
    (textures.path / "dots.npz").write_bytes(b"")
    with pytest.warns(UserWarning, match="dots: analysed again"):
        TextureDatabase(textures.path)["dots"]


def test_two_processes_may_write_at_once(tmp_path: Path) -> None:
    code = (
        "import sys, texrs; from texrs import samples\n"
        "dots = samples.load('dots', size=(64, 64)); db = texrs.TextureDatabase(sys.argv[1])\n"
        "for i in range(4): db.add(dots.image, f'{sys.argv[2]}{i}', mask=dots.mask, layout='disjoint')\n"
    )
    folder = str(tmp_path / "db")
    work = [subprocess.Popen([sys.executable, "-c", code, folder, name]) for name in "ab"]
    assert [process.wait(120) for process in work] == [0, 0]
    textures = TextureDatabase(folder)
    assert list(textures) == sorted(f"{name}{i}" for name in "ab" for i in range(4))
    assert all(len(textures[name].points) >= 3 for name in textures)
    assert not list(Path(folder).glob(".texrs-*"))


def meet(barrier: Any) -> None:
    """Store the barrier of a process, where it waits for the others."""
    globals()["_BARRIER"] = barrier


def add_one(folder: str, number: int, replace: bool) -> str:
    """Add an image at the same time as the other processes. Return the messages."""
    globals()["_BARRIER"].wait(120)
    try:
        TextureDatabase(folder).add(
            np.roll(DOTS.image, number, axis=-1) // (number + 1), "one", replace=replace, **GIVEN
        )
    except InvalidInput as error:
        return str(error)
    return "ok"


@pytest.mark.parametrize("replace", [False, True])
def test_one_name_given_by_several_processes_at_once(tmp_path: Path, said: list[str], replace: bool) -> None:
    context, count = get_context("spawn"), 3
    with ProcessPoolExecutor(count, context, meet, (context.Barrier(count),)) as pool:
        answers = list(pool.map(add_one, [str(tmp_path / "db")] * count, range(count), [replace] * count))
    textures = TextureDatabase(tmp_path / "db", log=said.append)
    if replace:
        assert answers == ["ok"] * count
    else:
        assert answers.count("ok") == 1
        assert sum("name: one exists already with another image" in answer for answer in answers) == count - 1
        winner = answers.index("ok")
        assert (textures["one"].image == np.roll(DOTS.image, winner, axis=-1) // (winner + 1)).all()
    # The manifest, the entry and the pixels belong to the same image.
    assert (np.load(tmp_path / "db" / "one.npy") == textures["one"].image).all()
    assert textures.list()[0].hash == texrs.elements.hash_image(textures["one"].image)
    assert not said


def test_a_texture_that_is_refused_leaves_no_folder(tmp_path: Path) -> None:
    textures = TextureDatabase(tmp_path / "db")
    with pytest.raises(InvalidInput, match="mask"):
        textures.add(DOTS.image, "dots", mask=DOTS.mask[:10])
    assert len(textures) == 0
    assert not (tmp_path / "db").exists()


def test_splices_and_their_matrix(textures: TextureDatabase, monkeypatch: pytest.MonkeyPatch) -> None:
    textures.add(DOTS.image[:, ::-1].copy(), "other", mask=DOTS.mask[:, ::-1], layout="disjoint")
    mine, theirs = textures["dots"], textures["other"]
    expected = texrs.splice(mine, theirs, (40, 48), seed=3).image
    np.testing.assert_array_equal(textures.splice("dots", "other", (40, 48), seed=3).image, expected)
    made = textures.matrix(cell=32, size=(40, 48), seed=3)
    assert made.rows == made.columns == ("dots", "other")
    assert len(made.results) == 4
    np.testing.assert_array_equal(made.results["dots", "other"].image, expected)
    assert made.sheet.shape == (108, 108, 3)

    def refuse(a, b, size=None, **options):
        if (a.points == b.points).all():
            raise InvalidInput("a: is b")
        return texrs.splice(a, b, size, **options)

    monkeypatch.setattr("texrs.database._textures.splice", refuse)
    failing = textures.matrix(["dots"], ["dots", "other"], cell=32, size=(40, 48), seed=1)
    assert failing.failed == {("dots", "dots"): "a: is b"}
    assert (failing.sheet[40:60, 40:60] == 128).all()
    assert (failing.sheet[40:60, 76:96] != 128).any()


def test_results_that_are_passed_on_are_not_kept(textures: TextureDatabase) -> None:
    textures.add(DOTS.image[:, ::-1].copy(), "other", mask=DOTS.mask[:, ::-1], layout="disjoint")
    seen: dict[tuple[str, str], tuple[int, ...]] = {}

    def each(a: str, b: str, result: texrs.Synthesis) -> None:
        seen[a, b] = result.image.shape

    made = textures.matrix(["dots", "other"], ["other"], cell=32, size=(40, 48), each=each)
    assert seen == {("dots", "other"): (40, 48, 3), ("other", "other"): (40, 48, 3)}
    assert not made.results
    np.testing.assert_array_equal(
        made.sheet, textures.matrix(["dots", "other"], ["other"], cell=32, size=(40, 48)).sheet
    )


def test_a_texture_is_removed_with_the_copy_of_its_pixels(textures: TextureDatabase, tmp_path: Path) -> None:
    texrs.io.write(tmp_path / "file.png", DOTS.image)
    textures.add(tmp_path / "file.png", mask=DOTS.mask, layout="disjoint")
    textures.remove("dots")
    textures.remove("file")
    assert list(textures) == []
    assert sorted(p.name for p in textures.path.iterdir()) == [".lock", "manifest.json"]
    assert (tmp_path / "file.png").exists()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda db: db.add(DOTS.image[::-1], "dots", mask=DOTS.mask[::-1], layout="disjoint"),
            "name: dots exists already",
        ),
        (lambda db: db.add(DOTS.image, "x", boxes=3), "boxes: is not an option"),
        (lambda db: db["nobody"], "name: texture 'nobody' is not in"),
        (lambda db: db.matrix(["dots"], ["nobody"]), "name: texture 'nobody' is not in"),
        (lambda db: db.remove("nobody"), "name: texture 'nobody' is not in"),
    ],
)
def test_bad_input(textures: TextureDatabase, call, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        call(textures)


def test_folders_that_are_none(tmp_path: Path, textures: TextureDatabase) -> None:
    (tmp_path / "file").write_text("x")
    for path in (tmp_path / "file", tmp_path / "no" / "such"):
        with pytest.raises(FileError):
            TextureDatabase(path)
    (textures.path / "dots.npz").write_bytes(b"")
    (textures.path / "dots.npy").unlink()
    with pytest.raises(FileError, match="its image dots.npy is missing"):
        textures["dots"]
    (textures.path / "manifest.json").write_text('{"version": 9, "textures": {}}')
    with pytest.raises(FileError, match="has version 9"):
        textures.list()
    (textures.path / "manifest.json").write_text('{"layout": 1, "textures": {}}')
    with pytest.raises(
        FileError, match="has version 1, but this texrs reads version 2; add the textures to a new folder"
    ):
        textures.list()

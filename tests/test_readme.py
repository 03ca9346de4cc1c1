"""The commands of the README, the first pages and the guides run unchanged, one after the other."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

import texrs
from texrs import io, samples
from texrs.cli import main

ROOT = Path(__file__).resolve().parents[1]
PAGES = ("README.md", "docs/five-minutes.md", "docs/install.md")


def list_commands(page: str) -> list[str]:
    """Return the commands of texrs in a page, without those that set up an environment."""
    blocks = re.findall(r"^```sh\n(.*?)^```", (ROOT / page).read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    lines = [line.partition("  #")[0].strip() for block in blocks for line in block.splitlines()]
    return [line for line in lines if line.startswith("texrs ")]


@pytest.mark.parametrize("page", PAGES)
def test_commands_are_run_as_they_stand(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    commands = list_commands(page)
    assert commands
    for command in commands:
        assert main(shlex.split(command)[1:]) == 0, command


GUIDES = sorted(
    path.stem for path in (ROOT / "docs" / "guides").glob("*.md") if "\ntexrs " in path.read_text(encoding="utf-8")
)


@pytest.fixture(scope="module")
def examples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder that guides start from: all samples, the generated ones smaller than for a reader."""
    folder = tmp_path_factory.mktemp("guides")
    solid = ["particles", "stripes", "weave_solid", "wood_solid"]
    planar = [name for name in samples.names() if name not in solid]
    out = str(folder / "pictures")
    assert main(["samples", *planar, "-o", out, "--size", "128", "-q"]) == 0
    assert main(["samples", *solid, *samples.photographs(), "-o", out, "-q"]) == 0
    # Create the files that readers make themselves: a mask for each name in the guides, and the maps of a material.
    hole = np.zeros((128, 128), np.uint8)
    hole[48:80, 44:70] = 255
    ground = np.full((128, 128), 255, np.uint8)
    for name, mask in (("hole", hole), ("object", hole), ("ground", ground)):
        io.write(folder / f"{name}.png", mask)
    samples.particles((32, 36, 40)).image[..., 0].astype("<u2").tofile(folder / "scan.raw")
    pebbles = samples.pebbles((96, 96)).image
    for name in ("photos", "masks", "textures/walls", "textures/floors"):
        (folder / name).mkdir(parents=True)
    for name in ("photos/wall.jpg", "textures/walls/wall.jpg", "textures/floors/T_Moss_BaseColor.png"):
        io.write(folder / name, samples.pebbles((128, 128)).image)
    io.write(folder / "textures/floors/T_Moss_Roughness.png", samples.pebbles((128, 128)).image[..., 0])
    io.write(folder / "masks/wall_mask.png", hole)
    texrs.Material({"albedo": pebbles, "height": pebbles[..., 1].astype("float32")}).save(folder / "rock")
    return folder


@pytest.mark.parametrize("guide", GUIDES)
def test_commands_of_guides_are_run_as_they_stand(
    guide: str, examples: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = f"docs/guides/{guide}.md"
    for each in examples.iterdir():
        (tmp_path / each.name).symlink_to(each)
    monkeypatch.chdir(tmp_path)
    recipes = re.findall(r"^```toml\n(.*?)^```", (ROOT / page).read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    for recipe in recipes:
        Path("stones.toml").write_text(recipe, encoding="utf-8")
    for command in list_commands(page):
        if not command.startswith("texrs samples"):
            assert main([*shlex.split(command)[1:], "-q"][: None if "info" not in command else -1]) == 0, command


def test_commands_for_those_who_come_from_elsewhere_are_run(
    examples: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for each in examples.iterdir():
        (tmp_path / each.name).symlink_to(each)
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "docs" / "coming-from.md").read_text(encoding="utf-8")
    commands = [
        c for c in re.findall(r"`(texrs [a-z]+ [^`]+ -o [^`]+)`", text) if c.count("pictures/") or c.count("rock")
    ]
    assert len(commands) > 10
    for command in dict.fromkeys(commands):
        assert main([*shlex.split(command)[1:], "-q", "--force"]) == 0, command


def test_the_readme_is_short() -> None:
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 120


def test_commands_of_concepts_are_there() -> None:
    from texrs.cli import GROUPS

    known = {name for commands in GROUPS.values() for name in commands}
    for page in (ROOT / "docs" / "concepts").glob("*.md"):
        used = set(re.findall(r"`texrs ([a-z-]+) ", page.read_text(encoding="utf-8")))
        assert used <= known, f"{page.name}: {used - known}"


def test_links_lead_somewhere() -> None:
    written = [
        page for folder in (".", "guides", "concepts", "papers") for page in (ROOT / "docs" / folder).glob("*.md")
    ]
    for page in [ROOT / "README.md", *written]:
        for link in re.findall(r"\]\(([^)#]+)\)", page.read_text(encoding="utf-8")):
            if "://" not in link and "generated" not in link:
                assert (page.parent / link).exists(), f"{page.name}: {link}"

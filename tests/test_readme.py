"""The commands that the README and the first pages of the documentation show are run as they stand, one after the other."""

import re
import shlex
from pathlib import Path

import pytest

from texrs.cli import main

ROOT = Path(__file__).resolve().parents[1]
PAGES = ("README.md", "docs/five-minutes.md", "docs/install.md")


def list_commands(page: str) -> list[str]:
    """Return the commands of texrs in a page; what sets up an environment is not among them."""
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


def test_the_readme_is_short() -> None:
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 120


def test_links_lead_somewhere() -> None:
    for page in [ROOT / "README.md", *(ROOT / "docs").glob("*.md"), *(ROOT / "docs" / "guides").glob("*.md")]:
        for link in re.findall(r"\]\(([^)#]+)\)", page.read_text(encoding="utf-8")):
            if "://" not in link and "generated" not in link:
                assert (page.parent / link).exists(), f"{page.name}: {link}"

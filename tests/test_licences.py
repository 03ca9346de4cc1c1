"""Dependencies of texrs have permitted licences, and others are refused."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
pytestmark = pytest.mark.skipif(shutil.which("cargo") is None, reason="needs cargo")


def run(*given: str, path: Path | None = None) -> subprocess.CompletedProcess[str]:
    env = os.environ if path is None else {**os.environ, "PYTHONPATH": str(path)}
    return subprocess.run([sys.executable, ".ci/licences", *given], cwd=ROOT, env=env, capture_output=True, text=True)


@pytest.fixture
def free(tmp_path: Path) -> str:
    """Return the manifest of a crate without dependencies."""
    return write_crate(tmp_path / "free", "MIT OR Apache-2.0")


def write_crate(folder: Path, licence: str, needs: str = "") -> str:
    (folder / "src").mkdir(parents=True)
    (folder / "src/lib.rs").touch()
    (folder / "Cargo.toml").write_text(
        f'[package]\nname = "{folder.name}"\nversion = "1.0.0"\nlicense = "{licence}"\n[workspace]\n{needs}'
    )
    return str(folder / "Cargo.toml")


def install(folder: Path, name: str, *about: str) -> Path:
    """Write the metadata of an installed package."""
    (folder / f"{name}-1.0.dist-info").mkdir(parents=True)
    lines = ["Metadata-Version: 2.4", f"Name: {name}", "Version: 1.0", *about]
    (folder / f"{name}-1.0.dist-info/METADATA").write_text("\n".join(lines) + "\n")
    return folder


def test_all_that_texrs_needs_is_free() -> None:
    done = run()
    if "offline" in done.stderr or "download" in done.stderr:
        pytest.skip("Cargo has not all crates here")
    assert done.returncode == 0, done.stderr
    assert " 0 refused" in done.stdout


@pytest.mark.parametrize(
    "licence",
    ["GPL-3.0-only", "AGPL-3.0-or-later", "MIT AND GPL-2.0-or-later", "(MIT OR ISC) AND LGPL-3.0-only", "SSPL-1.0"],
)
def test_a_crate_that_is_not_free_is_refused(tmp_path: Path, licence: str) -> None:
    write_crate(tmp_path / "theirs", licence)
    ours = write_crate(tmp_path / "ours", "MIT", '[dependencies]\ntheirs = { path = "../theirs" }\n')
    done = run("--crates", ours, "--python", "numpy")
    assert done.returncode == 1
    assert f"theirs 1.0.0 is under {licence}" in done.stderr


def test_a_choice_of_licences_is_enough(tmp_path: Path) -> None:
    ours = write_crate(tmp_path / "ours", "GPL-2.0-only OR (MIT AND Apache-2.0 WITH LLVM-exception)")
    assert run("--crates", ours, "--python", "numpy").returncode == 0


@pytest.mark.parametrize(
    "about",
    [
        ["License-Expression: GPL-3.0-or-later"],
        ["Classifier: License :: OSI Approved :: GNU General Public License v3 (GPLv3)"],
        ["License: GNU GPLv3"],
        ["Classifier: License :: OSI Approved :: MIT License", "License: GPL-3.0"],
        [],
    ],
    ids=["expression", "classifier", "word", "contradiction", "silence"],
)
def test_a_package_that_is_not_free_is_refused(tmp_path: Path, free: str, about: list[str]) -> None:
    install(tmp_path / "site", "theirs", *about)
    install(tmp_path / "site", "between", "License-Expression: MIT", "Requires-Dist: theirs>=1")
    done = run("--crates", free, "--python", "between", path=tmp_path / "site")
    assert done.returncode == 1
    assert "theirs 1.0 is under" in done.stderr
    assert "1 refused" in done.stdout


def test_what_an_extra_asks_for_is_looked_at(tmp_path: Path, free: str) -> None:
    site = install(tmp_path / "site", "theirs", "License: GPL")
    install(site, "between", "License: BSD", "Provides-Extra: more", 'Requires-Dist: theirs; extra == "more"')
    assert run("--crates", free, "--python", "between", path=site).returncode == 0
    assert run("--crates", free, "--python", "between[more]", path=site).returncode == 1


def test_what_is_not_installed_is_named(free: str) -> None:
    done = run("--crates", free, "--python", "texrs-needs-no-such-package")
    assert done.returncode == 0
    assert "not looked at: texrs-needs-no-such-package" in done.stdout

"""The notices of the crates that are linked into the extension equal those of the locked crates."""

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
NOTICES = (ROOT / "THIRD-PARTY.md").read_text(encoding="utf-8")


def test_every_crate_is_locked_and_has_its_licence() -> None:
    listed = re.findall(r"^\| (\S+) \| (\d\S+) \| (.+?) \|", NOTICES, re.MULTILINE)
    locked = {
        (p["name"], p["version"]) for p in tomllib.loads((ROOT / "Cargo.lock").read_text(encoding="utf-8"))["package"]
    }
    assert len(listed) > 50
    assert {(name, version) for name, version, _ in listed} <= locked
    for name, version, licence in listed:
        assert f"{name} {version}" in NOTICES.partition("\n## ")[2], name
        assert not re.search(r"\bA?L?GPL", licence), name
    for name in tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["dependencies"]:
        assert name in {each for each, _, _ in listed} | {"thiserror"}, name


@pytest.mark.skipif(shutil.which("cargo") is None, reason="needs cargo")
def test_the_notices_are_what_cargo_says_now() -> None:
    done = subprocess.run([sys.executable, ".ci/third-party", "--check"], cwd=ROOT, capture_output=True, text=True)
    if "offline" in done.stderr or "download" in done.stderr:
        pytest.skip("Cargo has not all crates here")
    assert done.returncode == 0, done.stderr

"""What users see is what is stored: signatures, help texts, and the answers to unsuitable values (see `pins`)."""

import difflib
import inspect
import os
import warnings
from pathlib import Path

import pytest

import pins
from pins import faces, refusals
from texrs import samples

TEXTS = {
    "signatures": lambda place: faces.list_signatures(),
    "help": lambda place: faces.list_helps(),
    "refusals": lambda place: refusals.list_refusals(place, inner=False),
    "refusals_of_modules": lambda place: refusals.list_refusals(place, inner=True),
}
HOW = "if that is meant, run REGENERATE=1 python -m pytest tests/test_pins.py, and look at the diff of tests/pins"


@pytest.fixture(autouse=True)
def _drawn_anew(monkeypatch):
    """Use the original generators of samples, because examples must call them (see `conftest`)."""
    warnings.simplefilter("ignore")
    for name in samples._GENERATORS:
        monkeypatch.setattr(samples, name, inspect.unwrap(getattr(samples, name)))


@pytest.mark.parametrize("name", TEXTS)
def test_what_users_see_is_what_is_stored(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found, file = list(TEXTS[name](tmp_path)), Path(pins.__file__).with_name(f"{name}.txt")
    if os.environ.get("REGENERATE") == "1":
        file.write_text("\n".join(found) + "\n", encoding="utf-8")
    changed = list(
        difflib.unified_diff(file.read_text(encoding="utf-8").splitlines(), found, "stored", "now", "", "", 0, "")
    )
    assert not changed, "\n".join([f"{name}: {HOW}", *changed[:60]])

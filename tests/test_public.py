"""The public face: names that are there, nothing beside them, and loaded when they are used."""

import subprocess
import sys
from types import ModuleType

import pytest

import texrs


def public_modules() -> list[ModuleType]:
    found, left = [], [texrs]
    while left:
        module = left.pop()
        found.append(module)
        left += [m for m in (getattr(module, n) for n in module.__all__) if isinstance(m, ModuleType)]
    return sorted(found, key=lambda m: m.__name__)


MODULES = public_modules()


def test_modules_are_found() -> None:
    names = {module.__name__ for module in MODULES}
    assert {"texrs", "texrs.errors", "texrs.fields", "texrs.io", "texrs.kernels", "texrs.kernels.seam"} <= names


@pytest.mark.parametrize("module", MODULES, ids=lambda m: m.__name__)
def test_dir_shows_public_names_alone(module: ModuleType) -> None:
    assert sorted(dir(module)) == sorted(module.__all__)
    assert all(hasattr(module, name) for name in module.__all__)


@pytest.mark.parametrize("name", [n for n in texrs.__all__ if not n.startswith("_")])
def test_public_names_are_documented(name: str) -> None:
    text = getattr(texrs, name).__doc__
    # What a dataclass writes of itself is its signature.
    assert text
    assert not text.startswith(f"{name}(")


def test_importing_texrs_loads_no_library() -> None:
    code = "import sys, texrs; print(sorted({'numpy', 'scipy', 'skimage', 'texrs._rust'} & sys.modules.keys()))"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "[]"


def test_a_name_loads_no_more_than_it_needs() -> None:
    code = "import sys, texrs; texrs.kernels; texrs.io; print(sorted({'scipy', 'skimage', 'PIL'} & sys.modules.keys()))"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "[]"

"""The notebooks of the examples run from top to bottom."""

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
NOTEBOOKS = sorted(EXAMPLES.glob("*.ipynb"))


@cache
def run(notebook: Path) -> dict[str, Any]:
    """Execute the cells of a notebook once, and return the names that they define."""
    names: dict[str, Any] = {}
    for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"]:
        if cell["cell_type"] == "code":
            assert not cell["outputs"], "results are not stored in a notebook"
            exec(compile("".join(cell["source"]), str(notebook), "exec"), names)
    return names


def test_there_is_a_notebook() -> None:
    assert NOTEBOOKS


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_run(notebook: Path) -> None:
    run(notebook)


def test_a_larger_microstructure_has_the_statistics_of_its_scan() -> None:
    names = run(EXAMPLES / "microstructure.ipynb")
    scan, grown = names["scan"], names["grown"].image
    assert set(np.unique(grown)) <= set(np.unique(scan))
    assert (names["kept"].image[names["core"]] == names["values"][names["core"]]).all()
    assert abs((grown == 1).mean() - (scan == 1).mean()) < 0.05
    assert names["difference"] < 0.05

"""Independent evaluators of results, loaded from Python files that the command line names."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from typing import Any

import numpy as np


def load(path: Path) -> Any:
    """Return the module in a file."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    spec.loader.exec_module(module)
    return module


class Judges:
    """Scores of several evaluators for images made from one exemplar.

    An evaluator is a module with ``BOUNDS``. A bound is the maximum, or the minimum and the maximum. The module has
    either ``Judge(exemplar)`` with the method ``scores(picture)``, or ``compare(exemplar, picture)``. Both return a
    dictionary.
    """

    def __init__(self, modules: list[Any], exemplar: np.ndarray) -> None:
        self.exemplar = as_float(exemplar)
        self.modules = [(m, m.Judge(self.exemplar) if hasattr(m, "Judge") else None) for m in modules]
        self.bounds = {
            name: bound if isinstance(bound, tuple) else (0.0, bound)
            for module in modules
            for name, bound in module.BOUNDS.items()
        }

    def scores(self, picture: np.ndarray) -> dict[str, float]:
        """Return all scores that have a bound."""
        shown, found = as_float(picture), {}
        for module, judge in self.modules:
            found |= judge.scores(shown) if judge else module.compare(self.exemplar, shown)
        return {name: value for name, value in found.items() if name in self.bounds}

    def failed(self, scores: dict[str, float]) -> list[str]:
        """Return the names of the scores outside their bounds."""
        return [n for n, v in scores.items() if not self.bounds[n][0] <= v <= self.bounds[n][1]]

    def worse(self, name: str, ours: float, real: float) -> float:
        """Return the distance of a score from perfect, divided by the distance of a real crop."""
        low, high = self.bounds[name]
        if low > 0 and high != float("inf"):
            return float(abs(np.log(max(ours, 1e-9))) / max(abs(np.log(max(real, 1e-9))), 1e-9))
        return (real / max(ours, 1e-9)) if low > 0 else (ours / max(real, 1e-9))


def as_float(picture: np.ndarray) -> np.ndarray:
    """Return colours from 0 to 1 in three channels."""
    shown = picture.astype(np.float32) / np.iinfo(picture.dtype).max if picture.dtype.kind == "u" else picture
    return np.repeat(shown[..., None], 3, axis=2) if shown.ndim == 2 else shown[..., :3]

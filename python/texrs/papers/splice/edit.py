"""Edit a texture's own layout for `texrs.self_splice` (Figure 9 of the paper) by steps in plain JSON types."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_float, as_int, as_seed, try_array
from texrs.errors import InvalidInput
from texrs.point_sets import fit_lattice, match_points, nearest_distances, spacing

__all__ = ["EditedLayout", "Step", "apply_steps", "as_steps"]

Points = NDArray[np.float64]
Step = Mapping[str, Any]

DRAWS = 24
"""Maximum number of places that are tried for an element that moves at random."""


@dataclass(frozen=True, slots=True, eq=False)
class EditedLayout:
    """A layout after its edit.

    Attributes
    ----------
    points : (n, 2) float64
        New place of each point.
    kept : (n) bool
        False for points that the edit removes.
    listed : bool
        True if the edit only moves or lists points.

    """

    points: Points
    kept: NDArray[np.bool_]
    listed: bool


def as_steps(edit: object, seed: int) -> list[dict[str, Any]]:
    """Convert an edit to a list of steps, with a seed in each random step so that the list can be repeated."""
    steps: Any = [edit] if isinstance(edit, str | Mapping) else edit
    if not isinstance(steps, Sequence):
        raise InvalidInput(f"edit: must be a name, a step or a list of steps, got {type(edit).__name__}")
    found = []
    for number, step in enumerate(steps):
        given = {"op": step} if isinstance(step, str) else step
        if not isinstance(given, Mapping) or given.get("op") not in STEPS:
            raise InvalidInput(f"edit: step {number} must have an 'op', one of {', '.join(STEPS)}; got {step!r}")
        allowed = STEPS[given["op"]][1]
        unknown = sorted(map(str, set(given) - {"op", *allowed}))
        if unknown:
            raise InvalidInput(
                f"edit: step {number}, {given['op']}, has no option {', '.join(unknown)}; its options are {', '.join(allowed)}"
            )
        plain = dict(given)
        if plain["op"] == "randomise":
            plain["seed"] = as_seed(plain.get("seed", seed), "edit: seed")
        found.append(plain)
    return found


def apply_steps(points: Points, originals: int, steps: Sequence[Step], nameable: int | None = None) -> EditedLayout:
    """Apply the steps of an edit to the points of a layout.

    Parameters
    ----------
    points : (n, 2) array
        Elements of the image, followed by their copies beyond its borders.
    originals : int
        Number of elements in the image. Steps that name elements do not move copies, but other steps do.
    steps : sequence
        Steps as returned by `as_steps`.
    nameable : int, optional
        Number of elements that a step may name. Default: all elements in the image.

    """
    at, kept = points.copy(), np.ones(len(points), bool)
    for step in steps:
        by_name = step["op"] in ("move", "remove", "points")
        at = STEPS[step["op"]][0](step, at, nameable if by_name and nameable is not None else originals, kept)
    if not np.isfinite(at).all() or np.abs(at).max() > 1e6:
        raise InvalidInput("edit: must not move elements further than 10^6 pixels")
    return EditedLayout(at, kept, all(step["op"] in ("move", "points") for step in steps))


def _read_pair(step: Step, name: str, default: object = None) -> NDArray[np.float64]:
    value = step.get(name, default)
    array = try_array(value, np.float64)
    if array.shape not in ((), (2,)) or not np.isfinite(array).all():
        raise InvalidInput(f"edit: {name} of {step['op']} must be a number or [rows, columns], got {value!r}")
    return np.array(np.broadcast_to(array, 2), np.float64)


def _read_element(step: Step, originals: int) -> int:
    return as_int(step.get("element"), f"edit: element of {step['op']}", 0, originals - 1)


def _scale_layout(step: Step, at: Points, originals: int, kept: NDArray[np.bool_]) -> Points:
    factor = _read_pair(step, "factor", 1.0)
    if (factor < 0.1).any() or (factor > 10).any():
        raise InvalidInput(f"edit: factor of scale must be from 0.1 to 10, got {factor.tolist()}")
    centre = at[:originals].mean(axis=0)
    return np.asarray((at - centre) * factor + centre, np.float64)


def _shift_layout(step: Step, at: Points, originals: int, kept: NDArray[np.bool_]) -> Points:
    return at + _read_pair(step, "by", 0.0)


def _shift_rows(step: Step, at: Points, originals: int, kept: NDArray[np.bool_]) -> Points:
    """Move every other row in one direction, and the rows between in the other."""
    by = as_float(step.get("by", 0.0), "edit: by of rows", -1e4, 1e4)
    order = np.argsort(at[:, 0], kind="stable")
    gap = 0.5 * float(np.median(nearest_distances(at[:originals], 1)))
    row = np.concatenate([[0], np.cumsum(np.diff(at[order, 0]) > gap)])
    first = row[np.flatnonzero(order < originals)[0]]
    out = at.copy()
    out[order, 1] += np.where((row - first) % 2 == 0, by, -by)
    return out


def _randomise(step: Step, at: Points, originals: int, kept: NDArray[np.bool_]) -> Points:
    """Displace points by Gaussian noise, but keep a minimum distance between them."""
    amount = as_float(step.get("amount", 0.25), "edit: amount of randomise", 0, 10)
    least = as_float(step.get("least", 0.7), "edit: least of randomise", 0, 1)
    noise = np.random.default_rng(step["seed"])
    apart = least * float(np.percentile(nearest_distances(at[:originals], 1), 10))
    sigma = amount * spacing(at[:originals])
    out = at.copy()
    for i in range(originals):
        for _ in range(DRAWS):
            there = at[i] + sigma * noise.standard_normal(2)
            others = np.hypot(*(out - there).T)
            others[i] = np.inf
            if others.min() >= apart:
                out[i] = there
                break
    return out


def _regularise(step: Step, at: Points, originals: int, kept: NDArray[np.bool_]) -> Points:
    """Move each point towards its own place on the lattice that fits all points best."""
    amount = as_float(step.get("amount", 1.0), "edit: amount of regularise", 0, 1)
    origin, basis = fit_lattice(at[:originals])
    span = np.linalg.inv(basis)
    index = np.rint((at - origin) @ span)
    low, high = index.min(axis=0).astype(int) - 1, index.max(axis=0).astype(int) + 1
    sites = np.stack(np.meshgrid(*(np.arange(a, b + 1) for a, b in zip(low, high, strict=True)), indexing="ij"), -1)
    # Round the lattice points, because many distances tie, and the last bits of the lattice's fit depend on the
    # processor.
    places = np.round(sites.reshape(-1, 2) @ basis + origin, 6)
    of, _ = match_points(places, at)
    return at + amount * (places[of] - at)


def _move_element(step: Step, at: Points, originals: int, kept: NDArray[np.bool_]) -> Points:
    if ("by" in step) == ("to" in step):
        raise InvalidInput("edit: the step move must have either 'by' or 'to'")
    out, i = at.copy(), _read_element(step, originals)
    out[i] = at[i] + _read_pair(step, "by") if "by" in step else _read_pair(step, "to")
    return out


def _remove_element(step: Step, at: Points, originals: int, kept: NDArray[np.bool_]) -> Points:
    kept[_read_element(step, originals)] = False
    return at


def _take_points(step: Step, at: Points, originals: int, kept: NDArray[np.bool_]) -> Points:
    """Replace the points by a list: in order if there is one place per element, else matched at the least cost."""
    listed = try_array(step.get("points"), np.float64)
    if listed.ndim != 2 or listed.shape[1] != 2 or not np.isfinite(listed).all():
        raise InvalidInput("edit: points must be a list of [row, column] pairs of finite numbers")
    if len(np.unique(listed, axis=0)) < len(listed):
        raise InvalidInput("edit: points must not contain the same position twice")
    if len(listed) > originals:
        raise InvalidInput(
            f"edit: points must contain at most {originals} positions, one per element; got {len(listed)}"
        )
    out = at.copy()
    of = np.arange(originals) if len(listed) == originals else match_points(at[:originals], listed)[0]
    kept[:originals] = False
    kept[of] = True
    out[of] = listed
    return out


STEPS: dict[str, tuple[Callable[[Step, Points, int, NDArray[np.bool_]], Points], tuple[str, ...]]] = {
    "scale": (_scale_layout, ("factor",)),
    "shift": (_shift_layout, ("by",)),
    "rows": (_shift_rows, ("by",)),
    "randomise": (_randomise, ("amount", "least", "seed")),
    "regularise": (_regularise, ("amount",)),
    "move": (_move_element, ("by", "element", "to")),
    "remove": (_remove_element, ("element",)),
    "points": (_take_points, ("points",)),
}
"""Steps by name: the function that applies the step to a layout, and the names of its options."""

"""Correct an analysis by a list of steps, which can be stored and repeated."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_float, as_instance, as_int
from texrs._typing import Bools, Labels
from texrs.elements._elements import ElementAnalysis
from texrs.elements._layout import Layout
from texrs.elements._mask import ellipse, round_to_odd, stamp
from texrs.elements._separation import find_nearest_pixels, label_components
from texrs.elements.arguments import as_points, find_contradiction
from texrs.errors import InvalidInput
from texrs.point_sets import directions, spacing

__all__ = ["correct"]

FEWEST = 3
"""Minimum number of elements that must remain."""
STEPS = {
    "drop": ("elements",),
    "add": ("points",),
    "move": ("element", "to"),
    "layout": ("layout",),
    "foreground": ("points", "radius"),
    "background": ("points", "radius"),
}
"""Operations, and the fields that a step with this operation must have."""
RADIUS = 4.0
"""Default radius of a painted dot of foreground or background, in pixels."""


def correct(entry: ElementAnalysis, steps: object) -> ElementAnalysis:
    """Return an analysis with corrections.

    Parameters
    ----------
    entry : ElementAnalysis
        Analysis to correct.
    steps : sequence of dict
        Corrections in order. Elements have the numbers that `draw` shows before the step, from 0:

        - ``{"op": "drop", "elements": [3, 7]}``: removes elements, and their foreground if elements are separate;
        - ``{"op": "add", "points": [[row, column], ...]}``: adds missed elements;
        - ``{"op": "move", "element": 4, "to": [row, column]}``: moves the centre of an element;
        - ``{"op": "layout", "layout": "connected"}``: changes the layout;
        - ``{"op": "foreground", "points": [[row, column], ...], "radius": 4}``, and ``"background"``: paints dots on
          the mask.

    Returns
    -------
    ElementAnalysis
        The corrected analysis. Its report contains all steps under ``"corrections"``, starting with the steps of
        earlier corrections. Known labels (`ElementAnalysis.known`) are dropped if a step adds an element or paints on the
        mask. After that, mask and points define the elements.

    Raises
    ------
    InvalidInput
        If a step is invalid, or refers to a missing element or to a place outside the image. Fewer than three elements
        remain, or the foreground becomes empty.

    Examples
    --------
    >>> from texrs import elements, samples
    >>> sample = samples.load("dots", size=(96, 96))
    >>> found = elements.analyse(sample.image, mask=sample.mask, layout="disjoint")
    >>> fewer = elements.correct(found, [{"op": "drop", "elements": [0]}])
    >>> len(found.points) - len(fewer.points)
    1

    """
    as_instance(entry, "entry", ElementAnalysis)
    known = read_steps(steps)
    for number, step in enumerate(known):
        try:
            entry = _DO[step["op"]](entry, step)
        except InvalidInput as error:
            raise InvalidInput(f"corrections: step {number}, {step['op']}: {error}") from None
    if len(entry.points) < FEWEST:
        raise InvalidInput(f"corrections: must leave at least {FEWEST} elements, left {len(entry.points)}")
    # Known elements may touch each other.
    trouble = find_contradiction(entry.mask, entry.layout, entry.wrap) if known and entry.known is None else ""
    report = {
        **entry.report,
        "corrections": [*entry.report.get("corrections", []), *known],
        "foreground": float(entry.mask.mean()),
        "spacing": spacing(entry.points),
        "warnings": [trouble] if trouble else [],
    }
    return replace(entry, report=report, directions=directions(entry.points)) if known else entry


def read_steps(steps: object) -> list[dict[str, Any]]:
    """Check a list of corrections, and return it as plain text, numbers and lists."""
    several = [steps] if isinstance(steps, Mapping) else steps
    if not isinstance(several, Sequence) or isinstance(several, str):
        raise InvalidInput(f"corrections: must be a list of steps, got {type(steps).__name__}")
    found = []
    for number, step in enumerate(several):
        if not isinstance(step, Mapping) or step.get("op") not in STEPS:
            raise InvalidInput(f"corrections: step {number}: 'op' must be one of {', '.join(STEPS)}; got {step!r}")
        allowed = STEPS[step["op"]]
        unknown = sorted(map(str, set(step) - {"op", *allowed}))
        missing = [name for name in allowed if name not in step and name != "radius"]
        if unknown or missing:
            said = f"has no option {', '.join(unknown)}" if unknown else f"needs {', '.join(missing)}"
            raise InvalidInput(f"corrections: step {number}, {step['op']}, {said}; must be one of {', '.join(allowed)}")
        found.append({str(name): _to_plain(value, number) for name, value in step.items()})
    return found


def _to_plain(value: object, number: int) -> Any:
    """Return text, numbers and lists with NumPy values converted to plain Python values."""
    try:
        return json.loads(json.dumps(value, allow_nan=False, default=lambda array: np.asarray(array).tolist()))
    except (TypeError, ValueError, RecursionError):
        raise InvalidInput(
            f"corrections: step {number}: must contain only text, numbers and lists, got {value!r}"
        ) from None


def _drop(entry: ElementAnalysis, step: Mapping[str, Any]) -> ElementAnalysis:
    listed = step["elements"] if isinstance(step["elements"], list) else [step["elements"]]
    gone = [as_int(n, "elements", 0, len(entry.points) - 1) for n in listed]
    kept = np.setdiff1d(np.arange(len(entry.points)), gone)
    mask, separate = entry.mask, entry.layout == Layout.DISJOINT
    if entry.known is not None:
        mask = mask & ~np.isin(entry.known, np.array(gone) + 1) if separate else mask
        entry = replace(entry, known=_renumber(entry.known, gone))
    elif separate:
        pieces = label_components(mask, entry.wrap)[0]
        owner = pieces[find_nearest_pixels(entry.points, mask.shape)]
        # Remove a component only if it does not contain another element.
        alone = np.setdiff1d(owner[gone], owner[kept])
        mask = mask & ~np.isin(pieces, alone[alone > 0])
    return _take(entry, kept, mask)


def _renumber(known: Labels, gone: Sequence[int]) -> Labels:
    """Return labels without some elements, given by their numbers from 0. The others keep their order."""
    kept = np.ones(int(known.max()) + 1, bool)
    kept[[0, *(n + 1 for n in gone)]] = False
    return np.where(kept, np.cumsum(kept), 0).astype(np.int32)[known]


def _add(entry: ElementAnalysis, step: Mapping[str, Any]) -> ElementAnalysis:
    size = (entry.image.shape[0], entry.image.shape[1])
    new = as_points(step["points"], size, "points")
    points = as_points(np.concatenate([entry.points, new]), size, "points")
    mask = entry.mask.copy()
    if entry.layout == Layout.DISJOINT:
        bare = new[~mask[find_nearest_pixels(new, mask.shape)]]
        stamp(mask, bare, ellipse(entry.box), entry.wrap)
    # Give an element that the user adds similarity 1, no rotation and the normal size.
    ones = np.ones(len(new))
    angles = None if entry.angles is None else np.concatenate([entry.angles, 0 * ones])
    scales = None if entry.scales is None else np.concatenate([entry.scales, ones])
    scores = np.concatenate([entry.scores, ones])
    return replace(entry, points=points, mask=mask, scores=scores, angles=angles, scales=scales, known=None)


def _move(entry: ElementAnalysis, step: Mapping[str, Any]) -> ElementAnalysis:
    number = as_int(step["element"], "element", 0, len(entry.points) - 1)
    size = (entry.image.shape[0], entry.image.shape[1])
    place, points = as_points(step["to"], size, "to"), entry.points.copy()
    if len(place) != 1:
        raise InvalidInput(f"to: must be one place (row, column), got {step['to']!r}")
    points[number] = place[0]
    return replace(entry, points=as_points(points, size, "to"))


def _name_layout(entry: ElementAnalysis, step: Mapping[str, Any]) -> ElementAnalysis:
    layout = Layout(step["layout"])
    # The mask of known meshes is the net between them.
    turned = entry.known is not None and (layout == Layout.CONNECTED) != (entry.layout == Layout.CONNECTED)
    report = {key: value for key, value in entry.report.items() if key != "found"}
    return replace(entry, layout=layout, mask=~entry.mask if turned else entry.mask, report=report)


def _dab(entry: ElementAnalysis, step: Mapping[str, Any]) -> ElementAnalysis:
    size = (entry.image.shape[0], entry.image.shape[1])
    radius = as_float(step.get("radius", RADIUS), "radius", 0.5, 1e4)
    marked: Bools = np.zeros(size, bool)
    side = round_to_odd(2 * radius + 1)
    stamp(marked, as_points(step["points"], size, "points"), ellipse((side, side)), entry.wrap)
    mask = entry.mask | marked if step["op"] == "foreground" else entry.mask & ~marked
    if mask.all() or not mask.any():
        raise InvalidInput(f"leaves {'only' if mask.all() else 'no'} foreground")
    return replace(entry, mask=mask, known=None)


def _take(entry: ElementAnalysis, kept: NDArray[np.intp], mask: Bools) -> ElementAnalysis:
    """Return an analysis with only the selected elements."""
    angles, scales = (None if a is None else a[kept] for a in (entry.angles, entry.scales))
    return replace(entry, points=entry.points[kept], mask=mask, scores=entry.scores[kept], angles=angles, scales=scales)


_DO = {
    "drop": _drop,
    "add": _add,
    "move": _move,
    "layout": _name_layout,
    "foreground": _dab,
    "background": _dab,
}

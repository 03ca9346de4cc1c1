"""DESIGN as printed: whole colour layers, each moved by the printed generator, once or more often (``method="paper"``).

Sections 3.3 and 3.4 of Shen, Jin, Mao and Feng 2006, with their misprints repaired:

- h(k), a real number, is floored before ``mod``: the worked example computes with integers;
- starts that a fixed point absorbs are refused, and the ends of (0, 255), which are reachable, are let be;
- e = xi n is clipped to the interval that the paper sets: m and n are one number, so with its u, v and xi S sees but n = 3,
  or e = 0.39, and n = 7, or e = 0.91;
- the second term of Eq. 3 is ``|C_i(v_t) - C_j(v_t)|``.

Where the paper is silent: l = n / u of half the shorter side, a = n / u of 90 degrees, everything about the centre of the
image; sense and axis are the two lowest bits of h(k) div u, up and left where the lowest is 0. (Those of h(k) itself go
with the operation: it is even for every T and odd for every R.)
"""

from __future__ import annotations

import numpy as np

from texrs._engine.noise import uniform
from texrs._typing import Bools, Floats, Labels
from texrs.errors import InvalidInput
from texrs.kernels.gather import gather
from texrs.kernels.seam import cut
from texrs.papers.design.canvas import Draft
from texrs.papers.design.logistic_map import iterate
from texrs.papers.design.operations import Operation
from texrs.papers.design.options import DeformationOptions
from texrs.papers.design.plan import Plan
from texrs.source_map import SourceMap

__all__ = ["START", "choose_operation", "choose_start", "move_layers", "stitch_layers"]

START = 0.76234783
"""Start of the logistic map for the first tile (section 3.3)."""
FARTHEST, WIDEST = 0.5, 90.0
"""What u would stand for: translation as a share of the shorter side, rotation in degrees."""


def choose_operation(value: float, side: int, options: DeformationOptions = DeformationOptions()) -> Operation:
    """Choose O(m) and its extent from one value of the logistic map (section 3.3, step 2).

    Parameters
    ----------
    value : float
        h(k), 0 to 255.
    side : int
        Shorter side of the exemplar, in pixels.
    options : DeformationOptions
        ``u``, ``v``, ``xi`` and ``scale``.

    Returns
    -------
    Operation
        Kind, extent and axis.

    Examples
    --------
    >>> choose_operation(37, 100)
    Operation(kind='S', amount=0.91, axis=1)

    """
    h = int(value)
    n = h % options.u
    kind = "TRMS"[n % options.v]
    sense, axis = (1 if h // options.u % 2 else -1), h // options.u // 2 % 2
    least, largest = options.scale
    amount = {
        "T": float(sense * round(n / options.u * FARTHEST * side)),
        "R": sense * n / options.u * WIDEST,
        "M": 0.0,
        "S": min(max(round(options.xi * n, 2), least), largest),
    }[kind]
    return Operation(kind, amount, axis)


def move_layers(plan: Plan, seed: int, which: int, tile: int) -> Draft:
    """Move the layers of an exemplar, and stitch them."""
    options = plan.moves.options
    start = choose_start(options.start, options.growth_rate, seed, which, tile)
    return stitch_layers(plan.guide, plan.parts.elements, start, options)


def choose_start(start: float | None, growth_rate: float, seed: int, which: int, number: int) -> float:
    """Return the start of the logistic map for a tile of an exemplar: the paper's for the first one, others by the seed."""
    if (which, number) == (0, 0):
        return START if start is None else start
    for attempt in range(64):
        drawn = 2 * uniform(seed, which, number, attempt, 5) - 1
        try:
            iterate(drawn, growth_rate)
        except InvalidInput:
            continue
        return drawn
    return START


def stitch_layers(
    picture: Floats, layers: Labels, start: float, options: DeformationOptions = DeformationOptions()
) -> Draft:
    """Move each layer by one operation, or several, and cut it into those before it, at the plain cost of Eq. 3.

    A layer that lies wholly over others is lost: nothing ties the minimum cut to it.

    Parameters
    ----------
    picture : (H, W, C) float32
        The exemplar.
    layers : (H, W) int32
        The layer of each pixel, from 0.
    start : float
        Of the logistic map (Eq. 2).
    options : DeformationOptions
        How many operations, and how they are chosen.

    Returns
    -------
    Draft
        What is covered, and how.

    """
    shape = layers.shape
    count = int(layers.max()) + 1
    each = 1 if options.operations is None else options.operations
    values = iterate(start, options.growth_rate, count * each)
    whole = SourceMap.identity(shape)
    covered = np.zeros(shape, bool)
    made = Draft(np.zeros_like(picture), whole.coordinates.copy(), whole.label, covered, [], (False, False), [])
    centre, last = (np.array(shape) - 1) / 2, np.array(shape) - 1
    for layer in range(count):
        chosen = [choose_operation(h, min(shape), options) for h in values[layer * each : (layer + 1) * each]]
        matrix, shift = np.eye(2), np.zeros(2)
        for operation in chosen:
            matrix, shift = operation.matrix() @ matrix, shift + operation.shift()
        inverse = np.asarray(np.linalg.inv(matrix), np.float64)
        places: Floats = (centre + (whole.coordinates - centre - shift) @ inverse.T).astype(np.float32)
        inside = np.all((places >= 0) & (places <= last), axis=-1)
        mask = gather((layers == layer).astype(np.float32), places, interpolation="linear")
        offered: Bools = inside & (mask > 0.5)
        colours = gather(picture, places, interpolation="cubic")
        taken = offered
        if (offered & made.covered).any():
            taken = offered & cut(made.colours, colours, made.covered, offered, cost="paper").mask
        made.colours[taken] = colours[taken]
        made.coordinates[taken] = places[taken]
        made.label[taken] = layer
        made.covered[taken] = True
        made.frames.append(inverse)
        made.log.append({"element": layer, "operations": [o.describe() for o in chosen]})
    return made

"""DESIGN as printed (``method="paper"``): a logistic map moves whole colour layers.

This implements sections 3.3 and 3.4 of Shen, Jin, Mao and Feng 2006, with their misprints repaired:

- The real number h(k) is floored before ``mod``, because the worked example computes with integers.

- A start raises an error if the logistic map reaches a fixed point from it. The paper's interval (0, 255) is open, but
  0 and 255 are reachable, and are allowed.

- e = xi n is clipped to the interval of the paper. The operation m and the extent n come from one number. With the
  paper's u, v and xi, S therefore only occurs with n = 3 (e = 0.39) and n = 7 (e = 0.91).

- The second term of Eq. 3 is ``|C_i(v_t) - C_j(v_t)|``.

The paper does not specify some details. Here the length l is n / u of half the shorter side, and the angle a is n / u
of 90 degrees. Every operation is about the centre of the image. The two lowest bits of h(k) div u are the sense and
the axis. If the lowest bit is 0, the sense is up or left. (The lowest bits of h(k) itself depend on the operation:
h(k) is even for every T and odd for every R.)
"""

from __future__ import annotations

import numpy as np

from texrs._engine.noise import uniform
from texrs._typing import Bools, Floats, Labels
from texrs.errors import InvalidInput
from texrs.kernels.gather import sample
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
"""Largest extents, which n = u would give: translation as a share of the shorter side, and rotation in degrees."""


def choose_operation(value: float, side: int, options: DeformationOptions = DeformationOptions()) -> Operation:
    """Return the operation O(m) and its extent, chosen by one value of the logistic map (section 3.3, step 2).

    Parameters
    ----------
    value : float
        Value h(k), 0 to 255.
    side : int
        Shorter side of the exemplar, in pixels.
    options : DeformationOptions
        Options of the deformation. Only ``u``, ``v``, ``xi`` and ``scale`` are used. Default: the default options.

    Returns
    -------
    Operation
        Operation with its kind, extent and axis.

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
    """Move the colour layers of an exemplar as the logistic map chooses, and stitch them."""
    options = plan.moves.options
    start = choose_start(options.start, options.growth_rate, seed, which, tile)
    return stitch_layers(plan.guide, plan.parts.elements, start, options)


def choose_start(start: float | None, growth_rate: float, seed: int, which: int, number: int) -> float:
    """Return the logistic map's start for a tile: the given or printed one for the first tile, else a random one."""
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
    """Move each layer, and stitch it into the earlier layers along a minimum cut with the cost of Eq. 3.

    A layer that lies completely over earlier layers disappears, because no hard constraint forces the cut to keep it.

    Parameters
    ----------
    picture : (H, W, C) float32
        The exemplar.
    layers : (H, W) int32
        The layer number of each pixel, from 0.
    start : float
        Start of the logistic map (Eq. 2).
    options : DeformationOptions
        Number of operations on each layer, and the constants that choose them. Default: the default options.

    Returns
    -------
    Draft
        The covered pixels, their colours, source positions and labels, and the operations.

    """
    shape = layers.shape
    count = int(layers.max()) + 1
    each = 1 if options.operations is None else options.operations
    values = iterate(start, options.growth_rate, count * each)
    whole = SourceMap.identity(shape)
    covered = np.zeros(shape, bool)
    made = Draft(np.zeros_like(picture), whole.coordinates.copy(), whole.label, covered, [], (False, False), [])
    centre, last = (np.array(shape) - 1) / 2, np.array(shape) - 1
    # Move each layer by its operations, about the centre of the image.
    for layer in range(count):
        chosen = [choose_operation(h, min(shape), options) for h in values[layer * each : (layer + 1) * each]]
        matrix, shift = np.eye(2), np.zeros(2)
        for operation in chosen:
            matrix, shift = operation.matrix() @ matrix, shift + operation.shift()
        inverse = np.asarray(np.linalg.inv(matrix), np.float64)
        places: Floats = (centre + (whole.coordinates - centre - shift) @ inverse.T).astype(np.float32)
        inside = np.all((places >= 0) & (places <= last), axis=-1)
        # The layer covers a pixel if it has more than half of the interpolation weight at the pixel's source position.
        mask = sample((layers == layer).astype(np.float32), places, interpolation="linear")
        offered: Bools = inside & (mask > 0.5)
        colours = sample(picture, places, interpolation="cubic")
        taken = offered
        if (offered & made.covered).any():
            taken = offered & cut(made.colours, colours, made.covered, offered, cost="paper").mask
        # Copy the pixels that only this layer covers, and in overlaps the pixels that the cut gave to it.
        made.colours[taken] = colours[taken]
        made.coordinates[taken] = places[taken]
        made.label[taken] = layer
        made.covered[taken] = True
        made.frames.append(inverse)
        made.log.append({"element": layer, "operations": [o.describe() for o in chosen]})
    return made

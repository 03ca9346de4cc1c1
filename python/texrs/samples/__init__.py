"""Pictures and volumes whose contents are known exactly.

Each generator draws a texture as a small photograph would show it (a relief under a sun and a sky,
with colours that vary within and between its elements, and the grain of a sensor) and returns it
with what it drew: where every element is, which pixels are its own, how large the texture is
on screen and how its frame is turned. They are what texrs is tested on and shown with, and they are
CC0: use them as you like.

====================  =======================================  =========  ==============================
name                  what it shows                            layout     known
====================  =======================================  =========  ==============================
`bark`                furrowed bark                                       nothing
`beans`               touching beans of one colour             disjoint   elements
`bricks`              a wall, 21 whole vertical joints         jointed    elements
`dots`                sewing buttons on paper                  disjoint   elements
`grit`                crushed stone, several layers deep                  nothing
`leaves_and_flowers`  flowers of 5 to 8 petals on leaves       disjoint   elements
`net`                 a rope net over dark water               connected  elements: the cells; the net
`pebbles`             rounded stones on sand                   disjoint   elements
`scales`              overlapping scales of a fish                        elements
`tilted_bricks`       a wall seen aslant                       jointed    elements, scale, jacobians
`tilted_discs`        round tiles of a floor seen aslant       disjoint   elements, scale, jacobians
`weave`               a plain weave                                       elements
`particles`           a volume: ellipsoids of three colours    disjoint   elements
`stripes`             a volume: folded layers, 9 voxels apart             mask, jacobians
`weave_solid`         a volume: layers of woven yarn                      mask
`wood_solid`          a volume: growth rings and fibres                   mask
====================  =======================================  =========  ==============================

The same size and seed give the same bytes. `load` calls a generator by name, and knows the
photographs that come with scikit-image besides.

Examples
--------
>>> from texrs import samples
>>> stones = samples.pebbles((128, 128), seed=1)
>>> stones
Sample('pebbles', 128x128x3, known: centres, labels, mask, layout)
>>> samples.load("coins").image.shape
(303, 384)
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from texrs.errors import InvalidInput
from texrs.samples._perspective import tilted_bricks, tilted_discs
from texrs.samples._photographs import PHOTOGRAPHS, photograph
from texrs.samples._regular import bricks, net, scales, weave
from texrs.samples._sample import MIN_SIDE, Sample
from texrs.samples._scattered import beans, dots, leaves_and_flowers, pebbles
from texrs.samples._solid import particles, stripes, weave_solid, wood_solid
from texrs.samples._stochastic import bark, grit

__all__ = [
    "MIN_SIDE",
    "Sample",
    "bark",
    "beans",
    "bricks",
    "dots",
    "grit",
    "leaves_and_flowers",
    "load",
    "names",
    "net",
    "particles",
    "pebbles",
    "photograph",
    "photographs",
    "scales",
    "stripes",
    "tilted_bricks",
    "tilted_discs",
    "weave",
    "weave_solid",
    "wood_solid",
]


def __dir__() -> list[str]:
    return __all__


_PLANAR = (
    bark,
    beans,
    bricks,
    dots,
    grit,
    leaves_and_flowers,
    net,
    pebbles,
    scales,
    tilted_bricks,
    tilted_discs,
    weave,
)
_SOLID = (particles, stripes, weave_solid, wood_solid)
_GENERATORS: dict[str, Callable[..., Sample]] = {f.__name__: f for f in (*_PLANAR, *_SOLID)}


def names() -> tuple[str, ...]:
    """Return the names of all generated samples.

    Returns
    -------
    tuple of str
        The pictures before the volumes.

    Examples
    --------
    >>> from texrs import samples
    >>> len(samples.names()), samples.names()[-1]
    (16, 'wood_solid')

    """
    return tuple(_GENERATORS)


def photographs() -> tuple[str, ...]:
    """Return the names of the photographs that come with scikit-image.

    Returns
    -------
    tuple of str
        None of them is the name of a generated sample.

    Examples
    --------
    >>> from texrs import samples
    >>> "grass" in samples.photographs()
    True

    """
    return PHOTOGRAPHS


def load(name: str, **options: Any) -> Sample:
    """Return the sample of that name.

    Parameters
    ----------
    name : str
        One of `names` or `photographs`.
    **options
        What the generator takes: `size`, `seed`, and `wrap` where it has it. A photograph takes
        none.

    Returns
    -------
    Sample
        Of a photograph, the image alone.

    Raises
    ------
    InvalidInput
        If nothing has that name, if a photograph is given options, or if the generator
        refuses them.
    TypeError
        If the generator has no such option.

    Examples
    --------
    >>> from texrs import samples
    >>> samples.load("weave", size=(64, 96), seed=2).image.shape
    (64, 96, 3)
    """
    if isinstance(name, str) and name in _GENERATORS:
        return _GENERATORS[name](**options)
    if isinstance(name, str) and name in PHOTOGRAPHS:
        if options:
            raise InvalidInput(f"a photograph takes no options, {name!r} got {', '.join(options)}")
        return photograph(name)
    raise InvalidInput(
        f"name must be a generated sample ({', '.join(names())}) "
        f"or a photograph ({', '.join(PHOTOGRAPHS)}), got {name!r}"
    )

"""Generated images and volumes whose elements, masks, scale and deformation are known exactly.

Each generator draws a texture as it would appear in a small photograph: a relief lit by a sun and a sky, with sensor
noise. Colours vary within and between elements. A generator returns the image with the positions and pixels of all
elements, the scale map and the Jacobians. The tests and pages of texrs use these samples. They are CC0, so use them as
you like.

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
`tilted_bricks`       a wall in oblique view                   jointed    elements, scale, jacobians
`tilted_discs`        a floor of round tiles in oblique view   disjoint   elements, scale, jacobians
`weave`               a plain weave                                       elements
`particles`           a volume: ellipsoids of three colours    disjoint   elements
`stripes`             a volume: folded layers, 9 voxels apart             mask, jacobians
`weave_solid`         a volume: layers of woven yarn                      mask
`wood_solid`          a volume: growth rings and fibres                   mask
====================  =======================================  =========  ==============================

The same size and seed give the same bytes. `load` calls a generator by name, and also loads the photographs that come
with scikit-image.

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
        Names of images first, then names of volumes.

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
        Names that `load` accepts. Generated samples have other names.

    Examples
    --------
    >>> from texrs import samples
    >>> "grass" in samples.photographs()
    True

    """
    return PHOTOGRAPHS


def load(name: str, **options: Any) -> Sample:
    """Return the generated sample or the photograph of a given name.

    Parameters
    ----------
    name : str
        One of `names` or `photographs`.
    **options
        Arguments of the generator: `size`, `seed`, and `wrap` if the generator has it. A photograph does not accept
        options.

    Returns
    -------
    Sample
        The sample. A photograph has only an image.

    Raises
    ------
    InvalidInput
        If the name is unknown, a photograph is given options, or the generator rejects a value.
    TypeError
        If the generator does not have such an option.

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
            raise InvalidInput(f"options: must be empty for a photograph, got {', '.join(options)}")
        return photograph(name)
    raise InvalidInput(
        f"name: must be a generated sample ({', '.join(names())}) "
        f"or a photograph ({', '.join(PHOTOGRAPHS)}), got {name!r}"
    )

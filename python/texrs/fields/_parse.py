"""Fields as texts, such as ``zigzag:period=64``, which the command line uses."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Sequence
from difflib import get_close_matches

from texrs.errors import InvalidInput
from texrs.fields import _shapes
from texrs.fields.field import Field
from texrs.fields.spaced import as_distances, space

_KNOWN: dict[str, Callable[..., Field]] = {
    f.__name__: f
    for f in (
        _shapes.identity,
        _shapes.circular,
        _shapes.zigzag,
        _shapes.rotation,
        _shapes.rotation_3d,
        _shapes.shear,
        _shapes.spiral,
        _shapes.scale_ramp,
    )
}
_WORDS = ("axis", "plane", "radial")


def names() -> dict[str, str]:
    """Return the fields of `parse`, with their parameters and defaults.

    Returns
    -------
    dict of str to str
        Text of the default field for each name.

    Examples
    --------
    >>> from texrs import fields
    >>> fields.names()["zigzag"]
    'zigzag:period=32,angle=30,axis=,plane=xy'

    """
    out = {}
    for name, make in _KNOWN.items():
        options = [f"{k}={'' if v is None else v}" for k, v in _list_parameters(make).items()]
        out[name] = name + ":" * bool(options) + ",".join(options)
    return out


def parse(
    text: str, axes: int = 3, size: Sequence[int] | None = None, *, spacing: Sequence[float] | None = None
) -> Field:
    """Return the field that a text describes.

    Parameters
    ----------
    text : str
        Text of the form ``name`` or ``name:key=value,key=value``. A centre is written ``16x24.5x0``. `names` lists the
        fields.
    axes : int
        Number of axes, 2 or 3. Default: 3.
    size : sequence of int, optional
        Size of the output. It sets parameters that are not given, as in `Field.over`.
    spacing : sequence of float, optional
        Distances between voxels along planes, rows and columns. Places and lengths in the text are in the unit of
        these distances. Default lengths are multiples of the smallest voxel side. Default: voxels are cubes of side 1.

    Returns
    -------
    Field
        Field that the text describes.

    Raises
    ------
    InvalidInput
        If the text is invalid. The message lists the allowed values.

    Examples
    --------
    >>> from texrs import fields
    >>> fields.parse("circular:axis=y,centre=0x0x0").describe()
    'circular, round y, z outwards, about (0, 0, 0)'
    >>> fields.parse("zigzak")
    Traceback (most recent call last):
        ...
    texrs.errors.InvalidInput: field: must be one of identity, ...; got 'zigzak'; did you mean zigzag?

    """
    if not isinstance(text, str):
        raise InvalidInput(f"field: must be a string such as zigzag:period=64, got {type(text).__name__}")
    name, _, rest = text.strip().partition(":")
    if name not in _KNOWN:
        near = get_close_matches(name, _KNOWN, 1)
        hint = f"; did you mean {near[0]}?" if near else ""
        raise InvalidInput(f"field: must be one of {', '.join(_KNOWN)}; got {name!r}{hint}")
    make, options = _KNOWN[name], {}
    allowed = _list_parameters(make)
    for part in rest.split(",") if rest.strip() else []:
        key, equals, value = (p.strip() for p in part.partition("="))
        if key not in allowed or not equals or not value:
            takes = ", ".join(f"{k}=" for k in allowed) or "no options"
            raise InvalidInput(f"field: {name} accepts {takes}; got {part.strip()!r}")
        if key in options:
            raise InvalidInput(f"field: {key} is given twice in {text.strip()!r}")
        options[key] = _parse_value(key, value)
    if "axes" in inspect.signature(make).parameters:
        options["axes"] = axes
    elif axes != 3:
        raise InvalidInput(f"field: {name} is only available for volumes")
    if spacing is not None:
        # Convert default lengths from voxels to the unit of the spacing.
        unit, usual = min(as_distances(spacing, axes)), {"period": 32.0} | ({} if size else {"length": 128.0})
        options = {key: unit * length for key, length in usual.items() if key in allowed} | options
    try:
        field = space(make(**options), spacing)
    except InvalidInput as error:
        raise InvalidInput(f"field: {name}: {error}") from None
    return field if size is None else field.over(size)


def _list_parameters(make: Callable[..., Field]) -> dict[str, object]:
    return {k: p.default for k, p in inspect.signature(make).parameters.items() if k != "axes"}


def _parse_value(key: str, text: str) -> object:
    if key in _WORDS:
        return text
    try:
        if key == "centre":
            return tuple(float(p) for p in re.split(r"[x×]", text))
        return float(text)
    except ValueError:
        wanted = "numbers such as 16x24x32" if key == "centre" else "a number"
        raise InvalidInput(f"field: {key} must be {wanted}, got {text!r}") from None

"""What the numbers of a scale map are: widths, or square roots of areas."""

from __future__ import annotations

from typing import Any, Literal, TypeAlias, cast

import numpy as np

from texrs._arrays import as_choice, power_single
from texrs._show import as_png
from texrs._typing import Floats
from texrs.scale_maps._maps import MIN_SCALE, as_map

__all__ = ["AREAS", "Kind", "ScaleMap", "as_kind", "describe_kind", "find_kind", "keep_kind", "parse_kind"]

Kind: TypeAlias = Literal["width", "area"]
"""Widths across the slope of what is seen aslant, or square roots of areas, which are the power 3/2 of them."""

KINDS: tuple[Kind, Kind] = ("width", "area")
AREAS = 2 / 3
"""Power of a map of areas that is one of widths."""
KEEPS = frozenset({"multiply", "divide", "minimum", "maximum", "clip"})
"""What leaves a map of widths one of widths, where everything else that goes in is one number."""
TITLE = "scale map: "
"""Before the kind, in the description that a file has."""


class ScaleMap(np.ndarray[tuple[int, ...], np.dtype[np.float32]]):
    """A scale map that says what its numbers are: an array (H, W) of float32 with a `kind`.

    What makes scale maps gives such arrays; they are used as any other. Views, copies and multiples keep the kind. Results of
    any other arithmetic are plain arrays: a power of widths is no map of widths.

    Parameters
    ----------
    scale : (H, W) float array
        How large elements are.
    kind : {"width", "area"}
        "width": their widths across the slope, linear in the picture of a plane, as `from_angles` gives them. "area": square
        roots of their areas, as `from_mask` counts them: on a plane seen aslant the power 3/2 of the widths, for along the
        slope things are foreshortened besides.

    Raises
    ------
    InvalidInput
        Not a scale map, or another kind.

    Examples
    --------
    >>> from texrs import scale_maps
    >>> seen = scale_maps.from_angles((64, 64), slant=50, tilt=90)
    >>> seen.kind, (2 * seen).kind, seen.as_kind("area").kind
    ('width', 'width', 'area')
    >>> type(seen**1.5).__name__
    'ndarray'

    """

    kind: Kind | None

    def __new__(cls, scale: object, kind: Kind) -> ScaleMap:
        """Return a map of that kind."""
        made = as_map(scale).view(cls)
        made.kind = as_kind(kind, "kind")
        return made

    def __array_finalize__(self, other: object) -> None:
        """Keep the kind in views and copies."""
        self.kind = getattr(other, "kind", None)

    def __array_ufunc__(self, ufunc: Any, method: Any, *inputs: Any, out: Any = (), **options: Any) -> Any:
        """Return plain arrays, or a map of this kind where it stays one."""
        keeps = method == "__call__" and ufunc.__name__ in KEEPS and sum(np.ndim(i) > 0 for i in inputs) == 1
        # One over a map is none.
        keeps &= isinstance(inputs[0], ScaleMap) or ufunc.__name__ != "divide"
        if out:
            options["out"] = tuple(o.view(np.ndarray) if isinstance(o, ScaleMap) else o for o in out)
        made = getattr(ufunc, method)(
            *(i.view(np.ndarray) if isinstance(i, ScaleMap) else i for i in inputs), **options
        )
        if out:
            for each in out:
                if isinstance(each, ScaleMap):
                    each.kind = self.kind if keeps else None
            return out[0] if len(out) == 1 else out
        if keeps and getattr(made, "dtype", None) == np.float32:
            made = made.view(ScaleMap)
            made.kind = self.kind
        return made

    def __repr__(self) -> str:
        """Return the size, the kind and the range on one line."""
        if self.ndim != 2 or not self.size:
            return super().__repr__()
        kind = "" if self.kind is None else f" of {self.kind}"
        return f"<ScaleMap{kind}, {self.shape[0]} x {self.shape[1]}, {self.min():.4g} to {self.max():.4g}>"

    def _repr_png_(self) -> bytes | None:
        """Show the map with its contours in a notebook."""
        from texrs.scale_maps._false_colours import picture

        return as_png(picture(self)) if self.ndim == 2 and self.size and bool((self > 0).all()) else None

    def __reduce__(self) -> Any:
        """Keep the kind in pickles."""
        make, given, state = cast("tuple[Any, ...]", super().__reduce__())
        return make, given, (*state, self.kind)

    def __setstate__(self, state: Any, /) -> None:
        """Take up what a pickle holds."""
        super().__setstate__(state[:-1])
        self.kind = state[-1]

    def as_kind(self, kind: Kind) -> ScaleMap:
        """Return the map as one of another kind, of a plane seen aslant.

        Parameters
        ----------
        kind : {"width", "area"}
            What the map is to hold: widths across the slope, or square roots of areas.

        Returns
        -------
        (H, W) ScaleMap
            Float32; the same values where the kind was not known.

        Raises
        ------
        InvalidInput
            No such kind.

        Examples
        --------
        >>> from texrs import Plane
        >>> Plane((64, 96), slant=50).scale_map().as_kind("area").kind
        'area'

        """
        wanted = as_kind(kind, "kind")
        if self.kind is None or self.kind == wanted:
            return ScaleMap(self, wanted)
        power = AREAS if wanted == "width" else 1 / AREAS
        return ScaleMap(np.maximum(power_single(self, power), np.float32(MIN_SCALE)), wanted)


def as_kind(value: object, name: str = "scale_kind") -> Kind:
    """Check what a map is said to hold."""
    return cast("Kind", as_choice(value, name, KINDS))


def find_kind(scale: object) -> Kind | None:
    """Return what a map holds, if it says so."""
    found: Kind | None = getattr(scale, "kind", None)
    return found if found in KINDS else None


def keep_kind(made: Floats, kind: Kind | None) -> Floats:
    """Return a map that was made of another, of its kind if it says so."""
    return made if kind is None else ScaleMap(made, kind)


def describe_kind(scale: object) -> str | None:
    """Return what the file of a map is to say of it."""
    kind = find_kind(scale)
    return None if kind is None else TITLE + kind


def parse_kind(description: str | None) -> Kind | None:
    """Return the kind that a file states."""
    said = (description or "").removeprefix(TITLE).strip()
    return said if (description or "").startswith(TITLE) and said in KINDS else None

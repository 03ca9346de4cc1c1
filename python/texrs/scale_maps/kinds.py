"""The two kinds of scale maps: widths, and square roots of areas."""

from __future__ import annotations

from typing import Any, Literal, TypeAlias, cast

import numpy as np

from texrs._arrays import as_choice, power_single
from texrs._show import as_png
from texrs._typing import Floats
from texrs.scale_maps.maps import MIN_SCALE, as_map

__all__ = ["AREAS", "Kind", "ScaleMap", "as_kind", "describe_kind", "find_kind", "keep_kind", "parse_kind"]

Kind: TypeAlias = Literal["width", "area"]
"""Kind of a scale map: widths across the slope of an oblique plane, or square roots of areas (their power 3/2)."""

KINDS: tuple[Kind, Kind] = ("width", "area")
AREAS = 2 / 3
"""Power that converts a map of areas to a map of widths."""
KEEPS = frozenset({"multiply", "divide", "minimum", "maximum", "clip"})
"""Operations that keep the kind of a map if all other operands are scalars."""
TITLE = "scale map: "
"""Text before the kind in the description field of a file."""


class ScaleMap(np.ndarray[tuple[int, ...], np.dtype[np.float32]]):
    """Scale map that records its kind: a float32 array (H, W) with an attribute `kind`.

    Functions that create scale maps return such arrays, and any function of NumPy accepts them. Views, copies and
    multiples keep the kind. Results of other arithmetic are plain arrays, because a power of widths, for example, is
    not a map of widths.

    Parameters
    ----------
    scale : (H, W) float array
        Scales of the elements; 1 is their normal size.
    kind : {"width", "area"}
        Quantity in the map. "width": widths across the slope, as `from_angles` returns them; they are linear in the
        image of a plane. "area": square roots of areas, as `from_mask` measures them. On an oblique plane they are the
        power 3/2 of the widths, because elements are also foreshortened along the slope.

    Raises
    ------
    InvalidInput
        If the array is not a scale map, or the kind is unknown.

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
        """Return a map of the given kind."""
        made = as_map(scale).view(cls)
        made.kind = as_kind(kind, "kind")
        return made

    def __array_finalize__(self, other: object) -> None:
        """Keep the kind in views and copies."""
        self.kind = getattr(other, "kind", None)

    def __array_ufunc__(self, ufunc: Any, method: Any, *inputs: Any, out: Any = (), **options: Any) -> Any:
        """Return a map of the same kind if the operation keeps it, otherwise a plain array."""
        keeps = method == "__call__" and ufunc.__name__ in KEEPS and sum(np.ndim(i) > 0 for i in inputs) == 1
        # The reciprocal of a map is not a map of the same kind.
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
        """Restore the array and its kind from a pickle."""
        super().__setstate__(state[:-1])
        self.kind = state[-1]

    def as_kind(self, kind: Kind) -> ScaleMap:
        """Convert the map of an oblique plane to another kind.

        Parameters
        ----------
        kind : {"width", "area"}
            Kind of the result: widths across the slope, or square roots of areas.

        Returns
        -------
        (H, W) ScaleMap
            Float32. The values are unchanged if the map had no kind.

        Raises
        ------
        InvalidInput
            If the kind is unknown.

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
    """Check the name of a kind."""
    return cast("Kind", as_choice(value, name, KINDS))


def find_kind(scale: object) -> Kind | None:
    """Return the kind that a map records, or None."""
    found: Kind | None = getattr(scale, "kind", None)
    return found if found in KINDS else None


def keep_kind(made: Floats, kind: Kind | None) -> Floats:
    """Return a derived map with the kind of its original; None keeps a plain array."""
    return made if kind is None else ScaleMap(made, kind)


def describe_kind(scale: object) -> str | None:
    """Return the text with the kind of a map for the description field of its file, or None."""
    kind = find_kind(scale)
    return None if kind is None else TITLE + kind


def parse_kind(description: str | None) -> Kind | None:
    """Return the kind in a file's description, or None."""
    said = (description or "").removeprefix(TITLE).strip()
    return said if (description or "").startswith(TITLE) and said in KINDS else None

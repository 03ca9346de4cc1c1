"""How a picture is finished when it is looked up: kept with its source map, so that other maps are finished in the same way."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_bool, as_choice, as_float, as_instance, as_int
from texrs._show import brief
from texrs._typing import Array, Bools, Interpolation
from texrs.errors import InvalidInput

__all__ = ["RenderOptions"]

PLAIN = ("wrap", "interpolation", "antialias", "screening", "band", "across", "outlines", "flatten_lighting", "light")
"""What is said in words; the rest are masks."""


@dataclass(frozen=True, slots=True, eq=False)
class RenderOptions:
    """How a verb looks its exemplar up through its source map, and makes the seams disappear.

    `texrs.apply` does the same with any map in register, and ``texrs apply`` with files.

    Attributes
    ----------
    wrap : tuple of bool
        Axes along which the picture is cyclic.
    interpolation : {"cubic", "linear", "nearest"}
        Between samples.
    antialias : bool
        Whether the exemplar is smoothed where it is shrunk.
    screening : float, optional
        Weight of the values when seams are made to disappear, above 0, see `texrs.blend`. None: they stay as they are.
    band : int, optional
        Correct only what is at most this many pixels from a seam; all else keeps its values. None: everything.
    across : bool
        Whether values are corrected also where two exemplars meet.
    outlines : bool
        Whether the step across a seam stays where it is the outline of a thing.
    flatten_lighting : bool
        Whether uneven light is taken out of colours before they are looked up, see `texrs.materials.flatten_lighting`.
    within : (rows, columns) bool, optional
        Correct only marked pixels; all others keep their values. None: correct all.
    known : tuple of (h, w) bool, optional
        What of each exemplar may be looked at beyond a seam. None: everything.
    parts : (rows, columns) uint16, optional
        What each pixel belongs to; nothing is corrected where two of these meet. None: everywhere.
    light : (int, int), optional
        Of a picture that goes on beyond its exemplar, or in holes of it: the place (row, column) in the exemplar that its first
        pixel lies at. Slow light of each part is divided out of what is looked up, and that of where it is shown multiplied on.
        None: it brings its own light along.
    fade : (rows, columns) uint8, optional
        Weight of what is looked up, 0 to 255, where a filling fades into the exemplar of the same size. None: 255 everywhere.

    Examples
    --------
    >>> import texrs
    >>> made = texrs.synthesize(texrs.samples.pebbles((48, 48)).image, 48)
    >>> isinstance(made.source_map.finish, texrs.RenderOptions), made.source_map.finish.wrap
    (True, (False, False))

    """

    wrap: tuple[bool, ...]
    interpolation: Interpolation = "cubic"
    antialias: bool = False
    screening: float | None = None
    band: int | None = None
    across: bool = True
    outlines: bool = True
    flatten_lighting: bool = False
    within: Bools | None = None
    known: tuple[Bools, ...] | None = None
    parts: NDArray[np.uint16] | None = None
    light: tuple[int, int] | None = None
    fade: NDArray[np.uint8] | None = None

    __repr__ = brief

    def arrays(self) -> dict[str, Array]:
        """Return what is written to a file: the words as the bytes of a JSON text, and the masks.

        Returns
        -------
        dict of str to array
            ``"finish"`` is (n,) uint8; where there are any, ``"finish/within"`` and ``"finish/known/0"`` are bool, and
            ``"finish/parts"`` is uint16, ``"finish/fade"`` uint8.

        Examples
        --------
        >>> from texrs import RenderOptions
        >>> sorted(RenderOptions((True, True)).arrays())
        ['finish']

        """
        words = json.dumps({name: getattr(self, name) for name in PLAIN})
        parts: dict[str, Array] = {"finish": np.frombuffer(words.encode(), np.uint8)}
        if self.within is not None:
            parts["finish/within"] = self.within
        if self.parts is not None:
            parts["finish/parts"] = self.parts
        if self.fade is not None:
            parts["finish/fade"] = self.fade
        parts |= {f"finish/known/{i}": mask for i, mask in enumerate(self.known or ())}
        return parts

    @classmethod
    def from_arrays(
        cls, parts: Mapping[str, Array], shape: tuple[int, ...], shapes: tuple[tuple[int, ...], ...]
    ) -> RenderOptions:
        """Return what `arrays` wrote of a map of a shape, which looks into exemplars of other shapes.

        Parameters
        ----------
        parts : mapping of str to array
            As `arrays` returns them; others are left alone.
        shape : tuple of int
            Of the map, in pixels.
        shapes : tuple of tuple of int
            Of its exemplars, in pixels.

        Returns
        -------
        RenderOptions

        Raises
        ------
        InvalidInput
            Something else, or masks of other shapes.
        ValueError
            Not the text that is expected.

        Examples
        --------
        >>> from texrs import RenderOptions
        >>> RenderOptions.from_arrays(RenderOptions((True, False)).arrays(), (8, 8), ((4, 4),)).wrap
        (True, False)

        """
        if not isinstance(parts, Mapping) or not isinstance(parts.get("finish"), np.ndarray):
            raise InvalidInput("parts: needs arrays by their names, finish among them")
        shape, shapes = as_instance(shape, "shape", tuple), as_instance(shapes, "shapes", tuple)
        words: dict[str, Any] = json.loads(parts["finish"].tobytes())
        # Files of before there was flattening say nothing of it.
        if not isinstance(words, dict) or {"flatten_lighting", *words} != set(PLAIN):
            raise InvalidInput(f"finish: needs {', '.join(PLAIN)}")
        if not isinstance(words["wrap"], list) or len(words["wrap"]) != len(shape):
            raise InvalidInput(f"finish: wrap needs {len(shape)} values")
        masks = [parts[name] for i in range(len(shapes)) if (name := f"finish/known/{i}") in parts]
        within = parts.get("finish/within")
        if masks and [m.shape for m in masks] != list(shapes):
            raise InvalidInput(f"finish: known needs masks of shapes {shapes}")
        apart = parts.get("finish/parts")
        if apart is not None and (apart.shape != shape or apart.dtype != np.uint16):
            raise InvalidInput(f"finish: parts needs uint16 of shape {shape}")
        if within is not None and within.shape != shape:
            raise InvalidInput(f"finish: within needs a mask of shape {shape}")
        fade = parts.get("finish/fade")
        if fade is not None and ((fade.shape, *shapes[:1]) != (shape, shape) or fade.dtype != np.uint8):
            raise InvalidInput(f"finish: fade must be uint8 of shape {shape}, which must be that of the first exemplar")
        light = words["light"]
        if light is not None and not (isinstance(light, list) and len(light) == 2):
            raise InvalidInput("finish: light needs a row and a column")
        screening, band = words["screening"], words["band"]
        return cls(
            tuple(as_bool(w, "wrap") for w in words["wrap"]),
            cast(Interpolation, as_choice(words["interpolation"], "interpolation", ("nearest", "linear", "cubic"))),
            as_bool(words["antialias"], "antialias"),
            None if screening is None else as_float(screening, "screening", 0, 1e6),
            None if band is None else as_int(band, "band", 1, 2**31),
            as_bool(words["across"], "across"),
            as_bool(words["outlines"], "outlines"),
            as_bool(words.get("flatten_lighting", False), "flatten_lighting"),
            None if within is None else within.astype(np.bool_),
            tuple(m.astype(np.bool_) for m in masks) if masks else None,
            apart,
            None
            if light is None
            else (as_int(light[0], "light", -(2**31), 2**31), as_int(light[1], "light", -(2**31), 2**31)),
            fade,
        )

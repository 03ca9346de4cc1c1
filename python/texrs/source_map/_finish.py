"""Options with which an image was rendered.

A source map stores them, so that other maps are rendered with the same options.
"""

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
"""Attributes that are stored as JSON. The others are masks."""


@dataclass(frozen=True, slots=True, eq=False)
class RenderOptions:
    """Options with which a verb samples its exemplar through a source map and blends the seams.

    `texrs.apply` uses the same options for any other map of the exemplar, and ``texrs apply`` does so for files.

    Attributes
    ----------
    wrap : tuple of bool
        Axes along which the image is periodic.
    interpolation : {"cubic", "linear", "nearest"}
        Interpolation between samples. Default: "cubic".
    antialias : bool
        If True, smooth the exemplar wherever it is shrunk. Default: False.
    screening : float, optional
        Weight of the original values when seams are blended, above 0 (see `texrs.blend`). Default: no blending.
    band : int, optional
        Maximum distance of corrected pixels from a seam, in pixels. Default: no limit.
    across : bool
        If True, also correct values where two exemplars meet. Default: True.
    outlines : bool
        If True, keep the step across a seam where it is the outline of an element. Default: True.
    flatten_lighting : bool
        If True, remove uneven light from colours before they are sampled (see `texrs.materials.flatten_lighting`).
        Default: False.
    within : (rows, columns) bool, optional
        Mask of the pixels that may be corrected. Default: all.
    known : tuple of (h, w) bool, optional
        Masks of the pixels of each exemplar that may be read beyond a seam. Default: all.
    parts : (rows, columns) uint16, optional
        Index of the region of each pixel. The border between two regions is not corrected. Default: one region.
    light : (int, int), optional
        Position (row, column) in the exemplar of the first output pixel, if the output extends the exemplar or fills
        its holes. Samples are divided by the low-frequency light at their source, and multiplied by the light at their
        new position. Default: the light of samples does not change.
    fade : (rows, columns) uint8, optional
        Weight of the samples, 0 to 255, where a filling fades into the exemplar of the same size. Default: 255
        everywhere.

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
        """Return the arrays to store in a file: a JSON text as bytes, and the masks.

        Returns
        -------
        dict of str to array
            ``"finish"`` is (n,) uint8. The others are present if the options have them: ``"finish/within"`` and
            ``"finish/known/0"`` are bool, ``"finish/parts"`` is uint16, and ``"finish/fade"`` is uint8.

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
        """Return the options from the arrays that `arrays` returned.

        Parameters
        ----------
        parts : mapping of str to array
            Arrays by name, with the shapes that `arrays` states. Other entries are ignored.
        shape : tuple of int
            Shape of the map in pixels.
        shapes : tuple of tuple of int
            Shapes of its exemplars in pixels.

        Returns
        -------
        RenderOptions

        Raises
        ------
        InvalidInput
            If entries are missing, or masks have another shape.
        ValueError
            If the text is not JSON.

        Examples
        --------
        >>> from texrs import RenderOptions
        >>> RenderOptions.from_arrays(RenderOptions((True, False)).arrays(), (8, 8), ((4, 4),)).wrap
        (True, False)

        """
        if not isinstance(parts, Mapping) or not isinstance(parts.get("finish"), np.ndarray):
            raise InvalidInput("parts: must be a mapping of arrays by name with the entry 'finish'")
        shape, shapes = as_instance(shape, "shape", tuple), as_instance(shapes, "shapes", tuple)
        words: dict[str, Any] = json.loads(parts["finish"].tobytes())
        # Older files do not contain ``flatten_lighting``.
        if not isinstance(words, dict) or {"flatten_lighting", *words} != set(PLAIN):
            raise InvalidInput(f"finish: must contain {', '.join(PLAIN)}")
        if not isinstance(words["wrap"], list) or len(words["wrap"]) != len(shape):
            raise InvalidInput(f"finish: wrap must have {len(shape)} values")
        # Check the masks against the shapes of the map and of its exemplars.
        masks = [parts[name] for i in range(len(shapes)) if (name := f"finish/known/{i}") in parts]
        within = parts.get("finish/within")
        if masks and [m.shape for m in masks] != list(shapes):
            raise InvalidInput(f"finish: known must be masks of shapes {shapes}")
        apart = parts.get("finish/parts")
        if apart is not None and (apart.shape != shape or apart.dtype != np.uint16):
            raise InvalidInput(
                f"finish: parts must be uint16 of shape {shape}, got {apart.dtype} of shape {apart.shape}"
            )
        if within is not None and within.shape != shape:
            raise InvalidInput(f"finish: within must be a mask of shape {shape}, got {within.shape}")
        fade = parts.get("finish/fade")
        if fade is not None and ((fade.shape, *shapes[:1]) != (shape, shape) or fade.dtype != np.uint8):
            raise InvalidInput(
                f"finish: fade must be uint8 of shape {shape}, and the first exemplar must have the same shape"
            )
        light = words["light"]
        if light is not None and not (isinstance(light, list) and len(light) == 2):
            raise InvalidInput("finish: light must be a list [row, column]")
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

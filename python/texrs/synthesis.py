"""What a verb returns: the picture, its source map, the stages and a report."""

from __future__ import annotations

import json
import re
from base64 import b64encode
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Any

from texrs._arrays import as_image
from texrs._show import as_png, measure, preview, spell_list
from texrs._typing import Array, Path
from texrs._viewer import as_page
from texrs.materials._material import Material
from texrs.source_map import SourceMap

__all__ = ["ResultList", "Synthesis"]


@dataclass(frozen=True, slots=True, eq=False)
class Synthesis:
    """A synthesised texture.

    Attributes
    ----------
    image : (rows, columns[, C]) or (planes, rows, columns[, C]) array
        The result, in the dtype and with the channels of the exemplar.
    source_map : SourceMap
        Where each pixel comes from; ``source_map.render(exemplar)`` is ``stages["before_blending"]``, exactly.
    stages : mapping of str to array
        Pictures of the stages, in the order in which they were made. ``"before_blending"`` is the result before any colour
        correction.
    report : mapping of str to object
        What was decided and measured: JSON types only.
    material : Material, optional
        All maps of the result, where the exemplar was a `texrs.Material`; ``image`` is the one that shows it then.

    Examples
    --------
    >>> import texrs
    >>> pebbles = texrs.samples.pebbles((64, 64)).image
    >>> made = texrs.design(pebbles, 96, seed=1)
    >>> made.image.shape, made.source_map.shape, made.image.dtype == pebbles.dtype
    ((96, 96, 3), (96, 96), True)

    """

    image: Array
    source_map: SourceMap
    stages: Mapping[str, Array] = field(default_factory=dict)
    report: Mapping[str, Any] = field(default_factory=dict)
    material: Material | None = None

    def __repr__(self) -> str:
        """Return the size, the channels and the dtype."""
        maps = "" if self.material is None else f", maps {', '.join(self.material)}"
        return f"<Synthesis of {measure(self.image, self.source_map.axes)}{maps}>"

    def save_stages(self, folder: Path) -> list[FilePath]:
        """Write each stage as a numbered PNG, and the report as ``report.json``.

        Parameters
        ----------
        folder : path_like
            Made where it is missing; files of these names are replaced.

        Returns
        -------
        list of pathlib.Path
            The files, in the order of the stages. Of a volume three slices through its middle are shown.

        Raises
        ------
        FileError
            A file cannot be written.

        Examples
        --------
        >>> import tempfile
        >>> import numpy as np
        >>> from texrs import SourceMap, Synthesis
        >>> picture = np.zeros((4, 4), np.uint8)
        >>> result = Synthesis(picture, SourceMap.identity((4, 4)), {"before_blending": picture})
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in result.save_stages(folder)]
        ['01-composite.png', 'report.json']

        """
        from texrs.io import atomic, write
        from texrs.io._files import as_path

        directory = as_path(folder)
        directory.mkdir(parents=True, exist_ok=True)
        paths = []
        for i, (name, stage) in enumerate(self.stages.items(), start=1):
            paths.append(directory / f"{i:02d}-{re.sub('[^a-z0-9]+', '-', name.lower())}.png")
            write(paths[-1], preview(self._flatten(stage)))
        paths.append(directory / "report.json")
        with atomic(paths[-1]) as temporary:
            FilePath(temporary).write_text(json.dumps(self.report, indent=2) + "\n", encoding="utf-8")
        return paths

    def _repr_png_(self) -> bytes:
        """Show the image, or slices of a volume, in a notebook."""
        return as_png(self._flatten(self.image))

    def _repr_html_(self) -> str | None:
        """Show a volume in a notebook by slices with sliders; of a picture nothing, so that it is shown as one."""
        if self.source_map.axes == 2:
            return None
        return as_page(as_image(self.image, "image", axes=3))

    def _flatten(self, stage: Array) -> Array:
        """Return slices of what is as large as a volume; anything else is a picture already."""
        if self.source_map.axes == 2 or stage.shape[:3] != self.source_map.shape:
            return stage
        from texrs.volume import slices

        return slices(stage)


class ResultList(list[Any]):
    """A list of results that shows itself side by side in a notebook.

    Parameters
    ----------
    iterable : iterable of Synthesis, Exemplar, ElementAnalysis, SourceMap, Field or array
        What shows itself, or pictures (H, W[, C]).

    Raises
    ------
    InvalidInput
        When it is shown: something that has no picture.

    Examples
    --------
    >>> import texrs
    >>> dots = texrs.samples.dots((64, 64)).image
    >>> texrs.ResultList(texrs.synthesize(dots, 64, seed=seed) for seed in range(2))
    ResultList([<Synthesis of 64 x 64, 3 channels of uint8>, <Synthesis of 64 x 64, 3 channels of uint8>])

    """

    def __repr__(self) -> str:
        """Return the list of its results."""
        return f"ResultList({spell_list(self)})"

    def _repr_html_(self) -> str:
        """Show all that there is, side by side."""
        return "".join(f'<img src="data:image/png;base64,{b64encode(_draw(each)).decode()}">\n' for each in self)


def _draw(thing: object) -> bytes:
    if hasattr(thing, "_repr_png_"):
        return bytes(thing._repr_png_())
    pixels = as_image(thing, "results")
    return as_png(pixels[..., 0] if pixels.shape[-1] == 1 else pixels)

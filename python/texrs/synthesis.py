"""Result of a synthesis: the image, its source map, images of the stages, and a report."""

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
from texrs.materials.material import Material
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
        Source of each pixel. ``source_map.render(exemplar)`` equals ``stages["before_blending"]`` exactly.
    stages : mapping of str to array
        Images of the stages, in the order of the work. ``"before_blending"`` is the result before any colour
        correction.
    report : mapping of str to object
        Decisions and measurements, as JSON types only.
    material : Material, optional
        All maps of the result, if the exemplar was a `texrs.Material`. ``image`` is then the map that represents it.

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
            Folder for the files. It is created if needed, and files with the same names are replaced.

        Returns
        -------
        list of pathlib.Path
            The files, in the order of the stages. Volumes are shown by three slices through their middle.

        Raises
        ------
        FileError
            If a file cannot be written.

        Examples
        --------
        >>> import tempfile
        >>> import numpy as np
        >>> from texrs import SourceMap, Synthesis
        >>> picture = np.zeros((4, 4), np.uint8)
        >>> result = Synthesis(picture, SourceMap.identity((4, 4)), {"before_blending": picture})
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in result.save_stages(folder)]
        ['01-before-blending.png', 'report.json']

        """
        from texrs.io import atomic, write
        from texrs.io.files import as_path

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
        """Return the PNG that a notebook shows: the image, or slices of a volume."""
        return as_png(self._flatten(self.image))

    def _repr_html_(self) -> str | None:
        """Return a volume as slices with sliders for a notebook. Images return None and are shown as images."""
        if self.source_map.axes == 2:
            return None
        return as_page(as_image(self.image, "image", axes=3))

    def _flatten(self, stage: Array) -> Array:
        """Return slices of a volume. Images are returned unchanged."""
        if self.source_map.axes == 2 or stage.shape[:3] != self.source_map.shape:
            return stage
        from texrs.volume import slices

        return slices(stage)


class ResultList(list[Any]):
    """A list of results that is shown side by side in a notebook.

    Parameters
    ----------
    iterable : iterable of Synthesis, Exemplar, ElementAnalysis, SourceMap, Field or array
        Objects with an image, or images (H, W[, C]).

    Raises
    ------
    InvalidInput
        If an object without an image is shown.

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
        """Return all results side by side."""
        return "".join(f'<img src="data:image/png;base64,{b64encode(_draw(each)).decode()}">\n' for each in self)


def _draw(thing: object) -> bytes:
    if hasattr(thing, "_repr_png_"):
        return bytes(thing._repr_png_())
    pixels = as_image(thing, "results")
    return as_png(pixels[..., 0] if pixels.shape[-1] == 1 else pixels)

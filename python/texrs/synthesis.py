"""What a verb returns: the picture, its source map, the stages and a report."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from texrs._arrays import to_unit
from texrs._typing import Array, Path
from texrs.materials._material import Material
from texrs.source_map import SourceMap

__all__ = ["Synthesis"]


@dataclass(frozen=True, slots=True, eq=False)
class Synthesis:
    """A synthesised texture.

    Attributes
    ----------
    image : array
        The result, in the dtype and with the channels of the exemplar.
    source : SourceMap
        Where each pixel comes from; ``source.render(exemplar)`` is ``stages["composite"]``, exactly.
    stages : mapping of str to array
        Pictures of the stages, in the order in which they were made. ``"composite"`` is the result before any colour
        correction.
    report : mapping of str to object
        What was decided and measured: JSON types only.
    material : Material, optional
        All maps of the result, where the exemplar was a `texrs.Material`; ``image`` is the one that shows it then.

    """

    image: Array
    source: SourceMap
    stages: Mapping[str, Array] = field(default_factory=dict)
    report: Mapping[str, Any] = field(default_factory=dict)
    material: Material | None = None

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
        >>> result = Synthesis(picture, SourceMap.identity((4, 4)), {"composite": picture})
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in result.save_stages(folder)]
        ['01-composite.png', 'report.json']

        """
        from texrs.io import atomic, write

        directory = FilePath(folder)
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
        from texrs.io._image_io import encode

        return encode("image", preview(self._flatten(self.image)), "png")

    def _flatten(self, stage: Array) -> Array:
        """Return slices of what is as large as a volume; anything else is a picture already."""
        if self.source.axes == 2 or stage.shape[:3] != self.source.shape:
            return stage
        from texrs.volume import slices

        return slices(stage)


def preview(image: Array) -> Array:
    """Return an 8-bit grey, RGB or RGBA version of an image, to look at."""
    if image.dtype == np.bool_:
        return image.astype(np.uint8) * np.uint8(255)
    seen = image if image.ndim == 2 or image.shape[-1] in (3, 4) else image[..., 0]
    if seen.dtype == np.uint8:
        return seen
    return np.rint(to_unit(seen) * 255).astype(np.uint8)

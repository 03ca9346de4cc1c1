"""View the slices of a volume in a notebook or on an HTML page."""

from __future__ import annotations

from numpy.typing import ArrayLike

from texrs._arrays import as_bool, as_image
from texrs._conversion import as_ndarray
from texrs._show import measure
from texrs._typing import Path
from texrs._viewer import as_page
from texrs.errors import FileError
from texrs.io import atomic
from texrs.io.files import as_path
from texrs.volume.labels import label_to_color

__all__ = ["Viewer"]


class Viewer:
    """Interactive view of a volume in a notebook, with a slice and a slider for each axis.

    The view needs only a browser, without a kernel or a network. The page has at most about 1 MB, so large volumes are
    shown at a lower resolution. Notebooks show results, exemplars and samples of volumes in this way.

    Parameters
    ----------
    volume : array_like or path_like
        Volume of shape (D, H, W) or (D, H, W, C). If there are not 3 or 4 channels, only the first is shown.
    labels : bool
        If True, the values are labels, and each label gets a colour. Default: False.

    Raises
    ------
    InvalidInput
        The volume is invalid, or the values are not labels.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from texrs import samples, volume
    >>> viewer = volume.Viewer(samples.stripes((32, 32, 32)).image)
    >>> viewer
    <Viewer of 32 x 32 x 32, 3 channels of uint8>
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     page = pathlib.Path(folder, "stripes.html")
    ...     viewer.save(page)
    ...     page.read_text(encoding="utf-8")[:15]
    '<!doctype html>'

    """

    def __init__(self, volume: ArrayLike | Path, *, labels: bool = False) -> None:
        given = as_ndarray(volume, "volume", axes=3)
        self._voxels = as_image(label_to_color(given) if as_bool(labels, "labels") else given, "volume", axes=3)

    def __repr__(self) -> str:
        """Return a description with the size, channels and dtype."""
        return f"<Viewer of {measure(self._voxels, 3)}>"

    def _repr_html_(self) -> str:
        """Return the HTML that a notebook shows."""
        return as_page(self._voxels)

    def save(self, path: Path, *, overwrite: bool = True) -> None:
        """Write an HTML page that any browser can open.

        Parameters
        ----------
        path : path_like
            File with the suffix .html. If writing fails, an existing file is unchanged.
        overwrite : bool
            If True, an existing file is replaced. Default: True.

        Raises
        ------
        FileError
            The suffix is not .html, or the file cannot be written.

        Examples
        --------
        >>> import pathlib, tempfile
        >>> from texrs import samples, volume
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = pathlib.Path(folder, "stone.html")
        ...     volume.Viewer(samples.particles((32, 32, 32)).image).save(path)
        ...     path.stat().st_size > 10_000
        True

        """
        if as_path(path).suffix.lower() not in (".html", ".htm"):
            raise FileError(f"{path}: the suffix must be .html")
        head = '<!doctype html>\n<html lang="en"><meta charset="utf-8"><title>A volume</title>\n<body>\n'
        with atomic(path, overwrite=overwrite) as temporary:
            temporary.write_text(f"{head}{as_page(self._voxels)}</body></html>\n", encoding="utf-8")
